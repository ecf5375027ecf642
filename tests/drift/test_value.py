"""A drift as a value: its repr makes it again, equal drifts are one key, and it can be drawn."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import sympy

import symasym as sa

mpl.use("agg")

READY_MADE: list[sa.Drift] = [
    sa.friction(3, 1, 0.1),
    sa.friction(mu=3),
    sa.friction(),
    sa.friction(3, [1.0, 2.0], [[-0.4], [1e-3]]),
    sa.linear(1, "-1/3"),
    sa.sine(1, 1, 4, waves=2),
    sa.sine(b="1e-30"),
    sa.tanh(1, -1, 5.5),
    sa.hill("1/3", 2, "1/5", n=12),
    sa.polynomial(1, "-0.4", 0, 2.5),
    sa.polynomial([1, 2], -1),
    sa.Drift("1/2 - u + b*u**3"),
    sa.Drift("exp(-x)*cos(2*x + a) - x/3", "x").bind(a=[0.5, 1.0]),
    sa.Drift(1 - 0.1 * sympy.Symbol("s", real=True), sympy.Symbol("s", real=True)),
]


def same(drift: sa.Drift) -> None:
    again: Any = eval(repr(drift), {"sa": sa})
    for other in (again, copy.deepcopy(drift), pickle.loads(pickle.dumps(drift))):
        assert other == drift
        assert hash(other) == hash(drift)
        assert type(other) is type(drift)
        assert repr(other) == repr(drift)


@pytest.mark.parametrize("drift", READY_MADE, ids=repr)
def test_repr_makes_the_drift(drift: sa.Drift) -> None:
    same(drift)


def test_equality() -> None:
    drift = sa.friction(3, 1, "-0.4")
    assert drift == sa.friction(z0="-2/5", alpha=1.0, mu=3) == sa.friction().bind(**drift.values)
    assert drift != sa.friction(3, 1, -0.4)
    assert drift != sa.friction(3, 1)
    assert drift != "friction"
    assert sa.sine(1, 1, 4) != sa.sine(1, 1, 4, waves=2)
    assert sa.linear([1, 2], -1) != sa.linear([[1, 2]], -1)
    assert len({drift, sa.friction(3, 1, "-0.4"), sa.friction(3, 1, 0)}) == 2
    assert sa.Drift("u - 1") == sa.Drift(sympy.Symbol("u", real=True) - 1) == sa.Drift("-1 + u")


def test_pictures() -> None:
    from matplotlib import pyplot

    drift = sa.sine(1, 1, 4, waves=2)
    figure, given_axes = pyplot.subplots(2)
    above, below = drift.plot(given_axes)
    assert (above, below) == tuple(given_axes)
    known = drift.critical_points()
    assert sorted(t.get_text() for t in below.texts) == sorted(
        f"{p.kind} at {float(p.u):.4g}" for p in known
    )
    for ax, values in ((above, drift), (below, drift.potential_at)):
        u, y = ax.lines[0].get_data()
        np.testing.assert_allclose(y, values(u))
    pyplot.close(figure)
    for call in (
        lambda: sa.linear([1, 2], -1).plot(),
        lambda: sa.linear(1).plot(),
    ):
        with pytest.raises(sa.InputError):
            call()
