"""Cauchy's estimate around one maximum, proved in balls: it bounds Watson's lemma's remainder.

With h = f(p) - f(p + t) and u = h^(1/mu) = t W(t), suppose that in a polygon around t = 0 f and
G = g t^(1 - beta) are analytic and h/t^mu has no zero. Let rho be the least |u| on its boundary
B. By Rouche's theorem each |u| < rho is reached exactly once, so t is an analytic function of u
there, and Lagrange's coefficients

    F_k = (1/(2 pi i)) contour integral of G W^(-k - beta) t^(-k - 1) dt

of the transformed integrand, int e^(-lam u^mu) u^(beta - 1) sum F_k u^k du, obey
|F_k| <= M rho^(-k), M the largest |G W^(-beta)| on B times the integral of |dt/t|/(2 pi). No
derivative of the inverse map has to be bounded. The polygon follows a level line of |u|, since
rho is what decides how far the transformed part of the integral reaches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import flint
import numpy as np
import sympy

from symasym.asymptotics.laplace.kinks import Piece, number
from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, exact
from symasym.drift.expressions import polynomial_of
from symasym.numbers.balls import BallOps, NotProved, exact_ball
from symasym.numbers.trees import NumpyOps, evaluate_tree

if TYPE_CHECKING:
    from flint import acb, arb, arb_poly
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real

    ComplexArray: TypeAlias = np.ndarray[Any, np.dtype[np.complex128]]

#: The neighbourhood that is transformed reaches to u = THETA rho.
THETA = 0.7
_RAYS = 64
_STEPS = 96
_DEEPEST = 7
# Half-width of the interval in which a rounded zero of f' is shown to lie, relatively.
_ROOT = Fraction(1, 10**45)


@dataclass(frozen=True)
class Disk:
    """M, rho, the coefficients, f(p); the reach and its u^mu for each side in `sides`.

    Attributes
    ----------
    contact : int
    beta : Fraction
    peak : float
        M, an upper bound.
    rho : float
        A lower bound.
    coefficients : list of arb
        F_k / mu times Gamma((k + beta)/mu): c_k of one side.
    sides : tuple of (sign, reach, drop)
        The transformed part is 0 <= t <= reach (None: to the end of the piece); u^mu is at
        least `drop` there.
    top : arb
        f(p).
    """

    contact: int
    beta: Fraction
    peak: float
    rho: float
    coefficients: list[arb]
    sides: tuple[tuple[int, Fraction | None, float], ...]
    top: arb


def disk(
    piece: Piece, x: Symbol, point: Real, side: str, contact: int, beta: Expr, count: int
) -> Disk:
    """The proof's data at one maximum, with `count` coefficients (the ball precision is set).

    Raises
    ------
    NotProved
        If no disk is found on which all of it holds.
    """
    if not beta.is_Rational:
        raise NotProved
    power = Fraction(int(beta.p), int(beta.q))
    sign = -1 if side == "left" else 1
    center = _center(piece, x, point, contact)
    smooth, front = without_power(piece.g, x, point, sign)
    zeros = power - 1 - front
    if zeros.denominator != 1 or zeros < 0:
        raise NotProved
    f = _series(piece.f, x, center, sign, contact + count)
    g = _series(smooth, x, center, sign, count + int(zeros))[int(zeros) :]
    steep = -f[contact]
    if not steep > 0:
        raise NotProved
    # Zero exactly: the point is a zero of f' (or of more) by its definition.
    if not all(c.contains(0) for c in f[1:contact]):
        raise NotProved
    reduced = perron_coefficients(f, g, contact, power)
    coefficients = []
    for k, d in enumerate(reduced):
        s = exact_ball((k + power) / contact)
        coefficients.append(d * s.gamma() / contact * (-(s * steep.log())).exp())
    around = _Surroundings(piece.f, smooth, x, center, f[0], contact, power, int(zeros))
    corners, rho, peak = _best(around, _scale(f, contact), count)
    sides = []
    for s, end in ((1, piece.hi), (-1, piece.lo)):
        if side == "both" or s == sign:
            # The first corner lies on the positive axis, the middle one on the negative.
            radius = float(abs(corners[0 if s > 0 else _RAYS // 2])) * (1 - 1e-12)
            sides.append((s, *_reach(around, s, end, radius, rho)))
    return Disk(contact, power, peak, rho, coefficients, tuple(sides), f[0])


def ball_at(expression: Expr) -> Any:
    """A ball for a number."""
    try:
        return evaluate_tree(sympy.sympify(expression), {}, BallOps())
    except (InputError, AttributeError):
        raise NotProved from None


def _center(piece: Piece, x: Symbol, point: Real, contact: int) -> Any:
    """A ball of the maximum: of its expression, or one in which f' is shown to have its zero."""
    if isinstance(point, sympy.Basic):
        return ball_at(point)
    if contact != 2:
        raise NotProved
    middle = exact("point", point)
    half = abs(middle) * _ROOT + _ROOT
    slope = sympy.diff(piece.f, x)
    before, after = (
        evaluate_tree(slope, {x: exact_ball(y)}, BallOps()) for y in (middle - half, middle + half)
    )
    if not (before > 0 and after < 0):
        raise NotProved
    return exact_ball(middle) + flint.arb(0, exact_ball(half))


def without_power(g: Expr, x: Symbol, point: Real, sign: int) -> tuple[Expr, Fraction]:
    """g = t^e G, the powers of the distance t taken out; e and G."""
    rest, front = sympy.Integer(1), Fraction(0)
    for factor in sympy.Mul.make_args(g):
        base, exponent = factor.as_base_exp()
        whole = exponent.is_Integer and exponent >= 0
        if whole or not (exponent.is_Rational and base.has(x) and base.is_polynomial(x)):
            rest *= factor
            continue
        polynomial = sympy.Poly(base, x)
        rounded = not isinstance(point, sympy.Basic)
        if polynomial.degree() != 1 or rounded or sympy.expand(base.subs(x, point)) != 0:
            rest *= factor
            continue
        slope = polynomial.LC() * sign
        if not exponent.is_Integer and not slope.is_positive:
            raise NotProved
        rest *= slope**exponent
        front += Fraction(int(exponent.p), int(exponent.q))
    return rest, front


def _series(expression: Expr, x: Symbol, center: arb, sign: int, count: int) -> list[arb]:
    """Taylor coefficients at the centre, as balls, in the distance along `sign`."""
    flint.ctx.cap = max(count, 2)
    line = flint.arb_series([center, flint.arb(sign)], max(count, 2))
    try:
        series = evaluate_tree(expression, {x: line}, BallOps())
    except (ZeroDivisionError, InputError, AttributeError, TypeError, ValueError):
        raise NotProved from None
    if isinstance(series, flint.arb):
        series = flint.arb_series([series], count)
    coefficients = [series[k] for k in range(count)]
    if not all(c.is_finite() for c in coefficients):
        raise NotProved
    return coefficients


def _scale(f: list[arb], contact: int) -> float:
    """A length on which h differs from its first term."""
    rates = [0.0]
    for j, c in enumerate(f[contact + 1 : contact + 24], start=1):
        size = abs(float(c / f[contact]))
        if size:
            rates.append(size ** (1 / j))
    return 1 / max(rates) if max(rates) else 1.0


@dataclass
class _Surroundings:
    """f and G off the real axis; all points are relative to the maximum."""

    f: Expr
    smooth: Expr
    x: Symbol
    center: arb
    top: arb
    contact: int
    beta: Fraction
    zeros: int

    @cached_property
    def _shifted(self) -> dict[Expr, arb_poly]:
        """Polynomials in t of f and G, where these are some: faster than a tree, and tighter."""
        shifted = {}
        line = flint.arb_poly([self.center, 1])
        for expression in (self.f, self.smooth):
            if not expression.is_polynomial(self.x):
                continue
            rows = polynomial_of(expression, self.x).all_coeffs()[::-1]
            if all(c.is_Rational for c in rows):
                rational = flint.fmpq_poly([flint.fmpq(int(c.p), int(c.q)) for c in rows])
                shifted[expression] = flint.arb_poly(rational)(line)
        return shifted

    def sampled(self, t: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """|u| and |G W^(-beta)| on an array of complex points, in float64 and unproved."""
        with np.errstate(all="ignore"):
            z = float(self.center) + t
            weight = np.asarray(evaluate_tree(self.smooth, {self.x: z}, _ComplexOps()) + 0 * t)
            u = np.abs(self._drops(t)) ** (1 / self.contact)
            peak = np.abs(weight) * np.abs(t) ** (float(self.beta) - self.zeros)
            return u, peak * u ** -float(self.beta)

    def _drops(self, t: ComplexArray) -> Any:
        """h, in float64 and unproved; from its own series nothing cancels."""
        known = self._shifted.get(self.f)
        if known is not None:
            rows = [float(c) for c in known.coeffs()]
            return -np.polyval([*rows[: self.contact - 1 : -1], *[0.0] * self.contact], t)
        height = evaluate_tree(self.f, {self.x: float(self.center) + t}, _ComplexOps())
        return float(self.top) - height + 0 * t

    def height(self, t: arb) -> Any:
        """A ball of f on the real axis."""
        known = self._shifted.get(self.f)
        if known is not None:
            return known(t)
        return evaluate_tree(self.f, {self.x: self.center + t}, BallOps())

    def winds_once(self, t: ComplexArray) -> bool:
        """True if h seems to have its zero at t = 0 only inside the closed curve."""
        with np.errstate(all="ignore"):
            ratio = self._drops(t) / t**self.contact
            steps = np.angle(np.roll(ratio, -1) / ratio)
        return bool(abs(steps.sum()) < 1)

    def at(self, expression: Expr, t: acb) -> Any:
        """A ball of the expression, None where it may not be analytic."""
        known = self._shifted.get(expression)
        if known is not None:
            return flint.acb(known(flint.acb(t)))
        try:
            value = flint.acb(
                evaluate_tree(expression, {self.x: flint.acb(self.center) + t}, BallOps())
            )
        except (ZeroDivisionError, InputError, AttributeError, TypeError, ValueError):
            return None
        return value if value.is_finite() else None


class _ComplexOps(NumpyOps):
    def power(self, base: ComplexArray, exponent: Fraction) -> Any:
        return np.power(np.asarray(base, dtype=complex), float(exponent))

    def erf(self, x: ComplexArray) -> Any:
        raise NotProved


def _best(around: _Surroundings, scale: float, count: int) -> tuple[ComplexArray, float, float]:
    """Corners of the polygon with the least M rho^(-count) among those tried, rho and M."""
    if not math.isfinite(32 * scale):
        raise NotProved
    angles = 2 * np.pi * np.arange(_RAYS) / _RAYS
    radii = scale * np.geomspace(1 / 16, 32, _STEPS)
    points = radii[:, None] * np.exp(1j * angles)
    u, peaks = around.sampled(points)
    tried = []
    seen = u[np.isfinite(u)]
    if not seen.size or not 0 < np.nanmin(u[0]) < seen.max():
        # Beside another zero of f', within the rounding of f, nothing is seen.
        raise NotProved
    for level in np.geomspace(np.nanmin(u[0]) * 1.0001, seen.max(), 120):
        above = ~(u < level)  # nan counts as above, and is refused below
        if not above.any(axis=0).all():
            break
        first = above.argmax(axis=0)
        if (first == 0).any():
            continue
        rays = np.arange(_RAYS)
        low, high = u[first - 1, rays], u[first, rays]
        if not (np.isfinite(high).all() and np.isfinite(peaks[first, rays]).all()):
            # Not so near a singularity that |u| or G has no value: one step before it.
            continue
        share = np.log(level / low) / np.log(high / low)
        corners = radii[first - 1] * (radii[1] / radii[0]) ** share
        points_here = corners * np.exp(1j * angles)
        if not around.winds_once(points_here):
            # Beyond a critical point of f, |u| has passed a saddle and other zeros are inside.
            continue
        score = np.log(peaks[first, rays].max()) - count * np.log(level)
        tried.append((float(score), points_here, float(level)))
    tried.sort(key=lambda entry: entry[0])
    ceiling = math.inf
    for _, corners, level in tried:
        if level < ceiling:
            proof = _proved(around, corners, level)
            if proof is not None:
                return corners, *proof
            # What failed was too near a singularity or a critical point.
            ceiling = 0.94 * level
    raise NotProved


def _proved(
    around: _Surroundings, corners: ComplexArray, level: float
) -> tuple[float, float] | None:
    """rho and M of a polygon, None if something that is needed does not hold or is not seen."""
    if not _analytic(around, corners):
        return None
    rho, peak = flint.arb("inf"), flint.arb(0)
    length = turned = flint.arb(0)
    wanted = (0.93 * level) ** around.contact
    power = exact_ball(around.beta - around.zeros)
    for start, end in zip(corners, np.roll(corners, -1), strict=True):
        waiting = [(complex(start), complex(end), 0)]
        while waiting:
            step()
            a, b, depth = waiting.pop()
            box = _box(a, b)
            height, weight = around.at(around.f, box), around.at(around.smooth, box)
            drop = None if height is None else (around.top - height).abs_lower()
            if weight is None or drop is None or not drop > wanted:
                if depth == _DEEPEST:
                    return None
                middle = (a + b) / 2
                waiting += [(a, middle, depth + 1), (middle, b, depth + 1)]
                continue
            u = drop ** exact_ball(Fraction(1, around.contact))
            near, far = box.abs_lower(), box.abs_upper()
            size = weight.abs_upper() * (far if power > 0 else near) ** power
            rho, peak = rho.min(u), peak.max(size * u ** -exact_ball(around.beta))
            length += _step(a, b).abs_upper() / near
            # The box of h leaves out 0 and is convex: its argument changes by less than pi.
            turned += _turn(around, a, b)
    if not abs(turned / (2 * flint.arb.pi()) - around.contact) < 0.1:
        return None
    return _down(rho), _up(peak * length / (2 * flint.arb.pi()))


def _step(a: complex, b: complex) -> Any:
    """b - a."""
    return flint.acb(b.real, b.imag) - flint.acb(a.real, a.imag)


def _turn(around: _Surroundings, a: complex, b: complex) -> Any:
    """The change of the argument of h from a to b, where it is less than pi."""
    first, last = (around.at(around.f, flint.acb(t.real, t.imag)) for t in (a, b))
    return ((around.top - last) / (around.top - first)).arg()


def _box(a: complex, b: complex) -> Any:
    """The smallest box with sides along the axes that holds a segment, a little widened."""
    middle, half = (a + b) / 2, (b - a) / 2
    rounding = 1e-14 * (abs(a) + abs(b))
    return flint.acb(
        flint.arb(middle.real, abs(half.real) + rounding),
        flint.arb(middle.imag, abs(half.imag) + rounding),
    )


def _analytic(around: _Surroundings, corners: ComplexArray) -> bool:
    """True if f and G are finite, so analytic (`BallOps`), on squares that cover the polygon."""
    reach = np.abs(corners)
    reach = np.maximum(np.maximum(reach, np.roll(reach, 1)), np.roll(reach, -1))
    # More than rounding moves a corner or a middle between two of them.
    reach = reach * (1 + 1e-9)
    mantissa, exponent = math.frexp(float(reach.max()) * 1.001)
    # So few digits that the squares' corners below are exact, and leave nothing out.
    outermost = math.ldexp(math.ceil(mantissa * 2**12), exponent - 12)
    waiting = [(0.0, 0.0, outermost, 0)]
    while waiting:
        step()
        re, im, half, depth = waiting.pop()
        if _outside(re, im, half, reach):
            continue
        box = flint.acb(flint.arb(re, half), flint.arb(im, half))
        if around.at(around.f, box) is not None and around.at(around.smooth, box) is not None:
            continue
        if depth == _DEEPEST + 2:
            return False
        q = half / 2
        waiting += [(re + a * q, im + b * q, q, depth + 1) for a in (-1, 1) for b in (-1, 1)]
    return True


def _outside(re: float, im: float, half: float, reach: FloatArray) -> bool:
    """True if a square lies outside the polygon, by the farthest corner in the angle it fills."""
    near = math.hypot(max(abs(re) - half, 0.0), max(abs(im) - half, 0.0))
    if near > reach.max():
        return True
    distance = math.hypot(re, im)
    spread = half * 1.4143
    if spread >= 0.9 * distance:
        return False
    middle, width = math.atan2(im, re), math.asin(spread / distance)
    first = math.floor((middle - width) / (2 * math.pi) * _RAYS)
    last = math.ceil((middle + width) / (2 * math.pi) * _RAYS)
    return bool(near > max(reach[k % _RAYS] for k in range(first, last + 1)))


def _reach(
    around: _Surroundings, sign: int, end: Expr, radius: float, rho: float
) -> tuple[Fraction | None, float]:
    """The end of the transformed part (None: of the piece), and h there from below."""
    top, center = around.top, around.center

    def drop(t: arb) -> Any:
        return top - around.height(sign * t)

    limit = (THETA * rho) ** around.contact
    length = math.inf if end.is_infinite else abs(float(number(end)) - float(center))
    if length < radius * (1 - 1e-9):
        whole = top - evaluate_tree(around.f, {around.x: ball_at(end)}, BallOps())
        if whole.is_finite() and whole < limit:
            return None, _down(whole.lower())
    low, high = 0.0, min(radius, length)
    for _ in range(40):
        middle = (low + high) / 2
        value = drop(exact_ball(Fraction(middle)))
        if value.is_finite() and value < limit:
            low = middle
        else:
            high = middle
    if not low:
        raise NotProved
    height = drop(exact_ball(Fraction(low)))
    return Fraction(low), max(_down(height.lower()), 0.0)


def _up(value: arb) -> float:
    """A float not below the upper end of a ball."""
    return math.nextafter(float(value.upper()) * (1 + 1e-15), math.inf)


def _down(value: arb) -> float:
    """A float not above the lower end of a (not negative) ball."""
    return math.nextafter(max(float(value.lower()), 0.0) * (1 - 1e-15), 0.0)
