"""Every formula in an mpmath context `ctx`, its first argument, at its precision.

Written by ``python -m derivations.emit``: do not edit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symasym.generated import formulas

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


def __getattr__(name: str) -> Any:
    """A formula; one of numbers alone with a context before these."""
    formula = getattr(formulas, name)
    if formula.__code__.co_varnames[0] not in ("c", "ctx"):
        of_numbers = formula

        def formula(ctx: MPContext, *numbers: mpf, **named: mpf) -> Any:
            return of_numbers(*numbers, **named)

        formula.__name__, formula.__doc__ = name, of_numbers.__doc__
    globals()[name] = formula
    return formula
