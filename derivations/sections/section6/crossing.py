r"""Section 6.2, strong noise: the bound on $C$, the four pieces, $T = r/a^+ + O(\kappa^2)$."""

from fractions import Fraction
from functools import cache

import sympy
from sympy import Heaviside, Integral, Limit, Rational, Symbol, Tuple, exp, oo

from derivations.numerics import Scene, escape_time, split_pieces
from derivations.paper import V_1, C, T, V, a_minus, a_plus, kappa, lam, r, u, v
from derivations.sections.section5.escape import I0, I1, J0, J1, by_sides
from symasym.derivation.derivation import derives

V_max = Symbol(r"V_{\max}", real=True)
T0, T1, T2, T3, T4 = sympy.symbols("T_0:5", positive=True)
Delta, X, Y, h, g, q, s, w, gap = sympy.symbols(r"\Delta X Y h g q s w \delta", positive=True)
FRICTION, DRIFT = Scene.friction("3", "1", "-2/5"), Scene((Fraction(1), Fraction(1, 2), Fraction(1, 3)))
ENDS, STRONG = {a_minus: "12/5", a_plus: "2/5", r: lambda k, ctx: k**4}, ("1e3", "1e4")


def piece(d, number):
    """The double integral of one of the four pieces."""
    (found,) = d["eq:fourPieces"][number - 1].atoms(Integral)
    return found


def beside(d, sign, side, *ends):
    """The integral of e^{sign lam (V - V(side))} beyond the layer, its exponentials left out."""
    V_side = d["eq:V2", "left" if side < 0 else "right"]
    fall = sympy.expand(V_side - V_side.subs(u, side))
    whole = sympy.integrate(sympy.expand(exp(sign * lam * fall)), (u, *ends))
    return sympy.expand(whole).replace(exp, lambda _: 0)


@derives("C-bound", "An upper bound on $C$, and its conditions")
def bound_on_C(d):
    d.suppose(r"$r \Delta \ge 1$ and $e^{2 a^- r (1 - \Delta)/\kappa^2} \ge 1/\Delta$, which is the meaning that "
              "the words sufficiently small must have in the paper's first inequality")
    d.suppose(r"$V_{\max} \le \Delta a^- r$, with $V \le V_{\max}$ on $(0, r)$")
    d.suppose(r"the printed condition $V_{\max} \le \Delta r$ is sufficient",
              fails=r"$A = 3 (u + 19/20)(u - 3/5)$, $\kappa = 1/5$, $r = 10$, $\Delta = 1/4$, where $C$ is far "
                    "above the bound")
    left, right = d["eq:V2", "left"], d["eq:V2", "right"]
    far, B = exp(lam * a_minus * r * (1 - Delta)), a_minus * (1 / a_plus + 2 / kappa**2)
    low = d.bound("left integral", Integral(exp(lam * left), (u, -r, -1)), ">=",
                  kappa**2 * (1 - Delta) / (2 * a_minus) * far, "$I_1$ is at least this",
                  kappa**2 / (2 * a_minus) * (far * (exp(lam * a_minus * h) - 1) + g),
                  on={h: r * Delta - 1, g: Delta * far - 1})
    inside = d.bound("integrand on (0, 1)", exp(lam * V(u)), "<=", exp(lam * V_max), "",
                     exp(lam * (V_max - gap)) * (exp(lam * gap) - 1), on={gap: V_max - V(u)})
    fall = sympy.expand(right - right.subs(u, 1))
    beyond = d.bound("integral over (1, r)", Integral(exp(lam * fall), (u, 1, r)), "<=", kappa**2 / (2 * a_plus),
                     r"this is the integral of $e^{\lambda (V - V(1))}$",
                     kappa**2 / (2 * a_plus) * exp(-lam * a_plus * (r - 1)))
    high = d.eq("bound on the right integral", Integral(inside, (u, 0, 1)) + inside * beyond,
                (1 + kappa**2 / (2 * a_plus)) * exp(lam * V_max), r"$I_0$ is at most this")
    ratio = d.bound("C from both", by_sides(d["eq:C"]), "<=", Y / X, r"where $X \le I_1$ and $Y \ge I_0$",
                    (I0 * (I0 + q) + s * (I0 + X + q)) / (X * (I0 + X + q)), on={q: I1 - X, s: Y - I0})
    both = d.eq("ratio of the two bounds", Y / X,
                B / (1 - Delta) * exp(-lam * (a_minus * r * (1 - Delta) - V_max)),
                r"$V_{\max}$ is divided by $a^- r$ and not by $r$, and there is no factor $1 + \Delta$",
                by=ratio.subs({X: low, Y: high}))
    most = B * exp(-lam * a_minus * r * (1 - 2 * Delta))
    at_limit = d.bound("V_max at its limit", both, "<=", (1 + 4 * Delta) * most,
                       r"the factor $1 + 4 \Delta$ is the paper's; it is at least $(1 + \Delta)/(1 - \Delta)$ "
                       r"for $\Delta \le 1/2$",
                       most * Delta * w / q + most / q * (1 - exp(-lam * gap)),
                       on={w: 3 - 4 * Delta, q: 1 - Delta, gap: Delta * a_minus * r - V_max})
    d.eq("Delta = 1/4", r"C \le", 2 * B * exp(-r * a_minus / kappa**2),
         r"the sharper factor $1/(1 - \Delta)$ would give "
         "4/3 in place of 2", by=at_limit.subs(Delta, Rational(1, 4)))
    d.conclude(error=r"this is an upper bound for $r \ge 4$, $V_{\max} \le a^- r/4$ and "
                     r"$e^{3 a^- r/(2 \kappa^2)} \ge 4$",
               note=r"$V_{\max}$ is an upper bound of $V$ on $(0, r)$, in units of $V$, and $\Delta$ a number of "
                    r"at most 1/2, here 1/4; in the steps $X \le I_1$ and $Y \ge I_0$ bound the integrals of eq:C")


@derives("eq:TtildeCzero", "The mean escape time without the terms of $C$")
def without_C(d):
    whole = d["eq:Ttilde"]
    rest = d.eq("what is left out", T - T0, -C * lam * (J0 + J1), "it is exactly proportional to $C$",
                by=by_sides(whole) - by_sides(whole.subs(C, 0)))
    d.bound("what is left out, at most", -rest, "<=", d["C-bound"] * lam * (J0 + J1), "it is exponentially small",
            gap * lam * (J0 + J1), on={gap: d["C-bound"] - C})
    (double,) = whole.subs(C, 0).atoms(Integral)
    inner, (_, low, end) = double.limits
    parts = (Integral(double.function.subs(Heaviside(v), on), inner, (v, *ends)) for on, ends in (
        (0, (low, 0)), (1, (0, end))))
    d.eq("without C", T0, lam * Integral(exp(lam * (V(v) - V(u))), (u, -r, v), (v, 0, r)),
         "the integrand is 0 for $v < 0$",
         by=whole.subs(C, 0) / double * sum(parts))
    d.conclude("without C", "what is left out, at most",
               note="$J_0$ and $J_1$ are the integrals over $(0, r)$ and $(-r, 0)$ of "
                    r"$e^{\lambda V(v)} \int_{-r}^v e^{-\lambda V}$")


@derives("eq:fourPieces", "Four pieces of the domain of integration")
def four_pieces(d):
    kernel, mine = exp(lam * (V(v) - V(u))), exp(s * u) * exp(h * v)
    over = lambda low, high, start, end: lam * Integral(kernel, (u, low, high), (v, start, end))
    domain = cache(lambda e: e.xreplace({kernel: mine}).replace(V, lambda _: 0).doit())
    d.eq("split", Tuple(T1, T2, T3, T4),
         Tuple(over(-r, -1, 0, 1), over(-1, v, 0, 1), over(-r, 1, 1, r), over(1, v, 1, r)),
         "the kinks of $V$ and the start become edges; the pieces add up to $T_0$ for every integrand "
         "$e^{s u + h v}$", lambda four: [(sum(map(domain, four)), domain(d["eq:TtildeCzero", "without C"]))])
    d.conclude(note="$T_0 = T_1 + T_2 + T_3 + T_4$ and $r > 1$")


@derives("eq:fourthTerm", "The fourth piece, exactly and for strong noise")
def fourth(d):
    d.suppose(r"$\kappa$ is bounded from below and $r \gg \kappa^2$; for weak noise see eq:fourthTerm2")
    right = d["eq:V2", "right"]
    rise = sympy.expand(right.subs(u, v) - right)
    d.eq("closed form", lam * Integral(exp(lam * rise), *piece(d, 4).limits),
         (r - 1) / a_plus - kappa**2 / (2 * a_plus**2) * (1 - exp(-lam * a_plus * (r - 1))),
         "only differences of $V$ appear, so $V(1)$ drops out")
    d.order("r much larger than kappa^2", T4, r / a_plus, kappa**2, strong_piece(4), STRONG, ENDS,
            r"measured at $r = \kappa^4$")
    d.conclude(error=r"$-1/a^+ - \kappa^2/(2 (a^+)^2)$ to leading order")


def strong_piece(number):
    """One of the four pieces at r = kappa^4."""
    return lambda k, ctx: split_pieces(ctx, FRICTION, k, k**4)[number - 1]


@derives("first-three", "The first three pieces in strong noise")
def first_three(d):
    d.suppose(r"$\kappa \gg 1$ and $r \gg \kappa^2$; the remainders are measured at $r = \kappa^4$")
    (_, *left), (_, *layer) = piece(d, 1).limits
    (_, low, _), (_, *right) = piece(d, 3).limits
    area = Integral(1, *piece(d, 2).limits)
    before, after = beside(d, -1, -1, *left), beside(d, 1, 1, *right)
    for name, left_side, leading, error, by, why in (
        ("first", T1, 1 / a_minus, kappa**-2, lam * before * (layer[1] - layer[0]),
         r"it is $\lambda$ times $1/(\lambda a^-)$ times 1, since $V$ is bounded in the layer and "
         r"$e^{\lambda V} \to 1$ there"),
        ("second", T2, 3 / kappa**2, kappa**-4, lam * area, r"it is $\lambda$ times the area 3/2"),
        ("third", T3, kappa**2 / (2 * a_plus * a_minus), kappa**0, lam * before * after,
         r"this is the largest of the three, and it shows that the paper's $O(\kappa^2)$ is sharp"),
    ):
        found = d.eq(f"{name}, leading part", left_side, leading, why, by=by)
        d.order(name, left_side, found, error, strong_piece(int(left_side.name[-1])), STRONG, ENDS)
    d.conclude("first", "second", "third", error="$O(1)$ in $T_3$; the errors of the other two are smaller")


@derives("eq:Ttildelarge", "The mean escape time in strong noise")
def large(d):
    d.suppose(r"the drift crosses to the right and $\kappa$ is bounded from below")
    d.suppose(r"$r \gg \kappa^2$, which follows from $\kappa_p \ll r_p \ll 1$ (see eq:eekappar)")
    path = {a_minus: "5/6", a_plus: "11/6", V_1: "-20/9", r: lambda k, ctx: k**4}
    exact = lambda k, ctx: escape_time(ctx, DRIFT, k, k**4)
    adds = d.eq("what C adds", Limit(kappa**8 * d["C-bound"].subs(r, kappa**4), kappa, oo), 0,
         r"it is below any power of $\kappa$")
    far = d["eq:fourthTerm", "closed form"].replace(exp, lambda _: 0)
    second = d.eq("coefficient of kappa^2", r"T - r/a^+ \sim",
                  kappa**2 / 2 * (1 / (a_plus * a_minus) - 1 / a_plus**2), "it comes from the third and the "
                  "fourth piece",
                  by=d["first-three", "third"] + sympy.expand(far).coeff(kappa, 2) * kappa**2)
    constant = (a_minus + a_plus + V_1) / (a_minus * a_plus)
    orders = d.order("next orders", T, d["eq:fourthTerm"] + second + constant + adds, kappa**-2, exact, STRONG,
                     path, "the constant is 0 if $A$ without its linear part integrates to 0, as for friction")
    d.eq("leading term", T, r / a_plus, "it comes from the fourth piece", by=sympy.expand(orders).coeff(r) * r)
    d.conclude(error=kappa**2)
