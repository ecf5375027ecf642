"""T, C and P for strong noise: the layer as one panel of the sweeps (`panel`).

In the layer e^{lam V} is a power series in lam with the moments of V as coefficients;
with x = lam (max V - min V) an integral over a length l is short of its first N + 2 terms by less
than l x^{N+2}/(N+2)! e^x (Taylor's theorem with Lagrange's remainder). Outside the layer all is
closed form. A stretch [a, b] of either is a `Record` with fall = 1, climb = e^{lam (V(a) - V(b))},
and all is sums, products and quotients of positive numbers: of `arb` for one scene, of
`arrays.LogBounds` for arrays, of SymPy's expressions for a formula.

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

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import flint
import numpy as np

from symasym.asymptotics.strong_noise.panel import (
    InLayer,
    Record,
    Swept,
    carried_in_layer,
    layer_times,
)
from symasym.base.call_context import step
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.generated.formulas import tail_left
from symasym.numbers.arithmetic import Number
from symasym.numbers.balls import BallOps, exact_ball, profile_of

if TYPE_CHECKING:
    from flint import arb, arb_poly, fmpq, fmpq_poly


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


# -- moments ---------------------------------------------------------------------------------------


_RATIO = 4
_PANELS = 32
_MOST_PANELS = 4096
# Exact rationals grow with degree times digits; beyond, balls are faster.
_MOST_EXACT = 40_000


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


class _TaylorPanel(NamedTuple):
    """A part of the stretch: A du/dt is the polynomial `slope` of t in [begin, 1], rate = du/dt."""

    rate: Any
    slope: Any
    begin: int


class _Polynomials:
    """A function as one of flint's polynomials on each panel.

    Those longer than `cap`, if there is one, are cut, and what is cut encloses.
    """

    def __init__(self, panels: list[_TaylorPanel], kind: type, cap: int = 0) -> None:
        self._panels, self._cap = panels, cap
        self.one = [kind([1]) for _ in panels]
        self.rate = [kind([panel.rate]) for panel in panels]

    def primitive(self, f: list[Any]) -> tuple[list[Any], Any]:
        """The integral of f dt from the left end, as a function; its value at the right end."""
        integrals, value = [], 0
        for panel, part in zip(self._panels, f, strict=True):
            step()
            whole = part.integral()
            whole += value - whole(panel.begin)
            integrals.append(self._cut(whole) if self._cap else whole)
            value = integrals[-1](1)
        return integrals, value

    def area(self, f: list[Any]) -> Any:
        """The integral of f du over the stretch."""
        total = 0
        for panel, part in zip(self._panels, f, strict=True):
            whole = part.integral()
            total += panel.rate * (whole(1) - whole(panel.begin))
        return total

    def times_slope(self, f: list[Any]) -> list[Any]:
        """A f du/dt."""
        products = []
        for panel, part in zip(self._panels, f, strict=True):
            step()
            products.append(panel.slope * part)
        return products

    def _cut(self, f: arb_poly) -> Any:
        """The polynomial to `cap` coefficients, a ball for the others."""
        c = f.coeffs()
        if len(c) <= self._cap:
            return f
        # Below sum |c_k| on [-1, 1], and so is its integral against anything: a ball at t^0.
        tail = sum((abs(x) for x in c[self._cap :]), flint.arb(0))
        return flint.arb_poly([c[0] + flint.arb(0, tail.abs_upper()), *c[1 : self._cap]])


@lru_cache(maxsize=32)
def moments(drift: Drift, mirrored: bool, a: Fraction, b: Fraction, order: int, bits: int) -> Any:
    """`Moments` of [a, b] inside [-1, 1] up to `order`, in balls, at Arb's precision `bits`.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    mirrored : bool
        Of the drift -A(-u) instead.
    a, b : Fraction
    order : int
    bits : int
        Arb's precision at the moment.

    Examples
    --------
    >>> import symasym as sa
    >>> known = moments(sa.polynomial(1), False, Fraction(-1), Fraction(1), 2, 53)
    >>> [x.str(5, radius=False) for x in known.int_inverse]  # of (u + 1)^k/k!
    ['2.0000', '2.0000', '1.3333']
    """
    coefficients = drift.exact_coefficients()
    if coefficients is None:
        return _of_analytic(drift, mirrored, a, b, order, bits)
    width = _fmpq(b - a)
    signs = (-1, 1) if mirrored else (1, 1)
    exact = [_fmpq(signs[k % 2] * c) for k, c in enumerate(coefficients)]
    local = flint.fmpq_poly(exact)(flint.fmpq_poly([_fmpq(a), width]))
    digits = max(int(x.q).bit_length() for x in (*local.coeffs(), width))
    kind = flint.fmpq_poly if order * len(coefficients) * digits <= _MOST_EXACT else flint.arb_poly
    rate = width if kind is flint.fmpq_poly else flint.arb(width)
    stretch = _Polynomials([_TaylorPanel(rate, kind(local * width), 0)], kind)
    drop, *lists = moments_of(stretch, order, 1)
    int_e, int_inverse, nested = ([flint.arb(x) for x in values] for values in lists)
    return Moments(
        flint.arb(width), flint.arb(drop), int_e, int_inverse, nested, _spread(local, width)
    )


def _fmpq(x: Fraction) -> Any:
    """The fraction as flint's."""
    return flint.fmpq(x.numerator, x.denominator)


def _spread(local: fmpq_poly, length: fmpq) -> Any:
    """An upper bound of max V - min V, from V at `_PANELS` points and the largest slope between."""
    scale = flint.fmpq(1, _PANELS)
    potential = (local * -length).integral()
    low = high = flint.fmpq(0)
    for j in range(_PANELS):
        middle = (2 * j + 1) * scale / 2
        slopes = local(flint.fmpq_poly([middle, scale / 2])).coeffs()
        reach = length * scale / 2 * sum(abs(c) for c in slopes)
        value = potential(middle)
        low, high = min(low, value - reach), max(high, value + reach)
    return flint.arb(high - low).upper()


def _of_analytic(
    drift: Drift, mirrored: bool, a: Fraction, b: Fraction, order: int, bits: int
) -> Moments:
    """Taylor polynomials of A on panels; what they leave out widens the moments."""
    profile = profile_of(drift)
    profile = profile.mirrored() if mirrored else profile
    waiting, pieces = [(a, b)], []
    while waiting:
        step()
        left, right = waiting.pop()
        center, half = (left + right) / 2, (right - left) / 2
        bound = profile.bound(center, _RATIO * half)
        if bound.is_finite() and half <= (b - a) / 48:
            pieces.append((center, half, bound))
        elif len(pieces) + len(waiting) > _MOST_PANELS:
            raise AccuracyError(
                f"no proved bound of A was found near u = {float(center):.6g}, where it may not "
                "be analytic; use method='exact'."
            )
        else:
            waiting += [(center, right), (left, center)]
    terms = bits // 2 + 6  # each is worth log2(_RATIO) = 2 bits
    ratio = flint.arb(_RATIO)
    panels, missed = [], flint.arb(0)
    low = high = level = flint.arb(0)
    for center, half, bound in pieces:
        with_cap = flint.ctx.cap
        flint.ctx.cap = terms
        series = profile.series(center, half, terms)
        flint.ctx.cap = with_cap
        if series.prec < terms:
            raise AccuracyError(
                "flint.ctx.cap was changed from outside while a ball was computed; "
                "use flint from one thread at a time."
            )
        missed = missed.max((bound * ratio ** (-terms) / (1 - 1 / ratio)).abs_upper())
        h = exact_ball(half)
        slope = flint.arb_poly(series.coeffs()) * h
        panels.append(_TaylorPanel(h, slope, -1))
        spread_ball = flint.arb(exact_ball(center), exact_ball(half).abs_upper())
        sign = -1 if mirrored else 1
        size = abs(_on(drift, sign * spread_ball))
        reach = (exact_ball(half) * (size if size.is_finite() else bound)).abs_upper()
        fall = slope.integral()
        middle = level - (fall(0) - fall(-1))
        low, high = (middle - reach).min(low), (middle + reach).max(high)
        level = level - (fall(1) - fall(-1))
    shift = (missed * exact_ball(b - a)).abs_upper()
    spread = (high - low + 2 * shift).abs_upper()
    drop, *lists = moments_of(_Polynomials(panels, flint.arb_poly, terms + 8), order, flint.arb(1))
    length = exact_ball(b - a)
    int_e, int_inverse, nested = (
        _widened(values, size, shift, spread)
        for values, size in zip(lists, (length, length, length**2 / 2), strict=True)
    )
    drop += flint.arb(0, (2 * shift).abs_upper())
    return Moments(length, drop, int_e, int_inverse, nested, spread)


def _on(drift: Drift, ball: arb) -> Any:
    """A ball of A on a ball, not finite where A has a pole there."""
    try:
        return flint.arb(drift.evaluate(ball, BallOps()))
    except ZeroDivisionError:
        return flint.arb.nan()


def _widened(values: list[Any], size: arb, shift: arb, spread: arb) -> list[Any]:
    """Moments of V from those of a potential that differs by `shift` at most.

    `size` is the moment of order 0. The k-th power of a difference of V changes by
    2 shift k spread^(k-1) at most.
    """
    factor, widened = 2 * shift * size, values[:1]
    for k, x in enumerate(values[1:], start=1):
        widened.append(x + flint.arb(0, factor.abs_upper()))
        factor = factor * spread / k
    return widened
