"""The public verbs on the table of scenes: every engine against the others, and identities."""

from __future__ import annotations

import threading
from collections.abc import Callable
from fractions import Fraction as F
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
from problems import BY_NAME, PROBLEMS, Problem, answered, distance, logarithm, relative, tagged

import symasym as sa
from symasym.exact import arbitrary, ball, witness

ASKED = [p for p in PROBLEMS if "refused" not in p.tags]


def later(problems: list[Problem], *tags: str) -> list[Any]:
    """The scenes as parameters, those with one of these tags marked slow."""
    return [
        pytest.param(p, marks=pytest.mark.slow if p.tags & set(tags) else (), id=p.name)
        for p in problems
    ]


@cache
def reference(name: str, quantity: str) -> Any:
    """The 60-digit value, or the sentence of the refusal where a scene may refuse."""
    problem = BY_NAME[name]
    try:
        return problem.questions()[quantity](dps=60)
    except sa.SymasymError:
        if "may refuse" in problem.tags:
            return None
        raise


def each(problem: Problem) -> list[tuple[str, Callable[..., Any], Any]]:
    """(quantity, question, 60-digit value)."""
    found = [(q, ask, reference(problem.name, q)) for q, ask in problem.questions().items()]
    return [x for x in found if x[2] is not None]


def ask_or_refuse(problem: Problem, ask: Callable[..., Any], **options: Any) -> Any:
    """The answer, or None where the scene may refuse and does."""
    try:
        return ask(**options)
    except sa.SymasymError:
        if "may refuse" in problem.tags:
            return None
        raise


# -- engines against each other ------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_float64(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        log = logarithm(value)
        allowed = 1e-12 * max(1.0, abs(float(log)))
        found = ask_or_refuse(problem, ask, log=True)
        if found is None:
            continue
        assert isinstance(found, float)
        assert distance(found, log) <= allowed, quantity
        if -708 < log < 709:
            assert relative(ask(), value) <= allowed, quantity
        else:
            with pytest.raises(sa.RangeError, match=r"log=True"):
                ask()


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_thirty_digits_are_the_first_of_sixty(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        found = ask_or_refuse(problem, ask, dps=30)
        assert found is None or relative(found, value) <= mpmath.mpf(10) ** -30, quantity


def balls(problem: Problem, dps: int) -> dict[str, Any]:
    """Proved enclosures of those quantities that `ball` does not refuse."""
    found = {}
    for quantity, ask in problem.engine_questions(ball).items():
        try:
            found[quantity] = ask(dps)
        except sa.AccuracyError:
            continue
    return found


@pytest.mark.parametrize("problem", later(ASKED, "stiff", "weak", "extreme", "narrow"))
def test_proved_balls_contain_the_values(problem: Problem) -> None:
    if not ball.available():
        pytest.skip("python-flint is not installed")
    for quantity, enclosure in balls(problem, 25).items():
        value = reference(problem.name, quantity)
        if value is None:
            continue
        middle, radius = ball.to_mpf(enclosure, 60)
        assert distance(value, middle) <= radius, quantity
        assert radius <= abs(middle) * mpmath.mpf("1.01e-25"), quantity


def test_balls_cover_most_of_the_table() -> None:
    if not ball.available():
        pytest.skip("python-flint is not installed")
    mild = [p for p in answered() if p.tags & {"moderate", "strong"}]
    refused = []
    for problem in mild:
        try:
            problem.engine_questions(ball)["T"](12)
        except sa.AccuracyError:
            refused.append(problem.name)
    assert len(mild) >= 30
    assert not refused


@pytest.mark.parametrize("problem", tagged("witness"), ids=str)
def test_plain_quadrature_agrees(problem: Problem) -> None:
    quantity = "1-P" if problem.slides else "T"
    found = problem.engine_questions(witness)[quantity](12)
    assert relative(found, reference(problem.name, quantity)) <= 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("problem", tagged("witness"), ids=str)
def test_plain_quadrature_agrees_on_everything(problem: Problem) -> None:
    for quantity, ask in problem.engine_questions(witness).items():
        assert relative(ask(20), reference(problem.name, quantity)) <= 1e-20, quantity


@pytest.mark.parametrize("problem", [p for p in PROBLEMS if p.closed], ids=str)
def test_closed_forms(problem: Problem) -> None:
    for quantity, ask in problem.questions().items():
        if quantity not in problem.closed:
            continue
        known = problem.known(quantity, 60)
        found = ask_or_refuse(problem, ask, dps=50)
        assert found is None or relative(found, known) <= mpmath.mpf(10) ** -50, quantity


@pytest.mark.parametrize("name", ["friction", "friction sliding", "expression, cubic"])
def test_a_thousand_digits(name: str) -> None:
    ask = BY_NAME[name].questions()["T"]
    high = ask(dps=1000)
    assert relative(ask(dps=200), high) <= mpmath.mpf(10) ** -200
    if name == "expression, cubic":
        assert relative(high, ask(dps=1100)) <= mpmath.mpf(10) ** -1000


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tanh", "expression", "hill", "kink + 1e-30, stiff", "sine"])
def test_a_thousand_digits_of_other_drifts(name: str) -> None:
    for quantity, ask in BY_NAME[name].questions().items():
        assert relative(ask(dps=300), ask(dps=1000)) <= mpmath.mpf(10) ** -300, quantity


@pytest.mark.slow
@pytest.mark.parametrize("name", ["friction k=0.3", "linear sliding"])
def test_ten_thousand_digits(name: str) -> None:
    for quantity, ask in BY_NAME[name].questions().items():
        high = ask(dps=10_000)
        assert relative(ask(dps=2000), high) <= mpmath.mpf(10) ** -2000, quantity
        if quantity in BY_NAME[name].closed:
            known = BY_NAME[name].known(quantity, 10_000)
            assert relative(high, known) <= mpmath.mpf(10) ** -10_000


@pytest.mark.parametrize("problem", tagged("refused"), ids=str)
def test_limits_are_refused_in_a_sentence(problem: Problem) -> None:
    for options in ({}, {"dps": 30}, {"dps": 30, "full": True}, {"log": True}):
        with pytest.raises(sa.SymasymError, match=r"\w+.*\.$"):
            problem.questions()["T"](**options)


# -- error claims --------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "narrow", "slow", "extreme"))
def test_claimed_errors_hold(problem: Problem) -> None:
    mild = problem.tags & {"moderate", "strong"}
    for quantity, ask, value in each(problem):
        if not mild and quantity != "T":
            continue  # a ball that is refused costs up to a second
        for options in (*({"dps": 20, "log": True}, {"log": True}, {}) * bool(mild), {"dps": 20}):
            if not options and not -708 < logarithm(value) < 709:
                continue
            found = ask_or_refuse(problem, ask, full=True, **options)
            if found is None:
                continue
            assert isinstance(found, sa.Estimate)
            assert found.error_kind in ("bound", "estimate")
            assert found.method == "exact"
            true = logarithm(value, 80) if "log" in options else value
            unknown = abs(value) * mpmath.mpf(10) ** -59 if true is value else 1e-59
            assert distance(found.value, true) <= found.error + unknown, (quantity, options)
            limit = 1e-12 if "dps" not in options else mpmath.mpf("1.01e-19")
            assert found.error <= limit * max(abs(true), 1e-3), (quantity, options)


def test_kinds_of_error() -> None:
    drift = sa.friction(3, 1, "-0.3")
    strong, stiff = (sa.escape_time(drift, k, 10, dps=20, full=True) for k in ("0.3", "1e-6"))
    assert strong.error_kind == ("bound" if ball.available() else "estimate")
    assert stiff.error_kind == "estimate"
    many = sa.escape_time(drift, [0.3, 1.0], 10, full=True)
    assert many.error_kind == "estimate"
    assert many.value.shape == many.error.shape == (2,)
    one = sa.escape_time(drift, 0.3, 10, full=True)
    assert isinstance(one.value, float)
    assert isinstance(one.error, float)
    paper = sa.escape_time(drift, "0.3", 10, method="paper", full=True)
    assert (paper.error_kind, paper.error) == ("none", None)


@pytest.mark.parametrize("name", ["friction", "linear sliding, uneven", "sine weak", "hill n=12"])
def test_claimed_errors_of_arrays_hold(name: str) -> None:
    problem = BY_NAME[name]
    kappas = [str(F(problem.kappa) * F(k, 7)) for k in (5, 6, 7, 9, 14)]
    drift, scene = problem.make(), (problem.r,)
    for log in (False, True):
        floats = np.array([float(F(k)) for k in kappas])
        found = sa.escape_time(drift, floats, *scene, start=problem.start, log=log, full=True)
        for k, value, error in zip(floats, found.value, found.error, strict=True):
            true = sa.escape_time(drift, F(k), *scene, start=problem.start, dps=30)
            true = logarithm(true) if log else true
            assert distance(value, true) <= error
            assert error <= 1e-11 * max(1, abs(true))


def test_str_of_an_estimate_shows_value_error_and_kind() -> None:
    drift = sa.linear(1, -1)
    text = str(sa.escape_time(drift, 1, 2, dps=20, full=True))
    assert "±" in text
    assert "exact" in text
    assert "no error claimed" in str(sa.escape_time(
        sa.friction(3, 1, "-0.3"), "0.3", 10, method="paper", full=True
    ))  # fmt: skip
    assert "estimate" in str(sa.escape_time(drift, [1.0, 2.0], 2, full=True))


# -- logarithms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_logarithms_have_all_their_digits(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        found = ask_or_refuse(problem, ask, dps=25, log=True)
        complement = {"C": "1-C", "1-C": "C", "P": "1-P", "1-P": "P"}.get(quantity)
        if found is None:
            continue
        if complement and value > 0.5:
            rest = reference(problem.name, complement)
            context = mpmath.MPContext()
            context.dps = 50
            log = context.log1p(-context.convert(rest))
        else:
            log = logarithm(value)
        if log:
            assert relative(found, log) <= mpmath.mpf(10) ** -25, quantity
        else:
            assert found == 0


def test_logarithm_of_a_value_next_to_one() -> None:
    # T = r^2/kappa^2 = 1 + 1e-40
    drift = sa.polynomial(0)
    r = F(1) + F("1e-40")
    found = sa.escape_time(drift, 1, r, dps=20, log=True)
    assert relative(found, mpmath.mpf(F("2e-40").numerator) / F("2e-40").denominator) < 1e-15
    assert sa.escape_time(drift, 1, 1, dps=20, log=True) == 0
    assert sa.escape_time(drift, 1, 1, log=True) == pytest.approx(0, abs=1e-14)


# -- identities ----------------------------------------------------------------------------------

MIRRORS: list[tuple[str, Callable[[], sa.Drift], Callable[[], sa.Drift]]] = [
    ("friction", lambda: sa.friction(3, 1, "-0.3"), lambda: sa.friction(3, 1, "2.3")),
    ("linear", lambda: sa.linear(1, "-1/3"), lambda: sa.linear("1/3", -1)),
    ("sine", lambda: sa.sine(1, 2, 5, waves=2), lambda: sa.sine(-2, -1, 5, waves=2)),
    ("tanh", lambda: sa.tanh(1, "-1/3", 7), lambda: sa.tanh("1/3", -1, 7)),
    ("hill", lambda: sa.hill(1, -2, "1/3", n=3),
     lambda: sa.Drift("-(1 - 3*x**3*(1 + 1/27)/(x**3 + 1/27))".replace("x", "((1 - u)/2)"))),
    ("polynomial", lambda: sa.polynomial(1, -2, "1/3", 3),
     lambda: sa.polynomial(-1, -2, "-1/3", 3)),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "make", "mirrored"), MIRRORS, ids=[m[0] for m in MIRRORS])
@pytest.mark.parametrize("start", ["0", "-1/7", "1", "3/2", "-19/10"])
def test_mirror_image(
    kind: str, make: Callable[[], sa.Drift], mirrored: Callable[[], sa.Drift], start: str
) -> None:
    kappa, r, other = "0.3", "2", str(-F(start))
    for verb, swap in ((sa.escape_time, False), (sa.exit_probability, True)):
        here = verb(make(), kappa, r, start=start, dps=25)
        options = {"complement": True} if swap else {}
        there = verb(mirrored(), kappa, r, start=other, dps=25, **options)
        assert relative(here, there) <= 2e-25, kind
        here, there = (
            verb(make(), kappa, r, start=start, log=True),
            verb(mirrored(), kappa, r, start=other, log=True, **options),
        )
        assert abs(here - there) <= 2e-12 * max(1, abs(here)), kind


@pytest.mark.parametrize("name", ["friction r=3", "linear sliding, uneven", "sine", "quintic"])
@pytest.mark.parametrize("factor", ["3", "1/1000000", "1e30"])
def test_scaling_drift_and_noise_together_scales_time(name: str, factor: str) -> None:
    # phi -> c phi and kappa^2 -> c kappa^2 leave lam V as it is.
    problem, c = BY_NAME[name], F(factor) ** 2
    symbols = problem.make().expression()
    scaled = sa.Drift(symbols * mpmath_rational(c))
    kappa = F(problem.kappa) * F(factor)
    for dps in (25, None):
        allowed = 2e-25 if dps else 4e-12
        T = problem.questions()["T"](dps=dps)
        faster = sa.escape_time(scaled, kappa, problem.r, start=problem.start, dps=dps)
        scale = mpmath.mpf(c.numerator) / c.denominator
        with mpmath.workdps(40):
            assert relative(faster * (mpmath.mpf(c.numerator) / c.denominator), T) <= allowed
        assert scale > 0
        C = problem.questions()["C"](dps=dps)
        same = sa.exit_probability(scaled, kappa, problem.r, start=problem.start, dps=dps)
        assert relative(same, C) <= allowed * max(1, abs(float(mpmath.log(C))))


def mpmath_rational(x: F) -> Any:
    import sympy

    return sympy.Rational(x.numerator, x.denominator)


@pytest.mark.parametrize("problem", later(answered(), "slow"))
def test_probabilities_add_up_to_one(problem: Problem) -> None:
    with mpmath.workdps(60):
        pairs = [("C", "1-C")] + [("P", "1-P")] * problem.slides
        for one, other in pairs:
            both = reference(problem.name, one), reference(problem.name, other)
            assert all(0 < x <= 1 for x in both)
            assert abs(sum(both) - 1) <= mpmath.mpf(10) ** -58


INSIDE = ["friction k=0.3", "linear sliding, uneven", "expression, cubic", "z0=-1e8"]


@pytest.mark.parametrize(
    "name", [*INSIDE, *(pytest.param(n, marks=pytest.mark.slow) for n in ("tanh", "sine weak"))]
)
def test_backward_equation(name: str) -> None:
    # (kappa^2/2) T'' + phi T' = -1 and (kappa^2/2) C'' + phi C' = 0
    problem = BY_NAME[name]
    drift, kappa = problem.make(), F(problem.kappa)
    for x in (F(-13, 10), F(1, 3), F(6, 5)):
        phi = mpmath_fraction(drift, x)
        width = kappa**2 / (1 + abs(phi)) / 10**12  # far below the shortest length
        for verb, source in ((sa.escape_time, 1), (sa.exit_probability, 0)):
            left, here, right = (
                verb(drift, kappa, problem.r, start=x + k * width, dps=100) for k in (-1, 0, 1)
            )
            with mpmath.workdps(100):
                h = mpmath.mpf(width.numerator) / width.denominator
                noise = mpmath.mpf((kappa**2).numerator) / (kappa**2).denominator / 2
                second = noise * (left - 2 * here + right) / h**2
                first = mpmath.mpf(phi.numerator) / phi.denominator * (right - left) / (2 * h)
                size = abs(second) + abs(first) + source
                assert abs(second + first + source) <= mpmath.mpf(10) ** -15 * size


def mpmath_fraction(drift: sa.Drift, u: F) -> F:
    """A(u) to 120 digits, as a rational."""
    from symasym.arithmetic import MpmathOps
    from symasym.exact.local import to_fraction

    context = mpmath.MPContext()
    context.dps = 120
    ops = MpmathOps(context)
    return to_fraction(drift.evaluate(ops.rational(max(F(-1), min(F(1), u))), ops))


SLIDING = ["linear sliding", "linear sliding, uneven", "friction sliding", "tanh"]


@pytest.mark.parametrize("name", SLIDING)
def test_density_integrates_to_one_and_to_the_occupation(name: str) -> None:
    problem = BY_NAME[name]
    drift, kappa = problem.make(), problem.kappa
    x, w = np.polynomial.legendre.leggauss(20)
    pieces = 40
    edges = np.linspace(-1, 1, pieces + 1)
    nodes = edges[:-1, None] + (x + 1) / pieces
    inside = (sa.stationary_density(drift, kappa, nodes) @ w).sum() / pieces
    assert inside == pytest.approx(sa.occupation(drift, kappa), rel=1e-11)
    # the tails are exponentials, p(±1) kappa^2/(2 |a±|)
    ends = sa.stationary_density(drift, kappa, [-1.0, 1.0])
    slopes = np.array([float(abs(a)) for a in drift.ends])
    tails = (ends * float(F(kappa)) ** 2 / 2 / slopes).sum()
    assert tails == pytest.approx(sa.occupation(drift, kappa, complement=True), rel=1e-11)
    assert inside + tails == pytest.approx(1, rel=1e-11)


@pytest.mark.parametrize("name", SLIDING)
def test_density_obeys_its_first_order_equation(name: str) -> None:
    # p'/p = lam phi
    problem = BY_NAME[name]
    drift, kappa = problem.make(), F(problem.kappa)
    for y in (F(-3), F(-1, 2), F(1, 9), F(7, 2)):
        h = F(1, 10**12)
        left, right = (
            sa.stationary_density(drift, kappa, y + k * h, dps=60, log=True) for k in (-1, 1)
        )
        with mpmath.workdps(60):
            slope = (right - left) / 2 * 10**12
            phi = mpmath_fraction(drift, y)
            lam_phi = mpmath.mpf(phi.numerator) / phi.denominator * 2
            lam_phi /= mpmath.mpf((kappa**2).numerator) / (kappa**2).denominator
            assert abs(slope - lam_phi) <= 1e-15 * (1 + abs(lam_phi))


@pytest.mark.parametrize("name", ["friction k=0.3", "linear repelling", "tanh"])
def test_time_and_probability_at_the_edges(name: str) -> None:
    problem = BY_NAME[name]
    drift, kappa, r = problem.make(), problem.kappa, F(problem.r)
    gap = F(1, 10**30)
    low, high = -r + gap, r - gap
    for start, probability in ((low, 1), (high, 0)):
        T = sa.escape_time(drift, kappa, r, start=start, dps=20)
        C = sa.exit_probability(drift, kappa, r, start=start, dps=35)
        assert 0 < T < mpmath.mpf(10) ** -15 * sa.escape_time(drift, kappa, r, dps=20)
        with mpmath.workdps(40):
            assert 0 < abs(C - probability) < 1e-15


# -- arrays --------------------------------------------------------------------------------------


def scalars_of(verb: Callable[..., Any], make: Callable[..., sa.Drift], *arrays: Any) -> Any:
    """The verb, one scene at a time; log, so that nothing overflows."""
    broadcast = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arrays))
    values = [
        verb(make(*map(float, scene)), *map(float, scene), log=True)
        for scene in zip(*(a.ravel() for a in broadcast), strict=True)
    ]
    return np.array(values).reshape(broadcast[0].shape)


def assert_same_logs(found: Any, wanted: Any) -> None:
    assert found.shape == wanted.shape
    assert (np.abs(found - wanted) <= 1e-12 * np.maximum(1, np.abs(wanted))).all()


def test_arrays_are_their_scalars_kappa_r_start() -> None:
    drift = sa.friction(3, 1, "-0.3")
    kappa = np.array([0.05, 0.1, 0.31, 1.0, 7.0])[:, None, None]
    r = np.array([2.5, 10.0, 1e5])[:, None]
    start = np.array([-1.3, 0.0, 0.9, 2.2])
    for verb in (sa.escape_time, sa.exit_probability):
        found = verb(drift, kappa, r, start=start, log=True)
        wanted = scalars_of(
            lambda d, k, q, s, verb=verb, **o: verb(d, k, q, start=s, **o),
            lambda *_: drift, kappa, r, start,
        )  # fmt: skip
        assert_same_logs(found, wanted)


def test_arrays_are_their_scalars_parameters() -> None:
    mu = np.array([0.0, 0.5, 3.0, 1e6])[:, None]
    z0 = np.array([-1e5, -0.9, -0.3, 0.6, 3.0])
    alpha = np.array([0.1, 1.0, 5.0, 2.0])[:, None]
    drift = sa.friction(mu, alpha, z0)
    assert drift.shape == (4, 5)
    found = sa.escape_time(drift, 0.2, 10, start=0.1, log=True)
    wanted = scalars_of(
        lambda d, *_, **o: sa.escape_time(d, 0.2, 10, start=0.1, **o), sa.friction, mu, alpha, z0
    )
    assert_same_logs(found, wanted)


def test_arrays_are_their_scalars_everything_at_once() -> None:
    a_minus = np.array([-1.0, 0.3, 2.0])[:, None, None]
    steepness = np.array([0.5, 6.0])[:, None]
    kappa = np.array([0.1, 0.3, 1.0, 1e-5])
    found = sa.escape_time(sa.tanh(a_minus, -0.5, steepness), kappa, 2.0, log=True)
    wanted = scalars_of(
        lambda d, a, s, k, **o: sa.escape_time(d, k, 2.0, **o),
        lambda a, s, k: sa.tanh(a, -0.5, s), a_minus, steepness, kappa,
    )  # fmt: skip
    assert_same_logs(found, wanted)


@pytest.mark.parametrize("verb", [sa.occupation, sa.stationary_density])
def test_arrays_are_their_scalars_sliding(verb: Callable[..., Any]) -> None:
    kappa = np.array([0.03, 0.2, 1.0, 40.0])[:, None]
    a_plus = np.array([-0.01, -1.0, -30.0])
    more = () if verb is sa.occupation else (np.array([-2.0, 0.4, 1.5]),)
    found = verb(sa.linear(1, a_plus), kappa, *more, log=True)
    wanted = scalars_of(
        lambda d, a, k, *y, **o: verb(d, k, *y, **o), lambda a, *_: sa.linear(1, a),
        a_plus, kappa, *more,
    )  # fmt: skip
    assert_same_logs(found, wanted)


def test_chunks_do_not_show() -> None:
    # 5000 scenes, more than are taken at once, mild and stiff ones mixed
    count = 5000
    z0 = -0.9 + 1.3 * np.modf(np.arange(count) * 0.6180339887)[0]
    kappa = 10.0 ** (-3 + 4 * np.modf(np.arange(count) * 0.7548776662)[0])
    drift = sa.friction(3, 1, z0)
    found = sa.escape_time(drift, kappa, 10, log=True)
    some = [0, 1, 2047, 4094, 4095, 4096, 4097, 4998, 4999]
    wanted = [
        sa.escape_time(sa.friction(3, 1, float(z0[i])), float(kappa[i]), 10, log=True) for i in some
    ]
    assert_same_logs(found[some], np.array(wanted))
    sampled = range(0, count, 250)
    for i in sampled:
        exact = sa.escape_time(sa.friction(3, 1, float(z0[i])), float(kappa[i]), 10, dps=25)
        log = logarithm(exact)
        assert distance(float(found[i]), log) <= 1e-12 * max(1, abs(float(log)))


def test_kinds_of_results() -> None:
    drift = sa.linear(1, -1)
    assert isinstance(sa.escape_time(drift, 1, 2), float)
    assert isinstance(sa.escape_time(drift, np.float64(1), np.array(2.0)), float)
    assert isinstance(sa.escape_time(drift, 1, 2, dps=20), mpmath.mpf)
    one = sa.escape_time(drift, [1.0], 2)
    assert isinstance(one, np.ndarray)
    assert one.shape == (1,)
    assert one.dtype == np.float64
    assert sa.escape_time(drift, np.ones((2, 1, 3)), np.full((4, 1), 2.0)).shape == (2, 4, 3)


@pytest.mark.parametrize(
    "kappa", [1, "1", F(1), np.float32(1), np.int8(1), mpmath.mpf(1), "10e-1", " 1 ", [1], ["1"]]
)
def test_numbers_of_every_kind_mean_the_same(kappa: Any) -> None:
    drift = sa.friction(3, 1, "-0.3")
    value = sa.escape_time(drift, kappa, 10)
    assert float(np.ravel(value)[0]) == sa.escape_time(drift, 1, 10)


def test_strings_are_exact_and_floats_are_binary() -> None:
    drift = sa.friction(3, 1, "-0.3")
    exact, binary = (sa.escape_time(drift, k, 10, dps=40) for k in ("0.1", 0.1))
    assert exact == sa.escape_time(drift, F(1, 10), 10, dps=40)
    assert binary == sa.escape_time(drift, F(0.1), 10, dps=40)
    assert 1e-17 < relative(binary, exact) < 1e-12


# -- conduct -------------------------------------------------------------------------------------


def test_global_precision_is_neither_used_nor_changed() -> None:
    names = ["friction k=0.3", "tanh"]
    before = mpmath.mp.prec, mpmath.iv.prec
    for name in names:
        values = []
        for dps in (3, 15, 200):
            with mpmath.workdps(dps):
                problem = BY_NAME[name]
                values.append([
                    ask(**options)
                    for ask in problem.questions().values()
                    for options in ({"dps": 40}, {"dps": 25, "log": True}, {})
                ])  # fmt: skip
                problem.make().critical_points()
                assert mpmath.mp.dps == dps
        assert values[0] == values[1] == values[2]
    assert (mpmath.mp.prec, mpmath.iv.prec) == before


@pytest.mark.parametrize("dps", [1, 2, 15, 33, 100, 321])
def test_results_have_the_digits_asked_for(dps: int) -> None:
    problem = BY_NAME["friction k=0.3"]
    with mpmath.workdps(7):
        values = {q: ask(dps=dps) for q, ask in problem.questions().items()}
    for quantity, ask in problem.questions().items():
        high = ask(dps=dps + 30)
        assert relative(values[quantity], high) <= mpmath.mpf(10) ** -dps
        # and not many more, which would pretend
        assert values[quantity]._mpf_[1].bit_length() <= 3.33 * dps + 8


def test_threads_get_what_one_thread_gets() -> None:
    names = ["friction k=0.3", "tanh", "linear sliding", "hill"]
    jobs = [(n, d) for n in names for d in (20, 35, 50)] * 2
    wanted = {job: BY_NAME[job[0]].questions()["T"](dps=job[1]) for job in jobs}
    found: dict[int, Any] = {}

    def work(index: int) -> None:
        name, dps = jobs[index]
        found[index] = BY_NAME[name].questions()["T"](dps=dps)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(len(jobs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[k] for k in range(len(jobs))] == [wanted[job] for job in jobs]


def test_arguments_are_not_changed() -> None:
    kappa, z0 = np.array([0.1, 0.3]), np.array([-0.3, -0.4])
    drift = sa.friction(3, 1, z0)
    sa.escape_time(drift, kappa, 10)
    assert kappa.tolist() == [0.1, 0.3]
    assert z0.tolist() == [-0.3, -0.4]
    drift.bind(z0=1)
    assert drift.values["z0"].tolist() == [-0.3, -0.4]


def test_engine_functions_are_what_the_verbs_call() -> None:
    problem = BY_NAME["friction k=0.3"]
    for quantity, ask in problem.engine_questions(arbitrary).items():
        assert ask(30) == problem.questions()[quantity](dps=30)
