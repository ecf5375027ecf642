"""The verb `expand`: which case, which noise, and the formula by the text that gives the numbers.

Weak noise is `symasym.expansions.weak`, strong noise `symasym.expansions.strong`, each run over
SymPy (`symasym.formulas.letters`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any, get_args

import sympy
from sympy import Expr, S, Symbol

from symasym.base.call_context import symbolic
from symasym.base.errors import InputError
from symasym.base.inputs import Number, choice, count, exact, require_printable
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.formulas.cases import Case, case_of, found_cases, read_case, slides
from symasym.formulas.formula import OF_START, Contribution, Expanded, Expansion, Noise
from symasym.formulas.letters import KAPPA, LAM, Field, Letters, R, Terms, U, X, joined
from symasym.formulas.strong import strong
from symasym.formulas.uniform import NAMES, uniform
from symasym.scenes import require_drift

__all__ = ["expand"]

_MOST = 8
_Y = Symbol("y", real=True)


@symbolic
def expand(
    drift: Drift,
    quantity: Expanded = "T",
    *,
    noise: Noise = "weak",
    order: int | None = None,
    start: Number = 0,
    case: str | Case | None = None,
    patience: float | None = None,
) -> Expansion:
    """The expansion of a quantity as a formula in the drift's parameters.

    Parameters
    ----------
    drift : Drift
        Its parameters may be free. ``Drift.general()`` names none: the formula of T is then that
        of one well and one barrier, in V's derivatives there.
    quantity : {"T", "C", "1 - C", "P", "1 - P", "density"}
    noise : {"weak", "strong", "uniform"}
        kappa -> 0; kappa -> oo, of a polynomial A, in powers of 2/kappa^2; or kappa -> 0 for T
        through the coalescence of a well and a barrier, in Airy functions, of a cubic A or any
        bound drift.
    order : int, optional
        0 to 8, 2 if left out: the terms of each series in kappa^2 up to kappa^(2 N), or of
        2/kappa^2; 0 for ``noise="uniform"``.
    start : number, optional
        Also on a simple zero of A, or outside the layer; for ``noise="uniform"`` inside.
    case : str, optional
        The wells, barriers and the start from left to right, such as ``"start well barrier"``; for
        P and the density ``"well"`` or the like. For a bound drift it is found; else it is the
        first of `Expansion.cases`.
        ``"start=well barrier"`` is that of a start on the well.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    Expansion

    Raises
    ------
    InputError
        For an unknown quantity or noise, an order out of range, a case that the drift is not in,
        a double zero of A, or a parameter with a name that the formula needs.

    Notes
    -----
    The text is that of ``method="laplace"`` and ``method="strong_noise"``, so that with numbers
    put in the expression is `escape_time(…, method="laplace", order=order)`. r > 1 is assumed.

    Examples
    --------
    >>> import symasym as sa
    >>> e = sa.expand(sa.Drift.general(), "T", order=1)
    >>> e.terms[0].coefficients[1]
    5*V'''(u1)**2/(48*V''(u1)**3) - 5*V'''(u2)**2/(48*V''(u2)**3) + V^(4)(u2)/(16*V''(u2)**2) \
- V^(4)(u1)/(16*V''(u1)**2)
    """
    require_drift(drift, bound=False)
    require_printable({**drift.values, "start": start})
    quantity = choice("quantity", quantity, get_args(Expanded))
    noise = choice("noise", noise, get_args(Noise))
    if order is None:
        order = 0 if noise == "uniform" else 2
    order = count("order", order, 0, _MOST)
    at = exact("start", start)
    if quantity not in OF_START:
        at = Fraction(-1)  # V is measured from there.
        if isinstance(case, str) and "start" not in case:
            case = f"start {case}"
    if noise == "strong":
        if quantity == "density":
            raise InputError("quantity is 'density', which has a formula for weak noise only.")
        return _strong(drift, quantity, order, at)
    if noise == "uniform":
        own, formula, known, where = uniform(drift, quantity, order, at, case)
        return Expansion(
            quantity, noise, order, drift, at, own, formula, known, conditions=where, tex=NAMES,
            verb=expand,
        )._with_own_names()  # fmt: skip
    return _weak(drift, quantity, order, at, _case(drift, at, case, quantity))


def _case(drift: Drift, start: Fraction, case: str | Case | None, quantity: str) -> Case:
    """The case asked for, or found."""
    general, sliding = drift == Drift.general(), quantity not in OF_START
    asked = None if case is None else read_case(case)
    if general and sliding:
        raise InputError(
            f"{quantity} is that of a sliding block, and Drift.general() has one well and one "
            "barrier; name a drift."
        )
    if general and asked and sorted(asked.kinds) != ["barrier", "well"]:
        raise InputError(
            f"case is {str(asked)!r}, and Drift.general() has one well and one barrier; give "
            "'start well barrier' or 'barrier well start', or name a drift."
        )
    if general or drift.shape:
        own = asked or read_case("start well" if sliding else "start well barrier")
    elif drift.free and asked is None:
        cases = found_cases(drift, start, sliding)
        if not cases:
            raise InputError(
                f"no values that were tried for {', '.join(drift.free)} give A = "
                f"{drift.expression()} simple zeros alone, none at the start or an end"
                f"{', and wells outermost, as a sliding block has' * sliding}; give the case, "
                f"as in case={'well' if sliding else 'start well barrier'!r}, or "
                "where zeros coincide take numbers of "
                f"sa.{'occupation' if sliding else 'escape_time'}(method='uniform')."
            )
        own = cases[0]
    else:
        own = asked if drift.free and asked else case_of(drift, start)
    if asked is not None and asked != own:
        raise InputError(
            f"the expansion is for the case '{asked}', and {drift!r} is in the case '{own}'; "
            f"ask for that one with case='{own}'."
        )
    if sliding and not slides(own.kinds):
        raise InputError(
            f"case is '{' '.join(own.kinds)}'; {quantity} is that of a sliding block, whose "
            "outermost points are wells: give case='well', 'well barrier well' or the like."
        )
    return own


def radius_condition(start: Any) -> Any:
    """The condition that the radius is beyond the layer and the start."""
    return sympy.Gt(R, max(S.One, abs(sympy.sympify(start))))


# -- strong noise ----------------------------------------------------------------------------------


@lru_cache(maxsize=32)
def _strong(drift: Drift, quantity: Expanded, order: int, start: Fraction) -> Expansion:
    """The strong-noise expansion, the same in every case."""
    if drift == Drift.general():
        raise InputError("Drift.general() has no moments; name a drift for noise='strong'.")
    formula, values, tex = strong(drift, quantity, order, start)
    where: list[Any] = [sympy.Ne(drift.expression().subs(U, side), 0) for side in (-1, 1)]
    if quantity in OF_START:
        where.append(radius_condition(start))
    return Expansion(
        quantity, "strong", order, drift, start, Case(("start",)), formula,
        {**values, LAM: 2 / KAPPA**2}, tex=tex, verb=expand,
        conditions=tuple(c for c in dict.fromkeys(where) if c is not sympy.true),
    )._with_own_names()  # fmt: skip


# -- weak noise ------------------------------------------------------------------------------------


@lru_cache(maxsize=32)
def _weak(drift: Drift, quantity: Expanded, order: int, start: Fraction, case: Case) -> Expansion:
    """The weak-noise expansion."""
    field = Field(drift, case, start)
    conditions = tuple(
        c for c in dict.fromkeys(_conditions(field, quantity)) if c is not sympy.true
    )
    if not field.A.has(U) and quantity in OF_START and not start:
        return Expansion(
            quantity, "weak", order, drift, start, case, _of_constant(field.A, quantity), {},
            conditions=conditions, verb=expand,
        )._with_own_names()  # fmt: skip
    at, terms = Terms(field), tuple[Contribution, ...]()
    points = weak.points_of(field, order + 1, Letters)
    if quantity == "T":
        regular = field.regular(order + 1)
        formula = weak.escape_time(points, regular, at)
        terms = tuple(_contributions(weak.shares(points, regular, at), at, points, order))
    elif quantity in OF_START:
        formula = weak.exit_probability(points, at, quantity != "C")
    else:
        line = [p for p in points if p.kind != "end"]
        if quantity == "density":
            whole = weak.Sums(line, -1, at).total()
            formula = sympy.exp(-LAM * field.height(_Y)) / at.named("S", whole)
        else:
            slopes = field.slopes[-1], field.slopes[1]
            formula = weak.outside_layer(line, slopes, at)
            # The drift points to the layer.
            formula = formula.xreplace({abs(slopes[0]): slopes[0], abs(slopes[1]): -slopes[1]})
            formula = 1 - formula if quantity == "P" else formula
    if field.general and quantity == "T":
        pairs = [t for t in terms if t.pair[0][:4] == "well" and t.pair[1][:7] == "barrier"]
        if len(pairs) != 1:
            raise InputError(
                f"case is {str(case)!r}, without one pair of a well and a barrier; give "
                "'start well barrier' or 'barrier well start'."
            )
        terms, formula, at.sums = (pairs[0],), pairs[0].expression, {}
    series = {s: row.expression for s, row in at.rows.items()}
    known = {**at.sums, **series, **field.values, LAM: 2 / KAPPA**2, X: KAPPA**2 / 2}
    return Expansion(
        quantity, "weak", order, drift, start, case, formula, known, field.equations, terms,
        conditions, field.integrals, tex=field.tex, rows=at.rows, sums=tuple(at.sums),
        verb=expand,
    )._with_own_names()  # fmt: skip


def _of_constant(A: Expr, quantity: str) -> Expr:
    """T, C or 1 - C of a constant drift from 0, in closed form (constant-drift)."""
    if quantity == "T":
        return R / A * sympy.tanh(A * R / KAPPA**2)
    # In the mirror both ends change places.
    return 1 / (1 + sympy.exp(2 * (-A if quantity == "1 - C" else A) * R / KAPPA**2))


def _contributions(
    of: weak.Shares, at: Terms, points: list[weak.Point], order: int
) -> Iterator[Contribution]:
    """The products of T's critical points."""
    for weight, side in zip(("C", "1 - C"), of.sides, strict=True):
        for pair, value in side:
            if pair:
                yield _contribution(pair, value, weight, at, order)
    if (own := points[weak.start_of(points)]) and of.own.__class__ is not int:
        sums = weak.Sums(points, 1, at)
        for p, value in zip(points, sums.whole, strict=True):
            if value.__class__ is not int:
                yield _contribution((own, p), of.own * value, "C (1 - C)", at, order)


def _contribution(
    pair: tuple[weak.Point, ...], value: Expr, weight: str, at: Terms, order: int
) -> Contribution:
    """That of one product of two series with an exponential."""
    front, exponent, rows = LAM, S.Zero, list[tuple[Expr, ...]]()
    value = joined(value)
    for factor in sympy.Mul.make_args(value):
        if isinstance(factor, sympy.exp):
            exponent = factor.args[0]
            continue
        if factor in at.rows:
            # Of a kink the first terms of both sides cancel.
            row = at.rows[factor]
            m = next(n for n, c in enumerate(row.c) if c != 0)
            front *= row.front * row.c[m] * X**m
            rows.append(tuple(sympy.expand(c / row.c[m]) for c in row.c[m:]))
        else:
            front *= factor
    product: list[Expr] = [S.One, *[S.Zero] * order]
    for c in rows:
        row_of = (*c, *[S.Zero] * order)
        product = [
            sympy.expand(sympy.Add(*(product[i] * row_of[n - i] for i in range(n + 1))))
            for n in range(order + 1)
        ]
    halved = tuple(sympy.expand(p / 2**n) for n, p in enumerate(product))
    put = {LAM: 2 / KAPPA**2, X: KAPPA**2 / 2}
    return Contribution(
        (_called(pair[0]), _called(pair[1])), exponent.xreplace(put),
        sympy.powdenest(front.xreplace(put), force=True), halved, weight,
    )  # fmt: skip


def _called(p: weak.Point) -> str:
    kind = p.kind.removeprefix("start=")
    return f"{kind} {p.u}" if str(p.u).startswith("u") else f"{kind} u = {p.u}"


def _conditions(field: Field, quantity: str) -> Iterator[Any]:
    """Where the formula holds, as predicates."""
    inside = [u for u, kind in field.places if kind not in ("end", "kink") and abs(u) != 1
              and not (u.is_number and abs(u) > 1)]  # fmt: skip
    points = [-S.One, *(u for u in inside if u != field.start or quantity in OF_START), S.One]
    if quantity in OF_START and not field.general:
        yield radius_condition(field.start)
    yield from (a < b for a, b in itertools.pairwise(points) if (a < b) is not sympy.true)
    for u in field.zeros:
        yield sympy.Eq(sympy.Function("A")(u) if field.general else field.A.subs(U, u), 0)
    if field.general:
        well, barrier = sorted(field.zeros, key=lambda u: field.kind(u) == "barrier")
        yield sympy.Gt(field.height(barrier), field.height(well))
        return
    if field.poly is not None and field.poly.degree():
        yield sympy.Ne(field.poly.LC(), 0)
    ends = field.A.subs(U, -1), field.A.subs(U, 1)
    if quantity not in OF_START:
        yield from (sympy.Gt(ends[0], 0), sympy.Lt(ends[1], 0))
        return
    yield from (sympy.Ne(a, 0) for a in ends)
    if kind := field.case.at_start:
        slope = sympy.diff(field.A, U).subs(U, field.start)
        yield sympy.Gt(slope, 0) if kind == "barrier" else sympy.Lt(slope, 0)
    elif abs(field.start) < 1:
        yield sympy.Ne(field.A.subs(U, field.start), 0)
