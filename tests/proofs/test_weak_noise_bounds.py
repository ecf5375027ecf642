"""Proved bounds of the weak-noise escape time: never violated, tight, and refused elsewhere."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.proofs import cells as weak_noise_cells
from symasym.asymptotics.proofs import enclosures
from symasym.asymptotics.weak_noise import answer, compose
from symasym.numbers.balls import exact_ball, precision
from symasym.workshop import reference_quadrature
from tests.problems import distance
from tests.strategies import ALL, SAMPLE, powers_of_ten, rationals

FRICTION = sa.friction(3, 1, "-0.3")
Scene = tuple[sa.Drift, Fraction, Fraction, Fraction]


@st.composite
def polynomial_scenes(draw: st.DrawFn, weakest: float) -> Scene:
    """Half of them with the default start and a radius beyond the layer."""
    if draw(st.booleans()):
        drift = sa.polynomial(*draw(st.lists(rationals(-3, 3), min_size=1, max_size=7)))
    else:
        drift = sa.friction(
            mu=draw(rationals(0, 8)), alpha=draw(rationals(0.1, 4)), z0=draw(rationals(-4, 6))
        )
    r = draw(powers_of_ten(-0.5, 2))
    start = draw(st.sampled_from([Fraction(0), r * draw(rationals(-0.99, 0.99))]))
    return drift, draw(powers_of_ten(weakest, 0.3)), r, start


def exact_time(scene: Scene, log: bool = False) -> Any:
    drift, kappa, r, start = scene
    return sa.escape_time(drift, kappa, r, start=start, dps=60, log=log)


def check(scene: Scene, order: int) -> tuple[str, float] | None:
    """Enclosure, value and logarithm against the exact ones; kind, and claimed over true error."""
    drift, kappa, r, start = scene
    try:
        exact = exact_time(scene)
    except sa.SymasymError:
        return None
    bounds = enclosures.enclosure(drift, kappa, r, start, order, 20)
    if bounds is not None:
        with precision(300):
            number = exact_ball(_rational(exact))
            # `exact` has 60 digits.
            assert bounds.low * (1 - _tiny()) <= number <= bounds.high * (1 + _tiny())
    try:
        found = sa.escape_time(
            drift, kappa, r, start=start, method="laplace", order=order, dps=40, full=True
        )
        logarithm = sa.escape_time(
            drift, kappa, r, start=start, method="laplace", order=order, log=True, dps=40, full=True
        )
    except sa.SymasymError:
        return None
    wrong = distance(found.value, exact)
    assert found.error_kind in ("bound", "estimate")
    if found.error_kind == "bound":
        assert wrong <= found.error
        assert distance(logarithm.value, exact_time(scene, log=True)) <= logarithm.error
    return found.error_kind, float(found.error / wrong) if wrong else 1.0


def _rational(x: Any) -> Fraction:
    sign, mantissa, exponent, _ = x._mpf_
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent) * (-1 if sign else 1)


def _tiny() -> Any:
    return exact_ball(Fraction(1, 10**58))


@settings(SAMPLE, max_examples=30)
@given(polynomial_scenes(weakest=-2), st.integers(0, 4))
def test_random_scenes_sample(scene: Scene, order: int) -> None:
    check(scene, order)


@pytest.mark.slow
@ALL
@given(polynomial_scenes(weakest=-2.5), st.integers(0, 8))
def test_random_scenes(scene: Scene, order: int) -> None:
    check(scene, order)


WELLS: list[tuple[sa.Drift, str, str, str]] = [
    (FRICTION, "0.1", "10", "0"),
    (FRICTION, "0.02", "10", "0.5"),
    (FRICTION, "0.05", "10", "-5"),  # outside the layer
    (sa.linear(1, -1), "0.2", "4", "0"),  # two ends, one well
    (sa.polynomial(0, -1, "1/2", "-1/3"), "0.1", "9/10", "1/10"),  # ends inside the layer
    (sa.polynomial(0, 1, 0, -3), "0.05", "3", "0"),  # started at a barrier between two wells
    (sa.polynomial("1/5", 2, 0, -3), "0.1", "3", "1/7"),
    (sa.polynomial("1/10", 2, 0, -3), "0.1", "3", "-1/20"),  # just beside the barrier
]


@pytest.mark.every(3)
@pytest.mark.parametrize("order", [0, 2, 4])
@pytest.mark.parametrize("scene", WELLS, ids=repr)
def test_wells_have_a_tight_bound(scene: Any, order: int) -> None:
    drift, *numbers = scene
    found = check((drift, *(Fraction(x) for x in numbers)), order)
    assert found is not None
    kind, ratio = found
    assert kind == "bound"
    assert 1 <= ratio < 1.1


def test_order_by_order() -> None:
    # The bound is of the order of the first term left out, and so is the error.
    for order in (0, 1, 2, 3):
        errors = [
            sa.escape_time(
                FRICTION, k, 10, method="laplace", order=order, log=True, dps=60, full=True
            )
            for k in ("1/100", "1/200")
        ]
        assert [e.error_kind for e in errors] == ["bound", "bound"]
        power = mpmath.log(errors[0].error / errors[1].error, 2)
        assert abs(power - (2 * order + 2)) < 0.2


def test_very_weak_noise_costs_nothing() -> None:
    found = sa.escape_time(FRICTION, "1e-8", 10, method="laplace", log=True, dps=60, full=True)
    assert found.error_kind == "bound"
    assert found.error < 1e-38


def test_floats_have_the_bound() -> None:
    found = sa.escape_time(FRICTION, 0.05, 10, method="laplace", full=True)
    exact = sa.escape_time(FRICTION, 0.05, 10, dps=40)
    assert found.error_kind == "bound"
    assert distance(found.value, exact) <= found.error <= 2 * distance(found.value, exact)


@pytest.mark.parametrize(
    ("drift", "start"),
    [
        (sa.linear(2, 1), 0),  # nothing dominates: T = O(1)
        (sa.tanh(2, -1, 3), 0),  # no polynomial
    ],
    ids=str,
)
def test_an_estimate_elsewhere(drift: sa.Drift, start: Any) -> None:
    found = sa.escape_time(drift, "0.1", 4, start=start, method="laplace", full=True, dps=20)
    assert found.error_kind == "estimate"


def test_only_where_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(enclosures, "enclosure", refuse)
    monkeypatch.setattr(enclosures, "enclosure_outside", refuse)
    assert sa.escape_time(FRICTION, 0.1, 10, method="laplace") > 0
    assert sa.occupation(sa.linear(1, -1), 0.1, method="laplace") > 0


# -- where no estimate is sure ---------------------------------------------------------------------


# kappa, r, start and order at which the next terms are too large to tell the error.
REFUSED: list[tuple[sa.Drift, str, str, str, int]] = [
    (sa.polynomial("2.093", "-1.036", "-2.136"), "0.612", "3.2", "0", 0),
    (sa.friction("4.6", "0.34", "-0.809"), "0.964", "6.3", "-1.6", 3),
    (sa.polynomial("-1.19", "1.96", "2.27", "-0.83", "0.58"), "0.15", "7.2", "0", 4),
]


@pytest.mark.parametrize("scene", REFUSED, ids=repr)
def test_the_bound_is_tried_before_refusing(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    drift, kappa, r, start, order = scene
    options = {"start": start, "method": "laplace", "order": order, "dps": 30}
    found = sa.escape_time(drift, kappa, r, full=True, **options)
    wrong = distance(found.value, exact_time((drift, kappa, r, start)))
    assert found.error_kind == "bound"
    assert wrong <= found.error < found.value / 2
    assert sa.escape_time(drift, kappa, r, **options) == found.value
    monkeypatch.setattr(enclosures, "enclosure", lambda *_: None)
    with pytest.raises(sa.AccuracyError, match="next terms"):
        sa.escape_time(drift, kappa, r, **options)


@pytest.mark.parametrize(("high", "answered"), [("1.4", True), ("1.6", False)])
def test_a_bound_beyond_half_of_the_value_does_not_save_it(high: str, answered: bool) -> None:
    from flint import arb

    def prove(order: int) -> enclosures.Bounds:
        return enclosures.Bounds(arb("0.9").lower(), arb(high).upper())

    given = [compose.AtOrder(mpmath.mpf(1), mpmath.mpf(5), 2, False)]
    found = answer.chosen(given, prove, False, mpmath.mp)
    assert (found is not None) == answered
    if found is not None:
        assert found[1] == "bound"
        assert 0.4 <= found[0].error < 0.4001


def test_a_good_estimate_says_more_than_a_wide_bound() -> None:
    from flint import arb

    bounds = enclosures.Bounds(arb("0.9").lower(), arb("1.1").upper())
    for estimate, kind in (("1e-6", "estimate"), ("0.01", "bound")):
        given = [compose.AtOrder(mpmath.mpf(1), mpmath.mpf(estimate), 2, True)]
        found = answer.chosen(given, lambda _: bounds, True, mpmath.mp)
        assert found is not None
        assert found[1] == kind


# -- 1 - P and P -----------------------------------------------------------------------------------


@st.composite
def sliding(draw: st.DrawFn) -> sa.Drift:
    """A line from a- > 0 to a+ < 0, and (1 - u^2) times anything."""
    first, last = draw(rationals(0.05, 3)), -draw(rationals(0.05, 3))
    free = draw(st.lists(rationals(-4, 4), min_size=0, max_size=4))
    c = [(first + last) / 2, (last - first) / 2, *[Fraction(0)] * len(free)]
    for k, value in enumerate(free):
        c[k] += value
        c[k + 2] -= value
    return sa.polynomial(*c)


def check_share(drift: sa.Drift, kappa: Fraction, order: int) -> tuple[str, float] | None:
    """Both shares and logarithms against the exact ones; kind, and claimed over true error."""
    result = None
    for complement in (False, True):
        for log in (False, True):
            options: Any = {"complement": complement, "log": log}
            exact = sa.occupation(drift, kappa, dps=60, **options)
            try:
                found = sa.occupation(
                    drift, kappa, method="laplace", order=order, dps=40, full=True, **options
                )
            except sa.SymasymError:
                continue
            wrong = distance(found.value, exact)
            if found.error_kind == "bound":
                # `exact` has 60 digits.
                assert wrong <= found.error + abs(exact) * mpmath.mpf(10) ** -59
            result = found.error_kind, float(found.error / wrong) if wrong else 1.0
            if log and complement:
                return result
    return result


@settings(SAMPLE, max_examples=6)
@given(sliding(), powers_of_ten(-2, 0.3), st.integers(0, 4))
def test_random_shares_sample(drift: sa.Drift, kappa: Fraction, order: int) -> None:
    check_share(drift, kappa, order)


@pytest.mark.slow
@ALL
@given(sliding(), powers_of_ten(-2.5, 0.5), st.integers(0, 8))
def test_random_shares(drift: sa.Drift, kappa: Fraction, order: int) -> None:
    check_share(drift, kappa, order)


SLIDING = [
    (sa.linear(1, -1), "0.2"),
    (sa.polynomial("1/5", -2, 0, "1/2"), "0.1"),
    (sa.polynomial("1/20", 2, 0, -3), "0.1"),  # two wells
    (sa.polynomial(0, 2, 0, -3), "0.1"),  # two equal wells
]


@pytest.mark.parametrize("which", range(len(SLIDING)))
def test_shares_have_a_tight_bound(which: int) -> None:
    drift, kappa = SLIDING[which]
    found = check_share(drift, Fraction(kappa), (0, 3)[which % 2])
    assert found is not None
    kind, ratio = found
    assert kind == "bound"
    assert 1 <= ratio < 1.1


def test_a_share_against_plain_quadrature() -> None:
    drift, kappa = sa.polynomial("1/20", 2, 0, -3), Fraction(1, 5)
    found = sa.occupation(
        drift, kappa, complement=True, method="laplace", order=1, dps=30, full=True
    )
    assert found.error_kind == "bound"
    exact = reference_quadrature.occupation(drift, kappa, 20, complement=True)
    assert found.error / 2 < distance(found.value, exact) <= found.error


def test_a_share_of_no_polynomial_has_an_estimate() -> None:
    found = sa.occupation(sa.tanh(1, -1, 2), 0.1, complement=True, method="laplace", full=True)
    assert found.error_kind == "estimate"


def test_a_tiny_share_has_its_own_precision() -> None:
    found = sa.occupation(
        sa.polynomial("1/20", 2, 0, -3), "1e-4", complement=True, method="laplace", dps=40,
        log=True, full=True,
    )  # fmt: skip
    assert found.value < -1e6
    assert found.error_kind == "bound"
    assert found.error < 2e-24


@pytest.mark.parametrize("lam", [50, 2000])
def test_the_integrals_over_a_cell(lam: int) -> None:
    # Gauss-Legendre, also on the triangles, against the bounds of each cell inside the layer.
    x, w = np.polynomial.legendre.leggauss(80)
    x, w = (x + 1) / 2, w / 2
    coefficients = FRICTION.exact_coefficients()
    assert coefficients is not None
    V = -np.polynomial.Polynomial([float(c) for c in coefficients]).integ()
    V = V - V(-1)
    found = weak_noise_cells.landscape(tuple(coefficients), FRICTION, Fraction(10), Fraction(0), 1)
    assert found is not None
    cells = [c for c in found.cells if c.slope is None]
    kinds = set()
    for cell in cells[::7]:
        a, width = float(cell.start), float(cell.stop - cell.start)
        shares = enclosures._shares(cell, Fraction(lam))
        u = a + width * x
        top = float(V(a))
        up, down = np.exp(lam * (V(u) - top)), np.exp(-lam * (V(u) - top))
        # Below the diagonal v = a + x (u - a), above it its mirror image.
        v = a + (u[:, None] - a) * x
        low = (u - a) * np.sum(w * np.exp(lam * (V(v) - V(u)[:, None])), axis=1)
        high = (u - a) * np.sum(w * np.exp(-lam * (V(v) - V(u)[:, None])), axis=1)
        scale = exact_ball(Fraction(lam)) * exact_ball(Fraction(top))
        values = (
            (np.sum(w * up) * width, shares.scale, scale.exp()),
            (np.sum(w * down) * width, shares.speed, (-scale).exp()),
            (np.sum(w * low) * width, shares.before, 1),
            (np.sum(w * high) * width, shares.after, 1),
        )
        for value, bounds, factor in values:
            assert float(bounds.low / factor) <= value * (1 + 1e-8)
            assert value * (1 - 1e-8) <= float(bounds.high / factor)
        kinds.add(weak_noise_cells.steepness(cell)[0])
    assert kinds >= {-1, 1}


def test_a_share_lies_between_its_bounds() -> None:
    from flint import arb

    from symasym.asymptotics.proofs.enclosures import Bounds, _three

    found = _three(*(Bounds(arb(low), arb(high)) for low, high in ((1, 3), (2, 9), (5, 6))))
    for a in (1, 2, 3):
        for m in (2, 4, 9):
            for b in (5, 6):
                assert found.low <= arb(a) * b / (a + m + b) <= found.high


def test_two_zeros_closer_than_doubles_tell() -> None:
    """No polygon is seen about either; the call answers or refuses as without the proof."""
    for coefficients in (("1/9", "2/3", "0.9999999999999999999"), ("-1e-20", 0, 1)):
        drift = sa.polynomial(*coefficients)
        for start in (0, "1/2"):
            with pytest.raises(sa.AccuracyError):
                sa.escape_time(drift, "0.1", 2, start=start, method="laplace", dps=15, full=True)
            with pytest.raises(sa.AccuracyError):
                sa.weak_noise_bound(drift, 2, start=start, kappa0="0.1")
