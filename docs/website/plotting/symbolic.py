"""Numbers of a derivation's own expression: what is plotted is never typed again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy

import symasym as sa

Value = Callable[..., Any]


def parts(label: str) -> tuple[Any, ...]:
    """The expressions of a label."""
    found = sa.formula(label).expression
    return tuple(found) if isinstance(found, tuple | sympy.Tuple) else (found,)


def value(label: str, part: int = 0, **functions: Any) -> Value:
    """One expression as a function of its symbols, by name; arrays broadcast.

    `functions` are those that the expression leaves open: F=lambda y: ….
    """
    return of(parts(label)[part], **functions)


def of(expression: Any, **functions: Any) -> Value:
    """The same of an expression; what it does not hold is given in vain."""
    symbols = sorted(expression.free_symbols, key=lambda s: s.name)
    step = {"Heaviside": lambda x, *_: np.heaviside(x, 0.5)}
    called = sympy.lambdify(symbols, expression, [{**step, **functions}, "numpy"])

    def at(**values: Any) -> Any:
        return called(*(values[s.name] for s in symbols))

    return at


def operator(label: str, drift: Any, u: Any, **values: Any) -> tuple[Callable[[Any], Any], ...]:
    """What a differential expression multiplies q'', q' and q by, with phi = `drift`."""
    (e,) = parts(label)
    q = sympy.Function("q")(u)
    whole = sympy.expand(e.subs(sympy.Function("phi")(u), drift).doit())
    second, first = (whole.coeff(sympy.Derivative(q, (u, k))) for k in (2, 1))
    rest = whole - second * sympy.Derivative(q, (u, 2)) - first * sympy.Derivative(q, u)
    return tuple(along(of(c), "u", **values) for c in (second, first, sympy.expand(rest).coeff(q)))


def along(function: Value, name: str, **values: Any) -> Callable[[Any], Any]:
    """A function of one of its arguments, the others given; a constant is one for each."""

    def at(x: Any) -> Any:
        return function(**{name: x}, **values) + np.zeros(np.shape(x))

    return at
