"""The commands of the workshop: ``symasym reproduce``, ``figure``, ``verify``, ``report``."""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path

from symasym.base.errors import InputError
from symasym.base.files import write_bytes
from symasym.commands.settings import Commands, command, takes_place


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

    folder = Path(arguments.out)
    for stage, seconds in reproduce(folder, arguments.only, arguments.dps, arguments.force):
        spent = "up to date" if seconds is None else f"{seconds:.1f} s"
        few = len(stage.files) < 5
        files = (
            ", ".join(str(folder / name) for name in stage.files)
            if few
            else (f"{folder / stage.name}, {stage.steps} derivations whose checks pass")
        )
        print(f"{stage.name}: {files} ({spent})", flush=True)
    if worst := worst_disagreement(folder):
        record, off, scenes = worst
        print(
            f"The paper's formula is farthest from the exact escape time at mu = "
            f"{record['x']['mu']}, kappa = {record['physical']['kappa']}, "
            f"z0 = {record['x']['z0']}: {float(record['paper']):.6g} instead of "
            f"{float(record['mid']):.6g}, "
            f"{100 * off:.3g} % off (the worst of the {scenes} scenes of the reference table)."
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
        "symasym figure fric1 -o fric1.svg", "symasym figure phase",
        description="Draw one of the paper's figures from the model and print its caption. "
        "Without a name, list the figures.",
    )  # fmt: skip
    parser.add_argument("name", nargs="?", metavar="NAME", help="such as phase or fric1")
    files = "a .png, .svg or .pdf file; may be repeated (NAME.png and NAME.svg)"
    takes_place(parser, files, action="append")


def _figure(arguments: argparse.Namespace) -> None:
    """``symasym figure``."""
    from symasym.workshop.figures import FIGURES, KINDS, encode

    name = arguments.name
    if name is None:
        for known, draw in FIGURES.items():
            print(f"{known:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    if name not in FIGURES:
        raise InputError(f"{name} is no figure; the figures are {', '.join(FIGURES)}.")
    files = arguments.out or [f"{name}.png", f"{name}.svg"]
    for file in files:
        if Path(file).suffix[1:] not in KINDS:
            raise InputError(f"{file!r} has no ending that is drawn; end it in .png, .svg or .pdf.")
    figure = FIGURES[name]()
    for file in files:
        write_bytes(file, encode(figure, Path(file).suffix[1:]))
        print(Path(file))
    print(textwrap.fill(str(figure.get_label()), 100))


def add_verify(commands: Commands) -> None:
    """Add the parser of ``verify``."""
    parser = command(
        commands, "verify", "hold every method's stated error against the truth, on all scenes",
        _verify, "symasym verify", "symasym verify --level full --seed 2",
    )  # fmt: skip
    parser.add_argument("--level", default="quick", metavar="NAME", help="quick or full (quick)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of random scenes (1)")


def _verify(arguments: argparse.Namespace) -> int:
    """Status 1 if an error is above the stated one."""
    from symasym.workshop.check import verify

    found, table = verify(arguments.level, arguments.seed)
    print(table)
    return 0 if all(r.holds for r in found) else 1


def add_report(commands: Commands) -> None:
    """Add the parser of ``report``."""
    parser = command(
        commands, "report", "measure error against run time, of all methods and other programs",
        _report, "symasym report --quick", 'symasym report --scene "friction k=1"',
    )  # fmt: skip
    parser.add_argument(
        "--scene", nargs="+", action="extend", metavar="NAME", help="these scenes, not all"
    )
    parser.add_argument("--quick", action="store_true", help="fewer scenes and programs")
    takes_place(parser, "output folder", default="build/report", metavar="DIR")


def _report(arguments: argparse.Namespace) -> int:
    """Status 1 if one of our methods claimed more digits than were right."""
    from symasym.workshop.check import report

    found, paths = report(arguments.out, arguments.scene, arguments.quick)
    for path in paths:
        print(path)
    for r in (wrong := [r for r in found if not r.holds]):
        print(f"{r.scene}, {r.method}: states {r.stated:.2g}, is off by {r.error:.2g}")
    return 1 if wrong else 0
