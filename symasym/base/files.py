"""Writing results: whole files or none, the format of reference values, progress."""

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
    """Write a file that is either whole or as it was before, and make its folder where needed."""
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
    """Write `data` as JSON, whole or not at all (see `write_bytes`)."""
    write_bytes(path, (json.dumps(data, indent=1, ensure_ascii=False) + "\n").encode())


def read_json(path: str | os.PathLike[str]) -> Any:
    """The content of a JSON file, or None where there is no readable one."""
    try:
        return json.loads(Path(path).read_bytes())
    except (OSError, ValueError):
        return None


def reference_value(x: Mapping[str, str], estimate: Estimate, dps: int) -> dict[str, Any]:
    """One value, of exact inputs `x`, as it stands in a JSON file: decimal strings, never floats.

    The estimate's numbers are mpf, best with a few more than `dps` digits.
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
    """Versions of symasym, Python and `libraries`."""
    python = {"symasym": metadata.version("symasym"), "python": platform.python_version()}
    return python | {name: metadata.version(name) for name in libraries}


def progress(name: str, total: int, done: int = 0) -> Any:
    """A bar on the standard error stream, of what takes longer than two seconds."""
    from tqdm import tqdm

    return tqdm(total=total, initial=done, desc=name, delay=2, mininterval=1)
