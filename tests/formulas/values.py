"""Numbers of a formula by its chain of definitions, in mpmath alone."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import sympy

import symasym as sa

U = sympy.Symbol("u", real=True)
#: What SymPy's names mean to mpmath.
OWN = {
    "Abs": abs, "airyaiprime": lambda z: mpmath.airyai(z, 1), "Add": lambda *x: mpmath.fsum(x),
    "airybiprime": lambda z: mpmath.airybi(z, 1), "Mul": lambda *x: mpmath.fprod(x),
    "exprel": lambda x, n: (mpmath.expm1(x) - (n - 1) * x) / x**n,
    "Max": max, "Pow": lambda x, p: x**p,
}  # fmt: skip


def number(e: Any, known: dict[str, Any]) -> Any:
    """An expression's value, `known` the symbols' by their names."""
    if e.is_Symbol:
        return known[e.name]
    if e.is_Rational:
        return mpmath.mpf(e.p) / e.q
    if e.is_number and not e.args:
        return mpmath.mpmathify(e._to_mpmath(mpmath.mp.prec))
    if isinstance(e, sympy.hyper):
        return mpmath.hyper(*([number(x, known) for x in row] for row in e.args[:2]),
                            number(e.args[2], known))  # fmt: skip
    if type(e).__name__ in ("Integral", "FinitePart"):
        f, u, a, b = e.args if len(e.args) == 4 else (e.args[0], *e.args[1])
        ends, put = (number(a, known), number(b, known)), dict.fromkeys(f.free_symbols - {u})
        put = {s.name: known[s.name] for s in put}
        return finite_part(lambda t: number(f, {**put, u.name: t}), *ends)
    name = type(e).__name__
    return OWN.get(name, getattr(mpmath, name, None))(*(number(x, known) for x in e.args))


def finite_part(f: Any, a: Any, b: Any) -> Any:
    """The real part of the integral along a low half of an ellipse above the zeros of A."""
    middle, radius = (a + b) / 2, (b - a) / 2
    return mpmath.re(mpmath.quad(
        lambda t: f(middle - radius * (mpmath.cos(t) - mpmath.sin(t) * 1j / 8))
        * radius * (mpmath.sin(t) + mpmath.cos(t) * 1j / 8),
        mpmath.linspace(0, mpmath.pi, 5)))  # fmt: skip


def roots_of(drift: sa.Drift) -> dict[str, Any]:
    """u1, u2, ...: the zeros in the layer, left to right, then the others."""
    c = [mpmath.mpf(x.numerator) / x.denominator for x in drift.exact_coefficients() or ()]
    if not c:
        A = sympy.lambdify(U, drift.expression(), "mpmath")
        roots = [mpmath.findroot(A, float(p.u)) for p in drift.critical_points()]
    else:
        roots = mpmath.polyroots(c[::-1], maxsteps=1000, extraprec=600) if len(c) > 1 else []
    tiny = mpmath.mpf(10) ** (10 - mpmath.mp.dps)
    real = [z.real if abs(mpmath.im(z)) < tiny * (1 + abs(z)) else z for z in roots]
    inside = sorted(z for z in real if mpmath.im(z) == 0 and abs(z) < 1)
    others = [z for z in real if not any(z is w for w in inside)]
    return {f"u{k}": z for k, z in enumerate([*inside, *others], 1)}


class Symbols(dict[str, Any]):
    """The values of a formula's symbols, each worked out where it is asked for."""

    definitions: dict[str, Any]

    def __missing__(self, name: str) -> Any:
        self[name] = number(self.definitions[name], self)
        return self[name]


def by_definitions(
    e: sa.Expansion, drift: sa.Drift, kappa: str, r: str, formula: Any = None
) -> Any:
    """The value of the formula, or of another expression in its symbols, for a bound drift."""
    given = {**drift.values, "kappa": kappa, "r": r}
    known = Symbols({n: mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
                     for n, x in given.items()})  # fmt: skip
    known.definitions = {s.name: v for s, v in e.definitions.items()}
    start = mpmath.mpf(e.start.numerator) / e.start.denominator
    zeros = [z for z in roots_of(drift).values() if not e.case.at_start or abs(z - start) > 1e-9]
    named = {f"u{k}": z for k, z in enumerate(zeros, 1)}
    known.update({n: z for n, z in named.items() if n not in known.definitions})
    return mpmath.re(number(e.formula if formula is None else formula, known))
