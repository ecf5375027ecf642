"""No claim about a law is below the true error: 40 digits tell, and the collocation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import symasym as sa
from tests.law.scenes import Scene, drawn


def claims(
    scene: Scene, random: Any, late: bool, transforms: int
) -> Iterator[tuple[str, Any, Any]]:
    """Estimates, and the same to more digits; times only where `late`, so many transforms."""
    law, fine = scene.law(full=True), scene.law(dps=40, full=True)
    try:
        rate = float(law.rate)
    except sa.AccuracyError:  # refused, as of some narrow laws
        rate = 1 / float(law.mean)
    asked: dict[str, Any] = {
        "mean": lambda f: f.mean,
        "variance": lambda f: f.variance,
        "std": lambda f: f.std,
        "moment 3": lambda f: f.moment(3),
        "rate": lambda f: f.rate,
    }
    for _ in range(transforms):
        for s in (random.uniform(-0.9, 5), complex(*random.uniform(-0.5, 4, 2))):
            asked[f"laplace {s * rate}"] = lambda f, s=s: f.laplace(s * rate)
    for side in {"left", "right"} - {scene.reflecting}:
        asked[f"P {side}"] = lambda f, side=side: getattr(f, side).probability
        asked[f"mean {side}"] = lambda f, side=side: getattr(f, side).mean
    if late and rate:
        t, p = float(-np.log(random.uniform(0.01, 0.9)) / rate), float(random.uniform(0.05, 0.95))
        fine_times = scene.law(dps=24, full=True)
        for name in ("survival", "cdf", "pdf"):
            asked[f"{name} {t}"] = lambda f, name=name: getattr(f, name)(t)
        asked["quantile"] = lambda f: f.quantile(p)
    for name, of in asked.items():
        try:
            found = of(law)
            yield name, found, of(fine_times if name[:3] in ("sur", "cdf", "pdf", "qua") else fine)
        except (sa.AccuracyError, sa.RangeError):
            continue  # refused


def arrays(scene: Scene, random: Any) -> Iterator[tuple[str, Any, Any]]:
    """The float engine's."""
    kappa, low, high = float(scene.kappa), *map(float, scene.ends)
    for moment in (1, 2):
        ask = {**scene.numbers, "log": True, "full": True, "moment": moment}
        found = sa.escape_time(scene.drift, [kappa, 1.5 * kappa], **ask)
        for k, x in enumerate((kappa, 1.5 * kappa)):
            each = sa.Estimate(found.value[k], found.error[k], "estimate", "exact")
            yield f"array, moment {moment}", each, sa.escape_time(scene.drift, x, **ask, dps=40)
    inside = sorted(random.uniform(low, high, 2).tolist())
    for options in ({}, {"complement": True}):
        ask = {"interval": inside, "ends": scene.ends, "full": True, "log": True, **options}
        found = sa.occupation(scene.drift, scene.kappa, **ask)
        yield "share", found, sa.occupation(scene.drift, scene.kappa, **ask, dps=40)


def held(seeds: range, late: int, transforms: int) -> tuple[int, int, list[str]]:
    """Claims, those looked at by collocation, and what is wrong, times at every `late`-th seed."""
    many, by_collocation, wrong = 0, 0, []
    for seed in seeds:
        random = np.random.default_rng(seed)
        scene = drawn(random)
        slow = scene.sigma != "1" or "(" in scene.phi[0][0][:4]
        values = {}
        with mp.workdps(60):
            found = [*claims(scene, random, seed % (late * (3 if slow else 1)) == 0, transforms)]
            for name, each, fine in found + [*arrays(scene, random)]:
                many, values[name] = many + 1, each
                far = abs(mp.mpmathify(each.value) - mp.mpmathify(fine.value))
                if not far <= mpf(each.error) + mpf(fine.error):
                    wrong.append(f"{seed} {name} {each!r} {fine!r} {scene}")
        known = scene.collocation(300).moments() if float(scene.kappa) > 0.3 else [1, np.inf, 0]
        if "mean" in values and known[1] < 1e3:
            by_collocation += 1
            if not abs(values["mean"].value / known[1] - 1) < 1e-8:
                wrong.append(f"{seed} collocation {values['mean']!r} {known[1]} {scene}")
    return many, by_collocation, wrong


def test_claims() -> None:
    many, _, wrong = held(range(2, 8), 10, 1)
    assert not wrong
    assert many > 80


@pytest.mark.slow
def test_many_claims() -> None:
    many, by_collocation, wrong = held(range(1000, 1200), 4, 8)
    print(many, by_collocation)
    assert not wrong
    assert many > 5_000
