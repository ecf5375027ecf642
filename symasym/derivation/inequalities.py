"""Checks of inequalities: a certificate, or an exact proof with a point of equality."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import sympy

from symasym.derivation.checks import compare
from symasym.derivation.proofs import random_value, sign_by
from symasym.derivation.results import Inequality, Outcome, Statement, text


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
            return way and f"0 at {symbol} = {start} and growing: slope's {way}"
        if self.roots is not None:
            symbol, low, high = self.roots
            poly = sympy.Poly(difference, symbol)
            inside = poly.count_roots(low, high) - sum(poly.eval(x) == 0 for x in (low, high))
            positive = poly.eval((sympy.sympify(low) + high) / 2) > 0
            return "no root inside the range (Sturm)" if inside == 0 and positive else None
        return sign_by(difference, strict)

    def how(self) -> str:
        """One line on how it is proved."""
        way = "by a certificate" if self.difference is not None else "by an exact proof of the sign"
        met = ", with equality where stated" if self.equality else ""
        return f"proved {way}{met}; on {self.on}"
