"""The table of scenes is what it says it is."""

from __future__ import annotations

from fractions import Fraction

import pytest

from symasym.workshop.problems import BY_NAME, PROBLEMS

MADE = {p.name: p.make() for p in PROBLEMS if "refused" not in p.tags}


def test_every_kind_of_scene_is_there() -> None:
    assert len(BY_NAME) == len(PROBLEMS) >= 60
    assert sum(bool(p.closed) for p in PROBLEMS) >= 8
    ends = [drift.ends for drift in MADE.values()]
    for a, b in ((1, 1), (-1, -1), (1, -1), (-1, 1)):
        assert sum(a * low > 0 and b * high > 0 for low, high in ends) >= 3
    assert any(0 in pair for pair in ends)
    for low, high, most in ((0, "1e-3", 8), ("1e-3", "0.2", 8), ("0.2", 2, 8), (2, "1e9", 5)):
        assert sum(Fraction(low) < Fraction(p.kappa) <= Fraction(high) for p in PROBLEMS) >= most


@pytest.mark.parametrize("name", MADE)
def test_numbers_and_tags(name: str) -> None:
    problem, (low, high) = BY_NAME[name], MADE[name].ends
    assert abs(Fraction(problem.start)) < Fraction(problem.r)
    assert problem.slides == (low > 0 > high)
    if problem.slides:
        assert MADE[name].region == "sliding"
