"""The errata as text for a terminal and as the page ``docs/errata.md``."""

from __future__ import annotations

from pathlib import Path

from derivations.errata import table
from symasym.base.files import write_bytes


def text() -> str:
    """All entries, for the terminal."""
    lines = []
    for place, row in enumerate(table(), 1):
        lines += [
            f"{place}. {row['label']} ({row['kind']})",
            f"   printed: {row['printed']}",
            f"   derived: {row['derived']}",
            f"   affects: {row['affects']}",
        ]
        if example := row.get("counterexample"):
            inputs = ", ".join(f"{k} = {v}" for k, v in example["inputs"].items())
            lines += [
                f"   {example['quantity']} at {inputs}:",
                f"     printed {example['printed']}, true {example['true']}, "
                f"derived {example['derived']}",
            ]
    return "\n".join(lines)


def markdown() -> str:
    """The page ``docs/errata.md``; written by ``python -m derivations.errata_page``."""
    lines = [
        "# Slips of the paper",
        "",
        "Where the printed paper and the derivations differ. Every number is worked out at the",
        "exact inputs beside it; *true* is computed without either formula. Scaled variables",
        "throughout, unless said otherwise. Written by `python -m derivations.errata_page`.",
        "",
        "*wrong*: a false formula, sign, direction or statement. *condition*: one is missing or",
        "misprinted. *not sharp*: true, and more is derived. *text*: two places of the paper",
        "contradict each other, and there is nothing to compute.",
        "",
    ]
    for place, row in enumerate(table(), 1):
        lines += [
            f"## {place}. {row['label']} ({row['kind']})",
            "",
            f"- Printed: {row['printed']}",
            f"- Derived (`{row['derivation']}`): {row['derived']}",
            f"- Affects: {row['affects']}",
        ]
        if example := row.get("counterexample"):
            inputs = ", ".join(f"{k} = {v}" for k, v in example["inputs"].items())
            lines += [
                f"- {example['quantity']}, at {inputs}:",
                "",
                "  | printed | true | derived |",
                "  |---|---|---|",
                f"  | {example['printed']} | {example['true']} | {example['derived']} |",
            ]
        lines.append("")
    return "\n".join(lines).replace("<=", "≤").replace(">=", "≥")


def main() -> None:
    """Write ``docs/errata.md``."""
    path = Path(__file__).parent.parent / "docs" / "errata.md"
    write_bytes(path, markdown().encode())
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
