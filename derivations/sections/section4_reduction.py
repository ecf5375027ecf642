"""Section 4: reduction to one dimension, scaling, and the table of regions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import sympy
from sympy import Function, Symbol

from derivations.paper import eps, kappa, kappa_physical, phi, t, u
from derivations.registry import derives
from derivations.sections.section2_systems import smoothed, z
from symasym.derivation import Expansion, Identity, Outcome, Satisfies

_k = kappa_physical
_b = sympy.symbols("b1:4", real=True)
y = Symbol("y", real=True)


@derives("eq:scaledSDE", "Coefficients frozen at the origin, and the remainder")
def frozen(d: Any) -> None:
    rho, h, M = (Symbol(n, positive=True) for n in ("rho", "h", "M"))
    c, s = Symbol("c", real=True), Symbol("s", real=True)
    slopes, curvature = sympy.symbols("f_x f_y", positive=True), Symbol("f_xx", real=True)
    field, ray = Function("f"), Function("g")
    at_zero = Symbol("f_0", positive=True)
    d.suppose("f-, f+, F and D are smooth near the origin: their slopes are at most M there")
    a, b = Symbol("a", real=True), Symbol("b", real=True)

    weight = Symbol("weight")

    def near(x: Any, y: Any) -> Any:
        """A field near the origin, less its value there."""
        return slopes[0] * x + slopes[1] * y + curvature * x**2

    along = d.step(
        "slope along a ray",
        "differentiate",
        c * sympy.Subs(sympy.Derivative(field(a, s * h), a), a, c * h)
        + s * sympy.Subs(sympy.Derivative(field(c * h, b), b), b, s * h),
        Satisfies(
            lambda found: {
                # A sum that vanishes for every `weight` only where each of its terms does.
                "of f = x^m y^n for m, n up to 3": sum(
                    weight ** (4 * m + n)
                    * (
                        found.replace(field, lambda x, y, m=m, n=n: x**m * y**n).doit()
                        - sympy.diff((c * h) ** m * (s * h) ** n, h)
                    )
                    for m in range(4)
                    for n in range(4)
                )
            }
        ),
        "the chain rule for g(h) = f(c h, s h): both sides are linear in f, and shown on powers",
        left="g'(h)",
    )
    change = d.step(
        "change along a ray",
        "integrate",
        sympy.Integral(sympy.Derivative(ray(h), h), (h, 0, rho)),
        Satisfies(
            lambda found: {
                "g(rho) has the same derivative": sympy.diff(found - ray(rho), rho),
                "0 at the origin": found.subs(rho, 0).doit(),
            }
        ),
        "g(rho) - g(0) for any field along any ray",
        left=r"g(\rho) - g(0)",
    )
    most = d.step(
        "largest change",
        "bound",
        M * rho,
        Identity(lambda: change.replace(sympy.Derivative, lambda *_: M).doit()),
        "|g'| <= M: the coefficients at a distance rho <= r_phys are those at the origin, up to "
        "O(r_phys)",
        left=r"\lvert g(\rho) - g(0) \rvert \le",
    )
    found = d.step(
        "remainder",
        "expand",
        Expansion(at_zero, rho, rho),
        _Exactly(
            lambda: at_zero + change.replace(ray, lambda h: near(c * h, s * h)).doit(),
            most / M,
            lambda: along.replace(field, near).doit().subs(h, 0),
        ),
        "no less than O(r_phys) where the slope along the ray is not 0",
        left="f(x)",
    )
    d.conclude(
        Symbol("f"),
        found,
        "O(r_phys)",
        note="f is any of the coefficients f-, f+, F and D of eq:genSDE, and rho = |x|",
        display=("f(x) = ", found),
    )


@dataclass
class _Exactly:
    """The remainder over the gauge, which is the one derived, has a limit that is known."""

    exact: Callable[[], Any]
    gauge: Any
    limit: Callable[[], Any]
    kind: ClassVar[str] = "asymptotic order"

    def run(self, result: Any, rng: Any) -> Outcome:
        ratio = sympy.limit(
            (self.exact() - result.leading) / result.gauge, result.variable, result.limit
        )
        right = result.gauge == self.gauge and sympy.expand(ratio - self.limit()) == 0
        return Outcome(bool(right), f"the ratio tends to {ratio}".replace("*", " "))

    def how(self) -> str:
        return "the limit of the remainder over what stands in O, exactly"


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
        "e_2 is the unit vector across the surface: the second entry of the drift F and the "
        "second row of the noise matrix D",
        left=(
            r"e_2 \cdot F",
            r"(e_2^{\mathsf T} D)_1",
            r"(e_2^{\mathsf T} D)_2",
            r"(e_2^{\mathsf T} D)_3",
        ),
    )
    drift, *row = found
    d.conclude(
        sympy.symbols("drift B1:4"),
        found,
        "O(r_phys)",
        note="y is the second of three coordinates and u = y/eps; A and the second row of "
        "the noise "
        "matrix, d_21, d_22, d_23, are taken at the origin (eq:scaledSDE); the W_j are independent "
        "Brownian motions",
        display=(
            *("dy = ", drift, r" \, dt + \kappa_p \left("),
            *(
                row[0],
                r" \, dW_1 + ",
                row[1],
                r" \, dW_2 + ",
                row[2],
                r" \, dW_3\right) + O(r_p)",
            ),
        ),
    )


@derives("noise-amplitude", "Independent noises through B add up to one of amplitude |B|")
def amplitude(d: Any) -> None:
    theta = Symbol("theta", real=True)

    def from_characteristic() -> Any:
        second = -sympy.diff(characteristic, theta, 2).subs(theta, 0)
        return sympy.sqrt(sympy.simplify(second / t))

    characteristic = d.step(
        "characteristic function of B W",
        "integrate",
        sympy.exp(-(theta**2) * t * (_b[0] ** 2 + _b[1] ** 2 + _b[2] ** 2) / 2),
        Identity(lambda: sympy.prod(sympy.exp(-((theta * b) ** 2) * t / 2) for b in _b)),
        "the noises are independent: the product of three Gaussian characteristic functions",
        left=r"\langle e^{i \theta (b_1 W_1 + b_2 W_2 + b_3 W_3)} \rangle",
    )
    found = d.step(
        "standard deviation of B dW per square root of time",
        "integrate",
        sympy.sqrt(_b[0] ** 2 + _b[1] ** 2 + _b[2] ** 2),
        Identity(from_characteristic),
        "minus its second derivative at theta = 0 is the variance, over t",
        left=r"\sigma",
    )
    d.conclude(Symbol("sigma"), found)


@derives("eq:phi", "The scaled drift", ("eq:cont",))
def scaled_drift(d: Any) -> None:
    A = Function("A")
    d.suppose("F is continuous at both edges (eq:cont)")
    F = Function("F")

    def at_origin() -> list[Any]:
        at_edge = d.use("eq:cont", "F(-1, -epsilon, z)", "F(1, epsilon, z)")
        # f- and f+ at the origin are F at the ends.
        ends = {
            value.subs({eps: 0, z: 0}): F(side, 0, 0)
            for side, value in zip((-1, 1), at_edge, strict=True)
        }
        return [piece.subs(ends).replace(F, lambda s, *_: A(s)) for piece in frozen]

    frozen = d.step(
        "frozen at the origin",
        "substitute",
        (Function("f^-")(0, 0), F(u, 0, 0), Function("f^+")(0, 0)),
        Identity(
            lambda: [
                smoothed()[0].subs({y: 0, z: 0}),
                smoothed()[1].subs(y, eps * u).replace(F, lambda s, *_: F(s, 0, 0)),
                smoothed()[2].subs({y: 0, z: 0}),
            ]
        ),
        "the normal component of the field below, in and above the layer, y = eps u",
        left=(r"\phi \big|_{u \le -1}", r"\phi \big|_{|u| \le 1}", r"\phi \big|_{u \ge 1}"),
    )
    found = d.step(
        "three pieces",
        "define",
        (A(-1), A(u), A(1)),
        Identity(at_origin),
        "A(u) is F(u, 0, 0); its ends are f- and f+ there, a- and a+, by eq:cont",
        left=(
            r"\phi \big|_{u \le -1}",
            r"\phi \big|_{|u| \le 1}",
            r"\phi \big|_{u \ge 1}",
        ),
    )
    d.conclude(phi(u), found, cases=(r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"))


@derives("eq:reducedSDE", "One dimension, one noise", ("noise-amplitude", "eq:scaledSDEx"))
def reduced(d: Any) -> None:
    f = Function("f")

    def ito() -> Any:
        """The generator applied to f."""
        drift, *row = d.use("eq:scaledSDEx", "drift", "B1", "B2", "B3")
        # The names of the component: phi for F2, b for the second row of D.
        drift = drift.replace(Function("F2"), phi)
        named = dict(zip(sympy.symbols("d21:24", real=True), _b, strict=True))
        variance = (_k * d.use("noise-amplitude", "sigma")) ** 2
        alone = [(_k * b.subs(named)) ** 2 for b in row]
        if sympy.expand(variance - sum(alone)) != 0:
            raise ValueError("the noises do not add up")
        return sympy.expand(drift * sympy.diff(f(y), y) + variance / 2 * sympy.diff(f(y), y, 2))

    square = _b[0] ** 2 + _b[1] ** 2 + _b[2] ** 2
    first, second = sympy.diff(f(y), y), sympy.diff(f(y), y, 2)
    generator = d.step(
        "Ito's generator",
        "substitute",
        phi(u) * first + _k**2 * square / 2 * second,
        Identity(ito),
        "three noises of independent increments: their variances add up",
        left=r"\mathcal{L} f",
    )

    def read_off() -> list[Any]:
        terms = sympy.expand(generator)
        return [terms.coeff(first), sympy.sqrt(sympy.factor(2 * terms.coeff(second)))]

    found = d.step(
        "one noise of the same generator",
        "substitute",
        (phi(u), _k * sympy.sqrt(square)),
        Identity(read_off),
        "drift, and the amplitude kappa_phys |B| that the paper calls kappa from here on",
        left=(
            r"\text{drift}",
            r"\text{amplitude}",
        ),
    )
    drift, noise = found
    d.conclude(
        sympy.symbols("drift noise"),
        found,
        "O(r_phys)",
        note="u = y/eps; the b_j are the entries of D(0) that act on y, and W is a Brownian motion",
        display=("dy = ", drift, r" \, dt + ", noise, r" \, dW + O(r_p)"),
    )


@derives("eq:tildexykappa", "The scaling that makes the layer of unit size")
def scaling(d: Any) -> None:
    def same_equation(found: Any) -> dict[str, Any]:
        X, time, K = found
        units = {length: 1 / sympy.diff(X, y), clock: 1 / sympy.diff(time, t)}
        drift, noise = (e.subs(units) for e in in_units)
        return {
            "edge of the layer at 1": X.subs(y, eps) - 1,
            "drift stays phi": drift / phi(y / eps) - 1,
            "noise": noise - K,
            "time starts at 0": time.subs(t, 0),
        }

    length, clock = sympy.symbols("ell tau", positive=True)
    d.names |= {length: r"\ell", clock: r"\tau"}
    in_units = d.step(
        "any units of length and time",
        "scale",
        (clock / length * phi(y / eps), _k * sympy.sqrt(clock) / length),
        Satisfies(
            lambda new: {
                "drift": new[0] - phi(y / eps) * sympy.diff(y / length, y) * clock,
                "noise": new[1] - _k * sympy.diff(y / length, y) * sympy.sqrt(clock),
            }
        ),
        "y = ell u and time in units of tau in dy = phi(y/eps) dt + kappa_phys dW, where "
        "dW^2 is dt",
        left=(r"\text{drift of } u", r"\text{noise of } u"),
    )
    found = d.step(
        "scale",
        "scale",
        (y / eps, t / eps, _k / sympy.sqrt(eps)),
        Satisfies(same_equation),
        "length by eps so that the layer is |u| < 1, time by eps so that phi stays",
        left=(
            "u",
            r"\tilde t",
            r"\kappa",
        ),
    )
    d.conclude((Symbol("u"), Symbol("t_s"), Symbol("kappa")), found)


@derives("eq:reducedSDEtilde", "The scaled equation", ("eq:tildexykappa", "eq:reducedSDE"))
def reduced_scaled(d: Any) -> None:
    def by_chain_rule() -> list[Any]:
        X, time, K = d.use("eq:tildexykappa", "u", "t_s", "kappa")
        slope, clock = sympy.diff(X, y), sympy.diff(time, t)
        drift, noise = d.use("eq:reducedSDE", "drift", "noise")
        # The paper's kappa has |B| in it from here on.
        noise = noise.subs(dict(zip(_b, (1, 0, 0), strict=True)))
        (unscaled,) = sympy.solve(K - kappa, _k)
        second = sympy.Rational(1, 2) * noise**2 * slope**2 / clock
        return [sympy.simplify(drift * slope / clock), sympy.simplify(second.subs(_k, unscaled))]

    found = d.step(
        "generator in scaled variables",
        "substitute",
        (phi(u), kappa**2 / 2),
        Identity(by_chain_rule),
        "coefficients of g' and g'' for a test function g",
        left=(
            r"\phi \, \frac{du/dy}{d\tilde t/dt}",
            r"\frac{\kappa_p^2}{2} \, \frac{(du/dy)^2}{d\tilde t/dt}",
        ),
    )
    drift, half = found
    noise = d.step(
        "amplitude",
        "substitute",
        kappa,
        Identity(lambda: sympy.sqrt(2 * half)),
        "the coefficient of g'' is half the square of the noise amplitude",
        left=r"\sqrt{2 \cdot \tfrac{1}{2} \kappa^2}",
    )
    d.conclude(
        sympy.symbols("c_1 c_2"),
        found,
        note="c_1 and c_2, the coefficients of g' and g'' in the generator, are phi and kappa^2/2",
        display=("du = ", drift, r" \, d\tilde t + ", noise, r" \, dW"),
    )


#: The signs of a- and a+ in each of the four regions.
REGIONS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


@derives("regions", "Sliding, crossing, repelling: the signs of a- and a+")
def regions(d: Any) -> None:
    def count() -> Any:
        numbers = []
        for signs in REGIONS:
            # At speeds of 1, |u| falls (-1) or grows (1) at half the rate of u^2 at |u| = 1.
            grows = [rate.subs(dict(zip(speeds, signs, strict=True))) / 2 for rate in rates]
            numbers.append(sum((1 - one) / 2 for one in grows))
        return numbers

    ends, speeds = (-1, 1), sympy.symbols("a_minus a_plus", real=True)
    rates = d.step(
        "square of the distance from the surface",
        "differentiate",
        (-2 * speeds[0], 2 * speeds[1]),
        Identity(
            lambda: [
                sympy.diff(Function("u")(t) ** 2, t)
                .subs(sympy.diff(Function("u")(t), t), speed)
                .subs(Function("u")(t), end)
                for end, speed in zip(ends, speeds, strict=True)
            ]
        ),
        "negative where the field points at the surface: for a- > 0, and for a+ < 0",
        left=(
            r"\frac{d u^2}{d\tilde t} \big|_{u = -1}",
            r"\frac{d u^2}{d\tilde t} \big|_{u = 1}",
        ),
    )
    found = d.step(
        "sides from which the field points at the surface",
        "evaluate",
        tuple(map(sympy.Integer, (1, 0, 2, 1))),
        Identity(count),
        "2 is attracting sliding, 1 crossing, 0 repelling sliding; N of the signs of a- and a+",
        left=tuple(rf"N({a}, {b})" for a, b in ("--", "-+", "+-", "++")),
    )
    d.conclude(
        Symbol("N"),
        found,
        cases=(
            r"a^- < 0, \ a^+ < 0 \text{: crossing to the left}",
            r"a^- < 0 < a^+ \text{: repelling sliding}",
            r"a^- > 0 > a^+ \text{: attracting sliding}",
            r"a^- > 0, \ a^+ > 0 \text{: crossing to the right}",
        ),
        note="a- or a+ is 0 at a tangency, between these regions",
    )
