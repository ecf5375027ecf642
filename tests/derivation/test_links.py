"""Derivations hang together: a mistake made in a statement and in its reference alike is noticed.

A step is changed together with what it is compared with (its own check is left out); then a later
step, or a derivation that uses the conclusion, has to fail. The same for a variable that feeds both.
"""

from __future__ import annotations

import ast
import importlib
import random
import types
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import sympy

from derivations import registry
from derivations.paper import PaperDerivation
from derivations.registry import Entry, closure, entries
from symasym.derivation import DerivationError, Expansion, Identity, Outcome, mutants

Known = Callable[[str], Any]


class Unchecked:
    """In place of the check of a step that is changed together with its reference."""

    kind = "none"

    def run(self, result: Any, rng: Any) -> Outcome:
        return Outcome(True, "")

    def how(self) -> str:
        return ""


class Changed(PaperDerivation):
    """A derivation one of whose steps states something else, and is not checked."""

    def __init__(self, *arguments: Any, step: str, change: Callable[[Any], Any]) -> None:
        super().__init__(*arguments)
        self.changed, self.change = step, change

    def step(self, name: str, rule: str, result: Any, check: Any, reason: str = "") -> Any:
        if name == self.changed:
            result, check = self.change(result), Unchecked()
        return super().step(name, rule, result, check, reason)


def stated(label: str, known: Known, function: Any = None, **change: Any) -> Any:
    """A derivation with its steps stated, from another source or with one step changed."""
    entry = entries()[label]
    function = function or getattr(importlib.import_module(entry.module), entry.function)
    kind = Changed if change else PaperDerivation
    derivation = kind(label, entry.title, entry.rests_on, known, registry.holds, **change)
    function(derivation)
    return derivation


@cache
def users() -> dict[str, dict[str, set[str]]]:
    """Label -> the derivations that use it -> the steps that do ("" for any)."""
    found: dict[str, dict[str, set[str]]] = {}
    for label in closure(entries()):
        derivation = registry.build(label)
        derivation.verify()
        for on, steps in derivation.used.items():
            found.setdefault(on, {})[label] = steps
    return found


def fails(derivation: Any, steps: set[str]) -> str:
    """The first of these steps whose check fails; "" if all pass."""
    chosen = [s for s in derivation.steps if not steps or "" in steps or s.name in steps]
    # The exact checks first, which take less than quadrature.
    chosen.sort(key=lambda s: "order" in s.check.kind)
    return next((s.name for s in chosen if not derivation.run_step(s).passed), "")


def noticed(changed: Any, others: Known) -> str:
    """The label and step that fail where `changed` stands in place of a derivation."""
    for label, steps in users().get(changed.label, {}).items():
        known: Known = lambda on: changed if on == changed.label else others(on)  # noqa: E731
        try:
            derivation = stated(label, known)
        except Exception as error:
            return f"{label}: {error}"
        if where := fails(derivation, steps):
            return f"{label}: {where}"
    return ""


def killed(label: str, step: str, change: Callable[[Any], Any]) -> str:
    """What notices a step that is changed with its reference: "" for nothing."""
    try:
        derivation = stated(label, registry.build, step=step, change=change)
    except Exception as error:
        return f"{label}: {error}"
    return fails(derivation, set()) or noticed(derivation, registry.build)
