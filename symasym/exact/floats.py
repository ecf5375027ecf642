"""float64 values of the exact integrals, for many scenes at once.

With s = exp(lam V) and S(x) = int_{-r}^x s, a sweep from the left carries
sigma = S/s, whose inverse is the rate of the scale function, and w, the time
per unit of that rate. From the left (L) and, mirrored, from the right (R),

    T = (w_L + w_R)/(1/sigma_L + 1/sigma_R),    C = 1/(1 + sigma_L/sigma_R),

which is eq:Ttilde with eq:C, every term positive (derived as positive-form).
Panels are sampled where lam V varies by a few units and replaced by their
layers where it varies by hundreds, so the cost does not grow with lam.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.drift.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_block_panels import Records, merged, records_of
from symasym.exact.float_blocks import MILD, partition
from symasym.exact.float_panels import Moments
from symasym.generated import numpy_formulas as formulas

_ULP = 3e-16  # of a logarithm, its sum included


class Sweep(NamedTuple):
    """End of sweeps from the left: log sigma and log w, with their absolute errors.

    Scenes that were given up have an infinite error.
    """

    log_sigma: FloatArray
    log_w: FloatArray
    sigma_error: FloatArray
    w_error: FloatArray


def sweep(
    field: Field,
    lam: FloatArray,
    start: FloatArray,
    end: FloatArray,
    free: bool,
    from_nothing: bool = False,
) -> Sweep:
    """Sweep every scene of `field` from `start` to `end`.

    Parameters
    ----------
    field : Field
    lam, start, end : arrays of shape (scenes,)
        `start` is -r, where the process is absorbed, or -inf with `free`.
    free : bool
        No absorption: w alone, as for a stationary density (needs a- > 0).
    from_nothing : bool
        With `free`, leave out what lies left of u = -1.
    """
    outside = _outer_left(field, lam, start, end, free)
    blocks, anchors = partition(field, lam, np.maximum(start, -1.0), np.minimum(end, 1.0))
    inside, failed = records_of(field, lam, blocks, anchors)
    right = np.flatnonzero(end > 1.0)
    beyond = float_panels.constant(
        lam[right] * field.a_plus[right], end[right] - np.maximum(1.0, start[right])
    )
    every = Records.joined(
        [
            Records.exactly(outside[0], -1, outside[1]),
            inside,
            Records.exactly(right, np.iinfo(np.intp).max, beyond),
        ]
    )
    records = merged(every.sorted())
    log_sigma = np.full(len(lam), np.inf if free else -np.inf)
    log_w = np.full(len(lam), -np.inf)
    if free and not from_nothing:
        # Left of u = -1, w is 1/a- everywhere.
        log_w = formulas.log_tail_left(field.a_minus)
    found = _compose(records, lam, field, log_sigma, log_w)
    bad = failed | np.isnan(found.log_w) | np.isnan(found.log_sigma)
    return found._replace(
        sigma_error=np.where(bad, np.inf, found.sigma_error),
        w_error=np.where(bad, np.inf, found.w_error),
    )


def _outer_left(
    field: Field, lam: FloatArray, start: FloatArray, end: FloatArray, free: bool
) -> tuple[IntArray, Moments]:
    if free:
        return np.empty(0, dtype=np.intp), float_panels.constant(np.empty(0), np.empty(0))
    chosen = np.flatnonzero(start < -1.0)
    width = np.minimum(end[chosen], -1.0) - start[chosen]
    return chosen, float_panels.constant(lam[chosen] * field.a_minus[chosen], width)


def _compose(
    records: Records,
    lam: FloatArray,
    field: Field,
    log_sigma: FloatArray,
    log_w: FloatArray,
) -> Sweep:
    """Carry sigma and w through each scene's records, in order, in the log domain.

    A running error analysis goes along: the logarithms may pass through values
    far larger than the result, and each addition of logarithms forgets the
    error of the smaller term.
    """
    total = len(lam)
    scene, moments = records.scene, records.moments
    count = np.bincount(scene, minlength=total)
    by_count = np.argsort(-count, kind="stable")
    first = np.cumsum(count) - count
    log_lam = np.log(lam[by_count])
    # A record is good to about 20 ulp, and to the rounding of phi in its exponent where phi
    # is not taken about a nearby centre.
    rounding = lam * field.size()
    local = 5e-15 + 8e-18 * np.where(rounding < MILD, rounding, 1e3)[by_count]
    log_sigma, log_w = log_sigma[by_count], log_w[by_count]
    with np.errstate(divide="ignore"):
        log_near, log_far, log_both = (np.log(m) for m in moments[1:])
    sigma_error, w_error = np.zeros(total), np.zeros(total)
    still = np.searchsorted(-count[by_count], -np.arange(count.max(initial=0)), side="left")
    for k in range(count.max(initial=0)):
        n = still[k]
        at = first[by_count[:n]] + k
        rise, near = moments.rise[at], log_near[at]
        far, both = log_far[at] + log_lam[:n], log_both[at] + log_lam[:n]
        sigma, w = log_sigma[:n], log_w[:n]
        up = rise > 0
        # Down: sigma' e = near + sigma; up: sigma' = near + sigma/e (see panels).
        entering = np.where(up, sigma - rise, sigma)
        grown = np.logaddexp(near, entering)
        before = np.where(up, w, w + rise)
        carried = np.logaddexp(before, far)
        # Upwards the share is sigma/sigma': adding `rise` to `entering - grown` would
        # cancel where sigma is forgotten, so that case takes the quotient as it is.
        share = entering - grown
        kept = ~up | (entering > near)
        share = np.where(kept, np.where(up, share + rise, share), sigma - grown)
        share = np.where(sigma == np.inf, np.where(up, rise, 0.0), share)
        log_w[:n] = np.logaddexp(share + carried, both - grown)
        log_sigma[:n] = np.where(up, grown, grown - rise)

        step = _ULP * np.abs(rise) + records.shift[at]
        own = local[:n] + records.local[at]
        old = sigma_error[:n]
        e_in = old + step + _ULP * _finite(sigma)
        p = _weight(entering, grown)
        e_grown = p * e_in + (1 - p) * own
        e_before = w_error[:n] + np.where(up, 0.0, step) + _ULP * _finite(w)
        e_carried = _weight(before, carried) * e_before + own
        e_share = np.where(kept, (1 - p) * e_in + np.where(up, step, 0.0), old + e_grown)
        q = _weight(share + carried, log_w[:n])
        w_error[:n] = q * (e_share + e_carried) + (1 - q) * (own + e_grown)
        sigma_error[:n] = e_grown + np.where(up, 0.0, step)
    result = np.empty((4, total))
    result[:, by_count] = log_sigma, log_w, sigma_error, w_error
    return Sweep(*result)


def _finite(x: FloatArray) -> FloatArray:
    return np.where(np.isfinite(x), np.abs(x), 0.0)


def _weight(part: FloatArray, whole: FloatArray) -> FloatArray:
    """exp(part - whole), with 1 for infinities."""
    difference = part - whole
    return np.exp(np.minimum(np.where(np.isnan(difference), 0.0, difference), 0.0))


class Logs(NamedTuple):
    """Natural logarithms of a quantity, and a bound on their absolute error by running analysis."""

    value: FloatArray
    error: FloatArray


def escape_time(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> Logs:
    """log T (eq:Ttilde) of each scene.

    Parameters
    ----------
    field : Field
        Each scene and, after all of them, each mirror image.
    lam, r, start : arrays of shape (scenes,)
    """
    left, right = _both(field, lam, r, start)
    w, rate = formulas.log_escape_parts(left.log_w, right.log_w, left.log_sigma, right.log_sigma)
    share, part = _weight(left.log_w, w), _weight(-left.log_sigma, rate)
    error = (
        share * left.w_error
        + (1 - share) * right.w_error
        + part * left.sigma_error
        + (1 - part) * right.sigma_error
        + _ULP * (np.abs(w) + np.abs(rate))
    )
    return Logs(w - rate, error)


def exit_probability(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray, complement: bool
) -> Logs:
    """log C (eq:C), or log(1 - C); parameters as in `escape_time`."""
    left, right = _both(field, lam, r, start)
    if complement:
        left, right = right, left
    error = (
        left.sigma_error
        + right.sigma_error
        + _ULP * (np.abs(left.log_sigma) + np.abs(right.log_sigma))
    )
    value = formulas.log_exit_share_of_logs(left.log_sigma, right.log_sigma)
    # log C = -log(1 + e^odds), whose derivative is C - 1.
    return Logs(value, error * -np.expm1(value))


def stationary_density(field: Field, lam: FloatArray, y: FloatArray) -> Logs:
    """log p_ss(y) (eq:pss) of each scene, which must slide."""
    left, right = _halves(_swept(field, lam, y, free=True))
    w = np.logaddexp(left.log_w, right.log_w)
    share = _weight(left.log_w, w)
    error = share * left.w_error + (1 - share) * right.w_error + _ULP * np.abs(w)
    return Logs(np.log(lam) - w, error)


def occupation(field: Field, lam: FloatArray, complement: bool) -> Logs:
    """log P (eq:P), or log(1 - P), of each scene, which must slide."""
    n = len(lam)
    doubled = np.tile(lam, 2)
    end = np.ones(2 * n)
    whole = sweep(field, doubled, -np.inf * end, end, free=True)
    tail = formulas.log_tail_right(field.a_plus)
    everything = np.logaddexp(whole.log_w, tail)
    share = _weight(whole.log_w, everything)
    error = share * whole.w_error + _ULP * np.abs(everything)
    near_tail, far_tail = (tail - everything)[:n], (tail - everything)[n:]
    outside = np.logaddexp(near_tail, far_tail)
    part = _weight(near_tail, outside)
    outside_error = part * error[:n] + (1 - part) * error[n:]
    layer = sweep(field, doubled, -np.inf * end, end, free=True, from_nothing=True)
    inside = layer.log_w[:n] - everything[:n]
    inside_error = layer.w_error[:n] + error[:n] + _ULP * np.abs(layer.log_w[:n])
    wanted, rest = (outside, inside) if complement else (inside, outside)
    # As log(1/(1 + odds)) the value keeps its relative precision where it is close to 1.
    value = formulas.log_occupation_share_of_logs(wanted, rest)
    return Logs(value, (inside_error + outside_error) * -np.expm1(value))


def _both(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> tuple[Sweep, Sweep]:
    doubled = np.tile(lam, 2)
    return _halves(
        sweep(field, doubled, -np.tile(r, 2), np.concatenate((start, -start)), free=False)
    )


def _swept(field: Field, lam: FloatArray, y: FloatArray, free: bool) -> Sweep:
    doubled = np.tile(lam, 2)
    return sweep(field, doubled, np.full(2 * len(lam), -np.inf), np.concatenate((y, -y)), free=free)


def _halves(both: Sweep) -> tuple[Sweep, Sweep]:
    n = len(both.log_w) // 2
    return Sweep(*(x[:n] for x in both)), Sweep(*(x[n:] for x in both))
