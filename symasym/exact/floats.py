"""Float64 values of the exact integrals, for many scenes at once (`of_scenes`).

From an end, with eta and zeta of `symasym.exact.balls` and A = (zeta - zeta(0))/(s eta), there are

    y = 1/sigma = zeta/eta,  w = A(0) = lam Q/sigma,  p = (zeta/eta)'(0),  c = -A'(0):

lam times the integrals over the speed density of h, h^2 and h tau, where h is the harmonic function
that is 1 at the panel's end and 0 at an absorbing end, and tau the mean time until one of both is
reached. At an absorbing end y is infinite, at a reflecting one 0. With those of both sides

    T = (w_L + w_R)/(y_L + y_R),    C = y_L/(y_L + y_R),
    E[tau^2] = 2 (T (p_L + p_R) + c_L + c_R)/(y_L + y_R).

With -phi in place of phi, and the scale and speed density in each other's, sigma
is the time spent on one side: P is made of it, and p_ss = 1/(sigma_L + sigma_R). All terms are
positive, so that nothing cancels, and carried as logarithms through panels (`float_panels`). The
claimed error is an estimate: rounding to first order, with constants that were checked against
balls. A row in doubt is swept once more with A in long double, then in balls, as are higher
moments and the line's stationary state without a layer. lam and the drift's parameters may be
complex (derivatives by a complex step).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import Any

import numpy as np

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, is_array
from symasym.drift.sampled import Field
from symasym.drift.scenes import Answer, Request, Scenes, ends_of
from symasym.exact.balls import of_scene
from symasym.exact.float_panels import OF_A, ULP, Logs, Side, constant, panels, seen

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that balls gave and float64 rounded.
ROUNDING = 4e-16
_COEFFICIENTS = 16384  # of all scenes at once, whose panels stay in memory
# Powers of a and b in I, J, N, K, M, X, C0, C1.
_WEIGHTS = np.array([[1, 0], [0, 1], [1, 1], [2, 1], [1, 1], [2, 1], [1, 2], [2, 2]])


def of_scenes(scenes: Scenes, request: Request) -> Answer:
    """Logarithms right to `TOLERANCE`, and their estimated errors; in doubt by balls."""
    logs, errors = found = float_logs(scenes, request)
    closer = request._replace(dps=17, log=True, full=False)
    why = ""
    for row in _in_doubt(found):
        try:
            logs[row] = float(of_scene(scenes.at(row), closer).value.mid())
        except AccuracyError as error:
            logs[row], why = np.nan, why or str(error)
        errors[row] = ROUNDING * abs(logs[row]) + 5e-324
    return Answer(logs, "estimate", error=errors, why=why)


def float_logs(scenes: Scenes, request: Request) -> Logs:
    """Logarithms in float64 and their errors, however large these are, in two rounds."""
    name, moment, reflecting = request.name, request.moment, request.reflecting
    numbers, model = scenes.numbers, scenes.drift.model
    if name[-1] not in "TC":
        numbers = {n: x for n, x in numbers.items() if n not in ("r", "start")}
    values, count, span = scenes.drift.values, len(scenes.lam), (-1.0, 1.0)
    if moment > 2 or not (model.layered or numbers.keys() & {"r", "left"}):
        return Logs(np.zeros(count), np.full(count, np.inf))
    if not model.layered:
        ends = scenes.ends
        span = float(ends[0].min()), float(ends[1].max())
    of = Field(scenes.drift, values, count, span)
    found = logs_of(name, of, numbers, moment, reflecting)
    if of.exact and (some := _in_doubt(found)).size:
        values = {n: x[some] if is_array(x) else x for n, x in values.items()}
        longer = Field(scenes.drift, values, len(some), span, long=True)
        fewer = {n: x[some] for n, x in numbers.items()}
        found.log[some], found.error[some] = logs_of(name, longer, fewer, moment, reflecting)
    moved, room = _moved(scenes)
    if moved:  # no faster than lam |phi|, or as two places come close to each other
        far = np.full(count, max(map(abs, span)))
        size = np.max([side.off for side in seen(of, np.arange(count), far)], axis=0) / OF_A
        found.error[:] += moved * (scenes.lam * size + 2 / room)
    return found


def _moved(scenes: Scenes) -> tuple[float, FloatArray | float]:
    """How far places move, all together, that are read as floats, and the least way between two."""
    places = [x for name, x in scenes.exactly.items() if name != "kappa"]
    moved = sum(abs(float(x)) for x in (*places, *scenes.drift.model.cuts) if x != float(x))
    known = [x for name, x in scenes.numbers.items() if name not in ("kappa", "r", "y")]
    if scenes.numbers.keys() & {"r", "left"}:
        known += scenes.ends
    gaps = np.diff(np.sort(known, axis=0), axis=0)
    return moved * ULP, np.where(gaps > 0, gaps, np.inf).min(axis=0, initial=np.inf)


def _in_doubt(found: Logs) -> Any:
    return np.flatnonzero(~(found.error <= TOLERANCE * np.maximum(1.0, np.abs(found.log))))


@np.errstate(all="ignore")
def logs_of(
    name: str,
    of: Field,
    numbers: Mapping[str, Any],
    moment: int = 1,
    reflecting: str | None = None,
) -> Logs:
    """log of "T", "C", "1 - C", "P", "1 - P" or "p_ss", and its estimated error, maybe infinite.

    `numbers` are arrays: kappa, which may be complex, and the quantity's own ones.
    """
    lam = 2.0 / (numbers["kappa"] * numbers["kappa"])
    found, many = [], max(256, _COEFFICIENTS // max(part.terms for part in of.parts))
    for low in range(0, len(lam), many):
        rows = np.arange(low, min(low + many, len(lam)))
        some = {n: x[rows] for n, x in numbers.items()}
        if name in ("T", "C", "1 - C"):
            until = some["start"], some["start"]
            both = sides(of, lam[rows], ends_of(some), until, rows, moment, reflecting)
            found.append(_of_exit(name, *both))
        else:
            found.append(_of_stay(name, of, lam[rows], some, rows))
    logs, errors = map(np.concatenate, zip(*found, strict=True))
    return Logs(logs, np.where(np.isnan(logs + errors), np.inf, errors))


def _of_exit(name: str, rate: list[Logs], w: list[Logs], *more: list[Logs]) -> Logs:
    if name != "T":
        return _share(*(rate if name == "C" else rate[::-1]))
    (log, error), (other, of_other) = _total(*w), _total(*rate)
    time = Logs(log - other, error + of_other)
    if not more:
        return time
    square, cross = (_total(*x) for x in more)
    both = Logs(time.log + square.log, time.error + square.error)
    log, error = _total(both, cross)
    return Logs(np.log(2.0) + log - other, error + of_other + ULP)


def _of_stay(name: str, of: Field, lam: Any, numbers: Mapping[str, Any], rows: Any) -> Logs:
    n, one, layer = len(lam), np.ones(len(lam)), "left" not in numbers
    low, high = numbers.get("low", -one), numbers.get("high", one)
    if name == "p_ss":
        low = high = numbers["y"]
    ends = (np.minimum(low, -1.0), np.maximum(high, 1.0)) if layer else ends_of(numbers)
    low, high = np.clip(low, *ends), np.clip(high, *ends)
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    phi, two = seen(of, rows, far, -1.0, True), np.tile(lam, 2)
    loose = max(side.loose for side in phi)
    begin, end = np.concatenate((ends[0], -ends[1])), np.concatenate((low, -high))
    state = absorbing(two)
    if layer:
        a, of_a, log = phi[0].end(-1)
        power = of.powers[1] if of.powers else 0.0
        state.log[0], state.log[1] = np.log(-two * a) - power * log, 0.0
        state.error[0] = of_a / -a.real + ULP * (2 + np.abs(state.log[0])) + loose
    (log, *_), (error, *_) = swept(phi, two, begin, end, state)
    before, after = Logs(-log[:n], error[:n]), Logs(-log[n:], error[n:])
    if name == "p_ss":
        log, error = _total(before, after)
        if of.powers:
            u = np.clip(low, -1.0, 1.0)[None]
            log = log - of.powers[1] * of.parts[0].log_noise(u, rows)[0]
        return Logs(-log, error + loose)
    middle = seen(of, rows, far, -1.0)
    (y, _, e), (of_y, _, of_e) = swept(middle, lam, low, high, absorbing(lam))
    outside = _total(Logs(before.log - e, before.error + of_e + 4 * ULP), after)
    inside = Logs(-y, of_y)
    return _share(inside, outside) if name == "P" else _share(outside, inside)


@np.errstate(all="ignore")
def sides(
    of: Field,
    lam: Any,
    ends: tuple[Any, Any],
    until: tuple[Any, Any],
    rows: Any,
    order: int = 1,
    reflecting: str | None = None,
) -> list[list[Logs]]:
    """y and w, for order 2 p and c, from the left end at until[0], from the right at until[1]."""
    n, two = len(lam), np.tile(lam, 2)
    phi = seen(of, rows, np.maximum(np.abs(ends[0]), np.abs(ends[1])), both=True)
    begin, end = (np.concatenate((a, -b)) for a, b in (ends, until))
    back = np.repeat([reflecting == side for side in ("left", "right")], n)
    log, error = swept(phi, two, begin, end, absorbing(two, order, back))
    log, error = (x.reshape(-1, 2, n) for x in (log, error))
    return [
        [Logs(log[k, side], error[k, side]) for side in (0, 1)] for k in (0, 1, 3, 4)[: 2 * order]
    ]


# -- what is carried -------------------------------------------------------------------------------


def absorbing(lam: Any, order: int = 1, reflecting: Any = False) -> Logs:
    """y, w, e, and for order 2 p and c, where a sweep begins."""
    log = np.full((3 if order == 1 else 5, len(lam)), -np.inf, lam.dtype)
    log[0], log[2] = np.where(reflecting, -np.inf, np.inf), 0.0
    return Logs(log, np.zeros(log.shape))


def swept(sides: list[Side], lam: Any, begin: Any, end: Any, state: Logs) -> Logs:
    """The state at `end` from that at `begin`, where e is 1."""
    order, last = 1 if len(state.log) == 3 else 2, len(sides) - 1
    layered, ahead = sides[0].field.layered, sides[0].mirror > 0
    if layered:
        _outside(sides[0], -1, lam, np.minimum(end, -1.0) - begin, state, order)
    for step in range(last + 1):
        # Mirror images come from the other side.
        for k in sorted({step, last - step}):
            a, b = sides[k].of.span
            low, high = np.where(ahead, a, -b), np.where(ahead, b, -a)
            low, high = np.clip(begin, low, high), np.clip(end, low, high)
            now = np.where(ahead, step, last - step) == k
            _inside(sides[k], lam, low, high, np.flatnonzero(now & (high > low)), state, order)
    if layered:
        _outside(sides[-1], 1, lam, end - np.maximum(begin, 1.0), state, order)
    return state


def _inside(phi: Side, lam: Any, low: Any, high: Any, some: Any, state: Logs, order: int) -> None:
    """Across a formula's interval."""
    if some.size:
        of, row, ends = panels(phi, some, lam[some], low[some], high[some], order)
        row, at = some[row], 0
        for to in ends:
            here, panel = row[at:to], Logs(*(x[:, at:to] for x in of))
            state.put(here, carried(state.of(here), panel, lam[here]))
            at = to


def _outside(phi: Side, side: int, lam: Any, width: Any, state: Logs, order: int) -> None:
    """Across an interval beside the layer, whose width may be 0."""
    if (some := np.flatnonzero(width > 0)).size:
        (a, off, log), lam, width = (x[some] for x in phi.end(side)), lam[some], width[some]
        panel = constant(lam * a, width, np.abs(lam) * width * off, order)
        if powers := phi.powers:
            panel.log[2:] += (_WEIGHTS[: len(panel.log) - 2] @ powers)[:, None] * log
            panel.error[2:] += phi.loose
        state.put(some, carried(state.of(some), panel, lam))


def carried(before: Logs, panel: Logs, lam: Any) -> Logs:
    """The state after a panel. With d = c + I y and t = (I w + lam M)/d

    y' = f y/d,  w' = (f w + lam J + lam N y)/d,  e' = e f/c,
    p' = (c f p + c lam J)/d^2 + 2 c lam N y/d^2 + f c lam K y^2/d^2,
    c' = (f c + lam^2 C0 + lam^2 C1 y + f t (p + lam (M + X y)/I))/d.
    """
    (y, w, e, *more), (of_y, of_w, of_e, *of_more) = before
    (fall, climb, i, j, n, *others), (of_fall, of_climb, of_i, of_j, of_n, *of_others) = panel
    # Whatever of c and I y is larger is divided out: neither may lose the other's digits.
    x = climb - y - i
    less = x.real < 0
    tail, lam = np.exp(-np.maximum(x, -x)), np.log(lam)
    kept = np.where(less, tail, 1.0).real / (1.0 + tail.real)
    per_d = np.where(less, -y - i, -climb) - np.log1p(tail)
    rate = np.where(less, -i, y - climb) - np.log1p(tail)  # y/d
    of_d, lost = kept * of_climb + (1.0 - kept) * of_i, 1.0 - kept

    def total(*terms: tuple[Any, Any, int, int]) -> tuple[Any, Any]:
        """The sum of products, each a logarithm, its error, and its powers of y and 1/d."""
        *part, log = shares(*(term[0] for term in terms))
        known = zip(part, terms, strict=True)
        error = np.abs(sum(s * (k - m * lost) for s, (*_, k, m) in zip(part, terms, strict=True)))
        return log, error * of_y + sum(s * (of + m * of_d) for s, (_, of, _, m) in known)

    found = [
        (fall + rate, of_fall + kept * of_y + of_d),
        total(
            (fall + w + per_d, of_fall + of_w, 0, 1),
            (lam + j + per_d, of_j, 0, 1),
            (lam + n + rate, of_n, 1, 1),
        ),
        (e + fall - climb, of_e + of_fall + of_climb),
    ]
    if more:
        (p, c), (of_p, of_c), (k, m, x, c0, c1) = more, of_more, others
        of_k, of_m, of_x, of_c0, of_c1 = of_others
        times = ((i + w + per_d, of_i + of_w), (lam + m + per_d, of_m))
        rates = (
            (p + per_d, of_p, 0),
            (lam + m - i + per_d, of_m + of_i, 0),
            (lam + x - i + rate, of_x + of_i, 1),
        )
        found += [
            total(
                (fall + climb + p + 2 * per_d, of_fall + of_p + of_climb, 0, 2),
                (lam + climb + j + 2 * per_d, of_j + of_climb, 0, 2),
                (np.log(2.0) + lam + climb + n + per_d + rate, of_n + of_climb, 1, 2),
                (lam + k + 2 * rate, of_k + of_climb, 2, 2),
            ),
            total(
                (fall + c + per_d, of_fall + of_c, 0, 1),
                (2 * lam + c0 + per_d, of_c0, 0, 1),
                (2 * lam + c1 + rate, of_c1, 1, 1),
                *(
                    (fall + a + b, of_fall + of_a + of_b, power, 2)
                    for a, of_a in times
                    for b, of_b, power in rates
                ),
            ),
        ]
    log, error = map(np.stack, zip(*found, strict=True))
    return Logs(log, error + _rounding(log))


def _rounding(log: Any) -> Any:
    """Of logarithms that went through a sum."""
    size = np.abs(log)
    return ULP * (2 + np.where(size < np.inf, size, 0.0))


def shares(*logs: Any) -> tuple[Any, ...]:
    """The shares of positive numbers in their sum, and its logarithm."""
    top = reduce(np.maximum, logs)
    parts = [np.exp(x - top) for x in logs]
    whole = sum(parts[1:], parts[0])
    return *((p / whole).real for p in parts), top + np.log(whole)


def _total(x: Logs, y: Logs) -> Logs:
    """The sum of positive numbers."""
    of_x, of_y, log = shares(x.log, y.log)
    return Logs(log, of_x * x.error + of_y * y.error + ULP * (2 + np.abs(log)))


def _share(x: Logs, rest: Logs) -> Logs:
    """x/(x + rest)."""
    part, other, log = shares(x.log, rest.log)
    value = np.where(part > 0.5, -np.log1p(np.exp(rest.log - x.log)), x.log - log)
    error = other * (x.error + rest.error + ULP * (np.abs(x.log) + np.abs(rest.log)))
    return Logs(value, error + ULP * (1 + np.abs(value)))
