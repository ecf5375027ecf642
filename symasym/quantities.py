"""The public functions: one for each question about a drift."""

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

    T belongs to the scalar equation du = phi(u) dt + kappa dW, or that of the drift's noise: the
    slow variables of a system that was reduced to it are frozen where it starts. It is the whole
    system's time only where they change it little meanwhile (docs/release.md), that is where T is
    far shorter than `System.drag_time`.

    Parameters
    ----------
    drift : Drift
        With a value for each of its parameters; values may be arrays.
    kappa : number or array_like
        Scaled noise amplitude, kappa_p/sqrt(eps), greater than 0.
    r : number or array_like
        Scaled radius, r_p/eps, greater than 0.
    ends : pair of numbers or array_like, optional
        In place of -r and r.
    start : number or array_like, optional
        Scaled starting point, between the ends.
    reflecting : {"left", "right"}, optional
        The end that reflects: the way out is the other one.
    moment : int, optional
        k of E[tau^k], tau being the time of the exit: 1 to 20.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}

        - ``"exact"``: the integral itself.
        - ``"laplace"``: its expansion for weak noise, in powers of kappa^2/2.
        - ``"uniform"``: an expansion for weak noise that also holds where a well and a barrier, or
          one of them and the start or u = 1 or -1, are close to each other or coalesce.
        - ``"strong_noise"``: the expansion in powers of 2/kappa^2.
        - ``"paper"``: the paper's leading order, eq:Ttildesmall with its step Stokes multiplier
          (eq:Ttildelarge where there is no well); only for start 0.
        - ``"auto"``: the exact value, or where many kappa share a drift an expansion whose
          relative error is at most `rtol`.
    order : int or "optimal", optional
        Highest power that an expansion keeps, 2 if left out. ``"optimal"``, for ``"laplace"``:
        the order with the smallest stated error.
    rtol : number, optional
        Relative error allowed, for ``"auto"`` alone.
    dps : int, optional
        Number of digits of an mpf, 1 to 10,000, for one scene. None: float64, vectorised, right
        to 1e-12.
    log : bool
        Return the natural logarithm, which is finite where T overflows.
    full : bool
        Return an `Estimate` with the error.

    Returns
    -------
    float, ndarray, mpf or Estimate
        In scaled time; multiply by ``rescale(...).time`` for physical time. In an array an element
        without a value is nan; ``full=True`` says why.

    Raises
    ------
    InputError
        For a value outside its range, a free parameter, shapes that do not broadcast.
    RangeError
        If the value of one scene does not fit float64 and `log` is False.
    AccuracyError
        If the expansion does not hold for one scene, or nothing reaches `rtol`.

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
    """Probability C of leaving ``|u| < r`` through -r, or the left of two ends (eq:C).

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    complement : bool
        Return 1 - C, the probability of leaving through +r, with digits of its own: for C near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "bound", "auto"}
        ``"bound"``: the middle of two proved bounds, with half their distance as the error.
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

    There is a stationary state on the line where the drift leads inwards from both sides, in the
    paper's drifts a sliding region, or between two ends that reflect.

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    interval : pair of numbers or array_like, optional
        Whose share is asked for, -1 and 1 when left out.
    ends : pair of numbers or array_like, optional
        Reflecting ends around it.
    complement : bool
        Return 1 - P, with digits of its own: for P near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}
        ``"paper"``: the leading term of eq:Plarge2 or, where that is above 1, the lower bound
        from which eq:Psmall2 follows.

    Raises
    ------
    RegionError
        Where no stationary state exists, or it is not known to: without a layer A must be a
        polynomial, and the noise bounded or a polynomial.

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
    """Stationary density p_ss at the scaled position u = `y` (eq:pss), where `occupation` has a P.

    All other parameters, the type returned and the errors are those of `escape_time`.

    Parameters
    ----------
    y : number or array_like
        The scaled position u, anywhere; the physical one is epsilon times it.

    Returns
    -------
    float, ndarray, mpf or Estimate
        Per unit of u.

    Raises
    ------
    RegionError
        Where no stationary state exists, or it is not known to.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.stationary_density(sa.linear(1, -1), 1, [-0.5, 0.0, 0.5]).round(8)
    array([0.41836647, 0.53719319, 0.41836647])
    """
    asked = Request("p_ss", dps=dps, log=log, full=full)
    return ask(drift, {"kappa": kappa, "y": y}, asked)
