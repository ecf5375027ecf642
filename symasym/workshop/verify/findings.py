"""What a check says, and what it compares with: scenes and their reference values."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import mpmath

import symasym as sa
from symasym.workshop.reference_quadrature import in_mpmath
from symasym.workshop.problems import BY_NAME, Problem

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


#: What the exact integrals are called in the paper.
LABELS = {"T": "eq:Ttilde", "C": "eq:C", "1-C": "eq:C", "P": "eq:P", "1-P": "eq:P"}


def label(quantity: str) -> str:
    """The paper's label of a quantity of `symasym.workshop.problems`."""
    return LABELS.get(quantity, "eq:pss")


class Finding(NamedTuple):
    """One comparison: a formula by its label, which of its evaluators, which check.

    `size` is what was found over what is allowed, so that it passes up to 1; None where the
    evaluator refused to answer and may. `where` is the scene and options, `detail` has the numbers
    where it fails.
    """

    formula: str
    evaluator: str
    check: str
    size: float | None
    where: str
    detail: str = ""

    @property
    def refused(self) -> bool:
        """True where no value was given."""
        return self.size is None

    @property
    def passed(self) -> bool:
        """True where the size is at most 1, or no value was given."""
        # A NaN is no pass.
        return self.size is None or self.size <= 1


def ratio(gap: mpf | float, allowed: mpf | float) -> float:
    """gap/allowed as a float; 0/0 is 0."""
    if not gap:
        return 0.0
    if not allowed:
        return float("inf")
    quotient = gap / allowed
    return float(quotient) if quotient < 1e300 else float("inf")


def compared(
    formula: str, evaluator: str, check: str, gap: mpf | float, allowed: mpf | float, where: str
) -> Finding:
    """The finding that `gap` must be at most `allowed`."""
    size = ratio(gap, allowed)
    detail = "" if size <= 1 else f"off by {_short(gap)} where {_short(allowed)} is allowed"
    return Finding(formula, evaluator, check, size, where, detail)


def failed(formula: str, evaluator: str, check: str, where: str, error: Exception) -> Finding:
    """The finding that something was raised where an answer was due."""
    message = f"{type(error).__name__}: {error}"
    return Finding(formula, evaluator, check, float("inf"), where, message)


def _short(x: mpf | float) -> str:
    """Three digits of a number."""
    from mpmath import mpf, nstr

    return str(nstr(mpf(getattr(x, "_mpf_", x)), 3))


def relative(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference)/abs(reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    a, b = context.convert(value), context.convert(reference)
    return abs(a - b) / abs(b) if b else abs(a)


def _bits(x: mpf | float) -> int:
    """Bits of the mantissa of an mpf; more than enough for any other number."""
    return int(x._mpf_[1].bit_length()) if hasattr(x, "_mpf_") else 64


def logarithm(value: mpf | float, dps: int = 60) -> Any:
    """log(value) as an mpf with `dps` digits."""
    context = mpmath.MPContext()
    context.dps = dps
    return mpmath.mp.make_mpf(context.log(context.convert(value))._mpf_)


def distance(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    return abs(context.convert(value) - context.convert(reference))


class Field:
    """phi and V of one drift at the precision of `mp`."""

    def __init__(self, drift: sa.Drift, mp: MPContext) -> None:
        self.drift, self.mp, self._A = drift, mp, in_mpmath(drift, mp)
        a_minus, a_plus = (mp.convert(Fraction(x)) for x in drift.ends)
        self.ends = (a_minus, a_plus)

    def A(self, u: mpf | Fraction | float) -> Any:
        """The drift's formula at `u`, inside the layer or not."""
        return self._A(self.mp.convert(u))

    def phi(self, u: mpf | Fraction | float) -> Any:
        """eq:phi."""
        return self.A(min(max(self.mp.convert(u), -self.mp.one), self.mp.one))

    def rise(self, *points: mpf | Fraction | float) -> Any:
        """V at the last of `points`, in the layer, less V at the first."""
        return -self.mp.quad(self.A, [self.mp.convert(u) for u in points])

    def slope(self, u: mpf | Fraction | float, order: int = 1) -> Any:
        """A derivative of A."""
        return self.mp.diff(self.A, u, order)

    def zero(self, near: mpf | Fraction | float) -> Any:
        """The zero of A beside `near`."""
        return self.mp.findroot(self.A, self.mp.convert(near))


# -- scenes and reference values -------------------------------------------------------------------


_KINDS = ("friction", "polynomial", "linear", "sine", "tanh", "hill", "expression")
_SHAPES = ("exp(-X**2)", "tanh(X)", "1/(1 + X**2)", "X*exp(-X**2)", "sin(X)")


def random_scene(seed: int, index: int) -> Problem:
    """Scene number `index` of a seed, the same in every process.

    A third of them is smooth enough for plain quadrature and tagged so.
    """
    draw = random.Random(f"symasym {seed} {index}")
    kind = _KINDS[index % len(_KINDS)]
    smooth = index % 3 == 0
    kappa = _power(draw, -0.3, 1) if smooth else _power(draw, -1.5, 4)
    r = _power(draw, -0.5, 1) if smooth else _power(draw, -0.5, 4)
    start = draw.choice((Fraction(0), r * _rational(draw, -0.99, 0.99)))
    arguments = _arguments(kind, draw)
    a_minus, a_plus = _make(kind, arguments).ends
    tags = {kind, _region(a_minus, a_plus), *({"quadrature", "moderate"} if smooth else ())}
    return Problem(
        f"random {index} of seed {seed}",
        lambda: _make(kind, arguments),
        str(kappa),
        str(r),
        str(start),
        frozenset(tags),
    )


def _region(a_minus: Fraction, a_plus: Fraction) -> str:
    """The tag of the region of two ends."""
    if a_minus * a_plus == 0:
        return "tangency"
    if a_minus > 0:
        return "up" if a_plus > 0 else "sliding"
    return "repelling" if a_plus > 0 else "down"


def _rational(draw: random.Random, low: float, high: float) -> Fraction:
    """A rational of three decimals between two ends."""
    return Fraction(draw.randint(int(low * 1000), int(high * 1000)), 1000)


def _power(draw: random.Random, low: float, high: float) -> Fraction:
    """A power of ten between two exponents, of six digits."""
    # Six digits, so that the scene is a short rational and still anywhere.
    return Fraction(f"{10 ** draw.uniform(low, high):.5e}")


def _arguments(kind: str, draw: random.Random) -> tuple[Any, ...]:
    """Parameters of a kind of drift."""
    ends = (_rational(draw, -3, 3), _rational(draw, -3, 3))
    if kind == "friction":
        return (_rational(draw, 0, 8), _rational(draw, 0.1, 4), _rational(draw, -4, 6))
    if kind == "polynomial":
        return tuple(_rational(draw, -3, 3) for _ in range(draw.randint(1, 7)))
    if kind == "sine":
        return (*ends, _rational(draw, -4, 4), draw.randint(1, 4))
    if kind == "tanh":
        return (*ends, _rational(draw, 0.1, 20))
    if kind == "hill":
        return (*ends, _rational(draw, 0.1, 2), draw.randint(1, 8))
    if kind == "expression":
        width, centre = _power(draw, -1, 0.5), _rational(draw, -1.1, 1.1)
        feature = draw.choice(_SHAPES).replace("X", f"((u - ({centre}))/({width}))")
        return (f"{ends[0]} + ({ends[1]})*u + ({_rational(draw, -3, 3)})*{feature}",)
    return ends


def _make(kind: str, arguments: tuple[Any, ...]) -> sa.Drift:
    """The drift of a kind with these parameters."""
    if kind == "sine":
        return sa.sine(*arguments[:3], waves=arguments[3])
    if kind == "hill":
        a_minus, a_plus, K, n = arguments
        return sa.hill(a_minus, a_plus, K=K, n=n)
    made: sa.Drift = (sa.Drift if kind == "expression" else getattr(sa, kind))(*arguments)
    return made


#: ("table", name) or ("random", seed, index): what a scene is called between processes.
Key = tuple[str, ...]

_DPS = 45
_known: dict[tuple[str, str], Reference] = {}


class Reference(NamedTuple):
    """`value` is within `radius` of the truth, proved."""

    value: Any
    radius: Any


@cache
def scene(key: Key) -> Problem:
    """The scene of a key; its drift is made once, and keeps what has been analysed of it."""
    problem = BY_NAME[key[1]] if key[0] == "table" else random_scene(int(key[1]), int(key[2]))
    return replace(problem, make=cache(problem.make))


def reference(problem: Problem, quantity: str) -> Reference:
    """The proved ball to 45 digits."""
    known = _known.get((problem.name, quantity))
    if known is None:
        enclosed = problem.questions()[quantity](dps=_DPS, full=True)
        known = _known[problem.name, quantity] = Reference(enclosed.value, enclosed.error)
    return known


def forget() -> None:
    """Ask again from now on."""
    _known.clear()
    scene.cache_clear()
