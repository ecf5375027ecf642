"""The tutorials as notebooks: every cell runs and shows what the page shows."""

from __future__ import annotations

import ast
import contextlib
import doctest
import io
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import symasym as sa

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
from website import notebooks

_OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def _run(source: str, names: dict[str, Any]) -> str:
    """What a kernel prints of a cell, and shows of its last expression."""
    body = ast.parse(source).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "<cell>", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)
            if value is not None:
                print(repr(value))
    return printed.getvalue()


@pytest.mark.parametrize("page", notebooks.tutorials(), ids=lambda page: page.stem)
def test_cells_show_what_the_page_shows(page: Path) -> None:
    cells = notebooks.notebook(page)["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    text = page.read_text("utf-8")
    sessions = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    parse = doctest.DocTestParser().get_examples
    typed = "".join("".join(e.source for e in parse(s)) or s for s in sessions)
    assert "\n".join(cell["source"] for cell in code).split() == typed.split()
    examples = [e for s in sessions for e in parse(s)]
    names: dict[str, Any] = {}
    wanted = [e for e in examples if e.want]
    for cell in code:
        if "raises-exception" in cell["metadata"].get("tags", ()):
            said = str(wanted.pop(0).exc_msg)
            with pytest.raises(sa.SymasymError) as caught:
                _run(cell["source"], names)
            assert said.partition(":")[0].endswith(caught.typename)
        elif got := _run(cell["source"], names):
            want = wanted.pop(0).want
            assert doctest.OutputChecker().check_output(want, got, _OPTIONS), (want, got)
    assert not wanted


def test_a_notebook_stands_alone() -> None:
    for page in notebooks.tutorials():
        made = notebooks.notebook(page)
        assert (made["nbformat"], made["nbformat_minor"]) == (4, 5)
        assert len({cell["id"] for cell in made["cells"]}) == len(made["cells"]) > 5
        words = [c for c in made["cells"] if c["cell_type"] == "markdown"]
        assert words[0]["source"].startswith("# ")
        for cell in words:
            assert not re.search(r"\]\((?!https?:|attachment:)", cell["source"])
            for name in re.findall(r"attachment:([\w.]+)", cell["source"]):
                assert cell["attachments"][name]["image/png"]
