"""Section 7, continued: critical points, folds, the threshold of the noise."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.paper import a_plus, alpha, eps, kappa, kappa_physical, mu, u, u1, u2, z0
from derivations.registry import derives
from derivations.sections.section7_friction import BETA, PEAK, shifted
from symasym.derivation import Identity, Inequality, Satisfies

ANGLE = Symbol("omega", positive=True)


@derives("cubic", "The equation of the critical points", ("eq:phifric0",))
def cubic(d: Any) -> None:
    found = d.step(
        "zero of the drift inside",
        "substitute",
        1 - z0 - alpha * (1 + mu) * u + alpha * mu * u**3,
        Identity(lambda: d.use("eq:phifric0", "phi(u)")[1]),
        left="A(u)",
    )
    d.step(
        "discriminant",
        "solve",
        4 * alpha**4 * mu * (1 + mu) ** 3 - 27 * alpha**2 * mu**2 * (1 - z0) ** 2,
        Identity(lambda: sympy.discriminant(found, u)),
        "positive between the folds: three real roots, the third outside |u| < 1 when crossing",
        left=r"\operatorname{disc}_u A",
    )
    d.conclude(sympy.S.Zero, found, display=(found, " = 0"))


@derives("folds", "Where two critical points coalesce", ("cubic", "turning-points", "beta"))
def folds(d: Any) -> None:
    d.suppose("mu > 1/2", where="else the folds are at |u| >= 1, outside the layer")
    at = d.step(
        "position",
        "solve",
        PEAK,
        Satisfies(
            lambda s: {
                "double root": sympy.diff(d.use("cubic", "0"), u).subs(u, s),
                "turning point of the force": s - d.use("turning-points", "u_s"),
            }
        ),
        left="u_s",
    )
    found = d.step(
        "spring extension",
        "solve",
        (1 - BETA, 1 + BETA),
        Satisfies(
            lambda ends: {
                "root at +u": d.use("cubic", "0").subs(u, at).subs(z0, ends[0]),
                "root at -u": d.use("cubic", "0").subs(u, -at).subs(z0, ends[1]),
                "1 - beta": ends[0] - 1 + d.use("beta", "beta"),
            }
        ),
        "z0^(+-) = 1 -+ beta",
        left=(
            "z_0^{(+)}",
            "z_0^{(-)}",
        ),
    )
    d.step(
        "mu = 3, alpha = 1",
        "evaluate",
        sympy.Rational(-7, 9),
        Identity(lambda: found[0].subs({mu: 3, alpha: 1})),
        "printed as -0.78",
        left="z_0^{(+)}",
    )
    d.conclude((Symbol("z_plus"), Symbol("z_minus")), found)


@derives("fr1", "a+ and A' of the friction drift", ("eq:phifric0",))
def parameters(d: Any) -> None:
    plus = d.step(
        "a+",
        "evaluate",
        1 - z0 - alpha,
        Identity(lambda: d.use("eq:phifric0", "phi(u)")[2]),
        "printed with + alpha, which is a-",
        left="a^+",
    )
    slope = d.step(
        "A'",
        "differentiate",
        -alpha * (1 + mu - 3 * mu * u**2),
        Identity(lambda: sympy.diff(d.use("eq:phifric0", "phi(u)")[1], u)),
        left="A'(u)",
    )
    d.conclude((a_plus, Symbol("A'")), (plus, slope))


@derives("fr2", "Order and stability of the two critical points", ("cubic", "fr1"))
def critical_points(d: Any) -> None:
    c = Symbol("c", positive=True)
    third = Symbol("u3", real=True)

    def coefficients() -> list[Any]:
        return list(sympy.Poly(d.use("cubic", "0"), u).all_coeffs())

    def vieta() -> list[Any]:
        product = sympy.expand(coefficients()[0] * (u - u1) * (u - u2) * (u - third))
        slope = sympy.diff(product, u)
        return [sympy.factor(slope.subs(u, u1)), sympy.factor(slope.subs(u, u2))]

    both = d.step(
        "slopes at the roots",
        "differentiate",
        (alpha * mu * (u1 - u2) * (u1 - third), alpha * mu * (u2 - u1) * (u2 - third)),
        Identity(vieta),
        "A is alpha mu (u - u1)(u - u2)(u - u3)",
        left=(
            r"A'(u_1) = \lim_{u \to u_1} \frac{A(u)}{u - u_1} =",
            r"A'(u_2) = \lim_{u \to u_2} \frac{A(u)}{u - u_2} =",
        ),
    )
    lower, upper, gap = (Symbol(n, positive=True) for n in ("p", "q", "h"))
    put = {u1: third + lower, u2: third + lower + gap}
    d.step(
        "slope at u1, u3 < u1 < u2",
        "bound",
        Inequality(both[0], "<", sympy.S.Zero),
        shifted(alpha * mu * gap * lower, put, "u3 < u1 < u2"),
        "the well; strict apart from folds",
    )
    d.step(
        "slope at u2, u3 < u1 < u2",
        "bound",
        Inequality(both[1], ">", sympy.S.Zero),
        shifted(alpha * mu * gap * (lower + gap), put, "u3 < u1 < u2"),
        "the barrier",
    )
    lowest = d.step(
        "sum of the roots",
        "solve",
        -u1 - u2,
        Identity(
            lambda: sympy.solve(
                sympy.Poly(sympy.expand((u - u1) * (u - u2) * (u - third)), u).all_coeffs()[1]
                - coefficients()[1] / coefficients()[0],
                third,
            )[0]
        ),
        "no u^2 in the cubic: u3 = -(u1 + u2), the lowest when u1, u2 > 0",
        left="u_3",
    )

    d.step(
        "the same by A'",
        "substitute",
        tuple(slope.subs(third, lowest) for slope in both),
        Identity(lambda: _by_slope(d, coefficients(), lowest)),
        "fr1 at the roots, 1 + mu by Vieta's formula",
        left=(
            "A'(u_1)",
            "A'(u_2)",
        ),
    )
    no_root = d.step(
        "drift left of the start",
        "substitute",
        1 - z0 + alpha * (c + mu * c - mu * c**3),
        Identity(lambda: d.use("cubic", "0").subs(u, -c)),
        "at u = -c",
        left="A(-c)",
    )
    d.step(
        "no root in u < 0 when crossing",
        "bound",
        Inequality(no_root, ">", sympy.S.Zero),
        shifted(
            _positive_left(upper, lower),
            {c: 1 / (1 + upper), z0: 1 - alpha - lower},
            "u = -c, 0 < c < 1, z0 < 1 - alpha",
        ),
        "so 0 < u1 < u2: the start is left of the well",
    )
    d.conclude((Symbol("A'_1"), Symbol("A'_2")), both, note="u3 = -(u1 + u2), the third root")


def _by_slope(d: Any, cubic: list[Any], lowest: Any) -> list[Any]:
    """A' of fr1 at u1 and u2, with the cubic's coefficient of u by its roots."""
    linear = Symbol("B", real=True)
    slope = sympy.expand(d.use("fr1", "A'"))
    # The constant term of A' is the cubic's coefficient of u.
    if sympy.expand(slope.subs(u, 0) - cubic[2]) != 0:
        raise ValueError(f"A' is {slope.subs(u, 0)} at 0, the cubic has {cubic[2]}.")
    by_roots = cubic[0] * (u1 * u2 + (u1 + u2) * lowest)
    general = linear + slope - sympy.expand(slope.subs(u, 0))
    return [general.subs(u, at).subs(linear, by_roots) for at in (u1, u2)]


def _positive_left(q: Any, s: Any) -> Any:
    """The drift at u = -1/(1+q) for z0 = 1 - alpha - s, as a sum of positive terms."""
    c = 1 / (1 + q)
    return alpha + s + alpha * c + alpha * mu * q * (q + 2) / (1 + q) ** 3


def _reduced(expression: Any) -> Any:
    """A polynomial in cos(omega) and sin(omega), with sin^2 = 1 - cos^2 put in."""
    c, s = Symbol("c"), Symbol("s")
    poly = sympy.Poly(sympy.expand(expression.subs({sympy.cos(ANGLE): c, sympy.sin(ANGLE): s})), s)
    return sympy.expand(
        sum(
            coefficient * s ** (power % 2) * (1 - c**2) ** (power // 2)
            for (power,), coefficient in poly.terms()
        )
    )


@derives(
    "friction-well",
    "Well and barrier of the friction drift in closed form",
    ("beta", "turning-points", "cubic", "fr2", "eq:Vfric"),
)
def closed_form(d: Any) -> None:
    cos, sin, root = sympy.cos(ANGLE), sympy.sin(ANGLE), sympy.sqrt(3)
    d.step(
        "angle",
        "solve",
        sympy.Rational(2, 3) * sympy.asin(sympy.sqrt((1 - (1 - z0) / BETA) / 2)),
        Satisfies(
            lambda w: {
                "cos(3 omega)": 1
                - 2 * sympy.sin(sympy.Rational(3, 2) * w) ** 2
                - (1 - z0) / d.use("beta", "beta"),
                "in (0, pi/2)": sympy.sin(sympy.Rational(3, 2) * w)
                - sympy.sqrt((1 - (1 - z0) / d.use("beta", "beta")) / 2),
            }
        ),
        "beta cos(3 omega) = 1 - z0; from the sine, which keeps its digits beside the fold",
        left=r"\omega",
    )
    on_angle = 1 - d.use("beta", "beta") * (4 * cos**3 - 3 * cos)
    both = d.step(
        "roots",
        "solve",
        (PEAK * (cos - root * sin), PEAK * (cos + root * sin)),
        Satisfies(
            lambda pair: {
                "cubic at u1": _reduced(d.use("cubic", "0").subs(u, pair[0]).subs(z0, on_angle)),
                "cubic at u2": _reduced(d.use("cubic", "0").subs(u, pair[1]).subs(z0, on_angle)),
                "u2 - u1": pair[1] - pair[0] - 2 * root * d.use("turning-points", "u_s") * sin,
            }
        ),
        "cos(3 omega) = 4 c^3 - 3 c for c = cos(omega); 0 < omega < pi/6 for 0 < 1 - z0 < beta",
        left=(
            "u_1",
            "u_2",
        ),
    )
    slopes = d.step(
        "slopes",
        "substitute",
        (
            -2 * alpha * (1 + mu) * sin * (root * cos - sin),
            2 * alpha * (1 + mu) * sin * (root * cos + sin),
        ),
        Identity(
            lambda: [
                slope.subs(Symbol("u3", real=True), -u1 - u2).subs(
                    {u1: both[0], u2: both[1]}, simultaneous=True
                )
                for slope in d.use("fr2", "A'_1", "A'_2")
            ]
        ),
        left=(
            "A'(u_1)",
            "A'(u_2)",
        ),
    )
    barrier = d.step(
        "barrier",
        "evaluate",
        4 * root / 3 * alpha * (1 + mu) ** 2 / mu * sin**3 * cos,
        Satisfies(
            lambda D: {
                "V(u2) - V(u1)": _reduced(
                    (
                        d.use("eq:Vfric", "V(u)")[1].subs(u, both[1])
                        - d.use("eq:Vfric", "V(u)")[1].subs(u, both[0])
                    ).subs(z0, on_angle)
                    - D
                )
            }
        ),
        "one product: a difference of potentials would lose its digits beside the fold",
        left="D",
    )
    d.conclude(
        sympy.symbols("A'_1 A'_2 D"),
        (*slopes, barrier),
        note="for z0 < 1 and a well and a barrier in the layer: mu > 1/2, alpha < 1 - z0 < beta; "
        "omega is a third of arccos((1 - z0)/beta)",
    )


@derives(
    "threshold",
    "The noise below which the escape time is exponentially large",
    ("eq:Ttildesmall", "eq:TtildetoT", "eq:tildexykappa"),
)
def threshold(d: Any) -> None:
    D, k, big = Symbol("D", positive=True), kappa_physical, Symbol("ell", positive=True)

    def exponential() -> Any:
        (well,) = d.use("eq:Ttildesmall", "T").leading.atoms(sympy.exp)
        scaled = well.subs(kappa, d.use("eq:tildexykappa", "kappa"))
        return d.use("eq:TtildetoT", "T").subs(Symbol("t_s", positive=True), scaled)

    size = d.step(
        "exponential factor of the well's term",
        "substitute",
        eps * sympy.exp(2 * D * eps / k**2),
        Identity(exponential),
        "without its prefactor, unscaled",
        left=r"\varepsilon e^{2 D/\kappa^2}",
    )

    def solved() -> Any:
        # The size is 1, with eps = e^{-ell} before the exponential.
        square = Symbol("X", positive=True)
        logarithm = sympy.expand_log(sympy.log(size)).subs(sympy.log(eps), -big)
        return sympy.sqrt(sympy.solve(logarithm.subs(k, sympy.sqrt(square)), square)[0])

    found = d.step(
        "noise at which eps e^{2 D eps/kappa_phys^2} = 1",
        "solve",
        sympy.sqrt(2 * D * eps / big),
        Identity(solved),
        "the paper's rule is the case 2 D = 1",
        left=r"\kappa_{c,p}",
    )
    d.step(
        "larger noise, shorter time",
        "differentiate",
        -4 * D * eps / k**3 * size,
        Identity(lambda: sympy.diff(size, k)),
        "negative: exponentially large times need kappa_phys below the threshold, not above",
        left=r"\frac{d}{d\kappa_p} \left[\varepsilon e^{2 D \varepsilon/\kappa_p^2}\right]",
    )
    d.step(
        "the time at the threshold",
        "substitute",
        1 / eps,
        Identity(lambda: (size.subs(k, found) / eps).subs(big, -sympy.log(eps))),
        "of order 1/eps in scaled time, the prefactor left out",
        left=r"e^{2 D \varepsilon/\kappa_{c,p}^2}",
    )
    d.step(
        "eps = 0.01, 2 D = 1",
        "evaluate",
        sympy.sqrt(sympy.Rational(1, 100) / sympy.log(100)),
        Identity(
            lambda: found.subs(big, -sympy.log(eps)).subs(
                {D: sympy.Rational(1, 2), eps: sympy.Rational(1, 100)}
            )
        ),
        "0.0466, which the paper rounds to 0.05",
        left=r"\kappa_{c,p}",
    )
    d.conclude(
        Symbol("kappa_c"),
        found,
        "leading exponential scale; prefactors left out",
        note="D is the height of the barrier, V(u2) - V(u1)",
    )
