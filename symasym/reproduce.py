"""The main job: the paper's figures and a reference table, rebuilt where missing or stale."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import symasym as sa
from symasym import figures, progress
from symasym.errors import InputError
from symasym.files import (
    decimal_text,
    read_json,
    reference_value,
    versions,
    write_bytes,
    write_json,
)
from symasym.inputs import digits

DPS = 50
#: Spring extensions of the reference table.
Z0 = tuple(f"{-k / 20:.2f}" for k in range(40, 0, -1))
# Digits beyond those printed, so that the last printed one is rounded right.
_GUARD = 5
_TABLE = "reference.json"
_STAMPS = ".stamps.json"


@dataclass(frozen=True)
class Stage:
    """Files made from exact inputs.

    Attributes
    ----------
    name : str
    files : tuple of str
        Names in the output folder.
    steps : int
        How often `build` reports a step.
    build : callable
        ``build(dps, step)`` yields the content of each file in turn and calls `step`
        after every step.
    by_digits : bool
        Whether the files depend on `dps`.
    """

    name: str
    files: tuple[str, ...]
    steps: int
    build: Callable[[int, Callable[[], object]], Iterable[bytes]]
    by_digits: bool = False


@dataclass(frozen=True)
class Outcome:
    """What became of a stage; `seconds` is None where its files were up to date."""

    stage: Stage
    seconds: float | None


@dataclass(frozen=True)
class Disagreement:
    """Where the paper's formula is farthest from the exact value, relative to the latter."""

    mu: str
    kappa: str
    z0: str
    paper: str
    exact: str
    relative: float
    scenes: int


def reproduce(
    out: str | Path = "build",
    only: Iterable[str] | None = None,
    dps: int = DPS,
    force: bool = False,
) -> Iterator[Outcome]:
    """Make what is missing or stale, stage by stage.

    A stage is stale when the package, a library it uses, its inputs or the content of one
    of its files has changed since it was made.

    Parameters
    ----------
    out : path
        Output folder.
    only : iterable of str, optional
        Names of stages; all of them when left out.
    dps : int
        Digits of the reference table.
    force : bool
        Make everything again.

    Yields
    ------
    Outcome
        One for each stage, when it is done.

    Raises
    ------
    InputError
        If a stage is unknown.
    OutputError
        If a file cannot be written.
    """
    chosen = _chosen(only)
    digits(dps)
    folder = Path(out)
    common = {"source": _source_hash(), "versions": versions(*_LIBRARIES)}
    for stage in chosen:
        inputs = {**common, "dps": dps} if stage.by_digits else common
        if not force and _stamps(folder).get(stage.name) == _stamp(stage, folder, inputs):
            yield Outcome(stage, None)
            continue
        start = time.perf_counter()
        with progress.stage(stage.name, stage.steps) as step:
            for name, content in zip(stage.files, stage.build(dps, step), strict=True):
                write_bytes(folder / name, content)
        stamps = {**_stamps(folder), stage.name: _stamp(stage, folder, inputs)}
        write_json(folder / _STAMPS, stamps)
        yield Outcome(stage, time.perf_counter() - start)


def worst_disagreement(out: str | Path = "build") -> Disagreement | None:
    """The worst of the reference table in `out`; None where there is no table."""
    from mpmath import mp

    table = read_json(Path(out) / _TABLE)
    if table is None:
        return None
    found = [record for record in table["values"] if "paper" in record]

    def relative(record: dict[str, Any]) -> Any:
        return abs(mp.mpf(record["paper"]) / mp.mpf(record["mid"]) - 1)

    worst = max(found, key=relative)
    return Disagreement(
        mu=worst["x"]["mu"],
        kappa=worst["physical"]["kappa"],
        z0=worst["x"]["z0"],
        paper=worst["paper"],
        exact=worst["mid"],
        relative=float(relative(worst)),
        scenes=len(found),
    )


def _chosen(only: Iterable[str] | None) -> list[Stage]:
    if only is None:
        return list(STAGES)
    names = set(only)
    for name in sorted(names - {stage.name for stage in STAGES}):
        known = ", ".join(stage.name for stage in STAGES)
        raise InputError(f"{name} is no stage of reproduce; its stages are {known}.")
    return [stage for stage in STAGES if stage.name in names]


# -- what is up to date ----------------------------------------------------------------------

_LIBRARIES = ("numpy", "mpmath", "matplotlib", "gmpy2", "python-flint")


def _source_hash() -> str:
    """A hash over everything the package is made of."""
    folder = Path(sa.__file__).parent
    parts = sorted(p for p in folder.rglob("*") if p.suffix in {".py", ".mplstyle"})
    return _hash(*(text for p in parts for text in (p.name.encode(), p.read_bytes())))


def _stamps(folder: Path) -> dict[str, Any]:
    found = read_json(folder / _STAMPS)
    return found if isinstance(found, dict) else {}


def _stamp(stage: Stage, folder: Path, inputs: dict[str, Any]) -> dict[str, Any]:
    """The inputs of a stage and the content of its files, as they are now."""
    contents = {}
    for name in stage.files:
        try:
            contents[name] = _hash((folder / name).read_bytes())
        except OSError:
            contents[name] = "missing"
    return {"inputs": _hash(json.dumps(inputs, sort_keys=True).encode()), "files": contents}


def _hash(*parts: bytes) -> str:
    found = hashlib.sha256()
    for part in parts:
        found.update(hashlib.sha256(part).digest())
    return found.hexdigest()


# -- stages ----------------------------------------------------------------------------------


def _figure(name: str) -> Stage:
    def build(dps: int, step: Callable[[], object]) -> Iterator[bytes]:
        figure = getattr(figures, name)()
        for kind in ("png", "svg"):
            content = figures.encode(figure, kind)
            step()
            yield content

    return Stage(name, (f"{name}.png", f"{name}.svg"), 2, build)


def _table(dps: int, step: Callable[[], object]) -> Iterator[bytes]:
    values = [
        record for mu, kappa in figures.DRAWN for record in _curve_records(mu, kappa, dps, step)
    ]
    table = {
        "title": "Escape time T and exit probability C of the friction oscillator",
        "scaling": "x holds what symasym takes: kappa/sqrt(eps) and r/eps; T is in units of eps",
        "values": values,
    }
    yield (json.dumps(table, indent=1) + "\n").encode()


def _curve_records(
    mu: str, kappa: str, dps: int, step: Callable[[], object]
) -> Iterator[dict[str, Any]]:
    scales = sa.rescale(eps=figures.EPS, kappa=kappa, r=figures.R)
    family = sa.friction(mu=mu, alpha=figures.ALPHA)
    for z0 in Z0:
        drift = family.bind(z0=z0)
        x = {"mu": mu, "alpha": figures.ALPHA, "z0": z0}
        x |= {"kappa": str(scales.kappa), "r": str(scales.r)}
        for name, verb in (("T", sa.escape_time), ("C", sa.exit_probability)):
            found = verb(drift, scales.kappa, scales.r, dps=min(dps + _GUARD, 10_000), full=True)
            record = {
                "quantity": name,
                **reference_value(x, found, dps),
                "physical": {"eps": figures.EPS, "kappa": kappa, "r": figures.R},
            }
            if name == "T":
                paper = verb(drift, scales.kappa, scales.r, method="paper", dps=dps)
                record["paper"] = decimal_text(paper, dps)
            yield record
        step()


STAGES = (
    _figure("fric1"),
    _figure("fric2"),
    Stage("reference", (_TABLE,), len(figures.DRAWN) * len(Z0), _table, by_digits=True),
)
