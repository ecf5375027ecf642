"""Numbers as texts: exact ones, and values to the digits that their errors leave."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

__all__ = ["carried_text", "number_repr", "number_text"]

_EVALUATED = 12  # digits of a float64 value without a stated error


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
            return f"{'-' if x < 0 else ''}{whole}{tail}"
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


def carried_text(value: Any, error: Any, most: int) -> tuple[str, str | None]:
    """The digits of `value` that its error leaves, at most `most`, and the error of that text.

    The last digit is off by at most one. Without an error: `most` digits, 12 of a float.

    Examples
    --------
    >>> carried_text(2.0 / 3, 1e-6, 17)
    ('0.66667', '4.34e-6')
    """
    from flint import arb
    from mpmath import libmp

    from symasym.base.balls import precision

    if error is None:
        plain = isinstance(value, float)
        return (f"{value:.{_EVALUATED}g}" if plain else libmp.to_str(value._mpf_, most)), None
    with precision(4 * most + 200):
        text = arb(value, error).str(most)
    if "+/-" not in text:
        return text, "0"
    middle, radius = text.strip("[]").split(" +/- ") if text[1] != "+" else ("0", text[5:-1])
    return middle, radius
