"""Keep a report in docs/: ``python docs/keep.py build/report``.

Copies its points, and the stability report's where the folder has one, draws their diagrams,
and puts the parts of their pages into docs/accuracy.md and docs/speed.md. Without a folder, makes
all that anew from the points that are kept. With ``--picture`` draws three pictures of expansions,
in a minute.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symasym.base.files import write_bytes
from symasym.workshop.figures import encode
from symasym.workshop.report import diagrams, pages, stability
from symasym.workshop.report.measure import Cell, Point
from symasym.workshop.report.timing import Grown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS = Path(__file__).parent
# Parts of the report of error against run time that are about time.
SPEED = {"when", "diagram", "growth"}
# File of a report -> its name in docs/.
KEPT = {
    "points.json": "measured.json",
    "stability.json": "stability.json",
}


def main(arguments: list[str] | None = None) -> int:
    """Copy from the folders, then write the pages."""
    parser = argparse.ArgumentParser(prog="docs/keep.py")
    parser.add_argument("folders", nargs="*", type=Path, help="of `symasym report`")
    parser.add_argument("--picture", action="store_true", help="draw the expansions' errors, too")
    args = parser.parse_args(arguments)
    for folder in args.folders:
        for name, kept in KEPT.items():
            if (folder / name).exists():
                write_bytes(DOCS / kept, short((folder / name).read_bytes()))
    for name, text in made().items():
        write_bytes(DOCS / name, text.encode())
    for name, figure in drawn().items():
        write_bytes(DOCS / name, encode(figure, "svg"))
    if args.picture:
        sys.path.insert(0, str(DOCS))
        from website.plotting import expansions, singulants

        pictures = {
            "expansions": expansions.draw(50),
            "singulants": singulants.draw(),
            "orders": singulants.draw_orders(16),
        }
        for name, picture in pictures.items():
            write_bytes(DOCS / "images" / f"{name}.png", encode(picture, "png"))
    return 0


def short(record: bytes) -> bytes:
    """JSON with a line for each point, and not for each number of it."""
    lines = []
    for key, value in json.loads(record).items():
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, list):
            rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in value)
            text = f"[\n{rows}\n]"
        lines.append(f"{json.dumps(key)}: {text}")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def made() -> dict[str, str]:
    """Page -> its text, its measured parts as the kept points have them."""
    measured, stable = (_record(name) for name in ("measured", "stability"))
    parts = pages.parts(
        [Point(**p) for p in measured["points"]],
        [Grown(**g) for g in measured["growth"]],
        measured["scenes"],
        measured["missing peers"],
        measured["machine"],
        measured["command"],
    ) | stability.parts(
        [Cell(**c) for c in stable["cells"]],
        [stability.Condition(**c) for c in stable["conditions"]],
        stable["missing peers"],
        stable["machine"],
        stable["command"],
    )
    texts = {name: (DOCS / name).read_text("utf-8") for name in ("accuracy.md", "speed.md")}
    for name, part in parts.items():
        page = "speed.md" if name in SPEED else "accuracy.md"
        texts[page] = filled(texts[page], {name: part})
    return texts


def drawn() -> dict[str, Figure]:
    """Diagram -> as the kept points have it."""
    measured, stable = (_record(name) for name in ("measured", "stability"))
    return {
        "work-precision.svg": diagrams.work_precision([Point(**p) for p in measured["points"]]),
        "growth.svg": diagrams.growth([Grown(**g) for g in measured["growth"]]),
        "stability.svg": diagrams.heat_maps([Cell(**c) for c in stable["cells"]]),
    }


def filled(text: str, parts: dict[str, str]) -> str:
    """`text` with each measured part between its marks, which are comments."""
    for name, part in parts.items():
        marks = rf"(<!-- measured: {name} -->\n).*?(<!-- end -->)"
        text, count = re.subn(
            marks, lambda m, part=part: f"{m[1]}\n{part}\n\n{m[2]}", text, flags=re.DOTALL
        )
        if count != 1:
            raise ValueError(f"The page has {count} places for the part {name}; it needs one.")
    return text


def _record(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DOCS / f"{name}.json").read_text("utf-8"))
    return found


if __name__ == "__main__":
    sys.exit(main())
