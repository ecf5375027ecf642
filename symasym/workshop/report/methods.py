"""The scenes and the runs of a report: every method and order of ours, and the peers that are here.

Scenes are those of the table of `symasym.workshop.problems`.
"""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import symasym as sa
from symasym.base.contexts import mpf_of
from symasym.base.errors import InputError
from symasym.workshop.problems import BY_NAME, Problem
from symasym.workshop.report import peers
from symasym.workshop.report.timing import capped

if TYPE_CHECKING:
    from mpmath import mpf

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
            raise InputError(f"{name!r} is no scene of the report; give {', '.join(SCENES)}.")
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
    kappa, r, start = problem.kappa, problem.r, problem.start

    def run(method: str, setting: str, name: TimeMethod, **options: Any) -> Run:
        """A run of a method that states its error."""

        def call() -> Outcome:
            # The drift is made anew, so that nothing is left from the last run but caches.
            estimate = sa.escape_time(
                problem.make(), kappa, r, start=start, method=name, log=True, full=True, **options
            )
            return Outcome(estimate.value, estimate.error, estimate.error_kind)

        return Run(method, setting, call, True)

    def plain(dps: int | None) -> Run:
        """A run of the exact value, which claims the accuracy that the documents promise."""

        def call() -> Outcome:
            value = sa.escape_time(problem.make(), kappa, r, start=start, log=True, dps=dps)
            size = max(1, abs(value))
            # The promise of docs/exact.md; full=True would prove it, at a price of its own.
            error = 1e-12 * size if dps is None else size * Fraction(1, 10**dps)
            return Outcome(value, float(error) if dps is None else _mpf(error), "estimate")

        return Run("exact", "float64" if dps is None else f"{dps} digits", call, True)

    def array() -> Run:
        """A run of an array of one scene."""

        def call() -> Outcome:
            estimate = sa.escape_time(
                problem.make(), [float(Fraction(kappa))], r, start=start, log=True, full=True
            )
            return Outcome(float(estimate.value[0]), float(estimate.error[0]), estimate.error_kind)

        return Run("exact, arrays", "float64", call, True)

    yield plain(None)
    if Fraction(kappa) == Fraction(float(Fraction(kappa))):
        # Elsewhere the float is another scene, which weak noise tells apart.
        yield array()
    for dps in (10, 20, 35, 55, 100):
        yield plain(dps)
    for dps in (15, 55):
        yield run("exact, proved", f"{dps} digits", "exact", dps=dps)
    for order in (0, 1, 2, 3, 5, 8, 12) if not quick else (0, 2, 5):
        yield run("laplace", f"order {order}", "laplace", order=order, dps=60)
        yield run("uniform", f"order {order}", "uniform", order=order, dps=60)
        yield run("strong_noise", f"order {order}", "strong_noise", order=order, dps=60)
    yield run("laplace", "order optimal", "laplace", order="optimal", dps=60)
    yield run("local", "leading order", "local", dps=30)
    yield run("paper", "leading order", "paper", dps=30)
    for rtol in ("1e-2", "1e-6", "1e-12"):
        yield run("auto", f"rtol {rtol}", "auto", rtol=rtol, dps=30)


def _mpf(x: Fraction | mpf) -> Any:
    """The number as an mpf."""
    from mpmath import mp, mpf

    return mpf_of(x, mp) if isinstance(x, Fraction) else mpf(x)


#: Peer -> whether it is here.
_PEERS: dict[str, Callable[[], bool]] = {
    "mpmath.quad": lambda: True,
    "dblquad": lambda: importlib.util.find_spec("scipy") is not None,
    "Arb": lambda: importlib.util.find_spec("flint") is not None,
    "PARI": lambda: shutil.which("gp") is not None,
}


def missing() -> list[str]:
    """Peers that are not installed."""
    return [name for name, here in _PEERS.items() if not here()]


def others(problem: Problem, quick: bool) -> Iterator[Run]:
    """The peers that are installed, on scenes that start at 0 and have a polynomial A."""
    c = problem.make().exact_coefficients()
    if c is None or Fraction(problem.start) != 0 or Fraction(problem.r) <= 1:
        return
    kappa, r = Fraction(problem.kappa), Fraction(problem.r)
    radius: Any = int(r) if r.denominator == 1 else r

    def mpmath_run(dps: int) -> Run:
        """A run of nested mpmath.quad."""
        return Run(
            "mpmath.quad", f"{dps} digits",
            lambda: Outcome(
                _log(peers.mpmath_escape_time(c, kappa, radius, dps), dps), 10.0**-dps, "asked for"
            ),
            False,
        )  # fmt: skip

    def scipy_run(epsrel: float) -> Run:
        """A run of SciPy's dblquad."""
        return Run(
            "dblquad", f"epsrel {epsrel:g}",
            lambda: Outcome(
                peers.scipy_log_escape_time(c, float(kappa), float(r), epsrel), epsrel, "asked for"
            ),
            False,
        )  # fmt: skip

    def arb_run(dps: int) -> Run:
        """A run of nested integrals of Arb."""

        def call() -> Outcome:
            from symasym.numbers.balls import to_mpf

            ball = peers.arb_escape_time(c, kappa, radius, dps, tuned=True, log=True)
            return Outcome(*to_mpf(ball, dps), "bound")

        return Run("Arb", f"{dps} digits", call, False)

    def pari_run(dps: int) -> Run:
        """A run of PARI, in a process of its own."""

        def timed(limit: float) -> tuple[float, Outcome]:
            spent, log_time = peers.pari_log_escape_time(c, kappa, r, dps, limit)
            return spent, Outcome(log_time, 10.0**-dps, "asked for")

        return Run("PARI", f"{dps} digits", lambda: timed(600)[1], False, timed)

    gone = missing()
    made = [*map(mpmath_run, (15, 30)), *map(scipy_run, (1e-6, 1e-12))]
    made += [*map(arb_run, (15, 30)), *map(pari_run, (19, 38))]
    if quick:
        made = [run for k, run in enumerate(made) if k % 2 == 0]
    yield from (run for run in made if run.method not in gone)


def _log(value: mpf, dps: int) -> Any:
    """The logarithm, right to `dps` digits behind the point."""
    from mpmath import log, workdps

    # log T may have twenty digits before the point.
    with workdps(dps + 30):
        return log(value)


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
