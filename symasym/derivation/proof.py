"""The three checks of a step: exact equality, a sign that is seen, the slope of a remainder.

`equal` asks a random point first, with random polynomials in the place of unknown functions, so
that what is false fails in a tenth of a second; what it lets pass is proved or fails. The remainder
of an asymptotic statement is measured: |exact - stated|/order settles.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any

import mpmath
import sympy
from sympy import Integral, S
from sympy.core.function import AppliedUndef
from sympy.printing.pycode import MpmathPrinter

# What shows that a difference is 0, the quickest first.
_WAYS: tuple[Callable[[Any], Any], ...] = (
    lambda e: e, sympy.expand, lambda e: sympy.expand(e.doit(integrals=False)),
    lambda e: sympy.expand(sympy.numer(sympy.together(e))),
    lambda e: sympy.powsimp(sympy.expand(e)), sympy.simplify,
    lambda e: sympy.simplify(e.rewrite(sympy.exp)),
)  # fmt: skip


def equal(left: Any, right: Any) -> bool:
    """True where left.doit() = right is proved; of tuples, piece by piece."""
    left, right = sympy.sympify(left), sympy.sympify(right)
    if left == right:
        return True
    if isinstance(left, sympy.Tuple):
        return len(left) == len(right) and all(map(equal, left, right))
    gap = worked(left) - worked(right)
    if any(way(gap) == 0 for way in _WAYS[:3]):
        return True
    if _differ(gap):
        return False
    return any(way(gap) == 0 for way in (_WAYS[:5] if gap.has(Integral) else _WAYS))


@cache
def worked(e: Any) -> Any:
    """The value of `e`: all carried out but integrals over arguments of functions without value."""

    def known(x: Any) -> bool:
        if not isinstance(x, Integral):
            return False
        held: set[Any] = set().union(*(f.free_symbols for f in x.atoms(AppliedUndef)))
        empty = any(len(limit) == 3 and limit[1] == limit[2] for limit in x.limits)
        return empty or not held >= set(x.variables)

    done = e.doit(integrals=False).replace(known, lambda x: x.doit())
    return done.replace(sympy.erfc, lambda x: 1 - sympy.erf(x))


def _differ(gap: Any) -> bool:
    """True where `gap` is not 0 at a random point, with random polynomials for functions."""
    ends = (end for x in gap.atoms(Integral) for _, *limits in x.limits for end in limits)
    if any(end.is_infinite for end in ends):
        return False
    rng = random.Random(3)
    for _ in range(2):
        e = gap
        for f in sorted({x.func for x in gap.atoms(AppliedUndef)}, key=str):
            c = [S(rng.randint(-40, 40)) / 37 for _ in range(9)]
            e = e.replace(f, lambda *a, c=c: c[8] * sympy.prod(a) + sum(
                c[4 * i % 8 + k] * x**k for i, x in enumerate(a) for k in range(1, 4)))  # fmt: skip
        point = {}
        for s in sorted(gap.free_symbols, key=str):
            size = S(rng.randint(2, 7)) if s.is_integer else S(rng.randint(150, 2900)) / 997
            sign = 1 if s.is_positive else -1 if s.is_negative else rng.choice((1, -1))
            point[s] = sign * size
        try:
            value = numeric(e.doit(integrals=False), tuple(point))(*map(mpmath.mpf, point.values()))
        except (NameError, TypeError, ValueError, ArithmeticError, AttributeError, KeyError):
            continue
        if abs(value) > (1e-3 if e.has(Integral) else 1e-9):
            return True
    return False


class _Mpmath(MpmathPrinter):  # type: ignore[misc]
    """SymPy's printer, with the functions it does not know and integrals one in the other."""

    def _print_Function(self, e: Any) -> str:
        name, at = type(e).__name__, ", ".join(map(self._print, e.args))
        return f"{name.removesuffix('prime')}({at}{', derivative=1' * name.endswith('prime')})"

    def _print_Heaviside(self, e: Any) -> str:
        return f"(1 if {self._print(e.args[0])} > 0 else 0)"

    def _print_Integral(self, e: Any) -> str:
        shown = self._print(e.function)
        for x, low, high in e.limits:
            ends = f"{self._print(low)}, {self._print(high)}"
            shown = f"quad(lambda {self._print(x)}: {shown}, {ends})"
        return str(shown)


def numeric(e: Any, arguments: Iterable[Any] = ()) -> Any:
    """A SymPy expression as a function in mpmath."""
    printer = _Mpmath({"fully_qualified_modules": False, "order": "none"})
    return sympy.lambdify(tuple(arguments), e, [{"quad": _quad}, "mpmath"], printer=printer)


def _quad(f: Any, a: Any, b: Any) -> Any:
    """The integral of f, which may have kinks at -1, 0 and 1, coarsely: it refutes, no more."""
    ends = [a, *(k for k in (-1, 0, 1) if a < k < b), b]
    return mpmath.quad(f, ends, maxdegree=3, method="gauss-legendre")


def not_negative(e: Any) -> bool:
    """A sign that SymPy sees, or of e^x - 1, 1 - e^-x for x > 0, of sums and products of such."""
    if e.is_nonnegative:
        return True
    for sign in (1, -1):  # e^x - 1, and 1 - e^-x
        exponent = sympy.log(sympy.expand(sign * e + 1))
        if (sign * exponent).is_positive:
            return True
    return bool(e.is_Add or e.is_Mul) and all(map(not_negative, e.args))


@cache
def _exact(exact: Any, x: str, digits: int) -> Any:
    with mpmath.workdps(digits):
        return exact(mpmath.mpf(x), mpmath.mp)


def slope(
    stated: Any, error: Any, variable: Any, exact: Callable[[Any, Any], Any],
    at: Sequence[str], values: Mapping[Any, Any], digits: int,
) -> Any:  # fmt: skip
    """The logarithmic slope of |exact - stated|/error in `variable` between two points."""
    names = (variable, *values)
    leading, gauge, ratios = numeric(stated, names), numeric(error, names), []
    with mpmath.workdps(digits):
        for x in at:
            k = mpmath.mpf(x)
            row = [v(k, mpmath.mp) if callable(v) else mpmath.mpf(v) for v in values.values()]
            ratios.append(abs((_exact(exact, x, digits) - leading(k, *row)) / gauge(k, *row)))
        if 0 in ratios:
            return mpmath.inf
        return mpmath.log(ratios[1] / ratios[0]) / mpmath.log(mpmath.mpf(at[1]) / mpmath.mpf(at[0]))
