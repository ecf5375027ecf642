"""A value with its error as part of it."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from symasym.base.errors import InputError, RangeError
from symasym.base.texts import with_error

if TYPE_CHECKING:
    import numpy as np
    from mpmath import mpf


ErrorKind = Literal["bound", "estimate", "none"]
#: A float, an array of them where an argument is one, with `dps` an mpf, or an array of them.
Value: TypeAlias = "float | np.ndarray[Any, Any] | mpf"
#: What a verb returns: with ``full=True`` an `Estimate`, else a `Value`.
Answer: TypeAlias = "Value | Estimate"
IN_WORDS = {"bound": "proved bound", "estimate": "estimate"}


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
    comparisons and formats such as ``f"{estimate:.6g}"``, with all the digits it has.
    ``value, error = estimate`` unpacks it.

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
    mask : ndarray of bool or None
        With ``errors="nan"``: True where there is no value.
    notes : tuple of str
        What else a reader should know; the text ends with them.

    Notes
    -----
    As text the value goes on to the third digit of its error, and the error is rounded upwards,
    the rounding of the value included.

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
    terms: tuple[str, ...] = field(default=())
    dropped: tuple[str, ...] = field(default=())
    mask: Any = None
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        kind = IN_WORDS.get(self.error_kind, "no error claimed")
        if self.error_kind == "none":
            shown = _without_error(self.value)
        else:
            shown = with_errors(self.value, self.error)
        return "; ".join([f"{shown} ({kind}, {self.method})", *self.notes])

    def __repr__(self) -> str:
        return f"Estimate({self})"

    def _repr_latex_(self) -> str | None:
        """Value and error for a notebook; None for arrays, which it shows as text."""
        if hasattr(self.value, "shape"):
            return None
        if self.error_kind == "none":
            return f"${_in_tex(_without_error(self.value))}$"
        value, error = map(_in_tex, with_error(self.value, self.error))
        return rf"${value} \pm {error}$"

    def __iter__(self) -> Iterator[Any]:
        return iter((self.value, self.error))

    def __float__(self) -> float:
        number = float(self.value)
        if abs(number) == float("inf") or (number == 0 and self.value != 0):
            raise RangeError(
                f"the value {_without_error(self.value)} is outside the range of float64; use its "
                "attribute value, an mpf."
            )
        return number

    def _mpmath_(self, prec: int, rounding: str) -> mpf:
        """The value as mpmath's number, for ``mpmath.mpf(estimate)``."""
        import mpmath

        return mpmath.mp.convert(self.value)

    def __format__(self, spec: str) -> str:
        if not spec:
            return str(self)
        if hasattr(self.value, "shape"):
            raise InputError(f"the value is an array; format its elements with {spec!r}.")
        if hasattr(self.value, "_mpf_"):
            return _formatted(self.value, spec)
        return format(self.value if isinstance(self.value, complex) else float(self), spec)

    __eq__ = _compared("eq")
    __ne__ = _compared("ne")
    __lt__ = _compared("lt")
    __le__ = _compared("le")
    __gt__ = _compared("gt")
    __ge__ = _compared("ge")

    def __hash__(self) -> int:
        return hash(self.value)


def _formatted(value: mpf, spec: str) -> str:
    """An mpf as Python formats a float, with all of its digits."""
    from mpmath import libmp

    head, point, tail = re.fullmatch(r"(.*?)(\.\d+)?([eEfFgGn%]?)", spec, re.DOTALL).groups()  # type: ignore[union-attr]
    if point or tail:
        point, tail = point or ".6", tail or "g"
    # More than the digits that it has.
    digits = int(0.302 * value._mpf_[3]) + 25 + int((point or ".0")[1:])
    try:
        return format(Decimal(libmp.to_str(value._mpf_, digits)), f"{head}{point or ''}{tail}")
    except InvalidOperation:
        raise RangeError(
            f"the value {_without_error(value)} is outside the range that Python formats; print it "
            "as it is."
        ) from None


def _without_error(value: Any) -> str:
    """A value of which no error is known, to 15 digits; an array as NumPy shows it."""
    from mpmath import libmp

    if hasattr(value, "shape"):
        return str(value)
    exactly = value._mpf_ if hasattr(value, "_mpf_") else libmp.from_float(float(value))
    return str(libmp.to_str(exactly, 15))


def with_errors(value: Any, error: Any) -> str:
    """``value ± error``; of an array each element, as NumPy lays them out."""
    import numpy as np

    if not hasattr(value, "shape"):
        return _element(value, error)
    pairs = np.arange(value.size).reshape(value.shape)
    shown: Any = np.array2string(
        pairs,
        separator=", ",
        formatter={"int": lambda i: _element(value.flat[i], error.flat[i])},
    )
    return str(shown)


def _element(value: Any, error: Any) -> str:
    return " ± ".join(with_error(value, error)) if value == value else "nan"


def _in_tex(text: str) -> str:
    """A number as LaTeX."""
    mantissa, _, power = text.partition("e")
    return rf"{mantissa} \times 10^{{{int(power)}}}" if power else text
