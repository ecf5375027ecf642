"""symasym: escape times and Laplace-type integrals as derived formulas and values with errors."""

import ast
import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symasym.base.errors import (
        AccuracyError,
        InputError,
        OutputError,
        RangeError,
        RegionError,
        SymasymError,
    )
    from symasym.base.estimate import Estimate
    from symasym.drift.critical_points import CriticalPoint
    from symasym.drift.drift import Drift
    from symasym.drift.ready_made import (
        friction,
        hill,
        linear,
        polynomial,
        sine,
        tanh,
    )
    from symasym.drift.reduction import Reduction, Scales, reduce, rescale
    from symasym.formula import Formula, emit, formula, labels
    from symasym.formulas.expand import Expansion, expand
    from symasym.integrals.laplace import LaplaceExpansion, laplace_integral
    from symasym.integrals.uniform import UniformExpansion, uniform_integral
    from symasym.law import ExitLaw, exit_law
    from symasym.plan import Plan, plan
    from symasym.plot import plot
    from symasym.quantities import escape_time, exit_probability, occupation, stationary_density
    from symasym.release import Release, System, oscillator, release
    from symasym.sensitivity import Sensitivity, sensitivity
    from symasym.stokes import stokes_multiplier

__all__ = [
    "AccuracyError", "CriticalPoint", "Drift", "Estimate", "ExitLaw", "Expansion",
    "Formula", "InputError", "LaplaceExpansion", "OutputError", "Plan", "RangeError",
    "Reduction", "RegionError", "Release", "Scales", "Sensitivity", "SymasymError", "System",
    "UniformExpansion", "emit", "escape_time", "exit_law", "exit_probability", "expand",
    "formula", "friction", "hill", "labels", "laplace_integral", "linear", "occupation",
    "oscillator", "plan", "plot", "polynomial", "reduce", "release", "rescale", "sensitivity",
    "sine", "stationary_density", "stokes_multiplier", "tanh", "uniform_integral",
]  # fmt: skip

#: The module of each public name, from the imports above; it is loaded at the first use.
_HOMES = {
    alias.name: str(node.module)
    for node in ast.walk(ast.parse(Path(__file__).read_bytes()))
    if isinstance(node, ast.ImportFrom) and str(node.module).startswith("symasym.")
    for alias in node.names
}


class _Package(ModuleType):
    """This package, whose public names are loaded at their first use.

    Six functions have the name of a module (such as ``symasym.plan``), which would replace the
    function in this namespace when it is imported.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        if name == "__version__":
            return importlib.import_module("importlib.metadata").version("symasym")
        if name not in _HOMES:
            raise AttributeError(f"module 'symasym' has no attribute {name!r}")
        value = getattr(importlib.import_module(_HOMES[name]), name)
        setattr(self, name, value)
        return value

    def __dir__(self) -> list[str]:
        return sorted(__all__)


sys.modules[__name__].__class__ = _Package
