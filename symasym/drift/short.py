"""Expressions that SymPy simplifies in well under a second; others stay as they are."""

from __future__ import annotations

from typing import Any

import sympy

from symasym.drift.grammar import functions_inside, multiplied_out

# Terms when multiplied out; operations, and those in each other; functions, and those in each
# other; the numbers that are powers or multiply angles, and those that multiply logarithms, which
# become powers.
_TERMS, _OPERATIONS, _HEIGHT = 1_000, 120, 14
_FUNCTIONS, _NESTED, _MULTIPLE, _LARGEST = 8, 3, 20, 2_000


def simplified(expression: Any) -> Any:
    """The expression, simplified where that is quick."""
    return sympy.simplify(expression) if is_short(expression) else expression


def is_short(expression: Any) -> bool:
    """True if SymPy simplifies it quickly: few operations, brackets and functions, small powers."""
    if sympy.count_ops(expression) > _OPERATIONS or multiplied_out(expression) > _TERMS:
        return False

    def height(node: Any) -> int:
        """Operations in each other."""
        return 1 + max(map(height, node.args), default=0)

    functions = expression.atoms(sympy.Function)
    numbers = set().union(*(f.atoms(sympy.Integer) for f in functions))
    numbers |= {p.exp for p in expression.atoms(sympy.Pow) if p.exp.is_Rational}
    rationals = expression.atoms(sympy.Rational) if expression.has(sympy.log) else set()
    return (
        len(functions) <= _FUNCTIONS
        and all(abs(n) <= _MULTIPLE for n in numbers)
        and all(abs(n) <= _LARGEST for n in rationals)
        and functions_inside(expression) <= _NESTED
        and height(expression) <= _HEIGHT
    )
