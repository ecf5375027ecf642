"""The terms h_k of the outer part, and what is done with their series.

h_1 = 1/phi and h_{k+1} = -h_k'/phi (`symasym.asymptotics.weak_noise.regular_part`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

__all__ = ["laurent", "least_square", "primitive", "product", "reciprocal"]


def laurent(
    taylor: list[Any], zero: bool, count: int, weight: list[Any] | None = None
) -> Iterator[list[Any]]:
    """Coefficients of h_1, ..., h_count times t^(2k - 1) if `zero`, from phi's (`taylor[0]` = 0).

    Each list is a coefficient shorter than the one before where `zero` is false. With the
    coefficients of a `weight` h_1 is the weight over phi.
    """
    inverse = reciprocal(taylor[1:] if zero else taylor)
    last = inverse if weight is None else product(weight, inverse)
    yield last
    for k in range(1, count):
        if zero:
            slope = [(2 * k - 1 - j) * c for j, c in enumerate(last)]
        else:
            slope = [-j * c for j, c in enumerate(last)][1:]
        last = product(slope, inverse)
        yield last


def reciprocal(c: list[Any]) -> list[Any]:
    found = [1 / c[0]]
    for n in range(1, len(c)):
        found.append(-_dot(c[1 : n + 1], found[::-1]) * found[0])
    return found


def product(a: list[Any], b: list[Any]) -> list[Any]:
    return [_dot(a[: n + 1], b[n::-1]) for n in range(len(a))]


def _dot(a: list[Any], b: list[Any]) -> Any:
    # Adding up before rounding is several times faster than rounding each product.
    return a[0].context.fdot(zip(a, b, strict=True))


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
