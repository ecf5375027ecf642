"""The main job: figures, reference table, derivations; what is missing or stale is made."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import derivations
import symasym as sa
from derivations.pages import derive, names, with_roots
from symasym.base.estimate import interval_text
from symasym.base.files import (
    progress,
    read_json,
    reference_value,
    versions,
    write_bytes,
    write_json,
)
from symasym.base.inputs import choice, digits
from symasym.formula import labels
from symasym.workshop import figures, standard

DPS = 50
#: Spring extensions of the reference table.
Z0 = tuple(f"{-k / 20:.2f}" for k in range(40, 0, -1))
_STAMPS, _TABLE, _DERIVATIONS = ".stamps.json", "reference.json", "derivations"
_STANDARD = "standard.json"
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded right


class Stage(NamedTuple):
    """Files, and ``make(folder, dps, step)``, which writes them and calls `step` so often."""

    name: str
    files: tuple[str, ...]
    steps: int
    make: Callable[[Path, int, Callable[[], object]], None]


def reproduce(
    out: str | Path = "build",
    only: Iterable[str] | None = None,
    dps: int = DPS,
    force: bool = False,
) -> Iterator[tuple[Stage, float | None]]:
    """Each stage when it is done, with its seconds; None where it was up to date.

    A stage is stale when the package, a library, the digits or one of its files has changed since
    it was made; with `force` each is. `only` names stages, all of them when left out.
    """
    digits(dps)
    stages, folder = {stage.name: stage for stage in _stages()}, Path(out)
    wanted = {choice("stage", name, stages) for name in (stages if only is None else only)}
    inputs = [_source(), *sorted(versions("numpy", "mpmath", "python-flint", "sympy").items()), dps]
    for stage in (stages[name] for name in stages if name in wanted):
        stamps = read_json(folder / _STAMPS) or {}
        if not force and stamps.get(stage.name) == _stamp(stage, folder, inputs):
            yield stage, None
            continue
        start = time.perf_counter()
        with progress(stage.name, stage.steps) as bar:
            stage.make(folder, dps, bar.update)
        stamps[stage.name] = _stamp(stage, folder, inputs)
        write_json(folder / _STAMPS, stamps)
        yield stage, time.perf_counter() - start


def _source() -> str:
    """A hash over everything that the packages are made of."""
    folders = [Path(str(package.__file__)).parent for package in (sa, derivations)]
    files = sorted(p for folder in folders for p in folder.rglob("*") if p.suffix != ".pyc")
    return _hash(*(p.read_bytes() for p in files if p.is_file()))


def _stamp(stage: Stage, folder: Path, inputs: list[Any]) -> str:
    """The inputs of a stage and the content of its files, as they are now."""
    files = (folder / name for name in stage.files)
    return _hash(repr(inputs).encode(), *(p.read_bytes() if p.exists() else b"" for p in files))


def _hash(*parts: bytes) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


# -- stages ----------------------------------------------------------------------------------------


def _stages() -> list[Stage]:
    """Every stage, in order."""
    derived = with_roots(labels())
    pages = tuple(f"{_DERIVATIONS}/{name}" for name in names(derived))

    def derive_all(folder: Path, dps: int, step: Callable[[], object]) -> None:
        derive(derived, folder / _DERIVATIONS, step)

    return [
        *map(_figure, figures.FIGURES),
        Stage("reference", (_TABLE,), len(figures.DRAWN) * len(Z0), _table),
        Stage("standard", (_STANDARD,), len(standard.PROBLEMS), _standard),
        Stage(_DERIVATIONS, pages, len(derived), derive_all),
    ]


def _figure(name: str) -> Stage:
    """The stage that draws one figure."""
    kinds = ("png", "svg")

    def make(folder: Path, dps: int, step: Callable[[], object]) -> None:
        figure = figures.FIGURES[name]()
        for kind in kinds:
            write_bytes(folder / f"{name}.{kind}", figures.encode(figure, kind))
            step()

    return Stage(name, tuple(f"{name}.{kind}" for kind in kinds), len(kinds), make)


def _table(folder: Path, dps: int, step: Callable[[], object]) -> None:
    """Write the reference table."""
    values = []
    for mu, kappa in figures.DRAWN:
        scales = sa.rescale(eps=figures.EPS, kappa=kappa, r=figures.R)
        for z0 in Z0:
            drift = sa.friction(mu=mu, alpha=1, z0=z0)
            x = {"mu": mu, "alpha": "1", "z0": z0, "kappa": str(scales.kappa), "r": str(scales.r)}
            scene = drift, scales.kappa, scales.r
            for name, verb in (("T", sa.escape_time), ("C", sa.exit_probability)):
                found = verb(*scene, dps=dps + _GUARD, full=True)
                record = {"drift": "friction", "quantity": name, **reference_value(x, found, dps)}
                record["physical"] = {"eps": figures.EPS, "kappa": kappa, "r": figures.R}
                if name == "T":
                    paper = sa.escape_time(*scene, method="paper", dps=dps)
                    record["paper"] = interval_text(paper, 0, dps, more=True)[0]
                values.append(record)
            step()
    table = {
        "title": "Escape time T and exit probability C of the friction oscillator",
        "scaling": "x holds what symasym takes: kappa/sqrt(eps) and r/eps; T is in units of eps",
        "values": values,
    }
    write_json(folder / _TABLE, table)


def _standard(folder: Path, dps: int, step: Callable[[], object]) -> None:
    write_json(folder / _STANDARD, standard.table(dps, step))


def worst_disagreement(out: str | Path = "build") -> tuple[dict[str, Any], float, int] | None:
    """The record of the reference table in `out` at which the paper's formula is farthest off,
    how far relatively, and of how many; None without a table."""
    from mpmath import mpf

    table = read_json(Path(out) / _TABLE)
    if table is None:
        return None
    compared = [record for record in table["values"] if "paper" in record]
    off = [float(abs(mpf(r["paper"]) / mpf(r["mid"]) - 1)) for r in compared]
    worst = max(range(len(off)), key=off.__getitem__)
    return compared[worst], off[worst], len(off)
