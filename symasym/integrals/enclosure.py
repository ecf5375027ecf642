"""Expressions in balls, and the integral of g e^(lam f) itself, enclosed.

The integral is flint's (F. Johansson, Numerical integration in arbitrary-precision ball arithmetic,
2018); a function with a branch cut is nan across it wherever analyticity is asked for. At an end
where g is algebraic x = end ± y^q. Where f tends to -oo, or x to infinity, y goes to oo and is cut
at R: where y d/dy log |g e^(lam f)| <= -m < -1 beyond R, the rest is at most the integrand there
times R/(m - 1).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import mpmath
import sympy
from flint import acb, arb, ctx, fmpq
from mpmath.ctx_iv import MPIntervalContext
from sympy import Expr, S, Symbol

from symasym.base.errors import AccuracyError, InputError
from symasym.numbers.balls import precision

Code = Callable[[Any, bool], Any]
Bound = Callable[[Any, Fraction], Any]
FUNCTIONS = (
    "exp", "log", "sqrt", "erf", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh",
    "tanh", "asinh", "acosh", "atanh",
)  # fmt: skip
#: The variable of a stretch.
Y = Symbol("y", positive=True)
_LAM = Symbol("lam", positive=True)
# Doublings of R until the bound of the rate is a number.
_TRIES = 20


def _off(along: Any, across: Any) -> bool:
    """True if a ball misses the axis, or touches it between -1 and 1 alone."""
    return not across.contains(0) or bool(abs(along) < 1)


#: Where the inverse functions are analytic (DLMF 4.23.1, 4.37.1).
_ANALYTIC: dict[str, Callable[[Any], bool]] = {
    **dict.fromkeys(("asin", "acos", "atanh"), lambda z: _off(z.real, z.imag)),
    **dict.fromkeys(("atan", "asinh"), lambda z: _off(z.imag, z.real)),
    "acosh": lambda z: not z.imag.contains(0) or bool(z.real > 1),
}


def call(name: str, z: Any, analytic: bool = False) -> Any:
    """A function of an arb or acb; nan if it is to be `analytic` on the ball and is not."""
    if analytic and name == "log":
        return z.log(analytic=True)
    if analytic and name in _ANALYTIC and not _ANALYTIC[name](z):
        return acb("nan")
    return getattr(z, name)()


def power(z: Any, p: Expr, analytic: bool = False) -> Any:
    """z^p, p a constant; likewise."""
    exponent = fmpq(int(p.p), int(p.q)) if p.is_Rational else constant(p)
    if isinstance(z, acb):
        root = p == S.Half
        return z.sqrt(analytic=analytic) if root else z.pow(acb(exponent), analytic=analytic)
    return z**exponent


def name_of(e: Expr) -> str:
    """The name of a function that is evaluated."""
    name = type(e).__name__
    if name in FUNCTIONS:
        return name
    raise InputError(
        f"f or g contains {e}, which is not among the functions symasym evaluates; write them with "
        f"{', '.join(FUNCTIONS)}, Abs, Max, Min, sign, Piecewise and powers."
    )


def compiled(e: Expr, x: Symbol) -> Code:
    """The expression as a function of a ball, and of whether it must be analytic there."""
    if e == x:
        return lambda z, a: z
    if not e.has(x):
        value = constant(e)
        return lambda z, a: value
    if e.is_Pow and e.exp.has(x):
        return compiled(sympy.exp(e.exp * sympy.log(e.base), evaluate=False), x)
    for wave in e.args if e.is_Mul else ():
        for sign in (1, -1) if isinstance(wave, sympy.sin) else ():
            u = sign * wave.args[0]
            if 1 / u in e.args:
                smooth, inner = compiled(sign * e / wave * u, x), compiled(u, x)
                return lambda z, a: smooth(z, a) * inner(z, a).sinc()
    first, *rest = (compiled(part, x) for part in e.args)
    if e.is_Pow:
        p, whole = e.exp, int(e.exp) if e.exp.is_Integer else None
        return lambda z, a: power(first(z, a), p, a) if whole is None else first(z, a) ** whole
    if e.is_Add:
        return lambda z, a: sum((f(z, a) for f in rest), first(z, a))
    if e.is_Mul:

        def product(z: Any, a: bool) -> Any:
            total = first(z, a)
            for f in rest:
                total = total * f(z, a)
            return total

        return product
    name = name_of(e)
    return lambda z, a: call(name, first(z, a), a)


def constant(e: Expr) -> Any:
    """A constant expression as an arb or acb at the working precision."""
    if e.is_Rational:
        return arb(fmpq(int(e.p), int(e.q)))
    known = {S.Pi: arb.pi, S.Exp1: arb.const_e, S.ImaginaryUnit: lambda: acb(0, 1), S.NaN: arb.nan}
    known |= {S.Infinity: arb.pos_inf, S.NegativeInfinity: arb.neg_inf}
    if e in known:
        return known[e]()
    if isinstance(e, sympy.CRootOf):
        return Zero(e.poly.as_expr(), e.poly.gen, Fraction(str(e.n(40)))).ball()
    if not e.args:
        raise InputError(f"{e} has no value; give it one.")
    with suppress(ZeroDivisionError):
        return compiled(e.xreplace({e.args[0]: Y}), Y)(constant(e.args[0]), False)
    return arb.nan()


def number(e: Any) -> Any:
    """A constant as an arb, nan where it isn't real."""
    if isinstance(e, (Zero, arb)):
        return e.ball() if isinstance(e, Zero) else e
    value = constant(e)
    if isinstance(value, acb):
        return value.real if value.imag.contains(0) else arb.nan()
    return value


@dataclass(frozen=True)
class Zero:
    """The simple zero of an expression in x near a number, where it has no closed form."""

    equation: Expr
    x: Symbol
    near: Fraction

    def ball(self) -> Any:
        """An enclosure, by Newton's method in balls, of more bits, as a polynomial cancels some."""
        with precision(2 * ctx.prec + 200):
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
            f"the zero of {self.equation} near {self} is not simple; give an f whose maxima have a "
            "closed form there."
        )

    def __str__(self) -> str:
        return f"{float(self.near):.12g}"


@dataclass(frozen=True)
class Stretch:
    """f and g dx/dy on a range of y, which ends at 0 or, if `far`, at oo."""

    f: Expr
    g: Expr
    lo: Expr
    hi: Expr
    far: bool

    @cached_property
    def rate(self) -> Bound:
        """y d/dy log |g e^(lam f)| from above."""
        return _upper(Y, _LAM * self.f.diff(Y) + sympy.simplify(self.g.diff(Y) / self.g))

    @cached_property
    def rate_of_f(self) -> tuple[Bound, Bound]:
        """y d/dy lam f from above, and |g|, for a g with zeros."""
        return _upper(Y, _LAM * self.f.diff(Y)), _upper(S.One, abs(self.g))

    def integrand(self, rate: Any, top: Any) -> Code:
        """g e^(rate (f - top)) dx/dy."""
        g, f = compiled(self.g, Y), compiled(self.f, Y)
        slope, bend = (compiled(self.f.diff(Y, k), Y) for k in (1, 2))

        def value(z: Any, analytic: bool) -> Any:
            height = f(z, analytic)
            if rate * height.rad() > 1:
                # Beside a maximum the ball of its Taylor polynomial is narrower.
                m = z.mid()
                t = z - m
                near = f(m, analytic) + t * (slope(m, analytic) + t * bend(z, analytic) / 2)
                height = near if near.rad() < height.rad() else height
            return acb(g(z, analytic)) * (rate * (height - top)).exp()

        return value

    def cut(self, lam: Fraction, integrand: Code, lo: Any, tiny: Any) -> tuple[Any, Any]:
        """R, and a bound of the integral beyond it; nan where none was found."""
        for beside in (False, True):
            rate = self.rate_of_f[0] if beside else self.rate
            for k in range(1, 200):
                reach = arb(2) ** k
                fall = -rate(reach, lam)
                if fall.is_nan() and k > _TRIES:
                    break
                if not (reach > 2 * lo and fall > 1):
                    continue
                rest = abs(integrand(reach, False)) * reach / (fall - 1)
                if beside:
                    here = compiled(self.g, Y)(reach, False)
                    rest = rest * self.rate_of_f[1](reach, lam) / abs(here)
                if rest < tiny:
                    return reach, rest
        return lo, arb.nan()


def integral(stretches: list[Stretch], lam: Fraction, top: Any, bits: int) -> Any:
    """int g e^(lam (f - top)) to about 2^-`bits`, as a ball; nan where it can't be enclosed."""
    tiny, total = arb(2) ** -bits, arb(0)
    for part in stretches:
        code = part.integrand(arb(fmpq(lam.numerator, lam.denominator)), top)
        lo, hi, rest = number(part.lo), number(part.hi), arb(0)
        if part.far:
            hi, rest = part.cut(lam, code, lo, tiny)
        try:
            found = acb.integral(code, acb(lo), acb(hi), rel_tol=tiny, abs_tol=tiny)
        except (ValueError, ZeroDivisionError):
            return arb.nan()
        total += found.real + arb(0, rest)
    return total


def _upper(factor: Expr, e: Expr) -> Bound:
    """The function R, lam -> an upper bound of factor e for all y > R.

    Intervals of mpmath, whose ends may be infinite, in 1/y: a quotient then has no oo/oo.
    """
    inverse = {Y: 1 / Y}
    whole = sympy.Mul(factor.xreplace(inverse), e.xreplace(inverse), evaluate=False)
    if not e.has(sympy.Function):
        whole = sympy.together(sympy.simplify(whole))
    iv = MPIntervalContext()
    names = {n: getattr(iv, n) for n in ("mpf", "exp", "log", "sqrt", "sin", "cos", "pi")} | {
        "Abs": abs,
        "tanh": lambda t: 1 - 2 / (iv.exp(2 * t) + 1),
        "cosh": lambda t: (iv.exp(t) + iv.exp(-t)) / 2,
        "sinh": lambda t: (iv.exp(t) - iv.exp(-t)) / 2,
    }
    code = sympy.lambdify((Y, _LAM), whole, [names, "mpmath"])

    def bound(reach: Any, lam: Fraction) -> Any:
        try:
            rate = iv.mpf(lam.numerator) / lam.denominator
            _, top = iv.convert(code(iv.mpf([0, 1 / float(reach)]), rate))._mpi_
        except (AttributeError, TypeError, ValueError, ArithmeticError):
            return arb.nan()
        return arb(mpmath.mp.make_mpf(top))

    return bound
