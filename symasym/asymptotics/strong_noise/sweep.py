"""T, C and P for strong noise: the layer as one panel of the sweeps of `symasym.exact.sweep`.

In the layer e^{lam V} is a power series in lam with the moments of V as coefficients (`moments`);
with x = lam (max V - min V) an integral over a length l is short of its first N + 2 terms by less
than l x^{N+2}/(N+2)! e^x (Taylor's theorem with Lagrange's remainder). Outside the layer all is
closed form. A stretch [a, b] of either is a `Record` with fall = 1, climb = e^{lam (V(a) - V(b))},
and all is sums, products and quotients of positive numbers: of `arb` for one scene, of
`arrays.LogBounds` for arrays, of SymPy's expressions for a formula.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from symasym.asymptotics.strong_noise.moments import Moments
from symasym.exact.sweep import InLayer, Record, Swept, carried_in_layer, layer_times
from symasym.generated.plain_formulas import tail_left
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


class Stretches(Layered, Protocol):
    """Also what lies beside the layer; `nothing` is the state at an absorbing end."""

    nothing: Any

    def behind(self, state: Any, length: Any, record: Callable[[], Record]) -> Any:
        """sigma and w behind one more stretch, where its length is positive."""

    def outside(self, mirrored: bool, side: int, length: Any) -> Record:
        """A stretch of that length left (side -1) or right (1) of the layer."""


def sides(of: Stretches, r: Any, start: Any) -> tuple[Swept, Swept]:
    """sigma and w on the left and on the right of the start."""
    return _swept(of, False, r, start), _swept(of, True, r, -start)


def _swept(of: Stretches, mirrored: bool, r: Any, x: Any) -> Swept:
    """sigma and w at x, absorbed at -r."""
    before, a, b = np.minimum(x, -1) + r, np.maximum(-r, -1), np.minimum(x, 1)
    state = of.behind(of.nothing, before, lambda: of.outside(mirrored, -1, before))
    state = of.behind(state, b - a, lambda: of.layer(mirrored, a, b))
    swept: Swept = of.behind(state, x - 1, lambda: of.outside(mirrored, 1, x - 1))
    return swept


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
