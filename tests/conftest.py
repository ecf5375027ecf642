"""What several modules of tests ask for."""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Iterator

import pytest

from symasym.base.call_context import limited
from tests.guard import is_public


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `every(n)` one of each n parameters in a row is no slow one.

    Which one is decided by the test's name and the row, so that tests over the same table take
    different scenes of it, and no row of a product of two parameters is always left out.
    """
    seen: Counter[str] = Counter()
    for item in items:
        function = getattr(item, "function", None)
        if function and is_public(function.__module__, function.__name__):
            item.add_marker("public")
        if mark := item.get_closest_marker("every"):
            (n,), name = mark.args, item.nodeid.partition("[")[0]
            row, place = divmod(seen[name], n)
            if place != zlib.crc32(f"{name}{row}".encode()) % n:
                item.add_marker(pytest.mark.slow)
            seen[name] += 1


@pytest.fixture(autouse=True)
def _unhurried() -> Iterator[None]:
    """Tests compare numbers, not machines: those of `patience` set their own."""
    with limited(math.inf):
        yield
