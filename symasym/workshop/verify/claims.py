"""Every method with an error statement: what it claims is not below what is true."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.workshop.problems import Problem
from symasym.workshop.verify.findings import (
    LABELS,
    Finding,
    Reference,
    compared,
    distance,
    failed,
    logarithm,
    reference,
)

if TYPE_CHECKING:
    from symasym.base.estimate import Estimate


_PAPER = {"T": "eq:Ttildesmall", "C": "C-bound", "1-C": "C-bound"}
_QUICK: dict[str, list[dict[str, Any]]] = {
    "laplace": [{"order": n} for n in (0, 3)],
    "strong_noise": [{"order": n} for n in (0, 4)],
    "uniform": [{"order": n} for n in (0, 3)],
    "bound": [{}],
    "paper": [{}],
    "auto": [{"rtol": "1e-3"}],
}
_FULL: dict[str, list[dict[str, Any]]] = _QUICK | {
    "laplace": [{"order": n} for n in (0, 1, 2, 5, "optimal")],
    "strong_noise": [{"order": n} for n in (0, 1, 2, 8, 20)],
    "uniform": [{"order": n} for n in (0, 1, 2, 5)],
    "auto": [{"rtol": f"1e-{n}"} for n in (1, 6, 20)],
}
_WAYS: list[dict[str, Any]] = [{"dps": 25}, {"log": True}, {"dps": 25, "log": True}, {}]
_COMMON = {"laplace", "strong_noise", "paper", "auto"}
_HAVE = {"T": _COMMON | {"uniform"}, "P": _COMMON, "1-P": _COMMON}
_HAVE["C"] = _HAVE["1-C"] = _COMMON | {"bound"}


def stated_error(problem: Problem, full: bool) -> Iterator[Finding]:
    """The stated errors of all methods and orders on a scene."""
    asked = problem.questions()
    turn = count(sum(map(ord, problem.name)))
    for quantity in LABELS:
        if quantity not in asked:
            continue
        try:
            known = reference(problem, quantity)
        except sa.SymasymError:
            continue  # `accuracy` says what that means
        # Drifts that are no polynomials cost several times as much.
        every = full and problem.make().exact_coefficients() is not None
        for method, settings in (_FULL if every else _QUICK).items():
            if method not in _HAVE[quantity]:
                continue
            for setting in settings:
                # The first, and the others in turn: there are many scenes.
                ways = [_WAYS[0], _WAYS[1 + next(turn) % 3]] if every else _WAYS[:1]
                yield from _claimed(problem, quantity, method, setting, known, ways)


def _claimed(
    problem: Problem,
    quantity: str,
    method: str,
    setting: dict[str, Any],
    known: Reference,
    ways: list[dict[str, Any]],
) -> Iterator[Finding]:
    """Findings on a method's stated error, in each way of asking."""
    formula = _paper_label(problem, quantity) if method == "paper" else LABELS[quantity]
    shown = "".join(f", {name} {value}" for name, value in setting.items())
    ask = problem.questions()[quantity]
    for way in ways:
        suffix = "".join(f", {name}" for name in way if name == "log")
        where = f"{problem.name}, {quantity}{shown}{suffix}"
        if "rtol" in setting and float(setting["rtol"]) < 1e-12 and "dps" not in way:
            continue
        try:
            estimate = ask(method=method, full=True, **setting, **way)
        except sa.RangeError:
            continue
        except sa.SymasymError:
            yield Finding(formula, method, "stated error", None, where)
            continue
        except Exception as error:  # anything else is a defect, and reported as one
            yield failed(formula, method, "stated error", where, error)
            continue
        yield from _judged(formula, method, estimate, way, setting, known, where)


def _paper_label(problem: Problem, quantity: str) -> str:
    """The paper's formula of a quantity on a scene."""
    if quantity in _PAPER:
        return _PAPER[quantity]
    return "eq:Plarge2" if Fraction(problem.kappa) > 1 else "L-bound"


def _judged(
    formula: str,
    method: str,
    estimate: Estimate,
    way: dict[str, Any],
    setting: dict[str, Any],
    known: Reference,
    where: str,
) -> Iterator[Finding]:
    """Findings on one value: its distance from the truth over what it claims."""
    if estimate.error_kind == "none":
        # Nothing is claimed; that this is said is all there is to check here.
        size = 0.0 if estimate.error is None else float("inf")
        yield Finding(formula, method, "claims nothing", size, where)
        return
    from mpmath import mpf

    log = "log" in way
    wanted = logarithm(known.value, 80) if log else known.value
    unsure = known.radius / abs(known.value) if log else known.radius
    gap = distance(estimate.value, wanted)
    error = mpf(getattr(estimate.error, "_mpf_", estimate.error))
    kind = "bound" if estimate.error_kind == "bound" else "estimate"
    yield compared(formula, method, f"stated error ({kind})", gap, error + unsure, where)
    if "rtol" in setting:
        value = abs(mpf(getattr(estimate.value, "_mpf_", estimate.value)))
        # A logarithm is rounded to float64, or to its digits, whatever is asked for.
        room = value * (2.0**-52 if "dps" not in way else 1e-23) if log else 0
        size = error if log else error / value
        yield compared(formula, method, "within rtol", size, mpf(setting["rtol"]) + room, where)


def arrays(problem: Problem, full: bool) -> Iterator[Finding]:
    """The same of arrays, whose expansions are evaluated by other code."""
    base = float(Fraction(problem.kappa))
    kappas = np.array([base, base / 2])
    asked = Problem(**{**vars(problem), "kappa": kappas}).questions()
    moved = [Problem(**{**vars(problem), "kappa": str(Fraction(kappa))}) for kappa in kappas]

    @cache
    def exact(quantity: str) -> list[Any]:
        """log of the quantity at both kappas, to 25 digits."""
        return [p.questions()[quantity](dps=25, log=True) for p in moved]

    for quantity in LABELS:
        for method in ("laplace", "uniform", "strong_noise", "bound"):
            if quantity not in asked or method not in _HAVE[quantity]:
                continue
            order = {} if method == "bound" else {"order": 3}
            where = f"{problem.name}, {quantity}, array of two kappas"
            try:
                estimates = asked[quantity](method=method, log=True, full=True, **order)
            except sa.SymasymError:
                yield Finding(LABELS[quantity], method, "stated errors of arrays", None, where)
                continue
            except Exception as error:
                yield failed(LABELS[quantity], method, "stated errors of arrays", where, error)
                continue
            each = zip(estimates.value, estimates.error, exact(quantity), strict=True)
            for value, stated, wanted in each:
                gap = distance(float(value), wanted)
                allowed = float(stated) + abs(float(value)) * 2.3e-16
                yield compared(
                    LABELS[quantity], method, "stated errors of arrays", gap, allowed, where
                )
