"""Which tests use public behaviour only: the guard of the move. It goes when the move is done."""

import ast
import re
from functools import cache
from pathlib import Path

import symasym

# The program, and the distances that `tests.problems` hands on, are as public as the package.
PUBLIC = {"symasym", "symasym.base.errors", "symasym.workshop.problems"}
PUBLIC |= {"symasym.commands.main", "symasym.workshop.verify.findings"}
QUOTED = re.compile(r"symasym\.[a-z_]+$|.*(from|import) symasym\.(?!commands\.main)", re.DOTALL)
INSIDE = "", ""


@cache
def defined(module: str) -> dict[str, ast.AST]:
    """What gives each name at the top of a module of tests its meaning."""
    path, names = Path(__file__).parents[1] / (module.replace(".", "/") + ".py"), {}
    for node in ast.parse(path.read_text()).body if module[:5] == "tests" and path.exists() else ():
        if isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name: node for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names[node.name] = node
        else:
            bound = [n for n in ast.walk(node) if isinstance(n, ast.Name)]
            names |= {n.id: node for n in bound if isinstance(n.ctx, ast.Store)}
    return names


@cache
def used(module: str, name: str) -> set[tuple[str, str]]:
    """The names that the text of this one has, each with its module; INSIDE is one of symasym's."""
    found = set()
    top = defined(module).get(name) or defined("tests.conftest").get(name) or ast.Pass()
    for node in ast.walk(top):
        if isinstance(node, ast.Name | ast.arg):
            found.add((module, getattr(node, "id", "") or getattr(node, "arg", "")))
        for alias in node.names if isinstance(node, ast.Import | ast.ImportFrom) else ():
            home, what = getattr(node, "module", alias.name), alias.name
            if node is top and name != (alias.asname or what):
                continue
            found |= {(home, what), *((f"{home}.{what}", of) for of in defined(f"{home}.{what}"))}
            public = {home, f"{home}.{what}"} & PUBLIC and what[0] != "_"
            if home.startswith("symasym") and not public and what not in symasym.__all__:
                found.add(INSIDE)
        if QUOTED.match(str(getattr(node, "value", ""))):
            found.add(INSIDE)
    return found


@cache
def is_public(module: str, name: str) -> bool:
    """Whether a test, and what it uses in the tests, names nothing from inside symasym."""
    todo = [(module, name)]
    for at in todo:
        todo += used(*at).difference(todo)
    return INSIDE not in todo
