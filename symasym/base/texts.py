"""Numbers as texts: exact ones, and values to the digits that their errors leave."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from symasym.base.call_context import own_context

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["carried_text", "number_repr", "number_text", "upwards", "with_error"]

# Of the error that is printed; the value goes on to the last of them.
_ERROR_DIGITS = 3
# An error smaller than that of so many digits of a float says nothing more.
_MOST_OF_FLOAT = 50


def number_text(x: Fraction) -> str:
    """An exact number as a decimal where it is a short one, else as a quotient.

    Examples
    --------
    >>> number_text(Fraction(-1, 8)), number_text(Fraction(1, 3)), number_text(Fraction(7))
    ('-0.125', '1/3', '7')
    """
    for decimals in range(20):
        scaled = x * 10**decimals
        if scaled.denominator == 1:
            whole, part = divmod(abs(scaled.numerator), 10**decimals)
            tail = f".{part:0{decimals}d}" if decimals else ""
            return f"{'-' if x < 0 else ''}{_digits(whole)}{tail}"
    return f"{_digits(x.numerator)}/{_digits(x.denominator)}"


def _digits(n: int) -> str:
    """The digits of a whole number, also of one that is longer than Python prints."""
    return str(n) if abs(n) < 10**4000 else str(Decimal(n))


def number_repr(x: Fraction) -> str:
    """Python source of an exact number: an int, a float where it is one, else a text.

    Examples
    --------
    >>> number_repr(Fraction(3)), number_repr(Fraction(1, 2)), number_repr(Fraction(-2, 5))
    ('3', '0.5', "'-0.4'")
    >>> number_repr(Fraction(0.1))
    '0.1'
    """
    if x.denominator == 1 and abs(x.numerator) < 10**16:
        return str(x.numerator)
    try:
        near = float(x)
    except OverflowError:
        near = 0.0
    return repr(near) if near == x else repr(number_text(x))


def with_error(value: Any, error: Any) -> tuple[str, str]:
    """A value, real or complex, to the last of three digits of its error, and that error.

    The error is rounded upwards and includes what printing the value rounds off, so that the text
    is right as it stands; it is at most 2 % larger than `error`, except where `error` is far
    smaller than what the type of `value` resolves.
    """
    if hasattr(value, "_mpc_") or isinstance(value, complex):
        re, im = (_rounded(part, error, _ERROR_DIGITS) for part in (value.real, value.imag))
        text = f"({re[0]} {'' if im[0].startswith('-') else '+'}{im[0]}j)"
        return text, upwards(error, re[1], im[1])
    text, rounding = _rounded(value, error, _ERROR_DIGITS)
    return text, upwards(error, rounding)


def carried_text(value: Any, error: Any, most: int) -> tuple[str, str]:
    """The digits of `value` that its error leaves, at most `most`, and the error of that text.

    The last digit is off by at most one.

    Examples
    --------
    >>> carried_text(2.0 / 3, 1e-6, 17)
    ('0.66667', '4.34e-6')
    """
    text, rounding = _rounded(value, error, 0, most)
    return text, upwards(error, rounding)


def _rounded(value: Any, error: Any, further: int, most: int | None = None) -> tuple[str, mpf]:
    """`value` rounded at the digit of its error that is number `further`, and what that changed.

    Number 0 is the first digit of which the error is at most a half.
    """
    from mpmath import libmp

    exactly = value._mpf_ if hasattr(value, "_mpf_") else libmp.from_float(float(value))
    if most is None:
        resolved = libmp.prec_to_dps(exactly[1].bit_length()) + 3
        most = max(_MOST_OF_FLOAT, resolved)
    with own_context(15) as context:
        number, radius = context.make_mpf(exactly), _real(error, context)
        digits = most
        if not context.isfinite(radius):
            digits = 1
        elif number and radius:
            if not further:
                radius *= 2 * (1 - context.mpf(10) ** -9)
            place = _power(radius, context) - further + 1
            digits = min(most, max(1, _power(abs(number), context) - place + 1))
        context.dps = digits + 20
        text = str(libmp.to_str(exactly, digits, strip_zeros=not radius))
        return text, abs(context.make_mpf(exactly) - context.mpf(text))


def upwards(*errors: Any, digits: int = _ERROR_DIGITS) -> str:
    """The sum of errors, its first digits rounded upwards.

    Examples
    --------
    >>> upwards(1.5001), upwards(0.00123, digits=2)
    ('1.51', '0.0013')
    """
    from mpmath import libmp

    with own_context(30) as context:
        total = sum((_real(error, context) for error in errors), context.zero)
        if not total or not context.isfinite(total):
            return "inf" if total else "0"
        unit = context.mpf(10) ** (_power(total, context) - digits + 1)
        # The float nearest to a text of so few digits is that text.
        units = context.ceil(total / unit * (1 - context.mpf(2) ** -52))
        return str(libmp.to_str((units * unit)._mpf_, digits))


def _real(x: Any, context: MPContext) -> mpf:
    """A float or mpf as a number of the context, not rounded."""
    return context.make_mpf(x._mpf_) if hasattr(x, "_mpf_") else context.mpf(float(x))


def _power(x: mpf, context: MPContext) -> int:
    """The power of ten of the leading digit."""
    power = int(context.floor(context.log10(x)))
    # The logarithm of a power of ten may be rounded to either side.
    return power + int(context.mpf(10) ** (power + 1) <= x) - int(context.mpf(10) ** power > x)
