"""What the expansions of an integral share: its parameters, its values at any lam, its formula."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
import sympy

from symasym.base.call_context import own_context, patient, symbolic
from symasym.base.errors import InputError, RangeError, SymasymError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import (
    FloatArray,
    digits,
    exact,
    flag,
    floats,
    is_array,
    is_name,
    positive,
    shown,
)
from symasym.derivation.printing import tex

if TYPE_CHECKING:
    from sympy import Expr, Symbol

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
