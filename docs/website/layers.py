"""The picture of the layers in docs/house.md, drawn from the contract in pyproject.toml."""

from __future__ import annotations

import re
import tomllib
from html import escape
from pathlib import Path

DOCS = Path(__file__).parent.parent
MARK = "<!-- the layers -->"
WIDTH, HEIGHT, GAP = 640, 26, 12


def rows() -> list[list[str]]:
    """The rooms of each layer, from the top; a colon between two that may import each other."""
    settings = tomllib.loads((DOCS.parent / "pyproject.toml").read_text("utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (layers,) = (c["layers"] for c in contracts if c["id"] == "layers")
    return [re.findall(r"[\w.]+|:", layer) for layer in layers]


def pages() -> dict[str, str]:
    """File name -> text: what is written in docs/house.md, and the picture in it."""
    text = (DOCS / "house.md").read_text("utf-8")
    if MARK not in text:
        raise ValueError(f"docs/house.md has no line {MARK}, where the picture is to be")
    return {"house.md": text.replace(MARK, f"````{{raw}} html\n{svg()}\n````")}


def svg() -> str:
    """A box a room, a line a layer."""
    layers = rows()
    bottom = len(layers) * (HEIGHT + GAP) - GAP + 2
    lines = [
        f'<div class="graph"><svg viewBox="0 0 {WIDTH} {bottom}" width="{WIDTH}" '
        f'height="{bottom}" role="img" aria-label="The layers of the package">'
    ]
    for number, layer in enumerate(layers):
        rooms = [room for room in layer if room != ":"]
        width = (WIDTH - 2 - GAP * (len(rooms) - 1)) / len(rooms)
        y = 1 + number * (HEIGHT + GAP)
        for place, room in enumerate(rooms):
            x = 1 + place * (width + GAP)
            lines.append(
                f'<rect x="{x:g}" y="{y}" width="{width:g}" height="{HEIGHT}" rx="4"/>'
                f'<text x="{x + width / 2:g}" y="{y + 17}">{escape(room)}</text>'
            )
            if place and ":" in layer:
                lines.append(f'<text x="{x - GAP / 2:g}" y="{y + 17}">:</text>')
        if number:
            middle = WIDTH / 2
            lines.append(f'<path d="M {middle:g} {y - GAP} V {y}"/>')
    return "\n".join([*lines, "</svg></div>"])
