"""The expansion of int g e^(lam f) by Laplace's method, evaluated at any lam with its error.

Over the maxima p of f it is the sum of e^(lam f(p)) sum_k c_k lam^(-s_k), s_k = (k + beta)/mu (DLMF
2.3(ii), 2.3(iii); `.expansion`). All is summed over e^(lam f(p_0)), p_0 the highest, so that
logarithms are finite where the value overflows. Its error is a proved bound or an estimate
(`.errors`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
import sympy

from symasym.asymptotics.laplace.borel import left_out, median_sums, pairs_beyond
from symasym.asymptotics.laplace.errors import ErrorModel
from symasym.asymptotics.laplace.expansion import Contribution
from symasym.asymptotics.laplace.kinks import difference, number
from symasym.base.call_context import mpf_of, own_context, patient, symbolic, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError, SymasymError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import (
    FloatArray,
    digits,
    exact,
    flag,
    float_text,
    floats,
    is_array,
    is_name,
    positive,
    shown,
)
from symasym.derivation.printing import tex
from symasym.numbers.float_arrays import two_product

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.base.inputs import Number, Numbers

#: Digits of the sum behind a float64 value.
FLOAT_DIGITS = 20
_SHOWN_DIGITS = 40


@dataclass(frozen=True, repr=False)
class IntegralExpansion:
    """An integral and the sum of its expansion's terms, at any lam."""

    f: Expr
    g: Expr
    x: Symbol
    a: Expr
    b: Expr
    order: int | str
    _again: Callable[..., Any] = field(compare=False)

    @property
    def _own_names(self) -> tuple[str, ...]:
        """lam in text and LaTeX, the number e, and the O of what is left out."""
        return "lam", "lambda", "e", "O"

    def __post_init__(self) -> None:
        for name in self._own_names:
            self._require_other_names(sympy.Symbol(name))

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
        free = set().union(*(part.free_symbols for part in parts)) - {self.x}
        return tuple(sorted(free, key=str))

    def _with_numbers(self, values: dict[str, Number]) -> tuple[Expr, Expr, Symbol, Expr, Expr]:
        """(f, g, x, a, b) with exact numbers for these parameters."""
        names = {str(symbol): symbol for symbol in self.parameters}
        swap = {}
        for name, value in values.items():
            if name not in names:
                known = ", ".join(names) or "none"
                raise InputError(f"{name} is not a parameter of the integral ({known}).")
            rational = exact(name, value)
            swap[names[name]] = sympy.Rational(rational.numerator, rational.denominator)
        f, g, a, b = (part.xreplace(swap) for part in (self.f, self.g, self.a, self.b))
        return f, g, self.x, a, b

    def _require_bound(self) -> None:
        """Refuse free parameters."""
        if self.parameters:
            raise InputError(
                f"parameters have no value: {', '.join(map(str, self.parameters))}; call bind(…) "
                "first."
            )

    def bind(self, /, **values: Number) -> Self:
        """The expansion with numbers for parameters; its error is then known too.

        Raises
        ------
        InputError
            For a name that is not a parameter.
        """
        return cast(Self, self._again(*self._with_numbers(values), self.order))

    @patient
    def evaluate(
        self,
        lam: Numbers,
        *,
        dps: int | None = None,
        log: bool = False,
        full: bool = False,
        patience: float | None = None,
    ) -> Any:
        """The sum of the terms at `lam`.

        Parameters
        ----------
        lam : number or array_like
            Greater than 0.
        dps : int, optional
            Digits of the sum, as mpf or mpc. None: float64 or complex128, vectorised.
        log : bool
            Natural logarithm of a real value, finite where the value overflows.
        full : bool
            An `Estimate`: its error is that of the sum as a value of the integral.
        patience : float, optional
            Seconds of processor time that it may take, 10 if left out.

        Returns
        -------
        float, complex, ndarray, mpf, mpc or Estimate
            Complex where f is imaginary, or g's constant factor leaves it so.

        Raises
        ------
        InputError
            While parameters are free, or lam is not above 0.
        RangeError
            If the value does not fit float64 and `log` is False.
        AccuracyError
            For the logarithm of a sum that is complex, or not surely positive; for more digits than
            rounded coefficients have; if coalescing saddles are too far apart for one expansion.
        """
        self._require_bound()
        log, full = flag("log", log), flag("full", full)
        if not is_array(lam):
            scalar = positive("lam", exact("lam", cast("Number", lam)))
            if dps is None:
                return self._by_float(scalar, log, full)
            return self._by_digits(scalar, digits(dps), log, full)
        if dps is not None:
            raise InputError(
                f"lam is an array and dps is {dps}; arrays are for float64 (dps=None)."
            )
        values = floats("lam", lam)
        if not (values > 0).all():
            raise InputError(f"lam is {values.min():.6g}; it must be greater than 0.")
        if not full:
            return self._by_arrays(values, log)
        each = [self._by_float(Fraction(y), log, True) for y in values.ravel()]
        value, error = (
            np.array([getattr(e, name) for e in each]).reshape(values.shape)
            for name in ("value", "error")
        )
        kinds: set[ErrorKind] = {e.error_kind for e in each}
        kind: ErrorKind = kinds.pop() if len(kinds) == 1 else "estimate"
        return replace(each[0], value=value, error=error, error_kind=kind)

    def _by_arrays(self, lam: FloatArray, log: bool) -> FloatArray:
        """All lam, one by one."""
        each = [self._by_float(Fraction(y), log, False) for y in lam.ravel()]
        return np.array(each).reshape(lam.shape)

    def _by_float(self, lam: Fraction, log: bool, full: bool) -> Any:
        """The sum at one lam in float64, from a few more digits."""
        estimate = self._by_digits(lam, FLOAT_DIGITS, log, full)
        value = estimate.value if full else estimate
        if not log and value:
            with own_context(15) as context:
                size = float(context.log(abs(context.convert(value))))
            if not -708.39 < size < 709.78:
                raise RangeError(
                    f"the integral's logarithm is {size:.6g}, beyond float64; "
                    "pass log=True or dps=…."
                )
        rounded = complex(value) if hasattr(value, "_mpc_") else float(value)
        if not full:
            return rounded
        with own_context(2 * FLOAT_DIGITS) as context:
            shift = abs(context.convert(rounded) - context.convert(value))
            error = math.nextafter(float(shift + context.convert(estimate.error)), math.inf)
        return replace(estimate, value=rounded, error=error)

    def _by_digits(self, lam: Fraction, dps: int, log: bool, full: bool) -> Any:
        """The sum at one lam as an mpf or mpc, or an `Estimate` of the integral."""
        raise NotImplementedError

    # -- as a formula -----------------------------------------------------------------------

    def expression_in(self, lam: Symbol | str = "lam") -> Expr:
        """The sum as an expression in `lam` (a symbol or a name)."""
        raise NotImplementedError

    def _lam(self, lam: Symbol | str) -> Expr:
        """The symbol of a name that no parameter has; an expression as it is."""
        if isinstance(lam, sympy.Expr):
            return lam
        if not is_name(lam):
            raise InputError(
                f"lam is {shown(lam)}; give a symbol, or a name of letters, digits and _."
            )
        symbol = sympy.Symbol(lam, positive=True)
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

    @symbolic
    def latex(self, lam: str = "lambda") -> str:
        """The sum in LaTeX."""
        return tex(self.expression_in(lam))

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
        """The formula for a notebook; None where it is not one of a few terms."""
        try:
            return rf"$\displaystyle {self.latex()}$"
        except SymasymError:
            return None

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self})"


@dataclass(frozen=True, repr=False)
class LaplaceExpansion(IntegralExpansion):
    """The expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam.

    Attributes
    ----------
    f, g, x, a, b : Expr
        The integral.
    order : int or "optimal"
    contributions : tuple of Contribution
        One for each maximum, or each side of it where the sides differ.
    dropped : tuple of str
        What is exponentially small and left out.
    conditions : tuple of str
        What was seen to hold at sampled parameters but not proved from their assumptions.
    """

    contributions: tuple[Contribution, ...]
    dropped: tuple[str, ...]
    conditions: tuple[str, ...]
    _errors: ErrorModel | None = field(compare=False)

    @property
    def height(self) -> Real:
        """The largest f, lam times which is the exponent of the leading exponential."""
        return self.contributions[0].height

    @property
    def omitted(self) -> Expr:
        """The power sigma of the first term left out, which is of order lam^(-sigma)."""
        powers = []
        for c in self.contributions:
            step = sympy.Rational(2 if c.side == "both" else 1, c.contact)
            powers.append(c.exponents[-1] + step)
        return sympy.Min(*powers)

    @property
    @symbolic
    def error_kind(self) -> str:
        """``"bound"`` if the error is proved, ``"estimate"``; ``"none"`` with parameters free."""
        if self._errors is None or self.order == "borel":
            return "none" if self._errors is None else "estimate"
        return self._errors.kind

    @property
    @symbolic
    def bound(self) -> tuple[mpf, Expr, mpf] | None:
        """(K, sigma, lam_0), or None where nothing is proved.

        For lam >= lam_0, the integral differs from the expansion by at most
        K lam^(-sigma) e^(lam h), where h is `height`.
        """
        if self._errors is None or isinstance(self.order, str):
            return None
        return self._errors.statement(int(self.order), self.omitted)

    def _by_arrays(self, lam: FloatArray, log: bool) -> FloatArray:
        """All lam at once; those where float64 would cancel one by one."""
        if isinstance(self.order, str):
            return super()._by_arrays(lam, log)
        flat = lam.ravel()
        top, rest = _split(number(self.height))
        total, sizes = np.zeros_like(flat), np.zeros_like(flat)
        with np.errstate(under="ignore"):
            for c in self.contributions:
                height = float(difference(number(c.height), number(self.height)))
                exponents, coefficients = c.numbers(FLOAT_DIGITS)
                weight = np.exp(flat * height)
                for s, k in zip(exponents, coefficients, strict=True):
                    term = weight * (float(k) * flat ** -float(s))
                    total += term
                    sizes += np.abs(term)
        # What lam times the height loses in its last digit would be relative in the value.
        product, lost = two_product(flat, np.full_like(flat, top))
        lost = lost + flat * rest
        with np.errstate(all="ignore"):
            logs = product + (lost + np.log(np.abs(total)))
            result = logs if log else np.exp(product) * (1 + np.expm1(lost)) * total
        plain = (total >= 0.1 * sizes) & (np.abs(product) < 700) & (np.abs(logs) < 700)
        if log:
            plain = (total >= 0.1 * sizes) & np.isfinite(logs)
        for k in np.flatnonzero(~plain):
            result[k] = self._by_float(Fraction(flat[k]), log, False)
        return np.asarray(result.reshape(lam.shape))

    def _by_digits(self, lam: Fraction, dps: int, log: bool, full: bool) -> Any:
        """The sum at one lam as an mpf, or an `Estimate` by `ErrorModel.relative`."""
        assert self._errors is not None
        for c in self.contributions:
            if not c.exact and dps > self._errors.digits - 10:
                raise AccuracyError(
                    f"dps is {dps}, but the coefficients were computed to {self._errors.digits} "
                    "digits; pass dps=… to laplace_integral."
                )
        with own_context(dps + 30) as context:
            large, first = mpf_of(lam, context), self.contributions[0]
            exponent = large * max(1, abs(first.height_in(context)))
            more = dps + 30 + max(0, int(context.log10(exponent)))
            context.dps = more
            large = mpf_of(lam, context)
            top = first.height_in(context)
            shares, orders, size = [], [], context.mpf(0)
            apart = context.zero
            for c in self.contributions:
                weight = context.exp(large * (c.height_in(context) - top))
                if self.order == "borel":
                    sums = median_sums(c, large, context)
                    shares.append(weight * sums[0])
                    orders.append(len(c.coefficients))
                    size += abs(shares[-1])
                    apart += weight * left_out(sums)
                    at = c.height_in(context)
                    apart += weight * pairs_beyond(self.f, self.g, self.x, at, large, context)
                    continue
                terms = c.terms(large, more, context)
                used = len(terms)
                if self.order == "optimal":
                    sizes = [abs(t) if t else context.inf for t in terms]
                    used = max(1, sizes.index(min(sizes)))
                orders.append(used)
                shares.append(weight * context.fsum(terms[:used]))
                size += weight * context.fsum(map(abs, terms[:used]))
            total = context.fsum(shares)
            error, kind = context.mpf(0), self._errors.kind
            if full and self.order == "borel":
                error, kind = apart + self._errors.elsewhere(large, context), "estimate"
            elif full:
                error, kind = self._errors.relative(lam, orders, shares, context)
            error += size * context.mpf(10) ** (5 - more)
            # Rounding of the height, and of lam times it, is an error of the exponent.
            slip = abs(large * top) * context.mpf(10) ** (5 - more)
            if not isinstance(self.height, sympy.Basic):
                slip += abs(large * top) * context.mpf(10) ** -(self._errors.digits + 8)
            # The last digit's rounding is an error of the printed value too.
            error += abs(total) * context.mpf(10) ** -(dps + 5)
            if log:
                if total <= error:
                    raise AccuracyError(
                        f"the sum at lam = {float_text(lam)} is not surely positive, so its "
                        "logarithm is not known; ask for the value, or for a larger lam."
                    )
                exact_value = large * top + context.log(total)
                error = slip - context.log1p(-error / total)
            else:
                if slip > 1:
                    raise AccuracyError(
                        f"lam times the largest f is {context.nstr(large * top, 6)}, of which "
                        f"{self._errors.digits + 8} digits are known; pass more as dps=… to "
                        "laplace_integral."
                    )
                scale = context.exp(large * top)
                error = scale * (error + abs(total) * context.expm1(slip))
                exact_value = scale * total
            value = to_mpf(exact_value, dps)
            if not full:
                return value
            error += abs(exact_value - context.make_mpf(value._mpf_))
            shown = to_mpf(error * (1 + context.mpf(10) ** -10), 15)
        return Estimate(value, shown, kind, "laplace", max(orders), self._named(), self.dropped)

    def _named(self) -> tuple[str, ...]:
        """A line for each contribution, for `Estimate.terms`."""
        return tuple(
            f"{self.x} = {short(c.point)} ({c.side}): {len(c.coefficients)} terms"
            for c in self.contributions
        )

    def expression_in(self, lam: Symbol | str = "lam") -> Expr:
        symbol = self._lam(lam)
        total = sympy.Integer(0)
        for c in self.contributions:
            pairs = zip(c.exponents, c.coefficients, strict=True)
            inner = sympy.Add(*(_sympy(k) * symbol**-s for s, k in pairs))
            total += sympy.exp(symbol * _sympy(c.height)) * inner
        return total

    def latex(self, lam: str = "lambda") -> str:
        """The expansion with its O term, in LaTeX."""
        symbol = self._lam(lam)
        size = sympy.exp(symbol * _sympy(self.height)) * symbol**-self.omitted
        return f"{super().latex(lam)} + O\\left({tex(size)}\\right)"

    @property
    @symbolic
    def error(self) -> str:
        """The order of the terms left out, and what is claimed of them."""
        size = f"e^(lam ({short(self.height)})) lam^(-{_bare(self.omitted)})"
        return f"O({size}); error: {self._error_text()}"

    @symbolic
    def __str__(self) -> str:
        lines = []
        for c in self.contributions:
            height = short(c.height)
            pairs = list(zip(c.exponents, c.coefficients, strict=True))
            shown = [f"({short(k)}) lam^(-{_bare(s)})" for s, k in pairs[:6] if k != 0]
            more = " + ..." if len(pairs) > 6 else ""
            lines.append(f"e^(lam ({height})) [{' + '.join(shown) or '0'}{more}]")
        lines.append(self.error)
        return "\n+ ".join(lines)

    def _error_text(self) -> str:
        """The error in words, for `print`."""
        from mpmath import nstr

        if self.error_kind == "none":
            return "none claimed while parameters are free"
        statement = self.bound
        if statement is None:
            return f"{self.error_kind}, given by evaluate(lam, full=True)"
        # Three digits, rounded upwards.
        with own_context(15) as context:
            k, start = (
                nstr(context.make_mpf(value._mpf_) * context.mpf("1.006"), 3)
                for value in (statement[0], statement[2])
            )
        return f"at most {k} times that for lam >= {start} (bound)"


def _sympy(value: Real) -> Expr:
    """A number as an expression."""
    if isinstance(value, sympy.Basic):
        return value
    return (
        sympy.Float(value._mpf_, _SHOWN_DIGITS) if hasattr(value, "_mpf_") else sympy.sympify(value)
    )


def _split(value: Real) -> tuple[float, float]:
    """A number as the sum of two floats."""
    rational = exact("f", value)
    head = float(rational)
    return head, float(rational - Fraction(head))


def short(value: Real) -> str:
    """An expression, or twelve digits of a number, as a text."""
    if isinstance(value, sympy.Basic):
        return str(value)
    from mpmath import nstr

    return str(nstr(value, 12))


def _bare(value: Expr) -> str:
    """An exponent as a text, in brackets unless it is a whole number or a symbol."""
    text = str(value)
    return text if value.is_Integer or value.is_Symbol else f"({text})"
