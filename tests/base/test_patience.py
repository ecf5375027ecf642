"""The time a call may take: told before it is over, in every verb, and Ctrl-C at any moment."""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

import symasym as sa
from symasym.base import call_context
from symasym.base.call_context import limited, step, watched
from tests.processes import started


def spend(seconds: float) -> None:
    """Use the processor for so long."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def test_a_step_beyond_the_limit_is_refused() -> None:
    with limited(0.05):
        step()
        spend(0.06)
        with pytest.raises(sa.TimeLimitError, match=r"^this takes longer than the 0.05 seconds"):
            step()
    step()


def test_the_limit_around_holds_inside() -> None:
    for outer, inner in ((0.05, 100), (100, 0.05)):
        with limited(outer), limited(inner):
            spend(0.06)
            with pytest.raises(sa.TimeLimitError, match=r"0\.05"):
                step()
    with limited(math.inf), limited():
        spend(0.02)
        step()


def test_time_is_that_of_the_thread() -> None:
    with limited(0.2):
        busy = threading.Thread(target=spend, args=(0.4,))
        busy.start()
        busy.join()
        step()


def _without_steps(seconds: float) -> None:
    """Work that takes no error for its own, as SymPy's may."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        with contextlib.suppress(Exception):
            spend(0.01)


@pytest.mark.parametrize("told", [True, False])
def test_work_without_steps_is_ended_when_it_is_watched(told: bool, monkeypatch: Any) -> None:
    if not told:  # as on Windows
        monkeypatch.delattr(time, "pthread_getcpuclockid", raising=False)
    for seconds in (0.1, 0.2):
        begun = time.thread_time()
        ended = pytest.raises(sa.TimeLimitError, match=f"{seconds} seconds")
        with ended, limited(seconds), watched():
            _without_steps(30)
        assert time.thread_time() - begun < 5
    # Nothing arrives where the work was done, or waits for others.
    for _ in range(20):
        with limited(0.01), watched():
            spend(0.005)
        with limited(0.01), watched():
            time.sleep(0.02)
    with limited(math.inf), watched():
        spend(0.05)
    spend(0.3)


class _SlowToEnd:
    """An object whose end takes a while, in which no error can be raised."""

    def __del__(self) -> None:
        spend(0.05)


def _with_slow_ends() -> None:
    for _ in range(10):
        _SlowToEnd()
    _without_steps(30)


def test_an_interrupt_that_is_lost_is_sent_again_without_a_word(capfd: Any) -> None:
    hook = sys.unraisablehook
    with pytest.raises(sa.TimeLimitError), limited(0.1), watched():
        _with_slow_ends()
    assert sys.unraisablehook is hook
    assert capfd.readouterr().err == ""


def test_the_watch_is_of_its_own_thread() -> None:
    ended: list[bool] = []

    def other() -> None:
        with contextlib.suppress(sa.TimeLimitError), limited(0.1), watched():
            _without_steps(30)
            ended.append(False)
        ended.append(True)

    thread = threading.Thread(target=other)
    thread.start()
    _without_steps(0.5)
    thread.join()
    assert ended == [True]


@pytest.mark.parametrize(
    "call",
    [
        lambda: sa.reduce((_FRACTIONS, "1"), ("-1", "1"), ("-s", "1"), ((1,), (0,)), ("y", "x")),
        lambda: sa.hill(a_minus=1, a_plus=[0.1, 0.5], K=0.05, n=3).potential(),
        lambda: sa.escape_time(sa.Drift("(u**2 + u + 1)**1000"), "0.5", 2),
    ],
)
def test_simplifying_ends_in_time(call: Callable[[], Any]) -> None:
    begun = time.thread_time()
    with limited(0.5), contextlib.suppress(sa.SymasymError):
        call()
    assert time.thread_time() - begun < 3


_FRACTIONS = "1/(x+" * 50 + "1" + ")" * 50
_WAVES = "*".join(f"sin({k}*x)" for k in range(1, 30))

#: Texts that took all of the time a call may take, or more.
HOSTILE: dict[str, Callable[[], Any]] = {
    "a wave of a huge number": lambda: sa.System("tan(exp(1e30/z))", "1/(1 + z**2)").frozen(z=0.1),
    "its sign": lambda: _reduced("tan(exp(1e30/(x + 2)))"),
    "a hyperbolic function of it": lambda: sa.Drift("tanh(exp(1e30*(u + 2)))"),
    "as many balls": lambda: sa.Drift("log(exp(1e30*u) + 2)"),
    "fractions in g": lambda: sa.uniform_integral(
        "-x**2", _FRACTIONS.replace("x", "x+2+sin(x)"), "x", -1, 1
    ),
    "a product in f": lambda: sa.uniform_integral(f"I*{_WAVES}", 1, "x", -1, 1),
    "fractions in h": lambda: _reduced("1", switch=_FRACTIONS),
    "functions in h": lambda: _reduced("1", switch="sin(2+sin(2+sin(2+x)))"),
    "roots in f-": lambda: _reduced("cbrt(2+" * 50 + "x" + ")" * 50),
    "a power of a logarithm": lambda: _reduced("log(3)*(7/3)**40 + erf(x)"),
}


def _reduced(f_minus: str, **options: Any) -> Any:
    fields = (f_minus, "1"), ("-1", "1"), (f"-(1 + s)/2 + (1 - s)/2*({f_minus})", "1")
    return sa.reduce(*fields, ((1,), (0,)), ("y", "x"), **options)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_expressions_end_soon(name: str) -> None:
    begun = time.thread_time()
    with limited(10), contextlib.suppress(sa.SymasymError):
        HOSTILE[name]()
    assert time.thread_time() - begun < 4


_JOINED = f"({_FRACTIONS})*(1 + s)/2 - (1 - s)/2"


@pytest.mark.parametrize("bad", [0, -1, math.nan, "5", True, [3], 1j])
def test_what_is_no_time_is_refused(bad: Any) -> None:
    with pytest.raises(sa.InputError, match=r"^patience is .*; give seconds"):
        sa.escape_time(sa.linear(1, 1), 1, 2, patience=bad)


_ALONE = sa.friction(mu="31/7")


@pytest.mark.parametrize(
    ("asked", "way_out"),
    [
        (lambda: sa.Drift("1 - u + exp(sin(3*u))*u^7*cos(u)").potential(), "give a simpler"),
        # No other test asks this drift for its expression, which is kept.
        (lambda: sa.expand(_ALONE, "T", order=8).expression, "use formula"),
    ],
)
def test_what_takes_no_patience_does_not_advise_it(
    asked: Callable[[], Any], way_out: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sa.expand(_ALONE, "T", order=8)  # kept
    monkeypatch.setattr(call_context, "PATIENCE", 0.01)
    told: list[BaseException] = []

    def asking() -> None:
        try:
            asked()
        except sa.TimeLimitError as error:
            told.append(error)

    thread = threading.Thread(target=asking)
    thread.start()
    thread.join()
    assert f"may; {way_out}" in str(told)


def test_a_watched_call_leaves_nothing_behind() -> None:
    # A profiler never ended where an interrupt was taken back that had not been sent.
    script = (
        "import sys, symasym as sa\n"
        "from symasym.base.call_context import limited, watched\n"
        "with limited(5), watched():\n    pass\n"
        "sys.setprofile(lambda *_: None)\n"
        "sa.escape_time(sa.linear(1, -1), 0.5, 2)\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_an_interrupt_ends_a_long_call() -> None:
    script = (
        "import symasym as sa; print('begun', flush=True); "
        "sa.occupation(sa.tanh(1, -1, '1.4'), '1e-60', dps=3000, log=True, patience=1e9)"
    )
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with started([sys.executable, "-c", script], **pipes) as process:
        assert process.stdout.readline() == b"begun\n"
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        told = process.communicate(timeout=60)[1]
    assert told.rstrip().endswith(b"KeyboardInterrupt")
