"""Integrals of exp(±lam V) at high precision, the independent side of the order checks.

Composite Gauss-Legendre in a private mpmath context; it shares no code with
the engines of `symasym.exact`, whose tests may therefore lean on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from mpmath.ctx_mp import MPContext

from symasym.derivation.numerical import nodes


@dataclass(frozen=True)
class Scene:
    """A polynomial drift on [-1, 1] with exact coefficients, constant outside."""

    coefficients: tuple[Fraction, ...]

    @classmethod
    def friction(cls, mu: str, alpha: str, z0: str) -> Scene:
        """The cubic friction drift (eq:phifric0)."""
        m, a, z = Fraction(mu), Fraction(alpha), Fraction(z0)
        return cls((1 - z, -a * (1 + m), Fraction(0), a * m))

    def phi(self, ctx: Any, u: Any, derivative: int = 0) -> Any:
        """The `derivative`-th derivative of A(u)."""
        found = list(self.coefficients)
        for _ in range(derivative):
            found = [k * c for k, c in enumerate(found)][1:]
        total = ctx.zero
        for c in reversed(found):
            total = total * u + ctx.mpf(c.numerator) / c.denominator
        return total

    def end(self, ctx: Any, side: int) -> Any:
        """a- (side -1) or a+ (side 1)."""
        return self.phi(ctx, ctx.mpf(side))

    def V(self, ctx: Any, u: Any) -> Any:
        """The potential on all of the line, V(-1) = 0 (eq:V2)."""
        inside = min(max(u, ctx.mpf(-1)), ctx.mpf(1))
        value = self._primitive(ctx, ctx.mpf(-1)) - self._primitive(ctx, inside)
        return value - (u - inside) * self.end(ctx, 1 if u > 0 else -1)

    def _primitive(self, ctx: Any, u: Any) -> Any:
        """The integral of A from 0 to u."""
        total = ctx.zero
        for k, c in reversed(list(enumerate(self.coefficients))):
            total = total * u + ctx.mpf(c.numerator) / (c.denominator * (k + 1))
        return total * u

    def roots(self, ctx: Any) -> list[Any]:
        """Zeros of A in (-1, 1), left to right, to the context's precision."""
        return [ctx.convert(x) for x in _roots(self, ctx.prec)]


#: Friction that slides, with one well.
SLIDING = Scene.friction("1", "1", "1/2")
#: A = 3 (u + 1/5)(u - 3/5)(u + 2): a well at -1/5, a barrier at 3/5, everything rational.
WELL = Scene((Fraction(-18, 25), Fraction(-69, 25), Fraction(24, 5), Fraction(3)))


@cache
def _roots(scene: Scene, precision: int) -> list[Any]:
    """Zeros in (-1, 1), found once a precision: order checks ask for them at every point."""
    ctx = MPContext()
    ctx.prec = precision
    powers = [ctx.mpf(c.numerator) / c.denominator for c in reversed(scene.coefficients)]
    found = ctx.polyroots(powers, maxsteps=200, extraprec=precision) if powers[1:] else []
    return sorted(x for x in found if ctx.im(x) == 0 and -1 < x < 1)


def panel(ctx: Any, f: Any, a: Any, b: Any, degree: int = 4) -> Any:
    """Gauss-Legendre on one panel (24 nodes at degree 4)."""
    half, middle = (b - a) / 2, (a + b) / 2
    return half * ctx.fsum(
        ctx.convert(w) * f(middle + half * ctx.convert(x)) for x, w in nodes(ctx.prec, degree)
    )


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
    """Over consecutive panels."""
    return ctx.fsum(panel(ctx, f, a, b) for a, b in zip(points, points[1:], strict=False) if b > a)


def nested(ctx: Any, outer: Any, inner: Any, points: list[Any], start: Any) -> tuple[Any, Any]:
    """Integral of outer(v) (start + integral of inner up to v), and that inner integral at the end.

    The inner integral is carried along from node to node.
    """
    total, running = ctx.zero, start
    for a, b in zip(points, points[1:], strict=False):
        if b <= a:
            continue
        half, middle = (b - a) / 2, (a + b) / 2
        weighted = sorted((ctx.convert(x), ctx.convert(w)) for x, w in nodes(ctx.prec, 4))
        at, base = a, running
        for x, weight in weighted:
            v = middle + half * x
            base += panel(ctx, inner, at, v, 3)
            at = v
            total += half * weight * outer(v) * base
        running = base + panel(ctx, inner, at, b, 3)
    return total, running


@dataclass(frozen=True)
class Pieces:
    """I0, I1: integrals of e^{lam V} over (0, r), (-r, 0); J0, J1 with the inner one; see eq:C."""

    I0: Any
    I1: Any
    J0: Any
    J1: Any
    lam: Any

    @property
    def C(self) -> Any:
        """eq:C."""
        return self.I0 / (self.I0 + self.I1)

    @property
    def T(self) -> Any:
        """eq:Ttilde."""
        return self.lam * ((1 - self.C) * self.J0 - self.C * self.J1)


def _weights(ctx: Any, scene: Scene, lam: Any) -> tuple[Callable[[Any], Any], ...]:
    """e^{lam V} and e^{-lam V} as functions of u."""
    return lambda x: ctx.exp(lam * scene.V(ctx, x)), lambda x: ctx.exp(-lam * scene.V(ctx, x))


def pieces(ctx: Any, scene: Scene, kappa: Any, r: Any) -> Pieces:
    """The four integrals, outside [-1, 1] in closed form; for kappa of 0.01 and more, r >= 1."""
    lam = 2 / ctx.mpf(kappa) ** 2
    r = ctx.mpf(r)
    am, ap = scene.end(ctx, -1), scene.end(ctx, 1)

    up, down = _weights(ctx, scene, lam)
    width = min(ctx.mpf(1) / 4, 2 / ctx.sqrt(lam))
    left_decay = (1 - ctx.exp(-lam * am * (r - 1))) / (lam * am)
    left = uniform(ctx, -1, 0, width)
    right = uniform(ctx, 0, 1, width)
    # v < -1 in closed form, then carried along.
    J1 = ((r - 1) - left_decay) / (lam * am)
    part, G = nested(ctx, up, down, left, left_decay)
    J1 += part
    J0, G = nested(ctx, up, down, right, G)
    top = up(ctx.mpf(1))
    right_decay = (1 - ctx.exp(-lam * ap * (r - 1))) / (lam * ap)
    J0 += top * G * right_decay + ((r - 1) - right_decay) / (lam * ap)
    I1 = (ctx.exp(lam * am * (r - 1)) - 1) / (lam * am) + integral(ctx, up, left)
    I0 = integral(ctx, up, right) + top * right_decay
    return Pieces(I0, I1, J0, J1, lam)


def split_pieces(ctx: Any, scene: Scene, k: Any, r: Any) -> list[Any]:
    """The four pieces of eq:fourPieces, times lam; for kappa that is not small."""
    lam = 2 / k**2
    am, ap = scene.end(ctx, -1), scene.end(ctx, 1)
    width = min(ctx.mpf(1) / 4, 2 / ctx.sqrt(lam))

    up, down = _weights(ctx, scene, lam)
    left = (1 - ctx.exp(-lam * am * (r - 1))) / (lam * am)
    right = (1 - ctx.exp(-lam * ap * (r - 1))) / (lam * ap)
    before = integral(ctx, down, uniform(ctx, -1, 0, width))
    second, inside = nested(ctx, up, down, uniform(ctx, 0, 1, width), before)
    first = left * integral(ctx, up, uniform(ctx, 0, 1, width))
    third = up(ctx.mpf(1)) * right * (left + inside)
    fourth = ((r - 1) - right) / (lam * ap)
    return [lam * x for x in (first, second, third, fourth)]


def well_integral(ctx: Any, scene: Scene, kappa: Any) -> Any:
    """lam times the double integral of eq:secondTerm over the neighbourhoods of its saddle.

    What is left out is below exp(-128) of it (16 widths of each Gaussian).
    """
    lam = 2 / ctx.mpf(kappa) ** 2
    low, high = scene.roots(ctx)
    V1, V2 = scene.V(ctx, low), scene.V(ctx, high)
    inner = lambda x: ctx.exp(-lam * (scene.V(ctx, x) - V1))  # noqa: E731
    outer = lambda x: ctx.exp(lam * (scene.V(ctx, x) - V2))  # noqa: E731
    well = around(ctx, low, 1 / ctx.sqrt(-lam * scene.phi(ctx, low, 1)), -1, 1)
    top = around(ctx, high, 1 / ctx.sqrt(lam * scene.phi(ctx, high, 1)), 0, 1)
    if well[-1] <= top[0]:
        value = integral(ctx, inner, well) * integral(ctx, outer, top)
    else:
        width = 1 / ctx.sqrt(-lam * scene.phi(ctx, low, 1))
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
    bottom = scene.V(ctx, low)
    width = 1 / ctx.sqrt(-2 / k**2 * scene.phi(ctx, low, 1))
    inside = integral(
        ctx,
        lambda x: ctx.exp(-2 * (scene.V(ctx, x) - bottom) / k**2),
        around(ctx, low, width, -1, 1),
    ) * ctx.exp(-2 * bottom / k**2)
    beyond = outside(ctx, scene, k)
    return beyond / (inside + beyond)


def boundary_value(scene: Scene, kappa: float, r: int, cells: int = 100) -> tuple[float, float]:
    """T and C from their boundary-value problems, by exponentially fitted differences.

    (kappa^2/2) T'' + phi T' = -1, T = 0 at both ends, and the same without the 1 for the chance of
    leaving on the left. Scharfetter and Gummel's weights x/(e^x - 1), `cells` to a unit and twice
    as many, and Richardson's extrapolation: no integral of e^{lam V} is formed, and the
    elimination from both ends subtracts nothing. In float64: T to 1e308.
    """
    (T, C), (finer_T, finer_C) = (_differences(scene, kappa, r, n) for n in (cells, 2 * cells))
    return (4 * finer_T - T) / 3, (4 * finer_C - C) / 3


def _differences(scene: Scene, kappa: float, r: int, cells: int) -> tuple[float, float]:
    """Both solutions at 0 on a grid of `cells` to a unit."""
    h, lam = 1 / cells, 2 / kappa**2
    coefficients = [float(c) for c in scene.coefficients]

    def weights(place: int) -> tuple[float, float]:
        """Of the step from `place` to the right, and of the way back."""
        at = max(min((place + 0.5) * h, 1.0), -1.0)
        x = lam * h * sum(c * at**k for k, c in enumerate(coefficients))
        back = x / math.expm1(x) if x else 1.0
        return back + x, back

    def swept(side: int) -> tuple[float, float, float]:
        """f next to 0 on one side is (1 - rest) f(0) + times, for C + chance."""
        rest, times, chance = 1.0, 0.0, float(side < 0)
        for k in range(r * cells - 1, 0, -1):
            right, left = weights(side * k)[0], weights(side * k - 1)[1]
            out, back = (right, left) if side > 0 else (left, right)
            size = out * rest + back
            rest, times, chance = (
                out * rest / size,
                (out * times + lam * h * h) / size,
                out * chance / size,
            )
        return rest, times, chance

    left, right = swept(-1), swept(1)
    out, back = weights(0)[0], weights(-1)[1]
    size = out * right[0] + back * left[0]
    return (
        (out * right[1] + back * left[1] + lam * h * h) / size,
        (out * right[2] + back * left[2]) / size,
    )
