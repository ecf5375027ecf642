"""The strong-noise expansion of many scenes at once, in float64 and the log domain.

Every quantity is a `LogBounds`: the expansion, a lower and an upper end of what the whole series
can be, each with its rounding, carried through the formulas of `sweep`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from symasym.asymptotics.strong_noise.panel import Record, Swept, carried, escape_time
from symasym.asymptotics.strong_noise.sweep import (
    Moments,
    layer_record,
    moments_of,
    odds_outside,
    odds_right,
    sides,
)
from symasym.base.call_context import step
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray, field_of
from symasym.numbers.float_arrays import LogPositive
from symasym.scenes import Scenes
from symasym.special.exponentials import log_quotient, mean_place

# Of a logarithm to begin with: that of lam, of a few products, of the function itself; of a
# moment's terms, as a multiple of their number.
_UNIT = 1e-15
_SCENES_AT_ONCE = 1024
_NODES = 12
_MOST_PANELS = 256
_SETTLED = 1e-14


class LogBounds(LogPositive):
    """Positive numbers in rows: value, lower and upper bound.

    Sums and products increase in each operand, so that the ends of a result come from the ends of
    its operands; a quotient takes those of the divisor the other way round.
    """

    __slots__ = ()

    @classmethod
    def of_log(cls, log: FloatArray) -> LogBounds:
        """The number whose logarithm this is."""
        return cls(np.tile(log, (3, 1)), np.tile(_UNIT * (1 + np.abs(log)), (3, 1)))

    def __add__(self, other: LogPositive | int) -> LogBounds:
        return _rows(super().__add__(other))

    __radd__ = __add__

    def __mul__(self, other: LogPositive | int) -> LogBounds:
        return _rows(super().__mul__(other))

    __rmul__ = __mul__

    def __truediv__(self, other: LogPositive | int) -> LogBounds:
        divisor = other.exchanged() if isinstance(other, LogBounds) else other
        return _rows(super().__truediv__(divisor))

    def __rtruediv__(self, other: int) -> LogBounds:
        return _rows(self.exchanged().__rtruediv__(other))

    def exchanged(self) -> LogPositive:
        """The bounds in each other's rows."""
        return LogPositive(self.log[[0, 2, 1]], self.error[[0, 2, 1]])

    def where(self, test: np.ndarray[Any, np.dtype[np.bool_]], other: LogBounds) -> LogBounds:
        """This where `test` holds, else the other."""
        return LogBounds(
            np.where(test, self.log, other.log), np.where(test, self.error, other.error)
        )


def _rows(x: LogPositive) -> LogBounds:
    """The result of one operation."""
    return LogBounds(x.log, x.error)


def logs(
    scenes: Scenes, quantity: str, complement: bool, order: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """log of T, C or P of all scenes, what it leaves out at most, and the size of A."""
    count = len(scenes.lam)
    value, error, size = np.empty(count), np.empty(count), np.empty(count)
    for low in range(0, count, _SCENES_AT_ONCE):
        part = slice(low, min(low + _SCENES_AT_ONCE, count))
        chosen = {n: x[part] if np.ndim(x) else x for n, x in scenes.parameters.items()}
        field = field_of(scenes.drift, chosen, part.stop - part.start)
        with np.errstate(all="ignore"):
            numbers = {name: x[part] for name, x in scenes.numbers.items()}
            rows = _chunk(field, scenes.lam[part], numbers, quantity, complement, order)
            at, low, high = rows.log
            value[part] = at
            error[part] = np.maximum(high - at + rows.error[2], at - low + rows.error[1])
            size[part] = field.size()[: part.stop - part.start]
    return value, error, size


def _chunk(
    field: Field,
    lam: FloatArray,
    numbers: dict[str, FloatArray],
    quantity: str,
    complement: bool,
    order: int,
) -> LogBounds:
    """T, C or P of some scenes."""
    of = _ManyScenes(field, lam, order)
    if quantity == "P":
        against = odds_outside(of, complement, np.ones_like(lam))
    else:
        both = sides(of, numbers["r"], numbers["start"])
        if quantity == "T":
            time: LogBounds = escape_time(*both)
            return time
        against = odds_right(*both, complement)
    share: LogBounds = 1 / (1 + against)
    return share


def _number(values: FloatArray) -> LogBounds:
    """Positive numbers with their rounding."""
    return LogBounds.of_log(np.log(values))


class _ManyScenes:
    """The stretches of many scenes (`sweep.Stretches`); the field has their mirror images, too."""

    def __init__(self, field: Field, lam: FloatArray, order: int) -> None:
        self._field, self._lam, self._order, self.lam = field, lam, order, _number(lam)
        none = np.zeros((3, len(lam)))
        self.nothing = Swept(*2 * (_rows(LogPositive.of(none)),))

    def behind(self, state: Swept, length: FloatArray, record: Callable[[], Record]) -> Swept:
        """sigma and w behind one more stretch, where its length is positive."""
        use = length > 0
        if not use.any():
            return state
        new = carried(state, record(), self.lam)
        return Swept(*(after.where(use, before) for after, before in zip(new, state, strict=True)))

    def _scene(self, mirrored: bool) -> IntArray:
        """The scenes' numbers in the field."""
        return np.arange(len(self._lam)) + mirrored * len(self._lam)

    def slope(self, mirrored: bool) -> LogBounds:
        """phi left of the layer, where it is positive."""
        return _number(self._field.a_minus[self._scene(mirrored)])

    def outside(self, mirrored: bool, side: int, length: FloatArray) -> Record:
        """A stretch of constant drift, in closed form."""
        slopes = self._field.a_plus if side > 0 else self._field.a_minus
        x = self._lam * slopes[self._scene(mirrored)] * length
        size = np.log(length)
        rising = size + log_quotient(x)
        parts = rising, rising, rising + size + np.log(mean_place(x)), x
        int_e, int_inverse, nested, climb = map(LogBounds.of_log, parts)
        return Record(int_e, int_inverse, nested, 1, climb)

    def layer(self, mirrored: bool, a: FloatArray, b: FloatArray) -> Record:
        """The stretch [a, b] of the layer, expanded."""
        scene = self._scene(mirrored)
        integrals, rounding = _moments(self._field, scene, a, np.maximum(a, b), self._order + 1)
        return layer_record(integrals, self._lam, self._order, _Arrays(rounding, self._order))


class _Arrays:
    """The expansion's truncation error and rounding, for float64 arrays."""

    def __init__(self, rounding: FloatArray, order: int) -> None:
        # Of the moments, relative to length * spread^k/k!.
        self._rounding = _UNIT * 4 * (order + 4) + rounding

    def tail(self, x: FloatArray, count: int) -> FloatArray:
        """A bound of |e^y - its first `count` terms| for all |y| <= x (Lagrange)."""
        following = np.ones_like(x)
        for k in range(1, count + 1):
            following = following * (x / k)
        geometric = 1 / np.maximum(1 - x / (count + 1), 0.0)
        return following * np.minimum(geometric, np.exp(x))

    def exponential(self, x: FloatArray) -> LogBounds:
        """e^x."""
        return LogBounds.of_log(x)

    def truncated(
        self, terms: list[FloatArray], tail: FloatArray, size: FloatArray, x: FloatArray
    ) -> LogBounds:
        """The expansion with the ends of what the whole series can be, and its rounding."""
        value = sum(terms[1:-1], terms[0])
        whole, reach = value + terms[-1], tail * size
        low = np.fmax(np.log(whole - reach), np.log(size) - x)
        high = np.fmin(np.log(whole + reach), np.log(size) + x)
        rows = np.array([np.log(value), low, high])
        # An end is no farther off than the other, as rough as the moments may be.
        rounding = np.minimum(self._rounding * np.exp(2 * x), 2 * x)
        return LogBounds(rows, rounding + _UNIT * (1 + np.abs(rows)))


def _moments(
    field: Field, scene: IntArray, a: FloatArray, b: FloatArray, order: int
) -> tuple[Moments, FloatArray]:
    """Moments with one column per scene, on panels halved until they settle; their error.

    The error is relative to length * spread^k/k!.
    """
    panels, before = 8, _on_panels(field, scene, a, b, order, 4)
    while True:
        step()
        after = _on_panels(field, scene, a, b, order, panels)
        error = np.zeros_like(a)
        length = np.where(b > a, b - a, 1.0)
        unit = length
        for k in range(order + 1):
            for new, old, size in (
                (after.int_e, before.int_e, unit),
                (after.int_inverse, before.int_inverse, unit),
                (after.nested, before.nested, unit * length / 2),
            ):
                error = np.maximum(error, np.abs(new[k] - old[k]) / size)
            unit = unit * np.where(after.spread > 0, after.spread, 1.0) / (k + 1)
        if not np.isfinite(error).all():
            raise AccuracyError(
                "2 |A|/kappa^2 is beyond float64 (1e308) on [-1, 1], noise that is weak; use "
                "method='laplace' with dps=…, or an A that is finite there."
            )
        if (error < _SETTLED * (order + 1)).all() or panels >= _MOST_PANELS:
            return after, error
        panels, before = 2 * panels, after


class _Nodes:
    """Functions by their values at Gauss's nodes of each panel: scene, panel, node."""

    def __init__(self, slope: FloatArray, half: FloatArray) -> None:
        nodes, self._weights = np.polynomial.legendre.leggauss(_NODES)
        self._matrix = _primitive_matrix(nodes).T
        self._half, self._scaled = half, half * slope
        self.one = np.ones_like(slope)
        self.rate = half * self.one

    def primitive(self, f: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The integral from the left end at every node, and at the right end."""
        totals = f @ self._weights
        behind = np.cumsum(totals, axis=1)
        return f @ self._matrix + (behind - totals)[:, :, None], behind[:, -1]

    def area(self, f: FloatArray) -> FloatArray:
        """The integral over the stretch, by Gauss on each panel."""
        total: FloatArray = (f @ self._weights).sum(axis=1) * self._half[:, 0, 0]
        return total

    def times_slope(self, f: FloatArray) -> FloatArray:
        """A f du/dt."""
        return self._scaled * f


def _on_panels(
    field: Field, scene: IntArray, a: FloatArray, b: FloatArray, order: int, panels: int
) -> Moments:
    """Moments by Gauss's rule on so many panels of equal length."""
    nodes = np.polynomial.legendre.leggauss(_NODES)[0]
    half = ((b - a) / (2 * panels))[:, None, None]
    t = (np.arange(panels)[:, None] + (nodes + 1) / 2) / panels
    u = a[:, None] + (b - a)[:, None] * t.ravel()
    slope = field.phi(scene, u).reshape(len(a), panels, _NODES)
    stretch = _Nodes(slope, half)
    drop, int_e, int_inverse, nested = moments_of(stretch, order, np.ones_like(a))
    falls = stretch.primitive(stretch.times_slope(stretch.one))[0].reshape(len(a), -1)
    top = np.maximum(np.maximum(falls.max(axis=1), drop), 0.0)
    low = np.minimum(np.minimum(falls.min(axis=1), drop), 0.0)
    # Between two nodes V rises above both by less than the slope times half their distance.
    reach = np.abs(slope).max(axis=(1, 2)) * (b - a) / panels * 0.07
    return Moments(b - a, drop, int_e, int_inverse, nested, top - low + 2 * reach)


def _primitive_matrix(nodes: FloatArray) -> FloatArray:
    """Integrals from -1 to each node of the polynomial through values at the nodes."""
    count = len(nodes)
    legendre = np.polynomial.legendre
    rows = np.empty((count, count))
    inverse = np.linalg.inv(legendre.legvander(nodes, count - 1))
    for j in range(count):
        rows[:, j] = legendre.legval(nodes, legendre.legint(inverse[:, j], lbnd=-1))
    return rows
