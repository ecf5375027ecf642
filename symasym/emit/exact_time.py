"""The exact escape time of a drift, as a program (`symasym.emit.kernels.exact`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.program import FirstPassage, Function, Program
from symasym.records import Record

if TYPE_CHECKING:
    from sympy import Expr

_U = sympy.Symbol("u", real=True)
ERROR = (
    "log T is right to 1e-12, or to 1e-12 of itself where that is larger, for the drift with its "
    "numbers as doubles; kappa from 1e-8 to 1e8, r from 1e-100 to 1e12, else refused, and also "
    "where both directions of the computation differ by more"
)


def exact_time(what: Record, drift: Drift) -> Program:
    """T from 0, by positive-form and panel-step, in doubles or digits."""
    A = sympy.sympify(drift.expression())
    ends = tuple(sympy.expand(A.subs(_U, end)) for end in (-1, 1))
    known: dict[str, Any] = {}
    if A.is_polynomial(_U):
        powers = tuple(sympy.Poly(A, _U).all_coeffs()[::-1])
        known["coefficients"] = powers
        # A moves by as much where u is rounded.
        size = sympy.Add(*((1 + k) * abs(c) for k, c in enumerate(powers)))
    else:
        known["points"] = _marks(drift)
        inside = np.linspace(-1, 1, 1001)
        values = np.abs(drift.evaluate_float(inside))
        size = sympy.Float(values.max() + np.abs(np.gradient(values, inside)).max(), 20)
    first_passage = FirstPassage(by_powers(A), ends, size, **known)
    function = Function(
        "escape_time",
        "T from 0 to |u| = r (eq:Ttilde).",
        ("kappa", "r", *drift.free),
        (),
        outside="kappa is not in 1e-8..1e8 or r not in 1e-100..1e12, or log T not known to 1e-12",
        first_passage=first_passage,
    )
    return Program(
        what.label, what.title, (function,), ERROR, assumptions=what.assumptions, latex=what.latex()
    )


def by_powers(e: Expr, zero: int | None = None) -> Expr:
    """A polynomial in u by Horner's rule, around a known zero where it has one."""
    if not e.is_polynomial(_U):
        return e
    if zero is not None and sympy.expand(e.subs(_U, zero)) == 0:
        quotient = sympy.Poly(e, _U).quo(sympy.Poly(_U - zero, _U))
        return (_U - zero) * sympy.horner(quotient.as_expr(), _U)
    return sympy.horner(e, _U)


def critical(drift: Drift) -> tuple[Any, ...]:
    """The zeros of A in the layer, to double precision."""
    if drift.free:
        raise InputError(
            f"the wells of {drift!r} have no closed form in {', '.join(drift.free)}; bind them, or "
            "use a polynomial drift."
        )
    return tuple(sympy.Float(float(point.u), 20) for point in drift.critical_points())


def _marks(drift: Drift) -> tuple[Any, ...]:
    """Zeros of the drift, and where it turns: what is narrow is not stepped over."""
    from symasym.base.contexts import own_context
    from symasym.drift.field.taylor_field import ExactField

    zeros = critical(drift)
    with own_context(30) as context:
        turns = [float(u) for u in ExactField(drift, False, context).monotone_marks()]
    apart = (u for u in turns if all(abs(u - float(z)) > 1e-9 for z in zeros) and abs(u) < 1)
    return tuple(sorted((*zeros, *(sympy.Float(u, 20) for u in apart))))
