"""The command ``symasym value``."""

from __future__ import annotations

import argparse
import json
import sys
import time
from decimal import Decimal
from functools import partial
from typing import TYPE_CHECKING, Any

from symasym.base.inputs import meant
from symasym.commands.settings import (
    Commands,
    document,
    listed,
    settings,
    takes_patience,
    takes_settings,
)
from symasym.drift.ready_made.named import DRIFTS, named_drift

if TYPE_CHECKING:
    from symasym.base.estimate import Estimate

_FLOAT_DIGITS = 17
# Digits of a formula in float64.
_EVALUATED = 12
_FRICTION = "--drift friction --set mu=3 --set alpha=1 --set z0=-0.4"
_LINEAR = "--drift linear --set a_minus=1 --set a_plus=-1"
_ELSEWHERE = {"--digits": "--dps", "--radius": "--r"}
_EXAMPLES = {
    "escape-time": (
        f"{_FRICTION} --kappa 0.1 --r 10 --dps 30",
        '--expr "1/2 - u + b*u**3" --set b=3/4 --kappa 0.05 --r 5 --method laplace --order 4',
    ),
    "exit-probability": (
        f"{_FRICTION} --kappa 0.1 --r 10 --log",
        f"{_LINEAR} --kappa 1 --r 5 --start -1/3 --method strong_noise --json",
    ),
    "occupation": (f"{_LINEAR} --kappa 1 --complement", f"{_LINEAR} --kappa 0.3 --json"),
    "stationary-density": (f"{_LINEAR} --kappa 1 --y 1/2", f"{_LINEAR} --kappa 0.1 --y 3 --log"),
}


def add_parser(commands: Commands) -> None:
    """Add the parsers of ``value``, one a quantity."""
    parser = commands.add_parser(
        "value",
        help="print one number",
        description="Print one number. All inputs are scaled (u = y/eps) and exact as written.",
        allow_abbrev=False,
    )
    first = (f"symasym value {name} {_EXAMPLES[name][0]}" for name in ("escape-time", "occupation"))
    document(parser, first, partial(_methods_and_drifts, "escape_time"))
    names = "escape-time", "exit-probability", "occupation", "stationary-density"
    parser.elsewhere = dict(zip(("T", "C", "P", "p_ss"), names, strict=True))
    quantities = parser.add_subparsers(title="quantities", required=True, metavar="QUANTITY")
    for name, verb, about, escapes in (
        ("escape-time", "escape_time", "mean time to leave |u| < r", True),
        ("exit-probability", "exit_probability", "probability of leaving through -r", True),
        ("occupation", "occupation", "stationary probability of |u| <= 1 (sliding)", False),
        ("stationary-density", "stationary_density", "stationary density at y (sliding)", False),
    ):
        quantity = quantities.add_parser(name, help=about, description=about, allow_abbrev=False)
        quantity.elsewhere, quantity.beside = _ELSEWHERE, quantities.choices
        lines = [f"symasym value {name} {line}" for line in _EXAMPLES[name]]
        document(quantity, lines, partial(_methods_and_drifts, verb))
        what = quantity.add_mutually_exclusive_group(required=True)
        what.add_argument("--drift", choices=DRIFTS, help="a ready-made drift")
        what.add_argument("--expr", metavar="A", help='A(u), e.g. "1/2 - u + u**3"')
        takes_settings(quantity, "set a parameter")
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
        takes_patience(quantity)
        quantity.add_argument("--json", action="store_true", help="with error, method, time")
        quantity.set_defaults(run=run, quantity=name, verb=verb)


def _order(text: str) -> int | str:
    """An order as a number, or ``"optimal"``."""
    try:
        return text if text == "optimal" else int(text)
    except ValueError:
        known = f"{text!r}; give a whole number or optimal{meant(text, ['optimal'])}"
        raise argparse.ArgumentTypeError(known) from None


def run(arguments: argparse.Namespace) -> None:
    """``symasym value``."""
    import symasym as sa
    from symasym.base.inputs import digits

    given: dict[str, Any] = vars(arguments)
    takes = ("kappa", "r", "y", "start", "method", "order", "rtol", "complement", "log")
    inputs = {name: given[name] for name in takes if name in given}
    # A few digits more than are printed, so that the last printed one is rounded right.
    dps = None if arguments.dps is None else min(digits(arguments.dps) + 5, 10_000)
    drift = named_drift(arguments.drift, arguments.expr, settings(arguments.set))
    verb = getattr(sa, arguments.verb)
    start = time.perf_counter()
    # The exact value to `dps` digits has them without a proof, which takes longer.
    proved = arguments.json or dps is None or inputs.get("method", "exact") != "exact"
    options = {"dps": dps, "full": proved}
    answer = verb(drift, **inputs, **options)
    seconds = time.perf_counter() - start
    value, error = _texts(answer, arguments.dps)
    if arguments.json:
        _print_json(arguments, inputs, answer, value, error, seconds)
    else:
        print(value)
    if "complement" in given and not arguments.log and Decimal(value) == 1:
        way = "leave --complement out for" if arguments.complement else "--complement has"
        print(f"symasym: the value is 1 to these digits; {way} the rest.", file=sys.stderr)


def _texts(answer: Any, dps: int | None) -> tuple[str, str | None]:
    """The digits that the error carries, `dps` at most, and the error of that text.

    A value without a stated error has the digits to which its formula is evaluated.
    """
    from symasym.base.estimate import Estimate
    from symasym.base.files import decimal_text
    from symasym.base.texts import carried_text

    if not isinstance(answer, Estimate):
        assert dps is not None
        return decimal_text(answer, dps), None
    if answer.error is not None:
        return carried_text(answer.value, answer.error, _FLOAT_DIGITS if dps is None else dps)
    return f"{answer.value:.{_EVALUATED}g}" if dps is None else decimal_text(
        answer.value, dps
    ), None


def _print_json(
    arguments: argparse.Namespace,
    inputs: dict[str, Any],
    estimate: Estimate,
    value: str,
    error: str | None,
    seconds: float,
) -> None:
    """Print the value with its error, kind, method, time and inputs."""
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


def _methods_and_drifts(verb: str) -> str:
    """The methods of a quantity, and the drifts with their parameters."""
    from symasym.drift.ready_made.named import drift_signatures
    from symasym.methods import METHODS
    from symasym.scenes import QUANTITIES

    names = {name for name, quantity in QUANTITIES.items() if quantity.verb == verb}
    methods = {name: m.about for name, m in METHODS.items() if names & set(m.quantities)}
    known = {**methods, "auto": "the cheapest whose relative error is at most --rtol"}
    return "\n\n".join(
        ([listed("methods", known)] if names else [])
        + [listed("drifts, with what --set gives them", drift_signatures())]
    )
