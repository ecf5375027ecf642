"""Positive float64 numbers as logarithms with errors; the numbers may leave that range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

#: The spacing of float64 numbers near 1, rounded up.
ULP = 2.3e-16


@dataclass(frozen=True, eq=False)
class Logs:
    """Positive numbers by their natural logarithms, with the errors of these to first order; rows
    come last. The rounding of a product or sum is not counted."""

    log: Any
    error: Any

    def __getitem__(self, index: Any) -> Logs:
        return Logs(self.log[index], self.error[index])

    def of(self, rows: Any) -> Logs:
        return Logs(self.log.take(rows, axis=-1), self.error.take(rows, axis=-1))

    def rounded(self) -> Logs:
        """With the rounding error of logarithms of sums."""
        size = np.abs(self.log)
        return Logs(self.log, self.error + ULP * (2 + np.where(size < np.inf, size, 0.0)))

    def put(self, rows: Any, new: Logs) -> None:
        for x, y in zip((*self.log, *self.error), (*new.log, *new.error), strict=True):
            x[rows] = y

    def __iter__(self) -> Iterator[Logs]:
        return (Logs(*x) for x in zip(self.log, self.error, strict=True))

    def __mul__(self, other: Logs) -> Logs:
        return Logs(self.log + other.log, self.error + other.error)

    def __truediv__(self, other: Logs) -> Logs:
        return Logs(self.log - other.log, self.error + other.error)

    def __add__(self, other: Logs) -> Logs:
        gap = self.log - other.log
        less = gap.real < 0
        tail = np.exp(np.where(less, gap, -gap))
        share = np.where(less, tail.real, 1.0) / (1.0 + tail.real)
        log = np.where(less, other.log, self.log) + np.log1p(tail)
        return Logs(log, share * self.error + (1.0 - share) * other.error)
