"""The explorer's functions, as the page has them, by Node: its numbers are those of Python."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import symasym as sa
from symasym.base.errors import InputError, RegionError

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
from website import explorer  # noqa: E402

NAMES = ("mu", "alpha", "z0", "kappa", "eps", "r")
# As the sliders show them: both crossings, with and without a well; sliding; weak and strong noise.
POSITIONS = [
    ("3.00", "1.00", "-0.40", "0.030", "0.010", "0.10"),
    ("3.00", "1.00", "-0.80", "0.030", "0.010", "0.10"),
    ("3.00", "1.00", "-0.77", "0.0030", "0.020", "1.0"),
    ("5.00", "1.50", "-0.70", "0.0030", "0.020", "0.10"),
    ("0.30", "0.75", "-1.50", "0.10", "0.0010", "0.050"),
    ("0.00", "1.00", "-1.00", "0.030", "0.010", "0.10"),
    ("5.00", "1.50", "2.90", "0.020", "0.0050", "0.20"),
    ("3.00", "1.00", "4.00", "0.030", "0.010", "0.10"),
    ("3.00", "1.00", "0.50", "0.030", "0.010", "0.10"),
    ("5.00", "0.50", "1.00", "0.0030", "0.020", "0.10"),
    ("0.50", "1.25", "2.20", "0.10", "0.0010", "0.10"),
]
# Where z0 crosses, up to the tangencies.
CROSSINGS = ((-3, 1), (1, 5))
TANGENCY = ("3.00", "0.70", "0.30", "0.030", "0.010", "0.10")
CORNERS = list(
    product(
        ("0", "5"), ("0.25", "1.5"), ("-3", "5"), ("0.003", "0.1"), ("0.001", "0.02"), ("0.05", "1")
    )
)
FOLD = ("3.00", "0.90", "-0.60", "0.030", "0.010", "0.10")
_MAIN = """
const { positions, exact } = JSON.parse(require("fs").readFileSync(0));
const wanted = new Set(exact);
const found = positions.map((s, k) => ({
  ...numbers(s), ...landscape(s), density: density(s), against: againstSpring(s),
  exact: wanted.has(k) ? [...exactAgainstAxis(s, "z0")].pop() ?? [] : null,
}));
console.log(JSON.stringify(found));
"""


@pytest.fixture(scope="module")
def shown(tmp_path_factory) -> dict:
    """Position -> what the page computes there."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no Node on this machine")
    model = (ROOT / "docs" / "_static" / "explorer" / "model.js").read_text("utf-8")
    asked = [*POSITIONS, *CORNERS, TANGENCY, FOLD]
    sliders = [dict(zip(NAMES, map(float, p), strict=True)) for p in asked]
    # Not as an argument: what one may hold is limited.
    script = tmp_path_factory.mktemp("explorer") / "page.js"
    script.write_text(explorer.formulas() + model + _MAIN, "utf-8")
    done = subprocess.run(
        [node, str(script)],
        input=json.dumps({"positions": sliders, "exact": [0, 1, 2, 4]}),
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return dict(zip(asked, json.loads(done.stdout), strict=True))


def _scene(position: tuple[str, ...]):
    mu, alpha, z0, kappa, eps, r = position
    return sa.friction(mu, alpha, z0), sa.rescale(eps=eps, kappa=kappa, r=r)


def test_the_way_to_the_fold_is_the_drag_time(shown) -> None:
    ways = 0
    for position in POSITIONS:
        drift, _ = _scene(position)
        mu, alpha, z0, _, eps, _ = position
        fold = drift.folds().z0
        way = shown[position]["wayToFold"]
        if not fold[0] < float(z0) < fold[1]:
            assert way is None
            continue
        assert way == pytest.approx((float(z0) - fold[0]) / float(eps), rel=1e-12)
        if float(z0) < 1 - float(alpha):
            block = sa.oscillator(mu=mu, alpha=alpha)
            assert way == pytest.approx(block.drag_time(z0, eps), rel=1e-5)
            ways += 1
    assert ways >= 3


@pytest.mark.parametrize("position", POSITIONS, ids=" ".join)
def test_numbers_are_those_of_python(shown, position) -> None:
    drift, scales = _scene(position)
    found = shown[position]
    kappa, r = float(scales.kappa), float(scales.r)
    assert found["region"] == drift.region
    assert [found["aMinus"], found["aPlus"]] == pytest.approx([float(a) for a in drift.ends])
    assert [found["kappa"], found["r"]] == pytest.approx([kappa, r], rel=1e-14)
    assert found["time"] == pytest.approx(float(scales.time), rel=1e-14)
    points = drift.critical_points()
    assert [p["kind"] for p in found["points"]] == [p.kind for p in points]
    assert [p["u"] for p in found["points"]] == pytest.approx(
        [float(p.u) for p in points], abs=1e-13
    )
    known = drift.folds().z0
    assert found["folds"] == (None if np.isnan(known[0]) else pytest.approx(known, rel=1e-14))
    exact = sa.escape_time(drift, kappa, r, log=True)
    assert found["logExact"] == pytest.approx(exact, rel=1e-12, abs=1e-12)
    left = sa.exit_probability(drift, kappa, r, log=True)
    assert found["logExit"] == pytest.approx(left, rel=1e-12, abs=1e-12)
    if drift.region == "sliding":
        assert found["logTime"] is found["step"] is None
        assert found["occupation"] == pytest.approx(sa.occupation(drift, kappa), rel=1e-12)
        outside = sa.occupation(drift, kappa, complement=True, log=True)
        assert found["logOutside"] == pytest.approx(outside, rel=1e-12)
        return
    assert found["occupation"] is found["density"] is None
    time = sa.escape_time(drift, kappa, r, method="paper", log=True)
    assert found["logTime"] == pytest.approx(time, rel=1e-11)
    if found["folds"] is None:
        assert found["step"] is found["smooth"] is None
        with pytest.raises(InputError, match="turning point"):
            sa.stokes_multiplier(drift, kappa, method="step")
    else:
        assert found["step"] == sa.stokes_multiplier(drift, kappa, method="step")
        smooth = sa.stokes_multiplier(drift, scales.kappa)
        assert found["smooth"] == pytest.approx(smooth, rel=1e-11, abs=1e-300)


def test_there_is_a_position_of_each_kind(shown) -> None:
    found = [shown[p] for p in POSITIONS]
    assert {f["step"] for f in found} == {None, 0, 1}
    assert {len(f["points"]) for f in found} >= {0, 1, 2}
    assert max(f["logTime"] or 0 for f in found) > 709  # T itself is beyond double precision
    assert min(f["aPlus"] for f in found) < 0 < max(f["aPlus"] for f in found)
    assert max(f["aMinus"] for f in found if f["region"] == "crossing" and f["aPlus"] < 0) < 0


@pytest.mark.parametrize("position", POSITIONS, ids=" ".join)
def test_curves_are_those_of_python(shown, position) -> None:
    drift, scales = _scene(position)
    found, kappa = shown[position], float(scales.kappa)
    u, phi = np.array(found["phi"]).T
    inside = np.clip(u, -1, 1)
    mu, alpha, z0 = map(float, position[:3])
    assert phi == pytest.approx(1 - z0 - alpha * (inside + mu * (inside - inside**3)), abs=1e-12)
    u, V = np.array(found["V"]).T
    # By differences of V: Simpson's rule is exact for the cubic, and there is a point at each kink.
    assert V[np.argmin(abs(u + 1))] == pytest.approx(0, abs=1e-12)
    between = drift.evaluate_float(np.clip((u[1:] + u[:-1]) / 2, -1, 1))
    simpson = (phi[1:] + 4 * between + phi[:-1]) / 6
    assert np.diff(V) == pytest.approx(-simpson * np.diff(u), abs=1e-12)
    if found["density"]:
        u, p = np.array(found["density"]).T
        exact = np.exp(sa.stationary_density(drift, kappa, u, log=True))
        assert p == pytest.approx(exact, rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("position", POSITIONS[:6], ids=" ".join)
def test_time_against_z0_is_that_of_python(shown, position) -> None:
    scales = _scene(position)[1]
    curves = shown[position]["against"]
    z0, log10 = np.array([p for curve in curves["time"] for p in curve[::6]]).T
    drift = sa.friction(float(position[0]), float(position[1]), z0)
    assert set(drift.region) == {"crossing"}
    time = sa.escape_time(drift, float(scales.kappa), float(scales.r), method="paper", log=True)
    assert log10 * np.log(10) == pytest.approx(time, rel=1e-9)
    steps = {p[1] for curve in curves["step"] for p in curve}
    smooth = np.array([p for curve in curves["smooth"] for p in curve[::20]])
    if len(smooth):
        drift = sa.friction(float(position[0]), float(position[1]), smooth[:, 0])
        share = sa.stokes_multiplier(drift, float(scales.kappa))
        assert smooth[:, 1] == pytest.approx(share, rel=1e-9, abs=1e-12)
    assert steps == (set() if shown[position]["folds"] is None else {0, 1})


@pytest.mark.parametrize("position", [POSITIONS[k] for k in (0, 1, 2, 4)], ids=" ".join)
def test_the_exact_time_against_z0_is_that_of_python(shown, position) -> None:
    scales = _scene(position)[1]
    curves = shown[position]["exact"]
    assert len(curves) == len(shown[position]["against"]["time"]) > 0
    assert all(len(curve) == 21 for curve in curves)
    z0, log10 = np.array([p[:2] for curve in curves for p in curve]).T
    drift = sa.friction(float(position[0]), float(position[1]), z0)
    exact = sa.escape_time(drift, float(scales.kappa), float(scales.r), log=True)
    assert log10 * np.log(10) == pytest.approx(exact, rel=1e-11, abs=1e-11)


def test_no_number_where_there_is_none(shown) -> None:
    found = shown[TANGENCY]
    assert found["region"] == "tangency"
    assert found["logTime"] is found["step"] is found["occupation"] is found["density"] is None
    with pytest.raises(RegionError):
        _ = _scene(TANGENCY)[0].region
    found = shown[FOLD]
    assert found["smooth"] == pytest.approx(0.5, abs=1e-9)
    assert found["step"] == 0.5 == sa.stokes_multiplier(_scene(FOLD)[0], "0.3", method="step")
    assert found["logTime"] is None
    # The exact time goes through the fold.
    exact = sa.escape_time(_scene(FOLD)[0], "0.3", 10, log=True)
    assert found["logExact"] == pytest.approx(exact, rel=1e-12)


def test_every_corner_of_the_sliders_can_be_drawn(shown) -> None:
    for position in CORNERS:
        found = shown[position]
        against = found["against"]
        curves = [found["phi"], found["V"], *against["time"]]
        # What is no number is null in JSON.
        assert np.isfinite(np.array([p for curve in curves for p in curve], dtype=float)).all()
        assert found["logTime"] is not None
        assert found["logExact"] is not None
    page = (ROOT / "docs" / "website" / "explorer.html").read_text("utf-8")
    ends = {name: page[page.index(f'name="{name}"') :].split(">")[0] for name in NAMES}
    for name, low, high in (("mu", "0", "5"), ("alpha", "0.25", "1.5"), ("z0", "-3", "5")):
        assert f'min="{low}" max="{high}"' in ends[name]


def test_the_page_holds_the_emitted_code_as_it_is() -> None:
    (page,) = explorer.pages().values()
    for label, source in explorer.sources().items():
        assert f'emitted["{label}"]' in page
        code = str(source).replace("\nexport function ", "\nfunction ")
        assert code in page
    assert explorer.MARK not in page
    assert "export" not in page[page.index("<script>") : page.index("</script>")]


# Drift, its parameters, kappa, eps, r: wells, steady states, weak and strong noise.
_OTHERS = [
    ("sine", {"aminus": 1, "aplus": 1, "b": 2}, 0.03, 0.01, 0.1),
    ("sine", {"aminus": -1, "aplus": 0.5, "b": -1.5}, 0.05, 0.02, 0.05),
    ("tanh", {"aminus": 1, "aplus": -1, "steepness": 5}, 0.08, 0.01, 0.05),
    ("tanh", {"aminus": -2, "aplus": 1.5, "steepness": 2}, 0.01, 0.01, 0.1),
    ("hill", {"aminus": 1, "aplus": -0.5, "K": 0.5}, 0.1, 0.02, 0.2),
    ("hill", {"aminus": 0, "aplus": 1, "K": 1}, 0.02, 0.02, 1.0),
    ("sine", {"aminus": -1, "aplus": 1, "b": 2}, 0.03, 0.01, 0.1),
    # C is 10^-577, T's panels on a side are an odd number if they may be.
    ("tanh", {"aminus": 1, "aplus": 0.5, "steepness": 5}, 0.004, 0.01, 0.1),
]
_PASSAGE = """
const asked = JSON.parse(require("fs").readFileSync(0));
console.log(JSON.stringify(asked.map((s) => ({
  ...numbers(s), ...passage(scaled(s)), against: [...exactAgainstAxis(s, "kappa")].pop(),
  ends: s.drift && s.kappa > 0.02 ? [...exactAgainstAxis(s, "aplus")].pop() : null,
}))));
"""


def test_other_drifts_and_the_time_spent_are_those_of_python(tmp_path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("no Node on this machine")
    model = (ROOT / "docs" / "_static" / "explorer" / "model.js").read_text("utf-8")
    script = tmp_path / "page.js"
    script.write_text(explorer.formulas() + model + _PASSAGE, "utf-8")
    friction = [dict(zip(NAMES, map(float, p), strict=True)) for p in POSITIONS[:4]]
    asked = [
        {"drift": name, **shape, "kappa": k, "eps": e, "r": r} for name, shape, k, e, r in _OTHERS
    ]
    done = subprocess.run(
        [node, str(script)], input=json.dumps([*asked, *friction]),
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    found = json.loads(done.stdout)
    drifts = [getattr(sa, name)(*shape.values()) for name, shape, *_ in _OTHERS]
    drifts += [sa.friction(s["mu"], s["alpha"], s["z0"]) for s in friction]
    for s, drift, seen in zip([*asked, *friction], drifts, found, strict=True):
        scales = sa.rescale(eps=s["eps"], kappa=s["kappa"], r=s["r"])
        kappa, r = float(scales.kappa), float(scales.r)
        log = sa.escape_time(drift, kappa, r, log=True)
        own = abs(seen["logT"] - log)
        assert own < 1e-5, (s, seen["logT"], log)
        assert own < np.exp(seen["logError"]), s
        assert np.exp(seen["logError"]) < 1e-3, s
        left = sa.exit_probability(drift, kappa, r, log=True)
        assert seen["logExit"] == pytest.approx(left, rel=1e-5, abs=1e-4)
        u, share = np.array(seen["share"]).T
        assert (np.diff(u) >= 0).all()
        assert (share >= 0).all()
        if s.get("drift"):
            points = drift.critical_points()
            assert [p["kind"] for p in seen["points"]] == [p.kind for p in points]
            u = [float(p.u) for p in points]
            assert [p["u"] for p in seen["points"]] == pytest.approx(u, rel=1e-13, abs=1e-25)
            assert seen["logExact"] == seen["logT"]
        if seen["ends"]:
            # No corner is seen: between two points a line is off by less than its width.
            x, time, exit_ = np.array(seen["ends"][0]).T
            assert 41 < len(x) < 200
            shape = {**s, "aplus": (x[1:] + x[:-1]) / 2}
            for sign in (-1, 1):
                here = sign * shape["aplus"] > 0.01
                between = getattr(sa, s["drift"])(
                    *(shape[k][here] if k == "aplus" else s[k] for k in list(s)[1:-3])
                )
                true = sa.escape_time(between, kappa, r, log=True) / np.log(10)
                lines = (time[1:] + time[:-1])[here] / 2
                assert lines == pytest.approx(true, abs=np.ptp(time) / 100)
                true = np.exp(sa.exit_probability(between, kappa, r, log=True))
                assert (exit_[1:] + exit_[:-1])[here] / 2 == pytest.approx(true, abs=0.01)
        x, curve = np.array([point[:2] for point in seen["against"][0]]).T
        assert (np.diff(x) > 0).all()
        noise = 10 ** x[::10] / s["eps"] ** 0.5
        exact = sa.escape_time(drift, noise, r, log=True)
        assert curve[::10] * np.log(10) == pytest.approx(np.asarray(exact), rel=1e-5, abs=1e-5)
