"""Numerical checks: identities at random points, and orders measured over decades."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import sympy

from symasym.base.call_context import mpf_of, own_context
from symasym.derivation.results import Expansion, Outcome, Statement, parts, text

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


_POOL = 10_000


@cache
def nodes(precision: int, degree: int) -> tuple[tuple[Any, Any], ...]:
    """Nodes and weights of the Gauss-Legendre rule of a degree, in mpmath's numbering."""
    from mpmath.calculus.quadrature import GaussLegendre
    from mpmath.ctx_mp import MPContext

    ctx = MPContext()
    ctx.prec = precision
    return tuple(GaussLegendre(ctx).calc_nodes(degree, precision))


def evaluate(
    expression: sympy.Expr,
    values: Mapping[Any, Any],
    ctx: MPContext,
    functions: Mapping[Any, Callable[[Any, Any], Any]] | None = None,
) -> Any:
    """A SymPy expression with numbers of the mpmath context `ctx` for its symbols.

    Parameters
    ----------
    functions : mapping, optional
        Undefined function -> callable(argument, ctx).

    Notes
    -----
    Integrals: Gauss-Legendre (12 points for up to 20 digits, else 24) on panels
    between the whole numbers, among them the kinks -1, 0 and 1 of this
    project's drifts. Meant for integrands that vary on the scale of 1; its
    value is one side of a comparison and not trusted by itself.
    """
    compiled = _compiled(sympy.sympify(expression), frozenset(values), ctx, functions or {})
    return compiled(dict(values))


def _compiled(
    node: sympy.Expr, known: frozenset[Any], ctx: MPContext, named: Mapping[Any, Any]
) -> Any:
    """`node` as a function of a dict of numbers for the nodes in `known`.

    An integral of an integral asks for its integrand ten thousand times; the
    tree of the expression is gone through once.
    """
    if node in known:
        return lambda at: at[node]
    if node.is_Rational or node is sympy.pi or node is sympy.E:
        number = (
            ctx.mpf(int(node.p)) / int(node.q)
            if node.is_Rational
            else (+ctx.pi if node is sympy.pi else +ctx.e)
        )
        return lambda at: number
    if isinstance(node, sympy.Integral):
        return _quadrature(node, known, ctx, named)
    arguments = [_compiled(a, known, ctx, named) for a in node.args]
    if node.is_Add:
        return lambda at: ctx.fsum([f(at) for f in arguments])
    if node.is_Mul:
        return lambda at: ctx.fprod([f(at) for f in arguments])
    if node.is_Pow and node.base is not sympy.E:
        base, exponent = arguments
        if node.exp.is_Integer:
            whole = int(node.exp)
            return lambda at: base(at) ** whole
        return lambda at: ctx.power(base(at), exponent(at))
    if not arguments:
        raise NotImplementedError(f"no numerical value for {node}")
    first = arguments[-1]
    if isinstance(node, sympy.core.function.AppliedUndef) and node.func in named:
        function = named[node.func]
        return lambda at: function(first(at), ctx)
    if isinstance(node, sympy.exp):
        return lambda at: ctx.exp(first(at))
    if isinstance(node, sympy.Heaviside):
        start = arguments[0]
        return lambda at: ctx.one if start(at) > 0 else ctx.zero
    name = type(node).__name__.lower()
    if name in ("log", "sqrt", "tanh", "sin", "cos", "erf", "erfc") and len(node.args) == 1:
        function = getattr(ctx, name)
        return lambda at: function(first(at))
    raise NotImplementedError(f"no numerical value for {node}")


def _quadrature(
    node: sympy.Integral, known: frozenset[Any], ctx: MPContext, named: Mapping[Any, Any]
) -> Any:
    """An integral as a function of a dict of numbers, by Gauss-Legendre between whole numbers."""
    *inner, (variable, low, high) = node.limits
    body = sympy.Integral(node.function, *inner) if inner else node.function
    lower, upper = (_compiled(end, known, ctx, named) for end in (low, high))
    integrand = _compiled(body, known | {variable}, ctx, named)
    rule = nodes(ctx.prec, 3 if ctx.dps <= 20 else 4)
    weighted = [(ctx.convert(x), ctx.convert(weight)) for x, weight in rule]

    def integrate(at: dict[Any, Any]) -> Any:
        """The integral at these numbers, on panels between whole numbers."""
        a, b = lower(at), upper(at)
        kinks = [ctx.mpf(k) for k in range(-9, 10) if min(a, b) < k < max(a, b)]
        points = [a, *(kinks if a <= b else kinks[::-1]), b]
        inside, total = dict(at), ctx.zero
        for start, end in zip(points, points[1:], strict=False):
            half, middle = (end - start) / 2, (start + end) / 2
            for x, weight in weighted:
                inside[variable] = middle + half * x
                total += half * weight * integrand(inside)
        return total

    return integrate


@dataclass
class Sampled:
    """The stated result equals an independent evaluation at random exact points.

    Parameters
    ----------
    reference : expression or callable
        One expression or several, or ``callable(values, ctx)`` that works in an mpmath
        context; `values` maps symbols to numbers of it.
    ranges : mapping
        Symbol -> (low, high), from which a rational of 10,000 is drawn.
    points : int
    digits : int
        Agreement that is asked for; work is done with ten more.
    degree : int, optional
        If both sides are polynomials in the drawn numbers of at most this total
        degree, different ones pass by chance with probability at most
        ``(degree/10000)**k`` for k points (Schwartz and Zippel). Left out, no such bound
        is claimed: the statement is that they agree at these points.
    zeros : int, optional
        The same for sums of exponentials with polynomial factors: a difference
        that is not 0 vanishes at no more than this many values of the drawn
        numbers, counted one number at a time and added up. (N such terms, a
        factor of degree k counting for k + 1, have at most N - 1 real zeros.)
    functions : mapping, optional
        Undefined function -> callable(ctx value) used for it.
    """

    reference: Any
    ranges: Mapping[Any, tuple[Any, Any]]
    points: int = 4
    digits: int = 20
    degree: int | None = None
    zeros: int | None = None
    functions: Mapping[Any, Callable[[Any, Any], Any]] = field(default_factory=dict)
    kind: ClassVar[str] = "random evaluation"
    _known: dict[Any, Any] = field(default_factory=dict, repr=False)

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Compare at the points, which are the same for every result that is tried."""
        own = random.Random(20251121)
        pieces = parts(result)
        with own_context(self.digits + 10) as ctx:
            for number in range(self.points):
                exact = {s: self._draw(s, own) for s in self.ranges}
                values = {s: mpf_of(v, ctx) for s, v in exact.items()}
                if number not in self._known:
                    self._known[number] = self._sides(values, ctx)
                right = self._known[number]
                if len(right) != len(pieces):
                    return Outcome(False, f"{len(pieces)} pieces, {len(right)} in the reference")
                for piece, want in zip(pieces, right, strict=True):
                    got = evaluate(piece, values, ctx, self.functions)
                    # Not "gap > tolerance": a NaN must fail.
                    if not abs(got - want) <= ctx.mpf(10) ** -self.digits * max(abs(want), 1):
                        shown = ", ".join(f"{s} = {v}" for s, v in exact.items())
                        return Outcome(
                            False,
                            "the two sides differ",
                            *_texts(got, want, ctx),
                            shown,
                        )
        return Outcome(True, self.how())

    def _sides(self, values: Mapping[Any, Any], ctx: MPContext) -> list[Any]:
        """The reference's pieces at the drawn values."""
        if callable(self.reference) and not isinstance(self.reference, sympy.Basic):
            sides = self.reference(values, ctx)
            return list(sides) if isinstance(sides, (list, tuple)) else [sides]
        return [evaluate(e, values, ctx, self.functions) for e in parts(self.reference)]

    def _draw(self, symbol: sympy.Symbol, rng: random.Random) -> Fraction:
        """A rational of the symbol's range, one of `_POOL` that are equally far apart."""
        low, high = (Fraction(str(x)) for x in self.ranges[symbol])
        return low + (high - low) * Fraction(rng.randint(1, _POOL), _POOL + 1)

    def how(self) -> str:
        """One line on the points and on what agreement there means."""
        agree = f"agree to {self.digits} digits at {self.points} random exact points"
        if self.zeros is not None:
            power = f"({self.zeros}/{_POOL})^{self.points}"
            who = "different sums of exponentials"
            return f"{agree}; {who} would pass with probability at most {power}"
        if self.degree is None:
            return f"{agree}; no probability is claimed"
        power = f"({self.degree}/{_POOL})^{self.points}"
        return f"{agree}; different polynomials would pass with probability at most {power}"


def _texts(left: mpf, right: mpf, ctx: MPContext) -> tuple[str, str]:
    """Both numbers, with as many digits as it takes to see that they differ."""
    gap, size = abs(left - right), abs(right)
    shared = int(ctx.log10(size / gap)) if gap and size and ctx.isfinite(gap) else 0
    digits = 12 + max(0, shared)
    return str(ctx.nstr(left, digits)), str(ctx.nstr(right, digits))


@dataclass
class Order:
    """An expansion whose remainder has exactly the stated order, over several decades.

    The remainder divided by the gauge must settle: its logarithmic slope over
    the last decade is below `tolerance` and it does not vanish. A gauge that is
    one power too good or too weak has a slope of 1.

    Parameters
    ----------
    exact : callable
        ``exact(x, ctx)``: the quantity itself at ``variable = x``, independent
        of the stated expansion.
    at : sequence of str
        Values of the variable, towards the limit, over at least two decades.
    fixed : mapping, optional
        Values of the other symbols: strings or rationals, or callables
        ``f(x, ctx)`` where they move with the variable.
    digits : int
        Working precision; the remainder must stand out of it.
    """

    exact: Callable[[Any, Any], Any]
    at: Sequence[str]
    fixed: Mapping[Any, Any] = field(default_factory=dict)
    digits: int = 40
    tolerance: float = 0.2
    kind: ClassVar[str] = "asymptotic order"
    _known: dict[str, Any] = field(default_factory=dict, repr=False)

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Measure the slope of remainder / gauge."""
        if not isinstance(result, Expansion):
            return Outcome(False, "the result is no expansion")
        ratios = []
        with own_context(self.digits) as ctx:
            for point in self.at:
                x = ctx.mpf(point)
                if point not in self._known:
                    self._known[point] = self.exact(x, ctx)
                values = {s: _number(v, x, ctx) for s, v in self.fixed.items()} | {
                    result.variable: x
                }
                want = self._known[point]
                leading = evaluate(result.leading, values, ctx)
                gauge = evaluate(result.gauge, values, ctx)
                gap = abs(want - leading)
                if not gap > ctx.mpf(10) ** (8 - self.digits) * abs(want):
                    return Outcome(
                        False,
                        "the remainder is lost in the working precision",
                        ctx.nstr(leading, 20),
                        ctx.nstr(want, 20),
                        f"{point}",
                    )
                ratios.append(gap / abs(gauge))
            slopes = [
                float(ctx.log(b / a) / ctx.log(ctx.mpf(y) / ctx.mpf(x)))
                for a, b, x, y in zip(ratios, ratios[1:], self.at, self.at[1:], strict=False)
            ]
            shown = ctx.nstr(ratios[-1], 6)
            last = self.at[-1]
            if not abs(slopes[-1]) < self.tolerance:
                return Outcome(
                    False,
                    f"remainder / gauge does not settle (slope {slopes[-1]:.3g})",
                    *_texts(leading, want, ctx),
                    f"{result.variable} = {last}, remainder / gauge = {shown}",
                )
        return Outcome(
            True,
            f"the ratio settles at {shown} (logarithmic slope {slopes[-1]:.2g}) for "
            f"{result.variable} from {self.at[0]} to {last}",
        )

    def how(self) -> str:
        """One line on the range."""
        where = ", ".join(f"{s} = {text(v)}" for s, v in self.fixed.items() if not callable(v))
        moving = ", ".join(str(s) for s, v in self.fixed.items() if callable(v))
        return (
            f"the remainder, at {self.digits} digits, over what stands in O"
            + (f", for {where}" if where else "")
            + (f", with {moving} computed at each point" if moving else "")
        )


def _number(
    value: sympy.Expr | str | Fraction | Callable[[mpf, MPContext], mpf], x: mpf, ctx: MPContext
) -> Any:
    """A fixed symbol's value where the variable is `x`."""
    if callable(value):
        return value(x, ctx)
    if isinstance(value, sympy.Basic):
        return evaluate(value, {}, ctx)
    exact = Fraction(str(value))
    return mpf_of(exact, ctx)


@dataclass
class Together:
    """Several checks of one result, all of which must pass (one per scene, or of two kinds)."""

    checks: tuple[Any, ...]

    @property
    def kind(self) -> str:
        """The kinds of its checks, each once."""
        return ", ".join(dict.fromkeys(check.kind for check in self.checks))

    def run(self, result: Statement, rng: random.Random) -> Outcome:
        """Run one after the other, up to the first that fails."""
        details = []
        for check in self.checks:
            outcome: Outcome = check.run(result, rng)
            if not outcome.passed:
                return outcome
            details.append(outcome.detail)
        return Outcome(bool(details), "; ".join(details))

    def how(self) -> str:
        """The effect of each of them."""
        return "; ".join(dict.fromkeys(check.how() for check in self.checks))
