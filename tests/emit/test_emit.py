"""Every emitted file is run, and its values compared with exact ones."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.commands import main as cli
from symasym.formula import formula, labels
from tests import emitted
from tests.problems import BY_NAME, tagged

DOUBLE = ("numpy", "python", "c", "javascript")
RUN = (*DOUBLE, "mpmath")


def close(got: float, want: object, log: bool | str) -> bool:
    """Agreement to 1e-13: of logarithms in units of the larger of 1 and the logarithm."""
    want = mpmath.mpf(want) if not isinstance(want, Fraction) else mpmath.mpf(float(want))
    size = max(1, abs(want)) if log else abs(want)
    if log == "probability" and abs(want) < 1:
        # log(1 - q) for a tiny q, which is an exponential, and maybe no double.
        if abs(want) < 1e-300:
            return abs(float(got)) < 1e-300
        size = abs(want) * max(1, abs(mpmath.log(abs(want))))
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
SHAPES = [BY_NAME[name] for name in ("sine", "tanh", "hill", "hill n=1", "degree 12", "expression")]
EXITS = [
    BY_NAME[name]
    for name in (
        "friction",
        "friction down",
        "r=1e12",
        "linear repelling",
        "linear r=1/2",
        "constant",
        "sine",
        "hill",
        "quintic",
        "expression",
    )
]
# Given exactly, where doubles could not say them.
FOLDED = [
    BY_NAME[name] for name in ("fold + 1e-15", "fold + 1e-30", "kink - 1e-15", "k=1e-8", "mu=1e8")
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
        chance = ("log_occupation", "log_complement", "log_exit_probability")
        log = "probability" if function in chance else function.startswith("log")
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
    for p in EXITS:
        drift, name = p.make(), _name("C", p)
        files[name] = ("eq:C", drift)
        kappa, r = float(Fraction(p.kappa)), float(Fraction(p.r))
        for complement, function in ((False, "log_exit_probability"), (True, "log_complement")):
            want = sa.exit_probability(drift, kappa, r, complement=complement, log=True, dps=25)
            ask(name, function, (kappa, r), want)
    for p in SHAPES:
        drift, name = p.make(), _name("V", p)
        files[name] = ("eq:V", drift)
        for u in (-1.5, -0.75, 0.25, 0.875, 3.0):
            ask(name, "V", (u,), _potential(drift, u))
    for p in FOLDED:
        drift, name = p.make(), _name("T", p)
        files[name] = ("eq:Ttildesmall", drift)
        kappa, r = float(Fraction(p.kappa)), float(Fraction(p.r))
        want = sa.escape_time(drift, kappa, r, method="paper", dps=25, log=True)
        ask(name, "log_weak_noise_time", (kappa, r), want)
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
    from symasym.numbers.trees import MpmathOps

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


def test_mpmath_has_as_many_digits_as_are_asked_for():
    drift = BY_NAME["fold + 1e-30"].make()
    load = sa.emit("eq:Ttildesmall", "mpmath", drift=drift).load()
    want = sa.escape_time(drift, "1e-3", 10, method="paper", dps=60, log=True)
    with mpmath.workdps(60):
        assert abs(load.log_weak_noise_time("1e-3", 10, dps=50) / want - 1) < 1e-49
    density = sa.emit("eq:pss", "mpmath", drift=sa.friction(3, 1)).load()
    want = sa.stationary_density(sa.friction(3, 1, "0.5"), "0.3", "1/3", dps=30)
    got = density.stationary_density("1/3", "0.3", "0.5", dps=25)
    with mpmath.workdps(30):
        assert abs(got / want - 1) < 1e-24
    leave = sa.emit("eq:C", "mpmath", drift=sa.friction(3, 1)).load()
    want = sa.exit_probability(sa.friction(3, 1, "-0.3"), "0.5", 4, dps=30)
    with mpmath.workdps(30):
        assert abs(leave.exit_probability("0.5", 4, "-0.3", dps=25) / want - 1) < 1e-24
    # Numbers that were found by iteration have 50 digits and no more.
    cubic = sa.emit("eq:Ttildesmall", "mpmath", drift=BY_NAME["expression, cubic"].make()).load()
    want = sa.escape_time(
        BY_NAME["expression, cubic"].make(), "0.25", 8, method="paper", dps=50, log=True
    )
    with mpmath.workdps(50):
        assert abs(cubic.log_weak_noise_time("0.25", 8, dps=45) / want - 1) < 1e-44
    with pytest.raises(ValueError, match="give 1 to 50 digits"):
        cubic.weak_noise_time(1, 10, dps=51)


def test_mpmath_neither_reads_nor_changes_the_global_precision():
    load = sa.emit("beta", "mpmath").load()
    with mpmath.workdps(3):
        got = load.friction_breakaway("1/3", 1, dps=40)
        assert mpmath.mp.dps == 3
    with mpmath.workdps(40):
        assert abs(got - 16 * mpmath.sqrt(3) / 27) < 1e-38


# -- shapes of expressions -----------------------------------------------------------------------

X, Y = sympy.symbols("x y", real=True)


@pytest.mark.parametrize("target", [*DOUBLE[:3], "mpmath"])
def test_a_branch_that_is_not_taken_is_not_computed(target):
    if why := emitted.available(target):
        pytest.skip(why)
    shape = sympy.Piecewise((sympy.log(X), X > 0), (sympy.sqrt(-X) / (X - 1), True))
    load = sa.emit(shape * Y, target, name="shape").load()
    for x, y in ((2.0, 3.0), (-4.0, 1.0), (0.0, 1.0)):
        want = y * (math.log(x) if x > 0 else math.sqrt(-x) / (x - 1))
        assert float(load.shape(x, y)) == pytest.approx(want, rel=1e-15)


def test_arrays_take_each_branch_at_its_own_points():
    shape = sympy.Piecewise((sympy.log(X), X > 0), (1 / X, X < 0))
    load = sa.emit(shape + Y, name="shape").load()
    got = load.shape(np.array([[1.0], [-2.0]]), np.array([0.0, 1.0, 2.0]))
    np.testing.assert_array_equal(got, [[0.0, 1.0, 2.0], [-0.5, 0.5, 1.5]])
    with pytest.raises(ValueError, match="no case"):
        load.shape([1.0, 0.0], 0.0)


@pytest.mark.parametrize("target", [*DOUBLE[:3], "mpmath"])
@pytest.mark.parametrize(
    ("shape", "x", "y", "want"),
    [
        (sympy.tanh(X * Y) / X, 0, 3, 3),
        ((sympy.exp(X * Y) - 1) / X, 1e-300, 3, 3),
        ((sympy.exp(X * Y) - 1 - X * Y) / X**2, 0, 3, 4.5),
        ((sympy.exp(X * Y) - 1 - X * Y) / X**2, 1e-9, 3, 4.5 * (1 + 1e-9)),
        (sympy.sin(2 * X) / X + Y, 0, 3, 5),
        (sympy.log(1 + sympy.exp(X)) + Y, 5000, 1, 5001),
        (1 / (1 + sympy.exp(X)) + Y, 5000, 1, 1),
    ],
)
def test_removable_singularities_and_large_exponents(target, shape, x, y, want):
    if why := emitted.available(target):
        pytest.skip(why)
    assert float(sa.emit(shape, target).load().f(x, y)) == pytest.approx(want, rel=2e-15)


def test_values_beyond_doubles_are_infinite_without_a_word():
    for target in DOUBLE[:3]:
        if emitted.available(target):
            continue
        load = sa.emit("eq:Ttildesmall", target).load()
        arguments = (0.01, 10.0, 1.0, -1.0, 1.0, 0.5)
        assert load.weak_noise_time(*arguments) == math.inf
        assert load.log_weak_noise_time(*arguments) == pytest.approx(1e4 + math.log(2 * math.pi))


def test_what_is_given_is_folded_and_what_vanishes_is_told():
    code = sa.emit("eq:phifric0", "python", {"mu": 0, "alpha": "1/3"})
    assert "mu" not in code[code.index("import math") :]
    assert "Folded in: alpha = 1/3, mu = 0." in code
    assert "Left out: mu*(-u**3 + u) in friction_inside, which is 0 for" in code.replace(
        "\n#  ", ""
    )
    assert code.load().friction_inside(0.5, 0.25) == pytest.approx(0.75 - 1 / 6, rel=1e-15)
    time = sa.emit("eq:Ttildesmall", "python", {"mu": "1/3"}, drift=sa.friction())
    assert "Left out: the case with a well" in time
    assert "sin" not in time
    far = sa.emit("eq:Ttildesmall", "python", drift=BY_NAME["sine"].make().bind(b=0))
    assert "Left out: the well's term, there is no barrier beyond u = 0." in far
    # A function without a value there is left out, the others stay.
    code = sa.emit("friction-well", "python", {"mu": 0})
    assert "Left out: friction_barrier, which has no real value for mu = 0." in code
    assert "friction_barrier" not in code.functions
    assert "friction_slope_well" in code.functions


def test_constants_are_rounded_once():
    code = sa.emit(sympy.sqrt(2) * sympy.pi * X / 3 + sympy.exp(-1), "c")
    assert "0.36787944117144233 + x*1.480960979386122;" in code
    for constant, shown in (
        (sympy.exp(-1), 0.36787944117144233),
        (sympy.sqrt(2) * sympy.pi / 3, 1.480960979386122),
    ):
        # No double is nearer.
        away = abs(sympy.N(constant, 40) - sympy.Float(shown, 40))
        for other in (math.nextafter(shown, 0), math.nextafter(shown, 2)):
            assert away < abs(sympy.N(constant, 40) - sympy.Float(other, 40))


@pytest.mark.parametrize("target", ["mpmath", "numpy", "python"])
def test_a_function_takes_no_name_that_its_module_uses(target):
    written = sympy.sqrt(X) + sympy.Rational(1, 3)
    for name in sorted(set(re.findall(r"\b[A-Za-z]\w*", str(sa.emit(written, target))))):
        try:
            source = sa.emit(written, target, name=name)
        except sa.InputError:
            continue
        assert float(getattr(source.load(), name)(4)) == pytest.approx(7 / 3), name


def test_names_that_a_language_has_taken():
    names = sympy.symbols("lambda double out y0 ctx np gamma t0", positive=True)
    total = sympy.Add(*(k * sympy.exp(-s) for k, s in enumerate(names, 1)))
    order = sorted(range(8), key=lambda k: names[k].name)
    values = [0.25 * (k + 1) for k in range(8)]
    want = sum((k + 1) * math.exp(-values[k]) for k in range(8))
    for target in (*DOUBLE[:3], "mpmath"):
        if emitted.available(target):
            continue
        got = sa.emit(total, target).load().f(*(values[k] for k in order))
        assert float(got) == pytest.approx(want, rel=1e-14)


@pytest.mark.parametrize("target", DOUBLE[:3])
@pytest.mark.parametrize("name", ["map", "drift", "c", "log_escape_time", "zeros", "lambda", "v"])
def test_parameters_are_called_as_the_user_likes(target, name):
    if emitted.available(target):
        pytest.skip(emitted.available(target))
    slope = sympy.Symbol(name)
    drift = sa.Drift(sympy.Rational(1, 5) - slope * X - X**3, X)
    bound = drift.bind(**{name: "0.75"})
    time = sa.emit("eq:Ttilde", target, drift=drift).load().log_escape_time(0.5, 2.0, 0.75)
    assert float(time) == pytest.approx(sa.escape_time(bound, 0.5, 2, log=True), rel=1e-12)
    share = sa.emit("eq:P", target, drift=drift).load().occupation(0.5, 0.75)
    assert float(share) == pytest.approx(sa.occupation(bound, 0.5), rel=1e-12)


def test_latex_has_the_symbols_of_the_formula_and_no_names_of_programs():
    for label in ("saddle-recurrences", "pair-primitives", "eq:secondTerm", "eq:pss"):
        text = sa.emit(label, "latex")
        words = set(re.findall(r"\\mathrm\{([^}]*)\}", text))
        assert words <= {"even", "line", "odd", "ss"}
        # What the formula states stands there once, what a step states besides it as well.
        assert text.count(sa.formula(label).latex()) == 1
    assert r"\log T_2" in sa.emit("eq:secondTerm", "latex")
    # With numbers in it as well.
    assert "m_{n+1} = 5 m_n\n" in sa.emit("saddle-recurrences", "latex", {"n": 2})
    folded = sa.emit("eq:Ttildesmall", "latex", {"a_plus": "0.4"})
    assert (
        r"T \sim \frac{5 r}{2} + \frac{2 \pi}{\sqrt{-A'(u_1) A'(u_2)}} e^{2 D/\kappa^2}" in folded
    )


def test_latex_is_typeset(tmp_path):
    if shutil.which("pdflatex") is None:
        pytest.skip("no LaTeX on this machine")
    sources = [sa.emit(label, "latex") for label in ("eq:Ttildesmall", "eq:C", "folds", "eq:V2")]
    sources.append(sa.emit("eq:Ttildesmall", "latex", {"mu": 3}, drift=sa.friction()))
    sources.append(sa.emit("eq:pss", "latex", drift=sa.friction()))
    lines = [r"\documentclass{article}\usepackage{amsmath}\begin{document}"]
    for number, source in enumerate(sources):
        source.write(tmp_path / f"part{number}.tex")
        lines.append(rf"\input{{part{number}}}")
    (tmp_path / "main.tex").write_text("\n".join([*lines, r"\end{document}"]))
    command = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "main.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-2000:]


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sa.emit("Ttilde"), "is no formula; perhaps you mean .eq:Ttilde."),
        (lambda: sa.formula("fr1").emit("fortran"), "target is 'fortran'; give one of numpy"),
        (lambda: sa.emit("eq:V"), "has no closed form; give drift="),
        (lambda: sa.emit("eq:Ttilde", "c"), "has no closed form"),
        (lambda: sa.emit("folds", "c", {"q": 1}), "q is no parameter of folds"),
        (
            lambda: sa.emit("eq:Ttilde", "c", {"foo": 1}, drift=sa.friction(mu=3)),
            "foo is no parameter of eq:Ttilde; its parameters are mu, alpha, z0.",
        ),
        (lambda: sa.emit("folds", "c", {"mu": -1}), "mu is -1; folds supposes that it is positive"),
        (lambda: sa.emit("folds", "c", {"mu": "x"}), "mu is 'x'; give a finite real"),
        (lambda: sa.emit("turning-points", "c", {"mu": 0}), "has no value at mu = 0"),
        (lambda: sa.emit("beta", "c", {"mu": "1e700", "alpha": 1}), "beyond 1e±300"),
        (lambda: sa.emit(3.5j), "is no real number"),
        (lambda: sa.emit(object()), "is no formula, label or SymPy expression"),
        (lambda: sa.emit(sympy.gamma(X)), "has no closed form to emit"),
        (lambda: sa.emit(X > 0), "is a condition and no number"),
        (lambda: sa.emit(X, name="1x"), "give a name made of letters"),
        (lambda: sa.emit(X, drift=sa.friction()), "drift is for formulas with a label"),
        (lambda: sa.emit("folds", drift=sa.friction()), "folds takes no drift"),
        (lambda: sa.emit("eq:V", drift="friction"), "give a Drift"),
        (lambda: sa.emit("eq:V", drift=sa.friction(mu=[1, 2])), "mu is an array; leave it free"),
        (
            lambda: sa.emit("eq:V", parameters={"mu": 1}, drift=sa.friction(3)),
            "mu is in the drift already",
        ),
        (lambda: sa.emit("eq:V", drift=sa.Drift("u*w + 1", "w")), "is the name of the position"),
        (
            lambda: sa.emit("eq:Ttilde", drift=sa.Drift("kappa*u + 1", "u")),
            "a free parameter kappa, and so has the formula",
        ),
        (lambda: sa.emit("eq:P", drift=sa.linear(1, 2)), "does not slide"),
        (lambda: sa.emit("eq:P", drift=sa.tanh(1, -1)), "bind them"),
        (lambda: sa.emit("eq:Ttildesmall", drift=sa.sine()), "bind them, or use sa.friction"),
        (lambda: sa.emit("eq:Ttildesmall", drift=sa.linear(1, -1)), "no crossing region"),
        (lambda: sa.emit("eq:Ttildesmall", drift=sa.friction(3, 1, 1)), "has no value at"),
        (lambda: sa.emit("folds", "javascript").load(), "cannot be loaded into Python"),
        (lambda: sa.emit("folds", "c").write("folds.txt"), "let its name end in .c"),
        (lambda: sa.emit("folds").write("f.c"), r"'f.c' is to hold numpy, and .c .* end in .py"),
        (lambda: sa.emit("folds", "latex").write("f.mjs"), "let its name end in .tex"),
        (lambda: sa.emit("folds", "javascript").write("f.h"), "let its name end in .js"),
        (lambda: sa.emit("folds", "tex"), "perhaps you mean 'latex'"),
        (lambda: sa.emit("folds").write("/proc/none/folds.py"), "cannot be written"),
    ],
)
def test_bad_input_is_told_in_one_sentence(call, message):
    with pytest.raises(sa.SymasymError, match=message) as told:
        call()
    assert str(told.value).endswith(".") or "untouched" in str(told.value)


def test_unknown_endings_are_free(tmp_path):
    for target, name in (("numpy", "f.txt"), ("python", "f"), ("javascript", "f.cjs")):
        assert sa.emit("folds", target).write(tmp_path / name) == [tmp_path / name]


def test_without_a_compiler(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(sa.InputError, match="there is no C compiler here"):
        sa.emit("folds", "c").load()


def test_the_command(tmp_path, capsys):
    place = tmp_path / "time.c"
    words = ["emit", "eq:Ttildesmall", "--target", "c", "-o", str(place)]
    assert cli.main([*words, "--drift", "friction", "--set", "mu=3", "--set", "kappa=0.1"]) == 0
    assert capsys.readouterr().out.split() == [str(place)]
    # <time.h> is the system's.
    assert [file.name for file in tmp_path.iterdir()] == ["time.c"]
    assert "double log_weak_noise_time(double r, double alpha, double z0);" in place.read_text()
    assert cli.main([*words, "--header"]) == 0
    assert capsys.readouterr().out.split() == [str(place), str(tmp_path / "time.h")]
    assert '#include "time.h"' in place.read_text()
    assert cli.main(["emit", "folds", "--target", "c"]) == 0
    assert "#include <math.h>" in capsys.readouterr().out
    assert cli.main(["emit", "folds", "--target", "python", "--set", "alpha=1"]) == 0
    assert "def friction_folds(mu):" in capsys.readouterr().out
    for words, message in (
        (["nope", "--target", "c"], "'nope' is no formula"),
        (["folds", "--target", "basic"], "target is 'basic'"),
        (["folds", "--target", "c", "--header"], "say where to with -o"),
        (["folds", "--target", "python", "--header", "-o", "/proc/x.py"], "python has no header"),
        (["folds", "--target", "latex", "-o", "/proc/none/x.tex"], "cannot be written"),
        (["folds", "--target", "python", "--set", "mu"], "write it as NAME=NUMBER"),
    ):
        assert cli.main(["emit", *words]) == 2
        assert message in capsys.readouterr().err


# -- a language of one's own ---------------------------------------------------------------------


def test_a_target_is_added_and_listed_and_none_is_replaced(monkeypatch):
    from symasym.derivation.code import DIALECTS, Dialect
    from symasym.emit import add_target, source

    monkeypatch.setattr(source, "_RENDER", dict(source._RENDER))
    monkeypatch.setitem(DIALECTS, "names", Dialect(""))
    add_target("names", lambda program, functions: "".join(f.name for f in functions), Dialect("f"))
    found = sa.emit("eq:Plarge2", "names")
    assert str(found) == "strong_noise_occupation" == found.functions[0]
    with pytest.raises(sa.InputError, match="names cannot be loaded"):
        found.load()
    with pytest.raises(sa.InputError, match="'basic'; give one of numpy.*, latex, names"):
        sa.emit("eq:Plarge2", "basic")
    for taken in ("c", "a b", ""):
        with pytest.raises(sa.InputError, match="none of numpy"):
            add_target(taken, found._program, Dialect(""))


@pytest.mark.parametrize("power", ["-5/2", "-3/2", "-1/2", "1/2", "5/2"])
@pytest.mark.parametrize("factor", ["1", "3", "1/2", "c**2", "sqrt(c)", "1/c", "log(c)"])
def test_half_integer_powers_in_products(factor, power):
    """Also as a lone denominator, c/x**(5/2)."""
    c, x = sympy.symbols("c x", positive=True)
    e = sympy.sympify(factor, {"c": c}) * x ** sympy.Rational(power)
    names = sorted(s.name for s in e.free_symbols)
    values = {"c": 1.7, "x": 2.3}
    got = sa.emit(e, "python").load().f(*[values[n] for n in names])
    assert got == pytest.approx(float(e.subs({c: 1.7, x: 2.3})), rel=1e-14)


def test_integers_that_python_does_not_print() -> None:
    with pytest.raises(sa.InputError, match="more than 4,300 digits; give it shorter numbers"):
        sa.emit(sympy.Rational(1, 10**5000), "c")
