"""The verb `expand` and what it returns: a formula by the text that gives the numbers.

Weak noise is `symasym.expansions.weak`, strong noise `symasym.expansions.strong_noise`, each run
over SymPy (`symasym.formulas.letters`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any, Literal, get_args

import sympy
from sympy import Expr, Symbol

from symasym.base.errors import InputError
from symasym.base.inputs import Number, Numbers, choice, count, exact
from symasym.drift.drift import Drift
from symasym.formulas import text
from symasym.formulas.cases import Case, U, case_for, found_cases, read_case
from symasym.formulas.letters import KAPPA, R
from symasym.formulas.numbers import numbers_of
from symasym.formulas.strong import strong, written_out
from symasym.formulas.uniform import uniform
from symasym.formulas.weak import Contribution, Leading, leading, weak
from symasym.quantities import escape_time, exit_probability, occupation
from symasym.scenes import require_drift

Expanded = Literal["T", "C", "1 - C", "P", "1 - P", "density"]
Noise = Literal["weak", "strong", "uniform"]
#: Those that depend on the start and the radius.
OF_START = ("T", "C", "1 - C")
_METHODS = {"weak": "laplace", "strong": "strong_noise", "uniform": "uniform"}
_MOST = 8


@dataclass(frozen=True, eq=False)
class Expansion:
    """The expansion of a quantity as a formula, as `expand` returns it.

    Attributes
    ----------
    formula, definitions : expression, dict
        The formula in symbols, and what each of these stands for: sums, series, heights,
        derivatives of V, critical points, and ``R1+, R2+, ...`` and ``R1-, ...``, the finite parts
        of int h_k du right and left of the start.
    equations : dict
        For each critical point without a closed form: A there, which is 0.
    terms : tuple of Contribution
        Of T; pairs of critical points, each with its exact coefficients.
    conditions : tuple of SymPy predicates
        Where the formula holds.
    integrals : dict
        The regular part as finite parts of h_k.
    """

    quantity: Expanded
    noise: Noise
    order: int
    drift: Drift
    start: Fraction
    case: Case
    formula: Expr
    definitions: Mapping[Symbol, Expr] = field(default_factory=dict)
    equations: Mapping[Symbol, Expr] = field(default_factory=dict)
    terms: tuple[Contribution, ...] = ()
    conditions: tuple[Any, ...] = ()
    integrals: Mapping[Symbol, Expr] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        # What the formula is made of, each condition once, and names that are told apart.
        known = {s: v for s, v in _met(self.formula, self.definitions).items() if v is not None}
        kept = dict.fromkeys(c for c in self.conditions if c is not sympy.true)
        object.__setattr__(self, "definitions", known)
        object.__setattr__(self, "conditions", tuple(kept))
        A, own = self.drift.expression(), {_bare(name) for name in self._names.values()}
        for s in sorted(A.free_symbols - {U}, key=str):
            if _bare(self._latex(s)) in own | {"T", "C", "P"}:
                raise InputError(
                    f"A = {A} has a parameter {s}, which the formula has as a name of its own; "
                    "rename the parameter."
                )

    @property
    def error(self) -> str:
        """The order of the terms that the formula leaves out."""
        power = 2 * self.order + 2
        if not self.definitions and not self.terms:
            return "none, of a constant drift"
        return {
            "weak": f"each series in kappa^2 is short of O(kappa^{power}), "
            "relative to its first term",
            "strong": f"relative O(kappa^-{power}), whatever r/kappa^2",
            "uniform": f"relative O(kappa^{power}), also where well and barrier coalesce",
        }[self.noise] + "; evaluate(…, full=True) tells it" * (self.quantity != "density")

    @property
    def numbers(self) -> dict[Symbol, Expr]:
        """Of a bound drift critical points, heights and the regular part, to 50 digits."""
        if self.drift.free or self.drift.shape or self.drift == Drift.general():
            return {}
        return numbers_of([*self.definitions, *self.equations], self.drift, self.start)

    @cached_property
    def expression(self) -> Expr:
        """The formula in kappa, r, the parameters, and u1, u2, ... where these are not solved."""
        whole = self.formula
        while whole.free_symbols & self.definitions.keys():
            whole = whole.xreplace(dict(self.definitions))
        return written_out(whole)

    @property
    def leading(self) -> Leading:
        """The one product of T that is exponentially larger than the others, in weak noise.

        Which it is depends on heights: of a bound drift on r alone, r -> oo being asked for; with
        free parameters it is that of the case's example. `Leading.conditions` say where it holds.
        """
        if self.noise != "weak" or self.quantity != "T":
            raise InputError(
                f"{self.quantity} in {self.noise} noise has no term that leads; T in weak has."
            )
        if Symbol("L", positive=True) not in self.definitions:  # one product, or a closed form
            return Leading(self.formula, self.conditions)
        return leading(self.drift, self.case, self.start)

    def cases(self) -> tuple[Case, ...]:
        """The cases that the drift has, each with parameters where it holds.

        They are found by trying values, and no proof that there are no others.
        """
        return found_cases(self.drift, self.start, self.quantity not in OF_START)

    def bind(self, /, **values: Numbers) -> Expansion:
        """The expansion with these parameters set, exactly, as `Drift.bind` sets them."""
        return expand(
            self.drift.bind(**values), self.quantity, noise=self.noise, order=self.order,
            start=self.start, case=self.case,
        )  # fmt: skip

    def evaluate(self, kappa: Numbers, r: Numbers | None = None, **options: Any) -> Any:
        """The number of a bound drift, by the function of the quantity and this order.

        It takes the options of `symasym.escape_time`, and has numbers also where `conditions` do
        not hold, such as r < 1; `expression` and emitted code have not. P needs no r.
        """
        if self.quantity == "density" or r is None and self.quantity in OF_START:
            raise InputError(
                f"{self.quantity} has no number of kappa alone; give r for T and C, and use "
                "sa.stationary_density for the density."
            )
        known = {"method": _METHODS[self.noise], "order": self.order, **options}
        known |= {"complement": self.quantity[0] == "1"} if self.quantity != "T" else {}
        if r is None or self.quantity[-1] == "P":
            return occupation(self.drift, kappa, **known)
        verb: Any = escape_time if self.quantity == "T" else exit_probability
        answer: Any = verb(self.drift, kappa, r, start=self.start, **known)
        return answer

    def emit(self, target: str = "numpy", name: str = "f") -> Any:
        """Source code of the formula, its free symbols being the arguments (`symasym.emit`)."""
        from symasym.emit import emit

        return emit(self, target, name=name)

    def functions(self, name: str = "f") -> Any:
        """What `symasym.emit` writes."""
        from symasym.emit.expansions import of_expansion

        return of_expansion(self, self.numbers, name)

    # -- as text ----------------------------------------------------------------------------

    def latex(self) -> str:
        """The formula in LaTeX, with a line for each symbol that it is made of.

        The regular part's integrals stand as Hadamard's finite parts, whose closed form for a
        polynomial is in `definitions`.
        """
        left, shown = "p_{ss}(y)" if self.quantity == "density" else self.quantity, self._shown
        first, *rows = (
            text.lines(name, sign, written_out(value), self._names)
            for name, sign, value in [(left, r"\sim", self.formula), *(
                (self._latex(s), "=", v) for s, v in shown.items() if v is not None)]
        )  # fmt: skip
        last = [f"0 &= {self._latex(a)}" for s, a in self.equations.items() if s in shown]
        if self.integrals.keys() & shown.keys():
            last.insert(0, r"h_1(u) &= \frac{1}{\phi(u)}, \quad h_{k+1} = -\frac{h_k'}{\phi}")
        return text.aligned(first, rows, last)

    @cached_property
    def _shown(self) -> dict[Symbol, Expr | None]:
        """What the symbols stand for as it is printed, the regular part as integrals."""
        return _met(self.formula, {**self.definitions, **self.integrals})

    @cached_property
    def _names(self) -> dict[str, str]:
        """LaTeX of the symbols that are the formula's, not the drift's."""
        met = {*self._shown, *_met(self.formula, self.definitions), KAPPA, R}
        own = (met - self.drift.expression().free_symbols) | {U}
        return {s.name: text.name_of(s.name) or text.latex(s, {}) for s in own}

    def _latex(self, e: Expr) -> str:
        return text.latex(e, self._names)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def __str__(self) -> str:
        """The formula, a line for each contribution and each symbol, and where it holds."""
        case = "" if self.noise == "strong" else f", case '{self.case}'"
        rows = [
            f"{self.quantity} of {self.drift!r}, {self.noise} noise to order {self.order}{case}",
            f"  {self.quantity} ~ {written_out(self.formula)}",
        ]
        if self.terms and self.definitions:
            rows.append("contributions of pairs of critical points, times C or 1 - C")
            rows += [f"  ({t.weight}) {t.pair[0]}, {t.pair[1]}: {t.expression}" for t in self.terms]
        shown = {s: v for s, v in self._shown.items() if v is not None}
        rows += ["with", *(f"  {s} = {value}" for s, value in shown.items())] if shown else []
        if self.integrals.keys() & shown.keys():
            rows.append("  FinitePart: Hadamard's finite part, h1 = 1/phi, h2 = -h1'/phi, ...")
        where = ", ".join(f"{c.lhs} {c.rel_op} {c.rhs}" for c in self.conditions)
        return "\n".join([*rows, "where", f"  {where}", "error", f"  {self.error}"])

    __repr__ = __str__


def _bare(latex: str) -> str:
    """LaTeX without braces and what stands in parentheses."""
    return re.sub(r"[{}]|\(.*", "", latex)


def _met(formula: Expr, known: Mapping[Symbol, Expr]) -> dict[Symbol, Expr | None]:
    """The symbols of a formula in the order in which they are met, and what they stand for."""
    met: dict[Symbol, Expr | None] = {}
    row: set[Symbol] = formula.free_symbols
    while row:
        met |= {s: known.get(s) for s in sorted(row, key=str)}
        row = set().union(*(known[s].free_symbols for s in row if s in known)) - met.keys()
    return met


def expand(
    drift: Drift,
    quantity: Expanded = "T",
    *,
    noise: Noise = "weak",
    order: int | None = None,
    start: Number = 0,
    case: str | Case | None = None,
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
        through the coalescence of a well and a barrier, in Airy functions.
    order : int, optional
        0 to 8, 2 if left out: the terms of each series in kappa^2 up to kappa^(2 N), or of
        2/kappa^2; 0 for ``noise="uniform"``.
    start : number, optional
        Also on a simple zero of A, or outside the layer; for ``noise="uniform"`` inside.
    case : str, optional
        The wells, barriers and the start from left to right, such as ``"start well barrier"``, or
        ``"start=well barrier"`` of a start on the well; for P and the density ``"well"`` or the
        like. For a bound drift it is found; else it is the first of `Expansion.cases`.

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
    quantity = choice("quantity", quantity, get_args(Expanded))
    noise = choice("noise", noise, get_args(Noise))
    order = count("order", (noise != "uniform") * 2 if order is None else order, 0, _MOST)
    at = exact("start", start) if quantity in OF_START else Fraction(-1)  # V is measured from there
    if isinstance(case, str) and quantity not in OF_START and "start" not in case:
        case = f"start {case}"
    asked = None if case is None else read_case(case)
    of_time = noise == "uniform" and (quantity, order) == ("T", 0)
    if not of_time and (noise == "uniform" or (noise, quantity) == ("strong", "density")):
        raise InputError(
            f"quantity is {quantity!r} and order {order}; the formula for {noise} noise is that of "
            f"{'T to order 0' if noise == 'uniform' else 'T, C and P'}."
        )
    return _expanded(drift, quantity, noise, order, at, asked)


@lru_cache(maxsize=32)
def _expanded(
    drift: Drift, quantity: Expanded, noise: Noise, order: int, start: Fraction, case: Case | None
) -> Expansion:
    if noise == "uniform":
        found = uniform(drift, start, case)
    elif noise == "strong":
        found = strong(drift, quantity, order, start)
    else:
        own = case_for(drift, start, case, quantity not in OF_START)
        found = weak(drift, quantity, order, start, own)
    return Expansion(quantity, noise, order, drift, start, **found)
