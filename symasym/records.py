"""The derived formulas of the paper, read from what the derivations wrote (`symasym.generated`).

`Record` is one of them as a value; `symasym.formula` adds to it what its users call.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, Self

from symasym.base.errors import InputError
from symasym.base.inputs import meant, shown

__all__ = ["Record", "definition", "definitions", "labels"]

#: Status of a hypothesis -> the word that its line begins with.
_LEDGER = {"assumed": "Assumes", "checked": "Checked", "fails": "Does not hold"}


@dataclass(frozen=True)
class Record:
    """The statement of one derivation; its attributes are those of `symasym.formula.Formula`."""

    label: str
    title: str
    assumptions: tuple[str, ...]
    error: str
    note: str
    rests_on: tuple[str, ...]
    trace: tuple[Mapping[str, str], ...] = field(repr=False)
    functions: tuple[str, ...] = field(repr=False)
    _data: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, label: str) -> Self:
        """The formula of a label.

        Raises
        ------
        InputError
            If there is no such formula, or the label is a definition.
        """
        if not isinstance(label, str):
            raise InputError(f"label is {shown(label)}; give one of sa.labels().")
        data = _all()
        if label in data["definitions"]:
            defined = data["definitions"][label]
            raise InputError(f"{label} is not derived: {defined['reason']} {defined['text']}")
        if label not in data["formulas"]:
            near = meant(label, [*data["formulas"], *data["definitions"]])
            raise InputError(f"{shown(label)} is no formula{near or '; sa.labels() lists them'}.")
        return cls.read(label, data["formulas"][label])

    @classmethod
    def read(cls, label: str, known: Mapping[str, Any]) -> Self:
        """The formula of a label from its data."""
        return cls(
            label=label,
            title=known["title"],
            assumptions=tuple(
                f"{_LEDGER[h['status']]}: {h['statement']}" + (h["where"] and f" ({h['where']})")
                for h in known["hypotheses"]
            ),
            error=known["error"],
            note=known["note"],
            rests_on=tuple(known["rests_on"]),
            trace=tuple(known["steps"]),
            functions=tuple(known["functions"]),
            _data=known,
        )

    @cached_property
    def expression(self) -> Any:
        """The right side as a SymPy expression (a Tuple where there are several)."""
        return _read(self._data["expression"])

    @cached_property
    def left(self) -> Any:
        """The left side as a SymPy expression (a Tuple where there are several formulas)."""
        return _read(self._data["left"])

    @property
    def cases(self) -> tuple[str, ...]:
        """LaTeX of the conditions of the pieces of `expression`; empty where it has none."""
        return tuple(self._data["cases"])

    @property
    def names(self) -> Mapping[str, str]:
        """LaTeX of the symbols, by their names in `expression`."""
        names: Mapping[str, str] = self._data["names"]
        return names

    @cached_property
    def remainder(self) -> Any:
        """The order of what is left out, as a SymPy expression; None for an exact formula."""
        return _read(self._data["remainder"]) if "remainder" in self._data else None

    @property
    def limit(self) -> str | None:
        """The limit in which the remainder's order holds, e.g. ``"kappa -> 0"``."""
        return self._data.get("limit")

    def latex(self) -> str:
        """``left = right`` in LaTeX with the order left out, or ``left ~ right`` without it."""
        return str(self._data["latex"])

    @cached_property
    def code(self) -> list[dict[str, Any]]:
        """The functions by name: doc, arguments, and the values as SymPy expressions."""
        from symasym.derivation.results import parts

        return [
            {**item, "values": tuple(parts(_read(item["expression"])))}
            for item in self._data["code"]
        ]

    def values_of(self, name: str) -> tuple[Any, ...]:
        """The values of one of the functions, as SymPy expressions."""
        return next(item["values"] for item in self.code if item["name"] == name)


def definition(label: str) -> Mapping[str, str] | None:
    """A definition of the paper by its label (latex, text, reason); None for anything else."""
    return definitions().get(label)


def definitions() -> Mapping[str, Mapping[str, str]]:
    """The paper's definitions by their labels, as of `definition`."""
    known: Mapping[str, Mapping[str, str]] = _all()["definitions"]
    return known


def labels() -> tuple[str, ...]:
    """Every label that `formula` knows."""
    return tuple(_all()["formulas"])


@cache
def _all() -> dict[str, Any]:
    """The content of the emitted ``formulas.json``."""
    import json
    from importlib import resources

    text = resources.files("symasym.generated").joinpath("formulas.json").read_text("utf-8")
    data: dict[str, Any] = json.loads(text)
    return data


def _read(text: str) -> Any:
    """The SymPy expression of a text that `sympy.srepr` wrote."""
    import sympy

    return sympy.sympify(text)
