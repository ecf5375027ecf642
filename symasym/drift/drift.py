"""The scaled drift of a smoothed switch, phi(u): what every quantity is asked of."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from flint import fmpq

from symasym.base.errors import InputError, RegionError
from symasym.base.inputs import (
    Numbers,
    common_shape,
    exact,
    floats,
    is_array,
    is_name,
    shown,
)
from symasym.drift import landscape, models

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from sympy import Expr, Symbol

    from symasym.base.inputs import Number
    from symasym.drift.critical_points import CriticalPoint

__all__ = ["Drift"]


class Drift:
    """The scaled drift: a- for u <= -1, A(u) on [-1, 1], a+ for u >= 1 (eq:phi).

    Parameters
    ----------
    A : SymPy expression or str
        Analytic and real on [-1, 1]. In a string, decimals are exact: ``"0.4"``
        is 2/5. Its symbols other than `u` are parameters, set with `bind`.
    u : SymPy Symbol or str, optional
        The scaled position. Default: the symbol named ``u``.
    a_minus, a_plus : SymPy expression or number, optional
        The drift outside, A(-1) and A(1) when left out. They are compared with
        A(-1) and A(1) (eq:cont), exactly if rational, else to 40 digits.
    layer : (-1, 1) or None, optional
        None: A holds everywhere, analytic between the ends that are asked for.
    noise : SymPy expression, number or str, optional
        sigma(u) of du = phi dt + kappa sigma(u) dW, 1 when left out: analytic and greater than 0,
        constant outside the layer as A is.
    ito : {0, "stratonovich"}, optional
        How that equation is meant: 0 by Ito.

    Raises
    ------
    InputError
        If the drift jumps at u = -1 or 1, is singular or complex on [-1, 1], or is made
        of functions that are not analytic; if the noise is not greater than 0.

    Notes
    -----
    All quantities are scaled: u = y/eps, and the drift is that of eq:phi. Drifts are values: those
    of one formula and equal parameters are equal, and `repr` is the call that makes the drift.

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
        a_minus: Expr | Number | None = None,
        a_plus: Expr | Number | None = None,
        *,
        layer: tuple[int, int] | None = (-1, 1),
        noise: Expr | Number | None = None,
        ito: int | str = 0,
    ) -> None:
        from symasym.drift import expressions

        self._model: models.Model = expressions.read_drift(A, u, a_minus, a_plus, layer, noise, ito)
        self._values: dict[str, Any] = {}
        self._check()

    @classmethod
    def of(cls, model: models.Model, **values: Numbers | None) -> Self:
        """A drift from one of `symasym.drift.models`, with the parameters bound that are given."""
        drift = cls.__new__(cls)
        drift._model, drift._values = model, {}
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
        """A drift of pieces without a layer; it may have jumps and kinks between them.

        Parameters
        ----------
        pieces : sequence of pairs
            A and the piece's right end, which is None for the last; the first one has no left end.
        u, noise, ito
            As in `Drift`; sigma is the same expression on all pieces.

        Examples
        --------
        >>> import symasym as sa
        >>> drift = sa.Drift.piecewise([("1 - u/2", 0), ("-1 - u/2", None)])
        >>> drift([-0.1, 0.1]).tolist()
        [1.05, -1.05]
        """
        from symasym.drift import expressions

        return cls.of(expressions.with_pieces(pieces, u, noise, ito))

    @classmethod
    def general(cls) -> Self:
        """No drift in particular, of which `symasym.expand` states formulas in V's derivatives."""
        return cls.of(models.General())

    # -- parameters ------------------------------------------------------------------------

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, bound or free."""
        return self._model.parameters

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that have no value yet."""
        return tuple(name for name in self.parameters if name not in self._values)

    @property
    def values(self) -> dict[str, Any]:
        """The bound parameters, each a Fraction or a float64 array."""
        return dict(self._values)

    @property
    def model(self) -> models.Model:
        """The formula of A, which drifts of other parameters share."""
        return self._model

    @property
    def name(self) -> str:
        """Name of the model, e.g. ``"friction"``."""
        return self._model.name

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Common shape of the parameters, () unless some are arrays."""
        return common_shape({k: np.shape(v) for k, v in self._values.items() if is_array(v)})

    def bind(self, /, **values: Numbers) -> Self:
        """A new drift with these parameters set.

        Parameters
        ----------
        **values : number or array_like
            Numbers are taken exactly; arrays become float64 and broadcast together.
        """
        bound = dict(self._values)
        for name, value in values.items():
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none at all"
                raise InputError(
                    f"{name if is_name(name) else shown(name)} is no parameter of this drift; its "
                    f"parameters are {known}."
                )
            if is_array(value):
                bound[name] = floats(name, value)
                # A drift is a value: what was asked of it stays true.
                bound[name].flags.writeable = False
            else:
                bound[name] = exact(name, value)
            models.check_range(self._model, name, bound[name])
        drift = type(self).__new__(type(self))
        drift._model, drift._values = self._model, bound
        _ = drift.shape
        drift._check()
        return drift

    def _check(self) -> None:
        """Refuse values at which A or sigma is not analytic on [-1, 1], or sigma not positive."""
        model, noise = self._model.pieces[0], self._model.noise
        known = not self.free and not self.shape and self._model.layered
        if known and isinstance(model, models.Expression):
            from symasym.drift import expressions

            expressions.check_regular(model, self._values)
            if noise:
                expressions.check_regular(noise, self._values, "noise")
                expressions.check_noise(noise, self._values, fmpq(-1), fmpq(1))

    def scalars(self) -> dict[str, Fraction]:
        """The exact parameter values; an error if some are free or arrays."""
        self.require_bound()
        for name, value in self._values.items():
            if is_array(value):
                raise InputError(
                    f"{name} is an array, where one value is taken; pass one at a time, or leave "
                    "dps and full out where they are given."
                )
        return self._values

    def require_bound(self) -> None:
        """Raise unless every parameter has a value."""
        if self.free:
            raise InputError(
                f"the drift's parameters {', '.join(self.free)} have no value; set them with "
                f"bind({self.free[0]}=…)."
            )

    # -- values ----------------------------------------------------------------------------

    def exact_coefficients(self) -> list[Fraction] | None:
        """Rational coefficients of A in ascending powers; None if A is no such polynomial."""
        return None if self._coefficients is None else [*self._coefficients]

    @cached_property
    def _coefficients(self) -> list[Fraction] | None:
        known = self._model.coefficients(self.scalars())
        while known and len(known) > 1 and known[-1] == 0:
            known.pop()
        return known

    def __call__(self, u: Numbers) -> Any:
        """phi(u) in float64, a- and a+ included (eq:phi).

        Parameters
        ----------
        u : float or array_like
            Scaled position, broadcast with the parameters.
        """
        from symasym.drift.sampled import in_floats

        position = floats("u", u)
        shape = common_shape({"drift": self.shape, "u": position.shape})
        inside = np.clip(position, -1.0, 1.0) if self._model.layered else position
        self.require_bound()
        values = {name: floats(name, value) for name, value in self._values.items()}
        result = np.broadcast_to(in_floats(self._model, inside, values), shape)
        return float(result) if result.ndim == 0 else result.copy()

    # -- region ----------------------------------------------------------------------------

    @cached_property
    def ends(self) -> tuple[Any, Any]:
        """The pair of a- and a+, Fractions where rational, else floats, or arrays."""
        self.require_bound()
        if not self._model.layered:
            raise RegionError(
                f"{self!r} has no layer, and so no a- and a+; give ends=(…) to what is asked of it."
            )
        return landscape.end(self, -1), landscape.end(self, 1)

    def end(self, side: int) -> Fraction | None:
        """A(side), side = -1 or 1, where it is rational and known without rounding, else None."""
        coefficients = self.exact_coefficients()
        if coefficients is not None:
            return sum((c * side**k for k, c in enumerate(coefficients)), Fraction(0))
        known: Fraction | None = self._model.end(self._values, side)
        return known

    @property
    def region(self) -> Any:
        """``"crossing"``, ``"sliding"`` or ``"repelling sliding"``, by the signs of a- and a+.

        An array of these where parameters are arrays. `crossing` holds for both
        directions; the sign of a+ is the direction.

        Raises
        ------
        RegionError
            At a tangency, a- = 0 or a+ = 0, where the table has no entry.
        """
        a_minus, a_plus = self.ends
        return landscape.region(a_minus, a_plus)

    # -- landscape and symbols ---------------------------------------------------------------

    def expression(self) -> Expr:
        """A(u) as a SymPy expression, bound scalar parameters put in."""
        if "u" in self.free:
            raise InputError(
                f"{self!r} has a free parameter u, which is the name of the position; bind it, or "
                "rename it."
            )
        from symasym.drift import expressions

        return expressions.expression(self._model, self._values)

    def phi(self) -> Expr:
        """phi(u) as a SymPy Piecewise in the real symbol ``u`` (eq:phi)."""
        from symasym.drift import expressions

        return expressions.phi(self.expression())

    def potential(self) -> Expr:
        """V(u) as a SymPy Piecewise in the real symbol ``u`` (eq:V2).

        The middle piece is an unevaluated Integral where SymPy finds no closed
        form; `potential_at` gives its numbers in any case.
        """
        from symasym.drift import expressions

        return expressions.potential(self.expression())

    def potential_at(self, u: Numbers) -> Any:
        """V(u) in float64 (eq:V), with V(-1) = 0, by quadrature; as `Drift.__call__`."""
        return landscape.potential_at(self, floats("u", u))

    def critical_points(self) -> list[CriticalPoint]:
        """Zeros of A in (-1, 1), left to right, with multiplicity and kind.

        Raises
        ------
        AccuracyError
            If A vanishes on all of [-1, 1], or zeros cannot be told apart.
        """
        from symasym.drift.critical_points import critical_points

        return critical_points(self)

    def wells(self) -> list[CriticalPoint]:
        """Local minima of V in (-1, 1), left to right, as critical points."""
        return [point for point in self.critical_points() if point.kind == "well"]

    def barriers(self) -> list[CriticalPoint]:
        """Local maxima of V in (-1, 1), left to right, as critical points."""
        return [point for point in self.critical_points() if point.kind == "barrier"]

    def plot(self, axes: Sequence[Axes] | None = None) -> Any:
        """Draw phi and V over the layer and beside it, with their wells and barriers named.

        Parameters
        ----------
        axes : two matplotlib Axes, optional
            For phi and for V; those of a new figure when left out. They are returned.

        Examples
        --------
        >>> import matplotlib
        >>> matplotlib.use("agg")
        >>> import symasym as sa
        >>> above, below = sa.friction(mu=3, alpha=1, z0="-0.4").plot()
        >>> [text.get_text() for text in below.texts]
        ['well at 0.3969', 'barrier at 0.9039']
        """
        from symasym.drift.plot import plot

        return plot(self, axes)

    # -- as a value ------------------------------------------------------------------------

    def _key(self) -> tuple[Any, ...]:
        """The value by which this drift is compared and hashed."""
        return self._model, tuple(
            (name, (value.shape, value.tobytes()) if is_array(value) else value)
            for name, value in sorted(self._values.items())
        )

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Drift) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        """The call that makes this drift, ``sa`` being symasym; long arrays are shortened."""
        return self._model.source(
            {x: y for x in self.parameters if (y := self._values.get(x)) is not None}
        )

    def _repr_latex_(self) -> str:
        """A(u) for a notebook; parameters that are free or arrays stay symbols."""
        from symasym.drift import expressions

        return rf"$\displaystyle \phi(u) = {expressions.latex(self.expression())}$"
