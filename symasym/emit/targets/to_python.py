"""Stand-alone Python of the standard library's `math`."""

from __future__ import annotations

from symasym.emit import uniform_time
from symasym.emit.kernels import airy_magnitude
from symasym.emit.kernels.exact_python import in_python
from symasym.emit.program import Body, Passage, Program, Ready, header, in_doubles
from symasym.emit.targets.writing import (
    Written,
    comment,
    heading,
    helpers,
    refusal,
    signature_doc,
    text,
    wrapped,
)

ZEROS = '''def _zeros(c):
    """Zeros in (-1, 1) of c[0] + c[1] u + ... where its sign changes, from its slope's."""
    if len(c) < 2:
        return []

    def value(u):
        total = 0
        for x in reversed(c):
            total = total * u + x
        return total

    marks, found = [-1, *_zeros([k * x for k, x in enumerate(c)][1:]), 1], []
    for a, b in zip(marks, marks[1:]):
        low = value(a) > 0
        if low == (value(b) > 0):
            continue
        for _ in range(64):
            m = (a + b) / 2
            a, b = (m, b) if (value(m) > 0) == low else (a, m)
        found.append((a + b) / 2)
    return found
'''

_LOG_INTEGRAL = '''# Gauss-Legendre, 16 points: those on the right, and their weights.
_X = OPEN
    0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
    0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499,
CLOSE
_W = OPEN
    0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
    0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096,
CLOSE


def _log_integral(g, points):
    """Logarithm of the integral of e^g; g is monotone between the points."""
    top = max(map(g, points))
    # The exponent's own rounding: no halving gets below it.
    noise = 4e-16 * abs(top)

    def panel(a, b):
        m, h = (a + b) / 2, (b - a) / 2
PANEL

    def total(a, b, depth, before):
        ga, gb, m = g(a), g(b), (a + b) / 2
        if max(ga, gb) < top - 100:
            return 0.0
        if abs(ga - gb) > 4 and depth < 100:
            return total(a, m, depth + 1, before) + total(m, b, depth + 1, before)
        halves = panel(a, m) + panel(m, b)
        error = abs(halves - panel(a, b))
        # Where halving hardly helps, rounding is all there is.
        rounding = error <= max(1e-9, 1e3 * noise) * halves and error > before / 16
        if error <= (4e-15 + noise) * halves or rounding or depth > 100:
            return halves
        return total(a, m, depth + 1, error) + total(m, b, depth + 1, error)

    return top + MODULE.log(sum(total(a, b, 0, MODULE.inf) for a, b in zip(points, points[1:])))
'''


def log_integral(module: str, opening: str, closing: str, panel: str) -> str:
    """The helper with the target's own arrays and its own way to add up a panel."""
    found = _LOG_INTEGRAL.replace("OPEN", opening).replace("CLOSE", closing)
    return found.replace("PANEL", panel).replace("MODULE", module)


HELPERS: dict[str, Written] = {
    "_log_integral": log_integral(
        "math",
        "(",
        ")",
        """        return h * sum(
            w * (math.exp(g(m - h * x) - top) + math.exp(g(m + h * x) - top))
            for x, w in zip(_X, _W)
        )""",
    ),
    "_zeros": ZEROS,
    "_log_time": in_python(),
    "_log_modulus": airy_magnitude.in_python,
    "_exp": '''def _exp(x):
    # math.exp raises where this is infinite.
    return math.exp(x) if x < 709.78 else math.exp(x - 9) * math.exp(9) if x < 718 else math.inf
''',
    "_expm1": '''def _expm1(x):
    return math.expm1(x) if x < 709 else _exp(x)
''',
    "_sinh": '''def _sinh(x):
    return math.copysign(_exp(abs(x)) / 2, x) if abs(x) > 700 else math.sinh(x)
''',
    "_cosh": '''def _cosh(x):
    return _exp(abs(x)) / 2 if abs(x) > 700 else math.cosh(x)
''',
    "_logaddexp": '''def _logaddexp(x, y):
    high = max(x, y)
    return high if math.isinf(high) else high + math.log1p(math.exp(-abs(x - y)))
''',
    "_exprel": '''def _exprel(x):
    return 1.0 if x == 0 else _expm1(x) / x
''',
    "_exprel2": '''def _exprel2(x):
    if abs(x) > 0.5:
        return (_expm1(x) - x) / x / x
    total = 0.0
    for n in range(15, 1, -1):
        total = (1 + x * total) / n
    return total
''',
    "_tanhc": '''def _tanhc(x):
    return 1.0 if x == 0 else math.tanh(x) / x
''',
    "_sinc": '''def _sinc(x):
    return 1.0 if x == 0 else math.sin(x) / x
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n\n".join(_function(f) for f in functions)
    used = helpers(code, {**HELPERS, **uniform_time.helper("python", functions)})
    top = comment(header(program, in_doubles(functions)), "#")
    return "\n".join([*top, "", "import math", "", "", "\n\n".join([*used, ""]) + code, ""])


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    lines = [
        *heading(f"def {function.name}", list(function.arguments), ":"),
        f'    """{signature_doc(function)}"""',
    ]
    if function.exp_of:
        lines += wrapped(f"return _exp({function.exp_of}", names, "    ", end=")", brackets="()")
        return "\n".join(lines)
    if function.quadrature:
        return "\n".join([*lines, *integral(function, "python")])
    if function.passage:
        return "\n".join([*lines, *passage(function, "python")])
    if len(function.arguments) > 1:
        lines += wrapped(f"{names} = map(float, ", names, "    ", end=")", brackets="()")
    elif names:
        lines.append(f"    {names} = float({names})")
    for body in function.bodies:
        lines += block(body, "python")
    if function.bodies[-1].conditions:
        lines += refusal(function)
    return "\n".join(lines)


def integral(function: Ready, target: str) -> list[str]:
    """The body of an integral: the points between which its exponent is monotone, its value."""
    q = function.quadrature
    assert q is not None
    inner = ", ".join(text(p, target) for p in q.points)
    if q.coefficients:
        inner = f"*_zeros([{', '.join(text(c, target) for c in q.coefficients)}])"
    marks = ", ".join(["-1", *([inner] if inner else []), "1"])
    if q.over_the_layer:
        lines = wrapped("points = ", marks, "    ", brackets="[]")
    else:
        low, high = text(q.lower, target), text(q.upper, target)
        within = f"{low}, *(p for p in marks if {low} < p < {high}), {high}"
        lines = wrapped("marks = ", marks, "    ", brackets="[]")
        lines += wrapped("points = ", within, "    ", brackets="[]")
    first = "ctx, " if target == "mpmath" else ""
    value = f"{first}lambda u: {text(q.exponent, target)}, points"
    return [*lines, *wrapped("return _log_integral", value, "    ", brackets="()")]


def passage(function: Ready, target: str) -> list[str]:
    """The body of an escape time: its drift, where that is zero, its value."""
    q = function.passage
    assert q is not None
    zeros = f"[{', '.join(text(p, target) for p in q.points)}]"
    if q.coefficients:
        zeros = f"_zeros([{', '.join(text(c, target) for c in q.coefficients)}])"
    names = ", ".join(function.arguments)
    lines = wrapped(f"{names} = map(float, ", names, "    ", end=")", brackets="()")
    if q.uniform:
        return [*lines, *_uniform(function, q, target)]
    lines += ["", "    def drift(u):", *wrapped("return ", text(q.drift, target), " " * 8), ""]
    ends = ", ".join(text(e, target) for e in q.ends)
    value = f"drift, ({ends}), {text(q.rough, target)}, {zeros}, kappa, r"
    return [*lines, *wrapped("return _log_time", value, "    ", brackets="()")]


def _uniform(function: Ready, q: Passage, target: str) -> list[str]:
    """The body of the uniform time: the drift's coefficients, its value if there is one."""
    listed = ", ".join(text(c, target) for c in q.coefficients)
    ends = ", ".join(f"[{', '.join(e)}], {len(e)}" for e in uniform_time.ends(q, target))
    value = f"c, {len(q.coefficients)}, {ends}, kappa, r"
    return [
        *wrapped("c = ", listed, "    ", brackets="[]"),
        "    try:",
        *wrapped("found = _log_uniform", value, " " * 8, brackets="()"),
        "    except (ArithmeticError, ValueError):",
        "        found = math.nan",
        "    if math.isnan(found):",
        *("    " + line for line in refusal(function)),
        "    return found",
    ]


def block(body: Body, target: str, indent: str = "    ") -> list[str]:
    """A case as an ``if``, its shared parts and its value."""
    lines = []
    if body.conditions:
        asked = " and ".join(text(c, target) for c in body.conditions)
        lines += wrapped("if ", asked, indent, end=":")
        indent += "    "
    for symbol, value in body.shared:
        lines += wrapped(f"{symbol} = ", text(value, target), indent)
    values = ", ".join(text(v, target) for v in body.values)
    return [*lines, *wrapped("return ", values, indent)]
