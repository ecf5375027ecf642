"""The emitted escape times, exact and expanded, are run and compared with the engines' values."""

from __future__ import annotations

import re
from fractions import Fraction

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.commands import main as cli
from tests import emitted
from tests.problems import BY_NAME, PROBLEMS

DOUBLE = ("numpy", "python", "c", "javascript")
# Two zeros at 1e-15 of each other and lam = 2e16: no digit is left in doubles.
TOO_CLOSE = ("fold + 1e-30", "fold - 1e-30")


def far(got, want):
    """The distance in units of the larger of 1 and the logarithm."""
    return float(abs(mpmath.mpf(got) - want) / max(1, abs(want)))


# -- exact -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def exact_scenes():
    """Files by name; and calls with exact values: every kind of drift, the whole range."""
    files, found = {"free": sa.friction()}, []
    for number, p in enumerate(PROBLEMS):
        if p.tags & {"refused", "slow"} or p.name in TOO_CLOSE:
            continue
        drift, kappa, r = p.make(), float(Fraction(p.kappa)), float(Fraction(p.r))
        name, arguments = f"T{number}", (kappa, r)
        if "friction" in p.tags and not p.tags & {"extreme", "fold", "kink"}:
            values = [float(drift.values[n]) for n in ("mu", "alpha", "z0")]
            drift, name, arguments = sa.friction(*values), "free", (kappa, r, *values)
        else:
            files[name] = drift
        want = sa.escape_time(drift, kappa, r, dps=16, log=True)
        found.append((emitted.Call(name, "log_escape_time", arguments), want))
    sources = {name: sa.emit("eq:Ttilde", drift=drift) for name, drift in files.items()}
    return sources, found


@pytest.mark.parametrize("target", DOUBLE)
def test_the_exact_time_is_that_of_the_engines(target, exact_scenes, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    files, asked = exact_scenes
    if target != "numpy":
        # One algorithm: a third of the scenes tells whether another language has it right.
        asked = [item for item in asked if item[0].file == "free"][::2] + asked[::5]
    sources = {call.file: files[call.file].to(target) for call, _ in asked}
    values = emitted.run(target, sources, [call for call, _ in asked], tmp_path)
    wrong = [
        (call, got, want)
        for (call, want), (got,) in zip(asked, values, strict=True)
        if not far(got, want) < 1e-13
    ]
    assert not wrong
    assert len(asked) > (60 if target == "numpy" else 20)


def test_the_exact_time_takes_arrays():
    load = sa.emit("eq:Ttilde", drift=sa.friction(3, 1)).load()
    kappa, z0 = np.array([[0.1], [0.5]]), np.linspace(-1.6, 3.4, 5)
    want = sa.escape_time(sa.friction(3, 1, z0), kappa, 10, log=True)
    np.testing.assert_allclose(load.log_escape_time(kappa, 10, z0), want, rtol=1e-12)
    assert load.escape_time(0.001, 10, -0.3) == np.inf


@pytest.mark.parametrize("target", DOUBLE[:3])
def test_what_doubles_cannot_tell_is_refused(target):
    if why := emitted.available(target):
        pytest.skip(why)
    load = sa.emit("eq:Ttilde", target, drift=BY_NAME["fold - 1e-30"].make()).load()
    lost = "log T is 12.92.*1e-12 is allowed: rounding moves the exponent.*emit the target mpmath"
    asked = {(1e-8, 10.0): lost}
    for kappa, r in ((1e-9, 10.0), (0.1, -1.0), (0.1, 1e13), (float("nan"), 1.0), (0.1, 1e-300)):
        asked[kappa, r] = f"kappa is {kappa}, r is {r}; give kappa in 1e-8..1e8 and r in 1e-100"
    for (kappa, r), message in asked.items():
        if target == "c":
            assert np.isnan(load.log_escape_time(kappa, r))
            continue
        with pytest.raises((ValueError, ArithmeticError), match=message):
            load.log_escape_time(kappa, r)


@pytest.mark.parametrize("target", DOUBLE[:3])
def test_a_drift_that_is_no_number_is_refused(target):
    if why := emitted.available(target):
        pytest.skip(why)
    load = sa.emit("eq:Ttilde", target, drift=sa.friction()).load()
    scenes = {
        (0.1, 10.0, float("nan"), 1.0, -0.4): "2.4 and 0.4 at the layer's ends, nan in size",
        (0.1, 10.0, 3.0, float("inf"), -0.4): "the drift is inf and -inf at the layer's ends",
        (1e-8, 10.0, 1e12, 1.0, -0.4): r"M changes beside u = 0.9999.* over less than doubles tell",
    }
    for arguments, message in scenes.items():
        if target == "c":
            assert np.isnan(load.log_escape_time(*arguments))
            continue
        with pytest.raises((ValueError, ArithmeticError), match=message):
            load.log_escape_time(*arguments)


def test_the_error_that_is_held_against_1e_12_is_not_below_the_true_one():
    text = sa.emit("eq:Ttilde", "python", drift=sa.friction())
    assert text.count("if not loose <= 1e-12") == 1
    file = {}
    exec(text.replace("if not loose <= 1e-12", "if not loose <= -1"), file)
    random = np.random.default_rng(15)
    for k in range(40):
        kappa, mu = 10 ** random.uniform(-5, 0.3), random.uniform(0.3, 4)
        fold = 1 - 2 / 3 * (1 + mu) * np.sqrt((1 + mu) / (3 * mu))
        near = fold + 10 ** random.uniform(-8, -1)
        z0 = float(near if k % 2 else random.uniform(-2, 0.5))
        with pytest.raises(ArithmeticError) as told:
            file["log_escape_time"](kappa, 10, mu, 1, z0)
        value, error = map(
            float, re.findall(r"log T is (\S+) with an error of (\S+),", str(told.value))[0]
        )
        want = sa.escape_time(sa.friction(mu, 1, z0), kappa, 10, dps=20, log=True)
        assert abs(want - value) <= 1.05 * error + 2e-16 * abs(value)


def test_a_tiny_radius_has_its_time():
    load = sa.emit("eq:Ttilde", "python", drift=sa.friction(3, 1, "-0.4")).load()
    want = np.log(sa.escape_time(sa.friction(3, 1, "-0.4"), 0.1, 1e-100))
    assert load.log_escape_time(0.1, 1e-100) == pytest.approx(want, rel=1e-13)


def test_javascript_throws_what_the_others_raise(tmp_path):
    if why := emitted.available("javascript"):
        pytest.skip(why)
    source = sa.emit("eq:Ttilde", "javascript", drift=sa.linear(1, 2))
    with pytest.raises(AssertionError, match="kappa is 0, r is 10; give kappa in"):
        emitted.run(
            "javascript", {"T": source}, [emitted.Call("T", "escape_time", (0.0, 10.0))], tmp_path
        )


# A drift of each kind that is ready-made, the fold, weak noise, no noise to speak of, no layer.
DIGITS = [
    ("friction", 100),
    ("friction k=10", 100),
    ("linear repelling, stiff", 30),
    ("linear sliding", 100),
    ("on the fold", 30),
    ("fold + 1e-30", 20),
    ("r=1e12", 30),
    ("linear r=1/2", 30),
    ("constant", 100),
    ("tanh", 15),
    ("sine", 15),
    ("hill", 15),
    ("expression", 15),
]


def in_digits(scenes, folder):
    """Scenes whose digits from a bare interpreter are not the engine's."""
    files, calls = {}, []
    for number, (name, dps) in enumerate(scenes):
        p = BY_NAME[name]
        files[f"T{number}"] = sa.emit("eq:Ttilde", "mpmath", drift=p.make())
        calls.append(emitted.Call(f"T{number}", "escape_time", (p.kappa, p.r, dps)))
    found = emitted.run("mpmath", files, calls, folder)
    wrong = []
    for (name, dps), (got,) in zip(scenes, found, strict=True):
        p = BY_NAME[name]
        want = sa.escape_time(p.make(), p.kappa, p.r, dps=dps + 5)
        with mpmath.workdps(dps + 10):
            error = abs(mpmath.mpf(got) / want - 1)
            if not error <= mpmath.mpf(10) ** (1 - dps):
                wrong.append((name, dps, float(error)))
    return wrong


def test_the_exact_time_has_the_digits_asked_for(tmp_path):
    assert in_digits(DIGITS, tmp_path) == []


@pytest.mark.slow
def test_the_exact_time_in_digits_on_the_problem_table(tmp_path):
    scenes = [p.name for p in PROBLEMS if not p.tags & {"refused", "slow", "narrow", "may refuse"}]
    assert in_digits([(name, 30) for name in scenes], tmp_path) == []


def test_free_parameters_and_logarithms_in_digits():
    load = sa.emit("eq:Ttilde", "mpmath", drift=sa.friction()).load()
    before = mpmath.mp.dps
    got = load.log_escape_time("0.3", 10, 3, 1, "-0.4", dps=40)
    want = sa.escape_time(sa.friction(3, 1, "-0.4"), "0.3", 10, log=True, dps=45)
    assert mpmath.mp.dps == before
    with mpmath.workdps(50):
        assert abs(got - want) < mpmath.mpf(10) ** -38
    for arguments, message in (
        ((0, 10, 3, 1, 0), "kappa is 0.0, r is 10.0; give numbers greater than 0"),
        (("0.1", "-1", 3, 1, 0), "r is -1.0; give numbers greater than 0"),
        (("x", 10, 3, 1, 0), "'x' is no number; give an int, a float"),
        ((0.1, 10, float("nan"), 1, 0), "nan is no number"),
        ((0.1, 10, mpmath.inf, 1, 0), "give numbers"),
    ):
        with pytest.raises(ValueError, match=message):
            load.escape_time(*arguments)
    with pytest.raises(ValueError, match="dps is 0; give 1 to"):
        load.escape_time(1, 1, 3, 1, 0, dps=0)


def test_the_exact_time_in_latex():
    text = sa.emit("eq:Ttilde", "latex", drift=sa.linear(1, 2))
    assert r"\phi(u) = \frac{u}{2} + \frac{3}{2}" in text
    assert "Error of the formula: log T is right to 1e-12" in " ".join(
        text.replace("\n%  ", "").split()
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sa.emit("eq:Ttilde", drift=sa.sine(), method="laplace"), "emitted by"),
        (lambda: sa.emit("eq:Ttilde", drift=sa.sine(), method="uniform"), "emitted by"),
        (lambda: sa.emit("eq:Ttilde", method="exact"), "give drift="),
        (lambda: sa.emit("eq:C", drift=sa.sine(), method="exact"), "eq:C has no method"),
    ],
)
def test_bad_input_is_told_in_one_sentence(call, message):
    with pytest.raises(sa.SymasymError, match=message):
        call()


def test_the_command_takes_expansions(capsys):
    words = ["--target", "python", "--drift", "friction", "--set", "mu=3"]
    more = ["--set", "alpha=1", "--set", "z0=-0.4", "--order", "0"]
    assert cli.main(["emit", "expansion:T", *words, *more]) == 0
    assert "def log_f(kappa, r):" in capsys.readouterr().out
    assert cli.main(["emit", "eq:Ttilde", *words]) == 0
    assert "def log_escape_time(kappa, r, alpha, z0):" in capsys.readouterr().out


# -- the Stokes multiplier -----------------------------------------------------------------------


@pytest.mark.parametrize("target", [*DOUBLE, "mpmath"])
def test_the_smooth_multiplier_is_that_of_airys_functions(target, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    source, asked = sa.emit("eq:S", target, drift=sa.friction()), []
    # Both sides of the fold and the fold, mirrored, every panel of the table and beyond it.
    for z0 in (-3.0, -1.0, -0.85, -0.7777777777777778, -0.77, -0.7, -0.4, 2.75, 4.0):
        for kappa in (0.01, 0.03, 0.1, 0.3, 1.0, 4.0):
            want = sa.stokes_multiplier(sa.friction(3, 1, z0), kappa, dps=20)
            if want > 1e-300:
                asked.append((emitted.Call("S", "log_stokes_multiplier", (kappa, 3, 1, z0)), want))
    assert len(asked) > 40
    values = emitted.run(target, {"S": source}, [call for call, _ in asked], tmp_path)
    for (call, want), (got,) in zip(asked, values, strict=True):
        with mpmath.workdps(30):
            # 1 - 1e-30 has a logarithm that only many digits tell.
            error = abs(mpmath.mpf(got) - mpmath.log(want))
        # Airy's argument has the rounding of z0 and kappa, lam of it.
        assert error < 1e-12 * max(1, -mpmath.log(want)), (call, got, want)


def test_the_multiplier_takes_arrays_and_tells_where_it_is_not():
    load = sa.emit("eq:S", drift=sa.friction(3, 1)).load()
    z0 = np.linspace(-2, 4, 25)
    want = sa.stokes_multiplier(sa.friction(3, 1, z0), 0.2)
    np.testing.assert_allclose(load.stokes_multiplier(0.2, z0), want, rtol=1e-11)
    with pytest.raises(ValueError, match="no well is born"):
        sa.emit("eq:S", "python", drift=sa.friction()).load().stokes_multiplier(0.1, 0.5, 1, 0)
    with pytest.raises(sa.InputError, match="use sa.friction, or call sa.stokes_multiplier"):
        sa.emit("eq:S", drift=sa.sine())
