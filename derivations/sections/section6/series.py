r"""Section 6.2, weak noise: the corrections of a well or a barrier to eq:Ttildesmall, to any order.

The first two corrections are stated as in textbooks, the others by Perron's formula, which the library
evaluates. For a start on the well or the barrier half of each correction counts, and odd powers and a double
integral beside the start are added.
"""

from fractions import Fraction
from functools import cache
from itertools import pairwise

import sympy
from sympy import (
    EulerGamma,
    Integral,
    Rational,
    S,
    Symbol,
    Tuple,
    exp,
    expand,
    factorial,
    gamma,
    log,
    oo,
    pi,
    sqrt,
)

from derivations.numerics import Scene, around, integral
from derivations.paper import kappa
from derivations.sections.section6.well import S1, c2, c3, c4
from symasym.derivation.derivation import derives
from symasym.formulas.letters import Letters
from symasym.series import corner, finite_parts_in_s, gaussian

c5, c6, h, s, t = sympy.symbols("c_5 c_6 h s t", real=True)
lam, e, Q = sympy.symbols(r"lam \delta Q", positive=True)
n, z = Symbol("n", integer=True, positive=True), Symbol("z")
LARGE = ("1e5", "1e6")
TIMES = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth"]
TEXTBOOK = {1: 5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2),
            2: (385 * c3**4 / (1152 * c2**6) - 35 * c3**2 * c4 / (64 * c2**5) + 35 * c4**2 / (384 * c2**4)
                + 7 * c3 * c5 / (48 * c2**4) - c6 / (48 * c2**3))}
OF_V = r"$c_j = V^{(j)}$ there, a scaled velocity over scaled length to the power $j - 1$; $\lambda = 2/\kappa^2$"


def derivatives(last):
    return c2, *sympy.symbols(f"c_3:{last + 1}", real=True)


def scene_of(order):
    """A well at 1/10, with enough powers of u for the derivatives of V not to be 0."""
    more = (Fraction((-1) ** k, 20) for k in range(5, 2 * order + 1))
    factor = (0, 1, Fraction(1, 3), Fraction(-1, 4), Fraction(1, 2), Fraction(1, 5), *more, 0)
    scene = Scene(tuple(Fraction(b, 10) - a for a, b in pairwise(factor)))
    at = {x: lambda _, ctx, j=j: -scene.phi(ctx, ctx.mpf(1) / 10, j)
          for j, x in enumerate(derivatives(2 * order + 2), 1)}
    return scene, at


def share(scene, *sides):
    """int e^{-lam V} to these sides of the well over its Gaussian, by quadrature."""
    def exact(rate, ctx):
        low = ctx.mpf(1) / 10
        width, bottom = 1 / ctx.sqrt(-rate * scene.phi(ctx, low, 1)), scene.V(ctx, low)
        ends = around(ctx, low, width, -1 if -1 in sides else low, 1 if 1 in sides else low)
        value = integral(ctx, lambda u: ctx.exp(-rate * (scene.V(ctx, u) - bottom)), ends)
        return value / (width * ctx.sqrt(2 * ctx.pi))
    return exact


def beyond_gaussian(d, c):
    local = sum(x * h**j / factorial(j) for j, x in enumerate(c, 2))
    return d.eq("beyond the Gaussian", r"\lambda (V(u) - V(u_1)) - c_2 s^2/2 \sim",
                sum(x * s**j * e ** (j - 2) / factorial(j) for j, x in enumerate(c[1:], 3)),
                r"substitute $u = u_1 + \delta s$ with $\delta = \lambda^{-1/2}$",
                by=expand(local.subs(h, e * s) / e**2 - c2 * s**2 / 2))


def powers(rest, top):
    """E_0 to E_top, the powers of e in exp(-rest), by n E_n = -sum of p r_p E_(n - p)."""
    found = [S.One]
    for m in range(1, top + 1):
        found.append(expand(-sum(p * rest.coeff(e, p) * found[m - p] for p in range(1, m + 1)) / m))
    return found


def mean(terms, moment):
    """The integral of a polynomial in s, term by term."""
    return sum(a * moment(m) for (m,), a in sympy.Poly(terms, s).terms())


def phi(c, barrier=False):
    """-V' in powers of u - u1, or V' of a barrier."""
    return [S.Zero, *((1 if barrier else -1) * x / factorial(j) for j, x in enumerate(c, 1))]


@derives("saddle-series", "Corrections to Laplace's method at a well or a barrier", n=2)
def saddle_series(d):
    d.suppose("$V' = 0$ and $V'' > 0$ at the well; at a barrier $V$ is replaced by $-V$")
    c = derivatives(2 * d.n + 2)
    even = powers(beyond_gaussian(d, c), 2 * d.n)
    whole = d.eq("Gaussian", Integral(exp(-c2 * s**2 / 2), (s, -oo, oo)), sqrt(2 * pi / c2),
                 r"this is the integral of 'gaussian-step' with $\kappa = \sqrt{2} \delta$",
                 by=d["gaussian-step", "one Gaussian"].subs({kappa: sqrt(2) * e, S1: c2}) / e)
    moment = d.eq("Gaussian moments", Integral(s ** (2 * n) * exp(-c2 * s**2 / 2), (s, -oo, oo)) / whole,
                  2**n * gamma(n + Rational(1, 2)) / (sqrt(pi) * c2**n), "odd powers of $s$, and hence of "
                  r"$\delta$, give 0")
    peak, series = gaussian(phi(c), d.n + 1, Letters), S.One
    for k in range(1, d.n + 1):
        series += d.eq(f"{TIMES[k - 1]} correction", f"Q_{k} =", TEXTBOOK.get(k) or expand(peak[k] / peak[0]),
                       rf"the mean of the term in $\delta^{{{2 * k}}}$ agrees with Perron's formula",
                       lambda stated, k=k: [(mean(even[2 * k], lambda m: moment.subs(n, m // 2)), stated),
                                            (peak[k] / peak[0], stated)]) / lam**k
    scene, values = scene_of(d.n)
    d.order("remainder", Q, series, lam ** -(d.n + 1), share(scene, -1, 1), LARGE, values,
            r"measured as $\lambda \to \infty$",
            40 + 10 * d.n)
    d.conclude(note=r"$Q$ is $\int e^{-\lambda V}$ about the well over its Gaussian; " + OF_V)


@derives("saddle-start", "Laplace's method from a start on a well or a barrier", n=1)
def saddle_start(d):
    d.suppose("$V' = 0$ and $V'' > 0$ at the start; at a barrier $V$ is replaced by $-V$")
    c, top = derivatives(2 * d.n + 3), 2 * d.n + 1
    rest = beyond_gaussian(d, c)
    odd = powers(rest, top)
    moment = d.eq("moments of half a Gaussian", Integral(s ** (2 * n + 1) * exp(-c2 * s**2 / 2), (s, 0, oo)),
                  2**n * factorial(n) / c2 ** (n + 1), "over $s > 0$ the odd powers do not vanish")
    peak, beside = gaussian(phi(c), d.n + 1, Letters, step=1)[1::2], S.Zero
    for k in range(d.n + 1):
        beside += d.eq(f"{TIMES[k]} odd term", f"P_{k} =", expand(peak[k]) if k else -c3 / (3 * c2**2),
                       rf"the integral of the term in $\delta^{{{2 * k + 1}}}$ agrees with Perron's formula",
                       lambda stated, k=k: [(mean(odd[2 * k + 1], lambda m: moment.subs(n, m // 2)), stated),
                                            (peak[k], stated)]) / lam**k
    half = 2 ** (z / 2) * gamma(1 + z / 2)
    mellin = (gamma(1 + z) * 2 ** (-z / 2 - 1) * gamma(-z / 2),
              half * sqrt(pi) * gamma(-z / 2) / (2 * gamma((1 - z) / 2)))
    finite = [sympy.simplify(sympy.series(x, z, 0, 1).removeO().coeff(z, 0)) for x in mellin]
    first = [d.eq(f"first double integral beside a {name}",
                  rf"\mathrm{{f.p.}} \int_0^\infty ds \int_{ends} {power} \, dt =", (log(2) + EulerGamma) / 2,
                  "in units with $c_2 = 1$ it is the finite part of a Mellin transform at its pole", by=value)
             for name, ends, power, value in (("well", r"s^\infty", "e^{(s^2 - t^2)/2}", finite[0]),
                                              ("barrier", "0^s", "e^{(t^2 - s^2)/2}", finite[1]))]
    for barrier, name in enumerate(("well", "barrier")):
        worked = double(rest, c, top, barrier, first[barrier] + log(c2 * lam) / 2)
        own = f"N_{name[0]}"
        terms = Tuple(*(Symbol(rf"[\delta^{{{k + 2}}}] {own}") for k in range(top + 1)))
        d.eq(f"double integral beside a {name}", terms, Tuple(*evaluated(c, d.n, barrier)),
             "this is the contribution of the start to the finite part of the regular part; it follows from the "
             "first one by parts",
             by=Tuple(*worked))
    even = 1 + sum(d["saddle-series", f"{TIMES[k]} correction"] / lam ** (k + 1) for k in range(d.n))
    scene, values = scene_of(d.n + 1)
    for side, name, left in ((1, "right", "H_+"), (-1, "left", "H_-")):
        whole = even / 2 + side * sqrt(c2 / (2 * pi * lam)) * beside
        d.order(f"to the {name}", left, whole, lam ** -(d.n + 1), share(scene, side), LARGE, values,
                "each side has half of the corrections and the odd terms, whose "
                "signs depend on the side", 40 + 10 * d.n)
    d.conclude("to the right", "to the left", "double integral beside a well", "double integral beside a barrier",
               note=r"$H_+$ is $\int e^{-\lambda V}$ to the right of the start over the well's Gaussian; " + OF_V +
                    r". $[\delta^k] N_w$ and $[\delta^k] N_b$ are the coefficients of $\delta^k$, $\delta = "
                    r"\lambda^{-1/2}$, in what a start on a well and on a barrier adds to the double integral on "
                    r"its right; $\gamma$ is Euler's constant")


def evaluated(c, order, barrier):
    """Coefficients of delta^2, delta^3, ... of the double integral beside the start, as the library has them.

    Even powers by Mellin's transform; what is odd in s or t is a product of one-sided series.
    """
    field, count = phi(c, barrier), order + 1
    half = [x / 2 for x in gaussian(field, count, Letters)]
    odd = gaussian(field, count, Letters, step=1)[1::2]
    other = [x * (-1) ** k for k, x in enumerate(odd)]
    whole = [2 * x for x in half]
    plain, logs = corner(whole, barrier, Letters, whole)
    more, found = finite_parts_in_s(field, count, Letters), []
    for k in range(count):
        even, mixed = (sum(x[i] * other[m - i] for i in range(m + 1)) for x, m in ((odd, k - 1), (half, k)))
        found.append(plain[k] + logs[k] * log(lam) + more[k] - (even if barrier else 0))
        found.append(-mixed if barrier else mixed)
    return [expand(sympy.expand_log(x)) for x in found]


def double(rest, c, top, barrier, first):
    """The same from both exponentials in powers of delta, term by term."""
    @cache
    def pair(i, j):
        """The finite part of the double integral of s^i t^j, t > s at a well, t < s at a barrier.

        K_j = int_s^oo t^j e^((s^2 - t^2)/2) dt = s^(j - 1) + (j - 1) K_(j - 2) and K_j' = s K_j - s^j, those of a
        barrier with other signs; powers of s have no finite part, and s^(i - 1) K_0 adds its values at the ends.
        """
        if j > 1:
            return (1 - j if barrier else j - 1) * pair(i, j - 2)
        if j == 1:
            return -(2 ** (Rational(i - 1, 2)) * gamma(Rational(i + 1, 2))) if barrier else S.Zero
        if i < 2:
            return first if i == 0 else S.Zero if barrier else -sqrt(pi / 2)
        far = 0 if i % 2 else sympy.factorial2(i - 3)
        before = (i - 1) * pair(i - 2, 0)
        return before - far if barrier else (-1) ** (i // 2 - 1) * far - before

    (outer, x), (inner, y) = ((rest, s), (-rest, t)) if barrier else ((-rest, s), (rest, t))
    outer, inner = (powers(a.subs(s, b), top) for a, b in ((outer, x), (inner, y)))
    found = []
    for m in range(top + 1):
        terms = sympy.Poly(expand(sum(outer[k] * inner[m - k] for k in range(m + 1))), s, t).terms()
        total = sum(a * pair(i, j) / c2 ** Rational(i + j + 2, 2) for (i, j), a in terms)
        found.append(expand(total if barrier else -total))
    return found
