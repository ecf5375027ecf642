"""What the symbols of a formula are for a bound drift, enclosed in balls."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from fractions import Fraction
from typing import Any, TypeVar

import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.base.balls import exact_ball, precision
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.expansions.balls import RING, Field, Unresolved
from symasym.series.local import finite_parts_in_s

_T = TypeVar("_T")
_DIGITS, _STEPS = 50, 5


def places_of(drift: Drift, start: Fraction) -> list[tuple[float, str]]:
    """The kinks, wells, barriers and the start of a bound drift, left to right."""
    return _resolved(drift, start, lambda of: [(float(u), kind) for u, kind in of.places[1:-1]])


def numbers_of(symbols: Iterable[Symbol], drift: Drift, start: Fraction) -> dict[Symbol, Expr]:
    """Those of the symbols named as u1, V(u1), phi(1) or R1+, to 50 digits."""
    named = list(symbols)
    return _resolved(drift, start, lambda field: _found(named, field))


def _resolved(drift: Drift, start: Fraction, find: Callable[[Field], _T]) -> _T:
    """What is found of the drift, with so many bits that its zeros are apart."""
    for step in range(_STEPS):
        with suppress(Unresolved), precision(256 << step):
            return find(Field(drift, abs(start) + 2, start))
    raise AccuracyError(f"the zeros of {drift!r} are too close together; use method='exact'.")


def _found(symbols: list[Symbol], field: Field) -> dict[Symbol, Expr]:
    """The same at flint's precision."""
    places: dict[str, Any] = {f"u{k}": u for k, (u, _) in enumerate(field.zeros, 1)}
    places |= {"1": arb(1), "-1": arb(-1)}
    found = {f"V({name})": field.height(u) for name, u in places.items()} | places
    found |= {f"phi({side})": field.a[side] for side in (-1, 1)}
    if parts := [int(s.name[1:-1]) for s in symbols if re.fullmatch(r"R\d+[-+]", s.name)]:
        # Within the layer, and of u as the variable also where the start is a zero.
        count, more = max(parts), [0] * max(parts)
        if field.on_zero:
            more = finite_parts_in_s(field.taylor(field.x, 2 * count + 1), count, RING)
        for side, row in zip((-1, 1), field.regular(count), strict=True):
            x, one = side * field.start, Fraction(1)
            row[0] -= exact_ball(field.r - max(x, one)) / field.a[side]
            row[0] -= exact_ball(max(-x, one) - one) / field.a[-side]
            found |= {f"R{k}{' +-'[side]}": row[k - 1] - side * more[k - 1] for k in parts}
    return {s: _number(found[s.name]) for s in symbols if s.name in found}


def _number(x: Any) -> Expr:
    if x.rel_accuracy_bits() < 3.33 * _DIGITS and not abs(x) < 1e-60:
        raise Unresolved
    return sympy.Float(x.mid().str(_DIGITS + 10, radius=False, more=True), _DIGITS)
