"""Digits claimed and digits true over the extreme scenes, method by method."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base import progress
from symasym.workshop.problems import PROBLEMS, Problem
from symasym.workshop.report.diagrams import heat_maps
from symasym.workshop.report.measure import (
    MOST,
    OURS,
    Cell,
    Point,
    Run,
    columns,
    known,
    missing,
    others,
    ours,
    point,
)
from symasym.workshop.report.pages import cause, head, lies, publish, table, typeset
from symasym.workshop.report.timing import capped, load, measured_on

if TYPE_CHECKING:
    from mpmath import mpf


_LIMITS = {True: 5.0, False: 60.0}


def scenes(quick: bool) -> list[Problem]:
    """The extreme scenes; those beside folds and kinks as well unless it must be quick."""
    tags = {"extreme"} if quick else {"extreme", "stiff", "fold", "kink", "start at the edge"}
    return [p for p in PROBLEMS if p.tags & tags and not p.tags & {"refused", "slow"}]


def cells(quick: bool) -> tuple[list[Cell], list[Point]]:
    """Every method on every scene, and the points behind the cells."""
    judged, points = [], []
    asked = scenes(quick)
    with progress.stage("stability", len(asked)) as step:
        for problem in asked:
            truth = known(problem)
            size = max(1.0, abs(float(truth.value)))
            for run in _runs(problem, quick):
                p = point(problem.name, run, truth, _LIMITS[quick], once=True)
                points.append(p)
                judged.append(
                    Cell(
                        p.scene, p.method, p.setting, p.ours, _digits(p.claimed, size),
                        MOST if p.below_reference else _digits(p.error, size), p.kind, p.reason,
                    )
                )  # fmt: skip
            step()
    return judged, points


def _runs(problem: Problem, quick: bool) -> list[Run]:
    """The runs of ours that have a column, and the peers'."""
    own = {(run.method, run.setting): run for run in ours(problem, False)}
    return [*(own[key] for key in OURS if key in own), *others(problem, True)]


@dataclass
class Condition:
    """Condition numbers of T and of log T with respect to what defines a scene.

    A relative error e of a parameter changes T by e times that number: what is lost so is the
    problem's, and what is lost beyond it the method's.
    """

    scene: str
    of_T: dict[str, float]
    of_log_T: dict[str, float]
    reason: str


def conditions(quick: bool) -> list[Condition]:
    """Condition numbers of the same scenes, from exact derivatives."""
    asked, numbers = scenes(quick), []
    with progress.stage("condition numbers", len(asked)) as step:
        for problem in asked:
            numbers.append(_condition(problem, _LIMITS[quick]))
            step()
    return numbers


def _condition(problem: Problem, limit: float) -> Condition:
    """The condition numbers of one scene; the reason where there are none."""

    def ask() -> Any:
        return sa.sensitivity(problem.make(), problem.kappa, problem.r, start=problem.start, dps=15)

    try:
        derivatives = capped(ask, limit)[1]
    except sa.SymasymError as error:
        return Condition(problem.name, {}, {}, str(error))
    if derivatives is None:
        return Condition(problem.name, {}, {}, f"stopped after {limit:g} s")
    of_T, of_log_T = (
        {name: _finite(x) for name, x in d.items()}
        for d in (derivatives.condition, derivatives.log_condition)
    )
    return Condition(problem.name, of_T, of_log_T, "")


def _finite(x: mpf | float) -> float:
    return min(float(x), 1e300)


def _digits(error: float | None, size: float) -> float | None:
    """Digits of a number of this size that an error leaves."""
    if error is None:
        return None
    return min(MOST, -math.log10(max(error / size, 1e-300)))


def report(folder: str | Path, quick: bool = False) -> tuple[list[Point], list[Path]]:
    """Points of ours that claim more than is true, and the files: the cells (JSON), the heat maps
    (PNG, SVG) and the page."""
    before = load()
    judged, points = cells(quick)
    numbers = conditions(quick)
    where = measured_on(before)
    command = "symasym report --stability" + (" --quick" if quick else "")
    record = {
        "cells": [asdict(cell) for cell in judged],
        "conditions": [asdict(number) for number in numbers],
    }
    paths = publish(
        Path(folder),
        {"stability.md": page(parts(judged, numbers, missing(), where, command)).encode()},
        {"stability": heat_maps(judged)},
        ("stability.json", command, where, record),
    )
    return [p for p in lies(points) if p.ours], paths


def summary(judged: list[Cell]) -> str:
    """A row a method: values, refusals, the fewest right digits, claims above the truth."""
    rows = []
    for method, setting in columns(judged):
        own = [c for c in judged if (c.method, c.setting) == (method, setting)]
        values = [c for c in own if c.true is not None]
        wrong = [f"`{c.scene}`" for c in own if c.wrong]
        least = min((c.true for c in values if c.true is not None), default=None)
        cell = "–" if least is None else f"{max(least, 0.0):.1f}"
        row = [method, setting, str(len(values)), str(len(own) - len(values)), cell]
        rows.append([*row, str(len(wrong)), ", ".join(wrong)])
    names = ["method", "setting", "values", "none", "fewest right digits", "claimed > true"]
    return table([*names, "where"], rows)


def parts(
    judged: list[Cell], numbers: list[Condition], gone: list[str], where: str, command: str
) -> dict[str, str]:
    """The two parts of the page by name; docs/keep.py puts them into a page of its own."""
    ours_wrong = sum(c.wrong for c in judged if c.ours)
    blocks = {
        "digits": [
            *head(command, where, gone),
            "Digits claimed and digits true of $\\log T$ (of $T$ where $\\log T$ is below 1), over "
            "the extreme scenes of the problem table. A quadrature that states no error is "
            "taken to claim the digits it was asked for. References are proved, or two precisions "
            "of 120 and 160 digits agree.",
            f"Values of symasym that claim more digits than are true: {ours_wrong}.",
            "![digits claimed and true](stability.svg)",
            summary(judged),
        ],
        "conditions": [
            "The decimal logarithm of the condition number of $T$ and, behind the slash, of "
            "$\\log T$, from exact derivatives (`sa.sensitivity`): so many digits of the value are "
            "lost if the parameter is rounded, by any method. A dot stands for a condition number "
            "of at most 1, a dash for no such parameter.",
            _condition_table(numbers),
        ],
    }
    return {name: typeset("\n\n".join(part)) for name, part in blocks.items()}


def page(written: dict[str, str]) -> str:
    """The whole page, of its parts."""
    return (
        f"# Numerical stability\n\n{written['digits']}\n\n## Condition numbers\n\n"
        f"{written['conditions']}\n"
    )


def _condition_table(numbers: list[Condition]) -> str:
    """The table of condition numbers, as digits that a rounded parameter costs."""
    # A parameter whose rounding costs no digit anywhere has no column.
    names = list(dict.fromkeys(name for c in numbers for name in c.of_T))
    names = [n for n in names if any(c.of_T.get(n, 0) > 1 for c in numbers)]
    rows = []
    for c in numbers:
        pairs = [(c.of_T[n], c.of_log_T[n]) if n in c.of_T else () for n in names]
        cells = ["\u00a0/\u00a0".join(map(_lost, pair)) or "–" for pair in pairs]
        rows.append([f"`{c.scene}`", *cells, cause(c.reason)])
    return table(["scene", *(_SYMBOLS.get(n, n) for n in names), "why there are none"], rows)


_SYMBOLS = {
    "mu": r"$\mu$",
    "alpha": r"$\alpha$",
    "z0": "$z_0$",
    "kappa": r"$\kappa$",
    "r": "$r$",
    "a_minus": "$a^-$",
    "a_plus": "$a^+$",
}


def _lost(condition: float) -> str:
    """Digits that are lost at a condition number."""
    return f"{math.log10(condition):.1f}" if condition > 1 else "·"
