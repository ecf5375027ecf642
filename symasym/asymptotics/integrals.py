"""The verb for an integral with a large parameter; SymPy is loaded when it is called."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symasym.asymptotics.laplace_expansion import LaplaceExpansion

__all__ = ["laplace_integral"]


def laplace_integral(
    f: Any,
    g: Any,
    x: Any,
    a: Any,
    b: Any,
    order: int | str = 3,
    *,
    maxima: Sequence[Any] | None = None,
    dps: int | None = None,
    keep: bool = False,
    check: bool = False,
) -> LaplaceExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam (Laplace's method).

    Parameters
    ----------
    f, g : Expr, str or number
        Real on (a, b). f has a Taylor series on each side of its maximum; g is there a power of
        the distance, above -1, times one. Both may be cut by Abs, Max, Min, sign, Heaviside and
        Piecewise, and may hold other symbols.
    x : Symbol or str
        Variable of integration.
    a, b : Expr or number
        Ends, a < b, possibly -oo and oo.
    order : int or "optimal"
        Terms for each maximum, 1 to 400; ``"optimal"``: up to the smallest term at each lam.
    maxima : sequence of Expr, optional
        Where f is largest, if parameters leave it open. It is compared with f all the same.
    dps : int, optional
        Digits of numerical coefficients. None: exact ones, except at a maximum that has no closed
        form, or beyond 12 terms with irrational constants: then 40 digits.
    keep : bool
        Keep the terms of smaller maxima too; otherwise they are listed in `dropped`.
    check : bool
        Compute all coefficients a second time, by moments, and compare.

    Returns
    -------
    LaplaceExpansion
        With ``evaluate(lam, dps=None, log=False, full=False)``, ``expression(lam)``, ``latex()``,
        ``bind(**values)``, ``bound``, ``contributions``, ``dropped`` and ``conditions``.

    Raises
    ------
    InputError
        If the integral diverges, f is complex, constant or larger elsewhere than at `maxima`, or
        contains what symasym doesn't evaluate.
    AccuracyError
        If the two ways to the coefficients disagree.

    Notes
    -----
    Watson's lemma after Lagrange's reversion: DLMF 2.3(iii); J. Wojdylo, SIAM Rev. 48 (2006) 76.
    The error is a proved bound where ball arithmetic can enclose what it is made of, and
    otherwise twice the largest of the next terms, which `error_kind` calls an estimate.

    Examples
    --------
    Stirling's series, Gamma(lam + 1) lam^(-lam - 1):

    >>> import symasym as sa
    >>> stirling = sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", order=3)
    >>> stirling.contributions[0].coefficients
    (sqrt(2)*sqrt(pi), sqrt(2)*sqrt(pi)/12, sqrt(2)*sqrt(pi)/288)
    >>> print(stirling.evaluate(1000, dps=20, log=True, full=True))
    -1002.5348557730 ± 4.98e-11 (bound, laplace)
    >>> stirling.evaluate([10.0, 100.0]).round(12).tolist()
    [3.6288097e-05, 0.0]
    """
    from symasym.asymptotics import laplace

    return laplace.laplace_integral(
        f, g, x, a, b, order, maxima=maxima, dps=dps, keep=keep, check=check
    )
