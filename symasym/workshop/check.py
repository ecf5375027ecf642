"""Runs every method on every scene and records value, stated error, true error and run time.

`verify` checks that no true error exceeds the stated one. `report` plots error against run time,
including other programs (`symasym.workshop.peers`). The truth is a closed form, otherwise plain
quadrature of the printed integrals (`symasym.workshop.reference_quadrature`) if the scene is smooth
enough for it, otherwise the exact value in balls with 60 digits.
"""

from __future__ import annotations

import csv
import io
import math
import random
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from mpmath import mp, mpf

from symasym.base.errors import SymasymError
from symasym.base.files import progress, write_bytes
from symasym.base.inputs import choice
from symasym.workshop.problems import BY_NAME, PROBLEMS, Problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TRUTH, _QUADRATURE = 60, 25  # digits of the truth in balls, and by quadrature
_LEAST = 1e-25  # smaller errors are drawn there
#: Method, order, and the digits asked for (None: float64).
RUNS: list[tuple[str, int | None, int | None]] = [
    *(("exact", None, digits) for digits in (None, 20, 50)),
    ("paper", None, 20),
    *(("laplace", order, 20) for order in (0, 1, 2, 4)),
    *(("uniform", order, 20) for order in (0, 1, 2)),
    *(("strong_noise", order, 20) for order in (0, 2, 8)),
    ("bound", None, 20),
]
_SCENES = [
    "friction", "friction k=0.3", "friction k=1", "friction past the fold", "sine", "tanh",
]  # fmt: skip


class Record(NamedTuple):
    """One value compared with the truth; errors are relative, None if none is stated."""

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
        """False if the true error exceeds the stated one."""
        return self.stated is None or self.error <= self.stated


def truth(problem: Problem, quantity: str) -> tuple[Any, float]:
    """The reference value, independent if the scene allows it, and its relative error."""
    if quantity in problem.closed:
        return problem.known(quantity, _TRUTH), 10.0**-_TRUTH
    if "quadrature" in problem.tags and quantity != "1 - C":
        return problem.by_quadrature(quantity, _QUADRATURE), 10.0 ** (1 - _QUADRATURE)
    return problem.ask(quantity, dps=_TRUTH), 10.0 ** (1 - _TRUTH)


def records(
    problem: Problem,
    quantities: Iterable[str] = (),
    peers: Iterable[tuple[str, Callable[[], Any]]] = (),
) -> Iterator[Record]:
    """The answers of every method and peer for a scene; a method that refuses it has none."""
    for quantity in quantities or problem.quantities:
        try:
            true, known_to = truth(problem, quantity)
        except SymasymError:
            continue
        calls: list[Any] = [(run, partial(_asked, problem, quantity, *run)) for run in RUNS]
        calls += [((name, None, None), peer) for name, peer in peers]
        with suppress(SymasymError):  # excludes loading and compiling from the times
            _asked(problem, quantity, *RUNS[0])
        for (method, order, digits), call in calls:
            began = time.process_time()
            try:
                found = call()
            except SymasymError:
                continue
            seconds = time.process_time() - began
            value, stated = getattr(found, "value", found), getattr(found, "error", None)
            with mp.workdps(2 * _TRUTH):
                size = abs(mpf(true))
                # The error of the truth counts in favour of the value.
                error = _small(max(abs(mpf(value) - true) / size - known_to, 0))
                stated = None if stated is None else _small(mpf(stated) / size)
            kind = getattr(found, "error_kind", "none")
            known = problem.name, quantity, method, order, digits
            yield Record(*known, seconds, error, stated, kind)


def _asked(problem: Problem, quantity: str, method: str, order: Any, dps: Any) -> Any:
    return problem.ask(quantity, method=method, order=order, dps=dps, full=True)


def _small(x: Any) -> float:
    """The number as a float, rounded up if it underflows."""
    return max(float(x), 5e-324) if x else 0.0


# -- verify ----------------------------------------------------------------------------------------


def verify(level: str = "quick", seed: int = 1) -> tuple[list[Record], str]:
    """The records of the problem table; level ``"full"`` adds the slow scenes and random ones.

    Returns
    -------
    list of Record, str
        And a table: cases, failures, and the worst true error over the stated one.
    """
    left_out = {"refused", "slow", "may refuse", "extreme"}
    scenes = PROBLEMS
    if choice("level", level, ("quick", "full")) == "full":
        left_out, scenes = {"refused"}, [*PROBLEMS, *(random_scene(seed, k) for k in range(200))]
    scenes = [p for p in scenes if not p.tags & left_out]
    found: list[Record] = []
    with progress("verify", len(scenes)) as bar:
        for problem in scenes:
            found += records(problem)
            bar.update()
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
    """A scene with a random drift; a third of them are smooth enough for plain quadrature."""
    draw = random.Random(f"symasym {seed} {index}")

    def number(low: float, high: float) -> Fraction:
        return Fraction(draw.randint(int(low * 1000), int(high * 1000)), 1000)

    smooth, ends = index % 3 == 0, (number(-3, 3), number(-3, 3))
    kind, *numbers = [
        ("friction", number(0, 8), number(0.1, 4), number(-4, 6)),
        ("polynomial", *(number(-3, 3) for _ in range(draw.randint(1, 7)))),
        ("tanh", *ends, number(0.1, 20)),
        ("sine", *ends, number(-4, 4)),
        ("hill", *ends, number(0.1, 2)),
    ][index % 5]
    kappa = f"{10 ** (draw.uniform(-0.3, 1) if smooth else draw.uniform(-1.5, 4)):.5e}"
    r = Fraction(f"{10 ** draw.uniform(-0.5, 1):.5e}")
    start = draw.choice((Fraction(0), r * number(-0.99, 0.99)))
    drift, tags = " ".join(map(str, (kind, *numbers))), {"quadrature"} if smooth else set()
    name = f"random {index} of seed {seed}"
    found = Problem(name, drift, kappa, str(r), str(start), frozenset(tags))
    low, high = found.make().ends
    return replace(found, tags=found.tags | {"sliding"}) if low > 0 > high else found


# -- report ----------------------------------------------------------------------------------------


def report(
    folder: str | Path, names: list[str] | None = None, quick: bool = False
) -> tuple[list[Record], list[Path]]:
    """Error against run time for T, all methods and peers, as a table, a CSV file and a figure.

    Raises
    ------
    InputError
        For a scene that is not in the problem table.
    """
    from symasym.workshop import peers

    names = names or (_SCENES[1:4] if quick else _SCENES)
    scenes = [BY_NAME[choice("scene", name, BY_NAME)] for name in names]
    found: list[Record] = []
    with progress("report", len(scenes)) as bar:
        for problem in scenes:
            found += records(problem, ["T"], list(peers.of(problem, quick)))
            bar.update()
    table, picture = io.StringIO(), io.BytesIO()
    csv.writer(table, lineterminator="\n").writerows([Record._fields, *found])
    work_precision(found).savefig(picture, format="svg", metadata={"Date": None})
    files = {"md": _markdown(found).encode(), "csv": table.getvalue().encode()}
    files["svg"] = picture.getvalue()
    for kind, data in files.items():
        write_bytes(Path(folder) / f"report.{kind}", data)
    return found, [Path(folder) / f"report.{kind}" for kind in files]


def _markdown(found: list[Record]) -> str:
    """One table per scene; times are multiples of that of the proved float64 value."""
    lines = ["Errors are relative; times are in units of the first exact value's.", ""]
    for scene in dict.fromkeys(r.scene for r in found):
        some = [r for r in found if r.scene == scene]
        unit = max(1e-9, next(r.seconds for r in some if r.method == "exact"))
        lines += [f"## {scene}", "", "| method | error | stated | kind | time |", "|" + "---|" * 5]
        for r in some:
            asked = "" if r.order is None else f", order {r.order}"
            asked += "" if r.digits is None else f", {r.digits} digits"
            stated = "" if r.stated is None else f"{r.stated:.2g}"
            cells = f"{r.method}{asked} | {r.error:.2g} | {stated} | {r.kind}"
            lines.append(f"| {cells} | {r.seconds / unit:.3g} |")
        lines.append("")
    return "\n".join(lines)


def work_precision(found: list[Record]) -> Figure:
    """Relative error, those below 1e-25 drawn there, against seconds; a panel a scene."""
    from matplotlib.figure import Figure

    from symasym.workshop.style import FAINT, METHODS, style

    scenes = list(dict.fromkeys(r.scene for r in found))
    rows, columns = math.ceil(len(scenes) / 2), min(2, len(scenes))
    with style():
        figure = Figure(figsize=(7.4, 2.5 * rows + 1.0))
        panels = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for axes, scene in zip(panels.flat, scenes, strict=False):
            for k, method in enumerate(dict.fromkeys(r.method.partition(",")[0] for r in found)):
                some = [r for r in found if r.scene == scene and r.method.startswith(method)]
                x, y = [max(r.error, _LEAST) for r in some], [r.seconds for r in some]
                look = {"color": METHODS.get(method, FAINT), "marker": "os^vXDP*<>h"[k % 11]}
                axes.plot(x, y, **look, lw=0.8, ms=5, label=method)
            axes.set(title=scene.replace("k=", "κ = "), xscale="log", yscale="log")
            axes.set(xlabel="relative error of T", xlim=(_LEAST / 10, 10))
            axes.set_xticks([10.0**-k for k in range(0, 25, 6)])
            axes.minorticks_off()
            axes.grid(True, color="0.92", linewidth=0.6)
        for axes in panels.flat[len(scenes) :]:
            axes.set_visible(False)
        for axes in panels[:, 0]:
            axes.set_ylabel("seconds")
        labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(*labels, loc="outside lower center", ncols=5)
    return figure
