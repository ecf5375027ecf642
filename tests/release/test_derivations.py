"""The chains behind `sa.release`: every changed step fails, and what they conclude is measured."""

from __future__ import annotations

import random

import numpy as np
import pytest

import symasym as sa
from derivations import registry
from derivations.errata.evidence_text import _without_noise
from symasym.derivation import mutants

LABELS = ("release-time", "release-order", "release-adiabatic", "frozen-time", "fold-delay")


@pytest.mark.parametrize("label", LABELS)
def test_every_change_is_noticed(label):
    survivors = []
    for step in registry.build(label).steps:
        for change, mutant in mutants(step.result):
            try:
                passed = step.check.run(mutant, random.Random(1)).passed
            except (ArithmeticError, TypeError, ValueError, AttributeError):
                passed = False
            if passed:
                survivors.append((step.name, change, mutant))
    assert not survivors


@pytest.mark.parametrize(("z", "flight"), [("-0.5", 0.01), ("-0.55", 0.04)])
def test_the_share_that_the_motion_of_z_takes_off(z, flight):
    """Marched with z in motion; the flight to r, which z leaves as it is, is no more than so."""
    z0, h, kappa = float(z), 1e-4, 0.15
    left, frozen, right = sa.escape_time(
        sa.friction(mu=3, alpha=1, z0=z0 + h * np.array([-1.0, 0.0, 1.0])), kappa, 10
    )
    slope = (right - left) / (2 * h)
    (stated, _), eps = sa.formula("frozen-time").expression, 1e-3 / slope
    put = {"T_f": frozen, "Tf_z": slope, "epsilon": eps, "g": -1.0}
    share = float(stated.subs({s: put[s.name] for s in stated.free_symbols})) / frozen - 1
    block = sa.oscillator(mu=3, alpha=1)
    whole = sa.release(block, kappa, 10, eps=eps, start=(0, z), method="march", rtol="1e-7")
    assert share == pytest.approx(whole.mean / frozen - 1, rel=flight)


def test_the_fold_is_passed_as_late_as_the_chain_says():
    """Without noise the delay past the fold, less the flight to r, grows as eps^(-1/3)."""
    block, late = sa.oscillator(mu=3, alpha=1), []
    for eps in (1e-3, 1e-4, 1e-5):
        time = _without_noise(eps, 2.0, -0.72, 1 / 8)
        late.append(time - block.drag_time("-0.72", str(eps)))
    # The flight is the same for each, so that differences scale.
    ratio = (late[2] - late[1]) / (late[1] - late[0])
    assert np.log10(ratio) == pytest.approx(1 / 3, abs=0.05)
