"""Float64 values of the exact integrals, for many scenes at once (`of_scenes`).

From an end, eta and zeta of `symasym.exact.balls` give the power series in s

    zeta/eta = D0 + D1 s + ...,    (zeta - zeta(end))/(s eta) = B0 - B1 s + ...

With h the harmonic function that is 1 at x and 0 at an absorbing end, and theta(u) the mean time
from u until x or an absorbing end is reached, B0, D1 and B1 are lam times the integrals of h, h^2
and h theta over the speed measure, and D0 = 1/eta(0), which is infinite at an absorbing end and 0
at a reflecting one. With the values from both ends L and R at the start,

    T = (B0_L + B0_R)/(D0_L + D0_R),    C = D0_L/(D0_L + D0_R),
    E[tau^2] = 2 (T (D1_L + D1_R) + B1_L + B1_R)/(D0_L + D0_R).

Replacing phi by -phi and interchanging the scale and speed densities gives p_ss and P. All terms
are positive, so that nothing cancels; logarithms are carried across the panels of `float_panels`.
The stated error is an estimate: rounding to first order, with constants that were checked against
balls. A row whose error is too large is swept again with A in long double, then in balls; so are
higher moments, and the stationary state on the line of a drift without a layer. lam and the drift's
parameters may be complex (complex step).
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np

from symasym.base.errors import SymasymError
from symasym.base.inputs import FloatArray
from symasym.drift.sampled import FloatDrift
from symasym.drift.scenes import Answer, Request, Scenes, ends_of
from symasym.exact.balls import of_scene  # the table of methods asks for it here
from symasym.exact.float_panels import OF_A, SampledDrift, in_rows, panels
from symasym.exact.logs import ULP, Logs

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that was computed in balls and rounded to float64.
ROUNDING = 4e-16
_ONE = Logs(0.0, 0.0)
_COEFFICIENTS = 16384  # of all rows at once, so that their panels fit in memory


def of_scenes(scenes: Scenes, request: Request) -> Answer:
    """Logarithms right to `TOLERANCE`, and their estimated errors; doubtful rows by balls."""
    found = float_logs(scenes, request)
    logs, errors = found.log, found.error
    closer = request._replace(dps=17, log=True, full=False)
    why = ""
    for row in _in_doubt(found):
        try:
            ball = of_scene(scenes.at(row), closer).value
            logs[row], errors[row] = float(ball.mid()), float(ball.rad())
        except SymasymError as error:
            if not scenes.shape:
                raise
            logs[row], why = np.nan, why or str(error)
        errors[row] += ROUNDING * abs(logs[row]) + 5e-324
    return Answer(logs, "estimate", error=errors, why=why)


def float_logs(scenes: Scenes, request: Request, long: bool = False) -> Logs:
    """Logarithms in float64 and their errors, however large; doubtful rows in long double."""
    numbers, model = scenes.numbers, scenes.drift.model
    if request.stationary:
        numbers = {n: x for n, x in numbers.items() if n not in ("r", "start")}
    count, span = len(scenes.lam), (-1.0, 1.0)
    if request.moment > 2 or not (model.layered or numbers.keys() & {"r", "left"}):
        return Logs(np.zeros(count), np.full(count, np.inf))
    if not model.layered:
        span = float(scenes.ends[0].min()), float(scenes.ends[1].max())
    of = FloatDrift(scenes.drift, {}, count, span, long)
    found = logs_of(request, of, numbers)
    moved, room = _moved(scenes)
    if moved:  # A place that float64 rounds changes logarithms at most at these rates.
        far = np.full(count, max(map(abs, span)))
        size = np.max([side.blur for side in in_rows(of, np.arange(count), far)], axis=0) / OF_A
        found.error[:] += moved * (scenes.lam * size + 2 / room)
    if of.exact and not long and (some := _in_doubt(found)).size:
        closer = float_logs(scenes.some(some), request, long=True)
        found.log[some], found.error[some] = closer.log, closer.error
    return found


def _moved(scenes: Scenes) -> tuple[float, FloatArray | float]:
    """Total rounding displacement of start and ends in float64, and the least distance of two."""
    places = {name: x for name, x in scenes.exactly.items() if name != "kappa"}
    cuts, numbers = scenes.drift.model.cuts, scenes.numbers
    moved = sum(abs(float(x)) for x in (*places.values(), *cuts) if x != float(x))
    # Two places may be equal in float64 alone.
    rest = {name: float(x - Fraction(float(x))) for name, x in places.items()}
    known = [(x, rest.get(n, 0.0)) for n, x in numbers.items() if n not in ("kappa", "y")]
    known += [(-x, -y) for x, y in known if "r" in numbers and x is numbers["r"]]
    gaps = [abs(a - b + (p - q)) for (a, p), (b, q) in combinations(known, 2)]
    return moved * ULP, np.where(np.array(gaps) > 0, gaps, np.inf).min(axis=0, initial=np.inf)


def _in_doubt(found: Logs) -> Any:
    return np.flatnonzero(~(found.error < TOLERANCE * np.maximum(1.0, np.abs(found.log))))


@np.errstate(all="ignore")
def logs_of(request: Request, of: FloatDrift, numbers: Mapping[str, Any]) -> Logs:
    """The logarithm of the quantity, and its estimated or infinite error.

    `numbers` are arrays: kappa, which may be complex, and the numbers of the quantity.
    """
    lam = 2.0 / (numbers["kappa"] * numbers["kappa"])
    found, many = [], max(256, _COEFFICIENTS // max(part.terms for part in of.parts))
    for low in range(0, len(lam), many):
        rows = np.arange(low, min(low + many, len(lam)))
        some = {n: x[rows] for n, x in numbers.items()}
        if not request.stationary:
            until = some["start"], some["start"]
            order, back = request.moment, request.reflecting
            both = sides(of, lam[rows], ends_of(some), until, rows, order, back)
            found.append(_of_exit(request.name, *both))
        else:
            found.append(_of_stay(request.name, of, lam[rows], some, rows))
    logs, errors = (np.concatenate(x) for x in zip(*((x.log, x.error) for x in found), strict=True))
    return Logs(logs, np.where(np.isfinite(logs + errors), errors, np.inf))


def _of_exit(name: str, d0: list[Logs], b0: list[Logs], *second: list[Logs]) -> Logs:
    if name != "T":
        return _share(*(d0 if name == "C" else d0[::-1]))
    rate = (d0[0] + d0[1]).rounded()
    time = (b0[0] + b0[1]).rounded() / rate
    if not second:
        return time
    (d1, other), (b1, beside) = second
    half = (time * (d1 + other).rounded() + (b1 + beside).rounded()).rounded() / rate
    return Logs(half.log + np.log(2.0), half.error + ULP)


def _of_stay(name: str, of: FloatDrift, lam: Any, numbers: Mapping[str, Any], rows: Any) -> Logs:
    n, one, layer = len(lam), np.ones(len(lam)), "left" not in numbers
    low, high = numbers.get("low", -one), numbers.get("high", one)
    if name == "p_ss":
        low = high = numbers["y"]
    ends = (np.minimum(low, -1.0), np.maximum(high, 1.0)) if layer else ends_of(numbers)
    low, high = np.clip(low, *ends), np.clip(high, *ends)
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    phi, two = in_rows(of, rows, far, -1.0, True), np.tile(lam, 2)
    loose = max(side.loose for side in phi)
    begin, end = np.concatenate((ends[0], -ends[1])), np.concatenate((low, -high))
    state = absorbing(two)
    if layer:
        a, of_a, log = phi[0].end(-1)
        power = of.powers[1] if of.powers else 0.0
        state.log[0], state.log[1] = np.log(-two * a) - power * log, 0.0
        state.error[0] = of_a / -a.real + ULP * (2 + np.abs(state.log[0])) + loose
    mass = _ONE / swept(phi, two, begin, end, state)[0]
    before, after = mass[:n], mass[n:]
    if name == "p_ss":
        u = np.clip(low, -1.0, 1.0)[None]
        weight = of.powers[1] * of.parts[0].log_noise(u, rows)[0] if of.powers else 0.0
        return Logs(weight, loose) / (before + after).rounded()
    y, _, e = swept(in_rows(of, rows, far, -1.0), lam, low, high, absorbing(lam))
    inside, outside = _ONE / y, (before / e * Logs(0.0, 4 * ULP) + after).rounded()
    return _share(inside, outside) if name == "P" else _share(outside, inside)


@np.errstate(all="ignore")
def sides(
    of: FloatDrift,
    lam: Any,
    ends: tuple[Any, Any],
    until: tuple[Any, Any],
    rows: Any,
    order: int = 1,
    reflecting: str | None = None,
) -> list[list[Logs]]:
    """D0 and B0, for order 2 also D1 and B1, from the left end at until[0] and from the right end
    at until[1]."""
    n, two = len(lam), np.tile(lam, 2)
    phi = in_rows(of, rows, np.maximum(np.abs(ends[0]), np.abs(ends[1])), both=True)
    begin, end = (np.concatenate((a, -b)) for a, b in (ends, until))
    back = np.repeat([reflecting == side for side in ("left", "right")], n)
    state = swept(phi, two, begin, end, absorbing(two, order, back))
    return [[x[:n], x[n:]] for x in (state[k] for k in (0, 1, 3, 4)[: 2 * order])]


# -- what is carried -------------------------------------------------------------------------------


def absorbing(lam: Any, order: int = 1, reflecting: Any = False) -> Logs:
    """The state D0, B0, e, and for order 2 D1, B1, at the beginning of a sweep."""
    log = np.full((3 if order == 1 else 5, len(lam)), -np.inf, lam.dtype)
    log[0], log[2] = np.where(reflecting, -np.inf, np.inf), 0.0
    return Logs(log, np.zeros(log.shape))


def swept(sides: list[SampledDrift], lam: Any, begin: Any, end: Any, state: Logs) -> Logs:
    """The state at `end` from that at `begin`, with e = 1 there."""
    order, last = 1 if len(state.log) == 3 else 2, len(sides) - 1
    layered, ahead = sides[0].field.layered, sides[0].mirror > 0
    if layered:
        _across(sides[0].outside(-1), lam, begin, np.minimum(end, -1.0), state, order)
    for step in range(last + 1):
        # Mirror images traverse the formulas in the opposite order.
        for k in sorted({step, last - step}):
            a, b = sides[k].of.span
            low, high = np.where(ahead, a, -b), np.where(ahead, b, -a)
            low, high = np.clip(begin, low, high), np.clip(end, low, high)
            high = np.where(np.where(ahead, step, last - step) == k, high, low)
            _across(sides[k], lam, low, high, state, order)
    if layered:
        _across(sides[-1].outside(1), lam, np.maximum(begin, 1.0), end, state, order)
    return state


def _across(phi: SampledDrift, lam: Any, low: Any, high: Any, state: Logs, order: int) -> None:
    """Advance the state across the interval of one formula, where it is not empty."""
    if (some := np.flatnonzero(high > low)).size:
        of, row, ends = panels(phi, some, lam[some], low[some], high[some], order)
        row, at = some[row], 0
        for to in ends:
            here, panel = row[at:to], of[:, at:to]
            state.put(here, carried(state.of(here), panel, lam[here]))
            at = to


def carried(before: Logs, panel: Logs, lam: Any) -> Logs:
    """The state after a panel, in terms of its record. With d = c + I D0, q = d/D0 and
    t = (I B0 + lam m10)/d,

    D0' = f/q,    B0' = (f B0 + lam m00)/d + lam m01/q,    e' = e f/c,
    D1' = c/d ((f D1 + lam m00)/d + 2 lam m01/q) + lam m02/q^2,
    B1' = (f B1 + lam^2 t0)/d + lam^2 t1/q + f t ((D1 + lam m10/I)/d + lam m11/(I q)).
    """
    (d0, b0, e, *second), (f, c, i, m00, m01, *others) = before, panel
    by, two = Logs(np.log(lam), 0.0), Logs(np.log(2.0), 0.0)
    m00, m01 = by * m00, by * m01
    d, q = c + i * d0, c / d0 + i
    found = [f / q, (f * b0 + m00) / d + m01 / q, e * f / c]
    if second:
        (d1, b1), (m02, m10, m11, t0, t1) = second, (by * x for x in others)
        t = (i * b0 + m10) / d
        found += [
            c / d * ((f * d1 + m00) / d + two * m01 / q) + m02 / q / q,
            (f * b1 + by * t0) / d + by * t1 / q + f * t * ((d1 + m10 / i) / d + m11 / i / q),
        ]
    return Logs(np.stack([x.log for x in found]), np.stack([x.error for x in found])).rounded()


def _share(x: Logs, rest: Logs) -> Logs:
    """x/(x + rest) = 1/(1 + rest/x)."""
    ratio, one = rest / x, Logs(np.zeros_like(x.log), 0.0)
    rounding = ULP * (np.abs(x.log) + np.abs(rest.log))
    whole = one + Logs(ratio.log, ratio.error + rounding)
    return Logs(-whole.log, whole.error + ULP * (1 + np.abs(whole.log)))
