"""symasym: escape times and Laplace-type integrals, derived, evaluated, with their errors."""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symasym.asymptotics.coalescence.integral import uniform_integral
    from symasym.asymptotics.laplace.integral import laplace_integral
    from symasym.asymptotics.proofs.range_bound import RangeBound, weak_noise_bound
    from symasym.base.errors import (
        AccuracyError,
        InputError,
        OutputError,
        RangeError,
        RegionError,
        SymasymError,
        TimeLimitError,
    )
    from symasym.base.estimate import Estimate
    from symasym.base.scales import Scales, rescale
    from symasym.drift.drift import Drift
    from symasym.drift.ready_made.friction import friction
    from symasym.drift.ready_made.smoothings import hill, linear, polynomial, sine, tanh
    from symasym.drift.reduction import reduce
    from symasym.emit import emit
    from symasym.expansions import Expansion, expand
    from symasym.formula import Formula, formula, labels
    from symasym.plan import plan
    from symasym.plot import plot
    from symasym.quantities import escape_time, exit_probability, occupation, stationary_density
    from symasym.release import System, oscillator, release
    from symasym.sensitivity import Sensitivity, sensitivity
    from symasym.stokes import stokes_multiplier

__all__ = [
    "AccuracyError",
    "Drift",
    "Estimate",
    "Expansion",
    "Formula",
    "InputError",
    "OutputError",
    "RangeBound",
    "RangeError",
    "RegionError",
    "Scales",
    "Sensitivity",
    "SymasymError",
    "System",
    "TimeLimitError",
    "emit",
    "escape_time",
    "exit_probability",
    "expand",
    "formula",
    "friction",
    "hill",
    "labels",
    "laplace_integral",
    "linear",
    "occupation",
    "oscillator",
    "plan",
    "plot",
    "polynomial",
    "reduce",
    "release",
    "rescale",
    "sensitivity",
    "sine",
    "stationary_density",
    "stokes_multiplier",
    "tanh",
    "uniform_integral",
    "weak_noise_bound",
]

#: Where each public name lives; it is loaded when first asked for.
_HOMES = {
    "AccuracyError": "symasym.base.errors",
    "Drift": "symasym.drift.drift",
    "Estimate": "symasym.base.estimate",
    "Expansion": "symasym.expansions",
    "Formula": "symasym.formula",
    "InputError": "symasym.base.errors",
    "OutputError": "symasym.base.errors",
    "RangeBound": "symasym.asymptotics.proofs.range_bound",
    "RangeError": "symasym.base.errors",
    "RegionError": "symasym.base.errors",
    "Scales": "symasym.base.scales",
    "Sensitivity": "symasym.sensitivity",
    "SymasymError": "symasym.base.errors",
    "System": "symasym.release",
    "TimeLimitError": "symasym.base.errors",
    "emit": "symasym.emit",
    "escape_time": "symasym.quantities",
    "exit_probability": "symasym.quantities",
    "expand": "symasym.expansions",
    "formula": "symasym.formula",
    "friction": "symasym.drift.ready_made.friction",
    "hill": "symasym.drift.ready_made.smoothings",
    "labels": "symasym.formula",
    "laplace_integral": "symasym.asymptotics.laplace.integral",
    "linear": "symasym.drift.ready_made.smoothings",
    "occupation": "symasym.quantities",
    "oscillator": "symasym.release",
    "plan": "symasym.plan",
    "plot": "symasym.plot",
    "polynomial": "symasym.drift.ready_made.smoothings",
    "reduce": "symasym.drift.reduction",
    "release": "symasym.release",
    "rescale": "symasym.base.scales",
    "sensitivity": "symasym.sensitivity",
    "sine": "symasym.drift.ready_made.smoothings",
    "stationary_density": "symasym.quantities",
    "stokes_multiplier": "symasym.stokes",
    "tanh": "symasym.drift.ready_made.smoothings",
    "uniform_integral": "symasym.asymptotics.coalescence.integral",
    "weak_noise_bound": "symasym.asymptotics.proofs.range_bound",
}


class _Package(ModuleType):
    """This package, whose public names are loaded when first asked for.

    Five verbs have the name of their module (``symasym.plan``): importing the module
    would put it in the verb's place.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _HOMES and isinstance(value, ModuleType):
            value = getattr(value, name)
        super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        if name not in _HOMES:
            raise AttributeError(f"module 'symasym' has no attribute {name!r}")
        value = getattr(importlib.import_module(_HOMES[name]), name)
        setattr(self, name, value)
        return value

    def __dir__(self) -> list[str]:
        return sorted(__all__)


sys.modules[__name__].__class__ = _Package
