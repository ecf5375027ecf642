"""A value with its error as part of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from symasym.base.inputs import Floats

if TYPE_CHECKING:
    from mpmath import mpf


ErrorKind = Literal["bound", "estimate", "none"]


@dataclass(frozen=True, repr=False)
class Estimate:
    """The result of a verb with ``full=True``.

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
    """

    value: Any
    error: Any
    error_kind: ErrorKind
    method: str
    order: int | None = None
    terms: tuple[str, ...] = field(default=())
    dropped: tuple[str, ...] = field(default=())

    def __str__(self) -> str:
        if self.error_kind == "none":
            return f"{_shown(self.value, 15)} (no error claimed, {self.method})"
        sign = "±" if self.error_kind == "bound" else "≈±"
        if hasattr(self.value, "shape"):
            return f"{self.value} {sign} {self.error} ({self.error_kind}, {self.method})"
        text, error = _text_with_error(self.value, self.error)
        return f"{text} {sign} {error} ({self.error_kind}, {self.method})"

    def __repr__(self) -> str:
        return f"Estimate({self})"


def _shown(value: mpf | Floats, digits: int) -> str:
    """The value to so many digits; an array as NumPy shows it."""
    from mpmath import libmp

    if hasattr(value, "shape"):
        return str(value)
    exactly = value._mpf_ if hasattr(value, "_mpf_") else libmp.from_float(float(value))
    return str(libmp.to_str(exactly, digits))


def _text_with_error(value: mpf | Floats, error: mpf | Floats) -> tuple[str, str]:
    """The digits that the error leaves, and the error with what printing them rounds off."""
    from mpmath import nstr

    from symasym.base.contexts import own_context

    if hasattr(value, "_mpc_") or isinstance(value, complex):
        (re, wide), (im, high) = (_text_with_error(y, error) for y in (value.real, value.imag))
        # Each part was rounded by itself; both errors already hold the whole.
        return f"({re} {'' if im.startswith('-') else '+'}{im}j)", _wider(wide, high)
    with own_context(15) as context:
        exact, radius = (context.mpf(getattr(x, "_mpf_", x)) for x in (value, error))
        digits = 17
        if exact and radius:
            digits = max(1, int(context.floor(context.log10(abs(exact) / radius))))
        context.dps = digits + 20
        exact = context.make_mpf(value._mpf_) if hasattr(value, "_mpf_") else context.mpf(value)
        text = nstr(exact, digits, strip_zeros=False)
        total = radius + abs(exact - context.mpf(text))
        # Three digits, rounded upwards: printing can lower the number by half a percent.
        return text, nstr(total * context.mpf("1.006"), 3)


def _wider(first: str, second: str) -> str:
    """An error of both parts from two, each of which holds that of the whole."""
    from mpmath import nstr

    from symasym.base.contexts import own_context

    with own_context(15) as context:
        return str(nstr((context.mpf(first) + context.mpf(second)) * context.mpf("1.006"), 3))
