"""Changing what a step states, one thing at a time; its check must notice every change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import sympy

from symasym.derivation.chain import Derivation, Step
from symasym.derivation.results import Expansion, Inequality, Statement, text

_FLIPPED = {"<=": ">=", ">=": "<=", "<": ">", ">": "<"}


@dataclass(frozen=True)
class Mutation:
    """A changed result that a check let pass."""

    label: str
    step: str
    change: str
    result: str

    def __str__(self) -> str:
        return f"{self.label}, step {self.step!r}: {self.change} survived: {self.result}"


def mutants(result: Statement) -> Iterator[tuple[str, Any]]:
    """Every change of `result`: coefficients, signs, exponents, orders, directions, limits.

    Yields
    ------
    (str, result)
        What was changed, and the changed result; none equals `result`.
    """
    if isinstance(result, Expansion):
        for change, mutant in _expression(result.leading):
            yield f"leading: {change}", replace(result, leading=mutant)
        x = result.variable
        yield "order one higher", replace(result, gauge=result.gauge * x)
        yield "order one lower", replace(result, gauge=result.gauge / x)
    elif isinstance(result, Inequality):
        yield "direction", replace(result, relation=_FLIPPED[result.relation])
        for change, mutant in _expression(result.left):
            yield f"left: {change}", replace(result, left=mutant)
        for change, mutant in _expression(result.right):
            yield f"right: {change}", replace(result, right=mutant)
    elif isinstance(result, (tuple, list, sympy.Tuple)):
        for index, item in enumerate(result):
            for change, mutant in mutants(item):
                yield (
                    f"piece {index + 1}: {change}",
                    (*result[:index], mutant, *result[index + 1 :]),
                )
    elif isinstance(result, sympy.MatrixBase):
        for index, item in enumerate(result):
            for change, mutant in _expression(item):
                changed = result.as_mutable()
                changed[index] = mutant
                yield f"entry {index + 1}: {change}", changed.as_immutable()
    else:
        yield from _expression(sympy.sympify(result))


def _expression(e: sympy.Expr) -> Iterator[tuple[str, Any]]:
    """Changes of one expression, each at one node of its tree."""
    seen = {e}
    for change, mutant in _everywhere(sympy.sympify(e)):
        if mutant in seen or sympy.expand(mutant - e) == 0:
            continue
        seen.add(mutant)
        yield change, mutant


def _everywhere(e: sympy.Expr) -> Iterator[tuple[str, Any]]:
    """Changes at every node of the tree of `e`, and of the whole."""
    if e == 0:
        yield "0 to 1", sympy.S.One
        return
    yield "coefficient 2 on the whole", 2 * e
    yield "sign of the whole", -e
    for path in _paths(e):
        node = _at(e, path)
        for change, other in _local(node):
            yield f"{change} of {text(node, 60)}", _put(e, path, other)


def _paths(e: sympy.Expr, path: tuple[int, ...] = ()) -> Iterator[tuple[int, ...]]:
    """Paths to the nodes that may be changed, each the indices of arguments from the root."""
    yield path
    # Limits of integrals are tuples (variable, low, high): the variable itself is not changed.
    if isinstance(e, (sympy.Derivative, sympy.core.function.AppliedUndef)):
        return
    for index, argument in enumerate(e.args):
        if isinstance(argument, sympy.Tuple):
            for end in range(1, len(argument)):
                yield from _paths(argument[end], (*path, index, end))
        elif isinstance(argument, sympy.Expr):
            yield from _paths(argument, (*path, index))


def _local(node: sympy.Expr) -> Iterator[tuple[str, Any]]:
    """Changes of one node: a coefficient, a sign, an exponent, an argument, an integral's limit."""
    if node.is_Add:
        for term in node.args:
            yield f"coefficient 2 on {text(term, 40)}", node + term
            yield f"sign on {text(term, 40)}", node - 2 * term
    elif node.is_Pow and node.base is not sympy.E:
        yield "exponent + 1", node.base ** (node.exp + 1)
        yield "exponent negated", node.base ** (-node.exp)
    elif isinstance(node, sympy.exp):
        yield "coefficient 2 in the exponent", sympy.exp(2 * node.args[0])
        yield "sign of the exponent", sympy.exp(-node.args[0])
    elif isinstance(node, sympy.Integral):
        for index, (variable, *ends) in enumerate(node.limits):
            for end in range(len(ends)):
                if ends[end].is_infinite:
                    continue
                moved = [e + 1 if k == end else e for k, e in enumerate(ends)]
                limits = [*node.limits[:index], (variable, *moved), *node.limits[index + 1 :]]
                yield f"limit {ends[end]} moved", node.func(node.function, *limits)
    elif isinstance(node, (sympy.log, sympy.tanh)):
        yield "coefficient 2 in the argument", node.func(2 * node.args[0])


def _at(e: sympy.Expr, path: tuple[int, ...]) -> Any:
    """The node of `e` at the end of a path."""
    for index in path:
        e = e.args[index]
    return e


def _put(e: sympy.Expr, path: tuple[int, ...], other: sympy.Expr) -> Any:
    """`e` with the node at the end of a path replaced by `other`."""
    if not path:
        return other
    arguments = list(e.args)
    arguments[path[0]] = _put(arguments[path[0]], path[1:], other)
    return e.func(*arguments)


def mutation_test(derivations: Iterable[Derivation]) -> tuple[int, int, int, list[Mutation]]:
    """Change every step's result in every way; each change must make its check fail.

    Returns
    -------
    killed, steps, changes, survivors
        A step is killed if it has at least one change and none survives.
    """
    killed = steps = changes = 0
    survivors: list[Mutation] = []
    for derivation in derivations:
        for step in derivation.steps:
            steps += 1
            alive, tried = survivors_of(derivation.label, step)
            changes += tried
            survivors += alive
            killed += bool(tried) and not alive
            if not tried:
                survivors.append(Mutation(derivation.label, step.name, "nothing to change", ""))
    return killed, steps, changes, survivors


def survivors_of(label: str, step: Step) -> tuple[list[Mutation], int]:
    """The changes of one step's result that its check lets pass, and how many were tried."""
    alive, tried = [], 0
    for change, mutant in mutants(step.result):
        tried += 1
        if step.run(mutant).passed:
            alive.append(Mutation(label, step.name, change, text(mutant)))
    return alive, tried
