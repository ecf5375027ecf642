"""The figures show what the functions give."""

from __future__ import annotations

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import symasym as sa
from symasym.workshop import figures
from symasym.workshop.figures import escape_times

POINTS = 25


@pytest.fixture(scope="module")
def fric1() -> Figure:
    return figures.fric1(POINTS)


@pytest.fixture(scope="module")
def fric2() -> Figure:
    return figures.fric2(POINTS)


def lines(axes: mpl.axes.Axes, start: str) -> dict[str, np.ndarray]:
    """The drawn points of every line whose name begins with `start`."""
    found = {}
    for line in axes.get_lines():
        name = str(line.get_gid())
        if name.startswith(start):
            found[name.removeprefix(start)] = np.asarray(line.get_xydata())
    return found


def log_time(mu: str, z0: np.ndarray, kappa: float, method: str) -> np.ndarray:
    """Straight from the verb, with the scaling written out: sqrt(eps) = 0.1, r/eps = 10."""
    drift = sa.friction(mu=mu, alpha=1, z0=z0)
    return np.asarray(sa.escape_time(drift, kappa / 0.1, 10, method=method, log=True))


def test_fric1_has_every_exact_curve(fric1: Figure) -> None:
    for axes, mu, name in zip(fric1.axes, ("3", "1/2"), ("mu-3", "mu-1-over-2"), strict=True):
        drawn = lines(axes, "exact-")
        assert set(drawn) == {f"{name}-kappa-{kappa}" for kappa in ("0.01", "0.02", "0.05", "0.1")}
        for label, points in drawn.items():
            assert points[0, 0] == -2
            assert np.all(points[:, 0] < 0)
            wanted = log_time(mu, points[:, 0], float(label.rpartition("-")[2]), "exact")
            np.testing.assert_allclose(points[:, 1], wanted, rtol=1e-11)


def test_fric2_has_four_shapes_at_small_noise(fric2: Figure) -> None:
    drawn = lines(fric2.axes[0], "exact-mu-")
    assert set(drawn) == {f"{mu}-kappa-0.01" for mu in ("1-over-2", "1", "2", "3")}
    for label, points in drawn.items():
        mu = label.removesuffix("-kappa-0.01").replace("-over-", "/")
        np.testing.assert_allclose(
            points[:, 1], log_time(mu, points[:, 0], 0.01, "exact"), rtol=1e-11
        )


def test_the_asymptotic_curves_stop_at_the_fold(fric2: Figure) -> None:
    left = lines(fric2.axes[0], "asymptotic-left-mu-")
    right = lines(fric2.axes[0], "asymptotic-right-mu-")
    assert set(left) - set(right) == {"1/2".replace("/", "-over-") + "-kappa-0.01"}
    for label, points in right.items():
        mu = float(label.partition("-")[0])
        fold = 1 - 2 * (1 + mu) ** 1.5 / (3 * np.sqrt(3 * mu))
        assert left[label][-1, 0] < fold < points[0, 0]
        assert points[0, 0] - left[label][-1, 0] < 2e-4
        # No well on the left, r/a+ alone; a well on the right, so that the curve jumps up.
        np.testing.assert_allclose(left[label][:, 1], np.log(10 / -left[label][:, 0]), rtol=1e-12)
        assert points[0, 1] > left[label][-1, 1] + 0.5
        np.testing.assert_allclose(
            points[:, 1], log_time(str(int(mu)), points[:, 0], 0.01, "paper"), rtol=1e-12
        )


def test_the_inset_magnifies_the_fold(fric1: Figure) -> None:
    (inset,) = fric1.axes[0].child_axes
    low, high = inset.get_xlim()
    assert low < -7 / 9 < high
    assert set(lines(inset, "exact-inset-")) == set(lines(fric1.axes[0], "exact-"))
    assert np.isclose(inset.get_xticks(), -7 / 9, rtol=1e-15).any()


def test_between_points_a_curve_is_the_polynomial_of_the_nearest_six() -> None:
    at, wanted = np.linspace(-1.0, 2.0, 9), np.linspace(-1.0, 2.0, 100)
    quintic = np.polynomial.Polynomial([0.3, -1.0, 0.5, 2.0, -0.7, 0.2])
    assert escape_times._between(at, quintic(at), wanted) == pytest.approx(quintic(wanted))
    # A function with no more than six points in view: the error of degree 5, everywhere.
    missed = escape_times._between(at, np.exp(at), wanted) - np.exp(wanted)
    assert 1e-8 < np.abs(missed).max() < 3e-4


def test_curves_are_labelled_directly_and_apart(fric1: Figure, fric2: Figure) -> None:
    for axes in (*fric1.axes, *fric2.axes):
        labels = [
            text for text in axes.texts if "=" in text.get_text() and text.get_color() != "0.1"
        ]
        assert len(labels) == 4
        heights = sorted(text.xyann[1] for text in labels)
        assert min(np.diff(heights)) > 0.06


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_pixels_and_paths_are_the_same_in_every_run(kind: str) -> None:
    first = figures.encode(figures.fric2(POINTS), kind)
    with mpl.rc_context({"font.size": 30, "savefig.dpi": 10}):
        assert figures.encode(figures.fric2(POINTS), kind) == first


def test_drawing_leaves_matplotlib_as_it_was() -> None:
    code = (
        "import sys, matplotlib as m; before = m.rcParams.copy()\n"
        "from symasym.workshop import figures; figures.encode(figures.fric2(5), 'png')\n"
        "assert m.rcParams.copy() == before\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
