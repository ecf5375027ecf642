"""Panels of phi in canonical form, which make T, C and P uniform through every coalescence.

A panel is an interval [u0, u1] together with at most two zeros of phi, real or complex. They are
the zeros of pi(y), y = u - m, of degree d: 1, y, or y^2 - D. The map s(u) with

    phi du = eps psi(s) ds,    psi = 1, s, s^2 - zeta,    eps = 1 or -1,

is analytic there, also where the zeros meet and beyond (C. Chester, B. Friedman, F. Ursell, Proc.
Camb. Phil. Soc. 53 (1957) 599). With L = eps lam, the weight g(u) and

    b_0 = g du/ds,    b_k = p_k(s) + psi c_k,  deg p_k < d,    b_{k+1} = dc_k/ds,

integration by parts (N. Bleistein, Comm. Pure Appl. Math. 19 (1966) 353) turns the panel's
integrals with g e^{lam V} and g e^{-lam V}, V' = -phi, into canonical ones with psi in place of phi
and sum L^-k p_k, sum (-L)^-k p_k in place of g, the values of c_k at the ends, and integrals of c_k
(`symasym.expansions.uniform`). The ends are arbitrary: a start or an end of the layer may lie
anywhere near the zeros. The numbers are midpoints of balls: rounding is not enclosed.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import acb, acb_series, arb, arb_poly, arb_series, ctx

from symasym.base.errors import AccuracyError

# The fraction of a power series' radius of convergence up to which it is used.
SHARE = 0.55
# The distance from which on a zero is ignored; the shortest disc; the smallest 1/radius.
_FAR, _SHORT, _TINY = 1.0, 1e-3, 1e-30
# The imaginary part that rounding may give a double zero.
_REAL = 1e-7


# -- power series in y -----------------------------------------------------------------------------


def middle(x: Any) -> Any:
    """The midpoints of a power series, to flint's current number of terms."""
    return arb_series([x[k].mid() for k in range(min(x.prec, ctx.cap))], ctx.cap)


def at(x: Any, y: Any) -> Any:
    """The value of a power series at y."""
    return arb_poly(x.coeffs())(y)


def radius(x: Any, inverse: bool = True) -> float:
    """The radius of convergence of x and 1/x, up to the next zero or singularity (root test)."""
    c = x.coeffs()
    first = c[0] if inverse else max(map(abs, c[:4]), key=float, default=arb(0))
    if first == 0:  # all known terms vanish
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
        """pi as a power series."""
        return arb_series([[1], [0, 1], [-self.square, 0, 1]][self.degree])

    def split(self, x: Any) -> tuple[tuple[Any, Any], Any]:
        """(r0, r1) and q in x = r0 + r1 y + pi q; nothing cancels for a small square."""
        d, count = self.degree, x.prec
        q = [x[k] for k in range(count)]
        if d == 2:
            for k in range(count - 3, -1, -1):
                q[k] += self.square * q[k + 2]
        # q[k] is a coefficient of the remainder for k < d, and of y^(k-d) in the quotient else.
        rest = [*q[:d], arb(0), arb(0)]
        return (rest[0], rest[1]), arb_series(q[d:], count - d)

    def over(self, x: Any) -> Any:
        """The quotient q."""
        return self.split(x)[1]


def psi(d: int, zeta: Any, s: Any) -> Any:
    """psi(s)."""
    return s * s - zeta if d == 2 else s if d == 1 else s * 0 + 1


def primitive(d: int, zeta: Any, s: Any) -> Any:
    """The integral of psi from 0."""
    return s * s * s / 3 - zeta * s if d == 2 else s * s / 2 if d == 1 else s


class Map(NamedTuple):
    """s(y) about the zeros: eps phi/pi, zeta, and the series of s."""

    eps: int
    zeta: Any
    chi: Any
    s: Any


def central_map(phi: Any, pi: Factor) -> Map:
    """The map from the Taylor series of phi by Newton's method in powers of pi(y).

    s - root y is divisible by pi, so that both sides of primitive(s) = g agree modulo pi^2 and the
    correction has one factor pi.
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
        mean = sum(
            (3 * x * D**k / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(c[::2])), arb(0)
        )
        zeta, s = D * mean.root(3) ** 2, mean.root(3) * y
    for _ in range(2 + ctx.cap.bit_length()):
        step = pi.over(pi.over(primitive(d, zeta, s) - g)) / pi.over(psi(d, zeta, s))
        s = middle(s - pi.series() * step)
    return Map(eps, zeta, chi, s)


# -- zeros -----------------------------------------------------------------------------------------


class Cluster(NamedTuple):
    """A zero, or two taken together, with approximations of their middle and D."""

    zeros: tuple[complex, ...]
    centre: float
    square: float = 0.0

    def reaches(self, lo: float, hi: float) -> bool:
        """True if a zero is near [lo, hi]."""
        far = max(_FAR, hi - lo)
        return any(abs(z - min(max(z.real, lo), hi)) < far for z in self.zeros)


class Phi:
    """phi on [lo, hi], a function of balls and power series, with its zeros near there.

    Parameters
    ----------
    phi : symasym.drift.evaluate.Polynomial or Analytic
    lo, hi : float
    """

    def __init__(self, phi: Any, lo: float = -1.0, hi: float = 1.0) -> None:
        self.phi, self.lo, self.hi = phi, lo, hi

    def taylor(self, u: Any, of: Any = None) -> Any:
        """The power series of phi at u, or of another function."""
        return middle((of or self.phi)(arb_series([u, 1], ctx.cap)))

    def mirrored(self) -> Phi:
        """-phi(-u) on the reflected interval."""
        other = Phi(self.phi.turned(-1, -1), -self.hi, -self.lo)
        other.zeros = [-z.conjugate() for z in self.zeros]
        return other

    @cached_property
    def zeros(self) -> list[complex]:
        """The zeros of the Chebyshev interpolant that are zeros of phi."""
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
        """True if phi vanishes, up to rounding, at a zero of the interpolant."""
        x = self.phi(acb_series([acb(z), 1], 3))
        value, slope, curve = (abs(complex(x[k])) for k in range(3))
        return value < 1e-3 * slope + 1e-9 * curve + 1e-12

    def factor(self, cluster: Cluster) -> tuple[Any, Factor]:
        """A zero, or the middle m and D of a pair, to all digits (Newton, Bairstow)."""
        m, pi = arb(cluster.centre), Factor(len(cluster.zeros), arb(cluster.square))
        for _ in range(3 + ctx.prec.bit_length()):
            phi = self.taylor(m)
            # The remainder of phi by pi, and its derivatives with respect to D and m.
            (r0, r1), q = pi.split(phi)
            (d0, d1), (m0, m1) = pi.split(q)[0], pi.split(phi.derivative())[0]
            if pi.degree == 1:
                m = (m - r0 / m0).mid()
                continue
            det = m0 * d1 - m1 * d0
            D = (pi.square - (m0 * r1 - m1 * r0) / det).mid()
            m, pi = (m - (r0 * d1 - r1 * d0) / det).mid(), Factor(2, D)
        if not (m.is_finite() and pi.square.is_finite() and abs(m - cluster.centre) < 0.1):
            raise three_together(cluster.centre)
        return m, pi

    def clusters(self) -> list[Cluster]:
        """The zeros in pairs of neighbours, the closest first; conjugate zeros are a pair."""
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
        found += [Cluster((real[k],), real[k].real) for k in left]
        return sorted(found, key=lambda c: c.centre)

    def _alone(self, centre: float, square: float) -> bool:
        """True if the series about the middle of a pair converges at both."""
        rest = Factor(2, arb(square)).over(self.taylor(arb(centre)))
        return bool(SHARE * radius(rest) > abs(square) ** 0.5)

    def panels(self, lo: Any, hi: Any, order: int, weight: Any = None) -> list[CanonicalForm]:
        """[lo, hi] divided half-way between clusters, one panel for each cluster."""
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
    """The refusal of a drift with more zeros close together than a panel may have."""
    return AccuracyError(
        f"A has three zeros close together near u = {float(u):.4g}, of which the uniform expansion "
        "takes two; use method 'exact'."
    )


# -- panels ----------------------------------------------------------------------------------------


class CanonicalForm(NamedTuple):
    """The coefficients of a panel for k = 0, 1, ..., N, independent of lam."""

    eps: int
    degree: int
    zeta: Any
    ends: tuple[Any, Any]  # s there
    p: list[Any]  # p_k(s) = a + b s as (a, b)
    c: list[Any]  # c_k at both ends
    own: list[Any]  # the integral of g c_k du
    mixed: list[list[Any]]  # [k][l]: the integral of p_k c_l ds


class _Disc(NamedTuple):
    """The power series of s, g and c_k about a point, used at distances from y0 to y1."""

    about: Any
    y0: Any
    y1: Any
    s: Any
    g: Any
    c: list[Any]

    def integral(self, x: Any) -> Any:
        """The integral of a power series over the disc."""
        area = x.integral()
        return at(area, self.y1) - at(area, self.y0)


def panel(
    phi: Phi, centre: Any, pi: Factor, lo: Any, hi: Any, order: int, weight: Any = None
) -> CanonicalForm:
    """The panel [lo, hi] with the zeros of pi about `centre` and the weight g (None: 1)."""
    weight = weight or (lambda u: 0 * u + 1)
    of, g, d = central_map(phi.taylor(centre), pi), phi.taylor(centre, weight), pi.degree
    s, top, p, c = of.s, pi.over(psi(d, of.zeta, of.s)), list[Any](), list[Any]()
    root, slope = pi.split(s)[0][1] if d == 2 else arb(1), top / of.chi
    b = g * slope
    for _ in range(order + 1):
        r0, r1 = pi.split(b)[0]
        p.append((r0, r1 / root))
        c.append(pi.over(b - r0 - r1 / root * s) / top)
        b = slope * c[-1].derivative()
    near = arb(SHARE * min(radius(pi.over(phi.taylor(centre))), radius(g, False)))
    discs = [_Disc(centre, -near, near, s, g, c)]
    for side, end in ((-1, lo), (1, hi)):
        edge, here = centre + side * near, at(s, side * near)
        while side * (end - edge) > 0:
            discs.append(_next(phi, weight, d, of, p, side, edge, here))
            about, step = discs[-1].about, side * discs[-1].y1
            edge, here = about + step, at(discs[-1].s, step)
    discs = [x._replace(y0=max(x.y0, lo - x.about), y1=min(x.y1, hi - x.about)) for x in discs]
    discs = sorted((x for x in discs if x.y0 < x.y1), key=lambda x: float(x.about))
    ks = range(order + 1)
    own = [sum((x.integral(x.g * x.c[k]) for x in discs), arb(0)) for k in ks]
    mixed = [[arb(0)] * (order + 1 - k) for k in ks if d]
    for x in discs:
        for row, (a, b) in zip(mixed, p, strict=False):
            ds = (a + b * x.s) * x.s.derivative()
            for k in range(len(row)):
                row[k] += x.integral(ds * x.c[k])
    low, high = discs[0], discs[-1]
    ends = at(low.s, low.y0), at(high.s, high.y1)
    at_ends = [(at(x, low.y0), at(y, high.y1)) for x, y in zip(low.c, high.c, strict=True)]
    return CanonicalForm(of.eps, d, of.zeta, ends, p, at_ends, own, mixed)


def _next(
    phi: Phi, weight: Any, d: int, of: Map, p: list[Any], side: int, edge: Any, here: Any
) -> _Disc:
    """The disc beyond an edge at which s is `here`, from primitive(s) = eps int phi by Newton."""
    room = min(radius(phi.taylor(edge)), radius(phi.taylor(edge, weight), False))
    step = arb(SHARE / (1 + SHARE) * room)
    if step < _SHORT:
        raise three_together(edge)
    about, s, c = edge + side * step, arb_series([here]), []
    rate, g = of.eps * phi.taylor(about), phi.taylor(about, weight)
    level = rate.integral()
    level += primitive(d, of.zeta, here) - at(level, -side * step)
    for _ in range(4 + 2 * ctx.cap.bit_length()):
        s = middle(s - (primitive(d, of.zeta, s) - level) / psi(d, of.zeta, s))
    below = psi(d, of.zeta, s)
    slope = below / rate
    b = g * slope
    for r0, r1 in p:
        c.append((b - r0 - r1 * s) / below)
        b = slope * c[-1].derivative()
    return _Disc(about, -step, step, s, g, c)
