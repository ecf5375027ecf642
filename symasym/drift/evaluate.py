"""A(u) and its Taylor polynomials in ball arithmetic (in float64: `symasym.drift.sampled`).

If A is analytic and |A| <= M on the disc of radius rho h about m, the Taylor polynomial with n
terms has an error of at most M rho^-n/(1 - 1/rho) on [m - h, m + h] (Cauchy's estimate). A finite
enclosure of A over a box around the disc proves that A is analytic there (`symasym.drift.formula`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property, reduce
from typing import Any, NamedTuple

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.balls import rational
from symasym.drift.formula import Formula
from symasym.drift.model import Model, Parametrized

_RADII = (32, 8, 4, 2)  # radii of discs in units of half a panel's width


class Polynomial:
    """A polynomial given by its coefficients (fmpq, arb or acb) in ascending order."""

    def __init__(self, coefficients: list[Any]) -> None:
        self.coefficients = coefficients
        self._poly = poly(coefficients)

    def __call__(self, x: Any) -> Any:
        if isinstance(x, (arb_series, acb_series)):
            return reduce(lambda total, c: total * x + c, reversed(self.coefficients), 0 * x)
        return self._poly(x)

    def taylor(self, middle: Any, half: Any, digits: int) -> tuple[Any, Any]:
        """A(middle + half t) as a polynomial in t, and its error, 0."""
        return self._poly(type(self._poly)([middle, half])), arb(0)

    def turned(self, out: int, inside: int) -> Polynomial:
        """out A(inside u) for two signs."""
        return Polynomial([c * (out * inside**k) for k, c in enumerate(self.coefficients)])


class Analytic:
    """A function of arb, acb and power series; it is not finite on a box with a singularity."""

    def __init__(self, of: Callable[[Any], Any]) -> None:
        self.of = of

    def __call__(self, x: Any) -> Any:
        try:
            return self.of(x)
        except (ValueError, ZeroDivisionError):  # raised by flint if a divisor may be 0
            return x * arb.nan()

    def _size(self, *points: fmpq) -> Any:
        """The largest |A| at the given points."""
        return max((abs(self(arb(u))).upper() for u in points), key=float)

    @cached_property
    def _scale(self) -> Any:
        """The order of magnitude of A on [-1, 1], at least 1e-300."""
        return self._size(*(fmpq(k, 2) for k in range(-2, 3))).max(arb(10) ** -300)

    def taylor(self, middle: fmpq, half: fmpq, digits: int) -> tuple[Any, Any]:
        """A Taylor polynomial in t, where u = middle + half t, and a bound on its error.

        The bound is below 10^-digits times A's size there, or 10^-2digits times A's size on
        [-1, 1], or infinite. Of the discs with A proved analytic that with fewest terms is used.
        """
        wanted = digits * math.log(10) + 12
        size = self._size(middle - half, middle + half).max(self._scale * arb(10) ** -digits)
        fewest, radius, bound = 2 * wanted, 0, arb.pos_inf()
        for rho in _RADII:
            around = abs(self(box(middle, rho * half, rho * half))).upper().max(size)
            terms = max(float((around / size).log() + wanted), 0.0) / math.log(rho)
            if terms < fewest:
                fewest, radius, bound = terms, rho, around
        if not radius:
            return arb_poly([0]), bound
        ctx.cap = n = math.ceil(fewest) + 2
        series = list(self(arb_series([middle, half], n)))
        return poly(series), (bound / (arb(radius) ** n * (1 - arb(1) / radius))).upper()

    def turned(self, out: int, inside: int) -> Analytic:
        """out A(inside u) for two signs."""
        return Analytic(lambda u: out * self.of(inside * u))


def poly(coefficients: list[Any]) -> Any:
    """The polynomial with these coefficients."""
    complex_ones = any(isinstance(c, acb) for c in coefficients)
    return (acb_poly if complex_ones else arb_poly)(coefficients)


def box(middle: Any, width: Any, height: Any) -> Any:
    """A box about a point of the real line, given by half its width and half its height."""
    return acb(arb(middle, arb(width)), arb(0, arb(height)))


class Piece(NamedTuple):
    """phi/sigma^2 on [left, right], and the weights of the scale and speed densities.

    With V' = -phi/sigma^2 the scale density is e^{lam V} `scale`, where scale = sigma^(-2 alpha),
    the speed density lam e^{-lam V} `speed`, where speed = sigma^(2 alpha - 2); None stands for 1.
    If the noise depends on u, `noise` has phi, sigma and alpha themselves.
    """

    left: fmpq
    right: fmpq
    phi: Polynomial | Analytic
    scale: Polynomial | Analytic | None = None
    speed: Polynomial | Analytic | None = None
    noise: Any = None

    def mirrored(self) -> Piece:
        """The piece of the mirrored drift -phi(-u) with the noise sigma(-u)."""
        scale, speed = (w and w.turned(1, -1) for w in (self.scale, self.speed))
        noise = self.noise
        if noise:
            phi, sigma, alpha = noise
            noise = phi.turned(-1, -1), sigma.turned(1, -1), alpha
        return Piece(-self.right, -self.left, self.phi.turned(-1, -1), scale, speed, noise)

    def reversed(self) -> Piece:
        """The piece with the scale density and the speed density interchanged."""
        return Piece(self.left, self.right, self.phi.turned(-1, 1), self.speed, self.scale)


def pieces(
    drift: Parametrized, low: fmpq, high: fmpq, values: Mapping[str, Any] | None = None
) -> list[Piece]:
    """The pieces of the drift from `low` to `high` at the current precision; `values` (fmpq, arb
    or acb) replace the values of its parameters."""
    model, one = drift.model, fmpq(1)
    numbers = {name: rational(x) for name, x in drift.scalars().items()}
    numbers.update(values or {})
    cuts = [rational(x) for x in model.cuts]
    found = [_weighted(model, k, numbers) for k in range(len(model.pieces))]
    if model.layered:
        # Outside the layer phi and sigma are constant; a rational value of phi is kept exact.
        (inside,), cuts = found, [-one, one]
        for side in (-1, 1) if low < -one or high > one else ():
            at = [w and Polynomial([w(arb(side))]) for w in inside[:3]]
            if model.noise:
                phi, sigma, alpha = inside[3]
                at.append((*(Polynomial([f(arb(side))]) for f in (phi, sigma)), alpha))
            else:
                end = drift.ends[side > 0]
                known = isinstance(end, Fraction) and not values
                at[0] = Polynomial(
                    [rational(end) if known else model.pieces[0].end(side, numbers, balls=True)]
                )
            found.insert(len(found) if side > 0 else 0, at)
        if len(found) == 1:
            found = [inside] * 3
    marks = zip([low, *cuts], [*cuts, high], found, strict=True)
    between = ((max(a, low), min(b, high), of) for a, b, of in marks)
    return [Piece(a, b, *of) for a, b, of in between if a < b]


def _weighted(model: Model, k: int, numbers: Mapping[str, Any]) -> list[Any]:
    """phi/sigma^2 of the k-th piece, and the weights `scale` and `speed` and `noise` of `Piece`."""
    phi = profile(model.pieces[k], numbers)
    if model.noise is None:
        return [phi]
    sigma, twice = profile(model.noise, numbers), int(2 * model.alpha)

    def weight(n: int) -> Analytic | None:
        return Analytic(lambda u: sigma(u) ** -n) if n else None

    over = Analytic(lambda u: phi(u) / sigma(u) ** 2)
    return [over, weight(twice), weight(2 - twice), (phi, sigma, rational(model.alpha))]


def profile(formula: Formula, numbers: Mapping[str, Any]) -> Polynomial | Analytic:
    """The function A(u) for parameters `numbers`, each an fmpq, arb or acb."""
    try:
        if coefficients := formula.coefficients(numbers, balls=True):
            return Polynomial(coefficients)
    except ZeroDivisionError:  # A is finite nowhere
        pass
    return Analytic(lambda u: formula.value(u, numbers, balls=True))


def halved(
    low: fmpq, high: fmpq, holds: Callable[[fmpq, fmpq], bool], most: int, deepest: int
) -> tuple[list[fmpq], fmpq | None]:
    """The left ends of intervals, found by bisection, for which a test of middle and half-width
    holds; and None, or a point near which it still fails after `deepest` halvings or when there
    are more than `most` intervals."""
    begins, waiting, narrow = [], [(low, high)], (high - low) / 2**deepest
    while waiting:
        a, b = waiting.pop()
        middle, half = (a + b) / 2, (b - a) / 2
        if holds(middle, half):
            begins.append(a)
        elif b - a <= narrow or len(begins) + len(waiting) > most:
            return begins, middle
        else:
            waiting += [(middle, b), (a, middle)]
    return begins, None
