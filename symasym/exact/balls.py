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
from typing import Any, NamedTuple

from flint import arb, fmpq

from symasym.base.balls import extra_bits, precision
from symasym.base.errors import AccuracyError
from symasym.base.inputs import float_text
from symasym.drift.evaluate import Piece, pieces
from symasym.drift.formula import rational
from symasym.drift.scenes import Answer, Request, Scene
from symasym.exact import stationary, transform
from symasym.exact.first_order import Record, records
from symasym.exact.panels import largest_exponent, panel_of, panels
from symasym.exact.transform import mirrored

_MOST_BITS, _MOST_OF_MOMENTS = 20_000, 1_500  # beyond those that the digits need


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


def swept(
    drift: Sequence[Piece],
    lam: Any,
    begin: fmpq,
    end: fmpq,
    digits: int,
    state: State = ABSORBING,
    order: int = 1,
) -> State:
    """The state at `end` from that at `begin`, with panels for so many digits.

    `order` is that of s: 1, or 0 if only eta is needed. Numbers may be complex balls if the noise
    does not depend on u.
    """
    for p in _records(drift, lam, begin, end, digits, state, order):
        state = carried(state, p)
    return state


def _records(
    drift: Sequence[Piece],
    lam: Any,
    begin: fmpq,
    end: fmpq,
    digits: int,
    state: State,
    order: int,
) -> list[Record]:
    found = panels(drift, lam, begin, end, digits, panel_of)
    if state.zeta[0] == 0:  # It remains 0, so that its factors change no digit.
        found = [p._replace(bounds=(-math.inf, p.bounds[1], -math.inf)) for p in found]
    return records(found, lam, state.eta, digits, order)


def sides(
    drift: Sequence[Piece],
    lam: Any,
    ends: tuple[fmpq, fmpq],
    start: fmpq,
    digits: int,
    order: int = 1,
    reflecting: str | None = None,
) -> tuple[State, State]:
    """The states at the start from the left end and, in mirrored coordinates, from the right.

    Notes
    -----
    With eta and w = `zeta[1]` = lam Q from both ends L and R,

        dT/dstart = (T - w_L)/eta_L,    dC/dstart = -1/(eta_L + eta_R).

    The derivative by an end solves the homogeneous equation and equals minus the slope there: with
    sweeps of the whole interval, L from -r and R back from r,

        dT/dr = (1 - C) w_L/eta_L + C w_R/eta_R,    dC/dr = (1 - C)/eta_L - C/eta_R.
    """
    left, right = (
        swept(way, lam, begin, end, digits, REFLECTING if reflecting == side else ABSORBING, order)
        for side, (way, begin, end) in zip(
            ("left", "right"), transform.ways(drift, ends, start), strict=True
        )
    )
    return left, right


# -- what is asked for -----------------------------------------------------------------------------


def span(name: str, numbers: Mapping[str, fmpq]) -> tuple[fmpq, fmpq]:
    """The interval on which a quantity needs the drift."""
    if "r" in numbers:
        return -numbers["r"], numbers["r"]
    if "left" in numbers:
        return numbers["left"], numbers["right"]
    places = [numbers[key] for key in ("y", "low", "high") if key in numbers]
    return min(*places, fmpq(-1), fmpq(1)) - 1, max(*places, fmpq(-1), fmpq(1)) + 1


def enclosure(
    name: str,
    drift: Sequence[Piece],
    lam: Any,
    numbers: Mapping[str, fmpq],
    digits: int,
    log: bool = False,
    moment: int = 1,
    reflecting: str | None = None,
    outside: tuple[Any, Any] | None = None,
) -> Any:
    """A ball with the quantity or its natural logarithm, within `precision(bits(digits))` or more.

    `drift` is given on the interval `span`; it may have complex balls as coefficients if the noise
    is constant. `outside` is the speed measure left and right of it, over the density 1/e at its
    ends; by default that of a constant drift. The panels are for so many `digits`; the accuracy
    attained is the ball's.
    """
    if name[-1] not in "TC":
        masses = _stationary(drift, lam, numbers, digits, outside)
        if name == "p_ss":
            value = masses
        else:
            wanted, rest = masses if name == "P" else masses[::-1]
    else:
        scene = drift, lam, span(name, numbers), numbers["start"], digits
        if name == "T" and moment > 1:
            value = _moment(*scene, moment, reflecting)
        elif name == "T":
            (eta, zeta), (other, of_other) = sides(*scene, reflecting=reflecting)
            value = zeta[1] * other + of_other[1] * eta
            value /= zeta[0] * other + of_other[0] * eta
        else:
            left, right = sides(*scene, order=0)
            wanted, rest = (left.eta, right.eta) if name == "1 - C" else (right.eta, left.eta)
    if name in ("T", "p_ss"):
        return value.log() if log else value
    return -(rest / wanted).log1p() if log else wanted / (wanted + rest)


def _moment(
    drift: Sequence[Piece],
    lam: Any,
    ends: tuple[fmpq, fmpq],
    start: fmpq,
    digits: int,
    order: int,
    reflecting: str | None,
) -> Any:
    """E[tau^order]."""
    found = [
        transform.matrices(way, lam, begin, end, digits, order)
        for way, begin, end in transform.ways(drift, ends, start)
    ]
    reflects = [reflecting == side for side in ("left", "right")]
    return transform.moments(found, reflects, order)[order] * arb(order).fac()


def _stationary(
    drift: Sequence[Piece], lam: Any, numbers: Mapping[str, fmpq], digits: int, outside: Any
) -> Any:
    """p_ss(y) (eq:pss), or the speed measure inside and outside (eq:P): sweeps with -phi."""
    back = [p.reversed() for p in drift]
    first, last = drift[0].left, drift[-1].right
    if outside is None:
        outside = [_beside(side[0], lam) for side in (back, mirrored(back))]
    tails = [State(mass, ABSORBING.zeta) for mass in outside]
    if "y" in numbers:
        y = numbers["y"]
        left = swept(back, lam, first, y, digits, tails[0], 0).eta
        right = swept(mirrored(back), lam, -last, -y, digits, tails[1], 0).eta
        here = next(p for p in back if p.left <= y <= p.right).scale
        return (1 if here is None else here(arb(y))) / (left + right)
    low, high = numbers.get("low", fmpq(-1)), numbers.get("high", fmpq(1))
    before = swept(back, lam, first, low, digits, tails[0], 0).eta
    inside = ABSORBING.eta
    for p in _records(back, lam, low, high, digits, ABSORBING, 0):
        inside, before = (inside + p.y2) * p.inverse, before * p.inverse
    return inside, before + swept(mirrored(back), lam, -last, -high, digits, tails[1], 0).eta


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
    lam, name, digits = rational(scene.lam), request.name, request.digits + 3
    line = name[-1] not in "TC" and "left" not in numbers
    low, high = places = span(name, numbers)
    outside = (arb(0), arb(0)) if "left" in numbers else None
    # The absolute error of lam V, which is of order lam times the length, is a relative one of e.
    guard = bits_of_way(lam, max(abs(low), abs(high)))
    most = _MOST_BITS if request.moment == 1 else _MOST_OF_MOMENTS
    for more in extra_bits(most):
        working = digits + 4 + more // 8
        with precision(bits(working, guard + more)):
            if line and not scene.drift.model.layered:
                left, right = stationary.tails(
                    scene.drift, lam, max(-places[0], places[1]), working
                )
                low, high = -left.x, right.x
                outside = left.mass.union(arb(0)), right.mass.union(arb(0))
            drift = pieces(scene.drift, low, high)
            ball = enclosure(
                name, drift, arb(lam), numbers, working, request.log,
                request.moment, request.reflecting, outside,
            )  # fmt: skip
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
