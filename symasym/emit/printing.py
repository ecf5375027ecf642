"""Source code of formulas by SymPy's printers and common subexpression elimination.

A `Function` has a name, arguments and values. If a value contains exponentials that may overflow,
its logarithm is emitted as a function, too. Functions that a language lacks are defined in
``runtime.c`` and ``runtime.py``, from which each file receives a copy of those that it calls; the
JavaScript versions are the C ones without types.
"""

from __future__ import annotations

import builtins
import keyword
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, reduce
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import sympy
from sympy import Expr, S, Symbol
from sympy.codegen.cfunctions import expm1, log1p
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import PrintMethodNotImplementedError
from sympy.printing.jscode import JavascriptCodePrinter
from sympy.printing.numpy import SciPyPrinter
from sympy.printing.pycode import MpmathPrinter

from symasym.base.errors import InputError
from symasym.base.files import write_bytes

LAM = Symbol("lam", positive=True)


def own(name: str) -> Any:
    """A real function of that name, which SymPy leaves unevaluated."""
    return type(name, (sympy.Function,), {"is_real": True})


@dataclass(frozen=True)
class Function:
    """A function of `arguments`; its values contain the symbols that `shared` defines first."""

    name: str
    arguments: tuple[Symbol, ...]
    values: tuple[Expr, ...]
    doc: str = ""
    shared: tuple[tuple[Symbol, Expr], ...] = ()

    def each(self, change: Callable[[Expr], Expr]) -> Function:
        """The function with `change` applied to each of its expressions."""
        shared = tuple((s, change(v)) for s, v in self.shared)
        return replace(self, values=tuple(map(change, self.values)), shared=shared)

    def in_code(self) -> Function:
        """The function with names that are valid in code, each with one meaning."""
        name, words = code_name(self.name), dict[Symbol, str]()
        for s in (*self.arguments, *dict(self.shared)):
            words[s] = code_name(s.name)
            while [name, f"log_{name}", *words.values()].count(words[s]) > 1:
                words[s] += "_"
        put = {s: Symbol(word, **s._assumptions_orig) for s, word in words.items()}
        arguments, shared = map(put.get, self.arguments), ((put[s], v) for s, v in self.shared)
        f = replace(self, name=name, arguments=tuple(arguments), shared=tuple(shared))
        return f.each(lambda e: e.xreplace(put))


def code_name(name: str) -> str:
    """``a^-`` as ``a_minus``, ``V''(u1)`` as ``V2_u1``, ``V^(4)(-1)`` as ``V4_m1``."""
    word = name.replace("^-", "_minus").replace("^+", "_plus").replace("^(", "")
    word = re.sub(r"'+", lambda m: str(len(m[0])), word)
    word = re.sub(r"(?<=\()-|-(?!\w)", "m", re.sub(r"\+(?!\w)", "p", word))
    return re.sub(r"\W+", "_", word).strip("_") or "value"


# -- one printer a language ------------------------------------------------------------------------


def _of_two(verb: str) -> Any:
    """A NumPy function of two arrays, applied to any number of them."""
    return lambda self, e: reduce(f"numpy.{verb}({{}}, {{}})".format, map(self._print, e.args))


class _NumPy(SciPyPrinter):  # type: ignore[misc]
    _print_Max, _print_Min = _of_two("maximum"), _of_two("minimum")
    _print_And, _print_Or = _of_two("logical_and"), _of_two("logical_or")

    def _print_Piecewise(self, e: Any) -> str:
        (value, condition), *others = e.args
        rest = self._print(sympy.Piecewise(*others) if others else S.NaN)
        return f"numpy.where({self._print(condition)}, {self._print(value)}, {rest})[()]"

    def _print_Pi(self, e: Any) -> str:
        return "numpy.pi"

    def _print_Function(self, e: Any) -> str:
        text = str(super()._print_Function(e))  # a sweep is vectorised over kappa only
        return f"each({text.replace('(', ', ', 1)}" if isinstance(e.args[-1], sympy.Tuple) else text

    def _print_hyper(self, e: Any) -> str:
        return f"scipy.special.hyp2f1({', '.join(map(self._print, (*e.ap, *e.bq, e.argument)))})"


class _Braces:
    """For languages without an operator for powers: x*x for x^2, and constants as numbers."""

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

    def _print_hyper(self, e: Any) -> str:
        """The two hypergeometric functions of the uniform formula."""
        if (*e.ap, *e.bq) == (S.Half, 1, S.Half * 3):
            return f"artanhc({self._print(e.argument)})"  # type: ignore[attr-defined]
        if {*e.ap} == {S.One / 3, -S.One / 3} and [*e.bq] == [S.Half]:
            return f"third({self._print(1 - 2 * e.argument)})"  # type: ignore[attr-defined]
        raise PrintMethodNotImplementedError("hyper")


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
    "numpy": _NumPy, "mpmath": MpmathPrinter, "c": _C, "javascript": _JavaScript,
}  # fmt: skip
TARGETS = (*PRINTERS, "latex")
_OWN = ("logaddexp", "erfcx", "dawsn", "drift", "end", "rate", "log")
_AIRY = ("airyai", "airyaiprime", "airybi", "airybiprime")


def _as(text: str) -> Any:
    """A function that is printed as an expression."""
    return [(lambda *x: True, text.format)]


_BRACES = {f: _as(f"airy({{0}}, {k})") for k, f in enumerate(_AIRY)}
_NAMED: dict[str, dict[str, Any]] = {
    "numpy": {"logaddexp": "numpy.logaddexp", "erfcx": "scipy.special.erfcx",
              "dawsn": "scipy.special.dawsn", "log": "numpy.log"},
    "mpmath": {
        **{f: f"mpmath.{f}" for f in ("expm1", "log1p", "erfi", *_AIRY[::2])},
        **{f"{f}prime": _as(f"mpmath.{f}({{0}}, derivative=1)") for f in _AIRY[::2]},
        "erfcx": _as("(mpmath.exp(({0})**2)*mpmath.erfc({0}))"),
        "dawsn": _as("(mpmath.exp(-({0})**2)*mpmath.erfi({0})*mpmath.sqrt(mpmath.pi)/2)"),
    },
    "c": _BRACES,
    "javascript": {**_BRACES, "expm1": "Math.expm1", "log1p": "Math.log1p", "erf": "erf_",
                   "log": "Math.log"},
}  # fmt: skip
# Reserved words of the languages.
_WORDS = """numpy scipy mpmath Math out y0 y1 j0 j1 jn yn const double exp fabs float fmax fmin int
    log long pow sqrt char void short signed static struct switch typedef union unsigned extern enum
    sin cos tan tanh sinh cosh default case do goto export function let new null this throw var
    catch delete eval arguments class extends super typeof instanceof yield""".split()  # noqa: SIM905


def reserved(target: str) -> set[str]:
    """Names that no function may have; arguments with these names get a trailing underscore."""
    return {*_WORDS, *_OWN, *helpers(target), *keyword.kwlist, *vars(builtins)}


def printer_of(target: str, functions: Sequence[Function]) -> Any:
    """The printer, with the functions of the file and the helpers as known functions."""
    names = [*_OWN, *helpers(target), *(f.name for f in functions)]
    settings: dict[str, Any] = {"user_functions": {n: n for n in names} | _NAMED[target]}
    settings |= {"math_macros": {}} if target == "c" else {}
    printer = PRINTERS[target](settings)
    printer.reserved_words = reserved(target).union(names)
    return printer


# -- numerically stable forms ----------------------------------------------------------------------


def log_form(e: Expr) -> Expr | None:
    """log(e) of a positive sum or product with exponentials; None if the sign is unknown."""
    if isinstance(e, sympy.exp):
        return e.args[0]
    if not e.has(sympy.exp):
        return sympy.log(e) if e.is_positive else None
    if e.is_Pow and (base := log_form(e.base)) is not None:
        return e.exp * base
    logs = [log_form(a) for a in e.args] if e.is_Mul or e.is_Add else [None]
    if None in logs:
        return None
    return sympy.Add(*logs) if e.is_Mul else reduce(own("logaddexp"), logs)


def stable(e: Expr) -> Expr:
    """`e` with expm1, log1p and logaddexp in place of expressions that cancel.

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
    """`e` with an exponential and Dawson's integral in place of erfi, which overflows."""
    front = 2 / sympy.sqrt(sympy.pi)
    return e.replace(sympy.erfi, lambda x: front * sympy.exp(x**2) * own("dawsn")(x))


def _with_logarithm(f: Function) -> Iterator[Function]:
    """The function, preceded by its logarithm if the value itself may overflow."""
    log = log_form(f.values[0]) if len(f.values) == 1 and f.values[0].has(sympy.exp) else None
    if log is not None:
        yield replace(f, name=f"log_{f.name}", values=(log,), doc=f"Logarithm of: {f.doc}")
        f = replace(f, values=(sympy.exp(own(f"log_{f.name}")(*f.arguments)),), shared=())
    yield f


# -- files -----------------------------------------------------------------------------------------

# Start of a file, start of a function, conversion of an argument, assignment, return of one value,
# of several, end of a function, separator of functions.
_DEF = 'def {0}({1}):\n    {4}"""{3}"""'
SHAPES = {
    "numpy": ("import numpy\n", f'@numpy.errstate(all="ignore")\n{_DEF}',
              "{0} = numpy.float64({0})", "{} = {}", "return {}", "return ({})", "", "\n\n"),
    "mpmath": ("import mpmath\n", f"@mpmath.extradps(10, normalize_output=True)\n{_DEF}",
               "{0} = mpmath.mpmathify({0})", "{} = {}", "return {}", "return ({})", "", "\n\n"),
    "c": ("#include <math.h>\n", "// {3}\ndouble {0}({2})\n{{", "", "const double {} = {};",
          "return {};", "", "}\n", "\n"),
    "javascript": ("", "// {3}\nexport function {0}({1}) {{", "", "const {} = {};", "return {};",
                   "return [{}];", "}\n", "\n"),
}  # fmt: skip


def written(functions: Sequence[Function], target: str, more: Mapping[str, str]) -> Source:
    """The file with these functions; `more` has helpers in addition to those of the runtime."""
    functions = [g for f in functions for g in _with_logarithm(f.each(plain))]
    head, *_, gap = SHAPES[target]
    printer = printer_of(target, functions)
    body = gap.join(_function(f, target, printer) for f in functions)
    known, needed, text = {**more, **helpers(target)}, set[str](), body
    while text:
        text = re.sub(r'(?m)//.*$|/\*[^*]*\*/|"""[^"]*"""', "", text)  # without comments
        found = {n for n in known if n not in needed and re.search(rf"(?<![.\w]){n}\b", text)}
        needed |= found
        text = "".join(known[n] for n in found)
    copied = f"\n{gap}".join(known[n].strip() for n in known if n in needed)
    for module in ("numpy", "scipy.integrate", "scipy.special"):
        if f"{module}." in copied + body and module not in head and target in ("numpy", "mpmath"):
            head += f"import {module}\n"
    whole = gap.join(f"{part.strip()}\n" for part in (head, copied, body) if part)
    return Source(whole, target, (f.name for f in functions))


def in_common(values: Iterable[Any], names: Iterable[Any]) -> Any:
    """Common subexpressions, without any in a variable of integration, and the values by them."""
    within = {x for v in values for i in v.atoms(sympy.Integral) for x in i.variables}
    return sympy.cse(values, names, order="none", ignore=within)


def _function(f: Function, target: str, printer: Any) -> str:
    """The text of one function: common subexpressions, then its values."""
    _, start, numbers, given, one, several, end, _ = SHAPES[target]
    f = f.each(stable)
    pieces = set().union(*(v.atoms(sympy.Piecewise) for v in f.values))
    taken = {s.name for s in (*f.arguments, *(s for s, _ in f.shared))}
    fresh = (s for s in sympy.numbered_symbols("t") if s.name not in taken)
    shared, values = in_common(f.values, fresh)
    try:
        names = [printer.doprint(a) for a in f.arguments]
        rows = [(printer.doprint(s), printer.doprint(v)) for s, v in (*f.shared, *shared)]
        texts = [printer.doprint(v) for v in values]
    except (PrintMethodNotImplementedError, KeyError) as error:
        what = re.findall(r"\w+", str(error).splitlines()[0])[-1]
        raise InputError(
            f"{f.name} holds {what}, which {target} lacks; bind the drift, or emit 'latex'."
        ) from None
    lines = [numbers.format(n) for n in names if numbers] + [given.format(*row) for row in rows]
    where = [p.args[0].cond for p in pieces if p.args[1:] == ((S.NaN, True),)]
    for c in where if numbers else ():
        test = f"{'numpy.any' * (target == 'numpy')}({printer.doprint(c)})"
        lines.append(f"if not {test}: raise ValueError('{f.name} has a value only where {c}')")
    typed = [f"double {n}" for n in names]
    if target == "c" and len(texts) > 1:
        start = start.replace("double", "void", 1)
        typed.append(f"double out[{len(texts)}]")
        lines += [f"out[{k}] = {text};" for k, text in enumerate(texts)]
    else:
        lines.append((one if len(texts) == 1 else several).format(", ".join(texts)))
    doc = f.doc or f.name
    if where:
        doc += f"; it has a value where {sympy.And(*where)}, and is nan elsewhere"
    doc = " ".join(doc.split()).replace('"', "'")  # cannot end the string
    raw = "r" * ("\\" in doc)
    head = start.format(f.name, ", ".join(names), ", ".join(typed) or "void", doc, raw)
    lines = [re.sub(r"\s*\n\s*", " ", line) for line in lines]
    return f"{head}\n" + "".join(f"    {line}\n" for line in lines) + end


# What stands in runtime.py for NumPy's floats -> what replaces it for mpmath's numbers.
_ELEMENTWISE = (
    (r"numpy\.(log|logaddexp)\b", r"\1"),
    (r"numpy\.exp\b", "numpy.frompyfunc(mpmath.exp, 1, 1)"),
    (r"scipy\.special\.hyp1f1", "numpy.frompyfunc(mpmath.hyp1f1, 3, 1)"),
    (r"numpy\.finfo\(float\)", "mpmath"),
    (r"numpy\.polynomial\.legendre\.leggauss\(12\)", "gauss()"),
)


@cache
def helpers(target: str) -> dict[str, str]:
    """The functions of the target's runtime by name."""
    folder = Path(__file__).parent
    if target in ("numpy", "mpmath"):
        text, pattern = (folder / "runtime.py").read_text("utf-8"), r"def (\w+)\(.*?(?=\n\n\n|\Z)"
        for old, new in _ELEMENTWISE if target == "mpmath" else ():
            text = re.sub(old, new, text)
        return {m[1]: m[0] for m in re.finditer(pattern, text, re.S)}
    from symasym.emit.runtime import rule

    text = (folder / "runtime.c").read_text("utf-8")
    found = {m[1]: m[0] for m in re.finditer(r"/\* (\w+): .*?^}\n", text, re.S | re.M)}
    tables = zip(("NODES", "WEIGHTS", "WITHIN", "LAST"), rule(), strict=True)  # type: ignore[no-untyped-call]
    rows = ((n, x.size, ", ".join(map(repr, x.ravel().tolist()))) for n, x in tables)
    texts = (f"static const double {n}[{size}] = {{{row}}};\n" for n, size, row in rows)
    found["panel"] = "".join(texts) + found["panel"]
    found = {n: re.sub(r"\bPI\b", repr(math.pi), text) for n, text in found.items()}
    return {n: javascript(x) for n, x in found.items()} if target == "javascript" else found


def javascript(c: str) -> str:
    """The C of runtime.c as JavaScript, which has the same statements."""
    for old, new in (
        (r"static (?:double|void) (\w+)\(", r"function \1("),
        (r"(const )?\b(double|int) (\*?)(\w+)(\[\d+\])?(?=[,)])", r"\4"),
        (r"\b(static )?(const )?(double|int) (\w+)(\[\d+\])? = ", r"let \4 = "),
        (r"= \{([^}]*)\}", r"= [\1]"), (r"\bf(abs|max|min)\(", r"\1("),
        (r"\b(abs|a?cosh?|a?tanh?|max|min|exp|expm1|log1p|log|sqrt|sin|ceil|floor)\(", r"Math.\1("),
        ("INFINITY", "Infinity"), (r"\bNAN\b", "NaN"),
    ):  # fmt: skip
        c = re.sub(old, new, c)
    return c


class Source(str):
    """Emitted source code: a str that knows its target and the names of its functions."""

    target: str
    functions: tuple[str, ...]

    def __new__(cls, text: str, target: str, functions: Iterable[str] = ()) -> Source:
        self = super().__new__(cls, text)
        self.target, self.functions = target, tuple(functions)
        return self

    def write(self, path: str | PathLike[str]) -> Path:
        """Write the file; OutputError if it cannot be written."""
        write_bytes(path, self.encode())
        return Path(path)

    def load(self) -> SimpleNamespace:
        """The functions of a file in Python as callables."""
        if self.target not in ("numpy", "mpmath"):
            raise InputError(f"{self.target} cannot be loaded into Python; write it to a file.")
        space: dict[str, Any] = {"__name__": "emitted"}
        exec(compile(str(self), "<emitted>", "exec"), space)
        return SimpleNamespace(**{name: space[name] for name in self.functions})
