"""Proved isolation of the zeros of A in an interval, with their multiplicities and kinds.

The roots of a polynomial with rational coefficients are isolated by flint. For any other A the
interval is bisected. If the enclosure of A over a subinterval excludes 0, there is no zero in it.
If the enclosure of A' excludes 0, the signs at the end points decide whether there is exactly one
zero, which the interval Newton method refines. If A and its first m - 1 derivatives vanish exactly
at a rational point and the enclosure of the m-th excludes 0, that point is the only zero.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

from flint import arb, arb_series, ctx, fmpq, fmpq_poly

from symasym.base.balls import Unresolved, precision, rational, rounded
from symasym.base.errors import AccuracyError
from symasym.drift.evaluate import halved, profile
from symasym.drift.formula import Formula, vanishes
from symasym.drift.model import Parametrized

#: The names and values of a formula's parameters.
Values = tuple[tuple[str, Fraction], ...]

_DIGITS = 60
_BITS = (256, 1024, 4096)
_MOST, _NARROW = 20_000, 240  # the largest numbers of intervals and of successive halvings
_HIGHEST = 8  # the largest multiplicity searched for
_FIRST = fmpq(50, 97)  # position of the first cut, chosen so that no cut is a simple number


@dataclass(frozen=True)
class CriticalPoint:
    """A zero of A inside (-1, 1), or anywhere for a drift without a layer.

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


def formula_of(drift: Parametrized, k: int) -> tuple[Formula, Values]:
    """The formula of the k-th piece and the values of its parameters."""
    formula, values = drift.model.pieces[k], drift.values
    return formula, tuple((name, values[name]) for name in formula.symbols)


@lru_cache(maxsize=128)
def known(formula: Formula, values: Values, low: Any, high: Any) -> tuple[CriticalPoint, ...]:
    """The zeros of A in (low, high); the result is cached for equal formulas and values."""
    coefficients = formula.exact_coefficients(dict(values))
    find = partial(_of_analytic, formula, values, low, high)
    if coefficients is not None:
        find = partial(_of_polynomial, fmpq_poly([rational(c) for c in coefficients]), low, high)
    for bits in _BITS:
        with suppress(Unresolved), precision(bits):
            return tuple(find())
    raise AccuracyError(
        "A is 0 on all of [-1, 1], too steep, or has zeros or terms that 1,000 digits do not tell "
        "apart; change A, or give it in a form in which its terms do not cancel."
    )


def _point(u: arb, multiplicity: int, rising: bool) -> CriticalPoint:
    kind = "inflection" if multiplicity % 2 == 0 else "barrier" if rising else "well"
    return CriticalPoint(rounded(u, _DIGITS)[0], multiplicity, kind)


def _of_polynomial(p: Any, low: Any, high: Any) -> list[CriticalPoint]:
    """The zeros of a polynomial; flint returns real roots with an imaginary part of exactly 0."""
    if not p:
        raise Unresolved
    for end, side in ((low, 1), (high, -1)):
        while p(end) == 0:
            p = p / fmpq_poly([-end * side, side])  # a divisor that is positive on (low, high)
    roots = [(z.real, m) for z, m in p.numer().complex_roots() if z.imag.is_zero()]
    roots.sort(key=lambda root: root[0].mid())
    apart = all(a[0] < b[0] for a, b in pairwise(roots))
    if not apart or not all(x < low or low < x < high or x > high for x, _ in roots):
        raise Unresolved
    points, sign = [], 1 if p.coeffs()[-1] > 0 else -1
    for x, m in reversed(roots):  # right of all roots A has the sign of its leading coefficient
        if low < x < high:
            points.append(_point(x, m, sign > 0))
        sign = -sign if m % 2 else sign
    return points[::-1]


def _of_analytic(formula: Formula, values: Values, low: Any, high: Any) -> list[CriticalPoint]:
    """The zeros of any other A; raises Unresolved if they take too many intervals."""
    f, found = _Function(formula, values, low, high), list[CriticalPoint]()
    first, step = low + (high - low) * _FIRST, (high - low) / 18
    if all(f.phi(arb(low + step * k)).contains(0) for k in range(1, 18)):
        raise Unresolved

    def told(middle: fmpq, half: fmpq) -> bool:
        zeros = f.zeros(middle - half, middle + half)
        found.extend(zeros or ())
        return zeros is not None

    for a, b in ((low, first), (first, high)):
        if halved(a, b, told, _MOST, _NARROW)[1] is not None:
            raise Unresolved
    return found


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

    def zeros(self, a: Any, b: Any) -> list[CriticalPoint] | None:
        """The at most one zero of A in [a, b), `low` excluded; None if this is undecided."""
        m = arb((a + b) / 2)
        x = arb(m, arb((b - a) / 2))
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
                return [_point(arb(a), 1, rising)]
            if left * right >= 0:
                return []
            return [_point(arb(u) if self.vanishes(u, 0) else self.refined(x), 1, rising)]
        order = next((k for k in range(_HIGHEST) if not self.vanishes(u, k)), 0)
        if order < 2 or terms[order].contains(0):
            return None
        inside = self.low < u < b
        return [_point(arb(u), order, bool(terms[order] > 0))] if inside else []

    def refined(self, x: Any) -> Any:
        """The only zero in the ball x to `_DIGITS` digits, by the interval Newton method."""
        for _ in range(4 * ctx.prec):
            m = arb(x.mid())
            value = self.phi(m)
            x = x.intersection(m - value / self.series(x, 2)[1])
            if x.rel_accuracy_bits() > 3.33 * _DIGITS:
                return x
            if value.contains(0):
                break
        raise Unresolved


def _simplest(a: Any, b: Any) -> Any:
    """A rational number with a small denominator in [a, b]."""
    middle, k = Fraction(int((a + b).p), 2 * int((a + b).q)), 1
    while not a <= (u := rational(middle.limit_denominator(k))) <= b:
        k *= 2
    return u
