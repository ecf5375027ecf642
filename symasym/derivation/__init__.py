"""Derivations of which every step is checked by machine, for the paper's results or your own.

This package loads SymPy, which ``import symasym`` does not.
"""

from symasym.derivation.derivation import Derivation, Step, build, derives
from symasym.derivation.tex import tex

__all__ = ["Derivation", "Step", "build", "derives", "tex"]
