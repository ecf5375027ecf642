"""Steps, the chain they form, its hypotheses, and the record of a run."""

from __future__ import annotations

import random
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from symasym.base.errors import SymasymError
from symasym.derivation.checks import Check
from symasym.derivation.results import Expansion, Outcome, Statement, latex, statement, text

RULES = (
    "define",
    "substitute",
    "integrate",
    "differentiate",
    "expand",
    "bound",
    "interchange",
    "take limit",
    "solve",
    "split",
    "scale",
    "project",
    "evaluate",
)

#: Ends of a left side that need no sign of equality.
RELATIONS = (r"\sim", r"\simeq", r"\to", r"\le", r"\ge", "=")
STATUSES = ("checked", "assumed", "fails")


class DerivationError(SymasymError, ArithmeticError):
    """A step whose check does not pass: which one, its check, both sides, and a point."""


@dataclass(frozen=True)
class Hypothesis:
    """A line of the ledger.

    Attributes
    ----------
    statement : str
    status : str
        ``"checked"``: `check` was run. ``"assumed"``: the paper's, or the
        problem's; nothing is claimed without it. ``"fails"``: it does not hold
        as the paper has it, `where` says where.
    where : str
        The range, the reason, or where it fails.
    check : callable, optional
        Returns True; needed for ``"checked"`` and for ``"fails"`` (where it
        returns True if the stated failure really happens).
    """

    statement: str
    status: str
    where: str = ""
    check: Callable[[], bool] | None = None

    def settle(self) -> bool:
        """Run the check; an assumed line has none."""
        return self.status == "assumed" or (self.check is not None and self.check() is True)


@dataclass(frozen=True)
class Step:
    """One step: its name, the rule, what it states, the check, a word of reason, the left side."""

    name: str
    rule: str
    result: Any
    check: Check
    reason: str = ""
    left: str | tuple[str, ...] = ""

    def latex(self, names: dict[Any, str]) -> str:
        """LaTeX of what the step states, behind its left side where it has one."""
        if not self.left:
            return latex(self.result, names)
        one = isinstance(self.left, str)
        pairs = [(self.left, self.result)] if one else zip(self.left, self.result, strict=True)
        return r" ,\quad ".join(
            f"{left} {'' if str(left).endswith(RELATIONS) else '= '}{latex(result, names)}"
            for left, result in pairs
        )

    def run(self, result: Statement | None = None, seed: int = 3) -> Outcome:
        """Check the stated result (or another one instead)."""
        stated = self.result if result is None else result
        try:
            return self.check.run(stated, random.Random(f"{seed} {self.name}"))
        except Exception as error:  # A check that breaks down has decided nothing.
            return Outcome(
                False,
                f"the check broke down: {type(error).__name__}: {error}",
                text(stated),
                "",
                "no point found",
            )


@dataclass(frozen=True)
class StepRecord:
    """The record of a step after a run, in plain text and LaTeX."""

    name: str
    rule: str
    kind: str
    how: str
    reason: str
    result: str
    latex: str
    passed: bool
    detail: str
    seconds: float


def _states(stated: Statement, result: Statement) -> bool:
    """True where a step's result is `result`, or has it as one of its pieces."""
    if stated is result or stated == result:
        return True
    return isinstance(stated, tuple) and any(_states(piece, result) for piece in stated)


def _checked(steps: list[Step], result: Statement) -> bool:
    """True where a step states `result`, or steps state every piece of it."""
    if any(_states(step.result, result) for step in steps):
        return True
    return isinstance(result, tuple) and all(_checked(steps, piece) for piece in result)


@dataclass
class Derivation:
    """A chain of steps from definitions to a result.

    Parameters
    ----------
    label : str
        The id of the formula, e.g. ``"eq:Ttilde"``.
    title : str
    rests_on : tuple of str
        Labels of derivations whose results are used.
    names : dict, optional
        Symbol -> LaTeX, for printing.

    Examples
    --------
    >>> import sympy
    >>> from symasym.derivation import Derivation, Identity
    >>> x = sympy.Symbol("x")
    >>> d = Derivation("square", "The square of a sum")
    >>> _ = d.step("expand", "expand", x**2 + 2*x + 1, Identity(lambda: sympy.expand((x + 1)**2)))
    >>> d.verify()[0].passed
    True
    """

    label: str
    title: str
    rests_on: tuple[str, ...] = ()
    names: dict[Any, str] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    left: Any = None
    result: Any = None
    error: str = "exact"
    note: str = ""
    cases: tuple[str, ...] = ()
    display: tuple[Any, ...] = ()

    def step(
        self,
        name: str,
        rule: str,
        result: Statement,
        check: Check,
        reason: str = "",
        left: str | tuple[str, ...] = "",
    ) -> Any:
        """Add a step; gives back its result, for the next one.

        `left` is the LaTeX of what the result is equal to, as the step is shown: one, or one for
        each piece. A relation other than equality stands at its end.
        """
        if rule not in RULES:
            raise ValueError(f"{rule!r} is no rule; the rules are {', '.join(RULES)}.")
        if any(s.name == name for s in self.steps):
            raise ValueError(f"{self.label} has two steps named {name!r}.")
        self.steps.append(Step(name, rule, result, check, reason, left))
        return result

    def suppose(
        self,
        statement: str,
        status: str = "assumed",
        where: str = "",
        check: Callable[[], bool] | None = None,
    ) -> None:
        """Add a hypothesis to the ledger."""
        if status not in STATUSES:
            raise ValueError(f"{status!r} is no status; use {', '.join(STATUSES)}.")
        if (status != "assumed") != (check is not None):
            raise ValueError(f"{statement!r}: 'checked' and 'fails' need a check, 'assumed' none.")
        self.hypotheses.append(Hypothesis(statement, status, where, check))

    def conclude(
        self,
        left: Statement,
        result: Statement,
        error: str = "exact",
        *,
        note: str = "",
        cases: tuple[str, ...] = (),
        display: tuple[Any, ...] = (),
    ) -> None:
        """State the formula.

        Parameters
        ----------
        left : expression or tuple
            The left side; a tuple goes with a tuple of results, one by one.
        result : expression, Expansion or tuple
            What one of the steps stated; of a tuple, each piece what one of them stated.
        error : str
            What is left out. An order, ``O(...)`` or ``relative O(...)``, that `result` does not
            show makes the equation an asymptotic one.
        note : str
            The meaning of symbols that are not the problem's own.
        cases : tuple of str
            LaTeX conditions, where `result` holds the pieces of one function.
        display : tuple
            The equation as it is written where that is not ``left = result``: LaTeX, and between
            it what steps stated.
        """
        stated = [part for part in display if not isinstance(part, str)]
        if not all(_checked(self.steps, part) for part in (result, *stated)):
            raise ValueError(f"{self.label} concludes something that no step has checked.")
        self.left, self.result, self.error = left, result, error
        self.note, self.cases, self.display = note, cases, display

    def latex(self) -> str:
        """The concluded formula in LaTeX."""
        if self.display:
            shown = (p if isinstance(p, str) else latex(p, self.names) for p in self.display)
            return "".join(shown)
        # An order that is left out and not shown makes the equation an asymptotic one.
        stated = self.result if isinstance(self.result, tuple) else (self.result,)
        is_shown = any(isinstance(part, Expansion) for part in stated)
        ordered = re.match(r"(relative |next term )?O\(", self.error)
        relation = r"\sim" if ordered and not is_shown else "="
        return statement(self.left, self.result, self.cases, self.names, relation)

    def verify(self) -> list[StepRecord]:
        """Run every check; raises at the first that does not pass.

        Raises
        ------
        DerivationError
            With the step, its check, both sides, and a point where they differ.
        """
        if not self.steps:
            raise DerivationError(f"{self.label} has no step; state at least one.")
        if self.result is None:
            self.result = self.steps[-1].result
        for line in self.hypotheses:
            if not line.settle():
                raise DerivationError(
                    f"{self.label}: the ledger says {line.status!r} of {line.statement!r}, "
                    "which its check does not confirm; correct the ledger or the hypothesis."
                )
        return [self._record(step) for step in self.steps]

    def run_step(self, step: Step) -> Outcome:
        """The outcome of one step's check."""
        return step.run()

    def _record(self, step: Step) -> StepRecord:
        """The record of a step whose check passes; a `DerivationError` for one that does not."""
        begun = time.perf_counter()
        outcome = self.run_step(step)
        seconds = time.perf_counter() - begun
        if not outcome.passed:
            raise DerivationError(
                f"{self.label}, step {step.name!r} ({step.rule}): the check "
                f"({step.check.kind}) fails: {outcome.detail}. Left: {outcome.left or '–'}. "
                f"Right: {outcome.right or '–'}. At: {outcome.point or '–'}. "
                f"Stated: {text(step.result)}. Correct the step or what it rests on."
            )
        return StepRecord(
            step.name,
            step.rule,
            step.check.kind,
            step.check.how(),
            step.reason,
            text(step.result, 2000),
            step.latex(self.names),
            True,
            outcome.detail,
            seconds,
        )
