"""Classifies a drift with numerical parameters by the order of its wells and barriers.

The form of an expansion depends on the parameters only by the simple zeros of A in (-1, 1) and
the position of the start among them; wells, where A' < 0, and barriers, where A' > 0, alternate.
A case lists these words from left to right, such as ``"start well barrier"``, or ``"start=well
barrier"`` if the start is a well. The symbols of a formula are evaluated in ball arithmetic.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.base.balls import Unresolved, doubled
from symasym.base.errors import InputError, SymasymError
from symasym.base.inputs import shown
from symasym.drift.drift import Drift
from symasym.expansions.ball_drift import LINE, RING, BallDrift
from symasym.series import finite_parts_in_s

U = Symbol("u", real=True)
# The number of random parameter sets, of points u at which the signs of A are compared, and of
# sets classified for each pattern of signs; the digits of numbers.
_TRIED, _POINTS, _LOOKED_INTO, _DIGITS = 4_000, 400, 8, 50


@dataclass(frozen=True)
class Case:
    """Wells, barriers and the start as words from left to right; `example` has parameters."""

    words: tuple[str, ...]
    example: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The wells and barriers other than the start, from left to right."""
        return tuple(word for word in self.words if word[:5] != "start")

    @property
    def before(self) -> int:
        """The number of wells and barriers left of the start."""
        return next(k for k, word in enumerate(self.words) if word[:5] == "start")

    @property
    def at_start(self) -> str:
        """``"well"`` or ``"barrier"`` if the start is one, else an empty text."""
        return self.words[self.before][6:]

    @property
    def slides(self) -> bool:
        """True if the outermost points are wells, so that the drift outside leads to the layer."""
        return bool(self.kinds) and self.kinds[0] == self.kinds[-1] == "well"

    def __str__(self) -> str:
        return " ".join(self.words)


PAIRS = Case(("start", "well", "barrier")), Case(("barrier", "well", "start"))


@lru_cache(maxsize=32)
def cases_of(drift: Drift, start: Fraction, sliding: bool = False) -> tuple[Case, ...]:
    """The cases that occur for some values of the free parameters (if `sliding`, with outermost
    wells), in order: "start well barrier", cases with a well, cases with fewer points."""
    if drift == Drift.general() or not drift.model.plain:
        return PAIRS if (abs(start) < 1 or not drift.model.layered) and not sliding else ()
    found = _tried(drift, start) if drift.free else {_case_of(drift, start)}
    return tuple(sorted((c for c in found if c.slides or not sliding), key=lambda c: (
        c != PAIRS[0], "well" not in (*c.words, c.at_start),
        len(c.words), c.before, c.words[::-1],
    )))  # fmt: skip


def _case_of(drift: Drift, start: Fraction) -> Case:
    places = doubled(lambda _: BallDrift(drift, LINE._replace(start=start)), 256).places[1:-1]
    return Case(tuple(kind for _, kind in places if kind != "kink"), drift.values)


def _tried(drift: Drift, start: Fraction) -> set[Case]:
    """The cases found for random parameters, of which each pattern of A's signs gets a few."""
    rng, model, found, seen = np.random.default_rng(4), drift.model, set[Case](), Counter[Any]()
    size, u = (_TRIED, len(drift.free)), np.linspace(-1, 1, _POINTS)
    table = (
        rng.integers(1, 33, size) * rng.choice((-1.0, 1.0), size) / 2 ** rng.integers(6, size=size)
    )
    signed = [n in (*model.not_negative, *model.positive) for n in drift.free]
    table[:, signed] = abs(table[:, signed])
    rows = [dict(zip(drift.free, row, strict=True)) for row in table.tolist()]
    columns = dict(zip(drift.free, table.T[:, :, None], strict=True))
    powers, x = drift.expression().as_poly(U), sympy.Rational(str(start))
    on_zero = abs(start) < 1 and sympy.cancel(drift.expression().subs(U, x)) == 0
    with np.errstate(all="ignore"):
        signs = np.sign(drift.bind(**columns)(u))
    for values, row in zip(rows, signs, strict=True):
        turns = np.flatnonzero(np.diff(row))
        key = (*row[turns], np.sum(u[turns] < float(start)), row[-1])
        seen[key] += 1
        if seen[key] <= _LOOKED_INTO:
            bound = drift.bind(**values)
            if powers is None or len(bound.exact_coefficients() or ()) > powers.degree():
                with suppress(SymasymError):
                    case = _case_of(bound, start)
                    found |= {case} if bool(case.at_start) == on_zero else set()
    return found


def case_for(drift: Drift, start: Fraction, asked: str | None, sliding: bool) -> Case:
    """The case called `asked`, by default the first one."""
    found = cases_of(drift, start, sliding)
    for case in found:
        if asked in (None, str(case)):
            return case
    told = f" in the case {shown(asked)}" if asked else ""
    raise InputError(
        f"{drift!r} from {float(start):.6g} has no formula{told}: its cases are "
        f"{', '.join(map(repr, map(str, found))) or 'none'}; expand this drift in one of these, "
        "or use method 'exact' for numbers."
    )


def numbers_of(symbols: Iterable[Symbol], drift: Drift, start: Fraction) -> dict[Symbol, Expr]:
    """The values to 50 digits of all symbols with names such as u1, V(u1), phi(1) and R1+."""
    named = list(symbols)

    def found(bits: int) -> dict[Symbol, Expr]:
        of = BallDrift(drift, LINE._replace(start=start))
        places: dict[str, Any] = {f"u{k}": u for k, (u, _) in enumerate(of.zeros, 1)}
        places |= {"1": arb(1), "-1": arb(-1)}
        known = {f"V({name})": of.height(u) for name, u in places.items()} | places
        known |= {f"phi({side})": of.ends[side] for side in (-1, 1)}
        if parts := [int(s.name[1:-1]) for s in named if re.fullmatch(r"R\d+[-+]", s.name)]:
            # The symbols stand for the layer's share, with finite parts taken in the variable u.
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
