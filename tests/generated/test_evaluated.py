"""What the engines evaluate in an arithmetic of their own, against what the derivations emitted.

docs/derivations.md lists these places; everything else imports the emitted code.
"""

from __future__ import annotations

import ast
import random
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from symasym.exact.digit_panels import constant_moments
from symasym.exact.sweep import Deferred, Record

import symasym
from symasym import friction, rescale
from symasym.base.call_context import own_context
from symasym.exact import float_panels, sweep
from symasym.exact.balls import panels as ball_panels
from symasym.generated import mpmath_formulas, numpy_formulas
from symasym.numbers import balls
from symasym.numbers.float_arrays import LogPositive

ROOT = Path(symasym.__file__).parent


def _exact(rng: random.Random, low: str, high: str) -> Fraction:
    a, b = Fraction(low), Fraction(high)
    return a + (b - a) * Fraction(rng.randint(1, 9999), 10_000)


def _moments(ctx, x, up):
    """int_e (= int_inverse) and nested of a constant drift, from the emitted code."""
    with ctx.workprec(ctx.prec + 400):
        first = mpmath_formulas.constant_single(ctx, x)
        name = "constant_nested_up" if up else "constant_nested_down"
        return first, getattr(mpmath_formulas, name)(ctx, x, first)


@pytest.mark.parametrize("direction", [1, -1])
def test_constant_panels_in_float64(direction):
    x = np.concatenate((np.geomspace(1e-12, 1e12, 200), [0.5, np.nextafter(0.5, 0), 1e200]))
    h = np.full(x.shape, 0.75)
    got = float_panels.constant(direction * x / h, h)
    with own_context(40) as ctx:
        for k, value in enumerate(x):
            exact = ctx.mpf(float(direction * value / 0.75)) * ctx.mpf("0.75")
            int_e, nested = _moments(ctx, abs(exact), direction < 0)
            assert float(got.int_e[k]) == pytest.approx(float(0.75 * int_e), rel=2e-15)
            assert got.int_inverse[k] == got.int_e[k]
            assert float(got.nested[k]) == pytest.approx(float(0.5625 * nested), rel=4e-15)


def test_constant_panels_at_any_precision():
    rng = random.Random(1)
    with own_context(50) as ctx:
        for _ in range(60):
            x = _exact(rng, "-3", "3") * Fraction(10) ** rng.randint(-20, 3)
            end, int_e, nested = constant_moments(x, ctx)
            size = ctx.mpf(abs(x).numerator) / abs(x).denominator
            first, second = _moments(ctx, size, x < 0)
            for got, want in ((int_e, first), (nested, second), (end, ctx.exp(-size))):
                assert abs(got - want) <= want * ctx.mpf(10) ** -45


def test_constant_panels_in_balls():
    from symasym.numbers.balls import exact_ball, precision

    rng = random.Random(2)
    with own_context(60) as ctx, precision(150):
        for _ in range(40):
            slope, lam, length = (
                _exact(rng, low, high) for low, high in (("-3", "3"), ("1/9", "9"), ("1/9", "4"))
            )
            outer = ball_panels.Outer(exact_ball(slope), lam, length)
            x = abs(slope * lam * length)
            int_e, nested = _moments(ctx, ctx.mpf(x.numerator) / x.denominator, slope < 0)
            h = ctx.mpf(length.numerator) / length.denominator
            end = ctx.exp(-ctx.mpf(x.numerator) / x.denominator)
            # In balls the integrals are those of e and 1/e as they stand at the left end.
            plus, minus = (
                (h * int_e, h * int_e / end) if slope > 0 else (h * int_e / end, h * int_e)
            )
            double = h * h * (nested / end if slope > 0 else nested)
            for got, want in ((outer.plus, plus), (outer.minus, minus), (outer.nested, double)):
                mid, rad = balls.to_mpf(got, 40)
                assert abs(ctx.convert(mid) - want) <= ctx.convert(rad) + want * ctx.mpf(10) ** -55


def _records(ctx, rng):
    """Panels with given numbers, V falling or rising."""
    found = []
    for _ in range(rng.randint(1, 9)):
        integrals = [ctx.mpf(rng.uniform(0.1, 2)) for _ in range(3)]
        # A float exponent, so that the number is the same in logarithms.
        rise = rng.uniform(-4, 4)
        end = ctx.exp(-abs(ctx.mpf(rise)))
        found.append((rise, Record(*integrals, *((1, end) if rise > 0 else (end, 1)))))
    return found


def _unscaled(ctx, records, lam):
    """sigma and w from S and Y = w S, which are sums of what each panel adds."""
    S = Y = ctx.zero
    for _, p in records:
        growth = p.fall / p.climb
        Y += lam * (S * p.int_inverse + p.nested) / p.fall
        S = (S + p.int_e / p.climb) / growth
    return S, Y / S


@pytest.mark.parametrize("deferred", [False, True])
def test_steps_between_panels_at_any_precision(deferred):
    rng = random.Random(3)
    with own_context(60) as ctx:
        tiny = ctx.ldexp(1, -ctx.prec - 8)

        def put_off(x):
            return Deferred(lambda: x, lambda: 3 * x, tiny) if deferred else x

        for _ in range(30):
            chain, lam = _records(ctx, rng), ctx.mpf(3)
            records = [Record(*map(put_off, p[:3]), *p[3:]) for _, p in chain]
            sigma, w = sweep.absorbed(records, lam)
            S, work = _unscaled(ctx, chain, lam)
            assert abs(sigma - S) <= S * ctx.mpf(10) ** -55
            assert abs(sweep.known(w + 0) - work) <= work * ctx.mpf(10) ** -55


def test_steps_between_panels_in_the_log_domain():
    rng = random.Random(4)
    with own_context(40) as ctx:
        for _ in range(30):
            chain, lam = _records(ctx, rng), LogPositive.of(np.array([3.0]))
            records = []
            for rise, p in chain:
                numbers = [LogPositive.of(np.array([float(x)]), np.array([5e-16])) for x in p[:3]]
                ends = (min(rise, 0.0), min(-rise, 0.0))
                zero = np.zeros(1)
                records.append(Record(*numbers, *(LogPositive(np.array([x]), zero) for x in ends)))
            found = sweep.absorbed(records, lam)
            for got, want in zip(found, _unscaled(ctx, chain, ctx.mpf(3)), strict=True):
                assert float(got.log[0]) == pytest.approx(float(ctx.log(want)), abs=2e-14)
                # The running error analysis covers what the step really loses.
                assert abs(got.log[0] - float(ctx.log(want))) <= got.error[0]


def test_logarithms_of_shares_in_balls():
    import flint

    rng = random.Random(5)
    with own_context(30) as ctx:
        for _ in range(20):
            left, right = (rng.uniform(1e-3, 5) for _ in range(2))
            want = mpmath_formulas.log_exit_share(ctx, ctx.mpf(left), ctx.mpf(right))
            got = -(flint.arb(left) / flint.arb(right)).log1p()
            assert float(got) == pytest.approx(float(want), rel=1e-13)
            assert want == mpmath_formulas.log_occupation_share(ctx, ctx.mpf(right), ctx.mpf(left))


def test_noise_is_exact_where_the_root_is():
    rng = random.Random(6)
    with own_context(70) as ctx:
        for _ in range(20):
            root, kappa = _exact(rng, "0", "2"), _exact(rng, "0", "3")
            scaled = rescale(eps=root**2, kappa=kappa).kappa
            assert isinstance(scaled, Fraction)
            eps, noise = (ctx.mpf(x.numerator) / x.denominator for x in (root**2, kappa))
            want = mpmath_formulas.scaled_noise(ctx, noise, eps)
            got = ctx.mpf(scaled.numerator) / scaled.denominator
            assert abs(got - want) <= want * ctx.mpf(10) ** -65


def test_friction_in_exact_arithmetic():
    """The polynomial that every engine evaluates, against the drift as it is written."""
    rng = random.Random(7)
    for _ in range(20):
        mu, alpha, z0, u = (
            _exact(rng, low, high)
            for low, high in (("0", "4"), ("0", "3"), ("-3", "3"), ("-1", "1"))
        )
        drift = friction(mu=mu, alpha=alpha, z0=z0)
        c = drift.exact_coefficients()
        value = sum(x * u**k for k, x in enumerate(c))
        # Polynomials alone: the emitted NumPy code takes fractions as well.
        assert value == numpy_formulas.friction_inside(u, mu, alpha, z0)
        assert drift.ends == (
            numpy_formulas.friction_left(alpha, z0),
            numpy_formulas.friction_right(alpha, z0),
        )
        # The integral of the polynomial is the emitted potential.
        powers = sum(x * (u ** (k + 1) - (-1) ** (k + 1)) / (k + 1) for k, x in enumerate(c))
        alone = mpmath.mp.clone()
        alone.dps = 40
        at = [alone.mpf(x.numerator) / x.denominator for x in (u, mu, alpha, z0, powers)]
        gap = mpmath_formulas.friction_potential_inside(alone, *at[:4]) + at[4]
        assert abs(gap) < alone.mpf(10) ** -35


def test_formulas_that_were_emitted_are_written_nowhere_else():
    """What holds the paper's results imports them, and has no square root of its own."""
    for name in ("paper", "drift/ready_made/friction", "drift/models", "base/scales"):
        text = (ROOT / f"{name}.py").read_text(encoding="utf-8")
        tree = ast.parse(text)
        assert any(
            isinstance(node, ast.ImportFrom) and (node.module or "").startswith("symasym.generated")
            for node in tree.body
        ), name
        calls = {
            node.func.attr
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        }
        assert "sqrt" not in calls, name
