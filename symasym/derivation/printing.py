r"""Formulas in the order in which they are written by hand.

SymPy orders factors and terms by its own canonical order, keeps roots apart and puts exponentials
into numerators. Here a product is its sign, one fraction of numbers, symbols and one root, then
sums, functions, exponentials, long sums and integrals, in this order; a sum has its positive terms
first, a polynomial in :math:`u` or in a whole number and a series in :math:`1/\lambda` falling
powers; an exponent and a fraction within a fraction are written on one line:
:math:`\frac{2 \pi}{\sqrt{- A'(u_1) A'(u_2)}} e^{2 D/\kappa^2}`. Nothing is simplified: roots are
joined only where their arguments have no negative factor left alone
(:math:`\sqrt a \sqrt b = \sqrt{a b}` for :math:`a, b \ge 0`), and a factor's sign is taken
out of it only where most of its terms have it (:math:`-(1 + u)/\kappa`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import sympy
from sympy.core.function import AppliedUndef
from sympy.printing.conventions import requires_partial
from sympy.printing.latex import LatexPrinter

__all__ = ["tex"]

#: Symbols by which a polynomial is ordered.
_POSITIONS = ("u", "v")
#: Symbols in whose falling powers an expansion is ordered.
_LARGE = ("lambda", "lam")
#: Names that are words and not products of letters.
_WORDS = ("int", "nested", "climb", "fall", "drift", "noise")
#: a_minus is a with a sign above.
_SIGNS = {"minus": "-", "plus": "+"}
#: A sum whose LaTeX is longer than this stands behind functions and exponentials, as a series does.
_LONG = 120
#: The rank of what follows the fraction of a product; what has none stands in the fraction.
_SUM, _FUNCTION, _EXPONENTIAL, _DERIVATIVE, _INTEGRAL = range(1, 6)
_HALF = sympy.S.Half


def tex(expression: Any, names: Mapping[Any, str] | None = None) -> str:
    """LaTeX of a SymPy expression.

    Parameters
    ----------
    expression : SymPy expression
    names : dict, optional
        Symbol, or the name of one or of a function -> LaTeX.
    """
    return str(_Printer({"symbol_names": dict(names or {})}).doprint(expression))


class _TallError(Exception):
    """Raised for a product that is not written on one line."""


class _Printer(LatexPrinter):  # type: ignore[misc]
    """SymPy's printer with the order of factors and terms of the module's head."""

    #: True while fractions are written with a slash.
    _slash = False

    def _named(self, symbol: Any) -> str:
        """The LaTeX that a symbol was given; empty if none."""
        names = self._settings["symbol_names"]
        return str(names.get(symbol) or names.get(str(symbol), ""))

    def _print_Symbol(self, symbol: Any, style: str = "plain") -> str:
        if shown := self._named(symbol):
            return shown
        name, _, index = symbol.name.partition("_")
        head = self._deal_with_super_sub(name)
        if name in _WORDS or (head == name and len(name) > 2 and name.isalpha()):
            head = rf"\mathrm{{{name}}}"
        if index in _SIGNS:
            return rf"{head}^{_SIGNS[index]}"
        if not index or "^" in name:
            return head if not index else str(super()._print_Symbol(symbol))
        index = rf"\mathrm{{{index}}}" if len(index) > 1 and index.isalpha() else index
        return rf"{head}_{index}" if len(index) == 1 else rf"{head}_{{{index}}}"

    # -- sums ------------------------------------------------------------------------------------

    def _print_Add(self, expr: Any, order: Any = None) -> str:
        del order
        text = ""
        for number, term in enumerate(_terms(expr)):
            negative = term.could_extract_minus_sign() if term.is_Add else _negative(term)
            shown = self._print(-term if negative else term)
            if term.is_Add:
                shown = rf"\left({shown}\right)"
            sign = ("-" if negative else "") if number == 0 else (" - " if negative else " + ")
            text += sign + shown
        return text

    # -- products --------------------------------------------------------------------------------

    def _print_Mul(self, expr: Any) -> str:
        if _negative(expr):
            shown = self._print(-expr)
            return f"-{self._parenthesised(shown)}" if (-expr).is_Add else f"-{shown}"
        above, below, behind = self._sorted(_upwards(expr))
        top, bottom = self._row(above), self._row(below)
        if not below:
            if behind and len(above) == 1 and above[0].is_Add:
                top = self._parenthesised(top)
            return " ".join([*([top] if top else []), *behind])
        if self._slash:
            if behind:
                raise _TallError
            if len(above) == 1 and above[0].is_Add:
                top = self._parenthesised(top)
            return f"{top or 1}/{self._divisor(below, bottom)}"
        return " ".join([self._fraction(above, below, top or "1", bottom), *behind])

    def _fraction(self, above: list[Any], below: list[Any], top: str, bottom: str) -> str:
        """A fraction, those within it on one line; a sum with taller ones to the power -1."""
        if r"\frac" in top:
            top = self._flat(above) or top
        if r"\frac" in bottom:
            flat = self._flat(below)
            if not flat and len(below) == 1 and below[0].is_Add:
                inverse = rf"\left[{bottom}\right]^{{-1}}"
                if len(above) == 1 and above[0].is_Add:
                    top = self._parenthesised(top)
                return inverse if top == "1" else f"{top} {inverse}"
            bottom = flat or bottom
        return rf"\frac{{{top}}}{{{bottom}}}"

    def _flat(self, factors: list[Any]) -> str:
        """Factors in a row with slashes for fractions; empty where that is not done."""
        self._slash, before = True, self._slash
        try:
            return self._row(factors)
        except _TallError:
            return ""
        finally:
            self._slash = before

    @staticmethod
    def _divisor(below: list[Any], shown: str) -> str:
        """The text behind a slash, in parentheses unless it is one symbol, power or number."""
        alone = len(below) == 1 and not below[0].is_Add
        return shown if alone else f"({shown})"

    def _sorted(self, expr: Any) -> tuple[list[Any], list[Any], list[str]]:
        """Factors above and below the line, and behind the fraction as LaTeX."""
        coefficient, rest = expr.as_coeff_Mul(rational=True)
        above: list[Any] = []
        below: list[Any] = []
        roots: list[Any] = []
        divisors: list[Any] = []
        behind: list[tuple[float, Any]] = []
        # sqrt(a) sqrt(b) is sqrt(a b) where one of them may be negative, but not both.
        doubtful = None
        for factor in sympy.Mul.make_args(rest):
            base, power = factor.as_base_exp() if not isinstance(factor, sympy.exp) else (factor, 1)
            if power in (_HALF, -_HALF) and base.is_nonnegative:
                over, under = _positive_quotient(base)
                (roots if power == _HALF else divisors).append(over)
                if under != 1:
                    (divisors if power == _HALF else roots).append(under)
            elif power == _HALF and doubtful is None:
                doubtful = base
                roots.append(base)
            elif rank := _rank(base, power):
                behind.append((rank, factor))
            elif sympy.sympify(power).could_extract_minus_sign():
                below.append(base**-power)
            elif base.is_Integer and base > 1 and coefficient.p % base == 0:
                # 2 2^(2/3) is 2^(5/3).
                whole = sympy.multiplicity(base, coefficient.p)
                coefficient /= base**whole
                above.append(sympy.Pow(base, power + whole, evaluate=False))
            else:
                above.append(factor)
        coefficient, roots, divisors = _rooted(coefficient, roots, divisors)
        if coefficient.p != 1:
            above.insert(0, sympy.Integer(coefficient.p))
        if coefficient.q != 1:
            below.insert(0, sympy.Integer(coefficient.q))
        lead = ""
        if roots and divisors:
            lead = rf"\sqrt{{{self._quotient(roots, divisors)}}}"
        elif roots:
            above.append(_Root(roots))
        elif divisors:
            below.append(_Root(divisors))
        sums = [f for rank, f in behind if rank == _SUM]
        flat = all(r"\frac" not in self._print(f) for f in sums)
        divided = any(getattr(f, "is_Add", False) for f in below)
        alone = not above and len(sums) == 1
        if below and ((flat and (divided or alone)) or (divided and alone)):
            # A sum over a sum, or alone over something: no 1/x in front of it.
            above, behind = above + sums, [(rank, f) for rank, f in behind if rank != _SUM]
        if not above and len(behind) == len(below) == 1 and below[0].is_Function:
            # A quotient of functions.
            above, behind = [behind[0][1]], []
        if not above and any(isinstance(f, sympy.Integral) for f in below):
            # A quotient of integrals.
            above, behind = (
                [f for rank, f in behind if rank == _INTEGRAL],
                [item for item in behind if item[0] != _INTEGRAL],
            )
        if not below:
            # Values of functions stand behind sums: (a - C) V(v).
            behind += [(_FUNCTION, f) for f in above if isinstance(f, AppliedUndef)]
            above = [f for f in above if not isinstance(f, AppliedUndef)]
            if sums and not any(_positions(f) for f in sums):
                # The position stands behind a sum of constants: alpha (1 + mu) u.
                behind += [(_FUNCTION, f) for f in above if _positions(f)]
                above = [f for f in above if not _positions(f)]
        # sin(w) (cos(w) - sin(w)), and constants before positions.
        waves = any(rank == _FUNCTION and not isinstance(f, AppliedUndef) for rank, f in behind)
        behind = [
            (_FUNCTION + 0.5 if waves and rank == _SUM and f.has(*_WAVES) else rank, f)
            for rank, f in behind
        ]
        behind.sort(key=lambda item: (item[0], _positions(item[1]), *_alphabetical(item[1])))
        ranked = [(rank, self._behind(factor)) for rank, factor in behind]
        ranked.sort(key=lambda item: _DERIVATIVE - 0.5 if _is_long(*item) else item[0])
        shown = [text for _, text in ranked]
        return above, below, [lead, *shown] if lead else shown

    def _behind(self, factor: Any) -> str:
        shown = self._print(factor)
        return self._parenthesised(shown) if factor.is_Add else shown

    def _quotient(self, above: list[Any], below: list[Any]) -> str:
        (top, below_top), (bottom, below_bottom) = (
            sympy.fraction(sympy.Mul(*x)) for x in (above, below)
        )
        over, under = self._print(top * below_bottom), self._print(bottom * below_top)
        if self._slash:
            raise _TallError
        return rf"\frac{{{over}}}{{{under}}}"

    def _signed(self, factors: list[Any]) -> str:
        return str(self._print(sympy.Mul(*factors)))

    def _row(self, factors: Iterable[Any]) -> str:
        """Factors in a row: numbers, symbols, sums, roots."""
        factors = list(factors)
        ordered = sorted(factors, key=self._place)
        shown = []
        for factor in ordered:
            if isinstance(factor, _Root):
                shown.append(rf"\sqrt{{{self._signed(factor.factors)}}}")
            elif factor.is_Add and len(factors) > 1:
                shown.append(self._parenthesised(self._print(factor)))
            else:
                shown.append(self._print(factor))
        # A word is kept apart from the factors beside it.
        row = shown[:1]
        for before, factor in pairwise(shown):
            if before[-1].isdigit() and factor[:1].isdigit():
                row.append(rf"\cdot {factor}")
                continue
            word = before.startswith(r"\mathrm") or factor.startswith(r"\mathrm")
            row.append(rf"\, {factor}" if word else factor)
        return " ".join(row)

    def _place(self, factor: Any) -> tuple[float, str]:
        """Order in a row: numbers, constants, symbols, u and values of functions, sums, roots."""
        if isinstance(factor, _Root):
            return (1 if all(f.is_Integer for f in factor.factors) else 5), ""
        if factor.is_number:
            return (0 if factor.is_Rational else 1), str(factor)
        base = factor.as_base_exp()[0]
        if base.is_Add:
            return (1 if _counts(base) else 4), str(factor)
        named = self._named(base)
        late = isinstance(base, (sympy.Function, sympy.Derivative)) or str(base) in _POSITIONS
        late = late or "(" in named or named.startswith(r"\mathrm")
        # The large parameter comes before the letters it multiplies.
        letters = (
            ""
            if str(base) == "lam"
            else (named.lstrip("\\").removeprefix("var") or str(factor)).casefold()
        )
        # a^- a^+, as they stand on the line.
        letters = letters.replace("^-", "^!").replace("_minus", "^!").replace("_plus", "^+")
        # A derivative, d_z T, behind all that it does not act on.
        return (3.5 if named.startswith(r"\partial") else 3 if late else 2), letters

    def _parenthesised(self, shown: str) -> str:
        return rf"\left({shown}\right)" if r"\frac" in shown else f"({shown})"

    # -- powers ----------------------------------------------------------------------------------

    def _print_Pow(self, expr: Any) -> str:
        base, power = expr.base, expr.exp
        if power == _HALF:
            return rf"\sqrt{{{self._print(base)}}}"
        if sympy.sympify(power).could_extract_minus_sign():
            if base.is_Symbol and power.is_Rational and power.q > 2:
                return f"{self._print(base)}^{{{self._line(power)}}}"
            below = base**-power
            shown = self._print(below)
            if self._slash:
                return f"1/{self._divisor([below], shown)}"
            return self._fraction([], [below], "1", shown)
        raised = _group(self._line(power))
        if isinstance(base, sympy.Function) and not isinstance(base, sympy.exp):
            return self._applied(base, raised)
        shown = self._print(base)
        joined = base.is_Add or base.is_Mul or base.is_Pow or base.is_Derivative
        # V''(u_1)^2 needs no parentheses.
        primed = "'" in shown and not (base.is_Symbol and shown.endswith(")"))
        if joined or "^" in shown.split("(")[0] or primed:
            shown = self._parenthesised(shown)
        return f"{shown}^{raised}"

    def _print_ExpBase(self, expr: Any, exp: Any = None) -> str:
        shown = f"e^{{{self._line(expr.args[0])}}}"
        return rf"\left({shown}\right)^{{{exp}}}" if exp is not None else shown

    def _line(self, expr: Any) -> str:
        """LaTeX on one line, with a slash for a fraction."""
        if expr.is_Add:
            text = ""
            for number, term in enumerate(_terms(expr)):
                sign = "-" if _negative(term) else "+"
                lead = ("-" if sign == "-" else "") if number == 0 else f" {sign} "
                text += lead + self._line(abs_of(term))
            return text
        if _negative(expr):
            return "-" + self._line(-expr)
        top, bottom = expr.as_numer_denom()
        if bottom == 1:
            return str(self._print(expr))
        over = self._print(bottom)
        if bottom.is_Mul:
            over = f"({over})"
        # 2 (a - b) for 2 a - 2 b.
        number, rest = top.primitive()
        shown = f"({self._print(rest)})" if rest.is_Add else self._print(top)
        return f"{number} {shown}/{over}" if rest.is_Add and number != 1 else f"{shown}/{over}"

    # -- functions -------------------------------------------------------------------------------

    def _print_Function(self, expr: Any, exp: Any = None) -> str:
        return self._applied(expr, f"{{{exp}}}" if exp is not None else "")

    def _applied(self, expr: Any, raised: str) -> str:
        """A function's name, its power, its argument."""
        name = expr.func.__name__
        if isinstance(expr, sympy.Heaviside):
            return self._indicator(expr) + (f"^{raised}" if raised else "")
        if isinstance(expr, AppliedUndef):
            head = self._settings["symbol_names"].get(name) or super()._deal_with_super_sub(
                name, style="plain"
            )
            head = f"{{{head}}}" if raised and "^" in head else head
        elif name in _AIRY:
            head = _AIRY[name]
        elif hasattr(self, f"_print_{name}") and name not in _FUNCTIONS:
            shown = str(super()._print(expr))
            return f"{shown}^{raised}" if raised else shown
        else:
            head = _FUNCTIONS.get(name, rf"\operatorname{{{name}}}")
        arguments = ", ".join(self._print(a) for a in expr.args)
        power = f"^{raised}" if raised else ""
        fraction = r"\frac" in arguments or r"\sqrt" in arguments
        open_, close = (r"\left(", r"\right)") if fraction else ("(", ")")
        if head.endswith("'"):
            return f"{head}{open_}{arguments}{close}{power}"
        return f"{head}{power}{open_}{arguments}{close}"

    def _indicator(self, expr: Any) -> str:
        return rf"\mathbf{{1}}_{{{self._print(expr.args[0])} > 0}}"

    def _print_Heaviside(self, expr: Any, exp: Any = None) -> str:
        return self._indicator(expr) + (f"^{{{exp}}}" if exp is not None else "")

    def _print_DiracDelta(self, expr: Any, exp: Any = None) -> str:
        return rf"\delta({self._print(expr.args[0])})"

    def _print_log(self, expr: Any, exp: Any = None) -> str:
        return self._applied(expr, f"{{{exp}}}" if exp is not None else "")

    def _print_atan2(self, expr: Any) -> str:
        y, x = expr.args
        if not y.is_positive:
            return str(super()._print_Function(expr))
        # From 0 to pi as x goes from oo to -oo.
        return rf"\operatorname{{arccot}}({self._line(x / y)})"

    _print_erf = _print_log
    _print_airyai = _print_log
    _print_airybi = _print_log
    _print_airyaiprime = _print_log
    _print_airybiprime = _print_log

    # -- integrals and derivatives ---------------------------------------------------------------

    def _print_Integral(self, expr: Any) -> str:
        signs, ends = "", ""
        for limits in expr.limits:
            ends += rf" \, d{self._print(limits[0])}"
        for limits in reversed(expr.limits):
            bounds = ""
            if len(limits) == 3:
                bounds = f"_{{{self._print(limits[1])}}}^{{{self._print(limits[2])}}}"
            signs += rf"\int{bounds} "
        body = self._print(expr.function)
        if expr.function.is_Add:
            body = self._parenthesised(body)
        return f"{signs}{body}{ends}"

    def _print_Subs(self, expr: Any) -> str:
        inner, old, new = expr.args
        at = ", ".join(
            f"{self._print(a)} = {self._print(b)}" for a, b in zip(old, new, strict=True)
        )
        shown = self._print(inner)
        bar = r"\bigg|" if r"\frac" in shown else r"\Big|"
        return rf"{shown} {bar}_{{{at}}}"

    def _print_Derivative(self, expr: Any) -> str:
        order = len(expr.variables)
        if isinstance(expr.expr, AppliedUndef) and expr.expr.args * order == expr.variables:
            # R''(u), which no factor behind it can be taken into.
            function = expr.expr.func
            name, at = self._named(function) or self._print(function), self._print(*expr.expr.args)
            primes = "'" * order
            return f"{name}{primes}({at})"
        if isinstance(expr.expr, AppliedUndef) and len(expr.expr.args) > 1:
            # The partial derivative of T(u, z) without its arguments.
            sign = rf"\partial^{order}" if order > 1 else r"\partial"
            below = " ".join(
                rf"\partial {self._print(s)}" + (f"^{n}" if n > 1 else "")
                for s, n in expr.variable_count
            )
            return rf"\frac{{{sign} {self._print(expr.expr.func)}}}{{{below}}}"
        shown = str(super()._print_Derivative(expr.func(sympy.Symbol("X"), *expr.variable_count)))
        operator = shown.rsplit("X", 1)[0].rstrip()
        if requires_partial(expr.expr):
            operator = re.sub(r"\bd\b", r"\\partial", operator)
        body = self._print(expr.expr)
        if expr.expr.is_Mul or expr.expr.is_Add:
            body = rf"\left[{body}\right]"
        return f"{operator} {body}"


_AIRY = {
    "airyai": r"\operatorname{Ai}",
    "airybi": r"\operatorname{Bi}",
    "airyaiprime": r"\operatorname{Ai}'",
    "airybiprime": r"\operatorname{Bi}'",
}
_FUNCTIONS = {
    name: rf"\{name}" for name in ("log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
} | {"acos": r"\arccos", "asin": r"\arcsin", "atan": r"\arctan"}
_FUNCTIONS["erf"] = r"\operatorname{erf}"
_WAVES = (sympy.sin, sympy.cos)


class _Root:
    """Factors under one root."""

    is_Add = is_Function = False

    def __init__(self, factors: list[Any]) -> None:
        self.factors = factors


def abs_of(term: Any) -> Any:
    """A term without its sign."""
    return -term if _negative(term) else term


def _negative(term: Any) -> bool:
    """True for a term that is written with a minus sign."""
    turned = sum(map(_downwards, sympy.Mul.make_args(term))) if term.is_Mul else 0
    return bool(term.as_coeff_Mul()[0].is_negative) != (turned % 2 == 1)


def _downwards(factor: Any) -> bool:
    """True for a sum that is written as minus another: -(1 + u) for -1 - u."""
    if not factor.is_Add:
        return False
    minus = sum(bool(term.as_coeff_Mul()[0].is_negative) for term in factor.args)
    return minus == len(factor.args) or (
        2 * minus > len(factor.args) and bool(factor.as_coeff_Add()[0].is_negative)
    )


def _upwards(product: Any) -> Any:
    """The product with minus signs taken out of its sums."""
    factors = sympy.Mul.make_args(product)
    turned = [-f if _downwards(f) else f for f in factors]
    return sympy.Mul(*turned) * (-1) ** sum(map(_downwards, factors))


def _counts(factor: Any) -> bool:
    """True for a sum of whole numbers alone, 2 n + 1, which stands where numbers do."""
    symbols = factor.free_symbols
    return bool(symbols) and all(s.is_integer for s in symbols)


def _rank(base: Any, power: Any) -> int:
    """The rank of a factor behind the fraction; 0 for one in it."""
    if sympy.sympify(power).could_extract_minus_sign():
        return 0
    if isinstance(base, sympy.Integral):
        return _INTEGRAL
    if isinstance(base, sympy.Derivative):
        return _DERIVATIVE
    if isinstance(base, sympy.exp):
        return _EXPONENTIAL
    if isinstance(base, sympy.Function) and not isinstance(base, (AppliedUndef, sympy.Heaviside)):
        return _FUNCTION
    return _SUM if base.is_Add and power == 1 and not _counts(base) else 0


def _positions(factor: Any) -> bool:
    """True for a factor in which a position stands."""
    symbols = getattr(factor, "free_symbols", ())
    return any(s.name in _POSITIONS for s in symbols)


def _positive_quotient(base: Any) -> tuple[Any, Any]:
    """Numerator and denominator of what stands under a root, both positive where they can be."""
    over, under = base.as_numer_denom()
    if over.is_negative and under.is_negative:
        return -over, -under
    return (over, under) if over.is_nonnegative and under.is_positive else (base, sympy.S.One)


def _is_long(rank: float, shown: str) -> bool:
    """True for a sum that is a series of many terms."""
    return rank == _SUM and len(shown) > _LONG


def _rooted(
    coefficient: Any, roots: list[Any], divisors: list[Any]
) -> tuple[Any, list[Any], list[Any]]:
    """Whole numbers under roots against the coefficient: sqrt(3)/9 is 1/(3 sqrt(3))."""
    for root in [x for x in roots if x.is_Integer and coefficient.q % x == 0]:
        coefficient, divisors = coefficient * root, [root, *divisors]
        roots = [x for x in roots if x != root]
    return coefficient, roots, divisors


def _terms(expr: Any) -> list[Any]:
    """The terms of a sum in the order they are written in."""
    terms = list(expr.args)
    if powers := _asymptotic(terms):
        return sorted(terms, key=lambda t: (-powers[t], sympy.default_sort_key(t)))
    if _counts(expr):
        return sorted(terms, key=lambda t: (_negative(t), t.is_number, sympy.default_sort_key(t)))
    (position,) = [s for s in expr.free_symbols if s.name in _POSITIONS][:1] or (None,)
    degree = {t: _degree(t, position) for t in terms}
    highest = max(terms, key=lambda t: degree[t])
    # A polynomial whose leading term is positive is written by falling powers.
    falling = degree[highest] > 0 and not _negative(highest)
    return sorted(
        terms,
        key=lambda t: (
            -degree[t] if falling else 0,
            _negative(t),
            0 if t.is_number and not _negative(t) else 1,
            max((d.derivative_count for d in t.atoms(sympy.Derivative)), default=0),
            sympy.count_ops(_variable(t)),
            # cos before sin.
            str(_variable(t)) if _variable(t).is_Function else "",
            sympy.default_sort_key(_variable(t)),
        ),
    )


def _variable(term: Any) -> Any:
    """A term without its factors that are numbers: cos(w) of sqrt(3) cos(w)."""
    return term.as_independent(*term.free_symbols, as_Add=False)[1] if term.free_symbols else term


def _asymptotic(terms: list[Any]) -> dict[Any, Any]:
    """The powers of lambda in a series of falling ones; nothing for any other sum."""
    (large,) = {s for t in terms for s in t.free_symbols if s.name in _LARGE} or (None,)
    powers = {t: t.as_powers_dict().get(large, sympy.S.Zero) for t in terms if large is not None}
    falling = len(set(powers.values())) == len(terms) and min(powers.values(), default=0) < 0
    return powers if falling and all(p.is_Rational for p in powers.values()) else {}


def _alphabetical(factor: Any) -> tuple[str, Any]:
    """Functions without a definition by their names, the drift first; all else as SymPy has it."""
    name = factor.func.__name__.casefold() if isinstance(factor, AppliedUndef) else ""
    name = "" if name == "phi" else name
    return name, sympy.default_sort_key(factor)


def _degree(term: Any, position: Any) -> int:
    if position is None:
        return 0
    power = term.as_powers_dict().get(position, 0) if term.is_Mul else 0
    if term == position:
        power = 1
    elif term.is_Pow and term.base == position:
        power = term.exp
    return int(power) if sympy.sympify(power).is_Integer else 0


def _group(text: str) -> str:
    """`text` as an exponent."""
    return text if len(text) == 1 else f"{{{text}}}"
