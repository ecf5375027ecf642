"""T over its expansion T_N for all noise below a given one: the constant of the error, proved.

With y = lam^(-1/2), T = lam e^{lam E} (main + what is exponentially smaller), where main is made
of the integrals over the cells of the wells and barriers that dominate
(`symasym.asymptotics.proofs.dominance`): models in y with Cauchy's bound of what they leave out.
T_N is made of the same, cut off, so that all powers up to y^(2N) cancel in the quotient, and what
is left over y^(2N + 2) is bounded on the whole range: `symasym.asymptotics.weak_noise.compose` adds
T_N up from numbers; here the same code is given formal sums of e^{lam height} times powers of y, so
that what is proved is proved of that very expression. See docs/weak-noise-bounds.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import flint

from symasym.asymptotics.laplace.cauchy_disk import THETA
from symasym.asymptotics.proofs.cells import Cell, Extremum, landscape
from symasym.asymptotics.proofs.dominance import (
    Dominance,
    DominantWell,
    Group,
    Key,
    Labels,
    Leading,
    LeadingCell,
    below_height,
    key_of,
)
from symasym.asymptotics.weak_noise.compose import mean_time, sides_of
from symasym.asymptotics.weak_noise.critical_points import both_sides
from symasym.asymptotics.weak_noise.one_sided import OneSided
from symasym.asymptotics.weak_noise.series import Series
from symasym.base.call_context import own_context, step
from symasym.base.errors import SymasymError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.numbers.arithmetic import Number
from symasym.numbers.balls import NotProved, exact_ball, precision
from symasym.series.taylor_models import Model, Range, SmallTerm, SmallTerms, supremum

if TYPE_CHECKING:
    from flint import arb

# Digits of all balls here, and for each order: few are lost, as exponentials are taken relative to
# the largest.
_DIGITS = 90
_MORE_DIGITS = 8
# Ratio of two ends of the pieces that a range is cut into, the most of these, and how little the
# rest of it may add before it counts as one piece.
_RATIO = 0.85
_PIECES = 60
_ENOUGH = 1.005
# Of a coefficient that cancels: balls that are wider would hold 0 in any case.
_NOTHING = 1e-9
# Coefficients kept behind the first that does not cancel.
_MORE = (2, 4, 6, 8)


class _Evaluation:
    """What dominates, on a range of noise."""

    def __init__(self, dominance: Dominance, over: Range) -> None:
        self.dominance, self.over = dominance, over
        self._integrals: dict[int, tuple[Model, SmallTerms]] = {}
        self._least: dict[int, Any] = {}
        # With the group itself, so that its id is not given to another.
        self._most: dict[int, tuple[Group, Any]] = {}

    def integral(self, leading: LeadingCell) -> tuple[Model, SmallTerms]:
        """Over one cell, without its factor e^{lam height}."""
        if leading.cell not in self._integrals:
            self._integrals[leading.cell] = self._integral(self.dominance.cells[leading.cell])
        return self._integrals[leading.cell]

    def _integral(self, cell: Cell) -> tuple[Model, SmallTerms]:
        """The integral over one cell: Laplace with a tail bound, or in closed form."""
        if cell.peak is not None:
            return _peak(cell.peak, self.over)
        assert cell.slope is not None
        size = 1 / exact_ball(abs(cell.slope))
        fall = exact_ball(abs(cell.slope) * (cell.stop - cell.start))
        coefficients = (size, *[flint.arb(0)] * (self.over.terms - 1))
        return Model(2, coefficients, flint.arb(0), self.over), (SmallTerm(size, 2, fall),)

    def sum_of(self, group: Group) -> tuple[Model, SmallTerms]:
        """The integral over the cells of a group."""
        models = [self.integral(s) for s in group.leading]
        total, small = models[0]
        for model, more in models[1:]:
            total, small = total + model, small + more
        return total, small + group.others

    def least(self, leading: LeadingCell) -> tuple[Any, int]:
        """A lower bound of y^(-power) times the integral over a cell, and that power."""
        model, small = self.integral(leading)
        if leading.cell not in self._least:
            self._least[leading.cell] = _surely(model, small, self.over)
        return self._least[leading.cell], model.power

    def most(self, group: Group) -> tuple[Any, int]:
        """An upper bound of y^(-power) times the integral over a group, and that power."""
        if id(group) not in self._most:
            model, small = self.sum_of(group)
            more = supremum(small, model.power, 0 * self.over.top, self.over.top)
            self._most[id(group)] = group, ((model.largest() + more).upper(), model.power)
        bound: tuple[Any, int] = self._most[id(group)][1]
        return bound

    def main(self, dominant: Leading) -> tuple[Model, SmallTerms]:
        """T/(lam e^{lam E}): what dominates, and all else relative to that."""
        total: Model | None = None
        parts: list[SmallTerm] = []
        for well in dominant.wells:
            model, small = self._product(well)
            parts += small
            total = model if total is None else total + model
        assert total is not None
        least = total.least()
        height = self.dominance.labels.height(dominant.key)
        rest = []
        for size, own, exponent, under, above in dominant.subdominant:
            power = own - total.power
            if under is not None:
                divisor, less = self.least(under)
                size, power = size / divisor, power - less
            for group in above:
                factor, more = self.most(group)
                size, power = size * factor, power + more
            rest.append(SmallTerm((size / least).upper(), power, (height - exponent).lower()))
        # Each well's own error is relative to its own positive share, so to the sum as well.
        return total, (*parts, *merged(rest))

    def _product(self, well: DominantWell) -> tuple[Model, SmallTerms]:
        """A B/(A + M + B) times the well's own integral, and its errors relative to that."""
        weight, small = self.integral(well.leading)
        a, m, b = well.beyond, well.between, well.behind
        largest = self.dominance.denominator(a, m, b)
        assert largest is not None
        label, alone = largest
        errors = [relative(weight, small)]
        below: Model | None = None
        lost: list[SmallTerm] = []
        height = self.dominance.labels.heights[label]
        for group in (a, m, b):
            if group.label == label:
                model, small = self.sum_of(group)
                below = model if below is None else below + model
                # A alone: A B/(A + M + B) = B/(1 + (M + B)/A), where A's own error is none.
                lost += small if alone is None else ()
                under = (model, small)
            else:
                lost += below_height(group.sizes, height)
        assert below is not None
        numerator = weight
        for group in (a, b):
            if group is not alone:
                model, small = self.sum_of(group)
                numerator = numerator * model
                errors.append(relative(model, small))
        if alone is None:
            numerator = numerator / below
            errors.append(_inverse(relative(below, tuple(lost)), self.over))
        else:
            least = _surely(*under, self.over)
            shifted = [SmallTerm(t.size / least, t.power - under[0].power, t.gap) for t in lost]
            errors.append(_inverse(tuple(shifted), self.over))
        return numerator, together(errors, self.over)


def _peak(peak: Extremum, over: Range) -> tuple[Model, SmallTerms]:
    """The series of `enclosures._laplace` for a range of noise, without its factor."""
    d = peak.disk
    stride, sides = 2 // d.contact, len(d.sides)
    used = -(-over.terms // stride)
    if used > len(d.coefficients):
        raise NotProved
    coefficients = [flint.arb(0)] * over.terms
    small = []
    for k, c in enumerate(d.coefficients[:used]):
        coefficients[stride * k] = c * (1 if sides == 1 else 2 * (k % 2 == 0))
        s = Fraction(k + 1, d.contact)
        small += [_beyond(abs(c), s, drop, over) for drop in peak.drops]
    after = exact_ball(Fraction(used + 1, d.contact))
    tail = exact_ball(Fraction(d.peak)) / d.contact * exact_ball(Fraction(d.rho)) ** -used
    tail *= sides * after.gamma() / exact_ball(1 - Fraction(THETA))
    rest = (tail * over.top ** (stride * used - over.terms)).upper()
    return Model(stride, tuple(coefficients), rest, over), tuple(small)


class _Quotient(NamedTuple):
    """T/T_N: what is algebraic, and the size of the rest relative to that."""

    model: Model
    errors: SmallTerms


def _least_of(quotients: list[_Quotient], low: arb, top: arb, order: int) -> Any:
    """The least bound of |T/T_N - 1|/y^(2N + 2) for low <= y <= top."""
    least, power = flint.arb("inf"), 2 * order + 2
    for model, errors in quotients:
        algebraic = model.tail(power, low)
        small = supremum(errors, power, low, top)
        least = least.min((algebraic + (1 + algebraic * top**power) * small).upper())
    return least


def _beyond(size: arb, s: Fraction, drop: arb, over: Range) -> SmallTerm:
    """size lam^-s Gamma(s, z)/Gamma(s) with z = lam drop: what one term has beyond the cell."""
    power, least = exact_ball(s), drop / over.top**2
    steep = 1 - (power - 1) / least
    if steep > 0.5:
        # (t/z)^(s - 1) <= e^((s - 1)(t - z)/z) for t >= z; without it for s <= 1.
        size *= drop ** (power - 1) / power.gamma() / (steep if s > 1 else 1)
        return SmallTerm(size.upper(), 2, drop.lower())
    # t^(s - 1) e^-t <= e^(-(1 - a) z) t^(s - 1) e^(-a t) for t >= z, for every a between 0 and 1.
    a = flint.arb((power / least.max(2 * power)).mid())
    return SmallTerm((size * a**-power).upper(), int(2 * s), ((1 - a) * drop).lower())


def relative(model: Model, small: SmallTerms) -> SmallTerms:
    """The small terms relative to the model."""
    least = model.least()
    return tuple(SmallTerm((t.size / least).upper(), t.power - model.power, t.gap) for t in small)


def _surely(model: Model, small: SmallTerms, over: Range) -> Any:
    """A positive lower bound of y^(-power) (model + small)."""
    least = (model.least() - supremum(small, model.power, flint.arb(0), over.top)).lower()
    if not least > 0:
        raise NotProved
    return least


def _inverse(small: SmallTerms, over: Range) -> SmallTerms:
    """Exponentially small terms that bound 1/(1 + e) - 1."""
    most = supremum(small, 0, flint.arb(0), over.top)
    if not most < 1:
        raise NotProved
    return tuple(t._replace(size=(t.size / (1 - most)).upper()) for t in small)


def together(errors: Sequence[SmallTerms], over: Range) -> SmallTerms:
    """Exponentially small terms that bound (1 + e_1)(1 + e_2) … - 1."""
    errors_of_product: list[SmallTerm] = []
    grown = flint.arb(1)
    for small in errors:
        errors_of_product += [t._replace(size=(t.size * grown).upper()) for t in small]
        grown = (grown * (1 + supremum(small, 0, flint.arb(0), over.top))).upper()
    return tuple(errors_of_product)


def merged(terms: Sequence[SmallTerm]) -> SmallTerms:
    """Fewer terms: one for each power, and for each power of two of the gap."""
    bounds: dict[tuple[int, int], SmallTerm] = {}
    for t in terms:
        if not t.gap > 0:
            raise NotProved
        if not t.gap.is_finite():
            continue
        key = t.power, int(float(t.gap.log()) * 4)
        old = bounds.get(key)
        bounds[key] = (
            t if old is None else SmallTerm(t.size + old.size, t.power, t.gap.min(old.gap))
        )
    return tuple(bounds.values())


class Proof:
    """|T/T_N - 1| <= K kappa^(2N + 2) for one drift, radius, start and order.

    Raises
    ------
    NotProved
        Where no simple well and barrier, or well and end, are shown to dominate.
    """

    def __init__(self, drift: Drift, r: Fraction, start: Fraction, order: int) -> None:
        coefficients = drift.exact_coefficients()
        if coefficients is None:
            raise NotProved
        cut = landscape(tuple(coefficients), drift, r, start, order)
        if cut is None:
            raise NotProved
        self._r, self._order = r, order
        self._digits = _DIGITS + _MORE_DIGITS * order + len(str(int(r)))
        with precision(self._bits()), own_context(self._digits) as context:
            field = ExactField(drift, False, context)
            try:
                self._both = both_sides(field, start, r, order, context, 30, estimated=False)
            except SymasymError:
                raise NotProved from None
            even = not any(coefficients[::2])
            self._cells = Dominance(cut, cut.origin, even)
            self._leading = self._cells.leading()

    def _bits(self) -> int:
        """Arb's precision for these digits."""
        return 4 * self._digits

    def constant(self, kappa: Fraction) -> float | None:
        """K for all noise up to kappa, rounded up; None where it is not proved."""
        with precision(self._bits()):
            try:
                bound = self._constant(exact_ball(kappa) / flint.arb(2).sqrt())
                return math.nextafter(float(bound.upper()), math.inf)
            except (NotProved, ZeroDivisionError):
                return None

    def _constant(self, top: arb) -> Any:
        """The largest over the range of |T/T_N - 1|/y^(2N + 2), in units of kappa."""
        order = self._order
        worst, zero = flint.arb(0), flint.arb(0)
        sums = self._expansion(top)
        for _ in range(_PIECES):
            quotients = self._quotients(sums, top)
            rest = _least_of(quotients, zero, top, order)
            low = (top * _RATIO).mid()
            if rest < worst * _ENOUGH:
                break
            worst = worst.max(_least_of(quotients, low, top, order))
            top = low
        # The last `rest` holds for a little more than what is left.
        return (worst.max(rest) / 2 ** (order + 1)).upper()

    def _expansion(self, top: arb) -> tuple[FormalSum, FormalSum]:
        """T_N/lam as a quotient of formal sums."""
        ops = Formal(self._cells.labels, self._digits, self._order, top)
        return expansion(self._both, self._r, ops)

    def _quotients(self, sums: tuple[FormalSum, FormalSum], top: arb) -> list[_Quotient]:
        """T/T_N with more and more coefficients."""
        quotients = []
        for more in _MORE:
            step()
            over = Range(top, 2 * self._order + 2 + more)
            try:
                quotients.append(self._quotient(sums, over))
            except NotProved:
                continue
        if not quotients:
            raise NotProved
        return quotients

    def _quotient(self, sums: tuple[FormalSum, FormalSum], over: Range) -> _Quotient:
        """T/T_N on the range, all powers up to y^(2N) shown to cancel."""
        main, errors = _Evaluation(self._cells, over).main(self._leading)
        labels = self._cells.labels
        key, numerator, beside = split(sums[0], labels, over)
        under, denominator, behind = split(sums[1], labels, over)
        if key_of([*key, *((label, -n) for label, n in under)]) != self._leading.key:
            raise NotProved
        model = main * denominator / numerator
        # They are equal: T_N is made of the first coefficients of what T is made of.
        for k, c in enumerate(model.coefficients[: 2 * self._order + 2]):
            size = 1 + abs(main.coefficients[k] / main.coefficients[0])
            off = abs(c - (k == 0))
            if not (off.contains(0) and off < size * _NOTHING):
                raise NotProved
        if model.power:
            raise NotProved
        parts = [errors, relative(denominator, behind), _inverse(relative(numerator, beside), over)]
        return _Quotient(model, together(parts, over))


# -- formal sums -----------------------------------------------------------------------------------


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
            return flint.arb(0)
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
    return FormalSum({(): {0: flint.arb(x)}} if x else {})


class Formal:
    """Formal sums for `weak_noise.compose`; `top` is the largest y."""

    rounding = 0.0

    def __init__(self, labels: Labels, digits: int, order: int, top: arb) -> None:
        self._labels, self._order, self._top = labels, order, top
        self.radius = flint.arb(10) ** (_LOST - digits)

    def exponential(
        self, height: Height | float, series: Series, rounding: float = 0.0
    ) -> FormalSum:
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
        scale_points=[
            p._replace(height=Height(_height(p.height, ops), 1)) for p in one.scale_points
        ],
        speed_points=[
            p._replace(height=Height(_height(p.height, ops), -1)) for p in one.speed_points
        ],
        beyond=beyond,
    )


def _height(x: Number, ops: Formal) -> Any:
    """The ball of a height; small ones are differences, and their error is not relative."""
    return ops.ball(x) + flint.arb(0, ops.radius.upper())


def split(total: FormalSum, labels: Labels, over: Range) -> tuple[Key, Model, SmallTerms]:
    """The part with the largest exponent, and all else relative to its exponential."""
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
