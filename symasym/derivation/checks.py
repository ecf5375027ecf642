"""Exact checks: identities, equations that a result must satisfy, definitions."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Protocol

import sympy

from symasym.derivation.proofs import difference_at, quick_zero, zero_by
from symasym.derivation.results import Expansion, Outcome, Statement, parts, text


class Check(Protocol):
    """The check that a step carries: `run` decides about a stated result."""

    kind: ClassVar[str]

    def run(self, result: Statement, rng: random.Random) -> Outcome: ...

    def how(self) -> str: ...


def compare(
    got: sympy.Expr, want: sympy.Expr, rng: random.Random, inside: Mapping[Any, Any]
) -> Outcome:
    """Exact equality of two expressions: a quick proof, else a search for a difference."""
    quick = quick_zero(got - want)
    if quick:
        return Outcome(True, f"difference is exactly 0 ({quick})")
    apart = difference_at(got, want, rng, dict(inside))
    if apart:
        return Outcome(False, "the two sides differ", *apart)
    way = zero_by(got - want)
    if way is None:
        # Not distinguished by numbers and not proved equal: unknown, and unknown fails.
        return Outcome(
            False,
            "unknown: no proof found that the sides are equal",
            text(got),
            text(want),
            "no point found",
        )
    return Outcome(True, f"difference is exactly 0 ({way})")


@dataclass
class Identity:
    """The stated result equals what `reference` works out, with an exact zero for a difference.

    Parameters
    ----------
    reference : callable or expression(s)
        Called without arguments when the check runs: the rule carried out on
        what came before, independent of the stated result.
    inside : mapping, optional
        Symbol -> (low, high): where random points for a difference are drawn.
    """

    reference: Any
    inside: Mapping[Any, Any] = field(default_factory=dict)
    kind: ClassVar[str] = "symbolic identity"

    @cached_property
    def _reference(self) -> list[Any]:
        """The pieces of the reference, worked out once."""
        return parts(self.reference() if callable(self.reference) else self.reference)

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Compare piece by piece."""
        got, want = parts(result), self._reference
        if len(got) != len(want):
            return Outcome(False, f"{len(got)} pieces stated, {len(want)} derived")
        details = []
        for one, other in zip(got, want, strict=True):
            outcome = compare(one, other, rng, self.inside)
            if not outcome.passed:
                return outcome
            details.append(outcome.detail)
        return Outcome(True, "; ".join(dict.fromkeys(details)))

    def how(self) -> str:
        """One line on what is compared."""
        return "the rule is carried out by SymPy and the difference is brought to exactly 0"


@dataclass
class Leading(Identity):
    """The leading part of a stated expansion equals what `reference` works out.

    Of the remainder nothing is said: `Order` measures it, and `Together` asks for both.
    """

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Compare the leading part with the reference."""
        if not isinstance(result, Expansion):
            return Outcome(False, "the result is no expansion")
        return super().run(result.leading, rng)

    def how(self) -> str:
        """One line on what is compared."""
        return "the leading part is worked out by SymPy and the difference is brought to exactly 0"


@dataclass
class Satisfies:
    """The stated result satisfies equations that determine it.

    Parameters
    ----------
    equations : callable
        Takes the result (an expression, or a list for several) and returns a
        mapping from the name of an equation to an expression that must vanish.
    inside : mapping, optional
        As in `Identity`.
    """

    equations: Callable[[Any], Mapping[str, Any]]
    inside: Mapping[Any, Any] = field(default_factory=dict)
    kind: ClassVar[str] = "symbolic identity"

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Bring every equation to an exact zero."""
        pieces = parts(result)
        named = self.equations(pieces if len(pieces) > 1 else pieces[0])
        if not named:
            return Outcome(False, "no equation to satisfy")
        for name, residual in named.items():
            outcome = compare(sympy.sympify(residual), sympy.S.Zero, rng, self.inside)
            if not outcome.passed:
                return Outcome(
                    False, f"{name}: {outcome.detail}", outcome.left, outcome.right, outcome.point
                )
        return Outcome(True, f"holds exactly: {', '.join(named)}")

    def how(self) -> str:
        """One line on what is checked."""
        return "the result is put into the equations that determine it, exactly"


@dataclass
class Definition(Satisfies):
    """A definition: the stated expression has the properties that define the quantity.

    A definition cannot be wrong, its transcription can; so it is checked by
    what it is for (values at the ends, a derivative, a scaling).
    """

    kind: ClassVar[str] = "definition"

    def how(self) -> str:
        """One line on what is checked."""
        return "the expression has the properties that define the quantity, exactly"
