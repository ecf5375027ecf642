"""The exact integrals to any number of digits.

The sweeps of `symasym.exact.sweep` with the unbounded exponents of mpmath. All
rationals stay exact until a panel rounds them; a panel's Taylor terms are
counted beforehand by Cauchy's bound, and every sum is of positive terms, so
`dps` digits cost a fixed number of guard bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

from symasym.base.contexts import mpf_of, own_context, to_mpf
from symasym.drift.drift import Drift
from symasym.drift.taylor_field import ExactField
from symasym.exact import sweep
from symasym.exact.digit_partition import Partition
from symasym.exact.sweep import Record, Sum, Swept
from symasym.generated import mpmath_formulas, plain_formulas
from symasym.numbers.rationals import Rational

_GUARD = 64


def escape_time(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, *, log: bool = False
) -> Any:
    """T of eq:Ttilde from `start`, as an mpf right to `dps` digits.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    kappa, r, start : Fraction
        Scaled noise, radius and starting point, |start| < r.
    dps : int
    log : bool
        The natural logarithm instead, right to `dps` digits of its own (to 2 `dps`
        places where it nearly vanishes).
    """

    def compute(n: int, context: Any) -> Any:
        return sweep.escape_time(*_from_both_ends(drift, kappa, r, start, n, context))

    return _to_digits(compute, dps, log)


def exit_probability(
    drift: Drift,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
    complement: bool = False,
    *,
    log: bool = False,
) -> Any:
    """C of eq:C from `start` (or 1 - C); parameters as in `escape_time`."""
    with own_context(dps) as context:
        left, right = _from_both_ends(drift, kappa, r, start, dps, context)
        if complement:
            left, right = right, left
        if log:
            share = mpmath_formulas.log_exit_share(context, left.sigma, right.sigma)
        else:
            share = plain_formulas.exit_share(left.sigma, right.sigma)
        return to_mpf(share, dps)


def stationary_density(
    drift: Drift, kappa: Fraction, y: Fraction, dps: int, *, log: bool = False
) -> Any:
    """p_ss(y) of eq:pss; needs a sliding region. Parameters as in `escape_time`."""
    lam = 2 / kappa**2

    def compute(n: int, context: Any) -> Any:
        _precise(context, n)
        w_left, w_right = (
            _Scene(drift, mirrored, lam, context).from_infinity(-y if mirrored else y)
            for mirrored in (False, True)
        )
        return sweep.density(mpf_of(lam, context), w_left, w_right)

    return _to_digits(compute, dps, log)


def occupation(
    drift: Drift, kappa: Fraction, dps: int, complement: bool = False, *, log: bool = False
) -> Any:
    """P of eq:P (or 1 - P); needs a sliding region. Parameters as in `escape_time`."""
    with own_context(dps) as context:
        _precise(context, dps)
        scene = _Scene(drift, False, 2 / kappa**2, context)
        nothing = Sum(context.zero, context.one, ())
        layer = sweep.in_layer(
            scene.records(Fraction(-1), Fraction(1)), scene.lam, nothing, scene.drift_at(-1)
        )
        inside = sweep.known(layer.inside)
        outside = layer.before + plain_formulas.tail_right(scene.drift_at(1))
        wanted, rest = (outside, inside) if complement else (inside, outside)
        if log:
            share = mpmath_formulas.log_occupation_share(context, wanted, rest)
        else:
            share = plain_formulas.occupation_share(wanted, rest)
        return to_mpf(share, dps)


def _to_digits(compute: Callable[[int, Any], Any], dps: int, log: bool) -> Any:
    """The value, or its logarithm with more digits of the value where that is close to 1."""
    extra = 0
    while True:
        with own_context(dps) as context:
            value = compute(dps + extra, context)
            if not log:
                return to_mpf(value, dps)
            logarithm = context.log(value)
            lost = 1 - int(context.mag(logarithm) * 0.30103) if logarithm else dps
        if lost <= extra + 8 or extra > dps:
            return to_mpf(logarithm, dps)
        extra = min(lost, dps) + 8


def _precise(context: Any, dps: int) -> None:
    context.prec = int(dps * 3.3219281) + _GUARD


def _from_both_ends(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, context: Any
) -> tuple[Swept, Swept]:
    _precise(context, dps)
    lam = 2 / kappa**2
    left, right = (_Scene(drift, mirrored, lam, context) for mirrored in (False, True))
    return left.absorbed(-r, start), right.absorbed(-r, -start)


class _Scene:
    """One scene, or its mirror image, to be swept from the left."""

    def __init__(self, drift: Drift, mirrored: bool, lam: Fraction, context: Any) -> None:
        field = ExactField(drift, mirrored, context)
        if not field.is_polynomial:
            # Rounding of phi enters the exponents multiplied by lam.
            context.prec += max(0, lam.numerator.bit_length() - lam.denominator.bit_length())
        self._partition = Partition(field, Rational(lam), context)
        self._field, self._context = field, context
        self.lam = self._partition.numbers.lam
        self._tiny = context.ldexp(context.one, -context.prec - 16)

    def drift_at(self, u: int) -> Any:
        """phi there."""
        return self._partition.numbers.mpf(self._field.value(Rational(u)))

    def records(self, start: Fraction, end: Fraction) -> Iterator[Record]:
        """The panels' numbers from `start` to `end`."""
        for panel in self._partition.panels(Rational(start), Rational(end)):
            yield panel.record(self._tiny)

    def absorbed(self, start: Fraction, end: Fraction) -> Swept:
        """sigma and w at `end`, absorbed at `start`."""
        return sweep.absorbed(self.records(start, end), self.lam)

    def from_infinity(self, end: Fraction) -> Sum:
        """w at `end` with nothing absorbed on the left (needs a- > 0)."""
        # Left of -1, w = 1/a- everywhere.
        w = Sum(plain_formulas.tail_left(self.drift_at(-1)), self._context.one, ())
        return sweep.freely(self.records(Fraction(-1), end), self.lam, w) if end > -1 else w
