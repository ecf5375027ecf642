"""The command line: numbers alone on standard output, one sentence for what is wrong."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.base.inputs import meant
from symasym.commands.main import _join_negative, _parser, in_options, main
from symasym.methods import METHODS
from symasym.release.answer import METHODS as RELEASE_METHODS
from symasym.scenes import quantity_of
from symasym.workshop.figures import FIGURES
from symasym.workshop.report.measure import chosen
from symasym.workshop.reproduce import _chosen
from tests.processes import PROGRAM

FRICTION = ["--drift", "friction", "--set", "mu=3", "--set", "alpha=1", "--set", "z0=-0.4"]
RELEASE = ["release", "--kappa", "1", "--r", "5", "--eps", "0.1", "--z", "0"]
ESCAPE = ["value", "escape-time", *FRICTION, "--kappa", "0.1", "--r", "10"]

T_50 = "239803837121.03777001127804867950918476256220208411"


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(arguments)
    printed = capsys.readouterr()
    return status, printed.out, printed.err


def ok(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    status, out, err = run(capsys, *arguments)
    assert (status, err) == (0, "")
    return out


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The sentence, after checking that it is one and stands alone."""
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.startswith("symasym: ")
    assert err.endswith(".\n")
    assert err.count("\n") == 1
    return err


def test_the_number_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    assert ok(capsys, *ESCAPE, "--dps", "50") == T_50 + "\n"


def test_the_last_digit_is_rounded_right(capsys: pytest.CaptureFixture[str]) -> None:
    truth = sa.escape_time(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.1", 10, dps=100)
    for dps in range(1, 50):
        printed = ok(capsys, *ESCAPE, "--dps", str(dps)).strip()
        with mp.workdps(100):
            assert abs(mpf(printed) - truth) <= mpf(10) ** (12 - dps) * 0.5001


def test_float64_prints_the_digits_that_its_error_carries(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for words in ([], ["--log"], ["--method", "laplace"], ["--method", "uniform", "--order", "1"]):
        printed = ok(capsys, *ESCAPE, *words).strip()
        record = json.loads(ok(capsys, *ESCAPE, *words, "--json"))
        assert record["value"] == printed
        mantissa, _, power = printed.partition("e")
        with mp.workdps(60):
            truth = mp.log(mpf(T_50)) if words == ["--log"] else mpf(T_50)
            assert abs(mpf(printed) - truth) <= mpf(record["error"])
            # The last digit is off by one at most.
            unit = mpf(10) ** (int(power or 0) - len(mantissa.partition(".")[2]))
            assert mpf(record["error"]) <= unit
    assert ok(capsys, *ESCAPE) == "239803837121.0378\n"
    assert ok(capsys, *ESCAPE, "--method", "laplace") == "2.398e+11\n"


def test_digits_asked_for_are_no_more_than_the_error_carries(
    capsys: pytest.CaptureFixture[str],
) -> None:
    printed = ok(capsys, *ESCAPE, "--method", "laplace", "--order", "6", "--dps", "40").strip()
    record = json.loads(
        ok(capsys, *ESCAPE, "--method", "laplace", "--order", "6", "--dps", "40", "--json")
    )
    assert record["value"] == printed
    assert 4 < len(printed) < 20
    with mp.workdps(60):
        assert abs(mpf(printed) - mpf(T_50)) <= mpf(record["error"])


def test_a_probability_of_one_points_to_its_complement(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["value", "occupation", "--drift", "linear", "--set", "a_minus=1", "--set", "a_plus=-1"]
    status, out, err = run(capsys, *words, "--kappa", "0.1")
    assert (status, float(out)) == (0, 1)
    assert "--complement" in err
    assert 0 < float(ok(capsys, *words, "--kappa", "0.1", "--complement")) < 1e-40
    _, out, err = run(capsys, *words, "--kappa", "100", "--complement", "--dps", "2")
    assert (float(out), "leave --complement out" in err) == (1, True)
    ok(capsys, *words, "--kappa", "1")


def test_options_reach_the_verb(capsys: pytest.CaptureFixture[str]) -> None:
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    paper = float(ok(capsys, *ESCAPE, "--method", "paper"))
    assert paper == pytest.approx(sa.escape_time(drift, "0.1", 10, method="paper"), rel=1e-11)
    started = ok(capsys, *ESCAPE, "--start", "-1/3", "--dps", "20")
    assert started == ok(capsys, *ESCAPE, "--start=-1/3", "--dps", "20")
    truth = sa.escape_time(drift, "0.1", 10, start="-1/3", dps=20)
    assert float(started) == pytest.approx(float(truth), rel=1e-15)


@pytest.mark.parametrize(
    ("arguments", "near"),
    [
        (["valeu"], "value"),
        (["value", "escape_time"], "escape-time"),
        (["value", "escape-time", "--drift", "frictoin", "--kappa", "1", "--r", "1"], "friction"),
        ([*ESCAPE, "--kapa", "1"], "--kappa"),
        (["value", "escape-time", "--drift", "linear", "--kapa=1", "--r", "2"], "--kappa"),
        (["value", "T"], "escape-time"),
        ([*ESCAPE, "--method", "strongnoise"], "strong_noise"),
        ([*ESCAPE, "--set", "alhpa=1"], "alpha"),
        (["figure", "phaze"], "phase"),
        (["figure", "phase", "--set", "alhpa=1"], "alpha"),
        (["emit", "folds", "--target", "pyton"], "python"),
        (["reproduce", "--only", "phaze"], "phase"),
        (["verify", "--level", "fulll"], "full"),
        (["report", "--scene", "weka"], "weak"),
        ([*RELEASE, "--method", "marhc"], "march"),
        (["emit", "folds", "--target", "c", "--set", "alfa=1"], "alpha"),
        (["report", "--scene", "modreate"], "moderate"),
        (["--verison"], "--version"),
        ([*ESCAPE, "--digits", "20"], "--dps"),
        ([*ESCAPE[:-2], "--radius", "10"], "--r"),
        ([*ESCAPE[:2], "--drfit", "linear", "--kappa", "1", "--r", "2"], "--drift"),
        (["value", "exit-probability", *ESCAPE[2:], "-complement"], "--complement"),
        (["value", "escape-time", "--drift", "poly"], "polynomial"),
        (["value", "density"], "stationary-density"),
        (["emit", "folds", "--target", "js"], "javascript"),
        (["emit", "eq:Ttilde", "--target", "c", "--drift", "friction", "--set", "muu=1"], "mu"),
        ([*ESCAPE, "--order", "optmal"], "optimal"),
        ([*RELEASE, "--set", "muu=1"], "mu"),
    ],
)
def test_what_may_have_been_meant(
    capsys: pytest.CaptureFixture[str], arguments: list[str], near: str
) -> None:
    with contextlib.suppress(SystemExit):
        assert main(arguments) == 2
    assert re.search(rf"perhaps (you mean )?'?{near}'?\.?$", capsys.readouterr().err.strip())


@pytest.mark.parametrize(
    ("arguments", "end"),
    [
        ("value occupation --kappa 1 --r 2", "--r 2; escape-time and exit-probability take --r"),
        ("value escape-time --kappa 1 --r 2 --y 3", "--y 3; stationary-density takes --y"),
        (
            "value escape-time --kappa 1 --r 2 -complement",
            "-complement; exit-probability and occupation take --complement",
        ),
        ("value escape-time --kappa 1 --r 2 --workers 2", "--workers 2"),
        ("value escape-time --kappa 1 --r 2 --out f", "--out f"),
        ("value escape-time --kappa 1 --r 2 --seed 2", "--seed 2"),
        ("value escape-time --kappa 1 --r 2 --eps 1", "--eps 1"),
        ("derive fr1 --latex", "--latex"),
        ("emit folds --target c --latex", "--latex"),
        ("figure fil --points 3", "--points 3"),
        ("show fr1 --target c", "--target c"),
    ],
)
def test_no_option_of_another_command_is_suggested(
    capsys: pytest.CaptureFixture[str], arguments: str, end: str
) -> None:
    scene = FRICTION if arguments.startswith("value") else []
    with pytest.raises(SystemExit):
        main([*arguments.split(), *scene])
    told = capsys.readouterr().err
    assert told.endswith(f"unrecognized arguments: {end}\n")
    assert told.startswith(f"usage: symasym {arguments.split()[0]} ")


@pytest.mark.parametrize(
    ("given", "known", "near"),
    [
        ("tahn", "tan tanh", "tanh"),
        ("alfa", "alpha mu", "alpha"),
        ("z", "mu alpha z0", "z0"),
        ("arctan", "atan tan", "atan"),
        ("--strat", "--start --set", "--start"),
        ("poly", "polynomial linear", "polynomial"),
        ("ttilde", "eq:Ttilde eq:Ttildesmall", "eq:Ttilde"),
        *[(given, "--r --z --set --drift --order --scene --start --paths --expr", None)
          for given in ("--y", "--out", "--digits", "--workers", "--seed", "--target", "--latex")],
        ("nu", "mu alpha", None),
        ("e", "eps e1 e2", None),
    ],
)  # fmt: skip
def test_what_is_close(given: str, known: str, near: str | None) -> None:
    assert meant(given, known.split()) == (f"; perhaps you mean '{near}'" if near else "")


def helped(*command: str) -> str:
    """What --help prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), pytest.raises(SystemExit):
        main([*command, "--help"])
    return out.getvalue()


@pytest.mark.parametrize(
    "command",
    "reproduce value release derive show emit figure table verify report".split(),  # noqa: SIM905
)
def test_help_has_two_examples_that_are_read(command: str) -> None:
    lines = helped(command).partition("examples:\n")[2].splitlines()
    assert len(lines) == 2
    for line in lines:
        program, *words = shlex.split(line)
        assert program == "symasym"
        read = _parser().parse_args(_join_negative(words))
        assert read.run
        if command == "report":
            chosen(read.scene)
        if command == "figure":
            assert read.name in FIGURES
        if command == "reproduce":
            assert _chosen(read.only)


def test_the_programs_own_examples_run(capsys: pytest.CaptureFixture[str]) -> None:
    lines = helped().partition("examples:\n")[2].splitlines()
    assert len(lines) == 2
    for line in lines:
        try:
            status = main(shlex.split(line)[1:])
        except SystemExit as end:
            status = int(end.code or 0)
        assert status == 0
        assert capsys.readouterr().out


@pytest.mark.parametrize(
    "quantity", ["escape-time", "exit-probability", "occupation", "stationary-density"]
)
def test_help_lists_methods_and_drifts(quantity: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = helped("value", quantity)
    assert re.search(r"friction +mu, alpha, z0\n.*\n +sine +a_minus, a_plus, b, waves", text)
    verb = quantity.replace("-", "_")
    known = {m.name for m in METHODS.values() for q in m.quantities if quantity_of(q).verb == verb}
    listed = re.findall(r"^  (\w+) ", text.partition("methods:")[2].partition("drifts")[0], re.M)
    assert set(listed) == (known | {"auto"} if quantity != "stationary-density" else set())
    for line in text.partition("examples:\n")[2].splitlines():
        ok(capsys, *shlex.split(line)[1:])


SLIDING = ["--drift", "linear", "--set", "a_minus=1", "--set", "a_plus=-2", "--kappa", "0.5"]


def test_every_quantity(capsys: pytest.CaptureFixture[str]) -> None:
    drift = sa.linear(1, -2)
    inside = float(ok(capsys, "value", "occupation", *SLIDING))
    assert inside == pytest.approx(sa.occupation(drift, 0.5), rel=1e-12)
    outside = float(ok(capsys, "value", "occupation", *SLIDING, "--complement"))
    assert inside + outside == pytest.approx(1, abs=1e-11)
    density = float(ok(capsys, "value", "stationary-density", *SLIDING, "--y", "-0.3"))
    assert density == pytest.approx(sa.stationary_density(drift, 0.5, "-0.3"), rel=1e-12)
    left = float(ok(capsys, "value", "exit-probability", *SLIDING, "--r", "2"))
    right = float(ok(capsys, "value", "exit-probability", *SLIDING, "--r", "2", "--complement"))
    assert left == pytest.approx(sa.exit_probability(drift, 0.5, 2), rel=1e-15)
    assert left + right == pytest.approx(1, abs=1e-11)


@pytest.mark.parametrize(
    ("arguments", "drift"),
    [
        ("--drift tanh --set a_minus=1 --set a_plus=-1 --set steepness=5", sa.tanh(1, -1, 5)),
        ("--drift hill --set a_minus=1 --set a_plus=2 --set K=1/2 --set n=3", None),
        ("--drift sine --set a_minus=1 --set a_plus=1 --set b=4 --set waves=2", None),
        ("--drift polynomial --set c0=1 --set c2=1/4", sa.polynomial(1, 0, "1/4")),
        ("--expr -u+b --set b=1/4", sa.polynomial("1/4", -1)),
    ],
)
def test_every_drift(
    capsys: pytest.CaptureFixture[str], arguments: str, drift: sa.Drift | None
) -> None:
    if drift is None:
        drift = sa.hill(1, 2, "1/2", n=3) if "hill" in arguments else sa.sine(1, 1, 4, waves=2)
    out = ok(capsys, "value", "escape-time", *arguments.split(), "--kappa", "0.7", "--r", "3")
    assert float(out) == pytest.approx(sa.escape_time(drift, "0.7", 3), rel=1e-12)


def test_json_tells_what_is_known_about_the_number(capsys: pytest.CaptureFixture[str]) -> None:
    record = json.loads(ok(capsys, *ESCAPE, "--dps", "50", "--json"))
    assert record["value"] == T_50
    assert mpf(record["error"]) < mpf("1e-37")
    assert record["error_kind"] in {"bound", "estimate"}
    assert record["method"] == "exact"
    assert record["seconds"] > 0
    assert record["inputs"]["set"] == {"mu": "3", "alpha": "1", "z0": "-0.4"}
    assert record["inputs"]["kappa"] == "0.1"


def test_json_claims_nothing_for_the_papers_formula(capsys: pytest.CaptureFixture[str]) -> None:
    for digits in ([], ["--dps", "20"]):
        record = json.loads(ok(capsys, *ESCAPE, "--method", "paper", "--json", *digits))
        assert (record["error"], record["error_kind"]) == (None, "none")


def test_json_in_float64(capsys: pytest.CaptureFixture[str]) -> None:
    record = json.loads(ok(capsys, *ESCAPE, "--json"))
    with mp.workdps(60):
        assert abs(mpf(record["value"]) - mpf(T_50)) <= mpf(record["error"])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([*ESCAPE, "--kappa", "-1"], "kappa is -1"),
        ([*ESCAPE, "--kappa", "a"], "kappa is 'a'"),
        ([*ESCAPE, "--r", "0"], "r is 0"),
        ([*ESCAPE, "--start", "11"], "start is 11"),
        ([*ESCAPE, "--dps", "0"], "dps is 0"),
        ([*ESCAPE, "--dps", "10001"], "dps is 10001"),
        ([*ESCAPE, "--method", "magic"], "method is 'magic'"),
        ([*ESCAPE, "--order", "3"], "order is 3"),
        ([*ESCAPE, "--kappa", "0.01"], "pass --log, or --dps N"),
        (
            ["release", "--kappa", "0.1", "--r", "10", "--eps", "0.01", "--z", "-0.4"]
            + ["--patience", "0.01"],
            "pass --patience SECONDS",
        ),
        (
            ["value", "escape-time", "--drift", "linear", "--kappa", "1", "--r", "2"],
            "with --set a_minus=…",
        ),
        (["figure", "release", "--set", "kappa=0"], "kappa is 0; it must be greater than 0"),
        ([*ESCAPE, "--set", "z0=1"], "z0 is set twice"),
        ([*ESCAPE, "--set", "nu=1"], "nu is no parameter of friction"),
        ([*ESCAPE, "--set", "nu"], "--set is 'nu'"),
        (["value", "occupation", *FRICTION, "--kappa", "1"], "no sliding region"),
        (["value", "occupation", "--drift", "linear", "--kappa", "1"], "a_minus"),
        (["value", "escape-time", "--expr", "u +", "--kappa", "1", "--r", "2"], "u +"),
        (
            ["value", "escape-time", "--expr", "arctan(u)", "--kappa", "1", "--r", "2"],
            "perhaps you mean 'atan'",
        ),
        (["value", "escape-time", "--expr", "1/u", "--kappa", "1", "--r", "2"], "u"),
        (
            ["value", "escape-time", "--drift", "sine", "--set", "waves=1.5"]
            + ["--kappa", "1", "--r", "2"],
            "waves is '1.5'",
        ),
    ],
)
def test_bad_input_is_one_sentence(
    capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    assert told in refused(capsys, *arguments)


@pytest.mark.parametrize(
    ("python", "options"),
    [
        ("sa.friction(mu=3, z0='-0.4').", "--drift friction --set mu=3 --set z0=-0.4."),
        ("sa.polynomial(1, 0, 0.25)", "--drift polynomial --set c0=1 --set c1=0 --set c2=0.25"),
        ("sa.Drift('b*(u - 1)').bind(b=0.25)", "--expr 'b*(u - 1)' --set b=0.25"),
        ("use bind(a=…, b=…), or method='bound' or 'exact'.",
         "use --set a=… --set b=…, or --method bound or exact."),
        ("'escape_time, log=True' is Laplace's", "'escape_time, log=True' is Laplace's"),
        ("my_escape_time.toml: method is 'method=x'", "my_escape_time.toml: method is 'method=x'"),
    ],
)  # fmt: skip
def test_options_for_python(python: str, options: str) -> None:
    assert in_options(python) == options


def test_what_a_caller_wrote_stays(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    spec = tmp_path / "escape_time.toml"
    spec.write_text('quantities = ["escape_time"]\nkappa = "1"\nr = "2"\nexpr = "1 - u"\n')
    told = refused(capsys, "table", str(spec), "-o", str(tmp_path / "t.jsonl"))
    assert "escape_time.toml, line 1, quantities: 'escape_time' is unknown" in told


@pytest.mark.parametrize(
    ("arguments", "end"),
    [
        ("T --drift friction", " symasym value escape-time --method laplace --json tells it"),
        ("1-C --drift linear --noise strong", "; symasym value exit-probability --complement "
         "--method strong_noise --json tells it"),
        ("density --drift linear", "relative to its first term"),
    ],
)  # fmt: skip
def test_an_expansion_names_the_command_that_has_its_error(
    capsys: pytest.CaptureFixture[str], arguments: str, end: str
) -> None:
    quantity, *words = arguments.split()
    text = ok(capsys, "show", f"expansion:{quantity}", "--order", "1", *words)
    assert text.endswith(f"{end}\n")
    assert "evaluate(" not in text


@pytest.mark.parametrize(
    "arguments", [[], ["value"], ["value", "escape-time"], ["frobnicate"], [*ESCAPE, "--dps", "x"]]
)
def test_a_wrong_command_line_shows_the_usage(
    capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert capsys.readouterr().err.startswith("usage: symasym")


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith("symasym 0.")


def test_a_reader_that_left_is_no_traceback() -> None:
    command = [*PROGRAM, *ESCAPE, "--dps", "5000"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141


def test_derive_into_head_is_quiet(tmp_path: Path) -> None:
    command = [*PROGRAM, "derive", "eq:V", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b"derivations: 1 steps\n"
    assert process.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_standard_output_is_one_sentence() -> None:
    with open("/dev/full", "wb") as full:
        done = subprocess.run([*PROGRAM, *ESCAPE], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("symasym: standard output cannot be written (No space")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(not Path("/bin/sh").exists(), reason="needs a shell")
@pytest.mark.parametrize("words", [ESCAPE, ["figure"], ["figure", "phase"], ["--version"]])
def test_closed_standard_output_is_one_sentence(words: list[str], tmp_path: Path) -> None:
    for closed, told in (
        (">&-", "symasym: standard output is closed; open it or redirect it.\n"),
        (">&- 2>&-", ""),
    ):
        line = f"{shlex.join([*PROGRAM, *words])} {closed}"
        done = subprocess.run(["/bin/sh", "-c", line], capture_output=True, text=True, cwd=tmp_path)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", told)
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(not Path("/bin/sh").exists(), reason="needs a shell")
def test_closed_standard_error_keeps_the_sentence_off_the_output() -> None:
    line = f"{shlex.join([*PROGRAM, *ESCAPE, '--dps', '0'])} 2>&-"
    done = subprocess.run(["/bin/sh", "-c", line], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")


def test_value_loads_neither_sympy_nor_matplotlib() -> None:
    code = (
        "import sys; from symasym.commands.main import main; main(sys.argv[1:])\n"
        "assert not {'sympy', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, *ESCAPE, "--dps", "20"], check=True)


# -- terminals, places and sizes -----------------------------------------------------------------


def test_a_terminal_without_unicode() -> None:
    environment = {
        "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii", "PYTHONCOERCECLOCALE": "0",
        "PYTHONPATH": str(Path(sa.__file__).parent.parent), "PATH": "",
    }  # fmt: skip
    script = "import sys; from symasym.commands.main import main; sys.exit(main())"
    for arguments in (
        ["show", "fr1"],
        ["show", "eq:Ttilde"],
        ["value", "occupation", "--help"],
    ):
        done = subprocess.run(
            [sys.executable, "-c", script, *arguments], capture_output=True, env=environment
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.isascii()
        assert len(done.stdout) > 50
    done = subprocess.run(
        [sys.executable, "-c", script, *ESCAPE, "--dps", "\N{MINUS SIGN}5", "--r", "é"],
        capture_output=True, env={**environment, "PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip
    assert done.returncode == 2


def test_places_that_are_no_files(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dir.png").mkdir()
    (tmp_path / "dir.jsonl").mkdir()
    (tmp_path / "t.toml").write_text(
        'quantities = ["T"]\ndps = 15\nkappa = "1"\nr = "2"\nexpr = "1 - u"\n'
    )
    for arguments in (
        ("table", "t.toml", "-o", ""),
        ("table", "t.toml", "-o", "dir.jsonl"),
        ("table", "t.toml", "-o", "."),
        ("figure", "phase", "-o", "dir.png"),
        ("figure", "phase", "-o", ""),
        ("verify", "-o", ""),
        ("report", "--out="),
        ("reproduce", "-o", ""),
        ("derive", "eq:V", "-o", ""),
        ("emit", "fr1", "--target", "c", "-o", ""),
        ("emit", "fr1", "--target", "python", "-o", ""),
        ("emit", "fr1", "--target", "python", "-o", "dir.png"),
    ):
        assert (arguments[-1].removeprefix("--out=") or "''") in refused(capsys, *arguments)
    assert {p.name for p in tmp_path.iterdir()} == {"dir.png", "dir.jsonl", "t.toml"}


def test_the_release_lists_its_methods(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["release", "--help"])
    out = capsys.readouterr().out
    assert all(f"  {name} " in out for name in RELEASE_METHODS)


def test_advice_is_in_options(capsys: pytest.CaptureFixture[str]) -> None:
    told = refused(capsys, "emit", "eq:Ttilde", "--target", "c")
    assert "give --drift NAME or --expr A" in told


def test_sizes_are_bounded(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = ("-o", str(tmp_path / "x.png"))
    assert "points is" in refused(capsys, "figure", "fric2", "--set", "points=1000000000", *out)
    for alpha in ("1e-300",):
        told = refused(capsys, "figure", "fil", "--set", f"alpha={alpha}", *out)
        assert f"fil cannot be drawn with alpha = {alpha}; give values nearer to 1." in told
    assert "waves" in refused(
        capsys, "value", "escape-time", "--drift", "sine", "--set", "a_minus=1", "--set",
        "a_plus=1", "--set", "b=1", "--set", "waves=1000000", "--kappa", "1", "--r", "2",
    )  # fmt: skip


def test_show_prints_expansions(capsys: pytest.CaptureFixture[str]) -> None:
    """The formula of `sa.expand`; without a drift in V's derivatives at a well and a barrier."""
    text = ok(capsys, "show", "expansion:T", "--drift", "friction", "--order", "1")
    python = re.compile(r"evaluate\(…, full=True\)|symasym value .* --json")
    assert python.sub("", text) == python.sub("", f"{sa.expand(sa.friction(), 'T', order=1)}\n")
    latex = ok(capsys, "show", "expansion:T", "--order", "1", "--latex")
    assert latex == f"{sa.expand(sa.Drift.general(), 'T', order=1).latex()}\n"
    assert "h_1" not in latex
    scene = ("--expr", "1/2 - u + b*u**3", "--set", "b=1/10", "--start", "-1/4")
    drift = sa.Drift("1/2 - u + b*u**3").bind(b="1/10")
    want = sa.expand(drift, "1 - C", noise="strong", order=1, start="-1/4")
    args = ("show", "expansion:1-C", *scene, "--noise", "strong", "--order", "1")
    assert python.sub("", ok(capsys, *args)) == python.sub("", f"{want}\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("eq:Ttilde --order 2", "--order does not go with eq:Ttilde"),
        ("expansion:T --all", "--all does not go with expansion:T"),
        ("expansion:T --set mu=3", "give --drift or --expr"),
        ("expansion:Q --drift friction", "quantity is 'Q'; give one of"),
        ("expansion:T --expr __import__('os')", "A"),
    ],
)
def test_show_refuses_what_does_not_fit(
    capsys: pytest.CaptureFixture[str], arguments: str, words: str
) -> None:
    assert words in refused(capsys, "show", *arguments.split())


def test_a_probability_of_many_nines_is_no_1(capsys) -> None:
    line = ["value", "occupation", "--drift", "linear", "--set", "a_minus=1", "--set", "a_plus=-1"]
    # 1 - P is about e^(-100).
    for digits, ones in (("20", True), ("50", False)):
        assert main([*line, "--kappa", "0.1", "--dps", digits]) == 0
        said = capsys.readouterr()
        assert (said.out.strip(".0\n") == "1") == ones
        assert ("the value is 1 to these digits" in said.err) == ones
