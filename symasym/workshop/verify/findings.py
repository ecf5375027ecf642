"""The statement of a check."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from mpmath import mpf


#: What the exact integrals are called in the paper.
LABELS = {"T": "eq:Ttilde", "C": "eq:C", "1-C": "eq:C", "P": "eq:P", "1-P": "eq:P"}


def label(quantity: str) -> str:
    """The paper's label of a quantity of `symasym.workshop.problems`."""
    return LABELS.get(quantity, "eq:pss")


class Finding(NamedTuple):
    """One comparison.

    Attributes
    ----------
    formula : str
        Label of the paper, or name of the derivation.
    evaluator : str
        Which of its evaluators.
    check : str
    size : float or None
        What was found over what is allowed, so that it passes up to 1; None where the
        evaluator refused to answer and may.
    where : str
        Scene and options.
    detail : str
        The numbers, where it fails.
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
