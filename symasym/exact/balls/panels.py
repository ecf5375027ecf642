"""Panels in ball arithmetic: the integrals of e^{+-lam V} over a short stretch, proved.

A Taylor model of the exponential is summed by Arb, and what it leaves out is
bounded by Cauchy's estimate on a circle about the panel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from operator import mul
from typing import TYPE_CHECKING, Any

from symasym.base.call_context import step
from symasym.base.errors import AccuracyError
from symasym.exact.sweep import Deferred, Record
from symasym.numbers.balls import Profile, exact_ball, flint_module
from symasym.special.exponentials import ball_quotient

if TYPE_CHECKING:
    from flint import arb, arb_series

# Cauchy circles have this many times the panel's half-length, so that a Taylor coefficient gains
# log2(6) = 2.6 bits an order, and a pole may be as near as 6 half-lengths. Between 4 and 8 the
# time is flat.
RATIO = 6
_LOG_RATIO = 1.791759469228055

# log max |e^{lam(V(z) - V(centre))}| on the circle, per bit of precision. Larger means fewer
# panels of more terms, and more cancellation within a series; 0.35 is the measured optimum,
# flat within a factor 1.5 either way, for 15 to 100 digits.
_GROWTH_PER_BIT = 0.35

# Coefficients of A up to which the recurrence of `nested` beats a product of series.
_SHORT = 12

# A panel narrower than this fraction of its piece means that A has no finite bound there.
_NARROWEST = Fraction(1, 2**80)

# Panels x terms x 64-bit words, on either side of the start. A unit takes 1 to 2 microseconds for
# a polynomial and up to _ANALYTIC times that for another drift: this is about 10 seconds.
_MOST_WORK = 7_000_000
_ANALYTIC = 3


class Piece:
    """A stretch [a, b] of a sweep, in balls, which have no bounds: its numbers unscaled."""

    growth: Any
    """e^{lam(V(b) - V(a))}"""
    plus: Any
    """Integral of e^{lam(V - V(a))}."""
    minus: Any
    """Integral of e^{-lam(V - V(a))}."""
    nested: Any
    """Integral of e^{lam(V(w) - V(x))} over a < w < x < b."""
    drift_at_left: Any
    """A(a)"""

    @property
    def ceiling(self) -> Any:
        """More than `nested`, which is most of the work, and which few panels' digits show."""
        return self.plus * self.minus

    @property
    def enclosure(self) -> Any:
        """An enclosure of `nested` that takes no work."""
        return self.ceiling.union(0)

    def record(self) -> Record:
        """Its numbers for a sweep."""
        flint = flint_module()
        nested = Deferred(
            lambda: self.growth * self.nested,
            lambda: self.growth * self.ceiling,
            flint.arb(2) ** (-flint.ctx.prec - 10),
            lambda: self.growth * self.enclosure,
        )
        plus, minus = Deferred(lambda: self.plus), Deferred(lambda: self.growth * self.minus)
        return Record(plus, minus, nested, self.growth, 1)


@dataclass
class Outer(Piece):
    """A stretch of constant drift a, in closed form."""

    slope: Any
    lam: Fraction
    length: Fraction

    @property
    def drift_at_left(self) -> Any:
        """a"""
        return self.slope

    @cached_property
    def _exponent(self) -> Any:
        """lam a length."""
        return self.slope * exact_ball(self.lam * self.length)

    @cached_property
    def growth(self) -> Any:
        """e^-x, x = lam a length."""
        return (-self._exponent).exp()

    @cached_property
    def plus(self) -> Any:
        """length phi_1(-x) (Hochbruck and Ostermann 2010)."""
        return exact_ball(self.length) * ball_quotient(-self._exponent, 1)

    @cached_property
    def minus(self) -> Any:
        """length phi_1(x)."""
        return exact_ball(self.length) * ball_quotient(self._exponent, 1)

    @cached_property
    def nested(self) -> Any:
        """length^2 phi_2(x)."""
        return exact_ball(self.length**2) * ball_quotient(self._exponent, 2)

    def rate(self, up: bool, order: int) -> Any:
        """The derivative of phi_order at x, or where V rises, `up`, at -x, times lam length^order
        and the length."""
        if (up, order) not in self._rates:
            x = -self._exponent if up else self._exponent
            rate = ball_quotient(x, order) - order * ball_quotient(x, order + 1)
            self._rates[up, order] = exact_ball(self.lam * self.length ** (order + 1)) * rate
        return self._rates[up, order]

    @cached_property
    def _rates(self) -> dict[tuple[bool, int], Any]:
        """What `rate` has found."""
        return {}


@dataclass
class Panel(Piece):
    """Taylor models of e^{+-lam(V - V(centre))} on a panel of half-length h, in t = (u - c)/h.

    `slope_bound` bounds lam h |A| on the circle |t| = RATIO, so that the exponent
    and hence the functions are bounded there, which is all that Cauchy's estimate
    of the coefficients beyond `terms` needs.
    """

    profile: Profile
    lam: Fraction
    center: Fraction
    half: Fraction
    slope_bound: Any
    terms: int

    @property
    def drift_at_left(self) -> arb:
        """A(a)"""
        return self.profile.value(self.center - self.half)

    @cached_property
    def _exponent(self) -> Any:
        """lam (V - V(centre)), a series in t."""
        step()
        return self.exponent_of(self.profile)[1]

    @cached_property
    def scale(self) -> Any:
        """lam h"""
        return exact_ball(self.lam * self.half)

    def exponent_of(self, profile: Profile) -> tuple[Any, Any]:
        """A drift as a series in t, and the exponent that it makes."""
        flint_module().ctx.cap = self.terms
        series = profile.series(self.center, self.half, self.terms)
        return series, -self.scale * series.integral()

    def _complete(self, series: arb_series) -> arb_series:
        """`series`, unless coefficients are missing, which would be read as 0."""
        if series.prec < self.terms:
            raise AccuracyError(
                "flint.ctx.cap was changed from outside while a ball was computed; "
                "use flint from one thread at a time."
            )
        return series

    @cached_property
    def _ends(self) -> tuple[Any, Any]:
        """The exponent at t = -1 and t = 1."""
        left, right = _at_ends(self._complete(self._exponent).coeffs())
        finite = self.profile.terms()
        if finite is not None and finite < self.terms:
            return left, right  # the exponent is a polynomial: nothing was cut off
        cut = self._tail(self.slope_bound * RATIO)
        return left + cut, right + cut

    def _tail(self, bound: arb) -> Any:
        """The truncation error of terms - 1 Taylor terms on |t| <= 1, of a function below `bound`.

        One term fewer than were computed, because `integral` drops the last one.
        """
        flint = flint_module()
        return flint.arb(0, bound * _share_beyond(self.terms, flint.ctx.prec))

    @cached_property
    def _exp_series(self) -> Any:
        """e^E, E the exponent."""
        return self._exponent.exp()

    @cached_property
    def _exp_inverse(self) -> Any:
        """e^-E, E the exponent."""
        return (-self._exponent).exp()

    @cached_property
    def _exp_bound(self) -> Any:
        """A bound of e^E and e^-E on the disk."""
        return (self.slope_bound * RATIO).exp()

    @cached_property
    def _exp_tail(self) -> Any:
        """The truncation error of e^E and e^-E on the panel."""
        return self._tail(self._exp_bound)

    @cached_property
    def _from_left(self) -> Any:
        """What turns the integral over t of e^E into that over u of e^{lam(V - V(a))}."""
        return exact_ball(self.half) * (-self._ends[0]).exp()

    @cached_property
    def _inverse_from_left(self) -> Any:
        """The same of e^-E."""
        return exact_ball(self.half) * self._ends[0].exp()

    @cached_property
    def growth(self) -> Any:
        """e^{lam(V(b) - V(a))} for the panel [a, b]."""
        left, right = self._ends
        return (right - left).exp()

    @cached_property
    def plus(self) -> Any:
        """Integral over the panel of e^{lam(V - V(a))}."""
        integral = _over_panel(self._complete(self._exp_series)) + 2 * self._exp_tail
        return self._from_left * integral

    @cached_property
    def minus(self) -> Any:
        """Integral over the panel of e^{-lam(V - V(a))}."""
        integral = _over_panel(self._complete(self._exp_inverse)) + 2 * self._exp_tail
        return self._inverse_from_left * integral

    @cached_property
    def nested(self) -> Any:
        """Integral of e^{lam(V(w) - V(x))} over a < w < x < b."""
        return exact_ball(self.half**2) * (
            _over_panel(self._following) + 2 * self._tail(self._nested_bound)
        )

    @property
    def _nested_bound(self) -> Any:
        """A bound of m and M on the disk."""
        # The path from an end to t is straight and at most RATIO + 1 long.
        reach = RATIO + 1
        return reach * (self.slope_bound * reach).exp()

    @cached_property
    def _following(self) -> Any:
        """m(t) = int_{-1}^t e^{E(w) - E(t)} dw."""
        return self._solution(self._exp_series, self._exp_inverse, -1)

    @cached_property
    def _difference(self) -> Any:
        """M - m, M(t) = int_t^1 e^{E(t) - E(x)} dx."""
        return -(self._solution(self._exp_inverse, self._exp_series, 1) + self._following)

    def _solution(self, inside: arb_series, outside: arb_series, end: int) -> Any:
        """`outside` times the integral of its reciprocal, `inside`, from one `end` to t.

        It solves y' = 1 + end E' y. Where E' has few coefficients this takes a few multiplications
        a term, and the product of the two series several times that.
        """
        flint = flint_module()
        flint.ctx.cap = self.terms
        running = self._complete(inside).integral()
        start = -(_at_ends(running.coeffs())[end > 0] + self._exp_tail)
        degree = self.profile.terms()
        if degree is None or degree > _SHORT:
            return self._complete(outside * (running + start))
        slopes = (end * self._complete(self._exponent).derivative()).coeffs()
        y = [start, 1 + slopes[0] * start if slopes else 1 + 0 * start]
        width = len(slopes)
        for k in range(1, self.terms - 1):
            recent = y[-1 : -width - 1 : -1]
            y.append(sum(map(mul, slopes, recent)) / (k + 1))
        return flint.arb_series(y, self.terms)

    def moments(self, name: str, count: int) -> list[Any]:
        """Integrals over the panel of t^k times one of the series, k < `count` or more."""
        known = self._moments.get(name, [])
        if len(known) < count:
            flint = flint_module()
            flint.ctx.cap = self.terms
            c = self._complete(getattr(self, name)).coeffs()
            # As many as a change by kappa takes.
            known = [flint.arb(0)] * max(count, (self.profile.terms() or 0) + 1)
            for odd in (0, 1):
                some = c[odd::2]
                rule = _moments_of_powers(len(known[odd::2]), len(some), odd, flint.ctx.prec)
                known[odd::2] = (rule * flint.arb_mat(len(some), 1, some)).entries()
            self._moments[name] = known
        return known

    @cached_property
    def _moments(self) -> dict[str, list[Any]]:
        """The `moments` by the name of the series."""
        return {}


class OuterSlope:
    """The change of an `Outer` whose drift changes at the rate `slope`, per unit of a parameter.

    `growth` is the relative change, the others are those of the integrals.
    """

    def __init__(self, outer: Outer, slope: arb) -> None:
        self._outer, self._slope = outer, slope

    @property
    def growth(self) -> Any:
        return -self._slope * exact_ball(self._outer.lam * self._outer.length)

    @property
    def plus(self) -> Any:
        return -self._slope * self._outer.rate(True, 1)

    @property
    def minus(self) -> Any:
        return self._slope * self._outer.rate(False, 1)

    @property
    def nested(self) -> Any:
        return self._slope * self._outer.rate(False, 2)


class EndSlope:
    """The same of a piece whose left end, where `rate` is lam A, moves outwards."""

    def __init__(self, piece: Piece, rate: arb) -> None:
        self._piece = piece
        self.growth = -rate
        self._rate = rate

    @property
    def plus(self) -> Any:
        """d(int e)/d(end): the integrand at the end, less lam A int e."""
        return 1 - self._rate * self._piece.plus

    @property
    def minus(self) -> Any:
        """d(int 1/e)/d(end): the integrand at the end, and lam A int 1/e."""
        return 1 + self._rate * self._piece.minus

    @property
    def nested(self) -> Any:
        """d(int int e(w)/e(x))/d(end): int 1/e."""
        return self._piece.minus


class PanelSlope:
    """The same of a `Panel` whose drift changes by the one of `profile`, or `rate` times its own.

    In t, the exponent E changes by q. On the panel's circle of radius RATIO, q' is bounded by
    `steep`, and on paths from -1 into it q by RATIO + 1 times that.
    """

    def __init__(self, panel: Panel, profile: Profile | None, rate: Fraction) -> None:
        self._panel = panel
        finite = (profile or panel.profile).terms()
        #: Whether q is a polynomial, of which nothing is cut off.
        self._whole = finite is not None and finite < panel.terms
        if profile is None:
            factor = exact_ball(rate)
            self.steep = abs(factor) * panel.slope_bound
            q = [factor * x for x in panel._exponent.coeffs()]
            left, right = (factor * x for x in panel._ends)
        else:
            series, exponent = panel.exponent_of(profile)
            q = panel._complete(exponent).coeffs()
            if self._whole:
                bound = flint_module().arb(0)
                for c in reversed(series.coeffs()):
                    bound = bound * RATIO + abs(c)
            else:
                bound = profile.bound(panel.center, RATIO * panel.half)
            self.steep = panel.scale * bound
            cut = 0 if self._whole else panel._tail(self.steep * RATIO)
            left, right = (x + cut for x in _at_ends(q))
        self.growth = right - left
        self._q = [(q[0] if q else 0) - left, *q[1:]]
        self._reach = self.steep * (RATIO + 1)

    def _over(self, name: str, bound: Any) -> Any:
        """Integral over the panel of q times one of its series, of a function below `bound`."""
        panel, q = self._panel, self._q
        # The series is cut off, and q where it is no polynomial.
        cuts = 1 if self._whole else 3
        tail = 2 * cuts * panel._tail(bound * self._reach)
        return sum(map(mul, q, panel.moments(name, len(q))), tail)

    @cached_property
    def plus(self) -> Any:
        """int e^E (q - q(-1)), scaled as the integral of the panel."""
        panel = self._panel
        return panel._from_left * self._over("_exp_series", panel._exp_bound)

    @cached_property
    def minus(self) -> Any:
        """-int e^-E (q - q(-1)), scaled as the integral of the panel."""
        panel = self._panel
        return -panel._inverse_from_left * self._over("_exp_inverse", panel._exp_bound)

    @cached_property
    def nested(self) -> Any:
        """Integral of e^{E(w) - E(x)} (q(w) - q(x)) over a < w < x < b, by Fubini's theorem that of
        q (M - m)."""
        panel = self._panel
        return exact_ball(panel.half**2) * self._over("_difference", 2 * panel._nested_bound)


@lru_cache(maxsize=32)
def _share_beyond(terms: int, bits: int) -> Any:
    """sum of RATIO^-k, k >= terms - 1."""
    ratio = flint_module().arb(RATIO)
    return ratio ** (1 - terms) / (1 - 1 / ratio)


@lru_cache(maxsize=32)
def _moments_of_powers(count: int, terms: int, odd: int, bits: int) -> Any:
    """Integrals of t^{2 (j + k + odd)} over [-1, 1], j < count, k < terms, a matrix of `bits`."""
    flint = flint_module()
    each = [flint.arb(2) / (2 * (n + odd) + 1) for n in range(count + terms)]
    return flint.arb_mat([each[j : j + terms] for j in range(count)])


def _at_ends(coefficients: list[arb]) -> tuple[Any, Any]:
    """A polynomial at -1 and 1."""
    zero = flint_module().arb(0)
    even, odd = sum(coefficients[::2], zero), sum(coefficients[1::2], zero)
    return even - odd, even + odd


def _over_panel(series: arb_series) -> arb:
    """Integral from -1 to 1 of a series, its last term left out."""
    return 2 * sum(series.integral().coeffs()[1::2], flint_module().arb(0))


def cut(
    profile: Profile,
    lam: Fraction,
    a: Fraction,
    b: Fraction,
    most: int | None = None,
    changes: Sequence[Profile] = (),
) -> list[Panel]:
    """[a, b] cut until the exponent's growth on each panel's circle is what the precision likes,
    and the `changes` of the drift are bounded there; AccuracyError beyond `most` panels, or where a
    ball would take long."""
    flint = flint_module()
    bits = flint.ctx.prec
    most_growth = _GROWTH_PER_BIT * bits
    terms = _terms(bits, most_growth, profile.terms())
    slowness = _ANALYTIC if profile.terms() is None else 1
    most_panels = max(16, _MOST_WORK // (slowness * terms * (bits // 64 + 1)))
    most_panels = most_panels if most is None else min(most_panels, most)
    _refuse_hopeless(profile, lam, a, b, most_panels * most_growth)
    stretches, narrowest = [(a, b)], (b - a) * _NARROWEST
    # By A alone first: where that takes too many panels, its changes are never asked for.
    for bounded in (changes[:0], changes):
        waiting, panels, stretches = stretches[::-1], list[Panel](), []
        while waiting:
            step()
            left, right = waiting.pop()
            center, half = (left + right) / 2, (right - left) / 2
            disk = center, RATIO * half
            slope_bound = exact_ball(lam * half) * profile.bound(*disk)
            if slope_bound * RATIO < most_growth and all(
                c.bound(*disk).is_finite() for c in bounded
            ):
                panels.append(Panel(profile, lam, center, half, slope_bound, terms))
                stretches.append((left, right))
                continue
            if half < narrowest:
                raise AccuracyError(
                    f"no proved bound of A was found near u = {float(center):.6g}, where it may "
                    "not be analytic; ask for dps without a ball."
                )
            if len(panels) + len(waiting) >= most_panels:
                raise _too_much_work(lam)
            waiting += [(center, right), (left, center)]
        if not changes:
            break
    return panels


def _refuse_hopeless(
    profile: Profile, lam: Fraction, a: Fraction, b: Fraction, most_growth: float
) -> None:
    """Raise early where counting panels would take seconds: from the variation of lam V."""
    samples = 32
    rough = sum(abs(profile.value(x)) for x in (a, (a + b) / 2, b))
    if exact_ball(lam * samples) * (1 + rough) < most_growth:
        return
    step = (b - a) / samples
    size = sum(abs(profile.value(a + step * (k + Fraction(1, 2)))) for k in range(samples))
    # On a panel, growth on the circle is at least RATIO times the mean over half of it.
    if size * exact_ball(lam * step) * RATIO > 2.2 * most_growth:
        raise _too_much_work(lam)


def _terms(bits: int, growth: float, finite: int | None) -> int:
    """Taylor terms for which the largest of the tails is below 2^-bits, relatively."""
    # The nested integral's bound is e^{growth (1 + 1/RATIO)}; its value may be as small as
    # the function's smallest, e^{-2 growth/RATIO}.
    nats = bits * 0.6931472 + growth * (1 + 3 / RATIO) + 5
    needed = int(nats / _LOG_RATIO) + 2
    return needed if finite is None else max(needed, finite + 2)


def _too_much_work(lam: Fraction) -> AccuracyError:
    """The error for a ball that would take too long."""
    return AccuracyError(
        f"at lam = 2/kappa^2 = {exact_ball(lam).str(4, radius=False)} and "
        f"{flint_module().ctx.prec} bits a "
        "proved ball would take well over 10 seconds; ask for dps without a ball, or for fewer "
        "digits."
    )
