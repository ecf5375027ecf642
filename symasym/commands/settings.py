"""What ``--set NAME=X`` says on a command line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symasym.base.errors import InputError
from symasym.base.inputs import is_name


def settings(pairs: Sequence[str]) -> dict[str, Any]:
    """The texts of ``NAME=X`` pairs by name.

    Raises
    ------
    InputError
        If a pair is none, or a name is set twice.

    Examples
    --------
    >>> settings(["mu=3", "z0=-0.4"])
    {'mu': '3', 'z0': '-0.4'}
    """
    values: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not is_name(name):
            raise InputError(f"--set is {pair!r}; write it as NAME=NUMBER, for example mu=3.")
        if name in values:
            raise InputError(f"{name} is set twice; set it once.")
        values[name] = text
    return values
