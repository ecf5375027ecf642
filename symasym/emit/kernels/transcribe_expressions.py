"""Names and expressions of `symasym.emit.kernels.transcribe`."""

from __future__ import annotations

import ast
import math

from symasym.emit.kernels.kernel import named


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
