"""The cubic map of two coalescing zeros, against maps that are known in closed form."""

from fractions import Fraction

import mpmath
import pytest

from symasym.asymptotics.coalescence import cubic_map as module
from symasym.asymptotics.coalescence.cubic_map import cubic_map
from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError, InputError
from symasym.series.quadratic_factor import split_pair

NEAR = ["0", "1e-300", "1e-52", "-1e-50", "1e-30", "-1e-30", "-1e-8", "1e-4", "1/100", "-1/100"]
FAR = ["1/20", "-1/20", "1/4", "-1/4"]
BEND = Fraction(1, 5)
COUNT = 4
# More than the drift below has Taylor coefficients.
MANY = 9


def drift(zeta, flip=1):
    """phi whose map is s = u + BEND u^2: (s^2 - zeta) s'(u), a polynomial."""
    a, z = BEND, Fraction(zeta)
    c = [-z, -2 * a * z, 1, 4 * a, 5 * a**2, 2 * a**3]
    return [flip * x for x in c]


def known(zeta, weight=False, count=COUNT):
    """p_k, q_k of u'(s) = (1 + 4 BEND s)^(-1/2) by its series in s; times u + 2 with `weight`."""
    mp = mpmath.mp
    z, a = (mp.mpf(x.numerator) / x.denominator for x in (Fraction(zeta), 4 * BEND))
    series = [mp.mpf(1)]
    for j in range(1, 170):
        series.append(-series[-1] * a * (2 * j - 1) / (2 * j))
    if weight:
        # u = (sqrt(1 + 4 BEND s) - 1)/(2 BEND), so u u' = (1 - (1 + 4 BEND s)^(-1/2))/(2 BEND)
        half = 2 / a
        series = [2 * x - half * x for x in series]
        series[0] += half
    found = []
    for k in range(count):
        rows = [series[parity::2] for parity in (0, 1)]
        found.append(
            tuple(
                mp.fsum(x * mp.binomial(j, k) * z ** (j - k) for j, x in enumerate(row) if j >= k)
                for row in rows
            )
        )
    return found


def worst(found, expected):
    pairs = [
        (x, y) for a, b in zip(found, expected, strict=True) for x, y in zip(a, b, strict=True)
    ]
    return max(abs(mpmath.mpf(x) - y) / abs(y) for x, y in pairs)


@pytest.mark.parametrize("zeta", NEAR + FAR)
@pytest.mark.parametrize("dps", [15, 50])
def test_known_map(zeta, dps):
    with own_context(dps) as context:
        value, found = cubic_map(drift(zeta), MANY, context)
        other, flipped = cubic_map(drift(zeta, -1), MANY, context)
        first = cubic_map(drift(zeta), 2, context)[1]
    with mpmath.workdps(dps + 10):
        exact = mpmath.mpf(Fraction(zeta).numerator) / Fraction(zeta).denominator
        assert abs(mpmath.mpf(value) - exact) <= abs(exact) * mpmath.mpf(10) ** (1 - dps)
        assert worst(found, known(zeta, count=MANY)) <= mpmath.mpf(10) ** (1 - dps)
        assert worst(first, known(zeta, count=2)) <= mpmath.mpf(10) ** (1 - dps)
    # Of -phi the pair is the same and s runs against u.
    assert other == value
    assert flipped == [(-p, q) for p, q in found]


@pytest.mark.parametrize("zeta", ["0", "1e-30", "-1/100", "1/4"])
def test_weight(zeta):
    with own_context(30) as context:
        _, found = cubic_map(drift(zeta), COUNT, context, weight=[2, 1])
    with mpmath.workdps(40):
        assert worst(found, known(zeta, weight=True)) <= mpmath.mpf("1e-29")


@pytest.mark.parametrize("zeta", ["1/100", "-1/50"])
def test_no_step_where_the_way_changes(zeta, monkeypatch):
    """One series about both zeros, and series at each of them, where one takes over."""
    found = []
    with own_context(40) as context:
        pair = split_pair(drift(zeta), context)
        for near in (0, 1):
            monkeypatch.setattr(module, "_NEAR", near)
            found.append(module.map_coefficients(pair, MANY, context, None))
        for first, second in zip(*found, strict=True):
            for x, y in zip(first, second, strict=True):
                assert abs(x - y) <= abs(y) * context.mpf(10) ** -36


def test_truncated_series():
    """sin(u) - 1 + z near its double zero pi/2: Taylor coefficients of the whole function."""
    with own_context(40) as context:
        zs = context.mpf(1) / 100
        cosine = [
            context.mpf((-1) ** (k // 2)) / context.factorial(k) * (k % 2 == 0) for k in range(60)
        ]
        phi = [x - (1 - zs if k == 0 else 0) for k, x in enumerate(cosine)]
        zeta, ((p0, q0),) = cubic_map(phi, 1, context)
        h = context.acos(1 - zs)
        jump = 2 * (context.sin(h) - (1 - zs) * h)
        assert context.almosteq(zeta, (jump * 3 / 4) ** (context.mpf(2) / 3), 1e-38)
        # u'^2 = 2 sqrt(zeta)/|phi'| at both, and s runs against u.
        expected = -context.sqrt(2 * context.sqrt(zeta) / context.sin(h))
        assert context.almosteq(p0, expected, 1e-38)
        assert abs(q0) < 1e-38


def test_refused():
    with own_context(20) as context:
        with pytest.raises(InputError, match="at least three"):
            cubic_map([1, 2], 1, context)
        with pytest.raises(InputError, match=r"taylor\[2\] is 0"):
            cubic_map([1, 2, 0, 1], 1, context)
        with pytest.raises(InputError, match="count is -1"):
            cubic_map([1, 2, 1], -1, context)
        # Three zeros at equal distances: -1, 0, 1.
        with pytest.raises(AccuracyError, match="no pair"):
            cubic_map([0, -1, "1e-30", 1], 1, context)


def test_precision_is_the_callers():
    with own_context(20) as context:
        assert cubic_map(drift("1/100"), 0, context)[1] == []
        cubic_map(drift("1/100"), 3, context)
        assert context.dps == 20


def test_friction_through_its_fold():
    """3 u^3 - 4 u + 1 - z0 about u = 2/3, the fold at z0 = -7/9: few digits and many."""
    gaps = [Fraction(x) for x in ("0", "1e-300", "1e-12", "-1e-12", "1e-4", "-1e-4")]
    gaps += [Fraction(k, 50) - Fraction(1, 1000) for k in range(-60, 39, 7)]
    for gap in gaps:
        found = []
        for dps in (15, 30):
            with own_context(dps) as context:
                zeta, pairs = cubic_map([gap, 0, 6, 3], 3, context)
                found.append([zeta, *(x for pair in pairs for x in pair)])
        few, many = found
        assert all(abs(x - y) <= 4e-15 * abs(y) for x, y in zip(few, many, strict=True))
