"""Atomic output of files, the format of reference values, and the progress bar."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from symasym.base.errors import OutputError
from symasym.base.estimate import Estimate, interval_text


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file atomically: on failure the old file remains. Its folder is made if needed."""
    target = Path(path)
    beside = Path(f"{target}.{os.getpid()}.tmp")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(beside, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, target)
    except OSError as error:
        raise OutputError(
            f"{target} cannot be written ({error.strerror or error}); "
            "make room or choose another place, what was there before is untouched."
        ) from None
    finally:
        with suppress(OSError):
            beside.unlink()


def write_json(path: str | os.PathLike[str], data: object) -> None:
    """Write `data` as JSON, atomically (see `write_bytes`)."""
    write_bytes(path, (json.dumps(data, indent=1, ensure_ascii=False) + "\n").encode())


def reference_value(x: Mapping[str, str], estimate: Estimate, dps: int) -> dict[str, Any]:
    """The record of one value and its exact inputs `x` for a JSON file; numbers are strings.

    The estimate's numbers are mpf, preferably with a few more than `dps` digits.
    """
    mid, rad = interval_text(estimate.value, estimate.error, dps, more=True)
    return {
        "x": dict(x),
        "mid": mid,
        "rad": rad,
        "error_kind": estimate.error_kind,
        "dps": dps,
        "method": estimate.method,
        "versions": versions("mpmath", "python-flint"),
    }


@cache
def versions(*libraries: str) -> dict[str, str]:
    """The versions of symasym, Python and the given libraries."""
    python = {"symasym": metadata.version("symasym"), "python": platform.python_version()}
    return python | {name: metadata.version(name) for name in libraries}


def progress(name: str, total: int, done: int = 0) -> Any:
    """A progress bar on the standard error stream, which appears after two seconds."""
    from tqdm import tqdm

    return tqdm(total=total, initial=done, desc=name, delay=2, mininterval=1)
