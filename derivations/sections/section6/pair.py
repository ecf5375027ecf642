"""Section 6.2, weak noise: the double integral over a well and a barrier that may coalesce."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

t = Symbol("t", positive=True)
m = Symbol("m", real=True)
Z = Symbol("Z", real=True)
ai, bi = sympy.airyai(Z), sympy.airybi(Z)


@derives("pair-products", "Double integrals over a well and a barrier that may coalesce")
def pair_products(d: Any) -> None:
    d.suppose("lam (V(v) - V(u)) = (s^3/3 - Z s) at u less the same at v, the well first")
    exponent = d.step(
        "distance and middle",
        "substitute",
        Z * t - t**3 / 12 - m**2 * t,
        Identity(_exponent),
        "t = s(v) - s(u) > 0, m half-way between",
        left=r"\lambda (V(v) - V(u))",
    )
    inner = d.step(
        "over the middle",
        "integrate",
        sympy.sqrt(sympy.pi / t) * sympy.exp(Z * t - t**3 / 12),
        Identity(lambda: _over_middle(exponent)),
        left=r"\int_{-\infty}^{\infty} e^{t Z - t^3/12 - m^2 t} \, dm",
    )
    d.step(
        "the integrand is a derivative",
        "integrate",
        -4 * sympy.sqrt(sympy.pi * t) * sympy.exp(Z * t - t**3 / 12),
        Satisfies(
            lambda found: {
                "J''' - 4 Z J' - 2 J under the integral": sympy.simplify(
                    sympy.diff(found, t) / inner - (t**3 - 4 * Z * t - 2)
                )
            }
        ),
        "it vanishes at t = 0 and oo, so that J''' - 4 Z J' - 2 J = 0",
    )
    start = d.step(
        "at Z = 0",
        "evaluate",
        tuple(_moment(n) for n in range(3)),
        Identity(lambda: [_integral(inner, n) for n in range(3)]),
        "J, J' and J''",
        left=(
            "J(0)",
            "J'(0)",
            "J''(0)",
        ),
    )
    both = d.step(
        "J",
        "solve",
        sympy.pi**2 * (ai**2 + bi**2),
        Satisfies(lambda found: _solves(found, start)),
        "DLMF 9.11.4",
        left="J(Z)",
    )
    three = d.step(
        "with s(v), and with s(u) s(v)",
        "differentiate",
        (
            both,
            sympy.pi**2 * (ai * sympy.diff(ai, Z) + bi * sympy.diff(bi, Z)),
            -(sympy.pi**2) * (sympy.diff(ai, Z) ** 2 + sympy.diff(bi, Z) ** 2),
        ),
        Identity(lambda: _weighted(both)),
        "J' has s(v) - s(u), whose parts are opposite by symmetry; J'' has its square, of which "
        "s^2 is Z up to the regular part",
        left=(
            "J",
            "J_1",
            "J_2",
        ),
    )
    d.conclude(
        (Symbol("J"), Symbol("J_1"), Symbol("J_2")),
        three,
        "exact",
        note="weights 1, s(v) and s(u) s(v), in units of lam^(-2/3), lam^(-1) and lam^(-4/3); "
        "Z = lam^(2/3) zeta, phi du = (s^2 - zeta) ds",
    )


def _weighted(both: Any) -> list[Any]:
    slope = sympy.diff(both, Z) / 2
    return [both, sympy.expand(slope), sympy.expand(Z * both - sympy.diff(slope, Z))]


def _exponent() -> Any:
    def cubic(s: Any) -> Any:
        return s**3 / 3 - Z * s

    return sympy.expand(cubic(m - t / 2) - cubic(m + t / 2))


def _over_middle(exponent: Any) -> Any:
    """The integral of exp(exponent) over m, a Gaussian or an error: SymPy may search for ever."""
    rest, square = exponent.as_independent(m, as_Add=True)
    if sympy.degree(square, m) != 2:
        raise ValueError(f"exp({exponent}) is no Gaussian in m.")
    return sympy.exp(rest) * sympy.integrate(sympy.exp(square), (m, -sympy.oo, sympy.oo))


def _moment(n: int) -> Any:
    power = sympy.Rational(2 * n + 1, 6)
    return sympy.sqrt(sympy.pi) * sympy.Integer(12) ** power * sympy.gamma(power) / 3


def _integral(inner: Any, n: int) -> Any:
    """int t^n of the integrand at Z = 0, by w = t^3/12."""
    w = Symbol("w", positive=True)
    old = sympy.cbrt(12 * w)
    integrand = (t**n * inner).subs(Z, 0).subs(t, old) * sympy.diff(old, w)
    powers = sympy.powsimp(sympy.expand(integrand * sympy.exp(w)))
    if powers.has(sympy.exp):
        raise ValueError(f"{inner} has no factor exp(-t^3/12) at Z = 0.")
    return sympy.integrate(powers * sympy.exp(-w), (w, 0, sympy.oo))


def _solves(found: Any, start: Any) -> dict[str, Any]:
    rest = sympy.diff(found, Z, 3) - 4 * Z * sympy.diff(found, Z) - 2 * found
    equations = {"the differential equation": sympy.expand(rest)}
    for n, value in enumerate(start):
        here = sympy.diff(found, Z, n).subs(Z, 0)
        equations[f"derivative {n} at 0"] = _in_thirds(here) - _in_thirds(value)
    return equations


def _in_thirds(value: Any) -> Any:
    """gamma(1/6), gamma(5/6) and gamma(2/3) by gamma(1/3): duplication and reflection."""
    third = sympy.gamma(sympy.Rational(1, 3))
    sixth = sympy.sqrt(3 / sympy.pi) * third**2 / sympy.cbrt(2)
    swap = {
        sympy.gamma(sympy.Rational(2, 3)): 2 * sympy.pi / (sympy.sqrt(3) * third),
        sympy.gamma(sympy.Rational(1, 6)): sixth,
        sympy.gamma(sympy.Rational(5, 6)): 2 * sympy.pi / sixth,
    }
    return sympy.simplify(sympy.sympify(value).subs(swap))
