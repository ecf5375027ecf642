"""The commands of the workshop: ``symasym reproduce``, ``figure``, ``verify``, ``report``."""

from __future__ import annotations

import argparse
import inspect
import textwrap
from pathlib import Path
from typing import Any

from symasym.base.errors import InputError
from symasym.base.files import write_bytes, write_json
from symasym.base.inputs import meant, whole
from symasym.commands.settings import (
    Commands,
    command,
    settings,
    takes_place,
    takes_settings,
)


def add_reproduce(commands: Commands) -> None:
    """Add the parser of ``reproduce``."""
    parser = command(
        commands, "reproduce", "make the paper's figures, the reference table and the derivations",
        _reproduce, "symasym reproduce --only phase", "symasym reproduce --dps 30 --out build",
        description="Make the paper's figures, the reference table and the pages of the "
        "derivations; what is up to date stays.",
    )  # fmt: skip
    takes_place(parser, "output folder (build)", default="build", metavar="DIR")
    parser.add_argument(
        "--only", nargs="+", action="extend", metavar="NAME", help="these stages, not all"
    )
    parser.add_argument(
        "--dps", type=int, default=50, metavar="N", help="digits of the reference table (50)"
    )
    parser.add_argument("--force", action="store_true", help="make everything again")


def _reproduce(arguments: argparse.Namespace) -> None:
    """``symasym reproduce``."""
    from symasym.workshop.reproduce import frozen_and_whole, reproduce, worst_disagreement

    for outcome in reproduce(arguments.out, arguments.only, arguments.dps, arguments.force):
        files = outcome.stage.summary(Path(arguments.out))
        spent = "up to date" if outcome.seconds is None else f"{outcome.seconds:.1f} s"
        print(f"{outcome.stage.name}: {files} ({spent})", flush=True)
    worst = worst_disagreement(arguments.out)
    if worst is not None:
        print(
            f"The paper's formula is farthest from the exact escape time at mu = {worst.mu}, "
            f"kappa = {worst.kappa}, z0 = {worst.z0}: {float(worst.paper):.6g} instead of "
            f"{float(worst.exact):.6g}, {100 * worst.relative:.3g} % off "
            f"(the worst of the {worst.scenes} scenes of the reference table)."
        )
        frozen, whole = frozen_and_whole()
        print(
            "T has z frozen: at mu = 3, kappa = 0.01, z0 = -0.4 it is "
            f"{frozen:.4g} units of eps, and the whole oscillator, whose belt moves z, releases "
            f"the block after {whole:.4g}."
        )


def add_figure(commands: Commands) -> None:
    """Add the parser of ``figure``."""
    parser = command(
        commands, "figure", "draw one of the paper's figures", _figure,
        "symasym figure fric1 --set mu=3,1/2 -o fric1.svg", "symasym figure phase",
        description="Draw one of the paper's figures from the model and print its caption. "
        "Without a name, list the figures.",
    )  # fmt: skip
    parser.add_argument("name", nargs="?", metavar="NAME", help="such as phase or fric1")
    takes_settings(parser, "set a parameter; several values are separated by commas")

    files = "a .png, .svg or .pdf file; may be repeated (NAME.png and NAME.svg)"
    takes_place(parser, files, action="append")


def _figure(arguments: argparse.Namespace) -> None:
    """``symasym figure``."""
    from symasym.workshop.figures import FIGURES

    if arguments.name is None:
        for name, draw in FIGURES.items():
            print(f"{name:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    if arguments.name not in FIGURES:
        near = meant(arguments.name, FIGURES)
        raise InputError(
            f"{arguments.name} is no figure; the figures are {', '.join(FIGURES)}{near}."
        )
    _write(arguments.name, settings(arguments.set), arguments.out)


def _write(name: str, values: dict[str, str], out: list[str] | None) -> None:
    """Draw a figure, write its files, and print their names and its caption."""
    from symasym.workshop.figures import FIGURES, KINDS, encode

    files = out or [f"{name}.png", f"{name}.svg"]
    for file in files:
        if Path(file).suffix[1:] not in KINDS:
            raise InputError(f"{file!r} has no ending that is drawn; end it in .png, .svg or .pdf.")
    arguments = _read(name, values)
    figure = FIGURES[name](**arguments)
    for file in files:
        write_bytes(file, encode(figure, Path(file).suffix[1:]))
        print(Path(file))
    print(textwrap.fill(str(figure.get_label()), 100))


def _read(name: str, values: dict[str, str]) -> dict[str, Any]:
    """The arguments of a figure's function from their texts."""
    from symasym.workshop.figures import FIGURES

    known = inspect.signature(FIGURES[name]).parameters
    arguments: dict[str, Any] = {}
    for key, text in values.items():
        if key not in known:
            raise InputError(
                f"{key} is no parameter of {name}; its parameters are "
                f"{', '.join(known)}{meant(key, known)}."
            )
        default = known[key].default
        if isinstance(default, tuple):
            arguments[key] = text.split(",")
        else:
            arguments[key] = whole(key, text) if key == "points" else text
    return arguments


def add_verify(commands: Commands) -> None:
    """Add the parser of ``verify``."""
    parser = command(
        commands, "verify",
        "check every formula and evaluator against quadrature, balls and identities",
        _verify, "symasym verify", "symasym verify --level full --seed 2 -o verify.json",
    )  # fmt: skip
    parser.add_argument("--level", default="quick", metavar="NAME", help="quick or full (quick)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of random scenes (1)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (one a processor)")
    takes_place(parser, "write the record there, as JSON")


def _verify(arguments: argparse.Namespace) -> int:
    """Status 0 if all passes, 1 if something fails, 130 after an interrupt."""
    from symasym.workshop.verify import verify
    from symasym.workshop.verify.run import record, table

    report = verify(arguments.level, arguments.seed, arguments.workers)
    if arguments.out:
        write_json(arguments.out, record(report))
    print(table(report))
    if report.interrupted:
        return 130
    return 0 if report.passed else 1


def add_report(commands: Commands) -> None:
    """Add the parser of ``report``."""
    parser = command(
        commands, "report",
        "measure error against run time, of all methods and the other programs that are installed",
        _report, "symasym report --quick", "symasym report --scene weak --quick",
    )  # fmt: skip
    parser.add_argument(
        "--scene", nargs="+", action="extend", metavar="NAME", help="these scenes, not all"
    )
    parser.add_argument("--quick", action="store_true", help="fewer orders and programs: minutes")
    parser.add_argument(
        "--stability", action="store_true", help="digits claimed and true, over the extreme scenes"
    )
    takes_place(parser, "output folder", default="build/report", metavar="DIR")


def _report(arguments: argparse.Namespace) -> int:
    """Status 1 if one of our methods claimed more digits than were right."""
    if arguments.stability:
        from symasym.workshop.report.stability import report as stability

        if arguments.scene:
            raise InputError(
                f"--scene is {' '.join(arguments.scene)}, but --stability has its own scenes; "
                "leave it out."
            )
        wrong, paths = stability(arguments.out, arguments.quick)
    else:
        from symasym.workshop.report.pages import lies, report

        points, paths = report(arguments.out, arguments.scene, arguments.quick)
        wrong = [p for p in lies(points) if p.ours]
    for path in paths:
        print(path)
    for p in wrong:
        print(
            f"{p.scene}, {p.method}, {p.setting}: claims {p.claimed:.2g}, is off by {p.error:.2g}"
        )
    return 1 if wrong else 0
