"""A switch with a slow variable z that moves during sticking: the scaled equations of u and z.

In units of eps (lengths across the switch, and times) the whole system of eq:genPerturbed with one
slow variable is

    du = phi(u, z, y) dt + kappa dW,    dz = eps g(u, z, y) dt,    y = eps u,

where u stands for the smoothed switch alone and is cut to [-1, 1] in it, and y for the physical
distance. Freezing z and y = 0 gives the scalar equation of section 4 of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, Numbers, exact, positive, within
from symasym.drift.drift import Drift
from symasym.drift.formula import compiled


@dataclass(frozen=True)
class System:
    """A smoothed switch with one slow variable z, a clock if its velocity keeps its sign.

    Parameters
    ----------
    phi, velocity : SymPy expression or str
        Velocity across the switch and g, that of z in physical time, in u (the switch's argument,
        from -1 to 1), z and y = eps u.
    noise : SymPy expression or str, optional
        The factor sigma(u) of the noise (Itô), above 0: du = phi dt + kappa sigma dW.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.System("1 - z - y - u - 3*(u - u**3)", "y - 1") == sa.oscillator(mu=3, alpha=1)
    True
    """

    phi: Any
    velocity: Any
    noise: Any = "1"

    def __post_init__(self) -> None:
        import sympy

        from symasym.drift import expressions

        for name, known in (("phi", "u, z, y"), ("velocity", "u, z, y"), ("noise", "u")):
            read = expressions.parse(name, getattr(self, name))
            read = read.xreplace({s: sympy.Symbol(s.name) for s in read.free_symbols})
            unknown = sorted({s.name for s in read.free_symbols} - set(known.split(", ")))
            if unknown:
                raise InputError(f"{name} has the symbol {unknown[0]}; give it in {known} alone.")
            object.__setattr__(self, name, sympy.expand(read, power_exp=False))
        least = values(self.noise, np.linspace(-1.0, 1.0, 201)).min()
        if not least > 0.0:
            raise InputError(f"noise is {self.noise}, down to {least:.3g}; give one above 0.")

    def drag_time(self, z: Number, eps: Number) -> float:
        """The scaled time in which the motion of z changes the depth of a well by that depth.

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
        at, width = float(exact("z", z)), float(positive("eps", eps))
        rate, times = self.phi.diff("z") * self.velocity, [np.inf]
        for one, other in pairwise(self.frozen(z).critical_points()):
            low, high = float(one.u), float(other.u)
            # The depth is stationary there, so that three successive grids give it to rounding.
            for _ in range(3):
                u = np.linspace(low, high, 2001)
                depth = values(self.phi, u, at)
                k = int(np.argmax(np.abs(depth)))
                low, high = u[max(k - 1, 0)], u[min(k + 1, 2000)]
            change = width * values(rate, u, at)[k]
            if {one.kind, other.kind} == {"well", "barrier"} and change:
                times.append(abs(depth[k] / change))
        return float(min(times))

    def frozen(self, z: Numbers) -> Drift:
        """The scalar drift at z and y = 0, with its noise."""
        drift = Drift(self.phi.subs("y", 0), "u", noise=None if self.noise == 1 else self.noise)
        return drift.bind(z=z) if drift.parameters else drift


def values(expression: Any, u: FloatArray, z: Any = 0.0, eps: float = 0.0) -> FloatArray:
    """The values of an expression in float64 at scaled u and z, broadcast together."""
    import sympy

    with np.errstate(all="ignore"):
        of = compiled(expression, sympy.symbols("u z y"), balls=False)
        result = of(np.clip(u, -1.0, 1.0), z, eps * u) + 0.0 * (u + z)
    return np.asarray(result, dtype=np.float64)


def oscillator(mu: Number, alpha: Number) -> System:
    """The paper's friction oscillator with its moving spring extension z (eq:osc3).

    phi = 1 - z - y - alpha (u + mu (u - u^3)) and velocity y - 1: z moves to the left while the
    block sticks.

    Parameters
    ----------
    mu, alpha : number
        Shape, at least 0, and strength, greater than 0, of the friction force.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.oscillator(mu=3, alpha=1).velocity
    y - 1
    """
    import sympy

    u, z, y = sympy.symbols("u z y")
    m, a = map(sympy.Rational, (within("mu", mu, 0, 1e300), positive("alpha", alpha)))
    return System(1 - z - y - a * (u + m * (u - u**3)), y - 1)
