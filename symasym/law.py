"""The law of the exit time tau: moments, transform, rates, survival, density and quantiles.

With eta and zeta from the left end (-) and the right end (+) at the start (`symasym.exact.balls`),

    W = eta_- zeta_+ + eta_+ zeta_-,    W(s)/W(0) = prod (1 + s/lambda_k),
    E[e^{-s tau}; right] = eta_- zeta_+(0)/W,    E[e^{-s tau}; left] = eta_+ zeta_-(0)/W

(Darling & Siegert, Ann. Math. Statist. 24 (1953) 624; Kent, Ann. Probab. 8 (1980) 206).

- *Rates.* S_n = sum lambda_k^-n follows from W, and S_n^(-1/n) < lambda_1 (Euler, Rayleigh).
  Newton's iterates for a polynomial with real zeros do not pass the first zero, so that each is a
  proved lower bound; a change of sign of W proves an upper bound. The other rates follow after
  division of W by 1 + s/lambda_1, which starts at the last coefficient.
- *Large times.* P(tau > t) = sum c_k e^{-lambda_k t}, c_k lambda_k = N(-lambda_k)/W'(-lambda_k). By
  the Cauchy-Schwarz inequality the sum of the terms with lambda_k >= Lambda is below
  (Lambda G M)^(1/2) e^{-Lambda t} if 2 Lambda t > 1, where G is their part of Green's function
  eta_- eta_+/W at s = 0 and M the mass of the speed measure. The error is a bound.
- *Small times.* Talbot's contour for the inverse transform (Weideman & Trefethen, Math. Comp. 76
  (2007) 1341); the error is an estimate, from two numbers of nodes.
- *Narrow laws and rare times.* The trapezoidal rule on Re s = c (Abate & Whitt, Queueing Systems 10
  (1992) 5), with c near the minimum of e^{c t} E[e^{-c tau}], a bound on the probability."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from flint import acb, arb

from symasym.base import inputs
from symasym.base.balls import cached_property, rational, rounded
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import Number, Numbers
from symasym.drift import scenes
from symasym.drift.drift import Drift
from symasym.exact.exit_time import ORDER, Exit
from symasym.exact.spectral import ExitTransform as Series
from symasym.methods import in_digits

__all__ = ["ExitLaw", "exit_law"]

_TINY = 1e-300


def exit_law(
    drift: Drift,
    kappa: Number,
    r: Number | None = None,
    *,
    ends: scenes.Ends | None = None,
    start: Number = 0,
    reflecting: Literal["left", "right"] | None = None,
    dps: int | None = None,
    full: bool = False,
) -> ExitLaw:
    """The law of the time tau at which u leaves (-r, r), or the interval between two ends.

    Parameters
    ----------
    drift : Drift
        A drift whose parameters all have numerical values.
    kappa : number
        Scaled noise amplitude, greater than 0.
    r : number
        Scaled escape radius.
    ends : pair of numbers, optional
        The ends of the interval in place of -r and r.
    start : number, optional
        Scaled starting point, between the ends.
    reflecting : {"left", "right"}, optional
        The end that is reflecting.
    dps : int, optional
        The number of digits of an mpf, 1 to 1,000. By default results are floats.
    full : bool
        Return every number as an `Estimate`.

    Returns
    -------
    ExitLaw

    Raises
    ------
    InputError
        If a value is outside its range or an array, or if a parameter is free.

    Examples
    --------
    >>> import symasym as sa
    >>> law = sa.exit_law(sa.Drift("-u", layer=None), 1, 2)
    >>> print(f"{law.mean:.10f} {law.std:.10f} {law.survival(30):.10f}")
    27.4327391525 26.6969514808 0.3341812275
    >>> print(law.rate)
    0.03746120928167515768 ± 2.82e-18 (proved bound, exact)
    """
    scenes.require_drift(drift, plain=False)
    numbers = scenes.between(kappa, r, ends, start)
    inputs.choice("reflecting", reflecting, [None, "left", "right"])
    scene = scenes.read(drift, numbers, reflecting).one()
    digits, full = inputs.digits(dps, 1_000), inputs.flag("full", full)
    found = Exit(scene, reflecting, scenes.FLOAT_DIGITS if digits is None else digits + 3)
    return ExitLaw(found, digits, full)


class Law:
    """The law of the exit time, or that conditional on an exit at the end `side`."""

    def __init__(self, of: Exit, dps: int | None, full: bool, side: str | None = None) -> None:
        self._exit, self._dps, self._full, self._side = of, dps, full, side

    def __repr__(self) -> str:
        drift, numbers = self._exit.scene.drift, self._exit.scene.numbers
        given = ", ".join(f"{n}={inputs.float_text(x)}" for n, x in numbers.items())
        where = f" at the {self._side} end" if self._side else ""
        return f"<law of the exit time{where} of {drift!r}, {given}>"

    @property
    def mean(self) -> Any:
        """E[tau] (eq:Ttilde), or E[tau | side]."""
        return self._number(lambda f: f.mean(self._side), 3)

    @property
    def variance(self) -> Any:
        """E[tau^2] - E[tau]^2, or that given the side."""
        return self._number(lambda f: f.variance(self._side), 4)

    def laplace(self, s: Number | complex) -> Any:
        """E[e^{-s tau}], or that given the side, at a real or complex s.

        Raises
        ------
        RegionError
            If Re s is not greater than -`rate`, the first pole of the transform.
        """
        z: Any = s
        parts = (z.real, z.imag) if isinstance(z, complex) or hasattr(z, "_mpc_") else (z,)
        re, *im = (inputs.exact("s", x) for x in parts)
        if re < 0 and not arb(rational(re)) > -self._exit.rate:
            raise RegionError(
                f"s is {inputs.shown(s)}, at or beyond the first pole "
                f"-{float(self._exit.rate):.6g} of the transform; give an s to its right."
            )

        def found(f: Series) -> Any:
            number = [arb(rational(x)) for x in (re, *im)]
            value = f.transform(acb(*number) if im else number[0], self._side)
            return value / f.moments(0, self._side)[0] if self._side else value

        return self._number(found, ORDER, abs(complex(re, *im)))

    def _number(self, of: Callable[[Series], Any], order: int, size: float = 0.0) -> Any:
        return self._as_asked(self._exit.ball(of, order, size), "bound")

    def _as_asked(self, ball: Any, kind: ErrorKind, full: bool = False) -> Any:
        if self._dps is None and abs(ball) < _TINY:
            ball = type(ball)(arb(0, abs(ball).upper()))
        asked = scenes.Request("the law", dps=self._dps, full=full or self._full)
        return in_digits(asked, scenes.Answer(ball, kind))


class Side(Law):
    """The law conditional on an exit at one end."""

    @property
    def probability(self) -> Any:
        """The probability of an exit at this end (eq:C for the left end)."""
        return self._number(lambda f: f.moments(0, self._side)[0], 3)


class ExitLaw(Law):
    """The law of the exit time of one scene, returned by `exit_law`.

    Times are scaled. Numbers are computed at their first use; they are floats or mpf, or each an
    `Estimate` if ``full=True``.
    """

    def moment(self, k: int) -> Any:
        """E[tau^k] for k from 1 to 20."""
        inputs.count("k", k, 1, 20)
        return self._number(lambda f: f.moment(k), k + 1)

    @property
    def std(self) -> Any:
        """The square root of the variance."""
        return self._number(lambda f: f.variance().sqrt(), 3)

    @property
    def left(self) -> Side:
        """The law given exit at the left end, with `probability`, `mean`, `variance`, `laplace`."""
        return self._given("left")

    @property
    def right(self) -> Side:
        """The law given exit at the right end, with the same members."""
        return self._given("right")

    def _given(self, side: str) -> Side:
        if side == self._exit.reflecting:
            raise InputError(f"the {side} end reflects, so that u does not leave there.")
        return Side(self._exit, self._dps, self._full, side)

    @cached_property
    def rate(self) -> Estimate:
        """The principal eigenvalue lambda_1, with which P(tau > t) decays as e^{-lambda_1 t}."""
        found: Estimate = self._as_asked(self._exit.rate, "bound", full=True)
        return found

    def rates(self, many: int) -> list[Any]:
        """The first `many` eigenvalues (1 to 12) in ascending order."""
        size = float(self.rate)

        def eigenvalue(k: int) -> Any:
            return self._number(lambda f: f.rates(k)[0][-1], ORDER + 8 * (k - 1), k * k * size)

        return [eigenvalue(k) for k in range(1, inputs.count("many", many, 1, 12) + 1)]

    def survival(self, t: Numbers) -> Any:
        """P(tau > t) for t >= 0, a number or an array."""
        return self._each("t", t, lambda x: self._exit.at_time(x, "survival"))

    def cdf(self, t: Numbers) -> Any:
        """P(tau <= t) for t >= 0, a number or an array."""
        return self._each("t", t, lambda x: self._exit.at_time(x, "cdf"))

    def pdf(self, t: Numbers) -> Any:
        """The density of tau at t >= 0, which is a number or an array."""
        return self._each("t", t, lambda x: self._exit.at_time(x, "pdf"))

    def quantile(self, p: Numbers) -> Any:
        """The t with P(tau <= t) = p for 0 < p < 1, a number or an array; errors are estimates."""
        return self._each("p", p, lambda x: (self._exit.quantile(x), "estimate"))

    def _each(self, name: str, given: Any, of: Callable[[Any], tuple[Any, ErrorKind]]) -> Any:
        array = inputs.floats(name, given) if inputs.is_array(given) else None
        numbers = [inputs.exact(name, x) for x in ([given] if array is None else array.flat)]
        if (low := min(numbers)) < 0 or (name == "p" and not 0 < low <= max(numbers) < 1):
            rule = "a time of at least 0" if name == "t" else "a probability between 0 and 1"
            raise InputError(f"{name} is {inputs.shown(given)}; give {rule}.")
        found = [of(x) for x in numbers]
        if array is None:
            return self._as_asked(*found[0])
        near = zip(*(rounded(ball, None) for ball, _ in found), strict=True)
        value, error = (np.reshape(x, array.shape) for x in near)
        kind = max(kind for _, kind in found)  # an estimate if one of the errors is
        return Estimate(value, error, kind, "exact") if self._full else value
