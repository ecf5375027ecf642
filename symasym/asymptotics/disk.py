"""Around one maximum, proved in balls: what bounds the remainder of Watson's lemma.

With h = f(p) - f(p + t) and u = h^(1/mu) = t W(t), suppose that on the disk |t| <= r f and
G = g t^(1 - beta) are analytic and h/t^mu has no zero. Let rho be the least |u| on the circle.
By Rouche's theorem each |u| < rho is reached exactly once, so t is an analytic function of u
there, and Lagrange's coefficients

    F_k = (1/(2 pi i)) contour integral of G W^(-k - beta) t^(-k - 1) dt

of the transformed integrand, int e^(-lam u^mu) u^(beta - 1) sum F_k u^k du, obey
|F_k| <= M rho^(-k), M the largest |G W^(-beta)| on the circle. No derivative of the inverse map
has to be bounded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from symasym.arithmetic import evaluate_tree
from symasym.asymptotics.coefficients import perron_coefficients
from symasym.asymptotics.pieces import Piece, number
from symasym.errors import InputError
from symasym.exact.ball_drift import BallOps, exact_ball, flint_module

#: The neighbourhood that is transformed reaches to u = THETA rho.
THETA = 0.7
_ARCS = 192
_SCOUTING_ARCS = 24
_DEEPEST = 6
# Half-width of the interval in which a rounded zero of f' is shown to lie, relatively.
_ROOT = Fraction(1, 10**45)


class NotProved(Exception):
    """A step of the proof does not go through; an estimate remains possible."""


@dataclass(frozen=True)
class Disk:
    """M, rho and the coefficients; the reach and its u^mu for each side in `sides`.

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
    """

    contact: int
    beta: Fraction
    peak: float
    rho: float
    coefficients: list[Any]
    sides: tuple[tuple[int, Fraction | None, float], ...]


def disk(piece: Piece, x: Any, point: Any, side: str, contact: int, beta: Any, count: int) -> Disk:
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
    flint = flint_module()
    # Zero exactly: the point is a zero of f' (or of more) by its definition.
    if not all(c.contains(0) for c in f[1:contact]):
        raise NotProved
    f = [f[0], *([flint.arb(0)] * (contact - 1)), *f[contact:]]
    reduced = perron_coefficients(f, g, contact, power)
    coefficients = []
    for k, d in enumerate(reduced):
        s = exact_ball((k + power) / contact)
        coefficients.append(d * s.gamma() / contact * (-(s * steep.log())).exp())
    circle = _Circle(piece.f, smooth, x, center, f[0], contact, power, int(zeros))
    radius, rho, peak = _best(circle, _scale(f, contact), count)
    sides = []
    for s, end in ((1, piece.hi), (-1, piece.lo)):
        if side == "both" or s == sign:
            sides.append((s, *_reach(piece, x, center, f[0], s, end, radius, rho, contact)))
    return Disk(contact, power, peak, rho, coefficients, tuple(sides))


def ball_at(expression: Any) -> Any:
    """A ball for a number."""
    try:
        return evaluate_tree(sympy.sympify(expression), {}, BallOps())
    except (InputError, AttributeError):
        raise NotProved from None


def _center(piece: Piece, x: Any, point: Any, contact: int) -> Any:
    if isinstance(point, sympy.Basic):
        return ball_at(point)
    if contact != 2:
        raise NotProved
    sign, mantissa, exponent, _ = point._mpf_
    middle = Fraction(int(mantissa)) * Fraction(2) ** int(exponent) * (-1 if sign else 1)
    half = abs(middle) * _ROOT + _ROOT
    slope = sympy.diff(piece.f, x)
    before, after = (
        evaluate_tree(slope, {x: exact_ball(y)}, BallOps()) for y in (middle - half, middle + half)
    )
    if not (before > 0 and after < 0):
        raise NotProved
    return exact_ball(middle) + flint_module().arb(0, exact_ball(half))


def without_power(g: Any, x: Any, point: Any, sign: int) -> tuple[Any, Fraction]:
    """g = t^e G, the powers of the distance t taken out; e and G."""
    rest, front = sympy.Integer(1), Fraction(0)
    for factor in sympy.Mul.make_args(g):
        base, exponent = factor.as_base_exp()
        whole = exponent.is_Integer and exponent >= 0
        if whole or not (exponent.is_Rational and base.has(x) and base.is_polynomial(x)):
            rest *= factor
            continue
        polynomial = sympy.Poly(base, x)
        exact = isinstance(point, sympy.Basic)
        if polynomial.degree() != 1 or not exact or sympy.expand(base.subs(x, point)) != 0:
            rest *= factor
            continue
        slope = polynomial.LC() * sign
        if not exponent.is_Integer and not slope.is_positive:
            raise NotProved
        rest *= slope**exponent
        front += Fraction(int(exponent.p), int(exponent.q))
    return rest, front


def _series(expression: Any, x: Any, center: Any, sign: int, count: int) -> list[Any]:
    flint = flint_module()
    flint.ctx.cap = max(count, 2)
    line = flint.arb_series([center, flint.arb(sign)], max(count, 2))
    try:
        found = evaluate_tree(expression, {x: line}, BallOps())
    except (ZeroDivisionError, InputError, AttributeError, TypeError, ValueError):
        raise NotProved from None
    if isinstance(found, flint.arb):
        found = flint.arb_series([found], count)
    coefficients = [found[k] for k in range(count)]
    if not all(c.is_finite() for c in coefficients):
        raise NotProved
    return coefficients


def _scale(f: list[Any], contact: int) -> float:
    """A length on which h differs from its first term."""
    rates = [0.0]
    for j, c in enumerate(f[contact + 1 : contact + 24], start=1):
        size = abs(float(c / f[contact]))
        if size:
            rates.append(size ** (1 / j))
    return 1 / max(rates) if max(rates) else 1.0


@dataclass
class _Circle:
    f: Any
    smooth: Any
    x: Any
    center: Any
    top: Any
    contact: int
    beta: Fraction
    zeros: int

    def bounds(self, radius: float, arcs: int) -> tuple[float, float] | None:
        """rho and M on the circle, None if h may vanish or something is not finite there."""
        rho, peak = math.inf, 0.0
        for k in range(arcs):
            z = self._arc(radius, 2 * math.pi * (k + 0.5) / arcs, math.pi / arcs)
            height, weight = self._at(self.f, z), self._at(self.smooth, z)
            if height is None or weight is None:
                return None
            low = _down((self.top - height).abs_lower())
            if not low > 0:
                return None
            u = low ** (1 / self.contact) * (1 - 1e-14)
            rho = min(rho, u)
            size = _up(weight.abs_upper()) / radius**self.zeros
            peak = max(peak, size * (u / radius) ** -float(self.beta))
        return rho, peak * (1 + 1e-12)

    def winds(self, radius: float, arcs: int) -> bool:
        """Whether h/t^mu has a zero inside, by the argument principle.

        `bounds` has shown that h does not vanish on any arc's box; a box of h/t^mu that leaves
        out 0 is convex, so the argument changes by less than pi along its arc.
        """
        flint = flint_module()
        turned, last = 0.0, None
        for k in range(arcs + 1):
            angle = 2 * math.pi * (k % arcs) / arcs
            here = self._ratio(radius, angle, 0.0)
            if here is None:
                return True
            if last is not None:
                arc = self._ratio(radius, angle - math.pi / arcs, math.pi / arcs)
                if arc is None or arc.contains(flint.acb(0)):
                    return True
                turned += float((here / last).arg())
            last = here
        return abs(turned) > 1.0

    def _ratio(self, radius: float, angle: float, half: float) -> Any:
        flint = flint_module()
        height = self._at(self.f, self._arc(radius, angle, half))
        t = self._arc(radius, angle, half) - flint.acb(self.center)
        return None if height is None else (self.top - height) / t**self.contact

    def analytic(self, radius: float) -> bool:
        """Whether f and G are finite, so analytic (`BallOps`), on squares that cover the disk."""
        flint = flint_module()
        waiting = [(0.0, 0.0, radius, 0)]
        while waiting:
            re, im, half, depth = waiting.pop()
            if max(abs(re) - half, 0) ** 2 + max(abs(im) - half, 0) ** 2 > radius**2:
                continue
            box = flint.acb(self.center + flint.arb(re, half), flint.arb(im, half))
            if self._at(self.f, box) is not None and self._at(self.smooth, box) is not None:
                continue
            if depth == _DEEPEST:
                return False
            q = half / 2
            waiting += [
                (re + a * q, im + b * q, q * (1 + 1e-15), depth + 1)
                for a in (-1, 1)
                for b in (-1, 1)
            ]
        return True

    def _arc(self, radius: float, angle: float, half: float) -> Any:
        flint = flint_module()
        turn = flint.arb(angle, half * (1 + 1e-12))
        return flint.acb(self.center + radius * turn.cos(), radius * turn.sin())

    def _at(self, expression: Any, z: Any) -> Any:
        flint = flint_module()
        try:
            found = flint.acb(evaluate_tree(expression, {self.x: z}, BallOps()))
        except (ZeroDivisionError, InputError, AttributeError, TypeError, ValueError):
            return None
        return found if found.is_finite() else None


def _best(circle: _Circle, scale: float, count: int) -> tuple[float, float, float]:
    """The radius with the least M rho^(-count) among those tried, with rho and M."""

    def quality(bounds: tuple[float, float]) -> float:
        return math.log(bounds[1] or 1e-300) - count * math.log(bounds[0])

    scouted = []
    for k in range(-8, 13):
        radius = scale * 2 ** (-k / 2)
        found = circle.bounds(radius, _SCOUTING_ARCS)
        if found is not None:
            scouted.append((quality(found), radius))
    scouted.sort()
    for _, first in scouted:
        if circle.winds(first, _ARCS) or not circle.analytic(first):
            continue
        best = None
        for factor in (1.15, 1.0, 0.87):
            radius = first * factor
            found = circle.bounds(radius, _ARCS)
            if found is None or (best is not None and quality(found) >= best[0]):
                continue
            if factor > 1 and (circle.winds(radius, _ARCS) or not circle.analytic(radius)):
                continue
            best = quality(found), radius, found
        if best is not None:
            return best[1], *best[2]
    raise NotProved


def _reach(
    piece: Piece,
    x: Any,
    center: Any,
    top: Any,
    sign: int,
    end: Any,
    radius: float,
    rho: float,
    contact: int,
) -> tuple[Fraction | None, float]:
    """How far the transformed part goes, and h there from below."""

    def drop(t: Any) -> Any:
        return top - evaluate_tree(piece.f, {x: center + sign * t}, BallOps())

    limit = (THETA * rho) ** contact
    length = math.inf if end.is_infinite else abs(float(number(end)) - float(center))
    if length < radius * (1 - 1e-9):
        whole = top - evaluate_tree(piece.f, {x: ball_at(end)}, BallOps())
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
    found = drop(exact_ball(Fraction(low)))
    return Fraction(low), max(_down(found.lower()), 0.0)


def _up(value: Any) -> float:
    """A float not below the upper end of a ball."""
    return math.nextafter(float(value.upper()) * (1 + 1e-15), math.inf)


def _down(value: Any) -> float:
    """A float not above the lower end of a (not negative) ball."""
    return math.nextafter(max(float(value.lower()), 0.0) * (1 - 1e-15), 0.0)
