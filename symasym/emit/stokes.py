"""The smooth Stokes multiplier of the friction drift, as a program."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.folding import fold
from symasym.emit.forms import by_name, larger, log1p, log_modulus, quotients
from symasym.emit.program import Case, Function, Program
from symasym.records import Record

if TYPE_CHECKING:
    from sympy import Expr

ERROR = "exact, as the share of G(Z) that it is defined to be; in doubles its logarithm to 1e-12"


#: The parameters of the friction drift.
FRICTION = {name: sympy.Symbol(name, real=True) for name in ("mu", "alpha", "z0")}


def of_friction(label: str, name: str) -> Expr:
    """The derived expression `name`, where a crossing downwards is one upwards in the mirror.

    That is 1 - z0 changes its sign.
    """
    (e,) = Record.of(label).values_of(name)
    return by_name(e, FRICTION).subs(FRICTION["z0"], 1 - abs(1 - FRICTION["z0"]))


def stokes(what: Record, drift: Drift) -> Program:
    """G(Z)/(G(Z) + G(-Z)), Z = lam^(2/3) zeta, zeta^(3/2) = 3/4 of the barrier (friction-well).

    Past the fold the angle of friction-well is imaginary, and its square, in which zeta is
    analytic, negative.
    """
    if drift.name != "friction":
        raise InputError(
            f"the fold of {drift!r} has no closed form; use sa.friction, or call "
            "sa.stokes_multiplier."
        )
    omega = sympy.Symbol("omega", real=True)
    force = abs(1 - FRICTION["z0"])
    angle = of_friction("friction-well", "friction_angle")
    barrier = by_name(of_friction("friction-well", "friction_barrier"), {"omega": omega})
    (arcsine,) = angle.atoms(sympy.asin)
    within, factor = arcsine.args[0] ** 2, angle / arcsine
    sine = sympy.sin(omega)
    # The barrier is sin^3(omega) times an even function, so that zeta has no root to take.
    even = sympy.simplify(barrier / sine**3)
    if even.has(sympy.sin):
        raise InputError("the barrier of friction-well has another form than is emitted.")
    size = (sympy.Rational(3, 4) * even) ** sympy.Rational(2, 3)
    # Rounding may put either side of the fold where the other is.
    beyond = larger(-within, sympy.S.Zero)
    within = larger(within, sympy.S.Zero)
    # arsinh, without loss where it is small.
    eta = factor * log1p(sympy.sqrt(beyond) + beyond / (1 + sympy.sqrt(1 + beyond)))
    zetas = (
        (sine**2 * size).subs(omega, factor * sympy.asin(sympy.sqrt(within))),
        (-(sympy.sinh(omega) ** 2) * size.subs(sympy.cos(omega), sympy.cosh(omega))).subs(
            omega, eta
        ),
    )
    kappa = sympy.Symbol("kappa", positive=True)
    inside = (FRICTION["mu"] > sympy.Rational(1, 2),)  # the turning point is in the layer
    breakaway = of_friction("beta", "friction_breakaway")
    beside = (breakaway >= force, breakaway < force)
    cases = []
    for zeta, side in zip(zetas, beside, strict=True):
        Z = (2 / kappa**2) ** sympy.Rational(2, 3) * zeta
        share = 1 / (1 + sympy.exp(log_modulus(-Z) - log_modulus(Z)))
        cases.append(Case((share,), (*inside, side)))
    function = Function(
        "stokes_multiplier",
        "The well's share from 0 to 1 through its fold; the step eq:S, made smooth.",
        ("kappa", *drift.parameters),
        tuple(cases),
        outside="no well is born (mu <= 1/2)",
    )
    emitted = Program(
        what.label, what.title, (function,), ERROR, assumptions=what.assumptions,
        left_out=("the step of the paper, in place of which this is",),
    )  # fmt: skip
    return fold(emitted, quotients(drift.values))
