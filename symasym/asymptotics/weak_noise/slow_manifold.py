"""The terms h_k of the slow manifold M = h_1/lam + h_2/lam^2 + ... of M' = 1 - lam phi M.

h_1 = 1/phi and h_{k+1} = -h_k'/phi; beside a simple zero of phi at t = 0, t^(2k - 1) h_k is a power
series. Their integrals are the regular part (`symasym.asymptotics.weak_noise.regular_part`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from symasym.asymptotics.weak_noise.series import trimmed

__all__ = [
    "laurent",
    "least_square",
    "pole_primitive",
    "primitive",
    "product",
    "quotient",
    "reciprocal",
]


def laurent(
    taylor: list[Any],
    zero: bool,
    count: int,
    weight: list[Any] | None = None,
    length: int | None = None,
) -> Iterator[list[Any]]:
    """Coefficients of h_1, ..., h_count times t^(2k - 1) if `zero`, from phi's (`taylor[0]` = 0).

    Each list is a coefficient shorter than the one before where `zero` is false. With the
    coefficients of a `weight` h_1 is the weight over phi. The coefficients are mpf, or floats
    and float64 arrays; as many are returned as are given, or `length`.
    """
    psi = trimmed(taylor[1:] if zero else taylor)
    if length is None:
        length = len(taylor) - zero if weight is None else len(weight)
    inverse = 1 / psi[0]
    last = quotient([1.0] if weight is None else weight, psi, inverse, length)
    yield last
    for k in range(1, count):
        if zero:
            slope = [(2 * k - 1 - j) * c for j, c in enumerate(last)]
        else:
            slope = [-j * c for j, c in enumerate(last)][1:]
        last = quotient(slope, psi, inverse, len(slope))
        yield last


def quotient(numerator: list[Any], psi: list[Any], inverse: Any, length: int) -> list[Any]:
    """The power series numerator/psi, of which `inverse` is 1/psi[0]; both may be short."""
    series: list[Any] = []
    context = getattr(inverse, "context", None)
    for n in range(length):
        total: Any = numerator[n] if n < len(numerator) else 0.0
        most = min(n, len(psi) - 1)
        if context is not None:
            if most:
                # Adding up before rounding is several times faster than rounding each product.
                total = total - context.fdot(
                    zip(psi[1 : most + 1], series[n - most :][::-1], strict=True)
                )
        else:
            for j in range(1, most + 1):
                if j == 1:
                    total = total - psi[1] * series[n - 1]
                else:
                    # In place, now that it is not an entry of the numerator any more.
                    total -= psi[j] * series[n - j]
        series.append(total * inverse)
    return series


def pole_primitive(series: list[Any], k: int, t: Any, log: Any) -> Any:
    """A primitive at t of h_{k+1}'s poles, from its coefficients times t^(2k + 1).

    `log` is log(t) or log|t|; nothing at t = 0, the finite part.
    """
    if not isinstance(t, np.ndarray) and t == 0:
        return 0 * t
    inverse = 1 / t
    total: Any = 0.0
    for j in range(2 * k + 1, 1, -1):
        total = (total + series[2 * k + 1 - j] / (1 - j)) * inverse
    return total + series[2 * k] * log


def reciprocal(c: list[Any]) -> list[Any]:
    """The power series 1/c, as long."""
    return quotient([1.0], c, 1 / c[0], len(c))


def product(a: list[Any], b: list[Any]) -> list[Any]:
    """The power series a b, as long as a."""
    fdot = a[0].context.fdot
    return [fdot(zip(a[: n + 1], b[n::-1], strict=True)) for n in range(len(a))]


def primitive(t: Any, j: int, context: Any) -> Any:
    """A primitive of t^-j; nothing at t = 0, the finite part."""
    if t == 0:
        return context.zero
    if j == 1:
        return context.log(abs(t)) if isinstance(t, context.mpf) else context.log(t)
    return t ** (1 - j) / (1 - j)


def least_square(context: Any) -> Any:
    """Below this rounding decides whether two zeros are real."""
    return context.ldexp(1, 24 - context.prec)
