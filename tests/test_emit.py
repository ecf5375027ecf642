"""Every emitted file is run, and its values compared with exact ones."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.formula import formula, labels
from tests import emitted
from tests.problems import BY_NAME, tagged

DOUBLE = ("numpy", "python", "c", "javascript")
RUN = (*DOUBLE, "mpmath")


def close(got: float, want: object, log: bool) -> bool:
    """Agreement to 1e-13: of logarithms in units of the larger of 1 and the logarithm."""
    want = mpmath.mpf(want) if not isinstance(want, Fraction) else mpmath.mpf(float(want))
    size = max(1, abs(want)) if log else abs(want)
    return abs(mpmath.mpf(got) - want) <= 1e-13 * size


# -- every formula that the derivations emit -----------------------------------------------------


def _random_arguments(item, rng):
    """Numbers that the symbols' assumptions allow, in 64ths, which doubles hold exactly."""
    symbols = {s.name: s for e in item["values"] for s in e.free_symbols}
    arguments = []
    for name in item["arguments"]:
        size = int(rng.integers(13, 115)) / 64
        arguments.append(-size if symbols[name].is_negative else size)
    value = sympy.lambdify([symbols[n] for n in item["arguments"]], item["values"], "mpmath")
    with mpmath.workdps(50):
        return tuple(arguments), value(*map(mpmath.mpf, arguments))


@pytest.fixture(scope="module")
def formula_calls():
    rng = np.random.default_rng(7)
    found, sources = [], {}
    for label in labels():
        for item in formula(label).code:
            kept = 0
            while kept < 3:
                arguments, want = _random_arguments(item, rng)
                if any(isinstance(value, mpmath.mpc) for value in want):
                    continue
                kept += 1
                name = label.replace(":", "_").replace("-", "_")
                call = emitted.Call(name, item["name"], arguments, len(want))
                found.append((call, want))
                if name not in sources:
                    sources[name] = sa.emit(label)
    return sources, found


@pytest.mark.parametrize("target", RUN)
def test_formulas_have_their_expressions_values(target, formula_calls, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    sources, asked = formula_calls
    files = {name: source.to(target) for name, source in sources.items()}
    calls = [call for call, _ in asked]
    values = emitted.run(target, files, calls, tmp_path)
    for (call, want), got in zip(asked, values, strict=True):
        for x, exact in zip(got, want, strict=True):
            with mpmath.workdps(40):
                error = abs(mpmath.mpf(x) - exact)
            # Sums of terms of both signs lose digits of their own.
            allowed = 1e-28 if target == "mpmath" else 1e-13
            assert error <= allowed * max(abs(exact), 0.03), (call, x, exact)


# -- drifts --------------------------------------------------------------------------------------

CROSSING = [
    p
    for p in [*tagged("friction", "up"), *tagged("friction", "down")]
    if not p.tags & {"extreme", "fold", "stiff"}
]
SLIDING = [
    BY_NAME[name]
    for name in (
        "friction sliding",
        "friction sliding weak",
        "linear sliding",
        "linear sliding, uneven",
        "tanh",
        "tanh very steep",
        "sine sliding",
        "hill n=12",
        "quintic",
    )
]
SHAPES = [
    BY_NAME[name] for name in ("sine", "tanh", "hill", "hill n=1", "degree 12", "expression")
]


def _floats(drift):
    """The friction drift with its parameters as doubles, and these."""
    values = [float(drift.values[name]) for name in ("mu", "alpha", "z0")]
    return sa.friction(*values), values


@pytest.fixture(scope="module")
def scenes():
    """Files by name; and calls with exact values, and whether these are logarithms."""
    free = sa.friction()
    files = {"time": ("eq:Ttildesmall", free), "density": ("eq:pss", free), "phi": ("eq:phi", free)}
    found = [(emitted.Call("phi", "phi", (0.5, 3.0, 1.0, -0.25)), Fraction(-3, 8), False)]

    def ask(file, function, arguments, want):
        log = function.startswith("log")
        found.append((emitted.Call(file, function, arguments), want, log))

    for p in CROSSING:
        drift, values = _floats(p.make())
        kappa, r = float(Fraction(p.kappa)), float(Fraction(p.r))
        want = sa.escape_time(drift, kappa, r, method="paper", dps=25, log=True)
        ask("time", "log_weak_noise_time", (kappa, r, *values), want)
    for p in (BY_NAME["friction sliding"], BY_NAME["friction sliding weak"]):
        drift, values = _floats(p.make())
        kappa = float(Fraction(p.kappa))
        for u in (-2.0, -0.75, 0.25, 1.5):
            want = sa.stationary_density(drift, kappa, u, log=True, dps=25)
            ask("density", "log_stationary_density", (u, kappa, *values), want)
    for p in SLIDING:
        drift, name, kappa = p.make(), _name("P", p), float(Fraction(p.kappa))
        files[name] = ("eq:P", drift)
        for complement, function in ((False, "log_occupation"), (True, "log_complement")):
            want = sa.occupation(drift, kappa, complement=complement, log=True, dps=25)
            ask(name, function, (kappa,), want)
    for p in SHAPES:
        drift, name = p.make(), _name("V", p)
        files[name] = ("eq:V", drift)
        for u in (-1.5, -0.75, 0.25, 0.875, 3.0):
            ask(name, "V", (u,), _potential(drift, u))
    drift = BY_NAME["expression, cubic"].make()
    files["cubic"] = ("eq:Ttildesmall", drift)
    want = sa.escape_time(drift, 0.25, 8, method="paper", dps=25, log=True)
    ask("cubic", "log_weak_noise_time", (0.25, 8.0), want)
    sources = {name: sa.emit(label, drift=drift) for name, (label, drift) in files.items()}
    return sources, found


def _name(kind, problem):
    return f"{kind}_{''.join(c for c in problem.name if c.isalnum())}"


def _potential(drift, u):
    """V(u) by quadrature of the drift."""
    from symasym.arithmetic import MpmathOps

    context = mpmath.mp.clone()
    context.dps = 25
    ops = MpmathOps(context)

    def phi(v):
        return context.convert(drift.evaluate(max(min(v, context.one), -context.one), ops))

    inside = max(min(u, 1.0), -1.0)
    marks = [-1, *(x / 4 for x in range(-3, 4) if x / 4 < inside), inside]
    below = context.quad(phi, marks) if inside > -1 else 0
    return -below - (u - inside) * phi(context.mpf(inside))


@pytest.mark.parametrize("target", DOUBLE)
def test_drifts_have_the_engines_values(target, scenes, tmp_path):
    if why := emitted.available(target):
        pytest.skip(why)
    files, asked = scenes
    sources = {name: source.to(target) for name, source in files.items()}
    values = emitted.run(target, sources, [call for call, _, _ in asked], tmp_path)
    worst = []
    for (call, want, log), (got,) in zip(asked, values, strict=True):
        if not close(got, want, log):
            worst.append((call, got, want))
    assert not worst
