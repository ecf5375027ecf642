"""log(Ai^2 + Bi^2) in double precision, as a helper of the emitted files.

The tables are those of `symasym.special.airy`, the function is that of `airy_kernel`;
with NumPy it is written for arrays.
"""

from __future__ import annotations

from symasym.emit.kernels import airy as airy_kernel
from symasym.emit.kernels import tables
from symasym.emit.kernels.kernel import kernel_of, reached
from symasym.emit.kernels.transcribe import transcribed

_NUMPY = '''def _horner(rows, t):
    total = 0.0
    for row in rows[::-1]:
        total = total * t + row
    return total


def _log_modulus(x):
    """log(Ai(x)^2 + Bi(x)^2)."""
    x = np.asarray(x, dtype=np.float64)
    # Both forms at every x, each within its own range.
    near, size = np.clip(x, -8, 8), np.maximum(np.abs(x), 8)
    piece = np.minimum((2 * (near + 8)).astype(int), 31)
    inside = _horner(_AIRY_NEAR[:, piece], 2 * (2 * (near + 8) - piece) - 1)
    root = np.sqrt(size)
    t = 16 * np.sqrt(8) / (size * root) - 1
    outside = np.where(x > 0, _horner(_AIRY_ABOVE, t), _horner(_AIRY_BELOW, t)) / root
    above = np.maximum(x, 0)
    # Left out of the tables where x > 1.
    rise = np.where(x >= 1, 4 * above * np.sqrt(above) / 3, 0)
    return (np.log(np.where(np.abs(x) <= 8, inside, outside)) + rise)[()]
'''


def _tables(target: str) -> list[str]:
    return [tables.written(name, row, target) for name, row in tables.airy(False).items()]


def _file(target: str) -> str:
    kernel = reached(kernel_of(airy_kernel), "_log_modulus", {})
    return "\n".join([*_tables(target), "", transcribed(kernel, target), ""])


def in_python() -> str:
    """The helper of the target "python"."""
    kernel = reached(kernel_of(airy_kernel), "_log_modulus", {})
    return "\n".join([*_tables("python"), "", "", "\n\n\n".join(kernel.functions.values()), ""])


def in_numpy() -> str:
    """The helper of the target "numpy"."""
    rows = [
        text.replace(" = (", " = np.array([").removesuffix(")")
        + ("]).reshape(32, 13).T" if "NEAR" in text else "])")
        for text in _tables("python")
    ]
    return "\n".join([*rows, "", "", _NUMPY])


def in_javascript() -> str:
    """The helper of the target "javascript"."""
    return _file("javascript")


def in_c() -> str:
    """The helper of the target "c"."""
    return _file("c")
