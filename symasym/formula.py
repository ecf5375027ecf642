"""A formula as a value: what it says, what it supposes, how wrong it is, how it was derived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from symasym.base.errors import InputError

__all__ = ["Formula", "formula", "labels"]


@dataclass(frozen=True)
class Formula:
    """One derived formula of the paper, as the derivations state it.

    Attributes
    ----------
    label : str
        The paper's equation label, or this project's name for a result without one.
    title : str
    assumptions : tuple of str
        The hypotheses, each with its status and where it holds or fails.
    error : str
        What the formula leaves out, and when.
    note : str
        What the symbols stand for that are not the problem's own.
    rests_on : tuple of str
        Labels of the formulas it was derived from.
    trace : tuple of dict
        The steps: name, rule, kind of check, how it is checked, reason, LaTeX.
    functions : tuple of str
        Names in `symasym.generated.numpy_formulas` and `mpmath_formulas`.
    """

    label: str
    title: str
    assumptions: tuple[str, ...]
    error: str
    note: str
    rests_on: tuple[str, ...]
    trace: tuple[Mapping[str, str], ...] = field(repr=False)
    functions: tuple[str, ...] = field(repr=False)
    _data: Mapping[str, Any] = field(repr=False)

    @cached_property
    def expression(self) -> Any:
        """The right side as a SymPy expression (a Tuple where there are several)."""
        return _read(self._data["expression"])

    @cached_property
    def remainder(self) -> Any:
        """The order of what is left out, as a SymPy expression; None for an exact formula."""
        return _read(self._data["remainder"]) if "remainder" in self._data else None

    @property
    def limit(self) -> str | None:
        """Where the remainder's order holds, e.g. ``"kappa -> 0"``."""
        return self._data.get("limit")

    def latex(self) -> str:
        """``left = right`` in LaTeX, with the order of the remainder."""
        return str(self._data["latex"])

    @cached_property
    def code(self) -> list[dict[str, Any]]:
        """The functions by name: doc, arguments, and the values as SymPy expressions."""
        from symasym.derivation.results import parts

        return [
            {**item, "values": tuple(parts(_read(item["expression"])))}
            for item in self._data["code"]
        ]

    def emit(
        self,
        target: str = "numpy",
        parameters: Mapping[str, Any] | None = None,
        *,
        drift: Any = None,
    ) -> Any:
        """Source code of the formula: `symasym.emit` of it."""
        from symasym.emit import emit

        return emit(self, target, parameters, drift=drift)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def formula(label: str) -> Formula:
    """The formula of a label.

    Parameters
    ----------
    label : str
        A label of the paper (``"eq:Ttilde"``, ``"fr1"``) or a name from `labels`.

    Raises
    ------
    InputError
        If there is no such formula, or the label is a definition.

    Examples
    --------
    >>> from symasym.formula import formula
    >>> formula("eq:Tlarge").error
    'O(r^2), for kappa >= sqrt(eps)'
    >>> formula("folds").rests_on
    ('cubic', 'turning-points', 'beta')
    """
    if not isinstance(label, str):
        raise InputError(f"label is {label!r}; give one of symasym.formula.labels().")
    data = _all()
    if label in data["definitions"]:
        raise InputError(f"{label} is not derived: {data['definitions'][label]}")
    if label not in data["formulas"]:
        near = [known for known in data["formulas"] if label.split(":")[-1] in known]
        hint = f"perhaps {near[0]}" if near else "see symasym.formula.labels()"
        raise InputError(f"{label!r} is no formula; {hint}.")
    record = data["formulas"][label]
    return Formula(
        label=label,
        title=record["title"],
        assumptions=tuple(
            f"{h['statement']} ({h['status']}{': ' + h['where'] if h['where'] else ''})"
            for h in record["hypotheses"]
        ),
        error=record["error"],
        note=record["note"],
        rests_on=tuple(record["rests_on"]),
        trace=tuple(record["steps"]),
        functions=tuple(record["functions"]),
        _data=record,
    )


def labels() -> tuple[str, ...]:
    """Every label that `formula` knows."""
    return tuple(_all()["formulas"])


@cache
def _all() -> dict[str, Any]:
    import json

    text = _generated("formulas.json")
    found: dict[str, Any] = json.loads(text)
    return found


def _read(text: str) -> Any:
    import sympy

    return sympy.sympify(text)


def _generated(name: str) -> str:
    from importlib import resources

    return resources.files("symasym.generated").joinpath(name).read_text("utf-8")
