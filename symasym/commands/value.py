"""The command ``symasym value``."""

from __future__ import annotations

import argparse
import json
import time
from typing import TYPE_CHECKING, Any

from symasym.commands.settings import Commands, settings
from symasym.drift.named import DRIFTS, named_drift

if TYPE_CHECKING:
    from symasym.base.estimate import Estimate


def add_parser(commands: Commands) -> None:
    """Add the parsers of ``value``, one a quantity."""
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
        quantity.add_argument(
            "--patience", type=float, default=10.0, metavar="SECONDS", help="that it may take (10)"
        )
        quantity.add_argument("--json", action="store_true", help="with error, method, time")
        quantity.set_defaults(run=run, quantity=name, verb=verb)


def _order(text: str) -> int | str:
    """An order as a number, or ``"optimal"``."""
    return text if text == "optimal" else int(text)


def run(arguments: argparse.Namespace) -> None:
    """``symasym value``."""
    import symasym as sa
    from symasym.base.files import decimal_text
    from symasym.base.inputs import digits

    given: dict[str, Any] = vars(arguments)
    takes = ("kappa", "r", "y", "start", "method", "order", "rtol", "complement", "log")
    inputs = {name: given[name] for name in takes if name in given}
    # A few digits more than are printed, so that the last printed one is rounded right.
    dps = None if arguments.dps is None else min(digits(arguments.dps) + 5, 10_000)
    drift = named_drift(arguments.drift, arguments.expr, settings(arguments.set))
    verb = getattr(sa, arguments.verb)
    start = time.perf_counter()
    options = {"dps": dps, "full": arguments.json, "patience": arguments.patience}
    answer = verb(drift, **inputs, **options)
    seconds = time.perf_counter() - start
    if arguments.json:
        _print_json(arguments, inputs, answer, seconds)
    elif dps is None:
        print(repr(float(answer)))
    else:
        print(decimal_text(answer, arguments.dps))


def _print_json(
    arguments: argparse.Namespace, inputs: dict[str, Any], estimate: Estimate, seconds: float
) -> None:
    """Print the value with its error, kind, method, time and inputs."""
    from symasym.base.files import decimal_ball, decimal_text

    error: str | None
    if arguments.dps is None:
        value = repr(float(estimate.value))
        error = None if estimate.error is None else repr(float(estimate.error))
    elif estimate.error is None:
        value, error = decimal_text(estimate.value, arguments.dps), None
    else:
        value, error = decimal_ball(estimate.value, estimate.error, arguments.dps)
    drift = {"expr": arguments.expr} if arguments.expr else {"drift": arguments.drift}
    record = {
        "quantity": arguments.quantity,
        "value": value,
        "error": error,
        "error_kind": estimate.error_kind,
        "method": estimate.method,
        "dps": arguments.dps,
        "seconds": round(seconds, 6),
        "inputs": {**drift, "set": settings(arguments.set), **inputs},
    }
    print(json.dumps(record, indent=1))
