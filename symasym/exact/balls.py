"""T, C, P and the stationary density in balls with proved radii, to any number of digits.

With lam = 2/kappa^2, e = e^{lam V} and V' = -phi, the mean escape time and the exit probability
follow from y'' + lam phi y' = s lam y to first order in s, written as the system (Feller 1952)

    y' = e F,    F' = s lam y/e.

From an end of the scene to x the engine carries eta = y/e and zeta = F, power series in s with
positive coefficients. The initial state (y, F) is (0, 1) at an absorbing end and (1, 0) at a
reflecting one. From an absorbing end zeta = 1 + s lam Q + O(s^2) and, at s = 0,

    eta' = 1 + lam phi eta,    Q' = eta:

eta is the scale function divided by e. With the values from both ends L and R at the start,

    T = lam (Q_L eta_R + Q_R eta_L)/(eta_L + eta_R),    C = eta_R/(eta_L + eta_R),

where all terms are positive, so that nothing cancels. Replacing phi by -phi and interchanging scale
and speed density turns eta into the speed measure left of x over its density: hence
p_ss(x) = 1/(eta_L + eta_R), and P.

A panel of the interval acts by the matrix of (y, F) across it: to first order in s three integrals
of e and 1/e, and e at its end (`first_order`); for the moments E[tau^k] power series in s
(`transform`).

Numbers may be complex balls at first order, as the complex step of `symasym.sensitivity` needs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import reduce
from typing import Any, NamedTuple

from flint import arb, fmpq

from symasym.base.balls import extra_bits, precision, rational
from symasym.base.errors import AccuracyError, RegionError
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Piece, Polynomial, pieces, profile
from symasym.drift.scenes import Answer, Request, Scene, ends_of, require_sliding
from symasym.exact import transform
from symasym.exact.first_order import Record, records
from symasym.exact.panels import largest_exponent, panel_of, panels

_MOST_BITS, _MOST_OF_MOMENTS = 20_000, 1_500  # beyond those that the digits need
_LINE, _BOUNDED = arb(0, 1e300), 1e9  # the declared domain


class State(NamedTuple):
    """`eta` at s = 0, and the coefficients of `zeta` to first order in s.

    From an absorbing end `zeta` is (1, lam Q).
    """

    eta: Any
    zeta: tuple[Any, Any]


#: (y, F) = (0, 1) at an absorbing end.
ABSORBING = State(arb(0), (arb(1), arb(0)))
#: (y, F) = (1, 0) at a reflecting end.
REFLECTING = State(arb(1), (arb(0), arb(0)))


def carried(state: State, p: Record) -> State:
    """The state after a panel."""
    eta, (zeta, slope) = state
    return State((eta + p.y2 * zeta) * p.inverse, (zeta, slope + p.z1 * eta + p.z2 * zeta))


class Engine(NamedTuple):
    """Sweeps over a drift, with panels for so many digits.

    Numbers may be complex balls if the noise does not depend on u.
    """

    drift: Sequence[Piece]
    lam: Any
    digits: int

    def mirrored(self) -> Engine:
        """The engine of -phi(-u) and sigma(-u)."""
        return self._replace(drift=transform.mirrored(self.drift))

    def records(
        self, begin: fmpq, end: fmpq, state: State = ABSORBING, order: int = 0
    ) -> list[Record]:
        """The panels' records from `begin`, with that state, to `end`, to an order of s up to 1."""
        found = panels(self.drift, self.lam, begin, end, self.digits, panel_of)
        if state.zeta[0] == 0:  # It remains 0, so that its factors change no digit.
            found = [p._replace(bounds=(-math.inf, p.bounds[1], -math.inf)) for p in found]
        return records(found, self.lam, state.eta, self.digits, order)

    def swept(self, begin: fmpq, end: fmpq, state: State = ABSORBING, order: int = 0) -> State:
        """The state at `end` from that at `begin`; to order 0 only eta is right."""
        return reduce(carried, self.records(begin, end, state, order), state)

    def sides(
        self, ends: tuple[fmpq, fmpq], start: fmpq, order: int = 1, reflecting: str | None = None
    ) -> tuple[State, State]:
        """The states at the start from the left end and, in mirrored coordinates, from the right.

        Notes
        -----
        With eta and w = `zeta[1]` = lam Q from both ends L and R,

            dT/dstart = (T - w_L)/eta_L,    dC/dstart = -1/(eta_L + eta_R).

        The derivative by an end solves the homogeneous equation and equals minus the slope there:
        with sweeps of the whole interval, L from -r and R back from r,

            dT/dr = (1 - C) w_L/eta_L + C w_R/eta_R,    dC/dr = (1 - C)/eta_L - C/eta_R.
        """
        first, last = (
            REFLECTING if reflecting == side else ABSORBING for side in ("left", "right")
        )
        right = self.mirrored().swept(-ends[1], -start, last, order)
        return self.swept(ends[0], start, first, order), right

    def moment(
        self, ends: tuple[fmpq, fmpq], start: fmpq, order: int, reflecting: str | None
    ) -> Any:
        """E[tau^order]."""
        found = [
            transform.matrices(way, self.lam, begin, end, self.digits, order)
            for way, begin, end in transform.ways(self.drift, ends, start)
        ]
        reflects = [reflecting == side for side in ("left", "right")]
        return transform.moments(found, reflects, order)[order] * arb(order).fac()

    def stationary(self, numbers: Mapping[str, fmpq], outside: Any) -> Any:
        """p_ss(y) (eq:pss), or the speed measure inside and outside (eq:P): sweeps with -phi."""
        back = self._replace(drift=[p.reversed() for p in self.drift])
        ahead, (first, last) = back.mirrored(), (self.drift[0].left, self.drift[-1].right)
        if outside is None:
            outside = [_beside(side.drift[0], self.lam) for side in (back, ahead)]
        tails = [State(mass, ABSORBING.zeta) for mass in outside]
        low, high = (
            numbers.get("y", numbers.get(end, fmpq(side)))
            for end, side in (("low", -1), ("high", 1))
        )
        left = back.swept(first, low, tails[0]).eta
        right = ahead.swept(-last, -high, tails[1]).eta
        if "y" in numbers:
            here = next(p for p in back.drift if p.left <= low <= p.right).scale
            return (1 if here is None else here(arb(low))) / (left + right)
        inside = ABSORBING.eta
        for p in back.records(low, high):
            inside, left = (inside + p.y2) * p.inverse, left * p.inverse
        return inside, left + right


# -- what is asked for -----------------------------------------------------------------------------


def span(numbers: Mapping[str, fmpq]) -> tuple[fmpq, fmpq]:
    """The interval on which a quantity needs the drift."""
    if "r" in numbers or "left" in numbers:
        return ends_of(numbers)
    places = [numbers[key] for key in ("y", "low", "high") if key in numbers]
    return min(*places, fmpq(-1), fmpq(1)) - 1, max(*places, fmpq(-1), fmpq(1)) + 1


def enclosure(
    engine: Engine, request: Request, numbers: Mapping[str, fmpq], outside: Any = None
) -> Any:
    """A ball with the quantity or its natural logarithm, within `precision(bits(digits))` or more.

    The engine's drift is given on the interval `span`; it may have complex balls as coefficients if
    the noise is constant. `outside` is the speed measure left and right of it, over the density 1/e
    at its ends; by default that of a constant drift. The accuracy attained is the ball's.
    """
    name, reflecting = request.name, request.reflecting
    if request.stationary:
        found = engine.stationary(numbers, outside)
        if name == "p_ss":
            return found.log() if request.log else found
        wanted, rest = found if name == "P" else found[::-1]
    else:
        scene = ends_of(numbers), numbers["start"]
        if name == "T":
            if request.moment > 1:
                value = engine.moment(*scene, request.moment, reflecting)
            else:
                (eta, zeta), (other, of_other) = engine.sides(*scene, 1, reflecting)
                value = zeta[1] * other + of_other[1] * eta
                value /= zeta[0] * other + of_other[0] * eta
            return value.log() if request.log else value
        left, right = engine.sides(*scene, 0)
        wanted, rest = (left.eta, right.eta) if name == "1 - C" else (right.eta, left.eta)
    return -(rest / wanted).log1p() if request.log else wanted / (wanted + rest)


def _beside(piece: Piece, lam: Any) -> Any:
    """The mass of a first piece that extends to -infinity with constant drift and noise."""
    weight = 1 if piece.scale is None else piece.scale(arb(piece.left))
    return -weight / (lam * piece.phi(arb(piece.left)))


def bits(digits: int, more: int = 0) -> int:
    """Bits for so many digits and `more`; a moderate panel loses a factor of up to e^{2 reach}."""
    return math.ceil(digits * 3.322) + int(3 * largest_exponent(digits)) + 30 + more


def of_scene(scene: Scene, request: Request) -> Answer:
    """The value to the request's digits, or its natural logarithm.

    The logarithm is right to so many digits of its own, or to twice as many places where it nearly
    vanishes.
    """
    numbers = {name: rational(x) for name, x in scene.numbers.items()}
    lam, digits = rational(scene.lam), request.digits + 3
    line = request.stationary and "left" not in numbers
    low, high = span(numbers)
    far = max(-low, high)
    outside = (arb(0), arb(0)) if "left" in numbers else None
    if line and scene.drift.model.layered:
        require_sliding(scene.drift)
    # The absolute error of lam V, which is of order lam times the length, is a relative one of e.
    guard = bits_of_way(lam, max(abs(low), abs(high)))
    most = _MOST_BITS if request.moment == 1 else _MOST_OF_MOMENTS
    for more in extra_bits(most):
        working = digits + 4 + more // 8
        with precision(bits(working, guard + more)):
            if line and not scene.drift.model.layered:
                (x, left), (high, right) = (
                    _tail(scene.drift, lam, far, working, side) for side in (-1, 1)
                )
                low, outside = -x, (left.union(arb(0)), right.union(arb(0)))
            engine = Engine(pieces(scene.drift, low, high), arb(lam), working)
            ball = enclosure(engine, request, numbers, outside)
            right = ball.rel_accuracy_bits() > digits * 3.322 + 1
            if right or (request.log and ball.rad() < arb(10) ** (-2 * digits)):
                return Answer(ball, "bound")
    given = ", ".join(f"{name} = {float_text(x)}" for name, x in scene.numbers.items())
    raise AccuracyError(
        f"{given} and the drift leave fewer than {request.digits} digits of {request.name} right "
        f"in {most} bits; ask for fewer digits, or rescale the problem."
    )


def bits_of_way(lam: fmpq, far: fmpq) -> int:
    """Bits before the binary point of lam V, with |phi| of order 1 as far as `far`."""
    x = lam * far
    return max(0, int(x.p).bit_length() - int(x.q).bit_length())


def _tail(drift: Drift, lam: fmpq, far: fmpq, digits: int, side: int) -> tuple[fmpq, arb]:
    """A truncation of the line beyond `far` right (`side` 1) or left, mirrored, of the start, and a
    bound of the speed measure beyond, over 1/e there.

    Let phi be a polynomial, the noise sigma bounded or a polynomial, and R right of all their
    zeros, so that |phi| does not decrease there. If phi < 0, that measure beyond X is below

        S^2 m^(2 alpha - 2)/(lam |phi(X)|)    for noise with m < sigma < S on the line, or
        c^(2 alpha - 2) (X - R)^(1 - q)/(q - 1)    with q = (2 - 2 alpha) k > 1

    for a polynomial sigma of degree k with the leading coefficient c.
    """
    model: Any = drift.model
    values = {n: rational(x) for n, x in drift.scalars().items()}
    phi: Any = profile(model.pieces[-1 if side > 0 else 0], values)
    places = [far, fmpq(1), *(abs(rational(x)) for x in model.cuts)]
    weight, degree, sigma = 2 - 2 * model.alpha, 0, arb(1)
    if model.noise:
        noise = profile(model.noise, values)
        sigma = abs(noise(_LINE))
        if isinstance(noise, Polynomial):
            degree = len(noise.coefficients) - 1
            places.append(_beyond(noise.coefficients))
            sigma = abs(arb(noise.coefficients[-1]))
    q, known = weight * degree, isinstance(phi, Polynomial)
    if known:
        places.append(_beyond(phi.coefficients))
    begin = 2 * max(places)
    slope = arb(phi(arb(side * begin))) * -side
    if not (known and 0 < sigma < _BOUNDED and (not degree or q > 1) and slope > 0):
        raise RegionError(
            f"no stationary state of {drift!r} is known; without a layer A must be a polynomial "
            "that leads inwards and the noise bounded or a polynomial: else give two ends."
        )
    if degree:
        room = max(places) * fmpq(10) ** math.ceil((digits + 3) / (q - 1))
        power = arb(room) ** arb(rational(1 - q)) * sigma ** arb(rational(-weight))
        return begin + room, power / rational(q - 1)
    most, steep = sigma.lower() ** arb(rational(-weight)), lam / sigma.upper() ** 2
    wanted = (digits * math.log(10) + 6) / steep
    room = rational(Fraction(float((wanted / slope).upper())))
    # As |phi| does not decrease, V(x) - V(x - h) is at least |phi(x - h)| h.
    while abs(phi(arb(side * (begin + room / 4)))) * (room / 4) > wanted:
        room /= 2
    x = begin + room
    return x, most / (steep * abs(phi(arb(side * x))))


def _beyond(coefficients: list[fmpq]) -> Any:
    """Cauchy's bound of the moduli of a polynomial's zeros."""
    *others, last = (abs(arb(c)) for c in coefficients)
    bound = 1 + max((float((c / last).upper()) for c in others), default=0.0)
    return rational(Fraction(bound))
