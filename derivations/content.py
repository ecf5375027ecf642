"""Keys of the cache: what a derivation's outcome depends on, as one hash.

The key of a label is a hash of every source file that its module can reach by
imports inside `derivations` and `symasym` (functions' own imports included), of
the versions of Python and the libraries, and of the keys it rests on. A changed
line in any of them is a new key, so that nothing stale is ever taken.
"""

from __future__ import annotations

import ast
import hashlib
import platform
import time
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path

from derivations.registry import closure, entries

ROOTS = {name: Path(__file__).parent.parent / name for name in ("derivations", "symasym")}
# What runs and records every derivation, whatever its module imports.
ALWAYS = (
    "derivations.registry",
    "derivations.paper",
    "derivations.runner",
    "derivations.content",
    "symasym.derivation",
)
_BEGUN = time.time()
LIBRARIES = ("sympy", "mpmath", "gmpy2", "numpy")


def _file(module: str) -> Path | None:
    """The source of a module of these packages, or None for anything else."""
    package, *rest = module.split(".")
    if package not in ROOTS:
        return None
    base = ROOTS[package].joinpath(*rest)
    for path in (base / "__init__.py", base.with_suffix(".py")):
        if path.is_file():
            return path
    return None


@cache
def _imports(path: Path) -> frozenset[str]:
    """Modules of these packages that a source file names in an import, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            # "from package import name" names a module or something in the package's __init__.
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                found.add(module if _file(module) else node.module)
        elif isinstance(node, ast.ImportFrom):
            raise ValueError(f"{path} has a relative import; write it absolute.")
    return frozenset(m for m in found if _file(m))


@cache
def sources(module: str) -> tuple[Path, ...]:
    """Every source file that `module` can reach, with the packages' own ``__init__``."""
    pending, seen = [module, *ALWAYS], set()
    paths = set()
    while pending:
        name = pending.pop()
        if name in seen:
            continue
        seen.add(name)
        path = _file(name)
        if path is None:
            continue
        paths.add(path)
        pending += _imports(path)
        # Importing a module runs its packages' __init__. What those import besides (the whole
        # public surface of symasym) is not followed: nothing of it is used under this name.
        while name := name.rpartition(".")[0]:
            if initial := _file(name):
                paths.add(initial)
    return tuple(sorted(paths))


@cache
def _digest(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


@cache
def key(label: str) -> str:
    """The content key of a label."""
    entry = entries()[label]
    state = hashlib.sha256(f"{label} {platform.python_version()}".encode())
    for library in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            state.update(f"{library} {metadata.version(library)}".encode())
    for path in sources(entry.module):
        state.update(f"{path.parent.name}/{path.name}".encode())
        state.update(_digest(path))
    for other in entry.rests_on:
        state.update(key(other).encode())
    return state.hexdigest()


def edited_meanwhile(label: str) -> bool:
    """True if a source was edited since this process began, so that its key may not be its own.

    The code in memory may then be older than the file whose hash is in the key.
    """
    return any(
        path.stat().st_mtime > _BEGUN
        for other in closure([label])
        for path in sources(entries()[other].module)
    )
