"""The formulas of the ready-made drifts, and of one given as a SymPy expression.

A model knows the names of its parameters and evaluates A(u) in any
arithmetic; it holds no parameter values. Where A is a polynomial in u it also
gives its coefficients, which is what makes the fast engines fast.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from symasym.base.call_context import SIMPLER, limited, watched
from symasym.base.errors import InputError
from symasym.base.inputs import Number, count, exact
from symasym.numbers.trees import Operand, Operations, SympyOps, call, evaluate_tree, integer_power

Values = Mapping[str, Any]

# Waves, exponents and degrees beyond it make no switch that anybody has.
_MOST = 1_000
# Binary digits of a number that Python prints.
_LONGEST = 13_200


def unprintable(x: Any) -> bool:
    """True for a rational number of SymPy that has more digits than Python prints."""
    return max(int(abs(x.p)), int(x.q)).bit_length() > _LONGEST


@dataclass(frozen=True)
class Model:
    """Base of every model; `coefficients` is None where A is no polynomial.

    `positive` and `not_negative` name the parameters with such a range.
    """

    positive: ClassVar[tuple[str, ...]] = ()
    not_negative: ClassVar[tuple[str, ...]] = ()

    @property
    def name(self) -> str:
        """The class's name in small letters."""
        return type(self).__name__.lower()

    @property
    def shape(self) -> dict[str, int]:
        """The whole numbers that shape the formula, by the names that a caller gives them."""
        return {}

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        raise NotImplementedError

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """A(u), every parameter in `p` being of the type of `u`."""
        coefficients = self.coefficients(p, ops)
        assert coefficients is not None
        total = coefficients[-1]
        for coefficient in reversed(coefficients[:-1]):
            total = total * u + coefficient
        return total

    def coefficients(self, p: Values, ops: Operations) -> list[Any] | None:
        """Coefficients of A in ascending powers of u, or None."""
        return None

    def end(self, p: Values, side: int) -> Any:
        """A(side), side = -1 or 1, where the parameters give it without rounding, else None.

        Outside [-1, 1] an error in the drift is multiplied by the radius, and its
        sign is the region: sin(pi) must be 0 there, not 1e-16.
        """
        if "a_minus" in self.parameters:
            return p["a_minus" if side < 0 else "a_plus"]
        return None


@dataclass(frozen=True)
class Friction(Model):
    """Eq. (eq:phifric0): the friction oscillator's cubic."""

    parameters = ("mu", "alpha", "z0")
    positive = ("alpha",)
    not_negative = ("mu",)

    def coefficients(self, p: Values, ops: Operations) -> list[Any]:
        """The cubic's coefficients (eq:phifric0), of one type."""
        mu, alpha, z0 = p["mu"], p["alpha"], p["z0"]
        return [1 - z0, -alpha * (1 + mu), 0 * z0, alpha * mu]


@dataclass(frozen=True)
class Linear(Model):
    """The linear smoothing: A(u) joins a- and a+ by a straight line."""

    parameters = ("a_minus", "a_plus")

    def coefficients(self, p: Values, ops: Operations) -> list[Any]:
        """(a+ + a-)/2 and (a+ - a-)/2."""
        return [(p["a_plus"] + p["a_minus"]) / 2, (p["a_plus"] - p["a_minus"]) / 2]


@dataclass(frozen=True)
class Polynomial(Model):
    """A(u) = c0 + c1 u + ... + cn u^n."""

    degree: int

    @property
    def parameters(self) -> tuple[str, ...]:
        return tuple(f"c{k}" for k in range(self.degree + 1))

    def coefficients(self, p: Values, ops: Operations) -> list[Any]:
        """The parameters themselves."""
        return [p[name] for name in self.parameters]


@dataclass(frozen=True)
class Sine(Model):
    """The linear smoothing plus b sin(k pi u), which vanishes at both ends."""

    waves: int

    @property
    def shape(self) -> dict[str, int]:
        return {"waves": self.waves}

    parameters = ("a_minus", "a_plus", "b")

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """(a+ + a-)/2 + (a+ - a-) u/2 + b sin(k pi u)."""
        middle, half = (p["a_plus"] + p["a_minus"]) / 2, (p["a_plus"] - p["a_minus"]) / 2
        return middle + half * u + p["b"] * call(ops, "sin", u * (self.waves * ops.pi()))


@dataclass(frozen=True)
class Tanh(Model):
    """A sigmoid of slope `steepness`, scaled to meet a- and a+ exactly."""

    parameters = ("a_minus", "a_plus", "steepness")
    positive = ("steepness",)

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """(a+ + a-)/2 + (a+ - a-)/2 tanh(s u)/tanh(s), s the steepness."""
        middle, half = (p["a_plus"] + p["a_minus"]) / 2, (p["a_plus"] - p["a_minus"]) / 2
        slope = p["steepness"]
        return middle + half * (call(ops, "tanh", u * slope) / call(ops, "tanh", slope))


@dataclass(frozen=True)
class Hill(Model):
    """The Hill function x^n (1 + K^n)/(K^n + x^n) of x = (1+u)/2, from a- to a+."""

    n: int

    @property
    def shape(self) -> dict[str, int]:
        return {"n": self.n}

    parameters = ("a_minus", "a_plus", "K")
    positive = ("K",)

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """a- + (a+ - a-) x^n (1 + K^n)/(K^n + x^n), x = (1+u)/2."""
        x_n = integer_power((u + 1) / 2, self.n)
        k_n = integer_power(p["K"], self.n)
        switch = (x_n * (k_n + 1)) / (x_n + k_n)
        return p["a_minus"] + (p["a_plus"] - p["a_minus"]) * switch


@dataclass(frozen=True)
class Expression(Model):
    """A SymPy expression `formula` in the symbol `u`; its other symbols are parameters."""

    formula: Any
    u: Any

    @property
    def parameters(self) -> tuple[str, ...]:
        return tuple(self.symbols)

    @cached_property
    def symbols(self) -> dict[str, Any]:
        """The parameters' symbols by name; SymPy walks the whole formula for them."""
        free = self.formula.free_symbols - {self.u}
        return {s.name: s for s in sorted(free, key=lambda s: s.name)}

    @cached_property
    def canonical(self) -> Any:
        """The formula as it is read back from its text, whatever way it came here."""
        from symasym.drift import grammar

        formula = self.formula
        # SymPy multiplies some sums out as it reads them, after which they stay.
        for _ in range(3):
            try:
                again = grammar.read("A", str(formula))
            except InputError:
                break
            if again == formula:
                break
            formula = again
        return formula

    def _values(self, p: Values) -> dict[Any, Any]:
        """The parameters' values by symbol."""
        return {symbol: p[name] for name, symbol in self.symbols.items()}

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """The formula by its tree, exact until the arithmetic rounds; a constant of u's shape."""
        return evaluate_tree(self.formula, {self.u: u, **self._values(p)}, ops) + 0 * u

    def end(self, p: Values, side: int) -> Any:
        """A(side) where it is rational, by SymPy; else None."""
        import sympy

        values = self._values(p)
        if not all(isinstance(v, Fraction) for v in values.values()):
            return None
        rationals = {s: sympy.Rational(v.numerator, v.denominator) for s, v in values.items()}
        value = self.formula.subs({self.u: side, **rationals})
        terms = [abs(term.evalf(15)) for term in sympy.Add.make_args(value)]
        # Simplifying can take minutes; only a sum that seems to vanish is worth it.
        vanishes = not value.is_Rational and abs(value.evalf(15)) < 1e-12 * max(terms)
        if vanishes and not any(map(unprintable, value.atoms(sympy.Rational))):
            value = sympy.simplify(value)
        return Fraction(int(value.p), int(value.q)) if value.is_Rational else None

    @cached_property
    def powers(self) -> list[Any] | None:
        """Coefficients of A in ascending powers of u, by SymPy; None where A is no polynomial."""
        import sympy

        with limited(way_out=SIMPLER), watched():
            poly = self.formula.as_poly(self.u)
            return None if poly is None else [sympy.sympify(c) for c in poly.all_coeffs()[::-1]]

    def coefficients(self, p: Values, ops: Operations) -> list[Any] | None:
        """Coefficients in powers of u where SymPy finds A a polynomial, else None."""
        if self.powers is None:
            return None
        return [evaluate_tree(c, self._values(p), ops) for c in self.powers]


@dataclass(frozen=True)
class General(Model):
    """No drift in particular: A stays the function ``A(u)``, in formulas alone."""

    name = "Drift.general"
    parameters = ()

    def evaluate(self, u: Operand, p: Values, ops: Operations) -> Any:
        """A(u) as SymPy's undefined function; no number."""
        if isinstance(ops, SympyOps):
            import sympy

            return sympy.Function("A", real=True)(u)
        raise InputError(
            "Drift.general() names no drift and has no numbers; give one such as sa.friction()."
        )


def check_count(name: str, value: Number) -> int:
    """A whole number from 1 on that shapes a model (waves of a sine, exponent of a Hill switch)."""
    number = exact(name, value)
    return count(name, int(number) if number.denominator == 1 else value, 1, _MOST)
