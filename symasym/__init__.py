"""symasym: escape times and Laplace-type integrals, derived, evaluated, with their errors."""

from symasym.drift import Drift, hill, linear, polynomial, sine, tanh
from symasym.errors import (
    AccuracyError,
    InputError,
    OutputError,
    RangeError,
    RegionError,
    SymasymError,
)
from symasym.friction import friction

__all__ = [
    "AccuracyError",
    "Drift",
    "InputError",
    "OutputError",
    "RangeError",
    "RegionError",
    "SymasymError",
    "friction",
    "hill",
    "linear",
    "polynomial",
    "sine",
    "tanh",
]
