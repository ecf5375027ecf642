"""Proved bounds of C and 1 - C: the enclosure of the exact value in balls.

The paper's own bound, as derived, is method "paper" (`symasym.paper`).
"""

from __future__ import annotations

import numpy as np

from symasym.exact import balls
from symasym.scenes import Answer, Answers, Request, Scene, Scenes, scene_at

_DIGITS = 20


def of_scene(scene: Scene, request: Request) -> Answer:
    """The middle of the enclosure, its radius the error."""
    return balls.of_scene(scene, request)


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same for many, scene by scene."""
    logs = np.empty(len(scenes.lam))
    asked = request._replace(dps=_DIGITS, log=True)
    for row in range(len(logs)):
        logs[row] = float(balls.of_scene(scene_at(scenes, row), asked).value)
    return Answers(logs, 1e-15 * np.abs(logs) + 1e-18, "bound", (request.name,))
