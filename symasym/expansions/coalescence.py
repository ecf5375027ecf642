"""Panels of phi in canonical form, by which T, C and P are uniform through every coalescence.

A panel is a stretch [u0, u1] together with none, one or two zeros of phi, real or complex, which
are the zeros of pi(y), y = u - m, of degree d: 1, y, or y^2 - D. The map s(u) with

    phi du = eps psi(s) ds,    psi = 1, s, s^2 - zeta,    eps = 1 or -1,

is analytic there, also where the zeros meet, and past that (C. Chester, B. Friedman, F. Ursell,
Proc. Camb. Phil. Soc. 53 (1957) 599). With L = eps lam and

    b_0 = g du/ds,    b_k = P_k(s) + psi c_k,  deg P_k < d,    b_{k+1} = dc_k/ds,

integration by parts (N. Bleistein, Comm. Pure Appl. Math. 19 (1966) 353) makes of the panel's
integrals with e^{lam V} and e^{-lam V}, V' = -phi, and the weights g(u), those of the canonical
problem, with psi in place of phi and the weights P = sum (-L)^-k P_k and Q = sum L^-k P_k, and the
values of c_k at its ends and their integrals (`symasym.expansions.canonical`). Nothing is asked of
the ends: a start, or an end of the layer, may lie anywhere beside the zeros. Numbers are midpoints
of balls: rounding is not enclosed.
"""

from __future__ import annotations

from functools import cached_property, reduce
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import acb, acb_series, arb, arb_poly, arb_series, ctx

from symasym.base.errors import AccuracyError

# Of the disc in which a power series converges, the part in which it is used.
SHARE = 0.55
# A zero of phi this far from the panels is of no importance to them, nor one whose series
# reaches it in steps this short.
_FAR, _SHORT, _TINY = 1.0, 1e-3, 1e-30
# An imaginary part at which rounding may have moved a double zero.
_REAL = 1e-7


# -- power series in y -----------------------------------------------------------------------------


def middle(x: Any) -> Any:
    """A power series without the radii of its coefficients, to the terms of the moment."""
    return arb_series([x[k].mid() for k in range(min(x.prec, ctx.cap))], ctx.cap)


def at(x: Any, y: Any) -> Any:
    """The sum of a power series at y."""
    return arb_poly(x.coeffs())(y)


def radius(x: Any, inverse: bool = True) -> float:
    """Of convergence of x and 1/x: the distance to the next zero or singularity (root test)."""
    c = x.coeffs()
    first = c[0] if inverse else max(map(abs, c[:4]), key=float, default=arb(0))
    if first == 0:  # as of a power beyond the terms that are known
        return 1 / _TINY
    x = x / first
    series = [x.coeffs(), x.inv().coeffs()] if inverse else [x.coeffs()]
    last = [(k, c) for row in series for k, c in list(enumerate(row))[4:][-8:]]
    return 1 / max(_TINY, *(float(abs(c.mid()).root(k)) for k, c in last), 0)


class Factor(NamedTuple):
    """pi(y): 1, y or y^2 - square."""

    degree: int
    square: Any = arb(0)

    def series(self) -> Any:
        """pi itself."""
        return arb_series([[1], [0, 1], [-self.square, 0, 1]][self.degree])

    def split(self, x: Any) -> tuple[tuple[Any, Any], Any]:
        """(r0, r1), q of x = r0 + r1 y + pi q. Nothing cancels for a small square of any sign."""
        d, count = self.degree, x.prec
        q = [x[k] for k in range(count)]
        if d == 2:
            for k in range(count - 3, -1, -1):
                q[k] += self.square * q[k + 2]
        # q[k] is the coefficient of y^(k-d) in the quotient, and for k < d that of the rest.
        rest = [*q[:d], arb(0), arb(0)]
        return (rest[0], rest[1]), arb_series(q[d:], count - d)

    def over(self, x: Any) -> Any:
        """q."""
        return self.split(x)[1]


def psi(d: int, zeta: Any, s: Any) -> Any:
    """The canonical phi."""
    return s * s - zeta if d == 2 else s if d == 1 else s * 0 + 1


def primitive(d: int, zeta: Any, s: Any) -> Any:
    """Its integral from 0."""
    return s * s * s / 3 - zeta * s if d == 2 else s * s / 2 if d == 1 else s


class Map(NamedTuple):
    """s(y) about the zeros: eps phi/pi, zeta, and the series of s."""

    eps: int
    zeta: Any
    chi: Any
    s: Any


def central_map(phi: Any, pi: Factor) -> Map:
    """The map from the Taylor series of phi: Newton's method in powers of pi(y).

    s - root y is divisible by pi, so that both sides of primitive(s) = g agree modulo pi^2, and one
    factor pi of the correction remains.
    """
    chi = pi.over(phi)
    eps = 1 if chi[0] > 0 else -1
    chi, g, y, d = eps * chi, (eps * phi).integral(), arb_series([0, 1]), pi.degree
    if d == 0:
        return Map(eps, arb(0), chi, g)
    if d == 1:
        zeta, s = arb(0), chi[0].sqrt() * y
    else:
        c, D = chi.coeffs(), pi.square
        odd = enumerate(c[1::2], 1)
        mean = sum(
            (3 * x * D**k / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(c[::2])), arb(0)
        )
        zeta, s = D * mean.root(3) ** 2, mean.root(3) * y
        # The mean of g over both zeros, where the one of s^3/3 - zeta s is 0.
        g += sum((x * D ** (k + 1) / (2 * k * (k + 1)) for k, x in odd), arb(0))
    for _ in range(2 + ctx.cap.bit_length()):
        step = pi.over(pi.over(primitive(d, zeta, s) - g)) / pi.over(psi(d, zeta, s))
        s = middle(s - pi.series() * step)
    return Map(eps, zeta, chi, s)


# -- zeros -----------------------------------------------------------------------------------------


class Cluster(NamedTuple):
    """A zero, or two taken together: roughly their middle and D."""

    zeros: tuple[complex, ...]
    centre: float
    square: float | None

    def reaches(self, lo: float, hi: float) -> bool:
        """True where a zero is near [lo, hi]."""
        far = max(_FAR, hi - lo)
        return any(abs(z - min(max(z.real, lo), hi)) < far for z in self.zeros)


class Field:
    """phi of a panel, a function of balls and power series, with its zeros beside [lo, hi].

    Parameters
    ----------
    phi : symasym.drift.evaluate.Polynomial or Analytic
    lo, hi : float
    """

    def __init__(self, phi: Any, lo: float = -1.0, hi: float = 1.0) -> None:
        self.phi, self.lo, self.hi = phi, lo, hi

    def taylor(self, u: Any, of: Any = None) -> Any:
        """phi's power series at u, or that of another function."""
        x = of or self.phi
        if hasattr(x, "coefficients"):
            return arb_series(x.taylor(u, 1, 0)[0].coeffs(), ctx.cap)
        return middle(x(arb_series([u, 1], ctx.cap)))

    def mirrored(self) -> Field:
        """That of -phi(-u)."""
        other = Field(self.phi.mirrored().negative(), -self.hi, -self.lo)
        other.zeros = [-z.conjugate() for z in self.zeros]
        return other

    @cached_property
    def zeros(self) -> list[complex]:
        """Those of the Chebyshev interpolant which are zeros of phi."""
        half, values = (self.hi - self.lo) / 2, np.vectorize(lambda t: float(self.phi(arb(t))))
        for degree in (16, 32, 64, 128, 256, 512):
            known = np.polynomial.Chebyshev.interpolate(values, degree, (self.lo, self.hi))
            size = 1e-13 * abs(known.coef).max()
            if abs(known.coef[-4:]).max() < size:
                break
        known, far = known.trim(size), max(_FAR, half)
        return [
            z for z in map(complex, known.roots() if len(known.coef) > 1 else [])
            if max(abs(z.real - self.lo - half) - half, abs(z.imag)) < far and self._vanishes(z)
        ]  # fmt: skip

    def _vanishes(self, z: complex) -> bool:
        """True for a zero of the interpolant that is one of phi."""
        line, coefficients = acb_series([acb(z), 1], 3), getattr(self.phi, "coefficients", [])
        x = reduce(lambda x, c: x * line + c, reversed(coefficients), 0 * line)
        x = x if coefficients else self.phi(line)
        value, slope, curve = (abs(complex(x[k])) for k in range(3))
        return value < 1e-3 * slope + 1e-9 * curve + 1e-12

    def factor(self, cluster: Cluster) -> tuple[Any, Factor]:
        """A zero, or the middle m and D of a pair, to all digits: Newton, Bairstow."""
        m, D = arb(cluster.centre), arb(cluster.square or 0)
        for _ in range(3 + ctx.prec.bit_length()):
            c = self.taylor(m).coeffs()
            c += [arb(0)] * (4 - len(c))
            if cluster.square is None:
                m = (m - c[0] / c[1]).mid()
                continue
            even, odd = arb_poly(c[::2]), arb_poly(c[1::2])
            r0, r1, d0, d1 = even(D), odd(D), even.derivative()(D), odd.derivative()(D)
            # Of m the derivatives of r0 + r1 y are r1 + 2 D d1 and 2 d0.
            a, b = r1 + 2 * D * d1, 2 * d0
            det = a * d1 - b * d0
            m, D = (m - (r0 * d1 - r1 * d0) / det).mid(), (D - (a * r1 - b * r0) / det).mid()
        if not (m.is_finite() and D.is_finite() and abs(m - cluster.centre) < 0.1):
            raise three_together(cluster.centre)
        return m, Factor(1) if cluster.square is None else Factor(2, D)

    def clusters(self) -> list[Cluster]:
        """The zeros in pairs of neighbours, the closest first; a complex pair is one."""
        real = sorted((z for z in self.zeros if abs(z.imag) < _REAL), key=lambda z: z.real)
        pairs = [(z, z.conjugate()) for z in self.zeros if z.imag >= _REAL]
        pairs += sorted(pairwise(real), key=lambda p: abs(p[1] - p[0]))
        found, left = [], set(range(len(real)))
        for a, b in pairs:
            members = {k for k, z in enumerate(real) if z in (a, b)}
            centre, square = (a + b).real / 2, ((b - a) ** 2).real / 4
            if members <= left and self._alone(centre, square):
                left -= members
                found.append(Cluster((a, b), centre, square))
        found += [Cluster((real[k],), real[k].real, None) for k in left]
        return sorted(found, key=lambda c: c.centre)

    def _alone(self, centre: float, square: float) -> bool:
        """True where the series about the middle of a pair holds both."""
        rest = Factor(2, arb(square)).over(self.taylor(arb(centre)))
        return bool(SHARE * radius(rest) > abs(square) ** 0.5)

    def panels(self, lo: Any, hi: Any, order: int, weight: Any = None) -> list[Panel]:
        """[lo, hi] cut half-way between clusters; each part with the cluster on its side."""
        near = [c for c in self.clusters() if c.reaches(float(lo), float(hi))]
        cuts = [
            (max(z.real for z in a.zeros) + min(z.real for z in b.zeros)) / 2
            for a, b in pairwise(near)
        ]
        marks = [lo, *(arb(c) for c in cuts if lo < c < hi), hi]
        found = []
        for a, b in pairwise(marks):
            centre, pi = (a + b) / 2, Factor(0)
            if near:
                centre, pi = self.factor(near[sum(c < float(a + b) / 2 for c in cuts)])
            found.append(panel(self, centre, pi, a, b, order, weight))
        return found


def three_together(u: Any) -> AccuracyError:
    """The refusal of a drift that has more zeros in one place than a panel may have."""
    return AccuracyError(
        f"A has three zeros close together near u = {float(u):.4g}, of which the uniform expansion "
        "takes two; use method='exact'."
    )


# -- panels ----------------------------------------------------------------------------------------


class Panel(NamedTuple):
    """What does not depend on lam: for k = 0, 1, ..., N, and both ends."""

    eps: int
    degree: int
    zeta: Any
    ends: tuple[Any, Any]
    P: list[Any]  # P_k(s) = p + q s
    c: list[Any]  # c_k at both ends
    own: list[Any]  # the integral of g c_k du
    mixed: list[list[Any]]  # [k][l]: that of P_k c_l ds


def integrated_by_parts(
    pi: Factor, of: Map, weight: Any, order: int
) -> tuple[list[Any], list[Any]]:
    """P_k = (p, q), p + q s, and the power series of c_k about the zeros, k = 0, 1, ..., N."""
    d, s = pi.degree, of.s
    root = pi.split(s)[0][1] if d == 2 else arb(1)
    top = pi.over(psi(d, of.zeta, s))
    a = top / of.chi
    b, P, c = weight * a, [], []
    for _ in range(order + 1):
        p, q = pi.split(b)[0]
        P.append((p, q / root))
        c.append(pi.over(b - p - q / root * s) / top)
        b = a * c[-1].derivative()
    return P, c


class _Piece(NamedTuple):
    """s, the weight g and c_k on about + [y0, y1]."""

    about: Any
    y0: Any
    y1: Any
    s: Any
    g: Any
    c: list[Any]


def panel(
    field: Field, centre: Any, pi: Factor, lo: Any, hi: Any, order: int, weight: Any = None
) -> Panel:
    """The panel [lo, hi] with the zeros pi about `centre`.

    The weight is a function of power series; None: 1.
    """
    found = central_map(field.taylor(centre), pi)
    d, zeta, s, ks = pi.degree, found.zeta, found.s, range(order + 1)
    pieces: list[_Piece] = []

    def weighed(u: Any) -> Any:
        return arb_series([1]) if weight is None else field.taylor(u, weight)

    def add(about: Any, step: Any, s: Any, g: Any, c: list[Any]) -> None:
        y0, y1 = max(-step, lo - about), min(step, hi - about)
        if y0 < y1:
            pieces.append(_Piece(about, y0, y1, s, g, c))

    g = weighed(centre)
    P, c = integrated_by_parts(pi, found, g, order)
    near = arb(SHARE * min(radius(pi.over(field.taylor(centre))), radius(g, False)))
    add(centre, near, s, g, c)
    for side, end in ((-1, lo), (1, hi)):
        edge, here = centre + side * near, at(s, side * near)
        while side * (end - edge) > 0:
            # Further out about other centres, where primitive(s) = eps int phi as well.
            room = min(radius(field.taylor(edge)), radius(weighed(edge), False))
            step = arb(SHARE / (1 + SHARE) * room)
            if step < _SHORT:
                raise three_together(edge)
            about, t = edge + side * step, arb_series([here])
            phi = found.eps * field.taylor(about)
            level = phi.integral()
            level += primitive(d, zeta, here) - at(level, -side * step)
            for _ in range(4 + 2 * ctx.cap.bit_length()):
                t = middle(t - (primitive(d, zeta, t) - level) / psi(d, zeta, t))
            below, g, c = psi(d, zeta, t), weighed(about), []
            a = below / phi
            rest = g * a
            for p, q in P:
                c.append((rest - p - q * t) / below)
                rest = a * c[-1].derivative()
            add(about, step, t, g, c)
            edge, here = about + side * step, at(t, side * step)
    pieces.sort(key=lambda piece: float(piece.about))
    own, mixed = [arb(0) for _ in ks], [[arb(0) for _ in ks[: order + 1 - k]] for k in ks if d]
    for p in pieces:

        def over(x: Any, p: _Piece = p) -> Any:
            area = x.integral()
            return at(area, p.y1) - at(area, p.y0)

        slope = p.s.derivative()
        for k in ks:
            own[k] += over(p.g * p.c[k])
        for row, (x, y) in zip(mixed, P, strict=False):
            for k in range(len(row)):
                row[k] += over((x + y * p.s) * slope * p.c[k])
    first, last = pieces[0], pieces[-1]
    ends = at(first.s, first.y0), at(last.s, last.y1)
    c = [(at(first.c[k], first.y0), at(last.c[k], last.y1)) for k in ks]
    return Panel(found.eps, d, zeta, ends, P, c, own, mixed)
