"""Laplace's method for int g(x) e^(lam f(x)) dx over [a, b] as lam grows.

To all powers of 1/lam the integral is the sum of the contributions of the points where f is
largest, inside, at ends and at kinks. With f = f(p) - a t^mu (1 + ...) and g = t^(beta - 1) (g_0 +
...), t the distance from the point p on one side or both, each is

    e^(lam f(p)) sum over k of c_k lam^(-(k + beta)/mu)

(Watson's lemma after Lagrange's reversion: DLMF 2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic
Expansions, 2.4; `symasym.series.local.watson`). On both sides of a smooth maximum the terms with k +
beta - 1 odd cancel. The error at a given lam is the distance to the integral, enclosed by flint.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
import sympy
from flint import arb, fmpq
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import AccuracyError, InputError, RangeError, SymasymError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import (
    Number, Numbers, count, digits, exact, flag, float_text, floats, is_array, is_name, positive,
    sequence, shown,
)  # fmt: skip
from symasym.derivation.printing import tex
from symasym.drift.expressions import parse
from symasym.drift.grammar import functions_inside
from symasym.integrals import borel
from symasym.integrals.enclosure import integral, name_of, number
from symasym.integrals.maxima import Maximum, Piece, cut, highest, with_parameters
from symasym.integrals.terms import Balls, NotAnalytic, Point, exactly, sign_of
from symasym.numbers.balls import precision, to_mpf
from symasym.series.local import watson
from symasym.series.power_series import Series

__all__ = ["Contribution", "LaplaceExpansion", "laplace_integral"]

#: Terms that order="optimal" chooses from, and the most.
_OPTIMAL, _MOST = 48, 200
# Bits at which f is compared with itself at other points; digits of coefficients that aren't exact,
# and terms beyond which irrational constants would swell exact ones.
_BITS, _DIGITS, _EXACT_TERMS, _MOST_FUNCTIONS = 256, 40, 12, 8
# Order up to which f is compared with a constant, and orders lost to factors such as sin(x)/x.
_FLAT, _SPARE = 24, 4
# Terms behind the last one that an estimate looks at.
_NEXT = 3


@dataclass(frozen=True)
class Contribution:
    """e^(lam height) times the sum of coefficients[k] lam^(-exponents[k]), of a maximum or one side.

    Attributes
    ----------
    point, height : Expr or mpf
        The maximum, and f there.
    side : {"both", "left", "right"}
        The side of the maximum that the interval, or the piece, has.
    contact : int
        mu: f - height begins with -a t^mu.
    beta : Expr
        g begins with t^(beta - 1).
    exponents : tuple of Expr
    coefficients : tuple of Expr or mpf
    """

    point: Any
    side: str
    height: Any
    contact: int
    beta: Expr
    exponents: tuple[Expr, ...]
    coefficients: tuple[Any, ...]


def contributions(
    piece: Piece, point: Any, side: str, order: int, ring: Any, conditions: list[str]
) -> list[Contribution]:
    """Those of a maximum, one for each power of g; what was not proved is added to `conditions`."""
    sign, step = (-1 if side == "left" else 1), (2 if side == "both" else 1)
    f, g, x = piece.f, piece.g, piece.x
    try:
        known = Point(x, point, sign, _FLAT + 1, ring).taylor(f)
        contact = next((k for k, c in enumerate(known.c) if k and not ring.zero(c)), None)
        if contact is None:
            raise InputError(
                f"f = {f} is flat at {x} = {point} to order {_FLAT}; give an f whose maximum is "
                "isolated."
            )
        here = Point(x, point, sign, step * order + contact + 1 + _SPARE, ring)
        lead, terms = here.taylor(f), here.terms(g)
    except NotAnalytic as error:
        raise InputError(
            f"Laplace's method takes f with a Taylor series on each side of its maximum, and g a "
            f"sum of powers of the distance times such; but at {x} = {point} {error}"
        ) from None
    scale = -lead[contact]
    falls, proved = sign_of(ring.expression(scale)) if ring.exact else (ring.sign(scale), True)
    if falls != 1 or (side == "both" and contact % 2):
        raise InputError(
            f"f = {f} is not largest at {x} = {point} (the first term after f there is of order "
            f"{contact}, with the coefficient {ring.expression(lead[contact])}); give the point of "
            "a maximum, or symbols with assumptions that decide."
        )
    if not proved:
        conditions.append(f"{sympy.simplify(-ring.expression(scale))} < 0")
    if not terms:
        raise InputError(f"g = {g} vanishes to all orders looked at at {x} = {point}.")
    found = []
    for front, weight in terms:
        beta = front + 1
        if side == "both" and not front.is_Integer:
            raise InputError(
                f"g behaves as a power {front} of {x} - ({point}) at an interior maximum, where it "
                "isn't real on both sides; write it with Abs, or split the integral there."
            )
        above, proved = sign_of(beta)
        if above != 1:
            raise InputError(
                f"g behaves as a power {sympy.simplify(front)} of the distance from {x} = {point}, "
                "where f is largest, so the integral diverges unless the power is above -1; change "
                "g or give its symbols assumptions."
            )
        if not proved:
            conditions.append(f"{beta} > 0")
        first = int(front) % 2 if side == "both" else 0
        ks = range(first, first + step * order, step)
        if len(weight) <= ks[-1]:
            raise AccuracyError(f"g = {g} cancels too many orders at {x} = {point}; simplify g.")
        steep = Series([ring.of(S.One), *(c / lead[contact] for c in lead.c[contact + 1 :])])
        steep, weight = (Series(series.c[: ks[-1] + 1]) for series in (steep, weight))
        power = Fraction(int(beta.p), int(beta.q)) if beta.is_Rational else ring.of(beta)
        reduced = watson(steep, weight, contact, power, first=first, step=step)
        exponents = tuple((k + beta) / contact for k in ks)
        found.append(
            Contribution(
                point, side, ring.expression(lead[0]), contact, beta, exponents,
                tuple(map(_moment(scale, contact, step, ring), reduced, exponents)),
            )
        )  # fmt: skip
    return found


def _moment(scale: Any, contact: int, sides: int, ring: Any) -> Any:
    """d, s -> d sides Gamma(s)/(mu a^s), the moment of t^(mu s - 1) e^(-a t^mu) on the sides."""
    a = ring.expression(scale)

    def times(d: Any, s: Expr) -> Any:
        if ring.exact:
            return ring.expression(d) * (sides * (sympy.gamma(s) / (contact * a**s)))
        return d * sides * number(s).gamma() / (contact * ring.power(a, s))

    return times


@dataclass(frozen=True, repr=False)
class LaplaceExpansion:
    """The expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam.

    Attributes
    ----------
    f, g, x, a, b : Expr
        The integral.
    order : int, "optimal" or "borel"
    dropped : tuple of str
        What is exponentially small and left out.
    conditions : tuple of str
        What was seen to hold at sampled parameters but not proved from their assumptions.
    """

    f: Expr
    g: Expr
    x: Symbol
    a: Expr
    b: Expr
    order: int | str
    dropped: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()
    _pieces: tuple[Piece, ...] = field(default=(), compare=False)
    _tops: tuple[Maximum, ...] = field(default=(), compare=False)
    _others: tuple[Maximum, ...] = field(default=(), compare=False)
    _dps: int | None = field(default=None, compare=False)

    @cached_property
    def _terms(self) -> int:
        return {"optimal": _OPTIMAL, "borel": borel.TERMS}.get(str(self.order)) or int(self.order)

    def _sides(self, others: bool = False) -> list[tuple[Piece, Any, str]]:
        """The pieces in which each maximum is expanded, each with its side."""
        rows: list[tuple[Piece, Any, str]] = []
        for m in self._others if others else self._tops:
            if m.left is m.right and m.left is not None:
                rows.append((m.left, m.point, "both"))
            else:
                both = ((m.left, "left"), (m.right, "right"))
                rows += [(piece, m.point, side) for piece, side in both if piece is not None]
        return rows

    def _expanded(self, ring: Any, terms: int) -> list[Contribution]:
        return [c for s in self._sides() for c in contributions(*s, terms, ring, [])]

    @cached_property
    def contributions(self) -> tuple[Contribution, ...]:
        """One for each maximum, each side of it where the sides differ, and each power of g."""
        if self.parameters or (self._dps is None and self._worth_exact()):
            rows = self._sides()
            return tuple(
                c
                for row in rows
                for c in exactly(lambda ring, row=row: contributions(*row, self._terms, ring, []))
            )
        return self._rounded(self._dps or _DIGITS)

    def _worth_exact(self) -> bool:
        """False where exact coefficients have no closed form, or would fill pages."""
        pieces = [piece for piece, _, _ in self._sides()]
        if any(not isinstance(m.point, Expr) for m in self._tops) or any(map(_is_long, pieces)):
            return False
        if self._terms <= _EXACT_TERMS:
            return True

        def rational(ring: Any) -> bool:
            self._expanded(ring, 1)
            return bool(ring.domain == sympy.QQ)

        return bool(exactly(rational))

    def _in_balls(self, bits: int, terms: int) -> list[Contribution]:
        """The contributions in balls, kept."""
        known: dict[Any, list[Contribution]] = self.__dict__.setdefault("_known", {})
        if (bits, terms) not in known:
            with precision(bits + 6 * terms):
                known[bits, terms] = self._expanded(Balls(), terms)
        return known[bits, terms]

    def _rounded(self, dps: int) -> tuple[Contribution, ...]:
        """The contributions with numbers of `dps` digits."""
        for bits in (int(3.33 * dps) + 64 << k for k in range(6)):
            found = self._in_balls(bits, self._terms)
            values = [v for c in found for v in (c.height, *c.coefficients)]
            if all(v.rel_accuracy_bits() > 3.33 * dps + 8 or v.contains(0) for v in values):
                with precision(bits):
                    return tuple(_rounded(c, dps) for c in found)
        raise AccuracyError(f"dps is {dps}, more digits than the coefficients reach; ask for fewer.")

    @property
    def parameters(self) -> tuple[Symbol, ...]:
        """Free symbols besides x."""
        parts = (self.f, self.g, self.a, self.b)
        return tuple(sorted(set().union(*(e.free_symbols for e in parts)) - {self.x}, key=str))

    @property
    def height(self) -> Any:
        """The largest f, lam times which is the exponent of the leading exponential."""
        return self.contributions[0].height

    @property
    def omitted(self) -> Expr:
        """The power sigma of the first term left out, which is of order lam^(-sigma)."""
        steps = {"both": 2, "left": 1, "right": 1}
        return sympy.Min(
            *(c.exponents[-1] + Rational(steps[c.side], c.contact) for c in self.contributions)
        )

    @property
    def error_kind(self) -> str:
        """``"none"`` while parameters are free, else ``"bound"``."""
        return "none" if self.parameters else "bound"

    def bind(self, /, **values: Number) -> LaplaceExpansion:
        """The expansion with exact numbers for parameters."""
        names, swap = {str(s): s for s in self.parameters}, {}
        for name, value in values.items():
            if name not in names:
                known = ", ".join(names) or "none"
                raise InputError(f"{name} is not a parameter of the integral ({known}).")
            rational = exact(name, value)
            swap[names[name]] = Rational(rational.numerator, rational.denominator)
        f, g, a, b = (e.xreplace(swap) for e in (self.f, self.g, self.a, self.b))
        return laplace_integral(f, g, self.x, a, b, self.order)

    # -- numbers ------------------------------------------------------------------------------

    def evaluate(
        self, lam: Numbers, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum of the terms at `lam`.

        Parameters
        ----------
        lam : number or array_like
            Greater than 0.
        dps : int, optional
            Digits of the sum, as mpf. None: float64.
        log : bool
            Natural logarithm, finite where the value overflows.
        full : bool
            An `Estimate`, whose error is the distance of the sum to the integral: a bound, as the
            integral is enclosed; where it can't be, three times the next three terms, an estimate.

        Returns
        -------
        float, ndarray, mpf or Estimate

        Raises
        ------
        InputError
            While parameters are free, or lam is not above 0.
        RangeError
            If the value does not fit float64 and `log` is False.
        AccuracyError
            For the logarithm of a sum that is not surely positive; if the next terms are as large
            as the sum.
        """
        if self.parameters:
            raise InputError(
                f"parameters have no value: {', '.join(map(str, self.parameters))}; call bind(…) "
                "first."
            )
        log, full = flag("log", log), flag("full", full)
        dps = None if dps is None else digits(dps)
        if not is_array(lam):
            return self._at(positive("lam", exact("lam", lam)), dps, log, full)
        if dps is not None:
            raise InputError(
                f"lam is an array and dps is {dps}; arrays are for float64 (dps=None)."
            )
        values = floats("lam", lam)
        if not (values > 0).all():
            raise InputError(f"lam is {values.min():.6g}; it must be greater than 0.")
        each = [self._at(Fraction(y), None, log, full) for y in values.ravel()]
        if not full:
            return np.array(each).reshape(values.shape)
        value, error = (
            np.array([getattr(e, name) for e in each]).reshape(values.shape)
            for name in ("value", "error")
        )
        kinds: set[ErrorKind] = {e.error_kind for e in each}
        kind: ErrorKind = kinds.pop() if len(kinds) == 1 else "estimate"
        return replace(each[0], value=value, error=error, error_kind=kind)

    def _at(self, lam: Fraction, dps: int | None, log: bool, full: bool) -> Any:
        """The sum at one lam, or an `Estimate` of the integral."""
        wanted = dps or 17
        first = int(3.33 * wanted) + 64 + (borel.BITS if self.order == "borel" else 0)
        for bits in (first << k for k in range(4)):
            with precision(bits):
                total, top, used = self._sum(lam, bits)
                exponent = number(Rational(lam.numerator, lam.denominator)) * top
                if log and not total > 0:
                    value = arb("nan")
                else:
                    value = exponent + total.log() if log else total * exponent.exp()
                if value.rel_accuracy_bits() > 3.33 * wanted + 4:
                    break
        else:
            if log:
                raise AccuracyError(
                    f"the sum at lam = {float_text(lam)} is not surely positive, so its logarithm "
                    "is not known; ask for the value, or for a larger lam."
                )
        with precision(bits):
            kind: ErrorKind = "bound"
            error = arb(0)
            if full:
                error, kind = self._error(lam, total, top, used, bits)
                if log and not error < total:
                    raise AccuracyError(
                        f"the error at lam = {float_text(lam)} is as large as the sum, so that its "
                        "logarithm is not known; ask for the value, or for a larger lam."
                    )
                error = -(-error / total).log1p() if log else error * exponent.exp()
            if dps is None and not log and value != 0:
                size = float((exponent + abs(total).log()).mid())
                if not -708.39 < size < 709.78:
                    raise RangeError(
                        f"the integral's logarithm is {size:.6g}, beyond float64; pass log=True or "
                        "dps=…."
                    )
            middle, radius = to_mpf(value, wanted)
            if dps is None:
                middle, shift = float(middle), value - arb(float(middle))
            else:
                shift = arb(0, 1) * arb(radius)
            if not full:
                return middle
            error = to_mpf((abs(error) + abs(shift)).upper(), 15)
            text = error[0] + error[1]
        return Estimate(
            middle, float(text) * (1 + 2**-50) if dps is None else text * (1 + 1e-15), kind,
            "laplace", max(used), self._named(), self.dropped,
        )  # fmt: skip

    def _sum(self, lam: Fraction, bits: int) -> tuple[Any, Any, list[int]]:
        """The sum over e^(lam top), the largest f, and the number of terms of each contribution."""
        found = self._in_balls(bits, self._terms)
        large = arb(fmpq(lam.numerator, lam.denominator))
        top, total, used = found[0].height, arb(0), []
        for c in found:
            if self.order == "borel":
                part = borel.median_sum(list(c.coefficients), number(c.exponents[0]), large)
                used.append(len(c.coefficients))
            else:
                terms = [y * large ** -number(s) for y, s in zip(c.coefficients, c.exponents, strict=True)]
                n = len(terms)
                if self.order == "optimal":
                    sizes = [arb("inf") if t.contains(0) else abs(t.mid()) for t in terms]
                    n = max(1, min(range(n), key=sizes.__getitem__))
                used.append(n)
                part = sum(terms[:n], arb(0))
            total += part * (large * (c.height - top)).exp()
        return total, top, used

    def _error(
        self, lam: Fraction, total: Any, top: Any, used: list[int], bits: int
    ) -> tuple[Any, ErrorKind]:
        """The distance of the sum to the integral over e^(lam top); or the estimate."""
        stretches = [s for piece in self._pieces for s in piece.stretches]
        enclosed = integral(stretches, lam, top, bits)
        if enclosed.is_finite():
            return abs(total - enclosed), "bound"
        large, size = arb(fmpq(lam.numerator, lam.denominator)), arb(0)
        beyond = zip(self._in_balls(bits, max(used) + _NEXT), used, strict=True)
        for c, n in [*((c, n) for c, n in beyond), *((c, 0) for c in self._elsewhere)]:
            row = zip(c.coefficients[n : n + _NEXT], c.exponents[n : n + _NEXT], strict=True)
            terms = sum((abs(y) * large ** -number(s) for y, s in row), arb(0))
            size += 3 * terms * (large * (c.height - top)).exp()
        if not size < abs(total) / 2:
            raise AccuracyError(
                f"the next terms at lam = {float_text(lam)} are as large as the sum; ask for a "
                "larger lam, or leave full out."
            )
        return size, "estimate"

    @property
    def _elsewhere(self) -> list[Contribution]:
        """First terms of ends and smaller maxima; where f rises from an end those of -f."""
        known = {(piece, str(point)) for piece, point, _ in self._sides()}
        ends = [(p, p.lo, "right") for p in self._pieces] + [(p, p.hi, "left") for p in self._pieces]
        found = []
        for piece, point, side in [*ends, *self._sides(others=True)]:
            if (piece, str(point)) in known or (isinstance(point, Expr) and point.is_infinite):
                continue
            for sign in (1, -1):
                with suppress(InputError, AccuracyError, ValueError):
                    signed = replace(piece, f=sign * piece.f)
                    row = contributions(signed, point, side, _NEXT, Balls(), [])
                    found += [replace(c, height=sign * c.height) for c in row]
                    break
        return found

    def _named(self) -> tuple[str, ...]:
        """A line for each contribution, for `Estimate.terms`."""
        return tuple(
            f"{self.x} = {short(point)} ({side}): {self._terms} terms"
            for _, point, side in self._sides()
        )

    # -- as a formula -------------------------------------------------------------------------

    def __post_init__(self) -> None:
        for name in ("lam", "lambda", "e", "O"):
            self._require_other_names(Symbol(name))

    def _require_other_names(self, own: Expr) -> None:
        """Refuse a parameter that reads as this symbol of the formula, in text or in LaTeX."""
        for s in self.parameters:
            if str(s) == str(own) or tex(s) == tex(own):
                raise InputError(
                    f"the integral has a parameter {s}, which the formula has as a name of its "
                    "own; rename the parameter."
                )

    def expression_in(self, lam: Symbol | str = "lam") -> Expr:
        """The sum as an expression in `lam` (a symbol or a name)."""
        symbol = self._lam(lam)
        parts = []
        for c in self.contributions:
            pairs = zip(c.exponents, c.coefficients, strict=True)
            inner = sympy.Add(*(_sympy(k) * symbol**-s for s, k in pairs))
            parts.append(sympy.exp(symbol * _sympy(c.height)) * inner)
        return sympy.Add(*parts)

    def _lam(self, lam: Symbol | str) -> Expr:
        """The symbol of a name that no parameter has; an expression as it is."""
        if isinstance(lam, Expr):
            return lam
        if not is_name(lam):
            raise InputError(
                f"lam is {shown(lam)}; give a symbol, or a name of letters, digits and _."
            )
        symbol = Symbol(lam, positive=True)
        self._require_other_names(symbol)
        return symbol

    @property
    def expression(self) -> Expr:
        """The sum as an expression in the parameters and the symbol lam."""
        return self.expression_in()

    @property
    def terms(self) -> tuple[Expr, ...]:
        """The expressions that add up to `expression`."""
        return tuple(sympy.Add.make_args(self.expression))

    def latex(self, lam: str = "lambda") -> str:
        """The expansion with its O term, in LaTeX."""
        symbol = self._lam(lam)
        size = sympy.exp(symbol * _sympy(self.height)) * symbol**-self.omitted
        return f"{tex(self.expression_in(lam))} + O\\left({tex(size)}\\right)"

    def emit(self, target: str = "numpy", name: str = "f") -> Any:
        """Source code of the sum, a function of lam and the parameters (`symasym.emit`).

        Raises
        ------
        InputError
            For a target that does not have its functions.
        """
        # The public verb, which is in a layer above this one.
        import symasym

        return symasym.emit(self.expression, target, name=name)

    def _repr_latex_(self) -> str | None:
        """The formula for a notebook; None where it can't be written."""
        try:
            return rf"$\displaystyle {self.latex()}$"
        except SymasymError:
            return None

    @property
    def error(self) -> str:
        """The order of the terms left out, and what is claimed of them."""
        size = f"e^(lam ({short(self.height)})) lam^(-{_bare(self.omitted)})"
        claimed = "none claimed while parameters are free"
        if not self.parameters:
            claimed = "the distance to the integral, given by evaluate(lam, full=True)"
        return f"O({size}); error: {claimed}"

    def __str__(self) -> str:
        lines = []
        for c in self.contributions:
            pairs = list(zip(c.exponents, c.coefficients, strict=True))
            row = [f"({short(k)}) lam^(-{_bare(s)})" for s, k in pairs[:6] if k != 0]
            more = " + ..." if len(pairs) > 6 else ""
            lines.append(f"e^(lam ({short(c.height)})) [{' + '.join(row) or '0'}{more}]")
        return "\n+ ".join([*lines, self.error])

    def __repr__(self) -> str:
        return f"LaplaceExpansion({self})"


def _rounded(c: Contribution, dps: int) -> Contribution:
    """The contribution with numbers of `dps` digits."""
    def near(v: Any) -> Any:
        return to_mpf(v, dps)[0]

    point = c.point if isinstance(c.point, Expr) else near(number(c.point))
    coefficients = tuple(map(near, c.coefficients))
    return replace(c, point=point, height=near(c.height), coefficients=coefficients)


def _is_long(piece: Piece) -> bool:
    """True if exact coefficients would fill pages: many functions and roots, or in each other."""
    nodes = [n for e in (piece.f, piece.g) for n in e.atoms(sympy.Function, sympy.Pow)]
    roots = [n for n in nodes if n.is_Function or not n.exp.is_Integer]
    return len(roots) > _MOST_FUNCTIONS or max(map(functions_inside, (piece.f, piece.g))) > 2


def _sympy(value: Any) -> Expr:
    """A number as an expression."""
    return sympy.Float(value._mpf_, _DIGITS) if hasattr(value, "_mpf_") else sympy.sympify(value)


def short(value: Any) -> str:
    """An expression, or twelve digits of a number, as a text."""
    if isinstance(value, arb):
        return str(value.str(12, radius=False))
    return str(mpmath.nstr(value, 12)) if hasattr(value, "_mpf_") else str(value)


def _bare(value: Expr) -> str:
    """An exponent as a text, in brackets unless it is a whole number or a symbol."""
    return str(value) if value.is_Integer or value.is_Symbol else f"({value})"


def laplace_integral(
    f: Number,
    g: Number,
    x: Symbol | str,
    a: Number,
    b: Number,
    order: int | str = 3,
    *,
    maxima: Sequence[Any] | None = None,
    dps: int | None = None,
    keep: bool = False,
) -> LaplaceExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam (Laplace's method).

    Parameters
    ----------
    f : Expr, str or number
        Real on (a, b), with a Taylor series on each side of its maximum. It may have pieces (Abs,
        Max, Min, sign, Heaviside, Piecewise) and other symbols.
    g : Expr, str or number
        Likewise; at the maximum a sum of powers of the distance, above -1, times Taylor series.
    x : Symbol or str
        Variable of integration.
    a : Expr or number
        Lower end, possibly -oo.
    b : Expr or number
        Upper end, above a, possibly oo.
    order : int, "optimal" or "borel"
        Terms for each maximum, 1 to 200; ``"optimal"``: up to the smallest term at each lam;
        ``"borel"``: the median Borel–Padé sum of 41 terms, far beyond that, of polynomial f and g
        without free parameters, f's critical points simple (`symasym.integrals.borel`).
    maxima : sequence of Expr, optional
        Where f is largest, if parameters leave it open. It is compared with f all the same.
    dps : int, optional
        Digits of numerical coefficients. None: exact ones, except at a maximum that has no closed
        form, of many functions or functions in each other, or beyond 12 terms with irrational
        constants: then 40 digits.
    keep : bool
        Keep the terms of smaller maxima too; otherwise they are listed in `dropped`.

    Returns
    -------
    LaplaceExpansion
        With the methods of `Expansion`: ``expression``, ``terms``, ``conditions``, ``error``,
        ``bind(**values)``, ``evaluate(lam, dps=None, log=False, full=False)``, ``latex()`` and
        ``emit(target)``; and ``contributions`` and ``dropped``.

    Raises
    ------
    InputError
        If the integral diverges, f is complex, constant or larger elsewhere than at `maxima`, or
        contains what symasym doesn't evaluate.

    Notes
    -----
    Watson's lemma after Lagrange's reversion: DLMF 2.3(iii); J. Wojdylo, SIAM Rev. 48 (2006) 76.
    The error is the distance of the sum to the integral, which flint encloses: a proved bound.

    Examples
    --------
    Stirling's series, Gamma(lam + 1) lam^(-lam - 1):

    >>> import symasym as sa
    >>> stirling = sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", order=3)
    >>> stirling.contributions[0].coefficients
    (sqrt(2)*sqrt(pi), sqrt(2)*sqrt(pi)/12, sqrt(2)*sqrt(pi)/288)
    >>> print(stirling.evaluate(1000, dps=20, log=True, full=True))
    -1002.53485577295316 ± 2.69e-12 (proved bound, laplace)
    >>> stirling.evaluate([10.0, 100.0]).round(12).tolist()
    [3.6288097e-05, 0.0]
    """
    f, g, x, a, b = _read(f, g, x, a, b)
    if order not in ("optimal", "borel"):
        order = count("order", order, 1, _MOST, " of terms", ', "optimal" or "borel"')
    keep, dps = flag("keep", keep), None if dps is None else digits(dps)
    if order == "borel":
        borel.require_conditions(f, g, x, a, b)
    given = None if maxima is None else [parse("maxima", z) for z in sequence("maxima", maxima)]
    free = set().union(*(e.free_symbols for e in (f, g, a, b))) - {x}
    if free and dps is not None:
        raise InputError(
            f"dps is {dps}, but {', '.join(sorted(map(str, free)))} have no value; leave dps out "
            "for a formula."
        )
    conditions: list[str] = []
    with precision(_BITS):
        pieces = cut(f, g, x, a, b)
        for node in set().union(*(e.atoms(sympy.Function) for p in pieces for e in (p.f, p.g))):
            name_of(node)
        if free:
            tops, others = with_parameters(pieces, given), []
            origin = "found" if given is None else "given"
            conditions = [
                f"f is largest at {x} = {m.point} ({origin}; compared at sampled parameters)"
                for m in tops
            ]
        else:
            tops, others = highest(pieces)
            _require_maxima(given, [*tops, *others], f)
        kept = [*tops, *others] if keep else tops
        dropped = tuple(
            f"maximum at {x} = {short(m.point)}: smaller by a factor "
            f"e^(-{short(tops[0].height - m.height)} lam)"
            for m in ([] if keep else others)
        )
        smaller = () if keep else tuple(others)
        e = LaplaceExpansion(
            f, g, x, a, b, order, dropped, (), tuple(pieces), tuple(kept), smaller, dps
        )
        for row in e._sides():
            if free:
                exactly(lambda ring, row=row: contributions(*row, 1, ring, conditions))
            else:
                for c in contributions(*row, 2, Balls(), conditions):
                    if order == "borel":
                        borel.require_steps(c.point, c.exponents)
    return replace(e, conditions=tuple(dict.fromkeys(conditions)))


def _require_maxima(given: list[Expr] | None, found: list[Maximum], f: Expr) -> None:
    """Refuse a given point that is no maximum."""
    for point in given or []:
        if point.free_symbols:
            raise InputError(f"maxima has {shown(point)}; give numbers, f has no parameters.")
        if not any(number(point).overlaps(number(m.point)) for m in found):
            raise InputError(
                f"maxima has {point}, where f = {f} has no maximum; it has them at "
                f"{', '.join(short(m.point) for m in found)}."
            )


def _read(f: Any, g: Any, x: Any, a: Any, b: Any) -> tuple[Expr, Expr, Symbol, Expr, Expr]:
    """(f, g, x, a, b) as expressions, checked."""
    symbol = Symbol(x) if is_name(x) else x
    if not isinstance(symbol, Symbol):
        raise InputError(f"x is {shown(x)}; give the variable of integration, a SymPy symbol.")
    f, g, a, b = (
        parse(name, value, {symbol.name: symbol})
        for name, value in (("f", f), ("g", g), ("a", a), ("b", b))
    )
    for name, e in (("f", f), ("g", g), ("a", a), ("b", b)):
        if e.has(sympy.I, sympy.zoo, sympy.nan) or (name in "fg" and e.has(sympy.oo, -sympy.oo)):
            raise InputError(
                f"{name} = {e} is complex, infinite or undefined; give a real one (Laplace's method "
                "is for real f; oscillating integrals need stationary phase)."
            )
        if name in "ab" and e.has(symbol):
            raise InputError(f"{name} = {e} contains {symbol}; give an end free of it.")
        if name in "ab" and e.is_extended_real is False:
            raise InputError(f"{name} = {e} is not real; give a real end or ±oo.")
    if not f.has(symbol):
        raise InputError(
            f"f = {f} does not contain {symbol}, so the exponential is constant; give an f that "
            f"depends on {symbol}."
        )
    for name, e, beyond in (
        ("a", a, symbol.is_nonnegative and a.is_negative),
        ("b", b, symbol.is_nonpositive and b.is_positive),
    ):
        if beyond:
            raise InputError(
                f"{name} is {e}, where {symbol} cannot be by its own assumptions; give a symbol "
                "without them."
            )
    if not a.free_symbols | b.free_symbols:
        with precision(_BITS):
            if not number(a) < number(b):
                raise InputError(f"a is {a} and b is {b}; a must be less than b.")
    if g == 0:
        raise InputError("g is 0, so the integral is; give a g that is not.")
    return f, g, symbol, a, b
