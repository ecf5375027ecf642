"""A formula as a value: what it says, what it supposes, how wrong it is, how it was derived."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError

if TYPE_CHECKING:
    from symasym.derivation.derivation import Derivation, Step
    from symasym.drift.drift import Drift

__all__ = ["Formula", "formula", "labels"]

#: The arguments that come first, in this order; all others follow by name.
_FIRST = ("u", "v", "kappa", "r", "epsilon", "mu", "alpha", "z0", "a_minus", "a_plus")


@dataclass(frozen=True)
class Formula:
    """One derived formula of the paper, as its derivation states it. Sentences are TeX.

    Attributes
    ----------
    label : str
        The paper's equation label, or this project's name for a result without one.
    title : str
    assumptions : tuple of str
        What it supposes, and conditions as printed that are not enough, with what shows it.
    error : str
        What the formula leaves out, and when.
    note : str
        What its own symbols mean.
    rests_on : tuple of str
        Labels of the formulas it was derived from.
    steps : tuple of Step
        Each with ``name``, ``left``, ``right``, ``why`` and ``latex()``.
    """

    label: str
    title: str
    assumptions: tuple[str, ...]
    error: str
    note: str
    rests_on: tuple[str, ...]
    steps: tuple[Step, ...] = field(repr=False)
    _derivation: Derivation = field(repr=False)

    @property
    def concluded(self) -> tuple[Step, ...]:
        """The steps that state it."""
        return self._derivation.concluded

    @property
    def left(self) -> Any:
        """The left side, as SymPy or LaTeX; a tuple where it says several things."""
        sides = tuple(step.left for step in self.concluded)
        return sides[0] if len(sides) == 1 else sides

    @property
    def expression(self) -> Any:
        """The right side as a SymPy expression; a tuple where it says several things."""
        return self._derivation.right()

    def latex(self) -> str:
        """``left = right`` in LaTeX, with the order of what is left out."""
        return self._derivation.latex()

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def functions(self) -> tuple[Any, ...]:
        """What it says as `symasym.emit.Function` objects, one for each right side."""
        from sympy import Tuple

        from symasym.emit import Function

        found = []
        for step in self.concluded:
            name = self.label.removeprefix("eq:")
            name = _plain(name if len(self.concluded) == 1 else f"{name}_{step.name}")
            value, arguments = _named(step.right)
            values = tuple(value) if isinstance(value, Tuple) else (value,)
            found.append(Function(name, arguments, values, f"{self.label}: {self.title}."))
        return tuple(found)

    def emit(
        self, target: str = "numpy", parameters: Any = None, *, drift: Drift | None = None
    ) -> Any:
        """Source code of the formula: `symasym.emit` of it."""
        from symasym.emit import emit

        return emit(self, target, parameters, drift=drift)

    def lambdify(self, module: str = "mpmath", *, drift: Drift | None = None) -> Callable[..., Any]:
        """The formula as a function of ``"mpmath"`` or ``"numpy"`` numbers.

        Of a formula that says several things it is the first.
        """
        source = self.emit(module, drift=drift)
        function: Callable[..., Any] = getattr(source.load(), source.functions[0])
        return function


def _plain(text: str) -> str:
    """A name in code."""
    text = text.replace("^-", "_minus").replace("^+", "_plus").replace("'", "d")
    return re.sub(r"\W+", "_", text).strip("_") or "value"


def _named(e: Any) -> tuple[Any, tuple[Any, ...]]:
    """An expression with names that a program can have, and its symbols in order."""
    from sympy import Symbol

    def place(s: Any) -> tuple[int, str]:
        return _FIRST.index(s.name) if s.name in _FIRST else len(_FIRST), s.name

    known = sorted(e.free_symbols, key=place)
    names = {s: Symbol(_plain(s.name), **s._assumptions_orig) for s in known}
    return e.xreplace(names), tuple(names.values())


def labels() -> tuple[str, ...]:
    """Every label that `formula` knows."""
    import derivations.sections  # noqa: F401
    from symasym.derivation.derivation import LABELS

    return tuple(LABELS)


def formula(label: str) -> Formula:
    """The formula of a label, built from its derivation.

    Parameters
    ----------
    label : str
        A label of the paper (``"eq:Ttilde"``, ``"fr1"``) or a name from `labels`. That of a series
        may have an order behind it: ``"saddle-series-5"``, which is derived then.

    Raises
    ------
    InputError
        If there is no such formula, or the label is a definition.

    Examples
    --------
    >>> from symasym.formula import formula
    >>> formula("folds").rests_on
    ('cubic', 'turning-points', 'beta')
    """
    from derivations.labels import DEFINITIONS
    from symasym.derivation.derivation import build

    if label in DEFINITIONS:
        raise InputError(f"{label} defines {DEFINITIONS[label][1]}: there is nothing to derive.")
    labels()
    try:
        d = build(label)
    except KeyError as missing:
        if missing.args != (label,):
            raise
        raise InputError(f"{label!r} is no formula; give one of sa.labels().") from None
    return Formula(
        label, d.title, tuple(_conditions(d)), d.leaves_out(), d.note, tuple(d.rests_on),
        tuple(d.steps), d,
    )  # fmt: skip


def _conditions(d: Derivation) -> Iterator[str]:
    for statement, check, fails in d.supposed:
        kind = "Does not hold" if fails else "Checked" if check else "Assumes"
        yield f"{kind}: {statement}" + (f" ({fails})" if fails else "")
