"""Derivations: a step is an equation whose left side SymPy works out and whose right side is stated.

``d.eq(name, left, right)`` states ``left = right``. `left` is not evaluated: it is printed as it
stands, and its value, ``left.doit()``, has to be `right`. Where the left side is a symbol or a
function that has no value of its own, `given` are the equations that determine it. ``d["eq:C"]``
is what another label concluded; what a label rests on is what it took. Three checks: exact equality
(`equal`), a sign that is seen (`bound`), and the slope of a remainder (`order`).
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import mpmath
import sympy
from sympy import Eq, Integral, S
from sympy.core.function import AppliedUndef

from sympy.printing.pycode import MpmathPrinter

LABELS: dict[str, tuple[str, Any]] = {}
CHANGED: dict[tuple[str, str], Any] = {}


def derives(label, title, n=0):
    """Mark a function that fills in the derivation of `label`; of a series, to the order `d.n`."""
    def mark(function):
        LABELS[label] = title, function, n
        return function
    return mark


@cache
def build(label):
    """The derivation of a label with its steps stated; nothing is checked."""
    head, _, order = label.rpartition("-")
    if order.isdigit() and head in LABELS and LABELS[head][2]:
        (title, function, _), n = LABELS[head], int(order)
        title = f"{title}, to order {n}"
    elif label in LABELS:
        title, function, n = LABELS[label]
    else:  # for the time of the move: sections that are not rewritten
        return _Old(label)
    d = Derivation(label, title, n)
    function(d)
    return d


class _Old:
    """Prototype only: what today's derivations concluded."""

    def __init__(self, label):
        from derivations.registry import build as old

        self.d = old(label)

    def of(self, name):
        from derivations.paper import value_of
        steps = {s.name: s.result for s in self.d.steps}
        return self.d.result if name is None else steps[name] if name in steps else value_of(self.d, name)


@dataclass
class Step:
    """left relation right; `check` takes a right side and tells whether it holds."""

    name: str
    left: Any
    right: Any
    check: Any
    why: str = ""
    relation: str = "="
    error: Any = None


@dataclass
class Derivation:
    """Steps to a conclusion: `left`, `right` and the order `error` of what is left out."""

    label: str
    title: str
    n: int = 0
    steps: list = field(default_factory=list)
    rests_on: dict = field(default_factory=dict)
    supposed: list = field(default_factory=list)
    conclusion: Step | None = None
    note: str = ""

    def __getitem__(self, key):
        """What another label concluded, or its step of that name: ``d["eq:C"]``, ``d["eq:C", 1]``."""
        label, name = key if isinstance(key, tuple) else (key, None)
        if self.n and self.label.endswith(f"-{self.n}") and label in LABELS and LABELS[label][2]:
            label = f"{label}-{self.n}"  # a series rests on series to its own order
        self.rests_on.setdefault(label)
        other = build(label)
        if isinstance(other, _Old):
            return other.of(name)
        found = other.conclusion if name is None else next(s for s in other.steps if s.name == name)
        return found.right

    def suppose(self, statement, check=None, fails=""):
        """A condition; with `fails`, one that does not hold as printed, of which `check` is true."""
        self.supposed.append((statement, check, fails))

    def _add(self, *step, **more):
        if (self.label, step[0]) in CHANGED:  # a mistake made on purpose: its own check is left out
            step = (*step[:2], CHANGED[self.label, step[0]], lambda *_: True, *step[4:])
        self.steps.append(Step(*step, **more))
        self.conclusion = self.steps[-1]
        return step[2]

    def eq(self, name, left, right, why="", given=None, by=None):
        """left = right, by working out `left` (or `by`, where the left side is a name or LaTeX), or by
        the equations of `given` for it."""
        def check(stated):
            if given is None or by is not None:
                if not equal(left if by is None else by, stated):
                    return False
            put = _putting(left, stated)
            rows = given(stated) if callable(given) else [(put(x), put(y)) for x, y in given or ()]
            return all(equal(x, y) for x, y in rows)
        return self._add(name, left, sympy.sympify(right), check, why)

    def bound(self, name, left, relation, right, why="", certificate=None):
        """An inequality: the larger side less the smaller has a sign that is seen."""
        def check(stated):
            gap = (left - stated) * (1 if ">" in relation else -1)
            form = gap if certificate is None else certificate
            return equal(gap, form) and _not_negative(form)
        return self._add(name, left, right, check, why, relation)

    def order(self, name, left, right, error, exact, at, values, why="", digits=60):
        """left = right + O(error): |exact - right|/error settles as kappa falls through `at`."""
        def check(stated, gauge=error):
            return abs(slope(stated, gauge, exact, tuple(at), values, digits)) < 0.2
        return self._add(name, left, right, check, why, "=", error)

    def conclude(self, name=None, note=""):
        """The step that is the label's conclusion, the last one if left out."""
        self.note = note
        if name is not None:
            self.conclusion = next(s for s in self.steps if s.name == name)

    def verify(self):
        """The steps and conditions that do not hold."""
        wrong = [s.name for s in self.steps if not s.check(s.right)]
        return wrong + [text for text, check, _ in self.supposed if check and check() is not True]


def _putting(left, stated):
    """What puts `stated` in the place of `left`: of a function at every argument, of a symbol."""
    if isinstance(left, AppliedUndef):
        return lambda e: sympy.sympify(e).replace(
            left.func, lambda *at: stated.subs(dict(zip(left.args, at, strict=True))))
    return lambda e: sympy.sympify(e).subs(left, stated)


# -- equality --------------------------------------------------------------------------------------

_WAYS = (
    lambda e: e, sympy.expand, lambda e: sympy.expand(e.doit(integrals=False)),
    lambda e: sympy.expand(sympy.numer(sympy.together(e))),
    lambda e: sympy.powsimp(sympy.expand(e)), sympy.simplify,
    lambda e: sympy.simplify(e.rewrite(sympy.exp)),
)


def equal(left, right):
    """True where left.doit() = right is proved; a random point where they differ is asked first."""
    left, right = sympy.sympify(left), sympy.sympify(right)
    if left == right:
        return True
    if isinstance(left, sympy.Tuple):
        return len(left) == len(right) and all(map(equal, left, right))
    gap = worked(left) - right
    if any(way(gap) == 0 for way in _WAYS[:3]):
        return True
    if _differ(gap):
        return False
    return any(way(gap) == 0 for way in (_WAYS[:5] if gap.has(Integral) else _WAYS))


@cache
def worked(e):
    """The value of `e`: all carried out but integrals over arguments of functions without value."""
    def known(x):
        if not isinstance(x, Integral):
            return False
        held = set().union(*(f.free_symbols for f in x.atoms(AppliedUndef)))
        empty = any(low == high for _, low, high in x.limits)
        return empty or not held >= set(x.variables)

    return e.doit(integrals=False).replace(known, lambda x: x.doit())


def _differ(gap):
    """True where `gap` is not 0 at a random point, with random polynomials for functions."""
    if any(end.is_infinite for x in gap.atoms(Integral) for _, *ends in x.limits for end in ends):
        return False
    rng = random.Random(3)
    for _ in range(2):
        e = gap
        for f in sorted({x.func for x in gap.atoms(AppliedUndef)}, key=str):
            c = [S(rng.randint(-40, 40)) / 37 for _ in range(9)]
            e = e.replace(f, lambda *a, c=c: c[8] * sympy.prod(a) + sum(
                c[4 * i % 8 + k] * x**k for i, x in enumerate(a) for k in range(1, 4)))
        point = {}
        for s in sorted(gap.free_symbols, key=str):
            size = S(rng.randint(150, 2900)) / 997
            if s.is_integer:
                size = S(rng.randint(2, 7))
            point[s] = size if s.is_positive else -size if s.is_negative else size * rng.choice((1, -1))
        e = e.doit(integrals=False)
        try:
            value = numeric(e, tuple(point))(*(mpmath.mpf(x.p) / x.q for x in point.values()))
        except (NameError, TypeError, ValueError, ZeroDivisionError, AttributeError, KeyError):
            continue
        if abs(value) > (1e-3 if e.has(Integral) else 1e-9):
            return True
    return False


def numeric(e, arguments=()):
    """A SymPy expression as a function in mpmath, printed as it is emitted."""
    return sympy.lambdify(arguments, e, [{"quad": quad}, "mpmath"], printer=_Numbers({
        "fully_qualified_modules": False, "order": "none"}))


class _Numbers(MpmathPrinter):
    """mpmath, with one `quad` for each variable of an integral."""

    def _print_Heaviside(self, e):
        return f"(1 if {self._print(e.args[0])} > 0 else 0)"

    def _print_Integral(self, e):
        shown = self._print(e.function)
        for variable, low, high in e.limits:
            shown = f"quad(lambda {self._print(variable)}: {shown}, {self._print(low)}, {self._print(high)})"
        return shown


def quad(f, a, b):
    """The integral of f, which has its kinks at -1, 0 and 1."""
    return mpmath.quad(f, [a, *(k for k in (-1, 0, 1) if a < k < b), b], maxdegree=3,
                       method="gauss-legendre")


def _not_negative(e):
    """A sign that SymPy sees, that of e^x - 1 and 1 - e^-x for x > 0, of sums and products of such."""
    if e.is_nonnegative:
        return True
    for t in e.args if e.is_Add else ():
        if isinstance(t, sympy.exp) and e - t == -1 and t.args[0].is_positive:
            return True
        if isinstance(-t, sympy.exp) and e - t == 1 and (-t).args[0].is_negative:
            return True
    return (e.is_Add or e.is_Mul) and all(map(_not_negative, e.args))


@cache
def _exact(exact, x, digits):
    with mpmath.workdps(digits):
        return exact(mpmath.mpf(x), mpmath.mp)


def slope(stated, error, exact, at, values, digits):
    """The logarithmic slope of |exact - stated|/error over the last two points."""
    names = (kappa_symbol(stated, error), *values)
    leading, gauge = (numeric(sympy.sympify(e), names) for e in (stated, error))
    with mpmath.workdps(digits):
        ratios = []
        for x in at[-2:]:
            k = mpmath.mpf(x)
            numbers = [k, *(v(k, mpmath.mp) if callable(v) else mpmath.mpf(v) for v in values.values())]
            gap = abs(_exact(exact, x, digits) - leading(*numbers))
            if gap == 0:
                return mpmath.inf
            ratios.append(gap / abs(gauge(*numbers)))
        x, y = map(mpmath.mpf, at[-2:])
        return mpmath.log(ratios[1] / ratios[0]) / mpmath.log(y / x)


def kappa_symbol(*expressions):
    return next(s for e in expressions for s in sympy.sympify(e).free_symbols if s.name == "kappa")


# -- mutation --------------------------------------------------------------------------------------


def mutants(e):
    """Every change of one coefficient, sign, exponent or limit of an expression."""
    seen = {e}

    def local(node):
        if node.is_Add:
            yield from (node + t for t in node.args)
            yield from (node - 2 * t for t in node.args)
        elif node.is_Pow and node.base is not S.Exp1:
            yield from (node.base ** (node.exp + 1), node.base**-node.exp)
        elif isinstance(node, (sympy.exp, sympy.log, sympy.tanh)):
            yield node.func(2 * node.args[0])
            yield node.func(-node.args[0])
        elif isinstance(node, Integral):
            for i, (s, *ends) in enumerate(node.limits):
                for j, end in enumerate(ends):
                    if end.is_finite is not False and not end.is_infinite:
                        moved = [x + int(j == n) for n, x in enumerate(ends)]
                        yield Integral(node.function, *node.limits[:i], (s, *moved), *node.limits[i + 1:])

    def everywhere(node):
        yield from local(node)
        if isinstance(node, (sympy.Derivative, AppliedUndef, sympy.Tuple)):
            return
        for i, a in enumerate(node.args):
            if isinstance(node, sympy.Piecewise):
                for b in everywhere(a[0]):
                    yield node.func(*node.args[:i], (b, a[1]), *node.args[i + 1:])
                continue
            for b in everywhere(a) if isinstance(a, sympy.Expr) else ():
                yield node.func(*node.args[:i], b, *node.args[i + 1:])

    if isinstance(e, sympy.Tuple):
        for i, part in enumerate(e):
            yield from (sympy.Tuple(*e[:i], m, *e[i + 1:]) for m in mutants(part))
        return
    for m in ([S.One] if e == 0 else [2 * e, -e, *everywhere(e)]):
        if m not in seen and sympy.expand(m - e) != 0:
            seen.add(m)
            yield m


def survivors(step):
    """The changes of a step's right side, or of its order, that its check lets pass; and how many."""
    changed = list(mutants(sympy.sympify(step.right)))
    alive = [m for m in changed if _passes(step, m)]
    if step.error is not None:
        x = kappa_symbol(step.error)
        orders = [step.error * x, step.error / x]
        alive += [e for e in orders if step.check(step.right, e)]
        changed += orders
    return alive, len(changed)


def _passes(step, stated):
    try:
        return step.check(stated)
    except Exception:  # what breaks down has decided nothing
        return False
