"""The scaled drift phi(u) of a smoothed switch, the first argument of every quantity."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from flint import fmpq
from sympy import Expr, Function, Piecewise, Rational, Symbol

from symasym.base import inputs
from symasym.base.errors import AccuracyError, InputError, RegionError
from symasym.base.inputs import Numbers, exact, floats, is_array, is_name, shown
from symasym.derivation.tex import tex
from symasym.drift import expressions
from symasym.drift.critical_points import CriticalPoint, formula_of, known
from symasym.drift.formula import Formula
from symasym.drift.model import Model, Parametrized
from symasym.drift.sampled import potential_at, values_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from symasym.base.inputs import Number

__all__ = ["Drift"]

# The plot: the largest |u| without pieces, the number of points, and the most labels.
_REACH, _POINTS, _MOST_NAMES = 1.5, 3_001, 16


class Drift(Parametrized):
    """The scaled drift: a- for u <= -1, A(u) on [-1, 1], a+ for u >= 1 (eq:phi).

    Parameters
    ----------
    A : SymPy expression or str
        A function that is analytic and real on [-1, 1]. Decimals in a string are exact: ``"0.4"``
        is 2/5. Its symbols other than `u` are parameters, which `bind` sets.
    u : SymPy Symbol or str, optional
        The scaled position. Default: the symbol named ``u``.
    layer : (-1, 1) or None, optional
        With None, A is the drift for all u; it must be analytic between the ends of the interval.
    noise : SymPy expression, number or str, optional
        sigma(u) in du = phi dt + kappa sigma(u) dW, by default 1. It must be analytic and greater
        than 0; like A, it is constant outside the layer.
    ito : {0, "stratonovich"}, optional
        The interpretation of this equation, by default 0, which is Itô's.

    Raises
    ------
    InputError
        If A is singular or complex on [-1, 1] or contains functions that are not analytic, or if
        the noise is not greater than 0.

    Notes
    -----
    All quantities are scaled: u = y/eps, and the drift is that of eq:phi. Two drifts with the same
    formula and equal parameters compare equal, and `repr` gives the call that makes the drift.

    Examples
    --------
    >>> import symasym as sa
    >>> drift = sa.Drift("1/2 - u + b*u**3").bind(b="3/4")
    >>> drift.region
    'crossing'
    >>> drift(0)
    0.5
    >>> sa.Drift("-u", layer=None, noise="1 + u**2/4")
    sa.Drift('-u', layer=None, noise='u**2/4 + 1')
    """

    def __init__(
        self,
        A: Expr | Number,
        u: Symbol | str | None = None,
        *,
        layer: tuple[int, int] | None = (-1, 1),
        noise: Expr | Number | None = None,
        ito: int | str = 0,
    ) -> None:
        if layer is not None and layer != (-1, 1):
            raise InputError(
                f"layer is {shown(layer)}; give (-1, 1), to which u is scaled, or None where A "
                "holds everywhere."
            )
        model = expressions.with_pieces([(A, None)], u, noise, ito, layer is not None)
        self._set(model, {})

    @classmethod
    def of(cls, model: Model, **values: Numbers | None) -> Self:
        """A drift of a model; parameters whose value is not None are bound."""
        drift = cls.__new__(cls)
        drift._set(model, {})
        return drift.bind(**{name: value for name, value in values.items() if value is not None})

    @classmethod
    def piecewise(
        cls,
        pieces: Sequence[tuple[Expr | Number, Number | None]],
        u: Symbol | str | None = None,
        *,
        noise: Expr | Number | None = None,
        ito: int | str = 0,
    ) -> Self:
        """A piecewise drift without a layer, which may have jumps and kinks between its pieces.

        Parameters
        ----------
        pieces : sequence of pairs
            A and the right end of each piece, None for the last; the first extends to -oo.
        u, noise, ito
            As in `Drift`; sigma is the same expression on all pieces.

        Examples
        --------
        >>> import symasym as sa
        >>> drift = sa.Drift.piecewise([("1 - u/2", 0), ("-1 - u/2", None)])
        >>> drift([-0.1, 0.1]).tolist()
        [1.05, -1.05]
        """
        return cls.of(expressions.with_pieces(pieces, u, noise, ito))

    @classmethod
    def general(cls) -> Self:
        """An unspecified drift, for which `symasym.expand` gives formulas in V's derivatives."""
        A, u = Function("A", real=True), Symbol("u")
        return cls.of(Model(pieces=(Formula(A(u), u),), name="Drift.general"))

    # -- parameters ------------------------------------------------------------------------

    def bind(self, /, **values: Numbers) -> Self:
        """A new drift in which these parameters are set.

        Parameters
        ----------
        **values : number or array_like
            Numbers are taken exactly; arrays are converted to float64 and broadcast together.
        """
        bound = dict(self._values)
        for name, value in values.items():
            if name not in self.parameters:
                known = ", ".join(self.parameters)
                raise InputError(
                    f"{name if is_name(name) else shown(name)} is not a parameter of this drift; "
                    + (f"give one of {known}." if known else "it has none, so leave it out.")
                )
            if is_array(value):
                bound[name] = floats(name, value)
                # Results are cached by the drift, so its arrays must not change.
                bound[name].flags.writeable = False
            else:
                bound[name] = exact(name, value)
            if name in (zero := self.model.not_negative) or name in self.model.positive:
                inputs.positive(name, np.min(bound[name]), zero=name in zero)
        drift = type(self).__new__(type(self))
        drift._set(self.model, bound)
        return drift

    def _set(self, model: Model, values: dict[str, Any]) -> None:
        """Refuse values for which A or sigma is not analytic on [-1, 1] or sigma not positive."""
        self.model, self._values = model, values
        if not self.shape and not self.free and model.layered and not model.name:
            expressions.check_regular(self.model.pieces[0], self._values)
            if noise := self.model.noise:
                expressions.check_regular(noise, self._values, "noise")
                expressions.check_noise(noise, self._values, fmpq(-1), fmpq(1))

    # -- values ----------------------------------------------------------------------------

    def __call__(self, u: Numbers) -> Any:
        """phi(u) in float64, inside and outside the layer (eq:phi).

        Parameters
        ----------
        u : float or array_like
            Scaled position, which is broadcast with the parameters.
        """
        result = values_at(self, floats("u", u))
        return float(result) if result.ndim == 0 else result

    # -- region ----------------------------------------------------------------------------

    @property
    def region(self) -> Any:
        """``"crossing"``, ``"sliding"`` or ``"repelling sliding"``, by the signs of a- and a+.

        If parameters are arrays, an array of these. `crossing` stands for both directions; the
        sign of a+ gives the direction.

        Raises
        ------
        RegionError
            At a tangency (a- = 0 or a+ = 0), for which the paper's table has no entry.
        """
        left, right = np.sign(np.array(self.ends))
        for name, signs in (("a-", left), ("a+", right)):
            if not np.all(signs):
                raise RegionError(
                    f"{name} is 0, a tangency, which the paper's table of regions leaves out; "
                    "change a parameter, or ask for a quantity that needs no region."
                )
        sliding = np.where(left > 0, "sliding", "repelling sliding")
        found = np.where(left == right, "crossing", sliding)
        return found if found.ndim else str(found)

    # -- potential and symbols ---------------------------------------------------------------

    def expression(self) -> Expr:
        """A(u) as a SymPy expression, in which bound scalar parameters have their values."""
        if "u" in self.free:
            raise InputError(
                f"{self!r} has a free parameter u, which is the name of the position; bind it, or "
                "rename it."
            )
        return self.model.expression(self._values)

    def phi(self) -> Expr:
        """phi(u) in the real symbol ``u``; for a drift with a layer a SymPy Piecewise (eq:phi)."""
        A = self.expression()
        if not self.model.layered:
            return A
        u = Symbol("u", real=True)
        return Piecewise((A.subs(u, -1), u <= -1), (A, u < 1), (A.subs(u, 1), True))

    def potential(self) -> Expr:
        """V(u) in the real symbol ``u``; for a drift with a layer a SymPy Piecewise (eq:V2).

        If SymPy finds no closed form, the result contains an unevaluated Integral; `potential_at`
        gives numerical values in any case.
        """
        return expressions.potential(self.expression(), self.model.layered)

    def potential_at(self, u: Numbers) -> Any:
        """V(u) with V(-1) = 0 in float64 (eq:V), by quadrature; `u` as in `Drift.__call__`."""
        result = potential_at(self, floats("u", u))
        return float(result) if result.ndim == 0 else result

    def critical_points(self) -> list[CriticalPoint]:
        """The zeros of A in (-1, 1), or of a polynomial drift without a layer all its real zeros,
        from left to right with their multiplicities and kinds.

        Raises
        ------
        RegionError
            If a drift without a layer is no polynomial.
        AccuracyError
            If A vanishes on all of [-1, 1], or two zeros cannot be separated.
        """
        self.scalars()
        end = fmpq(1) if self.model.layered else fmpq(10) ** 300
        if end > 1 and (self.model.cuts or self.exact_coefficients() is None):
            raise RegionError(
                f"{self!r} has no layer; give it one, or a polynomial A, with all zeros known."
            )
        return list(known(*formula_of(self, 0), -end, end))

    def wells(self) -> list[CriticalPoint]:
        """The local minima of V from left to right, as critical points."""
        return [point for point in self.critical_points() if point.kind == "well"]

    def barriers(self) -> list[CriticalPoint]:
        """The local maxima of V from left to right, as critical points."""
        return [point for point in self.critical_points() if point.kind == "barrier"]

    def plot(self, axes: Sequence[Axes] | None = None) -> Any:
        """Plot phi and V in the layer and its neighbourhood, with wells and barriers labelled.

        Parameters
        ----------
        axes : two matplotlib Axes, optional
            The axes for phi and for V, by default those of a new figure. They are returned.

        Examples
        --------
        >>> import matplotlib
        >>> matplotlib.use("agg")
        >>> import symasym as sa
        >>> above, below = sa.friction(mu=3, alpha=1, z0="-0.4").plot()
        >>> [text.get_text() for text in below.texts]
        ['well at 0.3969', 'barrier at 0.9039']
        """
        self.scalars()
        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.subplots(2, sharex=True, layout="constrained")[1]
        above, below = axes
        model, points = self.model, list[CriticalPoint]()
        with suppress(RegionError, AccuracyError):  # they are unknown, or A is 0
            points = self.critical_points()
        cuts = [float(x) for x in model.cuts]
        reach = max([_REACH, *(1.5 * abs(x) for x in (*cuts, *(float(p.u) for p in points)))])
        u = np.linspace(-reach, reach, _POINTS)
        jumps = np.searchsorted(u, cuts)  # at jumps the curve is interrupted
        above.plot(np.insert(u, jumps, np.nan), np.insert(values_at(self, u), jumps, np.nan))
        above.axhline(0, color="0.6", linewidth=0.8)
        above.set_ylabel(r"$\phi(u)$")
        below.plot(u, potential_at(self, u))
        below.set(xlabel="u", ylabel="V(u)")
        for ax in (above, below):
            # The ends of the layer, or of the pieces.
            for end in (-1, 1) if model.layered else cuts:
                ax.axvline(end, color="0.6", linewidth=0.8, linestyle=":")
        named = [p for p in points if p.kind != "inflection"]
        places = np.array([float(p.u) for p in named])
        heights = potential_at(self, places) if named else places
        for ax, y in ((above, 0 * places), (below, heights)):
            ax.plot(places, y, "o", color="0.3", markersize=4)
        for p, place, height in zip(named[:_MOST_NAMES], places, heights, strict=False):
            side, edge = (1, "bottom") if p.kind == "barrier" else (-1, "top")
            below.annotate(
                f"{p.kind} at {place:.4g}", (place, height), xytext=(0, 9 * side),
                textcoords="offset points", ha="center", va=edge, fontsize="small",
            )  # fmt: skip
        below.margins(y=0.2)
        return axes

    def _repr_latex_(self) -> str:
        """A(u) for a notebook; parameters that are free or arrays appear as symbols."""
        A = self.expression()
        long = [x for x in A.atoms(Rational) if x.q > 10**6 or abs(x.p) > 10**18]
        return rf"$\displaystyle \phi(u) = {tex(A.xreplace({x: x.evalf(15) for x in long}))}$"
