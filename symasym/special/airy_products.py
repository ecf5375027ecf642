"""Two coalescing critical points in closed form: Airy functions, and their products.

With phi du = (s² - zeta) ds, V = level - (s³/3 - zeta s) and Z = lam^(2/3) zeta, an integration by
parts turns (s² - zeta) G into ∓ G'/lam, so that each weight is lowered to a series of a + b s:

    int g e^{-lam V}           = pi e^{-lam level} (a Bi(Z) lam^(-1/3) - b Bi'(Z) lam^(-2/3)),
    int h e^{lam V}            = pi e^{lam level} (a' Bi(Z) lam^(-1/3) + b' Bi'(Z) lam^(-2/3)),
    int int_{u < v} g(u) h(v) e^{lam (V(v) - V(u))}
        = pi² (a a' (Ai² + Bi²) lam^(-2/3) + (a b' - b a') (Ai Ai' + Bi Bi') lam^(-1)
               - b b' (Ai'² + Bi'²) lam^(-4/3)),

a, b with (-1/lam)^n, a', b' with lam^-n. The first line of the last is DLMF 9.11.4, the others are
its derivatives in zeta; the critical point that comes first is the minimum of V. What the
integrations by parts leave behind has no exponential, and is the outer part.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.generated.arithmetic_formulas import over_pair, pair_units
from symasym.generated.plain_formulas import next_weight, pair_factors
from symasym.numbers.arithmetic import Digits, Number
from symasym.series.power_series import Truncated
from symasym.special.airy import AiryProducts, airy_products

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

#: A value, and a size that has no zeros by chance.
Term = tuple[Any, Any]
#: (a_n, b_n), without their powers of 1/lam.
Rows = list[tuple[Any, Any]]


def by_parts(zeta: Number, pq: Rows, count: int) -> tuple[list[Any], list[Any]]:
    """a_n and b_n for n < count from p_k, q_k for k < 2 count - 1; G_(n+1) = H_n'."""
    p, q = ([pair[j] for pair in pq] for j in (0, 1))
    a, b = [], []
    for _ in range(count):
        a.append(p[0])
        b.append(q[0])
        rest = range(len(p) - 2)
        rows = [next_weight(k, zeta, p[k + 2], q[k + 1], q[k + 2]) for k in rest]
        p, q = ([row[j] for row in rows] for j in (0, 1))
    return a, b


class PairTerms(NamedTuple):
    """The terms of int g e^{-lam V}, int h e^{lam V} and the double integral, heights left out."""

    falling: list[Term]
    rising: list[Term]
    both: list[Term]


def product_rows(falling: Rows, rising: Rows) -> list[tuple[Any, Any, Any]]:
    """Factors of Ai² + Bi², Ai Ai' + Bi Bi' and Ai'² + Bi'² in the terms lam^-n, over pi²."""
    count = min(len(falling), len(rising))
    signed = [((-1) ** n * a, (-1) ** n * b) for n, (a, b) in enumerate(falling)]
    weights = (
        Truncated([row[j] for row in rows[:count]], count)
        for rows in (signed, rising)
        for j in (0, 1)
    )
    return list(zip(*(factor.c for factor in pair_factors(*weights)), strict=True))


def pair_terms(
    zeta: Number,
    falling: Rows,
    rising: Rows,
    lam: mpf,
    context: MPContext,
    known: AiryProducts | None = None,
) -> PairTerms:
    """All terms that the rows determine; `known` are the products at Z, if they are."""
    arithmetic, third = Digits(context), context.cbrt(lam)
    z, small = third**2 * zeta, 1 / third
    airy = airy_products(z, arithmetic) if known is None else known
    growth = context.exp(2 * z * context.sqrt(z) / 3) if z > 0 else context.one
    squares, cross, slopes = (growth * growth * y for y in airy[:3])
    bi, bi1 = growth * airy.bi, growth * airy.bi_slope
    # The modulus functions have no zeros.
    modulus = context.sqrt(squares), context.sqrt(slopes)

    def single(rows: Rows, step: int) -> list[Term]:
        """The terms of a single integral, of Bi and Bi'."""
        terms, which = [], (1 - step) // 2
        for n, (a, b) in enumerate(rows):
            value = over_pair(arithmetic, a, small, b, bi, bi1)[which]
            size = over_pair(arithmetic, abs(a), small, abs(b), *modulus)[0]
            terms.append((step**n * lam**-n * value, lam**-n * size))
        return terms

    functions = pair_units(arithmetic, small, squares, cross, slopes)
    both = []
    for n, row in enumerate(product_rows(falling, rising)):
        values = [lam**-n * c * y for c, y in zip(row, functions, strict=True)]
        both.append((sum(values, 0 * z), sum((abs(y) for y in values), 0 * z)))
    return PairTerms(single(falling, -1), single(rising, 1), both)
