"""Proved derivatives of the exact integrals with respect to every parameter.

The sweeps of `symasym.exact.sweep` with balls that carry their derivatives (`Dual`). A parameter
changes the drift on every panel (`PanelSlope`, `OuterSlope`); kappa does so as well, since only
lam phi enters an exponent, and multiplies w besides; r moves the absorbing ends (`EndSlope`). The
start has a closed form: with sigma and w at the start from both sides,

    dT/d(start) = (w_R sigma_R - w_L sigma_L)/(sigma_L + sigma_R).

Needs python-flint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.base.errors import AccuracyError
from symasym.exact import sweep
from symasym.exact.balls.panels import (
    EndSlope,
    Outer,
    OuterSlope,
    Panel,
    PanelSlope,
    Piece,
    cut,
)
from symasym.exact.balls.sweep import (
    excess_bits,
    pieces_of,
    refined,
    sliding_slopes,
)
from symasym.exact.sweep import Deferred, Sum, Swept
from symasym.generated import formulas
from symasym.numbers.balls import Profile, exact_ball, flint_module, profile_of, sharpened

if TYPE_CHECKING:
    from flint import arb

    from symasym.drift.drift import Drift

__all__ = ["LOG", "derivative_of", "log_slopes", "log_slopes_of_occupation"]

#: The logarithm itself, among its derivatives; no parameter has such a name.
LOG = "log(quantity)"

# Panels of a scene beyond which differences are found in less time.
_MOST_PANELS = 300


def log_slopes(
    quantity: str,
    drift: Drift,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
) -> dict[str, Any]:
    """Balls for log(quantity), as `LOG`, and for its derivatives by each parameter of the drift,
    kappa, r and start.

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
    lam, directions = 2 / kappa**2, _directions(drift, kappa)
    directions["r"], directions["start"] = Direction(None, ends=True), Direction(None)

    def compute() -> dict[str, Any]:
        profile, given = profile_of(drift), list(directions.values())
        mirrored = [d.mirrored() for d in given]
        cuts = (profile, start, given), (profile.mirrored(), -start, mirrored)
        pieces: list[list[Outer | Panel]] = []
        for p, x, d in cuts:
            most = _MOST_PANELS - sum(map(len, pieces))
            pieces.append(pieces_of(p, lam, -r, x, most, _unbounded(d)))
        _refuse_many(sum(map(len, pieces)))
        left, right = (_swept(p, lam, c[2]) for p, c in zip(pieces, cuts, strict=True))
        if quantity == "T":
            time = _time(left, right, len(directions))
            return {LOG: time.value.log(), **time.log_slopes(directions)}
        if quantity == "1 - C":
            left, right = right, left
        share: Dual = formulas.exit_share(left.sigma, right.sigma)
        towards_left = 1 / right.sigma.value
        return {
            LOG: -(left.sigma.value / right.sigma.value).log1p(),
            **share.log_slopes(directions),
            "start": towards_left if quantity == "1 - C" else -towards_left,
        }

    return _refined(compute, dps, lam * (1 + r))


def log_slopes_of_occupation(
    quantity: str, drift: Drift, kappa: Fraction, dps: int
) -> dict[str, Any]:
    """The same of ``"P"`` and ``"1 - P"``, for each parameter and kappa; the region is sliding."""
    lam, directions = 2 / kappa**2, _directions(drift, kappa)

    def compute() -> dict[str, Any]:
        profile, changes = profile_of(drift), _unbounded(directions.values())
        tails = (
            Dual.of(tail, (d.at_end(side) for d in directions.values()))
            for side, tail in zip((-1, 1), sliding_slopes(profile), strict=True)
        )
        a_minus, a_plus = tails
        panels = cut(profile, lam, Fraction(-1), Fraction(1), _MOST_PANELS, changes)
        _refuse_many(len(panels))
        records = (
            _DualPiece(p, tuple(d.of(p, lam, 0, False) for d in directions.values())).record()
            for p in panels
        )
        # Both times depend on lam and phi through lam phi alone.
        layer = sweep.in_layer(records, exact_ball(lam), a_minus)
        inside, outside = sweep.layer_times(layer, formulas.tail_right(a_plus), quantity == "1 - P")
        share: Dual = formulas.occupation_share(inside, outside)
        return {LOG: -(outside.value / inside.value).log1p(), **share.log_slopes(directions)}

    return _refined(compute, dps, lam)


def _directions(drift: Drift, kappa: Fraction) -> dict[str, Direction]:
    """The changes per unit of each parameter, and of kappa: d(log lam)/d(kappa) = -2/kappa."""
    directions = {
        name: Direction(sharpened(profile_of(derivative_of(drift, name))))
        for name in drift.parameters
    }
    directions["kappa"] = Direction(profile_of(drift), -2 / kappa, -2 / kappa)
    return directions


@lru_cache(maxsize=64)
def derivative_of(drift: Drift, name: str) -> Drift:
    """dA/dp as a drift, with what was found of it."""
    return drift.derivative(name)


def _unbounded(directions: Iterable[Direction]) -> list[Profile]:
    """The changes of the drift that are no polynomials, which have a bound everywhere."""
    return [d.profile for d in directions if d.profile and d.profile.terms() is None]


def _refuse_many(panels: int) -> None:
    """Raise AccuracyError where differences take less time."""
    if panels > _MOST_PANELS:
        raise AccuracyError(
            f"proved derivatives would take {panels} panels; use differences of exact values."
        )


def _refined(compute: Callable[[], Any], dps: int, scale: Fraction) -> dict[str, Any]:
    """Balls of the logarithm and its derivatives, each of these to `dps` digits or places."""

    def missing_bits(slopes: dict[str, Any]) -> int:
        """Bits by which the widest ball is too wide."""
        # The logarithm to as many digits, or twice as many places.
        places = {LOG: 2 * dps}
        return max(excess_bits(x, dps, places.get(n, dps)) for n, x in slopes.items())

    # The digits that the value is found with, and so its panels.
    slopes: dict[str, Any] = refined(compute, dps + 3, scale, missing_bits)
    return slopes


Change = EndSlope | OuterSlope | PanelSlope


class Direction(NamedTuple):
    """Changes of a scene per unit of a parameter.

    The drift by `rate` times the one of `profile`, log lam in front of w by `power`, and the
    absorbing `ends`, outwards.
    """

    profile: Profile | None
    rate: Fraction = Fraction(1)
    power: Fraction = Fraction(0)
    ends: bool = False

    def mirrored(self) -> Direction:
        """The changes of the mirrored scene -A(-u)."""
        return self._replace(profile=self.profile and self.profile.mirrored())

    def of(self, piece: Outer | Panel, lam: Fraction, side: int, first: bool) -> Change | None:
        """The change of a piece, an outer one being left of -1 or right of 1."""
        if self.ends and first:
            return EndSlope(piece, exact_ball(lam) * piece.drift_at_left)
        if self.profile is None:
            return None
        if isinstance(piece, Panel):
            # lam changes lam phi as a multiple of phi would.
            return PanelSlope(piece, None if self.power else self.profile, self.rate)
        return OuterSlope(piece, self.at_end(side))

    def at_end(self, side: int) -> Any:
        """The change of a- or a+."""
        assert self.profile is not None
        return exact_ball(self.rate) * self.profile.value(Fraction(side))


class Dual:
    """A number and its derivatives with respect to the parameters: a ball with the coefficients of
    a polynomial, or an mpf with an array of them."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: Any, slopes: Any) -> None:
        self.value, self.slopes = value, slopes

    @classmethod
    def of(cls, value: arb, slopes: Iterable[Any]) -> Dual:
        """From balls, or numbers."""
        return cls(value, flint_module().arb_poly(list(slopes)))

    def mid(self) -> Any:
        """The midpoint of the value."""
        return sweep.middle(self.value)

    def log_slopes(self, names: Iterable[str]) -> dict[str, Any]:
        """Derivatives of the logarithm."""
        return {name: self.slopes[k] / self.value for k, name in enumerate(names)}

    def __add__(self, other: Dual | arb | int) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slopes + other.slopes)
        if isinstance(other, (Deferred, Sum)):
            return NotImplemented
        return Dual(self.value + other, self.slopes)

    __radd__ = __add__

    def __mul__(self, other: Dual | arb | int) -> Dual:
        if isinstance(other, Dual):
            x, y = self.value, other.value
            return Dual(x * y, self.slopes * y + other.slopes * x)
        if isinstance(other, (Deferred, Sum)):
            return NotImplemented
        return Dual(self.value * other, self.slopes * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Dual | arb | int) -> Dual:
        inverse: Dual | Any = 1 / other
        return self * inverse

    def __rtruediv__(self, other: arb | int) -> Dual:
        inverse = 1 / self.value
        return Dual(other * inverse, self.slopes * (-other * inverse * inverse))


class _DualPiece(Piece):
    """A piece and its changes, None being none."""

    def __init__(self, piece: Piece, changes: tuple[Change | None, ...]) -> None:
        self._piece, self._changes = piece, changes

    def _dual(self, name: str) -> Dual:
        """A number of the piece and its derivatives."""
        slopes = (getattr(change, name) if change else 0 for change in self._changes)
        return Dual.of(getattr(self._piece, name), slopes)

    @cached_property
    def growth(self) -> Dual:
        """e^{lam(V(b) - V(a))} and its derivatives."""
        relative = self._dual("growth")
        return Dual(relative.value, relative.slopes * relative.value)

    @cached_property
    def plus(self) -> Dual:
        return self._dual("plus")

    @cached_property
    def minus(self) -> Dual:
        return self._dual("minus")

    @cached_property
    def nested(self) -> Dual:
        return self._dual("nested")

    @property
    def ceiling(self) -> Any:
        """More than the nested integral and its changes."""
        steepest = flint_module().arb(1)
        for change in self._changes:
            if isinstance(change, PanelSlope):
                steepest = steepest.max(change.steep)
        return self._piece.ceiling * steepest

    @property
    def enclosure(self) -> Dual:
        """An enclosure of the nested integral and its changes that takes no work."""
        ceiling = self._piece.ceiling

        def most(change: Change | None) -> Any:
            """An enclosure of a change of the nested integral."""
            if isinstance(change, PanelSlope):
                # Over a panel, from -1 to 1, q changes by twice its steepest slope at most.
                return flint_module().arb(0, (2 * ceiling * change.steep).upper())
            return change.nested if change else 0

        return Dual.of(self._piece.enclosure, map(most, self._changes))


def _swept(pieces: list[Outer | Panel], lam: Fraction, directions: list[Direction]) -> Swept:
    """sigma and w at the start, from an absorbing end."""
    rate = Dual.of(exact_ball(lam), (exact_ball(lam * d.power) for d in directions))
    records = []
    for k, piece in enumerate(pieces):
        # An outer piece that comes first is on the left, since all begin below 0.
        changes = tuple(d.of(piece, lam, 1 if k else -1, k == 0) for d in directions)
        records.append(_DualPiece(piece, changes).record())
    return sweep.absorbed(records, rate)


def _time(left: Swept, right: Swept, count: int) -> Dual:
    """T with `count` derivatives, the last with respect to the start."""
    one, others = exact_ball(Fraction(1)), [0] * (count - 1)
    w_left = left.w * Dual.of(one, [*others, -1 / right.sigma.value])
    w_right = right.w * Dual.of(one, [*others, 1 / left.sigma.value])
    time: Dual = sweep.escape_time(Swept(left.sigma, w_left), Swept(right.sigma, w_right))
    return time
