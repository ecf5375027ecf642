"""float64 values of the exact integrals, for many scenes at once.

The sweeps of `symasym.exact.sweep` in logarithms (`symasym.numbers.log_positive`), which carry
bounds on their errors. Panels are sampled where lam V varies by a few units and replaced by their
layers where it varies by hundreds (`symasym.exact.float_panels`), so the cost does not grow with
lam.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels, sweep
from symasym.exact.float_blocks import MILD, Records, merged, partition, records_of
from symasym.exact.sweep import InLayer, Record, Swept
from symasym.generated import plain_formulas
from symasym.numbers.log_positive import LogPositive

_ULP = 3e-16  # of a logarithm, its sum included


class Logs(NamedTuple):
    """Natural logarithms of a quantity, and a bound on their absolute error by running analysis."""

    value: FloatArray
    error: FloatArray


def escape_time(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> Logs:
    """log T (eq:Ttilde) of each scene; the error of a scene that is not resolved may be infinite.

    Parameters
    ----------
    field : Field
        Each scene and, after all of them, each mirror image.
    lam, r, start : arrays of shape (scenes,)
    """
    left, right = _from_both_ends(field, lam, r, start)
    return _logs(sweep.escape_time(left, right))


def exit_probability(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray, complement: bool
) -> Logs:
    """log C (eq:C), or log(1 - C); parameters as in `escape_time`."""
    left, right = _from_both_ends(field, lam, r, start)
    if complement:
        left, right = right, left
    return _logs(plain_formulas.exit_share(left.sigma, right.sigma))


def stationary_density(field: Field, lam: FloatArray, y: FloatArray) -> Logs:
    """log p_ss(y) (eq:pss) of each scene, which must slide."""
    n = len(lam)
    end = np.concatenate((y, -y))
    rate = LogPositive.of(np.tile(lam, 2))
    panels = _panels(field, np.tile(lam, 2), np.full(2 * n, -np.inf), end)
    (w,) = panels.through(
        lambda w, p, lam: (sweep.carried_freely(w[0], p, lam),),
        (LogPositive.of(plain_formulas.tail_left(field.a_minus)),),
        rate,
    )
    return _logs(sweep.density(rate[:n], w[:n], w[n:]))


def occupation(field: Field, lam: FloatArray, complement: bool) -> Logs:
    """log P (eq:P), or log(1 - P), of each scene, which must slide."""
    n = len(lam)
    one = np.ones(n)
    panels = _panels(field, lam, -one, one)
    nothing = LogPositive.of(np.zeros(n))
    before = LogPositive.of(plain_formulas.tail_left(field.a_minus[:n]))
    layer = panels.through(
        lambda state, p, lam: sweep.carried_in_layer(InLayer(*state), p, lam),
        (nothing, before),
        LogPositive.of(lam),
    )
    after = LogPositive.of(plain_formulas.tail_right(field.a_plus[:n]))
    wanted, rest = sweep.layer_times(InLayer(*layer), after, complement)
    return _logs(plain_formulas.occupation_share(wanted, rest))


def _logs(quantity: LogPositive) -> Logs:
    """Logarithms and their errors, infinite where they are unknown."""
    bad = np.isnan(quantity.log) | np.isnan(quantity.error)
    return Logs(np.asarray(quantity.log), np.where(bad, np.inf, quantity.error))


def _from_both_ends(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray
) -> tuple[Swept, Swept]:
    """sigma and w at the start from the left and from the right."""
    n, rates = len(lam), np.tile(lam, 2)
    panels = _panels(field, rates, -np.tile(r, 2), np.concatenate((start, -start)))
    unknown = LogPositive.of(np.full(2 * n, np.nan))
    sigma, w = panels.through(
        lambda state, p, lam: sweep.carried(Swept(*state), p, lam),
        (unknown, unknown),
        LogPositive.of(rates),
        sweep.first,
    )
    return Swept(sigma[:n], w[:n]), Swept(sigma[n:], w[n:])


class _Panels(NamedTuple):
    """Panels of many scenes, of each from `begin` on."""

    records: Record
    begin: IntArray
    number: IntArray

    def through(
        self,
        step: Callable[[tuple[LogPositive, ...], Record, LogPositive], tuple[LogPositive, ...]],
        start: tuple[LogPositive, ...],
        lam: LogPositive,
        first: Callable[[Record, LogPositive], tuple[LogPositive, ...]] | None = None,
    ) -> tuple[LogPositive, ...]:
        """The numbers that `step` makes of those at the `start`, one panel of each scene at once.

        The first panel takes the step `first` where that is given.
        """
        # Scenes with more panels come first: those with a k-th one are the first of all.
        order = np.argsort(-self.number, kind="stable")
        lam, at, count = lam[order], self.begin[order], self.number[order]
        state = tuple(x[order] for x in start)
        for k in range(count.max(initial=0)):
            n = int(np.searchsorted(-count, -k, side="left"))
            panel = Record(*(x[at[:n] + k] for x in self.records))
            if first and k == 0:
                changed = first(panel, lam[:n])
            else:
                changed = step(tuple(x[:n] for x in state), panel, lam[:n])
            state = tuple(x.followed_by(y[n:]) for x, y in zip(changed, state, strict=True))
        back = np.argsort(order)
        return tuple(x[back] for x in state)


def _panels(field: Field, lam: FloatArray, start: FloatArray, end: FloatArray) -> _Panels:
    """Panels from `start` to `end`; from u = -1 where `start` is -inf."""
    left = np.flatnonzero(np.isfinite(start) & (start < -1.0))
    before = float_panels.constant(
        lam[left] * field.a_minus[left], np.minimum(end[left], -1.0) - start[left]
    )
    blocks, anchors = partition(field, lam, np.maximum(start, -1.0), np.minimum(end, 1.0))
    ahead = np.full(len(lam), -np.inf)
    ahead[left] = np.log(before.int_e) + np.maximum(-before.rise, 0.0)
    inside = records_of(field, lam, blocks, anchors, ahead)
    right = np.flatnonzero(end > 1.0)
    beyond = float_panels.constant(
        lam[right] * field.a_plus[right], end[right] - np.maximum(1.0, start[right])
    )
    every = Records.joined(
        [
            Records.exactly(left, -1, before),
            inside,
            Records.exactly(right, np.iinfo(np.intp).max, beyond),
        ]
    )
    records = merged(every.sorted())
    count = np.bincount(records.scene, minlength=len(lam))
    # A panel is good to about 20 ulp, and to the rounding of phi in its exponent where phi
    # is not taken about a nearby centre.
    rounding = lam * field.size()[: len(lam)]
    local = 5e-15 + 8e-18 * np.where(rounding < MILD, rounding, 1e3)
    own = local[records.scene] + records.local
    rise = records.moments.rise
    moved = _ULP * np.abs(rise) + records.shift
    _, int_e, int_inverse, nested = records.moments
    logs = Record(
        LogPositive.of(int_e, own),
        LogPositive.of(int_inverse, own),
        LogPositive.of(nested, own),
        fall=LogPositive(np.minimum(rise, 0.0), np.where(rise > 0, 0.0, moved)),
        climb=LogPositive(np.minimum(-rise, 0.0), np.where(rise > 0, moved, 0.0)),
    )
    return _Panels(logs, np.cumsum(count) - count, count)
