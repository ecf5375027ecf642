"""The ring of balls: the local expansions of a bound drift in flint's arb, and T, C, P from them.

All is enclosed. The finite parts of int h_k are sums over the zeros of a polynomial A; V and the
finite parts of any other A are integrals (`acb.integral`), the latter along a path above the zeros
of A: it has the same real part as one below them, and that is the finite part.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from itertools import pairwise
from math import log
from typing import Any, NamedTuple

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq, fmpq_poly

from symasym.base.balls import exact_ball, precision
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.expansions import weak
from symasym.series.local import by_parts, finite_parts_in_s, pole_sums, slow
from symasym.series.power_series import Series

#: The whole line, of which P is asked, as an interval with a start.
LINE = Fraction(2), Fraction(-1)
_ONE = Fraction(1)
_STEPS = 6  # times that bits are doubled, at most


class Balls:
    """Functions of balls (`symasym.series.local`)."""

    two = 2
    euler = property(lambda self: arb.const_euler())
    gamma = staticmethod(lambda n: arb.gamma_fmpq(fmpq(n, 2)))
    ratio = staticmethod(lambda p, q: arb(p) / q)
    log = staticmethod(lambda x: arb(x).log())

    @staticmethod
    def root(x: Any, n: int) -> Any:
        """x^(n/2)."""
        whole = arb(x) ** (n // 2)
        return whole * arb(x).sqrt() if n % 2 else whole

    @staticmethod
    def generic(c: list[Any]) -> tuple[Series, Callable[[Any], Any]]:
        """The series 1 + c_1 t + ..., and the way back from its coefficients."""
        return Series([arb(1), *c]), lambda x: x

    @staticmethod
    def log_ratio(high: Any, low: Any, real: bool) -> Any:
        """log(high/low); of what is 0 nothing, the finite part."""
        if not real:
            return (high / low).log()
        ends = ((1, high), (-1, low))
        return sum((sign * abs(t.real).log() for sign, t in ends if (t == 0) is False), arb(0))


RING = Balls()


class Unresolved(ArithmeticError):
    """More bits are needed."""


def _no_series(u: float, where: str) -> AccuracyError:
    return AccuracyError(
        f"A vanishes at u = {u:.6g}, {where}, where the series for weak noise do not exist; use "
        "method='exact'."
    )


class Field:
    """phi of a bound drift: Taylor coefficients, V, its critical places, the finite parts.

    A double zero has a finite part only where that is not asked for (`time`).
    """

    def __init__(self, drift: Drift, r: Fraction, start: Fraction, time: bool = True) -> None:
        self.drift, self.r, self.start, self.x = drift, r, start, exact_ball(start)
        self.exact, self.phi = drift.exact_coefficients(), pieces(drift, fmpq(-1), fmpq(1))[0].phi
        self.poly = [exact_ball(c) for c in self.exact or ()]
        known = {side: drift.end(side) for side in (-1, 1)}
        self.a = {s: self.phi(arb(s)) if a is None else exact_ball(a) for s, a in known.items()}
        reach = min(r, _ONE)
        for u in (-reach, reach):
            if (known[int(u)] if reach == 1 else self._exactly(u)) == 0:
                raise _no_series(float(u), "at the start, an end or a kink")
        zeros = []
        for u, multiplicity in self._real():
            if any(u.overlaps(exact_ball(end)) for end in (-reach, reach)):
                raise Unresolved
            if not abs(u) < exact_ball(reach):
                continue
            if multiplicity > 1:
                if time or multiplicity % 2 or u.overlaps(self.x):
                    raise _no_series(float(u), "its slope too")
            else:
                zeros.append((u, "barrier" if self.taylor(u, 2)[1] > 0 else "well"))
        own = next((kind for u, kind in zeros if u.overlaps(self.x)), "")
        if own and self._exactly(start):
            raise Unresolved
        self.on_zero = bool(own)
        self.zeros = [(u, kind) for u, kind in zeros if not u.overlaps(self.x)]
        places = [*self.zeros, (self.x, f"start={own}" if own else "start")]
        places += [(exact_ball(side * r), "end") for side in (-1, 1)]
        places += [(arb(side), "kink") for side in (-1, 1) if r > 1 and start != side]
        self.places = sorted(places, key=lambda place: float(place[0]))
        if any(not low < high for (low, _), (high, _) in pairwise(self.places)):
            raise Unresolved

    # -- A and its zeros -----------------------------------------------------------------------

    def _exactly(self, u: Fraction) -> Fraction | None:
        """A(u) of a polynomial."""
        if self.exact is None:
            return None
        return sum((c * u**k for k, c in enumerate(self.exact)), Fraction(0))

    def taylor(self, u: Any, count: int) -> list[Any]:
        """Taylor coefficients of A at u, real or complex."""
        real = isinstance(u, arb)
        if self.exact is not None:
            of: Any = arb_poly if real else acb_poly
            c = of(self.poly)(of([u, 1])).coeffs()[:count]
        else:
            ctx.cap = count
            c = list(self.phi((arb_series if real else acb_series)([u, 1], prec=count)))
        return [*c, *[u * 0] * (count - len(c))]

    def _real(self) -> list[tuple[Any, int]]:
        """The real zeros, and their multiplicities; of what is no polynomial those in (-1, 1)."""
        if self.exact is None:
            zeros = ((arb(str(p.u)), p.multiplicity) for p in self.drift.critical_points())
            return [(self._refined(u) if m == 1 else u, m) for u, m in zeros]
        real = [(z.real, m) for z, m in self.roots if z.imag == 0]
        return sorted(real, key=lambda zero: float(zero[0]))

    @cached_property
    def roots(self) -> Any:
        """All zeros of a polynomial in the complex plane, and their multiplicities."""
        whole = fmpq_poly([fmpq(c.numerator, c.denominator) for c in self.exact or ()]).numer()
        return whole.complex_roots() if whole.degree() > 0 else []

    def _refined(self, u: Any) -> Any:
        """A simple zero: Newton's method, then that for balls, which proves it."""
        for _ in range(int(log(ctx.prec, 2)) - 5):
            value, slope = self.taylor(u, 2)
            u = (u - value / slope).mid()
        value, slope = self.taylor(u, 2)
        around = arb(u, (value / slope).abs_upper() * 2 + arb(2) ** (8 - ctx.prec))
        found = u - value / self.taylor(around, 2)[1]
        if not around.contains(found):
            raise Unresolved
        return found

    def sides(self, u: Any, kind: str, count: int) -> tuple[list[Any], list[Any]]:
        """phi's Taylor coefficients left and right of u, empty beyond an end."""
        place = float(u)
        straight = [self.a[1 if place > 0 else -1], *[arb(0)] * (count - 1)]
        inside = self.taylor(u, count) if abs(place) <= 1 else straight
        left, right = (straight if side * place >= 1 else inside for side in (-1, 1))
        if kind == "end":
            return (left, []) if place > 0 else ([], right)
        return left, right

    # -- V -------------------------------------------------------------------------------------

    def height(self, u: Any) -> Any:
        """V(u) - V(start)."""
        return self.potential(u) - self._own_potential

    @cached_property
    def _own_potential(self) -> Any:
        return self.potential(self.x)

    def potential(self, u: Any) -> Any:
        """V(u) - V(0), V' = -phi."""
        side, beyond = (1 if float(u) > 0 else -1), abs(float(u)) > 1
        inside = arb(side) if beyond else u
        if self.exact is not None:
            area = arb_poly(self.poly).integral()(inside)
        else:
            area = acb.integral(lambda z, _: acb(self.phi(z)), acb(0), acb(inside)).real
        return -area - (u - inside) * self.a[side]

    # -- finite parts --------------------------------------------------------------------------

    def regular(self, count: int) -> list[list[Any]]:
        """Finite parts of int h_k left and right of the start, k = 1 to count."""
        found = []
        for lo, hi in ((-self.r, self.start), (self.start, self.r)):
            low, high = (min(max(y, -_ONE), _ONE) for y in (lo, hi))
            row = self._inside(low, high, count) if low < high else [arb(0)] * count
            # The straight stretches.
            row[0] += exact_ball(min(hi, -_ONE) - min(lo, -_ONE)) / self.a[-1]
            row[0] += exact_ball(max(hi, _ONE) - max(lo, _ONE)) / self.a[1]
            found.append(row)
        if self.on_zero:
            more = finite_parts_in_s(self.taylor(self.x, 2 * count + 1), count, RING)
            for k, change in enumerate(more):
                found[0][k], found[1][k] = found[0][k] - change, found[1][k] + change
        return found

    def _inside(self, lo: Fraction, hi: Fraction, count: int) -> list[Any]:
        """Those of a part of [-1, 1]; places are taken from the start, where an own zero is 0."""
        if self.exact is None or any(m > 1 for _, m in self.roots):
            return self._by_contour(exact_ball(lo), exact_ball(hi), count)
        if len(self.poly) == 1:
            return [exact_ball(hi - lo) / self.poly[0], *[arb(0)] * (count - 1)]
        real = [acb(u) for u, _ in self.zeros] + [acb(self.x)] * self.on_zero
        others = [z for z, _ in self.roots if not any(z.overlaps(u) for u in real)]
        poles = [
            (z - self.x, self.taylor(z, 2 * count + 1), k < len(real))
            for k, z in enumerate([*real, *others])
        ]
        if self.on_zero:
            poles[len(real) - 1] = (acb(0), *poles[len(real) - 1][1:])
        low, high = (acb(exact_ball(u - self.start)) for u in (lo, hi))
        return [acb(y).real for y in pole_sums(poles, low, high, count, RING)]

    def _by_contour(self, lo: Any, hi: Any, count: int) -> list[Any]:
        """Those of any A; beside a start on a zero by the series there."""
        row = [arb(0)] * count
        if self.on_zero:
            marks = [u for u, _ in self.zeros] + [arb(-1), arb(1)]
            room = min(float(abs(u - self.x)) for u in marks)
            step = self._alone(self.x, room / 2) / 16
            if lo.overlaps(self.x):
                lo = lo + step
                row = self._beside_zero(step, count)
            else:
                hi = hi - step
                row = [-y for y in self._beside_zero(-step, count)]
        zeros = [u for u, _ in self.zeros if lo < u < hi]
        path, marks = [acb(lo)], [lo, *zeros, hi]
        for left, z, right in zip(marks, zeros, marks[2:], strict=False):
            reach = self._alone(z, min(float(z - left), float(right - z), 1.0) / 2)
            path += [acb(z - reach), acb(z, reach), acb(z + reach)]
        path.append(acb(hi))

        def odd(m: int) -> Any:
            parts = (acb.integral(partial(self._square, m), p, q) for p, q in pairwise(path))
            return sum(parts, acb(0)).real

        ends = [slow(self.taylor(u, count), count, RING) for u in (lo, hi)]
        return [a + b for a, b in zip(row, by_parts(ends, odd, count), strict=True)]

    def _square(self, m: int, z: Any, analytic: bool) -> Any:
        """h_(m+1)^2 phi at z; nan on a box where phi may vanish or not be analytic."""
        value = acb(self.phi(z))
        if not value.is_finite() or value.contains(0):
            return acb("nan")
        phi = acb_series([value, *self.taylor(z, m + 1)[1:]], prec=m + 1)
        h = 1 / phi
        for _ in range(m):
            h = -h.derivative() / phi
        return h[0] ** 2 * value

    def _beside_zero(self, step: Any, count: int) -> list[Any]:
        """Finite parts from the start, a zero of A, over a step, by the Laurent series of h_k.

        They converge 16 times as far as the step (`_by_contour`); the last term bounds the rest.
        """
        terms = ctx.prec // 4 + 2 * count + 8
        phi = self.taylor(self.x, terms + 1)
        shape = Series([c / phi[1] for c in phi[1:]])
        f, row = Series([arb(1), *[arb(0)] * (terms - 1)]) / shape, []
        for k in range(1, count + 1):
            total = f.c[2 * k - 2] * abs(step).log()
            for j, c in enumerate(f.c):
                if (p := j + 2 - 2 * k) != 0:
                    last = c * step**p / p
                    total += last
            total += arb(0, abs(last).upper())
            row.append(total / phi[1] ** k)
            f = (f * (2 * k - 1) - f.theta()) / shape
        return row

    def _alone(self, z: Any, reach: float) -> Any:
        """Half the side of a square about z without another zero: Re A'/A'(z) > 0 there
        (Noshiro, Warschawski)."""
        half, slope = arb(reach), self.taylor(z, 2)[1]
        for _ in range(200):
            box = acb(arb(z.mid(), half), arb(0, half))
            if acb(self.phi(box)).is_finite() and (self.taylor(box, 2)[1] / slope).real > 0:
                return half
            half /= 2
        raise Unresolved


class Local(NamedTuple):
    """A drift's points with their series, its finite parts, a- and a+."""

    points: list[weak.Point]
    regular: list[list[Any]]
    slopes: tuple[Any, Any]


@lru_cache(maxsize=16)
def local(drift: Drift, r: Fraction, start: Fraction, name: str, count: int, bits: int) -> Local:
    """What the quantity `name` takes, each series to `count` terms, at flint's `bits`."""
    field = Field(drift, r, start, name == "T")
    points = weak.points_of(field, count, RING)
    regular = field.regular(count) if name == "T" else []
    if name[-1] == "P":
        points = [p for p in points if p.kind != "end"]
    return Local(points, regular, (field.a[-1], field.a[1]))


class AtLam:
    """The points' terms at one lam, to an order."""

    def __init__(self, lam: Any, order: int) -> None:
        self.lam, self.order, self.log_lam = lam, order, lam.log()

    number = staticmethod(lambda x: x)
    named = staticmethod(lambda name, value: value)

    def term(self, letter: str, point: weak.Point, height: Any, halves: int, row: list[Any]) -> Any:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        total = arb(0)
        for c in row[self.order :: -1]:
            total = total / self.lam + c
        return total * RING.root(self.lam, -halves) * (self.lam * height).exp()


def quantity(known: Local, name: str, at: Any) -> Any:
    """T, C, 1 - C, P or 1 - P to the order of `at`."""
    if name == "T":
        return weak.escape_time(known.points, known.regular, at)
    if name[-1] == "C":
        return weak.exit_probability(known.points, at, name != "C")
    outside = weak.outside_layer(known.points, known.slopes, at)
    return 1 - outside if name == "P" else outside


def doubled(find: Callable[[int], Any], bits: int, digits: int = 0) -> Any:
    """What `find` gives at flint's precision of so many bits, which it takes: these are doubled
    until zeros and edges are apart, and the balls that it gives have so many digits."""
    for more in (bits << k for k in range(_STEPS)):
        with suppress(Unresolved), precision(more):
            found = find(more)
            if not digits or all(y.rel_accuracy_bits() > 3.33 * digits + 1 for y in found):
                return found
    raise AccuracyError(
        f"A varies too fast, or its zeros are too close to each other or to an end, for many times "
        f"{bits:,} bits; use method='exact'."
    )
