"""Random numbers and texts: how many a test takes, and formulas."""

from __future__ import annotations

import random
from collections.abc import Sequence

from hypothesis import HealthCheck, settings

from symasym.drift.texts import FUNCTIONS

SAMPLE = settings(
    max_examples=24,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def random_formula(draw: random.Random, depth: int, names: Sequence[str] = ("u", "a")) -> str:
    """A text that is mostly a formula, with numbers of any size."""
    if depth == 0 or draw.random() < 0.2:
        numbers = ["2", "1/3", "10", "1e30", "1e-9", "123456789", "pi", "0.5"]
        return draw.choice([*names, *numbers])
    parts = [random_formula(draw, depth - 1, names) for _ in range(2)]
    kind = draw.randrange(6)
    if kind == 5:
        return f"{draw.choice(list(FUNCTIONS))}({parts[0]})"
    return f"({parts[0]}){draw.choice(['+', '-', '*', '/', '**'])}({parts[1]})"
