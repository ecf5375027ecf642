"""The exact integrals: float64, digits and balls against quadrature and each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.exact import ball_sweep
from symasym.exact import digits as arbitrary
from symasym.methods.exact import TOLERANCE
from symasym.numbers import balls
from symasym.workshop import reference_quadrature
from symasym.workshop.comparing import distance, logarithm, relative
from symasym.workshop.problems import Problem
from symasym.workshop.verify.findings import Finding, compared, failed, label
from symasym.workshop.verify.references import Reference, asked_of, provable, reference

if TYPE_CHECKING:
    from mpmath import mpf


_LARGEST = 700.0
_DPS = 30


def quadrature(problem: Problem, full: bool) -> Iterator[Finding]:
    """Every engine against plain quadrature of the printed integrals."""
    dps = 20 if full else 10
    asked = problem.engine_questions(reference_quadrature)
    if not full:
        asked = {name: asked[name] for name in ("T", "1-P" if problem.slides else "C")}
    for quantity, ask in asked.items():
        where = f"{problem.name}, {quantity}"
        try:
            wanted = ask(dps)
        except sa.AccuracyError:
            # More panels than quadrature should be asked for.
            yield Finding(label(quantity), "quadrature", "accuracy", None, where)
            continue
        allowed = 10.0**-dps
        for name, engine in (("digits", arbitrary), ("ball", ball_sweep)):
            if name == "ball" and not provable(problem):
                continue
            value = asked_of(engine, problem, quantity)(dps + 5)
            if name == "ball":
                value = balls.to_mpf(value, dps + 10)[0]
            yield compared(
                label(quantity), name, "quadrature", relative(value, wanted), allowed, where
            )
        log = logarithm(wanted)
        value = problem.questions()[quantity](log=True)
        room = allowed + TOLERANCE * max(1.0, abs(float(log)))
        yield compared(label(quantity), "float64", "quadrature", distance(value, log), room, where)


def accuracy(problem: Problem, full: bool) -> Iterator[Finding]:
    """Digits, float64 and the errors they claim, against the reference."""
    try:
        asked = problem.questions()
    except sa.SymasymError as error:
        # A drift that is refused when it is made.
        yield _refusal(problem, "T", "digits", "accuracy", problem.name, error)
        return
    for quantity, ask in asked.items():
        if not full and quantity in ("1-C", "P", "p(-5/2)"):
            continue
        where = f"{problem.name}, {quantity}"
        try:
            known = reference(problem, quantity)
        except sa.SymasymError as error:
            yield _refusal(problem, quantity, "digits", "accuracy", where, error)
            continue
        for check in (_digits, _floats, _arrays, _claims):
            try:
                yield from check(problem, quantity, ask, known, where)
            except sa.SymasymError as error:
                yield _refusal(problem, quantity, check.__name__[1:], "accuracy", where, error)


def _refusal(
    problem: Problem, quantity: str, evaluator: str, check: str, where: str, error: Exception
) -> Finding:
    """Refusing is honest where the table says so, and a failure elsewhere."""
    name = {"floats": "float64", "arrays": "float64 arrays", "claims": "float64"}
    evaluator = name.get(evaluator, evaluator)
    if problem.tags & {"may refuse", "refused"}:
        return Finding(label(quantity), evaluator, check, None, where)
    return failed(label(quantity), evaluator, check, where, error)


def _digits(
    problem: Problem, quantity: str, ask: Callable[..., Any], known: Reference, where: str
) -> Iterator[Finding]:
    """Findings on the value to 30 digits, its logarithm, and the engine without balls."""
    allowed = Fraction(1, 10**_DPS)
    radius = float(known.radius / abs(known.value)) if known.value else 0.0
    value = ask(dps=_DPS)
    gap = relative(value, known.value)
    yield compared(label(quantity), "digits", "accuracy", gap, float(allowed) + radius, where)
    value = ask(dps=_DPS, log=True)
    wanted = logarithm(known.value, 80)
    room = float(allowed) * max(abs(float(wanted)), 0.0) + radius
    yield compared(label(quantity), "digits", "logarithm", distance(value, wanted), room, where)
    if known.proved:
        # The reference is the ball; the engine without balls must lie in it.
        own = asked_of(arbitrary, problem, quantity)(_DPS)
        gap = relative(own, known.value)
        yield compared(label(quantity), "digits", "ball", gap, float(allowed) + radius, where)


def _floats(
    problem: Problem, quantity: str, ask: Callable[..., Any], known: Reference, where: str
) -> Iterator[Finding]:
    """Findings on the value in float64 and its logarithm."""
    log = logarithm(known.value)
    allowed = TOLERANCE * max(1.0, abs(float(log)))
    gap = distance(ask(log=True), log)
    yield compared(label(quantity), "float64", "accuracy", gap, allowed, where)
    if abs(float(log)) < _LARGEST:
        gap = relative(ask(), known.value)
        yield compared(label(quantity), "float64", "accuracy", gap, allowed, where)


def _arrays(
    problem: Problem, quantity: str, ask: Callable[..., Any], known: Reference, where: str
) -> Iterator[Finding]:
    """Float64 inputs, so that the reference is that of the floats themselves."""
    kappa = float(Fraction(problem.kappa))
    moved = Problem(**{**vars(problem), "kappa": str(Fraction(kappa))})
    wanted = moved.questions()[quantity](dps=25, log=True)
    array = Problem(**{**vars(problem), "kappa": np.array([kappa])})
    estimate = array.questions()[quantity](log=True, full=True)
    value, error = float(estimate.value[0]), float(estimate.error[0])
    gap = distance(value, wanted)
    allowed = TOLERANCE * max(1.0, abs(float(wanted)))
    yield compared(label(quantity), "float64 arrays", "accuracy", gap, allowed, where)
    # The last digit of the float64 that is returned is not part of the analysis.
    allowed = error + math.ulp(value)
    yield compared(label(quantity), "float64 arrays", "honesty", gap, allowed, where)


def _claims(
    problem: Problem, quantity: str, ask: Callable[..., Any], known: Reference, where: str
) -> Iterator[Finding]:
    """The errors that `full=True` states."""
    log = logarithm(known.value, 80)
    radius = known.radius / abs(known.value) if known.value else known.radius
    asked: list[tuple[dict[str, Any], Any, Any]] = [
        ({"dps": 20}, known.value, known.radius),
        ({"log": True}, log, radius),
    ]
    for options, wanted, room in asked:
        estimate = ask(full=True, **options)
        name = "ball" if estimate.error_kind == "bound" else "digits"
        if "dps" not in options:
            name = "float64"
        gap = distance(estimate.value, wanted)
        yield compared(label(quantity), name, "honesty", gap, _sum(estimate.error, room), where)


def _sum(a: mpf | float, b: mpf | float) -> Any:
    """a + b as an mpf."""
    from mpmath import mpf

    return mpf(getattr(a, "_mpf_", a)) + mpf(getattr(b, "_mpf_", b))
