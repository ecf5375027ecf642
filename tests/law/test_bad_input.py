"""Laws and their scenes: one sentence and the right error, soon."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

import symasym as sa

WELL = sa.Drift("u - u**3", layer=None)
LAW = sa.exit_law(WELL, 1, 1)
INPUT: dict[str, Callable[[], Any]] = {
    "ends reversed": lambda: sa.exit_law(WELL, 1, ends=(1, -1)),
    "ends equal": lambda: sa.escape_time(WELL, [1.0], ends=(1, 1), start=1),
    "one end": lambda: sa.exit_law(WELL, 1, ends=(1,)),
    "start outside": lambda: sa.exit_law(WELL, 1, ends=(-1, 1), start=2),
    "start at an end": lambda: sa.exit_law(WELL, 1, ends=(-1, 1), start=1, reflecting="left"),
    "r and ends": lambda: sa.escape_time(WELL, 1, 1, ends=(-1, 1)),
    "neither": lambda: sa.exit_law(WELL, 1),
    "both reflect": lambda: sa.exit_law(WELL, 1, 1, reflecting="both"),
    "both, T": lambda: sa.escape_time(WELL, 1, 1, reflecting="both"),
    "noise 0": lambda: sa.exit_law(sa.Drift("-u", layer=None, noise="u"), 1, 1),
    "noise < 0": lambda: sa.exit_law(sa.Drift("-u", layer=None, noise="-1 - u**2"), 1, 1),
    "noise 0, T": lambda: sa.escape_time(sa.Drift("-u", layer=None, noise="u"), [1.0], 1),
    "noise 0, layer": lambda: sa.Drift("-u", noise="1 - u**2"),
    "order of pieces": lambda: sa.Drift.piecewise([("1", 1), ("u", 0), ("2", None)]),
    "no last piece": lambda: sa.Drift.piecewise([("1", 0), ("u", 1)]),
    "no pieces": lambda: sa.Drift.piecewise([]),
    "layer": lambda: sa.Drift("u", layer=(-2, 2)),
    "ito": lambda: sa.Drift("u", noise="2", ito="backward"),
    "moment 0": lambda: sa.escape_time(WELL, 1, 1, moment=0),
    "moment of a law": lambda: LAW.moment(0),
    "interval reversed": lambda: sa.occupation(WELL, 1, interval=(1, 0), ends=(-2, 2)),
    "an array": lambda: sa.exit_law(WELL, [1.0, 2.0], 1),
    "arrays of ends": lambda: sa.exit_law(WELL, 1, ends=([-1.0, -2.0], 1)),
    "t < 0": lambda: LAW.survival(-1),
    "t < 0, array": lambda: LAW.pdf([1.0, -1.0]),
    "t nan": lambda: LAW.cdf(np.nan),
    "p 0": lambda: LAW.quantile(0),
    "p 1": lambda: LAW.quantile(1),
    "p > 1": lambda: LAW.quantile("1.5"),
    "p 1, array": lambda: LAW.quantile([0.5, 1.0]),
    "s as text": lambda: LAW.laplace("one"),
    "s infinite": lambda: LAW.laplace(complex(np.inf, 0)),
    "no rates": lambda: LAW.rates(0),
    "left reflects": lambda: sa.exit_law(WELL, 1, 1, reflecting="left").left,
    "dps": lambda: sa.exit_law(WELL, 1, 1, dps=0),
    "full": lambda: sa.exit_law(WELL, 1, 1, full="yes"),
}
REGION: dict[str, Callable[[], Any]] = {
    "outwards": lambda: sa.occupation(sa.Drift("u", layer=None), 1),
    "no polynomial": lambda: sa.occupation(sa.Drift("-sinh(u)", layer=None), 1),
    "noise grows": lambda: sa.stationary_density(
        sa.Drift("-u", layer=None, noise="exp(u)", ito=0), 1, 0
    ),
    "beyond the pole": lambda: LAW.laplace(-3 * LAW.rate.value),
    "beyond the pole, complex": lambda: LAW.left.laplace(complex(-50, 1)),
}


@pytest.mark.parametrize("name", [*INPUT, *REGION])
def test_one_sentence(name: str) -> None:
    error, call = (sa.InputError, INPUT[name]) if name in INPUT else (sa.RegionError, REGION[name])
    with pytest.raises(error) as caught:
        call()
    assert re.fullmatch(r"[^\n]{20,400}\.", str(caught.value))


def test_an_interval_beyond_the_ends_is_cut_there() -> None:
    inside, beyond = (
        sa.occupation(WELL, 1, interval=x, ends=(-2, 2)) for x in ((0.5, 2), (0.5, 3))
    )
    assert inside == beyond


HOSTILE: dict[str, Callable[[], Any]] = {
    "weak noise": lambda: sa.exit_law(WELL, "0.01", ends=(-1.5, 1.5)).survival(1),
    "weak noise, late": lambda: sa.exit_law(WELL, "0.05", ends=(-1.5, 1.5)).survival("1e60"),
    "weak noise, rate": lambda: sa.exit_law(WELL, "0.02", ends=(-1.5, 1.5), dps=20).rate,
    "narrow": lambda: sa.exit_law(sa.polynomial(1), "0.01", 1).pdf(1),
    "narrow, rate": lambda: sa.exit_law(sa.polynomial(1), "0.1", 5).rate,
    "narrow, quantile": lambda: sa.exit_law(sa.polynomial(1), "0.1", 1).quantile("0.01"),
    "tiny": lambda: sa.exit_law(sa.polynomial(1), "0.05", 1).cdf("0.001"),
    "strong noise": lambda: sa.exit_law(WELL, 1000, 1).cdf("1e-6"),
    "early": lambda: LAW.cdf("0.01"),
    "very early": lambda: LAW.survival("1e-9"),
    "very late": lambda: LAW.pdf("1e5"),
    "large s": lambda: LAW.laplace("1e6"),
    "imaginary s": lambda: LAW.laplace(1e4j),
    "tiny p": lambda: LAW.quantile("1e-12"),
    "huge p": lambda: LAW.quantile("0.999999999999"),
    "moment 20": lambda: LAW.moment(20),
    "an end far away": lambda: sa.exit_law(sa.Drift("-u", layer=None), 1, ends=(-9, 1)).rates(3),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile(name: str) -> None:
    begin = time.process_time()
    with suppress(sa.SymasymError):
        HOSTILE[name]()
    assert time.process_time() - begin < 20
