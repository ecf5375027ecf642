"""The formulas of the ready-made drifts, and of one given as a SymPy expression.

A model holds no parameter values. It evaluates A(u) in the arithmetic of its arguments: `ops` has
the functions of that arithmetic, and pi (`symasym.drift.evaluate`). Where A is a polynomial in u
the model has its coefficients as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from symasym.base.errors import InputError
from symasym.base.estimate import number_repr
from symasym.base.inputs import exact, float_text

Values = Mapping[str, Any]
_MOST_SHOWN = 1000  # values of an array


@dataclass(frozen=True)
class Model:
    """Base of every model; `positive` and `not_negative` name the parameters with such a range."""

    parameters: ClassVar[tuple[str, ...]] = ()
    positive: ClassVar[tuple[str, ...]] = ()
    not_negative: ClassVar[tuple[str, ...]] = ()
    #: A holds on [-1, 1], and outside its values at the ends; the noise is constant.
    plain = layered = True
    cuts: ClassVar[Any] = ()
    noise: ClassVar[Any] = None
    alpha: ClassVar[Any] = Fraction(0)

    @property
    def pieces(self) -> tuple[Model, ...]:
        """The formulas from left to right."""
        return (self,)

    @property
    def name(self) -> str:
        """The class's name in small letters."""
        return type(self).__name__.lower()

    def source(self, values: Values) -> str:
        """The call that makes a drift of it with these values of its parameters."""
        shape = [f"{name}={value}" for name, value in vars(self).items()]
        return f"sa.{self.name}({', '.join(_texts(values) + shape)})"

    def evaluate(self, u: Any, p: Values, ops: Any) -> Any:
        """A(u) with the parameters p."""
        *rest, total = self.coefficients(p) or [0]
        for coefficient in reversed(rest):
            total = total * u + coefficient
        return total

    def coefficients(self, p: Values) -> list[Any] | None:
        """Coefficients of A in ascending powers of u; None where A is no polynomial."""
        return None

    def end(self, p: Values, side: int) -> Any:
        """A(side), side = -1 or 1, where the parameters give it without rounding, else None.

        Outside [-1, 1] an error in the drift is multiplied by the radius, and its sign is the
        region: sin(pi) must be 0 there, not 1e-16.
        """
        return p["a_minus" if side < 0 else "a_plus"] if "a_minus" in self.parameters else None


@dataclass(frozen=True)
class Friction(Model):
    """The friction oscillator's cubic (eq:phifric0)."""

    parameters = ("mu", "alpha", "z0")
    positive = ("alpha",)
    not_negative = ("mu",)

    def coefficients(self, p: Values) -> list[Any]:
        """Of 1 - z0 - alpha ((1 + mu) u - mu u^3)."""
        force = p["alpha"] * p["mu"]
        return [1 - p["z0"], -(p["alpha"] + force), 0 * force, force]


@dataclass(frozen=True)
class Linear(Model):
    """The linear smoothing: A(u) joins a- and a+ by a straight line."""

    parameters: ClassVar[tuple[str, ...]] = ("a_minus", "a_plus")

    def coefficients(self, p: Values) -> list[Any]:
        """(a+ + a-)/2 and (a+ - a-)/2."""
        return [(p["a_plus"] + p["a_minus"]) / 2, (p["a_plus"] - p["a_minus"]) / 2]


@dataclass(frozen=True)
class Polynomial(Model):
    """A(u) = c0 + c1 u + ... + cn u^n."""

    degree: int

    @property
    def parameters(self) -> tuple[str, ...]:  # type: ignore[override]
        """The coefficients' names."""
        return tuple(f"c{k}" for k in range(self.degree + 1))

    def source(self, values: Values) -> str:
        """In order where all are known."""
        known = len(values) > self.degree
        texts = map(_text, values.values()) if known else _texts(values)
        return f"sa.polynomial({', '.join(texts)})"

    def coefficients(self, p: Values) -> list[Any]:
        """The parameters themselves."""
        return [p[name] for name in self.parameters]


@dataclass(frozen=True)
class Sine(Linear):
    """The linear smoothing plus b sin(k pi u), which vanishes at both ends."""

    waves: int

    parameters: ClassVar[tuple[str, ...]] = ("a_minus", "a_plus", "b")

    def evaluate(self, u: Any, p: Values, ops: Any) -> Any:
        """(a+ + a-)/2 + (a+ - a-) u/2 + b sin(k pi u)."""
        middle, half = Linear.coefficients(self, p)
        return middle + half * u + p["b"] * ops.sin(u * (self.waves * ops.pi()))

    def coefficients(self, p: Values) -> None:  # type: ignore[override]
        """It is no polynomial."""


@dataclass(frozen=True)
class Tanh(Linear):
    """A sigmoid of slope `steepness`, scaled to meet a- and a+ exactly."""

    parameters: ClassVar[tuple[str, ...]] = ("a_minus", "a_plus", "steepness")
    positive = ("steepness",)

    def evaluate(self, u: Any, p: Values, ops: Any) -> Any:
        """(a+ + a-)/2 + (a+ - a-)/2 tanh(s u)/tanh(s), s the steepness."""
        middle, half = Linear.coefficients(self, p)
        return middle + half * (ops.tanh(u * p["steepness"]) / ops.tanh(p["steepness"]))

    def coefficients(self, p: Values) -> None:  # type: ignore[override]
        """It is no polynomial."""


@dataclass(frozen=True)
class Hill(Model):
    """The Hill function x^n (1 + K^n)/(K^n + x^n) of x = (1+u)/2, from a- to a+."""

    n: int

    parameters = ("a_minus", "a_plus", "K")
    positive = ("K",)

    def evaluate(self, u: Any, p: Values, ops: Any) -> Any:
        """a- + (a+ - a-) x^n (1 + K^n)/(K^n + x^n), x = (1+u)/2."""
        x, k = ((u + 1) / 2) ** self.n, p["K"] ** self.n
        return p["a_minus"] + (p["a_plus"] - p["a_minus"]) * ((x * (k + 1)) / (x + k))


@dataclass(frozen=True)
class Expression(Model):
    """A SymPy expression `formula` in the symbol `u`; its other symbols are parameters.

    `symasym.drift.evaluate` makes functions of it.
    """

    formula: Any
    u: Any

    @property
    def parameters(self) -> tuple[str, ...]:  # type: ignore[override]
        """The symbols' names."""
        return tuple(self.symbols)

    @cached_property
    def symbols(self) -> dict[str, Any]:
        """The parameters' symbols by name; SymPy walks the whole formula for them."""
        free = self.formula.free_symbols - {self.u}
        return {s.name: s for s in sorted(free, key=lambda s: s.name)}

    @cached_property
    def powers(self) -> list[Any] | None:
        """Coefficients of A in ascending powers of u, by SymPy; None where A is no polynomial."""
        import sympy

        poly = self.formula.as_poly(self.u)
        return None if poly is None else [sympy.sympify(c) for c in poly.all_coeffs()[::-1]]

    def coefficients(self, p: Values) -> list[Any] | None:
        """The same where they are rational."""
        import sympy

        if self.powers is None:
            return None
        put = {s: sympy.Rational(*p[n].as_integer_ratio()) for n, s in self.symbols.items()}
        found = [c.subs(put) for c in self.powers]
        rational = all(c.is_Rational for c in found)
        return [Fraction(int(c.p), int(c.q)) for c in found] if rational else None

    def source(self, values: Values) -> str:
        """`Drift` and `bind`."""
        other = "" if self.u.name == "u" else f", {self.u.name!r}"
        return f"sa.Drift({str(self.formula)!r}{other}){_bound(values)}"

    def end(self, p: Values, side: int) -> Any:
        """A(side) where it is rational, by SymPy; else None."""
        import sympy

        if not all(isinstance(x, Fraction) for x in p.values()):
            return None
        put = {s: sympy.Rational(p[n].numerator, p[n].denominator) for n, s in self.symbols.items()}
        value = self.formula.subs({self.u: side, **put})
        terms = [abs(term.evalf(15)) for term in sympy.Add.make_args(value)]
        # Simplifying can take seconds; only a sum that seems to vanish is worth it.
        if not value.is_Rational and abs(value.evalf(15)) < 1e-12 * max(terms):
            value = sympy.simplify(value)
        return Fraction(int(value.p), int(value.q)) if value.is_Rational else None


@dataclass(frozen=True, kw_only=True)
class Pieces(Model):
    """phi of several pieces, or of noise that depends on u; without a layer they hold everywhere.

    Attributes
    ----------
    models : tuple of Model
        From left to right.
    cuts : tuple of Fraction
        The places between them.
    noise : Model or None
        sigma of du = phi dt + kappa sigma dW; None for 1.
    alpha : Fraction
        0 by Ito, 1/2 by Stratonovich.
    layered : bool
        One piece, which holds on [-1, 1], as does sigma; outside are their values at the ends.
    """

    models: tuple[Expression, ...]
    cuts: tuple[Fraction, ...]  # type: ignore[misc]
    noise: Expression | None  # type: ignore[misc]
    alpha: Fraction  # type: ignore[misc]
    layered: bool
    plain = False

    @property
    def pieces(self) -> tuple[Model, ...]:
        """The models."""
        return self.models

    @property
    def parameters(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those of all pieces and of sigma."""
        every = [*self.models, self.noise] if self.noise else self.models
        return tuple(dict.fromkeys(name for model in every for name in model.parameters))

    def source(self, values: Values) -> str:
        """`Drift` or `Drift.piecewise`, and `bind`."""
        texts = [repr(str(part.formula)) for part in self.models]
        ends = [*map(number_repr, self.cuts), "None"]
        pairs = ", ".join(f"({a}, {b})" for a, b in zip(texts, ends, strict=True))
        options = [f"[{pairs}]" if self.cuts else texts[0]]
        if (u := self.models[0].u.name) != "u":
            options.append(repr(u))
        if not self.layered and not self.cuts:
            options.append("layer=None")
        if self.noise:
            options.append(f"noise={str(self.noise.formula)!r}")
        if self.alpha:
            options.append("ito='stratonovich'")
        made = f"sa.Drift{'.piecewise' if self.cuts else ''}({', '.join(options)})"
        return made + _bound(values)

    def end(self, p: Values, side: int) -> Any:
        """A(side) of a layer."""
        of = self.models[0]
        return of.end({name: x for name, x in p.items() if name in of.parameters}, side)


@dataclass(frozen=True)
class General(Model):
    """No drift in particular: A stays the function ``A(u)``, in formulas alone."""

    name = "Drift.general"

    def evaluate(self, u: Any, p: Values, ops: Any) -> Any:
        """A(u) as SymPy's undefined function; no number."""
        import sympy

        if not isinstance(u, sympy.Expr):
            raise InputError(
                "Drift.general() names no drift and has no numbers; give one such as sa.friction()."
            )
        return sympy.Function("A", real=True)(u)


def _text(value: Any) -> str:
    """Python source of a parameter's value; long arrays are shortened."""
    if isinstance(value, Fraction):
        return number_repr(value)
    if value.size > _MOST_SHOWN:
        return f"<{value.size} values from {value.min():.6g} to {value.max():.6g}>"
    return str(value.tolist())


def _texts(values: Values) -> list[str]:
    return [f"{name}={_text(value)}" for name, value in values.items()]


def _bound(values: Values) -> str:
    return f".bind({', '.join(_texts(values))})" if values else ""


def check_range(model: Model, name: str, value: Any) -> None:
    """Raise InputError for a value outside its parameter's range."""
    strict = name in model.positive
    if strict or name in model.not_negative:
        lowest = value if isinstance(value, Fraction) else value.min()
        if lowest < 0 or (strict and lowest == 0):
            rule = "greater than 0" if strict else "at least 0"
            raise InputError(f"{name} is {float_text(exact(name, lowest))}; it must be {rule}.")
