"""What several modules of tests ask for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from symasym.asymptotics.uniform import answer as uniform_noise
from symasym.asymptotics.uniform.truncated_gaussian import Truncations
from symasym.base.call_context import limited


@pytest.fixture
def as_in_float(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes with more digits leave out what arrays leave out: the start, and wells at the ends."""
    every, corrected = uniform_noise.truncations_of, uniform_noise.corrected

    def fewer(*given: Any) -> Truncations:
        found = every(*given)
        left, right = (
            [c for c in truncations if c.barrier] for truncations in (found.left, found.right)
        )
        return Truncations(left, [], right)

    def alone(truncations: Any, met: Any, *rest: Any) -> Any:
        return corrected(truncations, [], *rest)

    monkeypatch.setattr(uniform_noise, "truncations_of", fewer)
    monkeypatch.setattr(uniform_noise, "corrected", alone)
    monkeypatch.setattr(uniform_noise, "_beyond", lambda *_: 0)


@pytest.fixture(autouse=True)
def _unhurried() -> Iterator[None]:
    """Tests compare numbers, not machines: those of `patience` set their own."""
    with limited(math.inf):
        yield
