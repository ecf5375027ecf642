"""The formula of strong noise: the layer as one panel of the sweeps (`panel`), over SymPy.

In the layer e^{lam V} is a power series in lam with the moments of V as coefficients. Outside the
layer all is closed form. A stretch [a, b] of either is a `Record` with fall = 1, climb =
e^{lam (V(a) - V(b))}. The numbers are in `symasym.expansions.strong_noise`.

The moments of V over a stretch of the layer are proved to any order. With V measured from the
stretch's left end a or right end b, and k! divided out,

    int_e_k       = int (V(w) - V(b))^k dw / k!,
    int_inverse_k = int (V(a) - V(x))^k dx / k!,
    nested_k      = double integral of (V(w) - V(x))^k / k! over a < w < x < b.

All come from one recursion, because V' = -A: f_k(x) = int_a^x A f_{k-1} gives
int_inverse_k = int f_k from f_0 = 1, and int_e_k = f_k(b), nested_k = int f_k
from f_0 = x - a (Cauchy's formula for repeated integration, in V). Nothing is
raised to a power and no binomials cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

from symasym.asymptotics.strong_noise.panel import (
    InLayer,
    Record,
    Swept,
    carried_in_layer,
    layer_times,
)
from symasym.generated.formulas import tail_left
from symasym.numbers.arithmetic import Number


class Arithmetic(Protocol):
    """What an expansion in lam needs beyond sums and products."""

    def tail(self, x: Number, count: int) -> Any:
        """A bound of |e^y - its first `count` terms| for all |y| <= x."""

    def exponential(self, x: Number) -> Any:
        """e^x, enclosed."""

    def truncated(self, terms: list[Any], tail: Number, size: Number, x: Number) -> Any:
        """The sum of all terms but the last, or an enclosure of the whole series.

        What the terms leave out is at most tail * size; the whole is between size * e^{-x} and
        size * e^x.
        """


class Layered(Protocol):
    """The layer of one scene, or of many; of the drift -A(-u) if `mirrored`."""

    lam: Any

    def slope(self, mirrored: bool) -> Any:
        """phi left of the layer."""

    def layer(self, mirrored: bool, a: Any, b: Any) -> Record:
        """The stretch [a, b] of the layer, expanded."""


def odds_outside(of: Layered, complement: bool, one: Any) -> Any:
    """(1 - P)/P (eq:pss), or P/(1 - P); `one` is the number 1."""
    before = InLayer(0, tail_left(of.slope(False)))
    layer = carried_in_layer(before, of.layer(False, -one, one), of.lam)
    wanted, rest = layer_times(layer, tail_left(of.slope(True)), complement)
    return rest / wanted


def odds_right(left: Swept, right: Swept, complement: bool) -> Any:
    """(1 - C)/C (eq:C), or C/(1 - C)."""
    return right.sigma / left.sigma if complement else left.sigma / right.sigma


def layer_record(integrals: Moments, lam: Number, order: int, number: Arithmetic) -> Record:
    """The integrals over a stretch of the layer to the power `order` of lam."""
    powers = [lam * 0 + 1]
    for _ in range(order + 1):
        powers.append(powers[-1] * lam)
    x = lam * integrals.spread
    tail = number.tail(x, order + 2)

    def total(moments: Sequence[Number], size: Number) -> Any:
        """One list of moments added up to the power `order` of lam."""
        terms = [m * p for m, p in zip(moments, powers, strict=False)]
        return number.truncated(terms, tail, size, x)

    length = integrals.length
    int_e, int_inverse = (total(row, length) for row in (integrals.int_e, integrals.int_inverse))
    nested = total(integrals.nested, length * length / 2)
    return Record(int_e, int_inverse, nested, 1, number.exponential(lam * integrals.drop))


# -- moments ---------------------------------------------------------------------------------------


#: A function on a stretch: an array of values, or a list of polynomials.
Function = TypeVar("Function")


class Moments(NamedTuple):
    """Of [a, b]: length, V(a) - V(b), the three lists, and an upper bound of max V - min V."""

    length: Any
    drop: Any
    int_e: Any
    int_inverse: Any
    nested: Any
    spread: Any


class Primitives(Protocol[Function]):
    """Functions on a stretch, as values or polynomials in a variable t on each panel of it.

    `one` is the function 1, `rate` is du/dt.
    """

    one: Function
    rate: Function

    def primitive(self, f: Function) -> tuple[Function, Any]:
        """The integral of f dt from the left end, as a function; its value at the right end."""

    def area(self, f: Function) -> Any:
        """The integral of f du over the stretch."""

    def times_slope(self, f: Function) -> Function:
        """A f du/dt."""


def moments_of(
    stretch: Primitives[Function], order: int, unit: Number
) -> tuple[Any, list[Any], list[Any], list[Any]]:
    """V(a) - V(b) and the three lists of `Moments`, up to `order`; `unit` is the number 1."""
    int_e, nested = _iterated(stretch, *stretch.primitive(stretch.rate), order)
    falls, int_inverse = _iterated(stretch, stretch.one, unit, max(order, 1))
    return falls[1], int_e, int_inverse[: order + 1], nested


def _iterated(
    stretch: Primitives[Function], f: Function, end: Number, order: int
) -> tuple[list[Any], list[Any]]:
    """f_k at the right end and the integral of f_k for k = 0..order, from f_0 = f."""
    ends, areas = [end], [stretch.area(f)]
    for _ in range(order):
        f, end = stretch.primitive(stretch.times_slope(f))
        ends.append(end)
        areas.append(stretch.area(f))
    return ends, areas
