"""A drawing of a graph without circles: in layers from left to right, as an SVG with links."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from itertools import pairwise

from derivations.runner import slug

WIDTH, HEIGHT = 138, 22
COLUMN, ROW, MARGIN = 196, 34, 8
SWEEPS = 12

Rests = dict[str, list[str]]


def layers(rests: Rests) -> dict[str, int]:
    """The longest way from a node to one that rests on nothing; `rests` comes in that order."""
    level: dict[str, int] = {}
    for node, below in rests.items():
        level[node] = 1 + max((level[b] for b in below), default=-1)
    return level


def _columns(rests: Rests) -> list[list[str]]:
    """The nodes by layer, a long arrow's way through the layers between as nodes of its own."""
    level = layers(rests)
    columns: list[list[str]] = [[] for _ in range(max(level.values()) + 1)]
    used = {b for below in rests.values() for b in below}
    for node, place in level.items():
        if rests[node] or node in used:
            columns[place].append(node)
    for node, below in rests.items():
        for b in below:
            for place in range(level[b] + 1, level[node]):
                columns[place].append(f"{b} > {node} @ {place}")
    return columns


def _way(b: str, node: str, level: dict[str, int]) -> list[str]:
    return [b, *(f"{b} > {node} @ {p}" for p in range(level[b] + 1, level[node])), node]


def positions(rests: Rests) -> dict[str, tuple[float, float]]:
    """Places of the nodes and of the arrows' bends; neighbours are brought to like heights."""
    level, columns = layers(rests), _columns(rests)
    links = [
        link
        for node, below in rests.items()
        for b in below
        for link in pairwise(_way(b, node, level))
    ]
    before: dict[str, list[str]] = {}
    after: dict[str, list[str]] = {}
    for left, right in links:
        before.setdefault(right, []).append(left)
        after.setdefault(left, []).append(right)
    height = {node: float(row) for column in columns for row, node in enumerate(column)}
    tallest = max(map(len, columns))
    for sweep in range(SWEEPS):
        near = before if sweep % 2 == 0 else after
        for column in columns if sweep % 2 == 0 else reversed(columns):
            wanted = {n: _mean([height[o] for o in near.get(n, [n])]) for n in column}
            column.sort(key=lambda n: wanted[n])
            shift = (tallest - len(column)) / 2
            for row, node in enumerate(column):
                height[node] = row + shift
    return {
        node: (MARGIN + place * COLUMN, MARGIN + height[node] * ROW)
        for place, column in enumerate(columns)
        for node in column
    }


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def svg(rests: Rests, titles: Mapping[str, str]) -> str:
    """The drawing, a title at each node; nodes without any arrow are left out of it."""
    at, level = positions(rests), layers(rests)
    right = max(x for x, _ in at.values()) + WIDTH + MARGIN
    bottom = max(y for _, y in at.values()) + HEIGHT + MARGIN
    lines = [
        f'<div class="graph" data-focus=""><svg viewBox="0 0 {right} {bottom}" width="{right}" '
        f'height="{bottom:g}" role="img" aria-label="Which formula rests on which">'
        '<defs><marker id="arrowhead" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
        'markerHeight="8" markerUnits="userSpaceOnUse" orient="auto">'
        '<polygon points="0 0 8 4 0 8"/></marker></defs>'
    ]
    for node, below in rests.items():
        for b in below:
            ends = f'data-from="{slug(b)}" data-to="{slug(node)}"'
            d = _curve(_way(b, node, level), at)
            lines.append(f'<path {ends} d="{d}" marker-end="url(#arrowhead)"/>')
    for node in rests:
        if node in at:
            x, y = at[node]
            lines.append(
                f'<a id="focus-{slug(node)}" data-node="{slug(node)}" href="{slug(node)}.html">'
                f"<title>{escape(titles[node])}</title>"
                f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" '
                f'height="{HEIGHT}" rx="4"/><text x="{x + WIDTH / 2:g}" '
                f'y="{y + HEIGHT / 2 + 4:g}">{escape(node)}</text></a>'
            )
    return "\n".join([*lines, "</svg></div>"])


def _curve(way: list[str], at: dict[str, tuple[float, float]]) -> str:
    """From the right side of one box to the left side of the next, level at every bend."""
    half = HEIGHT / 2
    x, y = at[way[0]]
    path = [f"M {x + WIDTH:g} {y + half:g}"]
    x += WIDTH
    for node in way[1:]:
        nx, ny = at[node]
        bend = (x + nx) / 2
        path.append(f"C {bend:g} {y + half:g} {bend:g} {ny + half:g} {nx:g} {ny + half:g}")
        if node != way[-1]:
            path.append(f"H {nx + WIDTH:g}")
            nx += WIDTH
        x, y = nx, ny
    return " ".join(path)
