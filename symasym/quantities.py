"""The public verbs: one for each question about a drift."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symasym.base.contexts import float_with_error, own_context, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError, RegionError
from symasym.base.estimate import Estimate
from symasym.base.inputs import FloatArray, digits, exact, is_array
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    FLOAT_DIGITS,
    Request,
    Scenes,
    exact_scene,
    fits,
    float_scenes,
    input_rounding,
    one_scene,
    require_drift,
    require_fits,
    rows_of,
)

__all__ = ["escape_time", "exit_probability", "occupation", "stationary_density"]

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
_SCENES_AT_ONCE = 4096


def escape_time(
    drift: Drift,
    kappa: Any,
    r: Any,
    *,
    start: Any = 0,
    method: str = "exact",
    order: int | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Any = None,
) -> Any:
    """Mean escape time T from ``|u| < r`` (eq:Ttilde with eq:C; any region).

    Parameters
    ----------
    drift : Drift
        Bound; its parameters may be arrays.
    kappa, r : number or array_like
        Scaled noise amplitude and radius, greater than 0.
    start : number or array_like, optional
        Scaled starting point, inside (-r, r).
    method : {"exact", "paper", "laplace", "local", "uniform", "strong_noise", "auto"}
        ``"exact"``: the integral with nothing dropped. ``"paper"``: the leading
        order, eq:Ttildesmall with its step Stokes multiplier (eq:Ttildelarge
        where there is no well); only for start 0. ``"laplace"``: weak noise, in
        kappa^2/2; ``"uniform"``: the same, and where a well and a barrier, or
        one of them and the start or u = 1 or -1, are near each other or meet; ``"local"``: its
        leading order with Airy's argument linear in the distance to a fold. ``"strong_noise"``: in
        2/kappa^2. ``"auto"``: the cheapest whose stated relative error is at most `rtol`
        (see `plan`).
    order : int or "optimal", optional
        Of an expansion: the highest power that is kept, 2 if left out. ``"optimal"``
        (of ``"laplace"``): where the stated error is smallest.
    dps : int, optional
        Digits, 1 to 10,000. None: float64, vectorised, right to 1e-12.
    log : bool
        Natural logarithm instead, finite where T overflows.
    full : bool
        Return an `Estimate` with the error.
    rtol : number, optional
        Relative error allowed, for ``"auto"`` alone.

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
    _known_method(
        method, ("exact", "paper", "laplace", "local", "uniform", "strong_noise", "auto"), rtol
    )
    require_drift(drift)
    if method == "auto":
        numbers = {"kappa": kappa, "r": r, "start": start}
        return _automatic(
            escape_time, drift, numbers, rtol, Request("T", method, order, dps, log, full)
        )
    if method in ("laplace", "strong_noise"):
        from symasym.asymptotics.strong_noise import answer as strong_noise
        from symasym.asymptotics.weak_noise import answer as weak_noise

        request = Request("T", method, order, dps, log, full)
        expansion = strong_noise if method == "strong_noise" else weak_noise
        return expansion.escape_time(drift, kappa, r, start, request)
    if method in ("local", "uniform"):
        from symasym.asymptotics.uniform import answer as uniform_noise

        request = Request("T", method, order, dps, log, full)
        return uniform_noise.escape_time(drift, kappa, r, start, request, local=method == "local")
    _no_order(order, method)
    if method == "paper":
        from symasym import paper

        return paper.escape_time(drift, kappa, r, start, dps=dps, log=log, full=full)
    task = _Task(
        "T",
        drift,
        {"kappa": kappa, "r": r, "start": start},
        lambda engine, d, v, n, **k: engine.escape_time(d, v["kappa"], v["r"], v["start"], n, **k),
        lambda engine, field, v: engine.escape_time(field, v["lam"], v["r"], v["start"]),
    )
    return _evaluate(task, dps, log, full)


def exit_probability(
    drift: Drift,
    kappa: Any,
    r: Any,
    *,
    start: Any = 0,
    complement: bool = False,
    method: str = "exact",
    order: int | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Any = None,
) -> Any:
    """Probability C of leaving ``|u| < r`` through -r (eq:C).

    Parameters
    ----------
    drift, kappa, r, start, order, dps, log, full, rtol
        As in `escape_time`.
    complement : bool
        The probability 1 - C of leaving through +r, with its own relative precision.
    method : {"exact", "paper", "laplace", "strong_noise", "bound", "auto"}
        ``"bound"``: the middle of two proved bounds, half their distance the error.
        ``"laplace"``: weak noise. ``"paper"``: an upper bound (see docs/bounds.md).

    Returns
    -------
    float, ndarray, mpf or Estimate

    Raises
    ------
    InputError, RangeError
        As in `escape_time`.

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.exit_probability(sa.linear(1, 1), 1, 5):.12g}")
    4.53978687024e-05
    >>> sa.exit_probability(sa.linear(1, 1), "1e-4", 5, log=True)
    -1000000000.0
    """
    _known_method(method, ("exact", "paper", "laplace", "strong_noise", "bound", "auto"), rtol)
    if method == "auto":
        require_drift(drift)
        numbers = {"kappa": kappa, "r": r, "start": start}
        request = Request("1 - C" if complement else "C", method, order, dps, log, full)
        return _automatic(
            partial(exit_probability, complement=complement), drift, numbers, rtol, request
        )
    if method != "exact":
        from symasym.asymptotics.weak_noise.exit_probability import probability

        require_drift(drift)
        request = Request("1 - C" if complement else "C", method, order, dps, log, full)
        return probability(drift, kappa, r, start, complement, request)
    _no_order(order, method)
    task = _Task(
        "C",
        drift,
        {"kappa": kappa, "r": r, "start": start},
        lambda engine, d, v, n, **k: engine.exit_probability(
            d, v["kappa"], v["r"], v["start"], n, complement=complement, **k
        ),
        lambda engine, field, v: engine.exit_probability(
            field, v["lam"], v["r"], v["start"], complement
        ),
    )
    return _evaluate(task, dps, log, full)


def occupation(
    drift: Drift,
    kappa: Any,
    *,
    complement: bool = False,
    method: str = "exact",
    order: int | None = None,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
    rtol: Any = None,
) -> Any:
    """Stationary probability P of ``|u| <= 1`` (eq:P); the region must be sliding.

    Parameters
    ----------
    drift, kappa, order, dps, log, full, rtol
        As in `escape_time`.
    complement : bool
        1 - P instead, with its own relative precision.
    method : {"exact", "paper", "laplace", "uniform", "strong_noise", "auto"}
        ``"uniform"`` is for scalars. ``"paper"``: the leading term of eq:Plarge2, and
        where that is above 1 the lower bound that gives eq:Psmall2.

    Returns
    -------
    float, ndarray, mpf or Estimate

    Raises
    ------
    RegionError
        Outside a sliding region, where no stationary density exists.

    Examples
    --------
    >>> import symasym as sa
    >>> print(f"{sa.occupation(sa.linear(1, -1), 1, complement=True):.12g}")
    0.197622329138
    >>> print(f"{sa.occupation(sa.linear(1, -1), '0.01', complement=True, log=True):.12g}")
    -10005.1775351
    """
    _known_method(method, ("exact", "paper", "laplace", "uniform", "strong_noise", "auto"), rtol)
    _require_sliding(drift)
    if method == "auto":
        request = Request("1 - P" if complement else "P", method, order, dps, log, full)
        return _automatic(
            partial(occupation, complement=complement), drift, {"kappa": kappa}, rtol, request
        )
    if method in ("laplace", "uniform", "strong_noise"):
        from symasym.asymptotics.strong_noise import answer as strong_noise
        from symasym.asymptotics.uniform import answer as uniform_noise
        from symasym.asymptotics.weak_noise import answer as weak_noise

        request = Request("1 - P" if complement else "P", method, order, dps, log, full)
        known = {"laplace": weak_noise, "uniform": uniform_noise, "strong_noise": strong_noise}
        expansion: Any = known[method]
        return expansion.occupation(drift, kappa, complement, request)
    _no_order(order, method)
    if method == "paper":
        from symasym import paper

        return paper.occupation(drift, kappa, complement, dps=dps, log=log, full=full)
    task = _Task(
        "1 - P" if complement else "P",
        drift,
        {"kappa": kappa},
        lambda engine, d, v, n, **k: engine.occupation(
            d, v["kappa"], n, complement=complement, **k
        ),
        lambda engine, field, v: engine.occupation(field, v["lam"], complement),
    )
    return _evaluate(task, dps, log, full)


def stationary_density(
    drift: Drift,
    kappa: Any,
    y: Any,
    *,
    dps: int | None = None,
    log: bool = False,
    full: bool = False,
) -> Any:
    """Stationary density p_ss at the scaled position y (eq:pss); the region must be sliding.

    Parameters
    ----------
    drift, kappa, dps, log, full
        As in `escape_time`.
    y : number or array_like
        Scaled position, anywhere.

    Returns
    -------
    float, ndarray, mpf or Estimate
        Per unit of u.

    Raises
    ------
    RegionError
        Outside a sliding region.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.stationary_density(sa.linear(1, -1), 1, [-0.5, 0.0, 0.5]).round(8)
    array([0.41836647, 0.53719319, 0.41836647])
    """
    _require_sliding(drift)
    task = _Task(
        "p_ss",
        drift,
        {"kappa": kappa, "y": y},
        lambda engine, d, v, n, **k: engine.stationary_density(d, v["kappa"], v["y"], n, **k),
        lambda engine, field, v: engine.stationary_density(field, v["lam"], v["y"]),
    )
    return _evaluate(task, dps, log, full)


# -- what the verbs share -----------------------------------------------------------------


class _Task(NamedTuple):
    name: str
    drift: Drift
    numbers: dict[str, Any]
    digits_of: Callable[..., Any]  # engine, drift, numbers, dps, log=…
    logs_of: Callable[[Any, Any, dict[str, FloatArray]], Any]


def _automatic(
    verb: Callable[..., Any], drift: Drift, numbers: dict[str, Any], rtol: Any, request: Request
) -> Any:
    from symasym.plan import automatic

    def ask(drift: Drift, numbers: dict[str, Any], **options: Any) -> Any:
        return verb(drift, **numbers, **options)

    return automatic(drift, numbers, rtol, request, ask)


def _known_method(method: str, known: tuple[str, ...], rtol: Any) -> None:
    if rtol is not None and method != "auto":
        raise InputError(
            f"rtol is {rtol!r}, but method {method!r} has its own error; leave it out, or use "
            "method='auto'."
        )
    if not isinstance(method, str) or method not in known:
        raise InputError(f"method is {method!r}; this quantity has {', '.join(map(repr, known))}.")


def _no_order(order: int | None, method: str) -> None:
    if order is not None:
        raise InputError(f"order is {order!r}, but method {method!r} has no order; leave it out.")


def _require_sliding(drift: Drift) -> None:
    require_drift(drift)
    a_minus, a_plus = drift.ends
    wrong = ~((np.asarray(a_minus, dtype=float) > 0) & (np.asarray(a_plus, dtype=float) < 0))
    if wrong.any():
        first = tuple(np.argwhere(wrong)[0]) if wrong.ndim else ()
        shown = [float(np.asarray(x, dtype=float)[first]) for x in (a_minus, a_plus)]
        raise RegionError(
            f"a- = {shown[0]:.6g} and a+ = {shown[1]:.6g} make no sliding region (a- > 0 > a+), so "
            "there is no stationary density; ask for escape_time instead."
        )


def _evaluate(task: _Task, dps: int | None, log: bool, full: bool) -> Any:
    require_drift(task.drift)
    if dps is not None:
        return _by_digits(task, digits(dps), log, full)
    if full and one_scene(task.drift, task.numbers):
        found = _by_digits(task, FLOAT_DIGITS, log, True)
        return _rounded_to_float(task.name, found, log)
    return _by_float(task, log, full)


def _by_digits(task: _Task, dps: int, log: bool, full: bool) -> Any:
    try:
        return _by_engines(task, dps, log, full)
    except OverflowError as error:
        if isinstance(error, RangeError):
            raise
        # Widths and counts of panels are planned in float64.
        numbers = ", ".join(f"{name} = {value}" for name, value in task.numbers.items())
        raise AccuracyError(
            f"{numbers} and the drift make 2 |A|/kappa^2 leave the range of float64 (1e308), in "
            "which the evaluation is planned; rescale the problem."
        ) from None


def _by_engines(task: _Task, dps: int, log: bool, full: bool) -> Any:
    from symasym.exact import digits as arbitrary
    from symasym.numbers import balls

    values = exact_scene(task.drift, task.numbers, dps)
    # Where A is no polynomial, ball arithmetic is the faster way as well as the proved one.
    if balls.available() and (full or task.drift.exact_coefficients() is None):
        found = _by_ball(task, values, dps, log)
        if found:
            return found if full else found.value
    result = task.digits_of(arbitrary, task.drift, values, dps, log=log)
    if not full:
        return result
    with own_context(15) as context:
        error = to_mpf(abs(context.make_mpf(result._mpf_)) * context.mpf(10) ** -dps, 15)
    return Estimate(result, error, "estimate", "exact", terms=(task.name,))


def _by_ball(task: _Task, values: dict[str, Fraction], dps: int, log: bool) -> Estimate | None:
    from symasym.exact import ball_sweep
    from symasym.numbers import balls

    try:
        enclosure = task.digits_of(ball_sweep, task.drift, values, dps + 3, log=log)
        value, error = balls.to_mpf(enclosure, dps)
    except AccuracyError:
        return None
    return Estimate(value, error, "bound", "exact", terms=(task.name,))


def _rounded_to_float(name: str, found: Estimate, log: bool) -> Estimate:
    """The same estimate with float64 numbers, the rounding added to the error."""
    if not log:
        fits(name, found.value)
    value, error = float_with_error(found.value, found.error)
    return Estimate(value, error, found.error_kind, found.method, terms=found.terms)


def _by_float(task: _Task, log: bool, full: bool) -> Any:
    scenes = float_scenes(task.drift, task.numbers)
    exactly = {n: exact(n, x) for n, x in task.numbers.items() if not is_array(x)}
    logs = np.empty(scenes.lam.size)
    errors = np.empty_like(logs)
    for low in range(0, logs.size, _SCENES_AT_ONCE):
        part = slice(low, low + _SCENES_AT_ONCE)
        logs[part], errors[part] = _float_chunk(
            task,
            rows_of(scenes, part),
            {name: x[part] if is_array(x) else x for name, x in scenes.parameters.items()},
            exactly,
        )
    return _shaped(task.name, logs.reshape(scenes.shape), errors.reshape(scenes.shape), log, full)


def _float_chunk(
    task: _Task,
    scenes: Scenes,
    parameters: dict[str, Any],
    exactly: dict[str, Fraction],
) -> tuple[FloatArray, FloatArray]:
    from symasym.drift.float_field import field_of
    from symasym.exact import floats as double

    count = len(scenes.lam)
    field = field_of(task.drift, parameters, count)
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        logs, errors = task.logs_of(double, field, {**scenes.numbers, "lam": scenes.lam})
        errors = errors + input_rounding(scenes, field.size()[:count])
    # What float64 cannot promise is found with more digits, one scene at a time.
    doubtful = ~(errors <= TOLERANCE * np.maximum(1.0, np.abs(logs)))
    for index in np.flatnonzero(doubtful):
        values = {n: Fraction(float(x[index])) for n, x in scenes.numbers.items()} | exactly
        bound = {n: float(x[index]) if is_array(x) else x for n, x in parameters.items()}
        logs[index] = _accurate_log(task, task.drift.bind(**bound), values)
        errors[index] = 4e-16 * abs(logs[index])
    return logs, errors


def _accurate_log(task: _Task, drift: Drift, values: dict[str, Fraction]) -> float:
    from symasym.exact import digits as arbitrary

    return float(task.digits_of(arbitrary, drift, values, 17, log=True))


def _shaped(name: str, logs: FloatArray, errors: FloatArray, log: bool, full: bool) -> Any:
    value: Any = logs
    error: Any = errors
    require_fits(name, logs, log)
    if not log:
        value = np.exp(logs)
        error = value * np.expm1(errors + 2e-16)
    if value.ndim == 0:
        value, error = float(value), float(error)
    if not full:
        return value
    return Estimate(value, error, "estimate", "exact", terms=(name,))
