"""Build the site of the documentation: ``python docs/build.py``, then open build/site/index.html.

The formulas' pages are made from the derivations, which `symasym derive` checks. Nothing is
fetched but MathJax, by npm, once.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# What takes TeX and draws SVG, with all it may load while it does; see docs/mathjax.js.
PARTS = ["startup.js", "core.js", "input/tex.js", "input/tex", "output/svg.js", "LICENSE"]
PARTS += ["a11y/assistive-mml.js"]


def install(folder: Path) -> Path:
    """The folder of node's packages with the MathJax that docs/package.json names."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / "docs" / "package.json", folder)
    if not (folder / "node_modules" / "mathjax").is_dir():
        flags = ["--no-audit", "--no-fund", "--no-package-lock", "--loglevel=error"]
        subprocess.run(["npm", "install", *flags], cwd=folder, check=True)
    return folder / "node_modules"


def place(modules: Path, goal: Path) -> None:
    """Copy what pages need of MathJax."""
    font = modules / "@mathjax" / "mathjax-newcm-font"
    pairs = [(modules / "mathjax" / part, part) for part in PARTS]
    pairs += [(font / name, f"fonts/mathjax-newcm-font/{name}") for name in ("svg.js", "svg")]
    for source, name in pairs:
        (goal / name).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if source.is_dir() else shutil.copy)(source, goal / name)


def main() -> int:
    """Build; the exit status is Sphinx's."""
    parser = argparse.ArgumentParser(prog="docs/build.py", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "build", help="default: %(default)s")
    parser.add_argument("--node-modules", type=Path, help="where MathJax is installed already")
    parser.add_argument("-W", dest="strict", action="store_true", help="a warning is a failure")
    args = parser.parse_args()
    sys.path[:0] = [str(ROOT / "docs"), str(ROOT)]
    from sphinx.cmd.build import build_main
    from website.stage import stage

    begun = time.perf_counter()
    work, site = args.out / ".symasym-site", args.out / "site"
    if site.exists() and not (site / "_static" / "mathjax").exists():
        parser.error(f"{site} holds other files; give another folder as --out.")
    modules = args.node_modules or install(work / "node")
    made = stage(work / "source")
    # Made beside the site and moved there when whole, so that no page of an older one is left.
    fresh = work / "html"
    shutil.rmtree(fresh, ignore_errors=True)
    options = ["-c", str(ROOT / "docs"), "-d", str(work / "doctrees"), "-b", "html", "-q", "-E"]
    strict = ["-W", "--keep-going"] if args.strict else []
    if status := build_main([*options, *strict, str(work / "source"), str(fresh)]):
        return int(status)
    place(modules, fresh / "_static" / "mathjax")
    shutil.rmtree(site, ignore_errors=True)
    fresh.rename(site)
    print(f"{site / 'index.html'}: {made} pages made, {time.perf_counter() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
