"""Majorants of Laplace's coefficients at a well or a barrier, which chance does not make small.

With V - V(u) = +-a t^2 (1 + alpha_1 t + alpha_2 t^2 + ...), the coefficient of lam^-(n + 1/2) is
Gamma(n + 1/2) a^-(n + 1/2) times [t^2n] (1 + sum alpha_j t^j)^-(n + 1/2) (Perron's formula,
`symasym.asymptotics.laplace.watson`). With -|alpha_j| for alpha_j all its products are positive:
M_n, which bounds its size (Cauchy's method of majorants) and vanishes only where each product
does. Where the next two terms behind the N-th, which are known, nearly vanish, M_{N+3} tells what
may follow.

An alpha_j that is first felt in a later term is felt there by

    L_n = a^-(n + 1/2) (Gamma(n + 3/2) |alpha_2n| + Gamma(n + 5/2)/2 sum |alpha_i alpha_j|),

i + j = 2n: the terms of first and second order in the alpha_j.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from symasym.numbers.arithmetic import Arithmetic
from symasym.series.power_series import power

Numbers = Any

#: Taylor coefficients of A beyond those of the terms themselves that are looked at.
FURTHER = 8


class Majorants(NamedTuple):
    """M_n and L_n for n = 0, 1, ...; M_n as far as it is wanted, L_n further on."""

    full: list[Numbers]
    first_felt: list[Numbers]

    def behind(self, known: int) -> list[Numbers]:
        """Majorants of the coefficients behind the first `known`, of which the first is full."""
        return self.full[known : known + 1] + self.first_felt[known + 1 :]


def majorants(taylor: list[Numbers], count: int, arithmetic: Arithmetic) -> Majorants:
    """Those of a zero of A with the Taylor coefficients `taylor` of A, M_n for n <= `count`."""
    slope = abs(taylor[1])
    a = slope / 2
    alpha = [2 * abs(c) / ((j + 2) * slope) for j, c in enumerate(taylor[2:], start=1)]
    negative = [1, *(-x for x in alpha)]
    full, later, inverse = [], [], 1 / a
    front = a**-0.5 * a
    for n in range(max(count, len(alpha)) + 1):
        front = front * inverse
        if n <= count:
            positive = power(negative, -(2 * n + 1), 2, 2 * n + 1, arithmetic.one)[2 * n]
            full.append(front * arithmetic.gamma(2 * n + 1, 2) * positive)
        pairs: Numbers = 0 * a
        for i in range(max(1, 2 * n - len(alpha)), min(len(alpha), 2 * n - 1) + 1):
            pairs = pairs + alpha[i - 1] * alpha[2 * n - i - 1]
        felt = arithmetic.gamma(2 * n + 5, 2) / 2 * pairs
        if 0 < 2 * n <= len(alpha):
            felt = felt + arithmetic.gamma(2 * n + 3, 2) * alpha[2 * n - 1]
        later.append(front * felt)
    return Majorants(full, later)
