"""The values that everything else is compared with, and how far they can be trusted."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from types import ModuleType
from typing import Any, NamedTuple

import symasym as sa
from symasym.base.contexts import own_context
from symasym.exact import ball_sweep
from symasym.numbers import balls
from symasym.workshop.problems import BY_NAME, Problem
from symasym.workshop.verify.random_scenes import random_scene

#: ("table", name) or ("random", seed, index): what a scene is called between processes.
Key = tuple[str, ...]

_DPS = 45
_known: dict[tuple[str, str], Reference] = {}


class Reference(NamedTuple):
    """`value` is within `radius` of the truth; `proved` where ball arithmetic says so."""

    value: Any
    radius: Any
    proved: bool


@cache
def scene(key: Key) -> Problem:
    """The scene of a key; its drift is made once, and keeps what has been analysed of it."""
    problem = BY_NAME[key[1]] if key[0] == "table" else random_scene(int(key[1]), int(key[2]))
    return replace(problem, make=cache(problem.make))


def asked_of(engine: ModuleType, problem: Problem, quantity: str) -> Any:
    """A quantity of one of the engines that answer digits, as a function of dps."""
    if quantity == "1-C":
        numbers = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
        return partial(engine.exit_probability, problem.make(), *numbers, complement=True)
    return problem.engine_questions(engine)[quantity]


def provable(problem: Problem) -> bool:
    """True if a proof takes well below a second: not too weak noise, nothing narrow."""
    hard = {"slow", "narrow", "extreme", "stiff", "refused"}
    return (
        balls.available()
        and Fraction(problem.kappa) >= Fraction(1, 10)
        and not (problem.tags & hard)
    )


def reference(problem: Problem, quantity: str) -> Reference:
    """A proved ball where one is had in time, else the value to 60 digits."""
    known = _known.get((problem.name, quantity))
    if known is None:
        known = _fresh(problem, quantity)
        _known[problem.name, quantity] = known
    return known


def forget() -> None:
    """Ask again from now on."""
    _known.clear()
    scene.cache_clear()


def _fresh(problem: Problem, quantity: str) -> Reference:
    """The reference, worked out anew."""
    if provable(problem):
        try:
            enclosure = asked_of(ball_sweep, problem, quantity)(_DPS)
            return Reference(*balls.to_mpf(enclosure, _DPS + 15), True)
        except sa.AccuracyError:
            pass
    value = problem.questions()[quantity](dps=_DPS + 15)
    with own_context(_DPS) as context:
        radius = abs(context.make_mpf(value._mpf_)) * context.mpf(10) ** -(_DPS + 10)
    return Reference(value, radius, False)
