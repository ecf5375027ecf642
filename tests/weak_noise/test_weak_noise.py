"""Weak noise: measured orders, honest errors, and code that shares nothing with the expansion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym import methods
from symasym.asymptotics.weak_noise import critical_points, regular_part
from symasym.asymptotics.weak_noise.one_sided import inverse_coefficients
from symasym.asymptotics.weak_noise.regular_part import panel_integrals
from symasym.base.call_context import own_context
from symasym.drift.field.taylor_field import ExactField
from tests.asking import exact_value
from tests.moments import moment_coefficients
from tests.problems import PROBLEMS, Problem, constant_drift, distance, linear_sliding, relative
from tests.strategies import ALL, SAMPLE, WHOLE, drifts, powers_of_ten, rationals

WEAK: dict[str, Any] = {"method": "laplace"}
FRICTION = sa.friction(3, 1, "-0.3")
SLIDING = sa.polynomial("1/4", -1, "-1/3")
REPELLING = sa.polynomial("1/7", "3/2", "1/3")
ON_A_BARRIER = sa.polynomial(0, "3/2", "1/3", "-1/4")  # for start 0
ON_A_WELL = sa.polynomial(0, "-3/2", "1/3", "-1/4")
TWO_WELLS = sa.Drift("-u/5 + sin(9*u)/2")


@pytest.fixture(autouse=True, scope="module")
def estimates() -> Iterator[None]:
    """The estimates themselves: proved bounds of T have tests of their own."""
    laplace = methods.METHODS["laplace"]
    right = laplace.prover
    assert right
    unproved = replace(laplace, prover=lambda s, q: None if q.name == "T" else right(s, q))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(methods.METHODS, "laplace", unproved)
        yield


# -- order -------------------------------------------------------------------------------------


def slope(verb: Any, drift: sa.Drift, kappas: Any, order: int, dps: int = 90, **given_: Any) -> Any:
    """d log(relative error)/d log(kappa), and the larger of the two errors."""
    errors = []
    for kappa in kappas:
        found = verb(drift, kappa, **given_, **WEAK, order=order, dps=dps)
        errors.append(relative(found, exact_value(verb, drift, kappa, **given_, dps=dps + 5)))
    with mpmath.workdps(20):
        steps = mpmath.log(mpmath.mpf(kappas[0]) / mpmath.mpf(kappas[1]))
        return float(mpmath.log(errors[0] / errors[1]) / steps)


@pytest.mark.parametrize("order", range(6))
@pytest.mark.parametrize(
    ("drift", "scene"),
    [
        (FRICTION, {"r": 10}),
        (sa.friction(1, 1, "-0.3"), {"r": 10}),
        (sa.friction(3, 1, -2), {"r": 4, "start": "1/3"}),  # no well
        (sa.friction(3, 1, "2.3"), {"r": 3, "start": "1/2"}),  # downwards
        (SLIDING, {"r": 2, "start": "1/3"}),
        (REPELLING, {"r": 2, "start": "1/3"}),
        (ON_A_WELL, {"r": 2}),
        (FRICTION, {"r": 4, "start": "-2"}),
        (SLIDING, {"r": 4, "start": "3"}),
        (sa.friction(3, 1, -2), {"r": 4, "start": "-5/2"}),
        (FRICTION, {"r": 4, "start": "-1"}),
        (FRICTION, {"r": 4, "start": "1"}),
        (FRICTION, {"r": "0.8", "start": "-1/3"}),
        (FRICTION, {"r": 1}),
    ],
)
def test_orders_of_the_time(drift: sa.Drift, scene: Any, order: int) -> None:
    measured = slope(sa.escape_time, drift, ("1e-2", "1e-3"), order, **scene)
    assert measured == pytest.approx(2 * (order + 1), rel=0.03)


@pytest.mark.parametrize("drift", [sa.tanh(1, "-1/2", 3), TWO_WELLS])
def test_orders_where_a_is_no_polynomial(drift: sa.Drift) -> None:
    kappas, scene = ("2e-2", "2e-3"), {"start": "1/5", "log": True}
    exact = [sa.escape_time(drift, k, 2, **scene, dps=30) for k in kappas]
    for order in (0, 2):
        errors = [
            distance(sa.escape_time(drift, k, 2, **scene, **WEAK, order=order, dps=28), e)
            for k, e in zip(kappas, exact, strict=True)
        ]
        with mpmath.workdps(20):
            measured = float(mpmath.log10(errors[0] / errors[1]))
        assert measured == pytest.approx(2 * (order + 1), rel=0.03)


@pytest.mark.parametrize("order", [0, 1, 3])
def test_orders_from_a_barrier(order: int) -> None:
    """The error is (a + b log lam) lam^-(N + 1), beside log(lam): that log is taken out."""
    kappas = ("1e-6", "1e-8")
    measured = slope(sa.escape_time, ON_A_BARRIER, kappas, order, dps=90, r=2)
    assert measured == pytest.approx(2 * (order + 1), rel=0.03)
    # The odd half of the two half Gaussians' series cancels from S_L + S_R.
    chance = slope(sa.exit_probability, ON_A_BARRIER, kappas, order, dps=90, r=2)
    assert chance == pytest.approx(2 * (order + 1) + 1, rel=0.03)


@pytest.mark.parametrize("order", range(6))
def test_orders_of_probabilities(order: int) -> None:
    kappas, wanted = ("1e-2", "1e-3"), pytest.approx(2 * (order + 1), rel=0.03)
    for scene in ({"r": 10}, {"r": "0.8", "start": "-1/3"}, {"r": 3, "start": "1/3"}):
        assert slope(sa.exit_probability, FRICTION, kappas, order, **scene) == wanted
    assert slope(sa.exit_probability, REPELLING, kappas, order, r=2, start="1/3") == wanted
    assert slope(sa.occupation, SLIDING, kappas, order, complement=True) == wanted
    for drift in (SLIDING, sa.polynomial("1/10", 2, 0, "-25/2", 0, 9)):
        assert slope(sa.occupation, drift, kappas, order, complement=True) == wanted


# -- honesty -----------------------------------------------------------------------------------


def asked_of(drift: sa.Drift, r: Any, start: Any) -> list[tuple[Any, dict[str, Any]]]:
    scene = {"r": r, "start": start}
    asked: list[tuple[Any, dict[str, Any]]] = [
        (sa.escape_time, scene),
        (sa.exit_probability, scene),
        (sa.exit_probability, {**scene, "complement": True}),
    ]
    if drift.ends[0] > 0 > drift.ends[1]:
        asked += [(sa.occupation, {}), (sa.occupation, {"complement": True})]
    return asked


def check_scene(scene: Any, orders: Any, log: bool, arrays: bool = False) -> int:
    """Claimed against true error; how many answers there were."""
    drift, kappa, r, start = scene
    kappa, answers = Fraction(float(Fraction(kappa))), 0
    for verb, given_ in asked_of(drift, r, start):
        exact = None
        for order in orders:
            options = {**given_, **WEAK, "order": order, "log": log, "full": True}
            try:
                found = verb(drift, kappa, **options, dps=20)
            except sa.SymasymError:
                continue
            if exact is None:
                try:
                    exact = verb(drift, kappa, **given_, log=log, dps=50)
                except sa.SymasymError:
                    break
            answers += 1
            assert found.error_kind in ("estimate", "bound")
            assert distance(found.value, exact) <= found.error, (verb.__name__, order)
            if arrays:
                try:
                    some = verb(drift, [float(kappa)], **options)
                except sa.SymasymError:
                    continue
                assert distance(float(some.value[0]), exact) <= float(some.error[0])
                assert distance(float(some.value[0]), found.value) <= found.error + some.error[0]
    return answers


MILD = {"slow", "refused", "narrow", "stiff", "extreme"}


@pytest.mark.every(3)
@pytest.mark.parametrize("problem", [p for p in PROBLEMS if not p.tags & MILD], ids=str)
@WHOLE
def test_claimed_error_covers_the_true_one(problem: Problem, whole: bool) -> None:
    drift = problem.make()
    orders = (0, 1, 2, 4, 8) if drift.exact_coefficients() is not None else (0, 3)
    kappas = (problem.kappa, "1/4", "3/100") if "analytic" not in problem.tags else ("1/10",)
    for kappa in kappas:
        scene = drift, kappa, problem.r, problem.start
        some = orders if whole or kappa == problem.kappa else orders[::4]
        check_scene(scene, some, kappa != "1/4", arrays=kappa != "3/100")


@pytest.mark.every(3)
@pytest.mark.parametrize(
    "problem",
    [p for p in PROBLEMS if p.tags & {"stiff", "extreme"} and not p.tags & {"refused", "slow"}],
    ids=str,
)
def test_claimed_error_at_the_ends_of_the_ranges(problem: Problem) -> None:
    check_scene((problem.make(), problem.kappa, problem.r, problem.start), (0, 3), True)


@st.composite
def weak_scenes(draw: st.DrawFn) -> tuple[sa.Drift, Fraction, Fraction, Fraction]:
    """Zeros close to each other or to an end, starts on and beside them, r on and beside 1."""
    near = powers_of_ten(-7, -0.7)
    sign = st.sampled_from([-1, 1])
    zeros: list[Fraction] = []
    kind = draw(st.sampled_from(["any", "zeros", "zeros", "even"]))
    if kind == "any":
        drift = draw(drifts().filter(lambda d: d.exact_coefficients() is not None))
    elif kind == "even":
        # Wells of nearly equal depth.
        tilt = draw(st.sampled_from([Fraction(0), draw(near)]))
        drift = sa.polynomial(tilt, draw(rationals(-3, 3)), 0, draw(rationals(-5, 5)), 0, 1)
    else:
        zeros = draw(st.lists(rationals(-1.3, 1.3), min_size=1, max_size=5))
        if len(zeros) > 1 and draw(st.booleans()):
            zeros[1] = zeros[0] + draw(near)
        if draw(st.booleans()):
            zeros[-1] = draw(sign) + draw(sign) * draw(near)
        c = [draw(sign) * draw(powers_of_ten(-2, 2))]
        for z in zeros:
            c = [a - z * b for a, b in zip([Fraction(0), *c], [*c, Fraction(0)], strict=True)]
        drift = sa.polynomial(*c)
    r = draw(st.one_of(powers_of_ten(-0.5, 1.5), near.map(lambda x: 1 + x), st.just(Fraction(1))))
    starts = [Fraction(0), r * draw(rationals(-0.99, 0.99)), draw(sign) * (1 - draw(near))]
    starts += zeros + [z + draw(sign) * draw(near) for z in zeros]
    start = draw(st.sampled_from([x for x in starts if abs(x) < r]))
    return drift, draw(powers_of_ten(-3, 0.2)), r, start


@settings(SAMPLE, max_examples=30)
@given(weak_scenes(), st.sampled_from([*range(9), "optimal"]), st.booleans())
def test_random_scenes_sample(scene: Any, order: Any, log: bool) -> None:
    check_scene(scene, (order,), log)


@pytest.mark.slow
@ALL
@given(weak_scenes(), st.sampled_from([*range(9), "optimal"]), st.booleans())
def test_random_scenes(scene: Any, order: Any, log: bool) -> None:
    check_scene(scene, (order,), log, arrays=True)


@pytest.mark.slow
@settings(SAMPLE, max_examples=300)
@given(drifts(), powers_of_ten(-1.5, 0.2), rationals(0.4, 3), rationals(-0.99, 0.99))
def test_random_drifts_of_every_kind(drift: Any, kappa: Any, r: Any, share: Any) -> None:
    check_scene((drift, kappa, r, r * share), (0, 3), True)


@pytest.mark.parametrize(
    ("coefficients", "kappa", "r", "start", "orders"),
    [
        # The start is a well, or 1e-16 beside it: shares of 1e142 are there to cancel.
        (
            ("-41666806481489/500000000000000", "-834983/10000000"),
            "184287/5000000",
            "1151573/1000000",
            "-49901383/50000000",
            (0, 2, 4, 6),
        ),
        # Both sides' shares are unknown and one of them negative.
        (
            (
                "306131137987222980693387/156250000000000000000000000",
                "956215599934979450139/39062500000000000000000",
                "-340560893028505757109/2500000000000000000000",
                "-7554195321244066503/5000000000000000000",
                "22198604084196333/5000000000000000",
                "369363/50000",
            ),
            "422753/50000000",
            "50415581/50000000",
            "9427713647/50000000000",
            (0, 2, 6),
        ),
        # The second of the next two terms is small by chance.
        (("1/10", "7/125", 0, 0, 0, 1), "1/10", 1, 0, (1, 2, 3, 4)),
        # The series of the start and of the end cancel to 1e-5 of themselves.
        (
            ("-992910099291/125000000000", "-99291/12500"),
            "100023/100000",
            "217741/25000",
            "-10000001/10000000",
            (0, 3),
        ),
        # Terms of no use, of which the majorants tell.
        (
            (-0.000141854564390583, 1.4e-21, 7.6e-17, 1.9191930748933874, -172.93675548353414)
            + (6.3e-9, 0.5412220907716732),
            0.007779827729530361,
            "1/2",
            "0",
            (0,),
        ),
    ],
)
def test_scenes_that_were_claimed_too_well(
    coefficients: Any, kappa: Any, r: Any, start: Any, orders: Any
) -> None:
    scene = sa.polynomial(*coefficients), kappa, Fraction(r), Fraction(start)
    for log in (False, True):
        check_scene(scene, orders, log, arrays=True)


@pytest.mark.parametrize(
    ("drift", "start", "kappa", "known"),
    [
        (sa.polynomial(0, -1, 0, 0, 0, 0, 0, "1/2"), "1/5", "1/5", 12),
        (sa.polynomial(0, 1, 0, 0, 0, 0, 0, "1/2"), "0", "1/10", 6),  # from the barrier
        (sa.Drift("-(u - 1/3) - (u - 1/3)**9/2"), "1/5", "1/10", 6),
        (sa.polynomial("1/2", 0, 0, 0, 0, 1), "0", "1/500", 6),  # flat at the start
    ],
)
def test_terms_that_vanish_do_not_tell_the_error(
    drift: sa.Drift, start: str, kappa: str, known: int
) -> None:
    scene = drift, kappa, Fraction(9, 10), Fraction(start)
    assert check_scene(scene, (0, 1, 2, 3, 4, 5, "optimal"), True, arrays=True) >= known
    with pytest.raises(sa.AccuracyError, match="to order 3"):
        sa.escape_time(drift, kappa, "9/10", start=start, **WEAK, order=0)


def test_arrays_from_a_start_beside_a_well() -> None:
    """Off by one float it is refused, and not answered by what exponentials leave of 1e142."""
    drift = sa.polynomial("-41666806481489/500000000000000", "-834983/10000000")
    options: dict[str, Any] = {"method": "laplace", "order": 4, "log": True, "full": True}
    start, kappa = float(Fraction("-49901383/50000000")), [0.0368574]
    with pytest.raises(sa.AccuracyError):
        sa.exit_probability(drift, kappa, 1.151573, start=[start], **options)
    # That start itself, a rational that all share, has halves of Gaussians.
    found = sa.exit_probability(drift, kappa, 1.151573, start="-49901383/50000000", **options)
    assert found.error[0] < 1e-12


@pytest.mark.parametrize(
    ("drift", "kappa"),
    [
        (sa.tanh(1, "1/2", 20), "1"),  # C would be off by 12 %
        (sa.tanh(1, "1/2", 20), "1/2"),
        (sa.tanh(1, "1/2", 20), "1/4"),
        (sa.tanh(1, "1/2", 20), "1/5"),
        (sa.tanh(1, "-1/2", 20), "1"),
        (sa.hill(-1, "1/2", "1/2", n=8), "1/2"),  # flat to order 8 at -1
        (sa.hill(-1, "1/2", "1/2", n=8), "1/5"),
        (sa.Drift("1 + (u + 1)**8/300"), "1/5"),
    ],
)
def test_a_bend_between_the_places(drift: sa.Drift, kappa: str) -> None:
    """Parts exponentially small beside S, e^{lam V} at the bend, are not in the error."""
    check_scene((drift, kappa, 4, "-1"), (2,), False)


# -- two ways to the same coefficients ---------------------------------------------------------


def outer_terms(drift: str, count: int) -> list[Any]:
    """h_1, h_2, ... as SymPy expressions."""
    phi, u = sympy.sympify(drift), sympy.Symbol("u")
    found = [1 / phi]
    for _ in range(count - 1):
        found.append(sympy.simplify(-sympy.diff(found[-1], u) / phi))
    return found


def by_fractions(field: ExactField, lo: Fraction, hi: Fraction, count: int, context: Any) -> Any:
    """int h_k over [lo, hi], k = 1 to `count`, by the poles of h_k."""
    rows = regular_part.polynomial_primitives(field, (lo, hi), count, context)
    assert rows is not None
    return [high - low for low, high in rows]


@pytest.mark.parametrize("drift", ["3/2 + u - u**2/3", "2 + u**3 - u/3", "-5/2 + u/2 + u**4"])
def test_outer_part_in_three_ways(drift: str) -> None:
    lo, hi, count = Fraction(-2, 3), Fraction(5, 6), 4
    with own_context(40) as context:
        field = ExactField(sa.Drift(drift), False, context)
        fractions = by_fractions(field, lo, hi, count, context)
        panels = panel_integrals(field, lo, hi, [], count, context)
        for k, h in enumerate(outer_terms(drift, count)):
            value = sympy.lambdify(sympy.Symbol("u"), h, modules="mpmath")
            with mpmath.workdps(40):
                ends = [mpmath.mpf(x.numerator) / x.denominator for x in (lo, hi)]
                wanted = mpmath.quad(value, [ends[0], 0, ends[1]])
            assert abs(fractions[k] - wanted) < 1e-30
            assert abs(panels[k] - wanted) < 1e-30


def test_outer_part_of_zeros_in_a_row() -> None:
    """1/A is a millionth and less of what each of the 30 zeros contributes to it."""
    a = "*".join(f"(u**2 + {(20 + k) ** 2}/400)" for k in range(15))
    lo, hi = Fraction(-2, 3), Fraction(5, 6)
    with own_context(30) as context:
        field = ExactField(sa.Drift(a), False, context)
        (found,) = by_fractions(field, lo, hi, 1, context)
        with mpmath.workdps(50):
            a = sympy.lambdify(sympy.Symbol("u"), sympy.sympify(a), modules="mpmath")
            wanted = mpmath.quad(lambda u: 1 / a(u), [mpmath.mpf(-2) / 3, 0, mpmath.mpf(5) / 6])
        assert relative(found, wanted) < 1e-28


@pytest.mark.parametrize(
    ("drift", "lo"),
    [
        (FRICTION, Fraction(-1)),
        (ON_A_BARRIER, Fraction(-1, 2)),
        (ON_A_BARRIER, Fraction(0)),  # a start on the barrier
        (ON_A_WELL, Fraction(0)),
        (sa.polynomial("1/10", 2, 0, "-25/2", 0, 9), Fraction(-4, 5)),
    ],
)
def test_finite_parts_in_two_ways(drift: sa.Drift, lo: Fraction) -> None:
    with own_context(40) as context:
        field = ExactField(drift, False, context)
        zeros = [u for u, _ in critical_points.simple_zeros(field, lo, Fraction(1), context)]
        fractions = by_fractions(field, lo, Fraction(1), 5, context)
        panels = panel_integrals(field, lo, Fraction(1), zeros, 5, context)
        for one, other in zip(fractions, panels, strict=True):
            assert abs(one - other) < 1e-25 * (1 + abs(one))


def test_arc_of_a_zero_against_moments() -> None:
    """du/ds where V = -phi'(z) s²/2 about a zero of phi, by moments instead of a reversion."""
    with own_context(30) as context:
        phi = [context.mpf(x) for x in (0, "1.5", "-0.7", 2, "0.3", -1, "0.9")]
        inverse = inverse_coefficients(phi, 6, 1, context.one)
        fall = [context.zero, context.zero, *(-c / (k + 2) for k, c in enumerate(phi[1:]))]
        d = moment_coefficients(fall, [context.one, *[context.zero] * 5], 2)
        assert inverse_coefficients(phi, 6, 2, context.one) == inverse[::2]
        for i, (a, b) in enumerate(zip(inverse, d, strict=False)):
            assert abs(a - b / context.sqrt(phi[1]) ** (i + 1)) < 1e-27


def test_the_mirror_of_a_field() -> None:
    with own_context(30) as context:
        for drift, offset in ((FRICTION, Fraction(1, 9)), (sa.Drift("tanh(u) - u/3"), Fraction(0))):
            field = ExactField(drift, False, context, offset)
            u = context.mpf("0.3")
            value, slope = field.mirror().value_and_slope(-u)
            assert abs(value + field.number(u)) < 1e-28
            assert abs(slope - field.slope(u)) < 1e-28
            assert field.mirror().mirror().number(u) == field.number(u)


def test_finite_part_of_a_zero_by_hand() -> None:
    """1/(u (1 + u)) and what follows it, over [-1/2, 1]: a principal value for the first."""
    with own_context(40) as context:
        field = ExactField(sa.polynomial(0, 1, 1), False, context)
        found = by_fractions(field, Fraction(-1, 2), Fraction(1), 2, context)
        # log|u/(1 + u)|; h_2 = (1 + 2u)/(u + u^2)^3, a primitive of which is -1/(2 (u + u^2)^2).
        assert abs(found[0] + context.log(2)) < 1e-35
        assert abs(found[1] - (8 - context.mpf(1) / 8)) < 1e-33


@pytest.mark.parametrize("lam", [1, 3])
@pytest.mark.parametrize("barrier", [True, False])
def test_corner_against_quadrature(barrier: bool, lam: int) -> None:
    """The double integral up to a large s, less the powers and the logarithm it grows with."""
    with own_context(20) as c:
        # Its nodes s are the same for every i.
        known: dict[tuple[int, Any], Any] = {}
        for i, j in [(i, j) for i in range(4) for j in range(4)]:
            terms, found = [c.one / lam], c.zero
            for m in range(12):
                terms.append(terms[-1] * ((2 * m + 1 - j) if barrier else (j - 1 - 2 * m)) / lam)

            def inner(s: Any, j: int = j) -> Any:
                if barrier:
                    return c.quadgl(lambda t: t**j * c.exp(lam * (t * t - s * s) / 2), [0, s])
                # t = s + x, so that the exponential falls from 1, to 1e-31 at 12.
                return c.quadgl(
                    lambda x: (s + x) ** j * c.exp(-lam * x * (s + x / 2)), [0, 1, 3, 12]
                )

            def kept(s: Any, j: int = j, inner: Any = inner) -> Any:
                if (j, s) not in known:
                    known[j, s] = inner(s)
                return known[j, s]

            edge = c.mpf(8)
            with c.workdps(15):
                total = c.quadgl(lambda s, i=i: s**i * kept(s), [0, 1, 2, 4, edge])
            for m, coefficient in enumerate(terms):
                power = i + j - 1 - 2 * m
                if power == -1:
                    total -= coefficient * c.log(edge)
                else:
                    total -= coefficient * edge ** (power + 1) / (power + 1)
            for weight, power, logs in critical_points.corner_terms(c.mpf(2), i, j, barrier, c):
                found += weight * c.mpf(lam) ** -power * c.log(lam) ** logs
            wanted = (2 if barrier else -2) * total
            assert abs(found - wanted) < 1e-7 * (1 + abs(wanted)), (i, j)


def test_places_against_laplace_integral() -> None:
    """The well and the barrier of FRICTION as `sa.laplace_integral` has them."""
    u, V = sympy.Symbol("u"), FRICTION.potential().args[1][0]
    free = next(iter(V.free_symbols))
    V = sympy.nsimplify(V.subs(free, u))
    with own_context(40) as context:
        field = ExactField(FRICTION, False, context)
        one = critical_points.both_sides(field, Fraction(-1), Fraction(1), 4, context, 40)[1]
        lists = {"well": one.speed_points, "barrier": one.scale_points}
        for kind, sign in (("well", -1), ("barrier", 1)):
            place = next(p for p in lists[kind] if p.kind == kind)
            near = sympy.Rational(round(float(place.u) * 100), 100)
            width = sympy.Rational(3, 100)
            other = sa.laplace_integral(sign * V, 1, u, near - width, near + width, order=5)
            value = other.evaluate(1e6, dps=25, log=True)
            lam = context.mpf(10) ** 6
            (part,) = place.series.parts
            mine = sum(c * lam ** -(part.offset + n) for n, c in enumerate(part.coefficients[:5]))
            found = context.log(mine) + lam * place.height
            assert relative(found, value) < 1e-20


# -- the best order ----------------------------------------------------------------------------


def test_optimal_order() -> None:
    lams, logs = [], []
    for kappa in ("0.1", "0.085", "0.07", "0.06"):
        best = sa.escape_time(FRICTION, kappa, 4, **WEAK, order="optimal", dps=30, full=True)
        exact = sa.escape_time(FRICTION, kappa, 4, dps=45)
        for order in range(21):
            try:
                one = sa.escape_time(FRICTION, kappa, 4, **WEAK, order=order, dps=30, full=True)
            except sa.AccuracyError:
                continue
            assert best.error <= one.error
            assert (order == best.order) == (one.error == best.error)
        assert distance(best.value, exact) <= best.error
        lams.append(2 / float(kappa) ** 2)
        logs.append(float(mpmath.log(best.error / exact)))
    fit = np.polyfit(lams, logs, 1)
    assert fit[0] < 0
    assert np.abs(np.polyval(fit, lams) - logs).max() < 1
    found = sa.escape_time(FRICTION, [0.08, 0.03], 4, **WEAK, order="optimal", full=True)
    for k, kappa in enumerate((0.08, 0.03)):
        exact = sa.escape_time(FRICTION, kappa, 4, dps=40)
        assert distance(float(found.value[k]), exact) <= float(found.error[k])


# -- symmetry and closed forms -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("coefficients", "r", "start"),
    [
        (("13/10", -4, 0, 3), "3", "1/3"),
        (("13/10", -4, 0, 3), "1/2", "-1/7"),
        (("1/7", "3/2", "1/3"), "2", "-3/2"),
        ((0, "3/2", "1/3", "-1/4"), "2", "0"),
        ((0, "-3/2", "1/3", "-1/4"), "2", "0"),
    ],
)
def test_mirror_image(coefficients: Any, r: str, start: str) -> None:
    flipped = [Fraction(c) * (-1) ** (k + 1) for k, c in enumerate(coefficients)]
    drift, image = sa.polynomial(*coefficients), sa.polynomial(*flipped)
    other = -Fraction(start)
    options: dict[str, Any] = {**WEAK, "order": 3, "dps": 30, "full": True}
    kappa = "1/20"
    pairs = [
        (
            sa.escape_time(drift, kappa, r, start=start, **options),
            sa.escape_time(image, kappa, r, start=other, **options),
        ),
        (
            sa.exit_probability(drift, kappa, r, start=start, **options),
            sa.exit_probability(image, kappa, r, start=other, complement=True, **options),
        ),
    ]
    for one, two in pairs:
        assert relative(one.value, two.value) < 1e-29
        assert relative(one.error, two.error) < 0.1


def test_linear_drift_is_a_hypergeometric_function() -> None:
    """A = -u and A = u inside the layer, from 0: a well and a barrier at the start."""
    for sign in (-1, 1):
        drift = sa.polynomial(0, sign)
        for kappa in ("1/10", "1/100"):
            for r in ("2/3", "1"):
                found = sa.escape_time(drift, kappa, r, **WEAK, order="optimal", dps=25, full=True)
                with mpmath.workdps(40):
                    size = (mpmath.mpf(Fraction(r).numerator) / Fraction(r).denominator) ** 2
                    size /= mpmath.mpf(Fraction(kappa).numerator) ** 2
                    size *= Fraction(kappa).denominator ** 2
                    half = mpmath.mpf(1) / 2
                    known = size * mpmath.hyp2f2(1, 1, 3 * half, 2, -sign * size)
                assert distance(found.value, known) <= found.error
                assert found.error < 1e-10 * known


def test_leading_terms_from_a_barrier() -> None:
    """(log(4 r^2/kappa^2) + gamma)/2, the time to leave the top of a parabola."""
    found = sa.escape_time(sa.polynomial(0, 1), "1e-6", 1, **WEAK, order=0, dps=30)
    with mpmath.workdps(30):
        wanted = (mpmath.log(4 * mpmath.mpf(10) ** 12) + mpmath.euler) / 2
    assert distance(found, wanted) < 1e-11


def test_constant_drift_and_parabola_between_lines() -> None:
    closed = constant_drift("3/2")
    for r, start in (("5", "-2"), ("1/2", "1/3"), ("5", "1/4")):
        scene: dict[str, Any] = {"r": r, "start": start}
        with mpmath.workdps(60):
            numbers = [
                mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
                for x in ("1/10", r, start)
            ]
            known = {name: closed[name](mpmath.mp, *numbers) for name in ("T", "C")}
        drift = sa.polynomial("3/2")
        # One term is all there is.
        assert (
            relative(sa.escape_time(drift, "1/10", **scene, **WEAK, order=0, dps=30), known["T"])
            < 1e-29
        )
        assert (
            relative(
                sa.exit_probability(drift, "1/10", **scene, **WEAK, order=0, dps=30), known["C"]
            )
            < 1e-29
        )
    parabola = linear_sliding("1")
    for name, complement in (("P", False), ("1-P", True)):
        found = sa.occupation(
            sa.linear(1, -1), "1/10", complement=complement, **WEAK, order=12, dps=20, full=True
        )
        with mpmath.workdps(60):
            wanted = parabola[name](mpmath.mp, mpmath.mpf(1) / 10, None, None)
        assert distance(found.value, wanted) <= found.error < 1e-9 * wanted


# -- arrays ------------------------------------------------------------------------------------


def test_arrays_are_the_scalars() -> None:
    z0 = np.array([-1.5, -0.3, 0.5, 2.3])
    kappa, start = np.array([[0.02], [0.05]]), np.array([-2.0, 0.2, 0.0, 0.4])
    drift = sa.friction(3, 1, z0)
    for verb in (sa.escape_time, sa.exit_probability):
        found = verb(drift, kappa, 3, start=start, **WEAK, order=4, log=True, full=True)
        assert found.value.shape == (2, 4)
        assert found.error_kind in ("estimate", "bound")
        for i, j in np.ndindex(2, 4):
            one = verb(
                sa.friction(3, 1, z0[j]), kappa[i, 0], 3, start=start[j], **WEAK,
                order=4, log=True, dps=25, full=True,
            )  # fmt: skip
            # Where 1 - C is far below the range of float64, log C is 0.
            assert distance(float(found.value[i, j]), one.value) < 3e-14 * abs(one.value) + 1e-300
            # Rounding is added to what the series leave out.
            assert 0.99 * float(one.error) < found.error[i, j] < 1.01 * float(one.error) + 1e-8
    for complement in (True, False):
        options: dict[str, Any] = {**WEAK, "order": 3, "complement": complement, "log": True}
        some = sa.occupation(sa.linear(1, "-1/2"), [0.05, 0.1], **options)
        for k, noise in enumerate((0.05, 0.1)):
            alone = sa.occupation(sa.linear(1, "-1/2"), noise, **options, dps=20)
            assert relative(float(some[k]), alone) < 1e-12


def test_what_was_added_up() -> None:
    found = sa.escape_time(FRICTION, "1/20", 4, **WEAK, full=True)
    assert (found.method, found.order, found.error_kind) == ("laplace", 2, "estimate")
    assert [t.split()[0] for t in found.terms[:-1]] == ["barrier", "well"]
    assert found == sa.escape_time(FRICTION, "1/20", 4, **WEAK, order=2, full=True)
    assert sa.escape_time(FRICTION, "1e-8", 4, **WEAK, log=True, dps=15) > 1e14


@pytest.mark.parametrize("gap", ["1e-12", "1e-25", "1e-40"])
@pytest.mark.parametrize("drift", [sa.polynomial(1), sa.polynomial(2, 1, "1/3")])
def test_start_beside_an_end(drift: sa.Drift, gap: str) -> None:
    """T is as small as the way to the end, and so is its error."""
    for r in (Fraction(1), Fraction(2)):
        scene, start = (drift, "0.01", r), r - Fraction(gap)
        found = sa.escape_time(*scene, start=start, **WEAK, order=2, dps=12, full=True)
        exact = sa.escape_time(*scene, start=start, dps=30)
        assert distance(found.value, exact) <= found.error < exact / 10**9


# -- refusals ----------------------------------------------------------------------------------

DOUBLE = sa.polynomial("1/4", -1, 1)  # (u - 1/2)^2
TRIPLE = sa.polynomial("-1/8", "3/4", "-3/2", 1)


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (lambda **o: sa.escape_time(FRICTION, 3, 10, **o), sa.AccuracyError, r"^kappa is 3, .*too"),
        (lambda **o: sa.escape_time(FRICTION, [3.0], 10, **o), sa.AccuracyError,
         r"^at index \(0\), kappa is 3, "),
        (lambda **o: sa.exit_probability(FRICTION, 3, 10, **o), sa.AccuracyError, "order=2"),
        (lambda **o: sa.occupation(SLIDING, 3, **o), sa.AccuracyError, "^kappa is 3, "),
        (lambda **o: sa.escape_time(DOUBLE, "1e-3", 3, **o), sa.SymasymError, "u = 0.5"),
        (lambda **o: sa.escape_time(TRIPLE, "1e-3", 3, **o), sa.SymasymError, "u = 0.5"),
        (lambda **o: sa.escape_time(DOUBLE, "1e-3", 3, start="1/2", **o), sa.SymasymError, "0.5"),
        (lambda **o: sa.escape_time(TRIPLE, "1e-3", 3, start="1/2", **o), sa.SymasymError, "0.5"),
        (lambda **o: sa.exit_probability(sa.friction(3, 1, 0), "1/2", 3, **o), sa.InputError,
         "tangency"),
        (lambda **o: sa.escape_time(sa.friction(3, 1, "-1e-12"), "0.1", 3, **o), sa.AccuracyError,
         "too close"),
        (lambda **o: sa.escape_time(sa.friction(3, 1, Fraction(-7, 9)), "0.01", 3, **o),
         sa.SymasymError, r"0\.66"),
        # A is 0 at one end or the other.
        (lambda **o: sa.escape_time(sa.polynomial(-1, 2), "1e-2", "1/2", **o), sa.InputError,
         r"u = 0\.5"),
        (lambda **o: sa.escape_time(sa.polynomial(1, 2), [1e-2], 0.5, **o), sa.InputError,
         r"u = -0\.5"),
    ],
)  # fmt: skip
def test_refusals_name_a_method_that_serves(call: Any, error: Any, match: str) -> None:
    with pytest.raises(error, match=match) as caught:
        call(**WEAK)
    text = str(caught.value)
    assert "method='exact'" in text
    assert text.endswith(".")
    assert "\n" not in text
    call()  # and so it does


@pytest.mark.parametrize("order", [-1, 21, 2.5, True, "best", [1]])
def test_absurd_orders(order: Any) -> None:
    for call in (
        lambda: sa.escape_time(FRICTION, "0.01", 5, **WEAK, order=order),
        lambda: sa.exit_probability(FRICTION, [0.01], 5, **WEAK, order=order),
        lambda: sa.occupation(SLIDING, "0.01", **WEAK, order=order),
    ):
        with pytest.raises(sa.InputError, match="order is .*whole number from 0 to 20"):
            call()


def test_other_input() -> None:
    with pytest.raises(sa.RegionError, match="sliding"):
        sa.occupation(FRICTION, "0.01", **WEAK)
    with pytest.raises(sa.InputError, match="start is 5"):
        sa.escape_time(FRICTION, "0.01", 5, start=5, **WEAK)
    with pytest.raises(sa.InputError, match="kappa is -0.1"):
        sa.exit_probability(FRICTION, [0.1, -0.1], 5, log=True, **WEAK)
    with pytest.raises(sa.RangeError, match=r"log=True"):
        sa.escape_time(FRICTION, "1e-3", 5, **WEAK)


def test_arrays_where_rounding_is_all_there_is() -> None:
    """A logarithm keeps its leading digits; the value has none, and the sentence says why."""
    options: dict[str, Any] = {**WEAK, "full": True}
    found = sa.escape_time(FRICTION, [1e-8], 4, **options, log=True)
    exact = sa.escape_time(FRICTION, 1e-8, 4, dps=30, log=True)
    assert distance(float(found.value[0]), exact) <= float(found.error[0]) < 1e-11 * exact
    with pytest.raises(sa.AccuracyError, match=r"kappa is 1e-08, so small.*dps=n.*'exact'"):
        sa.escape_time(sa.friction(3, 1, -2), [1e-8], 4, **options)


def test_many_digits_of_a_high_order_are_not_refused_for_rounding() -> None:
    """The last coefficients of a panel are rounding, which each derivative makes larger."""
    asked: dict[str, Any] = {"start": "1/5", "dps": 50}
    drift, errors = sa.tanh(1, "-1/2", 3), []
    for kappa in ("1/20", "1/40"):
        exact = sa.escape_time(drift, kappa, 2, **asked)
        found = sa.escape_time(drift, kappa, 2, method="laplace", order=5, **asked)
        errors.append(abs(found / exact - 1))
    # O(kappa^12)
    assert errors[1] < errors[0] / 2**11 < 1e-8


@pytest.mark.parametrize("barrier", [True, False])
def test_the_constant_beside_the_logarithm_of_a_start_on_a_zero(barrier: bool) -> None:
    with mpmath.workdps(30):
        for i, j in ((0, 0), (0, 2), (2, 0), (2, 4), (6, 2)):
            (constant, _, none), (log, _, one) = critical_points.corner_terms(
                mpmath.mpf(1), i, j, barrier, mpmath.mp
            )
            expected = mpmath.digamma(mpmath.mpf(1 - i if barrier else i + 1) / 2) + mpmath.log(2)
            assert (none, one) == (0, 1)
            assert abs(-constant / log - expected) < mpmath.mpf(10) ** -27
