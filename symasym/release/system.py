"""A switch whose state moves while it sticks: the scaled equations of u and of a slow variable z.

In units of eps (lengths across the switch, and times) the whole system of eq:genPerturbed with one
slow variable is

    du = phi(u, z, y) dt + kappa dW,    dz = eps g(u, z, y) dt,    y = eps u,

where u stands for the smoothed switch alone and is cut to [-1, 1] in it, and y for the physical
distance. Freezing z and y = 0 gives the scalar equation of section 4 of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import (
    FloatArray,
    Number,
    Numbers,
    exact,
    float_text,
    positive,
    shown,
)
from symasym.drift.drift import Drift
from symasym.drift.evaluate import of_arrays
from symasym.drift.landscape import drag_time

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sympy import Expr

    from symasym.drift.reduction import Reduction

__all__ = ["System", "oscillator"]


@dataclass(frozen=True)
class System:
    """A smoothed switch with one slow variable z, a clock where its velocity keeps its sign.

    Parameters
    ----------
    phi : SymPy expression or str
        Velocity across the switch, in u (the switch's argument, from -1 to 1), z and y = eps u.
    velocity : SymPy expression or str
        Velocity g of z in physical time, in the same.
    noise : SymPy expression or str, optional
        The factor sigma(u) of the noise (Ito), above 0: du = phi dt + kappa sigma dW.

    Raises
    ------
    InputError
        If an expression has another symbol.

    Examples
    --------
    >>> import symasym as sa
    >>> from symasym.release.system import System
    >>> System("1 - z - y - u - 3*(u - u**3)", "y - 1") == sa.oscillator(mu=3, alpha=1)
    True
    """

    phi: Any
    velocity: Any
    noise: Any = "1"
    _symbols: dict[str, Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        import sympy

        from symasym.drift import expressions

        symbols = {name: sympy.Symbol(name) for name in ("u", "z", "y")}
        object.__setattr__(self, "_symbols", symbols)
        for name in ("phi", "velocity", "noise"):
            read = expressions.parse(name, getattr(self, name))
            read = read.xreplace({s: sympy.Symbol(s.name) for s in read.free_symbols})
            unknown = sorted(s.name for s in read.free_symbols if s.name not in symbols)
            if unknown:
                raise InputError(
                    f"{name} has the symbol {unknown[0]}, which has no value; give an expression "
                    "in u, z and y with numbers for all else."
                )
            object.__setattr__(self, name, sympy.expand(read))
        if not self.noise.free_symbols <= {symbols["u"]}:
            raise InputError(f"noise is {self.noise}; give an expression in u alone.")
        factor = self.noise_at(np.linspace(-1.0, 1.0, 201))
        if not (factor > 0.0).all():
            raise InputError(
                f"noise is {self.noise}, which comes down to {factor.min():.3g} in the layer; give "
                "an expression that stays above 0."
            )

    @classmethod
    def of(
        cls,
        reduction: Reduction,
        slow: str,
        across: str,
        at: Mapping[str, Number] | None = None,
    ) -> System:
        """The system of a reduction in which one coordinate moves and the others stay.

        Parameters
        ----------
        reduction : Reduction
            From `symasym.reduce`; kappa is to be multiplied by its amplitude.
        slow : str
            The coordinate that becomes z.
        across : str
            The coordinate that is the switch h.
        at : mapping
            The other coordinates and parameters, name -> number.

        Raises
        ------
        InputError
            If a name is no coordinate, or a value is missing.

        Examples
        --------
        >>> import symasym as sa
        >>> reduction = sa.reduce(
        ...     ("1 - z - y + alpha", "y - 1"), ("1 - z - y - alpha", "y - 1"),
        ...     ("1 - z - y - alpha*(s + 3*(s - s**3))", "y - 1"), ((1,), (0,)), ("y", "z"))
        >>> sa.System.of(reduction, "z", "y", {"alpha": 1}) == sa.oscillator(mu=3, alpha=1)
        True
        """
        import sympy

        from symasym.drift.reduction import Reduction, numbers_of

        if not isinstance(reduction, Reduction):
            raise InputError(f"reduction is {shown(reduction)}; give what sa.reduce returns.")
        values = numbers_of("at", {} if at is None else at)
        names = [str(c) for c in reduction.coordinates]
        for name, given in (("slow", slow), ("across", across)):
            alike = isinstance(across, str) and slow == across
            if not isinstance(given, str) or given not in names or alike:
                raise InputError(
                    f"{name} is {shown(given)}; give two different coordinates out of "
                    f"{', '.join(names)}."
                )
        put: dict[Any, Any] = {reduction.layer: sympy.Symbol("u")}
        expressions = reduction.normal_inside, reduction.inside[names.index(slow)]
        for symbol in set().union(*(e.free_symbols for e in expressions)) - {reduction.layer}:
            if symbol.name in (slow, across):
                put[symbol] = sympy.Symbol("z" if symbol.name == slow else "y")
            elif symbol.name in values:
                put[symbol] = values[symbol.name]
            else:
                raise InputError(f"at has no value of {symbol.name}; give it a number there.")
        phi, velocity = (e.subs(put, simultaneous=True) for e in expressions)
        return cls(phi, velocity)

    def drag_time(self, z: Number, eps: Number) -> float:
        """Scaled time in which the motion of z changes a well at z by its depth.

        To first order: the depth of the drift between a well and its barrier, over the rate at
        which the motion of z changes it, up or down. A time T of the scalar equation at z describes
        the whole system only where it is far shorter. Infinite without a well that a barrier ends.

        Examples
        --------
        >>> import symasym as sa
        >>> block = sa.oscillator(mu=3, alpha=1)
        >>> round(block.drag_time("-0.4", "0.01"), 1)  # to the fold at -7/9
        37.8
        """
        at = float(exact("z", z))
        width = float(positive("eps", exact("eps", eps)))
        slope = System(self.phi.diff(self._symbols["z"]), self.velocity)
        return drag_time(
            self.frozen(z).critical_points(),
            lambda u: self.phi_at(u, at, 0.0),
            lambda u: width * slope.phi_at(u, at, 0.0) * self.velocity_at(u, at, 0.0),
        )

    @cached_property
    def drift(self) -> Drift:
        """The scalar drift with z a parameter and y = 0; refused where the noise depends on u."""
        if self.noise != 1:
            raise InputError(
                f"noise is {self.noise}, and the scalar equation with z frozen is for noise 1; "
                "take method='march' or 'simulate'."
            )
        return Drift(self.phi.subs(self._symbols["y"], 0), "u")

    def frozen(self, z: Numbers) -> Drift:
        """The scalar drift at z, which it need not depend on."""
        return self.drift.bind(z=z) if "z" in self.drift.parameters else self.drift

    def phi_at(self, u: FloatArray, z: Any, eps: float) -> FloatArray:
        """phi in float64 at scaled positions u and at z."""
        return self._at(self.phi, u, z, eps)

    def velocity_at(self, u: FloatArray, z: Any, eps: float) -> FloatArray:
        """g in float64 at scaled positions u and at z."""
        return self._at(self.velocity, u, z, eps)

    def noise_at(self, u: FloatArray) -> FloatArray:
        """sigma in float64 at scaled positions u."""
        return self._at(self.noise, u, 0.0, 0.0)

    def slope_in_y(self) -> System:
        """The system whose phi is the derivative of this one's in y."""
        return System(self.phi.diff(self._symbols["y"]), self.velocity)

    def _at(self, expression: Expr, u: FloatArray, z: Any, eps: float) -> FloatArray:
        """An expression's values, of the shape that u and z have together."""
        names = self._symbols
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            of = of_arrays(expression, (names["u"], names["z"], names["y"]))
            result = of(np.clip(u, -1.0, 1.0), z, eps * u)
        return np.asarray(result + 0.0 * (u + z), dtype=np.float64)


def oscillator(mu: Number, alpha: Number) -> System:
    """The paper's friction oscillator with its moving spring extension z (eq:osc3).

    Parameters
    ----------
    mu : number
        Shape of the friction force, at least 0.
    alpha : number
        Friction strength, greater than 0.

    Returns
    -------
    System
        phi = 1 - z - y - alpha (u + mu (u - u^3)) and velocity y - 1: z moves to the left while
        the block sticks.

    Raises
    ------
    InputError
        If mu < 0 or alpha <= 0.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.oscillator(mu=3, alpha=1).velocity
    y - 1
    """
    import sympy

    shape, strength = exact("mu", mu), positive("alpha", exact("alpha", alpha))
    if shape < 0:
        raise InputError(f"mu is {float_text(shape)}; it must be at least 0.")
    u, z, y = sympy.symbols("u z y")
    m, a = (sympy.Rational(x.numerator, x.denominator) for x in (shape, strength))
    return System(1 - z - y - a * (u + m * (u - u**3)), y - 1)
