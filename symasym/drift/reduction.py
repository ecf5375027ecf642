"""The reduction of an n-dimensional system to a scaled scalar drift (section 4 of the paper).

The switching surface is h(x) = 0, the layer |h| < eps, and u = h/eps. Then phi(u) = grad h · F(x,
u) (eq:phi), the noise across the surface has the amplitude |grad h · D| kappa (eq:reducedSDE), and
Filippov's sliding field is the convex combination of f- and f+ tangent to h = 0 (eq:genFilippov).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy as np
import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.base.balls import precision, rational, rounded
from symasym.base.errors import InputError
from symasym.base.inputs import (
    Numbers,
    common_shape,
    floats,
    is_array,
    mapping,
    positive,
    sequence,
    shown,
)
from symasym.drift.drift import Drift
from symasym.drift.expressions import parse, symbol

__all__ = ["Reduction", "Scales", "reduce", "rescale"]

_DIGITS = 60  # of a kappa that is irrational
_MOST_OPERATIONS = 200  # the largest size of a component, which SymPy has to simplify


@dataclass(frozen=True)
class Reduction:
    """The result of `reduce`, which unpacks as ``drift, amplitude``.

    Attributes
    ----------
    drift : Drift
        The scaled scalar drift phi(u) at the chosen point of the surface.
    amplitude : SymPy expression
        |B|: the noise amplitude across the surface divided by kappa.
    normal_minus, normal_plus : SymPy expression
        Components of f- and f+ along grad h, as functions of the coordinates.
    sliding : tuple of SymPy expression
        Filippov's sliding vector field, which is the dynamics only in sliding regions.
    normal_inside : SymPy expression
        The component of F along grad h, as a function of the coordinates.
    """

    drift: Drift
    amplitude: Any
    normal_minus: Any
    normal_plus: Any
    sliding: tuple[Any, ...]
    normal_inside: Any

    def __iter__(self) -> Iterator[Any]:
        yield self.drift
        yield self.amplitude


def reduce(
    f_minus: Sequence[Any],
    f_plus: Sequence[Any],
    F: Sequence[Any],
    D: Sequence[Any],
    coordinates: Sequence[Any],
    *,
    switch: Expr | str | None = None,
    layer: Symbol | str = "s",
    at: Mapping[Any, Any] | None = None,
) -> Reduction:
    """The scalar drift, noise amplitude and sliding field of a smoothed n-dimensional switch.

    The coordinates along the surface are frozen at the point `at`; `System.drag_time` gives the
    time scale on which this changes a well.

    Parameters
    ----------
    f_minus : sequence of n expressions
        The field where h < 0.
    f_plus : sequence of n expressions
        The field where h > 0.
    F : sequence of n expressions
        The field inside the layer ``|h| < eps``, a function of x and of `layer` = h/eps.
    D : n×m matrix, or nested sequences, or a column
        The matrix of noise strengths in kappa D dW.
    coordinates : sequence of Symbol or str
        The n coordinates x, in the order of the components.
    switch : expression, optional
        h(x), which is 0 on the switching surface; by default the first coordinate. If ``|grad h|``
        is not 1, drift and amplitude are those of h.
    layer : Symbol or str
        The symbol that stands for h/eps in F.
    at : mapping, optional
        The point on the surface: from coordinates to numbers or expressions. All others become
        parameters of the drift, except one for which h = 0 is solved.

    Returns
    -------
    Reduction

    Raises
    ------
    InputError
        If F is not equal to f- and f+ at the layer's ends (eq:cont), if the
        point is not on the surface, or if the surface has no normal there.

    Notes
    -----
    The reduction is of leading order in the distance from the point. The variances of independent
    noises add: the amplitude is the Euclidean norm of grad h · D, whereas the paper prints its
    square root. If h is not linear, Itô's formula adds kappa^2/2 times the trace of D^T (Hessian
    of h) D to the drift of h; this is omitted like the other terms of higher order.

    Examples
    --------
    >>> import symasym as sa
    >>> reduced = sa.reduce(("2 - z", "-z"), ("-1 - z", "-z"), ("1/2 - 3*s/2 - z", "-z"),
    ...                     ((3, 4), (0, 0)), ("y", "z"), at={"z": 0})
    >>> drift, amplitude = reduced
    >>> drift.region, amplitude
    ('sliding', 5)
    >>> reduced.sliding
    (0, -z)
    """
    x = [symbol("coordinates", c) for c in sequence("coordinates", coordinates)]
    inside = symbol("layer", layer)
    known = {s.name: s for s in (*x, inside)}
    if len(known) <= len(x):
        raise InputError(
            f"coordinates is {shown(coordinates)} and layer is {inside}; give each its own name."
        )

    def matrix(name: str, given: Any) -> Any:
        """The matrix with one row per coordinate; a column may be given as a flat sequence."""
        rows = sequence(name, given.tolist() if hasattr(given, "tolist") else given)
        rows = [[*row] if isinstance(row, (list, tuple)) else [row] for row in rows]
        widths = {len(row) for row in rows}
        if len(rows) != len(x) or (len(widths) != 1 if name == "D" else widths != {1}):
            raise InputError(
                f"{name} has {len(rows)} rows of lengths {[len(row) for row in rows]}; give "
                f"{len(x)}, one for each coordinate, of one length, which is 1 for a field."
            )
        found = sympy.Matrix([[parse(name, c, known) for c in row] for row in rows])
        if (size := max(map(sympy.count_ops, found), default=0)) > _MOST_OPERATIONS:
            raise InputError(
                f"{name} has a component of {size} operations; give at most {_MOST_OPERATIONS}."
            )
        return found

    minus, plus, middle = fields = [
        matrix(name, f) for name, f in (("f_minus", f_minus), ("f_plus", f_plus), ("F", F))
    ]
    for side, outer, name in ((1, plus, "f_plus"), (-1, minus, "f_minus")):
        for k, (a, b) in enumerate(zip(middle.subs(inside, side), outer, strict=True), 1):
            if sympy.simplify(a - b) != 0:
                raise InputError(
                    f"F jumps at {inside} = {side}: component {k} is {a} but {name} has {b} "
                    "(eq:cont); make them equal."
                )
    h = x[0] if switch is None else parse("switch", switch, known)
    gradient = sympy.Matrix([h]).jacobian(x)
    given = mapping("at", {} if at is None else at, [c.name for c in x])
    point = _on_surface(h, x, {known[n]: parse("at", v, known) for n, v in given.items()})
    normal = gradient.subs(point)
    if sympy.simplify(normal).is_zero_matrix:
        raise InputError(
            f"grad h is 0 at the point, h = {h}; choose an h whose zero set has a normal there."
        )
    to, back, across = (sympy.simplify(gradient.dot(f)) for f in fields)
    row = normal * matrix("D", D).subs(point)
    along = (to * plus - back * minus) / (to - back) if to != back else plus * sympy.nan
    frozen = sympy.simplify(across.subs(point))
    if any(s.name == "u" and s != inside for s in frozen.free_symbols):
        raise InputError(
            f"the drift has the parameter u, the name of the position {inside} in it; rename the "
            "coordinate or parameter u."
        )
    # Parameters are identified by name, whatever their assumptions.
    plain = {s: sympy.Symbol("u" if s == inside else s.name) for s in frozen.free_symbols}
    return Reduction(
        drift=Drift(frozen.subs(plain, simultaneous=True), "u"),
        amplitude=sympy.simplify(sympy.sqrt(row.dot(row))),
        normal_minus=to,
        normal_plus=back,
        sliding=tuple(sympy.simplify(along)),
        normal_inside=across,
    )


def _on_surface(h: Expr, x: list[Any], point: dict[Any, Any]) -> dict[Any, Any]:
    """The substitution for `point`, completed so that the point lies on the surface h = 0."""
    level = sympy.simplify(h.subs(point))
    if level == 0:
        return point
    free = [c for c in x if c not in point and level.has(c)]
    solutions: list[Any] = []
    with suppress(NotImplementedError):
        solutions = sympy.solve(level, free[0]) if free else []
    if len(solutions) != 1:
        raise InputError(
            f"h is {level} at the point, and h = 0 has {len(solutions)} solutions for a coordinate "
            "that is left out; give a point of the surface h = 0 in at."
        )
    return {k: v.subs(free[0], solutions[0]) for k, v in point.items()} | {free[0]: solutions[0]}


# -- scaling ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Scales:
    """Scaled noise and radius, and the unit of time.

    Attributes
    ----------
    kappa, r : number
        kappa/sqrt(eps) and r/eps, the arguments of functions such as `escape_time`.
    time : number
        The unit of scaled time in physical time, eps. In one such unit, slow variables, which are
        frozen in the scaled equation, move by eps times their velocity.
    """

    kappa: Any
    r: Any
    time: Any

    def __repr__(self) -> str:
        given = {n: x if np.ndim(x) else f"{float(x):.15g}" for n, x in vars(self).items()}
        return f"Scales({', '.join(f'{name}={x}' for name, x in given.items())})"


def rescale(eps: Numbers, kappa: Numbers, r: Numbers = 1) -> Scales:
    """Scale noise amplitude and radius by the width of the switch (eq:tildexykappa, eq:tilder).

    A time T of the scaled equation is valid for the whole system if the drift changes little when
    a slow variable moves by eps T times its velocity (docs/release.md).

    Parameters
    ----------
    eps : number or array_like
        Physical half-width of the switch, greater than 0. Arrays broadcast together and give
        float64 arrays.
    kappa : number or array_like
        Physical noise amplitude, greater than 0.
    r : number or array_like
        Physical escape radius, greater than 0.

    Returns
    -------
    Scales
        Exact rationals if the square root of `eps` is rational; otherwise
        `kappa` is an mpf that is correct to 60 digits.

    Raises
    ------
    InputError
        For a value, given or scaled, that is not greater than 0 and within 1e±300.

    Examples
    --------
    >>> import symasym as sa
    >>> s = sa.rescale(eps="0.01", kappa="0.03", r="0.1")
    >>> s
    Scales(kappa=0.3, r=10, time=0.01)
    >>> s.kappa
    Fraction(3, 10)
    """
    given = {"eps": eps, "kappa": kappa, "r": r}
    found: list[Any]
    if any(map(is_array, given.values())):
        arrays = {name: floats(name, x) for name, x in given.items()}
        for name, x in arrays.items():
            positive(name, x.min())
        common_shape({name: x.shape for name, x in arrays.items()})
        widths, noises, radii = np.broadcast_arrays(*arrays.values())
        with np.errstate(over="ignore"):
            found = [noises / np.sqrt(widths), radii / widths, widths.copy()]
    else:
        e, k, radius = (positive(name, x) for name, x in given.items())
        root = Fraction(isqrt(e.numerator), isqrt(e.denominator))
        found = [k / root, radius / e, e]
        if root * root != e:
            with precision(4 * _DIGITS):
                found[0] = rounded(arb(rational(k)) / arb(rational(e)).sqrt(), _DIGITS)[0]
    for name, x in zip(("kappa/sqrt(eps)", "r/eps"), found, strict=False):
        positive(name, np.min(floats(name, x)))
    return Scales(*found)
