"""Section 6, weak noise: the expansions of the integrals to every order, and how they compose.

What `symasym.series.local` evaluates: the formal series that a start, a kink or an end
contributes and the slow manifold of the regular part (by parts), Laplace's series of a well or a
barrier (Watson's lemma), and T from both sides of the start.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Symbol

from derivations.paper import kappa
from derivations.registry import derives
from derivations.sections.section6.series import c2, c3, c4, c5, c6
from derivations.sections.section6.well import S1
from symasym.derivation import Identity, Satisfies

u = Symbol("u", real=True)
lam = Symbol("lam", positive=True)
phi, V, g = (Function(name) for name in ("phi", "V", "g"))
drift, source, slope, term = (Symbol(n, real=True) for n in ("drift", "source", "slope", "term"))
side, left, right = (Symbol(name, real=True) for name in ("side", "left", "right"))


@derives("endpoint-series", "Contributions of a start, a kink or an end, and the slow manifold")
def endpoint_series(d: Any) -> None:
    d.suppose("phi is smooth on a side of the point, and not 0 there")
    d.suppose(
        "the series are formal: they leave out contributions of other points, smaller or "
        "larger by an exponential"
    )
    first = d.step(
        "first term",
        "integrate",
        source / drift,
        Satisfies(_by_parts),
        "-e^(lam V) h/lam and e^(-lam V) h/lam are primitives of e^(+-lam V) phi h, up to h'; "
        "g is the weight",
        left="h",
    )
    following = d.step(
        "next term",
        "integrate",
        source / drift,
        Satisfies(lambda found: _manifold(first, found)),
        "g is -h_k'; M = h_1/lam + h_2/lam^2 + ... solves M' = 1 - lam phi M, order by order",
        left="h_{k+1}",
    )
    pair = d.step(
        "contributions to the right",
        "integrate",
        (-side * term, -term),
        Satisfies(lambda found: _contributions(found, first, following)),
        "of e^(lam V) and e^(-lam V), times lam^-k; s_k is (-1)^k",
        left=(
            "E_k^{+}",
            "E_k^{-}",
        ),
    )
    change = d.step(
        "at a kink",
        "split",
        right - left,
        Satisfies(lambda found: _at_kink(found, first, pair)),
        "the change of h_k there; to the left the contributions have the other sign",
        left=r"\Delta h_k",
    )
    both = d.step(
        "of any point",
        "substitute",
        (side * (left - right), left - right),
        Identity(lambda: [stated.subs(term, change) for stated in pair]),
        "h_k is 0 on the left of a start and on the right of an end",
        left=(
            "E_k^{+}",
            "E_k^{-}",
        ),
    )
    d.conclude(
        (Symbol("E_up"), Symbol("E_down")),
        both,
        "a formal series",
        note="coefficients of lam^-k in the integrals of e^(lam V) and e^(-lam V) about a point, "
        "in units of e^(+-lam V) there, from h_k on both sides of it: h_1 = 1/phi and "
        "h_(k+1) = -h_k'/phi, and 0 where nothing is integrated; s_k is (-1)^k",
    )


def _slope(e: Any) -> Any:
    """The derivative by u, with V' = -phi."""
    return sympy.diff(e, u).subs(sympy.diff(V(u), u), -phi(u))


def _by_parts(found: Any) -> dict[str, Any]:
    h = found.subs({source: g(u), drift: phi(u)})
    return {
        f"int g e^({'-' if sign < 0 else ''}lam V)": sympy.expand(
            _slope(-sign * power * h / lam) - power * (g(u) - sign * sympy.diff(h, u) / lam)
        )
        for sign, power in ((1, sympy.exp(lam * V(u))), (-1, sympy.exp(-lam * V(u))))
    }


def _coefficients(first: Any, following: Any) -> list[Any]:
    """h_1, h_2, h_3."""
    h = [first.subs({source: 1, drift: phi(u)})]
    for _ in range(2):
        h.append(following.subs({source: -sympy.diff(h[-1], u), drift: phi(u)}))
    return h


def _manifold(first: Any, following: Any) -> dict[str, Any]:
    h = _coefficients(first, following)
    M = sum(c * lam**-k for k, c in enumerate(h, start=1))
    rest = sympy.diff(M, u) - 1 + lam * phi(u) * M - sympy.diff(h[-1], u) * lam**-3
    return {"M' = 1 - lam phi M": sympy.expand(rest)}


def _contributions(pair: Any, first: Any, following: Any) -> dict[str, Any]:
    """From u on, the integral changes with u by -e^(+-lam V): up to the last term's slope."""
    equations, h = {}, _coefficients(first, following)
    for sign, stated in zip((1, -1), pair, strict=True):
        power = sympy.exp(sign * lam * V(u))
        terms = [stated.subs({term: c, side: (-1) ** k}) for k, c in enumerate(h, start=1)]
        total = sum(e * lam**-k for k, e in enumerate(terms, start=1))
        rest = _slope(power * total) + power - power * sympy.diff(terms[-1], u) * lam**-3
        equations[f"e^({'-' if sign < 0 else ''}lam V)"] = sympy.expand(rest)
    return equations


def _at_kink(found: Any, first: Any, pair: Any) -> dict[str, Any]:
    equations = {
        f"of e^({'-' if k else ''}lam V)": stated.subs(term, found)
        - (stated.subs(term, right) - stated.subs(term, left))
        for k, stated in enumerate(pair)
    }
    # phi goes on without a jump, and with it h_1.
    equations["h_1 of a drift without a jump"] = found.subs({left: first, right: first})
    return equations


# -- the regular part at a zero of phi -------------------------------------------------------------

t = Symbol("t", positive=True)
power, index, k = (Symbol(name, integer=True, positive=True) for name in ("power", "index", "k"))


@derives(
    "regular-part",
    "The slow manifold beside a simple zero of the drift, and its finite part",
    ("endpoint-series",),
)
def regular_part(d: Any) -> None:
    d.suppose("phi = t psi(t), psi(0) not 0")
    d.step(
        "order of the pole",
        "substitute",
        ((2 * k - 1) * g(t) - t * sympy.diff(g(t), t)) / phi(t),
        Identity(lambda: _at_zero(d)),
        "h_k = t^(1 - 2k) g(t) in h_(k+1) = -h_k'/phi, with phi = t psi(t)",
        left="t^{1 + 2 k} h_{k+1}",
    )
    fall = d.step(
        "-h' by powers",
        "differentiate",
        (power - index) * term,
        Satisfies(
            lambda found: {
                "-h'": sympy.simplify(
                    -sympy.diff(term * t ** (index - power), t) * t ** (power - index + 1) - found
                )
            }
        ),
        "term by term: c_i is the coefficient of t^(i - p) in h",
        left="c'_i",
    )
    primitive = d.step(
        "finite part",
        "integrate",
        term / (1 - power),
        Satisfies(
            lambda found: {
                "primitive": sympy.simplify(
                    sympy.diff(found * t ** (1 - power), t) * t**power - term
                )
            }
        ),
        "of a term with a pole of an order above 1, nothing at t = 0 (Hadamard); a simple "
        "pole gives a logarithm",
        left="C_i",
    )
    d.conclude(
        (Symbol("h_next"), Symbol("H")),
        (fall, primitive),
        note="c_i is the coefficient of t^(i - p) in h, and c_i' that of t^(i - p - 1) in "
        "-h'; in the "
        "second formula c_i t^(-p) is any one term, p not 1, and C_i the coefficient of t^(1 "
        "- p) in "
        "its primitive",
    )


def _at_zero(d: Any) -> Any:
    found = d.use("endpoint-series", step="next term")
    h = t ** (1 - 2 * k) * g(t)
    whole = found.subs({source: -sympy.diff(h, t), drift: t * phi(t)})
    return sympy.simplify(sympy.expand(whole * t ** (1 + 2 * k)))


# -- wells and barriers ----------------------------------------------------------------------------

x = Symbol("x", positive=True)
s = Symbol("s", real=True)
j = Symbol("j", integer=True, positive=True)
n = Symbol("n", integer=True, positive=True)
moment = Symbol("moment", positive=True)


@derives(
    "saddle-recurrences",
    "The series at a well or a barrier, to every order",
    ("gaussian-step", "saddle-series"),
)
def saddle_recurrences(d: Any) -> None:
    d.suppose("phi has a simple zero, where the derivative of phi is c_1; t from there")
    bend = d.step(
        "coefficients of V",
        "integrate",
        2 * term / ((j + 2) * slope),
        Satisfies(lambda found: {"t^j": sympy.simplify(found - _bend())}),
        "V is a parabola times the sum of these times t^j; c_j is the coefficient of t^j in phi",
        left=r"\alpha_j",
    )
    start = d.step(
        "first moment",
        "integrate",
        sympy.sqrt(2 * sympy.pi),
        Identity(lambda: _unit(d)),
        "the Gaussian of gaussian-step in units of its width",
        left="m_0",
    )
    following = d.step(
        "next moment",
        "integrate",
        (2 * n + 1) * moment,
        Satisfies(_next_moment),
        "by parts: what is left vanishes at both ends",
        left="m_{n+1}",
    )
    d.step(
        "du/ds",
        "solve",
        (1 / sympy.sqrt(c2), *_known(d, following)),
        Identity(lambda: _perron(bend)),
        "by Perron's formula; here c_2, c_3, c_4, c_5 and c_6 are the derivatives of V at the "
        "well, as in saddle-series",
        left=(
            r"[s^0] \frac{du}{ds}",
            r"[s^2] \frac{du}{ds}",
            r"[s^4] \frac{du}{ds}",
        ),
    )
    d.conclude(
        (Symbol("alpha_j"), Symbol("m_0"), Symbol("m_next")),
        (bend, start, following),
        "exact",
        note="beside its zero phi is c_1 t + c_2 t^2 + ... and V a parabola times the sum of "
        "alpha_j t^j; m_n is the integral of s^(2 n) exp(-s^2/2)",
    )


def _bend() -> Any:
    whole = sympy.integrate(term * x ** (j + 1), x)
    return whole / (slope * x**2 / 2) / x**j


def _unit(d: Any) -> Any:
    # e^(-lam V'' s^2/2) with lam = V'' = 1.
    return d.use("gaussian-step", step="one Gaussian").subs({S1: 1, kappa: sympy.sqrt(2)})


def _next_moment(found: Any) -> dict[str, Any]:
    gaussian = sympy.exp(-(s**2) / 2)
    by_parts = sympy.diff(-(s ** (2 * n + 1)) * gaussian, s)
    wanted = s ** (2 * n + 2) - found.coeff(moment) * s ** (2 * n)
    return {
        "by parts": sympy.simplify((by_parts - wanted * gaussian) / gaussian / s ** (2 * n)),
        "no term without m_n": found.subs(moment, 0),
    }


def _known(d: Any, following: Any) -> tuple[Any, Any]:
    """The coefficients whose moments give the corrections of saddle-series."""
    ratio = sympy.S.One
    found = []
    for k, name in enumerate(("first correction", "second correction")):
        ratio *= following.coeff(moment).subs(n, k)
        found.append(d.use("saddle-series", step=name) / ratio / sympy.sqrt(c2))
    return found[0], found[1]


def _perron(bend: Any) -> list[Any]:
    alpha = 1 + sum(
        bend.subs({j: k, term: -c / sympy.factorial(k + 1), slope: -c2}) * x**k
        for k, c in enumerate((c3, c4, c5, c6), start=1)
    )
    found = []
    for i in (0, 2, 4):
        power = sympy.series(alpha ** -sympy.Rational(i + 1, 2), x, 0, i + 1).removeO()
        found.append(sympy.expand(power).coeff(x, i) * c2 ** -sympy.Rational(i + 1, 2))
    return found


# -- both sides ------------------------------------------------------------------------------------

behind, ahead, total = (Symbol(name, real=True) for name in ("behind", "ahead", "total"))
nested = [Symbol(f"nested_{name}", real=True) for name in ("left", "right")]
double = [Symbol(f"double_{name}", real=True) for name in ("left", "right")]
own = [Symbol(f"own_{name}", real=True) for name in ("left", "right")]
speed_start = Symbol("speed_start", real=True)


@derives(
    "two-sides", "The escape time from integrals over both sides of the start", ("positive-form",)
)
def two_sides(d: Any) -> None:
    apart = d.step(
        "sides",
        "substitute",
        (behind * double[1] + ahead * double[0]) / total,
        Satisfies(lambda found: {"T": found.subs(total, behind + ahead) - _from_sweeps(d)}),
        "T over lam: sigma and w of positive-form by their integrals, s(0) = 1; K_left and "
        "K_right are the double integrals of either side",
        left=r"\frac{T}{\lambda}",
    )
    whole = {double[0]: nested[0] + own[0] * behind, double[1]: nested[1] + own[1] * ahead}
    moved = d.step(
        "K_right by J_right",
        "split",
        nested[1] + ahead * speed_start,
        Satisfies(
            lambda found: {
                "T": apart.subs({double[0]: nested[0], double[1]: found})
                .subs(speed_start, own[0] + own[1])
                .subs(total, behind + ahead)
                - apart.subs(whole).subs(total, behind + ahead)
            }
        ),
        "the start contributes m_left and m_right to the integrals of e^(-lam V), and T has "
        "their sum m",
        left=r"K_{\mathrm{right}}",
    )
    together = d.step(
        "contribution of the start",
        "substitute",
        (behind * (nested[1] + ahead * speed_start) + ahead * nested[0]) / total,
        Identity(lambda: apart.subs({double[0]: nested[0], double[1]: moved})),
        left=r"\frac{T}{\lambda}",
    )
    d.step(
        "chance of leaving on the left",
        "substitute",
        ahead / total,
        Identity(lambda: _exit_from_sweeps(d)),
        "C of positive-form",
        left="C",
    )
    d.conclude(
        Symbol("T") / lam,
        together,
        note="I_left and I_right are the integrals of e^(lam V) on both sides of the start, "
        "W their "
        "sum; J_left and J_right are the double integrals of e^(lam (V(v) - V(u))), v farther out "
        "than u, without the start's contributions to the inner integral, whose sum is m",
    )


def _exit_from_sweeps(d: Any) -> Any:
    found = d.use("positive-form", step="chance of leaving on the left")
    by_name = {e.name: e for e in found.free_symbols}
    share = found.subs({by_name["sigma_left"]: behind, by_name["sigma_right"]: ahead})
    return sympy.simplify(share).subs(ahead + behind, total)


def _from_sweeps(d: Any) -> Any:
    found = d.use("positive-form", "T")
    by_name = {e.name: e for e in found.free_symbols}
    put = {
        by_name["sigma_left"]: behind,
        by_name["sigma_right"]: ahead,
        by_name["w"]: lam * (double[0] / behind + double[1] / ahead),
    }
    return sympy.simplify(found.subs(put) / lam)
