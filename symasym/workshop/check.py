"""Every method on every scene: its value, its stated error, the true error and its seconds.

`verify` judges the records: none may be farther from the truth than it says. `report` shows them,
beside other programs (`symasym.workshop.peers`): error against run time. The truth is plain
quadrature of the printed integrals (`symasym.workshop.reference_quadrature`) where a scene is
smooth enough for it, else a closed form, else the exact value in balls with 60 digits.
"""

from __future__ import annotations

import csv
import io
import math
import random
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from mpmath import mp, mpf

import symasym as sa
from symasym.base import progress
from symasym.base.errors import InputError, SymasymError
from symasym.base.files import write_bytes
from symasym.quantities import call_named
from symasym.scenes import QUANTITIES
from symasym.workshop.problems import BY_NAME, PROBLEMS, Problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TRUTH, _QUADRATURE = 60, 25  # digits of the truth in balls, and by quadrature
#: Method, its orders, and the digits asked for (None: float64).
RUNS: list[tuple[str, tuple[int | None, ...], tuple[int | None, ...]]] = [
    ("exact", (None,), (None, 20, 50)),
    ("paper", (None,), (20,)),
    ("laplace", (0, 1, 2, 4), (20,)),
    ("uniform", (0, 1, 2), (20,)),
    ("strong_noise", (0, 2, 8), (20,)),
    ("bound", (None,), (20,)),
]
_SCENES = (
    "friction", "friction k=0.3", "friction k=1", "friction past the fold", "sine", "tanh",
)  # fmt: skip


class Record(NamedTuple):
    """One value beside the truth; errors are relative, None where nothing is stated."""

    scene: str
    quantity: str
    method: str
    order: int | None
    digits: int | None
    seconds: float
    error: float
    stated: float | None
    kind: str

    @property
    def holds(self) -> bool:
        """False for an error above the stated one."""
        return self.stated is None or self.error <= self.stated


class Truth(NamedTuple):
    """A value, and its own relative error."""

    value: Any
    error: float


def truth(problem: Problem, quantity: str) -> Truth:
    """The value, known independently where the scene allows it."""
    name = quantity.replace(" - ", "-")
    if name in problem.closed:
        return Truth(problem.known(name, _TRUTH), 10.0**-_TRUTH)
    if "quadrature" in problem.tags and name in (known := problem.by_quadrature()):
        return Truth(known[name](_QUADRATURE), 10.0 ** (1 - _QUADRATURE))
    numbers = {"kappa": problem.kappa, "r": problem.r, "start": problem.start}
    value = call_named(quantity, problem.make(), numbers, dps=_TRUTH)
    return Truth(value, 10.0 ** (1 - _TRUTH))


def records(problem: Problem, quantities: Iterable[str] = QUANTITIES) -> Iterator[Record]:
    """Every method's answers for a scene; a method that refuses it gives none."""
    drift = problem.make()
    numbers = {"kappa": problem.kappa, "r": problem.r, "start": problem.start}
    for quantity in quantities:
        if QUANTITIES[quantity].sliding and not problem.slides:
            continue
        try:
            true = truth(problem, quantity)
        except SymasymError:
            continue
        for method, orders, digits in RUNS:
            for order in orders:
                for dps in digits:
                    try:
                        began = time.process_time()
                        found = call_named(
                            quantity, drift, numbers,
                            method=method, order=order, dps=dps, full=True,
                        )  # fmt: skip
                    except SymasymError:
                        continue
                    seconds = time.process_time() - began
                    known = problem.name, quantity, method, order, dps, seconds
                    yield Record(*known, *_compared(found, true), found.error_kind)


def _compared(found: Any, true: Truth) -> tuple[float, float | None]:
    """The relative errors, true and stated; what the truth may miss counts for the value."""
    with mp.workdps(2 * _TRUTH):
        size = abs(mpf(true.value))
        error = max(abs(mpf(found.value) - true.value) / size - true.error, 0)
        stated = None if found.error is None else _small(mpf(found.error) / size)
        return _small(error), stated


def _small(x: Any) -> float:
    """A float, rounded up from what is below its range."""
    return max(float(x), 5e-324) if x else 0.0


# -- verify ----------------------------------------------------------------------------------------


def verify(level: str = "quick", seed: int = 1) -> tuple[list[Record], str]:
    """The records of the problem table, at level ``"full"`` of the slow scenes and random ones too.

    Returns
    -------
    list of Record, str
        And a table: cases, failures, and the worst true error over the stated one.
    """
    if level not in ("quick", "full"):
        raise InputError(f"level is {level!r}; give quick or full.")
    tags = {"refused"} if level == "full" else {"refused", "slow", "may refuse", "extreme"}
    scenes = [p for p in PROBLEMS if not p.tags & tags]
    if level == "full":
        scenes += [random_scene(seed, k) for k in range(200)]
    found: list[Record] = []
    with progress.stage("verify", len(scenes), every=5.0) as step:
        for problem in scenes:
            found += records(problem)
            step()
    rows = defaultdict(list)
    for r in found:
        rows[r.quantity, r.method].append(r)
    lines = [f"{'':7}{'method':14}{'cases':>6}{'failed':>8}{'worst true/stated':>19}"]
    for (quantity, method), some in sorted(rows.items()):
        worst = max((r.error / r.stated for r in some if r.stated), default=math.nan)
        failed = sum(not r.holds for r in some)
        lines.append(f"{quantity:7}{method:14}{len(some):6}{failed:8}{worst:19.3g}")
    lines += [f"FAILED: {r}" for r in found if not r.holds]
    lines.append(f"{len(found)} values, {sum(not r.holds for r in found)} above their errors.")
    return found, "\n".join(lines)


def random_scene(seed: int, index: int) -> Problem:
    """A scene of a random drift; a third of them is smooth enough for plain quadrature."""
    draw = random.Random(f"symasym {seed} {index}")

    def number(low: float, high: float) -> Fraction:
        return Fraction(draw.randint(int(low * 1000), int(high * 1000)), 1000)

    smooth = index % 3 == 0
    ends = number(-3, 3), number(-3, 3)
    make: Any
    make, arguments = [
        (sa.friction, (number(0, 8), number(0.1, 4), number(-4, 6))),
        (sa.polynomial, tuple(number(-3, 3) for _ in range(draw.randint(1, 7)))),
        (sa.tanh, (*ends, number(0.1, 20))),
        (sa.sine, (*ends, number(-4, 4))),
        (sa.hill, (*ends, number(0.1, 2))),
    ][index % 5]
    kappa = Fraction(f"{10 ** (draw.uniform(-0.3, 1) if smooth else draw.uniform(-1.5, 4)):.5e}")
    r = Fraction(f"{10 ** draw.uniform(-0.5, 1):.5e}")
    start = draw.choice((Fraction(0), r * number(-0.99, 0.99)))
    a, b = make(*arguments).ends
    tags = {"sliding" if a > 0 > b else "up", *(["quadrature"] if smooth else [])}
    made = lambda: make(*arguments)  # noqa: E731
    name = f"random {index} of seed {seed}"
    return Problem(name, made, str(kappa), str(r), str(start), frozenset(tags))


# -- report ----------------------------------------------------------------------------------------


def report(
    folder: str | Path, names: list[str] | None = None, quick: bool = False
) -> tuple[list[Record], list[Path]]:
    """Error against run time of T: all methods and the peers, as a table, a CSV and a picture.

    Raises
    ------
    InputError
        For a scene that is not in the problem table.
    """
    from symasym.workshop import peers

    names = names or list(_SCENES[1:4] if quick else _SCENES)
    unknown = [n for n in names if n not in BY_NAME]
    if unknown:
        raise InputError(f"{unknown[0]} is no scene; they are {', '.join(BY_NAME)}.")
    found: list[Record] = []
    with progress.stage("report", len(names), every=5.0) as step:
        for name in names:
            problem = BY_NAME[name]
            found += records(problem, ["T"])
            true = truth(problem, "T")
            for peer, call in peers.of(problem, quick):
                began = time.process_time()
                value = call()
                seconds = time.process_time() - began
                with mp.workdps(_TRUTH):
                    error = _small(abs(mpf(value) / true.value - 1))
                found.append(Record(name, "T", peer, None, None, seconds, error, None, "none"))
            step()
    place = Path(folder)
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([Record._fields, *found])
    picture = io.BytesIO()
    work_precision(found).savefig(picture, format="svg", metadata={"Date": None})
    files = {"report.md": _markdown(found), "report.csv": out.getvalue()}
    for name, text in files.items():
        write_bytes(place / name, text.encode())
    write_bytes(place / "report.svg", picture.getvalue())
    return found, [place / name for name in (*files, "report.svg")]


def _markdown(found: list[Record]) -> str:
    """A table a scene; seconds as multiples of the proved float64 value's, in the same run."""
    lines = []
    for scene in dict.fromkeys(r.scene for r in found):
        some = [r for r in found if r.scene == scene]
        unit = next(r.seconds for r in some if r.method == "exact")
        lines += [f"## {scene}", "", "| method | error | stated | kind | time |", "|" + "---|" * 5]
        for r in some:
            asked = "" if r.order is None else f", order {r.order}"
            asked += "" if r.digits is None else f", {r.digits} digits"
            stated = "" if r.stated is None else f"{r.stated:.2g}"
            lines.append(
                f"| {r.method}{asked} | {r.error:.2g} | {stated} | {r.kind} | "
                f"{r.seconds / max(unit, 1e-9):.3g} |"
            )
        lines.append("")
    return "\n".join(lines)


def work_precision(found: list[Record]) -> Figure:
    """Relative error against seconds, a panel a scene."""
    from matplotlib.figure import Figure

    from symasym.workshop.figures.style import style

    scenes = list(dict.fromkeys(r.scene for r in found))
    columns = min(2, len(scenes))
    rows = math.ceil(len(scenes) / columns)
    methods = list(dict.fromkeys(r.method for r in found))
    with style():
        figure = Figure(figsize=(7.4, 2.5 * rows + 1.0))
        panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for axes, scene in zip(panels, scenes, strict=False):
            for k, method in enumerate(methods):
                some = [r for r in found if (r.scene, r.method) == (scene, method)]
                x, y = [max(r.error, 1e-62) for r in some], [r.seconds for r in some]
                look = f"C{k % 4}", "os^vxD+*1<>"[k % 11]
                axes.plot(x, y, color=look[0], marker=look[1], lw=0.8, ms=5, label=method)
            axes.set(title=scene, xscale="log", yscale="log", xlim=(1e-64, 10))
            axes.set_xticks([1e-60, 1e-40, 1e-20, 1])
            axes.minorticks_off()
            axes.grid(True, color="0.92", linewidth=0.6)
        for axes in panels[len(scenes) :]:
            axes.set_visible(False)
        for k, axes in enumerate(panels[: len(scenes)]):
            axes.set_xlabel("relative error of T")
            if k % columns == 0:
                axes.set_ylabel("seconds")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure
