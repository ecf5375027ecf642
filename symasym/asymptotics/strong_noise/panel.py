"""One panel of a sweep in any arithmetic: sigma and w across it (derivation `panel-step`)."""

from __future__ import annotations

from typing import Any, NamedTuple

from flint import arb

from symasym.generated import formulas
from symasym.special.exponentials import ball_quotient


class Record(NamedTuple):
    """A panel's numbers: e(b) = fall/climb, climb int e, fall int 1/e and fall int int e(w)/e(x)
    over w < x."""

    int_e: Any
    int_inverse: Any
    nested: Any
    fall: Any
    climb: Any


class Swept(NamedTuple):
    """sigma = S/s and w = lam Q/sigma at the point reached."""

    sigma: Any
    w: Any


class InLayer(NamedTuple):
    """Stationary time inside the layer and left of it, as w at the point reached."""

    inside: Any
    before: Any


def first(p: Record, lam: Any) -> Swept:
    """sigma and w after a panel that begins at an absorbing end."""
    return Swept(*formulas.absorbed(lam, p.int_e, p.nested, p.fall))


def carried(before: Swept, p: Record, lam: Any) -> Swept:
    """sigma and w after a panel."""
    return Swept(
        *formulas.carried(
            lam, before.w, p.int_e, p.int_inverse, p.nested, p.fall, p.climb, before.sigma
        )
    )


def carried_in_layer(before: InLayer, p: Record, lam: Any) -> InLayer:
    """Time inside the layer and before it, after a panel: beside an infinite sigma two integrals
    are 0."""
    inside = formulas.carried(lam, before.inside, 0, p.int_inverse, 0, p.fall, p.climb, 1)[1]
    return InLayer(inside, p.fall * before.before / p.climb)


def escape_time(left: Swept, right: Swept) -> Any:
    """T from both sides of the start (eq:Ttilde)."""
    return formulas.escape_time_of_sides(left.w + right.w, left.sigma, right.sigma)


def layer_times(layer: InLayer, tail_right: Any, complement: bool) -> tuple[Any, Any]:
    """Stationary times inside the layer and outside it, or those outside and inside (eq:P)."""
    outside = layer.before + tail_right
    return (outside, layer.inside) if complement else (layer.inside, outside)


def straight(rate: arb, width: arb) -> Record:
    """A stretch of constant drift, `rate` being lam phi, by phi_1 and phi_2."""
    x = rate * width
    fall = (-x).exp()
    int_inverse, nested = (width**k * ball_quotient(x, k) for k in (1, 2))
    return Record(width * ball_quotient(-x, 1), fall * int_inverse, fall * nested, fall, 1)
