"""Formulas against the numbers of the methods, the exact T and textbooks."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.formulas.cases import cases_of
from tests.formulas.values import by_definitions, roots_of
from tests.latex import compiled, needs_latex


class Scene(NamedTuple):
    """A drift whose parameters may be free, values for them, and where it is asked for."""

    free: sa.Drift
    values: dict[str, Any]
    kappa: str
    start: str = "0"
    r: str = "3/2"
    slides: bool = False

    @property
    def drift(self) -> sa.Drift:
        return self.free.bind(**self.values)

    def __str__(self) -> str:
        return f"{self.drift} from {self.start}"

    def formula(self, quantity: str, order: int, noise: Any = "weak") -> sa.Expansion:
        """With the parameters free, in the case that the scene is in."""
        start = Fraction(self.start if quantity[-1] in "TC" else -1)
        case = None if noise == "strong" else str(cases_of(self.drift, start)[0])
        return sa.expand(
            self.free, quantity, noise=noise, order=order, start=self.start, case=case
        )  # fmt: skip


def friction(z0: str, kappa: str, start: str = "0", **more: Any) -> Scene:
    return Scene(sa.friction(), {"mu": 3, "alpha": 1, "z0": z0}, kappa, start, **more)


SCENES = [
    friction("-0.4", "1/10"), friction("2.4", "1/10", "-1/5"), friction("-1.2", "1/8"),
    friction("0.5", "1/5", slides=True),
    Scene(sa.linear(), {"a_minus": 1, "a_plus": "-1/2"}, "1/5", slides=True),
    Scene(sa.Drift("u*(c - u**2)"), {"c": "1/2"}, "1/6", "1/4"),
    Scene(sa.Drift("-(u - c)*(u + 1/2)*(u - 2/3)*(1 + u/3)"), {"c": "1/4"}, "1/20", "-1/5"),
    Scene(sa.Drift("c - u + u**3/3"), {"c": "1/5"}, "2/5", "-1"),
    Scene(sa.Drift("u/2 - u**2 - c"), {"c": "1/20"}, "1/20", "1"),
    Scene(sa.Drift("c", "u"), {"c": "2/3"}, "1/2", "1/5"),
    Scene(sa.Drift("c", "u"), {"c": "-2/3"}, "1/2"),
    Scene(sa.Drift("c + cos(2*u)"), {"c": "-1/5"}, "1/10"),
    # Zeros that are no simple ones, but beyond the layer.
    Scene(sa.Drift("(u - 2)**2*(c - u)"), {"c": "1/2"}, "1/5"),
]  # fmt: skip
#: Starts on a well or a barrier; what the odd derivatives add is seen at such noise.
ON_ZERO = [
    Scene(sa.Drift("-c*u + u**2/3 - u**3/5"), {"c": "3/2"}, "2/5"),
    Scene(sa.Drift("(u - 1/4)*(2 + u)*(2 - c*u)"), {"c": 3}, "1/5", "1/4"),
    Scene(sa.Drift("(2*u - 1)*(u + c)"), {"c": "1/2"}, "2/5", "1/2"),
]
STRONG = [
    friction("0.5", "7/2", slides=True), friction("-0.4", "7/2", "1/5", r="4"),
    friction("0.5", "10", "-1", r="4"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("scene", "noise"),
    [*((s, "weak") for s in (*SCENES, *ON_ZERO)), *((s, "strong") for s in STRONG)],
    ids=str,
)
def test_the_formula_is_the_number(scene: Scene, noise: str) -> None:
    """All contributions, with the parameters free."""
    for quantity in ("T", *(("1 - C", "P", "1 - P") if scene.slides else ("C",))):
        e = scene.formula(quantity, 2 if len(scene.free.free) > 1 else 1, noise)
        r = () if quantity[-1] == "P" else (scene.r,)
        with mpmath.workdps(25):
            want = e.bind(**scene.values).evaluate(scene.kappa, *r, dps=15)
            got = by_definitions(e, scene.drift, scene.kappa, scene.r)
            assert abs(got / want - 1) < 1e-13, quantity


@pytest.mark.parametrize("scene", [SCENES[0], ON_ZERO[0]], ids=str)
def test_errors_of_t_fall_as_they_should(scene: Scene) -> None:
    """As kappa^(2 order + 2), against the exact T; all as one expression."""
    for order in (0, 1, 2):
        e, errors = scene.formula("T", order), []
        with mpmath.workdps(60):
            for kappa in ("0.02", "0.01"):
                exact = sa.escape_time(scene.drift, kappa, scene.r, dps=40)
                value = by_definitions(e, scene.drift, kappa, scene.r, e.expression)
                errors.append(abs(value / exact - 1))
            slope = float(mpmath.log(errors[0] / errors[1], 2))
        assert slope == pytest.approx(2 * order + 2, abs=0.25), order


def test_the_first_correction_is_the_textbooks() -> None:
    """T = T0 (1 + x (B - W)), x = kappa^2/2, V4/(8 V2^2) - 5 V3^2/(24 V2^3) at barrier and well.

    Laplace's next term (DLMF 2.4(iv); J. Wojdylo, SIAM Rev. 48 (2006) 76) of either integral of
    Kramers' product.
    """
    e = sa.expand(sa.Drift.general(), order=4)
    (term,) = e.terms
    v = {s.name: s for s in term.expression.free_symbols}

    def shape(u: str) -> Any:
        two, three, four = (v[f"V{k}({u})"] for k in ("''", "'''", "^(4)"))
        return four / (8 * two**2) - 5 * three**2 / (24 * two**3)

    assert sympy.expand(term.coefficients[1] - (shape("u2") - shape("u1")) / 2) == 0
    lead = 2 * sympy.pi / sympy.sqrt(-v["V''(u1)"] * v["V''(u2)"])
    assert sympy.simplify(term.front / lead) == 1
    assert [len(c.args) for c in term.coefficients[1:]] == [4, 14, 42, 113]
    assert "V(u2) > V(u1)" in map(str, e.conditions)


WALL = {"ends": (-3, "1/2"), "start": -1}


@pytest.mark.parametrize(
    ("form", "noise", "ito", "values", "scene"),
    [
        ("u - u**3", "1 + u/4", 0, {}, WALL),
        ("u - u**3", "exp(u/3)", "stratonovich", {}, WALL),
        ("u - u**3", "1 + b*u**2", "stratonovich", {"b": "1/4"}, WALL),
        # SymPy's antiderivative of phi/sigma^2 has no logarithm while the sign of b is unknown.
        ("c - u**2", "1 + b*u**2", 0, {"b": 1, "c": "1/4"}, {"ends": (-2, 4), "start": "1/2"}),
        ("a*u - u**3", "1 + u/4", 0, {"a": "4/5"}, WALL),
        ("a*u - b*u**3", None, 0, {"a": "4/5", "b": "1/2"}, WALL),
        ("(u - p)*(a - u**2)", None, 0, {"a": "4/5", "p": "1/5"}, WALL | {"ends": (-3, "4/5")}),
    ],
)
def test_kramers_formula_without_a_layer_and_with_noise(
    form: str, noise: str, ito: Any, values: Any, scene: Any
) -> None:
    """The well's only way out, in closed form; each order gains its power."""
    free = sa.Drift(form, layer=None, noise=noise, ito=ito)
    exact = sa.escape_time(free.bind(**values), "1/20", **scene, dps=25)
    errors, known = [], {"kappa": "1/20", **values}
    for order in (0, 1):
        e = sa.expand(free, order=order, start=scene["start"])
        names = sorted(e.formula.free_symbols, key=str)
        of = sympy.lambdify(names, e.formula, "mpmath")
        with mpmath.workdps(30):
            at = [mpmath.mpf(sympy.Rational(known[s.name])) for s in names]
            errors.append(abs((value := of(*at)) / exact - 1))
            code = e.emit("numpy").load()
            floats = {s.name: float(x) for s, x in zip(names, at, strict=True)}
            assert code.f(**floats) == pytest.approx(float(value))
            assert np.isfinite(code.log_f(**floats | {"kappa": 1e-3}))  # where T overflows
            found = e.bind(**values).evaluate("1/20", ends=scene["ends"], dps=20)
            assert abs(found / exact - 1) < 3 * errors[-1]
    assert errors[0] < 4e-3
    assert errors[1] < errors[0] / 50


def test_kramers_prefactor_is_simplified() -> None:
    found = sa.expand(sa.Drift("u - u**3", layer=None, noise="1 + u/4"), order=0)
    kappa = next(iter(found.formula.free_symbols))
    lead = 4 * sympy.sqrt(2) * sympy.pi / 3  # 1/sigma(-1) by Ito, curvatures 2/sigma^2 and 1
    rise = 16 * (188 * sympy.log(2) - 94 * sympy.log(3) - 27)
    ratio = found.formula / lead
    assert isinstance(ratio, sympy.exp)
    assert sympy.expand(ratio.args[0] * kappa**2 - rise) == 0
    free = sa.expand(sa.Drift("a*u - c - u**3", layer=None, noise="1 + s*u", ito="stratonovich"))
    assert {"V''(u1)", "sigma(u2)"} <= {s.name for s in free.definitions}
    tilted = sa.Drift("u - u**3 + 1/10", layer=None)  # its zeros are no radicals but numbers
    code = sa.expand(tilted, start=-1, order=1).emit("numpy").load()
    exact = sa.escape_time(tilted, "0.05", ends=(-2, "1/2"), start=-1)
    assert code.f(0.05) == pytest.approx(exact, rel=1e-4)
    for away, start in (("1 + u**2", 0), ("u**2 - 1", 5)):
        with pytest.raises(sa.InputError, match="does not lead from"):
            sa.expand(sa.Drift(away, layer=None), start=start)
    for drift, why in (("1 - u**2", "over one barrier"), ("a - u**2", "no value is set")):
        mirrored = sa.expand(sa.Drift(drift, layer=None))
        assert str(mirrored.case) == "barrier well start"
        with pytest.raises(sa.InputError, match=why):
            mirrored.evaluate("0.3", 2)
    on_top = sa.expand(sa.Drift("u - u**3", layer=None))  # from there T is half of the formula's
    with pytest.raises(sa.InputError, match="off the barrier"):
        on_top.evaluate("0.2", ends=(-2, "1/2"))
    assert on_top.evaluate("0.2", ends=(-2, "1/2"), start=-1) > 1.2e6
    with pytest.raises(sa.InputError, match="no value is set for a"):
        sa.expand(sa.Drift("a*u - u**3", layer=None)).evaluate("0.2", ends=(-2, 1))
    with pytest.raises(sa.RegionError, match="has no layer"):
        sa.expand(sa.Drift("u - u**3", layer=None), "C")
    # Numbers take a start beside a well to be there, a formula does not.
    beside = sa.expand(sa.friction(3, 1, "-0.4"), start="0.3969")
    assert str(beside.case) == "well start barrier"


@pytest.mark.parametrize("scene", [SCENES[0], *ON_ZERO[:2]], ids=str)
def test_contributions_are_the_sum(scene: Scene) -> None:
    """C, 1 - C or both times each, beside what has no exponential, to terms left out."""
    e, *both = (scene.formula(q, 2) for q in ("T", "C", "1 - C"))
    with mpmath.workdps(40):

        def value(e: sa.Expansion, f: Any = None) -> Any:
            return by_definitions(e, scene.drift, "1/30", scene.r, f)

        T, C, rest = map(value, (e, *both))
        share = {"C": C, "1 - C": rest, "C (1 - C)": C * rest}
        total = sum(share[t.weight] * value(e, t.expression) for t in e.terms)
        for side, chance in (("D-", C), ("D+", rest)):
            (D,) = (v for s, v in e.definitions.items() if s.name == side)
            # The regular part, and half of a start's own Gaussian.
            names = re.compile(r"M.|[NHQWB]0|lam|x|V''\(.*\)")
            alone = [a for a in D.args if not a.has(sympy.exp)
                     and all(names.fullmatch(s.name) for s in a.free_symbols)]  # fmt: skip
            total += chance * value(e, sympy.Symbol("lam", positive=True) * sympy.Add(*alone))
        assert abs(total / T - 1) < 1e-7


def test_what_is_written() -> None:
    """No symbol for 0, for a number or for a parameter alone; closed forms of a constant drift."""
    names = {s.name for s in sa.expand(sa.Drift("u*(c - u**2)"), order=2).definitions}
    assert not {"V'''(0)", "V^(5)(u1)", "V'(0)"} & names
    slides = sa.expand(sa.Drift("c - 2*u"), "P", noise="strong").conditions
    assert sympy.And(*slides).as_set() == sympy.Interval.open(-2, 2)
    names = {s.name for s in sa.expand(sa.linear(), order=2).definitions}
    assert not any(name.startswith(("phi", "V'''", "V^")) for name in names)
    a, r, kappa = (sympy.Symbol("a", real=True), *sympy.symbols("r kappa", positive=True))
    constant = [sa.expand(sa.Drift("a", "u"), q).expression for q in ("T", "C", "1 - C")]
    assert constant[0] == r / a * sympy.tanh(a * r / kappa**2)
    assert sympy.simplify(constant[1] + constant[2]) == 1


@needs_latex
def test_latex_compiles(tmp_path: Path) -> None:
    options: list[dict[str, Any]] = [
        {"order": 1}, {"quantity": "1 - C", "order": 1}, {"noise": "strong", "order": 1},
        {"noise": "uniform"},
    ]  # fmt: skip
    texts = [sa.expand(sa.friction(), **option).latex() for option in options]
    page = tmp_path / "page.tex"
    page.write_text(
        "\\documentclass{article}\\usepackage{amsmath}\\usepackage[paperwidth=300cm,paperheight=400cm]"
        "{geometry}\\begin{document}" + "".join(rf"\[{t}\]" for t in texts) + "\\end{document}"
    )
    compiled(page)


@pytest.mark.parametrize(
    ("drift", "quantity", "words"),
    [
        (sa.friction(), "T",
         "start well barrier, start well, well start, barrier well start, start"),
        (sa.friction(), "P", "start well"),
        (sa.hill(1, -1), "T", "start well, well start"),
        (sa.Drift("b + c*u - u**3"), "P", "start well, start well barrier well"),
        (sa.Drift("u*(c - u**2)"), "T", "start=well, well start=barrier well, start=barrier"),
        # Zeros 1e-3 apart are two.
        (sa.Drift("c*(u - 1/2)*(u - 501/1000)"), "T", "start well barrier, start barrier well"),
    ],
)  # fmt: skip
def test_cases_hold_where_they_say(drift: sa.Drift, quantity: Any, words: str) -> None:
    """Each example is in its case, and fulfils its conditions."""
    found = sa.expand(drift, quantity, order=0).cases()
    assert ", ".join(map(str, found)) == words
    for case in found:
        bound = drift.bind(**case.example)
        e = sa.expand(drift, quantity, order=0, case=case)
        assert cases_of(bound, e.start) == (case,)
        with mpmath.workdps(30):
            zeros = [z for z in roots_of(bound).values() if abs(z) > 1e-9 or not case.at_start]
            known = {n: sympy.Rational(str(x)) for n, x in bound.values.items()} | {"r": 3}
            known |= {f"u{k}": sympy.sympify(z) for k, z in enumerate(zeros, 1)}
            for c in e.conditions:
                at = {s: known[s.name] for s in c.free_symbols}
                assert abs(c.lhs.subs(at)) < 1e-12 if isinstance(c, sympy.Eq) else c.subs(at), c


def test_numbers_of_a_bound_drift() -> None:
    """Parameters stay exact; critical points, heights and finite parts have 50 digits."""
    e = sa.expand(sa.friction(), order=2, case="start well barrier")
    e = e.bind(mu=3).bind(alpha=1, z0="-0.4")
    assert not e.expression.atoms(sympy.Float)
    array = sa.escape_time(e.drift, [0.05, 0.1], 10, method="laplace", order=2)
    assert np.array_equal(e.evaluate([0.05, 0.1], 10), array)
    with mpmath.workdps(40):
        for one in (e, sa.expand(ON_ZERO[1].drift, start="1/4")):
            for s, x in one.numbers.items():
                want = by_definitions(one, one.drift, "1", "2", s)
                assert abs(mpmath.mpf(str(x)) / want - 1) < 1e-35, s


@pytest.mark.parametrize(
    ("drift", "options", "words"),
    [
        (sa.friction(), {"quantity": "Q"}, "quantity is 'Q'; give one of"),
        ("friction", {}, "drift is .friction.; give a Drift"),
        (sa.friction(), {"order": 9}, "order is 9; give a whole number from 0 to 8"),
        *[(sa.friction(), {"case": case}, f"case '{case}'")
          for case in ("well well start", "barrier well barrier start well", "start=well")],
        (sa.friction(3, 1, "-0.4"), {"case": "start well"}, "case 'start well'"),
        (sa.friction(), {"quantity": "P", "case": "barrier"}, "its cases are .start well."),
        *[(sa.Drift.general(), {"quantity": name}, "has no formula") for name in ("C", "P")],
        (sa.Drift.general(), {"case": "well barrier start"}, "case 'well barrier start'"),
        (sa.friction(), {"start": "-9/8"}, "from -1.125 has no formula"),
        (sa.Drift("c + sin(2*u) + 2*u**2"), {"noise": "uniform", "case": "start"},
         "use method=.uniform. for numbers"),
        *[(drift, {"noise": "strong"}, "no polynomial in u, so that the moments")
          for drift in (sa.Drift.general(), sa.Drift("1 + sin(u)"))],
        *[(sa.Drift(f"{name} + u - 4*u**3"), {"order": 1}, f"has a parameter {name}")
          for name in ("kappa", "T", "C", "h1", "W_1", "lambda", "R", "r")],
        *[(sa.linear(-4, 2), {"quantity": "P", "noise": noise}, "make no sliding region")
          for noise in ("weak", "strong")],
        (sa.Drift("L - u + u**3"), {"noise": "strong"}, "has a parameter L"),
        (sa.Drift("1/4 - u + D*u**3"), {"noise": "uniform"}, "has a parameter D"),
        (sa.Drift("1/4 - u + u1*u**3"), {"order": 1}, "has a parameter u1"),
    ],
)  # fmt: skip
def test_bad_input(drift: sa.Drift, options: dict[str, Any], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, **options)


def test_a_double_zero_is_told() -> None:
    with pytest.raises(sa.AccuracyError, match="A vanishes at u = 0.5, its slope too"):
        sa.expand(sa.Drift("(u - 1/2)**2*(2 - 3*u)"))
