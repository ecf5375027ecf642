"""The law of one exit as power series in s, its rates and residues, and Talbot's contour.

What is proved here and how: see `symasym.law`, which asks this for balls.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

from flint import acb, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.errors import AccuracyError
from symasym.drift.evaluate import pieces
from symasym.drift.formula import rational
from symasym.drift.scenes import Scene
from symasym.exact.transform import (
    STARTS,
    Undecided,
    carried,
    matrices,
    moments,
    swept_at,
    ways,
)

_SIDES = ("left", "right")
_STEPS = 60  # of Newton's method
_NODES = 2_000
# Talbot's contour: s = (nodes/t) (a theta cot(b theta) - c + i d theta).
_A, _B, _C, _D = (fmpq(n, 10_000) for n in (5017, 6407, 6122, 2645))


class TooEarly(ArithmeticError):
    """More rates are needed."""


class TooFar(ArithmeticError):
    """Panels for larger numbers are needed."""


class Modes(NamedTuple):
    """The first rates with their residues by side, and what is left of G, M and the next rate."""

    rates: list[arb]
    residues: list[dict[str, arb]]
    green: arb
    mass: arb
    beyond: arb


class Series:
    """W and N = W E[e^{-s tau}] by side of a scene, to a power of s and at numbers.

    Parameters
    ----------
    scene : Scene
    reflecting : {"left", "right"} or None
    order : int
        Powers of s.
    size : float
        |s| up to which panels are short enough for so many powers.
    digits : int
    """

    def __init__(
        self, scene: Scene, reflecting: str | None, order: int, size: float, digits: int
    ) -> None:
        self.digits, self.size = digits, size
        self.reflecting = [reflecting == side for side in _SIDES]
        lam, start = arb(rational(scene.lam)), rational(scene.start)
        left, right = map(rational, scene.ends)
        drift = pieces(scene.drift, left, right)
        self.panels = [
            matrices(way, lam, begin, end, digits, order, size)
            for way, begin, end in ways(drift, (left, right), start)
        ]
        self.states = []
        for state, side in zip((STARTS[x] for x in self.reflecting), self.panels, strict=True):
            for p in side:
                state = carried(state, p, order)
            self.states.append(state)
        one, other = self.states
        self.w = (one.eta * other.zeta + other.eta * one.zeta).truncate(order)
        self.absorbs = [not x for x in self.reflecting]

    # -- moments -------------------------------------------------------------------------------

    def moments(self, order: int, side: str | None = None) -> list[arb]:
        """E[tau^k; side]/k!, k up to `order`."""
        sides = [_SIDES.index(side)] if side else [0, 1]
        return moments(self.panels, self.reflecting, order, sides)

    def moment(self, k: int) -> arb:
        """E[tau^k]."""
        return self.moments(k)[k] * arb(k).fac()

    def variance(self, side: str | None = None) -> arb:
        """That of tau, or of tau given the side."""
        p, first, half = self.moments(2, side)
        return 2 * half / p - (first / p) ** 2

    def given(self, side: str) -> arb:
        """E[tau | side]."""
        p, first = self.moments(1, side)
        return first / p

    # -- at numbers ----------------------------------------------------------------------------

    def at(self, s: Any, length: int = 1, enclosed: bool = True) -> tuple[Any, Any, dict[str, Any]]:
        """eta from both ends, W and N by side at s, each with its derivative if `length` is 2."""
        sides = zip(self.panels, self.reflecting, strict=True)
        (eta, zeta), (other, of_other) = (
            swept_at(side, s, reflects, self.digits, length, enclosed) for side, reflects in sides
        )
        w = (eta * of_other + other * zeta).truncate(length)
        exits = {"left": other[0] * self.absorbs[0], "right": eta[0] * self.absorbs[1]}
        return (eta[0], other[0]), w, exits

    def transform(self, s: Any, side: str | None = None, enclosed: bool = True) -> Any:
        """E[e^{-s tau}; side]."""
        _, w, exits = self.at(s, 1, enclosed)
        return (exits[side] if side else exits["left"] + exits["right"]) / w[0]

    # -- rates ---------------------------------------------------------------------------------

    def rates(self, count: int) -> tuple[list[arb], arb_poly]:
        """The first eigenvalues, and what W/W(0) is divided by their factors."""
        w, found = self.w, list[arb]()
        while len(found) < count:
            found.append(self._rate(_beyond(w, found), found))
            w = _divided(w, found[-1])
        return found, w

    def most(self) -> arb:
        """S_8/S_9, above lambda_1."""
        first, second = _power_sums(self.w, 9)[-2:]
        return first / second

    def least(self) -> arb:
        """Below lambda_1."""
        return _beyond(self.w, [])

    def _rate(self, x: arb, before: list[arb]) -> arb:
        """The zero of W(-x) that comes next, by Newton's steps from below."""
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

    @cached_property
    def known(self) -> dict[int, Modes]:
        """The first modes by their number."""
        return {}

    def modes(self, count: int) -> Modes:
        """So many of them."""
        if count not in self.known:
            rates, w = self.rates(count)
            beyond = _beyond(w, rates)
            one, another = self.states
            green = one.eta[0] * another.eta[0] / self.w[0]
            residues = []
            for x in rates:
                (eta, other), w, exits = self.at(-x, 2)
                residues.append({side: n / w[1] for side, n in exits.items()})
                green -= eta * other / w[1] / x
            self.known[count] = Modes(rates, residues, green, one.mass + another.mass, beyond)
        return self.known[count]

    # -- times ---------------------------------------------------------------------------------

    def late(self, t: fmpq, name: str, count: int) -> arb:
        """P(tau > t), P(tau <= t) or the density from the first modes, and a bound of the rest."""
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

        With step 2 pi/L it has the values at all t + k L, too, e^{-k c L} times: by Markov's
        inequality below `other` = 1 + e^{2 c t} E[e^{-2 c tau}] over e^{|c| L} - 1 together.
        `most` is e^{c t} E[e^{-c tau}]. The sum ends with three terms that are none of the digits.
        """
        digit, total, small, k = arb(10) ** -self.digits, arb(0), 0, 0
        way = (other / most / digit).log().mid()  # |c| L
        step = (2 * arb.pi() * abs(c) / way).mid()
        while small < 3:
            s = acb(c, step * k)
            if abs(complex(s)) > self.size:
                raise TooFar
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


def _beyond(f: arb_poly, found: list[arb]) -> arb:
    """S_m^(-1/m), below the first z_k of prod (1 + s/z_k), which come after those found."""
    m = min(8, f.degree() - 1)
    below = (_power_sums(f, m)[-1] ** (arb(-1) / m)).lower() if m > 0 else arb(0)
    if found and not below > found[-1]:
        raise Undecided("the rates are not told apart")
    return below


def _power_sums(f: arb_poly, many: int) -> list[arb]:
    """S_1 to S_many."""
    ctx.cap = many + 1
    series = arb_series(list(f), many + 1)
    return [abs(c) for c in list(series.derivative() / series)[:many]]


def _divided(f: arb_poly, zero: arb) -> arb_poly:
    """f/(1 + s/zero), from the last coefficient, of which half the error of f's cut is all."""
    last = f[f.degree()]
    out = [arb(last / 2, (last / 2).upper())]
    for k in range(f.degree(), 0, -1):
        out.append(zero * (f[k] - out[-1]))
    while out and out[0].rel_accuracy_bits() < 8:
        del out[0]
    return arb_poly(out[::-1])
