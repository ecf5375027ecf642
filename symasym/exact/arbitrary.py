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
from symasym.exact.partition import Partition, Slow
from symasym.exact.taylor import Record

_GUARD = 64


class Absorption(NamedTuple):
    """End of a sweep: sigma = S/s and w."""

    sigma: Any
    w: Any


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
        left, right = _both_sweeps(drift, kappa, r, start, dps, context)
        return to_mpf((left.w + right.w) / (1 / left.sigma + 1 / right.sigma), dps)


def exit_probability(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, complement: bool = False
) -> Any:
    """C of eq:C from `start` (or 1 - C), as an mpf right to `dps` digits."""
    with own_context(dps) as context:
        left, right = _both_sweeps(drift, kappa, r, start, dps, context)
        wanted, other = (left, right) if complement else (right, left)
        return to_mpf(wanted.sigma / (wanted.sigma + other.sigma), dps)


def stationary_density(drift: Drift, kappa: Fraction, y: Fraction, dps: int) -> Any:
    """p_ss(y) of eq:pss, as an mpf right to `dps` digits; needs a sliding region."""
    with own_context(dps) as context:
        _precise(context, dps)
        lam = 2 / kappa**2
        w = [
            _Sweep(drift, mirrored, lam, context).from_infinity(-y if mirrored else y)
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
) -> tuple[Absorption, Absorption]:
    _precise(context, dps)
    lam = 2 / kappa**2
    left = _Sweep(drift, False, lam, context).absorbed(-r, start)
    right = _Sweep(drift, True, lam, context).absorbed(-r, -start)
    return left, right


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
        self._cut = Partition(field, lam, context)
        self._field, self._context = field, context
        self._lam = self._cut.mpf(lam)
        self._tiny = context.ldexp(context.one, -context.prec - 12)

    def absorbed(self, start: Fraction, end: Fraction) -> Absorption:
        """sigma and w at `end`, absorbed at `start`."""
        sigma, w = self._context.zero, _Lazy(self._context.zero)
        for panel in self._cut.records(start, end):
            if isinstance(panel, Slow):
                skipped = self._pass_absorbed(sigma, w, panel)
                if skipped:
                    sigma, w = skipped
                    continue
                panel = panel.record()
            sigma, w = self._absorb(sigma, w.value(), panel)
        return Absorption(sigma, w.value())

    def _absorb(self, sigma: Any, w: Any, record: Record) -> tuple[Any, _Lazy]:
        far, both = self._lam * record.far, self._lam * record.both
        if record.up:
            grown = record.near + sigma * record.end
            return grown, _Lazy((sigma * (w + far) + both) / grown)
        grown = record.near + sigma
        return grown / record.end, _Lazy((sigma * (record.end * w + far) + both) / grown)

    def _pass_absorbed(self, sigma: Any, w: _Lazy, panel: Slow) -> tuple[Any, _Lazy] | None:
        """The step over a slow panel whose own `near` and `both` are below the last digit."""
        tiny, end, lam_bound = self._tiny, panel.end, self._lam * panel.bound
        if panel.up:
            if panel.bound > sigma * end * tiny:
                return None
            now = w.value()
            if lam_bound > now * tiny or lam_bound * panel.width > sigma * now * tiny:
                return None
            return sigma * end, _Lazy(now / end)
        lam_floor = self._lam * panel.far_floor
        if (
            panel.bound > sigma * tiny
            or lam_bound * panel.bound > sigma * lam_floor * tiny
            or end * w.ceiling > lam_floor * tiny
        ):
            return None
        return sigma / end, _Lazy(None, lam_bound, lambda: self._lam * panel.record().far)

    def free(self, start: Fraction, end: Fraction, w: Any) -> Any:
        """w at `end` from `w` at `start`, nothing absorbed."""
        lazy = _Lazy(w)
        for panel in self._cut.records(start, end):
            if isinstance(panel, Slow):
                lam_bound = self._lam * panel.bound
                if panel.up and lam_bound < lazy.value() * self._tiny:
                    lazy = _Lazy(lazy.value() / panel.end)
                    continue
                floor = self._lam * panel.far_floor
                if not panel.up and panel.end * lazy.ceiling < floor * self._tiny:
                    lazy = _Lazy(None, lam_bound, lambda p=panel: self._lam * p.record().far)
                    continue
                panel = panel.record()
            now, far = lazy.value(), self._lam * panel.far
            lazy = _Lazy((now + far) / panel.end if panel.up else now * panel.end + far)
        return lazy.value()

    def from_infinity(self, end: Fraction) -> Any:
        """w at `end` with nothing absorbed on the left (needs a- > 0)."""
        # Left of -1, w = 1/a- everywhere.
        before = 1 / self._cut.mpf(self._field.value(Fraction(-1)))
        return self.free(Fraction(-1), end, before) if end > -1 else before

    def to_the_end(self) -> _Tail:
        """The whole of space seen from u = 1, split into the layer and the tails."""
        beyond = 1 / -self._cut.mpf(self._field.value(Fraction(1)))
        inside = self.free(Fraction(-1), Fraction(1), self._context.zero)
        return _Tail(inside, beyond, self.from_infinity(Fraction(1)) + beyond)


class _Lazy:
    """w, or how to find it and a bound on it."""

    def __init__(self, value: Any, ceiling: Any = None, find: Callable[[], Any] | None = None) -> None:
        self._value, self._find = value, find
        self.ceiling = value if ceiling is None else ceiling

    def value(self) -> Any:
        if self._value is None:
            assert self._find is not None
            self._value = self._find()
        return self._value
