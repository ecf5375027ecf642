"""C99: a source, and its header where that is wanted."""

from __future__ import annotations

import os
import shutil
from typing import Any

import sympy

from symasym.emit.forms import by_name
from symasym.emit.program import Program, Ready, header, in_doubles
from symasym.emit.targets.language import Language, helpers_of
from symasym.emit.writing import (
    comment,
    heading,
    helpers,
    signature_doc,
    wrapped,
)

C = Language(
    "c", end=";", constant="const double ", numbers="const double ", whole="const int ",
    brackets="{}", function="",
)  # fmt: skip


def render(program: Program, functions: list[Ready], name: str = "") -> tuple[str, str]:
    """The source and its header; the source declares its functions, or includes ``name.h``."""
    top = "\n".join(["/*", *comment(header(program, in_doubles(functions)), " *"), " */", ""])
    guard = f"SYMASYM_{''.join(c if c.isalnum() else '_' for c in name).upper()}_H"
    declared = "\n\n".join(_declared(f) for f in functions)
    head = f"{top}#ifndef {guard}\n#define {guard}\n\n{declared}\n\n#endif\n"
    code = "\n\n".join(_function(f) for f in functions)
    used = helpers(code, helpers_of("c", functions))
    includes = f'#include "{name}.h"\n\n#include <math.h>\n' if name else "#include <math.h>\n"
    start = [f"{top}{includes}", *([] if name else [declared, ""])]
    return "\n".join([*start, *used, code, ""]), head


def compiler() -> str | None:
    """The C compiler of this machine: ``CC``, else cc, gcc or clang; None where there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        path = shutil.which(name) if name else None
        if path:
            return path
    return None


def _signature(function: Ready, last: str = "") -> list[str]:
    arguments = [f"double {name}" for name in function.arguments]
    if function.count > 1:
        arguments.append(f"double out[{function.count}]")
    kind = "void" if function.count > 1 else "double"
    return heading(f"{kind} {function.name}", arguments or ["void"], last)


def _declared(function: Ready) -> str:
    doc = [signature_doc(function)]
    partial = function.bodies[-1].conditions if function.bodies else function.outside
    if partial:
        doc.append(f"NAN where {function.outside}.")
    return "\n".join([*("/* " + line + " */" for line in doc), *_signature(function, ";")])


def _of_u(function: Ready, e: Any) -> tuple[list[str], list[str]]:
    """`e` as a function of u that takes the arguments as an array; these as an array."""
    names = function.arguments
    places = {name: sympy.Symbol(f"p[{k}]", real=True) for k, name in enumerate(names)}
    e = by_name(e, places)
    held = {s.name for s in e.free_symbols}
    unused = [("p", any(name in held for name in map(str, places.values()))), ("u", "u" in held)]
    before = [
        f"static double {function.name}_at_(double u, const double *p)",
        "{",
        *(f"    (void){name};" for name, used in unused if not used),
        *C.returned(C.text(e), "    "),
        "}",
        "",
    ]
    return before, C.listed("p", list(names))


def _function(function: Ready) -> str:
    lines = [*_signature(function), "{"]
    before: list[str] = []
    if function.exp_of:
        names = ", ".join(function.arguments)
        lines += wrapped(f"return exp({function.exp_of}", names, "    ", end=");", brackets="()")
    if q := function.quadrature:
        before, given = _of_u(function, q.exponent)
        lines += [*given, *C.integral(function, q)]
    if first_passage := function.first_passage:
        before, given = _of_u(function, first_passage.drift)
        lines += [*given, *C.first_passage(function, first_passage)]
    for body in function.bodies:
        lines += C.block(body)
    if function.bodies and function.bodies[-1].conditions:
        lines.append("    return NAN;")
    return "\n".join([*before, *lines, "}"])
