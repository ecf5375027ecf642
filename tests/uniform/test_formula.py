"""The uniform formula of order 0 against exact times."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.special
import sympy

import symasym as sa
from tests.formulas.values import by_definitions

SCIPY = {
    "airyai": lambda z: scipy.special.airy(z)[0], "airyaiprime": lambda z: scipy.special.airy(z)[1],
    "airybi": lambda z: scipy.special.airy(z)[2], "airybiprime": lambda z: scipy.special.airy(z)[3],
    "hyper": lambda a, b, z: scipy.special.hyp2f1(*a, *b, z),
}  # fmt: skip


@pytest.mark.parametrize("mu", [3.0, 9.0])
def test_friction_through_the_fold(mu: float) -> None:
    """One text on both sides of the fold, within 0.3 kappa^2 up to the end of the layer."""
    e = sa.expand(sa.friction(), "T", noise="uniform")
    assert len(e.definitions) <= 21
    assert e.latex().count(r"\\ ") + e.latex().count("\\\\\n") < 14
    z0, rows = np.linspace(-2, -0.001, 801), dict(e.definitions)
    for kappa in (0.1, 0.2, 0.3):
        known: dict[str, Any] = {"mu": mu, "alpha": 1.0, "z0": z0, "kappa": kappa, "r": 10.0}

        def value(f: Any) -> Any:
            symbols = sorted(f.free_symbols, key=str)
            for s in symbols:
                known.setdefault(s.name, None)
                if known[s.name] is None:
                    known[s.name] = value(rows[s])
            with np.errstate(all="ignore"):
                return sympy.lambdify(symbols, f, [SCIPY, "scipy"])(*(known[s.name] for s in symbols))

        exact = sa.escape_time(sa.friction(mu=mu, alpha=1, z0=z0), kappa, 10, log=True)
        assert np.abs(np.expm1(np.log(value(e.formula)) - exact)).max() < 0.3 * kappa**2


def test_digits_at_the_fold() -> None:
    e, values = sa.expand(sa.friction(), "T", noise="uniform"), []
    with mpmath.workdps(40):
        for beside in (0, sympy.Rational(1, 10**25), -sympy.Rational(1, 10**25)):
            drift = sa.friction(mu=3, alpha=1, z0=sympy.Rational(-7, 9) + beside)
            values.append(by_definitions(e, drift, "1/10", "10"))
        assert max(abs(v / values[0] - 1) for v in values) < 1e-20
    exact = sa.escape_time(sa.friction(mu=3, alpha=1, z0="-7/9"), "0.1", 10)
    assert float(values[0]) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "values", "start"),
    [
        ("c - 13/10*sin(pi*u)", {"c": 1}, "0"), ("c - 13/10*sin(pi*u)", {"c": -1}, "0"),
        ("u**2 + c", {"c": "1/50"}, "-1/2"), ("c - u - 4*u**2 - u**3", {"c": "-1/5"}, "1/2"),
    ],
)  # fmt: skip
def test_other_drifts(text: str, values: dict[str, Any], start: str) -> None:
    """With free parameters, by V at the pair; a mirrored one has its barrier left."""
    drift = sa.Drift(text)
    case = str(sa.expand(drift.bind(**values), "T", noise="uniform", start=start).case)
    e = sa.expand(drift, "T", noise="uniform", start=start, case=case)
    exact = sa.escape_time(drift.bind(**values), "0.2", 10, start=start)
    with mpmath.workdps(30):
        found = float(by_definitions(e, drift.bind(**values), "1/5", "10"))
    assert found == pytest.approx(exact, rel=0.3 * 0.2**2 + 2e-3)


def test_what_has_no_formula_is_told() -> None:
    for drift, options in (
        (sa.linear(), {}), (sa.linear(1, 2), {}), (sa.Drift("1 - 0.9*sin(pi*u)"), {}),
        (sa.friction(), {"quantity": "C"}), (sa.friction(), {"order": 1}),
    ):  # fmt: skip
        with pytest.raises(sa.InputError, match="uniform"):
            sa.expand(drift, noise="uniform", **options)
