"""A second question about equal drifts costs no second analysis."""

from __future__ import annotations

from typing import Any

import pytest

import symasym as sa
from symasym.expansions import uniform, weak

TEXT = "a - b*u + exp(-c*u)*tanh(3*u)"


def drift(**more: Any) -> sa.Drift:
    return sa.Drift(TEXT).bind(**{"a": "0.31", "b": "2.5", "c": "0.7", **more})


@pytest.mark.parametrize(
    ("module", "name", "ask"),
    [
        (
            weak,
            "points_of",
            lambda d, k: sa.escape_time(d, k, 2, method="laplace", log=True),
        ),
        (
            uniform,
            "Field",
            lambda d, k: sa.escape_time(d, k, 2, method="uniform", order=1, log=True),
        ),
    ],
)
def test_once(monkeypatch: pytest.MonkeyPatch, module: Any, name: str, ask: Any) -> None:
    asked, analysis = [], getattr(module, name)

    def counted(*args: Any, **kwargs: Any) -> Any:
        asked.append(args)
        return analysis(*args, **kwargs)

    monkeypatch.setattr(module, name, counted)
    # A drift that no other test has.
    a = f"0.31{id(name) % 997 + 1}"
    first = ask(drift(a=a), "0.02")
    count = len(asked)
    assert count
    assert ask(drift(a=a), "0.02") == first
    ask(drift(a=a), "0.021")
    assert len(asked) == count
    ask(drift(a=a, b="2.6"), "0.02")
    assert len(asked) > count


def test_values_are_kept_by_name() -> None:
    # The same numbers in the same order, for other parameters.
    one = sa.Drift("a - b*u + exp(-u)").bind(a=1, b="2.5")
    other = sa.Drift("a - b*u + exp(-u)").bind(b=1, a="2.5")
    for d in (one, other):
        exact = float(sa.escape_time(d, "0.005", 2, log=True, dps=15))
        assert sa.escape_time(d, "0.005", 2, log=True) == pytest.approx(exact, rel=1e-12)
