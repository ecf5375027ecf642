"""The truncated Gaussian: a start, a kink or an end beside a well or barrier, to every order.

Bleistein's uniform expansion of a saddle near an endpoint, of both integrals and the double one.

About a zero z of phi, V = V(z) -+ t²/2 at a barrier or well, du = g(t) dt, integrations by parts

    e^{-lam t²/2} g = a e^{-lam t²/2} - (e^{-lam t²/2} B)',
    e^{lam t²/2} g = a~ e^{lam t²/2} + (e^{lam t²/2} B~)',

with a = sum a_n lam^-n of the whole Gaussian, B = sum b_k(t) lam^-(k+1), and a~, B~ with -lam. All
integrals up to a point t are then those of parabolas: with

    sigma = e^{lam t²/2} int_t^inf e^{-lam s²/2} ds, and its mirror image for t < 0 (erfc),
    D = e^{-lam t²/2} int_0^t e^{lam s²/2} ds (Dawson's integral),

the integral of e^{lam V} from t on is e^{lam V} (a sigma + B) beside a barrier and
-e^{lam V} (a~ D + B~) beside a well, a primitive of e^{-lam V} is e^{-lam V} (a~ D + B~)
or -e^{-lam V} (a sigma + B), and one of the regular part M = e^{lam V} int e^{-lam V} is

    a a~ int D - a~ B D + ...,      -a a~ int sigma - a B~ sigma + ...,

where what is left out is analytic. Laplace's sums have the same with the asymptotic series of
sigma, D and their integrals; `corrections` are the differences, which cancel what is singular at
the zero. Two points near the same zero are served as well: the formulas are exact for both.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.asymptotics.uniform.order_zero_forms import BLENDING
from symasym.asymptotics.weak_noise.critical_points import wells_and_barriers
from symasym.asymptotics.weak_noise.one_sided import (
    CriticalPoint,
    OneSided,
    endpoint_coefficients,
)
from symasym.asymptotics.weak_noise.series import BEYOND
from symasym.base.call_context import mpf_of
from symasym.drift.field.taylor_field import ExactField
from symasym.generated.formulas import barrier_truncated, well_truncated
from symasym.numbers.arithmetic import Digits
from symasym.numbers.polynomials import Truncated, product
from symasym.special.dawson import dawson, erfcx_area, gaussians

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = [
    "Corrections",
    "Truncation",
    "Truncations",
    "corrections",
    "truncations_at",
    "truncations_beside",
    "truncations_of",
]


class Truncation(NamedTuple):
    """A point p of A's layer with regard to one zero of A.

    Attributes
    ----------
    barrier : bool
    zero : mpf
    height, rise : mpf
        V at p and at the zero, from the start.
    t : mpf
        Positive to the right of the zero.
    peak : list
        a_n, blended out as another zero comes near.
    whole : list
        a_n as they are.
    weight : mpf
        What is not blended out of all that is beyond the order.
    series : list
        b_k at p.
    digits : int
        Of sigma, D and their integrals: what cancels at the zero does so in the series alone.
    known : dict
        These by lam.
    """

    barrier: bool
    zero: Any
    height: Any
    rise: Any
    t: Any
    peak: list[Any]
    whole: list[Any]
    weight: Any
    series: list[Any]
    digits: int
    known: dict[Any, _Functions]


class Truncations(NamedTuple):
    """At the start, if that is in the layer, and at the ends of the part that is looked at."""

    left: list[Truncation]
    start: list[Truncation]
    right: list[Truncation]


class Corrections(NamedTuple):
    """To be added to Laplace's sums.

    `scale` to the integral of e^{lam V} from p to the right, `speed` to that of e^{-lam V} up to
    p, and `regular` to that of the regular part up to p.
    """

    scale: Any
    speed: Any
    regular: Any


def truncations_of(
    field: ExactField,
    both: tuple[OneSided, OneSided],
    x: Fraction,
    r: Fraction,
    order: int,
    digits: int,
    context: MPContext,
) -> Truncations:
    """The truncated Gaussians at the start `x` and at the layer's ends, of the zeros next to them.

    `field` is not mirrored; `both` lie left, in the mirror, and right.
    """
    points = [
        point._replace(u=sign * point.u)
        for sign, one in zip((-1, 1), both, strict=True)
        for point in one.scale_points + [p for p in one.speed_points if p.kind == "well"]
    ]
    zeros = [p for p in points if p.kind in ("well", "barrier")]
    if r < 1:
        zeros = _all_zeros(field, x, order, context)
    heights = {p.u: _rise(p) for p in points}
    heights[mpf_of(x, context)] = context.zero
    ends = max(-Fraction(1), -r), min(Fraction(1), r)
    rows = []
    for p in (ends[0], x, ends[1]):
        inside = abs(p) <= 1 and field.value(p)
        height = heights[mpf_of(p, context)] if inside else context.zero
        rows.append(
            truncations_at(field, p, height, zeros, order, digits, context) if inside else []
        )
    return Truncations(*rows)


def _all_zeros(
    field: ExactField, x: Fraction, order: int, context: MPContext
) -> list[CriticalPoint]:
    """Also those beyond the ends, V measured from the start."""
    start = field.potential_rise(-context.one, mpf_of(x, context))
    return [
        p._replace(height=p.height - (start if p.kind == "barrier" else -start))
        for p in wells_and_barriers(field, order, context)
    ]


def truncations_at(
    field: ExactField,
    p: Fraction,
    height: mpf,
    zeros: list[CriticalPoint],
    order: int,
    digits: int,
    context: MPContext,
) -> list[Truncation]:
    """The point `p`, where V is `height`, between the zeros left and right of it."""
    count = order + 1 + BEYOND
    taylor = [mpf_of(c, context) for c in field.taylor(p, Fraction(1), count)[:count]]
    h = endpoint_coefficients(taylor, count)
    return truncations_beside(mpf_of(p, context), height, h, zeros, digits, context)


def truncations_beside(
    at: mpf,
    height: mpf,
    h: list[Any],
    zeros: list[CriticalPoint],
    digits: int,
    context: MPContext,
) -> list[Truncation]:
    """Truncations at a point with h_1, h_2, ... there, as many as there are terms."""
    zeros = sorted(zeros, key=lambda z: z.u)
    first = sum(1 for z in zeros if z.u < at)
    rows = []
    for k, toward in ((first - 1, 1), (first, -1)):
        if 0 <= k < len(zeros):
            beside, behind = (
                zeros[j] if 0 <= j < len(zeros) else None for j in (k + toward, k - toward)
            )
            one = _Neighbours(zeros[k], beside, behind, at, height)
            rows.append(_cut(one, h, len(h), digits, context))
    return rows


class _Neighbours(NamedTuple):
    """A zero, those next to it on p's side and on the other, and p with V there."""

    zero: CriticalPoint
    beside: CriticalPoint | None
    behind: CriticalPoint | None
    at: Any
    height: Any

    def behind_ratio(self) -> Any:
        """The change of V from the zero to that behind it, over that to p, times a constant."""
        return None if self.behind is None else self._ratio(_rise(self.zero), self.behind)

    def beside_ratio(self) -> Any:
        """The same from p to the zero beyond it."""
        return None if self.beside is None else self._ratio(self.height, self.beside)

    def _ratio(self, height: mpf, other: CriticalPoint) -> Any:
        """The change of V from `height` to another zero, in the same units."""
        return BLENDING * abs(height - _rise(other)) / abs(self.height - _rise(self.zero))


def _rise(point: CriticalPoint) -> Any:
    """V there, from the start."""
    return -point.height if point.kind == "well" else point.height


def _cut(
    point: _Neighbours, h: list[Any], count: int, digits: int, context: MPContext
) -> Truncation:
    """The Gaussian of one zero truncated at p, with h_k at p for what is analytic."""
    c, zero = context, point.zero
    barrier = zero.kind == "barrier"
    rise = _rise(zero)
    t = c.sqrt(2 * abs(rise - point.height)) * (1 if point.at > zero.u else -1)
    root = c.sqrt(2 * c.pi)
    known = zero.series.parts[0].coefficients
    whole = [a / root for a in (*known, *[c.zero] * (count - len(known)))]
    # As another zero comes near, this one's own series breaks down, and nothing is to be
    # corrected. The fades leave no trace in any order of 1/lam, since the corrections are of a
    # higher order anyway where they set in; they set in faster than any power.
    beside, behind = (
        [_blending(n, ratio, c) for n in range(count)]
        for ratio in (point.beside_ratio(), point.behind_ratio())
    )
    peak = [a * f * g for a, f, g in zip(whole, beside, behind, strict=True)]
    sigma_series = product(peak, sigma_terms(t, count, c), count)
    formal = [(-1) ** k * y if barrier else -y for k, y in enumerate(h)]
    series = [(y - z) * f for y, z, f in zip(formal, sigma_series, beside, strict=True)]
    weight = beside[-1] * behind[-1]
    return Truncation(
        barrier, zero.u, point.height, rise, t, peak, whole, weight, series, digits, {}
    )


def _blending(n: int, ratio: mpf | None, context: MPContext) -> Any:
    """The blending weight of the n-th coefficient: P(n + 2, ratio), 1 where no zero is near."""
    return context.one if ratio is None else context.gammainc(n + 2, 0, ratio, True)


# -- at one lam ------------------------------------------------------------------------------------


def dawson_terms(t: mpf, count: int, context: MPContext) -> list[Any]:
    """D = sum of these times lam^-(m+1)."""
    return [context.fac2(2 * m - 1) / t ** (2 * m + 1) for m in range(count)]


def sigma_terms(t: mpf, count: int, context: MPContext) -> list[Any]:
    """sigma = sum of these times lam^-(m+1)."""
    return [(-1) ** m * y for m, y in enumerate(dawson_terms(t, count, context))]


def corrections(
    truncation: Truncation, share: tuple[Any, Any] | None, lam: mpf, order: int, context: MPContext
) -> Corrections:
    """Corrections of the sums at one lam for a zero near a point.

    `share` is what the sums take for the zero's Gaussian, over e^{+-lam rise}, with the weight of
    its difference to the Laplace series; None if there is none.
    """
    c, terms = context, order + 1
    if lam not in truncation.known:
        with c.workdps(truncation.digits):
            truncation.known[lam] = _functions(truncation, lam, c)
    functions = truncation.known[lam]
    sign = 1 if truncation.barrier else -1
    down = [(-1) ** n * a for n, a in enumerate(truncation.peak)]
    back = [(-1) ** k * b for k, b in enumerate(truncation.series)]
    weights = product(truncation.peak, down, terms)
    a, a_down = (power_sum(row[:terms], lam) for row in (truncation.peak, down))
    if share is not None:
        own = power_sum(truncation.whole[:terms], lam)
        a += share[1] * (share[0] * c.sqrt(lam / (2 * c.pi)) - own)

    def formal(row: list[Any], over: int = 0) -> Truncated:
        """The row over lam^over, 0 or 1; with sigma or D, which are over lam, to lam^-terms."""
        nothing = [0 * lam]
        return Truncated([*nothing * over, *row[:terms], *nothing * (1 - over)], terms + 1)

    rows: dict[str, tuple[Any, Any]] = {
        "a": (a, formal(truncation.peak)),
        "a_down": (a_down, formal(down)),
        "tail": (functions.sigma, formal(sigma_terms(truncation.t, terms, c), 1)),
        "dawson": (functions.dawson, formal(dawson_terms(truncation.t, terms, c), 1)),
        "integral": (functions.area, formal(_log_series(truncation.t, terms, sign, c), 1)),
    }
    formula: Callable[..., Any] = barrier_truncated if truncation.barrier else well_truncated
    if truncation.barrier:
        rows["b"] = power_sum(truncation.series[:terms], lam) / lam, formal(truncation.series, 1)
        rows["weights"] = power_sum(weights, lam), formal(weights)
    else:
        rows["b_down"] = power_sum(back[:terms], lam) / lam, formal(back, 1)
        # All orders of both: what is lost at the zero is a product as well.
        rows["weights"] = a * a_down, formal(weights)
    exact, series = (formula(**{name: row[k] for name, row in rows.items()}) for k in (0, 1))
    scale, speed, regular = (
        value - power_sum(expansion.c, lam) for value, expansion in zip(exact, series, strict=True)
    )
    up, low = c.exp(lam * truncation.height), c.exp(-lam * truncation.height)
    return Corrections(up * scale, low * speed, regular)


def _log_series(t: mpf, terms: int, sign: int, context: MPContext) -> list[Any]:
    """The series of the integral of D (sign 1) or sigma (-1), times lam."""
    rest = [-context.fac2(2 * m - 1) * sign**m / (2 * m * t ** (2 * m)) for m in range(1, terms)]
    return [context.log(abs(t)), *rest]


class _Functions(NamedTuple):
    """sigma, D, and the integral of sigma or D, less the constant of its series."""

    sigma: Any
    dawson: Any
    area: Any


def _functions(truncation: Truncation, lam: mpf, context: MPContext) -> _Functions:
    """sigma, D and their integrals at one lam (DLMF 7.2, 7.8)."""
    c = Digits(context)
    x = abs(truncation.t) * c.sqrt(lam / 2)
    side = 1 if truncation.t > 0 else -1
    values = dawson(x, c)
    area = values.area if truncation.barrier else erfcx_area(x, c)
    sigma, d, area = gaussians(c, lam, values.erfcx, values.value, area)
    return _Functions(side * sigma, side * d, area / lam)


def power_sum(c: list[Any], lam: mpf) -> Any:
    """sum c_k lam^-k."""
    return sum((x * lam**-k for k, x in enumerate(c)), 0 * lam)
