"""The strong-noise expansion of many scenes at once, in float64 and the log domain.

Every quantity is a `LogBounds`: the expansion, a lower and an upper end of what the whole series
can be, and its rounding, carried through the formulas of `sweep`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.asymptotics.strong_noise import sweep
from symasym.asymptotics.strong_noise.moments import Moments, moments_of
from symasym.asymptotics.strong_noise.sweep import Side, Stretch, after, odds, weights
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.base.patience import step
from symasym.drift.field.float_field import Field, IntArray, field_of
from symasym.scenes.scene import Scenes
from symasym.special.exponentials import log_quotient, mean_place

# Rounding of one operation: that of a logarithm, an exponential and a sum, and of the result.
_ROUNDING = 5e-16
# Of a logarithm to begin with: that of lam, of a few products, of the function itself; of a
# moment's terms, as a multiple of their number.
_UNIT = 1e-15
_SCENES_AT_ONCE = 1024
_NODES = 12
_MOST_PANELS = 256
_SETTLED = 1e-14


class LogBounds:
    """Positive numbers by their logarithms in `rows`: value, lower and upper bound; their rounding.

    Sums and products increase in each operand, so that the ends of a result come from the ends of
    its operands; a quotient takes those of the divisor the other way round.
    """

    __slots__ = ("rounding", "rows")
    # An array times this is one of these, not an array of them.
    __array_ufunc__ = None

    def __init__(self, rows: FloatArray, rounding: FloatArray) -> None:
        self.rows, self.rounding = rows, rounding

    @classmethod
    def of_log(cls, log: FloatArray) -> LogBounds:
        """The number whose logarithm this is."""
        return cls(np.tile(log, (3, 1)), _UNIT * _size(log))

    def _of(self, other: LogBounds | FloatArray | float) -> LogBounds:
        """Numbers as logarithms with bounds."""
        if isinstance(other, LogBounds):
            return other
        return LogBounds.of_log(np.log(other) + 0 * self.rounding)

    def _made(self, rows: FloatArray, rounding: FloatArray) -> LogBounds:
        """The result of one operation, with its rounding."""
        return LogBounds(rows, rounding + _ROUNDING * _size(rows[0]))

    def __add__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        rows = np.logaddexp(self.rows, y.rows)
        mine, total = self.rows[0], rows[0]
        share = np.where(np.isfinite(total), np.exp(mine - total), mine > 0)
        return self._made(rows, share * self.rounding + (1 - share) * y.rounding)

    __radd__ = __add__

    def __mul__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        return self._made(self.rows + y.rows, self.rounding + y.rounding)

    __rmul__ = __mul__

    def __truediv__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        return self._made(self.rows - y.rows[[0, 2, 1]], self.rounding + y.rounding)

    def __rtruediv__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        quotient: LogBounds = self._of(other) / self
        return quotient

    def where(self, test: np.ndarray[Any, np.dtype[np.bool_]], other: LogBounds) -> LogBounds:
        """This where `test` holds, else the other."""
        return LogBounds(
            np.where(test, self.rows, other.rows), np.where(test, self.rounding, other.rounding)
        )


def _size(log: FloatArray) -> FloatArray:
    """1 + |log|; 1 where that is infinite, whose rounding is none."""
    size: FloatArray = 1 + np.where(np.isfinite(log), np.abs(log), 0.0)
    return size


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
            at, low_end, high_end = rows.rows
            value[part] = at
            error[part] = np.maximum(high_end - at, at - low_end) + rows.rounding
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
    scene = np.arange(len(lam))
    if quantity == "P":
        end = np.ones_like(lam)
        stretch = _layer(field, scene, lam, -end, end, order)
        slopes = _number(field.a_minus[scene]), _number(-field.a_plus[scene])
        share = 1 / (1 + odds(*weights(slopes, stretch, _number(lam)), complement))
        assert isinstance(share, LogBounds)
        return share
    r, start = numbers["r"], numbers["start"]
    left = _swept(field, scene, lam, r, start, order)
    right = _swept(field, scene + len(lam), lam, r, -start, order)
    if quantity == "C":
        share = 1 / (1 + odds(left.scale, right.scale, complement))
    else:
        share = sweep.escape_time(left, right)
    assert isinstance(share, LogBounds)
    return share


def _number(values: FloatArray) -> LogBounds:
    """Positive numbers with their rounding."""
    return LogBounds.of_log(np.log(values))


def _swept(
    field: Field, scene: IntArray, lam: FloatArray, r: FloatArray, x: FloatArray, order: int
) -> Side:
    """S and W at `x`, absorbed at -r."""
    number = _number(lam)
    nothing = LogBounds(np.full((3, len(lam)), -np.inf), np.zeros_like(lam))
    side = Side(nothing, nothing)

    def behind(stretch: Stretch, use: np.ndarray[Any, np.dtype[np.bool_]]) -> Side:
        """The sweep behind the stretch, where `use` holds."""
        new = after(side, stretch, number)
        return Side(new.scale.where(use, side.scale), new.work.where(use, side.work))

    before = np.maximum(0.0, np.minimum(-1.0, x) + r) * (r > 1)
    side = behind(_outer(field.a_minus[scene], lam, before), before > 0)
    a, b = np.maximum(-1.0, -r), np.minimum(x, 1.0)
    inside = b > a
    if inside.any():
        side = behind(_layer(field, scene, lam, a, np.maximum(a, b), order), inside)
    beyond = np.maximum(0.0, x - 1.0)
    return behind(_outer(field.a_plus[scene], lam, beyond), beyond > 0)


def _outer(a: FloatArray, lam: FloatArray, length: FloatArray) -> Stretch:
    """A stretch of constant drift, in closed form."""
    x = lam * a * length
    size = np.log(length)
    parts = (x, size + log_quotient(x), size + log_quotient(-x), size + np.log(mean_place(x)))
    return Stretch(*map(LogBounds.of_log, parts))


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
        return LogBounds(rows, self._rounding * np.exp(2 * x) + _UNIT * (1 + np.abs(rows[0])))


def _layer(
    field: Field, scene: IntArray, lam: FloatArray, a: FloatArray, b: FloatArray, order: int
) -> Stretch:
    """The layer's stretch [a, b], expanded."""
    integrals, rounding = _moments(field, scene, a, b, order + 1)
    return sweep.layer(integrals, lam, order, _Arrays(rounding, order))


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
                "A is not finite on [-1, 1]; give an A that is real and smooth there."
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
