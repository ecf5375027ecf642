"""How long a call may take: one limit for all methods, tested between the steps of every long loop.

A verb runs under `limited`, whose seconds are the caller's ``patience=``, and loops say `step()` at
each turn. Time is that of the processor in this thread, so that a busy machine refuses nothing, and
a verb inside a verb has what is left of the outer one's.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar

from numpy.linalg import LinAlgError

from symasym.base.errors import AccuracyError, InputError, SymasymError, TimeLimitError
from symasym.base.inputs import shown

__all__ = ["PATIENCE", "expect", "left", "limited", "patient", "step"]

#: Seconds that a call may take where nothing is said.
PATIENCE = 10.0

_P = ParamSpec("_P")
_R = TypeVar("_R")


@dataclass
class _Limit:
    """The seconds allowed, and the time of this thread at which they are over.

    Asking for a thread's time is a call of the system's, which a loop can't afford at each turn.
    It goes no faster than the clock on the wall, so that before `soonest` nobody needs to ask.
    """

    seconds: float
    end: float
    soonest: float = -math.inf


_limit: ContextVar[_Limit | None] = ContextVar("limit", default=None)


@contextmanager
def limited(patience: float | None = None) -> Iterator[None]:
    """Allow what runs inside so many seconds.

    Parameters
    ----------
    patience : float, optional
        Seconds, `math.inf` for no limit. None: those of the call around, else `PATIENCE`.

    Raises
    ------
    TimeLimitError
        By `step` and `expect` inside.

    Examples
    --------
    >>> from symasym.base.errors import TimeLimitError
    >>> try:
    ...     with limited(0.01):
    ...         while True:
    ...             step()
    ... except TimeLimitError as error:
    ...     print(str(error).partition(";")[0])
    this takes longer than the 0.01 seconds of processor time that it may
    """
    outer = _limit.get()
    seconds = PATIENCE if patience is None else _seconds(patience)
    limit = _Limit(seconds, time.thread_time() + seconds)
    if outer is not None and (patience is None or outer.end < limit.end):
        limit = outer
    token = _limit.set(limit)
    try:
        yield
    finally:
        _limit.reset(token)


def patient(verb: Callable[_P, _R]) -> Callable[_P, _R]:
    """`verb`, run under its ``patience``; numbers that defeat it are told in a sentence."""

    @functools.wraps(verb)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        seconds: Any = kwargs.get("patience")
        try:
            with limited(seconds):
                return verb(*args, **kwargs)
        except SymasymError:
            raise
        except (ArithmeticError, MemoryError, RecursionError, LinAlgError) as error:
            raise AccuracyError(
                f"the numbers are too extreme for this method, or cancel ({type(error).__name__}); "
                "rescale the problem, or use another method."
            ) from error

    return run


def step() -> None:
    """Raise TimeLimitError where the time of this call is over."""
    limit = _limit.get()
    if limit is None or (now := time.monotonic()) < limit.soonest:
        return
    remaining = limit.end - time.thread_time()
    if remaining < 0:
        raise TimeLimitError(
            f"this takes longer than the {limit.seconds:g} seconds of processor time that it may; "
            f"{_WAY_OUT}."
        )
    limit.soonest = now + remaining


def expect(seconds: float, work: str) -> None:
    """Raise TimeLimitError, before it is begun, where `work` takes longer than is left.

    Examples
    --------
    >>> from symasym.base.errors import TimeLimitError
    >>> try:
    ...     with limited(1):
    ...         expect(60, "the sum of all terms")
    ... except TimeLimitError as error:
    ...     print(str(error).partition(";")[0])
    the sum of all terms would take 60 seconds or more
    """
    if seconds > left():
        raise TimeLimitError(f"{work} would take {seconds:.2g} seconds or more; {_WAY_OUT}.")


def left() -> float:
    """Seconds that this call has left."""
    limit = _limit.get()
    return math.inf if limit is None else max(limit.end - time.thread_time(), 1e-3)


_WAY_OUT = "pass patience=… (seconds, or inf), or ask for fewer digits, more noise or a lower order"


def _seconds(patience: object) -> float:
    """The seconds that a caller allows."""
    number = isinstance(patience, (int, float)) and not isinstance(patience, bool)
    if not number or not patience > 0:  # type: ignore[operator]
        raise InputError(
            f"patience is {shown(patience)}; give seconds, a number greater than 0 or inf."
        )
    try:
        return float(patience)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf
