"""The data of a drift (formulas, noise, known parameter values) and the call that recreates it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from symasym.base.balls import cached_property
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import number_text
from symasym.base.inputs import common_shape, floats, is_array
from symasym.drift.formula import Formula, interned

_MOST_SHOWN = 1000  # the longest array that is printed in full


@dataclass(frozen=True, kw_only=True)
class Model:
    """A drift without the values of its parameters.

    For a ready-made drift, `name` is the function that returns it, `shape` the name and value of
    the integer argument of that function, and `ordered` are the parameters in order.
    """

    #: The formulas from left to right, and the points that separate them.
    pieces: tuple[Formula, ...]
    cuts: tuple[Fraction, ...] = ()
    #: sigma in du = phi dt + kappa sigma dW (None for 1); alpha is 0 for Itô, 1/2 for Stratonovich.
    noise: Formula | None = None
    alpha: Fraction = Fraction(0)
    #: True if the one piece and sigma hold on [-1, 1], and are constant outside (continuously).
    layered: bool = True
    name: str = ""
    shape: tuple[str, int] | None = None
    ordered: tuple[str, ...] = ()
    #: The parameters that must be greater than 0, and those that must be at least 0.
    positive: tuple[str, ...] = ()
    not_negative: tuple[str, ...] = ()

    @property
    def plain(self) -> bool:
        """True for the paper's drifts: constant outside the layer, with noise independent of u."""
        return self.layered and not self.noise

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters of all pieces and of sigma."""
        every = [*self.pieces, self.noise] if self.noise else self.pieces
        return self.ordered or tuple(dict.fromkeys(name for of in every for name in of.symbols))

    @cached_property
    def weighted(self) -> list[list[Formula]]:
        """Of each piece A/sigma^2 and, if the noise depends on u, log sigma."""
        if self.noise is None:
            return [[of] for of in self.pieces]
        s = self.noise.expression
        rows = [(of.expression / s**2, sympy.log(s)) for of in self.pieces]
        return [[interned(e, of.u) for e in row] for of, row in zip(self.pieces, rows, strict=True)]

    def expression(self, values: Mapping[str, Any]) -> Any:
        """phi(u) in the real symbol u; for a drift with a layer, A(u)."""
        parts = [of.with_values(values) for of in self.pieces]
        if not self.cuts:
            return parts[0]
        ends = [sympy.Rational(*x.as_integer_ratio()) for x in self.cuts]
        u = sympy.Symbol("u", real=True)
        return sympy.Piecewise(*zip(parts, [*(u < x for x in ends), True], strict=True))

    def source(self, values: Mapping[str, Any]) -> str:
        """The call that returns the drift with this model and these values of its parameters."""
        texts = [f"{x}={_text(values[x])}" for x in self.parameters if x in values]
        if self.name == "polynomial":  # its coefficients are positional arguments
            texts = [_text(values[x]) for x in self.parameters]
        if self.shape:
            texts.append("{}={}".format(*self.shape))
        if self.name:
            return f"sa.{self.name}({', '.join(texts)})"
        pieces = [repr(str(of.expression)) for of in self.pieces]
        ends = [*map(_text, self.cuts), "None"]
        pairs = ", ".join(f"({a}, {b})" for a, b in zip(pieces, ends, strict=True))
        options = [f"[{pairs}]" if self.cuts else pieces[0]]
        if (u := self.pieces[0].u.name) != "u":
            options.append(repr(u))
        if not self.layered and not self.cuts:
            options.append("layer=None")
        if self.noise:
            options.append(f"noise={str(self.noise.expression)!r}")
        if self.alpha:
            options.append("ito='stratonovich'")
        made = f"sa.Drift{'.piecewise' if self.cuts else ''}({', '.join(options)})"
        return f"{made}.bind({', '.join(texts)})" if texts else made


def _text(value: Any) -> str:
    """The Python source of a parameter's value: an int, a float or a text if it is exactly that;
    long arrays are abbreviated."""
    if isinstance(value, Fraction):
        if value.denominator == 1 and abs(value) < 10**16:
            return str(value)
        return repr(float(value) if Fraction(float(value)) == value else number_text(value))
    if value.size > _MOST_SHOWN:
        return f"<{value.size} values from {value.min():.6g} to {value.max():.6g}>"
    return str(value.tolist())


class Parametrized:
    """A model with the known values of its parameters; the base class of `symasym.Drift`.

    The modules that evaluate a drift depend on this class, and `symasym.Drift` depends on them.
    """

    model: Model
    _values: dict[str, Any]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of all parameters, bound or free."""
        names: tuple[str, ...] = self.model.parameters
        return names

    @cached_property
    def free(self) -> tuple[str, ...]:
        """The names of the parameters that have no value yet."""
        return tuple(name for name in self.parameters if name not in self._values)

    @property
    def values(self) -> dict[str, Any]:
        """The bound parameters, each a Fraction or a float64 array."""
        return dict(self._values)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The common shape of the parameters, () unless some are arrays."""
        return common_shape({k: np.shape(v) for k, v in self._values.items() if is_array(v)})

    def scalars(self) -> dict[str, Fraction]:
        """The exact parameter values; raises InputError if some are free or arrays."""
        self.require_bound()
        for name, value in self._values.items():
            if is_array(value):
                raise InputError(
                    f"{name} is an array, but a single value is required; pass one value at a "
                    "time, or omit dps and full."
                )
        return self._values

    def require_bound(self) -> None:
        """Raise InputError unless A is specified and every parameter has a value."""
        if self.model.name == "Drift.general":
            raise InputError(
                f"{self!r} names no drift and has no numbers; give one such as friction."
            )
        if self.free:
            raise InputError(
                f"no value is set for {', '.join(self.free)}; set each parameter of the drift by "
                "bind (in a shell, --set)."
            )

    def exact_coefficients(self) -> list[Fraction] | None:
        """The coefficients of A in ascending powers; None unless it is a rational polynomial."""
        known = self.model.pieces[0].exact_coefficients(self.scalars())
        while known and len(known) > 1 and known[-1] == 0:
            known.pop()
        return known

    @cached_property
    def ends(self) -> tuple[Any, Any]:
        """The pair a-, a+: Fractions if they are rational, else floats; arrays of float64."""
        self.require_bound()
        if not self.model.layered:
            raise RegionError(f"{self!r} has no layer and therefore no a- and a+; give two ends.")
        if not self.shape:
            return self.model.pieces[0].ends(self._values)
        values = {name: floats(name, x) for name, x in self._values.items()}
        left, right = (self.model.pieces[0].end(k, values, balls=False) for k in (-1, 1))
        return np.broadcast_to(left, self.shape), np.broadcast_to(right, self.shape)

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Parametrized) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[Any, ...]:
        """The key by which drifts are compared and hashed."""
        return self.model, tuple(
            (name, (value.shape, value.tobytes()) if is_array(value) else value)
            for name, value in sorted(self._values.items())
        )

    def __repr__(self) -> str:
        """The call that returns this drift, with ``import symasym as sa``."""
        return self.model.source(self._values)
