"""Results that a step can state: expressions, expansions with their order, inequalities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy

from symasym.derivation.printing import tex


@dataclass(frozen=True)
class Outcome:
    """The outcome of a check. `passed` is False as well where nothing could be decided.

    Attributes
    ----------
    passed : bool
    detail : str
        How it was established, or why it was not.
    left, right, point : str
        Where the check failed: both sides, and a point at which they differ.
    """

    passed: bool
    detail: str
    left: str = ""
    right: str = ""
    point: str = ""


@dataclass(frozen=True)
class Expansion:
    """``leading`` + a remainder of exactly the order of ``gauge`` as ``variable`` -> ``limit``.

    Attributes
    ----------
    leading, gauge : SymPy expression
    variable : SymPy Symbol
    limit : SymPy number
        0 or oo.
    """

    leading: Any
    gauge: Any
    variable: Any
    limit: Any = sympy.S.Zero

    def __str__(self) -> str:
        return f"{self.leading} + O({self.gauge})"


@dataclass(frozen=True)
class Inequality:
    """``left relation right``, with `relation` one of ``<=``, ``<``, ``>=``, ``>``."""

    left: Any
    relation: str
    right: Any

    def __post_init__(self) -> None:
        if self.relation not in ("<=", "<", ">=", ">"):
            raise ValueError(f"{self.relation!r} is no relation; use <=, <, >= or >.")

    @property
    def strict(self) -> bool:
        """True for < and >."""
        return self.relation in ("<", ">")

    @property
    def smaller(self) -> Any:
        """The side that is the smaller one."""
        return self.left if self.relation in ("<=", "<") else self.right

    @property
    def larger(self) -> Any:
        """The side that is the larger one."""
        return self.right if self.relation in ("<=", "<") else self.left

    def difference(self) -> Any:
        """The larger side less the smaller."""
        return self.larger - self.smaller

    def __str__(self) -> str:
        return f"{self.left} {self.relation} {self.right}"


#: What a step states: an expression, an expansion, an inequality, or several of them.
Statement: TypeAlias = "sympy.Expr | Expansion | Inequality | Sequence[Statement]"


def parts(result: Statement) -> list[Any]:
    """The expressions of a result that is one expression or a tuple of them."""
    if isinstance(result, (tuple, list, sympy.Tuple)):
        return [x for item in result for x in parts(item)]
    if isinstance(result, sympy.MatrixBase):
        return list(result)
    return [sympy.sympify(result)]


def latex(result: Statement, names: dict[Any, str] | None = None) -> str:
    """LaTeX of any result, with `names` for symbols (see `symasym.derivation.printing`)."""
    names = names or {}
    if isinstance(result, Expansion):
        return _expansion(result, names)
    if isinstance(result, Inequality):
        sign = {"<=": r"\le", ">=": r"\ge", "<": "<", ">": ">"}[result.relation]
        return f"{tex(result.left, names)} {sign} {tex(result.right, names)}"
    items = [
        tex(x, names) if not isinstance(x, (Expansion, Inequality)) else latex(x, names)
        for x in (result if isinstance(result, (tuple, list, sympy.Tuple)) else [result])
    ]
    return r" ,\quad ".join(items)


def _expansion(result: Expansion, names: dict[Any, str]) -> str:
    """``leading + O(gauge)``; if relative, ``leading (1 + O(x))`` or ``front (sum + O(x))``."""
    gauge = result.gauge.as_coeff_Mul()[1]
    if result.leading == 0:
        return _order(gauge, names)
    leading = tex(result.leading, names)
    relative = result.gauge / result.leading
    if not result.leading.is_Add and relative.free_symbols <= {result.variable}:
        one = relative.as_coeff_Mul()[1]
        if result.leading.free_symbols >= {result.variable}:
            return rf"{leading} \left(1 + {_order(one, names)}\right)"
    (whole, *more) = [f for f in sympy.Mul.make_args(result.leading) if f.is_Add] or [None]
    if whole and not more and whole != result.leading and whole.has(result.variable):
        front = result.leading / whole
        one = (result.gauge / front).as_coeff_Mul()[1]
        if one.free_symbols <= {result.variable}:
            return rf"{tex(front, names)} \left({tex(whole, names)} + {_order(one, names)}\right)"
    return f"{leading} + {_order(gauge, names)}"


def _order(gauge: Any, names: dict[Any, str]) -> str:
    shown = tex(gauge, names)
    return rf"O\left({shown}\right)" if r"\frac" in shown else f"O({shown})"


def statement(
    left: Statement,
    result: Any,
    cases: tuple[str, ...],
    names: dict[Any, str],
    relation: str = "=",
) -> str:
    """``left = result`` in LaTeX: pairwise for tuples, as cases where conditions are given."""
    if cases:
        pieces = [latex(piece, names) for piece in result]
        # Fractions in full size, and room between the rows that have them.
        tall = any(r"\frac" in piece for piece in pieces)
        size, end = (r"\displaystyle ", r" \\[1ex] ") if tall else ("", r" \\ ")
        rows = end.join(
            f"{size}{piece} , & {when}" for piece, when in zip(pieces, cases, strict=True)
        )
        return rf"{latex(left, names)} = \begin{{cases}} {rows} \end{{cases}}"
    if isinstance(left, tuple):
        pairs = zip(left, result, strict=True)
        return r" ,\quad ".join(f"{latex(a, names)} {relation} {latex(b, names)}" for a, b in pairs)
    shown = latex(result, names)
    return shown if left is None else f"{latex(left, names)} {relation} {shown}"


def text(result: Statement, width: int = 400) -> str:
    """One line of plain text of any result, cut at `width` characters."""
    line = str(result)
    return line if len(line) <= width else f"{line[: width - 1]}…"
