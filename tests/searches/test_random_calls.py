"""A sample of the random calls, and that what is looked for would be found."""

from __future__ import annotations

import inspect
import random
import sys
from pathlib import Path

import pytest

import symasym as sa
from symasym.commands.main import _parser
from tests.searches import random_calls
from tests.searches.random_calls import AFTER, CALLS, COMMANDS, main, outcome_of, random_call

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
from website.api import INNER


@pytest.mark.parametrize("count", [100, pytest.param(60_000, marks=pytest.mark.slow)])
def test_every_call_ends_in_an_answer_or_a_sentence(count: int) -> None:
    printed: list[str] = []
    counts = main(count, seed=7, report=printed.append)
    assert (counts["bare"], counts["late"]) == (0, 0), "\n".join(printed)
    assert counts["answer"] > count / 4
    assert counts["InputError"] > 0


def test_every_verb_is_called() -> None:
    draw = random.Random(1)
    calls = [random_call(draw) for _ in range(600)]
    asked = {call.partition("(")[0] for call in calls}
    assert asked == {"command", *(f"sa.{verb}" for verb in CALLS)}


def test_every_public_name_argument_and_option_is_called() -> None:
    public = {name: getattr(sa, name) for name in sa.__all__}
    for name, verb in public.items():
        if inspect.isclass(verb) and name not in CALLS:
            continue
        parameters = inspect.signature(verb).parameters.values()
        named = {p.name for p in parameters if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)}
        assert named <= {*CALLS[name], "patience"}, name
    asked = {name for answers in AFTER.values() for name in answers}
    for name, of in public.items():
        if not inspect.isclass(of) or issubclass(of, Exception):
            continue
        inner = {m for kind in of.__mro__ for m in INNER.get(kind.__name__, ())}
        inner |= {*getattr(of, "__dataclass_fields__", ()), *dir(tuple)}
        members = {m for m in dir(of) if not m.startswith("_")} - inner
        # What a record of a few numbers has is no call; these two are called by their class.
        assert members <= {*asked, "stable", "general", "name", "model", "of"}, name
    words = {"--drift", *" ".join(COMMANDS).split()}
    parsers = next(a for a in _parser()._actions if a.choices).choices
    for name, parser in parsers.items():
        inner = [a.choices for a in parser._actions if isinstance(a.choices, dict)] or [{}]
        known = {
            o for p in [parser, *(inner and inner[0].values())] for o in p._option_string_actions
        }
        assert {name, *known} <= {*words, "-h", "--help", "--out", "--scheduler"}, name


@pytest.mark.parametrize(
    "call",
    [
        "sa.occupation(sa.tanh('1e-145', '-0.4', '1e150'), '1e900', method='strong_noise', "
        "order=0, dps=20, patience=1)",
        "sa.formula('folds').emit(target=10**5000)",
        "sa.plan(sa.sine(1e150, '0.1', '-0.4', waves=3), 2, 2, start='0.1', patience=1)",
        "sa.plan(sa.polynomial('0.1', 0, '-0.4', 1e-124), kappa=0.05, r=2).terms",
        "sa.release(sa.oscillator(3, 1), 1, 10, eps=1e-3, start=('0.1', -0.5), method='march', "
        "rtol=1e308)",
        "sa.plan(sa.polynomial(1, '0.7', 2, '0.02'), 0.3, 2, rtol=Fraction(1, 10**5000))",
        "sa.plan(sa.Drift('a - b*u + exp(-c*u)').bind(a=1e-124, b=1e308, c='1/3'), 1, 0.5, "
        "start='0.1')",
        "sa.escape_time(sa.tanh(1, 10, '0.02'), 0.3, 1e-200, dps=15, drag_time='1/3', full=True)",
        "sa.escape_time(sa.friction('0.3', '0.3', '5'), 1, 10, full=True, drag_time='1e-500')",
        "sa.escape_time(sa.friction(5e-324, '2', '2'), 2, 10, method='laplace', errors='nan')",
        "sa.rescale(eps=[0.1, 0.5], kappa=0.05, r=0.5).drag_time(distance=0.1, velocity=0.3)",
        "sa.escape_time(sa.Drift('0.3 - 1.5/(1 + (500*u)**2)'), 0.1, 2, method='local')",
        "sa.hill(a_minus=0.1, a_plus=0.1, K=1e-145, n=3).potential_at(u=2)",
        "sa.tanh(a_minus=2, a_plus=10**5000, steepness=2).potential()",
        "sa.polynomial(c0=0.1, c3=2).potential_at(u=1e308)",
        "sa.escape_time(sa.hill(0.02, 0.02, 0.02), 0.1, 0.3, start=0.1, method='local')",
        "sa.reduce(('1 - z', '-z'), ('-1 - z', '-z'), ('-s - z', '-z'), ((3,), (0,)), ('y', 'z'))"
        ".drag_time(eps='1e99999', values={'z': 0})",
        "sa.expand(sa.friction(3, 1), noise='strong', order=1).emit(target=np.array([1.0, 2.0]))",
        "sa.escape_time(sa.linear(1, 2), 0.3, 1, full=True, drag_time=np.array([1.0, 2.0]))",
        "sa.System.of(sa.reduce(('1 - z', '-z'), ('-1 - z', '-z'), ('-s - z', '-z'), ((3,), (0,)), "
        "('y', 'z')), slow='z', across=np.array([True, False]))",
        "sa.release(sa.oscillator(3, 1), '0.1', 2, eps=1e-3, method='simulate', "
        "paths=Fraction(1, 10**5000))",
        "sa.sine(a_minus=0.05, a_plus=0.3, b=0.1, waves='1_000').plot()",
        "sa.hill(a_minus=0.1, a_plus=0.2, K=1e-139)(-1)",
        "sa.friction(mu=0.1, alpha=10**5000, z0=np.array([1.0, 2.0])).turning_points()",
        "sa.Drift(A='1e400').plot()",
        "sa.sine(a_minus=0.05, a_plus=1, b='-1e99999')._repr_latex_()",
        "sa.hill(a_minus=10**5000, a_plus=1, K=[0.1, 0.5])._repr_latex_()",
        "sa.emit(what=[])",
        "sa.release(sa.oscillator(mu='1/2', alpha=2), 0.3, 2, eps='0.1', method='simulate', "
        "paths=100, step=0.01, tau=5e-324, patience=1.0).time",
        "sa.escape_time(sa.linear(1, 1), 0.3, 10, drag_time=Frame(), full=True)",
        "sa.plan(sa.Drift('a - b*u + exp(-c*u)').bind(a='1', b=1e308, c=1e-124), 1, 0.5, "
        "patience=1.0)",
        "sa.release(sa.System('1 - z - u - 3*(u - u**3)', 'y - 1', '1 + u**2/2'), '0.1', '1/2', "
        "eps=1e150, start=(0, 0), method='simulate', paths=100, step=0.01, patience=1.0).time",
        "sa.sine(a_minus=1, a_plus=1e308, b=0.3, waves=2).plot()",
        "sa.tanh(a_minus=0.3, a_plus=0.3, steepness='1e99999').barriers()",
        "sa.exit_probability(sa.Drift('a - b*u + exp(-c*u)').bind(a='2', b='0.1', c=1e15), 1, 10, "
        "method='paper', dps=15)",
        "sa.rescale(eps=2, kappa=1, r='1e99999').__str__()",
        "sa.rescale(eps=1, kappa=10**5000, r=10).__str__()",
        "sa.plot(quantity='p_ss', drift=sa.linear(1, -1), kappa=[0.1, 1], r=10)",
        "sa.plot(quantity='p_ss', drift=sa.linear(1, -1), kappa=[0.1, 1], y=0, method='local')",
        "sa.plot(quantity='T', drift=sa.linear(1, 1), kappa=[0.1, 1])",
        "sa.friction(mu=10**400, alpha=2, z0=1).barriers()",
        "sa.friction(mu='1e99999', alpha=1, z0=2).barriers()",
        "sa.tanh(a_minus=[0.1, 0.5], a_plus='1e400', steepness=1).region",
        "sa.release(sa.oscillator(3, 1), '0.1', 2, eps=1e-3, method='simulate', patience=1.0)",
        "sa.release(sa.oscillator(3, 1), 1e-60, '1/2', eps='0.1', patience=1.0)",
        "sa.release(sa.oscillator(3, 1), 1, 2, eps='0.1', full='1e400')",
        "sa.expand(sa.sine('3', 1e308, '-1', waves=2), 'density')",
        "sa.expand(sa.Drift.general(), 'density', case='start')",
        "sa.expand(sa.tanh('-1e99999', '10', '0.7'), 'P', noise='strong')",
        "sa.formula('eq:Ttilde').emit(drift=sa.friction(Fraction(1, 10**5000), '2', '1/3'))",
        "sa.formula('eq:P').emit(drift=sa.tanh('-1', '-0.4', '1e99999'))",
        "sa.emit('eq:Ttilde', 'latex', drift=sa.polynomial('10', '0.02', '-1e99999', '-0.4'))",
        "sa.occupation(sa.sine(1e150, '-0.4', 3), 0.3, complement=True, method='paper', dps=15)",
        "sa.oscillator(mu=2, alpha=0.1).drag_time(z=10**5000, eps=0.05)",
        "sa.release(sa.oscillator(3, 1), 0.3, 10, eps='0.01', tau=Fraction(1, 10**5000))",
        "sa.exit_probability(sa.hill('5', '1/3', 1e-300, n=1), 2, 10, method='paper')",
        "sa.expand(sa.Drift('2 - u**3'), 'T', noise='uniform')",
        "sa.plan(sa.tanh(3, -1, 5), '1e-500', 2, patience=1.0)",
        "sa.plot('C', sa.linear(1, 1), [0.1, 1], 2, ax=range(3))",
        "sa.occupation(sa.Drift('2 - u + exp(-c*u)').bind(c=Fraction(1, 10**5000)), 0.1)",
        "sa.plan(sa.tanh(1e308, '0.3', '0.1'), 0.1, '1/2', patience=1.0).__str__()",
        "sa.plan(sa.Drift('a - u + exp(-c*u)').bind(a=2, c=1e150), 0.1, '1/2', patience=1.0)",
        "sa.release(sa.System('1 - z - u', 'y - 1'), 1, 2, eps=1e308, start=(0, '-0.4'))",
        "sa.release(sa.oscillator('1/2', 2), 0.3, 1e308, eps='0.1', start=(0, 0))",
        "sa.plan(sa.friction('0.7', 1e308, '1'), 0.1, 2, patience=1.0)",
        "sa.friction(mu=1, alpha=1e308, z0=1).potential_at(0.05)",
        "sa.exit_probability(sa.sine(0.7, 10, 10**400, waves=1), 1, 10, method='paper')",
        "sa.release(sa.oscillator('1/2', 2), 1e-300, 2, eps='0.01', method='first_order')",
        "sa.reduce(('2', '0'), ('-1', '0'), ('1/2', '0'), np.array([True, False]), ('y', 'z'))",
        "sa.escape_time(sa.friction('0.3', 1e308, '5'), [0.1, 0.5], 0.5, method='paper')",
        "sa.Drift('exp(-u)*cos(u)', a_minus='1e-500')",
        "sa.System.of(reduction='auto', slow='z', across='y', at={})",
        "sa.escape_time(sa.linear(1, 1), 0.3, 2, full=Frame(), drag_time=0.5)",
        "sa.expand(sa.linear(), order=0).put_in(expression=(1, 2))",
        "sa.friction(mu=1, alpha=1e308, z0=1).folds()",
        "sa.escape_time(sa.tanh(3, 1, 1e9), 1e-9, 2, method='laplace', dps=30, full=True, "
        "errors='nan', drag_time=1)",
        "sa.friction(mu=1, alpha=1e308, z0=1).beta()",
        "sa.laplace_integral('-x', '1/(1e30 + 1/3)**(0.5**(1/3))', 'x', 1, 'oo').error_kind",
        "sa.sensitivity(sa.polynomial(1e308, '3', '3', 1e-60), 2, 10, quantity='C')",
        "command('figure', 'stokes', '--set', 'kappa=1/3', '--set', 'alpha=abc')",
        "command('figure', 'fric2', '--set', 'points=1000000000')",
        "command('value', 'escape-time', '--drift', 'linear', '--kappa', '1e-99999')",
    ],
)
def test_calls_that_ended_otherwise_once(call: str) -> None:
    outcome = outcome_of(call)
    assert outcome.kind not in ("bare", "late"), outcome


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        ("sa.escape_time(sa.linear(1, 1), 1, 2)", "answer"),
        ("sa.escape_time(sa.linear(1, 1), 0, 2)", "InputError"),
        ("sa.escape_time()", "bare"),
        ("__import__('os')", "bare"),  # no name that a call may use
        ("sa.tanh(1, -1, '1.4').__class__", "bare"),
        (
            "sa.occupation(sa.tanh(1, -1, '1.4'), '1e-60', dps=400, log=True, patience=math.inf)",
            "late",
        ),
    ],
)
def test_how_a_call_ends(call: str, kind: str) -> None:
    outcome = outcome_of(call, late=0.3)
    assert outcome.kind == kind
    assert random_calls.LATE >= 2 * random_calls.PATIENCE
