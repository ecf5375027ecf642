"""Logarithmic derivatives, against closed forms, exact identities and plain quadrature."""

from __future__ import annotations

import importlib
import random
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.base.errors import AccuracyError, InputError
from symasym.exact import digit_derivatives, float_sides, floats
from symasym.exact.balls import derivatives
from symasym.exact.balls import sweep as ball_sweep
from symasym.exact.balls.panels import cut
from symasym.numbers import balls
from symasym.numbers.balls import exact_ball, precision, profile_of, sharpened
from symasym.series.truncated_series import SeriesOps, TruncatedSeries
from symasym.workshop import reference_quadrature
from symasym.workshop.problems import BY_NAME, Problem, tagged

slopes = importlib.import_module("symasym.sensitivity")


def number(x: Any) -> Any:
    exact = Fraction(x)
    return mpf(exact.numerator) / exact.denominator


def sum_of(found: sa.Sensitivity, weights: dict[str, Any]) -> tuple[Any, Any]:
    """Weighted sum of the derivatives, and of their errors."""
    total = sum(number(w) * found.derivative[name] for name, w in weights.items())
    return total, sum(abs(number(w)) * found.error[name] for name, w in weights.items())


@pytest.mark.parametrize(("a", "kappa", "r"), [("2/3", "1.1", "4"), ("-1", "0.3", "2.5")])
def test_a_constant_drift(a: str, kappa: str, r: str) -> None:
    # T = (r^2 - x^2)-like closed form: [r tanh(b r) - x + ...]; at x = 0, (r/a) tanh(a r/kappa^2).
    found = sa.sensitivity(sa.polynomial(a), kappa, r, dps=40)
    with mp.workdps(60):
        c, k, R = (number(x) for x in (a, kappa, r))
        b = c * R / k**2
        slope = 2 * b / mp.sinh(2 * b)
        known = {"c0": (slope - 1) / c, "kappa": -2 * slope / k, "r": (1 + slope) / R}
        # From x: T = (r - x)/a - (2r/a) C, C = (e^{-2ax/k^2} - e^{-2ar/k^2})/(2 sinh(2ar/k^2)).
        known["start"] = (-1 / c + 2 * R / k**2 / mp.sinh(2 * b)) / (R / c * mp.tanh(b))
        for name, value in known.items():
            assert abs(found.derivative[name] - value) <= found.error[name]
            assert found.error[name] <= mpf("1e-40") * max(1, abs(value))
        assert abs(found.condition["kappa"] - 2 * slope) < mpf("1e-38")
        log = abs(mp.log(R / c * mp.tanh(b)))
        assert abs(found.log_condition["r"] * log - (1 + slope)) < mpf("1e-37")


@pytest.mark.parametrize(
    ("coefficients", "kappa", "r", "start", "dps"),
    [
        (["0.7", "-1/3", "0.2", "0.5"], "0.4", "4", "0.3", 30),
        (["1.4", "-4", "0", "3"], "0.1", "10", "0", 12),  # friction with a well
        pytest.param(["1.4", "-4", "0", "3"], "1e-8", "10", "0", 8, marks=pytest.mark.slow),
        (["0", "-1"], "0.7", "3", "0", 25),
        (["0", "1"], "30", "2", "1/2", 25),
    ],
)
def test_scaling_of_space_and_time(
    coefficients: list[str], kappa: str, r: str, start: str, dps: int
) -> None:
    drift = sa.polynomial(*coefficients)
    weights = {f"c{k}": c for k, c in enumerate(coefficients)} | {"kappa": Fraction(kappa) / 2}
    for quantity, known in (("T", -1), ("C", 0)):
        # A drift twice as large with a squared noise twice as large does all in half the time.
        found = sa.sensitivity(drift, kappa, r, start=start, quantity=quantity, dps=dps)
        with mp.workdps(2 * dps + 30):
            total, error = sum_of(found, weights)
            assert abs(total - known) <= error
        for name, value in found.derivative.items():
            assert found.error[name] <= mpf(10) ** -dps * 1.01 * max(1, abs(value))


@pytest.mark.parametrize(
    ("drift", "kappa", "r", "start", "quantities"),
    [
        (sa.friction(mu=3, alpha=1, z0="-0.6"), "0.2", 10, 0, ["T", "C", "1 - C"]),
        (sa.friction(mu=3, alpha=1, z0="1/4"), "1/2", "1/2", "1/4", ["T", "1 - P"]),
        (sa.hill(1, -2, "1/2", n=2), "0.8", 3, 2, ["P"]),
        (sa.polynomial(1, 0, 0), "30", 2, -1, ["T", "1 - C"]),
        (sa.linear("1e-30", "1e-30"), 1, 2, "-3/2", ["T", "C"]),
        # 1/r is in both sides' slopes, not in their difference.
        (sa.linear(1, "1/3"), 1, "1e-60", 0, ["T", "C", "1 - C"]),
        # The first panel is below all digits of T, its change is not.
        (sa.Drift("sin(7*u) + 1/9"), 1, 1 + Fraction(1, 10**60), "-0.999", ["T"]),
        # A step that is small for the exponents is none for this parameter.
        (sa.Drift("2 + (10**12*(b - 1/3) + 1)**3", "u").bind(b="1/3"), 1, 2, 0, ["T"]),
    ],
)
def test_both_ways_agree(
    drift: sa.Drift,
    kappa: str,
    r: Any,
    start: Any,
    quantities: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("flint", reason="proved derivatives need python-flint")
    for quantity in quantities:
        numbers = {"quantity": quantity, "dps": 15}
        if "P" not in quantity:
            numbers |= {"r": r, "start": start}
        proved = sa.sensitivity(drift, kappa, **numbers)
        with monkeypatch.context() as patch:
            patch.setattr(slopes, "_by_balls", lambda *_: None)
            digits = sa.sensitivity(drift, kappa, **numbers)
            patch.setattr(slopes, "_by_digits", slopes._by_differences)
            differences = sa.sensitivity(drift, kappa, **numbers)
        assert proved.error_kind == "bound"
        with mp.workdps(60):
            for other in (digits, differences):
                assert other.error_kind == "estimate"
                for name, value in proved.derivative.items():
                    error = proved.error[name] + other.error[name]
                    assert abs(value - other.derivative[name]) <= error, (quantity, name)


@pytest.mark.parametrize(
    ("drift", "kappa", "numbers"),
    [
        (sa.friction(3, 1, "-0.4"), "0.01", {"r": 10, "start": "-1/5", "quantity": "C"}),
        (sa.friction(3, 1, "-0.4"), "1e-3", {"r": "1/2"}),
        (sa.linear(3, -1), "0.01", {"quantity": "1 - P"}),
        (sa.linear(-1, 2), "1e-3", {"r": 2, "start": "0.1"}),
        (sa.tanh(1, "-1/2", 1), "0.05", {"r": 2}),
        # Constant to the digits asked for, though its change by b is not.
        (sa.Drift("1 + b*exp(u)").bind(b="1e-60"), "1", {"r": 2}),
        (sa.tanh(1, "-1/2", 1000), "1", {"r": 2, "start": "1/3"}),
        # dA/dK divides by a square, whose disk holds 0 before that of the divisor does.
        (sa.hill("1/50", "-1.9", "0.65", n=7), "0.02", {"r": 2, "start": "1/3"}),
    ],
)
def test_sweeps_that_carry_derivatives_agree_with_differences(
    drift: sa.Drift, kappa: str, numbers: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Taylor, slow and constant panels; too many for balls.
    monkeypatch.setattr(slopes, "_by_balls", lambda *_: None)
    with monkeypatch.context() as patch:
        patch.setattr(slopes, "_by_differences", None)
        found = sa.sensitivity(drift, kappa, **numbers, dps=15)
    monkeypatch.setattr(slopes, "_by_digits", slopes._by_differences)
    differences = sa.sensitivity(drift, kappa, **numbers, dps=15, patience=60)
    for name, value in found.derivative.items():
        error = found.error[name] + differences.error[name]
        assert abs(value - differences.derivative[name]) <= error, name


@pytest.mark.parametrize("name", ["tanh stiff", "tanh stiff, crossing"])
def test_stiff_sigmoids_need_no_differences(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slopes, "_by_differences", None)
    problem = BY_NAME[name]
    found = sa.sensitivity(
        problem.make(), problem.kappa, problem.r, start=problem.start, dps=20, patience=60
    )
    # Drift and squared noise times c: all is c times as fast.
    weights = {n: problem.make().scalars()[n] for n in ("a_minus", "a_plus")}
    with mp.workdps(60):
        total, error = sum_of(found, weights | {"kappa": Fraction(problem.kappa) / 2})
        assert abs(total + 1) <= error


@pytest.mark.parametrize(
    ("name", "quantity"), [("hill", "C"), ("hill n=12", "1 - P"), ("sine sliding", "1 - P")]
)
def test_proved_derivatives_need_the_panels_of_the_value(
    name: str, quantity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor a finer cut, because a derivative's divisor is a square."""
    problem, panels = BY_NAME[name], list[int]()
    numbers = {"kappa": problem.kappa} | ({"r": problem.r} if quantity == "C" else {})

    def counted(*arguments: Any) -> list[Any]:
        found = cut(*arguments)
        panels.append(len(found))
        return found

    for module in (ball_sweep, derivatives):
        monkeypatch.setattr(module, "cut", counted)
    verb = sa.exit_probability if quantity == "C" else partial(sa.occupation, complement=True)
    verb(problem.make(), **numbers, dps=30, full=True)
    of_value = panels[:]
    panels.clear()
    assert sa.sensitivity(problem.make(), **numbers, quantity=quantity, dps=30)
    assert 0 < sum(panels) <= sum(of_value)


def test_products_of_truncated_series() -> None:
    draw, context = random.Random(3), mp.clone()
    for order in (1, 2, 3, 8, 13):
        ops = SeriesOps(order, context)
        zeros = draw.randint(0, order)
        a = [draw.randint(-9, 9) for _ in range(order)]
        b = [*a[zeros:], *[0] * zeros]
        for x, y in ((a, b), (b, a), (a, a)):
            one = TruncatedSeries(x, 0, ops)
            product = one * (one if x is y else TruncatedSeries(y, 0, ops))
            assert product.c == list(np.convolve(x, y)[:order])


def test_products_of_series_by_one_of_numbers() -> None:
    rng = random.Random(1)
    for count in (1, 2, 7, 40):
        a, b = ([rng.randint(-(2**n), 2**n) for _ in range(count)] for n in (3, 200))
        plain = [sum(a[i] * b[k - i] for i in range(k + 1)) for k in range(count)]
        assert digit_derivatives._product(a, b) == plain


def test_a_symmetric_scene_stands_still() -> None:
    found = sa.sensitivity(sa.polynomial(0, -2, 0, 1), "0.5", 3, dps=20)
    assert abs(found.derivative["start"]) <= found.error["start"] <= mpf("1e-20")
    assert abs(found.derivative["c0"]) <= found.error["c0"]


def test_scaling_where_A_is_no_polynomial() -> None:
    found = sa.sensitivity(sa.tanh("1.5", -1, 2), "0.8", 2, start="1/3", dps=20)
    weights = {"a_minus": "1.5", "a_plus": -1, "kappa": "0.4"}
    with mp.workdps(40):
        total, error = sum_of(found, weights)
        assert abs(total + 1) <= error
    assert abs(found.derivative["steepness"]) > 0.01


@pytest.mark.parametrize(("quantity", "name"), [("T", "mu"), ("C", "start"), ("1 - P", "kappa")])
def test_against_differences_of_plain_quadrature(quantity: str, name: str) -> None:
    at = {"mu": Fraction(3), "alpha": Fraction(1), "z0": Fraction(1, 4)}
    numbers = {"kappa": Fraction(1), "r": Fraction(2), "start": Fraction(1, 3)}

    def log_of(values: dict[str, Fraction]) -> Any:
        *parameters, kappa, r, start = values.values()
        drift = sa.friction(*parameters)
        if quantity == "1 - P":
            return mp.log(1 - reference_quadrature.occupation(drift, kappa, 14))
        verb = (
            reference_quadrature.escape_time
            if quantity == "T"
            else reference_quadrature.exit_probability
        )
        return mp.log(verb(drift, kappa, r, start, 14))

    scene = {} if quantity == "1 - P" else {"r": numbers["r"], "start": numbers["start"]}
    found = sa.sensitivity(sa.friction(**at), numbers["kappa"], **scene, quantity=quantity, dps=15)
    h = Fraction(1, 10**4)
    with mp.workdps(30):
        x = at | numbers
        below, above = (log_of(x | {name: x[name] + k * h}) for k in (-1, 1))
        slope = float((above - below) / (2 * number(h)))
    assert found.derivative[name] == pytest.approx(slope, rel=1e-6)


def test_at_the_end_of_a_range() -> None:
    here = sa.sensitivity(sa.friction(mu=0, alpha=1, z0="-0.4"), "0.5", 3, dps=20)
    beside = sa.sensitivity(sa.friction(mu="1e-12", alpha=1, z0="-0.4"), "0.5", 3, dps=20)
    assert here.derivative["mu"] == pytest.approx(float(beside.derivative["mu"]), rel=1e-10)
    assert here.condition["mu"] == 0
    at_kink = sa.sensitivity(sa.polynomial(1, 1), "0.5", 3, start=1, dps=15)
    inside = sa.sensitivity(sa.polynomial(1, 1), "0.5", 3, start="0.9999999999", dps=15)
    assert at_kink.derivative["start"] == pytest.approx(float(inside.derivative["start"]), rel=1e-8)


def test_an_array_of_one_is_asked_as_a_scalar() -> None:
    drift = sa.friction(3, 1, "-0.4")
    one, many = (sa.sensitivity(drift, kappa, 10) for kappa in (0.2, [[0.2]]))
    assert many.error_kind == one.error_kind
    for name, value in one.derivative.items():
        assert many.derivative[name].shape == (1, 1)
        assert many.derivative[name][0, 0] == value
        assert many.error[name][0, 0] == one.error[name]


def test_float64_and_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(floats, "_SCENES_AT_ONCE", 3)
    z0, kappa = np.array([-1.2, -0.5]), np.array([[0.3], [2.0]])
    found = sa.sensitivity(sa.friction(mu=3, alpha=1, z0=z0), kappa, "5")
    assert all(value.shape == (2, 2) for value in found.derivative.values())
    one = sa.sensitivity(sa.friction(mu=3, alpha=1, z0=-0.5), 2.0, "5")
    more = sa.sensitivity(sa.friction(mu=3, alpha=1, z0=-0.5), 2.0, "5", dps=30)
    assert list(one.derivative) == ["mu", "alpha", "z0", "kappa", "r", "start"]
    for name, value in one.derivative.items():
        assert isinstance(value, float)
        apart = abs(value - found.derivative[name][1, 1])
        assert apart <= one.error[name] + found.error[name][1, 1]
        assert 0 < one.error[name] <= 1e-9 * max(1, abs(value))
        assert abs(mpf(value) - more.derivative[name]) <= one.error[name] + more.error[name]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (lambda: sa.sensitivity(sa.linear(1, -1), 1), "r is missing"),
        (lambda: sa.sensitivity(sa.linear(1, -1), 1, 2, quantity="P"), "r is given, but unused"),
        (lambda: sa.sensitivity(sa.linear(1, -1), 1, 2, quantity="T̃"), "give one of 'T', 'C'"),
        (lambda: sa.sensitivity(sa.linear(1), 1, 2), "a_plus have no value"),
        (lambda: sa.sensitivity("friction", 1, 2), "give a Drift"),
        (lambda: sa.sensitivity(sa.linear(1, 1), 0, 2), "kappa is 0"),
        (lambda: sa.sensitivity(sa.linear(1, 1), 1, 2, dps=5000), "from 1 to 4000"),
        (lambda: sa.sensitivity(sa.linear([1, 2], 1), 1, 2, dps=20), "is an array"),
        (lambda: sa.sensitivity(sa.linear(1, 1), 1, quantity="P"), "no sliding region"),
    ],
)
def test_bad_input(arguments: Any, told: str) -> None:
    with pytest.raises(InputError, match=told):
        arguments()


def test_differences_that_do_not_settle_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(balls, "available", lambda: False)
    monkeypatch.setattr(slopes, "_by_digits", slopes._by_differences)
    monkeypatch.setattr(slopes, "_MOST_DIGITS", 20)
    with pytest.raises(AccuracyError, match="do not settle"):
        sa.sensitivity(sa.linear(1, 1), 1, 2, dps=8)


PROBLEMS = [p for p in tagged("moderate") if not {"slow", "refused", "narrow"} & set(p.tags)]


# A start that is no float moves all derivatives.
PROBLEMS = PROBLEMS[::4] + [BY_NAME[n] for n in ("linear repelling, stiff", "start by the edge")]


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda p: p.name)
def test_float64_claims_no_less_than_its_error(problem: Problem) -> None:
    drift, numbers = problem.make(), (problem.kappa, problem.r)
    found = sa.sensitivity(drift, *numbers, start=problem.start)
    more = sa.sensitivity(drift, *numbers, start=problem.start, dps=20)
    for name, value in found.derivative.items():
        assert abs(mpf(value) - more.derivative[name]) <= found.error[name] + more.error[name], name
        assert found.error[name] <= 1e-7 * max(1, abs(value))


@pytest.mark.parametrize(
    ("drift", "kappa", "r", "start", "quantity"),
    [
        (sa.linear(-1, 1), 1, 2, -1, "T"),  # V is as high at both ends of the layer
        (sa.sine("-1.667", "-1.933", "-3.884", waves=2), "0.5", "4", "-3.1", "T"),  # sin(pi) is 0
        (sa.hill(1, -2, "1/2", n=2), "0.8", 1, "0.7", "C"),
        (sa.friction(3, 1, "-0.3"), "0.3", "0.4", "-0.2", "1 - C"),
        (sa.Drift("a + b*erf(2*u) + sqrt(2 + u)").bind(a=1, b=-2), "0.7", "0.8", "0.3", "T"),
        (sa.tanh(1, "-1/2", 5), "0.1", None, None, "1 - P"),
        (sa.Drift("1/2 - u"), "0.4", None, None, "P"),
        # Exponents far from 0 within a block that ends as high as it begins.
        (sa.linear(-0.9412458753167798, 1.0849805711995635), 0.1045064285367239, 3, 0, "C"),
        (sa.friction(mu=2.5459650743031097, alpha=0.37202650653500857, z0=-0.8004263393628291),
         0.14513512655321817, 3, 0, "C"),
        # The start's is one side's alone.
        (sa.friction(3, 1, "-0.000000000000001"), "0.1", 10, 0, "C"),
    ],
)  # fmt: skip
def test_float64_against_balls(
    drift: sa.Drift, kappa: str, r: Any, start: Any, quantity: str
) -> None:
    numbers = {} if r is None else {"r": r, "start": start}
    found = sa.sensitivity(drift, kappa, **numbers, quantity=quantity)
    more = sa.sensitivity(drift, kappa, **numbers, quantity=quantity, dps=20)
    assert list(found.derivative) == [*drift.parameters, "kappa", *numbers]
    for name, value in found.derivative.items():
        off = abs(mpf(value) - more.derivative[name])
        assert off <= found.error[name] + more.error[name], name
        assert found.error[name] <= 1e-10 * max(1, abs(value)), name


@pytest.mark.parametrize("r", [1, "1/2", "5/2"])
@pytest.mark.parametrize("quantity", ["T", "C", "1 - C"])
def test_rounding_of_a_start_beside_the_end_counts_in_every_slope(quantity: str, r: Any) -> None:
    # Its distance from the end is off by one part in 1e8 or so.
    for start in (Fraction(r) - Fraction(1, 10**8), Fraction(1, 10**8) - Fraction(r)):
        scene = sa.linear(1, 2), "1/3", r
        found = sa.sensitivity(*scene, start=start, quantity=quantity)
        more = sa.sensitivity(*scene, start=start, quantity=quantity, dps=20)
        for name, value in found.derivative.items():
            off = abs(mpf(value) - more.derivative[name])
            assert off <= found.error[name] + more.error[name], name


@pytest.mark.parametrize("quantity", ["T", "C", "1 - C"])
@pytest.mark.parametrize("drift", [sa.friction(3, 1, "-0.3"), sa.polynomial(*range(-7, 6))])
def test_moderate_sides_take_panels_of_their_own(
    drift: sa.Drift, quantity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked() -> sa.Sensitivity:
        return sa.sensitivity(drift, "0.7", 3, start="0.25", quantity=quantity)

    others: list[Any] = []
    usual = floats._panels
    monkeypatch.setattr(floats, "_panels", lambda *args: (others.append(args), usual(*args))[1])
    own = asked()
    assert not others
    monkeypatch.setattr(float_sides, "_HIGHEST", 0.0)
    general = asked()
    assert others
    for name, value in own.derivative.items():
        assert abs(value - general.derivative[name]) <= own.error[name] + general.error[name]


def test_what_float64_cannot_say_is_taken_from_digits() -> None:
    # Where b is 0 the needle is in dA/db alone, between the nodes that suffice for A.
    drift = sa.Drift("1 - u/2 + b*exp(-(1000*(u - 1/3))**2)").bind(b=0)
    found = sa.sensitivity(drift, "0.5", 2)
    assert found.derivative["b"] == pytest.approx(-0.000836945634543285, rel=1e-11)


@pytest.mark.parametrize("kappa", ["1e-70", "1e-90", "1e-124"])
def test_noise_so_weak_that_T_is_the_time_without_it(kappa: str) -> None:
    """T is then int du/A, and its derivative in kappa 0."""

    def log_time(a: Any, b: Any, s: Any) -> Any:
        """log int_0^2 du/A, A = b beyond 1."""
        inside = mp.quad(
            lambda u: 1 / ((a + b) / 2 - (a - b) / 2 * mp.tanh(s * u) / mp.tanh(s)), [0, 1]
        )
        return mp.log(inside + 1 / b)

    found = sa.sensitivity(sa.tanh(3, 1, 1), kappa, 2)
    for k, name in enumerate(("a_minus", "a_plus", "steepness")):
        order = tuple(int(k == j) for j in range(3))
        true = mp.diff(log_time, (3, 1, 1), order)
        assert abs(found.derivative[name] - true) <= found.error[name] < 1e-12
        assert abs(true) > 1e-2
    assert float(kappa) * abs(found.derivative["kappa"]) < 1e-12


@pytest.mark.parametrize(("steepness", "proved"), [("1e-300", True), ("3e-150", False)])
def test_a_derivative_whose_formula_cancels(
    steepness: str, proved: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sigmoid that is a straight line, to which its formula by the steepness adds nothing."""
    if not proved:
        monkeypatch.setattr(balls, "available", lambda: False)
        monkeypatch.setattr(slopes, "_by_differences", None)
    found = sa.sensitivity(sa.tanh(1, -1, steepness), "0.05", 3, dps=30, patience=8)
    line = sa.sensitivity(sa.linear(1, -1), "0.05", 3, dps=30)
    assert found.error_kind == ("bound" if proved else "estimate")
    assert abs(found.derivative["steepness"]) <= found.error["steepness"] < 1e-29
    for name, value in line.derivative.items():
        assert abs(found.derivative[name] - value) <= found.error[name] + line.error[name]


def test_bounds_where_a_formula_cancels() -> None:
    """dA/ds of tanh(s u)/tanh(s) is 2 s (u - u^3)/3 and terms in s^3."""
    change = profile_of(sa.tanh(-1, 1, "1e-30").derivative("steepness"))
    with precision(128):
        sharp, point = sharpened(change), Fraction(1, 4)
        assert not abs(change.value(point)) < 1e-20
        assert abs(sharp.value(point) / exact_ball(Fraction(5, 32) / 10**30) - 1) < 1e-7
        # On |u - 1/4| <= 1/2 the largest is at 1/4 - i/2, or at 1/4 + i/2.
        largest = abs(complex(0.25, 0.5) - complex(0.25, 0.5) ** 3) * 2 / 3e30
        assert largest < sharp.bound(point, Fraction(1, 2)) < 3 * largest


def test_a_derivative_beyond_float64() -> None:
    with pytest.raises(sa.RangeError, match=r"d log\(T\)/d\(kappa\) is outside .* pass dps="):
        sa.sensitivity(sa.linear(3, -1), "1e-139", 2)


@pytest.mark.parametrize("drift", [sa.tanh(3, 1, "1e30"), sa.hill(3, 1, "1/7", n=3)])
def test_ends_of_a_change_take_no_simplification(
    drift: sa.Drift, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which takes seconds where the sigmoid is steep; a- and a+ alone move the ends."""
    monkeypatch.setattr("sympy.simplify", None)
    for name in drift.parameters:
        change = drift.derivative(name)
        assert [change.end(side) for side in (-1, 1)] == [name == "a_minus", name == "a_plus"]
