"""Processes that run tasks for this program, with a time limit for each task, and that end with this program.

Each process has a pipe of its own: one that is killed, or ended while it starts, disturbs no other.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from signal import SIGKILL, Signals
from threading import Lock, Thread
from typing import Any, TypeVar
from weakref import finalize

from compare.processes import ONE_THREAD
from scenes.errors import NumericsError, SceneError

T = TypeVar("T")
Task = TypeVar("Task", bound=tuple[Any, ...])

DIED = "a process was ended while it worked, as the system does where the memory is used up"

_CODE = """import sys, traceback, multiprocessing.connection, concurrent.futures
sys.path[:] = {!r}
from compare.worker import _serve
_serve(int(sys.argv[1]), int(sys.argv[2]))"""
"""The program of a process. Modules of Python's are imported before the path has other folders."""


class EndedError(Exception):
    """A process ended before its task, with an exit status."""


class Worker:
    """A process that runs tasks one by one; it starts with the first one, and again after it ended.

    ``name`` begins the sentences about it. A ``quiet`` process prints nothing, others to standard error.
    """

    def __init__(self, name: str = "", quiet: bool = True) -> None:
        self._name, self._quiet, self._one = name, quiet, Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self.until = math.inf

    def run(self, seconds: float, function: Callable[..., T], *arguments: object) -> T:
        """Return ``function(*arguments)``, computed in the process, or raise the function's exception.

        Raises SceneError after so many seconds, and where the process ends.
        """
        with self._one:
            ((_, outcome),) = share([self], function, [arguments], seconds)
        try:
            value: T = outcome.result()
        except TimeoutError:
            raise SceneError(f"{self._name} has not answered in {seconds / 60:.2g} minutes, and was ended") from None
        except EndedError as error:
            status = error.args[0] or 0
            how = f", with the signal {Signals(-status).name}" if status < 0 else ""
            raise SceneError(f"{self._name} failed: it ended its process{how}") from None
        return value

    def begin(self, function: Callable[..., object], arguments: tuple[object, ...], seconds: float) -> None:
        """Give the process a task, which may take so many seconds from when the process has it."""
        if self._process is not None and self._process.poll() is not None:
            self.stop()
        if self._process is None:
            self._start()
        self.until, self._seconds = math.inf, seconds
        with suppress(BrokenPipeError):  # of a process that has ended meanwhile: the outcome will be that
            self.pipe.send((function, arguments))

    def outcome(self) -> Future[Any] | None:
        """Return the outcome of the task: its value or exception, TimeoutError, or EndedError; None for none yet."""
        assert self._process is not None
        value, error = None, None
        try:
            if self.pipe.poll():
                if (answer := self.pipe.recv()) is None:  # the task has arrived
                    self.until = time.monotonic() + self._seconds
                    return None
                value, error = answer
            elif time.monotonic() > self.until:
                self.stop()
                error = TimeoutError()
            elif self._process.poll() is None:
                return None
            else:  # its children may still have its end of the pipe
                error = EndedError(self.stop())
        except (EOFError, ConnectionError):
            error = EndedError(self.stop())
        future: Future[Any] = Future()
        if error is None:
            future.set_result(value)
        else:
            future.set_exception(error)
        return future

    def stop(self) -> int | None:
        """End the process at once, and return its exit status."""
        process, self._process = self._process, None
        if process is None:
            return None
        self._end()
        return process.returncode

    def _start(self) -> None:
        """Start the process with one thread, in a group of its own: an interrupt from the keyboard is left to this
        one."""
        self.pipe, theirs = Pipe()
        code = _CODE.format([*map(str, sys.path)])
        command = [sys.executable, "-P", "-c", code, str(theirs.fileno()), str(os.getpid())]
        streams = subprocess.DEVNULL if self._quiet else 2
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=streams, stderr=streams, pass_fds=[theirs.fileno()],
            env=os.environ | ONE_THREAD, process_group=0,
        )  # fmt: skip
        theirs.close()
        self._end = finalize(self, _end, self._process, self.pipe)


def _end(process: subprocess.Popen[bytes], pipe: Connection) -> None:
    """End a process and the programs that it started, which are in its group."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, SIGKILL)
    process.wait()
    pipe.close()


@contextmanager
def pool(count: int) -> Iterator[list[Worker]]:
    """Provide quiet processes; they end at once at the end of the context."""
    workers = [Worker() for _ in range(count)]
    try:
        yield workers
    finally:
        for worker in workers:
            worker.stop()


def share(
    workers: Sequence[Worker], function: Callable[..., object], tasks: Iterable[Task], seconds: float | None = None,
    attempts: int = 1,
) -> Iterator[tuple[Task, Future[Any]]]:  # fmt: skip
    """Yield the arguments of each task with the outcome, as `Worker.outcome` has it, as they come.

    Each task may take some seconds. A task whose process dies is tried again, up to some attempts.
    """
    waiting, idle, busy = iter(tasks), list(workers), dict[Worker, tuple[Task, int]]()
    most = math.inf if seconds is None else seconds
    try:
        while True:
            while idle and (task := next(waiting, None)) is not None:
                busy[idle[-1]] = task, 1
                idle.pop().begin(function, task, most)
            if not busy:
                return
            left = min(worker.until for worker in busy) - time.monotonic()
            wait([worker.pipe for worker in busy], min(max(left, 0.0), 1.0))
            for worker in list(busy):
                if (outcome := worker.outcome()) is None:
                    continue
                task, attempt = busy.pop(worker)
                if attempt < attempts and isinstance(outcome.exception(), EndedError):
                    busy[worker] = task, attempt + 1
                    worker.begin(function, task, most)
                else:
                    idle.append(worker)
                    yield task, outcome
    finally:
        for worker in busy:
            worker.stop()


def map_tasks(
    function: Callable[[int], T], numbers: Sequence[int], jobs: int, died: Callable[[int], T] | None = None
) -> Iterator[tuple[int, T]]:
    """Yield each number with ``function(number)`` as they come, computed by ``jobs`` processes, or by this one for 1.

    A number whose process dies has the value ``died(number)``. Raises NumericsError without that.
    """
    if jobs == 1:
        yield from ((number, function(number)) for number in numbers)
        return
    with pool(jobs) as workers:
        for (number,), outcome in share(workers, function, ((number,) for number in numbers)):
            try:
                value = outcome.result()
            except EndedError:
                if died is None:
                    raise NumericsError(f"{DIED} (number {number})") from None
                value = died(number)
            yield number, value


def _serve(descriptor: int, parent: int) -> None:
    """Run the tasks that come through a pipe, until its other end is closed."""
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    pipe = Connection(descriptor)
    with suppress(EOFError, OSError):
        while True:
            outcome = _perform(pipe)
            try:
                pipe.send(outcome)
            except Exception as error:  # of a value that cannot be pickled
                pipe.send((None, RuntimeError(f"{type(error).__name__}: {error}")))


def _perform(pipe: Connection) -> tuple[object, BaseException | None]:
    """Return the value of the next task, or its exception."""
    try:
        function, arguments = pipe.recv()
    except EOFError:
        raise
    except Exception as error:  # of a module that is missing here
        return None, error
    pipe.send(None)
    try:
        return function(*arguments), None
    except BaseException as error:
        error.add_note(traceback.format_exc())
        return None, error


def _end_with(parent: int) -> None:
    """End this process, also while it computes, when its parent has ended."""
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
