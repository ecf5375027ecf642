"""symasym: escape times and Laplace-type integrals, derived, evaluated, with their errors."""

from symasym.asymptotics.integrals import laplace_integral
from symasym.drift import Drift, hill, linear, polynomial, sine, tanh
from symasym.errors import (
    AccuracyError,
    InputError,
    OutputError,
    RangeError,
    RegionError,
    SymasymError,
)
from symasym.estimate import Estimate
from symasym.formula import Formula, formula
from symasym.friction import friction
from symasym.quantities import escape_time, exit_probability, occupation, stationary_density
from symasym.reduce import reduce
from symasym.scales import Scales, rescale

__all__ = [
    "AccuracyError",
    "Drift",
    "Estimate",
    "Formula",
    "InputError",
    "OutputError",
    "RangeError",
    "RegionError",
    "Scales",
    "SymasymError",
    "escape_time",
    "exit_probability",
    "formula",
    "friction",
    "hill",
    "laplace_integral",
    "linear",
    "occupation",
    "polynomial",
    "reduce",
    "rescale",
    "sine",
    "stationary_density",
    "tanh",
]
