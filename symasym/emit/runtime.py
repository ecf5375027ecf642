"""Functions that NumPy or mpmath lacks; an emitted file contains copies of those that it calls.

For mpmath those of NumPy and SciPy are replaced by elementwise ones (`printing._ELEMENTWISE`).
"""

# ruff: noqa: F821
# mypy: ignore-errors

import mpmath
import numpy


def exprel_(x, n):
    """(e^x - 1)/x for n = 1, (e^x - 1 - x)/x^2 for n = 2, times e^(-max(x, 0))."""
    return scipy.special.hyp1f1(numpy.where(x < 0, 1, n), n + 1, -abs(x)) / n


def each(function, kappa, *others):
    """The function of numbers or arrays, in a single call if only kappa is an array."""
    (*first, p), n = others, len(others) - 1
    if any(numpy.ndim(x) for x in (*first, *p)):
        one = numpy.vectorize(lambda k, *x: function(k, *x[:n], x[n:]), otypes="d")
        return one(kappa, *first, *p)
    return function(kappa, *first, p)


def rule():
    """Nodes and weights on (0, 1), integrals up to each node, last Legendre coefficients."""
    x, w = numpy.polynomial.legendre.leggauss(12)
    P, n = [0 * x - 1, 0 * x + 1, x], len(x)  # P_(-1) for integrals from -1 on
    for k in range(2, n + 1):
        P.append(((2 * k - 1) * x * P[k] - (k - 1) * P[k - 1]) / k)
    up, down = numpy.array(P[2:]) - numpy.array(P[:-2]), numpy.array(P[1:-1]) * w / 4
    return (x + 1) / 2, w / 2, up.T @ down, (4 * n - 2) * down[-2:]


def march(u, to, lam, p, s=-numpy.inf, w=-numpy.inf):
    """From u to `to`: the rise of lam V, log sigma, log w (panel-step), log int e^(-lam V)."""
    X, W, WITHIN, LAST = rule()
    V, inside, h, add = 0 * lam, 0 * lam - numpy.inf, (to - u) / 4, numpy.logaddexp
    for _ in range(20000):
        if u == to:
            return V, s, w, inside
        last = abs(h) > abs(to - u) * 0.999
        h = to - u if last else h
        x = -h * drift(u + h * X, p)
        size = lam.max() * abs(x).max()
        most = max(size, abs(h) * numpy.max(rate(u + h * X, p)))
        error = lam.max() * abs(LAST @ x).sum()
        if most <= 4 and error > 500 * numpy.finfo(float).eps * (size + 0.1):
            most = 8
        if most > 4:
            h *= 3.2 / most
            continue
        rise = numpy.exp(numpy.multiply.outer(lam, WITHIN @ x))
        sums = (
            abs(h) * (rise @ W),
            abs(h) * ((1 / rise) @ W),
            h * h * ((rise @ WITHIN.T / rise) @ W),
        )
        x, (up, down, both) = lam * (W @ x), map(numpy.log, sums)
        total, kept = add(s, up), -add(0, up - s)
        w = add(w + kept, numpy.log(lam) + add(down + kept, both - total)) + x
        s, inside, V = total - x, add(inside, down - V), V + x
        u = to if last else u + h
        h *= min(3.6 / most, 4) if most else 4
    raise ValueError("kappa is too small for the exact value; take that of sa.expand(drift).emit()")


def sides(kappa, r, p):
    """Log sigma and log w at 0 from both ends; beyond the layer lam V changes linearly by x."""
    lam, h = 2 / numpy.atleast_1d(kappa) ** 2, max(r - 1, 0)
    for sign in (-1, 1):
        x = lam * end(sign, p) * sign * h
        s = numpy.log(h * exprel_(x, 1)) - numpy.minimum(x, 0)
        w = numpy.log(lam * h * exprel_(-x, 2) / exprel_(x, 1))
        yield march(sign * min(r, 1), 0, lam, p, s, w)[1:3]


def log_exit(kappa, r, sign, p):
    """Log T from 0 (positive-form), for sign = 1 log C (exit through -r), for -1 log(1 - C)."""
    (s, w), (t, v) = sides(kappa, r, p)
    add = numpy.logaddexp
    value = -add(0, sign * (s - t)) if sign else add(w, v) - add(-s, -t)
    return value.reshape(numpy.shape(kappa))[()]


def potential(lam, u, p):
    """lam V(u) by the panels."""
    inside, sign = max(min(u, 1), -1), 1 if u > 0 else -1
    V, *_ = march(-1, inside, numpy.atleast_1d(lam), p)
    return V.reshape(numpy.shape(lam))[()] - lam * end(sign, p) * (u - inside)


def log_density(kappa, u, sign, p):
    """Log p_ss(u), for sign = 1 log P, for -1 log(1 - P). Heights are relative to V(u)."""
    lam, add = 2 / numpy.atleast_1d(kappa) ** 2, numpy.logaddexp
    near, slope = max(min(u, 1), -1), end(1 if u > 0 else -1, p)
    (V, _, _, left), (W, _, _, right) = (march(near, side, lam, p) for side in (-1, 1))
    inside = add(left, right)
    beyond = add(-V - numpy.log(lam * end(-1, p)), -W - numpy.log(-lam * end(1, p)))
    beyond = beyond + 0 * beyond  # nan if infinite, at a tangency
    shift = lam * slope * (u - near)
    value = -add(0, sign * (beyond - inside)) if sign else shift - add(inside, beyond)
    return value.reshape(numpy.shape(kappa))[()]


# -- for mpmath alone ------------------------------------------------------------------------------


def log(x):
    def of_one(x):
        return mpmath.nan if isinstance(x, mpmath.mpc) or x < 0 else mpmath.log(x)

    return numpy.frompyfunc(of_one, 1, 1)(x)


def logaddexp(x, y):
    def of_two(x, y):
        return y if x == -mpmath.inf else max(x, y) + mpmath.log1p(mpmath.exp(-abs(x - y)))

    return numpy.frompyfunc(of_two, 2, 1)(x, y)


def gauss():
    """Gauss nodes and weights on (-1, 1), as many as the precision requires."""
    level = 3 + max(0, int(mpmath.ceil(mpmath.log(mpmath.mp.prec / 92, 2))))
    found = mpmath.mp._gauss_legendre.get_nodes(-1, 1, level, mpmath.mp.prec)
    return map(numpy.array, zip(*found, strict=True))
