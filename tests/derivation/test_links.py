"""Derivations hang together: a mistake made in a statement and in its reference alike is noticed.

A step is changed together with what it is compared with, or a variable that feeds both; then a
later step, a derivation that uses the conclusion, or the conclusion's anchor has to fail.
"""

from __future__ import annotations

import importlib
import random
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import pytest
import sympy

from derivations import registry
from derivations.paper import PaperDerivation, value_of
from derivations.registry import entries
from symasym.derivation import DerivationError, Identity, Outcome, mutants
from tests.derivation.anchors import NO_NUMBER, holds

Known = Callable[[str], Any]
Change = Callable[[Any], Any]


class Unchecked:
    """In place of the check of a step that is changed together with its reference."""

    kind = "none"

    def run(self, result: Any, rng: Any) -> Outcome:
        return Outcome(True, "")


class Changed(PaperDerivation):
    """A derivation one of whose steps states something else, and is not checked."""

    def __init__(self, *arguments: Any, at: str, change: Change) -> None:
        super().__init__(*arguments)
        self.changed, self.change = at, change

    def step(self, name: str, rule: str, result: Any, check: Any, reason: str = "") -> Any:
        if name == self.changed:
            result, check = self.change(result), Unchecked()
        return super().step(name, rule, result, check, reason)


def stated(label: str, known: Known, function: Any = None, **change: Any) -> Any:
    """A derivation with its steps stated: from another source, or with one step changed."""
    entry = entries()[label]
    function = function or getattr(importlib.import_module(entry.module), entry.function)
    kind = Changed if change else PaperDerivation
    derivation = kind(label, entry.title, entry.rests_on, known, registry.holds, **change)
    function(derivation)
    return derivation


@cache
def uses(label: str) -> dict[str, set[str]]:
    """What a derivation rests on -> the steps that take something from it ("" for any)."""
    derivation = registry.assemble(label, registry.build)
    derivation.verify()
    return dict(derivation.used)


def failing(derivation: Any, steps: set[str] | None = None) -> Iterator[str]:
    """The steps whose check fails, of those named; the exact checks first, which take less."""
    every = steps is None or "" in steps
    chosen = [s for s in derivation.steps if every or s.name in (steps or ())]
    for step in sorted(chosen, key=lambda s: "order" in s.check.kind):
        if not derivation.run_step(step).passed:
            yield step.name


def noticed(changed: Any, others: Known = registry.build) -> str:
    """The derivation and step that fail where `changed` stands in place of one."""
    for label, entry in entries().items():
        if changed.label not in entry.rests_on:
            continue
        known: Known = lambda on: changed if on == changed.label else others(on)  # noqa: E731
        try:
            derivation = stated(label, known)
            where = next(failing(derivation, uses(label)[changed.label]), "")
        except Exception as error:
            return f"{label}: {error}"
        if where:
            return f"{label}: {where}"
    return ""


def wrong(derivation: Any) -> str:
    """What shows that a changed derivation is wrong: "" for nothing."""
    found = next(failing(derivation), "") or noticed(derivation)
    known = registry.build(derivation.label)
    if found or derivation.label in NO_NUMBER or derivation.result == known.result:
        return found
    return "" if holds(derivation.label, derivation.left, derivation.result) else "its anchor"


def killed(label: str, step: str, change: Change) -> str:
    """What notices a step that is changed together with its reference: "" for nothing."""
    try:
        return wrong(stated(label, registry.build, at=step, change=change))
    except Exception as error:
        return str(error) or "no value"


@cache
def references(label: str) -> frozenset[str]:
    """The steps that are compared with other steps, with other derivations, or with quadrature."""
    derivation = registry.build(label)
    found = {step for steps in uses(label).values() for step in steps}
    found |= {s.name for s in derivation.steps if "order" in s.check.kind}
    for step in derivation.steps:
        for _, mutant in list(mutants(step.result))[:3]:
            try:
                other = stated(label, registry.build, at=step.name, change=lambda _, m=mutant: m)
                found |= set(failing(other)) - {step.name}
            except Exception:
                continue
    return frozenset(found)


LABELS = list(entries())


# -- what is used is listed, and what is listed is used -------------------------------------


def test_a_derivation_uses_all_that_it_rests_on_and_nothing_else():
    def takes(*labels: str) -> PaperDerivation:
        found = PaperDerivation("mine", "", ("eq:V", "eq:C"), registry.build, registry.holds)
        found.step(
            "one", "define", sympy.S.One, Identity(lambda: [found.use(*a) for a in labels] and 1)
        )
        return found

    both = takes(("eq:V", "V(u)"), ("eq:C", "C"))
    both.verify()
    assert both.used == {"eq:V": {"one"}, "eq:C": {"one"}}
    with pytest.raises(DerivationError, match="rests on eq:C and uses nothing of it"):
        takes(("eq:V", "V(u)")).verify()
    with pytest.raises(DerivationError, match="uses eq:pss without resting on it"):
        takes(("eq:pss", "p_ss(u)")).verify()
    with pytest.raises(DerivationError, match="eq:V concludes V"):
        takes(("eq:V", "W(u)")).verify()


def _conclusion_changed(label: str, change: Change) -> Any:
    """A derivation with another conclusion, its steps as they are."""
    found = registry.assemble(label, registry.build)
    found.result = change(found.result)
    return found


def _edges(every: int) -> list[tuple[str, str]]:
    return [(a, on) for a in LABELS for on in entries()[a].rests_on][::every]


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_every_edge_bears_load(every):
    """Something that the lower one states can be changed so that the upper one fails."""
    for label, on in _edges(every):
        below = registry.build(on)
        steps = uses(label)[on]

        def fails(other: Any, label: str = label, on: str = on, steps: Any = steps) -> bool:
            try:
                known: Known = lambda name: other if name == on else registry.build(name)  # noqa: E731
                return any(failing(stated(label, known), steps))
            except Exception:
                return True

        assert any(
            fails(stated(on, registry.build, at=s.name, change=lambda _, m=mutant: m))
            for s in below.steps
            for _, mutant in list(mutants(s.result))[:4]
        ), f"{label} -> {on}"


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_the_left_side_is_part_of_the_statement(every):
    for label in LABELS[::every]:
        left = registry.build(label).left
        for wanted in map(str, left if isinstance(left, tuple) else (left,)):
            value_of(registry.build(label), wanted)
            with pytest.raises(ValueError, match="concludes"):
                value_of(registry.build(label), f"{wanted} + 1")


# -- a mistake in two consistent places -----------------------------------------------------


@pytest.mark.parametrize("every", [12, pytest.param(1, marks=pytest.mark.slow)])
def test_no_step_changed_with_its_reference_passes(every, capsys):
    tried, survivors = 0, []
    for label in LABELS[::every]:
        for step in registry.build(label).steps:
            changes = list(mutants(step.result))
            rng = random.Random(f"{label} {step.name}")
            for change, mutant in {changes[0], rng.choice(changes)}:
                tried += 1
                if killed(label, step.name, lambda _, m=mutant: m):
                    continue
                # A last step has its reference from elsewhere, where a change is noticed.
                if step.name not in references(label):
                    survivors.append(f"{label}: {step.name}: {change}")
    with capsys.disabled():
        print(f"\n{tried} steps changed with their reference, {len(survivors)} pass")
    assert not survivors
