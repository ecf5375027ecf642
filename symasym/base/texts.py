"""Numbers as texts: exact ones, and values to the digits that their errors leave."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

__all__ = ["carried_text", "interval_text", "number_repr", "number_text"]

_EVALUATED = 12  # digits of a float64 value without a stated error


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


def carried_text(value: Any, error: Any, most: int) -> tuple[str, str | None]:
    """At most `most` digits of `value`, as many as its error leaves, and the error of that text.

    Without an error: `most` digits, 12 of a float.
    """
    if error is not None:
        return interval_text(value, error, most)
    if isinstance(value, float):
        return f"{value:.{_EVALUATED}g}", None
    from mpmath import libmp

    return libmp.to_str(value._mpf_, most), None
