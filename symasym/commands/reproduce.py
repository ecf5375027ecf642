"""The command ``symasym reproduce``."""

from __future__ import annotations

import argparse
from pathlib import Path

from symasym.commands.settings import Commands, command


def add_parser(commands: Commands) -> None:
    """Add the parser of ``reproduce``."""
    parser = command(
        commands, "reproduce", "make the paper's figures, the reference table and the derivations",
        run, "symasym reproduce --only figures", "symasym reproduce --dps 30 --out build",
        description="Make the paper's figures, the reference table and the pages of the "
        "derivations; what is up to date stays.",
    )  # fmt: skip
    parser.add_argument("--out", default="build", metavar="DIR", help="output folder (build)")
    parser.add_argument(
        "--only", nargs="+", action="extend", metavar="NAME", help="these stages, not all"
    )
    parser.add_argument(
        "--dps", type=int, default=50, metavar="N", help="digits of the reference table (50)"
    )
    parser.add_argument("--force", action="store_true", help="make everything again")


def run(arguments: argparse.Namespace) -> None:
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
