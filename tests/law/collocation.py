"""An independent truth: Chebyshev collocation of the generator by pieces, in NumPy and SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg


def nodes(n: int, a: float, b: float) -> tuple[Any, Any]:
    """Points and the differentiation matrix (Trefethen, Spectral Methods in MATLAB)."""
    x = -np.cos(np.pi * np.arange(n) / (n - 1))
    c = np.r_[2, np.ones(n - 2), 2] * (-1.0) ** np.arange(n)
    d = np.outer(c, 1 / c) / (x[:, None] - x + np.eye(n))
    return (a + b + (b - a) * x) / 2, (d - np.diag(d.sum(1))) * 2 / (b - a)


class Collocation:
    """The law of the exit time by boundary value problems of L = phi d + kappa^2 sigma^2/2 dd."""

    def __init__(
        self, parts: Any, marks: Any, kappa: float, start: float, *, reflecting: Any = None,
        sigma: Any = np.ones_like, slope: Any = np.zeros_like, alpha: float = 0.0, n: int = 40,
    ) -> None:  # fmt: skip
        size, self.bc = n * len(parts), list[Any]()
        self.generator, self.at_start = np.zeros((size, size)), np.zeros(size)
        ends = []
        for k, (phi, a, b) in enumerate(zip(parts, marks[:-1], marks[1:], strict=True)):
            x, d = nodes(n, a, b)
            s, drift = slice(k * n, (k + 1) * n), phi(x) + alpha * kappa**2 * sigma(x) * slope(x)
            self.generator[s, s] = drift[:, None] * d + (kappa * sigma(x))[:, None] ** 2 / 2 * d @ d
            for place in (0, -1):
                value, first = np.zeros((2, size))
                value[s][place], first[s] = 1, d[place]
                ends.append((k * n if place == 0 else (k + 1) * n - 1, value, first))
            if a <= start <= b:
                t = np.cos(np.arange(n) * np.arccos((2 * start - a - b) / (b - a)))
                basis = np.polynomial.chebyshev.chebvander((2 * x - a - b) / (b - a), n - 1)
                self.at_start[:] = 0
                self.at_start[s] = np.linalg.solve(basis.T, t)
        for (i, value, first), (j, other, second) in zip(ends[1:-1:2], ends[2::2], strict=True):
            self.bc += [(i, value - other), (j, first - second)]
        self.outer = [ends[0][0], ends[-1][0]]
        for side, (i, value, first) in zip(("left", "right"), (ends[0], ends[-1]), strict=True):
            self.bc.append((i, first if side == reflecting else value))
        self.absorbs = [side != reflecting for side in ("left", "right")]

    def solve(self, source: Any, s: complex = 0, sides: Any = (0, 0)) -> Any:
        """y of L y - s y = source, with these values at the ends that absorb."""
        a, right = self.generator - s * np.eye(len(self.generator)), source + 0j * s
        for i, row in self.bc:
            a[i], right[i] = row, 0
        for i, x, absorbs in zip(self.outer, sides, self.absorbs, strict=True):
            right[i] = x * absorbs
        return np.linalg.solve(a, right)

    def moments(self, sides: Any = (1, 1)) -> list[Any]:
        """P, E[tau], E[tau^2] on these sides."""
        p = self.solve(self.at_start * 0, 0, sides)
        first = self.solve(-p)
        return [(self.at_start @ x).real for x in (p, first, self.solve(-2 * first))]

    def laplace(self, s: complex, sides: Any = (1, 1)) -> Any:
        """E[e^(-s tau)] on these sides."""
        return self.at_start @ self.solve(self.at_start * 0, s, sides)

    def modes(self) -> tuple[Any, Any]:
        """Eigenvalues, ascending, and c of P(tau > t) = sum c e^(-lambda t)."""
        inner = np.setdiff1d(np.arange(len(self.generator)), [i for i, _ in self.bc])
        edge = [i for i, _ in self.bc]
        rows = np.array([row for _, row in self.bc])
        lift = -np.linalg.solve(rows[:, edge], rows[:, inner])  # values at the edges
        a = self.generator[np.ix_(inner, inner)] + self.generator[np.ix_(inner, edge)] @ lift
        rates, vectors = scipy.linalg.eig(-a)
        c = (self.at_start[inner] + self.at_start[edge] @ lift) @ vectors
        c = c * np.linalg.solve(vectors, np.ones(len(inner)))
        order = np.argsort(rates.real)
        return rates[order], c[order]
