"""Expansions as formulas, with the drift's parameters free."""

from symasym.expansions.cases import Case
from symasym.expansions.composition import Contribution
from symasym.expansions.expansion import Expansion, expand

__all__ = ["Case", "Contribution", "Expansion", "expand"]
