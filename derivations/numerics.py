"""Integrals of exp(±lam V) at high precision, the independent side of the order checks.

Composite Gauss-Legendre in an mpmath context; no code is shared with the engines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

from mpmath.calculus.quadrature import GaussLegendre


@dataclass(frozen=True)
class Scene:
    """A polynomial drift on [-1, 1] with exact coefficients, constant outside."""

    coefficients: tuple[Fraction, ...]

    @classmethod
    def friction(cls, *numbers: str) -> Scene:
        """The cubic friction drift (eq:phifric0) of mu, alpha and z0."""
        m, a, z = map(Fraction, numbers)
        return cls((1 - z, -a * (1 + m), Fraction(0), a * m))

    def phi(self, ctx: Any, u: Any, derivative: int = 0) -> Any:
        """The `derivative`-th derivative of A(u)."""
        return ctx.polyval(_coefficients(self, derivative, ctx, ctx.prec), u)

    def end(self, ctx: Any, side: int) -> Any:
        """a- (side -1) or a+ (side 1)."""
        return self.phi(ctx, ctx.mpf(side))

    def V(self, ctx: Any, u: Any) -> Any:
        """The potential on all of the line, V(-1) = 0 (eq:V2)."""
        inside = min(max(u, ctx.mpf(-1)), ctx.mpf(1))
        value = ctx.polyval(_coefficients(self, -1, ctx, ctx.prec), inside)
        return value if u == inside else value - (u - inside) * self.phi(ctx, inside)

    def roots(self, ctx: Any) -> list[Any]:
        """Zeros of A in (-1, 1), left to right, to the context's precision."""
        return _roots(self, ctx, ctx.prec)


@cache
def _coefficients(scene: Scene, derivative: int, ctx: Any, precision: int) -> list[Any]:
    """Coefficients of a derivative of A (of V for -1), highest power first."""
    found = list(scene.coefficients)
    for _ in range(derivative):
        found = [k * c for k, c in enumerate(found)][1:]
    if derivative < 0:
        found = [Fraction(0), *(-c / (k + 1) for k, c in enumerate(found))]
        found[0] = -sum(c * (-1) ** k for k, c in enumerate(found))
    return [ctx.mpf(c.numerator) / c.denominator for c in reversed(found)]


#: Friction that slides, with one well.
SLIDING = Scene.friction("1", "1", "1/2")
#: A = 3 (u + 1/5)(u - 3/5)(u + 2): a well at -1/5, a barrier at 3/5, everything rational.
WELL = Scene((Fraction(-18, 25), Fraction(-69, 25), Fraction(24, 5), Fraction(3)))


@cache
def _roots(scene: Scene, ctx: Any, precision: int) -> list[Any]:
    found = ctx.polyroots(_coefficients(scene, 0, ctx, precision), 200, extraprec=precision)
    return sorted(x for x in found if ctx.im(x) == 0 and -1 < x < 1)


@cache
def _nodes(ctx: Any, precision: int, degree: int) -> list[tuple[Any, Any]]:
    """Gauss-Legendre nodes and weights, left to right: 12 at degree 3, 24 at 4."""
    return sorted(GaussLegendre(ctx).calc_nodes(degree, precision))


def _panel(ctx: Any, a: Any, b: Any, degree: int = 4) -> list[tuple[Any, Any]]:
    """Places and weights on one panel."""
    half, middle = (b - a) / 2, (a + b) / 2
    return [(middle + half * x, half * w) for x, w in _nodes(ctx, ctx.prec, degree)]


def uniform(ctx: Any, a: Any, b: Any, width: Any) -> list[Any]:
    """Ends of equal panels no wider than `width`."""
    a, b = ctx.mpf(a), ctx.mpf(b)
    count = max(1, int(ctx.ceil((b - a) / width)))
    return [a + (b - a) * k / count for k in range(count + 1)]


def around(ctx: Any, centre: Any, width: Any, a: Any, b: Any, reach: int = 16) -> list[Any]:
    """Ends of panels of one `width` around a saddle, `reach` to either side, inside [a, b]."""
    points = [centre + k * width for k in range(-reach, reach + 1)]
    low, high = ctx.mpf(a), ctx.mpf(b)
    return [max(low, points[0]), *(x for x in points if low < x < high), min(high, points[-1])]


def integral(ctx: Any, f: Any, points: list[Any]) -> Any:
    """The integral of f over consecutive panels."""
    panels = (_panel(ctx, a, b) for a, b in pairwise(points) if b > a)
    return ctx.fsum(w * f(x) for rule in panels for x, w in rule)


def nested(ctx: Any, outer: Any, inner: Any, points: list[Any], start: Any) -> tuple[Any, Any]:
    """The integral of outer(v) (start + that of inner up to v), and the inner one up to the end."""
    total, running = ctx.zero, start
    for a, b in pairwise(points):
        at, base = a, running
        for v, weight in _panel(ctx, a, b) if b > a else ():
            base += ctx.fsum(w * inner(x) for x, w in _panel(ctx, at, v, 3))
            at, total = v, total + weight * outer(v) * base
        running = base + ctx.fsum(w * inner(x) for x, w in _panel(ctx, at, b, 3))
    return total, running


def _rates(ctx: Any, scene: Scene, lam: Any) -> tuple[Callable[[Any], Any], ...]:
    """e^{lam V} and e^{-lam V} as functions of u."""
    return lambda x: ctx.exp(lam * scene.V(ctx, x)), lambda x: ctx.exp(-lam * scene.V(ctx, x))


def _tail(ctx: Any, scene: Scene, lam: Any, r: Any, side: int, sign: int = -1) -> Any:
    """The integral of e^{sign lam |u - side| |a|} beside the layer, of a drift to the right."""
    rate = lam * scene.end(ctx, side)
    return sign * (ctx.exp(sign * rate * (r - 1)) - 1) / rate


def escape_time(ctx: Any, scene: Scene, kappa: Any, r: Any) -> Any:
    """T (eq:Ttilde), for kappa that is not small and a drift to the right."""
    lam = 2 / kappa**2
    up, down = _rates(ctx, scene, lam)
    left, right = (uniform(ctx, a, a + 1, min(ctx.mpf(1) / 4, kappa)) for a in (-1, 0))
    decay = _tail(ctx, scene, lam, r, -1)
    # v < -1 in closed form.
    more, _ = nested(ctx, up, down, left, decay)
    J1 = ((r - 1) - decay) / (lam * scene.end(ctx, -1)) + more
    I1 = _tail(ctx, scene, lam, r, -1, 1) + integral(ctx, up, left)
    I0 = integral(ctx, up, right) + up(ctx.one) * _tail(ctx, scene, lam, r, 1)
    C = I0 / (I0 + I1)
    return (1 - C) * sum(split_pieces(ctx, scene, kappa, r)) - C * lam * J1


def split_pieces(ctx: Any, scene: Scene, k: Any, r: Any) -> list[Any]:
    """The four pieces of eq:fourPieces, times lam; for kappa that is not small."""
    lam, width = 2 / k**2, min(ctx.mpf(1) / 4, ctx.sqrt(2) * k)
    up, down = _rates(ctx, scene, lam)
    left, right = (_tail(ctx, scene, lam, r, side) for side in (-1, 1))
    before = integral(ctx, down, uniform(ctx, -1, 0, width))
    ahead = uniform(ctx, 0, 1, width)
    second, inside = nested(ctx, up, down, ahead, before)
    third = up(ctx.one) * right * (left + inside)
    fourth = ((r - 1) - right) / (lam * scene.end(ctx, 1))
    return [lam * x for x in (left * integral(ctx, up, ahead), second, third, fourth)]


def well_integral(ctx: Any, scene: Scene, kappa: Any) -> Any:
    """lam times the double integral of eq:secondTerm over 16 widths of its saddle."""
    lam = 2 / ctx.mpf(kappa) ** 2
    low, high = scene.roots(ctx)
    V1, V2 = scene.V(ctx, low), scene.V(ctx, high)
    inner = lambda x: ctx.exp(-lam * (scene.V(ctx, x) - V1))  # noqa: E731
    outer = lambda x: ctx.exp(lam * (scene.V(ctx, x) - V2))  # noqa: E731
    width = 1 / ctx.sqrt(-lam * scene.phi(ctx, low, 1))
    well = around(ctx, low, width, -1, 1)
    top = around(ctx, high, 1 / ctx.sqrt(lam * scene.phi(ctx, high, 1)), 0, 1)
    if well[-1] <= top[0]:
        value = integral(ctx, inner, well) * integral(ctx, outer, top)
    else:
        before = integral(ctx, inner, uniform(ctx, -1, top[0], width))
        value, _ = nested(ctx, outer, inner, top, before)
    return lam * value * ctx.exp(lam * (V2 - V1))


def outside(ctx: Any, scene: Scene, k: Any) -> Any:
    """The integral of e^{-2 V/k^2} outside the layer, of a sliding scene."""
    weight = ctx.exp(-2 * scene.V(ctx, ctx.mpf(1)) / k**2)
    return k**2 / (2 * scene.end(ctx, -1)) - k**2 / (2 * scene.end(ctx, 1)) * weight


def outside_share(scene: Scene, k: Any, ctx: Any) -> Any:
    """1 - P for small kappa: the layer's integral over its well's neighbourhood."""
    (low,) = scene.roots(ctx)
    down = lambda x: ctx.exp(-2 * scene.V(ctx, x) / k**2)  # noqa: E731
    width = 1 / ctx.sqrt(-2 / k**2 * scene.phi(ctx, low, 1))
    inside = integral(ctx, down, around(ctx, low, width, -1, 1))
    return outside(ctx, scene, k) / (inside + outside(ctx, scene, k))
