"""The uniform formula of order 0 against exact times, and as code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symasym as sa


def function(target: str) -> Any:
    return sa.expand(sa.friction(), "T", noise="uniform").emit(target).load().f


@pytest.mark.parametrize("mu", [3.0, 9.0])
def test_friction_through_the_fold(mu: float) -> None:
    """One text on both sides of the fold, within 0.3 kappa^2 up to the end of the layer."""
    z0, of = np.linspace(-2, -0.001, 801), function("numpy")
    for kappa in (0.1, 0.2, 0.3):
        exact = sa.escape_time(sa.friction(mu=mu, alpha=1, z0=z0), kappa, 10, log=True)
        found = np.log(of(1.0, kappa, mu, 10.0, z0))
        assert np.abs(np.expm1(found - exact)).max() < 0.3 * kappa**2


def test_it_is_short() -> None:
    e = sa.expand(sa.friction(), "T", noise="uniform")
    assert len(e.definitions) <= 21
    assert len(e.conditions) == 5
    assert e.latex().count(r"\\") < 12
    assert e.bind(mu=3, alpha=1, z0="-0.4").evaluate("0.2", 10) == pytest.approx(1362.6, rel=1e-3)


def test_digits_at_the_fold() -> None:
    of = function("mpmath")
    import mpmath

    with mpmath.workdps(40):
        base = mpmath.mpf(-7) / 9
        values = [of(1, mpmath.mpf("0.1"), 3, 10, base + d) for d in (0, 1e-25, -1e-25)]
        assert max(abs(v / values[0] - 1) for v in values) < 1e-20
    assert float(values[0]) == pytest.approx(
        sa.escape_time(sa.friction(mu=3, alpha=1, z0="-7/9"), "0.1", 10), rel=1e-3
    )


@pytest.mark.parametrize(
    ("text", "start"),
    [("1 - 13/10*sin(pi*u)", 0), ("-1 - 13/10*sin(pi*u)", 0), ("u**2 + 1/50", -0.5)],
)
def test_other_drifts(text: str, start: float) -> None:
    """Of any bound drift the pair is found in numbers; a mirrored one has its barrier left."""
    drift = sa.Drift(text)
    e = sa.expand(drift, "T", noise="uniform", start=start)
    exact = sa.escape_time(drift, 0.2, 10, start=start)
    assert e.emit("numpy").load().f(0.2, 10.0) == pytest.approx(exact, rel=0.3 * 0.2**2 + 2e-3)


def test_what_has_no_formula_is_told() -> None:
    for ask in (
        lambda: sa.expand(sa.linear(), "T", noise="uniform"),
        lambda: sa.expand(sa.linear(1, 2), "T", noise="uniform"),
        lambda: sa.expand(sa.friction(), "C", noise="uniform"),
        lambda: sa.expand(sa.friction(), "T", noise="uniform", order=1),
    ):
        with pytest.raises(sa.InputError, match="uniform"):
            ask()
