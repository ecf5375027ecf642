"""Expansions as formulas, with the drift's parameters free."""

from symasym.formulas.cases import Case
from symasym.formulas.expand import Expansion, expand
from symasym.formulas.series import Contribution, Leading

__all__ = ["Case", "Contribution", "Expansion", "Leading", "expand"]
