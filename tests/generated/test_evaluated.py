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
from flint import arb, fmpq

import symasym
from symasym import friction, rescale
from symasym.base.call_context import own_context
from symasym.drift.evaluate import Piece, Polynomial, rational
from symasym.exact import balls as ball_panels
from symasym.exact import floats as float_panels
from symasym.generated import formulas, mpmath_formulas, numpy_formulas
from symasym.numbers import balls
from symasym.numbers.balls import exact_ball, precision

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


def _of_constant(slope, lam, width):
    """The record in balls of a constant drift."""
    whole = [Piece(fmpq(0), width, Polynomial([slope]))]
    (panel,) = ball_panels.panels(whole, lam, fmpq(0), width, 40)
    (record,) = ball_panels.records([panel], lam, ball_panels.ABSORBING, 40, 1)
    return record


@pytest.mark.parametrize("direction", [1, -1])
def test_constant_panels_in_float64(direction):
    x = np.concatenate((np.geomspace(1e-12, 1e12, 200), [0.5, np.nextafter(0.5, 0)]))
    h = np.full(x.shape, 0.75)
    fall, climb, int_e, int_inverse, nested = float_panels.constant(direction * x / h, h, 0 * x).log
    with own_context(40) as ctx:
        for k, value in enumerate(x):
            exact = ctx.mpf(float(direction * value / 0.75)) * ctx.mpf("0.75")
            single, double = _moments(ctx, abs(exact), direction < 0)
            assert int_e[k] == pytest.approx(float(ctx.log(0.75 * single)), abs=2e-14)
            assert int_inverse[k] == int_e[k]
            assert nested[k] == pytest.approx(float(ctx.log(0.5625 * double)), abs=2e-14)
            assert climb[k] - fall[k] == pytest.approx(float(exact), rel=1e-15)


def test_constant_panels_in_balls():
    rng = random.Random(2)
    with own_context(60) as ctx, precision(300):
        for _ in range(40):
            slope, lam, length = (
                _exact(rng, low, high) for low, high in (("-3", "3"), ("1/9", "9"), ("1/9", "4"))
            )
            found = _of_constant(rational(slope), exact_ball(lam), rational(length))
            x = abs(slope * lam * length)
            int_e, nested = _moments(ctx, ctx.mpf(x.numerator) / x.denominator, slope < 0)
            h, factor = (ctx.mpf(v.numerator) / v.denominator for v in (length, lam))
            end = ctx.exp(-ctx.mpf(x.numerator) / x.denominator)
            # In balls the integrals are those of e and 1/e as they stand at the left end.
            plus, minus = (
                (h * int_e, h * int_e / end) if slope > 0 else (h * int_e / end, h * int_e)
            )
            double = h * h * (nested / end if slope > 0 else nested)
            wanted = (plus, factor * minus, factor * double, 1 / end if slope > 0 else end)
            for got, want in zip(found, wanted, strict=True):
                mid, rad = balls.to_mpf(got, 40)
                assert abs(ctx.convert(mid) - want) <= ctx.convert(rad) + want * ctx.mpf(10) ** -35


def test_steps_between_panels():
    """sigma and w of both engines against the emitted step."""
    rng, lam = random.Random(3), 3
    with own_context(40) as ctx, precision(150):
        for _ in range(30):
            state, in_balls = None, ball_panels.ABSORBING
            in_logs = float_panels.absorbing(np.array([float(lam)]))
            for _ in range(rng.randint(1, 9)):
                int_e, int_inverse, nested = (rng.uniform(0.1, 2) for _ in range(3))
                rise = rng.uniform(-4, 4)
                end = ctx.exp(-abs(ctx.mpf(rise)))
                fall, climb = (1, end) if rise > 0 else (end, 1)
                given = (int_e * climb, int_inverse * fall, nested * fall)
                if state is None:
                    state = formulas.absorbed(lam, given[0], given[2], fall)
                else:
                    sigma, w = state
                    state = formulas.carried(lam, w, *given, fall, climb, sigma)
                inverse = (arb(rise)).exp() ** -1
                record = ball_panels.Record(
                    arb(int_e), lam * arb(int_inverse), lam * arb(nested), inverse
                )
                in_balls = ball_panels.carried(in_balls, record)
                logs = np.array([[float(ctx.log(x))] for x in (fall, climb, *given)])
                in_logs = float_panels.carried(
                    in_logs, float_panels.Logs(logs, 1e-15 + 0 * logs), np.array([float(lam)])
                )
            for got, want in zip(
                (in_balls.eta, in_balls.zeta[1] / in_balls.eta), state, strict=True
            ):
                assert float(got) == pytest.approx(float(want), rel=1e-13)
            rate, work, _ = in_logs.log[:, 0]
            assert rate == pytest.approx(-float(ctx.log(state[0])), abs=1e-13)
            assert work == pytest.approx(float(ctx.log(state[1])), abs=1e-13)


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
    for name in ("drift/ready_made/friction", "drift/models", "base/scales"):
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
