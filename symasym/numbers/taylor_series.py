"""Taylor series, and series with one power in front, of an expression at a point.

Coefficients are elements of a field of `symasym.numbers.coefficient_fields`; the arithmetic of the
series is that of `symasym.numbers.power_series`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import sympy

from symasym.base.errors import InputError
from symasym.numbers.power_series import exponential, power, product, rotation
from symasym.numbers.trees import FUNCTIONS, evaluate_tree


class NotAnalytic(Exception):
    """The expression has no Taylor series at the point."""


class Series:
    """c[0] + c[1] t + ... + c[n-1] t^(n-1), the rest unknown."""

    __slots__ = ("c", "ring")

    def __init__(self, c: list[Any], ring: Any) -> None:
        self.c, self.ring = c, ring

    def _like(self, other: Any) -> Series:
        if isinstance(other, Series):
            return other
        zero = self.ring.rational(Fraction(0))
        return Series([other] + [zero] * (len(self.c) - 1), self.ring)

    def __neg__(self) -> Series:
        return Series([-x for x in self.c], self.ring)

    def __add__(self, other: Any) -> Series:
        pairs = zip(self.c, self._like(other).c, strict=True)
        return Series([x + y for x, y in pairs], self.ring)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self.__add__(-other)

    def __mul__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return Series([x * other for x in self.c], self.ring)
        return Series(product(self.c, other.c), self.ring)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return Series([x / other for x in self.c], self.ring)
        return self.__mul__(other.power(Fraction(-1)))

    def __rtruediv__(self, other: Any) -> Series:
        return self.power(Fraction(-1)).__mul__(other)

    def power(self, exponent: Any) -> Series:
        """The series to a power that is a Fraction or an element, its constant term not zero."""
        lead = self.c[0]
        if self.ring.is_zero(lead):
            raise NotAnalytic
        if isinstance(exponent, Fraction):
            p, q = exponent.numerator, exponent.denominator
            start = _integer_power(lead, p) if q == 1 else self.ring.power(lead, exponent)
        else:
            p, q = exponent, 1
            start = self.ring.power(lead, exponent)
        return Series(power(self.c, p, q, len(self.c), start), self.ring)

    def times_slope(self, start: Any) -> Series:
        """y with y' = y times this series' derivative and y[0] = start: the exponential."""
        return Series(exponential(self.c, len(self.c), start), self.ring)

    def integrated(self, slope: Series, start: Any) -> Series:
        """y with y' = slope times this series' derivative and y[0] = start."""
        rise = [j * x for j, x in enumerate(self.c)][1:]
        terms = product(rise, slope.c) if rise else []
        return Series([start, *(x / (n + 1) for n, x in enumerate(terms))], self.ring)


class SeriesOps:
    """The elementary functions, for `symasym.numbers.trees.evaluate_tree`."""

    def __init__(self, ring: Any) -> None:
        self.ring = ring

    def rational(self, value: Fraction) -> Any:
        return self.ring.rational(value)

    def pi(self) -> Any:
        return self.ring.expression(sympy.pi)

    def power(self, base: Any, exponent: Fraction) -> Any:
        if isinstance(base, Series):
            return base.power(exponent)
        if self.ring.is_zero(base):
            raise NotAnalytic
        return self.ring.power(base, exponent)

    def sqrt(self, x: Any) -> Any:
        return self.power(x, Fraction(1, 2))

    def __getattr__(self, name: str) -> Any:
        if name not in FUNCTIONS:
            raise AttributeError(name)

        def apply(x: Any) -> Any:
            if isinstance(x, Series):
                return _FUNCTIONS[name](x, self.ring)
            if name == "log" and self.ring.is_zero(x):
                raise NotAnalytic
            return self.ring.call(name, x)

        return apply


def _pair(x: Series, ring: Any, names: tuple[str, str], sign: int) -> tuple[Series, Series]:
    """(sin, cos) with sign -1 or (sinh, cosh) with sign 1."""
    first = ring.call(names[0], x.c[0]), ring.call(names[1], x.c[0])
    s, c = rotation(x.c, len(x.c), first, sign)
    return Series(s, ring), Series(c, ring)


def _log(x: Series, ring: Any) -> Series:
    if ring.is_zero(x.c[0]):
        raise NotAnalytic
    return x.integrated(x.power(Fraction(-1)), ring.call("log", x.c[0]))


def _by_slope(name: str, slope: Callable[[Series, Any], Series]) -> Callable[[Series, Any], Series]:
    return lambda x, ring: x.integrated(slope(x, ring), ring.call(name, x.c[0]))


def _erf_slope(x: Series, ring: Any) -> Series:
    square = -(x * x)
    root = ring.power(ring.expression(sympy.pi), Fraction(-1, 2))
    slope: Series = square.times_slope(ring.call("exp", square.c[0]))
    return slope.__mul__(2 * root)


_ONE, _HALF = Fraction(1), Fraction(-1, 2)
_CIRCULAR, _HYPERBOLIC = ("sin", "cos"), ("sinh", "cosh")
_FUNCTIONS: dict[str, Callable[[Series, Any], Series]] = {
    "exp": lambda x, ring: x.times_slope(ring.call("exp", x.c[0])),
    "log": _log,
    "sin": lambda x, ring: _pair(x, ring, _CIRCULAR, -1)[0],
    "cos": lambda x, ring: _pair(x, ring, _CIRCULAR, -1)[1],
    "tan": lambda x, ring: _ratio(_pair(x, ring, _CIRCULAR, -1)),
    "sinh": lambda x, ring: _pair(x, ring, _HYPERBOLIC, 1)[0],
    "cosh": lambda x, ring: _pair(x, ring, _HYPERBOLIC, 1)[1],
    "tanh": lambda x, ring: _ratio(_pair(x, ring, _HYPERBOLIC, 1)),
    "asin": _by_slope("asin", lambda x, r: (-(x * x) + r.rational(_ONE)).power(_HALF)),
    "acos": _by_slope("acos", lambda x, r: -(-(x * x) + r.rational(_ONE)).power(_HALF)),
    "atan": _by_slope("atan", lambda x, r: (x * x + r.rational(_ONE)).power(-_ONE)),
    "asinh": _by_slope("asinh", lambda x, r: (x * x + r.rational(_ONE)).power(_HALF)),
    "acosh": _by_slope("acosh", lambda x, r: (x * x - r.rational(_ONE)).power(_HALF)),
    "atanh": _by_slope("atanh", lambda x, r: (-(x * x) + r.rational(_ONE)).power(-_ONE)),
    "erf": _by_slope("erf", _erf_slope),
}


def _ratio(pair: tuple[Series, Series]) -> Series:
    return pair[0].__truediv__(pair[1])


def taylor(expression: Any, x: Any, point: Any, side: int, count: int, ring: Any) -> Series:
    """Coefficients of expression(point + side t) in t.

    Raises
    ------
    NotAnalytic
        If there is no Taylor series at the point.
    InputError
        For a function that symasym doesn't evaluate.
    """
    zero = ring.rational(Fraction(0))
    line = [ring.expression(point), ring.rational(Fraction(side))] + [zero] * (count - 2)
    values = {s: ring.symbol(s) for s in expression.free_symbols if s != x}
    values[x] = Series(line[:count], ring)
    try:
        found = evaluate_tree(expression, values, SeriesOps(ring))
    except ZeroDivisionError:
        raise NotAnalytic from None
    return found if isinstance(found, Series) else values[x] * zero + found


#: Exponent (a Fraction or an element of the ring) and the series behind it.
Term = tuple[Any, Series]


def algebraic(expression: Any, x: Any, point: Any, side: int, count: int, ring: Any) -> list[Term]:
    """The expression as a sum of t^e times a Taylor series, t the distance from the point.

    Exponents that differ by an integer are joined; the first coefficient of each is not zero
    (an expression that vanishes to all `count` orders has no term).

    Raises
    ------
    InputError
        For logarithms or essential singularities at the point.
    """

    def walk(node: Any) -> list[Term]:
        try:
            return _normal((Fraction(0), taylor(node, x, point, side, count, ring)))
        except NotAnalytic:
            pass
        except InputError:
            if not node.has(sympy.Abs):
                raise
        if node.is_Add:
            return _joined([term for part in node.args for term in walk(part)])
        if node.is_Mul:
            total = [(Fraction(0), _constant(ring, Fraction(1), count))]
            for part in node.args:
                total = [_product(s, t) for s in total for t in walk(part)]
            return _joined(total)
        if node.is_Pow:
            base = walk(node.base)
            if len(base) == 1 and not node.exp.has(x):
                return [_raised(base[0], node.exp, ring)]
        if isinstance(node, sympy.Abs):
            base = walk(node.args[0])
            if len(base) == 1:
                exponent, series = base[0]
                sign, _ = sign_of_element(series.c[0], ring)
                if sign:
                    return [(exponent, series * ring.rational(Fraction(sign)))]
        raise InputError(
            f"{node} is neither analytic nor an algebraic power at {x} = {point}; Laplace's "
            f"method here takes powers of {x} - ({point}) times analytic functions."
        )

    return walk(expression)


def sign_of_element(element: Any, ring: Any) -> tuple[int | None, bool]:
    from symasym.numbers.coefficient_fields import sign_of

    value = ring.to_expression(element)
    if isinstance(value, sympy.Basic):
        return sign_of(value)
    return (value > 0) - (value < 0), True


def _raised(term: Term, exponent: Any, ring: Any) -> Term:
    front, series = term
    power: Any = None
    if exponent.is_Rational:
        power = Fraction(int(exponent.p), int(exponent.q))
    else:
        power = ring.expression(exponent)
    whole = isinstance(power, Fraction) and power.denominator == 1
    sign, _ = (1, True) if whole else sign_of_element(series.c[0], ring)
    if sign != 1:
        raise InputError(
            f"a power {exponent} of a number that is not positive stands in g near the maximum, "
            "so g is complex there or its sign is unknown; give a real g, or symbols with "
            "positive=True."
        )
    if isinstance(power, Fraction) or isinstance(front, Fraction):
        front = _times(front, power, ring)
    else:
        front = front * power
    return front, series.power(power)


def _times(a: Any, b: Any, ring: Any) -> Any:
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a * b
    return _element(a, ring) * _element(b, ring)


def _plus(a: Any, b: Any, ring: Any) -> Any:
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a + b
    return _element(a, ring) + _element(b, ring)


def _element(a: Any, ring: Any) -> Any:
    return ring.rational(a) if isinstance(a, Fraction) else a


def _product(a: Term, b: Term) -> Term:
    ring, n = a[1].ring, min(len(a[1].c), len(b[1].c))
    first, second = Series(a[1].c[:n], ring), Series(b[1].c[:n], ring)
    return _plus(a[0], b[0], ring), first * second


def _constant(ring: Any, value: Fraction, count: int) -> Series:
    zero = ring.rational(Fraction(0))
    return Series([ring.rational(value)] + [zero] * (count - 1), ring)


def _normal(term: Term) -> list[Term]:
    """Leading zeros counted into the exponent."""
    exponent, series = term
    ring = series.ring
    zeros = [x == 0 or ring.negligible(x, series.c) for x in series.c]
    first = next((k for k, zero in enumerate(zeros) if not zero), None)
    if first is None:
        return []
    return [(_plus(exponent, Fraction(first), ring), Series(series.c[first:], ring))]


def _joined(terms: list[Term]) -> list[Term]:
    found: list[Term] = []
    for exponent, series in terms:
        ring = series.ring
        for index, (known, other) in enumerate(found):
            gap = _whole(_plus(exponent, _times(known, Fraction(-1), ring), ring), ring)
            if gap is None:
                continue
            low, high = (other, series) if gap >= 0 else (series, other)
            base = known if gap >= 0 else exponent
            shift = abs(gap)
            zero = ring.rational(Fraction(0))
            shifted = ([zero] * shift + high.c)[: len(low.c)]
            n = min(len(low.c), len(shifted))
            joined = Series(low.c[:n], ring) + Series(shifted[:n], ring)
            found[index : index + 1] = _normal((base, joined))
            break
        else:
            found.append((exponent, series))
    return found


def _whole(value: Any, ring: Any) -> int | None:
    if not isinstance(value, Fraction):
        expression = sympy.simplify(ring.to_expression(value))
        if not (isinstance(expression, sympy.Basic) and expression.is_Integer):
            return None
        return int(expression)
    return value.numerator if value.denominator == 1 else None


def _integer_power(base: Any, exponent: int) -> Any:
    result = base**0 if exponent == 0 else base ** abs(exponent)
    return 1 / result if exponent < 0 else result
