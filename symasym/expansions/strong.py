"""Strong noise: T, C and P in powers of lam = 2/kappa^2, uniformly in r/kappa^2, over any ring.

A stretch [a, b] has I = int e^(lam (V(w) - V(b))) dw, M = int e^(-lam (V(u) - V(a))) du, N the
double integral of e^(lam (V(w) - V(u))) over w < u, and climb = e^(lam (V(a) - V(b))). With sigma
and w those of all that lies between an absorbing end and a point, one more stretch makes of them

    sigma climb + I,    w + N + sigma M,

and T = lam (sigma_R w_L + sigma_L w_R)/(sigma_L + sigma_R), C = sigma_R/(sigma_L + sigma_R), from
both ends to the start, the right one in the mirror. Straight stretches are closed form; in the
layer each integral is a power series in lam, since f_0 = 1 (or u - a), f_k = int_a A f_(k-1) are
(V(a) - V)^k/k! and its nested kin (Cauchy's formula for repeated integration, in V).

A ring gives `number`, `exp`, `exprel(y)` = (e^y - 1)/y, `exprel2(y)` = (e^y - 1 - y)/y^2, and
polynomials in u: `polynomial(coefficients)`, `area(f, a, b)` and `primitive(f, a)`.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Stretch(NamedTuple):
    """I, M, N and climb."""

    scale: Any
    speed: Any
    nested: Any
    climb: Any


def straight(slope: Any, length: Any, lam: Any, ring: Any) -> Stretch:
    """A stretch where phi is constant."""
    length = ring.number(length)
    y = slope * length * lam
    whole = ring.exprel(y) * length
    return Stretch(whole, whole, ring.exprel2(y) * length * length, ring.exp(y))


class Moments(NamedTuple):
    """V(a) - V(b), and the coefficients of I, M and N in powers of lam."""

    drop: Any
    scale: list[Any]
    speed: list[Any]
    nested: list[Any]


def moments(A: Any, ring: Any, a: Any, b: Any, order: int) -> Moments:
    """Those of [a, b] to an order."""
    rows, ends = [], []
    for f in (ring.polynomial([1]), ring.polynomial([-a, 1])):
        row, end = [], []
        for _ in range(max(order, 1) + 1):
            row.append(ring.area(f, a, b))
            end.append(f(b))
            f = ring.primitive(A * f, a)
        rows.append(row)
        ends.append(end)
    count = order + 1
    return Moments(ends[0][1], ends[1][:count], rows[0][:count], rows[1][:count])


def layer(known: Moments, lam: Any, ring: Any) -> Stretch:
    """The stretch of the layer from its moments."""

    def total(row: list[Any]) -> Any:
        value = row[-1]
        for c in row[-2::-1]:
            value = value * lam + c
        return value

    scale, speed, nested = map(total, (known.scale, known.speed, known.nested))
    return Stretch(scale, speed, nested, ring.exp(known.drop * lam))


def swept(stretches: list[Stretch]) -> tuple[Any, Any]:
    """sigma and w behind all stretches, from an absorbing end on."""
    sigma: Any = 0
    w: Any = 0
    for s in stretches:
        sigma, w = sigma * s.climb + s.scale, w + s.nested + sigma * s.speed
    return sigma, w


def escape_time(left: list[Stretch], right: list[Stretch], lam: Any) -> Any:
    """T."""
    (s, w), (t, z) = swept(left), swept(right)
    return (t * w + s * z) / (s + t) * lam


def exit_probability(left: list[Stretch], right: list[Stretch], complement: bool = False) -> Any:
    """C, or 1 - C."""
    s, t = swept(left)[0], swept(right)[0]
    return (s if complement else t) / (s + t)


def outside_odds(a_minus: Any, inside: Stretch, a_plus: Any, lam: Any) -> Any:
    """(1 - P)/P: int e^(-lam V) over |u| > 1 over that over the layer."""
    return (1 / (a_minus * lam) + inside.climb / (-a_plus * lam)) / inside.speed


def stretches(
    drift: Any, order: int, lam: Any, ring: Any, r: Any, start: Any, wide: bool
) -> list[list[Stretch]]:
    """Those left and, in the mirror, right of the start.

    `drift` has `moments(mirrored, a, b, order)` and `slope(mirrored, side)`; `wide` tells that
    r > 1.
    """
    sides = []
    for mirrored in (False, True):
        x, row = (-start if mirrored else start), list[Stretch]()
        if wide:
            row.append(straight(drift.slope(mirrored, -1), r + min(x, -1), lam, ring))
        a, b = -1 if wide else max(-r, -1), min(x, 1)
        if a < b:
            row.append(layer(drift.moments(mirrored, a, b, order), lam, ring))
        if x > 1:
            row.append(straight(drift.slope(mirrored, 1), x - 1, lam, ring))
        sides.append(row)
    return sides
