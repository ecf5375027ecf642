"""The one driver of all methods: read the numbers, ask the method, hand back what was asked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.base.errors import RegionError
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    Request,
    digits_back,
    float_scenes,
    floats_back,
    one_scene,
    read_scene,
    require_drift,
)
from symasym.methods.table import METHODS, quantity_of

__all__ = ["answer", "require_drift_of"]


def answer(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The quantity of `request` by its method: a float, an array, an mpf or an `Estimate`.

    One scene is read in exact numbers, arrays and what a method does faster in float64 are read
    as floats.
    """
    method = METHODS[request.method]
    request = method.with_order(request)
    if request.method == "strong_noise":
        return _legacy(drift, numbers, request)
    if request.dps is None and (not one_scene(drift, numbers) or method.in_float(drift, request)):
        scenes = float_scenes(drift, numbers)
        return floats_back(request, scenes.shape, method.home.of_scenes(scenes, request))
    scene = read_scene(drift, numbers, request.dps)
    return digits_back(request, method.home.of_scene(scene, request))


def _legacy(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    quantity = quantity_of(request.name)
    options: dict[str, Any] = {}
    if quantity.verb != "escape_time":
        options["complement"] = quantity.complement
    verb = getattr(METHODS[request.method].home, quantity.verb)
    return verb(drift, **numbers, request=request, **options)


def require_drift_of(name: str, drift: Drift) -> None:
    """Raise unless the drift is bound, and slides where the quantity `name` needs that."""
    require_drift(drift)
    if not quantity_of(name).sliding:
        return
    a_minus, a_plus = drift.ends
    wrong = ~((np.asarray(a_minus, dtype=float) > 0) & (np.asarray(a_plus, dtype=float) < 0))
    if wrong.any():
        first = tuple(np.argwhere(wrong)[0]) if wrong.ndim else ()
        shown = [float(np.asarray(x, dtype=float)[first]) for x in (a_minus, a_plus)]
        raise RegionError(
            f"a- = {shown[0]:.6g} and a+ = {shown[1]:.6g} make no sliding region (a- > 0 > a+), so "
            "there is no stationary density; ask for escape_time instead."
        )
