"""The files that one call enters."""

from __future__ import annotations

from symasym.workshop.entered import calls, entered


def test_a_number_and_an_array_enter_the_same_files() -> None:
    files = {call.name: set(entered(call.ask)) for call in calls()}
    assert "expansions/weak.py" in files["laplace, float"] & files["laplace, array"]
    assert files["laplace, float"] != files["uniform, order 0"]
