"""The escape time of one drift, uniform to order 0, as code.

The formula of polynomial drifts is that of `symasym.emit.kernels.uniform` and what it calls, for
one scene at a time, in doubles.
"""

from __future__ import annotations

import sympy

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.program import FirstPassage, Function, Program
from symasym.records import Record

__all__ = ["uniform_time"]

_U = sympy.Symbol("u", real=True)
# As many as the emitted functions have room for.
_MOST_DEGREE = 12
ERROR = (
    "none is stated: the relative error is of order kappa^2, and of order 1 where the noise is "
    "strong; sa.escape_time with full=True estimates it. The formula itself is evaluated to 1e-13 "
    "of log T, or of 1 where that is larger; to fewer digits, nine at least, where zeros nearly "
    "coincide that are not taken together"
)
OUTSIDE = (
    "kappa or r is out of range, or the start or r is at a zero of the drift, or a barrier lies "
    "uphill from the start"
)
_ABSENT = {
    2: "pairs of zeros and Airy functions, as A has no two zeros",
    4: "a search for complex zeros, as A has no more than two",
}


def uniform_time(what: Record, drift: Drift) -> Program:
    """T from 0, uniform in what may meet, to order 0."""
    A = sympy.sympify(drift.expression())
    if not A.is_polynomial(_U):
        raise InputError(
            f"{drift!r} is no polynomial in u, and its zeros have no closed form; emit the exact "
            "time, or call sa.escape_time with method='uniform'."
        )
    powers = tuple(sympy.Poly(A, _U).all_coeffs()[::-1])
    if len(powers) > _MOST_DEGREE + 1:
        raise InputError(
            f"{drift!r} has degree {len(powers) - 1}; the uniform time is emitted up to "
            f"{_MOST_DEGREE}. Emit the exact time."
        )
    phi = drift.phi()
    ends = tuple(sympy.expand(A.subs(_U, end)) for end in (-1, 1))
    if isinstance(phi, sympy.Piecewise) and (
        sympy.expand(phi.args[0][0] - ends[0]) != 0 or sympy.expand(phi.args[-1][0] - ends[1]) != 0
    ):
        raise InputError(f"{drift!r} jumps at an end of the layer; emit the exact time.")
    function = Function(
        "uniform_time",
        "T from 0 to |u| = r (eq:Ttilde), to order 0, uniform through folds and the layer's ends.",
        ("kappa", "r", *drift.free),
        (),
        outside=OUTSIDE,
        first_passage=FirstPassage(A, ends, sympy.S.Zero, coefficients=powers, uniform=True),
    )
    left = tuple(why for degree, why in _ABSENT.items() if len(powers) <= degree)
    return Program(
        what.label, what.title, (function,), ERROR,
        "T is taken to leading order in weak noise, with pairs of zeros by Airy functions and a "
        "barrier before an end of the layer by the error function and Dawson's integral",
        what.assumptions, what.latex(), left_out=left,
    )  # fmt: skip
