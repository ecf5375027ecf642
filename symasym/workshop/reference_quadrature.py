"""T, C, P and p_ss by plain quadrature of the printed integrals: the independent truth.

Composite Gauss-Legendre quadrature of eq:Ttilde, eq:C, eq:P and eq:pss in mpmath. The drift is
only ever evaluated, by SymPy's printer; V and the inner integrals are running integrals of the
polynomial through the nodes of a panel. Two resolutions must agree. Nothing here is shared with
the engines but the drift's expression.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.base.balls import precision, to_mpf
from symasym.base.errors import AccuracyError, RegionError

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

__all__ = ["escape_time", "exit_probability", "in_mpmath", "occupation", "stationary_density"]

_LEVELS, _MOST = 5, 300_000_000  # multiplications: minutes


def escape_time(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Mean time to leave (-r, r) from `start`, by eq:Ttilde, as an mpf.

    Raises
    ------
    AccuracyError
        If no two resolutions agree to `dps` digits, or minutes of work would be needed.
    """

    def T(grid: _Grid) -> tuple[Any, Any]:
        # Left and right of the start: the integral of e^{lam V} over v, and the double integral.
        single, double = [grid.mp.zero] * 2, [grid.mp.zero] * 2
        for panel in grid.panels(nested=True):
            side = int(panel.left >= start)
            single[side] += panel.int_e
            double[side] += panel.nested
        not_C, C = (x / sum(single) for x in single)
        parts = grid.lam * not_C * double[1], grid.lam * C * double[0]
        return parts[0] - parts[1], parts[0] + parts[1]

    return _agreed(T, drift, kappa, lambda work: [-r, start, r], dps)


def exit_probability(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Probability of leaving (-r, r) through -r, by eq:C; as `escape_time`."""

    def C(grid: _Grid) -> tuple[Any, Any]:
        panels = list(grid.panels())
        value = sum(p.int_e for p in panels if p.left >= start) / sum(p.int_e for p in panels)
        return value, value

    return _agreed(C, drift, kappa, lambda work: [-r, start, r], dps)


def occupation(drift: Drift, kappa: Fraction, dps: int, complement: bool = False) -> Any:
    """Stationary probability of -1 <= u <= 1, by eq:P; with `complement` that of the tails."""

    def P(grid: _Grid) -> tuple[Any, Any]:
        panels = list(grid.panels())
        part = sum(p.int_inverse for p in panels if (-1 <= p.left < 1) is not complement)
        value = part / sum(p.int_inverse for p in panels)
        return value, value

    return _agreed(P, drift, kappa, lambda work: _tails(drift, kappa, work), dps)


def stationary_density(drift: Drift, kappa: Fraction, y: Fraction, dps: int) -> Any:
    """Stationary probability density at `y`, by eq:pss with K such that its integral is 1."""

    def marks(work: int) -> list[Fraction]:
        low, high = _tails(drift, kappa, work)
        return [min(low, y - 1), y, max(high, y + 1)]

    def density(grid: _Grid) -> tuple[Any, Any]:
        panels = list(grid.panels())
        (at_y,) = (grid.mp.exp(-p.exponent) for p in panels if p.left == y)
        value = at_y / sum(p.int_inverse for p in panels)
        return value, value

    return _agreed(density, drift, kappa, marks, dps)


def _agreed(
    of: Callable[[_Grid], tuple[Any, Any]],
    drift: Drift,
    kappa: Fraction,
    marks: Callable[[int], list[Fraction]],
    dps: int,
) -> Any:
    """The value on which two successive resolutions agree; `of` gives it with its terms' size."""
    extra, previous = 4, None
    for level in range(_LEVELS):
        extra += 8  # no two levels round alike
        while True:
            value, size = of(_Grid(drift, kappa, marks(dps + extra), dps + extra, level))
            lost = int(value.context.log10(size / value)) if value > 0 else dps + extra
            if lost <= extra - 8:
                break
            # Where all digits were lost, the count is only a lower bound.
            extra = lost + max(16, lost // 4)
        if previous is not None and abs(value - previous) <= value / value.context.mpf(10) ** dps:
            import mpmath

            return mpmath.mp.make_mpf(mpmath.libmp.mpf_pos(value._mpf_, int(3.33 * dps) + 4, "n"))
        previous = value
    raise AccuracyError(
        f"no two of {_LEVELS} grids agree to {dps} digits; ask for fewer, or for stronger noise."
    )


@cache
def _context(dps: int) -> Any:
    """An mpmath context of so many digits."""
    import mpmath

    mp = mpmath.MPContext()
    mp.dps = dps
    return mp


def in_mpmath(drift: Drift, context: Any) -> Any:
    """A(u) as a function in an mpmath context, by SymPy's printer."""
    import sympy
    from sympy.printing.pycode import MpmathPrinter

    names = "mpf pi e exp log sqrt erf sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh"
    known = {name: getattr(context, name) for name in names.split()}
    printer = MpmathPrinter({"fully_qualified_modules": False})
    u = sympy.Symbol("u", real=True)
    return sympy.lambdify(u, drift.expression(), [known], printer=printer)


def _tails(drift: Drift, kappa: Fraction, work: int) -> list[Fraction]:
    """Points beyond which the tails of e^{-lam V} hold less than 10^-work of themselves."""
    mp = _context(work)
    low, high = map(in_mpmath(drift, mp), (mp.mpf(-1), mp.mpf(1)))
    if not low > 0 > high:
        raise RegionError(
            f"a- is {float(low):.6g} and a+ is {float(high):.6g}, so that no stationary state "
            "exists; choose a drift with a- > 0 > a+."
        )
    # lam |a| length = log 10^(work + 1), a little rounded up
    decades = kappa**2 / 2 * Fraction(24, 10) * (work + 1)
    return [-1 - decades / Fraction(float(low)), 1 + decades / Fraction(-float(high))]


class _Panel(NamedTuple):
    """Integrals over one panel; V is counted from the left end of the grid."""

    left: Fraction
    exponent: Any  # lam V at the panel's left end
    int_e: Any  # of e^{lam V}
    int_inverse: Any  # of e^{-lam V}
    nested: Any  # of e^{lam (V(v) - V(u))}, v in the panel and u from the grid's left end to v


class _Grid:
    """Panels over an interval, with the Gauss rule used on each."""

    def __init__(
        self, drift: Drift, kappa: Fraction, marks: list[Fraction], work: int, level: int
    ) -> None:
        self.mp = _context(work)
        A: Any = in_mpmath(drift, self.mp)
        low, high = self.mp.mpf(-1), self.mp.mpf(1)

        def phi(u: Any) -> Any:
            """eq:phi."""
            return self.mp.mpf(A(min(max(u, low), high)))

        self.phi = phi
        self.lam = 2 / self._mpf(kappa) ** 2
        growth, widest = self.mp.mpf(4) / 2**level, Fraction(1, 4 * 2**level)
        # e^{2t} on [-1, 1] is integrated to n digits by about n/2 + 10 nodes, while n < 200.
        nodes = int(work * 0.55) + 14 + 6 * level
        kinks = [Fraction(x) for x in (-1, 1) if min(marks) < x < max(marks)]
        waiting = [*pairwise(sorted({*marks, *kinks}))][::-1]
        self.edges: list[Fraction] = []
        while waiting:
            a, b = waiting.pop()
            outside = a >= 1 or b <= -1
            points = [self._mpf(a + (b - a) * Fraction(k, 6)) for k in range(7)]
            rises = [self.lam * abs(self.phi(u)) * self._mpf(b - a) for u in points]
            steep, needed = max(rises), int(sum(rises) / 7 / growth)
            if (needed + len(self.edges) + len(waiting)) * nodes**2 > _MOST:
                raise AccuracyError(
                    "plain quadrature would take minutes here; take stronger noise, a smaller r "
                    "or fewer digits."
                )
            if steep <= growth and (outside or b - a <= widest):
                self.edges.append(a)
            else:
                parts = int(steep / growth) + 1 if outside else 2
                cuts = [a + (b - a) * Fraction(k, parts) for k in range(parts + 1)]
                waiting += [*pairwise(cuts)][::-1]
        self.edges.append(max(marks))
        self.nodes, self.weights, self.rows = _rule(work, nodes)

    def _mpf(self, x: Fraction) -> Any:
        return self.mp.mpf(x.numerator) / x.denominator

    def panels(self, nested: bool = False) -> Iterator[_Panel]:
        """The panels from left to right; without `nested` the double integrals are left out."""
        mp = self.mp
        exponent = before = mp.zero
        for a, b in pairwise(self.edges):
            half, center = (self._mpf(x / 2) for x in (b - a, b + a))

            def whole(values: list[Any], half: Any = half) -> Any:
                return half * mp.fdot(self.weights, values)

            def running(values: list[Any], half: Any = half) -> list[Any]:
                """From the panel's left end to each of its nodes."""
                return [half * mp.fdot(row, values) for row in self.rows]

            slopes = [-self.lam * self.phi(center + half * t) for t in self.nodes]
            e = [mp.exp(exponent + x) for x in running(slopes)]
            inverse = [1 / x for x in e]
            double = mp.zero
            if nested:
                up_to_v = [before + x for x in running(inverse)]
                double = whole([x * y for x, y in zip(e, up_to_v, strict=True)])
            yield _Panel(a, exponent, whole(e), whole(inverse), double)
            before += whole(inverse)
            exponent += whole(slopes)


@cache
def _rule(dps: int, count: int) -> tuple[list[Any], list[Any], list[list[Any]]]:
    """Gauss nodes and weights, and rows that give running integrals of the interpolant.

    Its Legendre coefficients are c_k = (k + 1/2) sum_j w_j P_k(x_j) f_j, which the rule makes
    exact, and the integral of P_k from -1 is (P_{k+1} - P_{k-1})/(2k + 1).
    """
    from flint import arb, arb_mat

    mp = _context(dps)
    with precision(mp.prec + 60):
        pairs = [arb.legendre_p_root(count, k, weight=True) for k in reversed(range(count))]
        P = [[x.legendre_p(k) for k in range(count + 1)] for x, _ in pairs]
        halves = [
            [(p[1] + 1) / 2, *((p[k + 1] - p[k - 1]) / 2 for k in range(1, count))] for p in P
        ]
        weighed = [[w * p[k] for (_, w), p in zip(pairs, P, strict=True)] for k in range(count)]
        rows = (arb_mat(halves) * arb_mat(weighed)).tolist()
        numbers = [[x for x, _ in pairs], [w for _, w in pairs], *rows]
        nodes, weights, *matrix = (
            [mp.make_mpf(to_mpf(x, dps + 5)[0]._mpf_) for x in row] for row in numbers
        )
        return nodes, weights, matrix
