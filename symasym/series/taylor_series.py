"""Taylor series, and series with one power in front, of an expression at a point.

Coefficients are elements of a field of `symasym.series.coefficient_fields`; the arithmetic of the
series is that of `symasym.numbers.polynomials`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import sympy

from symasym.base.errors import InputError
from symasym.numbers.polynomials import exponential, power, product, rotation
from symasym.numbers.trees import FUNCTIONS, evaluate_tree
from symasym.series.coefficient_fields import CoefficientField, Element, sign_of


class NotAnalytic(Exception):
    """The expression has no Taylor series at the point."""


class Series:
    """c[0] + c[1] t + ... + c[n-1] t^(n-1), the rest unknown."""

    __slots__ = ("c", "field")

    def __init__(self, c: list[Any], field: CoefficientField) -> None:
        self.c, self.field = c, field

    def _like(self, other: Series | Element) -> Series:
        """`other` as a series of this length."""
        if isinstance(other, Series):
            return other
        zero = self.field.rational(Fraction(0))
        return Series([other] + [zero] * (len(self.c) - 1), self.field)

    def __neg__(self) -> Series:
        return Series([-x for x in self.c], self.field)

    def __add__(self, other: Series | Element) -> Series:
        pairs = zip(self.c, self._like(other).c, strict=True)
        return Series([x + y for x, y in pairs], self.field)

    __radd__ = __add__

    def __sub__(self, other: Series | Element) -> Series:
        return self.__add__(-other)

    def __mul__(self, other: Series | Element) -> Series:
        if not isinstance(other, Series):
            return Series([x * other for x in self.c], self.field)
        return Series(product(self.c, other.c), self.field)

    __rmul__ = __mul__

    def __truediv__(self, other: Series | Element) -> Series:
        if not isinstance(other, Series):
            return Series([x / other for x in self.c], self.field)
        return self.__mul__(other.power(Fraction(-1)))

    def __rtruediv__(self, other: Series | Element) -> Series:
        return self.power(Fraction(-1)).__mul__(other)

    def power(self, exponent: Fraction | Element) -> Series:
        """The series to a power that is a Fraction or an element, its constant term not zero."""
        lead = self.c[0]
        if self.field.is_zero(lead):
            raise NotAnalytic
        if isinstance(exponent, Fraction):
            p, q = exponent.numerator, exponent.denominator
            start = _integer_power(lead, p) if q == 1 else self.field.power(lead, exponent)
        else:
            p, q = exponent, 1
            start = self.field.power(lead, exponent)
        return Series(power(self.c, p, q, len(self.c), start), self.field)

    def times_slope(self, start: Element) -> Series:
        """y with y' = y times this series' derivative and y[0] = start: the exponential."""
        return Series(exponential(self.c, len(self.c), start), self.field)

    def integrated(self, slope: Series, start: Element) -> Series:
        """y with y' = slope times this series' derivative and y[0] = start."""
        rise = [j * x for j, x in enumerate(self.c)][1:]
        terms = product(rise, slope.c) if rise else []
        return Series([start, *(x / (n + 1) for n, x in enumerate(terms))], self.field)


class SeriesOps:
    """The elementary functions, for `symasym.numbers.trees.evaluate_tree`."""

    def __init__(self, field: CoefficientField) -> None:
        self.field = field

    def rational(self, value: Fraction) -> Any:
        return self.field.rational(value)

    def pi(self) -> Any:
        return self.field.expression(sympy.pi)

    def power(self, base: Series | Element, exponent: Fraction) -> Any:
        """A rational power of a series or a constant; `NotAnalytic` at zero."""
        if isinstance(base, Series):
            return base.power(exponent)
        if self.field.is_zero(base):
            raise NotAnalytic
        return self.field.power(base, exponent)

    def sqrt(self, x: Series | Element) -> Any:
        return self.power(x, Fraction(1, 2))

    def __getattr__(self, name: str) -> Any:
        if name not in FUNCTIONS:
            raise AttributeError(name)

        def apply(x: Series | Element) -> Any:
            """The function of a series, or of a constant."""
            if isinstance(x, Series):
                return _FUNCTIONS[name](x, self.field)
            if name == "log" and self.field.is_zero(x):
                raise NotAnalytic
            return self.field.call(name, x)

        return apply


def _pair(
    x: Series, field: CoefficientField, names: tuple[str, str], sign: int
) -> tuple[Series, Series]:
    """(sin, cos) with sign -1 or (sinh, cosh) with sign 1."""
    first = field.call(names[0], x.c[0]), field.call(names[1], x.c[0])
    s, c = rotation(x.c, len(x.c), first, sign)
    return Series(s, field), Series(c, field)


def _log(x: Series, field: CoefficientField) -> Series:
    """log x by its derivative, x'/x."""
    if field.is_zero(x.c[0]):
        raise NotAnalytic
    return x.integrated(x.power(Fraction(-1)), field.call("log", x.c[0]))


def _by_slope(name: str, slope: Callable[[Series, Any], Series]) -> Callable[[Series, Any], Series]:
    """The function whose derivative is `slope` times that of its argument."""
    return lambda x, field: x.integrated(slope(x, field), field.call(name, x.c[0]))


def _erf_slope(x: Series, field: CoefficientField) -> Series:
    """2 e^(-x^2)/sqrt(pi)."""
    square = -(x * x)
    root = field.power(field.expression(sympy.pi), Fraction(-1, 2))
    slope: Series = square.times_slope(field.call("exp", square.c[0]))
    return slope.__mul__(2 * root)


_ONE, _HALF = Fraction(1), Fraction(-1, 2)
_CIRCULAR, _HYPERBOLIC = ("sin", "cos"), ("sinh", "cosh")
_FUNCTIONS: dict[str, Callable[[Series, Any], Series]] = {
    "exp": lambda x, field: x.times_slope(field.call("exp", x.c[0])),
    "log": _log,
    "sin": lambda x, field: _pair(x, field, _CIRCULAR, -1)[0],
    "cos": lambda x, field: _pair(x, field, _CIRCULAR, -1)[1],
    "tan": lambda x, field: _ratio(_pair(x, field, _CIRCULAR, -1)),
    "sinh": lambda x, field: _pair(x, field, _HYPERBOLIC, 1)[0],
    "cosh": lambda x, field: _pair(x, field, _HYPERBOLIC, 1)[1],
    "tanh": lambda x, field: _ratio(_pair(x, field, _HYPERBOLIC, 1)),
    "asin": _by_slope("asin", lambda x, r: (-(x * x) + r.rational(_ONE)).power(_HALF)),
    "acos": _by_slope("acos", lambda x, r: -(-(x * x) + r.rational(_ONE)).power(_HALF)),
    "atan": _by_slope("atan", lambda x, r: (x * x + r.rational(_ONE)).power(-_ONE)),
    "asinh": _by_slope("asinh", lambda x, r: (x * x + r.rational(_ONE)).power(_HALF)),
    "acosh": _by_slope("acosh", lambda x, r: (x * x - r.rational(_ONE)).power(_HALF)),
    "atanh": _by_slope("atanh", lambda x, r: (-(x * x) + r.rational(_ONE)).power(-_ONE)),
    "erf": _by_slope("erf", _erf_slope),
}


def _ratio(pair: tuple[Series, Series]) -> Series:
    """The first series over the second."""
    return pair[0].__truediv__(pair[1])


def taylor(
    expression: sympy.Expr,
    x: sympy.Symbol,
    point: sympy.Expr,
    side: int,
    count: int,
    field: CoefficientField,
) -> Series:
    """Coefficients of expression(point + side t) in t.

    Raises
    ------
    NotAnalytic
        If there is no Taylor series at the point.
    InputError
        For a function that symasym doesn't evaluate.
    """
    zero = field.rational(Fraction(0))
    line = [field.expression(point), field.rational(Fraction(side))] + [zero] * (count - 2)
    values = {s: field.symbol(s) for s in expression.free_symbols if s != x}
    values[x] = Series(line[:count], field)
    try:
        value = evaluate_tree(expression, values, SeriesOps(field))
    except ZeroDivisionError:
        raise NotAnalytic from None
    return value if isinstance(value, Series) else values[x] * zero + value


#: Exponent (a Fraction or an element of the field) and the series behind it.
Term = tuple[Any, Series]


def algebraic(
    expression: sympy.Expr,
    x: sympy.Symbol,
    point: sympy.Expr,
    side: int,
    count: int,
    field: CoefficientField,
) -> list[Term]:
    """The expression as a sum of t^e times a Taylor series, t the distance from the point.

    Exponents that differ by an integer are joined; the first coefficient of each is not zero
    (an expression that vanishes to all `count` orders has no term).

    Raises
    ------
    InputError
        For logarithms or essential singularities at the point.
    """

    def walk(node: sympy.Expr) -> list[Term]:
        """The terms of one node of the expression."""
        try:
            return _normal((Fraction(0), taylor(node, x, point, side, count, field)))
        except NotAnalytic:
            pass
        except InputError:
            if not node.has(sympy.Abs):
                raise
        if node.is_Add:
            return _joined([term for part in node.args for term in walk(part)])
        if node.is_Mul:
            total = [(Fraction(0), _constant(field, Fraction(1), count))]
            for part in node.args:
                total = [_product(s, t) for s in total for t in walk(part)]
            return _joined(total)
        if node.is_Pow:
            base = walk(node.base)
            if len(base) == 1 and not node.exp.has(x):
                return [_raised(base[0], node.exp, field)]
        if isinstance(node, sympy.Abs):
            base = walk(node.args[0])
            if len(base) == 1:
                exponent, series = base[0]
                sign, _ = sign_of_element(series.c[0], field)
                if sign:
                    return [(exponent, series * field.rational(Fraction(sign)))]
        raise InputError(
            f"{node} is neither analytic nor an algebraic power at {x} = {point}; Laplace's "
            f"method here takes powers of {x} - ({point}) times analytic functions."
        )

    return walk(expression)


def sign_of_element(element: Element, field: CoefficientField) -> tuple[int | None, bool]:
    """The sign of an element, and True if it is certain (see `sign_of`)."""
    value = field.to_expression(element)
    if isinstance(value, sympy.Basic):
        return sign_of(value)
    return (value > 0) - (value < 0), True


def _raised(term: Term, exponent: sympy.Expr, field: CoefficientField) -> Term:
    """A term to a power: its exponent times that power, and the power of its series."""
    front, series = term
    power: Any = None
    if exponent.is_Rational:
        power = Fraction(int(exponent.p), int(exponent.q))
    else:
        power = field.expression(exponent)
    whole = isinstance(power, Fraction) and power.denominator == 1
    sign, _ = (1, True) if whole else sign_of_element(series.c[0], field)
    if sign != 1:
        raise InputError(
            f"a power {exponent} of a number that is not positive stands in g near the maximum, "
            "so g is complex there or its sign is unknown; give a real g, or symbols with "
            "positive=True."
        )
    if isinstance(power, Fraction) or isinstance(front, Fraction):
        front = _times(front, power, field)
    else:
        front = front * power
    return front, series.power(power)


def _times(a: Fraction | Element, b: Fraction | Element, field: CoefficientField) -> Any:
    """The product of two exponents, a Fraction if both are."""
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a * b
    return _element(a, field) * _element(b, field)


def _plus(a: Fraction | Element, b: Fraction | Element, field: CoefficientField) -> Any:
    """The sum of two exponents, a Fraction if both are."""
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a + b
    return _element(a, field) + _element(b, field)


def _element(a: Fraction | Element, field: CoefficientField) -> Any:
    """An exponent as an element of the field."""
    return field.rational(a) if isinstance(a, Fraction) else a


def _product(a: Term, b: Term) -> Term:
    """The product of two terms."""
    field, n = a[1].field, min(len(a[1].c), len(b[1].c))
    first, second = Series(a[1].c[:n], field), Series(b[1].c[:n], field)
    return _plus(a[0], b[0], field), first * second


def _constant(field: CoefficientField, value: Fraction, count: int) -> Series:
    """The series of a constant."""
    zero = field.rational(Fraction(0))
    return Series([field.rational(value)] + [zero] * (count - 1), field)


def _normal(term: Term) -> list[Term]:
    """Leading zeros counted into the exponent."""
    exponent, series = term
    field = series.field
    zeros = [x == 0 or field.negligible(x, series.c) for x in series.c]
    first = next((k for k, zero in enumerate(zeros) if not zero), None)
    if first is None:
        return []
    return [(_plus(exponent, Fraction(first), field), Series(series.c[first:], field))]


def _joined(terms: list[Term]) -> list[Term]:
    """The terms, those whose exponents differ by a whole number as one."""
    joined: list[Term] = []
    for exponent, series in terms:
        field = series.field
        for index, (known, other) in enumerate(joined):
            gap = _whole(_plus(exponent, _times(known, Fraction(-1), field), field), field)
            if gap is None:
                continue
            low, high = (other, series) if gap >= 0 else (series, other)
            base = known if gap >= 0 else exponent
            shift = abs(gap)
            zero = field.rational(Fraction(0))
            shifted = ([zero] * shift + high.c)[: len(low.c)]
            n = min(len(low.c), len(shifted))
            total = Series(low.c[:n], field) + Series(shifted[:n], field)
            joined[index : index + 1] = _normal((base, total))
            break
        else:
            joined.append((exponent, series))
    return joined


def _whole(value: Fraction | Element, field: CoefficientField) -> int | None:
    """The whole number that an exponent is, else None."""
    if not isinstance(value, Fraction):
        expression = sympy.simplify(field.to_expression(value))
        if not (isinstance(expression, sympy.Basic) and expression.is_Integer):
            return None
        return int(expression)
    return value.numerator if value.denominator == 1 else None


def _integer_power(base: Element, exponent: int) -> Any:
    """A whole power of an element."""
    result = base**0 if exponent == 0 else base ** abs(exponent)
    return 1 / result if exponent < 0 else result
