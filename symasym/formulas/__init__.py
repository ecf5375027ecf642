"""Expansions as formulas, with the drift's parameters free."""

from symasym.formulas.cases import Case
from symasym.formulas.expand import expand
from symasym.formulas.formula import Contribution, Expansion
from symasym.formulas.leading import Leading

__all__ = ["Case", "Contribution", "Expansion", "Leading", "expand"]
