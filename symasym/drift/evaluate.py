"""A(u) in balls with Taylor polynomials; `symasym.drift.sampled` has it in float64 over rows.

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
from typing import Any, NamedTuple

import numpy as np
from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.errors import InputError
from symasym.drift.models import Expression, Model, Pieces
from symasym.drift.parametrized import Parametrized

_RADII = (32, 8, 4, 2)  # of discs, over half a panel's width


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


def value_of(model: Model, u: Any, values: Mapping[str, Any], balls: bool) -> Any:
    """A(u) in balls, or in float64."""
    if isinstance(model, Pieces):
        if model.layered:
            u = np.clip(u, -1.0, 1.0)
        which = np.searchsorted([float(x) for x in model.cuts], u, side="right")
        parts = [value_of(part, u, values, balls) for part in model.pieces]
        return np.select([which == k for k in range(len(parts))], parts)
    if isinstance(model, Expression):
        of = _function(model.formula, (model.u, *model.symbols.values()), balls)
        return of(u, *(values[name] for name in model.symbols)) + 0 * u
    return model.evaluate(u, values, _BALLS if balls else _FLOATS)


def coefficients_of(model: Model, values: Mapping[str, Any], balls: bool) -> list[Any] | None:
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
            around = abs(self(box(middle, rho * half, rho * half))).upper().max(size)
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
    drift: Parametrized, low: fmpq, high: fmpq, values: Mapping[str, Any] | None = None
) -> list[Piece]:
    """The drift from `low` to `high` at the precision of the moment.

    Parameters
    ----------
    drift : Parametrized
    low, high : fmpq
    values : mapping of str to fmpq, arb or acb, optional
        In place of these of the drift's parameters.
    """
    model, one = drift.model, fmpq(1)
    numbers = {name: rational(x) for name, x in drift.scalars().items()}
    numbers.update(values or {})
    parts, noise, cuts = model.pieces, model.noise, [rational(x) for x in model.cuts]
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
    phi, sigma = (partial(value_of, of, values=numbers, balls=True) for of in (part, noise))
    twice = int(2 * alpha)

    def weight(k: int) -> Analytic | None:
        return Analytic(lambda u: sigma(u) ** -k) if k else None

    return [Analytic(lambda u: phi(u) / sigma(u) ** 2), weight(twice), weight(2 - twice)]


def profile(model: Model, numbers: Mapping[str, Any]) -> Polynomial | Analytic:
    """A of these parameters, each fmpq, arb or acb."""
    coefficients = coefficients_of(model, numbers, balls=True)
    if coefficients is not None:
        return Polynomial(coefficients)
    return Analytic(lambda u: value_of(model, u, numbers, balls=True))


def rational(x: Any) -> Any:
    """A number as flint's rational; None stays."""
    return None if x is None else fmpq(*x.as_integer_ratio())
