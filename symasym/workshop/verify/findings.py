"""The statement of a check, distances between numbers, and a drift by evaluation and quadrature."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import mpmath

import symasym as sa
from symasym.numbers.trees import MpmathOps

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


#: What the exact integrals are called in the paper.
LABELS = {"T": "eq:Ttilde", "C": "eq:C", "1-C": "eq:C", "P": "eq:P", "1-P": "eq:P"}


def label(quantity: str) -> str:
    """The paper's label of a quantity of `symasym.workshop.problems`."""
    return LABELS.get(quantity, "eq:pss")


class Finding(NamedTuple):
    """One comparison: a formula by its label, which of its evaluators, which check.

    `size` is what was found over what is allowed, so that it passes up to 1; None where the
    evaluator refused to answer and may. `where` is the scene and options, `detail` has the numbers
    where it fails.
    """

    formula: str
    evaluator: str
    check: str
    size: float | None
    where: str
    detail: str = ""

    @property
    def refused(self) -> bool:
        """True where no value was given."""
        return self.size is None

    @property
    def passed(self) -> bool:
        """True where the size is at most 1, or no value was given."""
        # A NaN is no pass.
        return self.size is None or self.size <= 1


def ratio(gap: mpf | float, allowed: mpf | float) -> float:
    """gap/allowed as a float; 0/0 is 0."""
    if not gap:
        return 0.0
    if not allowed:
        return float("inf")
    quotient = gap / allowed
    return float(quotient) if quotient < 1e300 else float("inf")


def compared(
    formula: str, evaluator: str, check: str, gap: mpf | float, allowed: mpf | float, where: str
) -> Finding:
    """The finding that `gap` must be at most `allowed`."""
    size = ratio(gap, allowed)
    detail = "" if size <= 1 else f"off by {_short(gap)} where {_short(allowed)} is allowed"
    return Finding(formula, evaluator, check, size, where, detail)


def failed(formula: str, evaluator: str, check: str, where: str, error: Exception) -> Finding:
    """The finding that something was raised where an answer was due."""
    message = f"{type(error).__name__}: {error}"
    return Finding(formula, evaluator, check, float("inf"), where, message)


def _short(x: mpf | float) -> str:
    """Three digits of a number."""
    from mpmath import mpf, nstr

    return str(nstr(mpf(getattr(x, "_mpf_", x)), 3))


def relative(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference)/abs(reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    a, b = context.convert(value), context.convert(reference)
    return abs(a - b) / abs(b) if b else abs(a)


def _bits(x: mpf | float) -> int:
    """Bits of the mantissa of an mpf; more than enough for any other number."""
    return int(x._mpf_[1].bit_length()) if hasattr(x, "_mpf_") else 64


def logarithm(value: mpf | float, dps: int = 60) -> Any:
    """log(value) as an mpf with `dps` digits."""
    context = mpmath.MPContext()
    context.dps = dps
    return mpmath.mp.make_mpf(context.log(context.convert(value))._mpf_)


def distance(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    return abs(context.convert(value) - context.convert(reference))


class Field:
    """phi and V of one drift at the precision of `mp`."""

    def __init__(self, drift: sa.Drift, mp: MPContext) -> None:
        self.drift, self.mp, self.ops = drift, mp, MpmathOps(mp)
        a_minus, a_plus = (mp.convert(Fraction(x)) for x in drift.ends)
        self.ends = (a_minus, a_plus)

    def A(self, u: mpf | Fraction | float) -> Any:
        """The drift's formula at `u`, inside the layer or not."""
        return self.drift.evaluate(u, self.ops)

    def phi(self, u: mpf | Fraction | float) -> Any:
        """eq:phi."""
        return self.A(min(max(self.mp.convert(u), -self.mp.one), self.mp.one))

    def rise(self, *points: mpf | Fraction | float) -> Any:
        """V at the last of `points`, in the layer, less V at the first."""
        return -self.mp.quad(self.A, [self.mp.convert(u) for u in points])

    def slope(self, u: mpf | Fraction | float, order: int = 1) -> Any:
        """A derivative of A."""
        return self.mp.diff(self.A, u, order)

    def zero(self, near: mpf | Fraction | float) -> Any:
        """The zero of A beside `near`."""
        return self.mp.findroot(self.A, self.mp.convert(near))
