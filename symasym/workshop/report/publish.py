"""The files of a report: pages, diagrams and the record, each whole or not written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from symasym.base.files import versions, write_bytes, write_json
from symasym.workshop.report.methods import missing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LIBRARIES = ("numpy", "mpmath", "gmpy2", "python-flint", "scipy", "sympy", "matplotlib")


def publish(
    folder: Path,
    texts: dict[str, bytes],
    figures: dict[str, Figure],
    record: tuple[str, str, str, dict[str, Any]],
) -> list[Path]:
    """The paths of what was written.

    Parameters
    ----------
    folder : path
    texts : dict
        File name -> content.
    figures : dict
        Name without ending -> figure, drawn as PNG and SVG.
    record : tuple
        File name, command, machine and what was measured, of the JSON file.
    """
    from symasym.workshop.figures.style import encode

    files = texts | {
        f"{name}.{kind}": encode(figure, kind)
        for name, figure in figures.items()
        for kind in ("png", "svg")
    }
    for name, content in files.items():
        write_bytes(folder / name, content)
    last, command, where, measured = record
    about = {"command": command, "machine": where, "versions": versions(*_LIBRARIES)}
    write_json(folder / last, {**about, "missing peers": missing(), **measured})
    return [folder / name for name in (*files, last)]
