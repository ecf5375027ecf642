"""Expansions as formulas: symbols in, symbols out (`symasym.expansions.composition`)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any, Literal, get_args

import sympy
from sympy import Expr, S, Symbol

from symasym.asymptotics.weak_noise.critical_points import zeros_and_finite_parts
from symasym.base.call_context import limited, own_context, step, symbolic, watched
from symasym.base.errors import InputError
from symasym.base.estimate import Answer
from symasym.base.inputs import (
    Number,
    Numbers,
    choice,
    count,
    exact,
    float_text,
    require_printable,
    shown,
)
from symasym.derivation.printing import tex
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.emit import emit
from symasym.emit.asymptotic_time import RIGHT
from symasym.emit.forms import as_printed
from symasym.emit.program import Program
from symasym.emit.source import check_target, rendered
from symasym.emit.symbolic_sums import (
    BEYOND_1,
    DIGITS,
    KAPPA,
    LAM,
    R,
    Symbolic,
    number_of,
)
from symasym.expansions.builder import FinitePart, Rule, Symbols, U, nested
from symasym.expansions.cases import (
    Case,
    case_of,
    contradiction,
    found_cases,
    read_case,
    slides,
    zero_at,
)
from symasym.expansions.composition import (
    D_MINUS,
    D_PLUS,
    OF_START,
    Contribution,
    composed,
    radius_condition,
)
from symasym.expansions.emitted import Quotient, plain_name, program
from symasym.expansions.strong import strong
from symasym.expansions.uniform import PAIRED, WELLS, Coalescing, Locals
from symasym.expansions.uniform_series import (
    uniform_symbols,
)
from symasym.quantities import escape_time, exit_probability, occupation
from symasym.scenes import require_drift

__all__ = ["Contribution", "Expansion", "expand"]

Expanded = Literal["T", "C", "1 - C", "P", "1 - P", "density"]
Noise = Literal["weak", "strong", "uniform"]
QUANTITIES = get_args(Expanded)
_MOST = 8
_MOST_UNIFORM = 1
# Characters on a line of LaTeX, as `_width` counts them: A4 in the smallest type.
_WIDE = 134
_TEX = {D_MINUS: "D_-", D_PLUS: "D_+", LAM: r"\lambda", BEYOND_1: "(r - 1)"}


# Operations in a rational function that is worth reducing.
_FEW = 40


def _shortest(e: Expr) -> Expr:
    """A polynomial or a small rational function, written in the fewest operations."""
    forms = [e]
    if e.is_polynomial():
        forms += [sympy.expand(e), sympy.factor_terms(sympy.expand(e))]
    elif e.is_rational_function() and e.count_ops() < _FEW:
        forms.append(sympy.cancel(e))
    return min(forms, key=sympy.count_ops)


@dataclass(frozen=True, eq=False)
class Expansion:
    """The expansion of a quantity as a formula, as `expand` returns it.

    Attributes
    ----------
    quantity : {"T", "C", "1 - C", "P", "1 - P", "density"}
    noise : {"weak", "strong", "uniform"}
    order : int
    drift : Drift
    start : Fraction
    case : Case
        Which wells and barriers there are (`cases`).
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
    integrals : mapping
        The symbols of the regular part as finite parts of h_k (`latex`).
    rules : mapping
        What `latex` says by one rule for several symbols.
    tex : mapping
        The symbols' LaTeX.
    quotient : Quotient, expression or None
        The formula as it is emitted.
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
    rules: Mapping[Symbol, Rule] = field(default_factory=dict, repr=False)
    tex: Mapping[Symbol, str] = field(default_factory=dict, repr=False)
    quotient: Quotient | Expr | None = field(default=None, repr=False)

    @property
    def error(self) -> str:
        """The order of the terms that the formula leaves out."""
        power, numbers = 2 * self.order + 2, "; evaluate(…, full=True) estimates that"
        if self.noise == "strong":
            return (
                f"relative O(kappa^-{power}), whatever r/kappa^2; evaluate(…, full=True) proves a "
                "bound"
            )
        if self.noise == "uniform":
            return f"relative O(kappa^{power}), also where well and barrier coalesce{numbers}"
        series = f"each series in kappa^2 is short of O(kappa^{power}), relative to its first term"
        return series if self.quantity == "density" else series + numbers

    @cached_property
    def expression(self) -> Expr:
        """The formula in kappa, r, the parameters, and u1, u2, ... where these are not solved.

        Raises
        ------
        TimeLimitError
            It is not written in 10 seconds, as T through a coalescence to order 1 is not, whose
            expression has millions of terms: `formula` and `definitions` are the same on a page.
        """
        return self.put_in(self.formula)

    @cached_property
    def nested(self) -> dict[Symbol, Expr]:
        """The definitions as they are computed, series in kappa^2/2 in Horner's form."""
        return {s: value if isinstance(value, FinitePart) else nested(value)
                for s, value in self.definitions.items()}  # fmt: skip

    def put_in(self, expression: Expr) -> Expr:
        """An expression with the definitions put in."""
        if not isinstance(expression, sympy.Basic):
            raise InputError(f"expression is {shown(expression)}; give a SymPy expression.")
        with limited(way_out="use formula and definitions, which are shorter"), watched():
            while known := expression.free_symbols & self.nested.keys():
                expression = expression.xreplace({s: self.nested[s] for s in known})
            return expression

    @property
    def leading(self) -> Expr:
        """T by the pair of a well and a barrier alone, where there is one such pair.

        Holds where leaving over that barrier is likelier than elsewhere by an exponential factor.

        Raises
        ------
        InputError
            Where there is no such pair, or there are several.
        """
        pairs = [t for t in self.terms if t.pair[0][:4] == "well" and t.pair[1][:7] == "barrier"]
        if len(pairs) != 1:
            raise InputError(
                f"the case {str(self.case)!r} has {len(pairs)} pairs of a well and a barrier "
                "behind it; take one of terms."
            )
        return pairs[0].expression

    @symbolic
    def cases(self, *, patience: float | None = None) -> tuple[Case, ...]:
        """The cases that the drift has, each with parameters where it holds.

        They are found by trying values, and no proof that there are no others.
        """
        known = found_cases(self.drift, self.start, self.quantity not in OF_START)
        of_t = self.quantity == "T"
        return tuple(
            c for c in known if self.noise != "uniform" or str(c) in (PAIRED if of_t else WELLS)
            or (of_t and len(c.kinds) < 2)
        )  # fmt: skip

    # -- numbers ----------------------------------------------------------------------------

    def bind(self, /, **values: Numbers) -> Expansion:
        """The expansion with these parameters set, exactly.

        Raises
        ------
        InputError
            As `Drift.bind`; and where all are bound and the drift is in another case.
        """
        return expand(
            self.drift.bind(**values), self.quantity, noise=self.noise, order=self.order,
            start=self.start, case=self.case,
        )  # fmt: skip

    def evaluate(self, kappa: Numbers, r: Numbers | None = None, **options: Any) -> Answer:
        """The value for a bound drift, by the function of the quantity with this order.

        That has numbers also where `conditions` do not hold, such as r < 1; `expression` and
        emitted code have not.

        Parameters
        ----------
        kappa, r : number or array_like
            r is not needed by P.
        **options
            `dps`, `log`, `full` and others of `symasym.escape_time`.

        Raises
        ------
        InputError
            For free parameters, and as the function.
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

    @cached_property
    def _numbers(self) -> dict[Symbol, Expr]:
        """For a bound drift that is no polynomial, what has no closed form, to 50 digits."""
        if self.drift.free or self.drift.shape or self.drift == Drift.general():
            return {}
        A, numbers = self.drift.expression(), dict[Symbol, Expr]()
        if A.as_poly(U) is not None:
            return {}
        with own_context(DIGITS + 10) as context:
            field = ExactField(self.drift, False, context)
            zeros, parts = zeros_and_finite_parts(
                field, self.start, self.order, context, DIGITS + 10
            )
            for u, value in zip(self.equations, zeros, strict=True):
                numbers[u] = number_of(value)

            def risen(function: Expr, limits: Any) -> Expr:
                """int A du, which is -V."""
                ends = [x.xreplace(numbers) for x in limits[1:]]
                if not all(x.is_number for x in ends):
                    return sympy.Integral(function, limits)
                lo, hi = (context.mpf(str(number_of(sympy.N(x, DIGITS + 10)))) for x in ends)
                return number_of(-field.potential_rise(lo, hi))

            for s, value in self.definitions.items():
                if isinstance(value, FinitePart):
                    side = 1 if s.name[-1] == "+" else -1
                    # h_k(u) is -h_k(-u) in the mirror.
                    numbers[s] = number_of(side * parts[side][int(s.name[1:-1]) - 1])
                elif value.has(sympy.Integral) and not value.has(sympy.erfc):
                    numbers[s] = value.replace(sympy.Integral, risen)
        return numbers

    @symbolic
    def emit(self, target: str = "numpy", name: str = "f", *, patience: float | None = None) -> Any:
        """Source code of the formula, its free symbols being the arguments (`symasym.emit`).

        Critical points without a closed form are arguments, too, where A is a polynomial; of
        another, which is to be bound, they and the regular part are numbers. V's derivatives are
        arguments where no drift is named. There is ``log_NAME`` as well, finite where T is not. In
        doubles uniform noise to order 0 has 1e-12 of log T also at a coalescence; order 1 loses
        digits there, as D^(-2).

        Raises
        ------
        InputError
            Where critical points may be complex, or A is no polynomial and has free parameters.
        """
        check_target(target)
        if target == "latex":
            formula = Program("expression", f"{self.quantity} to order {self.order}", (),
                              latex=self.latex())  # fmt: skip
            return rendered(formula, target)
        if self.quotient is not None:
            where = f", {radius_condition(self.start)}" if self.quantity in OF_START else ""
            about = (
                f"{self.quantity} of {self.drift!r}, {self.noise} noise to order {self.order}, "
                f"case '{self.case}'{where}."
            )
            known = self.nested | self._numbers
            made = program(
                self.quotient, name, known, about, self.error, self._require_emittable,
                RIGHT if self._numbers else Program.digits,
            )  # fmt: skip
            return rendered(made, target)
        expression = self.expression
        self._require_emittable(expression.free_symbols, [expression])
        plain = {
            s: Symbol(plain_name(s.name), **s._assumptions_orig) for s in expression.free_symbols
        }
        return emit(expression.xreplace(plain), target, name=name)

    def _require_emittable(self, free: Iterable[Symbol], expressions: Iterable[Expr]) -> None:
        """Refuse complex numbers, and integrals without a closed form."""
        if any(x.has(FinitePart, sympy.Integral) for x in expressions):
            free = self.drift.free
            way = f"bind them with bind({'=…, '.join(free)}=…)" if free else (
                "use sa.stationary_density")  # fmt: skip
            raise InputError(
                f"A = {self.drift.expression()} is no polynomial in u, so that V and the regular "
                f"part have no closed form in {', '.join(free) or 'y'}; {way}."
            )
        odd = [s for s in free if s in self.equations and not s.is_real]
        if odd:
            raise InputError(
                f"{odd[0]} may be complex, which the code has no numbers for; bind the drift and "
                "use sa.emit('eq:Ttilde', drift=…, method='laplace')."
            )

    # -- as text ----------------------------------------------------------------------------

    @symbolic
    def latex(self, *, patience: float | None = None) -> str:
        """The formula in LaTeX, with a line for each symbol that it is made of.

        The regular part's integrals stand as Hadamard's finite parts, whose closed form for a
        polynomial is in `definitions`.
        """
        left = "p_{ss}(y)" if self.quantity == "density" else self.quantity
        rows, met = self._rows(left, r"\sim", self.formula), self._met(self.rules)
        made: dict[tuple[str, ...], None] = {}
        for s in met:
            if s in self.rules:
                made |= dict.fromkeys((row,) for row in self.rules[s].lines)
            elif s in self.definitions and s != BEYOND_1:
                value = self.integrals.get(s, self.definitions[s])
                if self._latex(value) == self._latex(s):
                    continue  # a parameter of that name
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
        if shared:
            rows.append(_joined(shared))
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

    def _met(self, rules: Mapping[Symbol, Rule]) -> dict[Symbol, None]:
        """The symbols of the formula in the order in which they are met."""
        met: dict[Symbol, None] = {}
        row: set[Symbol] = self.formula.free_symbols
        while row:
            met |= dict.fromkeys(sorted(row, key=str))
            parts = [
                set(rules[s].of) if s in rules else self.definitions[s].free_symbols
                for s in row if s in rules or s in self.definitions and s not in self.integrals
            ]  # fmt: skip
            row = set().union(*parts) - met.keys()
        return met

    def _latex(self, e: Any) -> str:
        step()
        return tex(_shortest(e), {**_TEX, **self.tex})

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def __str__(self) -> str:
        """The formula, a line for each contribution and each symbol, and where it holds."""
        case = "" if self.noise == "strong" else f", case '{self.case}'"
        rows = [
            f"{self.quantity} of {self.drift!r}, {self.noise} noise to order {self.order}{case}",
            f"  {self.quantity} ~ {self.formula}",
        ]
        if self.formula not in [t.expression for t in self.terms]:
            if self.terms:
                rows.append("contributions of pairs of critical points, times C or 1 - C")
            rows += [f"  ({t.weight}) {t.pair[0]}, {t.pair[1]}: {t.expression}" for t in self.terms]
            rows.append("with")
            shown = {s: self.integrals.get(s, self.definitions[s]) for s in self._met({})
                     if s in self.definitions}  # fmt: skip
            rows += [f"  {s} = {value}" for s, value in shown.items()]
            if any(isinstance(value, FinitePart) for value in shown.values()):
                rows.append(
                    "  FinitePart(h, u, a, b): Hadamard's finite part of int_a^b h du, "
                    "h1 = 1/phi, h2 = -h1'/phi, ..."
                )
        rows += ["where", "  " + ", ".join(_predicate(c) for c in self.conditions)]
        return "\n".join([*rows, "error", f"  {self.error}"])

    __repr__ = __str__


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


# -- the verb --------------------------------------------------------------------------------------


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
        Its parameters may be free. ``Drift.general()`` names none: the formula is then that of one
        well and one barrier, in V's derivatives there.
    quantity : {"T", "C", "1 - C", "P", "1 - P", "density"}
    noise : {"weak", "strong", "uniform"}
        kappa -> 0; kappa -> oo, of a polynomial A, in powers of 2/kappa^2; or kappa -> 0 for T, P
        and 1 - P through the coalescence of a well and a barrier, in Airy functions, of a
        polynomial A; of another up to the coalescence, for T.
    order : int, optional
        0 to 8, 2 if left out: the terms of each series in kappa^2 up to kappa^(2 N), or of
        2/kappa^2; 0 or 1 for ``noise="uniform"``, 0 if left out.
    start : number, optional
        Also on a simple zero of A, or outside the layer; for ``noise="uniform"`` neither.
    case : str, optional
        The wells, barriers and the start from left to right, such as ``"start well barrier"``; for
        P and the density ``"well"`` or the like. For a bound drift it is found; else it is the
        first of `Expansion.cases`, for ``noise="uniform"`` the first that has a formula.
        ``"start=well barrier"`` is that of a start on the well.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    Expansion

    Raises
    ------
    InputError
        For an unknown quantity or noise, an order out of range, a case that the drift is not in
        (or, as signs show, for no parameters), a double zero of A, or a parameter with a name that
        the formula needs.

    Notes
    -----
    The coefficients are those of Watson's lemma and of repeated integration by parts, and the
    composition is that of ``method="laplace"`` (see `symasym.asymptotics.weak_noise`), so that with
    numbers put in the expression is `escape_time(…, method="laplace", order=order)`; that of
    ``noise="uniform"`` is ``method="uniform"`` of this order (`symasym.expansions.uniform`,
    `symasym.expansions.uniform_series`). Its expression is long: numbers are sooner put into
    `formula` and `definitions`, one after the other.
    r > 1 is assumed.

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
    quantity = choice("quantity", quantity, QUANTITIES)
    noise = choice("noise", noise, ("weak", "strong", "uniform"))
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
        if quantity == "T" and (abs(at) >= 1 or zero_at(drift, at)):
            where = "a zero of A" if abs(at) < 1 else "outside of the layer"
            raise InputError(
                f"start is {float_text(at)}, {where}; the uniform formula is that of another start "
                "in the layer, and sa.escape_time(method='uniform') has numbers."
            )
        if quantity not in ("T", "P", "1 - P") or order > _MOST_UNIFORM:
            raise InputError(
                f"quantity is {quantity!r} and order {order}; the uniform formula is that of T and "
                f"1 - P, to order {_MOST_UNIFORM}."
            )
        return _first_uniform(drift, quantity, order, at, case)
    return _weak(drift, quantity, order, at, _case(drift, at, case, quantity))


def _case(drift: Drift, start: Fraction, case: str | Case | None, quantity: str) -> Case:
    """The case asked for, or found."""
    general, sliding = drift == Drift.general(), quantity not in OF_START
    asked = None if case is None else read_case(case)
    if general and asked and sorted(asked.kinds) != ["barrier", "well"]:
        raise InputError(
            f"case is {str(asked)!r}, and Drift.general() has one well and one barrier; give "
            "'start well barrier' or 'barrier well start', or name a drift."
        )
    if general or drift.shape or drift.free:
        if asked is None and not general and not drift.shape:
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
            return cases[0]
        own = asked or read_case("start well" if sliding and not general else "start well barrier")
        if drift.free and not (general or drift.shape) and (no := contradiction(drift, start, own)):
            found = "', '".join(map(str, found_cases(drift, start, sliding)))
            raise InputError(
                f"case is '{own}', which {drift!r} is in for no {', '.join(drift.free)}: {no}; the "
                f"cases found are '{found}'."
            )
    else:
        own = case_of(drift, start)
    if asked is not None and asked != own:
        raise InputError(
            f"the expansion is for the case '{asked}', and {drift!r} is in the case '{own}'; "
            f"ask for that one with case='{own}'."
        )
    if sliding and general:
        raise InputError(
            f"{quantity} is that of a sliding block, and Drift.general() has one well and one "
            "barrier; name a drift."
        )
    if sliding and not slides(own.kinds):
        raise InputError(
            f"case is '{' '.join(own.kinds)}'; {quantity} is that of a sliding block, whose "
            "outermost points are wells: give case='well', 'well barrier well' or the like."
        )
    return own


def _first_uniform(
    drift: Drift, quantity: Expanded, order: int, start: Fraction, case: str | Case | None
) -> Expansion:
    """The uniform formula of the case asked for, or of the first that has one."""
    own = _case(drift, start, case, quantity)
    if not drift.free or drift.shape or drift == Drift.general():
        return _uniform(drift, quantity, order, start, own)
    asked: tuple[Case, ...] = (own,)
    if case is None or drift.expression().as_poly(U) is None:
        # Of what is no polynomial with parameters at which it is in the case asked for.
        known = found_cases(drift, start, quantity not in OF_START)
        asked = known if case is None else tuple(c for c in known if c == own) or asked
    refused = []
    for one in asked:
        try:
            return _uniform(drift, quantity, order, start, one)
        except InputError as error:
            refused.append(str(error))
    several = f"no case of {drift!r} has the uniform formula; of the first, '{own}': "
    raise InputError(several * (len(refused) > 1) + refused[0])


@lru_cache(maxsize=32)
def _weak(drift: Drift, quantity: Expanded, order: int, start: Fraction, case: Case) -> Expansion:
    """The weak-noise expansion."""
    symbols = Symbols(drift, case, order, start)
    return _composed(symbols, Symbolic(), "weak", drift, quantity, order, start)


@lru_cache(maxsize=32)
def _uniform(
    drift: Drift, quantity: Expanded, order: int, start: Fraction, case: Case
) -> Expansion:
    """T or 1 - P through a coalescence."""
    known = uniform_symbols(drift, quantity, order, start, case)
    ring = Locals(known) if isinstance(known, Coalescing) else Symbolic()
    e = _composed(known, ring, "uniform", drift, quantity, order, start)
    # That A is 0 at u1, u2, ... is how these are defined; SymPy would take seconds to find it.
    others = (c for c in e.conditions if not isinstance(c, sympy.Eq))
    try:
        holds = all(e.put_in(c) != False for c in others)  # noqa: E712
    except TypeError:  # a condition on what is infinite
        holds = False
    if not holds:
        raise InputError(
            f"{drift!r} from {start} has a pair of zeros that the formula does not cover, such as "
            "a complex one near the start or an end; use sa.escape_time(method='uniform')."
        )
    return e


def _composed(
    symbols: Symbols, ring: Any, noise: Noise, drift: Drift, quantity: Expanded, order: int,
    start: Fraction,
) -> Expansion:  # fmt: skip
    """The composition of both one-sided expansions."""
    made = composed(symbols, ring, noise, quantity, order)
    return _with_own_names(Expansion(
        quantity, noise, order, drift, start, symbols.case, made.formula, made.definitions,
        symbols.equations, made.terms, made.conditions, symbols.integrals, symbols.rules,
        symbols.tex, made.quotient,
    ))  # fmt: skip


@lru_cache(maxsize=32)
def _strong(drift: Drift, quantity: Expanded, order: int, start: Fraction) -> Expansion:
    """The strong-noise expansion, the same in every case."""
    if drift == Drift.general():
        raise InputError("Drift.general() has no moments; name a drift for noise='strong'.")
    formula, values, tex = strong(drift, quantity, order, start)
    where: list[Any] = [sympy.Ne(values[s], 0) for s in values if s.name[:3] == "phi"]
    if quantity in OF_START:
        where.append(radius_condition(start))
    return _with_own_names(Expansion(
        quantity, "strong", order, drift, start, Case(("start",)), as_printed(formula),
        {**values, LAM: 2 / KAPPA**2, BEYOND_1: R - 1}, tex=tex,
        conditions=tuple(c for c in dict.fromkeys(where) if c is not sympy.true),
        quotient=formula,
    ))  # fmt: skip


def _head(tex: str) -> str:
    """LaTeX without braces, of a function without its argument."""
    return re.sub(r"[{}]", "", tex).partition("(")[0]


def _with_own_names(e: Expansion) -> Expansion:
    """The expansion, if no parameter of the drift reads as a symbol of the formula, or as its T.

    R reads as the R of R+ and of R(1), too, and lambda as the symbol that LaTeX writes so.
    """
    parameters = e.drift.expression().free_symbols - {U}
    values = (e.formula, *e.definitions.values(), *e.integrals.values())
    own = set().union(*(sympy.sympify(v).free_symbols for v in values)) - parameters
    own |= {KAPPA, R, U, *e.definitions}
    words = " ".join([e.quantity, "C" * bool(e.terms), *map(str, own)])
    names = set(re.findall(r"[A-Za-z]\w*", words))
    constants = set().union(*(sympy.sympify(v).atoms(sympy.NumberSymbol) for v in values))
    in_tex = {_head(e._latex(s)): s for s in {*own, *constants}}
    functions = {f.func for v in values for f in sympy.sympify(v).atoms(sympy.Function)}
    # Of e^u and Ai these are e and Ai.
    heads = (re.match(r"(?:\\operatorname\{)?(\w+)", e._latex(f(U))) for f in functions
             if f.nargs == sympy.FiniteSet(1))  # fmt: skip
    in_tex |= dict.fromkeys(head[1] for head in heads if head)
    rows = (row for rule in set(e.rules.values()) for row in rule.lines)
    in_tex |= dict.fromkeys(re.findall(r"\\?[A-Za-z]+(?:_\d)?", " ".join(rows)))
    for s in sorted(parameters, key=str):
        text = _head(e._latex(s))
        if s.name not in names and text in in_tex:
            # LaTeX of a_minus and of the slope left of the layer, which is equal to it.
            value = e.definitions.get(in_tex[text], S.Zero)
            if sympy.simplify(value - s) == 0:
                continue
        if s.name in names or text in in_tex:
            raise InputError(
                f"A = {e.drift.expression()} has a parameter {s}, which the formula has as a name "
                "of its own; rename the parameter."
            )
    return e
