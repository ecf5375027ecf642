"""The one table of scenes: what verification, reports, tests and docs take their problems from.

A scene is a drift with noise, radius and start, given exactly; what is known of it in closed form
stands with it. Its tags are what cannot be read off the numbers:

- sliding: a- > 0 > a+, so that a stationary state exists
- quadrature: smooth enough for plain quadrature
- analytic: no polynomial of low degree, so that the general engines work
- fold: on or beside the coalescence of a well and a barrier
- start at the edge: close to where the process is absorbed
- narrow: a feature much narrower than the layer
- slow: takes seconds
- extreme: a number at an end of the range
- may refuse: right digits or a `SymasymError`
- refused: a known limit, at which a `SymasymError` is the right outcome
"""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from mpmath import mp

import symasym as sa
from symasym.drift.scenes import QUANTITIES
from symasym.quantities import call_named
from symasym.workshop import reference_quadrature

if TYPE_CHECKING:
    from symasym.base.inputs import Number

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
        """By Wald's identity for the martingale u - a t, or u^2 - kappa^2 t."""
        if not slope:
            return (r * r - x * x) / kappa**2
        return (r - 2 * r * leaves(slope, kappa, r, x) - x) / mp.convert(slope)

    return {
        "T": time,
        "C": lambda kappa, r, x: leaves(slope, kappa, r, x),
        "1 - C": lambda kappa, r, x: leaves(-slope, kappa, r, -x),
    }


def _masses(kappa: Any) -> tuple[Any, Any]:
    """For A = -u, a parabola between lines: e^{-lam V} over the layer and over the tails."""
    return mp.sqrt(mp.pi) * kappa * mp.erf(1 / kappa), kappa**2 * mp.exp(-1 / kappa**2)


def _density(y: Fraction) -> ClosedForm:
    """For A = -u, the stationary density at `y`."""
    rise = y * y if abs(y) <= 1 else 2 * abs(y) - 1
    return lambda kappa, r, x: mp.exp(-mp.convert(rise) / kappa**2) / sum(_masses(kappa))


#: An odd drift, from 0.
HALF: dict[str, ClosedForm] = {name: lambda kappa, r, x: mp.mpf(1) / 2 for name in ("C", "1 - C")}
#: A = -u, from 0.
LINEAR = HALF | {
    "P": lambda kappa, r, x: _masses(kappa)[0] / sum(_masses(kappa)),
    "1 - P": lambda kappa, r, x: _masses(kappa)[1] / sum(_masses(kappa)),
    "p(3/10)": _density(Fraction(3, 10)),
    "p(-5/2)": _density(Fraction(-5, 2)),
}


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene; `make` gives its drift, and `closed` what is known of a quantity."""

    name: str
    make: Callable[[], sa.Drift]
    kappa: str
    r: str
    start: str = "0"
    tags: Set[str] = frozenset()
    closed: dict[str, ClosedForm] = field(default_factory=dict)

    @property
    def slides(self) -> bool:
        """True where a stationary state exists."""
        return "sliding" in self.tags

    @property
    def quantities(self) -> list[str]:
        """Those that exist here."""
        return [name for name, known in QUANTITIES.items() if self.slides or not known.sliding]

    def ask(self, quantity: str, **options: Any) -> Any:
        """The public function's answer."""
        numbers = {"kappa": self.kappa, "r": self.r, "start": self.start}
        return call_named(quantity, self.make(), numbers, **options)

    def by_quadrature(self, quantity: str, dps: int) -> Any:
        """T, C, P or 1 - P by plain quadrature of the printed integrals."""
        drift, kappa = self.make(), Fraction(self.kappa)
        if "P" in quantity:
            return reference_quadrature.occupation(drift, kappa, dps, quantity == "1 - P")
        verb = getattr(reference_quadrature, QUANTITIES[quantity].verb)
        return verb(drift, kappa, Fraction(self.r), Fraction(self.start), dps)

    def known(self, quantity: str, dps: int) -> Any:
        """The closed form, right to `dps` digits."""
        with mp.workdps(2 * dps + 250):  # what the closed forms cancel
            numbers = (mp.convert(Fraction(x)) for x in (self.kappa, self.r, self.start))
            return self.closed[quantity](*numbers)

    def __str__(self) -> str:
        return self.name


# -- the table -------------------------------------------------------------------------------------

FOLD = Fraction(-7, 9)  # z0 of friction(3, 1)


def _friction(mu: Number = 3, alpha: Number = 1, z0: Number = "-0.3") -> Callable[[], sa.Drift]:
    """The drift of the friction oscillator."""
    return lambda: sa.friction(mu, alpha, z0)


def _fold(gap: str) -> Callable[[], sa.Drift]:
    """The friction oscillator at a distance of z0 from its fold."""
    return _friction(z0=FOLD + Fraction(gap))


PROBLEMS = [
    # friction: the paper's own
    Problem("friction", _friction(), "0.1", "10"),
    Problem("friction k=0.3", _friction(), "0.3", "10", "0", {"quadrature"}),
    Problem("friction k=1", _friction(), "1", "10", "0", {"quadrature"}),
    Problem("friction k=10", _friction(), "10", "10"),
    Problem("friction k=1e-4", _friction(), "1e-4", "10"),
    Problem("friction r=3", _friction(), "0.5", "3", "-7/10", {"quadrature"}),
    Problem("friction past the fold", _friction(z0="-1"), "0.3", "10", "0", {"quadrature"}),
    Problem("friction mu=1/2", _friction(mu="1/2", z0="-0.2"), "0.1", "10"),
    Problem("friction mu=0", _friction(mu=0, z0="-0.2"), "0.7", "2", "-0.9", {"quadrature"}),
    Problem("friction sliding", _friction(z0="0.5"), "1", "4", "-2", {"sliding", "quadrature"}),
    Problem("friction sliding weak", _friction(z0="0.5"), "0.05", "4", "0", {"sliding"}),
    Problem("friction down", _friction(z0="3"), "0.5", "5", "0.4", {"quadrature"}),
    Problem("friction down, a well", _friction(z0="2.3"), "0.15", "10", "-2/3"),
    Problem("friction from its well", _friction(), "0.05", "10", "0.35"),
    Problem("friction from its barrier", _friction(), "0.02", "10", "0.97"),
    # fold and kink
    Problem("on the fold", _fold("0"), "0.1", "10", "0", {"fold"}),
    Problem("fold + 1e-15", _fold("1e-15"), "0.1", "10", "0", {"fold"}),
    Problem("fold - 1e-15", _fold("-1e-15"), "0.01", "10", "1/2", {"fold"}),
    Problem("fold + 1e-30", _fold("1e-30"), "1e-8", "10", "0", {"fold", "extreme"}),
    Problem("fold - 1e-30", _fold("-1e-30"), "1e-8", "10", "0", {"fold", "extreme"}),
    Problem("on the kink", _friction(z0=0), "0.1", "10"),
    Problem("kink - 1e-15", _friction(z0="-1e-15"), "0.1", "10"),
    Problem("kink + 1e-15", _friction(z0="1e-15"), "0.1", "10", "0", {"sliding"}),
    Problem("kink - 1e-30", _friction(z0="-1e-30"), "0.01", "1e6", "0", {"extreme"}),
    Problem("kink + 1e-30, stiff", _friction(z0="1e-30"),
            "1e-6", "1000", "0", {"sliding", "extreme"}),
    # the ends of the ranges
    Problem("k=1e-8", _friction(), "1e-8", "10", "0", {"extreme"}),
    Problem("k=1e-8, sliding", _friction(z0="0.5"), "1e-8", "10", "-0.99", {"sliding", "extreme"}),
    Problem("k=1e8", _friction(), "1e8", "10", "0", {"extreme"}),
    Problem("k=1e8, sliding", lambda: sa.linear(1, -1),
            "1e8", "1e12", "0", {"sliding", "extreme"}, LINEAR),
    Problem("r=1e12", _friction(), "0.1", "1e12", "0", {"extreme"}),
    Problem("r=1e12, sliding", _friction(z0="0.5"), "1", "1e12", "-1e11", {"sliding", "extreme"}),
    Problem("mu=1e8", _friction(mu="1e8"), "0.1", "10", "0", {"extreme"}),
    Problem("mu=1e8, strong", _friction(mu="1e8"), "1e4", "10", "-0.2", {"extreme"}),
    Problem("mu=1/2 + 1e-15", _friction(mu=Fraction(1, 2) + Fraction("1e-15"), z0="-1e-16"),
            "0.01", "10", "0", {"extreme"}),
    Problem("mu=1/2 - 1e-15", _friction(mu=Fraction(1, 2) - Fraction("1e-15"), z0=0),
            "0.01", "10", "0", {"extreme"}),
    Problem("alpha=1e-8", _friction(alpha="1e-8"), "0.1", "10", "0", {"extreme"}),
    Problem("alpha=1e8", _friction(alpha="1e8"), "0.1", "10", "0", {"sliding", "extreme"}),
    Problem("alpha=1e8, k=1e-8", _friction(alpha="1e8"),
            "1e-8", "1e12", "0.9", {"sliding", "extreme"}),
    Problem("z0=-1e8", _friction(z0="-1e8"), "1e-8", "1e6", "0", {"extreme"}),
    Problem("z0=-1e8, strong", _friction(z0="-1e8"), "1e8", "1e6", "0", {"extreme"}),
    # lam Delta V is about 2e6 inside the layer
    Problem("sliding 1e6", lambda: sa.linear(1, -1), "0.0007", "3", "0.4", {"sliding", "extreme"}),
    Problem("friction sliding 1e6", _friction(z0=1),
            "0.001", "3", "0", {"sliding", "extreme"}, HALF),
    # constant drift
    Problem("constant", lambda: sa.polynomial("3/2"),
            "1", "5", "-2", {"quadrature"}, constant_drift("3/2")),
    Problem("constant down", lambda: sa.linear(-1, -1),
            "1", "3", "1/3", {"quadrature"}, constant_drift("-1")),
    Problem("C = 1e-(10^9)", lambda: sa.linear("23.02585", "23.02585"),
            "1e-4", "0.5", "0", {"extreme"}, constant_drift("23.02585")),
    Problem("no drift", lambda: sa.polynomial(0), "7", "5", "-3", frozenset(), constant_drift("0")),
    Problem("hardly any drift", lambda: sa.polynomial("1e-12"),
            "1", "5/4", "9/8", {"quadrature"}, constant_drift("1e-12")),
    # linear
    Problem("linear sliding", lambda: sa.linear(1, -1),
            "0.5", "2", "0", {"sliding", "quadrature"}, LINEAR),
    Problem("linear sliding, uneven", lambda: sa.linear("0.2", -3), "0.2", "6", "0.9", {"sliding"}),
    Problem("linear repelling", lambda: sa.linear(-1, 2), "2/3", "3", "5/3", {"quadrature"}),
    Problem("linear repelling, stiff", lambda: sa.linear(-1, 2), "1e-5", "3", "-1/3"),
    Problem("linear r=1/2", lambda: sa.linear(2, -1),
            "0.4", "0.5", "-1/4", {"sliding", "quadrature"}),
    Problem("linear r=1e-3", lambda: sa.linear(2, -1), "0.4", "1e-3", "0", {"sliding"}),
    Problem("r=1", lambda: sa.linear(2, 1), "0.4", "1", "1/2", {"quadrature"}),
    Problem("start at -1", lambda: sa.linear(-1, 1), "1", "2", "-1", {"quadrature"}),
    Problem("start by the edge", lambda: sa.linear(1, -1),
            "0.1", "10", "9.999999", {"sliding", "start at the edge"}),
    Problem("start by the inner edge", _friction(),
            "0.1", "0.9", "-0.8999999999", {"start at the edge"}),
    # several wells, other shapes
    Problem("sine", lambda: sa.sine(1, 1, 4, waves=2),
            "1", "2", "-3/2", {"quadrature", "analytic"}),
    Problem("sine sliding", lambda: sa.sine(1, "-1/2", 5, waves=2),
            "0.7", "4", "1/4", {"sliding", "analytic"}),
    Problem("sine weak", lambda: sa.sine(-1, 2, 3, waves=2), "0.15", "2", "1/7", {"analytic"}),
    Problem("tanh", lambda: sa.tanh(1, -1, 5),
            "1/2", "2", "1/5", {"sliding", "quadrature", "analytic"}),
    Problem("tanh stiff", lambda: sa.tanh(1, "-1/2", 5),
            "1e-5", "2", "1/5", {"sliding", "analytic", "slow"}),
    Problem("tanh stiff, crossing", lambda: sa.tanh(-1, "-1/2", 5),
            "1e-5", "2", "1/5", {"analytic"}),
    Problem("tanh steep", lambda: sa.tanh(1, -1, 60),
            "0.5", "3", "-1/2", {"sliding", "analytic", "narrow"}),
    Problem("tanh very steep", lambda: sa.tanh(1, -1, 1000),
            "0.3", "4", "0", {"sliding", "analytic", "narrow", "may refuse"}, HALF),
    Problem("hill", lambda: sa.hill(-1, "1/2", "1/2", n=4),
            "1", "2", "1", {"quadrature", "analytic"}),
    Problem("hill n=1", lambda: sa.hill("1/3", 2, "1/5", n=1), "0.1", "2", "-1/4", {"analytic"}),
    Problem("hill n=12", lambda: sa.hill(1, -2, "1/3", n=12),
            "0.3", "2", "1/4", {"sliding", "analytic"}),
    Problem("quintic", lambda: sa.polynomial("1/10", 2, 0, "-25/2", 0, 9),
            "0.6", "3", "1/3", {"sliding", "quadrature"}),
    Problem("degree 12",
            lambda: sa.polynomial(*[Fraction((-1) ** (k + 1), k + 1) for k in range(13)]),
            "0.1", "2", "-1/2"),
    Problem("degree 20",
            lambda: sa.polynomial(*[Fraction((-1) ** (k + 1), k + 1) for k in range(21)]),
            "0.3", "2", "-1/2", {"analytic"}),
    # the user's own
    Problem("expression, cubic", lambda: sa.Drift("1/2 - 2*u + b*u**3").bind(b="9/5"),
            "0.4", "2", "1/4", {"quadrature"}),
    Problem("expression", lambda: sa.Drift("exp(-u)*cos(2*u + a) - u/3").bind(a="1/2"),
            "0.6", "2", "1/4", {"sliding", "quadrature", "analytic"}),
    Problem("expression, a tall peak", lambda: sa.Drift("1/2 - u + 3*exp(-1000*u**2)"),
            "0.5", "3", "-1/2", {"sliding", "analytic", "narrow", "slow", "may refuse"}),
    # 1e-3 wide; T is 3.3726, 0.13 less than without the spike
    Problem("expression, a spike", lambda: sa.Drift("1 + 1000*exp(-1000000*(u - 1/3)**2)"),
            "0.5", "3", "-1/2", {"analytic", "narrow", "may refuse"}),
    Problem("expression, poles near", lambda: sa.Drift("1 + 1/(1 + 400*(u - 3/10)**2)"),
            "1", "4", "0", {"analytic", "may refuse"}),
    # limits
    # A is real on [-1, 1] but not analytic at -1
    Problem("branch point at -1", lambda: sa.Drift("1 + sqrt(1 + u)"),
            "1", "4", "0", {"analytic", "refused"}),
    # A is real on [-1, 1] but not analytic at 1/3
    Problem("a corner", lambda: sa.Drift("1 + sqrt((u - 1/3)**2)"),
            "1", "4", "0", {"analytic", "refused"}),
]  # fmt: skip

BY_NAME = {problem.name: problem for problem in PROBLEMS}


def tagged(tag: str) -> list[Problem]:
    """Scenes with this tag."""
    return [p for p in PROBLEMS if tag in p.tags]
