"""Forms of an expression that keep its digits: no overflow, no 0/0, constants rounded once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import sympy

from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.base.inputs import shown

if TYPE_CHECKING:
    from sympy import Expr, Symbol
    from sympy.printing.latex import LatexPrinter

# Largest whole number in a quotient that a double holds exactly.
_EXACT = 2**53
# Longest number that is factored with the rest, not kept as a symbol.
_MOST_BITS = 1000


class _Quotient(sympy.Function):  # type: ignore[misc]
    """A quotient with a removable singularity at 0, where it is `at_zero`."""

    at_zero: Any = sympy.S.One
    is_real = True

    @classmethod
    def eval(cls, x: Expr) -> Expr | None:
        return cls.at_zero if x.is_zero else None


class exprel(_Quotient):
    """(e^x - 1)/x."""

    is_positive = True


class exprel2(_Quotient):
    """(e^x - 1 - x)/x^2."""

    at_zero = sympy.Rational(1, 2)
    is_positive = True


class tanhc(_Quotient):
    """tanh(x)/x."""

    is_positive = True


class sinc(_Quotient):
    """sin(x)/x."""


class expm1(sympy.Function):  # type: ignore[misc]
    """e^x - 1."""

    is_real = True


class log1p(sympy.Function):  # type: ignore[misc]
    """log(1 + x)."""

    is_real = True


class logaddexp(sympy.Function):  # type: ignore[misc]
    """log(e^x + e^y)."""

    is_real = True


class height_exp(sympy.Function):  # type: ignore[misc]
    """e^(x h); of an array x at no cost where all of it is 1, or below the least double."""

    is_positive = True


class larger(sympy.Function):  # type: ignore[misc]
    """The larger of two numbers."""

    is_real = True

    def _latex(self, printer: LatexPrinter, exp: str | None = None) -> str:
        """The maximum in LaTeX."""
        return rf"\max({', '.join(printer._print(a) for a in self.args)})"


class log_modulus(sympy.Function):  # type: ignore[misc]
    """log(Ai(x)^2 + Bi(x)^2)."""

    is_real = True


class CalledBase(sympy.Function):  # type: ignore[misc]
    """A call of another function of the same file, by the name of the class."""

    is_real = True

    def _latex(self, printer: LatexPrinter, exp: str | None = None) -> str:
        """The call in upright letters."""
        name = type(self).__name__.replace("_", r"\_")
        inside = ", ".join(printer._print(a) for a in self.args)
        call = rf"\mathrm{{{name}}}({inside})"
        return call if exp is None else rf"{call}^{{{exp}}}"


def called(name: str, *arguments: Expr) -> Expr:
    """A call of the function `name` of the same file."""
    return type(name, (CalledBase,), {})(*arguments)


def by_name(e: Expr, values: Mapping[str, Any]) -> Expr:
    """`e` with the values in place of the symbols that have their names."""
    return e.subs({s: values[s.name] for s in e.free_symbols if s.name in values})


def quotients(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values, which are fractions, as rational numbers of SymPy."""
    return {name: sympy.Rational(x.numerator, x.denominator) for name, x in values.items()}


def removable(e: Any) -> Any:
    """`e` without the poles that only its way of writing has, such as tanh(a x)/a at a = 0."""
    for b in sorted(e.free_symbols, key=str):
        order = _pole(e, b)
        if order not in (1, 2):
            continue
        step()
        swaps = {}
        for node in e.atoms(sympy.exp, sympy.tanh, sympy.sin):
            x = node.args[0]
            if not x.has(b) or x.diff(b).has(b) or x.subs(b, 0) != 0:
                continue  # not a multiple of b
            if isinstance(node, sympy.exp):
                swaps[node] = 1 + x * exprel(x) if order == 1 else 1 + x + x**2 * exprel2(x)
            elif order == 1:
                swaps[node] = x * (tanhc if isinstance(node, sympy.tanh) else sinc)(x)
        if swaps:
            rewritten = e.xreplace(swaps)
            # What expanding and factoring must leave alone.
            large = (n for n in rewritten.atoms(sympy.Rational) if _bits(n) > _MOST_BITS)
            kept = (*rewritten.atoms(_Quotient), *large)
            whole = {node: sympy.Dummy(real=True) for node in kept}
            rewritten = sympy.factor(sympy.expand(rewritten.xreplace(whole)))
            if not _pole(rewritten, b):
                e = rewritten.xreplace({dummy: node for node, dummy in whole.items()})
    return e


def _bits(x: Any) -> int:
    """The bits of a rational number."""
    return max(int(x.p).bit_length(), int(x.q).bit_length())


def _pole(e: Expr, b: Symbol) -> int:
    """The highest power of `b` in a denominator."""
    powers = [p.exp for p in e.atoms(sympy.Pow) if p.base == b and p.exp.is_Integer]
    return max((-int(p) for p in powers if p < 0), default=0)


def log_form(e: Expr) -> Expr | None:
    """log(e) without an exponential that overflows; None where the sign of `e` is not seen."""
    if not e.has(sympy.exp):
        return sympy.log(e) if e.is_positive else None
    if isinstance(e, sympy.exp):
        return e.args[0]
    if e.is_Pow:
        base = log_form(e.base)
        return None if base is None else e.exp * base
    if e.is_Mul:
        apart = [a for a in e.args if a.has(sympy.exp)]
        rest = sympy.Mul(*(a for a in e.args if not a.has(sympy.exp)))
        if rest.is_negative:  # a negative sum, such as -a e^x - b e^y
            sums = [a for a in apart if a.is_Add]
            if not sums:
                return None
            apart = [a for a in apart if a is not sums[0]] + [
                sympy.Add(*(-t for t in sums[0].args))
            ]
            rest = -rest
        logs = [log_form(a) for a in apart]
        if any(log is None for log in logs) or not rest.is_positive:
            return None
        return sympy.Add(*logs, sympy.S.Zero if rest == 1 else sympy.log(rest))
    if e.is_Add:
        plain = sympy.Add(*(a for a in e.args if not a.has(sympy.exp)))
        terms = [a for a in e.args if a.has(sympy.exp)]
        logs = [log_form(a) for a in terms]
        if plain != 0:
            logs.append(log_form(plain))
        if any(log is None for log in logs):
            return None
        total = logs[0]
        for log in logs[1:]:
            total = logaddexp(total, log)
        return total
    return None


def stable(e: Expr) -> Expr:
    """`e` with e^x - 1 and log(1 + x) as functions, so that sharing parts does not undo them."""
    if not e.args or isinstance(e, sympy.core.relational.Relational):
        return e
    args = [stable(a) for a in e.args]
    if e.is_Add:
        constant = sum((a for a in args if a.is_Rational), sympy.S.Zero)
        for a in args:
            factor, power = a.as_coeff_Mul()
            if isinstance(power, sympy.exp) and constant and factor == -constant:
                rest = [b for b in args if b is not a and not b.is_Rational]
                return sympy.Add(*rest, factor * expm1(power.args[0]))
    if isinstance(e, sympy.log) and args[0].has(sympy.exp) and (logarithm := log_form(e.args[0])):
        return stable(logarithm)
    if e.is_Pow and e.exp.is_negative and e.base.is_Add and e.base.has(sympy.exp):
        # Where the exponential overflows, the quotient is 0.
        logarithm = log_form(e.base)
        if logarithm is not None:
            return sympy.exp(e.exp * stable(logarithm))
    if isinstance(e, sympy.log) and args[0].is_Add and len(args[0].args) == 2:
        rest = [a for a in args[0].args if a != 1]
        if len(rest) == 1:
            return log1p(rest[0])
    return e.func(*args) if args != list(e.args) else e


def rounded(e: Expr) -> Expr:
    """`e` with every constant that is no short quotient as the double nearest to it."""
    if e.is_Rational:
        short = abs(e.p) < _EXACT and e.q < _EXACT
        return e if short else _literal(e)
    step()
    if not getattr(e, "free_symbols", None) and not e.is_Boolean:
        return _literal(e)
    if not e.args:
        return e
    args = list(e.args)
    if e.is_Mul or e.is_Add:
        constants = [a for a in args if not a.free_symbols]
        total = e.func(*constants)
        args = [a for a in args if a.free_symbols]
        if total != e.func():
            args.append(total)
    # An exponent 1/2 is a root, and no number to be rounded.
    new = [a if e.is_Pow and k == 1 and a.is_Rational else rounded(a) for k, a in enumerate(args)]
    return e.func(*new)


def as_printed(e: Expr) -> Expr:
    """`e` with the functions of this module written out."""
    for kind, written in (
        (exprel, lambda x: (sympy.exp(x) - 1) / x),
        (exprel2, lambda x: (sympy.exp(x) - 1 - x) / x**2),
        (tanhc, lambda x: sympy.tanh(x) / x),
        (sinc, lambda x: sympy.sin(x) / x),
        (expm1, lambda x: sympy.exp(x) - 1),
        (log1p, lambda x: sympy.log(1 + x)),
        (log_modulus, lambda x: sympy.log(sympy.airyai(x) ** 2 + sympy.airybi(x) ** 2)),
        (logaddexp, lambda x, y: sympy.log(sympy.exp(x) + sympy.exp(y))),
        (larger, sympy.Max),
        (height_exp, lambda x, h: sympy.exp(x * h)),
    ):
        e = e.replace(kind, written)
    return e


def _literal(e: Expr) -> Expr:
    """The nearest double, as a symbol that is written as its shortest decimal."""
    number = sympy.N(as_printed(e), 30)
    if not number.is_real:
        raise InputError(
            f"with these parameters a constant of the formula is {shown(sympy.N(number, 6))}, no "
            "real number; leave a parameter free."
        )
    value = float(number)
    if value == 0 and e != 0 and e.is_zero is not True:
        return sympy.S.Zero
    if value in (float("inf"), float("-inf")):
        raise InputError(
            f"a constant of about 1e{int(sympy.N(sympy.log(abs(e), 10), 5))} is beyond the range "
            'of doubles; leave a parameter free, or emit "mpmath".'
        )
    literal = sympy.Symbol(repr(abs(value)), positive=True)
    return literal if value > 0 else -literal
