"""Of tests marked `every(n)`, those that run by default."""

from __future__ import annotations

import zlib
from collections import Counter

import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `every(n)` one of each n parameters in a row is no slow one.

    Which one is decided by the test's name and the row, so that tests over the same table take
    different scenes of it, and no row of a product of two parameters is always left out.
    """
    seen: Counter[str] = Counter()
    for item in items:
        if mark := item.get_closest_marker("every"):
            (n,), name = mark.args, item.nodeid.partition("[")[0]
            row, place = divmod(seen[name], n)
            if place != zlib.crc32(f"{name}{row}".encode()) % n:
                item.add_marker(pytest.mark.slow)
            seen[name] += 1
