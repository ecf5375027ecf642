"""Points of work-precision diagrams, error against time and a counter, and cells of heat maps."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base.contexts import own_context
from symasym.exact import ball_sweep
from symasym.numbers import balls
from symasym.workshop.problems import Problem
from symasym.workshop.report.methods import Outcome, Run, attempt
from symasym.workshop.report.timing import calls
from symasym.workshop.verify.references import provable

if TYPE_CHECKING:
    from mpmath import mpf


#: Digits of the references: well beyond the 50 that the table of methods asks about.
_DPS = 120
_RUNS, _ENOUGH = 9, 0.5
# The counter slows what it counts.
_COUNTED = 1.0


@dataclass
class Point:
    """One method with its setting on one scene.

    `error` and `claimed` are absolute errors of log T, thus relative ones of T; `error` is None
    where there was no value, for the `reason`. `below_reference` says that the reference can't
    tell the value from the truth; `error` is then the reference's radius.
    """

    scene: str
    method: str
    setting: str
    ours: bool
    seconds: float | None
    calls: int | None
    error: float | None
    claimed: float | None
    kind: str
    below_reference: bool
    runs: int
    reason: str


@dataclass
class Known:
    """log T with the radius of what proves it, or the distance to more digits."""

    log: Any
    radius: Any
    proved: bool


def known(problem: Problem) -> Known:
    """log T of a scene to 120 digits, proved where ball arithmetic can in seconds."""
    dps = _DPS
    if provable(problem) or ("weak" in problem.tags and "extreme" not in problem.tags):
        try:
            kappa, r, start = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
            enclosure = ball_sweep.escape_time(problem.make(), kappa, r, start, dps, log=True)
            value, radius = balls.to_mpf(enclosure, dps + 10)
            return Known(value, radius, True)
        except (sa.AccuracyError, ImportError):
            pass
    value = problem.questions()["T"](dps=dps, log=True)
    more = problem.questions()["T"](dps=dps + 40, log=True)
    with own_context(dps + 60) as mp:
        gap = abs(mp.make_mpf(value._mpf_) - mp.make_mpf(more._mpf_))
        return Known(more, gap + abs(mp.make_mpf(more._mpf_)) * mp.mpf(10) ** -dps, False)


def point(name: str, run: Run, truth: Known, limit: float, once: bool = False) -> Point:
    """The least time of up to nine runs (of one with `once`), and the error, of one method."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        spent, outcome, reason = attempt(run, limit)
        if outcome is None:
            stopped = spent if reason.startswith("stopped") else None
            return Point(
                name, run.method, run.setting, run.ours, stopped, None, None, None, "", False, 0,
                reason,
            )  # fmt: skip
        best, total, runs = spent, spent, 1
        # The first run fills caches.
        while not once and (
            (total < _ENOUGH and runs < _RUNS) or (runs == 1 and spent < limit / 4)
        ):
            spent = attempt(run, limit)[0]
            best, total, runs = min(best, spent), total + spent, runs + 1
        count = None
        if best < _COUNTED and run.timed is None and not once:
            count = calls(run.call)
    error, below = _error(outcome, truth)
    claimed = None if outcome.claimed is None else _small(outcome.claimed)
    return Point(
        name, run.method, run.setting, run.ours, best, count, error, claimed, outcome.kind, below,
        runs, "",
    )  # fmt: skip


def _error(outcome: Outcome, truth: Known) -> tuple[float, bool]:
    """The distance to the truth, and True where the reference can't tell it from 0."""
    with own_context(_DPS + 60) as mp:
        value, wanted = (
            mp.make_mpf(x._mpf_) if hasattr(x, "_mpf_") else mp.mpf(x)
            for x in (outcome.log, truth.log)
        )
        radius = mp.make_mpf(truth.radius._mpf_)
        gap = abs(value - wanted)
        if gap <= radius:
            return _small(radius), True
        return _small(gap), False


def _small(x: mpf | float) -> float:
    """As a float; no error of a report is below 1e-300."""
    return max(float(x), 1e-300)


#: What is asked of ours: (method, setting).
OURS = (
    ("exact", "float64"),
    ("exact, arrays", "float64"),
    ("exact", "35 digits"),
    ("exact, proved", "15 digits"),
    ("laplace", "order 2"),
    ("uniform", "order 2"),
    ("local", "leading order"),
    ("strong_noise", "order 2"),
    ("paper", "leading order"),
    ("auto", "rtol 1e-6"),
)
#: No more digits than these are distinguished.
MOST = 40.0


@dataclass
class Cell:
    """A method on a scene: digits of log T (of T where log T is below 1)."""

    scene: str
    method: str
    setting: str
    ours: bool
    claimed: float | None
    true: float | None
    kind: str
    reason: str

    @property
    def wrong(self) -> bool:
        """True if more digits are claimed than are right."""
        if self.claimed is None or self.true is None:
            return False
        return self.true < min(self.claimed, MOST) - 1e-6


def columns(cells: list[Cell]) -> list[tuple[str, str]]:
    """The methods with their settings, ours first."""
    first = sorted(cells, key=lambda c: (not c.ours, _rank(c)))
    return list(dict.fromkeys((c.method, c.setting) for c in first))


def _rank(cell: Cell) -> int:
    """The rank of a cell's method in `OURS`; peers come last."""
    key = (cell.method, cell.setting)
    return OURS.index(key) if key in OURS else len(OURS)
