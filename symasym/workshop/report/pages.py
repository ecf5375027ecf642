"""The report as Markdown: which method when, growth, the machine beside it; and its files."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from dataclasses import asdict, fields
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symasym.base import progress
from symasym.base.files import versions, write_bytes, write_json
from symasym.workshop.figures.style import encode
from symasym.workshop.report import diagrams, peers, timing
from symasym.workshop.report.measure import (
    Point,
    chosen,
    described,
    known,
    missing,
    others,
    ours,
    point,
)
from symasym.workshop.report.timing import Grown, exponent, in_tex, load, measured_on

if TYPE_CHECKING:
    from matplotlib.figure import Figure


THRESHOLDS = {"1e-2": 1e-2, "1e-6": 1e-6, "1e-12": 1e-12, "1e-50": 1e-50}
EXPANSIONS = ("laplace", "uniform", "strong_noise", "paper")


def cheapest(points: Iterable[Point], allowed: float, ours: bool) -> Point | None:
    """The fastest whose true error is at most `allowed`."""
    fit = [
        p
        for p in points
        if p.ours == ours and p.error is not None and p.error <= allowed and p.seconds is not None
    ]
    return min(fit, key=lambda p: p.seconds or 0.0, default=None)


def time_text(x: float) -> str:
    """Seconds with a fitting unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if x >= size:
            return f"{x / size:.3g} {unit}"
    return f"{x * 1e6:.3g} µs"


def typeset(text: str) -> str:
    """`text` with every number such as 1e-6 as a formula, but in code."""
    parts = text.split("`")
    parts[::2] = [re.sub(r"\b(\d[\d.]*)e([-+]?\d+)\b", _power, part) for part in parts[::2]]
    return "`".join(parts)


def _power(number: re.Match[str]) -> str:
    """A number as a formula, or as it is where the power would be 1 or 10."""
    if 0 <= int(number[2]) <= 1:
        return f"{float(number[0]):g}"
    factor = "" if float(number[1]) == 1 else rf"{number[1]} \times "
    return f"${factor}10^{{{int(number[2])}}}$"


def table(names: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def head(command: str, machine: str, missing: list[str]) -> list[str]:
    """The blocks that every page begins with."""
    gone = ", ".join(missing)
    return [
        f"Made by `{command}`, and nothing in it is typed by hand. {machine}",
        f"Not installed, and left out of these parts: {gone}."
        if gone
        else "Every other program was installed for these parts.",
    ]


def when(points: list[Point]) -> str:
    """The table of symasym's cheapest for each error, and below it the fastest other program."""
    rows = []
    for scene in dict.fromkeys(p.scene for p in points):
        own = [p for p in points if p.scene == scene]
        for mine in (True, False):
            cells = [f"**{scene}**" if mine else "(others)"]
            for allowed in THRESHOLDS.values():
                best = cheapest(own, allowed, mine)
                cells.append("–" if best is None else _cell(best))
            rows.append(cells)
    return typeset(table(["scene", *(f"error ≤ {x}" for x in THRESHOLDS)], rows))


def _cell(best: Point) -> str:
    """A method and its time, in a cell of the table."""
    silent = "" if best.claimed is not None else " (claims no error)"
    return f"{best.method}, {best.setting}{silent}: {time_text(best.seconds or 0.0)}"


def reached(points: list[Point]) -> str:
    """The smallest true error of each expansion, scene by scene, with the setting that has it."""
    own = [p for p in points if p.method in EXPANSIONS]
    methods = [m for m in EXPANSIONS if any(p.method == m for p in own)]
    rows = []
    for scene in dict.fromkeys(p.scene for p in points):
        cells = [f"**{scene}**"]
        for method in methods:
            fit = [p for p in own if (p.scene, p.method) == (scene, method) and p.error is not None]
            best = min(fit, key=lambda p: p.error or 0.0, default=None)
            cells.append("–" if best is None else _error_cell(best))
        rows.append(cells)
    return table(["scene", *methods], rows)


def _error_cell(best: Point) -> str:
    """An error and the setting that reaches it, in a cell of the table."""
    below = "at most " if best.below_reference else ""
    setting = "" if best.setting == "leading order" else f" ({best.setting})"
    return f"{below}{best.error:.0e}{setting}"


def refusals(points: list[Point]) -> str:
    """A table of the methods that gave no value, with the reasons."""
    settings: dict[tuple[str, str, str], list[str]] = {}
    for p in points:
        if p.reason:
            settings.setdefault((p.scene, p.method, cause(p.reason)), []).append(p.setting)
    rows = [
        [*key[:2], ", ".join(own).replace(", order ", ", "), key[2]]
        for key, own in settings.items()
    ]
    return table(["scene", "method", "settings", "why there is no value"], rows) if rows else ""


# What the other columns of the table say already, and symbols -> as a cell has them.
_IN_CELLS = {
    r"kappa is [^,]+, where ": "",
    r" with order=\w+": "",
    r"\d+ terms? in 2/kappa\^2 leaves? an": r"the terms in $2/\\kappa^2$ leave an",
    r"\ba([-+]) = (-?[\d.]+)": r"$a^\1 = \2$",
    r"\bu = (-?[\d.]+)": r"$u = \1$",
    r"\bA (?=varies)": "$A$ ",
    r"\|": r"\\|",
}


def cause(reason: str) -> str:
    """A reason as a cell; what to do about it is of no use there."""
    text = reason.split(";")[0]
    for said, written in _IN_CELLS.items():
        text = re.sub(said, written, text)
    return text


def lies(points: list[Point]) -> list[Point]:
    """Points whose claimed error is below the true one."""
    certain = (p for p in points if not p.below_reference)
    # log T is a float64 where it was asked in float64: its last digit is no claim.
    return [p for p in certain if p.error and p.claimed and p.error > p.claimed * (1 + 1e-9)]


def growth(grown: list[Grown]) -> str:
    """A table for each axis."""
    parts = []
    titles = {"digits": "digits", "lam": r"$\lambda$", "points": "number of points"}
    for axis, items in groupby(grown, key=lambda g: g.along):
        every = list(items)
        names = list(dict.fromkeys(g.method for g in every))
        rows = []
        for at in dict.fromkeys(g.at for g in every):
            cells = [f"{at:.6g}"]
            for name in names:
                hit = [g for g in every if g.method == name and g.at == at]
                memory = f", {hit[0].mib:.0f} MiB" if hit and hit[0].mib is not None else ""
                cells.append(f"{time_text(hit[0].seconds)}{memory}" if hit else "–")
            rows.append(cells)
        last = []
        for name in names:
            own = [g for g in every if g.method == name]
            if len(own) > 1:
                last.append(f"{in_tex(name)} {exponent(own):.2f}")
        heads = [titles[axis], *map(in_tex, names)]
        parts += [f"### With the {titles[axis]}".replace("the $", "$"), table(heads, rows)]
        parts.append(f"Exponent of the growth between the two largest sizes: {'; '.join(last)}.")
    return "\n\n".join(parts)


def parts(
    points: list[Point],
    grown: list[Grown],
    scenes: dict[str, str],
    missing: list[str],
    machine: str,
    command: str,
) -> dict[str, str]:
    """The parts of the page by name, in its order; docs/keep.py distributes them over pages."""
    wrong = lies(points)
    ours = [p for p in wrong if p.ours]
    others = [p for p in wrong if not p.ours]
    listed = ", ".join(f"{p.method} {p.setting} (**{p.scene}**)" for p in others)
    blocks = {
        "scenes": [
            *head(command, machine, missing),
            "Errors are relative errors of $T$ (absolute errors of $\\log T$), against a reference "
            "of 120 digits. A time is the least processor time of several runs.",
            table(["scene", "what", "reference"], [_scene(n, t) for n, t in scenes.items()]),
        ],
        "when": [
            "symasym's fastest method whose true error is at most that at the head of the column, "
            "and in the row below it the fastest of the other programs. An epsrel is what "
            "`dblquad` was asked for, not the error that it reached.",
            when(points),
        ],
        "diagram": [
            "![seconds against the true relative error of T, a panel for each scene and a curve "
            "for each method](work-precision.svg)",
            "Further left is more accurate, further down is faster. Of symasym's marks a full one "
            "claims an error and a hollow one claims none; the other programs' marks have no "
            "inside. A small caret that points left, on a mark, says that the error is smaller "
            "than drawn: below that of the reference, or left of the axis.",
        ],
        "reached": [
            "The smallest true error of each expansion, whatever the time, and the setting that "
            "reaches it. A dash: every setting was refused, or stopped.",
            reached(points),
        ],
        "claims": [
            f"Points whose claimed error is below the true one: {len(ours)} of symasym.",
            f"{len(others)} points of other programs have an error above the one they state or, "
            f"where they state none, fewer digits than requested{listed and ': '}{listed}.",
        ],
        "growth": [
            growth(grown),
            "![seconds against the number of digits, lambda and the number of points](growth.svg)",
        ],
        "refusals": [refusals(points) or "Every method gave a value everywhere."],
    }
    return {name: typeset("\n\n".join(part)) for name, part in blocks.items()}


_HEADINGS = {
    "when": "Which method when",
    "reached": "What each expansion reaches",
    "claims": "Claimed errors",
    "growth": "Growth",
    "refusals": "No value",
}


def page(written: dict[str, str]) -> str:
    """The whole page, of its parts."""
    blocks = ["# Error against run time, measured"]
    for name, text in written.items():
        blocks += [f"## {_HEADINGS[name]}"] if name in _HEADINGS else []
        blocks.append(text)
    return "\n\n".join(blocks) + "\n"


def _scene(name: str, text: str) -> list[str]:
    """A row of the table of scenes: its drift as code, its numbers as formulas."""
    what, reference = text.split(" | ")
    drift, kappa, r = re.split(r", (?:kappa|r) = ", what)
    numbers = [
        f"${symbol} = {typeset(x).strip('$')}$" for symbol, x in (("\\kappa", kappa), ("r", r))
    ]
    return [name, ", ".join([f"`{drift}`", *numbers]), reference]


_LIBRARIES = ("numpy", "mpmath", "python-flint", "scipy", "sympy", "matplotlib")


def publish(
    folder: Path,
    texts: dict[str, bytes],
    figures: dict[str, Figure],
    record: tuple[str, str, str, dict[str, Any]],
) -> list[Path]:
    """The paths of what was written: texts and figures by name, each figure as PNG and SVG.

    `record` is the file name, the command, the machine and what was measured, of the JSON file.
    """
    files = texts | {
        f"{name}.{kind}": encode(figure, kind)
        for name, figure in figures.items()
        for kind in ("png", "svg")
    }
    for name, content in files.items():
        write_bytes(folder / name, content)
    last, command, where, measured = record
    about = {"command": command, "machine": where, "versions": versions(*_LIBRARIES)}
    write_json(folder / last, {**about, "missing peers": missing(), **measured})
    return [folder / name for name in (*files, last)]


# -- the report of error against run time ---------------------------------------------------------

#: Seconds after which a method is stopped.
LIMITS = {True: 10.0, False: 120.0}


def measured(
    names: list[str] | None, quick: bool
) -> tuple[list[Point], list[Grown], dict[str, str]]:
    """The points of all scenes, the growth, and what each scene is."""
    scenes = chosen(names)
    runs = {
        name: [*ours(problem, quick), *others(problem, quick)] for name, problem in scenes.items()
    }
    points, about = [], {}
    with progress.stage("report", sum(map(len, runs.values()))) as step:
        for name, problem in scenes.items():
            truth = known(problem)
            about[name] = f"{described(problem)} | proved (ball arithmetic)"
            for run in runs[name]:
                points.append(point(name, run, truth, LIMITS[quick]))
                step()
    grown: list[Grown] = []
    stages = (timing.digits, timing.noise, timing.points)
    with progress.stage("growth", len(stages)) as step:
        for stage in stages:
            grown += stage(quick)
            step()
    return points, grown, about


def report(
    folder: str | Path, names: list[str] | None = None, quick: bool = False
) -> tuple[list[Point], list[Path]]:
    """The points and the files: points (JSON, CSV), diagrams (PNG, SVG) and the page.

    The scenes are those of these `names`, all when left out; `quick` has fewer orders and peers.
    """
    before = load()
    points, grown, about = measured(names, quick)
    where = measured_on(before)
    command = "symasym report" + (" --quick" if quick else "")
    command += "".join(f" --scene {name}" for name in names or ())
    text = page(parts(points, grown, about, missing(), where, command)) + peers.section()
    record = {
        "scenes": about,
        "points": [asdict(p) for p in points],
        "growth": [asdict(g) for g in grown],
    }
    paths = publish(
        Path(folder),
        {"report.md": text.encode(), "points.csv": _csv(points)},
        {"work-precision": diagrams.work_precision(points), "growth": diagrams.growth(grown)},
        ("points.json", command, where, record),
    )
    return points, paths


def _csv(points: list[Point]) -> bytes:
    """The points as a CSV file."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [f.name for f in fields(Point)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(p) for p in points)
    return text.getvalue().encode()
