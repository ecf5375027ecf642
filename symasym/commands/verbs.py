"""The commands of ``symasym``: functions of the options that were given on the command line."""

from __future__ import annotations

import inspect
import json
import multiprocessing
import os
import re
import sys
import textwrap
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import symasym as sa
from symasym.base.errors import InputError, OutputError
from symasym.base.estimate import interval_text, with_error
from symasym.base.files import progress, write_bytes
from symasym.base.inputs import choice, count, digits
from symasym.drift.ready_made import named_drift

#: The quantities of `value`, by their letters.
QUANTITIES = {
    "T": "escape-time", "C": "exit-probability", "P": "occupation", "p": "stationary-density",
}  # fmt: skip
_DRIFT = ("drift", "expr", "layer", "noise", "ito")
_NOISES = {"laplace": "weak", "strong_noise": "strong", "uniform": "uniform"}


def _drift(options: dict[str, Any], values: dict[str, str]) -> Any:
    """The drift of the options for one, which are removed; None if there are none."""
    of = {name: options.pop(name) for name in _DRIFT if name in options}
    return named_drift(values, **of) if of else None


def value(quantity: str, kappa: str, dps: Any = None, **options: Any) -> None:
    """Print one number. All inputs are scaled (u = y/eps) and exact as written.

    examples:
      symasym value escape-time --expr "1/2 - u + b*u**3" --set b=3/4 --kappa 0.3 --r 5 --dps 30
      symasym value T --expr "u - u**3" --no-layer --kappa 1/2 --ends -2 0 --start -1
      symasym value exit-probability --expr -1/3 --kappa 1/10 --r 5 --log --method laplace --json
      symasym value stationary-density --expr "-u" --no-layer --noise "1 + u**2" --kappa 1 --y 1/2
    """
    name, as_json = QUANTITIES.get(quantity, quantity), options.pop("json", False)
    values = dict(options.pop("set", ()))
    inputs = {"set": values, "kappa": kappa, **options}
    options.setdefault("drift", None)
    drift = _drift(options, values)
    p = options.pop("quantile", None) if name == "escape-time" else None
    verb: Any = sa.exit_law if p else getattr(sa, name.replace("-", "_"))
    if wrong := min(options.keys() - inspect.signature(verb).parameters, default=""):
        raise InputError(f"{name}{' --quantile' if p else ''} takes no --{wrong}; see --help.")
    if verb is sa.stationary_density and "y" not in options:
        raise InputError("the stationary density is that at a position; give --y.")
    # A few more digits than are printed, so that the last printed one is rounded correctly.
    more = None if dps is None else min(digits(dps) + 5, 1_000 if p else 10_000)
    start = time.perf_counter()
    answer = verb(drift, kappa, **options, dps=more, full=True)
    found = answer.quantile(p) if p else answer
    claims = found.error is not None
    shown, error = interval_text(found.value, found.error or 0, dps or (17 if claims else 12))
    text = shown
    sure = found.method == "exact" and found.error_kind == "bound"
    if claims and not sure:  # few digits may be right
        text = with_error(found.value, found.error)
        shown, error = text.split(" ± ")
    record: dict[str, Any] = {"quantity": name, "value": shown, "error": error if claims else None}
    record |= {known: getattr(found, known) for known in ("error_kind", "method", "notes")}
    record |= {"dps": dps, "seconds": round(time.perf_counter() - start, 6), "inputs": inputs}
    print(json.dumps(record, indent=1) if as_json else text)
    for note in () if as_json else found.notes:
        print(f"note: {note}", file=sys.stderr)


def release(kappa: str, r: str, eps: str, z: str, start: str = "0", **options: Any) -> None:
    """Print the time of release of a sticking block while its slow variable moves.

    The system is the friction oscillator, with mu = 3 and alpha = 1 unless they are set, or any
    system du = phi dt + kappa noise dW, dz = eps velocity dt. All inputs are scaled and exact.

    examples:
      symasym release --kappa 0.3 --r 10 --eps 0.01 --z -0.4
      symasym release --phi "7/5 - u - z" --velocity -1 --kappa 1 --r 5 --eps 0.01 --z 0
    """
    given = {"mu": "3", "alpha": "1", **dict(options.pop("set", ()))}
    if unknown := min(given.keys() - {"mu", "alpha"}, default=""):
        raise InputError(f"{unknown} is not a parameter of the oscillator; give mu or alpha.")
    block, as_json = sa.oscillator(**given), options.pop("json", False)
    system = sa.System(*(options.pop(n, getattr(block, n)) for n in ("phi", "velocity", "noise")))
    answer = sa.release(system, kappa, r, eps=eps, start=(start, z), **options)
    stated = ("mean", "error", "method", "std", "exit", "notes")
    known: dict[str, Any] = {name: getattr(answer, name) for name in stated}
    for name, law in (("time", answer.time), ("z", answer.z)):
        known[name] = {str(p): float(law.quantile(p)) for p in (0.05, 0.5, 0.95)}
    print(json.dumps(known, indent=1) if as_json else answer)


def table(spec: str, out: str, workers: int = 1, cluster: str | None = None) -> int:
    """Make a table of exact values from a spec.

    A spec has lines such as expr = "1 - u", kappa = [0.5, 1] and r = 2. JSON lines, CSV and LaTeX
    are written; an interrupted table is completed. The exit status is 1 if a value is missing.

    examples:
      symasym table well.toml -o well.jsonl
      symasym table well.toml -o well.jsonl --workers 4
    """
    from symasym.tables import read_spec, write_table

    executor: Any = None
    if cluster is not None:
        try:
            from distributed import Client

            executor = Client(cluster, timeout=10).get_executor()
        except (ImportError, OSError, ValueError) as error:
            raise OutputError(
                f"no cluster is reached at {cluster!r} ({error}); start a dask scheduler, with "
                "the extra symasym[cluster] installed."
            ) from None
    elif count("--workers", workers, 1, 1_000) > 1:
        executor = ProcessPoolExecutor(workers, initializer=_end_with_parent)
    records, done = write_table(read_spec(spec), out, executor)
    made = f"{len(records) - done} of them new" if done < len(records) else "up to date"
    print(f"{out}, with CSV and LaTeX beside it: {len(records)} values, {made}")
    if refused := sum(record["mid"] is None for record in records):
        print(f"Without a value: {refused}; their lines say why.")
    return 1 if refused else 0


def _end_with_parent() -> None:
    """End this process when its parent process has ended, for example because it was killed."""
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()


def _expansion(label: str, options: dict[str, Any], others: tuple[str, ...] = ()) -> Any:
    """The expansion for a label such as ``expansion:T``; None for others, with these options."""
    kind, _, name = label.partition(":")
    if kind == "expansion":
        more = dict(options)
        values, method = dict(more.pop("set", ())), more.pop("method", "laplace")
        noise: Any = _NOISES[choice("method", method, _NOISES)]
        drift = _drift(more, values) or sa.Drift.general().bind(**values)
        return sa.expand(drift, name.replace("1-", "1 - "), noise=noise, **more)  # type: ignore[arg-type]
    if wrong := options.keys() - set(others):
        raise InputError(f"--{min(wrong)} is for an expansion such as expansion:T; leave it out.")
    return None


def derive(labels: Any = (), out: str = "build/derivations") -> None:
    """Check the derivations of formulas and of all formulas they rest on (default: all).

    examples:
      symasym derive
      symasym derive eq:Ttilde
    """
    from derivations import pages

    chosen = pages.with_roots(sa.formula(label).label for label in labels or sa.labels())
    with progress("derivations", len(chosen)) as bar:
        pages.derive(chosen, Path(out), bar.update)
    for f in map(sa.formula, labels or chosen):
        print(f"{f.label}: {f.title}; steps that hold: {len(f.steps)}; error: {f.error}")
    print(f"{len(chosen)} derivations hold; pages in {out}")


def emit(label: str, target: str = "numpy", out: str | None = None, **options: Any) -> None:
    """Write a formula as source code.

    examples:
      symasym emit eq:Ttilde --target c --drift friction --set mu=3 --set alpha=1 -o time.c
      symasym emit expansion:T --target c --drift friction --order 2 -o time.c
    """
    if (expansion := _expansion(label, options, (*_DRIFT, "set"))) is not None:
        source = expansion.emit(target)
    else:
        # Parameters that determine the form of a drift are set here; `emit` binds the others.
        rest = dict(options.pop("set", ()))
        shapes = {n: rest.pop(n) for n in [*rest] if options and re.fullmatch(r"c\d+|waves|n", n)}
        source = sa.emit(label, target, rest, drift=_drift(options, shapes))
    print(source if out is None else f"{source.write(out)}\n", end="")


def show(labels: Any = (), latex: bool = False, steps: bool = False, **options: Any) -> None:
    """Print formulas; without a label, list them.

    examples:
      symasym show fr1 --latex --steps
      symasym show expansion:T --drift friction --order 2
    """
    from derivations.labels import DEFINITIONS
    from derivations.pages import document
    from symasym.derivation.derivation import LABELS

    if latex and not labels:
        print(document(), end="")
    elif not labels:
        print("\n".join(f"{label:20} {LABELS[label][0]}" for label in sa.labels()))
    for label in labels:
        if (expansion := _expansion(label, options)) is not None:
            print(expansion.latex() if latex else expansion)
            continue
        if label in DEFINITIONS:
            shown, text = DEFINITIONS[label]
            print(shown if latex else f"{shown}\n\n{label} defines {text}.")
            continue
        f = sa.formula(label)
        if latex:
            print(f.latex())
        else:
            notes = [f"Here {f.note}."] if f.note else []
            print(f"{label}: {f.title}\n", *map(_drawn, f.concluded), sep="\n")
            print(f"Error: {f.error}.", *notes, *f.assumptions, sep="\n")
        for number, step in enumerate(f.steps if steps else (), 1):
            told = f"{number}. {step.name}{': ' * bool(step.why)}{step.why}"
            print(told, step.latex() if latex else _drawn(step), sep="\n" if latex else "\n\n")


def _drawn(step: Any) -> str:
    """A step drawn in characters without line breaks; in LaTeX if its left side is LaTeX."""
    import sympy

    from symasym.derivation.tex import tex

    if isinstance(step.left, str):
        return f"{step.latex()}\n"
    relation = "==" if step.relation == "=" else step.relation
    equation = sympy.Rel(step.left, step.right, relation, evaluate=False)
    plain = r"\\(mathrm|tilde|hat|var)?|[{}]|_(?=\w\))"
    names = {s: sympy.Symbol(re.sub(plain, "", tex(s))) for s in equation.free_symbols}
    return f"{sympy.pretty(equation.xreplace(names), num_columns=10_000)}\n"


def reproduce(out: str = "build", only: Any = None, dps: int = 50, force: bool = False) -> None:
    """Make the paper's figures, reference values, standard problems and the derivations.

    Files that are up to date are not made again.

    examples:
      symasym reproduce --only phase
      symasym reproduce --dps 30 --out build
    """
    from symasym.workshop import reproduce as workshop

    with ProcessPoolExecutor(initializer=_end_with_parent) as pool:
        for stage, files, seconds in workshop.reproduce(out, only, dps, force, pool):
            spent = "up to date" if seconds is None else f"{seconds:.1f} s"
            print(f"{stage}: {len(files)} files in {out} ({spent})", flush=True)


def figure(name: str | None = None, out: str | None = None) -> None:
    """Draw one of the paper's figures from the model and print its caption.

    It is written to NAME.png and NAME.svg, or to the .png, .svg or .pdf file given by --out.
    Without a name the figures are listed.

    examples:
      symasym figure fric1 -o fric1.svg
      symasym figure phase
    """
    from symasym.workshop.figures import FIGURES, KINDS, encode

    if name is None:
        for known, draw in FIGURES.items():
            print(f"{known:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    files = [out] if out else [f"{name}.png", f"{name}.svg"]
    kinds = {file: choice(f"the ending of {file}", Path(file).suffix[1:], KINDS) for file in files}
    drawn = FIGURES[choice("the figure", name, FIGURES)]()
    for file, kind in kinds.items():
        write_bytes(file, encode(drawn, kind))
    print(*files, textwrap.fill(str(drawn.get_label()), 100), sep="\n")


def verify(level: str = "quick", seed: int = 1) -> int:
    """Compare the stated error of every method with the true error, on all scenes.

    The exit status is 1 if a true error exceeds the stated one.

    examples:
      symasym verify
      symasym verify --level full --seed 2
    """
    from symasym.workshop import check

    found, table = check.verify(level, seed)
    print(table)
    return int(not all(r.holds for r in found))


def report(scene: Any = None, quick: bool = False, out: str = "build/report") -> int:
    """Measure error and run time of all methods and of other programs.

    The exit status is 1 if a method of symasym claims more digits than are correct.

    examples:
      symasym report --quick
      symasym report --scene "friction k=1"
    """
    from symasym.workshop import check

    found, paths = check.report(out, scene, quick)
    wrong = [r for r in found if not r.holds]
    told = (f"{r.scene}, {r.method}: states {r.stated:.2g}, off by {r.error:.2g}" for r in wrong)
    print(*paths, *told, sep="\n")
    return int(bool(wrong))
