"""The family of errors that symasym raises.

Every message is one sentence that names the value, the rule it broke, and
what to do about it.
"""

import re

_LONGEST = 1000


class SymasymError(Exception):
    """Base of every error that symasym raises on purpose."""

    def __init__(self, message: str) -> None:
        # Values are quoted as they were given, which may be many lines or digits.
        one_line = re.sub(r"\s+", " ", message)
        text = re.sub(r"(\w{20})\w{60,}", r"\1...", one_line)
        # What is wrong stands first, and what to do last.
        super().__init__(text if len(text) <= _LONGEST else f"{text[:400]} ... {text[-400:]}")


class InputError(SymasymError, ValueError):
    """An argument is outside what the function takes."""


class RegionError(InputError):
    """The quantity asked for does not exist in the drift's region."""


class AccuracyError(SymasymError, ArithmeticError):
    """The digits asked for cannot be promised by the method that was chosen."""


class RangeError(AccuracyError, OverflowError):
    """The value does not fit the number type asked for (``log=True`` always fits)."""


class OutputError(SymasymError, OSError):
    """A result cannot be written; what was there before is untouched."""
