"""Section 7: the friction oscillator."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.labels import DEFINITIONS
from derivations.paper import alpha, kappa_physical, mu, phi, u, z0
from derivations.registry import derives
from derivations.sections.section4_reduction import REGIONS
from symasym.derivation import Bound, Definition, Identity, Inequality, Satisfies

y, z = Symbol("y", real=True), Symbol("z", real=True)


def shifted(difference: Any, given: dict[Any, Any], on: str) -> Bound:
    """A certificate on a range that a substitution puts into the symbols' assumptions."""
    return Bound(difference=difference, given=given, on=on)


_cubic = u + mu * (u - u**3)
PEAK = sympy.sqrt((1 + mu) / (3 * mu))
BETA = 2 * alpha * (1 + mu) ** sympy.Rational(3, 2) / (3 * sympy.sqrt(3 * mu))
_above = Symbol("m", positive=True)
_HALF = sympy.Rational(1, 2)


@derives("eq:osc2", "The oscillator as a first-order system")
def first_order(d: Any) -> None:
    F, v = sympy.Function("F"), Symbol("v")

    def from_second_order() -> Any:
        text, _ = DEFINITIONS["eq:osc1"].text.split(" = 0")
        second = Symbol("second")
        named = {"second": second, "first": v, "z": z, "F": F}
        model = sympy.sympify(text.replace("z''", "second").replace("z'", "first"), named)
        (acceleration,) = sympy.solve(model, second)
        return acceleration

    d.names |= {v: r"\dot z"}
    acceleration = d.step(
        "acceleration",
        "solve",
        -v - z - F(v + 1),
        Identity(from_second_order),
        "the equation of motion, eq:osc1, solved for the second derivative",
        left=r"\ddot z",
    )
    found = d.step(
        "relative velocity",
        "substitute",
        (y - 1, 1 - z - y - F(y)),
        Identity(lambda: [y - 1, acceleration.subs(v, y - 1)]),
        "y = dz/dt + 1 is the velocity of the block relative to the belt",
        left=(
            r"\dot z",
            r"\dot y",
        ),
    )
    d.conclude((Symbol("zdot"), Symbol("ydot")), found)


@derives("eq:forcePWC", "Coulomb friction: where it slides", ("eq:osc2", "regions", "filippov"))
def coulomb(d: Any) -> None:
    F = sympy.Function("F")

    def ends() -> list[Any]:
        at_zero = d.use("eq:osc2", "ydot").subs(y, 0)
        return [at_zero.subs(F(0), -alpha), at_zero.subs(F(0), alpha)]

    both = d.step(
        "field on either side of y = 0",
        "substitute",
        (1 - z + alpha, 1 - z - alpha),
        Identity(ends),
        "a- and a+ on the surface",
        left=(
            "a^-",
            "a^+",
        ),
    )
    edges = d.step(
        "edges of the sliding region",
        "solve",
        (1 - alpha, 1 + alpha),
        Identity(lambda: [sympy.solve(both[1], z)[0], sympy.solve(both[0], z)[0]]),
        "a- > 0 > a+ between them; one sign outside: crossing",
        left=(
            "z_1",
            "z_2",
        ),
    )
    third = (edges[1] - edges[0]) / 3

    def directions() -> list[Any]:
        table = dict(zip(REGIONS, d.use("regions", "N"), strict=True))
        signs = [tuple(int(sympy.sign(field.subs(z, at))) for field in both) for at in beside]
        return [table[minus, plus] for minus, plus in signs]

    beside = (edges[0] - third, edges[0] + third, edges[1] + third)
    d.step(
        "left of both edges, between them, right of both",
        "evaluate",
        (sympy.Integer(1), sympy.Integer(2), sympy.Integer(1)),
        Identity(directions),
        "fields that point at the surface: 2 is sliding, 1 crossing",
        left=(
            r"N \big|_{z < z_1}",
            r"N \big|_{z_1 < z < z_2}",
            r"N \big|_{z > z_2}",
        ),
    )

    def velocity() -> Any:
        along = d.use("eq:osc2", "zdot").subs(y, 0)
        put = {"a_minus": both[0], "a_plus": both[1], "g_minus": along, "g_plus": along}
        field = d.use("filippov", "g_s")
        return field.subs({s: put[s.name] for s in field.free_symbols}, simultaneous=True)

    d.step(
        "sliding velocity",
        "substitute",
        sympy.Integer(-1),
        Identity(velocity),
        "to the left: the block rides the belt",
        left="g_s",
    )
    d.conclude((Symbol("z_1"), Symbol("z_2")), edges)


@derives("eq:forcePerturbed", "The smoothed friction force")
def smoothed(d: Any) -> None:
    c_3 = Symbol("c_3", real=True)
    every = d.step(
        "odd cubics from -alpha to alpha",
        "solve",
        (alpha - c_3) * u + c_3 * u**3,
        Satisfies(
            lambda F: {
                "F(1) = alpha": F.subs(u, 1) - alpha,
                "F(-1) = -alpha": F.subs(u, -1) + alpha,
                "odd": F + F.subs(u, -u),
                "cubic": sympy.diff(F, u, 4),
            }
        ),
        "inside the layer, |u| < 1 with u = y/eps; continuous at both edges",
        left="F(u)",
    )
    found = d.step(
        "shape of the force",
        "define",
        alpha * _cubic,
        Definition(
            lambda F: {
                "c_3 = -alpha mu": F - every.subs(c_3, -alpha * mu),
                "F'(0) = alpha (1 + mu)": sympy.diff(F, u).subs(u, 0) - alpha * (1 + mu),
            }
        ),
        "mu = -c_3/alpha, which is 0 for a force that is linear in the layer",
        left="F(u)",
    )
    d.conclude(
        sympy.Function("F")(u),
        found,
        note="|u| <= 1; for u <= -1 the force is -alpha, for u >= 1 it is alpha",
    )


@derives("turning-points", "Turning points of the friction force", ("eq:forcePerturbed",))
def turning(d: Any) -> None:
    d.suppose("mu > 1/2", where="else the force grows throughout the layer, see 'beta'")
    slope = d.step(
        "slope",
        "differentiate",
        alpha * (1 + mu - 3 * mu * u**2),
        Identity(lambda: sympy.diff(d.use("eq:forcePerturbed", "F(u)"), u)),
        left="F'(u)",
    )
    found = d.step(
        "zero",
        "solve",
        PEAK,
        Satisfies(
            lambda s: {"slope": slope.subs(u, s), "positive": s - sympy.sqrt(sympy.expand(s**2))}
        ),
        "and minus this, the slope being even",
        left="u_s",
    )
    d.step(
        "inside the layer",
        "bound",
        Inequality(sympy.S.One, ">", found**2),
        shifted(2 * _above / (3 * (_HALF + _above)), {mu: _HALF + _above}, "mu = 1/2 + m, m > 0"),
        "the square is below 1 exactly for mu > 1/2",
    )
    d.conclude(Symbol("u_s"), found)


@derives("beta", "The breakaway force", ("turning-points", "eq:forcePerturbed"))
def breakaway(d: Any) -> None:
    d.suppose("mu >= 1/2", where="else the force grows throughout the layer, and beta is alpha")
    found = d.step(
        "force at the turning point",
        "substitute",
        BETA,
        Identity(
            lambda: d.use("eq:forcePerturbed", "F(u)").subs(u, d.use("turning-points", "u_s"))
        ),
        left=r"\beta = F(u_s)",
    )
    d.step(
        "above alpha for mu > 1/2",
        "bound",
        Inequality(found**2, ">", alpha**2),
        shifted(
            4 * alpha**2 * _above**2 * (_above + sympy.Rational(9, 2)) / (27 * (_HALF + _above)),
            {mu: _HALF + _above},
            "mu = 1/2 + m, m > 0",
        ),
        "the difference is (2 mu - 1)^2 (mu + 4) alpha^2/(27 mu)",
    )
    d.step(
        "at mu = 1/2",
        "evaluate",
        alpha,
        Identity(lambda: found.subs(mu, _HALF)),
        "both branches give alpha, so mu = 1/2 belongs to either",
        left=r"\beta \big|_{\mu = 1/2}",
    )
    low = Symbol("s", positive=True)
    q = Symbol("q", positive=True)
    inside = 1 / (1 + q)
    d.step(
        "no turning point for mu < 1/2: the force grows",
        "bound",
        Inequality(d.use("turning-points", step="slope"), ">", sympy.S.Zero),
        shifted(
            alpha * _growing(low, q),
            {mu: 1 / (2 + low), u: inside},
            "mu = 1/(2 + s) < 1/2, |u| = 1/(1+q) < 1",
        ),
        "so its largest value is alpha, at u = 1",
    )
    d.conclude(Symbol("beta"), found)


def _growing(s: Any, q: Any) -> Any:
    """1 + mu - 3 mu u^2 in the gaps, as a quotient of sums of positive terms."""
    return sympy.factor(sympy.together(1 + (1 - 3 / (1 + q) ** 2) / (2 + s)))


@derives("eq:osc3", "The oscillator with noise on the force", ("eq:osc2",))
def noisy(d: Any) -> None:
    F = sympy.Function("F")
    kappa = kappa_physical

    def with_noise() -> list[Any]:
        drift = d.use("eq:osc2", "zdot", "ydot")
        # A force kappa dW/dt adds to the acceleration only, the mass being 1.
        return [drift[0], drift[1], 0, kappa]

    found = d.step(
        "add the force",
        "substitute",
        (y - 1, 1 - z - y - F(y), sympy.S.Zero, kappa),
        Identity(with_noise),
        "drift of z and y, then their noise",
        left=tuple(rf"\text{{{what} of }} {of}" for what in ("drift", "noise") for of in "zy"),
    )
    d.conclude(
        sympy.symbols("drift_z drift_y noise_z noise_y"),
        found,
        display=(
            *("dz = (", found[0], r") \, dt ,\quad dy = (", found[1], r") \, dt + "),
            *(found[3], r" \, dW"),
        ),
    )


@derives("eq:phifric0", "The friction drift", ("eq:osc3", "eq:forcePerturbed", "eq:phi"))
def friction_drift(d: Any) -> None:
    F = sympy.Function("F")

    def by_reduce() -> list[Any]:
        # The same route as symasym.drift.reduction: freeze at (0, z0), keep y/eps.
        drift = d.use("eq:osc3", "drift_y").subs({z: z0, y: 0})
        inside = drift.subs(F(0), d.use("eq:forcePerturbed", "F(u)"))
        pieces = d.use("eq:phi", "phi(u)")
        return [
            piece.replace(sympy.Function("A"), lambda at: inside.subs(u, at)) for piece in pieces
        ]

    found = d.step(
        "freeze at (0, z0)",
        "substitute",
        (1 - z0 + alpha, 1 - z0 - alpha * _cubic, 1 - z0 - alpha),
        Identity(by_reduce),
        left=(
            r"\phi \big|_{u \le -1}",
            r"\phi \big|_{|u| \le 1}",
            r"\phi \big|_{u \ge 1}",
        ),
    )

    def through_reduce() -> list[Any]:
        from symasym.drift.reduction import reduce

        s = Symbol("s", real=True)
        common = 1 - z - y
        found = reduce(
            (common + alpha, y - 1),
            (common - alpha, y - 1),
            (common - alpha * (s + mu * (s - s**3)), y - 1),
            ((1,), (0,)),
            (y, z),
            layer=s,
            at={z: z0},
        )
        A = found.drift.expression()
        plain = {w.name: w for w in (alpha, mu, z0, u)}
        A = A.subs({w: plain[w.name] for w in A.free_symbols})
        return [A.subs(u, -1), A, A.subs(u, 1)]

    d.step(
        "by the general reduction",
        "project",
        found,
        Identity(through_reduce),
        "the general reduction of section 4 applied to eq:osc3",
        left=(
            r"\phi \big|_{u \le -1}",
            r"\phi \big|_{|u| \le 1}",
            r"\phi \big|_{u \ge 1}",
        ),
    )
    d.step(
        "powers of u",
        "expand",
        (1 - z0, -alpha * (1 + mu), sympy.S.Zero, alpha * mu),
        Identity(lambda: sympy.Poly(found[1], u).all_coeffs()[::-1]),
        "coefficients of A in ascending powers",
        left=(
            "[u^0] A",
            "[u^1] A",
            "[u^2] A",
            "[u^3] A",
        ),
    )
    d.conclude(sympy.Function("phi")(u), found, cases=(r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"))


@derives("eq:Vfric", "The friction potential", ("eq:phifric0", "eq:V"))
def friction_potential(d: Any) -> None:
    inside = -(1 - z0) * (u + 1) + alpha * (1 + mu) * (u**2 - 1) / 2 - alpha * mu * (u**4 - 1) / 4

    def drift() -> Any:
        return d.use("eq:phifric0", "phi(u)")

    def integrate() -> list[Any]:
        left, middle, right = (
            d.use("eq:V", "V(u)").replace(phi, lambda at, A=A: A.subs(u, at)).doit()
            for A in drift()
        )
        return [left, middle, middle.subs(u, 1) + right - right.subs(u, 1)]

    found = d.step(
        "integrate",
        "integrate",
        (-(1 - z0 + alpha) * (u + 1), inside, -2 * (1 - z0) - (1 - z0 - alpha) * (u - 1)),
        Identity(integrate),
        left=(
            r"V \big|_{u \le -1}",
            r"V \big|_{|u| \le 1}",
            r"V \big|_{u \ge 1}",
        ),
    )
    d.step(
        "slopes",
        "differentiate",
        tuple(-A for A in (1 - z0 + alpha, 1 - z0 - alpha * _cubic, 1 - z0 - alpha)),
        Identity(
            lambda: [
                sympy.diff(piece, u) if sympy.diff(piece, u).equals(-A) else sympy.nan
                for piece, A in zip(found, drift(), strict=True)
            ]
        ),
        "independent of the integration: each piece differentiated is -phi of eq:phifric0",
        left=(r"V' \big|_{u \le -1}", r"V' \big|_{|u| \le 1}", r"V' \big|_{u \ge 1}"),
    )
    d.step(
        "values",
        "evaluate",
        (sympy.S.Zero, sympy.S.Zero, sympy.S.Zero),
        Identity(
            lambda: [
                found[0].subs(u, -1),
                found[1].subs(u, -1),
                found[2].subs(u, 1) - found[1].subs(u, 1),
            ]
        ),
        "0 at -1 from both sides, and no jump at 1",
        left=(r"V(-1^-)", r"V(-1^+)", r"V(1^+) - V(1^-)"),
    )
    d.conclude(sympy.Function("V")(u), found, cases=(r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"))
