"""How the arbitrary-precision sweeps cut [-r, r] into panels (see `symasym.exact.taylor`)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from symasym.errors import AccuracyError
from symasym.exact.local import ExactField, dyadic
from symasym.exact.taylor import (
    Record,
    constant_record,
    guard_bits,
    integers,
    slow_record,
    taylor_record,
    terms_needed,
)

_MILD_PANELS = 48
_MOST_PIECES = 12
_PANEL_COST = 700  # of a Taylor panel, in terms of a slow series
_DEEPEST = 400


class Slow:
    """A slow panel whose integrals are found only when they matter.

    In a stiff scene most panels only scale what comes in by `end`: sigma and w
    have grown so large that the panel's own share is below the last digit.

    Attributes
    ----------
    up, end
        As in `Record`.
    bound, width : mpf
        ``near <= bound``, ``far <= bound``, ``both <= bound * width``, and
        ``both <= bound**2`` downwards.
    far_floor : mpf
        A lower bound on ``far``.
    """

    def __init__(self, maker: Partition, middle: Fraction, half: Fraction, count: int, rounds: int,
                 slopes: tuple[float, float]) -> None:
        self._maker, self._middle, self._half = maker, middle, half
        self._count, self._rounds = count, rounds
        c = maker.field.taylor(middle, half, count)
        self._scaled = [maker.lam * half * x for x in c]
        rise = -2 * sum(x / (k + 1) for k, x in enumerate(self._scaled) if k % 2 == 0)
        self.up = rise > 0
        self.end = maker.exponential(rise)
        least, most = slopes
        self.width = maker.mpf(2 * half)
        self.bound = 2 / (maker.mpf(maker.lam) * least)
        self.far_floor = 1 / (2 * maker.mpf(maker.lam) * most)
        self._record: Record | None = None

    @property
    def cost(self) -> int:
        return self._count * (self._rounds + 2)

    def record(self) -> Record:
        """The panel's integrals."""
        if self._record is None:
            maker, sign = self._maker, -1 if self.up else 1
            for _ in range(6):
                phi = [maker.mpf(sign * x) for x in self._scaled]
                self._record = slow_record(
                    phi, maker.mpf(self._half), self.up, self.end, self._count, self._rounds,
                    maker.context,
                )
                if self._record:
                    break
                self._count *= 2
                if not maker.field.is_polynomial:
                    c = maker.field.taylor(self._middle, self._half, self._count)
                    self._scaled = [maker.lam * self._half * x for x in c]
            else:
                raise AccuracyError(
                    f"the Taylor series of A at u = {float(self._middle):.6g} converges too slowly "
                    "for the digits asked for; ask for fewer digits."
                )
        return self._record


class Partition:
    """Panels of one scene, in order from left to right.

    Parameters
    ----------
    field : ExactField
    lam : Fraction
    context : mpmath context
        Its precision is the relative precision of the records.
    """

    def __init__(self, field: ExactField, lam: Fraction, context: Any) -> None:
        self.field, self.lam, self.context = field, lam, context
        self.bits = context.prec
        # Where the Taylor recurrences are cheapest: terms per unit of exponent fall with
        # the reach, but guard bits grow with it.
        self.reach = max(16.0, self.bits / 4)

    def mpf(self, x: Fraction) -> Any:
        return self.context.mpf(x.numerator) / x.denominator

    def exponential(self, rise: Fraction) -> Any:
        """exp(-|rise|) to full relative precision, however large `rise` is."""
        extra = max(0, rise.numerator.bit_length() - rise.denominator.bit_length())
        with self.context.workprec(self.context.prec + extra + 4):
            return self.context.exp(-abs(self.mpf(rise)))

    def records(self, start: Fraction, end: Fraction) -> Iterator[Record | Slow]:
        """Panels from `start` to `end`, the outside ones in closed form."""
        if start < -1:
            yield self._constant(Fraction(-1), min(end, Fraction(-1)) - start)
        lo, hi = max(start, Fraction(-1)), min(end, Fraction(1))
        if lo < hi:
            yield from self._inside(lo, hi)
        if end > 1:
            yield self._constant(Fraction(1), end - max(start, Fraction(1)))

    def _constant(self, edge: Fraction, width: Fraction) -> Record:
        x = self.lam * self.field.value(edge) * width
        return constant_record(x, self.mpf(width), self.context)

    def _inside(self, lo: Fraction, hi: Fraction) -> Iterator[Record | Slow]:
        grid = [lo + (hi - lo) * Fraction(k, 16) for k in range(17)]
        mean = sum(abs(self.field.value(u)) for u in grid) / 17
        if self.lam * mean * (hi - lo) <= _MILD_PANELS * self.reach:
            yield from self._taylor(Fraction(0), lo, hi)
            return
        for centre, t0, t1 in self._graded(lo, hi):
            yield from self._block(centre, t0, t1, 0)

    def _graded(self, lo: Fraction, hi: Fraction) -> Iterator[tuple[Fraction, Fraction, Fraction]]:
        """Blocks (centre, t0, t1) that start or stop at the zeros of A and at the ends.

        Measuring from a zero keeps the digits of phi beside it; `_block` halves
        towards it as far as it must.
        """
        marks = [lo, *self._zeros(lo, hi), hi]
        for left, right in zip(marks, marks[1:], strict=False):
            # A short split point keeps the rationals of the blocks short.
            half = dyadic((right - left) / 2, 8 + _places(right - left))
            yield left, Fraction(0), half
            yield right, half - (right - left), Fraction(0)

    def _zeros(self, lo: Fraction, hi: Fraction) -> list[Fraction]:
        """Short dyadic approximations, finer than any layer, of the zeros of A inside."""
        places = 40 + max(0, _places(1 / (1 + self.lam)))
        found = sorted({dyadic(x, places) for x in self.field.zeros(lo, hi)})
        return [x for x in found if lo < x < hi]

    def _block(
        self, centre: Fraction, t0: Fraction, t1: Fraction, depth: int
    ) -> Iterator[Record | Slow]:
        """A block by layers where that is exact to working precision, else by Taylor panels."""
        if depth > _DEEPEST:
            raise AccuracyError(
                f"the drift varies too fast near u = {float(centre):.6g} to reach the digits "
                "asked for; ask for fewer digits or smooth A there."
            )
        middle, half = centre + (t0 + t1) / 2, (t1 - t0) / 2
        near = [float(c) for c in self.field.taylor(middle, half, 16)]
        pieces = 2 * float(self.lam * half) * sum(abs(c) for c in near) / self.reach
        slow = self._slow_plan(near, middle, half) if pieces > 2 else None
        if slow and slow.cost < pieces * _PANEL_COST:
            yield slow
            return
        if pieces <= _MOST_PIECES:
            yield from self._taylor(centre, t0, t1)
            return
        if slow:
            yield slow
            return
        split = (t0 + t1) / 2
        yield from self._block(centre, t0, split, depth + 1)
        yield from self._block(centre, split, t1, depth + 1)

    def _slow_plan(self, near: list[float], middle: Fraction, half: Fraction) -> Slow | None:
        """The panel as layers at its ends, or None where the slow series is too short for that.

        Parameters
        ----------
        near : list of float
            Taylor coefficients of phi in units of `half` about `middle`.
        """
        spread = sum(abs(c) for c in near[1:])
        least = abs(near[0]) - spread
        scale = float(self.lam * half)
        if least <= 0.05 * abs(near[0]) or scale * least < self.bits:
            return None
        slope = sum(k * abs(c) for k, c in enumerate(near))
        # |t_{k+1}/t_k| is at most about (2k+1) epsilon.
        epsilon = slope / (scale * least) / least
        size, rounds = 0.0, 0
        while size > -self.bits - 8:
            if (2 * rounds + 1) * epsilon > 0.7:
                return None
            size += math.log2(max((2 * rounds + 1) * epsilon, 1e-300))
            rounds += 1
        radius = 1.0
        while radius < 64 and sum(
            abs(c) * (1.1 * radius) ** k for k, c in enumerate(near) if k
        ) < 0.9 * abs(near[0]):
            radius *= 1.1
        if radius < 1.3:
            return None
        count = int(1.15 * (self.bits + 40) / math.log2(radius)) + 2 * rounds + 8
        return Slow(self, middle, half, count, rounds, (least, abs(near[0]) + spread))

    def _taylor(self, centre: Fraction, t0: Fraction, t1: Fraction) -> Iterator[Record | Slow]:
        """Panels from t0 to t1, each as wide as is cheapest."""
        t = t0
        while t < t1:
            here = centre + t
            h, order = self._width(here, t1 - t)
            c = self.field.taylor(here, h, order)
            scale = self.lam * h
            q = [scale * x for x in c]
            rise = -sum(x / (k + 1) for k, x in enumerate(q))
            reach = sum(abs(float(x)) / (k + 1) for k, x in enumerate(q))
            exact, denominator = integers(q, self.bits + guard_bits(reach))
            yield taylor_record(
                exact, denominator, self.mpf(h), rise > 0, self.exponential(rise), self.bits, reach,
                self.context,
            )
            t += h

    def _width(self, here: Fraction, most: Fraction) -> tuple[Fraction, int]:
        """Width of the next panel, and the number of Taylor coefficients of phi it needs."""
        order, h = 24, most
        sizes = [abs(float(self.lam * c)) for c in self.field.taylor(here, Fraction(1), order)]
        if not self.field.is_polynomial:
            # A quarter of the distance to the nearest singularity: two bits a term.
            rate = max(
                (sizes[k] / (max(sizes[:4]) or 1.0)) ** (1 / k) for k in range(order // 2, order)
            )
            h = min(h, dyadic(Fraction(1 / (4 * rate)), 8 + _places(Fraction(1 / rate)))) if rate else h
        def growth(width: Fraction) -> list[float]:
            w = float(width)
            return [s * w ** (k + 1) / (k + 1) for k, s in enumerate(sizes)]

        whole = h == most
        while sum(growth(h)) > self.reach:
            h, whole = h / 2, False
        if not whole:
            # Back up in eighths, so that halving costs little reach.
            base = h
            for eighths in range(15, 8, -1):
                if sum(growth(base * eighths / 8)) <= self.reach:
                    h = base * eighths / 8
                    break
            h = min(dyadic(h, 4 + _places(h)) or h, most)
        cost = self._cost(growth(h), h)
        while h > most / 64 and (less := self._cost(growth(h / 2), h / 2)) < 0.8 * cost:
            h, cost = h / 2, less
        if h < most < h * Fraction(3, 2):
            h = dyadic(most / 2, 4 + _places(most)) or h
        need = self.bits + guard_bits(self.reach)
        return h, len(sizes) if self.field.is_polynomial else need // 2 + 32

    def _cost(self, growth: list[float], width: Fraction) -> float:
        guard = guard_bits(sum(growth))
        return terms_needed(growth, self.bits + guard) * (self.bits + guard + 400) / float(width)


def _places(x: Fraction) -> int:
    """Binary places before the first significant bit of `x` > 0."""
    return x.denominator.bit_length() - x.numerator.bit_length() + 1
