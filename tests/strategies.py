"""Random scenes for hypothesis: drifts of every kind, noise and radius over many decades."""

from __future__ import annotations

import random
from collections.abc import Sequence
from fractions import Fraction

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.drift.texts import FUNCTIONS

SAMPLE = settings(
    max_examples=24,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
ALL = settings(SAMPLE, max_examples=10_000)


def rationals(low: float, high: float) -> st.SearchStrategy[Fraction]:
    return st.integers(int(low * 1000), int(high * 1000)).map(lambda k: Fraction(k, 1000))


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[Fraction]:
    # six digits, so that the scene is a short rational and still anywhere
    return st.floats(low, high).map(lambda x: Fraction(f"{10**x:.5e}"))


@st.composite
def drifts(draw: st.DrawFn) -> sa.Drift:
    kind = draw(st.sampled_from(["friction", "polynomial", "linear", "sine", "tanh", "hill"]))
    ends = draw(rationals(-3, 3)), draw(rationals(-3, 3))
    if kind == "friction":
        return sa.friction(
            mu=draw(rationals(0, 8)), alpha=draw(rationals(0.1, 4)), z0=draw(rationals(-4, 6))
        )
    if kind == "polynomial":
        return sa.polynomial(*draw(st.lists(rationals(-3, 3), min_size=1, max_size=7)))
    if kind == "linear":
        return sa.linear(*ends)
    if kind == "sine":
        return sa.sine(*ends, draw(rationals(-4, 4)), waves=draw(st.integers(1, 4)))
    if kind == "tanh":
        return sa.tanh(*ends, draw(rationals(0.1, 20)))
    return sa.hill(*ends, K=draw(rationals(0.1, 2)), n=draw(st.integers(1, 8)))


SHAPES = [
    "exp(-x**2)", "tanh(x)", "1/(1 + x**2)", "x/(1 + x**2)", "x*exp(-x**2)", "erf(x)", "atan(x)",
    "sin(x)", "x/sqrt(1 + x**2)",
]  # fmt: skip


@st.composite
def narrow(draw: st.DrawFn) -> sa.Drift:
    """A line with one or two features of any width."""
    terms = [str(draw(rationals(-2, 2))), f"({draw(rationals(-2, 2))})*u"]
    for _ in range(draw(st.integers(1, 2))):
        width = draw(powers_of_ten(-6, 0.5))
        shape = draw(st.sampled_from(SHAPES))
        if shape == "sin(x)":
            width = max(width, Fraction(1, 200))
        place, height = draw(rationals(-1.1, 1.1)), draw(rationals(-3, 3))
        terms.append(f"({height})*" + shape.replace("x**2", "x^2").replace("exp", "E!"))
        terms[-1] = terms[-1].replace("x", f"((u - ({place}))/({width}))")
        terms[-1] = terms[-1].replace("E!", "exp").replace("^", "**")
    return sa.Drift(" + ".join(terms))


@st.composite
def scenes(
    draw: st.DrawFn,
    weakest: float,
    of: st.SearchStrategy[sa.Drift] = drifts(),  # noqa: B008
) -> tuple[sa.Drift, Fraction, Fraction, Fraction]:
    r = draw(powers_of_ten(-0.5, 4))
    start = r * draw(rationals(-0.99, 0.99))
    return draw(of), draw(powers_of_ten(weakest, 4)), r, draw(st.sampled_from([0 * r, start]))


def random_formula(draw: random.Random, depth: int, names: Sequence[str] = ("u", "a")) -> str:
    """A text that is mostly a formula, with numbers of any size."""
    if depth == 0 or draw.random() < 0.2:
        numbers = ["2", "1/3", "10", "1e30", "1e-9", "123456789", "pi", "0.5"]
        return draw.choice([*names, *numbers])
    parts = [random_formula(draw, depth - 1, names) for _ in range(2)]
    kind = draw.randrange(6)
    if kind == 5:
        return f"{draw.choice(list(FUNCTIONS))}({parts[0]})"
    return f"({parts[0]}){draw.choice(['+', '-', '*', '/', '**'])}({parts[1]})"
