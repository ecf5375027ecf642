"""The schematic figures hold what the model gives: fields, orbits, potential, force."""

from __future__ import annotations

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

import symasym as sa
from symasym.workshop import figures
from symasym.workshop.figures.flows import filippov


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    return {
        "fil": figures.fil(),
        "flows": figures.flows(),
        "phase": figures.phase(alpha="3/4"),
        "fricforce": figures.fricforce(alpha=2),
        "potentialSketch": figures.potential_sketch(),
    }


def lines(axes: mpl.axes.Axes, start: str) -> list[np.ndarray]:
    """The drawn points of every line whose name begins with `start`."""
    found = [line for line in axes.get_lines() if str(line.get_gid()).startswith(start)]
    return [np.asarray(line.get_xydata()) for line in found]


def arrows(axes: mpl.axes.Axes, start: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Foot and head of every arrow whose name begins with `start`."""
    found = [text for text in axes.texts if str(text.get_gid()).startswith(start)]
    return [(np.asarray(text.xyann), np.asarray(text.xy)) for text in found]


def ideal(points: np.ndarray, side: int, alpha: float) -> np.ndarray:
    """(z', y') under Coulomb friction, written out."""
    z, y = points.T
    return np.column_stack([y - 1, 1 - z - y - side * alpha])


def assert_along(steps: np.ndarray, field: np.ndarray, tolerance: float) -> None:
    """Every step points as the field does."""
    sine = steps[:, 0] * field[:, 1] - steps[:, 1] * field[:, 0]
    size = np.hypot(*steps.T) * np.hypot(*field.T)
    kept = size > 1e-9 * size.max()
    assert np.all(np.abs(sine[kept]) < tolerance * size[kept])
    assert np.all((steps * field).sum(axis=1)[kept] > 0)


# -- Filippov's orbits: fil and phase ----------------------------------------------------------


@pytest.mark.parametrize(("name", "alpha"), [("fil", 1.0), ("phase", 0.75)])
def test_ideal_orbits_follow_the_field(drawn: dict[str, Figure], name: str, alpha: float) -> None:
    for axes in drawn[name].axes:
        for side in (1, -1):
            paths = lines(axes, f"slip{side:+d}")
            assert paths
            for path in paths:
                assert np.all(side * path[:, 1] > -1e-12)
                middle = (path[1:] + path[:-1]) / 2
                assert_along(np.diff(path, axis=0), ideal(middle, side, alpha), 1e-3)
            for foot, head in arrows(axes, f"along{side:+d}"):
                at = ((foot + head) / 2)[None]
                assert_along((head - foot)[None], ideal(at, side, alpha), 0.1)


def test_fil_slides_and_crosses(drawn: dict[str, Figure]) -> None:
    sliding, crossing = drawn["fil"].axes
    for axes, region in ((sliding, "sliding"), (crossing, "crossing")):
        (surface,) = lines(axes, region)
        np.testing.assert_array_equal(surface[:, 1], 0)
        for z in surface[:, 0] + [1e-9, -1e-9]:
            assert sa.friction(mu=0, alpha=1, z0=float(z)).region == region
    # What comes to the surface stays there in (i) and goes on in (ii).
    above = {tuple(path[0].round(9)) for path in lines(crossing, "slip+1")}
    landed = {tuple(path[-1].round(9)) for path in lines(crossing, "slip-1")}
    assert above == landed
    assert all(path[-1, 1] == 0 for path in lines(sliding, "slip+1") if path[-1, 0] > 0.26)
    assert not any(path[0, 1] == 0 and path[0, 0] > 0.25 for path in lines(sliding, "slip"))


def test_the_sliding_vector_is_the_tangent_combination(drawn: dict[str, Figure]) -> None:
    axes = drawn["fil"].axes[0]
    steps = {}
    for name in ("f+1", "f-1", "sliding-vector"):
        ((foot, head),) = arrows(axes, name)
        steps[name] = head - foot
        np.testing.assert_allclose(foot, [1, 0])
    for side in (1, -1):
        assert_along(steps[f"f{side:+d}"][None], ideal(np.array([[1.0, 0.0]]), side, 1.0), 1e-9)
    reduced = sa.reduce(
        ("1 - z - y + 1", "y - 1"),
        ("1 - z - y - 1", "y - 1"),
        ("1 - z - y - s", "y - 1"),
        ((1,), (0,)),
        ("y", "z"),
        at={"z": 1},
    )
    across, along = (float(x) for x in reduced.sliding_at({"z": 1, "y": 0}))
    unit = np.hypot(*steps["f+1"]) / np.hypot(-1, -1)
    np.testing.assert_allclose(steps["sliding-vector"], unit * np.array([along, across]))
    share = (steps["sliding-vector"] - steps["f-1"]) / (steps["f+1"] - steps["f-1"] + 1e-300)
    assert 0 < share[1] < 1


def test_phase_has_the_regions_the_sliding_field_and_the_rest_point(
    drawn: dict[str, Figure],
) -> None:
    (axes,) = drawn["phase"].axes
    ((left, right),) = [piece[:, 0] for piece in lines(axes, "sliding")]
    assert (left, right) == (0.25, 1.75)
    assert len(lines(axes, "crossing")) == 2
    field = arrows(axes, "sliding-field")
    assert len(field) == 3
    for foot, head in field:
        assert left < head[0] < foot[0] < right
        assert foot[1] == head[1] == 0
    (rest,) = lines(axes, "rest")
    np.testing.assert_allclose(ideal(rest, 1, 0.75), 0, atol=1e-15)
    # All that slips in y > 0 for long ends there; the last orbit drawn leaves the sliding's end.
    assert sum(np.hypot(*(path[-1] - rest[0])) < 1e-3 for path in lines(axes, "slip+1")) > 5
    np.testing.assert_allclose(lines(axes, "slip+1")[-1][0], [0.25, 0], atol=1e-15)


@pytest.mark.parametrize(("z", "y"), [(1.2, -2.0), (-2.0, -2.0), (3.0, -0.5), (2.5, 1.5)])
def test_orbits_against_another_integrator(z: float, y: float) -> None:
    pieces = filippov(z, y, 1.0, 12.0)
    for piece, after in pairwise(pieces):
        np.testing.assert_allclose(piece.path[-1], after.path[0], atol=1e-12)
        if piece.kind == "stick":
            np.testing.assert_allclose(piece.path[-1], [0, 0], atol=1e-12)
    for piece in pieces:
        if piece.kind == "stick":
            continue
        side = int(np.sign(piece.path[1, 1]))

        def hit(_: float, at: np.ndarray, side: int = side) -> float:
            return side * at[1] + 1e-9

        hit.terminal, hit.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(
            lambda _, at, side=side: ideal(at[None], side, 1.0)[0],
            (0, 12),
            piece.path[0],
            rtol=1e-10,
            atol=1e-12,
            events=hit,
        )
        if piece.path[-1, 1] == 0:
            np.testing.assert_allclose(found.y[:, -1], piece.path[-1], atol=1e-7)


# -- smoothed orbits: flows ----------------------------------------------------------------------


def test_smoothed_orbits_against_another_integrator(drawn: dict[str, Figure]) -> None:
    for axes, mu in zip(drawn["flows"].axes, (0, 0, 3), strict=True):
        paths = lines(axes, "orbit-")
        assert len(paths) > 6
        for path in paths[::3]:
            # z falls all the way, so that it can stand for the time.
            assert np.all(np.diff(path[:, 0]) < 0)

            def slope(z: float, u: np.ndarray, mu: int = mu) -> np.ndarray:
                s = np.clip(u, -1, 1)
                return ((1 - z - s - mu * (s - s**3)) / 0.1 - u) / (0.1 * u - 1)

            found = solve_ivp(
                slope,
                path[[0, -1], 0],
                path[:1, 1],
                t_eval=path[:, 0],
                rtol=1e-9,
                atol=1e-11,
                method="LSODA",
            )
            # A step across the layer's edge, where the field has a kink, is of order 2; a
            # pixel is 0.015.
            np.testing.assert_allclose(found.y[0], path[:, 1], atol=5e-4)


def test_the_slow_manifold(drawn: dict[str, Figure]) -> None:
    """u0 + eps u1 along the zero u0 of the drift, and an orbit itself, to either side of it."""
    eps, counts = 0.1, []
    for axes, mu in zip(drawn["flows"].axes, (0, 0, 3), strict=True):
        found = {kind: lines(axes, f"slow-{kind}") for kind in ("attracting", "repelling")}
        counts.append([len(paths) for paths in found.values()])
        for kind, paths in found.items():
            for z, u in np.concatenate(paths)[20:-20] if paths else []:
                roots = np.roots([mu, 0, -(1 + mu), 1 - z]) if mu else np.array([1 - z])
                roots = roots[np.abs(roots.imag) < 1e-9].real
                zero = roots[np.abs(roots - u).argmin()]
                slope = -(1 + mu) + 3 * mu * zero**2
                assert (slope < 0) == (kind == "attracting")
                # eps u' = A(u) - z - eps u with z' = -1 + eps u, to the first order in eps.
                first = (zero - 1 / slope) / slope
                if abs(slope) > 2 or not mu:
                    assert abs(u - zero - eps * first) < 6 * eps**2
                    assert abs(u - zero) > 0.3 * eps * abs(first)
    assert counts == [[1, 0], [0, 0], [1, 1]]
    (fold,) = lines(drawn["flows"].axes[2], "fold")
    np.testing.assert_allclose(fold, [[-7 / 9, 2 / 3]])


def test_only_the_cubic_holds_orbits_in_the_layer(drawn: dict[str, Figure]) -> None:
    _, linear, cubic = drawn["flows"].axes

    def left_at(axes: mpl.axes.Axes) -> list[float]:
        """Where orbits that came from below between the fold and the edge leave the layer."""
        found = []
        for path in lines(axes, "orbit-"):
            entered = np.flatnonzero(path[:, 1] > -1)
            if path[0, 1] == -3 and -0.75 < path[entered[0], 0] < -0.2:
                found.append(float(path[path[:, 1] < 1][-1, 0]))
        return found

    assert len(left_at(cubic)) >= 2
    assert all(z < -7 / 9 for z in left_at(cubic))
    assert sum(z > -7 / 9 for z in left_at(linear)) >= 2


# -- potential and force ---------------------------------------------------------------------------


def potential(u: np.ndarray, mu: float, z0: float) -> np.ndarray:
    """V of the friction drift with alpha = 1, integrated by hand."""
    s = np.clip(u, -1, 1)
    inside = (1 - z0) * (s + 1) - (1 + mu) * (s**2 - 1) / 2 + mu * (s**4 - 1) / 4
    return -inside - (2 - z0) * np.minimum(u + 1, 0) - (-z0) * np.maximum(u - 1, 0)


def test_potentials(drawn: dict[str, Figure]) -> None:
    cases = ((0, 1.0), (0, -0.39), (3, -0.39))
    counts = []
    for axes, (mu, z0) in zip(drawn["potentialSketch"].axes, cases, strict=True):
        ((u, height),) = [points.T for points in lines(axes, "potential")]
        assert (u[0], u[-1]) == (-2.5, 2.5)
        np.testing.assert_allclose(height, potential(u, mu, z0), atol=1e-12)
        roots = np.roots([mu, 0, -(1 + mu), 1 - z0]) if mu else np.array([1 - z0])
        roots = np.sort(roots[(abs(roots.imag) < 1e-9) & (abs(roots) < 1)].real)
        marked = {kind: lines(axes, kind) for kind in ("well", "barrier")}
        counts.append([len(points) for points in marked.values()])
        places = np.concatenate([*marked["well"], *marked["barrier"], np.empty((0, 2))])
        np.testing.assert_allclose(places[:, 0], roots, atol=1e-12)
        np.testing.assert_allclose(places[:, 1], potential(roots, mu, z0), atol=1e-12)
    assert counts == [[1, 0], [0, 0], [1, 1]]


def test_the_force_law(drawn: dict[str, Figure]) -> None:
    (axes,) = drawn["fricforce"].axes
    for name, mu in (("0", 0.0), ("1-over-2", 0.5), ("3", 3.0)):
        ((u, force),) = [points.T for points in lines(axes, f"force-mu-{name}")]
        s = np.clip(u, -1, 1)
        np.testing.assert_allclose(force, 2 * (s + mu * (s - s**3)), atol=1e-14)
    (turning,) = lines(axes, "turning")
    beta = 2 * 2 * 4**1.5 / (3 * np.sqrt(9))
    np.testing.assert_allclose(turning, [[-2 / 3, -beta], [2 / 3, beta]])
    labels = {
        text.get_text(): y
        for y, text in zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)
    }
    assert labels[r"$\alpha$"] == 2
    assert labels[r"$\beta$"] == pytest.approx(beta)


@pytest.mark.parametrize("z", ["2/5", "-0.4", "1.5", "0", "1"])
def test_the_forces_on_the_sticking_block(z: str) -> None:
    (axes,) = figures.friction_osc(z=z).axes
    extension = float(sa.friction(mu=3, alpha=1, z0=z).values["z0"])
    sizes = {}
    for name in ("spring", "damper", "friction"):
        found = arrows(axes, name)
        assert all(foot[1] == head[1] for foot, head in found)
        sizes[name] = sum(float(head[0] - foot[0]) for foot, head in found)
    assert sum(sizes.values()) == pytest.approx(0, abs=1e-12)
    assert sizes["spring"] / sizes["damper"] == pytest.approx(-extension)
    (block,) = [patch for patch in axes.patches if patch.get_gid() == "block"]
    (coil,) = lines(axes, "spring-coil")
    assert coil[-1, 0] == block.get_x() == pytest.approx(min(extension, 1.2))


# -- what is refused -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "values", "told"),
    [
        ("fil", {"alpha": 0}, "alpha is 0"),
        ("phase", {"alpha": "-1"}, "alpha is -1"),
        ("flows", {"mu": "1/2"}, "mu is 0.5; give more than 1/2"),
        ("flows", {"eps": "0.6"}, "eps is 0.6; give 0.005 to 0.5"),
        ("flows", {"eps": "0.01", "mu": 50}, "eps is 0.01, too thin a layer"),
        ("potentialSketch", {"sliding": "-0.4"}, "sliding is -0.4, where the drift is crossing"),
        ("potentialSketch", {"crossing": 1}, "crossing is 1, where the drift is sliding"),
        ("potentialSketch", {"mu": 0}, "mu is 0"),
        ("fricforce", {"mu": [1, 2, 3, 4, 5]}, "mu has 5 values"),
        ("fricforce", {"mu": -1}, "mu is -1"),
        ("frictionOsc", {"z": -1}, "z is -1, where the block slips; give -0.7778 to 2.778"),
        ("fric1", {"points": 1}, "points is 1"),
        ("fric1", {"kappa": []}, "kappa has 0 values"),
        ("fric2", {"kappa": 0}, "kappa is 0"),
    ],
)
def test_bad_parameters(name: str, values: dict[str, object], told: str) -> None:
    with pytest.raises(sa.SymasymError) as caught:
        figures.FIGURES[name](**values)
    assert told in str(caught.value)
