"""The table of scenes from which verification, reports, tests and docs take their problems.

`problems.csv` has a drift (of `symasym`, with its numbers, or an expression), noise, radius and
start, all exact, and tags for properties that are not obvious from the numbers:

- sliding: a- > 0 > a+, so that a stationary state exists
- quadrature: smooth enough for plain quadrature
- analytic: no polynomial of low degree, so that the general engines work
- odd: A is odd and the start 0, so that C = 1/2
- fold: on or beside the coalescence of a well and a barrier
- start at the edge: close to where the process is absorbed
- narrow: a feature much narrower than the layer
- slow: takes seconds
- extreme: a number at an end of the range
- may refuse: right digits or a `SymasymError`
- refused: a known limit, at which a `SymasymError` is the right outcome
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from mpmath import mp

import symasym as sa
from symasym.drift.scenes import QUANTITIES, Request
from symasym.methods import ask
from symasym.workshop import reference_quadrature

#: A function of kappa, r and the start, in mpmath's precision.
ClosedForm = Callable[[Any, Any, Any], Any]


def constant_drift(a: str) -> dict[str, ClosedForm]:
    """T and C of the drift `a` everywhere by elementary integration, from any start."""
    slope = Fraction(a)

    def leaves(slope: Fraction, kappa: Any, r: Any, x: Any) -> Any:
        """The probability of leaving through -r, by the scale function e^{-qu}."""
        q = 2 * mp.convert(slope) / kappa**2
        if not q:
            return (r - x) / (2 * r)
        return (mp.exp(-q * x) - mp.exp(-q * r)) / (mp.exp(q * r) - mp.exp(-q * r))

    def time(kappa: Any, r: Any, x: Any) -> Any:
        """The mean time by Wald's identity for the martingale u - a t, or u^2 - kappa^2 t."""
        if not slope:
            return (r * r - x * x) / kappa**2
        return (r - 2 * r * leaves(slope, kappa, r, x) - x) / mp.convert(slope)

    return {
        "T": time,
        "C": lambda kappa, r, x: leaves(slope, kappa, r, x),
        "1 - C": lambda kappa, r, x: leaves(-slope, kappa, r, -x),
    }


def _masses(kappa: Any) -> tuple[Any, Any]:
    """The integrals of e^{-lam V} over the layer and over the tails for A = -u."""
    return mp.sqrt(mp.pi) * kappa * mp.erf(1 / kappa), kappa**2 * mp.exp(-1 / kappa**2)


def _density(rise: str) -> ClosedForm:
    """The stationary density for A = -u where V exceeds V(0) by `rise`."""
    return lambda kappa, r, x: mp.exp(-2 * mp.convert(rise) / kappa**2) / sum(_masses(kappa))


#: For an odd drift and the start 0.
HALF: dict[str, ClosedForm] = {name: lambda kappa, r, x: mp.mpf(1) / 2 for name in ("C", "1 - C")}
#: For A = -u and the start 0.
LINEAR = HALF | {
    "P": lambda kappa, r, x: _masses(kappa)[0] / sum(_masses(kappa)),
    "1 - P": lambda kappa, r, x: _masses(kappa)[1] / sum(_masses(kappa)),
    "p(3/10)": _density("9/200"),
    "p(-5/2)": _density("2"),
}


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene; `closed` has the quantities that are known in closed form."""

    name: str
    drift: str
    kappa: str
    r: str
    start: str
    tags: frozenset[str]

    def make(self) -> sa.Drift:
        """The drift."""
        kind, *given = self.drift.split()
        if kind == "Drift":
            return sa.Drift(" ".join(given))
        numbers = [x for x in given if "=" not in x]
        named = {name: int(x) for name, _, x in (y.partition("=") for y in given) if x}
        made: sa.Drift = getattr(sa, kind)(*numbers, **named)
        return made

    @property
    def closed(self) -> dict[str, ClosedForm]:
        """The closed forms by quantity."""
        kind, *given = self.drift.split()
        if kind in ("polynomial", "linear") and len(set(given)) == 1:
            return constant_drift(given[0])
        if "odd" in self.tags:
            return LINEAR if self.drift == "linear 1 -1" else HALF
        return {}

    @property
    def slides(self) -> bool:
        """True if a stationary state exists."""
        return "sliding" in self.tags

    @property
    def quantities(self) -> list[str]:
        """The quantities that exist for this scene."""
        return [name for name in QUANTITIES if self.slides or "P" not in name]

    def ask(self, quantity: str, **options: Any) -> Any:
        """The public function's answer."""
        numbers = {"kappa": self.kappa, "r": self.r, "start": self.start}
        taken = {name: numbers[name] for name in QUANTITIES[quantity]}
        return ask(self.make(), taken, Request(quantity, **options))

    def by_quadrature(self, quantity: str, dps: int) -> Any:
        """T, C, P or 1 - P by plain quadrature of the printed integrals."""
        drift, kappa = self.make(), Fraction(self.kappa)
        if "P" in quantity:
            return reference_quadrature.occupation(drift, kappa, dps, quantity == "1 - P")
        verb = "escape_time" if quantity == "T" else "exit_probability"
        scene = drift, kappa, Fraction(self.r), Fraction(self.start), dps
        return getattr(reference_quadrature, verb)(*scene)

    def known(self, quantity: str, dps: int) -> Any:
        """The closed form, right to `dps` digits."""
        with mp.workdps(2 * dps + 250):  # digits lost to cancellation
            numbers = (mp.convert(Fraction(x)) for x in (self.kappa, self.r, self.start))
            return self.closed[quantity](*numbers)

    def __str__(self) -> str:
        return self.name


with Path(__file__).with_suffix(".csv").open(newline="") as _file:
    PROBLEMS = [
        Problem(name, drift, kappa, r, start, frozenset(filter(None, tags.split("; "))))
        for name, drift, kappa, r, start, tags in [*csv.reader(_file)][1:]
    ]
BY_NAME = {problem.name: problem for problem in PROBLEMS}
FOLD = Fraction(-7, 9)  # z0 of friction(3, 1)


def tagged(tag: str) -> list[Problem]:
    """The scenes with this tag."""
    return [p for p in PROBLEMS if tag in p.tags]
