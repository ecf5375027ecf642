"""The table of scenes is what it says it is."""

from __future__ import annotations

from fractions import Fraction

import pytest

import symasym as sa
from tests.problems import BY_NAME, KNOWN_WRONG, PROBLEMS, TAGS, Problem, answered, tagged

REGIONS = {"up", "down", "sliding", "repelling", "tangency"}
MADE = [p for p in PROBLEMS if "refused" not in p.tags]


def test_no_scene_is_known_to_be_silently_wrong() -> None:
    assert KNOWN_WRONG == []


def test_names_are_unique() -> None:
    assert len(BY_NAME) == len(PROBLEMS) >= 60


def test_every_tag_is_explained_and_used() -> None:
    assert {tag for p in PROBLEMS for tag in p.tags} == set(TAGS)


def test_every_kind_of_drift_stands_in_several_regions() -> None:
    for kind in ("friction", "linear", "sine", "tanh", "hill", "polynomial", "expression"):
        assert len(tagged(kind)) >= 2, kind
    for region in ("up", "down", "sliding", "repelling"):
        kinds = {t for p in tagged(region) for t in p.tags} & {"friction", "linear", "sine", "hill"}
        assert len(tagged(region)) >= 3, region
        assert kinds, region


@pytest.mark.parametrize("problem", PROBLEMS, ids=str)
def test_scene_parses_and_tags_agree_with_its_numbers(problem: Problem) -> None:
    kappa, r, start = (Fraction(x) for x in (problem.kappa, problem.r, problem.start))
    assert kappa > 0
    assert abs(start) < r
    tags = problem.tags
    assert len(tags & REGIONS) == 1
    assert ("small r" in tags) == (r < 1)
    assert ("strong" in tags) == (kappa > 2)
    assert ("stiff" in tags) == (kappa < Fraction(1, 1000))
    assert len(tags & {"weak", "moderate", "strong", "stiff"}) == 1
    if "start" in tags:
        assert 0 < abs(start) <= 1
    if "start outside" in tags:
        assert abs(start) > 1
    if "refused" in tags:
        assert problem.note


@pytest.mark.parametrize("problem", MADE, ids=str)
def test_region(problem: Problem) -> None:
    drift = problem.make()
    if problem.region == "tangency":
        with pytest.raises(sa.RegionError, match="a tangency"):
            _ = drift.region
        return
    assert drift.region == problem.region
    if problem.region == "crossing":
        assert (drift.ends[1] > 0) == ("up" in problem.tags)


@pytest.mark.parametrize("problem", MADE, ids=str)
def test_wells_are_as_tagged(problem: Problem) -> None:
    if "constant" in problem.tags or problem.tags & {"narrow"}:
        return
    points = problem.make().critical_points()
    wells = [p for p in points if p.kind == "well"]
    barriers = [p for p in points if p.kind == "barrier"]
    assert ("several wells" in problem.tags) == (len(wells) > 1)
    if "well" in problem.tags:
        assert wells
        assert barriers or problem.region == "tangency"


def test_closed_forms_are_there() -> None:
    assert sum(bool(p.closed) for p in answered()) >= 8
