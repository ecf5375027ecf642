"""Ready-made smoothings of a switch from a- at u = -1 to a+ at u = 1, also selected by name."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from sympy import Symbol

from symasym.base.errors import InputError
from symasym.base.inputs import Numbers, choice, count, flag, shown
from symasym.drift.drift import Drift
from symasym.drift.formula import Formula
from symasym.drift.model import Model
from symasym.drift.texts import read

__all__ = [
    "DRIFTS",
    "drift_signatures",
    "friction",
    "hill",
    "linear",
    "named_drift",
    "polynomial",
    "sine",
    "tanh",
]

# The largest number of waves and the largest Hill exponent.
_MOST = 1_000
_LINE, _ENDS = "(a_minus + a_plus)/2 + (a_plus - a_minus)/2", "a_minus a_plus"


@lru_cache(maxsize=128)
def _model(name: str, formula: str, parameters: str, shape: tuple[str, int] | None = None) -> Model:
    """The model of a ready-made drift; `shape` has the name and value of an integer argument."""
    A, u = read(name, formula), Symbol("u")
    return Model(
        pieces=(Formula(A.subs(Symbol(shape[0]), shape[1]) if shape else A, u),),
        name=name,
        shape=shape,
        ordered=tuple(parameters.split()),
        positive=("alpha", "steepness", "K"),
        not_negative=("mu",),
    )


def friction(
    mu: Numbers | None = None, alpha: Numbers | None = None, z0: Numbers | None = None
) -> Drift:
    """The friction oscillator's drift, 1 - z0 - alpha (u + mu (u - u^3)) (eq:phifric0).

    Parameters
    ----------
    mu : number or array_like, optional
        Shape of the friction force, at least 0; for mu > 1/2 the force has extrema in the layer.
    alpha : number or array_like, optional
        Friction strength, greater than 0.
    z0 : number or array_like, optional
        Spring extension at the start. Parameters that are not given remain free.

    Raises
    ------
    InputError
        If mu < 0 or alpha <= 0.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.friction(mu=3, alpha=1, z0="-0.4").region
    'crossing'
    """
    formula = "1 - z0 + u*(alpha*mu*u**2 - (alpha + alpha*mu))"
    return Drift.of(_model("friction", formula, "mu alpha z0"), mu=mu, alpha=alpha, z0=z0)


def linear(a_minus: Numbers | None = None, a_plus: Numbers | None = None) -> Drift:
    """The linear smoothing from a- to a+, which reproduces Filippov's convention.

    Parameters
    ----------
    a_minus, a_plus : number or array_like, optional
        Scaled drift outside the layer; parameters that are not given remain free.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.linear(1, -2).region
    'sliding'
    """
    return Drift.of(_model("linear", f"{_LINE}*u", _ENDS), a_minus=a_minus, a_plus=a_plus)


def polynomial(*coefficients: Numbers, **named: Numbers) -> Drift:
    """A(u) = c0 + c1 u + c2 u^2 + ...

    Parameters
    ----------
    *coefficients : number or array_like
        The coefficients in ascending powers of u.
    **named : number or array_like
        The coefficients by name, ``c0=…, c2=…``; lower ones that are not given are 0.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.polynomial(1, "-1/2", 0, 2)(1)
    2.5
    """
    if bool(coefficients) == bool(named):
        raise InputError("polynomial takes its coefficients c0, c1, … either in order or by name.")
    if named:
        for name in named:
            if not re.fullmatch(r"c(0|[1-9][0-9]{0,2})", name):
                raise InputError(f"{shown(name)} is not a coefficient; give c0, c1, c2, …, c200.")
        degree = max(int(name[1:]) for name in named)
        coefficients = tuple(named.get(f"c{k}", 0) for k in range(degree + 1))
    names = [f"c{k}" for k in range(len(coefficients))]
    formula = " + ".join(f"{name}*u**{k}" for k, name in enumerate(names))
    model = _model("polynomial", formula, " ".join(names))
    return Drift.of(model, **dict(zip(names, coefficients, strict=True)))


def sine(
    a_minus: Numbers | None = None,
    a_plus: Numbers | None = None,
    b: Numbers | None = None,
    *,
    waves: int = 1,
) -> Drift:
    """The linear smoothing plus b sin(w pi u), w = `waves`: up to 2 w wells and barriers.

    Parameters
    ----------
    a_minus, a_plus, b : number or array_like, optional
        Parameters that are not given remain free.
    waves : int
        The number of full waves on [-1, 1], at least 1.

    Examples
    --------
    >>> import symasym as sa
    >>> len(sa.sine(1, 1, 4, waves=2).wells())
    2
    """
    shape = ("waves", count("waves", waves, 1, _MOST))
    model = _model("sine", f"{_LINE}*u + b*sin(waves*pi*u)", f"{_ENDS} b", shape)
    return Drift.of(model, a_minus=a_minus, a_plus=a_plus, b=b)


def tanh(
    a_minus: Numbers | None = None, a_plus: Numbers | None = None, steepness: Numbers | None = None
) -> Drift:
    """A sigmoid, tanh(b u) with b = `steepness`, scaled so that it equals a- and a+ at the ends.

    Parameters
    ----------
    a_minus, a_plus : number or array_like, optional
        Scaled drift outside the layer; parameters that are not given remain free.
    steepness : number or array_like, optional
        Greater than 0.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.tanh(1, -1, 5)(0)
    0.0
    """
    formula = f"{_LINE}*tanh(steepness*u)/tanh(steepness)"
    model = _model("tanh", formula, f"{_ENDS} steepness")
    return Drift.of(model, a_minus=a_minus, a_plus=a_plus, steepness=steepness)


def hill(
    a_minus: Numbers | None = None,
    a_plus: Numbers | None = None,
    K: Numbers | None = None,
    *,
    n: int = 4,
) -> Drift:
    """A Hill-function switch: a- + (a+ - a-) x^n (1 + K^n)/(K^n + x^n) with x = (1 + u)/2.

    Parameters
    ----------
    a_minus, a_plus : number or array_like, optional
        Scaled drift outside the layer; parameters that are not given remain free.
    K : number or array_like, optional
        The half-saturation point in units of x, greater than 0.
    n : int
        The Hill exponent, an integer of at least 1 (other exponents are not smooth at x = 0).

    Examples
    --------
    >>> import symasym as sa
    >>> sa.hill(0.5, -1, K="1/2", n=2)(-1)
    0.5
    """
    formula = "a_minus + (a_plus - a_minus)*((1 + u)/2)**n*(1 + K**n)/(K**n + ((1 + u)/2)**n)"
    model = _model("hill", formula, f"{_ENDS} K", ("n", count("n", n, 1, _MOST)))
    return Drift.of(model, a_minus=a_minus, a_plus=a_plus, K=K)


#: The ready-made drifts by their names.
DRIFTS: dict[str, Callable[..., Drift]] = {
    of.__name__: of for of in (friction, linear, sine, tanh, hill, polynomial)
}


def named_drift(
    values: Mapping[str, Any],
    drift: str | None = None,
    expr: str | None = None,
    layer: bool = True,
    noise: str | None = None,
    ito: Any = 0,
) -> Drift:
    """The drift of this name in `DRIFTS`, or that with the formula A(u) in `expr`.

    `values` are those of parameters and of the integer arguments `waves` and `n`. With ``layer``
    False, A is the drift for all u; `noise` and `ito` are as in `Drift`.

    Examples
    --------
    >>> named_drift({"a_minus": "1", "a_plus": "1", "waves": "2"}, "sine").free
    ('b',)
    """
    more: Any = {"layer": (-1, 1) if flag("layer", layer) else None, "noise": noise, "ito": ito}
    if (drift is None) == (expr is None):
        raise InputError("give one drift, either its name (drift) or its formula (expr).")
    if expr is not None:
        return Drift(expr, **more).bind(**values)
    of = DRIFTS[choice("drift", drift, DRIFTS)]
    whole = {n: int(x) for n, x in values.items() if n in ("waves", "n") and str(x).isdecimal()}
    try:
        made = of(**{**values, **whole})
    except TypeError:
        unknown = values.keys() - inspect.signature(of).parameters
        raise InputError(
            f"{min(unknown)} is not a parameter of {drift}; its parameters are "
            f"{drift_signatures()[of.__name__]}."
        ) from None
    return made if (layer, noise, ito) == (True, None, 0) else Drift(made.expression(), **more)


def drift_signatures() -> dict[str, str]:
    """The names of the ready-made drifts with those of their parameters, for a help text."""
    named = {name: ", ".join(inspect.signature(of).parameters) for name, of in DRIFTS.items()}
    return {**named, "polynomial": "c0, c1, c2, ..."}
