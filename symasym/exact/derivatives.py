"""Proved derivatives of the exact integrals with respect to every parameter.

The sums over panels of `symasym.exact.ball_sweep` are differentiated term by term. A parameter
changes the drift on every panel (`PanelSlope`, `OuterSlope`); kappa does so as well, since only
lam phi enters an exponent, and multiplies Y besides; r moves the absorbing ends, where S starts
from its width. The start has a closed form: with S and Y at the start from both sides,

    T = (Y_L S_R + Y_R S_L)/(S_L + S_R),    dT/d(start) = (Y_R - Y_L)/(S_L + S_R).

Needs python-flint.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.base.errors import AccuracyError
from symasym.exact.ball_panels import Outer, OuterSlope, Panel, PanelSlope, cut
from symasym.exact.ball_sweep import (
    check_escape,
    excess_bits,
    large_parameter,
    pieces_of,
    refined,
    sliding_slopes,
)
from symasym.generated import plain_formulas
from symasym.numbers.balls import Profile, exact_ball, flint_module, profile_of

__all__ = ["log_slopes", "log_slopes_of_occupation"]

# Panels of a scene beyond which differences are found in less time.
_MOST_PANELS = 300


def log_slopes(
    quantity: str,
    drift: Any,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
) -> dict[str, Any]:
    """Balls for d log(quantity)/dp, p being each parameter of the drift, kappa, r and start.

    Parameters
    ----------
    quantity : {"T", "C", "1 - C"}
    drift : symasym.Drift
        With scalar parameters, all bound.
    kappa, r, start : Fraction
    dps : int
        Each radius is at most 10^-dps, or 10^-dps times the derivative if that is larger.

    Raises
    ------
    AccuracyError
        If the noise is so weak that more panels are needed than is reasonable.
    """
    check_escape(kappa, r, start)
    lam, ways = large_parameter(kappa), _ways(drift, kappa)
    ways["r"] = Way(None, seed=1)

    def compute() -> dict[str, Any]:
        profile = _together(drift, ways)
        left_pieces = pieces_of(profile, lam, -r, start)
        right_pieces = pieces_of(profile.mirrored(), lam, -r, -start)
        _refuse_many(len(left_pieces) + len(right_pieces))
        mirrored = [way.mirrored() for way in ways.values()]
        left = _carried(left_pieces, lam, list(ways.values()), quantity == "T")
        right = _carried(right_pieces, lam, mirrored, quantity == "T")
        if quantity != "T":
            return _shares(left, right, list(ways), quantity == "1 - C")
        _add_nested(left, right)
        return _times(left, right, list(ways))

    return _refined(compute, dps, lam * (1 + r))


def log_slopes_of_occupation(
    quantity: str, drift: Any, kappa: Fraction, dps: int
) -> dict[str, Any]:
    """The same of ``"P"`` and ``"1 - P"``, for each parameter and kappa; the region is sliding."""
    lam, ways = large_parameter(kappa), _ways(drift, kappa)

    def compute() -> dict[str, Any]:
        profile = _together(drift, ways)
        a_minus, a_plus = sliding_slopes(profile)
        panels = cut(profile, lam, Fraction(-1), Fraction(1))
        _refuse_many(len(panels))
        inside, outside = exact_ball(Fraction(0)), plain_formulas.tail_left(a_minus)
        weight = exact_ball(Fraction(1))  # e^{-lam V} at the panel's start
        # Derivatives of the three.
        inner, outer, weights = ({name: exact_ball(Fraction(0)) for name in ways} for _ in range(3))
        for panel in panels:
            inside += weight * panel.minus
            after = weight / panel.growth
            for name, way in ways.items():
                change = way.of(panel)
                assert change is not None
                inner[name] += weights[name] * panel.minus + weight * change.minus
                weights[name] = weights[name] / panel.growth - after * change.growth
            weight = after
        outside += weight * plain_formulas.tail_right(a_plus)
        found = {}
        for name, way in ways.items():
            at_left, at_right = way.at_end(-1), way.at_end(1)
            outer[name] = weight * at_right / a_plus**2 - at_left / a_minus**2
            outer[name] += weights[name] * plain_formulas.tail_right(a_plus)
            # Of log(outside/inside); both depend on lam and phi through lam phi alone.
            ratio = outer[name] / outside - inner[name] / inside
            within = exact_ball(lam) * inside
            other = within if quantity == "1 - P" else -outside
            found[name] = ratio * other / (within + outside)
        return found

    return _refined(compute, dps, lam)


def _ways(drift: Any, kappa: Fraction) -> dict[str, Way]:
    ways = {name: Way(profile_of(drift.derivative(name))) for name in drift.parameters}
    ways["kappa"] = Way(profile_of(drift), -2 / kappa, -2 / kappa)
    return ways


def _together(drift: Any, ways: dict[str, Way]) -> Profile:
    return _Together(profile_of(drift), tuple(w.profile for w in ways.values() if w.profile))


def _refuse_many(panels: int) -> None:
    if panels > _MOST_PANELS:
        raise AccuracyError(
            f"proved derivatives would take {panels} panels; use differences of exact values."
        )


def _refined(compute: Callable[[], Any], dps: int, scale: Fraction) -> dict[str, Any]:
    def missing_bits(found: dict[str, Any]) -> int:
        return max(excess_bits(ball, dps, dps) for ball in found.values())

    found: dict[str, Any] = refined(compute, dps, scale=scale, missing_bits=missing_bits)
    return found


class Way(NamedTuple):
    """What a parameter changes, per unit of it.

    The drift by `rate` times the one of `profile`; log lam in front of Y by `power`; and the
    absorbing ends move outwards by `seed`.
    """

    profile: Profile | None
    rate: Fraction = Fraction(1)
    power: Fraction = Fraction(0)
    seed: int = 0

    def mirrored(self) -> Way:
        return self._replace(profile=self.profile and self.profile.mirrored())

    def of(self, piece: Outer | Panel, side: int = -1) -> OuterSlope | PanelSlope | None:
        """The change of a piece, an outer one being left of -1 or right of 1."""
        if self.profile is None:
            return None
        if isinstance(piece, Panel):
            return PanelSlope(piece, self.profile, self.rate)
        return OuterSlope(piece, self.at_end(side))

    def at_end(self, side: int) -> Any:
        """The change of a- or a+."""
        assert self.profile is not None
        return exact_ball(self.rate) * self.profile.value(Fraction(side))


@dataclass
class _Together:
    """A drift that is cut finely enough for the changes beside it to be bounded as well."""

    drift: Profile
    changes: tuple[Profile, ...]

    def value(self, u: Fraction) -> Any:
        return self.drift.value(u)

    def bound(self, center: Fraction, radius: Fraction) -> Any:
        if all(change.bound(center, radius).is_finite() for change in self.changes):
            return self.drift.bound(center, radius)
        return flint_module().arb.nan()

    def series(self, center: Fraction, half: Fraction, terms: int) -> Any:
        return self.drift.series(center, half, terms)

    def terms(self) -> int | None:
        return self.drift.terms()

    def mirrored(self) -> Profile:
        return _Together(self.drift.mirrored(), tuple(c.mirrored() for c in self.changes))


@dataclass
class _Slope:
    """Derivatives of S and Y."""

    scale: Any
    work: Any


@dataclass
class _Side:
    """S and Y at the start, their derivatives, and the pieces whose nested integral Y lacks."""

    scale: Any
    work: Any
    lam: Any
    slopes: list[_Slope]
    ways: list[Way]
    apart: list[tuple[Outer | Panel, list[OuterSlope | PanelSlope | None]]]


def _carried(pieces: list[Outer | Panel], lam: Fraction, ways: list[Way], times: bool) -> _Side:
    """S and, for `times`, Y from the absorbing end to the start."""
    nothing = exact_ball(Fraction(0))
    slopes = [_Slope(exact_ball(Fraction(way.seed)), nothing) for way in ways]
    side = _Side(nothing, nothing, exact_ball(lam), slopes, ways, [])
    for place, piece in enumerate(pieces):
        # An outer piece that comes first is on the left, since all begin below 0.
        changes = [way.of(piece, -1 if place == 0 else 1) for way in ways]
        before = side.scale
        side.scale = (before + piece.plus) / piece.growth
        for slope, way, change in zip(slopes, ways, changes, strict=True):
            if times:
                part = (slope.scale + exact_ball(way.power) * before) * piece.minus
                if change:
                    part += before * change.minus
                slope.work += side.lam * part
            if change:
                slope.scale = (slope.scale + change.plus) / piece.growth
                slope.scale -= side.scale * change.growth
            else:
                slope.scale = slope.scale / piece.growth
        if times:
            side.work += side.lam * before * piece.minus
            side.apart.append((piece, changes))
    return side


def _add_nested(left: _Side, right: _Side) -> None:
    """Complete Y and its derivatives, as `ball` does: what no digit sees is enclosed only."""
    flint = flint_module()
    known = left.work * right.scale + right.work * left.scale
    unseen = known.abs_lower() * flint.arb(2) ** (-flint.ctx.prec - 10)
    for side, other in ((left, right), (right, left)):
        for piece, changes in side.apart:
            ceiling = side.lam * piece.plus * piece.minus
            steepest = flint.arb(1)
            for change in changes:
                if isinstance(change, PanelSlope):
                    steepest = steepest.max(change.steep)
            if isinstance(piece, Panel) and ceiling * steepest * other.scale < unseen:
                nested = ceiling.union(0)
                # Over a panel, from -1 to 1, q changes by twice its steepest slope at most.
                most = flint.arb(0, (2 * ceiling * steepest).upper())
                moved = [most if change else 0 for change in changes]
            else:
                nested = side.lam * piece.nested
                moved = [side.lam * change.nested if change else 0 for change in changes]
            side.work += nested
            for slope, way, more in zip(side.slopes, side.ways, moved, strict=True):
                slope.work += more + exact_ball(way.power) * nested


def _times(left: _Side, right: _Side, names: list[str]) -> dict[str, Any]:
    """Of log T."""
    top = left.work * right.scale + right.work * left.scale
    below = left.scale + right.scale
    found = {}
    for name, a, b in zip(names, left.slopes, right.slopes, strict=True):
        change = (
            a.work * right.scale + left.work * b.scale + b.work * left.scale + right.work * a.scale
        )
        found[name] = change / top - (a.scale + b.scale) / below
    found["start"] = (right.work - left.work) / top
    return found


def _shares(left: _Side, right: _Side, names: list[str], complement: bool) -> dict[str, Any]:
    """Of log C, C = S_R/(S_L + S_R), or of log(1 - C)."""
    below = left.scale + right.scale
    found = {}
    for name, a, b in zip(names, left.slopes, right.slopes, strict=True):
        # d log(S_R/S_L), times the other share.
        change = b.scale / right.scale - a.scale / left.scale
        found[name] = change * ((-right.scale if complement else left.scale) / below)
    found["start"] = 1 / left.scale if complement else -1 / right.scale
    return found
