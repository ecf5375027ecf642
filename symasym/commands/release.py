"""The command ``symasym release``."""

from __future__ import annotations

import argparse
import json
from typing import Any

from symasym.commands.settings import Commands, command, document, listed, settings, takes_settings


def add_parser(commands: Commands) -> None:
    """Add the parser of ``release``."""
    examples = (
        "symasym release --kappa 0.3 --r 10 --eps 0.01 --z -0.4 --quantiles",
        'symasym release --phi "7/5 - u - z" --velocity " -1" --kappa 1 --r 5 --eps 0.01 --z 0',
    )
    parser = command(
        commands, "release",
        "print when a block that sticks comes free while its slow variable moves", run, *examples,
        description="Print the mean time of release of the friction oscillator, or of du = phi dt "
        "+ kappa noise dW, dz = eps velocity dt, in scaled time. All inputs are scaled and exact "
        "as written.",
    )  # fmt: skip
    document(parser, examples, _methods)
    takes_settings(parser, "mu or alpha (3 and 1)")
    parser.add_argument("--phi", metavar="F", help="velocity of u, in u, z and y = eps u")
    parser.add_argument("--velocity", metavar="G", help="velocity of z, in the same")
    parser.add_argument("--noise", metavar="S", help="factor of the noise, in u (1)")
    for name, about in (("kappa", "noise amplitude"), ("r", "radius"), ("eps", "half-width")):
        parser.add_argument(f"--{name}", required=True, metavar="X", help=about)
    parser.add_argument("--start", default="0", metavar="X", help="u at the start (0)")
    parser.add_argument("--z", required=True, metavar="X", help="z at the start")
    parser.add_argument("--method", default="march", metavar="NAME", help="(march)")
    parser.add_argument("--rtol", default="1e-6", metavar="X", help="relative error (1e-6)")
    for name, least in (("paths", 10000), ("seed", 0)):
        about = f"of --method simulate ({least})"
        parser.add_argument(f"--{name}", type=int, default=least, metavar="N", help=about)
    parser.add_argument("--quantiles", action="store_true", help="of the time and of z, too")
    parser.add_argument("--json", action="store_true", help="all of it as a record")


def _methods() -> str:
    """The methods, listed."""
    from symasym.release.answer import METHODS

    return listed("methods", METHODS)


def run(arguments: argparse.Namespace) -> None:
    """``symasym release``."""
    import symasym as sa
    from symasym.base.errors import InputError

    given = settings(arguments.set)
    known = ("mu", "alpha")
    if unknown := min(set(given) - {*known}, default=""):
        raise InputError(
            f"{unknown} is no parameter of the oscillator; its parameters are {', '.join(known)}."
        )
    if (arguments.phi is None) != (arguments.velocity is None):
        raise InputError("one of --phi and --velocity is missing; give both or neither.")
    if arguments.phi is None:
        system = sa.oscillator(**{"mu": "3", "alpha": "1", **given})
        if arguments.noise is not None:
            system = sa.System(system.phi, system.velocity, arguments.noise)
    elif given:
        raise InputError("--set is for the oscillator; write the numbers into --phi.")
    else:
        system = sa.System(arguments.phi, arguments.velocity, arguments.noise or "1")
    taken = ("eps", "method", "rtol", "paths", "seed")
    options = {name: getattr(arguments, name) for name in taken}
    start = arguments.start, arguments.z
    answer = sa.release(system, arguments.kappa, arguments.r, start=start, **options)
    stated = ("mean", "error", "method", "std", "exit")
    record: dict[str, Any] = {name: getattr(answer, name) for name in stated}
    record["notes"] = list(answer.notes)
    if arguments.quantiles:
        levels = [0.05, 0.5, 0.95]
        for name, law in (("time", answer.time), ("z", answer.z)):
            record[name] = {str(p): float(law.quantile(p)) for p in levels}
    if arguments.json:
        print(json.dumps(record, indent=1))
        return
    print(answer)
    print(f"standard deviation {answer.std:.4g}")
    for name in ("time", "z"):
        if name in record:
            shown = ", ".join(f"{x:.4g}" for x in record[name].values())
            print(f"{name}: 5 %, half, 95 % at {shown}")
    for note in answer.notes:
        print(note)
