"""The Laplace transform of the law of the exit time: its poles and residues, and its inversion.

The characteristic function W and the theorems are stated in `symasym.law`.
"""

from __future__ import annotations

import math
from functools import cache, reduce
from typing import Any, NamedTuple

from flint import acb, acb_poly, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.balls import rational
from symasym.base.errors import AccuracyError
from symasym.drift.evaluate import pieces
from symasym.drift.scenes import Scene
from symasym.exact.panels import TaylorModel
from symasym.exact.transform import (
    Matrix,
    Undecided,
    matrices,
    moments,
    swept,
    ways,
)

_SIDES = ("left", "right")
_STEPS = 60  # of Newton's method
_CROWD = 38  # eigenvalues near the first, for which it is too slow
_NODES = 2_000
_TINY = -(10**6)  # a power that stands for s = 0
# Talbot's contour s = (nodes/t) (A theta cot(B theta) - C + i D theta), |theta| < pi.
_A, _B, _C, _D = (fmpq(n, 10_000) for n in (5017, 6407, 6122, 2645))


class TooEarly(ArithmeticError):
    """More eigenvalues are needed at this time."""


class Modes(NamedTuple):
    """The first eigenvalues with their residues by side; of the others, what they contribute to
    Green's function at the start, and a lower bound; the mass of the speed measure."""

    rates: list[arb]
    residues: list[dict[str, arb]]
    green: arb
    mass: arb
    beyond: arb


class ExitTransform:
    """W and W E[e^{-s tau}; side] of a scene, as power series in s and at numbers s.

    There are `order` powers of s, on panels that are short enough for these up to |s| = `size`.
    """

    def __init__(
        self, scene: Scene, reflecting: str | None, order: int, size: float, digits: int
    ) -> None:
        self.digits = digits
        self.modes, self._entries = cache(self._found_modes), cache(self._truncated)
        self.reflecting = [reflecting == side for side in _SIDES]
        lam, start = arb(rational(scene.lam)), rational(scene.start)
        left, right = map(rational, scene.ends)
        drift = pieces(scene.drift, left, right)
        self.panels = [
            matrices(way, lam, begin, end, digits, order, size)
            for way, begin, end in ways(drift, (left, right), start)
        ]
        self.states = [
            swept(side, reflects, order + 1)
            for side, reflects in zip(self.panels, self.reflecting, strict=True)
        ]
        (eta, zeta), (other, of_other) = self.states
        self.w = (eta * of_other + other * zeta).truncate(order)
        self.absorbs = [not x for x in self.reflecting]

    # -- moments -------------------------------------------------------------------------------

    def moments(self, order: int, side: str | None = None) -> list[arb]:
        """E[tau^k; exit on this side]/k!, k up to `order`."""
        sides = [_SIDES.index(side)] if side else [0, 1]
        return moments(self.panels, self.reflecting, order, sides)

    def moment(self, k: int) -> arb:
        """E[tau^k]."""
        return self.moments(k)[k] * arb(k).fac()

    def variance(self, side: str | None = None) -> arb:
        """The variance of tau, or of tau given the side."""
        p, first, half = self.moments(2, side)
        return 2 * half / p - (first / p) ** 2

    def mean(self, side: str | None = None) -> arb:
        """E[tau], or E[tau | side]."""
        p, first = self.moments(1, side)
        return first / p

    # -- at numbers ----------------------------------------------------------------------------

    def at(self, s: Any, length: int = 1, enclosed: bool = True) -> tuple[Any, Any, dict[str, Any]]:
        """At s, eta from both ends, W, and W E[e^{-s tau}; side] by side.

        W is a polynomial of s' - s with `length` coefficients.
        """
        of = acb_poly if isinstance(s, acb) else arb_poly
        # |s| is rounded up to a power of 2^(1/4), for which entries are kept.
        power = math.ceil(4 * float(abs(s).upper().log()) / math.log(2)) if s != 0 else _TINY
        sides = (
            [Matrix._make([*(of([g(s) for g in f]) for f in p), inverse]) for p, inverse in side]
            for side in self._entries(power, length)
        )
        (eta, zeta), (other, of_other) = (
            swept(side, reflects, length, of, enclosed)
            for side, reflects in zip(sides, self.reflecting, strict=True)
        )
        w = (eta * of_other + other * zeta).truncate(length)
        exits = {"left": other[0] * self.absorbs[0], "right": eta[0] * self.absorbs[1]}
        return (eta[0], other[0]), w, exits

    def _truncated(self, power: int, length: int) -> Any:
        """The panels' entries for |s| <= 2^(power/4), with derivatives where `length` is 2."""
        size = arb(2) ** (arb(power) / 4)

        def entry(f: arb_poly) -> list[TaylorModel]:
            return [truncated(g, size, self.digits) for g in (f, f.derivative())[:length]]

        return [[([entry(f) for f in p[:4]], p.inverse) for p in side] for side in self.panels]

    def transform(self, s: Any, side: str | None = None, enclosed: bool = True) -> Any:
        """E[e^{-s tau}; side]."""
        _, w, exits = self.at(s, 1, enclosed)
        return (exits[side] if side else exits["left"] + exits["right"]) / w[0]

    # -- rates ---------------------------------------------------------------------------------

    def rates(self, count: int) -> tuple[list[arb], arb_poly]:
        """The first eigenvalues, and W divided by their factors 1 + s/lambda_k."""
        w, found = self.w, list[arb]()
        while len(found) < count:
            found.append(self._rate(_beyond(w, found), found))
            w = _divided(w, found[-1])
        return found, w

    def most(self) -> arb:
        """S_3/S_4, an upper bound of the principal eigenvalue (Euler, Rayleigh)."""
        first, second = _power_sums(self.w, 4)[-2:]
        many = first**4 / second**3  # m for m equal eigenvalues
        if many > _CROWD:
            raise AccuracyError(
                f"some {float(many):.0f} eigenvalues are so close to the first, as the law is "
                "narrow, that they are not told apart; take the variance, or a larger kappa."
            )
        return first / second

    def least(self) -> arb:
        """S_8^(-1/8), a lower bound of the principal eigenvalue (Euler, Rayleigh)."""
        return _beyond(self.w, [])

    def _rate(self, x: arb, before: list[arb]) -> arb:
        """The next zero of W(-x) above x, the zeros before it being divided out.

        As all zeros are real, Newton's iterates from below do not pass it: each is a lower bound. A
        change of sign gives the upper one.
        """
        near = arb(10) ** (2 - self.digits)
        for _ in range(_STEPS):
            w = self.at(-x, 2)[1]
            step = 1 / (w[1] / w[0] - sum((1 / (y - x) for y in before), arb(0)))
            following = (x + step).lower()
            if not (step.is_finite() and following >= x):
                break
            x = following
            if step < x * near.sqrt() / 100:
                high = x * (1 + near)
                value = self.at(-high)[1][0]
                if (value < 0) if len(before) % 2 == 0 else (value > 0):
                    return x.union(high)
        raise Undecided("there is no change of sign")

    def _found_modes(self, count: int) -> Modes:
        rates, w = self.rates(count)
        (one, _), (another, _) = self.states
        green, residues = one[0] * another[0] / self.w[0], list[dict[str, Any]]()
        for x in rates:
            (eta, other), slope, exits = self.at(-x, 2)
            residues.append({side: n / slope[1] for side, n in exits.items()})
            green -= eta * other / slope[1] / x
        mass = sum(map(_mass, self.panels), arb(0))
        return Modes(rates, residues, green, mass, _beyond(w, rates))

    # -- times ---------------------------------------------------------------------------------

    def late(self, t: fmpq, name: str, count: int) -> arb:
        """P(tau > t), P(tau <= t) or the density from the first modes, the others bounded."""
        density, modes = name == "pdf", self.modes(count)
        if not modes.beyond * t > 1.5:
            raise TooEarly
        total = arb(0)
        for x, c in zip(modes.rates, modes.residues, strict=True):
            total += (c["left"] + c["right"]) * (-x * t).exp() * (1 if density else 1 / x)
        size = modes.beyond ** (3 if density else 1) * abs(modes.green) * modes.mass
        rest = (size.upper().sqrt() * (-modes.beyond * t).exp()).upper()
        if not rest < abs(total) / arb(10) ** self.digits:
            raise TooEarly
        total += arb(0, rest)
        return 1 - total if name == "cdf" else total

    def talbot(self, t: fmpq, density: bool, nodes: int) -> arb:
        """P(tau <= t) or the density by Talbot's contour; rounding is not enclosed."""
        total = arb(0)
        for k in range(nodes // 2):
            theta = arb.pi() * (2 * k + 1) / nodes
            cot = (theta * _B).cot()
            s = acb(theta * cot * _A - _C, theta * _D) * (nodes / t)
            slope = acb(_A * (cot - theta * _B * (1 + cot * cot)), arb(_D)) * (nodes / t)
            value = self.transform(s, enclosed=False) / (1 if density else s)
            total += ((s * t).exp() * value * slope).imag
        return total * 2 / nodes

    def bromwich(self, t: fmpq, density: bool, c: float, most: arb, other: arb) -> arb:
        """P(tau <= t), for negative c -P(tau > t), or the density, by the trapezoidal rule on
        Re s = c (Abate & Whitt, Queueing Systems 10 (1992) 5); rounding is not enclosed.

        With the step 2 pi/L the sum contains the values at all t + k L, multiplied by e^{-k c L}:
        by Markov's inequality they are together below `other`/(e^{|c| L} - 1), where `other` is
        1 + e^{2 c t} E[e^{-2 c tau}]; `most` is e^{c t} E[e^{-c tau}]. The sum ends after three
        terms in a row that do not change the digits.
        """
        digit, total, small, k = arb(10) ** -self.digits, arb(0), 0, 0
        way = (other / most / digit).log().mid()  # |c| L
        step = (2 * arb.pi() * abs(c) / way).mid()
        while small < 3:
            s = acb(c, step * k)
            if k > _NODES:
                raise AccuracyError(
                    f"t is {float(t):.6g}, for which a contour takes more than {_NODES:,} nodes; "
                    "take fewer digits, or another t."
                )
            value = (s * t).exp() * self.transform(s, enclosed=False) / (1 if density else s)
            total += value.real / (1 if k else 2)
            small, k = (small + 1 if abs(value) < most * digit / abs(c) else 0), k + 1
        rest = other / (way.exp() - 1) * (abs(c) if density else 1) + most * digit * k
        return total * step / arb.pi() + arb(0, rest.upper())


def _mass(found: list[Matrix]) -> arb:
    """The mass of the speed measure on these panels, divided by 1/e at their end."""
    return reduce(lambda mass, p: (mass + p.z1[1]) / p.inverse, found, arb(0))


def truncated(f: arb_poly, size: arb, digits: int) -> TaylorModel:
    """For |s| <= `size`, a panel's entry or its derivative from its first coefficients;
    by Newton's inequality a geometric series bounds the other terms."""
    k = f.degree()
    while k > 1 and f[k].rel_accuracy_bits() < 8:
        k -= 1  # a coefficient of unknown size bounds nothing
    if k < 1:
        return TaylorModel(f, arb(0))
    f, ratio = f.truncate(k + 1), abs(f[k] / f[k - 1]) * size
    rest = f[k] * size**k * ratio / (1 - ratio)
    if not (ratio < 0.5 and rest <= f(size) / arb(10) ** digits):
        raise Undecided(f"{k} powers of s do not reach {size}")
    return TaylorModel(f, rest.upper())


def _beyond(f: arb_poly, found: list[arb]) -> arb:
    """S_m^(-1/m), a lower bound of the z_k of prod (1 + s/z_k) (Euler, Rayleigh), if it separates
    them from the eigenvalues found before."""
    m = min(8, f.degree() - 1)
    below = (_power_sums(f, m)[-1] ** (arb(-1) / m)).lower() if m > 0 else arb(0)
    if found and not below > found[-1]:
        raise Undecided("the rates are not told apart")
    return below


def _power_sums(f: arb_poly, many: int) -> list[arb]:
    """S_n = sum z_k^-n for n = 1 to `many`, from the logarithmic derivative of f."""
    ctx.cap = many + 1
    series = arb_series(list(f), many + 1)
    return [abs(c) for c in list(series.derivative() / series)[:many]]


def _divided(f: arb_poly, zero: arb) -> arb_poly:
    """f/(1 + s/zero) by backward recurrence; the top coefficient is enclosed by [0, f_n] to cover
    the truncation of f."""
    last = f[f.degree()]
    out = [arb(last / 2, (last / 2).upper())]
    for k in range(f.degree(), 0, -1):
        out.append(zero * (f[k] - out[-1]))
    while out and out[0].rel_accuracy_bits() < 8:
        del out[0]
    return arb_poly(out[::-1])
