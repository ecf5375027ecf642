"""Docstrings for the site: formulas in plain characters as TeX, pages and labels as links.

In a terminal they read as they are written: ``kappa^2/2``, ``docs/limits.md``, ``eq:Ttilde``.
"""

from __future__ import annotations

import re

from derivations.prose import prose
from derivations.registry import entries
from derivations.runner import slug

#: What is no formula: code, quotations, labels, initials of authors, an article at a line's end,
#: the mark of a list, words with an apostrophe.
_APART = re.compile(
    r"``.*?``|:\w+:`[^`]*`|`[^`]*`|\"[^\"]*\"|\beq:\w+|[\w/-]+\.(?:md|py)\b|\b[A-Z]\. (?=[A-Z])"
    r"|\be\.g\.|\ba$|^\s*- |\b\w+n't\b|(?<=\b\w)'s\b|\S*\*\*\S*|\bint\b(?! h_)"
    r"|\ba (?=float64)"
)
#: An interval of numbers or names.
_INTERVAL = re.compile(r"(?<![\w)])[\[(](-?\w), (-?\w)[\])]")
_FIELD = re.compile(r"\s*:(?:param|returns?|raises?|ivar|vartype|type|rtype)\b[^:]*:|\s*\.\. .*")


def typeset(lines: list[str]) -> list[str]:
    """The lines of a docstring, in reStructuredText, with formulas and links."""
    shown, session = [], False
    for line in lines:
        session = line.lstrip().startswith(">>>") or (session and bool(line.strip()))
        field = _FIELD.match(line)
        head = field[0] if field else ""
        plain = session or re.match(r"\s*:(?:type|rtype|vartype)", line)
        shown.append(line if plain else head + _formulas(line[len(head) :]))
    return [line if ">>>" in line else _linked(line) for line in shown]


def _formulas(line: str) -> str:
    """A line with its formulas in the role ``math``."""
    done, at = "", 0
    for apart in [*_APART.finditer(line), None]:
        end = apart.start() if apart else len(line)
        done += _piece(line[at:end])
        if apart:
            done += _bars(apart[0])
            at = apart.end()
    # Beside a letter, and before a bracket that opens, a role needs an escaped space.
    done = re.sub(r"(?<=\w)(?=:math:`)", r"\\ ", done)
    return re.sub(r"(:math:`[^`]*`)(?=[\w(\[{²^+|])", r"\1\\ ", done)


def _bars(code: str) -> str:
    """A formula between bars, which stands as code in a docstring, as TeX; all else as it is."""
    found = re.fullmatch(r"\$(.*)\$", prose(code.strip("`"), str)) if code[:3] == "``|" else None
    return f":math:`{found[1]}`" if found and "$" not in found[1] else code


def _piece(text: str) -> str:
    found = _INTERVAL.search(text)
    if found:
        role = f":math:`{found[0]}`"
        return _piece(text[: found.start()]) + role + _piece(text[found.end() :])
    return re.sub(r"\$([^$]*)\$", r":math:`\1`", prose(text, str))


def _linked(line: str) -> str:
    """A line whose pages and labels lead to where they are."""
    line = re.sub(r"(?<![\w`/])docs/([\w-]+)\.md", r":doc:`/\1`", line)
    return re.sub(
        r"(?<![\w`\"'/])eq:\w+(?![\w`\"'])",
        lambda m: f":doc:`{m[0]} </formulas/{slug(m[0])}>`" if m[0] in entries() else m[0],
        line,
    )
