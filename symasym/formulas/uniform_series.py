"""T and 1 - P through a coalescence to order 1, with a symbol for all that depends on the drift.

The sums are those of `symasym.asymptotics.uniform.answer`, run over SymPy's expressions: Laplace's
series (`symasym.formulas.builder`), the canonical Airy form of the pair (C. Chester, B. Friedman,
F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599), and at the start and both ends of the layer the
corrections of a Gaussian that is truncated there (N. Bleistein, Comm. Pure Appl. Math. 19 (1966)
353). With u = u(s), phi du = (s^2 - zeta) ds, an integration by parts lowers u' to p + q s and then
to p1 + q1 s, where with u = u(±zeta^(1/2)) + w1 t + w2 t^2 + w3 t^3 + ...

    p1 ± q1 zeta^(1/2) = ± 3 w3/(2 zeta^(1/2)) - (2 w2 - q)/(4 zeta)

(DLMF 2.4(v)). What is at one zero of the pair is at the other with the other sign of D^(1/2):
`Conjugates` a ± b D^(1/2), so that no formula has a root of D, and all hold for a complex pair.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import sympy
from mpmath.ctx_mp import MPContext
from sympy import Expr, Rational, S, Symbol

from symasym.asymptotics.uniform.answer import corrected, sides_at, whole_at
from symasym.asymptotics.uniform.coalescing_pair import Airy, CanonicalPair, OneSide, airy
from symasym.asymptotics.uniform.order_zero_forms import _past_pair
from symasym.asymptotics.uniform.truncated_gaussian import (
    Corrections,
    Truncation,
    Truncations,
    _Functions,
    truncations_beside,
)
from symasym.asymptotics.weak_noise.compose import Side
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint
from symasym.asymptotics.weak_noise.series import BEYOND, Part, Series, terms
from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.formulas.builder import Symbols
from symasym.formulas.cases import Case
from symasym.formulas.letters import Rule, U
from symasym.formulas.symbolic_sums import BEYOND_1, LAM, X
from symasym.formulas.uniform import (
    P0,
    PAIRED,
    Q0,
    TURNS,
    V_MEAN,
    WELLS,
    Coalescing,
    Expressions,
    M,
    PairSymbols,
    Place,
    airy_functions,
    complex_pair,
    gaussian_functions,
    place_of,
    require_pair,
    signed,
)  # fmt: skip
from symasym.formulas.universal import at_zero
from symasym.numbers.polynomials import float_zeros, poly
from symasym.series.quadratic_factor import Pair
from symasym.special.airy import AiryProducts

__all__ = ["Apart", "UniformSeries", "stationary", "two_sides", "uniform_symbols"]

# Where the points stand, as numbers that can be compared.
_PLACES = MPContext()
# A stretch between two marks of A' that is looked at.
_THIN = 1e-6


class _Context(Expressions):
    """An mpmath context whose numbers are expressions, or mpf where points are compared."""

    def __init__(self, symbols: Symbols) -> None:
        self.symbols = symbols
        self.ratios: dict[Expr, Symbol] = {}

    prec, eps, inf = 53, _PLACES.eps, sympy.oo
    mpf, fac2, erfc = _PLACES.mpf, staticmethod(sympy.factorial2), staticmethod(sympy.erfc)
    log1p = staticmethod(lambda x: sympy.log(1 + x))

    @staticmethod
    def sqrt(x: Any) -> Any:
        return _PLACES.sqrt(x) if isinstance(x, _PLACES.mpf) else sympy.sqrt(x)

    def fsum(self, parts: Any) -> Expr:
        return sum(parts, S.Zero)

    def gammainc(self, a: int, low: int, ratio: Expr, regularized: bool) -> Symbol:
        """P(a, ratio) of a whole number a, as a symbol."""
        known = self.symbols
        rho = self.ratios.get(ratio)
        if rho is None:
            k = len(self.ratios) + 1
            rho = self.ratios[ratio] = Symbol(f"rho({k})", positive=True)
            known.values[rho], known.tex[rho] = ratio, rf"\rho_{{{k}}}"
        share = Symbol(f"P{a}({rho.name})", positive=True)
        terms = sum((rho**k / sympy.factorial(k) for k in range(a)), S.Zero)
        known.values[share] = 1 - sympy.exp(-rho) * terms
        known.tex[share] = rf"P({a}, {known.tex[rho]})"
        row = r"P(n, \rho) &= 1 - e^{-\rho} \sum_{k < n} \frac{\rho^k}{k!}"
        known.rules[share] = Rule((row,), (rho,))
        return share


class Conjugates:
    """a + b D^(1/2) at one zero of the pair, a - b D^(1/2) at the other."""

    def __init__(self, a: Any, b: Any, square: Expr) -> None:
        self.a, self.b, self.square = sympy.sympify(a), sympy.sympify(b), square

    def _of(self, x: Any) -> Conjugates:
        if isinstance(x, Conjugates):
            return x
        return Conjugates(x, 0, self.square)

    def __add__(self, other: Any) -> Conjugates:
        y = self._of(other)
        return Conjugates(self.a + y.a, self.b + y.b, self.square)

    def __mul__(self, other: Any) -> Conjugates:
        y = self._of(other)
        a = self.a * y.a + self.square * self.b * y.b
        return Conjugates(a, self.a * y.b + self.b * y.a, self.square)

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Any) -> Conjugates:
        return self._of(other) - self

    def __sub__(self, other: Any) -> Conjugates:
        y = self._of(other)
        return Conjugates(self.a - y.a, self.b - y.b, self.square)

    def __pow__(self, n: int) -> Conjugates:
        power = Conjugates(1, 0, self.square)
        for _ in range(n):
            power = power.__mul__(self)
        return power

    def __truediv__(self, other: Any) -> Conjugates:
        y = self._of(other)
        if y.a == 0:
            return Conjugates(self.b / y.b, self.a / (y.b * self.square), self.square)
        norm = y.a**2 - self.square * y.b**2
        return self * Conjugates(y.a / norm, -y.b / norm, self.square)


class _Named:
    """A series or a function as one symbol."""

    def __init__(self, value: Expr) -> None:
        self.value = value

    def at(self, point: Any) -> tuple[Expr, None]:
        return self.value, None


def _named(series: Any) -> Any:
    """A series of one symbol, or of numbers, as its value."""
    if not terms(series) or not isinstance(series, Series):
        return series
    (part,) = series.parts
    (c,) = part.coefficients
    return _Named(c * LAM ** -Rational(part.offset))


# -- the corrections at the start and the ends -----------------------------------------------------


class UniformSeries(PairSymbols):
    """A case with one pair, to an order."""

    def __init__(
        self, drift: Drift, case: Case, order: int, start: Fraction, place: Place,
        paired: tuple[int, ...],
    ) -> None:  # fmt: skip
        self.locals: dict[Symbol, Expr] = {}
        super().__init__(drift, case, order, start, place, paired)
        self.arithmetic = Expressions()  # type: ignore[assignment]
        self.canonical = self._canonical()

    def height_at(self, u: Expr) -> Symbol:
        """With its sign at the zeros next to the start."""
        height = super().height_at(u)
        beside = [k for k in (self.before - 1, self.before) if 0 <= k < len(self.zeros)]
        for k in beside:
            if u == self.zeros[k]:
                barrier = self.barrier(k)
                known = signed(height.name, barrier)
                for table in (self.values, self.tex):
                    table[known] = table.pop(height)
                return known
        return height

    def _canonical(self) -> CanonicalPair:
        """The pair with p, q and p1, q1."""
        pair, (side, sign) = self.canonical_form(), self.place
        rows = [(P0, Q0)]
        if self.count > 1:
            rows.append(self._next(pair))
        low, high = (positions(self)[self.zeros[k]] for k in self.paired) if self.real else (
            (side * _PLACES.mpf("0.5"),) * 2)  # fmt: skip
        half = (high - low) / 2
        own = Pair(_PLACES.zero, half**2, pair.psi, sign, pair.zeta, pair.slope, pair.level)
        known = self._known(airy_functions())
        return CanonicalPair(
            Fraction(float(side * (low + high) / 2)), own, sign > 0, V_MEAN, rows, [], None,
            (None, None), S.Zero, 0, {LAM: known},
        )  # fmt: skip

    def _known(self, products: AiryProducts) -> AiryProducts:
        """The products less the growth that `pair_terms` multiplies them by."""
        growth = sympy.exp(2 * self.zeta ** Rational(3, 2) * LAM / 3) if self.real else S.One
        squares, cross, slopes = (y / growth**2 for y in products[:3])
        return AiryProducts(
            squares, cross, slopes, products.bi / growth, products.bi_slope / growth
        )

    def _next(self, pair: Pair) -> tuple[Symbol, Symbol]:
        """p1 and q1, from u(s) at both zeros."""
        if self.powers is None:
            return self._next_between_zeros()
        square, sign = self.square, self.place.sign
        root, c = Symbol("root(m)", positive=True), []
        self.values[root], self.tex[root] = 1 / pair.slope, r"\vartheta"
        for j in range(3):
            about = [sympy.binomial(n, j) * x for n, x in enumerate(self.factor)][j:]
            c.append(self._conjugates(f"psi{j}", rf"\psi^{{({j})}}", about))
        half, sigma = Conjugates(0, 1, square), Conjugates(0, root, square)
        f1, f2, f3 = 2 * half * c[0], c[0] + 2 * half * c[1], c[1] + 2 * half * c[2]
        w1 = Conjugates(P0, sign * Q0 * root, square)
        square_of_w1 = self._two("w1^2", w1 * w1, "(w_1^2)")
        cube = self._two("w1^3", w1 * square_of_w1, "(w_1^3)")
        w2 = self._two("w2", w1 * (1 - f2 * cube) / (6 * sigma), "w_2")
        bends = f1 * w2 * w2 / 2 + f2 * square_of_w1 * w2 + f3 * w1 * cube / 4
        w3 = w1 * self._two("bends", bends, "b") / (-2 * sigma)
        g = 3 * self._two("w3", w3, "w_3") / (2 * sigma) - (2 * w2 - sign * Q0) / (4 * self.zeta)
        p1, q1 = Symbol("p1", real=True), Symbol("q1", real=True)
        self.values[p1], self.values[q1] = sign * g.a, g.b / root
        self.tex |= {p1: "p_1", q1: "q_1"}
        plus, minus = ("+", "-") if sign > 0 else ("-", "+")
        psi = " + ".join(
            rf"\psi_{{{j}}} \eta^{j}".removesuffix(r" \eta^0").removesuffix("^1")
            for j in range(len(self.factor))
        )
        rows = (
            rf"w_1 &= p {plus} q\varsigma, \quad w_2 = \frac{{w_1 (1 - f_2 w_1^3)}}{{6\varsigma}},"
            r" \quad w_3 = -\frac{w_1}{2\varsigma} \left(\frac{f_1 w_2^2}{2} + f_2 w_1^2 w_2"
            r" + \frac{f_3 w_1^4}{4}\right)",
            r"f_1 &= 2\eta\psi(\eta), \quad f_2 = \psi(\eta) + 2\eta\psi'(\eta), \quad"
            rf" f_3 = \psi'(\eta) + \eta\psi''(\eta), \quad \psi(\eta) = {psi}",
            rf"{plus.strip('+')}p_1 + q_1\varsigma &= \frac{{3 w_3}}{{2\varsigma}} -"
            rf" \frac{{2 w_2 {minus} q}}{{4\zeta}}, \quad \varsigma = \pm\sqrt{{\zeta}}, \quad"
            r" \eta = \pm\sqrt{D}",
        )
        of = (P0, Q0, self.zeta, square, *self.factor)
        self.rules |= dict.fromkeys((p1, q1), Rule(rows, of))
        return p1, q1

    def _next_between_zeros(self) -> tuple[Symbol, Symbol]:
        """The same from A's derivatives at two real zeros without a closed form."""
        root, side, g = sympy.sqrt(self.zeta), self.place.side, []
        for k, s in zip(self.paired[::side], (-root, root), strict=True):
            u = self.zeros[k]
            f1, f2, f3 = (
                -self.derivative(j + 1, u) * side ** (j + 1) / sympy.factorial(j) for j in (1, 2, 3)
            )
            w1 = P0 + Q0 * s
            w2, w3 = (Symbol(f"w{j}({u})", real=True) for j in (2, 3))
            self.tex |= {w2: f"w_2({self.tex[u]})", w3: f"w_3({self.tex[u]})"}
            self.values[w2] = w1 * (1 - f2 * w1**3) / (6 * s)
            bends = f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4
            self.values[w3] = -w1 * bends / (2 * s)
            g.append(3 * w3 / (2 * s) - (2 * w2 - Q0) / (4 * self.zeta))
        p1, q1 = Symbol("p1", real=True), Symbol("q1", real=True)
        self.values[p1], self.values[q1] = (g[1] + g[0]) / 2, (g[1] - g[0]) / (2 * root)
        self.tex |= {p1: "p_1", q1: "q_1"}
        return p1, q1

    def _conjugates(self, name: str, tex: str, values: list[Any]) -> Conjugates:
        """sum of values[n] (±D^(1/2))^n as a ± b D^(1/2), its parts as symbols."""
        even, odd = (poly(values[k::2], self.square) + S.Zero for k in (0, 1))
        return self._two(name, Conjugates(even, odd, self.square), tex)

    def _two(self, name: str, value: Conjugates, tex: str) -> Conjugates:
        """The same with symbols for both parts, where they are none."""
        parts: list[Expr] = []
        for part, mark in ((value.a, "even"), (value.b, "odd")):
            if part.is_Atom:
                parts.append(part)
                continue
            symbol = Symbol(f"{name}({mark})", real=True)
            self.values[symbol] = part
            head = tex or rf"{name[0]}_{name[1:]}"
            self.tex[symbol] = rf"{{{head}}}_{{\mathrm{{{mark}}}}}"
            parts.append(symbol)
        return Conjugates(parts[0], parts[1], self.square)

    # -- the regular part -------------------------------------------------------------------------

    def _partial_fractions(self, k: int, lo: Expr, hi: Expr) -> Expr:
        """The finite part past the pair and over the other zeros."""
        apart = [u for j, u in enumerate(self.zeros) if j not in self.paired]
        zeros, self.zeros = self.zeros, apart
        total = super()._partial_fractions(k, lo, hi)
        self.zeros = zeros
        square, assigned = self.square, []
        for j in range(1, 2 * k):
            values = [
                sympy.diff(self.A, U, n).subs(U, M) / sympy.factorial(n) * sympy.binomial(n, j)
                for n in range(j, (self.kept or 0) + 1)
            ]
            assigned.append(self._conjugates(f"A{j}", f"A_{{{j}}}", values or [S.Zero]))
        one = Conjugates(1, 0, square)
        inverse = self._two("inverse", one / assigned[0], "(1/A_1)")
        g = [
            self._two(f"quotient{j}", a * inverse, f"(A_{{{j}}}/A_1)")
            for j, a in enumerate(assigned[1:], 2)
        ]
        rows = at_zero(k, (self.kept or 0) - 1)[k - 1]
        for power, p in zip(range(1 - 2 * k, 0), rows, strict=True):
            share = 0 * one
            for powers, c in p.terms():
                term = Rational(c.numerator, c.denominator) * one
                for a, n in zip(g, powers, strict=False):
                    term = term * a**n
                share = share + term
            if not (share.a or share.b):
                continue
            share = self._two(f"share({k},{power})", share * inverse**k, f"c_{{{k},{power}}}")
            ends = [edge - M for edge in (hi, lo)]
            if power == -1:
                sides = [_past_pair(self.arithmetic, 2 * square * share.b, 2 * share.a, square, y)
                         for y in map(self._from_middle, (hi, lo))]  # fmt: skip
                total += sum(sides[0]) - sum(sides[1])
            else:
                n = -power - 1
                t = [share * Conjugates(y, 1, square) ** n / (y**2 - square) ** n for y in ends]
                total += 2 * (t[0].a - t[1].a) / (power + 1)
        return total

    def _from_middle(self, edge: Expr) -> Symbol:
        """An edge's distance from the pair's middle."""
        beyond = edge > self.start if self.place.side > 0 else edge >= self.start
        y = signed(f"y({edge})", bool(beyond))
        self.values[y], self.tex[y] = edge - M, f"y_{{{edge}}}"
        return y

    # -- what is taken together -------------------------------------------------------------------

    def local(self, canonical: CanonicalPair, lam: Any, order: int, context: Any) -> Airy:
        """The pair's integrals as symbols."""
        side, symbols = "+" if self.place.side > 0 else "-", []
        values = airy(canonical, lam, order, context)
        # A pair's terms multiply by the growth that the scaled products are without.
        scaled = canonical._replace(known={LAM: self._known(airy_functions(True))})
        in_code = airy(scaled, lam, order, context)
        for letter, value, other in zip("BWJ", values, in_code, strict=True):
            symbol = Symbol(f"{letter}{side}", real=True)
            self.locals[symbol] = value if letter == "J" else sympy.expand_mul(value)
            self.tex[symbol] = rf"\mathcal{{{letter}}}"
            self.grows(symbol, other, 2 if letter == "J" else 1)
            symbols.append(symbol)
        return Airy(*symbols)


# -- points and their places -----------------------------------------------------------------------


def positions(symbols: Symbols) -> dict[Expr, Any]:
    """Numbers in the order of -1, the zeros in the layer, the start, and 1."""
    count, place = len(symbols.zeros) + 1, _PLACES.mpf
    numbers = {symbols.start: place(0), -S.One: place(-1), S.One: place(1)}
    if symbols.start == -1:
        numbers[symbols.start] = place(-1)
    for k, u in enumerate(symbols.zeros):
        number = k - symbols.before + (1 if k >= symbols.before else 0)
        numbers[u] = place(number) / count
    return numbers


def _zeros(symbols: Symbols) -> list[CriticalPoint]:
    """The wells and barriers, left to right, with Watson's coefficients."""
    points, at = [], positions(symbols)
    for k, u in enumerate(symbols.zeros):
        barrier = symbols.barrier(k)
        symbols.saddle(k)
        series = symbols.series[Symbol(f"{'B' if barrier else 'W'}{k + 1}", real=True)]
        front = series.front * LAM ** Rational(1, 2)
        front = front.subs(X, 1 / LAM)
        height = symbols.heights[u] if barrier else -symbols.heights[u]
        row = Series([Part(0.5, 0, [front * c for c in series.coefficients])])
        kind = "barrier" if barrier else "well"
        points.append(CriticalPoint(k, height, row, None, kind, at[u]))
    return points


def _truncations(
    symbols: Symbols, edge: Expr, zeros: list[CriticalPoint], context: Any
) -> list[Truncation]:
    """The truncated Gaussians at the start or an end, with a symbol for what they are made of."""
    count = symbols.count + BEYOND
    (part,) = symbols.smooth(edge).parts
    h = [*part.coefficients, *[S.Zero] * count][:count]
    rows = truncations_beside(positions(symbols)[edge], symbols.heights[edge], h, zeros, 0, context)
    return [_in_symbols(symbols, one, edge, zeros, len(rows) == 1) for one in rows]


def _in_symbols(
    symbols: Symbols, one: Truncation, edge: Expr, zeros: list[CriticalPoint], alone: bool
) -> Truncation:
    """A truncated Gaussian with a symbol for each number and each function.

    In LaTeX their index is the edge, and the zero unless it is `alone` there.
    """
    (k,) = [k for k, z in enumerate(zeros) if z.u == one.zero]
    place = f"{symbols.names[edge]},{symbols.zeros[k].name}"
    before = positions(symbols)[edge] < one.zero
    index = symbols.names[edge] + ("" if alone else f",{symbols.tex[symbols.zeros[k]]}")

    def named(name: str, head: str, value: Any, positive: bool | None = None) -> Symbol:
        symbol = signed(f"{name}({place})", positive)
        symbols.values[symbol] = value
        symbols.tex[symbol] = rf"{head}{index}}}"
        return symbol

    t = named("t", "t_{", one.t, not before)
    x = named("xi", r"\xi_{", abs(t) * sympy.sqrt(LAM / 2), True)
    functions = []
    side = -1 if before else 1
    heads = (
        ("sigma", r"\sigma_{", side), ("Da", r"\mathcal{D}_{", side),
        ("area", r"\Lambda_{", 1 / LAM),
    )  # fmt: skip
    values, in_code = (gaussian_functions(x, one.barrier, emitted) for emitted in (False, True))
    for (name, head, factor), value, other in zip(heads, values, in_code, strict=True):
        symbol = named(name, head, factor * value)
        symbols.code[symbol] = factor * other
        functions.append(symbol)
    fall, c, a, b = one.t**2 / 2, [], [], []
    in_a: dict[Symbol, Expr] = {}
    for n in range(symbols.count):
        whole = one.whole[n]
        c.append(Symbol(f"c{n}({symbols.zeros[k].name})", real=True))
        symbols.values[c[n]], symbols.tex[c[n]] = whole, f"c_{n}({symbols.tex[symbols.zeros[k]]})"
        faded = one.peak[n] / whole if whole else S.Zero
        a.append(named(f"a{n}", f"a_{{{n},", c[n] * faded))
        if faded.is_Symbol:
            in_a[faded] = a[n] / whole
        # Written with t and a_n in place of what these are.
        b.append(named(f"b{n}", f"b_{{{n},", one.series[n].subs(fall, t**2 / 2).xreplace(in_a)))
    return one._replace(t=t, peak=a, whole=c, series=b, known={LAM: _Functions(*functions)})


def _corrections(symbols: Any, edge: Expr) -> Any:
    """`corrected` with symbols for its values at one point."""

    def correction(
        rows: list[Truncation], members: list[Any], lam: Any, order: int, context: Any
    ) -> Corrections:
        values: Corrections = corrected(rows, members, lam, order, context)
        if not rows:
            return values
        name, parts = symbols.names[edge], []
        height = symbols.heights[edge]
        units = [sympy.exp(LAM * h) for h in (height, -height, S.Zero)]
        shared = [
            sum((y / unit for y in sympy.Add.make_args(value)), S.Zero)
            for value, unit in zip(values, units, strict=True)
        ]
        for k, total in enumerate(_repeated(shared), 1):
            factor = Symbol(f"k{k}({name})", real=True)
            symbols.values[factor], symbols.tex[factor] = total, rf"\beta_{{{k},{name}}}"
            shared = [value.xreplace({total: factor}) for value in shared]
        for letter, value, unit in zip("EFM", shared, units, strict=True):
            symbol = Symbol(f"d{letter}({name})", real=True)
            symbols.values[symbol] = sympy.expand_mul(value)
            symbols.tex[symbol] = rf"\delta {letter}_{{{name}}}"
            parts.append(symbol * unit)
        return Corrections(*parts)

    return correction


def _repeated(values: list[Expr]) -> list[Expr]:
    """The sums that are met more than once, without those inside of them."""
    met = Counter(e for v in values for e in sympy.preorder_traversal(v) if e.is_Add)
    often = [e for e, times in met.items() if times > 1]
    return [e for e in often if not any(e is not y and y.has(e) for y in often)]


# -- T and 1 - P -----------------------------------------------------------------------------------


def two_sides(symbols: Any) -> tuple[Side, Side]:
    """Both sides of the start."""
    at, both, context = positions(symbols), [], _Context(symbols)
    for one, sign in zip(symbols.both_sides(), (-1, 1), strict=True):

        def placed(points: list[CriticalPoint], sign: int = sign) -> list[CriticalPoint]:
            return [
                p._replace(
                    u=sign * at[sympy.sympify(sign * p.u)], series=_named(p.series),
                    onward=_named(p.onward),
                )
                for p in points
            ]  # fmt: skip

        beyond = one.beyond and (S.One, *one.beyond[1:])
        both.append(
            one._replace(
                scale_points=placed(one.scale_points), speed_points=placed(one.speed_points),
                regular_part=_named(one.regular_part), scale_start=_named(one.scale_start),
                speed_start=Series([]), beyond=beyond,
            )
        )  # fmt: skip
    paired = isinstance(symbols, UniformSeries)
    sides = [
        OneSide(one, [symbols.canonical] if paired and symbols.place.side == sign else [])
        for one, sign in zip(both, (-1, 1), strict=True)
    ]
    zeros = _zeros(symbols)
    edges = (-S.One, symbols.start, S.One)
    truncations = Truncations(*(_truncations(symbols, edge, zeros, context) for edge in edges))
    named = iter(_corrections(symbols, edge) for edge in edges)

    def correction(*given: Any) -> Corrections:
        values: Corrections = next(named)(*given)
        return values

    known = sides_at(
        sides, truncations, 1 + BEYOND_1, LAM, symbols.count - 1, context,
        symbols.local if paired else None, correction,
    )  # fmt: skip
    return known.left, known.right


def stationary(symbols: Any, order: int) -> tuple[Expr, Expr]:
    """int e^{-lam V} over |u| > 1, and over all u; with or without a pair."""
    at, context = positions(symbols), _Context(symbols)
    points = [p._replace(u=at[sympy.sympify(p.u)], series=_named(p.series)) for p in symbols.line()]
    pairs = [symbols.canonical] if isinstance(symbols, UniformSeries) else []
    local = symbols.local if pairs else None
    total = whole_at(points, pairs, LAM, order, context, local)
    zeros = _zeros(symbols)
    for edge, sign in ((S.One, 1), (-S.One, -1)):
        rows = _truncations(symbols, edge, zeros, context)
        change = _corrections(symbols, edge)(rows, [], LAM, order, context)
        total += sign * change.speed
    outside = sum(
        sympy.exp(LAM * p.height) / (LAM * slope)
        for p, slope in (
            (points[0], symbols.a_minus), (points[-1], -symbols.a_plus)
        )
    )  # fmt: skip
    return outside, total


# -- which pair ------------------------------------------------------------------------------------


def uniform_symbols(
    drift: Drift, quantity: str, order: int, start: Fraction, case: Case
) -> Symbols:
    """The symbols of a case, with the pair that is taken together, if there is one."""
    powers = drift.expression().as_poly(U)
    if powers is None:
        _require_turns(drift, quantity, case)
    if quantity == "T":
        alone = len(case.kinds) < 2 and not _complex_pair(drift, case)
        if alone and (case.kinds or not drift.free or powers is None or powers.degree() < 2):
            # To order 0 no Gaussian of a well is truncated.
            plain = order == 0 and case.kinds != ("barrier",)
            return (Alone if plain else Apart)(drift, case, order, start)
        require_pair(case)
        if order == 0 and powers is not None:
            return Coalescing(drift, case, start)
        place, members = place_of(drift, case, start), (0, 1) if case.kinds else ()
        return UniformSeries(drift, case, order, start, place, members)
    kinds = case.kinds
    if len(kinds) == 1:
        pair = _complex_pair(drift, case)
        if pair is None:
            return Apart(drift, case, order, start)
        return UniformSeries(drift, case, order, start, pair, ())
    if str(case) not in WELLS:
        raise InputError(
            f"case is '{' '.join(kinds)}'; the uniform formula of 1 - P is that of 'well' and of "
            "'well barrier well'."
        )
    first = _nearer(drift, case)
    return UniformSeries(
        drift, case, order, start, Place(1, -1 if first else 1), (first, first + 1)
    )


def _require_turns(drift: Drift, quantity: str, case: Case) -> None:
    """Refuse an A that is no polynomial with other pairs of zeros, real or complex, than one real.

    Between the zeros of a real pair is a turning point of A, and beside a complex pair another.
    """
    paired = str(case) in PAIRED[:2]
    known = {n: case.example[n] for n in drift.free if n in case.example}
    with own_context(15) as context:
        field = ExactField(drift.bind(**known) if known else drift, False, context)
        marks = sorted({-1.0, 1.0, *(m for m in map(float, field.monotone_marks()) if abs(m) < 1)})
        middles = [Fraction((a + b) / 2) for a, b in pairwise(marks) if b - a > _THIN]
        rising = [field.taylor(u, Fraction(1), 2)[1] > 0 for u in middles]
    turns = sum(a != b for a, b in pairwise(rising))
    if turns != paired or (len(case.kinds) > 1 and (quantity != "T" or not paired)):
        verb = "escape_time" if quantity == "T" else "occupation"
        raise InputError(
            f"A = {drift.expression()} is no polynomial in u and has {turns} turning points in "
            "the layer; of such A the uniform formula is that of at most one zero and no turning "
            "point, and of T with a well, a barrier and one, since complex zeros have no closed "
            f"form; use sa.{verb}(method='uniform')."
        )


class Alone(Symbols):
    """A case without a pair, of which no Gaussian is truncated."""

    def conditions(self) -> Iterator[Any]:
        """No complex pair of zeros over the layer."""
        yield from super().conditions()
        if self.powers is None:
            yield sympy.Eq(TURNS(self.A), 0)
        others = self.others_outside
        if self.kept == len(self.zeros) + 2 <= 3:
            # The sum of all zeros.
            assert self.powers is not None
            first, second = self.powers.all_coeffs()[:2]
            middle = (-second / first - sum(self.zeros, S.Zero)) / 2
            real = sympy.Ge(sympy.discriminant(self.A, U), 0)
            yield sympy.Or(real, sympy.Ge(sympy.Abs(middle), 1))
        else:
            for u in others:
                yield sympy.Or(sympy.Eq(sympy.im(u), 0), sympy.Ge(sympy.Abs(sympy.re(u)), 1))


class Apart(Alone):
    """A case without a pair."""


def _numbers_of(drift: Drift, case: Case) -> list[float]:
    """A's coefficients, with the case's example for free parameters; none where it has none."""
    if any(n not in case.example for n in drift.free):
        return []
    bound = drift.bind(**{n: case.example[n] for n in drift.free}) if drift.free else drift
    return [float(x) for x in bound.exact_coefficients() or ()]


def _complex_pair(drift: Drift, case: Case) -> Place | None:
    """The complex pair of zeros over the layer, if there is one; a free one's place is right."""
    found = complex_pair(drift, _numbers_of(drift, case))
    return None if found is None else Place(1, 1 if found[1] > 0 else -1)


def _nearer(drift: Drift, case: Case) -> int:
    """0 if the first well and the barrier coalesce first, 1 if the barrier and the last well."""
    c = _numbers_of(drift, case)
    if not c:
        return 1
    zeros = [z.real for z in float_zeros(c)
             if abs(z.imag) < 1e-9 and abs(z.real) < 1]  # fmt: skip
    v = np.polynomial.polynomial.polyval(sorted(zeros), np.polynomial.polynomial.polyint(c))
    return 0 if abs(v[1] - v[0]) < abs(v[2] - v[1]) else 1
