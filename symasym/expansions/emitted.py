"""An expansion as a program: its quotient of sums of exponentials with the largest taken out.

T, C and P are sums of products of sums e^{lam h} c over another such sum. Each sum is scaled by the
largest of its e^{lam h}, so that no exponential overflows, and the logarithm of the quotient is
finite wherever it is a number. Everything else is given step by step, as in
`symasym.expansions.expansion.Expansion.definitions`, with scaled Airy functions and erfcx.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import sympy
from sympy import Expr, S, Symbol

from symasym.emit.forms import erfcx, height_exp, larger
from symasym.emit.program import Case, Function, Program, by_logarithm
from symasym.emit.symbolic_sums import KAPPA, LAM

__all__ = ["Quotient", "one_exponential", "program"]


@dataclass(frozen=True)
class Quotient:
    """front times a sum of products of sums, over the sum of `whole`; or 1 less that.

    Attributes
    ----------
    products : tuple of tuples of expressions
    whole : tuple of expressions
    front : expression
    complement : bool
    sums : tuple of Symbol
        Of these, those that are sums of exponentials themselves.
    code : mapping
        What is defined otherwise in code: without functions that overflow.
    growth : mapping
        By what height a symbol is larger than what `code` has for it, as a multiple of e^{lam h}.
    """

    products: tuple[tuple[Expr, ...], ...]
    whole: tuple[Expr, ...]
    front: Expr = S.One
    complement: bool = False
    sums: tuple[Symbol, ...] = ()
    code: Mapping[Symbol, Expr] = field(default_factory=dict)
    growth: Mapping[Symbol, Expr] = field(default_factory=dict)


def program(
    quotient: Quotient | Expr, name: str, nested: Mapping[Symbol, Expr], about: str, error: str,
    refuse: Callable[[Iterable[Symbol], Iterable[Expr]], None], digits: int = Program.digits,
) -> Program:  # fmt: skip
    """The program of one function; of a quotient, that with its logarithm.

    Parameters
    ----------
    quotient : Quotient or expression
    name : str
    nested : mapping
        What each symbol stands for, as it is computed.
    about, error : str
        What the function returns, and what its formula leaves out.
    refuse : callable
        Raises where the arguments and the expressions have no code.
    digits : int
        As many as are right in its numbers.
    """
    value, known = (
        (quotient, nested) if isinstance(quotient, Expr) else _logarithm(quotient, nested)
    )
    order: dict[Symbol, Expr] = {}

    def visit(expression: Expr) -> None:
        for s in sorted(expression.free_symbols - order.keys(), key=str):
            if s in known and s not in order:
                value = _in_code(known[s])
                visit(value)
                order[s] = value

    visit(value)
    free = set().union(value.free_symbols, *(v.free_symbols for v in order.values())) - order.keys()
    refuse(free, order.values())
    plain = {s: plain_name(s.name) for s in sorted(free, key=str)}
    # Beside the function's own names.
    plain |= {s: f"{text}_" for s, text in plain.items() if text in (name, f"log_{name}")}
    for s in order:
        base = re.sub(r"\W+", "_", s.name.replace("'", "d").replace("-", "m").replace("+", "p"))
        base = f"{base.strip('_')}_" if base[:1] == "t" else base.strip("_")
        while base in plain.values():
            base = f"{base}_1"
        plain[s] = base
    named = {s: Symbol(text, **s._assumptions_orig) for s, text in plain.items()}
    shared, value = _by_noise(
        [(named[s], value.xreplace(named)) for s, value in order.items()], value.xreplace(named)
    )
    arguments = tuple(sorted(named[s].name for s in free))
    if isinstance(quotient, Expr) or quotient.complement:
        value = value if isinstance(quotient, Expr) else 1 - sympy.exp(value)
        function = Function(name, about, arguments, (Case((value,), shared=shared),))
    else:
        function = by_logarithm(name, about, arguments, value, (), shared)
    return Program("expression", about.rstrip("."), (function,), error=error, digits=digits)


def _by_noise(
    shared: Iterable[tuple[Symbol, Expr]], value: Expr
) -> tuple[tuple[tuple[Symbol, Expr], ...], Expr]:
    """The shared parts and the value, each part of them in which kappa is not under a name.

    For arrays of kappa what is computed at each of them is then a few polynomials.
    """
    rows: dict[Symbol, Expr] = {}
    names: dict[Expr, Symbol] = {}
    taken = {s.name for row in (*shared, (None, value)) for s in row[1].free_symbols}
    varying = {KAPPA}

    def split(e: Expr, name: str) -> Expr:
        """The expression with its parts without kappa under names that begin with `name`."""
        if not e.args or not e.free_symbols & varying:
            return e
        e = e.func(*(split(a, name) for a in e.args))
        if not isinstance(e, sympy.Add | sympy.Mul) or e.is_Add and e.has(sympy.exp):
            return e
        steady = e.func(*(a for a in e.args if not a.free_symbols & varying))
        if not steady.free_symbols or steady.is_Symbol or (-steady).is_Symbol:
            return e
        if steady not in names:
            number = next(n for n in itertools.count() if f"{name}_{n}" not in taken)
            known = Symbol(f"{name}_{number}", real=True, positive=steady.is_positive)
            taken.add(known.name)
            rows[known], names[steady] = steady, known
        return e.func(names[steady], *(a for a in e.args if a.free_symbols & varying))

    for s, row in shared:
        rows[s] = split(row, s.name.rstrip("_"))
        if rows[s].free_symbols & varying:
            varying.add(s)
    value = split(value, "value")
    return tuple(rows.items()), value


def _logarithm(
    quotient: Quotient, nested: Mapping[Symbol, Expr]
) -> tuple[Expr, dict[Symbol, Expr]]:
    """The logarithm of a quotient, and what each symbol in it stands for."""
    grown = {s: s * sympy.exp(LAM * h) for s, h in quotient.growth.items()}
    known = {s: value.xreplace(grown) for s, value in {**nested, **quotient.code}.items()}
    inner = {s: known[s] for s in quotient.sums}

    def scaled(expression: Expr) -> tuple[Expr, Symbol]:
        """The largest height of a sum, and the sum in units of its exponential."""
        parts: dict[Expr, Expr] = {}
        whole = sympy.expand_mul(expression.xreplace(grown).xreplace(inner))
        for term in sympy.Add.make_args(whole):
            height, factor = S.Zero, S.One
            for a in sympy.Mul.make_args(term):
                if isinstance(a, sympy.exp) and not (h := sympy.expand(a.args[0] / LAM)).has(LAM):
                    height += h
                else:
                    factor *= a
            parts[height] = parts.get(height, S.Zero) + factor
        number = len([s for s in known if s.name.startswith("sum(")]) + 1
        top, total = Symbol(f"top({number})", real=True), Symbol(f"sum({number})", real=True)
        known[top] = _largest(list(parts))
        known[total] = sum((c * height_exp(LAM, h - top) for h, c in parts.items()), S.Zero)
        return top, total

    made: dict[Expr, tuple[Expr, Symbol]] = {}
    for part in dict.fromkeys([*itertools.chain(*quotient.products), *quotient.whole]):
        made[part] = scaled(part)

    def added(products: Iterable[tuple[Expr, ...]], name: str) -> tuple[Expr, Symbol]:
        """The largest height of a sum of products, and the sum in units of its exponential."""
        rows = [
            (sum((made[x][0] for x in row), S.Zero), sympy.Mul(*(made[x][1] for x in row)))
            for row in products
        ]
        if len(rows) == 1:
            return rows[0]
        top, total = Symbol(f"top({name})", real=True), Symbol(f"sum({name})", real=True)
        known[top] = _largest([h for h, _ in rows])
        known[total] = sum((c * height_exp(LAM, h - top) for h, c in rows), S.Zero)
        return top, total

    (high, above), (low, below) = (
        added(*x) for x in ((quotient.products, "all"), ([(x,) for x in quotient.whole], "whole"))
    )
    return LAM * (high - low) + sympy.log(quotient.front * above / below), known


def _in_code(e: Expr) -> Expr:
    """The expression in functions that every language has."""
    e = e.replace(sympy.acosh, lambda w: sympy.log(w + sympy.sqrt(w**2 - 1)))
    e = e.replace(sympy.erfc, lambda x: sympy.exp(-(x**2)) * erfcx(x))
    # One of two exponentials may overflow where their product does not.
    return e.replace(lambda x: x.is_Mul, one_exponential)


def one_exponential(product: Expr) -> Expr:
    """The product with its exponentials as one."""
    heights = [a.args[0] for a in product.args if isinstance(a, sympy.exp)]
    if len(heights) < 2:
        return product
    rest = [a for a in product.args if not isinstance(a, sympy.exp)]
    return sympy.Mul(*rest, sympy.exp(sympy.factor_terms(sympy.expand(sympy.Add(*heights)))))


def _largest(heights: list[Expr]) -> Expr:
    largest = heights[0]
    for h in heights[1:]:
        largest = larger(largest, h)
    return largest


def plain_name(name: str) -> str:
    """``V''(u1)`` as ``V2_u1``, ``V^(4)(0)`` as ``V4_0``, ``V''(-1)`` as ``V2_m1``."""
    head, _, place = name.rpartition("(")
    if not head:
        return name
    order = head[3:-1] if "^" in head else str(head.count("'") or "")
    return f"{head[0]}{order}_{place.rstrip(')').replace('-', 'm').replace('/', '_')}"
