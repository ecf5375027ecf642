"""Reference tables: right values, the same bytes however they were made, and bad specs."""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.base import executors, progress
from symasym.base.errors import InputError, OutputError
from symasym.base.texts import number_text
from symasym.commands.main import main
from symasym.tables import run as tables
from symasym.tables.run import write_table
from symasym.tables.spec import Spec, read_spec
from symasym.workshop import reference_quadrature
from tests.processes import PROGRAM, started

SMALL = """\
drift = "friction"
quantities = ["T", "1 - C"]
dps = 20
kappa = ["0.5", 1.0]
r = 3
start = [0, "-1/3"]

[parameters]
mu = 3
alpha = 1
z0 = { from = -0.8, to = "-0.6", points = 2 }
"""
# About 20 ms a value, 4 a batch: time enough to be killed in the middle.
LONG = """\
drift = "friction"
dps = 200
kappa = 1
r = 2
parameters = { mu = 3, alpha = 1, z0 = { from = -1.5, to = -0.5, points = 60 } }
"""


def spec_of(folder: Path, text: str = SMALL) -> Spec:
    (folder / "spec.toml").write_text(text)
    return read_spec(folder / "spec.toml")


def test_many_parameters_are_read_once(tmp_path: Path) -> None:
    names = [f"p{k}" for k in range(600)]
    lines = ['quantities = ["T"]', "kappa = 1", "r = 2", f'expr = "u + {" + ".join(names)}"']
    values = [f'{name} = "1/{k + 1}"' for k, name in enumerate(names)]
    begun = time.thread_time()
    assert spec_of(tmp_path, "\n".join([*lines, "[parameters]", *values])).scenes == 1
    assert time.thread_time() - begun < 3


def records_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_bytes().splitlines()]


# -- values ----------------------------------------------------------------------------------


def test_every_value_is_within_its_radius_of_plain_quadrature(tmp_path: Path) -> None:
    write_table(spec_of(tmp_path), tmp_path / "t.jsonl")
    records = records_of(tmp_path / "t.jsonl")
    assert len(records) == 16
    for record in records[::7]:
        x = {name: Fraction(text) for name, text in record["x"].items()}
        scene = [x.pop(name) for name in ("kappa", "r", "start")]
        drift = sa.friction(**x)
        with mp.workdps(40):
            if record["quantity"] == "T":
                truth = reference_quadrature.escape_time(drift, *scene, 24)
            else:
                truth = 1 - reference_quadrature.exit_probability(drift, *scene, 28)
            assert abs(truth - mpf(record["mid"])) <= mpf(record["rad"]) + abs(truth) * mpf("1e-23")
            assert mpf(record["rad"]) <= abs(truth) * mpf("1e-19")


def test_the_last_axis_runs_fastest_and_text_is_kept(tmp_path: Path) -> None:
    spec = spec_of(tmp_path)
    points = list(spec.points())
    assert [name for name, _ in spec.axes] == ["kappa", "r", "start", "mu", "alpha", "z0"]
    assert points[1] == points[0] | {"z0": "-0.6"}
    assert points[2] == points[0] | {"start": "-1/3"}
    assert points[-1]["kappa"] == "1.0"
    assert spec.scenes == len(points) == 8


@pytest.mark.parametrize(
    ("given", "values"),
    [
        ("{ from = 0, to = 1, points = 5 }", ["0", "0.25", "0.5", "0.75", "1"]),
        ("{ from = 1, to = 0, points = 4 }", ["1", "2/3", "1/3", "0"]),
        ("{ from = 0, to = 1, step = 0.4 }", ["0", "0.4", "0.8"]),
        ("{ from = 1, to = -1, step = -1 }", ["1", "0", "-1"]),
        ("{ from = 2, to = 3, points = 1 }", ["2"]),
        (
            '{ from = 0.01, to = 1, points = 5, spacing = "log" }',
            ["0.01", "0.0316228", "0.1", "0.316228", "1"],
        ),
        ('[1, "1/3", -2.5e-3]', ["1", "1/3", "-2.5e-3"]),
    ],
)
def test_values_of_an_axis(tmp_path: Path, given: str, values: list[str]) -> None:
    text = f'expr = "b - u"\nkappa = 1\nr = 2\nparameters = {{ b = {given} }}\n'
    assert list(dict(spec_of(tmp_path, text).axes)["b"]) == values


def test_number_text_is_exact() -> None:
    for x in (Fraction(-7, 40), Fraction(1, 3), Fraction(-12), Fraction(1, 2**19), Fraction(0)):
        assert Fraction(number_text(x)) == x


def test_the_csv_has_values_errors_and_logarithms(tmp_path: Path) -> None:
    spec = spec_of(tmp_path)
    outcome = write_table(spec, tmp_path / "t.jsonl")
    rows = list(csv.DictReader(outcome.csv.read_text().splitlines()))
    names = ["kappa", "r", "start", "mu", "alpha", "z0"]
    columns = ["T", "T_error", "log10_T", "1-C", "1-C_error", "log10_1-C"]
    assert list(rows[0]) == names + columns
    assert len(rows) == 8
    for row, x in zip(rows, spec.points(), strict=True):
        drift = sa.friction(mu=x["mu"], alpha=x["alpha"], z0=x["z0"])
        scene: Any = (drift, x["kappa"], x["r"])
        # Quotients are rounded in the columns.
        assert float(row["start"]) == float(Fraction(x["start"]))
        with mp.workdps(30):
            time = sa.escape_time(*scene, start=x["start"], dps=30)
            share = sa.exit_probability(*scene, start=x["start"], complement=True, dps=30)
            for name, known in (("T", time), ("1-C", share)):
                assert abs(mpf(row[name]) - known) <= mpf(row[f"{name}_error"]) < 1e-19 * known
                assert float(row[f"log10_{name}"]) == pytest.approx(float(mp.log10(known)))


def test_every_line_is_a_row_of_one_shape(tmp_path: Path) -> None:
    text = SMALL.replace('"T", "1 - C"', '"T", "P"').replace("z0 = {", "z0 = [0.5, -0.6]\n# {")
    outcome = write_table(spec_of(tmp_path, text), tmp_path / "t.jsonl")
    records = records_of(outcome.path)
    assert len(records) == outcome.values == 16
    assert len({tuple(record) for record in records}) == 1
    assert {record["drift"] for record in records} == {"friction"}
    assert sum(record["refused"] is None for record in records) == 12
    assert all((record["mid"] is None) == (record["refused"] is not None) for record in records)


def test_pandas_reads_both_files(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    outcome = write_table(spec_of(tmp_path), tmp_path / "t.jsonl")
    table = pandas.read_csv(outcome.csv)
    assert table.shape == (8, 12)
    assert all(table["T_error"] < 1e-19 * table["T"])
    lines = pandas.read_json(outcome.path, lines=True, dtype=False)
    assert list(lines["mid"]) == [record["mid"] for record in records_of(outcome.path)]


def test_any_drift_and_values_that_do_not_exist(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "spec.toml").write_text(
        'expr = "b - u"\nquantities = ["P", "1 - P"]\ndps = 12\nkappa = 0.5\n'
        'parameters = { b = ["1/2", 2] }\n'
    )
    arguments = ["table", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "t.jsonl")]
    assert main(arguments) == 1
    assert "2 values do not exist" in capsys.readouterr().out
    inside, outside, *none = records_of(tmp_path / "t.jsonl")
    assert mpf(inside["mid"]) + mpf(outside["mid"]) == pytest.approx(1, abs=1e-11)
    assert all("no sliding region" in record["refused"] for record in none)
    assert (tmp_path / "t.csv").read_text().splitlines()[2] == "0.5,2,,,,,,"
    assert main(arguments) == 1  # nothing new, and the same to say
    assert "up to date" in capsys.readouterr().out


# -- the same bytes --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Spec, bytes, bytes]:
    folder = tmp_path_factory.mktemp("whole")
    spec = spec_of(folder)
    outcome = write_table(spec, folder / "t.jsonl")
    assert (outcome.made, outcome.refused) == (16, 0)
    return spec, outcome.path.read_bytes(), outcome.csv.read_bytes()


def test_a_rerun_makes_what_is_missing_and_the_same_bytes(
    tmp_path: Path, whole: tuple[Spec, bytes, bytes]
) -> None:
    spec, lines, rows = whole
    path = tmp_path / "t.jsonl"
    assert b"\n" in lines[:700]
    ends = [k for k, byte in enumerate(lines) if byte == 10]
    cuts = {0, 9, ends[0], ends[0] + 1, ends[5], ends[5] + 1, ends[9] + 77, len(lines) - 1}
    for cut in [*sorted(cuts), len(lines)]:
        path.write_bytes(lines[:cut])
        outcome = write_table(spec, path)
        assert outcome.made == 16 - lines[:cut].count(b"\n")
        assert (path.read_bytes(), outcome.csv.read_bytes()) == (lines, rows)


def test_every_executor_makes_the_same_bytes(
    tmp_path: Path, whole: tuple[Spec, bytes, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, lines, rows = whole
    monkeypatch.setattr(tables, "_MOST_IN_BATCH", 2)
    with ThreadPoolExecutor(3) as threads:
        outcome = write_table(spec, tmp_path / "t.jsonl", executor=threads)
    assert (outcome.path.read_bytes(), outcome.csv.read_bytes()) == (lines, rows)
    with executors.local(2) as processes:
        outcome = write_table(spec, tmp_path / "p.jsonl", executor=processes)
    assert (outcome.path.read_bytes(), outcome.csv.read_bytes()) == (lines, rows)
    assert write_table(spec, tmp_path / "p.jsonl", force=True).made == 16


def grown(path: Path, lines: int) -> None:
    """Wait until the file has so many."""
    deadline = time.monotonic() + 60
    while not path.exists() or path.read_bytes().count(b"\n") < lines:
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture(scope="module")
def long_table(tmp_path_factory: pytest.TempPathFactory) -> tuple[Spec, bytes]:
    folder = tmp_path_factory.mktemp("long")
    spec = spec_of(folder, LONG)
    with executors.local(2) as processes:
        return spec, write_table(spec, folder / "t.jsonl", executor=processes).path.read_bytes()


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="reads /proc")
@pytest.mark.parametrize(
    "stop", [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.slow)]
)
def test_a_run_that_is_killed_goes_on_where_it_was(
    tmp_path: Path, long_table: tuple[Spec, bytes], stop: signal.Signals
) -> None:
    spec, lines = long_table
    (tmp_path / "spec.toml").write_text(LONG)
    path = tmp_path / "t.jsonl"
    command = ["table", str(tmp_path / "spec.toml"), "-o", str(path), "--workers", "2"]
    with started([*PROGRAM, *command], stderr=subprocess.DEVNULL) as process:
        grown(path, 6)
        workers = children(process.pid)
        assert len(workers) >= 2
        with pytest.raises(OutputError, match="written by another run"):
            write_table(spec, path)
        process.send_signal(stop)
    assert process.returncode == (-signal.SIGKILL if stop == signal.SIGKILL else 130)
    left = path.read_bytes()
    assert lines.startswith(left)
    assert len(left) < len(lines)
    assert not path.with_suffix(".csv").exists()
    outcome = write_table(spec, path)
    assert outcome.made == 60 - left.count(b"\n")
    assert path.read_bytes() == lines
    assert sorted(os.listdir(tmp_path)) == ["spec.toml", "t.csv", "t.jsonl"]
    # And whoever did the work is gone, too.
    deadline = time.monotonic() + 60
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def children(pid: int) -> list[int]:
    return [int(x) for x in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def test_a_worker_that_dies_is_one_sentence(
    tmp_path: Path, long_table: tuple[Spec, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, lines = long_table

    def last_words(processes: Any) -> Callable[..., object]:
        def step(count: int) -> None:
            next(iter(processes._processes.values())).kill()

        return step

    path = tmp_path / "t.jsonl"
    with executors.local(2) as processes:
        monkeypatch.setattr(progress, "stage", silent(last_words(processes)))
        with pytest.raises(OutputError, match="goes on from there"):
            write_table(spec, path, executor=processes)
    assert lines.startswith(path.read_bytes())


def silent(step: Callable[..., object]) -> Any:
    @contextmanager
    def stage(*_: object, **__: object) -> Iterator[Callable[..., object]]:
        yield step

    return stage


def test_a_full_disk_leaves_whole_lines(
    tmp_path: Path, whole: tuple[Spec, bytes, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, lines, _ = whole
    monkeypatch.setattr(tables, "_MOST_IN_BATCH", 3)
    calls = []

    def fills(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) == 4:
            raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "t.jsonl"
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fills)
        with pytest.raises(OutputError, match="No space left on device"):
            write_table(spec, path)
    assert path.read_bytes() == b"".join(lines.splitlines(keepends=True)[:9])
    assert write_table(spec, path).made == 7
    assert path.read_bytes() == lines


#: What stands in a stranger's table for a value.
SPOILED = [
    b"null", b"1", b'["x"]', b'"nan"', b'"-1"', b'"1.2.3"', b'"=cmd"', b'"1%s"' % (b"0" * 9_000),
    b'"1e%s"' % (b"9" * 99), b'"__import__(1)"', '"\u0661"'.encode(),
]  # fmt: skip


# -- what is in the way ----------------------------------------------------------------------


def test_a_file_of_something_else_is_not_touched(
    tmp_path: Path, whole: tuple[Spec, bytes, bytes]
) -> None:
    spec, lines, _ = whole
    path = tmp_path / "t.jsonl"
    first, second, third, *rest = lines.splitlines(keepends=True)
    for content, told in (
        (b"my notes", "line 1, is not the value"),
        (first.replace(b"friction", b"linear"), "line 1, is not the value"),
        (first.replace(b'"dps": 20', b'"dps": 19'), "line 1, is not the value"),
        (first + third, "line 2, is not the value"),
        (first + second + b"{}\n", "line 3, is not the value"),
        *(
            (first + spoiled, "line 2, is not the value")
            for spoiled in (
                *(re.sub(rb'"mid": "[^"]*"', b'"mid": ' + mid, second) for mid in SPOILED),
                re.sub(rb'"rad": "', b'"rad": "-', second),
                re.sub(rb'"versions": {.*}', b'"versions": ["mpmath"]}', second),
                b"[" * 100_000 + b"\n",
                b"1" * 5_000 + b"\n",
            )
        ),
        (lines + second, "line 17, is not the value"),
        (first + second.replace(b'"mpmath": "', b'"mpmath": "0.'), "with mpmath 0.1"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=told):
            write_table(spec, path)
        assert path.read_bytes() == content
    path.write_bytes(b"my notes")
    with pytest.raises(InputError, match="is no table"):
        write_table(spec, path, force=True)
    assert path.read_bytes() == b"my notes"
    path.write_bytes(first[:7])
    assert write_table(spec, path, force=True).path.read_bytes() == lines
    alone = tmp_path / "alone.csv"
    alone.write_bytes(b"my data")
    with pytest.raises(InputError, match="is there without its table"):
        write_table(spec, tmp_path / "alone.jsonl", force=True)
    assert alone.read_bytes() == b"my data"
    assert not (tmp_path / "alone.jsonl").exists()
    with pytest.raises(InputError, match="name of the CSV file"):
        write_table(spec, tmp_path / "t.csv")
    with pytest.raises(OutputError, match="cannot be written"):
        write_table(spec, path / "below" / "t.jsonl")


GOOD = 'drift = "friction"\nkappa = 1\nr = 3\n[parameters]\nmu = 3\nalpha = 1\nz0 = -1\n'


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("kappa = 1", "kappa 1", "line 2, 'kappa 1': Expected '='"),
        ("mu = 3", "mu = 3\nmu = 4", "line 6, 'mu = 4': Cannot overwrite a value"),
        ("z0 = -1\n", "z0 = [-1,\n", "line 7, 'z0 = [-1,':"),
        ("kappa = 1", "kapa = 1", "line 2, kapa: there is no such key"),
        ("kappa = 1", "kappa = -0.1", "line 2, kappa: kappa is -0.1; it must be greater than 0"),
        ("kappa = 1", "kappa = [1, true]", "line 2, kappa: kappa is True"),
        ("kappa = 1", "kappa = inf", "line 2, kappa: kappa is 'inf'"),
        ("kappa = 1", "kappa = []", "line 2, kappa: the list is empty"),
        ("kappa = 1", "", "line 1, kappa: it is missing"),
        ("r = 3", "", "line 1, r: it is missing"),
        ("r = 3", "r = 3\nstart = [0, 3]", "line 4, start: 3 is not inside"),
        ("r = 3", "r = 3\ndps = 0", "line 4, dps: dps is 0"),
        ("r = 3", 'r = 3\nquantities = ["Q"]', "line 4, quantities: 'Q' is unknown"),
        ("r = 3", 'r = 3\nquantities = ["T", "T"]', "line 4, quantities: 'T' stands there twice"),
        ("r = 3", 'r = 3\nquantities = ["P"]', "line 3, r: P take none"),
        ("mu = 3", 'mu = "x"', "line 5, parameters.mu: mu is 'x'"),
        ("mu = 3", "nu = 3", "line 5, parameters.nu: nu is no parameter of friction"),
        ("alpha = 1", "alpha = [1, 0]", "line 6, parameters.alpha: alpha is 0; it must be greater"),
        ("mu = 3\n", "", "line 4, parameters: the drift's parameters mu have no value"),
        ("z0 = -1", "r = -1", "line 7, parameters.r: the name is taken"),
        ("z0 = -1", "z0 = { from = 0, to = 1 }", "line 7, parameters.z0: a range has either"),
        ("z0 = -1", "z0 = { from = 0, points = 2 }", "z0: the range has no to"),
        ("z0 = -1", "z0 = { from = 0, to = 1, point = 2 }", "parameters.z0.point: a range has"),
        ("z0 = -1", "z0 = { from = 0, to = 1, step = -1 }", "z0: step is -1, which never"),
        ("z0 = -1", "z0 = { from = 0, to = 1, points = 0 }", "z0: points is 0"),
        ("z0 = -1", "z0 = { from = 0, to = 1, points = 99999999 }", "z0: the range has 99999999"),
        ("z0 = -1", "z0 = { from = 0, to = 1e9999, step = 1 }", "which is beyond 1e±300"),
        (
            "z0 = -1",
            'z0 = { from = 0, to = 1, points = 3, spacing = "log" }',
            "z0: a logarithmic range",
        ),
        ('"friction"', '"fiction"', "line 1, drift: fiction is no ready-made drift"),
        ('drift = "friction"', 'expr = "z0 +"', "line 1, expr: A is 'z0 +'"),
        ('drift = "friction"', "", "line 1, drift: give either drift"),
        ('drift = "friction"', "drift = 1", "line 1, drift: it is 1"),
    ],
)
def test_a_malformed_spec_is_told_with_line_and_key(
    tmp_path: Path, before: str, after: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert GOOD.count(before) == 1
    (tmp_path / "spec.toml").write_text(GOOD.replace(before, after))
    out = tmp_path / "t.jsonl"
    assert main(["table", str(tmp_path / "spec.toml"), "-o", str(out)]) == 2
    message = capsys.readouterr().err
    assert told in message
    assert message.startswith(f"symasym: {tmp_path / 'spec.toml'}, line ")
    assert message.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("r = 3", f"r = {'9' * 5000}", "has a whole number of more than 4,300 digits"),
        ("r = 3", f"r = {'[' * 5000}{']' * 5000}", "too deep in each other"),
        ("r = 3", f"r = {'{a = ' * 3000}1{'}' * 3000}", "too deep in each other"),
        ("r = 3", f"r.{'.'.join('a' * 2000)} = 1", "a range has from, to"),
        ("r = 3", f"r = [{'3, ' * 100_001}]", "it has 100001 values; give at most 100000"),
        ("r = 3", "r = { from = 1, to = 2, points = 9999999 }", "give at most 100000 on an axis"),
        ("r = 3", f'r = "{"1" * 1_000_000}"', "more than 20,000 digits"),
        ("r = 3", "r = { from = 1, to = 2, step = '1e-99999' }", "which is beyond 1e±300"),
        ("r = 3", "r = '1e-99999'\nstart = 1", "r is '1e-99999', which is beyond 1e±300"),
        ("r = 3", f"r = 3\n{'.'.join('a' * 200_000)} = 1", "spec.toml fewer keys and values"),
        ("r = 3", f"r = 3\n{' ' * 9_000}\n{' ' * 9_000}q = 1", "line 5, q: there is no such key"),
        ("r = 3", f'r = [3]\nx = """\n[{" " * 9_000}\n"""', "x: there is no such key"),
        ("mu = 3", "mu = 3" + "".join(f"\nq{i} = [1, 2, 3]" for i in range(9_999)), "at most 1000"),
        ('"friction"', '"../../etc/passwd"', "../../etc/passwd is no ready-made drift"),
        ('"friction"', '"fric\\u0000tion\\u001b[31m"', r"fric\x00tion\x1b[31m is no ready-made"),
        ('"friction"', '"\u202efriction"', r"\u202efriction is no ready-made drift"),
        ('"friction"', '"fric\u200btion"', r"fric\u200btion is no ready-made drift"),
        ("kappa = 1", "\u043aappa = 1", "Invalid statement"),
        ("mu = 3", '"a\\u001b[31m" = 3', r"a\x1b[31m is no parameter of friction"),
    ],
)
def test_the_spec_of_a_stranger_is_refused_in_a_sentence(
    tmp_path: Path, before: str, after: str, told: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "spec.toml").write_text(GOOD.replace(before, after), encoding="utf-8")
    begun = time.process_time()
    if told is None:
        assert max(map(len, read_spec(tmp_path / "spec.toml").axes[1][1])) > 4300
        return
    assert main(["table", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "t.jsonl")]) == 2
    message = capsys.readouterr().err
    assert told in message
    assert message.removesuffix("\n").isprintable()
    assert len(message) < 400 + len(str(tmp_path))
    assert time.process_time() - begun < 3


def test_other_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = tmp_path / "spec.toml"
    out = str(tmp_path / "t.jsonl")
    for content, told in ((None, "cannot be read"), (b"\xff", "no UTF-8 text")):
        if content is not None:
            spec.write_bytes(content)
        assert main(["table", str(spec), "-o", out]) == 2
        assert told in capsys.readouterr().err
    spec.write_text(GOOD)
    assert main(["table", str(spec), "-o", out, "--workers", "0"]) == 2
    assert "workers is 0" in capsys.readouterr().err
    assert not Path(out).exists()
    # Files without an end, and a link to what is no table.
    assert main(["table", "/dev/zero", "-o", out]) == 2
    assert "has more than 10,000,000 bytes" in capsys.readouterr().err
    assert main(["table", str(spec), "-o", "/dev/zero"]) == 2
    assert "/dev/zero is a device" in capsys.readouterr().err
    (tmp_path / "letter").write_text("Dear")
    Path(out).symlink_to(tmp_path / "letter")
    for options in ([], ["--force"]):
        assert main(["table", str(spec), "-o", out, "--workers", "1", *options]) == 2
    assert (tmp_path / "letter").read_text() == "Dear"


def test_progress_tells_rate_and_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.stage("t", 4000, done=1000, every=0.0) as step:
        time.sleep(0.01)
        step(1)
    first, second = capsys.readouterr().err.splitlines()
    assert first == "t: 4000 steps, 1000 of them made before"
    assert second.startswith("t: 1001 of 4000, ")
    assert "/s, 0:" in second
    assert second.endswith(" left")


# -- a cluster -------------------------------------------------------------------------------


def test_a_scheduler_that_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "spec.toml").write_text(GOOD)
    arguments = ["table", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "t.jsonl")]
    arguments.append("--scheduler")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "distributed", None)
        assert main([*arguments, "tcp://127.0.0.1:1"]) == 2
        assert "not installed" in capsys.readouterr().err
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    assert main([*arguments, "nonsense"]) == 2
    assert "give its host and port" in capsys.readouterr().err
    monkeypatch.setattr(executors, "_PATIENCE", 0.5)
    assert main([*arguments, "tcp://127.0.0.1:1"]) == 2
    assert "no scheduler answers" in capsys.readouterr().err
    assert os.listdir(tmp_path) == ["spec.toml"]


class StandIn:
    """A client of dask.distributed as far as it is used, with as many workers as are set."""

    def __init__(self, workers: int, answers: bool = True) -> None:
        self.workers, self.answers = workers, answers

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def get_executor(self) -> StandIn:
        return self

    def submit(self, work: Any, *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.workers:
            future.set_result(work(*arguments))
        return future

    def scheduler_info(self) -> dict[str, Any]:
        if not self.answers:
            time.sleep(3600)
        return {"workers": dict.fromkeys(range(self.workers))}


@pytest.mark.parametrize(
    ("client", "told"),
    [
        (StandIn(0), "has no workers"),
        (StandIn(0, answers=False), "does not answer"),
        (StandIn(2), None),
    ],
)
def test_a_cluster_without_workers_is_told_and_left(
    client: StandIn,
    told: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    module = SimpleNamespace(Client=lambda *_, **__: client, KilledWorker=RuntimeError)
    monkeypatch.setitem(sys.modules, "distributed", module)
    monkeypatch.setattr(executors, "_PATIENCE", 0.2)
    monkeypatch.setattr(executors, "_GIVE_UP", 1)
    (tmp_path / "spec.toml").write_text(GOOD)
    out = tmp_path / "t.jsonl"
    status = main(["table", str(tmp_path / "spec.toml"), "-o", str(out), "--scheduler", "h:1"])
    lines = capsys.readouterr().err.splitlines()
    if told is None:
        assert status == 0
        return
    assert status == 2
    assert any(told in line and line.endswith("waiting for 1 seconds.") for line in lines[:-1])
    assert told in lines[-1]
    assert lines[-1].endswith("keeps what is written.")
    assert out.exists()  # from which the next run goes on


@contextmanager
def running_cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a real scheduler with two real workers, and the processes."""
    known = folder / "scheduler.json"
    place = str(Path(sa.__file__).parent.parent)
    options: dict[str, Any] = {"stderr": subprocess.DEVNULL}
    options["env"] = {**os.environ, "PYTHONPATH": place}
    python = [sys.executable, "-W", "ignore", "-m"]
    file = ["--scheduler-file", str(known), "--no-dashboard"]
    started = []
    try:
        scheduler = [*python, "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
        started.append(subprocess.Popen([*scheduler, "--port", "0", *file], **options))
        for _ in range(2):
            worker = [*python, "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny"]
            started.append(subprocess.Popen([*worker, *file], **options))
        deadline = time.monotonic() + 60
        while not known.exists() or not known.read_text().endswith("}"):
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield json.loads(known.read_text())["address"], started
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["worker", "scheduler"])
def test_a_cluster_that_loses_a_process(
    tmp_path: Path, long_table: tuple[Spec, bytes], victim: str
) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    spec, lines = long_table
    (tmp_path / "spec.toml").write_text(LONG)
    path = tmp_path / "t.jsonl"
    with running_cluster(tmp_path) as (address, processes):
        command = ["table", str(tmp_path / "spec.toml"), "-o", str(path), "--scheduler", address]
        with subprocess.Popen([*PROGRAM, *command], stderr=subprocess.PIPE, text=True) as process:
            grown(path, 6)
            processes[0 if victim == "scheduler" else 1].kill()
            assert path.read_bytes().count(b"\n") < 55
            assert process.stderr is not None
            told = process.stderr.read()
    if victim == "worker":
        assert process.returncode == 0
    else:
        assert process.returncode == 2
        assert f"symasym: the cluster at {address} did not do the work" in told.splitlines()[-1]
        assert lines.startswith(path.read_bytes())
        executor: Executor = executors.Here()
        assert 0 < write_table(spec, path, executor=executor).made < 60
    # Nothing lost, nothing twice.
    assert path.read_bytes() == lines
