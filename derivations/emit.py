"""The code and data that the derivations emit: `symasym/generated/`, compared by a test.

``python -m derivations.emit`` writes it afresh.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import sympy

from derivations.labels import DEFINITIONS
from derivations.registry import build, closure, entries
from derivations.runner import describe
from symasym.base.files import write_bytes
from symasym.derivation import Expansion
from symasym.derivation.code import function
from symasym.derivation.results import latex, parts

FOLDER = Path(__file__).parent.parent / "symasym" / "generated"
FORMAT = "symasym-formulas/1"


@dataclass(frozen=True)
class Emitted:
    """A function to emit: its name, where its expression comes from, what it is.

    One that is `plain` needs no functions, and holds for any numbers: exact fractions, balls,
    double-double pairs, SymPy expressions.
    """

    name: str
    label: str
    doc: str
    step: str = ""
    piece: int | None = None
    plain: bool = False


# fmt: off
EMITTED = (
    Emitted("scaled_noise", "eq:tildexykappa", "kappa/sqrt(eps), the noise in scaled variables.",
            piece=2),
    Emitted("scaled_radius", "eq:tilder", "r/eps, the radius in scaled variables.", plain=True),
    Emitted("potential_left", "eq:V2", "V(u) for u <= -1.", piece=0),
    Emitted("potential_right", "eq:V2", "V(u) for u >= 1.", piece=2),
    Emitted("log_exit_share", "positive-form", "log C from sigma.", "logarithm of C"),
    Emitted("log_occupation_share", "positive-density",
            "log P from the integrals inside and outside.", "logarithm of the occupation"),
    Emitted("constant_single", "constant-panel", "int_e = int_inverse, per width.", piece=0),
    Emitted("constant_nested_down", "constant-panel", "nested where V falls, per width^2.",
            piece=1),
    Emitted("constant_nested_up", "constant-panel", "nested where V rises, per width^2.", piece=2),
    Emitted("carried", "panel-step", "sigma and w after a panel.", "scaled", plain=True),
    Emitted("absorbed", "panel-step", "sigma and w after a panel that begins at an absorbing end.",
            "from an absorbing end", plain=True),
    Emitted("constant_drift_time", "constant-drift", "T for a constant drift a.", "from 0"),
    Emitted("constant_drift_exit", "constant-drift", "C for a constant drift a.",
            "exit through -r, from 0"),
    Emitted("exit_bound", "C-bound", "Upper bound on C; its conditions are in sa.formula.",
            "Delta = 1/4"),
    Emitted("outer_piece", "eq:fourthTerm", "The fourth piece of T, exactly.", "closed form"),
    Emitted("strong_noise_time", "eq:Ttildelarge", "T for strong noise, leading order."),
    Emitted("strong_noise_time_next", "eq:Ttildelarge",
            "T for strong noise with its kappa^2 and constant terms.", "next orders"),
    Emitted("well_term", "eq:secondTerm", "The well's share of T, leading order.", "leading term"),
    Emitted("log_well_term", "eq:secondTerm", "Natural logarithm of `well_term`.", "logarithm"),
    Emitted("saddle_correction", "eq:secondTerm",
            "Relative correction of one saddle from V'', V''', V'''' there.",
            "correction of one saddle"),
    Emitted("saddle_first", "saddle-series",
            "Coefficient of 1/lam in a well's series; of -V, a barrier's.", "first correction",
            plain=True),
    Emitted("saddle_second", "saddle-series",
            "Coefficient of 1/lam^2 in the series of `saddle_first`.", "second correction",
            plain=True),
    Emitted("weak_noise_time", "eq:Ttildesmall", "T for weak noise, with a well.", "sum"),
    Emitted("well_edge", "eq:Tsmall", "kappa at which both terms of `weak_noise_time` are equal."),
    Emitted("behind_barrier_term", "eq:S", "The large term of T for a start behind the barrier.",
            "u2 < 0: start behind the barrier"),
    Emitted("occupation_from_layer", "eq:P2", "P from N, the integral over the layer."),
    Emitted("occupation_bound", "L-bound", "Lower bound on P."),
    Emitted("strong_noise_occupation", "eq:Plarge2", "P for strong noise, leading order."),
    Emitted("weak_noise_outside", "eq:Psmall2", "1 - P for weak noise, leading order."),
    Emitted("friction_left", "eq:phifric0", "The friction drift for u <= -1 (a-).", piece=0),
    Emitted("friction_coefficients", "eq:phifric0",
            "Coefficients of A(u) in ascending powers of u.", "powers of u", plain=True),
    Emitted("friction_inside", "eq:phifric0", "The friction drift A(u) on [-1, 1].", piece=1),
    Emitted("friction_right", "eq:phifric0", "The friction drift for u >= 1 (a+).", piece=2),
    Emitted("friction_slope", "fr1", "A'(u) of the friction drift.", "A'"),
    Emitted("friction_potential_left", "eq:Vfric", "V(u) for u <= -1.", piece=0),
    Emitted("friction_potential_inside", "eq:Vfric", "V(u) on [-1, 1].", piece=1),
    Emitted("friction_potential_right", "eq:Vfric", "V(u) for u >= 1.", piece=2),
    Emitted("friction_turning_point", "turning-points", "u at which the force turns (mu > 1/2)."),
    Emitted("friction_breakaway", "beta", "The largest force, for mu >= 1/2."),
    Emitted("friction_folds", "folds", "z0 at both folds, (+) then (-).", "spring extension"),
    Emitted("friction_angle", "friction-well",
            "omega, a third of arccos((1 - z0)/beta); z0 < 1, mu > 1/2.", "angle"),
    Emitted("friction_slope_well", "friction-well", "A'(u1) at the well.", piece=0),
    Emitted("friction_slope_barrier", "friction-well", "A'(u2) at the barrier.", piece=1),
    Emitted("friction_barrier", "friction-well", "V(u2) - V(u1).", piece=2),
    Emitted("noise_threshold", "threshold",
            "Unscaled kappa below which T is exponentially large; ell = -log eps."),
    Emitted("escape_time_of_sides", "positive-form",
            "T from sigma on both sides and w, the sum of both.", plain=True),
    Emitted("density_of_sides", "positive-density", "p_ss from w, the sum of both sides.",
            plain=True),
    Emitted("tail_left", "positive-density", "w at -1.", "w beyond the layer", piece=0, plain=True),
    Emitted("tail_right", "positive-density", "w at 1, from the right.", "w beyond the layer",
            piece=1, plain=True),
)
# fmt: on

# How arguments are called in the code, and the order they come in.
NAMES = {
    "A_1": "slope_well", "A_2": "slope_barrier", "D": "barrier", "V_1": "V1", "V_m": "V_well",
    "K_m": "curvature", "kappa_phys": "kappa", "r_phys": "r", "epsilon": "eps", "phi_0":
    "drift0", "V_0": "V0", "V_u1": "V_well", "c_2": "V2", "c_3": "V3", "c_4": "V4", "c_5": "V5",
    "c_6": "V6", "N": "layer",
    "R": "root",
}  # fmt: skip
ORDER = """
    u kappa r eps ell omega a mu alpha z0 a_minus a_plus layer L drift0 slope_well slope_barrier
    barrier V0 V1 V2 V3 V4 V5 V6 V_well curvature lam x w int_e int_inverse nested fall climb
    sigma sigma_left sigma_right inside outside side source drift left right index power j n
    beta root y product i share lower same before after
    moment term behind ahead double_left double_right nested_left nested_right total small t b
    a_up b_up k zeta p_2 q_1 q_2
    a_down b_down weights
    bi bi_slope squares cross slopes slope even odd square norm bottom gap area first second value
    mean peak rest tail dawson integral speed_start
""".split()  # noqa: SIM905


def expression(item: Emitted) -> Any:
    """The expression that a derivation's step (or conclusion) states for `item`."""
    derivation = build(item.label)
    if item.step:
        (stated,) = [s.result for s in derivation.steps if s.name == item.step]
    else:
        stated = derivation.result
    if isinstance(stated, Expansion):
        stated = stated.leading
    if item.piece is not None:
        stated = stated[item.piece]
    return stated


_FORMULAS = """\
\"""The formulas that the derivations emitted, each once.

First those of + - * / and whole powers, for numbers of any one kind; then those in an mpmath
context `ctx`, or with NumPy in its place.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
\"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


class Ratios(Protocol):
    \"""Numbers of one kind that are added, multiplied and divided, as positive ones may be.\"""

    def __add__(self, other: Any, /) -> Any: ...
    def __radd__(self, other: Any, /) -> Any: ...
    def __mul__(self, other: Any, /) -> Any: ...
    def __rmul__(self, other: Any, /) -> Any: ...
    def __truediv__(self, other: Any, /) -> Any: ...
    def __rtruediv__(self, other: Any, /) -> Any: ...


class Field(Ratios, Protocol):
    \"""Numbers of one kind: floats or arrays of them, rationals, mpf, balls, expressions.\"""

    def __neg__(self) -> Any: ...
    def __sub__(self, other: Any, /) -> Any: ...
    def __rsub__(self, other: Any, /) -> Any: ...
    def __pow__(self, other: int, /) -> Any: ...
"""

_MPMATH = """\
\"""Every formula in an mpmath context `ctx`, its first argument, at its precision.

Written by ``python -m derivations.emit``: do not edit.
\"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symasym.generated import formulas

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


def __getattr__(name: str) -> Any:
    \"""A formula; one of numbers alone with a context before these.\"""
    formula = getattr(formulas, name)
    if formula.__code__.co_varnames[0] not in ("c", "ctx"):
        of_numbers = formula

        def formula(ctx: MPContext, *numbers: mpf, **named: mpf) -> Any:
            return of_numbers(*numbers, **named)

        formula.__name__, formula.__doc__ = name, of_numbers.__doc__
    globals()[name] = formula
    return formula
"""

_NUMPY = """\
\"""Every formula in float64, for arrays that broadcast together.

Written by ``python -m derivations.emit``: do not edit.
\"""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from symasym.generated import formulas

# What the formulas ask of their context.
_ARCS = {f"a{name}": getattr(np, f"arc{name}") for name in ("sin", "cos", "tan")}
_FLOATS = SimpleNamespace(**{**vars(np), **_ARCS, "mpf": float})


def __getattr__(name: str) -> Any:
    \"""A formula with NumPy in the place of its context; of numbers alone as it is.\"""
    formula = getattr(formulas, name)
    if formula.__code__.co_varnames[0] in ("c", "ctx"):
        formula = partial(formula, _FLOATS)
    globals()[name] = formula
    return formula
"""


def target_of(item: Emitted) -> str:
    """The kind of numbers that a function is written for."""
    return "plain" if item.plain else "mpmath"


def definitions() -> str:
    """Source of the module that has every formula, those of one kind of numbers together."""
    lines = [_FORMULAS]
    for target in ("plain", "mpmath"):
        for item in EMITTED:
            if target_of(item) == target:
                stated = expression(item)
                names, arguments = named(stated)
                lines.append(
                    "\n" + function(item.name, arguments, stated, target, doc(item), names)
                )
    return "\n".join(lines)


def named(stated: Any) -> tuple[dict[Any, str], list[Any]]:
    """Names of the symbols of an expression in code, and the symbols in the order of arguments."""
    symbols = {s for e in parts(stated) for s in e.free_symbols}
    names = {s: NAMES.get(s.name, s.name) for s in symbols}
    return names, sorted(symbols, key=lambda s: ORDER.index(names[s]))


def doc(item: Emitted) -> str:
    """The first line of a function's docstring."""
    return f"{item.doc[:-1]} ({item.label})."


def statement(item: Emitted) -> dict[str, Any]:
    """A function as data, its symbols named as in the code: what `sa.emit` prints.

    Of a step, the step's LaTeX as well; and the LaTeX of its left sides and of its symbols.
    """
    stated = expression(item)
    shown = build(item.label).names
    names, arguments = named(stated)
    called = {s: sympy.Symbol(names[s], **s._assumptions_orig) for s in arguments}
    pieces = [e.subs(called, simultaneous=True) for e in parts(stated)]
    return {
        "name": item.name,
        "doc": doc(item),
        "arguments": [names[s] for s in arguments],
        "expression": sympy.srepr(pieces[0] if len(pieces) == 1 else sympy.Tuple(*pieces)),
        "latex": _latex_of_step(item) if item.step else "",
        "left": _left_sides(item),
        "names": {names[s]: latex(s, shown) for s in arguments},
    }


def _left_sides(item: Emitted) -> list[str]:
    """LaTeX of what a function's values are, one each."""
    derivation = build(item.label)
    (left,) = (
        [s.left for s in derivation.steps if s.name == item.step]
        if item.step
        else [derivation.left]
    )
    sides = list(left) if isinstance(left, (tuple, list)) else [left]
    if item.piece is not None and len(sides) > item.piece:
        sides = [sides[item.piece]]
    shown = [s if isinstance(s, str) else latex(s, derivation.names) for s in sides]
    return [s.partition(" = ")[0] for s in shown]


def _latex_of_step(item: Emitted) -> str:
    derivation = build(item.label)
    return str(next(s.latex(derivation.names) for s in derivation.steps if s.name == item.step))


def statement_of(label: str) -> dict[str, Any]:
    """A derivation's statement as data, without its checks' outcome."""
    derivation = build(label)
    record = describe(derivation)
    result = derivation.result
    left = derivation.left
    record["left"] = sympy.srepr(sympy.Tuple(*left) if isinstance(left, tuple) else left)
    record["cases"] = list(derivation.cases)
    if isinstance(result, Expansion):
        record["expression"] = sympy.srepr(result.leading)
        record["remainder"] = sympy.srepr(result.gauge)
        record["limit"] = f"{result.variable} -> {result.limit}"
    else:
        record["expression"] = sympy.srepr(
            sympy.Tuple(*result) if isinstance(result, tuple) else result
        )
    written = record["left"] + record["expression"] + record.get("remainder", "")
    record["names"] = {
        name: shown for name, shown in derivation.names.items() if f"({name!r}" in written
    }
    record["steps"] = [
        {
            "name": s.name,
            "rule": s.rule,
            "kind": s.check.kind,
            "how": s.check.how(),
            "reason": s.reason,
            "latex": s.latex(derivation.names),
        }
        for s in derivation.steps
    ]
    record["functions"] = [item.name for item in EMITTED if item.label == label]
    record["code"] = [statement(item) for item in EMITTED if item.label == label]
    return record


def formulas() -> str:
    """The data of `sa.formula`: every derivation's statement."""
    records = {label: statement_of(label) for label in closure(entries())}
    definitions = {label: asdict(defined) for label, defined in DEFINITIONS.items()}
    data = {"format": FORMAT, "formulas": records, "definitions": definitions}
    return json.dumps(data, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def sources() -> dict[str, str]:
    """File name -> content of everything that is emitted."""
    return {
        "__init__.py": '"""Code and data emitted by the derivations; do not edit."""\n',
        "formulas.py": definitions(),
        "mpmath_formulas.py": _MPMATH,
        "numpy_formulas.py": _NUMPY,
        "formulas.json": formulas(),
    }


def main() -> None:
    """Write `symasym/generated/`."""
    for name, content in sources().items():
        write_bytes(FOLDER / name, content.encode())
    print(f"wrote {FOLDER}")


if __name__ == "__main__":
    main()
