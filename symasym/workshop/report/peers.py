"""The same escape times by the tools that people have: nested quadrature, written with care.

Every peer is given what helps it: the potential in closed form, integrals split at the
kinks -1 and 1 and at the start 0, the largest exponent taken out, and the term with C left
out where C is below the last digit (left of 0 the scenes here only fall, so that nothing
outweighs it). The drift comes as the exact coefficients of A in ascending powers of u.

Laplace's method by the package `asymptotic` (built on SymPy) stands beside ours on the same
integrals: each tool sums three terms of int e^(-lam f) over an interval at one lam; how far that is
from the integral, quadrature tells, and what a tool claims of its result is printed beside it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from itertools import accumulate, pairwise
from types import ModuleType
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base.call_context import mpf_of
from symasym.base.inputs import Number

if TYPE_CHECKING:
    from flint import acb as Ball
    from mpmath import mpf

    from symasym.base.inputs import FloatArray

__all__ = [
    "Row",
    "installed",
    "measured",
    "section",
]


Polynomial = list[Fraction]
Function = Callable[[float], float]


def coefficients(mu: Number, z0: Number) -> Polynomial:
    """Coefficients of A for friction with alpha = 1, in ascending powers of u."""
    ascending = sa.friction(mu=mu, alpha=1, z0=z0).exact_coefficients()
    assert ascending is not None
    return ascending


def _value(c: list[Any], u: Any) -> Any:
    """The polynomial of ascending coefficients at `u`, by Horner's scheme."""
    total = c[-1]
    for x in c[-2::-1]:
        total = total * u + x
    return total


def _potentials(c: list[Any]) -> list[Callable[[Any], Any]]:
    """V left of -1, on [-1, 1] and right of 1, each analytic everywhere; V(-1) = 0."""
    v = [0 * c[0]] + [-x / (k + 1) for k, x in enumerate(c)]
    v[0] = -_value(v, -1)
    low, high, top = _value(c, -1), _value(c, 1), _value(v, 1)
    return [lambda u: -low * (u + 1), lambda u: _value(v, u), lambda u: top - high * (u - 1)]


def _samples(c: Polynomial, r: float) -> list[tuple[float, float]]:
    """(u, V(u)) from left to right; V is linear, hence extreme at the ends, outside."""
    left, inside, right = _potentials([float(x) for x in c])
    grid = [k / 200 for k in range(-200, 201)]
    return [(-r, left(-r)), *((u, inside(u)) for u in grid), (r, right(r))]


def _barrier_height(c: Polynomial, r: float) -> float:
    """The largest V(v) - V(u), u < v, v > 0."""
    samples = _samples(c, r)
    lowest = accumulate((V for _, V in samples), min)
    return max(V - low for (v, V), low in zip(samples, lowest, strict=True) if v >= 0)


# -- mpmath -----------------------------------------------------------------------------------


def mpmath_escape_time(
    c: Polynomial, kappa: Fraction, r: int, dps: int, form: str = "scaled"
) -> Any:
    """eq:Ttilde with eq:C by nested `mpmath.quad`, at `dps` digits.

    Parameters
    ----------
    form : {"printed", "cut", "scaled", "tuned"}
        ``"printed"``: the two exponentials as they stand, v from 0 to r. ``"cut"``: the same,
        split at the kinks. ``"scaled"``: the largest exponent taken out as well, one
        exponential for both. ``"tuned"``: the pieces left of v's own factored out besides.
    """
    from mpmath import mp, mpf

    with mp.workdps(dps):
        lam = 2 / mpf_of(kappa, mp) ** 2
        potentials = _potentials([mpf_of(x, mp) for x in c])
        samples, edges = _samples(c, r), [-r, -1, 1, r]
        barrier, high = mpf(_barrier_height(c, r)), mpf(samples[0][1])
        left, right = [(0, -r, -1), (1, -1, 0)], [(1, 0, 1), (2, 1, r)]

        def V(u: mpf) -> Any:
            """V(u)."""
            return potentials[0 if u < -1 else 1 if u < 1 else 2](u)

        def plain(v: mpf) -> Any:
            """The integrand over v as it is printed."""
            points = [-r, v] if form == "printed" else cut(v)
            return mp.exp(lam * V(v)) * mp.quad(lambda u: mp.exp(-lam * V(u)), points)

        def scaled(v: mpf) -> Any:
            """The same divided by the largest exponential."""
            top = V(v) - barrier
            return mp.quad(lambda u: mp.exp(lam * (top - V(u))), cut(v))

        def cut(v: mpf) -> list[Any]:
            """The pieces of (-r, v)."""
            return [x for x in (-r, -1, 0, 1) if x < v] + [v]

        def tuned(k: int, a: int, b: int) -> Any:
            """The double integral over v in (a, b), its piece k the only one nested."""
            low = mpf(min(V for u, V in samples if u <= edges[k]))
            before = mp.zero
            for W, ends in list(zip(potentials, pairwise(edges), strict=True))[:k]:
                before += mp.quad(lambda u, W=W: mp.exp(lam * (low - W(u))), ends)

            def outer(v: mpf) -> Any:
                """The integrand over v, the constant part of the inner integral factored out."""
                top = potentials[k](v) - barrier
                points = [edges[k], *(x for x in (0,) if edges[k] < x < v), v]
                own = mp.quad(lambda u: mp.exp(lam * (top - potentials[k](u))), points)
                return mp.exp(lam * (top - low)) * before + own

            return mp.quad(outer, [a, b])

        def double(spans: list[tuple[int, int, int]]) -> Any:
            """The double integral over these pieces of v."""
            start, *ends = [spans[0][1], *(b for _, _, b in spans)]
            if form in ("printed", "cut"):
                points = [start, *(ends if form == "cut" else ends[-1:])]
                return mp.quad(plain, points) / mp.exp(lam * barrier)
            if form == "scaled":
                return mp.quad(scaled, [start, *ends])
            return sum((tuned(*part) for part in spans), mp.zero)

        def single(spans: list[tuple[int, int, int]]) -> Any:
            """The integral of e^{lam V} over these pieces, divided by its largest value."""
            points = [spans[0][1], *(b for _, _, b in spans)]
            return mp.quad(lambda v: mp.exp(lam * (V(v) - high)), points)

        C = single(right) / (single(left) + single(right))
        total = (1 - C) * double(right)
        if mpf(10) ** -dps < C:
            total -= C * double(left)
        return lam * mp.exp(lam * barrier) * total


# -- Arb --------------------------------------------------------------------------------------


def arb_escape_time(
    c: Polynomial, kappa: Fraction, r: int, dps: int, tuned: bool = False, log: bool = False
) -> Any:
    """The same by nested `acb.integral` of python-flint: an `arb` that contains the value.

    Parameters
    ----------
    tuned : bool
        Keep e^{lam (V(v) - V(u))} in one exponential inside the inner integral, where the
        wide balls in v that Arb tries first do less harm.
    log : bool
        The logarithm of it.
    """
    import flint

    before = flint.ctx.dps
    flint.ctx.dps = dps + 10
    try:
        time = _arb_escape_time(flint, c, kappa, r, dps, tuned)
        return time.log() if log else time
    finally:
        flint.ctx.dps = before


def _arb_escape_time(
    flint: ModuleType, c: Polynomial, kappa: Fraction, r: int, dps: int, tuned: bool
) -> Any:
    """T by nested integrals of Arb, the largest exponential taken out."""
    acb, arb = flint.acb, flint.arb

    def ball(x: Fraction) -> Any:
        """The ball of a rational."""
        return arb(flint.fmpq(x.numerator, x.denominator))

    lam, barrier = ball(2 / kappa**2), arb(_barrier_height(c, r))
    potentials = _potentials([ball(x) for x in c])
    samples, edges = _samples(c, r), [-r, -1, 1, r]
    tolerance = arb(10) ** -(dps + 3)

    def integral(f: Callable[[Any], Any], a: Ball | int, b: Ball | int) -> Any:
        """The integral of `f` from a to b."""
        return acb.integral(lambda u, _: f(u), acb(a), acb(b), rel_tol=tolerance, abs_tol=tolerance)

    def span(k: int, a: int, b: int) -> Any:
        """The double integral over u < v, a < v < b, on which V is the k-th potential."""
        V = potentials[k]
        low = arb(min(value for u, value in samples if u <= edges[k]))
        # Left of v's piece the inner integral is a constant: only the rest is nested.
        whole = acb(0)

        def fallen(W: Callable[[Any], Any], u: Ball) -> Any:
            return (lam * (low - W(u))).exp()

        for W, (start, end) in list(zip(potentials, pairwise(edges), strict=True))[:k]:
            whole += integral(partial(fallen, W), start, end)

        def separate(v: Ball) -> Any:
            """The integrand over v, both exponentials by themselves."""
            own = integral(lambda u: (lam * (low - V(u))).exp(), edges[k], v)
            return (lam * (V(v) - barrier - low)).exp() * (whole + own)

        def joint(v: Ball) -> Any:
            """The integrand over v, both exponentials in one."""
            top = V(v) - barrier
            own = integral(lambda u: (lam * (top - V(u))).exp(), edges[k], v)
            return (lam * (top - low)).exp() * whole + own

        return integral(joint if tuned else separate, a, b)

    def single(k: int, a: int, b: int, high: Ball) -> Any:
        """The integral of e^{lam V} over a piece, divided by its largest value."""
        return integral(lambda v: (lam * (potentials[k](v) - high)).exp(), a, b)

    left, right = [(0, -r, -1), (1, -1, 0)], [(1, 0, 1), (2, 1, r)]
    high = arb(samples[0][1])
    before = sum((single(*part, high) for part in left), acb(0))
    after = sum((single(*part, high) for part in right), acb(0))
    C = after / (before + after)
    total = (1 - C) * sum((span(*part) for part in right), acb(0))
    if not abs(C) < tolerance:
        total -= C * sum((span(*part) for part in left), acb(0))
    return (lam * (lam * barrier).exp() * total).real


# -- SciPy ------------------------------------------------------------------------------------


def scipy_log_escape_time(
    c: Polynomial, kappa: float, r: float, epsrel: float, factorised: bool = False
) -> float:
    """log T in float64 by `scipy.integrate.dblquad`, one call for each pair of pieces.

    Parameters
    ----------
    factorised : bool
        Help it further: over a rectangle the double integral is the product of two single
        ones, so that dblquad is left with the triangles u < v of one piece.
    """
    from scipy.integrate import dblquad, quad

    lam, barrier = 2.0 / kappa**2, _barrier_height(c, r)
    left, inside, right = _potentials([float(x) for x in c])
    lowest = min(V for u, V in _samples(c, r) if u <= 1)
    exp = math.exp

    def single(f: Callable[[float], float], sign: int, ref: float, a: float, b: float) -> float:
        """The integral of e^{sign lam f} over (a, b), `ref` taken out of the exponent."""

        def integrand(u: float) -> float:
            return exp(sign * lam * (f(u) - ref))

        return float(quad(integrand, a, b, epsabs=0.0, epsrel=epsrel, limit=200)[0])

    def double(
        f: Function, a: float, b: float, g: Function, low: float, high: float | None
    ) -> float:
        """Over v in [a, b], where V is f, and u from low to high (None: v), where it is g."""
        if factorised and high is not None:
            ref = max(f(a), f(b)) if f is not inside else lowest + barrier
            size = exp(lam * (ref - barrier - lowest))
            return size * single(f, 1, ref, a, b) * single(g, -1, lowest, low, high)

        def integrand(u: float, v: float) -> float:
            return exp(lam * (f(v) - g(u) - barrier))

        top: Any = (lambda v: v) if high is None else high
        return float(dblquad(integrand, a, b, low, top, epsabs=0.0, epsrel=epsrel)[0])

    high = left(-r)
    before = single(left, 1, high, -r, -1.0) + single(inside, 1, high, -1.0, 0.0)
    after = single(inside, 1, high, 0.0, 1.0) + single(right, 1, high, 1.0, r)
    C = after / (before + after)
    total = double(inside, 0.0, 1.0, left, -r, -1.0)
    if factorised:
        total += double(inside, 0.0, 1.0, inside, -1.0, 0.0)
        total += double(inside, 0.0, 1.0, inside, 0.0, None)
    else:
        total += double(inside, 0.0, 1.0, inside, -1.0, None)
    total += double(right, 1.0, r, left, -r, -1.0)
    total += double(right, 1.0, r, inside, -1.0, 1.0)
    total += double(right, 1.0, r, right, 1.0, None)
    total *= 1.0 - C
    if epsrel < C:
        other = double(left, -r, -1.0, left, -r, None)
        other += double(inside, -1.0, 0.0, left, -r, -1.0)
        other += double(inside, -1.0, 0.0, inside, -1.0, None)
        total -= C * other
    return math.log(lam) + lam * barrier + math.log(total)


# -- NumPy ------------------------------------------------------------------------------------


@cache
def _gauss_panels(panels: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Ends and nodes of panels of [-1, 0], 16 each; weights; the running integral's matrix."""
    import numpy as np

    x, w = np.polynomial.legendre.leggauss(16)
    p, k = np.polynomial.legendre.legvander(x, 16), np.arange(16)
    running = np.empty((16, 16))
    running[:, 0] = x + 1
    running[:, 1:] = (p[:, 2:] - p[:, :-2]) / (2 * k[1:] + 1)
    running = running @ ((k[:, None] + 0.5) * p[:, :16].T * w)
    ends, h = np.linspace(-1.0, 0.0, panels + 1), 0.5 / panels
    return ends, (ends[:-1, None] + h * (x + 1)).ravel(), h * w, h * running.T


def numpy_log_escape_time(c: FloatArray, kappa: float, r: float, panels: int) -> FloatArray:
    """log T in float64 of many drifts, by Gauss-Legendre panels on each side of the start 0.

    `c` has a column of ascending coefficients for each. The integrals of e^{lam V} from an end are
    summed on each panel by a 16x16 matrix and joined in logarithms; T is the quotient of sums of
    positive terms that Green's function gives, from the left and, mirrored, from the right.
    """
    import numpy as np

    ends, u, weights, running = _gauss_panels(panels)
    lam, k, length = 2.0 / kappa**2, np.arange(len(c))[:, None], r - 1.0
    odd = (-1.0) ** k
    c = np.concatenate((c, -c * odd), axis=1)

    def exponent(u: FloatArray) -> Any:
        """lam V, V(-1) = 0."""
        return (-lam * c / (k + 1)).T @ (u ** (k + 1) + odd)

    height = exponent(ends)
    e = np.exp(exponent(u).reshape(-1, panels, 16) - height[:, :-1, None])
    inverse = 1.0 / e
    # Outside, where the drift is constant, in closed form; by a series where that cancels.
    x = lam * length * (c * odd).sum(axis=0)
    top, size = np.maximum(x, 0.0), np.maximum(np.abs(x), 0.3)
    decay, z = np.exp(-size), np.clip(x, -0.3, 0.3)
    single, double = (1 - decay) / size, np.where(x > 0, 1 - (1 + size) * decay, size - 1 + decay)
    first, second = np.zeros_like(z), np.zeros_like(z)
    for j in range(13, 0, -1):
        first, second = (1 + z * first) / j, (1 + z * second) / (j + 1)
    small = np.abs(x) < 0.3
    shrunk = np.where(small, np.exp(-top), 1.0)
    S = np.log(length * np.where(small, first * shrunk, single)) + top
    W = np.log(length**2 * np.where(small, second * shrunk, double / size**2)) + top
    # S up to the end of each panel, and what a panel adds to the integral of S e^{-lam V}.
    own = np.log(e @ weights) + height[:, :-1]
    S = np.logaddexp.accumulate(np.concatenate((S[:, None], own), axis=1), axis=1)
    crossed = S[:, :-1] - height[:, :-1] + np.log(inverse @ weights)
    nested = np.log((inverse * (e @ running)) @ weights)
    W = np.logaddexp(W, np.logaddexp.reduce(np.logaddexp(crossed, nested), axis=1))
    sigma = S[:, -1] - height[:, -1]
    time, n = W - sigma, c.shape[1] // 2
    rate = np.logaddexp(-sigma[:n], -sigma[n:])
    log_time: FloatArray = np.log(lam) + np.logaddexp(time[:n], time[n:]) - rate
    return log_time


# -- PARI -------------------------------------------------------------------------------------


def pari_program(c: Polynomial, kappa: Fraction, r: Fraction, dps: int) -> str:
    """The GP program of the same double integral by nested `intnum`, split and scaled alike."""
    V = [" + ".join(f"({x})*u^{k}" for k, x in enumerate(p)) for p in _polynomial_potentials(c)]
    barrier, high = _barrier_height(c, float(r)), _samples(c, float(r))[0][1]
    edges = [f"-({r})", "-1", "1", f"{r}"]
    lines = [
        f"default(realprecision, {dps});",
        f"lam = {2 / kappa**2}; barrier = {Fraction(barrier)}; high = {Fraction(high)};",
        *(f"V{k}(u) = {V[k]};" for k in range(3)),
    ]
    for k in range(3):
        inner = " + ".join(
            f"intnum(u = {edges[j]}, {edges[j + 1]}, exp(lam*(t - V{j}(u))))" for j in range(k)
        )
        own = f"intnum(u = {edges[k]}, v, exp(lam*(t - V{k}(u))))"
        whole = f"{inner} + {own}" if inner else own
        lines.append(f"f{k}(v) = {{ my(t = V{k}(v) - barrier); {whole} }};")
        lines.append(f"g{k}(v) = exp(lam*(V{k}(v) - high));")
    low, high_end = edges[0], edges[3]
    lines += [
        f"before = intnum(v = {low}, -1, g0(v)) + intnum(v = -1, 0, g1(v));",
        f"after = intnum(v = 0, 1, g1(v)) + intnum(v = 1, {high_end}, g2(v));",
        "C = after/(before + after);",
        f"T = (1 - C)*(intnum(v = 0, 1, f1(v)) + intnum(v = 1, {high_end}, f2(v)));",
        f"if (C > 10.^-{dps}, T -= C*(intnum(v = {low}, -1, f0(v)) + intnum(v = -1, 0, f1(v))));",
        "print(log(T));",
    ]
    return "\n".join(lines) + "\n"


def pari_log_escape_time(
    c: Polynomial, kappa: Fraction, r: Fraction, dps: int, limit: float
) -> tuple[float, Any]:
    """(seconds, log T) by PARI's command `gp`; the time is that of the whole process."""
    import subprocess
    import time

    from mpmath import mp, mpf

    start = time.perf_counter()
    done = subprocess.run(
        ["gp", "-q", "-f", "-s", "512M"],
        input=pari_program(c, kappa, r, dps),
        capture_output=True,
        text=True,
        timeout=limit,
        check=True,
    )
    spent = time.perf_counter() - start
    if not done.stdout.strip():
        raise ArithmeticError("gp printed no number")
    # The largest exponent was taken out of T, and has no part in gp's digits.
    with mp.workdps(dps + 30):
        lam, barrier = 2 / kappa**2, Fraction(_barrier_height(c, float(r)))
        rise = mpf_of(lam * barrier, mp)
        rest = mpf("".join(done.stdout.split()).replace("E", "e"))
        return spent, rest + rise + mp.log(mpf_of(lam, mp))


def _polynomial_potentials(c: Polynomial) -> list[Polynomial]:
    """Coefficients of the three pieces of `_potentials`, exactly."""
    v = [Fraction(0)] + [-x / (k + 1) for k, x in enumerate(c)]
    v[0] = -_value(v, -1)
    low, high, top = _value(c, -1), _value(c, 1), _value(v, 1)
    return [[-low, -low], v, [top + high, -high]]


# -- Laplace's method by others --------------------------------------------------------------------


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
    # Upwards in the last digit shown.
    relative = 1.01 * float(estimate.error / abs(estimate.value))
    return estimate.value, f"{estimate.error_kind}: relative error at most {relative:.2e}"


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
