"""Formulas that the library writes by hand, each held to the step that derives it.

A row: the label and the step, and what the library gives for numbers by the names of its symbols.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import mpmath
import pytest
from flint import arb

import derivations.sections  # noqa: F401
import symasym as sa
from symasym import paper
from symasym.derivation.derivation import build
from symasym.derivation.proof import numeric
from symasym.drift.ready_made import friction as of_friction


def in_balls(function: Callable[..., Any], *names: str) -> Callable[..., float]:
    return lambda **at: float(function(*(arb(at[name]) for name in names)))


def constant(verb: Any) -> Callable[..., float]:
    return lambda kappa, r, a: float(verb(sa.polynomial(a), kappa, r))


def friction(u: float | None = None, of: str = "__call__") -> Callable[..., float]:
    """The drift, or its potential, at u, or at the number of that name."""
    return lambda **at: float(
        getattr(sa.friction(at.get("mu", 1.5), at["alpha"], at["z0"]), of)(at.get("u", u))
    )


ROWS: list[tuple[str, str, Callable[..., float]]] = [
    ("eq:tildexykappa", "kappa",
     lambda kappa_phys, epsilon: float(sa.rescale(epsilon, kappa_phys, 1).kappa)),
    ("eq:tilder", "", lambda r_phys, epsilon: float(sa.rescale(epsilon, 1, r_phys).r)),
    ("eq:phifric0", "left", friction(-2.0)),
    ("eq:phifric0", "inside", friction()),
    ("eq:phifric0", "right", friction(2.0)),
    ("eq:Vfric", "inside", friction(of="potential_at")),
    ("turning-points", "zero", of_friction.turning_point),
    ("beta", "force at the turning point", of_friction.breakaway),
    ("folds", "right fold", lambda mu, alpha: float(sa.friction(mu, alpha).folds().z0[0])),
    ("constant-drift", "from 0", constant(sa.escape_time)),
    ("constant-drift", "exit through -r, from 0", constant(sa.exit_probability)),
    ("eq:Ttildesmall", "sum",
     in_balls(paper.weak_noise_time, "kappa", "r", "a_plus", "A_1", "A_2", "D")),
    ("C-bound", "", in_balls(paper.exit_bound, "kappa", "r", "a_minus", "a_plus")),
    ("eq:Plarge2", "", in_balls(paper.strong_noise_occupation, "kappa", "a_minus", "a_plus")),
    ("L-bound", "", in_balls(paper.occupation_bound, "kappa", "a_minus", "a_plus", "L", "V_1")),
]  # fmt: skip


@pytest.mark.parametrize(
    ("label", "step", "written"), ROWS, ids=lambda x: x if isinstance(x, str) else ""
)
def test_what_is_written_is_what_is_derived(
    label: str, step: str, written: Callable[..., float]
) -> None:
    stated = build(label).right(step or None)
    symbols = sorted(stated.free_symbols, key=str)
    derived, rng = numeric(stated, symbols), random.Random(label + step)
    for _ in range(3):
        sizes = {s: rng.randint(60, 95) / 100 for s in symbols}
        at = {s.name: -x if s.is_negative else x for s, x in sizes.items()}
        wanted = float(derived(*map(mpmath.mpf, at.values())))
        assert written(**at) == pytest.approx(wanted, rel=1e-12)
