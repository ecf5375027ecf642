"""Scenes of exit laws: a table with what the collocation takes of them, and random ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy

import symasym as sa
from symasym.workshop.reproduce import Standard
from tests.law.collocation import Collocation


class Scene(Standard):
    """A problem with its law."""

    def law(self, **options: Any) -> Any:
        return sa.exit_law(self.drift, self.kappa, **self.numbers, **options)

    def collocation(self, n: int = 40) -> Collocation:
        low, high = map(float, self.ends)
        marks = [low, *(float(x) for _, x in self.phi[:-1]), high]
        sigma = function(self.sigma)
        return Collocation(
            [function(a) for a, _ in self.phi], marks, float(self.kappa), float(self.start),
            reflecting=self.reflecting, alpha=0.5 if self.ito else 0.0, n=n, sigma=sigma,
            slope=function(sigma.expression().diff(sympy.Symbol("u", real=True))),
        )  # fmt: skip


def function(formula: Any) -> sa.Drift:
    """An expression in u as a function of arrays."""
    return sa.Drift(formula, layer=None)


WELL = (("u - u**3", None),)
JUMPS = (("2", "-1"), ("cos(3*u)", "0"), ("-exp(u)/2", None))
BENT = "2 + sin(u)"
SCENES = (
    Scene("double well", WELL, "0.7", ("-1.5", "1.25"), "0.25"),
    Scene("well beside a wall", WELL, "0.7", ("-1.5", "1.25"), "-0.5", reflecting="right"),
    Scene("start on the wall", WELL, "0.8", ("-0.5", "1.5"), "-0.5", reflecting="left"),
    Scene("Ito", WELL, "0.5", ("-1.5", "1.25"), "0.25", BENT),
    Scene("Stratonovich", WELL, "0.5", ("-1.5", "1.25"), "0.25", BENT, "stratonovich"),
    Scene(
        "Stratonovich beside a wall", (("tanh(2*u) - u", None),), "1", ("-1", "2"), "0.5",
        "1 + u**2/4", "stratonovich", "left",
    ),
    Scene("jumps", JUMPS, "1.25", ("-2", "2"), "0.25"),
    Scene("jumps beside a wall", JUMPS, "1.25", ("-2", "2"), "-0.5", reflecting="right"),
)  # fmt: skip
TABLE = {scene.name: scene for scene in SCENES}


def drawn(random: Any) -> Scene:
    """A scene whose mean is moderate or huge: any kind of drift, with noise of its own or not."""

    def number(size: float) -> str:
        return f"{random.uniform(-size, size):.3f}"

    def polynomial(degree: int) -> str:
        return " + ".join(f"({number(2)})*u**{k}" for k in range(degree + 1))

    kind = random.choice(["polynomial", "polynomial", "analytic", "pieces"])
    low, high = -random.uniform(0.2, 2), random.uniform(0.2, 2)
    phi: tuple[tuple[str, Any], ...] = ((polynomial(random.integers(0, 6)), None),)
    if kind == "analytic":
        form = random.choice(["sin(({})*u + 1)", "exp(({})*u)", "tanh(2*u - ({}))"])
        phi = ((form.format(number(3)) + f" + ({number(1)})*u", None),)
    elif kind == "pieces":
        cuts = np.round(np.sort(random.uniform(low, high, random.integers(1, 4))), 3)
        ends = [*map(str, np.unique(cuts)), None]
        phi = tuple((polynomial(random.integers(0, 4)), x) for x in ends)
    sigma = random.choice(["1", "1 + u**2/4", BENT, "exp(u/3)"], p=[0.64, 0.12, 0.12, 0.12])
    ends = f"{low:.3f}", f"{high:.3f}"
    fraction, least = random.uniform(0.02, 0.98), 0.02 if sigma == "1" else 0.2
    start = f"{float(ends[0]) + fraction * (float(ends[1]) - float(ends[0])):.4f}"
    kappa = f"{np.exp(random.uniform(np.log(least), np.log(3))):.4f}"
    reflecting = random.choice([None, None, "left", "right"])
    ito: Any = [0, "stratonovich"][random.choice(2)]
    return Scene(kind, phi, kappa, ends, start, str(sigma), ito, reflecting)
