"""The chains behind `sa.release`: every step is checked, and every changed step fails."""

from __future__ import annotations

import random

import numpy as np
import pytest

import symasym as sa
from derivations.errata.evidence_text import _without_noise
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
    """Without noise the delay past the fold, less the flight to r, grows as eps^(-1/3)."""
    block, late = sa.oscillator(mu=3, alpha=1), []
    for eps in (1e-3, 1e-4, 1e-5):
        time = _without_noise(eps, 2.0, -0.72, 1 / 8)
        late.append(time - block.drag_time("-0.72", str(eps)))
    # The flight is the same for each, so that differences scale.
    ratio = (late[2] - late[1]) / (late[1] - late[0])
    assert np.log10(ratio) == pytest.approx(1 / 3, abs=0.05)
