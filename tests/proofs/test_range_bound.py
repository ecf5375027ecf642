"""|T/T_N - 1| <= K kappa^(2N + 2) for all kappa up to kappa0: never violated, and tight."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import flint
import mpmath
import pytest
from hypothesis import given
from hypothesis import settings as changed
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.proofs import all_noise, dominance
from symasym.asymptotics.proofs.all_noise import Formal, FormalSum, Proof, expansion
from symasym.base.call_context import own_context
from symasym.numbers.balls import exact_ball, precision
from symasym.series.taylor_models import Model, Range, SmallTerm, supremum
from symasym.workshop import reference_quadrature
from tests.strategies import ALL, SAMPLE, powers_of_ten, rationals

FRICTION = sa.friction(3, 1, "-0.3")
SHARES = [Fraction(1), Fraction(1, 2), Fraction(1, 20)]

SCENES: list[tuple[sa.Drift, str, str]] = [
    (FRICTION, "10", "0"),
    (FRICTION, "10", "-5"),  # outside the layer
    (sa.polynomial(0, -1, "1/2", "-1/3"), "9/10", "1/10"),  # ends inside the layer
    (sa.polynomial(0, 1, 0, -3), "3", "0"),  # started at a barrier between two equal wells
    (sa.polynomial("1/5", 2, 0, -3), "3", "1/7"),  # two wells
    (sa.polynomial(-1, 0, 3), "3", "0"),  # the well is as deep as the barrier is high
    (sa.polynomial(0, -2, 0, 3), "3", "1/3"),  # two equal barriers
]


def observed(drift: sa.Drift, kappa: Fraction, r: Any, start: Any, order: int) -> Any:
    """|T/T_N - 1| from the exact engine; None where T_N is refused."""
    options = {"start": start, "dps": 80, "log": True}
    try:
        found = sa.escape_time(drift, kappa, r, method="laplace", order=order, **options)
    except sa.SymasymError:
        return None
    with mpmath.workdps(80):
        return abs(mpmath.expm1(sa.escape_time(drift, kappa, r, **options) - found))


def check(bound: sa.RangeBound, drift: sa.Drift, r: Any, start: Any) -> float:
    """No kappa of the range violates it; K over the largest |T/T_N - 1|/kappa^(2N + 2) seen."""
    worst = mpmath.mpf(0)
    for share in SHARES:
        kappa = bound.kappa0 * share
        wrong = observed(drift, kappa, r, start, bound.order)
        if wrong is None:
            continue
        # The values have 80 digits.
        assert wrong <= bound.error(kappa) + mpmath.mpf(10) ** -70
        size = mpmath.mpf(kappa.numerator) / kappa.denominator
        worst = max(worst, wrong / size ** (2 * bound.order + 2))
    return float(bound.constant / worst) if worst else float("inf")


@pytest.mark.parametrize("which", range(len(SCENES)))
def test_no_kappa_violates_it_and_it_is_tight(which: int) -> None:
    drift, r, start = SCENES[which % len(SCENES)]
    order = (1, 3, 0)[which % 3]
    bound = sa.weak_noise_bound(drift, r, start=start, order=order, kappa0="0.01")
    assert 1 <= check(bound, drift, r, start) < 1.01


def test_a_well_that_is_just_born() -> None:
    # 8e-4 beyond the fold; V's heights there differ by 1e-5.
    drift = sa.friction(3, 1, "-0.777")
    bound = sa.weak_noise_bound(drift, 10, order=1, kappa0="1e-5")
    assert 1 <= check(bound, drift, 10, 0) < 1.01
    found = sa.escape_time(
        drift, "1e-5", 10, method="laplace", order=1, dps=30, full=True, log=True
    )
    assert found.error_kind == "bound"
    assert found.error < 1.01 * bound.error("1e-5")


def test_the_largest_range_is_found() -> None:
    bound = sa.weak_noise_bound(FRICTION, 10, order=2, rtol="1e-6")
    assert bound.error(bound.kappa0) <= 1e-6
    wider = sa.weak_noise_bound(FRICTION, 10, order=2, kappa0=bound.kappa0 * Fraction(103, 100))
    assert wider.error(wider.kappa0) > 1e-6
    check(bound, FRICTION, 10, 0)
    # A smaller range has no larger constant.
    assert sa.weak_noise_bound(FRICTION, 10, kappa0=bound.kappa0 / 2).constant <= bound.constant


def test_strong_noise_costs_tightness_not_truth() -> None:
    bound = sa.weak_noise_bound(FRICTION, 10, order=1)
    assert bound.error(bound.kappa0) <= 1
    assert check(bound, FRICTION, 10, 0) > 1


def test_against_plain_quadrature() -> None:
    # The quadrature shares nothing with the engines, nor with the proof.
    kappa, r = Fraction(1, 5), Fraction(9, 10)
    drift = sa.polynomial(0, -1, "1/2", "-1/3")
    bound = sa.weak_noise_bound(drift, r, order=1, kappa0=kappa)
    exact = reference_quadrature.escape_time(drift, kappa, r, Fraction(0), 20)
    with mpmath.workdps(30):
        found = sa.escape_time(drift, kappa, r, method="laplace", order=1, dps=30)
        assert 1e-5 < abs(exact / found - 1) <= bound.error(kappa)


@st.composite
def wells(draw: st.DrawFn) -> tuple[sa.Drift, Fraction, Fraction]:
    kind = draw(st.sampled_from(["friction", "polynomial", "even"]))
    if kind == "friction":
        drift = sa.friction(
            mu=draw(rationals(2, 6)), alpha=draw(rationals(0.3, 3)), z0=draw(rationals(-2, 2))
        )
    elif kind == "polynomial":
        drift = sa.polynomial(*draw(st.lists(rationals(-3, 3), min_size=2, max_size=6)))
    else:
        a, b = draw(rationals(-3, 3)), draw(rationals(-3, 3))
        drift = sa.polynomial(0, a, 0, b)
    r = draw(powers_of_ten(-0.4, 1.2))
    return drift, r, draw(st.sampled_from([Fraction(0), r * draw(rationals(-0.99, 0.99))]))


def any_scene(scene: tuple[sa.Drift, Fraction, Fraction], order: int, rtol: Fraction) -> None:
    drift, r, start = scene
    try:
        bound = sa.weak_noise_bound(drift, r, start=start, order=order, rtol=rtol)
    except sa.SymasymError:
        return
    assert bound.error(bound.kappa0) <= rtol
    check(bound, drift, r, start)


@changed(SAMPLE, max_examples=4)
@given(wells(), st.integers(0, 3), powers_of_ten(-4, 0))
def test_random_scenes_sample(
    scene: tuple[sa.Drift, Fraction, Fraction], order: int, rtol: Fraction
) -> None:
    any_scene(scene, order, rtol)


@pytest.mark.slow
@changed(ALL, max_examples=2000)
@given(wells(), st.integers(0, 6), powers_of_ten(-6, 0))
def test_random_scenes(
    scene: tuple[sa.Drift, Fraction, Fraction], order: int, rtol: Fraction
) -> None:
    any_scene(scene, order, rtol)


@pytest.mark.parametrize(
    ("drift", "options", "message"),
    [
        (sa.tanh(2, -1, 3), {}, "no rational polynomial"),
        (FRICTION, {"kappa0": "0.1", "rtol": "0.1"}, "both given"),
        (FRICTION, {"kappa0": 0}, "greater than 0"),
        (FRICTION, {"rtol": -1}, "greater than 0"),
        (FRICTION, {"order": 21}, "0 to 20"),
        (FRICTION, {"start": 11}, "inside"),
        (FRICTION, {"kappa0": 5}, "up to kappa0 = 5"),
        (sa.linear(2, 1), {}, "not proved at any kappa"),  # no well
        (sa.friction(3, 1, "-7/9"), {}, "not proved at any kappa"),  # at the fold
        (sa.friction(3, 1, [0.1, 0.2]), {}, "array"),
        (sa.friction(), {}, "no value"),
    ],
    ids=str,
)
def test_what_is_refused(drift: sa.Drift, options: Any, message: str) -> None:
    with pytest.raises(sa.SymasymError, match=message):
        sa.weak_noise_bound(drift, 10, **options)


def test_what_is_printed_holds() -> None:
    for constant, text in ((12.960580680331322, "12.97"), (1.2345e-41, "1.235e-41"), (5.0, "5")):
        assert f" {text} kappa^6" in str(sa.RangeBound(constant, Fraction(1, 3), 2))
    tiny = sa.RangeBound(1e3, Fraction(1, 3 * 10**400), 2)
    assert "kappa <= 3.33333e-401 (bound)" in str(tiny)
    assert tiny.error(tiny.kappa0) > 0


@pytest.mark.parametrize(
    "options", [{"order": 20, "kappa0": "1e-3"}, {"kappa0": "1e-300"}], ids=str
)
def test_high_orders_and_very_weak_noise(options: Any) -> None:
    bound = sa.weak_noise_bound(FRICTION, "1e30", **options)
    small = sa.weak_noise_bound(FRICTION, "1e30", **{**options, "kappa0": "1e-4"})
    assert 0.99 < bound.constant / small.constant < 1.5


def test_beyond_the_range_nothing_is_said() -> None:
    bound = sa.weak_noise_bound(FRICTION, 10, kappa0="0.02")
    with pytest.raises(sa.InputError, match="proved up to"):
        bound.error("0.021")


# -- the parts -------------------------------------------------------------------------------------


def _model(coefficients: list[Any], rest: Any, top: Any, power: int = 0) -> Model:
    balls = tuple(flint.arb(c) for c in coefficients)
    return Model(power, balls, flint.arb(rest), Range(top, len(balls)))


def test_models_hold_what_they_are_made_of() -> None:
    with precision(128):
        top = flint.arb("0.25")
        # e^y and 2/(1 - y/2) with the Lagrange rests of their series, y <= 1/4.
        up = _model([1, 1, 0.5], "0.215", top)
        down = _model([2, 1, 0.5], "0.29", top, power=1)
        for y in ("0.001", "0.1", "0.2", "0.25"):
            y = flint.arb(y)
            one, two = y.exp(), 2 * y / (1 - y / 2)
            cases = ((up + down, one + two), (up * down, one * two))
            for model, value in (*cases, (up / down, one / two), (down / up, two / one)):
                sum_ = sum(c * y**k for k, c in enumerate(model.coefficients))
                gap = abs(value / y**model.power - sum_)
                assert gap <= model.tail_bound * y**3
                assert model.least() <= value / y**model.power <= model.largest()
                # Not vacuous: the next coefficient is of the rest's size.
                assert model.tail_bound < 10


def test_a_quotient_has_the_rest_of_its_own() -> None:
    with precision(128):
        top = flint.arb("0.5")
        found = _model([1, 1, 1], 0, top) / _model([2, 1, 0], 0, top)
        y = top
        value = (1 + y + y**2) / (2 + y)
        gap = abs(value - sum(c * y**k for k, c in enumerate(found.coefficients)))
        assert 0 < gap <= found.tail_bound * y**3 < 2 * gap


def test_the_largest_of_an_exponential() -> None:
    with precision(128):
        for power, gap, low, top in ((3, "0.1", 0, "0.5"), (6, "2", "0.1", "0.3"), (-1, "1", 0, 1)):
            term = SmallTerm(flint.arb(2), 1, flint.arb(gap))
            found = float(supremum([term], power, flint.arb(low), flint.arb(top)))
            ends = float(low), float(top)
            ys = [ends[0] + (ends[1] - ends[0]) * k / 4000 for k in range(1, 4001)]
            values = [2 * y ** (1 - power) * mpmath.exp(-float(gap) / y**2) for y in ys]
            assert max(values) <= found * (1 + 1e-12) <= max(values) * 1.0001


@pytest.mark.parametrize("scene", SCENES[::3], ids=repr)
def test_the_expansion_is_the_one_that_is_evaluated(scene: Any) -> None:
    drift, r, start = scene
    order, kappa = 2, Fraction(1, 20)
    proof = Proof(drift, Fraction(r), Fraction(start), order)
    wanted = sa.escape_time(
        drift, kappa, r, start=start, method="laplace", order=order, dps=40, log=True
    )
    with precision(400), own_context(50) as context:
        labels = proof._cells.labels
        top = exact_ball(kappa) / flint.arb(2).sqrt()
        sums = expansion(proof._both, proof._r, Formal(labels, 90, order, top))
        value = _at(sums[0], labels, top) / _at(sums[1], labels, top) / top**2
        found = context.mpf(value.log().mid().str(45, radius=False))
        assert abs(found - wanted) < abs(wanted) * context.mpf(10) ** -20


@pytest.mark.parametrize("kappa", ["0.1", "0.15"])
def test_a_lesser_well_is_in_the_errors(kappa: str) -> None:
    # From one well T has a share of another, which T_N has as well, but not what dominates.
    drift, start = sa.polynomial("1/100", 2, 0, -3), Fraction(-1, 3)
    proof = Proof(drift, Fraction(3), start, 3)
    with precision(320):
        top = exact_ball(Fraction(kappa)) / flint.arb(2).sqrt()
        found = all_noise._Evaluation(proof._cells, Range(top, 12))
        model, errors = found.main(proof._leading)
        algebraic = sum(c * top**k for k, c in enumerate(model.coefficients))
        off = model.tail_bound * top**12 / algebraic
        exponent = proof._cells.labels.height(proof._leading.key) / top**2
        main = algebraic * top ** (model.power - 2) * exponent.exp()
        exact = sa.escape_time(drift, kappa, 3, start=start, dps=30)
        share = flint.arb(str(exact)) / main - 1
        assert 0.02 < share <= supremum(errors, 0, 0 * top, top) + off + 1e-20
        assert off < share / 3


def _at(found: FormalSum, labels: dominance.Labels, y: Any) -> Any:
    total = flint.arb(0)
    for key, powers in found.parts.items():
        for power, c in powers.items():
            total += c * y**power * (labels.height(key) / y**2).exp()
    return total


def test_a_coefficient_that_does_not_cancel_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    real = all_noise.expansion

    def changed_slightly(*given: Any) -> Any:
        upper, lower = real(*given)
        parts = {}
        for key, powers in upper.parts.items():
            second = sorted(powers)[min(1, len(powers) - 1)]
            parts[key] = {**powers, second: powers[second] * (1 + 1e-9)}
        return FormalSum(parts), lower

    monkeypatch.setattr(all_noise, "expansion", changed_slightly)
    with pytest.raises(sa.AccuracyError, match="not proved"):
        sa.weak_noise_bound(FRICTION, 10, kappa0="0.01")
