"""The paper's integrals by plain quadrature, as printed: a check on the other engines.

Nothing here is clever, and nothing is shared with the rest of `symasym.exact`.
The drift is only ever evaluated; the potential is its numerical integral, outside
[-1, 1] as inside; every integral is a sum of Gauss-Legendre rules over panels;
eq:Ttilde is added up in its printed form, H(v) - C and all.

How the accuracy is come by:

- The interval is cut at -1, 1 and the start, where the integrands have kinks or
  jumps, and then into panels on which lam V changes by at most a few units.
- An integral up to v is the sum over the whole panels before v plus the integral of
  the interpolating polynomial through the Gauss nodes of v's own panel.
- H(v) - C cancels. The digits that are lost are counted, and everything is done again
  with as many more.
- In the sliding region the tails run to infinity; they are cut where e^{-lam V} has
  fallen below the working precision.
- Everything is done twice, on panels half as long with more nodes. If the two
  results differ, a third time, and so on; never is a result returned that was not reached
  twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.base.call_context import to_mpf
from symasym.base.errors import AccuracyError, RegionError

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

    from symasym.drift.drift import Drift


__all__ = [
    "double_integral", "escape_time", "exit_probability", "integral", "occupation",
    "stationary_density",
]  # fmt: skip

_REFINEMENTS = 4
_MOST_MULTIPLICATIONS = 300_000_000


def escape_time(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Mean time to leave (-r, r) from `start`, by eq:Ttilde.

    Parameters
    ----------
    drift : symasym.Drift
        With scalar parameters, all bound.
    kappa, r, start : Fraction
        Scaled noise amplitude, escape radius and starting point.
    dps : int
        Decimal digits on which two resolutions must agree.

    Returns
    -------
    mpf
        Of mpmath's global context, whose precision is neither used nor changed.

    Raises
    ------
    AccuracyError
        If the resolutions never agree, or more than minutes of work would be needed.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """T on one grid, and the digits lost by cancellation."""
        grid = _Grid(drift, kappa, [-r, start, r], work, level)
        # Left and right of the start: the integral of e^{lam V} over v, and the double integral.
        single, double = [grid.mp.zero] * 2, [grid.mp.zero] * 2
        for panel in grid.panels(nested=True):
            side = int(panel.left >= start)
            single[side] += panel.int_e
            double[side] += panel.nested
        not_C, C = (x / sum(single) for x in single)
        time = grid.lam * (not_C * double[1] - C * double[0])
        size = grid.lam * (not_C * double[1] + C * double[0])
        return time, work if time <= 0 else int(grid.mp.log10(size / time))

    return _agreed(quadrature, dps)


def exit_probability(drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int) -> Any:
    """Probability of leaving (-r, r) through -r, by eq:C.

    Parameters, result and errors are those of `escape_time`.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """C on one grid."""
        grid = _Grid(drift, kappa, [-r, start, r], work, level)
        panels = list(grid.panels())
        after = sum(panel.int_e for panel in panels if panel.left >= start)
        return after / sum(panel.int_e for panel in panels), 0

    return _agreed(quadrature, dps)


def occupation(drift: Drift, kappa: Fraction, dps: int, complement: bool = False) -> Any:
    """Stationary probability of -1 <= u <= 1, by eq:P; with `complement` that of the tails.

    The drift must be sliding, a- > 0 > a+; the rest is as in `escape_time`.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """P or 1 - P on one grid."""
        grid = _Grid(drift, kappa, list(_where_tails_end(drift, kappa, work)), work, level)
        panels = list(grid.panels())
        part = sum(p.int_inverse for p in panels if (-1 <= p.left < 1) is not complement)
        return part / sum(p.int_inverse for p in panels), 0

    return _agreed(quadrature, dps)


def stationary_density(drift: Drift, kappa: Fraction, y: Fraction, dps: int) -> Any:
    """Stationary probability density at `y`, by eq:pss with K such that its integral is 1.

    The drift must be sliding, a- > 0 > a+; the rest is as in `escape_time`.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """The density on one grid."""
        low, high = _where_tails_end(drift, kappa, work)
        grid = _Grid(drift, kappa, [min(low, y - 1), y, max(high, y + 1)], work, level)
        panels = list(grid.panels())
        (at_y,) = (grid.mp.exp(-p.exponent) for p in panels if p.left == y)
        return at_y / sum(p.int_inverse for p in panels), 0

    return _agreed(quadrature, dps)


def integral(drift: Drift, kappa: Fraction, a: Fraction, b: Fraction, sign: int, dps: int) -> Any:
    """Integral of e^{sign lam V} from a to b, with V(-1) = 0 (eq:V).

    What the paper's formulas of single pieces are compared with; `dps` and the result are
    those of `escape_time`, and -1 must not lie right of `b`.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """The integral on one grid."""
        grid = _Grid(drift, kappa, [min(a, -Fraction(1)), a, b], work, level)
        total, zero = grid.mp.zero, grid.mp.zero
        for panel in grid.panels():
            if panel.left == -1:
                zero = panel.exponent
            if panel.left >= a:
                total += panel.int_e if sign > 0 else panel.int_inverse
        # V was counted from the left end.
        return total * grid.mp.exp(-sign * zero), 0

    return _agreed(quadrature, dps)


def double_integral(
    drift: Drift, kappa: Fraction, left: Fraction, low: Fraction, high: Fraction, dps: int
) -> Any:
    """Integral of e^{lam (V(v) - V(u))} over left < u < v and low < v < high, left <= low.

    `dps` and the result are those of `escape_time`.
    """

    def quadrature(work: int, level: int) -> tuple[Any, int]:
        """The double integral on one grid."""
        grid = _Grid(drift, kappa, [left, low, high], work, level)
        return sum(p.nested for p in grid.panels(nested=True) if p.left >= low), 0

    return _agreed(quadrature, dps)


def _agreed(quadrature: Callable[[int, int], tuple[Any, int]], dps: int) -> Any:
    """The value of `quadrature` on which two successive levels agree to `dps` digits."""
    extra = 4
    previous = None
    for level in range(_REFINEMENTS + 1):
        extra += 8  # no two levels round alike
        value, lost = quadrature(dps + extra, level)
        while lost > extra - 8:
            # Where all digits were lost, the count is only a lower bound: hence the loop.
            extra = lost + max(16, lost // 4)
            value, lost = quadrature(dps + extra, level)
        close = abs(value) * value.context.mpf(10) ** -dps
        if previous is not None and abs(value - previous) <= close:
            return to_mpf(value, dps)
        previous = value
    raise AccuracyError(
        f"quadrature on {_REFINEMENTS + 1} grids gave no two results that agree to {dps} digits; "
        "ask for fewer digits."
    )


@cache
def _context(dps: int) -> Any:
    """An mpmath context of so many digits, kept for the next caller."""
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


def _where_tails_end(drift: Drift, kappa: Fraction, work: int) -> tuple[Fraction, Fraction]:
    """Points beyond which the tails of e^{-lam V} hold less than 10^-work of themselves."""
    mp = _context(work)
    a_minus, a_plus = map(in_mpmath(drift, mp), (mp.mpf(-1), mp.mpf(1)))
    if not (a_minus > 0 > a_plus):
        raise RegionError(
            f"a- is {float(a_minus):.6g} and a+ is {float(a_plus):.6g}, so that no stationary "
            "state exists; choose a drift with a- > 0 > a+."
        )
    # lam |a| length = log 10^(work + 1), a little rounded up
    decades = kappa**2 / 2 * Fraction(24, 10) * (work + 1)
    return -1 - decades / Fraction(float(a_minus)), 1 + decades / Fraction(-float(a_plus))


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
        """Cut the interval at `marks` and the kinks, and make the rule of this level."""
        self.mp = _context(work)
        self.A = in_mpmath(drift, self.mp)
        self.lam = 2 * self.mp.mpf(kappa.denominator) ** 2 / self.mp.mpf(kappa.numerator) ** 2
        self.kinks = {Fraction(x): self._evaluate(self.mp.mpf(x)) for x in (-1, 1)}
        self.most_growth = self.mp.mpf(4) / 2**level
        self.widest = Fraction(1, 4 * 2**level)
        # e^{2t} on [-1, 1] is integrated to n digits by about n/2 + 10 nodes, while n < 200.
        nodes = int(work * 0.55) + 14 + 6 * level
        kinks = [x for x in self.kinks if min(marks) < x < max(marks)]
        self.edges = self._cut(sorted({*marks, *kinks}))
        if len(self.edges) * nodes**2 > _MOST_MULTIPLICATIONS:
            raise AccuracyError(
                f"plain quadrature needs {len(self.edges)} panels of {nodes} nodes here; "
                "take stronger noise, a smaller r or fewer digits."
            )
        self.nodes, self.weights, self.primitive = _rule(work, nodes)

    def _mpf(self, x: Fraction) -> Any:
        return self.mp.mpf(x.numerator) / x.denominator

    def _evaluate(self, u: mpf) -> Any:
        """A(u)."""
        return self.mp.mpf(self.A(u))

    def phi(self, u: mpf) -> Any:
        """eq:phi."""
        if u <= -1:
            return self.kinks[Fraction(-1)]
        if u >= 1:
            return self.kinks[Fraction(1)]
        return self._evaluate(u)

    def _cut(self, marks: list[Fraction]) -> list[Fraction]:
        """Edges such that lam V changes by at most `most_growth` between two of them."""
        edges = [marks[0]]
        for left, right in pairwise(marks):
            if left >= 1 or right <= -1:
                middle = self._mpf((left + right) / 2)
                growth = self.lam * abs(self.phi(middle)) * self._mpf(right - left)
                pieces = max(1, ceil(growth / self.most_growth))
                self._refuse(pieces)
                edges += [left + (right - left) * Fraction(k, pieces) for k in range(1, pieces)]
            else:
                edges += self._bisected(left, right)
            edges.append(right)
        return edges

    def _bisected(self, left: Fraction, right: Fraction) -> list[Fraction]:
        """Inner edges of one interval inside [-1, 1], where the drift varies."""
        waiting, edges = [(left, right)], []
        while waiting:
            a, b = waiting.pop()
            samples = [self._mpf(a + (b - a) * Fraction(k, 6)) for k in range(7)]
            steepest = max(abs(self.phi(u)) for u in samples)
            growth = self.lam * steepest * self._mpf(b - a)
            if growth <= self.most_growth and b - a <= self.widest:
                edges.append(a)
            else:
                self._refuse(len(edges) + len(waiting))
                waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
        return edges[1:]

    def _refuse(self, panels: int) -> None:
        """Refuse a grid that would take more than minutes."""
        if panels > 100_000:
            raise AccuracyError(
                f"plain quadrature needs {panels} panels and more here; "
                "take stronger noise or a smaller r."
            )

    def panels(self, nested: bool = False) -> Iterator[_Panel]:
        """The panels from left to right; without `nested` the double integrals are left out.

        The paper counts V from -1, but all formulas contain differences of V only.
        """
        mp = self.mp
        exponent = before = mp.zero
        for a, b in pairwise(self.edges):
            half, center = (self._mpf(x / 2) for x in (b - a, b + a))
            if a >= 1 or b <= -1:
                slopes = [-self.lam * self.phi(center)] * len(self.nodes)
            else:
                slopes = [-self.lam * self._evaluate(center + half * t) for t in self.nodes]
            int_e = [mp.exp(exponent + x) for x in self._running(half, slopes)]
            int_inverse = [1 / x for x in int_e]
            double = mp.zero
            if nested:
                up_to_v = [before + x for x in self._running(half, int_inverse)]
                double = self._whole(half, [s * x for s, x in zip(int_e, up_to_v, strict=True)])
            whole = self._whole(half, int_inverse)
            yield _Panel(a, exponent, self._whole(half, int_e), whole, double)
            before += whole
            exponent += self._whole(half, slopes)

    def _whole(self, half: mpf, values: list[Any]) -> Any:
        """Integral over a panel, from the values at its nodes."""
        return half * self.mp.fdot(self.weights, values)

    def _running(self, half: mpf, values: list[Any]) -> list[Any]:
        """Integrals from the panel's left end to each of its nodes."""
        return [half * self.mp.fdot(row, values) for row in self.primitive]


@cache
def _rule(dps: int, count: int) -> tuple[list[Any], list[Any], list[list[Any]]]:
    """Nodes, weights and integration matrix of a Gauss rule."""
    mp = _context(dps)
    nodes, weights = _gauss_legendre(mp, count)
    return nodes, weights, _integration_matrix(mp, nodes, weights)


def _legendre(mp: MPContext, count: int, x: mpf) -> list[Any]:
    """P_0(x), ..., P_count(x)."""
    values = [mp.one, x]
    for k in range(1, count):
        values.append(((2 * k + 1) * x * values[k] - k * values[k - 1]) / (k + 1))
    return values


def _gauss_legendre(mp: MPContext, count: int) -> tuple[list[Any], list[Any]]:
    """Nodes and weights on [-1, 1], by Newton's method on P_count."""
    nodes, weights = [], []
    with mp.extradps(10):
        for k in range(count, 0, -1):
            x = mp.cos(mp.pi * (k - mp.mpf(1) / 4) / (count + mp.mpf(1) / 2))
            for _ in range(100):
                P = _legendre(mp, count, x)
                slope = count * (x * P[count] - P[count - 1]) / (x * x - 1)
                step = P[count] / slope
                x -= step
                if abs(step) < mp.mpf(10) ** (-mp.dps // 2 - 3):
                    break
            P = _legendre(mp, count, x)
            slope = count * (x * P[count] - P[count - 1]) / (x * x - 1)
            nodes.append(x)
            weights.append(2 / ((1 - x * x) * slope * slope))
    return nodes, weights


def _integration_matrix(mp: MPContext, nodes: list[Any], weights: list[Any]) -> list[list[Any]]:
    """Row i gives the integral from -1 to node i of the polynomial through given node values.

    The polynomial's Legendre coefficients are c_k = (k + 1/2) sum_j w_j P_k(x_j) f_j, which the
    Gauss rule makes exact, and the integral of P_k from -1 is (P_{k+1} - P_{k-1})/(2k + 1).
    """
    count = len(nodes)
    with mp.extradps(10):
        P = [_legendre(mp, count, x) for x in nodes]
        rows = []
        for i, x in enumerate(nodes):
            halves = [(x + 1) / 2]
            halves += [(P[i][k + 1] - P[i][k - 1]) / 2 for k in range(1, count)]
            row = [w * mp.fdot(halves, p[:count]) for w, p in zip(weights, P, strict=True)]
            rows.append(row)
    return rows
