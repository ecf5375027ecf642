"""Section 4: reduction to one dimension, scaling, and the table of regions."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Symbol

from derivations.paper import eps, kappa, kappa_physical, phi, t, u, x
from derivations.registry import derives
from symasym.derivation import Expansion, Identity, Order, Satisfies

_k = kappa_physical
_b = sympy.symbols("b1:4", real=True)
y = Symbol("y", real=True)


@derives("eq:scaledSDE", "Coefficients frozen at the origin, with an O(r) remainder")
def frozen(d: Any) -> None:
    rho = Symbol("rho", positive=True)
    c, s = Symbol("c", real=True), Symbol("s", real=True)
    g = Function("g")
    at_zero = Symbol("f_0", positive=True)
    d.suppose("f-, f+, F and D are smooth near the origin")
    d.step(
        "first-order term",
        "expand",
        c * sympy.Derivative(g(x, y), x).subs({x: 0, y: 0})
        + s * sympy.Derivative(g(x, y), y).subs({x: 0, y: 0}),
        # The chain rule along a ray, for one generic cubic with free coefficients.
        _ChainRule(g, x, y, c, s),
        "along a ray of slope (c, s) the field changes by the distance times this",
    )
    frozen = d.step(
        "remainder",
        "expand",
        Expansion(at_zero, rho, rho),
        Order(
            lambda h, ctx: 2 * ctx.cos(h) + ctx.sin(3 * h) * ctx.exp(h),
            ("1e-1", "1e-3", "1e-5"),
            {at_zero: "2"},
        ),
        "measured on 2 cos y + e^y sin 3z along y = z: the error of freezing is O(r), no less",
    )
    d.conclude(Symbol("f"), frozen, "O(r)")


class _ChainRule:
    """d/dh g(c h, s h) at h = 0 for the generic cubic: exact, coefficient by coefficient."""

    kind = "symbolic identity"

    def __init__(self, g: Any, x: Any, y: Any, c: Any, s: Any) -> None:
        self.parts = g, x, y, c, s

    def run(self, result: Any, rng: Any) -> Any:
        from symasym.derivation.checks import compare

        g, x, y, c, s = self.parts
        h = Symbol("h")
        numbers = {(i, j): Symbol(f"q{i}{j}") for i in range(4) for j in range(4 - i)}

        def cubic(a: Any, b: Any) -> Any:
            return sum(q * a**i * b**j for (i, j), q in numbers.items())

        stated = result.replace(g, cubic).doit()
        wanted = sympy.diff(cubic(c * h, s * h), h).subs(h, 0)
        return compare(sympy.expand(stated), wanted, rng, {})

    def how(self) -> str:
        return "for the cubic with free coefficients, exactly"


@derives("eq:scaledSDEx", "The component across the surface")
def component(d: Any) -> None:
    F = [Function(f"F{k}")(u) for k in range(1, 4)]
    D = sympy.Matrix(3, 3, sympy.symbols("d1:4(1:4)", real=True))
    normal = sympy.Matrix([[0, 1, 0]])
    found = d.step(
        "project",
        "project",
        (F[1], D[1, 0], D[1, 1], D[1, 2]),
        Identity(lambda: [(normal * sympy.Matrix(F))[0], *(normal * D)]),
        "y as the second of three coordinates: the drift's entry and the row of D",
    )
    d.conclude(
        sympy.symbols("drift B1:4"), found, "O(r)", note="y is the second of three coordinates"
    )


@derives("noise-amplitude", "Independent noises through B add up to one of amplitude |B|")
def amplitude(d: Any) -> None:
    theta = Symbol("theta", real=True)

    def from_characteristic() -> Any:
        each = [sympy.exp(-((theta * b) ** 2) * t / 2) for b in _b]
        second = -sympy.diff(sympy.prod(each), theta, 2).subs(theta, 0)
        return sympy.sqrt(sympy.simplify(second / t))

    found = d.step(
        "standard deviation of B dW per square root of time",
        "integrate",
        sympy.sqrt(_b[0] ** 2 + _b[1] ** 2 + _b[2] ** 2),
        Identity(from_characteristic),
        "second derivative of the product of three Gaussian characteristic functions",
    )
    d.conclude(Symbol("sigma"), found)


@derives("eq:phi", "The scaled drift", ("eq:cont",))
def scaled_drift(d: Any) -> None:
    A = Function("A")
    d.suppose("F is continuous at both edges (eq:cont)")
    F = Function("F")

    def at_origin() -> list[Any]:
        inside = F(y / eps).subs(y, eps * u).replace(F, A)
        return [inside.subs(u, -1), inside, inside.subs(u, 1)]

    found = d.step(
        "three pieces",
        "define",
        (A(-1), A(u), A(1)),
        Identity(at_origin),
        "the normal component of F(y/eps, 0); its ends are a- and a+ by eq:cont",
    )
    d.conclude(phi(u), found, cases=(r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"))


@derives("eq:reducedSDE", "One dimension, one noise", ("noise-amplitude",))
def reduced(d: Any) -> None:
    f = Function("f")
    sigma = sympy.sqrt(sum(b**2 for b in _b))

    def ito() -> list[Any]:
        variance = sum((_k * b) ** 2 for b in _b)
        generator = phi(u) * sympy.diff(f(x), x) + variance / 2 * sympy.diff(f(x), x, 2)
        return [
            generator.coeff(sympy.diff(f(x), x)),
            sympy.sqrt(2 * generator.coeff(sympy.diff(f(x), x, 2))),
        ]

    found = d.step(
        "Ito's generator",
        "substitute",
        (phi(u), _k * sigma),
        Identity(ito),
        "drift, and the amplitude kappa |B| that the paper calls kappa from here on",
    )
    d.conclude(sympy.symbols("drift noise"), found, "O(r)")


@derives("eq:tildexykappa", "The scaling that makes the layer of unit size")
def scaling(d: Any) -> None:
    def same_equation(found: Any) -> dict[str, Any]:
        X, time, K = found
        slope, clock = sympy.diff(X, y), sympy.diff(time, t)
        return {
            "edge of the layer at 1": X.subs(y, eps) - 1,
            "drift stays phi": slope / clock - 1,
            "noise": sympy.sqrt(_k**2 * slope**2 / clock) - K,
            "time starts at 0": time.subs(t, 0),
        }

    found = d.step(
        "scale",
        "scale",
        (y / eps, t / eps, _k / sympy.sqrt(eps)),
        Satisfies(same_equation),
        "length by eps so that the layer is |u| < 1, time by eps so that phi stays",
    )
    d.conclude((Symbol("u"), Symbol("t_s"), Symbol("kappa")), found)


@derives("eq:reducedSDEtilde", "The scaled equation", ("eq:tildexykappa", "eq:reducedSDE"))
def reduced_scaled(d: Any) -> None:
    def by_chain_rule() -> list[Any]:
        X, time, _ = d.use("eq:tildexykappa")
        slope, clock = sympy.diff(X, y), sympy.diff(time, t)
        first = phi(u) * slope / clock
        second = sympy.Rational(1, 2) * (kappa * sympy.sqrt(eps)) ** 2 * slope**2 / clock
        return [sympy.simplify(first), sympy.simplify(second)]

    found = d.step(
        "generator in scaled variables",
        "substitute",
        (phi(u), kappa**2 / 2),
        Identity(by_chain_rule),
        "coefficients of g' and g'' for a test function g",
    )
    d.conclude(
        sympy.symbols("c_1 c_2"),
        found,
        note="c_1, c_2 are the coefficients of g' and g'' in the generator",
    )


@derives("regions", "Sliding, crossing, repelling: the signs of a- and a+")
def regions(d: Any) -> None:
    def count() -> Any:
        rows = []
        for minus in (-1, 1):
            row = []
            for plus in (-1, 1):
                # d(y^2)/dt = 2 y dy/dt at y = -1 and y = 1: negative means towards the surface.
                inward = [2 * side * field < 0 for side, field in ((-1, minus), (1, plus))]
                row.append(sum(inward))
            rows.append(row)
        return sympy.Matrix(rows)

    found = d.step(
        "sides from which the field points at the surface",
        "evaluate",
        sympy.ImmutableMatrix([[1, 0], [2, 1]]),
        Identity(lambda: list(count())),
        "rows a- < 0, a- > 0, columns a+ < 0, a+ > 0; "
        "2 is attracting sliding, 1 crossing, 0 repelling sliding",
    )
    d.conclude(
        Symbol("N"),
        found,
        note="rows a- < 0, a- > 0, columns a+ < 0, a+ > 0; "
        "2 is attracting sliding, 1 crossing, 0 repelling sliding",
    )
