"""The derivation of each label. Nothing here loads SymPy until a derivation is built."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Entry:
    """A label's derivation: its module, and the labels that it rests on.

    A series has `orders` derivations: that to its own `order` by its label, that to order 5 by
    ``LABEL-5``, which rests on other series to that order.
    """

    label: str
    title: str
    module: str
    function: str
    rests_on: tuple[str, ...]
    order: int = 0
    orders: int = 0


def derives(
    label: str, title: str, rests_on: tuple[str, ...] = (), order: int = 0, orders: int = 0
) -> Callable[[Any], Any]:
    """Mark a function that fills in the derivation of `label`, of a series to any of its orders.

    The arguments are read from the source (see `entries`), so they are written as literals.
    """

    def mark(function: Any) -> Any:
        function.entry = (label, title, rests_on)
        return function

    return mark


@cache
def entries() -> dict[str, Entry]:
    """Every derivation, by label, read from the sources of the section modules."""
    found: dict[str, Entry] = {}
    for path in sorted((HERE / "sections").rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.FunctionDef):
                continue
            for mark in node.decorator_list:
                if isinstance(mark, ast.Call) and getattr(mark.func, "id", "") == "derives":
                    label, title, *rest = [ast.literal_eval(a) for a in mark.args]
                    given = {str(k.arg): ast.literal_eval(k.value) for k in mark.keywords}
                    on = tuple(rest[0] if rest else given.pop("rests_on", ()))
                    if label in found:
                        raise ValueError(f"{label} is derived twice, in {path.name}.")
                    place = path.relative_to(HERE.parent).with_suffix("")
                    module = ".".join(place.parts)
                    found[label] = Entry(label, title, module, node.name, on, **given)
    for entry in found.values():
        missing = [on for on in entry.rests_on if on not in found]
        if missing:
            raise ValueError(f"{entry.label} rests on {missing[0]}, which nothing derives.")
    return found


def entry(label: str) -> Entry:
    """The entry of a label, or of a series to an order (``saddle-series-5``); else KeyError."""
    if label in entries():
        return entries()[label]
    head, _, order = label.rpartition("-")
    known = entries()[head]
    if order not in map(str, range(1, known.orders + 1)):
        raise KeyError(label)
    on = tuple(f"{on}-{order}" if entries()[on].orders else on for on in known.rests_on)
    title = f"{known.title}, to order {order}"
    return replace(known, label=label, title=title, rests_on=on, order=int(order))


def closure(labels: Iterable[str]) -> list[str]:
    """These labels and all they rest on, each after what it rests on."""
    ordered: list[str] = []
    under_way: list[str] = []

    def visit(label: str) -> None:
        if label in ordered:
            return
        known = entry(label)
        if label in under_way:
            raise ValueError(f"{' -> '.join([*under_way, label])} is a circle.")
        under_way.append(label)
        for other in known.rests_on:
            visit(other)
        under_way.pop()
        ordered.append(label)

    for label in labels:
        visit(label)
    return ordered


@cache
def build(label: str) -> Any:
    """The derivation of `label` with its steps stated; no check is run."""
    return assemble(label, build)


def assemble(label: str, known: Callable[[str], Any]) -> Any:
    """As `build`, afresh, with `known` for the derivations that it rests on."""
    from derivations.paper import PaperDerivation

    own = entry(label)
    derivation = PaperDerivation(label, own.title, own.rests_on, known, holds, own.order)
    getattr(importlib.import_module(own.module), own.function)(derivation)
    return derivation


def holds(name: str) -> bool:
    """True if the counterexample of that name in `derivations.errata.evidence` holds."""
    # By name, since the counterexamples use the sections, which name them here.
    evidence = importlib.import_module("derivations.errata.evidence")
    return bool(getattr(evidence, name)().holds())
