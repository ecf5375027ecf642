"""The median Borel–Padé sum of a Laplace expansion, beyond its optimal order.

sum_k c_k lam^-(s + k) is lam^(b - s) times the Laplace transform of t^(b - 1) B(t), B = sum_k c_k
t^k/Gamma(b + k), b = s/2. For polynomial f, B is singular where t is a singulant F = f(p) - f(q), q
a saddle of f seen from the maximum p (M. V. Berry and C. J. Howls, Proc. R. Soc. A 434 (1991) 657).
A minimum q of f has F > 0: real lam is on the series' Stokes line, and the real integral is the
mean of the sums that pass F above and below (E. Delabaere and F. Pham, Ann. IHP 71 (1999) 1), q
having no share of its own unless f'' vanishes there: such f are refused. Padé's approximant
continues B; with its poles p_j and residues, z = -p_j, and t in units of 1/lam,

    int_0^oo e^(-t) t^(b - 1)/(t - p_j) dt = Gamma(b) z^(b - 1) e^z Gamma(1 - b, z)

(DLMF 8.6.4), of which for p_j > 0 the real part is the mean. Beyond a complex pair of singulants
with Re F > 0 the approximants may follow another branch: the sum is then as good as
e^(-lam |F|^2/Re F) and no better.
"""

from __future__ import annotations

from typing import Any

import sympy
from flint import acb, acb_poly, arb, arb_mat
from sympy import Expr, Symbol

#: Coefficients that order="borel" uses, and the bits of its approximants.
TERMS, BITS = 41, 640


def applies(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> bool:
    """True for polynomials, f' and f'' without a common zero in (a, b)."""
    if not (f.is_polynomial(x) and g.is_polynomial(x)):
        return False
    slope = sympy.Poly(f, x).diff(x)
    return not any(a < z and z < b for z in sympy.gcd(slope, slope.diff(x)).real_roots())


def median_sum(terms: list[Any], first: Any) -> Any:
    """The sum of c_k lam^-(first + k), terms in balls."""
    b = first / 2
    whole, poles = approximant([x / (b + k).gamma() for k, x in enumerate(terms)])
    total = sum((a * (b + k).gamma() for k, a in enumerate(whole)), arb(0))
    for pole, residue in poles:
        z = -pole
        share = acb(b).gamma() * z ** (b - 1) * z.exp() * z.gamma_upper(1 - b)
        total += (residue * share).real
    return total


def approximant(b: list[Any]) -> tuple[list[Any], list[tuple[Any, Any]]]:
    """Padé's approximant of sum b_k t^k: polynomial part, and its poles with their residues.

    Numerator and denominator have half the degree of the series, less where it is that of a lower
    one: then the equations for the denominator are singular.
    """
    for m in range((len(b) - 1) // 2, 0, -1):
        rows = [[b[m + i - j] for j in range(1, m + 1)] for i in range(1, m + 1)]
        try:
            solved = arb_mat(rows).solve(arb_mat([[-b[m + i]] for i in range(1, m + 1)]))
            q = acb_poly([arb(1), *(x.mid() for x in solved.entries())])
            zeros = q.roots(tol=arb(2) ** (-BITS // 2)) if q.degree() == m else []
        except (ValueError, ZeroDivisionError):
            continue
        if zeros:
            p = acb_poly((acb_poly(b[: m + 1]) * q).coeffs()[: m + 1])
            poles = [acb(z.real) if z.imag.contains(0) else z for z in zeros]
            return [(p[m] / q[m]).real], [(z, p(z) / q.derivative()(z)) for z in poles]
    return b, []
