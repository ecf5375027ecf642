"""The main job: figures, reference table, derivations; rebuilt where missing or stale."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import derivations
import symasym as sa
from derivations.pages import derive, names, with_roots
from symasym.base import progress
from symasym.base.errors import InputError
from symasym.base.files import decimal_text, read_json, versions, write_bytes, write_json
from symasym.base.inputs import digits, meant
from symasym.formula import labels
from symasym.tables.run import value_record
from symasym.workshop import figures

DPS = 50
#: Spring extensions of the reference table.
Z0 = tuple(f"{-k / 20:.2f}" for k in range(40, 0, -1))
_TABLE = "reference.json"
_STAMPS = ".stamps.json"
_DERIVATIONS = "derivations"


@dataclass(frozen=True)
class Stage:
    """Files made from exact inputs: ``make(folder, dps, step)`` writes them, and calls `step` as
    often as `steps` says.

    `by_digits` where they depend on `dps`; `sources` is a hash of the sources that they come from.
    ``report(folder)`` says what there is to say of the files instead of their names.
    """

    name: str
    files: tuple[str, ...]
    steps: int
    make: Callable[[Path, int, Callable[[], object]], None]
    by_digits: bool = False
    sources: Callable[[], str] = lambda: _folder_hash(sa)
    report: Callable[[Path], str] | None = None

    def summary(self, folder: Path) -> str:
        """The names of the files, or what the stage reports of them."""
        if self.report is not None:
            return self.report(folder)
        return ", ".join(str(folder / name) for name in self.files)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a stage; `seconds` of work is None where its files were up to date."""

    stage: Stage
    seconds: float | None


@dataclass(frozen=True)
class Disagreement:
    """The scene at which the paper's formula is farthest, relatively, from the exact value."""

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
    """The outcome of each stage when it is done; what is missing or stale is made.

    A stage is stale when the package, a library it uses, its inputs or the content of one of its
    files has changed since it was made; with `force` each is. `only` names stages, all of them when
    left out; `dps` are the digits of the reference table.
    """
    chosen = _chosen(only)
    digits(dps)
    folder = Path(out)
    stale = [
        stage
        for stage in chosen
        if force or _stamps(folder).get(stage.name) != _stamp(stage, folder, dps)
    ]
    for stage in chosen:
        if stage not in stale:
            yield Outcome(stage, None)
            continue
        start = time.perf_counter()
        with progress.stage(stage.name, stage.steps) as step:
            stage.make(folder, dps, step)
        stamps = {**_stamps(folder), stage.name: _stamp(stage, folder, dps)}
        write_json(folder / _STAMPS, stamps)
        yield Outcome(stage, time.perf_counter() - start)


def frozen_and_whole() -> tuple[float, float]:
    """T with z frozen at -2/5 and the mean time of release, mu = 3, eps = 1/100, r = 1/10."""
    scales = sa.rescale(eps="0.01", kappa="0.01", r="0.1")
    frozen = sa.escape_time(sa.friction(mu=3, alpha=1, z0="-0.4"), scales.kappa, scales.r)
    block = sa.oscillator(mu=3, alpha=1)
    whole = sa.release(
        block, scales.kappa, scales.r, eps=scales.time, start=(0, "-0.4"), rtol="1e-4"
    )
    return float(frozen), whole.mean


def worst_disagreement(out: str | Path = "build") -> Disagreement | None:
    """The worst of the reference table in `out`; None where there is no table."""
    from mpmath import mp

    table = read_json(Path(out) / _TABLE)
    if table is None:
        return None
    compared = [record for record in table["values"] if "paper" in record]

    def relative(record: dict[str, Any]) -> Any:
        """The distance of the paper's value from the exact one, relative to the latter."""
        return abs(mp.mpf(record["paper"]) / mp.mpf(record["mid"]) - 1)

    worst = max(compared, key=relative)
    return Disagreement(
        mu=worst["x"]["mu"],
        kappa=worst["physical"]["kappa"],
        z0=worst["x"]["z0"],
        paper=worst["paper"],
        exact=worst["mid"],
        relative=float(relative(worst)),
        scenes=len(compared),
    )


def _chosen(only: Iterable[str] | None) -> list[Stage]:
    """The stages named, in their order; all of them without names."""
    stages = _stages()
    if only is None:
        return stages
    wanted = set(only)
    for name in sorted(wanted - {stage.name for stage in stages}):
        known = [stage.name for stage in stages]
        raise InputError(
            f"{name} is no stage of reproduce; its stages are {', '.join(known)}"
            f"{meant(name, known)}."
        )
    return [stage for stage in stages if stage.name in wanted]


# -- what is up to date ----------------------------------------------------------------------

_LIBRARIES = ("numpy", "mpmath", "matplotlib", "python-flint", "sympy")


def _folder_hash(*packages: ModuleType) -> str:
    """A hash over everything that the packages are made of."""
    folders = [Path(str(package.__file__)).parent for package in packages]
    every = (p for folder in folders for p in folder.rglob("*"))
    parts = sorted(p for p in every if p.suffix in {".py", ".mplstyle"})
    return _hash(*(text for p in parts for text in (p.name.encode(), p.read_bytes())))


def _stamps(folder: Path) -> dict[str, Any]:
    """The stamps of the stages that were made in a folder."""
    stamps = read_json(folder / _STAMPS)
    return stamps if isinstance(stamps, dict) else {}


def _stamp(stage: Stage, folder: Path, dps: int) -> dict[str, Any]:
    """The inputs of a stage and the content of its files, as they are now."""
    inputs: dict[str, Any] = {"source": stage.sources(), "versions": versions(*_LIBRARIES)}
    if stage.by_digits:
        inputs["dps"] = dps
    contents = {}
    for name in stage.files:
        try:
            contents[name] = _hash((folder / name).read_bytes())
        except OSError:
            contents[name] = "missing"
    return {"inputs": _hash(json.dumps(inputs, sort_keys=True).encode()), "files": contents}


def _hash(*parts: bytes) -> str:
    """A hash of texts, each by itself."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


# -- stages ----------------------------------------------------------------------------------


def _figure(name: str) -> Stage:
    """The stage that draws one figure."""
    kinds = ("png", "svg")

    def make(folder: Path, dps: int, step: Callable[[], object]) -> None:
        """Draw the figure and write its files."""
        figure = figures.FIGURES[name]()
        for kind in kinds:
            write_bytes(folder / f"{name}.{kind}", figures.encode(figure, kind))
            step()

    return Stage(name, tuple(f"{name}.{kind}" for kind in kinds), len(kinds), make)


def _table(folder: Path, dps: int, step: Callable[[], object]) -> None:
    """Write the reference table."""
    values = [
        record for mu, kappa in figures.DRAWN for record in _curve_records(mu, kappa, dps, step)
    ]
    table = {
        "title": "Escape time T and exit probability C of the friction oscillator",
        "scaling": "x holds what symasym takes: kappa/sqrt(eps) and r/eps; T is in units of eps",
        "values": values,
    }
    write_bytes(folder / _TABLE, (json.dumps(table, indent=1) + "\n").encode())


def _curve_records(
    mu: str, kappa: str, dps: int, step: Callable[[], object]
) -> Iterator[dict[str, Any]]:
    """The values of one curve: T, with the paper's beside it, and C at each z0."""
    scales = sa.rescale(eps=figures.EPS, kappa=kappa, r=figures.R)
    family = sa.friction(mu=mu, alpha=figures.ALPHA)
    for z0 in Z0:
        drift = family.bind(z0=z0)
        x = {"mu": mu, "alpha": figures.ALPHA, "z0": z0}
        x |= {"kappa": str(scales.kappa), "r": str(scales.r)}
        for name in ("T", "C"):
            record = value_record(name, drift, x, dps)
            record["physical"] = {"eps": figures.EPS, "kappa": kappa, "r": figures.R}
            if name == "T":
                paper = sa.escape_time(drift, scales.kappa, scales.r, method="paper", dps=dps)
                record["paper"] = decimal_text(paper, dps)
            yield record
        step()


def _labels() -> list[str]:
    """Every label that is derived."""
    return with_roots(labels())


def _derive(folder: Path, dps: int, step: Callable[[], object]) -> None:
    """Write the pages of every derivation."""
    derive(_labels(), folder / _DERIVATIONS, step)


def _derived(folder: Path) -> str:
    """A line on the derivations that were written, for the terminal."""
    derived = _records(folder)
    steps = sum(len(record["steps"]) for record in derived)
    return f"{folder / _DERIVATIONS}, {len(derived)} derivations whose {steps} checks pass"


def _records(folder: Path) -> list[dict[str, Any]]:
    """The records of the derivations that were written."""
    trace = read_json(folder / _DERIVATIONS / "trace.json")
    return list(trace["derivations"]) if isinstance(trace, dict) else []


def _stages() -> list[Stage]:
    """Every stage, in order."""
    derived = _labels()
    pages = tuple(f"{_DERIVATIONS}/{name}" for name in names(derived))
    return [
        *(_figure(name) for name in figures.FIGURES),
        Stage("reference", (_TABLE,), len(figures.DRAWN) * len(Z0), _table, by_digits=True),
        # Last: what the other stages leave of its time is all that it takes.
        Stage(
            _DERIVATIONS,
            pages,
            len(derived),
            _derive,
            sources=lambda: _folder_hash(sa, derivations),
            report=_derived,
        ),
    ]
