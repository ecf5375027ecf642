"""Scenes of exit laws: a table with what the collocation takes of them, and random ones."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import symasym as sa
from tests.law.collocation import Collocation

NUMPY: dict[str, Any] = {name: getattr(np, name) for name in ("sin", "cos", "exp", "tanh")}


class Scene(NamedTuple):
    """Pieces with their right ends, the ends, a start, sigma with its slope, and alpha."""

    pieces: list[tuple[str, Any]]
    ends: tuple[str, str]
    kappa: str
    start: str
    reflecting: Any = None
    noise: tuple[str, str] | None = None
    alpha: float = 0.0

    @property
    def drift(self) -> sa.Drift:
        noise = self.noise and self.noise[0]
        return sa.Drift.piecewise(self.pieces, noise=noise, ito="stratonovich" if self.alpha else 0)

    @property
    def numbers(self) -> dict[str, Any]:
        return {"ends": self.ends, "start": self.start, "reflecting": self.reflecting}

    def law(self, **options: Any) -> Any:
        return sa.exit_law(self.drift, self.kappa, **self.numbers, **options)

    def collocation(self, n: int = 40) -> Collocation:
        low, high = map(float, self.ends)
        marks = [low, *(float(x) for _, x in self.pieces[:-1]), high]
        weights = dict(zip(("sigma", "slope"), map(function, self.noise or ()), strict=False))
        return Collocation(
            [function(a) for a, _ in self.pieces], marks, float(self.kappa), float(self.start),
            reflecting=self.reflecting, alpha=self.alpha, n=n, **weights,
        )  # fmt: skip


def function(text: str) -> Any:
    """A text of these tests as a function of arrays."""
    code = compile(text, "test", "eval")
    return lambda u: eval(code, NUMPY | {"u": u}) + 0 * u


WELL = [("u - u**3", None)]
JUMPS = [("2", -1), ("cos(3*u)", 0), ("-exp(u)/2", None)]
BENT = ("2 + sin(u)", "cos(u)")
TABLE = {
    "double well": Scene(WELL, ("-1.5", "1.25"), "0.7", "0.25"),
    "well beside a wall": Scene(WELL, ("-1.5", "1.25"), "0.7", "-0.5", "right"),
    "start on the wall": Scene(WELL, ("-0.5", "1.5"), "0.8", "-0.5", "left"),
    "Ito": Scene(WELL, ("-1.5", "1.25"), "0.5", "0.25", None, BENT),
    "Stratonovich": Scene(WELL, ("-1.5", "1.25"), "0.5", "0.25", None, BENT, 0.5),
    "Stratonovich beside a wall": Scene(
        [("tanh(2*u) - u", None)], ("-1", "2"), "1", "0.5", "left", ("1 + u**2/4", "u/2"), 0.5
    ),
    "jumps": Scene(JUMPS, ("-2", "2"), "1.25", "0.25"),
    "jumps beside a wall": Scene(JUMPS, ("-2", "2"), "1.25", "-0.5", "right"),
}  # fmt: skip


def drawn(random: Any) -> Scene:
    """A scene whose mean is moderate or huge: any kind of drift, with noise of its own or not."""

    def number(size: float) -> str:
        return f"{random.uniform(-size, size):.3f}"

    def polynomial(degree: int) -> str:
        return " + ".join(f"({number(2)})*u**{k}" for k in range(degree + 1))

    kind = random.choice(["polynomial", "polynomial", "analytic", "pieces"])
    low, high = -random.uniform(0.2, 2), random.uniform(0.2, 2)
    pieces: list[tuple[str, Any]] = [(polynomial(random.integers(0, 6)), None)]
    if kind == "analytic":
        form = random.choice(["sin(({})*u + 1)", "exp(({})*u)", "tanh(2*u - ({}))"])
        pieces = [(form.format(number(3)) + f" + ({number(1)})*u", None)]
    elif kind == "pieces":
        cuts = np.round(np.sort(random.uniform(low, high, random.integers(1, 4))), 3)
        ends = [*map(str, np.unique(cuts)), None]
        pieces = [(polynomial(random.integers(0, 4)), x) for x in ends]
    noise = [None, ("1 + u**2/4", "u/2"), BENT, ("exp(u/3)", "exp(u/3)/3")][
        random.choice(4, p=[0.64, 0.12, 0.12, 0.12])
    ]
    ends = f"{low:.3f}", f"{high:.3f}"
    fraction, least = random.uniform(0.02, 0.98), 0.2 if noise else 0.02
    start = f"{float(ends[0]) + fraction * (float(ends[1]) - float(ends[0])):.4f}"
    kappa = f"{np.exp(random.uniform(np.log(least), np.log(3))):.4f}"
    reflecting = random.choice([None, None, "left", "right"])
    return Scene(pieces, ends, kappa, start, reflecting, noise, random.choice([0.0, 0.5]))
