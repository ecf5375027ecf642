"""The one-sided expansions of weak noise with a symbol for everything that depends on the drift.

`Symbols` is the `Builder` of `symasym.asymptotics.weak_noise.one_sided` whose numbers are SymPy
expressions: each critical point is a symbol u1, u2, ..., left to right, each height V(u_k), V(-1),
V(1) above V(start) another, each series a third. What they stand for is a chain of definitions:
series in V's derivatives (`symasym.formulas.universal`), these in the parameters and u_k, and
u_k by the equation A(u_k) = 0, or solved for where A is of degree 1 or 2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import sympy
from sympy import Expr, Rational, S, Symbol

from symasym.asymptotics.weak_noise.one_sided import (
    Builder,
    CriticalPoint,
    OneSided,
    add_edge,
    mirrored,
)
from symasym.asymptotics.weak_noise.series import Numbers, Part, Series, added, terms
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.drift.models import General
from symasym.formulas.cases import Case
from symasym.formulas.letters import FinitePart, Rule, U
from symasym.formulas.symbolic_sums import X
from symasym.formulas.universal import at_zero, endpoint, gaussian, put_in

if TYPE_CHECKING:
    from symasym.numbers.arithmetic import Arithmetic

__all__ = ["SeriesOf", "Symbols"]


@dataclass(frozen=True)
class SeriesOf:
    """front (c_0 + c_1 x + c_2 x^2 + ...), x = kappa^2/2."""

    front: Expr
    coefficients: tuple[Expr, ...]

    @property
    def expression(self) -> Expr:
        """The sum, with the symbol x."""
        return self.front * sum((c * X**n for n, c in enumerate(self.coefficients)), S.Zero)


class Symbols(Builder):
    """Both one-sided expansions of a case to an order, in symbols.

    Attributes
    ----------
    series : dict
        What each symbol of a series stands for, as a `SeriesOf`.
    values : dict
        What each other symbol stands for: heights, V's derivatives, slopes beyond the layer,
        critical points that are known; for a drift that is named.
    equations : dict
        For other critical points, A there, which is 0.
    integrals : dict
        The integrals of the regular part, as finite parts.
    rules : dict
        What is said in LaTeX by one rule for several symbols.
    tex : dict
        The symbols' LaTeX.
    code, growth : dict
        What is written otherwise in code (`symasym.formulas.emitted.Quotient`).
    """

    def __init__(self, drift: Drift, case: Case, order: int, start: Fraction) -> None:
        self.arithmetic = cast(
            "Arithmetic", SimpleNamespace(context=True, one=S.One, number=sympy.sympify)
        )
        self.general = isinstance(drift._model, General)
        self.A = drift.expression()
        self.case, self.count = case, order + 1
        self.degree, self.height_size = 0, 0.0
        self.powers = None if self.general else self.A.as_poly(U)
        self.kept = None if self.powers is None else self.powers.degree()
        zeros = len(case.kinds) + bool(case.at_start)
        if self.kept is not None and self.kept < zeros:
            raise InputError(
                f"case is {str(case)!r} with {zeros} zeros, and A = {self.A} has degree "
                f"{self.kept}; give a case with fewer."
            )
        self.series: dict[Symbol, SeriesOf] = {}
        self.values: dict[Symbol, Expr] = {}
        self.equations: dict[Symbol, Expr] = {}
        self.tex: dict[Symbol, str] = {}
        self.integrals: dict[Symbol, Expr] = {}
        self.rules: dict[Symbol, Rule] = {}
        self._slopes: list[Expr] = []
        self.code: dict[Symbol, Expr] = {}
        self.growth: dict[Symbol, Expr] = {}
        self.start = Rational(start.numerator, start.denominator)
        self.edges = [-S.One, min(max(self.start, -S.One), S.One), S.One]
        self.beyond, self.before = True, case.before
        self.zeros = self._zeros()
        self.names = {self.start: str(start), -S.One: "-1", S.One: "1"}
        self.names |= {u: u.name for u in [*self.zeros, *self.others_outside]}
        self.a_minus, self.a_plus = (self._slope_beyond(u) for u in (-1, 1))
        self.heights = {u: self.height_at(u) for u in (self.edges[0], *self.zeros, self.edges[2])}
        self.heights[self.start] = S.Zero

    def conditions(self) -> Iterator[Any]:
        """The conditions besides the order of the points, as predicates."""
        yield from ()

    # -- names ------------------------------------------------------------------------------

    def _point(self, k: int, real: bool) -> Symbol:
        u = Symbol(f"u{k}", real=True) if real else Symbol(f"u{k}")
        self.tex[u] = f"u_{{{k}}}"
        if not self.general:
            self.equations[u] = self.A.xreplace({U: u})
        return u

    def _zeros(self) -> list[Symbol]:
        """The zeros in the layer; `others_outside` are those of a polynomial that are not.

        A start on a zero is neither; they are zeros of the `factor` without it.
        """
        factor, at_start = self.powers, self.A.subs(U, self.start)
        if self.case.at_start and sympy.simplify(at_start) != 0:
            raise InputError(
                f"case is '{self.case}', and A at the start {self.start} is {at_start}; bind what "
                "makes it 0, or give a case without '='."
            )
        if self.case.at_start and factor is not None:
            factor = factor.quo(sympy.Poly(U - self.start, U))
        inside = len(self.case.kinds)
        zeros = [self._point(k + 1, True) for k in range(inside)]
        more = 0 if factor is None else factor.degree() - inside
        self.others_outside = [self._point(inside + k + 1, more == 1) for k in range(more)]
        if factor is not None and factor.degree() in (1, 2):
            self._solve(factor.all_coeffs()[::-1], zeros)
        return zeros

    def _solve(self, c: list[Expr], zeros: list[Symbol]) -> None:
        """The zeros of c_0 + c_1 u or c_0 + c_1 u + c_2 u^2, A but for a zero at the start.

        The slope of the latter is ±(c_1^2 - 4 c_0 c_2)^(1/2) there, for A's times u - start.
        """
        if len(c) == 2:
            (u,) = [*zeros, *self.others_outside]
            self.values[u] = -c[0] / c[1]
        else:
            root = sympy.sqrt(c[1] ** 2 - 4 * c[0] * c[2])
            free = [1, -1]
            for k, (u, kind) in enumerate(zip(zeros, self.case.kinds, strict=True)):
                sign = 1 if kind == "barrier" else -1
                if self.case.at_start and k < self.case.before:
                    sign = -sign
                free.remove(sign)
                self.values[u] = (-c[1] + sign * root) / (2 * c[2])
            for u, sign in zip(self.others_outside, free, strict=True):
                self.values[u] = (-c[1] + sign * root) / (2 * c[2])
        self.equations = {}

    def height_at(self, u: Expr) -> Symbol:
        """V(u) - V(start), for u in the layer."""
        name = self.names.get(u, str(u))
        height = Symbol(f"V({name})", real=True)
        self.tex[height] = f"V({self.tex.get(u, name)})"
        if not self.general:
            near = self.edges[1]
            slope = self.a_plus if near == 1 else self.a_minus
            if self.powers is not None:
                primitive = sympy.integrate(self.A, U)
                rise = primitive.subs(U, near) - primitive.subs(U, u)
            else:
                rise = -sympy.Integral(self.A, (U, near, u))
            self.values[height] = rise + slope * (self.start - near)
        return height

    def _slope_beyond(self, side: int) -> Symbol:
        slope = Symbol(f"phi({side})", real=True)
        self.tex[slope] = "a^+" if side > 0 else "a^-"
        if not self.general:
            self.values[slope] = self.A.subs(U, side)
        return slope

    def derivative(self, j: int, u: Expr) -> Expr:
        """V^(j)(u), j >= 1: a symbol, or 0 where A is a polynomial of lower degree."""
        if self.kept is not None and j > self.kept + 1:
            return S.Zero
        order = "'" * j if j < 4 else f"^({j})"
        name = self.names[u]
        sign: dict[str, bool] = {} if u in self.others_outside else {"real": True}
        if j == 2 and (kind := self._kind(u)):
            sign = {"negative" if kind == "barrier" else "positive": True}
        symbol = Symbol(f"V{order}({name})", **sign)
        if symbol not in self.tex:
            power = "'" * j if j < 4 else f"^{{({j})}}"
            self.tex[symbol] = f"V{power}({self.tex.get(u, name)})"
            if not self.general:
                self.values[symbol] = -self.drift_slope(j - 1).subs(U, u)
        return symbol

    def _kind(self, u: Expr) -> str:
        """``"well"`` or ``"barrier"`` at a zero in the layer."""
        if u in self.zeros:
            return self.case.kinds[self.zeros.index(u)]
        return self.case.at_start if u == self.start else ""

    def drift_slope(self, j: int) -> Expr:
        """The j-th derivative of A, or of phi where no drift is named."""
        if not self._slopes:
            self._slopes.append(sympy.Function("phi")(U) if self.general else self.A)
        while len(self._slopes) <= j:
            self._slopes.append(sympy.diff(self._slopes[-1], U))
        return self._slopes[j]

    def _named(self, name: str, tex: str, front: Expr, coefficients: list[Expr]) -> Series:
        """A series of one symbol, or of nothing where its coefficients are 0."""
        if not any(coefficients):
            return Series([])
        symbol = Symbol(name, real=True)
        self.tex[symbol] = tex.rstrip("_")
        self.series[symbol] = SeriesOf(front, tuple(coefficients))
        return Series([Part(0.0, 0, [symbol])])

    # -- what `Builder` asks for --------------------------------------------------------------

    def inside(self, sign: int) -> list[int]:
        return list(range(self.before, len(self.zeros)) if sign > 0 else range(self.before)[::-1])

    def barrier(self, k: int) -> bool:
        return self.case.kinds[k] == "barrier"

    def potential(self, u: Numbers) -> Any:
        return self.heights[u]

    def origin(self, outside: Numbers) -> Any:
        return S.Zero

    def smooth(self, u: Numbers, value: Numbers = None) -> Series:
        if u == self.start and self.case.at_start:
            return Series([])
        phi = {-S.One: self.a_minus, S.One: self.a_plus}.get(u) or -self.derivative(1, u)
        g = [-self.derivative(j + 1, u) / (sympy.factorial(j) * phi) for j in range(1, self.count)]
        h = [put_in(p, g) / phi**k for k, p in enumerate(endpoint(self.count, self.kept), 1)]
        return Series([Part(1.0, 0, [sympy.expand(c) for c in h])])

    def saddle(self, k: int) -> Series:
        return self._gaussian(self.zeros[k], k + 1)

    def _gaussian(self, u: Expr, number: int) -> Series:
        """Laplace's series at a zero."""
        barrier, bend = self._kind(u) == "barrier", self.derivative(2, u)
        steep = -bend if barrier else bend
        alpha = [
            2 * self.derivative(j + 2, u) / (sympy.factorial(j + 2) * bend)
            for j in range(1, 2 * self.count - 1)
        ]
        rows = gaussian(self.count - 1, self.kept if self.kept is None else self.kept - 1)
        letter = "B" if barrier else "W"
        return self._named(
            f"{letter}{number}", f"{letter}_{{{number}}}",
            sympy.sqrt(2 * sympy.pi * X) * steep ** -sympy.Rational(1, 2),
            [put_in(p, alpha) / steep**n for n, p in enumerate(rows)],
        )  # fmt: skip

    def primitives(self) -> Any:
        return None

    def regular_part(self, sign: int, extra: Numbers) -> Series:
        side = "+" if sign > 0 else "-"
        lo, hi = sorted((self.edges[1], self.edges[1 + sign]))
        rows = [self._regular(k, lo, hi, side) for k in range(1, self.count + 1)]
        # h_k(u) is -h_k(-u) in the mirror.
        rows = [row * sign for row in rows]
        rows[0] += extra
        series = self._named(f"M{side}", f"M_{side}", X, rows)
        return series

    # -- the regular part ---------------------------------------------------------------------

    def _regular(self, k: int, lo: Expr, hi: Expr, side: str) -> Expr:
        """The finite part of the integral of h_k from lo to hi, as a symbol."""
        symbol = Symbol(f"R{k}{side}", real=True)
        self.tex[symbol] = f"R_{{{k}}}^{{{side}}}"
        name = Symbol(f"h{k}")
        self.tex[name] = f"h_{{{k}}}"
        self.integrals[symbol] = FinitePart(name, U, lo, hi)
        if self.powers is None:
            phi = self.drift_slope(0)
            g = [self.drift_slope(j) / (sympy.factorial(j) * phi) for j in range(1, k)]
            h = put_in(endpoint(self.count)[k - 1], g) / phi**k
            self.values[symbol] = FinitePart(h, U, lo, hi)
        else:
            self.values[symbol] = self._partial_fractions(k, lo, hi)
        return symbol

    def _partial_fractions(self, k: int, lo: Expr, hi: Expr) -> Expr:
        """The same for a polynomial, a sum over its zeros (`weak_noise.regular_part`)."""
        if not self.kept:
            return (hi - lo) / self.A if k == 1 else S.Zero
        total = S.Zero
        for z in [*self.zeros, *self.others_outside]:
            rate = -self.derivative(2, z)
            g = [
                -self.derivative(j + 2, z) / (sympy.factorial(j + 1) * rate)
                for j in range(1, 2 * k - 1)
            ]
            row = at_zero(self.count, self.kept - 1)[k - 1]
            for power, p in zip(range(1 - 2 * k, 0), row, strict=True):
                share = put_in(p, g) / rate**k
                # At a zero at its end the finite part leaves out what is infinite.
                high, low = ((edge - z if edge != z else None) for edge in (hi, lo))
                if power == -1:
                    ratio = (high or S.One) / (low or S.One)
                    inside = z in self.zeros or z == self.start
                    total += share * sympy.log(sympy.Abs(ratio) if inside else ratio)
                else:
                    t = [S.Zero if y is None else y ** (power + 1) for y in (high, low)]
                    total += share * (t[0] - t[1]) / (power + 1)
        return total

    # -- both sides ---------------------------------------------------------------------------

    def both_sides(self) -> tuple[OneSided, OneSided]:
        """The one-sided expansions with a symbol for each series, also of kinks."""
        left, right = (
            self._in_symbols(one, side)
            for one, side in zip(super().both_sides(), ("-", "+"), strict=True)
        )
        # Of both sides of the start together, at a kink alone, the series of e^{-lam V} counts.
        speed = added(left.speed_start, right.speed_start)
        own = self._symbol_of(right.scale_start, "Y", "")
        other = mirrored(own, -1)
        if terms(added(left.scale_start, right.scale_start)):
            other = self._symbol_of(left.scale_start, "Y", "-")
        return (
            left._replace(scale_start=other, speed_start=Series([])),
            right._replace(scale_start=own, speed_start=self._symbol_of(speed, "Z", "")),
        )

    def line(self) -> list[CriticalPoint]:
        """Of int e^{-lam V} over the whole line (as `weak_noise.critical_points.whole`)."""
        self.base, self.before = S.Zero, 0
        scale_points: list[CriticalPoint] = []
        speed_points: list[CriticalPoint] = []
        low, _, high = self.edges
        self.at_edge = [self.smooth(u) for u in (low, low, high)]
        flat = self.flat(self.a_minus)
        add_edge(
            scale_points, speed_points, 0, self.heights[low], flat, self.at_edge[0], "kink", low
        )
        self.end(1, self.between(1, scale_points, speed_points), scale_points, speed_points)
        ends = speed_points[0], speed_points[-1]
        sides = {id(p): side for p, side in zip(ends, "-+", strict=True)}
        return [
            p._replace(series=self._symbol_of(p.series, "F", sides[id(p)])) if id(p) in sides else p
            for p in speed_points
        ]

    def _symbol_of(self, series: Any, letter: str, side: str) -> Any:
        """A symbol for a series that is none yet; its coefficients are those of x^(k+1)."""
        if not terms(series):
            return Series([])
        if not isinstance(series, Series):
            return series
        (part,) = series.parts
        if part.offset == 0:
            return series
        rows = [sympy.sympify(c) for c in part.coefficients]
        index = f"{letter[1:]}{side}"
        index = f"_{{{index}}}" if len(index) > 1 else f"_{index}" if index else ""
        return self._named(f"{letter}{side}", letter[0] + index, X, rows)

    def _in_symbols(self, one: OneSided, side: str) -> OneSided:
        """The series of the kinks as symbols; one between the start and the layer is 0."""

        def points(known: list[CriticalPoint], letter: str) -> list[CriticalPoint]:
            return [
                p._replace(
                    series=self._symbol_of(p.series, letter + "0" * (p.rank == 0), side),
                    onward=p.onward and self._symbol_of(p.onward, "G" + "0" * (p.rank == 0), side),
                )
                for p in known
            ]

        return one._replace(
            scale_points=points(one.scale_points, "E"), speed_points=points(one.speed_points, "F")
        )
