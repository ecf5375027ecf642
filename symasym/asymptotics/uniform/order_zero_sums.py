"""The parts of one drift (`symasym.asymptotics.uniform.order_zero`) added up at one lam, with
their errors.

As `symasym.asymptotics.uniform.local_arrays`, in an mpmath context.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from symasym.asymptotics.weak_noise.compose import Side
from symasym.asymptotics.weak_noise.series import Value as Pair
from symasym.special.airy_digits import airy_products, dawson

__all__ = ["Edge", "Fold", "Place", "View", "side_at", "tail"]

# As in `symasym.asymptotics.weak_noise.compose`.
_MOST_FALL = 0.75


class Place(NamedTuple):
    """A well, barrier or kink: e^{±lam height} times weight lam^-power, and its next terms."""

    kind: str
    height: Any
    weight: Any
    near: float
    far: float


class Fold(NamedTuple):
    """A pair: u' = a + b s, the next such pair's size, and the mean of V over both."""

    height: Any
    zeta: Any
    a: Any
    b: Any
    next_a: float
    next_b: float
    onward: bool


class Edge(NamedTuple):
    """A barrier before the end (`local_arrays.Edge`), with V at the end."""

    height: Any
    t: Any
    peak: Any
    rest: Any
    next_peak: float
    next_rest: float


class View(NamedTuple):
    """One side of the start.

    Attributes
    ----------
    start : (mpf, float, float)
        1/phi there, and the sizes of h_2 and h_3.
    places : list of Place or Fold
        From the start on.
    outer : (mpf, float)
        The integral of 1/phi on its path, and the size of order 1.
    end : Place or Edge or None
        None where the start is beyond it.
    height, slope : mpf
        V and phi where the straight part begins, which is `length` long; 0 if there is none.
    """

    start: tuple[Any, float, float]
    places: list[Any]
    outer: tuple[Any, float]
    end: Any
    height: Any
    slope: Any
    length: Any


def tail(near: Any, far: Any) -> Any:
    """What two terms say of a series (`place_sums`)."""
    fall = min(far / near, _MOST_FALL) if near else _MOST_FALL
    return (near + far) / (1 - fall)


def side_at(side: View, lam: Any, c: Any) -> Side:
    x = 1 / lam
    none = Pair(c.zero, c.zero)
    first, near, far = side.start
    start = Pair(first * x, tail(near * x * x, far * x**3))
    below = scale = none
    nested = Pair(side.outer[0] * x, side.outer[1] * x * x)
    for place in side.places:
        if isinstance(place, Fold):
            up, down, both = _airy(place, lam, c)
            nested = nested + below * up + both
        elif place.kind == "kink":
            up, down = _kink(place, x, lam, c)
            onward = place.weight * x * c.exp(lam * place.height)
            nested = nested + below * up + down * Pair(onward, c.zero)
        else:
            up, down = _gauss(place, x, lam, c), none
            if place.kind == "well":
                up, down = none, up
            else:
                nested = nested + below * up
        scale, below = scale + up, below + down
    factor = c.exp(lam * side.height)
    if isinstance(side.end, Edge):
        shelf, beyond = _shelf(side, lam, c)
        up, down, both = _cut(side.end, shelf, lam, c)
        up, down = _scaled(up, factor), _scaled(down, 1 / factor)
        nested = nested + below * up + both + down * Pair(shelf * factor, c.zero)
    else:
        # What is beyond the end goes on from its series, formally.
        onward = x / side.slope if side.length else c.zero
        beyond = onward * side.length
        value = -factor / (lam * side.slope) * c.exp(-lam * side.slope * side.length)
        up = Pair(value, c.zero)
        if side.end is not None:
            kink, down = _kink(side.end, x, lam, c)
            nested = nested + below * kink + down * Pair(onward * factor, c.zero)
            scale = scale + kink
            # Where r is the end itself, nothing is to the right of it.
            below = below + down if side.length else below
        nested = nested + below * up
    nested = Pair(nested.value + beyond, nested.error)
    return Side(scale + up, nested, start, none)


def _scaled(pair: Pair, factor: Any) -> Pair:
    return Pair(pair.value * factor, pair.error * factor)


def _gauss(place: Place, x: Any, lam: Any, c: Any) -> Pair:
    sign = 1 if place.kind == "barrier" else -1
    value = place.weight * c.sqrt(x) * c.exp(sign * lam * place.height)
    return Pair(value, value * tail(place.near * x, place.far * x * x))


def _kink(place: Place, x: Any, lam: Any, c: Any) -> tuple[Pair, Pair]:
    """Nothing to order 0, since phi doesn't jump."""
    error, height = tail(place.near * x * x, place.far * x**3), c.exp(lam * place.height)
    return Pair(c.zero, error * height), Pair(c.zero, error / height)


def _airy(f: Fold, lam: Any, c: Any) -> tuple[Pair, Pair, Pair]:
    """Both integrals over the pair, and the double one."""
    third = c.cbrt(lam)
    small, x = 1 / third, 1 / lam
    z = third * third * f.zeta
    found, height = airy_products(z, c), c.exp(lam * f.height)
    bi, slope = found.bi * (c.pi * small), found.bi_slope * (c.pi * small * small)
    up, down = f.a * bi + f.b * slope, f.a * bi - f.b * slope
    next_a, next_b = f.next_a * x, f.next_b * x
    wrong = next_a * abs(bi) + next_b * abs(slope)
    if z < 0:
        # Off the real line a pair leaves both to the start and the ends, but those have it in no
        # order of their series.
        size = abs(f.a) * c.sqrt(found.squares) + abs(f.b) * small * c.sqrt(found.slopes)
        wrong += c.pi * small * size * -c.expm1(z)
    unit, both = (c.pi * small) ** 2, Pair(c.zero, c.zero)
    if f.onward:
        slopes = found.slopes * small * small
        # Order 1 has the cross term alone, which may vanish; its parts do not.
        missed = 2 * (abs(f.a) * next_b + next_a * abs(f.b)) * abs(found.cross) * small
        missed += next_a**2 * found.squares + next_b**2 * slopes
        both = Pair(unit * (f.a * f.a * found.squares - f.b * f.b * slopes), unit * missed)
    return Pair(up * height, wrong * height), Pair(down / height, wrong / height), both


def _cut(e: Edge, shelf: Any, lam: Any, c: Any) -> tuple[Pair, Pair, Pair]:
    """See `local_double`: at the end of the layer, in units of e^{±lam height}."""
    x = 1 / lam
    root = c.sqrt(lam)
    near = dawson(e.t * root * c.sqrt(0.5), c)
    tail = e.peak * near.shade * c.sqrt(c.pi / 2) / root
    slow = e.peak * near.value * c.sqrt(2) / root
    rest = e.rest * x
    # int F less its own logarithm, which the outer part has.
    area = near.area - (c.euler + c.log(2 * lam)) / 2 - c.log(e.t)
    wrong, miss = e.next_peak * x, e.next_rest * x * x
    error = rest * rest / 2 + slow * (wrong * abs(rest) + miss)
    return (
        Pair(shelf - tail - rest, tail * wrong + miss),
        Pair(slow + rest, slow * wrong + miss),
        Pair(e.peak**2 * area * x - slow * rest, error),
    )


def _shelf(side: View, lam: Any, c: Any) -> tuple[Any, Any]:
    """int_1^r e^{-lam slope (u - 1)} du, and the double integral beyond the end."""
    if not side.length:
        return c.zero, c.zero
    y = lam * side.slope * side.length
    first = -c.expm1(-y)
    if abs(y) > 1e-3:
        second = y - first
    else:
        term, second, k = y * y / 2, c.zero, 2
        while abs(term) > abs(y * y) * c.eps:
            second += term
            k += 1
            term *= -y / k
    return side.length * first / y, side.length**2 * second / (y * y)
