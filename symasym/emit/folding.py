"""Numbers put into a program, and what they make vanish."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import sympy

from symasym.base.errors import InputError
from symasym.emit.forms import as_printed, removable
from symasym.emit.program import Function, Program

if TYPE_CHECKING:
    from sympy import Expr


def fold(program: Program, parameters: Mapping[str, Any]) -> Program:
    """The program with these numbers in it: what they make vanish is left out and said.

    Raises
    ------
    InputError
        For an unknown name, a number against the formula's assumptions, or where nothing is left.
    """
    if not parameters:
        return program
    symbols = {s for function in program.functions for s in function.symbols}
    known = sorted({s.name for s in symbols})
    for name, value in parameters.items():
        if name not in known:
            raise InputError(
                f"{name} is no parameter of {program.label}; its parameters are "
                f"{', '.join(known) or 'none at all'}."
            )
        for s in symbols:
            if s.name == name and ((s.is_positive and value < 0) or (s.is_negative and value > 0)):
                side = "positive" if s.is_positive else "negative"
                raise InputError(f"{name} is {value}; {program.label} supposes that it is {side}.")
    numbers = {s: parameters[s.name] for s in symbols if s.name in parameters}
    kept, gone = [], list(program.left_out)
    given = ", ".join(f"{name} = {value}" for name, value in sorted(parameters.items()))
    for function in program.functions:
        folded, why = _folded(function, numbers, given)
        gone += [w for w in why if w not in gone]
        if folded is not None:
            kept.append(folded)
    if not kept:
        raise InputError(f"{program.label} has no value at {given}; leave that parameter free.")
    return replace(
        program, functions=tuple(kept), left_out=tuple(gone),
        folded={**program.folded, **parameters},
    )  # fmt: skip


def _folded(
    function: Function, numbers: Mapping[Any, Any], given: str
) -> tuple[Function | None, list[str]]:
    """The function with the numbers in it, None where it has no value; and what is dropped, in
    sentences.
    """
    if function.quadrature is not None or function.first_passage is not None:
        return function, []
    gone: list[str] = []
    parts = []
    for cases in (function.cases, function.logs):
        kept = []
        for case in cases:
            open_ = _settled(case.conditions, numbers)
            if open_ is None:
                what = case.name or "a case"
                gone.append(f"{what} of {function.name}, which does not occur for {given}")
                continue
            values = tuple(removable(v).subs(numbers) for v in case.values)
            if any(_without_value(v) for v in values):
                return None, [f"{function.name}, which has no real value for {given}"]
            gone += [
                f"{term} in {function.name}, which is 0 for {given}"
                for v in case.values
                for term in _vanishing(v, numbers)
            ]
            shared = tuple((s, e.subs(numbers)) for s, e in case.shared)
            kept.append(replace(case, values=values, conditions=open_, shared=shared))
            if not open_:
                break
        parts.append(tuple(kept))
    if not parts[0]:
        return None, [f"{function.name}: {function.outside} ({given})"]
    # What does not stand in a logarithm's form any more need not have one.
    return replace(function, cases=parts[0], logs=parts[1]), list(dict.fromkeys(gone))


def _settled(conditions: tuple[Any, ...], numbers: Mapping[Any, Any]) -> tuple[Any, ...] | None:
    """The conditions that are still open; None where one fails (later ones may have no value)."""
    still_open = []
    for condition in conditions:
        condition = condition.subs(numbers)
        if condition == sympy.false:
            return None
        if condition != sympy.true:
            still_open.append(condition)
    return tuple(still_open)


def _without_value(e: Expr) -> bool:
    """True of an expression that is infinite or not real."""
    if e.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
        return True
    return bool(
        e.is_real is False or (not e.free_symbols and abs(sympy.im(sympy.N(as_printed(e)))) > 1e-10)
    )


def _vanishing(e: Expr, numbers: Mapping[Any, Any]) -> Iterable[str]:
    """Terms of sums that become 0."""
    for node in sympy.preorder_traversal(e):
        if node.is_Add:
            for term in node.args:
                if not term.is_number and term.subs(numbers) == 0:
                    yield str(term)
