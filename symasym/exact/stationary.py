"""Truncation points for a stationary density on the real line, with a bound of the neglected mass.

Let phi be a polynomial, the noise sigma bounded or a polynomial, and R right of all their zeros, so
that |phi| does not decrease there. If phi < 0, the speed measure beyond X, over 1/e at X, is below

    S^2 m^(2 alpha - 2)/(lam |phi(X)|)    for noise with m < sigma < S on the line, or
    c^(2 alpha - 2) (X - R)^(1 - q)/(q - 1)    with q = (2 - 2 alpha) k > 1

for a polynomial sigma of degree k with the leading coefficient c.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

from flint import arb, fmpq

from symasym.base.errors import RegionError
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Polynomial, profile
from symasym.drift.formula import rational

_LOG10 = math.log(10.0)
_LINE, _BOUNDED = arb(0, 1e300), 1e9  # the declared domain


class Tail(NamedTuple):
    """A truncation point on the right, and a bound of the mass beyond it."""

    x: fmpq
    mass: arb


def tails(drift: Drift, lam: fmpq, far: fmpq, digits: int) -> tuple[Tail, Tail]:
    """The truncations on the left, mirrored, and on the right, both beyond `far`."""
    return _tail(drift, lam, far, digits, -1), _tail(drift, lam, far, digits, 1)


def _tail(drift: Drift, lam: fmpq, far: fmpq, digits: int, side: int) -> Tail:
    model: Any = drift.model
    values = {n: rational(x) for n, x in drift.scalars().items()}
    phi, sigma = profile(model.pieces[-1 if side > 0 else 0], values), arb(1)
    places = [far, fmpq(1), *(abs(rational(x)) for x in model.cuts)]
    weight, degree = 2 - 2 * model.alpha, 0
    if model.noise:
        noise = profile(model.noise, values)
        sigma = abs(noise(_LINE))
        if isinstance(noise, Polynomial):
            degree = len(noise.coefficients) - 1
            places.append(_beyond(noise.coefficients))
            sigma = abs(arb(noise.coefficients[-1]))
    q = weight * degree
    known = sigma > 0 and (not degree or q > 1)
    if isinstance(phi, Polynomial):
        places.append(_beyond(phi.coefficients))
    else:
        known = False
    begin = 2 * max(places)
    slope = arb(phi(arb(side * begin))) * -side
    if not (known and sigma < _BOUNDED and slope > 0):
        raise RegionError(
            f"no stationary state of {drift!r} is known; without a layer A must be a polynomial "
            "that leads inwards and the noise bounded or a polynomial: else give two ends."
        )
    if degree:
        room = max(places) * fmpq(10) ** math.ceil((digits + 3) / (q - 1))
        power = arb(room) ** arb(rational(1 - q)) * sigma ** arb(rational(-weight))
        return Tail(begin + room, power / rational(q - 1))
    most, steep = sigma.lower() ** arb(rational(-weight)), lam / sigma.upper() ** 2
    wanted = (digits * _LOG10 + 6) / steep
    room = rational(Fraction(float((wanted / slope).upper())))
    # As |phi| does not decrease, V(x) - V(x - h) is at least |phi(x - h)| h.
    while abs(phi(arb(side * (begin + room / 4)))) * (room / 4) > wanted:
        room /= 2
    x = begin + room
    return Tail(x, most / (steep * abs(phi(arb(side * x)))))


def _beyond(coefficients: list[fmpq]) -> Any:
    """Cauchy's bound of the moduli of a polynomial's zeros."""
    *others, last = (abs(arb(c)) for c in coefficients)
    bound = 1 + max((float((c / last).upper()) for c in others), default=0.0)
    return rational(Fraction(bound))
