"""Makes the figures, reference tables and derivations that are missing or out of date.

The reference table has the escape times and exit probabilities of the paper's oscillator. The
standard problems, stated for any program, are du = phi dt + kappa sigma dW until u leaves an
interval: the mean time T, its variance, the probability C of the left end, and the principal
eigenvalue, the rate at which P(tau > t) decays.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import suppress
from functools import partial
from itertools import product, repeat
from pathlib import Path
from typing import Any, Literal, NamedTuple

import derivations
import symasym as sa
from derivations.pages import derive, names, with_roots
from symasym.base.estimate import interval_text
from symasym.base.files import reference_value, versions, write_bytes, write_json
from symasym.base.inputs import choice, digits
from symasym.formula import labels
from symasym.workshop import figures

#: Spring extensions of the reference table.
Z0 = tuple(f"{-k / 20:.2f}" for k in range(40, 0, -1))
_STAMPS = ".stamps.json"
_GUARD = 5  # additional digits, so that the last printed one is rounded correctly


def reproduce(
    out: str | Path = "build",
    only: Iterable[str] | None = None,
    dps: int = 50,
    force: bool = False,
    executor: Executor | None = None,
) -> Iterator[tuple[str, list[str], float | None]]:
    """Yields each finished stage with its files and seconds, None if it was up to date.

    A stage is stale when the package, a library, the digits or one of its files has changed since
    it was made; with `force` each is. `only` names stages, all of them when left out. The executor
    makes them, this process if it is left out.
    """
    digits(dps)
    stages, folder = _stages(), Path(out)
    wanted = {choice("stage", name, stages) for name in (stages if only is None else only)}
    inputs = [_source(), *sorted(versions("numpy", "mpmath", "python-flint", "sympy").items()), dps]
    stamps = {}
    with suppress(OSError, ValueError):
        stamps = json.loads((folder / _STAMPS).read_bytes())

    def stamp(name: str) -> str:
        """The current inputs of a stage and contents of its files."""
        files = (folder / file for file in stages[name][0])
        made = [p.read_bytes() if p.exists() else b"" for p in files]
        return _hash([repr(inputs).encode(), *made])

    asked = [name for name in stages if name in wanted]
    stale = [name for name in asked if force or stamps.get(name) != stamp(name)]
    run: Callable[..., Iterator[float]] = map if executor is None else executor.map
    found = run(_seconds, (stages[name][1] for name in stale), repeat(folder), repeat(dps))
    for name in asked:
        seconds = next(found) if name in stale else None
        if seconds is not None:
            stamps[name] = stamp(name)
            write_json(folder / _STAMPS, stamps)
        yield name, stages[name][0], seconds


def _seconds(make: Callable[[Path, int], None], folder: Path, dps: int) -> float:
    """Make a stage."""
    start = time.perf_counter()
    make(folder, dps)
    return time.perf_counter() - start


def _source() -> str:
    """A hash of all files of the packages."""
    folders = [Path(str(package.__file__)).parent for package in (sa, derivations)]
    files = sorted(p for folder in folders for p in folder.rglob("*") if p.suffix != ".pyc")
    return _hash(p.read_bytes() for p in files if p.is_file())


def _hash(parts: Iterable[bytes]) -> str:
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


# -- stages ----------------------------------------------------------------------------------------


def _stages() -> dict[str, tuple[list[str], Callable[[Path, int], None]]]:
    """The files of every stage, and the functions that write them."""
    kinds, pages = ("png", "svg"), names(labels())
    drawn = {x: ([f"{x}.{k}" for k in kinds], partial(_draw, x)) for x in figures.FIGURES}
    return {
        **drawn,
        "reference": (["reference.json"], _reference),
        "standard": (["standard.json"], _standard),
        "derivations": ([f"derivations/{page}" for page in pages], _derivations),
    }


def _draw(name: str, folder: Path, dps: int) -> None:
    figure = figures.FIGURES[name]()
    for kind in ("png", "svg"):
        write_bytes(folder / f"{name}.{kind}", figures.encode(figure, kind))


def _derivations(folder: Path, dps: int) -> None:
    derive(with_roots(labels()), folder / "derivations", lambda: None)


def _reference(folder: Path, dps: int) -> None:
    values = []
    for (mu, kappa), z0 in product(figures.DRAWN, Z0):
        scales = sa.rescale(eps=figures.EPS, kappa=kappa, r=figures.R)
        x = {"mu": mu, "alpha": "1", "z0": z0, "kappa": str(scales.kappa), "r": str(scales.r)}
        scene = sa.friction(mu, 1, z0), scales.kappa, scales.r
        for name, verb in (("T", sa.escape_time), ("C", sa.exit_probability)):
            found = verb(*scene, dps=dps + _GUARD, full=True)
            record = {"drift": "friction", "quantity": name, **reference_value(x, found, dps)}
            record["physical"] = {"eps": figures.EPS, "kappa": kappa, "r": figures.R}
            if name == "T":
                paper = sa.escape_time(*scene, method="paper", dps=dps)
                record["paper"] = interval_text(paper, 0, dps, more=True)[0]
            values.append(record)
    table = {
        "title": "Escape time T and exit probability C of the friction oscillator",
        "scaling": "x holds what symasym takes: kappa/sqrt(eps) and r/eps; T is in units of eps",
        "values": values,
    }
    write_json(folder / "reference.json", table)


# -- standard problems -----------------------------------------------------------------------------


class Standard(NamedTuple):
    """A scene: phi in pieces, each with its right end, noise, ends and start."""

    name: str
    phi: tuple[tuple[str, str | None], ...]
    kappa: str
    ends: tuple[str, str]
    start: str = "0"
    sigma: str = "1"
    ito: Literal[0, "stratonovich"] = 0
    reflecting: Literal["left", "right"] | None = None

    @property
    def drift(self) -> sa.Drift:
        """phi and sigma."""
        noise = None if self.sigma == "1" else self.sigma
        return sa.Drift.piecewise(self.phi, noise=noise, ito=self.ito)

    @property
    def numbers(self) -> dict[str, Any]:
        """The arguments of the functions apart from kappa."""
        return {"ends": self.ends, "start": self.start, "reflecting": self.reflecting}


_FRICTION = ("12/5", "-1"), ("7/5 - u - 3*(u - u**3)", "1"), ("2/5", None)
_WELLS, _TILTED = (("u - u**3", None),), (("u - u**3 + 1/5", None),)
_HOME, _JUMP, _NOISE = (("-u", None),), (("1 - u/2", "0"), ("-1 - u/2", None)), "1 + u**2/4"

STANDARD = (
    Standard("Brownian motion", (("0", None),), "1", ("-1", "1")),
    Standard("constant drift", (("1", None),), "1", ("-1", "1")),
    Standard("geometric Brownian motion", (("u", None),), "1", ("1/2", "2"), "1", "u"),
    Standard("Ornstein-Uhlenbeck", _HOME, "1", ("-2", "2")),
    Standard("dry friction", (("1", "0"), ("-1", None)), "1", ("-2", "2")),
    Standard("a jump towards the middle", _JUMP, "1", ("-2", "1")),
    Standard("double well, to its barrier", _WELLS, "1/2", ("-2", "0"), "-1"),
    Standard("double well, to the other well", _WELLS, "1/2", ("-2", "1"), "-1", reflecting="left"),
    Standard("tilted double well", _TILTED, "1/2", ("-2", "1"), "-1", reflecting="left"),
    Standard("washboard", (("1/4 - sin(u)", None),), "1/2", ("-3", "6")),
    Standard("friction oscillator", _FRICTION, "1/10", ("-10", "10")),
    Standard("state noise, Itô", _HOME, "1", ("-1", "2"), "0", _NOISE),
    Standard("state noise, Stratonovich", _HOME, "1", ("-1", "2"), "0", _NOISE, "stratonovich"),
)


def _standard(folder: Path, dps: int) -> None:
    records = []
    for problem in STANDARD:
        ask = {**problem.numbers, "dps": dps + _GUARD, "full": True}
        law = sa.exit_law(problem.drift, problem.kappa, **ask)
        found = {"T": law.mean, "variance": law.variance, "rate": law.rate}
        if problem.reflecting is None:
            found["C"] = law.left.probability
        record = problem._asdict()
        for name, x in found.items():
            texts = interval_text(x.value, x.error, dps, more=True)
            record[name] = dict(zip(("mid", "rad"), texts, strict=True))
        records.append(record)
    table = {
        "title": "Standard exit problems: mean time T, its variance, C of the left end, rate",
        "equation": "du = phi(u) dt + kappa sigma(u) dW; phi by pieces with their right ends",
        "error": "proved: each true value lies within rad of mid",
        "dps": dps,
        "versions": versions("mpmath", "python-flint"),
        "problems": records,
    }
    write_json(folder / "standard.json", table)
