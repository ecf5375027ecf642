"""The paper's own leading-order formulas in balls (``method="paper"``).

With lam = 2/kappa^2, a well u1 and a barrier u2 behind it, the drift to the right, start 0:

    T ~ r/a+ + S 2 pi/sqrt(-A'(u1) A'(u2)) e^{lam (V(u2) - V(u1))}     eq:Ttildesmall
    C <= 2 a- (1/a+ + lam) e^{-a- r/kappa^2}                           C-bound
    P ~ 4/(kappa^2 (1/a- - 1/a+))                                      eq:Plarge2
    P >= 1/(1 + (e^{lam (V(1) - V(-1))}/a- - 1/a+)/(lam L))            L-bound

S, eq:S, is 1 for 0 < u2 and 0 elsewhere, which leaves eq:Ttildelarge. P is its leading term where
that is below 1, else the lower bound behind eq:Psmall2 with the largest L that the drift allows:
V is below V(1) on [1 - L, 1]. None but the bounds claims an error.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from flint import arb

from symasym.base.balls import exact_ball, precision, to_mpf
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.drift.scenes import Answer, Request, Scene, exponent_bits
from symasym.expansions.balls import doubled
from symasym.expansions.field import LINE, Field

_EXIT = ("eq:C, C-bound",), ("C lies between 0 and the value",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P of one scene, as the paper has it; its assumptions are checked."""
    name, digits, kinds = request.name[-1], request.digits, list[ErrorKind]()
    if name != "P" and scene.start != 0:
        raise InputError(
            f"start is {float_text(scene.start)}; the paper's formula is for start 0, use "
            "method='exact'."
        )

    def found(bits: int) -> Any:
        of = {"T": _escape_time, "C": _exit_bound, "P": _occupation}[name]
        value, kind = of(scene, request, bits)
        kinds.append(kind)
        return value, 1 - value if name == "P" else value

    bits = int(3.4 * digits) + 120 + exponent_bits(scene.drift, scene.lam, Fraction(2))
    value, other = doubled(found, bits - bits % -64, digits + 6)
    with precision(int(3.4 * digits) + 64):
        # C and 1 - P are between 0 and twice the value, log P between the value and 0.
        value, error, kind = other if request.name == "1 - P" else value, other, kinds[-1]
        if request.log:
            value, error = value.log(), -value.log()
            kind = "none" if name == "C" or request.complement else kind
        error += abs(value) / arb(10) ** (digits + 5) + arb(10) ** -(digits + 5)
        shown, error = (to_mpf(x, digits + 10)[0] for x in (value, error.upper()))
    return Answer(shown, None if kind == "none" else error, kind, *(_EXIT if name == "C" else ()))


class _Seen(NamedTuple):
    """A drift, perhaps in the mirror: phi(-1), phi(1), each zero with its kind and slope, V."""

    low: Any
    high: Any
    zeros: list[tuple[Any, str, Any]]
    potential: Any

    def barriers(self, above: Any) -> list[Any]:
        """The barriers to the right of a place."""
        return [u for u, kind, _ in self.zeros if kind == "barrier" and u > above]


@lru_cache(maxsize=64)
def _seen(drift: Drift, mirrored: bool, bits: int, time: bool = False) -> _Seen:
    """The drift at flint's precision, which has as many bits."""
    field, sign = Field(drift, LINE, time), -1 if mirrored else 1
    zeros = [(sign * u, kind, field.around(u, 2)[0][1]) for u, kind in field.zeros][::sign]
    low, high = (sign * field.ends[sign * side] for side in (-1, 1))
    return _Seen(low, high, zeros, lambda u: field.height(sign * u))


def _escape_time(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    a_minus, a_plus = (Fraction(a) for a in scene.drift.ends)
    if a_minus * a_plus <= 0:
        raise RegionError(
            f"a- = {float_text(a_minus)} and a+ = {float_text(a_plus)} are no crossing region, "
            "where the paper gives no escape time; use method='exact'."
        )
    seen = _seen(scene.drift, a_plus < 0, bits, time=True)
    if [kind for _, kind, _ in seen.zeros] not in ([], ["well", "barrier"]):
        raise InputError(
            f"A has {len(seen.zeros)} zeros in (-1, 1), but the paper's formula is for none, or "
            "for one well followed by one barrier; use method='exact'."
        )
    total = exact_ball(scene.r) / seen.high
    if seen.barriers(0):
        (u, _, low), (v, _, high) = seen.zeros
        rise = seen.potential(v) - seen.potential(u)
        total += 2 * arb.pi() / (-low * high).sqrt() * (exact_ball(scene.lam) * rise).exp()
    return total, "none"


def _exit_bound(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    """Of C for a drift to the right, and mirrored of 1 - C for one to the left.

    What C-bound needs is checked: r >= 4, V <= a- r/4 on [0, 1] and e^{3 a- r/(2 kappa^2)} >= 4.
    """
    r, lam = exact_ball(scene.r), exact_ball(scene.lam)
    if not all(a < 0 if request.complement else a > 0 for a in scene.drift.ends):
        name, sign = ("1 - C", "negative") if request.complement else ("C", "positive")
        low, high = (float_text(Fraction(a)) for a in scene.drift.ends)
        raise RegionError(
            f"a- = {low} and a+ = {high} are not both {sign}, where alone the paper bounds "
            f"{name}; use method='bound' or 'exact'."
        )
    seen = _seen(scene.drift, request.complement, bits)
    # V is highest at an end of [0, 1], or at a barrier.
    tops = (seen.potential(u) for u in (arb(0), arb(1), *seen.barriers(0)))
    top = max(tops, key=float) - seen.potential(arb(-1))
    if not (r >= 4 and top <= seen.low * r / 4 and (3 * seen.low * r * lam / 4).exp() >= 4):
        raise InputError(
            f"r is {float_text(scene.r)} and kappa is {scene.noise}; the paper's bound needs r of "
            f"at least 4, V <= a- r/4 on [0, 1], where it reaches {float(top):.6g}, and "
            "exp(3 a- r/(2 kappa^2)) of at least 4; use method='bound' or 'exact'."
        )
    return 2 * seen.low * (1 / seen.high + lam) * (-seen.low * r * lam / 2).exp(), "bound"


def _occupation(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    seen, lam = _seen(scene.drift, False, bits), exact_ball(scene.lam)
    share = 2 * lam / (1 / seen.low - 1 / seen.high)
    if share < 1:
        return share, "none"
    if seen.potential(arb(1)) > seen.potential(arb(-1)):
        seen = _seen(scene.drift, True, bits)
    # V stays below V(1) from the last place where it is as high: behind the last peak above, or -1.
    top = seen.potential(arb(1))
    left = ([arb(-1)] + [u for u in seen.barriers(-1) if seen.potential(u) > top])[-1]
    if seen.potential(left) > top:
        right = next(u for u, kind, _ in seen.zeros if kind == "well" and u > left)
        for _ in range(int(3.4 * request.digits) + 30):
            middle = ((left + right) / 2).mid()
            left, right = (middle, right) if seen.potential(middle) > top else (left, middle)
        left = right
    rise = (lam * (top - seen.potential(arb(-1)))).exp()
    share = 1 / (1 + (rise / seen.low - 1 / seen.high) / (lam * (1 - left)))
    # That A has no other zeros is known of polynomials.
    return share, "bound" if scene.drift.exact_coefficients() is not None else "estimate"
