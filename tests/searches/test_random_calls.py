"""A sample of the random calls, and that what is looked for would be found."""

from __future__ import annotations

import random

import pytest

from tests.searches import random_calls
from tests.searches.random_calls import CALLS, main, outcome_of, random_call


@pytest.mark.parametrize("count", [100, pytest.param(60_000, marks=pytest.mark.slow)])
def test_every_call_ends_in_an_answer_or_a_sentence(count: int) -> None:
    printed: list[str] = []
    counts = main(count, seed=7, report=printed.append)
    assert (counts["bare"], counts["late"]) == (0, 0), "\n".join(printed)
    assert counts["answer"] > count / 4
    assert counts["InputError"] > 0


def test_every_verb_is_called() -> None:
    draw = random.Random(1)
    calls = [random_call(draw) for _ in range(600)]
    assert {call.partition("(")[0] for call in calls} == {f"sa.{verb}" for verb in CALLS}


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        ("sa.escape_time(sa.linear(1, 1), 1, 2)", "answer"),
        ("sa.escape_time(sa.linear(1, 1), 0, 2)", "InputError"),
        ("sa.escape_time()", "bare"),
        ("__import__('os')", "bare"),  # no name that a call may use
        ("sa.tanh(1, -1, '1.4').__class__", "bare"),
        (
            "sa.occupation(sa.tanh(1, -1, '1.4'), '1e-60', dps=400, log=True, patience=math.inf)",
            "late",
        ),
    ],
)
def test_how_a_call_ends(call: str, kind: str) -> None:
    outcome = outcome_of(call, late=0.3)
    assert outcome.kind == kind
    assert random_calls.LATE >= 2 * random_calls.PATIENCE
