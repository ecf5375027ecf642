"""The public functions: one for each question about a drift."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, overload

from symasym.base.call_context import patient
from symasym.base.errors import InputError
from symasym.base.inputs import choice, exact, flag, float_text, positive, shown
from symasym.methods import alone, answer, each, require_drift_of, require_method
from symasym.scenes import QUANTITIES, Request, one_scene, require_drift

if TYPE_CHECKING:
    from fractions import Fraction

    from symasym.base.estimate import Answer, Estimate, Value
    from symasym.base.inputs import Number, Numbers
    from symasym.drift.drift import Drift

__all__ = ["escape_time", "exit_probability", "occupation", "stationary_density"]

TimeMethod = Literal["exact", "paper", "laplace", "uniform", "strong_noise", "auto"]
ExitMethod = Literal["exact", "paper", "laplace", "uniform", "strong_noise", "bound", "auto"]
OccupationMethod = Literal["exact", "paper", "laplace", "uniform", "strong_noise", "auto"]
Errors = Literal["raise", "nan"]


class Options(TypedDict, total=False):
    """Options of every verb beside `full`, on which the type of the answer depends."""

    dps: int | None
    log: bool
    errors: Errors
    workers: int | None
    patience: float | None


class _Expanded(Options, total=False):
    """Of those with expansions."""

    order: int | Literal["optimal"] | None
    rtol: Number | None


class TimeOptions(_Expanded, total=False):
    """Of `escape_time`."""

    start: Numbers
    method: TimeMethod
    drag_time: Number | None


class ExitOptions(_Expanded, total=False):
    """Of `exit_probability`."""

    start: Numbers
    method: ExitMethod
    complement: bool


class OccupationOptions(_Expanded, total=False):
    """Of `occupation`."""

    method: OccupationMethod
    complement: bool


@overload
def escape_time(
    drift: Drift, kappa: Numbers, r: Numbers, *, full: Literal[True], **options: Unpack[TimeOptions]
) -> Estimate: ...
@overload
def escape_time(
    drift: Drift,
    kappa: Numbers,
    r: Numbers,
    *,
    full: Literal[False] = False,
    **options: Unpack[TimeOptions],
) -> Value: ...
@overload
def escape_time(
    drift: Drift, kappa: Numbers, r: Numbers, *, full: bool, **options: Unpack[TimeOptions]
) -> Answer: ...
@patient
def escape_time(
    drift: Drift,
    kappa: Numbers,
    r: Numbers,
    *,
    start: Numbers = 0,
    method: TimeMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Number | None = None,
    errors: Errors = "raise",
    workers: int | None = None,
    patience: float | None = None,
    drag_time: Number | None = None,
) -> Answer:
    """Mean escape time T from ``|u| < r`` (eq:Ttilde with eq:C; any region).

    T belongs to the scalar equation du = phi(u) dt + kappa dW: the slow variables of a system that
    was reduced to it are frozen where it starts. It is the whole system's time only where they
    change it little meanwhile (docs/limits.md): a block of the friction oscillator that sticks is
    taken to the fold by the belt, and is released there however large T is.

    Parameters
    ----------
    drift : Drift
        With a value for each of its parameters; values may be arrays.
    kappa : number or array_like
        Scaled noise amplitude, kappa_p/sqrt(eps), greater than 0.
    r : number or array_like
        Scaled radius, r_p/eps, greater than 0.
    start : number or array_like, optional
        Scaled starting point, inside (-r, r).
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}

        - ``"exact"``: the integral itself.
        - ``"laplace"``: its expansion for weak noise, in powers of kappa^2/2.
        - ``"uniform"``: an expansion for weak noise that also holds where a well and a barrier, or
          one of them and the start or u = 1 or -1, are close to each other or coalesce.
        - ``"strong_noise"``: the expansion in powers of 2/kappa^2.
        - ``"paper"``: the paper's leading order, eq:Ttildesmall with its step Stokes multiplier
          (eq:Ttildelarge where there is no well); only for start 0.
        - ``"auto"``: the cheapest method whose stated relative error is at most `rtol` (see
          `plan`).
    order : int or "optimal", optional
        Highest power that an expansion keeps, 2 if left out. ``"optimal"``, for ``"laplace"``:
        the order with the smallest stated error.
    dps : int, optional
        Number of digits, 1 to 10,000, of an mpf or of each element of an array of them. None:
        float64, vectorised, right to 1e-12.
    log : bool
        Return the natural logarithm, which is finite where T overflows.
    full : bool
        Return an `Estimate` with the error.
    rtol : number, optional
        Relative error allowed, for ``"auto"`` alone.
    errors : {"raise", "nan"}
        With ``"nan"`` an element of an array that is refused, or whose value does not fit, is nan,
        and the others have their values; the `mask` of an `Estimate` marks it.
    workers : int, optional
        Number of processes that share the elements of an array with `dps`; this process alone if
        left out.
    patience : float, optional
        Seconds of processor time that the call may take, 10 if left out.
    drag_time : number, optional
        The scaled time in which the motion of the frozen variables removes a well, or makes it
        twice as deep, from `Reduction.drag_time` or `System.drag_time`. The `Estimate`, which
        `full` asks for, says so where T is a tenth of it or more.

    Returns
    -------
    float, ndarray, mpf or Estimate
        In scaled time; multiply by ``rescale(...).time`` for physical time.

    Raises
    ------
    InputError
        For a value outside its range, a free parameter, shapes that do not broadcast.
    RangeError
        If the value does not fit float64 and `log` is False.
    AccuracyError
        If the expansion does not hold there, or nothing reaches `rtol`.
    TimeLimitError
        If it would take longer than `patience`.

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
    request = Request("T", method, order, dps, log, full, errors)
    numbers = {"kappa": kappa, "r": r, "start": start}
    if drag_time is None:
        return _asked(drift, numbers, request, rtol, workers)
    if not flag("full", full):
        raise InputError(f"drag_time is {shown(drag_time)}, for a note; pass full=True with it.")
    # An infinite one is that of a drift without a well that a barrier ends.
    if isinstance(drag_time, Real) and drag_time == math.inf:
        return _asked(drift, numbers, request, rtol, workers)
    borne = positive("drag_time", exact("drag_time", drag_time))
    return _with_drag(_asked(drift, numbers, request, rtol, workers), log, borne)


@overload
def exit_probability(
    drift: Drift, kappa: Numbers, r: Numbers, *, full: Literal[True], **options: Unpack[ExitOptions]
) -> Estimate: ...
@overload
def exit_probability(
    drift: Drift,
    kappa: Numbers,
    r: Numbers,
    *,
    full: Literal[False] = False,
    **options: Unpack[ExitOptions],
) -> Value: ...
@overload
def exit_probability(
    drift: Drift, kappa: Numbers, r: Numbers, *, full: bool, **options: Unpack[ExitOptions]
) -> Answer: ...
@patient
def exit_probability(
    drift: Drift,
    kappa: Numbers,
    r: Numbers,
    *,
    start: Numbers = 0,
    complement: bool = False,
    method: ExitMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Number | None = None,
    errors: Errors = "raise",
    workers: int | None = None,
    patience: float | None = None,
) -> Answer:
    """Probability C of leaving ``|u| < r`` through -r (eq:C).

    All other parameters are those of `escape_time`.

    Parameters
    ----------
    complement : bool
        Return 1 - C, the probability of leaving through +r, with digits of its own: for C near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "bound", "auto"}
        ``"bound"``: the middle of two proved bounds, with half their distance as the error.
        ``"paper"``: the paper's upper bound (docs/bounds.md).

    Returns
    -------
    float, ndarray, mpf or Estimate

    Raises
    ------
    InputError, RangeError, AccuracyError, TimeLimitError
        As `escape_time` does.

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.exit_probability(sa.linear(1, 1), 1, 5):.12g}")
    4.53978687024e-05
    >>> sa.exit_probability(sa.linear(1, 1), "1e-4", 5, log=True)
    -1000000000.0
    """
    request = Request(_named("C", complement), method, order, dps, log, full, errors)
    return _asked(drift, {"kappa": kappa, "r": r, "start": start}, request, rtol, workers)


@overload
def occupation(
    drift: Drift, kappa: Numbers, *, full: Literal[True], **options: Unpack[OccupationOptions]
) -> Estimate: ...
@overload
def occupation(
    drift: Drift,
    kappa: Numbers,
    *,
    full: Literal[False] = False,
    **options: Unpack[OccupationOptions],
) -> Value: ...
@overload
def occupation(
    drift: Drift, kappa: Numbers, *, full: bool, **options: Unpack[OccupationOptions]
) -> Answer: ...
@patient
def occupation(
    drift: Drift,
    kappa: Numbers,
    *,
    complement: bool = False,
    method: OccupationMethod = "exact",
    order: int | Literal["optimal"] | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Number | None = None,
    errors: Errors = "raise",
    workers: int | None = None,
    patience: float | None = None,
) -> Answer:
    """Stationary probability P of ``|u| <= 1`` (eq:P); the region must be sliding.

    All other parameters are those of `escape_time`.

    Parameters
    ----------
    complement : bool
        Return 1 - P, with digits of its own: for P near 1.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}
        ``"paper"``: the leading term of eq:Plarge2 or, where that is above 1, the lower bound
        from which eq:Psmall2 follows.

    Returns
    -------
    float, ndarray, mpf or Estimate

    Raises
    ------
    RegionError
        Outside a sliding region, where no stationary density exists.
    InputError, RangeError, AccuracyError, TimeLimitError
        As `escape_time` does.

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.occupation(sa.linear(1, -1), 1, complement=True):.12g}")
    0.197622329138
    >>> print(f"{sa.occupation(sa.linear(1, -1), '0.01', complement=True, log=True):.12g}")
    -10005.1775351
    """
    request = Request(_named("P", complement), method, order, dps, log, full, errors)
    return _asked(drift, {"kappa": kappa}, request, rtol, workers)


@overload
def stationary_density(
    drift: Drift, kappa: Numbers, y: Numbers, *, full: Literal[True], **options: Unpack[Options]
) -> Estimate: ...
@overload
def stationary_density(
    drift: Drift,
    kappa: Numbers,
    y: Numbers,
    *,
    full: Literal[False] = False,
    **options: Unpack[Options],
) -> Value: ...
@overload
def stationary_density(
    drift: Drift, kappa: Numbers, y: Numbers, *, full: bool, **options: Unpack[Options]
) -> Answer: ...
@patient
def stationary_density(
    drift: Drift,
    kappa: Numbers,
    y: Numbers,
    *,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    errors: Errors = "raise",
    workers: int | None = None,
    patience: float | None = None,
) -> Answer:
    """Stationary density p_ss at the scaled position u = `y` (eq:pss); the region must be sliding.

    All other parameters are those of `escape_time`.

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
        Outside a sliding region.
    InputError, RangeError, TimeLimitError
        As `escape_time` does.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.stationary_density(sa.linear(1, -1), 1, [-0.5, 0.0, 0.5]).round(8)
    array([0.41836647, 0.53719319, 0.41836647])
    """
    request = Request("p_ss", "exact", None, dps, log, full, errors)
    return _asked(drift, {"kappa": kappa, "y": y}, request, workers=workers)


def call_named(name: str, drift: Drift, numbers: Mapping[str, Any], **options: Any) -> Any:
    """The quantity of that name, asked with those of `numbers` that it takes.

    `options` are the verb's own.
    """
    quantity = QUANTITIES[name]
    taken = {key: numbers[key] for key in quantity.numbers if key in numbers}
    if quantity.complement:
        options["complement"] = True
    return globals()[quantity.verb](drift, **taken, **options)


def _named(probability: str, complement: bool) -> str:
    """The name of a probability or of its complement."""
    return f"1 - {probability}" if flag("complement", complement) else probability


def _asked(
    drift: Drift,
    numbers: dict[str, Any],
    request: Request,
    rtol: Number | None = None,
    workers: int | None = None,
) -> Any:
    """The quantity of `request` for one scene, or for each of an array's."""
    request = request._replace(log=flag("log", request.log), full=flag("full", request.full))
    require_method(request, rtol)
    require_drift(drift)
    choice("errors", request.errors, ("raise", "nan"))
    if workers is not None and request.dps is None:
        raise InputError(
            f"workers is {shown(workers)}, but float64 arrays are computed in this process; give "
            "dps=… too, or leave it out."
        )
    ask = partial(_answered, rtol)
    if one_scene(drift, numbers):
        return alone(ask, drift, numbers, request)
    return each(ask, drift, numbers, request, 1 if workers is None else workers)


def _with_drag(answer: Estimate, log: bool, borne: Fraction) -> Estimate:
    """The same, with a note where T isn't small beside the drag time."""
    import numpy as np

    values = np.asarray(answer.value, dtype=float)
    if np.isnan(values).all() or not (log or (values > 0).any()):
        return answer
    longest = float(np.nanmax(values))
    ratio = longest if log else math.log(longest)
    ratio -= math.log(borne.numerator) - math.log(borne.denominator)
    if not ratio > np.log(0.1):
        return answer
    how = f"{np.exp(ratio):.2g}" if ratio < 700.0 else "more than 10^300"
    note = (
        f"T is {how} times the drag time {float_text(borne)} of the frozen variables, not small "
        "beside it: the whole system has another time; ask sa.release"
    )
    return replace(answer, notes=(*answer.notes, note))


def _answered(rtol: Number | None, drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The quantity of `request`, by its method or by the cheapest."""
    require_drift_of(request.name, drift)
    if request.method == "auto":
        from symasym.plan import automatic

        return automatic(drift, numbers, rtol, request)
    return answer(drift, numbers, request)
