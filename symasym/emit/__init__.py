"""Source code of a formula: NumPy, mpmath, plain Python, C, JavaScript, LaTeX."""

from symasym.emit.code import emit
from symasym.emit.source import TARGETS, Source, add_target

__all__ = ["Source", "TARGETS", "add_target", "emit"]
