"""What one text of mathematics asks of its numbers: float64 arrays, or mpf with any digits.

A formula that is written over an `Arithmetic` runs on either (mpmath's own pattern of contexts):
`FLOATS` takes arrays or plain floats, `Digits(context)` the numbers of an mpmath context of our
own. What Python's operators do for both (+, -, *, /, ** of whole numbers, `abs`, comparisons, & and
| of tests) is not here. Three things keep such a text right:

- constants are rationals, exactly representable or made by `rational`: a factor of 1/3 written as
  a float costs the digits;
- guards against rounding scale with `eps`;
- both branches of `where` are found before one is chosen: keep each from raising in the other's
  range, for an mpf raises where an array has NaN.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

__all__ = ["BITS", "FLOATS", "GUARD", "Arithmetic", "Digits", "from_fixed"]

#: An array, a float or an mpf; a test is an array of booleans or one.
Number = Any
Test = Any

#: Bits of e, and bits beyond those asked for in sums of integers of fixed point.
BITS = 1.4426950408889634
GUARD = 24


class Arithmetic(Protocol):
    """Numbers of one kind and their elementary functions."""

    #: The mpmath context; None for float64.
    context: Any
    bits: int
    eps: Number
    #: Below any number that counts; its reciprocal and its square root are numbers.
    tiny: Number
    zero: Number
    one: Number
    inf: Number
    pi: Number

    @property
    def euler(self) -> Number: ...

    def rational(self, p: int, q: int = 1) -> Number: ...
    def number(self, x: Number) -> Number: ...
    def size(self, x: Number) -> Number: ...
    def sqrt(self, x: Number) -> Number: ...
    def cbrt(self, x: Number) -> Number: ...
    def exp(self, x: Number) -> Number: ...
    def expm1(self, x: Number) -> Number: ...
    def log(self, x: Number) -> Number: ...
    def log1p(self, x: Number) -> Number: ...
    def gamma(self, p: int, q: int = 1) -> Number: ...
    def atan2(self, y: Number, x: Number) -> Number: ...
    def maximum(self, a: Number, b: Number) -> Number: ...
    def minimum(self, a: Number, b: Number) -> Number: ...
    def where(self, test: Test, a: Number, b: Number) -> Number: ...
    def any(self, test: Test) -> bool: ...
    def all(self, test: Test) -> bool: ...


class _Floats:
    """float64 arrays, all scenes at once; a single scene is an array of one, or a float."""

    context = None
    bits = 53
    eps = 2.0**-52
    tiny = 1e-290
    zero, one, inf = 0.0, 1.0, float("inf")
    pi, euler = float(np.pi), float(np.euler_gamma)

    sqrt = staticmethod(np.sqrt)
    cbrt = staticmethod(np.cbrt)
    exp = staticmethod(np.exp)
    expm1 = staticmethod(np.expm1)
    log = staticmethod(np.log)
    log1p = staticmethod(np.log1p)
    atan2 = staticmethod(np.arctan2)
    maximum = staticmethod(np.maximum)
    minimum = staticmethod(np.minimum)
    where = staticmethod(np.where)

    def rational(self, p: int, q: int = 1) -> float:
        """The float nearest to p/q."""
        return p / q

    def gamma(self, p: int, q: int = 1) -> float:
        """Gamma(p/q)."""
        return math.gamma(p / q)

    def number(self, x: Number) -> Any:
        """`x` itself if it is an array, else the float nearest to it."""
        return x if isinstance(x, np.ndarray) else float(x)

    def size(self, x: Number) -> Any:
        """`x` as it is wanted for the size of an error: itself."""
        return x

    def any(self, test: Test) -> bool:
        return bool(np.any(test))

    def all(self, test: Test) -> bool:
        return bool(np.all(test))


#: float64.
FLOATS = _Floats()


class Digits:
    """The numbers of one mpmath context, at its precision."""

    def __init__(self, context: MPContext) -> None:
        self.context, self.bits = context, context.prec
        self.eps, self.zero, self.one, self.inf = (
            +context.eps,
            context.zero,
            context.one,
            context.inf,
        )
        self.tiny = self.eps**18
        self.pi = +context.pi
        self.cbrt, self.exp, self.expm1 = context.cbrt, context.exp, context.expm1
        self.log1p = context.log1p
        self.atan2 = context.atan2
        self.maximum, self.minimum = max, min
        self._gammas: dict[tuple[int, int], Any] = {}

    @property
    def euler(self) -> Any:
        """Euler's constant, which takes long to many digits."""
        return +self.context.euler

    def rational(self, p: int, q: int = 1) -> Any:
        """p/q, rounded once."""
        return self.context.mpf(p) / q

    def sqrt(self, x: Number) -> Any:
        """As NumPy's of real numbers: no complex one is made."""
        return self.context.nan if x._mpf_[0] else self.context.sqrt(x)

    def log(self, x: Number) -> Any:
        """As NumPy's of real numbers."""
        if x._mpf_[1]:
            return self.context.nan if x._mpf_[0] else self.context.log(x)
        return x if x else -self.inf

    def gamma(self, p: int, q: int = 1) -> Any:
        """Gamma(p/q)."""
        if (p, q) not in self._gammas:
            self._gammas[p, q] = self.context.gamma(self.rational(p, q))
        return self._gammas[p, q]

    def number(self, x: Number) -> Any:
        """`x` in this context: a float or an mpf as it is, a rational rounded."""
        if hasattr(x, "denominator") and hasattr(x, "numerator"):
            return self.context.mpf(x.numerator) / x.denominator
        return self.context.mpf(x)

    def size(self, x: Number) -> float:
        """`x` in float64, which is enough for the size of an error, and never infinite."""
        return max(-1e300, min(float(x), 1e300))

    def where(self, test: Test, a: Number, b: Number) -> Any:
        return a if test else b

    def any(self, test: Test) -> bool:
        return bool(test)

    def all(self, test: Test) -> bool:
        return bool(test)


def from_fixed(x: int, bits: int, context: MPContext) -> Any:
    """x/2^bits in the context: an integer of fixed point, in which a power series is added up."""
    from mpmath import libmp

    return context.make_mpf(libmp.from_man_exp(x, -bits, context.prec, "n"))
