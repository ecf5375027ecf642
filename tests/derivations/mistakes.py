"""Mistakes made on purpose: a check that lets one pass proves nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import product
from typing import Any

import pytest
import sympy
from sympy import Integral, S
from sympy.core.function import AppliedUndef

from symasym.derivation.derivation import BUILT, Derivation, Step


def mutants(e: Any) -> Iterator[Any]:
    """Every change of one coefficient, sign, exponent or limit of an expression."""
    if isinstance(e, sympy.Tuple):
        for i, part in enumerate(e):
            yield from (sympy.Tuple(*e[:i], m, *e[i + 1 :]) for m in mutants(part))
        return
    seen = {e}
    for m in [S.One] if e == 0 else [2 * e, -e, *_everywhere(e)]:
        if m not in seen and sympy.expand(m - e) != 0:
            seen.add(m)
            yield m


def _everywhere(node: Any) -> Iterator[Any]:
    yield from _local(node)
    if isinstance(node, (sympy.Derivative, AppliedUndef)):
        return
    for i, a in enumerate(node.args):
        for b in _everywhere(a) if isinstance(a, sympy.Expr) else ():
            yield node.func(*node.args[:i], b, *node.args[i + 1 :])


def _local(node: Any) -> Iterator[Any]:
    if node.is_Add:
        yield from (node + t for t in node.args)
        yield from (node - 2 * t for t in node.args)
    elif node.is_Pow and node.base is not S.Exp1:
        yield from (node.base ** (node.exp + 1), node.base**-node.exp)
    elif isinstance(node, (sympy.exp, sympy.log, sympy.tanh)):
        yield node.func(2 * node.args[0])
        yield node.func(-node.args[0])
    elif isinstance(node, Integral):
        for i, j in product(range(len(node.limits)), (1, 2)):
            limits = [list(limit) for limit in node.limits]
            if len(limits[i]) == 3 and not limits[i][j].is_infinite:
                limits[i][j] += 1
                yield Integral(node.function, *limits)


def survivors(step: Step) -> tuple[list[Any], int]:
    """The changes of a step's right side, or order, that its check lets pass; how many it has."""
    changed = list(mutants(step.right))
    alive = [m for m in changed if passes(step, m)]
    if step.variable is not None:
        orders = [step.error * step.variable, step.error / step.variable]
        alive += [e for e in orders if step.check(step.right, e)]
        changed += orders
    return alive, len(changed)


def passes(step: Step, stated: Any) -> bool:
    """Whether the step's check lets a right side pass; one that breaks down has decided nothing."""
    with suppress(Exception):
        return bool(step.check(stated))
    return False


@contextmanager
def changed(label: str, name: str, right: Any, again: Iterable[str]) -> Iterator[None]:
    """The labels `again` are built anew, with this right side in the place of a step's own, whose
    check is left out."""
    kept, add = dict(BUILT), Derivation._add

    def added(self: Derivation, step: Step) -> Any:
        if (self.label, step.name) == (label, name):
            step.right, step.check = right, lambda *_: True
        return add(self, step)

    for x in again:
        BUILT.pop(x, None)
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Derivation, "_add", added)
            yield
    finally:
        BUILT.clear()
        BUILT.update(kept)
