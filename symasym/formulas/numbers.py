"""What the symbols of a formula are for a bound drift: critical points, heights and finite parts."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Symbol

from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.expansions.balls import RING, Field, Unresolved
from symasym.numbers.balls import exact_ball, precision
from symasym.series.local import finite_parts_in_s

#: Digits that are right in what the numbers make up; they themselves have more.
DIGITS = 32
_OWN, _STEPS = 50, 5


def numbers_of(symbols: Iterable[Symbol], drift: Drift, start: Fraction) -> dict[Symbol, Expr]:
    """Those of the symbols named as u1, V(u1), phi(1) or R1+, to 50 digits."""
    for step in range(_STEPS):
        with suppress(Unresolved), precision(256 << step):
            return _found(list(symbols), Field(drift, abs(start) + 2, start))
    raise AccuracyError(
        f"the zeros of {drift!r} are too close together for {_OWN} digits; use method='exact'."
    )


def _found(symbols: list[Symbol], field: Field) -> dict[Symbol, Expr]:
    """The same at flint's precision."""
    places: dict[str, Any] = {f"u{k}": u for k, (u, _) in enumerate(field.zeros, 1)}
    found = dict(places)
    for name in [s.name for s in symbols]:
        head, _, place = name.rstrip(")").partition("(")
        if place and place not in places and re.fullmatch(r"-?\d+(/\d+)?", place):
            places[place] = exact_ball(Fraction(place))
        if head == "V" and place in places:
            found[name] = field.height(places[place])
        elif head == "phi":
            found[name] = field.a[int(place)]
    if parts := [s.name for s in symbols if re.fullmatch(r"R\d+[-+]", s.name)]:
        regular = _inside(field, max(int(name[1:-1]) for name in parts))
        found |= {name: regular[name[-1]][int(name[1:-1]) - 1] for name in parts}
    return {s: _number(found[s.name]) for s in symbols if s.name in found}


def _inside(field: Field, count: int) -> dict[str, list[Any]]:
    """The finite parts within the layer, of u as the variable also where the start is a zero."""
    found = {}
    for side, mark, row in zip((-1, 1), "-+", field.regular(count), strict=True):
        x = side * field.start
        row[0] -= exact_ball(field.r - max(x, 1)) / field.a[side]
        row[0] -= exact_ball(max(-x - 1, 0)) / field.a[-side]
        if field.on_zero:
            more = finite_parts_in_s(field.taylor(field.x, 2 * count + 1), count, RING)
            row = [a - side * b for a, b in zip(row, more, strict=True)]
        found[mark] = row
    return found


def _number(x: Any) -> Expr:
    if x.rel_accuracy_bits() < 3.33 * _OWN and not abs(x) < 1e-60:
        raise Unresolved
    return sympy.Float(x.mid().str(_OWN + 10, radius=False, more=True), _OWN)
