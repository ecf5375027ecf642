"""Digits claimed and digits true: a cell for each method and scene, and the methods' order."""

from __future__ import annotations

from dataclasses import dataclass

#: What is asked of ours: (method, setting).
OURS = (
    ("exact", "float64"),
    ("exact, arrays", "float64"),
    ("exact", "35 digits"),
    ("exact, proved", "15 digits"),
    ("laplace", "order 2"),
    ("uniform", "order 2"),
    ("local", "leading order"),
    ("strong_noise", "order 2"),
    ("paper", "leading order"),
    ("auto", "rtol 1e-6"),
)
#: No more digits than these are distinguished.
MOST = 40.0


@dataclass
class Cell:
    """A method on a scene: digits of log T (of T where log T is below 1)."""

    scene: str
    method: str
    setting: str
    ours: bool
    claimed: float | None
    true: float | None
    kind: str
    reason: str

    @property
    def wrong(self) -> bool:
        """True if more digits are claimed than are right."""
        if self.claimed is None or self.true is None:
            return False
        return self.true < min(self.claimed, MOST) - 1e-6


def columns(cells: list[Cell]) -> list[tuple[str, str]]:
    """The methods with their settings, ours first."""
    first = sorted(cells, key=lambda c: (not c.ours, _rank(c)))
    return list(dict.fromkeys((c.method, c.setting) for c in first))


def _rank(cell: Cell) -> int:
    """The rank of a cell's method in `OURS`; peers come last."""
    key = (cell.method, cell.setting)
    return OURS.index(key) if key in OURS else len(OURS)
