"""Section 6.2, weak noise: the corrections of a well or barrier to eq:Ttildesmall, to any order.

The first two are stated as textbooks have them, later ones as Perron's formula gives them, which
`symasym.expand` and ``method="laplace"`` evaluate. All are worked out by the same steps.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any

import sympy
from sympy import Symbol
from sympy.utilities.iterables import partitions

from derivations.numerics import Scene, around, integral
from derivations.registry import derives
from derivations.sections.section6.well import S1
from symasym.derivation import Expansion, Identity, Order, Satisfies
from symasym.expansions.universal import gaussian, put_in

# A(u) = -(u - 1/10)(1 + u/3 - u^2/4 + u^3/2 + u^4/5): a well at 1/10, and none of c_2 ... c_6 is 0.
WELL = Fraction(1, 10)
QUARTIC = (Fraction(1), Fraction(1, 3), Fraction(-1, 4), Fraction(1, 2), Fraction(1, 5))
LARGE = ("1e3", "1e4", "1e5", "1e6")
lam = Symbol("lam", positive=True)
h, e = Symbol("h", positive=True), Symbol("e", positive=True)
s = Symbol("s", real=True)
c2 = Symbol("c_2", positive=True)
c3, c4, c5, c6 = (Symbol(f"c_{j}", real=True) for j in range(3, 7))
NUMBERS = ["one", "two", "three", "four", "five", "six", "seven", "eight"]
TIMES = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"]


def scene_of(order: int) -> Scene:
    """That drift, times more powers of u for more derivatives of V that are not 0."""
    more = tuple(Fraction((-1) ** k, 20) for k in range(5, 2 * order + 1))
    factor = (Fraction(0), *QUARTIC, *more, Fraction(0))
    return Scene(tuple(WELL * b - a for a, b in pairwise(factor)))


@derives(
    "saddle-series",
    "Corrections to Laplace's method at a well or a barrier",
    ("gaussian-step",),
    order=2,
    orders=8,
)
def saddle_series(d: Any) -> None:
    c = (c2, *(Symbol(f"c_{j}", real=True) for j in range(3, 2 * d.order + 3)))
    d.suppose("V' = 0 and V'' > 0 at the well; at a barrier -V takes the place of V")
    rest = d.step(
        "beyond the Gaussian",
        "substitute",
        sum(x * s**j * e ** (j - 2) / sympy.factorial(j) for j, x in enumerate(c[1:], 3)),
        Identity(lambda: _rest(c)),
        "u = u1 + delta s with delta = lam^(-1/2), c_j = V^(j)(u1)",
        left=r"\lambda (V(u) - V(u_1)) - \tfrac{1}{2} c_2 s^2 \sim",
    )
    even = d.step(
        "even powers of delta",
        "expand",
        tuple(_of_partitions(c, k) for k in range(1, d.order + 1)),
        Identity(lambda: _even(rest, d.order)),
        "odd powers of delta are odd in s, and their integrals vanish",
        left=tuple(rf"[\delta^{{{2 * k}}}]" for k in range(1, d.order + 1)),
    )
    whole = d.step(
        "Gaussian",
        "integrate",
        sympy.sqrt(2 * sympy.pi / c2),
        Identity(
            lambda: (
                d.use("gaussian-step", step="one Gaussian").subs(
                    {Symbol("kappa", positive=True): sympy.sqrt(2) * e, S1: c2}
                )
                / e
            )
        ),
        "the Gaussian of gaussian-step in ds = du/delta, kappa = sqrt(2) delta",
        left=r"\int_{-\infty}^{\infty} e^{-c_2 s^2/2} \, ds",
    )
    powers = range(4, 6 * d.order + 1, 2)
    moments = d.step(
        "Gaussian moments",
        "integrate",
        tuple(sympy.factorial2(n - 1) / c2 ** (n // 2) for n in powers),
        Identity(lambda: [_moment(whole, n) for n in powers]),
        "of s^4, s^6, and so on",
        left=tuple(rf"\langle s^{{{n}}} \rangle" for n in powers),
    )
    textbook = {
        1: 5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2),
        2: 385 * c3**4 / (1152 * c2**6)
        - 35 * c3**2 * c4 / (64 * c2**5)
        + 35 * c4**2 / (384 * c2**4)
        + 7 * c3 * c5 / (48 * c2**4)
        - c6 / (48 * c2**3),
    }
    alpha = [2 * x / (sympy.factorial(j) * c2) for j, x in enumerate(c[1:], 3)]
    series = sympy.S.One
    for k in range(1, d.order + 1):
        perron = put_in(gaussian(k)[k], alpha) / c2**k
        series += lam**-k * d.step(
            f"{TIMES[k - 1]} correction",
            "evaluate",
            textbook.get(k, sympy.expand(perron)),
            Satisfies(
                lambda found, k=k, perron=perron: {
                    "mean over the Gaussian": found - _mean(even[k - 1], moments),
                    "Perron's formula": found - perron,
                }
            ),
            "as it is evaluated, by Perron's formula",
            left=f"Q_{k}",
        )
    scene = scene_of(d.order)
    values: dict[Any, Any] = {
        x: lambda _, ctx, j=j: -scene.phi(ctx, ctx.mpf(1) / 10, j) for j, x in enumerate(c, start=1)
    }
    # Of the textbooks' each, else the last.
    for k in range(1 if d.order == 2 else d.order, d.order + 1):
        kept = sum((series.coeff(lam, -j) * lam**-j for j in range(k + 1)), sympy.S.Zero)
        d.step(
            f"order after {NUMBERS[k - 1]}",
            "expand",
            Expansion(kept, lam ** -(k + 1), lam, sympy.oo),
            Order(partial(_share, scene), LARGE, values, digits=40 + 10 * d.order),
            left="Q",
        )
    d.conclude(
        Symbol("S"),
        Expansion(series, lam ** -(d.order + 1), lam, sympy.oo),
        f"O(lam^-{d.order + 1})",
        note="Q is int e^(-lam V) about the well over its Gaussian, lam = 2/kappa^2",
    )


def _rest(c: tuple[Any, ...]) -> Any:
    local = sum(x * h**j / sympy.factorial(j) for j, x in enumerate(c, start=2))
    return sympy.expand(local.subs(h, e * s) / e**2 - c2 * s**2 / 2)


def _of_partitions(c: tuple[Any, ...], k: int) -> Any:
    """The coefficient of delta^(2k) of the exponential of a sum: over partitions of 2k."""
    total = sympy.S.Zero
    for parts in partitions(2 * k):
        term = sympy.S.One
        for p, times in parts.items():
            factor = -c[p] * s ** (p + 2) / sympy.factorial(p + 2)
            term *= factor**times / sympy.factorial(times)
        total += term
    return total


def _even(rest: Any, order: int) -> list[Any]:
    """The same by n E_n = -sum of p r_p E_(n - p), r_p the coefficient of delta^p in the rest."""
    r = [rest.coeff(e, p) for p in range(2 * order + 1)]
    power = [sympy.S.One]
    for n in range(1, 2 * order + 1):
        power.append(sympy.expand(-sum(p * r[p] * power[n - p] for p in range(1, n + 1)) / n))
    return power[2::2]


def _moment(whole: Any, n: int) -> Any:
    weight = sympy.exp(-c2 * s**2 / 2)
    return sympy.simplify(sympy.integrate(s**n * weight, (s, -sympy.oo, sympy.oo)) / whole)


def _mean(terms: Any, moments: Any) -> Any:
    found = sympy.Poly(terms, s).terms()
    return sum(c * moments[power // 2 - 2] for (power,), c in found)


def _share(scene: Scene, at: Any, ctx: Any) -> Any:
    """int e^{-lam V} about the well over its Gaussian, by quadrature."""
    low = ctx.mpf(1) / 10
    width = 1 / ctx.sqrt(-at * scene.phi(ctx, low, 1))
    bottom = scene.V(ctx, low)
    found = integral(
        ctx, lambda u: ctx.exp(-at * (scene.V(ctx, u) - bottom)), around(ctx, low, width, -1, 1)
    )
    return found / (width * ctx.sqrt(2 * ctx.pi))
