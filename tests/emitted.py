"""Runs emitted files as their users would: a C compiler, Node, bare Python interpreters."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from symasym.emit import Source
from symasym.emit.targets.to_c import compiler

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
        # Digits of its own come last.
        own = name == "escape_time"
        more = {"dps": args.pop() if own else 30}
    found = loaded[file][name](*args, **more)
    found = found if isinstance(found, tuple) else (found,)
    if sys.argv[1] == "mpmath":
        assert mpmath.mp.dps == 15
        values.append([mpmath.nstr(x, more["dps"] + 2) for x in found])
    else:
        values.append([repr(float(x)) for x in found])
assert "symasym" not in sys.modules
print(json.dumps(values))
"""


def _run_c(files: dict[str, Source], calls: list[Call], folder: Path) -> list[list[str]]:
    """All files in one compilation, every name of a file with the file's before it."""
    lines = ["#include <math.h>", "#include <stdio.h>"]
    for name, source in files.items():
        own = {*source.functions, *re.findall(r"\b[A-Za-z]\w*_\b", str(source))}
        lines += [f"#define {word} {name}__{word}" for word in sorted(own)]
        lines.append(f'#include "{name}.c"')
        lines += [f"#undef {word}" for word in sorted(own)]
    lines += ["int main(void)", "{", "    double out[8];"]
    for call in calls:
        arguments = [repr(float(x)) for x in call.arguments]
        function = f"{call.file}__{call.function}"
        if call.count > 1:
            lines.append(f"    {function}({', '.join([*arguments, 'out'])});")
        else:
            lines.append(f"    out[0] = {function}({', '.join(arguments)});")
        lines += [f'    printf("%.17g ", out[{k}]);' for k in range(call.count)]
        lines.append('    printf("\\n");')
    (folder / "main.c").write_text("\n".join([*lines, "    return 0;", "}", ""]))
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    _output([compiler(), *strict, "-o", "main", "main.c", "-lm"], folder)
    return [line.split() for line in _output([str(folder / "main")], folder).splitlines()]


def _output(command: list[Any], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{command[0]}: {done.stderr[-3000:]}"
    assert not done.stderr, done.stderr[-3000:]
    return done.stdout
