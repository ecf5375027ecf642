"""Writing results: whole files or none, and the format of reference values."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symasym.base.errors import OutputError
from symasym.base.estimate import Estimate

if TYPE_CHECKING:
    from mpmath import mpf


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file that is either whole or as it was before, and make its folder where needed."""
    target = Path(path)
    if not target.name:
        raise OutputError(f"the file is {os.fspath(path)!r}; give the name of a file.")
    beside = target.with_name(f".{target.name}.{os.getpid()}.tmp")
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


def decimal_text(value: mpf, dps: int) -> str:
    """An mpf rounded to `dps` digits, trailing zeros included."""
    from mpmath import libmp

    return str(libmp.to_str(value._mpf_, dps, strip_zeros=False))


def decimal_ball(value: mpf, error: mpf, dps: int) -> tuple[str, str]:
    """`value` rounded to `dps` digits, and an `error` that has grown by the rounding.

    Examples
    --------
    >>> from mpmath import mp, mpf
    >>> with mp.workdps(30):
    ...     decimal_ball(mpf(2) / 3, mpf("1e-12"), 10)
    ('0.6666666667', '3.47e-11')
    """
    from mpmath import MPContext

    mid = decimal_text(value, dps)
    context = MPContext()
    context.dps = dps + 20
    rounding = abs(context.mpf(mid) - context.convert(value))
    # Three digits are printed; the factor covers their rounding and that of this sum.
    rad = (rounding + context.convert(error)) * context.mpf("1.01")
    return mid, str(context.nstr(rad, 3))


def reference_value(x: Mapping[str, str], estimate: Estimate, dps: int) -> dict[str, Any]:
    """One value, of exact inputs `x`, as it stands in a JSON file: decimal strings, never floats.

    The estimate's numbers are mpf, best with a few more than `dps` digits.
    """
    mid, rad = decimal_ball(estimate.value, estimate.error, dps)
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
