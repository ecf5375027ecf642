"""The table of a verification, and its record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from symasym.base.files import versions
from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.run import Verification
from symasym.workshop.verify.tasks import Done

_LIBRARIES = ("numpy", "mpmath", "gmpy2", "python-flint", "sympy")


@dataclass
class Row:
    """One formula, evaluator and check."""

    formula: str
    evaluator: str
    check: str
    cases: int = 0
    passed: int = 0
    refused: int = 0
    worst: float = 0.0
    where: str = ""

    def add(self, found: Finding) -> None:
        self.cases += 1
        self.refused += found.refused
        self.passed += found.passed and not found.refused
        # A NaN is worse than any number.
        size = 0.0 if found.size is None else found.size
        size = float("inf") if size != size else size
        if not found.refused and (size > self.worst or not self.where):
            self.worst, self.where = size, found.where

    @property
    def failed(self) -> int:
        return self.cases - self.passed - self.refused


def rows(found: Verification) -> list[Row]:
    """One row for each formula, evaluator and check, in that order."""
    by_name: dict[tuple[str, str, str], Row] = {}
    for finding in found.findings:
        key = finding.formula, finding.evaluator, finding.check
        by_name.setdefault(key, Row(*key)).add(finding)
    return [by_name[key] for key in sorted(by_name)]


def table(found: Verification) -> str:
    """The rows as text, failures below, and a sentence."""
    lines: list[tuple[str, ...]] = [
        ("formula", "evaluator", "check", "cases", "passed", "refused", "worst", "where")
    ]
    for row in rows(found):
        numbers = (row.cases, row.passed, row.refused)
        worst = "" if row.refused == row.cases else f"{row.worst:.2g}"
        mark = "" if not row.failed else "  FAILED"
        lines.append(
            (row.formula, row.evaluator, row.check, *map(str, numbers), worst, row.where + mark)
        )
    widths = [max(len(line[k]) for line in lines) for k in range(7)]
    text = [
        "  ".join([*(c.ljust(w) for c, w in zip(x, widths, strict=False)), x[7]]) for x in lines
    ]
    text += ["", *_failures(found), _sentence(found)]
    return "\n".join(line.rstrip() for line in text)


def _failures(found: Verification) -> Iterator[str]:
    shown = found.failures[:20]
    for f in shown:
        yield f"FAILED {f.formula}, {f.evaluator}, {f.check}, at {f.where}: {f.detail}"
    if len(found.failures) > len(shown):
        yield f"… and {len(found.failures) - len(shown)} more."
    for done in found.stopped:
        yield f"STOPPED {_named(done)}: not finished after {done.seconds:.0f} s."


def _named(done: Done) -> str:
    return f"{done.task.check} of {' '.join(done.task.key)}"


def _sentence(found: Verification) -> str:
    cases = found.findings
    refused = sum(f.refused for f in cases)
    how = "interrupted after" if found.interrupted else "in"
    stopped = f", {len(found.stopped)} of them stopped," if found.stopped else ""
    return (
        f"{len(cases)} cases: {len(cases) - refused - len(found.failures)} passed, "
        f"{len(found.failures)} failed, {refused} refused; {len(found.done)} of {found.tasks} "
        f"tasks{stopped} {how} {found.seconds:.1f} s (level {found.level}, seed {found.seed}). "
        "Worst is what was found over what is allowed: 1 is the limit."
    )


def record(found: Verification) -> dict[str, Any]:
    """What is written as JSON."""
    from symasym.formula import labels

    checked = {row.formula for row in rows(found)}
    return {
        "level": found.level,
        "seed": found.seed,
        "interrupted": found.interrupted,
        "passed": found.passed,
        "seconds": round(found.seconds, 3),
        "tasks": {"done": len(found.done), "all": found.tasks},
        "versions": versions(*_LIBRARIES),
        "rows": [_plain(vars(row)) for row in rows(found)],
        "stopped": [_named(done) for done in found.stopped],
        "failures": [_plain(f._asdict()) for f in found.failures],
        "seconds_by_check": _times(found),
        # Definitions, equations and identities of symbols: their check is their derivation.
        "formulas_without_numbers_here": [x for x in labels() if x not in checked],
    }


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity."""
    return {
        name: str(x) if isinstance(x, float) and (x != x or abs(x) == float("inf")) else x
        for name, x in record.items()
    }


def _times(found: Verification) -> dict[str, float]:
    times: dict[str, float] = {}
    for done in found.done:
        times[done.task.check] = times.get(done.task.check, 0.0) + done.seconds
    return {name: round(seconds, 3) for name, seconds in sorted(times.items())}
