"""Derivations hang together: a mistake made in a statement and in its reference alike is noticed.

A step is changed together with what it is compared with, or a variable that feeds both; then a
later step, a derivation that uses the conclusion, or the conclusion's anchor has to fail.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import random
import signal
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import sympy

from derivations import registry
from derivations.paper import PaperDerivation, value_of
from derivations.registry import entries
from symasym.derivation import DerivationError, Identity, Outcome, mutants
from tests.derivations.anchors import holds

#: Seconds of processor time that one change may take. SymPy may search for an integral of a
#: changed expression for ever: such a change is counted apart, neither noticed nor passed.
LIMIT = 60.0


class Late(BaseException):
    """The time of a change is over; no `except Exception` stops it."""


@contextmanager
def limited(late: list[str], what: str, seconds: float = LIMIT) -> Iterator[None]:
    """Give what runs inside so much time; note in `late` what takes longer."""

    def over(*_: Any) -> None:
        raise Late

    before = signal.signal(signal.SIGVTALRM, over)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    except Late:
        late.append(what)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def test_what_takes_too_long_is_counted():
    late: list[str] = []
    with limited(late, "for ever", 0.05):
        while True:
            with suppress(Exception):
                sympy.Integer(1)
    assert late == ["for ever"]


Known = Callable[[str], Any]
Change = Callable[[Any], Any]


class Unchecked:
    """In place of the check of a step that is changed together with its reference."""

    kind = "none"

    def run(self, result: Any, rng: Any) -> Outcome:
        return Outcome(True, "")


class Changed(PaperDerivation):
    """A derivation one of whose steps states something else, and is not checked."""

    def __init__(self, *arguments: Any, at: str, change: Change) -> None:
        super().__init__(*arguments)
        self.changed, self.change = at, change

    def step(self, name: str, rule: str, result: Any, check: Any, *rest: Any, **named: Any) -> Any:
        if name == self.changed:
            result, check = self.change(result), Unchecked()
        return super().step(name, rule, result, check, *rest, **named)


def stated(label: str, known: Known, function: Any = None, **change: Any) -> Any:
    """A derivation with its steps stated: from another source, or with one step changed."""
    entry = entries()[label]
    function = function or getattr(importlib.import_module(entry.module), entry.function)
    kind = Changed if change else PaperDerivation
    derivation = kind(label, entry.title, entry.rests_on, known, registry.holds, **change)
    function(derivation)
    return derivation


@cache
def uses(label: str) -> dict[str, set[str]]:
    """What a derivation rests on -> the steps that take something from it ("" for any)."""
    derivation = registry.assemble(label, registry.build)
    derivation.verify()
    return dict(derivation.used)


def failing(derivation: Any, steps: set[str] | None = None) -> Iterator[str]:
    """The steps whose check fails, of those named; the exact checks first, which take less."""
    every = steps is None or "" in steps
    chosen = [s for s in derivation.steps if every or s.name in (steps or ())]
    for step in sorted(chosen, key=lambda s: "order" in s.check.kind):
        if not derivation.run_step(step).passed:
            yield step.name


def noticed(changed: Any, others: Known = registry.build) -> str:
    """The derivation and step that fail where `changed` stands in place of one."""
    for label, entry in entries().items():
        if changed.label not in entry.rests_on:
            continue
        known: Known = lambda on: changed if on == changed.label else others(on)  # noqa: E731
        try:
            derivation = stated(label, known)
            where = next(failing(derivation, uses(label)[changed.label]), "")
        except Exception as error:
            return f"{label}: {error}"
        if where:
            return f"{label}: {where}"
    return ""


def wrong(derivation: Any) -> str:
    """What shows that a changed derivation is wrong: "" for nothing."""
    found = next(failing(derivation), "") or noticed(derivation)
    known = registry.build(derivation.label)
    same = (derivation.left, derivation.result) == (known.left, known.result)
    if found or same:
        return found
    return "" if holds(derivation.label, derivation.left, derivation.result) else "its anchor"


def killed(label: str, step: str, change: Change) -> str:
    """What notices a step that is changed together with its reference: "" for nothing."""
    try:
        return wrong(stated(label, registry.build, at=step, change=change))
    except Exception as error:
        return str(error) or "no value"


def some(result: Any) -> list[Any]:
    """Some changes of a result, of all its pieces."""
    changes = [mutant for _, mutant in mutants(result)]
    return changes[:: max(1, len(changes) // 9)]


@cache
def references(label: str) -> frozenset[str]:
    """The steps that are compared with other steps, with other derivations, or with quadrature."""
    derivation = registry.build(label)
    found = {step for steps in uses(label).values() for step in steps}
    found |= {s.name for s in derivation.steps if "order" in s.check.kind}
    for step in derivation.steps:
        for mutant in some(step.result):
            # Those that are known to be are not run again: quadrature takes seconds.
            rest = {s.name for s in derivation.steps} - found - {step.name}
            try:
                other = stated(label, registry.build, at=step.name, change=lambda _, m=mutant: m)
                found |= set(failing(other, rest))
            except Exception:
                continue
    return frozenset(found)


LABELS = list(entries())


# -- what is used is listed, and what is listed is used -------------------------------------


def test_a_derivation_uses_all_that_it_rests_on_and_nothing_else():
    def takes(*labels: str) -> PaperDerivation:
        found = PaperDerivation("mine", "", ("eq:V", "eq:C"), registry.build, registry.holds)
        found.step(
            "one", "define", sympy.S.One, Identity(lambda: [found.use(*a) for a in labels] and 1)
        )
        return found

    both = takes(("eq:V", "V(u)"), ("eq:C", "C"))
    both.verify()
    assert both.used == {"eq:V": {"one"}, "eq:C": {"one"}}
    with pytest.raises(DerivationError, match="rests on eq:C and uses nothing of it"):
        takes(("eq:V", "V(u)")).verify()
    with pytest.raises(DerivationError, match="uses eq:pss without resting on it"):
        takes(("eq:pss", "p_ss(u)")).verify()
    with pytest.raises(DerivationError, match="eq:V concludes V"):
        takes(("eq:V", "W(u)")).verify()


def _edges(every: int) -> list[tuple[str, str]]:
    return [(a, on) for a in LABELS for on in entries()[a].rests_on][::every]


def _with_a_step_changed(label: str) -> Iterator[Any]:
    """A derivation with one step changed, those that can't be stated left out."""
    for step in registry.build(label).steps:
        for mutant in some(step.result):
            with suppress(Exception):
                yield stated(label, registry.build, at=step.name, change=lambda _, m=mutant: m)


@pytest.mark.parametrize("every", [24, pytest.param(1, marks=pytest.mark.slow)])
def test_every_edge_bears_load(every):
    """Something that the lower one states can be changed so that the upper one fails."""
    for label, on in _edges(every):
        steps = uses(label)[on]

        def fails(other: Any, label: str = label, on: str = on, steps: Any = steps) -> bool:
            try:
                known: Known = lambda name: other if name == on else registry.build(name)  # noqa: E731
                return any(failing(stated(label, known), steps))
            except Exception:
                return True

        assert any(map(fails, _with_a_step_changed(on))), f"{label} -> {on}"


@pytest.mark.parametrize("every", [9, pytest.param(1, marks=pytest.mark.slow)])
def test_every_part_of_a_conclusion_is_what_a_step_states(every):
    """None is typed a second time: with the step, it changes."""
    for label in LABELS[::every]:
        concluded = _pieces(registry.build(label).result)
        fixed = set(range(len(concluded)))
        for other in _with_a_step_changed(label):
            changed = _pieces(other.result)
            fixed -= {k for k in fixed if changed[k : k + 1] != concluded[k : k + 1]}
            if not fixed:
                break
        assert not fixed, (label, fixed)


def _pieces(result: Any) -> tuple[Any, ...]:
    return result if isinstance(result, tuple) else (result,)


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_the_left_side_is_part_of_the_statement(every):
    for label in LABELS[::every]:
        left = registry.build(label).left
        for wanted in map(str, left if isinstance(left, tuple) else (left,)):
            value_of(registry.build(label), wanted)
            with pytest.raises(ValueError, match="concludes"):
                value_of(registry.build(label), f"{wanted} + 1")


# -- a mistake in two consistent places -----------------------------------------------------


@pytest.mark.parametrize("every", [30, pytest.param(1, marks=pytest.mark.slow)])
def test_no_step_changed_with_its_reference_passes(every, capsys):
    tried, survivors, late = 0, [], []
    for label in LABELS[::every]:
        for step in registry.build(label).steps:
            changes = list(mutants(step.result))
            rng = random.Random(f"{label} {step.name}")
            for change, mutant in {changes[0], rng.choice(changes)}:
                tried += 1
                what = f"{label}: {step.name}: {change}"
                with limited(late, what):
                    # A last step has its reference from elsewhere, where a change is noticed.
                    if not killed(
                        label, step.name, lambda _, m=mutant: m
                    ) and step.name not in references(label):
                        survivors.append(what)
    with capsys.disabled():
        print(
            f"\n{tried} steps changed with their reference, {len(survivors)} pass, "
            f"{len(late)} take more than {LIMIT:g} s"
        )
    assert not survivors
    assert len(late) <= tried // 50, late


# -- the same by changing the sources -------------------------------------------------------


def module_of(path: Path, change: Callable[[str], Any], **names: Any) -> types.ModuleType:
    """A section module whose source, or tree, is changed before it is run."""
    module = types.ModuleType(f"changed_{path.stem}")
    vars(module).update(names)
    sys.modules[module.__name__] = module  # where dataclasses look their module up
    exec(compile(change(path.read_text(encoding="utf-8")), str(path), "exec"), vars(module))
    return module


def source_of(label: str) -> Path:
    return Path(importlib.import_module(entries()[label].module).__file__)


#: A mistake that is made in a statement and in what it is compared with.
CONSISTENT = {
    "eq:Ttilde: three times too large": (
        ("lam * Integral(Integral(kernel,", "3 * lam * Integral(Integral(kernel,"),
        ("lambda: lam * Integral(together", "lambda: 3 * lam * Integral(together"),
    ),
    "eq:Ttilde: the left side is C": (
        ('d.conclude(Symbol("T"), found)', 'd.conclude(Symbol("C"), found)'),
    ),
    "eq:Ttilde0: the mass in (-r, 0) alone": (("(u, -r, r)", "(u, -r, 0)"),),
    "backward: (kappa^2/2) T'' + phi T' = -2": (
        ("e * (c - lam * down)", "e * (c - 2 * lam * down)"),
        ("* S + 1,", "* S + 2,"),
    ),
    "C-bound: exponent -5 a- r/kappa^2": (("(1 - 2 * Delta)", "(3 - 2 * Delta)"),),
    "C-bound: without its factor 2": (
        ("2 * a_minus * (1 / a_plus + 2", "a_minus * (1 / a_plus + 2"),
        ("lambda: at_limit.subs(", "lambda: sympy.S.Half * at_limit.subs("),
    ),
    "eq:S: 1/3": (
        (
            "(sympy.S.One, sympy.S.Half, sympy.S.Zero)",
            "(sympy.S.One/3, sympy.S.Half/3, sympy.S.Zero)",
        ),
        ("sympy.limit(at_start", "sympy.S.One / 3 * sympy.limit(at_start"),
    ),
    "eq:V: from 0": (("(v, -1, u)", "(v, 0, u)"), ("every.subs(u, -1)", "every.subs(u, 0)")),
    "threshold: e^(D eps/kappa^2)": (
        ("sympy.exp(2 * D * eps / k**2)", "sympy.exp(D * eps / k**2)"),
        ("scaled = well.subs", "scaled = sympy.sqrt(well).subs"),
        ("sympy.sqrt(2 * D * eps / big)", "sympy.sqrt(D * eps / big)"),
        ("-4 * D * eps", "-2 * D * eps"),
    ),
    "constant-drift: twice T": (
        ("r / a * sympy.tanh", "2 * r / a * sympy.tanh"),
        ("mean.subs(u, 0)", "2 * mean.subs(u, 0)"),
        ('- d.use("backward", "T")', '- 2 * d.use("backward", "T")'),
    ),
    "eq:TtildeCzero: over (-r, r)": (("(v, 0, r)", "(v, -r, r)"), ("(v, 0, end)", "(v, low, end)")),
    "eq:Psmall2: the left side is P": (('1 - Symbol("P")', 'Symbol("P")'),),
    "eq:odeR: over m^2": (
        ("operator / _m", "operator / _m**2"),
        (
            '(t, 0, sympy.oo)) * d.use("eq:FPE", "Lq")',
            '(t, 0, sympy.oo)) / _m * d.use("eq:FPE", "Lq")',
        ),
    ),
}


@pytest.mark.parametrize("mistake", CONSISTENT)
def test_no_mistake_in_two_places_passes(mistake):
    label = mistake.partition(": ")[0]
    entry = entries()[label]
    functions = vars(importlib.import_module(entry.module))
    text = inspect.getsource(functions[entry.function])
    changed = text
    for old, new in CONSISTENT[mistake]:
        assert old in changed, old
        changed = changed.replace(old, new)
    module = module_of(source_of(label), lambda source: source.replace(text, changed))
    try:
        found = wrong(stated(label, registry.build, vars(module)[entry.function]))
    except Exception as error:
        found = str(error)
    assert found


class Once(ast.NodeTransformer):
    """Hands the value of one assignment to `CHANGED`."""

    def __init__(self, target: ast.Assign) -> None:
        self.place = target.lineno, target.col_offset

    def visit_Assign(self, node: ast.Assign) -> Any:
        if (node.lineno, node.col_offset) == self.place:
            node.value = ast.Call(ast.Name("CHANGED", ast.Load()), [node.value], [])
        return ast.fix_missing_locations(node)


def variables() -> list[tuple[Path, ast.Assign, str]]:
    """Every variable of a derivation, or of a section, that is no step's result."""
    found = []
    for path in sorted({source_of(label) for label in LABELS}):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            label = next(
                (
                    e.label
                    for e in entries().values()
                    if e.module.endswith(f".{path.stem}")
                    and e.function == getattr(node, "name", "")
                ),
                "",
            )
            for inner in (
                [node] if isinstance(node, ast.Assign) else ast.walk(node) if label else []
            ):
                if isinstance(inner, ast.Assign) and not ast.unparse(inner.value).startswith(
                    "d.step("
                ):
                    found.append((path, inner, label))
    return found


#: Twice the first of these is the same statement, since it is
SAME = {
    "a side of an equation whose other side is 0": (
        ("eq:Ttilde", "gap"),
        ("backward", "rest"),
        ("threshold", "logarithm"),
        ("eq:osc2", "model"),
    ),
    "in both parts of a quotient, or on both sides": (
        ("eq:Tsmall", "formula"),
        ("eq:S", "weight"),
        ("eq:S", "double"),
        ("eq:TtildetoT", "T"),
        ("eq:Ttilde0", "mode"),
        ("eq:FPE", "(g, q)"),
        ("release-time", "wave"),
        ("release-order", "frozen"),
        ("release-order", "scale"),
        ("release-order", "force"),
        ("frozen-time", "(D, lam)"),
    ),
    "nowhere used, the others are": (
        ("eq:scaledSDEx", "F"),
        ("eq:S", "(_, begin, *_)"),
    ),
    "infinite, or becomes so": (
        ("gaussian-step", "line"),
        ("first-three", "(inner, (low, high))"),
        ("first-three", "((low, _), outer)"),
        ("other-pieces", "(inner, outer)"),
    ),
    "something whose limit is 0": (
        ("eq:Ttildesmall", "(first, third)"),
        ("eq:Ttildesmall", "small"),
    ),
    "any place in an open range": (("eq:forcePWC", "third"),),
}


class NoExpression(Exception):
    """The variable holds nothing that can be wrong by a factor."""


def twice(x: Any) -> Any:
    """An expression that is no symbol, times 2; of a tuple the first."""
    if isinstance(x, (tuple, list)) and x:
        return type(x)([twice(x[0]), *x[1:]])
    if not isinstance(x, sympy.Expr) or x.is_Symbol:
        raise NoExpression
    return 2 * x


@pytest.mark.parametrize("every", [40, pytest.param(1, marks=pytest.mark.slow)])
def test_no_variable_changed_throughout_passes(every, capsys):
    tried, survivors, same = 0, [], {place for places in SAME.values() for place in places}
    for path, node, own in variables()[::every]:
        try:
            module = module_of(
                path, lambda text, n=node: Once(n).visit(ast.parse(text)), CHANGED=twice
            )
            labels = (
                [own]
                if own
                else [e.label for e in entries().values() if e.module.endswith(path.stem)]
            )
            found = ""
            for label in labels:
                function = vars(module)[entries()[label].function]
                try:
                    found = found or wrong(stated(label, registry.build, function))
                except NoExpression:
                    raise
                except Exception as error:
                    found = str(error) or "no value"
        except NoExpression:
            continue
        tried += 1
        if not found and (own, ast.unparse(node.targets[0])) not in same:
            survivors.append(f"{path.name}:{node.lineno}: {ast.unparse(node)[:80]}")
    with capsys.disabled():
        print(f"\n{tried} variables changed throughout, {len(survivors)} pass")
    assert not survivors
