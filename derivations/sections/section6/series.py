"""Section 6.2, weak noise: the first two corrections of a well or barrier to eq:Ttildesmall."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Symbol

from derivations.numerics import Scene, around, integral
from derivations.registry import derives
from derivations.sections.section6.well import S1
from symasym.derivation import Expansion, Identity, Order

# A(u) = -(u - 1/10)(1 + u/3 - u^2/4 + u^3/2 + u^4/5): a well at 1/10, and none of c_2 ... c_6 is 0.
WELL = Fraction(1, 10)
QUARTIC = (Fraction(1), Fraction(1, 3), Fraction(-1, 4), Fraction(1, 2), Fraction(1, 5))
SCENE = Scene(
    tuple(
        (WELL * QUARTIC[k] if k < 5 else Fraction(0)) - (QUARTIC[k - 1] if k else Fraction(0))
        for k in range(6)
    )
)
LARGE = ("1e3", "1e4", "1e5", "1e6")
lam = Symbol("lam", positive=True)
h, e = Symbol("h", positive=True), Symbol("e", positive=True)
s = Symbol("s", real=True)
c2 = Symbol("c_2", positive=True)
c3, c4, c5, c6 = (Symbol(f"c_{j}", real=True) for j in range(3, 7))


@derives(
    "saddle-series",
    "The first two corrections to Laplace's method at a well or a barrier",
    ("gaussian-step",),
)
def saddle_series(d: Any) -> None:
    d.suppose("V' = 0 and V'' > 0 at the well; at a barrier -V takes the place of V")
    rest = d.step(
        "beyond the Gaussian",
        "substitute",
        c3 * s**3 * e / 6 + c4 * s**4 * e**2 / 24 + c5 * s**5 * e**3 / 120 + c6 * s**6 * e**4 / 720,
        Identity(_rest),
        "u = u1 + delta s with delta = lam^(-1/2), c_j = V^(j)(u1)",
        left=r"\lambda (V(u) - V(u_1)) - \tfrac{1}{2} c_2 s^2 \sim",
    )
    first = c3**2 * s**6 / 72 - c4 * s**4 / 24
    second = (
        c3**4 * s**12 / 31104
        - c3**2 * c4 * s**10 / 1728
        + c3 * c5 * s**8 / 720
        + c4**2 * s**8 / 1152
        - c6 * s**6 / 720
    )
    d.step(
        "even powers of delta",
        "expand",
        (first, second),
        Identity(lambda: _even(rest)),
        "odd powers of delta are odd in s, and their integrals vanish",
        left=(
            r"[\delta^2]",
            r"[\delta^4]",
        ),
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
    moments = d.step(
        "Gaussian moments",
        "integrate",
        (3 / c2**2, 15 / c2**3, 105 / c2**4, 945 / c2**5, 10395 / c2**6),
        Identity(lambda: _moments(whole)),
        "of s^4, s^6, ..., s^12",
        left=(
            r"\langle s^{4} \rangle",
            r"\langle s^{6} \rangle",
            r"\langle s^{8} \rangle",
            r"\langle s^{10} \rangle",
            r"\langle s^{12} \rangle",
        ),
    )
    one = d.step(
        "first correction",
        "evaluate",
        5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2),
        Identity(lambda: _mean(first, moments)),
        left="Q_1",
    )
    two = d.step(
        "second correction",
        "evaluate",
        385 * c3**4 / (1152 * c2**6)
        - 35 * c3**2 * c4 / (64 * c2**5)
        + 35 * c4**2 / (384 * c2**4)
        + 7 * c3 * c5 / (48 * c2**4)
        - c6 / (48 * c2**3),
        Identity(lambda: _mean(second, moments)),
        left="Q_2",
    )
    c = (c2, c3, c4, c5, c6)
    values: dict[Any, Any] = {
        x: lambda _, ctx, j=j: -SCENE.phi(ctx, ctx.mpf(1) / 10, j) for j, x in enumerate(c, start=1)
    }
    series = 1 + one / lam + two / lam**2
    for name, kept, order in (
        ("order after one", 1 + one / lam, 2),
        ("order after two", series, 3),
    ):
        d.step(
            name,
            "expand",
            Expansion(kept, lam**-order, lam, sympy.oo),
            Order(_share, LARGE, values, digits=60),
            left="Q",
        )
    d.conclude(
        Symbol("S"),
        Expansion(series, lam**-3, lam, sympy.oo),
        "O(lam^-3)",
        note="Q is int e^(-lam V) about the well over its Gaussian, lam = 2/kappa^2",
    )


def _rest() -> Any:
    local = sum(c * h**j / sympy.factorial(j) for j, c in enumerate((c2, c3, c4, c5, c6), start=2))
    return sympy.expand(local.subs(h, e * s) / e**2 - c2 * s**2 / 2)


def _even(rest: Any) -> list[Any]:
    whole = sympy.expand(sympy.series(sympy.exp(-rest), e, 0, 5).removeO())
    return [whole.coeff(e, 2), whole.coeff(e, 4)]


def _moments(whole: Any) -> list[Any]:
    weight = sympy.exp(-c2 * s**2 / 2)
    return [
        sympy.simplify(sympy.integrate(s**n * weight, (s, -sympy.oo, sympy.oo)) / whole)
        for n in range(4, 14, 2)
    ]


def _mean(terms: Any, moments: Any) -> Any:
    found = sympy.Poly(terms, s).terms()
    return sum(c * moments[power // 2 - 2] for (power,), c in found)


def _share(at: Any, ctx: Any) -> Any:
    """int e^{-lam V} about the well over its Gaussian, by quadrature."""
    low = ctx.mpf(1) / 10
    width = 1 / ctx.sqrt(-at * SCENE.phi(ctx, low, 1))
    bottom = SCENE.V(ctx, low)
    found = integral(
        ctx, lambda u: ctx.exp(-at * (SCENE.V(ctx, u) - bottom)), around(ctx, low, width, -1, 1)
    )
    return found / (width * ctx.sqrt(2 * ctx.pi))
