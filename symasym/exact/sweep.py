r"""Sweeps over panels, from an end of the scene to a point, and what two of them make together.

With s = e^{lam V} and S(x) = int_{-r}^x s, a sweep from the left carries

    sigma = S/s,    w = (lam s/S) int_{-r}^x S/s,

whose inverse is the rate of the scale function and the time per unit of that rate. Across a panel
[a, b], on which e(x) = e^{lam (V(x) - V(a))}, both change by the derived step `panel-step`; from
the left (L) and, in mirrored coordinates, from the right (R) they are put together by
`positive-form` (eq:Ttilde, eq:C) and `positive-density` (eq:pss, eq:P):

    T = (w_L + w_R)/(1/sigma_L + 1/sigma_R),    C = 1/(1 + sigma_L/sigma_R),
    p_ss = lam/(w_L + w_R),                     P = 1/(1 + outside/inside).

Every term is positive, so nothing cancels, in whatever arithmetic. All of that is emitted
(`symasym.generated.formulas`) and called here with numbers of any kind: logarithms with
their errors (`symasym.numbers.float_arrays`), mpf, balls, and balls with their derivatives. A
panel's integral that costs much may be a `Deferred` one, and w a `Sum` of them: most panels of a
stiff scene only scale what comes in, and their own share is below the last digit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.base.call_context import step
from symasym.generated import formulas
from symasym.numbers.arithmetic import Number

if TYPE_CHECKING:
    from symasym.generated.formulas import Ratios

__all__ = [
    "Deferred", "InLayer", "Record", "Sum", "Swept", "absorbed", "carried", "carried_in_layer",
    "carried_freely", "density", "escape_time", "first", "freely", "from_infinity", "in_layer",
    "layer_times", "middle",
]  # fmt: skip


class Record(NamedTuple):
    """A panel's numbers: e(b) = fall/climb, and its integrals in those scales.

    `fall` is e(b) where V falls and `climb` is 1/e(b) where V rises, the other being 1, so that
    nothing grows with lam; numbers without bounds may take any two.

    =========== ===============================
    int_e       climb int e
    int_inverse fall int 1/e
    nested      fall int int_{w < x} e(w)/e(x)
    =========== ===============================
    """

    int_e: Any
    int_inverse: Any
    nested: Any
    fall: Any
    climb: Any


class Swept(NamedTuple):
    """sigma and w at the point reached."""

    sigma: Any
    w: Any


class InLayer(NamedTuple):
    """Stationary time inside the layer and left of it, as w at the point reached."""

    inside: Any
    before: Any


# -- one panel -------------------------------------------------------------------------------------


def first(p: Record, lam: Ratios) -> Swept:
    """sigma and w after a panel that begins at an absorbing end."""
    return Swept(*formulas.absorbed(lam, known(p.int_e), p.nested, p.fall))


def carried(before: Swept, p: Record, lam: Ratios) -> Swept:
    """sigma and w after a panel."""
    return Swept(
        *formulas.carried(
            lam, before.w, p.int_e, p.int_inverse, p.nested, p.fall, p.climb, before.sigma
        )
    )


def carried_freely(w: Number, p: Record, lam: Ratios) -> Any:
    """w after a panel, nothing being absorbed: beside an infinite sigma two integrals are 0."""
    return formulas.carried(lam, w, 0, p.int_inverse, 0, p.fall, p.climb, 1)[1]


def carried_in_layer(before: InLayer, p: Record, lam: Ratios) -> InLayer:
    """Time inside the layer and before it, after a panel."""
    inside = carried_freely(before.inside, p, lam)
    return InLayer(inside, p.fall * before.before / p.climb)


# -- all panels, in order --------------------------------------------------------------------------


def absorbed(records: Iterable[Record], lam: Ratios) -> Swept:
    """sigma and w after the panels, the first of which begins at an absorbing end."""
    remaining = iter(records)
    state = first(next(remaining), lam)
    for p in remaining:
        step()
        state = carried(state, p, lam)
    return state


def freely(records: Iterable[Record], lam: Ratios, w: Number) -> Any:
    """w after the panels from `w` before them, nothing being absorbed."""
    for p in records:
        w = carried_freely(w, p, lam)
    return w


def from_infinity(records: Iterable[Record], lam: Ratios, a_minus: Ratios) -> Any:
    """w after the panels from u = -1 on, nothing being absorbed: left of them it is 1/a-."""
    return freely(records, lam, Sum(formulas.tail_left(a_minus), 1, ()))


def in_layer(records: Iterable[Record], lam: Ratios, a_minus: Ratios) -> InLayer:
    """Stationary time inside [-1, 1], whose panels these are, and left of it, as w at u = 1."""
    state = InLayer(Sum(0, 1, ()), formulas.tail_left(a_minus))
    for p in records:
        state = carried_in_layer(state, p, lam)
    return state


# -- both sides ------------------------------------------------------------------------------------


def escape_time(left: Swept, right: Swept) -> Any:
    """T from both sides of the start (eq:Ttilde)."""
    w = known(left.w + right.w)
    return formulas.escape_time_of_sides(w, left.sigma, right.sigma)


def density(lam: Ratios, w_left: Number, w_right: Number) -> Any:
    """p_ss from both sides of a point (eq:pss)."""
    return formulas.density_of_sides(lam, known(w_left + w_right))


def layer_times(layer: InLayer, tail_right: Number, complement: bool) -> tuple[Any, Any]:
    """Stationary times inside the layer and outside it, or those outside and inside (eq:P)."""
    inside, outside = known(layer.inside), layer.before + tail_right
    return (outside, inside) if complement else (inside, outside)


# -- numbers that cost much ------------------------------------------------------------------------


def known(x: Number) -> Any:
    """The number that `x` is or stands for."""
    return x.value if isinstance(x, (Deferred, Sum)) else x


class _Open:
    """Arithmetic of what is not computed yet: a `Sum`, but known at once beside a known number."""

    def _sum(self) -> Sum:
        raise NotImplementedError

    def __mul__(self, other: Number) -> Sum:
        x = self._sum()
        return Sum(x.number * other, x.factor * other, x.parts)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Sum:
        return self.__mul__(1 / other)

    def __add__(self, other: Number) -> Any:
        x = self._sum()
        if not isinstance(other, _Open):
            return Sum(x.number + other, x.factor, x.parts).value
        y = other._sum()
        parts = tuple(Sum(0, z.factor, z.parts) for z in (x, y) if z.parts)
        return Sum(x.number + y.number, 1, parts)

    __radd__ = __add__


class Deferred(_Open):
    """A positive number, of which a bound may be known, to be computed when it counts.

    Parameters
    ----------
    compute, bound : callables without arguments
        The number, and a bound.
    tiny : number
        The share of a sum that changes no digit asked for.
    enclosure : callable, optional
        What stands for the number where it changes no digit; without it, nothing does.
    """

    def __init__(
        self,
        compute: Callable[[], Any],
        bound: Callable[[], Any] | None = None,
        tiny: Number = 0,
        enclosure: Callable[[], Any] | None = None,
    ) -> None:
        self._compute, self._bound, self.tiny, self.enclosure = compute, bound, tiny, enclosure

    def _sum(self) -> Sum:
        return Sum(0, 1, (self,))

    @cached_property
    def bound(self) -> Any:
        """A bound of the number, None where none is known."""
        return self._bound() if self._bound else None

    @cached_property
    def value(self) -> Any:
        """The number, computed once."""
        step()
        return self._compute()


class Sum(_Open):
    """number + factor * (the parts), of which those that count are computed, the largest first."""

    __slots__ = ("factor", "number", "parts")

    def __init__(self, number: Number, factor: Number, parts: tuple[Deferred | Sum, ...]) -> None:
        self.number, self.factor, self.parts = number, factor, parts

    def _sum(self) -> Sum:
        return self

    @property
    def value(self) -> Any:
        """The sum; a part below `tiny` of it is replaced by its enclosure or, without one, by 0."""
        total, terms, waiting = self.number, [], [(self.factor, part) for part in self.parts]
        while waiting:
            factor, part = waiting.pop()
            if isinstance(part, Sum):
                waiting += [(factor * part.factor, inner) for inner in part.parts]
            elif part.bound is None:
                total = total + factor * part.value
            else:
                terms.append((middle(factor) * middle(part.bound), factor, part))
        for size, factor, part in sorted(terms, key=lambda term: term[0], reverse=True):
            if not size < middle(total) * part.tiny:
                total = total + factor * part.value
            elif part.enclosure:
                total = total + factor * part.enclosure()
        return total


def middle(x: Number) -> Any:
    """A number by which terms are put in order: the midpoint of a ball."""
    return x.mid() if hasattr(x, "mid") else x
