"""C99: a source and its header."""

from __future__ import annotations

import os
import shutil

import sympy

from symasym.base.errors import InputError
from symasym.emit import uniform_time
from symasym.emit.forms import by_name
from symasym.emit.kernels import airy_magnitude
from symasym.emit.kernels.exact_c import in_c
from symasym.emit.program import Body, Passage, Program, Quadrature, Ready, header, in_doubles
from symasym.emit.targets.writing import (
    Written,
    comment,
    heading,
    helpers,
    signature_doc,
    text,
    wrapped,
)

HELPERS: dict[str, Written] = {
    "log_integral_": '''/* Gauss-Legendre, 16 points: those on the right, and their weights. */
static const double x_[8] = {
    0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
    0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499
};
static const double w_[8] = {
    0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
    0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096
};

typedef double integrand_(double u, const double *p);

static double panel_(integrand_ *g, const double *p, double a, double b, double top)
{
    const double m = (a + b) / 2.0, h = (b - a) / 2.0;
    double sum = 0.0;
    int k;
    for (k = 0; k < 8; k++)
        sum += w_[k] * (exp(g(m - h * x_[k], p) - top) + exp(g(m + h * x_[k], p) - top));
    return h * sum;
}

static double total_(
    integrand_ *g, const double *p, double a, double b, double top, int depth, double before)
{
    const double ga = g(a, p), gb = g(b, p), m = (a + b) / 2.0;
    /* The exponent's own rounding: no halving gets below it. */
    const double noise = 4e-16 * fabs(top);
    double halves, error;
    if (fmax(ga, gb) < top - 100.0)
        return 0.0;
    if (fabs(ga - gb) > 4.0 && depth < 100)
        return total_(g, p, a, m, top, depth + 1, before)
            + total_(g, p, m, b, top, depth + 1, before);
    halves = panel_(g, p, a, m, top) + panel_(g, p, m, b, top);
    error = fabs(halves - panel_(g, p, a, b, top));
    /* Where halving hardly helps, rounding is all there is. */
    if (!(error > (4e-15 + noise) * halves) || depth > 100
        || (error <= fmax(1e-9, 1e3 * noise) * halves && error > before / 16.0))
        return halves;
    return total_(g, p, a, m, top, depth + 1, error)
        + total_(g, p, m, b, top, depth + 1, error);
}

/* Logarithm of the integral of e^g; g is monotone between the points. */
static double log_integral_(integrand_ *g, const double *p, const double *points, int count)
{
    double top = -HUGE_VAL, sum = 0.0;
    int k;
    for (k = 0; k < count; k++)
        top = fmax(top, g(points[k], p));
    for (k = 0; k + 1 < count; k++)
        sum += total_(g, p, points[k], points[k + 1], top, 0, HUGE_VAL);
    return top + log(sum);
}
''',
    "between_": '''/* The same from one end to the other, cut at -1, 1 and the marks in (-1, 1). */
static double between_(
    integrand_ *g, const double *p, const double *marks, int count, double lower, double upper)
{
    double points[36];
    int k, number = 0;
    points[number++] = lower;
    if (lower < -1.0 && upper > -1.0)
        points[number++] = -1.0;
    for (k = 0; k < count; k++)
        if (lower < marks[k] && marks[k] < upper)
            points[number++] = marks[k];
    if (lower < 1.0 && upper > 1.0)
        points[number++] = 1.0;
    points[number++] = upper;
    return log_integral_(g, p, points, number);
}
''',
    "zeros_": '''static double polynomial_(const double *c, int n, double u)
{
    double sum = 0.0;
    while (n > 0)
        sum = sum * u + c[--n];
    return sum;
}

/* Zeros in (-1, 1) of c[0] + c[1] u + ... where its sign changes, from its slope's. */
static int zeros_(const double *c, int n, double *found)
{
    double slope[32], marks[34];
    int k, i, count, number = 0;
    if (n < 2)
        return 0;
    for (k = 1; k < n; k++)
        slope[k - 1] = k * c[k];
    count = zeros_(slope, n - 1, marks + 1);
    marks[0] = -1.0;
    marks[count + 1] = 1.0;
    for (k = 0; k <= count; k++) {
        double a = marks[k], b = marks[k + 1];
        const int low = polynomial_(c, n, a) > 0.0;
        if (low == (polynomial_(c, n, b) > 0.0))
            continue;
        for (i = 0; i < 64; i++) {
            const double m = (a + b) / 2.0;
            if ((polynomial_(c, n, m) > 0.0) == low)
                a = m;
            else
                b = m;
        }
        found[number++] = (a + b) / 2.0;
    }
    return number;
}
''',
    "log_time_": in_c(),
    "log_modulus_": airy_magnitude.in_c,
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
    top = "\n".join(["/*", *comment(header(program, in_doubles(functions)), " *"), " */", ""])
    guard = f"SYMASYM_{''.join(c if c.isalnum() else '_' for c in name).upper()}_H"
    declared = "\n\n".join(_declared(f) for f in functions)
    head = f"{top}#ifndef {guard}\n#define {guard}\n\n{declared}\n\n#endif\n"
    code = "\n\n".join(_function(f) for f in functions)
    used = "\n".join([*helpers(code, {**HELPERS, **uniform_time.helper("c", functions)}), ""])
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
    partial = function.bodies[-1].conditions if function.bodies else function.outside
    if partial:
        doc.append(f"NAN where {function.outside}.")
    return "\n".join([*("/* " + line + " */" for line in doc), *_signature(function, ";")])


def _integral(function: Ready) -> str:
    """An integral: its exponent, the points between which that is monotone, its value."""
    q = function.quadrature
    assert q is not None
    names = function.arguments
    known = q.coefficients or q.points
    if len(known) > 32:
        raise InputError("C code is emitted for polynomials up to degree 31; give a lower one.")
    # The integrand takes the arguments as an array.
    places = {name: sympy.Symbol(f"p[{k}]", positive=True) for k, name in enumerate(names)}
    exponent = by_name(q.exponent, places)
    lines = [
        f"static double {function.name}_at_(double u, const double *p)",
        "{",
        *wrapped("return ", text(exponent, "c"), "    ", end=";"),
        "}",
        "",
        *_signature(function),
        "{",
        f"    const double p[{len(names)}] = {{{', '.join(names)}}};",
    ]
    lines += _marks(q)
    ends = f"{text(q.lower, 'c')}, {text(q.upper, 'c')}"
    lines.append(f"    return between_({function.name}_at_, p, marks, count, {ends});")
    return "\n".join([*lines, "}"])


def _passage(function: Ready) -> str:
    """An escape time: its drift, where that is zero, its value."""
    q = function.passage
    assert q is not None
    names = function.arguments
    if len(q.coefficients) > 32 or len(q.points) > 128:
        raise InputError(
            "C code is emitted for polynomials up to degree 31 and drifts with up to 128 zeros and "
            "turns; emit another target."
        )
    places = {name: sympy.Symbol(f"p[{k}]", real=True) for k, name in enumerate(names)}
    drift = by_name(q.drift, places)
    if not any(s.name.startswith("p[") for s in drift.free_symbols):
        unused = ["    (void)p;"]
    else:
        unused = []
    lines = [
        f"static double {function.name}_drift_(double u, const double *p)",
        "{",
        *unused,
        *([] if drift.has(sympy.Symbol("u", real=True)) else ["    (void)u;"]),
        *wrapped("return ", text(drift, "c"), "    ", end=";"),
        "}",
        "",
        *_signature(function),
        "{",
        f"    const double p[{len(names)}] = {{{', '.join(names)}}};",
        f"    const double ends[2] = {{{', '.join(text(e, 'c') for e in q.ends)}}};",
    ]
    lines += _marks(q)
    value = f"{function.name}_drift_, p, ends, {text(q.rough, 'c')}, marks, count, kappa, r"
    lines += wrapped("return log_time_", value, "    ", end=";", brackets="()")
    return "\n".join([*lines, "}"])


def _uniform(function: Ready, q: Passage) -> str:
    """The uniform time: the drift's coefficients, its value or NAN."""
    count = len(q.coefficients)
    listed = ", ".join(text(c, "c") for c in q.coefficients)
    left, right = uniform_time.ends(q, "c")
    value = f"c, {count}, left, {len(left)}, right, {len(right)}, kappa, r"
    arrays = (("c", listed), ("left", ", ".join(left)), ("right", ", ".join(right)))
    sizes = (count, len(left), len(right))
    lines = [*_signature(function), "{"]
    for (name, values), size in zip(arrays, sizes, strict=True):
        first = f"const double {name}[{size}] = "
        lines += wrapped(first, values, "    ", end=";", brackets="{}")
    lines += wrapped("return log_uniform_", value, "    ", end=";", brackets="()")
    return "\n".join([*lines, "}"])


def _marks(q: Quadrature | Passage) -> list[str]:
    """Where the drift is zero in the layer: `marks`, and how many."""
    known = q.coefficients or q.points
    values = ", ".join(text(e, "c") for e in known)
    if q.coefficients:
        return [
            *wrapped(f"const double c[{len(known)}] = ", values, "    ", end=";", brackets="{}"),
            f"    double marks[{len(known)}];",
            f"    const int count = zeros_(c, {len(known)}, marks);",
        ]
    size = max(1, len(known))
    listed = values or "0.0"
    return [
        *wrapped(f"const double marks[{size}] = ", listed, "    ", end=";", brackets="{}"),
        f"    const int count = {len(known)};",
    ]


def _function(function: Ready) -> str:
    if function.quadrature:
        return _integral(function)
    if function.passage:
        if function.passage.uniform:
            return _uniform(function, function.passage)
        return _passage(function)
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
        asked = " && ".join(text(c, "c") for c in body.conditions)
        lines += wrapped("if ", asked, indent, end=" {", brackets="()")
        indent += "    "
    for symbol, value in body.shared:
        lines += wrapped(f"const double {symbol} = ", text(value, "c"), indent, end=";")
    values = [text(v, "c") for v in body.values]
    if len(values) == 1:
        lines += wrapped("return ", values[0], indent, end=";")
    for number, value in enumerate(values if len(values) > 1 else []):
        lines += wrapped(f"out[{number}] = ", value, indent, end=";")
    return [*lines, *(["    }"] if body.conditions else [])]
