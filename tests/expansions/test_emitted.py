"""Emitted code of expansions, run by gcc and Node, and `evaluate`, on the table's drifts."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.emit import Source
from symasym.expansions.cases import case_of
from tests.emitted import Call, available, run
from tests.expansions.test_weak import SCENES, roots_of
from tests.problems import Problem

#: Noise and radius at which the series are good and the exponentials are doubles.
KAPPA, RADIUS = "1/8", "3/2"
#: Each drift and start once.
DISTINCT = list({(str(p.make()), p.start): p for p in SCENES}.values())
SAMPLE = [p for p in DISTINCT if p.name in ("friction r=3", "constant down", "expression, cubic")]


#: What is emitted, the calls and the right values; every target is compared with the same.
Asked = tuple[dict[str, Source], list[Call], list[Any]]


def expansions(problem: Problem, order: int) -> tuple[sa.Expansion, Source, sa.Drift] | None:
    """The expansion with friction's parameters free, its code, and the bound drift."""
    drift, start = problem.make(), Fraction(problem.start)
    free = sa.friction() if drift.name == "friction" and drift.values["mu"] else drift
    try:
        e = sa.expand(free, order=order, start=start, case=case_of(drift, start))
        return e, e.emit("c", name="value"), drift
    except sa.InputError:
        return None


def arguments(e: sa.Expansion, drift: sa.Drift) -> list[float]:
    """Numbers for the symbols that the code takes, in their order."""
    values: dict[str, Any] = {**drift.values, **roots_of(drift)}
    values |= {"kappa": Fraction(KAPPA), "r": Fraction(RADIUS)}
    return [float(values[name]) for name in sorted(s.name for s in e.expression.free_symbols)]


@cache
def times(whole: bool) -> Asked:
    """Those of the scenes that have an emitted T, with the T of `evaluate`."""
    files, calls, wanted = {}, [], []
    for k, problem in enumerate(DISTINCT if whole else SAMPLE):
        known = expansions(problem, 1)
        if known is None:
            continue
        e, source, drift = known
        try:
            want = e.bind(**drift.values).evaluate(KAPPA, RADIUS, dps=20)
        except sa.SymasymError:
            continue
        files[f"scene{k}"] = source
        calls.append(Call(f"scene{k}", "value", tuple(arguments(e, drift))))
        wanted.append(float(want))
    return files, calls, wanted


def ran(target: str, asked: Asked, folder: Path) -> Iterator[tuple[str, Any, str]]:
    """Each file's name, the right value, and what the target's code returns."""
    if reason := available(target):
        pytest.skip(reason)
    files, calls, wanted = asked
    got = run(target, {name: source.to(target) for name, source in files.items()}, calls, folder)
    for call, want, (value,) in zip(calls, wanted, got, strict=True):
        yield call.file, want, value


@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy"])
def test_emitted_weak_noise(target: str, tmp_path: Path) -> None:
    rows = list(ran(target, times(whole=False), tmp_path))
    assert len(rows) == len(SAMPLE) == 3
    for name, want, value in rows:
        assert float(value) == pytest.approx(want, rel=1e-8), name


@pytest.mark.slow
@pytest.mark.parametrize("target", ["c", "javascript"])
def test_emitted_weak_noise_on_the_whole_table(target: str, tmp_path: Path) -> None:
    rows = list(ran(target, times(whole=True), tmp_path))
    assert len(rows) >= 7
    for name, want, value in rows:
        assert float(value) == pytest.approx(want, rel=1e-8), name


@cache
def strong_noise(quantity: str) -> Asked:
    e = sa.expand(sa.friction(), quantity, noise="strong", order=3)
    drift = sa.friction(mu=3, alpha=1, z0="0.5")
    given = {**drift.values, "kappa": Fraction(7, 2), "r": Fraction(3)}
    names = sorted(s.name for s in e.expression.free_symbols)
    call = Call("strong", "value", tuple(float(given[n]) for n in names))
    want = e.bind(**drift.values).evaluate("7/2", *([] if quantity == "P" else [3]))
    return {"strong": e.emit("c", name="value")}, [call], [want]


@pytest.mark.parametrize("target", ["c", "javascript"])
@pytest.mark.parametrize("quantity", ["T", "P"])
def test_emitted_strong_noise(quantity: str, target: str, tmp_path: Path) -> None:
    """With friction's parameters free, in the order of their names."""
    ((_, want, value),) = ran(target, strong_noise(quantity), tmp_path)
    assert float(value) == pytest.approx(want, rel=1e-11)


#: On a well and a barrier with odd derivatives, and outside the layer.
STARTS = [
    ("-u + u**2/3 + c*u**2", "0"), ("c*u + u**2/3", "0"), ("c/2 + u/4", "-9/8"),
    ("c/2 + u/4", "1"), ("c - u/3", "9/8"),
]  # fmt: skip


@cache
def started(quantity: str) -> Asked:
    """With c free, which is 1/8 or 1."""
    files, calls, wanted = {}, [], []
    for drift, start in STARTS:
        c = Fraction(1, 1 if files else 8)
        bound = sa.Drift(drift).bind(c=c)
        e = sa.expand(bound, quantity, order=2, start=start)
        free = sa.expand(sa.Drift(drift), quantity, order=2, start=start, case=e.case)
        name = f"scene{len(files)}"
        files[name] = free.emit("c", name="value")
        known = {"kappa": Fraction(1, 8), "r": Fraction(5, 4), "c": c}
        names = files[name]._ready[0].arguments
        calls.append(Call(name, "log_value", tuple(float(known[n]) for n in names)))
        wanted.append(float(e.evaluate("1/8", "5/4", log=True, dps=20)))
    return files, calls, wanted


@pytest.mark.every(3)
@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy", "mpmath"])
@pytest.mark.parametrize("quantity", ["T", "1 - C"])
def test_emitted_starts(quantity: str, target: str, tmp_path: Path) -> None:
    for scene, want, value in ran(target, started(quantity), tmp_path):
        assert float(value) == pytest.approx(want, rel=1e-13), scene


@pytest.mark.parametrize("target", ["c", "javascript"])
@pytest.mark.parametrize("parameter", ["log_value", "INFINITY", "M_PI"])
def test_a_parameter_with_the_name_of_a_function(
    parameter: str, target: str, tmp_path: Path
) -> None:
    e = sa.expand(sa.Drift(f"{parameter}/5 - u"), order=1)
    source = e.emit("c", name="value")
    known = {"kappa": 0.25, "r": 1.5}
    call = Call("scene", "value", tuple(known.get(n, 1.0) for n in source._ready[0].arguments))
    want = e.bind(**{parameter: 1}).evaluate("1/4", "3/2")
    ((_, _, value),) = ran(target, ({"scene": source}, [call], [want]), tmp_path)
    assert float(value) == pytest.approx(want, rel=1e-12)


def test_whole_numbers_in_mpmath_are_no_doubles() -> None:
    """1/9 of integers, which Python would divide as doubles, cost T its digits after 20."""
    e = sa.expand(sa.linear(1, 3), order=1)
    got = e.emit("mpmath").load().f("1/10", 3, dps=30)
    with mpmath.workdps(40):
        want = e.evaluate("1/10", 3, dps=40)
        assert abs(got - want) < want * mpmath.mpf(10) ** -29


def test_an_array_is_the_numbers_one_by_one() -> None:
    """Where an exponential is 1 for all of the array, or below the least double, or for some."""
    code = sa.expand(sa.friction(3, 1, "-0.4"), order=2).emit("numpy").load()
    arguments = code.f.__code__.co_varnames[: code.f.__code__.co_argcount]
    known = {**{n: float(x) for n, x in roots_of(sa.friction(3, 1, "-0.4")).items()}, "r": 10.0}
    for kappa in (np.linspace(0.005, 0.3, 50), np.linspace(0.005, 0.02, 9), np.array([])):
        rows = [code.log_f(*[{**known, "kappa": k}[n] for n in arguments]) for k in kappa]
        array = code.log_f(*[{**known, "kappa": kappa}[n] for n in arguments])
        assert array == pytest.approx(np.array(rows), rel=1e-14)


def test_what_does_not_depend_on_kappa_is_computed_once() -> None:
    """For each kappa three quotients, of lam, x and the sums, and one logarithm."""
    code = sa.expand(sa.friction(), order=5).emit("numpy")
    once, _, each = code.partition("def of_kappa(kappa):")
    each = each.partition("return _in_blocks")[0]
    assert "np.log(np.abs(" in once
    assert (each.count("/"), each.count("np.log(")) == (3, 1)


def test_a_long_array_is_taken_in_blocks() -> None:
    """20,002 numbers in two rows, also with another argument as an array."""
    code = sa.expand(sa.friction(3, 1, "-0.4"), order=1).emit("numpy").load()
    known = {n: float(x) for n, x in roots_of(sa.friction(3, 1, "-0.4")).items()}
    arguments = code.f.__code__.co_varnames[: code.f.__code__.co_argcount]
    known = {n: x for n, x in known.items() if n in arguments}
    kappa, r = np.linspace(0.02, 0.1, 20002).reshape(2, -1), np.array([[10.0], [2.0]])
    for radius in (10.0, r):
        array = code.log_f(kappa=kappa, r=radius, **known)
        assert array.shape == kappa.shape
        for at in ((0, 0), (0, 7999), (0, 8000), (1, 5998), (1, 5999), (1, 10000)):
            own = {"kappa": kappa[at], "r": np.broadcast_to(radius, kappa.shape)[at]}
            assert array[at] == pytest.approx(code.log_f(**own, **known), rel=1e-14)


def test_a_series_is_computed_once_and_only_where_its_weight_counts() -> None:
    known = sa.expand(sa.friction(3, 1, "-0.4"), order=0).emit("numpy").load().f.__globals__
    Later, made = known["_Later"], []
    a, b = np.array([3.0, 5.0]), np.array([2.0, 7.0])
    late = Later(lambda: made.append(1) or a)
    for zero in (0.0, np.float64(0)):
        assert [np.shape(x) for x in (late * zero, zero * late, -(b + late) * zero)] == [()] * 3
    assert not made
    for want, got in (
        (a + b, late + b), (b + a, b + late), (a - b, late - b), (b - a, b - late),
        (a * b, late * b), (b * a, b * late), (a / b, late / b), (b / a, b / late), (-a, -late),
        (a * a / (a + 1.5), late * late / (late + 1.5)), (np.log(2 * a), np.log(2 * late)),
    ):  # fmt: skip
        assert np.array_equal(np.asarray(got), want)
    assert len(made) == 1


@pytest.mark.parametrize(
    "x",
    [
        0.0, -1.0, -800.0, [0.0, 0.0], [0.0, -1.0], [-1.0, -800.0], [-800.0, -900.0],
        [-745.0, -744.0], [-700.0, -1e300], [0.0, -800.0], [],
    ],
    ids=str,
)  # fmt: skip
def test_the_exponential_that_costs_nothing_is_the_exponential(x: float | list[float]) -> None:
    """To the last bit above e^-740, also where some of an array is 1, or below the least double."""
    code = sa.expand(sa.friction(3, 1, "-0.4"), order=0).emit("numpy").load()
    weights = code.f.__globals__["_weights"]

    def scaled(size: Any, h: Any) -> Any:
        return weights(size)(h)

    for size, h in ((-np.array(x), -1.0), (np.array(1.0), np.array(x))):
        got, want = scaled(size, h), np.exp(np.array(x))
        want = np.where(want < 1e-321, 0, want)
        assert np.array_equal(np.broadcast_to(got, want.shape), want)
    # A number, where no array is needed.
    assert np.shape(scaled(np.array([1.0, 2.0]), 0.0)) == ()
    assert np.shape(scaled(np.array([1.0, 2.0]), -740.5)) == ()


UNIFORM: list[tuple[sa.Drift, str, str, dict[str, Any]]] = [
    # Both sides of the fold at z0 = -7/9, and 2e-5 from it.
    (sa.friction(), "T", "start well barrier", {"mu": 3, "alpha": 1, "z0": "-0.4"}),
    (sa.friction(), "T", "start well barrier", {"mu": 3, "alpha": 1, "z0": "-0.77775"}),
    (sa.friction(), "T", "start", {"mu": 3, "alpha": 1, "z0": "-0.8"}),
    (sa.friction(), "T", "barrier well start", {"mu": 3, "alpha": 1, "z0": "2.4"}),
    (sa.Drift("20*((u - m0)**2 - d)"), "T", "start well barrier", {"m0": "1/3", "d": "1/50"}),
    (
        sa.Drift("-5*((u - a)**2 + 1/40)*(u + b)").bind(a="1/3", b="1/2"),
        "1 - P", "well", {},
    ),
    (sa.Drift("a - b*u"), "P", "well", {"a": "1/5", "b": 2}),
]  # fmt: skip


@cache
def uniform(order: int) -> Asked:
    files, calls, wanted = {}, [], []
    for k, (drift, quantity, case, values) in enumerate(UNIFORM):
        e = sa.expand(drift, quantity, noise="uniform", order=order, case=case)
        files[f"scene{k}"] = e.emit("c", name="value")
        bound = drift.bind(**values)
        known = {**bound.values, **roots_of(bound), "kappa": Fraction("1/8"), "r": Fraction("3/2")}
        names = files[f"scene{k}"]._ready[0].arguments
        given = tuple(float(known[name]) for name in names)
        exact = {name: x for name, x in zip(names, given, strict=True) if name in values}
        asked = drift.bind(**exact), given[names.index("kappa")]
        options: dict[str, Any] = {"method": "uniform", "order": order, "dps": 20}
        want = (
            sa.escape_time(*asked, 3 / 2, **options) if quantity == "T"
            else sa.occupation(*asked, complement=quantity == "1 - P", **options)
        )  # fmt: skip
        wanted.append((want, values.get("z0")))
        calls.append(Call(f"scene{k}", "value", given))
    return files, calls, wanted


@pytest.mark.every(3)
@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy", "mpmath"])
@pytest.mark.parametrize("order", [0, 1])
def test_emitted_uniform(target: str, order: int, tmp_path: Path) -> None:
    """Free parameters, against the verb; beside the fold order 1 loses digits in doubles."""
    for scene, (want, z0), value in ran(target, uniform(order), tmp_path):
        lost = 1e-7 if order and z0 == "-0.77775" else 2e-12
        assert abs(float(value) / float(want) - 1) < (1e-14 if target == "mpmath" else lost), scene


@cache
def overflowing(noise: str, order: int) -> Asked:
    """kappa = 1/100: T is about e^2544, and kappa = 1/10 with r = 3/2, where T is a double."""
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    e = sa.expand(sa.friction(), noise=noise, order=order)
    source = e.emit("c", name="value")
    known = {**drift.values, **roots_of(drift), "r": Fraction("3/2")}
    calls, wanted = [], []
    for kappa in ("1/100", "1/10"):
        at = known | {"kappa": Fraction(kappa)}
        given = tuple(float(at[name]) for name in source._ready[0].arguments)
        calls.append(Call("scene", "log_value", given))
        wanted.append(float(e.bind(**drift.values).evaluate(kappa, "3/2", log=True, dps=20)))
    return {"scene": source}, calls, wanted


@pytest.mark.every(3)
@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy"])
@pytest.mark.parametrize(("noise", "order"), [("weak", 2), ("uniform", 1)])
def test_logarithms_where_exponentials_overflow(
    target: str, noise: str, order: int, tmp_path: Path
) -> None:
    for _, want, value in ran(target, overflowing(noise, order), tmp_path):
        assert float(value) == pytest.approx(want, rel=1e-13)


#: Drifts that are no polynomials: quantity, noise, order, start, kappa.
BOUND: list[tuple[sa.Drift, str, str, int, str, str]] = [
    (sa.Drift("1/2 - sin(2*u)"), "T", "weak", 3, "0", "1/8"),
    (sa.Drift("1/2 - sin(2*u)"), "T", "weak", 1, "1/3", "1/8"),
    (sa.Drift("1/2 - sin(2*u)"), "P", "weak", 2, "0", "1/4"),
    (sa.tanh(1, -1, 3), "T", "weak", 2, "0", "1/8"),
    (sa.hill(-1, "1/2", "1/2"), "C", "weak", 2, "1/2", "1/8"),
    (sa.tanh(1, -2, 3), "1 - P", "uniform", 1, "0", "1/8"),
    (sa.Drift("exp(u - 1/2) - u - 13/25"), "T", "uniform", 0, "0", "1/50"),
    (sa.Drift("exp(u - 1/2) - u - 13/25"), "T", "uniform", 1, "0", "1/50"),
]


@cache
def bound() -> Asked:
    files, calls, wanted = {}, [], []
    for k, (drift, quantity, noise, order, start, kappa) in enumerate(BOUND):
        e = sa.expand(drift, quantity, noise=noise, order=order, start=start)
        numbers = (kappa, "3/2")[: 1 if quantity[-1] == "P" else 2]
        files[f"scene{k}"] = e.emit("c", name="value")
        calls.append(Call(f"scene{k}", "value", tuple(float(Fraction(x)) for x in numbers)))
        wanted.append(e.evaluate(*numbers, dps=25))
    return files, calls, wanted


@pytest.mark.every(3)
@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy", "mpmath"])
def test_a_bound_drift_that_is_no_polynomial(target: str, tmp_path: Path) -> None:
    """Its zeros, heights and finite parts are numbers, to 1e-13 or 32 digits."""
    for scene, want, value in ran(target, bound(), tmp_path):
        lost = 1e-14 if target == "mpmath" else 5e-13
        assert abs(float(value) / float(want) - 1) < lost, scene


def test_free_parameters_of_what_is_no_polynomial_are_to_be_bound() -> None:
    e = sa.expand(sa.Drift("c - sin(2*u)"), order=1)
    with pytest.raises(sa.InputError, match="no closed form in c; bind them"):
        e.emit("javascript")
    with pytest.raises(sa.InputError, match=r"in y; use sa.stationary_density"):
        sa.expand(sa.tanh(1, -1, 3), "density", order=1).emit("c")
    code = e.bind(c="1/2").emit("mpmath").load()
    with mpmath.workdps(40):
        want = e.bind(c="1/2").evaluate("1/8", "3/2", dps=30)
        assert abs(code.f("1/8", "3/2", dps=28) / want - 1) < mpmath.mpf(10) ** -27
    with pytest.raises(ValueError, match="32"):
        code.f("1/8", "3/2", dps=33)


def same(problem: Problem, order: int) -> bool:
    """True if `evaluate` is the verb: one number and an array, to the last bit."""
    drift, start = problem.make(), Fraction(problem.start)
    try:
        e = sa.expand(drift, order=order, start=start)
    except sa.SymasymError:
        return False
    kappas = np.array([0.05, 0.1])
    for kappa in (0.05, kappas):
        options: dict[str, Any] = (
            {"log": True, "errors": "nan"} if kappa is kappas else {"log": True}
        )
        results = []
        for call in (
            e.evaluate,
            partial(sa.escape_time, drift, start=start, method="laplace", order=order),
        ):
            try:
                results.append(call(kappa, problem.r, **options))
            except sa.SymasymError as error:
                results.append(str(error))
        assert np.array_equal(*results, equal_nan=not isinstance(results[0], str)), problem
    return True


def test_evaluate_is_the_verb() -> None:
    assert sum(same(problem, 2) for problem in SAMPLE) == 3


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 1, 4])
def test_evaluate_is_the_verb_on_the_whole_table(order: int) -> None:
    assert sum(same(problem, order) for problem in DISTINCT) >= 10
