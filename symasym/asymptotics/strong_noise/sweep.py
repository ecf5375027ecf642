"""T, C and P for strong noise from the two sides of the start, in any arithmetic.

A sweep begins at the absorbing end -r and carries, behind each stretch [a, b],

    S = int_{-r}^b e^{lam (V(w) - V(b))} dw,
    W = lam/S int_{-r}^b e^{lam (V(w) - V(u))} dw du over w < u < b, in units of e^{lam V(b)};

the other side is swept in the coordinate -u. With both at the start (eq:Ttilde and eq:C),

    T = (W_L + W_R)/(1/S_L + 1/S_R),    C = S_R/(S_L + S_R).

All is sums, products and quotients of positive numbers: of `arb` for one scene, of
`arrays.LogBounds` for arrays.

In the layer e^{lam V} is a power series in lam with the moments of V as coefficients (`moments`);
with x = lam (max V - min V) an integral over a length l is short of its first N + 2 terms by less
than l x^{N+2}/(N+2)! e^x (Taylor's theorem with Lagrange's remainder).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from symasym.asymptotics.strong_noise.moments import Moments
from symasym.numbers.arithmetic import Number


class Stretch(NamedTuple):
    """Integrals over a stretch [a, b] in units of e^{+-lam V(b)}.

    g = e^{lam (V(a) - V(b))}; int_e = int e^{lam (V - V(b))}; int_inverse = int e^{lam (V(b) - V)};
    nested = the double integral of e^{lam (V(w) - V(u))} over w < u, divided by int_e.
    """

    g: Any
    int_e: Any
    int_inverse: Any
    nested: Any


class Side(NamedTuple):
    """S and W at the point reached (module docstring)."""

    scale: Any
    work: Any


class Arithmetic(Protocol):
    """What an expansion in lam needs beyond sums and products."""

    def tail(self, x: Number, count: int) -> Any:
        """A bound of |e^y - its first `count` terms| for all |y| <= x."""

    def exponential(self, x: Number) -> Any:
        """e^x, enclosed."""

    def truncated(self, terms: list[Any], tail: Number, size: Number, x: Number) -> Any:
        """The sum of all terms but the last, or an enclosure of the whole series.

        What the terms leave out is at most tail * size; the whole is between size * e^{-x} and
        size * e^x.
        """


def after(side: Side | None, stretch: Stretch, lam: Number) -> Side:
    """The sweep behind one more stretch; `side` is None at the absorbing end."""
    own = lam * stretch.nested
    if side is None:
        return Side(stretch.int_e, own)
    entering = stretch.g * side.scale
    # Shares of what comes in and of what is new, each from one quotient: they are never a
    # difference, and in interval arithmetic each part enters once.
    carried = side.work / stretch.g + lam * stretch.int_inverse
    work = carried / (1 + stretch.int_e / entering) + own / (1 + entering / stretch.int_e)
    return Side(stretch.int_e + entering, work)


def escape_time(left: Side, right: Side) -> Any:
    """T from both sides of the start."""
    return (left.work + right.work) / (1 / left.scale + 1 / right.scale)


def odds(left: Number, right: Number, complement: bool) -> Any:
    """(1 - C)/C from S on both sides, (1 - P)/P from `weights`; the inverse of the complement."""
    return right / left if complement else left / right


def layer(integrals: Moments, lam: Number, order: int, number: Arithmetic) -> Stretch:
    """The integrals over a stretch of the layer to the power `order` of lam."""
    powers = [lam * 0 + 1]
    for _ in range(order + 1):
        powers.append(powers[-1] * lam)
    x = lam * integrals.spread
    tail = number.tail(x, order + 2)

    def total(moments: Sequence[Number], size: Number) -> Any:
        """One list of moments added up to the power `order` of lam."""
        terms = [m * p for m, p in zip(moments, powers, strict=False)]
        return number.truncated(terms, tail, size, x)

    int_e, length = total(integrals.int_e, integrals.length), integrals.length
    g = number.exponential(lam * integrals.drop)
    return Stretch(
        g,
        int_e,
        total(integrals.int_inverse, length) / g,
        total(integrals.nested, length * length / 2) / int_e,
    )


def weights(slopes: tuple[Any, Any], stretch: Stretch, lam: Number) -> tuple[Any, Any]:
    """int e^{-lam V} over |u| > 1 and over the layer `stretch`; `slopes` are a- and -a+."""
    return (1 / slopes[0] + stretch.g / slopes[1]) / lam, stretch.int_inverse * stretch.g
