"""How many changes of the mathematics the suite notices: ``python tests/mutants.py --number 100``.

Places are drawn at random from the rooms of mathematics: an operator is exchanged, a whole number
grows by one, or a comparison is turned round. Each change runs the suite, its own room's tests
first, on a copy of the tree until a test fails; what survives is printed to be read by hand, for a
change may alter nothing but a cost.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("exact", "expansions", "integrals", "formulas", "drift", "release")
_LIMIT = 400  # seconds, after which a change counts as noticed
_OTHER = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*",
    ast.Lt: ">", ast.Gt: "<", ast.LtE: ">", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
}  # fmt: skip


def places(path: Path) -> list[tuple[int, int, str]]:
    """Begin, end and new text of every change of a file, in bytes."""
    text = path.read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def at(node: ast.expr, end: bool = False) -> int:
        line, column = (
            (node.end_lineno, node.end_col_offset) if end else (node.lineno, node.col_offset)
        )
        return starts[line - 1] + column

    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.BinOp) and type(node.op) in _OTHER:
            left, op, right = node.left, node.op, node.right
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in _OTHER:
            left, op, right = node.left, node.ops[0], node.comparators[0]
        elif isinstance(node, ast.Constant) and type(node.value) is int and node.value < 100:
            found.append((at(node), at(node, end=True), str(node.value + 1)))
            continue
        else:
            continue
        begin, end = at(left, end=True), at(right)
        between = text[begin:end].decode()
        sign = between.strip("() \n")
        if sign and "\n" not in between and "#" not in between:
            found.append((begin, end, between.replace(sign, _OTHER[type(op)])))
    return found


def survives(copy: Path, path: Path, place: tuple[int, int, str]) -> bool:
    """Whether the suite passes with this change."""
    target, (begin, end, new) = copy / path, place
    kept = target.read_bytes()
    target.write_bytes(kept[:begin] + new.encode() + kept[end:])
    own = f"tests/{path.parts[1]}"
    tests = [own] * (copy / own).is_dir() + ["tests"]
    try:
        run = subprocess.run(
            [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests],
            cwd=copy, env={**os.environ, "PYTHONPATH": str(copy)}, timeout=_LIMIT,
            capture_output=True, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return False
    finally:
        target.write_bytes(kept)
    return run.returncode == 0


def main() -> None:
    """Draw the places, try each, and print what is noticed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--number", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    files = [p for room in ROOMS for p in sorted((ROOT / "symasym" / room).rglob("*.py"))]
    everything = [(p.relative_to(ROOT), place) for p in files for place in places(p)]
    drawn = random.Random(chosen.seed).sample(everything, chosen.number)
    killed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "tree"
        skip = shutil.ignore_patterns(".git", ".venv", "build", "__pycache__", ".*_cache")
        shutil.copytree(ROOT, copy, ignore=skip)
        for number, (path, place) in enumerate(drawn, 1):
            alive = survives(copy, path, place)
            killed += not alive
            line = (copy / path).read_bytes()[: place[0]].count(b"\n") + 1
            told = "SURVIVES" if alive else "noticed"
            print(f"{number}/{chosen.number} {told} {path}:{line} {place[2]!r}", flush=True)
    print(f"{killed} of {chosen.number} changes noticed.")


if __name__ == "__main__":
    main()
