"""The law of the exit time tau: moments, transform, rates, survival, density and quantiles.

With eta and zeta from the left end (-) and the right one (+) to the start (`symasym.exact.balls`),

    W = eta_- zeta_+ + eta_+ zeta_-,    W(s)/W(0) = prod (1 + s/lambda_k),
    E[e^{-s tau}; right] = eta_- zeta_+(0)/W,    E[e^{-s tau}; left] = eta_+ zeta_-(0)/W

(Darling & Siegert, Ann. Math. Statist. 24 (1953) 624; Kent, Ann. Probab. 8 (1980) 206).

- *Rates.* S_n = sum lambda_k^-n is known from W, and S_n^(-1/n) < lambda_1 (Euler, Rayleigh).
  Newton's steps for a polynomial with real zeros never pass the first one: each is a proved lower
  bound, and a change of sign of W the upper one. Division of W by 1 + s/lambda_1, from the last
  coefficient down, leaves the others.
- *Large times.* P(tau > t) = sum c_k e^{-lambda_k t}, c_k lambda_k = N(-lambda_k)/W'(-lambda_k). By
  Cauchy and Schwarz the terms from Lambda on are below (Lambda G M)^(1/2) e^{-Lambda t} where
  2 Lambda t > 1: G is what is left of Green's function eta_- eta_+/W at 0, M the mass of the speed
  measure. A bound.
- *Small times.* The transform on Talbot's contour (Weideman & Trefethen, Math. Comp. 76 (2007)
  1341); two numbers of nodes tell the error: an estimate.
- *Narrow laws and rare times.* The trapezoidal rule on Re s = c (Abate & Whitt, Queueing Systems 10
  (1992) 5), where e^{c t} E[e^{-c tau}], which is above the probability, is about the least.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from flint import acb, arb

from symasym.base import inputs
from symasym.base.balls import exact_ball, rounded
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
        With a number for each of its parameters.
    kappa : number
        Scaled noise amplitude, greater than 0.
    r : number
        Scaled radius.
    ends : pair of numbers, optional
        In place of -r and r.
    start : number, optional
        Scaled starting point, between the ends.
    reflecting : {"left", "right"}, optional
        The end that reflects.
    dps : int, optional
        Digits of an mpf, 1 to 1,000. None: floats.
    full : bool
        All numbers are an `Estimate`.

    Returns
    -------
    ExitLaw

    Raises
    ------
    InputError
        For a value outside its range, an array, a free parameter.

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
    return ExitLaw(scene, reflecting, inputs.digits(dps, 1_000), inputs.flag("full", full))


class ExitLaw:
    """The law of the exit time of one scene, made by `exit_law`.

    All is in scaled time, and computed when it is first asked for. Numbers are floats, mpf, or an
    `Estimate` where the law was asked for with ``full=True``.
    """

    def __init__(
        self, scene: scenes.Scene, reflecting: str | None, dps: int | None, full: bool
    ) -> None:
        self._dps, self._full = dps, full
        self._exit = Exit(scene, reflecting, scenes.FLOAT_DIGITS if dps is None else dps + 3)

    def __repr__(self) -> str:
        drift, numbers = self._exit.scene.drift, self._exit.scene.numbers
        given = ", ".join(f"{n}={inputs.float_text(x)}" for n, x in numbers.items())
        return f"<law of the exit time of {drift!r}, {given}>"

    @property
    def mean(self) -> Any:
        """E[tau] (eq:Ttilde)."""
        return self.moment(1)

    def moment(self, k: int) -> Any:
        """E[tau^k], k from 1 to 20."""
        inputs.count("k", k, 1, 20)
        return self._number(lambda f: f.moment(k), k + 1)

    @property
    def variance(self) -> Any:
        """E[tau^2] - E[tau]^2."""
        return self._number(lambda f: f.variance(), 3)

    @property
    def std(self) -> Any:
        """The square root of the variance."""
        return self._number(lambda f: f.variance().sqrt(), 3)

    @property
    def left(self) -> Side:
        """What holds given that u leaves on the left."""
        return self._side("left")

    @property
    def right(self) -> Side:
        """What holds given that u leaves on the right."""
        return self._side("right")

    def _side(self, side: str) -> Side:
        if side == self._exit.reflecting:
            raise InputError(f"the {side} end reflects, so that u does not leave there.")
        return Side(self, side)

    def laplace(self, s: Number | complex) -> Any:
        """E[e^{-s tau}] at a real or complex s.

        Raises
        ------
        RegionError
            If Re s is not above -`rate`, the first pole.
        """
        return self._laplace(s, None)

    def _laplace(self, s: Any, side: str | None) -> Any:
        parts = (s.real, s.imag) if isinstance(s, complex) or hasattr(s, "_mpc_") else (s,)
        re, *im = (inputs.exact("s", x) for x in parts)
        if re < 0 and not exact_ball(re) > -self._exit.rate:
            raise RegionError(
                f"s is {inputs.shown(s)}, at or beyond the first pole -{float(self.rate):.6g} of "
                "the transform; give an s to its right."
            )

        def found(f: Series) -> Any:
            number = [exact_ball(x) for x in (re, *im)]
            value = f.transform(acb(*number) if im else number[0], side)
            return value / f.moments(0, side)[0] if side else value

        return self._number(found, ORDER, abs(complex(re, *im)))

    @cached_property
    def rate(self) -> Estimate:
        """The principal eigenvalue lambda_1: P(tau > t) decays like e^{-lambda_1 t}."""
        found: Estimate = self._as_asked(self._exit.rate, "bound", full=True)
        return found

    def rates(self, many: int) -> list[Any]:
        """The first eigenvalues, 1 to 12 of them, ascending."""
        size = float(self.rate)

        def eigenvalue(k: int) -> Any:
            return self._number(lambda f: f.rates(k)[0][-1], ORDER + 8 * (k - 1), k * k * size)

        return [eigenvalue(k) for k in range(1, inputs.count("many", many, 1, 12) + 1)]

    def survival(self, t: Numbers) -> Any:
        """P(tau > t), t >= 0, a number or an array."""
        return self._of_times(t, "survival")

    def cdf(self, t: Numbers) -> Any:
        """P(tau <= t), t >= 0, a number or an array."""
        return self._of_times(t, "cdf")

    def pdf(self, t: Numbers) -> Any:
        """The density of tau at t >= 0, a number or an array."""
        return self._of_times(t, "pdf")

    def _of_times(self, t: Any, name: str) -> Any:
        times = inputs.floats("t", t) if inputs.is_array(t) else None
        given = [inputs.exact("t", x) for x in ([t] if times is None else times.flat)]
        if (first := min(given)) < 0:
            raise InputError(f"t is {inputs.float_text(first)}; give a time of at least 0.")
        found = [self._exit.at_time(x, name) for x in given]
        if times is None:
            return self._as_asked(*found[0])
        near = zip(*(rounded(ball, None) for ball, _ in found), strict=True)
        value, error = (np.reshape(x, times.shape) for x in near)
        kind = max(kind for _, kind in found)  # an estimate, if one of them is
        return Estimate(value, error, kind, "exact") if self._full else value

    def quantile(self, p: Number) -> Any:
        """t with P(tau <= t) = p, 0 < p < 1; its error is an estimate."""
        wanted = inputs.exact("p", p)
        if not 0 < wanted < 1:
            raise InputError(f"p is {inputs.shown(p)}; give a probability between 0 and 1.")
        return self._as_asked(self._exit.quantile(wanted), "estimate")

    def _number(self, of: Callable[[Series], Any], order: int, size: float = 0.0) -> Any:
        return self._as_asked(self._exit.ball(of, order, size), "bound")

    def _as_asked(self, ball: Any, kind: ErrorKind, full: bool = False) -> Any:
        if self._dps is None and abs(ball) < _TINY:
            ball = type(ball)(arb(0, abs(ball).upper()))
        asked = scenes.Request("the law", dps=self._dps, full=full or self._full)
        return in_digits(asked, scenes.Answer(ball, kind))


class Side(NamedTuple):
    """The law given the side on which u leaves."""

    law: ExitLaw
    side: str

    @property
    def probability(self) -> Any:
        """That of this side (eq:C on the left)."""
        return self.law._number(lambda f: f.moments(0, self.side)[0], 3)

    @property
    def mean(self) -> Any:
        """E[tau | this side]."""
        return self.law._number(lambda f: f.given(self.side), 3)

    @property
    def variance(self) -> Any:
        """The variance of tau given this side."""
        return self.law._number(lambda f: f.variance(self.side), 4)

    def laplace(self, s: Number | complex) -> Any:
        """E[e^{-s tau} | this side]."""
        return self.law._laplace(s, self.side)
