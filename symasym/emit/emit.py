"""Writes a formula or an expression as functions in a programming language.

A drift is substituted into formulas in V, phi and A; T, C, P and p_ss are then exact. They take one
sweep of the layer in Gauss panels (positive-form, panel-step), in logarithms. A panel is so short
that lam V varies by at most 4, its Legendre coefficients decay, and the drift cannot turn between
its nodes: ``rate`` is the reciprocal of the length over which a function in A may turn. The cost
grows like 1/kappa^2; beyond 20,000 panels there is no value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import sympy
from sympy import Expr, Rational, S, Symbol
from sympy.core.function import AppliedUndef
from sympy.printing.codeprinter import CodePrinter

from symasym.base.errors import InputError
from symasym.base.inputs import choice, exact, is_name, mapping, shown
from symasym.drift.drift import Drift
from symasym.drift.expressions import parse
from symasym.drift.scenes import require_drift
from symasym.emit.printing import (
    SHAPES,
    TARGETS,
    Function,
    Source,
    in_common,
    own,
    printer_of,
    reserved,
    written,
)


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
    given = mapping("parameters", {} if parameters is None else parameters)
    values = {n: exact(n, x) for n, x in given.items()}
    if kind == "latex" and hasattr(what, "latex") and drift is None and not values:
        return Source(f"{what.latex()}\n", kind)
    label, functions = _functions(what, name)
    names = [str(s) for f in functions for s in (f.name, *f.arguments)]
    odd = [n for n in (name, *names) if not is_name(n)]
    if odd := odd or sorted({f.name for f in functions} & reserved(kind)):
        raise InputError(
            f"{shown(odd[0])} is no name in code: letters, digits and _, and of a function no word "
            "of the language; rename it."
        )
    more: dict[str, str] = {}
    if drift is not None:
        require_drift(drift, bound=drift == Drift.general())
        drift = drift.bind(**{n: values.pop(n) for n in drift.free if n in values})
        functions = _with_drift(functions, label, drift)
        more = _of_drift(drift, kind) if kind in SHAPES else {}
    put = {s: Rational(*values[s.name].as_integer_ratio())
           for f in functions for s in f.arguments if s.name in values}  # fmt: skip
    if unknown := values.keys() - {s.name for s in put}:
        raise InputError(f"{min(unknown)} is no parameter of {label or name}; leave it out.")
    left = [tuple(s for s in f.arguments if s not in put) for f in functions]
    functions = [replace(f, arguments=a).each(lambda e: e.subs(put))
                 for f, a in zip(functions, left, strict=True)]  # fmt: skip
    if isinstance(target, CodePrinter):
        return _by_printer(functions, target)
    if kind in SHAPES:
        return written(functions, kind, more)
    rows = (rf"\mathrm{{{f.name}}} &= {sympy.latex(v)}" for f in functions for v in f.values)
    return Source("\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}\n", kind)


def _functions(what: Any, name: str) -> tuple[str, list[Function]]:
    """The label and the functions of a formula or an expression."""
    label, values = getattr(what, "label", ""), ()
    several = list(what) if isinstance(what, (tuple, list)) else [what]
    if callable(getattr(what, "functions", None)):  # a Formula, an Expansion
        several = [*(what.functions() if label else what.functions(name))]
    if several and all(isinstance(f, Function) for f in several):
        return label, several
    with suppress(sympy.SympifyError, TypeError, ValueError, AttributeError):
        values = tuple(parse("the expression", x) for x in several)
    if not values or not all(isinstance(v, Expr) for v in values):
        raise InputError(f"{shown(what)} is no formula, label or expression; give one of these.")
    symbols = sorted(sympy.Tuple(*values).free_symbols, key=str)
    return label, [Function(name, tuple(symbols), values)]


def _by_printer(functions: list[Function], printer: CodePrinter) -> Source:
    """Assignments in the language of a printer supplied by the caller."""
    lines = []
    for f in functions:
        shared, values = in_common(f.values, sympy.numbered_symbols("t"))
        names = [f"{f.name}_{k}" for k in range(len(values))] if values[1:] else [f.name]
        rows = (*f.shared, *shared, *zip(map(Symbol, names), values, strict=True))
        lines += [printer.doprint(v, assign_to=s) for s, v in rows]
    return Source("\n".join(lines) + "\n", type(printer).__name__)


# -- a drift ---------------------------------------------------------------------------------------

_U, _KAPPA, _R = Symbol("u", real=True), Symbol("kappa", positive=True), Symbol("r", positive=True)
_P = Symbol("p")  # the tuple of the drift's free parameters
_INSIDE = {"A": lambda u: u, "phi": lambda u: sympy.Max(-1, sympy.Min(1, u))}


def _exit(sign: int) -> Expr:
    return sympy.exp(own("log_exit")(_KAPPA, _R, sign, _P))


def _density(u: Any, sign: int) -> Expr:
    return sympy.exp(own("log_density")(_KAPPA, u, sign, _P))


# Label -> arguments in front of the drift's, and functions: T, C or P, and 1 - C or 1 - P.
_EXACT: dict[str, tuple[tuple[Symbol, ...], dict[str, Expr]]] = {
    "eq:phi": ((_U,), {"phi": own("drift")(_INSIDE["phi"](_U), _P)}),
    "eq:V": ((_U,), {"V": own("potential")(1, _U, _P)}),
    "eq:Ttilde": ((_KAPPA, _R), {"Ttilde": _exit(0)}),
    "eq:C": ((_KAPPA, _R), {"C": _exit(1), "complement": _exit(-1)}),
    "eq:P": ((_KAPPA,), {"P": _density(0, 1), "complement": _density(0, -1)}),
    "eq:pss": ((_KAPPA, _U), {"pss": _density(_U, 0)}),
}
_EXACT["eq:P2"] = _EXACT["eq:P"]
_KNOWN = {"a_minus": own("end")(-1, _P), "a_plus": own("end")(1, _P)}
_KNOWN |= dict.fromkeys(("V_1", "V1"), own("potential")(1, 1, _P))


def _with_drift(functions: list[Function], label: str, drift: Drift) -> list[Function]:
    """The functions for a drift, with its free parameters as their last arguments."""
    parameters = tuple(Symbol(n, real=True) for n in drift.free)
    if label in _EXACT:
        first, exact = _EXACT[label]
        functions = [Function(n, first, (v,), f"{n} of {label}, exact") for n, v in exact.items()]

    def change(e: Expr) -> Expr:
        put = {s: _KNOWN[s.name] for s in e.free_symbols if s.name in _KNOWN}
        for x in e.atoms(AppliedUndef):
            if (of := _INSIDE.get(type(x).__name__)) is not None:
                put[x] = own("drift")(of(*x.args), _P)
        return e.xreplace(put).xreplace({_P: sympy.Tuple(*parameters)})

    found = []
    for f in functions:
        rest = tuple(s for s in f.arguments if s.name not in _KNOWN)
        if twice := {s.name for s in rest} & {s.name for s in parameters}:
            raise InputError(f"{label} has a {min(twice)} of its own; bind that of the drift.")
        found.append(replace(f, arguments=(*rest, *parameters)).each(change))
    return found


_TEXT = {
    "c": "static double {}(double u, const double *p)\n"
    "{{\n    (void)u; (void)p;\n    return {};\n}}\n",
    "javascript": "function {}(u, p) {{\n    return {};\n}}\n",
    "numpy": "def {}(u, p):\n    return {} + 0 * u",
    "mpmath": "def {}(u, p):\n    return numpy.frompyfunc(lambda u: {}, 1, 1)(u)",
}


def _of_drift(drift: Drift, target: str) -> dict[str, str]:
    """The source of ``drift(u, p)``, of its outer values ``end(u, p)``, and of ``rate(u, p)``."""
    A = drift.expression()
    p = {Symbol(n, real=True): Symbol(f"p[{k}]", real=True) for k, n in enumerate(drift.free)}
    horner = sympy.horner(A, _U) if A.is_polynomial(_U) else A
    low, high = (sympy.expand(A.subs(_U, side)) for side in (-1, 1))  # rounded once
    ends = sympy.Piecewise((high, _U > 0), (low, True))
    printer = printer_of(target, ())
    return {
        name: _TEXT[target].format(name, re.sub(r"\s*\n\s*", " ", printer.doprint(e.xreplace(p))))
        for name, e in (("drift", horner), ("end", ends), ("rate", _rate(A)))
    }


def _rate(A: Expr) -> Expr:
    """The sum of |g'|/(1 + |g|) over all f(g), g^n and n^g in A, which may turn over 1/rate."""
    if A.is_polynomial(_U) and sympy.degree(A, _U) < 12:
        return S.Zero
    inner = (x.exp if x.is_Pow and x.exp.has(_U) else x.args[0]
             for x in sympy.preorder_traversal(A) if x.is_Function or x.is_Pow)  # fmt: skip
    return sum((abs(sympy.diff(g, _U)) / (1 + abs(g)) for g in inner), S.Zero)
