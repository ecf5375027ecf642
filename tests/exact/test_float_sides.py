"""Sides of moderate scenes in float64 against the integrals that define sigma and w."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symasym as sa
from symasym.base.call_context import own_context
from symasym.drift.field.float_field import field_of
from symasym.exact import float_panels, float_sides
from symasym.special.exponentials import log_quotient, mean_place


def _chebyshev(*c: float) -> list[float]:
    """Coefficients in powers of u of a sum of Chebyshev polynomials."""
    powers: list[float] = np.polynomial.chebyshev.cheb2poly(c).tolist()
    return powers


#: Coefficients of A, lam, r, end, and the rule that takes the side.
SIDES = [
    ([-1.0, 0.5, 0.2], 12.0, 2.0, 0.3, "_nested"),
    ([0.3, -2.0, 0.0, 1.5], 20.0, 1.25, 0.0, "_nested"),  # a well and a barrier
    ([1.0, 0.5], 8.0, 1.25, -0.4, "_nested"),
    ([0.0, 0.0, 0.0], 2.0, 3.0, 1.0, "_nested"),
    ([2.0, -0.5, 0.25], 8.0, 10.0, 0.25, "_single"),
    ([2.0, -0.5, 0.25], 80.0, 4.0, 0.75, "_single"),  # of which the end alone counts
    ([1.0, -3.0, 0.5], 12.0, 6.0, 0.9, "_single"),  # a well inside
    ([0.0, 100.0], 5.0, 1.5, 1.0, "_nested"),  # lam V rises by 300 and falls again
    # waves of degree 12, whose last Legendre coefficients say little
    (_chebyshev(1.7, 1.1, -0.1, 0.3, 0.2, 0.3, 0.2, -0.8, -2.1, -0.7, -2, 0.1),
     0.016, 1.05, 0.88, "_nested"),
    (_chebyshev(0, -1, -0.4, 0, 0.5, -0.6, -0.3, -1.8, -1.2, 1.6, -2.2, -0.3, 0.2),
     0.0087, 1.05, 1.0, "_nested"),
]  # fmt: skip


def by_definition(mp: Any, a: list[float], lam: float, r: float, end: float) -> tuple[Any, Any]:
    """log sigma and log w at the end of [-r, end]."""
    at = mp.mpf(-1)
    count = 12 if lam * max(map(abs, a)) < 400 else 40
    ends = [at, *(-1 + (1 + mp.mpf(end)) * j / count for j in range(1, count + 1))]
    rate = lam * sum(c * at**k for k, c in enumerate(a))
    start = -mp.mpf(r)

    def height(u: Any) -> Any:
        """lam V."""
        if u < -1:
            return -rate * (u + 1)
        return -lam * sum(c * (u ** (k + 1) - at ** (k + 1)) / (k + 1) for k, c in enumerate(a))

    def quad(f: Any, over: list[Any]) -> Any:
        return mp.quad(f, over, method="gauss-legendre", maxdegree=4)

    top = max(height(u) for u in [start, *ends])
    known = [
        mp.exp(height(start) - top) * (-mp.expm1(rate * (start + 1)) / rate if rate else r - 1)
    ]
    for u, v in zip(ends, ends[1:], strict=False):
        known.append(known[-1] + quad(lambda x: mp.exp(height(x) - top), [u, v]))

    def scale(u: Any) -> Any:
        """The integral of e^{lam V - top} from -r."""
        if u < -1:
            gone = mp.expm1(-rate * (u - start)) / -rate if rate else u - start
            return mp.exp(height(start) - top) * gone
        j = sum(x <= u for x in ends) - 1
        return known[j] + quad(lambda x: mp.exp(height(x) - top), [ends[j], u])

    pieces = [*mp.linspace(start, at, 24)[:-1], *ends]
    w = lam * quad(lambda u: mp.exp(height(ends[-1]) - height(u)) * scale(u) / known[-1], pieces)
    return mp.log(known[-1]) + top - height(ends[-1]), mp.log(w)


@pytest.mark.parametrize(("a", "lam", "r", "end", "rule"), SIDES)
def test_sides_are_the_integrals(
    a: list[float], lam: float, r: float, end: float, rule: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = []
    for name in ("_nested", "_single"):
        found = getattr(float_sides, name)
        monkeypatch.setattr(
            float_sides, name, lambda s, name=name, found=found: (taken.append(name), found(s))[1]
        )
    monkeypatch.setattr(float_sides, "_FEW", 0)
    one, drift = np.ones(2), sa.polynomial(*a)
    field = field_of(drift, drift.values, 1)
    # A side, and the mirror image of the drift, which is another one.
    index, swept = float_sides.swept(field, lam * one, r * one, np.array([end, -1.0]))
    assert index.tolist() == [0]
    assert taken == [rule]
    with own_context(20) as mp:
        exact = by_definition(mp, a, lam, r, end)
    for number, wanted in zip(swept, exact, strict=True):
        assert abs(number.log[0] - wanted) <= number.error[0] < 4e-13 * max(1, abs(wanted) / 50)


def test_too_few_panels_are_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Panels far too long and rules of too few nodes say what they miss."""
    monkeypatch.setattr(float_sides, "RESOLUTION", np.inf)
    monkeypatch.setattr(float_sides, "_FEW", 0)
    missed = dict.fromkeys(("_nested", "_single"), 0)
    with own_context(20) as mp:
        integrals = [by_definition(mp, *side[:4]) for side in SIDES]
    for factor, enough in ((2, -25.0), (4, -15.0), (8, -8.0)):
        for name in ("REACH", "REACH_DOWN"):
            monkeypatch.setattr(float_sides, name, getattr(float_panels, name) * factor)
        monkeypatch.setattr(float_sides, "_BENT", 3 / 16 / factor**2)
        float_sides._at_cells.cache_clear()
        monkeypatch.setattr(float_sides, "_ENOUGH", enough)
        for (a, lam, r, end, rule), exact in zip(SIDES, integrals, strict=True):
            drift, one = sa.polynomial(*a), np.ones(2)
            field = field_of(drift, drift.values, 1)
            _, swept = float_sides.swept(field, lam * one, r * one, np.array([end, -1.0]))
            for number, wanted in zip(swept, exact, strict=True):
                wrong = abs(number.log[0] - wanted)
                assert wrong <= number.error[0]
                missed[rule] += wrong > 1e-12
    float_sides._at_cells.cache_clear()
    assert all(missed.values()), missed


@pytest.mark.parametrize("lam", [2.0, 60.0])
def test_sides_alone_and_together_are_the_same(lam: float) -> None:
    z0 = np.linspace(-1.0, 0.5, 700)
    drift = sa.friction(mu=2.0, alpha=1.0, z0=z0)
    kappa = np.sqrt(2 / lam)
    together = sa.escape_time(drift, kappa, 2.0, start=0.3, log=True, full=True)
    for j in (0, 350, 699):
        alone = sa.escape_time(drift.bind(z0=z0[[j]]), kappa, 2.0, start=0.3, log=True, full=True)
        assert abs(alone.value[0] - together.value[j]) <= alone.error[0] + together.error[j]


@pytest.mark.parametrize("p", [0.0, 0.5])
def test_a_side_beyond_float64_is_left_to_logarithms(p: float) -> None:
    """Of some, w sigma has no float64, though w and sigma have one each."""
    lam = 14.0
    drift, numbers = sa.Drift("p - 50*u"), (np.sqrt(2 / lam), 1.5)
    many = drift.bind(p=np.linspace(0.0, 1.0, 41))
    found = sa.escape_time(many, *numbers, start=0.9, log=True, full=True)
    exact = sa.escape_time(drift.bind(p=p), *numbers, start=0.9, log=True, dps=25)
    j = int(40 * p)
    assert abs(found.value[j] - exact) <= found.error[j] < 1e-11


def test_quotients_left_of_the_interval() -> None:
    """sigma and w of a constant drift, by their definitions, to a few units of rounding."""
    sizes = [1e-310, 1e-9, 0.03, 0.2, 0.499, 0.5, 0.7, 3.0, 30.0, 800.0]
    x = np.array([sign * size for size in sizes for sign in (1, -1)] + [0.0])
    found = log_quotient(x, 3.0), mean_place(x)
    with own_context(400) as mp:
        for at, log, place in zip(x.tolist(), *found, strict=True):
            rise = mp.expm1(mp.mpf(at))
            wanted = (mp.log(3 * rise / at), 1 / mp.mpf(at) - 1 / rise) if at else (mp.log(3), 0.5)
            assert abs(log - wanted[0]) <= 4e-16 * max(1, abs(wanted[0]))
            assert abs(place - wanted[1]) <= 1e-15 * wanted[1]
