"""Which order of an expansion is taken, and whether its error is proved or estimated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from symasym.asymptotics.weak_noise.compose import Found
from symasym.base.estimate import ErrorKind


def chosen(
    found: list[Found],
    prove: Callable[[int], Any] | None,
    full: bool,
    context: Any,
) -> tuple[Found, ErrorKind] | None:
    """The best order, its error proved where that is asked for or where no estimate is sure.

    None where neither is known. `prove` gives bounds in balls, or None, for an order.
    """
    sure = [f for f in found if f.sure]
    best = [min(sure, key=lambda f: f.error)] if sure else []
    bounds = None
    if prove is not None and (full or not sure):
        bounds = prove((best or found)[-1].order)
    if bounds is not None:
        proved = [f._replace(error=_distance(bounds, f.value, context)) for f in best or found]
        # What is refused unless it is proved has to be as good as what is not; where the bounds
        # are far apart, as without a well, a good estimate says more.
        most = max(best[0].value / 100, min(best[0].value, 100 * best[0].error)) if sure else None
        proved = [f for f in proved if f.error < (f.value / 2 if most is None else most)]
        if proved:
            return min(proved, key=lambda f: f.error), "bound"
    return (best[0], "estimate") if sure else None


def of_log(relative: Any, kind: ErrorKind, context: Any) -> Any:
    """The error of a logarithm from the relative one of the value, below 1."""
    if kind == "bound":
        return -context.log1p(-relative) * (1 + context.mpf(10) ** (8 - context.dps))
    return relative / (1 - relative / 2)


def _distance(bounds: Any, value: Any, context: Any) -> Any:
    """The farther of two proved bounds from the value."""
    low, high = (
        context.mpf(int(mantissa)) * context.mpf(2) ** int(exponent)
        for mantissa, exponent in (x.man_exp() for x in (bounds.low, bounds.high))
    )
    size = max(abs(high - value), abs(low - value))
    # The roundings here.
    return size + (abs(value) + size) * context.mpf(10) ** (8 - context.dps)
