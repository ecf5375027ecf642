"""`symasym verify` finds what is broken, and says so of nothing else."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import symasym as sa
from symasym import paper
from symasym.commands.main import main
from symasym.exact import balls
from symasym.exact import floats as double
from symasym.expansions import answer as weak_noise
from symasym.expansions import strong_noise
from symasym.workshop.verify import Verification, verify
from symasym.workshop.verify import run as tasks_module
from symasym.workshop.verify.findings import Finding, random_scene, ratio
from symasym.workshop.verify.run import Done, Task, record, rows, table, tasks
from tests.processes import started

SCENE = "friction k=0.3"
MILD = ("quadrature", "friction k=1")


def checked(*wanted: tuple[str, str]) -> Verification:
    """These checks, of these scenes, in this process."""
    return verify("quick", 1, 0, lambda task: (task.check, task.key[-1]) in wanted)


def failures(*wanted: tuple[str, str]) -> set[tuple[str, str]]:
    found = checked(*wanted)
    assert found.tasks == len(wanted)
    return {(f.evaluator, f.check) for f in found.failures}


ALL = [
    MILD,
    *((check, SCENE) for check in ("accuracy", "stated error", "sums", "equations")),
    ("symmetries", SCENE),
    ("arrays", SCENE),
    ("accuracy", "friction sliding"),
    ("orders", "friction, well"),
    ("orders", "friction, strong"),
    ("orders", "linear sliding, strong"),
    ("weak limit", "friction, well"),
    ("far limit", "friction, well"),
    ("strong limit", "hill down"),
]


def test_nothing_is_wrong_as_it_is() -> None:
    found = checked(*ALL)
    assert found.tasks == len(found.done) == len(ALL)
    assert found.failures == []
    assert found.passed
    text = table(found)
    assert "eq:Ttilde" in text
    assert "0 failed" in text


def times(factor: Any, function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *args, **named: function(*args, **named) * factor


def off_by_digits(function: Callable[..., Any]) -> Callable[..., Any]:
    """The last digits of a ball wrong."""
    return lambda *args, **named: function(*args, **named) * (1 + 1e-9)


@pytest.mark.parametrize(
    ("module", "name", "broken", "task", "seen"),
    [
        (balls, "enclosure", off_by_digits, MILD, ("digits", "quadrature")),
        (
            paper,
            "weak_noise_time",
            lambda f: times(2, f),
            ("orders", "friction, well"),
            ("paper", "order"),
        ),
        (
            paper,
            "strong_noise_occupation",
            lambda f: times(0.9, f),
            ("orders", "linear sliding, strong"),
            ("paper", "order"),
        ),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_a_broken_evaluator_is_found(
    monkeypatch: pytest.MonkeyPatch,
    module: Any,
    name: str,
    broken: Callable[..., Any],
    task: tuple[str, str],
    seen: tuple[str, str],
) -> None:
    monkeypatch.setattr(module, name, broken(getattr(module, name)))
    assert seen in failures(task)


def test_a_broken_float64_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = double.logs_of

    def wrong(*args: Any, **named: Any) -> Any:
        found = right(*args, **named)
        return found._replace(log=found.log + 1e-10)

    monkeypatch.setattr(double, "logs_of", wrong)
    found = failures(("accuracy", SCENE))
    assert ("float64", "accuracy") in found
    assert ("float64 arrays", "stated error") in found


@pytest.mark.parametrize(
    ("module", "method", "task"),
    [
        (strong_noise, "strong_noise", ("stated error", "friction k=10")),
        (weak_noise, "laplace", ("stated error", "friction")),
    ],
)
def test_an_error_that_is_claimed_too_small_is_found(
    monkeypatch: pytest.MonkeyPatch, module: Any, method: str, task: tuple[str, str]
) -> None:
    right = module.of_scene

    def proud(*args: Any) -> Any:
        found = right(*args)
        return found._replace(error=found.error / 10**6)

    monkeypatch.setattr(module, "of_scene", proud)
    found = failures(task)
    assert {evaluator for evaluator, _ in found} >= {method}


def test_a_paper_that_claims_an_error_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = paper.of_scene

    def proud(*args: Any) -> Any:
        found = right(*args)
        return found._replace(error=found.value / 1000, kind="estimate")

    monkeypatch.setattr(paper, "of_scene", proud)
    assert ("paper", "stated error (estimate)") in failures(("stated error", "friction k=0.3"))


@pytest.mark.skipif(os.name == "nt", reason="no timers there")
def test_what_takes_too_long_is_stopped_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    right = balls.enclosure

    def slow(name: str, *given: Any, **named: Any) -> Any:
        while name == "C":
            pass
        return right(name, *given, **named)

    monkeypatch.setattr(balls, "enclosure", slow)
    monkeypatch.setattr(tasks_module, "MOST_SECONDS", 1.0)
    found = checked(("accuracy", SCENE), ("pieces", "folds"))
    (done,) = found.stopped
    # On a busy machine the timer, which counts in ticks, is early.
    assert 0.5 < done.seconds < 10
    assert done.findings, "what was found before is kept"
    assert found.tasks == len(found.done) == 2
    assert found.failures == []
    assert not found.passed
    assert f"STOPPED accuracy of table {SCENE}: not finished after 1 s." in table(found)
    assert "2 of 2 tasks, 1 of them stopped, in" in table(found)
    assert record(found)["stopped"] == [f"accuracy of table {SCENE}"]
    # And no timer is left behind.
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)


def test_a_crash_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def crash(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError("a test")

    monkeypatch.setattr(balls, "enclosure", crash)
    found = checked(("sums", SCENE))
    assert not found.passed
    assert "ZeroDivisionError" in table(found)


def test_random_scenes_are_those_of_their_seed() -> None:
    scenes = [random_scene(3, k) for k in range(14)]
    again = [random_scene(3, k) for k in range(14)]
    assert [(p.kappa, p.r, p.start, repr(p.make())) for p in scenes] == [
        (p.kappa, p.r, p.start, repr(p.make())) for p in again
    ]
    assert scenes[0].kappa != random_scene(4, 0).kappa
    for problem in scenes:
        assert abs(Fraction(problem.start)) < Fraction(problem.r)
        if "tangency" not in problem.tags:
            assert problem.make().region == problem.region


def test_a_level_that_does_not_exist() -> None:
    with pytest.raises(sa.InputError, match="level is 'deep'; give one of 'quick', 'full'"):
        verify("deep")
    with pytest.raises(sa.InputError, match="workers is -1"):
        verify(workers=-1)
    assert main(["verify", "--level", "deep"]) == 2


def test_ratios() -> None:
    assert ratio(0, 0) == 0
    assert ratio(1, 0) == float("inf")
    assert not Finding("", "", "", float("nan"), "").passed
    assert Finding("", "", "", None, "").refused


def test_rows_add_up() -> None:
    findings = [
        Finding("eq:C", "float64", "accuracy", 0.5, "a"),
        Finding("eq:C", "float64", "accuracy", 1.5, "b", "off"),
        Finding("eq:C", "float64", "accuracy", None, "c"),
    ]
    found = Verification("quick", 1, 2, [Done(Task("accuracy", ("table", "a")), findings, 0.1)])
    (row,) = rows(found)
    assert (row.cases, row.passed, row.refused, row.failed) == (3, 1, 1, 1)
    assert (row.worst, row.where) == (1.5, "b")
    assert json.loads(json.dumps(record(found)))["failures"][0]["where"] == "b"
    assert "FAILED" in table(found)


def test_full_level_holds_more() -> None:
    assert len(tasks("full", 1)) > 3 * len(tasks("quick", 1)) > 0


PROGRAM = """import sys
from symasym.commands.main import main
if __name__ == "__main__":
    sys.exit(main())
"""


def start(folder: Path, *arguments: str) -> AbstractContextManager[subprocess.Popen[str]]:
    script = folder / "program.py"
    script.write_text(PROGRAM)
    command = [sys.executable, str(script), "verify", *arguments]
    return started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.skipif(os.name == "nt", reason="no signals there")
def test_an_interrupt_keeps_what_was_done(tmp_path: Path) -> None:
    out = tmp_path / "record.json"
    with start(tmp_path, "--workers", "1", "--out", str(out)) as process:
        # Until it runs, however busy the machine is.
        assert process.stderr is not None
        assert any("verify quick: " in line for line in process.stderr)
        time.sleep(1)
        process.send_signal(signal.SIGTERM)
        printed, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "tasks interrupted after" in printed
    found = json.loads(out.read_text())
    assert found["interrupted"]
    assert not found["passed"]
    assert found["tasks"]["done"] < found["tasks"]["all"]


@pytest.mark.slow
def test_quick_level_over_processes(tmp_path: Path) -> None:
    out = tmp_path / "record.json"
    with start(tmp_path, "--out", str(out)) as process:
        printed, errors = process.communicate(timeout=600)
    assert process.returncode == 0, printed + errors
    assert json.loads(out.read_text())["passed"]
