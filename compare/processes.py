"""The processors that there are, the threads of the processes that are started on them, and limits of their time."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock, Timer, get_ident

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NGS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
"""Environment of a process with one thread: the dense parts of sparse factors are small. With two, a run of the sink
takes 5 to 38 % longer at 1e-3 to 1e-6, and twice the processor time."""


def one_thread() -> None:
    """This process and those that it starts use one thread for linear algebra, unless the environment says how many;
    to be called before numpy is loaded."""
    if not _said():
        os.environ.update(ONE_THREAD)


def _said() -> bool:
    """Whether the environment says how many threads linear algebra is to use."""
    return any(name in os.environ for name in ONE_THREAD)


def processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def with_parent() -> None:
    """On Linux: a signal when the process that waits for this one is gone, however it ended."""
    with suppress(OSError, AttributeError):
        set_death_signal, kill = 1, 9
        ctypes.CDLL(None).prctl(set_death_signal, kill)


class TimeIsUpError(BaseException):
    """The time limit; no handler of ordinary errors catches it."""


@contextmanager
def limited(seconds: float, by_the_clock: int = 0) -> Iterator[None]:
    """Raises TimeIsUpError in what computes longer than so many seconds, whatever else the machine does, or, where that
    is given, waits longer ``by_the_clock``."""

    def up(*_: object) -> None:
        raise TimeIsUpError

    before = {number: signal.signal(number, up) for number in (signal.SIGVTALRM, signal.SIGALRM)}
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    signal.alarm(by_the_clock)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.alarm(0)
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Uses one thread for linear algebra inside, and so do processes that are started there, unless the environment
    says how many; for whoever has loaded numpy already."""
    if _said():
        yield
        return
    import scipy.linalg  # noqa: F401 - whose library of its own is limited too
    from threadpoolctl import threadpool_limits

    os.environ.update(ONE_THREAD)
    try:
        with threadpool_limits(1):
            yield
    finally:
        for name in ONE_THREAD:
            os.environ.pop(name, None)  # of two runs in threads, one is the first to end


@contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """Raises TimeIsUpError in what takes longer than so many seconds by the clock, in whatever thread: at its next step
    in Python, so that a long call of a library ends first. No limit for ``None``."""
    if seconds is None:
        yield
        return
    thread, raise_in = ctypes.c_ulong(get_ident()), ctypes.pythonapi.PyThreadState_SetAsyncExc
    lock, over = Lock(), False

    def up() -> None:
        with lock:
            if not over:
                raise_in(thread, ctypes.py_object(TimeIsUpError))

    timer = Timer(seconds, up)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        with lock:
            over = True
