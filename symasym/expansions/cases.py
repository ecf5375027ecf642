"""Cases of an expansion: which wells, barriers and start stand in the layer, left to right.

The contributions of a weak-noise expansion depend on the parameters by nothing else than the simple
zeros of A in (-1, 1) and which of them are left of the start: wells, where A' < 0, and barriers,
where A' > 0, take turns. A case is written as these words in their order, such as
``"start well barrier"``.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from symasym.base.errors import InputError
from symasym.drift.drift import Drift

__all__ = ["Case", "case_of", "found_cases", "read_case"]

_WORDS = ("well", "start", "barrier")
# Values that are tried for each free parameter of a polynomial.
_TRIED = (0, Fraction(1, 2), 1, 3, 8, Fraction(-1, 2), -1, -3, Fraction(1, 4), Fraction(-1, 4), 2)
_MOST_TRIED = 20_000


@dataclass(frozen=True)
class Case:
    """Wells, barriers and the start, left to right.

    Attributes
    ----------
    words : tuple of str
        ``"well"``, ``"barrier"``, and once ``"start"``.
    example : dict
        Parameters at which the drift is in this case, where one has been looked for.
    """

    words: tuple[str, ...]
    example: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The wells and barriers, left to right."""
        return tuple(word for word in self.words if word != "start")

    @property
    def before(self) -> int:
        """How many of them are left of the start."""
        return self.words.index("start")

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
    kinds = [word for word in words if word != "start"]
    if (
        words.count("start") != 1
        or any(word not in _WORDS for word in words)
        or any(a == b for a, b in itertools.pairwise(kinds))
    ):
        raise InputError(
            f"case is {text!r}; give the words 'start' (once), 'well' and 'barrier', which take "
            "turns, from left to right, as in 'start well barrier'."
        )
    return Case(words)


def case_of(drift: Drift, start: Fraction) -> Case:
    """The case of a bound drift.

    Raises
    ------
    InputError
        At a multiple zero of A, or where the start is a zero.
    """
    if drift.exact_value(start) == 0:
        raise InputError(
            f"start is {start}, a zero of A, where the terms of an expansion with free parameters "
            "are others; give another start, or use sa.escape_time(method='laplace')."
        )
    points = drift.critical_points()
    for point in points:
        if point.multiplicity != 1:
            raise InputError(
                f"A has a zero of multiplicity {point.multiplicity} at u = {float(point.u):.6g}, "
                "where this series does not exist; use sa.escape_time(method='uniform')."
            )
    return Case(_ordered([(float(p.u), p.kind) for p in points], float(start)), drift.values)


def _ordered(points: list[tuple[float, str]], start: float) -> tuple[str, ...]:
    """The words from left to right."""
    return tuple(word for _, word in sorted([*points, (start, "start")]))


def found_cases(drift: Drift, start: Fraction) -> tuple[Case, ...]:
    """The cases of a polynomial with free parameters that some values of them are in.

    Values of a grid are tried; the list is not proved to be complete. First is a well before a
    barrier, then are those with a well, with the fewest points.
    """
    if not drift.free:
        return (case_of(drift, start),)
    names = drift.free
    positive, not_negative = drift._model.positive, drift._model.not_negative
    choices = [
        [x for x in _TRIED if x > 0 or (x == 0 and n not in positive) or n not in
         (*positive, *not_negative)]
        for n in names
    ]  # fmt: skip
    degree = drift.expression().as_poly(sympy.Symbol("u", real=True)).degree()
    most = max(2, int(_MOST_TRIED ** (1 / len(names))))
    found: dict[Case, None] = {}
    for values in itertools.product(*(row[:most] for row in choices)):
        given = dict(zip(names, values, strict=True))
        case = _tried(drift, given, start, degree)
        if case is not None:
            found.setdefault(case)
    return tuple(sorted(found, key=_rank))


def _rank(case: Case) -> tuple[Any, ...]:
    return (
        case.words != ("start", "well", "barrier"),
        "well" not in case.words,
        len(case.words),
        case.before,
        case.words[::-1],
    )


def _tried(drift: Drift, given: dict[str, Any], start: Fraction, degree: int) -> Case | None:
    """The case at these parameters.

    None where A has a lower degree, or zeros that are multiple, or at the start or an end.
    """
    c = drift.bind(**given).exact_coefficients()
    if c is None or len(c) != degree + 1 or not c[-1]:
        return None
    roots = np.polynomial.polynomial.polyroots([float(x) for x in c])
    slope = [k * float(x) for k, x in enumerate(c)][1:] or [0.0]
    points = []
    for root in roots:
        if abs(root.imag) > 1e-6:
            continue
        u = float(root.real)
        rate = float(np.polynomial.polynomial.polyval(u, slope))
        if min(abs(u - 1), abs(u + 1), abs(u - float(start)), abs(rate)) < 1e-6:
            return None
        if abs(u) < 1:
            points.append((u, "well" if rate < 0 else "barrier"))
    return Case(_ordered(points, float(start)), given)
