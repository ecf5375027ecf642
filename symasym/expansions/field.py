"""A bound drift in flint's balls: its local expansions, V, its critical places, finite parts.

All is enclosed. The finite parts of int h_k are sums over the zeros of a polynomial A; V and the
finite parts of any other A, and where noise depends on u, are integrals (`acb.integral`), the
latter along a path above the zeros of A: it has the same real part as one below them, and that is
the finite part.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from fractions import Fraction
from functools import cached_property, partial
from itertools import pairwise
from math import inf, log
from typing import Any, NamedTuple

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq, fmpq_poly

from symasym.base.balls import exact_ball
from symasym.base.errors import AccuracyError
from symasym.drift.critical_points import Values, formula_of, known
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Piece, pieces
from symasym.drift.formula import Formula, rational, vanishes
from symasym.series.local import by_parts, finite_parts_in_s, pole_sums, slow
from symasym.series.power_series import Series


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


class Between(NamedTuple):
    """The ends of a scene, its start, and the end that reflects."""

    left: Fraction
    right: Fraction
    start: Fraction
    reflecting: str | None = None


#: The whole line, of which P is asked, as two ends with a start.
LINE = Between(Fraction(-2), Fraction(2), Fraction(-1))


def _no_series(u: float, where: str) -> AccuracyError:
    return AccuracyError(
        f"A vanishes at u = {u:.6g}, {where}, where the series for weak noise do not exist; use "
        "method='exact'."
    )


class Part:
    """A piece of the drift, phi/sigma^2 with its weights, and its critical points inside.

    Where A and sigma are polynomials with 2 deg sigma <= deg A + 1, h_k with both weights has no
    poles but the zeros of A, and vanishes at infinity; `degree` is that of sigma.
    """

    def __init__(
        self, piece: Piece, of: tuple[Formula, Values], bounds: Any, degree: float
    ) -> None:
        self.left, self.right, self.phi, *weights = piece
        self.of, self.bounds = of, bounds or (self.left, self.right)
        self.weights = weights if any(weights) else []
        c = [*getattr(self.phi, "coefficients", ())]
        while len(c) > 1 and c[-1] == 0:
            c.pop()
        constant = len(c) == 1
        self.exact = c if constant or not any(isinstance(x, arb) for x in c) else []
        self.poly = [arb(x) for x in self.exact]
        # A, of whose zeros finite parts are sums.
        self.summed = self.exact
        formula, values = of
        known = formula.exact_coefficients(dict(values)) if self.weights and not constant else None
        if known and known[-1] and max(2 * degree, 2) <= len(known):
            self.summed = [rational(x) for x in known]

    def vanishes(self, u: Any) -> bool:
        """True where phi is 0 at a rational place."""
        value = self.phi(arb(u))
        if not value.contains(0):
            return False
        if self.exact:
            zero = sum(c * u**k for k, c in enumerate(self.exact)) == 0
        else:
            zero = value == 0 or vanishes(*self.of, Fraction(int(u.p), int(u.q)), 0)
        if not zero:
            raise Unresolved
        return True

    def taylor(self, u: Any, count: int) -> list[Any]:
        """Taylor coefficients of phi at u, real or complex."""
        real = isinstance(u, arb)
        if not self.exact:
            return _series(self.phi, u, count)
        of: Any = arb_poly if real else acb_poly
        c = of(self.poly)(of([u, 1])).coeffs()[:count]
        return [*c, *[u * 0] * (count - len(c))]

    def weighted(self, u: Any, count: int) -> list[list[Any]]:
        """Those of both weights, none where these are 1."""
        return [
            _series(w, u, count) if w else [u * 0 + 1, *[u * 0] * (count - 1)] for w in self.weights
        ]

    @cached_property
    def roots(self) -> Any:
        """All zeros of a polynomial in the complex plane, and their multiplicities."""
        whole = fmpq_poly(self.summed if len(self.summed) > 1 else [1]).numer()
        return whole.complex_roots() if whole.degree() > 0 else []

    def real(self) -> list[tuple[Any, int]]:
        """The real zeros, and their multiplicities; of what is no polynomial those inside."""
        if self.summed:
            real = [(z.real, m) for z, m in self.roots if z.imag == 0]
            return sorted(real, key=lambda zero: float(zero[0]))
        zeros = known(*self.of, *self.bounds)
        row = ((arb(str(p.u)), p.multiplicity) for p in zeros)
        return [(self._refined(u) if m == 1 else u, m) for u, m in row]

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

    def area(self, a: Any, b: Any) -> Any:
        """The integral of phi."""
        if self.exact:
            whole = arb_poly(self.poly).integral()
            return whole(b) - whole(a)
        return acb.integral(lambda z, _: acb(self.phi(z)), acb(a), acb(b)).real


class Field:
    """phi/sigma^2 of a bound drift between two ends: series, V, critical places, finite parts.

    A double zero has a finite part only where that is not asked for (`time`).
    """

    def __init__(self, drift: Drift, at: Between, time: bool = True) -> None:
        low, high, self.start, self.x = *map(rational, at[:3]), exact_ball(at.start)
        model = drift.model
        cuts = [rational(x) for x in model.cuts]
        bounds = (fmpq(-1), fmpq(1)) if model.layered else None
        values = {name: rational(x) for name, x in drift.scalars().items()}
        noise = model.noise and model.noise.coefficients(values, balls=True)
        degree = len(noise) - 1 if noise else inf
        self.parts = [
            Part(p, formula_of(drift, bisect_right(cuts, p.left)), bounds, degree)
            for p in pieces(drift, low, high)
        ]
        self.ends = {-1: self.parts[0].phi(arb(low)), 1: self.parts[-1].phi(arb(high))}
        edges = ((abs(u), u, part) for part in self.parts for u in (part.left, part.right))
        for _, u, part in sorted(edges, key=lambda edge: edge[0]):
            if part.vanishes(u):
                raise _no_series(float(arb(u)), "at the start, an end or a kink")
        zeros, own = [], ""
        for part in self.parts:
            for u, multiplicity in part.real():
                if u.overlaps(arb(part.left)) or u.overlaps(arb(part.right)):
                    raise Unresolved
                if not part.left < u < part.right:
                    continue
                at_start = u.overlaps(self.x)
                if multiplicity > 1:
                    if time or multiplicity % 2 or at_start:
                        raise _no_series(float(u), "its slope too")
                    continue
                kind = "barrier" if part.taylor(u, 2)[1] > 0 else "well"
                if not at_start:
                    zeros.append((u, kind))
                elif part.summed and not part.vanishes(self.start):
                    raise Unresolved
                else:
                    own = kind
        self.on_zero, self.zeros = bool(own), zeros
        places = [*zeros, (self.x, f"start={own}" if own else "start")]
        for u, side in ((low, "left"), (high, "right")):
            if u != self.start:
                places.append((arb(u), "wall" if side == at.reflecting else "end"))
        places += [(arb(p.left), "kink") for p in self.parts[1:] if p.left != self.start]
        self.places = sorted(places, key=lambda place: float(place[0]))
        if any(not a < b for (a, _), (b, _) in pairwise(self.places)):
            raise Unresolved

    def _beside(self, u: Any, side: int) -> Part | None:
        """The part left or right of a place; none beyond an end."""
        if side > 0:
            return next((p for p in self.parts if u < arb(p.right)), None)
        return next((p for p in self.parts[::-1] if u > arb(p.left)), None)

    def around(self, u: Any, count: int) -> tuple[list[Any], list[list[Any]]]:
        """Taylor coefficients of phi and of the weights at a place where they have them."""
        part: Any = self._beside(u, 1) or self._beside(u, -1)
        return part.taylor(u, count), part.weighted(u, count)

    def sides(self, u: Any, count: int) -> tuple[Any, Any]:
        """The same left and right of a place, None beyond an end."""
        left, right = (self._beside(u, side) for side in (-1, 1))
        before = left and (left.taylor(u, count), left.weighted(u, count))
        if left is right:
            return before, before
        return before, right and (right.taylor(u, count), right.weighted(u, count))

    def height(self, u: Any) -> Any:
        """V(u) - V(start), V' = -phi."""
        (a, b), total = ((u, self.x) if u < self.x else (self.x, u)), arb(0)
        for part in self.parts:
            left, right = arb(part.left), arb(part.right)
            low, high = (left if left > a else a), (right if right < b else b)
            if low < high:
                total += part.area(low, high)
        return total if u < self.x else -total

    # -- finite parts --------------------------------------------------------------------------

    def regular(self, count: int) -> list[list[Any]]:
        """Finite parts of int h_k left and right of the start, k = 1 to count."""
        found = []
        for side in (-1, 1):
            total = [arb(0)] * count
            for part in self.parts:
                lo, hi = part.left, part.right
                lo, hi = (lo, min(hi, self.start)) if side < 0 else (max(lo, self.start), hi)
                if lo < hi:
                    row = self._over(part, lo, hi, count)
                    total = [a + b for a, b in zip(total, row, strict=True)]
            found.append(total)
        if self.on_zero:
            phi, weights = self.around(self.x, 2 * count + 1)
            more = finite_parts_in_s(phi, count, RING, weights)
            for k, change in enumerate(more):
                found[0][k], found[1][k] = found[0][k] - change, found[1][k] + change
        return found

    def _over(self, part: Part, lo: Any, hi: Any, count: int) -> list[Any]:
        """Those of a part; places are taken from the start, where an own zero is 0."""
        flat = len(part.summed) == 1
        if not part.summed or (flat and part.weights) or any(m > 1 for _, m in part.roots):
            return self._by_contour(part, arb(lo), arb(hi), count)
        if flat:
            return [arb(hi - lo) / part.poly[0], *[arb(0)] * (count - 1)]
        own = self.on_zero and part.left < self.start < part.right
        real = [acb(u) for u, _ in self.zeros if part.left < u < part.right]
        real += [acb(self.x)] * own
        others = [z for z, _ in part.roots if not any(z.overlaps(u) for u in real)]
        size = 2 * count + 1
        poles = [
            (z - self.x, part.taylor(z, size), k < len(real), part.weighted(z, size))
            for k, z in enumerate([*real, *others])
        ]
        if own:
            poles[len(real) - 1] = (acb(0), *poles[len(real) - 1][1:])
        low, high = (acb(arb(u - self.start)) for u in (lo, hi))
        return [acb(y).real for y in pole_sums(poles, low, high, count, RING)]

    def _by_contour(self, part: Part, lo: Any, hi: Any, count: int) -> list[Any]:
        """Those of any A; beside a start on a zero by the series there."""
        row, zeros = [arb(0)] * count, [u for u, _ in self.zeros if part.left < u < part.right]
        if self.on_zero and part.left < self.start < part.right:
            marks = [*zeros, arb(part.left), arb(part.right)]
            room = min(float(abs(u - self.x)) for u in marks)
            step = _alone(part, self.x, room / 2) / 16
            if lo.overlaps(self.x):
                lo = lo + step
                row = self._beside_zero(part, step, count)
            else:
                hi = hi - step
                row = [-y for y in self._beside_zero(part, -step, count)]
        zeros = [u for u in zeros if lo < u < hi]
        path, marks = [acb(lo)], [lo, *zeros, hi]
        for left, z, right in zip(marks, zeros, marks[2:], strict=False):
            reach = _alone(part, z, min(float(z - left), float(right - z), 1.0) / 2)
            path += [acb(z - reach), acb(z, reach), acb(z + reach)]
        path.append(acb(hi))

        def integral(m: int, n: int) -> Any:
            of = partial(_product, part, m, n)
            return sum((acb.integral(of, p, q) for p, q in pairwise(path)), acb(0)).real

        ends = []
        for u in (lo, hi):
            phi, weights = part.taylor(u, count), part.weighted(u, count)
            ends.append(
                [slow(phi, count, RING, [w]) for w in weights] or [slow(phi, count, RING)] * 2
            )
        return [a + b for a, b in zip(row, by_parts(ends, integral, count), strict=True)]

    def _beside_zero(self, part: Part, step: Any, count: int) -> list[Any]:
        """Finite parts from the start, a zero of A, over a step, by the Laurent series of h_k.

        They converge 16 times as far as the step (`_by_contour`); the last term bounds the rest.
        """
        terms = ctx.prec // 4 + 2 * count + 8
        phi = part.taylor(self.x, terms + 1)
        shape = Series([c / phi[1] for c in phi[1:]])
        one = Series([arb(1), *[arb(0)] * (terms - 1)])
        weights = [Series(w) for w in part.weighted(self.x, terms)]
        scale, speed = weights or (one, one)
        f, row = speed / shape, []
        for k in range(1, count + 1):
            g = scale * f if weights else f
            total = g.c[2 * k - 2] * abs(step).log()
            for j, c in enumerate(g.c):
                if (p := j + 2 - 2 * k) != 0:
                    last = c * step**p / p
                    total += last
            total += arb(0, abs(last).upper())
            row.append(total / phi[1] ** k)
            f = (f * (2 * k - 1) - f.theta()) / shape
        return row


def _series(of: Any, u: Any, count: int) -> list[Any]:
    """Taylor coefficients of a function at u, real or complex."""
    ctx.cap = count
    kind: Any = arb_series if isinstance(u, arb) else acb_series
    c = list(of(kind([u, 1], prec=count)))
    return [*c, *[u * 0] * (count - len(c))]


def _product(part: Part, m: int, n: int, z: Any, analytic: bool) -> Any:
    """f_(m+1) g_(n+1) phi at z; nan on a box where phi may vanish or not be analytic."""
    first, *others = part.taylor(z, n + 1)
    if not first.is_finite() or first.contains(0):
        return acb("nan")
    phi = acb_series([first, *others], prec=n + 1)
    rows: list[Any] = [acb_series(w, prec=n + 1) for w in part.weighted(z, n + 1)]
    h = []
    for weight, k in zip(rows or [1], (m, n), strict=False):
        f = weight / phi
        for _ in range(k):
            f = -f.derivative() / phi
        h.append(f[0])
    return h[0] * h[-1] * first


def _alone(part: Part, z: Any, reach: float) -> Any:
    """Half the side of a square about z without another zero: Re phi'/phi'(z) > 0 there
    (Noshiro, Warschawski)."""
    half, slope = arb(reach), part.taylor(z, 2)[1]
    for _ in range(200):
        box = acb(arb(z.mid(), half), arb(0, half))
        if acb(part.phi(box)).is_finite() and (part.taylor(box, 2)[1] / slope).real > 0:
            return half
        half /= 2
    raise Unresolved
