"""Running derivations: those asked for and those they rest on, each once for its content.

What a derivation's outcome depends on is one hash, its key in the cache: of every source file that
its module can reach by imports inside `derivations` and `symasym` (functions' own imports
included), of the versions of Python and the libraries, and of the keys it rests on. A changed line
in any of them is a new key, so that nothing stale is ever taken.
"""

from __future__ import annotations

import ast
import hashlib
import json
import platform
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from derivations.registry import build, closure, entries, entry
from symasym.base.files import read_json, write_json

SCHEMA = "symasym-derivation/1"
ROOTS = {name: Path(__file__).parent.parent / name for name in ("derivations", "symasym")}
# What runs and records every derivation, whatever its module imports.
ALWAYS = (
    "derivations.registry",
    "derivations.paper",
    "derivations.runner",
    "symasym.derivation",
)
_BEGUN = time.time()
LIBRARIES = ("sympy", "mpmath", "numpy")


def slug(label: str) -> str:
    """A file name for a label."""
    return label.replace(":", "-")


def run(
    labels: Iterable[str] | None = None,
    cache: Path | None = None,
    progress: Callable[[], object] = lambda: None,
    *,
    fresh: bool = False,
) -> dict[str, dict[str, Any]]:
    """Verify derivations and give a record of each.

    Parameters
    ----------
    labels : iterable of str, optional
        What to derive; what it rests on is run as well, and nothing else.
        All, if left out.
    cache : path, optional
        Folder of earlier records. One is taken up again only if its content
        key is that of today's sources and libraries.
    progress : callable, optional
        Called after every derivation.
    fresh : bool
        Take nothing from `cache`; what is run is written there all the same.

    Returns
    -------
    dict
        Label -> record, each after those it rests on. ``record["reused"]`` tells
        whether it was taken from `cache`.

    Raises
    ------
    symasym.derivation.DerivationError
        At the first check that does not pass.
    """
    records: dict[str, dict[str, Any]] = {}
    for label in closure(entries() if labels is None else labels):
        file = cache / f"{slug(label)}.json" if cache else None
        earlier = _kept(file, label) if file and not fresh else None
        if earlier is not None:
            records[label] = {**earlier, "reused": True}
        else:
            record = _derive(label)
            if file and not edited_meanwhile(label):
                write_json(file, {"sha256": _sha256(record), "record": record})
            records[label] = {**record, "reused": False}
        progress()
    return records


def known(cache: Path) -> dict[str, dict[str, Any]]:
    """Records of earlier runs that hold for today's sources, in the order of dependence."""
    found = {}
    for label in closure(entries()):
        record = _kept(cache / f"{slug(label)}.json", label)
        if record is not None:
            found[label] = {**record, "reused": True}
    return found


def _kept(file: Path, label: str) -> dict[str, Any] | None:
    """An earlier record, if it is whole and of today's sources."""
    found = read_json(file)
    record = found.get("record") if isinstance(found, dict) else None
    if not isinstance(record, dict) or record.get("key") != key(label):
        return None
    # A file that was damaged, or edited, may still be JSON and have the right key.
    return record if found.get("sha256") == _sha256(record) else None


def _sha256(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _derive(label: str) -> dict[str, Any]:
    begun = time.perf_counter()
    derivation = build(label)
    steps = [asdict(step) for step in derivation.verify()]
    return {
        "schema": SCHEMA,
        "key": key(label),
        **describe(derivation),
        "steps": steps,
        "seconds": time.perf_counter() - begun,
    }


def describe(derivation: Any) -> dict[str, Any]:
    """The statement of a derivation as data, without the outcome of its checks."""
    from symasym.derivation.results import text

    return {
        "label": derivation.label,
        "title": derivation.title,
        "rests_on": list(derivation.rests_on),
        "hypotheses": [
            {"statement": h.statement, "status": h.status, "where": h.where}
            for h in derivation.hypotheses
        ],
        "latex": derivation.latex(),
        "note": derivation.note,
        "result": text(derivation.result, 4000),
        "error": derivation.error,
    }


# -- keys of the cache -----------------------------------------------------------------------------


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
    own = entry(label)
    state = hashlib.sha256(f"{label} {platform.python_version()}".encode())
    for library in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            state.update(f"{library} {metadata.version(library)}".encode())
    for path in sources(own.module):
        state.update(f"{path.parent.name}/{path.name}".encode())
        state.update(_digest(path))
    for other in own.rests_on:
        state.update(key(other).encode())
    return state.hexdigest()


def edited_meanwhile(label: str) -> bool:
    """True if a source was edited since this process began, so that its key may not be its own.

    The code in memory may then be older than the file whose hash is in the key.
    """
    return any(
        path.stat().st_mtime > _BEGUN
        for other in closure([label])
        for path in sources(entry(other).module)
    )
