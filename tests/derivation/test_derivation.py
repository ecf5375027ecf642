"""The engine: every kind of check passes what is right and fails what is not."""

from __future__ import annotations

import random

import pytest
import sympy
from sympy import Function, Integral, Symbol, exp, log, oo, sqrt, tanh

from symasym.derivation import (
    Bound,
    Definition,
    Derivation,
    DerivationError,
    Expansion,
    Identity,
    Inequality,
    Order,
    Sampled,
    Satisfies,
    Together,
    mutants,
    mutation_test,
)

x = Symbol("x", positive=True)
a = Symbol("a", positive=True)
RNG = random.Random(1)


def passes(check, result):
    return check.run(result, random.Random(1)).passed


def one_step(result, check, name="only"):
    d = Derivation("mine", "A derivation of one's own")
    d.step(name, "evaluate", result, check)
    return d


# -- identities -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (x**2 + 2 * x + 1, x**2 + 2 * x + 2),
        (exp(2 * x) - 2 + exp(-2 * x), exp(2 * x) + 2 + exp(-2 * x)),
        (1 / x - 1 / (x + 1), 1 / x - 1 / (x + 2)),
    ],
)
def test_identity(right, wrong):
    for other in (sympy.expand(right), sympy.together(right)):
        assert passes(Identity(lambda other=other: other), right)
        assert not passes(Identity(lambda other=other: other), wrong)


def test_identity_counts_its_pieces():
    assert passes(Identity((x, 2 * x)), (x, 2 * x))
    assert not passes(Identity((x, 2 * x)), x)


def test_unknown_is_a_failure():
    # Equal (Bessel's integral), but not by any of the ways that the engine knows.
    angle = Symbol("angle", real=True)
    hard = Integral(sympy.cos(x * sympy.sin(angle)), (angle, 0, sympy.pi)) / sympy.pi
    outcome = Identity(sympy.besselj(0, x)).run(hard, RNG)
    assert not outcome.passed
    assert "unknown" in outcome.detail


def test_undefined_functions_are_told_apart():
    f = Function("f")
    assert passes(Identity(lambda: sympy.diff(f(x) ** 2, x)), 2 * f(x) * f(x).diff(x))
    assert not passes(Identity(lambda: sympy.diff(f(x) ** 2, x)), f(x) * f(x).diff(x))


def test_satisfies_and_definition():
    ode = Satisfies(lambda f: {"f' = f": sympy.diff(f, x) - f, "f(0) = 1": f.subs(x, 0) - 1})
    assert passes(ode, exp(x))
    assert not passes(ode, 2 * exp(x))
    assert not passes(ode, exp(2 * x))
    assert not passes(Definition(lambda f: {}), x)


def test_a_check_that_breaks_down_fails():
    def broken():
        raise ZeroDivisionError("on purpose")

    with pytest.raises(DerivationError, match="broke down: ZeroDivisionError: on purpose"):
        one_step(x, Identity(broken)).verify()


# -- inequalities ---------------------------------------------------------------------------


def test_bound_with_certificate():
    check = Bound(difference=a**2, on="all a")
    assert passes(check, Inequality(2 * x * a, "<=", 2 * x * a + a**2))
    assert not passes(check, Inequality(2 * x * a, ">=", 2 * x * a + a**2))
    assert not passes(check, Inequality(2 * x * a, "<=", 2 * x * a + 2 * a**2))


def test_bound_needs_a_certificate_or_a_meeting_point():
    outcome = Bound(monotone=(x, 0)).run(Inequality(x, "<=", 2 * x), RNG)
    assert not outcome.passed
    assert "no certificate" in outcome.detail


def test_bound_that_meets_and_grows():
    check = Bound(monotone=(x, 0), equality={x: 0}, on="x > 0")
    assert passes(check, Inequality(log(1 + x), "<=", x))
    assert not passes(check, Inequality(log(1 + x), "<=", x + 1))
    assert not passes(check, Inequality(log(1 + x), "<=", x / 2))


def test_bound_by_root_count():
    y = Symbol("y", real=True)
    check = Bound(roots=(y, -1, 1), equality={y: 1}, on="-1 < y < 1")
    assert passes(check, Inequality(y**2, "<=", sympy.S.One))
    assert not passes(check, Inequality(y**2, "<=", y))


def test_false_inequality_names_a_point():
    outcome = Bound(difference=x).run(Inequality(x**2, "<=", x), RNG)
    assert not outcome.passed
    assert "x = " in outcome.point


def test_a_negative_certificate_does_not_help():
    assert not passes(Bound(difference=-x), Inequality(2 * x, "<=", x))


# -- numbers --------------------------------------------------------------------------------


def test_sampled_with_nested_integrals():
    v, u = Symbol("v", real=True), Symbol("u", real=True)
    nested = Integral(Integral(exp(u - v), (u, -1, v)), (v, 0, x))
    closed = x - exp(-1) * (1 - exp(-x))
    check = Sampled(closed, {x: ("1/2", "3")}, points=3, digits=15)
    assert passes(check, nested)
    assert not passes(check, nested + sympy.Rational(1, 10**9))


def test_sampled_states_its_probability():
    check = Sampled(x**2, {x: (0, 1)}, degree=2, points=3)
    assert "(2/10000)^3" in check.how()
    assert "no probability" in Sampled(x, {x: (0, 1)}).how()


@pytest.mark.parametrize("gauge", [x**2, x**4, x**3 * log(1 / x)])
def test_order_rejects_orders_that_are_too_high_or_too_low(gauge):
    check = Order(lambda h, ctx: ctx.sin(h), ("1e-1", "1e-3", "1e-5", "1e-9"), digits=60)
    assert passes(check, Expansion(x, x**3, x))
    if gauge != x**3 * log(1 / x):  # a logarithm is below what a slope can tell
        assert not passes(check, Expansion(x, gauge, x))


def test_order_at_infinity():
    check = Order(lambda h, ctx: ctx.tanh(1 / h) * h**2, ("1e1", "1e2", "1e3", "1e4"))
    assert passes(check, Expansion(x, 1 / x, x, oo))
    assert not passes(check, Expansion(2 * x, 1 / x, x, oo))


def test_order_refuses_a_remainder_below_its_digits():
    outcome = Order(lambda h, ctx: h, ("1e-1", "1e-2", "1e-3")).run(Expansion(x, x**2, x), RNG)
    assert not outcome.passed
    assert "lost in the working precision" in outcome.detail


def test_together_needs_all():
    good = Order(lambda h, ctx: ctx.sin(h), ("1e-1", "1e-2", "1e-3"))
    bad = Order(lambda h, ctx: 2 * ctx.sin(h), ("1e-1", "1e-2", "1e-3"))
    assert passes(Together((good, good)), Expansion(x, x**3, x))
    assert not passes(Together((good, bad)), Expansion(x, x**3, x))
    assert not passes(Together(()), Expansion(x, x**3, x))


# -- the chain ------------------------------------------------------------------------------


def test_a_broken_step_says_where_and_how():
    d = one_step(x**2 + 1, Identity(lambda: x**2 + 2), name="the second")
    with pytest.raises(DerivationError) as error:
        d.verify()
    message = str(error.value)
    for part in ("mine", "'the second'", "symbolic identity", "Left: ", "Right: ", "At: x = "):
        assert part in message


def test_hypotheses_are_settled():
    d = one_step(x, Identity(x))
    d.suppose("noise is small")
    d.suppose("1 < 2", "checked", check=lambda: 1 < 2)
    assert len(d.verify()) == 1
    d.suppose("2 < 1", "checked", check=lambda: 2 < 1)
    with pytest.raises(DerivationError, match="2 < 1"):
        d.verify()
    with pytest.raises(ValueError, match="need a check"):
        d.suppose("no check", "checked")


def test_a_chain_concludes_only_what_was_checked():
    d = one_step(x, Identity(x))
    with pytest.raises(ValueError, match="no step has checked"):
        d.conclude(a, 2 * x)
    with pytest.raises(ValueError, match="is no rule"):
        d.step("odd", "guess", x, Identity(x))
    with pytest.raises(ValueError, match="two steps named"):
        d.step("only", "evaluate", x, Identity(x))
    with pytest.raises(DerivationError, match="has no step"):
        Derivation("empty", "").verify()


# -- mutation -------------------------------------------------------------------------------


def test_mutants_change_every_kind_of_thing():
    changes = dict(mutants(3 * x**2 - a / sqrt(x) + exp(-x) * tanh(2 * x)))
    assert {change.split(" of ")[0].split(" on ")[0] for change in changes} >= {
        "coefficient 2",
        "sign",
        "exponent + 1",
        "exponent negated",
        "coefficient 2 in the exponent",
        "coefficient 2 in the argument",
    }
    orders = [change for change, _ in mutants(Expansion(x, x**2, x))]
    assert {"order one higher", "order one lower"} <= set(orders)
    assert "direction" in [change for change, _ in mutants(Inequality(x, "<", a))]
    assert all(m != x + 1 for _, m in mutants(x + 1))


def test_survivors_are_found():
    # A check that looks at the square cannot see the sign: mutation testing must say so.
    blind = one_step(x, Satisfies(lambda r: {"square": r**2 - x**2}))
    killed, steps, changes, survivors = mutation_test([blind])
    assert (killed, steps) == (0, 1)
    assert changes >= 2
    assert "sign of the whole survived" in str(survivors[0])
    sound = one_step(x, Identity(x))
    assert mutation_test([sound])[0] == 1


def test_a_bound_on_the_probability_from_the_number_of_zeros():
    # e^x + e^-x against 2 cosh: sums of exponentials, whose difference has few zeros.
    check = Sampled(
        lambda values, ctx: 2 * ctx.cosh(values[x]), {x: (0, 1)}, points=6, digits=20, zeros=2
    )
    assert passes(check, exp(x) + exp(-x))
    assert not passes(check, exp(x) + exp(-x) + sympy.Rational(1, 10**15))
    assert "(2/10000)^6" in check.how()


def test_both_sides_are_printed_so_that_they_differ():
    check = Sampled(lambda values, ctx: values[x], {x: (1, 2)}, digits=25)
    outcome = check.run(x + sympy.Rational(1, 10**18), RNG)
    assert not outcome.passed
    assert outcome.left != outcome.right
    order = Order(lambda at, ctx: 1 + at**2, ("1e-9", "1e-10", "1e-11"), digits=60)
    outcome = order.run(Expansion(sympy.S.One, x, x), RNG)
    assert not outcome.passed
    assert outcome.left != outcome.right
