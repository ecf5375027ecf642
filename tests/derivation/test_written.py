"""Formulas that the library writes by hand, each held to the step that derives it.

A row: the label and the step, and what the library gives for numbers by the names of its symbols.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from flint import arb

import derivations.sections  # noqa: F401
import symasym as sa
from derivations.sections.section5.positive import E_s
from symasym.derivation.derivation import build, numeric
from symasym.exact import balls, float_panels, floats
from symasym.exact.logs import Logs
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.sides import straight


def by_paper(verb: Any) -> Callable[..., float]:
    """Of the linear drift."""
    return lambda a_minus, a_plus, **scene: float(
        verb(sa.linear(a_minus, a_plus), **scene, method="paper")
    )


def constant(verb: Any) -> Callable[..., float]:
    return lambda kappa, r, a: float(verb(sa.polynomial(a), kappa, r))


def friction(u: float | None = None, of: str = "__call__") -> Callable[..., float]:
    """The drift, or its potential, at u, or at the number of that name."""
    return lambda **at: float(
        getattr(sa.friction(at.get("mu", 1.5), at["alpha"], at["z0"]), of)(at.get("u", u))
    )


def panel(k: int, sign: int = 1) -> Callable[..., float]:
    """An entry of the record of a panel of width 1 on which lam phi is x, or -x."""
    none, half = np.zeros(1), np.full(1, 0.5)
    return lambda x: float(
        np.exp(
            float_panels.records(half, sign * x * half[None, None], none, none, None, 0.0, 1).log[
                k, 0
            ]
        )
    )


def way(of: str, sign: int = 1) -> Callable[..., float]:
    """The same of an expansion's side, over the largest value of its integrand."""
    return lambda x: float(
        getattr(straight(arb(-sign * x), arb(1), InBalls(arb(1), 0)), of)
        * arb(min(0, sign * x)).exp()
    )


def in_floats(k: int, absorbing: bool = False) -> Callable[..., float]:
    """sigma (k = 0) or w (1) after a panel."""

    def value(lam=1, f=1, c=1, E_s=1, F_s=1, D_s=1, sigma=1, w=1):  # type: ignore[no-untyped-def]
        rate = np.array([float(lam)])
        before = Logs(np.log([[1 / sigma], [w], [1]]), np.zeros((3, 1)))
        crossed = Logs(np.log([[f], [c], [E_s], [F_s], [D_s]]), np.zeros((5, 1)))
        after = floats.carried(floats.absorbing(rate) if absorbing else before, crossed, rate)
        return float(np.exp(after.log[k, 0] * (2 * k - 1)))

    return value


def enclosed(k: int, absorbing: bool = False) -> Callable[..., float]:
    """The same in balls, which carry lam Q = w sigma."""

    def value(lam=1, f=1, c=1, E_s=1, F_s=1, D_s=1, sigma=1, w=1):  # type: ignore[no-untyped-def]
        before = balls.State(arb(sigma), (arb(1), arb(w * sigma)))
        crossed = balls.Record(arb(E_s / c), arb(lam * F_s / f), arb(lam * D_s / f), arb(c / f))
        eta, zeta = balls.carried(balls.ABSORBING if absorbing else before, crossed)
        return float((eta, zeta[1] / eta)[k])

    return value


ROWS: list[tuple[str, str, Callable[..., float]]] = [
    ("eq:tildexykappa", "kappa",
     lambda kappa_phys, epsilon: float(sa.rescale(epsilon, kappa_phys, 1).kappa)),
    ("eq:tilder", "", lambda r_phys, epsilon: float(sa.rescale(epsilon, 1, r_phys).r)),
    ("eq:phifric0", "left", friction(-2.0)),
    ("eq:phifric0", "inside", friction()),
    ("eq:phifric0", "right", friction(2.0)),
    ("eq:Vfric", "inside", friction(of="potential_at")),
    ("constant-drift", "from 0", constant(sa.escape_time)),
    ("constant-drift", "exit through -r, from 0", constant(sa.exit_probability)),
    ("C-bound", "", by_paper(sa.exit_probability)),
    ("eq:Plarge2", "", by_paper(sa.occupation)),
    ("constant-panel", "single", panel(2)),
    ("constant-panel", "double, V falls", panel(4)),
    ("constant-panel", "double, V rises", panel(4, -1)),
    ("constant-panel", "single", way("speed")),
    ("constant-panel", "double, V rises", way("nested")),
    ("constant-panel", "double, V falls", way("nested", -1)),
    *(("panel-step", step, of(k, "end" in step)) for of in (in_floats, enclosed) for step, k in (
        ("sigma, scaled", 0), ("w, scaled", 1),
        ("sigma from an absorbing end", 0), ("w from an absorbing end", 1))),
]  # fmt: skip
#: Where the paper's formulas begin to hold.
FAR = {("C-bound", "r"): 8, ("eq:Plarge2", "kappa"): 5}


@pytest.mark.parametrize(
    ("label", "step", "written"), ROWS, ids=lambda x: x if isinstance(x, str) else ""
)
def test_what_is_written_is_what_is_derived(
    label: str, step: str, written: Callable[..., float]
) -> None:
    stated = build(label).right(step or None)
    if label == "constant-panel":
        stated = stated.subs(E_s, build(label).right("single"))
    symbols = sorted(stated.free_symbols, key=str)
    derived, rng = numeric(stated, symbols), random.Random(label + step)
    for _ in range(3):
        sizes = {s: rng.randint(60, 95) / 100 * FAR.get((label, s.name), 1) for s in symbols}
        at = {s.name: -x if s.is_negative else x for s, x in sizes.items()}
        wanted = float(derived(*map(mpmath.mpf, at.values())))
        assert written(**at) == pytest.approx(wanted, rel=1e-12)
