"""The figures show what the functions give, at a few places of each curve."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import symasym as sa
from symasym.workshop.figures import FIGURES, encode
from symasym.workshop.style import BLUE, INK, RED

FOLD = -7 / 9  # of mu = 3


@cache
def drawn(name: str) -> Figure:
    return FIGURES[name]()


def curves(axes: Axes, **looks: Any) -> list[Any]:
    """The points (n, 2) of each line that is drawn with these looks."""
    return [
        np.asarray(line.get_xydata())
        for line in axes.get_lines()
        if all(getattr(line, f"get_{name}")() == value for name, value in looks.items())
    ]


def some(points: Any, count: int = 4) -> Any:
    """A few of the points, not those at the ends."""
    return points[np.linspace(0, len(points) - 1, count + 2, dtype=int)[1:-1]]


LONG = [pytest.mark.slow]


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("fil", [("$z$", "$y$")] * 2),
        ("flows", [("$z$", r"$u = y/\varepsilon$"), ("$z$", ""), ("$z$", "")]),
        ("potentialSketch", [("$u$", "$V(u)$"), ("$u$", ""), ("$u$", "")]),
        ("frictionOsc", [("", "")]),
        ("phase", [("$z$", "$y$")]),
        ("fricforce", [(r"$y/\varepsilon$", r"$\mathcal{F}(y)$")]),
        ("fric1", [("$z_0$", r"$\log T$")] * 2),
        pytest.param("fric2", [("$z_0$", r"$\log T$")], marks=LONG),
        pytest.param("stokes", [("", "$T$"), ("", ""), ("$z_0$", "relative error")], marks=LONG),
        pytest.param("release", [("$z$", "$u$"), ("$z$ at release", "density"),
                                 (r"$\kappa$ (scaled)", "mean time")], marks=LONG),
        pytest.param("regimes", [(r"$\varepsilon$", r"$\kappa_p$")], marks=LONG),
    ],
)  # fmt: skip
def test_axes_and_files(name: str, labels: list[tuple[str, str]]) -> None:
    figure = drawn(name)
    assert [(a.get_xlabel(), a.get_ylabel()) for a in figure.axes] == labels
    assert len(str(figure.get_label())) > 80
    svg = encode(figure, "svg")
    assert svg.startswith(b"<?xml")


def test_a_file_is_the_same_in_every_run() -> None:
    for kind in ("svg", "png", "pdf"):
        assert len({encode(FIGURES["frictionOsc"](), kind) for _ in range(2)}) == 1


def test_every_figure_is_in_the_tables() -> None:
    table = test_axes_and_files.pytestmark[0].args[1]
    assert {getattr(row, "values", row)[0] for row in table} == set(FIGURES)


# -- escape times ----------------------------------------------------------------------------------


def log_time(mu: Any, z0: float, kappa: Any, method: str = "exact") -> float:
    """In balls, the scaling written out: sqrt(eps) = 0.1, r/eps = 10."""
    dps = {"exact": {"dps": 20}}.get(method, {})
    drift = sa.friction(mu=mu, alpha=1, z0=z0)
    return float(sa.escape_time(drift, 10 * kappa, 10, method=method, log=True, **dps))


@pytest.mark.parametrize(
    ("name", "panel", "shapes"),
    [
        ("fric1", 0, [("3", k) for k in (0.01, 0.02, 0.05, 0.1)]),
        ("fric1", 1, [("1/2", k) for k in (0.01, 0.02, 0.05, 0.1)]),
        pytest.param("fric2", 0, [(mu, 0.01) for mu in ("1/2", "1", "2", "3")], marks=LONG),
    ],
)
def test_escape_times_against_z0(name: str, panel: int, shapes: list[tuple[str, float]]) -> None:
    """Solid the exact time; dotted the paper's formula, which jumps at the fold."""
    axes = drawn(name).axes[panel]
    exact = curves(axes, linewidth=2.4)
    assert len(exact) == len(shapes)
    # The curves stand in the order of their right ends.
    for points, (mu, kappa) in zip(
        sorted(exact, key=lambda c: c[-1, 1]),
        sorted(shapes, key=lambda s: log_time(s[0], -0.005, s[1])),
        strict=True,
    ):
        for z0, height in some(points):
            assert height == pytest.approx(log_time(mu, z0, kappa), rel=1e-9)
    formula = [c for c in curves(axes, linewidth=1.4) if len(c)]
    right = [c for c in formula if c[0, 0] > -1.9]
    folded = sorted((s for s in shapes if s[0] != "1/2"), key=lambda s: log_time(s[0], -0.01, s[1]))
    assert len(formula) == len(shapes) + len(folded)
    for points, (mu, kappa) in zip(sorted(right, key=lambda c: c[-1, 1]), folded, strict=True):
        for z0, height in some(points):
            assert height == pytest.approx(log_time(mu, z0, kappa, "paper"), rel=1e-9)
        shape = float(mu)
        fold = 1 - 2 * (1 + shape) ** 1.5 / (3 * np.sqrt(3 * shape))
        assert 0 < points[0, 0] - fold < 2e-4


@pytest.mark.slow
def test_stokes() -> None:
    times, shares, errors = drawn("stokes").axes
    named = {line.get_label(): np.asarray(line.get_xydata()) for line in times.get_lines()}
    for z0, time in some(named["exact"]):
        assert np.log(time) == pytest.approx(log_time(3, z0, 0.01), rel=1e-10)
    for z0, time in some(named["uniform, order 0"]):
        drift = sa.friction(3, 1, z0)
        assert time == pytest.approx(
            sa.escape_time(drift, 0.1, 10, method="uniform", order=0), rel=1e-8
        )
    (share,) = (c for c in curves(shares, linestyle="-") if len(c) > 50)
    assert (np.diff(share[:, 1]) >= 0).all()
    assert share[0, 1] < 0.01 < 0.99 < share[-1, 1]
    apart = {line.get_label(): np.asarray(line.get_xydata()) for line in errors.get_lines()}
    worst = [apart[f"uniform, order {n}"][:, 1].max() for n in range(3)]
    assert worst == sorted(worst, reverse=True)


# -- orbits ----------------------------------------------------------------------------------------


def along(path: Any, field: Any, most: float) -> bool:
    """Whether every step points as the field does in its middle."""
    steps, at = np.diff(path, axis=0), (path[1:] + path[:-1]) / 2
    z, y = at.T
    v = np.column_stack(field(z, y))
    size = np.hypot(*steps.T) * np.hypot(*v.T)
    kept = (size > 1e-6 * size.max()) & (np.abs(np.abs(y) - 1) > 0.05)  # a kink at the edge
    turned = steps[:, 0] * v[:, 1] - steps[:, 1] * v[:, 0]
    return bool((np.abs(turned[kept]) < most * size[kept]).all()
                and ((steps * v).sum(axis=1)[kept] > 0).all())  # fmt: skip


@pytest.mark.parametrize(("name", "panel"), [("fil", 0), ("fil", 1), ("phase", 0)])
def test_ideal_orbits_follow_the_field(name: str, panel: int) -> None:
    """Coulomb friction of strength 1, written out; a side has its colour."""
    axes = drawn(name).axes[panel]
    for color, side in ((BLUE, 1), (RED, -1)):
        paths = [c for c in curves(axes, color=color) if len(c) > 3]
        assert len(paths) >= 4
        for path in paths:
            assert (side * path[:, 1] > -1e-9).all()
            assert along(path, lambda z, y, s=side: (y - 1, 1 - z - y - s), 1e-3)


@pytest.mark.parametrize(("panel", "mu"), [(0, 0), (1, 0), (2, 3)])
def test_smoothed_orbits_follow_the_field(panel: int, mu: int) -> None:
    def field(z: Any, u: Any) -> tuple[Any, Any]:
        s = np.clip(u, -1, 1)
        return 0.1 * u - 1, (1 - z - s - mu * (s - s**3)) / 0.1 - u

    axes = drawn("flows").axes[panel]
    paths = [c for color in (BLUE, RED) for c in curves(axes, color=color) if len(c) > 3]
    assert len(paths) > 6
    assert all(along(path, field, 0.05) for path in paths)


# -- potential, force, machine ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("panel", "mu", "z0", "kinds"), [(0, 0, 1.0, "w"), (1, 0, -0.39, ""), (2, 3, -0.39, "wb")]
)
def test_potentials(panel: int, mu: int, z0: float, kinds: str) -> None:
    def potential(u: Any) -> Any:
        s = np.clip(u, -1, 1)
        inside = (1 - z0) * (s + 1) - (1 + mu) * (s**2 - 1) / 2 + mu * (s**4 - 1) / 4
        return -inside - (2 - z0) * np.minimum(u + 1, 0) + z0 * np.maximum(u - 1, 0)

    axes = drawn("potentialSketch").axes[panel]
    (height,) = curves(axes, color=BLUE)
    assert np.allclose(height[:, 1], potential(height[:, 0]), atol=1e-12)
    points = [line for line in axes.get_lines() if line.get_marker() == "o"]
    assert "".join("w" if p.get_markerfacecolor() == INK else "b" for p in points) == kinds
    for ((u, at),) in (p.get_xydata() for p in points):
        slope = 1 - z0 - (1 + mu) * u + mu * u**3
        assert (slope, at) == pytest.approx((0, potential(u)), abs=1e-12)


def test_the_force_law() -> None:
    (axes,) = drawn("fricforce").axes
    for mu, name in ((0, "0"), (0.5, "1/2"), (3, "3")):
        (line,) = (c for c in axes.get_lines() if c.get_label() == rf"$\mu = {name}$")
        u, force = line.get_xydata().T
        s = np.clip(u, -1, 1)
        assert np.allclose(force, s + mu * (s - s**3), atol=1e-14)
    (turning,) = curves(axes, marker="o")
    assert np.allclose(turning, [[-2 / 3, -16 / 9], [2 / 3, 16 / 9]])
    assert np.allclose(axes.get_yticks(), [-16 / 9, -1, 0, 1, 16 / 9])


def test_the_forces_on_the_sticking_block_add_up_to_zero() -> None:
    texts = [t.get_text().replace("−", "-").split() for t in drawn("frictionOsc").axes[0].texts]
    force = {t[0]: float(t[1]) for t in texts if len(t) == 2 and t[0] != "$z"}
    assert force == {"spring": -0.4, "damper": 1.0, "friction": -0.6}
    assert sum(force.values()) == pytest.approx(0)


# -- release ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_release_and_regimes() -> None:
    _, law, times = drawn("release").axes
    for line in law.get_lines()[:-1]:
        z, density = line.get_xydata().T
        assert np.trapezoid(density, z) == pytest.approx(1, abs=5e-3)
    moving = next(c for c in times.get_lines() if c.get_label() == "moving").get_xydata()
    frozen = next(c for c in times.get_lines() if to_hex(c.get_color()) == RED.lower())
    for kappa, time in some(frozen.get_xydata()[100:]):
        assert np.log(time) == pytest.approx(log_time(3, -0.4, kappa / 10), rel=1e-8)
    # Strong noise: z has no time to move; weak: the fold is reached first.
    assert moving[-1, 1] == pytest.approx(frozen.get_xydata()[-1, 1], rel=0.1)
    assert moving[0, 1] == pytest.approx((-0.4 - FOLD) / 0.01, rel=0.5)
    (axes,) = drawn("regimes").axes
    rings, squares = (np.concatenate(curves(axes, marker=m)) for m in "os")
    assert len(rings) > 1
    assert len(squares)
