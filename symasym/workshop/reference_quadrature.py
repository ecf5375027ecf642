"""T, C, P and p_ss by plain quadrature of the printed integrals, as independent references.

Composite quadrature of eq:Ttilde, eq:C, eq:P and eq:pss at Chebyshev points in mpmath. The drift is
only evaluated, as SymPy prints it. V and the inner integrals are running integrals of the
polynomial through a panel's points; the tails of e^{-lam V} beyond the layer are elementary. Two
resolutions must agree. Only the drift's expression is shared with the engines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy
from mpmath import mp, mpf

from symasym.base.errors import AccuracyError

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

_LEVELS, _MOST = 5, 300_000_000  # multiplications, which take minutes


def escape_time(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Mean time to leave (-r, r) from `start`, by eq:Ttilde, right to `dps` digits."""

    def T(swept: _Swept) -> list[Any]:
        left, right = (swept.lam * x / sum(swept.up) for x in swept.up)
        return [left * swept.nested[1], -right * swept.nested[0]]

    return _agreed(T, drift, kappa, [-r, start, r], dps)


def exit_probability(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Probability of leaving (-r, r) through -r, by eq:C."""
    return _agreed(lambda s: [s.up[1] / sum(s.up)], drift, kappa, [-r, start, r], dps)


def occupation(drift: Drift, kappa: Fraction, dps: int, complement: bool = False) -> Any:
    """Stationary probability of -1 <= u <= 1, by eq:P; with `complement` that of the tails."""

    def P(swept: _Swept) -> list[Any]:
        (inside,) = swept.down
        return [(swept.tails if complement else inside) / (inside + swept.tails)]

    return _agreed(P, drift, kappa, [-1, 1], dps)


def stationary_density(drift: Drift, kappa: Fraction, y: Fraction, dps: int) -> Any:
    """Stationary probability density at `y`, by eq:pss with K such that its integral is 1."""

    def density(swept: _Swept) -> list[Any]:
        return [mp.exp(-swept.exponents[1]) / (sum(swept.down) + swept.tails)]

    return _agreed(density, drift, kappa, [min(y, Fraction(-1)), y, max(y, Fraction(1))], dps)


class _Swept(NamedTuple):
    """Integrals between marks, with V = 0 at the first of them."""

    lam: Any
    exponents: list[Any]  # lam V at each mark
    up: list[Any]  # integrals of e^{lam V} between two marks
    down: list[Any]  # integrals of e^{-lam V}
    nested: list[Any]  # integrals of e^{lam (V(v) - V(u))}, u from the first mark to v
    tails: Any  # integrals of e^{-lam V} before the first mark and behind the last, if finite


def _agreed(
    of: Callable[[_Swept], list[Any]],
    drift: Drift,
    kappa: Fraction,
    marks: Sequence[Fraction | int],
    dps: int,
) -> Any:
    """The sum of terms on which two successive resolutions agree."""
    lost, previous = 0, mp.inf
    for level in range(_LEVELS):
        # Rounding differs between levels; digits lost to cancellation are added at the next.
        work = dps + 12 + 8 * level + lost
        with mp.workdps(work):
            terms = of(_swept(drift, kappa, marks, level))
            value, size = mp.fsum(terms), mp.fsum(terms, absolute=True)
            lost = int(mp.log10(size / value)) if value > 0 else work
            if abs(value - previous) <= value * mpf(10) ** -dps:
                return value
            previous = value
    raise AccuracyError(
        f"no two of {_LEVELS} grids agree to {dps} digits; ask for fewer, or for stronger noise."
    )


def _swept(drift: Drift, kappa: Fraction, marks: Sequence[Fraction | int], level: int) -> _Swept:
    """The integrals, on panels over which lam V varies by about 4, halved at each level."""
    A = sympy.lambdify(sympy.Symbol("u", real=True), drift.expression(), "mpmath")
    lam, one = 2 / mp.convert(kappa) ** 2, mpf(1)

    def rate(u: Any) -> Any:
        """-lam V', by eq:phi."""
        return lam * A(min(max(u, -one), one))

    # e^{2t} on [-1, 1] is integrated to n digits by about n/2 + 10 points, while n < 200.
    points, rows = _rule(mp.dps, int(mp.dps * 0.55) + 14)
    places = [mp.convert(x) for x in marks]
    exponent = before = mpf(0)
    exponents, sums = [exponent], []
    for start, stop in pairwise(places):
        up = down = nested = mpf(0)
        for a, b in pairwise(sorted({start, stop, *(x for x in (-one, one) if start < x < stop)})):
            steep = (b - a) * max(abs(rate(a + (b - a) * k / 6)) for k in range(7))
            inside = 4 * (b - a) if -1 <= a < b <= 1 else 0
            count = 2**level * int(1 + inside + steep / 4)
            if count * len(points) ** 2 > _MOST:
                raise AccuracyError(
                    "plain quadrature would take minutes here; take stronger noise, a smaller r "
                    "or fewer digits."
                )
            half = (b - a) / (2 * count)
            for k in range(count):
                rates = [rate(a + half * (2 * k + 1 + t)) for t in points]
                *inner, exponent = (exponent - half * mp.fdot(row, rates) for row in rows)
                e = [mp.exp(x) for x in inner]
                inverse = [1 / x for x in e]
                *inner, whole = (before + half * mp.fdot(row, inverse) for row in rows)
                up += half * mp.fdot(rows[-1], e)
                down += half * mp.fdot(rows[-1], inverse)
                nested += half * mp.fdot(rows[-1], [x * y for x, y in zip(e, inner, strict=True)])
                before = whole
        exponents.append(exponent)
        sums.append((up, down, nested))
    low, high = rate(places[0]), rate(places[-1])
    tails = 1 / low - mp.exp(-exponent) / high if low > 0 > high else mp.inf
    ups, downs, nests = map(list, zip(*sums, strict=True))
    return _Swept(lam, exponents, ups, downs, nests, tails)


@cache
def _rule(dps: int, count: int) -> tuple[list[Any], list[list[Any]]]:
    """Chebyshev points, and the rows that integrate the polynomial through them from -1 on.

    A row for each point and one for 1. With u = cos t the polynomial's coefficients are
    c_k = (2/n) sum_j f_j cos(k t_j), halved for k = 0, and the integral of cos(k t) over u is
    (cos((k+1)t)/(k+1) - cos((k-1)t)/(k-1))/2.
    """
    angles = [mp.pi * (j + mpf(1) / 2) / count for j in reversed(range(count))]

    def integrals(t: Any) -> list[Any]:
        """Of each cos(k t), up to a constant."""
        c = [mp.cos(k * t) for k in range(count + 1)]
        return [c[1] / 2, c[2] / 4] + [
            (c[k + 1] / (k + 1) - c[k - 1] / (k - 1)) / 2 for k in range(2, count)
        ]

    first = integrals(mp.pi)
    cosines = [[2 * mp.cos(k * t) / count for k in range(count)] for t in angles]
    rows = []
    for t in (*angles, mpf(0)):
        parts = [x - y for x, y in zip(integrals(t), first, strict=True)]
        rows.append([mp.fdot(parts, row) for row in cosines])
    return [mp.cos(t) for t in angles], rows
