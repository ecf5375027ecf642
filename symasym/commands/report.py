"""The command ``symasym report``."""

from __future__ import annotations

import argparse

from symasym.commands.settings import Commands, command


def add_parser(commands: Commands) -> None:
    """Add the parser of ``report``."""
    parser = command(
        commands, "report",
        "measure error against run time, of all methods and the peers that are installed",
        run, "symasym report --quick", 'symasym report --scene "friction k=0.1" --quick',
    )  # fmt: skip
    parser.add_argument(
        "--scene", nargs="+", action="extend", metavar="NAME", help="these scenes, not all"
    )
    parser.add_argument("--quick", action="store_true", help="fewer orders and peers: minutes")
    parser.add_argument(
        "--stability", action="store_true", help="digits claimed and true, over the extreme scenes"
    )
    parser.add_argument("-o", "--out", default="build/report", metavar="DIR", help="output folder")


def run(arguments: argparse.Namespace) -> int:
    """Status 1 if one of our methods claimed more digits than were right."""
    from symasym.base.errors import InputError

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
