"""The exact integrals to any number of digits.

The sweeps are those of `symasym.exact.double` (see docs/exact.md), with the
unbounded exponents of mpmath in place of logarithms. All rationals stay exact
until a panel rounds them; a panel's Taylor terms are counted beforehand by
Cauchy's bound, and every sum is of positive terms, so `dps` digits cost a fixed
number of guard bits.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.context import own_context, to_mpf
from symasym.drift import Drift
from symasym.exact.local import ExactField
from symasym.exact.partition import Partition
from symasym.exact.records import Panel

_GUARD = 64


class Absorption(NamedTuple):
    """End of a sweep: sigma = S/s and w."""

    sigma: _Lazy
    w: _Lazy


def escape_time(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """T of eq:Ttilde from `start`, as an mpf right to `dps` digits.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    kappa, r, start : Fraction
        Scaled noise, radius and starting point, |start| < r.
    dps : int
    """
    with own_context(dps) as context:
        left, right, sweep = _both_sweeps(drift, kappa, r, start, dps, context)
        one = _Lazy.known(context.one)
        rate = sweep.add(sweep.over(one, left.sigma), sweep.over(one, right.sigma))
        return to_mpf(sweep.add(left.w, right.w).value() / rate.value(), dps)


def exit_probability(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, complement: bool = False
) -> Any:
    """C of eq:C from `start` (or 1 - C), as an mpf right to `dps` digits."""
    with own_context(dps) as context:
        left, right, sweep = _both_sweeps(drift, kappa, r, start, dps, context)
        wanted, other = (left, right) if complement else (right, left)
        return to_mpf(wanted.sigma.value() / sweep.add(wanted.sigma, other.sigma).value(), dps)


def stationary_density(drift: Drift, kappa: Fraction, y: Fraction, dps: int) -> Any:
    """p_ss(y) of eq:pss, as an mpf right to `dps` digits; needs a sliding region."""
    with own_context(dps) as context:
        _precise(context, dps)
        lam = 2 / kappa**2
        w = [
            _Sweep(drift, mirrored, lam, context).from_infinity(-y if mirrored else y).value()
            for mirrored in (False, True)
        ]
        return to_mpf(context.mpf(lam.numerator) / lam.denominator / (w[0] + w[1]), dps)


def occupation(drift: Drift, kappa: Fraction, dps: int, complement: bool = False) -> Any:
    """P of eq:P (or 1 - P), as an mpf right to `dps` digits; needs a sliding region."""
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
        return to_mpf(outside if complement else inside, dps)


def _precise(context: Any, dps: int) -> None:
    context.prec = int(dps * 3.3219281) + _GUARD


def _both_sweeps(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, context: Any
) -> tuple[Absorption, Absorption, _Sweep]:
    _precise(context, dps)
    lam = 2 / kappa**2
    sweeps = [_Sweep(drift, mirrored, lam, context) for mirrored in (False, True)]
    return sweeps[0].absorbed(-r, start), sweeps[1].absorbed(-r, -start), sweeps[0]


class _Tail(NamedTuple):
    """At u = 1, in units of 1/density there: time inside, in the tail beyond, and in all."""

    inside: Any
    tail_here: Any
    whole: Any


class _Lazy:
    """A positive number within [floor, ceiling] that is found when it is asked for."""

    def __init__(self, floor: Any, ceiling: Any, find: Callable[[], Any]) -> None:
        self.floor, self.ceiling, self._find = floor, ceiling, find

    @classmethod
    def known(cls, value: Any) -> _Lazy:
        return cls(value, value, lambda: value)

    def value(self) -> Any:
        found = self._find()
        self.floor = self.ceiling = found
        self._find = lambda: found
        return found


class _Sweep:
    """Sweeps from the left over one scene."""

    def __init__(self, drift: Drift, mirrored: bool, lam: Fraction, context: Any) -> None:
        field = ExactField(drift, mirrored, context)
        if not field.is_polynomial:
            # Rounding of phi enters the exponents multiplied by lam.
            context.prec += max(0, lam.numerator.bit_length() - lam.denominator.bit_length())
        self._cut = Partition(field, lam, context)
        self._field, self._context = field, context
        self._lam = self._cut.numbers.lam
        self._tiny = context.ldexp(context.one, -context.prec - 12)

    def absorbed(self, start: Fraction, end: Fraction) -> Absorption:
        """sigma and w at `end`, absorbed at `start`."""
        sigma = w = _Lazy.known(self._context.zero)
        for panel in self._cut.records(start, end):
            sigma, w = self._absorb(sigma, w, panel)
        return Absorption(sigma, w)

    def add(self, *terms: _Lazy) -> _Lazy:
        """Sum of positive numbers; those below the last digit of the others are never found."""
        floor = sum((x.floor for x in terms), self._context.zero)
        ceiling = sum((x.ceiling for x in terms), self._context.zero)
        matter = [x for x in terms if x.ceiling > floor * self._tiny]
        return _Lazy(floor, ceiling, lambda: self._sum(matter))

    def _sum(self, terms: list[_Lazy]) -> Any:
        # The largest first: it tells which others can be left out.
        total = self._context.zero
        for x in sorted(terms, key=lambda x: -x.floor):
            if x.ceiling > total * self._tiny:
                total += x.value()
        return total

    def times(self, factor: Any, x: _Lazy) -> _Lazy:
        return _Lazy(factor * x.floor, factor * x.ceiling, lambda: factor * x.value())

    def over(self, x: _Lazy, y: _Lazy) -> _Lazy:
        return _Lazy(x.floor / y.ceiling, x.ceiling / y.floor, lambda: x.value() / y.value())

    def product(self, x: _Lazy, y: _Lazy) -> _Lazy:
        return _Lazy(x.floor * y.floor, x.ceiling * y.ceiling, lambda: x.value() * y.value())

    def _parts(self, panel: Panel) -> tuple[_Lazy, _Lazy, _Lazy]:
        lam = self._lam
        return (
            _Lazy(panel.floor, panel.bound, lambda: panel.near),
            _Lazy(lam * panel.floor, lam * panel.bound, lambda: lam * panel.far),
            _Lazy(self._context.zero, lam * panel.both_bound, lambda: lam * panel.both),
        )

    def _absorb(self, sigma: _Lazy, w: _Lazy, panel: Panel) -> tuple[_Lazy, _Lazy]:
        near, far, both = self._parts(panel)
        if panel.up:
            grown = self.add(near, self.times(panel.end, sigma))
            carried, after = self.add(w, far), grown
        else:
            grown = self.add(near, sigma)
            carried = self.add(self.times(panel.end, w), far)
            after = self.times(1 / panel.end, grown)
        return after, self.over(self.add(self.product(sigma, carried), both), grown)

    def free(self, start: Fraction, end: Fraction, w: Any) -> _Lazy:
        """w at `end` from `w` at `start`, nothing absorbed."""
        now = _Lazy.known(w)
        for panel in self._cut.records(start, end):
            _, far, _ = self._parts(panel)
            if panel.up:
                now = self.times(1 / panel.end, self.add(now, far))
            else:
                now = self.add(self.times(panel.end, now), far)
        return now

    def from_infinity(self, end: Fraction) -> _Lazy:
        """w at `end` with nothing absorbed on the left (needs a- > 0)."""
        # Left of -1, w = 1/a- everywhere.
        before = 1 / self._cut.numbers.mpf(self._field.value(Fraction(-1)))
        return self.free(Fraction(-1), end, before) if end > -1 else _Lazy.known(before)

    def to_the_end(self) -> _Tail:
        """The whole of space seen from u = 1, split into the layer and the tails."""
        beyond = 1 / -self._cut.numbers.mpf(self._field.value(Fraction(1)))
        inside = self.free(Fraction(-1), Fraction(1), self._context.zero).value()
        return _Tail(inside, beyond, self.from_infinity(Fraction(1)).value() + beyond)
