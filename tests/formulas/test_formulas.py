"""Formulas against the numbers of the methods, the exact T, emitted code and textbooks."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.derivation.tex import tex
from symasym.formulas.cases import case_of
from symasym.formulas.formula import _shortest
from symasym.formulas.letters import FinitePart
from symasym.formulas.strong import written_out
from tests.derivation.test_printing import _AIRY, Reader
from tests.formulas.values import by_definitions, roots_of
from tests.latex import compiled, needs_latex

DIGITS = 30


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


def friction(z0: str, kappa: str, start: str = "0", **more: Any) -> Scene:
    return Scene(sa.friction(), {"mu": 3, "alpha": 1, "z0": z0}, kappa, start, **more)


SCENES = [
    friction("-0.4", "1/10"), friction("-0.4", "1/10", "1/2"), friction("2.4", "1/10", "-1/5"),
    friction("-1.2", "1/8"), friction("0.5", "1/5", slides=True),
    Scene(sa.linear(), {"a_minus": 1, "a_plus": "-1/2"}, "1/5", slides=True),
    Scene(sa.linear(), {"a_minus": "-1/3", "a_plus": 1}, "1/4", "1/5"),
    Scene(sa.Drift("u*(c - u**2)"), {"c": "1/2"}, "1/6", "1/4"),
    Scene(sa.Drift("-(u - c)*(u + 1/2)*(u - 2/3)*(1 + u/3)"), {"c": "1/4"}, "1/20", "-1/5"),
    Scene(sa.Drift("c - u + u**3/3"), {"c": "1/5"}, "2/5", "-9/8"),
    Scene(sa.Drift("c - u + u**3/3"), {"c": "1/5"}, "2/5", "-1"),
    Scene(sa.Drift("u/2 - u**2 - c"), {"c": "1/20"}, "1/20", "1"),
    Scene(sa.Drift("c - u/3"), {"c": 1}, "1/8", "9/8"),
    Scene(sa.Drift("c", "u"), {"c": "2/3"}, "1/2", "1/5"),
    Scene(sa.Drift("c", "u"), {"c": "-2/3"}, "1/2"),
    Scene(sa.Drift("cos(2*u) - 1/5"), {}, "1/10"),
    # Zeros that are no simple ones, but beyond the layer.
    Scene(sa.Drift("(u - 2)**2*(1/2 - u)"), {}, "1/5"),
]  # fmt: skip
#: Starts on a well or a barrier; what the odd derivatives add is seen at such noise.
ON_ZERO = [
    Scene(sa.Drift("-c*u + u**2/3 - u**3/5"), {"c": "3/2"}, "2/5"),
    Scene(sa.Drift("c*u + u**2/3 + u**3/5"), {"c": "3/2"}, "2/5"),
    Scene(sa.Drift("(u - 1/4)*(2 + u)*(2 - c*u)"), {"c": 3}, "1/5", "1/4"),
    Scene(sa.Drift("(2*u - 1)*(u + c)"), {"c": "1/2"}, "2/5", "1/2"),
]  # fmt: skip
ORDERS = (0, 2)


def quantities(scene: Scene) -> tuple[str, ...]:
    return ("T", "C", "1 - C", *(("P", "1 - P") if scene.slides else ()))


def formula_of(scene: Scene, quantity: str, order: int, noise: Any = "weak") -> sa.Expansion:
    """With the parameters free, in the case that the scene is in."""
    start = scene.start if quantity[-1] != "P" else "-1"
    case = None if noise == "strong" else case_of(scene.drift, Fraction(start))
    return sa.expand(
        scene.free, quantity, noise=noise, order=order, start=scene.start, case=case
    )  # fmt: skip


def asked(e: sa.Expansion, scene: Scene, **options: Any) -> Any:
    """The number of the method."""
    r = () if e.quantity[-1] == "P" else (scene.r,)
    return e.bind(**scene.values).evaluate(scene.kappa, *r, **options)


def agrees(got: Any, want: Any, digits: int = DIGITS) -> bool:
    with mpmath.workdps(60):
        return bool(abs(got - want) <= abs(want) * mpmath.mpf(10) ** (1 - digits))


@pytest.mark.parametrize("scene", [*SCENES, *ON_ZERO], ids=str)
def test_the_formula_is_the_number(scene: Scene) -> None:
    """All contributions, with the parameters free, in steps and as one expression."""
    for quantity in quantities(scene):
        for order in ORDERS if scene.free.free else (2,):
            e = formula_of(scene, quantity, order)
            with mpmath.workdps(80):
                got = by_definitions(e, scene.drift, scene.kappa, scene.r)
                assert agrees(got, asked(e, scene, dps=DIGITS)), (quantity, order)
                if order == 0:
                    whole = by_definitions(e, scene.drift, scene.kappa, scene.r, e.expression)
                    assert agrees(whole, got, 60)


@pytest.mark.parametrize("scene", [SCENES[0], SCENES[3], *ON_ZERO[:3]], ids=str)
def test_errors_of_t_fall_as_they_should(scene: Scene) -> None:
    """As kappa^(2 order + 2), against the exact T."""
    for order in (0, 1, 2):
        e, errors = formula_of(scene, "T", order), []
        with mpmath.workdps(60):
            for kappa in ("0.02", "0.01"):
                exact = sa.escape_time(scene.drift, kappa, scene.r, start=scene.start, dps=40)
                errors.append(abs(by_definitions(e, scene.drift, kappa, scene.r) / exact - 1))
            slope = float(mpmath.log(errors[0] / errors[1], 2))
        assert slope == pytest.approx(2 * order + 2, abs=0.25), order


STRONG = [friction("0.5", "7/2", slides=True), friction("-0.4", "7/2", "1/5", r="4"),
          friction("0.5", "10", "-2", r="4"), friction("0.5", "10", "7/4", r="4"),
          Scene(sa.linear(), {"a_minus": 0, "a_plus": "-1/2"}, "3", "-1")]  # fmt: skip


@pytest.mark.parametrize("scene", STRONG, ids=str)
def test_strong_noise_is_the_number(scene: Scene) -> None:
    for quantity in quantities(scene):
        for order in (0, 3):
            e = formula_of(scene, quantity, order, "strong")
            values = {**scene.drift.values, "kappa": scene.kappa, "r": scene.r}
            symbols = sorted(e.expression.free_symbols, key=str)
            with mpmath.workdps(160):
                # (e^x - 1)/x is a limit where phi is 0.
                known = [mpmath.mpf(sympy.Rational(values[s.name]).p) for s in symbols]
                known = [x / sympy.Rational(values[s.name]).q + mpmath.mpf("1e-40")
                         for s, x in zip(symbols, known, strict=True)]  # fmt: skip
                got = sympy.lambdify(symbols, e.expression, "mpmath")(*known)
                assert agrees(got, asked(e, scene, dps=25), 22), (quantity, order)


# -- terms -----------------------------------------------------------------------------------------


def test_the_first_correction_is_the_textbooks() -> None:
    """T = T0 (1 + x (B - W)), x = kappa^2/2, V4/(8 V2^2) - 5 V3^2/(24 V2^3) at barrier and well.

    Laplace's next term (DLMF 2.4(iv); J. Wojdylo, SIAM Rev. 48 (2006) 76) of
    either integral of Kramers' product.
    """
    (term,) = sa.expand(sa.Drift.general(), "T", order=1).terms
    v = {s.name: s for s in term.expression.free_symbols}

    def shape(u: str) -> Any:
        two, three, four = (v[f"V{k}({u})"] for k in ("''", "'''", "^(4)"))
        return four / (8 * two**2) - 5 * three**2 / (24 * two**3)

    assert sympy.expand(term.coefficients[1] - (shape("u2") - shape("u1")) / 2) == 0
    lead = 2 * sympy.pi / sympy.sqrt(-v["V''(u1)"] * v["V''(u2)"])
    assert sympy.simplify(term.front / lead) == 1
    higher = sa.expand(sa.Drift.general(), order=4)
    assert [len(c.args) for c in higher.terms[0].coefficients[1:]] == [4, 14, 42, 113]
    assert "V(u2) > V(u1)" in map(str, higher.conditions)


@pytest.mark.parametrize("scene", [SCENES[0], SCENES[8], *ON_ZERO], ids=str)
def test_contributions_and_the_regular_part_are_the_sum(scene: Scene) -> None:
    """C, 1 - C or both times each, to terms that are left out."""
    order, kappa = 3, "1/30"
    e, *both = (formula_of(scene, q, order) for q in ("T", "C", "1 - C"))
    with mpmath.workdps(60):

        def value(e: sa.Expansion, f: Any = None) -> Any:
            return by_definitions(e, scene.drift, kappa, scene.r, f)

        T, C, rest_of_c = map(value, (e, *both))
        share = {"C": C, "1 - C": rest_of_c, "C (1 - C)": C * rest_of_c}
        total = sum(share[t.weight] * value(e, t.expression) for t in e.terms)
        # The rest of D- and D+ are sums without an exponential, and of a start on a zero.
        for side, chance in (("D-", C), ("D+", rest_of_c)):
            (D,) = (v for s, v in e.definitions.items() if s.name == side)
            rest = [a for a in D.args if "M" in str(a) or "N" in str(a) or "log" in str(a)
                    or re.search(r"[WB]0", str(a))]  # fmt: skip
            total += chance * value(e, sympy.Symbol("lam", positive=True) * sympy.Add(*rest))
        assert abs(total / T - 1) < 1e-8


LEADING = [
    (SCENES[0], "1/40", "well and barrier"), (SCENES[3], "1/40", "regular part"),
    (SCENES[7], "1/20", "two wells"), (SCENES[8], "1/60", "of several"),
    (Scene(sa.linear(), {"a_minus": 1, "a_plus": "-1/2"}, "1/3"), "1/9", "an end"),
    (ON_ZERO[1], "1/40", "log lam"),
    # A double well, whose pair of a well and a barrier is 36 at r = 2.
    (Scene(sa.Drift("u - c*u**3 + 1/20"), {"c": 3}, "1/4", "1/3"), "1/20", "not the pair"),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "kappa", "what"), LEADING, ids=lambda x: str(x))
def test_the_leading_term_leads(scene: Scene, kappa: str, what: str) -> None:
    """T over it tends to 1, as kappa^2 or kappa; its conditions hold."""
    bound, errors = sa.expand(scene.drift, order=1, start=scene.start), []
    leading = bound.leading
    # The example of the case with several wells has another one.
    e = bound if scene is SCENES[8] or not scene.free.free else formula_of(scene, "T", 1)
    free = e.leading
    assert {str(c) for c in leading.conditions} <= {"r > 1.5"}
    with mpmath.workdps(40):
        for k in (kappa, str(Fraction(kappa) / 4)):
            exact = sa.escape_time(scene.drift, k, 2, start=scene.start, dps=20)
            for of, one in ((bound, leading), (e, free)):
                ratio = by_definitions(of, scene.drift, k, "2", one.expression) / exact
                errors.append(abs(ratio - 1))
    assert errors[2] < errors[0] / 1.4
    assert errors[0] == pytest.approx(errors[1], rel=1e-6)
    assert errors[0] < 0.5


def test_leading_terms_that_are_none() -> None:
    with pytest.raises(sa.InputError, match="in strong noise has no term that leads"):
        _ = sa.expand(sa.friction(), noise="strong").leading
    assert sa.expand(sa.Drift("2", "u")).leading.expression.has(sympy.tanh)
    assert str(sa.expand(sa.friction(3, 1, "-0.4")).leading.conditions) == "()"


# -- text ------------------------------------------------------------------------------------------


def test_what_is_written() -> None:
    """No symbol for 0, for a number or for a parameter alone; closed forms of a constant drift."""
    names = {s.name for s in sa.expand(sa.Drift("u*(c - u**2)"), order=2).definitions}
    assert not {"V'''(0)", "V^(5)(u1)", "V'(0)"} & names
    names = {s.name for s in sa.expand(sa.linear(), order=2).definitions}
    assert not any(name.startswith(("phi", "V'''", "V^")) for name in names)
    a, r, kappa = sympy.symbols("a r kappa", positive=True)
    constant = sa.expand(sa.Drift("a", "u")).expression
    same = {s: {"a": a, "r": r, "kappa": kappa}[s.name] for s in constant.free_symbols}
    assert constant.xreplace(same) == r / a * sympy.tanh(a * r / kappa**2)
    e = sa.expand(sa.friction(), order=1, case="start well barrier")
    lines = str(e).splitlines()
    assert sum(line.startswith(("  (1 - C) ", "  (C) ")) for line in lines) == len(e.terms)
    assert "(1 - C) well u1, barrier u2: " in str(e)
    defined = {line.split(" = ")[0].strip() for line in lines}
    assert {str(s) for s in e.formula.free_symbols} <= defined
    assert e._repr_latex_().startswith("$")


#: What the reader of LaTeX has no value of.
BEYOND = (sympy.Integral, sympy.core.function.AppliedUndef, FinitePart, sympy.Abs, sympy.hyper,
          sympy.erfi, sympy.erfc, sympy.Max, sympy.EulerGamma)  # fmt: skip


@pytest.mark.parametrize(
    ("drift", "options", "least"),
    [
        (sa.friction(), {"quantity": "T", "order": 2}, 40),
        (sa.friction(), {"quantity": "density", "order": 1}, 10),
        (sa.Drift.general(), {"order": 3}, 1),
        (sa.Drift("c*u + u**2/3"), {"order": 2}, 20),
        (sa.friction(), {"noise": "strong", "order": 1}, 12),
        (sa.friction(), {"noise": "uniform", "case": "barrier well start"}, 14),
    ],
    ids=str,
)
def test_latex_is_the_formula(drift: sa.Drift, options: dict[str, Any], least: int) -> None:
    """Read back at random numbers, to 20 digits."""
    e, count = sa.expand(drift, patience=100, **options), 0
    for value in map(written_out, [e.formula, *e.definitions.values(), *e.equations.values()]):
        if value.has(*BEYOND):
            continue
        symbols = sorted(value.free_symbols, key=str)
        known = [sympy.Rational(37 + 41 * k % 97, 61) * (-1 if s.is_negative else 1)
                 for k, s in enumerate(symbols)]  # fmt: skip
        text = tex(_shortest(value), {s: f"@{k} " for k, s in enumerate(symbols)})
        with mpmath.workdps(30):
            numbers = [mpmath.mpf(x.p) / x.q for x in known]
            wanted = sympy.lambdify(symbols, value, [_AIRY, "mpmath"])(*numbers)
            found = Reader(text, numbers).value()
            assert abs(found - wanted) <= abs(wanted) * mpmath.mpf(10) ** -20, text
        count += 1
    assert count >= least


@needs_latex
def test_latex_compiles(tmp_path: Path) -> None:
    texts = [sa.expand(sa.friction(), q, order=1, case="start well barrier").latex() for q in
             ("T", "1-C")] + [sa.expand(sa.friction(), q, order=1, case="well").latex() for q in
             ("1-P", "density")]  # fmt: skip
    texts.append(sa.expand(sa.friction(), noise="strong", order=1).latex())
    page = tmp_path / "page.tex"
    page.write_text(
        "\\documentclass{article}\\usepackage{amsmath}\\usepackage[paperwidth=300cm,paperheight=400cm]"
        "{geometry}\\begin{document}" + "".join(rf"\[{t}\]" for t in texts) + "\\end{document}"
    )
    compiled(page)


# -- cases and input -------------------------------------------------------------------------------


def test_cases_hold_where_they_say() -> None:
    """Each example is in its case, and fulfils its conditions."""
    double, pair = sa.Drift("u*(c - u**2)"), sa.Drift("c*(1/4 - u**2)")
    asked = [(d, "T") for d in (sa.friction(), sa.tanh(), double, pair)] + [(sa.friction(), "P")]
    for drift, quantity in asked:
        found = sa.expand(drift, quantity, order=0).cases()
        assert len({str(case) for case in found}) == len(found)
        for case in found:
            bound = drift.bind(**case.example)
            e = sa.expand(drift, quantity, order=0, case=case)
            assert case_of(bound, e.start) == case
            with mpmath.workdps(30):
                zeros = [z for z in roots_of(bound).values() if abs(z) > 1e-9 or not case.at_start]
                known = {
                    n: sympy.Rational(x.numerator, x.denominator) for n, x in bound.values.items()
                }
                known |= {f"u{k}": sympy.sympify(z) for k, z in enumerate(zeros, 1)} | {"r": 3}
                for c in e.conditions if zeros else ():
                    at = {s: known[s.name] for s in c.free_symbols}
                    holds = abs(c.lhs.subs(at)) < 1e-12 if isinstance(c, sympy.Eq) else c.subs(at)
                    assert holds, (c, case.example)


@pytest.mark.parametrize(
    ("drift", "quantity", "words"),
    [
        (sa.friction(), "T",
         "start well barrier, start well, well start, barrier well start, start"),
        (sa.friction(), "P", "start well"),
        (sa.hill(1, -1), "T", "start well, well start"),
        (sa.Drift("b + c*u - u**3"), "density", "start well, start well barrier well"),
        (sa.Drift("u*(c - u**2)"), "T", "start=well, well start=barrier well, start=barrier"),
        # Zeros 1e-3 apart are two.
        (sa.Drift("c*(u - 1/2)*(u - 501/1000)"), "T", "start well barrier, start barrier well"),
    ],
)  # fmt: skip
def test_cases_in_their_order(drift: sa.Drift, quantity: Any, words: str) -> None:
    assert ", ".join(map(str, sa.expand(drift, quantity, order=0).cases())) == words


def test_binding_one_after_the_other_keeps_exactness() -> None:
    e = sa.expand(sa.friction(), order=2, case="start well barrier")
    for name, value in (("mu", 3), ("alpha", 1), ("z0", "-0.4")):
        e = e.bind(**{name: value})
    assert not e.expression.atoms(sympy.Float)
    array = sa.escape_time(e.drift, [0.05, 0.1], 10, method="laplace", order=2)
    assert np.array_equal(e.evaluate([0.05, 0.1], 10), array)
    assert sa.expand(sa.friction(), "1 -C", order=0).quantity == "1 - C"


@pytest.mark.parametrize(
    ("drift", "options", "words"),
    [
        (sa.friction(), {"quantity": "Q"}, "quantity is 'Q'; give one of"),
        ("friction", {}, "drift is .friction.; give a Drift"),
        (sa.friction(), {"noise": "loud"}, "noise is 'loud'"),
        (sa.friction(), {"order": 9}, "order is 9; give a whole number from 0 to 8"),
        (sa.friction(), {"case": "well well start"}, "which take turns"),
        (sa.friction(), {"case": "well barrier"}, "'start' .once."),
        (sa.friction(), {"case": "barrier well barrier start well"}, "has degree 3"),
        (sa.Drift("(u - 1/2)**2*(2 - 3*u)"), {}, "a zero of multiplicity 2 at u = 0.5"),
        (sa.friction(), {"case": "start=well"}, "A at the start 0 is 1 - z0"),
        (sa.friction(3, 1, "-0.4"), {"case": "start well"}, "is in the case 'start well barrier'"),
        (sa.friction(), {"quantity": "P", "case": "barrier"}, "outermost points are wells"),
        (sa.Drift.general(), {"quantity": "P"}, "name a drift"),
        (sa.Drift.general(), {"case": "start well"}, "has one well and one barrier"),
        (sa.Drift.general(), {"case": "well barrier start"}, "without one pair"),
        (sa.friction(), {"quantity": "density", "noise": "strong"}, "weak noise only"),
        (sa.Drift.general(), {"noise": "strong"}, "has no moments"),
        (sa.Drift("1 + sin(u)"), {"noise": "strong"}, "no polynomial in u, so that the moments"),
        *[(sa.Drift(f"{name} + u - 4*u**3"), {"order": 1}, f"has a parameter {name}")
          for name in ("kappa", "T", "C", "h1", "W_1", "lambda", "R", "r")],
    ],
)  # fmt: skip
def test_bad_input(drift: sa.Drift, options: dict[str, Any], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, **options)


def test_what_has_no_code_or_number() -> None:
    with pytest.raises(sa.InputError, match="FinitePart"):
        sa.expand(sa.Drift("c - sin(2*u)"), order=1).emit("javascript")
    with pytest.raises(sa.InputError, match="may be complex"):
        sa.expand(sa.friction(), order=1, case="start").emit("c")
    with pytest.raises(sa.InputError, match="names no drift"):
        sa.expand(sa.Drift.general(), order=1).evaluate(1, 2)
    for drift in (sa.friction(), sa.linear(), sa.sine(), sa.tanh(), sa.hill()):
        assert sa.expand(drift, "density", order=1, patience=100).drift == drift


def test_density_has_total_one_to_its_order() -> None:
    drift = sa.friction(mu=3, alpha=1, z0="0.5")
    e = sa.expand(drift, "density", order=3)
    put = {s: sympy.Rational(3, 10) for v in e.definitions.values() for s in v.free_symbols
           if s.name == "y"}  # fmt: skip
    at = replace(e, definitions={s: v.xreplace(put) for s, v in e.definitions.items()})
    with mpmath.workdps(30):
        got = by_definitions(at, drift, "0.2", "3")
    assert float(got) == pytest.approx(float(sa.stationary_density(drift, "0.2", "0.3")), rel=1e-5)
