"""Curves of quantities: the values and bands that the verbs give."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import symasym as sa

mpl.use("agg")
KAPPA = np.geomspace(0.1, 2, 7)
FRICTION = sa.friction(3, 1, "-0.4")


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    from matplotlib import pyplot

    yield
    pyplot.close("all")


def test_values_and_bands() -> None:
    ax = sa.plot("T", FRICTION, KAPPA, 10, method="strong_noise", order=4)
    (line,), (band,) = ax.lines, ax.collections
    estimate = sa.escape_time(FRICTION, KAPPA, 10, method="strong_noise", order=4, full=True)
    known = ~np.isnan(estimate.value)
    assert 0 < known.sum() < len(KAPPA)
    np.testing.assert_allclose(line.get_ydata(), estimate.value, rtol=1e-12)
    edge: Any = band.get_paths()[0].vertices
    for k in np.flatnonzero(known):
        own = edge[np.isclose(edge[:, 0], KAPPA[k]), 1]
        assert own.min() <= estimate.value[k] <= own.max()
    assert ax.get_yscale() == "linear" or estimate.value[known].max() > 100
    assert line.get_label() == "strong noise, order 4"


def test_every_quantity_and_abscissa() -> None:
    slide = sa.linear(1, -1)
    for quantity, drift, numbers, name in (
        ("T", FRICTION, {"kappa": KAPPA, "r": 10}, "κ"),
        ("T", sa.friction(3, 1, np.linspace(-1, 0, 5)), {"kappa": 1, "r": 10}, "z0"),
        ("C", slide, {"kappa": 1, "r": [1.0, 2.0, 3.0]}, "r"),
        ("1 - C", slide, {"kappa": 1, "r": 3, "start": [0, 1, 2]}, "start"),
        ("P", slide, {"kappa": KAPPA}, "κ"),
        ("1 - P", slide, {"kappa": KAPPA}, "κ"),
        ("p_ss", slide, {"kappa": 1, "y": [-1, 0, 1]}, "u"),
        ("T", sa.Drift("-u", layer=None), {"kappa": KAPPA, "ends": (-1, 2)}, "κ"),
    ):
        ax = sa.plot(quantity, drift, **numbers)  # type: ignore[arg-type]
        assert ax.get_xlabel() == name
        assert len(ax.lines) == 1
        assert np.isfinite(ax.lines[0].get_ydata()).all()


def test_axes_in_axes_out_and_values_beyond_floats() -> None:
    kappa = np.array([0.001, 0.01, 0.1])
    ax = sa.plot("T", FRICTION, kappa, 10)
    assert np.isnan(ax.lines[0].get_ydata()).tolist() == [True, True, False]
    assert sa.plot("T", FRICTION, [0.5, 1.0], 10, ax=ax, label="more") is ax
    assert ax.lines[1].get_label() == "more"
    ax = sa.plot("T", FRICTION, kappa, 10, log=True)
    exact = sa.escape_time(FRICTION, kappa, 10, log=True)
    np.testing.assert_allclose(ax.lines[0].get_ydata(), exact)
    assert ax.get_ylabel().startswith("log of")


def test_bad_input() -> None:
    for call in (
        lambda: sa.plot("t", FRICTION, KAPPA, 10),
        lambda: sa.plot("T", FRICTION, 1, 10),
        lambda: sa.plot("T", FRICTION, KAPPA, KAPPA),
        lambda: sa.plot("T", FRICTION, [[1, 2]], 10),
        lambda: sa.plot("T", "friction", KAPPA, 10),  # type: ignore[arg-type]
    ):
        with pytest.raises(sa.SymasymError):
            call()
