"""Section 6.2, weak noise: the corrections of a well or barrier to eq:Ttildesmall, to any order.

The first two are stated as textbooks have them, later ones as Perron's formula gives them, which
`symasym.expand` and ``method="laplace"`` evaluate. All are worked out by the same steps. From a
start on the well or barrier half of it counts, and odd powers of delta enter.
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
from symasym.expansions.universal import beside_start, gaussian, put_in

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
TIMES = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth"]


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
        tuple(_of_partitions(c, 2 * k) for k in range(1, d.order + 1)),
        Identity(lambda: _powers(rest, 2 * d.order)[2::2]),
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


@derives(
    "saddle-start",
    "Laplace's method from a start on a well or a barrier",
    ("saddle-series",),
    order=2,
    orders=8,
)
def saddle_start(d: Any) -> None:
    (series,) = d.rests_on
    c = (c2, *(Symbol(f"c_{j}", real=True) for j in range(3, 2 * d.order + 4)))
    d.suppose("V' = 0 and V'' > 0 at the start; at a barrier -V takes the place of V")
    rest = d.step(
        "beyond the Gaussian",
        "substitute",
        sum(x * s**j * e ** (j - 2) / sympy.factorial(j) for j, x in enumerate(c[1:], 3)),
        Identity(lambda: _rest(c)),
        "u = u1 + delta s with delta = lam^(-1/2), c_j = V^(j)(u1)",
        left=r"\lambda (V(u) - V(u_1)) - \tfrac{1}{2} c_2 s^2 \sim",
    )
    odd = d.step(
        "odd powers of delta",
        "expand",
        tuple(_of_partitions(c, 2 * k + 1) for k in range(d.order + 1)),
        Identity(lambda: _powers(rest, 2 * d.order + 1)[1::2]),
        "over s > 0 their integrals do not vanish",
        left=tuple(rf"[\delta^{{{2 * k + 1}}}]" for k in range(d.order + 1)),
    )
    powers = range(3, 6 * d.order + 4, 2)
    moments = d.step(
        "moments of half a Gaussian",
        "integrate",
        tuple(2 ** (n // 2) * sympy.factorial(n // 2) / c2 ** (n // 2 + 1) for n in powers),
        Identity(lambda: [_moment(1, n, 0) for n in powers]),
        "of s^3, s^5, and so on",
        left=tuple(rf"\int_0^\infty s^{{{n}}} e^{{-c_2 s^2/2}} \, ds" for n in powers),
    )
    ratios = [x / (sympy.factorial(j - 1) * c2) for j, x in enumerate(c[1:], 3)]
    evaluated = beside_start(d.order + 1, None, False).odd
    beside = sympy.S.Zero
    for k in range(d.order + 1):
        # As for every k, and as textbooks have it for k = 0.
        perron = put_in(evaluated[k], ratios) / c2 ** (k + 1)
        beside += lam**-k * d.step(
            f"{TIMES[k]} odd term",
            "evaluate",
            -c3 / (3 * c2**2) if k == 0 else sympy.expand(perron),
            Satisfies(
                lambda found, k=k, perron=perron: {
                    "integral over s > 0": found - _mean(odd[k], moments, 3),
                    "Perron's formula": found - perron,
                }
            ),
            "as it is evaluated, by Perron's formula",
            left=f"P_{k}",
        )
    corrections = [d.use(series, step=f"{TIMES[k]} correction") for k in range(d.order)]
    even = 1 + sum(q * lam ** -(k + 1) for k, q in enumerate(corrections))
    scene = scene_of(d.order + 1)
    values: dict[Any, Any] = {
        x: lambda _, ctx, j=j: -scene.phi(ctx, ctx.mpf(1) / 10, j) for j, x in enumerate(c, start=1)
    }
    gauge = lam ** -(d.order + 1)
    for side, name in ((1, "right"), (-1, "left")):
        half = even / 2 + side * sympy.sqrt(c2 / (2 * sympy.pi * lam)) * beside
        d.step(
            f"to the {name}",
            "expand",
            Expansion(half, gauge, lam, sympy.oo),
            Order(partial(_share, scene, sides=(side,)), LARGE, values, digits=40 + 10 * d.order),
            "half of the corrections, and the odd terms" if side > 0 else "odd terms change sign",
            left="H_+" if side > 0 else "H_-",
        )
    d.conclude(
        Symbol("H"),
        Expansion(even / 2 + sympy.sqrt(c2 / (2 * sympy.pi * lam)) * beside, gauge, lam, sympy.oo),
        f"O(lam^-{d.order + 1})",
        note="H is int e^(-lam V) to the right of the start over the Gaussian of the whole well, "
        "lam = 2/kappa^2; to the left the odd terms have the other sign",
    )


def _rest(c: tuple[Any, ...]) -> Any:
    local = sum(x * h**j / sympy.factorial(j) for j, x in enumerate(c, start=2))
    return sympy.expand(local.subs(h, e * s) / e**2 - c2 * s**2 / 2)


def _of_partitions(c: tuple[Any, ...], n: int) -> Any:
    """The coefficient of delta^n of the exponential of a sum: over partitions of n."""
    total = sympy.S.Zero
    for parts in partitions(n):
        term = sympy.S.One
        for p, times in parts.items():
            factor = -c[p] * s ** (p + 2) / sympy.factorial(p + 2)
            term *= factor**times / sympy.factorial(times)
        total += term
    return total


def _powers(rest: Any, top: int) -> list[Any]:
    """E_0 to E_top by n E_n = -sum of p r_p E_(n - p), r_p the coefficient of delta^p in rest."""
    r = [rest.coeff(e, p) for p in range(top + 1)]
    power = [sympy.S.One]
    for n in range(1, top + 1):
        power.append(sympy.expand(-sum(p * r[p] * power[n - p] for p in range(1, n + 1)) / n))
    return power


def _moment(whole: Any, n: int, low: Any = -sympy.oo) -> Any:
    weight = sympy.exp(-c2 * s**2 / 2)
    return sympy.simplify(sympy.integrate(s**n * weight, (s, low, sympy.oo)) / whole)


def _mean(terms: Any, moments: Any, lowest: int = 4) -> Any:
    found = sympy.Poly(terms, s).terms()
    return sum(c * moments[(power - lowest) // 2] for (power,), c in found)


def _share(scene: Scene, at: Any, ctx: Any, sides: tuple[int, ...] = (-1, 1)) -> Any:
    """int e^{-lam V} to these sides of the well over its Gaussian, by quadrature."""
    low = ctx.mpf(1) / 10
    width = 1 / ctx.sqrt(-at * scene.phi(ctx, low, 1))
    bottom = scene.V(ctx, low)
    found = integral(
        ctx,
        lambda u: ctx.exp(-at * (scene.V(ctx, u) - bottom)),
        around(ctx, low, width, -1 if -1 in sides else low, 1 if 1 in sides else low),
    )
    return found / (width * ctx.sqrt(2 * ctx.pi))
