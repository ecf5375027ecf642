"""NumPy: arrays that broadcast together, each case computed at its own points only."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

from symasym.emit.forms import height_exp
from symasym.emit.program import Body, Program, Ready, header, in_doubles
from symasym.emit.targets.language import Language, helpers_of
from symasym.emit.targets.to_python import floats
from symasym.emit.writing import (
    Written,
    argument_values,
    comment,
    heading,
    helpers,
    signature_doc,
    wrapped,
)

if TYPE_CHECKING:
    from sympy import Expr

NUMPY = Language("numpy")

_LOG_MODULUS = '''def _rows(rows, t):
    total = 0.0
    for row in rows[::-1]:
        total = total * t + row
    return total


def _log_modulus(x):
    """log(Ai(x)^2 + Bi(x)^2)."""
    x = np.asarray(x, dtype=np.float64)
    # Both forms at every x, each within its own range.
    near, size = np.clip(x, -8, 8), np.maximum(np.abs(x), 8)
    piece = np.minimum((2 * (near + 8)).astype(int), 31)
    table = np.reshape(_AIRY_NEAR, (32, 13)).T
    inside = _rows(table[:, piece], 2 * (2 * (near + 8) - piece) - 1)
    root = np.sqrt(size)
    t = 16 * np.sqrt(8) / (size * root) - 1
    outside = np.where(x > 0, _rows(_AIRY_ABOVE, t), _rows(_AIRY_BELOW, t)) / root
    above = np.maximum(x, 0)
    # Left out of the tables where x > 1.
    rise = np.where(x >= 1, 4 * above * np.sqrt(above) / 3, 0)
    return (np.log(np.where(np.abs(x) <= 8, inside, outside)) + rise)[()]
'''
# Steps from which on arrays of kappa are taken in blocks.
_MANY = 20
# What is for arrays here, and for numbers in the kernels.
HELPERS: dict[str, Written] = {
    "_panel": '''def _panel(g, a, b, top):
    """The integral of e^(g - top) by Gauss-Legendre, 16 points."""
    m, h, points = (a + b) / 2, (b - a) / 2, np.array(_GAUSS_X)
    left, right = np.exp(g(m - h * points) - top), np.exp(g(m + h * points) - top)
    return h * np.dot(_GAUSS_W, left + right)
''',
    "_log_modulus": _LOG_MODULUS,
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
        raise ValueError(outside.format(*(array[left][0] for array in arrays)))
    return result.reshape(shape)[()]
''',
    "_in_blocks": '''def _in_blocks(function, x, *others):
    """The function of x, of a long array in blocks, so that its steps stay in the cache."""
    if np.size(x) <= 8000 or any(map(np.ndim, others)):
        return function(x)
    rows, value = np.ravel(x), np.empty(np.size(x))
    for k in range(0, value.size, 8000):
        value[k : k + 8000] = function(rows[k : k + 8000])
    return value.reshape(np.shape(x))
''',
    "_weights": '''def _weights(x):
    """e^(x h) as a function of h: a number where h is one and all of it is 1, or below 1e-321."""
    least, most = np.min(x, initial=np.inf), np.max(x, initial=0)

    def weight(h):
        if np.ndim(h) == 0:
            if h == 0 or h * least < -740:
                return np.float64(h == 0)
            if h * most > -740:
                return np.exp(x * h)
        # exp is slow where it is 0.
        power = np.maximum(x * h, -740)
        return np.exp(power) * (power > -740)

    return weight
''',
    "_height_exp": '''def _height_exp(x, h):
    return _weights(x)(h)
''',
    "_Later": '''class _Later:
    """An array that is computed once it is needed, and not where its factor is the number 0."""

    __array_priority__ = 1.0

    def __init__(self, made):
        self.made, self.value = made, None

    def __array__(self, *_, **__):
        return np.asarray(_now(self))

    def __mul__(self, other):
        if np.isscalar(other) and other == 0:
            return 0.0
        return _Later(lambda: _now(self) * _now(other))

    __rmul__ = __mul__
    __neg__ = lambda self: _Later(lambda: -_now(self))
    __add__ = __radd__ = lambda self, other: _Later(lambda: _now(self) + _now(other))
    __sub__ = lambda self, other: _Later(lambda: _now(self) - _now(other))
    __rsub__ = lambda self, other: _Later(lambda: _now(other) - _now(self))
    __truediv__ = lambda self, other: _Later(lambda: _now(self) / _now(other))
    __rtruediv__ = lambda self, other: _Later(lambda: _now(other) / _now(self))


def _now(x):
    if not isinstance(x, _Later):
        return x
    if x.made is not None:
        # What it was made of is not kept.
        made, x.made = x.made, None
        x.value = _now(made())
    return x.value
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
    used = helpers(code, helpers_of("python", functions, HELPERS))
    top = comment(
        header(program, in_doubles(functions), "Arguments are numbers or arrays that broadcast."),
        "#",
    )
    # One scene at a time is computed with numbers.
    first = ["import math", ""] if any("math." in part for part in (code, *used)) else []
    start = [*top, "", *first, "import numpy as np", "", ""]
    return "\n".join([*start, "\n\n".join([*used, ""]) + code, ""])


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
    if function.quadrature or function.first_passage:
        inner = heading(f"def _{function.name}", list(function.arguments), ":")
        if function.quadrature:
            body = NUMPY.integral(function, function.quadrature)
        else:
            assert function.first_passage is not None
            body = [*floats(names), *NUMPY.first_passage(function, function.first_passage)]
        each = wrapped("return _each", f"_{function.name}, {names}", "    ", brackets="()")
        return "\n".join([*inner, *body, "", "", *head, *each])
    if len(function.bodies) == 1 and not function.bodies[0].conditions:
        listed = f"[{names}]" if len(function.arguments) == 1 else names
        start = wrapped(f"{listed} = _floats", names, "    ", brackets="()") if names else []
        (case,) = function.bodies
        if len(case.shared) > _MANY and "kappa" in function.arguments:
            return "\n".join([*head, *start, *_by_kappa(function, case)])
        return "\n".join([*head, *start, *NUMPY.block(case)])
    return _in_cases(function, head, names)


def _by_kappa(function: Ready, body: Body) -> list[str]:
    """The lines of a case: what does not depend on kappa once, the others for blocks of kappa."""
    varying = {"kappa"}
    for s, value in body.shared:
        if varying & {t.name for t in value.free_symbols}:
            varying.add(s.name)
    steady, rest = (
        tuple(row for row in body.shared if (row[0].name in varying) == kind)
        for kind in (False, True)
    )
    once = NUMPY.block(Body((), steady, ()))[:-1]
    at_once = set().union(*(_within(e) for _, e in rest), *(_within(e) for e in body.values))
    inner, indent = list[str](), 2 * NUMPY.deeper
    later: set[Expr] = set()
    for s, value in rest:
        shown, weighs = _weighted(NUMPY.text(value)), value.has(height_exp)
        if s in at_once:
            shown = f"_now({shown})" if later & value.free_symbols else shown
        elif not weighs or later & value.free_symbols:
            later.add(s)
        if s in later and not weighs:
            inner += wrapped(f"{s} = _Later", f"lambda: {shown}", indent, brackets="()")
        else:
            inner += NUMPY.given(str(s), shown, indent)
        if s.name == "lam":
            inner.append(f"{indent}_weight = _weights(lam)")
    (shown,) = (_weighted(NUMPY.text(e)) for e in body.values)
    inner += NUMPY.returned(f"_now({shown})" if later else shown, indent)
    others = ", ".join(["of_kappa", "kappa", *(a for a in function.arguments if a != "kappa")])
    call = wrapped("return _in_blocks", others, NUMPY.deeper, brackets="()")
    return [*once, "", "    def of_kappa(kappa):", *inner, "", *call]


def _weighted(text: str) -> str:
    """The text with e^(lam h) as a function of h, which knows the range of lam."""
    return text.replace("_height_exp(lam, ", "_weight(")


def _within(e: Expr) -> set[Expr]:
    """The symbols of an expression that are in it otherwise than by + - * / and log."""
    if e.is_Symbol:
        return set()
    plain = e.is_Add or e.is_Mul or e.is_Pow and e.exp == -1 or e.func is sympy.log
    return set().union(*map(_within, e.args)) if plain else e.free_symbols


def _in_cases(function: Ready, head: list[str], names: str) -> str:
    """Each case as a function of its own, and one that calls them at their points."""
    parts = []
    call = [f"    return _cases(\n        ({names},),"]
    call += [f'        "{argument_values(function, "{}")}"', f'        "{function.outside}",']
    for number, body in enumerate(function.bodies):
        name = f"_{function.name}_{number}"
        lines = heading(f"def {name}", list(function.arguments), ":")
        bare = Body((), body.shared, body.values)
        parts.append("\n".join([*lines, *NUMPY.block(bare)]))
        asked = "".join(f"lambda {names}: {NUMPY.text(c)}, " for c in body.conditions).rstrip()
        call += wrapped("", f"({asked}), {name}", "        ", end=",", brackets="()")
    return "\n\n\n".join([*parts, "\n".join([*head, *call, "    )"])])
