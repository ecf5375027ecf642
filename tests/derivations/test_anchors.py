"""Every conclusion of the derivations is held to its definition; mistakes made twice die.

A mistake that a derivation makes consistently, in a step's result and in its reference, passes the
derivation's own checks; here its conclusion is compared with what shares nothing with them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import islice, pairwise
from typing import Any

import numpy as np
import pytest
import sympy

import symasym as sa
from derivations import registry
from symasym.derivation.mutation import mutants
from symasym.derivation.results import Expansion
from symasym.workshop import reference_quadrature
from tests.derivations.anchors import (
    EXACT,
    ORDERS,
    OTHERS,
    anchor,
    holds,
    orders,
    scenes,
    value,
)
from tests.derivations.definitions import Drift, Scene, of_fraction
from tests.derivations.random_scenes import barely


def _collocation(scene: Scene) -> tuple[float, float]:
    """T and C at the start by SciPy's collocation of the boundary-value problems."""
    from scipy.integrate import solve_bvp

    r, lam, x = float(scene.r), float(scene.lam), float(scene.start)
    edges = [-r, -1.0, x, 1.0, r]
    parts = [np.linspace(a, b, 21)[:-1] for a, b in pairwise(edges)]
    mesh = np.concatenate([*parts, [r]])

    def rates(u: Any, y: Any) -> Any:
        return [
            y[1],
            -lam * (1 + scene.drift.numpy(u) * y[1]),
            y[3],
            -lam * scene.drift.numpy(u) * y[3],
        ]

    def ends(a: Any, b: Any) -> Any:
        return np.array([a[0], b[0], a[2] - 1, b[2]])

    found = solve_bvp(rates, ends, mesh, np.zeros((4, mesh.size)), tol=1e-7, max_nodes=20000)
    assert found.success
    return tuple(found.sol(x)[[0, 2]])


@pytest.mark.parametrize("seed", range(3))
def test_the_definitions_are_what_collocation_and_quadrature_find(seed):
    drift = Drift.layer([Fraction(1), Fraction(-seed, 2), Fraction(-1, 3), Fraction(seed - 1, 2)])
    kappa, r = Fraction(9 + 2 * seed, 10), Fraction(15 + seed, 10)
    scene = Scene(drift, of_fraction(kappa), of_fraction(r))
    assert _collocation(scene) == pytest.approx((float(scene.T), float(scene.C)), rel=1e-5)
    field = sa.polynomial(*drift.fields[1])
    for ask, mine in (
        (reference_quadrature.escape_time, scene.T),
        (reference_quadrature.exit_probability, scene.C),
    ):
        assert float(ask(field, kappa, r, Fraction(0), 15)) == pytest.approx(float(mine), rel=1e-14)
    # The flux of the density is the chance to leave: the forward problem and the backward one.
    assert float(scene.flux(-scene.r)) == pytest.approx(float(scene.C), rel=1e-14)
    bowl = Drift.layer([Fraction(1, 5), Fraction(-1), Fraction(seed, 10)])
    share = reference_quadrature.occupation(sa.polynomial(*bowl.fields[1]), kappa, 15)
    assert float(share) == pytest.approx(float(Scene(bowl, of_fraction(kappa)).P), rel=1e-14)


ANCHORED = list(registry.entries())


def test_every_label_has_an_anchor():
    held = [*EXACT, *ORDERS, *OTHERS]
    assert len(held) == len(set(held))
    assert sorted(held) == sorted(ANCHORED)


@pytest.mark.parametrize("label", ANCHORED)
def test_anchor(label):
    derivation = registry.build(label)
    anchor(label, derivation.left, derivation.result)


@pytest.mark.slow
@pytest.mark.parametrize("label", ANCHORED)
def test_anchor_on_more_scenes(label):
    derivation = registry.build(label)
    anchor(label, derivation.left, derivation.result, range(20))


@pytest.mark.parametrize("order", [1, 3, 5])
@pytest.mark.parametrize("label", ["saddle-series", "saddle-start"])
def test_a_series_derived_to_an_order_is_of_that_order(label, order):
    derivation = registry.build(f"{label}-{order}")
    orders(label, derivation.left, derivation.result, range(4))
    # One order more or less is none.
    for other in (order - 1, order + 1):
        gauge = derivation.result.gauge.subs(order + 1, other + 1)
        changed = replace(derivation.result, gauge=gauge)
        with pytest.raises(AssertionError):
            orders(label, derivation.left, changed, range(4))


def changed(label: str, result: Any) -> Iterator[tuple[str, Any]]:
    """Every change of a conclusion at one node that makes another statement of it."""
    same = None
    if label == "eq:Ttilde":
        # The integral of (H - C) e^(lam V) over (-r, r) is 0: the inner one may begin anywhere.
        same = _limits(result, (0, 1 - _symbol(result, "r"), sympy.Symbol("v", real=True)))
    for change, mutant in mutants(result):
        # A multiple of an equation is the same equation.
        scaled = registry.build(label).left == 0 and sympy.simplify(mutant / result).is_number
        if mutant != same and not scaled:
            yield change, mutant


def weaker(label: str, left: Any, result: Any) -> bool:
    """True for an upper bound that lies nowhere below the derived one: also true."""
    if label != "C-bound" or left != registry.build(label).left:
        return False
    bound = registry.build(label).result
    at = [scenes(barely, seed) for seed in range(30)]
    return all(value(result, known) >= value(bound, known) for known in at)


def killed(label: str, change: str, left: Any, result: Any) -> list[str]:
    """The changed statement, if its anchor lets it pass."""
    if weaker(label, left, result) or not holds(label, left, result):
        return []
    return [f"{label}: {change}: {left} = {result}"]


@pytest.mark.parametrize("every", [24, pytest.param(1, marks=pytest.mark.slow)])
def test_no_conclusion_changed_at_a_node_passes(every, capsys):
    tried = [
        (label, change, registry.build(label).left, mutant)
        for label in ANCHORED
        for change, mutant in islice(changed(label, registry.build(label).result), 0, None, every)
    ]
    survivors = [line for mutant in tried for line in killed(*mutant)]
    with capsys.disabled():
        print(f"\n{len(tried)} changed conclusions, {len(survivors)} pass")
    assert not survivors


# What a derivation concludes with a mistake in its result and the same one in its reference.
_S, _E = sympy.Rational, sympy.exp


def _limits(result: Any, *limits: Any) -> Any:
    """The integrals of a result with other limits, (place, low, high) each."""
    integral = next(iter(result.atoms(sympy.Integral)))
    new = list(integral.limits)
    for place, low, high in limits:
        new[place] = (new[place][0], low, high)
    return result.subs(integral, sympy.Integral(integral.function, *new))


def _symbol(e: Any, name: str) -> Any:
    return next(s for s in sympy.sympify(e).free_symbols if s.name == name)


CONSISTENT: list[tuple[str, str, Callable[[Any, Any], tuple[Any, Any]]]] = [
    ("eq:Ttilde", "three times too large", lambda a, e: (a, 3 * e)),
    ("eq:Ttilde", "its left side is C", lambda a, e: (sympy.Symbol("C"), e)),
    (
        "eq:Ttilde",
        "H(v) - C with -C alone",
        lambda a, e: (a, e.replace(sympy.Heaviside, lambda *_: 0)),
    ),
    (
        "eq:Ttilde0",
        "mass inside (-r, 0) alone",
        lambda a, e: (a, _limits(e, (0, -_symbol(e, "r"), sympy.S.Zero))),
    ),
    ("backward", "(kappa^2/2) T'' + phi T' = -2", lambda a, e: (a, 2 * e)),
    (
        "C-bound",
        "exponent -5 a- r/(2 kappa^2)",
        lambda a, e: (a, e.replace(_E, lambda x: _E(_S(5, 2) * x))),
    ),
    ("C-bound", "without its factor 2", lambda a, e: (a, e / 2)),
    ("eq:S", "S = 1/3", lambda a, e: (a, (e[0] / 3, *e[1:]))),
    ("eq:V", "V(0) = 0", lambda a, e: (a, _limits(e, (0, sympy.S.Zero, _symbol(e, "u"))))),
    ("threshold", "T as e^{D eps/kappa^2}", lambda a, e: (a, e / sympy.sqrt(2))),
    ("constant-drift", "twice T", lambda a, e: (a, (2 * e[0], e[1]))),
    (
        "eq:TtildeCzero",
        "over (-r, r)",
        lambda a, e: (a, _limits(e, (1, -_symbol(e, "r"), _symbol(e, "r")))),
    ),
    ("eq:P2", "its left side is 1 - P", lambda a, e: (1 - a, e)),
    ("eq:Psmall2", "its left side is P", lambda a, e: (1 - a, e)),
    ("eq:odeR", "over m^2", lambda a, e: (a, e / _symbol(e, "m"))),
    ("eq:C", "the chance to leave through r", lambda a, e: (1 - a, e)),
]


@pytest.mark.parametrize(
    ("label", "mistake", "change"), CONSISTENT, ids=[f"{a}: {b}" for a, b, _ in CONSISTENT]
)
def test_no_consistent_mistake_passes(label, mistake, change):
    derivation = registry.build(label)
    left, result = change(derivation.left, derivation.result)
    assert (left, result) != (derivation.left, derivation.result)
    assert not killed(label, mistake, left, result)


#: Symbols that many derivations share, and what they might be by mistake in all of them.
SHARED = {
    "kappa": lambda s: sympy.sqrt(2) * s,
    "kappa_phys": lambda s: sympy.sqrt(2) * s,
    "r": lambda s: 2 * s,
    "a_plus": lambda s: 2 * s,
    "a_minus": lambda s: 2 * s,
    "D": lambda s: 2 * s,
    "A_1": lambda s: 2 * s,
    "V": lambda applied: -applied,
}


@pytest.mark.parametrize("name", SHARED)
def test_no_mistake_in_a_shared_symbol_passes(name):
    survivors, tried = [], 0
    for label in ANCHORED:
        derivation = registry.build(label)
        result = derivation.result
        # A bound may be another true bound.
        if label == "C-bound":
            continue
        stated = result.leading if isinstance(result, Expansion) else result
        stated = sympy.Tuple(*stated) if isinstance(stated, tuple) else sympy.sympify(stated)
        symbols = {s: SHARED[name](s) for s in stated.free_symbols if s.name == name}
        put = symbols | {
            f: SHARED[name](f)
            for f in stated.atoms(sympy.core.function.AppliedUndef)
            if f.func.__name__ == name
        }
        if not put:
            continue
        tried += 1
        mutant = stated.xreplace(put)
        mutant = tuple(mutant) if isinstance(mutant, sympy.Tuple) else mutant
        if isinstance(result, Expansion):
            mutant = replace(result, leading=mutant)
        survivors += killed(label, name, derivation.left, mutant)
    assert tried
    assert not survivors
