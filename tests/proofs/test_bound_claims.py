"""Where "bound" is said, it holds; and the page that lists these places is complete."""

from __future__ import annotations

import ast
import contextlib
import itertools
import re
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.numbers import balls
from symasym.numbers.float_intervals import Compensated, Intervals, log_sum
from tests.searches import bound_claims, fooling

needs_flint = pytest.mark.skipif(not balls.available(), reason="python-flint is not installed")
ROOT = Path(__file__).parents[2]


#: Lists of names, methods, kinds and words: "bound" in them is no claim.
_LISTS = ("__all__", "RULES", "METHODS", "_KINDS", "IN_WORDS")


def _saying_bound() -> set[str]:
    """Modules of the library that write "bound", but in types, comparisons and `_LISTS`."""
    modules = set()
    for path in (ROOT / "symasym").rglob("*.py"):
        where = path.relative_to(ROOT / "symasym").as_posix()
        if where.startswith(("workshop/", "generated/")):
            continue
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        claims = {id(n) for n in nodes if isinstance(n, ast.Constant) and n.value == "bound"}
        for node in nodes:
            typed = isinstance(node, ast.Subscript) and ast.unparse(node.value) == "Literal"
            listed = isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in _LISTS
            listed |= isinstance(node, ast.AnnAssign) and ast.unparse(node.target) in _LISTS
            if typed or listed or isinstance(node, ast.Compare):
                claims -= {id(n) for n in ast.walk(node)}
        if claims:
            modules.add(where)
    return modules


def _rows() -> list[list[str]]:
    """The table of the page: call, theorem, arithmetic, file."""
    page = (ROOT / "docs" / "proved.md").read_text(encoding="utf-8")
    table = page[page.index("| call |") :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table]


def test_the_page_lists_every_place() -> None:
    listed = {name for row in _rows() for name in re.findall(r"`(.*?)`", row[3])}
    assert listed == _saying_bound()


@needs_flint
def test_the_page_lists_every_call() -> None:
    from symasym.methods import METHODS

    listed, method = set(), ""
    for call, *_ in _rows():
        if named := re.findall(r'method="(\w+)"', call):
            method = named[0]
        if named or call.startswith("the same"):
            kinds = {"one scene": "one", "arrays": "array"}
            listed |= {(method, kind) for words, kind in kinds.items() if words in call}
    said, drifts = set(), (sa.polynomial("1/4", -1, "1/3"), sa.polynomial(1, "1/2"))
    for method, drift, many in itertools.product(METHODS, drifts, (False, True)):
        for ask in (sa.escape_time, sa.exit_probability, sa.occupation):
            kappa = 2 if method == "strong_noise" else "0.3"
            scene = ([float(kappa)] if many else kappa, *([] if ask is sa.occupation else [5]))
            with contextlib.suppress(sa.SymasymError):
                if ask(drift, *scene, method=method, full=True).error_kind == "bound":
                    said.add((method, "array" if many else "one"))
    assert said == listed


# -- claims ----------------------------------------------------------------------------------------


@needs_flint
def test_a_start_outside_at_the_height_of_the_barrier() -> None:
    drift = sa.polynomial("-2.16", "0.3", "3")
    kappa = np.geomspace(2e-5, 6e-5, 12)
    found = sa.exit_probability(
        drift, kappa, 5.50001, start=-5.5, method="bound", log=True, full=True
    )
    for k, value, error in zip(kappa, found.value, found.error, strict=True):
        exact = sa.exit_probability(drift, k, 5.50001, start=-5.5, log=True, dps=30)
        assert abs(exact - mpmath.mpf(value)) <= error < 1e-9


@needs_flint
@pytest.mark.parametrize("count", [1500, pytest.param(100_000, marks=pytest.mark.slow)])
def test_random_claims(count: int) -> None:
    search = bound_claims.Search(count)
    search.run(count)
    assert not search.violated
    assert search.claims.total() >= count


@needs_flint
def test_the_search_sees_a_claim_that_is_a_little_too_small(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from symasym.asymptotics.proofs import exit_bounds

    true = exit_bounds.of_scenes

    def less(*given: Any) -> Any:
        answers = true(*given)
        return answers._replace(logs=answers.logs + 1.01 * answers.errors)

    monkeypatch.setattr(exit_bounds, "of_scenes", less)
    search = bound_claims.Search(2)
    search.run(200)
    assert search.violated


@needs_flint
def test_nothing_depends_on_global_precisions() -> None:
    drift, sliding, answers = sa.tanh("1.5", "-1", 3), sa.linear("1.5", "-1"), set()
    for precisions in bound_claims.PRECISIONS:
        with bound_claims.global_precisions(*precisions):
            array = sa.exit_probability(drift, np.array([0.1]), 2, method="bound", full=True)
            paper = sa.occupation(sliding, "0.5", method="paper", full=True)
            laplace = sa.laplace_integral("-atan(x)**2", "1", "x", -1, 1, 2)
            value = laplace.evaluate(50, full=True)
            kinds = paper.error_kind, value.error_kind
            shown = [float(x) for e in (paper, value) for x in (e.value, e.error)]
            answers.add((*kinds, *shown, array.value[0], array.error[0]))
    assert len(answers) == 1


def test_without_flint_nothing_says_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flint", None)
    assert not balls.available()
    sliding, crossing = sa.linear(1, -1), sa.linear(1, 1)
    full: dict[str, Any] = {"full": True}
    for ask in (
        lambda: sa.occupation(sliding, "0.5", method="paper", **full),
        lambda: sa.occupation(sliding, "0.2", method="laplace", **full),
        lambda: sa.escape_time(crossing, 1, 5, **full),
        lambda: sa.escape_time(sliding, "0.2", 5, method="laplace", **full),
    ):
        assert ask().error_kind == "estimate"
    for refused in (
        lambda: sa.exit_probability(crossing, 1, 5, method="bound", **full),
        lambda: sa.exit_probability(crossing, [1.0], 5, method="bound", **full),
        lambda: sa.exit_probability(crossing, 1, 5, method="paper", **full),
        lambda: sa.weak_noise_bound(crossing, 5),
    ):
        with pytest.raises(sa.AccuracyError, match="python-flint"):
            refused()


# -- intervals of float64 --------------------------------------------------------------------------


@needs_flint
def test_intervals_hold_what_balls_say() -> None:
    from flint import arb

    rng = np.random.default_rng(1)
    x = rng.uniform(-1, 1, 400) * 10.0 ** rng.uniform(-12, 2.8, 400)
    for name in ("exp", "expm1", "log", "log1p", "sqrt"):
        y = np.abs(x) if name in ("log", "log1p", "sqrt") else x
        found = getattr(Intervals.of(y), name)()
        with balls.precision(200):
            exact = [getattr(arb(float(v)), name)() for v in y]
        for low, high, ball in zip(found.low, found.high, exact, strict=True):
            assert arb(float(low)) <= ball <= arb(float(high))
        assert (found.high - found.low <= 1e-14 * np.abs(found.high) + 1e-280).all()
    total = log_sum(Intervals.of(x[:, None]))
    with balls.precision(200):
        ball = sum((arb(float(v)).exp() for v in x), arb(0)).log()
    assert arb(float(total.low[0])) <= ball <= arb(float(total.high[0]))


@needs_flint
def test_sums_that_cancel_keep_what_a_float_loses() -> None:
    from flint import arb

    rng = np.random.default_rng(2)
    a, b, c = (rng.uniform(-1, 1, 300) * 10.0 ** rng.uniform(-5, 5, 300) for _ in range(3))
    product = Compensated.of(a) * Compensated.of(b)
    left = (product + Compensated.of(c) - product.head).interval()
    for k in range(300):
        with balls.precision(400):
            exact = arb(a[k]) * arb(b[k]) + arb(c[k]) - arb(float(product.head[k]))
        assert arb(float(left.low[k])) <= exact <= arb(float(left.high[k]))
        assert left.high[k] - left.low[k] <= 1e-15 * abs(c[k]) + 1e-30 * abs(a[k] * b[k])


# -- estimates -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kappa", [0.2, 0.3])
@pytest.mark.parametrize(
    "drift",
    [
        sa.polynomial(0, -1, 0, "-1/1000", 0, 0, 0, -1),
        sa.polynomial(0, -1, 0, "-1/1000000000", 0, 0, 0, -1),
        sa.Drift("-u - u**7*exp(u**2/5) - u**3/10**9"),
    ],
    ids=str,
)
def test_next_terms_that_nearly_vanish(drift: sa.Drift, kappa: float) -> None:
    noise = np.array([kappa])
    exact = sa.occupation(drift, noise, complement=True)
    found = sa.occupation(drift, noise, complement=True, method="laplace", order=0, full=True)
    assert found.error_kind == "estimate"
    wrong = abs(found.value - exact)
    assert wrong <= found.error < 3 * wrong


@pytest.mark.every(3)
@pytest.mark.parametrize("search", fooling.SEARCHES)
@pytest.mark.parametrize("count", [15, pytest.param(300, marks=pytest.mark.slow)])
def test_drifts_that_try_to_fool(search: str, count: int) -> None:
    for order in (0, 1, 2):
        result = fooling.judged(count, 1, search, order)
        assert len(result.ratios) >= count / 4
        assert result.ratios.max() <= 2


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "search", ["1 - P, well", "T, well", "T, regular part", "T, start on a well"]
)
def test_drifts_that_try_to_fool_the_uniform_series(search: str, count: int) -> None:
    for order in (1, 2):
        result = fooling.judged(count, 714301, search, order, method="uniform")
        assert len(result.ratios) >= count / 2
        assert result.ratios.max() <= 2


@pytest.mark.parametrize("search", ["1 - P, well", "T, well"])
def test_the_search_fools_what_the_next_orders_tell(
    search: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from symasym.asymptotics.uniform import majorant_error

    monkeypatch.setattr(majorant_error, "_CLAIM", 0)
    monkeypatch.setattr(majorant_error, "_NEAR", 0)
    assert fooling.judged(20, 714301, search, 1, method="uniform").ratios.max() > 10


@pytest.mark.parametrize("search", ["1 - P, well", "C, start", "T, regular part"])
def test_the_search_fools_an_error_of_two_terms(
    search: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from symasym.asymptotics.weak_noise import series

    monkeypatch.setattr(series, "_SHARE", 0.0)
    assert fooling.judged(12, 1, search, 0).ratios.max() > 10


@needs_flint
def test_an_estimate_below_what_is_proved_says_so() -> None:
    drift = sa.linear(1, 2)
    found = sa.escape_time(drift, "0.2", 5, method="laplace", order=2, full=True)
    assert found.error_kind == "estimate"
    assert any("what is proved" in text for text in found.dropped)
