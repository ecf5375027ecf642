"""Functions that mpmath lacks, for numbers and arrays; the others come from ``runtime.py``."""

# mypy: ignore-errors

import mpmath
import numpy


def log(x):
    return numpy.frompyfunc(lambda x: mpmath.log(x) if x >= 0 else mpmath.nan, 1, 1)(x)


def logaddexp(x, y):
    def of_two(x, y):
        return y if x == -mpmath.inf else max(x, y) + mpmath.log1p(mpmath.exp(-abs(x - y)))

    return numpy.frompyfunc(of_two, 2, 1)(x, y)


def airye(z, part):
    """Ai, Ai', Bi or Bi', multiplied by e^(+-(2/3) z^(3/2)) for z > 0."""
    value = (mpmath.airybi if part > 1 else mpmath.airyai)(z, derivative=part % 2)
    zeta = max(z, 0) * mpmath.sqrt(max(z, 0)) / 1.5
    return value * mpmath.exp(-zeta if part > 1 else zeta)


def nodes():
    """Gauss nodes and weights on (-1, 1), as many as the precision requires."""
    level = 3 + max(0, int(mpmath.ceil(mpmath.log(mpmath.mp.prec / 92, 2))))
    found = mpmath.mp._gauss_legendre.get_nodes(-1, 1, level, mpmath.mp.prec)
    return map(numpy.array, zip(*found, strict=True))
