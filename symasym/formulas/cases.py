"""Cases of an expansion: which wells, barriers and start stand in the layer, left to right.

An expansion depends on the parameters by nothing else than the simple zeros of A in (-1, 1) and
which of them are left of the start: wells, where A' < 0, and barriers, where A' > 0, take turns. A
case is written as these words in their order, such as ``"start well barrier"``, or ``"start=well
barrier"`` where the start is a well itself.
"""

from __future__ import annotations

import itertools
import random
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import sympy

from symasym.base.errors import InputError, SymasymError
from symasym.drift.drift import Drift
from symasym.expansions.balls import doubled
from symasym.expansions.field import LINE, Field

U = sympy.Symbol("u", real=True)
PAIRS = (("start", "well", "barrier"), ("barrier", "well", "start"))
# Values that are tried for each free parameter, and the least of one that is positive.
_TRIED = [Fraction(n, 32) for n in (0, 16, 32, 96, 256, -16, -32, -96, 8, -8, 64, 4, -4, 48, -48,
          -64, 2, -2, 24, -24, 128, -128, -256, 512, -512, 1, -1)]  # fmt: skip
_LEAST = Fraction(1, 32)
# Scenes whose signs are looked at, at so many points in u, and those of equal signs looked into.
_MOST_TRIED, _POINTS, _LOOKED_INTO = 4_000, 400, 8
# How far zeros, the start and the ends are from each other at least.
_APART = 1e-4


@dataclass(frozen=True)
class Case:
    """Wells, barriers and the start, left to right, as words; `example`: parameters of such."""

    words: tuple[str, ...]
    example: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The wells and barriers beside the start, left to right."""
        return tuple(word for word in self.words if word[:5] != "start")

    @property
    def before(self) -> int:
        """The number of them left of the start."""
        return next(k for k, word in enumerate(self.words) if word[:5] == "start")

    @property
    def at_start(self) -> str:
        """``"well"`` or ``"barrier"`` where the start is one, else nothing."""
        return self.words[self.before][6:]

    @property
    def slides(self) -> bool:
        """True where the outermost points are wells: the drift points to the layer."""
        return bool(self.kinds) and self.kinds[0] == self.kinds[-1] == "well"

    def __str__(self) -> str:
        return " ".join(self.words)


def read_case(text: str | Case) -> Case:
    """The case that a text names."""
    words = tuple(str(text).split())
    kinds = [kind for word in words if (kind := word.removeprefix("start").lstrip("="))]
    known = {*kinds} <= {"well", "barrier"} and sum(word[:5] == "start" for word in words) == 1
    if not known or any(a == b for a, b in itertools.pairwise(kinds)):
        raise InputError(
            f"case is {text!r}; give the words 'start' (once), 'well' and 'barrier', which take "
            "turns, from left to right, as in 'start well barrier', or as in 'start=well barrier' "
            "where the start is one."
        )
    return Case(words)


@lru_cache(maxsize=1)
def _places(drift: Drift, start: Fraction) -> list[tuple[float, str]]:
    """The kinks, wells, barriers and the start of a bound drift, left to right."""
    field = doubled(lambda _: Field(drift, LINE._replace(start=start)), 256)
    return [(float(u), kind) for u, kind in field.places[1:-1]]


def case_of(drift: Drift, start: Fraction) -> Case:
    """The case of a bound drift."""
    words = tuple(kind for _, kind in _places(drift, start) if kind != "kink")
    return Case(words, drift.values)


def case_for(drift: Drift, start: Fraction, asked: Case | None, sliding: bool = False) -> Case:
    """The case asked for, or found; `sliding`: one whose outermost points are wells."""
    if drift == Drift.general() or not drift.model.plain:
        own = asked or Case(PAIRS[0])
        inside = abs(start) < 1 or not drift.model.layered
        fits = own.words in PAIRS and inside and not sliding
    else:
        found = (asked,) if drift.free and asked else found_cases(drift, start, sliding)
        own, powers = next(iter(found), Case(("start",))), drift.expression().as_poly(U)
        fits = asked in (None, own) and (own.slides or not sliding) and len(found) > 0
        fits = fits and bool(own.at_start) == _zero_at(drift, start)
        fits = fits and (not powers or powers.degree() >= len(own.kinds) + bool(own.at_start))
    if not fits:
        raise InputError(
            f"{drift!r} from {float(start):.6g} is not in the formula's case '{asked or own}'; "
            f"give one that it is in, as in case={'well' if sliding else 'start well barrier'!r}"
            f"{', with wells outermost as a sliding block has' * sliding}, or where zeros coincide "
            "take numbers of method='uniform'."
        )
    return own


def _zero_at(drift: Drift, start: Fraction) -> bool:
    """True where A is 0 at a start in the layer, whatever free parameters are."""
    value = drift.expression().subs(U, sympy.Rational(start.numerator, start.denominator))
    return abs(start) < 1 and bool(sympy.cancel(value) == 0)


@lru_cache(maxsize=32)
def found_cases(drift: Drift, start: Fraction, sliding: bool = False) -> tuple[Case, ...]:
    """The cases that some values of a drift's free parameters are in: first a well before a
    barrier, then those with a well, with the fewest points; `sliding`: wells are outermost."""
    if not drift.free:
        return (case_of(drift, start),)
    least = dict.fromkeys(drift.model.not_negative, Fraction(0))
    least |= dict.fromkeys(drift.model.positive, _LEAST)
    most = max(2, int(_MOST_TRIED ** (1 / len(drift.free))))
    rows = [[x for x in _TRIED if x >= least.get(n, x)][:most] for n in drift.free]
    choices, on_zero = list(itertools.product(*rows)), _zero_at(drift, start)
    random.Random(0).shuffle(choices)  # neighbours may share what is wrong with them
    found, seen, u = set[Case](), Counter[Any](), np.linspace(-1, 1, _POINTS)
    powers, columns = drift.expression().as_poly(U), np.array(choices, dtype=float).T[:, :, None]
    with np.errstate(all="ignore"):
        signs = np.sign(drift.bind(**dict(zip(drift.free, columns, strict=True)))(u)).astype(int)
    for values, row in zip(choices, signs, strict=True):
        # Where the signs change, and on which side of the start.
        turns = np.flatnonzero(np.diff(row))
        key = (*row[turns], np.sum(u[turns] < float(start)), row[-1])
        if not (row[0] and row[-1] and seen[key] < _LOOKED_INTO):
            continue
        seen[key] += 1
        bound = drift.bind(**dict(zip(drift.free, values, strict=True)))
        if powers and len(bound.exact_coefficients() or ()) <= powers.degree():
            continue
        with suppress(SymasymError):
            case, near = case_of(bound, start), np.diff([x for x, _ in _places(bound, start)])
            fits = min(near) > _APART and (case.slides or not sliding)
            if fits and bool(case.at_start) == on_zero:
                found.add(case)
    return tuple(sorted(found, key=lambda c: (
        c.words != PAIRS[0], "well" not in (*c.words, c.at_start),
        len(c.words), c.before, c.words[::-1],
    )))  # fmt: skip
