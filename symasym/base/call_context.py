"""What a call runs in: its digits, and the time that it may take.

Digits are those of mpmath contexts of our own (`own_context`, `kept`): the caller's precision is
never read or changed.

Time is one limit for all methods, tested between the steps of every long loop. A verb runs under
`limited`, whose seconds are the caller's ``patience=``, and loops say `step()` at each turn; what
SymPy does is `watched`. It is that of the processor in this thread, so that a busy machine refuses
nothing, and a verb inside a verb has what is left of the outer one's.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
import math
import sys
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from numbers import Rational
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from numpy.linalg import LinAlgError

from symasym.base.errors import AccuracyError, InputError, SymasymError, TimeLimitError
from symasym.base.inputs import shown

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = [
    "PATIENCE", "SIMPLER", "expect", "float_with_error", "kept", "left", "limited", "mpf_of",
    "own_context", "patient", "step", "symbolic", "to_mpf", "watched",
]  # fmt: skip

#: Seconds that a call may take where nothing is said.
PATIENCE = 10.0
# Seconds after its end at which a call that says no `step()` is interrupted.
_GRACE = 0.1
_WAY_OUT = "pass patience=… (seconds, or inf), or ask for fewer digits, more noise or a lower order"
#: What to do where a call has no ``patience``.
SIMPLER = "give a simpler expression"

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
    way_out: str
    soonest: float = -math.inf
    watched: bool = False


_limit: ContextVar[_Limit | None] = ContextVar("limit", default=None)


@contextmanager
def limited(patience: float | None = None, way_out: str = _WAY_OUT) -> Iterator[None]:
    """Allow what runs inside so many seconds.

    Parameters
    ----------
    patience : float, optional
        Seconds, `math.inf` for no limit. None: those of the call around, else `PATIENCE`.
    way_out : str
        What the error tells the caller to do.

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
    limit = _Limit(seconds, time.thread_time() + seconds, way_out)
    if outer is not None and (patience is None or outer.end < limit.end):
        limit = outer
    token = _limit.set(limit)
    try:
        yield
    finally:
        _limit.reset(token)


class _Over(BaseException):
    """Raised from outside in a thread whose time is over; no library takes it for its own."""


@contextmanager
def watched() -> Iterator[None]:
    """End what runs inside when the time of this call is over, also where nothing says `step()`.

    For SymPy's work, which takes milliseconds or for ever. Another thread looks at the clock.
    """
    limit = _limit.get()
    if limit is None or limit.watched or limit.end == math.inf:
        yield
        return
    end, thread = limit.end + _GRACE, ctypes.c_ulong(threading.get_ident())
    now = _clock()
    done, lock = threading.Event(), threading.Lock()
    interrupt = ctypes.pythonapi.PyThreadState_SetAsyncExc
    report = sys.unraisablehook

    def quiet(lost: Any) -> None:
        """Nothing of an interrupt that came where no error can be raised: another one follows."""
        if lost.exc_type is not _Over:
            report(lost)

    def watch() -> None:
        """Interrupt, again where that was swallowed, until the block is left."""
        while not done.wait(max(_GRACE, end - now())):
            with lock:
                if not done.is_set() and now() > end:
                    sys.unraisablehook = quiet
                    interrupt(thread, ctypes.py_object(_Over))

    limit.watched = True
    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    except _Over:
        raise _over(limit) from None
    finally:
        limit.watched = False
        try:
            with lock:
                done.set()
            for _ in range(9):
                pass  # what was sent arrives here at the latest
        except _Over:
            done.set()
        if sys.unraisablehook is quiet:
            sys.unraisablehook = report


def _clock() -> Callable[[], float]:
    """The time of this thread, for another to ask; that of the process where no system tells it."""
    if hasattr(time, "pthread_getcpuclockid"):
        return functools.partial(
            time.clock_gettime, time.pthread_getcpuclockid(threading.get_ident())
        )
    before = time.thread_time() - time.process_time()
    return lambda: before + time.process_time()


def patient(verb: Callable[_P, _R]) -> Callable[_P, _R]:
    """`verb`, run under its ``patience``; numbers that defeat it are told in a sentence."""
    way_out = _WAY_OUT if "patience" in inspect.signature(verb).parameters else SIMPLER

    @functools.wraps(verb)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        seconds: Any = kwargs.get("patience")
        try:
            with limited(seconds, way_out):
                return verb(*args, **kwargs)
        except SymasymError:
            raise
        except (ArithmeticError, MemoryError, RecursionError, LinAlgError) as error:
            raise AccuracyError(
                f"the numbers are too extreme for this method, or cancel ({type(error).__name__}); "
                "rescale the problem, or use another method."
            ) from error

    return run


def symbolic(verb: Callable[_P, _R]) -> Callable[_P, _R]:
    """`patient`, of a verb whose work is mostly SymPy's (see `watched`)."""

    @functools.wraps(verb)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        from mpmath.libmp.libhyper import NoConvergence

        try:
            with watched():
                return verb(*args, **kwargs)
        except NoConvergence as error:
            raise ArithmeticError from error

    return patient(run)


def step() -> None:
    """Raise TimeLimitError where the time of this call is over."""
    limit = _limit.get()
    if limit is None or (now := time.monotonic()) < limit.soonest:
        return
    remaining = limit.end - time.thread_time()
    if remaining < 0:
        raise _over(limit)
    limit.soonest = now + remaining


def _over(limit: _Limit) -> TimeLimitError:
    """The error of a call whose time is over."""
    return TimeLimitError(
        f"this takes longer than the {limit.seconds:g} seconds of processor time that it may; "
        f"{limit.way_out}."
    )


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
    limit = _limit.get()
    if limit is not None and seconds > left():
        raise TimeLimitError(f"{work} would take {seconds:.2g} seconds or more; {limit.way_out}.")


def left() -> float:
    """Seconds that this call has left."""
    limit = _limit.get()
    return math.inf if limit is None else max(limit.end - time.thread_time(), 1e-3)


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


# -- digits ----------------------------------------------------------------------------------------


_local = threading.local()

_KEPT = 32


@contextmanager
def own_context(dps: int) -> Iterator[MPContext]:
    """An mpmath context private to this thread, at `dps` digits while the block runs."""
    step()
    stack = getattr(_local, "stack", None)
    if stack is None:
        stack = _local.stack = []
    # Making a context takes a millisecond, so finished ones are kept for the next caller.
    if stack:
        context = stack.pop()
    else:
        from mpmath.ctx_mp import MPContext

        context = MPContext()
    context.dps = dps
    try:
        yield context
    finally:
        stack.append(context)


def kept(analysis: Callable[..., _R]) -> Callable[..., tuple[MPContext, _R]]:
    """`analysis` of hashable arguments, worked out once for equal ones; its context comes with it.

    Numbers carry their context, so that each of the last `_KEPT` analyses has one of its own, whose
    digits the analysis sets and which stay, in each thread.
    """

    @functools.lru_cache(maxsize=_KEPT)
    def known(thread: int, *args: Hashable) -> tuple[MPContext, _R]:
        from mpmath.ctx_mp import MPContext

        context = MPContext()
        return context, analysis(context, *args)

    def of(*args: Hashable) -> tuple[MPContext, _R]:
        step()
        return known(threading.get_ident(), *args)

    of.cache_clear = known.cache_clear  # type: ignore[attr-defined]
    return of


def float_with_error(value: mpf, error: mpf) -> tuple[float, float]:
    """`value`, an mpf, as a float; `error` with what that rounds off, rounded up."""
    from mpmath import libmp

    rounded = float(value)
    # Differences without a precision are exact in libmp; only the sum rounds.
    shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, libmp.from_float(rounded)))
    total = libmp.to_float(libmp.mpf_add(error._mpf_, shift, 53, "u"))
    # to_float rounds to nearest, and flushes what is below the range to 0.
    return rounded, math.nextafter(total, math.inf)


def mpf_of(x: Rational | int, context: MPContext) -> mpf:
    """The rational `x` in mpmath's `context`, rounded as it rounds."""
    # Not by libmp, which would give an interval context one end, and no enclosure.
    return context.mpf(x.numerator) / x.denominator


def to_mpf(value: mpf, dps: int) -> mpf:
    """`value`, of any mpmath context, as the caller's kind of mpf, rounded to `dps` digits."""
    import mpmath

    rounded = mpmath.libmp.mpf_pos(value._mpf_, mpmath.libmp.dps_to_prec(dps), "n")
    return mpmath.mp.make_mpf(rounded)
