"""What the symbols of a formula are for a bound drift, enclosed in balls."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.drift.drift import Drift
from symasym.expansions.balls import doubled
from symasym.expansions.field import LINE, RING, Field, Unresolved
from symasym.series.local import finite_parts_in_s

_DIGITS = 50


def numbers_of(symbols: Iterable[Symbol], drift: Drift, start: Fraction) -> dict[Symbol, Expr]:
    """Those of the symbols named as u1, V(u1), phi(1) or R1+, to 50 digits."""
    named = list(symbols)

    def found(bits: int) -> dict[Symbol, Expr]:
        of = Field(drift, LINE._replace(start=start))
        places: dict[str, Any] = {f"u{k}": u for k, (u, _) in enumerate(of.zeros, 1)}
        places |= {"1": arb(1), "-1": arb(-1)}
        known = {f"V({name})": of.height(u) for name, u in places.items()} | places
        known |= {f"phi({side})": of.ends[side] for side in (-1, 1)}
        if parts := [int(s.name[1:-1]) for s in named if re.fullmatch(r"R\d+[-+]", s.name)]:
            # Within the layer, and of u as the variable also where the start is a zero.
            count, more = max(parts), [0] * max(parts)
            if of.on_zero:
                more = finite_parts_in_s(of.around(of.x, 2 * count + 1)[0], count, RING)
            for side, row in zip((-1, 1), of.regular(count), strict=True):
                row[0] -= 1 / of.ends[side]
                known |= {f"R{k}{' +-'[side]}": row[k - 1] - side * more[k - 1] for k in parts}
        return {s: _number(known[s.name]) for s in named if s.name in known}

    numbers: dict[Symbol, Expr] = doubled(found, 256)
    return numbers


def _number(x: Any) -> Expr:
    if x.rel_accuracy_bits() < 3.33 * _DIGITS and not abs(x) < 1e-60:
        raise Unresolved
    return sympy.Float(x.mid().str(_DIGITS + 10, radius=False, more=True), _DIGITS)
