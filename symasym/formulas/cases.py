"""Cases of an expansion: which wells, barriers and start stand in the layer, left to right.

An expansion depends on the parameters by nothing else than the simple zeros of A in (-1, 1) and
which of them are left of the start: wells, where A' < 0, and barriers, where A' > 0, take turns. A
case is written as these words in their order, such as ``"start well barrier"``, or ``"start=well
barrier"`` where the start is a well itself.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import sympy

from symasym.base.errors import InputError, SymasymError
from symasym.drift.drift import Drift

__all__ = ["Case", "case_of", "found_cases", "read_case", "slides", "zero_at"]

_WORDS = ("well", "start", "barrier", "start=well", "start=barrier")
# Values that are tried for each free parameter, and the least of one that is positive.
_TRIED = [Fraction(n, 32) for n in (0, 16, 32, 96, 256, -16, -32, -96, 8, -8, 64, 4, -4, 48, -48,
          -64, 2, -2, 24, -24, 128, -128, -256, 512, -512, 1, -1)]  # fmt: skip
_LEAST = Fraction(1, 32)
_MOST_TRIED = 4_000
# Points in u at which signs are looked at, and parameters for which a case is verified.
_POINTS, _MOST_CHECKED = 400, 20
# How far zeros, the start and the ends are from each other at least, and where they are the same.
_APART, _SAME = 1e-4, 1e-9


@dataclass(frozen=True)
class Case:
    """Wells, barriers and the start, left to right, as words.

    `example` are parameters at which the drift is in this case, where one has been looked for.
    """

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

    def __str__(self) -> str:
        return " ".join(self.words)


def read_case(text: str | Case) -> Case:
    """The case that a text names.

    Raises
    ------
    InputError
        If the words are others, the start is not there once, or two wells or two barriers
        follow each other.

    Examples
    --------
    >>> read_case("start well barrier").kinds
    ('well', 'barrier')
    """
    if isinstance(text, Case):
        return text
    words = tuple(text.split()) if isinstance(text, str) else ()
    kinds = [kind for word in words if (kind := word.removeprefix("start").lstrip("="))]
    if (
        sum(word[:5] == "start" for word in words) != 1
        or any(word not in _WORDS for word in words)
        or any(a == b for a, b in itertools.pairwise(kinds))
    ):
        raise InputError(
            f"case is {text!r}; give the words 'start' (once), 'well' and 'barrier', which take "
            "turns, from left to right, as in 'start well barrier', or as in 'start=well barrier' "
            "where the start is one."
        )
    return Case(words)


def case_of(drift: Drift, start: Fraction) -> Case:
    """The case of a bound drift; InputError at a multiple zero of A."""
    points = drift.critical_points()
    for point in points:
        if point.multiplicity != 1:
            raise InputError(
                f"A has a zero of multiplicity {point.multiplicity} at u = {float(point.u):.6g}, "
                "where this series does not exist; use sa.escape_time(method='uniform')."
            )
    found = [(float(p.u), p.kind) for p in points]
    return Case(_ordered(found, float(start), zero_at(drift, start)), drift.values)


def zero_at(drift: Drift, start: Fraction) -> bool:
    """True where A is 0 at a start in the layer, whatever free parameters are."""
    at = sympy.Rational(start.numerator, start.denominator)
    value = drift.expression().subs(sympy.Symbol("u", real=True), at)
    # What `simplify` loads takes a third of a second.
    reduced = sympy.cancel if value.is_rational_function() else sympy.simplify
    return abs(start) < 1 and bool(reduced(value) == 0)


def slides(kinds: Sequence[str]) -> bool:
    """True where the outermost points are wells: the drift points to the layer on both sides."""
    return bool(kinds) and kinds[0] == kinds[-1] == "well"


@lru_cache(maxsize=32)
def found_cases(drift: Drift, start: Fraction, sliding: bool = False) -> tuple[Case, ...]:
    """The cases of a drift with free parameters that some values of them are in.

    Values of a grid are tried; the list is not proved to be complete. First is a well before a
    barrier, then are those with a well, with the fewest points. `sliding`: those whose outermost
    points are wells.
    """
    if not drift.free:
        return (case_of(drift, start),)
    on_zero, names, model = zero_at(drift, start), drift.free, drift.model
    lowest = dict.fromkeys(model.not_negative, Fraction(0)) | dict.fromkeys(model.positive, _LEAST)
    most = max(2, int(_MOST_TRIED ** (1 / len(names))))
    rows = [[x for x in _TRIED if x >= lowest.get(n, x)][:most] for n in names]
    found: dict[Case, None] = {}
    seen: Counter[tuple[str, ...]] = Counter()
    for values, words in _words_at(drift, list(itertools.product(*rows)), float(start), on_zero):
        if seen[words] < _MOST_CHECKED and (not sliding or slides(Case(words).kinds)):
            case = _checked(drift, dict(zip(names, values, strict=True)), start, on_zero)
            # A case that holds is not looked for again.
            seen[words] += _MOST_CHECKED if case is not None and case.words == words else 1
            if case is not None and (not sliding or slides(case.kinds)):
                found.setdefault(case)
    return tuple(sorted(found, key=lambda c: (
        c.words != ("start", "well", "barrier"), "well" not in (*c.words, c.at_start),
        len(c.words), c.before, c.words[::-1],
    )))  # fmt: skip


def _ordered(points: list[tuple[float, str]], start: float, on_zero: bool) -> tuple[str, ...]:
    """The words from left to right; `on_zero` tells that the start is one of the points."""
    at = next((kind for u, kind in points if on_zero and abs(u - start) < _SAME), "")
    others = [(u, kind) for u, kind in points if not (on_zero and abs(u - start) < _SAME)]
    return tuple(word for _, word in sorted([*others, (start, f"start={at}" if at else "start")]))


def _words_at(
    drift: Drift, choices: list[Any], start: float, on_zero: bool
) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Each choice of parameters with the words that A's signs on a grid in u show."""
    A = drift.expression()
    powers = A.as_poly(sympy.Symbol("u", real=True))
    near = [start - _SAME, start + _SAME] if on_zero else [np.clip(start, -1, 1)]
    u, names = np.union1d(np.linspace(-1, 1, _POINTS), near), ("u", *drift.free)
    A, lead = (
        sympy.lambdify([sympy.Symbol(n) for n in names],
                       e.xreplace({s: sympy.Symbol(s.name) for s in e.free_symbols}), "numpy")
        for e in (A, powers.LC() if powers else sympy.S.One)
    )  # fmt: skip
    for at in range(0, len(choices), _POINTS):
        part = choices[at : at + _POINTS]
        columns = np.array(part, dtype=float).T[:, :, None]
        with np.errstate(all="ignore"):
            signs = np.sign(np.broadcast_to(A(u, *columns), (len(part), u.size)))
            signs = np.where(lead(u, *columns) == 0, 0, signs)
        for values, row in zip(part, signs, strict=True):
            if np.all(np.abs(row) == 1):
                turns, middle = np.flatnonzero(np.diff(row)), (u[1:] + u[:-1]) / 2
                points = [(middle[k], "well" if row[k] > 0 else "barrier") for k in turns]
                yield values, _ordered(points, start, on_zero)


def _checked(drift: Drift, given: dict[str, Any], start: Fraction, on_zero: bool) -> Case | None:
    """The case at these parameters; None where zeros, the start and ends are not apart."""
    try:
        bound = drift.bind(**given)
        c = bound.exact_coefficients()
        if c is None:
            return case_of(bound, start)
    except SymasymError:
        return None
    row: list[float] = np.trim_zeros([float(x) for x in c], "b")
    roots = np.roots(row[::-1])
    inside = [float(z.real) for z in roots if abs(z.imag) < _SAME and abs(z.real) < 1]
    marks = np.array([*roots, -1, 1, *[float(start)] * (abs(start) < 1 and not on_zero)])
    if (np.abs(marks[:, None] - marks) + np.eye(len(marks))).min() < _APART:
        return None
    slopes = np.polynomial.polynomial.polyval(inside, [k * x for k, x in enumerate(row)][1:] or [0])
    kinds = ["well" if slope < 0 else "barrier" for slope in np.atleast_1d(slopes)]
    return Case(_ordered(list(zip(inside, kinds, strict=True)), float(start), on_zero), given)
