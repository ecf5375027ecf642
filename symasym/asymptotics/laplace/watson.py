"""Coefficients of Watson's lemma at a maximum from Taylor coefficients, in any arithmetic.

On one side of a maximum, with t >= 0 the distance from it,

    f = f[0] - a t^mu (1 + alpha_1 t + alpha_2 t^2 + ...),    a = -f[mu] > 0,
    g = t^(beta - 1) (g[0] + g[1] t + ...),

and Watson's lemma (DLMF 2.3(ii), 2.4(i)), in the variable v with f = f[0] - a v^mu, gives

    int g e^(lam f) dt ~ e^(lam f[0]) sum_k c_k lam^(-(k + beta)/mu),
    c_k = d_k Gamma((k + beta)/mu) / (mu a^((k + beta)/mu)).

The `reduced` coefficients d_k are polynomials with rational coefficients in the alpha_j and
g[j]. Two ways lead to them, with no step in common:

- `perron_coefficients`: Lagrange's reversion of v^mu = t^mu (1 + alpha_1 t + ...) as a residue,
  d_k = [t^k] (g[0] + g[1] t + ...) (1 + alpha_1 t + ...)^(-(k + beta)/mu);
- `moment_coefficients`: the exponential of what is left beside -a t^mu is expanded in powers
  of lam^(-1/mu), and each power of t is a moment of exp(-a t^mu).

Elements may be anything with +, *, / among themselves and with int: Fraction, mpf, balls,
elements of a SymPy field, or the rows of a float64 array, one column a scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from symasym.base.call_context import mpf_of, own_context, to_mpf
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, digits, exact, shown
from symasym.numbers.polynomials import dot, power

if TYPE_CHECKING:
    from symasym.numbers.arithmetic import Number as Element

    Beta: TypeAlias = int | float | str | Fraction | Element
    Coefficients: TypeAlias = FloatArray | Sequence[Element]

__all__ = ["laplace_coefficients", "moment_coefficients", "perron_coefficients"]


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


def moment_coefficients(
    f: Coefficients,
    g: Coefficients,
    contact: int,
    beta: Beta = 1,
    *,
    step: int = 1,
    start: int = 0,
) -> list[Element]:
    """Reduced coefficients d_k by expanding the exponential and integrating term by term.

    Parameters, returned value and errors are those of `perron_coefficients`, with which it shares
    no step of arithmetic.

    Notes
    -----
    For mu = 2 these are Gaussian moments. With B[m][j] = [t^j] (alpha_1 t + ...)^m,
    d_k = sum over j and m of g[k - j] B[m][j] (-1)^m (s)_m / m!, s = (k + beta)/mu, which is
    Wojdylo's explicit form.

    Examples
    --------
    >>> from fractions import Fraction
    >>> f = [0, 0] + [Fraction((-1) ** (k + 1), k) for k in range(2, 8)]
    >>> moment_coefficients(f, [1, 0, 0, 0, 0, 0], 2, step=2)
    [Fraction(1, 1), Fraction(1, 12), Fraction(1, 864)]
    """
    alpha, weights, (numerator, denominator) = _read(f, g, contact, beta)
    one = weights[0] * 0 + 1
    zero = one * 0
    count = len(weights)
    # powers[m][j - m] = B[m][j]: (alpha_1 t + ...)^m starts at t^m.
    base = alpha[1:]
    powers = [[one] + [zero] * (count - 1)]
    for m in range(1, count):
        last = powers[-1]
        powers.append([dot(base[: i + 1], last[: i + 1][::-1]) for i in range(count - m)])
    reduced = []
    for k in range(start, count, step):
        p, q = k * denominator + numerator, contact * denominator
        total, rising = zero, one
        for m in range(k + 1):
            # Sum over j of g[k - j] B[m][j]; then the moment's Gamma(s + m)/Gamma(s) / m!.
            total = total + rising * dot(weights[: k - m + 1], powers[m][: k - m + 1][::-1])
            rising = rising * (p + q * m) / (-q * (m + 1))
        reduced.append(total)
    return reduced


def laplace_coefficients(
    f: Coefficients,
    g: Coefficients,
    contact: int,
    beta: Number = 1,
    *,
    sides: int = 1,
    dps: int | None = None,
) -> Any:
    """Coefficients c_k of the expansion in powers of lam, as numbers.

    The integral of g e^(lam f) over a neighbourhood of the maximum, on one side or on both, is

    - one side: e^(lam f[0]) sum over k of c[k] lam^(-(k + beta)/contact);
    - both sides of a smooth maximum: e^(lam f[0]) sum over j of c[j] lam^(-(2 j + beta)/contact)
      (the terms between cancel, and are not returned).

    Parameters
    ----------
    f, g : array_like, shape (n, ...), or sequences of Fraction or mpf
        Taylor coefficients as in `perron_coefficients`, in float64 with any number of scenes
        behind the first axis, or exact, or mpf.
    contact : int
        Order of the first term of f - f[0]: 1 at an endpoint with a slope, 2 at a maximum
        with f'' < 0, 4, ...; even if `sides` is 2.
    beta : int, float, Fraction or str, optional
        g behaves as t^(beta - 1); greater than 0.
    sides : {1, 2}
    dps : int, optional
        With exact coefficients: mpf of this many digits instead of float64.

    Returns
    -------
    ndarray, shape (m, ...), or list of mpf
        m = min(n_f - contact, n_g) coefficients for one side, (m + 1)//2 for two.

    Raises
    ------
    InputError
        If f[contact] is not negative, and as `perron_coefficients`.

    Notes
    -----
    In float64 the relative error of c_k is some k^2 ulp times the
    cancellation in its sum, which for k <= 16 costs one to three digits.

    Examples
    --------
    Two scenes at once, e^(-lam x^2/2) and e^(-lam x^2) with g = cos x, to second order:

    >>> f = np.array([[0.0, 0.0], [0.0, 0.0], [-0.5, -1.0], [0.0, 0.0], [0.0, 0.0]])
    >>> g = np.array([[1.0, 1.0], [0.0, 0.0], [-0.5, -0.5]])
    >>> laplace_coefficients(f, g, 2, sides=2).round(6)
    array([[ 2.506628,  1.772454],
           [-1.253314, -0.443113]])
    >>> laplace_coefficients([0, -1, 0], [1, 1], 1, dps=20)  # int (1 + t) e^(-lam t)
    [mpf('1.0'), mpf('1.0')]
    """
    power = exact("beta", beta)
    if sides not in (1, 2):
        raise InputError(f"sides is {shown(sides)}; give 1 (an endpoint or kink) or 2 (inside).")
    if sides == 2 and contact % 2:
        raise InputError(
            f"contact is {contact}, odd, so f has no maximum there seen from both sides; "
            "give an even contact, or sides=1."
        )
    if isinstance(f, np.ndarray) or isinstance(g, np.ndarray):
        f, g = np.asarray(f, dtype=float), np.asarray(g, dtype=float)
    if dps is not None:
        dps = digits(dps)
        f, g = ([exact("a coefficient", x) for x in values] for values in (f, g))
    reduced = perron_coefficients(f, g, contact, power, step=sides)
    a = -_elements(f)[0][contact]
    if not np.all(np.asarray(a > 0)):
        raise InputError(
            f"f[{contact}] is {-np.min(np.asarray(a, dtype=float)):.6g}; at a maximum the first "
            "coefficient after f[0] is negative."
        )
    exponents = [(sides * k + power) / contact for k in range(len(reduced))]

    if dps is not None:
        with own_context(dps + 10) as context:
            a, reduced = mpf_of(a, context), [mpf_of(d, context) for d in reduced]
            own = [mpf_of(s, context) for s in exponents]
            found = times_moments(reduced, own, a, contact, context.gamma, sides)
            return [to_mpf(c, dps) for c in found]
    if hasattr(a, "_mpf_"):
        own = [mpf_of(s, a.context) for s in exponents]
        return times_moments(reduced, own, a, contact, a.context.gamma, sides)
    reduced = [np.asarray(d, dtype=float) for d in reduced]
    a, own = np.asarray(a, dtype=float), [float(s) for s in exponents]
    return np.array(times_moments(reduced, own, a, contact, math.gamma, sides))


def times_moments(
    reduced: Sequence[Element],
    exponents: Sequence[Element],
    a: Element,
    contact: int,
    gamma: Callable[[Element], Element],
    sides: int = 1,
) -> list[Element]:
    """c_k = d_k int_0^oo t^(mu s_k - 1) e^(-a t^mu) dt = d_k Gamma(s_k)/(mu a^s_k), on `sides`."""
    pairs = zip(reduced, exponents, strict=True)
    return [d * (sides * (gamma(s) / (contact * a**s))) for d, s in pairs]


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
