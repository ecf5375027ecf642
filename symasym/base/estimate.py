"""Numbers as texts: exact ones, values to the digits that their errors leave, and `Estimate`."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from mpmath import mpf

ErrorKind = Literal["bound", "estimate", "none"]
IN_WORDS = {"bound": "proved bound", "estimate": "estimate", "none": "no error claimed"}


def _compared(name: str) -> Callable[[Any, Any], Any]:
    """The comparison of that name, of values."""
    compare = getattr(operator, name)

    def method(self: Estimate, other: object) -> Any:
        return compare(self.value, other.value if isinstance(other, Estimate) else other)

    return method


@dataclass(frozen=True, repr=False, eq=False)
class Estimate:
    """The result of a function with ``full=True``.

    It stands for its value where a number is expected: in ``float()``, ``mpmath.mpf()``,
    comparisons and formats such as ``f"{estimate:.6g}"``. ``value, error = estimate`` unpacks it.

    Attributes
    ----------
    value : float, mpf or ndarray
    error : float, mpf, ndarray or None
        Absolute error of `value`; None for kind ``"none"``.
    error_kind : {"bound", "estimate", "none"}
        ``"bound"``: proved. ``"estimate"``: expected to hold, not proved.
        ``"none"``: nothing is claimed.
    method : str
    order : int or None
        Order of the expansion, where there is one.
    terms : tuple of str
        What was added up.
    dropped : tuple of str
        What was left out, and why that is allowed.
    notes : tuple of str
        What else a reader should know; the text ends with them.

    Notes
    -----
    As text the value goes on to the third digit of its error, and the error is rounded upwards,
    what is cut off the value included.

    Examples
    --------
    >>> import symasym as sa
    >>> drift = sa.friction(mu=3, alpha=1, z0=-2)
    >>> estimate = sa.escape_time(drift, "0.3", 10, method="laplace", order=4, full=True)
    >>> print(estimate)
    5.110421915 ± 2.75e-7 (proved bound, laplace)
    >>> value, error = estimate
    >>> estimate < 6, f"{estimate:.4f}"
    (True, '5.1104')
    """

    value: Any
    error: Any
    error_kind: ErrorKind
    method: str
    order: int | None = None
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
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

    def _mpmath_(self, prec: int, rounding: str) -> mpf:
        """The value as mpmath's number, for ``mpmath.mpf(estimate)``."""
        import mpmath

        return mpmath.mp.convert(self.value)

    def __format__(self, spec: str) -> str:
        if not spec or not hasattr(self.value, "_mpf_"):
            return format(self.value, spec) if spec else str(self)
        from mpmath import libmp

        return format(Decimal(libmp.to_str(self.value._mpf_, 10_000)), spec)

    __eq__ = _compared("eq")
    __ne__ = _compared("ne")
    __lt__ = _compared("lt")
    __le__ = _compared("le")
    __gt__ = _compared("gt")
    __ge__ = _compared("ge")

    def __hash__(self) -> int:
        return hash(self.value)


def with_error(value: Any, error: Any) -> str:
    """``value ± error``, true as it stands; of an array each element, as NumPy lays them out.

    Examples
    --------
    >>> with_error(2 / 3, 1e-6), with_error(0.1, None)
    ('0.66666667 ± 1.01e-6', '0.1')
    """
    import numpy as np

    if not hasattr(value, "shape"):
        return _element(value, error)
    pairs = np.arange(value.size).reshape(value.shape)
    errors = None if error is None else error.ravel()
    each: Any = {"int": lambda i: _element(value.flat[i], None if errors is None else errors[i])}
    text: Any = np.array2string(pairs, separator=", ", formatter=each)
    return str(text)


def _element(value: Any, error: Any) -> str:
    """A value to the third digit of its error."""
    if isinstance(value, complex) or hasattr(value, "_mpc_"):
        re, im = (_element(part, error) for part in (value.real, value.imag))
        return f"({re}) + ({im})i"
    plain = not hasattr(value, "_mpf_")
    if not error or value != value:
        shown = f"{float(value):.15g}" if plain else _digits(value)
        return shown if error is None or value != value else f"{shown} ± 0"
    middle, radius = (x if hasattr(x, "_mpf_") else float(x) for x in (value, error))
    from flint import arb

    from symasym.base.balls import precision

    with precision(120):
        ratio = float((abs(arb(middle)) / arb(radius)).log()) / math.log(10)
    digits = min(max(3 + int(ratio), 1), 50 if plain else 10_000) if math.isfinite(ratio) else 1
    return " ± ".join(interval_text(middle, radius, digits, more=True))


def _digits(value: Any) -> str:
    """An mpf with the digits that it has."""
    from mpmath import libmp

    return str(libmp.to_str(value._mpf_, libmp.prec_to_dps(max(value._mpf_[3], 53))))


def number_text(x: Fraction) -> str:
    """An exact number as a decimal where it is a short one, else as a quotient.

    Examples
    --------
    >>> number_text(Fraction(-1, 8)), number_text(Fraction(1, 3)), number_text(Fraction(7))
    ('-0.125', '1/3', '7')
    """
    for decimals in range(20):
        if (scaled := x * 10**decimals).denominator == 1:
            return f"{Decimal(f'{scaled.numerator}e-{decimals}'):f}"
    return f"{x.numerator}/{x.denominator}"


def number_repr(x: Fraction) -> str:
    """Python source of an exact number: an int, a float where it is one, else a text.

    Examples
    --------
    >>> number_repr(Fraction(3)), number_repr(Fraction(1, 2)), number_repr(Fraction(-2, 5))
    ('3', '0.5', "'-0.4'")
    """
    if x.denominator == 1 and abs(x.numerator) < 10**16:
        return str(x.numerator)
    return repr(float(x)) if Fraction(float(x)) == x else repr(number_text(x))


def interval_text(value: Any, error: Any, digits: int, more: bool = False) -> tuple[str, str]:
    """Middle and radius of ``value ± error``, true as they stand: Arb rounds the radius upwards.

    The middle has at most `digits` digits, and unless `more` are wanted only those that the error
    leaves: the last one is off by at most one.

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
