"""The strong-noise expansion of many scenes at once, in float64 and the log domain.

Every quantity is a stack of three: the expansion, and a lower and an upper end
of what the whole series can be. The ends are carried through the same
formulas, each with the ends of its parts that make it smallest or largest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.drift.float_field import Field, IntArray, field_of
from symasym.drift.scenes import Scenes
from symasym.special.exponentials import log_quotient, mean_place

# Rounding of one step of the log domain: lam, a product and an exponential or logarithm.
_UNIT = 1e-15
_SCENES_AT_ONCE = 1024
_NODES = 12
_MOST_PANELS = 256
_SETTLED = 1e-14


class _Piece(NamedTuple):
    """Logarithms, stacked: g = e^{lam (V(a) - V(b))}, near, far/g, nested/near (see exact.md)."""

    g: FloatArray
    near: FloatArray
    far: FloatArray
    ratio: FloatArray


class _Swept(NamedTuple):
    """log sigma and log w, and the rounding of each."""

    sigma: FloatArray
    w: FloatArray
    sigma_error: FloatArray
    w_error: FloatArray


def logs(
    drift: Drift, scenes: Scenes, quantity: str, complement: bool, order: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """log of T, C or P of all scenes, what it leaves out at most, and the size of A."""
    count = len(scenes.lam)
    value, error, size = np.empty(count), np.empty(count), np.empty(count)
    for low in range(0, count, _SCENES_AT_ONCE):
        part = slice(low, min(low + _SCENES_AT_ONCE, count))
        chosen = {n: x[part] if np.ndim(x) else x for n, x in scenes.parameters.items()}
        field = field_of(drift, chosen, part.stop - part.start)
        with np.errstate(all="ignore"):
            numbers = {name: x[part] for name, x in scenes.numbers.items()}
            stack, rounding = _chunk(field, scenes.lam[part], numbers, quantity, complement, order)
            value[part] = stack[0]
            error[part] = np.maximum(stack[2] - stack[0], stack[0] - stack[1]) + rounding
            size[part] = field.size()[: part.stop - part.start]
    return value, error, size


def _chunk(
    field: Field,
    lam: FloatArray,
    numbers: dict[str, FloatArray],
    quantity: str,
    complement: bool,
    order: int,
) -> tuple[FloatArray, FloatArray]:
    scene = np.arange(len(lam))
    if quantity == "P":
        return _occupation(field, scene, lam, complement, order)
    r, start = numbers["r"], numbers["start"]
    left = _swept(field, scene, lam, r, start, order)
    right = _swept(field, scene + len(lam), lam, r, -start, order)
    if quantity == "C":
        wanted, other = (left, right) if complement else (right, left)
        ratio = _flip(other.sigma) - wanted.sigma
        share = -np.logaddexp(0.0, ratio)
        weight = -np.expm1(share[0])
        rounding = weight * (left.sigma_error + right.sigma_error)
        return share, rounding + _UNIT * np.abs(share[0])
    value = np.logaddexp(left.w, right.w) - np.logaddexp(-left.sigma, -right.sigma)
    C = np.exp(-np.logaddexp(0.0, left.sigma[0] - right.sigma[0]))
    rounding = C * left.sigma_error + (1 - C) * right.sigma_error
    rounding += np.maximum(left.w_error, right.w_error)
    return value, rounding + _UNIT * (1 + np.abs(value[0]))


def _flip(stack: FloatArray) -> FloatArray:
    """The stack with its lower and upper ends exchanged."""
    return stack[[0, 2, 1]]


def _swept(
    field: Field, scene: IntArray, lam: FloatArray, r: FloatArray, x: FloatArray, order: int
) -> _Swept:
    """log sigma and log w at `x`, absorbed at -r."""
    a_minus, a_plus = field.a_minus[scene], field.a_plus[scene]
    nothing = np.zeros_like(lam)
    state = _Swept(
        np.full((3, len(lam)), -np.inf), np.full((3, len(lam)), -np.inf), nothing, nothing
    )
    before = np.maximum(0.0, np.minimum(-1.0, x) + r) * (r > 1)
    state = _after(state, _outer(a_minus, lam, before), nothing, lam, before > 0)
    a, b = np.maximum(-1.0, -r), np.minimum(x, 1.0)
    inside = b > a
    if inside.any():
        piece, error = _layer(field, scene, lam, a, np.maximum(a, b), order)
        state = _after(state, piece, error, lam, inside)
    beyond = np.maximum(0.0, x - 1.0)
    return _after(state, _outer(a_plus, lam, beyond), nothing, lam, beyond > 0)


def _after(state: _Swept, piece: _Piece, error: FloatArray, lam: FloatArray, use: Any) -> _Swept:
    """The sweep behind one more stretch; `error` is that of the stretch's logarithms."""
    entering = piece.g + state.sigma
    sigma = np.logaddexp(piece.near, entering)
    # Shares of what comes in and of what is new; each as a logarithm of its own, because the
    # difference of two large ones would have no digits.
    kept = -np.logaddexp(0.0, _flip(piece.near) - entering)
    new = -np.logaddexp(0.0, _flip(entering) - piece.near)
    carried, added = state.w - piece.g, np.log(lam) + piece.far
    first = kept + np.logaddexp(carried, added)
    second = np.log(lam) + piece.ratio + new
    w = np.logaddexp(first, second)
    share = np.where(np.isneginf(kept[0]), 0.0, np.exp(kept[0]))
    growth = np.abs(piece.g[0])
    unit = _UNIT * (4 + np.abs(np.log(lam)))
    size = np.where(np.isfinite(sigma[0]), np.abs(sigma[0]), 0.0)
    of_entering = state.sigma_error + _UNIT * growth
    of_near = error + _UNIT * (1 + np.where(np.isfinite(piece.near[0]), abs(piece.near[0]), 0.0))
    sigma_error = share * of_entering + (1 - share) * of_near + _UNIT * size
    part = np.exp(carried[0] - np.logaddexp(carried[0], added[0]))
    of_first = part * (state.w_error + _UNIT * growth) + (1 - share) * (of_entering + of_near)
    of_second = share * (of_entering + of_near)
    mix = np.exp(first[0] - w[0])
    w_error = mix * of_first + (1 - mix) * of_second + 2 * error + unit
    return _Swept(
        np.where(use, sigma, state.sigma),
        np.where(use, w, state.w),
        np.where(use, np.nan_to_num(sigma_error, nan=np.inf), state.sigma_error),
        np.where(use, np.nan_to_num(w_error, nan=np.inf), state.w_error),
    )


def _outer(a: FloatArray, lam: FloatArray, length: FloatArray) -> _Piece:
    """A stretch of constant drift, in closed form."""
    x = lam * a * length
    size = np.log(length)
    rising, falling = size + log_quotient(x), size + log_quotient(-x)
    stack = [np.tile(part, (3, 1)) for part in (x, rising, falling, size + np.log(mean_place(x)))]
    return _Piece(*stack)


def _layer(
    field: Field,
    scene: IntArray,
    lam: FloatArray,
    a: FloatArray,
    b: FloatArray,
    order: int,
) -> tuple[_Piece, FloatArray]:
    """The layer's stretch [a, b], expanded; and the rounding of its logarithms."""
    found = _moments(field, scene, a, b, order + 1)
    powers = lam ** np.arange(order + 2)[:, None]
    x = lam * found.spread
    rest = np.ones_like(x)
    for k in range(1, order + 3):
        rest = rest * (x / k)
    geometric = 1 / (1 - np.minimum(x / (order + 3), 0.9))
    rest = rest * np.where(x < 0.9 * (order + 3), geometric, np.exp(x))
    length = b - a

    def stack(values: FloatArray, size: FloatArray) -> FloatArray:
        terms = values * powers
        value = terms[:-1].sum(axis=0)
        whole, reach = value + terms[-1], rest * size
        # The integrand is between e^{-x} and e^x in any case.
        low = np.fmax(np.log(whole - reach), np.log(size) - x)
        high = np.fmin(np.log(whole + reach), np.log(size) + x)
        return np.array([np.log(value), low, high])

    near = stack(found.near, length)
    far = stack(found.far, length)
    nested = stack(found.nested, length * length / 2)
    g = np.tile(lam * found.drop, (3, 1))
    # All moments are relative to length * spread^k/k!, and so is their rounding.
    error = (_UNIT * 4 * (order + 4) + found.error) * np.exp(2 * x)
    return _Piece(g, near, far - g, nested - _flip(near)), error


class _Moments(NamedTuple):
    """As `strong_noise.moments.Moments`, one column per scene; `error` is relative."""

    drop: FloatArray
    near: FloatArray
    far: FloatArray
    nested: FloatArray
    spread: FloatArray
    error: FloatArray


def _moments(field: Field, scene: IntArray, a: FloatArray, b: FloatArray, order: int) -> _Moments:
    """On panels halved until the moments settle."""
    panels, before = 8, _on_panels(field, scene, a, b, order, 4)
    while True:
        found = _on_panels(field, scene, a, b, order, panels)
        error = np.zeros_like(a)
        length = np.where(b > a, b - a, 1.0)
        unit = length
        for k in range(order + 1):
            for new, old, size in (
                (found.near, before.near, unit),
                (found.far, before.far, unit),
                (found.nested, before.nested, unit * length / 2),
            ):
                error = np.maximum(error, np.abs(new[k] - old[k]) / size)
            unit = unit * np.where(found.spread > 0, found.spread, 1.0) / (k + 1)
        if not np.isfinite(error).all():
            raise AccuracyError(
                "A is not finite on [-1, 1]; give an A that is real and smooth there."
            )
        if (error < _SETTLED * (order + 1)).all() or panels >= _MOST_PANELS:
            return found._replace(error=error)
        panels, before = 2 * panels, found


def _on_panels(
    field: Field, scene: IntArray, a: FloatArray, b: FloatArray, order: int, panels: int
) -> _Moments:
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    primitive = _primitive_matrix(nodes)
    half = ((b - a) / (2 * panels))[:, None, None]
    t = (np.arange(panels)[:, None] + (nodes + 1) / 2) / panels
    u = a[:, None] + (b - a)[:, None] * t.ravel()
    slope = field.phi(scene, u).reshape(len(a), panels, _NODES)

    def integral(f: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The primitive at the nodes, and at the end."""
        totals = (half * f) @ weights
        behind = np.cumsum(totals, axis=1)
        return (half * f) @ primitive.T + (behind - totals)[:, :, None], behind[:, -1]

    def iterated(f: FloatArray, end: FloatArray) -> tuple[list[FloatArray], list[FloatArray], Any]:
        ends, areas, first = [end], [integral(f)[1]], f
        for k in range(order):
            f, end = integral(slope * f)
            first = f if k == 0 else first
            ends.append(end)
            areas.append(integral(f)[1])
        return ends, areas, first

    ones = np.ones_like(slope)
    near, nested, _ = iterated(a[:, None, None] * 0 + (u - a[:, None]).reshape(slope.shape), b - a)
    falls, far, fallen = iterated(ones, np.ones_like(a))
    fallen = fallen.reshape(len(a), -1)
    top = np.maximum(np.maximum(fallen.max(axis=1), falls[1]), 0.0)
    low = np.minimum(np.minimum(fallen.min(axis=1), falls[1]), 0.0)
    # Between two nodes V rises above both by less than the slope times half their distance.
    reach = np.abs(slope).max(axis=(1, 2)) * (b - a) / panels * 0.07
    return _Moments(
        falls[1],
        np.array(near),
        np.array(far),
        np.array(nested),
        top - low + 2 * reach,
        np.zeros_like(a),
    )


def _primitive_matrix(nodes: FloatArray) -> FloatArray:
    """Integrals from -1 to each node of the polynomial through values at the nodes."""
    count = len(nodes)
    legendre = np.polynomial.legendre
    rows = np.empty((count, count))
    inverse = np.linalg.inv(legendre.legvander(nodes, count - 1))
    for j in range(count):
        rows[:, j] = legendre.legval(nodes, legendre.legint(inverse[:, j], lbnd=-1))
    return rows


def _occupation(
    field: Field, scene: IntArray, lam: FloatArray, complement: bool, order: int
) -> tuple[FloatArray, FloatArray]:
    end = np.ones_like(lam)
    piece, error = _layer(field, scene, lam, -end, end, order)
    inside = piece.far + piece.g
    left, right = -np.log(field.a_minus[scene]), -np.log(-field.a_plus[scene])
    outside = np.logaddexp(left, right + piece.g) - np.log(lam)
    ratio = _flip(inside) - outside if complement else outside - inside
    share = -np.logaddexp(0.0, ratio)
    growth = np.abs(piece.g[0]) + np.abs(np.log(lam)) + np.abs(left) + np.abs(right)
    rounding = -np.expm1(share[0]) * (error + _UNIT * (4 + growth))
    return share, rounding + _UNIT * np.abs(share[0])
