"""A derived formula with its assumptions, its error and its derivation; its source code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError
from symasym.base.inputs import shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from symasym.base.inputs import Number
    from symasym.derivation.derivation import Derivation
    from symasym.drift.drift import Drift
    from symasym.emit import Source

__all__ = ["Formula", "emit", "formula", "labels"]

#: The arguments that come first, in this order; all others follow in alphabetical order.
_FIRST = ("u", "v", "kappa", "r", "epsilon", "mu", "alpha", "z0", "a_minus", "a_plus")


class Formula:
    """A formula of the paper with its derivation. Texts are in TeX.

    Attributes
    ----------
    label : str
        The label of the equation in the paper, or a name for a result that has none there.
    title : str
    assumptions : tuple of str
        The assumptions; conditions in the paper that are not sufficient have a counterexample.
    error : str
        The terms that the formula omits, and in which limit.
    note : str
        The meaning of symbols that occur only in this formula.
    rests_on : tuple of str
        The labels of the formulas from which it was derived.
    steps, concluded : tuple of Step
        All steps, and those that state the result: ``name``, ``left``, ``right``, ``why``,
        ``latex()``.
    """

    def __init__(self, d: Derivation) -> None:
        self.label, self.title, self.error, self.note = d.label, d.title, d.leaves_out(), d.note
        self.rests_on, self.steps, self.concluded = tuple(d.rests_on), tuple(d.steps), d.concluded
        self.assumptions = tuple(
            f"{'Does not hold' if fails else 'Checked' if check else 'Assumes'}: {text}"
            + f" ({fails})" * bool(fails)
            for text, check, fails in d.supposed
        )
        self._derivation = d

    def __repr__(self) -> str:
        return f"Formula({self.label!r}, {self.title!r})"

    @property
    def expression(self) -> Any:
        """The right side as a SymPy expression; a tuple if the formula has several equations."""
        return self._derivation.right()

    def latex(self) -> str:
        """``left = right`` in LaTeX, with the order of the omitted terms."""
        return self._derivation.latex()

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def functions(self) -> tuple[Any, ...]:
        """The right sides of the formula as `symasym.emit.Function` objects."""
        from sympy import Tuple

        from symasym.emit import Function

        def place(s: Any) -> tuple[int, str]:
            return _FIRST.index(s.name) if s.name in _FIRST else len(_FIRST), s.name

        found, about = [], f"{self.label}: {self.title}."
        for step in self.concluded:
            name = self.label.removeprefix("eq:") + f"_{step.name}" * (len(self.concluded) > 1)
            known, value = tuple(sorted(step.right.free_symbols, key=place)), step.right
            values = tuple(value) if isinstance(value, Tuple) else (value,)
            found.append(Function(name, known, values, about).in_code())
        return tuple(found)

    def emit(self, target: str = "numpy", parameters: Any = None, **more: Any) -> Any:
        """Source code of the formula, by `symasym.emit`."""
        from symasym.emit import source

        return source(self, target, parameters, **more)

    def lambdify(self, module: str = "mpmath", **more: Any) -> Any:
        """The formula, or its first equation, as a function of mpmath's or NumPy's numbers."""
        source = self.emit(module, **more)
        return getattr(source.load(), source.functions[0])


def labels() -> tuple[str, ...]:
    """All labels that `formula` accepts."""
    import derivations.sections  # noqa: F401
    from symasym.derivation.derivation import MODULES

    return tuple(MODULES)


def formula(label: str) -> Formula:
    """The formula with a label, from its derivation, which is carried out.

    Parameters
    ----------
    label : str
        A label of the paper (``"eq:Ttilde"``, ``"fr1"``) or a name from `labels`. The label of a
        series may end with an order, to which it is then derived: ``"saddle-series-5"``.

    Raises
    ------
    InputError
        If there is no such formula, or the label is that of a definition.

    Examples
    --------
    >>> from symasym.formula import formula
    >>> formula("folds").rests_on
    ('cubic', 'turning-points', 'beta')
    """
    import derivations.sections  # noqa: F401
    from derivations.labels import DEFINITIONS
    from symasym.derivation.derivation import build

    try:
        return Formula(build(str(label)))
    except KeyError as missing:
        told = "is no formula; give one of those that labels() or the command show lists."
        if str(label) in DEFINITIONS:
            told = f"defines {DEFINITIONS[label][1]}: there is nothing to derive."
        raise InputError(f"{shown(label)} {told}") from missing


def emit(
    what: Any,
    target: Any = "numpy",
    parameters: Mapping[str, Number] | None = None,
    *,
    drift: Drift | None = None,
    name: str = "f",
) -> Source:
    """Source code of a formula or an expression, as functions of scaled variables.

    Parameters
    ----------
    what : label, Formula, Expansion, or SymPy expression
        Or a tuple of expressions, or a list of `Function`; they form one file.
    target : {"numpy", "mpmath", "c", "javascript", "latex"} or a CodePrinter of SymPy
    parameters : mapping of str to number, optional
        Substituted exactly: ``"-0.4"`` is -2/5.
    drift : Drift, optional
        Substituted into a formula in V, phi or A. T (``"eq:Ttilde"``), C (``"eq:C"``), P
        (``"eq:P"``) and the stationary density (``"eq:pss"``) are then exact. Its free parameters
        become arguments.
    name : str
        The name of the function for an expression.

    Notes
    -----
    If an exponential may overflow, the logarithm is emitted, too, as ``log_NAME``. A value that
    does not exist is nan; in Python a ValueError is raised if no element of an array has one.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.emit("constant-drift", "c", {"a": 2}).functions[0]
    'constant_drift_from_0'
    """
    from symasym.emit import source

    return source(
        formula(what) if isinstance(what, str) else what, target, parameters, drift=drift, name=name
    )
