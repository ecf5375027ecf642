"""Quantities of the paper from their definitions: differential equations, by Taylor's method.

It shares nothing with the derivations and nothing with the library. A drift phi is a
polynomial on each of some stretches of the line, and lam = 2/kappa^2. With S the slope of what is
looked for, all equations are S' = -lam (phi S + source):

- The mean escape time has (kappa^2/2) T'' + phi T' = -1 and T = 0 at both ends (Gardiner, Handbook
  of Stochastic Methods, 5.2.7): the source is 1. With a wall at the left end, T' = 0 there.
- The chance h of leaving on the left has (kappa^2/2) h'' + phi h' = 0, h = 1 and h = 0 at the ends.
- The stationary density q has no flux, (kappa^2/2) q' = phi q: the drift is -phi, the source 0.
- The density R integrated over all time has the flux -phi R + (kappa^2/2) R' = c left of the start
  and c - 1 right of it, and R = 0 at both ends: the drift is -phi, the sources -c and 1 - c.

The recurrence (n + 1) s_(n+1) = -lam (sum of f_k s_(n-k), + source for n = 0) gives the Taylor
coefficients s_n of S from those of phi, f_k; where phi is constant the equation is solved exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property
from typing import Any

import mpmath
import numpy as np

#: A context of 20 digits, whatever mpmath's own precision is.
CTX = mpmath.mp.clone()
CTX.dps = 20
_TERMS = 32
_INVERSES = [1 / CTX.mpf(n) for n in range(1, _TERMS + 2)]


def of_fraction(x: Any) -> Any:
    """A number of the context from a rational, an int, or a number of the context."""
    return CTX.mpf(x.numerator) / x.denominator if isinstance(x, Fraction) else CTX.mpf(x)


@dataclass(frozen=True)
class Drift:
    """A drift: coefficients in powers of u on each stretch, the first and the last without end.

    Attributes
    ----------
    edges : tuple of Fraction
        Where one stretch ends and the next begins, from left to right.
    fields : tuple of tuples of Fraction
        One more than there are edges.
    """

    edges: tuple[Fraction, ...]
    fields: tuple[tuple[Fraction, ...], ...]

    @classmethod
    def layer(cls, coefficients: Any, width: Fraction = Fraction(1)) -> Drift:
        """A polynomial of u/width on (-width, width), constant and continuous outside."""
        inside = [Fraction(c) for c in coefficients]
        ends = [sum(c * side**k for k, c in enumerate(inside)) for side in (-1, 1)]
        scaled = tuple(c / width**k for k, c in enumerate(inside))
        return cls((-width, width), ((ends[0],), scaled, (ends[1],)))

    def mirrored(self) -> Drift:
        """The drift of -u."""
        return Drift(
            tuple(-e for e in reversed(self.edges)),
            tuple(
                tuple(-c * (-1) ** k for k, c in enumerate(field))
                for field in reversed(self.fields)
            ),
        )

    def against(self) -> Drift:
        """The opposite drift, -phi."""
        return Drift(self.edges, tuple(tuple(-c for c in field) for field in self.fields))

    def stretches(self, a: Any, b: Any) -> list[tuple[Any, Any, tuple[Fraction, ...]]]:
        """The stretches between a and b, a < b."""
        cuts = [e for e in map(of_fraction, self.edges) if a < e < b]
        points = [a, *cuts, b]
        inner = [sum(of_fraction(e) <= x for e in self.edges) for x in points[:-1]]
        return [(x, y, self.fields[n]) for x, y, n in zip(points, points[1:], inner, strict=False)]

    def slope(self, lam: Any, a: Any, b: Any, start: Any, source: Any) -> tuple[Any, Any]:
        """S at b and the integral of S over (a, b), from S(a) = start."""
        total, value = CTX.zero, CTX.mpf(start)
        for x, y, field in self.stretches(a, b):
            solve = _constant if len(field) == 1 else _taylor
            value, part = solve([of_fraction(c) for c in field], lam, x, y, value, source)
            total += part
        return value, total

    def numpy(self, u: Any) -> Any:
        """phi in float64."""
        u = np.asarray(u, dtype=float)
        found = np.polyval([float(c) for c in reversed(self.fields[-1])], u)
        for edge, field in zip(reversed(self.edges), reversed(self.fields[:-1]), strict=True):
            found = np.where(u < float(edge), np.polyval([float(c) for c in field[::-1]], u), found)
        return found

    def potential(self, u: Any) -> Any:
        """V with V' = -phi and V(-1) = 0, a number of the context."""
        u, base = CTX.mpf(u), CTX.mpf(-1)
        sign = -1 if u >= base else 1
        total = CTX.zero
        for x, y, field in self.stretches(min(u, base), max(u, base)):
            for k, c in enumerate(field):
                total += of_fraction(c) * (y ** (k + 1) - x ** (k + 1)) / (k + 1)
        return sign * total


def _constant(field: Any, lam: Any, x: Any, y: Any, value: Any, source: Any) -> tuple[Any, Any]:
    """S(y) and the integral of S where the drift is one number."""
    (c,), h = field, y - x
    if c == 0:
        return value - lam * source * h, value * h - lam * source * h * h / 2
    rest = value + source / c
    return (
        rest * CTX.exp(-lam * c * h) - source / c,
        -rest * CTX.expm1(-lam * c * h) / (lam * c) - source * h / c,
    )


def _taylor(field: Any, lam: Any, x: Any, y: Any, value: Any, source: Any) -> tuple[Any, Any]:
    """S(y) and the integral of S where the drift is a polynomial."""
    total = CTX.zero
    while x < y:
        # phi about x, then a step on which lam times its integral is at most 3.
        local = list(field)
        for k in range(len(local) - 1):
            for j in reversed(range(k, len(local) - 1)):
                local[j] += x * local[j + 1]
        sizes = [float(lam * abs(c)) for c in local]
        h = min(0.25, float(y - x))
        while sum(c * h ** (k + 1) for k, c in enumerate(sizes)) > 3:
            h *= 0.9
        h = y - x if h >= float(y - x) else CTX.mpf(h)
        x = x + h
        local = [lam * c * h ** (k + 1) for k, c in enumerate(local)]
        terms = [value]
        for n in range(_TERMS):
            rate = CTX.fdot(local[: n + 1], reversed(terms[-len(local) :]))
            terms.append(-(rate + (lam * h * source if n == 0 else 0)) * _INVERSES[n])
        value = CTX.fsum(terms)
        total += h * CTX.fdot(terms, _INVERSES)
    return value, total


@dataclass(frozen=True)
class Scene:
    """A drift with its noise, its radius and its start; see the module for the equations."""

    drift: Drift
    kappa: Any
    r: Any = 10
    start: Any = 0

    @property
    def lam(self) -> Any:
        """2/kappa^2."""
        return 2 / CTX.mpf(self.kappa) ** 2

    def with_(self, **changes: Any) -> Scene:
        """The scene with other numbers."""
        return replace(self, **changes)

    def time_from_wall(self, wall: Any, start: Any, target: Any) -> Any:
        """Mean time from `start` up to `target`, a reflecting wall at `wall`."""
        wall, start, target = map(CTX.mpf, (wall, start, target))
        at_start = self.drift.slope(self.lam, wall, start, 0, 1)[0] if wall < start else CTX.zero
        return -self.drift.slope(self.lam, start, target, at_start, 1)[1]

    @cached_property
    def sides(self) -> tuple[Any, Any, Any, Any]:
        """Integrals of S left and right of the start: with source 1 and S(-r) = 0, and with source
        0 and S(-r) = e^(lam V(-r)).
        """
        r, x, lam = CTX.mpf(self.r), CTX.mpf(self.start), self.lam
        here, left = self.drift.slope(lam, -r, x, 0, 1)
        _, right = self.drift.slope(lam, x, r, here, 1)
        scale = CTX.exp(lam * self.drift.potential(-r))
        here, free_left = self.drift.slope(lam, -r, x, scale, 0)
        _, free_right = self.drift.slope(lam, x, r, here, 0)
        return left, right, free_left, free_right

    @cached_property
    def T(self) -> Any:
        """Mean escape time from |u| < r."""
        left, right, free_left, free_right = self.sides
        return (left * free_right - right * free_left) / (free_left + free_right)

    @cached_property
    def C(self) -> Any:
        """Chance of leaving through -r."""
        _, _, free_left, free_right = self.sides
        return free_right / (free_left + free_right)

    @cached_property
    def _residence(self) -> tuple[Any, Any]:
        """R at the start from either end, with the flux 1 there."""
        x, r = CTX.mpf(self.start), CTX.mpf(self.r)
        against = self.drift.against()
        left, _ = against.slope(self.lam, -r, x, 0, -1)
        right, _ = against.mirrored().slope(self.lam, -r, -x, 0, -1)
        return left, right

    def flux(self, u: Any) -> Any:
        """-phi R + (kappa^2/2) R' at u."""
        left, right = self._residence
        share = right / (left + right)
        return share if u < self.start else share - 1

    def R(self, u: Any) -> Any:
        """Density of the position at u, integrated over all time until the escape."""
        u, r = CTX.mpf(u), CTX.mpf(self.r)
        against = self.drift.against()
        if u < self.start:
            return self.flux(u) * against.slope(self.lam, -r, u, 0, -1)[0]
        return -self.flux(u) * against.mirrored().slope(self.lam, -r, -u, 0, -1)[0]

    @cached_property
    def masses(self) -> tuple[Any, Any, Any]:
        """Integrals of the density of zero flux that is 1 at the layer's left edge: left of the
        layer, inside, right of it.
        """
        low, high = (of_fraction(e) for e in (self.drift.edges[0], self.drift.edges[-1]))
        against = self.drift.against()
        here, inside = against.slope(self.lam, low, high, 1, 0)

        def tail(drift: Drift, edge: Any, value: Any) -> Any:
            far = 100 / (self.lam * abs(of_fraction(drift.fields[-1][0])))
            return drift.slope(self.lam, edge, edge + far, value, 0)[1]

        return tail(against.mirrored(), -low, CTX.one), inside, tail(against, high, here)

    @cached_property
    def P(self) -> Any:
        """Stationary probability of the layer; with digits enough for 1 - P."""
        with CTX.workdps(200):
            return self.masses[1] / sum(self.masses)

    def p_ss(self, u: Any) -> Any:
        """Stationary density at u."""
        against, low = self.drift.against(), of_fraction(self.drift.edges[0])
        u = CTX.mpf(u)
        if u >= low:
            here = against.slope(self.lam, low, u, 1, 0)[0] if u > low else CTX.one
        else:
            here = against.mirrored().slope(self.lam, -low, -u, 1, 0)[0]
        return here / sum(self.masses)


@cache
def roots(drift: Drift) -> list[Any]:
    """Zeros of the drift inside the layer, from left to right, by bisection."""
    field = [of_fraction(c) for c in drift.fields[1]]

    def phi(u: Any) -> Any:
        return CTX.polyval(field[::-1], u)

    low, high = (of_fraction(e) for e in (drift.edges[0], drift.edges[-1]))
    grid = [low + (high - low) * k / 211 for k in range(212)]
    return [
        CTX.findroot(phi, (a, b), solver="anderson", verify=False)
        for a, b in zip(grid, grid[1:], strict=False)
        if phi(a) * phi(b) < 0
    ]


def taylor(drift: Drift, at: Any, count: int) -> list[Any]:
    """The first derivatives of phi inside the layer: phi, phi', ..., `count` of them."""
    field = [of_fraction(c) for c in drift.fields[1]]
    found = []
    for _ in range(count):
        found.append(CTX.polyval(field[::-1], at) if field else CTX.zero)
        field = [k * c for k, c in enumerate(field)][1:]
    return found


def gauss(f: Callable[[Any], Any], a: Any, b: Any, cuts: Any = (-1, 0, 1), panels: int = 2) -> Any:
    """Integral over (a, b) in float64: 24 Gauss-Legendre nodes on each of some panels.

    a and b may be arrays; then the nodes are a further, last axis of what `f` receives, and it
    is summed over. An infinite b is reached by u = a + exp(pi/2 sinh x) (exp-sinh).
    """
    if np.ndim(b) == 0 and np.isinf(b):
        x = np.linspace(-4, 4, 161)
        at = np.exp(np.pi / 2 * np.sinh(x))
        weight = np.pi / 2 * np.cosh(x) * at * (x[1] - x[0])
        return np.sum(f(a + at) * weight, axis=-1)
    a, b = np.broadcast_arrays(np.asarray(a, float), np.asarray(b, float))
    low, high = np.minimum(a, b), np.maximum(a, b)
    ends = [low, *(np.clip(c, low, high) for c in cuts), high]
    x, w = np.polynomial.legendre.leggauss(24)
    total = np.zeros(a.shape)
    for left, right in zip(ends, ends[1:], strict=False):
        width = (right - left) / panels
        if not np.any(width):
            continue
        for k in range(panels):
            middle, half = left + (k + 0.5) * width, width / 2
            nodes = middle[..., None] + half[..., None] * x
            total = total + np.sum(f(nodes) * (half[..., None] * w), axis=-1)
    return np.where(b < a, -total, total)
