"""The critical points of a drift, its local expansions, V and finite parts, enclosed in balls.

For a polynomial A the finite parts of int h_k (`symasym.expansions.weak`) are sums over its zeros.
Otherwise, and where the noise depends on u, they are integrals (`acb.integral`) along a path above
the zeros of A; a path below them has the same real part, which is the finite part.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cached_property, partial
from itertools import pairwise
from math import inf, log
from typing import Any, NamedTuple

from flint import acb, acb_series, arb, arb_poly, arb_series, ctx, fmpq, fmpq_poly

from symasym.base.balls import Unresolved, rational
from symasym.base.errors import AccuracyError
from symasym.drift.critical_points import Values, formula_of, known
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Piece, pieces
from symasym.drift.formula import Formula, vanishes
from symasym.series import Series, by_parts, finite_parts_in_s, pole_sums, slow, slow_at_zero


class _BallRing:
    """The functions of balls that `symasym.series` calls."""

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
        """The series 1 + c_1 t + ..., whose coefficients need no conversion."""
        return Series([arb(1), *c]), lambda x: x

    @staticmethod
    def log_ratio(high: Any, low: Any, real: bool) -> Any:
        """log(high/low); its finite part if one of the two is 0."""
        if not real:
            return (high / low).log()
        ends = ((1, high), (-1, low))
        return sum((sign * abs(t.real).log() for sign, t in ends if (t == 0) is False), arb(0))


RING = _BallRing()
# A start so near to a barrier or a well, which hardly changes T and C, is taken to be there; the
# error of an expansion is its distance from the exact value.
_NEAR = {"barrier": arb(2) ** -40, "well": arb(2) ** -10}


class Between(NamedTuple):
    """Both ends of the interval, the start, and which end reflects, if any."""

    left: Fraction
    right: Fraction
    start: Fraction
    reflecting: str | None = None


#: Stands for the whole line, to which P refers.
LINE = Between(Fraction(-2), Fraction(2), Fraction(-1))


def _no_series(u: float, where: str) -> AccuracyError:
    return AccuracyError(
        f"A vanishes at u = {u:.6g}, {where}, where the series for weak noise do not exist; use "
        "method 'exact' or, with a layer, 'uniform'."
    )


class Part:
    """A piece of the drift: phi/sigma^2, the two weights, and the critical points inside.

    `degree` is that of the polynomial sigma. If A is a polynomial, too, and 2 deg sigma <= deg A +
    1, then h_k with both weights has poles only at the zeros of A, and vanishes at infinity.
    """

    def __init__(
        self, piece: Piece, of: tuple[Formula, Values], bounds: Any, degree: float
    ) -> None:
        self.left, self.right, self.phi = piece[:3]
        self.of, self.bounds = of, bounds or (self.left, self.right)
        self.weights = [piece.scale, piece.speed] if piece.noise else []
        c = [*getattr(self.phi, "coefficients", ())]
        while len(c) > 1 and c[-1] == 0:
            c.pop()
        constant = len(c) == 1
        self.exact = c if constant or not any(isinstance(x, arb) for x in c) else []
        # The coefficients of A if the finite parts are sums over its zeros.
        self.summed = self.exact
        formula, values = of
        known = formula.exact_coefficients(dict(values)) if self.weights and not constant else None
        if known and known[-1] and max(2 * degree, 2) <= len(known):
            self.summed = [rational(x) for x in known]

    def vanishes(self, u: Any) -> bool:
        """True if phi is 0 at a rational point."""
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
        """Taylor coefficients of phi at a real or complex u."""
        return _series(self.phi, u, count)

    def local(self, u: Any, count: int) -> tuple[list[Any], list[list[Any]]]:
        """Taylor coefficients of phi and of both weights, an empty list if both are 1."""
        one = [u * 0 + 1, *[u * 0] * (count - 1)]
        weights = [_series(w, u, count) if w else one for w in self.weights]
        return self.taylor(u, count), weights

    @cached_property
    def roots(self) -> Any:
        """The complex zeros of a polynomial, with their multiplicities."""
        whole = fmpq_poly(self.summed if len(self.summed) > 1 else [1]).numer()
        return whole.complex_roots() if whole.degree() > 0 else []

    def real(self) -> list[tuple[Any, int]]:
        """The real zeros with their multiplicities; if A is no polynomial, those inside only."""
        if self.summed:
            real = [(z.real, m) for z, m in self.roots if z.imag == 0]
            return sorted(real, key=lambda zero: float(zero[0]))
        zeros = known(*self.of, *self.bounds)
        row = ((arb(str(p.u)), p.multiplicity) for p in zeros)
        return [(self._refined(u) if m == 1 else u, m) for u, m in row]

    def _refined(self, u: Any) -> Any:
        """A simple zero by Newton's method, proved by a last interval Newton step."""
        for _ in range(int(log(ctx.prec, 2)) - 5):
            value, slope = self.taylor(u, 2)
            u = (u - value / slope).mid()
        value, slope = self.taylor(u, 2)
        around = arb(u, (value / slope).abs_upper() * 2 + arb(2) ** (8 - ctx.prec))
        found = u - value / self.taylor(around, 2)[1]
        if not around.contains(found):
            raise Unresolved
        return found

    def simple_zeros(self, start: Any, time: bool, near: bool) -> Iterator[tuple[Any, str]]:
        """The simple zeros inside with their kinds, "start=..." at the start.

        Double zeros are passed over, except where T is asked for (`time`) or at the start.
        """
        near = near and self.left < start < self.right
        for u, multiplicity in self.real():
            if u.overlaps(arb(self.left)) or u.overlaps(arb(self.right)):
                raise Unresolved
            if not self.left < u < self.right:
                continue
            at_start = u.overlaps(arb(start))
            if multiplicity > 1:
                if time or multiplicity % 2 or at_start:
                    raise _no_series(float(u), "its slope too")
                continue
            if at_start and self.summed and not self.vanishes(start):
                raise Unresolved
            kind = "barrier" if self.taylor(u, 2)[1] > 0 else "well"
            own = at_start or (near and abs(u - start) < _NEAR[kind])
            yield arb(start) if at_start else u, f"start={kind}" if own else kind

    def area(self, a: Any, b: Any) -> Any:
        """The integral of phi."""
        if self.exact:
            whole = arb_poly(self.exact).integral()
            return whole(b) - whole(a)
        return acb.integral(lambda z, _: acb(self.phi(z)), acb(a), acb(b)).real


def _parts(drift: Drift, low: Any, high: Any) -> list[Part]:
    """The pieces of the drift; none of their edges may be a zero of A."""
    model, cuts = drift.model, [rational(x) for x in drift.model.cuts]
    bounds = (fmpq(-1), fmpq(1)) if model.layered else None
    values = {name: rational(x) for name, x in drift.scalars().items()}
    noise = model.noise and model.noise.coefficients(values, balls=True)
    degree = len(noise) - 1 if noise else inf
    parts = [
        Part(p, formula_of(drift, bisect_right(cuts, p.left)), bounds, degree)
        for p in pieces(drift, low, high)
    ]
    edges = ((abs(u), u, part) for part in parts for u in (part.left, part.right))
    for _, u, part in sorted(edges, key=lambda edge: edge[0]):
        if part.vanishes(u):
            raise _no_series(float(arb(u)), "at the start, an end or a kink")
    return parts


class BallDrift:
    """A bound drift between two ends: its critical points and what `symasym.expansions.weak` needs.

    Double zeros of A are refused where finite parts are needed (`time`), for T. With `near` the
    start may be moved to a zero next to it.
    """

    def __init__(self, drift: Drift, at: Between, time: bool = True, near: bool = False) -> None:
        low, high, self.start = map(rational, at[:3])
        self.parts = _parts(drift, low, high)
        self.ends = {-1: self.parts[0].phi(arb(low)), 1: self.parts[-1].phi(arb(high))}
        found = [zero for part in self.parts for zero in part.simple_zeros(self.start, time, near)]
        self.zeros = [zero for zero in found if zero[1] in ("well", "barrier")]
        self.on_zero = len(found) > len(self.zeros)
        self.x = next((u for u, kind in found if kind[:5] == "start"), arb(self.start))
        places = [*found, *[(self.x, "start")] * (not self.on_zero)]
        for u, side in ((low, "left"), (high, "right")):
            if u != self.start:
                places.append((arb(u), "wall" if side == at.reflecting else "end"))
        places += [(arb(p.left), "kink") for p in self.parts[1:] if p.left != self.start]
        self.places = sorted(places, key=lambda place: float(place[0]))
        starts = sum(kind[:5] == "start" for _, kind in self.places)
        if starts > 1 or any(not a < b for (a, _), (b, _) in pairwise(self.places)):
            raise Unresolved

    def _beside(self, u: Any, side: int) -> Part | None:
        """The part left or right of a point, or None beyond an end."""
        if side > 0:
            return next((p for p in self.parts if u < arb(p.right)), None)
        return next((p for p in self.parts[::-1] if u > arb(p.left)), None)

    def around(self, u: Any, count: int) -> Any:
        """Taylor coefficients of phi and of the weights at a point where they are analytic."""
        return next(filter(None, self.sides(u, count)))

    def sides(self, u: Any, count: int) -> tuple[Any, Any]:
        """The result of `around` on the left and on the right of a point; None beyond an end."""
        left, right = (self._beside(u, side) for side in (-1, 1))
        before = left and left.local(u, count)
        return before, before if left is right else right and right.local(u, count)

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
        """Finite parts of int h_k on the left and right of the start, k = 1 to `count`."""
        found = []
        for side in (-1, 1):
            total = [arb(0)] * count
            for part in self.parts:
                lo, hi = part.left, part.right
                lo, hi = (lo, min(hi, self.start)) if side < 0 else (max(lo, self.start), hi)
                if lo < hi:
                    a, b = (self.x if u is self.start else arb(u) for u in (lo, hi))
                    row = self._over(part, a, b, count)
                    total = [a + b for a, b in zip(total, row, strict=True)]
            found.append(total)
        if self.on_zero:
            phi, weights = self.around(self.x, 2 * count + 1)
            for k, change in enumerate(finite_parts_in_s(phi, count, RING, weights)):
                found[0][k], found[1][k] = found[0][k] - change, found[1][k] + change
        return found

    def _over(self, part: Part, lo: Any, hi: Any, count: int) -> list[Any]:
        """The finite parts over [lo, hi] in a part, with positions relative to the start."""
        flat = len(part.summed) == 1
        if not part.summed or (flat and part.weights) or any(m > 1 for _, m in part.roots):
            return self._by_contour(part, lo, hi, count)
        if flat:
            return [(hi - lo) / part.exact[0], *[arb(0)] * (count - 1)]
        own = self.on_zero and part.left < self.start < part.right
        real = [acb(u) for u, _ in self.zeros if part.left < u < part.right]
        real += [acb(self.x)] * own
        others = [z for z, _ in part.roots if not any(z.overlaps(u) for u in real)]
        poles = []
        for k, z in enumerate([*real, *others]):
            phi, weights = part.local(z, 2 * count + 1)
            place = acb(0) if own and k == len(real) - 1 else z - self.x
            poles.append((place, phi, k < len(real), weights))
        low, high = (acb(0 if u is self.x else u - self.x) for u in (lo, hi))
        return [acb(y).real for y in pole_sums(poles, low, high, count, RING)]

    def _by_contour(self, part: Part, lo: Any, hi: Any, count: int) -> list[Any]:
        """The finite parts for any A; next to a start on a zero by the series there."""
        row, zeros = [arb(0)] * count, [u for u, _ in self.zeros if part.left < u < part.right]
        if self.on_zero and part.left < self.start < part.right:
            room = min(float(abs(u - self.x)) for u in (*zeros, arb(part.left), arb(part.right)))
            step = _alone(part, self.x, room / 2) / 16
            if lo is self.x:
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
            phi, weights = part.local(u, count)
            ends.append(
                [slow(phi, count, RING, [w]) for w in weights] or [slow(phi, count, RING)] * 2
            )
        return [a + b for a, b in zip(row, by_parts(ends, integral, count), strict=True)]

    def _beside_zero(self, part: Part, step: Any, count: int) -> list[Any]:
        """Finite parts from the start, a zero of A, over a step, by the Laurent series of h_k.

        Its radius of convergence is 16 steps (`_by_contour`), and its last term bounds the rest.
        """
        more, row = ctx.prec // 4 + 8, []
        phi, weights = part.local(self.x, 2 * count + more + 1)
        for k, c in enumerate(slow_at_zero(phi, count, RING, weights, more)):
            terms = [x * step**p / p for p, x in enumerate(c, -2 * k) if p]
            row.append(sum(terms, c[2 * k] * abs(step).log()) + arb(0, abs(terms[-1]).upper()))
        return row


def _series(of: Any, u: Any, count: int) -> list[Any]:
    """Taylor coefficients of a function at a real or complex u."""
    ctx.cap = count
    kind: Any = arb_series if isinstance(u, arb) else acb_series
    c = list(of(kind([u, 1], prec=count)))
    return [*c, *[u * 0] * (count - len(c))]


def _product(part: Part, m: int, n: int, z: Any, analytic: bool) -> Any:
    """f_(m+1) g_(n+1) phi at z; nan on a box where phi may vanish or may not be analytic."""
    (first, *others), weights = part.local(z, n + 1)
    if not first.is_finite() or first.contains(0):
        return acb("nan")
    phi, h = acb_series([first, *others], prec=n + 1), []
    for weight, k in zip(weights or [[1]], (m, n), strict=False):
        f = acb_series(weight, prec=n + 1) / phi
        for _ in range(k):
            f = -f.derivative() / phi
        h.append(f[0])
    return h[0] * h[-1] * first


def _alone(part: Part, z: Any, reach: float) -> Any:
    """Half the side of a square about the zero z in which Re phi'/phi'(z) > 0, so that it holds no
    other zero (Noshiro and Warschawski's criterion)."""
    half, slope = arb(reach), part.taylor(z, 2)[1]
    for _ in range(200):
        box = acb(arb(z.mid(), half), arb(0, half))
        if acb(part.phi(box)).is_finite() and (part.taylor(box, 2)[1] / slope).real > 0:
            return half
        half /= 2
    raise Unresolved
