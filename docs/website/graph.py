"""A drawing of a graph without circles: in rows from top to bottom, as an SVG with links."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from html import escape
from itertools import pairwise

from derivations.pages import slug

WIDTH, HEIGHT = 117, 22
ROW, GAP, LANE, MARGIN, SWEEPS = 56, 5, 10, 2, 12
#: Boxes of a row: as many as a page has room for.
MOST = 5

Rests = dict[str, list[str]]


def layers(rests: Rests) -> dict[str, int]:
    """The row of each node, below all that it rests on; `rests` comes in that order.

    A node goes to the first row that has room for it (Coffman and Graham's layering); one without
    any arrow takes none.
    """
    level: dict[str, int] = {}
    used = {b for below in rests.values() for b in below}
    room: Counter[int] = Counter()
    for node, below in rests.items():
        row = 1 + max((level[b] for b in below), default=-1)
        while room[row] == MOST:
            row += 1
        level[node] = row
        room[row] += bool(below) or node in used
    return level


def _rows(rests: Rests) -> list[list[str]]:
    """The nodes by layer, a long arrow's way through the layers between as nodes of its own."""
    level = layers(rests)
    rows: list[list[str]] = [[] for _ in range(max(level.values()) + 1)]
    used = {b for below in rests.values() for b in below}
    for node, place in level.items():
        if rests[node] or node in used:
            rows[place].append(node)
    for node, below in rests.items():
        for b in below:
            for place in range(level[b] + 1, level[node]):
                rows[place].append(f"{b} > {node} @ {place}")
    return rows


def _way(b: str, node: str, level: dict[str, int]) -> list[str]:
    return [b, *(f"{b} > {node} @ {p}" for p in range(level[b] + 1, level[node])), node]


def positions(rests: Rests) -> dict[str, tuple[float, int]]:
    """Middle and row of the nodes and of the arrows' bends; neighbours are brought together."""
    level, rows = layers(rests), _rows(rests)
    links = [
        link
        for node, below in rests.items()
        for b in below
        for link in pairwise(_way(b, node, level))
    ]
    before: dict[str, list[str]] = {}
    after: dict[str, list[str]] = {}
    for upper, lower in links:
        before.setdefault(lower, []).append(upper)
        after.setdefault(upper, []).append(lower)
    widths = {node: WIDTH + GAP if node in rests else LANE for row in rows for node in row}
    widest = max(sum(widths[node] for node in row) for row in rows)
    middle = {node: float(place) for row in rows for place, node in enumerate(row)}
    for sweep in range(SWEEPS):
        near = before if sweep % 2 == 0 else after
        for row in rows if sweep % 2 == 0 else reversed(rows):
            wanted = {n: _mean([middle[o] for o in near.get(n, [n])]) for n in row}
            row.sort(key=lambda n: wanted[n])
            x = MARGIN + (widest - sum(widths[node] for node in row)) / 2
            for node in row:
                middle[node] = x + widths[node] / 2
                x += widths[node]
    return {node: (middle[node], place) for place, row in enumerate(rows) for node in row}


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def svg(rests: Rests, titles: Mapping[str, str]) -> str:
    """The drawing, a title at each node; nodes without any arrow are left out of it."""
    at, level = positions(rests), layers(rests)
    right = max(x for x, _ in at.values()) + WIDTH / 2 + MARGIN
    bottom = max(row for _, row in at.values()) * ROW + HEIGHT + 2 * MARGIN
    lines = [
        f'<div class="graph"><svg viewBox="0 0 {right:g} {bottom}" width="{right:g}" '
        'role="img" aria-label="Which formula rests on which"><defs><marker id="arrowhead" '
        'viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" '
        'markerUnits="userSpaceOnUse" orient="auto"><polygon points="0 0 8 4 0 8"/></marker></defs>'
    ]
    for node, below in rests.items():
        for b in below:
            way = _curve([at[bend] for bend in _way(b, node, level)])
            lines.append(f'<path d="{way}" marker-end="url(#arrowhead)"/>')
    for node in rests:
        if node in at:
            x, y = at[node][0], MARGIN + at[node][1] * ROW
            fit = f' textLength="{WIDTH - 8}" lengthAdjust="spacingAndGlyphs"' * (len(node) > 16)
            lines.append(
                f'<a href="{slug(node)}.html"><title>{escape(titles[node])}</title>'
                f'<rect x="{x - WIDTH / 2:g}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="4"/>'
                f'<text x="{x:g}" y="{y + HEIGHT // 2 + 4}"{fit}>{escape(node)}</text></a>'
            )
    return "\n".join([*lines, "</svg></div>"])


def _curve(way: list[tuple[float, int]]) -> str:
    """From the lower side of one box to the upper side of the next, upright at every bend."""
    x, y = way[0][0], float(MARGIN + way[0][1] * ROW + HEIGHT)
    path = [f"M {x:g} {y:g}"]
    for below, row in way[1:]:
        top = MARGIN + row * ROW
        half = (y + top) / 2
        path.append(f"C {x:g} {half:g} {below:g} {half:g} {below:g} {top} V {top + HEIGHT}")
        x, y = below, top + HEIGHT
    # The last row's box begins where the arrow ends.
    return " ".join(path).rpartition(" V ")[0]
