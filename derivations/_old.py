"""For the time of the move: derivations as the old sections state them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from derivations.prose import TEX, TEX_OF
from symasym.derivation import Derivation, DerivationError, Outcome, Step, StepRecord
from symasym.derivation.checks import Check
from symasym.derivation.results import Statement


class PaperDerivation(Derivation):
    """A derivation that starts from what those it rests on concluded.

    `build` gives the derivation of a label, `holds` the truth of the numbers of a counterexample,
    by its name in `derivations.errata.evidence`. What is taken from another derivation is recorded,
    and `verify` refuses a derivation that rests on something it does not use.

    Attributes
    ----------
    order : int
        The order to which a series is derived; 0 for anything else.
    used : dict
        Label -> names of the steps that took something from it; "" as well for what was taken
        while steps were stated, and belongs to the next one and perhaps to later ones.
    """

    def __init__(
        self,
        label: str,
        title: str,
        rests_on: tuple[str, ...],
        build: Callable[[str], Derivation],
        holds: Callable[[str], bool],
        order: int = 0,
    ) -> None:
        known = TEX_OF.get(label) or TEX_OF.get(label.removesuffix(f"-{order}"), {})
        super().__init__(label, title, rests_on, TEX | known)
        self.order = order
        self._build = build
        self.holds = holds
        self.used: dict[str, set[str]] = {}
        self._at = ""
        self._pending: set[str] = set()

    def use(self, label: str, *left: str, step: str = "") -> Any:
        """The value that another derivation, which must be among `rests_on`, has of something.

        Parameters
        ----------
        label : str
        left : str
            The left side of what is asked for, as SymPy writes it; several give a tuple.
        step : str
            A step's name, for what that step states; then there is no left side.
        """
        if label not in self.rests_on:
            raise ValueError(f"{self.label} uses {label} without resting on it.")
        self.used.setdefault(label, set()).add(self._at)
        if not self._at:
            self._pending.add(label)
        other = self._build(label)
        if step:
            (stated,) = [s.result for s in other.steps if s.name == step]
            return stated
        found = tuple(value_of(other, name) for name in left)
        return found if len(left) > 1 else found[0]

    def step(
        self,
        name: str,
        rule: str,
        result: Statement,
        check: Check,
        reason: str = "",
        left: str | tuple[str, ...] = "",
    ) -> Any:
        """As `Derivation.step`; what was taken since the last step is recorded under this name."""
        for label in self._pending:
            self.used[label].add(name)
        self._pending.clear()
        return super().step(name, rule, result, check, reason, left)

    def verify(self) -> list[StepRecord]:
        """As `Derivation.verify`; what the derivation rests on must have been used."""
        records = super().verify()
        unused = [on for on in self.rests_on if on not in self.used]
        if unused:
            raise DerivationError(
                f"{self.label} rests on {', '.join(unused)} and uses nothing of it; "
                "use it, or leave it out."
            )
        return records

    def run_step(self, step: Step) -> Outcome:
        """The outcome of one step, with what it uses recorded under its name."""
        self._at = step.name
        try:
            return step.run()
        finally:
            self._at = ""


def value_of(derivation: Derivation, left: str) -> Any:
    """The right side that a derivation concluded for a left side, as SymPy writes that."""
    if derivation.result is None:
        raise ValueError(f"{derivation.label} has concluded nothing.")
    if isinstance(derivation.left, tuple):
        pairs = dict(zip(map(str, derivation.left), derivation.result, strict=True))
    else:
        pairs = {str(derivation.left): derivation.result}
    if left not in pairs:
        raise ValueError(f"{derivation.label} concludes {', '.join(pairs)}, not {left}.")
    return pairs[left]
