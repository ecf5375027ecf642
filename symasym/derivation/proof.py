"""The three checks of a step: exact equality, a sign that is seen, the slope of a remainder.

What `equal` lets pass is proved. The remainder of an asymptotic statement is measured: |exact -
stated|/order settles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import Any

import mpmath
import sympy
from sympy import Integral
from sympy.core.function import AppliedUndef


def equal(left: Any, right: Any) -> bool:
    """True where left.doit() = right is proved; of tuples, piece by piece."""
    left, right = sympy.sympify(left), sympy.sympify(right)
    if left == right:
        return True
    if isinstance(left, sympy.Tuple):
        return len(left) == len(right) and all(map(equal, left, right))
    gap = worked(left) - worked(right)
    if sympy.expand(gap) == 0 or sympy.expand(sympy.numer(sympy.together(gap))) == 0:
        return True
    return not gap.has(Integral) and bool(sympy.simplify(gap) == 0)


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


def numeric(e: Any, arguments: Iterable[Any]) -> Any:
    """A SymPy expression as a function in mpmath."""
    known = {f"airy{x}iprime": partial(getattr(mpmath, f"airy{x}i"), derivative=1) for x in "ab"}
    return sympy.lambdify(tuple(arguments), e, [known, "mpmath"])


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
