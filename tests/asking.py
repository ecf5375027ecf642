"""Questions to the table of scenes, and their answers to 60 digits."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import symasym as sa
from tests.problems import BY_NAME, PROBLEMS, Problem

ASKED = [p for p in PROBLEMS if "refused" not in p.tags]


def later(problems: list[Problem], *tags: str) -> list[Any]:
    """The scenes as parameters, those with one of these tags marked slow."""
    return [
        pytest.param(p, marks=pytest.mark.slow if p.tags & set(tags) else (), id=p.name)
        for p in problems
    ]


@cache
def reference(name: str, quantity: str) -> Any:
    """The 60-digit value, or the sentence of the refusal where a scene may refuse."""
    problem = BY_NAME[name]
    try:
        return problem.questions()[quantity](dps=60)
    except sa.SymasymError:
        if "may refuse" in problem.tags:
            return None
        raise


def exact_value(
    verb: Callable[..., Any], drift: sa.Drift, kappa: Any, *, dps: int, **scene: Any
) -> Any:
    """The exact value of a verb, found once for all orders that are compared with it."""
    return _exact(verb, drift, kappa, dps, tuple(sorted(scene.items())))


@cache
def _exact(
    verb: Callable[..., Any], drift: sa.Drift, kappa: Any, dps: int, scene: tuple[Any, ...]
) -> Any:
    return verb(drift, kappa, dps=dps, **dict(scene))


def each(problem: Problem) -> list[tuple[str, Callable[..., Any], Any]]:
    """(quantity, question, 60-digit value)."""
    found = [(q, ask, reference(problem.name, q)) for q, ask in problem.questions().items()]
    return [x for x in found if x[2] is not None]


def ask_or_refuse(problem: Problem, ask: Callable[..., Any], **options: Any) -> Any:
    """The answer, or None where the scene may refuse and does."""
    try:
        return ask(**options)
    except sa.SymasymError:
        if "may refuse" in problem.tags:
            return None
        raise
