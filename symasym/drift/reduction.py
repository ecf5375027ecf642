"""From n dimensions to the scalar drift across the switching surface (section 4 of the paper)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from symasym.base.call_context import symbolic
from symasym.base.errors import InputError, RegionError
from symasym.base.inputs import (
    exact,
    is_name,
    meant,
    positive,
    sequence,
    shown,
)
from symasym.drift import landscape
from symasym.drift.drift import Drift
from symasym.drift.grammar import functions_inside
from symasym.drift.short import is_short, simplified
from symasym.series.coefficient_fields import seems_zero, vanishes

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from symasym.base.inputs import Number

__all__ = ["Reduction", "reduce"]

# Functions in each other of which SymPy finds the zeros in about a second.
_SOLVED = 2

#: Reads an expression, given how messages call it.
Reader: TypeAlias = "Callable[[str, Expr | str | float], Expr]"


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

    @symbolic
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
        put = {s: numbers[s.name] for s in self._symbols() if s.name in numbers}
        minus, plus = (sympy.sympify(n).subs(put) for n in (self.normal_minus, self.normal_plus))
        if not (minus * plus).is_negative:
            raise RegionError(
                f"the normal components are {minus} and {plus} there, which is no sliding; "
                "choose a point where they have opposite signs."
            )
        return tuple(simplified(component.subs(put)) for component in self.sliding)

    @symbolic
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
        numbers = numbers_of("values", {} if values is None else values)
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
            put = {s: numbers[s.name] for s in at.free_symbols if s.name in numbers}
            frozen.append(Drift(at.subs(put), u))
            if frozen[-1].parameters:
                raise InputError(
                    f"values has no {frozen[-1].parameters[0]}; give it a number there, as to each "
                    "coordinate and parameter that is still free."
                )
        phi, rate = frozen
        return landscape.drag_time(
            phi.critical_points(), phi.evaluate_float, lambda y: width * rate.evaluate_float(y)
        )

    def _symbols(self) -> list[Any]:
        """Every symbol of the sliding field and the normal components, by name."""
        every = set().union(*(c.free_symbols for c in (*self.sliding, self.normal_minus)))
        return sorted(every | self.normal_plus.free_symbols, key=str)


@symbolic
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
    patience: float | None = None,
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
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

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
    >>> from symasym.drift.reduction import reduce
    >>> reduced = reduce(("2 - z", "-z"), ("-1 - z", "-z"), ("1/2 - 3*s/2 - z", "-z"),
    ...                  ((3, 4), (0, 0)), ("y", "z"), at={"z": 0})
    >>> drift, amplitude = reduced
    >>> drift.region, amplitude
    ('sliding', 5)
    >>> reduced.sliding_at({"z": 1})
    (0, -1)
    """
    import sympy

    from symasym.drift.expressions import expect_algebra

    symbols = [_symbol("coordinates", c) for c in sequence("coordinates", coordinates)]
    known = {s.name: s for s in symbols}
    inside = _symbol("layer", layer)
    if len({*known, inside.name}) <= len(symbols):
        raise InputError(
            f"coordinates is {shown(coordinates)} and layer is {inside}; give each its own name."
        )
    read = _reader({**known, inside.name: inside})
    x = list(known.values())
    fields = [
        _vector(name, f, x, read)
        for name, f in (("f_minus", f_minus), ("f_plus", f_plus), ("F", F))
    ]
    h = x[0] if switch is None else read("switch", switch)
    expect_algebra(h, *sum(fields, []))
    gradient = sympy.Matrix([[sympy.diff(h, c) for c in x]])
    point = _point(h, x, {} if at is None else at, read)
    on = _on_surface(h, x, point)
    normal = gradient.subs(on)
    if all(map(_vanishes, normal)):
        raise InputError(
            f"grad h is 0 at the point, h = {h}; choose an h whose zero set has a normal there."
        )
    _check_continuity(fields, inside)
    minus, plus, middle = [simplified((gradient * sympy.Matrix(f))[0]) for f in fields]
    frozen = simplified(middle.subs(on))
    drift = _drift(frozen, inside)
    row = normal * _matrix(D, x, read).subs(on)
    amplitude = sympy.sqrt(simplified(sum(entry**2 for entry in row)))
    sliding = tuple(
        simplified((minus * p - plus * m) / (minus - plus)) if minus != plus else sympy.nan
        for m, p in zip(fields[0], fields[1], strict=True)
    )
    return Reduction(
        drift,
        simplified(amplitude),
        tuple(x),
        minus,
        plus,
        sliding,
        middle,
        tuple(fields[2]),
        inside,
        tuple(gradient),
        on,
    )


def _vanishes(expression: Any) -> bool:
    """True if it is zero; by numbers alone where SymPy would take long, or does not find it."""
    if not seems_zero(expression):
        return False
    return not is_short(expression) or vanishes(expression) or expression.equals(0) is True


def numbers_of(name: str, values: Mapping[Any, Any]) -> dict[str, Any]:
    """The numbers of coordinates and parameters, by name, as SymPy's rationals."""
    import sympy

    if not isinstance(values, Mapping):
        raise InputError(
            f"{name} is {shown(values)}; give a mapping from coordinates to numbers, such as "
            "{'z': 0}."
        )
    numbers = {str(k): exact(str(k), v) for k, v in values.items()}
    return {k: sympy.Rational(v.numerator, v.denominator) for k, v in numbers.items()}


def _symbol(name: str, given: Symbol | str) -> Any:
    """A coordinate as a symbol."""
    import sympy

    if isinstance(given, sympy.Symbol) and is_name(given.name):
        return given
    if not is_name(given):
        raise InputError(f"{name} has {shown(given)}; give symbols or names of letters and digits.")
    return sympy.Symbol(given, real=True)


def _reader(known: Mapping[str, Any]) -> Reader:
    """A function that reads an expression, strings with exact decimals."""
    import sympy

    from symasym.drift import grammar
    from symasym.drift.expressions import exactly, sympified

    def read(name: str, given: Expr | str | float) -> Any:
        """The expression, with the symbols of `known` for their names."""
        try:
            if isinstance(given, str):
                expression = grammar.read(name, given, known)
            else:
                expression = sympy.nsimplify(sympified(given), rational=True)
            if not isinstance(expression, sympy.Expr):
                raise TypeError
        except (sympy.SympifyError, TypeError, AttributeError) as error:
            raise InputError(
                f"{name} has an entry {shown(given)}, which SymPy cannot read "
                f"({type(error).__name__}); write it like 1/2 - z."
            ) from None
        expression = exactly(expression, name)
        # One name is one symbol, whatever assumptions it was written with.
        return expression.subs(
            {
                s: known[s.name]
                for s in expression.free_symbols
                if s.name in known and s is not known[s.name]
            }
        )

    return read


def _vector(name: str, given: Sequence[Any], x: list[Any], read: Reader) -> list[Any]:
    """The components of a field, one for each coordinate."""
    components = [read(name, component) for component in sequence(name, given)]
    if len(components) != len(x):
        raise InputError(
            f"{name} has {len(components)} components; give {len(x)}, one for each coordinate."
        )
    return components


def _matrix(D: Sequence[Any], x: list[Any], read: Reader) -> Any:
    """D as a matrix of n rows; a column may be given as one sequence."""
    import sympy

    rows = sequence("D", D.tolist() if isinstance(D, (np.ndarray, sympy.MatrixBase)) else D)
    rows = [list(row) if isinstance(row, (list, tuple, np.ndarray)) else [row] for row in rows]
    if len(rows) != len(x) or len({len(row) for row in rows}) != 1:
        raise InputError(
            f"D has {len(rows)} rows of lengths {[len(row) for row in rows]}; "
            f"give {len(x)} rows of one length."
        )
    return sympy.Matrix([[read("D", entry) for entry in row] for row in rows])


def _point(h: Expr, x: list[Any], at: Mapping[Any, Any], read: Reader) -> dict[Any, Any]:
    """The coordinates in `at` and their values, by symbol."""
    names = {str(c): c for c in x}
    if not isinstance(at, Mapping):
        raise InputError(
            f"at is {shown(at)}; give a mapping from coordinates to numbers, such as {{'z': 0}}."
        )
    unknown = [str(k) for k in at if str(k) not in names]
    if unknown:
        raise InputError(
            f"at names {unknown[0]}, which is no coordinate; they are {', '.join(names)}"
            f"{meant(unknown[0], names)}."
        )
    return {names[str(k)]: read("at", value) for k, value in at.items()}


def _on_surface(h: Expr, x: list[Any], point: dict[Any, Any]) -> dict[Any, Any]:
    """The substitution that puts the coefficients on the surface at the chosen point."""
    import sympy

    level = h.subs(point)
    if _vanishes(level):
        return point
    for c in x:
        if c in point or not level.has(c):
            continue
        slope = sympy.diff(level, c)
        if not slope.has(c):
            # SymPy's way may take minutes for what is linear in c and long.
            solutions = [simplified(-level.subs(c, 0) / slope)]
        else:
            solutions = _zeros(level, c)
        if len(solutions) == 1:
            return {
                **{k: sympy.sympify(v).subs(c, solutions[0]) for k, v in point.items()},
                c: solutions[0],
            }
        raise InputError(
            f"h = {level} has {len(solutions)} zeros in {c}; name the one you mean in at."
        )
    raise InputError(
        f"h is {level} at the point, which is not on the surface h = 0; move it there."
    )


def _zeros(level: Expr, c: Symbol) -> list[Any]:
    """The zeros of h in a coordinate, where SymPy finds them in about a second."""
    import sympy

    kinks = sympy.Abs, sympy.sign, sympy.Max, sympy.Min, sympy.Piecewise
    if is_short(level) and functions_inside(level) <= _SOLVED and not level.has(*kinks):
        with suppress(NotImplementedError, TypeError, ValueError):
            return list(sympy.solve(level, c))
    raise InputError(f"h = {shown(level)} is not solved for {c} in a short time; give {c} in at.")


def _check_continuity(fields: list[list[Any]], inside: Symbol) -> None:
    """eq:cont: F at layer = ±1 equals f±, identically in x (the edge moves with eps)."""

    minus, plus, middle = fields
    for side, outer, name in ((1, plus, "f_plus"), (-1, minus, "f_minus")):
        for k, (a, b) in enumerate(zip(middle, outer, strict=True)):
            if not _vanishes(a.subs(inside, side) - b):
                raise InputError(
                    f"F jumps at {inside} = {side}: component {k + 1} is {a.subs(inside, side)} "
                    f"but {name} has {b} (eq:cont); make them equal."
                )


def _drift(frozen: Expr, inside: Symbol) -> Drift:
    """The drift, symbols stripped of assumptions, so that parameters go by name."""
    import sympy

    u = sympy.Symbol("u")
    plain = {s: u if s == inside else sympy.Symbol(s.name) for s in frozen.free_symbols}
    return Drift(frozen.subs(plain, simultaneous=True), u)
