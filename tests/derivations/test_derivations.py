"""The paper's derivations: each step holds, each changed step fails, alone and with its users.

Conclusions agree with their definitions: the rows of the modules `anchors_*`.
"""

from __future__ import annotations

import random
import re
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import derivations.sections  # noqa: F401
from derivations import pages
from derivations.labels import BEYOND, DEFINITIONS, NUMBERS
from symasym.derivation.derivation import LABELS, build
from tests.derivations import anchors_exit, anchors_law, anchors_uniform, anchors_weak_noise
from tests.derivations.mistakes import changed, mutants, passes, survivors
from tests.latex import compiled, needs_latex

STEPS = [(label, step.name) for label in LABELS for step in build(label).steps]
CONCLUDED = {(label, step.name) for label in LABELS for step in build(label).concluded}
TABLES = (anchors_exit, anchors_weak_noise, anchors_uniform, anchors_law)
ANCHORS = {k: check for table in TABLES for k, check in table.ANCHORS.items()}
TOLERANCE = {k: most for table in TABLES for k, most in table.TOLERANCE.items()}
USERS = {label: [x for x in LABELS if label in build(x).rests_on] for label in LABELS}


@pytest.mark.parametrize("label", [*LABELS, "saddle-series-4"])
def test_every_step_holds(label: str) -> None:
    rests_on = tuple(build(label).rests_on)
    assert build(label).verify() == []
    assert tuple(build(label).rests_on) == rests_on


@pytest.mark.parametrize("label", LABELS)
def test_a_change_fails(label: str) -> None:
    rng, steps = random.Random(label), build(label).steps
    step = rng.choice(steps)
    for mutant in islice(mutants(step.right), 3):
        assert not passes(step, mutant), (step.name, mutant)


@pytest.mark.slow
@pytest.mark.parametrize("label", LABELS)
def test_every_change_fails(label: str) -> None:
    assert {s.name: alive for s in build(label).steps if (alive := survivors(s)[0])} == {}


def notices(label: str, name: str) -> bool:
    """Whether a step fails when another's right side is changed and its own check left out.

    Asked are the steps of its label and of the labels that rest on that.
    """
    step = next(s for s in build(label).steps if s.name == name)
    again = (label, *USERS[label])
    try:
        with changed(label, name, next(mutants(step.right)), again):
            return not all(passes(s, s.right) for x in again for s in build(x).steps)
    except Exception:  # the changed expression does not even fit
        return True


def unnoticed(steps: list[tuple[str, str]]) -> set[tuple[str, str]]:
    """The steps whose change, their own check left out, no step of a label notices."""
    free = [step for step in steps if step not in CONCLUDED]
    return {(label, name) for label, name in free if not notices(label, name)}


def test_a_step_changed_with_its_check_is_noticed_by_another() -> None:
    assert unnoticed(STEPS[::12]) == set()


@pytest.mark.slow
def test_every_step_changed_with_its_check_is_noticed_by_another() -> None:
    assert unnoticed(STEPS) == set()


def worst(check: Any) -> float:
    """The largest relative difference between formulas and definitions, over what is allowed."""
    allowed = max(TOLERANCE.get(label, 1e-8) for label, c in ANCHORS.items() if c is check)
    pairs = check(np.random.default_rng(1))
    return max(abs(got - want) / (allowed * max(abs(want), 1e-300)) for got, want in pairs)


@pytest.mark.parametrize("check", dict.fromkeys(ANCHORS.values()), ids=lambda c: c.__name__)
def test_what_is_concluded_is_what_it_is_about(check: Any) -> None:
    assert worst(check) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("label", ANCHORS)
def test_a_changed_conclusion_is_not_what_it_is_about(label: str) -> None:
    def differs(name: str, mutant: Any, check: Any) -> bool:
        try:
            with changed(label, name, mutant, [label]):
                return not worst(check) <= 1
        except Exception:  # the changed expression has no number there
            return True

    # A limit, 0 or 1, is that of another conclusion.
    for step in (s for s in build(label).concluded if s.right.free_symbols):
        # A bound may stay one, when it is changed.
        bound = re.search(r"\\[lg]e\b", step.latex())
        some = islice(mutants(step.right), 9 if bound else 1)
        check = anchors_weak_noise.bounds if bound else ANCHORS[label]
        assert any(differs(step.name, m, check) for m in some), step.name


def test_every_label_of_the_paper_is_derived_or_defined() -> None:
    assert set(NUMBERS) - set(LABELS) == set(DEFINITIONS)
    assert set(BEYOND) <= set(LABELS)
    assert {on for label in LABELS for on in build(label).rests_on} <= set(LABELS)


@pytest.mark.parametrize("label", LABELS)
def test_sentences_have_their_formulas_between_dollars(label: str) -> None:
    d = build(label)
    sentences = [d.title, d.note, d.leaves_out(), *(s.why for s in d.steps)]
    sentences += [text for row in d.supposed for text in (row[0], row[2])]
    for sentence in sentences:
        assert sentence.count("$") % 2 == 0, sentence
        assert not re.search(r"[\\^_]", re.sub(r"\$[^$]*\$", "", sentence)), sentence


@needs_latex
def test_latex_compiles(tmp_path: Path) -> None:
    text = pages.document()
    snippets = "\n".join(map(pages.latex, LABELS))
    path = tmp_path / "all.tex"
    path.write_text(text.replace(r"\end{document}", snippets + r"\end{document}"))
    compiled(path)


def test_pages_are_written(tmp_path: Path) -> None:
    pages.derive(pages.with_roots(["eq:C"]), tmp_path, lambda: None)
    assert {"eq-C.md", "eq-C.tex", "index.md", "trace.json"} <= {p.name for p in tmp_path.iterdir()}
    assert "[density-R](density-R.md)" in (tmp_path / "eq-C.md").read_text()
