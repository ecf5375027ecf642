"""Every question whose answer is kept: each method on the table of scenes, in each arithmetic.

A question is a name and a call; the name's first word is the group by which parts are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

import symasym as sa
from tests.integrals.table import INTEGRALS
from tests.problems import BY_NAME, PROBLEMS, Problem

Question = tuple[str, Callable[[], Any]]

_SKIPPED = {"tanh stiff", "expression, a tall peak"}  # a minute each
_STEPS = np.array([1.0, 1.25, 2.0])


def questions(group: str) -> Iterator[Question]:
    """The questions of a group, in the order of the table."""
    yield from GROUPS[group]()


def _verbs(p: Problem) -> dict[str, Callable[..., Any]]:
    return {k: call for k, call in p.questions().items() if not k.startswith("p(")}


def _arrays(p: Problem, quantity: str, **options: Any) -> Any:
    drift, kappa = p.make(), float(Fraction(p.kappa)) * _STEPS
    r, start = float(Fraction(p.r)), float(Fraction(p.start))
    options |= {"log": True, "full": True}
    if quantity == "T":
        return sa.escape_time(drift, kappa, r, start=start, **options)
    if quantity in ("C", "1-C"):
        return sa.exit_probability(
            drift, kappa, r, start=start, complement=quantity == "1-C", **options
        )
    return sa.occupation(drift, kappa, complement=quantity == "1-P", **options)


def _kept(*without: str) -> list[Problem]:
    return [p for p in PROBLEMS if p.name not in _SKIPPED and not p.tags & {"refused", *without}]


def _exact() -> Iterator[Question]:
    for p in _kept():
        for quantity, ask in p.questions().items():
            name = f"exact | {p.name} | {quantity}"
            yield f"{name} | float", lambda ask=ask: ask(log=True)
            yield f"{name} | 40 digits", lambda ask=ask: ask(log=True, dps=40)
            yield f"{name} | ball", lambda ask=ask: ask(log=True, dps=25, full=True)
            if not quantity.startswith("p("):
                yield f"{name} | array", lambda p=p, q=quantity: _arrays(p, q)


def _expansion(
    method: str, quantities: str, orders: list[Any], *without: str
) -> Iterator[Question]:
    for p in _kept(*without):
        for quantity, ask in _verbs(p).items():
            if quantity not in quantities.split():
                continue
            for order in orders:
                options = {"method": method, **({} if order is None else {"order": order})}
                name = f"{method} | {p.name} | {quantity} | order {order}"
                full = {**options, "log": True, "full": True}
                yield f"{name} | float", lambda ask=ask, o=full: ask(**o)
                yield f"{name} | 40 digits", lambda ask=ask, o=full: ask(dps=40, **o)
                yield f"{name} | array", lambda p=p, q=quantity, o=options: _arrays(p, q, **o)


def _laplace() -> Iterator[Question]:
    yield from _expansion("laplace", "T C 1-P", [0, 3], "analytic")
    yield from _expansion("laplace", "T", ["optimal"], "analytic")
    yield from _expansion("laplace", "T 1-P", [1], *_POLYNOMIALS)


_POLYNOMIALS = ("friction", "linear", "polynomial", "constant")


def _uniform() -> Iterator[Question]:
    yield from _expansion("uniform", "T 1-P", [0, 1], "analytic")
    for z0 in ("-1.6", "-0.77", "-0.6", "-0.1", "-0.0001"):
        for kappa in ("0.02", "0.1", "0.3"):
            for order in (0, 1, 2):
                for start in ("0", "0.3"):

                    def ask(z0=z0, kappa=kappa, order=order, start=start, **o: Any) -> Any:
                        return sa.escape_time(
                            sa.friction(3, 1, z0), kappa, 10, start=start, method="uniform",
                            order=order, log=True, full=True, **o,
                        )  # fmt: skip

                    def arrays(z0=z0, kappa=kappa, order=order, start=start) -> Any:
                        return sa.escape_time(
                            sa.friction(3, 1, [float(z0)]), float(kappa), 10, start=float(start),
                            method="uniform", order=order, log=True, full=True,
                        )  # fmt: skip

                    name = f"uniform | z0={z0} k={kappa} start={start} | T | order {order}"
                    yield f"{name} | float", ask
                    yield f"{name} | array", arrays
                    if start == "0":
                        yield f"{name} | 40 digits", lambda ask=ask: ask(dps=40)


def _others() -> Iterator[Question]:
    yield from _expansion("strong_noise", "T C 1-P", [0, 4])
    yield from _expansion("paper", "T C P 1-P", [None])
    yield from _expansion("bound", "C 1-C", [None])
    for p in _kept("analytic"):
        for quantity, ask in _verbs(p).items():
            full = {"method": "auto", "rtol": 1e-4, "log": True, "full": True}
            yield f"auto | {p.name} | {quantity} | float", lambda ask=ask, o=full: ask(**o)
        scene = (p.kappa, p.r)
        yield (
            f"plan | {p.name}",
            lambda p=p, s=scene: str(sa.plan(p.make(), *s, start=p.start)),
        )
    for name in ("friction", "friction k=0.3", "linear sliding", "tanh", "hill", "on the fold"):
        p = BY_NAME[name]
        for method in ("step", "uniform"):
            yield (
                f"stokes | {name} | {method}",
                lambda p=p, m=method: sa.stokes_multiplier(p.make(), p.kappa, method=m),
            )


def _integrals() -> Iterator[Question]:
    for scene in INTEGRALS:
        for order in (1, 3, "optimal"):

            def ask(s=scene, n=order, **o: Any) -> Any:
                return sa.laplace_integral(s.f, s.g, "x", s.a, s.b, n).evaluate(50, full=True, **o)

            name = f"integral | {scene.name} | order {order}"
            yield f"{name} | float", ask
            yield f"{name} | 40 digits", lambda ask=ask: ask(dps=40)
    for z in ("1/2", "0.999999999999", "1", "1.01", "2"):
        for n in (0, 2):

            def bessel(z=z, n=n, **o: Any) -> Any:
                e = sa.uniform_integral(
                    "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=n
                )
                return e.bind(z=z).evaluate(60, dps=30, full=True)

            def gamma(z=z, n=n, **o: Any) -> Any:
                e = sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=n)
                return e.bind(mu=z).evaluate(60, dps=30, full=True)

            yield f"uniform integral | Bessel z={z} | order {n}", bessel
            yield f"uniform integral | gamma mu={z} | order {n}", gamma
    for c in ("-1/100", "0", "1/100", "1/2"):
        yield (
            f"uniform integral | iterated c={c}",
            lambda c=c: (
                sa.uniform_integral("c*x - x**3/3", ("1 + x/5", "cos(x)"), "x", "-2", "2", order=1)
                .bind(c=c)
                .evaluate(100, dps=30, full=True)
            ),
        )


_EMITTED = ("friction", "friction k=0.3", "friction k=1", "friction sliding", "linear repelling",
            "linear r=1/2", "friction from its well", "sine", "tanh", "hill", "quintic",
            "expression, cubic", "fold + 1e-15", "kink - 1e-15", "degree 12")  # fmt: skip


def _emitted() -> Iterator[Question]:
    methods: dict[str, tuple[str, dict[str, Any]]] = {
        "exact": ("log_Ttilde", {}),
    }
    for name in _EMITTED:
        p = BY_NAME[name]
        for target in ("c", "numpy"):
            for shown, (function, what) in methods.items():

                def ask(p=p, target=target, function=function, what=what) -> Any:
                    code = sa.emit("eq:Ttilde", target, drift=p.make(), **what).load()
                    numbers = (float(Fraction(p.kappa)), float(Fraction(p.r)))
                    return float(getattr(code, function)(*numbers))

                yield f"emitted | {name} | {shown} | {target}", ask


GROUPS: dict[str, Callable[[], Iterator[Question]]] = {
    "exact": _exact,
    "laplace": _laplace,
    "uniform": _uniform,
    "others": _others,
    "integrals": _integrals,
    "emitted": _emitted,
}
