"""In an array an element without a value is nan, and ``full=True`` says why."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symasym as sa

FRICTION = sa.friction(3, 1, "-0.4")
#: A verb, its options, and noises of which those that are False have no value.
REFUSED: list[tuple[Any, sa.Drift, dict[str, Any], dict[float, bool]]] = [
    (sa.escape_time, FRICTION, {"r": 10}, {1e-3: False, 0.1: True, 1e-4: False, 1.0: True}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "laplace"}, {0.05: True, 3.0: False}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "uniform"}, {0.05: True, 3.0: False}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "strong_noise"}, {0.05: False, 30.0: True}),
    (sa.exit_probability, sa.linear(1, 2), {"r": 3, "method": "paper"}, {1.0: False}),
    (sa.occupation, sa.linear(1, -1), {"complement": True}, {0.01: False, 1.0: True}),
    (sa.stationary_density, sa.linear(1, -1), {"y": 3}, {0.01: False, 1.0: True}),
]


@pytest.mark.parametrize(("verb", "drift", "options", "noises"), REFUSED)
def test_refused_elements(
    verb: Any, drift: sa.Drift, options: dict[str, Any], noises: dict[float, bool]
) -> None:
    kappa, good = np.array(list(noises)), np.array(list(noises.values()))
    found = verb(drift, kappa[:, None], **options, full=True)
    assert (np.isnan(found.value[:, 0]) == ~good).all()
    first = int(np.argmin(good))
    assert found.notes[-1].startswith(f"no value at index ({first}, 0): ")
    with pytest.raises(sa.SymasymError) as refused:
        verb(drift, float(kappa[first]), **options)
    assert str(refused.value) in found.notes[-1]
    for k, value in zip(kappa[good], found.value[good, 0], strict=True):
        assert value == pytest.approx(verb(drift, float(k), **options), rel=1e-9)


def test_a_number_out_of_range_is_refused() -> None:
    with pytest.raises(sa.InputError, match="kappa is -1"):
        sa.escape_time(FRICTION, [0.1, -1.0], 10)
    with pytest.raises(sa.InputError, match="one element at a time"):
        sa.escape_time(FRICTION, [0.1, 1.0], 10, dps=20)
