"""The exact integrals to any number of digits.

The sweeps are those of `symasym.exact.floats` (see docs/exact.md), with the
unbounded exponents of mpmath in place of logarithms. All rationals stay exact
until a panel rounds them; a panel's Taylor terms are counted beforehand by
Cauchy's bound, and every sum is of positive terms, so `dps` digits cost a fixed
number of guard bits.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.base.contexts import mpf_of, own_context, to_mpf
from symasym.drift.drift import Drift
from symasym.drift.taylor_field import ExactField
from symasym.exact.digit_panels import Panel
from symasym.exact.digit_partition import Partition
from symasym.generated import mpmath_formulas, plain_formulas
from symasym.numbers.rationals import Rational

_GUARD = 64


class Term(NamedTuple):
    """factor * part of a sum of positive terms, the part known only by a bound so far."""

    ceiling: Any
    factor: Any
    panel: Panel
    part: str


class Absorption(NamedTuple):
    """End of a sweep: sigma = S/s, and the terms of w."""

    sigma: Any
    w: list[Term]


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
        left, right = _both_sweeps(drift, kappa, r, start, n, context)
        w = _total(left.w + right.w, context)
        return plain_formulas.escape_time_of_halves(w, left.sigma, right.sigma)

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
        left, right = _both_sweeps(drift, kappa, r, start, dps, context)
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
        w = [
            _Sweep(drift, mirrored, lam, context).from_infinity(-y if mirrored else y)
            for mirrored in (False, True)
        ]
        number = mpf_of(lam, context)
        return plain_formulas.density_of_halves(number, w[0] + w[1])

    return _to_digits(compute, dps, log)


def occupation(
    drift: Drift, kappa: Fraction, dps: int, complement: bool = False, *, log: bool = False
) -> Any:
    """P of eq:P (or 1 - P); needs a sliding region. Parameters as in `escape_time`."""
    with own_context(dps) as context:
        _precise(context, dps)
        lam = 2 / kappa**2
        # Time inside and outside, each per unit of the density at u = 1 (and at -1 for the
        # other tail), so that neither is a difference.
        right, left = (
            _Sweep(drift, mirrored, lam, context).to_the_end() for mirrored in (False, True)
        )
        outside = right.tail_here / right.whole + left.tail_here / left.whole
        inside = right.inside / right.whole
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


def _both_sweeps(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, context: Any
) -> tuple[Absorption, Absorption]:
    _precise(context, dps)
    lam = 2 / kappa**2
    sweeps = [_Sweep(drift, mirrored, lam, context) for mirrored in (False, True)]
    return sweeps[0].absorbed(-r, start), sweeps[1].absorbed(-r, -start)


def _total(terms: list[Term], context: Any) -> Any:
    """The sum, the largest terms first, so that those below its last digit are never found."""
    total = context.zero
    tiny = context.ldexp(context.one, -context.prec - 16)
    for term in sorted(terms, key=lambda term: term.ceiling, reverse=True):
        if term.ceiling < total * tiny:
            break
        total += term.factor * getattr(term.panel, term.part)
    return total


class _Tail(NamedTuple):
    """At u = 1, in units of 1/density there: time inside, in the tail beyond, and in all."""

    inside: Any
    tail_here: Any
    whole: Any


class _Sweep:
    """Sweeps from the left over one scene."""

    def __init__(self, drift: Drift, mirrored: bool, lam: Fraction, context: Any) -> None:
        field = ExactField(drift, mirrored, context)
        if not field.is_polynomial:
            # Rounding of phi enters the exponents multiplied by lam.
            context.prec += max(0, lam.numerator.bit_length() - lam.denominator.bit_length())
        self._cut = Partition(field, Rational(lam), context)
        self._field, self._context = field, context
        self._lam = self._cut.numbers.lam
        self._tiny = context.ldexp(context.one, -context.prec - 12)

    def absorbed(self, start: Fraction, end: Fraction) -> Absorption:
        """sigma and w at `end`, absorbed at `start`."""
        sigma, steps = self._context.zero, []
        for panel in self._cut.records(Rational(start), Rational(end)):
            # Down: sigma' e = near + sigma; up: sigma' = near + sigma/e (see `panels`).
            entering = sigma * panel.end if panel.up else sigma
            grown = entering
            if panel.bound > entering * self._tiny:
                grown = entering + panel.near
            share = sigma / grown
            kept = share if panel.up else share * panel.end
            steps.append((panel, kept, self._lam * share, self._lam / grown))
            sigma = grown if panel.up else grown / panel.end
        return Absorption(sigma, self._unrolled(steps))

    def _unrolled(self, steps: list[tuple[Panel, Any, Any, Any]]) -> list[Term]:
        """w as the sum of what each panel adds, scaled by the panels after it.

        A step is (panel, factor on the incoming w, factor on far, factor on both).
        """
        terms, scale = [], self._context.one
        for panel, kept, far, both in reversed(steps):
            for part, factor, bound in (
                ("far", scale * far, panel.bound),
                ("both", scale * both, panel.both_bound),
            ):
                if factor:
                    terms.append(Term(factor * bound, factor, panel, part))
            scale *= kept
        return terms

    def free(self, start: Fraction, end: Fraction, w: Any) -> Any:
        """w at `end` from `w` at `start`, nothing absorbed."""
        steps, zero = [], self._context.zero
        for panel in self._cut.records(Rational(start), Rational(end)):
            kept = 1 / panel.end if panel.up else panel.end
            steps.append((panel, kept, self._lam * (kept if panel.up else 1), zero))
            w *= kept
        return w + _total(self._unrolled(steps), self._context)

    def from_infinity(self, end: Fraction) -> Any:
        """w at `end` with nothing absorbed on the left (needs a- > 0)."""
        # Left of -1, w = 1/a- everywhere.
        before = plain_formulas.tail_left(self._cut.numbers.mpf(self._field.value(Rational(-1))))
        return self.free(Rational(-1), end, before) if end > -1 else before

    def to_the_end(self) -> _Tail:
        """The whole of space seen from u = 1, split into the layer and the tails."""
        beyond = plain_formulas.tail_right(self._cut.numbers.mpf(self._field.value(Rational(1))))
        inside = self.free(Rational(-1), Rational(1), self._context.zero)
        return _Tail(inside, beyond, self.from_infinity(Rational(1)) + beyond)
