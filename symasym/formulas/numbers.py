"""Numbers of a bound drift for its formula: critical points, heights and finite parts, in balls."""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import sympy
from flint import acb
from sympy import Expr, Symbol

from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.expansions.balls import Field, Unresolved
from symasym.formulas.letters import FinitePart
from symasym.numbers.balls import exact_ball, precision

if TYPE_CHECKING:
    from symasym.formulas.formula import Expansion

__all__ = ["DIGITS", "numbers_of"]

#: Digits that are right in what the numbers make up; they themselves have more.
DIGITS = 32
_OWN, _MOST_BITS = 50, 4096


def numbers_of(e: Expansion) -> dict[Symbol, Expr]:
    """Of a bound drift: what has no closed form, to 50 digits.

    Raises
    ------
    AccuracyError
        If zeros of A are too close together.
    """
    drift, bits = e.drift, 256
    if drift.free or drift.shape or drift == Drift.general():
        return {}
    while bits <= _MOST_BITS:
        with suppress(Unresolved), precision(bits):
            return _found(e, Field(drift, abs(e.start) + 2, e.start))
        bits *= 2
    raise AccuracyError(f"the zeros of {drift!r} are too close together for {_OWN} digits.")


def _found(e: Expansion, field: Field) -> dict[Symbol, Expr]:
    """The same at flint's precision."""
    zeros = dict(zip(e.equations, (u for u, _ in field.zeros), strict=False))
    found = {u: _number(z) for u, z in zeros.items()}

    def place(u: Expr) -> Any:
        return exact_ball(Fraction(u.p, u.q)) if u.is_Rational else zeros[u]

    for s, value in e.definitions.items():
        if s in e.integrals or isinstance(value, FinitePart):
            lo, hi = (Fraction(u.p, u.q) for u in e.integrals.get(s, value).args[2:])
            k = int(s.name[1:-1])
            found[s] = _number(field._inside(lo, hi, k)[k - 1])
        elif value.has(sympy.Integral) and value.free_symbols <= zeros.keys():
            # int A du is what V falls by.
            found[s] = value.replace(sympy.Integral, lambda _, limits: _number(
                field.potential(place(limits[1])) - field.potential(place(limits[2]))))  # fmt: skip
    return found


def _number(x: Any) -> Expr:
    x = x.real if isinstance(x, acb) else x
    if x.rel_accuracy_bits() < 3.33 * _OWN and not abs(x) < 1e-60:
        raise Unresolved
    return sympy.Float(x.mid().str(_OWN + 10, radius=False, more=True), _OWN)
