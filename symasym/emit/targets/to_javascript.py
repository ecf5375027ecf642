"""JavaScript: an ES module without dependencies."""

from __future__ import annotations

from symasym.emit.program import Program, Ready, header, in_doubles
from symasym.emit.targets.language import Language, helpers_of
from symasym.emit.writing import argument_values, comment, heading, helpers, signature_doc, wrapped

JAVASCRIPT = Language(
    "javascript", "  ", ";", "const ", "const ", "const ", several="[]", function="(u) => "
)


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n".join(_function(f) for f in functions)
    used = helpers(code, helpers_of("javascript", functions))
    top = comment(header(program, in_doubles(functions)), "//")
    return "\n".join([*top, "", *used, code, ""])


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    lines = [
        f"/** {signature_doc(function)} */",
        *heading(f"export function {function.name}", list(function.arguments), " {"),
    ]
    if function.exp_of:
        call = f"return Math.exp({function.exp_of}"
        lines += wrapped(call, names, "  ", end=");", brackets="()", deeper="  ")
    return "\n".join([*lines, *JAVASCRIPT.body(function, JAVASCRIPT.first_passage, _refusal), "}"])


def _refusal(function: Ready) -> list[str]:
    values = argument_values(function, "${NAME}")
    lines = ["throw new RangeError(", f"  `{values}` +", f'    "{function.outside}",', ");"]
    return ["  " + line for line in lines]
