"""The paper's leading-order formulas in ball arithmetic (``method="paper"``).

For lam = 2/kappa^2, a well u1 < u2 and a barrier u2, a drift to the right and the start 0:

    T ~ r/a+ + S 2 pi/sqrt(-A'(u1) A'(u2)) e^{lam (V(u2) - V(u1))}     eq:Ttildesmall
    C <= 2 a- (1/a+ + lam) e^{-a- r/kappa^2}                           C-bound
    P ~ 4/(kappa^2 (1/a- - 1/a+))                                      eq:Plarge2
    P >= 1/(1 + (e^{lam (V(1) - V(-1))}/a- - 1/a+)/(lam L))            L-bound

S (eq:S) is 1 if 0 < u2 and 0 otherwise, which leaves eq:Ttildelarge. P is the leading term of
eq:Plarge2 if that is below 1, else the lower bound from which eq:Psmall2 follows, with the largest
L such that V <= V(1) on [1 - L, 1]. Errors are claimed only for the bounds.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any

from flint import arb, fmpq

from symasym.base.balls import doubled, precision, rational
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.drift.scenes import Answer, Request, Scene
from symasym.exact.balls import bits_of_way
from symasym.expansions.ball_drift import LINE, BallDrift


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P of one scene by the paper's formula, whose assumptions are checked."""
    name, digits, kinds = request.name[-1], request.digits, list[ErrorKind]()
    if name != "P" and scene.start != 0:
        raise InputError(
            f"start is {float_text(scene.start)}; the paper's formula is for start 0, use "
            "method 'exact'."
        )

    def found(bits: int) -> Any:
        of = {"T": _escape_time, "C": _exit_bound, "P": _occupation}[name]
        value, kind = of(scene, request, bits)
        kinds.append(kind)
        return value, 1 - value if name == "P" else value

    bits = int(3.4 * digits) + 136 + bits_of_way(rational(scene.lam), fmpq(2))
    value, other = doubled(found, bits - bits % -64, digits + 6)
    with precision(int(3.4 * digits) + 64):
        # The error is the distance to the other end of the proved interval for C, P or log P.
        value, error, kind = other if request.name == "1 - P" else value, other, kinds[-1]
        if request.log:
            value, error = value.log(), -value.log()
            kind = "none" if name == "C" or request.complement else kind
        error += (request.log + abs(value)) / arb(10) ** (digits + 5)
        value += arb(0, error.upper())
    return Answer(value, kind)


@lru_cache(maxsize=64)
def _seen(drift: Drift, mirrored: bool, bits: int, time: bool = False) -> tuple[Any, ...]:
    """phi(-1), phi(1), the wells, the barriers and V for flint's current precision of `bits`.

    A well or a barrier is a pair of its position and A' there; `mirrored` reflects u to -u.
    """
    field, sign = BallDrift(drift, LINE, time), -1 if mirrored else 1
    low, high = (sign * field.ends[sign * side] for side in (-1, 1))
    zeros = [(kind, (sign * u, field.around(u, 2)[0][1])) for u, kind in field.zeros][::sign]
    wells, barriers = ([at for kind, at in zeros if kind == k] for k in ("well", "barrier"))
    return low, high, wells, barriers, lambda u: field.height(sign * u)


def _escape_time(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    a_minus, a_plus = (Fraction(a) for a in scene.drift.ends)
    if a_minus * a_plus <= 0:
        raise RegionError(
            f"a- = {float_text(a_minus)} and a+ = {float_text(a_plus)} are not those of a crossing "
            "region, to which the paper's escape time is limited; use method 'exact'."
        )
    _, ahead, wells, barriers, V = _seen(scene.drift, a_plus < 0, bits, time=True)
    if (len(wells), len(barriers)) not in ((0, 0), (1, 1)):
        raise InputError(
            f"A has {len(wells + barriers)} zeros in (-1, 1), but the paper's formula is for none, "
            "or for one well followed by one barrier; use method 'exact'."
        )
    total = arb(rational(scene.ends[1])) / ahead
    for (u, low), (v, high) in zip(wells, barriers, strict=True):
        if v > 0:
            rise = arb(rational(scene.lam)) * (V(v) - V(u))
            total += 2 * arb.pi() / (-low * high).sqrt() * rise.exp()
    return total, "none"


def _exit_bound(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    """The bound on C for a drift to the right, and by reflection on 1 - C for one to the left.

    The assumptions are checked: r >= 4, V <= a- r/4 on [0, 1] and e^{3 a- r/(2 kappa^2)} >= 4.
    """
    r, lam = arb(rational(scene.ends[1])), arb(rational(scene.lam))
    if not all(a < 0 if request.complement else a > 0 for a in scene.drift.ends):
        name, sign = ("1 - C", "negative") if request.complement else ("C", "positive")
        low, high = (float_text(Fraction(a)) for a in scene.drift.ends)
        raise RegionError(
            f"a- = {low} and a+ = {high} are not both {sign}, where alone the paper bounds "
            f"{name}; use method 'bound' or 'exact'."
        )
    low, high, _, barriers, V = _seen(scene.drift, request.complement, bits)
    # The maximum of V on [0, 1] is at an end or at a barrier.
    places = (arb(0), arb(1), *(u for u, _ in barriers if u > 0))
    top = max((V(u) for u in places), key=float) - V(arb(-1))
    if not (r >= 4 and top <= low * r / 4 and (3 * low * r * lam / 4).exp() >= 4):
        kappa = float_text(scene.numbers["kappa"])
        raise InputError(
            f"r is {float(r):.6g} and kappa is {kappa}; the paper's bound needs r of "
            f"at least 4, V <= a- r/4 on [0, 1], where it reaches {float(top):.6g}, and "
            "exp(3 a- r/(2 kappa^2)) of at least 4; use method 'bound' or 'exact'."
        )
    return 2 * low * (1 / high + lam) * (-low * r * lam / 2).exp(), "bound"


def _occupation(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    (low, high, wells, barriers, V), lam = _seen(scene.drift, False, bits), arb(rational(scene.lam))
    share = 2 * lam / (1 / low - 1 / high)
    if share < 1:
        return share, "none"
    if V(arb(1)) > V(arb(-1)):
        low, high, wells, barriers, V = _seen(scene.drift, True, bits)
    # The last point with V = V(1) lies to the right of the last barrier above V(1); else it is -1.
    top = V(arb(1))
    left = ([arb(-1)] + [u for u, _ in barriers if V(u) > top])[-1]
    if V(left) > top:
        right = next(u for u, _ in wells if u > left)
        for _ in range(int(3.4 * request.digits) + 30):
            middle = ((left + right) / 2).mid()
            left, right = (middle, right) if V(middle) > top else (left, middle)
        left = right
    rise = (lam * (top - V(arb(-1)))).exp()
    share = 1 / (1 + (rise / low - 1 / high) / (lam * (1 - left)))
    # Only for polynomials is it proved that A has no other zeros.
    return share, "bound" if scene.drift.exact_coefficients() is not None else "estimate"
