"""The weak-noise expansion T_N as a quotient of two sums of e^{lam height} times powers of lam.

`symasym.asymptotics.weak_noise.compose` adds T_N up from numbers; here the same code is given
formal sums instead, so that what is proved is proved of that very expression.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.asymptotics.proofs.dominance import Key, Labels, key_of
from symasym.asymptotics.weak_noise.compose import mean_time, sides_of
from symasym.asymptotics.weak_noise.one_sided import OneSided
from symasym.asymptotics.weak_noise.series import Series
from symasym.numbers.arithmetic import Number
from symasym.numbers.balls import NotProved, exact_ball, flint_module
from symasym.series.taylor_models import Model, Range, SmallTerm, SmallTerms

if TYPE_CHECKING:
    from flint import arb

# Digits of the expansion's coefficients that are trusted, of those they are computed with.
_LOST = 20

#: Coefficients of powers of y = lam^(-1/2).
Powers = dict[int, Any]


class Height(NamedTuple):
    """An exponent, lam times `value`, of e^{lam V} (sign 1) or of e^{-lam V}."""

    value: Any
    sign: int

    def __sub__(self, change: FormalSum) -> Height:
        return Height(self.value - change.number(), self.sign)


class Quotient(NamedTuple):
    over: FormalSum
    under: FormalSum


class FormalSum:
    """A sum over keys of e^{lam height(key)} times powers of y."""

    __slots__ = ("parts",)

    def __init__(self, parts: dict[Key, Powers]) -> None:
        self.parts = parts

    def number(self) -> Any:
        """The number as a sum, with the rounding of an mpf."""
        if not self.parts:
            return flint_module().arb(0)
        ((key, powers),) = self.parts.items()
        ((power, value),) = powers.items()
        assert (key, power) == ((), 0)
        return value

    def __add__(self, other: FormalSum | Number) -> FormalSum:
        parts = {key: dict(powers) for key, powers in self.parts.items()}
        for key, powers in _sum(other).parts.items():
            mine = parts.setdefault(key, {})
            for power, c in powers.items():
                mine[power] = mine[power] + c if power in mine else c
        return FormalSum(parts)

    __radd__ = __add__

    def __neg__(self) -> Any:
        return self * -1

    def __sub__(self, other: FormalSum | Number) -> Any:
        return self + -_sum(other)

    def __mul__(self, other: FormalSum | Number) -> Any:
        parts: dict[Key, Powers] = {}
        for first, mine in self.parts.items():
            for second, theirs in _sum(other).parts.items():
                into = parts.setdefault(key_of([*first, *second]), {})
                for p, a in mine.items():
                    for q, b in theirs.items():
                        into[p + q] = into[p + q] + a * b if p + q in into else a * b
        return FormalSum(parts)

    __rmul__ = __mul__

    def __truediv__(self, other: FormalSum | Number) -> Any:
        if not self.parts:
            return self
        try:
            return self * _sum(other).inverse()
        except ValueError:
            return Quotient(self, other)

    def __rtruediv__(self, other: FormalSum | Number) -> Any:
        return _sum(other) * self.inverse()

    def inverse(self) -> FormalSum:
        """1 over a sum of one term."""
        ((key, powers),) = self.parts.items()
        ((power, value),) = powers.items()
        return FormalSum({tuple((label, -n) for label, n in key): {-power: 1 / value}})


def _sum(x: Number) -> FormalSum:
    """The number as a sum."""
    if isinstance(x, FormalSum):
        return x
    return FormalSum({(): {0: flint_module().arb(x)}} if x else {})


class Formal:
    """Formal sums for `weak_noise.compose`; `top` is the largest y."""

    rounding = 0.0

    def __init__(self, labels: Labels, digits: int, order: int, top: arb) -> None:
        self._labels, self._order, self._top = labels, order, top
        self.radius = flint_module().arb(10) ** (_LOST - digits)

    def leaf(self, height: Height | float, series: Series, rounding: float = 0.0) -> FormalSum:
        """e^{lam height} times the series, to the order."""
        key: Key = ()
        if isinstance(height, Height):
            label = self._labels.find(height.sign * height.value)
            key = key_of([(label, height.sign)])
        powers: Powers = {}
        for part in series.parts:
            for n, c in enumerate(part.coefficients[: self._order + 1]):
                if not c:
                    continue
                power, value = int(2 * (part.offset + n)), self.number(c).number()
                for _ in range(part.logs):
                    power, value = power - 1, value * self._log()
                powers[power] = powers[power] + value if power in powers else value
        return FormalSum({key: powers} if powers else {})

    def total(self, terms: list[FormalSum]) -> FormalSum:
        """The sum."""
        return sum(terms, FormalSum({}))

    def _log(self) -> Any:
        """log(lam) = -2 log(y), as c/y with |c| <= 2 y |log(y)|."""
        flint = flint_module()
        most = (2 / flint.arb(1).exp()).max(2 * self._top * self._top.log())
        return flint.arb(0, most.upper())

    def number(self, x: Number) -> Any:
        """The number as a sum, with the rounding of an mpf."""
        if isinstance(x, (FormalSum, Height)):
            return x
        if isinstance(x, (int, Fraction)):
            return _sum(exact_ball(Fraction(x)))
        return _sum(self.ball(x))

    def ball(self, x: Number) -> Any:
        """A number of the expansion, with its roundings."""
        flint = flint_module()
        sign, mantissa, exponent, _ = x._mpf_
        value = flint.arb(int(mantissa)) * flint.arb(2) ** int(exponent) * (-1 if sign else 1)
        return value + flint.arb(0, (abs(value) * self.radius).upper())


def expansion(
    both: tuple[OneSided, OneSided], r: Fraction, ops: Formal
) -> tuple[FormalSum, FormalSum]:
    """T_N/lam as a quotient."""
    left, right = (_with_heights(one, ops) for one in both)
    quotient = mean_time(sides_of((left, right), ops.number(r), ops))
    if not isinstance(quotient, Quotient):
        raise NotProved
    return quotient.over, quotient.under


def _with_heights(one: OneSided, ops: Formal) -> OneSided:
    """The expansion with its heights as exponents of formal sums."""
    beyond = one.beyond
    if beyond is not None:
        u, height, slope = beyond
        beyond = u, Height(_height(height, ops), 1), slope
    return one._replace(
        rising=[p._replace(height=Height(_height(p.height, ops), 1)) for p in one.rising],
        falling=[p._replace(height=Height(_height(p.height, ops), -1)) for p in one.falling],
        beyond=beyond,
    )


def _height(x: Number, ops: Formal) -> Any:
    """Small ones are differences: their error is not relative."""
    return ops.ball(x) + flint_module().arb(0, ops.radius.upper())


def split(total: FormalSum, labels: Labels, over: Range) -> tuple[Key, Model, SmallTerms]:
    """The part with the largest exponent, and all else relative to its exponential."""
    flint = flint_module()
    parts = {key: p for key, p in total.parts.items() if p}
    if not parts:
        raise NotProved
    best = max(parts, key=lambda key: labels.height(key).mid())
    top = labels.height(best)
    small = []
    for key, powers in parts.items():
        if key != best:
            gap = (top - labels.height(key)).lower()
            small += [SmallTerm(abs(c).upper(), p, gap) for p, c in powers.items()]
    powers = parts[best]
    first = min(powers)
    kept = tuple(powers.get(first + k, flint.arb(0)) for k in range(over.terms))
    rest = flint.arb(0)
    for power, c in powers.items():
        beyond = power - first - over.terms
        if beyond >= 0:
            rest += abs(c) * over.top**beyond
    return best, Model(first, kept, rest.upper(), over), tuple(small)
