"""The function `expand` and its result, an expansion as a formula.

The formulas come from the code that computes numbers, `symasym.expansions.weak` or, for strong
noise, `symasym.expansions.strong_noise`, with SymPy's ring (`symasym.formulas.letters`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from typing import Any, Literal, get_args

import sympy
from sympy import Expr, Symbol

from symasym.base.errors import InputError
from symasym.base.inputs import Number, Numbers, choice, count, exact, shown
from symasym.derivation.tex import tex
from symasym.drift.drift import Drift
from symasym.drift.scenes import require_drift, require_sliding
from symasym.emit import source
from symasym.emit.expansions import of_expansion, symbols_of
from symasym.formulas.cases import Case, U, cases_of, numbers_of
from symasym.formulas.letters import KAPPA, FinitePart, Pair, R, put_in, written_out
from symasym.formulas.series import Contribution, strong, uniform, weak
from symasym.quantities import escape_time, exit_probability, occupation

Expanded = Literal["T", "C", "1 - C", "P", "1 - P"]
Noise = Literal["weak", "strong", "uniform"]
_METHODS = {"weak": "laplace", "strong": "strong_noise", "uniform": "uniform"}
_FORMULAS = {"weak": weak, "strong": strong, "uniform": uniform}
_MOST = 8
_KNOWN = {"lam": r"\lambda", "phi(-1)": "a^-", "phi(1)": "a^+"}


@dataclass(frozen=True, eq=False)
class Expansion:
    """The expansion of a quantity as a formula, the result of `expand`.

    `definitions` gives the meaning of the symbols in `formula`: sums, series, heights, derivatives
    of V, critical points, and the finite parts ``R1+, R2+, ...`` and ``R1-, ...`` of int h_k du
    right and left of the start, printed as integrals. `equations` maps each critical point without
    a closed form to A there, which is 0; `terms` has the contributions to T with exact
    coefficients; `conditions` are SymPy predicates under which the formula holds.
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

    def __post_init__(self) -> None:
        # Keep the definitions in use and each condition once; refuse names with two meanings.
        kept = dict.fromkeys(c for c in self.conditions if c is not sympy.true)
        object.__setattr__(self, "definitions", _met(self.formula, self.definitions))
        object.__setattr__(self, "conditions", tuple(kept))
        A, bare = self.drift.expression(), partial(re.sub, r"[{}]|\(.*", "")
        used = symbols_of([self.formula, *self.definitions.values()])
        own = {KAPPA, R, U, *self.definitions, *self.equations, *used - A.free_symbols}
        names = {"T", "C", "P", "h_1", *(bare(_name_of(s.name)) for s in own)}
        for s in sorted(A.free_symbols - {U}, key=str):
            if bare(_name_of(s.name)) in names:
                raise InputError(
                    f"A = {A} has a parameter {s}, a name that the formula uses for another "
                    "quantity; rename the parameter."
                )

    @property
    def numbers(self) -> dict[Symbol, Expr]:
        """Critical points, heights and the regular part of a bound drift to 50 digits."""
        of = self.drift
        if of.free or of.shape or of == Drift.general():
            return {}
        if not of.model.plain:
            return Pair(of, self.case, self.start).numbers
        return numbers_of([*self.definitions, *self.equations], of, self.start)

    @cached_property
    def expression(self) -> Expr:
        """The formula in kappa, r, the parameters, and those of u1, u2, ... without closed form."""
        return written_out(put_in(self.formula, self.definitions))

    def cases(self) -> tuple[Case, ...]:
        """The cases found by random search, each with an example of parameter values.

        Without a layer, and for `Drift.general`, a formula is of one well and one barrier, on the
        right or on the left of it: these are the two cases, whatever the zeros of the drift.
        """
        return cases_of(self.drift, self.start, self.quantity[-1] == "P")

    def bind(self, /, **values: Numbers) -> Expansion:
        """The expansion with these parameters set to exact values as by `Drift.bind`."""
        return expand(
            self.drift.bind(**values), self.quantity, noise=self.noise, order=self.order,
            start=self.start, case=self.case,
        )  # fmt: skip

    def evaluate(self, kappa: Numbers, r: Numbers | None = None, **options: Any) -> Any:
        """The value for a bound drift, by the function of this quantity to this order.

        It takes the options of `symasym.escape_time`; that function also gives values outside of
        `conditions`, such as for r < 1. P needs no r. Without a layer, or with noise that depends
        on u, give ``ends=(…)``, one beyond the barrier and the other where few paths leave, and
        a ``start=…`` off the barrier, from which T is about half of the formula's.
        """
        self.drift.require_bound()
        if not self.drift.model.plain:
            at, A = exact("start", options.get("start", self.start)), self.drift.expression()
            value, slope = (e.subs(U, sympy.Rational(str(at))) for e in (A, A.diff(U)))
            if "ends" not in options or (value == 0 and slope > 0):
                raise InputError(
                    f"ends are {shown(options.get('ends'))} and start {at}, but the formula is for "
                    "the escape from a well over one barrier; give a start off the barrier and two "
                    "ends, one beyond it and the other beyond a higher barrier: for u - u**3, for "
                    "example, evaluate(0.2, ends=(-2, 0.5), start=-1)."
                )
        known = {"method": _METHODS[self.noise], "order": self.order, **options}
        known |= {"complement": True} if self.quantity[0] == "1" else {}
        if self.quantity[-1] == "P":
            return occupation(self.drift, kappa, **known)
        verb: Any = escape_time if self.quantity == "T" else exit_probability
        return verb(self.drift, kappa, r, **{"start": self.start, **known})

    def emit(self, target: str = "numpy", name: str = "f") -> Any:
        """Source code of the formula as a function of its free symbols (`symasym.emit`)."""
        return source(self, target, name=name)

    def functions(self, name: str = "f") -> Any:
        """The functions that `symasym.emit` writes."""
        return of_expansion(self, self.numbers, name)

    def latex(self) -> str:
        """The formula in LaTeX, with one line for each symbol that it contains.

        The integrals of the regular part are written as Hadamard finite parts; for a polynomial A
        their closed form is in `definitions`.
        """
        rows = [rf"{self.quantity} &\sim {_latex(written_out(self.formula))}"]
        rows += [f"{_latex(s)} &= {_latex(written_out(v))}" for s, v in self._shown.items()]
        if any(v.has(FinitePart) for v in self._shown.values()):
            rows.append(r"h_1(u) &= \frac{1}{\phi(u)}, \quad h_{k+1} = -\frac{h_k'}{\phi}")
        used = symbols_of([self.formula, *self._shown.values()])
        rows += [f"0 &= {_latex(a)}" for s, a in self.equations.items() if s in used]
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    @cached_property
    def _shown(self) -> dict[Symbol, Expr]:
        """The definitions as they are printed, with the regular part as integrals."""
        known, x = dict(self.definitions), sympy.Rational(str(self.start))
        ends = {"-": (-1, x), "+": (x, 1)}
        for s in known:
            part = re.fullmatch(r"R(\d+)([-+])", s.name)
            if part and (int(part[1]) % 2 or self.case.at_start):  # the others are end-point terms
                known[s] = FinitePart(Symbol(f"h{part[1]}"), U, *ends[part[2]])
        return _met(self.formula, known)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def __str__(self) -> str:
        """The formula with one line per contribution and per symbol, and its conditions."""
        case = "" if self.noise == "strong" else f", case '{self.case}'"
        case += "" if self.drift.model.plain else ": from the well to beyond that barrier"
        rows = [
            f"{self.quantity} of {self.drift!r}, noise={self.noise!r}, order {self.order}{case}",
            f"  {self.quantity} ~ {written_out(self.formula)}",
        ]
        if self.terms and self.definitions and self.drift.model.plain:
            rows.append("contributions of pairs of critical points, times C or 1 - C")
            terms = sorted(self.terms, key=lambda t: "barrier" not in str(t.pair))
            rows += [f"  ({t.weight}) {t.pair[0]}, {t.pair[1]}: {t.expression}" for t in terms]
        rows += ["with"] * bool(self._shown)
        if any(v.has(FinitePart) for v in self._shown.values()):
            rows.append("  FinitePart: Hadamard's finite part, h1 = 1/phi, h2 = -h1'/phi, ...")
        rows += [f"  {s} = {v}" for s, v in self._shown.items()]
        where = ", ".join(f"{c.lhs} {c.rel_op} {c.rhs}" for c in self.conditions if c.args)
        power = (-1) ** (self.noise == "strong") * (2 * self.order + 2)
        series = self.definitions or self.terms
        left = f"O(kappa^{power}) of each series" if series else "none: it is exact"
        tells = "; evaluate(…, full=True) tells it"
        if not self.drift.model.plain:
            tells = "\nvalues\n  evaluate(kappa, ends=(…), start=…): a start off the barrier"
            tells += ", one end beyond it, the other beyond a higher one"
        rows += ["where", f"  {where}"] if where else []
        return "\n".join([*rows, "error", f"  {left}{tells}"])

    __repr__ = __str__


def _met(formula: Expr, known: Mapping[Symbol, Expr]) -> dict[Symbol, Expr]:
    """The definitions of the symbols that a formula uses, in the order of their occurrence."""
    met = dict[Symbol, Expr]()
    row = formula.free_symbols & known.keys()
    while row:
        met |= {s: known[s] for s in sorted(row, key=str)}
        row = symbols_of(known[s] for s in row) & known.keys() - met.keys()
    return met


def _name_of(name: str) -> str:
    """LaTeX of a symbol: W1 as W_1, E0- as E_0^-, V^(4)(u1) as V^{(4)}(u_1), sigma(u1)."""
    if re.match(r"V['^(]|sigma\(", name):
        name = name.replace("sigma", r"\sigma")
        return re.sub(r"u(\d+)", r"u_{\1}", re.sub(r"\^\((\d+)\)", r"^{(\1)}", name))
    if parts := re.fullmatch(r"([A-Za-z])(\d*)([-+]?)([-+]?)", name):
        head, place, *sides = parts.groups()
        low, high = (place, sides[0]) if place else sides
        return head + f"_{{{low}}}" * bool(low) + f"^{{{high}}}" * bool(high)
    return _KNOWN.get(name) or tex(sympy.Symbol(name))


def _latex(e: Expr) -> str:
    return tex(e, {s: _name_of(s.name) for s in e.free_symbols})


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
        A drift whose parameters may be free. For ``Drift.general()`` the formula is T for one well
        and one barrier in terms of V's derivatives; so it is for a drift without a layer or with
        noise that depends on u: in closed form if phi is quadratic, a cubic such as
        (u - p) (a - u^2), or a polynomial with numbers for coefficients whose zeros are radicals;
        else in the symbols u1 and u2 of its zeros.
    quantity : {"T", "C", "1 - C", "P", "1 - P"}
    noise : {"weak", "strong", "uniform"}
        kappa -> 0; or kappa -> oo, for a polynomial A, in powers of 2/kappa^2; or kappa -> 0 for T
        in Airy functions, uniformly as a well and a barrier coalesce.
    order : int, optional
        The highest power of kappa^2, or of 2/kappa^2, kept in each series: 0 to 8, by default 2;
        for ``noise="uniform"`` 0.
    start : number, optional
        A point of the layer, also a simple zero of A; for ``noise="uniform"`` an interior point.
    case : str, optional
        The wells, barriers and the start from left to right, such as ``"start well barrier"``, or
        ``"start=well barrier"`` for a start on the well; for P, for example, ``"well"``. By
        default it is that of a bound drift, else the first of `Expansion.cases`.

    Notes
    -----
    For r > 1 the values of the formula are those of `escape_time(…, method="laplace",
    order=order)` and its like, which take a start within 0.001 of a well to be there. Without a
    layer or with noise that depends on u, it is the time from the well in `case` over the adjacent
    barrier.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.expand(sa.Drift.general(), "T", order=0).formula
    2*pi*exp(2*(-V(u1) + V(u2))/kappa**2)/(sqrt(V''(u1))*sqrt(-V''(u2)))
    >>> sa.expand(sa.Drift("u - u**3", layer=None), "T", order=0).formula
    sqrt(2)*pi*exp(1/(2*kappa**2))
    """
    require_drift(drift, bound=False, plain=False)
    quantity = choice("quantity", quantity, get_args(Expanded))
    noise = choice("noise", noise, get_args(Noise))
    if (quantity, noise) != ("T", "weak") or drift.model.cuts:
        require_drift(drift, bound=False)
    order = count("order", (noise != "uniform") * 2 if order is None else order, 0, _MOST)
    at = exact("start", start) if quantity[-1] != "P" else Fraction(-1)  # V is measured from there
    asked = None if case is None else " ".join(str(case).split())
    if asked and quantity[-1] == "P" and "start" not in asked:
        asked = f"start {asked}"
    if (
        (abs(at) > 1 and drift.model.layered)
        or (noise == "uniform" and (quantity, order) != ("T", 0))
        or (drift == Drift.general() and quantity != "T")
    ):
        raise InputError(
            f"{quantity} to order {order} from {float(at):.6g} has no formula for {noise} noise; "
            "give -1 <= start <= 1, T of Drift.general(), T to order 0 for uniform noise, or use "
            f"method {_METHODS[noise]!r} for numbers."
        )
    if quantity[-1] == "P" and not drift.free:
        require_sliding(drift)
    return _expanded(drift, quantity, noise, order, at, asked)


@lru_cache(maxsize=32)
def _expanded(
    drift: Drift, quantity: Expanded, noise: Noise, order: int, start: Fraction, asked: str | None
) -> Expansion:
    found = _FORMULAS[noise](drift, quantity, order, start, asked)
    return Expansion(quantity, noise, order, drift, start, **found)
