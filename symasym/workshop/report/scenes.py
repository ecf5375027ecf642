"""The scenes of a report, each from the table of `symasym.workshop.problems`."""

from __future__ import annotations

from symasym.base.errors import InputError
from symasym.workshop.problems import BY_NAME, Problem

#: Name in the report -> name in the table. All start at 0, for which the peers are written.
SCENES = {
    "weak": "friction",
    "moderate": "friction k=0.3",
    "strong": "friction k=10",
    "fold": "on the fold",
    "kink": "kink - 1e-15",
    "sliding": "friction sliding weak",
    "stiff": "friction k=1e-4",
    "extreme": "fold + 1e-30",
}


def chosen(names: list[str] | None) -> dict[str, Problem]:
    """The scenes of these names, all where none are given."""
    for name in names or ():
        if name not in SCENES:
            raise InputError(f"{name!r} is no scene of the report; give {', '.join(SCENES)}.")
    return {name: BY_NAME[table] for name, table in SCENES.items() if not names or name in names}


def described(problem: Problem) -> str:
    """The scene in a line."""
    return f"{problem.make()!r}, kappa = {problem.kappa}, r = {problem.r}"
