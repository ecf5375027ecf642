"""What several modules of tests ask for."""

from __future__ import annotations

from typing import Any

import pytest

from symasym.asymptotics.uniform import answer as uniform_noise
from symasym.asymptotics.uniform import sums
from symasym.asymptotics.uniform.gaussian_cut import Cuts


@pytest.fixture
def as_in_float(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes with more digits leave out what arrays leave out: the start, and wells at the ends."""
    every, corrected = uniform_noise.cuts_of, sums.corrected

    def fewer(*given: Any) -> Cuts:
        found = every(*given)
        left, right = ([c for c in cuts if c.barrier] for cuts in (found.left, found.right))
        return Cuts(left, [], right)

    def alone(cuts: Any, met: Any, *rest: Any) -> Any:
        return corrected(cuts, [], *rest)

    monkeypatch.setattr(uniform_noise, "cuts_of", fewer)
    monkeypatch.setattr(sums, "corrected", alone)
    monkeypatch.setattr(sums, "_beyond", lambda *_: 0)
