"""The paper's figures, computed from the model; each function gives a matplotlib Figure.

A figure's caption is its label, ``figure.get_label()``, and stands in every file of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from symasym.workshop.figures.flows import fil, flows, phase
from symasym.workshop.figures.release import regimes, release
from symasym.workshop.figures.shapes import fricforce, friction_osc, potential_sketch
from symasym.workshop.figures.style import KINDS, encode
from symasym.workshop.figures.times import DRAWN, EPS, R, fric1, fric2, stokes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DRAWN", "EPS", "FIGURES", "KINDS", "R", "encode"]

#: Every figure by its name in the paper.
FIGURES: dict[str, Callable[[], Figure]] = {
    "fil": fil,
    "flows": flows,
    "potentialSketch": potential_sketch,
    "frictionOsc": friction_osc,
    "phase": phase,
    "fricforce": fricforce,
    "fric1": fric1,
    "fric2": fric2,
    "stokes": stokes,
    "release": release,
    "regimes": regimes,
}
