"""What NumPy and, of numbers, mpmath (``mp_``) lack: a file has a copy of what it calls."""

# ruff: noqa: F821
# mypy: ignore-errors


def mp_log(x):
    return mpmath.log(x) if x >= 0 else mpmath.nan


def mp_logaddexp(x, y):
    return max(x, y) + mpmath.log1p(mpmath.exp(-abs(x - y)))


def mp_airye(z, part):
    """Ai, Ai', Bi or Bi', where z > 0 times e^(+-(2/3) z^(3/2))."""
    value = (mpmath.airybi if part > 1 else mpmath.airyai)(z, derivative=part % 2)
    zeta = max(z, 0) * mpmath.sqrt(max(z, 0)) / 1.5
    return value * mpmath.exp(-zeta if part > 1 else zeta)


def mp_exprel_(x):
    """(e^x - 1)/x times e^(-max(x, 0))."""
    return mpmath.hyp1f1(1, 2, -abs(x))


def mp_exprel2_(x):
    """(e^x - 1 - x)/x^2 times e^(-max(x, 0))."""
    return mpmath.hyp1f1(1 if x < 0 else 2, 3, -abs(x)) / 2


def airye(z, part):
    """Ai, Ai', Bi or Bi', where z > 0 times e^(+-(2/3) z^(3/2))."""
    low, high = numpy.minimum(z, 0), numpy.maximum(z, 0)
    y = numpy.where(numpy.less(z, 0), scipy.special.airy(low), scipy.special.airye(high))
    return y[part]


def exprel_(x):
    """(e^x - 1)/x times e^(-max(x, 0))."""
    return scipy.special.hyp1f1(1, 2, -abs(x))


def exprel2_(x):
    """(e^x - 1 - x)/x^2 times e^(-max(x, 0))."""
    return scipy.special.hyp1f1(numpy.where(x < 0, 1, 2), 3, -abs(x)) / 2
