"""The tutorials as Jupyter notebooks (nbformat 4.5), from the same text as their pages."""

from __future__ import annotations

import base64
import doctest
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent.parent
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([\w./-]+)\)")
# A link to another page leads nowhere from a file that was taken elsewhere.
_INNER = re.compile(r"(?<!!)\[([^\]]*)\]\((?!https?:)[^)]*\)")


def tutorials() -> list[Path]:
    """The pages that become notebooks: all but the one about commands that are interrupted."""
    return [page for page in sorted(DOCS.glob("tutorial-*.md")) if "cluster" not in page.name]


def files() -> dict[str, str]:
    """File name -> notebook, of every such page."""
    return {
        f"notebooks/{page.stem}.ipynb": json.dumps(notebook(page), indent=1, ensure_ascii=False)
        for page in tutorials()
    }


def offered(text: str, name: str) -> str:
    """A tutorial's page with its notebook to download, below the title."""
    title, line, rest = text.partition("\n")
    return f"{title}{line}\n{{download}}`This page as a notebook <notebooks/{name}.ipynb>`\n{rest}"


def notebook(page: Path) -> dict[str, Any]:
    """A page as a notebook: a cell ends at each value that is shown, and has no output yet."""
    cells = list(_cells(page.read_text("utf-8")))
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {
        "nbformat": 4,
        "nbformat_minor": 5,
        "metadata": {"kernelspec": kernel},
        "cells": cells,
    }


def _cells(text: str) -> Iterator[dict[str, Any]]:
    end = 0
    for block in _BLOCK.finditer(text):
        yield from _words(text[end : block.start()])
        end = block.end()
        kind, body = block[1], block[2]
        if kind == "python":
            yield from _session(body) if ">>> " in body else [_code(body)]
        else:
            yield from _words(block[0])
    yield from _words(text[end:])


def _session(session: str) -> Iterator[dict[str, Any]]:
    """Cells of what is typed in a session, cut after each input that shows something."""
    source = ""
    for example in doctest.DocTestParser().get_examples(session):
        source += example.source
        if example.want:
            # The tag by which a run of all cells goes on after an error that is meant.
            yield _code(source, ["raises-exception"] if example.exc_msg else [])
            source = ""
    if source:
        yield _code(source)


def _words(text: str) -> Iterator[dict[str, Any]]:
    text = _INNER.sub(r"\1", text.strip())
    if not text:
        return
    pictures = {name: (DOCS / name).read_bytes() for _, name in _PICTURE.findall(text)}
    cell: dict[str, Any] = {"cell_type": "markdown", "metadata": {}}
    if pictures:
        cell["attachments"] = {
            Path(name).name: {"image/png": base64.b64encode(data).decode()}
            for name, data in pictures.items()
        }
        text = _PICTURE.sub(lambda f: f"![{f[1]}](attachment:{Path(f[2]).name})", text)
    yield {**cell, "source": text}


def _code(source: str, tags: list[str] | None = None) -> dict[str, Any]:
    return {
        "cell_type": "code",
        "metadata": {"tags": tags} if tags else {},
        "execution_count": None,
        "outputs": [],
        "source": source.rstrip("\n"),
    }
