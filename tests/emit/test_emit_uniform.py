"""The emitted uniform formula of the escape time: run, and compared with the library's."""

from __future__ import annotations

import ast
import math
from fractions import Fraction

import numpy as np
import pytest

import symasym as sa
from symasym.asymptotics.uniform import answer as uniform_noise
from symasym.commands import main as cli
from symasym.emit.kernels import transcribe
from symasym.emit.targets import language
from symasym.emit.writing import helpers
from tests import emitted
from tests.problems import PROBLEMS

TARGETS = ("numpy", "python", "c", "javascript")
FOLD = -7 / 9
# Through the fold, on both sides of it, and up to where the barrier reaches the end.
NEAR = [FOLD + side * gap for gap in (1e-12, 1e-9, 1e-6, 1e-3) for side in (-1, 1)]
SPRING = [*np.linspace(-2, -1e-6, 81), FOLD, *NEAR, -1e-2, -1e-3, -1e-4, -1e-5]

# So near to a tangency that 1 - alpha - z0 has few digits where it is added up as it stands.
TANGENT = [
    (0.006413507327312468, 7854.091520471, 3.0, 0.3177259902756287, 0.6822740074492109),
    (0.006825092974974507, 1079.9095988043625, 1.0, 0.011091570802330673, 1.0110915708206099),
    (0.0007231082601184727, 3858.9136538543185, 1.8, 0.058981515918755084, 0.9410184816015466),
]


def formula(target="python", drift=None):
    return sa.emit("eq:Ttilde", target, drift=drift or sa.friction(), method="uniform")


def library(drift, kappa, r):
    """By the closed forms alone, which are emitted; not one by one, which takes series."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uniform_noise, "_one_by_one", _refused)
        return sa.escape_time(drift, kappa, r, method="uniform", order=0, log=True)


def _refused(*_):
    raise sa.AccuracyError("no closed form")


def far(got, want):
    return np.abs(np.asarray(got, float) - want) / np.maximum(1, np.abs(want))


@pytest.fixture(scope="module")
def scenes():
    """Calls of the friction drift's file, and the library's values."""
    asked, want = [], []
    for mu, kappa, r in ((3, 0.05, 10.0), (3, 0.2, 1.5), (20, 0.05, 10.0), (1, 0.05, 10.0)):
        spring = np.array(SPRING if mu == 3 else SPRING[::4])
        want += list(library(sa.friction(mu, 1, spring), kappa, r))
        asked += [(kappa, r, mu, 1, float(z)) for z in spring]
        # A crossing downwards is one upwards in the mirror: on the other side of the start.
        want += list(library(sa.friction(mu, 1, 2 - spring[::9]), kappa, r))
        asked += [(kappa, r, mu, 1, float(2 - z)) for z in spring[::9]]
    for kappa, r, mu, alpha, z0 in TANGENT:
        want.append(library(sa.friction(mu, alpha, [z0]), kappa, r)[0])
        asked.append((kappa, r, mu, alpha, z0))
    return [emitted.Call("T", "log_uniform_time", a) for a in asked], np.array(want)


@pytest.mark.parametrize("target", TARGETS)
def test_the_uniform_time_is_the_librarys_through_fold_and_end(target, scenes, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    calls, want = scenes
    values = emitted.run(target, {"T": formula(target)}, calls, tmp_path)
    wrong = far([got for (got,) in values], want)
    assert wrong.max() < 1e-13, (calls[wrong.argmax()], wrong.max())


def test_it_is_as_near_to_the_exact_time_as_it_should_be():
    spring = np.array(SPRING)
    load = formula("numpy").load()
    for kappa in (0.025, 0.05, 0.1):
        exact = sa.escape_time(sa.friction(3, 1, spring), kappa, 10, log=True)
        error = np.abs(np.expm1(load.log_uniform_time(kappa, 10, 3, 1, spring) - exact))
        assert 0.02 < error.max() / kappa**2 < 0.05


def random_drift(rng):
    """Coefficients, kappa and r: none to eight zeros, pairs of all kinds."""
    c = (rng.normal(size=rng.integers(1, 9)) * rng.choice([0.5, 1, 3])).round(3)
    return [float(x) for x in c], float(rng.choice([0.02, 0.05, 0.1])), float(rng.choice([0.8, 10]))


@pytest.mark.parametrize(("target", "seed", "count"), [("python", 7, 60), ("c", 11, 30)])
def test_any_polynomial(target, seed, count, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    rng, seen = np.random.default_rng(seed), 0
    free = sa.Drift(" + ".join(f"c{k}*u**{k}" for k in range(8)), "u")
    load = formula(target, free).load()
    for _ in range(count):
        c, kappa, r = random_drift(rng)
        try:
            want = library(sa.polynomial(*[np.array([x]) for x in c]), kappa, r)[0]
        except sa.SymasymError:
            continue
        got = load.log_uniform_time(kappa, r, *c, *[0.0] * (8 - len(c)))
        assert far(got, want) < 1e-13, (c, kappa, r, got, want)
        seen += 1
    assert seen > count / 2


@pytest.mark.slow
def test_the_problems_that_the_library_answers():
    seen = 0
    for p in PROBLEMS:
        if p.tags & {"refused", "slow", "extreme"}:
            continue
        drift, kappa, r = p.make(), float(Fraction(p.kappa)), float(Fraction(p.r))
        if p.name.endswith("well"):
            continue  # another start
        try:
            want = library(drift, kappa, r)
            load = formula(drift=drift).load()
            got = load.log_uniform_time(kappa, r)
        except (sa.SymasymError, ValueError):
            continue
        assert far(got, want) < 1e-13, (p.name, got, want)
        seen += 1
    assert seen > 10


def test_only_what_the_drift_needs_is_written():
    linear, cubic = formula("c", sa.linear()), formula("c")
    assert "Left out: pairs of zeros and Airy functions" in linear
    assert "airy" not in linear
    assert "circle_" not in cubic
    assert "circle_" in formula("c", sa.polynomial(1, 0, 0, 0, 2))
    assert len(linear) < 0.5 * len(cubic)
    told = " ".join(cubic.replace("\n *  ", "").split())
    assert "Error of the formula: none is stated: the relative error is of order kappa^2" in told


@pytest.mark.parametrize("target", TARGETS[:3])
def test_where_it_has_no_value_it_says_so(target):
    if why := emitted.available(target):
        pytest.skip(why)
    load = formula(target).load()
    # Noise and radius out of range, the start at a zero of A, a tangency.
    for arguments in ((1e-9, 10, 3, 1, -0.4), (0.1, -1, 3, 1, -0.4), (0.1, 10, 3, 1, 1),
                      (0.1, 10, 3, 1, 0), (math.nan, 10, 3, 1, -0.4)):  # fmt: skip
        if target == "c":
            assert np.isnan(load.log_uniform_time(*arguments))
            continue
        with pytest.raises(ValueError, match="out of range, or the start or r is at a zero"):
            load.log_uniform_time(*arguments)


@pytest.mark.parametrize("target", TARGETS[:3])
def test_a_barrier_uphill_is_refused_where_the_library_takes_the_series(target):
    if why := emitted.available(target):
        pytest.skip(why)
    free = sa.Drift("c0 + c1*u", "u")
    load = formula(target, free).load()
    # Downhill from 0 the end u = 1, or a well; uphill nothing, or a barrier at -0.5.
    assert np.isfinite(load.log_uniform_time(0.1, 10, 0.5, -1.0))
    assert np.isfinite(load.log_uniform_time(0.1, 0.4, 0.5, 1.0))
    assert library(sa.polynomial(np.array([0.5]), -1.0), 0.1, 10) > 0
    with pytest.raises(sa.AccuracyError):
        library(sa.polynomial(np.array([0.5]), 1.0), 0.1, 10)
    if target == "c":
        assert np.isnan(load.log_uniform_time(0.1, 10, 0.5, 1.0))
        return
    with pytest.raises(ValueError, match="a barrier lies uphill from the start"):
        load.log_uniform_time(0.1, 10, 0.5, 1.0)


def test_javascript_throws_where_it_has_no_value(tmp_path):
    if why := emitted.available("javascript"):
        pytest.skip(why)
    call = emitted.Call("T", "uniform_time", (0.0, 10.0, 3.0, 1.0, -0.4))
    with pytest.raises(AssertionError, match="kappa or r is out of range"):
        emitted.run("javascript", {"T": formula("javascript")}, [call], tmp_path)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: formula(drift=sa.tanh(1, -1, 5)), "is no polynomial in u"),
        (lambda: formula(drift=sa.polynomial(*range(1, 15))), "has degree 13; the uniform time"),
        (lambda: formula("mpmath"), "is emitted in double precision"),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_one_sentence(call, message):
    with pytest.raises(sa.InputError, match=message):
        call()


def test_the_command_writes_it(capsys):
    words = ["emit", "eq:Ttilde", "--target", "python", "--drift", "friction"]
    assert cli.main([*words, "--method", "uniform", "--set", "mu=3"]) == 0
    assert "def log_uniform_time(kappa, r, alpha, z0):" in capsys.readouterr().out


# -- the languages -------------------------------------------------------------------------------


def test_what_has_no_transcription_is_refused():
    for text in (
        "def _f(x: float) -> float:\n    with x:\n        return x",
        "def _f(x: float) -> float:\n    y, z = x, y\n    return z",
        "def _f(x: float) -> float:\n    return [x]",
        "def _f(x: float) -> float:\n    return sorted(x)",
    ):
        with pytest.raises(TypeError, match="no transcription|one by one"):
            transcribe.transcribed({"_f": text}, "c")


def test_blocks_that_are_not_needed_go_with_what_they_call():
    for degree, pairs, many in ((5, True, True), (3, True, False), (1, False, False)):
        known = language._uniform("python", degree)
        text = "\n\n".join(helpers("_log_uniform(", known))
        assert ("def _airy(" in text, "def _circle(" in text) == (pairs, many)
        assert "_PAIRS" not in text
        assert "_MANY" not in text
        ast.parse(text)


def test_whole_numbers_stay_apart_from_others(tmp_path):
    """Quotients, remainders and conditions mean the same in each language."""
    text = '''def _f(n: int, x: float) -> float:
    """A trial."""
    total, list_ = 0.0, [0.0] * 3
    for k in range(n, -1, -1):
        odd: int = k % 2 == 1
        if odd == 1 and not x > 9 or k == 2:
            total += k / 2 + (k + 1) // 2 - 1 / 3
        elif k > 3:
            continue
        else:
            total -= x if x < 1 else max(x, 1.0, 0.5)
    list_[1] += total
    return list_[1] - (x - (total - 2 * x)) / (3 * (n + 1))
'''
    space: dict = {}
    exec(text, space)
    cases = [(n, x) for n in range(6) for x in (0.5, 2.5, 11.0)]
    want = [space["_f"](*case) for case in cases]
    if not emitted.available("c"):
        lines = [f'    printf("%.17g\\n", f_({n}, {x}));' for n, x in cases]
        (code,) = transcribe.transcribed({"_f": text}, "c").values()
        main = "\n".join(["#include <math.h>", "#include <stdio.h>", code, "int main(void)", "{"])
        (tmp_path / "f.c").write_text("\n".join([main, *lines, "    return 0;", "}", ""]))
        emitted._output([emitted.compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", "f",
                         "f.c", "-lm"], tmp_path)  # fmt: skip
        got = emitted._output([str(tmp_path / "f")], tmp_path).split()
        assert [float(x) for x in got] == want
    if not emitted.available("javascript"):
        calls = ", ".join(f"f({n}, {x})" for n, x in cases)
        (code,) = transcribe.transcribed({"_f": text}, "javascript").values()
        (tmp_path / "f.mjs").write_text(f"{code}\nconsole.log([{calls}].join(' '));\n")
        got = emitted._output(["node", "f.mjs"], tmp_path).split()
        assert [float(x) for x in got] == want
