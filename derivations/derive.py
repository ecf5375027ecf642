"""Derivations checked, with their pages and trace."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from derivations.labels import REASONS
from derivations.registry import closure, entries
from derivations.report import write
from derivations.runner import known, run
from symasym.base.errors import InputError
from symasym.base.progress import stage

DEFAULT = Path("build/derivations")


def derive(
    labels: list[str] | None = None,
    out: Path = DEFAULT,
    *,
    fresh: bool = False,
    step: Callable[[], object] | None = None,
) -> dict[str, dict[str, Any]]:
    """Check derivations, write their pages and trace.

    Parameters
    ----------
    labels : list of str, optional
        Which; all if left out or empty. What they rest on is checked as well.
    out : path
        Folder of the Markdown and LaTeX pages, ``trace.json`` and the cache.
    fresh : bool
        Take nothing from the cache.
    step : callable, optional
        Called after every derivation; left out, the progress goes to stderr.

    Returns
    -------
    dict
        Label -> record, as `derivations.runner.run` gives it.

    Raises
    ------
    InputError
        For a label that nothing derives.
    """
    chosen = labels or list(entries())
    for label in chosen:
        if label in REASONS:
            raise InputError(f"{label} is not derived. {REASONS[label]}")
        if label not in entries():
            near = [entry for entry in entries() if label.split(":")[-1] in entry]
            hint = f"perhaps {min(near, key=len)}" if near else "sa.labels() lists them"
            raise InputError(f"{label} is no label that is derived; {hint}.")
    with nullcontext(step) if step else stage("derivations", len(closure(chosen))) as report:
        records = run(chosen, out / "cache", report, fresh=fresh)
    # A run of a few labels must not shrink the index and the trace of an earlier full one.
    write({**known(out / "cache"), **records}, out)
    return records
