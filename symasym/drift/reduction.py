"""From n dimensions to the scalar drift across the switching surface (section 4 of the paper).

With the switch h(x), |h| < eps the layer and u = h/eps: phi(u) = grad h · F(x, u) (eq:phi), the
noise across the surface is |grad h · D| kappa (eq:reducedSDE), and Filippov's sliding field is the
convex combination of f- and f+ that is tangent to h = 0 (eq:genFilippov).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.errors import InputError, RegionError
from symasym.base.inputs import exact, is_name, positive, sequence, shown
from symasym.drift import landscape
from symasym.drift.drift import Drift

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from symasym.base.inputs import Number

__all__ = ["Reduction", "numbers_of", "reduce"]

_MOST_OPERATIONS = 200  # of a component, which SymPy simplifies


@dataclass(frozen=True)
class Reduction:
    """The result of `reduce`; unpacks as ``drift, amplitude``.

    Attributes
    ----------
    drift : Drift
        The scaled scalar drift phi(u) at the chosen point of the surface.
    amplitude : SymPy expression
        |B|: the factor by which the noise across the surface multiplies kappa.
    coordinates : tuple of Symbol
    normal_minus, normal_plus : SymPy expression
        Components of f- and f+ along grad h on the surface, before `at` is put in.
    sliding : tuple of SymPy expression
        Filippov's sliding vector field, a component per coordinate: the convex
        combination of f- and f+ tangent to the surface. It is the dynamics
        only where the region is sliding (attracting or repelling).
    normal_inside : SymPy expression
        The component of F along grad h, before `at` is put in.
    inside : tuple of SymPy expression
        F itself.
    layer : Symbol
        h/eps in them.
    normal : tuple of SymPy expression
        grad h.
    point : mapping
        Coordinate -> value, where the drift is frozen.
    """

    drift: Drift
    amplitude: Any
    coordinates: tuple[Any, ...]
    normal_minus: Any
    normal_plus: Any
    sliding: tuple[Any, ...]
    normal_inside: Any
    inside: tuple[Any, ...]
    layer: Any
    normal: tuple[Any, ...]
    point: Mapping[Any, Any]

    def __iter__(self) -> Iterator[Any]:
        yield self.drift
        yield self.amplitude

    def sliding_at(self, values: Mapping[Any, Any]) -> tuple[Any, ...]:
        """The sliding vector field at a point, refused where the point does not slide.

        Parameters
        ----------
        values : mapping
            Coordinate or parameter (Symbol or name) -> number.

        Raises
        ------
        RegionError
            Where f- and f+ do not point to or from the surface from both sides.
        """
        import sympy

        numbers = numbers_of("values", values)
        minus, plus = (_put(n, numbers) for n in (self.normal_minus, self.normal_plus))
        if not (minus * plus).is_negative:
            raise RegionError(
                f"the normal components are {minus} and {plus} there, which is no sliding; "
                "choose a point where they have opposite signs."
            )
        return tuple(sympy.simplify(_put(component, numbers)) for component in self.sliding)

    def drag_time(self, eps: Number, values: Mapping[Any, Any] | None = None) -> float:
        """Scaled time in which the motion of the frozen coordinates changes a well by its depth.

        To first order: the depth of the drift between a well and its barrier, over the rate at
        which the motion along the surface changes it, up or down. A time T of the drift describes
        the whole system only where it is far shorter.

        Parameters
        ----------
        eps : number
            Physical half-width of the switch, greater than 0.
        values : mapping, optional
            Coordinate or parameter (Symbol or name) -> number, for those that are still free.

        Returns
        -------
        float
            Infinite without a well that a barrier ends.

        Raises
        ------
        InputError
            For an eps that is not greater than 0, or a symbol without a value.

        Examples
        --------
        >>> import symasym as sa
        >>> block = sa.reduce(
        ...     ("1 - z - y + 1", "y - 1"), ("1 - z - y - 1", "y - 1"),
        ...     ("1 - z - y - s - 3*(s - s**3)", "y - 1"), ((1,), (0,)), ("y", "z"))
        >>> round(block.drag_time("0.01", {"z": "-0.4"}), 1)  # to the fold at -7/9
        37.8
        """
        import sympy

        width = float(positive("eps", exact("eps", eps)))
        numbers = numbers_of("values", values or {})
        u = sympy.Symbol("u")
        across = sum(n * f for n, f in zip(self.normal, self.inside, strict=True))
        steepness = sum(n**2 for n in self.normal)
        change = sum(
            self.normal_inside.diff(c) * (f - n * across / steepness)
            for c, f, n in zip(self.coordinates, self.inside, self.normal, strict=True)
        )
        frozen = []
        for expression in (self.normal_inside, change):
            at = sympy.sympify(expression).subs({**self.point, self.layer: u}, simultaneous=True)
            frozen.append(Drift(_put(at, numbers), u))
            if frozen[-1].parameters:
                raise InputError(
                    f"values has no {frozen[-1].parameters[0]}; give it a number there, as to each "
                    "coordinate and parameter that is still free."
                )
        phi, rate = frozen
        return landscape.drag_time(
            phi.critical_points(), phi.evaluate_float, lambda y: width * rate.evaluate_float(y)
        )


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

    The coordinates along the surface are frozen at the point `at`. In the system they move, by
    eps times their velocity in a unit of scaled time; `Reduction.drag_time` says how long the
    wells bear that.

    Parameters
    ----------
    f_minus : sequence of n expressions
        The field where h < 0.
    f_plus : sequence of n expressions
        The field where h > 0.
    F : sequence of n expressions
        The field inside the layer ``|h| < eps``, in `layer` = h/eps and x.
    D : n×m matrix, or nested sequences, or a column
        Noise strengths: the noise is kappa D dW.
    coordinates : sequence of Symbol or str
        The n coordinates x, in the order of the components.
    switch : expression, optional
        h(x), whose zero set is the switching surface; by default the first
        coordinate. Where ``|grad h|`` is not 1, drift and amplitude are those of h.
    layer : Symbol or str
        The name of h/eps inside F.
    at : mapping, optional
        Coordinate -> number or expression: the point of the surface at which
        the coefficients are frozen. Coordinates left out become parameters of
        the drift, except one for which h = 0 is solved.

    Returns
    -------
    Reduction

    Raises
    ------
    InputError
        If F does not join f- and f+ at the layer's edges (eq:cont), if the
        point is not on the surface, or if the surface has no normal there.

    Notes
    -----
    To leading order in the distance from the point. The row of D is grad h · D,
    and independent noises add in squares: the amplitude is the Euclidean length
    of that row, where the paper prints the square root of it.
    Where h is curved, Ito's formula adds kappa^2/2 times the trace of
    D^T (Hessian of h) D to the drift of h; like the other small terms it is
    left out.

    Examples
    --------
    >>> import symasym as sa
    >>> reduced = sa.reduce(("2 - z", "-z"), ("-1 - z", "-z"), ("1/2 - 3*s/2 - z", "-z"),
    ...                     ((3, 4), (0, 0)), ("y", "z"), at={"z": 0})
    >>> drift, amplitude = reduced
    >>> drift.region, amplitude
    ('sliding', 5)
    >>> reduced.sliding_at({"z": 1})
    (0, -1)
    """
    import sympy

    from symasym.drift.expressions import parse

    x = [_symbol("coordinates", c) for c in sequence("coordinates", coordinates)]
    inside = _symbol("layer", layer)
    known = {s.name: s for s in (*x, inside)}
    if len(known) <= len(x):
        raise InputError(
            f"coordinates is {shown(coordinates)} and layer is {inside}; give each its own name."
        )

    def column(name: str, given: Any) -> Any:
        components = sequence(name, given)
        if len(components) != len(x):
            raise InputError(
                f"{name} has {len(components)} components; give {len(x)}, one for each coordinate."
            )
        found = sympy.Matrix([parse(name, c, known) for c in components])
        if (size := max(map(sympy.count_ops, found))) > _MOST_OPERATIONS:
            raise InputError(
                f"{name} has a component of {size} operations; give at most {_MOST_OPERATIONS}."
            )
        return found

    fields = [column(n, f) for n, f in (("f_minus", f_minus), ("f_plus", f_plus), ("F", F))]
    for side, outer, name in ((1, fields[1], "f_plus"), (-1, fields[0], "f_minus")):
        for k, (a, b) in enumerate(zip(fields[2].subs(inside, side), outer, strict=True), 1):
            if sympy.simplify(a - b) != 0:
                raise InputError(
                    f"F jumps at {inside} = {side}: component {k} is {a} but {name} has {b} "
                    "(eq:cont); make them equal."
                )
    h = x[0] if switch is None else parse("switch", switch, known)
    gradient = sympy.Matrix([[sympy.diff(h, c) for c in x]])
    on = _on_surface(h, x, {known[k]: parse("at", v, known) for k, v in _at(at, x).items()})
    normal = gradient.subs(on)
    if all(sympy.simplify(n) == 0 for n in normal):
        raise InputError(
            f"grad h is 0 at the point, h = {h}; choose an h whose zero set has a normal there."
        )
    minus, plus, middle = (sympy.simplify((gradient * f)[0]) for f in fields)
    row = normal * _matrix(D, x, known).subs(on)
    sliding = (
        sympy.simplify((minus * p - plus * m) / (minus - plus)) if minus != plus else sympy.nan
        for m, p in zip(fields[0], fields[1], strict=True)
    )
    return Reduction(
        _drift(sympy.simplify(middle.subs(on)), inside),
        sympy.simplify(sympy.sqrt(sum(entry**2 for entry in row))),
        tuple(x), minus, plus, tuple(sliding), middle, tuple(fields[2]), inside, tuple(gradient),
        on,
    )  # fmt: skip


def numbers_of(name: str, values: Any) -> dict[str, Any]:
    """The numbers of coordinates and parameters, by name, as SymPy's rationals."""
    import sympy

    if not isinstance(values, Mapping):
        raise InputError(f"{name} is {shown(values)}; give a mapping such as {{'z': 0}}.")
    return {str(k): sympy.Rational(*exact(str(k), v).as_integer_ratio()) for k, v in values.items()}


def _put(expression: Any, numbers: Mapping[str, Any]) -> Any:
    """An expression with its symbols of these names put in."""
    return expression.subs(
        {s: numbers[s.name] for s in expression.free_symbols if s.name in numbers}
    )


def _symbol(name: str, given: Any) -> Any:
    """A coordinate as a symbol."""
    import sympy

    if isinstance(given, sympy.Symbol) and is_name(given.name):
        return given
    if not is_name(given):
        raise InputError(f"{name} has {shown(given)}; give symbols or names of letters and digits.")
    return sympy.Symbol(given, real=True)


def _at(at: Any, x: list[Any]) -> dict[str, Any]:
    """The entries of `at` by the coordinates' names."""
    names = [c.name for c in x]
    if at is not None and not (isinstance(at, Mapping) and {str(k) for k in at} <= {*names}):
        raise InputError(
            f"at is {shown(at)}; give a mapping from coordinates ({', '.join(names)}) to numbers, "
            "such as {'z': 0}."
        )
    return {str(k): v for k, v in (at or {}).items()}


def _matrix(D: Any, x: list[Any], known: Mapping[str, Any]) -> Any:
    """D as a matrix of n rows; a column may be given as one sequence."""
    import sympy

    from symasym.drift.expressions import parse

    rows = sequence("D", D.tolist() if isinstance(D, (np.ndarray, sympy.MatrixBase)) else D)
    rows = [list(row) if isinstance(row, (list, tuple, np.ndarray)) else [row] for row in rows]
    if len(rows) != len(x) or len({len(row) for row in rows}) != 1:
        raise InputError(
            f"D has {len(rows)} rows of lengths {[len(row) for row in rows]}; "
            f"give {len(x)} rows of one length."
        )
    return sympy.Matrix([[parse("D", entry, known) for entry in row] for row in rows])


def _on_surface(h: Expr, x: list[Any], point: dict[Any, Any]) -> dict[Any, Any]:
    """The substitution that puts the coefficients on the surface at the chosen point."""
    import sympy

    level = sympy.simplify(h.subs(point))
    if level == 0:
        return point
    for c in x:
        if c in point or not level.has(c):
            continue
        try:
            solutions = sympy.solve(level, c)
        except NotImplementedError:
            solutions = []
        if len(solutions) == 1:
            put = {k: sympy.sympify(v).subs(c, solutions[0]) for k, v in point.items()}
            return {**put, c: solutions[0]}
        raise InputError(
            f"h = {level} is solved for {c} in {len(solutions)} ways; name the one you mean in at."
        )
    raise InputError(
        f"h is {level} at the point, which is not on the surface h = 0; move it there."
    )


def _drift(frozen: Expr, inside: Symbol) -> Drift:
    """The drift, symbols stripped of assumptions, so that parameters go by name."""
    import sympy

    u = sympy.Symbol("u")
    plain = {s: u if s == inside else sympy.Symbol(s.name) for s in frozen.free_symbols}
    return Drift(frozen.subs(plain, simultaneous=True), u)
