"""MathJax from its npm package, put beside the pages."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

DOCS = Path(__file__).parent.parent
# What takes TeX and draws SVG, with all it may load while it does; see docs/mathjax.js.
PARTS = (
    "startup.js",
    "core.js",
    "input/tex.js",
    "input/tex",
    "output/svg.js",
    "a11y/assistive-mml.js",
    "LICENSE",
)
FONT = "@mathjax/mathjax-newcm-font"


class NoMathJax(RuntimeError):
    """MathJax is neither installed nor to be had."""


def install(folder: Path) -> Path:
    """The folder of node's packages with the MathJax that docs/package.json names."""
    wanted = json.loads((DOCS / "package.json").read_text("utf-8"))["dependencies"]["mathjax"]
    there = folder / "node_modules" / "mathjax" / "package.json"
    if there.is_file() and json.loads(there.read_text("utf-8"))["version"] == wanted:
        return folder / "node_modules"
    npm = shutil.which("npm")
    if npm is None:
        raise NoMathJax(
            "npm is not installed, and MathJax comes by it; install Node.js, or give "
            "--node-modules the folder of an installed MathJax."
        )
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(DOCS / "package.json", folder)
    command = [npm, "install", "--no-audit", "--no-fund", "--no-package-lock", "--loglevel=error"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise NoMathJax(f"npm could not install MathJax {wanted}: {done.stderr.strip()[-400:]}")
    return folder / "node_modules"


def place(node_modules: Path, static: Path) -> None:
    """Copy what pages need of it to `static`/mathjax."""
    target = static / "mathjax"
    font = node_modules / FONT
    for source, name in [
        *((node_modules / "mathjax" / part, part) for part in PARTS),
        (font / "svg.js", "fonts/mathjax-newcm-font/svg.js"),
        (font / "svg", "fonts/mathjax-newcm-font/svg"),
    ]:
        goal = target / name
        goal.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, goal, dirs_exist_ok=True)
        else:
            shutil.copy(source, goal)
