"""Two neighbouring zeros of an analytic function, split off as a factor.

phi = (y² - D) psi(y), y from half-way between the zeros, D of either sign: the Weierstrass
polynomial of degree two. Its middle and D solve the two equations that the even and the odd part of
phi vanish at y² = D, by Newton's method as Bairstow's for polynomials. Both are analytic in phi's
coefficients where the zeros themselves are not. Both critical values of the integral of phi are
then explicit sums in D, without a difference of nearly equal numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of
from symasym.base.errors import AccuracyError, InputError
from symasym.numbers.arithmetic import Number
from symasym.numbers.polynomials import poly, poly_slope, shifted

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

__all__ = [
    "Pair", "mean_of_psi", "mean_of_values", "mirrored", "not_alone", "numbers", "pairs_of",
    "poly", "shifted", "split_pair", "tiny",
]  # fmt: skip

_STEPS = 40


@dataclass(frozen=True)
class Pair:
    """phi(point + middle + y) = (y² - square) (psi[0] + psi[1] y + ...), and its zeta.

    Attributes
    ----------
    middle : mpf or ndarray
        Half-way between the zeros, from the point of expansion.
    square : mpf or ndarray
        Half their distance, squared: negative for a complex pair.
    psi : list
        Taylor coefficients of what is left of phi, made positive at the pair.
    sign : int or ndarray
        What psi was multiplied by: the sign of phi's curvature.
    zeta : mpf or ndarray
    slope : mpf or ndarray
        y/s at both zeros: sqrt(square/zeta), and its limit.
    level : mpf or ndarray
        Mean over the two zeros of the integral of phi from the point of expansion.
    """

    middle: Any
    square: Any
    psi: list[Any]
    sign: Any
    zeta: Any
    slope: Any
    level: Any


def split_pair(
    taylor: Sequence[Any],
    context: MPContext,
    within: Number | None = None,
    square: Number | None = None,
) -> Pair:
    """The pair as a factor of phi, at the context's precision; parameters as in `cubic_map`.

    A search that comes further than `within` from the point of expansion is given up; it begins at
    the parabola, or where half the zeros' distance, squared, is `square`.
    """
    c = numbers("taylor", taylor, context)
    if len(c) < 3:
        raise InputError(f"taylor has {len(c)} coefficients; give at least three of phi.")
    if not c[2]:
        raise InputError(
            "taylor[2] is 0, so phi has no pair of zeros that meet there; expand it elsewhere."
        )
    pair, good = _split(c, context, within, square)
    if not good:
        raise not_alone()
    return pair


def numbers(name: str, values: Sequence[Any], context: MPContext) -> list[Any]:
    """The values as numbers of the context."""
    from symasym.base.inputs import exact

    converted = []
    for value in values:
        if hasattr(value, "_mpf_"):
            converted.append(context.make_mpf(value._mpf_))
        else:
            rational = exact(f"a coefficient of {name}", value)
            converted.append(mpf_of(rational, context))
    return converted


def pairs_of(taylor: Sequence[Any]) -> tuple[Pair, Any]:
    """As `split_pair` for arrays of floats, and which have a pair apart from other zeros."""
    with np.errstate(all="ignore"):
        return _split(list(taylor), None)


def mirrored(c: list[Any], side: int) -> list[Any]:
    """Taylor coefficients of phi(u), or of -phi(-u) for side = -1."""
    return [x * side if j % 2 == 0 else x for j, x in enumerate(c)] if side < 0 else list(c)


def _split(
    c: list[Any],
    context: MPContext | None,
    within: Number | None = None,
    square: Number | None = None,
) -> tuple[Pair, Any]:
    """The pair by Newton's method from the parabola, and where that succeeded."""
    good: Any = c[2] != 0
    sign: Any = np.where(c[2] > 0, 1.0, -1.0) if context is None else (1 if c[2] > 0 else -1)
    c = [sign * x for x in c]
    middle, least = 0 * c[2], tiny(context)
    square = -c[0] / c[2] if square is None else middle + square
    here, done = c, False
    for _ in range(_STEPS):
        even, odd = here[0::2], here[1::2]
        value, value_odd = poly(even, square), poly(odd, square)
        by_square, by_square_odd = poly_slope(even, square), poly_slope(odd, square)
        by_middle = poly([(2 * k + 1) * x for k, x in enumerate(odd)], square)
        by_middle_odd = poly([2 * k * x for k, x in enumerate(even)][1:], square)
        det = by_middle * by_square_odd - by_square * by_middle_odd
        good = good & (det != 0)
        if context is not None and not good:
            break
        step = (by_square_odd * value - by_square * value_odd) / det
        # The new middle's own share of the distance is in the other equation.
        step_square = (by_middle * value_odd - by_middle_odd * value) / det
        middle, square = middle - step, square - step_square
        if within is not None and abs(middle) > within:
            break
        here = shifted(c, middle) if context is None else _shifted_in(context, c, middle)
        # Off the zero of the slope, the distance is known as well as (c_1/c_2)² is.
        known = abs(square) + (c[1] / c[2]) ** 2
        done = (abs(step_square) <= least * known) & (step**2 <= least * least * known)
        # What has run away is no number any more.
        if np.all(done | ~(good & (abs(square) < np.inf)) if context is None else done):
            break
    good = good & done
    # Divided by y² - D from the highest power down: D is small beside the circle's radius.
    psi = list(here[2:])
    for j in range(len(psi) - 3, -1, -1):
        psi[j] = psi[j] + square * psi[j + 2]
    mean = mean_of_psi(psi, square)
    values = poly(psi[0::2], square), poly(psi[1::2], square)
    alone = (mean > 0) & (values[0] > 0) & (values[0] ** 2 > values[1] ** 2 * square)
    inside = (square <= 0) | (middle**2 <= square * 1.0001) | (abs(c[1]) > 0)
    good = good & alone & inside
    if context is not None and not good:
        return Pair(middle, square, psi, sign, square, square, square), False
    root = np.cbrt(mean) if context is None else context.cbrt(mean)
    to_middle = middle * poly([x / (k + 1) for k, x in enumerate(c)], middle)
    level = sign * (to_middle + mean_of_values(psi, square))
    return Pair(middle, square, psi, sign, square * root**2, 1 / root, level), good


def mean_of_psi(psi: list[Any], square: Number) -> Any:
    """Mean of psi over the pair, weighted by square - y²: (zeta/square)^(3/2)."""
    even = [3 * x / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(psi[0::2])]
    return poly(even, square)


def mean_of_values(psi: list[Any], square: Number) -> Any:
    """Mean over y = ± h of the integral of (y² - h²) psi from 0, h² = square."""
    odd = [-2 * x / ((2 * k + 2) * (2 * k + 4)) for k, x in enumerate(psi[1::2])]
    return square**2 * poly(odd, square)


def not_alone() -> AccuracyError:
    """The refusal of zeros with others near."""
    return AccuracyError(
        "phi has no pair of zeros apart from all others at the point of expansion; expand it "
        "between two neighbouring zeros that are nearer to each other than to a third."
    )


def tiny(context: MPContext | None) -> Any:
    """The largest step that ends the search, relative: with digits, the next has all of them."""
    return 1e-14 if context is None else context.ldexp(1, -context.prec // 2 - 8)


def _shifted_in(context: MPContext, c: list[Any], by: Number) -> list[Any]:
    """Coefficients about `by`, as convolutions, which mpmath rounds once: a quarter of the time."""
    powers, factorials = [context.one], [context.one]
    for k in range(1, len(c)):
        powers.append(powers[-1] * by / k)
        factorials.append(factorials[-1] * k)
    scaled = [x * f for x, f in zip(c, factorials, strict=True)]
    return [context.fdot(scaled[j:], powers[: len(c) - j]) / factorials[j] for j in range(len(c))]
