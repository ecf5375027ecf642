"""The chains behind `sa.release`: every step is checked, and every changed step fails."""

from __future__ import annotations

import random

import numpy as np
import pytest

import symasym as sa
from derivations.release import CHAINS
from symasym.derivation import mutants


@pytest.mark.parametrize("chain", CHAINS, ids=lambda c: c.__name__)
def test_every_step_holds(chain):
    records = chain().verify()
    assert records
    assert all(record.passed for record in records)


@pytest.mark.parametrize("chain", CHAINS, ids=lambda c: c.__name__)
def test_every_change_is_noticed(chain):
    survivors = []
    for step in chain().steps:
        for change, mutant in mutants(step.result):
            try:
                passed = step.check.run(mutant, random.Random(1)).passed
            except (ArithmeticError, TypeError, ValueError, AttributeError):
                passed = False
            if passed:
                survivors.append((step.name, change, mutant))
    assert not survivors


def test_the_fold_is_passed_as_late_as_the_chain_says():
    """Marched with little noise: the delay past the fold grows as eps^(-1/3)."""
    block, late = sa.oscillator(mu=3, alpha=1), []
    for eps in ("1e-3", "1e-4"):
        answer = sa.release(block, "0.02", 2, eps=eps, start=("0.6", "-0.7"), rtol=1e-3)
        late.append(answer.mean - block.drag_time("-0.7", eps))
    # Each a few percent off by the flight to r, which eps leaves alone.
    assert np.log(late[1] / late[0]) / np.log(10) == pytest.approx(1 / 3, abs=0.08)
