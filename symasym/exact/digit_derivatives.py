"""Derivatives of the exact integrals with respect to every parameter, to any number of digits.

The sweeps of `symasym.exact.digits` with numbers that carry their derivatives (`Dual`). On a panel
of unit width let y' = q y + 1 (N, from 0) or y' = q y (1/e, from 1), q = lam phi h. From the right
end, s = 1 - w, the same equations with q(1 - s) give M = int_w^1 e(w)/e(x) dx and E = e(w)/e(1),
and by Fubini's theorem

    d/dq_k int 1/e = int s^{k+1}/e ds/(k + 1),
    d/dq_k N(1)    = (N(1) - int w^{k+1} E dw)/(k + 1),
    d/dq_k int N   = (int s^{k+1} N ds - int w^{k+1} M dw)/(k + 1).

So four recurrences, not two, give the derivatives in all parameters. A solution without layers,
M' = 1 - psi M, changes by the one of dM' = -dpsi M - psi dM: the same slow series with another
source. The directions are those of `symasym.exact.balls.derivatives`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import cached_property, lru_cache
from operator import mul
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of, own_context, step, to_mpf
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.exact import sweep
from symasym.exact.balls.derivatives import Dual
from symasym.exact.digit_panels import (
    MORE_TERMS,
    Constant,
    Panel,
    Slow,
    Taylor,
    beyond_floats,
    context_integer,
    guard_bits,
    integers,
    log_size,
    one_of,
    slow_series,
    terms_needed,
)
from symasym.exact.digits import Partition, precise, swept_scene
from symasym.exact.sweep import Deferred, Record, Swept, known
from symasym.generated import formulas
from symasym.numbers.polynomials import shifted
from symasym.numbers.rationals import Rational

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

__all__ = ["log_slopes"]

# Digits beyond those that the size of the exponents' changes costs.
_GUARD = 10
# Terms about a panel's right end, over those about its left one.
_MOST_TERMS = 4
# Radii of disks about a slow panel, over half its width.
_RATIOS = (Rational(4), Rational(2), Rational(16), Rational(64), Rational(3, 2))


def log_slopes(
    quantity: str, drift: Drift, numbers: dict[str, Fraction], dps: int, size: int
) -> dict[str, Any]:
    """d log(quantity)/dp as mpf, p being each parameter of the drift, kappa, and r and start.

    Parameters
    ----------
    quantity : {"T", "C", "1 - C", "P", "1 - P"}
    drift : Drift
        With scalar parameters, all bound.
    numbers : dict
        kappa, and r and start where the quantity depends on them.
    dps, size : int
        Digits, or places where a derivative is below 1; log10 of how fast exponents change.

    Raises
    ------
    AccuracyError
        Where the series of a derivative of A converges more slowly than that of A.
    """
    kappa = numbers["kappa"]
    with own_context(dps) as context:
        precise(context, dps + size + _GUARD)
        changes = [_derivative(drift, name) for name in drift.parameters]
        names = [*drift.parameters, "kappa", *(["r"] if "r" in numbers else [])]
        sides = [
            _Side(drift, changes, mirrored, kappa, "r" in numbers, context)
            for mirrored in ((False, True) if "r" in numbers else (False,))
        ]
        for side, end in zip(
            sides, (numbers.get("start", 1), -numbers.get("start", 0)), strict=False
        ):
            side.scene.expect(-numbers.get("r", Fraction(1)), end)
        if "r" not in numbers:
            share = sides[0].occupation(quantity == "1 - P")
            return {name: to_mpf(x, dps) for name, x in share.log_slopes(names).items()}
        r, start = numbers["r"], numbers["start"]
        left, right = (side.absorbed(-r, x) for side, x in zip(sides, (start, -start), strict=True))
        if quantity == "T":
            found = sweep.escape_time(left, right).log_slopes(names)
            from_left, from_right = (known(side.w).value for side in (left, right))
            change = from_right / left.sigma.value - from_left / right.sigma.value
            found["start"] = change / (from_left + from_right)
        else:
            if quantity == "1 - C":
                left, right = right, left
            found = formulas.exit_share(left.sigma, right.sigma).log_slopes(names)
            found["start"] = (1 if quantity == "1 - C" else -1) / right.sigma.value
        return {name: to_mpf(x, dps) for name, x in found.items()}


@lru_cache(maxsize=64)
def _derivative(drift: Drift, name: str) -> Drift:
    """dA/dp as a drift."""
    return drift.derivative(name)


class _Side:
    """One scene, or its mirror image, and its changes per unit of each parameter."""

    def __init__(
        self, drift: Drift, changes: Sequence[Drift], mirrored: bool, kappa: Fraction, ends: bool,
        context: MPContext,
    ) -> None:  # fmt: skip
        self.scene: Partition = swept_scene(drift, mirrored, 2 / kappa**2, context)
        self.numbers = self.scene.numbers
        self.changes = [ExactField(change, mirrored, context) for change in changes]
        self.of_kappa = Rational(-2 / kappa)
        #: Whether r is one of the parameters, the last.
        self.ends = ends

    def row(self, of_drift: Callable[[ExactField], Any], of_kappa: Any) -> Any:
        """Derivatives by parameter: each change of the drift, kappa, and r, which is none."""
        return self.listed([*map(of_drift, self.changes), of_kappa])

    def listed(self, slopes: list[Any]) -> Any:
        """The same from the derivatives."""
        zero = self.numbers.context.zero
        return np.array([*slopes, *([zero] if self.ends else [])], dtype=object)

    def value(self, u: int) -> Dual:
        """phi at an end of the layer, changed by kappa as lam phi is."""
        number, value = self.numbers.mpf, self.scene.field.value(Rational(u))
        return Dual(
            number(value),
            self.row(lambda f: number(f.value(Rational(u))), number(self.of_kappa * value)),
        )

    def records(self, start: Fraction, end: Fraction, absorbed: bool) -> Iterator[Record]:
        """The panels' numbers from `start` to `end`."""
        for k, panel in enumerate(self.scene.panels(Rational(start), Rational(end))):
            yield _Changed(panel, self, absorbed and k == 0).record(self.scene.tiny)

    def absorbed(self, start: Fraction, end: Fraction) -> Swept:
        """sigma and w at `end`, absorbed at `start`, which r moves."""
        lam = self.numbers.lam
        none = self.numbers.context.zero
        slope = self.numbers.mpf(self.of_kappa) * lam
        return sweep.absorbed(
            self.records(start, end, self.ends), Dual(lam, self.row(lambda _: none, slope))
        )

    def occupation(self, complement: bool) -> Dual:
        """P or 1 - P; both times depend on lam and phi through lam phi alone."""
        records = self.records(Fraction(-1), Fraction(1), False)
        layer = sweep.in_layer(records, self.numbers.lam, self.value(-1))
        times = sweep.layer_times(layer, formulas.tail_right(self.value(1)), complement)
        share: Dual = formulas.occupation_share(*times)
        return share


class _Changed:
    """A panel and its changes."""

    def __init__(self, panel: Panel, side: _Side, end: bool) -> None:
        self.panel, self.side, self.moved = panel, side, end

    def record(self, tiny: Any) -> Record:
        """Its numbers for a sweep, with their derivatives."""
        panel = self.panel
        return Record(
            Deferred(lambda: self._dual(0), lambda: panel.bound, tiny),
            Deferred(lambda: self._dual(1), lambda: panel.bound, tiny),
            Deferred(lambda: self._dual(2), lambda: panel.nested_bound, tiny),
            1 if panel.up else self.end,
            self.end if panel.up else 1,
        )

    @cached_property
    def _rise(self) -> Any:
        """Changes of log `end`, of the drift and kappa alone."""
        panel, side = self.panel, self.side
        if isinstance(panel, Slow):
            middle = panel.centre + panel.t0 + panel.half
            for field in side.changes:
                self._require_tame(field, middle, panel.half, panel.count + MORE_TERMS, _RATIOS)
        number, sign = side.numbers.mpf, 1 if panel.up else -1
        lam = sign * side.numbers.lam_exact

        def integral(field: ExactField) -> Any:
            """Of a change, over the panel."""
            if not isinstance(panel, Taylor):
                return panel.integral(field)
            c = self._taylor(field, panel)
            return panel.width * sum((x / (k + 1) for k, x in enumerate(c)), Rational(0))

        return side.row(
            lambda f: number(lam * integral(f)), number(-side.of_kappa * abs(panel.rise))
        )

    @cached_property
    def _rate(self) -> Any:
        """lam phi at the left end."""
        numbers = self.side.numbers
        return numbers.lam * numbers.mpf(self.panel.drift_at_left)

    @cached_property
    def end(self) -> Dual:
        """exp(-lam |V(b) - V(a)|)."""
        value = self.panel.end
        slopes = self._rise * value
        if self.moved:
            slopes[-1] = (self._rate if self.panel.up else -self._rate) * value
        return Dual(value, slopes)

    def _dual(self, k: int) -> Dual:
        """int_e, int_inverse or nested."""
        value, slopes = self._numbers[k]
        if self.moved:
            # The left end moves outwards.
            rate, end = self._rate, self.panel.end
            (int_e, _), (int_inverse, _), (nested, _) = self._numbers
            slopes[-1] = (
                (end, 1 + rate * int_inverse, int_inverse)[k] if self.panel.up else
                (1 - rate * int_e, end, int_inverse - rate * nested)[k]
            )  # fmt: skip
        return Dual(value, slopes)

    @cached_property
    def _numbers(self) -> list[tuple[Any, Any]]:
        """int_e, int_inverse and nested, each with its changes."""
        panel = self.panel
        if isinstance(panel, Taylor):
            return self._of_taylor(panel)
        slopes = self._of_slow(panel) if isinstance(panel, Slow) else self._of_constant()
        values = panel.int_e, panel.int_inverse, panel.nested
        return list(zip(values, slopes, strict=True))

    # -- a constant drift ------------------------------------------------------------------------

    def _of_constant(self) -> tuple[Any, Any, Any]:
        """By the moments of e^{-y t}, y being lam |phi| times the width."""
        panel, numbers = self.panel, self.side.numbers
        assert isinstance(panel, Constant)
        h = numbers.mpf(panel.width)
        one, two = _moments(abs(panel.rise), numbers.context)
        # y grows as log `end` falls.
        first = h * one * self._rise
        return first, first.copy(), h * h * (one - two if panel.up else two) * self._rise

    # -- Taylor series ---------------------------------------------------------------------------

    def _of_taylor(self, panel: Taylor) -> list[tuple[Any, Any]]:
        """By the moments of four series (see the module)."""
        side, context = self.side, self.side.numbers.context
        lam = side.numbers.lam_exact * panel.width
        # Coefficients that are rounding alone would grow about the other end.
        tiny = max(map(abs, panel.q)) / (1 << (context.prec - 32))
        own, *rows = (
            _trimmed(row, tiny)
            for row in (panel.q, *([lam * x for x in self._taylor(f, panel)] for f in side.changes))
        )
        count = max(map(len, [own, *rows]))
        backwards = [-x if k % 2 else x for k, x in enumerate(shifted(own, Rational(1)))]
        reach = max(sum(abs(float(x)) / (k + 1) for k, x in enumerate(c)) for c in (own, backwards))
        bits = context.prec + guard_bits(reach)
        q, denominator = integers(own, bits)
        back = [-x if k % 2 else x for k, x in enumerate(shifted(q, 1))]
        terms = _terms(q, denominator, bits), _terms(back, denominator, bits)
        if terms[1] > _MOST_TERMS * terms[0]:
            raise _slow_convergence()
        y, n = (_series(q, denominator, bits, terms[0], source) for source in (False, True))
        e, m = (_series(back, denominator, bits, terms[1], source) for source in (False, True))
        total = sum(n)
        of_y, of_n, of_e, of_m = (
            _moments_at_left(y, count), _moments_at_left(n, count),
            _moments_at_right(e, count), _moments_at_right(m, count),
        )  # fmt: skip
        changes = (
            [total - x for x in of_e[1:]],
            of_y[1:],
            [a - b for a, b in zip(of_n[1:], of_m[1:], strict=True)],
        )
        h = side.numbers.mpf(panel.width)
        unit = h * context.ldexp(1, -bits) * (1 if panel.up else panel.end)
        numbers = []
        for value, width, change in zip((total, of_y[0], of_n[0]), (1, 1, h), changes, strict=True):
            each = [x // (k + 1) for k, x in enumerate(change)]

            def along(direction: Sequence[Any], each: list[Any] = each) -> Any:
                c, below = integers(direction, bits)
                return context.mpf(sum(map(mul, c, each))) / below

            slopes = [along(row) for row in rows]
            slopes.append(side.numbers.mpf(side.of_kappa) * along(own))
            scaled = side.listed(slopes) * (unit * width)
            if not panel.up:
                scaled = scaled + value * unit * width * self._rise
            numbers.append((value * unit * width, scaled))
        return numbers

    def _taylor(self, field: ExactField, panel: Taylor) -> list[Any]:
        """Taylor coefficients of a change at the panel's left end, in units of its width."""
        scene = self.side.scene
        # More terms than of A, as a change may be larger.
        terms = (len(panel.q) if not scene.field.is_polynomial else scene.order()) + MORE_TERMS
        self._require_tame(field, panel.left, panel.width, terms, (4,))
        return field.taylor(panel.left, panel.width, terms)

    def _require_tame(
        self, field: ExactField, centre: Fraction, size: Fraction, terms: int, ratios: Sequence[Any]
    ) -> None:
        """Raise AccuracyError unless so many Taylor terms hold the digits, by Cauchy's bound on a
        disk of one of the `ratios` of the size."""
        if field.is_polynomial:
            return
        numbers = self.side.numbers
        scale = numbers.mpf(numbers.lam_exact * size)
        allowed = numbers.context.ldexp(1, -numbers.context.prec)
        step()
        for ratio in ratios:
            bound = scale * field.spread(centre, Rational(ratio) * size)
            if bound < allowed * numbers.mpf(Rational(ratio)) ** terms:
                return
        raise _slow_convergence()

    # -- slow panels -----------------------------------------------------------------------------

    def _of_slow(self, panel: Slow) -> tuple[Any, Any, Any]:
        """By the slow series with the source -dpsi M."""
        half = self.side.numbers.mpf(panel.half)
        following = self._at(panel, panel.t1, True) * half
        opposing = self._at(panel, panel.t0, False) * half
        if not panel.up:
            return opposing, following, opposing * panel.following + following * panel.opposing
        first = self._at(panel, panel.t0, True) * half
        whole = self._over(panel, first, following) * half
        return following, opposing, whole - first * panel.opposing - panel.first * opposing

    def _psi(self, panel: Slow, t: Fraction, count: int) -> tuple[list[Any], list[list[Any]]]:
        """Taylor coefficients of lam |phi| half about t, and of each of its changes."""
        numbers, scale = self.side.numbers, self.side.numbers.lam_exact * panel.half
        scale = -scale if panel.up else scale

        def about(field: ExactField) -> list[Any]:
            c = field.taylor(panel.centre + t, panel.half, count)[:count]
            return [numbers.mpf(scale * x) for x in c]

        psi = about(self.side.scene.field)
        of_kappa = numbers.mpf(self.side.of_kappa)
        return psi, [*map(about, self.side.changes), [of_kappa * x for x in psi]]

    def _at(self, panel: Slow, t: Fraction, alternate: bool) -> Any:
        """Changes of a solution without layers at one point."""
        context, rounds = self.side.numbers.context, panel.rounds
        bits, count = context.prec + 32, 2 * panel.rounds + 2
        psi, changes = self._psi(panel, t, count)
        m = slow_series(psi, one_of(count, bits), rounds, alternate, bits)[: rounds + 1]

        def change(direction: list[Any]) -> Any:
            """Of one change of psi, in units of its largest coefficient and of 1/psi_0."""
            size = max(map(abs, direction))
            if not size:
                return context.zero
            c = [int(context.ldexp(x / size, bits)) for x in direction]
            recent: deque[Any] = deque(maxlen=len(c))
            source = []
            for x in m:
                recent.appendleft(x)
                source.append(-(sum(map(mul, c, recent)) >> bits))
            dm = slow_series(psi, source, rounds, alternate, bits)[0]
            return context.ldexp(dm, -bits) * size / psi[0] ** 2

        return self.side.listed([change(c) for c in changes])

    def _over(self, panel: Slow, at_left: Any, at_right: Any) -> Any:
        """Changes of the integral of the following solution M over the panel, from its changes at
        the ends: with the opposing solution Q, (Q dM)' = -dM - dpsi M Q."""
        context, rounds, count = self.side.numbers.context, panel.rounds, panel.count + MORE_TERMS
        bits = context.prec + 32
        for _ in range(4):
            psi, changes = self._psi(panel, (panel.t0 + panel.t1) / 2, count)
            one, last = one_of(count, bits), count - rounds - 1
            m, q = (slow_series(psi, one, rounds, x, bits)[:last] for x in (True, False))
            if not max(abs(x) for x in m[-6:] + q[-6:]) >> 24:
                break
            count *= 2
        else:
            raise _slow_convergence()
        both = [sum(map(mul, m[: k + 1], q[k::-1])) >> bits for k in range(last)]
        unit = context.ldexp(1, -bits) / psi[0]
        longest = max(map(len, changes))
        moments = [
            2 * sum(x // (j + k + 1) for k, x in enumerate(both) if not (j + k) % 2)
            for j in range(longest)
        ]
        weighted = [
            sum((c * x for c, x in zip(row, moments, strict=False)), context.zero)
            for row in changes
        ]
        right, left = sum(q) * unit, sum(q[::2]) - sum(q[1::2])
        inside = self.side.listed(weighted) * (unit / psi[0]) * self.side.numbers.mpf(panel.half)
        return left * unit * at_left - right * at_right - inside


def _trimmed(row: list[Any], tiny: Any) -> list[Any]:
    """The coefficients up to the last that is not tiny."""
    last = max((k for k, x in enumerate(row) if abs(x) > tiny), default=0)
    return row[: last + 1]


def _slow_convergence() -> AccuracyError:
    return AccuracyError(
        "the series of a derivative of A converges too slowly; ask for fewer digits."
    )


def _terms(q: list[Any], denominator: int, bits: int) -> int:
    """Taylor terms of both solutions."""
    size = [abs(float(Rational(x, denominator))) / (k + 1) for k, x in enumerate(q)]
    logs = [log_size(Rational(x, denominator)) for x in q] if beyond_floats(len(q)) else []
    return terms_needed(size, bits, logs)


def _series(q: list[Any], denominator: int, bits: int, count: int, source: bool) -> list[Any]:
    """Taylor coefficients of y' = (sum q[k]/denominator s^k) y + source, fixed point."""
    one = context_integer(1) << bits
    y = [0 * one if source else one]
    recent = deque(y, maxlen=len(q))
    for n in range(1, count):
        new = sum(map(mul, q, recent)) // (denominator * n)
        if n == 1 and source:
            new += one
        recent.appendleft(new)
        y.append(new)
    return y


def _moments_at_left(series: list[Any], count: int) -> list[Any]:
    """int_0^1 s^k y ds, k = 0, ..., count."""
    return [sum(y // (n + k + 1) for n, y in enumerate(series)) for k in range(count + 1)]


def _moments_at_right(series: list[Any], count: int) -> list[Any]:
    """int_0^1 (1 - s)^k y ds, k = 0, ..., count, by Euler's beta function."""
    terms = [y // (n + 1) for n, y in enumerate(series)]
    moments = [sum(terms)]
    for k in range(1, count + 1):
        terms = [k * x // (n + k + 1) for n, x in enumerate(terms)]
        moments.append(sum(terms))
    return moments


def _moments(y: Fraction, context: MPContext) -> tuple[Any, Any]:
    """int_0^1 t^k e^{-y t} dt, k = 1, 2."""
    if not y:
        return context.one / 2, context.one / 3
    bits = y.denominator.bit_length() - y.numerator.bit_length()
    # Three differences cancel where y is small.
    with context.workprec(context.prec + max(0, 3 * bits) + max(0, -bits) + 16):
        x = mpf_of(y, context)
        end = context.exp(-x)
        one = ((1 - end) / x - end) / x
        return +one, (2 * one - end) / x
