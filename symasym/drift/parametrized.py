"""A formula with values of its parameters."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import common_shape, is_array
from symasym.drift.models import Model


class Parametrized:
    """A model and the values of its parameters, as far as they are known."""

    _model: Model
    _values: dict[str, Any]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, bound or free."""
        return self._model.parameters

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that have no value yet."""
        return tuple(name for name in self.parameters if name not in self._values)

    @property
    def values(self) -> dict[str, Any]:
        """The bound parameters, each a Fraction or a float64 array."""
        return dict(self._values)

    @property
    def model(self) -> Model:
        """The formula of A, which drifts of other parameters share."""
        return self._model

    @property
    def name(self) -> str:
        """Name of the model, e.g. ``"friction"``."""
        return self._model.name

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Common shape of the parameters, () unless some are arrays."""
        return common_shape({k: np.shape(v) for k, v in self._values.items() if is_array(v)})

    def scalars(self) -> dict[str, Fraction]:
        """The exact parameter values; an error if some are free or arrays."""
        self.require_bound()
        for name, value in self._values.items():
            if is_array(value):
                raise InputError(
                    f"{name} is an array, where one value is taken; pass one at a time, or leave "
                    "dps and full out where they are given."
                )
        return self._values

    def require_bound(self) -> None:
        """Raise unless every parameter has a value."""
        if self.free:
            raise InputError(
                f"the drift's parameters {', '.join(self.free)} have no value; set them with "
                f"bind({self.free[0]}=…)."
            )

    def exact_coefficients(self) -> list[Fraction] | None:
        """Rational coefficients of A in ascending powers; None if A is no such polynomial."""
        return None if self._coefficients is None else [*self._coefficients]

    @cached_property
    def _coefficients(self) -> list[Fraction] | None:
        known = self._model.coefficients(self.scalars())
        while known and len(known) > 1 and known[-1] == 0:
            known.pop()
        return known

    def end(self, side: int) -> Fraction | None:
        """A(side), side = -1 or 1, where it is rational and known without rounding, else None."""
        coefficients = self.exact_coefficients()
        if coefficients is not None:
            return sum((c * side**k for k, c in enumerate(coefficients)), Fraction(0))
        known: Fraction | None = self._model.end(self._values, side)
        return known

    def _key(self) -> tuple[Any, ...]:
        """The value by which this drift is compared and hashed."""
        return self._model, tuple(
            (name, (value.shape, value.tobytes()) if is_array(value) else value)
            for name, value in sorted(self._values.items())
        )

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Parametrized) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        """The call that makes this drift, ``sa`` being symasym; long arrays are shortened."""
        return self._model.source(
            {x: y for x in self.parameters if (y := self._values.get(x)) is not None}
        )
