"""Every slip: the derived form agrees with the truth, the printed one does not."""

from __future__ import annotations

import pytest

from derivations import evidence, evidence_text
from derivations.errata import ERRATA, KINDS, table
from derivations.errata_page import markdown, text
from derivations.evidence import Evidence
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
        assert all((entry.label, entry.printed, entry.derived, entry.affects))
        # Only a contradiction between two places of the text needs no number.
        assert entry.counterexample is not None or entry.kind == "text"
    assert len({(e.label, e.printed) for e in ERRATA}) == len(ERRATA)


def test_the_sign_in_fr1_is_among_them():
    assert any(e.label == "fr1" and "1 - z0 + alpha" in e.printed for e in ERRATA)


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
    assert "1 - z0 - alpha" in shown


def test_the_page_in_the_docs_is_todays():
    from pathlib import Path

    page = Path(__file__).parents[2] / "docs" / "errata.md"
    assert page.read_text(encoding="utf-8") == markdown(), "run python -m derivations.errata_page"
