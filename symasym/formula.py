"""A formula as a value: what it says, what it supposes, how wrong it is, how it was derived."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from symasym.records import Record, labels

if TYPE_CHECKING:
    from symasym.drift.drift import Drift


__all__ = ["Formula", "formula", "labels"]


@dataclass(frozen=True)
class Formula(Record):
    """One derived formula of the paper, as the derivations state it.

    Attributes
    ----------
    label : str
        The paper's equation label, or this project's name for a result without one.
    title : str
    assumptions : tuple of str
        The hypotheses, each with its status and where it holds or fails.
    error : str
        What the formula leaves out, and when.
    note : str
        What the symbols stand for that are not the problem's own.
    rests_on : tuple of str
        Labels of the formulas it was derived from.
    trace : tuple of dict
        The steps: name, rule, kind of check, how it is checked, reason, LaTeX.
    functions : tuple of str
        Names in `symasym.generated.numpy_formulas` and `mpmath_formulas`.
    """

    def emit(
        self,
        target: str = "numpy",
        parameters: Mapping[str, Any] | None = None,
        *,
        drift: Drift | None = None,
        patience: float | None = None,
    ) -> Any:
        """Source code of the formula: `symasym.emit` of it."""
        from symasym.emit import emit

        return emit(self, target, parameters, drift=drift, patience=patience)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def formula(label: str) -> Formula:
    """The formula of a label.

    Parameters
    ----------
    label : str
        A label of the paper (``"eq:Ttilde"``, ``"fr1"``) or a name from `labels`. That of a series
        may have an order from 1 to 8 behind it: ``"saddle-series-5"``, which is derived then.

    Raises
    ------
    InputError
        If there is no such formula, or the label is a definition.

    Examples
    --------
    >>> from symasym.formula import formula
    >>> formula("eq:Tlarge").error
    'O(r_phys^2), for sqrt(eps) <= kappa_phys < r_phys, so that eps < r_phys^2'
    >>> formula("folds").rests_on
    ('cubic', 'turning-points', 'beta')
    """
    if isinstance(label, str) and label not in labels() and label[-1:].isdecimal():
        from derivations import emit, registry

        with suppress(KeyError):
            registry.entry(label)
            return Formula.read(label, emit.statement_of(label))
    return Formula.of(label)
