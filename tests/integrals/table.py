"""The table of integrals: f, g, the interval, and the value by code that shares nothing with
`symasym.integrals`: mpmath's special functions, or its quadrature.

`reference(lam)` is the integral of g e^(lam (f - top)), top the largest f.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy
from mpmath import mp, mpf

DIGITS = 40


@dataclass(frozen=True)
class Integral:
    """One integral.

    Attributes
    ----------
    name : str
    f, g, a, b : str
        In x.
    reference : callable
        lam (mpf) to the value over e^(lam top); runs at `DIGITS` digits.
    source : str
        Where it stands, or why it is here.
    """

    name: str
    f: str
    g: str
    a: str
    b: str
    reference: Callable[[Any], Any]
    source: str


def quadrature(
    f: Any, g: Any, top: Any, *points: str, method: str = "gauss-legendre"
) -> Callable[[Any], Any]:
    """The integral by mpmath.quad, cut at `points` and around them on the scale of the peak.

    Where a piece ends at a branch point `method` is ``"tanh-sinh"``, which takes thrice the time.
    """

    def value(lam: Any) -> Any:
        ends = [mpf(p) if p != "top" else top() for p in points]
        cuts = set(ends)
        for end in ends:
            for k in range(-8, 9):
                for scale in (lam ** mpf(-0.5), 1 / lam, lam ** mpf(-0.25)):
                    near = end + k * scale
                    if ends[0] < near < ends[-1]:
                        cuts.add(near)
        height = f(top())
        return mp.quad(lambda x: g(x) * mp.exp(lam * (f(x) - height)), sorted(cuts), method=method)

    return value


def at(text: str) -> Callable[[], Any]:
    return lambda: mpf(text)


INTEGRALS = [
    Integral(
        "Stirling", "log(x) - x", "1", "0", "oo",
        lambda n: mp.gamma(n + 1) * mp.exp(n) / n ** (n + 1),
        "DLMF 5.11.3",
    ),
    Integral(
        "Bessel I", "cos(x)", "cos(3*x)", "0", "pi",
        lambda z: mp.pi * mp.besseli(3, z) * mp.exp(-z),
        "DLMF 10.32.3 and 10.40.1: a smooth maximum at an end",
    ),
    Integral(
        "Bessel K", "-cosh(x)", "cosh(x/3)", "-oo", "oo",
        lambda z: 2 * mp.besselk(mpf(1) / 3, z) * mp.exp(z),
        "DLMF 10.32.9 and 10.40.2",
    ),
    Integral(
        "Struve", "-x", "(1 + x**2)**(-1/4)", "0", "oo",
        lambda z: (mp.struveh(0.25, z) - mp.bessely(0.25, z))
        * mp.sqrt(mp.pi) * mp.gamma(0.75) / 2 / (z / 2) ** mpf(0.25),
        "DLMF 11.5.2 and 11.6.1",
    ),
    Integral(
        "Kummer U", "-x", "x**(-1/4)*(1 + x)**(-5/4)", "0", "oo",
        lambda z: mp.gamma(0.75) * mp.hyperu(0.75, 0.5, z),
        "DLMF 13.4.4 and 13.7.3: a branch point at the end",
    ),
    Integral(
        "incomplete gamma", "-x", "(1 + x)**(-2/3)", "0", "oo",
        lambda z: mp.gammainc(mpf(1) / 3, z) * mp.exp(z) / z ** (mpf(1) / 3),
        "DLMF 8.6.5 and 8.11.2",
    ),
    Integral(
        "erfc", "-x**2 - 2*x", "1", "0", "oo",
        lambda z: mp.exp(z) * mp.sqrt(mp.pi / z) / 2 * mp.erfc(mp.sqrt(z)),
        "DLMF 7.12.1",
    ),
    Integral(
        "beta, algebraic decay", "-log(1 + x)", "1/sqrt(x)", "0", "oo",
        lambda z: mp.beta(0.5, z - 0.5),
        "DLMF 5.12.3: the tail is a power",
    ),
    Integral(
        "beta, symmetric", "log(x) + log(1 - x)", "1", "0", "1",
        lambda z: mp.beta(z + 1, z + 1) * mpf(4) ** z,
        "DLMF 5.12.1: -oo at both ends",
    ),
    Integral(
        "Legendre", "log(5/4 + 3*cos(x)/4)", "1", "0", "pi",
        lambda n: mp.pi * mp.legenp(n, 0, mpf(5) / 4, type=3) / mpf(2) ** n,
        "DLMF 14.12.7: Laplace's own integral",
    ),
    Integral(
        "quartic", "-x**4", "exp(x)", "-1", "1",
        quadrature(lambda x: -(x**4), mp.exp, at("0"), "-1", "0", "1"),
        "contact of order 4",
    ),
    Integral(
        "sextic", "-x**6", "1/(2 + x)", "-1", "3/2",
        quadrature(lambda x: -(x**6), lambda x: 1 / (2 + x), at("0"), "-1", "0", "1.5"),
        "contact of order 6",
    ),
    Integral(
        "cubic end", "-x**3 - x**4", "1", "0", "1",
        quadrature(lambda x: -(x**3) - x**4, lambda x: mpf(1), at("0"), "0", "1"),
        "odd contact at an end",
    ),
    Integral(
        "kink", "-Abs(x)", "cos(x)", "-1", "2",
        quadrature(lambda x: -abs(x), mp.cos, at("0"), "-1", "0", "2"),
        "one expression, two jets",
    ),
    Integral(
        "unequal kink", "Piecewise((2*x, x < 0), (-x - x**2, True))", "1/(3 + x)", "-1", "2",
        quadrature(
            lambda x: 2 * x if x < 0 else -x - x**2, lambda x: 1 / (3 + x), at("0"), "-1", "0", "2"
        ),
        "slopes differ",
    ),
    Integral(
        "kink and smooth", "Piecewise((-x**2, x < 0), (-x, True))", "exp(x/2)", "-1", "2",
        quadrature(
            lambda x: -(x**2) if x < 0 else -x, lambda x: mp.exp(x / 2), at("0"), "-1", "0", "2"
        ),
        "orders of contact differ",
    ),
    Integral(
        "two equal", "cos(x)", "exp(x)", "-1", "7",
        quadrature(mp.cos, mp.exp, at("0"), "-1", "0", "3.14159265", "6.283185307179586", "7"),
        "heights are equal, shares are not",
    ),
    Integral(
        "two unequal", "-x**2*(x - 2)**2 + x/10", "1", "-1", "3",
        quadrature(
            lambda x: -(x**2) * (x - 2) ** 2 + x / 10,
            lambda x: mpf(1),
            lambda: mp.findroot(lambda x: -4 * x * (x - 1) * (x - 2) + mpf(1) / 10, 2.01),
            "-1", "0", "1", "top", "3",
        ),
        "the lower one is dropped",
    ),
    Integral(
        "no closed form", "sin(x) - x**2/5", "1/(1 + x**2)", "0", "5",
        quadrature(
            lambda x: mp.sin(x) - x**2 / 5,
            lambda x: 1 / (1 + x**2),
            lambda: mp.findroot(lambda x: mp.cos(x) - 2 * x / 5, 1.11),
            "0", "top", "5",
        ),
        "the maximum is a number, not an expression",
    ),
    Integral(
        "zero of g", "-x**2/2 - x**3/3", "x*exp(x)", "-1/2", "1",
        quadrature(
            lambda x: -(x**2) / 2 - x**3 / 3, lambda x: x * mp.exp(x), at("0"), "-0.5", "0", "1"
        ),
        "the leading coefficient shifts",
    ),
    Integral(
        "branch point inside", "-x**2", "sqrt(Abs(x))*exp(x)", "-1", "2",
        quadrature(
            lambda x: -(x**2), lambda x: mp.sqrt(abs(x)) * mp.exp(x), at("0"), "-1", "0", "2",
            method="tanh-sinh",
        ),
        "g = |x|^(1/2) at a smooth maximum",
    ),
    Integral(
        "two powers", "-x - x**3", "1/sqrt(x) + cos(x)", "0", "1",
        # x = s^2, for quadrature that sees no branch point
        quadrature(
            lambda s: -(s**2) - s**6, lambda s: 2 + 2 * s * mp.cos(s**2), at("0"), "0", "1"
        ),
        "g is a sum of powers that differ by 1/2",
    ),
    Integral(
        "removable", "-x**2", "sin(x)/x", "-1", "1",
        quadrature(lambda x: -(x**2), mp.sinc, at("0"), "-1", "0", "1"),
        "a zero over a zero",
    ),
    Integral(
        "cut close", "-x**2", "1", "-1/10", "1",
        lambda z: mp.sqrt(mp.pi / z) * (mp.erf(mp.sqrt(z) / 10) + mp.erf(mp.sqrt(z))) / 2,
        "an end as near as the peak is wide",
    ),
]  # fmt: skip

NAMED = {scene.name: scene for scene in INTEGRALS}


@cache
def truth(name: str, lam: int) -> Any:
    with mp.workdps(DIGITS):
        return NAMED[name].reference(mpf(lam))


def scaled(result: Any, found: Any, lam: int) -> tuple[Any, Any]:
    """Value and error over e^(lam top)."""
    with mp.workdps(DIGITS):
        height = result.height
        height = sympy.N(height, DIGITS) if isinstance(height, sympy.Basic) else height
        scale = mp.exp(-lam * mpf(str(height)))
        return found.value * scale, found.error * scale
