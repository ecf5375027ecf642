"""What a message advises exists, and does what the message promises."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import symasym as sa
from symasym.commands.main import _parser, in_options
from symasym.methods import METHODS
from symasym.release.answer import METHODS as OF_RELEASE

ROOTS = [Path(str(sa.__file__)).parent, Path(str(sa.__file__)).parent.parent / "derivations"]


def sentences() -> Iterator[tuple[str, str]]:
    """Every text in a raise, or in a function that makes an error, with where it stands."""
    for root in ROOTS:
        for path in sorted(root.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and re.search(r"Error$|_Refused$", _name(node.func)):
                    yield f"{path.name}:{node.lineno}", "".join(map(_text, node.args))


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")


def _text(node: ast.expr) -> str:
    """The text of a literal, values in it as a dash."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    if isinstance(node, ast.BinOp):
        return _text(node.left) + _text(node.right)
    return "–"


@cache
def public() -> dict[str, Any]:
    """The public callables, and the methods of public classes and of what verbs return."""
    from symasym.emit.source import Source

    found = {name: getattr(sa, name) for name in sa.__all__}
    classes = [x for x in found.values() if inspect.isclass(x)]
    for kind in (*classes, Source):
        found |= {n: x for n, x in inspect.getmembers(kind, callable) if not n.startswith("__")}
    return found


@cache
def parameters() -> set[str]:
    names: set[str] = set()
    for call in public().values():
        try:
            names |= set(inspect.signature(call).parameters)
        except (ValueError, TypeError):
            continue
    return names


@cache
def options() -> set[str]:
    return set(_parser()._options())


ALL = list(sentences())


def test_there_are_messages() -> None:
    assert len(ALL) > 200


@pytest.mark.parametrize("message", sorted({text for _, text in ALL}))
def test_what_is_advised_exists(message: str) -> None:
    known, calls = parameters(), public()
    flags = options()
    for name in re.findall(r"\bsa\.(\w+)", message):
        assert name in sa.__all__, name
    assert not re.search(r"\bsymasym\.\w", message), "advice names what is not public"
    for name in re.findall(r"\b([a-zA-Z_]\w*)=(?:…|n\b|True|'|\")", message):
        assert name in known | {"CC", "positive"}, name
    for name in re.findall(r"method='(\w+)'", message):
        assert name in {*METHODS, *OF_RELEASE}, name
    for name in re.findall(r"(?<![\w.])([a-z_]{3,})\((?:\)|…|\w+=)", message):
        assert name in calls, name
    for flag in re.findall(r"(?<![\w-])--[a-z][\w-]*", message):
        assert flag in flags, flag
    for command in re.findall(r"\bsymasym ([a-z]{4,})\b", message):
        assert command in {"show", "derive", "evaluates", "with", "that"}, command


@pytest.mark.parametrize("message", sorted({text for _, text in ALL}))
def test_the_command_line_speaks_its_own_language(message: str) -> None:
    for flag in re.findall(r"(?<![\w-])--[a-z][\w-]*", in_options(message)):
        assert flag in options(), flag
    assert not re.search(r"\b(log|full|complement)=True|bind\(\w+=", in_options(message))


FRICTION = sa.friction(3, 1, "-0.4")

#: A call that is refused, what its message says, and the call that it advises.
FOLLOWED: dict[str, tuple[Any, str, Any]] = {
    "log": (
        lambda: sa.escape_time(FRICTION, "0.001", 10),
        "log=True, or dps=…",
        lambda: (
            sa.escape_time(FRICTION, "0.001", 10, log=True),
            sa.escape_time(FRICTION, "0.001", 10, dps=20),
        ),
    ),
    "log with dps": (
        lambda: sa.exit_probability(sa.linear(1, 1), "1e-140", "1e100", log=True),
        "log=True with dps=…",
        lambda: sa.exit_probability(sa.linear(1, 1), "1e-140", "1e100", log=True, dps=20),
    ),
    "dps for kappa": (
        lambda: sa.escape_time(sa.linear(1, -1), "1e-150", 2),
        "pass dps=…",
        lambda: sa.escape_time(sa.linear(1, -1), "1e-150", 2, dps=20, log=True),
    ),
    "bind": (
        lambda: sa.escape_time(sa.friction(mu=3, z0=-1), 1, 10),
        "bind(alpha=…)",
        lambda: sa.escape_time(sa.friction(mu=3, z0=-1).bind(alpha=1), 1, 10),
    ),
    "rtol": (
        lambda: sa.escape_time(FRICTION, 1, 10, method="auto"),
        "rtol=…",
        lambda: sa.escape_time(FRICTION, 1, 10, method="auto", rtol=1e-3),
    ),
    "auto": (
        lambda: sa.escape_time(FRICTION, 1, 10, rtol=1e-3),
        "method='auto'",
        lambda: sa.escape_time(FRICTION, 1, 10, rtol=1e-3, method="auto"),
    ),
    "rtol and dps": (
        lambda: sa.escape_time(FRICTION, 1, 10, method="auto", rtol="1e-20"),
        "pass dps=…",
        lambda: sa.escape_time(FRICTION, 1, 10, method="auto", rtol="1e-20", dps=25),
    ),
    "exact": (
        lambda: sa.escape_time(FRICTION, 3, 10, method="laplace"),
        "method='exact'",
        lambda: sa.escape_time(FRICTION, 3, 10, method="exact"),
    ),
    "order 0": (
        lambda: sa.escape_time(FRICTION, "0.1", 10, method="local", order=1),
        "method='uniform'",
        lambda: sa.escape_time(FRICTION, "0.1", 10, method="uniform", order=1),
    ),
    "nan": (
        lambda: sa.escape_time(FRICTION, [0.001, 1], 10),
        "errors='nan'",
        lambda: sa.escape_time(FRICTION, [0.001, 1], 10, errors="nan"),
    ),
    "workers": (
        lambda: sa.escape_time(FRICTION, [0.1, 1], 10, workers=2),
        "give dps=… too",
        lambda: sa.escape_time(FRICTION, [0.1, 1], 10, dps=15, workers=2),
    ),
    "escape_time": (
        lambda: sa.occupation(FRICTION, 1),
        "ask for escape_time",
        lambda: sa.escape_time(FRICTION, 1, 10),
    ),
    "labels": (lambda: sa.formula("qqq"), "sa.labels()", lambda: sa.formula(sa.labels()[0])),
    "variable": (
        lambda: sa.Drift("1 - x"),
        "Drift(A, x)",
        lambda: sa.Drift("1 - x", "x"),
    ),
    "value": (
        lambda: float(sa.escape_time(FRICTION, "0.001", 10, dps=20, full=True)),
        "attribute value",
        lambda: sa.escape_time(FRICTION, "0.001", 10, dps=20, full=True).value,
    ),
}


@pytest.mark.parametrize("name", FOLLOWED)
def test_advice_that_is_followed_helps(name: str) -> None:
    refused, says, advised = FOLLOWED[name]
    with pytest.raises(sa.SymasymError) as told:
        refused()
    assert says in str(told.value)
    assert advised() is not None
