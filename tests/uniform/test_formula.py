"""The uniform formula of order 0 against exact times."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest
import sympy

import symasym as sa
from tests.formulas.values import by_definitions


def relative(e: sa.Expansion, drift: sa.Drift, kappa: str, r: str = "10") -> float:
    """The error of a formula of free parameters at these."""
    exact = sa.escape_time(drift, kappa, r, start=e.start, dps=20)
    with mpmath.workdps(30):
        return abs(float(by_definitions(e, drift, kappa, r) / exact - 1))


def test_friction_through_the_fold() -> None:
    """One text on both sides of the fold, within 0.3 kappa^2 where its conditions hold."""
    e, held = sa.expand(sa.friction(), "T", noise="uniform"), 0
    assert len(e.definitions) <= 14
    assert e.latex().count("\\\\\n") < 15
    for mu in (3, 9):
        for z0 in ("-2", "-1.2", "-7/9", "-0.75", "-0.6", "-0.4", "-0.2", "-0.01"):
            for kappa in ("0.05", "0.1", "0.3"):
                drift = sa.friction(mu=mu, alpha=1, z0=z0)
                for r in ("1.1", "10"):
                    with mpmath.workdps(20):
                        sides = [
                            [by_definitions(e, drift, kappa, r, x) for x in (c.lhs, c.rhs)]
                            for c in e.conditions
                        ]
                    if all(a > b for a, b in sides):
                        held += 1
                        error = relative(e, drift, kappa, r)
                        assert error < 0.3 * float(kappa) ** 2, (mu, z0, kappa, r)
    assert held == 40


def test_digits_at_the_fold() -> None:
    e, values = sa.expand(sa.friction(), "T", noise="uniform"), []
    with mpmath.workdps(40):
        for beside in (0, sympy.Rational(1, 10**25), -sympy.Rational(1, 10**25)):
            drift = sa.friction(mu=3, alpha=1, z0=sympy.Rational(-7, 9) + beside)
            values.append(by_definitions(e, drift, "1/10", "10"))
        assert max(abs(v / values[0] - 1) for v in values) < 1e-20


@pytest.mark.parametrize(
    ("text", "c", "start"),
    [("u**2 - u/4 + c", "1/30", "-1/2"), ("c - 3*u - 4*u**2 - u**3", "-1/5", "1/2")],
)
def test_other_drifts(text: str, c: Any, start: str) -> None:
    """With free parameters; a mirrored one has its barrier left."""
    drift = sa.Drift(text).bind(c=c)
    case = str(sa.expand(drift, "T", noise="uniform", start=start).case)
    e = sa.expand(sa.Drift(text), "T", noise="uniform", start=start, case=case)
    assert relative(e, drift, "0.05") < 0.3 * 0.05**2


def test_what_has_no_formula_is_told() -> None:
    for drift, options in (
        (sa.linear(), {}), (sa.linear(1, 2), {}), (sa.Drift("1 - 0.9*sin(pi*u)"), {}),
        (sa.friction(), {"quantity": "C"}), (sa.friction(), {"order": 1}),
        (sa.friction(3, 1, "-0.4"), {"start": "0.95"}),  # well, barrier, start
    ):  # fmt: skip
        with pytest.raises(sa.InputError, match="uniform"):
            sa.expand(drift, noise="uniform", **options)
    right_of_the_well = sa.expand(sa.friction(), noise="uniform", start="4/5").emit().load().f
    with pytest.raises(ValueError, match="only where"):
        right_of_the_well(0.05, 10, 3, 1, -0.72)
