"""The command ``symasym value``."""

from __future__ import annotations

import argparse
import json
import time
from functools import partial
from typing import Any

from symasym.commands.settings import Commands, document, listed, settings, takes_settings
from symasym.drift.ready_made.named import DRIFTS, named_drift

_FRICTION = "--drift friction --set mu=3 --set alpha=1 --set z0=-0.4"
_LINEAR = "--drift linear --set a_minus=1 --set a_plus=-1"
#: Command -> verb, what it is, and two examples.
_QUANTITIES = {
    "escape-time": (
        "escape_time", "mean time to leave |u| < r", f"{_FRICTION} --kappa 0.1 --r 10 --dps 30",
        '--expr "1/2 - u + b*u**3" --set b=3/4 --kappa 0.05 --r 5 --method laplace --order 4',
    ),
    "exit-probability": (
        "exit_probability", "probability of leaving through -r",
        f"{_FRICTION} --kappa 0.1 --r 10 --log",
        f"{_LINEAR} --kappa 1 --r 5 --start -1/3 --method strong_noise --json",
    ),
    "occupation": (
        "occupation", "stationary probability of |u| <= 1 (sliding)",
        f"{_LINEAR} --kappa 1 --complement", f"{_LINEAR} --kappa 0.3 --json",
    ),
    "stationary-density": (
        "stationary_density", "stationary density at y (sliding)",
        f"{_LINEAR} --kappa 1 --y 1/2", f"{_LINEAR} --kappa 0.1 --y 3 --log",
    ),
}  # fmt: skip
_TAKEN = ("kappa", "r", "y", "start", "method", "order", "rtol", "complement", "log")


def add_parser(commands: Commands) -> None:
    """Add the parsers of ``value``, one a quantity."""
    parser = commands.add_parser(
        "value",
        help="print one number",
        description="Print one number. All inputs are scaled (u = y/eps) and exact as written.",
        allow_abbrev=False,
    )
    document(parser, [f"symasym value {name} {row[2]}" for name, row in _QUANTITIES.items()])
    quantities = parser.add_subparsers(title="quantities", required=True, metavar="QUANTITY")
    for name, (verb, about, *examples) in _QUANTITIES.items():
        one = quantities.add_parser(name, help=about, description=about, allow_abbrev=False)
        lines = [f"symasym value {name} {line}" for line in examples]
        document(one, lines, partial(_methods_and_drifts, verb))
        what = one.add_mutually_exclusive_group(required=True)
        what.add_argument("--drift", choices=DRIFTS, help="a ready-made drift")
        what.add_argument("--expr", metavar="A", help='A(u), e.g. "1/2 - u + u**3"')
        takes_settings(one, "set a parameter")
        one.add_argument("--kappa", required=True, metavar="X", help="noise amplitude")
        if verb in ("escape_time", "exit_probability"):
            one.add_argument("--r", required=True, metavar="X", help="escape radius")
            one.add_argument("--start", default="0", metavar="X", help="starting point (0)")
        if verb == "stationary_density":
            one.add_argument("--y", required=True, metavar="X", help="position")
        else:
            one.add_argument("--method", default="exact", metavar="NAME", help="(exact)")
            one.add_argument("--order", type=_order, metavar="N", help="a number, or optimal")
            one.add_argument("--rtol", metavar="X", help="relative error, for --method auto")
        if verb in ("exit_probability", "occupation"):
            one.add_argument("--complement", action="store_true", help="1 minus it")
        one.add_argument("--dps", type=int, metavar="N", help="digits (float64 if left out)")
        one.add_argument("--log", action="store_true", help="its natural logarithm")
        one.add_argument("--json", action="store_true", help="with error, method, time")
        one.set_defaults(run=run, quantity=name, verb=verb)


def _order(text: str) -> int | str:
    """An order as a number, or ``"optimal"``."""
    return text if text == "optimal" else int(text)


def run(arguments: argparse.Namespace) -> None:
    """``symasym value``."""
    import symasym as sa
    from symasym.base.inputs import digits
    from symasym.base.texts import carried_text

    given: dict[str, Any] = vars(arguments)
    inputs = {name: given[name] for name in _TAKEN if name in given}
    drift = named_drift(arguments.drift, arguments.expr, settings(arguments.set))
    # A few digits more than are printed, so that the last printed one is rounded right.
    dps = None if arguments.dps is None else min(digits(arguments.dps) + 5, 10_000)
    start = time.perf_counter()
    found = getattr(sa, arguments.verb)(drift, **inputs, dps=dps, full=True)
    seconds = time.perf_counter() - start
    value, error = carried_text(found.value, found.error, arguments.dps or 17)
    if not arguments.json:
        print(value)
        return
    of = {"expr": arguments.expr} if arguments.expr else {"drift": arguments.drift}
    record = {
        "quantity": arguments.quantity,
        "value": value,
        "error": error,
        "error_kind": found.error_kind,
        "method": found.method,
        "dps": arguments.dps,
        "notes": found.notes,
        "seconds": round(seconds, 6),
        "inputs": {**of, "set": settings(arguments.set), **inputs},
    }
    print(json.dumps(record, indent=1))


def _methods_and_drifts(verb: str) -> str:
    """The methods of a quantity, and the drifts with their parameters."""
    from symasym.drift.ready_made.named import drift_signatures
    from symasym.methods import METHODS
    from symasym.scenes import QUANTITIES

    names = {name for name, quantity in QUANTITIES.items() if quantity.verb == verb}
    methods = {name: m.about for name, m in METHODS.items() if names & set(m.quantities)}
    known = {**methods, "auto": "exact, or for many kappa an expansion within --rtol"}
    drifts = listed("drifts, with what --set gives them", drift_signatures())
    return "\n\n".join([listed("methods", known), drifts] if names else [drifts])
