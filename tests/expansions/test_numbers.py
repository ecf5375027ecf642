"""Weak and strong noise in numbers: right, honest, the same in arrays and digits, on one table.

What they are compared with is the exact value (`symasym.exact`), which shares nothing with an
expansion, and closed forms.
"""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from inspect import signature
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.expansions.ball_drift import Between
from symasym.expansions.strong_noise import StrongNoise
from symasym.expansions.weak import WeakNoise
from symasym.methods import METHODS
from symasym.workshop.problems import PROBLEMS, Problem, constant_drift

F = Fraction
ENDS = {"T": sa.escape_time, "C": sa.exit_probability}


def ask(name: str, drift: sa.Drift, kappa: Any, r: Any, start: Any, **options: Any) -> Any:
    """A quantity by its name."""
    if name[-1] == "P":
        return sa.occupation(drift, kappa, complement=name != "P", **options)
    if name[-1] == "C":
        options["complement"] = name != "C"
    return ENDS[name[-1]](drift, kappa, r, start=start, **options)


def put_in(f: Any, **at: Any) -> Any:
    """A function of those of the arguments that it has."""
    return f(**{name: x for name, x in at.items() if name in signature(f).parameters})


def log_of(code: Any, **at: Any) -> Any:
    """The logarithm by emitted code, which has none of its own for strong noise."""
    return put_in(code.log_f, **at) if hasattr(code, "log_f") else np.log(put_in(code.f, **at))


def relative(value: Any, exact: Any) -> float:
    """|value/exact - 1|."""
    with mpmath.workdps(90):
        return float(abs(mpmath.mpf(value) / mpmath.mpf(exact) - 1))


# -- right: each order gains its power of the noise ------------------------------------------------

# A drift, r, start; a pair of kappa in the ratio 2 where the next order is what is left out.
WEAK: dict[str, tuple[Any, Any, Any]] = {
    "well and barrier": (lambda: sa.friction(3, 1, "-0.4"), 10, 0),
    "start between": (lambda: sa.friction(3, 1, "-0.4"), 10, "2/3"),
    "start outside": (lambda: sa.friction(3, 1, "-0.4"), 10, "-3"),
    "start on a kink": (lambda: sa.friction(3, 1, "-0.4"), 10, -1),
    "r below 1": (lambda: sa.friction(3, 1, "-0.4"), "0.95", "0.1"),
    "no well": (lambda: sa.friction(3, 1, "-1.6"), 4, 0),
    "several wells": (lambda: sa.polynomial("1/20", "-1/2", 0, "1/4", 0, -1), 2, "1/4"),
    "start on a barrier": (lambda: sa.polynomial(0, "3/4", 0, -3), 2, 0),
    "start on a barrier, not at 0": (lambda: sa.linear(-1, 2), 3, "-1/3"),
    "start on a well": (lambda: sa.polynomial(0, -1, "3/2", 1), 2, 0),
    "sine": (lambda: sa.sine(-1, -2, 3), 3, "1/10"),
    "tanh from its well": (lambda: sa.tanh(1, -1, 2), 3, 0),
    "double zeros elsewhere": (lambda: sa.Drift("(u - 3)**2*(u + 1/3)*(1/2 - u)"), 2, "1/10"),
}


@pytest.mark.parametrize("name", WEAK)
def test_weak_noise_gains_a_power_with_each_order(name: str) -> None:
    make, r, start = WEAK[name]
    drift = make()
    for quantity in ("T", "C") if name != "tanh from its well" else ("T", "1 - P"):
        for order in (0, 1, 4) if "double" not in name and drift.exact_coefficients() else (2,):
            errors = []
            for kappa in ("0.024", "0.012"):
                exact = ask(quantity, drift, kappa, r, start, dps=40)
                options = {"method": "laplace", "order": order, "dps": 40}
                errors.append(relative(ask(quantity, drift, kappa, r, start, **options), exact))
            if errors[1] < 1e-36:
                continue  # nothing but what is exponentially small is left out
            assert np.log2(errors[0] / errors[1]) > 2 * (order + 1) - 0.4, (quantity, order)


def well(noise: str | None = None, ito: Any = 0) -> sa.Drift:
    """Two wells without a layer."""
    return sa.Drift("u - u**3", layer=None, noise=noise, ito=ito)


def pieces(*parts: Any, **options: Any) -> Any:
    """A drift of pieces, made when it is asked for."""
    return lambda: sa.Drift.piecewise(parts, **options)


def top(ito: Any, noise: str = "1 + u/4") -> Any:
    """From a barrier without a well."""
    return lambda: sa.Drift("u*(1 + u/3)", layer=None, noise=noise, ito=ito)


CORNER = pieces(("1 - u/2", 0), ("-1 - u/2", None))
THREE = pieces(("-1 - u", "-1/3"), ("u + sin(u)/3", "1/3"), ("2 - u", None))
# A drift, its ends, start, and the end that reflects.
ANYWHERE: dict[str, tuple[Any, Any, Any, Any]] = {
    "two ends": (lambda: sa.friction(3, 1, "-0.4"), ("-3/2", 5), 0, None),
    "in the layer": (lambda: sa.friction(3, 1, "-0.4"), ("-1/2", "19/20"), "1/10", None),
    "a wall": (lambda: sa.friction(3, 1, "-0.4"), ("-3/2", 5), 0, "left"),
    "a wall on the right": (lambda: sa.friction(3, 1, "-0.4"), ("-3/2", "19/20"), 0, "right"),
    "from a wall": (lambda: sa.friction(3, 1, "-0.4"), ("-1/2", 5), "-1/2", "left"),
    "a wall beside a well": (lambda: sa.polynomial(0, -1, "3/2", 1), (-2, 2), 0, "left"),
    "no layer": (well, (-2, "3/2"), "-1/3", None),
    "no layer, from a barrier": (well, (-2, "3/2"), 0, None),
    "from a well to 17 digits": (
        lambda: sa.Drift("tanh(2*u) - u + 1/10", layer=None), (-2, "9/10"),
        "-0.83029720271015556", None,
    ),
    "a corner": (CORNER, (-1, 2), "1/2", None),
    "from a corner": (CORNER, (-1, 2), 0, None),
    "jumps": (THREE, (-2, "5/2"), "-1/2", None),
    "noise by Ito": (lambda: well("1 + u/4"), (-2, "3/2"), "-1/3", None),
    "noise by Stratonovich": (lambda: well("1 + u**2/4", "stratonovich"), (-2, "3/2"), "1/5", None),
    "noise, from a well": (lambda: well("1 + u/4"), (-2, "1/2"), -1, "left"),
    "noise, from the top, Ito": (top(0), (-1, "3/2"), 0, None),
    "noise, from the top, Stratonovich": (top("stratonovich"), (-1, "3/2"), 0, None),
    "noise, from the top, by a contour": (top(0, "exp(u/4)"), (-1, "3/2"), 0, None),
    "noise in a layer": (lambda: sa.Drift("1/5 - u + 2*u**3", noise="1 + u/4"), (-2, 2), 0, None),
    "noise in pieces": (
        pieces(("2 + u", 0), ("2 - u/3", None), noise="exp(u/3)"), (-1, "3/2"), "-1/4", None,
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:outside")  # a layer between ends beyond it
@pytest.mark.parametrize("name", ANYWHERE)
def test_any_ends_pieces_and_noise_gain_a_power_with_each_order(name: str) -> None:
    make, ends, start, wall = ANYWHERE[name]
    drift, kappas = make(), ("0.03", "0.015")
    for quantity in "TC" if wall is None and "noise by" not in name else "T":
        at: Any = {"ends": ends, "start": start, "dps": 25}
        at |= {"reflecting": wall} if quantity == "T" else {}
        exact = [ENDS[quantity](drift, kappa, **at) for kappa in kappas]
        for order in (0, 1, 2):
            pairs = zip(kappas, exact, strict=True)
            found = (
                (ENDS[quantity](drift, kappa, method="laplace", order=order, **at), true)
                for kappa, true in pairs
            )
            errors = [relative(*pair) for pair in found]
            if errors[1] < 1e-21:
                continue  # nothing but what is exponentially small is left out
            assert np.log2(errors[0] / errors[1]) > 2 * (order + 1) - 0.2, (quantity, order)


@pytest.mark.parametrize(("ask", "options"), [("T", {"moment": 2}), ("C", {"method": "uniform"})])
def test_what_is_not_covered_is_refused(ask: str, options: Any) -> None:
    with pytest.raises(sa.RegionError, match="means"):
        ENDS[ask](well(), "0.1", ends=(-2, 1), start=-1, **{"method": "laplace"} | options)


def test_a_feature_that_shows_in_no_term_is_refused() -> None:
    """A drift that turns outwards between two critical points: the series for C sums to 2.6."""
    flat = sa.Drift("u*exp(-u**16) - d*(1 - exp(-u**16))", layer=None).bind(d="3e-6")
    for options in ({}, {"full": True}):
        with pytest.raises(sa.AccuracyError):
            sa.exit_probability(flat, "0.3", ends=(-2, "0.8"), method="laplace", **options)


@pytest.mark.parametrize("name", ["well and barrier", "several wells", "start outside", "sine"])
def test_strong_noise_gains_a_power_with_each_order(name: str) -> None:
    make, r, start = WEAK[name]
    drift = make()
    for order in (0, 2, 4):
        errors = []
        for kappa in (10, 20):
            exact = ask("T", drift, kappa, r, start, dps=30)
            options = {"method": "strong_noise", "order": order, "dps": 30}
            errors.append(relative(ask("T", drift, kappa, r, start, **options), exact))
        assert np.log2(errors[0] / errors[1]) > 2 * (order + 1) - 0.3


def test_closed_forms() -> None:
    """From the top of A = u in |u| < r; of a constant drift nothing is dropped."""
    context = mpmath.MPContext()
    context.dps = 40
    value = sa.escape_time(sa.linear(-1, 1), "1e-9", 1, method="laplace", order=0, dps=16)
    top = (context.log(4 / context.mpf("1e-18")) + context.euler) / 2
    assert abs(value - top) < 1e-14
    beside = sa.Drift("-(u + 1999/2000)*(2 + u)")  # P has no start that would be near the well
    found = ask("1 - P", beside, "1e-5", 2, 0, method="laplace", order=1, log=True)
    assert abs(found / ask("1 - P", beside, "1e-5", 2, 0, log=True) - 1) < 1e-14
    closed = constant_drift("3/2")
    for name in ("T", "C"):
        found = ask(name, sa.polynomial("3/2"), "0.1", 5, -2, method="laplace", dps=25)
        with mpmath.workdps(40):
            assert relative(found, closed[name](mpmath.mpf("0.1"), 5, -2)) < 1e-24


# -- honest ----------------------------------------------------------------------------------------

ADVERSARIAL: dict[str, tuple[Any, Any, Any]] = {
    "next terms that vanish": (lambda: sa.Drift("1/2 - 2*u**5"), 2, 0),
    "odd": (lambda: sa.polynomial(0, -1, 0, "1/2"), 2, 0),
    "a bump between": (lambda: sa.Drift("1 + 8/(1 + 40*(u - 1/2)**2)"), 3, "-1/2"),
    "a ghost": (lambda: sa.Drift("1/20 + 5*(u - 3/4)**4"), 3, "-1/2"),
    "start beside a barrier": (lambda: sa.polynomial("-1/4", "3/4", 1), 2, "0.27"),
    "start beside a well": (lambda: sa.polynomial(0, -1, "3/2", 1), 2, "1/50"),
    "an end beside a zero": (lambda: sa.linear(-1, 2), "0.35", 0),
    "a zero beyond 1": (lambda: sa.Drift("(u + 21/20)*(u + 1/10)*(u - 4/5)"), 1, 0),
    "a zero beyond -1": (lambda: sa.Drift("-(u + 26/25)*(u - 1/3)"), 3, "-1/2"),
    "beside the fold": (lambda: sa.friction(3, 1, "-0.775"), 10, 0),
    "a cusp beside the kink": (lambda: sa.friction(3, 1, "-0.01"), 10, 0),
}


@pytest.mark.every(3)
@pytest.mark.parametrize("name", ADVERSARIAL)
def test_errors_of_arrays_cover_the_true_ones(name: str) -> None:
    make, r, start = ADVERSARIAL[name]
    drift, kappa, claims = make(), np.geomspace(0.02, 1.2, 96), 0
    start = float(Fraction(start))
    for quantity in ("T", "C"):
        exact = ask(quantity, drift, kappa, float(r), start, log=True, full=True)
        best = [("laplace", "optimal")] if drift.exact_coefficients() else []
        asked: list[tuple[str, Any]] = [("laplace", 0), ("laplace", 3), ("strong_noise", 2), *best]
        for method, order in asked:
            options = {"method": method, "order": order, "log": True, "full": True}
            found = ask(quantity, drift, kappa, float(r), start, **options)
            known = np.isfinite(found.value)
            wrong = np.abs(found.value - exact.value) > found.error + exact.error
            assert not (known & wrong).any(), (quantity, method, order, kappa[known & wrong])
            claims += known.sum()
    assert claims > 20


@pytest.mark.every(8)
@pytest.mark.parametrize(
    "problem", [p for p in PROBLEMS if not p.tags & {"slow", "refused", "narrow"}], ids=str
)
def test_one_scene_is_proved(problem: Problem) -> None:
    """The error is the distance to the exact value; a refusal has to have a reason."""
    drift, at = problem.make(), (problem.kappa, problem.r, problem.start)
    for name in ("T", "C", *(("1 - P",) if problem.slides else ())):
        exact = ask(name, drift, *at, log=True, dps=40)
        for method, order in (("laplace", 1), ("strong_noise", 4)):
            options = {"method": method, "order": order, "log": True, "full": True}
            try:
                found = ask(name, drift, *at, dps=25, **options)
            except sa.AccuracyError:
                continue
            assert found.error_kind == "bound"
            with mpmath.workdps(60):
                assert abs(found.value - exact) <= found.error


@pytest.mark.parametrize("method", ["laplace", "strong_noise"])
def test_a_value_has_its_claim_when_exact_values_are_not_asked_for(method: str) -> None:
    """Without full=True a scene is refused by the same rule; the value is the same."""
    claims = 0
    for kappa in ("0.05", "0.3", 1, 5):
        values = []
        for full in (False, True):
            with suppress(sa.AccuracyError):
                drift = sa.friction(3, 1, "-0.4")
                values.append(float(sa.escape_time(drift, kappa, 10, method=method, full=full)))
        assert len(values) != 1
        assert len(set(values)) <= 1
        claims += len(values)
    assert claims


# -- the same in every arithmetic ------------------------------------------------------------------

#: kappa where the sums of a method are sums of many digits.
AT = {"laplace": ("1/20", "1/25"), "strong_noise": (5, 20)}
LEFT_OUT = {"slow", "refused", "narrow", "extreme", "fold", "analytic", "start at the edge"}
NAMES_LEFT_OUT = ("degree 12", "degree 20", "hardly any drift")  # slow, or cancelling in float64
TABLE = [
    p for p in PROBLEMS
    if not p.tags & LEFT_OUT and F(p.r) > 1 and p.name not in NAMES_LEFT_OUT
]  # fmt: skip


@pytest.mark.every(12)
@pytest.mark.parametrize(("method", "order"), [*((m, n) for m in AT for n in (0, 2))])
@pytest.mark.parametrize("problem", TABLE, ids=str)
def test_one_formula(problem: Problem, method: str, order: int) -> None:
    """A number, an array over kappa, digits, the formula and its code are the same sums."""
    drift, r, start = problem.make(), F(problem.r), F(problem.start)
    noise: Any = "weak" if method == "laplace" else "strong"
    for name in ("T", "1 - C", *(("P",) if problem.slides else ())):
        at: Any = {} if name == "P" else {"r": float(r)}
        try:
            options: Any = {"method": method, "order": order, "log": True}
            many = ask(name, drift, [float(F(k)) for k in AT[method]], r, start, **options)
            e = sa.expand(drift, name, noise=noise, order=order, start=start)
            code, digits = e.emit("numpy").load(), e.emit("mpmath").load()
        except (sa.AccuracyError, sa.InputError):
            continue  # the start beside a zero, or one beside an end
        for kappa, value in zip(AT[method], many, strict=True):
            if np.isnan(value):
                continue  # beside a fold; of one scene the error is known more closely
            known = ask(name, drift, kappa, r, start, **options | {"dps": 25})
            same = e.evaluate(kappa, **dict.fromkeys(at, r), log=True, dps=25)
            assert relative(same, known) < 1e-24
            one = ask(name, drift, kappa, r, start, **options)
            for found in (one, value, log_of(code, kappa=float(F(kappa)), **at)):
                assert abs(found - known) < 1e-13 * max(1, abs(known))
            with mpmath.workdps(40):
                found = mpmath.log(put_in(digits.f, kappa=str(kappa), r=str(r), dps=25))
                assert abs(found - known) < mpmath.mpf("1e-23") * max(1, abs(known))


@pytest.mark.parametrize(
    ("kind", "kappa"), [(WeakNoise, [0.04, 0.05]), (StrongNoise, [0.7, 1.0, 5.0, 40.0])]
)
@pytest.mark.parametrize("start", [0.0, 1.5, -1.5])
def test_floats_sum_what_balls_do(kind: Any, kappa: Any, start: float) -> None:
    """Before they are compared: where floats are off the verbs sum in balls, so none would tell."""
    between, lams = Between(F(-10), F(10), F(start)), 2 / np.square(kappa)
    for name in ("T", "C", "1 - C"):
        sums = kind(sa.friction(3, 1, "-0.4"), between, name, 3)
        for lam, log in zip(lams, sums.logs(lams, 2), strict=True):
            true = float(sums.balls(F(lam), [2], 16, True)[1][0])
            assert abs(log - true) < 1e-13 * max(1.0, abs(true)), (name, lam)


def test_many_drifts_and_radii_are_a_loop() -> None:
    z0, r = np.array([-0.5, -0.4, -1.2]), np.array([[4.0], [10.0]])
    found = sa.escape_time(sa.friction(3, 1, z0), 0.1, r, method="laplace", full=True)
    assert found.value.shape == (2, 3)
    for i in range(2):
        for k in range(3):
            drift = sa.friction(3, 1, float(z0[k]))
            one = sa.escape_time(drift, 0.1, float(r[i, 0]), method="laplace")
            assert abs(found.value[i, k] / one - 1) < 1e-13


def test_logarithms_of_probabilities_near_1() -> None:
    """log C = log(1 - (1 - C)) has digits of its own."""
    drift, options = sa.linear(-1, -1), {"method": "laplace", "log": True}
    rest = sa.exit_probability(drift, "0.1", 2, complement=True, method="laplace", dps=20)
    one = sa.exit_probability(drift, "0.1", 2, dps=20, **options)
    many = sa.exit_probability(drift, [0.1, 0.2], 2, **options)
    assert relative(one, -rest) < 1e-15
    assert relative(many[0], one) < 1e-12


# -- refusals --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drift", "start", "says"),
    [
        (lambda: sa.friction(3, 1, 0), 0, "A vanishes at u = 1, at the start"),
        (lambda: sa.friction(3, 1, "-7/9"), 0, "A vanishes at u = 0.666667, its slope too"),
        (lambda: sa.polynomial(0), 0, "A vanishes at u = -1"),
        (lambda: sa.friction(3, 1, "-0.4"), "0.39", "at kappa = 0.3 and order 8 "),
    ],
)
def test_refusals(drift: Any, start: Any, says: str) -> None:
    with pytest.raises(sa.AccuracyError, match=says):
        sa.escape_time(drift(), "0.3", 4, start=start, method="laplace", order=8)


def test_an_inflection_has_no_part_in_the_exit_probability() -> None:
    fold, at = sa.friction(3, 1, "-7/9"), ("0.02", 4)
    found = sa.exit_probability(fold, *at, method="laplace", order=3, log=True, dps=20)
    assert abs(found - sa.exit_probability(fold, *at, log=True, dps=20)) < 1e-9


def test_the_enclosure() -> None:
    """method="bound" of C."""
    found = sa.exit_probability(sa.linear(1, 2), "0.5", 2, method="bound", dps=20, full=True)
    exact = sa.exit_probability(sa.linear(1, 2), "0.5", 2, dps=40)
    assert found.error_kind == "bound"
    assert 0 < found.error < found.value * mpmath.mpf("1e-19")
    with mpmath.workdps(50):
        assert abs(found.value - exact) <= found.error
    # More digits than those of the exact value with which an expansion is compared.
    at: Any = (sa.polynomial("-0.29", "-0.94", "-0.01"), "0.16", "1/2")
    found = sa.escape_time(*at, method="laplace", order="optimal", dps=301, full=True)
    with mpmath.workdps(50):
        assert abs(found.value - sa.escape_time(*at, dps=40)) <= found.error
    many = sa.exit_probability(sa.linear(1, 2), [0.5, 1.0], 2, method="bound", full=True)
    assert abs(many.value[0] / float(exact) - 1) < 1e-14
    assert METHODS["bound"].quantities == ("C", "1 - C")


def test_logarithms_of_the_occupation_in_arrays() -> None:
    """1 - P is near 1 where the noise is strong."""
    drift, kappa = sa.linear(1, -1), np.array([2.0, 20.0])
    for name in ("P", "1 - P"):
        options = {"method": "strong_noise", "order": 8, "log": True}
        found = ask(name, drift, kappa, None, None, **options)
        exact = ask(name, drift, kappa, None, None, log=True)
        assert np.abs(found - exact).max() < 1e-4


def test_an_error_that_changes_its_sign_is_not_interpolated() -> None:
    at: Any = (sa.Drift("1/3 + sin(3*u)"), np.linspace(0.05, 0.5, 100), 10)
    found = sa.escape_time(*at, method="laplace", order=4, log=True, full=True)
    away, known = np.abs(found.value - sa.escape_time(*at, log=True)), np.isfinite(found.value)
    assert known.sum() > 10
    assert (away <= found.error + 1e-12 * np.abs(found.value))[known].all()
