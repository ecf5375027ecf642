"""The verb `emit`: a formula or an expression as a program, and that in a language."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import sympy

from symasym.base.call_context import symbolic
from symasym.base.errors import InputError
from symasym.base.inputs import exact, is_name, require_printable, shown
from symasym.derivation.results import latex, parts
from symasym.drift.expressions import sympified
from symasym.emit.forms import quotients
from symasym.emit.program import Case, Function, Program, fold, require_closed
from symasym.emit.source import Source, check_target, rendered
from symasym.records import Record
from symasym.scenes import require_drift

if TYPE_CHECKING:
    from sympy import Expr

    from symasym.drift.drift import Drift

__all__ = ["emit"]


@symbolic
def emit(
    what: Record | Any,
    target: str = "numpy",
    parameters: Mapping[str, Any] | None = None,
    *,
    drift: Drift | None = None,
    method: Literal["exact"] | None = None,
    name: str = "f",
    patience: float | None = None,
) -> Source:
    """Source code of a formula or an expression.

    Parameters
    ----------
    what : Formula, label, or SymPy expression
        A formula of `symasym.formula` or its label, or an expression of your own: a SymPy
        expression (Piecewise included) or a tuple of them.
    target : {"numpy", "mpmath", "python", "c", "javascript", "latex"}
        Or one that `symasym.emit.add_target` has added.
    parameters : mapping of str to number, optional
        Put into the formula exactly (see `symasym.base.inputs.exact`); what vanishes is left out.
        Floats stand for their binary values, ``"-0.4"`` for -2/5.
    drift : Drift, optional
        For the formulas that hold a general drift: phi (``"eq:phi"``), V (``"eq:V"``), the escape
        time (``"eq:Ttilde"``), also in weak noise (``"eq:Ttildesmall"``), the stationary density
        (``"eq:pss"``) and others. Its free parameters become arguments.
    method : {"exact"}, optional
        Of ``"eq:Ttilde"`` with a drift: T itself (to any number of digits in ``"mpmath"``).
        Expansions are emitted by `symasym.Expansion.emit`.
    name : str
        What to call the function of an expression.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    Source
        A str, with `write` and `load`. In scaled variables, as everywhere.

    Raises
    ------
    InputError
        For an unknown label or target, an unknown or impossible parameter, an expression that
        holds integrals, general functions, or functions that some language lacks.

    Notes
    -----
    Where an exponential could overflow, the logarithm is emitted too, as ``log_NAME``, and the
    value is its exponential.

    Examples
    --------
    >>> import symasym as sa
    >>> code = sa.emit("eq:Plarge2", "c", parameters={"a_minus": 1, "a_plus": -1})
    >>> print(code[code.rindex("double strong") :].rstrip())
    double strong_noise_occupation(double kappa)
    {
        return 2.0/pow(kappa, 2.0);
    }
    >>> sa.emit("constant-drift").load().constant_drift_time(0.5, 10, [0, 1e-300, 2.0])
    array([400., 400.,   5.])
    """
    check_target(target)
    if isinstance(what, str):
        what = Record.of(what)
    numbers = _numbers(parameters)
    if drift is not None:
        require_drift(drift, bound=False)
        require_printable(drift.values)
    if drift is None and method is not None:
        raise InputError("method is for a formula with a drift in it; give drift=….")
    if isinstance(what, Record):
        if drift is not None:
            from symasym.emit.drifts import program as with_drift

            return rendered(with_drift(what, drift, numbers, method), target)
        program = _of_formula(what)
    else:
        if drift is not None:
            raise InputError("drift is for formulas with a label; put it into the expression.")
        program = _of_expression(what, name)
    if target != "latex":
        require_closed(program)
    return rendered(fold(program, numbers), target)


def _numbers(parameters: Mapping[str, Any] | None) -> dict[str, Any]:
    """The parameters' values by name."""
    if parameters is not None and not isinstance(parameters, Mapping):
        raise InputError(
            f"parameters is {shown(parameters)}; give a dict of values by name, as {{'mu': 3}}."
        )
    read = {name: exact(name, value) for name, value in (parameters or {}).items()}
    require_printable(read)
    return quotients(read)


def _of_formula(formula: Record) -> Program:
    """The functions that the derivations emit, or one function of all symbols."""
    functions = tuple(
        Function(
            item["name"],
            item["doc"],
            tuple(item["arguments"]),
            (Case(item["values"]),),
            latex=item["latex"],
            left=tuple(item["left"]),
            names=item["names"],
        )
        for item in formula.code
    )
    label = formula.label
    program = Program(
        label, formula.title, functions, formula.error, formula.note, formula.assumptions,
        formula.latex(),
    )  # fmt: skip
    if functions:
        return program
    whole = _function(program.name, formula.title, formula.expression)
    left = tuple(latex(side, dict(formula.names)) for side in parts(formula.left))
    return replace(program, functions=(replace(whole, latex="", left=left, names=formula.names),))


def _of_expression(what: Any, name: str) -> Program:
    try:
        several = isinstance(what, (list, tuple))
        e = sympy.Tuple(*map(sympified, what)) if several else sympified(what)
    except (sympy.SympifyError, TypeError, ValueError, AttributeError):
        e = None
    if not isinstance(e, (sympy.Basic, sympy.MatrixBase)) or isinstance(e, (sympy.Set, sympy.Dict)):
        raise InputError(
            f"{shown(what)} is no formula, label or SymPy expression; give one of these."
        )
    try:
        text = sympy.sstr(e)
    except ValueError:  # Python's limit of digits
        raise InputError(
            f"{shown(what)} has a whole number of more than 4,300 digits; give it shorter numbers."
        ) from None
    return Program("expression", text[:400], (_function(name, text[:80], e),))


def _function(name: str, doc: str, expression: Expr | Sequence[Expr]) -> Function:
    """A function of all symbols; a Piecewise becomes its cases."""
    from symasym.derivation.results import parts

    values = tuple(parts(expression))
    if not values:
        raise InputError(f"{name} is empty; give an expression, or a tuple of some.")
    arguments = tuple(sorted({s.name for e in values for s in e.free_symbols}))
    # What is written into code is a name, and nothing that ends a line or a comment.
    for argument in arguments:
        if not is_name(argument):
            raise InputError(
                f"{name} has the symbol {shown(argument)}; give symbols names of letters, digits "
                "and _."
            )
    if any(v.is_Relational or v.is_Boolean for v in values):
        raise InputError(f"{name} is a condition and no number; emit a number.")
    if len(values) > 1 or not values[0].has(sympy.Piecewise):
        return Function(name, doc, arguments, (Case(values),))
    whole = sympy.piecewise_fold(values[0])
    cases = []
    for value, condition in whole.args:
        if value.has(sympy.Piecewise):
            raise InputError(f"{name} has cases within cases; fold them with piecewise_fold.")
        if isinstance(condition, sympy.Or):
            cases += [Case((value,), _all_of(c)) for c in condition.args]
        else:
            cases.append(Case((value,), _all_of(condition)))
    return Function(name, doc, arguments, tuple(cases))


def _all_of(condition: Any) -> tuple[Any, ...]:
    if condition == sympy.true:
        return ()
    return tuple(condition.args) if isinstance(condition, sympy.And) else (condition,)
