"""What is asked of a method, and its answer as all methods hand it back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.contexts import float_with_error, to_mpf
from symasym.base.errors import InputError, RangeError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import FloatArray, count

if TYPE_CHECKING:
    from mpmath import mpf


_LARGEST, _SMALLEST = 709.78, -708.39

#: Digits behind a float64 value whose error is part of it.
FLOAT_DIGITS = 20


class Request(NamedTuple):
    """What is asked for, apart from the scene itself; `name` is that of the quantity.

    `errors` is ``"raise"``, or ``"nan"`` where elements of arrays that are refused become nan.
    """

    name: str
    method: str
    order: Any
    dps: int | None
    log: bool
    full: bool
    errors: str = "raise"

    @property
    def digits(self) -> int:
        """Digits to compute with: behind a float64 value a few more, for the error beside it."""
        return FLOAT_DIGITS if self.dps is None else self.dps

    @property
    def complement(self) -> bool:
        """True for 1 - C and 1 - P."""
        return self.name.startswith("1 - ")


class Answer(NamedTuple):
    """The answer of a method for one scene: the value, or its logarithm where that was asked.

    `order` is that of the expansion where it is not the request's own.
    """

    value: Any
    error: Any
    kind: ErrorKind
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    order: int | None = None


class Answers(NamedTuple):
    """The answer of a method for many scenes: logarithms and their absolute errors."""

    logs: FloatArray
    errors: FloatArray | None
    kind: ErrorKind
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()


def read_order(order: int | str | None, default: int, most: int) -> int:
    """The order of an expansion, a whole number from 0 to `most`."""
    if order is None:
        return default
    if isinstance(order, str) and order == "optimal":
        raise InputError(
            "order is 'optimal', but this series converges for every kappa, so that more terms "
            f"are always better; give a whole number from 0 to {most}."
        )
    return count("order", order, 0, most)


def as_floats(request: Request, shape: tuple[int, ...], answers: Answers) -> Any:
    """Logarithms and their errors as what was asked for."""
    logs = answers.logs.reshape(shape)
    value: Any = logs
    error: Any = None
    if request.full and answers.errors is not None:
        # A logarithm close to 0 may have underflowed.
        error = answers.errors.reshape(shape) + 1e-300
    if request.errors == "raise":
        require_fits(request.name, logs, request.log)
    else:
        logs = value = np.where(_fitting(logs, request.log), logs, np.nan)
    if not request.log:
        value = np.exp(logs)
        if error is not None:
            # exp rounds once more, and so does the product.
            error = value * (np.expm1(error) * (1 + 1e-15) + 4e-16)
    if value.ndim == 0:
        value, error = float(value), None if error is None else float(error)
    if not request.full:
        return value
    order = None if isinstance(request.order, range) else request.order
    mask = np.isnan(value) if request.errors == "nan" else None
    return Estimate(
        value, error, answers.kind, request.method, order, answers.terms, answers.dropped, mask
    )


def as_digits(request: Request, answer: Answer) -> Any:
    """An mpf of enough digits, with its error, as what was asked for."""
    import mpmath
    from mpmath import libmp

    dps, value, error = request.dps, answer.value, answer.error
    if dps is not None:
        rounded = to_mpf(value, dps)
    else:
        if not request.log:
            _fits(request.name, value)
        rounded = float(value)
    if not request.full:
        return rounded
    total = None
    if error is not None and dps is None:
        rounded, total = float_with_error(value, error)
    elif error is not None:
        # Differences without a precision are exact in libmp; only the sum of the errors rounds.
        shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, rounded._mpf_))
        total = mpmath.mp.make_mpf(libmp.mpf_add(error._mpf_, shift, 53, "u"))
    order = request.order if answer.order is None else answer.order
    return Estimate(
        rounded, total, answer.kind, request.method, order, answer.terms, answer.dropped
    )


def _fits(name: str, value: mpf) -> None:
    """Raise unless `value`, an mpf, is a float."""
    from mpmath import libmp

    if not value:
        return
    size = libmp.to_float(libmp.mpf_log(libmp.mpf_abs(value._mpf_), 53))
    require_fits(name, np.asarray(size), False)


def _fitting(logs: FloatArray, log: bool) -> Any:
    """True where e^logs is a float, or logs with `log`."""
    return np.isfinite(logs) if log else (logs >= _SMALLEST) & (logs <= _LARGEST)


def require_fits(name: str, logs: FloatArray, log: bool) -> None:
    """Raise unless the values e^logs, or their logarithms with `log`, are floats."""
    if log:
        if not _fitting(logs, log).all():
            raise RangeError(
                f"log {name} is outside the range of float64 itself; pass log=True with dps=…."
            )
        return
    extreme = float(logs.max() if logs.max() > _LARGEST else logs.min())
    if not _SMALLEST <= extreme <= _LARGEST:
        raise RangeError(
            f"{name} is e^{extreme:.6g}, outside the range of float64; pass log=True, or dps=…."
        )
