"""Source code of a formula: NumPy, mpmath, C, JavaScript, LaTeX."""

from symasym.emit.emit import TARGETS, Function, Source, emit

__all__ = ["TARGETS", "Function", "Source", "emit"]
