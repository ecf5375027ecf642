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
import sympy

import symasym
import symasym as sa
from symasym import friction, linear, rescale
from symasym.asymptotics.weak_noise import answer as weak_noise
from symasym.base.contexts import own_context
from symasym.drift import float_field
from symasym.exact import (
    ball_panels,
    ball_sweep,
    float_block_panels,
    float_panels,
)
from symasym.exact import (
    floats as double,
)
from symasym.exact.digits import _Sweep
from symasym.exact.taylor_recurrences import constant_moments
from symasym.generated import mpmath_formulas, numpy_formulas, plain_formulas

ROOT = Path(symasym.__file__).parent


def _exact(rng: random.Random, low: str, high: str) -> Fraction:
    a, b = Fraction(low), Fraction(high)
    return a + (b - a) * Fraction(rng.randint(1, 9999), 10_000)


def _moments(ctx, x, up):
    """near (= far) and both of a constant drift, from the emitted code at high precision."""
    with ctx.workprec(ctx.prec + 400):
        first = mpmath_formulas.constant_single(ctx, x)
        name = "constant_both_up" if up else "constant_both_down"
        return first, getattr(mpmath_formulas, name)(ctx, x, first)


@pytest.mark.parametrize("direction", [1, -1])
def test_constant_panels_in_float64(direction):
    x = np.concatenate((np.geomspace(1e-12, 1e12, 200), [0.5, np.nextafter(0.5, 0), 1e200]))
    h = np.full(x.shape, 0.75)
    got = float_panels.constant(direction * x / h, h)
    with own_context(40) as ctx:
        for k, value in enumerate(x):
            exact = ctx.mpf(float(direction * value / 0.75)) * ctx.mpf("0.75")
            near, both = _moments(ctx, abs(exact), direction < 0)
            assert float(got.near[k]) == pytest.approx(float(0.75 * near), rel=2e-15)
            assert got.far[k] == got.near[k]
            assert float(got.both[k]) == pytest.approx(float(0.5625 * both), rel=4e-15)


def test_constant_panels_at_any_precision():
    rng = random.Random(1)
    with own_context(50) as ctx:
        for _ in range(60):
            x = _exact(rng, "-3", "3") * Fraction(10) ** rng.randint(-20, 3)
            end, near, both = constant_moments(x, ctx)
            size = ctx.mpf(abs(x).numerator) / abs(x).denominator
            first, second = _moments(ctx, size, x < 0)
            for got, want in ((near, first), (both, second), (end, ctx.exp(-size))):
                assert abs(got - want) <= want * ctx.mpf(10) ** -45


def test_constant_panels_in_balls():
    pytest.importorskip("flint")
    from symasym.numbers.balls import exact_ball, precision

    rng = random.Random(2)
    with own_context(60) as ctx, precision(150):
        for _ in range(40):
            slope, lam, length = (
                _exact(rng, low, high) for low, high in (("-3", "3"), ("1/9", "9"), ("1/9", "4"))
            )
            outer = ball_panels.Outer(exact_ball(slope), lam, length)
            x = abs(slope * lam * length)
            near, both = _moments(ctx, ctx.mpf(x.numerator) / x.denominator, slope < 0)
            h = ctx.mpf(length.numerator) / length.denominator
            end = ctx.exp(-ctx.mpf(x.numerator) / x.denominator)
            # In balls the integrals are those of e and 1/e as they stand at the left end.
            plus, minus = (h * near, h * near / end) if slope > 0 else (h * near / end, h * near)
            nested = h * h * (both / end if slope > 0 else both)
            for got, want in ((outer.plus, plus), (outer.minus, minus), (outer.nested, nested)):
                mid, rad = ball_sweep.to_mpf(got, 40)
                assert abs(ctx.convert(mid) - want) <= ctx.convert(rad) + want * ctx.mpf(10) ** -55


class _Panel:
    """A panel with given numbers."""

    def __init__(self, ctx, rng, up):
        self.up = up
        self.near, self.far, self.both = (ctx.mpf(rng.uniform(0.1, 2)) for _ in range(3))
        self.end = ctx.mpf(rng.uniform(0.01, 1))
        self.bound, self.both_bound = 3 * self.near + 3 * self.far, 9 * self.both


def _carried(ctx, chain, lam):
    """sigma and w over a chain of panels from (0, 0), by the emitted step."""
    sigma = w = ctx.zero
    for panel in chain:
        step = plain_formulas.carried_up if panel.up else plain_formulas.carried_down
        sigma, w = step(lam, w, panel.near, panel.far, panel.both, panel.end, sigma)
    return sigma, w


def test_steps_between_panels_at_any_precision(monkeypatch):
    rng = random.Random(3)
    sweep = _Sweep(linear(2, 1), False, Fraction(3), mpmath.mp.clone())
    ctx = sweep._context
    ctx.prec = 200
    for _ in range(30):
        chain = [_Panel(ctx, rng, rng.random() < 0.5) for _ in range(rng.randint(1, 9))]
        monkeypatch.setattr(sweep._cut, "records", lambda start, end, chain=chain: chain)
        got = sweep.absorbed(Fraction(-1), Fraction(0))
        w = sum((t.factor * getattr(t.panel, t.part) for t in got.w), ctx.zero)
        sigma, want = _carried(ctx, chain, ctx.mpf(3))
        assert abs(got.sigma - sigma) <= sigma * ctx.mpf(10) ** -55
        assert abs(w - want) <= want * ctx.mpf(10) ** -55


def test_steps_between_panels_in_the_log_domain():
    rng = random.Random(4)
    drift = linear(2, 1)
    field = float_field.field_of(drift, {"a_minus": 2.0, "a_plus": 1.0}, 1)
    with own_context(40) as ctx:
        for _ in range(30):
            chain = [_Panel(ctx, rng, rng.random() < 0.5) for _ in range(rng.randint(1, 9))]
            rise = np.array([float(-ctx.log(p.end)) * (1 if p.up else -1) for p in chain])
            for panel, r in zip(chain, rise, strict=True):
                panel.end = ctx.exp(-abs(ctx.mpf(float(r))))
            numbers = [np.array([float(getattr(p, n)) for p in chain]) for n in ("near", "far")]
            both = np.array([float(p.both) for p in chain])
            count = len(chain)
            records = float_block_panels.Records(
                np.zeros(count, dtype=np.intp),
                np.zeros(count, dtype=np.intp),
                np.arange(count) / count,
                float_panels.Moments(rise, *numbers, both),
                np.zeros(count, dtype=bool),
                np.zeros(count),
                np.zeros(count),
            )
            found = double._compose(
                records,
                np.array([3.0, 1.0]),
                field,
                np.full(2, -np.inf),
                np.full(2, -np.inf),
            )
            sigma, w = _carried(ctx, chain, ctx.mpf(3))
            assert float(found.log_sigma[0]) == pytest.approx(float(ctx.log(sigma)), abs=2e-14)
            assert float(found.log_w[0]) == pytest.approx(float(ctx.log(w)), abs=2e-14)
            # The running error analysis covers what the step really loses.
            assert abs(found.log_w[0] - float(ctx.log(w))) <= found.w_error[0]
            assert abs(found.log_sigma[0] - float(ctx.log(sigma))) <= found.sigma_error[0]


def test_logarithms_of_shares_in_balls():
    flint = pytest.importorskip("flint")
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
    for name in ("paper", "friction", "models", "scales"):
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


@pytest.mark.parametrize(
    "drift",
    [
        friction(mu=3, alpha=1, z0="-0.3"),
        sa.polynomial("0.3", "-1", "-0.2", "1.5"),
        sa.polynomial("0.1", "1", "0.3", "-3", "0.5", "2"),
        sa.Drift("sin(5*u) + 1/5 - u**2/7"),
    ],
    ids=["friction", "cubic", "quintic", "sine"],
)
def test_weak_noise_series_of_wells_and_barriers(drift):
    """Power series of the engine against what the Gaussian moments of the derivation give."""
    u = sympy.Symbol("u", real=True)
    slope, checked = drift.expression(), 0
    with own_context(40) as ctx:
        halves = weak_noise._halves(drift, Fraction(10), Fraction(0), 2, ctx, 0)
        # The left half is seen in a mirror: odd derivatives change sign, these formulas do not.
        for mirror, half in zip((-1, 1), halves, strict=True):
            for place in half.falling + half.rising:
                if place.kind not in ("well", "barrier"):
                    continue
                sign = -1 if place.kind == "well" else 1
                derivatives = (sympy.diff(slope, u, k) for k in range(1, 6))
                at = mirror * place.u
                V = [sign * ctx.mpf(A.subs(u, at).evalf(50)) for A in derivatives]
                leading, one, two = place.series.parts[0].coefficients[:3]
                for found, wanted in (
                    (leading, ctx.sqrt(2 * ctx.pi / V[0])),
                    (one / leading, plain_formulas.saddle_first(*V[:3])),
                    (two / leading, plain_formulas.saddle_second(*V)),
                ):
                    assert abs(found - wanted) < abs(wanted) * ctx.mpf(10) ** -30
                checked += 1
    assert checked >= 2
