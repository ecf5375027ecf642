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
from typing import Any

from symasym.base.errors import AccuracyError, InputError, RegionError
from symasym.exact.ball_panels import Outer, Panel, cut
from symasym.generated import plain_formulas
from symasym.numbers.balls import Profile, exact_ball, flint_module, precision, profile_of

__all__ = [
    "escape_time",
    "exit_probability",
    "occupation",
    "stationary_density",
]

_ONE = Fraction(1)
_LOG2_10 = 3.3219280948873626

_ATTEMPTS = 8


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
    check_escape(kappa, r, start)

    def compute() -> Any:
        left, right = _both_sides(drift, kappa, r, start, moments="SY")
        _add_nested(left, right)
        time = plain_formulas.escape_time_of_products(
            left.work, right.work, left.scale, right.scale
        )
        return time.log() if log else time

    return _refine(compute, dps, scale=large_parameter(kappa) * (1 + r), may_vanish=log)


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
    check_escape(kappa, r, start)

    def compute() -> Any:
        left, right = _both_sides(drift, kappa, r, start, moments="S")
        if complement:
            left, right = right, left
        # Arb's logarithms are methods of its balls, which no emitted code calls.
        if log:
            return -(left.scale / right.scale).log1p()
        return plain_formulas.exit_share(left.scale, right.scale)

    return _refine(compute, dps, scale=large_parameter(kappa) * (1 + r))


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
    lam = large_parameter(kappa)

    def compute() -> Any:
        profile = profile_of(drift)
        a_minus, a_plus = sliding_slopes(profile)
        inside = exact_ball(Fraction(0))
        weight = exact_ball(_ONE)  # e^{-lam V} at the panel's start
        for panel in cut(profile, lam, -_ONE, _ONE):
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
    lam = large_parameter(kappa)

    def compute() -> Any:
        profile = profile_of(drift)
        sliding_slopes(profile)
        mass = _mass_before(profile, lam, y) + _mass_before(profile.mirrored(), lam, -y)
        # `mass` is w/lam.
        return -mass.log() if log else plain_formulas.density_of_halves(1, mass)

    return _refine(compute, dps, scale=lam * (1 + abs(y)), may_vanish=log)


# -- arguments ---------------------------------------------------------------------------------


def large_parameter(kappa: Fraction) -> Fraction:
    return 2 / kappa**2


def _check_noise(kappa: Fraction) -> None:
    if kappa <= 0:
        raise InputError(f"kappa is {kappa}; it must be greater than 0.")


def check_escape(kappa: Fraction, r: Fraction, start: Fraction) -> None:
    _check_noise(kappa)
    if r <= 0:
        raise InputError(f"r is {r}; it must be greater than 0.")
    if not -r < start < r:
        raise InputError(f"start is {start}; it must lie between -r and r, which is {r}.")


def sliding_slopes(profile: Profile) -> tuple[Any, Any]:
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


def refined(
    compute: Callable[[], Any], dps: int, *, scale: Fraction, missing_bits: Callable[[Any], int]
) -> Any:
    """`compute()` at rising precision, until no bits are missing."""
    # The sum of a panel's alternating series cancels a sixth of the bits, 2/(RATIO log 2) times the
    # growth per bit (see `ball_panels`), and e^{lam V} loses as many as its exponent has before the
    # point.
    bits = int(dps * _LOG2_10 * 1.2) + 35 + int(scale).bit_length()
    for _ in range(_ATTEMPTS):
        with precision(bits):
            try:
                value = compute()
                missing = missing_bits(value)
            except _Undecided:
                missing = bits
        if missing <= 0:
            return value
        bits += min(missing, bits) + 10
    raise AccuracyError(
        f"no ball of relative radius 1e-{dps} was found with {bits} bits; "
        "ask for fewer digits, or for dps without a ball."
    )


def _refine(
    compute: Callable[[], Any], dps: int, *, scale: Fraction, may_vanish: bool = False
) -> Any:
    """A ball to `dps` digits."""
    # A value that may be 0, as log 1 is, has no relative accuracy.
    places = 2 * dps if may_vanish else None
    return refined(
        compute, dps, scale=scale, missing_bits=lambda ball: excess_bits(ball, dps, places)
    )


def excess_bits(value: Any, dps: int, places: int | None) -> int:
    """Bits by which a ball is too wide for `dps` digits or, if given, `places`; 0 if it is good."""
    if not value.is_finite():
        return 1 << 62
    flint = flint_module()
    allowed = value.abs_lower() * flint.arb(10) ** -dps
    if places is not None:
        allowed = allowed.max(flint.arb(10) ** -places)
    radius = value.rad()
    if radius <= allowed:
        return 0
    if not allowed > 0:
        return 1 << 62
    return int(float((radius / allowed).log().upper()) * 1.45) + 1


# -- from one end to a point ---------------------------------------------------------------------


@dataclass
class _Side:
    """S and Y (see the module's text) at the point reached.

    Y lacks what each of the pieces in `apart` adds to it, `nested` times lam.
    """

    scale: Any
    work: Any
    lam: Any
    apart: list[Outer | Panel]


def _both_sides(
    drift: Any, kappa: Fraction, r: Fraction, start: Fraction, moments: str
) -> tuple[_Side, _Side]:
    profile, lam = profile_of(drift), large_parameter(kappa)
    # Both are cut before either is integrated, so that too much work is refused at once.
    left = pieces_of(profile, lam, -r, start)
    right = pieces_of(profile.mirrored(), lam, -r, -start)
    return _carried(left, lam, moments), _carried(right, lam, moments)


def _carried(pieces: list[Outer | Panel], lam: Fraction, moments: str) -> _Side:
    """S and, if asked for, Y from the absorbing end to the end of the last piece."""
    nothing = exact_ball(Fraction(0))
    side = _Side(nothing, nothing, exact_ball(lam), pieces if "Y" in moments else [])
    for panel in pieces:
        if "Y" in moments:
            side.work += side.lam * (side.scale * panel.minus)
        side.scale = (side.scale + panel.plus) / panel.growth
    return side


def _add_nested(left: _Side, right: _Side) -> None:
    """Complete Y on both sides.

    The nested integrals are most of the work, and few of them are seen in the last digit: each is
    positive and below the product of its panel's single ones.
    """
    flint = flint_module()
    # Y_left S_right + Y_right S_left is the numerator of T (positive-form), here without them.
    known = left.work * right.scale + right.work * left.scale
    unseen = known.abs_lower() * flint.arb(2) ** (-flint.ctx.prec - 10)
    for side, other in ((left, right), (right, left)):
        for panel in side.apart:
            ceiling = side.lam * panel.plus * panel.minus
            if ceiling * other.scale < unseen:
                side.work += ceiling.union(0)
            else:
                side.work += side.lam * panel.nested


def pieces_of(profile: Profile, lam: Fraction, a: Fraction, b: Fraction) -> list[Outer | Panel]:
    """The panels of [a, b], a < 1, from left to right, the outer ones in one piece."""
    pieces: list[Outer | Panel] = []
    if a < -1:
        pieces.append(Outer(profile.value(-_ONE), lam, min(-_ONE, b) - a))
    inner = max(a, -_ONE), min(b, _ONE)
    if inner[0] < inner[1]:
        pieces += cut(profile, lam, *inner)
    if b > 1:
        pieces.append(Outer(profile.value(_ONE), lam, b - 1))
    return pieces


def _mass_before(profile: Profile, lam: Fraction, y: Fraction) -> Any:
    """Integral over u < y of e^{lam(V(y) - V(u))}, for a drift that points inwards on the left."""
    # From -infinity to the first corner, or to y if that comes first, it is 1/(lam a-).
    mass = plain_formulas.tail_left(profile.value(-_ONE)) / exact_ball(lam)
    for panel in pieces_of(profile, lam, -_ONE, y):
        mass = panel.growth * (mass + panel.minus)
    return mass
