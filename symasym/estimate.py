"""A value with its error as part of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

ErrorKind = Literal["bound", "estimate", "none"]


@dataclass(frozen=True)
class Estimate:
    """What a verb returns with ``full=True``.

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
            return f"{self.value} (no error claimed, {self.method})"
        sign = "±" if self.error_kind == "bound" else "≈±"
        from mpmath import mpf, nstr

        error = nstr(mpf(self.error), 3) if not hasattr(self.error, "shape") else self.error
        return f"{self.value} {sign} {error} ({self.error_kind}, {self.method})"
