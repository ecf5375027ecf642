"""Sentences with formulas in plain characters, such as hypotheses and reasons, set with TeX.

A formula in a sentence is a longest run of symbols, numbers, brackets and operators that holds at
least one symbol and whose brackets are closed: ``D = V(u2) - V(u1), the barrier`` is one formula
and three words. A symbol is a name that the derivations know, a Greek letter, a single letter (but
for the article), or a letter with an index.
"""

from __future__ import annotations

import re
from collections.abc import Callable

_GREEK = {
    "eps": r"\varepsilon",
    "lam": r"\lambda",
    "ell": r"\ell",
    "uhat": r"\hat u",
    "oo": r"\infty",
    "Pi": r"\Pi",
    "V_max": r"V_{\max}",
    "eps_phys": r"\varepsilon",
} | {
    name: f"\\{name}"
    for name in (
        *(
            "kappa",
            "sigma",
            "Sigma",
            "phi",
            "delta",
            "Delta",
            "mu",
            "alpha",
            "beta",
            "rho",
            "omega",
        ),
        *("zeta", "theta", "pi", "psi", "xi", "tau"),
    )
}
_FUNCTIONS = {
    name: f"\\{name}" for name in ("Gamma", "log", "sin", "cos", "arccos", "min", "max", "int")
} | {name: rf"\operatorname{{{name}}}" for name in ("erf", "Ai", "Bi")}
_DIFFERENTIALS = ("du", "dy", "dz", "ds", "dp", "dt", "dW", "dT")
_SIGNS = {
    "<=": r"\le",
    ">=": r"\ge",
    "<<": r"\ll",
    ">>": r"\gg",
    "->": r"\to",
    "+-": r"\pm",
    "±": r"\pm",
    "-+": r"\mp",
    "*": r"\cdot",
    "...": r"\dots",
}
_TOKEN = re.compile(
    r"(?P<word>\b(?:eq:|sa\.)\w+|'[\w-]+'|[A-Za-z]+(?:-[A-Za-z]{2,})+|[A-Za-z]{2,}'s\b|\d+(?:\.\d+){2,}"
    r"|\b\d+-[a-z]{3,})"
    r"|(?P<side>\b[afg][+-](?=[\s,.;:)^/]|$))"
    r"|(?P<raised>\^\((?:\+-?|-|j|±)\))"
    r"|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?)"
    r"|(?P<name>[A-Za-z]_\([a-z\d+,]+\)'*|[A-Za-z]_[+-](?!\w)|[A-Za-z]+(?:_\w+|\d)?'*(?![A-Za-z]))"
    r"|(?P<sign><=|>=|<<|>>|->|\+-|-\+|\.\.\.(?=,)|(?<=\+ )\.\.\.|[=<>+\-*/^])"
    r"|(?P<bracket>[(){}|])|(?P<comma>,)|(?P<space> +)|(?P<other>.)",
    re.DOTALL,
)
_CLOSED = {")": "(", "}": "{"}
Token = tuple[str, str]


def prose(text: str, words: Callable[[str], str]) -> str:
    """`text` with its formulas between dollar signs, and all else given through `words`.

    ``relative O(kappa^2), where a+ > 0`` becomes
    ``relative $O(\\kappa^{2})$, where $a^+ > 0$``.
    """
    tokens = [(str(m.lastgroup), m[0]) for m in _TOKEN.finditer(text)]
    parts, plain, at = [], "", 0
    while at < len(tokens):
        end = _run(tokens, at)
        if end > at:
            parts += [words(plain), f"${_set(tokens[at:end])}$"]
            plain = ""
            at = end
        else:
            kind, text = tokens[at]
            if kind == "sign" and text not in "-+/*^...":
                # A relation between words.
                parts += [words(plain), f"${_SIGNS.get(text, text)}$"]
                plain = ""
            else:
                plain += text
            at += 1
    return "".join([*parts, words(plain)])


def _run(tokens: list[Token], at: int) -> int:
    """The end of the formula that begins at a token; `at` itself where none does."""
    if tokens[at][0] in ("space", "comma", "other", "word", "raised"):
        return at
    if tokens[at][1] in ("/", "=", "*", "^", ")", "}", ">", "<", "->") and at:
        return at
    end, open_ = at, list[tuple[str, int]]()
    for place in range(at, len(tokens)):
        kind, text = tokens[place]
        if kind in ("word", "other") or (kind == "comma" and not open_):
            break
        if kind == "name" and not _symbol(tokens, place):
            break
        if kind == "bracket":
            if text == "|":
                if open_ and open_[-1][0] == "|":
                    open_.pop()
                else:
                    open_.append((text, place))
            elif text in _CLOSED:
                if not open_ or open_[-1][0] != _CLOSED[text]:
                    break
                open_.pop()
            elif text == "(" and place > at and _aside(tokens, place):
                break
            else:
                open_.append((text, place))
        end = place + 1
    if open_:
        # A bracket that is not closed within the formula belongs to the sentence.
        end = open_[0][1]
    while end > at and _hangs(tokens, end - 1):
        end -= 1
    chosen = tokens[at:end]
    tells = any(
        kind in ("name", "side") or (kind == "number" and "e" in text) for kind, text in chosen
    ) or (len(chosen) > 1 and chosen[0][1] == "-" and not any(t == "/" for _, t in chosen))
    return end if tells else at


def _aside(tokens: list[Token], at: int) -> bool:
    """True for a bracket behind a space that holds a statement of its own, and no factor."""
    if tokens[at - 1][0] != "space" or tokens[at - 2][0] == "sign":
        return False
    return any(t in ("=", "<", ">", "<=", ">=") for _, t in tokens[at : _closing(tokens, at)])


def _hangs(tokens: list[Token], place: int) -> bool:
    kind, text = tokens[place]
    return kind in ("space", "comma") or (kind == "sign" and text != "...")


def _symbol(tokens: list[Token], place: int) -> bool:
    """True for a name that is a symbol or a function here."""
    name = tokens[place][1].rstrip("'")
    if name in ("a", "A"):
        after = "".join(text for _, text in tokens[place + 1 : place + 3])
        return not re.fullmatch(r" [a-zA-Z]{3,}(?:-\w+)*(?:'s)?", after) or after.strip() in _AFTER
    if name in ("exp", "sqrt"):
        return place + 1 < len(tokens) and tokens[place + 1][1] == "("
    known = name in (*_GREEK, *_FUNCTIONS, *_DIFFERENTIALS) or name in _NAMES
    known = known or ("_" in name and name.partition("_")[0] in _GREEK)
    return known or bool(
        re.fullmatch(r"[A-Za-z]_(?:\([^)]*\)|[+-])|[b-zB-Z]|[A-Za-z](?:\d|_\w+)|int_\w+", name)
    )


#: Words after which an "a" before them is no article.
_AFTER = ("less", "and", "where", "with", "for", "over", "kappa", "mu", "alpha", "lam")


#: Name of a symbol -> its TeX, where that is not the TeX of the name.
TEX = {
    "kappa": r"\kappa",
    "a_minus": "a^-",
    "a_plus": "a^+",
    "epsilon": r"\varepsilon",
    "kappa_phys": r"\kappa_p",
    "r_phys": r"r_p",
    "z0": "z_0",
    "Tf_z": r"\partial_z T_f",
    "u1": "u_1",
    "u2": "u_2",
    "V_1": "V(1)",
    "V_top": "V(1)",
    "V_0": "V(0)",
    "V_m": "V(u_m)",
    "V_u1": "V(u_1)",
    "V_u2": "V(u_2)",
    "V_max": r"V_{\max}",
    "phi_0": r"\phi(0)",
    "K_m": "V''(u_m)",
    "A_1": "A'(u_1)",
    "A_2": "A'(u_2)",
    "z_plus": "z_0^{(+)}",
    "z_minus": "z_0^{(-)}",
    "t_s": r"\tilde t",
    "A'_1": "A'(u_1)",
    "A'_2": "A'(u_2)",
    "A'": "A'(u)",
    "C_high": r"C_{\mathrm{bound}}",
    "P_low": r"P_{\mathrm{bound}}",
    "kappa_c": r"\kappa_c",
    "Lq": r"\mathcal{L}^* q",
    "LR": r"\mathcal{L}^* R",
    "kappa_e": r"\kappa_e",
    "ydot": r"\dot y",
    "zdot": r"\dot z",
    "sigma_left": r"\sigma_{\mathrm{left}}",
    "K_left": r"K_{\mathrm{left}}",
    "M_left": r"M_{\mathrm{left}}",
    "sigma_right": r"\sigma_{\mathrm{right}}",
    "K_right": r"K_{\mathrm{right}}",
    "M_right": r"M_{\mathrm{right}}",
    "lam": r"\lambda",
    "inside": r"M_{\mathrm{in}}",
    "outside": r"M_{\mathrm{out}}",
    "g_s": "g_s",
    "p_ss": r"p_{\mathrm{ss}}",
    "I_left": r"I_{\mathrm{left}}",
    "I_right": r"I_{\mathrm{right}}",
}
#: Label -> the same for the symbols of its statement and steps.
TEX_OF = {
    # As in docs/exact.md.
    "constant-panel": {"int_e": "I", "nested_down": "N_{-}", "nested_up": "N_{+}"},
    "panel-step": {
        "int_e": "I", "int_inverse": "J", "nested": "N", "fall": "f", "climb": "c",
        "e": "e(b)",
    },
    "endpoint-series": {
        "E_up": "E_k^{+}", "E_down": "E_k^{-}", "side": "s_k", "term": "h_k",
        "left": "h_k^{-}", "right": "h_k^{+}", "source": "g", "drift": r"\phi",
    },
    "pair-primitives": {
        "H_even": r"H_{\mathrm{even}}", "H_line": r"H_{\mathrm{line}}",
        "H_odd": r"H_{\mathrm{odd}}", "I": "I_{n,j+2}", "h_next": "c'_j", "b_next": "b_{i+1}",
        "s_next": "s_{n+1}", "gap": "g", "product": r"\Pi", "square": "D", "share": "s_n",
        "term": "b_i", "lower": "I_{n-1,j}", "same": "I_{n,j}", "index": "j", "power": "p",
        "before": "c_{j-1}", "after": "c_{j+1}",
    },
    "saddle-recurrences": {
        "term": "c_{j+1}", "slope": "c_1", "moment": "m_n", "m_next": "m_{n+1}",
    },
    "two-sides": {
        "behind": r"I_{\mathrm{left}}", "ahead": r"I_{\mathrm{right}}", "total": "W",
        "double_left": r"K_{\mathrm{left}}", "double_right": r"K_{\mathrm{right}}",
        "nested_left": r"J_{\mathrm{left}}", "nested_right": r"J_{\mathrm{right}}",
        "speed_start": "m", "own_left": r"m_{\mathrm{left}}", "own_right": r"m_{\mathrm{right}}",
    },
    "airy-form": {
        "I_up": "I_{+}", "I_down": "I_{-}", "I_both": "I_{+-}", "small": r"\delta",
        "even": r"\psi_{\mathrm{even}}", "odd": r"\psi_{\mathrm{odd}}", "square": "D",
        "norm": "N", "slope": "c", "side": r"\sigma",
        "bi": r"\mathrm{Bi}", "bi_slope": r"\mathrm{Bi}'", "squares": "Q", "slopes": "Q'",
        "cross": "X",
        "q_1": "q_{k+1}", "p_2": "p_{k+2}", "q_2": "q_{k+2}",
    },
    "truncated-gaussian": {
        "I_up": "I_{+}", "I_down": "I_{-}", "I_both": "I_{+-}", "gap": "g", "area": "a",
        "bottom": r"\psi(0)", "value": r"\psi(g)", "mean": r"\bar\psi", "first": r"\psi_1",
        "second": r"\psi_2", "peak": "p", "rest": "q", "tail": r"\sigma", "dawson": "D",
        "integral": "L", "a_down": "c", "B_down": "E", "b": "B", "b_down": "E", "weights": "w",
    },
    "regular-part": {
        "term": "c_i", "power": "p", "index": "i", "h_next": "c'_i", "H": "C_i",
        "phi": r"\psi",
    },
    "release-order": {"phi_y": r"\phi_y"},
    "saddle-series": {"S": "Q", "e": r"\delta"},
    "saddle-start": {"H": "H_+", "e": r"\delta"},
    "threshold": {"ell": r"\log(1/\varepsilon)", "kappa_c": r"\kappa_{c,p}"},
    "eq:Tlarge": {"T": r"T_p"},
    "eq:TtildetoT": {"T": r"T_p", "t_s": "T"},
    "eq:fourPieces": {f"T_{n}": rf"\frac{{T_{n}}}{{\lambda}}" for n in (1, 2, 3, 4)},
    "eq:scaledSDE": {"f_0": "f(0)"},
    "eq:scaledSDEx": {"F2": "A"},
}  # fmt: skip
# Those that are words with an underscore.
_NAMES = {k: v for k, v in TEX.items() if "_" in k and re.fullmatch(r"\w+", k)}


def _set(tokens: list[Token]) -> str:
    """TeX of a formula."""
    done, at, bars = "", 0, 0
    while at < len(tokens):
        kind, text = tokens[at]
        if text in ("exp", "sqrt") and at + 1 < len(tokens):
            end = _closing(tokens, at + 1)
            inner = _set(tokens[at + 2 : end])
            done += (r"\sqrt{" if text == "sqrt" else "e^{") + inner + "}"
            at = end + 1
            continue
        if text == "^" and at + 1 < len(tokens):
            end = _power(tokens, at + 1)
            exponent = tokens[at + 1 : end]
            if exponent and exponent[0][1] in "({":
                exponent = exponent[1:-1]
            # a^+ is raised in brackets.
            side = re.search(r"([afg]\^[+-])$", done)
            if side:
                done = done[: side.start()] + f"({side[1]})"
            done = done.rstrip() + f"^{{{_set(exponent)}}}"
            at = end
            continue
        if kind == "raised":
            done += f"^{{({_SIGNS.get(text[2:-1], text[2:-1])})}}"
            at += 1
            continue
        if text == "|":
            text = r"\lvert " if bars % 2 == 0 else r"\rvert "
            bars += 1
        elif kind == "name":
            text = _name(text)
        elif kind == "side":
            text = f"{text[0]}^{text[1]}"
        elif kind == "number" and "e" in text:
            mantissa, power = text.split("e")
            text = (rf"{mantissa} \times " if mantissa != "1" else "") + f"10^{{{int(power)}}}"
        elif kind == "sign":
            text = _SIGNS.get(text, text)
        elif text in "{}":
            text = "\\" + text
        if text and text[0].isalpha() and re.search(r"\\[a-zA-Z]+$", done):
            done += " "
        done += text
        at += 1
    return re.sub(" +", " ", done).strip()


def _closing(tokens: list[Token], at: int) -> int:
    """The place of the bracket that closes the one at `at`."""
    depth = 0
    for place in range(at, len(tokens)):
        depth += {"(": 1, "{": 1, ")": -1, "}": -1}.get(tokens[place][1], 0)
        if depth == 0:
            return place
    return len(tokens)


def _power(tokens: list[Token], at: int) -> int:
    """The end of an exponent."""
    if tokens[at][1] in ("(", "{"):
        return _closing(tokens, at) + 1
    return at + (2 if tokens[at][1] == "-" else 1)


def _name(text: str) -> str:
    name = text.rstrip("'")
    primes = text[len(name) :]
    if name in _FUNCTIONS:
        return _FUNCTIONS[name] + (primes or " ")
    if name in _GREEK:
        return _GREEK[name] + primes
    if name in _NAMES:
        return _NAMES[name] + primes
    head, _, index = name.partition("_")
    if name in _DIFFERENTIALS:
        return name + " "
    if not index and len(name) > 1:
        head, index = name[0], name[1:]
    if not index:
        return text
    if index.startswith("("):
        return f"{head}{primes}_{{{index[1:-1]}}}"
    head = _GREEK.get(head, head if len(head) == 1 else rf"\mathrm{{{head}}}")
    index = index if index.isdigit() or len(index) == 1 else rf"\mathrm{{{index}}}"
    return f"{head}{primes}_{index}" if len(index) == 1 else f"{head}{primes}_{{{index}}}"
