"""Reference tables: right values, the same bytes however made, changed lines, bad specs."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.commands.main import main
from symasym.tables import read_spec, write_table
from symasym.workshop import reference_quadrature

SMALL = """\
drift = "friction"
quantities = ["T", "1 - C", "P"]
dps = 20
kappa = ["0.5", 1.0]
r = 3
start = [0, "-1/3"]

[parameters]
mu = 3
alpha = 1
z0 = { from = -0.8, to = "-0.6", points = 2 }
"""
# Some 20 ms a value: time enough to be killed in the middle.
LONG = """\
drift = "friction"
dps = 300
kappa = 1
r = 2
parameters = { mu = 3, alpha = 1, z0 = { from = -1.5, to = -0.5, points = 81 } }
"""


def made(folder: Path, text: str = SMALL, **options: object) -> bytes:
    folder.mkdir(exist_ok=True)
    (folder / "spec.toml").write_text(text)
    out = folder / "t.jsonl"
    write_table(read_spec(folder / "spec.toml"), out, **options)  # type: ignore[arg-type]
    return out.read_bytes()


def test_values(tmp_path: Path) -> None:
    lines = [json.loads(line) for line in made(tmp_path).splitlines()]
    assert len(lines) == 2 * 2 * 2 * 3
    for record in lines:
        x = {name: Fraction(text) for name, text in record["x"].items()}
        if record["quantity"] == "P":  # no stationary state at these z0
            assert record["mid"] is None
            assert "no sliding region" in record["refused"]
            continue
        drift = sa.friction(mu=x["mu"], alpha=x["alpha"], z0=x["z0"])
        scene = drift, x["kappa"], x["r"]
        with mp.workdps(30):
            if record["quantity"] == "T":
                true = reference_quadrature.escape_time(*scene, start=x["start"], dps=22)
            else:
                true = 1 - reference_quadrature.exit_probability(*scene, start=x["start"], dps=24)
            assert abs(mpf(record["mid"]) - true) <= mpf(record["rad"]) + true * mpf(10) ** -21
        assert record["error_kind"] == "bound"
    with open(tmp_path / "t.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["T"] for row in rows] == [r["mid"] for r in lines if r["quantity"] == "T"]
    assert all(float(r["log10_T"]) == pytest.approx(math.log10(float(r["T"]))) for r in rows)
    assert (tmp_path / "t.tex").read_text().count(r"\\") == 9


def test_the_same_bytes(tmp_path: Path) -> None:
    whole = made(tmp_path)
    with ThreadPoolExecutor(2) as threads:
        assert made(tmp_path / "again", executor=threads) == whole
    out = tmp_path / "t.jsonl"
    for end in (0, 10, len(whole) // 2, len(whole)):
        out.write_bytes(whole[:end])
        assert made(tmp_path) == whole


def test_killed_and_resumed(tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(LONG)
    out = tmp_path / "t.jsonl"
    arguments = ["table", str(tmp_path / "spec.toml"), "-o", str(out)]
    program = [sys.executable, "-m", "symasym"]
    with subprocess.Popen([*program, *arguments, "--workers", "2"]) as process:
        while not out.exists() or not out.stat().st_size:
            assert process.poll() is None
            time.sleep(0.01)
        process.kill()
    cut = out.read_bytes()
    assert main(arguments) == 0
    resumed = out.read_bytes()
    assert resumed.startswith(cut[: cut.rfind(b"\n") + 1])
    out.unlink()
    assert made(tmp_path, LONG) == resumed


def test_a_changed_digit_or_a_name_used_twice_is_found(tmp_path: Path) -> None:
    with pytest.raises(sa.InputError, match="written twice"):
        write_table([], tmp_path / "t.csv")
    whole = made(tmp_path)
    out = tmp_path / "t.jsonl"
    at = whole.index(b'"mid": "') + 12
    changed = whole[:at] + str((int(whole[at : at + 1]) + 1) % 10).encode() + whole[at + 1 :]
    other = SMALL.replace("r = 3", "r = 4")
    for bytes_, text in ((changed, SMALL), (whole, other), (b"a note", SMALL)):
        out.write_bytes(bytes_)
        with pytest.raises(sa.OutputError, match="line 1, was changed or .* remove this one.$"):
            made(tmp_path, text)
        assert out.read_bytes() == bytes_


def test_a_table_without_a_layer(tmp_path: Path) -> None:
    text = 'expr = "-u"\nlayer = false\nnoise = "1 + u**2/4"\nito = "stratonovich"\n'
    text += "kappa = 1\ndps = 20\n"
    drift = sa.Drift("-u", layer=None, noise="1 + u**2/4", ito="stratonovich")
    for k, (where, ends) in enumerate(
        (("r = 2\n", (-2, 2)), ('left = -2\nright = "1/2"\n', (-2, "1/2")))
    ):
        (line,) = made(tmp_path / str(k), text + where).splitlines()
        exact = sa.escape_time(drift, 1, ends=ends, dps=25)  # type: ignore[arg-type]
        with mp.workdps(30):
            assert abs(mpf(json.loads(line)["mid"]) - exact) < 1e-18


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("friction", "fricton"), ('"T"', '"U"'), ("dps = 20", "dps = 0"), ("dps", "digits"),
        ('["0.5", 1.0]', '["0.5", "x"]'), ("r = 3\n", ""), ("r = 3", "r = 3\nlayer = 'no'"),
        ("r = 3", "left = -3"), ("r = 3", "r = 3\nright = 2"),
        ("mu = 3", "nu = 3"), ("alpha = 1", ""), ("points = 2", "points = 1"),
        ("points = 2", "step = 0.1"), ("[parameters]", "[parameters"),
        ("points = 2", "points = 9999999999"), ("points = 2", 'points = 2, spacing = "lg"'),
        ('to = "-0.6", ', ""), ('["0.5", 1.0]', "[]"), ("= 3\nalpha", "= [[3]]\nalpha"),
    ],
)  # fmt: skip
def test_a_wrong_spec(tmp_path: Path, old: str, new: str) -> None:
    with pytest.raises(sa.InputError, match=r"spec\.toml"):
        made(tmp_path, SMALL.replace(old, new, 1))
    assert not (tmp_path / "t.jsonl").exists()
