"""C99: a source and its header."""

from __future__ import annotations

import os
import shutil

from symasym.emit.program import DOUBLE, Body, Program, Ready, header
from symasym.emit.writing import comment, heading, helpers, signature_doc, text, wrapped

HELPERS = {
    "logaddexp_": '''static double logaddexp_(double x, double y)
{
    const double high = x > y ? x : y;
    return isinf(high) ? high : high + log1p(exp(-fabs(x - y)));
}
''',
    "exprel_": '''static double exprel_(double x)
{
    return fabs(x) > 0.0 ? expm1(x) / x : 1.0;
}
''',
    "exprel2_": '''static double exprel2_(double x)
{
    double total = 0.0;
    int n;
    if (fabs(x) > 0.5)
        return (expm1(x) - x) / x / x;
    for (n = 15; n > 1; n--)
        total = (1.0 + x * total) / n;
    return total;
}
''',
    "tanhc_": '''static double tanhc_(double x)
{
    return fabs(x) > 0.0 ? tanh(x) / x : 1.0;
}
''',
    "sinc_": '''static double sinc_(double x)
{
    return fabs(x) > 0.0 ? sin(x) / x : 1.0;
}
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready], name: str) -> tuple[str, str]:
    """The source, which includes ``name.h``, and that header."""
    top = "\n".join(["/*", *comment(header(program, DOUBLE), " *"), " */", ""])
    guard = f"SYMASYM_{''.join(c if c.isalnum() else '_' for c in name).upper()}_H"
    declared = "\n\n".join(_declared(f) for f in functions)
    head = f"{top}#ifndef {guard}\n#define {guard}\n\n{declared}\n\n#endif\n"
    code = "\n\n".join(_function(f) for f in functions)
    used = "\n".join([*helpers(code, HELPERS), ""])
    return f'{top}#include "{name}.h"\n\n#include <math.h>\n\n{used}{code}\n', head


def compiler() -> str | None:
    """The C compiler of this machine: ``CC``, else cc, gcc or clang; None where there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    return None


def _signature(function: Ready, last: str = "") -> list[str]:
    arguments = [f"double {name}" for name in function.arguments]
    if function.count > 1:
        arguments.append(f"double out[{function.count}]")
    kind = "void" if function.count > 1 else "double"
    return heading(f"{kind} {function.name}", arguments or ["void"], last)


def _declared(function: Ready) -> str:
    doc = [signature_doc(function)]
    if function.bodies and function.bodies[-1].conditions:
        doc.append(f"NAN where {function.outside}.")
    return "\n".join([*("/* " + line + " */" for line in doc), *_signature(function, ";")])


def _function(function: Ready) -> str:
    lines = [*_signature(function), "{"]
    if function.exp_of:
        names = ", ".join(function.arguments)
        lines += wrapped(f"return exp({function.exp_of}", names, "    ", end=");", brackets="()")
    for body in function.bodies:
        lines += _block(body)
    if function.bodies and function.bodies[-1].conditions:
        lines.append("    return NAN;")
    return "\n".join([*lines, "}"])


def _block(body: Body) -> list[str]:
    lines, indent = [], "    "
    if body.conditions:
        lines.append(f"    if ({' && '.join(text(c, 'c') for c in body.conditions)}) {{")
        indent += "    "
    for symbol, value in body.shared:
        lines += wrapped(f"const double {symbol} = ", text(value, "c"), indent, end=";")
    values = [text(v, "c") for v in body.values]
    if len(values) == 1:
        lines += wrapped("return ", values[0], indent, end=";")
    for number, value in enumerate(values if len(values) > 1 else []):
        lines += wrapped(f"out[{number}] = ", value, indent, end=";")
    return [*lines, *(["    }"] if body.conditions else [])]
