"""The paper's figures, computed from the model; each function gives a matplotlib Figure.

A figure's caption is its label, ``figure.get_label()``, and stands in every file of it. A parameter
out of its range is refused by an InputError.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from symasym.workshop.figures.escape_times import (
    ALPHA,
    DRAWN,
    EPS,
    KAPPAS,
    MUS,
    Curve,
    R,
    curve,
    fric1,
    fric2,
    stokes,
)
from symasym.workshop.figures.flows import fil, flows, phase
from symasym.workshop.figures.release import regimes, release
from symasym.workshop.figures.shapes import fricforce, friction_osc, potential_sketch
from symasym.workshop.figures.style import KINDS, encode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "ALPHA", "DRAWN", "EPS", "FIGURES", "KAPPAS", "KINDS", "MUS", "R", "Curve", "curve", "encode",
    "fil", "flows", "fric1", "fric2", "fricforce", "friction_osc", "phase", "potential_sketch",
    "regimes", "release", "stokes",
]  # fmt: skip

#: Every figure by its name in the paper; all arguments of the functions have defaults.
FIGURES: dict[str, Callable[..., Figure]] = {
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
