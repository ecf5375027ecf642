"""Laplace's method for weak noise, its error proved where that can be had.

The expansion is `symasym.asymptotics.weak_noise.answer`'s, the bounds of what it leaves out are
`symasym.asymptotics.proofs.enclosures`', of T and of 1 - P.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from symasym.asymptotics.weak_noise import answer as weak_noise
from symasym.asymptotics.weak_noise.answer import of_scenes
from symasym.scenes import Answer, Request, Scene

if TYPE_CHECKING:
    from symasym.asymptotics.weak_noise.answer import Prove

__all__ = ["of_scene", "of_scenes"]


def of_scene(scene: Scene, request: Request) -> Answer:
    """The expansion of one scene; of kind ``"bound"`` where its error is proved."""
    return weak_noise.of_scene(scene, request, prover(scene, request))


def prover(scene: Scene, request: Request) -> Prove | None:
    """The proof of bounds at an order; None for C, which has none."""
    return None if request.name[-1] == "C" else partial(_bounds, scene, request)


def _bounds(scene: Scene, request: Request, order: int) -> Any:
    """The enclosure of T or 1 - P with the series to `order`; None without python-flint."""
    from symasym.numbers import balls

    if not balls.available():
        return None
    from symasym.asymptotics.proofs.enclosures import enclosure, enclosure_outside

    drift, kappa, digits = scene.drift, scene.numbers["kappa"], request.digits
    if request.name == "T":
        return enclosure(drift, kappa, scene.r, scene.start, order, digits)
    return enclosure_outside(drift, kappa, order, digits)
