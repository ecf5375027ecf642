"""The result of Laplace's method: a sum of powers of lam, with its error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from symasym.asymptotics.laplace.errors import ErrorModel
from symasym.asymptotics.laplace.expansion import Contribution
from symasym.asymptotics.laplace.kinks import difference, number
from symasym.base.contexts import float_with_error, mpf_of, own_context, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import FloatArray, digits, exact, float_text, floats, is_array
from symasym.numbers.double_double import two_product

_FLOAT_DIGITS = 20
_SHOWN_DIGITS = 40


class IntegralParts:
    """The integral itself; the expansions say what is made of it."""

    f: Any
    g: Any
    x: Any
    a: Any
    b: Any

    @property
    def parameters(self) -> tuple[Any, ...]:
        """Free symbols besides x."""
        parts = (self.f, self.g, self.a, self.b)
        free = set().union(*(part.free_symbols for part in parts)) - {self.x}
        return tuple(sorted(free, key=str))

    def _with_numbers(self, values: dict[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
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
        if self.parameters:
            raise InputError(
                f"{', '.join(map(str, self.parameters))} have no value; call bind(…) first."
            )


@dataclass(frozen=True, repr=False)
class LaplaceExpansion(IntegralParts):
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

    f: Any
    g: Any
    x: Any
    a: Any
    b: Any
    order: int | str
    contributions: tuple[Contribution, ...]
    dropped: tuple[str, ...]
    conditions: tuple[str, ...]
    _errors: ErrorModel | None = field(compare=False)
    _again: Callable[..., LaplaceExpansion] = field(compare=False)

    @property
    def height(self) -> Any:
        """The largest f, lam times which is the exponent of the leading exponential."""
        return self.contributions[0].height

    @property
    def omitted(self) -> Any:
        """The power sigma: the first term left out is of order lam^(-sigma)."""
        found = []
        for c in self.contributions:
            step = sympy.Rational(2 if c.side == "both" else 1, c.contact)
            found.append(c.exponents[-1] + step)
        return sympy.Min(*found)

    @property
    def error_kind(self) -> str:
        """``"bound"`` if the error is proved, ``"estimate"``; ``"none"`` with parameters free."""
        return "none" if self._errors is None else self._errors.kind

    @property
    def bound(self) -> tuple[Any, Any, Any] | None:
        """(K, sigma, lam0), or None where nothing is proved.

        For lam >= lam0, the integral differs from the expansion by at most
        K lam^(-sigma) e^(lam height).
        """
        if self._errors is None or self.order == "optimal":
            return None
        return self._errors.statement(int(self.order), self.omitted)

    def bind(self, **values: Any) -> LaplaceExpansion:
        """The expansion with numbers for parameters; its error is then known too.

        Raises
        ------
        InputError
            For a name that is not a parameter.
        """
        return self._again(*self._with_numbers(values), self.order)

    def evaluate(
        self, lam: Any, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum of the terms at `lam`.

        Parameters
        ----------
        lam : number or array_like
            Greater than 0.
        dps : int, optional
            Digits of the sum, as mpf. None: float64, vectorised.
        log : bool
            Natural logarithm, finite where the value overflows.
        full : bool
            An `Estimate`: its error is that of the sum as a value of the integral.

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
            For the logarithm of a sum that is not positive, or not surely; for more digits than
            rounded coefficients have.
        """
        self._require_bound()
        if dps is not None:
            if is_array(lam):
                raise InputError(
                    f"lam is an array and dps is {dps}; arrays are for float64 (dps=None)."
                )
            return self._by_digits(lam, digits(dps), log, full)
        if is_array(lam):
            values = floats("lam", lam)
            if not (values > 0).all():
                raise InputError(f"lam is {values.min():.6g}; it must be greater than 0.")
            if not full and self.order != "optimal":
                return self._by_arrays(values, log)
            found = [self._by_float(y, log, full) for y in values.ravel()]
            if not full:
                return np.array(found).reshape(values.shape)
            value, error = (
                np.array([getattr(e, name) for e in found]).reshape(values.shape)
                for name in ("value", "error")
            )
            kinds: set[ErrorKind] = {e.error_kind for e in found}
            kind: ErrorKind = kinds.pop() if len(kinds) == 1 else "estimate"
            return Estimate(value, error, kind, "laplace", *self._told(found[0]))
        return self._by_float(lam, log, full)

    def _by_arrays(self, lam: FloatArray, log: bool) -> FloatArray:
        """All lam at once; those where float64 would cancel one by one."""
        flat = lam.ravel()
        top, rest = _split(number(self.height))
        total, sizes = np.zeros_like(flat), np.zeros_like(flat)
        with np.errstate(under="ignore"):
            for c in self.contributions:
                height = float(difference(number(c.height), number(self.height)))
                exponents, coefficients = c.numbers(_FLOAT_DIGITS)
                weight = np.exp(flat * height)
                for s, k in zip(exponents, coefficients, strict=True):
                    term = weight * (float(k) * flat ** -float(s))
                    total += term
                    sizes += np.abs(term)
        # What lam times the height loses in its last place would be relative in the value.
        product, lost = two_product(flat, np.full_like(flat, top))
        lost = lost + flat * rest
        with np.errstate(all="ignore"):
            logs = product + (lost + np.log(np.abs(total)))
            found = logs if log else np.exp(product) * (1 + np.expm1(lost)) * total
        plain = (total >= 0.1 * sizes) & (np.abs(product) < 700) & (np.abs(logs) < 700)
        if log:
            plain = (total >= 0.1 * sizes) & np.isfinite(logs)
        for k in np.flatnonzero(~plain):
            found[k] = self._by_float(float(flat[k]), log, False)
        return np.asarray(found.reshape(lam.shape))

    def _told(self, found: Estimate) -> tuple[Any, ...]:
        return found.order, found.terms, found.dropped

    def _by_float(self, lam: Any, log: bool, full: bool) -> Any:
        found = self._by_digits(lam, _FLOAT_DIGITS, log, full)
        value = found.value if full else found
        if not log and value:
            with own_context(15) as context:
                size = float(context.log(abs(context.make_mpf(value._mpf_))))
            if not -708.39 < size < 709.78:
                raise RangeError(
                    f"the integral's logarithm is {size:.6g}, beyond float64; "
                    "pass log=True or dps=…."
                )
        if not full:
            return float(value)
        rounded, error = float_with_error(value, found.error)
        return Estimate(rounded, error, found.error_kind, "laplace", *self._told(found))

    def _by_digits(self, lam: Any, dps: int, log: bool, full: bool) -> Any:
        assert self._errors is not None
        rational = exact("lam", lam)
        if rational <= 0:
            raise InputError(f"lam is {float_text(rational)}; it must be greater than 0.")
        for c in self.contributions:
            if not c.exact and dps > self._errors.digits - 10:
                raise AccuracyError(
                    f"dps is {dps}, but the coefficients were computed to {self._errors.digits} "
                    "digits; pass dps=… to laplace_integral."
                )
        with own_context(dps + 30) as context:
            large = mpf_of(rational, context)
            more = dps + 30 + max(0, int(context.log10(large)))
            context.dps = more
            large = mpf_of(rational, context)
            top = context.make_mpf(number(self.height, dps=more)._mpf_)
            total, orders = context.mpf(0), []
            for c in self.contributions:
                terms = self._terms(c, large, more, context)
                used = len(terms)
                if self.order == "optimal":
                    sizes = [abs(t) if t else context.inf for t in terms]
                    used = max(1, sizes.index(min(sizes)))
                orders.append(used)
                height = context.make_mpf(number(c.height, dps=more)._mpf_)
                total += context.exp(large * (height - top)) * context.fsum(terms[:used])
            error, kind = context.mpf(0), self._errors.kind
            if full:
                error, kind = self._errors.relative(large, orders, total, context)
            if not isinstance(self.height, sympy.Basic):
                # A rounded height, times lam, is an error of the exponent.
                error += abs(total * large * top) * context.mpf(10) ** -(self._errors.digits + 8)
            # The last digit's rounding is an error of the printed value too.
            error += abs(total) * context.mpf(10) ** -(dps + 5)
            if log:
                if total <= error:
                    raise AccuracyError(
                        f"the sum at lam = {float_text(rational)} is not surely positive, so its "
                        "logarithm is not known; ask for the value, or for a larger lam."
                    )
                exact_value = large * top + context.log(total)
                error = -context.log1p(-error / total)
            else:
                scale = context.exp(large * top)
                exact_value, error = scale * total, scale * error
            value = to_mpf(exact_value, dps)
            if not full:
                return value
            error += abs(exact_value - context.make_mpf(value._mpf_))
            shown = to_mpf(error * (1 + context.mpf(10) ** -10), 15)
        return Estimate(value, shown, kind, "laplace", max(orders), self._named(), self.dropped)

    @staticmethod
    def _terms(c: Contribution, lam: Any, dps: int, context: Any) -> list[Any]:
        exponents, coefficients = c.numbers(dps)
        pairs = zip(exponents, coefficients, strict=True)
        return [context.make_mpf(k._mpf_) * lam ** -context.make_mpf(s._mpf_) for s, k in pairs]

    def _named(self) -> tuple[str, ...]:
        return tuple(
            f"{self.x} = {short(c.point)} ({c.side}): {len(c.coefficients)} terms"
            for c in self.contributions
        )

    def expression(self, lam: Any = "lam") -> Any:
        """The sum as a SymPy expression in `lam` (a symbol or a name)."""
        symbol = sympy.Symbol(lam, positive=True) if isinstance(lam, str) else lam
        total = sympy.Integer(0)
        for c in self.contributions:
            pairs = zip(c.exponents, c.coefficients, strict=True)
            inner = sympy.Add(*(_sympy(k) * symbol**-s for s, k in pairs))
            total += sympy.exp(symbol * _sympy(c.height)) * inner
        return total

    def latex(self, lam: str = "lambda") -> str:
        """The expansion with its O term, in LaTeX."""
        symbol = sympy.Symbol(lam, positive=True)
        size = sympy.exp(symbol * _sympy(self.height)) * symbol**-self.omitted
        text = str(sympy.latex(self.expression(symbol)))
        return text + r" + O\left(" + str(sympy.latex(size)) + r"\right)"

    def __str__(self) -> str:
        lines = []
        for c in self.contributions:
            height = short(c.height)
            pairs = list(zip(c.exponents, c.coefficients, strict=True))
            shown = [f"({short(k)}) lam^(-{_bare(s)})" for s, k in pairs[:6] if k != 0]
            more = " + ..." if len(pairs) > 6 else ""
            lines.append(f"e^(lam ({height})) [{' + '.join(shown) or '0'}{more}]")
        size = f"e^(lam ({short(self.height)})) lam^(-{_bare(self.omitted)})"
        lines.append(f"O({size}); error: {self._error_text()}")
        return "\n+ ".join(lines)

    def __repr__(self) -> str:
        return f"LaplaceExpansion({self})"

    def _error_text(self) -> str:
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


def _sympy(value: Any) -> Any:
    if isinstance(value, sympy.Basic):
        return value
    return (
        sympy.Float(value._mpf_, _SHOWN_DIGITS) if hasattr(value, "_mpf_") else sympy.sympify(value)
    )


def _split(value: Any) -> tuple[float, float]:
    """A number as the sum of two floats."""
    rational = exact("f", value)
    head = float(rational)
    return head, float(rational - Fraction(head))


def short(value: Any) -> str:
    if isinstance(value, sympy.Basic):
        return str(value)
    from mpmath import nstr

    return str(nstr(value, 12))


def _bare(value: Any) -> str:
    text = str(value)
    return text if value.is_Integer or value.is_Symbol else f"({text})"
