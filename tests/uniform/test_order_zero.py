"""Order 0 of the uniform formula by closed forms: the general path, mpmath and the exact T."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.asymptotics.uniform import answer as uniform_noise
from symasym.asymptotics.uniform.order_zero import OrderZero, closed_form
from symasym.asymptotics.uniform.structure import _real_zeros
from symasym.base.call_context import own_context
from symasym.numbers.arithmetic import Digits
from symasym.special.airy import airy_products
from symasym.special.dawson import dawson
from tests.problems import relative
from tests.uniform.test_uniform_arrays import where_claimed

FOLD = Fraction(-7, 9)


@pytest.mark.parametrize("dps", [20, 60])
def test_airy_products_against_mpmath(dps: int) -> None:
    # The power series and both asymptotic ones, and beside where they take over.
    with own_context(dps) as c, mpmath.workdps(2 * dps + 20):
        for z in (
            0,
            "1e-30",
            "-0.3",
            5,
            "-7.1",
            "-9.9",
            "11.5",
            12,
            "-12.5",
            "-20.5",
            22,
            "-90",
            80,
        ):
            x = mpmath.mpf(z)
            found = airy_products(c.convert(x), Digits(c))
            fall = mpmath.exp(-2 * x**1.5 / 3) if x > 0 else mpmath.mpf(1)
            ai, bi = fall * mpmath.airyai(x), fall * mpmath.airybi(x)
            ai1, bi1 = (fall * f(x, derivative=1) for f in (mpmath.airyai, mpmath.airybi))
            squares, slopes = ai**2 + bi**2, ai1**2 + bi1**2
            least = mpmath.mpf(10) ** -(dps - 3)
            assert abs(found.squares - squares) <= least * squares
            assert abs(found.slopes - slopes) <= least * slopes
            assert abs(found.cross - (ai * ai1 + bi * bi1)) <= least * mpmath.sqrt(squares * slopes)
            assert abs(found.bi - bi) <= least * mpmath.sqrt(squares)
            assert abs(found.bi_slope - bi1) <= least * mpmath.sqrt(slopes)


@pytest.mark.parametrize("dps", [20, 60])
def test_dawson_against_mpmath(dps: int) -> None:
    with own_context(dps) as c, mpmath.workdps(4 * dps + 20):
        for y in ("1e-30", "0.2", 1, 3, 7, "7.9", 9, 12, "12.6", 13, 20):
            x = mpmath.mpf(y)
            found = dawson(c.convert(x), Digits(c))
            least = mpmath.mpf(10) ** -(dps - 3)
            shade = mpmath.exp(x * x) * mpmath.erfc(x)
            value = mpmath.sqrt(mpmath.pi) / 2 * mpmath.exp(-x * x) * mpmath.erfi(x)
            area = x * x * mpmath.hyp2f2(1, 1, mpmath.mpf(3) / 2, 2, -x * x)
            assert abs(found.erfcx - shade) <= least * shade
            assert abs(found.value - value) <= least * value
            assert abs(found.area - area) <= least * area


SCENES: list[tuple[sa.Drift, Any, Any, Any]] = [
    *((sa.friction(3, 1, z), "0.05", 10, 0) for z in (-2, "-0.78", "-0.77", "-0.2", "-1e-6")),
    *((sa.friction(3, 1, FOLD + Fraction(x)), "0.1", 10, 0) for x in ("0", "1e-30", "-1e-9")),
    (sa.friction(1, 1, "-0.3"), "0.05", 10, "-0.3"),
    (sa.friction(3, 1, "-0.75"), "0.05", "0.97", 0),
    (sa.friction(8, 2, "-0.77"), "0.05", 30, 3),
    (sa.friction(8, 2, "-0.77"), "0.05", 30, -3),
    (sa.friction(8, 1, "0.3"), "0.1", 5, 0),
    (sa.polynomial("-1.7", -4, 0, 3), "0.08", 10, 0),
    (sa.polynomial("2", "-0.3"), "0.2", 4, "0.2"),
    (sa.polynomial("1.5"), "0.2", 4, "0.2"),
]


@pytest.mark.parametrize(("drift", "kappa", "r", "start"), SCENES)
def test_closed_forms_are_the_general_path(
    drift: sa.Drift,
    kappa: Any,
    r: Any,
    start: Any,
    as_in_float: None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All digits; the general path takes circles, and series of singular terms."""
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "dps": 30}
    found = sa.escape_time(drift, kappa, r, full=True, **options)
    exact = sa.escape_time(drift, kappa, r, dps=20, start=start)
    with monkeypatch.context() as patch:
        patch.setattr(uniform_noise, "closed_form", lambda *_: None)
        general = sa.escape_time(drift, kappa, r, full=True, **options)
    with mpmath.workdps(40):
        assert abs(found.value / general.value - 1) <= 1e-28
    assert abs(found.value - exact) <= found.error + 1e-20 * exact < 0.1 * exact


def test_what_float64_does_not_tell_goes_the_general_way() -> None:
    with own_context(40) as context:
        zero, one = Fraction(0), Fraction(4)
        # The start a well, three zeros in one place, A = 0 at the end, no polynomial.
        for c in ((0, -1), (0, 0, 0, 1), (-1, 1)):
            assert closed_form(sa.polynomial(*c), one, zero, context) is None
        assert closed_form(sa.Drift("exp(u) - 1/3"), one, zero, context) is None


def check_random(seed: int, count: int) -> int:
    """No claim below the true error, and the numbers of arrays; returns how many were made."""
    rng = np.random.default_rng(seed)
    degree, beside = int(rng.integers(1, 6)), rng.random() < 0.5
    c = np.round(rng.uniform(-3, 3, (degree + 1, count)), 3)
    if beside and degree > 1:
        u = rng.uniform(-0.9, 0.9, count)
        c[1] -= sum(k * c[k] * u ** (k - 1) for k in range(1, degree + 1))
        c[0] -= sum(c[k] * u**k for k in range(degree + 1))
        c[0] += rng.choice([-1, 1], count) * 10 ** rng.uniform(-17, -0.5, count)
    kappa, r = 10 ** rng.uniform(-2, -0.3, count), float(10 ** rng.uniform(-0.2, 2))
    start = float(rng.choice([0.0, rng.uniform(-0.9, 0.9) * r, r > 1 and rng.choice([-1, 1])]))
    exact = sa.escape_time(sa.polynomial(*c), kappa, r, start=start, log=True, full=True)
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "log": True}
    arrays, errors = where_claimed(sa.polynomial(*c), kappa, r, options)
    claimed = 0
    with own_context(60) as context:
        for k in range(count):
            drift = sa.polynomial(*c[:, k].tolist())
            scene = closed_form(drift, Fraction(r), Fraction(start), context)
            number = context.mpf(float(kappa[k]))
            found = scene and scene.time(2 / number**2)
            if found:
                claimed += 1
                error = -context.log1p(-found[1] / found[0])
                log = context.log(found[0])
                off = abs(log - float(exact.value[k]))
                assert off <= error + float(exact.error[k]) + 1e-15, (drift, kappa[k], r, start)
                if errors[k] < np.inf:
                    # On a fold float64 may take another barrier for the last one.
                    step = 1e-4 * float(errors[k])
                    assert abs(log - float(arrays[k])) <= 1e-11 * max(1, abs(log)) + step
    return claimed


def test_random_drifts_sample() -> None:
    assert sum(check_random(seed, 25) for seed in range(12)) >= 140


def test_no_claim_where_a_share_is_negative(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors once cancelled each other there."""
    monkeypatch.setattr(OrderZero, "beside_a_barrier", lambda self: False)
    c = (-0.00107706, -0.0407653, -0.49701, -1.72995, 2.706724)
    with own_context(40) as context:
        scene = closed_form(sa.polynomial(*c), Fraction(34), Fraction(0), context)
        assert scene is not None
        assert scene.time(2 / context.mpf("0.302") ** 2) is None


def test_start_at_a_kink() -> None:
    for start in (1, -1):
        drift, options = sa.friction(3, 1, "-0.7"), {"start": start, "dps": 20}
        found = sa.escape_time(drift, "0.05", 10, method="uniform", order=0, full=True, **options)
        exact = sa.escape_time(drift, "0.05", 10, **options)
        assert abs(found.value - exact) <= found.error < 1e-3 * exact


@pytest.mark.slow
def test_random_drifts() -> None:
    for seed in range(100, 400):
        check_random(seed, 50)


def test_digits_agree() -> None:
    """Fewer digits are those of more."""
    drift = sa.friction(3, 1, FOLD + Fraction(1, 10**40))
    options: dict[str, Any] = {"method": "uniform", "order": 0}
    many = sa.escape_time(drift, "0.07", 10, dps=200, **options)
    assert relative(sa.escape_time(drift, "0.07", 10, dps=40, **options), many) <= 1e-40
    alone = sa.escape_time(drift, "0.07", 10, **options)
    assert relative(alone, many) <= 3e-16


@pytest.mark.parametrize("gap", [0.5, 1e-3, 1e-6])
def test_real_zeros_of_one_polynomial(gap: float) -> None:
    """Simple zeros, two of them close, beside complex ones: known as they were put in."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        first = np.sort(rng.uniform(-2, 2, 3) + [-4, 0, 4])
        zeros = np.sort([*first, first[1] + gap])
        c = np.polynomial.polynomial.polyfromroots(zeros)
        if rng.integers(2):
            c = np.convolve(c, [1 + rng.uniform(0, 3), 0, 1])
        c *= 10.0 ** rng.integers(-8, 9)
        found = [0.0] * 13
        count = _real_zeros([*c.tolist(), *[0.0] * (13 - len(c))], len(c), found)
        assert count == len(zeros)
        assert np.abs(np.array(found[:count]) - zeros).max() < 1e-11 / gap
