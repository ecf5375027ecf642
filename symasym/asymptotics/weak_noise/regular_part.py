"""The outer part of weak noise: what e^{lam V} and e^{-lam V} make of each other where u = v.

M(v) = e^{lam V(v)} int e^{-lam V} solves M' = 1 - lam phi M, and away from zeros of
phi it is h_1/lam + h_2/lam^2 + ... besides exponentials, with h_1 = 1/phi and
h_{k+1} = -h_k'/phi. Here their integrals are found, as Hadamard's finite part at
zeros of phi: the wells and barriers there bring exponentials of their own
(`symasym.asymptotics.weak_noise.critical_points`), and nothing else, since a path above the zero
and one below it differ by a pure exponential. For a polynomial A all is a sum over the zeros
of A in the complex plane; otherwise over Taylor panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symasym.asymptotics.weak_noise.regular_panels import panel_integrals
from symasym.asymptotics.weak_noise.slow_manifold import laurent, least_square, pole_primitive
from symasym.base.contexts import mpf_of
from symasym.base.errors import AccuracyError, InputError
from symasym.drift.taylor_field import ExactField
from symasym.numbers.polynomial_roots import refined
from symasym.numbers.polynomials import shifted
from symasym.numbers.quadratic_factor import split_pair

__all__ = ["layer_integrals"]

# Zeros closer than this are not told apart well enough for partial fractions.
_CLUSTER = 1e-5


def layer_integrals(
    field: ExactField, lo: Fraction, hi: Fraction, zeros: Sequence[Any], count: int, context: Any
) -> list[Any]:
    """Finite parts of int h_k over [lo, hi] inside [-1, 1], k = 1 to `count`.

    `zeros` are those of phi in (lo, hi), all simple; one exactly at `lo` is taken as a zero too,
    and then what diverges as a power or logarithm of the distance is dropped.
    """
    if field.is_polynomial:
        taylor = field.taylor(Fraction(0), Fraction(1), 0)
        numbers = [mpf_of(c, context) for c in taylor]
        roots = _roots(numbers, context)
        if roots is not None:
            found = _by_fractions(numbers, roots, mpf_of(lo, context), mpf_of(hi, context), count)
            if found is not None:
                return found
    return panel_integrals(field, lo, hi, zeros, count, context)


# -- polynomials: partial fractions ----------------------------------------------------------------


def _roots(exact: list[Any], context: Any) -> list[Any] | None:
    """All zeros, roughly, or None where more than two are too close to each other."""
    c = np.array([float(x) for x in exact])
    trimmed = np.trim_zeros(c / np.abs(c).max(), "b")
    if len(trimmed) < 2:
        return []
    with np.errstate(all="ignore"):
        roots = np.polynomial.polynomial.polyroots(trimmed).astype(complex)
    if not np.isfinite(roots).all():
        return None
    close = np.abs(roots[:, None] - roots) <= _CLUSTER * np.maximum(1, np.abs(roots))
    found: list[Any] = []
    for k, root in enumerate(roots):
        others = np.flatnonzero(close[k])
        if len(others) == 1:
            real = abs(root.imag) < 1e-9 * (1 + abs(root))
            found.append(context.mpf(root.real) if real else context.mpc(complex(root)))
        elif len(others) > 2:
            return None
        elif others[0] == k:
            middle = roots[others].mean()
            # Off the real line float64 has to tell them apart.
            pair = _close_pair(exact, middle.real, context) if abs(middle.imag) < 1e-9 else None
            if pair is None:
                return None
            found += pair
    return found


def _close_pair(c: list[Any], middle: float, context: Any) -> list[Any] | None:
    """The two zeros about `middle`; float64 has only half of the digits of each."""
    x = context.mpf(middle)
    try:
        pair = split_pair(shifted(c, x), context)
    except (AccuracyError, InputError):
        return None
    if abs(pair.square) <= least_square(context):
        return None
    apart = context.sqrt(pair.square)
    return [x + pair.middle - apart, x + pair.middle + apart]


def _by_fractions(c: list[Any], roots: list[Any], lo: Any, hi: Any, count: int) -> list[Any] | None:
    context = lo.context
    if not roots:
        return [(hi - lo) / c[0], *[context.zero] * (count - 1)]
    found = [context.zero] * count
    for rough in roots:
        if context.im(rough) < 0:
            continue
        root = refined(c, rough, context)
        if root is None:
            return None
        taylor = shifted(c, root)[: 2 * count]
        taylor[0] = context.zero
        taylor += [context.zero] * (2 * count - len(taylor))
        twice = 1 if isinstance(root, context.mpf) else 2
        ends = []
        for t, sign in ((hi - root, 1), (lo - root, -1)):
            log = (context.log(abs(t)) if twice == 1 else context.log(t)) if t else t
            ends.append((t, log, sign))
        for k, series in enumerate(laurent(taylor, True, count)):
            for t, log, sign in ends:
                found[k] += twice * sign * context.re(pole_primitive(series, k, t, log))
    return found
