"""A(u) as the engines evaluate it: in balls with Taylor polynomials, and in float64 over rows.

A model's formula becomes a function of balls, or of arrays; an expression's by SymPy's lambdify.
Where A is analytic and |A| <= M on the disc of radius rho h about m, its Taylor polynomial of n
terms misses at most M rho^-n/(1 - 1/rho) on [m - h, m + h] (Cauchy's estimate). A finite ball of
A's values on a box about the disc shows that A is analytic there, if all functions in A are
infinite, or nan, on boxes across their cuts and poles. Arb's own square root, logarithm and inverse
functions are finite across their cuts; those here are not, and no others are admitted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property, lru_cache, partial, reduce
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.balls import precision
from symasym.base.errors import InputError
from symasym.drift.models import Expression, Model, Pieces

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

#: Chebyshev terms that hold a drift that is not a polynomial on a panel.
ANALYTIC = 17
_RADII = (32, 8, 4, 2)  # of discs, over half a panel's width
_ELLIPSES = (11, 16, 32, 64)  # sums of half axes, over half a panel's width
_MOST = 1_000  # panels
_POINTS = np.cos(np.pi * (np.arange(33) + 0.5) / 33)


# -- functions -------------------------------------------------------------------------------------


def _cosh(x: Any) -> Any:
    return (x.exp() + (-x).exp()) / 2


def _sech2(x: Any) -> Any:
    """1/cosh(x)^2 without large numbers."""
    e = (2 * x if x[0].real.mid() < 0 else -2 * x).exp()
    return 4 * e / (1 + e) ** 2


# Derivatives of the functions that power series lack.
_SLOPES: dict[str, Callable[[Any], Any]] = {
    "sinh": _cosh,
    "tanh": _sech2,
    "asin": lambda x: (1 - x * x).rsqrt(),
    "acos": lambda x: -(1 - x * x).rsqrt(),
    "asinh": lambda x: (1 + x * x).rsqrt(),
    "acosh": lambda x: (x - 1).rsqrt() * (x + 1).rsqrt(),
    "atanh": lambda x: 1 / (1 - x * x),
}
# Whether a box may touch the cuts of an inverse function (DLMF 4.23, 4.37).
_CUTS: dict[str, Callable[[Any], bool]] = {
    **dict.fromkeys(
        ("asin", "acos", "atanh"), lambda z: z.imag.contains(0) and not abs(z.real) < 1
    ),
    **dict.fromkeys(("atan", "asinh"), lambda z: z.real.contains(0) and not abs(z.imag) < 1),
    "acosh": lambda z: z.imag.contains(0) and not z.real > 1,
}
#: The functions that A may be made of: entire ones, quotients of them, and those with cuts.
FUNCTIONS = ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "erf", "log", "sqrt", *_CUTS)


def _of_balls(name: str, x: Any) -> Any:
    """A function of a rational, a ball or a power series; nan on a box across its cuts."""
    if isinstance(x, (int, fmpq)):
        x = arb(x)
    if isinstance(x, (arb_series, acb_series)):
        if name == "cosh":
            return _cosh(x)
        if name in _SLOPES:
            return (x.derivative() * _SLOPES[name](x)).integral() + _of_balls(name, x[0])
    elif isinstance(x, acb):
        if name == "sqrt" and not x.contains(0):
            # Arb's own square root of a wide box is several times wider.
            return (x.log(analytic=True) / 2).exp()
        if name in ("log", "sqrt"):
            return getattr(x, name)(analytic=True)
        if name in _CUTS and _CUTS[name](x):
            return acb(arb.nan())
    return getattr(x, name)()


def _erf(x: Any) -> Any:
    from scipy.special import erf

    return erf(x)


_NUMPY = {f: getattr(np, f.replace("a", "arc", 1) if f in _CUTS else f, _erf) for f in FUNCTIONS}
# What models ask of the arithmetic of their parameters.
_FLOATS: Any = SimpleNamespace(pi=lambda: np.pi, **_NUMPY)
_BALLS: Any = SimpleNamespace(pi=arb.pi, **{f: partial(_of_balls, f) for f in FUNCTIONS})


def require_admitted(formula: Any) -> None:
    """Raise InputError unless A is made of + - * /, powers, rationals, pi, E and `FUNCTIONS`."""
    import sympy

    for node in sympy.preorder_traversal(formula):
        if not (
            node.is_Rational
            or isinstance(node, (sympy.Symbol, sympy.Add, sympy.Mul, sympy.Pow, sympy.Tuple))
            or node in (sympy.pi, sympy.E)
            or (type(node).__name__ in FUNCTIONS and len(node.args) == 1)
        ):
            raise InputError(
                f"A contains {node}, which is not among the analytic functions symasym evaluates; "
                f"write A with {', '.join(FUNCTIONS)}, powers and rationals."
            )


@lru_cache(maxsize=256)
def _function(formula: Any, symbols: tuple[Any, ...], balls: bool) -> Callable[..., Any]:
    """A formula, or a Tuple of them, as a function of balls or of arrays."""
    import sympy
    from sympy.printing.lambdarepr import LambdaPrinter

    class Printer(LambdaPrinter):  # type: ignore[misc]
        """Rational constants exact, powers by functions that are not finite across their cuts."""

        def _print_Rational(self, x: Any) -> str:
            return f"fmpq({x.p}, {x.q})"

        _print_Half = _print_Rational

        def _print_Pi(self, x: Any) -> str:
            return "pi()"

        def _print_Exp1(self, x: Any) -> str:
            return "exp(1)"

        def _print_Pow(self, x: Any, rational: bool = False) -> str:
            base, exponent = self._print(x.base), self._print(x.exp)
            if not (x.exp.is_Rational and x.exp.q <= 2):
                return f"exp(({exponent})*log({base}))"
            root = f"({base})" if x.exp.q == 1 else f"sqrt({base})"
            return f"({root}**{x.exp.p})" if x.exp > 0 else f"((1/{root})**{-x.exp.p})"

    require_admitted(formula)
    taken = {"fmpq", *FUNCTIONS, *vars(np)}
    other = {s: sympy.Dummy() for s in symbols if s.name in taken}
    formula, names = formula.xreplace(other), [other.get(s, s) for s in symbols]
    formula = [*formula] if isinstance(formula, sympy.Tuple) else formula
    modules: list[Any] = [{"erf": _erf}, "numpy"]
    options = {}
    if balls:
        modules = [{**vars(_BALLS), "fmpq": fmpq}]
        options["printer"] = Printer({"fully_qualified_modules": False, "inline": True})
    function: Callable[..., Any] = sympy.lambdify(names, formula, modules, cse=True, **options)
    return function


def of_balls(formula: Any, symbols: tuple[Any, ...]) -> Callable[..., Any]:
    """A formula of these symbols as a function of balls."""
    return _function(formula, symbols, True)


def of_arrays(formula: Any, symbols: tuple[Any, ...]) -> Callable[..., Any]:
    """A formula of these symbols as a function of float64 arrays."""
    return _function(formula, symbols, False)


def _value(model: Model, u: Any, values: Mapping[str, Any], balls: bool) -> Any:
    """A(u) in balls, or in float64."""
    if isinstance(model, Pieces):
        if model.layered:
            u = np.clip(u, -1.0, 1.0)
        which = np.searchsorted([float(x) for x in model.cuts], u, side="right")
        parts = [_value(part, u, values, balls) for part in model.models]
        return np.select([which == k for k in range(len(parts))], parts)
    if isinstance(model, Expression):
        of = _function(model.formula, (model.u, *model.symbols.values()), balls)
        return of(u, *(values[name] for name in model.symbols)) + 0 * u
    return model.evaluate(u, values, _BALLS if balls else _FLOATS)


def _coefficients(model: Model, values: Mapping[str, Any], balls: bool) -> list[Any] | None:
    """The ascending coefficients of A in balls, or in float64; None if A is no polynomial."""
    if isinstance(model, Expression):
        import sympy

        if model.powers is None:
            return None
        of = _function(sympy.Tuple(*model.powers), tuple(model.symbols.values()), balls)
        return list(of(*(values[name] for name in model.symbols)))
    return model.coefficients(values)


# -- balls -----------------------------------------------------------------------------------------


class Polynomial:
    """A polynomial of these ascending coefficients, each fmpq, arb or acb."""

    def __init__(self, coefficients: list[Any]) -> None:
        self.coefficients = coefficients
        self._poly = _poly(coefficients)

    def __call__(self, x: Any) -> Any:
        if isinstance(x, (arb_series, acb_series)):
            return reduce(lambda total, c: total * x + c, reversed(self.coefficients), 0 * x)
        return self._poly(x)

    def taylor(self, middle: Any, half: Any, digits: int) -> tuple[Any, Any]:
        """A(middle + half t) as a polynomial in t, and 0."""
        return self._poly(type(self._poly)([middle, half])), arb(0)

    def mirrored(self) -> Polynomial:
        """A(-u)."""
        return Polynomial([-c if k % 2 else c for k, c in enumerate(self.coefficients)])

    def negative(self) -> Polynomial:
        """-A."""
        return Polynomial([-c for c in self.coefficients])


class Analytic:
    """A function of arb, acb and their power series that is not finite on boxes with singularities.

    Parameters
    ----------
    of : callable
        From balls and power series to the same.
    """

    def __init__(self, of: Callable[[Any], Any]) -> None:
        self.of = of

    def __call__(self, x: Any) -> Any:
        try:
            return self.of(x)
        except (ValueError, ZeroDivisionError):  # flint's words for a divisor that may be 0
            return x * arb.nan()

    def _size(self, *points: fmpq) -> Any:
        """The largest |A| of some points."""
        return max((abs(self(arb(u))).upper() for u in points), key=float)

    @cached_property
    def _scale(self) -> Any:
        """About |A| on [-1, 1], whose numbers are above 1e-300."""
        return self._size(*(fmpq(k, 2) for k in range(-2, 3))).max(arb(10) ** -300)

    def taylor(self, middle: fmpq, half: fmpq, digits: int) -> tuple[Any, Any]:
        """A Taylor polynomial in t, u = middle + half t, and a bound on what it misses of A.

        That is below 10^-digits of A's size there or 10^-2digits of A's size on [-1, 1], or
        infinite. Of the discs that show A to be analytic that of the fewest terms is taken.
        """
        wanted = digits * math.log(10) + 12
        size = self._size(middle - half, middle + half).max(self._scale * arb(10) ** -digits)
        fewest, radius, bound = 2 * wanted, 0, arb.pos_inf()
        for rho in _RADII:
            around = abs(self(box(middle, rho * half, rho * half))).upper()
            terms = max(float((around / size).log() + wanted), 0.0) / math.log(rho)
            if terms < fewest:
                fewest, radius, bound = terms, rho, around
        if not radius:
            return arb_poly([0]), bound
        ctx.cap = n = math.ceil(fewest) + 2
        series = list(self(arb_series([middle, half], n)))
        return _poly(series), (bound / (arb(radius) ** n * (1 - arb(1) / radius))).upper()

    def mirrored(self) -> Analytic:
        """A(-u)."""
        return Analytic(lambda u: self.of(-u))

    def negative(self) -> Analytic:
        """-A."""
        return Analytic(lambda u: -self.of(u))


def _poly(coefficients: list[Any]) -> Any:
    complex_ones = any(isinstance(c, acb) for c in coefficients)
    return (acb_poly if complex_ones else arb_poly)(coefficients)


def box(middle: Any, width: Any, height: Any) -> Any:
    """A box about a point of the real line, by half its width and height."""
    return acb(arb(middle, arb(width)), arb(0, arb(height)))


class Piece(NamedTuple):
    """The drift on [left, right], the noise in it: phi/sigma^2, and the weights of e and 1/e.

    The scale density is e times `scale` = sigma^(-2 alpha), the speed density 1/e times
    lam `speed` = lam sigma^(2 alpha - 2); None stands for 1.
    """

    left: fmpq
    right: fmpq
    phi: Polynomial | Analytic
    scale: Polynomial | Analytic | None = None
    speed: Polynomial | Analytic | None = None

    def mirrored(self) -> Piece:
        """Of -phi(-u) and sigma(-u)."""
        weights = (w and w.mirrored() for w in (self.scale, self.speed))
        return Piece(-self.right, -self.left, self.phi.mirrored().negative(), *weights)

    def reversed(self) -> Piece:
        """With the scale density and the speed density in each other's place."""
        return Piece(self.left, self.right, self.phi.negative(), self.speed, self.scale)


def pieces(
    drift: Drift, low: fmpq, high: fmpq, values: Mapping[str, Any] | None = None
) -> list[Piece]:
    """The drift from `low` to `high` at the precision of the moment.

    Parameters
    ----------
    drift : Drift
    low, high : fmpq
    values : mapping of str to fmpq, arb or acb, optional
        In place of these of the drift's parameters.
    """
    model: Any = drift.model
    one = fmpq(1)
    numbers = {name: rational(x) for name, x in drift.scalars().items()}
    numbers.update(values or {})
    parts, noise, cuts = [model], None, []
    if isinstance(model, Pieces):
        parts, noise, cuts = [*model.models], model.noise, [rational(x) for x in model.cuts]
    found: list[Any] = [[profile(part, numbers), None, None] for part in parts]
    if noise:
        found = [_weighted(part, noise, numbers, model.alpha) for part in parts]
    if model.layered:
        # Beside the layer everything is constant, phi exactly where it is rational.
        (inside,), cuts = found, [-one, one]
        for side in (-1, 1) if low < -one or high > one else ():
            at = [w and Polynomial([w(arb(side))]) for w in inside]
            known = drift.model.end(numbers, side) if values else rational(drift.end(side))
            if known is not None and not noise:
                at[0] = Polynomial([known])
            found.insert(len(found) if side > 0 else 0, at)
        if len(found) == 1:
            found = [inside] * 3
    marks = zip([low, *cuts], [*cuts, high], found, strict=True)
    between = ((max(a, low), min(b, high), of) for a, b, of in marks)
    return [Piece(a, b, *of) for a, b, of in between if a < b]


def _weighted(part: Model, noise: Model, numbers: Mapping[str, Any], alpha: Fraction) -> list[Any]:
    """phi/sigma^2, and what `Piece` calls scale and speed."""
    phi, sigma = (partial(_value, of, values=numbers, balls=True) for of in (part, noise))
    twice = int(2 * alpha)

    def weight(k: int) -> Analytic | None:
        return Analytic(lambda u: sigma(u) ** -k) if k else None

    return [Analytic(lambda u: phi(u) / sigma(u) ** 2), weight(twice), weight(2 - twice)]


def profile(model: Model, numbers: Mapping[str, Any]) -> Polynomial | Analytic:
    """A of these parameters, each fmpq, arb or acb."""
    coefficients = _coefficients(model, numbers, balls=True)
    if coefficients is not None:
        return Polynomial(coefficients)
    return Analytic(lambda u: _value(model, u, numbers, balls=True))


def rational(x: Any) -> Any:
    """A number as flint's rational; None stays."""
    return None if x is None else fmpq(*x.as_integer_ratio())


# -- float64 ---------------------------------------------------------------------------------------


def in_floats(model: Model, u: Any, values: Mapping[str, Any]) -> Any:
    """A(u) in float64."""
    with np.errstate(all="ignore"):
        return _value(model, u, values, balls=False)


class Sampled:
    """A over rows of parameters in float64, some of them perhaps complex (the complex step).

    Attributes
    ----------
    model : Model
    terms : int
        Chebyshev terms that hold A on a panel between `cuts`.
    exact : bool
        True for polynomials.
    careful : bool
        True where values are as if found in twice the precision and rounded.
    """

    def __init__(self, drift: Drift, numbers: Mapping[str, Any], rows: int, pairs: Any = None):
        self._drift, self._numbers, self._rows, self._pairs = drift, numbers, rows, pairs
        self.model = drift.model
        self._arrays = {k: x for k, x in numbers.items() if isinstance(x, np.ndarray)}
        self._floats: dict[str, Any] = {
            k: x if k in self._arrays else np.float64(float(x)) for k, x in numbers.items()
        }
        with np.errstate(all="ignore"):
            self._c = _coefficients(self.model, self._floats, balls=False)
        self.exact, self.careful = self._c is not None, pairs is not None
        self.terms = ANALYTIC if self._c is None else len(self._c)

    def __call__(self, u: Any, rows: Any) -> Any:
        """A at `u`, of shape (many, len(rows)), each column with the parameters of its row."""
        if self._c is None:
            values = {k: x[rows] if k in self._arrays else x for k, x in self._floats.items()}
            return in_floats(self.model, u, values)
        c = [x[rows] if np.ndim(x) else x for x in self._c]
        value = c[-1] + 0 * u
        for x in c[-2::-1]:
            value = value * u + x
        if self._pairs is None:
            return value
        high, low = self._pairs[..., rows if self._arrays else slice(None)]
        real = _compensated(high, low, np.real(u))
        return real + 1j * value.imag if np.iscomplexobj(value) else real

    def carefully(self) -> Sampled:
        """The same by compensated Horner's rule, for polynomials."""
        pairs = []
        with precision(160):
            for row in range(self._rows if self._arrays else 1):
                c = _coefficients(self.model, self._exactly(row), balls=True) or []
                high = [float(arb(x).mid()) for x in c]
                pairs.append(
                    (high, [float(arb(x).mid() - h) for x, h in zip(c, high, strict=True)])
                )
        return Sampled(self._drift, self._numbers, self._rows, np.array(pairs).transpose(1, 2, 0))

    def _exactly(self, row: int) -> dict[str, Any]:
        """The real parameters of a row as rationals."""
        shared = self._numbers.items()
        return {k: rational(x[row].real if k in self._arrays else x) for k, x in shared}

    @cached_property
    def ends(self) -> tuple[Any, Any]:
        """a- and a+ of the rows."""
        every, found = np.arange(self._rows), []
        for side in (-1, 1):
            if not self._arrays and self._numbers == self._drift.values:
                known: Any = self._drift.end(side)
            else:
                known = self.model.end(self._floats, side)
            if known is None:
                known = self(np.full((1, self._rows), float(side)), every)[0]
            known = known if isinstance(known, np.ndarray) else float(known)
            found.append(np.broadcast_to(known, self._rows))
        return found[0], found[1]

    @cached_property
    def rounding(self) -> float:
        """Rounding errors of A's values over A's size, where it is no polynomial: an estimate.

        Twice the largest at 33 points in the rows of the least and the largest parameters.
        """
        rows = {int(f(np.abs(x))) for x in self._arrays.values() for f in (np.argmin, np.argmax)}
        worst = 0.0
        for row in rows or {0}:
            values = self(_POINTS[:, None], np.array([row]))[:, 0].real
            with precision(160):
                phi = profile(self.model, self._exactly(row))
                pairs = zip(_POINTS.tolist(), values.tolist(), strict=True)
                errors = [float(abs(phi(arb(u)) - arb(x)).upper()) for u, x in pairs]
            worst = max(worst, 2 * max(errors) / float(np.abs(values).max()))
        return worst

    @cached_property
    def varied(self) -> bool:
        """True where rows have different parameters."""
        return any(np.ptp(np.real(x)) > 0 for x in self._arrays.values())

    @cached_property
    def cuts(self) -> Any:
        """Points between which 17 Chebyshev terms hold A to 1e-16 of its size; None for too many.

        Of a function below M inside the ellipse with foci at a panel's ends whose half axes add up
        to rho half widths, they miss at most 4 M rho^-16/(rho - 1). Of varied rows, where that is
        no proof, the cuts of the least and of the largest parameters.
        """
        if self.exact:
            return np.empty(0)
        u = _POINTS[:, None] + np.zeros(self._rows)
        size = float(np.abs(self(u, np.arange(self._rows))).max(axis=0).min())
        found: set[float] = set()
        for of in (np.min, np.max):
            corner = ((k, rational(of(np.real(x)))) for k, x in self._numbers.items())
            if not (some := _begins(self.model, tuple(corner), size)):
                return None
            found |= some
        return np.array(sorted(found - {-1.0}))


@lru_cache(maxsize=256)
def _begins(model: Model, numbers: tuple[tuple[str, fmpq], ...], size: float) -> set[float]:
    """Where the panels begin on which A, of this size, is held; nowhere where they are too many."""
    found, waiting = set(), [(fmpq(-1), fmpq(1))]
    with precision(128):
        phi, allowed = profile(model, dict(numbers)), arb(size) * 1e-16
        while waiting:
            a, b = waiting.pop()
            if _held(phi, (a + b) / 2, (b - a) / 2, allowed):
                found.add(float(a))
            else:
                waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
            if len(found) + len(waiting) > _MOST:
                return set()
    return found


def _held(phi: Any, middle: fmpq, half: fmpq, allowed: arb) -> bool:
    """True where `ANALYTIC` Chebyshev terms surely miss no more than allowed."""
    for rho in _ELLIPSES:
        width, height = half * fmpq(rho**2 + 1, 2 * rho), half * fmpq(rho**2 - 1, 2 * rho)
        largest = abs(phi(box(middle, width, height)))
        if largest * 4 < allowed * arb(rho) ** (ANALYTIC - 1) * (rho - 1):
            return True
        if not largest.is_finite():
            break
    return False


def _compensated(high: Any, low: Any, u: Any) -> Any:
    """Horner's rule with the errors of its steps, of coefficients high + low.

    S. Graillat, P. Langlois, N. Louvet, Japan J. Indust. Appl. Math. 26 (2009) 191.
    """
    split = 2.0**27 + 1
    first = split * u - (split * u - u)
    second = u - first
    value, error = high[-1] + 0 * u, low[-1] + 0 * u
    for c, rest in zip(high[-2::-1], low[-2::-1], strict=True):
        product = value * u
        top = split * value - (split * value - value)
        bottom = value - top
        lost = ((top * first - product) + top * second + bottom * first) + bottom * second
        value = product + c
        part = value - product
        error = error * u + (lost + ((product - (value - part)) + (c - part)) + rest)
    return value + error


def sampled(drift: Drift, values: Mapping[str, Any], rows: int) -> Sampled:
    """A of these rows: parameters that are no arrays are shared by them, and exact if rational."""
    scalars = {k: x for k, x in drift.values.items() if not isinstance(x, np.ndarray)}
    return Sampled(drift, {**scalars, **values}, rows)
