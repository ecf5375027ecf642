"""`Estimate`, a value with its error, and the conversion of numbers and errors to texts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

ErrorKind = Literal["bound", "estimate", "none"]
IN_WORDS = {"bound": "proved bound", "estimate": "estimate", "none": "no error claimed"}


@dataclass(frozen=True, repr=False, eq=False)
class Estimate:
    """The result of a function with ``full=True``.

    It unpacks as ``value, error = estimate``; ``float(estimate)`` is the value, of which a format
    such as ``f"{estimate:.3g}"`` is taken, too.

    Attributes
    ----------
    value : float, mpf or ndarray
    error : float, mpf, ndarray or None
        Absolute error of `value`; None if `error_kind` is ``"none"``.
    error_kind : {"bound", "estimate", "none"}
        ``"bound"``: the error is proved. ``"estimate"``: it is expected to hold, but not proved.
        ``"none"``: no error is claimed.
    method : str
    order : int or None
        Order of the expansion, if the method is one.
    notes : tuple of str
        Remarks, which are also printed at the end of the text.

    Notes
    -----
    In a text the value is printed to the third digit of its error; the printed error includes the
    rounding of the printed value and is rounded upwards.

    Examples
    --------
    >>> import symasym as sa
    >>> drift = sa.friction(mu=3, alpha=1, z0=-2)
    >>> estimate = sa.escape_time(drift, "0.3", 10, method="laplace", order=4, full=True)
    >>> print(estimate)
    5.110421915 ± 2.75e-7 (proved bound, laplace)
    >>> value, error = estimate
    >>> value
    5.110421915253166
    """

    value: Any
    error: Any
    error_kind: ErrorKind
    method: str
    order: int | None = None
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        shown = with_error(self.value, self.error)
        return "; ".join([f"{shown} ({IN_WORDS[self.error_kind]}, {self.method})", *self.notes])

    def __repr__(self) -> str:
        return f"Estimate({self})"

    def __iter__(self) -> Iterator[Any]:
        return iter((self.value, self.error))

    def __float__(self) -> float:
        return float(self.value)

    def __format__(self, spec: str) -> str:
        return format(self.value, spec) if spec else str(self)


def with_error(value: Any, error: Any) -> str:
    """The text ``value ± error`` with rounding included in the error; arrays in NumPy's layout.

    Examples
    --------
    >>> with_error(2 / 3, 1e-6), with_error(0.1, None)
    ('0.66666667 ± 1.01e-6', '0.1')
    """
    import numpy as np

    if not np.ndim(value):
        return _element(value, error)
    errors = np.broadcast_to(np.asarray(error), value.shape)
    # NumPy abbreviates long arrays, so that only the elements shown are converted.
    show: Any = {"int": lambda k: _element(value.flat[k], errors.flat[k])}
    places = np.arange(value.size).reshape(value.shape)
    return np.array2string(places, separator=", ", formatter=show)


def _element(value: Any, error: Any) -> str:
    """The text of one value, printed to the third digit of its error, and of the error."""
    if isinstance(value, complex) or hasattr(value, "_mpc_"):
        return "({}) + ({})i".format(*(_element(x, error) for x in (value.real, value.imag)))
    if not error or value != value:
        from mpmath import libmp

        mpf = getattr(value, "_mpf_", None)
        shown = libmp.to_str(mpf, libmp.prec_to_dps(max(mpf[3], 53))) if mpf else f"{value:.15g}"
        return str(shown) if error is None or value != value else f"{shown} ± 0"
    from flint import arb

    from symasym.base.balls import precision

    with precision(120):
        ratio = float((abs(arb(value)) / arb(error)).log()) / math.log(10)
    most = 10_000 if hasattr(value, "_mpf_") else 50
    digits = min(max(3 + int(ratio), 1), most) if math.isfinite(ratio) else 1
    return " ± ".join(interval_text(value, error, digits, more=True))


def number_text(x: Fraction) -> str:
    """An exact number as a decimal of fewer than 20 places if possible, else as a quotient.

    Examples
    --------
    >>> number_text(Fraction(-1, 8)), number_text(Fraction(1, 3)), number_text(Fraction(7))
    ('-0.125', '1/3', '7')
    """
    for decimals in range(20):
        if (scaled := x * 10**decimals).denominator == 1:
            return f"{Decimal(f'{scaled.numerator}e-{decimals}'):f}"
    return f"{x.numerator}/{x.denominator}"


def interval_text(value: Any, error: Any, digits: int, more: bool = False) -> tuple[str, str]:
    """Texts of midpoint and radius that enclose ``value ± error``; Arb rounds the radius upwards.

    The midpoint has at most `digits` digits. Unless `more` is set, digits that are uncertain
    because of the error are omitted: the last one printed is wrong by at most one unit.

    Examples
    --------
    >>> interval_text(2 / 3, 1e-6, 8, more=True), interval_text(2 / 3, 1e-6, 8)
    (('0.66666667', '1.01e-6'), ('0.66667', '4.34e-6'))
    """
    from flint import arb

    from symasym.base.balls import precision

    bits = value._mpf_[3] if hasattr(value, "_mpf_") else 53
    with precision(4 * digits + 200 + bits):
        text = arb(value, error).str(digits, more=more)
    middle, _, radius = text.strip("[]").partition("+/- ")
    return middle.strip() or "0", radius or "0"
