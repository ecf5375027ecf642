"""Proved isolation of the zeros of A in an interval, with their multiplicities and kinds.

The roots of a polynomial with rational coefficients are isolated by flint. For any other A the
interval is bisected. If the enclosure of A over a subinterval excludes 0, there is no zero in it.
If the enclosure of A' excludes 0, the signs at the end points decide whether there is exactly one
zero, which the interval Newton method refines. If A and its first m - 1 derivatives vanish exactly
at a rational point and the enclosure of the m-th excludes 0, that point is the only zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from flint import arb, arb_series, ctx, fmpq, fmpq_poly

from symasym.base.balls import precision, rounded
from symasym.base.errors import AccuracyError, RegionError
from symasym.drift.evaluate import halved, profile
from symasym.drift.formula import Formula, rational, vanishes
from symasym.drift.model import Parametrized

#: The names and values of a formula's parameters.
Values = tuple[tuple[str, Fraction], ...]

_DIGITS = 60
_BITS = (256, 1024, 4096)
_MOST_DIGITS = 1_000
_MOST, _NARROW = 20_000, 240  # the largest numbers of intervals and of successive halvings
_HIGHEST = 8  # the largest multiplicity searched for
_FIRST = fmpq(50, 97)  # position of the first cut, chosen so that no cut is a simple number


@dataclass(frozen=True)
class CriticalPoint:
    """A zero of A inside (-1, 1).

    Attributes
    ----------
    u : mpf
        Its position, correct to 50 digits.
    multiplicity : int
        Order of the zero.
    kind : str
        ``"well"`` (stable: V has a minimum), ``"barrier"`` (unstable) or
        ``"inflection"`` (A keeps its sign: a fold point, for multiplicity 2).
    """

    u: Any
    multiplicity: int
    kind: str


def critical_points(drift: Parametrized) -> list[CriticalPoint]:
    """The zeros of A in (-1, 1), from left to right.

    Raises
    ------
    AccuracyError
        If A vanishes on all of [-1, 1], or two zeros cannot be separated.
    """
    drift.scalars()
    if not drift.model.layered:
        raise RegionError(f"{drift!r} has no layer; give a drift with a layer (-1, 1).")
    return list(known(*formula_of(drift, 0), fmpq(-1), fmpq(1)))


def formula_of(drift: Parametrized, k: int) -> tuple[Formula, Values]:
    """The formula of the k-th piece and the values of its parameters."""
    formula, values = drift.model.pieces[k], drift.values
    return formula, tuple((name, values[name]) for name in formula.symbols)


@lru_cache(maxsize=128)
def known(formula: Formula, values: Values, low: Any, high: Any) -> tuple[CriticalPoint, ...]:
    """The zeros of A in (low, high); the result is cached for equal formulas and values."""
    coefficients = formula.exact_coefficients(dict(values))
    if coefficients is None:
        return tuple(_of_analytic(formula, values, low, high))
    if not any(coefficients):
        raise AccuracyError("A is 0 on all of [-1, 1], so every point is critical; change A.")
    return tuple(_of_polynomial(fmpq_poly([rational(c) for c in coefficients]), low, high))


def _point(u: arb, multiplicity: int, rising: bool) -> CriticalPoint:
    kind = "inflection" if multiplicity % 2 == 0 else "barrier" if rising else "well"
    return CriticalPoint(rounded(u, _DIGITS)[0], multiplicity, kind)


def _of_polynomial(p: Any, low: Any, high: Any) -> list[CriticalPoint]:
    """The zeros of a polynomial; flint returns real roots with an imaginary part of exactly 0."""
    for end, side in ((low, 1), (high, -1)):
        while p(end) == 0:
            p = p / fmpq_poly([-end * side, side])  # a divisor that is positive on (low, high)
    for bits in _BITS:
        with precision(bits):
            found: list[Any] = p.numer().complex_roots()
            roots = [(z.real, m) for z, m in found if z.imag.is_zero()]
            roots.sort(key=lambda root: root[0].mid())
            apart = all(a[0] < b[0] for a, b in pairwise(roots))
            if apart and all(x < low or low < x < high or x > high for x, _ in roots):
                break
    else:
        raise AccuracyError(f"A has zeros closer than 1e-{_MOST_DIGITS}; change A.")
    points, sign = [], 1 if p.coeffs()[-1] > 0 else -1
    for x, m in reversed(roots):  # right of all roots A has the sign of its leading coefficient
        if low < x < high:
            points.append(_point(x, m, sign > 0))
        sign = -sign if m % 2 else sign
    return points[::-1]


class _Zero(NamedTuple):
    """A zero that is the only one in [a, b]."""

    a: Any
    b: Any
    multiplicity: int
    rising: bool


class _Function:
    """Enclosures of A over subintervals of (low, high) at the current precision."""

    def __init__(self, formula: Formula, values: Values, low: Any, high: Any):
        self.formula, self.values, self.low, self.high = formula, values, low, high
        self.phi = profile(formula, {name: rational(x) for name, x in values})

    def series(self, x: Any, count: int) -> list[Any]:
        """Enclosures of the first Taylor coefficients of A at every point of the ball x."""
        ctx.cap = count
        series = list(self.phi(arb_series([x, 1], count)))
        return (series + [arb(0)] * count)[:count]

    def sign(self, u: Any) -> int | None:
        """The sign of A at a point, 0 if A vanishes exactly; None if it cannot be decided."""
        value = self.phi(arb(u))
        if not value.contains(0):
            return 1 if value > 0 else -1
        return 0 if self.vanishes(u, 0) else None

    def vanishes(self, u: Any, order: int) -> bool:
        """True if the derivative of A of this order is exactly 0 at u."""
        value = self.series(arb(u), order + 1)[order]
        if not value.contains(0) or value.is_zero():
            return bool(value.is_zero())
        return vanishes(self.formula, self.values, Fraction(int(u.p), int(u.q)), order)

    def zeros(self, a: Any, b: Any) -> list[_Zero] | None:
        """The at most one zero of A in [a, b), `low` excluded; None if this is undecided."""
        x, m = _between(a, b), arb((a + b) / 2)
        # A is enclosed directly and by the mean value theorem.
        if not self.phi(x).contains(0) or not (
            (self.phi(m) + self.series(x, 2)[1] * (x - m)).contains(0)
        ):
            return []
        terms = self.series(x, _HIGHEST + 1)
        u, rising = _simplest(a, b), bool(terms[1] > 0)
        if not terms[1].contains(0):
            left, right = self.sign(a), self.sign(b)
            if left is None or right is None:
                return None
            if left == 0 and a > self.low:
                return [_Zero(a, a, 1, rising)]
            if left * right >= 0:
                return []
            return [_Zero(*((u, u) if self.vanishes(u, 0) else (a, b)), 1, rising)]
        order = next((k for k in range(_HIGHEST) if not self.vanishes(u, k)), 0)
        if order < 2 or terms[order].contains(0):
            return None
        inside = self.low < u < b
        return [_Zero(u, u, order, bool(terms[order] > 0))] if inside else []


def _between(a: Any, b: Any) -> Any:
    return arb((a + b) / 2, arb((b - a) / 2))


def _simplest(a: Any, b: Any) -> Any:
    """A rational number with a small denominator in [a, b]."""
    middle, k = Fraction(int((a + b).p), 2 * int((a + b).q)), 1
    while not a <= (u := rational(middle.limit_denominator(k))) <= b:
        k *= 2
    return u


def _of_analytic(formula: Formula, values: Values, low: Any, high: Any) -> list[CriticalPoint]:
    for bits in _BITS:
        with precision(bits):
            found = _isolated(_Function(formula, values, low, high))
        if found is not None:
            return [_point(_refined(formula, values, z), z.multiplicity, z.rising) for z in found]
    raise AccuracyError(
        "A is 0 on [-1, 1], or has zeros or terms that 1,000 digits do not tell apart; give "
        "A as a polynomial, or in a form in which its terms do not cancel."
    )


def _isolated(f: _Function) -> list[_Zero] | None:
    """All zeros in (low, high), each in its own interval; None if that takes too many intervals."""
    found: list[_Zero] = []
    first, step = f.low + (f.high - f.low) * _FIRST, (f.high - f.low) / 18
    if all(f.phi(arb(f.low + step * k)).contains(0) for k in range(1, 18)):
        return None

    def told(middle: fmpq, half: fmpq) -> bool:
        zeros = f.zeros(middle - half, middle + half)
        found.extend(zeros or ())
        return zeros is not None

    for a, b in ((f.low, first), (first, f.high)):
        if halved(a, b, told, _MOST, _NARROW)[1] is not None:
            return None
    return found


def _refined(formula: Formula, values: Values, zero: _Zero) -> Any:
    """The zero to `_DIGITS` digits by the interval Newton method."""
    for bits in _BITS:
        with precision(bits):
            f, x = _Function(formula, values, zero.a, zero.b), _between(zero.a, zero.b)
            if zero.a == zero.b:
                return x
            for _ in range(4 * bits):
                m = arb(x.mid())
                value = f.phi(m)
                x = x.intersection(m - value / f.series(x, 2)[1])
                if x.rel_accuracy_bits() > 3.33 * _DIGITS:
                    return x
                if value.contains(0):
                    break
    raise AccuracyError(
        f"A is too steep near u = {float(zero.a):.6g} for the digits of its zero there; take a "
        "less steep A."
    )
