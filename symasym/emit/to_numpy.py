"""NumPy: arrays that broadcast together, each case computed at its own points only."""

from __future__ import annotations

from symasym.emit.program import DOUBLE, Body, Program, Ready, header
from symasym.emit.to_python import block
from symasym.emit.writing import comment, heading, helpers, signature_doc, text, wrapped

HELPERS = {
    "_floats": '''def _floats(*arguments):
    return [np.asarray(argument, dtype=np.float64)[()] for argument in arguments]
''',
    "_cases": '''def _cases(arguments, outside, *cases):
    arrays = np.broadcast_arrays(*_floats(*arguments))
    shape = np.shape(arrays[0])
    arrays = [np.ravel(array) for array in arrays]
    result, left = np.empty(arrays[0].size), np.ones(arrays[0].size, dtype=bool)
    for conditions, value in cases:
        chosen = left.copy()
        for condition in conditions:
            # A later condition may have no value where an earlier one fails.
            chosen[chosen] = condition(*(array[chosen] for array in arrays))
        result[chosen] = value(*(array[chosen] for array in arrays))
        left &= ~chosen
    if left.any():
        raise ValueError(outside)
    return result.reshape(shape)[()]
''',
    "_exprel": '''def _exprel(x):
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, np.expm1(safe) / safe)[()]
''',
    "_exprel2": '''def _exprel2(x):
    small = np.where(np.abs(x) > 0.5, 0.0, x)
    total = np.zeros_like(small)
    for n in range(15, 1, -1):
        total = (1 + small * total) / n
    large = np.where(np.abs(x) > 0.5, x, 1.0)
    return np.where(np.abs(x) > 0.5, (np.expm1(large) - large) / large / large, total)[()]
''',
    "_tanhc": '''def _tanhc(x):
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, np.tanh(safe) / safe)[()]
''',
    "_sinc": '''def _sinc(x):
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, np.sin(safe) / safe)[()]
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n\n".join(_function(f) for f in functions)
    used = helpers(code, HELPERS)
    top = comment(header(program, DOUBLE, "Arguments are numbers or arrays that broadcast."), "#")
    return "\n".join([*top, "", "import numpy as np", "", "", "\n\n".join([*used, ""]) + code, ""])


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    head = [
        *heading(f"def {function.name}", list(function.arguments), ":"),
        f'    """{signature_doc(function)}"""',
    ]
    if function.exp_of:
        head.append('    with np.errstate(over="ignore", under="ignore"):')
        call = f"return np.exp({function.exp_of}"
        return "\n".join([*head, *wrapped(call, names, " " * 8, end=")", brackets="()")])
    if len(function.bodies) == 1 and not function.bodies[0].conditions:
        listed = f"[{names}]" if len(function.arguments) == 1 else names
        start = wrapped(f"{listed} = _floats", names, "    ", brackets="()") if names else []
        return "\n".join([*head, *start, *block(function.bodies[0], "numpy")])
    parts = []
    for number, body in enumerate(function.bodies):
        lines = heading(f"def _{function.name}_{number}", list(function.arguments), ":")
        bare = Body((), body.shared, body.values)
        parts.append("\n".join([*lines, *block(bare, "numpy")]))
    call = [f'    return _cases(\n        ({names},),\n        "{function.outside}",']
    for number, body in enumerate(function.bodies):
        asked = [f"lambda {names}: {text(c, 'numpy')}" for c in body.conditions]
        listed = "".join(f"{a}, " for a in asked).rstrip()
        value = f"({listed}), _{function.name}_{number}"
        call += wrapped("", value, "        ", end=",", brackets="()")
    return "\n\n\n".join([*parts, "\n".join([*head, *call, "    )"])])
