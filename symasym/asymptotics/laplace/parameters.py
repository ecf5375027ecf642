"""What every expansion of an integral of g e^(lam f) has: its parameters, and numbers for them."""

from __future__ import annotations

from typing import Any

import sympy

from symasym.base.errors import InputError
from symasym.base.inputs import exact


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
