"""Build the site of the documentation: ``python docs/build.py``, then open build/site/index.html.

The formulas' pages are made from the derivations, which `symasym derive` checks. Nothing is
fetched but MathJax, by npm, once.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main(arguments: list[str] | None = None) -> int:
    """Build; the exit status is Sphinx's, or 1 for what keeps the site from being built."""
    parser = argparse.ArgumentParser(prog="docs/build.py", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "build", help="default: %(default)s")
    parser.add_argument("--node-modules", type=Path, help="where MathJax is installed already")
    parser.add_argument("-W", dest="strict", action="store_true", help="a warning is a failure")
    args = parser.parse_args(arguments)
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        from sphinx.cmd.build import build_main
    except ImportError as error:
        print(f"docs/build.py: {error}; install the extra `docs`.", file=sys.stderr)
        return 1
    from website import stage

    from symasym.base.errors import SymasymError

    begun = time.perf_counter()
    work, site = args.out / "docs", args.out / "site"
    try:
        modules = args.node_modules or stage.install(work / "node")
        made = stage.all_pages()
    except (stage.NoMathJax, SymasymError) as error:
        print(f"docs/build.py: {error}", file=sys.stderr)
        return 1
    stage.stage(work / "source", made)
    # Made beside the site and moved there when whole, so that no page of an older one is left.
    fresh = work / "html"
    shutil.rmtree(fresh, ignore_errors=True)
    options = ["-c", str(ROOT / "docs"), "-d", str(work / "doctrees"), "-b", "html", "-q", "-E"]
    strict = ["-W", "--keep-going"] if args.strict else []
    status = build_main([*options, *strict, str(work / "source"), str(fresh)])
    if status:
        return int(status)
    stage.place(modules, fresh / "_static")
    shutil.rmtree(site, ignore_errors=True)
    fresh.rename(site)
    print(f"{site / 'index.html'}: {len(made)} pages made, {time.perf_counter() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
