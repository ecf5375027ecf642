"""The shape of the potential: critical points, wells and barriers, and values of V."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symasym.base.call_context import own_context, step
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray
from symasym.generated.numpy_formulas import potential_left, potential_right
from symasym.numbers.complex_balls import ComplexBall, resolved
from symasym.numbers.polynomials import bracketed_zero
from symasym.numbers.trees import MpmathOps

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr

    from symasym.numbers.trees import Operations

_DIGITS = 60
# Bits of a coefficient, above which SymPy takes minutes for the zeros.
_MOST_BITS = 2000
# Values whose Chebyshev series stays within float64.
_HUGE = 1e300
_MOST_DIGITS = 1_000
_NARROWEST = 1e-12


class Switch(Hashable, Protocol):
    """A(u) of a smoothed switch, in the arithmetics in which it is looked at here.

    `symasym.drift.drift.Drift` is one.
    """

    def scalars(self) -> dict[str, Fraction]:
        """The exact parameter values; an error if some are free or arrays."""

    def exact_coefficients(self) -> list[Fraction] | None:
        """Rational coefficients in ascending powers; None if A is no such polynomial."""

    def evaluate(self, u: Any, ops: Operations) -> Any:
        """A(u) in the arithmetic of `ops`."""

    def evaluate_float(self, u: FloatArray, values: dict[str, FloatArray] | None = None) -> Any:
        """A(u) in float64."""

    def spread(self, centre: FloatArray, radius: FloatArray) -> ComplexBall:
        """Complex balls that hold A on these."""

    def float_values(self) -> dict[str, FloatArray]:
        """The parameter values in float64."""

    def shape_with(self, name: str, array: FloatArray) -> tuple[int, ...]:
        """Common shape of the parameters and an argument."""


@dataclass(frozen=True)
class CriticalPoint:
    """A zero of A inside (-1, 1).

    Attributes
    ----------
    u : mpf
        Where, right to 50 digits.
    multiplicity : int
        Order of the zero.
    kind : str
        ``"well"`` (stable: V has a minimum), ``"barrier"`` (unstable) or
        ``"inflection"`` (A keeps its sign: a fold point, for multiplicity 2).
    """

    u: Any
    multiplicity: int
    kind: str

    @property
    def stable(self) -> bool:
        """True for a well."""
        return self.kind == "well"


def critical_points(drift: Switch) -> list[CriticalPoint]:
    """Zeros of A in (-1, 1), left to right; exact for polynomials, else to 50 digits.

    Raises
    ------
    AccuracyError
        If A vanishes identically, or to 50 digits at an extreme that cannot be
        distinguished from a tangency.
    """
    drift.scalars()
    return list(_known(drift))


@lru_cache(maxsize=128)
def _known(drift: Switch) -> tuple[CriticalPoint, ...]:
    """The critical points, found once for equal drifts."""
    coefficients = drift.exact_coefficients()
    if coefficients is not None:
        return tuple(_of_polynomial(coefficients))
    return tuple(_of_analytic(drift))


def _of_polynomial(coefficients: list[Fraction]) -> list[CriticalPoint]:
    """Critical points from the real roots of the irreducible factors of A."""
    import sympy

    if not any(coefficients):
        raise AccuracyError("A is 0 on all of [-1, 1], so every point is critical; change A.")
    if max(max(abs(c.numerator), c.denominator).bit_length() for c in coefficients) > _MOST_BITS:
        raise AccuracyError(
            "the coefficients of A have too many digits for its zeros to be found; rescale the "
            "problem, or round the parameters."
        )
    u = sympy.Symbol("u")
    rationals = [sympy.Rational(c.numerator, c.denominator) for c in coefficients[::-1]]
    poly = sympy.Poly(rationals, u)
    if poly.degree() < 1:
        return []
    roots = []
    for factor, multiplicity in poly.factor_list()[1]:
        for root in factor.real_roots():
            if _inside(root):
                # A changes sign by the sign of its first derivative that does not vanish.
                slope = poly
                for _ in range(multiplicity):
                    slope = slope.diff(u)
                roots.append((root, multiplicity, bool(slope.eval(root).evalf(20, maxn=4000) > 0)))
    roots.sort(key=lambda item: item[0].evalf(_DIGITS))
    return [
        CriticalPoint(_mpf(root), multiplicity, _kind(multiplicity, rising))
        for root, multiplicity, rising in roots
    ]


def _inside(root: Expr) -> bool:
    """True for a root in (-1, 1), however close to an end."""
    if root.is_Rational:
        return bool(-1 < root < 1)
    return all(bool((1 + s * root).evalf(20, maxn=20_000) > 0) for s in (-1, 1))


def _mpf(value: Expr) -> mpf:
    """A real algebraic number to 60 digits, of mpmath's global context."""
    import mpmath
    import sympy

    # SymPy's evalf leaves an exact 0 as an integer; Float does not.
    return mpmath.mp.make_mpf(sympy.Float(value.evalf(_DIGITS), _DIGITS)._mpf_)


def _kind(multiplicity: int, rising: bool) -> str:
    """Name of a zero of A from its order and the sign of the first derivative that is not 0."""
    if multiplicity % 2 == 0:
        return "inflection"
    return "barrier" if rising else "well"


def _of_analytic(drift: Switch) -> list[CriticalPoint]:
    """Critical points of an analytic A: one in each bracket between neighbouring zeros of A', and
    those zeros of A' at which A vanishes to 60 digits.
    """
    import mpmath

    from symasym.series.truncated_series import SeriesOps, TruncatedSeries

    order = 8
    with own_context(_DIGITS + 20) as context:

        def taylor(u: mpf, count: int = 3) -> list[Any]:
            """The first Taylor coefficients of A at u."""
            # A series's digits are relative to its largest coefficient, so no more than needed.
            ops = SeriesOps(count, context)
            point = ops.variable(u)
            return TruncatedSeries.coefficients_of(drift.evaluate(point, ops), ops)

        def sample() -> list[Any]:
            """A on a coarse grid."""
            return [taylor(context.mpf(k) / 8)[0] for k in range(-8, 9)]

        # What cancels in A, as tanh(k u)/tanh(k) does for small k, is computed with more digits.
        rough = sample()
        while True:
            context.dps *= 2
            fine = sample()
            scale = max(map(abs, fine))
            lost = max(abs(x - y) for x, y in zip(rough, fine, strict=True))
            if lost <= scale * context.mpf(10) ** (-_DIGITS - 5):
                break
            if context.dps > _MOST_DIGITS:
                raise AccuracyError(
                    f"A cancels more than {_MOST_DIGITS} digits on [-1, 1]; rescale its parameters."
                )
            rough = fine
        if scale == 0:
            raise AccuracyError(
                f"A is 0 on all of [-1, 1], to {context.dps} digits, so every point is critical; "
                "change A."
            )
        context.dps //= 2
        marks = float_marks(drift.evaluate_float, drift.spread)
        # Between neighbouring extremes A is monotone, so a change of sign is one simple zero.
        turning = [_newton(lambda x: taylor(x)[1:3], context.mpf(x), context) for x in marks]
        inside = sorted(x for x in turning if x is not None and -1 < x < 1)
        edges = [context.mpf(-1), *_distinct(inside, context), context.mpf(1)]
        zeros: list[CriticalPoint] = []
        values = [taylor(x)[0] for x in edges]
        small, at = scale * context.mpf(10) ** (-_DIGITS), MpmathOps(context)
        for k in range(1, len(edges)):
            low, high = values[k - 1], values[k]
            if abs(low) > small and abs(high) > small and low * high < 0:
                root = bracketed_zero(lambda x: taylor(x)[:2], edges[k - 1], edges[k], context)
                # A zero at 0 itself is found to a number of places, and none of its digits.
                if abs(root) < small / scale and drift.evaluate(context.zero, at) == 0:
                    root = context.zero
                # Beside a slope of many digits a series has none left for its value.
                allowed = max(small, abs(taylor(root)[1] * root) * 1e-17)
                if abs(drift.evaluate(root, at)) > allowed:
                    raise AccuracyError(
                        f"A is too steep near u = {float(root):.6g} for a digit of its zero there; "
                        "take a less steep A."
                    )
                zeros.append(CriticalPoint(mpmath.mp.make_mpf(root._mpf_), 1, _kind(1, high > 0)))
            if k < len(edges) - 1 and abs(high) <= small:
                series = taylor(edges[k], order)
                multiplicity = next(
                    (
                        m
                        for m in range(1, order)
                        if abs(series[m]) > scale * context.mpf(10) ** (-20)
                    ),
                    0,
                )
                if not multiplicity:
                    raise AccuracyError(
                        f"A vanishes to high order near u = {float(edges[k]):.6g}; "
                        "give A as a polynomial to resolve it."
                    )
                zeros.append(
                    CriticalPoint(
                        mpmath.mp.make_mpf(edges[k]._mpf_),
                        multiplicity,
                        _kind(multiplicity, series[multiplicity] > 0),
                    )
                )
        return zeros


def _distinct(points: list[Any], context: MPContext) -> list[Any]:
    """Sorted points, of those within 1e-14 of each other the first."""
    kept: list[Any] = []
    for x in points:
        # A zero of high order is found by Newton to a fraction of the digits only.
        if not kept or x - kept[-1] > context.mpf(10) ** -14:
            kept.append(x)
    return kept


def _newton(pair: Callable[[Any], list[Any]], x: mpf, context: MPContext) -> Any | None:
    """A zero of f near x, where pair gives [f, f'/1] (Taylor coefficients, f'' doubled)."""
    for _ in range(60):
        # Coefficients c1, c2 of A: A' = c1, A'' = 2 c2.
        value, half_slope = pair(x)
        if half_slope == 0:
            return x if value == 0 else None
        step = value / (2 * half_slope)
        if abs(step) > 0.5:
            return None
        x -= step
        if abs(step) < context.mpf(10) ** (-_DIGITS - 5):
            break
    return x


def float_marks(
    function: Callable[[FloatArray], Any], spread: Callable[[FloatArray, FloatArray], ComplexBall]
) -> list[float]:
    """Zeros and extremes of a smooth function on [-1, 1], in float64, by Chebyshev proxies.

    Parameters
    ----------
    function : callable
        Takes and returns a float64 array.
    spread : callable
        The images of complex balls, given their centres and radii.
    """
    marks: list[float] = []
    for lo, hi, series in _proxies(function, spread):
        for poly in (series, np.polynomial.chebyshev.chebder(series)):
            if len(poly) < 2:
                continue
            roots = np.polynomial.chebyshev.chebroots(poly)
            good = roots[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1 + 1e-9)].real
            marks += list((lo + hi) / 2 + (hi - lo) / 2 * good)
    return sorted(float(np.clip(x, -1, 1)) for x in marks)


def _proxies(
    function: Callable[[FloatArray], Any], spread: Callable[[FloatArray, FloatArray], ComplexBall]
) -> list[tuple[float, float, FloatArray]]:
    """Pieces of [-1, 1] with Chebyshev coefficients that have died out, down to rounding."""
    degree = 32
    nodes = np.cos(np.pi * np.arange(degree + 1) / degree)
    pending = [(-1.0, 1.0)]
    done: list[tuple[float, float, Any]] = []
    while pending:
        step()
        lo, hi = pending.pop()
        with np.errstate(all="ignore"):
            x = (lo + hi) / 2 + (hi - lo) / 2 * nodes
            values = np.broadcast_to(np.asarray(function(x), dtype=np.float64), x.shape)
        if not (np.abs(values) < _HUGE).all():
            raise AccuracyError(
                f"A is not finite, or above {_HUGE:g}, between u = {lo:.6g} and {hi:.6g}; give an "
                "A that is real and smooth on [-1, 1], or A/c and kappa/sqrt(c), T being c times "
                "as long."
            )
        series = np.polynomial.chebyshev.chebfit(nodes, values, degree)
        change = spread(np.array([(lo + hi) / 2]), np.array([hi - lo])).radius[0]
        # Rounding of x is multiplied by the slope, which is at most change/radius.
        size = np.abs(series).max()
        noise = 1e-14 * size + 4e-16 * change / (hi - lo)
        settled = np.abs(series[-3:]).max() <= 1e-12 * size + noise
        if (settled and resolved(change, np.abs(values).max())) or hi - lo < _NARROWEST:
            done.append((lo, hi, np.polynomial.chebyshev.chebtrim(series, min(noise, size))))
        else:
            pending += [(lo, (lo + hi) / 2), ((lo + hi) / 2, hi)]
    return done


def _minus_integral(
    drift: Switch, inside: FloatArray, values: dict[str, Any], panels: int
) -> FloatArray:
    """-int A from -1 to `inside` on so many Gauss-Legendre panels."""
    x, w = np.polynomial.legendre.leggauss(12)
    total: FloatArray = np.zeros(inside.shape)
    half = (inside + 1) / panels / 2
    for k in range(panels):
        for node, weight in zip(x, w, strict=True):
            u = -1 + half * (2 * k + 1 + node)
            total = total - weight * half * drift.evaluate_float(u, values)
    return total


def potential_at(drift: Switch, u: FloatArray) -> float | FloatArray:
    """V in float64 with V(-1) = 0, by Gauss-Legendre on panels short enough for any A."""
    values = drift.float_values()
    shape = drift.shape_with("u", u)
    position = np.broadcast_to(u, shape)
    inside = np.clip(position, -1.0, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        total, panels = _minus_integral(drift, inside, values, 32), 32
        a_minus, a_plus = (drift.evaluate_float(np.asarray(x), values) for x in (-1.0, 1.0))
        outside = potential_right(np.maximum(position, 1.0), a_plus, total)
        outside = outside + potential_left(np.minimum(position, -1.0), a_minus)
    if not np.isfinite(outside).all():
        raise RangeError(
            f"V of {drift!r} or its numbers leave the range of float64 (1e-308 to 1e308); rescale "
            "the drift, or give u nearer to 0."
        )
    while panels < 8192:
        step()
        panels *= 4
        finer = _minus_integral(drift, inside, values, panels)
        settled = np.abs(finer - total).max() <= 1e-13 * (np.abs(finer).max() + 1e-300)
        total = finer
        if settled:
            break
    total = total + potential_left(np.minimum(position, -1.0), a_minus)
    total = potential_right(np.maximum(position, 1.0), a_plus, total)
    return float(total) if total.ndim == 0 else total


def drag_time(
    points: list[CriticalPoint],
    phi: Callable[[FloatArray], FloatArray],
    rate: Callable[[FloatArray], FloatArray],
) -> float:
    """Time in which a drift that changes at `rate` changes one of its wells by its depth.

    The depth of phi between a well and its barrier over the rate there: to first order, the time
    after which the well is lost, or is twice as deep. Infinite without a well that a barrier ends.
    """
    times = []
    for one, other in zip(points[:-1], points[1:], strict=True):
        low, high = float(one.u), float(other.u)
        # The depth is stationary at its place: three grids in turn have it to rounding.
        for _ in range(3):
            u = np.linspace(low, high, 2001)
            depth = phi(u)
            k = int(np.argmax(np.abs(depth)))
            low, high = u[max(k - 1, 0)], u[min(k + 1, u.size - 1)]
        change = float(rate(u[k : k + 1])[0])
        if {one.kind, other.kind} == {"well", "barrier"} and change != 0.0:
            times.append(float(abs(depth[k] / change)))
    return min(times, default=float("inf"))
