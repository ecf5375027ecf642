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

A ring gives e^(lam g), (e^y - 1)/y and (e^y - 1 - y)/y^2 at y = lam g, and polynomials in lam.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly, ctx, fmpq

from symasym.base.balls import exact_ball
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.drift.formula import rational
from symasym.expansions.answer import Expansion
from symasym.expansions.field import Between, Unresolved
from symasym.expansions.rings import AtLam, AtLams, Scaled

_MOST_PANELS = 2000
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
    growth, length = slope * length, ring.number(length)
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
    """T, C or P, or a complement, of the stretches of both sides; for P of the layer alone."""
    if name[-1] == "P":
        inside = sides[0][0]
        outside = 1 / (slopes[0] * lam) + inside.climb / (-slopes[1] * lam)
        return (inside.speed if name == "P" else outside) / (outside + inside.speed)
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
def local(drift: Drift, between: Between, name: str, count: int, bits: int) -> Local:
    """The stretches, moments to `count` terms, at flint's `bits`."""
    r, start = between.right, between.start
    left, inside, right = pieces(drift, fmpq(-2), fmpq(2))
    slopes = tuple(p.phi(arb(0)) for p in (left, right))
    if name[-1] == "P":
        return Local([[moments(inside.phi, -_ONE, _ONE, count)]], slopes)
    sides = []
    for side, phi in ((1, inside.phi), (-1, inside.mirrored().phi)):
        x, row = side * start, list[tuple[Any, Any] | Moments]()
        behind, ahead = (side * a for a in slopes[::side])
        if (length := min(x, -_ONE) + r) > 0:
            row.append((behind, exact_ball(length)))
        if max(-r, -_ONE) < min(x, _ONE):
            row.append(moments(phi, max(-r, -_ONE), min(x, _ONE), count))
        if x > 1:
            row.append((ahead, exact_ball(x - 1)))
        sides.append(row)
    return Local(sides, slopes)


def moments(phi: Any, a: Fraction, b: Fraction, count: int) -> Moments:
    """Those of [a, b], to `count` terms."""
    panels, most = _panels(phi, a, b), 2 * ctx.prec

    def integral(f: list[Any]) -> list[Any]:
        found, value = [], arb(0)
        for (half, _), part in zip(panels, f, strict=True):
            whole = part.integral() * half
            found.append(whole - whole(-1) + value)
            value = found[-1](1)
        return found

    def cut(part: Any) -> Any:
        c = part.coeffs()
        return arb_poly([*c[:most]]) + arb(0, sum((abs(x).upper() for x in c[most:]), arb(0)))

    one, rows = [arb_poly([1])] * len(panels), list[list[Any]]()
    for f in (one, integral(one)):
        ends, areas = list[Any](), list[Any]()
        for _ in range(max(count, 2)):
            ends.append(f[-1](1))
            areas.append(integral(f)[-1](1))
            f = integral([cut(slope * part) for (_, slope), part in zip(panels, f, strict=True)])
        rows += [ends, areas]
    return Moments(rows[0][1], rows[2][:count], rows[1][:count], rows[3][:count])


def _panels(phi: Any, a: Fraction, b: Fraction) -> list[tuple[Any, Any]]:
    """Half the widths of parts of [a, b], and phi's Taylor polynomials on them."""
    found, waiting, bits = list[tuple[Any, Any]](), [(a, b)], ctx.prec
    for _ in range(_MOST_PANELS):
        if not waiting:
            return found
        low, high = waiting.pop()
        middle, half = (low + high) / 2, (high - low) / 2
        of, missed = phi.taylor(rational(middle), rational(half), int(bits / 3.3))
        if missed.is_finite():
            found.append((exact_ball(half), of + arb(0, missed.upper())))
        else:
            waiting += [(middle, high), (low, middle)]
    raise Unresolved


# -- the rings -------------------------------------------------------------------------------------


class Balls(AtLam):
    """At one lam, to an order."""

    def exp(self, growth: Any) -> Any:
        """e^(lam growth)."""
        return (self.lam * growth).exp()

    def exprel(self, growth: Any, n: int) -> Any:
        """(e^y - 1)/y for n = 1, (e^y - 1 - y)/y^2 for n = 2 (Kummer's function, DLMF 13.6.2)."""
        return (self.lam * growth).hypgeom_1f1(1, n + 1) / n

    def total(self, row: list[Any]) -> Any:
        """The polynomial in lam."""
        return arb_poly(row[: self.order + 1])(self.lam)


class Floats(AtLams):
    """At many lam, to an order."""

    def exp(self, growth: Any) -> Scaled:
        """e^(lam growth)."""
        return Scaled(np.ones_like(self.lam), growth, self.lam)

    def exprel(self, growth: Any, n: int) -> Scaled:
        """(e^y - 1)/y for n = 1, (e^y - 1 - y)/y^2 for n = 2."""
        from scipy.special import hyp1f1

        # Kummer's transformation, DLMF 13.2.39, where growth > 0.
        up, fall = float(growth) > 0, -self.lam * abs(float(growth))
        m = hyp1f1(n if up else 1, n + 1, fall) / n
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
    low, high = (ring.number(a) for a in known.slopes)
    return quantity(name, sides, (low, high), ring.lam)


STRONG_NOISE = Expansion(
    local, at, Balls, Floats,
    "powers of lam in the layer",
    "higher powers of lam in the layer, in the error",
    "where the noise is too weak for powers of 2/kappa^2",
)  # fmt: skip
of_scene, of_scenes = STRONG_NOISE.of_scene, STRONG_NOISE.of_scenes
