"""|T/T_N - 1| <= K kappa^{2N + 2} for all 0 < kappa <= kappa_0, proved (`all_noise`)."""

from __future__ import annotations

import decimal
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from symasym.base.call_context import patient
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import Number, exact, float_text, positive
from symasym.drift.drift import Drift
from symasym.scenes import exact_scene, read_order, require_drift

if TYPE_CHECKING:
    from symasym.asymptotics.proofs.all_noise import Proof

__all__ = ["RangeBound", "weak_noise_bound"]

_DEFAULT_ORDER, _MOST_ORDER = 2, 20
# Where the search for the largest kappa0 begins, and the least it tries; the ratio it ends with.
_LARGEST, _SMALLEST = Fraction(2), Fraction(1, 10**9)
_RATIO = 1.02


@dataclass(frozen=True)
class RangeBound:
    """A proof that |T/T_N - 1| <= K kappa^(2 N + 2) for 0 < kappa <= `kappa0`, N the `order`.

    Attributes
    ----------
    constant : float
        K.
    kappa0 : Fraction
        The largest scaled noise amplitude for which it holds.
    order : int
        The N of T_N, which is what ``escape_time(…, method="laplace", order=N)`` gives,
        before rounding.
    """

    constant: float
    kappa0: Fraction
    order: int

    def error(self, kappa: Number) -> float:
        """The bound of ``|T/T_N - 1|`` at one kappa, rounded up.

        Raises
        ------
        InputError
            If kappa is not in (0, kappa0].
        """
        value = exact("kappa", kappa)
        positive("kappa", value)
        if value > self.kappa0:
            raise InputError(
                f"kappa is {float_text(value)}, but the bound is proved up to "
                f"{float_text(self.kappa0)}; ask for a larger kappa0."
            )
        size = Fraction(self.constant) * value ** (2 * self.order + 2)
        return math.nextafter(float(size), math.inf)

    def __str__(self) -> str:
        return (
            f"|T/T_{self.order} - 1| <= {_rounded_up(self.constant)} kappa^{2 * self.order + 2} "
            f"for 0 < kappa <= {_short(self.kappa0)} (bound)"
        )


def _rounded_up(x: float) -> str:
    """Four digits, not below x."""
    with decimal.localcontext() as context:
        context.prec, context.rounding = 4, decimal.ROUND_CEILING
        return f"{+decimal.Decimal(x):.4g}"


def _short(x: Fraction) -> str:
    """Up to six digits, not above x, also of what float64 cannot hold."""
    with decimal.localcontext() as context:
        context.prec, context.rounding = 6, decimal.ROUND_FLOOR
        return f"{(decimal.Decimal(x.numerator) / decimal.Decimal(x.denominator)).normalize():g}"


@patient
def weak_noise_bound(
    drift: Drift,
    r: Number,
    *,
    start: Number = 0,
    order: int | None = None,
    kappa0: Number | None = None,
    rtol: Number | None = None,
    patience: float | None = None,
) -> RangeBound:
    """Bound the error of the weak-noise escape time for all ``kappa <= kappa0`` at once.

    Proved from the drift alone, in ball arithmetic; no value of T is computed. The constant
    is close to the best one where e^(-2 D/kappa_0^2) is small beside kappa_0^(2 N + 2), D the
    least height by which something else stays below what dominates.

    Parameters
    ----------
    drift : Drift
        With rational polynomial A; bound, no arrays.
    r, start : number
        As in `escape_time`.
    order : int, optional
        N, 0 to 20; 2 if left out.
    kappa0 : number, optional
        Scaled noise amplitude up to which the bound is to hold. If left out, the largest for
        which the bound is at most `rtol` is searched, to 2 percent.
    rtol : number, optional
        For that search; 1 if left out, where the bound says no more than T < 2 T_N.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    RangeBound

    Raises
    ------
    InputError
        For a drift that is no polynomial, a value outside its range, both kappa0 and rtol.
    AccuracyError
        Where the proof does not go through.

    Examples
    --------
    >>> import symasym as sa
    >>> drift = sa.friction(mu=3, alpha=1, z0="-0.3")
    >>> proved = sa.weak_noise_bound(drift, 10, order=1, kappa0="0.01")
    >>> print(proved)
    |T/T_1 - 1| <= 2.290 kappa^4 for 0 < kappa <= 0.01 (bound)
    >>> print(f"{proved.error('0.001'):.2g}")
    2.3e-12
    """
    from symasym.asymptotics.proofs.all_noise import Proof
    from symasym.numbers.balls import NotProved

    require_drift(drift)
    if kappa0 is not None and rtol is not None:
        raise InputError("kappa0 and rtol are both given; give one, the other follows from it.")
    values = exact_scene(drift, {"r": r, "start": start}, None)
    most = read_order(order, _DEFAULT_ORDER, _MOST_ORDER)
    if drift.exact_coefficients() is None:
        raise InputError(
            f"{drift} has no rational polynomial A, for which alone this is proved; use "
            "escape_time with method='laplace', whose error is an estimate."
        )
    given = None if kappa0 is None else exact("kappa0", kappa0)
    wanted = Fraction(1) if rtol is None else exact("rtol", rtol)
    positive("rtol", wanted)
    if given is not None:
        positive("kappa0", given)
    try:
        proof = Proof(drift, values["r"], values["start"], most)
    except NotProved:
        why = "or there is none, or two are as good as equal"
        raise _not_proved("at any kappa", why, "use method='exact'") from None
    if given is None:
        return _largest(proof, wanted, most)
    constant = proof.constant(given)
    if constant is None:
        where, why = f"up to kappa0 = {float_text(given)}", "or the noise is too strong"
        raise _not_proved(where, why, "give a smaller kappa0, or leave it out")
    return RangeBound(constant, given, most)


def _not_proved(where: str, why: str, instead: str) -> AccuracyError:
    """The refusal of a range for which dominance was not proved."""
    return AccuracyError(
        "that simple wells and barriers, or wells and ends, dominate was not proved "
        f"{where}: another critical point is too close, {why}; {instead}."
    )


def _largest(proof: Proof, rtol: Fraction, order: int) -> RangeBound:
    """The largest kappa0 whose bound is at most rtol, by bisection."""

    def attempt(kappa: Fraction) -> RangeBound | None:
        """The bound up to kappa, if it is at most rtol."""
        constant = proof.constant(kappa)
        if constant is None:
            return None
        bound = RangeBound(constant, kappa, order)
        return bound if bound.error(kappa) <= rtol else None

    high, best = _LARGEST, None
    low = high
    while best is None and low > _SMALLEST:
        high, low = low, low / 2
        best = attempt(low)
    if best is None:
        why = f"or rtol = {float_text(rtol)} is too small"
        raise _not_proved("at any kappa", why, "give a larger rtol, or use method='exact'")
    while high > best.kappa0 * Fraction(_RATIO):
        middle = Fraction(f"{math.sqrt(float(best.kappa0) * float(high)):.4g}")
        if not best.kappa0 < middle < high:
            break
        bound = attempt(middle)
        if bound is None:
            high = middle
        else:
            best = bound
    return best
