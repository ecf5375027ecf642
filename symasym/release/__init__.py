"""The release of a sticking block while a slow variable of the system moves."""

from symasym.release.answer import Release, release
from symasym.release.system import System, oscillator

__all__ = ["Release", "System", "oscillator", "release"]
