"""The grammar in which expressions are written as text; nothing that is read is run.

    sum     = [sign] product {("+" | "-") product}
    product = unary {("*" | "/") unary}
    unary   = ("+" | "-") unary | power
    power   = atom [("**" | "^") unary]
    atom    = number | name | function "(" sum {"," sum} ")" | "(" sum ")"
            | "Piecewise(" "(" sum "," case ")" {"," "(" sum "," case ")"} ")"
    case    = "True" | sum ("<" | "<=" | ">" | ">=") sum

Numbers are decimal and exact. A name is a variable or parameter, one of the `CONSTANTS`, or one of
the `FUNCTIONS`. Length, depth, the digits of numbers and the degree are bounded, so that reading
any text takes well under a second.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy
from sympy import Rational

from symasym.base.errors import InputError
from symasym.base.inputs import meant, shown

if TYPE_CHECKING:
    from sympy import Expr


#: Names with a value of their own.
CONSTANTS = {"pi": sympy.pi, "E": sympy.E, "I": sympy.I, "oo": sympy.oo}
#: Functions that may be called, with the least and the largest number of arguments.
FUNCTIONS = {
    **dict.fromkeys(
        """
        exp log ln sqrt cbrt sin cos tan cot sec csc asin acos atan acot sinh cosh tanh coth sech
        csch asinh acosh atanh acoth erf erfc erfi gamma loggamma Abs sign airyai airybi
        airyaiprime airybiprime
        """.split(),  # noqa: SIM905
        (1, 1),
    ),
    **dict.fromkeys(("besselj", "bessely", "besseli", "besselk"), (2, 2)),
    **dict.fromkeys(("Max", "Min"), (1, 8)),
}
_RELATIONS = {"<": sympy.Lt, "<=": sympy.Le, ">": sympy.Gt, ">=": sympy.Ge}
_LENGTH = 10_000
_DEPTH = 60
_DIGITS = 100_000  # of one number, before or after the point
_DEGREE = 2_000
_ROOTED = 2_000  # digits of a number whose root or function is taken
_FACTORED = 500  # of all of them together, without the zeros of powers of ten
_IRRATIONAL = 100  # a number's degree in roots, pi and values of functions
_TERMS = 10_000  # of a number whose powers are multiplied out
_GROWING = ("exp", "sinh", "cosh", "sech", "csch", "tanh", "coth")
_TOWER = 10  # of an exponential of an exponential
_NESTED = 2  # exponentials in each other
_INSIDE = 6  # functions of a number in each other
_ARGUMENT = 10_000  # of a function whose value at a whole number is written out
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\w.])"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*)|(?P<sign>\*\*|[<>]=|[-+*/^(),<>]))",
    re.ASCII,
)


class _Part(NamedTuple):
    """A part of the expression, with its degree in all that is not rational, at most."""

    value: Any
    degree: int


def read(name: str, text: str, names: Mapping[str, Any] | None = None) -> Any:
    """The SymPy expression that a text stands for.

    Parameters
    ----------
    name : str
        How messages call the argument.
    text : str
    names : mapping of str to Expr, optional
        What these names mean; any other name that is no constant or function is a Symbol.

    Raises
    ------
    InputError
        With a sentence that says what is wrong and where.
    """
    return _Reader(name, text, names or {}).expression()


class _Reader:
    def __init__(self, name: str, text: str, names: Mapping[str, Any]):
        if len(text) > _LENGTH:
            raise InputError(
                f"{name} has {len(text):,} characters; an expression has at most {_LENGTH:,}."
            )
        self.name, self.text, self.names = name, text, names
        self.tokens = self._tokens()
        self.at = self.depth = self.factored = 0

    def _tokens(self) -> list[tuple[str, str]]:
        """Kind and text of each token, with an end behind the last."""
        tokens, at, end = [], 0, len(self.text.rstrip())
        while at < end:
            match = _TOKEN.match(self.text, at)
            if match is None:
                at += len(self.text[at:]) - len(self.text[at:].lstrip())
                raise self._error(f"has {self.text[at : at + 12]!r}, which is no part of a formula")
            kind = str(match.lastgroup)
            tokens.append((kind, match[kind]))
            at = match.end()
        return [*tokens, ("end", "")]

    def _error(self, why: str) -> InputError:
        """An error that shows the text."""
        return InputError(
            f"{self.name} is {shown(self.text)}, which {why}; write it like 1/2 - u + 3*u**3."
        )

    def _take(self, *signs: str) -> str:
        """The next token if it is one of the signs, which is passed then; else nothing."""
        kind, token = self.tokens[self.at]
        if kind == "sign" and token in signs:
            self.at += 1
            return token
        return ""

    def _need(self, sign: str) -> None:
        """The sign is next, and passed; else an error."""
        if not self._take(sign):
            token = self.tokens[self.at][1]
            raise self._error(f"has {token!r} where {sign!r} should be" if token else
                              f"ends where {sign!r} should be")  # fmt: skip

    def expression(self) -> Any:
        """The expression that the whole text stands for."""
        try:
            part = self._sum()
        except (TypeError, ValueError, ArithmeticError) as error:
            if isinstance(error, InputError):
                raise
            # As for Max(I, 2) or I < u.
            raise self._error(f"makes no sense to SymPy ({error})") from None
        kind, token = self.tokens[self.at]
        if kind != "end":
            raise self._error(f"has {token!r} where it should end or go on with + - * / **")
        return part.value

    def _sum(self) -> _Part:
        """The rule `sum`."""
        self.depth += 1
        if self.depth > _DEPTH:
            raise self._error(f"is nested more than {_DEPTH} deep")
        parts = [self._product()]
        while sign := self._take("+", "-"):
            value, degree = self._product()
            parts.append(_Part(value if sign == "+" else -value, degree))
        self.depth -= 1
        if len(parts) == 1:
            return parts[0]
        self._bound(sum(_bits(p.value) for p in parts))
        return _Part(sympy.Add(*(p.value for p in parts)), max(p.degree for p in parts))

    def _product(self) -> _Part:
        """The rule `product`."""
        parts = [self._unary()]
        while sign := self._take("*", "/"):
            value, degree = self._unary()
            parts.append(_Part(value if sign == "*" else 1 / value, degree))
        if len(parts) == 1:
            return parts[0]
        degree = sum(p.degree for p in parts)
        self._bound(sum(_bits(p.value) for p in parts), degree)
        return self._powers(sympy.Mul(*(p.value for p in parts)), degree)

    def _unary(self) -> _Part:
        """The rule `unary`."""
        negative = False
        while sign := self._take("+", "-"):
            negative ^= sign == "-"
        value, degree = self._power()
        return _Part(-value if negative else value, degree)

    def _power(self) -> _Part:
        """The rule `power`; a rational exponent bounds digits and degree of the result."""
        base = self._atom()
        if not self._take("**", "^"):
            return base
        self.depth += 1
        if self.depth > _DEPTH:
            raise self._error(f"is nested more than {_DEPTH} deep")
        exponent = self._unary().value
        self.depth -= 1
        if exponent.is_Rational:
            size = abs(Fraction(int(exponent.p), int(exponent.q)))
            degree = max(base.degree, int(exponent.q != 1)) * math.ceil(size)
            self._bound(int(size * _bits(base.value)), degree)
            if exponent.q != 1:
                self._rooted(base.value)
                self._small(exponent, _DEGREE)
            return self._powers(base.value**exponent, degree)
        # A number to a power that a value of u makes whole would be written out.
        self._small(exponent, _DEGREE)
        return self._powers(base.value**exponent, 1)

    def _atom(self) -> _Part:
        """The rule `atom`."""
        kind, token = self.tokens[self.at]
        if kind == "number":
            self.at += 1
            return _Part(self._number(token), 0)
        if kind == "name":
            self.at += 1
            return self._name(token)
        if self._take("("):
            inner = self._sum()
            self._need(")")
            return inner
        raise self._error(f"has {token!r} where a number or name should be" if token else
                          "ends where a number or name should be")  # fmt: skip

    def _number(self, token: str) -> Any:
        """An exact decimal."""
        mantissa, _, exponent = token.lower().partition("e")
        if len(exponent.lstrip("+-0")) > 6 or abs(int(exponent or 0)) > _DIGITS:
            raise self._error(f"has a number whose exponent is beyond {_DIGITS:,}")
        whole, _, decimals = mantissa.partition(".")
        if len(whole) + len(decimals) > 4_000:
            raise self._error("has a number of more than 4,000 digits")
        power = int(exponent or 0) - len(decimals)
        return sympy.Integer(int(whole + decimals)) * sympy.Integer(10) ** power

    def _name(self, name: str) -> _Part:
        """The value of a name: the caller's, a constant, a function's call or a new symbol."""
        if self.tokens[self.at] == ("sign", "("):
            return self._call(name)
        if name in self.names:
            value = self.names[name]
            return _Part(value, int(bool(value.free_symbols)))
        if name in CONSTANTS:
            return _Part(CONSTANTS[name], 1)
        if name in ("True", "False", "None"):
            raise self._error(f"has {name}, which is no number")
        if name in FUNCTIONS and name != "gamma":
            raise self._error(f"has {name} without its argument: {name}(…)")
        return _Part(sympy.Symbol(name), 1)

    def _call(self, name: str) -> _Part:
        """A function of its arguments."""
        if name == "Piecewise":
            return self._piecewise()
        known = {*FUNCTIONS, "Piecewise"}
        if name not in known:
            raise self._error(
                f"calls {name!r}, which is none of {', '.join(sorted(known))}{meant(name, known)}"
            )
        self._need("(")
        arguments = [self._sum().value]
        while self._take(","):
            arguments.append(self._sum().value)
        self._need(")")
        for argument in arguments:
            self._rooted(argument)
        least, most = FUNCTIONS[name]
        if not least <= len(arguments) <= most:
            raise self._error(f"gives {name} {len(arguments)} arguments")
        special = name in ("gamma", "loggamma") or name.startswith("bessel")
        if special or (name.startswith(("erf", "airy")) and not arguments[0].free_symbols):
            self._small(arguments[0], _ARGUMENT)
        elif name == "exp" and arguments[0].has(sympy.log):
            self._small(arguments[0], _DEGREE)
        elif name.endswith("h") and any(
            abs(x.p) > _ARGUMENT for e in arguments[0].atoms(sympy.exp) for x in e.atoms(Rational)
        ):
            # SymPy takes exp(n x) for a polynomial of degree n in exp(x).
            raise self._error(f"has a number above {_ARGUMENT:,} in an exponent inside {name}")
        elif name in _GROWING and not arguments[0].free_symbols:
            towers = arguments[0].has(sympy.exp, sympy.sinh, sympy.cosh)
            self._small(arguments[0], _TOWER if towers else _ARGUMENT)
        if any(not a.free_symbols and functions_inside(a) >= _INSIDE for a in arguments):
            raise self._error(f"has more than {_INSIDE} functions of a number in each other")
        return self._powers(getattr(sympy, name)(*arguments), 1)

    def _piecewise(self) -> _Part:
        """The expression of `Piecewise((value, case), …)`."""
        self._need("(")
        cases: list[tuple[_Part, Any]] = []
        while not cases or self._take(","):
            self._need("(")
            value = self._sum()
            self._need(",")
            cases.append((value, self._case()))
            self._need(")")
        self._need(")")
        pieces = [(value.value, condition) for value, condition in cases]
        return _Part(sympy.Piecewise(*pieces), max(value.degree for value, _ in cases))

    def _case(self) -> Any:
        """The condition of the rule `case`."""
        if self.tokens[self.at] == ("name", "True"):
            self.at += 1
            return sympy.true
        left = self._sum().value
        relation = self._take(*_RELATIONS)
        if not relation:
            raise self._error("has a case that is neither True nor a comparison with < <= > >=")
        return _RELATIONS[relation](left, self._sum().value)

    def _bound(self, bits: int, degree: int = 0) -> None:
        """Refuse numbers and degrees that take long to work with."""
        if bits > 4 * _DIGITS:
            raise self._error(f"has a number of more than {_DIGITS:,} digits")
        if degree > _DEGREE:
            raise self._error(f"has a degree above {_DEGREE:,}")

    def _powers(self, value: Any, degree: int) -> _Part:
        """A part, unless SymPy put powers of powers together to what takes long to work with."""
        for factor in sympy.Mul.make_args(value):
            if factor.is_Pow and factor.exp.is_Rational:
                self._small(factor.exp, _DEGREE)
        if value.is_Rational:
            return _Part(value, 0)
        if _exponentials(value) > _NESTED:
            raise self._error(f"has more than {_NESTED} exponentials in each other")
        if not value.free_symbols and (degree > _IRRATIONAL or multiplied_out(value) > _TERMS):
            raise self._error(
                f"has a power above {_IRRATIONAL} of a number that is not rational, or more than "
                f"{_TERMS:,} products of such numbers"
            )
        return _Part(value, degree)

    def _rooted(self, value: Expr) -> None:
        """Refuse numbers too long to take a root or function of, which factors them."""
        long = [x for x in value.atoms(sympy.Rational) if _bits(x) > 64]
        if any(_bits(x) > 4 * _ROOTED for x in long):
            raise self._error(
                f"takes a root or function of a number of more than {_ROOTED:,} digits"
            )
        for n in (n for x in long for n in (abs(int(x.p)), int(x.q))):
            zeros = len(str(n)) - len(str(n).rstrip("0"))
            self.factored += (n // 10**zeros).bit_length()
        if self.factored > 4 * _FACTORED:
            raise self._error(
                f"takes roots or functions of numbers of more than {_FACTORED:,} digits together"
            )

    def _small(self, argument: Expr, most: int) -> None:
        """Refuse large numbers and denominators in an exponent or argument."""
        if any(abs(x) > most or x.q > most for x in argument.atoms(sympy.Rational)):
            raise self._error(
                f"has a number or denominator above {most:,} in an exponent or argument"
            )


def _exponentials(value: Any) -> int:
    """How deep exponentials lie in each other."""
    deepest = max(map(_exponentials, value.args), default=0)
    grows = type(value).__name__ in _GROWING or (value.is_Pow and not value.exp.is_Rational)
    return deepest + grows


def functions_inside(value: Any) -> int:
    """How deep functions and roots lie in each other."""
    deepest = max(map(functions_inside, value.args), default=0)
    return deepest + bool(value.is_Function or (value.is_Pow and not value.exp.is_Integer))


def fractions_inside(value: Any) -> int:
    """How deep denominators lie in each other."""
    deepest = max(map(fractions_inside, value.args), default=0)
    return deepest + bool(value.is_Pow and value.exp.is_negative and value.base.is_Add)


def multiplied_out(value: Any) -> int:
    """The number of terms of an expression without brackets, at most a billion."""
    parts = [multiplied_out(argument) for argument in value.args]
    count = max([1, *(n for n in parts if n > _TERMS)])
    if value.is_Add:
        count = sum(parts)
    elif value.is_Mul:
        count = math.prod(parts)
    elif value.is_Pow and value.exp.is_Integer:
        power = abs(int(value.exp))
        count = math.comb(parts[0] + power - 1, power)
    return min(count, 10**9)


def _bits(value: Expr) -> int:
    """Binary digits of a number; few for anything else."""
    if value.is_Rational:
        return max(int(value.p).bit_length(), int(value.q).bit_length())
    coefficient = value.as_coeff_Mul()[0] if value.is_Mul else None
    return _bits(coefficient) if coefficient is not None and coefficient.is_Rational else 1
