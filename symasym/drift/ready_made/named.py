"""Drifts by their names, as commands and files give them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError
from symasym.base.inputs import meant, whole

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

#: The ready-made ones.
DRIFTS = ("friction", "linear", "sine", "tanh", "hill", "polynomial")


def named_drift(name: str | None, expression: str | None, values: Mapping[str, Any]) -> Drift:
    """The ready-made drift `name`, or the one of the formula A(u) in `expression`.

    Parameters
    ----------
    name : str or None
        One of `DRIFTS`.
    expression : str or None
        Instead of `name`.
    values : mapping of str to number
        Its parameters, and the whole numbers that shape a ready-made one (`waves`, `n`).

    Raises
    ------
    InputError
        For an unknown name and for values outside their range.

    Examples
    --------
    >>> named_drift("sine", None, {"a_minus": "1", "a_plus": "1", "waves": "2"}).free
    ('b',)
    """
    if expression is not None:
        return _of_formula(expression).bind(**values)
    if name not in DRIFTS:
        near = meant(name, DRIFTS)
        raise InputError(f"{name} is no ready-made drift; they are {', '.join(DRIFTS)}{near}.")
    make = _maker(name)
    known = inspect.signature(make).parameters
    for given in values:
        if given not in known and name != "polynomial":
            raise InputError(
                f"{given} is no parameter of {name}; its parameters are "
                f"{', '.join(known)}{meant(given, known)}."
            )
    # The shape of a drift (waves, exponent) is a whole number and no parameter of its formula.
    shape = {key: whole(key, values[key]) for key in {"waves", "n"} & values.keys()}
    drift: Drift = make(**{**values, **shape})
    return drift


def drift_signatures() -> dict[str, str]:
    """The ready-made drifts with the names of their parameters, for a help text."""
    return {
        name: ", ".join(
            "c0, c1, c2, ..." if name == "polynomial" else str(parameter).partition(":")[0]
            for parameter in list(inspect.signature(_maker(name)).parameters.values())[
                : 1 if name == "polynomial" else None
            ]
        )
        for name in DRIFTS
    }


def _maker(name: str) -> Any:
    """The function that makes the ready-made drift of that name."""
    from symasym.drift.ready_made import friction, smoothings

    return getattr(friction if name == "friction" else smoothings, name)


@lru_cache(maxsize=8)
def _of_formula(expression: str) -> Drift:
    """The drift of a formula, kept: reading it takes longer than most of its values."""
    from symasym.drift.drift import Drift

    return Drift(expression)
