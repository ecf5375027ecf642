"""Stand-alone Python of the standard library's `math`."""

from __future__ import annotations

from symasym.emit.program import Program, Ready, header, in_doubles
from symasym.emit.targets.language import Language, helpers_of
from symasym.emit.writing import (
    comment,
    heading,
    helpers,
    refusal,
    signature_doc,
    wrapped,
)

PYTHON = Language("python")


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n\n".join(_function(f) for f in functions)
    used = helpers(code, helpers_of("python", functions))
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
    lines += [] if function.quadrature else floats(names)
    return "\n".join([*lines, *PYTHON.body(function, PYTHON.first_passage, refusal)])


def floats(names: str) -> list[str]:
    """The arguments as floats."""
    if "," in names:
        return wrapped(f"{names} = map(float, ", names, "    ", end=")", brackets="()")
    return [f"    {names} = float({names})"] if names else []
