"""From the physical parameters (eps, kappa, r) to the scaled ones, and back."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symasym.base.call_context import mpf_of, own_context, to_mpf
from symasym.base.inputs import (
    Floats,
    Number,
    Numbers,
    exact,
    float_text,
    floats,
    is_array,
    positive,
    to_float,
)
from symasym.base.texts import number_text

__all__ = ["Scales", "rescale"]

_DIGITS = 60


@dataclass(frozen=True)
class Scales:
    """Scaled noise and radius, and the unit of time.

    Attributes
    ----------
    kappa, r : number
        kappa/sqrt(eps) and r/eps, to pass to functions such as `escape_time`.
    time : number
        Physical time per unit of scaled time, eps. So slow variables, frozen in the scaled
        equation, move by this times their velocity in a unit of scaled time.
    """

    kappa: Any
    r: Any
    time: Any

    def drag_time(self, distance: Number, velocity: Number = 1) -> Floats:
        """Scaled time in which a slow variable goes a distance: the distance over eps velocity.

        With the distance that the drift can bear, such as that to a fold, a time T of the scaled
        equation describes the whole system where it is far shorter.

        Parameters
        ----------
        distance, velocity : number
            Physical, greater than 0.

        Examples
        --------
        >>> import symasym as sa
        >>> scales = sa.rescale(eps="0.01", kappa="0.01", r="0.1")
        >>> round(scales.drag_time("0.378"), 3)  # of friction, from z0 = -0.4 to the fold
        37.8
        """
        way, speed = (
            positive(name, exact(name, x))
            for name, x in (("distance", distance), ("velocity", velocity))
        )
        if is_array(self.time):
            return to_float("distance/velocity", way / speed) / floats("time", self.time)
        return to_float("the drag time", way / speed / self.time)

    def __repr__(self) -> str:
        return f"Scales({', '.join(f'{name}={_shown(x)}' for name, x in vars(self).items())})"


def _shown(x: Any) -> str:
    """A number as a short decimal, or to 15 digits."""
    if not isinstance(x, Fraction):
        return str(x)
    # A fraction of as many digits is shorter in float64.
    exactly = number_text(x) if max(abs(x.numerator), x.denominator) < 10**20 else "/"
    if len(exactly) < 20 and "/" not in exactly:
        return exactly
    try:
        return f"{float(x):.15g}"
    except OverflowError:
        return float_text(x)


def rescale(eps: Numbers, kappa: Numbers, r: Numbers = 1) -> Scales:
    """Scale noise amplitude and radius by the width of the switch (eq:tildexykappa, eq:tilder).

    A time T of the scaled equation describes the whole system where eps T, the way that a slow
    variable of unit velocity goes meanwhile, changes its drift by little (docs/limits.md).

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
        Exact rationals where the square root of `eps` is rational; otherwise
        `kappa` is an mpf right to 60 digits.

    Raises
    ------
    InputError
        For a value that is not a finite number greater than 0.

    Examples
    --------
    >>> import symasym as sa
    >>> s = sa.rescale(eps="0.01", kappa="0.03", r="0.1")
    >>> s
    Scales(kappa=0.3, r=10, time=0.01)
    >>> s.kappa
    Fraction(3, 10)
    """
    if any(map(is_array, (eps, kappa, r))):
        from symasym.base.errors import InputError

        arrays = {name: floats(name, x) for name, x in (("eps", eps), ("kappa", kappa), ("r", r))}
        for name, x in arrays.items():
            if not (x > 0).all():
                raise InputError(f"{name} has an entry {x.min():.6g}; it must be greater than 0.")
        try:
            widths, noises, radii = np.broadcast_arrays(*arrays.values())
        except ValueError:
            shapes = ", ".join(f"{n} {x.shape}" for n, x in arrays.items())
            raise InputError(
                f"the shapes do not broadcast ({shapes}); "
                "give arrays of shapes that NumPy broadcasts."
            ) from None
        with np.errstate(over="ignore"):
            scaled = Scales(noises / np.sqrt(widths), radii / widths, widths.copy())
        if not (np.isfinite(scaled.kappa).all() and np.isfinite(scaled.r).all()):
            raise InputError(
                f"eps has an entry {widths.min():.6g}, for which the scaled numbers leave float64; "
                "pass one value at a time, as a string."
            )
        return scaled
    e, k, radius = (
        positive(name, exact(name, x)) for name, x in (("eps", eps), ("kappa", kappa), ("r", r))
    )
    noise = k / root if (root := _root(e)) else _noise(k, e)
    return Scales(noise, radius / e, e)


def _root(x: Fraction) -> Fraction | None:
    """The square root of a rational where it is rational, else None."""
    from math import isqrt

    root = Fraction(isqrt(x.numerator), isqrt(x.denominator))
    return root if root * root == x else None


def _noise(k: Fraction, e: Fraction) -> Any:
    """k/sqrt(e) as an mpf, right to 60 digits (eq:tildexykappa)."""
    with own_context(_DIGITS + 5) as context:
        kappa, eps = (mpf_of(x, context) for x in (k, e))
        return to_mpf(kappa / context.sqrt(eps), _DIGITS)
