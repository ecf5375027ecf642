"""The LaTeX of expansions, read back."""

from __future__ import annotations

import random
from typing import Any

import mpmath
import pytest
import sympy
from sympy import Rational
from sympy.core.function import AppliedUndef

import symasym as sa
from symasym.derivation.printing import tex
from symasym.expansions.builder import FinitePart
from symasym.expansions.expansion import _shortest
from tests.derivation.test_printing import _AIRY, Reader

#: What the reader has no value of.
BEYOND = (
    sympy.Integral, AppliedUndef, FinitePart, sympy.Abs, sympy.hyper, sympy.erfi, sympy.erfc,
    sympy.Max, sympy.EulerGamma,
)  # fmt: skip


@pytest.mark.parametrize(
    ("drift", "options", "least"),
    [
        (sa.friction(), {"quantity": "T", "order": 2}, 53),
        (sa.friction(), {"quantity": "density", "order": 1}, 18),
        (sa.Drift.general(), {"order": 3}, 16),
        (sa.Drift("c*u + u**2/3"), {"order": 2}, 44),
        (sa.friction(), {"noise": "strong", "order": 1}, 25),
        (sa.friction(), {"noise": "strong", "order": 2, "start": "-2"}, 18),
        (sa.friction(), {"quantity": "C", "noise": "strong", "order": 0, "start": "3/2"}, 12),
        (sa.friction(), {"quantity": "1-P", "noise": "strong", "order": 1}, 15),
        (sa.friction(), {"noise": "uniform", "order": 0}, 51),
        (sa.friction(), {"noise": "uniform", "order": 1, "case": "barrier well start"}, 132),
        (sa.Drift("1/2 - cos(3*u)"), {"noise": "uniform", "order": 1, "start": "-3/5"}, 92),
    ],
    ids=str,
)
def test_printed_formulas_are_the_expressions(
    drift: sa.Drift, options: dict[str, Any], least: int
) -> None:
    """The formula and all that it is made of, at random numbers, to 20 digits."""
    e, chance, count = sa.expand(drift, patience=100, **options), random.Random(str(options)), 0
    values = [e.formula, *e.definitions.values(), *e.equations.values()]
    for value in map(sympy.sympify, [*values, *(t.expression for t in e.terms)]):
        if value.has(*BEYOND):
            continue
        symbols = sorted(value.free_symbols, key=str)
        numbers = [Rational(chance.randint(20, 300), 151) * (-1 if s.is_negative else 1)
                   for s in symbols]  # fmt: skip
        text = tex(_shortest(value), {s: f"@{k} " for k, s in enumerate(symbols)})
        with mpmath.workdps(30):
            known = [mpmath.mpf(x.p) / x.q for x in numbers]
            wanted = sympy.lambdify(symbols, value, [_AIRY, "mpmath"])(*known)
            found = Reader(text, known).value()
            assert abs(found - wanted) <= abs(wanted) * mpmath.mpf(10) ** -20, text
        count += 1
    assert count >= least
