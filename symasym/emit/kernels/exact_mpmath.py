"""The exact escape time (`symasym.emit.kernels.exact`) to any number of digits, with mpmath.

The equation is the same, M' = 1 - lam |phi| M on stretches where phi keeps its sign. On a panel M
is a Chebyshev series: integrated once, the equation is a system as wide as phi's own series, so
that a cubic drift costs a few operations a coefficient. Eliminated from the last coefficient on,
it finds M where it is smooth however large lam is. mpmath's exponents have no end: nothing is a
logarithm here.
"""

from __future__ import annotations

#: What the files say of their error.
ERROR = "none: T is computed with more and more digits until two results agree in those asked for"

TIME = '''def _series(ctx, f, cosines, a, b):
    """Chebyshev coefficients of f on (a, b), from its values at as many points."""
    n = len(cosines) // 4
    values = [ctx.mpf(f(a + (b - a) * (1 + cosines[2 * j + 1]) / 2)) for j in range(n)]
    c = [
        2 * ctx.fdot(values, [cosines[m * (2 * j + 1) % (4 * n)] for j in range(n)]) / n
        for m in range(n)
    ]
    return [c[0] / 2, *c[1:]]


def _panel(ctx, scene, rate, start, a, b):
    """M at b, its integral, rate times the drift's; None where a series does not hold them."""
    drift, cosines, known, count, digits = scene
    h = abs(b - a)
    g = [rate * h / 2 * x for x in _series(ctx, drift, cosines, a, b)]
    top, tiny = 1 + max(map(abs, g)), ctx.mpf(10) ** -digits
    if not known and max(map(abs, g[-3:])) > tiny * top:
        return None
    while len(g) > 1 and abs(g[-1]) <= tiny * top / 1000:
        g.pop()
    if not start and top > count / 2:
        return None
    drop = 2 * sum(x / (1 - m * m) for m, x in enumerate(g) if m % 2 == 0)
    # From here on whole numbers of 2^-bits, which are several times faster; M in units of h.
    bits = ctx.prec + 32
    one = 1 << bits
    g = [int(ctx.ldexp(x, bits)) for x in g]
    g[0] *= 2
    wide = len(g)
    g += [0] * (2 * count + 3)
    rows = []
    # Coefficient k of M is that of the integral of (1 - rate drift M)/2; -1 is the right side.
    for k in range(1, count + 2):
        row = {}
        for j in range(max(0, k - wide), min(count, k + wide) + 1):
            x = g[abs(k - 1 - j)] + g[k - 1 + j] - g[abs(k + 1 - j)] - g[k + 1 + j]
            row[j] = x // (4 * k) + (one if j == k else 0)
        rows.append(row)
    rows[0][-1] = one // 2
    # M at a, or one equation more: then M is the smooth solution, which any other falls to.
    free = rows.pop()
    first = {-1: int(ctx.ldexp(start / h, bits)), **{j: one * (-1) ** j for j in range(count + 1)}}
    pivots = []
    for j in range(count, 0, -1):
        held = [k for k, row in enumerate(rows) if row.get(j)]
        if not held:
            return None
        best = rows.pop(max(held, key=lambda k: abs(rows[k][j])))
        top = best.pop(j)
        best = {i: (x << bits) // top for i, x in best.items()}
        for row in (*rows, first, free):
            factor = row.pop(j, 0)
            if factor:
                for i, x in best.items():
                    row[i] = row.get(i, 0) - (factor * x >> bits)
        pivots.append(best)
    for last in (free, first):
        if not last.get(0):
            continue
        c = [(last.get(-1, 0) << bits) // last[0]]
        for row in reversed(pivots):
            rest = sum(x * c[i] for i, x in row.items() if i >= 0)
            c.append(row.get(-1, 0) - (rest >> bits))
        if max(map(abs, c[-3:])) * 10**digits > max(map(abs, c)):
            continue
        at_a = h * ctx.ldexp(sum(c[::2]) - sum(c[1::2]), -bits)
        if last is first or (drop > 3 * digits and abs(at_a - start) <= 1e4 * tiny * abs(at_a)):
            break
    else:
        return None
    mean = sum(x // (1 - m * m) for m, x in enumerate(c) if m % 2 == 0)
    return h * ctx.ldexp(sum(c), -bits), h * h * ctx.ldexp(mean, -bits), drop


def _relaxed(ctx, scene, lam, a, b):
    """M' = 1 - lam |drift| M from a, M = 0, to b: M there, its integral; lam times the drift's."""
    rate = lam if scene[0]((a + b) / 2) > 0 else -lam
    m = area = drop = done = ctx.zero
    step, fresh = ctx.one, True
    while done < 1:
        step = min(step, 1 - done)
        made = _panel(ctx, scene, rate, m, a + done * (b - a), a + (done + step) * (b - a))
        if made is None:
            step, fresh = step / 2, False
            if step < ctx.eps:
                raise ArithmeticError(
                    f"the drift is not resolved beside u = {ctx.nstr(a + done * (b - a), 8)}; "
                    "it has to be analytic in the layer"
                )
            continue
        m, area, drop, done = made[0], area + made[1], drop + made[2], done + step
        step, fresh = step * (1 + fresh), True
    return m, area, drop


def _side(ctx, scene, ends, lam, points):
    """From the end at the first point to the last: the integral of e^{lam (V - V there)}, and that
    of e^{-lam V} times the same integral."""
    s = total = ctx.zero
    for p, q in zip(points, points[1:]):
        if max(abs(p), abs(q)) > 1:
            h, a = abs(q - p), ends[p > 0]
            x = lam * abs(a) * h
            ahead = back = h * _exprel(ctx, -x)
            area, positive = h * h * _exprel2(ctx, -x), a > 0
        else:
            ahead, area, x = _relaxed(ctx, scene, lam, p, q)
            back, positive = _relaxed(ctx, scene, lam, q, p)[0], scene[0]((p + q) / 2) > 0
        if positive == (q > p):
            # V falls.
            grown = ctx.exp(x) * (s + back)
            total, s = total + ahead * grown - area, grown
        else:
            total, s = total + s * back + area, s * ctx.exp(-x) + ahead
    return s, total


def _time(ctx, drift, ends, degree, size, zeros, kappa, r):
    """T from 0, where `drift` is that of the layer and `ends` are those beyond it.

    A polynomial's `degree` is known, else it is -1; `size` is that of its terms.
    """
    if not (0 < kappa < ctx.inf and 0 < r < ctx.inf):
        given = f"kappa is {ctx.nstr(kappa, 8)}, r is {ctx.nstr(r, 8)}"
        raise ValueError(f"{given}; give numbers greater than 0")
    if not all(ctx.isfinite(x) for x in (*ends, size)):
        given = ", ".join(ctx.nstr(x, 8) for x in (*ends, size))
        raise ValueError(f"the drift at the layer's ends and its size are {given}; give numbers")
    lam = 2 / kappa**2
    digits = ctx.dps
    count = int(0.8 * digits) + 12
    # The exponent lam V is to be as exact as what it is the exponent of.
    with ctx.workdps(digits + max(0, int(ctx.log(1 + lam * size, 10))) + 3):
        n = degree + 1 if degree >= 0 else count
        cosines = [ctx.cospi(ctx.mpf(t) / (2 * n)) for t in range(4 * n)]
        scene = drift, cosines, degree >= 0, count, digits - 8
        marks = sorted({ctx.zero, *(ctx.mpf(m) for m in (-1, *zeros, 1) if abs(m) < r)})
        s, left = _side(ctx, scene, ends, lam, [-r, *(m for m in marks if m <= 0)])
        t, right = _side(ctx, scene, ends, lam, [r, *(m for m in reversed(marks) if m >= 0)])
        return lam * (left * t + right * s) / (s + t)
'''
