"""The one table of scenes: what verification, reports, tests and docs take their problems from.

A scene is a drift with noise, radius and start, given exactly. Its tags say what it
is an example of (`TAGS` explains them). What is known in closed form stands with it.

A scene tagged "refused" is a known limit: the right outcome is a `SymasymError`, for the reason in
`note`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import mpmath

import symasym as sa
from symasym.quantities import call_named

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

    from symasym.base.inputs import Number


ClosedForm = Callable[[Any, Any, Any, Any], Any]
HALF: dict[str, ClosedForm] = {
    name: lambda mp, *_: mp.mpf(1) / 2 for name in ("C", "1-C")
}  # an odd drift, from 0


def mpf_of(x: Fraction, context: MPContext) -> Any:
    """The rational `x` in mpmath's `context`."""
    return context.mpf(x.numerator) / x.denominator


def constant_drift(a: str) -> dict[str, ClosedForm]:
    """T and C of the drift `a` everywhere by elementary integration, from any start."""

    def number(mp: MPContext) -> Any:
        """The drift a."""
        return mpf_of(Fraction(a), mp)

    def below(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """C, the probability of leaving through -r."""
        rate = 2 * number(mp) / kappa**2
        if rate == 0:
            return (r - x) / (2 * r)
        # both differences of exponentials over the larger one
        return mp.exp(-rate * (r + x)) * mp.expm1(rate * (x - r)) / mp.expm1(-2 * rate * r)

    def above(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """1 - C."""
        rate = 2 * number(mp) / kappa**2
        return mp.expm1(-rate * (r + x)) / mp.expm1(-2 * rate * r) if rate else (r + x) / (2 * r)

    def time(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """T, by Wald's identity for the martingale u - a t."""
        if not number(mp):
            return (r * r - x * x) / kappa**2
        if x == 0:
            return r / number(mp) * mp.tanh(number(mp) * r / kappa**2)
        return (r - 2 * r * below(mp, kappa, r, x) - x) / number(mp)

    return {"T": time, "C": below, "1-C": above}


def linear_sliding(slope: str) -> dict[str, ClosedForm]:
    """P, 1 - P and the density of A = -slope u, whose potential is a parabola between lines."""

    def parts(mp: MPContext, kappa: mpf) -> tuple[Any, Any, Any]:
        """The integrals of e^(-lam V) over the layer and the tails, and q = slope/kappa^2."""
        a = mpf_of(Fraction(slope), mp)
        q = a / kappa**2  # lam V = q u^2 up to a constant
        inside = mp.sqrt(mp.pi / q) * mp.erf(mp.sqrt(q))
        return inside, mp.exp(-q) / q, q

    def inside(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """P, the share of the layer."""
        layer, tails, _ = parts(mp, kappa)
        return layer / (layer + tails)

    def outside(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """1 - P, the share of the tails."""
        layer, tails, _ = parts(mp, kappa)
        return tails / (layer + tails)

    def density(at: str) -> ClosedForm:
        """The stationary density at a point."""

        def value(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
            """e^{-lam V} at the point over its integral."""
            layer, tails, q = parts(mp, kappa)
            y = abs(mpf_of(Fraction(at), mp))
            rise = y * y if y <= 1 else 1 + 2 * (y - 1)
            return mp.exp(-q * rise) / (layer + tails)

        return value

    return HALF | {
        "P": inside,
        "1-P": outside,
        "p(3/10)": density("3/10"),
        "p(-5/2)": density("-5/2"),
    }


TAGS = {
    # the drift
    "friction": "the friction oscillator's cubic",
    "linear": "the linear smoothing",
    "polynomial": "coefficients given",
    "sine": "linear plus a sine",
    "tanh": "a sigmoid",
    "hill": "a Hill switch",
    "expression": "the user's own SymPy expression",
    "analytic": "no polynomial of low degree, so that the general engines work",
    "constant": "everything is elementary",
    # the region
    "up": "crossing with a-, a+ > 0",
    "down": "crossing with a-, a+ < 0",
    "sliding": "a- > 0 > a+",
    "repelling": "a- < 0 < a+",
    "tangency": "a- or a+ is 0",
    # the landscape
    "well": "a well and a barrier inside",
    "several wells": "more than one well inside",
    "fold": "on or beside the coalescence of a well and a barrier",
    "kink": "a barrier or well on or beside u = 1 (z0 near 1 - alpha)",
    "narrow": "a feature much narrower than the layer",
    # start and radius
    "start": "off 0, inside [-1, 1]",
    "start outside": "beyond the layer",
    "start at the edge": "close to where the process is absorbed",
    "small r": "r < 1",
    "large r": "r of 1e6 and more",
    # noise
    "weak": "lam Delta V of tens to thousands",
    "moderate": "kappa of 0.2 to 2",
    "strong": "kappa above 2",
    "stiff": "kappa below 1e-3",
    "extreme": "a number at an end of the range",
    # what may be asked
    "quadrature": "smooth enough for plain quadrature",
    "slow": "takes seconds",
    "may refuse": "right digits or a SymasymError",
    "refused": "a SymasymError is the known outcome",
}


def question(
    quantity: str, drift: sa.Drift, kappa: Any, r: Any = None, start: Any = 0
) -> Callable[..., Any]:
    """A quantity of a scene, such as "1-C", as a function of the verb's options."""
    numbers = {"kappa": kappa, "r": r, "start": start}
    return partial(call_named, quantity.replace("-", " - "), drift, numbers)


@dataclass(frozen=True)
class Problem:
    """A scene.

    Attributes
    ----------
    name : str
    make : callable
        Gives the drift; a factory, so that the table is cheap to import.
    kappa, r, start : str
        Exact.
    tags : frozenset of str
    closed : dict
        Quantity (see `questions`) -> function of an mpmath context and kappa, r, start in it.
    note : str
        Why the scene is here, or why it is refused.
    """

    name: str
    make: Callable[[], sa.Drift]
    kappa: str
    r: str
    start: str
    tags: frozenset[str]
    closed: dict[str, ClosedForm] = field(default_factory=dict)
    note: str = ""

    @property
    def region(self) -> str:
        """The paper's name of the region, or "tangency"."""
        names = {"up": "crossing", "down": "crossing", "repelling": "repelling sliding"}
        tag = next(t for t in ("up", "down", "sliding", "repelling", "tangency") if t in self.tags)
        return names.get(tag, tag)

    @property
    def slides(self) -> bool:
        """True where a stationary state exists."""
        return "sliding" in self.tags

    def questions(self) -> dict[str, Callable[..., Any]]:
        """Every quantity that exists here, as a function of the options dps, log and full."""
        drift, names = self.make(), ("T", "C", "1-C", *(("P", "1-P") if self.slides else ()))
        of = {name: question(name, drift, self.kappa, self.r, self.start) for name in names}
        if self.slides:
            for y in ("3/10", "-5/2"):
                of[f"p({y})"] = partial(sa.stationary_density, drift, self.kappa, y)
        return of

    def by_quadrature(self) -> dict[str, Callable[[int], Any]]:
        """The same by plain quadrature of the printed integrals, as functions of dps."""
        from symasym.workshop import reference_quadrature as engine

        drift = self.make()
        kappa, r, start = (Fraction(x) for x in (self.kappa, self.r, self.start))
        asked: dict[str, Callable[[int], Any]] = {
            "T": lambda n: engine.escape_time(drift, kappa, r, start, n),
            "C": lambda n: engine.exit_probability(drift, kappa, r, start, n),
        }
        if self.slides:
            asked["P"] = lambda n: engine.occupation(drift, kappa, n)
            asked["1-P"] = lambda n: engine.occupation(drift, kappa, n, complement=True)
            for y in ("3/10", "-5/2"):
                asked[f"p({y})"] = partial(engine.stationary_density, drift, kappa, Fraction(y))
        return asked

    def known(self, quantity: str, dps: int) -> Any:
        """The closed form as an mpf, right to `dps` digits."""
        context = mpmath.MPContext()
        context.dps = 2 * dps + 250  # what the closed forms cancel
        scene = (Fraction(x) for x in (self.kappa, self.r, self.start))
        numbers = (mpf_of(x, context) for x in scene)
        return mpmath.mp.make_mpf(self.closed[quantity](context, *numbers)._mpf_)

    def __str__(self) -> str:
        return self.name


# -- the table -------------------------------------------------------------------------------

FOLD = Fraction(-7, 9)  # z0 of friction(3, 1)


def _scene(
    name: str,
    tags: str,
    make: Callable[[], sa.Drift],
    kappa: str,
    r: str,
    start: str = "0",
    *,
    closed: dict[str, ClosedForm] | None = None,
    note: str = "",
) -> Problem:
    """A problem, its tags as one text."""
    own = frozenset(tag.strip() for tag in tags.split(","))
    return Problem(name, make, kappa, r, start, own, closed or {}, note)


def _friction(mu: Number = 3, alpha: Number = 1, z0: Number = "-0.3") -> Callable[[], sa.Drift]:
    """The drift of the friction oscillator."""
    return lambda: sa.friction(mu, alpha, z0)


def _fold(gap: str) -> Callable[[], sa.Drift]:
    """The friction oscillator at a distance of z0 from its fold."""
    return _friction(z0=FOLD + Fraction(gap))


PROBLEMS: list[Problem] = [
    # friction: the paper's own
    _scene("friction", "friction, up, well, weak", _friction(), "0.1", "10"),
    _scene("friction k=0.3", "friction, up, well, moderate, quadrature", _friction(), "0.3", "10"),
    _scene("friction k=1", "friction, up, well, moderate, quadrature", _friction(), "1", "10"),
    _scene("friction k=10", "friction, up, well, strong", _friction(), "10", "10"),
    _scene("friction k=1e-4", "friction, up, well, stiff", _friction(), "1e-4", "10"),
    _scene("friction r=3", "friction, up, well, moderate, quadrature, start", _friction(),
           "0.5", "3", "-7/10"),
    _scene("friction past the fold", "friction, up, moderate, quadrature", _friction(z0="-1"),
           "0.3", "10"),
    _scene("friction mu=1/2", "friction, up, weak", _friction(mu="1/2", z0="-0.2"), "0.1", "10"),
    _scene("friction mu=0", "friction, up, moderate, quadrature, start", _friction(mu=0, z0="-0.2"),
           "0.7", "2", "-0.9"),
    _scene("friction sliding", "friction, sliding, moderate, quadrature, start outside",
           _friction(z0="0.5"), "1", "4", "-2"),
    _scene("friction sliding weak", "friction, sliding, weak", _friction(z0="0.5"), "0.05", "4"),
    _scene("friction down", "friction, down, moderate, quadrature, start", _friction(z0="3"),
           "0.5", "5", "0.4"),
    _scene("friction down, a well", "friction, down, well, weak, start", _friction(z0="2.3"),
           "0.15", "10", "-2/3"),
    _scene("friction from its well", "friction, up, well, weak, start", _friction(),
           "0.05", "10", "0.35"),
    _scene("friction from its barrier", "friction, up, well, weak, start", _friction(),
           "0.02", "10", "0.97"),
    # fold and kink
    _scene("on the fold", "friction, up, fold, weak", _fold("0"), "0.1", "10"),
    _scene("fold + 1e-15", "friction, up, fold, well, weak", _fold("1e-15"), "0.1", "10"),
    _scene("fold - 1e-15", "friction, up, fold, weak, start", _fold("-1e-15"), "0.01", "10", "1/2"),
    _scene("fold + 1e-30", "friction, up, fold, well, stiff, extreme", _fold("1e-30"),
           "1e-8", "10"),
    _scene("fold - 1e-30", "friction, up, fold, stiff, extreme", _fold("-1e-30"), "1e-8", "10"),
    _scene("on the kink", "friction, tangency, kink, well, weak", _friction(z0=0), "0.1", "10"),
    _scene("kink - 1e-15", "friction, up, kink, well, weak", _friction(z0="-1e-15"), "0.1", "10"),
    _scene("kink + 1e-15", "friction, sliding, kink, weak", _friction(z0="1e-15"), "0.1", "10"),
    _scene("kink - 1e-30", "friction, up, kink, well, weak, extreme", _friction(z0="-1e-30"),
           "0.01", "1e6"),
    _scene("kink + 1e-30, stiff", "friction, sliding, kink, stiff, extreme",
           _friction(z0="1e-30"), "1e-6", "1000"),
    # the ends of the ranges
    _scene("k=1e-8", "friction, up, well, stiff, extreme", _friction(), "1e-8", "10"),
    _scene("k=1e-8, sliding", "friction, sliding, stiff, extreme, start",
           _friction(z0="0.5"), "1e-8", "10", "-0.99"),
    _scene("k=1e8", "friction, up, well, strong, extreme", _friction(), "1e8", "10"),
    _scene("k=1e8, sliding", "linear, sliding, strong, extreme, large r",
           lambda: sa.linear(1, -1), "1e8", "1e12", closed=linear_sliding("1")),
    _scene("r=1e12", "friction, up, well, weak, extreme, large r", _friction(), "0.1", "1e12"),
    _scene("r=1e12, sliding", "friction, sliding, moderate, extreme, large r, start outside",
           _friction(z0="0.5"), "1", "1e12", "-1e11"),
    _scene("mu=1e8", "friction, up, well, weak, extreme", _friction(mu="1e8"), "0.1", "10"),
    _scene("mu=1e8, strong", "friction, up, well, strong, extreme", _friction(mu="1e8"),
           "1e4", "10", "-0.2"),
    _scene("mu=1/2 + 1e-15", "friction, up, kink, weak, extreme",
           _friction(mu=Fraction(1, 2) + Fraction("1e-15"), z0="-1e-16"), "0.01", "10"),
    _scene("mu=1/2 - 1e-15", "friction, tangency, kink, weak, extreme",
           _friction(mu=Fraction(1, 2) - Fraction("1e-15"), z0=0), "0.01", "10"),
    _scene("alpha=1e-8", "friction, up, weak, extreme", _friction(alpha="1e-8"), "0.1", "10"),
    _scene("alpha=1e8", "friction, sliding, weak, extreme", _friction(alpha="1e8"), "0.1", "10"),
    _scene("alpha=1e8, k=1e-8", "friction, sliding, stiff, extreme, start, large r",
           _friction(alpha="1e8"), "1e-8", "1e12", "0.9"),
    _scene("z0=-1e8", "friction, up, stiff, extreme", _friction(z0="-1e8"), "1e-8", "1e6"),
    _scene("z0=-1e8, strong", "friction, up, strong, extreme", _friction(z0="-1e8"), "1e8", "1e6"),
    _scene("sliding 1e6", "linear, sliding, stiff, extreme, start", lambda: sa.linear(1, -1),
           "0.0007", "3", "0.4", note="lam Delta V is about 2e6 inside the layer"),
    _scene("friction sliding 1e6", "friction, sliding, weak, extreme", _friction(z0=1),
           "0.001", "3", closed=HALF),
    # constant drift
    _scene("constant", "constant, polynomial, up, moderate, quadrature, start outside",
           lambda: sa.polynomial("3/2"), "1", "5", "-2", closed=constant_drift("3/2")),
    _scene("constant down", "constant, linear, down, moderate, quadrature, start",
           lambda: sa.linear(-1, -1), "1", "3", "1/3", closed=constant_drift("-1")),
    _scene("C = 1e-(10^9)", "constant, linear, up, small r, stiff, extreme",
           lambda: sa.linear("23.02585", "23.02585"), "1e-4", "0.5",
           closed=constant_drift("23.02585")),
    _scene("no drift", "constant, polynomial, tangency, strong, start outside",
           lambda: sa.polynomial(0), "7", "5", "-3", closed=constant_drift("0")),
    _scene("hardly any drift", "constant, polynomial, up, moderate, quadrature, start outside",
           lambda: sa.polynomial("1e-12"), "1", "5/4", "9/8", closed=constant_drift("1e-12")),
    # linear
    _scene("linear sliding", "linear, sliding, moderate, quadrature", lambda: sa.linear(1, -1),
           "0.5", "2", closed=linear_sliding("1")),
    _scene("linear sliding, uneven", "linear, sliding, weak, start", lambda: sa.linear("0.2", -3),
           "0.2", "6", "0.9"),
    _scene("linear repelling", "linear, repelling, moderate, quadrature, start outside",
           lambda: sa.linear(-1, 2), "2/3", "3", "5/3"),
    _scene("linear repelling, stiff", "linear, repelling, stiff, start",
           lambda: sa.linear(-1, 2), "1e-5", "3", "-1/3"),
    _scene("linear r=1/2", "linear, sliding, small r, moderate, quadrature, start",
           lambda: sa.linear(2, -1), "0.4", "0.5", "-1/4"),
    _scene("linear r=1e-3", "linear, sliding, small r, moderate", lambda: sa.linear(2, -1),
           "0.4", "1e-3"),
    _scene("r=1", "linear, up, moderate, quadrature, start", lambda: sa.linear(2, 1),
           "0.4", "1", "1/2"),
    _scene("start at -1", "linear, repelling, moderate, quadrature", lambda: sa.linear(-1, 1),
           "1", "2", "-1"),
    _scene("start by the edge", "linear, sliding, weak, start at the edge",
           lambda: sa.linear(1, -1), "0.1", "10", "9.999999"),
    _scene("start by the inner edge", "friction, up, small r, weak, start at the edge", _friction(),
           "0.1", "0.9", "-0.8999999999"),
    # several wells, other shapes
    _scene("sine", "sine, analytic, up, several wells, moderate, quadrature",
           lambda: sa.sine(1, 1, 4, waves=2), "1", "2", "-3/2"),
    _scene("sine sliding", "sine, analytic, sliding, several wells, moderate",
           lambda: sa.sine(1, "-1/2", 5, waves=2), "0.7", "4", "1/4"),
    _scene("sine weak", "sine, analytic, repelling, several wells, weak",
           lambda: sa.sine(-1, 2, 3, waves=2), "0.15", "2", "1/7"),
    _scene("tanh", "tanh, analytic, sliding, moderate, quadrature", lambda: sa.tanh(1, -1, 5),
           "1/2", "2", "1/5"),
    _scene("tanh stiff", "tanh, analytic, sliding, stiff, slow",
           lambda: sa.tanh(1, "-1/2", 5), "1e-5", "2", "1/5"),
    _scene("tanh stiff, crossing", "tanh, analytic, down, stiff", lambda: sa.tanh(-1, "-1/2", 5),
           "1e-5", "2", "1/5"),
    _scene("tanh steep", "tanh, analytic, sliding, narrow, moderate, start",
           lambda: sa.tanh(1, -1, 60), "0.5", "3", "-1/2"),
    _scene("tanh very steep", "tanh, analytic, sliding, narrow, weak, may refuse",
           lambda: sa.tanh(1, -1, 1000), "0.3", "4", closed=HALF),
    _scene("hill", "hill, analytic, repelling, moderate, quadrature",
           lambda: sa.hill(-1, "1/2", "1/2", n=4), "1", "2", "1"),
    _scene("hill n=1", "hill, analytic, up, weak", lambda: sa.hill("1/3", 2, "1/5", n=1),
           "0.1", "2", "-1/4"),
    _scene("hill n=12", "hill, analytic, sliding, weak", lambda: sa.hill(1, -2, "1/3", n=12),
           "0.3", "2", "1/4"),
    _scene("quintic", "polynomial, sliding, several wells, moderate, quadrature",
           lambda: sa.polynomial("1/10", 2, 0, "-25/2", 0, 9), "0.6", "3", "1/3"),
    _scene("degree 12", "polynomial, down, weak",
           lambda: sa.polynomial(*[Fraction((-1) ** (k + 1), k + 1) for k in range(13)]),
           "0.1", "2", "-1/2"),
    _scene("degree 20", "polynomial, analytic, down, moderate",
           lambda: sa.polynomial(*[Fraction((-1) ** (k + 1), k + 1) for k in range(21)]),
           "0.3", "2", "-1/2"),
    # the user's own
    _scene("expression, cubic", "expression, up, well, moderate, quadrature",
           lambda: sa.Drift("1/2 - 2*u + b*u**3").bind(b="9/5"), "0.4", "2", "1/4"),
    _scene("expression", "expression, analytic, sliding, moderate, quadrature",
           lambda: sa.Drift("exp(-u)*cos(2*u + a) - u/3").bind(a="1/2"), "0.6", "2", "1/4"),
    _scene("expression, a tall peak",
           "expression, analytic, sliding, narrow, moderate, slow, may refuse",
           lambda: sa.Drift("1/2 - u + 3*exp(-1000*u**2)"), "0.5", "3", "-1/2"),
    _scene("expression, a spike", "expression, analytic, up, narrow, moderate, may refuse",
           lambda: sa.Drift("1 + 1000*exp(-1000000*(u - 1/3)**2)"), "0.5", "3", "-1/2",
           note="1e-3 wide; T is 3.3726, 0.13 less than without the spike"),
    _scene("expression, poles near", "expression, analytic, up, moderate, may refuse",
           lambda: sa.Drift("1 + 1/(1 + 400*(u - 3/10)**2)"), "1", "4"),
    # limits
    _scene("branch point at -1", "expression, analytic, up, moderate, refused",
           lambda: sa.Drift("1 + sqrt(1 + u)"), "1", "4",
           note="A is real on [-1, 1] but not analytic at -1"),
    _scene("a corner", "expression, analytic, up, moderate, refused",
           lambda: sa.Drift("1 + sqrt((u - 1/3)**2)"), "1", "4",
           note="A is real on [-1, 1] but not analytic at 1/3"),
]  # fmt: skip

BY_NAME = {problem.name: problem for problem in PROBLEMS}


def tagged(*tags: str) -> list[Problem]:
    """Scenes with all these tags."""
    return [p for p in PROBLEMS if p.tags.issuperset(tags)]
