r"""Derivations: a step is an equation whose left side SymPy evaluates and whose right is stated.

``d.eq(name, left, right)`` states ``left = right``. `left` is printed unevaluated, and its value
``left.doit()`` must equal `right`. If `left` is a symbol, an undefined function, or LaTeX, then
`given` has the equations that determine it, or `by` the expression to evaluate. ``d["eq:C"]`` is
the conclusion of another label, on which this one then rests. There are three checks: exact
equality, which is proved (`eq`), a sign (`bound`), and for an asymptotic statement the slope of
|exact - stated|/order, which must be near 0 (`order`).

>>> from sympy import Integral, Symbol
>>> x, a = Symbol("x"), Symbol("a")
>>> d = Derivation("square", "The area under a line")
>>> d.eq("area", Integral(x, (x, 0, a)), a**2 / 2)
a**2/2
>>> d.verify()
[]
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from importlib import import_module
from typing import Any

import mpmath
import sympy
from sympy import Integral
from sympy.core.function import AppliedUndef

from symasym.derivation.tex import tex

#: Label -> title, the function that fills in its derivation, the order of a series.
LABELS: dict[str, tuple[str, Callable[[Derivation], None], int]] = {}
#: Label -> the module that derives it, imported when the label is first used.
MODULES: dict[str, str] = {}
BUILT: dict[str, Derivation] = {}


def derives(label: str, title: str, n: int = 0) -> Any:
    """Mark the function that fills in the derivation of `label`, for a series to the order `n`.

    ``build("LABEL-5")`` derives a series, and those that it rests on, to order 5, which is ``d.n``.
    """
    return lambda function: LABELS.setdefault(label, (title, function, n))[1]


def _series(label: str) -> bool:
    if label in MODULES:
        import_module(MODULES[label])
    return label in LABELS and LABELS[label][2] > 0


def build(label: str) -> Derivation:
    """The derivation of a label with its steps unchecked; KeyError for an unknown label."""
    if label not in BUILT:
        head, _, order = label.rpartition("-")
        known = head if order in tuple("12345678") and _series(head) else label
        _series(known)
        title, function, n = LABELS[known]
        if known != label:
            title, n = f"{title}, to order {order}", int(order)
        function(d := Derivation(label, title, n))
        BUILT[label] = d
    return BUILT[label]


@dataclass
class Step:
    """left relation right; `check` takes a right side and returns whether the relation holds.

    `error` is the order of the remainder as `variable` tends to its limit, or None if exact.
    """

    name: str
    left: Any
    right: Any
    check: Callable[..., bool]
    why: str = ""
    relation: str = "="
    error: Any = None
    variable: Any = None

    @property
    def check_kind(self) -> str:
        """The kind of check in a few words."""
        exact = "symbolically" if self.relation in "=~" else "by the sign of the difference"
        return exact if self.variable is None else "by the slope of the remainder"

    def latex(self) -> str:
        """``left = right + O(error)``, or ``right (1 + O(...))``; for tuples, elementwise."""
        sign = {"<=": r"\le", ">=": r"\ge", "~": r"\sim"}.get(self.relation, self.relation)
        if isinstance(self.right, sympy.Tuple):
            pairs = zip(self.left, self.right, strict=True)
            return r" ,\quad ".join(f"{tex(a)} {sign} {tex(b)}" for a, b in pairs)
        left = self.left if isinstance(self.left, str) else tex(self.left)
        stated = isinstance(self.left, str) and re.search(r"([=<>]|\\(sim|le|ge))$", left)
        return f"{left} {self._right()}" if stated else f"{left} {sign} {self._right()}"

    def _right(self) -> str:
        if self.error is None:
            return tex(self.right)
        free = {self.variable} if self.variable is not None else self.error.free_symbols
        sums = [f for f in sympy.Mul.make_args(self.right) if f.is_Add and f != self.right]
        for whole in [sympy.S.One] * (not self.right.is_Add) + sums[:1]:
            front = self.right / whole
            rest = (self.error / front).as_coeff_Mul()[1]
            if rest.free_symbols <= free <= self.right.free_symbols:
                return rf"{tex(front)} \left({tex(whole)} + {_order(rest)}\right)"
        return f"{tex(self.right)} + {_order(self.error)}"


def _order(e: Any) -> str:
    shown = tex(e.as_coeff_Mul()[1])
    return rf"O\left({shown}\right)" if r"\frac" in shown else f"O({shown})"


@dataclass
class Derivation:
    """The steps to a conclusion; sentences are written in TeX."""

    label: str
    title: str
    n: int = 0  # the order of a series
    steps: list[Step] = field(default_factory=list)
    rests_on: list[str] = field(default_factory=list)  # labels whose conclusions it uses
    # Conditions, the check of each or None, and the counterexample to one that is false as printed.
    supposed: list[tuple[str, Callable[[], bool] | None, str]] = field(default_factory=list)
    concluded: tuple[Step, ...] = ()
    note: str = ""  # the meaning of its own symbols
    left_out: str = ""  # the remainder, if no step's `error` states it
    known: str = ""  # what is known of the remainder beyond its order
    cases: tuple[str, ...] = ()  # conditions of the pieces of a piecewise conclusion

    def __getitem__(self, key: str | tuple[str, str]) -> Any:
        """The conclusion of another label, ``d["eq:C"]``, or a step: ``d["eq:C", "name"]``."""
        label, name = key if isinstance(key, tuple) else (key, None)
        return self._take(label).right(name)

    def _take(self, label: str) -> Derivation:
        if self.label.endswith(f"-{self.n}") and _series(label):
            label = f"{label}-{self.n}"
        if label not in self.rests_on:
            self.rests_on.append(label)
        return build(label)

    def error(self, label: str) -> Any:
        """The order of the remainder of another label's conclusion."""
        return self._take(label).concluded[0].error

    def right(self, name: str | None = None) -> Any:
        """The right side of a step or of the conclusion, a tuple if that has several steps."""
        if name is not None:
            return self._steps(name)[0].right
        sides = tuple(s.right for s in self.concluded)
        return sides[0] if len(sides) == 1 else sides

    def _steps(self, *names: str) -> tuple[Step, ...]:
        named = {s.name: s for s in self.steps}
        return tuple(named[name] for name in names)

    def suppose(
        self, statement: str, check: Callable[[], bool] | None = None, fails: str = ""
    ) -> None:
        """State a condition; `fails` is a counterexample if it does not hold as printed."""
        self.supposed.append((statement, check, fails))

    def _add(self, step: Step) -> Any:
        self.steps.append(step)
        self.concluded = (step,)
        return step.right

    def eq(
        self, name: str, left: Any, right: Any, why: str = "", given: Any = None, by: Any = None
    ) -> Any:
        """State left = right, checked by evaluating `left` or `by`, or by the equations `given`.

        `given` has pairs that contain `left`, or is a function from a right side to such pairs.
        """
        right = sympy.sympify(right)
        # Called now, so that the labels that it uses are recorded.
        rows = list(given(right) if callable(given) else given or ())
        worked = [by] if by is not None else [left] if given is None else []

        def check(stated: Any) -> bool:
            put = _putting(left, stated)
            pairs = given(stated) if callable(given) else [(put(x), put(y)) for x, y in rows]
            return all(equal(x, stated) for x in worked) and all(equal(*pair) for pair in pairs)

        return self._add(Step(name, left, right, check, why))

    def bound(
        self, name: str, left: Any, relation: str, right: Any, why: str = "",
        certificate: Any = None, on: Any = None,
    ) -> Any:  # fmt: skip
        """State an inequality: the difference of its sides, or its `certificate`, is >= 0.

        `on` expresses a range by assumptions on symbols: ``{mu: 1 + Symbol("m", positive=True)}``.
        """

        def check(stated: Any) -> bool:
            gap = ((left - stated) * (1 if ">" in relation else -1)).subs(on or {})
            form = gap if certificate is None else sympy.sympify(certificate)
            return equal(gap, form.subs(on or {})) and not_negative(form)

        return self._add(Step(name, left, sympy.sympify(right), check, why, relation))

    def order(
        self, name: str, left: Any, right: Any, error: Any, exact: Callable[[Any, Any], Any],
        at: Iterable[str], values: Mapping[Any, Any], why: str = "", digits: int = 40,
    ) -> Any:  # fmt: skip
        """State left = right + O(error): |exact - right|/error converges along the points `at`.

        ``exact(x, ctx)`` is the left side in an mpmath context; `values` has the numbers of the
        other symbols, or functions that return them.
        """
        right, error, at = sympy.sympify(right), sympy.sympify(error), tuple(at)
        free = (right.free_symbols | error.free_symbols) - values.keys()
        free = sorted(free, key=lambda s: (s.name != "kappa", s.name))

        def check(stated: Any, gauge: Any = error) -> bool:
            return bool(abs(slope(stated, gauge, free[0], exact, at, values, digits)) < 0.2)

        return self._add(Step(name, left, right, check, why, "=", error, free[0]))

    def conclude(
        self, *names: str, note: str = "", error: Any = "", known: str = "",
        cases: Iterable[str] = (),
    ) -> None:  # fmt: skip
        """State which steps are the conclusion; the last one if none is named.

        `error` is the remainder, as TeX or as an order, if no `order` step has measured it; `known`
        says more about it.
        """
        if names:
            self.concluded = self._steps(*names)
        self.note, self.known, self.cases = note, known, tuple(cases)
        if isinstance(error, str):
            self.left_out = error
            asymptotic = re.match(r"(relative |next term )?\$?O\(", error) and not cases
            for step in self.concluded if asymptotic else ():
                step.relation = "~"
                if isinstance(step.left, str):
                    step.left = re.sub("=$", r"\\sim", step.left)
        else:
            self.concluded[0].error = error

    def leaves_out(self) -> str:
        """The remainder of the conclusion, in TeX."""
        orders = [f"${_order(s.error)}$" for s in self.concluded if s.error is not None]
        bounds = {"a bound" for s in self.concluded if s.relation not in "=~"}
        return self.left_out or ", ".join(orders or bounds) or "none: the formula is exact"

    def latex(self) -> str:
        """The conclusion in LaTeX."""
        if not self.cases:
            return r" ,\quad ".join(step.latex() for step in self.concluded)
        pieces = zip(self.concluded, self.cases, strict=True)
        rows = (rf"\displaystyle {tex(s.right)} , & {when}" for s, when in pieces)
        body = r" \\[1ex] ".join(rows)
        return rf"{tex(self.concluded[0].left)} = \begin{{cases}} {body} \end{{cases}}"

    def verify(self) -> list[str]:
        """The names of the steps and conditions that do not hold."""
        wrong = [s.name for s in self.steps if not s.check(s.right)]
        return wrong + [text for text, check, _ in self.supposed if check and check() is not True]


def _putting(left: Any, stated: Any) -> Callable[[Any], Any]:
    """A function that substitutes `stated` for `left`, a symbol or a function of any argument."""
    if isinstance(left, AppliedUndef):
        return lambda e: sympy.sympify(e).replace(
            left.func, lambda *at: stated.subs(dict(zip(left.args, at, strict=True)))
        )
    return lambda e: sympy.sympify(e).subs(left, stated)


# -- the three checks ---------------------------------------------------------------------------


def equal(left: Any, right: Any) -> bool:
    """True if left.doit() = right is proved; for tuples, elementwise."""
    left, right = sympy.sympify(left), sympy.sympify(right)
    if left == right:
        return True
    if isinstance(left, sympy.Tuple):
        return len(left) == len(right) and all(map(equal, left, right))
    gap = worked(left) - worked(right)
    if sympy.expand(gap) == 0 or sympy.expand(sympy.numer(sympy.together(gap))) == 0:
        return True
    return not gap.has(Integral) and bool(sympy.simplify(gap) == 0)


@cache
def worked(e: Any) -> Any:
    """The value of `e`; integrals over arguments of undefined functions stay unevaluated."""

    def known(x: Any) -> bool:
        if not isinstance(x, Integral):
            return False
        held: set[Any] = set().union(*(f.free_symbols for f in x.atoms(AppliedUndef)))
        empty = any(len(limit) == 3 and limit[1] == limit[2] for limit in x.limits)
        return empty or not held >= set(x.variables)

    return e.doit(integrals=False).replace(known, lambda x: x.doit())


def numeric(e: Any, arguments: Iterable[Any]) -> Any:
    """A SymPy expression as a function in mpmath."""
    known = {f"airy{x}iprime": partial(getattr(mpmath, f"airy{x}i"), derivative=1) for x in "ab"}
    return sympy.lambdify(tuple(arguments), e, [known, "mpmath"])


def not_negative(e: Any) -> bool:
    """True if e >= 0 is seen; also for sums and products of e^x - 1 and 1 - e^-x with x > 0."""
    if e.is_nonnegative:
        return True
    for sign in (1, -1):  # e^x - 1, and 1 - e^-x
        exponent = sympy.log(sympy.expand(sign * e + 1))
        if (sign * exponent).is_positive:
            return True
    return bool(e.is_Add or e.is_Mul) and all(map(not_negative, e.args))


@cache
def _exact(exact: Any, x: str, digits: int) -> Any:
    with mpmath.workdps(digits):
        return exact(mpmath.mpf(x), mpmath.mp)


def slope(
    stated: Any, error: Any, variable: Any, exact: Callable[[Any, Any], Any],
    at: Sequence[str], values: Mapping[Any, Any], digits: int,
) -> Any:  # fmt: skip
    """The logarithmic slope of |exact - stated|/error in `variable` between two points."""
    names = (variable, *values)
    leading, gauge, ratios = numeric(stated, names), numeric(error, names), []
    with mpmath.workdps(digits):
        for x in at:
            k = mpmath.mpf(x)
            row = [v(k, mpmath.mp) if callable(v) else mpmath.mpf(v) for v in values.values()]
            ratios.append(abs((_exact(exact, x, digits) - leading(k, *row)) / gauge(k, *row)))
        if 0 in ratios:
            return mpmath.inf
        return mpmath.log(ratios[1] / ratios[0]) / mpmath.log(mpmath.mpf(at[1]) / mpmath.mpf(at[0]))
