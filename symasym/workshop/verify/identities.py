"""Identities that hold whatever the drift: they need no other evaluation of the integrals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import symasym as sa
from symasym.base.contexts import own_context
from symasym.workshop.comparing import relative
from symasym.workshop.problems import Problem
from symasym.workshop.verify.field import Field
from symasym.workshop.verify.findings import Finding, compared, label

_DPS = 30
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
        swap = name == "reflection"
        pairs: list[tuple[str, Callable[..., Any], Callable[..., Any]]] = [
            ("T", _time(drift, (kappa, r, start)), _time(other, scene)),
            ("C", _exit(drift, (kappa, r, start), False), _exit(other, scene, swap)),
        ]
        if problem.slides:
            pairs.append(("1-P", _outside(drift, kappa), _outside(other, scene[0])))
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


def _time(drift: sa.Drift, scene: tuple[Any, Any, Any]) -> Callable[..., Any]:
    """T of a scene as a function of the options."""
    kappa, r, start = scene
    return lambda **o: sa.escape_time(drift, kappa, r, start=start, **o)


def _exit(drift: sa.Drift, scene: tuple[Any, Any, Any], other: bool) -> Callable[..., Any]:
    """C of a scene, or 1 - C, as a function of the options."""
    kappa, r, start = scene
    return lambda **o: sa.exit_probability(drift, kappa, r, start=start, complement=other, **o)


def _outside(drift: sa.Drift, kappa: Fraction) -> Callable[..., Any]:
    """1 - P as a function of the options."""
    return lambda **o: sa.occupation(drift, kappa, complement=True, **o)


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
    asked = {
        "T": lambda u, n: sa.escape_time(drift, kappa, r, start=u, dps=n),
        "C": lambda u, n: sa.exit_probability(drift, kappa, r, start=u, dps=n),
        "1-C": lambda u, n: sa.exit_probability(drift, kappa, r, start=u, complement=True, dps=n),
    }
    for quantity, right_side in (("T", -1), ("C", 0), ("1-C", 0)):
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
