"""The exact integrals: float64, digits and balls against quadrature and each other, and what holds
exactly of them: sums, symmetries, differential equations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.base.call_context import own_context
from symasym.exact.floats import TOLERANCE
from symasym.workshop.problems import Problem, question
from symasym.workshop.verify.findings import (
    Field,
    Finding,
    Reference,
    compared,
    distance,
    failed,
    label,
    logarithm,
    reference,
    relative,
)

if TYPE_CHECKING:
    from mpmath import mpf


_LARGEST = 700.0
_DPS = 30


def quadrature(problem: Problem, full: bool) -> Iterator[Finding]:
    """Balls and float64 against plain quadrature of the printed integrals."""
    dps = 20 if full else 10
    asked = problem.by_quadrature()
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
        ask_exact = problem.questions()[quantity]
        gap = relative(ask_exact(dps=dps + 5), wanted)
        yield compared(label(quantity), "digits", "quadrature", gap, allowed, where)
        log = logarithm(wanted)
        value = ask_exact(log=True)
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
    """A pass where the table allows a refusal, a failure elsewhere."""
    name = {"floats": "float64", "arrays": "float64 arrays", "claims": "float64"}
    evaluator = name.get(evaluator, evaluator)
    if problem.tags & {"may refuse", "refused"}:
        return Finding(label(quantity), evaluator, check, None, where)
    return failed(label(quantity), evaluator, check, where, error)


def _digits(
    problem: Problem, quantity: str, ask: Callable[..., Any], known: Reference, where: str
) -> Iterator[Finding]:
    """Findings on the value to 30 digits and its logarithm."""
    allowed = Fraction(1, 10**_DPS)
    radius = float(known.radius / abs(known.value)) if known.value else 0.0
    value = ask(dps=_DPS)
    gap = relative(value, known.value)
    yield compared(label(quantity), "digits", "accuracy", gap, float(allowed) + radius, where)
    value = ask(dps=_DPS, log=True)
    wanted = logarithm(known.value, 80)
    room = float(allowed) * max(abs(float(wanted)), 0.0) + radius
    yield compared(label(quantity), "digits", "logarithm", distance(value, wanted), room, where)


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
    yield compared(label(quantity), "float64 arrays", "stated error", gap, allowed, where)


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
        yield compared(
            label(quantity), name, "stated error", gap, _sum(estimate.error, room), where
        )


def _sum(a: mpf | float, b: mpf | float) -> Any:
    """a + b as an mpf."""
    from mpmath import mpf

    return mpf(getattr(a, "_mpf_", a)) + mpf(getattr(b, "_mpf_", b))


#: Where an exponent or a cancellation takes more digits than these, nothing is asked.
_MOST_DIGITS = 900
# Second derivatives jump at the layer's edges, so that differences there are of first order.
_STEP = Fraction(1, 10**15)
_RESIDUAL = 1e-12


def sums(problem: Problem, full: bool) -> Iterator[Finding]:
    """C and the exit through +r add up to 1, and so do P and 1 - P."""
    asked = problem.questions()
    for one, other in (("C", "1-C"), ("P", "1-P")):
        if one not in asked:
            continue
        where = f"{problem.name}, {one} + ({other})"
        pair = [asked[name](dps=_DPS) for name in (one, other)]
        with own_context(_DPS + 20) as mp:
            total = sum((mp.convert(x) for x in pair), mp.zero)
            gap = abs(total - 1)
            yield compared(label(one), "digits", "sum is 1", gap, mp.mpf(10) ** -_DPS, where)
            # e^log of what may be below float64's range, in a context that has no such end.
            logs = [mp.mpf(asked[name](log=True)) for name in (one, other)]
            gap = abs(sum((mp.exp(x) for x in logs), mp.zero) - 1)
            yield compared(label(one), "float64", "sum is 1", gap, 2e-12, where)


def symmetries(problem: Problem, full: bool) -> Iterator[Finding]:
    """u -> -u, and four times the drift with twice the noise, which is four times the speed."""
    drift = problem.make()
    kappa, r, start = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
    for name, other, scene, factor in (
        ("reflection", _changed(drift, -1, -1), (kappa, r, -start), 1),
        ("scaling", _changed(drift, 4, 1), (2 * kappa, r, start), 4),
    ):
        mirrored = "1-C" if name == "reflection" else "C"
        pairs: list[tuple[str, Callable[..., Any], Callable[..., Any]]] = [
            ("T", question("T", drift, kappa, r, start), question("T", other, *scene)),
            ("C", question("C", drift, kappa, r, start), question(mirrored, other, *scene)),
        ]
        if problem.slides:
            pairs.append(("1-P", question("1-P", drift, kappa), question("1-P", other, scene[0])))
        for quantity, own, changed in pairs:
            where = f"{problem.name}, {quantity}"
            times = factor if quantity == "T" else 1
            with own_context(_DPS + 20) as mp:
                here, there = (mp.convert(ask(dps=_DPS)) for ask in (own, changed))
                gap = relative(there * times, here)
                yield compared(label(quantity), "digits", name, gap, 2.1 * 10.0**-_DPS, where)
                logs = [mp.mpf(ask(log=True)) for ask in (own, changed)]
                room = 2e-12 * max(1.0, abs(float(logs[0])))
                gap = abs(logs[1] + mp.log(times) - logs[0])
                yield compared(label(quantity), "float64", name, gap, room, where)


def _changed(drift: sa.Drift, factor: int, side: int) -> sa.Drift:
    """factor A(side u)."""
    known = drift.exact_coefficients()
    if known is not None:
        return sa.polynomial(*[factor * side**k * c for k, c in enumerate(known)])
    import sympy

    u = sympy.Symbol("u", real=True)
    return sa.Drift(factor * drift.expression().subs(u, side * u), u)


# -- differential equations ------------------------------------------------------------------------


def equations(problem: Problem, full: bool) -> Iterator[Finding]:
    """T and C solve the backward equation; the Wronskian of C and 1 - C is Abel's."""
    drift = problem.make()
    kappa, r, start = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
    x, h = _with_step(problem, start)
    right_sides = {"T": -1, "C": 0, "1-C": 0}
    asked = {
        name: lambda u, n, name=name: question(name, drift, kappa, r, u)(dps=n)
        for name in right_sides
    }
    for quantity, right_side in right_sides.items():
        residual = _residual(asked[quantity], drift, kappa, x, h, right_side)
        where = f"{problem.name}, {quantity}"
        if residual is None:
            yield Finding(label(quantity), "digits", "backward equation", None, where)
        else:
            yield compared(
                label(quantity), "digits", "backward equation", residual, _RESIDUAL, where
            )
    yield from _abel(problem, drift, asked["C"], asked["1-C"])


def _with_step(problem: Problem, start: Fraction) -> tuple[Fraction, Fraction]:
    """The start, and a step much shorter than anything there."""
    drift = problem.make()
    room = Fraction(problem.r) - abs(start)
    steep = max(abs(drift(float(u) / 50)) for u in range(-50, 51))
    rate = Fraction(2 * steep) / Fraction(problem.kappa) ** 2
    return start, _STEP / (1 / room + rate + 100)


def _residual(
    ask: Callable[[Fraction, int], Any],
    drift: sa.Drift,
    kappa: Fraction,
    x: Fraction,
    h: Fraction,
    right_side: int,
) -> Any:
    """(kappa^2/2) f'' + phi f' - right side, over the size of its terms; None if out of reach."""
    dps = 100
    while dps <= _MOST_DIGITS:
        values = [ask(u, dps) for u in (x - h, x, x + h)]
        with own_context(dps + 20) as mp:
            low, middle, high = (mp.convert(v) for v in values)
            step, noise = mp.convert(h), mp.convert(kappa * kappa / 2)
            bend = noise * (high - 2 * middle + low) / step**2
            push = Field(drift, mp).phi(x) * (high - low) / (2 * step)
            size = abs(bend) + abs(push) + abs(right_side)
            lost = noise * max(abs(low), abs(high)) / step**2 * mp.mpf(10) ** -dps
            if lost < size * mp.mpf(10) ** -15:
                return abs(bend + push - right_side) / size
        dps *= 3
    return None


def _abel(
    problem: Problem, drift: sa.Drift, below: Callable[..., Any], above: Callable[..., Any]
) -> Iterator[Finding]:
    """W = C (1 - C)' - C' (1 - C) grows like e^{lam V} from point to point."""
    kappa, r = Fraction(problem.kappa), Fraction(problem.r)
    reach = min(r, Fraction(3, 2))
    points = [reach * Fraction(k, 7) for k in (-3, 2)]
    where = f"{problem.name}, at u = {float(points[0]):.3g} and {float(points[1]):.3g}"
    h = min(_with_step(problem, u)[1] for u in points)
    # 900 digits of other drifts take minutes.
    most = _MOST_DIGITS if drift.exact_coefficients() is not None else 300
    wronskians = [_wronskian(below, above, u, h, most) for u in points]
    if None in wronskians:
        yield Finding("eq:C", "digits", "Wronskian", None, where)
        return
    with own_context(60) as mp:
        # Both points are inside the layer.
        wanted = mp.exp(mp.convert(2 / kappa**2) * Field(drift, mp).rise(*points))
        one, other = (mp.convert(w) for w in wronskians)
        gap = abs(other / one / wanted - 1)
        yield compared("eq:C", "digits", "Wronskian", gap, _RESIDUAL, where)


def _wronskian(
    below: Callable[..., Any], above: Callable[..., Any], u: Fraction, h: Fraction, most: int
) -> Any:
    """C (1 - C)' - C' (1 - C) at `u`, by differences; None if out of reach."""
    dps = 100
    while dps <= most:
        values = [[ask(x, dps) for x in (u - h, u, u + h)] for ask in (below, above)]
        with own_context(dps + 20) as mp:
            C, D = ([mp.convert(v) for v in row] for row in values)
            step = mp.convert(2 * h)
            slopes = [(row[2] - row[0]) / step for row in (C, D)]
            value = C[1] * slopes[1] - slopes[0] * D[1]
            lost = max(C[1], D[1]) * mp.mpf(10) ** -dps / step
            if lost < abs(value) * mp.mpf(10) ** -15:
                return value
        dps *= 3
    return None
