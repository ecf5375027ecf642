"""Exact checks: identities, equations that a result must satisfy, definitions; and inequalities, by
a certificate or an exact proof with a point of equality.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Protocol

import sympy

from symasym.derivation.proofs import difference_at, quick_zero, random_value, sign_by, zero_by
from symasym.derivation.results import Expansion, Inequality, Outcome, Statement, parts, text


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


# -- inequalities ----------------------------------------------------------------------------------


@dataclass
class Bound:
    """An inequality, proved on the whole range that the symbols' assumptions and `given` state.

    Parameters
    ----------
    difference : expression, optional
        A certificate: larger side less smaller side, in a form whose sign is seen.
    monotone : tuple (symbol, start), optional
        The difference is 0 at ``symbol = start`` and its derivative has a visible sign beyond.
    roots : tuple (symbol, low, high), optional
        The difference is a polynomial without a root inside (low, high) (Sturm, exactly).
    given : mapping, optional
        Substitutions that put the range into the assumptions, such as
        ``{mu: Rational(1, 2) + positive}``; made in both sides (and in `difference`)
        before anything else.
    equality : mapping, optional
        A point (or for one symbol a limit) where the two sides are equal, so
        that no constant of the bound can be changed. Needed without `difference`,
        since a bound that is merely true can be anything.
    on : str
        The range in words, for the trace.
    """

    difference: Any = None
    monotone: tuple[Any, Any] | None = None
    roots: tuple[Any, Any, Any] | None = None
    given: Mapping[Any, Any] = field(default_factory=dict)
    equality: Mapping[Any, Any] = field(default_factory=dict)
    on: str = "all values the symbols may take"
    kind: ClassVar[str] = "inequality"

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Check the certificate or the point of equality, then prove the sign."""
        if not isinstance(result, Inequality):
            return Outcome(False, "the result is no inequality")
        if self.difference is None and not self.equality:
            return Outcome(False, "no certificate and no point of equality")
        given = dict(self.given)
        difference = sympy.sympify(result.difference()).subs(given)
        violated = self._violation(result, rng)
        if violated:
            return violated
        if self.difference is not None:
            certificate = sympy.sympify(self.difference).subs(given)
            outcome = compare(difference, certificate, rng, {})
            if not outcome.passed:
                return Outcome(
                    False,
                    f"certificate: {outcome.detail}",
                    outcome.left,
                    outcome.right,
                    outcome.point,
                )
            difference = certificate
        if self.equality:
            gap = self._at_equality(difference)
            if gap != 0:
                return Outcome(
                    False,
                    "the sides are not equal where they should be",
                    text(result.left),
                    text(result.right),
                    f"{dict(self.equality)}, gap {gap}",
                )
        way = self._sign(difference, result.strict)
        if way is None:
            return Outcome(
                False,
                "unknown: the sign of the difference is not proved",
                text(difference),
                "0",
                "no point found",
            )
        return Outcome(True, way)

    def _violation(self, result: Inequality, rng: random.Random) -> Outcome | None:
        """A point of the range where the inequality is false, if ten random ones show one."""
        difference = result.difference().subs(dict(self.given))
        if difference.atoms(sympy.core.function.AppliedUndef, sympy.Integral):
            return None
        for _ in range(10):
            point = {}
            for s in sorted(difference.free_symbols, key=str):
                inside = self.roots[1:] if self.roots and s == self.roots[0] else None
                point[s] = random_value(s, rng, inside)
            value = sympy.N(difference.subs(point), 30)
            if value.is_number and value.is_real and value < -sympy.Float("1e-18"):
                full = {**point, **{k: v.subs(point) for k, v in self.given.items()}}
                left, right = (
                    str(sympy.N(side.subs(dict(self.given)).subs(point), 12))
                    for side in map(sympy.sympify, (result.left, result.right))
                )
                shown = ", ".join(f"{k} = {v}" for k, v in full.items())
                return Outcome(False, "the inequality is false", left, right, shown)
        return None

    def _at_equality(self, difference: sympy.Expr) -> Any:
        """The difference of both sides at the point of equality, simplified."""
        for symbol, value in self.equality.items():
            difference = sympy.limit(difference, symbol, value)
        return sympy.simplify(difference)

    def _sign(self, difference: sympy.Expr, strict: bool) -> str | None:
        """The reason for which the difference is >= 0 (> 0 if `strict`) on the range, or None."""
        if self.monotone is not None:
            symbol, start = self.monotone
            if sympy.simplify(difference.subs(symbol, start)) != 0:
                return None
            slope = sympy.simplify(sympy.diff(difference, symbol))
            way = sign_by(slope, strict)
            return way and f"0 at {symbol} = {start} and growing: the slope is {way}"
        if self.roots is not None:
            symbol, low, high = self.roots
            poly = sympy.Poly(difference, symbol)
            inside = poly.count_roots(low, high) - sum(poly.eval(x) == 0 for x in (low, high))
            positive = poly.eval((sympy.sympify(low) + high) / 2) > 0
            return "no root inside the range (Sturm)" if inside == 0 and positive else None
        way = sign_by(difference, strict)
        return way and f"the larger side less the smaller is {way}"

    def how(self) -> str:
        """One line on how it is proved."""
        met = ", with equality where stated" if self.equality else ""
        return f"proved for {self.on}{met}"
