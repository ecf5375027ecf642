"""The table of scenes, which is in the package because `symasym verify` needs it there."""

from symasym.workshop.problems import (
    BY_NAME,
    FOLD,
    KNOWN_WRONG,
    PROBLEMS,
    TAGS,
    Problem,
    answered,
    constant_drift,
    linear_sliding,
    tagged,
)
from symasym.workshop.verify.findings import distance, logarithm, relative

__all__ = [
    "BY_NAME",
    "FOLD",
    "KNOWN_WRONG",
    "PROBLEMS",
    "TAGS",
    "Problem",
    "answered",
    "constant_drift",
    "distance",
    "linear_sliding",
    "logarithm",
    "relative",
    "tagged",
]
