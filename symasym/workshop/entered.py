"""Which files of the package one call enters: what a newcomer has to read to follow it.

Run as ``python -m symasym.workshop.entered``. A function counts where it is called at least once
(`sys.setprofile`), after a first call has loaded the modules; analyses that are kept are
dropped.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import symasym as sa
from symasym.base.inputs import Numbers
from symasym.workshop.report.timing import forget

HERE = Path(__file__).parents[1]


class Call(NamedTuple):
    """A call, and how many files it may enter; None where no bound is set."""

    name: str
    most: int | None
    ask: Callable[[], Any]


def calls() -> list[Call]:
    """The calls that are looked at, of friction's T at weak noise."""
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    kappas = [0.05, 0.06, 0.08]

    def time(kappa: Numbers = "0.1", **options: Any) -> Callable[[], Any]:
        """A call of T, for friction's drift."""
        return lambda: sa.escape_time(drift, kappa, 10, **options)

    return [
        Call("exact, float", 10, time()),
        Call("exact, 40 digits", 10, time(dps=40)),
        Call("laplace, float", 12, time(method="laplace")),
        Call("laplace, array", 12, time(kappas, method="laplace")),
        Call("laplace, 40 digits", 12, time(method="laplace", dps=40)),
        Call("uniform, order 0", 15, time(method="uniform", order=0)),
        Call("uniform, order 2", 15, time(method="uniform", order=2)),
    ]


def entered(ask: Callable[[], Any]) -> dict[str, int]:
    """Files of the package that a call enters, each with the number of its functions called."""
    ask()
    forget()
    functions: set[Any] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        """Keep the code of a function that is called."""
        if event == "call":
            functions.add(frame.f_code)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        ask()
    finally:
        sys.setprofile(before)
    counts: dict[str, int] = {}
    for code in functions:
        path = Path(code.co_filename)
        if path.is_relative_to(HERE) and path.name != Path(__file__).name:
            name = path.relative_to(HERE).as_posix()
            counts[name] = counts.get(name, 0) + 1
    return dict(sorted(counts.items()))


def table(names: bool = False) -> str:
    """One line a call: files entered, the bound, functions called; the files with `names`."""
    lines = [f"{'T of friction':20} {'files':>5} {'bound':>5} {'functions':>9}"]
    for call in calls():
        counts = entered(call.ask)
        most = "" if call.most is None else str(call.most)
        lines.append(f"{call.name:20} {len(counts):>5} {most:>5} {sum(counts.values()):>9}")
        if names:
            lines += [f"    {count:>3}  {name}" for name, count in counts.items()]
    return "\n".join(lines)


if __name__ == "__main__":
    print(table("--files" in sys.argv[1:]))
