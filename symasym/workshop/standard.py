"""Standard exit problems, in terms that any program understands, with proved digits.

du = phi dt + kappa sigma dW until u leaves the ends: the mean time T, its variance, the probability
C of the left end, and the principal eigenvalue, at which P(tau > t) decays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import symasym as sa
from symasym.base.estimate import interval_text
from symasym.base.files import versions


class Problem(NamedTuple):
    """phi by pieces, each with its right end, and what else makes a scene."""

    name: str
    phi: tuple[tuple[str, str | None], ...]
    kappa: str
    ends: tuple[str, str]
    start: str = "0"
    sigma: str = "1"
    ito: Literal[0, "stratonovich"] = 0
    reflecting: Literal["left", "right"] | None = None

    @property
    def drift(self) -> sa.Drift:
        """phi and sigma."""
        noise = None if self.sigma == "1" else self.sigma
        return sa.Drift.piecewise(self.phi, noise=noise, ito=self.ito)

    @property
    def numbers(self) -> dict[str, Any]:
        """What the functions take beside kappa."""
        return {"ends": self.ends, "start": self.start, "reflecting": self.reflecting}


_FRICTION = ("12/5", "-1"), ("7/5 - u - 3*(u - u**3)", "1"), ("2/5", None)
_WELLS, _TILTED = (("u - u**3", None),), (("u - u**3 + 1/5", None),)
_HOME, _JUMP, _NOISE = (("-u", None),), (("1 - u/2", "0"), ("-1 - u/2", None)), "1 + u**2/4"

PROBLEMS = (
    Problem("Brownian motion", (("0", None),), "1", ("-1", "1")),
    Problem("constant drift", (("1", None),), "1", ("-1", "1")),
    Problem("geometric Brownian motion", (("u", None),), "1", ("1/2", "2"), "1", "u"),
    Problem("Ornstein-Uhlenbeck", _HOME, "1", ("-2", "2")),
    Problem("dry friction", (("1", "0"), ("-1", None)), "1", ("-2", "2")),
    Problem("a jump towards the middle", _JUMP, "1", ("-2", "1")),
    Problem("double well, to its barrier", _WELLS, "1/2", ("-2", "0"), "-1"),
    Problem("double well, to the other well", _WELLS, "1/2", ("-2", "1"), "-1", reflecting="left"),
    Problem("tilted double well", _TILTED, "1/2", ("-2", "1"), "-1", reflecting="left"),
    Problem("washboard", (("1/4 - sin(u)", None),), "1/2", ("-3", "6")),
    Problem("friction oscillator", _FRICTION, "1/10", ("-10", "10")),
    Problem("state noise, Ito", _HOME, "1", ("-1", "2"), "0", _NOISE),
    Problem("state noise, Stratonovich", _HOME, "1", ("-1", "2"), "0", _NOISE, "stratonovich"),
)


def table(dps: int, step: Callable[[], object]) -> dict[str, Any]:
    """All problems with T, variance, C and rate as decimal strings; `step` is called after each."""
    records = []
    for p in PROBLEMS:
        law = sa.exit_law(p.drift, p.kappa, **p.numbers, dps=dps + 5, full=True)
        found = {"T": law.mean, "variance": law.variance, "rate": law.rate}
        if p.reflecting is None:
            found["C"] = law.left.probability
        record = p._asdict()
        for name, x in found.items():
            mid, rad = interval_text(x.value, x.error, dps, more=True)
            record[name] = {"mid": mid, "rad": rad}
        records.append(record)
        step()
    return {
        "title": "Standard exit problems: mean time T, its variance, C of the left end, rate",
        "equation": "du = phi(u) dt + kappa sigma(u) dW; phi by pieces with their right ends",
        "error": "proved: each true value lies within rad of mid",
        "dps": dps,
        "versions": versions("mpmath", "python-flint"),
        "problems": records,
    }
