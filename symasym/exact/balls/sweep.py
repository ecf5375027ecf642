"""Proved enclosures of the exact integrals, in Arb's ball arithmetic.

Every function returns a ``flint.arb`` that contains the value: rounding is
enclosed by Arb, truncation of every series by a Cauchy estimate whose maximum
is itself bounded in ball arithmetic.

The sweeps are those of `symasym.exact.sweep`, of positive terms only, so that no digit cancels and
a ball's relative radius grows with the number of panels, not exponentially.

The functions of the four quantities take

=========== ============================================================================
drift       a `Drift` with scalar parameters, all bound; for P and p_ss one that slides
kappa, r,   Fractions: scaled noise amplitude, escape radius, starting point and position
start, y
dps         the relative radius of the result is at most 10^-dps
complement  True for 1 - C or 1 - P, without cancellation
log         True for the natural logarithm; one that is 0, or smaller than 10^-dps, is
            enclosed with an absolute radius of 10^-2dps
=========== ============================================================================

and raise AccuracyError where the noise is so weak that more panels are needed than is reasonable.
Needs python-flint, which is imported on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from symasym.base.errors import AccuracyError, RegionError
from symasym.exact import sweep
from symasym.exact.balls.panels import Outer, Panel, cut
from symasym.exact.sweep import Record, Swept
from symasym.generated import formulas
from symasym.numbers.balls import Profile, exact_ball, flint_module, precision, profile_of

if TYPE_CHECKING:
    from flint import arb

    from symasym.drift.drift import Drift

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
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, *, log: bool = False
) -> Any:
    """Ball of the mean time to leave (-r, r) from `start` (eq:Ttilde)."""

    def compute() -> Any:
        time = sweep.escape_time(*_from_both_ends(drift, kappa, r, start))
        return time.log() if log else time

    return refined(compute, dps, 2 / kappa**2 * (1 + r), _of_log(dps) if log else None)


def exit_probability(
    drift: Drift,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
    complement: bool = False,
    *,
    log: bool = False,
) -> Any:
    """Ball of C, the probability of leaving (-r, r) through -r (eq:C), or of 1 - C."""

    def compute() -> Any:
        left, right = _from_both_ends(drift, kappa, r, start)
        if complement:
            left, right = right, left
        # Arb's logarithms are methods of its balls, which no emitted code calls.
        if log:
            return -(left.sigma / right.sigma).log1p()
        return formulas.exit_share(left.sigma, right.sigma)

    return refined(compute, dps, 2 / kappa**2 * (1 + r))


def occupation(
    drift: Drift, kappa: Fraction, dps: int, complement: bool = False, *, log: bool = False
) -> Any:
    """Ball of P, the stationary probability of -1 <= u <= 1 (eq:P), or of 1 - P."""
    lam = 2 / kappa**2

    def compute() -> Any:
        profile = profile_of(drift)
        a_minus, a_plus = sliding_slopes(profile)
        records = (panel.record() for panel in cut(profile, lam, -_ONE, _ONE))
        layer = sweep.in_layer(records, exact_ball(lam), a_minus)
        wanted, rest = sweep.layer_times(layer, formulas.tail_right(a_plus), complement)
        return -(rest / wanted).log1p() if log else formulas.occupation_share(wanted, rest)

    return refined(compute, dps, lam)


def stationary_density(
    drift: Drift, kappa: Fraction, y: Fraction, dps: int, *, log: bool = False
) -> Any:
    """Ball of the stationary probability density at `y` (eq:pss, normalised)."""
    lam = 2 / kappa**2

    def compute() -> Any:
        profile = profile_of(drift)
        sliding_slopes(profile)
        density = sweep.density(
            exact_ball(lam),
            _w_from_infinity(profile, lam, y),
            _w_from_infinity(profile.mirrored(), lam, -y),
        )
        return density.log() if log else density

    return refined(compute, dps, lam * (1 + abs(y)), _of_log(dps) if log else None)


# -- arguments ---------------------------------------------------------------------------------


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
    """A sign is undecided at this precision."""


def refined(
    compute: Callable[[], Any],
    dps: int,
    scale: Fraction,
    missing_bits: Callable[[Any], int] | None = None,
) -> Any:
    """`compute()` at rising precision, until no bits of `dps` digits are missing."""
    missing_bits = missing_bits or (lambda ball: excess_bits(ball, dps))
    # The sum of a panel's alternating series cancels a sixth of the bits, 2/(RATIO log 2) times the
    # growth per bit (see `panels`), and e^{lam V} loses as many as its exponent has before the
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


def _of_log(dps: int) -> Callable[[arb], int]:
    """The excess of a logarithm's ball: a value that may be 0 has no relative accuracy."""
    return lambda ball: excess_bits(ball, dps, 2 * dps)


def excess_bits(value: arb, dps: int, places: int | None = None) -> int:
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


def _from_both_ends(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction
) -> tuple[Swept, Swept]:
    """sigma and w at the start, from -r and in mirrored coordinates from r."""
    profile, lam = profile_of(drift), 2 / kappa**2
    # Both are cut before either is integrated, so that too much work is refused at once.
    left = records_of(pieces_of(profile, lam, -r, start))
    right = records_of(pieces_of(profile.mirrored(), lam, -r, -start))
    return sweep.absorbed(left, exact_ball(lam)), sweep.absorbed(right, exact_ball(lam))


def pieces_of(
    profile: Profile,
    lam: Fraction,
    a: Fraction,
    b: Fraction,
    most: int | None = None,
    changes: Sequence[Profile] = (),
) -> list[Outer | Panel]:
    """The panels of [a, b], a < 1, from left to right, the outer ones in one piece; of the others
    `most`, on which the `changes` are bounded."""
    pieces: list[Outer | Panel] = []
    if a < -1:
        pieces.append(Outer(profile.value(-_ONE), lam, min(-_ONE, b) - a))
    inner = max(a, -_ONE), min(b, _ONE)
    if inner[0] < inner[1]:
        pieces += cut(profile, lam, *inner, most, changes)
    if b > 1:
        pieces.append(Outer(profile.value(_ONE), lam, b - 1))
    return pieces


def records_of(pieces: list[Outer | Panel]) -> list[Record]:
    """The pieces' numbers for a sweep."""
    return [piece.record() for piece in pieces]


def _w_from_infinity(profile: Profile, lam: Fraction, y: Fraction) -> Any:
    """w at y, nothing being absorbed on the left, where the drift points inwards."""
    records = records_of(pieces_of(profile, lam, -_ONE, y))
    return sweep.from_infinity(records, exact_ball(lam), profile.value(-_ONE))
