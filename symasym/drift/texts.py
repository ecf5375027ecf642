"""Converts a text to a SymPy expression by Python's syntax tree, without executing the text.

A text is an arithmetic expression of exact decimals, names and `FUNCTIONS`, with ``^`` for ``**``.
To bound SymPy's computing time, a text is refused before SymPy reads it if it is too long, too
deeply nested, contains long numbers, or has a high degree or many terms when expanded.
"""

from __future__ import annotations

import ast
import keyword
import math
import re
import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import sympy

from symasym.base.errors import InputError
from symasym.base.inputs import is_name, shown
from symasym.drift import formula

#: The functions of one argument that a text may contain.
FUNCTIONS = (*formula.FUNCTIONS, "ln")
#: Names of constants.
CONSTANTS = {"pi": sympy.pi, "E": sympy.E, "I": sympy.I, "oo": sympy.oo}
_LENGTH = 4_000
_DEGREE = 200
_TERMS = 5_000
_NESTED = 4  # the largest depth of nested functions, roots and fractions
_BITS = 4_000  # the largest size of a number
_INSIDE = 10**19  # the largest number in a root or function, where SymPy may factor or expand it
_DECIMAL = re.compile(r"(\d{1,1000}\.?\d{0,1000}|\.\d{1,1000})([eE][+-]?\d{1,4})?")
# These functions count twice, so that at most two of them can be nested.
_GROWING = ("exp", "sinh", "cosh", "tanh")
# Names may be keywords of Python, such as lambda.
_WORDS = re.compile(rf"\b({'|'.join(keyword.kwlist)})\b")


class _Part(NamedTuple):
    """A subexpression, its degree and number of terms when expanded, and its depth of nesting."""

    value: Any
    degree: int = 0
    terms: int = 1
    nested: int = 0


def read(name: str, text: str, names: Mapping[str, Any] | None = None) -> Any:
    """The SymPy expression for a text, which messages of errors call `name`.

    `names` maps names to expressions; any other name becomes a Symbol.

    Examples
    --------
    >>> read("A", "1/2 - 0.1*u^3")
    1/2 - u**3/10
    """
    written = _WORDS.sub(r"\1_", text.strip().replace("^", "**"))
    if len(text) > _LENGTH or not re.fullmatch(r"[\w\s.()+*/-]+", written, re.ASCII):
        raise InputError(
            f"{name} is {shown(text)}; give a formula of at most {_LENGTH:,} characters such as "
            "1/2 - u + 3*u**3."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            tree = ast.parse(written, mode="eval").body
        return _read(tree, written, {**CONSTANTS, **(names or {})}).value
    except SyntaxError as error:
        why = f"is no formula ({error.msg.partition('.')[0]})"
    except (Warning, ValueError, TypeError, ArithmeticError, MemoryError) as error:
        why = str(error) if type(error) is ValueError else "is no formula"
    except RecursionError:
        why = "is nested too deep"
    raise InputError(f"{name} is {shown(text)}, which {why}; write it like 1/2 - u + 3*u**3.")


def _read(node: ast.AST, text: str, names: Mapping[str, Any]) -> _Part:
    """The subexpression for a node of the syntax tree; ValueError with the reason if refused."""
    match node:
        case ast.Constant():
            decimal = text[node.col_offset : node.end_col_offset]
            if not _DECIMAL.fullmatch(decimal):
                raise ValueError(
                    f"has {shown(decimal)}, which is not a decimal of at most 1,000 digits"
                )
            return _part(sympy.Rational(decimal))
        case ast.Name(id=word) if word not in FUNCTIONS:
            plain = word.removesuffix("_") if keyword.iskeyword(word[:-1]) else word
            if plain in names:
                return _Part(names[plain], 1)
            if not is_name(plain):
                raise ValueError(f"has the name {shown(plain)}")
            return _Part(sympy.Symbol(plain), 1)
        case ast.UnaryOp(op=ast.UAdd(), operand=inner):
            return _read(inner, text, names)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return _product(_MINUS, _read(inner, text, names))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _JOINED:
            return _JOINED[type(op)](_read(left, text, names), _read(right, text, names))
        case ast.Call(func=ast.Name(id=word), args=[inner], keywords=[]):
            if word not in FUNCTIONS:
                raise ValueError(f"has the function {word}; known are {', '.join(FUNCTIONS)}")
            return _call(word, _read(inner, text, names))
    raise ValueError(f"has {shown(ast.unparse(node))}, which is not allowed in a formula")


def _size(x: Any) -> int:
    return max(abs(int(x.p)), int(x.q))


def _part(value: Any, degree: int = 0, terms: int = 1, nested: int = 0) -> _Part:
    """A `_Part`; raises ValueError if it exceeds one of the bounds."""
    if value.is_Rational:
        if _size(value).bit_length() > _BITS:
            raise ValueError("has a number of more than 1,200 digits")
        return _Part(value)
    for size, most, what in (
        (degree, _DEGREE, "a degree"),
        (terms, _TERMS, "a number of terms"),
        (nested, _NESTED, "a depth of functions and fractions"),
    ):
        if size > most:
            raise ValueError(f"has {what} above {most:,}")
    return _Part(value, degree, terms, nested)


def _sum(a: _Part, b: _Part) -> _Part:
    degree, nested = max(a.degree, b.degree), max(a.nested, b.nested)
    return _part(a.value + b.value, degree, a.terms + b.terms, nested)


def _product(a: _Part, b: _Part) -> _Part:
    nested = max(a.nested, b.nested)
    return _part(a.value * b.value, a.degree + b.degree, a.terms * b.terms, nested)


def _power(a: _Part, b: _Part) -> _Part:
    """A power; with an exponent that is not rational it counts as two nested functions."""
    p = b.value
    if not p.is_Rational:
        _short(p, _DEGREE)
        return _part(a.value**p, 1, 1, max(a.nested, b.nested) + 2)
    size, long = _size(p), a.value.is_Rational and _size(a.value).bit_length()
    if size > _DEGREE or size * long > _BITS:
        raise ValueError("has a power that is too high")
    nested = a.nested + int(p.q != 1 or bool(p < 0 and a.terms > 1))
    if p.q != 1:
        _short(a.value)
    count = math.ceil(abs(p))
    return _part(a.value**p, a.degree * count, math.comb(a.terms + count - 1, count), nested)


def _call(word: str, a: _Part) -> _Part:
    """A function of a subexpression."""
    _short(a.value, _DEGREE if a.value.has(sympy.log) else _INSIDE)  # SymPy makes exp(n log x) x^n
    return _part(getattr(sympy, word)(a.value), 1, 1, a.nested + (2 if word in _GROWING else 1))


def _short(value: Any, most: int = _INSIDE) -> None:
    """Raise ValueError if a root, function or exponent contains a number above `most`."""
    if any(_size(x) > most for x in value.atoms(sympy.Rational)):
        raise ValueError(f"has a number above {most:,} inside a root, function or exponent")


_MINUS = _Part(sympy.Integer(-1))
_JOINED = {
    ast.Add: _sum,
    ast.Sub: lambda a, b: _sum(a, _product(_MINUS, b)),
    ast.Mult: _product,
    ast.Div: lambda a, b: _product(a, _power(b, _MINUS)),
    ast.Pow: _power,
}
