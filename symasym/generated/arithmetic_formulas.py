"""Formulas over an arithmetic `c`: arrays of float64, or mpf of its context.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symasym.numbers.arithmetic import Arithmetic, Number


def even_share(c: Arithmetic, alpha: Number, root: Number, y: Number, gap: Number) -> Any:
    """Primitive of alpha/(y^2 - root^2), y > 0; `gap` is y - root (pair-primitives)."""
    return -alpha*c.log1p(4*y*root/gap**2)/(4*root)


def even_share_on_line(c: Arithmetic, alpha: Number, root: Number, y: Number) -> Any:
    """Primitive of alpha/(y^2 + root^2) along the real line (pair-primitives)."""
    return -alpha*c.atan2(root, y)/root


def odd_share(c: Arithmetic, beta: Number, product: Number) -> Any:
    """Primitive of beta y/(y^2 - square); `product` is |y^2 - square| (pair-primitives)."""
    return beta*c.log(product)/2


def share_of_line(c: Arithmetic, root: Number) -> Any:
    """The integral of 1/(y^2 + root^2) over the line (pair-primitives)."""
    return c.pi/root


def first_moment(c: Arithmetic) -> Any:
    """int e^(-s^2/2) ds (saddle-recurrences)."""
    return c.sqrt(2*c.pi)


def pair_norm(c: Arithmetic, even: Number, odd: Number, square: Number) -> Any:
    """The product of psi at both zeros of a pair (airy-form)."""
    return even**2 - square*odd**2


def canonical(c: Arithmetic, slope: Number, even: Number, odd: Number, norm: Number) -> Any:
    """a and b of u' = a + b s at a pair of zeros, odd counted along s (airy-form)."""
    x0 = even + c.sqrt(norm)
    x1 = 2/norm
    return c.sqrt(x0*x1/slope)/2, -odd*c.sqrt(x1*slope/x0)/2


def pair_share(c: Arithmetic, side: Number, even: Number, odd: Number, norm: Number) -> Any:
    """alpha and beta: the pair's share of 1/phi is (alpha + beta y)/(y^2 - square) (airy-form)."""
    x0 = side/norm
    return x0*even, -x0*odd


def over_pair(
    c: Arithmetic, a: Number, small: Number, b: Number, bi: Number, bi_slope: Number
) -> Any:
    """int e^(lam V) and int e^(-lam V) over a pair; `small` is lam^(-1/3) (airy-form)."""
    x0 = a*bi
    x1 = b*bi_slope*small
    x2 = c.pi*small
    return x2*(x0 + x1), x2*(x0 - x1)


def over_pair_twice(
    c: Arithmetic, a: Number, small: Number, b: Number, squares: Number, slopes: Number
) -> Any:
    """The double integral over a pair, from Ai^2 + Bi^2 and Ai'^2 + Bi'^2 (airy-form)."""
    x0 = small**2
    return x0*c.pi**2*(squares*a**2 - x0*slopes*b**2)


def pair_units(c: Arithmetic, small: Number, squares: Number, cross: Number, slopes: Number) -> Any:
    """Ai^2 + Bi^2 and its kin in the double integral; `small` is lam^(-1/3) (airy-form)."""
    x0 = c.pi**2
    return x0*squares*small**2, x0*cross*small**3, x0*slopes*small**4


def end_distance(c: Arithmetic, gap: Number, area: Number) -> Any:
    """t at the end of a barrier's Gaussian: t^2/2 = gap^2 area (truncated-gaussian)."""
    return gap*c.sqrt(2*area)


def end_peak(c: Arithmetic, bottom: Number) -> Any:
    """du/dt at the barrier (truncated-gaussian)."""
    return 1/c.sqrt(bottom)


def end_mean(c: Arithmetic, bottom: Number, area: Number) -> Any:
    """The mean of psi before the end: peak/t = 1/(gap mean) (truncated-gaussian)."""
    return c.sqrt(2*area*bottom)


def end_rest(
    c: Arithmetic,
    bottom: Number,
    gap: Number,
    first: Number,
    second: Number,
    value: Number,
    mean: Number,
) -> Any:
    """1/phi at the end less peak/t, without its cancellation (truncated-gaussian)."""
    return (first*bottom - gap*second**2 - 2*second*bottom)/(mean*value*(mean + value))


def over_end(
    c: Arithmetic,
    lam: Number,
    t: Number,
    peak: Number,
    rest: Number,
    tail: Number,
    falling: Number,
    integral: Number,
) -> Any:
    """int e^(lam V) from the end on, int e^(-lam V) up to it, and both (truncated-gaussian)."""
    x0 = 1/lam
    x1 = x0*rest
    x2 = falling*peak
    return -x1 - peak*tail, x1 + x2, -x1*x2 + x0*peak**2*(integral - c.log(t))
