"""Running derivations: those asked for and those they rest on, each once for its content."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from derivations.content import edited_meanwhile, key
from derivations.registry import build, closure, entries
from symasym.base.files import read_json, write_json

SCHEMA = "symasym-derivation/1"


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
