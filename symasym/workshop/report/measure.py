"""What a report measures: points of work-precision diagrams, and cells of heat maps.

Scenes are those of the table of `symasym.workshop.problems`; on each of them run all methods and
orders of ours, and the peers that are here. A point is an error against a time and a counter.
"""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import symasym as sa
from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.base.inputs import meant
from symasym.numbers import balls
from symasym.workshop.problems import BY_NAME, Problem
from symasym.workshop.report import peers
from symasym.workshop.report.timing import calls, capped
from symasym.workshop.verify.findings import Reference

if TYPE_CHECKING:
    from mpmath import mpf

    from symasym.base.inputs import Numbers
    from symasym.quantities import TimeMethod


#: Name in the report -> name in the table. All start at 0, for which the peers are written.
SCENES = {
    "weak": "friction",
    "moderate": "friction k=0.3",
    "strong": "friction k=10",
    "fold": "on the fold",
    "kink": "kink - 1e-15",
    "sliding": "friction sliding weak",
    "stiff": "friction k=1e-4",
    "extreme": "fold + 1e-30",
}


def chosen(names: list[str] | None) -> dict[str, Problem]:
    """The scenes of these names, all where none are given."""
    for name in names or ():
        if name not in SCENES:
            raise InputError(
                f"{name!r} is no scene of the report; give {', '.join(SCENES)}"
                f"{meant(name, SCENES)}."
            )
    return {name: BY_NAME[table] for name, table in SCENES.items() if not names or name in names}


def described(problem: Problem) -> str:
    """The scene in a line."""
    return f"{problem.make()!r}, kappa = {problem.kappa}, r = {problem.r}"


class Outcome(NamedTuple):
    """log T with its claimed error, of kind "bound", "estimate", "none" or "asked for".

    A quadrature that tells no error is taken to claim the digits that it was asked for.
    """

    log: Any
    claimed: Any
    kind: str


class Run(NamedTuple):
    """A method with its setting.

    `call` gives an `Outcome` and is timed; `timed`, where it is there, gives the seconds of a
    process of its own and the outcome.
    """

    method: str
    setting: str
    call: Callable[[], Outcome]
    ours: bool
    timed: Callable[[float], tuple[float, Outcome]] | None = None


def ours(problem: Problem, quick: bool) -> Iterator[Run]:
    """All of ours that T has; those that refuse the scene do so when they are run."""
    r, start = problem.r, problem.start

    def run(
        method: str, setting: str, name: TimeMethod = "exact", kappa: Numbers = problem.kappa,
        full: bool = True, **options: Any,
    ) -> Run:  # fmt: skip
        """A run of a method that states its error; of the exact value without `full`, which claims
        the accuracy that docs/exact.md promises: to prove it has a price of its own."""

        def call() -> Outcome:
            # The drift is made anew, so that nothing is left from the last run but caches.
            answer: Any = sa.escape_time(
                problem.make(), kappa, r, start=start, method=name, log=True, full=full, **options
            )
            if full:
                value, error = (np.ravel(x)[0] for x in (answer.value, answer.error))
                return Outcome(value, error, answer.error_kind)
            share = 10.0 ** -options.get("dps", 12)
            return Outcome(answer, share * max(1.0, abs(float(answer))), "estimate")

        return Run(method, setting, call, True)

    yield run("exact", "float64", full=False)
    if Fraction(problem.kappa) == Fraction(float(Fraction(problem.kappa))):
        # Elsewhere the float is another scene, which weak noise tells apart.
        yield run("exact, arrays", "float64", kappa=[float(Fraction(problem.kappa))])
    for dps in (10, 20, 35, 55, 100):
        yield run("exact", f"{dps} digits", dps=dps)
    for order in (0, 1, 2, 3, 5, 8, 12) if not quick else (0, 2, 5):
        for name in _EXPANSIONS:
            yield run(name, f"order {order}", name, order=order, dps=60)
    yield run("laplace", "order optimal", "laplace", order="optimal", dps=60)
    yield run("paper", "leading order", "paper", dps=30)
    for rtol in ("1e-2", "1e-6", "1e-12"):
        yield run("auto", f"rtol {rtol}", "auto", rtol=rtol, dps=30)


_EXPANSIONS: tuple[TimeMethod, ...] = ("laplace", "uniform", "strong_noise")


def missing() -> list[str]:
    """Peers that are not installed."""
    return [] if shutil.which("gp") else ["PARI"]


def others(problem: Problem, quick: bool) -> Iterator[Run]:
    """The peers that are installed, on scenes that start at 0 and have a polynomial A."""
    c = problem.make().exact_coefficients()
    if c is None or Fraction(problem.start) != 0 or Fraction(problem.r) <= 1:
        return
    kappa, r = Fraction(problem.kappa), Fraction(problem.r)
    radius: Any = int(r) if r.denominator == 1 else r

    def run(method: str, setting: str, claimed: float, ask: Callable[[], Any]) -> Run:
        """A run of a quadrature that tells no error."""
        return Run(method, setting, lambda: Outcome(ask(), claimed, "asked for"), False)

    def nested(n: int) -> Any:
        """log T by nested mpmath.quad."""
        time = peers.mpmath_escape_time(c, kappa, radius, n)
        # log T may have twenty digits before the point.
        with own_context(n + 30) as context:
            return context.log(context.convert(time))

    def arb(n: int) -> Outcome:
        """log T by nested integrals of Arb, with the radius of its ball."""
        ball = peers.arb_escape_time(c, kappa, radius, n, tuned=True, log=True)
        return Outcome(*balls.to_mpf(ball, n), "bound")

    def pari(n: int) -> Run:
        """A run of PARI, in a process of its own."""

        def timed(limit: float) -> tuple[float, Outcome]:
            spent, log_time = peers.pari_log_escape_time(c, kappa, r, n, limit)
            return spent, Outcome(log_time, 10.0**-n, "asked for")

        return Run("PARI", f"{n} digits", lambda: timed(600)[1], False, timed)

    gone = missing()
    scipy = partial(peers.scipy_log_escape_time, c, float(kappa), float(r))
    made = [
        *(run("mpmath.quad", f"{n} digits", 10.0**-n, partial(nested, n)) for n in (15, 30)),
        *(run("dblquad", f"epsrel {e:g}", e, partial(scipy, epsrel=e)) for e in (1e-6, 1e-12)),
        *(Run("Arb", f"{n} digits", partial(arb, n), False) for n in (15, 30)),
        *map(pari, (19, 38)),
    ]  # fmt: skip
    if quick:
        made = made[::2]
    yield from (run for run in made if run.method not in gone)


def attempt(run: Run, limit: float) -> tuple[float, Outcome | None, str]:
    """(seconds, outcome, "") of one run; no outcome and the reason where there is none."""
    try:
        if run.timed is not None:
            spent, outcome = run.timed(limit)
            return spent, outcome, ""
        spent, outcome = capped(run.call, limit)
    except sa.SymasymError as error:
        return 0.0, None, f"refused: {error}"
    except Exception as error:
        # A peer may end in any way; how it ended is part of what is reported.
        if run.ours:
            raise
        return 0.0, None, f"{type(error).__name__}: {error}".split("\n")[0]
    if outcome is None:
        return spent, None, f"stopped after {limit:g} s"
    return spent, outcome, ""


# -- points and cells --------------------------------------------------------------------------

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


def known(problem: Problem) -> Reference:
    """log T of a scene to 120 digits, proved."""
    enclosed = problem.questions()["T"](dps=_DPS, log=True, full=True)
    return Reference(enclosed.value, enclosed.error)


def point(name: str, run: Run, truth: Reference, limit: float, once: bool = False) -> Point:
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


def _error(outcome: Outcome, truth: Reference) -> tuple[float, bool]:
    """The distance to the truth, and True where the reference can't tell it from 0."""
    with own_context(_DPS + 60) as mp:
        value, wanted = (
            mp.make_mpf(x._mpf_) if hasattr(x, "_mpf_") else mp.mpf(x)
            for x in (outcome.log, truth.value)
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
    ("laplace", "order 2"),
    ("uniform", "order 2"),
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
