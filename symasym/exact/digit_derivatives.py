"""Derivatives of the exact integrals with respect to every parameter, to any number of digits.

The sweeps of `symasym.exact.digits` with numbers that carry their derivatives (`Dual`). On a panel
of unit width let y' = q y + 1 (N, from 0) or y' = q y (1/e, from 1), q = lam phi h. From the right
end, s = 1 - w, the same equations with q(1 - s) give M = int_w^1 e(w)/e(x) dx and E = e(w)/e(1),
and by Fubini's theorem

    d/dq_k int 1/e = int s^{k+1}/e ds/(k + 1),
    d/dq_k N(1)    = (N(1) - int w^{k+1} E dw)/(k + 1),
    d/dq_k int N   = (int s^{k+1} N ds - int w^{k+1} M dw)/(k + 1).

So four recurrences, not two, give the derivatives in all parameters. A solution without layers,
M' = 1 - psi M, is at each point the integral of e^{psi_0 t + psi_1 t^2/2 + ...} over t < 0, and
changes by its moments (`digit_panels.slow_moments`). The directions are
those of `symasym.exact.balls.derivatives`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from operator import floordiv, mul
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of, own_context, step, to_mpf
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField, dyadic
from symasym.exact import sweep
from symasym.exact.balls.derivatives import Dual, derivative_of
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
    slow_moments,
    terms_needed,
)
from symasym.exact.digits import Partition, swept_scene
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
# Rounds of the slow series beyond those of its value; bits of which both have fewer in common.
_MORE_ROUNDS, _AGREED = 8, 24
# Radii of disks about a Taylor panel, in units of four times its width.
_MORE = (4, 1)
# Radii of disks about a slow panel: powers of that of its value.
_POWERS = (0.95, 0.85, 0.7)


def log_slopes(
    quantity: str, drift: Drift, numbers: dict[str, Fraction], dps: int, size: int
) -> tuple[Any, dict[str, Any]]:
    """log(quantity), and its derivatives by each parameter of the drift, kappa, and r and start.

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
    with own_context(dps) as context:
        changes = [derivative_of(drift, name) for name in drift.parameters]
        names = [*drift.parameters, "kappa", *(["r"] if "r" in numbers else [])]
        sides = [
            _Side(drift, changes, mirrored, numbers, dps + size + _GUARD, context)
            for mirrored in ((False, True) if "r" in numbers else (False,))
        ]
        ends = (numbers["start"], -numbers["start"]) if "r" in numbers else (Fraction(1),)
        for side, end in zip(sides, ends, strict=True):
            side.scene.expect(-numbers.get("r", Fraction(1)), end)
        if "r" not in numbers:
            inside, outside = sides[0].occupation(quantity == "1 - P")
            log = formulas.log_occupation_share(context, known(inside).value, known(outside).value)
            found = formulas.occupation_share(inside, outside).log_slopes(names)
            return to_mpf(log, dps), {name: to_mpf(x, dps) for name, x in found.items()}
        r, start = numbers["r"], numbers["start"]
        left, right = (side.absorbed(-r, x) for side, x in zip(sides, (start, -start), strict=True))
        if quantity == "T":
            time = sweep.escape_time(left, right)
            log, found = context.log(time.value), time.log_slopes(names)
            from_left, from_right = (known(side.w).value for side in (left, right))
            change = from_right / left.sigma.value - from_left / right.sigma.value
            found["start"] = change / (from_left + from_right)
        else:
            if quantity == "1 - C":
                left, right = right, left
            log = formulas.log_exit_share(context, left.sigma.value, right.sigma.value)
            found = formulas.exit_share(left.sigma, right.sigma).log_slopes(names)
            found["start"] = (1 if quantity == "1 - C" else -1) / right.sigma.value
        return to_mpf(log, dps), {name: to_mpf(x, dps) for name, x in found.items()}


class _Side:
    """One scene, or its mirror image, and its changes per unit of each parameter."""

    def __init__(
        self, drift: Drift, changes: Sequence[Drift], mirrored: bool,
        numbers: dict[str, Fraction], dps: int, context: MPContext,
    ) -> None:  # fmt: skip
        kappa, reach = numbers["kappa"], numbers.get("r", Fraction(1))
        # Both sides of a start change by 1/r, of which only the difference may be left.
        dps += max(0, math.ceil(0.4343 * log_size(1 / reach)))
        self.scene: Partition = swept_scene(drift, mirrored, 2 / kappa**2, reach, dps, context)
        self.numbers = self.scene.numbers
        self.changes = [ExactField(change, mirrored, context) for change in changes]
        for change in self.changes:
            change.resolve()
        self.scene.changes = self.changes
        self.of_kappa = Rational(-2 / kappa)
        #: Whether r is one of the parameters, the last.
        self.ends = "r" in numbers

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
        tiny = self.scene.tiny
        for k, panel in enumerate(self.scene.panels(Rational(start), Rational(end))):
            moved = absorbed and k == 0
            if moved:
                # sigma changes by its inverse as the end moves.
                tiny *= min(1, panel.bound)
            yield _Changed(panel, self, moved).record(tiny)

    def absorbed(self, start: Fraction, end: Fraction) -> Swept:
        """sigma and w at `end`, absorbed at `start`, which r moves."""
        lam = self.numbers.lam
        none = self.numbers.context.zero
        slope = self.numbers.mpf(self.of_kappa) * lam
        return sweep.absorbed(
            self.records(start, end, self.ends), Dual(lam, self.row(lambda _: none, slope))
        )

    def occupation(self, complement: bool) -> tuple[Dual, Dual]:
        """`sweep.layer_times`; both depend on lam and phi through lam phi alone."""
        records = self.records(Fraction(-1), Fraction(1), False)
        layer = sweep.in_layer(records, self.numbers.lam, self.value(-1))
        return sweep.layer_times(layer, formulas.tail_right(self.value(1)), complement)


class _Changed:
    """A panel and its changes."""

    def __init__(self, panel: Panel, side: _Side, end: bool) -> None:
        self.panel, self.side, self.moved = panel, side, end
        self._changes: list[list[Any]] | None = None

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
            ratios = [dyadic(panel.radius**x, 8) for x in _POWERS]
            for field in side.changes:
                self._require_resolved(field, middle, panel.half, panel.count + MORE_TERMS, ratios)
        number, sign = side.numbers.mpf, 1 if panel.up else -1
        if isinstance(panel, Taylor):
            rises = [sum(x / (k + 1) for k, x in enumerate(row)) for row in self._rows(panel)]
        else:
            rises = [side.numbers.lam_exact * panel.integral(field) for field in side.changes]
        return side.listed([number(sign * x) for x in rises]
                           + [number(-side.of_kappa * abs(panel.rise))])  # fmt: skip

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
        panel = self.panel
        if isinstance(panel, Taylor):
            value, slopes = self._of_taylor(panel, k)
        else:
            value = getattr(panel, ("int_e", "int_inverse", "nested")[k])
            slopes = self._of_slow(panel, k) if isinstance(panel, Slow) else self._of_constant[k]
        if self.moved:
            # The left end moves outwards.
            rate, end = self._rate, panel.end
            slopes[-1] = (
                (end, 1 + rate * panel.int_inverse, panel.int_inverse)[k] if panel.up else
                (1 - rate * panel.int_e, end, panel.int_inverse - rate * panel.nested)[k]
            )  # fmt: skip
        return Dual(value, slopes)

    # -- a constant drift ------------------------------------------------------------------------

    @cached_property
    def _of_constant(self) -> tuple[Any, Any, Any]:
        """By the moments of e^{-y t}, y being lam |phi| times the width."""
        panel, numbers = self.panel, self.side.numbers
        assert isinstance(panel, Constant)
        h = numbers.mpf(panel.width)
        one, two = _moments(abs(panel.rise), numbers.context)
        # y grows as log `end` falls.
        # An array comes first in products: mpf would print it before it gives up.
        first = self._rise * (h * one)
        return first, first.copy(), self._rise * (h * h * (one - two if panel.up else two))

    # -- Taylor series ---------------------------------------------------------------------------

    def _of_taylor(self, panel: Taylor, k: int) -> tuple[Any, Any]:
        """int_e, int_inverse or nested and its changes, by the moments of one series or two."""
        side, four = self.side, self._solutions
        value, change = four.int_e() if k == 0 else four.int_inverse() if k == 1 else four.nested()
        each = [x // (j + 1) for j, x in enumerate(change)]
        mpf, h = side.numbers.context.mpf, side.numbers.mpf(panel.width)
        slopes = [mpf(sum(map(mul, c, each))) / below for c, below in four.directions]
        slopes[-1] *= side.numbers.mpf(side.of_kappa)
        scale = h * side.numbers.context.ldexp(1, -four.bits)
        if k == 2:
            scale *= h
        if panel.up:
            return value * scale, side.listed(slopes) * scale
        scale *= panel.end
        return value * scale, side.listed(slopes) * scale + self._rise * (value * scale)

    @cached_property
    def _solutions(self) -> _Solutions:
        """The four series of the panel."""
        assert isinstance(self.panel, Taylor)
        return _Solutions(self.panel, self._rows(self.panel), self.side.numbers.context)

    def _rows(self, panel: Taylor) -> list[list[Any]]:
        """Taylor coefficients of the changes of lam phi times the width, in units of it."""
        if self._changes is None:
            lam = self.side.numbers.lam_exact * panel.width
            self._changes = [
                [lam * x for x in self._taylor(field, panel)] for field in self.side.changes
            ]
        return self._changes

    def _taylor(self, field: ExactField, panel: Taylor) -> list[Any]:
        """Taylor coefficients of a change at the panel's left end, in units of its width."""
        if field.is_polynomial:
            return field.taylor(panel.left, panel.width, 0)
        step()
        h, scene = panel.width, self.side.scene
        most = scene.order() + MORE_TERMS
        for more in _MORE:
            terms = scene.terms(h, field.spread(panel.left, 4 * more * h), more)
            if terms <= most:
                return field.taylor(panel.left, h, int(terms))
        raise _slow_convergence()

    def _require_resolved(
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

    def _of_slow(self, panel: Slow, k: int) -> Any:
        """By the derivatives of the solutions without layers at the ends, and between them."""
        if k < 2:
            return self._following if panel.up == (k == 0) else self._opposing
        following, opposing = self._following, self._opposing
        if not panel.up:
            return opposing * panel.following + following * panel.opposing
        first = self._at(panel, panel.t0, panel.first, 1)
        whole = self._over(panel, first, following) * self.side.numbers.mpf(panel.half)
        return whole - first * panel.opposing - opposing * panel.first

    @cached_property
    def _following(self) -> Any:
        """Changes of the solution that follows the drift, at the right end."""
        panel = self.panel
        assert isinstance(panel, Slow)
        return self._at(panel, panel.t1, panel.following, 1)

    @cached_property
    def _opposing(self) -> Any:
        """Changes of the one that opposes it, at the left end."""
        panel = self.panel
        assert isinstance(panel, Slow)
        return self._at(panel, panel.t0, panel.opposing, -1)

    def _psi(
        self, panel: Slow, t: Fraction, count: int, sign: int = 1
    ) -> tuple[list[Any], list[list[Any]]]:
        """Taylor coefficients in `sign` s of lam |phi| half about t, s from there, and of each of
        its changes."""
        numbers, scale = self.side.numbers, self.side.numbers.lam_exact * panel.half
        scale = -scale if panel.up else scale

        def about(field: ExactField) -> list[Any]:
            c = field.taylor(panel.centre + t, panel.half, count)[:count]
            return [numbers.mpf(scale * x * sign**k) for k, x in enumerate(c)]

        psi = about(self.side.scene.field)
        of_kappa = numbers.mpf(self.side.of_kappa)
        return psi, [*map(about, self.side.changes), [of_kappa * x for x in psi]]

    def _at(self, panel: Slow, t: Fraction, value: Any, sign: int) -> Any:
        """Changes of a solution without layers at one point, whose `value` is known: with the
        `sign` 1 of the one that follows the drift, with -1 of the other."""
        context, rounds = self.side.numbers.context, panel.rounds + _MORE_ROUNDS
        psi, changes = self._psi(panel, t, rounds + 2, sign)
        moments = slow_moments(psi, rounds, context)
        half = self.side.numbers.mpf(panel.half)
        if abs(moments[0] * half / value - 1) > context.ldexp(1, _AGREED - context.prec):
            raise _slow_convergence()
        by_psi = [x / k for k, x in enumerate(moments) if k]
        slopes = [sum(map(mul, c, by_psi), context.zero) for c in changes]
        return self.side.listed(slopes) * half

    def _over(self, panel: Slow, at_left: Any, at_right: Any) -> Any:
        """Changes of the integral of the following solution M over the panel, from its changes at
        the ends: with the opposing solution Q, (Q dM)' = -dM - dpsi M Q."""
        context = self.side.numbers.context
        _, changes = self._psi(panel, (panel.t0 + panel.t1) / 2, panel.count + MORE_TERMS)
        psi, m, q = panel.inside
        last, bits = len(m) - panel.rounds - 1, context.prec + 32
        m, q = m[:last], q[:last]
        both = [x >> bits for x in _product(m, q)]
        unit = context.ldexp(1, -bits) / psi
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
        inside = self.side.listed(weighted) * (unit / psi) * self.side.numbers.mpf(panel.half)
        return at_left * (left * unit) - at_right * right - inside


class _Solutions:
    """The four solutions on a Taylor panel (see the module), in fixed point.

    `directions` are the changes of lam phi times the width and, last, itself: whole numbers and
    their denominator. The methods give a number of the panel in units of 2^-bits and, for each
    Taylor coefficient, k + 1 times its change.
    """

    def __init__(self, panel: Taylor, rows: list[list[Any]], context: MPContext) -> None:
        # Coefficients that are rounding alone would grow about the other end.
        tiny = max(map(abs, panel.q)) / (1 << (context.prec - 32))
        own, *changes = (_trimmed(row, tiny) for row in (panel.q, *rows))
        self._count = max(map(len, [own, *changes]))
        backwards = [-x if k % 2 else x for k, x in enumerate(shifted(own, Rational(1)))]
        reach = max(sum(abs(float(x)) / (k + 1) for k, x in enumerate(c)) for c in (own, backwards))
        self.bits = bits = context.prec + guard_bits(reach)
        q, self._denominator = integers(own, bits)
        back = [-x if k % 2 else x for k, x in enumerate(shifted(q, 1))]
        self.directions = [*(integers(row, bits) for row in changes), (q, self._denominator)]
        terms = [_terms(c, self._denominator, bits) for c in (q, back)]
        if terms[1] > _MOST_TERMS * terms[0]:
            raise _slow_convergence()
        self._left, self._right = (q, terms[0]), (back, terms[1])

    def _from(self, side: tuple[list[Any], int], source: bool) -> list[Any]:
        """Taylor coefficients of the solution with a source or without."""
        q, terms = side
        return _series(q, self._denominator, self.bits, terms, source)

    @cached_property
    def _n(self) -> list[Any]:
        """Those of N."""
        return self._from(self._left, True)

    def int_e(self) -> tuple[Any, list[Any]]:
        """N(1)."""
        total = sum(self._n)
        moments = _moments_at_right(self._from(self._right, False), self._count)
        return total, [total - x for x in moments[1:]]

    def int_inverse(self) -> tuple[Any, list[Any]]:
        """int 1/e."""
        value, *moments = _moments_at_left(self._from(self._left, False), self._count)
        return value, moments

    def nested(self) -> tuple[Any, list[Any]]:
        """int N."""
        value, *of_n = _moments_at_left(self._n, self._count)
        of_m = _moments_at_right(self._from(self._right, True), self._count)
        return value, [a - b for a, b in zip(of_n, of_m[1:], strict=True)]


def _product(a: list[Any], b: list[Any]) -> list[Any]:
    """The first coefficients, as many as of each, of the product of two polynomials over the whole
    numbers: one product of numbers whose digits they are (Kronecker's substitution)."""
    count = len(a)
    bits = sum(max(map(abs, c)).bit_length() for c in (a, b)) + count.bit_length() + 2
    width = bits // 8 + 1
    half = 1 << (8 * width - 1)

    def number(digits: Iterable[Any]) -> Any:
        """The number with these digits, of which none is negative."""
        return context_integer(
            int.from_bytes(b"".join(int(x).to_bytes(width, "little") for x in digits), "little")
        )

    low, high = number([half] * count), number([half] * 2 * count)
    one, two = (number(x + half for x in c) - low for c in (a, b))
    data = int(one * two + high).to_bytes(2 * count * width, "little")
    places = range(0, count * width, width)
    return [context_integer(int.from_bytes(data[k : k + width], "little") - half) for k in places]


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
    end = len(series) + 1
    return [sum(map(floordiv, series, range(k + 1, end + k))) for k in range(count + 1)]


def _moments_at_right(series: list[Any], count: int) -> list[Any]:
    """int_0^1 (1 - s)^k y ds, k = 0, ..., count, by Euler's beta function."""
    end = len(series) + 1
    terms = list(map(floordiv, series, range(1, end)))
    moments = [sum(terms)]
    for k in range(1, count + 1):
        terms = [k * x // n for n, x in enumerate(terms, k + 1)]
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
