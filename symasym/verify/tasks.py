"""What is verified at which level, cut into pieces that any process can take."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from symasym.problems import PROBLEMS, Problem
from symasym.verify import claims, exact_checks, formulas, identities, limits, orders
from symasym.verify.findings import Finding
from symasym.verify.references import Key, scene

#: Random scenes of each level.
SCENES = {"quick": 9, "full": 140}


class Task(NamedTuple):
    """A check and its scene or family; small, so that it travels between processes."""

    check: str
    key: Key


class Done(NamedTuple):
    """What a task found, and the processor time it took."""

    task: Task
    findings: list[Finding]
    seconds: float


_OF_SCENES: dict[str, Callable[[Problem, bool], Iterator[Finding]]] = {
    "quadrature": exact_checks.quadrature,
    "accuracy": exact_checks.accuracy,
    "honesty": claims.honesty,
    "arrays": claims.arrays,
    "sums": identities.sums,
    "symmetries": identities.symmetries,
    "equations": identities.equations,
}
_OF_FAMILIES: dict[str, tuple[Callable[[str, bool], Iterator[Finding]], tuple[str, ...]]] = {
    "orders": (orders.order, tuple(orders.BY_NAME)),
    "strong limit": (limits.strong, tuple(limits.DRIFTS)),
    "weak limit": (limits.weak, tuple(limits.DRIFTS)),
    "far limit": (limits.far, tuple(limits.DRIFTS)),
    "pieces": (formulas.pieces, formulas.EXACT),
    "leading": (formulas.leading, formulas.LEADING),
}


def tasks(level: str, seed: int) -> list[Task]:
    """Every task of a level, those that take long first."""
    full = level == "full"
    keys: list[Key] = [("random", str(seed), str(k)) for k in range(SCENES[level])]
    keys += [("table", p.name) for p in PROBLEMS if full or not p.tags & _LONG]
    asked = [
        Task(check, key)
        for check in _OF_SCENES
        for key in keys
        if _applies(check, scene(key), full)
    ]
    asked += [
        Task(check, (name,))
        for check, (_, names) in _OF_FAMILIES.items()
        for name in names
        if full or name not in _DEAR
    ]
    return sorted(asked, key=_rank)


_LONG = {"slow", "may refuse", "narrow"}
# Differences and exponents take digits without end there.
# Families that take seconds each, of what quick tests on others too.
_DEAR = {"well", "behind the barrier", "tanh sliding"}
_POLYNOMIAL = {"friction", "linear", "polynomial"}
_STIFF = {"stiff", "extreme", "narrow", "refused", "slow", "may refuse"}


def _applies(check: str, problem: Problem, full: bool) -> bool:
    tags = problem.tags
    if check == "quadrature":
        return "witness" in tags
    if check in ("equations", "symmetries"):
        return not tags & _STIFF and (full or "moderate" in tags)
    if not full and tags & {"extreme"}:
        return False
    dear = check in ("honesty", "arrays", "equations") and not tags & _POLYNOMIAL
    if not full and (dear or (check == "honesty" and tags & {"fold", "kink"})):
        return False
    if check in ("arrays", "honesty"):
        return not tags & (_STIFF if not full else {"refused", "may refuse", "slow"})
    return check != "sums" or not tags & {"refused", "may refuse", "slow"}


def _rank(task: Task) -> int:
    order = ("quadrature", "leading", "orders", "pieces", "honesty", "equations", "accuracy")
    return order.index(task.check) if task.check in order else len(order)


def run_task(task: Task, full: bool) -> Done:
    """All findings of a task; whatever is raised is one of them."""
    began = time.process_time()
    found: list[Finding] = []
    try:
        if task.check in _OF_SCENES:
            run: Any = _OF_SCENES[task.check](scene(task.key), full)
        else:
            run = _OF_FAMILIES[task.check][0](task.key[0], full)
        found.extend(run)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        told = f"{type(error).__name__}: {error} ({last.name}, line {last.lineno})"
        where = " ".join(task.key)
        found.append(Finding(task.check, "", "runs", float("inf"), where, told))
    return Done(task, found, time.process_time() - began)
