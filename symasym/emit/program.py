"""Programs: functions and their cases before they are written in a language; numbers put in."""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import sympy

from symasym.base.errors import InputError
from symasym.base.inputs import exact, float_text, meant
from symasym.emit.forms import as_printed, log_form, removable, rounded, stable

if TYPE_CHECKING:
    from sympy import Expr


# Words that one of the languages has taken, or that the emitted files use themselves.
TAKEN = frozenset(
    re.findall(
        r"\w+",
        """auto break case char const continue default do double else enum extern float for goto
        if inline int long register restrict return short signed sizeof static struct switch
        typedef union unsigned void volatile while abs arguments await catch class debugger delete
        eval export extends false finally function implements import in instanceof interface let
        new null package private protected public super this throw true try typeof undefined var
        with yield map Math NaN Infinity NAN INFINITY math np mpmath ctx dps out main exp log sqrt
        pow sin cos tan sinh cosh tanh asin acos atan fabs expm1 log1p gamma j0 j1 jn y0 y1 yn
        M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2
        M_SQRT1_2""",
    )
) | frozenset(keyword.kwlist)


# What the body of an integral or an escape time calls its own parts, in one language or another.
_LOCAL = frozenset(
    re.findall(
        r"\w+",
        """c count drift ends log_time left mean marks p points right zeros zeros_ between_
        log_time_ logIntegral logTime logUniform log_uniform_""",
    )
)


def _inner(function: Function) -> Callable[[str], str]:
    """`identifier` beside the names of such a body."""
    taken = _LOCAL | {function.name, f"log_{function.name}"}
    return lambda name: f"{name.rstrip('_')}_1" if name in taken else identifier(name)


def identifier(name: str) -> str:
    """`name` as a name in every language, with ``_`` after those that are taken."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII).lstrip("_") or "x"
    if plain[0].isdigit():
        plain = f"f{plain}"
    return f"{plain}_" if plain in TAKEN else plain


@dataclass(frozen=True)
class Case:
    """Values that hold where all `conditions` do, which are asked in this order.

    `shared` are symbols in the values, and what they stand for, in this order.
    """

    values: tuple[Any, ...]
    conditions: tuple[Any, ...] = ()
    name: str = ""  # how it is called when it is left out
    shared: tuple[tuple[Any, Any], ...] = ()

    @property
    def symbols(self) -> set[Any]:
        """The symbols that the values, the conditions and the shared parts are made of."""
        parts = (*self.values, *self.conditions, *(e for _, e in self.shared))
        return {s for e in parts for s in e.free_symbols} - {s for s, _ in self.shared}


@dataclass(frozen=True, kw_only=True)
class _OfDrift:
    """What is computed from a drift: its zeros in the layer, or coefficients to find them from."""

    points: tuple[Any, ...] = ()
    coefficients: tuple[Any, ...] = ()

    @property
    def expressions(self) -> tuple[Any, ...]:
        """All of them, of every attribute."""
        values = (getattr(self, f.name) for f in fields(self))
        listed = (e for v in values for e in (v if isinstance(v, tuple) else (v,)))
        return tuple(e for e in listed if isinstance(e, sympy.Basic))

    def changed(self, change: Callable[[Any], Any]) -> Self:
        """The same with `change` made to each expression."""
        known = ((f.name, getattr(self, f.name)) for f in fields(self))
        new = {
            name: tuple(map(change, e)) if isinstance(e, tuple) else change(e)
            for name, e in known
            if isinstance(e, tuple | sympy.Basic)
        }
        return replace(self, **new)


@dataclass(frozen=True)
class Quadrature(_OfDrift):
    """The logarithm of the integral of e^exponent over u from lower to upper.

    The exponent is monotone between -1, 1, and `points` or the zeros of the polynomial of
    `coefficients`.
    """

    exponent: Any
    lower: Any
    upper: Any


@dataclass(frozen=True)
class FirstPassage(_OfDrift):
    """log T from 0 with the layer's `drift` in u (see `symasym.emit.kernels.exact`).

    Attributes
    ----------
    drift : expression
    ends : tuple of two expressions
        The drift beyond the layer.
    size : expression
        How large the drift's terms are, and how much it moves as u does.
    """

    drift: Any
    ends: tuple[Any, ...]
    size: Any

    @property
    def rounding(self) -> Expr:
        """The absolute rounding error of the drift in doubles."""
        return rounded(sympy.Float("4e-16", 20) * self.size)


@dataclass(frozen=True)
class Function:
    """A function: the first case whose conditions hold gives its values.

    Attributes
    ----------
    name, doc : str
    arguments : tuple of str
        Names in the order they come in; those that are not needed are dropped later.
    cases : tuple of Case
    logs : tuple of Case, optional
        The logarithm of the value, where it is known better than by taking it.
    outside : str
        What is wrong where no case holds.
    latex : str, optional
        The step that states it; empty where the formula itself does.
    left : tuple of str
        LaTeX of what the values are, one each, where a formula states them.
    names : mapping
        LaTeX of the arguments in the formula's symbols.
    """

    name: str
    doc: str
    arguments: tuple[str, ...]
    cases: tuple[Case, ...]
    logs: tuple[Case, ...] = ()
    outside: str = "no case of the formula holds there"
    quadrature: Quadrature | None = None
    first_passage: FirstPassage | None = None
    latex: str | None = None
    left: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)

    @property
    def symbols(self) -> set[Any]:
        """Every symbol in the cases and their conditions."""
        return {s for case in self.cases for s in case.symbols}


def by_logarithm(
    name: str, doc: str, arguments: tuple[str, ...], log: Any, where: tuple[Any, ...] = (),
    shared: tuple[tuple[Any, Any], ...] = (), outside: str = Function.outside,
) -> Function:  # fmt: skip
    """The function e^log with its logarithm, of one case."""
    whole, own = ((Case((e,), where, shared=shared),) for e in (sympy.exp(log), log))
    return Function(name, doc, arguments, whole, own, outside)


@dataclass(frozen=True)
class Body:
    """A case made ready: shared parts first, then the values."""

    conditions: tuple[Any, ...]
    shared: tuple[tuple[Any, Any], ...]
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Ready:
    """A function as a language writes it.

    `exp_of` names the function whose exponential it is; it has no bodies of its own then.
    """

    name: str
    doc: str
    arguments: tuple[str, ...]
    bodies: tuple[Body, ...]
    outside: str = ""
    exp_of: str = ""
    quadrature: Quadrature | None = None
    first_passage: FirstPassage | None = None

    @property
    def count(self) -> int:
        """The number of values it returns."""
        return len(self.bodies[0].values) if self.bodies else 1


@dataclass(frozen=True)
class Program:
    """Everything one file says."""

    label: str
    title: str
    functions: tuple[Function, ...]
    error: str = ""
    note: str = ""
    assumptions: tuple[str, ...] = ()
    latex: str = ""
    folded: Mapping[str, Any] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    digits: int = 10_000  # as many as its numbers have

    @property
    def name(self) -> str:
        """A name for a file or a header."""
        return identifier(self.label.removeprefix("eq:").replace("-", "_") or "formula")

    @cached_property
    def in_doubles(self) -> list[Ready]:
        """The functions with shared parts taken out and constants rounded."""
        return ready(self, True)

    @cached_property
    def in_digits(self) -> list[Ready]:
        """The functions with shared parts taken out, constants exact."""
        return ready(self, False)


_OPEN = (
    sympy.Integral,
    sympy.Derivative,
    sympy.Sum,
    sympy.Piecewise,
    sympy.Heaviside,
    sympy.RootSum,
    sympy.core.function.AppliedUndef,
)


def require_closed(program: Program) -> Program:
    """Raise InputError where an integral or a general function is left."""
    for function in program.functions:
        for value in (v for case in function.cases for v in case.values):
            if value.is_real is False or value.has(sympy.nan, sympy.oo, sympy.zoo):
                raise InputError(f"{program.label}: {value} is no real number; emit one that is.")
            held = sorted(value.atoms(*_OPEN), key=str)
            if held:
                raise InputError(
                    f"{program.label} cannot be emitted: {held[0]} has no closed form; give "
                    "drift=… where it is the drift or its potential, or use the function that "
                    "evaluates it."
                )
    return program


def ready(program: Program, double: bool) -> list[Ready]:
    """The functions of a program with shared parts taken out, logarithms before their values."""
    functions: list[Ready] = []
    own = {function.name for function in program.functions}
    for function in program.functions:
        if held := function.quadrature or function.first_passage:
            functions += _ready_of_drift(function, held, double)
            continue
        function = replace(
            function,
            cases=tuple(_stably(case) for case in function.cases),
            logs=tuple(_stably(case) for case in function.logs) or _logs(function),
        )
        names = _called(function)
        log = f"log_{function.name}"
        if function.logs and log not in own:
            about = f"Natural logarithm of `{function.name}`."
            logarithm = replace(function, name=log, doc=about, cases=function.logs)
            functions.append(_ready(logarithm, names, double))
        if function.logs and double:
            arguments = _ready(replace(function, cases=function.logs), names, double).arguments
            functions.append(Ready(function.name, function.doc, arguments, (), exp_of=log))
        else:
            functions.append(_ready(function, names, double))
    taken = [function.name for function in functions]
    for name in taken:
        if taken.count(name) > 1:
            raise InputError(f"two functions would be called {name}; emit them one by one.")
    return functions


def _stably(case: Case) -> Case:
    """The case without removable poles."""
    return replace(case, values=tuple(removable(value) for value in case.values))


def _logs(function: Function) -> tuple[Case, ...]:
    """Cases of the logarithm, where exponentials are in the value and its sign is seen."""
    if any(len(case.values) != 1 for case in function.cases):
        return ()
    values = [case.values[0] for case in function.cases]
    if not any(e.free_symbols for value in values for e in value.atoms(sympy.exp)):
        return ()
    logs = [log_form(value) for value in values]
    if any(log is None for log in logs):
        return ()
    return tuple(
        replace(case, values=(log,)) for case, log in zip(function.cases, logs, strict=True)
    )


def _called(function: Function) -> dict[Any, Any]:
    """Each symbol under the name it has in code."""
    symbols = {s for case in (*function.cases, *function.logs) for s in case.symbols}
    names = {s: identifier(s.name) for s in symbols}
    if len({*names.values()}) < len({s.name for s in symbols}):
        raise InputError(
            f"the symbols {', '.join(sorted(s.name for s in symbols))} do not have different "
            "names in code; rename some of them."
        )
    return {s: sympy.Symbol(name, **s._assumptions_orig) for s, name in names.items()}


# What the files' helpers have room for.
_MOST_DEGREE, _MOST_POINTS = 127, 1024


def _ready_of_drift(
    function: Function, held: Quadrature | FirstPassage, double: bool
) -> list[Ready]:
    """An integral; of an escape time the logarithm, and its exponential.

    In digits that is computed by itself.

    Raises
    ------
    InputError
        If a helper of the file has no room for the drift.
    """
    if len(held.coefficients) > _MOST_DEGREE + 1 or len(held.points) > _MOST_POINTS:
        raise InputError(
            f"code is emitted for polynomials up to degree {_MOST_DEGREE} and drifts with up to "
            f"{_MOST_POINTS} zeros and turns; give a lower one."
        )
    named = _inner(function)
    symbols = {s for e in held.expressions for s in e.free_symbols}
    names = {s: sympy.Symbol(named(s.name), **s._assumptions_orig) for s in symbols}
    held = held.changed(lambda e: e.subs(names, simultaneous=True))
    if double:
        held = held.changed(rounded)
    arguments = tuple(map(named, function.arguments))
    if isinstance(held, Quadrature):
        return [Ready(function.name, function.doc, arguments, (), quadrature=held)]
    log = f"log_{function.name}"
    about = f"Natural logarithm of `{function.name}`."
    return [
        Ready(log, about, arguments, (), function.outside, first_passage=held),
        Ready(
            function.name, function.doc, arguments, (), function.outside, exp_of=log,
            first_passage=None if double else held,
        ),
    ]  # fmt: skip


def _ready(function: Function, names: dict[Any, Any], double: bool) -> Ready:
    """The cases with common subexpressions shared, in doubles with constants rounded."""
    used = {s.name for s in function.symbols}
    arguments = tuple(identifier(name) for name in function.arguments if name in used)
    bodies = []
    for case in function.cases:
        given = [(s, stable(e.subs(names, simultaneous=True))) for s, e in case.shared]
        values = [stable(v.subs(names, simultaneous=True)) for v in case.values]
        conditions = [c.subs(names, simultaneous=True) for c in case.conditions]
        if double:
            given = [(s, rounded(e)) for s, e in given]
            values = [rounded(v) for v in values]
            conditions = [rounded(c) for c in conditions]
        taken = {s for e in (*values, *conditions) for s in e.free_symbols}
        fresh = (
            s for s in sympy.numbered_symbols("t", real=True)
            if s.name not in {t.name for t in taken}
        )  # fmt: skip
        shared, values = sympy.cse(values, symbols=fresh, order="none")
        bodies.append(Body(tuple(conditions), (*given, *shared), tuple(values)))
        if not conditions:
            break
    return Ready(function.name, function.doc, arguments, tuple(bodies), function.outside)


def _short(value: Any) -> str:
    """A number as text, in few digits where it has very many."""
    try:
        return str(value)
    except ValueError:  # longer than Python prints
        return float_text(exact("a parameter", value))


def header(program: Program, *more: str) -> list[str]:
    """The lines every file begins with."""
    lines = [f"{program.label}: {program.title}."]
    lines += [f"{line}." for line in program.assumptions]
    if program.error:
        lines.append(f"Error of the formula: {program.error}.")
    if program.note:
        lines.append(f"Here {program.note}.")
    if program.folded:
        folded = (f"{name} = {_short(value)}" for name, value in sorted(program.folded.items()))
        lines.append(f"Folded in: {', '.join(folded)}.")
    lines += [f"Left out: {line}." for line in program.left_out]
    return [*lines, *more, "Written by symasym."]


def in_doubles(functions: Iterable[Ready]) -> str:
    """A sentence on double precision, and on logarithms where there are some."""
    if not any(function.exp_of for function in functions):
        return "In double precision."
    return (
        "In double precision. A log_ function is finite where its value is not; a value beyond "
        "the range of doubles is infinite or 0."
    )


# -- numbers put in, and what they make vanish -----------------------------------------------------


def fold(program: Program, parameters: Mapping[str, Any], also: Iterable[str] = ()) -> Program:
    """The program with these numbers in it: what they make vanish is left out and said.

    Messages name the parameters that it has and those of a drift, `also`.

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
            names = list(dict.fromkeys([*also, *known]))
            raise InputError(
                f"{name} is no parameter of {program.label}; its parameters are "
                f"{', '.join(names) or 'none at all'}{meant(name, names)}."
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
