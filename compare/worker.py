"""Processes that run tasks for this program, with a time limit for each task, and that end with this program."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.resource_tracker import ensure_running
from threading import Lock, Thread
from types import ModuleType
from typing import TypeVar
from weakref import finalize

from pebble import ProcessExpired, ProcessPool

from compare.processes import ONE_THREAD
from scenes.errors import NumericsError, SceneError

T = TypeVar("T")

DIED = "a process was ended while it worked, as the system does where the memory is used up"

_SAFE_PATH = "PYTHONSAFEPATH"
_starting = Lock()


class Worker:
    """A process that runs the tasks of a model one by one; it starts with the first one, and again after it ended.

    ``name`` begins the sentences about it. A ``quiet`` process prints nothing, others to standard error.
    """

    def __init__(self, name: str, quiet: bool) -> None:
        self._name, self._quiet = name, quiet
        self._pool: ProcessPool | None = None

    def run(self, seconds: float, function: Callable[..., T], *arguments: object) -> T:
        """Return ``function(*arguments)``, computed in the process, or raise the function's exception.

        Raises SceneError after so many seconds, and where the process ends.
        """
        if self._pool is None or not self._pool.active:
            self._pool = start_pool(1, self._quiet)
            finalize(self, _stop, self._pool)
        task = self._pool.schedule(function, arguments, timeout=seconds)
        try:
            return task.result()
        except TimeoutError:
            raise SceneError(f"{self._name} has not answered in {seconds / 60:.2g} minutes, and was ended") from None
        except (ProcessExpired, BrokenProcessPool) as error:
            status = getattr(error, "exitcode", None) or 0
            how = f", with the signal {signal.Signals(-status).name}" if status < 0 else ""
            raise SceneError(f"{self._name} failed: it ended its process{how}") from None
        finally:
            task.cancel()  # ends the process where this one is interrupted


class _Process(SpawnProcess):
    """A process that neither runs the program's main file again nor imports from the current folder as it starts."""

    def start(self) -> None:
        with _starting:
            main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
            os.environ[_SAFE_PATH] = "1"
            try:
                super().start()
            finally:
                sys.modules["__main__"] = main
                del os.environ[_SAFE_PATH]


class _Context(SpawnContext):
    Process = _Process


def start_pool(count: int, quiet: bool) -> ProcessPool:
    """Start ``count`` processes with one thread each.

    Raises BrokenProcessPool where no process can be started.
    """
    # Processes inherit that an interrupt is blocked in the thread that starts them: this process decides about it.
    # Python's resource tracker is started first, because its start unblocks the interrupt.
    ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        processes = ProcessPool(count, initializer=_begin, initargs=(quiet,), context=_Context())
        if not processes.active:  # reading this property starts the pool
            raise BrokenProcessPool("no processes can be started")
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return processes


@contextmanager
def pool(count: int) -> Iterator[ProcessPool]:
    """Provide quiet processes as `start_pool` starts them; they end at once at the end of the context."""
    processes = start_pool(count, quiet=True)
    try:
        yield processes
    finally:
        _stop(processes)


def map_tasks(
    function: Callable[[int], T], numbers: Sequence[int], jobs: int, died: Callable[[int], T] | None = None
) -> Iterator[tuple[int, T]]:
    """Yield each number with ``function(number)`` as they come, computed by ``jobs`` processes, or by this one for 1.

    A number whose process dies has the value ``died(number)``. Raises NumericsError without that.
    """
    if jobs == 1:
        yield from ((number, function(number)) for number in numbers)
        return
    with pool(jobs) as processes:
        tasks: dict[Future[T], int] = {processes.schedule(function, (number,)): number for number in numbers}
        for task in as_completed(tasks):
            number = tasks[task]
            try:
                value = task.result()
            except ProcessExpired:
                if died is None:
                    raise NumericsError(f"{DIED} (number {number})") from None
                value = died(number)
            yield number, value


def _stop(processes: ProcessPool) -> None:
    processes.stop()
    processes.join()


def _begin(quiet: bool) -> None:
    """Prepare a process of a pool."""
    Thread(target=_end_with_parent, daemon=True).start()
    leave = os._exit  # pebble waits for ever for a task that ends its process with the status 0
    os._exit = lambda status: leave(status or 1)  # type: ignore[assignment]
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # ends the process during a long call of a library too
    if quiet:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 2)
    os.dup2(2, 1)
    os.environ.pop(_SAFE_PATH, None)
    os.environ.update(ONE_THREAD)


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
