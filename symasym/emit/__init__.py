"""Source code of a formula: NumPy, mpmath, C, JavaScript, LaTeX."""

from symasym.emit.emit import emit
from symasym.emit.printing import PRINTERS, TARGETS, Function, Source

__all__ = ["PRINTERS", "TARGETS", "Function", "Source", "emit"]
