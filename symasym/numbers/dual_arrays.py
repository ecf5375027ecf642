"""float64 arrays that carry their derivatives: forward differentiation of a NumPy text.

A `DualArray` is x and dx/dp for several parameters p, in front of whose axes stands that of the
parameters. Operators, the ufuncs of `_RULES` and the functions of `_FUNCTIONS` take it in an
array's place (NumPy's protocols ``__array_ufunc__`` and ``__array_function__``), so that a formula
written for arrays gives its derivatives as well (A. Griewank, A. Walther, Evaluating Derivatives,
SIAM 2008, chapter 3). Comparisons compare the values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from symasym.base.inputs import FloatArray

__all__ = ["DualArray", "slopes_of", "value_of"]


class DualArray:
    """Values of shape s, and their derivatives of shape (parameters, *s)."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: FloatArray, slopes: FloatArray) -> None:
        self.value, self.slopes = value, slopes

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the values."""
        shape: tuple[int, ...] = self.value.shape
        return shape

    def __getitem__(self, index: Any) -> DualArray:
        inner = index if isinstance(index, tuple) else (index,)
        return DualArray(self.value[index], self.slopes[(slice(None), *inner)])

    def __setitem__(self, index: Any, x: Any) -> None:
        inner = index if isinstance(index, tuple) else (index,)
        self.value[index] = value_of(x)
        self.slopes[(slice(None), *inner)] = slopes_of(x)

    @property
    def T(self) -> DualArray:
        """A matrix, transposed."""
        return DualArray(self.value.T, self.slopes.swapaxes(1, 2))

    def reshape(self, *shape: Any) -> DualArray:
        """The same numbers in another shape."""
        value = self.value.reshape(*shape)
        return DualArray(value, self.slopes.reshape(len(self.slopes), *value.shape))

    def sum(self, axis: int) -> DualArray:
        """Sums along an axis, counted from the first of the values."""
        return DualArray(self.value.sum(axis=axis), self.slopes.sum(axis=axis + 1))

    def __neg__(self) -> DualArray:
        return DualArray(-self.value, -self.slopes)

    def __abs__(self) -> DualArray:
        sign = np.where(self.value < 0, -1.0, 1.0)
        return DualArray(sign * self.value, sign * self.slopes)

    def __add__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            return DualArray(self.value + other.value, self.slopes + other.slopes)
        total = self.value + other
        if total.shape == self.value.shape:
            return DualArray(total, self.slopes)
        return DualArray(total, self.slopes + np.zeros(np.shape(other)))

    __radd__ = __add__

    def __sub__(self, other: Any) -> DualArray:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> DualArray:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            slopes = self.slopes * other.value + self.value * other.slopes
            return DualArray(self.value * other.value, slopes)
        return DualArray(self.value * other, self.slopes * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            ratio = self.value / other.value
            return DualArray(ratio, (self.slopes - ratio * other.slopes) / other.value)
        return DualArray(self.value / other, self.slopes / other)

    def __rtruediv__(self, other: Any) -> DualArray:
        # Slopes over a value, not 1 over its square, which may be below the range of float64.
        ratio = other / self.value
        return DualArray(ratio, -ratio * (self.slopes / self.value))

    def __matmul__(self, matrix: FloatArray) -> DualArray:
        return DualArray(self.value @ matrix, self.slopes @ matrix)

    def __lt__(self, other: Any) -> Any:
        return self.value < value_of(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > value_of(other)

    def __eq__(self, other: object) -> Any:
        return self.value == value_of(other)

    __hash__ = None  # type: ignore[assignment]

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """A ufunc of `_RULES`, ``reduceat`` or ``accumulate``; all options are refused."""
        if method == "reduceat" and ufunc in (np.add, np.maximum):
            x, first = inputs
            return DualArray(ufunc.reduceat(x.value, first), ufunc.reduceat(x.slopes, first, -1))
        if method == "accumulate" and ufunc in (np.add, np.multiply):
            (x,) = inputs
            value = ufunc.accumulate(x.value)
            if ufunc is np.add:
                return DualArray(value, np.add.accumulate(x.slopes, axis=1))
            return DualArray(value, value * np.add.accumulate(x.slopes / x.value, axis=1))
        rule = _RULES.get(ufunc)
        return rule(*inputs) if rule and method == "__call__" and not kwargs else NotImplemented

    def __array_function__(
        self, function: Any, types: Sequence[type], args: Any, kwargs: Any
    ) -> Any:
        """A function of `_FUNCTIONS`."""
        return _FUNCTIONS[function](*args, **kwargs) if function in _FUNCTIONS else NotImplemented


def value_of(x: Any) -> Any:
    """The value of a dual array; any other number itself."""
    return x.value if isinstance(x, DualArray) else x


def slopes_of(x: Any) -> Any:
    """The derivatives of a dual array; those of any other number are 0."""
    return x.slopes if isinstance(x, DualArray) else 0.0


def _exp(x: DualArray) -> DualArray:
    value = np.exp(x.value)
    return DualArray(value, x.slopes * value)


def _expm1(x: DualArray) -> DualArray:
    return DualArray(np.expm1(x.value), x.slopes * np.exp(x.value))


def _product(x: FloatArray, y: DualArray) -> DualArray:
    """A plain matrix times a dual one."""
    return DualArray(x @ y.value, x @ y.slopes)


def _where(test: Any, x: Any, y: Any) -> DualArray:
    """Chosen elements of two, of which one is dual."""
    return DualArray(
        np.where(test, value_of(x), value_of(y)), np.where(test, slopes_of(x), slopes_of(y))
    )


def _concatenate(parts: Sequence[Any]) -> DualArray:
    """One array of several along their first axis, plain ones among them."""
    parts = list(parts)
    count = next(len(x.slopes) for x in parts if isinstance(x, DualArray))
    slopes = [
        x.slopes if isinstance(x, DualArray) else np.zeros((count, *np.shape(x))) for x in parts
    ]
    return DualArray(np.concatenate([value_of(x) for x in parts]), np.concatenate(slopes, axis=1))


_RULES: dict[Any, Callable[..., Any]] = {
    np.add: lambda x, y: y + x if isinstance(y, DualArray) else x + y,
    np.subtract: lambda x, y: -y + x if isinstance(y, DualArray) else x - y,
    np.multiply: lambda x, y: y * x if isinstance(y, DualArray) else x * y,
    np.true_divide: lambda x, y: y.__rtruediv__(x) if not isinstance(x, DualArray) else x / y,
    np.matmul: lambda x, y: x @ y if isinstance(x, DualArray) else _product(x, y),
    np.negative: lambda x: -x,
    np.absolute: abs,
    np.exp: _exp,
    np.expm1: _expm1,
}
_FUNCTIONS: dict[Any, Callable[..., Any]] = {np.where: _where, np.concatenate: _concatenate}
