"""Strong noise: T, C and P in powers of lam = 2/kappa^2, uniformly in r/kappa^2.

A stretch [a, b] has I = int e^(lam (V(w) - V(b))) dw, M = int e^(-lam (V(u) - V(a))) du, the double
integral N of e^(lam (V(w) - V(u))) over w < u, and climb = e^(lam (V(a) - V(b))). With sigma and w
those of all that lies between an absorbing end and a point, one more stretch makes of them

    sigma climb + I,    w + N + sigma M,

and T = lam (sigma_R w_L + sigma_L w_R)/(sigma_L + sigma_R), C = sigma_R/(sigma_L + sigma_R), from
both ends to the start, the right one in the mirror. Straight stretches are closed form; in the
layer each integral is a power series in lam, since f_0 = 1 (or u - a), f_k = int_a A f_(k-1) are
(V(a) - V)^k/k! and its nested kin (Cauchy's formula for repeated integration, in V). It converges
for every lam.

A ring gives e^(lam g) and the sums (e^y - 1)/y and (e^y - 1 - y)/y^2 at y = lam g, and polynomials
in lam; it is one of `Balls` and `Floats`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly, ctx, fmpq

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.expansions.answer import of_series
from symasym.expansions.arrays import BITS, NEXT, Expanded, Scaled, of_drifts, orders_of, other
from symasym.numbers.balls import exact_ball, precision
from symasym.scenes import Answer, Answers, Request, Scene, Scenes, exponent_bits

_MOST_PANELS, _STEPS = 2000, 8
_ONE = Fraction(1)


class Stretch(NamedTuple):
    """I, M, N and climb."""

    scale: Any
    speed: Any
    nested: Any
    climb: Any


class Moments(NamedTuple):
    """V(a) - V(b), and the coefficients of I, M and N in powers of lam."""

    drop: Any
    scale: list[Any]
    speed: list[Any]
    nested: list[Any]


def straight(slope: Any, length: Any, ring: Any) -> Stretch:
    """A stretch where phi is constant."""
    growth = slope * length
    length = ring.number(length)
    whole = ring.exprel(growth, 1) * length
    return Stretch(whole, whole, ring.exprel(growth, 2) * length * length, ring.exp(growth))


def layer(known: Moments, ring: Any) -> Stretch:
    """A stretch of the layer."""
    scale, speed, nested = (ring.total(row) for row in known[1:])
    return Stretch(scale, speed, nested, ring.exp(known.drop))


def swept(stretches: list[Stretch]) -> tuple[Any, Any]:
    """sigma and w behind all stretches, from an absorbing end on."""
    sigma: Any = 0
    w: Any = 0
    for s in stretches:
        sigma, w = sigma * s.climb + s.scale, w + s.nested + sigma * s.speed
    return sigma, w


def quantity(name: str, sides: list[list[Stretch]], slopes: tuple[Any, Any], lam: Any) -> Any:
    """T, C, 1 - C or 1 - P of the stretches on both sides; for P those of the layer alone."""
    if name[-1] == "P":
        inside = sides[0][0]
        outside = 1 / (slopes[0] * lam) + inside.climb / (-slopes[1] * lam)
        return outside / (outside + inside.speed)
    (s, w), (t, z) = (swept(side) for side in sides)
    if name == "T":
        return (t * w + s * z) * lam / (s + t)
    return (t if name == "C" else s) / (s + t)


# -- the drift -------------------------------------------------------------------------------------


class Local(NamedTuple):
    """What the stretches of both sides are made of: slope and length, or moments."""

    sides: list[list[tuple[Any, Any] | Moments]]
    slopes: tuple[Any, Any]


@lru_cache(maxsize=16)
def local(drift: Drift, r: Fraction, start: Fraction, name: str, order: int, bits: int) -> Local:
    """The stretches to an order, once for all noise."""
    with precision(bits):
        phi = pieces(drift, fmpq(1))[0].phi
        ends = [drift.end(side) for side in (-1, 1)]
        slopes = [
            phi(arb(side)) if a is None else exact_ball(a)
            for side, a in zip((-1, 1), ends, strict=True)
        ]
        if name[-1] == "P":
            return Local([[moments(phi, -_ONE, _ONE, order)]], (slopes[0], slopes[1]))
        sides = []
        for side, of in ((1, phi), (-1, phi.mirrored())):
            x, row = side * start, list[tuple[Any, Any] | Moments]()
            before, after = (slopes[0], slopes[1])[::side], min(x, -_ONE) + r
            if after > 0:
                row.append((side * before[0], exact_ball(after)))
            a, b = max(-r, -_ONE), min(x, _ONE)
            if a < b:
                row.append(moments(of, a, b, order))
            if x > 1:
                row.append((side * before[1], exact_ball(x - 1)))
            sides.append(row)
        return Local(sides, (slopes[0], slopes[1]))


def moments(phi: Any, a: Fraction, b: Fraction, order: int) -> Moments:
    """Those of [a, b], by phi's Taylor polynomials on parts of it."""
    parts, waiting, digits = [], [(a, b)], int(ctx.prec / 3.3)
    while waiting:
        low, high = waiting.pop()
        middle, half = (low + high) / 2, (high - low) / 2
        bits = ctx.prec
        of, missed = phi.taylor(_rational(middle), _rational(half), digits)
        ctx.prec = bits
        if missed.is_finite():
            parts.append((exact_ball(half), of + arb(0, missed.upper())))
        elif len(parts) + len(waiting) < _MOST_PANELS:
            waiting += [(middle, high), (low, middle)]
        else:
            raise AccuracyError(
                f"A varies too fast near u = {float(middle):.6g} for the series in 2/kappa^2; use "
                "method='exact'."
            )
    most = 2 * ctx.prec

    def integrated(f: list[Any]) -> tuple[list[Any], Any]:
        found, value = [], arb(0)
        for (half, _), part in zip(parts, f, strict=True):
            whole = part.integral() * half
            whole = whole - whole(-1) + value
            value = whole(1)
            found.append(whole)
        return found, value

    def times_slope(f: list[Any]) -> list[Any]:
        found = []
        for (_, slope), part in zip(parts, f, strict=True):
            c = (slope * part).coeffs()
            if len(c) > most:
                c[0] += arb(0, sum(abs(x).upper() for x in c[most:]))
            found.append(arb_poly(c[:most]))
        return found

    one = [arb_poly([1])] * len(parts)
    ends: list[list[Any]] = []
    areas: list[list[Any]] = []
    for start, first in ((one, arb(1)), integrated(one)):
        f, end = start, first
        ends.append([])
        areas.append([])
        for _ in range(max(order, 1) + 1):
            ends[-1].append(end)
            areas[-1].append(integrated(f)[1])
            f, end = integrated(times_slope(f))
    count = order + 1
    return Moments(ends[0][1], ends[1][:count], areas[0][:count], areas[1][:count])


def _rational(x: Fraction) -> fmpq:
    return fmpq(x.numerator, x.denominator)


# -- the rings -------------------------------------------------------------------------------------


class Balls:
    """At one lam, to an order."""

    def __init__(self, lam: Any, order: int) -> None:
        self.lam, self.order = lam, order

    def number(self, x: Any) -> Any:
        """The ball itself."""
        return x

    def exp(self, growth: Any) -> Any:
        """e^(lam growth)."""
        return (self.lam * growth).exp()

    def exprel(self, growth: Any, n: int) -> Any:
        """(e^y - 1)/y for n = 1, (e^y - 1 - y)/y^2 for n = 2 (Kummer's function, DLMF 13.6.2)."""
        return (self.lam * growth).hypgeom_1f1(1, n + 1) / n

    def total(self, row: list[Any]) -> Any:
        """The polynomial in lam."""
        return arb_poly(row[: self.order + 1])(self.lam)


class Floats:
    """At many lam, to an order."""

    def __init__(self, lam: FloatArray, order: int) -> None:
        self.lam, self.order = lam, order

    def number(self, x: Any) -> float:
        """The ball as a float."""
        return float(x)

    def exp(self, growth: Any) -> Scaled:
        """e^(lam growth)."""
        return Scaled(np.ones_like(self.lam), growth, self.lam)

    def exprel(self, growth: Any, n: int) -> Scaled:
        """(e^y - 1)/y for n = 1, (e^y - 1 - y)/y^2 for n = 2."""
        y = self.lam * float(growth)
        size, up = np.abs(y), float(growth) > 0
        near = sum(y**k / math.factorial(k + n) for k in range(18, -1, -1))
        near = near * np.exp(-np.maximum(y, 0))
        fall = -np.expm1(-size)
        if n == 1:
            far = fall / size
        else:
            far = ((fall - size * (1 - fall)) if up else (size - fall)) / size**2
        m = np.where(size < 1, near, far)
        return Scaled(m, growth if up else arb(0), self.lam)

    def total(self, row: list[Any]) -> Scaled:
        """The polynomial in lam."""
        c = [float(y) for y in row[: self.order + 1]]
        return Scaled(np.polynomial.polynomial.polyval(self.lam, c), arb(0), self.lam)


def at(known: Local, name: str, ring: Any) -> Any:
    """The quantity over a ring."""
    sides = [
        [layer(s, ring) if isinstance(s, Moments) else straight(*s, ring) for s in side]
        for side in known.sides
    ]
    a_minus, a_plus = (ring.number(a) for a in known.slopes)
    return quantity(name, sides, (a_minus, a_plus), ring.lam)


def values(
    drift: Drift, lam: Fraction, r: Fraction, start: Fraction, name: str, orders: Sequence[int],
    digits: int, bits: int,
) -> list[Any]:  # fmt: skip
    """Balls of the quantity to each of the orders, each good to so many digits or about 0."""
    wanted = int(3.33 * digits) + 1
    for _ in range(_STEPS):
        known = local(drift, r, start, name, max(orders), bits)
        with precision(bits):
            number = exact_ball(lam)
            found = [at(known, name, Balls(number, n)) for n in orders]
            if name == "P":
                found = [1 - y for y in found]
            if all(y.rel_accuracy_bits() > wanted for y in found):
                return found
        bits *= 2
    raise AccuracyError(f"{name} has no digits in {bits:,} bits; use method='exact'.")


# -- the method ------------------------------------------------------------------------------------


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P, or a complement, to the request's order, any region, any start."""
    name, digits = request.name, request.digits
    r, start = scene.numbers.get("r", _ONE), scene.numbers.get("start", Fraction(0))
    bits = int(3.4 * digits) + 120 + exponent_bits(scene.drift, scene.lam, r)
    bits += -bits % 64

    def to_orders(some: list[int], complement: bool = False) -> list[Any]:
        asked = other(name) if complement else name
        return values(scene.drift, scene.lam, r, start, asked, some, digits + 5, bits)

    found = of_series(scene, request, to_orders, too_weak(scene.noise, orders_of(request)))
    return found._replace(terms=_terms(request.order), dropped=_dropped(request.order))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same in float64: each drift's moments once, then all its kappa."""
    order = request.order

    def expanded(drift: Drift, r: Fraction, start: Fraction, name: str) -> Expanded:
        known = local(drift, r, start, name, order + NEXT, BITS)

        def in_floats(lam: FloatArray, n: int) -> Any:
            return at(known, name, Floats(lam, n))

        def in_balls(lam: Fraction, orders: list[int]) -> list[Any]:
            return values(drift, lam, r, start, name, orders, 20, BITS)

        return Expanded(in_floats, in_balls)

    logs, errors, why = of_drifts(scenes, request, expanded, too_weak)
    return Answers(logs, errors, "estimate", _terms(order), _dropped(order))


def _terms(order: int) -> tuple[str, ...]:
    return tuple(f"lam^{k} of the layer" for k in range(order + 1))


def _dropped(order: int) -> tuple[str, ...]:
    return (f"lam^{order + 1} of the layer and beyond, in the error",)


def too_weak(kappa: str, orders: Sequence[int]) -> AccuracyError:
    """The refusal of a scene whose error is as large as its value."""
    return AccuracyError(
        f"kappa is {kappa}, where the noise is so weak that {orders[0] + 1} terms in 2/kappa^2 "
        "leave an error as large as the value; give a larger order, or use method='exact'."
    )
