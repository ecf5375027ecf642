"""The paper's figures, computed from the model; each function gives a matplotlib Figure.

A figure's caption is its label, ``figure.get_label()``, and stands in every file of it.
"""

from symasym.workshop.figures import oscillator, times
from symasym.workshop.figures.style import KINDS, encode
from symasym.workshop.figures.times import DRAWN, EPS, R

__all__ = ["DRAWN", "EPS", "FIGURES", "KINDS", "R", "encode"]

#: Every figure by its name in the paper.
FIGURES = {
    "fil": oscillator.fil,
    "flows": oscillator.flows,
    "potentialSketch": oscillator.potential_sketch,
    "frictionOsc": oscillator.friction_osc,
    "phase": oscillator.phase,
    "fricforce": oscillator.fricforce,
    "fric1": times.fric1,
    "fric2": times.fric2,
    "stokes": times.stokes,
    "release": times.release,
    "regimes": times.regimes,
}
