"""Functions of a small part of Python, as text, in C or in JavaScript.

That part: floats, whole numbers, lists of fixed length, functions of one number that are handed
on; assignments, `for` over a range, `while`, `if`, `return`, `break`, `continue`, `raise`;
arithmetic, comparisons, `math`, `abs`, `min`, `max`. Names begin with an underscore where they are
those of functions or of tables. Whole numbers are seen from their first value, or from an
annotation; conditions are whole numbers. An argument without annotation is a function of one
number: in C such a function has what it needs beside that number in an array. Nothing else is let
pass.
"""

from __future__ import annotations

import ast
import math
import textwrap
from collections.abc import Mapping

from symasym.emit.kernels.kernel import named
from symasym.emit.writing import comment, heading, wrapped

__all__ = [
    "transcribed",
]


# -- names and expressions -------------------------------------------------------------------------


class Names:
    """The names of the functions in one language, and the lists each of them changes."""

    def __init__(self, trees: dict[str, ast.FunctionDef], target: str) -> None:
        self.trees, self.target = trees, target
        local = {n.id for t in trees.values() for n in ast.walk(t) if isinstance(n, ast.Name)}
        local |= {a.arg for t in trees.values() for a in t.args.args}
        self.functions = {name: named(name, target) for name in trees}
        for name, called in self.functions.items():
            # A list may have the name of the function that fills it.
            if target == "javascript" and called in local:
                self.functions[name] = f"{called}_"
        self.changed = {name: _stored(tree) for name, tree in trees.items()}
        more = True
        while more:
            more = False
            for name, tree in trees.items():
                for call in (n for n in ast.walk(tree) if isinstance(n, ast.Call)):
                    more |= self._through(name, call)

    def _through(self, name: str, call: ast.Call) -> bool:
        """Note lists that a function passes to another that changes them."""
        if not (isinstance(call.func, ast.Name) and call.func.id in self.trees):
            return False
        taken = self.trees[call.func.id].args.args
        stored = {
            a.id
            for a, b in zip(call.args, taken, strict=True)
            if isinstance(a, ast.Name) and b.arg in self.changed[call.func.id]
        }
        new = stored - self.changed[name]
        self.changed[name] |= new
        return bool(new)


def _stored(tree: ast.FunctionDef) -> set[str]:
    """Lists in which something is changed."""
    return {
        n.value.id
        for n in ast.walk(tree)
        if isinstance(n, ast.Subscript)
        and isinstance(n.ctx, ast.Store)
        and isinstance(n.value, ast.Name)
    }


_BINDING = {"?": 1, "||": 2, "&&": 3, "<": 5, "+": 6, "*": 7, "-x": 8, "x": 9}
SIGNS: dict[type, tuple[str, str]] = {
    ast.Add: ("+", "+"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "*"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("/", "*"),
    ast.Mod: ("%", "*"),
}
_COMPARED: dict[type, str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


class Expressions:
    """Expressions of one function, of whose names `kind` tells the types."""

    def __init__(self, names: Names) -> None:
        self.names, self.c = names, names.target == "c"
        self.kind: dict[str, str] = {}

    def whole(self, e: ast.expr) -> bool:
        """True for a value that is a whole number."""
        if isinstance(e, ast.Constant):
            return isinstance(e.value, int)
        if isinstance(e, ast.Name):
            return self.kind.get(e.id) == "int"
        if isinstance(e, ast.Subscript) and isinstance(e.value, ast.Name):
            return self.kind.get(e.value.id) == "list[int]"
        if isinstance(e, ast.UnaryOp):
            return self.whole(e.operand)
        if isinstance(e, ast.BinOp):
            return not isinstance(e.op, ast.Div) and self.whole(e.left) and self.whole(e.right)
        if isinstance(e, ast.IfExp):
            return self.whole(e.body) and self.whole(e.orelse)
        if isinstance(e, ast.Call) and isinstance(e.func, ast.Name):
            if e.func.id in self.names.trees:
                return ast.unparse(self.names.trees[e.func.id].returns) == "int"  # type: ignore[arg-type]
            return e.func.id == "int" or (
                e.func.id in ("min", "max") and all(self.whole(a) for a in e.args)
            )
        return isinstance(e, (ast.Compare, ast.BoolOp))

    def code(self, e: ast.expr, double: bool = False) -> str:
        """An expression; whole constants as doubles where that is asked for."""
        return self._printed(e, double)[0]

    def _within(self, e: ast.expr, binding: int, double: bool = False) -> str:
        text, own = self._printed(e, double)
        return f"({text})" if own < binding else text

    def _printed(self, e: ast.expr, double: bool = False) -> tuple[str, int]:
        if isinstance(e, ast.Constant):
            if isinstance(e.value, int) and double and self.c:
                return f"{e.value}.0", 9
            if isinstance(e.value, float) and not self.c and e.value == int(e.value) < 1e15:
                return str(int(e.value)), 9
            return repr(e.value), 9
        if isinstance(e, ast.Name):
            if self.c and self.kind.get(e.id) == "function":
                return f"{e.id}, {e.id}_p", 9
            # A table, or a name.
            return (named(e.id, self.names.target) if e.id.startswith("_") else e.id), 9
        if isinstance(e, ast.Attribute):
            return self._constant(e.attr), 9
        if isinstance(e, ast.Subscript):
            return f"{self.code(e.value)}[{self.code(e.slice)}]", 9
        if isinstance(e, ast.UnaryOp):
            if isinstance(e.op, ast.Not):
                return f"!{self._within(e.operand, 8)}", 8
            return f"-{self._within(e.operand, 8, double)}", 8
        if isinstance(e, ast.BinOp):
            return self._operation(e, double)
        if isinstance(e, ast.Compare):
            return self._comparison(e)
        if isinstance(e, ast.BoolOp):
            sign = "&&" if isinstance(e.op, ast.And) else "||"
            # Compilers want brackets around && within ||.
            least = _BINDING[sign] + 1 if sign == "&&" else 4
            return f" {sign} ".join(self._within(v, least) for v in e.values), _BINDING[sign]
        if isinstance(e, ast.IfExp):
            parts = (self._within(x, 2, double) for x in (e.test, e.body, e.orelse))
            return "{} ? {} : {}".format(*parts), 1
        if isinstance(e, ast.Call):
            return self._call(e), 9
        if isinstance(e, ast.JoinedStr):
            return f"`{''.join(map(self._told, e.values))}`", 9
        raise TypeError(f"no transcription of {ast.unparse(e)}")

    def _told(self, e: ast.expr) -> str:
        """A part of a text: as it is, or a number in it."""
        if isinstance(e, ast.Constant):
            return str(e.value)
        assert isinstance(e, ast.FormattedValue)
        return f"${{{self.code(e.value)}{'.toExponential(1)' if e.format_spec else ''}}}"

    def _constant(self, name: str) -> str:
        if self.c:
            return {"pi": repr(math.pi), "nan": "NAN", "inf": "HUGE_VAL"}[name]
        return {"pi": "Math.PI", "nan": "NaN", "inf": "Infinity"}[name]

    def _operation(self, e: ast.BinOp, double: bool) -> tuple[str, int]:
        sign, level = SIGNS[type(e.op)]
        binding = _BINDING[level]
        divides = isinstance(e.op, ast.Div)
        if divides and self.c and self.whole(e.left) and not isinstance(e.left, ast.Constant):
            left = f"(double){self._within(e.left, 9)}"
        else:
            left = self._within(e.left, binding, double or divides)
        # Sums and products of sums are not regrouped.
        right = self._within(e.right, binding + 1, double or divides)
        if isinstance(e.op, ast.FloorDiv) and not self.c:
            return f"Math.trunc({left} / {right})", 9
        return f"{left} {sign} {right}", binding

    def _comparison(self, e: ast.Compare) -> tuple[str, int]:
        parts, left = [], e.left
        for op, right in zip(e.ops, e.comparators, strict=True):
            sign = _COMPARED[type(op)]
            if not self.c and sign in ("==", "!="):
                sign += "="
            parts.append(f"{self._within(left, 6)} {sign} {self._within(right, 6)}")
            left = right
        if len(parts) == 1:
            return parts[0], 5
        return " && ".join(parts), 3

    def _call(self, e: ast.Call) -> str:
        args = [self.code(a) for a in e.args]
        if isinstance(e.func, ast.Attribute):
            return f"{'' if self.c else 'Math.'}{e.func.attr}({', '.join(args)})"
        assert isinstance(e.func, ast.Name)
        name = e.func.id
        if name in self.names.functions:
            return f"{self.names.functions[name]}({', '.join(args)})"
        if self.kind.get(name) == "function":
            return f"{name}({args[0]}, {name}_p)" if self.c else f"{name}({args[0]})"
        if name.startswith("_") and hasattr(math, name[1:]):
            # What Python needs a function of its own for.
            return f"{'' if self.c else 'Math.'}{name[1:]}({args[0]})"
        if name == "int":
            return f"(int)({args[0]})" if self.c else f"Math.trunc({args[0]})"
        if name == "abs":
            return f"{'fabs' if self.c else 'Math.abs'}({args[0]})"
        if name in ("min", "max"):
            if not self.c:
                return f"Math.{name}({', '.join(args)})"
            nested = args[-1]
            for a in reversed(args[:-1]):
                nested = f"f{name}({a}, {nested})"
            return f"(int){nested}" if self.whole(e) else nested
        raise TypeError(f"no transcription of {ast.unparse(e)}")


# -- functions -------------------------------------------------------------------------------------


#: The type of a function of one number in C, in files that hand one on.
FUNCTION_IN_C = "typedef double function_(double u, const double *p);\n"


def transcribed(texts: Mapping[str, str], target: str) -> dict[str, str]:
    """Name in the language -> text, for "c" and "javascript"; elsewhere as they are."""
    if target not in ("c", "javascript"):
        return {name: f"{text}\n" for name, text in texts.items()}
    trees = {name: _function(text) for name, text in texts.items()}
    names = Names(trees, target)
    return {
        names.functions[name]: "\n".join([*_Writer(tree, texts[name], names).lines(), ""])
        for name, tree in trees.items()
    }


def _function(text: str) -> ast.FunctionDef:
    tree = ast.parse(text).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


class _Writer(Expressions):
    """One function."""

    def __init__(self, tree: ast.FunctionDef, text: str, names: Names) -> None:
        super().__init__(names)
        self.tree = tree
        self.text = text.splitlines()
        self.deeper = "    " if self.c else "  "
        for a in tree.args.args:
            kind = ast.unparse(a.annotation) if a.annotation else "function"
            self.kind[a.arg] = {"float": "double", "int": "int"}.get(kind, kind)
        self.arguments = set(self.kind)
        for s in (n for n in ast.walk(tree) if isinstance(n, ast.For)):
            self.kind[ast.unparse(s.target)] = "int"
        self.places = _places(tree)
        self.known = set(self.kind)
        self.often = _often(tree)

    def lines(self) -> list[str]:
        body = self.tree.body
        doc = ast.get_docstring(self.tree)
        if doc is not None:
            body = body[1:]
        used = {n.id for s in body for n in ast.walk(s) if isinstance(n, ast.Name)}
        inside = []
        if self.c:
            inside = [f"    (void){a};" for a in self.arguments_in_order() if a not in used]
        inside += self._hoisted() + self.block(body, self.deeper)
        opening = ["{"] if self.c else []
        said = doc.splitlines()[0] if doc else ""
        head = [f"/* {said} */" if self.c else f"/** {said} */"] if doc else []
        return [*head, *self._heading(), *opening, *inside, "}"]

    def arguments_in_order(self) -> list[str]:
        return [a.arg for a in self.tree.args.args]

    def _heading(self) -> list[str]:
        name = self.names.functions[self.tree.name]
        if not self.c:
            return heading(f"function {name}", self.arguments_in_order(), " {")
        kinds = {"list[float]": "double *", "list[int]": "int *"}
        changed = self.names.changed[self.tree.name]
        listed = []
        for a in self.arguments_in_order():
            if self.kind[a] == "function":
                listed.append(f"function_ *{a}, const double *{a}_p")
                continue
            const = "const " if "list" in self.kind[a] and a not in changed else ""
            listed.append(f"{const}{kinds.get(self.kind[a], f'{self.kind[a]} ')}{a}")
        result = {"float": "double", "int": "int", "None": "void"}[ast.unparse(self.tree.returns)]  # type: ignore[arg-type]
        return heading(f"static {result} {name}", listed, "")

    # -- statements ---------------------------------------------------------------------------

    def block(self, body: list[ast.stmt], indent: str) -> list[str]:
        lines = []
        for statement in body:
            lines += self._comments(statement, indent)
            lines += self._statement(statement, indent, body)
        return lines

    def _comments(self, statement: ast.stmt, indent: str) -> list[str]:
        said: list[str] = []
        k = statement.lineno - 2
        while k >= 0 and self.text[k].strip().startswith("# "):
            said.insert(0, self.text[k].strip()[2:])
            k -= 1
        if not said:
            return []
        if not self.c:
            return [f"{indent}{line}" for line in comment([" ".join(said)], "//")]
        lines = comment([" ".join(said)], "  ")
        lines[0] = f"/* {lines[0].strip()}"
        lines[-1] += " */"
        return [f"{indent}{line}" for line in lines]

    def _statement(self, s: ast.stmt, indent: str, body: list[ast.stmt]) -> list[str]:
        if isinstance(s, ast.Assign) and len(s.targets) == 1:
            return self._assigned(s.targets[0], s.value, indent, body)
        if isinstance(s, ast.AnnAssign) and isinstance(s.target, ast.Name) and s.value:
            self.kind.setdefault(s.target.id, "int")
            return self._assign(s.target, s.value, indent, body)
        if isinstance(s, ast.AugAssign):
            return self._one(s.target, f"{SIGNS[type(s.op)][0]}=", s.value, indent)
        if isinstance(s, ast.Expr):
            return wrapped("", self.code(s.value), indent, end=";", deeper=self.deeper)
        if isinstance(s, ast.Return):
            if s.value is None:
                return [f"{indent}return;"]
            return wrapped("return ", self.code(s.value), indent, end=";", deeper=self.deeper)
        if isinstance(s, ast.Raise):
            return self._refusal(s, indent)
        if isinstance(s, (ast.Break, ast.Continue)):
            return [f"{indent}{type(s).__name__.lower()};"]
        if isinstance(s, ast.While):
            asked = wrapped(
                "while ", self.code(s.test), indent, end=" {", brackets="()", deeper=self.deeper
            )
            return [*asked, *self.block(s.body, indent + self.deeper), f"{indent}}}"]
        if isinstance(s, ast.For):
            return self._loop(s, indent)
        if isinstance(s, ast.If):
            return self._if(s, indent, "if ")
        raise TypeError(f"no transcription of {ast.unparse(s)}")

    def _refusal(self, s: ast.Raise, indent: str) -> list[str]:
        """The lines that stand for an exception; in C a NaN, without the message."""
        if self.c:
            return [f"{indent}return NAN;"]
        assert isinstance(s.exc, ast.Call)
        message = self.code(s.exc.args[0])[1:-1]
        lines = [f"`{line}`" for line in textwrap.wrap(message, 88, drop_whitespace=False)]
        inner = f" +\n{indent}  ".join(lines)
        return [f"{indent}throw new RangeError(", f"{indent}  {inner},", f"{indent});"]

    def _if(self, s: ast.If, indent: str, first: str) -> list[str]:
        lines = wrapped(
            first, self.code(s.test), indent, end=" {", brackets="()", deeper=self.deeper
        )
        lines += self.block(s.body, indent + self.deeper)
        if not s.orelse:
            return [*lines, f"{indent}}}"]
        if len(s.orelse) == 1 and isinstance(s.orelse[0], ast.If):
            return lines + self._if(s.orelse[0], indent, "} else if ")
        lines.append(f"{indent}}} else {{")
        return [*lines, *self.block(s.orelse, indent + self.deeper), f"{indent}}}"]

    def _loop(self, s: ast.For, indent: str) -> list[str]:
        call = s.iter
        assert isinstance(s.target, ast.Name)
        assert isinstance(call, ast.Call)
        name = "i_" if s.target.id == "_" else s.target.id
        low, high, step = "0", "", "1"
        ends = [self.code(a) for a in call.args]
        if len(ends) == 1:
            high = ends[0]
        else:
            low, high, *rest = ends
            step = rest[0] if rest else "1"
        sign = ">" if step.startswith("-") else "<"
        move = {"1": f"{name}++", "-1": f"{name}--"}.get(step, f"{name} += {step}")
        kind = "int" if self.c else "let"
        head = f"{indent}for ({kind} {name} = {low}; {name} {sign} {high}; {move}) {{"
        return [head, *self.block(s.body, indent + self.deeper), f"{indent}}}"]

    def _assigned(
        self, target: ast.expr, value: ast.expr, indent: str, body: list[ast.stmt]
    ) -> list[str]:
        if not isinstance(target, ast.Tuple):
            return self._assign(target, value, indent, body)
        assert isinstance(value, ast.Tuple)
        lines: list[str] = []
        done: set[str] = set()
        for t, v in zip(target.elts, value.elts, strict=True):
            if done & {n.id for n in ast.walk(v) if isinstance(n, ast.Name)}:
                raise TypeError(f"{ast.unparse(target)} is not assigned one by one")
            done |= {n.id for n in ast.walk(t) if isinstance(n, ast.Name)}
            lines += self._assign(t, v, indent, body)
        return lines

    def _assign(
        self, target: ast.expr, value: ast.expr, indent: str, body: list[ast.stmt]
    ) -> list[str]:
        if not isinstance(target, ast.Name):
            return self._one(target, "=", value, indent)
        name = target.id
        if (length := _length(value)) is not None:
            self.known.add(name)
            whole, size = length
            self.kind[name] = f"list[{'int' if whole else 'float'}]"
            if self.c:
                kind, zero = ("int", "0") if whole else ("double", "0.0")
                return [f"{indent}{kind} {name}[{size}] = {{{zero}}};"]
            return [f"{indent}const {name} = new Array({size}).fill(0);"]
        if name in self.known:
            return self._one(target, "=", value, indent)
        self.kind.setdefault(name, "int" if self.whole(value) else "double")
        self.known.add(name)
        once = name not in self.often
        kind = f"const {self.kind[name]}" if once else self.kind[name]
        if not self.c:
            kind = "const" if once else "let"
        return wrapped(
            f"{kind} {name} = ", self._value(value, self.kind[name] == "double"), indent, end=";",
            deeper=self.deeper,
        )  # fmt: skip

    def _one(self, target: ast.expr, sign: str, value: ast.expr, indent: str) -> list[str]:
        first = f"{self.code(target)} {sign} "
        if (sign, ast.unparse(value)) == ("+=", "1"):
            return [f"{indent}{self.code(target)}++;"]
        return wrapped(first, self._value(value), indent, end=";", deeper=self.deeper)

    def _value(self, e: ast.expr, double: bool = False) -> str:
        """The value that is assigned, a condition as a whole number."""
        text = self.code(e, double)
        return (
            f"Number({text})" if isinstance(e, (ast.Compare, ast.BoolOp)) and not self.c else text
        )

    def _hoisted(self) -> list[str]:
        """Names whose first value is given in a block that does not hold all their uses."""
        lines = []
        for name, first in self.places.items():
            if name in self.arguments:
                continue
            if not _sets(first, name):
                whole = _whole_at_first(self, name)
                self.kind.setdefault(name, "int" if whole else "double")
                self.known.add(name)
                zero = "0" if whole else "0.0"
                kind = self.kind[name] if self.c else "let"
                lines.append(f"{self.deeper}{kind} {name} = {zero if self.c else '0'};")
        return lines


def _length(e: ast.expr) -> tuple[bool, int] | None:
    """True if ``[0.0] * n`` holds whole numbers, and n."""
    if not (isinstance(e, ast.BinOp) and isinstance(e.left, ast.List)):
        return None
    (zero,), count = e.left.elts, e.right
    assert isinstance(zero, ast.Constant)
    assert isinstance(count, ast.Constant)
    return isinstance(zero.value, int), int(str(count.value))


def _holds(s: ast.stmt, name: str) -> bool:
    return any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(s))


def _places(tree: ast.FunctionDef) -> dict[str, ast.stmt]:
    """The first statement of the innermost block that holds all uses of a name, for each."""
    declared: dict[str, ast.stmt] = {}
    loops = {n.target.id for n in ast.walk(tree) if isinstance(n, ast.For)}  # type: ignore[attr-defined]
    stored = {
        n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    }
    for name in sorted(stored - loops):
        block = tree.body
        while True:
            holding = [s for s in block if _holds(s, name)]
            inner = [b for s in holding for b in _direct(s) if any(_holds(t, name) for t in b)]
            alone = len(holding) == 1 and len(inner) == 1 and not _in_head(holding[0], name)
            if not alone:
                break
            block = inner[0]
        declared[name] = holding[0]
    return declared


def _direct(s: ast.stmt) -> list[list[ast.stmt]]:
    return [b for b in (getattr(s, "body", []), getattr(s, "orelse", [])) if b]


def _in_head(s: ast.stmt, name: str) -> bool:
    """True where a compound statement has the name in its condition or range."""
    head = [getattr(s, part) for part in ("test", "iter") if hasattr(s, part)]
    return any(isinstance(n, ast.Name) and n.id == name for e in head for n in ast.walk(e))


def _sets(s: ast.stmt, name: str) -> bool:
    """True for an assignment to the name itself."""
    if isinstance(s, ast.AnnAssign):
        return isinstance(s.target, ast.Name) and s.target.id == name
    if not isinstance(s, ast.Assign):
        return False
    (target,) = s.targets
    targets: list[ast.expr] = list(target.elts) if isinstance(target, ast.Tuple) else [target]
    return any(isinstance(t, ast.Name) and t.id == name for t in targets)


def _often(tree: ast.FunctionDef) -> set[str]:
    """Names that are assigned more than once."""
    stored = [
        n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    ]
    return {name for name in stored if stored.count(name) > 1}


def _whole_at_first(writer: _Writer, name: str) -> bool:
    """True where a name's first value is a whole number."""
    for s in (n for n in ast.walk(writer.tree) if isinstance(n, ast.stmt) and _sets(n, name)):
        if isinstance(s, ast.AnnAssign):
            return True
        assert isinstance(s, ast.Assign)
        target, value = s.targets[0], s.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for t, v in zip(target.elts, value.elts, strict=True):
                if isinstance(t, ast.Name) and t.id == name:
                    return writer.whole(v)
        return writer.whole(value)
    return False
