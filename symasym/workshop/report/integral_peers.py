"""Laplace's method by the package `asymptotic` (built on SymPy) beside ours, on the same integrals.

Each tool sums three terms of int e^(-lam f) over an interval at one lam; how far that is from the
integral, quadrature tells. What a tool claims of its result is printed beside it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import symasym as sa

__all__ = ["Row", "installed", "measured", "section"]

TERMS = 3
#: f, the interval, lam, and what it is.
INTEGRALS = {
    "quartic": ("x**2/2 + x**4", "-oo", "oo", 400),
    "double well": ("(x**2 - 1)**2", "-oo", "oo", 40),
    "lower end": ("x + x**3", "0", "oo", 40),
    "Stirling": ("x - log(x)", "0", "oo", 40),
    "cosh": ("cosh(x)", "-oo", "oo", 40),
    "friction's well (mu = 3, z0 = -0.4) in the layer": (
        "-3*x**4/4 + 2*x**2 - 7*x/5", "-1", "1", 200,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One integral by one tool: seconds, relative error (None if refused), what is claimed."""

    integral: str
    tool: str
    seconds: float
    error: float | None
    claim: str


def installed() -> str | None:
    """The version of `asymptotic`, None where it is missing."""
    try:
        return version("asymptotic")
    except PackageNotFoundError:
        return None


def _ours(f: str, a: str, b: str, lam: int) -> tuple[Any, str]:
    e = sa.laplace_integral(f"-({f})", 1, "x", a, b, TERMS)
    estimate = e.evaluate(lam, dps=20, full=True)
    relative = float(estimate.error / abs(estimate.value))
    return estimate.value, f"{estimate.error_kind}: relative error at most {relative:.1e}"


def _theirs(f: str, a: str, b: str, lam: int) -> tuple[Any, str]:
    import sympy
    from asymptotic.multivariate_laplace import multivariate_laplace_integral

    x, large = sympy.Symbol("x", real=True), sympy.Symbol("lam", positive=True)
    lo, hi = sympy.sympify(a), sympy.sympify(b)
    phase = sympy.sympify(f, {"x": x})
    box = [sympy.Interval(lo, hi)]
    try:
        result = multivariate_laplace_integral(
            sympy.S.One, phase, (x,), large, domain=box, terms=TERMS
        )
    except NotImplementedError as error:
        return None, f"refused: {error}"
    if result.status == "UNKNOWN":
        return None, "UNKNOWN"
    points = ", ".join(f"x = {p[0]}" for p in result.points)
    return result.expression.subs(large, lam).evalf(20), f"{result.status}, from {points}"


def _truth(f: str, a: str, b: str, lam: int) -> Any:
    """The integral by quadrature; beyond |x| = 12 the integrands are e^-300 of the largest."""
    import mpmath
    import sympy

    x = sympy.Symbol("x", real=True)
    phase = sympy.lambdify(x, sympy.sympify(f, {"x": x}), "mpmath")
    lo, hi = (mpmath.mpf(end.replace("oo", "12")) for end in (a, b))
    cuts = [mpmath.mpf(k) / 8 for k in range(-24, 25) if lo < k / 8 < hi]
    return mpmath.quad(lambda u: mpmath.exp(-lam * phase(u)), [lo, *cuts, hi])


def measured() -> list[Row]:
    """Every integral by both tools, or by ours alone where the other is not installed."""
    import mpmath

    tools = {"symasym": _ours, **({"asymptotic": _theirs} if installed() else {})}
    rows = []
    for name, given in INTEGRALS.items():
        with mpmath.workdps(30):
            truth = _truth(*given)
            for tool, call in tools.items():
                start = time.process_time()
                value, claim = call(*given)
                seconds = time.process_time() - start
                error = None if value is None else float(abs(mpmath.mpf(str(value)) / truth - 1))
                rows.append(Row(name, tool, seconds, error, claim))
    return rows


def section() -> str:
    """The table in Markdown, with a sentence where the peer is missing."""
    lines = [
        "## Laplace's method by others",
        "",
        f"{TERMS} terms of the integral of e^(-lam f); the error is that of their sum at one lam.",
        "",
        "| integral | tool | seconds | relative error | claimed |",
        "|---|---|---|---|---|",
    ]
    for row in measured():
        error = "" if row.error is None else f"{row.error:.1e}"
        lines.append(f"| {row.integral} | {row.tool} | {row.seconds:.2g} | {error} | {row.claim} |")
    peer = installed()
    lines += ["", f"`asymptotic` {peer}." if peer else
              "`asymptotic` is not installed (`pip install asymptotic`), so that ours stand alone.",
              ""]  # fmt: skip
    return "\n".join(lines)
