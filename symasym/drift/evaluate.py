"""A(u) as the engines evaluate it: in balls with Taylor polynomials, and in float64 over rows.

An expression becomes a function of balls, or of arrays, by SymPy's lambdify. On a disc of radius
rho h about m on which A is analytic and |A| <= M its Taylor polynomial of n terms misses on
[m - h, m + h] at most M rho^-n/(1 - 1/rho) (Cauchy's estimate). A finite ball with A's values on
the disc shows that only where every function of it is infinite across its cuts and poles. Arb's
square root, logarithm and inverse functions are finite on boxes across their cuts, so a formula is
admitted if it is made of + - * /, powers and `FUNCTIONS`, which here are nan there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.errors import AccuracyError, InputError
from symasym.drift.models import Expression, Model
from symasym.numbers.balls import precision

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

#: Chebyshev terms that hold a drift that is not a polynomial on a panel.
ANALYTIC = 17
_LOG10 = math.log(10.0)
_RADII = (32, 8, 4, 2)
_ELLIPSES = (11, 16, 32, 64)
_MOST, _REGIONS = 1_000, 60  # panels, and boxes of parameters
_SPLIT = 134217729.0  # 2^27 + 1
_POINTS = np.cos(np.pi * (np.arange(33) + 0.5) / 33)


# -- functions of balls ----------------------------------------------------------------------------


def _cosh(x: Any) -> Any:
    return (x.exp() + (-x).exp()) / 2


def _sech2(x: Any) -> Any:
    """1/cosh(x)^2, for x < 0 without large numbers."""
    e = (2 * x).exp()
    return 4 * e / (1 + e) ** 2


# Derivatives of what power series lack, from which the terms behind the first are found.
_SLOPES: dict[str, Callable[[Any], Any]] = {
    "sinh": _cosh,
    "tanh": lambda x: _sech2(x if x[0].real.mid() < 0 else -x),
    "asin": lambda x: (1 - x * x).rsqrt(),
    "acos": lambda x: -(1 - x * x).rsqrt(),
    "asinh": lambda x: (1 + x * x).rsqrt(),
    "acosh": lambda x: (x - 1).rsqrt() * (x + 1).rsqrt(),
    "atanh": lambda x: 1 / (1 - x * x),
}


def _on_real_cut(z: acb) -> bool:
    return bool(z.imag.contains(0)) and not abs(z.real) < 1


def _on_imaginary_cut(z: acb) -> bool:
    return bool(z.real.contains(0)) and not abs(z.imag) < 1


# Whether a box may touch the cuts of an inverse function (DLMF 4.23, 4.37).
_CUTS: dict[str, Callable[[acb], bool]] = {
    **dict.fromkeys(("asin", "acos", "atanh"), _on_real_cut),
    **dict.fromkeys(("atan", "asinh"), _on_imaginary_cut),
    "acosh": lambda z: bool(z.imag.contains(0)) and not z.real > 1,
}
_ENTIRE_OR_POLES = ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "erf")
#: The functions that A may be made of.
FUNCTIONS = (*_ENTIRE_OR_POLES, "log", "sqrt", *_CUTS)


def _of_balls(name: str, x: Any) -> Any:
    """An elementary function, nan on a complex box on which it is not analytic."""
    if isinstance(x, (int, fmpq)):
        x = arb(x)
    if isinstance(x, (arb_series, acb_series)):
        if name == "cosh":
            return _cosh(x)
        if name in _SLOPES:
            first = _of_balls(name, x[0])
            return (x.derivative() * _SLOPES[name](x)).integral() + first
    elif isinstance(x, acb):
        if name in ("log", "sqrt"):
            return getattr(x, name)(analytic=True)
        if name in _CUTS and _CUTS[name](x):
            return acb(arb.nan())
    return getattr(x, name)()


def _erf(x: Any) -> Any:
    from scipy.special import erf

    return erf(x)


_BALLS: Any = SimpleNamespace(pi=arb.pi, **{f: partial(_of_balls, f) for f in FUNCTIONS})
_NAMES = {f: f.replace("a", "arc", 1) if f in _CUTS else f for f in FUNCTIONS if f != "erf"}
_FLOATS: Any = SimpleNamespace(
    pi=lambda: np.pi, erf=_erf, **{f: getattr(np, name) for f, name in _NAMES.items()}
)


def require_admitted(formula: Any) -> None:
    """Raise InputError unless A is made of + - * /, powers, rationals, pi, E and `FUNCTIONS`."""
    import sympy

    for node in sympy.preorder_traversal(formula):
        known = node.is_Rational or node.is_Symbol or node in (sympy.pi, sympy.E)
        if not (known or node.is_Add or node.is_Mul or node.is_Pow or isinstance(node, sympy.Tuple)) and not (
            type(node).__name__ in FUNCTIONS and len(node.args) == 1
        ):
            raise InputError(
                f"A contains {node}, which is not among the analytic functions symasym evaluates; "
                f"write A with {', '.join(FUNCTIONS)}, powers and rationals."
            )


@lru_cache(maxsize=256)
def _function(formula: Any, symbols: tuple[Any, ...], balls: bool) -> Callable[..., Any]:
    """A formula, or a tuple of them, as a function of balls or of arrays."""
    import sympy
    from sympy.printing.lambdarepr import LambdaPrinter

    class Printer(LambdaPrinter):  # type: ignore[misc]
        """Exact constants; roots and powers by functions that honour their cuts."""

        def _print_Rational(self, x: Any) -> str:
            return f"fmpq({x.p}, {x.q})"

        _print_Half = _print_Rational

        def _print_Pi(self, x: Any) -> str:
            return "pi()"

        def _print_Exp1(self, x: Any) -> str:
            return "exp(1)"

        def _print_Pow(self, x: Any, rational: bool = False) -> str:
            base, exponent = self._print(x.base), self._print(x.exp)
            if x.exp.is_Integer:
                return f"(({base})**{exponent})" if x.exp > 0 else f"(1/({base})**{-x.exp})"
            if x.exp.is_Rational and x.exp.q == 2:
                root = f"sqrt({base})"
                return f"({root}**{x.exp.p})" if x.exp > 0 else f"(1/{root}**{-x.exp.p})"
            return f"exp(({exponent})*log({base}))"

    require_admitted(formula)
    taken = {"fmpq", *FUNCTIONS, *vars(np)}
    other = {s: sympy.Dummy() for s in symbols if s.name in taken}
    formula, symbols = formula.xreplace(other), [other.get(s, s) for s in symbols]
    formula = [*formula] if isinstance(formula, sympy.Tuple) else formula
    if balls:
        printer = Printer({"fully_qualified_modules": False, "inline": True})
        names = {**vars(_BALLS), "fmpq": fmpq}
        return sympy.lambdify(symbols, formula, [names], printer=printer, cse=True)  # type: ignore[no-any-return]
    return sympy.lambdify(symbols, formula, [{"erf": _erf}, "numpy"], cse=True)  # type: ignore[no-any-return]


def _value(model: Model, u: Any, values: Mapping[str, Any], balls: bool) -> Any:
    """A(u) in balls, or in float64."""
    if isinstance(model, Expression):
        symbols = (model.u, *model.symbols.values())
        of = _function(model.formula, symbols, balls)
        return of(u, *(values[name] for name in model.parameters)) + 0 * u
    return model.evaluate(u, values, _BALLS if balls else _FLOATS)


def _coefficients(model: Model, values: Mapping[str, Any], balls: bool) -> list[Any] | None:
    """The ascending coefficients of A in balls, or in float64; None if A is no polynomial."""
    if isinstance(model, Expression):
        import sympy

        if model.powers is None:
            return None
        of = _function(sympy.Tuple(*model.powers), tuple(model.symbols.values()), balls)
        return list(of(*(values[name] for name in model.parameters)))
    return model.coefficients(values, _BALLS if balls else _FLOATS)


# -- balls -----------------------------------------------------------------------------------------


class Polynomial:
    """A polynomial of these ascending coefficients, each fmpq, arb or acb."""

    def __init__(self, coefficients: list[Any]) -> None:
        self.coefficients = coefficients
        kind = acb_poly if any(isinstance(c, acb) for c in coefficients) else arb_poly
        self._poly = kind(coefficients)

    def __call__(self, x: Any) -> Any:
        return self._poly(x)

    def taylor(self, middle: fmpq, half: fmpq, digits: int) -> tuple[Any, arb]:
        """A(middle + half t) as a polynomial in t, and 0."""
        return self._poly(type(self._poly)([middle, half])), arb(0)

    def mirrored(self) -> Polynomial:
        """-A(-u)."""
        return Polynomial([c if k % 2 else -c for k, c in enumerate(self.coefficients)])

    def negative(self) -> Polynomial:
        """-A."""
        return Polynomial([-c for c in self.coefficients])


class Analytic:
    """A function of arb, acb and their power series, not finite on boxes where it is singular."""

    def __init__(self, of: Callable[[Any], Any]) -> None:
        self._of = of

    def __call__(self, x: Any) -> Any:
        try:
            return self._of(x)
        except (ValueError, ZeroDivisionError):  # flint's words for a divisor that may be 0
            return x * arb.nan()

    @cached_property
    def _largest(self) -> arb:
        """A bound of |A| on [-1, 1], maybe infinite."""
        return abs(self(arb(0, 1))).upper()

    def taylor(self, middle: fmpq, half: fmpq, digits: int) -> tuple[Any, arb]:
        """A Taylor polynomial in t, u = middle + half t, and a bound on what it misses of A.

        It misses 10^-digits of A's size there, or 10^-2digits of that on [-1, 1], or what is
        infinite. Of the discs that which needs the fewest terms is taken.
        """
        wanted = digits * _LOG10 + 12
        least = self._largest * arb(10) ** -digits
        size = abs(self(arb(middle, arb(half)))).upper()
        size = size.max(least) if least.is_finite() else size
        best = (2 * wanted, 0, arb(0))
        for rho in _RADII:
            around = abs(self(box(middle, rho * half))).upper()
            if around.is_finite() and not around > arb(0):
                return arb_poly([0]), arb(0)
            terms = float(((around / size).log() + wanted) / math.log(rho))
            if terms < best[0]:
                best = (terms, rho, around)
        if not best[1]:
            return arb_poly([0]), arb.pos_inf()
        n, rho = math.ceil(best[0]) + 2, arb(best[1])
        ctx.cap = n
        series = list(self(arb_series([middle, half], n)))
        kind = acb_poly if any(isinstance(c, acb) for c in series) else arb_poly
        return kind(series), (best[2] / (rho**n * (1 - 1 / rho))).upper()

    def mirrored(self) -> Analytic:
        """-A(-u)."""
        return Analytic(lambda u: -self._of(-u))

    def negative(self) -> Analytic:
        """-A."""
        return Analytic(lambda u: -self._of(u))


def box(middle: fmpq, width: fmpq, height: fmpq | None = None) -> acb:
    """A box about a point of the real line, by its half widths."""
    return acb(arb(middle, arb(width)), arb(0, arb(width if height is None else height)))


class Piece(NamedTuple):
    """phi on [left, right]."""

    left: fmpq
    right: fmpq
    phi: Polynomial | Analytic


def pieces(drift: Drift, reach: fmpq, values: Mapping[str, Any] | None = None) -> list[Piece]:
    """phi from -reach to reach at the precision of the moment: A on [-1, 1], constants beside it.

    Parameters
    ----------
    drift : Drift
    reach : fmpq
        Up to 1 there is A alone.
    values : mapping of str to fmpq, arb or acb, optional
        In place of these of the drift's parameters.
    """
    one, numbers = fmpq(1), {name: rational(x) for name, x in drift.scalars().items()}
    numbers.update(values or {})
    phi = profile(drift.model, numbers)
    found = [Piece(-one, one, phi)]
    if reach > one:
        for side in (-1, 1):
            end = drift.model.end(numbers, side) if values else rational(drift.end(side))
            outside = Polynomial([phi(arb(side)) if end is None else end])
            found.append(Piece(*((-reach, -one) if side < 0 else (one, reach)), outside))
    return sorted(found, key=lambda piece: piece.left)


def profile(model: Model, numbers: Mapping[str, Any]) -> Polynomial | Analytic:
    """A of these parameters, each fmpq, arb or acb."""
    coefficients = _coefficients(model, numbers, balls=True)
    if coefficients is not None:
        return Polynomial(coefficients)
    return Analytic(lambda u: _value(model, u, numbers, balls=True))


def rational(x: Any) -> Any:
    """A Fraction as flint's rational; None stays."""
    return None if x is None else fmpq(x.numerator, x.denominator)


# -- float64 ---------------------------------------------------------------------------------------


class Sampled:
    """A over rows of parameters in float64, some of them perhaps complex (the complex step).

    Attributes
    ----------
    terms : int
        Chebyshev terms that hold A on a panel between `cuts`.
    exact : bool
        True for polynomials.
    careful : bool
        True where values are as if found in twice the precision and rounded.
    """

    def __init__(self, model: Model, numbers: Mapping[str, Any], rows: int, pairs: Any = None):
        self._model, self._numbers, self._rows, self._pairs = model, numbers, rows, pairs
        self._floats = {k: x if isinstance(x, np.ndarray) else float(x) for k, x in numbers.items()}
        with np.errstate(all="ignore"):
            self._c = _coefficients(model, self._floats, balls=False)
        self.exact, self.careful = self._c is not None, pairs is not None
        self.terms = ANALYTIC if self._c is None else len(self._c)

    def __call__(self, u: Any, rows: Any) -> Any:
        """A at `u`, of shape (many, len(rows)), each column with the parameters of its row."""
        if self._c is None:
            values = {k: x[rows] if np.ndim(x) else x for k, x in self._floats.items()}
            with np.errstate(all="ignore"):
                return _value(self._model, u, values, balls=False)
        of = [c[rows] if np.ndim(c) else c for c in self._c]
        value = _horner(of, u)
        if self._pairs is None:
            return value
        high, low = self._pairs[..., rows if self._pairs.shape[-1] > 1 else slice(None)]
        real = _compensated(high, low, np.real(u))
        return real + 1j * value.imag if np.iscomplexobj(value) else real

    def carefully(self) -> Sampled:
        """The same with compensated Horner's rule; of polynomials. It costs 20 us a row."""
        arrays = any(isinstance(x, np.ndarray) for x in self._numbers.values())
        pairs = []
        with precision(160):
            for row in range(self._rows if arrays else 1):
                coefficients = _coefficients(self._model, self._exactly(row), balls=True)
                pairs.append([_pair(c) for c in coefficients or []])
        return Sampled(self._model, self._numbers, self._rows, np.array(pairs).transpose(2, 1, 0))

    def _exactly(self, row: int) -> dict[str, fmpq]:
        """The real parameters of a row as rationals."""
        return {
            name: fmpq(*float(x[row].real).as_integer_ratio())
            if isinstance(x, np.ndarray)
            else fmpq(*x.as_integer_ratio())
            for name, x in self._numbers.items()
        }

    @cached_property
    def ends(self) -> tuple[Any, Any]:
        """a- and a+ of the rows."""
        every, found = np.arange(self._rows), []
        for side in (-1, 1):
            end = self._model.end(self._numbers, side)
            if end is None:
                found.append(self(np.full((1, self._rows), float(side)), every)[0])
            else:
                end = end if isinstance(end, np.ndarray) else float(end)
                found.append(np.broadcast_to(end, self._rows))
        return found[0], found[1]

    @cached_property
    def rounding(self) -> float:
        """Rounding errors of A's values over A's size, where it is no polynomial: an estimate.

        Twice the largest at 33 points in the rows of the least and the largest parameters.
        """
        worst = 0.0
        for row in {int(f(np.abs(x))) for x in self._arrays() for f in (np.argmin, np.argmax)} or {0}:
            values = self(_POINTS[:, None], np.array([row]))[:, 0].real
            with precision(160):
                phi = profile(self._model, self._exactly(row))
                true = [phi(arb(u)) for u in _POINTS.tolist()]
            errors = [float(abs(a - arb(x)).upper()) for a, x in zip(true, values.tolist(), strict=True)]
            worst = max(worst, 2 * max(errors) / float(np.abs(values).max()))
        return worst

    def _arrays(self) -> list[Any]:
        return [x for x in self._numbers.values() if isinstance(x, np.ndarray)]

    @cached_property
    def cuts(self) -> Any:
        """Points between which 17 Chebyshev terms hold A to 1e-16 of its size, for all rows.

        Of a function below M inside the ellipse with foci at a panel's ends whose half axes add up
        to rho half widths, they miss at most 4 M rho^-16/(rho - 1).

        Raises
        ------
        AccuracyError
            If that takes too many panels.
        """
        if self.exact:
            return np.empty(0)
        u = _POINTS[:, None] + np.zeros(self._rows)
        size = float(np.abs(self(u, np.arange(self._rows))).max(axis=0).min())
        ends = [(k, np.min(np.real(x)), np.max(np.real(x))) for k, x in self._numbers.items()]
        with precision(128):
            return np.array(sorted(_cuts(self._model, tuple(ends), size) - {-1.0}))


@lru_cache(maxsize=256)
def _cuts(model: Model, ends: tuple[tuple[str, Any, Any], ...], size: float) -> set[float]:
    """Where panels begin on which A, of this size, is held for all parameters between these."""
    whole = [(k, fmpq(*x.as_integer_ratio()), fmpq(*y.as_integer_ratio())) for k, x, y in ends]
    allowed, found, most = arb(size) * 1e-16, set[float](), 0
    for corner in ({k: x for k, x, _ in whole}, {k: y for k, _, y in whole}):
        found |= _begins(profile(model, corner), allowed, _MOST)
    # A box of parameters that takes many more panels than its corners is halved.
    regions, most = [whole] if any(x < y for _, x, y in whole) else [], len(found) * 5 // 4 + 4
    for region in regions:
        hull = {k: arb((x + y) / 2, arb((y - x) / 2)) if x < y else x for k, x, y in region}
        begins = _begins(profile(model, hull), allowed, most)
        found |= begins
        if not begins:
            name, x, y = max(region, key=_width)
            parts = ((x, (x + y) / 2), ((x + y) / 2, y))
            regions += [[(k, *p) if k == name else (k, v, w) for k, v, w in region] for p in parts]
        if len(regions) > _REGIONS:
            found.clear()
            break
    if not found:
        raise AccuracyError("A varies too fast on [-1, 1] for float64, or too differently over its parameters; give dps, and one set of parameters at a time.")
    return found


def _begins(phi: Any, allowed: arb, most: int) -> set[float]:
    """Where panels begin on which A is held, none where there would be more."""
    found, waiting = set(), [(fmpq(-1), fmpq(1))]
    while waiting:
        a, b = waiting.pop()
        if _held(phi, (a + b) / 2, (b - a) / 2, allowed):
            found.add(float(a))
        else:
            waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
        if len(found) + len(waiting) > most:
            return set()
    return found


def _width(one: tuple[str, fmpq, fmpq]) -> fmpq:
    """A range's width over the sizes of its ends."""
    return (one[2] - one[1]) / (abs(one[1]) + abs(one[2]) + fmpq(one[1] == one[2]))


def _held(phi: Any, middle: fmpq, half: fmpq, allowed: arb) -> bool:
    """True where `ANALYTIC` Chebyshev terms surely miss no more than allowed."""
    for rho in _ELLIPSES:
        width, height = half * fmpq(rho**2 + 1, 2 * rho), half * fmpq(rho**2 - 1, 2 * rho)
        largest = abs(phi(box(middle, width, height)))
        if largest * 4 < allowed * arb(rho) ** (ANALYTIC - 1) * (rho - 1):
            return True
        if not largest.is_finite():
            return False
    return False


def _pair(c: Any) -> tuple[float, float]:
    """A coefficient as a float and what that misses."""
    ball = arb(c)
    high = float(ball.mid())
    return high, float((ball - arb(high)).mid())


def _horner(coefficients: Any, u: Any) -> Any:
    value = coefficients[-1] + 0 * u
    for c in coefficients[-2::-1]:
        value = value * u + c
    return value


def _compensated(high: Any, low: Any, u: Any) -> Any:
    """Horner's rule with the errors of its steps (Graillat, Langlois, Louvet 2005)."""
    big = _SPLIT * u
    first = big - (big - u)
    second = u - first
    value, error = high[-1] + 0 * u, low[-1] + 0 * u
    for c, rest in zip(high[-2::-1], low[-2::-1], strict=True):
        product = value * u
        big = _SPLIT * value
        top = big - (big - value)
        bottom = value - top
        lost = ((top * first - product) + top * second + bottom * first) + bottom * second
        value = product + c
        part = value - product
        error = error * u + (lost + ((product - (value - part)) + (c - part)) + rest)
    return value + error


def sampled(drift: Drift, values: Mapping[str, Any], rows: int) -> Sampled:
    """A of these rows: parameters that are no arrays are shared by them, and exact if rational."""
    scalars = {k: x for k, x in drift.values.items() if not isinstance(x, np.ndarray)}
    return Sampled(drift.model, {**scalars, **values}, rows)
