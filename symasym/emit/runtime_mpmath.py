"""What mpmath lacks, for numbers and arrays of them; the rest is that of ``runtime.py``."""

# mypy: ignore-errors

import mpmath
import numpy


def exp(x):
    return numpy.frompyfunc(mpmath.exp, 1, 1)(x)


def log(x):
    return numpy.frompyfunc(lambda x: mpmath.log(x) if x >= 0 else mpmath.nan, 1, 1)(x)


def logaddexp(x, y):
    low, high = numpy.minimum(x, y), numpy.maximum(x, y)
    return high + numpy.frompyfunc(mpmath.log1p, 1, 1)(exp(numpy.where(high == low, 0, low - high)))


def hyp1f1(a, b, x):
    return numpy.frompyfunc(mpmath.hyp1f1, 3, 1)(a, b, x)


def airye(z, part):
    """Ai, Ai', Bi or Bi', where z > 0 times e^(+-(2/3) z^(3/2))."""
    value = (mpmath.airybi if part > 1 else mpmath.airyai)(z, derivative=part % 2)
    zeta = max(z, 0) * mpmath.sqrt(max(z, 0)) / 1.5
    return value * mpmath.exp(-zeta if part > 1 else zeta)


def quad(f, a, b):
    """The integral of f, which has its kinks at -1, 0 and 1."""
    return mpmath.quad(f, [a, *(k for k in (-1, 0, 1) if a < k < b), b])


def nodes():
    """Gauss's nodes and weights on (-1, 1), as many as the precision needs."""
    level = 3 + max(0, int(mpmath.ceil(mpmath.log(mpmath.mp.prec / 92, 2))))
    found = mpmath.mp._gauss_legendre.get_nodes(-1, 1, level, mpmath.mp.prec)
    return map(numpy.array, zip(*found, strict=True))
