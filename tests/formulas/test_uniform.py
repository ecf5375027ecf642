"""The uniform expansion as a formula against the numbers of method="uniform", and its parts."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.formulas.uniform import TURNS
from tests.formulas.values import by_definitions
from tests.latex import compiled, needs_latex

DIGITS = 30
#: A quartic with two complex zeros far away, and the mirror image of friction.
QUARTIC = sa.Drift("((u - 2/5)**2 - 1/20)*(u**2 + u + 3)")
MIRROR = sa.friction(mu=3, alpha=1, z0="2.4")


#: The functions that SymPy's printer leaves as they are.
AIRY = {
    "airyaiprime": lambda z: mpmath.airyai(z, 1),
    "airybiprime": lambda z: mpmath.airybi(z, 1),
}


@cache
def lambdified(expression: sympy.Expr) -> tuple[list[str], Callable[..., Any]]:
    """The names of an expression's symbols, and the function of them."""
    symbols = sorted(expression.free_symbols, key=str)
    return [s.name for s in symbols], sympy.lambdify(symbols, expression, [AIRY, "mpmath"])


def values_of(e: sa.Expansion, drift: sa.Drift, kappa: str, r: str, **more: Any) -> Any:
    """A function from a symbol's name, or an expression, to its number at mpmath's precision."""
    given = {**drift.values, "kappa": Fraction(kappa), "r": Fraction(r)}
    values = {n: mpmath.mpf(x.numerator) / x.denominator for n, x in given.items()} | more
    defined = {s.name: value for s, value in e.definitions.items()}
    values = {name: value for name, value in values.items() if name not in defined}

    def of(expression: Any) -> Any:
        if isinstance(expression, str):
            if expression not in values:
                values[expression] = of(defined[expression])
            return values[expression]
        names, f = lambdified(expression)
        return f(*map(of, names))

    return of


def number(e: sa.Expansion, drift: sa.Drift, kappa: str, r: str = "3", **more: Any) -> Any:
    """The formula with numbers put in, definition after definition, at 60 digits."""
    with mpmath.workdps(60):
        return mpmath.re(values_of(e, drift, kappa, r, **more)(e.formula))


def agrees(got: Any, want: Any, digits: int = DIGITS) -> bool:
    with mpmath.workdps(60):
        return bool(abs(got - want) <= abs(want) * mpmath.mpf(10) ** (1 - digits))


@pytest.mark.every(4)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("kappa", ["0.05", "0.2"])
@pytest.mark.parametrize("z0", ["-0.02", "-0.4", "-0.77", "-0.7777", "-0.7778", "-0.8", "-1.4"])
def test_friction_through_the_fold(z0: str, kappa: str, order: int) -> None:
    """One formula with all parameters free on either side of z0 = -7/9 equals the evaluator."""
    case = "start well barrier" if Fraction(z0) > Fraction(-7, 9) else "start"
    e = sa.expand(sa.friction(), noise="uniform", order=order, case=case)
    bound = e.bind(mu=3, alpha=1, z0=z0)
    want = bound.evaluate(kappa, 3, dps=DIGITS)
    assert want == sa.escape_time(bound.drift, kappa, 3, method="uniform", order=order, dps=DIGITS)
    assert agrees(number(e, bound.drift, kappa), want, DIGITS - order * 4)


@pytest.mark.every(4)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(
    ("drift", "start"),
    [
        (MIRROR, 0),
        (sa.friction(mu=3, alpha=1, z0="2.9"), 0),
        (sa.Drift("20*((u - 1/3)**2 - 1/50)"), 0),
        (sa.Drift("20*((u - 1/3)**2 + 1/50)"), "-1/2"),
        (sa.Drift("-20*((u + 1/3)**2 + 1/50)"), "1/2"),
        (sa.Drift("-20*((u - 1/3)**2 + 1/50)"), "-1/2"),
        (sa.Drift("4*u**3 + 20*(u - 1/3)**2 - 2/3"), "-1/10"),
        # No pair: one well, one barrier, none.
        (sa.linear(1, "-1/2"), 0),
        (sa.linear(-2, 1), 0),
        (sa.friction(3, 1, "0.5"), 0),
        (sa.friction(3, 1, "1.1"), "-1/2"),
        (sa.friction("1/2", 1, "-0.2"), 0),
    ],
    ids=str,
)
def test_other_drifts(drift: sa.Drift, start: Any, order: int) -> None:
    e = sa.expand(drift, noise="uniform", order=order, start=start)
    zeros = {f"u{k}": z for k, z in enumerate(zeros_of(drift), 1)}
    assert agrees(number(e, drift, "0.1", **zeros), e.evaluate("0.1", 3, dps=DIGITS))


#: Sliding: one well, a complex pair on either side of it, three zeros, the nearer pair first.
WELLS = sa.Drift("-5*(u - a)*(u - b)*(u - c)")


@pytest.mark.every(3)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(
    ("free", "values", "case"),
    [
        (sa.Drift("a - u"), {"a": "1/5"}, None),
        (sa.friction(), {"mu": 3, "alpha": 1, "z0": "1.1"}, "well"),
        (sa.Drift("-5*((u - 1/3)**2 + 1/40)*(u + 1/2)"), {}, None),
        (sa.Drift("-5*((u + 1/3)**2 + 1/40)*(u - 1/2)"), {}, None),
        (WELLS, {"a": "1/10", "b": "1/2", "c": "-3/5"}, "well barrier well"),
        (WELLS.bind(a="1/2", b="-1/10", c="-2/5"), {}, None),
    ],
    ids=str,
)
def test_outside_the_layer(
    free: sa.Drift, values: dict[str, Any], case: str | None, order: int
) -> None:
    """1 - P with its parameters free is that of the verb, and P is the rest."""
    e = sa.expand(free, "1 - P", noise="uniform", order=order, case=case)
    drift = free.bind(**values)
    zeros = {f"u{k}": z for k, z in enumerate(zeros_of(drift), 1)}
    got = number(e, drift, "0.1", **zeros)
    want = e.bind(**values).evaluate("0.1", dps=DIGITS)
    options: dict[str, Any] = {"method": "uniform", "order": order, "dps": DIGITS}
    assert want == sa.occupation(drift, "0.1", complement=True, **options)
    assert agrees(got, want)
    rest = sa.expand(free, "P", noise="uniform", order=order, case=case)
    with mpmath.workdps(60):
        assert abs(number(rest, drift, "0.1", **zeros) - (1 - got)) < mpmath.mpf(10) ** -50


#: Of well and barrier on either side of the start, of a well, of a barrier.
NAMED_ROOTS = [
    (sa.Drift("1/2 - cos(3*u)"), "T", "-3/5"),
    (sa.Drift("cos(3*u) - 1/2"), "T", "4/5"),
    (sa.Drift("exp(u) - 21/20 - u + u**3/10"), "T", "-3/5"),
    # Whose Taylor series ends at a pole: more terms for the digits of the zeros.
    (sa.Drift("(u**2 - 1/16)/(1 + u**2/3)"), "T", "-3/5"),
    (sa.Drift("(u**2 - 1/9)/(1/2 + u**2)"), "T", "-3/5"),
    (sa.tanh(1, "-1/2", 2), "T", "3/10"),
    (sa.Drift("exp(u) - 1/2"), "T", 0),
    (sa.tanh(1, "-1/2", 2), "1 - P", -1),
]


@pytest.mark.every(4)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(("drift", "quantity", "start"), NAMED_ROOTS, ids=str)
def test_a_drift_that_is_no_polynomial(
    drift: sa.Drift, quantity: str, start: Any, order: int
) -> None:
    """With named roots, where V and A's derivatives make zeta, p, q, p1 and q1."""
    given = {"start": start} if quantity == "T" else {}
    e = sa.expand(drift, quantity, noise="uniform", order=order, **given)
    want = e.evaluate("0.1", *([3] if quantity == "T" else []), dps=25)
    with mpmath.workdps(50):
        assert agrees(by_definitions(e, drift, "0.1", "3"), want, 25)
    (turns,) = (c for c in e.conditions if c.has(TURNS))
    assert turns.rhs == len(e.case.kinds) - 1


def zeros_of(drift: sa.Drift) -> list[Any]:
    """A's zeros, those in the layer first."""
    with mpmath.workdps(80):
        c = sympy.Poly(drift.expression(), sympy.Symbol("u", real=True)).all_coeffs()
        zeros = mpmath.polyroots([mpmath.mpf(x.p) / x.q for x in c], 500, extraprec=300)
    return sorted(zeros, key=lambda z: (abs(z) > 1 or abs(z.imag) > 1e-9, z.real))


def test_order_1_against_the_definition() -> None:
    """log-log slopes of the error of T against the exact integral: 2 and 4 in kappa."""
    z0, kappas = "-0.4", ("0.06", "0.04")
    drift = sa.friction(mu=3, alpha=1, z0=z0)
    for order, slope in ((0, 2), (1, 4)):
        e = sa.expand(sa.friction(), noise="uniform", order=order)
        with mpmath.workdps(60):
            errors = [
                abs(number(e, drift, k) / sa.escape_time(drift, k, 3, dps=40) - 1) for k in kappas
            ]
            got = mpmath.log(errors[0] / errors[1]) / mpmath.log(mpmath.mpf("1.5"))
        assert abs(got - slope) < 0.35, (order, got)


def test_zeros_without_a_closed_form() -> None:
    """Of degree 4 the pair's middle and distance are given by the equations that they solve."""
    e = sa.expand(QUARTIC, noise="uniform", order=0)
    with mpmath.workdps(60):
        z = mpmath.mpc(-0.5, mpmath.sqrt(11) / 2)
        values = {"m": mpmath.mpf(2) / 5, "D": mpmath.mpf(1) / 20, "u3": z, "u4": z.conjugate()}
        for s, equation in e.equations.items():
            names = {t: values[t.name] for t in equation.free_symbols}
            value = sympy.lambdify(list(names), equation, "mpmath")(*names.values())
            assert abs(value) < mpmath.mpf(10) ** -50, s
        got = number(e, QUARTIC, "0.2", **values)
    assert agrees(got, e.evaluate("0.2", 3, dps=DIGITS))


def test_zeta_and_the_weights_are_those_of_the_potential() -> None:
    """(4/3) zeta^(3/2) = V(u2) - V(u1), p ± q zeta^(1/2) = (2 zeta^(1/2)/|V''|)^(1/2)."""
    e = sa.expand(sa.friction(), noise="uniform", order=0)
    at = {"mu": 3, "alpha": 1, "z0": sympy.Rational(-1, 2)}
    values = {s.name: e.put_in(v) for s, v in e.definitions.items()}
    zeta, p, q = (
        values[n].subs({s: at[s.name] for s in values[n].free_symbols}).evalf(40)
        for n in ("zeta", "p", "q")
    )
    drift = sa.friction(mu=3, alpha=1, z0="-0.5")
    u = sympy.Symbol("u", real=True)
    A = drift.expression()
    zeros = sorted(z for z in sympy.Poly(A, u).nroots(40) if abs(z) < 1)
    V = -sympy.integrate(A, u)
    assert abs(V.subs(u, zeros[1]) - V.subs(u, zeros[0]) - 4 * zeta**1.5 / 3) < 1e-30
    for zero, sign in zip(zeros, (-1, 1), strict=True):
        slope = abs(sympy.diff(A, u).subs(u, zero))
        assert (
            abs(p + sign * q * sympy.sqrt(zeta) - sympy.sqrt(2 * sympy.sqrt(zeta) / slope)) < 1e-30
        )


@pytest.mark.every(3)
@needs_latex
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("case", ["start well barrier", "barrier well start", "start"])
def test_latex_compiles(tmp_path: Path, case: str, order: int) -> None:
    """On one page of A4."""
    text = sa.expand(sa.friction(), noise="uniform", order=order, case=case).latex()
    assert r"\operatorname{Ai}" in text
    page = tmp_path / "page.tex"
    page.write_text(
        "\\documentclass{article}\\usepackage{amsmath}\\usepackage[a4paper,margin=1cm]{geometry}"
        "\\pagestyle{empty}\\begin{document}\\tiny"
        f"\\[{text}\\]\\end{{document}}"
    )
    said = compiled(page)
    assert "Overfull" not in said, said[said.index("Overfull") :][:100]
    assert "(1 page," in said
    for other in ("lam", "beyond", "area", "rest", "zeta"):
        assert f" {other} " not in text.replace("\\", " \\").replace(r" \zeta", "")
    # No symbol is given twice, and Euler's constant has its letter alone.
    heads = re.findall(r"(?:^|\\quad) *([^&=\n]+?) &?= ", text, re.MULTILINE)
    assert len(heads) == len(set(heads)) > 20 - 10 * (case == "start")
    assert r"\gamma" not in heads


@pytest.mark.parametrize(
    ("drift", "start"),
    [
        (sa.friction(mu=3, alpha=1, z0="-0.5"), 0),
        (MIRROR, 0),
        (QUARTIC, 0),
        (sa.Drift("4*u**3 + 20*(u - 1/3)**2 - 2/3"), "-1/10"),
    ],
    ids=str,
)
def test_what_latex_says_of_the_next_weights(drift: sa.Drift, start: Any) -> None:
    """Its recurrence with numbers put in, at both zeros, is that of the definitions."""
    e = sa.expand(drift, noise="uniform", order=1, start=start)
    (text,) = (row for row in e.latex().replace("&", "").split(r"\\") if "w_3 =" in row)
    flip = -1 if "w_1 = p - q" in text else 1
    zeros = {f"u{k}": z for k, z in enumerate(zeros_of(drift), 1)}
    with mpmath.workdps(60):
        if drift is QUARTIC:
            zeros |= {"m": mpmath.mpf(2) / 5, "D": mpmath.mpf(1) / 20}
        value = values_of(e, drift, "0.1", "3", **zeros)
        p, q, p1, q1, D, zeta = map(value, ("p", "q", "p1", "q1", "D", "zeta"))
        psi = [value(s.name) for s in e.definitions if s.name[:3] == "psi" and s.name[3:].isdigit()]
        for root in (1, -1):
            s, y = root * mpmath.sqrt(zeta), root * mpmath.sqrt(D)
            f = [sum(c * mpmath.ff(n, j) * y ** (n - j) for n, c in enumerate(psi) if n >= j)
                 for j in range(3)]  # fmt: skip
            f1, f2, f3 = 2 * y * f[0], f[0] + 2 * y * f[1], f[1] + y * f[2]
            w1 = p + flip * q * s
            w2 = w1 * (1 - f2 * w1**3) / (6 * s)
            w3 = -w1 / (2 * s) * (f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4)
            right = 3 * w3 / (2 * s) - (2 * w2 - flip * q) / (4 * zeta)
            assert abs(flip * p1 + q1 * s - right) <= mpmath.mpf(10) ** -40 * abs(right)


def test_cases_and_conditions() -> None:
    e = sa.expand(sa.friction(), noise="uniform", order=0)
    assert [str(c) for c in e.cases()] == [
        "start well barrier", "start well", "well start", "barrier well start", "start"
    ]  # fmt: skip
    past = sa.expand(sa.friction(), noise="uniform", order=0, case="start")
    assert [str(c) for c in e.conditions[:1]] == ["Abs(w) < 1"]
    assert [str(c) for c in past.conditions[:1]] == ["w > 1"]


def test_the_first_case_that_has_a_formula() -> None:
    """One well and a complex pair over the layer have none; without the well there is one."""
    drift = sa.Drift("(c - u)*(u**2 + 1)")
    cases = sa.expand(drift, order=0).cases()
    assert [str(c) for c in cases] == ["start well", "well start", "start"]
    assert str(sa.expand(drift, noise="uniform").case) == "start"
    for case in cases[:2]:
        with pytest.raises(sa.InputError, match="none without a complex pair; use"):
            sa.expand(drift, noise="uniform", case=case)


@pytest.mark.parametrize(
    ("drift", "options", "words"),
    [
        (sa.Drift("c*(u - 1/3)*(u + 1/2)"), {}, "no case of .* of the first, 'well start barrier'"),
        # Of a case that is asked for the drift's own parameters are taken.
        (sa.Drift("c - u + exp(u - 1/2) - 1/2"), {"case": "start"}, "complex zeros have no closed"),
        (sa.friction(), {"order": 9}, "order is 9"),
        (sa.friction(), {"order": 2}, "order 2; the uniform formula"),
        (sa.friction(), {"quantity": "C"}, "the uniform formula is that of T and 1 - P"),
        (sa.friction(), {"quantity": "P", "case": "barrier well"}, "P is that of a sliding block"),
        (
            WELLS,
            {"quantity": "P", "case": "well barrier well barrier well"},
            "that of 'well' and of",
        ),
        (sa.friction(), {"case": "barrier well start barrier"}, "is that of 'start well barrier'"),
        (
            sa.friction(3, 1, "-1.2"),
            {"start": "9/10"},
            "such as a complex one near the start or an end",
        ),
        (sa.Drift("cos(2*u) - 1/5"), {}, "no polynomial in u and has 1 turning points"),
        (sa.Drift("3*sin(2*u) - 5*u - 1/2"), {}, "no polynomial in u and has 2 turning points"),
        (sa.Drift("zeta + u**2"), {"case": "start"}, "has a parameter zeta"),
        (sa.friction(3, 1, "-7/9"), {}, "a zero of multiplicity 2"),
    ],
)
def test_bad_input(drift: sa.Drift, options: dict[str, Any], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, noise="uniform", **{"order": 0, **options})


@pytest.mark.parametrize("quantity", ["T", "P"])
def test_a_condition_says_that_no_complex_pair_is_near(quantity: str) -> None:
    """Friction with one well: the other zeros are real, or their real part is not in the layer."""
    e = sa.expand(sa.friction(), quantity, noise="uniform", case="start well")
    pair = next(c for c in e.conditions if isinstance(c, sympy.Or))
    for mu, z0 in ((3, "1/2"), (3, "29/10"), ("1/4", "7/4"), (20, "1/2"), (30, "3")):
        drift = sa.friction(mu, 1, z0)
        c = [float(x) for x in drift.exact_coefficients() or ()]
        roots = np.polynomial.polynomial.polyroots(c)
        wells = [float(z.real) for z in roots if abs(z.imag) < 1e-9]
        well = min(wells, key=abs)
        near = any(z.imag > 1e-9 and abs(z.real) < 1 for z in roots)
        exact = {**{n: sympy.Rational(x.numerator, x.denominator) for n, x in drift.values.items()},
                 "u1": well}  # fmt: skip
        assert bool(pair.subs({s: exact[s.name] for s in pair.free_symbols})) is not near


def test_complex_pairs_of_higher_degree() -> None:
    e = sa.expand(sa.Drift("a + b*u + c*u**2 + u**4"), noise="uniform", case="start well")
    others = [c for c in e.conditions if isinstance(c, sympy.Or)]
    assert sorted(s.name for c in others for s in c.free_symbols) == ["u2", "u3", "u4"]
    z = dict.fromkeys(others[0].free_symbols, 0.5 + 0.1j)
    assert not others[0].subs(z)
    assert others[0].subs(dict.fromkeys(z, 1.5 + 0.1j))
    assert others[0].subs(dict.fromkeys(z, sympy.Rational(1, 2)))
