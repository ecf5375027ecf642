"""Formulas as text: Python's syntax tree with an allow-list; nothing is run, and sizes are bounded.

A text is an arithmetic expression of exact decimals, names and `FUNCTIONS`, with ``^`` for ``**``
and ``Piecewise((value, left < right), ..., (value, True))``. What is long, of a high degree or of
many terms when multiplied out, deep, or made of long numbers is refused before SymPy sees it, so
that SymPy's work on what is left ends soon.
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
from symasym.base.inputs import shown

_ONE = """exp log ln sqrt erf erfc sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh
Abs sign"""
#: Functions, with the least and the largest number of their arguments.
FUNCTIONS = {**dict.fromkeys(re.findall(r"\w+", _ONE), (1, 1)), "Max": (2, 8), "Min": (2, 8)}
#: Names with a value of their own.
CONSTANTS = {"pi": sympy.pi, "E": sympy.E, "I": sympy.I, "oo": sympy.oo}
_LENGTH = 4_000
_DEGREE = 200
_TERMS = 5_000
_NESTED = 4  # functions, roots and fractions in each other
_BITS = 4_000  # of a number
_INSIDE = 10**19  # numbers in roots and functions, which SymPy factors or writes out
# These count twice, so that there are two in each other.
_GROWING = ("exp", "sinh", "cosh", "tanh")
# Python's keywords, such as lambda, may be names.
_KEYWORDS = {*keyword.kwlist} - {"True"}
_WORDS = re.compile(rf"\b({'|'.join(_KEYWORDS)})\b")
_COMPARED = {ast.Lt: sympy.Lt, ast.LtE: sympy.Le, ast.Gt: sympy.Gt, ast.GtE: sympy.Ge}


class _Part(NamedTuple):
    """A value; degree and terms when multiplied out; functions, roots, fractions in each other."""

    value: Any
    degree: int = 0
    terms: int = 1
    nested: int = 0


def read(name: str, text: str, names: Mapping[str, Any] | None = None) -> Any:
    """The SymPy expression that a text stands for.

    Parameters
    ----------
    name : str
        How the message calls the argument.
    text : str
    names : mapping of str to Expr, optional
        What these names mean; any other name is a Symbol.

    Raises
    ------
    InputError
        If the text is no formula, or is beyond the bounds.

    Examples
    --------
    >>> read("A", "1/2 - 0.1*u^3")
    1/2 - u**3/10
    """
    written = _WORDS.sub(r"\1_", text.strip().replace("^", "**"))
    if len(text) > _LENGTH or not re.fullmatch(r"[\w\s.,()<>=+*/-]+", written, re.ASCII):
        raise InputError(
            f"{name} is {shown(text)}; give a formula of at most {_LENGTH:,} characters such as "
            "1/2 - u + 3*u**3."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            tree = ast.parse(written, mode="eval").body
        return _Reader(written, names or {}).part(tree).value
    except (SyntaxError, Warning, ValueError, TypeError, ArithmeticError, MemoryError) as error:
        why = str(error) if type(error) is ValueError else "is no formula"
    except RecursionError:
        why = "is nested too deep"
    raise InputError(f"{name} is {shown(text)}, which {why}; write it like 1/2 - u + 3*u**3.")


class _Reader:
    """Of a text, with the names that are known."""

    def __init__(self, text: str, names: Mapping[str, Any]) -> None:
        self.text, self.names = text, names

    def part(self, node: ast.AST) -> _Part:
        """What a node stands for; ValueError with the reason where it is refused."""
        match node:
            case ast.Constant():
                return _Part(_number(self.text[node.col_offset : node.end_col_offset]))
            case ast.Name(id=word) if (plain := _plain(word)) in self.names:
                return _Part(self.names[plain], 1)
            case ast.Name(id=word) if word in CONSTANTS:
                return _Part(CONSTANTS[word], 1)
            case ast.Name(id=word) if word not in FUNCTIONS:
                if not re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,59}", _plain(word)):
                    raise ValueError(f"has the name {shown(word)}")
                return _Part(sympy.Symbol(_plain(word)), 1)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self.part(inner)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                part = self.part(inner)
                return part._replace(value=-part.value)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return _power(self.part(left), self.part(right))
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                below = _power(self.part(right), _Part(sympy.Integer(-1)))
                return _product(self.part(left), below)
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                return _product(self.part(left), self.part(right))
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return _sum(self.part(left), self.part(right))
            case ast.BinOp(left=left, op=ast.Sub(), right=right):
                other = self.part(right)
                return _sum(self.part(left), other._replace(value=-other.value))
            case ast.Call(func=ast.Name(id="Piecewise"), args=[_, *_] as cases, keywords=[]):
                return self._piecewise(cases)
            case ast.Call(func=ast.Name(id=word), args=args, keywords=[]) if word in FUNCTIONS:
                return _call(word, [self.part(argument) for argument in args])
        raise ValueError(f"has {shown(ast.unparse(node))}, which is no part of a formula")

    def _piecewise(self, cases: list[ast.expr]) -> _Part:
        """`Piecewise((value, case), …)`."""
        pieces, parts = [], []
        for case in cases:
            condition: Any = sympy.true
            match case:
                case ast.Tuple(elts=[value, ast.Constant(value=True)]):
                    pass
                case ast.Tuple(elts=[value, ast.Compare(left=a, ops=[op], comparators=[b])]) if (
                    type(op) in _COMPARED
                ):
                    condition = _COMPARED[type(op)](self.part(a).value, self.part(b).value)
                case _:
                    raise ValueError("has a case that is neither True nor a comparison")
            parts.append(self.part(value))
            pieces.append((parts[-1].value, condition))
        sizes = (max(sizes) for sizes in list(zip(*parts, strict=True))[1:])
        return _Part(sympy.Piecewise(*pieces), *sizes)


def _plain(word: str) -> str:
    """A name as it was written."""
    return word[:-1] if word[:-1] in _KEYWORDS else word


def _number(text: str) -> Any:
    """An exact decimal."""
    if not re.fullmatch(r"(\d{1,1000}\.?\d{0,1000}|\.\d{1,1000})([eE][+-]?\d{1,4})?", text):
        raise ValueError(f"has {shown(text)}, which is no decimal of at most 1,000 digits")
    return _bounded(sympy.Rational(text))


def _size(x: Any) -> int:
    return max(abs(int(x.p)), int(x.q))


def _bounded(value: Any) -> Any:
    """The value, unless it is a rational number too long to work with."""
    if value.is_Rational and _size(value).bit_length() > _BITS:
        raise ValueError("has a number of more than 1,200 digits")
    return value


def _part(value: Any, degree: int, terms: int, nested: int) -> _Part:
    """A part within the bounds."""
    if value.is_Rational:
        return _Part(_bounded(value))
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
    """A power with a rational exponent; one with another exponent counts as two functions."""
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


def _call(word: str, arguments: list[_Part]) -> _Part:
    """A function of its arguments."""
    least, most = FUNCTIONS[word]
    if not least <= len(arguments) <= most:
        raise ValueError(f"gives {word} {len(arguments)} arguments")
    for a in arguments:  # SymPy writes exp(n log x) out
        _short(a.value, _DEGREE if a.value.has(sympy.log) else _INSIDE)
    nested = max(a.nested for a in arguments) + (2 if word in _GROWING else 1)
    return _part(getattr(sympy, word)(*(a.value for a in arguments)), 1, 1, nested)


def _short(value: Any, most: int = _INSIDE) -> None:
    """Refuse long numbers in roots, functions and exponents."""
    if any(_size(x) > most for x in value.atoms(sympy.Rational)):
        raise ValueError(f"has a number above {most:,} inside a root, function or exponent")
