"""Numbers of a formula by its chain of definitions, in mpmath or NumPy alone."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import sympy

import symasym as sa

U = sympy.Symbol("u", real=True)
#: What SymPy's names mean to mpmath.
OWN = {
    "airyaiprime": lambda z: mpmath.airyai(z, 1), "airybiprime": lambda z: mpmath.airybi(z, 1),
    "exprel": lambda x: mpmath.expm1(x) / x, "exprel2": lambda x: (mpmath.expm1(x) - x) / x**2,
}  # fmt: skip


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


def finite_part(h: Any, a: Any, b: Any) -> Any:
    """The real part of the integral along a low half of an ellipse above the zeros of A."""
    f, middle, radius = sympy.lambdify(U, h, "mpmath", cse=True), (a + b) / 2, (b - a) / 2
    path = mpmath.linspace(0, mpmath.pi, 5)
    return mpmath.re(mpmath.quad(
        lambda t: f(middle - radius * (mpmath.cos(t) - mpmath.sin(t) * 1j / 8))
        * radius * (mpmath.sin(t) + mpmath.cos(t) * 1j / 8), path))  # fmt: skip


def by_definitions(
    e: sa.Expansion, drift: sa.Drift, kappa: str, r: str, formula: Any = None
) -> Any:
    """The value of the formula, or of another expression in its symbols, for a bound drift."""
    given = {**drift.values, "kappa": kappa, "r": r, "y": "3/10"}
    known = {n: mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
             for n, x in given.items()}  # fmt: skip
    start = mpmath.mpf(e.start.numerator) / e.start.denominator
    zeros = [z for z in roots_of(drift).values() if not e.case.at_start or abs(z - start) > 1e-9]
    known |= {f"u{k}": z for k, z in enumerate(zeros, 1)}
    known = {n: x for n, x in known.items() if n not in {s.name for s in e.definitions}}

    def value(f: Any) -> Any:
        f = sympy.sympify(f)
        if type(f).__name__ == "FinitePart":
            return finite_part(f.args[0], *map(value, f.args[2:]))
        for whole in f.atoms(sympy.Integral):
            y, a, b = whole.limits[0]
            put = {s: known[s.name] for s in whole.function.free_symbols - {y}}
            g, area = sympy.lambdify(y, whole.function.xreplace(put), "mpmath"), sympy.Dummy()
            known[area.name] = mpmath.quad(g, [value(a), value(b)])
            f = f.xreplace({whole: area})
        symbols = sorted(f.free_symbols, key=str)
        for s in symbols:
            if s.name not in known:
                known[s.name] = value(e.definitions[s])
        return sympy.lambdify(symbols, f, [OWN, "mpmath"])(*[known[s.name] for s in symbols])

    return mpmath.re(value(e.formula if formula is None else formula))
