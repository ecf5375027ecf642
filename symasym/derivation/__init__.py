"""Derivations whose every step is checked by machine, for the paper's results or your own.

A `Derivation` is a chain of steps from definitions to a result. A step states
its result, names the rule that gave it, and carries a check that is really
run: nothing is believed because it was written down, and what a check cannot
decide counts as failed.

This package loads SymPy; ``import symasym`` does not load this package.
"""

from symasym.derivation.chain import (
    RULES,
    Derivation,
    DerivationError,
    Hypothesis,
    Step,
    StepRecord,
)
from symasym.derivation.checks import Bound, Definition, Identity, Leading, Satisfies
from symasym.derivation.mutation import Mutation, mutants, mutation_test
from symasym.derivation.numerical import Order, Sampled, Together
from symasym.derivation.results import Expansion, Inequality, Outcome

__all__ = [
    "RULES", "Bound", "Definition", "Derivation", "DerivationError", "Expansion", "Hypothesis",
    "Identity", "Inequality", "Leading", "Mutation", "Order", "Outcome", "Sampled", "Satisfies",
    "Step", "StepRecord", "Together", "mutants", "mutation_test",
]  # fmt: skip
