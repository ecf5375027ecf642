"""Proved bounds of C and 1 - C: the enclosure of the exact value in balls.

The paper's own bound, as derived, is method "paper" (`symasym.paper`).
"""

from __future__ import annotations

from symasym.exact import balls
from symasym.scenes import Answer, Request, Scene


def of_scene(scene: Scene, request: Request) -> Answer:
    """The middle of the enclosure, its radius the error."""
    return balls.of_scene(scene, request)
