"""Stand-alone Python of the standard library's `math`."""

from __future__ import annotations

from symasym.emit.program import DOUBLE, Body, Program, Ready, header
from symasym.emit.writing import comment, heading, helpers, signature_doc, text, wrapped

HELPERS = {
    "_exp": '''def _exp(x):
    return math.exp(x) if x < 709.78 else math.exp(x / 2) * math.exp(x / 2) if x < 1400 else math.inf
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
    used = helpers(code, HELPERS)
    top = comment(header(program, DOUBLE), "#")
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
    if len(function.arguments) > 1:
        lines += wrapped(f"{names} = map(float, ", names, "    ", end=")", brackets="()")
    elif names:
        lines.append(f"    {names} = float({names})")
    for body in function.bodies:
        lines += block(body, "python")
    if function.bodies[-1].conditions:
        lines.append(f'    raise ValueError("{function.outside}")')
    return "\n".join(lines)


def block(body: Body, target: str, indent: str = "    ") -> list[str]:
    """A case as an ``if``, its shared parts and its value."""
    lines = []
    if body.conditions:
        asked = " and ".join(text(c, target) for c in body.conditions)
        lines.append(f"{indent}if {asked}:")
        indent += "    "
    for symbol, value in body.shared:
        lines += wrapped(f"{symbol} = ", text(value, target), indent)
    values = ", ".join(text(v, target) for v in body.values)
    return [*lines, *wrapped("return ", values, indent)]
