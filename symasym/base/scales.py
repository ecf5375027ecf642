"""Conversion of the physical parameters (eps, kappa, r) to scaled ones."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy as np

from symasym.base.balls import exact_ball, precision, rounded
from symasym.base.inputs import Numbers, common_shape, floats, is_array, positive

__all__ = ["Scales", "rescale"]

_DIGITS = 60


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
    given = {"eps": eps, "kappa": kappa, "r": r}
    if any(map(is_array, given.values())):
        arrays = {name: floats(name, x) for name, x in given.items()}
        for name, x in arrays.items():
            positive(name, x.min())
        common_shape({name: x.shape for name, x in arrays.items()})
        widths, noises, radii = np.broadcast_arrays(*arrays.values())
        with np.errstate(over="ignore"):
            return Scales(noises / np.sqrt(widths), radii / widths, widths.copy())
    e, k, radius = (positive(name, x) for name, x in given.items())
    root = Fraction(isqrt(e.numerator), isqrt(e.denominator))
    noise: Any = k / root
    if root * root != e:
        with precision(4 * _DIGITS):
            noise = rounded(exact_ball(k) / exact_ball(e).sqrt(), _DIGITS)[0]
    return Scales(noise, radius / e, e)
