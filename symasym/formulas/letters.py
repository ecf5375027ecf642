"""T, C and P over SymPy: a symbol for everything that depends on the drift, and what it stands for.

`Letters` are the functions of a ring that `symasym.series.local` asks for, `Field` is a drift in
one case, `Terms` gives each series of `symasym.expansions.weak` a symbol. Critical points are u1,
u2, ..., left to right, heights V(u1), V(-1), V(1) above V(start). What the symbols stand for is a
chain of definitions: sums, series in V's derivatives, these in the parameters and u_k, and u_k by
the equation A(u_k) = 0, or solved for where A is of degree 1 or 2. A number, or a parameter alone,
stands for itself, and what is 0 is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import sympy
from sympy import QQ, Expr, Rational, S, Symbol
from sympy.polys.rings import ring as polynomial_ring

from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.formulas.cases import Case
from symasym.series.local import by_parts, finite_parts_in_s, pole_sums, slow
from symasym.series.power_series import Series

__all__ = [
    "KAPPA",
    "LAM",
    "R",
    "U",
    "X",
    "Field",
    "FinitePart",
    "Letters",
    "Row",
    "Rule",
    "Terms",
    "expanded",
    "joined",
]

#: The scaled position.
U = Symbol("u", real=True)
KAPPA, R, LAM, X = sympy.symbols("kappa r lam x", positive=True)
_BEYOND = Symbol("r - 1", positive=True)


class FinitePart(sympy.Function):  # type: ignore[misc]
    """Hadamard's finite part of the integral of h over u from a to b: FinitePart(h, u, a, b)."""

    nargs = 4

    def _latex(self, printer: Any, exp: str = "") -> str:
        h, u, a, b = (printer._print(x) for x in self.args)
        text = rf"\mathrm{{f.p.}}\!\int_{{{a}}}^{{{b}}} {h}\,d{u}"
        return rf"\left({text}\right)^{{{exp}}}" if exp else text


class Letters:
    """Functions of SymPy's expressions (`symasym.series.local`)."""

    two, euler, log = S(2), sympy.EulerGamma, staticmethod(sympy.log)
    ratio = staticmethod(Rational)

    @staticmethod
    def gamma(n: int) -> Expr:
        """Gamma(n/2)."""
        return sympy.gamma(Rational(n, 2))

    @staticmethod
    def root(x: Expr, n: int) -> Expr:
        """x^(n/2)."""
        return x ** Rational(n, 2)

    @staticmethod
    def generic(c: list[Any]) -> tuple[Series, Callable[[Any], Expr]]:
        """The series over polynomials in symbols for those of the c that are not 0."""
        step()
        values = [sympy.sympify(x) for x in c]
        names = [k for k, x in enumerate(values) if x != 0]
        polynomials, *letters = polynomial_ring([f"c{k}" for k in names] or ["c"], QQ)
        known = dict(zip(names, letters, strict=False))

        def back(p: Any) -> Expr:
            """With the values put in."""
            if not hasattr(p, "as_expr"):
                return sympy.sympify(p)
            return p.as_expr(*([values[k] for k in names] or [S.Zero]))

        zero = polynomials.zero
        return Series([polynomials.one, *(known.get(k, zero) for k in range(len(c)))]), back

    @staticmethod
    def log_ratio(high: Expr, low: Expr, real: bool) -> Expr:
        """log(high/low); of what is 0 nothing, the finite part."""
        ratio = (high if high != 0 else S.One) / (low if low != 0 else S.One)
        return sympy.log(sympy.Abs(ratio) if real else ratio)


class Field:
    """A drift whose parameters may be free, in one case.

    Attributes
    ----------
    places : list
        The critical points left to right, as `symasym.expansions.weak.points_of` asks for.
    zeros, outer : list of Symbol
        The zeros of A in the layer but for a start on one, and those of a polynomial beyond.
    values : dict
        What each symbol stands for.
    equations : dict
        For critical points without a closed form: A there, which is 0.
    integrals : dict
        The regular part's finite parts, as integrals.
    tex : dict
        The symbols' LaTeX.
    """

    def __init__(self, drift: Drift, case: Case, start: Fraction) -> None:
        self.general, self.A, self.case = drift == Drift.general(), drift.expression(), case
        self.start = Rational(start.numerator, start.denominator)
        self.poly = None if self.general else self.A.as_poly(U)
        self.values: dict[Symbol, Expr] = {}
        self.equations: dict[Symbol, Expr] = {}
        self.integrals: dict[Symbol, Expr] = {}
        self.tex: dict[Symbol, str] = {LAM: r"\lambda"}
        self._derivatives = [sympy.Function("phi")(U) if self.general else self.A]
        self.zeros = [self._point(k + 1, True) for k in range(len(case.kinds))]
        self.outer: list[Symbol] = []
        if self.poly is not None:
            self._solve(self.poly)
        elif not self.general:
            self.equations = {u: self.A.subs(U, u) for u in self.zeros}
        self.slopes = {side: self._slope(side) for side in (-1, 1)}
        inside: list[tuple[Expr, str]] = list(zip(self.zeros, case.kinds, strict=True))
        own = (self.start, "start" + f"={case.at_start}" * bool(case.at_start))
        beyond = [(-R, "end"), (-S.One, "kink"), (S.One, "kink"), (R, "end")]
        self.places: list[tuple[Expr, str]] = [*beyond[:2], *inside, *beyond[2:]]
        if abs(self.start) == 1:
            self.places[[u for u, _ in self.places].index(self.start)] = own
        else:
            at = 2 + case.before if abs(self.start) < 1 else 1 if self.start < 0 else -1
            self.places.insert(at, own)

    # -- A and its zeros -----------------------------------------------------------------------

    def _point(self, k: int, real: bool) -> Symbol:
        u = Symbol(f"u{k}", real=True) if real else Symbol(f"u{k}")
        self.tex[u] = f"u_{{{k}}}"
        return u

    def _solve(self, poly: Any) -> None:
        """The zeros of a polynomial; those beside a start on one are zeros of A/(u - start)."""
        case, inside = self.case, len(self.zeros)
        if poly.degree() < inside + bool(case.at_start):
            raise InputError(
                f"case is {str(case)!r} with {inside + bool(case.at_start)} zeros, and A = "
                f"{self.A} has degree {poly.degree()}; give a case with fewer."
            )
        if case.at_start and sympy.simplify(at := self.A.subs(U, self.start)) != 0:
            raise InputError(
                f"case is '{case}', and A at the start {self.start} is {at}; bind what makes it 0, "
                "or give a case without '='."
            )
        if case.at_start:
            poly = poly.quo(sympy.Poly(U - self.start, U))
        more = poly.degree() - inside
        self.outer = [self._point(inside + k + 1, more == 1) for k in range(more)]
        every, c = [*self.zeros, *self.outer], poly.all_coeffs()[::-1]
        if poly.degree() == 1:
            self.values[every[0]] = -c[0] / c[1]
        elif poly.degree() == 2:
            root, free = sympy.sqrt(c[1] ** 2 - 4 * c[0] * c[2]), [1, -1]
            for k, kind in enumerate(case.kinds):
                # A has the slope ±root there, times u - start with a start on a zero.
                sign = 1 if (kind == "barrier") != (bool(case.at_start) and k < case.before) else -1
                free.remove(sign)
                self.values[every[k]] = (-c[1] + sign * root) / (2 * c[2])
            for u, sign in zip(self.outer, free, strict=True):
                self.values[u] = (-c[1] + sign * root) / (2 * c[2])
        else:
            self.equations = {u: self.A.subs(U, u) for u in every}

    def _named(self, name: str, tex: str, value: Expr | None, **signs: bool) -> Expr:
        """A symbol, or the value itself where that is a number or a parameter alone."""
        symbol = Symbol(name, **(signs or {"real": True}))
        if value is not None and symbol not in self.values:
            value = value if value.has(sympy.Integral) else _shown(value)
            if value.is_Rational or not signs and (value.is_Symbol or (-value).is_Symbol):
                return value
            self.values[symbol] = value
        self.tex[symbol] = tex
        return symbol

    def _name(self, u: Expr) -> tuple[str, str]:
        return str(u), self.tex.get(u, str(u))

    def _slope(self, side: int) -> Expr:
        """phi beyond the layer."""
        value = None if self.general else self.A.subs(U, side)
        return self._named(f"phi({side})", "a^+" if side > 0 else "a^-", value)

    def derivative(self, j: int, u: Expr) -> Expr:
        """V^(j)(u) at a point of the layer."""
        while len(self._derivatives) < j:
            self._derivatives.append(sympy.diff(self._derivatives[-1], U))
        signs = {"complex": True} if u.is_real is None else {}
        if j == 2 and (kind := self.kind(u)):
            signs = {"negative" if kind == "barrier" else "positive": True}
        name, tex = self._name(u)
        order, power = ("'" * j, "'" * j) if j < 4 else (f"^({j})", f"^{{({j})}}")
        value = None if self.general else -self._derivatives[j - 1].subs(U, u)
        return self._named(f"V{order}({name})", f"V{power}({tex})", value, **signs)

    def kind(self, u: Expr) -> str:
        """``"well"`` or ``"barrier"`` at a zero in the layer."""
        if u in self.zeros:
            return self.case.kinds[self.zeros.index(u)]
        return self.case.at_start if u == self.start else ""

    def taylor(self, u: Expr, count: int) -> list[Expr]:
        """phi's Taylor coefficients at a point of the layer, -V^(j+1)(u)/j!."""
        first: Any = S.Zero if self.kind(u) or u in self.outer else None
        if first is None:
            first = self.slopes[int(u)] if abs(u) == 1 else -self.derivative(1, u)
        rest = (-self.derivative(j + 1, u) / sympy.factorial(j) for j in range(1, count))
        return [first, *rest]

    def sides(self, u: Expr, kind: str, count: int) -> tuple[list[Expr], list[Expr]]:
        """phi's Taylor coefficients left and right of u, empty beyond an end."""
        straight = {s: [a, *[S.Zero] * (count - 1)] for s, a in self.slopes.items()}
        side = {-R: -1, R: 1}.get(u) or (int(sympy.sign(u)) if abs(u) >= 1 else 0)
        beyond = straight.get(side, [])
        if kind == "end":
            return ([], beyond) if side < 0 else (beyond, [])
        if abs(u) > 1:
            return beyond, beyond
        inside = self.taylor(u, count)
        return (inside if side >= 0 else beyond), (inside if side <= 0 else beyond)

    # -- V and the finite parts ----------------------------------------------------------------

    def height(self, u: Expr) -> Expr:
        """V(u) - V(start)."""
        if u == self.start:
            return S.Zero
        if u in (-R, R):
            side = 1 if u == R else -1
            from_ = max(S.One, side * self.start)
            edge = S.Zero if side * self.start >= 1 else self.height(S(side))
            return edge - side * self.slopes[side] * (R - from_)
        near = min(max(self.start, -S.One), S.One)
        value, outside = None, S.Zero
        if near != self.start:
            outside = self.slopes[int(near)] * (self.start - near)
            if u == near:
                return outside
        if not self.general:
            if self.poly is not None:
                primitive = sympy.integrate(self.A, U)
                value = primitive.subs(U, near) - primitive.subs(U, u) + outside
            else:
                value = outside - sympy.Integral(self.A, (U, near, u))
        name, tex = self._name(u)
        return self._named(f"V({name})", f"V({tex})", value)

    def regular(self, count: int) -> list[list[Expr]]:
        """The finite parts of int h_k left and right of the start, k = 1 to count."""
        near = min(max(self.start, -S.One), S.One)
        found = []
        for side, lo, hi in (("-", -S.One, near), ("+", near, S.One)):
            row = [S.Zero] * count
            if lo != hi:
                row = self._inside(side, lo, hi, count)
            sign = 1 if side == "+" else -1
            beyond = {sign: R - max(sign * self.start, S.One), -sign: -sign * self.start - 1}
            for end, length in beyond.items():
                if end == sign or length > 0:
                    row[0] += length / self.slopes[end]
            found.append(row)
        if self.case.at_start:
            more = finite_parts_in_s(self.taylor(self.start, 2 * count + 1), count, Letters)
            for k, change in enumerate(more):
                found[0][k], found[1][k] = found[0][k] - change, found[1][k] + change
        return found

    def _inside(self, side: str, lo: Expr, hi: Expr, count: int) -> list[Expr]:
        """Those of a part of the layer, as symbols."""
        if self.general:
            values: list[Any] = [None] * count
        elif self.poly is not None and self.poly.degree() == 0:
            values = [(hi - lo) / self.A, *[S.Zero] * (count - 1)]
        elif self.poly is not None and self.poly.is_sqf:
            known = [(u, u not in self.outer) for u in (*self.zeros, *self.outer)]
            known += [(self.start, True)] * bool(self.case.at_start)
            poles = [(u, self.taylor(u, 2 * count + 1), real) for u, real in known]
            values = pole_sums(poles, lo, hi, count, Letters)
        else:
            phi = [
                self.A,
                *(sympy.diff(self.A, U, j) / sympy.factorial(j) for j in range(1, count)),
            ]
            values = [FinitePart(h, U, lo, hi) for h in slow(phi, count, Letters)]
        closed = values
        if not (self.case.at_start or self.general):
            # Of even k nothing but the ends is left.
            ends = [slow(self.taylor(u, count), count, Letters) for u in (lo, hi)]
            closed = by_parts(ends, lambda m: S.Zero, count)
        row = []
        for k in range(count):
            by_ends = k % 2 and closed is not values
            name = f"R{k + 1}{side}"
            symbol = self._named(
                name, f"R_{{{k + 1}}}^{{{side}}}", (closed if by_ends else values)[k]
            )
            if symbol in self.values and not by_ends:
                h = Symbol(f"h{k + 1}")
                self.tex[h] = f"h_{{{k + 1}}}"
                self.integrals[symbol] = FinitePart(h, U, lo, hi)
            row.append(symbol)
        return row


def _shown(value: Expr) -> Expr:
    return sympy.expand(value) if value.is_polynomial() else value


def joined(e: Expr) -> Expr:
    """The expression with each product's exponentials as one."""

    def one(product: Expr) -> Expr:
        heights = [a.args[0] for a in product.args if isinstance(a, sympy.exp)]
        rest = [a for a in product.args if not isinstance(a, sympy.exp)]
        if len(heights) < 2:
            return product
        return sympy.Mul(*rest, sympy.exp(sympy.factor_terms(expanded(sympy.Add(*heights)))))

    return e.replace(lambda x: x.is_Mul, one)


def expanded(e: Expr) -> Expr:
    """The expression expanded, r - 1 being left together."""
    return sympy.expand(e.xreplace({R: 1 + _BEYOND})).xreplace({_BEYOND: R - 1})


class Row(NamedTuple):
    """front (c_0 + c_1 x + c_2 x^2 + ...), x = kappa^2/2."""

    front: Expr
    c: tuple[Expr, ...]

    @property
    def expression(self) -> Expr:
        """The sum."""
        return self.front * sympy.Add(*(c * X**n for n, c in enumerate(self.c)))

    @property
    def nested(self) -> Expr:
        """The same by Horner's rule."""
        total = S.Zero
        for c in reversed(self.c):
            total = total * X + c
        return self.front * total


class Rule(NamedTuple):
    """LaTeX lines that say what some symbols are, in other symbols."""

    lines: tuple[str, ...]
    of: tuple[Symbol, ...]


@dataclass
class Terms:
    """The points' terms, each series and each sum of `symasym.expansions.weak` as a symbol."""

    field: Field

    def __post_init__(self) -> None:
        self.lam, self.log_lam = LAM, sympy.log(LAM)
        self.rows: dict[Symbol, Row] = {}
        self.sums: dict[Symbol, Expr] = {}

    def named(self, name: str, value: Any) -> Expr:
        """A symbol for a sum; the sum of L and R is theirs."""
        if name == "S" and len(self.sums) == 2:
            return sympy.Add(*self.sums)
        symbol = Symbol(name, positive=True)
        self.sums[symbol] = joined(sympy.sympify(value))
        self.field.tex[symbol] = {"D-": "D_-", "D+": "D_+"}.get(name, name)
        return symbol

    def term(self, letter: str, point: Any, height: Any, halves: int, row: Iterable[Any]) -> Any:
        """x^(halves/2) e^(lam height) sum row_n x^n, a series of several terms as a symbol."""
        front, c = X ** Rational(halves, 2), [sympy.sympify(a) for a in row]
        exponential = sympy.exp(LAM * height)
        if len(c) < 9:
            c = [expanded(a) for a in c]
        if not any(c):
            return 0
        if not any(c[1:]):
            return front * c[0] * exponential
        name, tex = self._name(letter, point)
        symbol = Symbol(name, real=True)
        if halves == 1 and c[0].is_Mul:
            # A Gaussian and its corrections.
            front, c = front * c[0], [sympy.expand(a / c[0]) for a in c]
        self.rows[symbol], self.field.tex[symbol] = Row(front, tuple(c)), tex
        return symbol * exponential

    def _name(self, letter: str, point: Any) -> tuple[str, str]:
        """Such as B2 of a barrier, E+ of a kink, E0- left of a start, M+ right of it."""
        head, side = letter[0], {"l": "-", "r": "+"}.get(letter[1:], letter[1:].strip("s"))
        if head == "M":
            return letter, f"M_{side}"
        places = {-S.One: "-", S.One: "+", self.field.start: "0"}
        place = places.get(point.u) or str(point.u).removeprefix("u")
        index = f"{{{place}}}" if place.isdigit() else place
        return f"{head}{place}{side}", f"{head}_{index}" + (f"^{side}" if side else "")
