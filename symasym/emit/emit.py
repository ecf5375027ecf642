"""Writes a formula or an expression as functions in a programming language."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import sympy
from sympy import Expr, Rational
from sympy.printing.codeprinter import CodePrinter

from symasym.base.errors import InputError
from symasym.base.inputs import choice, exact, is_name, shown
from symasym.drift.drift import Drift
from symasym.drift.expressions import parse
from symasym.drift.scenes import require_drift
from symasym.emit.drifts import helpers_of, put_in
from symasym.emit.printing import SHAPES, TARGETS, Function, Source, by_printer, reserved, written


def source(
    what: Any,
    target: str | CodePrinter = "numpy",
    parameters: Mapping[str, Any] | None = None,
    *,
    drift: Drift | None = None,
    name: str = "f",
) -> Source:
    """The source code, as `symasym.emit` describes it, of anything but a label."""
    kind = "" if isinstance(target, CodePrinter) else choice("target", target, TARGETS)
    given = {} if parameters is None else parameters
    if not isinstance(given, Mapping):
        raise InputError(f"parameters is {shown(given)}; give a mapping from names to numbers.")
    values = {str(n): exact(str(n), x) for n, x in given.items()}
    if kind == "latex" and hasattr(what, "latex") and drift is None and not values:
        return Source(f"{what.latex()}\n", kind)
    label, functions = _functions(what, name)
    names = [f.name for f in functions]
    for f in functions:
        names += sorted(map(str, sympy.Tuple(f.arguments, f.values, f.shared).free_symbols))
    odd = [n for n in names if not is_name(n)]
    if odd := odd or sorted({f.name for f in functions} & reserved(kind)):
        raise InputError(
            f"{shown(odd[0])} is no name in code: letters, digits and _, and of a function no word "
            "of the language; rename it."
        )
    more: dict[str, str] = {}
    if drift is not None:
        require_drift(drift, bound=drift == Drift.general())
        drift = drift.bind(**{n: values.pop(n) for n in drift.free if n in values})
        functions = put_in(functions, label, drift)
        more = helpers_of(drift, kind) if kind in SHAPES else {}
    put = {s: Rational(*values[s.name].as_integer_ratio())
           for f in functions for s in f.arguments if s.name in values}  # fmt: skip
    if unknown := values.keys() - {s.name for s in put}:
        raise InputError(f"{min(unknown)} is no parameter of {label or name}; leave it out.")
    left = [tuple(s for s in f.arguments if s not in put) for f in functions]
    functions = [replace(f, arguments=a).each(lambda e: e.subs(put))
                 for f, a in zip(functions, left, strict=True)]  # fmt: skip
    if isinstance(target, CodePrinter):
        return by_printer(functions, target)
    if kind in SHAPES:
        return written(functions, kind, more)
    rows = (rf"\mathrm{{{f.name}}} &= {sympy.latex(v)}" for f in functions for v in f.values)
    return Source("\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}\n", kind)


def _functions(what: Any, name: str) -> tuple[str, list[Function]]:
    """The label and the functions of a formula or an expression."""
    label, values = getattr(what, "label", ""), ()
    several = list(what) if isinstance(what, (tuple, list)) else [what]
    if several and all(isinstance(f, Function) for f in several):
        return "", several
    if callable(getattr(what, "functions", None)):  # a Formula, an Expansion
        return label, [*(what.functions() if label else what.functions(name))]
    with suppress(sympy.SympifyError, TypeError, ValueError, AttributeError):
        values = tuple(parse("the expression", x) for x in several)
    if not values or not all(isinstance(v, Expr) for v in values):
        raise InputError(f"{shown(what)} is no formula, label or expression; give one of these.")
    symbols = sorted(sympy.Tuple(*values).free_symbols, key=str)
    return label, [Function(name, tuple(symbols), values)]
