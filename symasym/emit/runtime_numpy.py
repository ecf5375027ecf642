"""What NumPy lacks: an emitted file has a copy of the functions that it calls."""

# ruff: noqa: F821
# mypy: ignore-errors

import functools

import numpy


def airye(z, part):
    """Ai, Ai', Bi or Bi', where z > 0 times e^(+-(2/3) z^(3/2))."""
    low, high = numpy.minimum(z, 0), numpy.maximum(z, 0)
    y = numpy.where(numpy.less(z, 0), scipy.special.airy(low), scipy.special.airye(high))
    return y[part]


def third(w):
    """cos(arccos(w)/3), and on beyond w = 1."""
    inside = numpy.cos(numpy.arccos(numpy.minimum(w, 1)) / 3)
    return numpy.where(w < 1, inside, numpy.cosh(numpy.arccosh(numpy.maximum(w, 1)) / 3))


def artanhc(x):
    """artanh(x^(1/2))/x^(1/2), and on below x = 0."""
    root = numpy.sqrt(abs(x))
    away = numpy.where(x < 0, numpy.arctan(root), numpy.arctanh(root)) / root
    near = 1 + x * (1 / 3 + x * (1 / 5 + x * (1 / 7 + x / 9)))
    return numpy.where(root < 0.01, near, away)


def exprel_(x):
    """(e^x - 1)/x times e^(-max(x, 0))."""
    a = abs(x)
    return numpy.where(a > 0, -numpy.expm1(-a) / a, 1)


def exprel2_(x):
    """(e^x - 1 - x)/x^2 times e^(-max(x, 0))."""
    a, k = abs(x), numpy.arange(18.0)
    terms = numpy.cumprod([0.5 + 0 * a, *(-a / (j + 2) for j in k[1:])], 0).T
    near = numpy.where(x < 0, terms.sum(-1).T, (terms @ (k + 1)).T)
    away = numpy.where(x < 0, 1 - exprel_(x), exprel_(x) - numpy.exp(-a)) / a
    return numpy.where(a > 1, away, near)


def each(function, kappa, *others):
    """The function of numbers or arrays, at once where only kappa is an array."""
    (*first, p) = others
    if all(numpy.ndim(x) == 0 for x in (*first, *p)):
        return function(kappa, *first, p)
    rows = numpy.broadcast(kappa, *first, *p)
    values = [function(k, *x[: len(first)], x[len(first) :]) for k, *x in rows]
    return numpy.reshape(values, rows.shape)


@functools.cache
def rule(n=12):
    """Gauss's nodes, weights on (0, 1); integrals to each node, last Legendre terms."""
    x, w = numpy.polynomial.legendre.leggauss(n)
    table, degree = numpy.polynomial.legendre.legvander(x, n), 2 * numpy.arange(n) + 1
    up = table[:, 1:] - numpy.hstack([-numpy.ones((n, 1)), table[:, : n - 1]])
    terms = (table[:, :n] * w[:, None] * degree / 2).T
    return (x + 1) / 2, w / 2, (up / degree) @ terms / 2, terms[-2:]


def march(u, to, lam, p, sums):
    """From u to `to`: lam V's rise, log sigma and log w (panel-step), log of int e^(-lam V)."""
    X, W, WITHIN, LAST = rule()
    V, s, w, inside = sums
    h, add, more = (to - u) / 4, numpy.logaddexp, numpy.log(lam)
    for _ in range(20000):
        if u == to:
            return V, s, w, inside
        last = abs(h) > abs(to - u) * 0.999
        h = to - u if last else h
        x = -h * drift(u + h * X, p)
        size = lam.max() * abs(x).max()
        most = max(size, abs(h) * numpy.max(rate(u + h * X, p)))
        if most <= 5 and lam.max() * abs(LAST @ x).sum() > 1e-13 * size + 1e-14:
            most = 8
        if most > 5:
            h *= 4 / most
            continue
        rise = numpy.exp(numpy.multiply.outer(lam, WITHIN @ x))
        x, h2 = lam * (W @ x), numpy.log(abs(h))
        up, down = numpy.log(rise @ W) + h2, numpy.log((1 / rise) @ W) + h2
        both = numpy.log(((rise @ WITHIN.T) / rise) @ W) + 2 * h2
        total = add(s, up)
        inside = add(inside, down - V)
        kept = -add(0, up - s)
        w = add(w + kept, more + add(down + kept, both - total)) + x
        s, V = total - x, V + x
        u = to if last else u + h
        h *= min(4.5 / most, 4) if most else 4
    raise ValueError("kappa is too small for the exact value; take that of sa.expand(drift).emit()")


def layer(lam, to, p):
    """The same from -1 on."""
    none = numpy.full(lam.shape, -numpy.inf)
    return march(-1.0, to, lam, p, (0 * lam, none, none, none))


def sides(kappa, r, p):
    """The same from both ends to 0; beyond the layer lam V changes by x, a line."""
    lam, h, found = 2 / numpy.atleast_1d(kappa) ** 2, max(r - 1, 0.0), []
    for sign in (-1.0, 1.0):
        x = lam * drift(sign, p) * sign * h
        s = numpy.log(h * exprel_(x)) - numpy.minimum(x, 0)
        w = numpy.log(lam * h * exprel2_(-x) / exprel_(x))
        none = numpy.full(lam.shape, -numpy.inf)
        found.append(march(sign * min(r, 1.0), 0.0, lam, p, (0 * lam, s, w, none)))
    return found


def log_time(kappa, r, p):
    """log T from 0 (positive-form)."""
    (_, s, w, _), (_, t, v, _) = sides(kappa, r, p)
    return (numpy.logaddexp(w, v) - numpy.logaddexp(-s, -t)).reshape(numpy.shape(kappa))


def log_exit(kappa, r, sign, p):
    """log C, the exit through -r, or of 1 - C through r."""
    (_, s, _, _), (_, t, _, _) = sides(kappa, r, p)
    return -numpy.logaddexp(0, sign * (s - t)).reshape(numpy.shape(kappa))


def potential(lam, u, p):
    """V(u) times lam, by the panels."""
    if u < -1:
        return -lam * drift(-1.0, p) * (u + 1)
    V, *_ = layer(numpy.atleast_1d(lam), min(u, 1.0), p)
    return V.reshape(numpy.shape(lam)) - (lam * drift(1.0, p) * (u - 1) if u > 1 else 0)


def layers(lam, p):
    """Logs of int e^(-lam V) over the layer and beyond it."""
    V, _, _, inside = layer(lam, 1.0, p)
    beyond = numpy.logaddexp(-numpy.log(lam * drift(-1.0, p)), -V - numpy.log(-lam * drift(1.0, p)))
    return inside + 0 * beyond, beyond


def log_share(kappa, sign, p):
    """log P, or of 1 - P."""
    inside, beyond = layers(2 / numpy.atleast_1d(kappa) ** 2, p)
    return -numpy.logaddexp(0, sign * (beyond - inside)).reshape(numpy.shape(kappa))


def log_density(kappa, u, p):
    """log p_ss(u)."""
    whole = numpy.logaddexp(*layers(2 / numpy.atleast_1d(kappa) ** 2, p))
    return -potential(2 / kappa**2, u, p) - whole.reshape(numpy.shape(kappa))
