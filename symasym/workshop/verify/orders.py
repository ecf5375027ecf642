"""Orders of convergence: the error of N terms falls as fast as the next term does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import symasym as sa
from symasym.base.contexts import mpf_of
from symasym.workshop.comparing import relative
from symasym.workshop.verify.findings import LABELS, Finding, failed

#: How much an observed order may fall short of the stated one.
SHORTFALL = 0.25
_DPS = 50


class Family(NamedTuple):
    """A drift with radius and start; the noise is varied."""

    name: str
    make: Callable[[], sa.Drift]
    r: str
    start: str
    kappas: tuple[str, str]
    quantities: tuple[str, ...]
    methods: tuple[str, ...]


def _friction(z0: str) -> Callable[[], sa.Drift]:
    """The friction drift, made when it is asked for."""
    return lambda: sa.friction(3, 1, z0)


# Far enough into the limit that the next term rules the error, and a factor 2 apart.
_WEAK, _MILD, _STRONG = ("1/320", "1/640"), ("1/20", "1/40"), ("40", "80")
_ALL, _ESCAPE = ("T", "C", "1-C", "P", "1-P"), ("T", "C", "1-C")

FAMILIES = (
    Family("friction, well", _friction("-0.4"), "4", "0", _WEAK, ("T", "C"), ("laplace", "paper")),
    Family("friction, well, uniform", _friction("-0.4"), "4", "0", _WEAK, ("T",), ("uniform",)),
    Family("friction, well, from outside", _friction("-0.4"), "4", "-2", _WEAK, ("T", "C"),
           ("laplace",)),
    Family("friction, from the well", _friction("-0.4"), "4", "0.35", _WEAK, ("T",), ("laplace",)),
    Family("friction past the fold", _friction("-1.5"), "4", "0", _WEAK, ("T", "C"), ("laplace",)),
    Family("friction down", _friction("3"), "4", "1/4", _WEAK, ("T", "1-C"), ("laplace",)),
    Family("tanh sliding", lambda: sa.tanh(1, "-1/2", 3), "2", "1/5", _MILD, ("T", "1-P"),
           ("laplace",)),
    Family("linear repelling", lambda: sa.linear(-1, 2), "3", "-1/8", _WEAK, ("T", "1-C"),
           ("laplace",)),
    Family("friction, strong", _friction("-0.4"), "4", "1/2", _STRONG, _ESCAPE,
           ("strong_noise",)),
    Family("sine sliding, strong", lambda: sa.sine(1, "-1/2", 2, waves=1), "3", "-1/2", _STRONG,
           _ALL, ("strong_noise",)),
    Family("linear repelling, strong", lambda: sa.linear(-1, 2), "1/2", "0", _STRONG, _ESCAPE,
           ("strong_noise",)),
    Family("linear sliding, strong", lambda: sa.linear(1, "-1/2"), "3", "0", _STRONG, ("P",),
           ("paper",)),
)  # fmt: skip
BY_NAME = {family.name: family for family in FAMILIES}


def order(name: str, full: bool) -> Iterator[Finding]:
    """Observed order in kappa over the stated one, method by method."""
    family = BY_NAME[name]
    for method in family.methods:
        if method == "paper":
            yield from _paper(family)
            continue
        for n in (0, 1, 2, 3, 5) if full else (0, 2):
            for quantity in family.quantities:
                # In 1/lam = kappa^2/2 or lam = 2/kappa^2: one more power than was kept.
                yield from _observed(family, quantity, method, {"order": n}, 2 * n + 2)


def _paper(family: Family) -> Iterator[Finding]:
    """Findings on the paper's own formulas."""
    if "P" in family.quantities:
        # P itself is O(kappa^-2), what follows O(kappa^-4).
        yield from _observed(family, "P", "paper", {}, 2, "eq:Plarge2")
    else:
        yield from _observed(family, "T", "paper", {}, 2, "eq:Ttildesmall")


def _observed(
    family: Family,
    quantity: str,
    method: str,
    setting: dict[str, Any],
    stated: int,
    formula: str = "",
) -> Iterator[Finding]:
    """The finding that the error of a method falls with the stated power of kappa."""
    formula = formula or LABELS[quantity]
    shown = "".join(f", {name} {value}" for name, value in setting.items())
    where = f"{family.name}, {quantity}{shown}"
    errors = []
    for kappa in family.kappas:
        ask = _question(family, quantity, kappa)
        try:
            value = ask(method=method, dps=_DPS, **setting)
        except sa.SymasymError as error:
            yield failed(formula, method, "order", where, error)
            return
        errors.append(relative(value, ask(dps=_DPS)))
    yield shortfall(formula, method, where, errors, stated, family.kappas)


def _question(family: Family, quantity: str, kappa: str) -> Callable[..., Any]:
    """A quantity of the family at one noise, as a function of the options."""
    drift = family.make()
    if quantity in ("P", "1-P"):
        return lambda **o: sa.occupation(drift, kappa, complement=quantity == "1-P", **o)
    if quantity == "T":
        return lambda **o: sa.escape_time(drift, kappa, family.r, start=family.start, **o)
    return lambda **o: sa.exit_probability(
        drift, kappa, family.r, start=family.start, complement=quantity == "1-C", **o
    )


def shortfall(
    formula: str,
    method: str,
    where: str,
    errors: list[Any],
    stated: float,
    kappas: tuple[str, str],
) -> Finding:
    """The finding that errors at two noises fall with at least the stated power of kappa."""
    from mpmath import log, mp, mpf

    first, second = (mpf(e._mpf_) if hasattr(e, "_mpf_") else mpf(e) for e in errors)
    # Where the series ends the error is exponentially small, or 0: any order is met.
    if max(first, second) < mpf(10) ** (8 - _DPS):
        return Finding(formula, method, "order", 0.0, where)
    ratio = Fraction(kappas[0]) / Fraction(kappas[1])
    observed = float("inf")
    if first and second:
        # Towards the limit: smaller kappa for weak noise, larger for strong.
        observed = abs(float(log(mpf_of(ratio, mp))))
        observed = float(log(first / second)) / observed
    size = max(0.0, (stated - observed) / SHORTFALL)
    detail = "" if size <= 1 else f"order {observed:.3g} in kappa, where {stated} is stated"
    return Finding(formula, method, "order", size, where, detail)
