"""Moments of the potential over a stretch of the layer, to any order, proved.

With V measured from the stretch's left end a or right end b, and k! divided out,

    near_k   = int (V(w) - V(b))^k dw / k!,
    far_k    = int (V(a) - V(x))^k dx / k!,
    nested_k = double integral of (V(w) - V(x))^k / k! over a < w < x < b.

All come from one recursion, because V' = -A: f_k(x) = int_a^x A f_{k-1} gives
far_k = int f_k from f_0 = 1, and near_k = f_k(b), nested_k = int f_k from
f_0 = x - a. Nothing is raised to a power and no binomials cancel.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.exact import ball_sweep
from symasym.numbers.balls import exact_ball, flint_module, profile_of

_RATIO = 4
_PANELS = 32
_MOST_PANELS = 4096
# Exact rationals grow with degree times digits; beyond, balls are faster.
_MOST_EXACT = 40_000


class Moments(NamedTuple):
    """Of [a, b]: length, V(a) - V(b), the three lists, and an upper bound of max V - min V."""

    length: Any
    drop: Any
    near: list[Any]
    far: list[Any]
    nested: list[Any]
    spread: Any


class _List:
    """A polynomial as its coefficients, with the part of fmpq_poly's interface used here."""

    def __init__(self, coefficients: list[Any]) -> None:
        self.c = coefficients

    def __mul__(self, other: Any) -> _List:
        if not isinstance(other, _List):
            return _List([x * other for x in self.c])
        total = [self.c[0] * 0] * (len(self.c) + len(other.c) - 1)
        for i, x in enumerate(self.c):
            for j, y in enumerate(other.c):
                total[i + j] += x * y
        return _List(total)

    def __add__(self, constant: Any) -> _List:
        return _List([self.c[0] + constant, *self.c[1:]])

    def integral(self) -> _List:
        return _List([self.c[0] * 0, *(x / (k + 1) for k, x in enumerate(self.c))])

    def __call__(self, x: Any) -> Any:
        total = self.c[-1]
        for c in self.c[-2::-1]:
            total = total * x + c
        return total


class _Panel(NamedTuple):
    """A stretch on which du/dt * A is the polynomial `slope` of t in [begin, 1], du/dt = `rate`.

    Polynomials longer than `cap`, if there is one, are cut, and what is cut encloses.
    """

    rate: Any
    slope: Any
    unit: Any  # the polynomial 1
    begin: int = 0
    cap: int = 0

    def primitive(self, f: Any, offset: Any) -> Any:
        """The primitive of a polynomial that is `offset` at the beginning."""
        found = f.integral()
        found = found + (offset - found(self.begin)) if self.begin else found + offset
        return self._cut(found) if self.cap else found

    def area(self, f: Any, one: Any) -> Any:
        """Integral over the panel in u."""
        found = f.integral()
        return self.rate * (found(one) - found(self.begin) if self.begin else found(one))

    def _cut(self, f: Any) -> Any:
        flint = flint_module()
        c = f.coeffs()
        if len(c) <= self.cap:
            return f
        # Below sum |c_k| on [-1, 1], and so is its integral against anything: a ball at t^0.
        rest = sum((abs(x) for x in c[self.cap :]), flint.arb(0))
        return flint.arb_poly([c[0] + flint.arb(0, rest.abs_upper()), *c[1 : self.cap]])


def _iterated(panels: list[_Panel], grown: bool, order: int, zero: Any, one: Any) -> Any:
    """(f_k at the end, integral of f_k) for k = 0..order; f_0 is x - a if `grown`, else 1."""
    ends, areas = [], []
    offset, area, functions = zero, zero, []
    for panel in panels:
        f = panel.primitive(panel.unit * panel.rate, offset) if grown else panel.unit
        functions.append(f)
        area += panel.area(f, one)
        offset = f(one)
    ends.append(offset)
    areas.append(area)
    for _ in range(order):
        offset, area = zero, zero
        for k, panel in enumerate(panels):
            functions[k] = panel.primitive(panel.slope * functions[k], offset)
            area += panel.area(functions[k], one)
            offset = functions[k](one)
        ends.append(offset)
        areas.append(area)
    return ends, areas


@lru_cache(maxsize=32)
def moments(drift: Drift, mirrored: bool, a: Fraction, b: Fraction, order: int, bits: int) -> Any:
    """`Moments` of [a, b] inside [-1, 1] up to `order`, as rationals or enclosures.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    mirrored : bool
        Of the drift -A(-u) instead.
    a, b : Fraction
    order : int
    bits : int
        Working precision where A is no polynomial, and of `spread`.

    Examples
    --------
    >>> import symasym as sa
    >>> found = moments(sa.polynomial(1), False, Fraction(-1), Fraction(1), 2, 64)
    >>> [str(x) for x in found.far]  # of (u + 1)^k/k!
    ['2', '2', '4/3']
    """
    coefficients = drift.exact_coefficients()
    if coefficients is None and not ball_sweep.available():
        raise AccuracyError(
            "proved moments of a drift that is no polynomial need python-flint, which is not "
            "installed; install it with pip install python-flint, or use method='exact'."
        )
    if coefficients is None:
        return _of_analytic(drift, mirrored, a, b, order, bits)
    if mirrored:
        coefficients = [c if k % 2 else -c for k, c in enumerate(coefficients)]
    local = _shifted(coefficients, a, b - a)
    if not ball_sweep.available():
        lists = [_Panel(b - a, _List([(b - a) * c for c in local]), _List([Fraction(1)]))]
        return _collected(lists, order, Fraction(0), Fraction(1), _spread(local, b - a))
    flint = flint_module()
    size = order * len(local) * max(x.denominator.bit_length() for x in (*local, b - a))
    if size <= _MOST_EXACT:
        slope = flint.fmpq_poly([_fmpq((b - a) * c) for c in local])
        one, width = flint.fmpq(1), _fmpq(b - a)
        unit = flint.fmpq_poly([1])
    else:
        slope = flint.arb_poly([exact_ball((b - a) * c) for c in local])
        one, width = flint.arb(1), exact_ball(b - a)
        unit = flint.arb_poly([1])
    return _collected([_Panel(width, slope, unit)], order, 0 * one, one, _spread(local, b - a))


def _fmpq(x: Fraction) -> Any:
    return flint_module().fmpq(x.numerator, x.denominator)


def _collected(panels: list[_Panel], order: int, zero: Any, one: Any, spread: Any) -> Moments:
    near, nested = _iterated(panels, True, order, zero, one)
    falls, far = _iterated(panels, False, max(order, 1), zero, one)
    return Moments(near[0], falls[1], near, far[: order + 1], nested, spread)


def _shifted(coefficients: list[Fraction], a: Fraction, length: Fraction) -> list[Fraction]:
    """Coefficients of A(a + length t) in t."""
    work = list(coefficients)
    degree = len(work) - 1
    for lowest in range(degree):
        for k in range(degree - 1, lowest - 1, -1):
            work[k] += work[k + 1] * a
    return [c * length**k for k, c in enumerate(work)]


def _spread(local: list[Fraction], length: Fraction) -> Fraction:
    """An upper bound of max V - min V, from V at `_PANELS` places and the largest slope between."""
    scale = Fraction(1, _PANELS)
    potential = [Fraction(0), *(-length * c / (k + 1) for k, c in enumerate(local))]
    low = high = Fraction(0)
    for j in range(_PANELS):
        middle = (j + Fraction(1, 2)) * scale
        value = sum(c * middle**k for k, c in enumerate(potential))
        slopes = _shifted(local, middle, scale / 2)
        reach = length * scale / 2 * sum(abs(c) for c in slopes)
        low, high = min(low, value - reach), max(high, value + reach)
    # A short rational above it: the digits of the exact one are of no use.
    return Fraction(-((low - high) * (1 << 40) // 1), 1 << 40)


def _of_analytic(
    drift: Drift, mirrored: bool, a: Fraction, b: Fraction, order: int, bits: int
) -> Moments:
    """Taylor polynomials of A on panels; what they leave out widens the moments."""
    flint = flint_module()
    profile = profile_of(drift)
    profile = profile.mirrored() if mirrored else profile
    waiting, pieces = [(a, b)], []
    while waiting:
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
    low = high = place = flint.arb(0)
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
        slope = flint.arb_poly(series.coeffs()) * flint.arb_poly([h])
        panels.append(_Panel(h, slope, flint.arb_poly([1]), -1, terms + 8))
        spread_ball = flint.arb(exact_ball(center), exact_ball(half).abs_upper())
        sign = -1 if mirrored else 1
        size = abs(_on(drift, sign * spread_ball))
        reach = (exact_ball(half) * (size if size.is_finite() else bound)).abs_upper()
        fall = panels[-1].primitive(slope, flint.arb(0))
        middle = place - fall(flint.arb(0))
        low, high = (middle - reach).min(low), (middle + reach).max(high)
        place = place - fall(flint.arb(1))
    shift = (missed * exact_ball(b - a)).abs_upper()
    spread = (high - low + 2 * shift).abs_upper()
    found = _collected(panels, order, flint.arb(0), flint.arb(1), spread)
    return _widened(found, shift, exact_ball(b - a))


def _on(drift: Drift, place: Any) -> Any:
    from symasym.numbers.balls import BallOps

    try:
        return flint_module().arb(drift.evaluate(place, BallOps()))
    except ZeroDivisionError:
        return flint_module().arb.nan()


def _widened(found: Moments, shift: Any, length: Any) -> Moments:
    """The moments of V from those of a potential that differs by `shift` at most.

    The k-th power of a difference of V changes by 2 shift k (spread)^(k-1) at most.
    """
    flint = flint_module()
    lists: list[list[Any]] = []
    for values, size in ((found.near, length), (found.far, length), (found.nested, length**2 / 2)):
        factor, widened = 2 * shift * size, []
        for k, x in enumerate(values):
            widened.append(x + flint.arb(0, factor.abs_upper()) if k else x)
            if k:
                factor = factor * found.spread / k
        lists.append(widened)
    drop = found.drop + flint.arb(0, (2 * shift).abs_upper())
    near, far, nested = lists
    return Moments(found.length, drop, near, far, nested, found.spread)
