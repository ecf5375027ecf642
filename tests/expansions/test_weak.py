"""Expansions as formulas against the numbers of method="laplace", the exact T, and textbooks."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.expansions import cases as cases_of_drifts
from symasym.expansions.builder import FinitePart
from symasym.expansions.cases import case_of, contradiction
from symasym.expansions.universal import endpoint, gaussian
from tests.latex import compiled, needs_latex
from tests.moments import moment_coefficients
from tests.problems import Problem
from tests.problems import answered as all_answered

DIGITS = 30
#: Weak noise for all of the table's polynomial drifts.
KAPPA = "1/20"


#: What SymPy's names mean to mpmath.
AIRY = {
    "airyaiprime": lambda z: mpmath.airyai(z, 1), "airybiprime": lambda z: mpmath.airybi(z, 1),
}  # fmt: skip


def roots_of(drift: sa.Drift) -> dict[str, Any]:
    """u1, u2, ...: the zeros in the layer, left to right, then the others."""
    c = [mpmath.mpf(x.numerator) / x.denominator for x in drift.exact_coefficients() or ()]
    roots = mpmath.polyroots(c[::-1], maxsteps=1000, extraprec=600) if len(c) > 1 else []
    tiny = mpmath.mpf(10) ** (10 - mpmath.mp.dps)
    roots = [
        z.real if abs(z.imag) < tiny * (1 + abs(z)) else z for z in map(mpmath.mpmathify, roots)
    ]
    inside = sorted(z for z in roots if isinstance(z, mpmath.mpf) and abs(z) < 1)
    others = [z for z in roots if not any(z is w for w in inside)]
    return {f"u{k}": z for k, z in enumerate([*inside, *others], 1)}


def number(e: sa.Expansion, drift: sa.Drift, kappa: str, r: str = "3") -> Any:
    """The expression with numbers put in."""
    with mpmath.workdps(120):
        values = roots_of(drift) if drift.exact_coefficients() else {}
        given = {**drift.values, "kappa": Fraction(kappa), "r": Fraction(r)}
        values |= {n: mpmath.mpf(x.numerator) / x.denominator for n, x in given.items()}
        symbols = sorted(e.expression.free_symbols, key=str)
        f = sympy.lambdify(symbols, e.expression, "mpmath", cse=True)
        return mpmath.re(f(*[values[s.name] for s in symbols]))


def _laurent(h: Any, u: Any) -> dict[int, Any]:
    """Laurent coefficients of h about u by the mean over a circle, radius 1/2."""
    points = [mpmath.expjpi(mpmath.mpf(2 * k) / 256) for k in range(256)]
    values = [h(u + z / 2) for z in points]
    return {j: mpmath.re(sum(v * z**-j for v, z in zip(values, points, strict=True))) / 256
            * mpmath.mpf(2) ** j for j in range(-12, 120)}  # fmt: skip


def by_definitions(e: sa.Expansion, drift: sa.Drift, kappa: str, r: str) -> Any:
    """The formula's value by its chain of definitions, at the working precision.

    Finite parts are real parts of integrals along a low half of an ellipse above the zeros of A.
    """
    known = {n: mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
             for n, x in {**drift.values, "kappa": kappa, "r": r}.items()}  # fmt: skip
    x, start = sympy.Symbol("u", real=True), mpmath.mpf(e.start.numerator) / e.start.denominator
    A = sympy.lambdify(x, drift.expression(), "mpmath")
    if drift.exact_coefficients():
        roots = iter(roots_of(drift).values())
        zeros = [z for z in roots if abs(z - start) > mpmath.mpf("1e-9") or not e.case.at_start]
    else:
        zeros = [mpmath.findroot(A, float(p.u)) for p in drift.critical_points()]
    known |= {f"u{k}": z for k, z in enumerate(zeros, 1)}

    def finite_part(h: Any, a: Any, b: Any) -> Any:
        h, total, ends = sympy.lambdify(x, h, "mpmath", cse=True), mpmath.mpf(0), []
        for edge, side in ((a, 1), (b, -1)):
            ends.append(edge)
            if e.case.at_start and abs(edge - start) < mpmath.mpf("1e-9"):
                # From the pole on by Laurent's series, without what is infinite.
                ends[-1] = p = edge + side * mpmath.mpf(1) / 8
                row = _laurent(h, edge)
                total += side * sum(
                    c * (mpmath.log(abs(p - edge)) if j == -1 else (p - edge) ** (j + 1) / (j + 1))
                    for j, c in row.items()
                )
        middle, radius = sum(ends) / 2, (ends[1] - ends[0]) / 2
        return total + mpmath.re(
            mpmath.quad(
                lambda t: h(middle - radius * (mpmath.cos(t) - mpmath.sin(t) * 1j / 8))
                * radius * (mpmath.sin(t) + mpmath.cos(t) * 1j / 8),
                mpmath.linspace(0, mpmath.pi, 5),
            )
        )  # fmt: skip

    def value(f: Any) -> Any:
        f = sympy.sympify(f)
        if isinstance(f, FinitePart):
            return finite_part(f.args[0], value(f.args[2]), value(f.args[3]))
        if f.has(sympy.Integral):
            (whole,) = f.atoms(sympy.Integral)
            (y, a, b) = whole.limits[0]
            g = sympy.lambdify(y, whole.function, "mpmath")
            area = sympy.Dummy()
            known[area.name] = mpmath.quad(g, [value(a), value(b)])
            f = f.xreplace({whole: area})
        symbols = sorted(f.free_symbols, key=str)
        for s in symbols:
            if s.name not in known:
                known[s.name] = value(e.definitions[s])
        return sympy.lambdify(symbols, f, [AIRY, "mpmath"])(*[known[s.name] for s in symbols])

    return mpmath.re(value(e.formula))


def agrees(got: Any, want: Any, digits: int = DIGITS) -> bool:
    with mpmath.workdps(60):
        return bool(abs(got - want) <= abs(want) * mpmath.mpf(10) ** (1 - digits))


def laplace(problem: Problem, order: int) -> Any:
    """T of method="laplace", or None where it is refused."""
    try:
        return sa.escape_time(
            problem.make(), KAPPA, problem.r, start=problem.start, method="laplace",
            order=order, dps=DIGITS,
        )  # fmt: skip
    except sa.SymasymError:
        return None


def polynomial(problem: Problem) -> bool:
    """A polynomial with a start in the layer beside its zeros, and an end beyond it."""
    start = Fraction(problem.start)
    drift = problem.make()
    return bool(
        drift.exact_coefficients() and abs(start) < 1 and Fraction(problem.r) > 1
        and drift.exact_value(start)
    )  # fmt: skip


SCENES = [
    p
    for p in all_answered()
    if "extreme" not in p.tags and not {"tangency", "kink"} & p.tags
    and polynomial(p) and len(p.make().exact_coefficients() or ()) <= 6
]  # fmt: skip


@pytest.mark.parametrize("problem", SCENES, ids=str)
def test_the_expression_is_the_whole_sum_of_laplace(problem: Problem) -> None:
    """All contributions, not only the leading pair: the expression equals T to 29 digits.

    Of friction it is the formula with all parameters free.
    """
    want = laplace(problem, 2)
    if want is None:
        pytest.skip("method='laplace' refuses this scene")
    drift, start = problem.make(), Fraction(problem.start)
    free = sa.friction() if drift.name == "friction" else drift
    e = sa.expand(free, order=2, start=start, case=case_of(drift, start))
    if drift.exact_coefficients()[-1] == 0 or free.free and not drift.values["mu"]:  # type: ignore[index]
        e = sa.expand(drift, order=2, start=start)
    assert agrees(number(e, drift, KAPPA, problem.r), want)


#: Scenes whose formulas take SymPy 5 to 20 s; others of their kind stay.
LATER = {"degree 20", "sine weak"}


@pytest.mark.every(4)
@pytest.mark.parametrize(
    "problem",
    [
        pytest.param(p, marks=pytest.mark.slow if p.name in LATER else (), id=p.name)
        for p in all_answered()
    ],
)
def test_what_laplace_answers_has_a_formula(problem: Problem) -> None:
    """On the whole table, wherever the start is: log T to 29 digits."""
    drift, (kappa, r, start) = problem.make(), (problem.kappa, problem.r, problem.start)
    try:
        want = sa.escape_time(drift, kappa, r, start=start, method="laplace", order=1, log=True,
                              dps=DIGITS)  # fmt: skip
    except sa.SymasymError:
        pytest.skip("method='laplace' refuses this scene")
    e = sa.expand(drift, order=1, start=start, patience=600)
    with mpmath.workdps(80):
        assert agrees(mpmath.log(by_definitions(e, drift, kappa, r)), want)


@pytest.mark.every(4)
@pytest.mark.parametrize("quantity", ["T", "C", "1-C"])
@pytest.mark.parametrize(
    ("drift", "start", "kappa", "case"),
    [
        ("-3*u/2 + u**2/3 - u**3/5", "0", "2/5", "start=well"),
        ("3*u/2 + u**2/3 + u**3/5", "0", "2/5", "start=barrier"),
        ("(u - 1/4)*(2 + u)*(2 - 3*u)", "1/4", "1/5", "start=barrier well"),
        ("-(u - 1/4)*(u + 1/2)*(u - 2/3)*(1 + u/3)", "1/4", "1/30", "well start=barrier well"),
        ("(2*u - 1)*(u + 1/2)", "-1/2", "2/5", "start=well barrier"),
        ("(2*u - 1)*(u + 1/2)", "1/2", "2/5", "well start=barrier"),
        ("u/2 - u**2 - 1/20", "1", "1/20", "barrier well start"),
        ("1/5 - u + u**3/3", "-1", "2/5", "start well"),
        ("1/5 - u + u**3/3", "-9/8", "2/5", "start well"),
        ("1/5 - u + u**3/3", "11/10", "2/5", "well start"),
        pytest.param("sin(2*u)", "0", "2/5", "start=barrier", marks=pytest.mark.slow),
    ],
)
def test_a_start_on_a_zero_or_outside(
    drift: str, start: str, kappa: str, case: str, quantity: str
) -> None:
    """Where A's odd derivatives count, too: order 3 (2 of the sine), against the method.

    The noise is so strong that exponentially small terms are seen in 29 digits.
    """
    known = sa.Drift(drift)
    order = 3 if known.exact_coefficients() else 2
    e = sa.expand(known, quantity, order=order, start=start)
    assert str(e.case) == case
    want = e.evaluate(kappa, "3/2", dps=DIGITS)
    with mpmath.workdps(80):
        assert agrees(by_definitions(e, known, kappa, "3/2"), want)


def test_a_free_parameter_and_a_start_that_is_always_a_zero() -> None:
    e = sa.expand(sa.Drift("u - c*u**3"), order=1)
    assert [str(c) for c in e.cases()] == ["well start=barrier well", "start=barrier"]
    bound = e.bind(c=2)
    assert str(bound.case) == str(e.case)
    with mpmath.workdps(80):
        values = {"c": 2, "kappa": mpmath.mpf(1) / 9, "r": 2}
        symbols = sorted(e.expression.free_symbols, key=str)
        f = sympy.lambdify(symbols, e.expression, "mpmath", cse=True)
        got = mpmath.re(f(*[values[s.name] for s in symbols]))
        assert agrees(got, bound.evaluate("1/9", 2, dps=DIGITS))


def test_contributions_name_their_points() -> None:
    """On both sides, as seen from neither; at a barrier the start's odd terms have both signs."""
    e = sa.expand(sa.Drift("u + u**2/3 + u**3/5"), order=1)
    pairs = {(t.weight, t.pair) for t in e.terms}
    assert ("C", ("barrier u = 0", "kink u = -1")) in pairs
    assert ("1 - C", ("barrier u = 0", "end u = r")) in pairs
    own = {t.weight: t for t in e.terms if t.pair[0] == "barrier u = 0" and "kink" in t.pair[1]}
    assert own["C"].front == -own["1 - C"].front
    assert ("C", ("barrier u = 0", "end u = -r")) in pairs
    inside = sa.expand(sa.Drift("(u - 1/4)*(2 + u)*(2 - 3*u)"), order=1, start="1/4")
    assert {t.weight for t in inside.terms if t.pair[0] == "barrier u = 1/4"} == {"C", "1 - C"}
    outside = sa.expand(sa.Drift("u/2 - u**2 - 1/20"), order=1, start="-9/8")
    assert {t.pair[0] for t in outside.terms} == {"kink u = -1", "well u2", "kink u = 1"}


@pytest.mark.parametrize(
    ("drift", "start"),
    [("1 + u/2 - u**2/5", "-1/3"), ("-1/2 - u/4", "1/4"), ("1/2 + u + u**2/3", "0")],
)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_contributions_and_the_regular_part_are_the_sum(drift: str, start: str, order: int) -> None:
    """C and 1 - C times each, to O(kappa^(2 order + 2)): a kink with itself has no exponential."""
    known = sa.Drift(drift)
    e, of_c = (sa.expand(known, q, order=order, start=start) for q in ("T", "C"))
    errors = []
    for kappa in ("1/20", "1/40"):
        with mpmath.workdps(60):
            parts = {"T": e.formula, "lam": 2 / sympy.Symbol("kappa", positive=True) ** 2}
            parts |= {s.name: s for s in e.definitions if s.name in ("M-", "M+")}
            value = {
                name: by_definitions(replace(e, formula=f), known, kappa, "3")
                for name, f in parts.items()
            }
            C = by_definitions(of_c, known, kappa, "3")
            share = {"C": C, "1 - C": 1 - C}
            total = mpmath.mpf(0)
            for t in e.terms:
                one = replace(e, formula=t.expression)
                total += share[t.weight] * by_definitions(one, known, kappa, "3")
            A = sympy.lambdify(sympy.Symbol("u", real=True), known.expression(), "mpmath")
            total += 2 * (share["1 - C"] / A(mpmath.mpf(1)) - C / A(mpmath.mpf(-1)))
            total += value["lam"] * (share["1 - C"] * value["M+"] + C * value["M-"])
            errors.append(abs(total / value["T"] - 1))
    assert errors[0] < 1e-4
    assert errors[1] < 1e-40 or mpmath.log(errors[0] / errors[1], 2) > 2 * order + 1.9


@pytest.mark.parametrize(
    ("drift", "quantity"),
    [
        (sa.friction(), "T"),
        (sa.friction(), "P"),
        (sa.Drift("a - u + c*u**2"), "T"),
        (sa.Drift("c*(1/4 - u**2)"), "T"),
        (sa.Drift("u*(c - u**2)"), "T"),
    ],
    ids=str,
)
def test_examples_of_cases_fulfil_the_conditions(drift: sa.Drift, quantity: str) -> None:
    """The zeros from mpmath; the leading coefficient is not 0."""
    for case in sa.expand(drift, quantity, order=0).cases():
        e, bound = sa.expand(drift, quantity, order=0, case=case), drift.bind(**case.example)
        values = {n: sympy.Rational(x.numerator, x.denominator) for n, x in bound.values.items()}
        zeros = [z for z in roots_of(bound).values() if abs(z) > 1e-9 or not case.at_start]
        values |= {f"u{k}": sympy.sympify(z) for k, z in enumerate(zeros, 1)}
        values |= {"r": sympy.Integer(3)}
        for c in e.conditions:
            at = {s: values[s.name] for s in c.free_symbols}
            if isinstance(c, sympy.Eq):
                assert abs(c.lhs.subs(at)) < 1e-12, c
            else:
                assert c.subs(at) == True, (c, case.example)  # noqa: E712
        lead = sympy.Poly(drift.expression(), sympy.Symbol("u", real=True)).LC()
        if not lead.is_number:
            assert sympy.Ne(lead, 0) in e.conditions


def test_conditions_of_starts() -> None:
    """The slope at a start on a zero; r beyond the start; nothing of A outside of the layer."""
    u = sympy.Symbol("u", real=True)
    drift = sa.Drift("c*u + u**2/3 - d*u**3")
    for case, relation in (("start=barrier", sympy.Gt), ("start=well", sympy.Lt)):
        e = sa.expand(drift, order=0, case=case)
        c = next(s for s in drift.expression().free_symbols - {u} if s.name == "c")
        assert relation(c, 0) in e.conditions
    r = next(s for s in e.expression.free_symbols if s.name == "r")
    for start in (2, -2):
        e = sa.expand(sa.Drift("c - u"), order=0, start=start, case="start")
        assert sympy.Gt(r, 2) in e.conditions
        (c,) = e.drift.expression().free_symbols - {u}
        assert {x for x in e.conditions if isinstance(x, sympy.Ne)} == {
            sympy.Ne(c + 1, 0), sympy.Ne(c - 1, 0)
        }  # fmt: skip
    e = sa.expand(sa.Drift("c - u"), order=0, start="1/2", case="start")
    assert sympy.Ne(c - sympy.Rational(1, 2), 0) in e.conditions


@pytest.mark.every(4)
@pytest.mark.parametrize("order", [0, 1, 5, 8])
@pytest.mark.parametrize("quantity", ["T", "C", "1-C"])
def test_orders(quantity: str, order: int) -> None:
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    e = sa.expand(sa.friction(), quantity, order=order, case="start well barrier")
    want = e.bind(**drift.values).evaluate("0.1", 3, dps=DIGITS)
    assert agrees(number(e, drift, "0.1"), want)


@pytest.mark.parametrize("quantity", ["P", "1-P"])
def test_occupation(quantity: str) -> None:
    drift = sa.friction(mu=3, alpha=1, z0="0.5")
    e = sa.expand(sa.friction(), quantity, order=3, case="well")
    want = e.bind(**drift.values).evaluate("0.2", dps=DIGITS)
    assert agrees(number(e, drift, "0.2"), want)


def test_density_has_total_one_to_its_order() -> None:
    drift = sa.friction(mu=3, alpha=1, z0="0.5")
    e = sa.expand(drift, "density", order=3)
    y = next(s for s in e.expression.free_symbols if s.name == "y")
    f = e.expression.subs(y, sympy.Rational(3, 10))
    got = number(sa.Expansion(**{**vars_of(e), "formula": f}), drift, "0.2")
    assert got == pytest.approx(float(sa.stationary_density(drift, "0.2", "0.3")), rel=1e-5)


def vars_of(e: sa.Expansion) -> dict[str, Any]:
    """The fields of an expansion."""
    return {name: getattr(e, name) for name in e.__dataclass_fields__}


def test_a_drift_that_is_no_polynomial() -> None:
    """Its regular part is Hadamard's: the real part of an integral above the zeros of A."""
    drift = sa.Drift("cos(2*u) - 1/5")
    e = sa.expand(drift, order=2)
    assert str(e.case) == "barrier start well"
    with mpmath.workdps(50):
        u = mpmath.acos(mpmath.mpf(1) / 5) / 2
        points = {s: {"u1": -u, "u2": u}.get(s.name) for s in e.expression.free_symbols}
        parts = {}
        for part in e.expression.atoms(FinitePart):
            h = sympy.lambdify(part.args[1], part.args[0], "mpmath")
            a, b = (mpmath.mpf(x.p) / x.q for x in part.args[2:])
            middle, radius = (a + b) / 2, (b - a) / 2
            parts[part] = mpmath.re(
                mpmath.quad(
                    lambda t, h=h, m=middle, w=radius: h(m - w * mpmath.expjpi(-t))
                    * w * mpmath.pi * 1j * mpmath.expjpi(-t), [0, 0.5, 1],
                )
            )  # fmt: skip
        symbols = {part: sympy.Symbol(f"part{k}") for k, part in enumerate(parts)}
        expression = e.expression.doit(integrals=True).xreplace(symbols)
        values = {symbols[p]: v for p, v in parts.items()}
        values |= {s: v for s, v in points.items() if v is not None}
        values |= {s: {"kappa": mpmath.mpf("0.1"), "r": 3}[s.name] for s in points
                   if s.name in ("kappa", "r")}  # fmt: skip
        got = sympy.lambdify(list(values), expression, "mpmath")(*values.values())
    assert agrees(got, e.evaluate("0.1", 3, dps=25), 25)


# -- a general drift -------------------------------------------------------------------------------


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
    higher = next(c for c in sa.expand(sa.Drift.general(), order=1).conditions if "V(" in str(c))
    assert str(higher) == "V(u2) > V(u1)"
    lead = 2 * sympy.pi / sympy.sqrt(-v["V''(u1)"] * v["V''(u2)"])
    assert sympy.simplify(term.front / lead) == 1


@pytest.mark.parametrize("order", [0, 1, 2, 3, 4])
def test_the_general_formula_against_the_exact_time(order: int) -> None:
    """Its error falls as kappa^(2 order + 2): T from quadrature of the integral itself."""
    drift = sa.friction(mu=3, alpha=1, z0="-0.6")
    e = sa.expand(sa.Drift.general(), "T", order=order)
    errors = []
    with mpmath.workdps(60):
        u = roots_of(drift)
        x = sympy.Symbol("u", real=True)
        A = drift.expression()
        V = -sympy.integrate(A, x)
        values = {}
        for s in e.expression.free_symbols:
            if s.name.startswith("V"):
                head, place = s.name.rstrip(")").rsplit("(", 1)
                j = int(head[3:-1]) if "^" in head else head.count("'")
                values[s] = sympy.lambdify(x, sympy.diff(V, x, j), "mpmath")(u[place])
        symbols = [*values, next(s for s in e.expression.free_symbols if s.name == "kappa")]
        f = sympy.lambdify(symbols, e.expression, "mpmath")
        for kappa in ("0.02", "0.01"):
            exact = sa.escape_time(drift, kappa, 10, dps=40)
            errors.append(abs(f(*values.values(), mpmath.mpf(kappa)) / exact - 1))
        slope = float(mpmath.log(errors[0] / errors[1], 2))
    assert slope == pytest.approx(2 * order + 2, abs=0.1)


def test_universal_coefficients_by_moments() -> None:
    """Watson's lemma by the other way: expanding the exponential."""
    alpha = [Fraction(k * k - 3, k + 1) for k in range(1, 17)]
    f = [Fraction(0), Fraction(0), Fraction(-1), *(-a for a in alpha)]
    reduced = moment_coefficients(f, [Fraction(1), *[Fraction(0)] * 16], 2, step=2)
    for n, (p, d) in enumerate(zip(gaussian(8), reduced, strict=True)):
        odd = sympy.factorial2(2 * n - 1) if n else 1
        value = p.as_expr(*[sympy.Rational(a.numerator, a.denominator) for a in alpha])
        assert value == odd * sympy.Rational(d.numerator, d.denominator)


def test_universal_endpoint_coefficients() -> None:
    """h_(k+1) = -h_k'/phi, by SymPy's own derivative."""
    u = sympy.Symbol("u")
    phi = 2 + u + 3 * u**2 - u**3
    h = 1 / phi
    g = [sympy.Rational(c, 2) for c in (1, 3, -1)]
    for k, p in enumerate(endpoint(4), 1):
        value = (p.as_expr(*g) if p != 1 else sympy.S.One) / 2**k
        assert value == h.subs(u, 0)
        h = -sympy.diff(h, u) / phi


# -- text and code ---------------------------------------------------------------------------------


@needs_latex
@pytest.mark.parametrize("quantity", ["T", "1-C", "1-P", "density"])
def test_latex_compiles(tmp_path: Path, quantity: str) -> None:
    case = "start well barrier" if quantity in ("T", "1-C") else "well"
    text = sa.expand(sa.friction(), quantity, order=1, case=case).latex()
    general = sa.expand(sa.Drift.general(), order=1).latex()
    page = tmp_path / "page.tex"
    page.write_text(
        "\\documentclass{article}\\usepackage{amsmath}\\usepackage[paperwidth=300cm,paperheight=200cm]"
        f"{{geometry}}\\begin{{document}}\\[{text}\\]\\[{general}\\]\\end{{document}}"
    )
    compiled(page)
    for other in ("lam", "beyond", "kappa ", "None"):
        assert f" {other} " not in text.replace("\\", " \\")


@pytest.mark.parametrize("target", ["numpy", "mpmath", "python"])
def test_emitted_code(target: str) -> None:
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    e = sa.expand(sa.friction(), "T", order=3, case="start well barrier")
    code = e.emit(target, name="time").load()
    values = {**{n: float(x) for n, x in drift.values.items()}, "kappa": 0.5, "r": 1.5}
    values |= {n: float(x) for n, x in roots_of(drift).items()}
    names = sorted(s.name for s in e.expression.free_symbols)
    got = code.time(*[values[n] for n in names])
    want = float(number(e, drift, "1/2", "3/2"))
    assert float(np.asarray(got, dtype=float)) == pytest.approx(want, rel=1e-12)


def test_the_general_formula_in_c() -> None:
    code = sa.expand(sa.Drift.general(), order=4).emit("c", name="time")
    assert "double V2_u1" in code
    assert "double V6_u2" in code


def test_text_has_a_line_for_each_contribution() -> None:
    e = sa.expand(sa.friction(), order=1, case="start well barrier")
    lines = str(e).splitlines()
    assert sum(line.startswith(("  (1 - C) ", "  (C) ")) for line in lines) == len(e.terms) == 7
    assert "(1 - C) well u1, barrier u2: " in str(e)
    # Every symbol of the formula has its line.
    defined = {line.split(" = ")[0].strip() for line in lines}
    assert {str(s) for s in e.formula.free_symbols} <= defined
    assert e._repr_latex_().startswith("$")


@pytest.mark.parametrize(
    ("drift", "quantity", "noise", "order", "present", "absent"),
    [
        # Strong noise has no case; the general formula is its one contribution, without symbols.
        (sa.friction(), "T", "strong", 1, [], ["case", "contributions", "FinitePart"]),
        (sa.Drift.general(), "T", "weak", 1, ["case 'start well barrier'"],
         ["contributions", "with", "FinitePart"]),
        (sa.linear(1, -1), "P", "weak", 0, ["with", "case 'start well'"],
         ["contributions", "FinitePart"]),
        # The regular part's integrals, said by what they are; P has none.
        (sa.friction(), "T", "weak", 0,
         ["contributions", "with", "FinitePart(h, u, a, b):", "!= 0, ", " = 0, "], []),
    ],
)  # fmt: skip
def test_text_says_what_there_is(
    drift: sa.Drift, quantity: str, noise: str, order: int, present: list[str], absent: list[str]
) -> None:
    text = str(sa.expand(drift, quantity, noise=noise, order=order))
    assert [w for w in present if w not in text] == []
    assert [w for w in absent if w in text] == []


# -- cases and input -------------------------------------------------------------------------------


def test_cases_of_friction() -> None:
    found = sa.expand(sa.friction(), order=0).cases()
    assert {str(case) for case in found} == {
        "start well barrier", "start well", "start", "well start", "barrier well start"
    }  # fmt: skip
    for case in found:
        assert case_of(sa.friction(**case.example), Fraction(0)) == case


@pytest.mark.parametrize(
    ("drift", "case", "words"),
    [
        # Zeros add up to 0: one left of -1, one before the start and one before 1 do not.
        (sa.friction(), "well start barrier", "zeros of A add up to 0, and these do not"),
        (sa.friction(), "barrier start well", "zeros of A add up to 0, and these do not"),
        (sa.Drift("1 + b*u**2"), "start well barrier", "add up to 0"),
        (sa.Drift("u**2 - b*u - 1"), "start=well barrier", "A at the start 0 is -1"),
        (sa.friction(), "well barrier well start", "coefficient alpha.mu has the other sign"),
        (sa.Drift("b**2 + u**2"), "start well barrier", r"A.u1. = b..2 \+ u1..2 is not 0"),
        (sa.Drift("3 + b**2 - 2*u"), "start well", r"A.1. = b..2 \+ 1 is not negative"),
        (sa.Drift("b*(1 + u) - 2"), "well start", r"A.-1. = -2 is not positive"),
    ],
)
def test_a_case_that_no_parameters_are_in_is_refused(
    drift: sa.Drift, case: str, words: str
) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, order=0, case=case)


@pytest.mark.parametrize("start", [Fraction(0), Fraction(1, 4), Fraction(-2)])
@pytest.mark.parametrize(
    "family", [sa.friction(), sa.Drift("a + b*u + c*u**2"), sa.Drift("b*u - c*u**3"),
               sa.Drift("a + b*u + c*u**2 + u**3")],
)  # fmt: skip
def test_a_case_that_parameters_are_in_is_no_contradiction(
    family: sa.Drift, start: Fraction
) -> None:
    draw, found = random.Random(f"{family!r}{start}"), set()
    for _ in range(25):
        values = {n: Fraction(draw.randint(1, 40), 16) for n in family.free}
        for n in set(values) - {"mu", "alpha"}:
            values[n] *= draw.choice([1, -1])
        case = case_of(family.bind(**values), start)
        assert not contradiction(family, start, case), (values, str(case))
        found.add(case)
    assert len(found) > 1


@pytest.mark.parametrize("quantity", ["1-C", "1 - C", "1 -C"])
def test_spaces_in_a_quantity_do_not_count(quantity: str) -> None:
    """Nor do they for the other verbs that take a quantity; printed is one form."""
    drift = sa.linear(1, -1)
    assert sa.expand(sa.friction(), quantity, order=0).quantity == "1 - C"
    assert sa.sensitivity(drift, "1/2", 2, quantity=quantity).quantity == "1 - C"
    axes = sa.plot(quantity, drift, np.array([0.5, 1.0]), 2)
    assert "1 − C" in axes.get_ylabel()
    axes.figure.clear()


def test_binding_one_after_the_other_keeps_exactness() -> None:
    e = sa.expand(sa.friction(), order=2, case="start well barrier")
    for name, value in (("mu", 3), ("alpha", 1), ("z0", "-0.4")):
        e = e.bind(**{name: value})
    assert not e.expression.atoms(sympy.Float)
    assert e.evaluate(0.1, 10) == sa.escape_time(e.drift, 0.1, 10, method="laplace", order=2)
    array = sa.escape_time(e.drift, [0.05, 0.1], 10, method="laplace", order=2)
    assert np.array_equal(e.evaluate([0.05, 0.1], 10), array)


@pytest.mark.parametrize(
    ("drift", "options", "words"),
    [
        (sa.friction(), {"quantity": "Q"}, "quantity is 'Q'; give one of"),
        ("friction", {}, "drift is .friction.; give a Drift"),
        (sa.friction(), {"noise": "loud"}, "noise is 'loud'"),
        (sa.friction(), {"order": 9}, "order is 9; give a whole number from 0 to 8"),
        (sa.friction(), {"order": 1.5}, "order is 1.5"),
        (sa.friction(), {"start": 2, "noise": "uniform"}, "start is 2, outside of the layer"),
        (sa.friction(), {"case": "well well start"}, "which take turns"),
        (sa.friction(), {"case": "well barrier"}, "'start' .once."),
        (sa.friction(), {"case": "barrier well barrier start well"}, "has degree 3"),
        (sa.Drift("kappa - u"), {}, "has a parameter kappa"),
        (sa.Drift("T - u"), {}, "has a parameter T"),
        (sa.Drift("C + u - u**3"), {}, "has a parameter C"),
        (sa.Drift("h1 + u - 4*u**3"), {}, "has a parameter h1"),
        (sa.Drift("lambda - u"), {}, "has a parameter lambda"),
        (sa.Drift("lam - u"), {"noise": "strong"}, "has a parameter lam"),
        (sa.Drift("W_1 + u - 4*u**3"), {}, "has a parameter W_1"),
        (sa.Drift("e - u"), {}, "has a parameter e"),
        (
            sa.Drift("20*((u - 1/3)**2 - Ai)"),
            {"noise": "uniform", "order": 0, "case": "start well barrier"},
            "has a parameter Ai",
        ),
        (sa.Drift("gamma*u + u**2/3"), {"case": "start=barrier"}, "has a parameter gamma"),
        (
            sa.Drift("eta - u + 4*u**3"),
            {"noise": "uniform", "order": 1, "case": "start well barrier"},
            "has a parameter eta",
        ),
        (sa.Drift("(u - 1/2)**2*(2 - 3*u)"), {}, "a zero of multiplicity 2 at u = 0.5"),
        (sa.friction(3, 1, 1), {"noise": "uniform"}, "start is 0, a zero of A"),
        (sa.friction(), {"case": "start=well"}, "A at the start 0 is 1 - z0"),
        (sa.friction(3, 1, "-0.4"), {"case": "start well"}, "is in the case 'start well barrier'"),
    ],
)
def test_bad_input(drift: sa.Drift, options: dict[str, Any], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, **options)


@pytest.mark.parametrize(
    ("drift", "options"),
    [
        ("{} + u - 4*u**3", {"order": 1}),
        ("{}*u + u**2/3", {"order": 0, "case": "start=barrier"}),
        ("{}*cos(u) - 1/3", {"order": 0}),
        ("{} - u", {"quantity": "density", "order": 0}),
        ("{} - u", {"quantity": "P", "noise": "strong", "order": 0}),
        ("{} - u + 4*u**3", {"noise": "uniform", "order": 0, "case": "start well barrier"}),
        ("{} - u", {"quantity": "P", "noise": "uniform", "order": 1}),
    ],
    ids=str,
)
def test_no_parameter_reads_as_the_formula_s_own(drift: str, options: dict[str, Any]) -> None:
    """Each name that `print` gives a line, as R, R1 of R1+, V and u1 of V(u1), is refused."""
    text = str(sa.expand(sa.Drift(drift.format("beta0")), **options))
    heads = re.findall(r"^  (\S+) = ", text, re.MULTILINE)
    own = {word for head in heads for word in re.findall(r"[A-Za-z]\w*", head)}
    own -= {"E"}  # It is e, whatever the drift.
    assert own & {"L", "R", "D", "V", "phi", "x"}
    for name in sorted(own | {"r", "kappa"} - ({"r"} if "quantity" in options else set())):
        with pytest.raises(sa.InputError, match=f"has a parameter {name}, which the formula"):
            sa.expand(sa.Drift(drift.format(name), "u"), **options)


def test_a_ready_made_drift_has_no_parameter_to_rename() -> None:
    for drift in (sa.friction(), sa.linear(), sa.sine(), sa.tanh(), sa.hill()):
        for quantity in ("T", "C", "density"):
            assert sa.expand(drift, quantity, order=1, patience=100).drift == drift
    for quantity in ("T", "P"):
        assert sa.expand(sa.friction(), quantity, noise="strong").quantity == quantity
        assert sa.expand(sa.friction(), quantity, noise="uniform", order=1).order == 1


def test_a_general_drift_has_no_numbers() -> None:
    with pytest.raises(sa.InputError, match="names no drift"):
        sa.escape_time(sa.Drift.general(), 1, 2)
    with pytest.raises(sa.InputError, match="names no drift"):
        sa.expand(sa.Drift.general(), order=1).evaluate(1, 2)


@pytest.mark.parametrize(
    ("drift", "quantity", "words"),
    [
        (
            sa.friction(), "T",
            "start well barrier, start well, well start, barrier well start, start",
        ),
        (sa.friction(), "P", "start well"),
        (sa.hill(1, -1), "T", "start well, well start"),
        (sa.tanh(), "T", "start well, well start, start, start barrier, barrier start"),
        (
            sa.Drift("c - u + 3*u**3"), "T",
            "barrier start well barrier, barrier well start barrier, start, start barrier,"
            " barrier start",
        ),
        (sa.Drift("b + c*u - u**3"), "density", "start well, start well barrier well"),
        (sa.Drift("1/(u - c)"), "T", "start"),
        # A well first, the start itself or another; of as many points the earliest start, and then
        # in an order of the words, whatever value was tried first.
        (sa.Drift("u*(c - u**2)"), "T", "start=well, well start=barrier well, start=barrier"),
        (sa.Drift("c*(1/4 - u**2)"), "T", "well start barrier, barrier start well"),
        (sa.Drift("c*(u**2 - 1/4)"), "T", "well start barrier, barrier start well"),
        # Zeros 1e-3 apart are two.
        (sa.Drift("c*(u - 1/2)*(u - 501/1000)"), "T", "start well barrier, start barrier well"),
    ],
    ids=str,
)  # fmt: skip
def test_cases_of_drifts(drift: sa.Drift, quantity: str, words: str) -> None:
    """Each with parameters at which the drift is in that case, by its critical points."""
    cases = sa.expand(drift, quantity, order=0).cases()
    assert ", ".join(map(str, cases)) == words
    start = Fraction(0 if quantity == "T" else -1)
    for case in cases:
        assert case_of(drift.bind(**case.example), start) == case


@pytest.mark.parametrize(
    ("drift", "start", "words"),
    [
        # A zero in the grid's cell beside the start is on its side of it.
        ("c*(u - 1/1000)", 0, ["start well", "start barrier"]),
        ("c*(u + 1/1000)", 0, ["well start", "barrier start"]),
        # A is 0 at the start by its formula, where phi is A(1) or A(-1).
        ("(2 - u)*(1 + c*u**2)", 2, ["barrier well start", "start"]),
        ("(-2 - u)*(1 + c*u**2)", -2, ["start well barrier", "start"]),
    ],
)
def test_an_order_of_points_is_verified_once(
    drift: str, start: int, words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    checked = []

    def counted(*given: Any) -> Any:
        checked.append(given)
        return verify(*given)

    verify = cases_of_drifts._checked
    monkeypatch.setattr(cases_of_drifts, "_checked", counted)
    cases_of_drifts.found_cases.cache_clear()
    found = cases_of_drifts.found_cases(sa.Drift(drift), Fraction(start))
    assert [str(case) for case in found] == words
    assert len(checked) == 2


@pytest.mark.parametrize(
    ("drift", "options", "words"),
    [
        (sa.Drift("(u - c)**2*(u + 2)"), {}, "give the case, as in case='start well barrier'"),
        (sa.Drift("c - u + 3*u**3"), {"quantity": "P"}, "as in case='well'"),
        (sa.tanh(1, -1, 3), {"noise": "uniform"}, "start is 0, a zero of A"),
        (sa.friction(3, 1, "-0.4"), {"quantity": "P"}, "give case='well'"),
    ],
    ids=str,
)
def test_no_case(drift: sa.Drift, options: dict[str, Any], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, **options)


def test_emitted_series_take_no_powers() -> None:
    """Horner's form, in which arrays are as fast as method="laplace"; the same text each time."""
    e = sa.expand(sa.friction(), order=5)
    text = str(e.emit("numpy", name="f"))
    assert not re.search(r"\b(x|kappa)\*\*([3-9]|\d\d)", text)
    kappa = sympy.Symbol("kappa", positive=True)
    assert kappa in e.expression.free_symbols
    assert not e.expression.has(kappa**8, kappa**10, kappa**12)
