"""Scenes drawn from a seed: drifts of every kind, noise and radius over many decades."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import symasym as sa
from symasym.workshop.problems import Problem

_KINDS = ("friction", "polynomial", "linear", "sine", "tanh", "hill", "expression")
_SHAPES = ("exp(-X**2)", "tanh(X)", "1/(1 + X**2)", "X*exp(-X**2)", "sin(X)")


def random_scene(seed: int, index: int) -> Problem:
    """Scene number `index` of a seed, the same in every process.

    A third of them is mild enough for plain quadrature and tagged so.
    """
    draw = random.Random(f"symasym {seed} {index}")
    kind = _KINDS[index % len(_KINDS)]
    mild = index % 3 == 0
    kappa = _power(draw, -0.3, 1) if mild else _power(draw, -1.5, 4)
    r = _power(draw, -0.5, 1) if mild else _power(draw, -0.5, 4)
    start = draw.choice((Fraction(0), r * _rational(draw, -0.99, 0.99)))
    arguments = _arguments(kind, draw)
    a_minus, a_plus = _make(kind, arguments).ends
    tags = {kind, _region(a_minus, a_plus), *({"quadrature", "moderate"} if mild else ())}
    return Problem(
        f"random {index} of seed {seed}",
        lambda: _make(kind, arguments),
        str(kappa),
        str(r),
        str(start),
        frozenset(tags),
    )


def _region(a_minus: Fraction, a_plus: Fraction) -> str:
    """The tag of the region of two ends."""
    if a_minus * a_plus == 0:
        return "tangency"
    if a_minus > 0:
        return "up" if a_plus > 0 else "sliding"
    return "repelling" if a_plus > 0 else "down"


def _rational(draw: random.Random, low: float, high: float) -> Fraction:
    """A rational of three decimals between two ends."""
    return Fraction(draw.randint(int(low * 1000), int(high * 1000)), 1000)


def _power(draw: random.Random, low: float, high: float) -> Fraction:
    """A power of ten between two exponents, of six digits."""
    # Six digits, so that the scene is a short rational and still anywhere.
    return Fraction(f"{10 ** draw.uniform(low, high):.5e}")


def _arguments(kind: str, draw: random.Random) -> tuple[Any, ...]:
    """Parameters of a kind of drift."""
    ends = (_rational(draw, -3, 3), _rational(draw, -3, 3))
    if kind == "friction":
        return (_rational(draw, 0, 8), _rational(draw, 0.1, 4), _rational(draw, -4, 6))
    if kind == "polynomial":
        return tuple(_rational(draw, -3, 3) for _ in range(draw.randint(1, 7)))
    if kind == "sine":
        return (*ends, _rational(draw, -4, 4), draw.randint(1, 4))
    if kind == "tanh":
        return (*ends, _rational(draw, 0.1, 20))
    if kind == "hill":
        return (*ends, _rational(draw, 0.1, 2), draw.randint(1, 8))
    if kind == "expression":
        width, centre = _power(draw, -1, 0.5), _rational(draw, -1.1, 1.1)
        feature = draw.choice(_SHAPES).replace("X", f"((u - ({centre}))/({width}))")
        return (f"{ends[0]} + ({ends[1]})*u + ({_rational(draw, -3, 3)})*{feature}",)
    return ends


def _make(kind: str, arguments: tuple[Any, ...]) -> sa.Drift:
    """The drift of a kind with these parameters."""
    if kind == "sine":
        return sa.sine(*arguments[:3], waves=arguments[3])
    if kind == "hill":
        a_minus, a_plus, K, n = arguments
        return sa.hill(a_minus, a_plus, K=K, n=n)
    made: sa.Drift = (sa.Drift if kind == "expression" else getattr(sa, kind))(*arguments)
    return made
