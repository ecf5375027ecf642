"""The commands of numbers: ``symasym value``, ``release``, ``table``."""

from __future__ import annotations

import inspect
import json
import multiprocessing
import os
import threading
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import nullcontext
from typing import Any

import symasym as sa
from symasym.base.errors import InputError, OutputError
from symasym.base.estimate import carried_text
from symasym.base.inputs import count, digits
from symasym.drift import scenes
from symasym.drift.ready_made import drift_signatures, named_drift
from symasym.methods import METHODS

_FRICTION = "--drift friction --set mu=3 --set alpha=1 --set z0=-0.4 --kappa 0.1 --r 10"
_LINEAR = "--drift linear --set a_minus=1 --set a_plus=-1"
#: Functions of the library, each with two examples.
QUANTITIES = {
    "escape_time": (
        f"{_FRICTION} --dps 30",
        '--expr "1/2 - u + b*u**3" --set b=3/4 --kappa 0.05 --r 5 --method laplace --order 4',
    ),
    "exit_probability": (
        f"{_FRICTION} --log",
        f"{_LINEAR} --kappa 1 --r 5 --start -1/3 --method strong_noise --json",
    ),
    "occupation": (f"{_LINEAR} --kappa 1 --complement", f"{_LINEAR} --kappa 0.3 --json"),
    "stationary_density": (f"{_LINEAR} --kappa 1 --y 1/2", f"{_LINEAR} --kappa 0.1 --y 3 --log"),
}


def help_of(verb: str) -> str:
    """What a function says of itself, its methods, the drifts with their parameters, examples."""
    about, *_ = str(inspect.getdoc(getattr(sa, verb))).split("\n")
    names = {name for name, quantity in scenes.QUANTITIES.items() if quantity.verb == verb}
    methods = {name: m.about for name, m in METHODS.items() if names & set(m.quantities)}
    methods["auto"] = "exact, or for many kappa an expansion within --rtol"
    lists = {"methods": methods} if names else {}
    lists["drifts, with what --set gives them"] = drift_signatures()
    rows = ["\n".join([f"{title}:", *(f"  {name:14}{text}" for name, text in items.items())])
            for title, items in lists.items()]  # fmt: skip
    lines = (f"  symasym value {verb.replace('_', '-')} {x}" for x in QUANTITIES[verb])
    return "\n\n".join([about.replace("`", ""), *rows, "\n".join(["examples:", *lines])])


def value(
    verb: str,
    *,
    drift: str | None,
    expr: str | None,
    values: Any,
    dps: int | None,
    record: bool,
    **inputs: Any,
) -> None:
    """Print one number. All inputs are scaled (u = y/eps) and exact as written.

    examples:
      symasym value escape-time --help
      symasym value occupation --drift linear --set a_minus=1 --set a_plus=-1 --kappa 1
    """
    made = named_drift(drift, expr, dict(values))
    # A few digits more than are printed, so that the last printed one is rounded right.
    more = None if dps is None else min(digits(dps) + 5, 10_000)
    start = time.perf_counter()
    found = getattr(sa, verb)(made, **inputs, dps=more, full=True)
    seconds = time.perf_counter() - start
    shown, error = carried_text(found.value, found.error, dps or 17)
    if not record:
        print(shown)
        return
    of = {"expr": expr} if expr else {"drift": drift}
    known: dict[str, Any] = {"quantity": verb.replace("_", "-"), "value": shown, "error": error}
    known |= {name: getattr(found, name) for name in ("error_kind", "method", "notes")}
    known |= {"dps": dps, "seconds": round(seconds, 6)}
    known["inputs"] = {**of, "set": dict(values), **inputs}
    print(json.dumps(known, indent=1))


def release(
    *,
    values: Any = (),
    phi: str | None = None,
    velocity: str | None = None,
    factor: str = "1",
    kappa: str,
    r: str,
    eps: str,
    start: str = "0",
    z: str,
    method: Any = "march",
    rtol: str = "1e-6",
    paths: int = 10_000,
    seed: int = 0,
    quantiles: bool = False,
    record: bool = False,
) -> None:
    """Print when a block that sticks comes free while its slow variable moves.

    The friction oscillator, with mu = 3 and alpha = 1 unless they are set; or any system
    du = phi dt + kappa noise dW, dz = eps velocity dt. All inputs are scaled and exact as written.
    Methods: march, the parabolic equation of (u, z), to rtol; simulate, Monte Carlo.

    examples:
      symasym release --kappa 0.3 --r 10 --eps 0.01 --z -0.4 --quantiles
      symasym release --phi "7/5 - u - z" --velocity " -1" --kappa 1 --r 5 --eps 0.01 --z 0
    """
    given = dict(values)
    if unknown := min(set(given) - {"mu", "alpha"}, default=""):
        raise InputError(f"{unknown} is no parameter of the oscillator; it has mu and alpha.")
    if (phi is None) != (velocity is None):
        raise InputError("one of --phi and --velocity is missing; give both or neither.")
    if phi is not None and given:
        raise InputError("--set is for the oscillator; write the numbers into --phi.")
    block = sa.oscillator(**{"mu": "3", "alpha": "1", **given})
    system = sa.System(phi or block.phi, velocity or block.velocity, factor)
    answer = sa.release(
        system, kappa, r, eps=eps, start=(start, z), method=method, rtol=rtol, paths=paths,
        seed=seed,
    )  # fmt: skip
    stated = ("mean", "error", "method", "std", "exit", "notes")
    known: dict[str, Any] = {name: getattr(answer, name) for name in stated}
    laws = {"time": answer.time, "z": answer.z} if quantiles else {}
    for name, law in laws.items():
        known[name] = {str(p): float(law.quantile(p)) for p in (0.05, 0.5, 0.95)}
    if record:
        print(json.dumps(known, indent=1))
        return
    print(answer)
    print(f"standard deviation {answer.std:.4g}")
    for name in laws:
        shown = ", ".join(f"{x:.4g}" for x in known[name].values())
        print(f"{name}: 5 %, half, 95 % at {shown}")
    print(*answer.notes, sep="\n", end="\n" * bool(answer.notes))


def table(spec: str, *, out: str, workers: int = 1, cluster: str | None = None) -> int:
    """Make a table of exact values from a spec.

    JSON lines, with CSV and LaTeX beside them, or what is missing of them; status 1 if some values
    do not exist or could not be had.

    examples:
      symasym table well.toml -o well.jsonl
      symasym table well.toml -o well.jsonl --workers 4
    """
    from symasym.tables import read_spec, write_table

    where: Any = nullcontext()
    if cluster is not None:
        where = _cluster(cluster)
    elif count("--workers", workers, 1, 1_000) > 1:
        where = ProcessPoolExecutor(workers, initializer=_end_with_parent)
    with where as executor:
        records, done = write_table(read_spec(spec), out, executor)
    made = f"{len(records) - done} of them new" if done < len(records) else "up to date"
    print(f"{out}, with CSV and LaTeX beside it: {len(records)} values, {made}")
    if refused := sum(record["mid"] is None for record in records):
        print(f"{refused} values do not exist or could not be had; their lines say why.")
    return 1 if refused else 0


def _end_with_parent() -> None:
    """End this process when its parent is gone, killed for example."""

    def watch() -> None:
        multiprocessing.parent_process().join()  # type: ignore[union-attr]
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _cluster(address: str) -> Executor:
    """The workers of a cluster."""
    try:
        from distributed import Client

        executor: Executor = Client(address, timeout=10).get_executor()
    except (ImportError, OSError, ValueError) as error:
        raise OutputError(
            f"no cluster is reached at {address!r} ({error}); start a dask scheduler, with the "
            "extra symasym[cluster] installed."
        ) from None
    return executor
