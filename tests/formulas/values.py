"""Numbers of a formula by its chain of definitions, in mpmath alone."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import sympy

import symasym as sa
from symasym.formulas.letters import FinitePart

#: What SymPy's names mean to mpmath.
AIRY = {
    "airyaiprime": lambda z: mpmath.airyai(z, 1), "airybiprime": lambda z: mpmath.airybi(z, 1),
    "exprel": lambda x: mpmath.expm1(x) / x, "exprel2": lambda x: (mpmath.expm1(x) - x) / x**2,
}  # fmt: skip
NEAR = mpmath.mpf("1e-9")


def roots_of(drift: sa.Drift) -> dict[str, Any]:
    """u1, u2, ...: the zeros in the layer, left to right, then the others."""
    c = [mpmath.mpf(x.numerator) / x.denominator for x in drift.exact_coefficients() or ()]
    roots = mpmath.polyroots(c[::-1], maxsteps=1000, extraprec=600) if len(c) > 1 else []
    tiny = mpmath.mpf(10) ** (10 - mpmath.mp.dps)
    roots = [
        z.real if abs(z.imag) < tiny * (1 + abs(z)) else z for z in map(mpmath.mpmathify, roots)
    ]
    inside = sorted(z for z in roots if isinstance(z, mpmath.mpf) and abs(z) < 1)
    others = [z for z in roots if not any(z is w for w in inside)]
    return {f"u{k}": z for k, z in enumerate([*inside, *others], 1)}


def _laurent(h: Any, u: Any) -> dict[int, Any]:
    """Laurent coefficients of h about u by the mean over a circle, radius 1/2."""
    points = [mpmath.expjpi(mpmath.mpf(2 * k) / 256) for k in range(256)]
    values = [h(u + z / 2) for z in points]
    return {j: mpmath.re(sum(v * z**-j for v, z in zip(values, points, strict=True))) / 256
            * mpmath.mpf(2) ** j for j in range(-12, 120)}  # fmt: skip


def finite_part(h: Any, a: Any, b: Any, start: Any) -> Any:
    """The real part of the integral along a low half of an ellipse above the zeros of A.

    From a pole at the start on by Laurent's series, without what is infinite.
    """
    h, total, ends = (
        sympy.lambdify(sympy.Symbol("u", real=True), h, "mpmath", cse=True), mpmath.mpf(0), []
    )  # fmt: skip
    for edge, side in ((a, 1), (b, -1)):
        ends.append(edge)
        if start is not None and abs(edge - start) < NEAR:
            ends[-1] = p = edge + side * mpmath.mpf(1) / 8
            total += side * sum(
                c * (mpmath.log(abs(p - edge)) if j == -1 else (p - edge) ** (j + 1) / (j + 1))
                for j, c in _laurent(h, edge).items()
            )
    middle, radius = sum(ends) / 2, (ends[1] - ends[0]) / 2
    return total + mpmath.re(
        mpmath.quad(
            lambda t: h(middle - radius * (mpmath.cos(t) - mpmath.sin(t) * 1j / 8))
            * radius * (mpmath.sin(t) + mpmath.cos(t) * 1j / 8),
            mpmath.linspace(0, mpmath.pi, 5),
        )
    )  # fmt: skip


def by_definitions(
    e: sa.Expansion, drift: sa.Drift, kappa: str, r: str, formula: Any = None
) -> Any:
    """The value of the formula, or of another expression in its symbols, for a bound drift."""
    known = {n: mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
             for n, x in {**drift.values, "kappa": kappa, "r": r}.items()}  # fmt: skip
    start = mpmath.mpf(e.start.numerator) / e.start.denominator
    A = sympy.lambdify(sympy.Symbol("u", real=True), drift.expression(), "mpmath")
    if drift.exact_coefficients():
        zeros = list(roots_of(drift).values())
    else:
        zeros = [mpmath.findroot(A, float(p.u)) for p in drift.critical_points()]
    if e.case.at_start:
        zeros = [z for z in zeros if abs(z - start) > NEAR]
    known |= {f"u{k}": z for k, z in enumerate(zeros, 1)}
    known = {n: x for n, x in known.items() if n not in {s.name for s in e.definitions}}

    def value(f: Any) -> Any:
        f = sympy.sympify(f)
        if isinstance(f, FinitePart):
            ends = value(f.args[2]), value(f.args[3])
            return finite_part(f.args[0], *ends, start if e.case.at_start else None)
        for whole in f.atoms(sympy.Integral):
            y, a, b = whole.limits[0]
            g, area = sympy.lambdify(y, whole.function, "mpmath"), sympy.Dummy()
            known[area.name] = mpmath.quad(g, [value(a), value(b)])
            f = f.xreplace({whole: area})
        symbols = sorted(f.free_symbols, key=str)
        for s in symbols:
            if s.name not in known:
                known[s.name] = value(e.definitions[s])
        return sympy.lambdify(symbols, f, [AIRY, "mpmath"])(*[known[s.name] for s in symbols])

    return mpmath.re(value(e.formula if formula is None else formula))
