"""What is committed under symasym/generated is what the derivations emit today."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy

from derivations import emit
from symasym import expand, friction
from symasym.base.errors import InputError
from symasym.derivation.code import NotEmittable, code
from symasym.formula import formula, labels
from symasym.generated import formulas, mpmath_formulas, numpy_formulas

ROOT = Path(__file__).parents[2]


def test_committed_is_what_is_emitted():
    # Symbols of expansions may be taken for those of derivations of the same name.
    for order, noise in enumerate(("uniform", "weak")):
        made = expand(friction(), noise=noise, order=order, case="start well barrier")
        assert made.expression.free_symbols
    for name, content in emit.sources().items():
        committed = (emit.FOLDER / name).read_text(encoding="utf-8")
        assert committed == content, f"{name} is stale: run python -m derivations.emit"
    assert {p.name for p in emit.FOLDER.iterdir() if p.is_file()} == set(emit.sources())


def test_emission_does_not_depend_on_the_hash_seed(tmp_path):
    program = (
        "import hashlib\nfrom derivations.emit import sources\n"
        "print(hashlib.sha256(repr(sources()).encode()).hexdigest())\n"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=ROOT,
            text=True,
            check=True,
            capture_output=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(found) == 1


def _arguments(item, rng):
    """Random numbers that the symbols' assumptions allow, by argument name, and by symbol."""
    by_symbol = {}
    expression = emit.expression(item)
    pieces = expression if isinstance(expression, tuple) else (expression,)
    for s in {s for e in pieces for s in e.free_symbols}:
        size = sympy.Rational(int(rng.integers(20, 180)), 100)
        by_symbol[s] = -size if s.is_negative else size
    names = {emit.NAMES.get(s.name, s.name): v for s, v in by_symbol.items()}
    return names, by_symbol, pieces


@pytest.mark.parametrize("item", emit.EMITTED, ids=lambda item: item.name)
def test_emitted_functions_have_the_expressions_values(item):
    rng = np.random.default_rng(5)
    for _ in range(3):
        names, by_symbol, pieces = _arguments(item, rng)
        exact = [sympy.N(p.subs(by_symbol), 40) for p in pieces]
        if any(not value.is_real for value in exact):
            continue
        values = getattr(numpy_formulas, item.name)(**{k: float(v) for k, v in names.items()})
        got = values if isinstance(values, tuple) else (values,)
        for one, want in zip(got, exact, strict=True):
            assert float(one) == pytest.approx(float(want), rel=1e-11, abs=1e-300)
        with mpmath.workdps(35):
            many = {k: mpmath.mpf(v.p) / v.q for k, v in names.items()}
            values = getattr(mpmath_formulas, item.name)(mpmath.mp, **many)
            got = values if isinstance(values, tuple) else (values,)
            for one, want in zip(got, exact, strict=True):
                assert abs(one - mpmath.mpf(str(want))) <= abs(mpmath.mpf(str(want))) * 1e-30


@pytest.mark.parametrize("item", emit.EMITTED, ids=lambda item: item.name)
def test_one_text_serves_both_arithmetics(item):
    """What NumPy would be given besides is in no formula: e^x that overflows inside a logarithm."""
    stated = emit.expression(item)
    names, _ = emit.named(stated)
    floats, digits = (code(stated, target, names) for target in ("numpy", "mpmath"))
    assert floats.replace("np.arc", "np.a").replace("np.", "ctx.") == re.sub(
        r"ctx\.mpf\((\d+)\)", r"\1", digits
    )


PLAIN = [item for item in emit.EMITTED if item.plain]


@pytest.mark.parametrize("item", PLAIN, ids=lambda item: item.name)
def test_plain_functions_are_exact_in_exact_arithmetic(item):
    names, by_symbol, pieces = _arguments(item, np.random.default_rng(6))
    exact = [
        Fraction(int(v.p), int(v.q)) for v in (sympy.expand(p.subs(by_symbol)) for p in pieces)
    ]
    values = getattr(formulas, item.name)(
        **{k: Fraction(int(v.p), int(v.q)) for k, v in names.items()}
    )
    assert list(values if isinstance(values, tuple) else (values,)) == exact


def test_digits_are_kept_where_the_formula_as_it_stands_loses_them():
    x = 1e-9
    assert numpy_formulas.constant_single(x) == pytest.approx(1 - x / 2, rel=1e-15)
    assert numpy_formulas.log_exit_share(1e-20, 1.0) == -1e-20
    # e^2000 is no float64, the logarithm of the sum is.
    a, b = sympy.symbols("a b", real=True)
    total = code(sympy.log(sympy.exp(a) + sympy.exp(b)), "numpy")
    given = {"np": np, "a": 2000.0, "b": 1999.0}
    assert eval(total, given) == pytest.approx(2000.3132616875182)
    assert numpy_formulas.friction_breakaway(1e200, 1.0) == pytest.approx(2e200 / 27**0.5)


def _called() -> tuple[set[str], list[re.Pattern[str]]]:
    """Names that the package takes, or that hold its own formulas, and patterns of others."""
    names, patterns = set(), []
    held = ROOT / "tests" / "generated" / "test_evaluated.py"
    for path in (*(ROOT / "symasym").rglob("*.py"), held):
        if path.parent == emit.FOLDER:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.ImportFrom):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                names.add(node.value)
            elif isinstance(node, ast.JoinedStr):
                parts = [str(v.value) if isinstance(v, ast.Constant) else "" for v in node.values]
                if len("".join(parts)) > 8 and " " not in "".join(parts):
                    patterns.append(re.compile(".+".join(map(re.escape, filter(None, parts)))))
    return names, patterns


#: What the pictures of the site draw, until the generated files go.
IDLE = {"log_well_term", "tail_left", "tail_right", "density_of_sides", "escape_time_of_sides"}


def test_every_emitted_function_is_called():
    names, patterns = _called()
    names |= IDLE
    idle = [
        item.name
        for item in emit.EMITTED
        if item.name not in names and not any(p.match(item.name) for p in patterns)
    ]
    assert not idle
    # The test itself: a name that nobody has is found.
    assert "friction_nothing" not in names


def test_plain_code_refuses_what_not_every_arithmetic_has():
    x = sympy.Symbol("x", positive=True)
    for expression in (
        sympy.sqrt(x),
        x ** sympy.Rational(5, 2),
        sympy.exp(x),
        sympy.pi * x,
        x + sympy.Rational(1, 2),
    ):
        with pytest.raises(NotEmittable):
            code(expression, "plain")
    assert code(x / 2 + x**2, "plain") in ("x/2 + x**2", "x**2 + x/2")


def test_emitted_numpy_code_broadcasts():
    kappa = np.array([[0.5], [1.0]])
    r = np.array([5.0, 10.0, 20.0])
    assert numpy_formulas.outer_piece(kappa, r, 0.4).shape == (2, 3)


def test_friction_is_what_was_emitted():
    """sa.friction evaluates the emitted formulas."""
    drift = friction(mu=3, alpha=1, z0="-0.4")
    u = np.linspace(-0.99, 0.99, 21)
    np.testing.assert_allclose(
        drift(u), numpy_formulas.friction_inside(u, 3.0, 1.0, -0.4), rtol=1e-13, atol=1e-14
    )
    assert drift(-2) == pytest.approx(numpy_formulas.friction_left(1.0, -0.4))
    assert drift(2) == pytest.approx(numpy_formulas.friction_right(1.0, -0.4))
    np.testing.assert_allclose(
        drift.potential_at(u),
        numpy_formulas.friction_potential_inside(u, 3.0, 1.0, -0.4),
        rtol=1e-9,
        atol=1e-10,
    )
    assert drift.beta() == pytest.approx(numpy_formulas.friction_breakaway(3.0, 1.0))
    assert drift.turning_points() == pytest.approx(numpy_formulas.friction_turning_point(3.0))
    assert drift.folds().z0 == pytest.approx(numpy_formulas.friction_folds(3.0, 1.0))


def test_formula():
    found = formula("eq:Ttildesmall")
    kappa = sympy.Symbol("kappa", positive=True)
    assert found.expression.has(sympy.exp)
    assert found.remainder.has(kappa)
    assert found.limit == "kappa -> 0"
    assert found.assumptions
    assert [step["name"] for step in found.trace][0] == "sum"
    assert " + O(" in found.latex()
    assert "def weak_noise_time(" in found.emit()
    assert "ctx.exp" in found.emit("mpmath")
    # No function was emitted for this one: all its symbols become arguments.
    assert "def cubic(alpha, mu, u, z0):" in formula("cubic").emit()


def test_formula_refusals():
    with pytest.raises(InputError, match="is no formula; perhaps you mean .eq:Ttilde."):
        formula("Ttilde")
    with pytest.raises(InputError, match="is not derived. Definition"):
        formula("eq:genSDE")


def test_every_formula_reads_back():
    for label in labels():
        found = formula(label)
        assert found.expression is not None
        assert found.latex()
        assert found.error
        assert found.trace


def test_reading_a_formula_loads_neither_sympy_nor_derivations():
    program = (
        "import sys\nfrom symasym.formula import formula\nf = formula('eq:Ttildesmall')\n"
        "f.latex(); f.trace\n"
        "assert 'sympy' not in sys.modules and 'derivations' not in sys.modules\n"
        "import symasym.generated.numpy_formulas\nassert 'sympy' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)
