"""mpmath: any number of digits, in a context of the file's own."""

from __future__ import annotations

from dataclasses import replace

from symasym.emit.kernels.exact_mpmath import ERROR, TIME
from symasym.emit.program import FirstPassage, Program, Ready, header
from symasym.emit.targets.language import Language, helpers_of
from symasym.emit.writing import (
    comment,
    heading,
    helpers,
    refusal,
    signature_doc,
    wrapped,
)

_DIGITS = '''def _number(ctx, x):
    """An exact rational (int, float, Fraction, "-0.4", "1/3") or an mpf."""
    if hasattr(x, "_mpf_"):
        return ctx.make_mpf(x._mpf_)
    try:
        exact = Fraction(x)
    except (ArithmeticError, TypeError, ValueError):
        raise ValueError(f'{x!r} is no number; give an int, a float, an mpf or "1/3"') from None
    return ctx.mpf(exact.numerator) / exact.denominator


def _digits(function, dps, *arguments):
    """All `dps` digits right: with more of them in between until two results agree."""
    if not 1 <= dps <= MOST:
        raise ValueError(f"dps is {dps}; give 1 to {MOST} digits")
    ctx, before = MPContext(), None
    for extra in (15, 30, 60, 120, 240, 480, 960, 1920):
        ctx.dps = dps + extra
        values = function(ctx, *(_number(ctx, x) for x in arguments))
        values = values if isinstance(values, tuple) else (values,)
        if before is not None and all(
            abs(a - b) <= abs(b) * ctx.mpf(10) ** (-dps - 3)
            for a, b in zip(before, values, strict=True)
        ):
            # An exponential has fewer right digits than its exponent, whose numbers are rounded.
            lost = max(len(str(abs(ctx.mag(x)))) if x else 0 for x in values)
            if dps + lost > MOST + 8:
                raise ValueError(
                    f"dps is {dps}, but the exponent of the value takes {lost} of the {MOST + 8} "
                    "digits that are known; give fewer, or take the logarithm"
                )
            prec = mpmath.libmp.dps_to_prec(dps)
            values = tuple(
                mpmath.mp.make_mpf(mpmath.libmp.mpf_pos((ctx.one * x)._mpf_, prec, "n"))
                for x in values
            )
            return values if len(values) > 1 else values[0]
        before = values
    raise ArithmeticError("the digits cancel; the value may be exactly 0")
'''
MPMATH = Language("mpmath", first="ctx, ")
HELPERS = {
    "_rule": '''def _rule(ctx):
    """Fejer's quadrature on (-1, 1): points and weights."""
    n = 2 * (ctx.dps // 2) + 16
    angles = [ctx.pi * (2 * k + 1) / (2 * n) for k in range(n)]
    near = [ctx.one / (4 * j * j - 1) for j in range(1, n // 2 + 1)]
    return [
        (ctx.cos(t), 2 * (1 - 2 * sum(x * ctx.cos(2 * j * t) for j, x in enumerate(near, 1))) / n)
        for t in angles
    ]
''',
    "_log_integral": '''def _log_integral(ctx, g, marks, count, lower, upper):
    """Logarithm of the integral of e^g; g is monotone between -1, the marks and 1."""
    inside = (p for p in (-1, *marks[:count], 1) if lower < p < upper)
    points, rule = [ctx.mpf(p) for p in (lower, *inside, upper)], _rule(ctx)
    top = max(map(g, points))
    # The exponent's own rounding: no halving gets below it.
    noise = (1 + abs(top)) * ctx.mpf(10) ** (3 - ctx.dps)

    def panel(a, b):
        m, h = (a + b) / 2, (b - a) / 2
        return h * sum(w * ctx.exp(g(m + h * x) - top) for x, w in rule)

    def total(a, b, depth):
        ga, gb, m = g(a), g(b), (a + b) / 2
        if max(ga, gb) < top - 100 - 3 * ctx.dps:
            return ctx.zero
        if abs(ga - gb) <= 4 or depth > 60 + 4 * ctx.dps:
            halves = panel(a, m) + panel(m, b)
            if abs(halves - panel(a, b)) <= noise * halves or depth > 60 + 4 * ctx.dps:
                return halves
        return total(a, m, depth + 1) + total(m, b, depth + 1)

    return top + ctx.log(sum(total(a, b, 0) for a, b in zip(points, points[1:])))
''',
    "_time": TIME,
    "_exprel": '''def _exprel(ctx, x):
    return ctx.one if x == 0 else ctx.expm1(x) / x
''',
    "_exprel2": '''def _exprel2(ctx, x):
    if abs(x) > 0.5:
        return (ctx.expm1(x) - x) / x**2
    total = term = ctx.one / 2
    n = 2
    while abs(term) > ctx.eps / 8:
        n, term = n + 1, term * x / (n + 1)
        total += term
    return total
''',
    "_tanhc": '''def _tanhc(ctx, x):
    return ctx.one if x == 0 else ctx.tanh(x) / x
''',
    "_sinc": '''def _sinc(ctx, x):
    return ctx.one if x == 0 else ctx.sin(x) / x
''',
    "_log_modulus": '''def _log_modulus(ctx, x):
    return ctx.log(ctx.airyai(x) ** 2 + ctx.airybi(x) ** 2)
''',
    "_larger": '''def _larger(ctx, x, y):
    return max(x, y)
''',
    "_logaddexp": '''def _logaddexp(ctx, x, y):
    return max(x, y) + ctx.log1p(ctx.exp(-abs(x - y)))
''',
}  # fmt: skip


def render(program: Program, functions: list[Ready]) -> str:
    """The file."""
    code = "\n\n\n".join(_function(f) for f in functions)
    python = helpers_of("python", [])
    used = helpers(code, {**HELPERS, "_horner": python["_horner"], "_zeros": python["_zeros"]})
    more = 'dps: digits that are right. Numbers are exact: 0.1 is a binary fraction, "0.1" is 1/10'
    if any(f.first_passage for f in functions):
        program = replace(program, error=ERROR)
    top = comment(header(program, more), "#")
    return "\n".join([
        *top, "", "from fractions import Fraction", "", "import mpmath",
        "from mpmath.ctx_mp import MPContext", "", f"MOST = {program.digits}", "", "",
        "\n\n".join([_DIGITS, *used, ""]) + code, "",
    ])  # fmt: skip


def _function(function: Ready) -> str:
    names = list(function.arguments)
    inner = heading(f"def _{function.name}", ["ctx", *names], ":")
    inner += MPMATH.body(function, _passage, refusal)
    outer = [
        *heading(f"def {function.name}", [*names, "dps=15"], ":"),
        f'    """{signature_doc(function)}"""',
        *wrapped(
            "return _digits",
            ", ".join([f"_{function.name}", "dps", *names]),
            "    ",
            brackets="()",
        ),
    ]
    return "\n".join([*inner, "", "", *outer])


def _passage(function: Ready, q: FirstPassage) -> list[str]:
    """The body of an escape time: its drift, where that is zero, its value or its logarithm."""
    degree = len(q.coefficients) - 1
    drift, size = MPMATH.passed(function, q.drift), MPMATH.text(q.size)
    value = f"{drift}, ends, {degree}, {size}, marks[:count], kappa, r"
    lines = [*MPMATH.listed("ends", list(map(MPMATH.text, q.ends))), *MPMATH.marks(q)]
    if function.exp_of:
        return [*lines, *MPMATH.returned(value, "    ", "_time")]
    lines += wrapped("mean = _time", value, "    ", brackets="()")
    return [*lines, "    return ctx.log(mean)"]
