"""The table of integrals: f, g, the interval, and the value by code that shares nothing with
`symasym.integrals`: mpmath's special functions, or its quadrature.

`reference(lam)` is the integral of g e^(lam (f - top)), top the largest f.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import sympy
from mpmath import mp, mpf

DIGITS = 40


class Integral(NamedTuple):
    """One integral; f, g, a, b are texts in x."""

    name: str
    f: str
    g: str
    a: str
    b: str
    reference: Callable[[Any], Any]


def _row(name: str, f: str, g: str, ends: str, reference: Any) -> Integral:
    """A row; of a reference that is a text, quadrature cut there, the maximum first."""
    a, b = ends.split()
    if callable(reference):
        return Integral(name, f, g, a, b, reference)
    names, cuts = {"x": sympy.Symbol("x", real=True)}, reference.split()
    of, weight = (sympy.lambdify(names["x"], sympy.sympify(e, names), "mpmath") for e in (f, g))

    def value(lam: Any) -> Any:
        top = mpf(cuts[0])
        if "." in cuts[0]:  # a maximum known roughly
            top = mp.findroot(lambda z: mp.diff(of, z), top)
        marks = [mpf(c) for c in (a, b, *cuts[1:])] + [top]
        for scale in (lam ** mpf(-0.5), 1 / lam, lam ** mpf(-0.25)):
            marks += [m + k * scale for m in marks[: len(cuts) + 2] for k in range(-8, 9)]
        inside = sorted({m for m in marks if mpf(a) <= m <= mpf(b)})
        # Branch points and removable ones are at ends of pieces.
        rule = "tanh-sinh" if "sqrt" in g else "gauss-legendre"
        return mp.quad(lambda z: weight(z) * mp.exp(lam * (of(z) - of(top))), inside, method=rule)

    return Integral(name, f, g, a, b, value)


INTEGRALS = [
    # DLMF 5.11.3; 10.32.3 and 10.40.1; 10.32.9 and 10.40.2; 11.5.2 and 11.6.1
    _row("Stirling", "log(x) - x", "1", "0 oo",
         lambda n: mp.gamma(n + 1) * mp.exp(n) / n ** (n + 1)),
    _row("Bessel I", "cos(x)", "cos(3*x)", "0 pi",
         lambda z: mp.pi * mp.besseli(3, z) * mp.exp(-z)),
    _row("Bessel K", "-cosh(x)", "cosh(x/3)", "-oo oo",
         lambda z: 2 * mp.besselk(mpf(1) / 3, z) * mp.exp(z)),
    _row("Struve", "-x", "(1 + x**2)**(-1/4)", "0 oo",
         lambda z: (mp.struveh(0.25, z) - mp.bessely(0.25, z))
         * mp.sqrt(mp.pi) * mp.gamma(0.75) / 2 / (z / 2) ** mpf(0.25)),
    # DLMF 13.4.4 and 13.7.3; 8.6.5 and 8.11.2; 7.12.1; 5.12.3; 5.12.1; 14.12.7
    _row("Kummer U", "-x", "x**(-1/4)*(1 + x)**(-5/4)", "0 oo",
         lambda z: mp.gamma(0.75) * mp.hyperu(0.75, 0.5, z)),
    _row("incomplete gamma", "-x", "(1 + x)**(-2/3)", "0 oo",
         lambda z: mp.gammainc(mpf(1) / 3, z) * mp.exp(z) / z ** (mpf(1) / 3)),
    _row("erfc", "-x**2 - 2*x", "1", "0 oo",
         lambda z: mp.exp(z) * mp.sqrt(mp.pi / z) / 2 * mp.erfc(mp.sqrt(z))),
    _row("beta, algebraic decay", "-log(1 + x)", "1/sqrt(x)", "0 oo",
         lambda z: mp.beta(0.5, z - 0.5)),
    _row("beta, symmetric", "log(x) + log(1 - x)", "1", "0 1",
         lambda z: mp.beta(z + 1, z + 1) * mpf(4) ** z),
    _row("Legendre", "log(5/4 + 3*cos(x)/4)", "1", "0 pi",
         lambda n: mp.pi * mp.legenp(n, 0, mpf(5) / 4, type=3) / mpf(2) ** n),
    # contacts of other orders, at ends and inside
    _row("quartic", "-x**4", "exp(x)", "-1 1", "0"),
    _row("sextic", "-x**6", "1/(2 + x)", "-1 3/2", "0"),
    _row("flat", "-(1 - cos(x))**2", "1", "-1 2", "0"),
    _row("an irrational slope", "-sqrt(pi)*x", "1", "0 1", "0"),
    _row("cubic end", "-x**3 - x**4", "1", "0 1", "0"),
    # several maxima; one without a closed form
    _row("two equal", "cos(x)", "exp(x)", "-1 7", "0 6.283185307179586"),
    _row("two unequal", "-x**2*(x - 2)**2 + x/10", "1", "-1 3", "2.01 0 1"),
    _row("two wells", "x**2 - x**4", "1", "-2 2", "0.71 0 -0.7071067811865475"),
    _row("no closed form", "sin(x) - x**2/5", "1/(1 + x**2)", "0 5", "1.11"),
    # g with zeros, powers, and 0/0
    _row("zero of g", "-x**2/2 - x**3/3", "x*exp(x)", "-1/2 1", "0"),
    _row("singular end", "-x - x**3", "cos(x)/sqrt(x)", "0 1", "0"),
    _row("singular at 1", "-x", "1/sqrt(1 - x)", "0 1", "0"),
    _row("removable", "-x**2", "sin(x)/x", "-1 1", "0"),
    _row("cut close", "-x**2", "1", "-1/10 1",
         lambda z: mp.sqrt(mp.pi / z) * (mp.erf(mp.sqrt(z) / 10) + mp.erf(mp.sqrt(z))) / 2),
]  # fmt: skip

NAMED = {row.name: row for row in INTEGRALS}


@cache
def truth(name: str, lam: int) -> Any:
    with mp.workdps(DIGITS):
        return NAMED[name].reference(mpf(lam))


def scaled(result: Any, found: Any, lam: int) -> tuple[Any, Any]:
    """Value and error over e^(lam top)."""
    with mp.workdps(DIGITS):
        height = mpf(str(sympy.N(result.contributions[0].height, DIGITS)))
        return found.value * mp.exp(-lam * height), found.error * mp.exp(-lam * height)
