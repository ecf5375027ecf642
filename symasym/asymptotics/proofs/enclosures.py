"""Proved two-sided bounds of T and 1 - P for weak noise, at a cost that does not grow with lam.

With L, R the integrals of e^{lam V} left and right of a point and m = e^{-lam V},

    T = lam/(L + R) int m(u) L(min(u, x)) R(max(u, x)) du.

[-r, r] is cut into cells, independent of lam. The integral of e^{lam V} over the cell of a
barrier, or of an end where V is largest, and that of e^{-lam V} over a well's are Laplace's
series with Cauchy's bound of what it leaves out (`symasym.asymptotics.laplace.cauchy_disk`);
straight cells are closed form; everywhere else V lies between two constants, which is enough,
since that part is exponentially small where a well and a barrier dominate, and where none does
nothing is claimed. Every sum has positive terms only, so that lower and upper bounds are carried
apart. See docs/weak-noise-bounds.md.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import flint

from symasym.asymptotics.laplace.cauchy_disk import THETA
from symasym.asymptotics.proofs.cells import (
    Cell,
    Extremum,
    Landscape,
    Stationary,
    landscape,
    stationary,
    steepness,
)
from symasym.asymptotics.proofs.layer_bounds import Bounds, between_lines
from symasym.asymptotics.strong_noise.panel import straight
from symasym.drift.drift import Drift
from symasym.numbers.balls import exact_ball, precision

if TYPE_CHECKING:
    from flint import arb


def enclosure(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, order: int, digits: int
) -> Bounds | None:
    """Bounds of T in balls, or None where the proof does not go through.

    Parameters
    ----------
    drift : Drift
        Scalar and bound.
    kappa, r, start : Fraction
    order : int
        The highest order of the expansion whose error the bounds are to show.
    digits : int
        Digits that must not be lost to rounding.

    Returns
    -------
    Bounds or None
        Positive; they may be far apart where no well and barrier dominate.
    """
    coefficients = drift.exact_coefficients()
    if coefficients is None:
        return None
    lam = 2 / kappa**2
    cut = landscape(tuple(coefficients), drift, r, start, order)
    if cut is None:
        return None
    # e^{lam V} loses as many bits as its exponent has before the point.
    with precision(100 + 4 * digits + int(lam * (1 + r)).bit_length()):
        return _time(cut, lam)


def enclosure_outside(drift: Drift, kappa: Fraction, order: int, digits: int) -> Bounds | None:
    """Bounds of 1 - P in balls, or None where the proof does not go through; sliding only."""
    coefficients = drift.exact_coefficients()
    if coefficients is None:
        return None
    lam = 2 / kappa**2
    layer = stationary(tuple(coefficients), drift, order)
    if layer is None:
        return None
    with precision(100 + 4 * digits + int(lam).bit_length()):
        return _outside(layer, lam)


def _outside(layer: Stationary, lam: Fraction) -> Bounds | None:
    """int e^{-lam V} over |u| > 1, closed form, over that over all u."""
    zero = flint.arb(0)
    inside, outside = Bounds(zero, zero), zero
    for cell in layer.cells:
        inside = inside + _speed_measure(cell, lam)
    for slope, height in zip(layer.slopes, layer.heights, strict=True):
        outside += exact_ball(-lam * height).exp() / exact_ball(lam * slope)
    low, high = outside / (outside + inside.high), outside / (outside + inside.low)
    return Bounds(low.lower(), high.upper()) if low > 0 and high.is_finite() else None


class _Shares(NamedTuple):
    """Over a cell: int e^{lam V}, int e^{-lam V}, and the double integrals of both.

    `before` has e^{lam V} to the left of e^{-lam V}, `after` to the right.
    """

    scale: Bounds
    speed: Bounds
    before: Bounds
    after: Bounds


def _time(cut: Landscape, lam: Fraction) -> Bounds | None:
    """T from the cells' integrals, lower and upper bounds apart (module docstring)."""
    cells = [_shares(c, lam) for c in cut.cells]
    zero = flint.arb(0)
    none = Bounds(zero, zero)
    scale = [c.scale for c in cells]
    left = list(accumulate(scale, initial=none))
    right = list(accumulate(scale[::-1], initial=none))[::-1]
    at = cut.start_cell
    total = none
    own = scale[at] if cut.inside else none
    first = at + 1 if cut.inside else at
    # Of e^{lam V} on each side of the start; its own cell's, if cut by it, may be on either.
    behind = Bounds(left[at].low, (left[at].high + own.high).upper())
    ahead = Bounds(right[first].low, (right[first].high + own.high).upper())
    near = [(k, left[k], c.before) for k, c in enumerate(cells[:at])][::-1]
    far = [(k, right[k + 1], c.after) for k, c in enumerate(cells) if k >= first]
    for side, mine, other in ((near, behind, ahead), (far, ahead, behind)):
        middle, share = none, _share(other, mine)
        for k, beyond, nested in side:
            middle = middle + scale[k]
            between = Bounds(middle.low, (middle.high + own.high).upper())
            total = total + _product(cells[k].speed, _three(beyond, between, other))
            total = total + _product(nested, share)
    if cut.inside:
        # L(min) R(max)/(L + R) for u in the start's own cell, from all of it between the two to
        # none: E + A B/(A + B + E) grows with each of A, B and E.
        low = _three(left[at], own, right[first]).low
        high = (_three(left[at], none, right[first]).high + own.high).upper()
        total = total + _product(cells[at].speed, Bounds(low, high))
    number = exact_ball(lam)
    result = Bounds((number * total.low).lower(), (number * total.high).upper())
    if not (result.low.is_finite() and result.high.is_finite() and result.high > 0):
        return None
    return result


def _product(a: Bounds, b: Bounds) -> Bounds:
    """Bounds of the product of positive numbers."""
    return Bounds((a.low * b.low).lower(), (a.high * b.high).upper())


def _share(part: Bounds, rest: Bounds) -> Bounds:
    """part/(part + rest)."""
    return Bounds(_over(part.low, rest.high).lower(), _over(part.high, rest.low).upper())


def _over(part: arb, rest: arb) -> Any:
    """part/(part + rest), 0 where part is."""
    return part / (part + rest) if part > 0 else part


def _three(beyond: Bounds, between: Bounds, other: Bounds) -> Bounds:
    """A B/(A + M + B), which grows with A and B and falls with M."""

    def value(a: arb, m: arb, b: arb) -> Any:
        """A B/(A + M + B) of one end each."""
        return a * b / (a + m + b) if a > 0 and b > 0 else flint.arb(0)

    return Bounds(
        value(beyond.low, between.high, other.low).lower(),
        value(beyond.high, between.low, other.high).upper(),
    )


def _shares(cell: Cell, lam: Fraction) -> _Shares:
    """Bounds of the integrals over one cell."""
    if cell.slope is not None:
        return _straight(cell, cell.slope, lam)
    scale, speed = between_lines(cell.panels, lam, 1), between_lines(cell.panels, lam, -1)
    if cell.peak is not None:
        sharp = _laplace(cell.peak, lam)
        if cell.peak.sign > 0:
            scale = _both(scale, sharp)
        else:
            speed = _both(speed, sharp)
    none, whole = flint.arb(0), (scale.high * speed.high).upper()
    sign, steep = steepness(cell)
    # Where e^{lam V} is on the side to which V falls: at most the width over lam |V'|.
    low = whole if not sign else (cell.panels[0].width / (exact_ball(lam) * steep)).upper()
    low = low.min(whole)
    before, after = (low, whole) if sign > 0 else (whole, low)
    return _Shares(scale, speed, Bounds(none, before), Bounds(none, after))


def _speed_measure(cell: Cell, lam: Fraction) -> Bounds:
    """int e^{-lam V} over a cell inside the layer."""
    crude = between_lines(cell.panels, lam, -1)
    return crude if cell.peak is None else _both(crude, _laplace(cell.peak, lam))


def _both(a: Bounds, b: Bounds) -> Bounds:
    """The better of two bounds."""
    return Bounds(a.low.max(b.low), a.high.min(b.high))


def _straight(cell: Cell, slope: Fraction, lam: Fraction) -> _Shares:
    """The integrals over a straight cell, in closed form."""
    length = cell.stop - cell.start
    rate, width = exact_ball(slope * lam), exact_ball(length)
    stretch, mirrored = straight(rate, width), straight(-rate, width)
    factor = (exact_ball(lam) * cell.height).exp()
    fall, rise = stretch.fall, mirrored.fall
    values = (
        stretch.int_e * factor,
        stretch.int_inverse / fall / factor,
        stretch.nested / fall,
        mirrored.nested / rise,
    )
    return _Shares(*(Bounds(v.lower(), v.upper()) for v in values))


def _laplace(peak: Extremum, lam: Fraction) -> Bounds:
    """int e^{sign lam V} over the peak's cell: cut off at its best term."""
    d, number = peak.disk, exact_ball(lam)
    factor = (exact_ball(peak.sign * lam) * peak.height).exp()
    sides = len(d.sides)
    best = total = flint.arb(0)
    least = flint.arb("inf")
    size = exact_ball(Fraction(d.peak)) / d.contact
    ratio = exact_ball(1 / Fraction(d.rho))
    for k, c in enumerate(d.coefficients):
        s = Fraction(k + 1, d.contact)
        share = flint.arb(0)
        for (sign, _, _), drop in zip(d.sides, peak.drops, strict=True):
            # As far as the edge, not to infinity; of two sides the odd terms cancel but for that.
            part = 1 - (number * drop).gamma_upper(exact_ball(s), 1)
            share += -part if sides == 2 and sign < 0 and k % 2 else part
        total += share * c * number ** -exact_ball(s)
        after = exact_ball(s + Fraction(1, d.contact))
        tail = size * ratio ** (k + 1) * after.gamma() * number**-after
        left_out = (tail * sides / exact_ball(1 - Fraction(THETA))).upper()
        # Where the series diverges, the last term known need not be where to cut it off.
        if left_out < least:
            best, least = total, left_out
    low, high = (factor * (best - least)).lower(), (factor * (best + least)).upper()
    return Bounds(low.max(flint.arb(0)), high)
