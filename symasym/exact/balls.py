"""T, C, P and the stationary density in balls with proved radii, to any number of digits.

With lam = 2/kappa^2 and e = e^{lam V}, V' = -phi, the mean escape time and the exit probability are
made of the solutions of y'' + lam phi y' = s y to first order in s, as the system (Feller 1952)

    y' = e F,    F' = s lam y/e.

From an end of the scene to x are carried eta = y/e and zeta = F, power series in s with positive
coefficients. An end is a starting state (y, F): absorbing (0, 1), reflecting (1, 0). From an
absorbing end eta(0) = sigma and zeta = 1 + s lam Q, where sigma' = 1 + lam phi sigma, Q' = sigma.
With those from both ends at the start, and no terms that cancel,

    T = lam (Q_L sigma_R + Q_R sigma_L)/(sigma_L + sigma_R),    C = sigma_R/(sigma_L + sigma_R).

With -phi in place of phi, sigma is the time spent to the left of x, up to a factor: of these are
p_ss(x) = 1/(sigma_L + sigma_R) and P.

A panel of an interval is the matrix of (y, F) across it: three integrals of e and 1/e, and e where
it ends. Pieces of phi are halved until each panel is

- *moderate*: lam V varies by a few dozen, and the integrals are sums of power series, what these
  miss being bounded by Cauchy's estimate; or
- *slow*: phi has no zero near, and t' = 1 + lam phi t has a slow solution (Chang 1972), a
  polynomial found from its last coefficient down. Its residual over the least lam |phi| bounds its
  error, that being the rate at which two solutions approach each other.

A first pass tells which integrals change a digit that is asked for; bounds enclose the others.
Numbers may be complex balls, of which `symasym.sensitivity` makes derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from operator import mul
from typing import Any, NamedTuple

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, ctx, fmpq

from symasym.base.balls import precision, to_mpf
from symasym.base.errors import AccuracyError
from symasym.base.inputs import float_text
from symasym.drift.evaluate import Piece, pieces
from symasym.scenes import Answer, Request, Scene

_PANELS, _PANELS_A_BIT = 1_500, 12  # at most, the latter for each bit of lam
_WORK = 3e12  # a minute or so: products of coefficients, times bits
_MOST_BITS = 20_000  # beyond those that the digits take
_GROWTH = 0.15  # of `_reach` with digits: 1,000 digits take the least time with 0.1 to 0.2
_SHORT = 8  # terms of a polynomial drift whose series is found term by term
_LOG2, _LOG10 = math.log(2.0), math.log(10.0)
_NEVER = -math.inf
_ENDS = arb(-1), arb(1)
# Radii for Cauchy's estimate, and of discs on which a slow solution's coefficients are bounded.
_DISCS = [(arb(rho), math.log(rho)) for rho in (2, 3, 4.5, 6.5, 10, 16, 32, 100, 1e3, 1e5)]
_WIDTHS = [(arb(z), math.log(z), (z - 1) ** 2 / (2 * z)) for z in (3, 4, 5.5, 8, 20, 100, 1e3)]
_CELL, _GRID = 1 / 8, [arb(k / 8 - 1) for k in range(17)]


class State(NamedTuple):
    """What is carried from an end: `eta` at s = 0, and `zeta` to first order in s.

    From an absorbing end they are sigma and (1, lam Q).
    """

    eta: Any
    zeta: tuple[Any, Any]


#: (y, F) = (0, 1) at an absorbing end.
ABSORBING = State(arb(0), (arb(1), arb(0)))


class Record(NamedTuple):
    """The matrix ((y1, y2), (z1, z2)) of (y, F) across a panel, e being 1 where it begins.

    At s = 0 it is ((1, y2), (0, 1)), with y2 the integral of e. `z1` and `z2` are coefficients of
    s: lam times the integrals of 1/e, and of e(u)/e(x) over u < x. `inverse` is 1/e at the end.
    """

    y2: Any
    z1: Any
    z2: Any
    inverse: Any


def carried(state: State, p: Record) -> State:
    """The state after a panel."""
    eta, (zeta, slope) = state
    return State((eta + p.y2 * zeta) * p.inverse, (zeta, slope + p.z1 * eta + p.z2 * zeta))


def swept(
    drift: Sequence[Piece],
    lam: Any,
    begin: fmpq,
    end: fmpq,
    digits: int,
    state: State = ABSORBING,
    order: int = 1,
) -> State:
    """The state at `end` from that at `begin`, with panels for so many digits.

    `order` is that of s: 1, or 0 where only eta is asked for. Numbers may be complex balls.
    """
    for p in records(panels(drift, lam, begin, end, digits), lam, state, digits, order):
        state = carried(state, p)
    return state


def mirrored(drift: Sequence[Piece]) -> list[Piece]:
    """-phi(-u)."""
    return [Piece(-p.right, -p.left, p.phi.mirrored()) for p in reversed(drift)]


def sides(
    drift: Sequence[Piece], lam: Any, r: fmpq, start: fmpq, digits: int, order: int = 1
) -> tuple[State, State]:
    """The states at the start from -r and, in mirrored coordinates, from r.

    Notes
    -----
    With sigma = `eta` and w = lam Q = `zeta[1]` of both sides L and R,

        dT/dstart = (T - w_L)/sigma_L,    dC/dstart = -1/(sigma_L + sigma_R).

    A derivative by an end solves the equation without a source, and is there minus the slope: with
    sweeps of the whole interval, L from -r to r and R back,

        dT/dr = (1 - C) w_L/sigma_L + C w_R/sigma_R,    dC/dr = (1 - C)/sigma_L - C/sigma_R.
    """
    left = swept(drift, lam, -r, start, digits, order=order)
    return left, swept(mirrored(drift), lam, -r, -start, digits, order=order)


def _reach(digits: int) -> float:
    """The largest exponent on half a moderate panel: the more digits, the fewer panels."""
    return max(60.0, _GROWTH * digits)


# -- panels ----------------------------------------------------------------------------------------


class Panel(NamedTuple):
    """A part of a piece on which t runs from -1 to 1, and what is known of its integrals."""

    half: arb  # of its width
    slope: list[Any]  # g, lam phi times `half`, as a polynomial of t
    q: Any  # the integral of g from 0; e is e^{-q} up to a factor
    blur: arb  # what g misses on [-1, 1], at most
    terms: int  # of its series
    cauchy: tuple[arb, arb] | None  # a radius and a bound of |q| there; None for a slow panel
    rise: arb  # of q
    bounds: tuple[Any, Any, Any]  # logarithms of bounds of int e, int 1/e and the nested integral


def panels(drift: Sequence[Piece], lam: Any, begin: fmpq, end: fmpq, digits: int) -> list[Panel]:
    """Those from `begin` to `end`: parts of the pieces, halved until each is moderate or slow."""
    found: list[Panel] = []
    most = _PANELS + _PANELS_A_BIT * max(0, math.ceil(float(abs(lam).log()) / _LOG2))
    work = 0.0
    for piece in drift:
        low, high = max(piece.left, begin), min(piece.right, end)
        waiting = [(low, high)] if low < high else []
        while waiting:
            a, b = waiting.pop()
            middle = (a + b) / 2
            if len(found) + len(waiting) > most or work > _WORK:
                u = float_text(Fraction(int(middle.p), int(middle.q)))
                raise AccuracyError(
                    f"A varies too fast near u = {u} for so many digits in {most} panels, or in a "
                    "minute; ask for fewer digits, make A smooth there, or give a larger kappa."
                )
            if panel := _panel(piece, lam, a, b, digits):
                found.append(panel)
                size = len(panel.slope)
                work += size * (size + panel.terms) * ctx.prec * (1 if panel.cauchy else 10)
            else:
                waiting += [(middle, b), (a, middle)]
    return found


def _panel(piece: Piece, lam: Any, a: fmpq, b: fmpq, digits: int) -> Panel | None:
    """[a, b] as a panel, or None where it must be halved."""
    middle, half = (a + b) / 2, (b - a) / 2
    scale = lam * half
    # An absolute error of lam V is a relative one of e.
    size = abs(scale * piece.phi(arb(middle, arb(half)))).upper()
    if not size.is_finite():
        return None
    more = math.ceil(float(size.log()) / _LOG10) if size > 1 else 0
    series, missed = piece.phi.taylor(middle, half, digits + more)
    slope, blur = list(series * scale) or [arb(0)], abs(missed * scale)
    majorant = arb_poly([abs(c) for c in slope])
    terms, cauchy = _moderate(majorant, digits)
    if len(slope) == 1 and abs(slope[0].real) > 1:
        terms, cauchy = 1, None
    terms = terms or _slow_terms(majorant, digits)
    if not (terms and blur < 1):
        return None
    q = poly(slope).integral()
    known = _bounds(slope, q, majorant, cauchy, half, blur)
    return Panel(arb(half), slope, q, blur, terms, cauchy, *known)


def _moderate(majorant: arb_poly, digits: int) -> tuple[int, tuple[arb, arb] | None]:
    """Terms of a moderate panel's power series, with `Panel.cauchy`; 0 where it is not moderate."""
    grown, reach = majorant.integral(), _reach(digits)
    whole = grown(_ENDS[1])
    if not whole < reach:
        return 0, None
    wanted = float(whole) + math.log1p(float(whole)) + digits * _LOG10
    # Where A varies fast the terms may be astronomic: such a panel is halved.
    best, cauchy = 8 * (digits * _LOG10 + 2 * reach), None
    for rho, log in _DISCS:
        height = grown(rho)
        if (n := (float(height) + wanted) / log + 2) < best:
            best, cauchy = n, (rho, height)
        elif cauchy:
            break
    return (math.ceil(best) + 2, cauchy) if cauchy else (0, None)


def _slow_terms(majorant: arb_poly, digits: int) -> int:
    """Terms of the slow solution that make it right to the digits; 0 where none does."""
    mean, wanted, least = majorant[0], digits * _LOG10 + 6, 0
    for z, log, share in _WIDTHS:
        # On |z| = z the least |g| is above 0, and the terms fall off like z^-k.
        if not majorant(z) < 2 * mean:
            break
        if mean * share > wanted:
            least = math.ceil(wanted / log) + 2
    return least


def _bounds(
    slope: list[Any], q: Any, majorant: arb_poly, cauchy: Any, half: fmpq, blur: arb
) -> tuple[arb, tuple[Any, Any, Any]]:
    """`Panel.rise` and `Panel.bounds`."""
    ball = (q(_ENDS[1]) - q(_ENDS[0])).real
    width, rise = math.log(2 * int(half.p)) - math.log(int(half.q)), ball.mid()
    # Differences of q from these midpoints: blur over [-1, 1] at most, and radii.
    loose = (2 * blur + ball.rad() + 2 * sum([c.rad() for c in slope], arb(0))).upper()
    least = abs(slope[0].real) - (majorant(_ENDS[1]) - majorant[0]) - blur
    if least > 0:
        # |Re g| >= least: integrands fall off from one end at least at that rate, so that their
        # integrals are below min(2, 1/least) half times the value there.
        short = width - math.log(max(min(float(least.lower()), 1e300), 1.0)) + 0.1 + loose
        down, up = (-rise, 0.0) if rise < 0 else (0.0, rise)
        return rise, (short + down, short + up, width + short + up)
    if not cauchy:
        # A ball so wide that it hides the sign: more bits will tell.
        return rise, (math.inf,) * 3
    # Between points of the grid |q''| <= sum k |g_k| keeps q within _CELL^2/8 of that of a chord.
    heights = [float(q(t).real) for t in _GRID]
    between = float((majorant.derivative()(_ENDS[1]) * _CELL**2 / 8 + loose).upper()) + 0.1
    low, climb = heights[0], 0.0
    for x in heights:
        low = min(low, x)
        climb = max(climb, x - low)
    down, up = heights[0] - low + between, max(heights) - heights[0] + between
    return rise, (width + down, width + up, 2 * (width + between) + climb)


def records(found: list[Panel], lam: Any, state: State, digits: int, order: int) -> list[Record]:
    """The panels' records: integrals that change a digit are computed, bounds enclose the others.

    Which these are needs no proof: what is left out widens the ball, which is seen.
    """
    small = -digits * _LOG10 - 8
    eta = [state.eta.real.log().mid() if state.eta.real > 0 else _NEVER]
    for p in found:
        eta.append(_log_sum(eta[-1], p.bounds[0]) + p.rise)
    parts = [(x + p.bounds[1], p.bounds[2]) for x, p in zip(eta, found, strict=False)]
    whole = max([_NEVER, *(x for pair in parts for x in pair)]) - 12
    # `allowed`: the logarithm of a relative error of eta that changes nothing.
    allowed, out = small, []
    for p, before, (first, second) in zip(found[::-1], eta[-2::-1], parts[::-1], strict=True):
        after = _log_sum(before, p.bounds[0])
        wanted = (
            p.bounds[0] - after > allowed - 12,
            order > 0 and first - whole > small,
            order > 0 and second - whole > small,
        )
        out.append(_record(p, lam, wanted))
        allowed = min(allowed + after - before, small + whole - first if order else math.inf)
    return out[::-1]


def _log_sum(x: Any, y: Any) -> Any:
    """log(e^x + e^y)."""
    low, top = (x, y) if x < y else (y, x)
    return top if low == _NEVER else top + math.log1p(math.exp(max(float(low - top), -800.0)))


def _record(p: Panel, lam: Any, wanted: tuple[bool, bool, bool]) -> Record:
    """Its matrix, the integrals that are not wanted by their bounds."""
    # On [-1, 1] blur is integrated over a length of 2.
    rise = p.q(_ENDS[1]) - p.q(_ENDS[0]) + within(2 * p.blur, p.q)
    found: tuple[Any, ...] = (None, None, None)
    if any(wanted):
        found = _resolved(p, *p.cauchy, *wanted) if p.cauchy else _slow(p, rise, *wanted)
    y2, z1, z2 = (
        within(arb(bound).exp(), p.q) if x is None else x
        for x, bound in zip(found, p.bounds, strict=True)
    )
    return Record(y2, lam * z1, lam * z2, rise.exp())


def _resolved(
    p: Panel, rho: arb, height: arb, need_e: bool, need_inverse: bool, need_nested: bool
) -> tuple[Any, ...]:
    """The integrals of a moderate panel, from power series about its middle."""
    n, h, kind = p.terms, p.half, acb_series if isinstance(p.q, acb_poly) else arb_series
    ctx.cap = n  # `precision` restores it
    series, low = kind(list(p.q), n), p.q(_ENDS[0]).exp()
    # On |t| = rho, with |q| <= height, e^{+-q} and y = int_0 e^{q(t) - q(w)} dw, along a ray, give
    # integrals below rho^2 e^height: by Cauchy's estimate the terms from n on add up to
    rest = within(2 * height.exp() / rho ** (n - 2), p.q)
    # |e^{d} - 1| <= e^{2 blur} - 1 for what blur adds to an exponent.
    other = (2 * p.blur).expm1()
    missed = [within(other * arb(x).exp(), p.q) if other > 0 else 0 for x in p.bounds]
    int_e = int_inverse = nested = None
    if need_e or need_nested:
        down = (-series).exp().integral()
        begin, end = _at_ends(down, rest)
        int_e = h * (end - begin) * low + missed[0]
    if need_inverse or need_nested:
        up = series.exp()
        first, last = _at_ends(up.integral(), rest)
        int_inverse = h * (last - first) / low + missed[1]
    if need_nested:
        # y = e^q int_0 e^{-q} solves y' = 1 + g y: the shorter way to its coefficients.
        y = kind(_by_equation(p.slope, n), n) if len(p.slope) < _SHORT else up * down
        below, above = _at_ends(y.integral(), rest)
        nested = h * h * (above - below - begin * (last - first)) + missed[2]
    return int_e, int_inverse, nested


def _by_equation(g: list[Any], n: int) -> list[Any]:
    """Coefficients of the solution of y' = 1 + g y from 0."""
    y, turned, m = [arb(0), arb(1)], g[::-1], len(g)
    for k in range(1, n - 1):
        y.append(sum(map(mul, turned[-k - 1 :], y[max(k + 1 - m, 0) :])) / (k + 1))
    return y


def _at_ends(series: Any, rest: Any) -> tuple[Any, Any]:
    """A power series at -1 and 1, whose other terms are below `rest`."""
    whole = poly(list(series))
    return whole(_ENDS[0]) + rest, whole(_ENDS[1]) + rest


def _slow(p: Panel, rise: Any, need_e: bool, need_inverse: bool, need_nested: bool) -> Any:
    """The integrals of a slow panel: with t' = h + g t, (t e)' = h e; with -g, 1/e for e."""
    int_e = int_inverse = nested = None
    if need_inverse or need_nested:
        start, end, _ = _slow_solution(p, -1)
        int_inverse = end * rise.exp() - start
    if need_e or need_nested:
        start, end, whole = _slow_solution(p, 1)
        int_e = end * (-rise).exp() - start
        if need_nested:
            # The integral of e from the beginning, over e, is t - t(-1)/e.
            nested = whole - start * int_inverse
    return int_e, int_inverse, nested


def _slow_solution(p: Panel, sign: int) -> tuple[Any, Any, Any]:
    """The slow solution of t' = h + sign g t, at -1 and 1, and h times its integral."""
    g, n, h = [sign * c for c in p.slope], p.terms, p.half
    m, zero = len(g), arb(0)
    # (k + 1) t_{k+1} = h [k = 0] + sum g_j t_{k-j}, t_n = 0: row k is of t_k, t_{k-1}, ...
    minus = [-c for c in g]
    rows = [minus]
    for k in range(n - 1, 0, -1):
        first, *others = rows[-1]
        factor = k / first
        rows.append([c - factor * x for c, x in zip(minus, others, strict=False)] + minus[-1:])
    rows.reverse()
    t = [h / rows[0][0]]
    for k in range(1, n):
        row = rows[k]
        t.append(-sum(map(mul, row[1 : k + 1], t[:-m:-1]), zero) / row[0])
    # The polynomial solves the equation but for the terms t^n ... t^{n+m-2} of g t, and blur.
    residual = sum([abs(sum(map(mul, g[k + 1 :], t[:-m:-1]), zero)) for k in range(m - 1)], zero)
    residual += p.blur * sum(map(abs, t), zero)
    # A solution that it equals at the end towards which |e^q| grows is d away from it, where
    # |d' - (g + blur) d| <= residual: so |d| <= residual/least |Re (g + blur)|.
    least = abs(g[0].real) - sum([abs(c) for c in g[1:]], zero) - p.blur
    error = within(residual / least if least > 0 else arb.pos_inf(), p.q)
    even, odd = sum(t[::2], error), sum(t[1::2], zero)
    whole = sum([x / (2 * k + 1) for k, x in enumerate(t[::2])], error)
    return even - odd, even + odd, 2 * h * whole


def poly(terms: list[Any]) -> Any:
    """The polynomial with these coefficients."""
    return (acb_poly if isinstance(terms[-1], acb) else arb_poly)(terms)


def within(bound: arb, like: Any) -> Any:
    """A ball about 0 of at least that radius, for a polynomial's values."""
    real = arb(0, bound.upper())
    return acb(real, real) if isinstance(like, acb_poly) else real


# -- what is asked for -----------------------------------------------------------------------------


def reach(name: str, numbers: Mapping[str, fmpq]) -> fmpq:
    """How far from 0 the pieces of the drift must go for a quantity."""
    if name == "p_ss":
        return max(abs(numbers["y"]), fmpq(1)) + 1
    return numbers.get("r", fmpq(2))


def enclosure(
    name: str,
    drift: Sequence[Piece],
    lam: Any,
    numbers: Mapping[str, fmpq],
    digits: int,
    log: bool = False,
) -> Any:
    """A ball with the quantity or its natural logarithm, within `precision(bits(digits))` or more.

    Parameters
    ----------
    name : str
        As in `symasym.scenes.quantity_of`.
    drift : sequence of Piece
        As far as `reach` says; coefficients may be complex balls.
    lam : arb or acb
    numbers : mapping of str to fmpq
        r and start, or y, or none, as the quantity has.
    digits : int
        For which the panels are chosen; the ball tells what is right.
    log : bool
    """
    if name == "p_ss":
        value = _density(drift, lam, numbers["y"], digits)
    elif name == "T":
        left, right = sides(drift, lam, numbers["r"], numbers["start"], digits)
        value = left.zeta[1] * right.eta + right.zeta[1] * left.eta
        value /= left.eta + right.eta
    else:
        if name in ("C", "1 - C"):
            left, right = sides(drift, lam, numbers["r"], numbers["start"], digits, order=0)
            wanted, rest = right.eta, left.eta
        else:
            wanted, rest = _occupation(drift, lam, digits)
        if name.startswith("1 - "):
            wanted, rest = rest, wanted
        return -(rest / wanted).log1p() if log else wanted / (wanted + rest)
    return value.log() if log else value


def _from_infinity(drift: Sequence[Piece], lam: Any) -> State:
    """The state after a first piece on which phi is constant and which has no end on the left."""
    return State(-1 / (lam * drift[0].phi(_ENDS[0])), ABSORBING.zeta)


def _negative(drift: Sequence[Piece]) -> list[Piece]:
    """-phi."""
    return [Piece(p.left, p.right, p.phi.negative()) for p in drift]


def _density(drift: Sequence[Piece], lam: Any, y: fmpq, digits: int) -> Any:
    """p_ss(y) (eq:pss)."""
    back, total = _negative(drift), arb(0)
    for side, end in ((back, y), (mirrored(back), -y)):
        begin = min(end, fmpq(-1))
        total += swept(side, lam, begin, end, digits, _from_infinity(side, lam), order=0).eta
    return 1 / total


def _occupation(drift: Sequence[Piece], lam: Any, digits: int) -> tuple[Any, Any]:
    """What P and 1 - P (eq:P) are in proportion to."""
    back, one = _negative(drift), fmpq(1)
    inside, before = ABSORBING.eta, _from_infinity(back, lam).eta
    for p in records(panels(back, lam, -one, one, digits), lam, ABSORBING, digits, order=0):
        inside, before = (inside + p.y2) * p.inverse, before * p.inverse
    return inside, before + _from_infinity(mirrored(back), lam).eta


def bits(digits: int, more: int = 0) -> int:
    """A precision for so many digits, a moderate panel losing up to e^{2 reach}, and `more`."""
    return math.ceil(digits * 3.322) + int(3 * _reach(digits)) + 30 + more


def of_scene(scene: Scene, request: Request) -> Answer:
    """The value to the request's digits, or its natural logarithm.

    The logarithm is right to so many digits of its own, or to twice as many places where it nearly
    vanishes.
    """
    numbers = {name: fmpq(x.numerator, x.denominator) for name, x in scene.numbers.items()}
    lam = fmpq(scene.lam.numerator, scene.lam.denominator)
    far, digits = reach(request.name, numbers), request.digits + 3
    # Rounding of lam V, which may reach lam times the way, is taken off the digits.
    guard, more = exponent_bits(lam, far), 0
    while more < _MOST_BITS:
        working = digits + 4 + more // 8
        with precision(bits(working, guard + more)):
            drift = pieces(scene.drift, far)
            ball = enclosure(request.name, drift, arb(lam), numbers, working, request.log)
            right = ball.rel_accuracy_bits() > digits * 3.322 + 1
            if right or (request.log and ball.rad() < arb(10) ** (-2 * digits)):
                return Answer(*to_mpf(ball, request.digits), "bound", (request.name,))
        more = 2 * more + 60
    given = ", ".join(f"{name} = {float_text(x)}" for name, x in scene.numbers.items())
    raise AccuracyError(
        f"{given} and the drift leave fewer than {request.digits} digits of {request.name} right "
        f"in {_MOST_BITS} bits; ask for fewer digits, or rescale the problem."
    )


def exponent_bits(lam: fmpq, far: fmpq) -> int:
    """Bits before the point of lam V, at most, where |phi| is of order 1 as far as `far`."""
    x = lam * far
    return max(0, int(x.p).bit_length() - int(x.q).bit_length())
