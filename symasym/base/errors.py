"""The exceptions that symasym raises.

Every message is one sentence that states the value, the rule that it violates, and
what to do instead.
"""

import re

_LONGEST = 1000


class SymasymError(Exception):
    """Base class of the exceptions that symasym raises."""

    def __init__(self, message: str) -> None:
        # A quoted value may have many lines or digits.
        one_line = re.sub(r"\s+", " ", message)
        text = re.sub(r"(\w{20})\w{60,}", r"\1...", one_line)
        # The beginning and the end of a message are its most useful parts.
        super().__init__(text if len(text) <= _LONGEST else f"{text[:400]} ... {text[-400:]}")


class InputError(SymasymError, ValueError):
    """An argument is outside the domain of the function."""


class RegionError(InputError):
    """The requested quantity does not exist for this drift, for example in its region."""


class AccuracyError(SymasymError, ArithmeticError):
    """The chosen method cannot guarantee the requested accuracy."""


class RangeError(AccuracyError, OverflowError):
    """The value is outside the range of the requested number type (``log=True`` avoids this)."""


class OutputError(SymasymError, OSError):
    """A result cannot be written; an existing file is left unchanged."""
