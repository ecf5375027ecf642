"""Statements of derivations, held to the definition of what stands on their left side.

The definitions are differential equations solved from nothing, or plain sums
(`tests.derivations.definitions`, `tests.derivations.random_scenes`); the statement is SymPy's, both
sides, with numbers put in by name.
"""

from __future__ import annotations

import operator
import random
from collections import ChainMap
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache, reduce
from typing import Any

import numpy as np
import sympy

from derivations import registry
from symasym.derivation.results import Expansion
from tests.derivations import random_scenes as on
from tests.derivations.definitions import CTX, Drift, Scene, gauss, of_fraction
from tests.derivations.random_scenes import Draw, Numbers, Path, numbers

# -- SymPy's statements in numbers ----------------------------------------------------------


def value(e: Any, at: Mapping[str, Any]) -> Any:
    """`e` with the numbers of `at`: to 20 digits, in float64 where there is an integral in it."""
    e = sympy.sympify(e)
    if e.has(sympy.Integral):
        return _number(_work(e, at, _FLOAT))
    # Digits enough for 1 - P where that is exponentially small.
    with CTX.workdps(200):
        return _number(_work(e, at, _DIGITS))


def _number(x: Any) -> Any:
    """A number of the context."""
    return CTX.convert(float(x) if isinstance(x, (np.ndarray, np.generic)) else x)


def _in_float(x: Any) -> Any:
    return x if isinstance(x, np.ndarray) else float(x)


#: How numbers are read, and functions: in float64 with arrays, and in the context.
_FLOAT = (
    _in_float,
    {
        sympy.exp: np.exp,
        sympy.log: np.log,
        sympy.tanh: np.tanh,
        sympy.Heaviside: lambda x, half: np.heaviside(x, half),
    },
)
_DIGITS = (
    _number,
    {
        **{getattr(sympy, n): getattr(CTX, n) for n in ("exp", "log", "tanh", "sin", "cos", "erf")},
        sympy.Heaviside: lambda x, _: CTX.mpf(x > 0),
        **{getattr(sympy, n): getattr(CTX, n) for n in ("airyai", "airybi")},
        sympy.atan2: CTX.atan2,
        sympy.airyaiprime: lambda z: CTX.airyai(z, derivative=1),
        sympy.airybiprime: lambda z: CTX.airybi(z, derivative=1),
    },
)


def _work(e: Any, at: Mapping[Any, Any], arithmetic: Any) -> Any:
    """The value of `e`; integrals by Gauss's rule on panels between the kinks."""
    read, functions = arithmetic
    if e is sympy.oo:
        return np.inf
    if e.is_Rational:
        return read(Fraction(int(e.p), int(e.q)) if arithmetic is _FLOAT else CTX.mpf(e.p) / e.q)
    if e.is_NumberSymbol:
        return read(+CTX.pi if e is sympy.pi else +CTX.e)
    if e.is_Symbol:
        return read(at[e.name])
    if isinstance(e, sympy.Integral):
        return _integral(e, at)
    arguments = [_work(a, at, arithmetic) for a in e.args]
    if isinstance(e, sympy.core.function.AppliedUndef):
        return read(at[e.func.__name__](*arguments))
    if e.is_Add or e.is_Mul:
        return reduce(operator.add if e.is_Add else operator.mul, arguments)
    if e.is_Pow and e.base is not sympy.E:
        return arguments[0] ** arguments[1]
    if e.is_Pow:
        return functions[sympy.exp](arguments[1])
    return functions[e.func](*arguments)


def _integral(e: Any, at: Mapping[Any, Any]) -> Any:
    *inner, (variable, low, high) = e.limits
    rest = sympy.Integral(e.function, *inner) if inner else e.function
    needed = {s.name for s in rest.free_symbols - {variable}} | {
        f.func.__name__ for f in rest.atoms(sympy.core.function.AppliedUndef)
    }

    def integrand(x: Any) -> Any:
        return _work(rest, {k: _deeper(at[k]) for k in needed} | {variable.name: x}, _FLOAT)

    return gauss(integrand, _work(low, at, _FLOAT), _work(high, at, _FLOAT))


def _deeper(x: Any) -> Any:
    """An array with one axis more, at its end."""
    return x[..., None] if isinstance(x, np.ndarray) else x


# -- what is held to what ---------------------------------------------------------------------

#: Exact conclusions: the scenes on which both sides agree, and to which relative error.
EXACT: dict[str, tuple[Draw, float]] = {
    "filippov": (on.convex, 1e-12),
    "eq:eekappar": (on.two_scales, 1e-8),
    "noise-amplitude": (on.noises, 1e-12),
    "eq:scaledSDEx": (on.one_step, 1e-12),
    "eq:phi": (on.sliding, 1e-12),
    "eq:reducedSDE": (on.noises, 1e-12),
    "eq:tildexykappa": (on.two_scales, 1e-8),
    "eq:reducedSDEtilde": (on.noises, 1e-12),
    "eq:tilder": (on.two_scales, 1e-12),
    "eq:Ttilde0": (on.constant, 1e-5),
    "first-integral": (on.crossing, 1e-12),
    "density-R": (on.crossing, 1e-10),
    "eq:C": (on.crossing, 1e-10),
    "eq:Ttilde": (on.crossing, 1e-10),
    "backward": (on.crossing, 1e-12),
    "constant-drift": (on.constant, 1e-12),
    "positive-form": (on.crossing, 1e-10),
    "positive-density": (on.sliding, 1e-10),
    "constant-panel": (on.straight_panel, 1e-12),
    "panel-step": (on.panel, 1e-10),
    "eq:V": (on.crossing, 1e-12),
    "eq:V2": (on.crossing, 1e-12),
    "eq:pss": (on.sliding, 1e-12),
    "eq:TtildeCzero": (on.crossing, 1e-10),
    "pair-products": (on.airy_pair, 1e-4),
    "endpoint-series": (on.formal, 1e-9),
    "regular-part": (on.powers, 1e-9),
    "pair-primitives": (on.beside_pair, 1e-9),
    "saddle-recurrences": (on.moments, 1e-9),
    "two-sides": (on.both_sides, 1e-9),
    "airy-form": (on.weighted_pair, 1e-4),
    "truncated-gaussian": (on.cut_gaussian, 1e-10),
    "release-adiabatic": (on.held, 1e-7),
    "fold-delay": (on.past_fold, 1e-7),
    "tails": (on.sliding, 1e-12),
    "eq:P": (on.sliding, 1e-12),
    "eq:P2": (on.sliding, 1e-12),
    "eq:TtildetoT": (on.two_scales, 1e-8),
    "cubic": (on.friction_root, 1e-12),
    "folds": (on.friction, 1e-12),
    "fr1": (on.friction, 1e-8),
    "fr2": (on.friction, 1e-8),
    "friction-well": (on.friction, 1e-8),
    "eq:osc2": (on.friction, 1e-12),
    "eq:forcePWC": (on.friction, 1e-12),
    "eq:forcePerturbed": (on.friction, 1e-12),
    "turning-points": (on.friction, 1e-12),
    "beta": (on.friction, 1e-12),
    "eq:osc3": (on.friction, 1e-12),
    "eq:phifric0": (on.friction, 1e-12),
    "eq:Vfric": (on.friction, 1e-12),
}


#: Expansions: the path, its points, and the size of the error where the statement has it in words.
ORDERS: dict[str, tuple[Path, tuple[str, ...], Callable[[Numbers, Any], Any] | None]] = {
    "eq:Plarge": (
        on.narrow_layer,
        ("1e-2", "1e-3"),
        lambda at, _: (at["epsilon"] / at["kappa_phys"] ** 2) ** 2,
    ),
    "eq:Psmall": (
        on.weak_narrow,
        ("0.14", "0.1"),
        lambda at, leading: leading * at["kappa_phys"] ** 2 / at["epsilon"],
    ),
    "eq:Tlarge": (on.short_way, ("1e-2", "1e-3"), lambda at, _: at["r_phys"] ** 2),
    "eq:Tsmall": (on.equal_terms, ("0.2", "0.14"), lambda at, leading: leading * at["kappa"] ** 4),
    "eq:scaledSDE": (on.along_a_ray, ("1e-3", "1e-4"), None),
    "eq:fourthTerm": (on.strong, ("1e2", "1e3"), None),
    "first-three": (on.strong, ("1e2", "1e3"), None),
    "eq:Ttildelarge": (on.strong, ("1e2", "1e3"), None),
    "saddle-series": (on.one_well, ("150", "300"), None),
    "saddle-start": (on.from_well, ("150", "300"), None),
    "eq:Plarge2": (on.strong_sliding, ("1e2", "1e3"), None),
    "eq:Psmall2": (on.weak_sliding, ("0.14", "0.1"), None),
    "laplace-substitution": (on.weak, ("1e-2", "1e-3"), lambda at, _: at["kappa"] ** 3),
    "eq:secondTerm": (on.weak, ("0.2", "0.14"), None),
    "eq:fourthTerm2": (on.weak, ("0.2", "0.14"), lambda at, _: at["kappa"] ** 2),
    "other-pieces": (on.high_end, ("0.14", "0.1"), None),
    "eq:Ttildesmall": (on.both_terms, ("0.2", "0.14"), None),
    "threshold": (on.long_escape, ("0.1", "0.07"), lambda at, leading: leading / at["ell"]),
}


@cache
def scenes(draw: Draw, seed: int) -> Any:
    """A random scene, its numbers worked out once."""
    return draw(random.Random(f"{draw.__name__} {seed}"))


@cache
def on_path(path: Path, seed: int, point: str) -> Numbers:
    """The scene of a path at one of its points."""
    return scenes(path, seed)(CTX.mpf(point))


def exact(label: str, left: Any, result: Any, seeds: range) -> None:
    """Raise unless both sides agree on the scenes of `seeds`."""
    draw, tolerance = EXACT[label]
    for seed in seeds:
        at = scenes(draw, seed)
        if registry.build(label).cases:
            # One function, piece by piece: left of the layer, in it, right of it.
            rows = [
                (left, piece, ChainMap({"u": CTX.mpf(u)}, at))
                for piece, u in zip(result, ("-1.7", "0.3", "1.6"), strict=True)
            ]
        elif isinstance(left, tuple):
            rows = [(a, b, at) for a, b in zip(left, result, strict=True)]
        else:
            rows = [(left, result, at)]
        for a, b, known in rows:
            want, got = value(a, known), value(b, known)
            # Not "gap > tolerance": a NaN must fail.
            assert abs(got - want) <= tolerance * (abs(want) or 1), (seed, a, want, got)


def orders(label: str, left: Any, result: Any, seeds: range) -> None:
    """Raise unless the error is of the stated order: no larger on any drift, no smaller on most."""
    path, points, size = ORDERS[label]
    leading = result.leading if isinstance(result, Expansion) else result
    slopes = []
    for seed in seeds:
        ratios = []
        for point in points:
            at = on_path(path, seed, point)
            got, want = value(leading, at), value(left, at)
            gauge = size(at, got) if size else value(result.gauge, at)
            ratios.append(abs(got - want) / abs(gauge))
        # Positive where the error falls more slowly than the gauge.
        ends = [abs(CTX.log(CTX.mpf(x))) for x in points]
        slopes.append(float(CTX.log(ratios[1] / ratios[0]) / abs(ends[1] - ends[0])))
    # One power more or less is a slope of 1; a drift whose next coefficient is small lies off.
    assert max(slopes) < 0.8, slopes
    assert abs(sorted(slopes)[len(slopes) // 2]) < 0.35, slopes


def four_pieces(_: str, left: Any, result: Any, seeds: range) -> None:
    """The four double integrals, each lam times the time that it stands for."""
    for seed in seeds:
        at = scenes(on.crossing, seed)
        lam, V = float(at["lam"]), at["V"]
        known = ChainMap(
            {"f": lambda u: np.exp(-lam * V(u)), "g": lambda v: np.exp(lam * V(v))},  # noqa: B023
            at,
        )
        for a, b in zip(left, result, strict=True):
            want, got = value(a, at), lam * value(b, known)
            assert abs(got - want) <= 1e-10 * abs(want), (seed, a, want, got)


def forward_operator(label: str, left: Any, result: Any, seeds: range) -> None:
    """The operator of densities by its weak form: g (L* q) and q (L g) have one integral."""
    u, kappa = sympy.Symbol("u", real=True), sympy.Rational(7, 5)
    assert left.name == {"eq:FPE": "Lq", "eq:odeR": "LR"}[label]
    for seed in seeds:
        rng, rate = random.Random(seed), sympy.Rational(seed + 2, 3)
        q, g, phi = (sum(rng.randint(1, 9) * (-u) ** k for k in range(3)) for _ in range(3))
        q, g = (1 - u**2) ** 2 * q, (1 - u**2) ** 2 * g
        put = {s: {"kappa": kappa, "m": rate}[s.name] for s in result.free_symbols if s.name != "u"}
        stated = result.replace(sympy.Function("q"), lambda x, q=q: q.subs(u, x))
        stated = stated.replace(sympy.Function("phi"), lambda x, phi=phi: phi.subs(u, x)).doit()
        density = q if label == "eq:FPE" else q / rate
        backward = phi * sympy.diff(g, u) + kappa**2 / 2 * sympy.diff(g, u, 2)
        whole = sympy.Poly(g * stated.subs(put) - density * backward, u).integrate()
        assert whole.eval(1) == whole.eval(-1), seed


def gaussians(_: str, left: Any, result: Any, seeds: range) -> None:
    """lam times both Gaussian integrals over the line, by sums (the trapezoidal rule)."""
    for seed in seeds:
        rng = random.Random(seed)
        at = {"A_1": -on.within(rng, "0.5", "3"), "A_2": on.within(rng, "0.5", "3")}
        lam, x = 3.0, np.linspace(-12, 12, 2001)
        both = [
            np.sum(np.exp(-lam * abs(float(a)) * x**2 / 2)) * (x[1] - x[0]) for a in at.values()
        ]
        want, got = (
            lam * both[0] * both[1],
            value(result, {k: of_fraction(a) for k, a in at.items()}),
        )
        assert left.name == "G"
        assert abs(got - want) <= 1e-12 * want, (seed, want, got)


def multiplier(_: str, left: Any, result: Any, seeds: range) -> None:
    """The share of the well's term in T, from a start before, on and behind the barrier, and
    within a width of it; beside the fold by the pair's double integral.
    """
    assert left.name == "S"
    before, on_top, behind, no_well, passing, fold = result
    for seed in seeds:
        path = scenes(on.weak, seed)
        u2, A2 = path(CTX.one)["u2"], path(CTX.one)["A_2"]
        width, unit = 1 / CTX.sqrt(A2), CTX.mpf("0.3")
        for away, want in (
            *((c * width, value(passing, {"A_2": A2, "u2": c * width * unit, "kappa": unit}))
              for c in (CTX.mpf("-0.4"), CTX.mpf("0.9"))),
            (CTX.zero, value(on_top, {})),
        ):  # fmt: skip
            # A share at a distance of so many kappa from the start; its error is O(kappa).
            coarse, fine = (path(k)["S_from"](u2 - k * away) for k in map(CTX.mpf, ("0.1", "0.05")))
            assert abs(2 * fine - coarse - want) < 0.03, (seed, want, coarse, fine)
        for away, want in ((CTX.mpf("0.5"), before), (-CTX.mpf("0.25"), behind)):
            share = path(CTX.mpf("0.05"))["S_from"](u2 - away)
            assert abs(share - value(want, {})) < 0.02, (seed, want, share)
        Z = float(on.within(random.Random(seed), "-1.5", "1.5"))
        there, back = (on.airy_pair_at(z)["J"] for z in (Z, -Z))
        share = there / (there + back)
        assert abs(value(fold, {"Z": CTX.mpf(Z)}) - share) < 1e-4, (seed, share)
    # Without a well nothing is exponentially large.
    assert no_well == 0


def regions(_: str, left: Any, result: Any, seeds: range) -> None:
    """How many of the two fields point to the surface, by a small step along each."""
    assert left.name == "N"
    for number, (am, ap) in zip(result, ((-1, -1), (-1, 1), (1, -1), (1, 1)), strict=True):
        assert number == sum(abs(y + v / 10) < abs(y) for y, v in ((-1, am), (1, ap))), (am, ap)


def upper_bound(_: str, left: Any, result: Any, seeds: range) -> None:
    """C of drifts that make it as large as the conditions of the bound let it be."""
    assert left.name == "C_high"
    drifts = [scenes(on.barely, seed) for seed in range(10 * len(seeds))]
    shares = [at["C"] / value(result, at) for at in drifts]
    assert max(shares) <= 1, max(shares)
    # Nor is the bound far from needed.
    assert max(shares) >= CTX.mpf("0.5"), max(shares)


def lower_bound(_: str, left: Any, result: Any, seeds: range) -> None:
    """P of any sliding drift with V <= V(1) on (1 - L, 1), and of one where V is flat: equality."""
    assert left.name == "P_low"
    for seed in seeds:
        rng = random.Random(seed)
        kappa, L = of_fraction(on.within(rng, "0.4", "2")), on.within(rng, "0.2", "1.9")
        ends = (on.within(rng, "0.4", "2"),), (-on.within(rng, "0.4", "2"),)
        # A jump of V up to V(1) = h at 1 - L, and no mass left of it (V is huge there).
        h, edge = on.within(rng, "-1", "1"), 1 - L
        steep = Fraction(1, 10**6)
        edges = (Fraction(-1), -1 + steep, edge - steep, edge, Fraction(1))
        fields = ((-60 / steep,), (Fraction(0),), ((60 - h) / steep,), (Fraction(0),))
        at = numbers(Scene(Drift(edges, (ends[0], *fields, ends[1])), kappa))
        low = value(result, ChainMap({"L": of_fraction(L)}, at))
        assert abs(low - at["P"]) <= 1e-4 * at["P"], (seed, low, at["P"])
        assert low <= at["P"]


def leaving(_: str, left: Any, result: Any, seeds: range) -> None:
    """The equations of a mean time and of a variance, with the derivatives of those of a walk."""
    u, z = sympy.symbols("u z", real=True)
    for seed in seeds:
        at = scenes(on.moving, seed)

        def known(stated: Any, at: Numbers = at) -> Any:
            """The value at u = z = 0 where T and v are their Taylor polynomials."""
            for f in ("T", "v"):
                parts = [sympy.Rational(at[f + by]) for by in ("", "u", "uu", "z")]
                poly = sympy.Add(*map(sympy.Mul, parts, (1, u, u**2 / 2, z)))
                stated = sympy.sympify(stated).replace(
                    sympy.Function(f), lambda x, y, e=poly: e.subs({u: x, z: y})
                )
            return value(stated.doit().subs({u: 0, z: 0}), at)

        for a, b in zip(left, result, strict=True):
            want, got = known(a), known(b)
            # The slope of T may be small.
            assert abs(got - want) <= 1e-3 * (abs(want) + 0.1), (seed, a, want, got)


def first_order(_: str, left: Any, result: Any, seeds: range) -> None:
    """The change of a walk's mean time with eps; Sigma and T_f of a constant drift put in."""
    u, z, a, b, r, kappa = (sympy.Symbol(name) for name in ("u", "z", "a", "b", "r", "kappa"))
    assert [e.func.__name__ for e in left] == ["s", "T_1"]

    def scale(x: Any, drift: Any = a) -> Any:
        """The integral of e^(lam V) from -r on."""
        return (1 - sympy.exp(-2 * drift * (x + r) / kappa**2)) * kappa**2 / (2 * drift)

    def still(x: Any, y: Any) -> Any:
        """T_f; the drift is a + b z."""
        return (2 * r * scale(x, a + b * y) / scale(r, a + b * y) - x - r) / (a + b * y)

    def named(stated: Any) -> Any:
        """The same with one symbol of each name, and derivatives worked out."""
        stated = stated.xreplace({s: sympy.Symbol(s.name) for s in stated.atoms(sympy.Symbol)})
        stated = stated.replace(sympy.Function("Sigma"), scale)
        stated = stated.replace(sympy.Function("T_f"), still)
        return stated.replace(sympy.Derivative, lambda *e: sympy.diff(*e))

    source = named(result[0]).subs(z, 0)
    whole = named(result[1].replace(sympy.Function("s"), sympy.Function("f")))
    whole = whole.replace(sympy.Function("f"), lambda x: source.subs(u, x))
    for seed in seeds:
        at = scenes(on.nudged, seed)
        known = ChainMap({"z": 0.0, "u": at["x"]}, at)
        assert abs(value(still(u, z), known) - at["rest"]) < 1e-4, seed
        got, want = value(whole, known), at["T_1"]
        assert abs(got - want) <= 1e-3 * (abs(want) or 1), (seed, want, got)


def second_order(_: str, left: Any, result: Any, seeds: range) -> None:
    """Both sides differ by what falls as eps^2."""
    for seed in seeds:
        path = scenes(on.waiting, seed)
        for a, b in zip(left, result, strict=True):
            gaps = [abs(value(a, at) - value(b, at)) for at in map(path, (2e-3, 1e-3))]
            assert 3.5 < gaps[0] / gaps[1] < 4.5, (seed, a, gaps)


def continuity(_: str, left: Any, result: Any, seeds: range) -> None:
    """What both sides differ by is the jump of the smoothed field across each edge."""
    for seed in seeds:
        at = scenes(on.edges, seed)
        for inside, outside, jump in zip(left, result, at["jumps"], strict=True):
            gap = value(outside, at) - value(inside, at)
            assert abs(gap - jump) <= 1e-12, (seed, inside, gap, jump)


OTHERS: dict[str, Callable[[str, Any, Any, range], None]] = {
    "eq:fourPieces": four_pieces,
    "eq:cont": continuity,
    "eq:FPE": forward_operator,
    "eq:odeR": forward_operator,
    "gaussian-step": gaussians,
    "eq:S": multiplier,
    "regions": regions,
    "release-time": leaving,
    "release-order": first_order,
    "frozen-time": second_order,
    "C-bound": upper_bound,
    "L-bound": lower_bound,
}


def anchor(label: str, left: Any, result: Any, seeds: range = range(3)) -> None:
    """Raise an AssertionError unless the statement is true of what its left side means."""
    if label in EXACT:
        exact(label, left, result, seeds)
    elif label in ORDERS:
        orders(label, left, result, range(max(5, len(seeds))))
    else:
        OTHERS[label](label, left, result, seeds)


def holds(label: str, left: Any, result: Any) -> bool:
    """True if the statement passes; one that has no value at all does not."""
    try:
        anchor(label, left, result)
    except (AssertionError, ArithmeticError, KeyError, TypeError, ValueError, AttributeError):
        return False
    return True
