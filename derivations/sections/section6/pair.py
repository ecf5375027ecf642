"""Section 6.2, weak noise: a well and a barrier that may coalesce.

The double integral over both, and the integrals of the slow manifold beside them: what
`symasym.expansions.canonical` (by numbers) and `symasym.series.local`
evaluate.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Symbol

from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

t = Symbol("t", positive=True)
m = Symbol("m", real=True)
Z = Symbol("Z", real=True)
ai, bi = sympy.airyai(Z), sympy.airybi(Z)


@derives("pair-products", "Double integrals over a well and a barrier that may coalesce")
def pair_products(d: Any) -> None:
    d.suppose("lam (V(v) - V(u)) = (s^3/3 - Z s) at u less the same at v, the well first")
    exponent = d.step(
        "distance and middle",
        "substitute",
        Z * t - t**3 / 12 - m**2 * t,
        Identity(_exponent),
        "t = s(v) - s(u) > 0, m half-way between",
        left=r"\lambda (V(v) - V(u))",
    )
    inner = d.step(
        "over the middle",
        "integrate",
        sympy.sqrt(sympy.pi / t) * sympy.exp(Z * t - t**3 / 12),
        Identity(lambda: _over_middle(exponent)),
        left=r"\int_{-\infty}^{\infty} e^{t Z - t^3/12 - m^2 t} \, dm",
    )
    d.step(
        "the integrand is a derivative",
        "integrate",
        -4 * sympy.sqrt(sympy.pi * t) * sympy.exp(Z * t - t**3 / 12),
        Satisfies(
            lambda found: {
                "J''' - 4 Z J' - 2 J under the integral": sympy.simplify(
                    sympy.diff(found, t) / inner - (t**3 - 4 * Z * t - 2)
                )
            }
        ),
        "it vanishes at t = 0 and oo, so that J''' - 4 Z J' - 2 J = 0",
        left=r"\int (t^3 - 4 Z t - 2) \sqrt{\frac{\pi}{t}} e^{t Z - t^3/12} \, dt",
    )
    start = d.step(
        "at Z = 0",
        "evaluate",
        tuple(_moment(n) for n in range(3)),
        Identity(lambda: [_integral(inner, n) for n in range(3)]),
        "J, J' and J''",
        left=(
            "J(0)",
            "J'(0)",
            "J''(0)",
        ),
    )
    both = d.step(
        "J",
        "solve",
        sympy.pi**2 * (ai**2 + bi**2),
        Satisfies(lambda found: _solves(found, start)),
        "DLMF 9.11.4",
        left="J(Z)",
    )
    three = d.step(
        "with s(v), and with s(u) s(v)",
        "differentiate",
        (
            both,
            sympy.pi**2 * (ai * sympy.diff(ai, Z) + bi * sympy.diff(bi, Z)),
            -(sympy.pi**2) * (sympy.diff(ai, Z) ** 2 + sympy.diff(bi, Z) ** 2),
        ),
        Identity(lambda: _weighted(both)),
        "J' has s(v) - s(u), whose parts are opposite by symmetry; J'' has its square, of which "
        "s^2 is Z up to the regular part",
        left=(
            "J",
            "J_1",
            "J_2",
        ),
    )
    d.conclude(
        (Symbol("J"), Symbol("J_1"), Symbol("J_2")),
        three,
        "exact",
        note="weights 1, s(v) and s(u) s(v), in units of lam^(-2/3), lam^(-1) and lam^(-4/3); "
        "Z = lam^(2/3) zeta, phi du = (s^2 - zeta) ds",
    )


def _weighted(both: Any) -> list[Any]:
    slope = sympy.diff(both, Z) / 2
    return [both, sympy.expand(slope), sympy.expand(Z * both - sympy.diff(slope, Z))]


def _exponent() -> Any:
    def cubic(s: Any) -> Any:
        return s**3 / 3 - Z * s

    return sympy.expand(cubic(m - t / 2) - cubic(m + t / 2))


def _over_middle(exponent: Any) -> Any:
    """The integral of exp(exponent) over m, a Gaussian or an error: SymPy may search for ever."""
    rest, square = exponent.as_independent(m, as_Add=True)
    if sympy.degree(square, m) != 2:
        raise ValueError(f"exp({exponent}) is no Gaussian in m.")
    return sympy.exp(rest) * sympy.integrate(sympy.exp(square), (m, -sympy.oo, sympy.oo))


def _moment(n: int) -> Any:
    power = sympy.Rational(2 * n + 1, 6)
    return sympy.sqrt(sympy.pi) * sympy.Integer(12) ** power * sympy.gamma(power) / 3


def _integral(inner: Any, n: int) -> Any:
    """int t^n of the integrand at Z = 0, by w = t^3/12."""
    w = Symbol("w", positive=True)
    old = sympy.cbrt(12 * w)
    integrand = (t**n * inner).subs(Z, 0).subs(t, old) * sympy.diff(old, w)
    powers = sympy.powsimp(sympy.expand(integrand * sympy.exp(w)))
    if powers.has(sympy.exp):
        raise ValueError(f"{inner} has no factor exp(-t^3/12) at Z = 0.")
    return sympy.integrate(powers * sympy.exp(-w), (w, 0, sympy.oo))


def _solves(found: Any, start: Any) -> dict[str, Any]:
    rest = sympy.diff(found, Z, 3) - 4 * Z * sympy.diff(found, Z) - 2 * found
    equations = {"the differential equation": sympy.expand(rest)}
    for n, value in enumerate(start):
        here = sympy.diff(found, Z, n).subs(Z, 0)
        equations[f"derivative {n} at 0"] = _in_thirds(here) - _in_thirds(value)
    return equations


def _in_thirds(value: Any) -> Any:
    """gamma(1/6), gamma(5/6) and gamma(2/3) by gamma(1/3): duplication and reflection."""
    third = sympy.gamma(sympy.Rational(1, 3))
    sixth = sympy.sqrt(3 / sympy.pi) * third**2 / sympy.cbrt(2)
    swap = {
        sympy.gamma(sympy.Rational(2, 3)): 2 * sympy.pi / (sympy.sqrt(3) * third),
        sympy.gamma(sympy.Rational(1, 6)): sixth,
        sympy.gamma(sympy.Rational(5, 6)): 2 * sympy.pi / sixth,
    }
    return sympy.simplify(sympy.sympify(value).subs(swap))


# -- the regular part beside both ------------------------------------------------------------------

R = Symbol("R", positive=True)
y, alpha, beta = (Symbol(name, real=True) for name in ("y", "alpha", "beta"))
gap, square = Symbol("gap", real=True), Symbol("square", real=True)
product, x = Symbol("product", positive=True), Symbol("x", positive=True)
i, index = Symbol("i", integer=True, nonnegative=True), Symbol("index", integer=True)
n, power = (Symbol(name, integer=True, positive=True) for name in ("n", "power"))
share, term, lower, same, before, after = (
    Symbol(name, real=True) for name in ("share", "term", "lower", "same", "before", "after")
)
W = y**2 - square


@derives(
    "pair-primitives",
    "The regular part beside a pair of zeros: primitives and their recurrences",
    ("endpoint-series", "regular-part"),
)
def pair_primitives(d: Any) -> None:
    d.suppose("phi = (y^2 - D) psi(y), psi > 0; y from half-way between the zeros, D = +-R^2")
    d.suppose("past a real zero the mean of both complex paths is taken: Hadamard's finite part")
    real = d.step(
        "beside real zeros",
        "integrate",
        -alpha * sympy.log(1 + 4 * R * y / gap**2) / (4 * R),
        Satisfies(lambda found: _even_share(found.subs(gap, y - R), R**2)),
        "y > 0, g = y - R; the logarithm of |y + R|/|y - R|, in which nothing cancels as R -> 0",
        left=r"\int \frac{\alpha \, dy}{y^2 - R^2}",
    )
    line = d.step(
        "beside complex zeros",
        "integrate",
        -alpha * sympy.atan2(R, y) / R,
        Satisfies(_along_the_line),
        "along the real line",
        left=r"\int \frac{\alpha \, dy}{y^2 + R^2}",
    )
    logarithm = d.step(
        "odd part",
        "integrate",
        beta * sympy.log(product) / 2,
        Satisfies(lambda found: _odd_share(found.subs(product, x**2 - square))),
        "Pi is |y^2 - D|",
        left=r"\int \frac{\beta y \, dy}{y^2 - D}",
    )
    whole = d.step(
        "over the real line",
        "evaluate",
        sympy.pi / R,
        Identity(lambda: _over_the_line(line)),
        "D = -R^2: what the real line has more than a path above both zeros, n = 1",
        left=r"s_1 = \int_{-\infty}^{\infty} \frac{dy}{y^2 + R^2}",
    )
    following = d.step(
        "over the real line, next power",
        "integrate",
        (1 - 2 * n) * share / (2 * n * square),
        Satisfies(_next_power),
        "by parts: y (y^2 - D)^(-n) vanishes at both ends",
        left="s_{n+1}",
    )
    binomial = d.step(
        "coefficient of the series in D/y^2",
        "expand",
        term * (n + i) / (i + 1),
        Satisfies(_binomial),
        "b_0 = 1, and (y^2 - D)^(-n) is the sum of b_i D^i y^(-2n - 2i)",
        left="b_{i+1}",
    )
    d.step(
        "a term's primitive",
        "integrate",
        term / (1 - 2 * n - 2 * i),
        Identity(lambda: d.use("regular-part", "H").subs({power: 2 * n + 2 * i})),
        left=r"y^{2 n + 2 i - 1} \int b_i y^{-2 n - 2 i} \, dy",
    )
    reduced = d.step(
        "from y^j to y^(j + 2)",
        "split",
        lower + square * same,
        Satisfies(_two_powers_more),
        "I_(n,j) is the integral of y^j (y^2 - D)^(-n); by y^2 = (y^2 - D) + D",
        left="I_{n,j+2}",
    )
    fall = d.step(
        "-h' by powers",
        "differentiate",
        (2 * power + 1 - index) * before + (index + 1) * square * after,
        Satisfies(lambda found: {"-h'": sympy.expand(found - _fall_of_pair(d))}),
        "h = (y^2 - D)^(-p) times the sum of c_j y^j; of phi h_(k+1) the power of the pole is "
        "p + 1, and p + 2 of h_(k+1) itself",
        left="c'_j",
    )
    d.conclude(
        tuple(map(Symbol, ("H_even", "H_line", "H_odd", "s_1", "s_next", "b_next", "I", "h_next"))),
        (real, line, logarithm, whole, following, binomial, reduced, fall),
        note="the pole part of 1/phi beside two close zeros, (alpha + beta y)/(y^2 - D), is "
        "integrated, and its powers by recurrence. The first three are primitives of "
        "alpha/(y^2 - R^2), alpha/(y^2 + R^2) and beta y/(y^2 - D), of which the first two vanish "
        "at oo; arccot lies between 0 and pi; s_n is the integral of (y^2 + R^2)^(-n) over the "
        "line",
    )


def _even_share(found: Any, at: Any) -> dict[str, Any]:
    """Of alpha/(y^2 - at), 0 at infinity."""
    return {
        "derivative": sympy.simplify(sympy.diff(found, y) - alpha / (y**2 - at)),
        "at oo": sympy.limit(found.subs(y, x), x, sympy.oo),
    }


def _along_the_line(found: Any) -> dict[str, Any]:
    right, left = found.subs(y, x), found.subs(y, -x)
    return _even_share(found, -(R**2)) | {
        "no jump at y = 0": sympy.limit(right, x, 0) - sympy.limit(left, x, 0)
    }


def _odd_share(found: Any) -> dict[str, Any]:
    slope = sympy.diff(found, x) - beta * x / (x**2 - square)
    return {
        "derivative": sympy.simplify(slope),
        "as beta log y": sympy.limit(found.subs(square, 1) - beta * sympy.log(x), x, sympy.oo),
    }


def _over_the_line(line: Any) -> Any:
    one = line.subs(alpha, 1)
    ends = one.subs(y, x), one.subs(y, -x)
    return sympy.limit(ends[0], x, sympy.oo) - sympy.limit(ends[1], x, sympy.oo)


def _next_power(found: Any) -> dict[str, Any]:
    """The derivative of y W^-n has W^-n and W^(-n - 1), whose integrals are those two."""
    slope = sympy.diff(y * W**-n, y)
    both = (1 - 2 * n) * share - 2 * n * square * found
    parts = (1 - 2 * n) * W**-n - 2 * n * square * W ** (-n - 1)
    return {"by parts": sympy.simplify((slope - parts) * W ** (n + 1)), "sum": sympy.expand(both)}


def _binomial(found: Any) -> dict[str, Any]:
    """(1 - x) f' = n f for f = (1 - x)^-n, whose coefficient of x^i is b_i."""
    f = (1 - x) ** -n
    return {
        "the differential equation": sympy.simplify(((1 - x) * sympy.diff(f, x) - n * f) / f),
        "coefficient of x^i": sympy.expand((i + 1) * found - i * term - n * term),
    }


def _two_powers_more(found: Any) -> dict[str, Any]:
    powers = {lower: W ** (1 - n), same: W**-n}
    return {"y^(j + 2)": sympy.simplify((found.subs(powers) - y**2 * W**-n) * W**n)}


def _fall_of_pair(d: Any) -> Any:
    """Coefficient of y^index in phi h_(k+1), times W^(p + 1), of two terms of h_k."""
    following, psi = d.use("endpoint-series", step="next term"), Function("psi")(y)
    source, drift = Symbol("source", real=True), Symbol("drift", real=True)
    # W^-p, and W itself, so that it cancels.
    pole, w = Function("E")(y), Symbol("w", positive=True)
    slope = sympy.diff(pole * (before * y ** (index - 1) + after * y ** (index + 1)), y)
    slope = slope.subs(sympy.diff(pole, y), -2 * power * y * pole / w)
    stated = following.subs({source: -slope, drift: w * psi}) * w * psi
    terms = sympy.expand(stated * w / pole / y**index).subs(w, W)
    terms = sympy.expand(sympy.powsimp(sympy.expand(terms)))
    return terms.as_independent(y, as_Add=True)[0]
