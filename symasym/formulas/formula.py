"""`Expansion`: a formula with what its symbols stand for, as numbers, code and text."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal, Self

import sympy
from sympy import Expr, S, Symbol

from symasym.base.call_context import limited, step, symbolic, watched
from symasym.base.errors import InputError
from symasym.base.estimate import Answer
from symasym.base.inputs import Numbers, shown
from symasym.derivation.tex import tex
from symasym.drift.drift import Drift
from symasym.formulas.cases import Case, found_cases
from symasym.formulas.leading import Leading, leading
from symasym.formulas.letters import KAPPA, LAM, FinitePart, R, Row, U, X
from symasym.formulas.numbers import numbers_of
from symasym.formulas.strong import written_out
from symasym.quantities import escape_time, exit_probability, occupation

__all__ = ["OF_START", "Contribution", "Expanded", "Expansion", "Noise"]

Expanded = Literal["T", "C", "1 - C", "P", "1 - P", "density"]
Noise = Literal["weak", "strong", "uniform"]
#: Those that depend on the start and the radius.
OF_START = ("T", "C", "1 - C")
# Characters on a line of LaTeX, as `_width` counts them: A4 in the smallest type.
_WIDE = 134
# Operations in a rational function that is worth reducing.
_FEW = 40


@dataclass(frozen=True)
class Contribution:
    """One product of a critical point of e^{-lam V} with one of e^{lam V}.

    It adds weight * front * e^{exponent} (c_0 + c_1 kappa^2 + c_2 kappa^4 + ...) to T.

    Attributes
    ----------
    pair : tuple of str
        The two points, such as ``("well u1", "barrier u2")``.
    exponent, front : expression
    coefficients : tuple of expressions
        c_0 = 1, c_1, ..., exact in V's derivatives at the two points.
    weight : str
        ``"1 - C"`` right of the start, ``"C"`` left of it; ``"C (1 - C)"`` of a start on a well.
    """

    pair: tuple[str, str]
    exponent: Expr
    front: Expr
    coefficients: tuple[Expr, ...]
    weight: str

    @property
    def expression(self) -> Expr:
        """The contribution without its weight."""
        series = sum((c * KAPPA ** (2 * n) for n, c in enumerate(self.coefficients)), S.Zero)
        return self.front * sympy.exp(self.exponent) * series


@dataclass(frozen=True, eq=False)
class Expansion:
    """The expansion of a quantity as a formula, as `expand` returns it.

    Attributes
    ----------
    quantity, noise, order, drift, start, case
        As `expand` takes them.
    formula : expression
        In the symbols of `definitions`.
    definitions : dict
        What each symbol stands for: sums, series, heights, derivatives of V, critical points.
        ``R1+, R2+, ...`` and ``R1-, ...`` are the finite parts of int h_k du right and left of the
        start.
    equations : dict
        For each critical point without a closed form: A there, which is 0.
    terms : tuple of Contribution
        Of T; pairs of critical points, each with its exact coefficients.
    conditions : tuple of SymPy predicates
        Where the formula holds.
    integrals, tex, rows, sums, verb
        The regular part as finite parts of h_k; the symbols' LaTeX; the series; the sums of
        exponentials; `expand`.
    """

    quantity: Expanded
    noise: Noise
    order: int
    drift: Drift
    start: Fraction
    case: Case
    formula: Expr
    definitions: dict[Symbol, Expr]
    equations: dict[Symbol, Expr] = field(default_factory=dict)
    terms: tuple[Contribution, ...] = ()
    conditions: tuple[Any, ...] = ()
    integrals: Mapping[Symbol, Expr] = field(default_factory=dict, repr=False)
    tex: Mapping[Symbol, str] = field(default_factory=dict, repr=False)
    rows: Mapping[Symbol, Row] = field(default_factory=dict, repr=False)
    sums: tuple[Symbol, ...] = field(default=(), repr=False)
    verb: Callable[..., Any] = field(default=dict, repr=False)

    def __post_init__(self) -> None:
        # What the formula is made of, and no more.
        met = self._met({})
        object.__setattr__(
            self, "definitions", {s: v for s, v in self.definitions.items() if s in met}
        )

    @property
    def error(self) -> str:
        """The order of the terms that the formula leaves out."""
        power, numbers = 2 * self.order + 2, "; evaluate(…, full=True) tells it"
        if not self.definitions and not self.terms:
            return "none, of a constant drift"
        if self.noise == "strong":
            return f"relative O(kappa^-{power}), whatever r/kappa^2{numbers}"
        if self.noise == "uniform":
            return f"relative O(kappa^{power}), also where well and barrier coalesce{numbers}"
        series = f"each series in kappa^2 is short of O(kappa^{power}), relative to its first term"
        return series if self.quantity == "density" else series + numbers

    @cached_property
    def expression(self) -> Expr:
        """The formula in kappa, r, the parameters, and u1, u2, ... where these are not solved."""
        return self.put_in(written_out(self.formula))

    def put_in(self, expression: Expr) -> Expr:
        """An expression with the definitions put in."""
        if not isinstance(expression, sympy.Basic):
            raise InputError(f"expression is {shown(expression)}; give a SymPy expression.")
        values = self.nested
        with limited(way_out="use formula and definitions, which are shorter"), watched():
            while known := expression.free_symbols & values.keys():
                expression = expression.xreplace({s: values[s] for s in known})
            return expression

    @cached_property
    def nested(self) -> dict[Symbol, Expr]:
        """The definitions as they are computed, series by Horner's rule."""
        nested = {s: row.nested for s, row in self.rows.items() if s in self.definitions}
        return self.definitions | nested

    @property
    def leading(self) -> Leading:
        """The one product of T that is exponentially larger than the others, in weak noise.

        Which it is depends on heights: of a bound drift on r alone, r -> oo being asked for; with
        free parameters it is that of the case's example. `Leading.conditions` say where it holds.
        """
        return leading(self)

    @symbolic
    def cases(self, *, patience: float | None = None) -> tuple[Case, ...]:
        """The cases that the drift has, each with parameters where it holds.

        They are found by trying values, and no proof that there are no others.
        """
        return found_cases(self.drift, self.start, self.quantity not in OF_START)

    # -- numbers ----------------------------------------------------------------------------

    def bind(self, /, **values: Numbers) -> Expansion:
        """The expansion with these parameters set, exactly, as `Drift.bind` sets them."""
        made: Expansion = self.verb(
            self.drift.bind(**values), self.quantity, noise=self.noise, order=self.order,
            start=self.start, case=self.case,
        )  # fmt: skip
        return made

    def evaluate(self, kappa: Numbers, r: Numbers | None = None, **options: Any) -> Answer:
        """The number of a bound drift, by the function of the quantity and this order.

        It takes the options of `symasym.escape_time`, and has numbers also where `conditions` do
        not hold, such as r < 1; `expression` and emitted code have not. P needs no r.
        """
        method = {"weak": "laplace", "strong": "strong_noise"}.get(self.noise, self.noise)
        known: dict[str, Any] = {"method": method, "order": self.order, **options}
        if self.quantity == "density":
            raise InputError("the density's numbers are those of sa.stationary_density.")
        if self.quantity[-1] == "P":
            known["complement"] = self.quantity != "P"
            return occupation(self.drift, kappa, **known)
        if r is None:
            raise InputError(f"{self.quantity} needs a radius; give r.")
        if self.quantity == "T":
            return escape_time(self.drift, kappa, r, start=self.start, **known)
        known["complement"] = self.quantity != "C"
        return exit_probability(self.drift, kappa, r, start=self.start, **known)

    def functions(self, name: str = "f") -> Any:
        """The formula as functions to emit (`symasym.emit.Function`)."""
        from symasym.emit.expansions import of_expansion

        return of_expansion(self, numbers_of(self), name)

    def emit(self, target: str = "numpy", name: str = "f") -> Any:
        """Source code of the formula, its free symbols being the arguments (`symasym.emit`).

        Of a drift with free parameters critical points without a closed form are arguments, too,
        where A is a polynomial; of a bound one they and the regular part are numbers. There is
        ``log_NAME`` as well, finite where T is not, but for ``noise="uniform"``.
        """
        from symasym.emit import emit

        return emit(self, target, name=name)

    # -- as text ----------------------------------------------------------------------------

    @symbolic
    def latex(self, *, patience: float | None = None) -> str:
        """The formula in LaTeX, with a line for each symbol that it is made of.

        The regular part's integrals stand as Hadamard's finite parts, whose closed form for a
        polynomial is in `definitions`.
        """
        left = "p_{ss}(y)" if self.quantity == "density" else self.quantity
        rows, met = self._rows(left, r"\sim", written_out(self.formula)), self._met(self.integrals)
        made: dict[tuple[str, ...], None] = {}
        for s in met:
            if s in self.definitions:
                value = self.integrals.get(s, self.definitions[s])
                if self._latex(value) != self._latex(s):  # else a parameter of that name
                    made[tuple(self._rows(self._latex(s), "=", value))] = None
        # Short ones share a line.
        shared: list[str] = []
        for row, *more in made:
            if more or _width(row) > _WIDE / 2:
                rows += [row, *more]
                continue
            if _width("".join(shared) + row) + 4 * len(shared) > _WIDE:
                rows.append(_joined(shared))
                shared = []
            shared.append(row)
        rows += [_joined(shared)] if shared else []
        if self.integrals.keys() & met.keys():
            rows.append(r"h_1(u) &= \frac{1}{\phi(u)}, \quad h_{k+1} = -\frac{h_k'}{\phi}")
        rows += [f"0 &= {self._latex(a)}" for s, a in self.equations.items() if s in met]
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    def _rows(self, left: str, relation: str, value: Expr) -> list[str]:
        """The definition in as many lines as it needs, a sum broken between its terms."""
        whole = f"{left} &{relation} {_bare(self._latex(value))}"
        if _width(whole) <= _WIDE or not value.is_Add:
            return [whole]
        rows = [f"{left} &{relation} "]
        for k, term in enumerate(value.as_ordered_terms()):
            text = self._latex(term)
            sign = "" if text.startswith("-") or not k else "+ "
            if _width(rows[-1] + text) > _WIDE:
                rows.append(r"&\quad ")
            rows[-1] += f"{sign}{text} "
        return [row.rstrip() for row in rows]

    def _met(self, closed: Mapping[Symbol, Any]) -> dict[Symbol, None]:
        """The symbols of the formula as they are met, not those that `closed` are made of."""
        met: dict[Symbol, None] = {}
        row: set[Symbol] = self.formula.free_symbols
        while row:
            met |= dict.fromkeys(sorted(row, key=str))
            known = (s for s in row if s in self.definitions and s not in closed)
            row = set().union(*(self.definitions[s].free_symbols for s in known)) - met.keys()
        return met

    def _latex(self, e: Any) -> str:
        step()
        return tex(_shortest(e), self.tex)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def __str__(self) -> str:
        """The formula, a line for each contribution and each symbol, and where it holds."""
        case = "" if self.noise == "strong" else f", case '{self.case}'"
        rows = [
            f"{self.quantity} of {self.drift!r}, {self.noise} noise to order {self.order}{case}",
            f"  {self.quantity} ~ {written_out(self.formula)}",
        ]
        if self.definitions and self.formula not in [t.expression for t in self.terms]:
            if self.terms:
                rows.append("contributions of pairs of critical points, times C or 1 - C")
            rows += [f"  ({t.weight}) {t.pair[0]}, {t.pair[1]}: {t.expression}" for t in self.terms]
            rows.append("with")
            met = (s for s in self._met(self.integrals) if s in self.definitions)
            shown = {s: self.integrals.get(s, self.definitions[s]) for s in met}
            rows += [f"  {s} = {value}" for s, value in shown.items()]
            if any(isinstance(value, FinitePart) for value in shown.values()):
                rows.append(
                    "  FinitePart(h, u, a, b): Hadamard's finite part of int_a^b h du, "
                    "h1 = 1/phi, h2 = -h1'/phi, ..."
                )
        rows += ["where", "  " + ", ".join(_predicate(c) for c in self.conditions)]
        return "\n".join([*rows, "error", f"  {self.error}"])

    __repr__ = __str__

    def _with_own_names(self) -> Self:
        """The expansion, if no parameter of the drift reads as a symbol of the formula."""
        parameters = self.drift.expression().free_symbols - {U}
        values = [self.formula, *self.definitions.values(), *self.integrals.values()]
        own = {KAPPA, R, U, LAM, X, *self.definitions}
        own |= set().union(*(v.free_symbols for v in values)) - parameters
        names = set(re.findall(r"[A-Za-z]\w*", " ".join([self.quantity, "C", *map(str, own)])))
        constants = set().union(*(v.atoms(sympy.NumberSymbol) for v in values))
        in_tex = {_head(self._latex(s)): s for s in {*own, *constants}}
        for s in sorted(parameters, key=str):
            text = _head(self._latex(s))
            same = s.name not in names and sympy.simplify(
                self.definitions.get(in_tex.get(text), S.Zero) - s) == 0  # fmt: skip
            # LaTeX of a_minus is that of the slope left of the layer, which is equal to it.
            if s.name in names or text in in_tex and not same:
                raise InputError(
                    f"A = {self.drift.expression()} has a parameter {s}, which the formula has as "
                    "a name of its own; rename the parameter."
                )
        return self


def _shortest(e: Expr) -> Expr:
    """A polynomial or a small rational function, written in the fewest operations."""
    forms = [e]
    if e.is_polynomial():
        forms += [sympy.expand(e), sympy.factor_terms(sympy.expand(e))]
    elif e.is_rational_function() and e.count_ops() < _FEW:
        forms.append(sympy.cancel(e))
    return min(forms, key=sympy.count_ops)


def _bare(tex: str) -> str:
    """A line without the parentheses that enclose all of it."""
    depth = 0
    for found in re.finditer(r"\\(left|right)\b.", tex):
        depth += 1 if found[1] == "left" else -1
        if not depth:
            around = tex.startswith(r"\left(") and found.end() == len(tex)
            return tex[6:-7] if around else tex
    return tex


def _width(tex: str) -> int:
    """Characters of a line, the longer one of a fraction's two, scripts as smaller ones."""
    tex = re.sub(r"\\(left|right|quad|mathcal|mathrm|operatorname|sqrt|,|!|displaystyle)\b|[&\s]",
                 "", tex)  # fmt: skip
    tex = re.sub(r"\\[A-Za-z]+", "x", tex.replace(r"\frac", "\0"))
    while tex != (
        tex := re.sub(
            r"\0\{([^{}]*)\}\{([^{}]*)\}", lambda m: max(m[1], m[2], key=len),
            re.sub(r"[_^](\w)|[_^]\{([^{}\0]*)\}",
                   lambda m: (m[1] or m[2])[: 1 + 2 * len(m[1] or m[2]) // 3], tex),
        )
    ):  # fmt: skip
        pass
    # A sign has space on both sides.
    return len(re.sub(r"[{}]", "", re.sub(r"(?<=.)[-+=]", "   ", tex)))


def _joined(rows: list[str]) -> str:
    """Rows as one, with its first &."""
    return r", \quad ".join([rows[0], *(row.replace("&", "", 1) for row in rows[1:])])


def _predicate(c: Any) -> str:
    sign = {sympy.Eq: "=", sympy.Ne: "!="}.get(type(c))
    return f"{c.lhs} {sign} {c.rhs}" if sign else str(c)


def _head(tex: str) -> str:
    """LaTeX without braces, of a function without its argument."""
    return re.sub(r"[{}]", "", tex).partition("(")[0]
