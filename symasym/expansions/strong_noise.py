"""Strong noise: T, C and P in powers of lam = 2/kappa^2, uniformly in r/kappa^2.

Where the drift is constant the record of a stretch (`symasym.expansions.sides`) has closed form. In
the layer each of its integrals is a power series in lam, which converges for every lam. Its
coefficients follow from f_(k+1) = -int_a^u phi f_k: with f_0 = 1 these are (V(u) - V(a))^k/k!, with
f_0 = u - a they are int_a^u (V(u) - V(v))^k/k! dv (Cauchy's formula for repeated integration).
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache, partial
from typing import Any, NamedTuple

from flint import arb, arb_poly, ctx, fmpq

from symasym.base.balls import Unresolved, rational
from symasym.drift.drift import Drift
from symasym.drift.evaluate import halved, pieces
from symasym.expansions import answer
from symasym.expansions.sides import Sides, Stretch, sides_of

_MOST_PANELS = 2000


class Moments(NamedTuple):
    """V(b) - V(a) on a stretch of the layer, and the coefficients of lam^k in its integrals."""

    rise: Any
    scale: list[Any]
    speed: list[Any]
    nested: list[Any]


def layer(known: Moments, arithmetic: Any) -> Stretch:
    """The record of a stretch of the layer."""
    scale, speed, nested = (arithmetic.total(row) for row in known[1:])
    return Stretch(scale, speed, nested, arithmetic.exp(known.rise))


@lru_cache(maxsize=32)
def moments(drift: Drift, count: int, bits: int, mirrored: bool, a: Fraction, b: Fraction) -> Any:
    """The moments of [a, b] to `count` terms, of the drift or its mirror image."""
    inside = pieces(drift, fmpq(-1), fmpq(1))[0]
    panels = _panels((inside.mirrored() if mirrored else inside).phi, a, b)
    most = 2 * ctx.prec

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

    def through(f: list[Any]) -> list[Any]:
        return [cut(-phi * part) for (_, phi), part in zip(panels, f, strict=True)]

    return moments_by([arb_poly([1])] * len(panels), integral, through, lambda f: f[-1](1), count)


def moments_by(one: Any, integral: Any, through: Any, end: Any, count: int) -> Moments:
    """The moments to `count` terms from f_(k+1) = integral(through(f_k)), whose value at b is
    end(f_k); `one` is the function 1, and `integral` vanishes at a."""
    rows = list[list[Any]]()
    for f in (one, integral(one)):
        ends, areas = list[Any](), list[Any]()
        for _ in range(max(count, 2)):
            ends.append(end(f))
            areas.append(end(integral(f)))
            f = integral(through(f))
        rows += [ends, areas]
    return Moments(rows[0][1], rows[1][:count], rows[2][:count], rows[3][:count])


def _panels(phi: Any, a: Fraction, b: Fraction) -> list[tuple[Any, Any]]:
    """Half-widths of the panels that cover [a, b], and the Taylor polynomials of phi on them."""
    found, digits = list[tuple[Any, Any]](), int(ctx.prec / 3.3)

    def known(middle: fmpq, half: fmpq) -> bool:
        of, missed = phi.taylor(middle, half, digits)
        if missed.is_finite():
            found.append((arb(half), of + arb(0, missed.upper())))
        return bool(missed.is_finite())

    if halved(rational(a), rational(b), known, _MOST_PANELS, _MOST_PANELS)[1] is not None:
        raise Unresolved
    return found


class StrongNoise(answer.PartialSums):
    """The expansion in powers of lam."""

    reason = "the noise is too weak for powers of 2/kappa^2"

    def known(self, bits: int) -> Sides:
        """The moments of the layer on both sides of the start."""
        of_layer = partial(moments, self.drift, self.length, bits)
        return sides_of(
            self.drift, self.between, self.name, lambda *at: [partial(layer, of_layer(*at))]
        )

    def quantity(self, known: Sides, arithmetic: Any) -> Any:
        """The sum over both sides."""
        return known.sum(self.name, arithmetic)


of_scene, of_scenes = partial(answer.of_scene, StrongNoise), partial(answer.of_scenes, StrongNoise)
