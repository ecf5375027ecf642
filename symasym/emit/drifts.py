"""Formulas of a general drift with the drift put in; the smooth Stokes multiplier of friction's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from symasym.base.errors import InputError
from symasym.base.inputs import choice, is_array
from symasym.drift.drift import Drift
from symasym.emit.forms import (
    by_name,
    called,
    larger,
    log1p,
    log_form,
    log_modulus,
    logaddexp,
    quotients,
)
from symasym.emit.program import (
    Case,
    FirstPassage,
    Function,
    Program,
    Quadrature,
    by_logarithm,
    fold,
    require_closed,
)
from symasym.records import Record

if TYPE_CHECKING:
    from sympy import Expr


# -- the Stokes multiplier -------------------------------------------------------------------------


_SHARE_ERROR = (
    "exact, as the share of G(Z) that it is defined to be; in doubles its logarithm to 1e-12"
)


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
        what.label, what.title, (function,), _SHARE_ERROR, assumptions=what.assumptions,
        left_out=("the step of the paper, in place of which this is",),
    )  # fmt: skip
    return fold(emitted, quotients(drift.values))


# -- formulas of a drift ---------------------------------------------------------------------------


_U = sympy.Symbol("u", real=True)

# -- the exact time ----------------------------------------------------------------------------

ERROR = (
    "log T is right to 1e-12, or to 1e-12 of itself where that is larger, for the drift with its "
    "numbers as doubles; kappa from 1e-8 to 1e8, r from 1e-100 to 1e12, else refused, and also "
    "where both directions of the computation differ by more"
)


def exact_time(what: Record, drift: Drift) -> Program:
    """T from 0, by positive-form and panel-step, in doubles or digits."""
    A = sympy.sympify(drift.expression())
    ends = tuple(sympy.expand(A.subs(_U, end)) for end in (-1, 1))
    known: dict[str, Any] = {}
    if A.is_polynomial(_U):
        powers = tuple(sympy.Poly(A, _U).all_coeffs()[::-1])
        known["coefficients"] = powers
        # A moves by as much where u is rounded.
        size = sympy.Add(*((1 + k) * abs(c) for k, c in enumerate(powers)))
    else:
        known["points"] = _marks(drift)
        inside = np.linspace(-1, 1, 1001)
        values = np.abs(drift.evaluate_float(inside))
        size = sympy.Float(values.max() + np.abs(np.gradient(values, inside)).max(), 20)
    first_passage = FirstPassage(by_powers(A), ends, size, **known)
    function = Function(
        "escape_time",
        "T from 0 to |u| = r (eq:Ttilde).",
        ("kappa", "r", *drift.free),
        (),
        outside="kappa is not in 1e-8..1e8 or r not in 1e-100..1e12, or log T not known to 1e-12",
        first_passage=first_passage,
    )
    return Program(
        what.label, what.title, (function,), ERROR, assumptions=what.assumptions, latex=what.latex()
    )


def by_powers(e: Expr, zero: int | None = None) -> Expr:
    """A polynomial in u by Horner's rule, around a known zero where it has one."""
    if not e.is_polynomial(_U):
        return e
    if zero is not None and sympy.expand(e.subs(_U, zero)) == 0:
        quotient = sympy.Poly(e, _U).quo(sympy.Poly(_U - zero, _U))
        return (_U - zero) * sympy.horner(quotient.as_expr(), _U)
    return sympy.horner(e, _U)


def critical(drift: Drift) -> tuple[Any, ...]:
    """The zeros of A in the layer, to double precision."""
    if drift.free:
        raise InputError(
            f"the wells of {drift!r} have no closed form in {', '.join(drift.free)}; bind them, or "
            "use a polynomial drift."
        )
    return tuple(sympy.Float(float(point.u), 20) for point in drift.critical_points())


def _marks(drift: Drift) -> tuple[Any, ...]:
    """Zeros of the drift, and where it turns or panels must begin: nothing narrow is missed."""
    from symasym.drift.evaluate import sampled

    zeros, slope = critical(drift), sympy.diff(drift.expression(), _U)
    if drift.exact_coefficients() is None:
        cuts = sampled(drift, {}, 1).cuts
        if cuts is None:
            raise InputError(f"{drift!r} varies too fast for a program; smooth it.")
        places = cuts.tolist()
    else:
        turns = Drift(slope, _U).critical_points() if slope.has(_U) else []
        places = [float(point.u) for point in turns]
    apart = (u for u in places if all(abs(u - float(z)) > 1e-9 for z in zeros))
    return tuple(sorted((*zeros, *(sympy.Float(u, 20) for u in apart))))


# -- all of them -----------------------------------------------------------------------------

# Digits of the numbers that are found by iteration: well and barrier of a general drift.
_DIGITS, _BITS = 60, 512


def program(
    what: Record,
    drift: Drift,
    numbers: Mapping[str, Any],
    method: str | None = None,
) -> Program:
    """A formula of `LABELS` for a drift; `numbers` are the drift's parameters, or the others."""
    if what.label not in LABELS:
        raise InputError(
            f"{what.label} takes no drift; those that do are {', '.join(LABELS)}. "
            "Leave drift out, or ask for one of these."
        )
    own = {name: value for name, value in numbers.items() if name in drift.parameters}
    for name in own:
        if name in drift.values:
            raise InputError(f"{name} is in the drift already; set it once.")
    drift = drift.bind(**own)
    arrays = [name for name, value in drift.values.items() if is_array(value)]
    if arrays:
        raise InputError(f"{arrays[0]} is an array; leave it free, it becomes an argument.")
    rest = {name: value for name, value in numbers.items() if name not in own}
    _require_method(what, method)
    emitted = LABELS[what.label](what, drift)
    for function in emitted.functions:
        for name in drift.free:
            if function.arguments.count(name) > 1:
                raise _taken(name)
    error = emitted.error or what.error
    emitted = replace(emitted, title=f"{what.title}, for {drift!r}", error=error)
    emitted = fold(require_closed(emitted), rest, drift.parameters)
    return replace(emitted, folded={**emitted.folded, **quotients(drift.values), **own})


def _taken(name: str) -> InputError:
    """The error for a drift's parameter with the name of an argument."""
    return InputError(
        f"the drift has a free parameter {name}, and so has the formula; rename it, or bind it."
    )


def _require_method(what: Record, method: str | None) -> None:
    """Refuse a method other than that of the exact escape time."""
    if method is None:
        return
    if what.label != "eq:Ttilde":
        raise InputError(f"{what.label} has no method; eq:Ttilde has.")
    if isinstance(method, str) and method in ("laplace", "uniform"):
        noise = "weak" if method == "laplace" else "uniform"
        raise InputError(
            f"method is {method!r}; such a formula is emitted by "
            f"sa.expand(drift, noise={noise!r}).emit(target)."
        )
    choice("method", method, ("exact",))


def _program(what: Record, *functions: Function, **more: Any) -> Program:
    """A program with the formula's label, title and assumptions."""
    return Program(what.label, what.title, functions, assumptions=what.assumptions, **more)


# -- phi and V -------------------------------------------------------------------------------

_NO_NUMBER = "u is not a number"


def _phi(what: Record, drift: Drift) -> Program:
    """phi(u), piecewise (eq:phi)."""
    return _program(what, drift_function(drift))


def _potential(what: Record, drift: Drift) -> Program:
    """V(u), piecewise (eq:V)."""
    return _program(what, potential_function(drift))


def _arguments(drift: Drift, *others: str) -> tuple[str, ...]:
    return (*others, *drift.free)


def drift_function(drift: Drift) -> Function:
    """phi(u)."""
    cases = [Case((by_powers(value),), where) for value, where in _cases(drift.phi())]
    about = "The drift (eq:phi)."
    return Function("phi", about, _arguments(drift, "u"), tuple(cases), outside=_NO_NUMBER)


def potential_function(drift: Drift) -> Function:
    """V(u)."""
    own = {"tanh": _tanh_potential, "hill": _hill_potential}.get(drift.name)
    if own is not None:
        pieces = own(drift)
    else:
        pieces = [(by_powers(v, -1), where) for v, where in _cases(drift.potential())]
    cases = tuple(Case((value,), where) for value, where in pieces)
    about = "The potential, V(-1) = 0 (eq:V)."
    return Function("V", about, _arguments(drift, "u"), cases, outside=_NO_NUMBER)


def _cases(e: Expr) -> list[tuple[Any, tuple[Any, ...]]]:
    """Value and conditions of each piece of phi or V."""
    if not isinstance(e, sympy.Piecewise):  # a constant drift
        return [(e, ())]
    # The last case is no default: what is no number has no value.
    return [(value, (where if where != sympy.true else _U >= 1,)) for value, where in e.args]


def _values(drift: Drift) -> list[Any]:
    """The parameters in order: symbols where they are free, rationals where bound."""
    value: dict[str, Any] = {name: sympy.Symbol(name, real=True) for name in drift.free}
    value |= quotients(drift.values)
    return [value[name] for name in drift.parameters]


def _hill_potential(drift: Drift) -> list[tuple[Any, tuple[Any, ...]]]:
    """V of the Hill switch, by partial fractions in s = x/K: K^n + x^n has the roots K e^{i t}."""
    a, b, K = _values(drift)
    n = drift._model.n  # type: ignore[attr-defined]

    def share(x: Expr) -> Expr:
        """The integral of x^n/(K^n + x^n) from 0."""
        s, total = x / K, sympy.S.Zero
        for k in range(n // 2):
            t = (2 * k + 1) * sympy.pi / n
            c, d = sympy.cos(t), sympy.sin(t)
            total -= c / n * sympy.log(s**2 - 2 * c * s + 1)
            total += 2 * d / n * (sympy.atan((s - c) / d) + sympy.atan(c / d))
        if n % 2:
            total += sympy.log(1 + s) / n
        return x - K * total

    rise = 2 * (b - a) * (1 + K**n)
    return [
        (-a * (_U + 1), (_U <= -1,)),
        (-a * (_U + 1) - rise * share((1 + _U) / 2), (_U < 1,)),
        (-2 * a - rise * share(sympy.S.One) - b * (_U - 1), (_U >= 1,)),
    ]


def _tanh_potential(drift: Drift) -> list[tuple[Any, tuple[Any, ...]]]:
    """V of the sigmoid; SymPy's antiderivative loses digits where tanh is near -1."""
    a, b, s = _values(drift)

    def log_cosh(x: Expr) -> Expr:
        return logaddexp(x, -x)  # and log 2, which cancels

    bend = (log_cosh(s * _U) - log_cosh(s)) / (s * sympy.tanh(s))
    return [
        (-a * (_U + 1), (_U <= -1,)),
        (-(a + b) / 2 * (_U + 1) - (b - a) / 2 * bend, (_U < 1,)),
        (-(a + b) - b * (_U - 1), (_U >= 1,)),
    ]


# -- escape time in weak noise -----------------------------------------------------------------


def _weak_noise(what: Record, drift: Drift) -> Program:
    """eq:Ttildesmall with the step eq:S."""
    (item,) = what.code
    if drift.name == "friction":
        return _friction_weak_noise(what, item["values"][0], drift)
    if drift.free:
        raise InputError(
            f"the well of {drift!r} has no closed form in {', '.join(drift.free)}; bind them, or "
            "use sa.friction."
        )
    from symasym.numbers.balls import precision
    from symasym.paper import well

    with precision(_BITS):
        known = well(drift, _BITS)
        names = ["a_plus", "slope_well", "slope_barrier", "barrier"]
        numbers = {
            n: sympy.Float(x.mid().str(_DIGITS, radius=False, more=True), _DIGITS)
            for n, x in zip(names, known, strict=False)
        }
    left = () if "barrier" in numbers else ("the well's term, there is no barrier beyond u = 0",)
    value = item["values"][0] if "barrier" in numbers else _without_well(item["values"][0])
    # The logarithm's form first: the numbers hide which factor is an exponential's.
    case, log = (Case((by_name(e, numbers),)) for e in (value, log_form(value)))
    logs = (log,) if "barrier" in numbers else ()
    about = "T in weak noise, from 0 (eq:Ttildesmall)."
    function = Function(item["name"], about, ("kappa", "r"), (case,), logs)
    return _program(what, function, left_out=left, digits=_DIGITS - 10)


def _without_well(value: Expr) -> Expr:
    """The terms of a sum without an exponential."""
    return sympy.Add(*(term for term in value.args if not term.has(sympy.exp)))


def _friction_weak_noise(what: Record, value: Expr, drift: Drift) -> Program:
    """The paper's time for the friction drift: well and barrier in closed form (friction-well)."""
    angle = of_friction("friction-well", "friction_angle")
    parts = {"a_plus": of_friction("eq:phifric0", "friction_right")}
    for name in ("slope_well", "slope_barrier", "barrier"):
        parts[name] = by_name(of_friction("friction-well", f"friction_{name}"), {"omega": angle})

    plain = _without_well(value)
    crossing = parts["a_plus"] > 0
    force, breakaway = abs(1 - FRICTION["z0"]), of_friction("beta", "friction_breakaway")
    well = (FRICTION["mu"] > sympy.Rational(1, 2), breakaway > force)
    function = Function(
        "weak_noise_time",
        "T in weak noise, from 0 (eq:Ttildesmall with the step eq:S).",
        ("kappa", "r", *drift.parameters),
        (
            Case((by_name(value, parts),), (crossing, *well), "the case with a well"),
            Case((by_name(plain, parts),), (crossing,), "the case without a well"),
        ),
        # The logarithm's form first: put in, the slopes hide their signs.
        (
            Case((by_name(log_form(value), parts),), (crossing, *well), "the case with a well"),
            Case((by_name(log_form(plain), parts),), (crossing,), "the case without a well"),
        ),
        outside="the drift does not cross (|1 - z0| <= alpha)",
    )
    return fold(_program(what, function), quotients(drift.values))


# -- integrals --------------------------------------------------------------------------------

_KAPPA = sympy.Symbol("kappa", positive=True)


def _quadrature(drift: Drift, sign: int, lower: Expr, upper: Expr) -> Quadrature:
    """The integral of e^{2 V/kappa^2}, or with the other sign."""
    free = [sympy.Symbol(name, real=True) for name in drift.free]
    exponent = 2 * sign * called("V", _U, *free) / _KAPPA**2
    A = drift.expression()
    if A.is_polynomial(_U):
        powers = tuple(sympy.Poly(A, _U).all_coeffs()[::-1])
        return Quadrature(exponent, lower, upper, coefficients=powers)
    return Quadrature(exponent, lower, upper, points=critical(drift))


def _layer_parts(drift: Drift) -> tuple[list[Function], Any, Any, Any]:
    """V and log_layer; then log of the integral inside, log of that outside, and where they are."""
    free = [sympy.Symbol(name, real=True) for name in drift.free]
    A, V = drift.expression(), potential_function(drift)
    inside = Function(
        "log_layer",
        "Logarithm of the integral of e^{-2 V/kappa^2} over the layer.",
        ("kappa", *drift.free),
        (),
        quadrature=_quadrature(drift, -1, sympy.S.NegativeOne, sympy.S.One),
    )
    a_minus, a_plus = (sympy.expand(A.subs(_U, end)) for end in (-1, 1))
    V1 = sympy.expand(V.cases[-1].values[0].subs(_U, 1))
    known = {"a_minus": a_minus, "a_plus": a_plus, "V_1": V1}
    tails = [by_name(log_form(e), known) for e in Record.of("tails").expression]
    where = (a_minus > 0, a_plus < 0)
    if sympy.false in where:
        raise InputError(f"{drift!r} does not slide, so that there is no steady state.")
    return (
        [V, inside],
        called("log_layer", _KAPPA, *free),
        logaddexp(*tails),
        tuple(c for c in where if c != sympy.true),
    )


def _density(what: Record, drift: Drift) -> Program:
    """p_ss(u) = e^(-lam V)/(sum of the integrals inside and outside the layer) (eq:pss)."""
    functions, inside, outside, where = _layer_parts(drift)
    free = [sympy.Symbol(name, real=True) for name in drift.free]
    log = -2 * called("V", _U, *free) / _KAPPA**2 - logaddexp(inside, outside)
    about = "Stationary density p_ss(u) (eq:pss)."
    return _program(what, *functions, _sliding("stationary_density", about, log, where, drift, "u"))


def _sliding(
    name: str, about: str, log: Expr, where: tuple[Any, ...], drift: Drift, *first: str
) -> Function:
    """A function that exists where the drift slides, from its logarithm."""
    outside = "the drift does not slide (a- > 0 > a+)"
    return by_logarithm(name, about, (*first, "kappa", *drift.free), log, where, outside=outside)


def _occupation(what: Record, drift: Drift) -> Program:
    """P and 1 - P from the logarithms of the integrals inside and outside (eq:P2)."""
    functions, inside, outside, where = _layer_parts(drift)
    odds = outside - inside
    return _program(
        what,
        *functions,
        _sliding("occupation", "P, the share of |u| <= 1 (eq:P2).", -_softplus(odds), where, drift),
        _sliding("complement", "1 - P (eq:P2).", -_softplus(-odds), where, drift),
    )


def _exit(what: Record, drift: Drift) -> Program:
    """C, from two integrals of one sign: 0 to r, and -r to 0."""
    lower, upper = sympy.symbols("lower upper", real=True)
    r = sympy.Symbol("r", positive=True)
    free = [sympy.Symbol(name, real=True) for name in drift.free]
    scale = Function(
        "log_scale",
        "Logarithm of the integral of e^{2 V/kappa^2} from lower to upper.",
        ("lower", "upper", "kappa", *drift.free),
        (),
        quadrature=_quadrature(drift, 1, lower, upper),
    )
    left, right = (
        called("log_scale", *ends, _KAPPA, *free) for ends in ((-r, sympy.S.Zero), (0, r))
    )
    functions = [
        by_logarithm(name, about, ("kappa", "r", *drift.free), log)
        for name, about, log in (
            ("exit_probability", "C, leaving through -r from 0 (eq:C).", -_softplus(left - right)),
            ("complement", "1 - C (eq:C).", -_softplus(right - left)),
        )
    ]
    return _program(what, potential_function(drift), scale, *functions)


def _softplus(x: Expr) -> Expr:
    """log(1 + e^x)."""
    return logaddexp(sympy.S.Zero, x)


LABELS = {
    "eq:Ttilde": exact_time,
    "eq:phi": _phi,
    "eq:phifric0": _phi,
    "eq:V": _potential,
    "eq:V2": _potential,
    "eq:Vfric": _potential,
    "eq:Ttildesmall": _weak_noise,
    "eq:S": stokes,
    "eq:C": _exit,
    "eq:pss": _density,
    "eq:P": _occupation,
    "eq:P2": _occupation,
}
