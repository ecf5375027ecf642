"""Every formula in float64, for arrays that broadcast together.

Written by ``python -m derivations.emit``: do not edit.
"""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from symasym.generated import formulas

# What the formulas ask of their context.
_ARCS = {f"a{name}": getattr(np, f"arc{name}") for name in ("sin", "cos", "tan")}
_FLOATS = SimpleNamespace(**{**vars(np), **_ARCS, "mpf": float})


def __getattr__(name: str) -> Any:
    """A formula with NumPy in the place of its context; of numbers alone as it is."""
    formula = getattr(formulas, name)
    if formula.__code__.co_varnames[0] in ("c", "ctx"):
        formula = partial(formula, _FLOATS)
    globals()[name] = formula
    return formula
