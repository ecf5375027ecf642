"""NumPy: arrays that broadcast together, each case computed at its own points only."""

from __future__ import annotations

from symasym.emit.program import Body, Program, Ready, header, in_doubles
from symasym.emit.to_python import block, integral
from symasym.emit.writing import comment, heading, helpers, signature_doc, text, wrapped

HELPERS = {
    "_log_integral": '''# Gauss-Legendre, 16 points: those on the right, and their weights.
_X = np.array([
    0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
    0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499,
])
_W = np.array([
    0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
    0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096,
])


def _log_integral(g, points):
    """Logarithm of the integral of e^g; g is monotone between the points."""
    top = max(map(g, points))
    # The exponent's own rounding: no halving gets below it.
    noise = 4e-16 * abs(top)

    def panel(a, b):
        m, h = (a + b) / 2, (b - a) / 2
        left, right = np.exp(g(m - h * _X) - top), np.exp(g(m + h * _X) - top)
        return h * np.dot(_W, left + right)

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

    return top + np.log(sum(total(a, b, 0, np.inf) for a, b in zip(points, points[1:])))
''',
    "_zeros": '''def _zeros(c):
    """Zeros in (-1, 1) of c[0] + c[1] u + ... where its sign changes, from its slope's."""
    if len(c) < 2:
        return []

    def value(u):
        total = 0.0
        for x in reversed(c):
            total = total * u + x
        return total

    marks, found = [-1.0, *_zeros([k * x for k, x in enumerate(c)][1:]), 1.0], []
    for a, b in zip(marks, marks[1:]):
        low = value(a) > 0
        if low == (value(b) > 0):
            continue
        for _ in range(64):
            m = (a + b) / 2
            a, b = (m, b) if (value(m) > 0) == low else (a, m)
        found.append((a + b) / 2)
    return found
''',
    "_each": '''def _each(function, *arguments):
    """A function of numbers, called once for each set of them that is there."""
    arrays = np.broadcast_arrays(*_floats(*arguments))
    rows, place = np.unique(np.stack([np.ravel(a) for a in arrays]), axis=1, return_inverse=True)
    values = np.array([function(*row) for row in rows.T])
    return values[np.ravel(place)].reshape(np.shape(arrays[0]))[()]
''',
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
        if chosen.any():
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
    top = comment(
        header(program, in_doubles(functions), "Arguments are numbers or arrays that broadcast."),
        "#",
    )
    return "\n".join([*top, "", "import numpy as np", "", "", "\n\n".join([*used, ""]) + code, ""])


def _function(function: Ready) -> str:
    names = ", ".join(function.arguments)
    head = [
        *heading(f"def {function.name}", list(function.arguments), ":"),
        f'    """{signature_doc(function)}"""',
    ]
    if function.exp_of:
        head.append('    with np.errstate(over="ignore", under="ignore"):')
        first = f"return np.exp({function.exp_of}"
        return "\n".join([*head, *wrapped(first, names, " " * 8, end=")", brackets="()")])
    if function.quadrature:
        inner = heading(f"def _{function.name}", list(function.arguments), ":")
        body = integral(function, "numpy")
        each = wrapped("return _each", f"_{function.name}, {names}", "    ", brackets="()")
        return "\n".join([*inner, *body, "", "", *head, *each])
    if len(function.bodies) == 1 and not function.bodies[0].conditions:
        listed = f"[{names}]" if len(function.arguments) == 1 else names
        start = wrapped(f"{listed} = _floats", names, "    ", brackets="()") if names else []
        return "\n".join([*head, *start, *block(function.bodies[0], "numpy")])
    return _in_cases(function, head, names)


def _in_cases(function: Ready, head: list[str], names: str) -> str:
    """Each case as a function of its own, and one that calls them at their points."""
    parts = []
    call = [f'    return _cases(\n        ({names},),\n        "{function.outside}",']
    for number, body in enumerate(function.bodies):
        name = f"_{function.name}_{number}"
        lines = heading(f"def {name}", list(function.arguments), ":")
        bare = Body((), body.shared, body.values)
        parts.append("\n".join([*lines, *block(bare, "numpy")]))
        asked = "".join(f"lambda {names}: {text(c, 'numpy')}, " for c in body.conditions).rstrip()
        call += wrapped("", f"({asked}), {name}", "        ", end=",", brackets="()")
    return "\n\n\n".join([*parts, "\n".join([*head, *call, "    )"])])
