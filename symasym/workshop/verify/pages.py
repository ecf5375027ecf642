"""The table of a verification, and its record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from symasym.base.files import versions
from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.run import Done, Verification

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

    def add(self, finding: Finding) -> None:
        """Count one more finding."""
        self.cases += 1
        self.refused += finding.refused
        self.passed += finding.passed and not finding.refused
        # A NaN is worse than any number.
        size = 0.0 if finding.size is None else finding.size
        size = float("inf") if size != size else size
        if not finding.refused and (size > self.worst or not self.where):
            self.worst, self.where = size, finding.where

    @property
    def failed(self) -> int:
        """The number of findings that failed."""
        return self.cases - self.passed - self.refused


def rows(verification: Verification) -> list[Row]:
    """One row for each formula, evaluator and check, in that order."""
    by_name: dict[tuple[str, str, str], Row] = {}
    for finding in verification.findings:
        key = finding.formula, finding.evaluator, finding.check
        by_name.setdefault(key, Row(*key)).add(finding)
    return [by_name[key] for key in sorted(by_name)]


def table(verification: Verification) -> str:
    """The rows as text, failures below, and a sentence."""
    lines: list[tuple[str, ...]] = [
        ("formula", "evaluator", "check", "cases", "passed", "refused", "worst", "where")
    ]
    for row in rows(verification):
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
    text += ["", *_failures(verification), _sentence(verification)]
    return "\n".join(line.rstrip() for line in text)


def _failures(verification: Verification) -> Iterator[str]:
    """A line for each of the first twenty failures, and for each task that was stopped."""
    shown = verification.failures[:20]
    for f in shown:
        yield f"FAILED {f.formula}, {f.evaluator}, {f.check}, at {f.where}: {f.detail}"
    if len(verification.failures) > len(shown):
        yield f"… and {len(verification.failures) - len(shown)} more."
    for done in verification.stopped:
        yield f"STOPPED {_named(done)}: not finished after {done.seconds:.0f} s."


def _named(done: Done) -> str:
    """The check and the scene of a task."""
    return f"{done.task.check} of {' '.join(done.task.key)}"


def _sentence(of: Verification) -> str:
    """The numbers of cases, tasks and seconds in a sentence."""
    cases = of.findings
    refused = sum(f.refused for f in cases)
    how = "interrupted after" if of.interrupted else "in"
    stopped = f", {len(of.stopped)} of them stopped," if of.stopped else ""
    return (
        f"{len(cases)} cases: {len(cases) - refused - len(of.failures)} passed, "
        f"{len(of.failures)} failed, {refused} refused; {len(of.done)} of {of.tasks} "
        f"tasks{stopped} {how} {of.seconds:.1f} s (level {of.level}, seed {of.seed}). "
        "Worst is what was found over what is allowed: 1 is the limit."
    )


def record(verification: Verification) -> dict[str, Any]:
    """The verification as data for JSON."""
    from symasym.formula import labels

    checked = {row.formula for row in rows(verification)}
    return {
        "level": verification.level,
        "seed": verification.seed,
        "interrupted": verification.interrupted,
        "passed": verification.passed,
        "seconds": round(verification.seconds, 3),
        "tasks": {"done": len(verification.done), "all": verification.tasks},
        "versions": versions(*_LIBRARIES),
        "rows": [_plain(vars(row)) for row in rows(verification)],
        "stopped": [_named(done) for done in verification.stopped],
        "failures": [_plain(f._asdict()) for f in verification.failures],
        "seconds_by_check": _times(verification),
        # Definitions, equations and identities of symbols: their check is their derivation.
        "formulas_without_numbers_here": [x for x in labels() if x not in checked],
    }


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity."""
    return {
        name: str(x) if isinstance(x, float) and (x != x or abs(x) == float("inf")) else x
        for name, x in record.items()
    }


def _times(verification: Verification) -> dict[str, float]:
    """Seconds of each check."""
    times: dict[str, float] = {}
    for done in verification.done:
        times[done.task.check] = times.get(done.task.check, 0.0) + done.seconds
    return {name: round(seconds, 3) for name, seconds in sorted(times.items())}
