"""Proved bounds of C and 1 - C: the middle of the exact value's enclosure in balls, and its radius.

The paper's own bound, as derived, is method "paper" (`symasym.paper`).
"""

from symasym.exact.balls import of_scene

__all__ = ["of_scene"]
