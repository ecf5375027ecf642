"""The exit probability's methods other than the exact integral."""

from __future__ import annotations

from typing import Any

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.drift.scenes import Request


def probability(
    drift: Drift, kappa: Any, r: Any, start: Any, complement: bool, request: Request
) -> Any:
    """C or 1 - C by the method of `request`."""
    if request.method in ("bound", "paper") and request.order is not None:
        raise InputError(
            f"order is {request.order!r}, but method {request.method!r} has no order; leave it out."
        )
    if request.method == "strong_noise":
        from symasym.asymptotics.strong_noise import answer as strong_noise

        return strong_noise.exit_probability(drift, kappa, r, start, complement, request)
    if request.method == "laplace":
        from symasym.asymptotics.weak_noise import answer as weak_noise

        return weak_noise.exit_probability(drift, kappa, r, start, complement, request)
    from symasym.asymptotics.proofs import exit_bounds

    find = exit_bounds.paper_bound if request.method == "paper" else exit_bounds.exit_probability
    return find(drift, kappa, r, start, complement, request)
