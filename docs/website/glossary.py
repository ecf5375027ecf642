"""The glossary's words: entries of the index, each linked at its first use on another page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

DOCS = Path(__file__).parent.parent
# Words of every day as well, which a link would take for the glossary's.
_PLAIN = {
    "none",
    "panel",
    "block",
    "cell",
    "order",
    "release",
    "pair",
    "check",
    "region",
    "crossing",
    "clock",
    "error",
    "`dps`",
}
# The noun alone: not "as well", nor "without bound".
_NOUN = {
    "well": r"(?:(?<=\ba )|(?<=\bA )|(?<=\bthe )|(?<=\bno ))well|\bwells",
    "bound": r"(?<!without )(?<!be )(?<!is )(?<!are )bounds?",
}
_ROW = re.compile(r"^\| ([^|$]+?) \|(?=[^|]*\|$)", re.MULTILINE)
# What is no prose: code, formulas, links and pictures, headings, tables, tags.
_APART = re.compile(
    r"<script\b.*?</script>|<style\b.*?</style>|<svg\b.*?</svg>|^(?P<fence>`{3,}).*?^(?P=fence)|^:::.*?$|\$\$.*?\$\$|\$[^$]*\$|`[^`]*`|!?\[[^\]]*\]\([^)]*\)|^#.*?$|^\|.*?$|<[^>]*>"
    r"|\*\*.*?\*\*|^ {4}.*?$",
    re.DOTALL | re.MULTILINE,
)


def _named(words: str) -> Iterator[str]:
    """The terms of a row, which may have several."""
    if words == "weak, strong noise":
        yield from ("weak noise", "strong noise")
    elif words not in ("word", "symbol") and not words.startswith("-"):
        yield from words.split(", ")


@cache
def terms() -> dict[str, str]:
    """Term -> its anchor in the glossary, the longest terms first."""
    rows = _ROW.findall((DOCS / "glossary.md").read_text("utf-8"))
    found = {
        term: "term-" + re.sub(r"\W+", "-", row.lower()).strip("-")
        for row in rows
        for term in _named(row)
        if term not in _PLAIN
    }
    return dict(sorted(found.items(), key=lambda item: -len(item[0])))


def anchored(text: str) -> str:
    """The glossary with an anchor at each row, its words and names as entries of the index.

    A symbol's entries are its name in code and the short phrase that its meaning begins with.
    """
    anchors = set(terms().values())

    def row(found: re.Match[str]) -> str:
        name = "term-" + re.sub(r"\W+", "-", found[1].lower()).strip("-")
        cell = f'<span id="{name}"></span>{found[1]}' if name in anchors else found[1]
        words = [a or b.strip() for a, b in re.findall(r"`(\w+)`|(?:^|, )([^$,`]+)", found[1])]
        if found[2].count(" | ") == 2:
            words += re.findall(r"^(?:the )?([a-z-]+(?: [a-z-]+){,2})[,:;]", found[2])
        entries = ", ".join(f"!{word}" for word in words)
        if entries and found[1] not in ("word", "symbol") and found[1][0] != "-":
            # The role shows nothing: a space of no width.
            cell += f"{{index}}`\u200b <{entries}>`"
        return f"| {cell} | {found[2]} |"

    return re.sub(r"^\| (.+?) \| (.+) \|$", row, text, flags=re.MULTILINE)


def linked(text: str) -> str:
    """A page with a link to the glossary where each of its terms is first used in a sentence."""
    apart = [match.span() for match in _APART.finditer(text)]
    taken: list[tuple[int, int, str]] = []
    for term, anchor in terms().items():
        if f"glossary.md#{anchor}" in text or any(goal == anchor for *_, goal in taken):
            continue
        for use in re.finditer(rf"(?<![\w-])(?:{_NOUN.get(term, f'{term}s?')})(?![\w-])", text):
            spans = [*apart, *((a, b) for a, b, _ in taken)]
            if all(use.end() <= a or use.start() >= b for a, b in spans):
                taken.append((*use.span(), anchor))
                break
    for start, end, anchor in sorted(taken, reverse=True):
        link = f'<a class="term" href="glossary.html#{anchor}">{text[start:end]}</a>'
        text = text[:start] + link + text[end:]
    return text
