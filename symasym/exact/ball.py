"""Proved enclosures of the exact integrals, in Arb's ball arithmetic.

Every function returns a ``flint.arb`` that contains the value: rounding is
enclosed by Arb, truncation of every series by a Cauchy estimate whose maximum
is itself bounded in ball arithmetic.

The double integrals are carried panel by panel from an absorbing end (or from
the tail at infinity) to the point asked for. With s(u) = e^{lam V(u)}, what is
carried is

    S(x) = int_{-r}^x e^{lam (V(w) - V(x))} dw,
    Y(x) = lam int_{-r}^x e^{-lam V(u)} int_{-r}^u e^{lam V(w)} dw du,

and the same from the other end in mirrored coordinates. Both obey linear
updates with positive terms only, so that no digit cancels and a ball's radius
grows additively, not geometrically, with the number of panels.

Needs python-flint, which is imported on first use.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from symasym.errors import AccuracyError, InputError, RegionError
from symasym.exact.ball_drift import Profile, exact_ball, flint_module, precision, profile_of
from symasym.generated import plain_formulas

__all__ = [
    "available",
    "escape_time",
    "exit_probability",
    "occupation",
    "stationary_density",
    "to_mpf",
]

_ONE = Fraction(1)
_LOG2_10 = 3.3219280948873626

# Cauchy circles have this many times the panel's half-length, so that a Taylor coefficient gains
# log2(6) = 2.6 bits an order, and a pole may be as near as 6 half-lengths. Between 4 and 8 the
# time is flat.
_RATIO = 6
_LOG_RATIO = 1.791759469228055

# log max |e^{lam(V(z) - V(centre))}| on the circle, per bit of precision. Larger means fewer
# panels of more terms, and more cancellation within a series; 0.35 is the measured optimum,
# flat within a factor 1.5 either way, for 15 to 100 digits.
_GROWTH_PER_BIT = 0.35

# A panel narrower than this fraction of its piece means that A has no finite bound there.
_NARROWEST = Fraction(1, 2**80)

# Panels x terms x 64-bit words, on either side of the start. A unit takes 1 to 2 microseconds for
# a polynomial and up to _ANALYTIC times that for another drift: this is about 10 seconds.
_MOST_WORK = 7_000_000
_ANALYTIC = 3

_ATTEMPTS = 8


def available() -> bool:
    """Whether python-flint can be imported, which everything else here needs."""
    try:
        import flint  # noqa: F401
    except ImportError:
        return False
    return True


def escape_time(
    drift: Any, kappa: Fraction, r: Fraction, start: Fraction, dps: int, *, log: bool = False
) -> Any:
    """Mean time to leave (-r, r) from `start` (eq:Ttilde), proved.

    Parameters
    ----------
    drift : symasym.Drift
        With scalar parameters, all bound.
    kappa, r, start : Fraction
        Scaled noise amplitude, escape radius and starting point.
    dps : int
        The relative radius of the result is at most 10^-dps.
    log : bool
        Enclose the natural logarithm instead (see `Notes`).

    Returns
    -------
    flint.arb
        A ball that contains the value.

    Raises
    ------
    AccuracyError
        If the noise is so weak that more panels are needed than is reasonable.

    Notes
    -----
    A logarithm that is 0, or that is smaller than 10^-dps, is enclosed with an absolute
    radius of 10^-2dps.
    """
    _check_escape(kappa, r, start)

    def compute() -> Any:
        left, right = _both_sides(drift, kappa, r, start, moments="SY")
        time = plain_formulas.escape_time_of_products(
            left.work, right.work, left.scale, right.scale
        )
        return time.log() if log else time

    return _refine(compute, dps, scale=_lam(kappa) * (1 + r), may_vanish=log)


def exit_probability(
    drift: Any,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
    complement: bool = False,
    *,
    log: bool = False,
) -> Any:
    """Probability C of leaving (-r, r) through -r (eq:C), proved; through r if `complement`.

    Parameters and errors are those of `escape_time`.

    Returns
    -------
    flint.arb
        A ball that contains the value.
    """
    _check_escape(kappa, r, start)

    def compute() -> Any:
        left, right = _both_sides(drift, kappa, r, start, moments="S")
        if complement:
            left, right = right, left
        # Arb's logarithms are methods of its balls, which no emitted code calls.
        if log:
            return -(left.scale / right.scale).log1p()
        return plain_formulas.exit_share(left.scale, right.scale)

    return _refine(compute, dps, scale=_lam(kappa) * (1 + r))


def occupation(
    drift: Any, kappa: Fraction, dps: int, complement: bool = False, *, log: bool = False
) -> Any:
    """Stationary probability P of the layer, -1 <= u <= 1 (eq:P), proved; 1 - P if `complement`.

    Parameters
    ----------
    drift : symasym.Drift
        Of the sliding region: a- > 0 > a+.
    kappa : Fraction
        Scaled noise amplitude.
    dps : int
        The relative radius of the result is at most 10^-dps.
    complement : bool
        Give 1 - P, without cancellation.
    log : bool
        Enclose the natural logarithm instead.

    Returns
    -------
    flint.arb
        A ball that contains the value.
    """
    _check_noise(kappa)
    lam = _lam(kappa)

    def compute() -> Any:
        profile = profile_of(drift)
        a_minus, a_plus = _sliding_slopes(profile)
        inside, weight = (
            exact_ball(Fraction(0)),
            exact_ball(_ONE),
        )  # weight: e^{-lam V} at the panel's start
        for panel in _panels(profile, lam, -_ONE, _ONE):
            inside += weight * panel.minus
            weight /= panel.growth
        tails = plain_formulas.tail_left(a_minus) + weight * plain_formulas.tail_right(a_plus)
        outside = tails / exact_ball(lam)
        wanted, rest = (outside, inside) if complement else (inside, outside)
        return -(rest / wanted).log1p() if log else plain_formulas.occupation_share(wanted, rest)

    return _refine(compute, dps, scale=lam)


def stationary_density(
    drift: Any, kappa: Fraction, y: Fraction, dps: int, *, log: bool = False
) -> Any:
    """Stationary probability density at `y` (eq:pss, normalised), proved.

    Parameters
    ----------
    drift : symasym.Drift
        Of the sliding region: a- > 0 > a+.
    kappa, y : Fraction
        Scaled noise amplitude and position.
    dps : int
        The relative radius of the result is at most 10^-dps.
    log : bool
        Enclose the natural logarithm instead.

    Returns
    -------
    flint.arb
        A ball that contains the value.
    """
    _check_noise(kappa)
    lam = _lam(kappa)

    def compute() -> Any:
        profile = profile_of(drift)
        _sliding_slopes(profile)
        mass = _mass_before(profile, lam, y) + _mass_before(profile.mirrored(), lam, -y)
        # `mass` is w/lam.
        return -mass.log() if log else plain_formulas.density_of_halves(1, mass)

    return _refine(compute, dps, scale=lam * (1 + abs(y)), may_vanish=log)


def to_mpf(ball: Any, dps: int) -> tuple[Any, Any]:
    """Midpoint, rounded to `dps` digits, and a radius that covers the rounding as well.

    Parameters
    ----------
    ball : flint.arb
        A finite enclosure.
    dps : int
        Decimal digits of the midpoint.

    Returns
    -------
    tuple of mpf
        ``(mid, rad)`` such that [mid - rad, mid + rad] contains the ball. The precision
        of mpmath's global context is neither used nor changed.
    """
    import mpmath
    from mpmath import libmp

    if not ball.is_finite():
        raise AccuracyError("the ball is not finite and has no midpoint; enclose the value first.")

    def exact(number: Any) -> Any:
        mantissa, exponent = number.man_exp()
        return libmp.from_man_exp(int(mantissa), int(exponent))

    center = exact(ball.mid())
    rounded = libmp.mpf_pos(center, libmp.dps_to_prec(dps), "n")
    # Differences without a precision are exact in libmp; only the sum of the two errors rounds.
    shift = libmp.mpf_abs(libmp.mpf_sub(center, rounded))
    radius = libmp.mpf_add(exact(ball.rad()), shift, 53, "u")
    return mpmath.mp.make_mpf(rounded), mpmath.mp.make_mpf(radius)


# -- arguments ---------------------------------------------------------------------------------


def _lam(kappa: Fraction) -> Fraction:
    return 2 / kappa**2


def _check_noise(kappa: Fraction) -> None:
    if kappa <= 0:
        raise InputError(f"kappa is {kappa}; it must be greater than 0.")


def _check_escape(kappa: Fraction, r: Fraction, start: Fraction) -> None:
    _check_noise(kappa)
    if r <= 0:
        raise InputError(f"r is {r}; it must be greater than 0.")
    if not -r < start < r:
        raise InputError(f"start is {start}; it must lie between -r and r, which is {r}.")


def _sliding_slopes(profile: Profile) -> tuple[Any, Any]:
    """a- and a+; `_Undecided` where their signs need more precision."""
    a_minus, a_plus = profile.value(-_ONE), profile.value(_ONE)
    if a_minus <= 0 or a_plus >= 0:
        raise RegionError(
            f"a- is {a_minus.str(6)} and a+ is {a_plus.str(6)}, so that there is no stationary "
            "state; choose a drift with a- > 0 > a+."
        )
    if a_minus > 0 and a_plus < 0:
        return a_minus, a_plus
    raise _Undecided


# -- precision ---------------------------------------------------------------------------------


class _Undecided(Exception):
    """A sign could not be told at this precision."""


def _refine(
    compute: Callable[[], Any], dps: int, *, scale: Fraction, may_vanish: bool = False
) -> Any:
    """`compute()` at rising precision, until the ball is narrow enough."""
    # The sum of a panel's alternating series cancels 2 _GROWTH_PER_BIT/(_RATIO log 2), a sixth, of
    # the bits, and e^{lam V} loses as many as its exponent has before the point.
    bits = int(dps * _LOG2_10 * 1.2) + 35 + int(scale).bit_length()
    for _ in range(_ATTEMPTS):
        with precision(bits):
            try:
                value = compute()
                missing = _missing_bits(value, dps, may_vanish)
            except _Undecided:
                missing = bits
        if missing <= 0:
            return value
        bits += min(missing, bits) + 10
    raise AccuracyError(
        f"no ball of relative radius 1e-{dps} was found with {bits} bits; "
        "ask for fewer digits, or for dps without a ball."
    )


def _missing_bits(value: Any, dps: int, may_vanish: bool) -> int:
    """Bits by which the ball is too wide; 0 if it is good."""
    if not value.is_finite():
        return 1 << 62
    flint = flint_module()
    allowed = value.abs_lower() * flint.arb(10) ** -dps
    if may_vanish:
        # A value that may be 0, as log 1 is, has no relative accuracy.
        allowed = allowed.max(flint.arb(10) ** (-2 * dps))
    radius = value.rad()
    if radius <= allowed:
        return 0
    if not allowed > 0:
        return 1 << 62
    return int(float((radius / allowed).log().upper()) * 1.45) + 1


# -- panels --------------------------------------------------------------------------------------


@dataclass
class _Outer:
    """A stretch of constant drift a; growth and integrals as in `_Panel`, in closed form."""

    slope: Any
    lam: Fraction
    length: Fraction

    @cached_property
    def _exponent(self) -> Any:
        return self.slope * exact_ball(self.lam * self.length)

    @cached_property
    def growth(self) -> Any:
        return (-self._exponent).exp()

    @cached_property
    def plus(self) -> Any:
        return exact_ball(self.length) * _exp_quotient(-self._exponent, 1)

    @cached_property
    def minus(self) -> Any:
        return exact_ball(self.length) * _exp_quotient(self._exponent, 1)

    @cached_property
    def nested(self) -> Any:
        return exact_ball(self.length**2) * _exp_quotient(self._exponent, 2)


def _exp_quotient(x: Any, order: int) -> Any:
    """(e^x - 1)/x, or (e^x - 1 - x)/x^2 for order 2, also where x is or contains 0."""
    flint = flint_module()
    if not abs(x) < 2:
        return x.expm1() / x if order == 1 else (x.expm1() - x) / (x * x)
    # Sum of x^k/(k + order)!; what is left out is below |x|^n/(n + order)! e^|x|.
    terms = flint.ctx.prec // 2 + 8
    term = 1 / flint.arb(order).fac()
    total = flint.arb(0)
    for k in range(terms):
        total += term
        term *= x / (k + 1 + order)
        if abs(term) < flint.arb(2) ** (-flint.ctx.prec - 10):
            break
    return total + flint.arb(0, abs(term) * abs(x).exp())


@dataclass
class _Panel:
    """Taylor models of e^{+-lam(V - V(centre))} on a panel of half-length h, in t = (u - c)/h.

    `slope_bound` bounds lam h |A| on the circle |t| = _RATIO, so that the exponent
    and hence the functions are bounded there, which is all that Cauchy's estimate
    of the coefficients beyond `terms` needs.
    """

    profile: Profile
    lam: Fraction
    center: Fraction
    half: Fraction
    slope_bound: Any
    terms: int

    @cached_property
    def _exponent(self) -> Any:
        """lam (V - V(centre)), a series in t."""
        flint = flint_module()
        flint.ctx.cap = self.terms
        series = self.profile.series(self.center, self.half, self.terms)
        return (-exact_ball(self.lam * self.half)) * series.integral()

    def _complete(self, series: Any) -> Any:
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
        left, right = _at_ends(self._complete(self._exponent))
        finite = self.profile.terms()
        if finite is not None and finite < self.terms:
            return left, right  # the exponent is a polynomial: nothing was cut off
        cut = self._tail(self.slope_bound * _RATIO)
        return left + cut, right + cut

    def _tail(self, bound: Any) -> Any:
        """What terms - 1 Taylor terms leave out on |t| <= 1 of a function below `bound`.

        One term fewer than were computed, because `integral` drops the last one.
        """
        flint = flint_module()
        ratio = flint.arb(_RATIO)
        return flint.arb(0, bound * ratio ** (1 - self.terms) / (1 - 1 / ratio))

    @cached_property
    def _rising(self) -> Any:
        return self._exponent.exp()

    @cached_property
    def _falling(self) -> Any:
        return (-self._exponent).exp()

    @cached_property
    def _exp_tail(self) -> Any:
        return self._tail((self.slope_bound * _RATIO).exp())

    @cached_property
    def growth(self) -> Any:
        """e^{lam(V(b) - V(a))} for the panel [a, b]."""
        left, right = self._ends
        return (right - left).exp()

    @cached_property
    def plus(self) -> Any:
        """Integral over the panel of e^{lam(V - V(a))}."""
        integral = _over_panel(self._complete(self._rising)) + 2 * self._exp_tail
        return exact_ball(self.half) * (-self._ends[0]).exp() * integral

    @cached_property
    def minus(self) -> Any:
        """Integral over the panel of e^{-lam(V - V(a))}."""
        integral = _over_panel(self._complete(self._falling)) + 2 * self._exp_tail
        return exact_ball(self.half) * self._ends[0].exp() * integral

    @cached_property
    def nested(self) -> Any:
        """Integral of e^{lam(V(w) - V(x))} over a < w < x < b."""
        flint = flint_module()
        flint.ctx.cap = self.terms
        running = self._rising.integral()
        running = running - (_at_ends(running)[0] + self._exp_tail)
        product = self._complete(self._falling * running)
        # On the disk the path from -1 to t is straight and at most _RATIO + 1 long.
        reach = _RATIO + 1
        bound = reach * (self.slope_bound * reach).exp()
        return exact_ball(self.half**2) * (_over_panel(product) + 2 * self._tail(bound))


def _at_ends(series: Any) -> tuple[Any, Any]:
    """A series as a polynomial, at -1 and 1."""
    zero = flint_module().arb(0)
    coefficients = series.coeffs()
    even, odd = sum(coefficients[::2], zero), sum(coefficients[1::2], zero)
    return even - odd, even + odd


def _over_panel(series: Any) -> Any:
    """Integral from -1 to 1 of a series, its last term left out."""
    return 2 * sum(series.integral().coeffs()[1::2], flint_module().arb(0))


def _panels(profile: Profile, lam: Fraction, a: Fraction, b: Fraction) -> list[_Panel]:
    """[a, b] cut until the exponent's growth on each panel's circle is what the precision likes."""
    flint = flint_module()
    bits = flint.ctx.prec
    most_growth = _GROWTH_PER_BIT * bits
    terms = _terms(bits, most_growth, profile.terms())
    slowness = _ANALYTIC if profile.terms() is None else 1
    most_panels = max(16, _MOST_WORK // (slowness * terms * (bits // 64 + 1)))
    _refuse_hopeless(profile, lam, a, b, most_panels * most_growth)
    waiting, found = [(a, b)], list[_Panel]()
    narrowest = (b - a) * _NARROWEST
    while waiting:
        left, right = waiting.pop()
        center, half = (left + right) / 2, (right - left) / 2
        slope_bound = exact_ball(lam * half) * profile.bound(center, _RATIO * half)
        if slope_bound * _RATIO < most_growth:
            found.append(_Panel(profile, lam, center, half, slope_bound, terms))
            continue
        if half < narrowest:
            raise AccuracyError(
                f"no proved bound of A was found near u = {float(center):.6g}, where it may not "
                "be analytic; ask for dps without a ball."
            )
        if len(found) + len(waiting) >= most_panels:
            raise _too_much_work(lam)
        waiting += [(center, right), (left, center)]
    return found


def _refuse_hopeless(
    profile: Profile, lam: Fraction, a: Fraction, b: Fraction, most_growth: float
) -> None:
    """Raise early where counting panels would take seconds: from the variation of lam V."""
    samples = 32
    if lam * samples < most_growth:
        return
    step = (b - a) / samples
    size = sum(abs(profile.value(a + step * (k + Fraction(1, 2)))) for k in range(samples))
    # On a panel, growth on the circle is at least _RATIO times the mean over half of it.
    if size * exact_ball(lam * step) * _RATIO > 2.2 * most_growth:
        raise _too_much_work(lam)


def _terms(bits: int, growth: float, finite: int | None) -> int:
    """Taylor terms for which the largest of the tails is below 2^-bits, relatively."""
    # The nested integral's bound is e^{growth (1 + 1/_RATIO)}; its value may be as small as
    # the function's smallest, e^{-2 growth/_RATIO}.
    nats = bits * 0.6931472 + growth * (1 + 3 / _RATIO) + 5
    needed = int(nats / _LOG_RATIO) + 2
    return needed if finite is None else max(needed, finite + 2)


def _too_much_work(lam: Fraction) -> AccuracyError:
    return AccuracyError(
        f"at lam = 2/kappa^2 = {exact_ball(lam).str(4, radius=False)} and "
        f"{flint_module().ctx.prec} bits a "
        "proved ball would take well over 10 seconds; ask for dps without a ball, or for fewer "
        "digits."
    )


# -- from one end to a point ---------------------------------------------------------------------


@dataclass
class _Side:
    """S and Y (see the module's text) at the point reached."""

    scale: Any
    work: Any


def _both_sides(
    drift: Any, kappa: Fraction, r: Fraction, start: Fraction, moments: str
) -> tuple[_Side, _Side]:
    profile, lam = profile_of(drift), _lam(kappa)
    # Both are cut before either is integrated, so that too much work is refused at once.
    left = _pieces(profile, lam, -r, start)
    right = _pieces(profile.mirrored(), lam, -r, -start)
    return _carried(left, lam, moments), _carried(right, lam, moments)


def _carried(pieces: list[_Outer | _Panel], lam: Fraction, moments: str) -> _Side:
    """S and, if asked for, Y from the absorbing end to the end of the last piece."""
    side = _Side(exact_ball(Fraction(0)), exact_ball(Fraction(0)))
    factor = exact_ball(lam)
    for panel in pieces:
        if "Y" in moments:
            side.work += factor * (side.scale * panel.minus + panel.nested)
        side.scale = (side.scale + panel.plus) / panel.growth
    return side


def _pieces(profile: Profile, lam: Fraction, a: Fraction, b: Fraction) -> list[_Outer | _Panel]:
    """The panels of [a, b], a < 1, from left to right, the outer ones in one piece."""
    pieces: list[_Outer | _Panel] = []
    if a < -1:
        pieces.append(_Outer(profile.value(-_ONE), lam, min(-_ONE, b) - a))
    inner = max(a, -_ONE), min(b, _ONE)
    if inner[0] < inner[1]:
        pieces += _panels(profile, lam, *inner)
    if b > 1:
        pieces.append(_Outer(profile.value(_ONE), lam, b - 1))
    return pieces


def _mass_before(profile: Profile, lam: Fraction, y: Fraction) -> Any:
    """Integral over u < y of e^{lam(V(y) - V(u))}, for a drift that points inwards on the left."""
    # From -infinity to the first corner, or to y if that comes first, it is 1/(lam a-).
    mass = plain_formulas.tail_left(profile.value(-_ONE)) / exact_ball(lam)
    for panel in _pieces(profile, lam, -_ONE, y):
        mass = panel.growth * (mass + panel.minus)
    return mass
