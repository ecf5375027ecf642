"""The release of a block that sticks while a slow variable moves: the whole system."""

from symasym.release.answer import Release, release
from symasym.release.system import System, oscillator

__all__ = ["Release", "System", "oscillator", "release"]
