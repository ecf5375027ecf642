"""Expressions in balls, zeros of an expression, and the integral of g e^(lam f) itself, enclosed.

The integral is flint's (F. Johansson, Numerical integration in arbitrary-precision ball arithmetic,
2018); a function with a branch cut is nan across it wherever analyticity is asked for. At an end
where g is algebraic x = end ± s^q; where f tends to -oo, or x to infinity, y is taken to oo and the
range cut at R: where y d/dy log |g e^(lam f)| <= -m < -1 beyond R, the rest is at most the integrand
there times R/(m - 1).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import sympy
from flint import acb, arb, ctx, fmpq
from sympy import Expr, S, Symbol

from symasym.base.errors import AccuracyError, InputError

Code = Callable[[Any, bool], Any]
FUNCTIONS = (
    "exp", "log", "sqrt", "erf", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh",
    "tanh", "asinh", "acosh", "atanh",
)  # fmt: skip
Y = Symbol("y", positive=True)


def _off(z: Any, part: str) -> bool:
    """True if the ball misses the axis, or touches it between -1 and 1 alone."""
    along, across = (z.real, z.imag) if part == "real" else (z.imag, z.real)
    return not across.contains(0) or bool(abs(along) < 1)


#: Where the inverse functions are analytic (DLMF 4.23.1, 4.37.1).
_ANALYTIC: dict[str, Callable[[Any], bool]] = {
    **dict.fromkeys(("asin", "acos", "atanh"), lambda z: _off(z, "real")),
    **dict.fromkeys(("atan", "asinh"), lambda z: _off(z, "imag")),
    "acosh": lambda z: not z.imag.contains(0) or bool(z.real > 1),
}


def call(name: str, z: Any, analytic: bool = False) -> Any:
    """A function of an arb or acb; nan if it is to be `analytic` on the ball and is not."""
    if analytic and name == "log":
        return z.log(analytic=True)
    if analytic and name in _ANALYTIC and not _ANALYTIC[name](z):
        return acb("nan")
    return getattr(z, name)()


def power(z: Any, p: Any, analytic: bool = False) -> Any:
    """z^p, p a ball or fmpq; likewise."""
    if isinstance(z, acb):
        return z.sqrt(analytic=analytic) if p == _HALF else z.pow(acb(p), analytic=analytic)
    return z**p


_HALF = fmpq(1, 2)


def compiled(e: Expr, x: Symbol) -> Code:
    """The expression as a function of a ball and of whether it must be analytic there."""
    if not e.has(x):
        constant = _constant(e)
        return lambda z, a: constant
    if e == x:
        return lambda z, a: z
    if e.is_Pow and not e.exp.has(x):
        base = compiled(e.base, x)
        if e.exp.is_Integer:
            whole = int(e.exp)
            return lambda z, a: base(z, a) ** whole
        p = fmpq(e.exp.p, e.exp.q) if e.exp.is_Rational else _constant(e.exp)
        return lambda z, a: power(base(z, a), p, a)
    if e.is_Pow:
        return compiled(sympy.exp(e.exp * sympy.log(e.base), evaluate=False), x)
    parts = [compiled(part, x) for part in e.args]
    if e.is_Add:
        return lambda z, a: sum((f(z, a) for f in parts[1:]), parts[0](z, a))
    if e.is_Mul:

        def product(z: Any, a: bool) -> Any:
            total = parts[0](z, a)
            for f in parts[1:]:
                total = total * f(z, a)
            return total

        return product
    name = name_of(e)
    return lambda z, a: call(name, parts[0](z, a), a)


def name_of(e: Expr) -> str:
    """The name of a function that is evaluated."""
    name = type(e).__name__
    if name not in FUNCTIONS:
        raise InputError(
            f"f or g contains {e}, which is not among the functions symasym evaluates; write them "
            f"with {', '.join(FUNCTIONS)}, Abs, Max, Min, sign, Piecewise and powers."
        )
    return name


def number(e: Any) -> Any:
    """A constant expression as an arb at the working precision; nan where it isn't real."""
    if isinstance(e, (Zero, arb)):
        return e.ball() if isinstance(e, Zero) else e
    value = _constant(e)
    if isinstance(value, acb):
        return value.real if value.imag.contains(0) else arb("nan")
    return value


def _constant(e: Expr) -> Any:
    if e.is_Rational:
        return arb(fmpq(int(e.p), int(e.q)))
    known = {S.Pi: arb.pi, S.Exp1: arb.const_e, S.ImaginaryUnit: lambda: acb(0, 1)}
    known |= {S.Infinity: arb.pos_inf, S.NegativeInfinity: arb.neg_inf, S.NaN: arb.nan}
    if e in known:
        return known[e]()
    if isinstance(e, sympy.CRootOf):
        return Zero(e.poly.as_expr(), e.poly.gen, Fraction(str(e.n(40)))).ball()
    if not e.args:
        raise InputError(f"{e} has no value; give it one.")
    inner = compiled(e.xreplace({e.args[0]: Y}), Y)
    with suppress(ZeroDivisionError):
        return inner(_constant(e.args[0]), False)
    return arb.nan()


@dataclass(frozen=True)
class Zero:
    """The simple zero of an expression in x near a number, where it has no closed form."""

    equation: Expr
    x: Symbol
    near: Fraction

    def ball(self) -> Any:
        """An enclosure at the working precision, by Newton's method in balls."""
        value, slope = (
            compiled(e, self.x) for e in (self.equation, self.equation.diff(self.x))
        )
        z = arb(fmpq(self.near.numerator, self.near.denominator))
        for _ in range(ctx.prec.bit_length() + 8):
            z = (z - value(z, False) / slope(z, False)).mid()
        for bits in range(8, ctx.prec, 8):
            wide = arb(z, (abs(z) + arb(2) ** -ctx.prec) * arb(2) ** (bits - ctx.prec))
            found = z - value(z, False) / slope(wide, False)
            if wide.contains(found):
                return found
        raise AccuracyError(
            f"the zero of {self.equation} near {self.x} = {float(self.near):.6g} is not simple; "
            "give an f whose maxima have a closed form there."
        )

    def __str__(self) -> str:
        return f"{float(self.near):.12g}"


@dataclass(frozen=True)
class Stretch:
    """One half of a piece, its end at y = 0 or, `far`, at y = oo: f, g dx/dy, and the range of y.

    `growth` is d/dy log g, None where g has zeros.
    """

    f: Expr
    g: Expr
    lo: Expr
    hi: Expr
    far: bool

    @cached_property
    def rates(self) -> list[tuple[Expr, Expr, bool]]:
        """d/dy log of e^f and of g; or of e^f alone, beside the largest |g|."""
        slope = self.f.diff(Y)
        growth = sympy.simplify(self.g.diff(Y) / self.g)
        return [(slope, growth, False), (slope, S.Zero, True)][: 1 + (growth != 0)]

    def cut(self, lam: Fraction, size: Callable[[Any], Any], lo: Any, tiny: Any) -> Any:
        """R, and a bound of the integral beyond it; nan where none was found."""
        for slope, growth, beside in self.rates:
            rate = _upper(sympy.Rational(lam.numerator, lam.denominator) * slope + growth, True)
            reach = arb(2)
            while not reach > 2 * lo:
                reach = 2 * reach
            for _ in range(200):
                fall = -rate(reach)
                bound = size(reach) * reach / (fall - 1)
                if beside:
                    weight = compiled(self.g, Y)
                    bound = bound * _upper(abs(self.g))(reach) / abs(weight(reach, False))
                if fall > 1 and bound < tiny:
                    return reach, bound
                reach = 2 * reach
        return lo, arb("nan")


def integral(stretches: Any, lam: Fraction, top: Any, bits: int) -> Any:
    """int g e^(lam (f - top)) to about 2^-`bits`, as a ball; nan where it can't be enclosed."""
    rate, tiny = arb(fmpq(lam.numerator, lam.denominator)), arb(2) ** -bits
    total = arb(0)
    for part in stretches:
        g = compiled(part.g, Y)
        f, slope, bend = (compiled(e, Y) for e in (part.f, part.f.diff(Y), part.f.diff(Y, 2)))

        def integrand(z: Any, analytic: bool) -> Any:
            height = f(z, analytic)
            if rate * height.rad() > 1:
                # By its Taylor polynomial: beside a maximum the ball is as wide as f is flat.
                middle = z.mid()
                t = z - middle
                near = f(middle, analytic) + t * (slope(middle, analytic) + t * bend(z, analytic) / 2)
                height = near if near.rad() < height.rad() else height
            return g(z, analytic) * (rate * (height - top)).exp()

        lo, hi, rest = number(part.lo), number(part.hi), arb(0)
        if part.far:
            hi, rest = part.cut(lam, lambda y: abs(integrand(y, False)), lo, tiny)
        try:
            found = acb.integral(
                lambda z, a: acb(integrand(z, a)), acb(lo), acb(hi), rel_tol=tiny, abs_tol=tiny
            )
        except (ValueError, ZeroDivisionError):
            return arb("nan")
        total += found.real + arb(0, rest)
    return total


def _upper(e: Expr, times_y: bool = False) -> Callable[[Any], Any]:
    """The function R -> an upper bound of the expression, times y, for all y > R, by intervals."""
    import mpmath
    from mpmath.ctx_iv import MPIntervalContext

    above, below = sympy.fraction(sympy.together(e))
    if above.is_polynomial(Y) and below.is_polynomial(Y) and not e.has(sympy.Abs):
        # A power of y times a quotient of polynomials in 1/y, which has no oo/oo.
        rows = [sympy.Poly(part, Y) for part in (above, below)]
        tops = [sum(c / Y ** (p.degree() - k) for (k,), c in p.terms()) for p in rows]
        degree = rows[0].degree() - rows[1].degree() + times_y
        e = sympy.Mul(Y**degree, tops[0], 1 / tops[1], evaluate=False)
    elif times_y:
        e = sympy.Mul(Y, e, evaluate=False)
    iv = MPIntervalContext()
    names = {n: getattr(iv, n) for n in ("mpf", "exp", "log", "sqrt", "sin", "cos", "pi")} | {
        "Abs": abs,
        "tanh": lambda t: 1 - 2 / (iv.exp(2 * t) + 1),
        "cosh": lambda t: (iv.exp(t) + iv.exp(-t)) / 2,
        "sinh": lambda t: (iv.exp(t) - iv.exp(-t)) / 2,
        "erf": lambda t: iv.mpf([-1, 1]),
    }
    code = sympy.lambdify(Y, e, [names, "mpmath"])

    def bound(reach: Any) -> Any:
        try:
            _, top = iv.convert(code(iv.mpf([float(reach), "inf"])))._mpi_
            return arb(mpmath.mp.make_mpf(top))
        except (AttributeError, TypeError, ValueError, ArithmeticError):
            return arb("nan")

    return bound
