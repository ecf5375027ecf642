"""Keep the answers of every method, or compare with those kept.

    python -m tests.frozen                      # compare everything with tests/frozen/answers.json
    python -m tests.frozen --only uniform,local # names that begin so, or hold one of the words
    python -m tests.frozen --keep               # write the answers of this tree

Reported: values that differ by more than their rounding, errors that differ by more than a
factor, other kinds of error, refusals that are not the same.
"""

from __future__ import annotations

import argparse
import gzip
import json
import math
import signal
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

ANSWERS = Path(__file__).with_name("answers.json.gz")
_SECONDS = 12  # of processor time
_PIECES = 24


class _TooLong(BaseException):
    pass


def _stop(*_: Any) -> None:
    raise _TooLong


def _text(x: Any) -> Any:
    if x is None:
        return None
    if isinstance(x, np.ndarray):
        return [_text(y) for y in x.ravel()]
    if hasattr(x, "_mpf_") or hasattr(x, "_mpc_"):
        return mpmath.nstr(x, 45)
    if isinstance(x, complex):
        return repr(x)
    return x if isinstance(x, str) else repr(float(x))


def answer(ask: Any) -> dict[str, Any]:
    """The answer as plain texts."""
    import symasym as sa
    from symasym.base.call_context import limited

    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, _SECONDS)
    try:
        with limited(math.inf):
            got = ask()
    except sa.SymasymError as error:
        return {"refused": type(error).__name__, "says": str(error)}
    except _TooLong:
        return {"refused": "too long"}
    except Exception as error:  # a defect, but one that a rebuilding must not hide
        return {"refused": f"DEFECT {type(error).__name__}", "says": str(error)[:200]}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    if isinstance(got, sa.Estimate):
        return {"value": _text(got.value), "error": _text(got.error), "kind": got.error_kind}
    return {"value": _text(got)}


def piece(group: str, number: int, words: list[str]) -> dict[str, Any]:
    """Every `_PIECES`th answer of a group."""
    from tests.frozen.questions import questions

    warnings.simplefilter("ignore")
    answers = {}
    for index, (name, ask) in enumerate(questions(group)):
        if index % _PIECES == number and (not words or any(w in name for w in words)):
            answers[name] = answer(ask)
    return answers


def _number(text: str) -> Any:
    return mpmath.mpmathify(text.strip().replace("(", "").replace(")", ""))


def _far(new: Any, old: Any, tolerance: float) -> bool:
    if isinstance(new, list) and isinstance(old, list):
        return len(new) != len(old) or any(
            _far(a, b, tolerance) for a, b in zip(new, old, strict=True)
        )
    if new == old:
        return False
    try:
        a, b = _number(new), _number(old)
    except (TypeError, ValueError, AttributeError):
        return True
    if not (mpmath.isfinite(a) and mpmath.isfinite(b)):
        return True
    return bool(abs(a - b) > tolerance * max(1, abs(b)))


def _ratio(new: Any, old: Any) -> float:
    """The largest factor between two errors."""
    if isinstance(new, list) and isinstance(old, list):
        return max(map(_ratio, new, old), default=1.0)
    if new is None or old is None:
        return 1.0 if new == old else float("inf")
    a, b = _number(new), _number(old)
    tiny = mpmath.mpf("1e-13")
    a, b = a + tiny * (b < 1e-12), b + tiny * (b < 1e-12)
    return float(max(a / b, b / a)) if a and b else (1.0 if a == b else float("inf"))


def difference(name: str, new: dict[str, Any], old: dict[str, Any], factor: float) -> str:
    """What differs, in words; empty where nothing does."""
    if "refused" in new or "refused" in old:
        if new.get("refused") != old.get("refused"):
            return f"{_shown(old)} -> {_shown(new)}"
        return ""
    if new.get("kind") != old.get("kind"):
        return f"kind {old.get('kind')} -> {new.get('kind')}"
    digits = "40 digits" in name
    if _far(new["value"], old["value"], 1e-37 if digits else 2e-13):
        return f"value {old['value']} -> {new['value']} (error {old.get('error')})"
    if "error" in old and _ratio(new["error"], old["error"]) > factor:
        return f"error {old['error']} -> {new['error']}"
    return ""


def _shown(item: dict[str, Any]) -> str:
    if "refused" in item:
        return f"{item['refused']}: {item.get('says', '')[:100]}"
    return f"{item['value']} ± {item.get('error')}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--only", default="", help="words, separated by commas")
    parser.add_argument("--group", default="", help="groups, separated by commas")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--factor", type=float, default=1.05, help="between errors that are the same"
    )
    options = parser.parse_args()
    from tests.frozen.questions import GROUPS

    groups = options.group.split(",") if options.group else list(GROUPS)
    words = [w for w in options.only.split(",") if w]
    old = {}
    if not options.keep:
        old = json.loads(gzip.decompress(ANSWERS.read_bytes()))
    got: dict[str, Any] = {}
    begin = time.time()
    with ProcessPoolExecutor(options.jobs) as pool:
        tasks = [pool.submit(piece, g, k, words) for g in groups for k in range(_PIECES)]
        for done in as_completed(tasks):
            got |= done.result()
    print(f"{len(got)} answers in {time.time() - begin:.0f} s", file=sys.stderr)
    if options.keep:
        text = json.dumps(dict(sorted(got.items())), ensure_ascii=False, indent=0)
        ANSWERS.write_bytes(gzip.compress(text.encode(), mtime=0))
        return 0
    found = 0
    for name, item in sorted(got.items()):
        if name not in old:
            print(f"NEW   {name}")
        elif why := difference(name, item, old[name], options.factor):
            found += 1
            print(f"DIFF  {name}\n      {why}")
    print(f"{found} of {len(got)} answers differ")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
