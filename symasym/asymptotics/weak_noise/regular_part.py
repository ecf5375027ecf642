"""The regular part of weak noise: integrals of the slow manifold, Hadamard's finite parts.

M(v) = e^{lam V(v)} int e^{-lam V} solves M' = 1 - lam phi M and is, besides exponentials and away
from zeros of phi, the slow manifold h_1/lam + h_2/lam^2 + ... with h_1 = 1/phi and
h_{k+1} = -h_k'/phi; beside a simple zero of phi at t = 0, t^(2k - 1) h_k is a power series. Here
are the integrals of h_k, at a zero of phi Hadamard's finite part: the wells and barriers there
bring exponentials of their own (`symasym.asymptotics.weak_noise.critical_points`), and nothing
else, since a path above the zero and one below it differ by a pure exponential. For a polynomial
A all is a sum over the zeros of A in the complex plane; otherwise over Taylor panels.

No next term tells what is left out where A varies fast between critical points: the resolution
test (`unresolved`) looks for that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.series import counts
from symasym.base.call_context import mpf_of, step
from symasym.base.errors import AccuracyError, InputError, SymasymError
from symasym.base.inputs import FloatArray, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField, to_fraction
from symasym.generated.formulas import (
    fall_beside_pair,
    finite_part,
    next_binomial,
    next_share_of_line,
    share_of_line,
    two_powers_more,
)
from symasym.numbers.arithmetic import Number
from symasym.numbers.polynomials import float_zeros, laurent, product, reciprocal, refined, shifted
from symasym.scenes import Scenes
from symasym.series.quadratic_factor import split_pair

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = [
    "Pole", "panel_integrals", "pole_primitive", "pole_sums", "polynomial_primitives",
    "require_resolved", "unresolved", "unresolved_in",
]  # fmt: skip

# Bits of a primitive that may cancel: precisions have more than these to spare.
_SPARE = 16
# Zeros closer than this are not separated well enough for partial fractions.
_CLUSTER = 1e-5
# Half the distance of two zeros up to which one panel is about both.
_APART = Fraction(1, 20)
# Where more, or narrower ones, are needed, A nearly vanishes and the series is of no use.
_MOST_PANELS = 60
_NARROWEST = Fraction(1, 2**12)
# Of the resolution test: points in the layer, and scenes at once.
_POINTS = 513
# Of |phi'|/(lam phi^2), outside of e^{±3} around wells and barriers.
_MOST_BEND = 0.25
_NEAR = 3.0
_EDGE = 13
_AT_ONCE = 512


class Pole(NamedTuple):
    """A simple zero of A, its Taylor coefficients there, and the relative rounding of these.

    `times` is 2 for one of a complex pair, whose shares are twice the real part.
    """

    z: Any
    taylor: list[Any]
    times: int
    rounding: Any


def pole_sums(
    poles: Iterable[Pole], edges: Sequence[Any], count: int, log: Callable[[Any], Any]
) -> tuple[list[list[Any]], list[list[Any]]]:
    """Primitives of h_1, ..., h_count at each of the edges, polynomial A, and their rounding.

    By partial fractions: h_k has its poles at the zeros of A and vanishes at infinity, so that it
    is the sum of the negative powers of its Laurent series there.
    """
    totals, sizes = ([[0.0] * len(edges) for _ in range(count)] for _ in range(2))
    for z, taylor, times, rounding in poles:
        psi = (taylor + [0.0] * 2 * count)[: 2 * count]
        known = list(laurent(psi, True, count))
        moved = [rounding * (6 + 4 * k) if counts(rounding) else 0.0 for k in range(count)]
        for side, u in enumerate(edges):
            t = u - z
            logarithm = log(abs(t) if times == 1 else t) if isinstance(t, np.ndarray) or t else t
            for k, series in enumerate(known):
                total = pole_primitive(series, k, t, logarithm)
                here = total if times == 1 else 2 * total.real
                totals[k][side] = totals[k][side] + here
                if counts(moved[k]):
                    sizes[k][side] = sizes[k][side] + abs(total) * moved[k]
    return totals, sizes


def polynomial_primitives(
    field: ExactField, edges: Sequence[Any], count: int, context: MPContext
) -> list[list[Any]] | None:
    """Primitives of h_1, ..., h_count at the edges; at a simple zero of A the finite part.

    None unless A is a polynomial whose zeros are far enough from each other for `pole_sums`.
    """
    if not field.is_polynomial:
        return None
    more = 0
    while True:
        with context.workprec(context.prec + more):
            rows, lost = _by_poles(field, edges, count, context)
        if rows is None or lost <= more + _SPARE:
            return rows
        # What zeros far out or beside each other contribute cancels.
        step()
        more = lost


def _by_poles(
    field: ExactField, edges: Sequence[Any], count: int, context: MPContext
) -> tuple[list[list[Any]] | None, int]:
    """The primitives of a polynomial A, and bits of them that cancel."""
    c = [mpf_of(x, context) for x in field.taylor(Fraction(0), Fraction(1), 0)]
    points = [mpf_of(u, context) for u in edges]
    roots = _roots(c, context)
    if roots is None:
        return None, 0
    if not roots:
        return [[u / c[0] for u in points], *([context.zero] * len(points),) * (count - 1)], 0
    poles, falling = [], [abs(x) for x in reversed(c)]
    for z in roots:
        # Zeros come with their conjugates, so that half of them are enough.
        if context.im(z) >= 0:
            root = refined(c, z, context)
            if root is None:
                return None, 0
            times = 1 if isinstance(root, context.mpf) else 2
            taylor = shifted(c, root)[: 2 * count]
            # What cancels in A' there, and what moves the zero, by which A' changes.
            value, slope = context.polyval(falling, abs(root), derivative=True)
            lost = abs(slope / taylor[1])
            if len(taylor) > 2:
                lost += abs(2 * taylor[2] * value / taylor[1] ** 2)
            poles.append(Pole(root, taylor, times, context.eps * lost))
    totals, sizes = pole_sums(poles, points, count, context.log)
    # The first is compared with what int 1/phi is at least, since constants are of no meaning.
    least = [(points[-1] - points[0]) / sum(map(abs, c))]
    least += [max(map(abs, row)) for row in totals[1:]]
    # How far the totals are above their rounding, in bits.
    above = [
        context.mag(x) - context.mag(max(size)) if x else context.prec
        for size, x in zip(sizes, least, strict=True)
    ]
    return totals, context.prec - max(0, min(above))


def pole_primitive(series: list[Any], k: int, t: Number, log: Number) -> Any:
    """A primitive at t of h_{k+1}'s poles, from its coefficients times t^(2k + 1).

    `log` is log(t) or log|t|; nothing at t = 0, the finite part.
    """
    if not isinstance(t, np.ndarray) and t == 0:
        return 0 * t
    inverse = 1 / t
    total: Any = 0.0
    for j in range(2 * k + 1, 1, -1):
        total = (total + finite_part(j, series[2 * k + 1 - j])) * inverse
    return total + series[2 * k] * log


def primitive(t: Number, j: int, context: MPContext) -> Any:
    """A primitive of t^-j; nothing at t = 0, the finite part."""
    if t == 0:
        return context.zero
    if j == 1:
        return context.log(abs(t)) if isinstance(t, context.mpf) else context.log(t)
    return finite_part(j, t ** (1 - j))


def least_square(context: MPContext) -> Any:
    """The squared half distance of two zeros below which rounding decides if they are real."""
    return context.ldexp(1, 24 - context.prec)


# -- polynomials: partial fractions ----------------------------------------------------------------


def _roots(exact: list[Any], context: MPContext) -> list[Any] | None:
    """All zeros, roughly, or None where more than two are too close to each other."""
    roots = float_zeros(exact)
    degree = max((k for k, x in enumerate(exact) if x), default=0)
    if len(roots) < degree or not np.isfinite(roots).all():
        return None
    close = np.abs(roots[:, None] - roots) <= _CLUSTER * np.maximum(1, np.abs(roots))
    near: list[Any] = []
    for k, root in enumerate(roots):
        others = np.flatnonzero(close[k])
        if len(others) == 1:
            real = abs(root.imag) < 1e-9 * (1 + abs(root))
            near.append(context.mpf(root.real) if real else context.mpc(complex(root)))
        elif len(others) > 2:
            return None
        elif others[0] == k:
            middle = roots[others].mean()
            # Off the real line float64 has to tell them apart.
            pair = _close_pair(exact, middle.real, context) if abs(middle.imag) < 1e-9 else None
            if pair is None:
                return None
            near += pair
    return near


def _close_pair(c: list[Any], middle: float, context: MPContext) -> list[Any] | None:
    """The two zeros about `middle`; float64 has only half of the digits of each."""
    x = context.mpf(middle)
    try:
        pair = split_pair(shifted(c, x), context)
    except (AccuracyError, InputError):
        return None
    if abs(pair.square) <= least_square(context):
        return None
    apart = context.sqrt(pair.square)
    return [x + pair.middle - apart, x + pair.middle + apart]


# -- Taylor panels ---------------------------------------------------------------------------------


def panel_integrals(
    field: ExactField,
    lo: Fraction,
    hi: Fraction,
    zeros: Sequence[Any],
    count: int,
    context: MPContext,
) -> list[Any]:
    """Finite parts of int h_k over [lo, hi], k = 1 to `count`, for any A by Taylor panels.

    One panel is about each zero of A, or each close pair of them, the others halved as is needed.
    """
    marks = [lo, *(to_fraction(z) for z in zeros), hi]
    panels = _Panels(field, count, context)
    panels.cover(marks)
    return panels.totals


class _Panels:
    """The integrals of h_1, ..., h_count over the panels that have been added: `totals`."""

    def __init__(self, field: ExactField, count: int, context: MPContext) -> None:
        self.field, self.count, self.context = field, count, context
        self.totals = [context.zero] * count

    # -- where the panels are ---------------------------------------------------------------

    def cover(self, marks: list[Fraction]) -> None:
        """Add all panels from the first of the marks to the last; the others are A's zeros."""
        lo, hi, field = marks[0], marks[-1], self.field
        cuts = [lo]
        before = self.zero_before(lo)
        if before is not None:
            reach = self.from_zero(before, lo, (marks[1] - before) / 2)
            cuts = [before + reach] if reach else [lo]
        alone = []
        for start, end in self.about_pairs(marks):
            cuts += [start, end]
            alone += [z for z in marks[1:-1] if start < z < end]
        inside = [z for z in marks[1:-1] if z not in alone]
        for zero in inside:
            # About a zero the panel is symmetric, for its logarithms to cancel, or ends with the
            # range.
            others = [u for u in (*marks, *cuts) if u != zero]
            end = lo if zero - lo < hi - zero else hi
            reach = min(abs(zero - u) for u in others if u != end) / 2
            cuts += self.beside_end(zero, reach, end)
        cuts = sorted([*cuts, hi])
        whole = [(cuts[k], cuts[k + 1]) for k in range(0, len(cuts), 2)]
        waiting = list(whole)
        for _ in range(_MOST_PANELS):
            if not waiting:
                return
            a, b = waiting.pop()
            middle = (a + b) / 2
            if b - a < _NARROWEST and (a, b) not in whole:
                raise _too_narrow(field, a)
            if not self.add(middle, (b - a) / 2):
                waiting += [(a, middle), (middle, b)]
        raise _too_narrow(field, waiting[-1][0])

    def about_pairs(self, marks: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
        """Add a panel about each two zeros, real or complex, that are close; where they are."""
        panels: list[tuple[Fraction, Fraction]] = []
        lo, hi = marks[0], marks[-1]
        for mark in sorted(map(Fraction, self.field.monotone_marks())):
            if not lo < mark < hi:
                continue
            about = self.field.taylor(mark, Fraction(1), 3)
            if len(about) < 3 or not about[2] or abs(about[0] / about[2]) > _APART**2:
                continue
            near = 4 * Fraction(_APART)
            edges = [u for u in marks if abs(u - mark) > near]
            edges += [lo, hi, *(u for p in panels for u in p)]
            reach = min([abs(u - mark) / 2 for u in edges] + [Fraction(1, 4)])
            while reach > near / 3:
                step()
                if self.add_pair(mark, reach):
                    panels.append((mark - reach, mark + reach))
                    break
                reach = reach * 3 / 4
        return panels

    def zero_before(self, lo: Fraction) -> Fraction | None:
        """A simple zero of A just before the range, or at its beginning."""
        value, slope = self.field.taylor(lo, Fraction(1), 2)[:2]
        if value == 0:
            return lo
        if not slope or not 0 < value / slope < _APART:
            return None
        zero = to_fraction(self.field.polish(mpf_of(lo - value / slope, self.context)))
        return zero if max(Fraction(-1), lo - 2 * _APART) < zero < lo else None

    def from_zero(self, zero: Fraction, lo: Fraction, reach: Fraction) -> Fraction | None:
        """Add a panel from `lo` on about a zero before it; how far it reaches from there."""
        gap = lo - zero
        while reach > max(2 * gap, _NARROWEST):
            step()
            if self.add(zero, reach, (mpf_of(gap / reach, self.context), 1)):
                return reach
            reach /= 2
        if gap:
            return None
        raise _too_narrow(self.field, zero)

    def beside_end(self, zero: Fraction, reach: Fraction, end: Fraction) -> list[Fraction]:
        """Add a panel about a zero, up to the `end` of the range if that is near; its edges."""
        gap, before = abs(zero - end), end < zero
        while reach > gap:
            step()
            near = mpf_of(gap / reach, self.context)
            if self.add(zero, reach, (-near, self.context.one) if before else (-1, near)):
                return [end, zero + reach] if before else [zero - reach, end]
            reach /= 2
        reach = min(reach, gap / 2)
        while not self.add(zero, reach, (-1, 1)):
            step()
            reach /= 2
            if reach < _NARROWEST:
                raise _too_narrow(self.field, zero)
        return [zero - reach, zero + reach]

    # -- one panel --------------------------------------------------------------------------

    def add(self, centre: Fraction, half: Fraction, sides: tuple[Any, Any] | None = None) -> bool:
        """Add the integrals over centre + half [-1, 1]; False, and nothing added, if too wide.

        With `sides`, over centre + half [sides], about a zero of A.
        """
        return not half or self._added(1.4, partial(self._shares, centre, half, sides))

    def add_pair(self, centre: Fraction, half: Fraction) -> bool:
        """Add the integrals over centre ± half, where phi = (y² - D) psi; False if too wide.

        h_k = g_k/(y² - D)^(2k - 1), g_1 = 1/psi, with every g_k a power series: nothing is singular
        as D vanishes but, for a complex pair, the share of its zeros.
        """
        return self._added(1.2, partial(self._pair_shares, centre, half))

    def _added(self, bits: float, find: Callable[[int, mpf], list[Any] | None]) -> bool:
        """Add what is found from a term for every so many bits, if anything is."""
        c, count = self.context, self.count
        terms, small = int(c.prec / bits) + 2 * count + 8, c.ldexp(1, -c.prec + 16)
        # Each derivative makes rounding larger by the number of the coefficient.
        with c.workprec(c.prec + (count - 1) * terms.bit_length()):
            shares = find(terms, small)
        for k, share in enumerate(shares or ()):
            self.totals[k] += share
        return shares is not None

    def _shares(
        self, centre: Fraction, half: Fraction, sides: Any, terms: int, small: mpf
    ) -> list[Any] | None:
        """The integrals that `add` adds, k = 1 to `count`; None if the panel is too wide."""
        context, zero = self.context, sides is not None
        sides = sides if zero else (-1, 1)
        taylor = [mpf_of(c, context) for c in self.field.taylor(centre, half, terms)]
        taylor += [context.zero] * (terms - len(taylor))
        if zero:
            taylor[0] = context.zero
        # Where the panel is far too wide, the first coefficients are lost beside the later ones.
        if not taylor[1 if zero else 0]:
            return None
        width = mpf_of(half, context)
        shares = []
        for k, series in enumerate(laurent(taylor, zero, self.count)):
            if max(abs(c) for c in series[-8:]) > small * max(abs(c) for c in series):
                return None
            power = 2 * k + 1 if zero else 0
            # In units of `half` the logarithm of the distance counts from there.
            parts = []
            for j, c in enumerate(series):
                step()
                low, high = (primitive(context.mpf(x), power - j, context) for x in sides)
                parts.append(c * (high - low))
            total = context.fsum(parts)
            if zero and sides[0] == 0:
                total += series[power - 1] * context.log(width)
            # h_k is in units of 1/half^(k-1), du in those of half; phi itself was not scaled.
            shares.append(total * width ** (1 - k))
        return shares

    def _pair_shares(
        self, centre: Fraction, half: Fraction, terms: int, small: mpf
    ) -> list[Any] | None:
        """The integrals that `add_pair` adds, k = 1 to `count`; None if the panel is too wide."""
        context, width = self.context, mpf_of(half, self.context)
        taylor = [mpf_of(c, context) for c in self.field.taylor(centre, half, terms)]
        while len(taylor) > 3 and not taylor[-1]:
            # Its division takes the square of the length.
            taylor.pop()
        try:
            pair = split_pair(taylor, context, 1)
        except SymasymError:
            return None
        psi = [pair.sign * c for c in pair.psi]
        psi += [context.zero] * (terms - 2 - len(psi))
        square, ends = pair.square, (-1 - pair.middle, 1 - pair.middle)
        if not least_square(context) < abs(square) < 0.25 or abs(pair.middle) > 0.5:
            return None
        inverse = reciprocal(psi)
        g, shares = inverse, []
        for k in range(self.count):
            # The series about the middle is to reach both ends, 1 + |middle| away.
            top = [abs(c) * (1 + abs(pair.middle)) ** j for j, c in enumerate(g)]
            if max(top[-8:]) > small * max(top):
                return None
            powers = _pair_integrals(square, ends, len(g), 2 * k + 1, context)
            shares.append(context.fdot(g, powers) * width ** (1 - k))
            fall = [
                fall_beside_pair(j, 2 * k + 1, before, after, square)
                for j, (before, after) in enumerate(zip([context.zero, *g], g[1:-2], strict=False))
            ]
            g = product(fall, inverse[: len(fall)])
        return shares


def _pair_integrals(
    square: mpf, ends: tuple[Any, Any], count: int, power: int, context: MPContext
) -> list[Any]:
    """int y^j (y² - D)^-power over the ends, j < count: finite parts, D = square.

    From j to j + 2 by y² = (y² - D) + D; the first two as series in D/y² at the ends, that is on
    a path above both zeros, and what the real line has more if they are complex.
    """

    def over(edges: Sequence[Any], order: int) -> Any:
        """int t^-order."""
        return primitive(edges[1], order, context) - primitive(edges[0], order, context)

    row = [over(ends, -j) for j in range(count)]
    share = share_of_line(context, context.sqrt(-square)) if square < 0 else context.zero
    for n in range(1, power + 1):
        first, coefficient, i = share, context.one, 0
        while True:
            step()
            term = coefficient * over(ends, 2 * n + 2 * i)
            first += term
            if abs(term) < context.eps * (1 + abs(first)):
                break
            coefficient = next_binomial(n, i, coefficient) * square
            i += 1
        lower, row = row, [first, over([e * e - square for e in ends], n) / 2]
        for j in range(2, count):
            row.append(two_powers_more(lower[j - 2], row[j - 2], square))
        share = next_share_of_line(n, share, square)
    return row[:count]


def _too_narrow(field: ExactField, u: Fraction) -> AccuracyError:
    """The refusal of a drift that needs too many panels beside u."""
    point = -float(u) if field.mirrored else float(u)
    return AccuracyError(
        f"A varies too fast, or nearly vanishes, beside u = {point:.6g} for the weak-noise "
        "series; use method='exact'."
    )


# -- the resolution test ---------------------------------------------------------------------------
#
# Between critical points the expansions are in |phi'|/(lam phi^2). A drift that is no polynomial
# may vary fast there although it is straight where its series are taken; then what is left out,
# e^{lam V} there, is in no next term.


def unresolved(drift: Drift, lam: float, folds: Sequence[float] = ()) -> bool:
    """True where A varies too fast for this noise, but at the folds; never for a polynomial."""
    if drift.exact_coefficients() is not None:
        return False
    u = np.linspace(-1, 1, _POINTS)
    with np.errstate(all="ignore"):
        phi = np.broadcast_to(drift.evaluate_float(u), u.shape)
    return bool(_unresolved(phi[None], np.array([lam]), folds)[0])


def require_resolved(drift: Drift, lam: Fraction, folds: Sequence[float] = ()) -> None:
    """Raise AccuracyError where A varies too fast for the noise (`unresolved`), but at folds."""
    # Noise beyond the range of float64 is weak.
    if lam < 10**300 and unresolved(drift, float(lam), folds):
        p, q = (2 / lam).as_integer_ratio()
        kappa = Fraction(math.isqrt(p * q << 120), q << 60)
        raise AccuracyError(
            f"kappa is {float_text(kappa)}, where the noise is too strong for a drift that "
            "varies this fast: no term of Laplace's method estimates its error; use "
            "method='exact' or 'strong_noise'."
        )


def unresolved_in(drift: Drift, scenes: Scenes) -> Any:
    """The same, for each scene."""
    unresolved = np.zeros(len(scenes.lam), dtype=bool)
    first = {n: float(x.flat[0]) if is_array(x) else x for n, x in scenes.parameters.items()}
    if not len(unresolved) or drift.bind(**first).exact_coefficients() is not None:
        return unresolved
    u = np.linspace(-1, 1, _POINTS)
    for low in range(0, len(unresolved), _AT_ONCE):
        part = slice(low, low + _AT_ONCE)
        lam = scenes.lam[part]
        values = {
            name: np.asarray(x[part])[:, None] if is_array(x) else np.asarray(float(x))
            for name, x in scenes.parameters.items()
        }
        with np.errstate(all="ignore"):
            phi = np.broadcast_to(drift.evaluate_float(u, values), (len(lam), _POINTS))
        unresolved[part] = _unresolved(phi, lam)
    return unresolved


@np.errstate(all="ignore")
def _unresolved(phi: FloatArray, lam: FloatArray, folds: Sequence[float] = ()) -> Any:
    """True for each row of phi that |phi'|/(lam phi^2) shows to vary too fast.

    Near a zero of phi, within e^{±3}, phi is instead to be nearly its tangent where the Gaussian
    is wide.
    """
    step = 2 / (_POINTS - 1)
    slope = np.gradient(phi, step, axis=1)
    # By trapezoids, exact where phi is its tangent: at a zero that decides what is near.
    rise = (np.cumsum(phi, axis=1) - phi / 2) * step
    # Beside u = -1 and 1 the series of these points estimate.
    near = np.zeros(phi.shape, dtype=bool)
    near[:, :_EDGE] = near[:, -_EDGE:] = True
    # Where a well and a barrier meet, phi is a parabola, and Airy functions tell.
    for fold in folds:
        middle = round((fold + 1) / step)
        near |= lam[:, None] * np.abs(rise - rise[:, middle : middle + 1]) < _NEAR
    known = near.copy()
    rows, columns = np.nonzero((phi[:, 1:] > 0) != (phi[:, :-1] > 0))
    # Beyond float64 nothing is known.
    crooked: Any = ~(np.isfinite(rise) & np.isfinite(slope)).all(axis=1)
    for row, column in zip(rows, columns, strict=True):
        if crooked[row]:
            continue
        # From the zero itself, which may be at a point or between two.
        before, after = phi[row, column : column + 2]
        at_zero = rise[row, column] + before * step / 2 * before / (before - after)
        near[row] |= lam[row] * np.abs(rise[row] - at_zero) < _NEAR
        if folds and known[row, column]:
            continue
        # At the width of the Gaussian A must still be nearly its tangent.
        steep = np.abs(slope[row, column])
        reach = max(1, int(1 / np.sqrt(lam[row] * steep + 1e-300) / step))
        for end in (max(int(column) - reach, 0), min(int(column) + reach, _POINTS - 1)):
            straight = steep * abs(end - int(column)) * step
            crooked[row] |= np.abs(phi[row, end] - phi[row, column]) < straight / 2
    bend = np.abs(slope) / (lam[:, None] * phi**2)
    return crooked | (np.where(near, 0.0, bend) > _MOST_BEND).any(axis=1)
