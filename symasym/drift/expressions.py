"""Reads a drift from a SymPy expression or a text, and gives phi and V as SymPy expressions."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import sympy
from flint import arb, fmpq
from sympy.core.symbol import uniquely_named_symbol

from symasym.base.balls import precision, rational
from symasym.base.errors import InputError
from symasym.base.inputs import choice, exact, float_text, is_name, sequence, shown
from symasym.drift import texts
from symasym.drift.evaluate import box, halved, profile
from symasym.drift.formula import Formula, interned, require_admitted
from symasym.drift.model import Model

# Limits for the halvings of [-1, 1] and for the boxes; a smooth drift needs a few hundred boxes.
_DEEPEST, _MOST_BOXES = 120, 5_000
_OVERLAP = fmpq(9, 16)  # with 1/2 neighbouring boxes would only touch
_MOST = arb(10) ** 300
_MOST_PIECES = 30
_ALPHAS = {"0": Fraction(0), "stratonovich": Fraction(1, 2)}


def read(A: Any, u: Any) -> Formula:
    """The formula A(u) from an expression or text, with its variable u."""
    formula = parse("A", A)
    # Symbols are identified by name, whatever their assumptions.
    plain = {s: sympy.Symbol(symbol("A", s).name) for s in formula.free_symbols}
    if u is None and len(plain) == 1 and "u" not in (names := [s.name for s in plain]):
        raise InputError(
            f"A = {formula} has no symbol u; write it in u, or name {names[0]} as its variable."
        )
    require_admitted(formula)
    variable = sympy.Symbol("u" if u is None else symbol("u", u).name)
    return interned(formula.xreplace(plain), variable)


def with_pieces(given: Any, u: Any, noise: Any, ito: Any, layered: bool = False) -> Model:
    """The model of a piecewise drift, given by A and right end of each piece and by sigma(u)."""
    parts = sequence("pieces", given)
    if not 0 < len(parts) <= _MOST_PIECES:
        raise InputError(f"pieces are {len(parts)}; give 1 to {_MOST_PIECES} pairs.")
    found, cuts = [], []
    for k, part in enumerate(parts):
        A, right = part if isinstance(part, (tuple, list)) and len(part) == 2 else (part, part)
        if (right is None) != (k == len(parts) - 1) or A is part:
            raise InputError(
                f"a piece is {shown(part)}; give pairs of A and its right end, the last one None."
            )
        found.append(read(A, u))
        if right is not None:
            cuts.append(exact("a right end", right))
    if any(not a < b for a, b in pairwise(cuts)):
        ends = ", ".join(map(float_text, cuts))
        raise InputError(f"the right ends are {ends}; give them from left to right.")
    alpha = _ALPHAS[choice("ito", str(ito), _ALPHAS)]
    sigma = None if noise is None else read(noise, found[0].u.name)
    return Model(pieces=tuple(found), cuts=tuple(cuts), noise=sigma, alpha=alpha, layered=layered)


def parse(name: str, given: Any, names: Mapping[str, Any] | None = None) -> Any:
    """The SymPy expression given as an expression, number or text; floats are converted exactly.
    Messages call it `name`; `names` maps the names of symbols to their meaning."""
    if isinstance(given, str):
        expression = texts.read(name, given, names)
    else:
        # In a list or tuple SymPy would evaluate texts even with strict=True.
        own = isinstance(given, (sympy.Basic, np.ndarray)) or not hasattr(given, "__iter__")
        try:
            expression = sympy.sympify(given, strict=True) if own else None
        except (sympy.SympifyError, TypeError, AttributeError):
            expression = None
    if not isinstance(expression, sympy.Expr):
        raise InputError(
            f"{name} is {shown(given)}; give a SymPy expression, a number or a string."
        )
    numbers = {
        x: exact(f"a number of {name}", x) for x in expression.atoms(sympy.Rational, sympy.Float)
    }
    exactly = {x: sympy.Rational(q.numerator, q.denominator) for x, q in numbers.items()}
    found = expression.xreplace({x: q for x, q in exactly.items() if x.is_Float})
    # Symbols of the same name are the same symbol, whatever their assumptions.
    known = names or {}
    return found.subs({s: known[s.name] for s in found.free_symbols if s.name in known})


def symbol(name: str, given: Any) -> Any:
    """A SymPy symbol, given as one or by its name."""
    word = given.name if isinstance(given, sympy.Symbol) else given
    if not is_name(word):
        raise InputError(
            f"{name} has {shown(word)}; give symbols, or names, of letters, digits and _."
        )
    return sympy.Symbol(word, real=True) if given is word else given


def check_regular(formula: Formula, values: Mapping[str, Fraction], name: str = "A") -> None:
    """Refuse an A, or sigma, that is singular or complex on [-1, 1], by enclosures over boxes.

    If the enclosure stays beyond 1e300 however small the box is, the box contains a singularity (or
    a removable one, which should be cancelled in the formula). The boxes overlap, so that together
    they cover a neighbourhood of [-1, 1].
    """

    def finite(phi: Any, middle: fmpq, half: fmpq) -> bool:
        size = 2 * _OVERLAP * half
        return bool(abs(phi(box(middle, size, size))) < _MOST)

    fault = "is singular, complex, beyond 1e300 or too steep"
    _require(f"{name} = {formula.expression} {fault}", formula, values, fmpq(-1), fmpq(1), finite)


def check_noise(noise: Formula, values: Mapping[str, Any], low: Any, high: Any) -> None:
    """Refuse a sigma that is not positive from `low` to `high`, by enclosures over intervals."""

    def positive(sigma: Any, middle: fmpq, half: fmpq) -> bool:
        return bool(sigma(arb(middle, arb(half))) > 0)

    fault = f"noise = {noise.expression} is not greater than 0"
    _require(fault, noise, values, low, high, positive)


def _require(
    fault: str, formula: Formula, values: Mapping[str, Any], low: Any, high: Any, holds: Any
) -> None:
    """Raise unless [low, high] can be halved into intervals on each of which a test holds."""
    with precision(4 * _DEEPEST):
        of = profile(formula, {k: rational(values[k]) for k in formula.symbols})
        lost = halved(low, high, partial(holds, of), _MOST_BOXES, _DEEPEST)[1]
        if lost is not None:
            raise InputError(
                f"{fault} near u = {round(float(arb(lost)), 6):g}; give a smooth real A, and noise "
                f"greater than 0, from {float(arb(low)):.6g} to {float(arb(high)):.6g}."
            )


def antiderivative(f: Any, x: Any) -> Any:
    """An antiderivative in closed form; None if SymPy finds none, or a false one.

    Where it depends on the sign of a parameter, SymPy 1.14 drops the logarithm: 1/(c + x^2)
    with a real c has the antiderivative 0.
    """
    found = sympy.integrate(f, x)
    closed = not found.has(sympy.Integral, sympy.Piecewise)
    right = closed and (f.free_symbols == {x} or sympy.simplify(found.diff(x) - f) == 0)
    return found if right else None


def potential(A: Any, layered: bool) -> Any:
    """V in the real symbol u; if `layered`, a SymPy Piecewise (eq:V2)."""
    u, v = sympy.Symbol("u", real=True), uniquely_named_symbol("v", A, real=True)
    closed = antiderivative(A.subs(u, v), v)

    def inside(upper: Any) -> Any:
        if closed is not None:
            return sympy.expand(closed.subs(v, upper) - closed.subs(v, -1))
        return sympy.Integral(A.subs(u, v), (v, -1, upper))

    if not layered:
        return -inside(u)
    return sympy.Piecewise(
        (-A.subs(u, -1) * (u + 1), u <= -1),
        (-inside(u), u < 1),
        (-inside(sympy.Integer(1)) - A.subs(u, 1) * (u - 1), True),
    )
