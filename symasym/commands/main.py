"""The command ``symasym``."""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from symasym.base.errors import SymasymError
from symasym.commands import derive, emit, figure, report, table, verify
from symasym.commands.settings import settings
from symasym.drift.named import DRIFTS, named_drift

if TYPE_CHECKING:
    from symasym.base.estimate import Estimate
    from symasym.drift.drift import Drift

_BAD_INPUT = 2
_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process when left out.

    Returns
    -------
    int
        0, or 1 for a derivation or check that fails, 2 after an error that is told in one
        sentence, 130 after an interrupt.
    """
    if argv is None:
        argv = sys.argv[1:]
        # A batch system that stops the job is owed the same tidiness as Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    arguments = _parser().parse_args(_join_negative(argv))
    try:
        status = int(arguments.run(arguments) or 0)
        sys.stdout.flush()
    except SymasymError as error:
        print(f"symasym: {error}", file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output has left and needs no word.
        _drop_output()
        return 1
    except OSError as error:
        # Files raise OutputError, so this is standard output itself.
        _drop_output()
        print(
            f"symasym: standard output cannot be written ({error.strerror}); "
            "make room or redirect it.",
            file=sys.stderr,
        )
        return _BAD_INPUT
    return status


def _drop_output() -> None:
    """Send what is still buffered nowhere, or Python fails on it again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _join_negative(argv: Sequence[str]) -> list[str]:
    """Write ``--start -1/3`` as ``--start=-1/3``, which argparse would take for an option."""
    joined: list[str] = []
    for word in argv:
        takes_value = joined and joined[-1] in {"--start", "--y", "--kappa", "--r", "--expr"}
        if takes_value and re.match(r"-[^-]", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _Version(argparse.Action):
    """Look the version up when it is asked for, and not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        print(f"symasym {metadata.version('symasym')}")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="symasym",
        description="Escape times and Laplace-type integrals of smoothed switches with noise.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    _add_reproduce(commands)
    _add_value(commands)
    derive.add_parsers(commands)
    emit.add_parser(commands)
    figure.add_parser(commands)
    table.add_parser(commands)
    verify.add_parser(commands)
    report.add_parser(commands)
    return parser


# -- reproduce -------------------------------------------------------------------------------


def _add_reproduce(commands: Any) -> None:
    parser = commands.add_parser(
        "reproduce",
        help="make the paper's figures, the reference table and the derivations",
        description="Make the paper's figures, the reference table and the pages of the "
        "derivations; what is up to date stays.",
        allow_abbrev=False,
    )
    parser.add_argument("--out", default="build", metavar="DIR", help="output folder (build)")
    parser.add_argument(
        "--only", nargs="+", action="extend", metavar="NAME", help="these stages, not all"
    )
    parser.add_argument(
        "--dps", type=int, default=50, metavar="N", help="digits of the reference table (50)"
    )
    parser.add_argument("--force", action="store_true", help="make everything again")
    parser.set_defaults(run=_reproduce)


def _reproduce(arguments: argparse.Namespace) -> None:
    from symasym.workshop.reproduce import reproduce, worst_disagreement

    for outcome in reproduce(arguments.out, arguments.only, arguments.dps, arguments.force):
        files = outcome.stage.told(Path(arguments.out))
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


# -- value -----------------------------------------------------------------------------------


def _add_value(commands: Any) -> None:
    parser = commands.add_parser(
        "value",
        help="print one number",
        description="Print one number. All inputs are scaled (u = y/eps) and exact as written.",
        allow_abbrev=False,
    )
    quantities = parser.add_subparsers(title="quantities", required=True, metavar="QUANTITY")
    for name, verb, about, escapes in (
        ("escape-time", "escape_time", "mean time to leave |u| < r", True),
        ("exit-probability", "exit_probability", "probability of leaving through -r", True),
        ("occupation", "occupation", "stationary probability of |u| <= 1 (sliding)", False),
        ("stationary-density", "stationary_density", "stationary density at y (sliding)", False),
    ):
        quantity = quantities.add_parser(name, help=about, description=about, allow_abbrev=False)
        what = quantity.add_mutually_exclusive_group(required=True)
        what.add_argument("--drift", choices=DRIFTS, help="a ready-made drift")
        what.add_argument("--expr", metavar="A", help='A(u), e.g. "1/2 - u + u**3"')
        quantity.add_argument(
            "--set", action="append", default=[], metavar="NAME=X", help="set a parameter"
        )
        quantity.add_argument("--kappa", required=True, metavar="X", help="noise amplitude")
        if escapes:
            quantity.add_argument("--r", required=True, metavar="X", help="escape radius")
            quantity.add_argument("--start", default="0", metavar="X", help="starting point (0)")
        if verb == "stationary_density":
            quantity.add_argument("--y", required=True, metavar="X", help="position")
        else:
            quantity.add_argument("--method", default="exact", metavar="NAME", help="(exact)")
            quantity.add_argument(
                "--order", type=_order, metavar="N", help="order of an expansion, or optimal"
            )
            quantity.add_argument(
                "--rtol", metavar="X", help="relative error allowed, for --method auto"
            )
        if verb in ("exit_probability", "occupation"):
            quantity.add_argument("--complement", action="store_true", help="1 minus it")
        quantity.add_argument("--dps", type=int, metavar="N", help="digits (float64 if left out)")
        quantity.add_argument("--log", action="store_true", help="its natural logarithm")
        quantity.add_argument("--json", action="store_true", help="with error, method, time")
        quantity.set_defaults(run=_value, quantity=name, verb=verb)


def _order(text: str) -> int | str:
    return text if text == "optimal" else int(text)


def _value(arguments: argparse.Namespace) -> None:
    import time

    import symasym as sa
    from symasym.base.files import decimal_text
    from symasym.base.inputs import digits

    given: dict[str, Any] = vars(arguments)
    takes = ("kappa", "r", "y", "start", "method", "order", "rtol", "complement", "log")
    inputs = {name: given[name] for name in takes if name in given}
    # A few digits more than are printed, so that the last printed one is rounded right.
    dps = None if arguments.dps is None else min(digits(arguments.dps) + 5, 10_000)
    drift = _drift(arguments)
    verb = getattr(sa, arguments.verb)
    start = time.perf_counter()
    found = verb(drift, **inputs, dps=dps, full=arguments.json)
    seconds = time.perf_counter() - start
    if arguments.json:
        _print_json(arguments, inputs, found, seconds)
    elif dps is None:
        print(repr(float(found)))
    else:
        print(decimal_text(found, arguments.dps))


def _drift(arguments: argparse.Namespace) -> Drift:
    return named_drift(arguments.drift, arguments.expr, settings(arguments.set))


def _print_json(
    arguments: argparse.Namespace, inputs: dict[str, Any], found: Estimate, seconds: float
) -> None:
    import json

    from symasym.base.files import decimal_ball, decimal_text

    error: str | None
    if arguments.dps is None:
        value = repr(float(found.value))
        error = None if found.error is None else repr(float(found.error))
    elif found.error is None:
        value, error = decimal_text(found.value, arguments.dps), None
    else:
        value, error = decimal_ball(found.value, found.error, arguments.dps)
    drift = {"expr": arguments.expr} if arguments.expr else {"drift": arguments.drift}
    record = {
        "quantity": arguments.quantity,
        "value": value,
        "error": error,
        "error_kind": found.error_kind,
        "method": found.method,
        "dps": arguments.dps,
        "seconds": round(seconds, 6),
        "inputs": {**drift, "set": settings(arguments.set), **inputs},
    }
    print(json.dumps(record, indent=1))
