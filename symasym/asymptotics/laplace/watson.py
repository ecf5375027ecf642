"""Coefficients of Watson's lemma at a maximum from Taylor coefficients, in any arithmetic.

On one side of a maximum, with t >= 0 the distance from it,

    f = f[0] - a t^mu (1 + alpha_1 t + alpha_2 t^2 + ...),    a = -f[mu] > 0,
    g = t^(beta - 1) (g[0] + g[1] t + ...),

and Watson's lemma (DLMF 2.3(ii), 2.4(i)), in the variable v with f = f[0] - a v^mu, gives

    int g e^(lam f) dt ~ e^(lam f[0]) sum_k c_k lam^(-(k + beta)/mu),
    c_k = d_k Gamma((k + beta)/mu) / (mu a^((k + beta)/mu)).

The `reduced` coefficients d_k are polynomials with rational coefficients in the alpha_j and
g[j]: by Lagrange's reversion of v^mu = t^mu (1 + alpha_1 t + ...) as a residue,
d_k = [t^k] (g[0] + g[1] t + ...) (1 + alpha_1 t + ...)^(-(k + beta)/mu).

Elements may be anything with +, *, / among themselves and with int: Fraction, mpf, balls,
elements of a SymPy field, or the rows of a float64 array, one column a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from symasym.base.call_context import mpf_of
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, exact, shown
from symasym.numbers.polynomials import dot, power

if TYPE_CHECKING:
    from symasym.numbers.arithmetic import Number as Element

    Beta: TypeAlias = int | float | str | Fraction | Element
    Coefficients: TypeAlias = FloatArray | Sequence[Element]

__all__ = ["perron_coefficients"]


def perron_coefficients(
    f: Coefficients,
    g: Coefficients,
    contact: int,
    beta: Beta = 1,
    *,
    step: int = 1,
    start: int = 0,
) -> list[Element]:
    """Reduced coefficients d_k by Lagrange's reversion (Perron's formula).

    Parameters
    ----------
    f : sequence, length at least contact + 1
        Taylor coefficients of f in the distance t from its maximum. f[1] to f[contact - 1] are
        not read, f[0] neither. Rows of an array are scenes' coefficients of one order.
    g : sequence, not empty
        Taylor coefficients of g / t^(beta - 1).
    contact : int
        Order mu of the first term of f - f[0], at least 1.
    beta : int or Fraction, optional
        Greater than 0; or an element of the field of `f` and `g` (then not checked).
    step, start : int, optional
        Return only d_start, d_(start + step), ... (step 2 at a smooth interior maximum).

    Returns
    -------
    list
        d_start, d_(start + step), ...: as many as `f` and `g` determine,
        min(len(f) - contact, len(g)) before thinning by `step`.

    Raises
    ------
    InputError
        For too few coefficients, a contact below 1 or a beta not above 0.

    Notes
    -----
    O. Perron, Sitzungsber. Bayer. Akad. Wiss. (1917) 191; J. Wojdylo, SIAM Rev. 48 (2006) 76;
    DLMF 2.3.15. Takes about n^3/6 products of elements for n coefficients.

    Examples
    --------
    Stirling: the integral of e^(lam (log(1 + t) - t)), of which every other term survives.

    >>> from fractions import Fraction
    >>> f = [0, 0] + [Fraction((-1) ** (k + 1), k) for k in range(2, 8)]
    >>> perron_coefficients(f, [1, 0, 0, 0, 0, 0], 2, step=2)
    [Fraction(1, 1), Fraction(1, 12), Fraction(1, 864)]
    """
    alpha, weights, (numerator, denominator) = _read(f, g, contact, beta)
    reduced = []
    for k in range(start, len(weights), step):
        # The exponent of the power is -s = -p/q, kept as integers (p an element if beta is).
        p, q = k * denominator + numerator, contact * denominator
        root = power(alpha, -p, q, k + 1, weights[0] * 0 + 1)
        reduced.append(dot(weights[: k + 1], root[::-1]))
    return reduced


def _elements(*sequences: Coefficients) -> list[list[Element]]:
    """Lists of elements of one kind: integers become Fractions unless floats stand beside them."""
    lists = [list(values) for values in sequences]
    others = {type(x) for values in lists for x in values} - {int, Fraction}
    convert = _field_of(others) or (lambda x: x)
    return [[convert(x) if isinstance(x, (int, Fraction)) else x for x in v] for v in lists]


def _field_of(kinds: set[type]) -> Callable[[int | Fraction], Element] | None:
    """The map of exact numbers into the arithmetic of `kinds`; None if their own operators do."""
    if not kinds:
        return Fraction
    kind: Any = next(iter(kinds))
    if kind is float:
        return float
    if hasattr(kind, "_mpf_") and hasattr(kind, "context"):
        return lambda x: mpf_of(x, kind.context)
    return None


def _read(
    f: Coefficients, g: Coefficients, contact: int, beta: Beta
) -> tuple[list[Element], list[Element], tuple[Element, int]]:
    """alpha (with alpha_0), g's coefficients, and beta as numerator and denominator."""
    if isinstance(contact, bool) or not isinstance(contact, (int, np.integer)) or contact < 1:
        raise InputError(f"contact is {shown(contact)}; give a whole number, 1 or more.")
    steep, weights = _elements(f, g)
    if len(steep) <= contact or not weights:
        raise InputError(
            f"f has {len(steep)} and g has {len(weights)} Taylor coefficients; contact {contact} "
            f"needs at least {contact + 1} of f and 1 of g."
        )
    count = min(len(steep) - contact, len(weights))
    alpha = [1, *(x / steep[contact] for x in steep[contact + 1 : contact + count])]
    if isinstance(beta, (int, float, str, Fraction)):
        beta = exact("beta", beta)
        if beta <= 0:
            raise InputError(
                f"beta is {beta}; it must be greater than 0, or the integral diverges."
            )
        return alpha, weights[:count], (beta.numerator, beta.denominator)
    return alpha, weights[:count], (beta, 1)
