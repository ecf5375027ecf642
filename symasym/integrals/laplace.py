"""Laplace's method for int g(x) e^(lam f(x)) dx over [a, b] as lam grows.

To all powers of 1/lam the integral is the sum of the contributions of the points where f is
largest, inside, at ends and at kinks. With f = f(p) - a t^mu (1 + ...) and g = t^(beta - 1) (g_0 +
...), t the distance from the point p on one side or both, each is

    e^(lam f(p)) sum over k of c_k lam^(-(k + beta)/mu)

(Watson's lemma after Lagrange's reversion: DLMF 2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic
Expansions, 2.4; `symasym.series.local.watson`). On both sides of a smooth maximum the terms with
k + beta - 1 odd cancel. The error at a given lam is the distance to the integral, enclosed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import mpmath
import numpy as np
import sympy
from flint import arb, fmpq
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import AccuracyError, InputError, RangeError, SymasymError
from symasym.base.estimate import Estimate
from symasym.base.inputs import (
    Number,
    Numbers,
    count,
    digits,
    exact,
    flag,
    float_text,
    floats,
    is_array,
    is_name,
    positive,
    sequence,
    shown,
)
from symasym.derivation.tex import tex
from symasym.drift.expressions import parse
from symasym.integrals import borel
from symasym.integrals.enclosure import integral, name_of, number
from symasym.integrals.maxima import FLAT, Maximum, Piece, cut, highest, with_parameters
from symasym.integrals.terms import Balls, NotAnalytic, Point, exactly, sign_of
from symasym.numbers.balls import precision, to_mpf
from symasym.series.local import watson
from symasym.series.power_series import Series

__all__ = ["Contribution", "LaplaceExpansion", "laplace_integral"]

#: Terms that order="optimal" chooses from, and the most.
_OPTIMAL, _MOST = 48, 200
#: Bits at which f is compared with itself; digits of coefficients that aren't exact.
_BITS, _DIGITS = 256, 40
# Terms with irrational constants, and functions and roots, beyond which they aren't.
_EXACT_TERMS, _MOST_FUNCTIONS = 12, 6
# Orders lost to factors such as sin(x)/x.
_SPARE = 4


@dataclass(frozen=True)
class Contribution:
    """e^(lam height) times the sum of coefficients[k] lam^(-exponents[k]), of a maximum.

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
    piece: Piece, point: Any, side: str, order: int, ring: Any
) -> tuple[list[Contribution], list[str]]:
    """Those of a maximum, one for each power in g; and what was seen of signs but not proved."""
    sign, step = (-1 if side == "left" else 1), (2 if side == "both" else 1)
    f, g, x = piece.f, piece.g, piece.x
    try:
        c = Point(x, point, sign, FLAT + 1, ring).taylor(f).c
        contact = next((k for k, y in enumerate(c) if k and ring.sign(y)[0] != 0), FLAT)
        here = Point(x, point, sign, step * order + contact + _SPARE, ring)
        lead, terms = here.taylor(f).c, here.terms(g)
    except NotAnalytic as error:
        raise InputError(
            "Laplace's method takes f with a Taylor series on each side of its maximum, and g a "
            f"sum of powers of the distance times such; but {error}"
        ) from None
    a = ring.expression(-lead[contact])
    falls, proved = ring.sign(-lead[contact])
    if falls != 1 or (side == "both" and contact % 2):
        raise InputError(
            f"f = {f} is not largest at {x} = {point}, or flat there (the first term after f there "
            f"is of order {contact}, times {short(-a)}); give the point of a maximum, or symbols "
            "with assumptions that decide."
        )
    conditions = [] if proved else [f"{sympy.simplify(-a)} < 0"]
    if not terms:
        raise InputError(f"g = {g} vanishes to all orders looked at at {x} = {point}.")
    found = []
    for front, weight in terms:
        beta = front + 1
        above, proved = sign_of(beta)
        if side == "both" and not front.is_Integer:
            raise InputError(
                f"g behaves as a power {front} of {x} - ({point}) at an interior maximum, where it "
                "isn't real on both sides; write it with Abs, or split the integral there."
            )
        if above != 1:
            raise InputError(
                f"g behaves as a power {sympy.simplify(front)} of the distance from {x} = {point}, "
                "where f is largest, so the integral diverges unless the power is above -1; change "
                "g or give its symbols assumptions."
            )
        conditions += [] if proved else [f"{beta} > 0"]
        first = int(front) % 2 if side == "both" else 0
        ks = range(first, first + step * order, step)
        if len(weight) <= ks[-1]:
            raise AccuracyError(f"g = {g} cancels too many orders at {x} = {point}; simplify g.")
        steep = Series([ring.of(S.One), *(y / lead[contact] for y in lead[contact + 1 :])])
        steep, weight = (Series(series.c[: ks[-1] + 1]) for series in (steep, weight))
        power = Fraction(int(beta.p), int(beta.q)) if beta.is_Rational else ring.of(beta)
        exponents = tuple((k + beta) / contact for k in ks)
        reduced = watson(steep, weight, contact, power, first=first, step=step)
        values = []
        for d, s in zip(reduced, exponents, strict=True):
            # On each side the moment of t^(mu s - 1) e^(-a t^mu).
            gamma = sympy.gamma(s) if ring.exact else number(s).gamma()
            raised = a**s if ring.exact else ring.power(a, s)
            values.append(ring.expression(d) * (step * (gamma / (contact * raised))))
        height = ring.expression(lead[0])
        found.append(Contribution(point, side, height, contact, beta, exponents, tuple(values)))
    return found, conditions


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
    _dps: int | None = field(default=None, compare=False)

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

    @property
    def parameters(self) -> tuple[Symbol, ...]:
        """Free symbols besides x."""
        parts = (self.f, self.g, self.a, self.b)
        return tuple(sorted(set().union(*(e.free_symbols for e in parts)) - {self.x}, key=str))

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

    @property
    def _terms(self) -> int:
        if isinstance(self.order, int):
            return self.order
        return _OPTIMAL if self.order == "optimal" else borel.TERMS

    def _expanded(self, ring: Any, terms: int) -> list[Contribution]:
        sides = [row for m in self._tops for row in m.sides]
        return [c for row in sides for c in contributions(*row, terms, ring)[0]]

    @cached_property
    def contributions(self) -> tuple[Contribution, ...]:
        """One for each maximum, each side of it where the sides differ, and each power in g."""
        nodes = [
            n for p in self._pieces for e in (p.f, p.g) for n in e.atoms(sympy.Function, sympy.Pow)
        ]
        roots = [n for n in nodes if n.is_Function or not n.exp.is_Integer]
        closed = (
            all(isinstance(m.point, Expr) for m in self._tops) and len(roots) <= _MOST_FUNCTIONS
        )
        if closed and not self.parameters and self._terms > _EXACT_TERMS:
            closed = exactly(lambda ring: bool(self._expanded(ring, 1)) and ring.domain == sympy.QQ)
        if self.parameters or (closed and self._dps is None):
            try:
                return tuple(exactly(lambda ring: self._expanded(ring, self._terms)))
            except AccuracyError:
                if self.parameters:
                    raise
        dps = self._dps or _DIGITS
        for bits in (int(3.33 * dps) + 64 << k for k in range(6)):
            found = self._in_balls(bits, self._terms)
            values = [v for c in found for v in (c.height, *c.coefficients)]
            if all(v.rel_accuracy_bits() > 3.33 * dps + 8 or v.contains(0) for v in values):
                break
        with precision(bits):
            return tuple(_rounded(c, dps) for c in found)

    def _in_balls(self, bits: int, terms: int) -> list[Contribution]:
        """The contributions in balls, kept."""
        known: dict[Any, list[Contribution]] = self.__dict__.setdefault("_known", {})
        if (bits, terms) not in known:
            with precision(bits + 6 * terms):
                known[bits, terms] = self._expanded(Balls(), terms)
        return known[bits, terms]

    @property
    def height(self) -> Any:
        """The largest f, lam times which is the exponent of the leading exponential."""
        return self.contributions[0].height

    @property
    def omitted(self) -> Expr:
        """The power sigma of the first term left out, which is of order lam^(-sigma)."""
        steps = {"both": 2, "left": 1, "right": 1}
        rows = ((c.exponents[-1], Rational(steps[c.side], c.contact)) for c in self.contributions)
        return sympy.Min(*(last + step for last, step in rows))

    @property
    def error_kind(self) -> str:
        """``"none"`` while parameters are free, else ``"bound"``."""
        return "none" if self.parameters else "bound"

    @property
    def error(self) -> str:
        """The order of the terms left out, and what is claimed of them."""
        size = f"e^(lam ({short(self.height)})) lam^(-{_bare(self.omitted)})"
        if self.parameters:
            return f"O({size}); error: none claimed while parameters are free"
        return f"O({size}); error: the distance to the integral, of evaluate(lam, full=True)"

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
            An `Estimate`, whose error is the distance of the sum to the integral, proved.

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
            For the logarithm of a sum that is not surely positive; with `full`, if the integral
            can't be enclosed.
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
        pair = np.array([(e.value, e.error) for e in each]).T
        value, error = (row.reshape(values.shape) for row in pair)
        return replace(each[0], value=value, error=error)

    def _at(self, lam: Fraction, dps: int | None, log: bool, full: bool) -> Any:
        """The sum at one lam, or an `Estimate` of the integral."""
        wanted, error = dps or 17, arb(0)
        first = int(3.33 * wanted) + 64 + (borel.BITS if self.order == "borel" else 0)
        for bits in (first << k for k in range(4)):
            with precision(bits):
                large, total, top, used = (
                    arb(fmpq(lam.numerator, lam.denominator)),
                    *self._sum(lam, bits),
                )
                scale = large * top
                value = total * scale.exp() if not log else scale + total.log()
                if value.rel_accuracy_bits() > 3.33 * wanted + 4:
                    break
        with precision(bits):
            if full:
                parts = [s for piece in self._pieces for s in piece.stretches]
                error = abs(total - integral(parts, lam, top, bits))
                if not error.is_finite():
                    raise AccuracyError(
                        f"the integral at lam = {float_text(lam)} could not be enclosed, because "
                        "of a singularity or a slow decay; leave full out for the sum alone."
                    )
            if log and not total > error:
                raise AccuracyError(
                    f"the sum at lam = {float_text(lam)} is not surely positive, so its logarithm "
                    "is not known; ask for the value, or for a larger lam."
                )
            size = float((scale + abs(total).log()).mid()) if value != 0 else 0.0
            if dps is None and not log and not -708.39 < size < 709.78:
                raise RangeError(
                    f"the integral's logarithm is {size:.6g}, beyond float64; pass log=True or "
                    "dps=…."
                )
            middle, radius = to_mpf(value, wanted)
            if not full:
                return float(middle) if dps is None else middle
            error = -(-error / total).log1p() if log else error * scale.exp()
            error += arb(radius)
            if dps is None:
                middle, error = float(middle), error + abs(arb(middle) - arb(float(middle)))
            # The last rounding is within the factor.
            whole = to_mpf((error * (1 + arb(2) ** -30)).upper(), 15)[0]
        shares = tuple(f"{self.x} = {short(m.point)}: {self._terms} terms" for m in self._tops)
        whole = whole if dps else float(whole)
        return Estimate(middle, whole, "bound", "laplace", max(used), shares, self.dropped)

    def _sum(self, lam: Fraction, bits: int) -> tuple[Any, Any, list[int]]:
        """The sum over e^(lam top), top the largest f; the number of terms of each contribution."""
        found, large = self._in_balls(bits, self._terms), arb(fmpq(lam.numerator, lam.denominator))
        top, total, used = found[0].height, arb(0), []
        for c in found:
            s = [number(e) for e in c.exponents]
            terms = [y * large**-e for y, e in zip(c.coefficients, s, strict=True)]
            n = len(terms)
            if self.order == "optimal":
                sizes = [arb.pos_inf() if t.contains(0) else abs(t.mid()) for t in terms]
                n = max(1, min(range(n), key=sizes.__getitem__))
            part = sum(terms[:n], arb(0))
            if self.order == "borel":
                part = borel.median_sum(list(c.coefficients), s[0], large)
            total += part * (large * (c.height - top)).exp()
            used.append(n)
        return total, top, used

    # -- as a formula -------------------------------------------------------------------------

    def expression_in(self, lam: Symbol | str = "lam") -> Expr:
        """The sum as an expression in `lam` (a symbol or a name)."""
        if not isinstance(lam, Expr) and not is_name(lam):
            raise InputError(
                f"lam is {shown(lam)}; give a symbol, or a name of letters, digits and _."
            )
        symbol = lam
        if not isinstance(lam, Expr):
            symbol = Symbol(lam, positive=True)
            self._require_other_names(symbol)
        parts = []
        for c in self.contributions:
            rows = zip(c.exponents, c.coefficients, strict=True)
            inner = sympy.Add(*(_sympy(k) * symbol**-s for s, k in rows))
            parts.append(sympy.exp(symbol * _sympy(c.height)) * inner)
        return sympy.Add(*parts)

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
        total, symbol = self.expression_in(lam), Symbol(str(lam), positive=True)
        size = sympy.exp(symbol * _sympy(self.height)) * symbol**-self.omitted
        return f"{tex(total)} + O\\left({tex(size)}\\right)"

    def _repr_latex_(self) -> str | None:
        """The formula for a notebook; None where it can't be written."""
        try:
            return rf"$\displaystyle {self.latex()}$"
        except SymasymError:
            return None

    def emit(self, target: str = "numpy", name: str = "f") -> Any:
        """Source code of the sum, a function of lam and the parameters (`symasym.emit`)."""
        # The public verb, which is in a layer above this one.
        import symasym

        return symasym.emit(self.expression, target, name=name)

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
    point = c.point if isinstance(c.point, Expr) else to_mpf(number(c.point), dps)[0]
    height, *values = (to_mpf(v, dps)[0] for v in (c.height, *c.coefficients))
    return replace(c, point=point, height=height, coefficients=tuple(values))


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
    a, b : Expr or number
        Ends, possibly -oo and oo.
    order : int, "optimal" or "borel"
        Terms for each maximum, 1 to 200; ``"optimal"``: up to the smallest term at each lam;
        ``"borel"``: the median Borel–Padé sum of 41 terms, far beyond that, of polynomial f and g
        without free parameters, f's critical points simple (`symasym.integrals.borel`).
    maxima : sequence of Expr, optional
        Where f is largest, if parameters leave it open. It is compared with f all the same.
    dps : int, optional
        Digits of numerical coefficients. None: exact ones, except at a maximum that has no closed
        form, of many functions, or beyond 12 terms with irrational constants: then 40 digits.
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
    return _expansion(*_read(f, g, x, a, b), order, maxima, dps, keep)


def _expansion(
    f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr, order: int | str, maxima: Any,
    dps: int | None, keep: bool,
) -> LaplaceExpansion:  # fmt: skip
    """The expansion of an integral that was read."""
    if not (isinstance(order, str) and order in ("optimal", "borel")):
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
    conditions, others = list[str](), list[Maximum]()
    with precision(_BITS):
        pieces = cut(f, g, x, a, b)
        for node in set().union(*(e.atoms(sympy.Function) for p in pieces for e in (p.f, p.g))):
            name_of(node)
        if free:
            tops = with_parameters(pieces, given)
            how = "compared at sampled parameters"
            conditions = [f"f is largest at {x} = {m.point} ({how})" for m in tops]
        else:
            tops, others = highest(pieces)
            points = [number(m.point) for m in (*tops, *others)]
            for z in given or []:
                if z.free_symbols or not any(number(z).overlaps(point) for point in points):
                    raise InputError(
                        f"maxima has {z}, where f = {f} has no maximum; it has them at "
                        f"{', '.join(map(short, points))}."
                    )
        dropped = [
            f"maximum at {x} = {short(m.point)}: smaller by a factor "
            f"e^(-{short(tops[0].height - m.height)} lam)"
            for m in others
        ]
        kept, dropped = ([*tops, *others], []) if keep else (tops, dropped)
        for row in (row for m in kept for row in m.sides):
            work: Any = partial(contributions, *row, 2)
            found, seen = exactly(work) if free else work(Balls())
            conditions += seen
            if order == "borel":
                borel.require_steps(found[0].point, found[0].exponents)
    said = tuple(dict.fromkeys(conditions))
    return LaplaceExpansion(
        f, g, x, a, b, order, tuple(dropped), said, tuple(pieces), tuple(kept), dps
    )


def _read(f: Any, g: Any, x: Any, a: Any, b: Any) -> tuple[Expr, Expr, Symbol, Expr, Expr]:
    """(f, g, x, a, b) as expressions, checked."""
    symbol = Symbol(x) if is_name(x) else x
    if not isinstance(symbol, Symbol):
        raise InputError(f"x is {shown(x)}; give the variable of integration, a SymPy symbol.")
    given = {"f": f, "g": g, "a": a, "b": b}
    read = {name: parse(name, e, {symbol.name: symbol}) for name, e in given.items()}
    for name, e in read.items():
        if e.has(sympy.I, sympy.zoo, sympy.nan) or (name in "fg" and e.has(sympy.oo, -sympy.oo)):
            raise InputError(
                f"{name} = {e} is complex, infinite or undefined; give a real one (Laplace's "
                "method is for real f; oscillating integrals need stationary phase)."
            )
        if name in "ab" and (e.has(symbol) or e.is_extended_real is False):
            raise InputError(
                f"{name} = {e} contains {symbol} or is complex; give a real end or ±oo."
            )
    f, g, a, b = read.values()
    if not f.has(symbol):
        raise InputError(
            f"f = {f} does not contain {symbol}, so the exponential is constant; give an f that "
            f"depends on {symbol}."
        )
    if (symbol.is_nonnegative and a.is_negative) or (symbol.is_nonpositive and b.is_positive):
        raise InputError(
            f"a is {a} and b is {b}, where {symbol} cannot be by its own assumptions; give a "
            "symbol without them."
        )
    with precision(_BITS):
        if not a.free_symbols | b.free_symbols and not number(a) < number(b):
            raise InputError(f"a is {a} and b is {b}; a must be less than b.")
    if g == 0:
        raise InputError("g is 0, so the integral is; give a g that is not.")
    return f, g, symbol, a, b
