"""Formulas of + - * / and whole powers, for numbers of any one kind.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import Any, Protocol


class Ratios(Protocol):
    """Numbers of one kind that are added, multiplied and divided, as positive ones may be."""

    def __add__(self, other: Any, /) -> Any: ...
    def __radd__(self, other: Any, /) -> Any: ...
    def __mul__(self, other: Any, /) -> Any: ...
    def __rmul__(self, other: Any, /) -> Any: ...
    def __truediv__(self, other: Any, /) -> Any: ...
    def __rtruediv__(self, other: Any, /) -> Any: ...


class Field(Ratios, Protocol):
    """Numbers of one kind: floats or arrays of them, rationals, mpf, balls, expressions."""

    def __neg__(self) -> Any: ...
    def __sub__(self, other: Any, /) -> Any: ...
    def __rsub__(self, other: Any, /) -> Any: ...
    def __pow__(self, other: int, /) -> Any: ...


def scaled_radius(r: Ratios, eps: Ratios) -> Any:
    """r/eps, the radius in scaled variables (eq:tilder)."""
    return r/eps


def escape_time_of_halves(w: Ratios, sigma_left: Ratios, sigma_right: Ratios) -> Any:
    """T from sigma on both sides and w, the sum of both (positive-form)."""
    return w/(1/sigma_left + 1/sigma_right)


def exit_share(sigma_left: Ratios, sigma_right: Ratios) -> Any:
    """C from sigma on both sides (positive-form)."""
    return 1/(1 + sigma_left/sigma_right)


def density_of_halves(lam: Ratios, w: Ratios) -> Any:
    """p_ss from w, the sum of both sides (positive-density)."""
    return lam/w


def occupation_share(inside: Ratios, outside: Ratios) -> Any:
    """P from the integrals inside and outside, in one unit (positive-density)."""
    return 1/(1 + outside/inside)


def tail_left(a_minus: Ratios) -> Any:
    """w at -1 (positive-density)."""
    return 1/a_minus


def tail_right(a_plus: Ratios) -> Any:
    """w at 1, from the right (positive-density)."""
    return -1/a_plus


def carried(
    lam: Ratios,
    w: Ratios,
    int_e: Ratios,
    int_inverse: Ratios,
    nested: Ratios,
    fall: Ratios,
    climb: Ratios,
    sigma: Ratios,
) -> Any:
    """sigma and w after a panel (panel-step)."""
    return (
        (int_e + climb*sigma)/fall, (fall*w + int_inverse*lam)/(climb + int_e/sigma) +
        lam*nested/(int_e + climb*sigma)
    )


def absorbed(lam: Ratios, int_e: Ratios, nested: Ratios, fall: Ratios) -> Any:
    """sigma and w after a panel that begins at an absorbing end (panel-step)."""
    return int_e/fall, lam*nested/int_e


def saddle_first(V2: Field, V3: Field, V4: Field) -> Any:
    """Coefficient of 1/lam in a well's series; of -V, a barrier's (saddle-series)."""
    return -V4/(8*V2**2) + 5*V3**2/(24*V2**3)


def saddle_second(V2: Field, V3: Field, V4: Field, V5: Field, V6: Field) -> Any:
    """Coefficient of 1/lam^2 in the series of `saddle_first` (saddle-series)."""
    return (
        -V6/(48*V2**3) + 35*V4**2/(384*V2**4) + 385*V3**4/(1152*V2**6) - 35*V4*V3**2/(64*V2**5)
        + 7*V3*V5/(48*V2**4)
    )


def friction_coefficients(mu: Field, alpha: Field, z0: Field) -> Any:
    """Coefficients of A(u) in ascending powers of u (eq:phifric0)."""
    return 1 - z0, -alpha*(1 + mu), 0, alpha*mu
