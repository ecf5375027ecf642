"""A drift in a formula: V, phi and A put in, and T, C, P and the stationary density exactly.

The exact quantities are one sweep of the layer in Gauss panels (positive-form, panel-step), in
logarithms. A panel is as long as lam V varies by 5 in it at most, its Legendre terms fall, and the
drift cannot turn unseen between its nodes: ``rate`` is the reciprocal of the length over which a
function in A may turn. Its cost grows with 1/kappa^2, and beyond 20,000 panels there is no value.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.emit.printing import Function, own, printer_of

if TYPE_CHECKING:
    from symasym.drift.drift import Drift

_U, _KAPPA, _R = Symbol("u", real=True), Symbol("kappa", positive=True), Symbol("r", positive=True)
_INSIDE = sympy.Max(-1, sympy.Min(1, _U))


def _log(helper: str, *first: Any) -> Any:
    """The exponential of a helper, whose last argument is the parameters."""
    return lambda p: sympy.exp(own(helper)(*first, p))


# Label -> functions: name, value for the parameters, arguments before them, what it is.
_EXACT: dict[str, tuple[tuple[str, Any, tuple[Symbol, ...], str], ...]] = {
    "eq:phi": (("phi", lambda p: own("drift")(_INSIDE, p), (_U,), "the drift"),),
    "eq:V": (("V", lambda p: own("potential")(1, _U, p), (_U,), "the potential, V(-1) = 0"),),
    "eq:Ttilde": (("Ttilde", _log("log_exit", _KAPPA, _R, 0), (_KAPPA, _R), "T from 0"),),
    "eq:C": (
        ("C", _log("log_exit", _KAPPA, _R, 1), (_KAPPA, _R), "C, leaving through -r from 0"),
        ("complement", _log("log_exit", _KAPPA, _R, -1), (_KAPPA, _R), "1 - C"),
    ),
    "eq:P": (
        ("P", _log("log_density", _KAPPA, 0, 1), (_KAPPA,), "P, the share of |u| <= 1"),
        ("complement", _log("log_density", _KAPPA, 0, -1), (_KAPPA,), "1 - P"),
    ),
    "eq:pss": (("pss", _log("log_density", _KAPPA, _U, 0), (_KAPPA, _U), "p_ss(u), stationary"),),
}


def put_in(functions: list[Function], label: str, drift: Drift) -> list[Function]:
    """The functions for a drift, whose free parameters are their last arguments."""
    parameters = tuple(Symbol(n, real=True) for n in drift.free)
    p = sympy.Tuple(*parameters)
    if exact := _EXACT.get("eq:P" if label == "eq:P2" else label):
        functions = [
            Function(name, first, (value(p),), f"{about} ({label})")
            for name, value, first, about in exact
        ]
    at_1 = own("potential")(1, 1, p)
    known = {"a_minus": own("end")(-1, p), "a_plus": own("end")(1, p), "V_1": at_1, "V1": at_1}

    def change(e: Expr) -> Expr:
        for name, value in (
            ("V", lambda u: own("potential")(1, u, p)),
            ("phi", lambda u: own("drift")(_INSIDE.subs(_U, u), p)),
            ("A", lambda u: own("drift")(u, p)),
        ):
            e = e.replace(lambda x, n=name: type(x).__name__ == n, lambda *x, f=value: f(*x))
        return e.xreplace({s: known[s.name] for s in e.free_symbols if s.name in known})

    found = []
    for f in functions:
        rest = tuple(s for s in f.arguments if s.name not in known)
        if twice := {s.name for s in rest} & {s.name for s in parameters}:
            raise InputError(
                f"the drift has a free parameter {min(twice)}, and so has {label}; rename it, or "
                "bind it."
            )
        found.append(replace(f, arguments=(*rest, *parameters)).each(change))
    return found


_TEXT = {
    "c": "static double {}(double u, const double *p)\n"
    "{{\n    (void)u; (void)p;\n    return {};\n}}\n",
    "javascript": "function {}(u, p) {{\n    return {};\n}}\n",
    "numpy": "def {}(u, p):\n    return {} + 0 * u",
}
_TEXT["mpmath"] = "def {}(u, p):\n    return numpy.frompyfunc(lambda u: {}, 1, 1)(u)"


def helpers_of(drift: Drift, target: str) -> dict[str, str]:
    """Source of ``drift(u, p)``, of its ends ``end(u, p)``, and of ``rate(u, p)``."""
    A = drift.expression()
    p = {Symbol(n, real=True): Symbol(f"p[{k}]", real=True) for k, n in enumerate(drift.free)}
    horner = sympy.horner(A, _U) if A.is_polynomial(_U) else A
    low, high = (sympy.expand(A.subs(_U, side)) for side in (-1, 1))  # rounded once
    ends = sympy.Piecewise((high, _U > 0), (low, True))
    printer = printer_of(target, ())
    return {
        name: _TEXT[target].format(name, re.sub(r"\s*\n\s*", " ", printer.doprint(e.xreplace(p))))
        for name, e in (("drift", horner), ("end", ends), ("rate", rate(A)))
    }


def rate(A: Expr) -> Expr:
    """1/length over which a function in A may turn: |g'|/(1 + |g|) of each f(g), g^n and n^g."""
    if A.is_polynomial(_U) and sympy.degree(A, _U) < 12:
        return S.Zero
    inner = (x.exp if x.is_Pow and x.exp.has(_U) else x.args[0]
             for x in sympy.preorder_traversal(A) if x.is_Function or x.is_Pow)  # fmt: skip
    return sum((abs(sympy.diff(g, _U)) / (1 + abs(g)) for g in inner), S.Zero)
