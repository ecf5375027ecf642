"""Panels of the arbitrary-precision sweeps: the numbers of `symasym.exact.float_panels`, when
needed.

In a stiff scene most panels only scale what comes in: their own share is
below the last digit. Every panel therefore knows `end`, and bounds on the
rest; its integrals are computed when a sweep asks.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property
from typing import Any

from symasym.base.contexts import mpf_of
from symasym.base.errors import AccuracyError
from symasym.drift.taylor_field import ExactField
from symasym.exact.sweep import Deferred, Record
from symasym.exact.taylor_recurrences import (
    beyond_floats,
    constant_moments,
    guard_bits,
    integers,
    layer,
    recurrence,
    slow_integral,
    terms_needed,
)
from symasym.numbers.rationals import Rational


class Numbers:
    """One context's view of rationals."""

    def __init__(self, lam: Fraction, context: Any) -> None:
        self.context = context
        self.lam_exact = lam
        self.lam = self.mpf(lam)

    def mpf(self, x: Fraction) -> Any:
        return mpf_of(x, self.context)

    def exponential(self, rise: Fraction) -> Any:
        """exp(-|rise|) to full relative precision, however large `rise` is."""
        extra = max(0, rise.numerator.bit_length() - rise.denominator.bit_length())
        with self.context.workprec(self.context.prec + extra + 4):
            return self.context.exp(-abs(self.mpf(rise)))


class Panel:
    """An interval, with u running from left to right.

    Attributes
    ----------
    up : bool
        Whether V rises; it says which scaling the other numbers have (`Record`).
    end : mpf
        exp(-lam |V(b) - V(a)|).
    bound : mpf
        ``int_e, int_inverse <= bound``.
    nested_bound : mpf
        ``nested <= nested_bound``.
    """

    up: bool
    end: Any
    bound: Any
    nested_bound: Any

    int_e: Any
    int_inverse: Any
    nested: Any

    def record(self, tiny: Any) -> Record:
        """Its numbers for a sweep, in which a term below `tiny` of the whole is not computed."""
        return Record(
            Deferred(lambda: self.int_e, lambda: self.bound, tiny),
            Deferred(lambda: self.int_inverse, lambda: self.bound, tiny),
            Deferred(lambda: self.nested, lambda: self.nested_bound, tiny),
            1 if self.up else self.end,
            self.end if self.up else 1,
        )


class Constant(Panel):
    """A panel of any width with constant drift."""

    def __init__(self, numbers: Numbers, drift: Fraction, width: Fraction) -> None:
        h = numbers.mpf(width)
        x = numbers.lam_exact * drift * width
        self.up = x < 0
        self.end, first, second = constant_moments(x, numbers.context)
        self.int_e = self.int_inverse = self.bound = h * first
        self.nested = self.nested_bound = h * h * second


def _log_size(x: Any) -> float:
    """At least log |x|, also where x is no float64."""
    if not x:
        return -math.inf
    bits = int(abs(x.numerator).bit_length() - x.denominator.bit_length() + 1)
    return bits * math.log(2)


class Taylor(Panel):
    """A panel whose exponent varies by at most the reach, by Taylor recurrences.

    Parameters
    ----------
    c : list of Fraction
        Taylor coefficients of phi at the left end, in units of the width `h`.
    """

    def __init__(self, numbers: Numbers, c: list[Fraction], h: Fraction) -> None:
        context = numbers.context
        q = [numbers.lam_exact * h * x for x in c]
        rise = -sum((x / (k + 1) for k, x in enumerate(q)), Rational(0))
        size = [abs(float(x)) / (k + 1) for k, x in enumerate(q)]
        reach = sum(size)
        self._numbers, self._h = numbers, numbers.mpf(h)
        self._bits = context.prec + guard_bits(reach)
        self._q, self._denominator = integers(q, self._bits)
        logs = [_log_size(x) for x in q] if beyond_floats(len(q)) else []
        self._count = terms_needed(size, self._bits, logs)
        self.up = rise > 0
        self.end = numbers.exponential(rise)
        spread = context.exp(2 * reach)
        self.bound = self._h * spread
        self.nested_bound = self._h * self.bound

    def _solve(self, source: bool) -> tuple[Any, Any]:
        total, integral = recurrence(self._q, self._denominator, self._bits, self._count, source)
        # Downwards int_e, int_inverse and nested are those of the left end times e(b).
        unit = self._h * self._numbers.context.ldexp(1, -self._bits)
        if not self.up:
            unit *= self.end
        return total * unit, integral * unit

    @cached_property
    def _n(self) -> tuple[Any, Any]:
        return self._solve(True)

    @property
    def int_e(self) -> Any:
        return self._n[0]

    @cached_property
    def int_inverse(self) -> Any:
        return self._solve(False)[1]

    @property
    def nested(self) -> Any:
        return self._n[1] * self._h


class Slow(Panel):
    """A panel where lam|phi| is so large that the integrals live in layers at its ends.

    Parameters
    ----------
    edges : (centre, t0, t1)
        The panel is [centre + t0, centre + t1].
    terms : (count, rounds)
        Terms of the Taylor and of the slow series.
    least : float
        A lower bound on |phi|.
    """

    def __init__(
        self,
        numbers: Numbers,
        field: ExactField,
        edges: tuple[Fraction, Fraction, Fraction],
        terms: tuple[int, int],
        least: float,
    ) -> None:
        self._numbers, self._field = numbers, field
        self._centre, self._t0, self._t1 = edges
        self._half = (self._t1 - self._t0) / 2
        self._count, self._rounds = terms
        rise = -numbers.lam_exact * field.integral(*edges, self._count)
        self.up = rise > 0
        # Above 2 prec ln 2 by construction: what a layer leaves at the far end is nothing.
        self.end = numbers.exponential(rise)
        self.bound = 2 / (numbers.lam * least)
        self.nested_bound = numbers.mpf(2 * self._half) * self.bound if self.up else self.bound**2

    @property
    def cost(self) -> int:
        """Roughly the number of coefficients that `int_e` and `int_inverse` take."""
        return self._rounds**2

    def _lam_phi(self, t: Fraction, count: int) -> list[Any]:
        c = self._field.taylor(self._centre + t, self._half, count)
        scale = self._numbers.lam_exact * self._half * (-1 if self.up else 1)
        return [self._numbers.mpf(scale * x) for x in c] + [self._numbers.context.zero] * (
            count - len(c)
        )

    @cached_property
    def _following(self) -> Any:
        """The solution that follows the drift, at the right end."""
        phi = self._lam_phi(self._t1, self._rounds + 1)
        return layer(phi, True, self._numbers.context) * self._numbers.mpf(self._half)

    @cached_property
    def _opposing(self) -> Any:
        """The solution that opposes the drift, at the left end."""
        phi = self._lam_phi(self._t0, self._rounds + 1)
        return layer(phi, False, self._numbers.context) * self._numbers.mpf(self._half)

    @property
    def int_e(self) -> Any:
        return self._following if self.up else self._opposing

    @property
    def int_inverse(self) -> Any:
        return self._opposing if self.up else self._following

    @cached_property
    def nested(self) -> Any:
        context = self._numbers.context
        if not self.up:
            return self._opposing * self._following
        # Upwards: the integral of the following solution that starts at zero.
        first = layer(self._lam_phi(self._t0, self._rounds + 1), True, context)
        half = self._numbers.mpf(self._half)
        return half * half * self._whole() - half * first * self._opposing

    def _whole(self) -> Any:
        count = self._count
        for _ in range(4):
            phi = self._lam_phi((self._t0 + self._t1) / 2, count)
            found = slow_integral(phi, count, self._rounds, True, self._numbers.context)
            if found is not None:
                return found
            count *= 2
        raise AccuracyError(
            f"the Taylor series of A at u = {float(self._centre + self._t0):.6g} converges too "
            "slowly for the digits asked for; ask for fewer digits."
        )
