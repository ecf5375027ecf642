"""Compiles what is written in LaTeX, where there is an engine."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

needs_latex = pytest.mark.skipif(
    shutil.which("pdflatex") is None,
    reason="no LaTeX engine: install texlive-latex-base (apt)",
)


def compiled(path: Path) -> str:
    """What the engine says of this file; the PDF is beside it."""
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", path.name],
        cwd=path.parent,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout
