"""The wheel and the source distribution: complete, well described, and working alone."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = {
    "value": "value escape-time --drift linear --set a_minus=1 --set a_plus=-1 --kappa 1 --r 2",
    "release": "release --kappa 0.5 --r 10 --eps 0.01 --z -0.4",
    "derive": "derive eq:V --out derived",
    "show": "show eq:Ttilde --latex",
    "emit": "emit eq:Ttildelarge --target c -o time.c",
    "figure": "figure fricforce",
    "table": "table spec.toml -o table.jsonl",
    "verify": "verify --help",
    "report": "report --help",
    "reproduce": "reproduce --help",
}
SPEC = """
drift = "linear"
dps = 10
kappa = ["0.5", "1"]
r = "2"

[parameters]
a_minus = "1"
a_plus = "-1"
"""


def run(*command: object, cwd: Path) -> str:
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


def test_citation_names_this_version() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.slow
def test_wheel_and_sdist_work_alone(tmp_path: Path) -> None:
    pytest.importorskip("build", reason="the extra `publish` is not installed")
    pytest.importorskip("twine", reason="the extra `publish` is not installed")
    # The wheel is made from the source distribution, so that each needs nothing beside it.
    run(sys.executable, "-m", "build", "--outdir", tmp_path, ROOT, cwd=tmp_path)
    wheel, sdist = next(tmp_path.glob("*.whl")), next(tmp_path.glob("*.tar.gz"))
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist, cwd=tmp_path)
    alone = tmp_path / "alone"
    run(sys.executable, "-m", "venv", alone / ".venv", cwd=tmp_path)
    run(alone / ".venv/bin/pip", "install", "-q", wheel, cwd=alone)
    (alone / "spec.toml").write_text(SPEC)
    symasym = alone / ".venv/bin/symasym"
    listed = run(symasym, "--help", cwd=alone).split("COMMAND\n", 1)[1]
    assert set(re.findall(r"^ {4}(\w+)", listed, re.M)) == set(COMMANDS)
    for command in COMMANDS.values():
        run(symasym, *command.split(), cwd=alone)
    for made in ("derived", "time.c", "table.jsonl"):
        assert (alone / made).exists(), made
