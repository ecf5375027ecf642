"""T, C and P of a composed expansion at lam, with digits or in float64, and the order taken.

The stated error is twice the truncation error that `compose` carries through T and C, and is sure
only where int e^{lam V} is known to half of itself. An asymptotic series is best cut off where
that error is least (optimal truncation: R. B. Dingle, Asymptotic Expansions, 1973, ch. I); bounds
replace the estimate where they are proved. No next term tells what is left out where A varies fast
between critical points: the resolution test looks for that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.compose import ULP, Composed, Node
from symasym.asymptotics.weak_noise.series import (
    MOST_ROUNDING,
    Numbers,
    Point,
    Value,
    counts,
    higher,
    plus,
    times,
)
from symasym.base.errors import AccuracyError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import FloatArray, is_array
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Arithmetic, Number
from symasym.scenes import Scenes

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

_BOUNDED = ("higher orders of every series, and what is exponentially small, in the bound",)
DROPPED = ("higher orders of every series, in the error",)
# A relative error of a value beyond which nothing is said.
_MOST = 0.4
# Of the resolution test: points in the layer, and scenes at once.
_POINTS = 513
# Of |phi'|/(lam phi^2), outside of e^{±3} around wells and barriers.
_MOST_BEND = 0.25
_NEAR = 3.0
_EDGE = 13
_AT_ONCE = 512


# -- at lam ----------------------------------------------------------------------------------------


class Evaluated(NamedTuple):
    """A quantity at lam: its logarithm, and what its error is made of.

    Attributes
    ----------
    log : number
    error : number or None
        Twice the relative truncation error.
    exponents : number
        Exponents in the logarithm, which rounding is relative to.
    total : Value
        The sum over the critical points in its denominator.
    """

    log: Numbers
    error: Numbers
    exponents: Numbers
    total: Value


def escape_time(composed: Composed, at: Point) -> Evaluated:
    """T (eq:Ttilde)."""
    value, wrong = composed.time
    mean = at.value_of(value).value
    rise = at.lam * value.height if counts(value.height) else 0.0
    log = plus(at.log(mean * at.lam), rise)
    total = at.value_of(composed.sides.total)
    if not at.errors:
        return Evaluated(log, None, None, total)
    error = 2 * (at.value_of(wrong).value / mean)
    return Evaluated(log, error, plus(abs(log), rise), total)


def exit_probability(complement: bool, composed: Composed, at: Point) -> Evaluated:
    """C or 1 - C (eq:C), right where that is tiny and where its complement is."""
    p, c = composed.probabilities[complement], at.arithmetic
    rise = at.lam * (p.rest.height - p.part.height)
    part, rest = at.value_of(p.part).value, at.value_of(p.rest).value
    odds = at.log(rest / part) + rise
    # log(1 + e^odds) without overflow.
    log = -(c.maximum(odds, c.zero) + c.log1p(at.exp(-abs(odds))))
    total = at.value_of(composed.sides.total)
    if not at.errors:
        return Evaluated(log, None, None, total)
    exponents = abs(log)
    below = at.decay(p.other.height)
    if counts(below):
        exponents = exponents + times(at.value_of(p.other).size, below) * abs(rise)
    return Evaluated(log, 2 * (at.value_of(p.error).value / part), exponents, total)


def outside_layer(composed: Composed, at: Point) -> Evaluated:
    """1 - P = int_{|u| > 1} e^{-lam V}/int e^{-lam V} (eq:P)."""
    outside, whole = composed.stationary
    total = at.value_of(whole)
    rise = at.lam * (outside.height - whole.height)
    log = at.log(at.value_of(outside).value / total.value) + rise
    if not at.errors:
        return Evaluated(log, None, None, total)
    return Evaluated(log, 2 * (total.error / total.value), abs(log) + abs(rise), total)


def of_complement(log: Numbers, error: Numbers, arithmetic: Arithmetic) -> tuple[Any, Any]:
    """log(1 - x) and its error from log x and the error of that, both small."""
    # What is not below 1 by more than rounding is not known.
    log = arithmetic.minimum(log, -arithmetic.eps)
    x = arithmetic.exp(log)
    return arithmetic.log1p(-x), error * (x / -arithmetic.expm1(log))


class AtOrder(NamedTuple):
    """An expansion's value at one order and its estimated error, if that is to be trusted."""

    value: Any
    error: Any
    order: int
    sure: bool
    log: Any = None


#: A quantity from its expressions, at lam.
Evaluate = Callable[[Composed, Point], Evaluated]


def with_digits(evaluate: Evaluate, composed: Composed, at: Point) -> AtOrder:
    """The value at one lam; sure where its error and that of its denominator allow it."""
    log, error, _, total = evaluate(composed, at)
    value = at.exp(log)
    sure = 2 * total.error < total.value and value > 0 and 0 <= error < 1
    return AtOrder(value, error * value, at.order, bool(sure), log)


def float_log(evaluate: Evaluate, composed: Composed, at: Point) -> tuple[FloatArray, Any]:
    """The logarithm and its error, None where not asked for.

    Infinite unless the denominator is known to half of itself.
    """
    log, relative, exponents, total = evaluate(composed, at)
    if not at.errors:
        return log, None
    known = None
    clear = np.max(total.error) < 0.5 * np.min(total.value)
    if not (clear and np.min(relative) >= 0 and np.max(relative) < _MOST):
        known = (total.error < total.value * 0.5) & (relative >= 0) & (relative < _MOST)
        relative = np.minimum(relative, 0.9)
    wrong = relative / (1.0 - relative)
    wrong += ULP * (exponents + 8)
    # A barrier and a well of one side, the other side, and the two sides' sum.
    rounding = higher(*(_too_large(at, x) for x in composed.height_rounding))
    wrong = plus(wrong, 4 * rounding)
    return log, wrong if known is None else np.where(known, wrong, np.inf)


def _too_large(at: Point, rounding: Numbers) -> Any:
    """Rounding of the exponents that the errors leave out because it is too large for them."""
    if isinstance(rounding, float) and rounding * at.most < MOST_ROUNDING:
        return 0.0
    moved = at.lam * rounding
    return np.where(moved < MOST_ROUNDING, 0.0, moved)


def plain(node: Node, at: Point) -> tuple[Any, Any]:
    """The value and the error of an expression, the exponential included."""
    scaled, factor = at.value_of(node), at.exp(at.lam * node.height)
    return scaled.value * factor, None if scaled.error is None else scaled.error * factor


# -- the order that is taken -----------------------------------------------------------------------


class Chosen(NamedTuple):
    """The order that is taken, the kind of its error, and what a proof allows where that is larger.

    `allowed` is relative to the value.
    """

    found: AtOrder
    kind: ErrorKind
    allowed: Any = None

    def dropped(self, context: MPContext) -> tuple[str, ...]:
        """What is left out, in words; never an estimate below what a proof allows without that."""
        if self.kind == "bound":
            return _BOUNDED
        if self.allowed is None:
            return DROPPED
        size = context.nstr(self.allowed, 3)
        return (
            *DROPPED,
            f"the error is an estimate; what is proved is a relative error of {size}",
        )


def chosen(
    expanded: list[AtOrder],
    prove: Callable[[int], Any] | None,
    full: bool,
    context: MPContext,
) -> Chosen | None:
    """The best order, its error proved where that is asked for or where no estimate is sure.

    None where neither is known. `prove` gives bounds in balls, or None, for an order.
    """
    sure = [f for f in expanded if f.sure]
    best = [min(sure, key=lambda f: f.error)] if sure else []
    bounds = None
    if prove is not None and (full or not sure):
        bounds = prove((best or expanded)[-1].order)
    allowed = None
    if bounds is not None:
        proved = [f._replace(error=_distance(bounds, f.value, context)) for f in best or expanded]
        # What is refused unless it is proved has to be as good as what is not; where the bounds
        # are far apart, as without a well, a good estimate says more, unless they disprove it.
        most = max(best[0].value / 100, min(best[0].value, 100 * best[0].error)) if sure else None
        if most is None or _outside(bounds, best[0], context):
            best, most = [], None
        allowed = min(f.error / abs(f.value) for f in proved)
        proved = [f for f in proved if f.error < (f.value / 2 if most is None else most)]
        if proved:
            return Chosen(min(proved, key=lambda f: f.error), "bound")
    return Chosen(best[0], "estimate", allowed) if best else None


def of_log(relative: Number, kind: ErrorKind, context: MPContext) -> Any:
    """The error of a logarithm from the relative one of the value, below 1."""
    if kind == "bound":
        return -context.log1p(-relative) * (1 + context.mpf(10) ** (8 - context.dps))
    return relative / (1 - relative / 2)


def _ends(bounds: Any, context: MPContext) -> list[Any]:
    """Two proved bounds as numbers of the context."""
    pairs = (x.man_exp() for x in (bounds.low, bounds.high))
    return [context.mpf(int(mantissa)) * context.mpf(2) ** int(power) for mantissa, power in pairs]


def _distance(bounds: Any, value: Number, context: MPContext) -> Any:
    """The farther of two proved bounds from the value."""
    size = max(abs(end - value) for end in _ends(bounds, context))
    # The roundings here.
    return size + (abs(value) + size) * context.mpf(10) ** (8 - context.dps)


def _outside(bounds: Any, found: AtOrder, context: MPContext) -> bool:
    """True where proved bounds leave no room for the value and its estimated error."""
    low, high = _ends(bounds, context)
    reach = found.error + abs(found.value) * context.mpf(10) ** (8 - context.dps)
    return bool(found.value + reach < low or found.value - reach > high)


# -- the resolution test ---------------------------------------------------------------------------
#
# Between critical points the expansions are in |phi'|/(lam phi^2). A drift that is no polynomial
# may vary fast there although it is straight where its series are taken; then what is left out,
# e^{lam V} there, is in no next term.


def unresolved(drift: Drift, lam: float, folds: Sequence[float] = ()) -> bool:
    """True where A varies too fast for this noise, but at the folds; never for a polynomial."""
    if drift.exact_coefficients() is not None:
        return False
    u = np.linspace(-1, 1, _POINTS)
    with np.errstate(all="ignore"):
        phi = np.broadcast_to(drift.evaluate_float(u), u.shape)
    return bool(_unresolved(phi[None], np.array([lam]), folds)[0])


def require_resolved(drift: Drift, lam: Fraction, folds: Sequence[float] = ()) -> None:
    """Raise AccuracyError where A varies too fast for the noise (`unresolved`), but at folds."""
    # Noise beyond the range of float64 is weak.
    if lam < 10**300 and unresolved(drift, float(lam), folds):
        raise AccuracyError(
            f"kappa is {float(2 / lam) ** 0.5:.6g}, where the noise is too strong for a drift that "
            "varies this fast: no term of Laplace's method estimates its error; use "
            "method='exact' or 'strong_noise'."
        )


def unresolved_in(drift: Drift, scenes: Scenes) -> Any:
    """The same, for each scene."""
    unresolved = np.zeros(len(scenes.lam), dtype=bool)
    first = {n: float(x.flat[0]) if is_array(x) else x for n, x in scenes.parameters.items()}
    if not len(unresolved) or drift.bind(**first).exact_coefficients() is not None:
        return unresolved
    u = np.linspace(-1, 1, _POINTS)
    for low in range(0, len(unresolved), _AT_ONCE):
        part = slice(low, low + _AT_ONCE)
        lam = scenes.lam[part]
        values = {
            name: np.asarray(x[part])[:, None] if is_array(x) else np.asarray(float(x))
            for name, x in scenes.parameters.items()
        }
        with np.errstate(all="ignore"):
            phi = np.broadcast_to(drift.evaluate_float(u, values), (len(lam), _POINTS))
        unresolved[part] = _unresolved(phi, lam)
    return unresolved


def _unresolved(phi: FloatArray, lam: FloatArray, folds: Sequence[float] = ()) -> Any:
    """True for each row of phi that |phi'|/(lam phi^2) shows to vary too fast.

    Near a zero of phi, within e^{±3}, phi is instead to be nearly its tangent where the Gaussian
    is wide.
    """
    step = 2 / (_POINTS - 1)
    slope = np.gradient(phi, step, axis=1)
    # By trapezoids, exact where phi is its tangent: at a zero that decides what is near.
    rise = (np.cumsum(phi, axis=1) - phi / 2) * step
    # Beside u = -1 and 1 the series of these points estimate.
    near = np.zeros(phi.shape, dtype=bool)
    near[:, :_EDGE] = near[:, -_EDGE:] = True
    # Where a well and a barrier meet, phi is a parabola, and Airy functions tell.
    for fold in folds:
        middle = round((fold + 1) / step)
        near |= lam[:, None] * np.abs(rise - rise[:, middle : middle + 1]) < _NEAR
    known = near.copy()
    rows, columns = np.nonzero((phi[:, 1:] > 0) != (phi[:, :-1] > 0))
    # Beyond float64 nothing is known.
    crooked: Any = ~np.isfinite(phi).all(axis=1)
    for row, column in zip(rows, columns, strict=True):
        if crooked[row]:
            continue
        near[row] |= lam[row] * np.abs(rise[row] - rise[row, column]) < _NEAR
        if folds and known[row, column]:
            continue
        # At the width of the Gaussian A must still be nearly its tangent.
        steep = np.abs(slope[row, column])
        reach = max(1, int(1 / np.sqrt(lam[row] * steep + 1e-300) / step))
        for end in (max(int(column) - reach, 0), min(int(column) + reach, _POINTS - 1)):
            straight = steep * abs(end - int(column)) * step
            crooked[row] |= np.abs(phi[row, end] - phi[row, column]) < straight / 2
    with np.errstate(all="ignore"):
        bend = np.abs(slope) / (lam[:, None] * phi**2)
    return crooked | (np.where(near, 0.0, bend) > _MOST_BEND).any(axis=1)
