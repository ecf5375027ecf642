"""The option ``--set NAME=X`` of a command line."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TypeAlias

from symasym.base.errors import InputError
from symasym.base.inputs import is_name

#: What ``add_subparsers`` returns, to which each command adds its parser.
Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def settings(pairs: Sequence[str]) -> dict[str, str]:
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
    values: dict[str, str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not is_name(name):
            raise InputError(f"--set is {pair!r}; write it as NAME=NUMBER, for example mu=3.")
        if name in values:
            raise InputError(f"{name} is set twice; set it once.")
        values[name] = text
    return values
