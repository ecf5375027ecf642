"""Emitted code as it runs: NumPy, mpmath, cc with every warning an error, Node."""

from __future__ import annotations

import ctypes
import itertools
import json
import math
import random
import re
import shutil
import subprocess
from contextlib import suppress
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from sympy.printing.julia import JuliaCodePrinter

import symasym as sa
from symasym.emit import Function, Source
from symasym.emit.printing import own

u, x, y = sympy.Symbol("u", real=True), *sympy.symbols("x y", real=True)

# A file, the name of a function in it, its arguments.
Call = tuple[Source, str, tuple[float, ...]]


def run(target: str, calls: list[Call], folder: Path) -> list[Any]:
    """The values of calls of one target, each a float or a list of floats."""
    program = {"c": "cc", "javascript": "node"}.get(target)
    if program and not shutil.which(program):
        pytest.skip(f"no {program}")
    files = {id(source): source for source, *_ in calls}
    if target == "c":
        return list(in_c(files, calls, folder))
    if target == "javascript":
        for key, source in files.items():
            source.write(folder / f"m{key}.mjs")
        asked = json.dumps([[f"./m{id(s)}.mjs", name, given] for s, name, given in calls])
        (folder / "main.mjs").write_text(
            f"for (const [m, f, x] of {asked}) {{ const v = [(await import(m))[f](...x)].flat();"
            " console.log(v.join(' ')); }"
        )
        told = subprocess.run(["node", folder / "main.mjs"], capture_output=True, text=True)
        assert not told.stderr, told.stderr
        lines = told.stdout.replace("Infinity", "inf").splitlines()
        rows = [[*map(float, line.split())] for line in lines]
        return [row[0] if len(row) == 1 else row for row in rows]
    loaded = {key: source.load() for key, source in files.items()}
    return [getattr(loaded[id(source)], name)(*given) for source, name, given in calls]


def in_c(files: dict[int, Source], calls: list[Call], folder: Path) -> Any:
    loaded = {}
    for key, source in files.items():
        at = source.write(folder / f"f{key}.c")
        strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
        command = ["cc", *strict, at, "-o", at.with_suffix(".so"), "-lm"]
        told = subprocess.run(command, capture_output=True, text=True)
        assert told.returncode == 0, told.stderr
        loaded[key] = ctypes.CDLL(str(at.with_suffix(".so")))
    for source, name, given in calls:
        several, of = re.search(rf"void {name}\(.*out\[(\d+)\]", source), loaded[id(source)][name]
        out = (ctypes.c_double * int(several[1]))() if several else ()
        of.restype = None if several else ctypes.c_double
        value = of(*map(ctypes.c_double, given), *([out] if several else []))
        yield list(out) if several else value


def no_value(target: str, source: Source, name: str, given: tuple[float, ...], at: Path) -> None:
    """Python says so, other languages give nan."""
    if target in ("numpy", "mpmath"):
        with pytest.raises(ValueError, match="value"):
            run(target, [(source, name, given)], at)
    else:
        assert math.isnan(run(target, [(source, name, given)], at)[0])


def gap(got: Any, want: Any) -> float:
    """The largest distance of one value or several, relative where they exceed 1."""
    rows = [(got, want)] if not isinstance(want, (tuple, list)) else zip(got, want, strict=True)
    return max(float(abs(a - b) / max(1, abs(b))) for a, b in rows)


TARGETS = ("numpy", "mpmath", "c", "javascript")

NO_CODE = (sympy.Integral, sympy.Derivative, sympy.DiracDelta, sympy.core.function.AppliedUndef)


@cache
def formulas() -> tuple[list[Function], list[tuple[str, tuple[float, ...]]], list[Any]]:
    """The functions of every label that are expressions, each at one point, and SymPy's values."""
    rng, functions, calls, wanted = random.Random(5), {}, [], []
    for f in (f for label in sa.labels() for f in sa.formula(label).functions()):
        if any(v.atoms(*NO_CODE) for v in f.values):
            continue
        point = [(-1 if a.is_negative else 1) * Fraction(rng.randint(20, 60), 32) for a in
                 f.arguments]  # fmt: skip
        put = {s: sympy.Rational(v) for s, v in zip(f.arguments, point, strict=True)}
        values = [sympy.N(v.subs(put), 25) for v in f.values]
        if f.name in functions or not all(v.is_real and abs(v) < 1e300 for v in values):
            continue
        functions[f.name] = f
        calls.append((f.name, tuple(map(float, point))))
        wanted.append([mpmath.mpf(v) for v in values] if values[1:] else mpmath.mpf(values[0]))
    return list(functions.values()), calls, wanted


@pytest.mark.parametrize("target", TARGETS)
def test_every_formula(target: str, tmp_path: Path) -> None:
    """Against SymPy's own numbers of the expression, in one file."""
    functions, calls, wanted = formulas()
    assert len(calls) > 60
    source = sa.emit(functions, target)
    logs = [(f"log_{n}", given) for n, given in calls if f"log_{n}" in source.functions]
    values = dict(zip([n for n, _ in calls], wanted, strict=True))
    wanted = [*wanted, *(mpmath.log(values[n[4:]]) for n, _ in logs)]
    asked = [(source, *call) for call in (*calls, *logs)]
    for call, got, want in zip(asked, run(target, asked, tmp_path), wanted, strict=True):
        assert gap(got, want) < 1e-13, call[1:]


FRICTION = sa.friction()
SCENES: list[tuple[sa.Drift, tuple[float, ...], tuple[float, ...], tuple[float, ...]]] = [
    (FRICTION, (3, 1, -0.4), (0.02,), (10000,)),
    (FRICTION, (3, 1, -0.4), (0.1, 30), (0.3, 1, 10000)),
    (FRICTION, (0.5, 1, 0.5), (0.07, 1, 30), (0.3, 10000)),
    (sa.tanh(), (1, -1, 1000), (0.1, 30), (10,)),
    (sa.tanh(), (-1, 0.5, 1000), (0.1, 1), (0.3, 10000)),
    (sa.sine(), (1, -1, 3), (0.1, 3), (1.5,)),
    (sa.hill(), (1, -1, 0.3), (0.3,), (1.5,)),
    # Bumps of a thousandth, that no grid sees.
    (sa.Drift("1/2 - exp(-(1000*(u - 3/10))**2)"), (), (0.1, 30), (0.4,)),
    (sa.Drift("1 - 2/(1 + (1000*(u + 37/100))**2)"), (), (0.1, 30), (10,)),
    (sa.Drift("(1 - u + u**5)/2"), (), (0.07, 1), (0.4, 9999.7)),
    (sa.Drift("1/3 - u + u**3/5 - 2*u**16"), (), (0.07, 1), (9999.7,)),
]


@cache
def exact_rows() -> list[tuple[sa.Drift, str, str, tuple[float, ...], float]]:
    """Drift, label, function and its numbers, and the library's logarithm."""
    rows: list[Any] = []
    for drift, values, kappas, radii in SCENES:
        bound = drift.bind(**dict(zip(drift.free, values, strict=True)))
        for kappa, r in itertools.product(kappas, radii):
            T = sa.escape_time(bound, kappa, r, log=True)
            rows.append((drift, "eq:Ttilde", "log_Ttilde", (kappa, r, *values), T))
            for rest, name in enumerate(("log_C", "log_complement")):
                with suppress(sa.RangeError):  # log C below -1e308
                    C = sa.exit_probability(bound, kappa, r, complement=bool(rest), log=True)
                    rows.append((drift, "eq:C", name, (kappa, r, *values), C))
        if bound.region == "sliding":
            for rest, name in enumerate(("log_P", "log_complement")):
                P = sa.occupation(bound, kappa, complement=bool(rest), log=True)
                rows.append((drift, "eq:P", name, (kappa, *values), P))
            for at in (-1.7, 0.31, 1.0):
                p = sa.stationary_density(bound, kappa, at, log=True)
                rows.append((drift, "eq:pss", "log_pss", (kappa, at, *values), p))
    return rows


@pytest.mark.parametrize("target", TARGETS)
def test_exact(target: str, tmp_path: Path) -> None:
    """Logarithms against the library's to 1e-13."""
    rows = exact_rows()[:: 2 if target == "numpy" else 1]
    if target == "mpmath":
        rows = [row for row in rows if row[3][0] >= 1][:9]
    files = {key: sa.emit(key[1], target, drift=key[0]) for key in {row[:2] for row in rows}}
    calls = [(files[row[:2]], row[2], row[3]) for row in rows]
    for row, got in zip(rows, run(target, calls, tmp_path), strict=True):
        assert gap(got, row[4]) < 1e-13, row


@pytest.mark.parametrize("target", TARGETS)
def test_phi_and_V(target: str, tmp_path: Path) -> None:
    drift, points = sa.tanh(1, "-1/2", 3), (-2.0, -0.9, 1.5)
    for label, e in (("eq:phi", drift.phi()), ("eq:V", drift.potential())):
        source = sa.emit(label, target, drift=drift)
        calls = [(source, label[3:], (at,)) for at in points]
        for at, got in zip(points, run(target, calls, tmp_path), strict=True):
            assert gap(got, mpmath.mpf(sympy.N(e.subs(u, sympy.Rational(at)), 25))) < 1e-14


def test_digits() -> None:
    """Any number of digits, of decimals as they are written."""
    T = sa.emit("eq:Ttilde", "mpmath", drift=FRICTION).load().Ttilde
    drift = sa.friction(3, 1, "-0.4")
    f = sa.expand(drift, order=1).emit("mpmath").load().f
    with mpmath.workdps(30):
        want = sa.escape_time(drift, "1", 10, dps=35)
        assert abs(T("1", 10, 3, 1, "-0.4") / want - 1) < mpmath.mpf(10) ** -29
        want = sa.escape_time(drift, "0.1", 10, method="laplace", order=1, dps=35)
        assert abs(f("0.1", 10) / want - 1) < mpmath.mpf(10) ** -28


def test_arrays() -> None:
    """All arguments broadcast, and many kappas at once are the numbers one by one."""
    uniform = sa.expand(FRICTION, "T", noise="uniform").emit().load().f
    T = sa.emit("eq:Ttilde", drift=FRICTION).load().log_Ttilde
    kappa, z0 = np.array([[0.3], [1.0]]), np.array([-0.8, -0.4, 0.5])
    want = sa.escape_time(sa.friction(mu=3, alpha=1, z0=z0), kappa, 10, log=True)
    assert np.abs(T(kappa, 10, 3, 1, z0) - want).max() < 1e-13
    assert np.abs(T(kappa[:, 0], 10, 3, 1, -0.4) - want[:, 1]).max() < 1e-13
    lacking = np.isnan(uniform(0.1, [[0.5], [2]], 3, 1, z0))  # r = 1/2; sliding
    assert lacking.tolist() == [[True, True, True], [False, False, True]]


@pytest.mark.parametrize("target", TARGETS)
def test_no_value(target: str, tmp_path: Path) -> None:
    """Too small a kappa, and outside of the region."""
    T, P = (sa.emit(label, target, drift=FRICTION) for label in ("eq:Ttilde", "eq:P"))
    if target != "mpmath":  # where it takes minutes
        no_value(target, T, "Ttilde", (1e-4, 10.0, 3.0, 1.0, -0.4), tmp_path)
    for z0 in (-0.4, 0.0):  # a crossing region, a tangency
        (share,) = run(target, [(P, "P", (1.0, 3.0, 1.0, z0))], tmp_path)
        assert math.isnan(share)
    pieces = sa.emit("other-pieces", target)  # the root of a negative number
    given = (0.5, 2.0, 1.5, -0.7, 2.2)
    (third,) = run(target, [(pieces, "other_pieces_third_piece", given)], tmp_path)
    assert math.isnan(third)


EXPANSIONS = [
    (sa.friction(3, 1, "-0.4"), "T", "weak", 2, 0), (sa.friction(3, 1, "-0.4"), "C", "weak", 1, 0),
    (sa.friction(3, 1, "1/2"), "P", "weak", 1, 0), (sa.sine(1, -1, 3), "1 - P", "weak", 1, 0),
    (sa.Drift("1/2 - sin(2*u)"), "T", "weak", 2, "1/3"), (sa.linear(1, 3), "1 - C", "weak", 0, 0),
    (sa.Drift("1/4 - sqrt(2)*u"), "T", "weak", 2, 0),
    (sa.friction(3, 1, "-0.4"), "T", "strong", 3, 0), (sa.linear(1, -1), "P", "strong", 2, 0),
]  # fmt: skip


@pytest.mark.parametrize("target", TARGETS)
def test_expansions(target: str, tmp_path: Path) -> None:
    """The numbers of the methods; none for r < 1."""
    calls, wanted = [], []
    for drift, quantity, noise, order, start in EXPANSIONS:
        e = sa.expand(drift, quantity, noise=noise, order=order, start=start)
        source = e.emit(target, name="g")
        name = "log_g" if "log_g" in source.functions else "g"
        for kappa in (0.02, 0.1) if noise == "weak" else (3.0, 30.0):
            for r in (1.5, 10.0, 10000.0) if quantity[-1] != "P" else (None,):
                given = (kappa,) if r is None else (kappa, r)
                calls.append((source, name, given))
                wanted.append(e.evaluate(kappa, r, log=name == "log_g"))
    for call, got, want in zip(calls, run(target, calls, tmp_path), wanted, strict=True):
        assert gap(got, want) < 1e-13, call[1:]
    no_value(target, calls[0][0], "log_g", (0.1, 0.5), tmp_path)
    no_value(target, calls[0][0], "g", (0.1, 1.0), tmp_path)


@pytest.mark.parametrize("target", TARGETS)
def test_uniform(target: str, tmp_path: Path) -> None:
    """Through the fold at z0 = -7/9, with free parameters, against exact times; none for r < 1."""
    source = sa.expand(FRICTION, "T", noise="uniform").emit(target)
    z0 = (-1.5, -0.9, -7 / 9, -0.6)
    rows = [(k, r, z) for z in z0 for k in (0.05, 0.1, 0.2) for r in (1.5, 10.0)]
    calls = [(source, "f", (k, r, 3.0, 1.0, z)) for k, r, z in rows]  # kappa, r, mu, alpha, z0
    for (k, r, z), got in zip(rows, run(target, calls, tmp_path), strict=True):
        want = sa.escape_time(sa.friction(mu=3, alpha=1, z0=z), k, r)
        assert abs(got / want - 1) < 0.3 * k**2, (k, r, z)
    no_value(target, source, "f", (0.2, 0.4, 3.0, 1.0, -0.4), tmp_path)  # where T is 0.739


ERFCX = own("erfcx")(x)
SPECIAL = [
    *((k(x), (-80.0, -9.1, -5.0, -0.1, 0.5, 1.1, 8.9, 9.1, 20.0)) for k in (
        sympy.airyai, sympy.airyaiprime, sympy.airybi, sympy.airybiprime)),
    (sympy.erf(x), (-3.0, 1e-9, 0.4, 0.6)), (ERFCX, (0.0, 0.3, 5.9, 6.1, 50.0)),
    (sympy.exp(-(x**2)) * sympy.erfi(x), (-2.0, 0.1, 0.6, 20.0, 29.0, 31.0)),
    (sympy.hyper([sympy.S.Half, 1], [sympy.S.Half * 3], x), (-30.0, -1e-5, 1e-6, 0.9)),
    (sympy.log(1 + sympy.exp(x)), (-800.0, 3.0, 800.0)), (sympy.exp(x) - 1, (1e-12, -2.0)),
    (sympy.log(1 + x), (1e-12, 5.0)), (sympy.exp(x) / (1 + sympy.exp(x)), (-800.0, 800.0)),
    (sympy.Piecewise((sympy.log(x), x > 1), (x**3 / 7, x > 0), (-x, True)), (-2.0, 0.5, 3.0)),
    (sympy.Max(x, 1, 2 * x) + sympy.Min(x, 2) + sympy.pi * x**5, (-1.0, 3.0)),
]  # fmt: skip


@pytest.mark.parametrize("target", TARGETS)
def test_functions_that_languages_lack(target: str, tmp_path: Path) -> None:
    sources = [(e, sa.emit(e, target), points) for e, points in SPECIAL]
    calls = [(source, "f", (at,)) for _, source, points in sources for at in points]
    got = iter(run(target, calls, tmp_path))
    for e, _, points in sources:
        known = sympy.exp(x**2) * sympy.erfc(x) if e == ERFCX else e
        for at in points:
            want = sympy.N(known.subs(x, sympy.Rational(at)), 25)
            # Airy functions oscillate with an amplitude of |x|^(1/4)/pi^(1/2) at the most.
            size = max(abs(want), 2 if at < -1 and abs(want) < 2 else 0)
            assert abs(next(got) - want) <= 2e-13 * size, (e, at, want)


def test_parameters_and_names(tmp_path: Path) -> None:
    e = sympy.Symbol("lambda") + 2 * sympy.Symbol("exp") * sympy.exp(x) + 3 * sympy.Symbol("numpy")
    for target in TARGETS:  # exp, lambda, numpy, x
        (got,) = run(target, [(sa.emit(e, target), "f", (3.0, 5.0, 7.0, 0.0))], tmp_path)
        assert got == 32
    assert sa.emit((x * y, x / 3), "numpy", {"x": "0.1"}).load().f(10) == (1.0, 1 / 30)
    assert "1.0/10.0" in sa.emit(x + y, "c", {"x": "0.1"})
    assert float(sa.emit(x / y, "mpmath").load().f(1, 3)) == 1 / 3


def test_other_languages() -> None:
    assert sa.emit((x**2 + y, y), JuliaCodePrinter()) == "f_0 = x .^ 2 + y\nf_1 = y\n"
    assert sa.emit("eq:Ttilde", "latex").strip() == sa.formula("eq:Ttilde").latex().strip()
    assert r"\frac{x}{3}" in sa.emit(x / 3, "latex")
    e = sa.expand(sa.Drift.general(), order=1)  # V's derivatives are arguments of plain names
    assert e.emit("latex").strip() == e.latex()
    assert "double V4_u1" in e.emit("c")


REFUSED: list[Any] = [
    lambda: sa.emit("eq:Ttilde", "basic"), lambda: sa.emit("eq:Ttilde", "c"),
    lambda: sa.emit(x > 0), lambda: sa.emit([], "c"), lambda: sa.emit(sympy.Symbol("x; y")),
    lambda: sa.emit(x, name="f()"), lambda: sa.emit(x, name="lambda"),
    lambda: sa.emit(x, name="numpy"), lambda: sa.emit(sympy.Function("q")(x), "c"),
    lambda: sa.emit(sympy.hyper([1, 2], [3], x), "c"), lambda: sa.emit(x, "c", {"y": 1}),
    lambda: sa.emit("eq:Ttilde", drift=sa.Drift("kappa - u", u)), lambda: sa.emit(x, "c").load(),
    lambda: sa.expand(sa.tanh(1, -1, 3), "density", order=1).emit("c"),
    lambda: sa.emit("eq:Ttilde", drift=sa.Drift.general()), lambda: sa.emit(x, "c", 1e300),
    lambda: sa.expand(sa.linear(1, 2)).emit(name="f(): pass\nimport os\ndef g"),
]  # fmt: skip


@pytest.mark.parametrize("ask", REFUSED)
def test_refused(ask: Any) -> None:
    with pytest.raises(sa.InputError):
        ask()


def test_only_drifts_beside_a_layer_are_written() -> None:
    for drift in (sa.Drift("-u", layer=None), sa.Drift("-u", noise="1 + u**2/4")):
        with pytest.raises(sa.RegionError):
            sa.emit("eq:Ttilde", "c", drift=drift)
