"""Which terms a scene needs for a stated error, and the cheapest method that gives it.

An expansion is cheap once its drift is analysed, and the analysis costs more than the exact value
of one scene. `plan` therefore tells what many scenes of a drift need; ``method="auto"`` takes the
exact integral for one scene, and for arrays those expansions whose predicted cost is a fraction of
the predicted cost of the exact integrals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, Context
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import own_context, patient, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError, SymasymError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import (
    FloatArray,
    IntArray,
    Number,
    exact,
    float_text,
    is_array,
    shown,
    to_float,
)
from symasym.base.texts import upwards
from symasym.drift.drift import Drift
from symasym.methods import METHODS, answer
from symasym.numbers.polynomials import float_zeros
from symasym.numbers.trees import NumpyOps
from symasym.scenes import (
    Answer,
    Answers,
    Request,
    Scenes,
    as_digits,
    as_floats,
    float_scenes,
    one_scene,
    read_scene,
    require_drift,
)

if TYPE_CHECKING:
    from mpmath import mpf

    from symasym.expansions.answer import Parts

__all__ = ["Plan", "Singulant", "Term", "plan"]

_WEAK_ORDERS = range(9)
# Of the weak-noise series in float64, where an order costs little.
_ARRAY_ORDERS = (0, 1, 2, 4, 8)
_ORDERS = {"laplace": _WEAK_ORDERS, "strong_noise": (0, 1, 2, 4, 8, 16)}
# Of rtol, for what is left out; the rest is for the series that are kept.
_FOR_DROPPED = Fraction(1, 10)
# Below this, rtol=1e-12 as a float included.
_FLOAT_RTOL = Fraction(999, 10**15)
# In the time of an exponential a point once the drift is analysed, as docs/plan.md measures it.
_LAPLACE_COST, _LAPLACE_TERM = 50, 20
_UNIFORM_COST = 450
_STRONG_COST = 5_000
_EXACT_COST = 10_000
# Predicted seconds in arrays, of which the ratios matter alone; measured as docs/plan.md says.
_SECONDS_A_CALL, _SECONDS_A_POINT, _SECONDS_A_DRIFT = 2e-3, 1e-6, 2e-3
_SECONDS_UNIFORM, _SECONDS_WITH_DIGITS = 2e-5, 0.3
_SECONDS_EXACT, _SECONDS_EXACT_PER_EXPONENT = 4e-6, 7e-9
# Beyond some 700 of lam |A| the panels are shorter, but for a linear A.
_SECONDS_STEEP, _SECONDS_STEEP_PER_EXPONENT, _MOST_EXPONENT = -1.8e-5, 4e-8, 4000.0
_LAYER_EXPONENT = 150.0
_GRID = np.linspace(-1, 1, 9)
# From here on the error of an expansion in float64 says whether a proof of it is worth its time.
_FLOAT_ERROR = 1e-9
# In the analysis of an exponent in float64, for a prediction.
_ROUNDINGS = 20
# Of the exact integrals, for one attempt and for all of them.
_FOR_ATTEMPT, _FOR_ATTEMPTS = 0.15, 0.25


@dataclass(frozen=True)
class Term:
    """A part of T, as `plan` lists it.

    Attributes
    ----------
    name : str
    kept : bool
    size : mpf
        Relative to T, with its sign; it may be far below the range of float64.
    reason : str
        Why it is kept or left out.
    """

    name: str
    kept: bool
    size: mpf
    reason: str


@dataclass(frozen=True)
class Singulant:
    """What limits the series of a well or barrier of a polynomial A (docs/borel.md).

    Attributes
    ----------
    point : str
        Such as ``"well at 0.3969"``.
    other : str
        The zero of A, a neighbour or complex, to which V changes least.
    value : float
        F, that change's modulus: terms k of the series grow from k = lam F on.
    order : int
        The least term at this noise, the whole part of lam F.
    """

    point: str
    other: str
    value: float
    order: int


@dataclass(frozen=True, repr=False)
class Plan:
    """The cheapest way to the escape time of many scenes such as this one.

    Attributes
    ----------
    method : {"laplace", "uniform", "strong_noise", "exact"}
        The cheapest whose stated error is at most `rtol`.
    order : int or None
    terms : tuple of Term
        Parts of T, largest first, each with its `name`, `size` relative to T, `kept` and the
        `reason`; empty where the method does not add up parts.
    error : float
        Stated relative error, what is left out included.
    error_kind : {"bound", "estimate"}
    cost : float
        Predicted time of one point, the analysis of the drift not counted, over that of `np.exp`.
    rtol : float
    refused : dict
        Cheaper methods, and why each of them does not do.
    estimate : Estimate
        T in this way.
    singulants : tuple of Singulant
        Of the wells and barriers in the terms that are kept (docs/borel.md): `point`, `value`,
        the `other` zero that it comes from, and the `order` of the least term.
    """

    method: str
    order: int | None
    terms: tuple[Term, ...]
    error: float
    error_kind: ErrorKind
    cost: float
    rtol: float
    refused: dict[str, str]
    estimate: Estimate
    singulants: tuple[Singulant, ...] = ()

    def __str__(self) -> str:
        order = "" if self.order is None else f", order {self.order}"
        head = (
            f"{self.method}{order}: relative error at most {_at_most(self.error)} "
            f"({self.error_kind}), about {self.cost:,.0f} times np.exp a point"
        )
        lines = [
            f"  {'kept' if t.kept else 'left out':9}{_short(t.size):>10}  {t.name}: {t.reason}"
            for t in self.terms
        ]
        lines += [
            f"  series of the {s.point}: singulant {s.value:.3g} ({s.other}), least term at order "
            f"{s.order:,}"
            for s in self.singulants
        ]
        lines += [f"  not {name}: {why}" for name, why in self.refused.items()]
        return "\n".join([head, *lines])

    __repr__ = __str__


@patient
def plan(
    drift: Drift,
    kappa: Number,
    r: Number,
    rtol: Number = 1e-6,
    *,
    start: Number = 0,
    patience: float | None = None,
) -> Plan:
    """The terms of T that this scene needs, those left out, and the bound on each.

    This is for many scenes that share the drift, as in an array, or for a formula: for one value
    the exact integral is the faster way, which ``method="auto"`` therefore takes.

    Parameters
    ----------
    drift : Drift
        With a number for each of its parameters.
    kappa, r, start : number
        Scaled, as in `escape_time`.
    rtol : number
        Relative error allowed, between 1e-1000 and 1.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    Plan
        The method with the least time of a point, the analysis of the drift not counted.

    Raises
    ------
    InputError
        For arrays, and for values outside their ranges.

    Examples
    --------
    >>> import symasym as sa
    >>> chosen = sa.plan(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05", 10, rtol=1e-3)
    >>> print(chosen.method, chosen.order, [t.name for t in chosen.terms if t.kept])
    laplace 1 ['well at 0.3969 with barrier at 0.9039']
    """
    require_drift(drift)
    numbers = {"kappa": kappa, "r": r, "start": start}
    if not one_scene(drift, numbers):
        raise InputError("plan is for one scene; give numbers, not arrays.")
    allowed = read_rtol(rtol)
    request = Request("T", "auto", None, _digits_for(allowed), False, True)
    return _planned(drift, numbers, allowed, request)


def read_rtol(rtol: Number | None) -> Fraction:
    """rtol as an exact number between 1e-1000 and 1."""
    if rtol is None:
        raise InputError('method is "auto", which needs the relative error allowed; give rtol=….')
    allowed = exact("rtol", rtol)
    if not Fraction(1, 10**1000) <= allowed < 1:
        raise InputError(
            f"rtol is {float_text(allowed)}; give a relative error between 1e-1000 and 1."
        )
    return allowed


def _digits_for(allowed: Fraction) -> int:
    """The digits in which a relative error of `allowed` is seen."""
    return max(20, len(str(int(1 / allowed))) + 8)


def automatic(drift: Drift, numbers: dict[str, Any], rtol: Number | None, request: Request) -> Any:
    """The quantity of `request` by the cheapest method whose stated error is at most `rtol`."""
    allowed = read_rtol(rtol)
    if request.order is not None:
        raise InputError(
            f"order is {shown(request.order)}, but method 'auto' chooses it; leave it out."
        )
    if request.dps is None and allowed < _FLOAT_RTOL:
        raise AccuracyError(
            f"rtol is {float_text(allowed)}, below what float64 gives (1e-12); pass dps=… for more "
            "digits."
        )
    if request.dps is None and not one_scene(drift, numbers):
        return _of_arrays(drift, numbers, allowed, request)
    return _of_one(drift, numbers, allowed, request)


def _of_one(drift: Drift, numbers: dict[str, Any], allowed: Fraction, request: Request) -> Any:
    """The proved exact value, cheaper than to analyse the drift; an expansion where it fails."""
    try:
        exactly = answer(drift, numbers, request._replace(method="exact", full=True))
        return exactly if request.full else exactly.value
    except RangeError:
        raise
    except AccuracyError:
        digits = max(_digits_for(allowed), request.dps or 0)
        wanted = request._replace(dps=digits, full=True)
        estimate = _cheapest(drift, numbers, allowed, wanted)[0]
    request = request._replace(method=estimate.method, order=estimate.order)
    with own_context(digits + 10) as context:
        value, error = (context.make_mpf(x._mpf_) for x in (estimate.value, estimate.error))
        return as_digits(
            request, Answer(value, error, estimate.error_kind, estimate.terms, estimate.dropped)
        )


def _cheapest(
    drift: Drift,
    numbers: dict[str, Any],
    allowed: Fraction,
    request: Request,
    methods: tuple[str, ...] = ("laplace", "strong_noise"),
) -> tuple[Estimate, dict[str, str]]:
    """The first method and order that will do, cheapest first; and why others will not."""
    refused = {}
    for method in methods:
        best = None
        for order in _ORDERS[method]:
            asked = request._replace(method=method, order=order)
            try:
                known = _float_error(drift, numbers, asked) if method == "strong_noise" else 0.0
                if known > max(10 * float(allowed), _FLOAT_ERROR):
                    best = known if best is None else min(best, known)
                    continue
                estimate = answer(drift, numbers, asked)
            except SymasymError as error:
                refused[method] = str(error)
                continue
            relative = _relative(estimate, request.log)
            if relative <= float(allowed):
                return estimate, refused
            best = relative if best is None else min(best, relative)
        if best is not None:
            size = f"{float(best):.2g} at best" if best < np.inf else "as large as the value"
            refused[method] = f"its stated error is {size}"
    return answer(drift, numbers, request._replace(method="exact", order=None)), refused


def _float_error(drift: Drift, numbers: dict[str, Any], request: Request) -> float:
    """The relative error that the method states in float64, which costs little.

    0 beyond float64's range, infinite where the error is as large as the value.
    """
    try:
        scenes = float_scenes(drift, numbers)
    except SymasymError:
        return 0.0
    try:
        answers = METHODS[request.method].of_scenes(scenes, request)
    except AccuracyError:
        return float("inf")
    return 0.0 if answers.errors is None else float(np.expm1(answers.errors[0]))


def _relative(estimate: Estimate, log: bool) -> mpf:
    """The error relative to the value itself, not to its logarithm."""
    return estimate.error if log else estimate.error / abs(estimate.value)


# -- the escape time, term by term -----------------------------------------------------------------


def _planned(drift: Drift, numbers: dict[str, Any], allowed: Fraction, request: Request) -> Plan:
    """The plan of one scene."""
    from symasym.expansions import answer as weak_noise

    rtol, scene = float(allowed), read_scene(drift, numbers, request.dps)
    refused: dict[str, str] = {}
    # Of the exact value; relative to the value it is larger.
    known = (1 - _FOR_DROPPED) * allowed / (1 + allowed)
    try:
        parts = weak_noise.parts(scene, request.digits, _WEAK_ORDERS, known)
    except SymasymError as error:
        refused["laplace"] = str(error)
    else:
        if parts.error <= float(known):
            planned = _of_parts(parts, rtol, request)
            kept = " with ".join(t.name for t in planned.terms if t.kept)
            return replace(planned, singulants=tuple(_singulants(drift, scene.lam, kept)))
        refused["laplace"] = f"its stated error is {float(parts.error):.2g} at best"
    try:
        relative, estimate = _uniform(drift, numbers, request.log)
    except SymasymError as error:
        refused["uniform"] = str(error)
    else:
        if relative <= rtol:
            cost = _UNIFORM_COST
            return Plan("uniform", 0, (), relative, "estimate", cost, rtol, refused, estimate)
        refused["uniform"] = (
            f"its stated error in float64, order 0, is {relative:.2g}"
            if relative < np.inf
            else "its error in float64, order 0, is not known here"
        )
    estimate, more = _cheapest(drift, numbers, allowed, request, ("strong_noise",))
    refused |= more
    cost = _EXACT_COST if estimate.method == "exact" else _STRONG_COST
    relative = float(_relative(estimate, request.log))
    method, order, kind = estimate.method, estimate.order, estimate.error_kind
    return Plan(method, order, (), relative, kind, cost, rtol, refused, estimate)


def _uniform(drift: Drift, numbers: dict[str, Any], log: bool) -> tuple[float, Estimate]:
    """The uniform formula of order 0, as for arrays; its relative error, infinite if refused."""
    logs, errors = _uniform_logs(drift, float_scenes(drift, numbers), np.zeros(1, dtype=np.intp))
    relative = float(np.expm1(errors[0])) * (1 + 1e-12)
    with own_context(30) as context:
        value = error = context.mpf(0)
        if relative < np.inf:
            value, error = context.mpf(logs[0]), context.mpf(errors[0])
            if not log:
                value = context.exp(value)
                error = value * relative
        value, error = to_mpf(value, 30), to_mpf(error, 30)
    return relative, Estimate(value, error, "estimate", "uniform", 0)


def _of_parts(parts: Parts, rtol: float, request: Request) -> Plan:
    """Leave out the smallest parts as long as their sum is small enough."""
    context = parts.total.context
    room = context.mpf(rtol) / (1 + context.mpf(rtol)) / 10
    ordered = sorted(parts.items, key=lambda item: abs(item[1]))
    gone = context.zero
    dropped = set()
    for name, value, error in ordered:
        size = (abs(value) + error) / parts.total
        if gone + size > room:
            break
        gone += size
        dropped.add(name)
    terms, value = [], context.zero
    for name, share, error in reversed(ordered):
        size = to_mpf(share / parts.total, 15)
        if name in dropped:
            why = f"at most {_at_most((abs(share) + error) / parts.total)} of T"
        else:
            value += share
            why = f"its series is known to {_at_most(error / parts.total)} of T"
        terms.append(Term(name, name not in dropped, size, why))
    # Of the exact value; relative to the one that is kept it is larger.
    relative = parts.error + gone
    relative /= 1 - relative
    error = relative * value
    kept = tuple(t.name for t in terms if t.kept)
    left = tuple(f"{t.name}: {t.reason}" for t in terms if not t.kept)
    cost = _LAPLACE_COST + _LAPLACE_TERM * len(kept) * (1 + (parts.order + 1) / 4)
    if request.log:
        value, error = context.log(value), relative
    estimate = Estimate(value, error, "estimate", "laplace", parts.order, kept, left)
    # Where the quotient is below float64's range, its least number is not.
    order, relative = parts.order, np.nextafter(float(relative), np.inf).item()
    return Plan("laplace", order, tuple(terms), relative, "estimate", cost, rtol, {}, estimate)


def _singulants(drift: Drift, lam: Fraction, kept: str) -> Iterator[Singulant]:
    """Singulants of the wells and barriers named in the terms, polynomial A."""
    exact = drift.exact_coefficients() or (Fraction(0),)
    largest = max(map(abs, exact)) or Fraction(1)
    c = [float(x / largest) for x in exact]
    zeros = float_zeros(c)
    own = abs(zeros.imag) < 1e-9 * (1 + abs(zeros))
    real = np.sort(zeros[own].real)
    for k, u in enumerate(real):
        slope = np.polynomial.polynomial.polyval(u, np.polynomial.polynomial.polyder(c))
        point = f"{'well' if slope < 0 else 'barrier'} at {u + 0.0:.4g}"
        if abs(u) >= 1 or point not in kept:
            continue
        # Of the real zeros a neighbour alone is on the same sheet of the Borel plane.
        others = [*real[max(k - 1, 0) : k], *real[k + 1 : k + 2], *zeros[~own & (zeros.imag > 0)]]
        v = np.polynomial.polynomial.polyint(c)
        with np.errstate(all="ignore"):
            steps = abs(
                np.polynomial.polynomial.polyval(np.array(others), v)
                - np.polynomial.polynomial.polyval(u, v)
            )
        if not np.isfinite(steps).any():
            continue
        least = int(np.nanargmin(steps))
        value = Fraction(steps[least]) * largest
        if value < 10**308:
            yield Singulant(point, f"to {others[least]:.4g}", float(value), int(lam * value))


def _short(size: mpf) -> str:
    """Two digits of a number, however small."""
    from mpmath import libmp

    return _on_one_line(str(libmp.to_str(size._mpf_, 2)))


def _at_most(size: mpf) -> str:
    """The same rounded upwards."""
    return _on_one_line(upwards(size, digits=2))


def _on_one_line(text: str) -> str:
    """A number; of one whose power of ten would fill lines, that power rounded upwards."""
    power = text.partition("e")[2]
    if len(power) < 20:
        return text
    short = Context(prec=2, rounding=ROUND_CEILING).create_decimal(power)
    return f"{'-' * text.startswith('-')}10^({short})"


# -- arrays, each scene by the cheapest method in float64 whose error will do ----------------------


def _of_arrays(
    drift: Drift,
    numbers: dict[str, Any],
    allowed: Fraction,
    request: Request,
) -> Any:
    """Each element by the first method and order whose stated error is small enough.

    What is predicted to cost more than a share of the exact integrals that it may save is not
    tried. Strong noise takes longer than the exact integral in arrays, so that it is left out.
    """
    scenes = float_scenes(drift, numbers)
    exactly = request._replace(method="exact")
    exact_seconds = _exact_seconds(drift, scenes)
    if _FOR_ATTEMPT * exact_seconds.sum() < _SECONDS_A_CALL:
        return as_floats(exactly, scenes.shape, METHODS["exact"].of_scenes(scenes, exactly))
    from symasym.asymptotics.weak_noise.arrays import index_of, own_shapes

    logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    given = {name: x for name, x in scenes.parameters.items() if is_array(x)}
    index = index_of(own_shapes(drift, numbers, scenes), scenes.shape)
    # Of a value, not of its logarithm.
    most = np.log1p(float(allowed)) * (1 - 1e-12)
    plans: list[tuple[str, int | None]] = [("laplace", n) for n in _ARRAY_ORDERS]
    plans += [("uniform", 0)] * (request.name == "T") + [("exact", None)]
    # Other drifts than polynomials are analysed with more digits than float64 has.
    in_float = drift.coefficients(drift.float_values(), NumpyOps()) is not None
    used: list[str] = []
    left = _FOR_ATTEMPTS * exact_seconds.sum()
    for method, order in plans:
        rows = np.flatnonzero(~(errors <= most))
        if not rows.size:
            break
        if order is None and not used:
            return as_floats(exactly, scenes.shape, METHODS["exact"].of_scenes(scenes, exactly))
        if order is not None:
            seconds = _seconds(method, in_float, index[rows], order)
            if seconds > min(left, _FOR_ATTEMPT * exact_seconds[rows].sum()):
                continue
            left -= seconds
        some = drift.bind(**{name: x[rows] for name, x in given.items()}) if given else drift
        # A number that all share stays what it is, so that reading it as a float counts.
        values = {n: scenes.numbers[n][rows] if is_array(x) else x for n, x in numbers.items()}
        if order is None:
            last = answer(some, values, request._replace(method=method, log=True, full=True))
            logs_and_errors = np.atleast_1d(last.value), np.atleast_1d(last.error)
            better = np.ones(len(rows), dtype=bool)
        else:
            asked = Request(request.name, method, order, None, True, True, "nan")
            logs_and_errors = _attempt(some, values, asked, index[rows])
            better = logs_and_errors[1] <= most
        logs[rows[better]], errors[rows[better]] = (
            logs_and_errors[0][better],
            logs_and_errors[1][better],
        )
        if better.any():
            used.append(method if order is None else f"{method}, order {order}")
    request = request._replace(method="auto")
    return as_floats(request, scenes.shape, Answers(logs, errors, "estimate", tuple(used)))


def _exact_seconds(drift: Drift, scenes: Scenes) -> FloatArray:
    """Predicted time of each exact integral, which grows with lam |A| up to a limit."""
    with np.errstate(all="ignore"):
        phi = _on_grid(drift, scenes)
        exponent = np.fmin(scenes.lam * np.abs(phi).max(axis=-1), _MOST_EXPONENT)
        # Away from zeros of A, a layer takes the place of many panels.
        one_sign = np.abs(np.sign(phi).sum(axis=-1)) == phi.shape[-1]
        least = scenes.lam * np.abs(phi).min(axis=-1)
        bent = np.abs(np.diff(phi, 2, axis=-1)).max(axis=-1)
        is_linear = bent <= 1e-9 * np.abs(phi).max(axis=-1)
    few = is_linear | (one_sign & (least > _MOST_EXPONENT / 2))
    exponent = np.where(few, np.fmin(exponent, _LAYER_EXPONENT), exponent)
    seconds: FloatArray = np.maximum(
        _SECONDS_EXACT + _SECONDS_EXACT_PER_EXPONENT * exponent,
        _SECONDS_STEEP + _SECONDS_STEEP_PER_EXPONENT * exponent,
    )
    return seconds


def _on_grid(drift: Drift, scenes: Scenes) -> FloatArray:
    """A on a coarse grid of [-1, 1], the last axis, for predictions; one row where all scenes share
    a drift."""
    values = {
        name: np.asarray(x, dtype=float)[..., None]
        if is_array(x)
        else np.asarray(to_float(name, x))
        for name, x in scenes.parameters.items()
    }
    return np.atleast_2d(drift.evaluate_float(_GRID, values) + 0 * _GRID)


def _seconds(method: str, in_float: bool, index: IntArray, order: int) -> float:
    """Predicted time to expand the drifts with these numbers, and to evaluate their scenes."""
    known = _SECONDS_UNIFORM if method == "uniform" else _SECONDS_A_DRIFT
    one = known if in_float else _SECONDS_WITH_DIGITS
    points = _SECONDS_A_CALL + _SECONDS_A_POINT * len(index)
    return (1 + order / 4) * points + one * len(np.unique(index))


def _attempt(
    drift: Drift, numbers: dict[str, Any], request: Request, index: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Logarithms and their errors by one method and order, infinite errors where it refuses."""
    scenes = float_scenes(drift, numbers)
    try:
        if request.method == "uniform":
            return _uniform_logs(drift, scenes, index)
        found = METHODS[request.method].of_scenes(scenes, request)
        assert found.errors is not None
        return found.logs, np.where(np.isnan(found.logs), np.inf, found.errors)
    except SymasymError:
        return np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)


def _uniform_logs(drift: Drift, scenes: Scenes, index: IntArray) -> tuple[FloatArray, FloatArray]:
    """Order 0 in float64: polynomial A, everything else would cost more than the integral."""
    from symasym.asymptotics.uniform.order_zero import escape_time
    from symasym.asymptotics.uniform.pairing_arrays import paired_of
    from symasym.asymptotics.weak_noise.arrays import logs_of

    logs, errors = logs_of(
        drift, scenes, [], (0,), escape_time, None, True, find=paired_of, index=index
    )
    return logs, np.where(errors >= 0, errors, np.inf)
