"""The whole system, beyond the paper: the mean time of release, its expansion, and its rate.

Scaled variables: du = phi(u, z, eps u) dt + kappa dW, dz = eps g dt, and L f = phi f_u +
(kappa^2/2) f_uu + eps g f_z. No label of the paper rests on these.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Integral, Symbol

from derivations.paper import eps, kappa, r, u
from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

z, v, x, t = sympy.symbols("z v x t", real=True)
g, phi, phi_y = (Symbol(name, real=True) for name in ("g", "phi", "phi_y"))
p, q = sympy.symbols("p q", positive=True)


def _operator(symbol: Any, f: Any) -> Any:
    """L f from the symbol of L: p stands for d/du, q for d/dz."""
    terms = sympy.Poly(symbol, p, q).terms()
    return sum(c * sympy.diff(f, (u, i), (z, j)) for (i, j), c in terms)


@derives("release-time", "Mean and variance of the time of release")
def marched(d: Any) -> None:
    h = Symbol("h", positive=True)
    wave = sympy.exp(p * u + q * z)

    def expected() -> Any:
        """Rate of change of the mean of the wave over a step h, with steps of either sign."""
        up, down = (
            wave.subs({u: u + phi * h**2 + s * kappa * h, z: z + eps * g * h**2}, simultaneous=True)
            for s in (1, -1)
        )
        return sympy.diff((up + down) / 2, h, 2).subs(h, 0) / 2

    d.suppose("phi and g are Lipschitz, so that the diffusion (u, z) exists and is unique")
    d.suppose("release is certain and its time has a second moment", where="g keeps its sign")
    generator = d.step(
        "generator",
        "take limit",
        phi * p + kappa**2 / 2 * p**2 + eps * g * q,
        Identity(lambda: sympy.expand(expected() / wave)),
        "rate of change of the mean of e^(p u + q z), over it: p stands for the derivative by u, "
        "q for that by z, and these exponentials determine the operator L",
        left="e^{-p u - q z} L e^{p u + q z}",
    )
    T = Function("T")(u, z)
    mean = d.step(
        "mean",
        "take limit",
        sympy.S.NegativeOne,
        Identity(lambda: sympy.diff(T - h, h)),
        "T exceeds its mean after a time h by h; T = 0 at u = -r and r",
        left="L T",
    )
    past = Symbol("s", positive=True)
    second = d.step(
        "second moment",
        "take limit",
        -2 * T,
        Identity(lambda: -sympy.diff((T + past) ** 2, past).subs(past, 0)),
        "M is the mean square of the time; that of the time after s more has the derivative 2 T "
        "in s at s = 0",
        left="L M",
    )

    def spread() -> Any:
        """L M - L (T^2), where L T = -1 gives T_z."""
        (slope,) = sympy.solve(_operator(generator, T) - mean, sympy.diff(T, z))
        return sympy.expand((second - _operator(generator, T**2)).subs(sympy.diff(T, z), slope))

    found = d.step(
        "variance",
        "substitute",
        -(kappa**2) * sympy.diff(T, u) ** 2,
        Identity(spread),
        "v = M - T^2",
        left="L v",
    )
    d.conclude(
        (_operator(generator, T), _operator(generator, Function("v")(u, z))),
        (mean, found),
        note="T and the variance v of the time from (u, z) are 0 at u = -r and r",
    )


@derives(
    "release-order",
    "The first correction to T by the motion of the slow variable",
    ("release-time",),
)
def first_order(d: Any) -> None:
    T0, T1 = Function("T_f")(u, z), Function("T_1")(u, z)
    frozen = Function("phi")(u, z)
    d.suppose("T has two derivatives in eps at 0", where="eps T small against the way to the fold")

    def order_one() -> Any:
        """The coefficient of eps in L (T0 + eps T1) + 1, without L0 T1."""
        symbol = d.use("release-time", step="generator")
        whole = _operator(symbol.subs(phi, frozen + eps * u * phi_y), T0 + eps * T1)
        rest = sympy.diff(sympy.expand(whole), eps).subs(eps, 0)
        return sympy.expand(rest - _operator(symbol.subs({eps: 0, phi: frozen}), T1))

    source = d.step(
        "source",
        "expand",
        g * T0.diff(z) + u * phi_y * T0.diff(u),
        Identity(order_one),
        "L is L_0 for eps = 0, and L_0 T_1 = -s(u) with T_1 = 0 at u = -r and r; phi_y is "
        "the slope in y = eps u",
        left="s(u)",
    )
    Sigma, s = Function("Sigma"), Function("s")
    a, b = sympy.symbols("a b", positive=True)
    lam = 2 / kappa**2
    left = Integral(Sigma(v) / Sigma(v).diff(v) * s(v), (v, -r, x))
    right = Integral((Sigma(r) - Sigma(v)) / Sigma(v).diff(v) * s(v), (v, x, r))
    solution = lam * ((Sigma(r) - Sigma(x)) * left + Sigma(x) * right) / Sigma(r)

    def equations(stated: Any) -> dict[str, Any]:
        """L0 T1 + s, with phi = -(kappa^2/2) Sigma''/Sigma', and the ends, on exponentials."""
        scale = sympy.exp(x) - sympy.exp(-r)
        force = a * sympy.exp(2 * x) + b * sympy.exp(3 * x)
        known = stated.replace(s, lambda at: force.subs(x, at))
        known = sympy.expand(known.replace(Sigma, lambda at: scale.subs(x, at)).doit())
        drift = -scale.diff(x, 2) / scale.diff(x) / lam
        return {
            "L_0 T_1 = -s": drift * known.diff(x) + known.diff(x, 2) / lam + force,
            "right end": known.subs(x, r),
            "left end": known.subs(x, -r),
        }

    found = d.step(
        "Green's function",
        "solve",
        solution,
        Satisfies(equations),
        "Sigma' = e^(lam V), Sigma(-r) = 0: each integrand times what stands before it is "
        "s(v) times the mean time spent at v, per length, on the way from x",
        left="T_1(x)",
    )
    d.conclude(
        (s(u), Function("T_1")(x)),
        (source, found),
        "T = T_f + eps T_1 leaves out O(eps^2)",
        note="Sigma' = e^(lam V), Sigma(-r) = 0; phi_y is the slope of phi in y = eps u",
    )


@derives("release-adiabatic", "The adiabatic law of release")
def adiabatic(d: Any) -> None:
    rate = Function("k")
    held = sympy.exp(-Integral(rate(x), (x, 0, t)))
    d.suppose("1/|A_1| << T and |dT/dt| << 1, T with z frozen where it is at t")
    lost = d.step(
        "what is lost in a short time",
        "take limit",
        -rate(t) * Function("H")(t),
        Identity(
            lambda: sympy.limit((Function("H")(t) * (1 - x * rate(t)) - Function("H")(t)) / x, x, 0)
        ),
        "of those held at t, the share k(t) dt is released in dt: 1/T with z frozen is the rate",
        left="H'(t)",
    )
    found = d.step(
        "held",
        "solve",
        held,
        Satisfies(
            lambda h: {
                "rate": sympy.simplify(h.diff(t) - lost.subs(Function("H")(t), h)),
                "all at the start": h.subs(t, 0).doit() - 1,
            }
        ),
        "k(t) = 1/T(z(t))",
        left="H(t)",
    )
    d.conclude(
        Function("H")(t),
        found,
        "not estimated; small where the conditions hold",
        note="H is the chance to be held at t, k(t) = 1/T with z frozen where it is then",
    )


@derives("frozen-time", "Where T, with z frozen, is the time of release", ("release-adiabatic",))
def frozen(d: Any) -> None:
    """The first order of the adiabatic law in eps: T and its deviation, and the motion's share."""
    T0, slope = sympy.symbols("T_f Tf_z", positive=True)
    d.suppose("kappa^2 << D, so that escape is rare and the adiabatic law holds")
    d.suppose("z is far from the fold, so that T(z) has two derivatives")
    rate = d.step(
        "rate on the way",
        "expand",
        1 / T0 - eps * g * t * slope / T0**2,
        Identity(
            lambda: sympy.series(1 / (T0 + eps * g * t * slope), eps, 0, 2).removeO(),
        ),
        "z = z0 + eps g t",
        left=r"k(t) \sim",
    )

    def moment(weight: Any) -> Any:
        """The integral of what is held, with a weight, to the order of eps."""
        held = d.use("release-adiabatic", "H(t)")
        held = held.replace(Function("k"), lambda at: rate.subs(t, at)).doit()
        first = sympy.series(held, eps, 0, 2).removeO()
        return sympy.expand(sympy.integrate(sympy.expand(weight * first), (t, 0, sympy.oo)))

    mean = d.step(
        "mean",
        "integrate",
        T0 + eps * g * T0 * slope,
        Identity(lambda: moment(1)),
        "a small correction where eps g times the slope of T_f in z is small: T_f far above "
        "r, and far "
        "below the time in which z reaches the fold",
        left=r"T \sim",
    )
    deviation = d.step(
        "standard deviation",
        "expand",
        T0 + 2 * eps * g * T0 * slope,
        Identity(lambda: sympy.series(sympy.sqrt(moment(2 * t) - mean**2), eps, 0, 2).removeO()),
        "T_f where z rests: the waiting time is then exponentially distributed",
        left=r"\sigma_T \sim",
    )
    D, lam = Function("D")(z), 2 / kappa**2
    grown = d.step(
        "by the barrier",
        "differentiate",
        lam * D.diff(z),
        Identity(lambda: sympy.diff(sympy.log(sympy.exp(lam * D)), z)),
        "where T grows as e^(lam D)",
        left=r"\frac{1}{T} \frac{dT}{dz} \sim",
    )
    d.step(
        "share",
        "substitute",
        eps * g * lam * D.diff(z) * T0,
        Identity(lambda: sympy.expand((mean / T0 - 1).subs(slope, grown * T0))),
        "of T, that the motion of z adds",
        left=r"\frac{T - T_f}{T_f} \sim",
    )
    d.conclude(
        (Symbol("T"), Symbol("sigma_T")),
        (mean, deviation),
        "O(eps^2)",
        note="T_f: T with z frozen at the start; sigma_T is the standard deviation of the time",
    )


@derives("fold-delay", "How late a block without noise passes the fold")
def fold_delay(d: Any) -> None:
    w, s, a, b = sympy.symbols("w s a b", positive=True)
    d.suppose("w is small: u is close to the fold, where well and barrier coalesce")
    d.suppose("in the units of u and z, half of d^2 phi/du^2 and g d phi/dz are 1 at the fold")
    found = d.step(
        "scales",
        "scale",
        (eps ** sympy.Rational(1, 3), eps ** sympy.Rational(-1, 3)),
        Satisfies(
            lambda units: {
                # a dw/ds / b = a^2 w^2 + eps b s, one number before each term.
                "coefficient of w1^2": units[0] / units[1] - units[0] ** 2,
                "coefficient of s": units[0] / units[1] - eps * units[1],
            }
        ),
        "w = a w1, t = b s leave w1' = w1^2 + s",
        left=(
            "a",
            "b",
        ),
    )
    Ai = sympy.airyai
    path = d.step(
        "Airy's equation",
        "solve",
        sympy.airyaiprime(-s) / Ai(-s),
        Satisfies(lambda stated: {"w1' = w1^2 + s": stated.diff(s) - stated**2 - s}),
        "it leaves at the first zero of Ai, s = 2.338",
        left="w_1(s)",
    )
    d.conclude(
        (a, b, Function("w_1")(s)),
        (*found, path),
        "leading order in eps, without noise; exact for w' = w^2 + eps t",
        note="w is the distance of u from the fold's, t the time past the fold, and phi is "
        "w^2 + eps t to leading order; the block leaves at s = 2.338",
        display=(
            "w = ",
            found[0],
            r" \, w_1(s) ,\quad t = ",
            found[1],
            r" \, s ,\quad w_1(s) = ",
            path,
        ),
    )
