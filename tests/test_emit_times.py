"""The emitted escape times, exact and expanded, are run and compared with the engines' values."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import numpy as np
import pytest

import symasym as sa
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
    for kappa, r in ((1e-8, 10.0), (1e-9, 10.0), (0.1, -1.0), (0.1, 1e13), (float("nan"), 1.0)):
        if target == "c":
            assert np.isnan(load.log_escape_time(kappa, r))
            continue
        with pytest.raises((ValueError, ArithmeticError), match="give kappa in|kappa is too small"):
            load.log_escape_time(kappa, r)


def test_javascript_throws_what_the_others_raise(tmp_path):
    if why := emitted.available("javascript"):
        pytest.skip(why)
    source = sa.emit("eq:Ttilde", "javascript", drift=sa.linear(1, 2))
    with pytest.raises(AssertionError, match="kappa is 0, r is 10; give kappa in"):
        emitted.run(
            "javascript", {"T": source}, [emitted.Call("T", "escape_time", (0.0, 10.0))], tmp_path
        )


def test_the_exact_time_in_the_other_targets():
    with pytest.raises(sa.InputError, match="is emitted in double precision; for more digits"):
        sa.emit("eq:Ttilde", "mpmath", drift=sa.friction())
    text = sa.emit("eq:Ttilde", "latex", drift=sa.linear(1, 2))
    assert r"\phi(u) = \frac{3}{2} + \frac{u}{2}" in text
    assert "Error of the formula: log T is right to 1e-12" in " ".join(
        text.replace("\n%  ", "").split()
    )
