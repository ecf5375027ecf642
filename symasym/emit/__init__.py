"""Source code of a formula: NumPy, mpmath, C, JavaScript, LaTeX."""

from symasym.emit.emit import emit
from symasym.emit.printing import Function, Source

__all__ = ["Function", "Source", "emit"]
