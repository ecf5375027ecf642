"""T through a coalescence, order 0, with a symbol for everything that depends on the drift.

`Coalescing` is the `OrderZero` of `symasym.asymptotics.uniform.order_zero` whose numbers are SymPy
expressions. It has one pair of zeros of a polynomial A, A = ((u - m)^2 - D) psi(u - m), a well and
a barrier (D > 0) or past their coalescence a complex pair (D < 0). With phi du = (s^2 - zeta) ds,
u'(s) = p + q s at both zeros,

    (4/3) zeta^(3/2) = V(barrier) - V(well),    p ± q zeta^(1/2) = (2 zeta^(1/2)/|phi'|)^(1/2),

which in m, D and psi are analytic through D = 0 (C. Chester, B. Friedman, F. Ursell, Proc. Camb.
Phil. Soc. 53 (1957) 599). A barrier before the layer's end u = 1 has its Gaussian truncated there
(N. Bleistein, Comm. Pure Appl. Math. 19 (1966) 353). A of degree 2 or 3 has m and D in closed form:
with A = c_3 (v^3 - 3 k^2 v + ...), v = u + c_2/(3 c_3), v = ± k T_(1/3)(± w) half-way between both.
Of another A a real pair has both equations themselves, with u1 and u2 named: `_between_zeros`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import sympy
from sympy import Expr, Rational, S, Symbol

from symasym.asymptotics.uniform.order_zero import OrderZero, Together
from symasym.asymptotics.uniform.order_zero_forms import (
    BLENDING,
    AiryForm,
    Truncated,
    TruncatedIntegral,
    blended,
    regular_share,
)
from symasym.asymptotics.weak_noise.one_sided import Builder, CriticalPoint, PairContribution
from symasym.asymptotics.weak_noise.series import Series
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.forms import LOCAL
from symasym.formulas.builder import Symbols
from symasym.formulas.cases import Case
from symasym.formulas.letters import U
from symasym.formulas.symbolic_sums import BEYOND_1, LAM, Sum, Symbolic
from symasym.generated.formulas import canonical, over_end, pair_norm
from symasym.numbers.polynomials import float_zeros, poly
from symasym.series.quadratic_factor import Pair, mirrored
from symasym.special.airy import AiryProducts
from symasym.special.dawson import gaussians
from symasym.special.exponentials import quotients

__all__ = [
    "PAIRED", "Coalescing", "Locals", "PairSymbols", "Place", "airy_functions",
    "gaussian_functions", "has_formula", "place_of", "require_pair",
]  # fmt: skip

#: The cases with one pair; the last is that of a complex one.
PAIRED = ("start well barrier", "barrier well start", "start")
#: Those of 1 - P: a pair of three zeros, or a complex one, or none.
WELLS = ("start well", "start well barrier well")
M = Symbol("m", real=True)


def signed(name: str, positive: bool | None) -> Symbol:
    """A real symbol that is positive, negative, or either (None).

    With one assumption: SymPy may take a symbol for another of the same name and sign that was
    made with more of them, which prints otherwise.
    """
    return Symbol(name, **{{True: "positive", False: "negative", None: "real"}[positive]: True})


V_MEAN = Symbol("V(m)", real=True)
#: The number of zeros of A' in (-1, 1).
TURNS = sympy.Function("turning_points", integer=True)
Z, P0, Q0 = sympy.symbols("Z p q", real=True)
_PARTS = {"scale": "B", "speed": "W", "both": "J", "onward": "G"}


class Expressions:
    """The arithmetic of expressions; of a test that is open the general branch is taken."""

    context = True
    bits, eps = 0, S.Zero
    zero, one, pi, euler = S.Zero, S.One, sympy.pi, sympy.EulerGamma
    sqrt, exp, log = (staticmethod(f) for f in (sympy.sqrt, sympy.exp, sympy.log))
    maximum, tiny = staticmethod(sympy.Max), S.Zero
    rational, number = staticmethod(Rational), staticmethod(sympy.sympify)

    def cbrt(self, x: Expr) -> Expr:
        return x ** Rational(1, 3)

    def expm1(self, x: Expr) -> Expr:
        return sympy.exp(x) - 1

    def log1p(self, x: Expr) -> Expr:
        return sympy.log(1 + x)

    def atan2(self, y: Expr, x: Expr) -> Expr:
        """For x > 0."""
        return sympy.atan(y / x)

    def where(self, test: Any, a: Expr, b: Expr) -> Expr:
        return a if test == True else b  # noqa: E712

    def any(self, test: Any) -> bool:
        return bool(test == True)  # noqa: E712

    all = any


class Locals(Symbolic):
    """Sums whose local integrals are symbols, too."""

    def __init__(self, symbols: Coalescing) -> None:
        self.symbols = symbols

    def exponential(self, height: Expr, series: Any, rounding: float = 0.0) -> Sum:
        """One symbol times e^{lam height}."""
        if isinstance(series, Series):
            return super().exponential(height, series, rounding)
        return Sum([(height, self.symbols.local(series))])


class Place(NamedTuple):
    """Where the pair is: right (1) or left (-1) of the start, and the sign of psi there."""

    side: int
    sign: int


def has_formula(case: Case, quantity: str) -> bool:
    """True of a case that the uniform formula of a quantity is for."""
    if quantity == "T":
        return str(case) in PAIRED or len(case.kinds) < 2
    return str(case) in WELLS


def require_pair(case: Case) -> None:
    """Refuse a case without one pair of zeros that has a well first, or a complex one."""
    if str(case) not in PAIRED:
        raise InputError(
            f"case is '{case}'; the uniform formula of T is that of 'start well barrier', of "
            "'barrier well start', of 'start' past the coalescence of both, and of one zero or "
            "none without a complex pair; use sa.escape_time(method='uniform')."
        )


class PairSymbols(Symbols):
    """A case with one pair of zeros, in symbols: m, D and psi, and the pair's Airy form.

    `paired` are the numbers of the pair's well and barrier among the zeros in the layer, none of
    a complex pair.
    """

    def __init__(
        self, drift: Drift, case: Case, order: int, start: Fraction, place: Place,
        paired: tuple[int, ...],
    ) -> None:  # fmt: skip
        self.drift, self.place, self.paired = drift, place, paired
        self.real = bool(paired)
        self.square = signed("D", self.real)
        self.zeta = signed("zeta", self.real)
        super().__init__(drift, case, order, start)

    def _zeros(self) -> list[Symbol]:
        """u1, u2, ... in the layer, the pair's m ± D^(1/2); `others_outside` are in no pair."""
        if self.powers is None:
            zeros = super()._zeros()
            low, high = (zeros[k] for k in self.paired)
            self.factor = []
            self.values[M], self.values[self.square] = (low + high) / 2, (high - low) ** 2 / 4
            return zeros
        self.kept = self.powers.degree()
        self.factor = self._factor()
        inside = len(self.case.kinds)
        zeros = [self._point(k + 1, True) for k in range(inside)]
        for k, sign in zip(self.paired, (-1, 1), strict=False):
            self.values[zeros[k]] = M + sign * sympy.sqrt(self.square)
            del self.equations[zeros[k]]
        more = range(inside + 1, self.kept - 1 + len(self.paired))
        self.others_outside = [self._point(k, self.kept == 3) for k in more]
        apart = [u for k, u in enumerate(zeros) if k not in self.paired] + self.others_outside
        if self.kept == 3:
            # The sum of all zeros.
            (u,) = apart
            c3, c2 = self.powers.all_coeffs()[:2]
            self.values[u] = -c2 / c3 - 2 * M
            del self.equations[u]
        return zeros

    def _factor(self) -> list[Symbol]:
        """psi_0, psi_1, ... away from the start; m and D in closed form or their equations."""
        assert self.powers is not None
        assert self.kept is not None
        c = [sympy.diff(self.A, U, j).subs(U, M) / sympy.factorial(j) for j in range(self.kept + 1)]
        psi: list[Any] = [S.Zero] * (self.kept + 1)
        for j in range(self.kept, 1, -1):
            psi[j - 2] = sympy.expand(c[j] + self.square * psi[j])
        side, sign = self.place
        names = [Symbol(f"psi{j}", real=True) for j in range(self.kept - 1)]
        for name, value in zip(names, mirrored(psi, side), strict=False):
            self.values[name] = sign * value
            self.tex[name] = rf"\psi_{{{name.name[3:]}}}"
        a = self.powers.all_coeffs()
        if self.kept == 2:
            self.values[M] = -a[1] / (2 * a[0])
            self.values[self.square] = M**2 - a[2] / a[0]
        elif self.kept == 3:
            shift, w, k = a[1] / (3 * a[0]), Symbol("w", real=True), Symbol("k", positive=True)
            turn = side * sign * (1 if _leading(self.drift, self.case) > 0 else -1)
            third = sympy.cos(sympy.acos(w) / 3) if self.real else sympy.cosh(sympy.acosh(w) / 3)
            self.values[k] = sympy.sqrt(sympy.factor(shift**2 - a[2] / (3 * a[0])))
            low = sympy.factor(self.A.subs(U, -shift) / a[0])
            self.values[w] = turn * low / (2 * k**3)
            self.values[M] = turn * k * third - shift
            self.values[self.square] = 3 * (k**2 - (M + shift) ** 2)
        else:
            self.equations[M] = sympy.expand(c[1] + self.square * psi[1])
            self.equations[self.square] = sympy.expand(c[0] + self.square * psi[0])
        return names

    def canonical_form(self) -> Pair:
        """The pair in its Airy form, p + q s."""
        if self.powers is None:
            return self._between_zeros()
        c, square, sign = self.arithmetic, self.square, self.place.sign
        even, odd = (poly(self.factor[j::2], square) + S.Zero for j in (0, 1))
        mean = poly(
            [3 * a / ((2 * k + 1) * (2 * k + 3)) for k, a in enumerate(self.factor[::2])], square
        )
        root = c.cbrt(mean)
        self.values[self.zeta] = square * root**2
        norm = Symbol("n", positive=True)
        self.values[norm] = pair_norm(c, even, odd, square)
        self.values[P0], self.values[Q0] = canonical(c, 1 / root, even, sign * odd, norm)
        self.values[Z] = self.zeta * LAM ** Rational(2, 3)
        self.tex |= {self.zeta: r"\zeta", V_MEAN: r"\bar V"}
        # The mean of V over both zeros, a polynomial in D.
        y, v = Symbol("y"), -sympy.integrate(self.A, U)
        about = sympy.Poly(v.subs(U, M + y) - v.subs(U, self.start), y)
        self.values[V_MEAN] = sum(
            (a * square ** (n // 2) for (n,), a in about.terms() if n % 2 == 0), S.Zero
        )
        return Pair(S.Zero, square, self.factor, sign, self.zeta, 1 / root, S.Zero)

    def _between_zeros(self) -> Pair:
        """The same of two real zeros without a closed form, from V and V'' there."""
        well, barrier = (self.zeros[k] for k in self.paired[:: self.place.side])
        low, high = (self.heights[u] for u in (well, barrier))
        self.values[self.zeta] = (3 * (high - low) / 4) ** Rational(2, 3)
        root = sympy.sqrt(self.zeta)
        before, behind = (
            sympy.sqrt(2 * root / abs(self.derivative(2, u))) for u in (well, barrier)
        )
        self.values[P0], self.values[Q0] = (behind + before) / 2, (behind - before) / (2 * root)
        self.values[Z], self.values[V_MEAN] = self.zeta * LAM ** Rational(2, 3), (low + high) / 2
        self.tex |= {self.zeta: r"\zeta", V_MEAN: r"\bar V"}
        return Pair(S.Zero, self.square, [], 1, self.zeta, S.One, S.Zero)

    def grows(self, symbol: Symbol, scaled: Expr, times: int) -> None:
        """The name of `symbol` in code, without its growth e^{(2/3) times Z^(3/2)} for D > 0."""
        self.code[symbol] = scaled
        if self.real:
            rise = Symbol("rise(m)", positive=True)
            self.code[rise] = Rational(2, 3) * self.zeta ** Rational(3, 2)
            self.growth[symbol] = times * rise

    def conditions(self) -> Iterator[Any]:
        """The place and kind of the pair."""
        side, m = self.place.side, M
        if self.kept == 3:
            w = Symbol("w", real=True)
            yield sympy.Lt(sympy.Abs(w), 1) if self.real else sympy.Gt(w, 1)
        if self.powers is None:
            yield sympy.Eq(TURNS(self.A), 1)
        if self.real:
            return
        yield from (self.start < m, m < 1) if side > 0 else (m > -1, m < self.start)
        # Airy functions take the pair's integrals over all of the line.
        yield sympy.Le((-self.zeta) ** Rational(3, 2) * Rational(4, 3), sympy.Abs(V_MEAN))


class Coalescing(PairSymbols, OrderZero):
    """Both one-sided expansions of a case with one pair, to order 0, in symbols."""

    def __init__(self, drift: Drift, case: Case, start: Fraction) -> None:
        place = place_of(drift, case, start)
        self.locals: dict[Symbol, Expr] = {}
        super().__init__(drift, case, 0, start, place, (0, 1) if case.kinds else ())
        self.arithmetic = Expressions()  # type: ignore[assignment]
        self.exponential_gap = S.Zero
        self.apart = []
        self.together = [self._pair()]
        self.prepared()

    def _pair(self) -> Together:
        """The pair in its Airy form, p + q s."""
        form = AiryForm(2, self.zeta, P0, Q0, None, None, None)
        pair, (side, sign) = self.canonical_form(), self.place
        return Together(form, pair, side * M, side, sign > 0, self.paired, V_MEAN, S.Zero)

    def ranks(self, pair: Together, inside: list[int]) -> tuple[Any, Any]:
        return (1, 2) if pair.members else (Rational(1, 2), Rational(1, 2))

    # -- local integrals ----------------------------------------------------------------------

    def local(self, integral: Any) -> Symbol:
        """A symbol for a local integral, heights left out, with all that it is made of."""
        side = "+" if self.place.side > 0 else "-"
        airy = not isinstance(integral, TruncatedIntegral)
        letter = _PARTS[integral.part] if airy else f"{_PARTS[integral.part]}e"
        symbol = Symbol(f"{letter}{side}", real=True)
        if symbol not in self.locals:
            over = self._over_pair(symbol, integral) if airy else self._over_end(integral)
            self.locals[symbol] = over
            name = rf"\mathcal{{{letter[0]}}}"
            self.tex[symbol] = name if airy else rf"{name}_{{{'+' if side == '+' else '-'}1}}"
        return symbol

    def _over_pair(self, symbol: Symbol, integral: Any) -> Expr:
        plain, scaled = (
            integral.at(_Point(self.arithmetic, {(2, "airy"): (Z, airy_functions(emitted))}))[0]
            for emitted in (False, True)
        )
        self.grows(symbol, scaled, 2 if integral.part == "both" else 1)
        return plain

    def _over_end(self, integral: TruncatedIntegral) -> Expr:
        c, e = self.arithmetic, integral.gaussian
        x, sigma, dawson, area = (Symbol(s, positive=True) for s in ("xi", "sigma", "Da", "area"))
        if x not in self.values:
            self.values[x] = e.t * sympy.sqrt(LAM / 2)
            for table, emitted in ((self.values, False), (self.code, True)):
                named = gaussian_functions(x, True, emitted)
                table |= dict(zip((sigma, dawson, area), named, strict=True))
            self.tex |= {x: r"\xi", sigma: r"\sigma", dawson: r"\mathcal{D}", area: r"\Lambda"}
        scale, speed, both = over_end(c, LAM, e.t, e.peak, e.rest, sigma, dawson, area)
        length = BEYOND_1
        straight, beyond = quotients(-LAM * e.slope * length, c)
        straight, beyond = length * straight, length**2 * beyond
        return {
            "scale": scale + straight, "speed": speed,
            "onward": straight, "both": both + beyond,
        }[integral.part]  # fmt: skip

    def barrier_before(self, sign: int) -> Any:
        """The barrier of the pair before the end, if that is on this side."""
        if not self.real or sign != self.place.side:
            return None
        edge = self.edges[1 + sign]
        well, barrier = self.zeros[::sign]
        t, peak, rest = (Symbol(s, real=True) for s in ("t", "P", "rest"))
        fall = self.heights[barrier] - self.heights[edge]
        rho, slope = Symbol("rho", positive=True), self._slope(sign)
        self.tex |= {rho: r"\rho", rest: "Q"}
        drop = self.heights[barrier] - self.heights[well]
        self.values[rho] = blended(self.arithmetic, drop, S.One, fall)[0]
        keep = blended(self.arithmetic, rho / BLENDING, S.One, S.One)[1]
        self.values[t] = sympy.sqrt(2 * fall)
        self.values[peak] = (1 - keep) / sympy.sqrt(-self.derivative(2, barrier))
        self.values[rest] = 1 / slope - peak / t
        return Truncated(sign, t, peak, rest, S.Zero, S.Zero, slope)

    def _slope(self, sign: int) -> Expr:
        """phi beyond the end, positive away from the start."""
        return self.a_plus if sign > 0 else -self.a_minus

    def end(
        self,
        sign: int,
        rank: int,
        scale_points: list[CriticalPoint],
        speed_points: list[CriticalPoint],
    ) -> tuple[Any, Any, Any] | None:
        gaussian: Any = self.before_end[sign]
        if gaussian is None:
            return Builder.end(self, sign, rank, scale_points, speed_points)
        height, edge = self.heights[self.edges[1 + sign]], self.edges[1 + sign]
        parts = {part: TruncatedIntegral(gaussian, part) for part in _PARTS}
        self.coalescing.append(PairContribution(-1, -1, S.Zero, parts["both"]))
        scale_points.append(
            CriticalPoint(rank, height, parts["scale"], parts["onward"], "kink", edge)
        )
        speed_points.append(CriticalPoint(rank, -height, parts["speed"], None, "kink", edge))
        return None

    # -- the regular part -----------------------------------------------------------------------

    def primitives(self) -> Any:
        return None

    def _partial_fractions(self, k: int, lo: Expr, hi: Expr) -> Expr:
        """The finite part of int du/phi past the pair and over the other zeros."""
        zeros, self.zeros = self.zeros, []
        total = super()._partial_fractions(k, lo, hi)
        self.zeros = zeros
        one, side = self.together[0], self.place.side
        share, parts = regular_share(one.pair, True, self.arithmetic), []
        for edge in (hi, lo):
            beyond = edge != self.start
            mine = (edge > self.start) == (side > 0) and beyond
            y = signed(f"y({edge})", mine)
            self.values[y] = side * (edge - M)
            self.tex[y] = f"y_{{{edge}}}"
            parts.append(sum(share(y, None), S.Zero))
        # Seen in the mirror a primitive has the same sign.
        return total + (parts[0] - parts[1])


class _Point:
    """lam as a symbol, and the local functions there."""

    errors = False

    def __init__(self, arithmetic: Any, known: dict[Any, Any]) -> None:
        self.arithmetic, self.known = arithmetic, known
        self.third = LAM ** Rational(1, 3)


def airy_functions(emitted: bool = False) -> AiryProducts:
    """The products of Airy functions of Z, as they are; `emitted`: scaled."""
    if emitted:
        return AiryProducts(*(f(Z) for f in LOCAL[:5]))
    ai, bi = sympy.airyai(Z), sympy.airybi(Z)
    ai1, bi1 = sympy.airyaiprime(Z), sympy.airybiprime(Z)
    return AiryProducts(ai**2 + bi**2, ai * ai1 + bi * bi1, ai1**2 + bi1**2, bi, bi1)


def gaussian_functions(
    x: Expr, barrier: bool = True, emitted: bool = False
) -> tuple[Expr, Expr, Expr]:
    """sigma, D and lam times the integral of D, or of sigma, at x = |t| (lam/2)^(1/2)."""
    c: Any = Expressions()
    if emitted:
        shade, dawson, *areas = (f(x) for f in LOCAL[5:])
        return gaussians(c, LAM, shade, dawson, areas[0] if barrier else areas[1])
    area = x**2 * sympy.hyper([1, 1], [Rational(3, 2), 2], -(x**2))
    if not barrier:
        y = Symbol("y")
        area = sympy.sqrt(sympy.pi) * sympy.Integral(sympy.exp(y**2) * sympy.erfc(y), (y, 0, x))
    dawson = sympy.sqrt(sympy.pi) / 2 * sympy.exp(-(x**2)) * sympy.erfi(x)
    return gaussians(c, LAM, sympy.exp(x**2) * sympy.erfc(x), dawson, area)


def _leading(drift: Drift, case: Case) -> float:
    """The sign of A's leading coefficient, that of the case's example with parameters free."""
    known = drift.bind(**{n: case.example.get(n, 1) for n in drift.free}).exact_coefficients()
    return float(known[-1]) if known else 1.0


def place_of(drift: Drift, case: Case, start: Fraction) -> Place:
    """The place of the pair; a complex one of free parameters is taken to be right of the start."""
    if case.kinds:
        return Place(1 if case.before == 0 else -1, 1)
    if drift.free:
        return Place(1, 1)
    found = complex_pair(drift, [float(x) for x in drift.exact_coefficients() or ()])
    if found is None:
        raise InputError(f"{drift!r} has no pair of zeros over the layer, real or complex.")
    side = 1 if found[0] > start else -1
    return Place(side, 1 if side * found[1] > 0 else -1)


def complex_pair(drift: Drift, coefficients: Sequence[float]) -> tuple[float, float] | None:
    """The middle of the one complex pair of A's zeros over the layer and A there, if there is one.

    InputError: there are more.
    """
    roots = [z for z in float_zeros(coefficients) if z.imag > 0 and abs(z.real) < 1]
    if len(roots) > 1:
        raise InputError(
            f"{drift!r} has {len(roots)} complex pairs of zeros over the layer; the uniform "
            "formula is that of one."
        )
    return (roots[0].real, poly(coefficients, roots[0].real)) if roots else None
