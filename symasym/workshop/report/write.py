"""The files of a report."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import asdict, fields
from pathlib import Path

from symasym.base import progress
from symasym.workshop.report import growth, integral_peers
from symasym.workshop.report.measure import Point, known, point
from symasym.workshop.report.methods import chosen, described, missing, others, ours
from symasym.workshop.report.pages import page, publish
from symasym.workshop.report.timing import load, measured_on

#: Seconds after which a method is stopped.
LIMITS = {True: 10.0, False: 120.0}


def measured(
    names: list[str] | None, quick: bool
) -> tuple[list[Point], list[growth.Grown], dict[str, str]]:
    """The points of all scenes, the growth, and what each scene is.

    Raises
    ------
    InputError
        For a scene that is not in the report.
    """
    scenes = chosen(names)
    runs = {
        name: [*ours(problem, quick), *others(problem, quick)] for name, problem in scenes.items()
    }
    points, about = [], {}
    with progress.stage("report", sum(map(len, runs.values()))) as step:
        for name, problem in scenes.items():
            truth = known(problem)
            kind = "proved (ball arithmetic)" if truth.proved else "two precisions agree"
            about[name] = f"{described(problem)} | {kind}"
            for run in runs[name]:
                points.append(point(name, run, truth, LIMITS[quick]))
                step()
    grown: list[growth.Grown] = []
    stages: tuple[Callable[[bool], Iterator[growth.Grown]], ...] = (
        growth.digits, growth.noise, growth.points,
    )  # fmt: skip
    with progress.stage("growth", len(stages)) as step:
        for stage in stages:
            grown += stage(quick)
            step()
    return points, grown, about


def report(
    folder: str | Path, names: list[str] | None = None, quick: bool = False
) -> tuple[list[Point], list[Path]]:
    """Measure, and write points (JSON, CSV), diagrams (PNG, SVG) and the page.

    Parameters
    ----------
    folder : path
    names : list of str, optional
        Scenes; all when left out.
    quick : bool
        Fewer orders and peers, which are stopped after 10 s.

    Returns
    -------
    points : list of Point
    paths : list of Path
        The files.
    """
    from symasym.workshop.report import diagrams

    before = load()
    points, grown, about = measured(names, quick)
    where = measured_on(before)
    command = "symasym report" + (" --quick" if quick else "")
    command += "".join(f" --scene {name}" for name in names or ())
    text = page(points, grown, about, missing(), where, command) + integral_peers.section()
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
