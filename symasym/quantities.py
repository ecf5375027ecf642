"""The public functions for T, C, P and the stationary density of a scalar drift."""

from __future__ import annotations

from typing import Any, Literal

from symasym.base.inputs import Number, Numbers, flag
from symasym.drift.drift import Drift
from symasym.drift.scenes import Ends, Request, between, pair
from symasym.methods import ask

__all__ = ["escape_time", "exit_probability", "occupation", "stationary_density"]

TimeMethod = Literal["exact", "paper", "laplace", "uniform", "strong_noise", "auto"]
ExitMethod = Literal["exact", "paper", "laplace", "uniform", "strong_noise", "bound", "auto"]


def escape_time(
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    ends: Ends | None = None,
    start: Numbers = 0,
    reflecting: Literal["left", "right"] | None = None,
    moment: int = 1,
    method: TimeMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    rtol: Number | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
) -> Any:
    """Mean escape time T from ``|u| < r`` (eq:Ttilde with eq:C; any region), or a higher moment.

    T is that of the scalar equation du = phi(u) dt + kappa sigma(u) dW. If the equation is the
    reduction of a system, the slow variables are frozen at the start; T is then the escape time
    of the system only if it is much shorter than `System.drag_time`, so that the slow variables
    change the drift little in this time (docs/release.md).

    Parameters
    ----------
    drift : Drift
        A drift whose parameters all have values, which may be arrays.
    kappa : number or array_like
        Scaled noise amplitude, kappa_p/sqrt(eps), greater than 0.
    r : number or array_like
        Scaled escape radius, r_p/eps, greater than 0.
    ends : pair of numbers or array_like, optional
        The ends of the interval in place of -r and r.
    start : number or array_like, optional
        Scaled starting point, between the ends.
    reflecting : {"left", "right"}, optional
        The end that is reflecting; the path escapes through the other one.
    moment : int, optional
        The order k, 1 to 20, of the moment E[tau^k] of the exit time tau, by default 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}

        - ``"exact"``: the value of the integral.
        - ``"laplace"``: its expansion for weak noise in powers of kappa^2/2.
        - ``"uniform"``: a weak-noise expansion that remains valid as a well and a barrier coalesce,
          or one of them and the start or u = 1 or -1.
        - ``"strong_noise"``: the expansion in powers of 2/kappa^2.
        - ``"paper"``: the paper's leading order, eq:Ttildesmall with a step function as Stokes
          multiplier (eq:Ttildelarge if there is no well); only for start 0.
        - ``"auto"``: the exact value, or, for many kappa with one drift, an expansion whose
          relative error is at most `rtol`.
    order : int or "optimal", optional
        The highest power kept in an expansion, by default 2. ``"optimal"``, for ``"laplace"``, is
        the order with the smallest stated error.
    rtol : number, optional
        The relative error allowed, only for ``"auto"``, by default 1e-6.
    dps : int, optional
        The number of digits, 1 to 10,000, of an mpf for one scene. By default results are float64
        numbers or arrays, right to 1e-12 of the value, or of its logarithm if that is larger.
    log : bool
        Return the natural logarithm, which is finite even if T overflows.
    full : bool
        Return an `Estimate` with the error.

    Returns
    -------
    float, ndarray, mpf or Estimate
        T in scaled time; multiply by ``rescale(...).time`` for physical time. In an array, an
        element without a value is nan; the notes for ``full=True`` give the reason.

    Raises
    ------
    InputError
        If a value is outside its range, a parameter is free, or shapes do not broadcast.
    RangeError
        If the value of one scene is outside the range of float64 and `log` is False.
    AccuracyError
        If the expansion is not valid for one scene, or if `rtol` is not reached.

    Examples
    --------
    >>> import symasym as sa
    >>> drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    >>> print(f"{sa.escape_time(drift, '0.1', 10, log=True):.12g}")
    26.2030870808
    >>> from mpmath import nstr
    >>> nstr(sa.escape_time(drift, "0.1", 10, dps=40), 40)
    '239803837121.0377700112780486795091847626'
    """
    numbers = between(kappa, r, ends, start)
    asked = method, order, dps, log, full, moment, reflecting, rtol
    return ask(drift, numbers, Request("T", *asked))


def exit_probability(
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    ends: Ends | None = None,
    start: Numbers = 0,
    complement: bool = False,
    method: ExitMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    rtol: Number | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
) -> Any:
    """Probability C of leaving ``|u| < r`` through -r, or through the left of two ends (eq:C).

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    complement : bool
        Return 1 - C, the probability of leaving through r, without cancellation for C near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "bound", "auto"}
        ``"bound"``: the mean of a lower and an upper bound, with half their difference as error.
        ``"paper"``: the paper's upper bound (docs/weak-noise.md).

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.exit_probability(sa.linear(1, 1), 1, 5):.12g}")
    4.53978687024e-05
    >>> sa.exit_probability(sa.linear(1, 1), "1e-4", 5, log=True)
    -1000000000.0
    """
    numbers = between(kappa, r, ends, start)
    name = "1 - C" if flag("complement", complement) else "C"
    return ask(drift, numbers, Request(name, method, order, dps, log, full, rtol=rtol))


def occupation(
    drift: Drift,
    kappa: Numbers,
    *,
    interval: Ends | None = None,
    ends: Ends | None = None,
    complement: bool = False,
    method: TimeMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    rtol: Number | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
) -> Any:
    """Stationary probability P of ``|u| <= 1`` (eq:P), or of another interval.

    A stationary density exists on the real line if the drift points inwards on both sides (for
    the paper's drifts, in a sliding region), and always between two reflecting ends.

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    interval : pair of numbers or array_like, optional
        The ends of the interval whose probability is computed, by default -1 and 1.
    ends : pair of numbers or array_like, optional
        Reflecting ends that bound the motion.
    complement : bool
        Return 1 - P, without cancellation for P near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}
        ``"paper"``: the leading term of eq:Plarge2 or, if that is above 1, the lower bound
        from which eq:Psmall2 follows.

    Raises
    ------
    RegionError
        If no stationary density exists, or if its existence is not known: without a layer A must
        be a polynomial, and the noise bounded or a polynomial.

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.occupation(sa.linear(1, -1), 1, complement=True):.12g}")
    0.197622329138
    >>> print(f"{sa.occupation(sa.linear(1, -1), '0.01', complement=True, log=True):.12g}")
    -10005.1775351
    """
    numbers: dict[str, Any] = {"kappa": kappa}
    if interval is not None:
        numbers["low"], numbers["high"] = pair("interval", interval)
    if ends is not None:
        numbers["left"], numbers["right"] = pair("ends", ends)
    name = "1 - P" if flag("complement", complement) else "P"
    return ask(drift, numbers, Request(name, method, order, dps, log, full, rtol=rtol))


def stationary_density(
    drift: Drift,
    kappa: Numbers,
    y: Numbers,
    *,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
) -> Any:
    """Stationary density p_ss at the scaled position u = `y` (eq:pss).

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    y : number or array_like
        The scaled position u, any real number; the physical position is eps u.

    Returns
    -------
    float, ndarray, mpf or Estimate
        The density with respect to u.

    Raises
    ------
    RegionError
        If no stationary density exists, or if its existence is not known (see `occupation`).

    Examples
    --------
    >>> import symasym as sa
    >>> sa.stationary_density(sa.linear(1, -1), 1, [-0.5, 0.0, 0.5]).round(8)
    array([0.41836647, 0.53719319, 0.41836647])
    """
    asked = Request("p_ss", dps=dps, log=log, full=full)
    return ask(drift, {"kappa": kappa, "y": y}, asked)
