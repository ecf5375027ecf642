"""Source code of a formula: NumPy, mpmath, C, JavaScript, LaTeX."""

from symasym.emit.emit import source
from symasym.emit.printing import Function, Source

__all__ = ["Function", "Source", "source"]
