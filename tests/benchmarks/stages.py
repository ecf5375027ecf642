"""Where a float64 call spends its time: its exponentials, and each function's own share."""

from __future__ import annotations

import cProfile
import pstats
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import symasym

_PACKAGE = str(Path(symasym.__file__).parent)

_SWEEPS = "sweeps in the log domain, with their error analysis"
_CALL = "the call: to read the numbers, to form the answer"

#: What the functions of `symasym.exact` do.
STAGES = {
    "samples of the exponential and their sums": ("sampled", "exponents_of_series", "integrals"),
    "drift on panels: Taylor shifts, values": (
        *("series_of", "shifted", "centred", "phi_at", "phi", "series"),
    ),
    "planning blocks: slow, sampled or cut": ("planned", "is_slow", "_tail", "_pieces", "hidden"),
    "what counts and what does not": ("counting", "placed", "up_to", "_coarse"),
    "slow panels": ("slow", "slow_terms", "merge_slow"),
    _SWEEPS: ("through", "carried", "first", "of"),
    "first cuts: zeros of A, Taylor series about them": (
        *("partition", "_even_blocks", "_graded_blocks", "_levels_needed", "zeros", "taylor"),
        *("shift", "_zeros_of", "_polished", "two_product", "two_sum", "_fast_two_sum"),
    ),
    "gathering and sorting records": ("take", "_joined", "joined", "sorted", "records_of"),
}
#: What modules and packages do, but for these functions; anything else is "the rest".
MODULES = {
    "exact/float_sides.py": "sides not steep (`exact/float_sides.py`), samples and shifts apart",
    "exact/float_panels.py": "samples of the exponential and their sums",
    "numbers/float_arrays.py": _SWEEPS,
    **dict.fromkeys(("base/", "scenes.py", "methods.py", "quantities.py", "drift/drift.py"), _CALL),
}


class _Recorder:
    """NumPy, with the sizes of the arrays that `exp` is called on."""

    def __init__(self, shapes: list[tuple[int, ...]]) -> None:
        self._shapes = shapes

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    def exp(self, x: Any, *rest: Any, **named: Any) -> Any:
        self._shapes.append(np.shape(x))
        return np.exp(x, *rest, **named)


@contextmanager
def _recording() -> Iterator[list[tuple[int, ...]]]:
    shapes: list[tuple[int, ...]] = []
    known = list(sys.modules.items())
    watched = [m for name, m in known if name.startswith("symasym") and vars(m).get("np") is np]
    for module in watched:
        module.np = _Recorder(shapes)  # type: ignore[attr-defined]
    try:
        yield shapes
    finally:
        for module in watched:
            module.np = np  # type: ignore[attr-defined]


def exponentials(call: Callable[[], Any]) -> list[np.ndarray]:
    """Arrays of the sizes `call` takes exponentials of, with exponents like those of panels."""
    with _recording() as shapes:
        call()
    random = np.random.default_rng(1)
    return [random.uniform(-8.0, 8.0, shape) for shape in shapes]


def shares(call: Callable[[], Any], runs: int = 5) -> dict[str, float]:
    """Share of each stage in the time of `call`; NumPy's time belongs to the stage that asked."""
    profile = cProfile.Profile()
    profile.enable()
    for _ in range(runs):
        call()
    profile.disable()
    own: dict[str, float] = defaultdict(float)
    for (file, _, name), (_, _, total, _, callers) in pstats.Stats(profile).stats.items():
        if file.startswith(_PACKAGE):
            own[_stage(file, name)] += total
            continue
        for (where, _, caller), (_, _, part, _) in callers.items():
            own[_stage(where, caller) if where.startswith(_PACKAGE) else "the rest"] += part
    whole = sum(own.values())
    return {name: own[name] / whole for name in sorted(own, key=own.__getitem__, reverse=True)}


def _stage(file: str, function: str) -> str:
    inside = Path(file).relative_to(_PACKAGE).as_posix()
    by_module = next((name for start, name in MODULES.items() if inside.startswith(start)), "")
    by_name = next((name for name, parts in STAGES.items() if function in parts), "")
    # Some of the names mean other things there.
    apart = "float_sides" in inside
    return (by_module if apart else by_name or by_module) or "the rest"
