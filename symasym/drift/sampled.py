"""A(u) in float64 for many rows of parameter values at once.

A drift is an ordered list of formulas, each analytic on its interval; outside a layer it is
constant. Noise sigma(u) enters by phi/sigma^2 and log sigma; powers of sigma are the weights of
the scale and speed densities (`symasym.drift.evaluate.Piece`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from flint import acb, arb, fmpq

from symasym.base.balls import cached_property, precision, rational
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray, common_shape, floats
from symasym.drift.evaluate import box, halved, profile
from symasym.drift.formula import Formula
from symasym.drift.model import Parametrized

#: The number of Chebyshev terms by which a non-polynomial drift is approximated on a panel.
ANALYTIC = 20
_ELLIPSES = (8, 11, 16, 32, 64)  # sums of semi-axes, in units of half a panel's width
_MOST = 1_000  # the largest number of panels
_BITS = 192  # enough digits remain if float64 numbers cancel
_POINTS = np.cos(np.pi * (np.arange(33) + 0.5) / 33)


def values_at(drift: Parametrized, u: FloatArray) -> FloatArray:
    """phi(u) inside and outside the layer, with u broadcast with the parameters."""
    shape = common_shape({"drift": drift.shape, "u": u.shape})
    drift.require_bound()
    model, inside = drift.model, np.clip(u, -1.0, 1.0) if drift.model.layered else u
    values = {name: floats(name, value) for name, value in drift.values.items()}
    which = np.searchsorted([float(x) for x in model.cuts], inside, side="right")
    parts = [_in_floats(of, inside, values) for of in model.pieces]
    found = np.select([which == k for k in range(len(parts))], parts)
    return np.broadcast_to(found, shape).copy()


def _in_floats(formula: Formula, u: Any, values: Mapping[str, Any]) -> Any:
    with np.errstate(all="ignore"):
        return formula.value(u, values, balls=False)


def _long(x: Any) -> Any:
    """An array or a rational number in long double."""
    if isinstance(x, np.ndarray):
        return x.astype(np.result_type(x, np.longdouble))
    above, below = x.as_integer_ratio()
    return np.longdouble(above) / np.longdouble(below)


class Sampled:
    """phi/sigma^2 by one formula for rows of parameter values, which may be complex.

    `terms` Chebyshev terms approximate it on each panel of `span` between `cuts`; `exact` is True
    for polynomials, and `long` if these are evaluated in long double and then rounded.
    """

    def __init__(
        self,
        formulas: list[Formula],
        numbers: Mapping[str, Any],
        rows: int,
        span: tuple[float, float],
        long: bool,
        ready_made: bool,
    ):
        self.formulas, self.span, self.long = formulas, span, False
        formula = formulas[0]
        self._numbers, self._rows = numbers, rows
        self.arrays = {k: x for k, x in numbers.items() if isinstance(x, np.ndarray)}
        self.floats: dict[str, Any] = {
            k: x if k in self.arrays else np.float64(float(x)) for k, x in numbers.items()
        }
        self._c: list[Any] | None = None
        if formula.powers and len(formulas) == 1:
            with np.errstate(all="ignore"):
                own = ready_made or formula.steady
                self._c = formula.coefficients(self.floats, False) if own else self._rounded()
        self.exact = self._c is not None
        self.terms = ANALYTIC if self._c is None else len(self._c)
        if long and self.exact:
            c: Any = None if self.arrays else formula.exact_coefficients(numbers)
            if self.arrays and ready_made:  # of other arrays the coefficients' rounding is unknown
                c = formula.coefficients({k: _long(x) for k, x in numbers.items()}, balls=False)
            if c:
                self._c, self.long = [_long(x) for x in c], True

    def _rounded(self) -> list[Any]:
        """The coefficients, each rounded once, of a formula in which terms may cancel."""
        turned = any(map(np.iscomplexobj, self.arrays.values()))
        ball: Any = acb if turned else arb
        number: Any = complex if turned else float
        found = []
        with precision(_BITS):
            columns = {k: [ball(y) for y in x.tolist()] for k, x in self.arrays.items()}
            shared = {k: rational(x) for k, x in self._numbers.items() if k not in columns}
            for row in range(self._rows if columns else 1):
                values = {**shared, **{k: x[row] for k, x in columns.items()}}
                c = self.formulas[0].coefficients(values, balls=True) or ()
                found.append([number(ball(x)) for x in c])
        return list(np.array(found).T) if columns else list(np.array(found[0]))

    def __call__(self, u: Any, rows: Any) -> Any:
        """The values at `u` of shape (n, len(rows)), column j for the parameters of rows[j]."""
        if self._c is None:
            return self._at(0, u, rows)
        c = [x[rows] if np.ndim(x) else x for x in self._c]
        value, u = c[-1] + 0 * u, u.astype(np.longdouble) if self.long else u
        for x in c[-2::-1]:
            value = value * u + x
        return value.astype(complex if np.iscomplexobj(value) else float)

    def log_noise(self, u: Any, rows: Any) -> Any:
        """log sigma at `u`."""
        return self._at(1, u, rows) if self.formulas[1:] else 0 * u

    def _at(self, k: int, u: Any, rows: Any) -> Any:
        values = {n: x[rows] if n in self.arrays else x for n, x in self.floats.items()}
        return _in_floats(self.formulas[k], u, values)

    def majorant(self, far: Any, rows: Any) -> Any:
        """For polynomials, the sum of the absolute values of the terms at |u| = `far`."""
        c = [np.asarray(abs(x[rows] if np.ndim(x) else x), float) for x in self._c or ()]
        return sum(x * far**k for k, x in enumerate(c))

    @cached_property
    def rounding(self) -> tuple[float, float]:
        """Estimates of the relative rounding error of the values, and of the error of log sigma.

        Twice the largest error at 33 points in the rows with the least and largest parameters.
        """
        rows = {int(f(np.abs(x))) for x in self.arrays.values() for f in (np.argmin, np.argmax)}
        points, worst = self._inside(_POINTS), [0.0, 0.0]
        own: tuple[Any, Any] = self, self.log_noise
        for row in rows or {0}:
            at = np.array([row])
            with precision(160):
                # The real parts of a row's parameters.
                shared = self._numbers.items()
                of_row = {k: rational(x[row].real if k in self.arrays else x) for k, x in shared}
                for k, (formula, of) in enumerate(zip(self.formulas, own, strict=False)):
                    phi = profile(formula, of_row)
                    values = of(points[:, None], at)[:, 0].real
                    pairs = zip(points.tolist(), values.tolist(), strict=True)
                    errors = [float(abs(phi(arb(u)) - arb(x)).upper()) for u, x in pairs]
                    size = k or float(np.abs(values).max()) or 1.0
                    worst[k] = max(worst[k], 2 * max(errors) / size)
        return worst[0], worst[1]

    def _inside(self, points: Any) -> Any:
        low, high = self.span
        return (low + high) / 2 + (high - low) / 2 * points

    @cached_property
    def cuts(self) -> Any:
        """The ends of panels on which `terms` suffice for 1e-16 of its size; None if too many.

        If |phi| <= M in the ellipse with foci at a panel's ends whose semi-axes add up to rho half
        widths, n terms have an error of at most 4 M rho^(1-n)/(rho - 1). For rows that differ, the
        panels are those for the least and for the largest parameters, which is no proof.
        """
        if self.exact:
            return np.empty(0)
        u = self._inside(_POINTS)[:, None] + np.zeros(self._rows)
        size = float(np.abs(self(u, np.arange(self._rows))).max(axis=0).min())
        found: set[float] = set()
        for of in (np.min, np.max):
            corner = ((k, rational(of(np.real(x)))) for k, x in self._numbers.items())
            if not (some := _begins(tuple(self.formulas), tuple(corner), size, self.span)):
                return None
            found |= some
        return np.array(sorted(found - {self.span[0]}))


@lru_cache(maxsize=256)
def _begins(
    formulas: tuple[Formula, ...],
    numbers: tuple[tuple[str, fmpq], ...],
    size: float,
    span: tuple[float, float],
) -> set[float]:
    """The left ends of panels on which `ANALYTIC` terms suffice; empty if these are too many."""
    with precision(128):
        known = [profile(of, dict(numbers)) for of in formulas]
        allowed = arb(size) * 1e-16, arb(1e-16)

        def holds(middle: fmpq, half: fmpq) -> bool:
            return all(_held(f, middle, half, x) for f, x in zip(known, allowed, strict=False))

        low, high = map(rational, span)
        found, lost = halved(low, high, holds, _MOST, _MOST)
    return {float(a) for a in found} if lost is None else set()


def _held(phi: Any, middle: fmpq, half: fmpq, allowed: arb) -> bool:
    """True if the error of `ANALYTIC` Chebyshev terms is proved to be at most `allowed`."""
    for rho in _ELLIPSES:
        width, height = half * fmpq(rho**2 + 1, 2 * rho), half * fmpq(rho**2 - 1, 2 * rho)
        largest = abs(phi(box(middle, width, height)))
        if largest * 4 < allowed * arb(rho) ** (ANALYTIC - 1) * (rho - 1):
            return True
        if not largest.is_finite():
            break
    return False


class FloatDrift:
    """phi/sigma^2 for rows of parameters: `parts` from left to right, and `ends` outside a layer.

    Parameters that are not arrays are shared by the rows, and exact if rational; the arrays in
    `changed` replace values. `span` is the interval on which a drift without a layer is needed; if
    `long`, polynomials are evaluated in long double. The scale and speed densities are e^{lam V}
    and lam e^{-lam V} times the powers `powers` of sigma, which are None if sigma = 1.
    """

    def __init__(
        self,
        drift: Parametrized,
        changed: Mapping[str, Any],
        rows: int,
        span: tuple[float, float] = (-1.0, 1.0),
        long: bool = False,
    ):
        self._drift, self._rows, model = drift, rows, drift.model
        numbers = {**drift.values, **changed}
        self.layered, self.ready_made = model.layered, bool(model.name)
        low, high = (-1.0, 1.0) if model.layered else span
        marks = [low, *np.clip([float(x) for x in model.cuts], low, high).tolist(), high]
        self.parts = [
            Sampled(formulas, numbers, rows, (a, b), long, self.ready_made)
            for formulas, (a, b) in zip(model.weighted, pairwise(marks), strict=True)
            if a < b
        ]
        self.exact = all(part.exact for part in self.parts)
        twice = float(2 * model.alpha)
        self.powers = (-twice, twice - 2.0) if model.noise else None

    @cached_property
    def ends(self) -> list[Any]:
        """a-/sigma^2 and a+/sigma^2 for the rows."""
        every, (part,) = np.arange(self._rows), self.parts

        def at(side: int) -> Any:
            if part.exact and part.arrays:
                return part(np.full((1, self._rows), float(side)), every)[0]
            if part.arrays:
                return part.formulas[0].end(side, part.floats, balls=False) + np.zeros(self._rows)
            return np.full(self._rows, float(part.formulas[0].ends(self._drift.values)[side > 0]))

        return [at(-1), at(1)]


def potential_at(drift: Parametrized, u: FloatArray) -> FloatArray:
    """V in float64 with V(-1) = 0, by Gauss-Legendre quadrature on the panels of `Sampled`."""
    drift.require_bound()
    model = drift.model
    position = np.broadcast_to(u, common_shape({"drift": drift.shape, "u": u.shape}))
    low, high = (-1.0, 1.0) if model.layered else (min(u.min(), -1.0), max(u.max(), -1.0))
    inside = np.clip(position, low, high)
    arrays = {k: x for k, x in drift.values.items() if isinstance(x, np.ndarray)}
    rows = {k: np.broadcast_to(x, drift.shape).ravel() for k, x in arrays.items()}
    cuts, terms = set[float](), 0
    for row in range(math.prod(drift.shape)):
        of = FloatDrift(drift, {k: x[row : row + 1] for k, x in rows.items()}, 1, (low, high))
        for part in of.parts:
            if part.cuts is None:
                raise AccuracyError(f"V of {drift!r} takes too many panels; take a less steep A.")
            cuts.update(part.span, part.cuts.tolist())
            terms = max(terms, part.terms)
        if of.exact:  # polynomials, for all parameters
            break
    rule = np.polynomial.legendre.leggauss(terms // 2 + 1)
    with np.errstate(over="ignore", invalid="ignore"):
        total: FloatArray = -values_at(drift, position) * (position - inside)
        for left, right in pairwise(sorted(cuts)):
            start = min(max(-1.0, left), right)
            half = (np.clip(inside, left, right) - start) / 2
            for node, weight in zip(*rule, strict=True):
                total = total - weight * half * values_at(drift, start + half * (1 + node))
    if not np.isfinite(total).all():
        raise RangeError(
            f"V of {drift!r} leaves the range of float64; rescale the drift, or give u nearer to 0."
        )
    return np.asarray(total)
