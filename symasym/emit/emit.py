"""Source code of formulas: SymPy's printers and its cse, and what they lack.

A `Function` has a name, arguments and values. Where a value has exponentials that may overflow, its
logarithm is a function, too, and the value is the exponential of that. Functions that a language
has not stand in ``runtime.c``, ``runtime_numpy.py`` and ``runtime_mpmath.py``, and a file has a
copy of those that it calls; JavaScript is the C of ``runtime.c`` without its types.
"""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, reduce
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import sympy
from sympy import Expr, Rational, S, Symbol
from sympy.codegen.cfunctions import expm1, log1p
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import CodePrinter, PrintMethodNotImplementedError
from sympy.printing.jscode import JavascriptCodePrinter
from sympy.printing.latex import LatexPrinter
from sympy.printing.numpy import SciPyPrinter
from sympy.printing.pycode import MpmathPrinter

from symasym.base.errors import InputError
from symasym.base.files import write_bytes
from symasym.base.inputs import choice, exact, is_name, shown
from symasym.drift.expressions import sympified
from symasym.records import Record

if TYPE_CHECKING:
    from symasym.drift.drift import Drift


def own(name: str) -> Any:
    """A real function of that name, which SymPy leaves as it is."""
    return type(name, (sympy.Function,), {"is_real": True})


#: airye(z, k) is Ai, Ai', Bi, Bi' for k = 0 to 3, where z > 0 times e^(+-(2/3) z^(3/2)).
logaddexp, airye, third, artanhc = map(own, ("logaddexp", "airye", "third", "artanhc"))
LAM = Symbol("lam", positive=True)


@dataclass(frozen=True)
class Function:
    """A function of `arguments`: its values, in the symbols of `shared`, which are named first."""

    name: str
    arguments: tuple[Symbol, ...]
    values: tuple[Expr, ...]
    doc: str = ""
    shared: tuple[tuple[Symbol, Expr], ...] = ()

    def each(self, change: Any) -> Function:
        """The function with a change made to each of its expressions."""
        shared = tuple((s, change(v)) for s, v in self.shared)
        return replace(self, values=tuple(map(change, self.values)), shared=shared)


# -- one printer a language ------------------------------------------------------------------------

_OWN = ("logaddexp", "drift", "rate")
#: What the runtimes have for a drift, of one number each but kappa or lam, the first argument.
_SWEEPS = ("log_time", "log_exit", "log_share", "log_density", "potential")


class _NumPy(SciPyPrinter):  # type: ignore[misc]
    def _print_Function(self, e: Any) -> str:
        text = str(super()._print_Function(e))
        return f"each({text.replace('(', ', ', 1)}" if type(e).__name__ in _SWEEPS else text

    def _print_Max(self, e: Any) -> str:
        return str(reduce("numpy.maximum({}, {})".format, map(self._print, e.args)))

    def _print_Pi(self, e: Any) -> str:
        return "numpy.pi"

    def _print_Min(self, e: Any) -> str:
        return str(reduce("numpy.minimum({}, {})".format, map(self._print, e.args)))

    def _print_Piecewise(self, e: Any) -> str:
        (value, condition), *others = e.args
        rest = self._print(sympy.Piecewise(*others) if others else S.NaN)
        return f"numpy.where({self._print(condition)}, {self._print(value)}, {rest})[()]"


class _Mpmath(MpmathPrinter):  # type: ignore[misc]
    def _print_Float(self, e: Any) -> str:
        return f"mpmath.mpf('{e}')"

    def _print_Heaviside(self, e: Any) -> str:
        return f"(1 if {self._print(e.args[0])} > 0 else 0)"

    def _print_Integral(self, e: Any) -> str:
        text = self._print(e.function)
        for variable, low, high in e.limits:
            ends = f"{self._print(low)}, {self._print(high)}"
            text = f"quad(lambda {self._print(variable)}: {text}, {ends})"
        return str(text)


class _Braces:
    """Constants as numbers, and x*x for x^2, where a language has no operator for powers."""

    def _print_NumberSymbol(self, e: Any) -> str:
        return repr(float(e))

    _print_Pi = _print_Exp1 = _print_EulerGamma = _print_NumberSymbol

    def _print_Integer(self, e: Any) -> str:
        return f"{e.p}.0" if abs(e.p) > 2**31 else str(e.p)

    def _print_Pow(self, e: Any) -> str:
        if not (e.exp.is_Integer and 2 <= abs(e.exp) <= 4):
            return str(super()._print_Pow(e))  # type: ignore[misc]
        product = "*".join([self.parenthesize(e.base, 60)] * abs(int(e.exp)))  # type: ignore[attr-defined]
        return f"({product})" if e.exp > 0 else f"(1.0/({product}))"


class _C(_Braces, C99CodePrinter):  # type: ignore[misc]
    def _print_Tuple(self, e: Any) -> str:
        return f"(const double[]){{{', '.join(map(self._print, e)) or 0}}}"


class _JavaScript(_Braces, JavascriptCodePrinter):  # type: ignore[misc]
    def _print_Tuple(self, e: Any) -> str:
        return f"[{', '.join(map(self._print, e))}]"

    def _print_NaN(self, e: Any) -> str:
        return "NaN"


#: Target -> its printer.
PRINTERS: dict[str, Any] = {
    "numpy": _NumPy, "mpmath": _Mpmath, "c": _C, "javascript": _JavaScript, "latex": LatexPrinter,
}  # fmt: skip
TARGETS = tuple(PRINTERS)
_NAMED: dict[str, dict[str, Any]] = {
    "numpy": {"logaddexp": "numpy.logaddexp", "erfcx": "scipy.special.erfcx",
              "dawsn": "scipy.special.dawsn"},
    "mpmath": {f: f"mpmath.{f}" for f in ("expm1", "log1p", "erfi", "atanh")},
    "c": {},
    "javascript": {"expm1": "Math.expm1", "log1p": "Math.log1p", "erf": "erf_", "erfc": "erfc_"},
}  # fmt: skip
#: Words that no argument may have as its name.
_WORDS = {
    *("numpy", "scipy", "mpmath", "functools", "Math", "drift", "rate", "p", "out", "max", "min"),
    *("abs", "map", "range", "sum", "exp", "log", "sqrt", "sin", "cos", "tan", "tanh", "pow"),
    *("y0", "y1", "j0", "j1", "var", "let", "const", "new", "function", "this", "null", "export"),
    *("import", "delete", "in", "with", "yield", "await", "class", "typeof", "void", "int"),
    *("double", "float", "long", "char", "return", "true", "false", "eval", "arguments"),
}  # fmt: skip


def printer_of(target: str, functions: Sequence[Function]) -> Any:
    """The printer, which knows the functions of the file and the helpers."""
    names = [*_OWN, *known_helpers(target), *(f.name for f in functions)]
    settings: dict[str, Any] = {"user_functions": {n: n for n in names} | _NAMED[target]}
    settings |= {"math_macros": {}} if target == "c" else {}
    if any(v.has(sympy.Integral) for f in functions for v in f.values):
        settings["order"] = "none"  # ordering terms evaluates them
    printer = PRINTERS[target](settings)
    printer.reserved_words = {*printer.reserved_words, *_WORDS, *names}
    return printer


# -- forms that keep digits ------------------------------------------------------------------------


def log_form(e: Expr) -> Expr | None:
    """log(e) of a positive sum or product with exponentials; None where no sign is seen."""
    if isinstance(e, sympy.exp):
        return e.args[0]
    if not e.has(sympy.exp):
        return sympy.log(e) if e.is_positive else None
    if e.is_Pow:
        base = log_form(e.base)
        return None if base is None else e.exp * base
    logs = [log_form(a) for a in e.args] if e.is_Mul or e.is_Add else [None]
    if e.is_Mul and None in logs:
        turned = [a for a, log in zip(e.args, logs, strict=True) if log is None]
        if len(turned) % 2 or not all(a.is_Add or a.is_Number for a in turned):
            return None
        logs = [log_form(-a) if a in turned else log_form(a) for a in e.args]
    if None in logs:
        return None
    total = logs[0]
    for log in logs[1:]:
        total = total + log if e.is_Mul else logaddexp(total, log)
    return total


def stable(e: Expr) -> Expr:
    """`e` with expm1, log1p and logaddexp where digits would be lost.

    SymPy's own rewriting factors the expression, which takes minutes.
    """

    def of_sum(e: Expr) -> Expr:
        constant = sum((a for a in e.args if a.is_Rational), S.Zero)
        for a in e.args:
            factor, power = a.as_coeff_Mul()
            if isinstance(power, sympy.exp) and constant and constant == -factor:
                rest = (b for b in e.args if b is not a and not b.is_Rational)
                return sympy.Add(*rest, factor * expm1(power.args[0]))
        return e

    def of_log(x: Expr) -> Expr:
        if x.has(sympy.exp) and (log := log_form(x)) is not None:
            return log
        return log1p(x - 1) if x.is_Add and len(x.args) == 2 and 1 in x.args else sympy.log(x)

    return e.replace(sympy.log, of_log).replace(lambda x: x.is_Add, of_sum)


def plain(e: Expr) -> Expr:
    """`e` in the functions that every target has: Airy functions by their scaled ones."""
    for part, kind in enumerate(
        (sympy.airyai, sympy.airyaiprime, sympy.airybi, sympy.airybiprime)
    ):
        sign = Rational(2 if part > 1 else -2, 3)
        e = e.replace(kind, lambda z, k=part, s=sign: airye(z, k) * sympy.exp(
            s * sympy.Max(z, 0) ** Rational(3, 2)))  # fmt: skip
    e = e.replace(sympy.hyper, _hyper)
    e = e.replace(sympy.erfi, lambda x: 2 / sympy.sqrt(sympy.pi) * sympy.exp(x**2) * own("dawsn")(x))
    e = e.replace(lambda x: type(x).__name__ in ("exprel", "exprel2"), _exprel)
    return e.replace(lambda x: x.is_Mul, _one_exponential)


def _exprel(e: Expr) -> Expr:
    """(e^x - 1)/x or (e^x - 1 - x)/x^2 with the exponential that may overflow."""
    (x,) = e.args
    grown = sympy.Max(sympy.expand(x / LAM), 0)
    return own(f"{type(e).__name__}_")(x) * sympy.exp(LAM * grown)


def _one_exponential(e: Expr) -> Expr:
    """A product with its exponentials as one."""
    powers = [a.args[0] for a in e.args if isinstance(a, sympy.exp)]
    rest = (a for a in e.args if not isinstance(a, sympy.exp))
    return e if len(powers) < 2 else sympy.Mul(*rest, sympy.exp(sympy.Add(*powers)))


def _hyper(a: Any, b: Any, z: Any) -> Expr:
    """The two hypergeometric functions of the uniform formula."""
    if (*a, *b) == (Rational(1, 2), 1, Rational(3, 2)):
        return artanhc(z)
    if {*a} == {Rational(1, 3), -Rational(1, 3)} and [*b] == [Rational(1, 2)]:
        return third(1 - 2 * z)
    return sympy.hyper(a, b, z)


def _with_logarithm(f: Function) -> Iterator[Function]:
    """The function, behind its logarithm where that can be finite and the value not."""
    log = log_form(f.values[0]) if len(f.values) == 1 and f.values[0].has(sympy.exp) else None
    if log is None:
        yield f
        return
    first = replace(f, name=f"log_{f.name}", values=(log,), doc=f"log of: {f.doc}")
    yield first
    yield replace(f, values=(sympy.exp(own(first.name)(*f.arguments)),), shared=())


# -- files -----------------------------------------------------------------------------------------

# Head of the file, comment; head of a function, its numbers, one assignment, return of one, of
# several values, end.
_C_LIKE = ("{} = {};", "return {};")
_SHAPES = {
    "numpy": ("import numpy\n", "#", '@numpy.errstate(all="ignore")\ndef {0}({1}):\n    """{3}"""',
              "{0} = numpy.float64({0})", "{} = {}", "return {}", "return ({})", ""),
    "mpmath": ("import mpmath\n", "#", "@mpmath.extradps(20, normalize_output=True)\n"
               'def {0}({1}):\n    """{3}"""', "{0} = mpmath.mpmathify({0})", "{} = {}",
               "return {}", "return ({})", ""),
    "c": ("#include <math.h>\n", "//", "// {3}\ndouble {0}({2})\n{{", "", "const double {} = {};",
          "return {};", "", "}\n"),
    "javascript": ("", "//", "// {3}\nexport function {0}({1}) {{", "", "const {} = {};",
                   "return {};", "return [{}];", "}\n"),
}  # fmt: skip


def written(functions: Sequence[Function], target: str, more: Mapping[str, str]) -> Source:
    """The file of some functions; `more` helpers beside those of the runtime."""
    functions = [f.each(plain) for f in functions]
    functions = [g for f in functions for g in _with_logarithm(f)]
    head = _SHAPES[target][0]
    printer = printer_of(target, functions)
    gap = "\n\n" if target in ("numpy", "mpmath") else "\n"
    body = gap.join(_function(f, target, printer) for f in functions)
    helpers = _copied({**more, **known_helpers(target)}, body, gap)
    for module in ("scipy.special", "functools"):
        head = f"import {module}\n" * (f"{module}." in helpers + body) + head
    head = "\n".join(sorted(head.splitlines()))
    text = gap.join(f"{part.strip()}\n" for part in (head, helpers, body) if part)
    return Source(text, target, {f.name: (len(f.arguments), len(f.values)) for f in functions})


def _function(f: Function, target: str, printer: Any) -> str:
    """One function: shared parts, then its values."""
    _, _, start, numbers, given, one, several, end = _SHAPES[target]
    f = f.each(stable)
    held = any(v.has(sympy.Integral) for v in f.values)  # whose variable no shared part may have
    taken = {*f.arguments, *(s for s, _ in f.shared)}
    fresh = (s for s in sympy.numbered_symbols("t") if s.name not in {x.name for x in taken})
    shared, values = ((), f.values) if held else sympy.cse(f.values, fresh, order="none")
    try:
        names = [printer.doprint(a) for a in f.arguments]
        lines = [given.format(printer.doprint(s), printer.doprint(v))
                 for s, v in (*f.shared, *shared)]  # fmt: skip
        texts = [re.sub(r"\s*\n\s*", " ", printer.doprint(v)) for v in values]
    except (PrintMethodNotImplementedError, KeyError) as error:
        what = re.findall(r"\w+", str(error).splitlines()[0])[-1]
        raise InputError(
            f"{f.name} holds {what}, which {target} does not have; put a drift in with drift=…, or "
            "emit 'mpmath', which has integrals, or 'latex'."
        ) from None
    lines = [re.sub(r"\s*\n\s*", " ", line) for line in lines]
    typed = ", ".join(f"double {n}" for n in names)
    if len(texts) > 1 and target == "c":
        typed = f"{typed}, double out[{len(texts)}]".removeprefix(", ")
        start = start.replace("double", "void", 1)
        lines += [f"out[{k}] = {text};" for k, text in enumerate(texts)]
    else:
        lines.append((one if len(texts) == 1 else several).format(", ".join(texts)))
    if numbers and names:
        lines = [*(numbers.format(n) for n in names), *lines]
    head = start.format(f.name, ", ".join(names), typed or "void", f.doc or f.name)
    return f"{head}\n" + "".join(f"    {line}\n" for line in lines) + end


def _by_printer(functions: Sequence[Function], printer: CodePrinter) -> Source:
    """Assignments in the language of a printer of one's own."""
    lines = []
    for f in functions:
        shared, values = sympy.cse(f.values, sympy.numbered_symbols("t"), order="none")
        several = [f"{f.name}_{k}" for k in range(len(values))] if values[1:] else [f.name]
        rows = (*f.shared, *shared, *zip(map(Symbol, several), values, strict=True))
        lines += [printer.doprint(v, assign_to=s) for s, v in rows]
    return Source("\n".join(lines) + "\n", type(printer).__name__, {})


# -- what a language lacks -------------------------------------------------------------------------


@cache
def known_helpers(target: str) -> dict[str, str]:
    """The functions of the target's runtime by their names, those that call before the called."""
    name = {"numpy": "runtime_numpy.py", "mpmath": "runtime_mpmath.py"}.get(target, "runtime.c")
    text = (Path(__file__).parent / name).read_text("utf-8")
    of = r"/\* (\w+): .*?^}\n" if name == "runtime.c" else r"(?:@\S+\n)?def (\w+)\(.*?(?=\n\n\n|\Z)"
    found = {m[1]: m[0] for m in re.finditer(of, text, re.S | re.M)}
    if name == "runtime.c":
        from symasym.emit.runtime_numpy import rule

        found["panel"] = "".join(
            f"static const double {n}[{x.size}] = {{{', '.join(map(repr, x.ravel().tolist()))}}};\n"
            for n, x in zip(("NODES", "WEIGHTS", "WITHIN", "LAST"), rule(), strict=True)
        ) + found["panel"]
    if target == "javascript":
        return {n: javascript(text) for n, text in found.items()}
    return {n: re.sub(r"\bPI\b", repr(math.pi), text) for n, text in found.items()}


def _copied(known: Mapping[str, str], text: str, gap: str) -> str:
    """The helpers that `text` calls, and those they call."""
    needed = set[str]()
    while True:
        text = re.sub(r'(?m)//.*$|/\*[^*]*\*/|"""[^"]*"""', "", text)  # but what is said of them
        found = {n for n in known if n not in needed and re.search(rf"\b{n}[(,]", text)}
        if not found:
            return f"\n{gap}".join(known[n].strip() for n in known if n in needed)
        needed |= found
        text = "".join(known[n] for n in found)


def javascript(c: str) -> str:
    """JavaScript of the C of runtime.c, which has the same statements."""
    for old, new in (
        (r"static (?:double|void) (\w+)\(", r"function \1("),
        (r" *\(void\)\w+;", ""),
        (r"(const )?\b(double|int) (\*?)(\w+)(\[\d+\])?(?=[,)])", r"\4"),
        (r"\b(static )?(const )?(double|int) (\w+)(\[\d+\])? = ", r"let \4 = "),
        (r"= \{([^}]*)\}", r"= [\1]"),
        (r"\bf(abs|max|min)\(", r"\1("),
        (r"\b(abs|a?cosh?|a?tanh?|max|min|exp|expm1|log1p|log|sqrt|sin|ceil|floor)\(", r"Math.\1("),
        (r"INFINITY", "Infinity"), (r"\bNAN\b", "NaN"), (r"\bPI\b", "Math.PI"),
    ):  # fmt: skip
        c = re.sub(old, new, c)
    return c


class Source(str):
    """Emitted source code: a str that knows its target and the names of its functions."""

    target: str
    functions: tuple[str, ...]
    _counts: Mapping[str, tuple[int, int]]

    def __new__(cls, text: str, target: str, counts: Mapping[str, tuple[int, int]]) -> Source:
        self = super().__new__(cls, text)
        self.target, self.functions, self._counts = target, tuple(counts), counts
        return self

    def write(self, path: str | PathLike[str]) -> Path:
        """Write the file; OutputError if it cannot be written."""
        write_bytes(path, self.encode())
        return Path(path)

    def load(self) -> SimpleNamespace:
        """The functions as callables: Python run as it is, C compiled by the system's compiler.

        Functions in C take floats and give a float, or a tuple of them.
        """
        if self.target == "c":
            return self._compiled()
        if self.target not in ("numpy", "mpmath"):
            raise InputError(f"{self.target} cannot be loaded into Python; write it to a file.")
        space: dict[str, Any] = {"__name__": "emitted"}
        exec(compile(str(self), "<emitted>", "exec"), space)
        return SimpleNamespace(**{name: space[name] for name in self.functions})

    def _compiled(self) -> SimpleNamespace:
        with tempfile.TemporaryDirectory() as folder:
            source, library = Path(folder, "emitted.c"), Path(folder, "emitted.so")
            source.write_text(self, "utf-8")
            command = ["cc", "-std=c99", "-O2", "-fPIC", "-shared", "-o", library, source, "-lm"]
            try:
                subprocess.run(command, check=True, capture_output=True)
            except (OSError, subprocess.CalledProcessError):
                raise InputError("cc did not compile the file; install a C compiler.") from None
            loaded = ctypes.CDLL(str(library))

        def callable_of(name: str, many: int) -> Any:
            of = loaded[name]
            of.restype = ctypes.c_double if many == 1 else None

            def call(*x: float) -> Any:
                out = (ctypes.c_double * many)()
                value = of(*map(ctypes.c_double, x), *([out] if many > 1 else []))
                return value if many == 1 else tuple(out)

            return call

        return SimpleNamespace(**{n: callable_of(n, many) for n, (_, many) in self._counts.items()})


# -- the verb --------------------------------------------------------------------------------------


def emit(
    what: Any,
    target: str | CodePrinter = "numpy",
    parameters: Mapping[str, Any] | None = None,
    *,
    drift: Drift | None = None,
    name: str = "f",
) -> Source:
    """Source code of a formula or an expression.

    Parameters
    ----------
    what : label, Formula, Function, or SymPy expression
        A formula of `symasym.formula` or its label, or an expression of your own (Piecewise
        included), or a tuple of them.
    target : {"numpy", "mpmath", "c", "javascript", "latex"} or a CodePrinter of SymPy
        A printer of your own gives one assignment to a line.
    parameters : mapping of str to number, optional
        Put into the formula exactly: ``"-0.4"`` is -2/5.
    drift : Drift, optional
        For the formulas of a general drift: V, phi and A are its own, and T (``"eq:Ttilde"``), C
        (``"eq:C"``), P (``"eq:P"``) and the stationary density (``"eq:pss"``) exact. Its free
        parameters become arguments.
    name : str
        What to call the function of an expression.

    Returns
    -------
    Source
        A str, with `write` and `load`. In scaled variables, as everywhere.

    Raises
    ------
    InputError
        For an unknown label or target, or a formula that the target has no functions for.

    Notes
    -----
    Where an exponential could overflow, the logarithm is a function, too: ``log_NAME``. Outside of
    the region in which a formula has a value, functions give nan.

    Examples
    --------
    >>> import symasym as sa
    >>> print(sa.emit("eq:Plarge2", "c", {"a_minus": 1, "a_plus": -1}))
    """
    from symasym.emit import drifts

    if not isinstance(target, CodePrinter):
        target = choice("target", target, TARGETS)
    values = {n: exact(n, x) for n, x in (parameters or {}).items()}
    what = Record.of(what) if isinstance(what, str) else what
    if target == "latex" and hasattr(what, "latex") and drift is None and not values:
        return Source(f"{what.latex()}\n", target, {})
    label, functions = _functions(what, name)
    more: dict[str, str] = {}
    if drift is not None:
        drift = drift.bind(**{n: values.pop(n) for n in drift.free if n in values})
        functions = drifts.put_in(functions, label, drift)
        more = {} if target in ("latex",) else drifts.helpers(drift, target)
    functions = [_folded(f, values) for f in functions]
    if isinstance(target, CodePrinter):
        return _by_printer(functions, target)
    if target != "latex":
        return written(functions, target, more)
    rows = (rf"\mathrm{{{f.name}}} &= {sympy.latex(v)}" for f in functions for v in f.values)
    return Source("\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}\n", target, {})


def _functions(what: Any, name: str) -> tuple[str, list[Function]]:
    """The label, and the functions of a formula or an expression."""
    label = getattr(what, "label", "")
    if isinstance(what, Function):
        return "", [what]
    if isinstance(what, Record):  # until `Formula` has functions()
        values = tuple(what.expression) if isinstance(what.expression, sympy.Tuple) else (what.expression,)
        name, about = re.sub(r"\W", "_", label.removeprefix("eq:")), f"{what.title} ({label})"
    elif callable(getattr(what, "functions", None)):  # a Formula, an Expansion
        return label, [*(what.functions() if label else what.functions(name))]
    else:
        about, values = "", ()
        with suppress(sympy.SympifyError, TypeError, ValueError, AttributeError):
            values = tuple(map(sympified, what if isinstance(what, (tuple, list)) else (what,)))
        if not values or not all(isinstance(v, Expr) for v in values):
            raise InputError(f"{shown(what)} is no formula, label or expression; give one of these.")
    symbols = sorted(set().union(*(v.free_symbols for v in values)), key=str)
    if odd := [n for n in (name, *(s.name for s in symbols)) if not is_name(n)]:
        raise InputError(f"{shown(odd[0])} is no name of letters, digits and _; rename it.")
    return label, [Function(name, tuple(symbols), values, about)]


def _folded(f: Function, values: Mapping[str, Any]) -> Function:
    """The function with numbers put in."""
    put = {s: Rational(*values[s.name].as_integer_ratio()) for s in f.arguments if s.name in values}
    if unknown := values.keys() - {s.name for s in f.arguments}:
        raise InputError(
            f"{f.name} has no parameter {min(unknown)}; it has "
            f"{', '.join(s.name for s in f.arguments)}."
        )
    rest = tuple(s for s in f.arguments if s not in put)
    return replace(f, arguments=rest).each(lambda e: e.subs(put) if put else e)
