"""Conversion of arguments to exact values, with checks.

All public arguments other than expressions (`symasym.drift.texts`) are read here. Numbers other
than 0 whose absolute value is not between 1e-300 and 1e300 are refused.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symasym.base.errors import InputError

FloatArray = np.ndarray[Any, np.dtype[np.float64]]
IntArray = np.ndarray[Any, np.dtype[np.intp]]
#: The types accepted for a number, and for a number or an array; numbers of mpmath and SymPy,
#: which provide no type hints, are accepted as well.
Number = int | float | str | Fraction | Decimal
Numbers = ArrayLike | Fraction | Decimal

#: The limits for the absolute values of numbers other than 0; the float 1e300 is within them.
MOST = Fraction(10**300) + 10**285
LEAST = 1 / MOST
_LONGEST = 20_000  # the largest number of digits, as longer numbers might exhaust the memory
_SHOWN = 80


def shown(value: object) -> str:
    """The text of any value for messages: on one line, and shortened if it is long."""
    try:
        text = re.sub(r"\s+", " ", repr(value))
    except Exception:  # repr may raise any exception, and does for a very long integer
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def flag(name: str, value: object) -> bool:
    """A value that must be True or False, as a bool."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise InputError(f"{name} is {shown(value)}; give True or False.")


def choice(name: str, value: Any, known: Iterable[str | None]) -> Any:
    """A value that must be one of the `known` words, of which one may be None."""
    words = list(known)
    if (value is None or isinstance(value, str)) and value in words:
        return value
    raise InputError(f"{name} is {shown(value)}; give one of {', '.join(map(repr, words))}.")


def count(name: str, value: object, low: int, high: int, of: str = "", also: str = "") -> int:
    """An integer from `low` to `high`; messages name its unit `of` and the alternatives `also`."""
    try:
        if isinstance(value, (bool, np.bool_, np.ndarray)):
            raise TypeError
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = low - 1
    if not low <= number <= high:
        wanted = f"a whole number{of} from {low} to {high}{also}"
        raise InputError(f"{name} is {shown(value)}; give {wanted}.")
    return number


def digits(dps: object, most: int = 10_000) -> Any:
    """A number of decimal digits, 1 to `most`, or None."""
    return None if dps is None else count("dps", dps, 1, most, " of digits")


def is_name(value: object) -> bool:
    """True for a name of ASCII letters, digits and _ that begins with a letter."""
    return isinstance(value, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,59}", value) is not None


def is_array(value: object) -> bool:
    """True for arrays with at least one axis, lists and tuples, which are broadcast."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def common_shape(shapes: Mapping[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The shape to which arrays of these shapes broadcast; the keys are names for messages."""
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        given = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise InputError(
            f"the shapes do not broadcast ({given}); give arrays of shapes that NumPy broadcasts."
        ) from None


def sequence(name: str, value: object) -> list[Any]:
    """The items of a value that must be a list, tuple, array or other collection."""
    try:
        if isinstance(value, (str, bytes, dict)):
            raise TypeError
        found: list[Any] = list(value)  # type: ignore[call-overload]
    except (TypeError, ValueError):
        raise InputError(f"{name} is {shown(value)}; give a sequence.") from None
    return found


def mapping(name: str, value: Any, known: Iterable[str] = ()) -> dict[str, Any]:
    """A mapping from names or symbols to numbers, by names, which must be `known` if these are."""
    found = {str(k): x for k, x in value.items()} if isinstance(value, Mapping) else None
    if found is None or not found.keys() <= {*(known or found)}:
        wanted = ", ".join(known) or "names"
        raise InputError(f"{name} is {shown(value)}; give a mapping from {wanted} to numbers.")
    return found


def exact(name: str, value: object) -> Fraction:
    """The exact rational value of a number or text; that of a float is its binary value.

    Messages call it `name`.

    Examples
    --------
    >>> exact("z0", "-0.4"), exact("kappa", 0.1) == Fraction(1, 10)
    (Fraction(-2, 5), False)
    """
    try:
        number = _rational(value)
        if number and not LEAST <= abs(number) <= MOST:
            raise ValueError
    except (ValueError, TypeError, ArithmeticError):
        raise InputError(
            f"{name} is {shown(value)}; give a real rational number within 1e±300, of at most "
            f'{_LONGEST:,} digits, such as 3, 0.5, "-0.4", "1/3" or "1e-8".'
        ) from None
    return number


def _rational(value: Any) -> Fraction:
    """The rational value; raises if the value is not rational or far outside the domain."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.item() if value.ndim == 0 else None
    if isinstance(value, (bool, complex)) or hasattr(value, "_mpc_"):
        raise TypeError
    if isinstance(value, (str, Decimal)):
        text = str(value).strip().replace("\N{MINUS SIGN}", "-")
        power = text.lower().partition("e")[2] or "0"
        if len(text) > _LONGEST or abs(int(power[:10])) > _LONGEST:
            raise OverflowError
        # Decimal reads any number of digits, whereas int and Fraction are limited to 4300.
        return Fraction(text) if "/" in text else Fraction(Decimal(text))
    if hasattr(value, "_mpf_"):
        sign, mantissa, power, _ = value._mpf_
        if (not mantissa and power) or abs(power) > 4 * _LONGEST:
            raise OverflowError
        return Fraction(int(mantissa)) * Fraction(2) ** int(power) * (-1 if sign else 1)
    if getattr(value, "is_Rational", False):
        value = Fraction(int(value.p), int(value.q))
    number = Fraction(value)
    if max(abs(number.numerator), number.denominator).bit_length() > 4 * _LONGEST:
        raise OverflowError
    return number


def floats(name: str, value: Numbers) -> FloatArray:
    """A number or array as a finite, nonempty float64 array (0-dimensional for a number)."""
    if not is_array(value):
        return np.asarray(float(exact(name, value)))
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.empty(0)
    if array.dtype.kind in "OUS":
        array = np.array([float(exact(name, x)) for x in array.flat]).reshape(array.shape)
    masked = isinstance(value, np.ma.MaskedArray)
    if masked or array.dtype.kind not in "iuf" or not array.size or not np.isfinite(array).all():
        raise InputError(f"{name} is {shown(value)}; give an array of finite real numbers.")
    array = array.astype(np.float64)
    sizes = np.abs(array)
    if (beyond := (sizes > 1e300) | ((sizes < 1e-300) & (sizes > 0))).any():
        exact(name, array[beyond].flat[0].item())
    return array


def positive(name: str, value: object, zero: bool = False) -> Fraction:
    """An exact number that is greater than 0, or also 0 if `zero`."""
    number = exact(name, value)
    if number < 0 or not (number or zero):
        rule = "at least" if zero else "greater than"
        raise InputError(f"{name} is {float_text(number)}; it must be {rule} 0.")
    return number


def within(name: str, value: object, low: float, high: float) -> Fraction:
    """An exact number from `low` to `high`."""
    number = exact(name, value)
    if not low <= float(number) <= high:
        raise InputError(f"{name} is {float_text(number)}; give one from {low:g} to {high:g}.")
    return number


def float_text(value: Any) -> str:
    """A short text of a number for messages."""
    return f"{float(value):.6g}"
