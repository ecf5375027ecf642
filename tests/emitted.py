"""Runs emitted files as their users would: a C compiler, Node, bare Python interpreters."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from symasym.emit import Source
from symasym.emit.to_c import compiler

NO_COMPILER = "no C compiler on this machine"
NO_NODE = "no Node on this machine"
SUFFIX = {"numpy": "py", "python": "py", "mpmath": "py", "javascript": "mjs", "c": "c"}


@dataclass(frozen=True)
class Call:
    """One call: the file, the function, how many values it returns, the arguments."""

    file: str
    function: str
    arguments: tuple[Any, ...]
    count: int = 1


def available(target: str) -> str:
    """Why a target cannot be run here; empty where it can."""
    if target == "c" and compiler() is None:
        return NO_COMPILER
    if target == "javascript" and shutil.which("node") is None:
        return NO_NODE
    return ""


def run(target: str, files: dict[str, Source], calls: list[Call], folder: Path) -> list[list[str]]:
    """The values of all calls, as texts, from one process that knows nothing of symasym."""
    for name, source in files.items():
        source.write(folder / f"{name}.{SUFFIX[target]}")
    if target == "c":
        return _run_c(files, calls, folder)
    asked = [[c.file, c.function, list(c.arguments)] for c in calls]
    (folder / "calls.json").write_text(json.dumps(asked))
    if target == "javascript":
        (folder / "main.mjs").write_text(_NODE)
        command = ["node", "main.mjs"]
    else:
        (folder / "main.py").write_text(_PYTHON)
        # -S leaves out installed packages, and with them NumPy and mpmath.
        alone = ["-S"] if target == "python" else []
        command = [sys.executable, "-I", *alone, "-W", "error", "main.py", target]
    return json.loads(_output(command, folder))


_NODE = """import { readFileSync } from "node:fs";
const values = [];
for (const [file, name, args] of JSON.parse(readFileSync("calls.json"))) {
  const found = (await import(`./${file}.mjs`))[name](...args);
  values.push((Array.isArray(found) ? found : [found]).map(String));
}
console.log(JSON.stringify(values));
"""

_PYTHON = """import json, sys
loaded, values = {}, []
def text(name):
    with open(name) as file:
        return file.read()
for file, name, args in json.loads(text("calls.json")):
    if file not in loaded:
        loaded[file] = {"__name__": file}
        exec(compile(text(file + ".py"), file, "exec"), loaded[file])
    more = {}
    if sys.argv[1] == "mpmath":
        import mpmath
        more = {"dps": 30}
    found = loaded[file][name](*args, **more)
    found = found if isinstance(found, tuple) else (found,)
    if sys.argv[1] == "mpmath":
        assert mpmath.mp.dps == 15
        values.append([mpmath.nstr(x, 32) for x in found])
    else:
        values.append([repr(float(x)) for x in found])
assert "symasym" not in sys.modules
print(json.dumps(values))
"""


def _run_c(files: dict[str, Source], calls: list[Call], folder: Path) -> list[list[str]]:
    lines = ["#include <stdio.h>", "#include <stdlib.h>", "#include <string.h>"]
    by_file: dict[str, list[Call]] = {}
    for call in calls:
        by_file.setdefault(call.file, []).append(call)
    found: dict[Call, list[str]] = {}
    for groups in _without_clashes(files, by_file):
        main = [*lines, *(f'#include "{name}.h"' for name in groups), "int main(void)", "{"]
        main.append("    double out[8];")
        asked = [c for name in groups for c in by_file[name]]
        for call in asked:
            arguments = [repr(float(x)) for x in call.arguments]
            if call.count > 1:
                main.append(f"    {call.function}({', '.join([*arguments, 'out'])});")
            else:
                main.append(f"    out[0] = {call.function}({', '.join(arguments)});")
            for k in range(call.count):
                main.append(f'    printf("%.17g ", out[{k}]);')
            main.append('    printf("\\n");')
        (folder / "main.c").write_text("\n".join([*main, "    return 0;", "}", ""]))
        strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
        sources = [f"{name}.c" for name in groups]
        _output([compiler(), *strict, "-o", "main", "main.c", *sources, "-lm"], folder)
        printed = _output([str(folder / "main")], folder).splitlines()
        found.update(zip(asked, (line.split() for line in printed), strict=True))
    return [found[call] for call in calls]


def _without_clashes(files: dict[str, Source], by_file: dict[str, list[Call]]) -> list[list[str]]:
    """Groups of files that define no function twice."""
    groups: list[tuple[set[str], list[str]]] = []
    for name in by_file:
        defined = set(files[name].functions)
        for taken, group in groups:
            if not taken & defined:
                taken |= defined
                group.append(name)
                break
        else:
            groups.append((set(defined), [name]))
    return [group for _, group in groups]


def _output(command: list[Any], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{command[0]}: {done.stderr[-3000:]}"
    assert not done.stderr, done.stderr[-3000:]
    return done.stdout
