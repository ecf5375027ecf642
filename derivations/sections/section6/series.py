"""Section 6.2, weak noise: the corrections of a well or barrier to eq:Ttildesmall, to any order.

The first two are stated as textbooks have them, later ones as Perron's formula gives them, which
`symasym.expand` and ``method="laplace"`` evaluate. All are worked out by the same steps. From a
start on the well or barrier half of it counts, odd powers of delta enter, and the double integral
beside it.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache, partial
from itertools import pairwise
from typing import Any

import sympy
from sympy import Symbol
from sympy.utilities.iterables import partitions

from derivations.numerics import Scene, around, integral
from derivations.registry import derives
from derivations.sections.section6.well import S1
from symasym.derivation import Expansion, Identity, Order, Satisfies
from symasym.formulas.letters import Letters
from symasym.series.local import corner, finite_parts_in_s, gaussian

# A(u) = -(u - 1/10)(1 + u/3 - u^2/4 + u^3/2 + u^4/5): a well at 1/10, and none of c_2 ... c_6 is 0.
WELL = Fraction(1, 10)
QUARTIC = (Fraction(1), Fraction(1, 3), Fraction(-1, 4), Fraction(1, 2), Fraction(1, 5))
LARGE = ("1e3", "1e4", "1e5", "1e6")
lam = Symbol("lam", positive=True)
h, e = Symbol("h", positive=True), Symbol("e", positive=True)
s, t = Symbol("s", real=True), Symbol("t", real=True)
# (log(2 c_2 lam) + gamma)/2, a finite part where u - u1 has its own powers left out.
LOG = Symbol("L", real=True)
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
    rest = _beyond_gaussian(d, c)
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
    evaluated = gaussian(_phi(c), d.order + 1, Letters)
    series = sympy.S.One
    for k in range(1, d.order + 1):
        perron = sympy.expand(evaluated[k] / evaluated[0])
        series += lam**-k * d.step(
            f"{TIMES[k - 1]} correction",
            "evaluate",
            textbook.get(k, perron),
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
    values = _values(scene, c)
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
    order=1,
    orders=8,
)
def saddle_start(d: Any) -> None:
    (series,) = d.rests_on
    c = (c2, *(Symbol(f"c_{j}", real=True) for j in range(3, 2 * d.order + 4)))
    d.suppose("V' = 0 and V'' > 0 at the start; at a barrier -V takes the place of V")
    rest = _beyond_gaussian(d, c)
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
    evaluated = gaussian(_phi(c), d.order + 1, Letters, step=1)[1::2]
    beside = sympy.S.Zero
    for k in range(d.order + 1):
        # As for every k, and as textbooks have it for k = 0.
        perron = sympy.expand(evaluated[k])
        beside += lam**-k * d.step(
            f"{TIMES[k]} odd term",
            "evaluate",
            -c3 / (3 * c2**2) if k == 0 else perron,
            Satisfies(
                lambda found, k=k, perron=perron: {
                    "integral over s > 0": found - _mean(odd[k], moments, 3),
                    "Perron's formula": found - perron,
                }
            ),
            "as it is evaluated, by Perron's formula",
            left=f"P_{k}",
        )
    d.step(
        "first double integrals",
        "integrate",
        ((sympy.log(2) + sympy.EulerGamma) / 2,) * 2,
        Identity(_first_pairs),
        "in units of c_2 = 1, their finite parts, by Mellin's transform at its pole",
        left=(
            r"\mathrm{f.p.} \int_0^\infty ds \int_s^\infty e^{(s^2 - t^2)/2} \, dt",
            r"\mathrm{f.p.} \int_0^\infty ds \int_0^s e^{(t^2 - s^2)/2} \, dt",
        ),
    )
    for barrier, name in ((False, "well"), (True, "barrier")):
        d.step(
            f"double integral beside a {name}",
            "evaluate",
            _evaluated(c, d.order, barrier),
            Identity(lambda barrier=barrier: _double(rest, c, 2 * d.order + 1, barrier)),
            "what the start adds to the finite part of the regular part, as it is evaluated; here "
            "by parts from the first ones",
            left=tuple(rf"[\delta^{{{n + 2}}}] N" for n in range(2 * d.order + 2)),
        )
    corrections = [d.use(series, step=f"{TIMES[k]} correction") for k in range(d.order)]
    even = 1 + sum(q * lam ** -(k + 1) for k, q in enumerate(corrections))
    scene = scene_of(d.order + 1)
    values = _values(scene, c)
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
        "lam = 2/kappa^2; to the left the odd terms have the other sign. N is what the start adds "
        "to the double integral on its right, with 2 L = log(2 c_2 lam) plus Euler's constant",
    )


def _beyond_gaussian(d: Any, c: tuple[Any, ...]) -> Any:
    """The exponent beyond its Gaussian, in powers of delta, as a step."""
    return d.step(
        "beyond the Gaussian",
        "substitute",
        sum(x * s**j * e ** (j - 2) / sympy.factorial(j) for j, x in enumerate(c[1:], 3)),
        Identity(lambda: _rest(c)),
        "u = u1 + delta s with delta = lam^(-1/2), c_j = V^(j)(u1)",
        left=r"\lambda (V(u) - V(u_1)) - \tfrac{1}{2} c_2 s^2 \sim",
    )


def _values(scene: Scene, c: tuple[Any, ...]) -> dict[Any, Any]:
    """The derivatives of V at the scene's well."""
    return {
        x: lambda _, ctx, j=j: -scene.phi(ctx, ctx.mpf(1) / 10, j) for j, x in enumerate(c, start=1)
    }


def _phi(c: tuple[Any, ...], barrier: bool = False) -> list[Any]:
    """-V' in powers of u - u1, or V' of a barrier in place of a well."""
    sign = 1 if barrier else -1
    return [sympy.S.Zero, *(sign * x / sympy.factorial(j) for j, x in enumerate(c, 1))]


def _evaluated(c: tuple[Any, ...], order: int, barrier: bool) -> tuple[Any, ...]:
    """Coefficients of delta^2, delta^3, ... of the double integral beside the start.

    Even powers by Mellin's transform; what is odd in s or t is a product of one-sided series.
    """
    phi, count = _phi(c, barrier), order + 1
    half = [x / 2 for x in gaussian(phi, count, Letters)]
    odd = gaussian(phi, count, Letters, step=1)[1::2]
    other = [x * (-1) ** n for n, x in enumerate(odd)]
    plain, logs = corner([2 * x for x in half], barrier, Letters)
    more, found = finite_parts_in_s(phi, count, Letters), []
    log = 2 * LOG - sympy.EulerGamma - sympy.log(2 * c2)
    for n in range(count):
        even, mixed = (sum(x[i] * other[k - i] for i in range(k + 1))
                       for x, k in ((odd, n - 1), (half, n)))  # fmt: skip
        found.append(plain[n] + logs[n] * log + more[n] - (even if barrier else 0))
        found.append(-mixed if barrier else mixed)
    return tuple(sympy.expand(sympy.expand_log(x)) for x in found)


def _first_pairs() -> list[Any]:
    """The finite part of each, that of its Mellin transform at z = 0."""
    z = Symbol("z")
    half = 2 ** (z / 2) * sympy.gamma(1 + z / 2)
    found = (
        sympy.gamma(1 + z) * 2 ** (-z / 2 - 1) * sympy.gamma(-z / 2),
        # int_0^1 (1 - x^2)^(-1 - z/2) dx is a beta function.
        half * sympy.gamma(sympy.S.Half) * sympy.gamma(-z / 2) / (2 * sympy.gamma((1 - z) / 2)),
    )
    return [sympy.simplify(sympy.series(m, z, 0, 1).removeO().coeff(z, 0)) for m in found]


def _pair(i: int, j: int, barrier: bool) -> Any:
    """The finite part of the double integral of s^i t^j, t > s at a well, t < s at a barrier.

    K_j = int_s^oo t^j e^((s^2 - t^2)/2) dt = s^(j - 1) + (j - 1) K_(j - 2) and K_j' = s K_j - s^j,
    those of a barrier with other signs; powers of s have no finite part, and s^(i - 1) K_0 adds
    its values at the ends.
    """
    if j > 1:
        return (1 - j if barrier else j - 1) * _pair(i, j - 2, barrier)
    if j == 1:
        half = sympy.Rational(i + 1, 2)
        return -(2 ** (half - 1)) * sympy.gamma(half) if barrier else sympy.S.Zero
    if i == 0:
        return LOG
    if i == 1:
        return sympy.S.Zero if barrier else -sympy.sqrt(sympy.pi / 2)
    before, far = (i - 1) * _pair(i - 2, 0, barrier), 0
    if i % 2 == 0:
        far = sympy.factorial2(i - 3)
    return before - far if barrier else (-1) ** (i // 2 - 1) * far - before


def _double(rest: Any, c: tuple[Any, ...], top: int, barrier: bool) -> list[Any]:
    """The same from both exponentials in powers of delta, term by term."""
    ring, *_ = sympy.ring([s, t, *c[1:]], sympy.QQ)
    rise, fall = (
        [[ring.from_expr(x.subs(s, y)) for x in powers] for y in (s, t)]
        for powers in (_powers(-rest, top), _powers(rest, top))
    )
    outer, inner = (fall[0], rise[1]) if barrier else (rise[0], fall[1])
    pair, found = cache(_pair), []
    for n in range(top + 1):
        # Of each product of derivatives, which comes with one i + j alone.
        sums: dict[tuple[int, ...], list[Any]] = {}
        for (i, j, *powers), a in sum(outer[k] * inner[n - k] for k in range(n + 1)).terms():
            own = sums.setdefault((i + j, *powers), [])
            own.append(sympy.QQ.to_sympy(a) * pair(i, j, barrier))
        terms = [
            sympy.Add(*own) * sympy.Mul(*(x**p for x, p in zip(c[1:], powers, strict=True)))
            / c2 ** sympy.Rational(degree + 2, 2)
            for (degree, *powers), own in sums.items()
        ]  # fmt: skip
        found.append(sympy.expand(sympy.Add(*terms) if barrier else -sympy.Add(*terms)))
    return found


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
