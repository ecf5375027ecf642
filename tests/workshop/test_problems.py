"""The table of scenes is what it says it is."""

from __future__ import annotations

from fractions import Fraction

import pytest

import symasym as sa
from symasym.workshop.problems import BY_NAME, PROBLEMS, TAGS, Problem, tagged


def test_the_table() -> None:
    assert len(BY_NAME) == len(PROBLEMS) >= 60
    assert {tag for p in PROBLEMS for tag in p.tags} == set(TAGS)
    for kind in ("friction", "linear", "sine", "tanh", "hill", "polynomial", "expression"):
        assert len(tagged(kind)) >= 2, kind
    assert sum(bool(p.closed) for p in PROBLEMS) >= 8


def test_tags_agree_with_the_numbers() -> None:
    for problem in PROBLEMS:
        kappa, r, start = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
        tags = problem.tags
        assert kappa > 0
        assert abs(start) < r
        assert len(tags & {"up", "down", "sliding", "repelling", "tangency"}) == 1
        assert len(tags & {"weak", "moderate", "strong", "stiff"}) == 1
        assert ("small r" in tags) == (r < 1)
        assert ("strong" in tags) == (kappa > 2)
        assert ("stiff" in tags) == (kappa < Fraction(1, 1000))
        assert ("start outside" in tags) <= (abs(start) > 1)
        assert ("start" in tags) <= (0 < abs(start) <= 1)
        assert ("refused" in tags) <= bool(problem.note)


@pytest.mark.parametrize("problem", [p for p in PROBLEMS if "refused" not in p.tags], ids=str)
def test_region_and_wells(problem: Problem) -> None:
    drift, tags = problem.make(), problem.tags
    if "tangency" in tags:
        with pytest.raises(sa.RegionError):
            _ = drift.region
        return
    assert drift.region == problem.region
    if problem.region == "crossing":
        assert (drift.ends[1] > 0) == ("up" in tags)
    if not tags & {"constant", "narrow"}:
        kinds = [p.kind for p in drift.critical_points()]
        assert ("several wells" in tags) == (kinds.count("well") > 1)
        assert ("well" in tags) <= ("well" in kinds and "barrier" in kinds)
