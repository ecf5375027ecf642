"""Drifts by their names, as commands and files give them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError

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
        from symasym.drift.drift import Drift

        return Drift(expression).bind(**values)
    if name not in DRIFTS:
        raise InputError(f"{name} is no ready-made drift; they are {', '.join(DRIFTS)}.")
    given = dict(values)
    for key in {"waves", "n"} & given.keys():
        if str(given[key]).isdecimal():
            given[key] = int(given[key])
    make = _maker(name)
    try:
        drift: Drift = make(**given)
    except TypeError:
        raise InputError(
            f"{', '.join(given)} are no parameters of {name}; its parameters are "
            f"{drift_signatures()[name]}."
        ) from None
    return drift


def drift_signatures() -> dict[str, str]:
    """The ready-made drifts with the names of their parameters, for a help text."""
    return {
        name: "c0, c1, c2, ..."
        if name == "polynomial"
        else ", ".join(inspect.signature(_maker(name)).parameters)
        for name in DRIFTS
    }


def _maker(name: str) -> Any:
    """The function that makes the ready-made drift of that name."""
    from symasym.drift.ready_made import friction, smoothings

    return getattr(friction if name == "friction" else smoothings, name)
