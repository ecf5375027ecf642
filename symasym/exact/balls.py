"""T, C, P and the stationary density in balls with proved radii, to any number of digits.

With lam = 2/kappa^2 and e = e^{lam V}, V' = -phi, the mean escape time and the exit probability are
made of the solutions of y'' + lam phi y' = s y to first order in s, as the system (Feller 1952)

    y' = e F,    F' = s lam y/e.

From an end of the scene to x are carried eta = y/e and zeta = F, power series in s with positive
coefficients. An end is a starting state (y, F): absorbing (0, 1), reflecting (1, 0). From an
absorbing end eta(0) = sigma and zeta = 1 + s lam Q, where sigma' = 1 + lam phi sigma, Q' = sigma.
With those from both ends at the start, and no terms that cancel,

    T = lam (Q_L sigma_R + Q_R sigma_L)/(sigma_L + sigma_R),    C = sigma_R/(sigma_L + sigma_R).

With -phi in place of phi, sigma is the time spent to the left of x, up to a factor: of these are
p_ss(x) = 1/(sigma_L + sigma_R) and P.

A panel of an interval is the matrix of (y, F) across it: to first order in s three integrals of e
and 1/e, and e where it ends (`first_order`), else power series in s (`transform`), in which noise
that depends on u and moments E[tau^k] are answered as well.

Numbers may be complex balls at first order, of which `symasym.sensitivity` makes derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from flint import arb, fmpq

from symasym.base.balls import precision
from symasym.base.errors import AccuracyError
from symasym.base.inputs import float_text
from symasym.drift.evaluate import Piece, pieces
from symasym.drift.formula import rational
from symasym.drift.scenes import Answer, Request, Scene
from symasym.exact import stationary, transform
from symasym.exact.first_order import Record, records
from symasym.exact.panels import largest_exponent, panels

_MOST_BITS, _MOST_OF_MOMENTS = 20_000, 1_500  # beyond those that the digits take


class State(NamedTuple):
    """What is carried from an end: `eta` at s = 0, and `zeta` to first order in s.

    From an absorbing end they are sigma and (1, lam Q).
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

    `order` is that of s: 1, or 0 where only eta is asked for. Numbers may be complex balls where
    sigma is 1.
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
    if all(p.scale is p.speed is None for p in drift):
        found = panels(drift, lam, begin, end, digits)
        if state.zeta[0] == 0:  # and stays so: what it is multiplied by changes no digit
            found = [p._replace(bounds=(-math.inf, p.bounds[1], -math.inf)) for p in found]
        return records(found, lam, state.eta, digits, order)
    found = transform.matrices(drift, lam, begin, end, digits, order)
    return [Record(p.y2[0], p.z1[1], p.z2[1], p.inverse) for p in found]


def mirrored(drift: Sequence[Piece]) -> list[Piece]:
    """Of -phi(-u) and sigma(-u)."""
    return [p.mirrored() for p in reversed(drift)]


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
    With sigma = `eta` and w = lam Q = `zeta[1]` of both sides L and R,

        dT/dstart = (T - w_L)/sigma_L,    dC/dstart = -1/(sigma_L + sigma_R).

    A derivative by an end solves the equation without a source, and is there minus the slope: with
    sweeps of the whole interval from -r to r, L from -r and R back,

        dT/dr = (1 - C) w_L/sigma_L + C w_R/sigma_R,    dC/dr = (1 - C)/sigma_L - C/sigma_R.
    """
    left, right = (REFLECTING if reflecting == side else ABSORBING for side in ("left", "right"))
    back = mirrored(drift)
    return (
        swept(drift, lam, ends[0], start, digits, left, order),
        swept(back, lam, -ends[1], -start, digits, right, order),
    )


# -- what is asked for -----------------------------------------------------------------------------


def span(name: str, numbers: Mapping[str, fmpq]) -> tuple[fmpq, fmpq]:
    """From where to where a quantity needs a drift with a layer, or one between two ends."""
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

    Parameters
    ----------
    name : str
        One of `symasym.drift.scenes.QUANTITIES`, or "p_ss".
    drift : sequence of Piece
        As far as `span` says; coefficients may be complex balls where sigma is 1.
    lam : arb or acb
    numbers : mapping of str to fmpq
        Those of the quantity.
    digits : int
        For which the panels are chosen; the ball tells what is right.
    log : bool
    moment : int
    reflecting : {"left", "right"}, optional
    outside : pair of arb, optional
        The masses left and right of the pieces, in units of that at their ends; without it they
        are those of a constant drift.
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
    """p_ss(y) (eq:pss), or what P and 1 - P (eq:P) are in proportion to: sweeps with 1/e for e."""
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
    """The mass of a first piece on which all is constant and which has no end on the left."""
    weight = 1 if piece.scale is None else piece.scale(arb(piece.left))
    return -weight / (lam * piece.phi(arb(piece.left)))


def bits(digits: int, more: int = 0) -> int:
    """A precision for so many digits, a moderate panel losing up to e^{2 reach}, and `more`."""
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
    # Rounding of lam V, which may reach lam times the way, is taken off the digits.
    guard, more = bits_of_way(lam, max(abs(low), abs(high))), 0
    most = _MOST_BITS if request.moment == 1 else _MOST_OF_MOMENTS
    while more < most:
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
        more = 2 * more + 60
    given = ", ".join(f"{name} = {float_text(x)}" for name, x in scene.numbers.items())
    raise AccuracyError(
        f"{given} and the drift leave fewer than {request.digits} digits of {request.name} right "
        f"in {most} bits; ask for fewer digits, or rescale the problem."
    )


def bits_of_way(lam: fmpq, far: fmpq) -> int:
    """Bits before the point of lam V, at most, where |phi| is of order 1 as far as `far`."""
    x = lam * far
    return max(0, int(x.p).bit_length() - int(x.q).bit_length())
