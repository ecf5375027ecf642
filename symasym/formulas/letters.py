"""Local expansions of a drift, and T, C and P, in SymPy's expressions with a symbol per series.

`Letters` has the ring's functions for `symasym.series`, `SymbolicDrift` is a drift in one case, and
`Terms` the arithmetic for `symasym.expansions.weak`. Critical points are u1, u2, ... from left
to right; heights V(u1), V(-1), V(1) are relative to V(start). The symbols are defined one by
another: sums by series, these by V's derivatives, these by the parameters and u_k, and u_k by
A(u_k) = 0, or in closed form if A has degree 1 or 2. A number or a single parameter needs none.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

import sympy
from sympy import QQ, Expr, Rational, S, Symbol
from sympy.core.function import AppliedUndef

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.drift.expressions import antiderivative
from symasym.emit.expansions import expanded
from symasym.formulas.cases import Case, U
from symasym.series import Series, by_parts, finite_parts_in_s, pole_sums, slow

_Known = dict[Symbol, Expr]
KAPPA, R, LAM, X = sympy.symbols("kappa r lam x", positive=True)
#: lam and x = 1/lam as functions of kappa.
IN_KAPPA = {LAM: 2 / KAPPA**2, X: KAPPA**2 / 2}


class FinitePart(sympy.Function):  # type: ignore[misc]
    """FinitePart(h, u, a, b): Hadamard's finite part of the integral of h over u from a to b."""

    nargs = 4

    def _latex(self, printer: Any) -> str:
        h, u, a, b = (printer._print(x) for x in self.args)
        return rf"\mathrm{{f.p.}}\!\int_{{{a}}}^{{{b}}} {h}\,d{u}"


class Letters:
    """The ring of SymPy's expressions, with the functions that `symasym.series` needs."""

    two, euler, log = S(2), sympy.EulerGamma, staticmethod(sympy.log)
    ratio = staticmethod(Rational)
    gamma = staticmethod(lambda n: sympy.gamma(Rational(n, 2)))
    root = staticmethod(lambda x, n: x ** Rational(n, 2))

    @staticmethod
    def generic(c: list[Any]) -> tuple[Series, Callable[[Any], Expr]]:
        """The series 1 + c_1 t + ... in polynomials over symbols for the c, and the way back."""
        polynomials, *symbols = sympy.ring([f"c{k}" for k in range(len(c))] or "c", QQ)
        series, put = Series([polynomials.one, *symbols[: len(c)]]), [*c] or [S.Zero]
        return series, lambda p: p.as_expr(*put) if hasattr(p, "as_expr") else S(p)

    @staticmethod
    def log_ratio(high: Expr, low: Expr, real: bool) -> Expr:
        """The finite part of log(high/low), in which the logarithm of 0 counts as 0."""
        ratio = (high if high != 0 else S.One) / (low if low != 0 else S.One)
        return sympy.log(sympy.Abs(ratio) if real else ratio)


class SymbolicDrift:
    """A drift in one case, with parameters that may be free, as `weak.points_of` needs it.

    `values` are the definitions of the symbols, `equations` maps critical points without a closed
    form to A there, which is 0, `primitive` is an antiderivative of A, if known, `slope` equals A'
    at zeros of A, `kinds` are the wells and barriers, `powers` the weights' exponents of sigma.
    """

    pair, layered = False, True
    primitive: Expr | None = None
    sigma, powers = S.One, list[Expr]()

    def __init__(self, drift: Drift, case: Case, start: Fraction) -> None:
        self.A, self.case, self.start = drift.expression(), case, Rational(str(start))
        self.values, self.equations = _Known(), _Known()
        self.zeros = [Symbol(f"u{k}", real=True) for k in range(1, len(case.kinds) + 1)]
        self.kinds = dict(zip(self.zeros, case.kinds, strict=True))
        self.kinds |= {self.start: case.at_start} if case.at_start else {}
        self.outer, self.slope = list[Symbol](), sympy.diff(self.A, U)
        self._read(drift)

    def _read(self, drift: Drift) -> None:
        self.poly, case = self.A.as_poly(U), self.case
        if self.poly is not None:
            self.primitive = sympy.integrate(self.A, U)
            self._solve(self.poly)
        else:
            self.equations = {u: self.A.subs(U, u) for u in self.zeros}
        self.ends = {side: self.named(f"phi({side})", self.at(S(side))) for side in (-1, 1)}
        row = [(-S.One, "kink"), *zip(self.zeros, case.kinds, strict=True), (S.One, "kink")]
        own = self.start, f"start={case.at_start}" if case.at_start else "start"
        if abs(self.start) == 1:
            row[0 if self.start < 0 else -1] = own
        else:
            row.insert(case.before + 1, own)
        self.places = [(-R, "end"), *row, (R, "end")]

    def at(self, u: Expr) -> Expr:
        """A(u)."""
        return sympy.expand(self.A.subs(U, u))

    def _solve(self, poly: Any) -> None:
        """The zeros of a polynomial A, or of A/(u - start) if the start is one of its zeros."""
        case, inside = self.case, len(self.zeros)
        poly = poly.quo(sympy.Poly(U - self.start, U)) if case.at_start else poly
        more = range(inside + 1, max(poly.degree(), 0) + 1)
        self.outer = [Symbol(f"u{k}", **{"real": True} if len(more) == 1 else {}) for k in more]
        every, c = [*self.zeros, *self.outer], poly.all_coeffs()[::-1]
        if poly.degree() == 2:
            # A' is ±root there, multiplied by u - start if the start is a zero.
            before = case.before if case.at_start else 0
            signs = [(-1) ** ((kind == "well") + (k < before)) for k, kind in enumerate(case.kinds)]
            signs += [sign for sign in (1, -1) if sign not in signs]
            for u, sign in zip(every, signs, strict=True):
                root = sign * sympy.sqrt(c[1] ** 2 - 4 * c[0] * c[2])
                self.values[u] = (-c[1] + root) / (2 * c[2])
        elif poly.degree() == 1:
            self.values[every[0]] = sympy.cancel(-c[0] / c[1])
        else:
            self.equations = {u: self.A.subs(U, u) for u in every}

    def named(self, name: str, value: Expr, **signs: bool) -> Expr:
        """The symbol `name` for a value, or the value if it is a number or a single parameter."""
        symbol = Symbol(name, **(signs or {"real": True}))
        if symbol not in self.values and not value.has(AppliedUndef):  # not for Drift.general()
            if value.is_polynomial() and not value.has(sympy.Integral):
                value = sympy.factor_terms(sympy.expand(value))
            if value.is_Rational or not signs and (value.is_Symbol or (-value).is_Symbol):
                return value
            self.values[symbol] = value
        return symbol

    def derivative(self, j: int, u: Expr) -> Expr:
        """V^(j)(u) at a point of the layer."""
        signs = {"complex": True} if u.is_real is None else {}
        value = sympy.diff(self.A, U, j - 1)
        if j == 2 and u in self.kinds:
            value = self.slope
            signs = {"negative" if self.kinds[u] == "barrier" else "positive": True}
        order = "'" * j if j < 4 else f"^({j})"
        return self.named(f"V{order}({u})", -value.subs(U, u), **signs)

    def taylor(self, u: Expr, count: int) -> list[Expr]:
        """The Taylor coefficients -V^(j+1)(u)/j! of phi at a point of the layer."""
        zero = u in self.kinds or u in self.outer
        first = S.Zero if zero else self.ends.get(u) or -self.derivative(1, u)
        rest = (-self.derivative(j + 1, u) / sympy.factorial(j) for j in range(1, count))
        return [first, *rest]

    def around(self, u: Expr, count: int) -> tuple[list[Expr], list[Any]]:
        """The Taylor coefficients of phi and, if sigma is not 1, of both weights."""
        orders = [(j, sympy.factorial(j)) for j in range(1, count)]
        here = self.named(f"sigma({u})", self.sigma.subs(U, u), positive=True)
        rows = [
            [here**p, *(sympy.diff(self.sigma**p, U, j).subs(U, u) / n for j, n in orders)]
            for p in self.powers
        ]
        return self.taylor(u, count), rows

    def sides(self, u: Expr, count: int) -> tuple[Any, Any]:
        """The result of `around` on the left and on the right of u; None outside the interval."""
        side = {-R: -1, R: 1}.get(u) or (int(u) if abs(u) == 1 else 0)
        beyond: Any = ([self.ends[side], *[S.Zero] * (count - 1)], []) if side else None
        if u in (-R, R):
            return (None, beyond) if side < 0 else (beyond, None)
        inside = self.around(u, count)
        return (inside if side >= 0 else beyond), (inside if side <= 0 else beyond)

    def height(self, u: Expr) -> Expr:
        """V(u) - V(start)."""
        if u == self.start:
            return S.Zero
        if u in (-R, R):
            side = S.One if u == R else -S.One
            return self.height(side) - side * self.ends[side] * (R - 1)
        value = -sympy.Integral(self.A, (U, self.start, u))
        if self.primitive is not None:
            value = self.primitive.subs(U, self.start) - self.primitive.subs(U, u)
        return self.named(f"V({u})", value)

    def regular(self, count: int) -> list[list[Expr]]:
        """The finite parts of int h_k du, k = 1 to count, left and right of the start."""
        found, more = [], [S.Zero] * count
        if self.case.at_start:
            more = finite_parts_in_s(self.taylor(self.start, 2 * count + 1), count, Letters)
        for side, mark, lo, hi in ((-1, "-", -S.One, self.start), (1, "+", self.start, S.One)):
            row = [S.Zero] * count if lo == hi else self._inside(mark, lo, hi, count)
            row[0] += (R - 1) / self.ends[side]
            found.append([a + side * b for a, b in zip(row, more, strict=True)])
        return found

    def _inside(self, mark: str, lo: Expr, hi: Expr, count: int) -> list[Expr]:
        """The finite parts over [lo, hi] in the layer; for even k only end-point terms remain."""
        if not self.A.has(U):
            values = [(hi - lo) / self.A, *[S.Zero] * (count - 1)]
        elif self.poly is not None and self.poly.is_sqf:
            real = [*self.zeros, *[self.start] * bool(self.case.at_start)]
            poles = [(u, self.taylor(u, 2 * count + 1), u in real) for u in (*real, *self.outer)]
            values = pole_sums(poles, lo, hi, count, Letters)
        else:
            phi = [sympy.diff(self.A, U, j) / sympy.factorial(j) for j in range(count)]
            values = [FinitePart(h, U, lo, hi) for h in slow(phi, count, Letters)]
        if not self.case.at_start:
            ends = [[slow(self.taylor(u, count), count, Letters)] * 2 for u in (lo, hi)]
            values[1::2] = by_parts(ends, lambda m, n: S.Zero, count)[1::2]
        return [self.named(f"R{k}{mark}", value) for k, value in enumerate(values, 1)]


class Pair(SymbolicDrift):
    """One well and one barrier: of an unspecified drift, or of one without a layer or with noise
    sigma(u); here A is phi/sigma^2.

    For a bound polynomial phi they are the adjacent zeros, in the case's order, that include the
    first zero in the direction of the drift at the start; `numbers` has those that are no radicals.
    """

    pair = True
    numbers = _Known()

    def _read(self, drift: Drift) -> None:
        model, phi, case = drift.model, self.A, self.case
        self.layered, poly = model.layered, phi.as_poly(U)
        self.sigma = model.noise.with_values(drift.values) if model.noise else S.One
        power = 2 * Rational(*model.alpha.as_integer_ratio())
        self.powers = [-power, power - 2] if model.noise else []
        self.A, self.slope = phi / self.sigma**2, self.slope / self.sigma**2
        self.places = [*zip(self.zeros, case.kinds, strict=True)]
        if poly is not None and self.A.is_rational_function(U):
            self.primitive = antiderivative(self.A, U)
        found: tuple[Expr, ...] = tuple(self.zeros)
        if poly is not None and not poly.free_symbols_in_domain:
            found = self._next(
                phi, [u for u in poly.real_roots() if not self.layered or abs(u) < 1]
            )
            if not any(u.has(sympy.CRootOf) for u in found):
                self.values = dict(zip(self.zeros, found, strict=False))
            else:
                self.numbers = {s: u.n(50) for s, u in zip(self.zeros, found, strict=True)}
        elif poly is not None and poly.degree() == 2:
            rising = poly.LC().is_negative if case.kinds[0] == "well" else poly.LC().is_positive
            found = () if rising else found
            self._solve(poly)
        elif poly is not None and poly.degree() == 3:
            self._solve_cubic(poly)
        if not found:
            raise InputError(
                f"{drift!r} does not lead from {self.start} to a well with an adjacent barrier, as "
                f"in the case '{case}'; give another start, or no case."
            )
        if not self.values:
            self.equations = {u: phi.subs(U, u) for u in self.zeros}

    def _solve_cubic(self, poly: Any) -> None:
        """The zeros of (u - p) q(u) with p and the one beside it in the case's order; q is even or
        has numbers for zeros, and p is a number if there is noise: others take SymPy minutes."""
        linear = [f for f, _ in poly.factor_list()[1] if f.degree() == 1]
        middle = [f for f in linear if f.as_expr().free_symbols != {U}] or linear
        if len(middle) == 1 and len(poly.free_symbols_in_domain) <= 2:
            p = sympy.cancel(-middle[0].nth(0) / middle[0].nth(1))
            c2, c1, c0 = poly.quo(sympy.Poly(U - p, U)).all_coeffs()
            if (c1 / c2).free_symbols or (self.powers and p.free_symbols):
                return
            # phi' = ±root (u - p) at the zeros of q; phi falls for large u if the sign is unknown.
            right = (self.case.kinds[1] == "barrier") == bool(poly.LC().is_positive)
            sign = 1 if (self.case.kinds[right] == "barrier") == right else -1
            u = (-c1 + sign * sympy.sqrt(c1**2 - 4 * c0 * c2)) / (2 * c2)
            self.values = dict(zip(self.zeros, (p, u) if right else (u, p), strict=True))

    def _next(self, phi: Expr, roots: list[Expr]) -> tuple[Expr, ...]:
        """The well and the barrier among the real zeros of phi, a polynomial with numbers."""
        slope = sympy.diff(phi, U)
        kinds = ["barrier" if slope.subs(U, u) > 0 else "well" for u in roots]
        left, right = [u for u in roots if u <= self.start], [u for u in roots if u > self.start]
        downhill = right[:1] if phi.subs(U, self.start) > 0 else left[-1:]
        pairs = zip(itertools.pairwise(roots), itertools.pairwise(kinds), strict=True)
        met = ((us, words) for us, words in pairs if words == self.case.kinds)
        return next((us for us, _ in met if downhill and downhill[0] in us), ())


def put_in(e: Any, known: Mapping[Symbol, Expr]) -> Any:
    """The expression after repeated substitution of the definitions of its symbols."""
    while e.free_symbols & known.keys():
        e = e.xreplace(dict(known))
    return e


def exponentials(e: Expr) -> dict[Expr, Expr]:
    """The coefficients c of the terms c e^(lam h) of a sum, by h."""
    found: dict[Expr, Expr] = {}
    for term in sympy.Add.make_args(e):
        factors = sympy.Mul.make_args(term)
        h = expanded(sum((f.args[0] for f in factors if isinstance(f, sympy.exp)), S.Zero) / LAM)
        c = sympy.Mul(*(f for f in factors if not isinstance(f, sympy.exp)))
        found[h] = found.get(h, S.Zero) + c
    return found


class exprel(sympy.Function):  # type: ignore[misc]
    """(e^x - 1)/x for n = 1, (e^x - 1 - x)/x^2 for n = 2."""

    is_positive = True

    @classmethod
    def eval(cls, x: Expr, n: Expr) -> Expr | None:
        return 1 / n if x.is_zero else None


def written_out(e: Expr) -> Expr:
    """The expression with `exprel` replaced by its definition."""
    return e.replace(exprel, lambda x, n: (sympy.exp(x) - 1 - (n - 1) * x) / x**n)


class Terms:
    """The arithmetic of `symasym.expansions` with a symbol for each series and each sum.

    `known` has their definitions, `rows` for each series a factor and the coefficients of x^n.
    """

    number = staticmethod(sympy.sympify)
    exp = staticmethod(lambda growth: sympy.exp(growth * LAM))
    exprel = staticmethod(lambda growth, n: exprel(growth * LAM, n))
    total = staticmethod(lambda row: sympy.Add(*(c * LAM**k for k, c in enumerate(row))))

    def __init__(self, start: Expr) -> None:
        self.lam, self.log_lam, self.start = LAM, sympy.log(LAM), start
        self.rows: dict[Symbol, tuple[Expr, list[Expr]]] = {}
        self.known: dict[Symbol, Expr] = {}

    def named(self, name: str, value: Any) -> Expr:
        """A symbol for a sum, except that the total S is written as L + R."""
        left, right, symbol = sympy.symbols(["L", "R", name], positive=True)
        if name == "S":
            return left + right
        row = exponentials(sympy.sympify(value)).items()
        self.known[symbol] = sum((c * sympy.exp(LAM * sympy.factor_terms(h)) for h, c in row), S(0))
        return symbol

    def term(self, letter: str, point: Any, height: Any, halves: int, row: Iterable[Any]) -> Any:
        """x^(halves/2) e^(lam height) sum row_n x^n, with a symbol for a series of two or more."""
        symbol = Symbol(self._name(letter, point), real=True)
        if symbol not in self.rows:
            c = [expanded(sympy.sympify(a)) for a in row]
            first = next((n for n, a in enumerate(c) if a != 0), len(c))
            front, c = X ** (Rational(halves, 2) + first), c[first:]
            if not any(c[1:]):
                return front * c[0] * sympy.exp(LAM * height) if c else 0
            if c[0].is_Mul and halves == 1:
                # The factor of a Gaussian integral is taken out of the series.
                front, c = front * c[0], [sympy.expand(a / c[0]) for a in c]
            self.rows[symbol] = front, c
            self.known[symbol] = front * sympy.Add(*(a * X**n for n, a in enumerate(c)))
        return symbol * sympy.exp(LAM * height)

    def _name(self, letter: str, point: Any) -> str:
        """A name such as B2 for a barrier, E+ for a kink, E0- left of the start, M+ right of it."""
        if letter[0] == "M":
            return letter
        places = {-S.One: "-", S.One: "+", self.start: "0"}
        place = places.get(point.u) or str(point.u).removeprefix("u")
        return letter[0] + place + {"l": "-", "r": "+"}.get(letter[1:], "")
