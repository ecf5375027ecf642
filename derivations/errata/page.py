"""The errata as text for a terminal and as the page ``docs/errata.md``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from derivations.errata.entries import table
from derivations.labels import NUMBERS, numbered
from symasym.base.files import write_bytes

#: TeX that stands in the entries, and what a terminal shows of it.
_SIGNS = {
    r"\varepsilon": "ε",
    r"\kappa": "κ",
    r"\alpha": "α",
    r"\beta": "β",
    r"\mu": "μ",
    r"\Delta": "Δ",
    r"\sqrt": "√",
    r"{\max}": "max",
    r"\log": "log ",
    r"\max": "max",
    r"\dot z": "z'",
    r"\lvert ": "|",
    r"\rvert": "|",
    r"\gtrsim": "≳",
    r"\lesssim": "≲",
    r"\approx": "≈",
    r"\infty": "∞",
    r"\le": "≤",
    r"\ge": "≥",
    r"\ll": "≪",
    r"\gg": "≫",
    r"\to": "→",
    r"\,": " ",
    "^{(+)}": "⁽⁺⁾",
    "^{(-)}": "⁽⁻⁾",
    "{": "(",
    "}": ")",
    "$": "",
}


def without_tex(sentence: str) -> str:
    """A sentence with its formulas as plain signs."""
    for tex, sign in _SIGNS.items():
        sentence = sentence.replace(tex, sign)
    return re.sub(" +", " ", sentence)


def _input(name: str, given: str) -> str:
    """An input in TeX; words in its value stay as they are."""
    symbol = _NAMES.get(name, name)
    if given.startswith("$"):
        return f"${symbol} = {given[1:]}"
    if re.search("[b-tv-zA-Z]", given):
        return f"${symbol}$ = {given}"
    power = re.sub(r"\^(-?\d+)", r"^{\1}", given)
    return f"${symbol} = {power}$"


_NAMES = {
    "mu": r"\mu",
    "alpha": r"\alpha",
    "z0": "z_0",
    "kappa": r"\kappa",
    "kappa_p": r"\kappa_p",
    "eps": r"\varepsilon",
    "Delta": r"\Delta",
    "a-": "a^-",
    "a+": "a^+",
}


def text() -> str:
    """All entries, for the terminal."""
    lines = []
    for number, row in enumerate(table(), 1):
        lines += [
            f"{number}. {row['place']} ({row['kind']})",
            f"   printed: {without_tex(row['printed'])}",
            f"   right: {without_tex(row['right'])}",
            f"   consequence: {without_tex(row['consequence'])}",
        ]
        if row["argument"]:
            lines.append(f"   because: {without_tex(row['argument'])}")
        if example := row.get("counterexample"):
            inputs = ", ".join(f"{k} = {without_tex(v)}" for k, v in example["inputs"].items())
            lines += [
                f"   {without_tex(example['quantity'])} at {inputs}:",
                f"     the print implies {example['printed']}, true {example['true']}, "
                f"derived {example['derived']}",
            ]
    return "\n".join(lines)


def _place(row: dict[str, Any]) -> str:
    """Section, and equations by their numbers with the labels."""
    place = re.sub(
        r"\beq:\w+|\bfr[12]\b|(?<=, )cubic\b",
        lambda m: f"({NUMBERS[m[0]]}) `{m[0]}`" if m[0] in NUMBERS else f"`{m[0]}`",
        row["place"],
    )
    return place[0].upper() + place[1:]


def _heading(row: dict[str, Any]) -> str:
    """The place without the label in code, which a list of headings has no room for."""
    return re.sub(r"(?<=\)) `[\w:]+`", "", _place(row))


def _short(number: str) -> str:
    """Four digits of a number, in TeX; a dash for what the paper does not give."""
    if number == "nan":
        return "–"
    mantissa, _, power = f"{float(number):.4g}".replace("inf", r"\infty").partition("e")
    return f"${mantissa}$" if not power else rf"${mantissa} \times 10^{{{int(power)}}}$"


def _evidence(row: dict[str, Any]) -> str:
    """One line: the quantity with the print's number and the true one, or why there is none."""
    example = row.get("counterexample")
    if example is None:
        return str(row["argument"])
    quantity = re.sub(r" \((?:printed|derived)[^()]*\)$", "", example["quantity"])
    printed, true = _short(example["printed"]), _short(example["true"])
    return f"{quantity}: implied {printed}, true {true}"


def markdown() -> str:
    """The page ``docs/errata.md``; written by ``python -m derivations.errata.page``."""
    lines = [
        "# Errata of the paper",
        "",
        "Where the printed paper is wrong or says less than it could, the weightiest first.",
        "Equations are counted through from (1) to the end of the appendix, with those that have",
        "no label, as in the source of [arXiv:1310.8328](https://arxiv.org/abs/1310.8328).",
        "Variables are scaled, as in the [glossary](glossary.md#symbols); the index $p$ marks",
        "physical ones. The number of a row leads to its details. An equation without a row is a",
        "definition, or was [derived](derivations.md) as it is printed. Of the numbered",
        "equations (53) is misprinted; (9), (10), (12), (39) and (40) are false as they stand or",
        "need a further condition. The list rests on the preprint alone: the article in the",
        "journal was not compared.",
        "",
        "*wrong*: false as it stands, or true only under a condition that is not stated.",
        "*misprint*: another sign, symbol, number or reference was meant, as the paper's own",
        "formulas show. *not sharp*: true, and more is derived. *wording*: it says something other",
        "than what is meant, or two places contradict each other.",
        "",
        "*Implied* is what the print gives for the quantity beside it: the value of a printed",
        "formula, or what a claim in words comes to, such as $\\infty$ for a time that is said to",
        "grow without bound. *True* is the value that the details explain.",
        "",
        "| No. | Place | Printed | Correct | Kind | Consequence | Evidence |",
        "|---|---|---|---|---|---|---|",
    ]
    for number, row in enumerate(table(), 1):
        told = (row["printed"], row["right"], row["kind"], row["consequence"], _evidence(row))
        cells = [f'<a href="#erratum-{number}">{number}</a>', _place(row), *map(numbered, told)]
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "## Details",
        "",
        "*Derived* is the label whose derivation decides. Every number is worked out at the exact",
        "inputs beside it. *True* comes from the definition (a boundary-value problem by",
        "differences, a count, a simulation) or from an exact integral that print and derivation",
        "both approximate; it is never the formula that is judged. Written by",
        "`python -m derivations.errata.page`.",
        "",
    ]
    for number, row in enumerate(table(), 1):
        decides = f"{row['kind']}, derived in {row['derivation']}"
        lines += [
            f"### {number}. {_heading(row)}",
            "",
            f'<details id="erratum-{number}"><summary>{decides}</summary>',
            "",
            f"{_place(row)}.",
            "",
            f"- Printed: {numbered(row['printed'])}",
            f"- Correct (`{row['derivation']}`): {numbered(row['right'])}",
            f"- Consequence: {numbered(row['consequence'])}",
        ]
        if row["argument"]:
            lines.append(f"- Because {numbered(row['argument'])}")
        if example := row.get("counterexample"):
            inputs = ", ".join(_input(k, v) for k, v in example["inputs"].items())
            given = [example[k].replace("nan", "–") for k in ("printed", "true", "derived")]
            lines += [
                f"- {numbered(example['quantity'])}, at {inputs}:",
                "",
                "  | implied by the print | true | derived |",
                "  |---|---|---|",
                f"  | {' | '.join(given)} |",
            ]
        lines += ["", "</details>", ""]
    return "\n".join(lines).replace("<=", "≤").replace(">=", "≥")


def main() -> None:
    """Write ``docs/errata.md``."""
    path = Path(__file__).parents[2] / "docs" / "errata.md"
    write_bytes(path, markdown().encode())
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
