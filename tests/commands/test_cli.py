"""The command line: numbers alone on standard output, one sentence for what is wrong."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.commands.main import main
from symasym.workshop import reproduce

FRICTION = "--drift friction --set mu=3 --set alpha=1 --set z0=-0.4"
ESCAPE = f"value escape-time {FRICTION} --kappa 0.1 --r 10"
SLIDING = "--drift linear --set a_minus=1 --set a_plus=-2 --kappa 0.5"
LINEAR = "--drift linear --set a_minus=1 --set a_plus=-1 --kappa 1"
RELEASE = "release --kappa 1 --r 5 --eps 0.1 --z 0"

T_50 = "239803837121.03777001127804867950918476256220208411"


class Program:
    """Runs command lines: status, standard output and standard error."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self.capsys = capsys

    def __call__(self, line: str) -> tuple[int, str, str]:
        try:
            status = main(shlex.split(line))
        except SystemExit as end:  # argparse's way
            status = int(end.code or 0)
        printed = self.capsys.readouterr()
        return status, printed.out, printed.err

    def out(self, line: str) -> str:
        status, out, err = self(line)
        assert (status, err) == (0, ""), line
        return out


@pytest.fixture
def program(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Program:
    monkeypatch.chdir(tmp_path)
    return Program(capsys)


# -- value -----------------------------------------------------------------------------------------


def test_the_last_digit_is_rounded_right(program: Program) -> None:
    assert program.out(f"{ESCAPE} --dps 50") == T_50 + "\n"
    truth = sa.escape_time(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.1", 10, dps=70)
    for dps in range(1, 50, 3):
        with mp.workdps(70):
            off = abs(mpf(program.out(f"{ESCAPE} --dps {dps}")) - truth)
            assert off <= mpf(10) ** (12 - dps) * 0.5001


@pytest.mark.parametrize(
    "words",
    [
        "", "--log", "--method laplace", "--method uniform --order 1",
        "--method laplace --order 6 --dps 40", "--dps 30",
    ],
)  # fmt: skip
def test_as_many_digits_as_the_error_carries(program: Program, words: str) -> None:
    printed = program.out(f"{ESCAPE} {words}").strip()
    record = json.loads(program.out(f"{ESCAPE} {words} --json"))
    printed, _, error = printed.partition(" ± ")
    assert record["value"] == printed
    assert error == (record["error"] if "method" in words else "")
    assert record["inputs"]["set"] == {"mu": "3", "alpha": "1", "z0": "-0.4"}
    mantissa, _, power = printed.lower().partition("e")
    unit = mpf(10) ** (int(power or 0) - len(mantissa.partition(".")[2]))
    with mp.workdps(60):
        truth = mp.log(mpf(T_50)) if words == "--log" else mpf(T_50)
        assert abs(mpf(printed) - truth) <= mpf(record["error"]) <= (1_000 if error else 1) * unit


@pytest.mark.parametrize(
    ("line", "want"),
    [
        (f"escape-time {FRICTION} --kappa 1 --r 2 --start -1/3",
         lambda: sa.escape_time(sa.friction(3, 1, "-0.4"), 1, 2, start="-1/3")),
        (f"occupation {SLIDING}", lambda: sa.occupation(sa.linear(1, -2), 0.5)),
        (f"occupation {LINEAR} --complement --log",
         lambda: sa.occupation(sa.linear(1, -1), 1, complement=True, log=True)),
        (f"stationary-density {SLIDING} --y -0.3",
         lambda: sa.stationary_density(sa.linear(1, -2), 0.5, "-0.3")),
        (f"exit-probability {SLIDING} --r 2", lambda: sa.exit_probability(sa.linear(1, -2), .5, 2)),
        (f"exit-probability {SLIDING} --r 2 --complement",
         lambda: 1 - sa.exit_probability(sa.linear(1, -2), 0.5, 2)),
        ("escape-time --drift sine --set a_minus=1 --set a_plus=1 --set b=4 --set waves=2 --kappa "
         "1 --r 3", lambda: sa.escape_time(sa.sine(1, 1, 4, waves=2), 1, 3)),
        ("escape-time --expr -u+b --set b=1/4 --kappa 1 --r 3",
         lambda: sa.escape_time(sa.polynomial("1/4", -1), 1, 3)),
        ("escape-time --expr -u --no-layer --noise 1+u**2/4 --kappa 1 --ends -1 2 --moment 2",
         lambda: sa.escape_time(sa.Drift("-u", layer=None, noise="1 + u**2/4"), 1, ends=(-1, 2),
                                moment=2)),
        ("T --expr -u --noise 1+u**2/4 --stratonovich --kappa 1 --r 2 --quantile 1/2",
         lambda: sa.exit_law(sa.Drift("-u", noise="1 + u**2/4", ito="stratonovich"), 1,
                             2).quantile("1/2")),
        (f"escape-time {FRICTION} --no-layer --kappa 1 --ends -2 2",
         lambda: sa.escape_time(sa.Drift("7/5 - u - 3*(u - u**3)", layer=None), 1, ends=(-2, 2))),
    ],
)  # fmt: skip
def test_options_reach_the_verb(program: Program, line: str, want: Any) -> None:
    assert float(program.out(f"value {line}").split()[0]) == pytest.approx(want(), rel=1e-11)


def test_value_loads_no_matplotlib() -> None:
    code = (
        "import sys; from symasym.commands.main import main; main(sys.argv[1:])\n"
        "assert 'matplotlib' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, *ESCAPE.split(), "--dps", "20"], check=True)


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (f"{ESCAPE} --kappa -1", "kappa is -1"),
        ("value occupation --expr -u --kappa 1 --r 2", "takes no --r"),
        (f"{ESCAPE} --r 0", "r is 0"),
        (f"{ESCAPE} --dps 0", "dps is 0"),
        (f"{ESCAPE} --quantile 1/2 --method laplace", "method"),
        ("value T --kappa 1 --r 2", "drift"),
        (f"{ESCAPE} --method magic", "magic"),
        (f"{ESCAPE} --kappa 0.01", "log"),
        (f"{ESCAPE} --set nu=1", "nu"),
        (f"{ESCAPE} --set z0=0", "z0 is no NAME=X, or given twice"),
        ("value stationary-density --expr -u --kappa 1", "--y"),
        ("value occupation --drift linear --kappa 1", "a_minus"),
        ("value escape-time --expr 'u +' --kappa 1 --r 2", "u +"),
        ("value escape-time --expr __import__('os') --kappa 1 --r 2", "__import__"),
        ("value escape-time --drift sine --set a_minus=1 --set a_plus=1 --set b=1 "
         "--set waves=1000000 --kappa 1 --r 2", "waves"),
        (f"{RELEASE} --set muu=1", "muu"),
        ("figure phaze", "phase"),
        ("figure phase -o phase.doc", "phase.doc"),
        ("emit folds --target pyton", "pyton"),
        ("emit eq:V --target c --order 2", "--order"),
        ("emit eq:Ttilde --target c --expr u-u**3 --no-layer", "no layer"),
        ("emit fr1 --target c -o ''", "cannot be written"),
        ("show eq:Ttilde --order 2", "--order"),
        ("show eq:Ttilde --drift friction", "--drift"),
        ("show expansion:Q --drift friction", "Q"),
        ("derive eq:nothing", "eq:nothing"),
        ("table none.toml -o t.jsonl", "none.toml"),
        ("table none.toml -o t.jsonl --cluster tcp://127.0.0.1:1", "cluster"),
        ("verify --level fulll", "fulll"),
        ("report --scene weka", "weka"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence(program: Program, line: str, told: str, tmp_path: Path) -> None:
    status, out, err = program(line)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("symasym: ")
    assert told in err
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("line", "near"),
    [
        ("valeu", "value"),
        ("value escape_time --kappa 1", "escape-time"),
        ("value escape-time --expr -u --kappa 1 --r 2 --mehtod exact", "--method"),
        ("value escape-time --drift frictoin --kappa 1 --r 1", "friction"),
    ],
)
def test_what_may_have_been_meant(program: Program, line: str, near: str) -> None:
    status, out, err = program(line)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert f"perhaps you mean '{near}'" in err


# -- the examples of each help ---------------------------------------------------------------------

COMMANDS = ["", "value", "show", "derive", "emit", "figure", "release", "table", "reproduce"]
COMMANDS += ["verify", "report"]
#: Examples of more than a second or two.
SLOW = {"derive", "release", "reproduce", "verify", "report", "figure"}
CHEAP = {"derive eq:Ttilde"}
WELL = 'quantities = ["T"]\ndps = 15\nkappa = ["1", "2"]\nr = "2"\nexpr = "1 - u"\n'


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("all_of_them", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_examples_run(
    program: Program, command: str, all_of_them: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("well.toml").write_text(WELL)
    monkeypatch.setattr(reproduce, "Z0", ("-0.40",))
    examples = program.out(f"{command} --help").partition("examples:\n")[2].splitlines()
    assert len(examples) >= 2
    for line in (example.strip().removeprefix("symasym ") for example in examples):
        slow = line.split()[0] in SLOW and line not in CHEAP
        if all_of_them or not slow:
            status, out, _ = program(line)
            assert (status, bool(out)) == (0, True), line


# -- files and formulas ----------------------------------------------------------------------------


def test_files_are_written_where_asked(program: Program) -> None:
    Path("well.toml").write_text(WELL)
    program("table well.toml -o well.jsonl")
    assert len(Path("well.jsonl").read_text().splitlines()) >= 2
    assert program("table well.toml -o well.jsonl")[1].endswith("up to date\n")
    printed = program.out("emit folds --target javascript")
    program.out("emit folds --target javascript -o folds.js")
    assert Path("folds.js").read_text() == printed


def test_show_prints_the_expansion_of_the_library(program: Program) -> None:
    drift = sa.Drift("1/2 - u + b*u**3").bind(b="1/10")
    want = sa.expand(drift, "1 - C", noise="strong", order=1, start="-1/4").latex()
    line = "show expansion:1-C --expr '1/2 - u + b*u**3' --set b=1/10 --start -1/4"
    assert program.out(f"{line} --method strong_noise --order 1 --latex") == f"{want}\n"
    assert program.out("show eq:Ttilde --latex") == f"{sa.formula('eq:Ttilde').latex()}\n"
    assert program.out("show folds").startswith("folds: ")
    emitted = program.out("emit expansion:1-P --target numpy --drift linear --order 0")
    assert emitted == str(sa.expand(sa.linear(), "1 - P", order=0).emit("numpy"))


def test_a_release(program: Program) -> None:
    record = json.loads(program.out(f"{RELEASE} --json"))
    want = sa.release(sa.oscillator(3, 1), 1, 5, eps="0.1", start=(0, 0), rtol="1e-6")
    assert record["mean"] == want.mean
    assert record["time"]["0.5"] == want.time.quantile(0.5)
