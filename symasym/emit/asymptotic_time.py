"""The escape time of one drift by its expansions, as code: weak noise, and uniform to order 0.

In weak noise the critical points, their coefficients and their composition are those of
`symasym.asymptotics.weak_noise.compose`: it is run with a symbol for lam and another for every
series, and exponentials kept apart by their heights. What is emitted is log(N/D), the largest
exponential of both taken out. The uniform formula of polynomial drifts is that of
`symasym.emit.kernels.uniform` and what it calls, for one scene at a time, in doubles.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from symasym.asymptotics.weak_noise.compose import (
    AtOrder,
    Composed,
    Sides,
    escape_time,
    mean_time,
    side_of,
    with_digits,
)
from symasym.asymptotics.weak_noise.critical_points import both_sides
from symasym.asymptotics.weak_noise.one_sided import OneSided
from symasym.asymptotics.weak_noise.regular_part import unresolved
from symasym.asymptotics.weak_noise.series import Point, added
from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError, InputError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.emit.program import FirstPassage, Function, Program, by_logarithm
from symasym.emit.source import rendered
from symasym.emit.symbolic_sums import (
    BEYOND_1,
    DIGITS,
    KAPPA,
    LAM,
    Names,
    R,
    Ratio,
    Symbolic,
    X,
    number_of,
)
from symasym.methods import WEAK_NOISE_ORDERS
from symasym.numbers.arithmetic import Digits
from symasym.records import Record
from symasym.scenes import read_order

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

__all__ = ["RIGHT", "uniform_time", "weak_noise_time"]


#: Digits that are right in what the coefficients make up.
RIGHT = 32
# What stays below e^-150 of the rest is nothing in 32 digits, whatever its factor.
FAINT = 150


def weak_noise_time(
    what: Record, drift: Drift, order: int | str | None, r: Fraction | None, kappa: float | None
) -> Program:
    """T from 0 to order `order`, 2 if None; for one r, or for all r > 1 where it is None."""
    if order == "optimal":
        raise InputError("order is 'optimal', which depends on kappa; give a number.")
    order = read_order(order, *WEAK_NOISE_ORDERS)
    if drift.free:
        raise InputError(
            f"the zeros of {drift!r} have no closed form in {', '.join(drift.free)}; bind them."
        )
    with own_context(DIGITS) as context:
        field = ExactField(drift, False, context)
        radius = r or Fraction(2)
        both = both_sides(field, Fraction(0), radius, order, context, DIGITS, estimated=False)
        names = Names(order, context, np.abs(drift.evaluate_float(np.linspace(-1, 1, 101))).max())
        ratio = _composed(both, names, r)
    most = _reach(drift, both, order, r)
    # Where the sums over critical points cancel, doubles may hold less than the expansion does.
    for _ in range(40):
        emitted = _program(what, ratio, names, order, r, kappa, most)
        if kappa is not None or _in_doubles(emitted, most, both, r, order):
            break
        most = _rounded_down(most / 2)
    error = f"relative O(kappa^{2 * order + 2}); {_told(both, order, r, most)}"
    return replace(emitted, error=error)


def _program(
    what: Record,
    ratio: Ratio,
    names: Names,
    order: int,
    r: Fraction | None,
    kappa: float | None,
    most: float,
) -> Program:
    """log(N/D) of the composition as a program, valid for kappa up to `most`."""
    log, faint = ratio.log(FAINT / (2 / (kappa or most) ** 2))
    log = sympy.log(LAM) + log
    shared = [(X, KAPPA**2 / 2), (LAM, 2 / KAPPA**2), (BEYOND_1, R - 1), *names.series]
    needed = log.free_symbols | {X, LAM}
    kept = tuple((s, e) for s, e in shared if s in needed)
    least = sympy.Rational(1, 10**100)  # its square is no 0
    where: tuple[Any, ...] = (least <= KAPPA, sympy.Le(KAPPA, sympy.Float(repr(most), 20)))
    outside = f"kappa is not in 1e-100..{most}, where this order gives T"
    if r is None:
        where += (R > 1,)
        outside += ", or r is not above 1"
    left_out = [f"{kind}s in the layer, there are none" for kind in ("well", "barrier")
                if not any(s.name.startswith(kind) for s, _ in names.series)]  # fmt: skip
    if faint:
        at = f"kappa = {kappa}" if kappa else f"any kappa up to {most}"
        left_out.append(
            f"{faint} products of critical points below e^-{FAINT} of the rest for {at}"
        )
    about = f"T from 0 in weak noise, to order {order} in kappa^2."
    function = by_logarithm("weak_noise_time", about, ("kappa", "r"), log, where, kept, outside)
    return Program(
        what.label, what.title, (function,), assumptions=what.assumptions,
        left_out=tuple(left_out), digits=RIGHT,
        note="the expansion in weak noise, of T with all that is exponentially small",
    )  # fmt: skip


# -- where it holds ------------------------------------------------------------------------------


_RADII = tuple(Fraction(x) for x in ("1.001", "2", "10", "1000"))


def _time(
    both: tuple[OneSided, OneSided], kappa: float, r: Fraction, order: int, context: MPContext
) -> AtOrder:
    """T and its claimed error."""
    arithmetic = Digits(context)
    lam = context.mpf(2) / context.mpf(kappa) ** 2
    composed = Composed(both, arithmetic.number(r), 64 * context.eps)
    return with_digits(escape_time, composed, Point(lam, order, True, None, arithmetic))


def _reach(drift: Drift, both: tuple[OneSided, OneSided], order: int, r: Fraction | None) -> float:
    """The kappa up to which the next orders are smaller than the value."""
    radii = _RADII if r is None else (r,)
    with own_context(30) as context:

        def holds(kappa: float) -> bool:
            if unresolved(drift, 2 / kappa**2, ()):
                return False
            times = (_time(both, kappa, radius, order, context) for radius in radii)
            return all(time.sure for time in times)

        kappa, factor = 1e-3, 1.5
        while not holds(kappa):
            kappa /= 10
            if kappa < 1e-12:
                raise AccuracyError(
                    "a well, a barrier or the start is too close to another or to an end for an "
                    f"expansion of order {order}; emit the exact time, or another order."
                )
        while factor > 1.02 and kappa < 1e4:
            if holds(kappa * factor):
                kappa *= factor
            else:
                factor = factor**0.5
    return _rounded_down(kappa)


def _rounded_down(x: float) -> float:
    unit = 10.0 ** (math.floor(math.log10(x)) - 1)
    return float(f"{math.floor(x / unit * (1 + 1e-12)) * unit:.2g}")


def _told(both: tuple[OneSided, OneSided], order: int, r: Fraction | None, most: float) -> str:
    """The error estimate from the next two orders, as a sentence."""
    at, stated = r or Fraction(10), []
    with own_context(30) as context:
        for kappa in (most / 2, most / 4, most / 8):
            time = _time(both, kappa, at, order, context)
            relative = float(time.error / time.value) if time.sure else math.inf
            stated.append(f"{relative:.1e} at kappa = {kappa:.3g}")
    return (
        "an estimate, twice the size of the next two orders of each series, is for r = "
        f"{float(at):.4g}: {', '.join(stated)}"
    )


def _in_doubles(
    code: Program,
    kappa: float,
    both: tuple[OneSided, OneSided],
    r: Fraction | None,
    order: int,
) -> bool:
    """True where the emitted code has 1e-13 of log T.

    Raises
    ------
    ArithmeticError
        If it has not the value in many digits either: then it is another formula.
    """
    doubles, digits = (
        rendered(code, target).load().log_weak_noise_time for target in ("python", "mpmath")
    )
    kappa *= 1 - 1e-9  # its double may be above its decimal
    # Of a small drift, whose terms cancel as long as lam |V| is small, digits are lost.
    with own_context(120) as context:
        for radius in _RADII if r is None else (r,):
            # The double that the code is given.
            given = (float(radius),) if r is None else ()
            exact = Fraction(given[0]) if given else radius
            want = context.log(_time(both, kappa, exact, order, context).value)
            size = max(1, abs(want))
            if not abs(digits(kappa, *given, dps=25) - want) <= 1e-22 * size:
                raise ArithmeticError(f"{code.label}: what is emitted has not the sums' value")
            try:
                got = doubles(kappa, *given)
            except ValueError:  # a logarithm of what is no more than rounding
                return False
            if not abs(got - want) <= 5e-14 * size:
                return False
    return True


def _composed(both: tuple[OneSided, OneSided], names: Names, r: Fraction | None) -> Ratio:
    """T/lam, by the sums that evaluate it."""
    ops = Symbolic()
    radius = 1 + BEYOND_1 if r is None else number_of(r)
    one, other = both
    scale, speed = (
        ops.exponential(0.0, names.named(f"start_{kind}", series))
        for kind, series in (
            ("scale", added(one.scale_start, other.scale_start)),
            ("speed", added(one.speed_start, other.speed_start)),
        )
    )
    left, right = (
        side_of(names.one_sided(one, side), radius, ops)
        for one, side in zip(both, ("left", "right"), strict=True)
    )
    ratio = mean_time(Sides(left, right, scale, speed, one.endpoint_product))
    assert isinstance(ratio, Ratio)
    return ratio


# -- uniform, to order 0 -------------------------------------------------------------------------

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
