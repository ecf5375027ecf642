"""What mpmath lacks: an emitted file has a copy of the functions that it calls."""

# ruff: noqa: F821
# mypy: ignore-errors

import functools

import mpmath


def logaddexp(x, y):
    """log(e^x + e^y)."""
    return max(x, y) + mpmath.log1p(mpmath.exp(-abs(x - y))) if x != y else x + mpmath.log(2)


def erfcx(x):
    """e^(x^2) erfc(x)."""
    return mpmath.exp(x**2) * mpmath.erfc(x)


def dawsn(x):
    """Dawson's integral."""
    return mpmath.sqrt(mpmath.pi) / 2 * mpmath.exp(-(x**2)) * mpmath.erfi(x)


def third(w):
    """cos(arccos(w)/3), and on beyond w = 1."""
    return mpmath.re(mpmath.cos(mpmath.acos(w) / 3)) if w > -1 else mpmath.nan


def artanhc(x):
    """artanh(x^(1/2))/x^(1/2), and on below x = 0."""
    return mpmath.hyp2f1(0.5, 1, 1.5, x)


def exprel_(x):
    """(e^x - 1)/x times e^(-max(x, 0))."""
    return mpmath.hyp1f1(1, 2, x) * mpmath.exp(-max(x, 0))


def exprel2_(x):
    """(e^x - 1 - x)/x^2 times e^(-max(x, 0))."""
    return mpmath.hyp1f1(1, 3, x) / 2 * mpmath.exp(-max(x, 0))


def airye(z, part):
    """Ai, Ai', Bi or Bi', where z > 0 times e^(+-(2/3) z^(3/2))."""
    value = (mpmath.airybi if part > 1 else mpmath.airyai)(z, derivative=part % 2)
    zeta = mpmath.mpf(2) / 3 * max(z, 0) ** mpmath.mpf(1.5)
    return value * mpmath.exp(-zeta if part > 1 else zeta)


def quad(f, a, b):
    """The integral of f, which has its kinks at -1, 0 and 1."""
    return mpmath.quad(f, [a, *(k for k in (-1, 0, 1) if a < k < b), b])


@functools.cache
def rule(prec):
    """Gauss's nodes, weights on (0, 1); integrals to each node, last Legendre terms."""
    level = 3
    while 3 * 2 ** (level - 1) < 0.13 * prec:
        level += 1
    x, w = zip(*mpmath.calculus.quadrature.GaussLegendre(mpmath.mp).calc_nodes(level, prec))
    table = [[mpmath.mpf(-1), mpmath.mpf(1), t] for t in x]  # P_(-1) for int from -1 on
    for row in table:
        for k in range(2, len(x) + 1):
            row.append(((2 * k - 1) * row[2] * row[k] - (k - 1) * row[k - 1]) / k)
    ups = [[row[k + 2] - row[k] for k in range(len(x))] for row in table]
    downs = [[v / 4 * e for e in row[1:-1]] for v, row in zip(w, table)]
    within = [[mpmath.fdot(a, b) for b in downs] for a in ups]
    last = [[(4 * len(x) - 2) * row[k] for row in downs] for k in (-1, -2)]
    return [(t + 1) / 2 for t in x], [v / 2 for v in w], within, last


def march(u, to, lam, p, sums=(0, 0, 0, 0)):
    """From u to `to`: lam V's rise, sigma and w (panel-step), int e^(-lam V)."""
    X, W, WITHIN, LAST = rule(mpmath.mp.prec)
    V, s, w, inside = sums
    h, dot = (to - u) / mpmath.mpf(4), mpmath.fdot
    for _ in range(20000):
        if u == to:
            return V, s, w, inside
        last = abs(h) > abs(to - u) * 0.999
        h = to - u if last else h
        x = [-lam * h * drift(u + h * t, p) for t in X]
        size = max(map(abs, x))
        most = max(size, *(abs(h) * rate(u + h * t, p) for t in X))
        if most <= 5 and sum(abs(dot(t, x)) for t in LAST) > 1e6 * mpmath.eps * (size + 0.1):
            most = 8
        if most > 5:
            h *= 4 / most
            continue
        rise = [mpmath.exp(dot(t, x)) for t in WITHIN]
        falls = [1 / y for y in rise]
        both = h * h * dot(W, [dot(t, rise) * y for t, y in zip(WITHIN, falls)])
        up, down, x = abs(h) * dot(W, rise), abs(h) * dot(W, falls), dot(W, x)
        inside, V = inside + down * mpmath.exp(-V), V + x
        w = (w * s + lam * (s * down + both)) * mpmath.exp(x) / (s + up)
        s = (s + up) * mpmath.exp(-x)
        u = to if last else u + h
        h *= min(4.5 / most, 4) if most else 4
    raise ValueError("kappa is too small for the exact value; take that of sa.expand(drift).emit()")


def sides(kappa, r, p):
    """The same from both ends to 0."""
    for sign in (-1, 1):
        s, w, lam = 0, 0, 2 / kappa**2
        if r > 1:
            g, h = lam * drift(sign, p) * sign, r - 1
            s = -mpmath.expm1(-g * h) / g if g else h
            w = lam * (h - s) / (g * s) if g else lam * h / 2
        yield march(mpmath.mpf(sign * min(r, 1)), 0, lam, p, (0, s, w, 0))[1:3]


def log_time(kappa, r, p):
    """log T from 0 (positive-form)."""
    (s, w), (t, v) = sides(kappa, r, p)
    return mpmath.log((w + v) / (1 / s + 1 / t))


def log_exit(kappa, r, sign, p):
    """log C, the exit through -r, or of 1 - C through r."""
    (s, _), (t, _) = sides(kappa, r, p)
    return mpmath.log((t if sign > 0 else s) / (s + t))


def potential(lam, u, p):
    """V(u) times lam, by the panels."""
    edge, way = (-1, u + 1) if u < -1 else (1, max(u - 1, 0))
    inside = march(mpmath.mpf(-1), min(u, 1), lam, p)[0] if u > -1 else 0
    return inside - lam * drift(edge, p) * way


def layers(lam, p):
    """int e^(-lam V) over the layer and beyond it."""
    V, _, _, inside = march(mpmath.mpf(-1), 1, lam, p)
    a, b = drift(-1, p), drift(1, p)
    return inside, (1 / a - mpmath.exp(-V) / b) / lam if a > 0 > b else mpmath.nan


def log_share(kappa, sign, p):
    """log P, or of 1 - P."""
    inside, beyond = layers(2 / kappa**2, p)
    return mpmath.log((inside if sign > 0 else beyond) / (inside + beyond))


def log_density(kappa, u, p):
    """log p_ss(u)."""
    return -potential(2 / kappa**2, u, p) - mpmath.log(sum(layers(2 / kappa**2, p)))
