"""The paper's own leading-order formulas, as derived, in balls (``method="paper"``).

T is eq:Ttildesmall with the step eq:S, which is eq:Ttildelarge where there is no well; C the bound
of section 6.2 (C-bound); P the leading term of eq:Plarge2 where that is below 1, else the lower
bound behind eq:Psmall2 (L-bound) with the largest L that the drift allows. None but the bounds
claims an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from flint import arb

from symasym.base.errors import AccuracyError, InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.expansions.balls import LINE, Field, Unresolved
from symasym.generated import formulas
from symasym.numbers.balls import BallContext, exact_ball, precision, to_mpf
from symasym.scenes import (
    Answer,
    Request,
    Scene,
    exponent_bits,
)

_EXIT_TERMS = ("eq:C, C-bound",)
_EXIT_NOTE = ("C lies between 0 and the value",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P of one scene, as the paper has it; its assumptions are checked."""
    value, kind = _value(scene, request)
    with precision(int(3.4 * request.digits) + 64):
        whole = 1 - value if request.complement and request.name[-1] == "P" else value
        log, name = request.log, request.name[-1]
        # Log C and log(1 - P) have no lower bound.
        kind = "none" if log and (name == "C" or request.complement) else kind
        error = value if name == "C" else -value.log() if log else 1 - value
        shown, error = (
            to_mpf(x, request.digits + 10)[0] for x in (whole.log() if log else whole, error)
        )
        if kind == "none":
            return Answer(shown, None, kind, *((_EXIT_TERMS, _EXIT_NOTE) if name == "C" else ()))
        if name == "C":
            # Between 0 and twice the value, whatever that was rounded to.
            return Answer(shown, error, kind, _EXIT_TERMS, _EXIT_NOTE)
        return Answer(
            shown, error + (1 + abs(shown)) * error.context.mpf(10) ** -(request.digits + 5), kind
        )


class _Formulas(BallContext):
    """What the derived formulas ask of their context."""

    pi = property(lambda self: arb.pi())
    sqrt = staticmethod(lambda x: x.sqrt())


_BALLS = _Formulas()


class _Simple(Field):
    """A field whose multiple zeros are left out, which are no turning points of V, or refused."""

    def _zeros(self, edges: set[Fraction]) -> Iterator[tuple[Any, str]]:
        known = self._of_polynomial if self.exact is not None else self._of_any
        yield from ((u, kind) for u, kind, simple in known if simple and abs(u) < 1)


class _Seen(NamedTuple):
    """A drift, perhaps in the mirror: phi(-1), phi(1), each zero with its kind and slope, V."""

    low: Any
    high: Any
    zeros: list[tuple[Any, str, Any]]
    potential: Any


@lru_cache(maxsize=64)
def _seen(drift: Drift, mirrored: bool, bits: int) -> _Seen:
    """The drift at flint's precision, which has as many bits."""
    field, sign = _Simple(drift, *LINE), -1 if mirrored else 1
    zeros = [(sign * u, kind, field.taylor(u, 2)[1]) for u, kind in field.zeros][::sign]
    low, high = (sign * field.a[sign * side] for side in (-1, 1))
    return _Seen(low, high, zeros, lambda u: field.potential(sign * u))


def _value(scene: Scene, request: Request) -> tuple[Any, ErrorKind]:
    """The value, a ball good to some more digits than are asked for, and the kind of its error."""
    of = {"T": _escape_time, "C": _exit_bound, "P": _occupation}[request.name[-1]]
    bits = int(3.4 * request.digits) + 120 + exponent_bits(scene.drift, scene.lam, Fraction(2))
    bits += 64 - bits % 64
    for more in (1, 2, 4, 8, 16):
        with suppress(Unresolved), precision(bits * more):
            found, kind = of(scene, request, bits * more)
            rest = 1 - found if request.name[-1] == "P" else found
            if (
                min(found.rel_accuracy_bits(), rest.rel_accuracy_bits())
                > 3.33 * request.digits + 20
            ):
                return found, kind
    raise AccuracyError(
        "zeros of A, or one and an end, are too close together; rescale the problem."
    )


def well(drift: Drift, bits: int) -> tuple[Any, ...]:
    """The drift ahead; with a barrier beyond the start, A' at the well and there, and V's rise."""
    a_minus, a_plus = drift.ends
    if a_minus * a_plus <= 0:
        raise RegionError(
            f"a- = {float_text(Fraction(a_minus))} and a+ = {float_text(Fraction(a_plus))} are no "
            "crossing region, where the paper gives no escape time; use method='exact'."
        )
    seen = _seen(drift, a_plus < 0, bits)
    if [kind for _, kind, _ in seen.zeros] not in ([], ["well", "barrier"]):
        raise InputError(
            f"A has {len(seen.zeros)} zeros in (-1, 1), but the paper's formula is for none, or "
            "for one well followed by one barrier; use method='exact'."
        )
    if not seen.zeros or not seen.zeros[1][0] > 0:
        return (seen.high,)
    (u, _, low), (v, _, high) = seen.zeros
    return seen.high, low, high, seen.potential(v) - seen.potential(u)


def _escape_time(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    _require_start_0(scene, "formula is for start 0, use method='exact'.")
    known, r = well(scene.drift, bits), exact_ball(scene.r)
    if len(known) == 1:
        return formulas.strong_noise_time(_BALLS, r, *known), "none"
    kappa = exact_ball(scene.numbers["kappa"])
    return formulas.weak_noise_time(_BALLS, kappa, r, *known), "none"


def _require_start_0(scene: Scene, rest: str) -> None:
    if scene.start != 0:
        raise InputError(f"start is {float_text(scene.start)}; the paper's {rest}")


def _exit_bound(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    """Of C for a drift to the right, and mirrored of 1 - C for one to the left.

    What the derivation ``C-bound`` needs is checked: start 0, r >= 4, V <= a- r/4 on [0, 1] and
    e^{3 a- r/(2 kappa^2)} >= 4.
    """
    _require_start_0(scene, "bound is for start 0, use method='bound' or 'exact'.")
    r, kappa = scene.r, exact_ball(scene.numbers["kappa"])
    if not all(a < 0 if request.complement else a > 0 for a in scene.drift.ends):
        name, sign = ("1 - C", "negative") if request.complement else ("C", "positive")
        low, high = (float_text(Fraction(a)) for a in scene.drift.ends)
        raise RegionError(
            f"a- = {low} and a+ = {high} are not both {sign}, where alone the paper bounds "
            f"{name}; use method='bound' or 'exact'."
        )
    if r < 4:
        raise InputError(
            f"r is {float_text(r)}; the paper's bound is for r of at least 4, use "
            "method='bound' or 'exact'."
        )
    seen, radius = _seen(scene.drift, request.complement, bits), exact_ball(r)
    # V is highest at an end of [0, 1], or at a barrier.
    tops = [arb(0), arb(1), *(u for u, kind, _ in seen.zeros if kind == "barrier" and u > 0)]
    top = max((seen.potential(u) - seen.potential(arb(-1)) for u in tops), key=float)
    if not top <= seen.low * radius / 4:
        raise InputError(
            f"V reaches {float(top):.6g} between the start and the layer's edge, more than "
            f"a- r/4 = {float(seen.low * radius / 4):.6g}, where the paper's bound may "
            "fail; use a larger r, or method='bound' or 'exact'."
        )
    if not (3 * seen.low * radius / (2 * kappa**2)).exp() >= 4:
        raise InputError(
            f"kappa is {scene.noise}, so that exp(3 a- r/(2 kappa^2)) is below 4, where "
            "the paper's bound may fail; use method='bound' or 'exact'."
        )
    value = formulas.exit_bound(_BALLS, kappa, radius, seen.low, seen.high)
    return value, "bound"


def _occupation(scene: Scene, request: Request, bits: int) -> tuple[Any, ErrorKind]:
    seen, kappa = _seen(scene.drift, False, bits), exact_ball(scene.numbers["kappa"])
    share: Any = formulas.strong_noise_occupation(_BALLS, kappa, seen.low, seen.high)
    if share < 1:
        return share, "none"
    if seen.potential(arb(1)) > seen.potential(arb(-1)):
        seen = _seen(scene.drift, True, bits)
    top, left = seen.potential(arb(1)), arb(-1)
    # V stays below V(1) from the last place where it is as high: behind the last peak above, or -1.
    for u, kind, _ in seen.zeros:
        if kind == "barrier" and seen.potential(u) > top:
            left = u
    if seen.potential(left) > top:
        right = next(u for u, kind, _ in seen.zeros if kind == "well" and u > left)
        for _ in range(int(3.4 * request.digits) + 30):
            middle = ((left + right) / 2).mid()
            left, right = (middle, right) if seen.potential(middle) > top else (left, middle)
        left = right
    rise = top - seen.potential(arb(-1))
    share = formulas.occupation_bound(_BALLS, kappa, seen.low, seen.high, 1 - left, rise)
    # That A has no other zeros is known of polynomials.
    return share, "bound" if scene.drift.exact_coefficients() is not None else "estimate"
