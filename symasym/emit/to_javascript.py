"""JavaScript: an ES module without dependencies."""

from __future__ import annotations

from symasym.emit.program import DOUBLE, Body, Program, Ready, header
from symasym.emit.writing import comment, heading, helpers, signature_doc, text, wrapped

HELPERS = {
    "logaddexp": '''function logaddexp(x, y) {
  const high = Math.max(x, y);
  return Math.abs(high) === Infinity ? high : high + Math.log1p(Math.exp(-Math.abs(x - y)));
}
''',
    "exprel": '''function exprel(x) {
  return x === 0 ? 1 : Math.expm1(x) / x;
}
''',
    "exprel2": '''function exprel2(x) {
  if (Math.abs(x) > 0.5) return (Math.expm1(x) - x) / x / x;
  let total = 0;
  for (let n = 15; n > 1; n--) total = (1 + x * total) / n;
  return total;
}
''',
    "tanhc": '''function tanhc(x) {
  return x === 0 ? 1 : Math.tanh(x) / x;
}
''',
    "sinc": '''function sinc(x) {
  return x === 0 ? 1 : Math.sin(x) / x;
}
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n".join(_function(f) for f in functions)
    used = "\n".join([*helpers(code, HELPERS), ""])
    return "\n".join([*comment(header(program, DOUBLE), "//"), "", f"{used}{code}", ""])


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    lines = [
        f"/** {signature_doc(function)} */",
        *heading(f"export function {function.name}", list(function.arguments), " {"),
    ]
    if function.exp_of:
        call = f"return Math.exp({function.exp_of}"
        lines += wrapped(call, names, "  ", end=");", brackets="()", deeper="  ")
    for body in function.bodies:
        lines += _block(body)
    if function.bodies and function.bodies[-1].conditions:
        lines.append(f'  throw new RangeError("{function.outside}");')
    return "\n".join([*lines, "}"])


def _block(body: Body) -> list[str]:
    lines, indent = [], "  "
    if body.conditions:
        asked = " && ".join(text(c, "javascript") for c in body.conditions)
        lines.append(f"  if ({asked.replace('==', '===').replace('!=', '!==')}) {{")
        indent += "  "
    for symbol, value in body.shared:
        lines += wrapped(f"const {symbol} = ", text(value, "javascript"), indent, end=";", deeper="  ")
    values = ", ".join(text(v, "javascript") for v in body.values)
    brackets = "[]" if len(body.values) > 1 else ""
    lines += wrapped("return ", values, indent, end=";", brackets=brackets, deeper="  ")
    return [*lines, *(["  }"] if body.conditions else [])]
