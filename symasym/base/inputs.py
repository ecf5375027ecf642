"""Reading numbers: what a caller may write, and the exact value it stands for."""

from __future__ import annotations

import math
import re
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from numbers import Rational
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from symasym.base.errors import InputError

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr

FloatArray = np.ndarray[Any, np.dtype[np.float64]]
IntArray = np.ndarray[Any, np.dtype[np.intp]]
#: A value in float64, or an array of them.
Floats = float | FloatArray
#: What a caller may write for a number, and for a number or an array of them; numbers of mpmath
#: and SymPy, which have no types, as well.
Number = int | float | str | Fraction | Decimal
Numbers = ArrayLike | Fraction | Decimal

# Python refuses to read longer decimal strings by default, and nobody means them.
_LONGEST_EXPONENT = 100_000


def is_name(value: object) -> bool:
    """True for a name that any language takes: ASCII letters, digits and _, a letter first."""
    return isinstance(value, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,59}", value) is not None


def is_array(value: object) -> bool:
    """True for what broadcasts: arrays with at least one axis, lists and tuples."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def exact(name: str, value: object) -> Fraction:
    """The exact rational that `value` stands for.

    Parameters
    ----------
    name : str
        How messages call the argument.
    value : int, float, str, Fraction, Decimal, mpf, SymPy rational or Float
        A float stands for its exact binary value, a string for what it says
        (``"-0.4"`` is -2/5, ``"1/3"`` is 1/3).

    Raises
    ------
    InputError
        If the value is not a finite real rational number.

    Examples
    --------
    >>> exact("z0", "-0.4")
    Fraction(-2, 5)
    >>> exact("kappa", 0.1) == Fraction(1, 10)
    False
    """
    if isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}, a truth value; give a number.")
    if isinstance(value, (int, Fraction)):
        return Fraction(value)
    if isinstance(value, str):
        return _from_text(name, value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, (complex,)):
        raise InputError(f"{name} is {value!r}, which is complex; give a real number.")
    if isinstance(value, Rational):  # int, and the rationals of gmpy2
        return Fraction(int(value.numerator), int(value.denominator))
    if isinstance(value, (float, Decimal)):
        if not (value.is_finite() if isinstance(value, Decimal) else math.isfinite(value)):
            raise InputError(f"{name} is {value!r}; give a finite number.")
        return Fraction(value)
    return _from_library(name, value)


def _from_text(name: str, text: str) -> Fraction:
    """The rational that a text stands for: a decimal or a quotient."""
    exponent = text.lower().rpartition("e")[2] if "e" in text.lower() else "0"
    try:
        if abs(int(exponent)) > _LONGEST_EXPONENT:
            raise InputError(
                f"{name} is {text!r}, whose exponent is beyond ±{_LONGEST_EXPONENT}; "
                "rescale the problem."
            )
        plain = text.strip().replace("\N{MINUS SIGN}", "-")
        # Decimal reads any number of digits; int and with it Fraction stop at 4300.
        return Fraction(plain) if "/" in plain or len(plain) < 4000 else Fraction(Decimal(plain))
    except InputError:
        raise
    except (ValueError, ZeroDivisionError, InvalidOperation):
        shown = text if len(text) < 60 else text[:57] + "..."
        raise InputError(
            f'{name} is {shown!r}, which is not a number; write it like "-0.4", "1/3" or "1e-8".'
        ) from None


def _from_library(name: str, value: mpf | Expr) -> Fraction:
    """Numbers of mpmath and SymPy, known by their own attributes so that neither is loaded."""
    if hasattr(value, "_mpf_"):
        sign, mantissa, exponent, _ = value._mpf_
        if not mantissa and exponent:
            raise InputError(f"{name} is {value}; give a finite number.")
        return Fraction(int(mantissa)) * Fraction(2) ** int(exponent) * (-1 if sign else 1)
    if getattr(value, "is_Rational", False):
        return Fraction(int(value.p), int(value.q))
    if getattr(value, "is_number", False):
        raise InputError(
            f"{name} is {value}, which is not a finite rational number; give a rational, "
            "or a decimal string with as many digits as the answer needs."
        )
    if hasattr(value, "_mpc_"):
        raise InputError(f"{name} is {value}, which is complex; give a real number.")
    raise InputError(
        f"{name} is {value!r} of type {type(value).__name__}; give an int, float, str, "
        "Fraction, Decimal, mpf or SymPy rational."
    )


def floats(name: str, value: Numbers, copy: bool = True) -> FloatArray:
    """`value` as a float64 array (0-dimensional for a scalar), finite and not empty.

    Without `copy` it is read only, as it may be the caller's own.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(f"{name} is a masked array; give its unmasked values alone.")
    if not is_array(value):
        return np.asarray(to_float(name, exact(name, value)))
    try:
        array = np.asarray(value)
        if array.dtype.kind in "OUS":
            flat = [to_float(name, exact(name, item)) for item in array.ravel()]
            array = np.array(flat, dtype=np.float64).reshape(array.shape)
    except InputError:
        raise
    except ValueError:
        raise InputError(f"{name} is ragged; give an array whose rows have one length.") from None
    if array.dtype.kind == "c":
        raise InputError(f"{name} is an array of complex numbers; give real numbers.")
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} is an array of {array.dtype}; give real numbers.")
    if array.size == 0:
        raise InputError(f"{name} is an empty array; give at least one value.")
    with np.errstate(over="ignore"):
        array = array.astype(np.float64, copy=copy)
    if not np.isfinite(array).all():
        bad = array[~np.isfinite(array)][0]
        raise InputError(f"{name} has an entry {bad}; give finite numbers.")
    if not copy:
        array = array.view()
        array.flags.writeable = False
    return array


class BeyondFloat(InputError, OverflowError):
    """A number that float64 cannot hold, though more digits could."""


def to_float(name: str, value: Fraction | int) -> float:
    """The nearest float64; an error beyond its range."""
    try:
        result = float(value)
    except OverflowError:
        raise BeyondFloat(f"{name} is beyond the range of float64; pass dps=… for it.") from None
    if result == 0.0 and value != 0:
        raise BeyondFloat(f"{name} is below the range of float64; pass dps=… for it.")
    return result


def digits(dps: int) -> int:
    """A number of decimal digits, 1 to 10,000."""
    if isinstance(dps, bool) or not isinstance(dps, (int, np.integer)):
        raise InputError(f"dps is {dps!r}; give a whole number of digits from 1 to 10000.")
    if not 1 <= dps <= 10_000:
        raise InputError(f"dps is {dps}; give a whole number of digits from 1 to 10000.")
    return int(dps)


def whole(name: str, text: str) -> int:
    """The whole number that a text says."""
    try:
        return int(text)
    except ValueError:
        raise InputError(f"{name} is {text!r}; give a whole number.") from None


def positive(name: str, value: Fraction) -> Fraction:
    """`value` if it is greater than zero."""
    if value <= 0:
        raise InputError(f"{name} is {float_text(value)}; it must be greater than 0.")
    return value


def float_text(value: Fraction) -> str:
    """A short text of an exact number, for messages."""
    if value.denominator == 1 and abs(value.numerator) < 10**15:
        return str(value.numerator)
    try:
        near = float(value)
    except OverflowError:
        return f"{'-' if value < 0 else ''}1e{_power(abs(value))}"
    if near or not value:
        return f"{near:.6g}"
    return f"{'-' if value < 0 else ''}1e-{_power(1 / abs(value))}"


def _power(value: Fraction) -> int:
    """The power of ten of a number beyond the range of float64."""
    whole = value.numerator // value.denominator
    shift = max(0, whole.bit_length() - 64)
    return math.floor(shift * math.log10(2) + math.log10(whole >> shift) + 1e-9)
