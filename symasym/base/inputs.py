"""Reading arguments: what a caller may write, and the exact value it stands for.

Every public argument that is no expression (`symasym.drift.grammar`) is read here: numbers
(`exact`, `floats`), whole numbers (`count`, `digits`), flags (`flag`), words (`choice`) and names
(`is_name`). What a message quotes goes through `shown`, since printing a value may fail as well.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from symasym.base.errors import InputError

if TYPE_CHECKING:
    pass

FloatArray = np.ndarray[Any, np.dtype[np.float64]]
IntArray = np.ndarray[Any, np.dtype[np.intp]]
#: A value in float64, or an array of them.
Floats = float | FloatArray
#: What a caller may write for a number, and for a number or an array of them; numbers of mpmath
#: and SymPy, which have no types, as well.
Number = int | float | str | Fraction | Decimal
Numbers = ArrayLike | Fraction | Decimal

_Word = TypeVar("_Word", bound=str)
#: The declared domain: every number but 0 is between these in size, 1e300 as a float among them.
MOST = Fraction(10**300) + 10**285
LEAST = 1 / MOST
# Digits of a number: reading longer ones would fill the memory.
_LONGEST_TEXT = 20_000
_SHOWN = 80
# Digits of a number that a formula may hold.
_PRINTED_DIGITS = 1000
_PRINTED = 10**_PRINTED_DIGITS


def shown(value: object) -> str:
    """A value as messages quote it: on one line, cut where it is long, whatever it is."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_SHOWN:
        return float_text(Fraction(value))
    try:
        text = repr(value)
    except Exception:  # a stranger's object may fail in any way
        text = f"an object of type {type(value).__name__}"
    text = re.sub(r"\s+", " ", text)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def flag(name: str, value: object) -> bool:
    """True or False; InputError for anything else.

    Examples
    --------
    >>> flag("log", True)
    True
    """
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise InputError(f"{name} is {shown(value)}; give True or False.")


def meant(given: object, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown name: which known one is close to it, if any.

    Close are few slips of the hand, up to 3 in long names, and what begins or ends one name alone.
    A label's ``eq:`` and an option's dashes may be missing.

    Examples
    --------
    >>> meant("frictoin", ["friction", "linear"]), meant("x", ["friction"])
    ("; perhaps you mean 'friction'", '')
    """

    def plain(name: str) -> str:
        return name.lower().replace("_", "-").rpartition(":")[2].lstrip("-")

    if not isinstance(given, str):
        return ""
    names = {plain(name): name for name in known}
    word = plain(given[:100])
    slips = {name: _slips(word, name) for name in names}
    near = [name for name in names if slips[name] <= _SLIPS[min(max(len(word), len(name)), 9)]]
    # Of names as near, letters that changed places are likelier than others.
    near.sort(key=lambda name: (slips[name], sorted(name) != sorted(word)))
    parts = [name for name in names if name.startswith(word) or name.endswith(word)]
    if not near and len(parts) == 1 and (len(word) > 2 or len(parts[0]) == len(word) + 1):
        near = parts
    return f"; perhaps you mean {names[near[0]]!r}" if near else ""


#: How many slips are a near miss, by the length of the longer name; the last is for longer ones.
_SLIPS = (0, 0, 0, 1, 1, 2, 2, 2, 2, 3)


def _slips(given: str, known: str) -> int:
    """Letters left out, put in, changed, or changed in place with the next, from one to the other.

    Examples
    --------
    >>> _slips("tahn", "tanh"), _slips("tahn", "tan"), _slips("digits", "drift")
    (1, 1, 4)
    """
    rows = [list(range(len(known) + 1))]
    for i, a in enumerate(given, 1):
        row = [i]
        for j, b in enumerate(known, 1):
            least = min(rows[-1][j] + 1, row[-1] + 1, rows[-1][j - 1] + (a != b))
            if i > 1 and j > 1 and (a, b) == (known[j - 2], given[i - 2]):
                least = min(least, rows[-2][j - 2] + 1)
            row.append(least)
        rows.append(row)
    return rows[-1][-1]


def choice(name: str, value: _Word, known: Iterable[str]) -> _Word:
    """The one of the `known` words that `value` is; spaces about a minus sign don't count.

    Examples
    --------
    >>> choice("quantity", "1-C", ("C", "1 - C"))
    '1 - C'
    """
    words = list(known)
    if isinstance(value, str):
        if value in words:
            return value
        for word in words:
            if re.sub(" *- *", "-", value) == word.replace(" - ", "-"):
                return cast(_Word, word)
    raise InputError(
        f"{name} is {shown(value)}; give one of {', '.join(map(repr, words))}{meant(value, words)}."
    )


def count(name: str, value: object, low: int, high: int, of: str = "", also: str = "") -> int:
    """A whole number from `low` to `high`; `of` what, and what else would do, messages say.

    Examples
    --------
    >>> count("order", 3, 0, 20)
    3
    """
    try:
        if isinstance(value, (bool, np.bool_, np.ndarray)):
            raise TypeError
        number = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        number = low - 1
    if not low <= number <= high:
        raise InputError(
            f"{name} is {shown(value)}; give a whole number{of} from {low} to {high}{also}."
        )
    return number


def is_name(value: object) -> bool:
    """True for a name that any language takes: ASCII letters, digits and _, a letter first."""
    return isinstance(value, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,59}", value) is not None


def is_array(value: object) -> bool:
    """True for what broadcasts: arrays with at least one axis, lists and tuples."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def sequence(name: str, value: object) -> list[Any]:
    """The items of a list, tuple, array or other collection; InputError for anything else."""
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise InputError(f"{name} is {shown(value)}; give a sequence.")
    try:
        return list(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {shown(value)}; give a sequence.") from None


def axes(name: str, value: Any, many: int = 1) -> list[Any]:
    """Matplotlib's axes, one or so many; InputError for anything else."""
    from matplotlib.axes import Axes

    given = [value] if isinstance(value, Axes) else value
    if not isinstance(given, (list, tuple, np.ndarray)):
        given = ()
    if len(given) != many or not all(isinstance(ax, Axes) for ax in given):
        wanted = f"{many} axes" if many > 1 else "the axes"
        raise InputError(
            f"{name} is {shown(value)}; give {wanted} of a figure of matplotlib, or leave it out."
        )
    return list(given)


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
        If the value is not a finite real rational number, or neither 0 nor between 1e-300 and
        1e300 in size.

    Examples
    --------
    >>> exact("z0", "-0.4")
    Fraction(-2, 5)
    >>> exact("kappa", 0.1) == Fraction(1, 10)
    False
    """
    try:
        number = _rational(value)
    except (ValueError, TypeError, ArithmeticError, OverflowError):
        raise InputError(
            f"{name} is {shown(value)}; give a finite real rational number, such as 3, 0.5, "
            '"-0.4", "1/3" or "1e-8".'
        ) from None
    if number is None or (number and not LEAST <= abs(number) <= MOST):
        raise InputError(
            f"{name} is {shown(value)}, which is beyond 1e±300 or has more than "
            f"{_LONGEST_TEXT:,} digits; rescale the problem."
        )
    return number


def _rational(value: Any) -> Fraction | None:
    """The rational that a value stands for; None for one far out of the domain."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.item() if value.ndim == 0 else None
    if isinstance(value, (bool, complex)) or hasattr(value, "_mpc_"):
        raise TypeError
    if isinstance(value, (str, Decimal)):
        text = str(value).strip().replace("\N{MINUS SIGN}", "-")
        power = text.lower().partition("e")[2] or "0"
        if len(text) > _LONGEST_TEXT or abs(int(power[:10])) > _LONGEST_TEXT:
            return None
        # Decimal reads any number of digits; int and with it Fraction stop at 4300.
        return Fraction(text) if "/" in text else Fraction(Decimal(text))
    if hasattr(value, "_mpf_"):
        sign, mantissa, power, _ = value._mpf_
        if not mantissa and power:
            raise ValueError
        if abs(power) > 4 * _LONGEST_TEXT:
            return None
        return Fraction(int(mantissa)) * Fraction(2) ** int(power) * (-1 if sign else 1)
    if getattr(value, "is_Rational", False):
        value = Fraction(int(value.p), int(value.q))
    number = Fraction(value)
    long = max(abs(number.numerator), number.denominator).bit_length() > 4 * _LONGEST_TEXT
    return None if long else number


def floats(name: str, value: Numbers, copy: bool = True) -> FloatArray:
    """`value` as a float64 array (0-dimensional for a scalar), finite and not empty.

    Without `copy` it is read only, as it may be the caller's own.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(f"{name} is a masked array; give its unmasked values alone.")
    # Of other whole numbers not all are floats.
    if (isinstance(value, float) or type(value) is int) and abs(value) < 1e300:
        return np.asarray(float(value))
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


def to_float(name: str, value: Fraction | int) -> float:
    """The nearest float64 of a number found from others."""
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is beyond the range of float64; rescale the problem.") from None


def digits(dps: object, most: int = 10_000) -> int:
    """A number of decimal digits, 1 to `most`."""
    return count("dps", dps, 1, most, " of digits")


def whole(name: str, text: str) -> int:
    """The whole number that a text says."""
    try:
        return int(text)
    except ValueError:
        raise InputError(f"{name} is {text!r}; give a whole number.") from None


def require_printable(values: Mapping[str, object]) -> None:
    """Raise InputError for the first number that has too many digits to print; arrays pass."""
    for name, value in values.items():
        if not is_array(value) and max(map(abs, exact(name, value).as_integer_ratio())) > _PRINTED:
            raise InputError(
                f"{name} has more than {_PRINTED_DIGITS:,} digits, too many to print; leave the "
                "parameter free."
            )


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
