"""Processors, threads of linear algebra, and time limits."""

import os
import signal
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
"""Environment of a process with one thread: the dense parts of sparse factors are small. With two, a run of the sink
takes 5 to 38 % longer at 1e-3 to 1e-6, and twice the processor time."""


def one_thread() -> None:
    """Let this process and its children use one thread for linear algebra; call this before numpy is loaded.

    A number of threads that the environment sets stays.
    """
    if not ONE_THREAD.keys() & os.environ.keys():
        os.environ.update(ONE_THREAD)


def processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class TimeIsUpError(BaseException):
    """The time limit is reached; handlers of ordinary errors do not catch it."""


@contextmanager
def limited(seconds: float, by_the_clock: int = 0) -> Iterator[None]:
    """Raise TimeIsUpError after so many seconds of processor time, or ``by_the_clock`` seconds if given."""

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


def single_threaded() -> AbstractContextManager[object]:
    """Return a context with one thread for linear algebra, after numpy has been loaded.

    A number of threads that the environment sets stays.
    """
    if ONE_THREAD.keys() & os.environ.keys():
        return nullcontext()
    import scipy.linalg  # noqa: F401 - whose library of its own is limited too
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(1)
    return limits
