"""Every slip: the derived form agrees with the truth, the printed one does not."""

from __future__ import annotations

from fractions import Fraction

import pytest

from derivations.errata import evidence, evidence_text
from derivations.errata.entries import ERRATA, KINDS, table
from derivations.errata.evidence import Evidence
from derivations.errata.page import markdown, text, without_tex
from derivations.labels import PAPER
from derivations.registry import entries

NUMBERED = [e for e in ERRATA if e.counterexample is not None]


@pytest.mark.parametrize("entry", NUMBERED, ids=lambda e: e.counterexample.__name__)
def test_counterexample(entry):
    found = entry.counterexample()
    assert found.holds(), (found.printed, found.true, found.derived)
    assert found.inputs
    assert found.quantity


def test_entries_are_whole():
    for entry in ERRATA:
        assert entry.kind in KINDS
        assert entry.derivation in entries()
        assert not entry.label or entry.label in PAPER
        assert all((entry.section, entry.printed, entry.right, entry.consequence))
        # A number or a reason; what is wrong or not sharp has a number.
        assert (entry.counterexample is None) == bool(entry.argument)
        assert entry.counterexample is not None or entry.kind in ("misprint", "wording")
        for sentence in (entry.printed, entry.right, entry.consequence, entry.argument):
            assert sentence.count("$") % 2 == 0
            assert not set("\\{}$") & set(without_tex(sentence)), sentence
    assert len({(e.place, e.printed) for e in ERRATA}) == len(ERRATA)


def test_the_list_is_sorted_by_kind():
    order = [KINDS.index(entry.kind) for entry in ERRATA]
    assert order == sorted(order)


@pytest.mark.parametrize("entry", NUMBERED, ids=lambda e: e.counterexample.__name__)
def test_the_truth_is_not_the_derived_form_itself(entry):
    """Two numbers that are worked out differently differ in a digit, but for simple ones."""
    found = entry.counterexample()
    if found.true == found.derived:
        true = float(found.true)
        assert true == float(Fraction(true).limit_denominator(100))


def test_the_sign_in_fr1_is_among_them():
    assert any(e.label == "fr1" and r"1 - z_0 + \alpha" in e.printed for e in ERRATA)


def test_an_entry_whose_print_is_right_does_not_hold():
    assert Evidence("q", {}, 2.0, 1.0, 1.0).holds()
    assert Evidence("q", {}, float("nan"), 1.0, 1.0).holds()
    assert not Evidence("q", {}, 1.0, 1.0, 1.0).holds()
    assert not Evidence("q", {}, 2.0, 1.0, 1.5).holds()


def test_every_counterexample_is_used():
    functions = {
        name
        for module in (evidence, evidence_text)
        for name, f in vars(module).items()
        if callable(f)
        and getattr(f, "__module__", "") == module.__name__
        and not name.startswith("_")
        and name not in ("Evidence", "barrier", "escape", "friction", "well_term")
    }
    assert functions == {e.counterexample.__name__ for e in NUMBERED}


def test_table_and_text():
    rows = table()
    assert len(rows) == len(ERRATA)
    assert sum("counterexample" in row for row in rows) == len(NUMBERED)
    shown = text()
    assert shown.count("\n   printed: ") == len(ERRATA)
    assert "a^+ = 1 - z_0 - α" in shown


def test_the_page_in_the_docs_is_todays():
    from pathlib import Path

    page = Path(__file__).parents[2] / "docs" / "errata.md"
    assert page.read_text(encoding="utf-8") == markdown(), "run python -m derivations.errata.page"
