"""The commands of ``symasym``, each a function of the namespace of arguments from argparse."""

from __future__ import annotations

import inspect
import json
import multiprocessing
import os
import re
import textwrap
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import symasym as sa
from symasym.base.errors import InputError, OutputError
from symasym.base.estimate import interval_text
from symasym.base.files import progress, write_bytes
from symasym.base.inputs import choice, count, digits
from symasym.drift.ready_made import named_drift

QUANTITIES = ("escape-time", "exit-probability", "occupation", "stationary-density")


# -- numbers ---------------------------------------------------------------------------------------


def _drift(a: Any, noise: str | None = None) -> sa.Drift:
    """The drift given by --drift or --expr, --set and --no-layer."""
    more: Any = {"layer": None if a.no_layer else (-1, 1), "noise": noise}
    if a.expr is not None:
        return sa.Drift(a.expr, **more).bind(**dict(a.set))
    made = named_drift(a.drift, None, dict(a.set))
    return sa.Drift(made.expression(), **more) if a.no_layer or noise else made


def value(a: Any) -> None:
    """Print one number. All inputs are scaled (u = y/eps) and exact as written.

    examples:
      symasym value escape-time --expr "1/2 - u + b*u**3" --set b=3/4 --kappa 0.3 --r 5 --dps 30
      symasym value escape-time --expr "u - u**3" --no-layer --kappa 1/2 --ends -2 0 --start -1
      symasym value exit-probability --expr -1/3 --kappa 1/10 --r 5 --log --method laplace --json
      symasym value occupation --drift linear --set a_minus=1 --set a_plus=-1 --kappa 1 --complement
      symasym value stationary-density --expr "-u" --no-layer --noise "1 + u**2" --kappa 1 --y 1/2
    """
    verb = getattr(sa, a.quantity.replace("-", "_"))
    own = ("run", "quantity", "drift", "expr", "set", "no_layer", "noise", "dps", "json")
    given = {n: x for n, x in vars(a).items() if x is not None and x is not False}
    inputs = {n: x for n, x in given.items() if n not in own}
    try:
        inspect.signature(verb).bind(None, **inputs)
    except TypeError as wrong:
        raise InputError(f"{a.quantity}: {wrong}; see symasym value --help.") from None
    # A few more digits than are printed, so that the last printed one is rounded correctly.
    more = None if a.dps is None else min(digits(a.dps) + 5, 10_000)
    start = time.perf_counter()
    found = verb(_drift(a, a.noise), **inputs, dps=more, full=True)
    seconds = time.perf_counter() - start
    claims = found.error is not None
    shown, error = interval_text(found.value, found.error or 0, a.dps or (17 if claims else 12))
    record: dict[str, Any] = {"quantity": a.quantity, "value": shown}
    record |= {"error": error if claims else None}
    record |= {name: getattr(found, name) for name in ("error_kind", "method", "notes")}
    record |= {"dps": a.dps, "seconds": round(seconds, 6)}
    drift = {n: given[n] for n in ("drift", "expr", "no_layer", "noise") if n in given}
    record["inputs"] = {**drift, "set": dict(a.set), **inputs}
    print(json.dumps(record, indent=1) if a.json else shown)


def release(a: Any) -> None:
    """Print the time of release of a sticking block while its slow variable moves.

    The system is the friction oscillator, with mu = 3 and alpha = 1 unless they are set, or any
    system du = phi dt + kappa noise dW, dz = eps velocity dt. All inputs are scaled and exact as
    written. Methods: march, the parabolic equation in (u, z), to rtol; simulate, Monte Carlo.

    examples:
      symasym release --kappa 0.3 --r 10 --eps 0.01 --z -0.4
      symasym release --phi "7/5 - u - z" --velocity -1 --kappa 1 --r 5 --eps 0.01 --z 0
    """
    given = {"mu": "3", "alpha": "1", **dict(a.set)}
    if unknown := min(given.keys() - {"mu", "alpha"}, default=""):
        raise InputError(f"{unknown} is not a parameter of the oscillator; give mu or alpha.")
    block = sa.oscillator(**given)
    system = sa.System(a.phi or block.phi, a.velocity or block.velocity, a.noise)
    more = {name: getattr(a, name) for name in ("eps", "method", "rtol", "paths", "seed")}
    answer = sa.release(system, a.kappa, a.r, start=(a.start, a.z), **more)
    stated = ("mean", "error", "method", "std", "exit", "notes")
    known: dict[str, Any] = {name: getattr(answer, name) for name in stated}
    for name, law in (("time", answer.time), ("z", answer.z)):
        known[name] = {str(p): float(law.quantile(p)) for p in (0.05, 0.5, 0.95)}
    print(json.dumps(known, indent=1) if a.json else answer)


def table(a: Any) -> int:
    """Make a table of exact values from a spec.

    The table is written as JSON lines, CSV and LaTeX; an interrupted table is completed. The exit
    status is 1 if some values do not exist or could not be computed.

    examples:
      symasym table well.toml -o well.jsonl
      symasym table well.toml -o well.jsonl --workers 4
    """
    from symasym.tables import read_spec, write_table

    where: Any = nullcontext()
    if a.cluster is not None:
        try:
            from distributed import Client

            where = Client(a.cluster, timeout=10).get_executor()
        except (ImportError, OSError, ValueError) as error:
            raise OutputError(
                f"no cluster is reached at {a.cluster!r} ({error}); start a dask scheduler, with "
                "the extra symasym[cluster] installed."
            ) from None
    elif count("--workers", a.workers, 1, 1_000) > 1:
        where = ProcessPoolExecutor(a.workers, initializer=_end_with_parent)
    with where as executor:
        records, done = write_table(read_spec(a.spec), a.out, executor)
    made = f"{len(records) - done} of them new" if done < len(records) else "up to date"
    print(f"{a.out}, with CSV and LaTeX beside it: {len(records)} values, {made}")
    if refused := sum(record["mid"] is None for record in records):
        print(f"Without a value: {refused}; their lines say why.")
    return 1 if refused else 0


def _end_with_parent() -> None:
    """End this process when its parent process has ended, for example because it was killed."""
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()


# -- formulas --------------------------------------------------------------------------------------


def _expansion(label: str, a: Any, **options: Any) -> Any:
    """The expansion for a label such as ``expansion:T``; None for others, which have no options."""
    kind, _, name = label.partition(":")
    given: Any = {n: x for n, x in options.items() if x is not None}
    if kind == "expansion":
        drift = _drift(a) if a.drift or a.expr else sa.Drift.general().bind(**dict(a.set))
        more = {n: x for n, x in given.items() if n not in ("drift", "expr")}
        return sa.expand(drift, name.replace("1-", "1 - "), **more)  # type: ignore[arg-type]
    if given:
        raise InputError(f"--{min(given)} is for an expansion such as expansion:T; leave it out.")
    return None


def derive(a: Any) -> None:
    """Check the derivations of formulas and of all formulas they rest on (default: all).

    examples:
      symasym derive
      symasym derive eq:Ttilde
    """
    from derivations import pages
    from symasym.formula import formula, labels

    chosen = pages.with_roots(formula(label).label for label in a.labels or labels())
    with progress("derivations", len(chosen)) as bar:
        pages.derive(chosen, Path(a.out), bar.update)
    for f in map(formula, a.labels or chosen):
        print(f"{f.label}: {f.title}; {len(f.steps)} steps hold; error: {f.error}")
    print(f"{len(chosen)} derivations hold; pages in {a.out}")


def emit(a: Any) -> None:
    """Write a formula as source code.

    examples:
      symasym emit eq:Ttilde --target c --drift friction --set mu=3 --set alpha=1 -o time.c
      symasym emit expansion:T --target c --drift friction --order 2 -o time.c
    """
    if (expansion := _expansion(a.label, a, order=a.order)) is not None:
        source = expansion.emit(a.target)
    else:
        # Parameters that determine the form of a drift are set here; `emit` binds the others.
        shapes = {n: x for n, x in a.set if a.drift and re.fullmatch(r"c\d+|waves|n", n)}
        drift = named_drift(a.drift, a.expr, shapes) if a.drift or a.expr else None
        if drift and a.no_layer:
            drift = sa.Drift(drift.expression(), layer=None)
        rest = {n: x for n, x in a.set if n not in shapes}
        source = sa.emit(a.label, a.target, rest, drift=drift)
    if a.out is None:
        print(source, end="")
    else:
        print(source.write(a.out))


def show(a: Any) -> None:
    """Print formulas.

    examples:
      symasym show fr1 --latex --steps
      symasym show expansion:T --drift friction --order 2
    """
    from derivations.labels import DEFINITIONS
    from derivations.pages import document
    from symasym.formula import formula, labels

    names = ("drift", "expr", "noise", "order", "start", "case")
    options = {name: getattr(a, name) for name in names}
    if a.latex and not a.labels:
        print(document(), end="")
        return
    for label in a.labels or labels():
        if (expansion := _expansion(label, a, **options)) is not None:
            print(expansion.latex() if a.latex else expansion)
        elif label in DEFINITIONS:
            shown, text = DEFINITIONS[label]
            print(shown if a.latex else f"{shown}\n\n{label} defines {text}.")
        else:
            _show(formula(label), a.latex, a.steps)


def _show(shown: Any, latex: bool, steps: bool) -> None:
    """Print a formula in LaTeX, or drawn with its error, note and assumptions."""
    if latex:
        print(shown.latex())
    else:
        print(f"{shown.label}: {shown.title}\n")
        print(*(f"{_drawn(step)}\n" for step in shown.concluded), sep="\n")
        notes = [f"Here {shown.note}."] if shown.note else []
        print(*[f"Error: {shown.error}.", *notes, *shown.assumptions], sep="\n")
    for number, step in enumerate(shown.steps if steps else (), 1):
        print(f"{number}. {step.name}{': ' * bool(step.why)}{step.why}\n   {step.latex()}")


def _drawn(step: Any) -> str:
    """A step drawn in characters without line breaks; in LaTeX if its left side is LaTeX."""
    import sympy

    from symasym.derivation.tex import tex

    if isinstance(step.left, str):
        return str(step.latex())
    relation = "==" if step.relation == "=" else step.relation
    equation = sympy.Rel(step.left, step.right, relation, evaluate=False)
    names = {s: re.sub(r"\\(mathrm|tilde|hat)?|[{}]", "", tex(s)) for s in equation.free_symbols}
    named = equation.xreplace({s: sympy.Symbol(name) for s, name in names.items()})
    return str(sympy.pretty(named, num_columns=10_000))


# -- the workshop ----------------------------------------------------------------------------------


def reproduce(a: Any) -> None:
    """Make the paper's figures, reference values, standard problems and the derivations.

    Files that are up to date are not made again.

    examples:
      symasym reproduce --only phase
      symasym reproduce --dps 30 --out build
    """
    from symasym.workshop import reproduce as workshop

    with ProcessPoolExecutor(initializer=_end_with_parent) as pool:
        for stage, files, seconds in workshop.reproduce(a.out, a.only, a.dps, a.force, pool):
            spent = "up to date" if seconds is None else f"{seconds:.1f} s"
            print(f"{stage}: {len(files)} files in {a.out} ({spent})", flush=True)


def figure(a: Any) -> None:
    """Draw one of the paper's figures from the model and print its caption.

    It is written to NAME.png and NAME.svg, or to the .png, .svg or .pdf file given by --out.
    Without a name the figures are listed.

    examples:
      symasym figure fric1 -o fric1.svg
      symasym figure phase
    """
    from symasym.workshop.figures import FIGURES, KINDS, encode

    if a.name is None:
        for known, draw in FIGURES.items():
            print(f"{known:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    name = choice("the figure", a.name, FIGURES)
    files = [a.out] if a.out is not None else [f"{name}.png", f"{name}.svg"]
    kinds = [choice(f"the ending of {file}", Path(file).suffix[1:], KINDS) for file in files]
    drawn = FIGURES[name]()
    for file, kind in zip(files, kinds, strict=True):
        write_bytes(file, encode(drawn, kind))
        print(file)
    print(textwrap.fill(str(drawn.get_label()), 100))


def verify(a: Any) -> int:
    """Compare the stated error of every method with the true error, on all scenes.

    The exit status is 1 if a true error exceeds the stated one.

    examples:
      symasym verify
      symasym verify --level full --seed 2
    """
    from symasym.workshop import check

    found, table = check.verify(a.level, a.seed)
    print(table)
    return 0 if all(r.holds for r in found) else 1


def report(a: Any) -> int:
    """Measure error and run time of all methods and of other programs.

    The exit status is 1 if a method of symasym claims more digits than are correct.

    examples:
      symasym report --quick
      symasym report --scene "friction k=1"
    """
    from symasym.workshop import check

    found, paths = check.report(a.out, a.scene, a.quick)
    wrong = [r for r in found if not r.holds]
    told = (f"{r.scene}, {r.method}: states {r.stated:.2g}, off by {r.error:.2g}" for r in wrong)
    print(*paths, *told, sep="\n")
    return 1 if wrong else 0
