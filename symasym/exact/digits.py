"""The exact integrals to any number of digits (`of_scene`).

The sweeps of `symasym.exact.sweep` with the unbounded exponents of mpmath. All
rationals stay exact until a panel rounds them; a panel's Taylor terms are
counted beforehand by Cauchy's bound, and every sum is of positive terms, so
`dps` digits cost a fixed number of guard bits. Where a proved error is asked for
or balls are faster, `symasym.exact.balls.sweep` answers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import expect, mpf_of, own_context, step, to_mpf
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField, dyadic, places
from symasym.exact import sweep
from symasym.exact.digit_panels import (
    Constant,
    Numbers,
    Panel,
    Slow,
    Taylor,
    guard_bits,
    terms_needed,
)
from symasym.exact.sweep import Record, Sum, Swept
from symasym.generated import formulas, mpmath_formulas
from symasym.numbers import balls
from symasym.numbers.complex_balls import resolved
from symasym.numbers.rationals import Rational
from symasym.scenes import QUANTITIES, Answer, Request, Scene, exponent_bits, quantity_of, weaker

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

_GUARD = 64
_MODERATE_PANELS = 48
_MOST_PIECES = 12
# Widths in a row that are too large, after which no wider one is looked for.
_FAILS = 3
_PANEL_COST = 700  # of a Taylor panel, in coefficients of the slow series of a layer
_DEEPEST = 400
_LAST = 8  # Taylor coefficients of A that must be below the last digit
# Least seconds for the blocks towards a zero of an analytic A, for each halving of the layer about
# it and each squared bit of the answer (measured: 4e-8 at 60 digits, 1e-7 at 300 and 1,000).
_SECONDS = 3e-8


def of_scene(scene: Scene, request: Request) -> Answer:
    """The value to the request's digits: proved in balls where that is asked for or faster."""
    from symasym.exact.balls import sweep as ball_sweep

    dps = request.digits
    try:
        if (request.full or _balls_are_faster(scene, dps)) and balls.available():
            try:
                enclosure = _asked(vars(ball_sweep), scene, request.name, dps + 3, request.log)
                return Answer(*balls.to_mpf(enclosure, dps), "bound", (request.name,))
            except AccuracyError:
                pass
        value = _asked(globals(), scene, request.name, dps, request.log)
    except RangeError:
        raise
    except OverflowError:
        # Widths and counts of panels are planned in float64.
        numbers = ", ".join(f"{name} = {float_text(x)}" for name, x in scene.numbers.items())
        raise AccuracyError(
            f"{numbers} and the drift make 2 |A|/kappa^2 leave the range of float64 (1e308), in "
            f"which the evaluation is planned; {weaker(request.name in QUANTITIES)}."
        ) from None
    with own_context(15) as context:
        error = abs(context.make_mpf(value._mpf_)) * context.mpf(10) ** -dps
    return Answer(value, error, "estimate", (request.name,))


def _balls_are_faster(scene: Scene, dps: int) -> bool:
    """True where A is no polynomial and lam V varies little: more, and digits take few panels."""
    if scene.drift.exact_coefficients() is not None:
        return False
    with own_context(dps) as context:
        lam = 2 / scene.numbers["kappa"] ** 2
        reach = min(Fraction(1), scene.numbers.get("r", Fraction(1)))
        whole = swept_scene(scene.drift, False, lam, reach, dps, context)
        return whole.varies_little(-reach, reach)


def _asked(verbs: dict[str, Any], scene: Scene, name: str, dps: int, log: bool) -> Any:
    """The quantity, or its logarithm, by the verbs of this module or of that for balls."""
    quantity = quantity_of(name)
    options = {"complement": quantity.complement} if quantity.has_complement else {}
    return verbs[quantity.verb](scene.drift, **scene.numbers, dps=dps, log=log, **options)


def escape_time(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, *, log: bool = False
) -> mpf:
    """T of eq:Ttilde from `start`, as an mpf right to `dps` digits.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    kappa, r, start : Fraction
        Scaled noise, radius and starting point, |start| < r.
    dps : int
    log : bool
        The natural logarithm instead, right to `dps` digits of its own (to 2 `dps`
        places where it nearly vanishes).
    """

    def compute(n: int, context: MPContext) -> mpf:
        return sweep.escape_time(*_from_both_ends(drift, kappa, r, start, n, context))

    return _to_digits(compute, dps, log)


def exit_probability(
    drift: Drift,
    kappa: Fraction,
    r: Fraction,
    start: Fraction,
    dps: int,
    complement: bool = False,
    *,
    log: bool = False,
) -> mpf:
    """C of eq:C from `start` (or 1 - C); parameters as in `escape_time`."""
    with own_context(dps) as context:
        left, right = _from_both_ends(drift, kappa, r, start, dps, context)
        if complement:
            left, right = right, left
        if log:
            share = mpmath_formulas.log_exit_share(context, left.sigma, right.sigma)
        else:
            share = formulas.exit_share(left.sigma, right.sigma)
        return to_mpf(share, dps)


def stationary_density(
    drift: Drift, kappa: Fraction, y: Fraction, dps: int, *, log: bool = False
) -> mpf:
    """p_ss(y) of eq:pss; needs a sliding region. Parameters as in `escape_time`."""
    lam = 2 / kappa**2

    def compute(n: int, context: MPContext) -> mpf:
        left, right = _both_ways(drift, lam, abs(y), n, context)
        expect_both(left, right, Rational(1), y)
        w_left, w_right = left.from_infinity(y), right.from_infinity(-y)
        return sweep.density(mpf_of(lam, context), w_left, w_right)

    return _to_digits(compute, dps, log)


def occupation(
    drift: Drift, kappa: Fraction, dps: int, complement: bool = False, *, log: bool = False
) -> mpf:
    """P of eq:P (or 1 - P); needs a sliding region. Parameters as in `escape_time`."""
    with own_context(dps) as context:
        scene = swept_scene(drift, False, 2 / kappa**2, Fraction(1), dps, context)
        scene.expect(Rational(-1), Rational(1))
        records = scene.records(Fraction(-1), Fraction(1))
        layer = sweep.in_layer(records, scene.numbers.lam, scene.drift_at(-1))
        after = formulas.tail_right(scene.drift_at(1))
        wanted, rest = sweep.layer_times(layer, after, complement)
        if log:
            share = mpmath_formulas.log_occupation_share(context, wanted, rest)
        else:
            share = formulas.occupation_share(wanted, rest)
        return to_mpf(share, dps)


def _to_digits(compute: Callable[[int, Any], Any], dps: int, log: bool) -> mpf:
    """The value, or its logarithm with more digits of the value where that is close to 1."""
    extra = 0
    while True:
        with own_context(dps) as context:
            value = compute(dps + extra, context)
            if not log:
                return to_mpf(value, dps)
            logarithm = context.log(value)
            lost = 1 - int(context.mag(logarithm) * 0.30103) if logarithm else dps
        if lost <= extra + 8 or extra > dps:
            return to_mpf(logarithm, dps)
        extra = min(lost, dps) + 8


def _from_both_ends(
    drift: Drift, kappa: Fraction, r: Fraction, start: Fraction, dps: int, context: MPContext
) -> tuple[Swept, Swept]:
    """sigma and w at the start, from -r and in mirrored coordinates from r."""
    left, right = _both_ways(drift, 2 / kappa**2, r, dps, context)
    expect_both(left, right, r, start)
    return left.absorbed(-r, start), right.absorbed(-r, -start)


def _both_ways(
    drift: Drift, lam: Fraction, reach: Fraction, dps: int, context: MPContext
) -> tuple[Partition, Partition]:
    """The scene and its mirror image."""
    about = lam, reach, dps, context
    return swept_scene(drift, False, *about), swept_scene(drift, True, *about)


def expect_both(left: Partition, right: Partition, r: Fraction, start: Fraction) -> None:
    """Raise TimeLimitError, before either is begun, where one of two sweeps takes too long."""
    left.expect(-r, start)
    right.expect(-r, -start)


def swept_scene(
    drift: Drift, mirrored: bool, lam: Fraction, reach: Fraction, dps: int, context: MPContext
) -> Partition:
    """The scene, or its mirror image, to be swept from the left as far as `reach`, and in `context`
    the bits that `dps` digits take."""
    field = ExactField(drift, mirrored, context)
    # Rounding of phi enters the exponents.
    exponent = 0 if field.is_polynomial else exponent_bits(drift, lam, reach)
    context.prec = int(dps * 3.3219281) + _GUARD + exponent
    return Partition(field, Rational(lam), context, exponent)


class Partition:
    """Panels of one scene, in order from left to right.

    Parameters
    ----------
    field : ExactField
    lam : Fraction
    context : mpmath context
        Its precision is the relative precision of the records.
    exponent : int
        Bits before the point of lam V, where A is no polynomial.
    """

    def __init__(self, field: ExactField, lam: Fraction, context: MPContext, exponent: int) -> None:
        self.field, self.lam = field, lam
        self.numbers = Numbers(lam, context)
        self.bits = context.prec
        # More are lost on a panel only where A has a peak that `exponent_bits` does not see.
        self._exponent, self._most_bits = exponent, exponent + _GUARD // 2
        #: Drifts that it changes by, where derivatives are asked for.
        self.changes: list[ExactField] = []
        self._lam_float = float(lam)
        # Where the Taylor recurrences are cheapest: terms per unit of exponent fall with
        # the reach, but guard bits grow with it.
        self.reach = max(16.0, self.bits / 2.5)
        self.tiny = context.ldexp(context.one, -context.prec - 16)

    def drift_at(self, u: int) -> mpf:
        """phi(u)."""
        return self.numbers.mpf(self.field.value(Rational(u)))

    def records(self, start: Fraction, end: Fraction) -> Iterator[Record]:
        """The panels' numbers from `start` to `end`."""
        for panel in self.panels(Rational(start), Rational(end)):
            yield panel.record(self.tiny)

    def absorbed(self, start: Fraction, end: Fraction) -> Swept:
        """sigma and w at `end`, absorbed at `start`."""
        return sweep.absorbed(self.records(start, end), self.numbers.lam)

    def from_infinity(self, end: Fraction) -> Sum:
        """w at `end`, nothing being absorbed on the left, where a- > 0."""
        records = self.records(Fraction(-1), end)
        w: Sum = sweep.from_infinity(records, self.numbers.lam, self.drift_at(-1))
        return w

    def panels(self, start: Fraction, end: Fraction) -> Iterator[Panel]:
        """Panels from `start` to `end`, the outside ones in closed form."""
        for panel in self._panels(start, end):
            if not self.field.is_polynomial and -places(panel.rise) > self._most_bits:
                raise AccuracyError(
                    "A has a peak that is too narrow and too high for the digits carried; make "
                    "it wider or lower."
                )
            yield panel

    def _panels(self, start: Fraction, end: Fraction) -> Iterator[Panel]:
        if start < -1:
            yield self._outer(Rational(-1), min(end, Rational(-1)) - start)
        lo, hi = max(start, Rational(-1)), min(end, Rational(1))
        if lo < hi:
            yield from self._inside(lo, hi)
        if end > 1:
            yield self._outer(Rational(1), end - max(start, Rational(1)))

    def _outer(self, edge: Fraction, width: Fraction) -> Panel:
        """The panel beyond u = -1 or 1, where the drift is constant."""
        return Constant(self.numbers, self.field.value(edge), width, edge)

    def _inside(self, lo: Fraction, hi: Fraction) -> Iterator[Panel]:
        """Panels of a part of the layer: Taylor panels only where lam V varies little."""
        if self.varies_little(lo, hi):
            yield from self._taylor(Rational(0), lo, hi)
            return
        for centre, t0, t1 in self._graded(lo, hi):
            yield from self._block(centre, t0, t1, 0)

    def varies_little(self, lo: Fraction, hi: Fraction) -> bool:
        """True where lam V changes by so little that Taylor panels are cheapest."""
        grid = np.linspace(float(lo), float(hi), 17)
        with np.errstate(over="ignore"):
            mean = float(np.abs(self.field.float_values(grid)).mean())
        return bool(self._lam_float * mean * float(hi - lo) <= _MODERATE_PANELS * self.reach)

    def expect(self, start: Fraction, end: Fraction) -> None:
        """Raise TimeLimitError where the panels from `start` to `end` take too long."""
        lo, hi = max(Rational(start), Rational(-1)), min(Rational(end), Rational(1))
        if self.field.is_polynomial or lo >= hi or self.varies_little(lo, hi):
            return
        at_ends = self.field.float_values(np.array([lo, hi], dtype=float))
        if self._zeros(lo, hi) or not at_ends.all():
            halvings = max(0, self.lam.numerator.bit_length() - self.lam.denominator.bit_length())
            seconds = _SECONDS * halvings * (self.bits - self._exponent) ** 2
            expect(seconds, f"Taylor series of A to {self.bits} bits beside its zeros")

    def _graded(self, lo: Fraction, hi: Fraction) -> Iterator[tuple[Fraction, Fraction, Fraction]]:
        """Blocks (centre, t0, t1) that start or stop at the zeros of A and at the ends.

        Measuring from a zero keeps the digits of phi beside it; `_block` halves
        towards it as far as it must.
        """
        marks = [lo, *self._zeros(lo, hi), hi]
        for left, right in zip(marks, marks[1:], strict=False):
            # A short split point keeps the rationals of the blocks short.
            half = dyadic((right - left) / 2, 8 + places(right - left))
            yield left, Rational(0), half
            yield right, half - (right - left), Rational(0)

    def _zeros(self, lo: Fraction, hi: Fraction) -> list[Fraction]:
        """Short dyadic approximations, finer than any layer, of the zeros of A inside."""
        with np.errstate(over="ignore"):
            size = np.abs(self.field.float_values(np.linspace(float(lo), float(hi), 17))).max()
        steepest = Rational(size) if 1 <= size < math.inf else Rational(1)
        bits = 40 + max(0, places(1 / (1 + self.lam * steepest)))
        zeros = sorted({dyadic(x, bits) for x in self.field.zeros(lo, hi, bits)})
        return [x for x in zeros if lo < x < hi]

    def _block(self, centre: Fraction, t0: Fraction, t1: Fraction, depth: int) -> Iterator[Panel]:
        """A block by layers where that is exact to working precision, else by Taylor panels."""
        step()
        if depth > _DEEPEST:
            raise AccuracyError(
                f"the drift varies too fast near u = {float(centre):.6g} to reach the digits "
                "asked for; ask for fewer digits or smooth A there."
            )
        local = self.field.about_middle(centre, t0, t1)
        scale = self._lam_float * float(t1 - t0) / 2
        pieces = 2 * scale * sum(abs(c) for c in local) / self.reach
        slow = self._slow(local, scale, (centre, t0, t1)) if pieces > 2 else None
        if slow and slow.cost < pieces * _PANEL_COST:
            yield slow
            return
        if pieces <= _MOST_PIECES:
            yield from self._taylor(centre, t0, t1)
            return
        if slow:
            yield slow
            return
        # Beside the centre, where A may vanish, a slow panel can span a factor of four.
        split = t1 / 4 if t0 == 0 else t0 / 4 if t1 == 0 else (t0 + t1) / 2
        yield from self._block(centre, t0, split, depth + 1)
        yield from self._block(centre, split, t1, depth + 1)

    def _slow(
        self, local: list[float], scale: float, edges: tuple[Fraction, Fraction, Fraction]
    ) -> Slow | None:
        """The panel as layers at its ends, or None where the slow series is too short for that.

        Parameters
        ----------
        local : list of float
            Taylor coefficients of phi about the middle, in units of half the width.
        scale : float
            lam times half the width.
        """
        spread = sum(abs(c) for c in local[1:])
        least = abs(local[0]) - spread
        if least <= 0.05 * abs(local[0]) or scale * least < self.bits:
            return None
        slope = sum(k * abs(c) for k, c in enumerate(local))
        near = slope / (scale * least) / least
        if self._rounds(near, 0.0) is None:
            return None
        radius = 1.0
        while radius < 64 and sum(
            abs(c) * (1.1 * radius) ** k for k, c in enumerate(local) if k
        ) < 0.9 * abs(local[0]):
            radius *= 1.1
        if not self.field.is_polynomial:
            centre, t0, t1 = edges
            middle, half = centre + (t0 + t1) / 2, (t1 - t0) / 2
            # phi may be far from zero and yet have a singularity nearby.
            rate = max((abs(local[k]) / abs(local[0])) ** (1 / k) for k in range(8, len(local)))
            radius = min(radius, 0.8 / max(rate, 1e-3))
            while radius > 1.3 and not resolved(
                self.field.spread(middle, dyadic(half * Rational(radius), 8 + places(half))),
                abs(local[0]),
            ):
                radius *= 0.7
        if radius < 1.3:
            return None
        rounds = self._rounds(near, 1.5 / (scale * least) / (radius - 1))
        if rounds is None:
            return None
        count = int(1.15 * (self.bits + 40) / math.log2(radius)) + 2 * rounds + 8
        # A derivative multiplies the rounding of the n-th coefficient by n/(lam|phi| half).
        if count > 0.7 * scale * least:
            return None
        return Slow(self.numbers, self.field, edges, (count, rounds), least, radius)

    def _rounds(self, near: float, far: float) -> int | None:
        """Terms t_k of the slow series that leave no digit out, None where it diverges before.

        |t_{k+1}/t_k| is about (2k+1) `near`, near = |phi'|/(lam phi^2), or (k+1) `far`, one over
        lam |phi| and the distance of a singularity, where phi' is smaller than higher derivatives.
        """
        size, rounds = 0.0, 0
        while size > -self.bits - 8:
            ratio = max((2 * rounds + 1) * near, (rounds + 1) * far, 1e-300)
            if ratio > 0.7:
                return None
            size += math.log2(ratio)
            rounds += 1
        return rounds

    def _taylor(self, centre: Fraction, t0: Fraction, t1: Fraction) -> Iterator[Panel]:
        """Panels from t0 to t1, each as wide as is cheapest."""
        t, unit = t0, Rational(1)
        while t < t1:
            step()
            here, most, bound = centre + t, t1 - t, None
            if not self.field.is_polynomial:
                unit, bound = self._resolved_width(here, min(4 * unit, t1 - t))
                most = unit
            about = self.field.taylor(here, unit, 24)
            scale = self.lam * unit
            flat = not self.field.is_polynomial and self._beneath(
                scale, self.numbers.mpf(max(map(abs, about[1:])))
            )
            if flat and (wide := self._constant_width(here, t1 - t, unit)):
                yield Constant(self.numbers, self.field.value(here), wide, here)
                t, unit = t + wide, wide
                continue
            w = self._width([abs(float(scale * c)) for c in about], most / unit)
            h = w * unit
            if bound is None:
                c = [x * w**k for k, x in enumerate(about)]
            else:
                c, h = self._complete(here, h, self.terms(h, bound, unit / h))
            yield Taylor(self.numbers, c, h, here)
            t += h

    def _beneath(self, scale: Fraction, change: mpf) -> bool:
        """True where `scale` times a change of A is below the last digit of an exponent."""
        last = self.numbers.context.ldexp(1, -self.bits - 16)
        return bool(self.numbers.mpf(scale) * change < last)

    def _constant_width(self, here: Fraction, most: Fraction, finest: Fraction) -> Fraction:
        """About the largest width, 0 for none, on which A and its changes are constant to the last
        digit, as a sigmoid is beside its steep part; some more than `finest`."""

        def constant(width: Fraction) -> bool:
            disk = here + width / 2, width / 2, finest
            spreads = (f.spread(*disk) for f in (self.field, *self.changes))
            return all(self._beneath(self.lam * width, s) for s in spreads)

        if constant(most):
            return most
        width, fails = finest, 0
        if not constant(width):
            return Rational(0)
        while constant(above := min(2 * width, most)):
            width = above
        # The bounds have 64 bits, so that edges nearer to a steep part are not told from it.
        while fails < _FAILS and (above - width) * 2**32 > above:
            step()
            middle = (width + above) / 2
            if constant(middle):
                width, fails = middle, 0
            else:
                above, fails = middle, fails + 1
        return width

    def _resolved_width(self, here: Fraction, most: Fraction) -> tuple[Fraction, mpf]:
        """`most`, halved until few enough Taylor terms of A suffice, and how much A changes on a
        disk of four times that radius."""
        h = most
        while True:
            bound = self.field.spread(here, 4 * h)
            if self.terms(h, bound) <= self.order():
                return h, bound
            h /= 2
            self._require_width(h)

    def terms(self, h: Fraction, bound: mpf, more: Fraction | int = 1) -> int | float:
        """Taylor terms of a drift on a panel of width `h`, which changes by at most `bound` on a
        disk of radius 4 `more` h.

        By Cauchy's bound n terms leave less than `bound` (4 more)^-n, at most a third of it more.
        """
        missing = self.numbers.mpf(self.lam * h) * bound
        if not missing < self.numbers.context.inf:
            return math.inf
        bits = self.bits + 17 + (self.numbers.context.mag(missing) if missing else -self.bits)
        return max(int(bits / math.log2(4 * more)), 0) + 1

    def order(self) -> int:
        """The most Taylor terms of A on a panel."""
        bits: int = self.bits + guard_bits(self.reach)
        return bits // 2 + 32

    def _complete(
        self, here: Fraction, h: Fraction, terms: int | float
    ) -> tuple[list[Fraction], Fraction]:
        """Taylor coefficients of phi in units of `h`, halved until what is missing of their
        series is below the last digit."""
        order = min(int(terms) + _LAST, self.order())
        before = Rational(0)
        while True:
            c = self.field.taylor(here, h, order)
            last = max(abs(x) for x in c[-_LAST:])
            if self.lam * h * last * (1 << (self.bits + 16)) < 1:
                return c, h
            # Were it truncation, halving would shrink it by 2^order; rounding it does not.
            if before and last * (1 << (order // 2)) > before:
                self.field.sharpen()
            before = last
            h /= 2
            self._require_width(h)

    @staticmethod
    def _require_width(h: Fraction) -> None:
        """Raise AccuracyError for a panel narrower than an analytic A needs."""
        if places(h) > _DEEPEST:
            raise AccuracyError(
                "the Taylor series of A does not converge inside [-1, 1]; give an A that is "
                "analytic there, or ask for fewer digits."
            )

    def _width(self, sizes: list[float], most: Fraction) -> Fraction:
        """Width of the next panel in any unit, and in that unit the sizes of lam times the
        Taylor coefficients of phi and `most`, which is not to be exceeded."""
        h = most
        if not self.field.is_polynomial:
            # A quarter of the distance to the nearest singularity: two bits a term.
            lead = max(sizes[:4]) or 1.0
            rate = max((s / lead) ** (1 / k) for k, s in enumerate(sizes) if k >= 12)
            if 4 * rate * h > 1:
                h = min(h, dyadic(Rational(1 / (4 * rate)), 8 + places(Rational(1 / rate))))

        def growth(width: Fraction) -> list[float]:
            w = float(width)
            return [s * w ** (k + 1) / (k + 1) for k, s in enumerate(sizes)]

        whole = h == most
        while sum(growth(h)) > self.reach:
            step()
            h, whole = h / 2, False
        if not whole:
            # Back up in eighths, so that halving costs little reach.
            base = h
            for eighths in range(15, 8, -1):
                if sum(growth(base * eighths / 8)) <= self.reach:
                    h = base * eighths / 8
                    break
            h = min(dyadic(h, 4 + places(h)) or h, most)
        cost = self._cost(growth(h), h)
        while h > most / 64 and (less := self._cost(growth(h / 2), h / 2)) < 0.8 * cost:
            h, cost = h / 2, less
        if h < most < h * Rational(3, 2):
            h = dyadic(most / 2, 4 + places(most)) or h
        return h

    def _cost(self, growth: list[float], width: Fraction) -> float:
        """Terms times bits over the width: the cost of a Taylor panel for each unit of u."""
        guard = guard_bits(sum(growth))
        bits = self.bits + guard
        return float(terms_needed(growth, bits) * (bits + 400) / width)
