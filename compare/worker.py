"""Processes that run tasks for this program, with a time limit for each task, and that end with this program.

Each process has a pipe of its own: one that is killed, or ended while it starts, disturbs no other.
"""

import math
import os
import pickle
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from queue import SimpleQueue
from signal import SIGKILL, Signals
from threading import Lock, Thread
from typing import Any, TypeVar
from weakref import finalize

from compare.processes import ONE_THREAD
from scenes.errors import SceneError

T = TypeVar("T")
Task = TypeVar("Task", bound=tuple[Any, ...])

DIED = "a process was ended while it worked, as the system does where the memory is used up"

_CODE = """import sys, traceback, multiprocessing.connection, concurrent.futures
sys.path[:] = {!r}
from compare.worker import _serve
_serve(int(sys.argv[1]), int(sys.argv[2]))"""
"""The program of a process. Modules of Python's are imported before the path has other folders."""


class EndedError(SceneError):
    """A process ended before its task."""


class OverdueError(SceneError):
    """A task took longer than its limit, and its process was ended."""


class Worker:
    """A process that runs tasks one by one; it starts with the first one, and again after it ended.

    ``name`` begins the sentences about it. A ``quiet`` process prints nothing, others to standard error.
    """

    def __init__(self, name: str = "its process", quiet: bool = True) -> None:
        self._name, self._quiet, self._one = name, quiet, Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, seconds: float, function: Callable[..., T], *arguments: object) -> T:
        """Return ``function(*arguments)``, computed in the process, or raise the function's exception.

        Raises OverdueError so many seconds after the process has the task, and EndedError where the process ends.
        """
        with self._one:
            if self._process is None or self._process.poll() is not None:
                self._start()
            try:
                self._pipe.send((function, arguments))
                # The first message, None, says that the task has arrived: a process takes a second to start.
                outcome: tuple[T, BaseException | None] = self._receive(math.inf) or self._receive(seconds)
            except (EOFError, OSError):
                status = self.stop() or 0
                how = f", with the signal {Signals(-status).name}" if status < 0 else ""
                raise EndedError(f"{self._name} failed: it ended its process{how}") from None
            except BaseException:
                self.stop()
                raise
        value, error = outcome
        if error is not None:
            raise error
        return value

    def _receive(self, seconds: float) -> Any:
        """Return the next message. Raises EOFError where the process ends, and OverdueError."""
        process, until = self._process, time.monotonic() + seconds
        while not self._pipe.poll(min(max(until - time.monotonic(), 0.0), 1.0)):
            if process is None or process.poll() is not None:  # its children may still have its end of the pipe
                raise EOFError
            if time.monotonic() >= until:
                raise OverdueError(f"{self._name} has not answered in {seconds / 60:.2g} minutes, and was ended")
        return self._pipe.recv()

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
        self._pipe, theirs = Pipe()
        code = _CODE.format([*map(str, sys.path)])
        command = [sys.executable, "-P", "-c", code, str(theirs.fileno()), str(os.getpid())]
        streams = subprocess.DEVNULL if self._quiet else 2
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=streams, stderr=streams, pass_fds=[theirs.fileno()],
            env=os.environ | ONE_THREAD, process_group=0,
        )  # fmt: skip
        theirs.close()
        self._end = finalize(self, _end, self._process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and the programs that it started, which are in its group."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, SIGKILL)
    process.wait()


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
    workers: Sequence[Worker], function: Callable[..., object], tasks: Iterable[Task], seconds: float = math.inf,
    attempts: int = 1,
) -> Iterator[tuple[Task, Future[Any]]]:  # fmt: skip
    """Yield the arguments of each task with its value, or its exception as `Worker.run` has it, as they come.

    Each task may take some seconds. A task whose process dies is tried again, up to some attempts.
    """
    idle = SimpleQueue[Worker]()
    for worker in workers:
        idle.put(worker)

    def perform(task: Task) -> object:
        worker, attempt = idle.get(), 1
        try:
            while True:
                try:
                    return worker.run(seconds, function, *task)
                except EndedError:
                    if attempt >= attempts:
                        raise
                    attempt += 1
        finally:
            idle.put(worker)

    with ThreadPoolExecutor(len(workers)) as threads:
        running = {threads.submit(perform, task): task for task in tasks}
        try:
            for future in as_completed(list(running)):
                yield running.pop(future), future
        finally:
            attempts = 0
            for future in running:
                future.cancel()
            for worker in workers if running else ():
                worker.stop()


def map_tasks(
    function: Callable[[int], T], numbers: Sequence[int], jobs: int, died: Callable[[int], T]
) -> Iterator[tuple[int, T]]:
    """Yield each number with ``function(number)`` as they come, computed by ``jobs`` processes, or by this one for 1.

    A number whose process dies has the value ``died(number)``.
    """
    if jobs == 1:
        yield from ((number, function(number)) for number in numbers)
        return
    with pool(jobs) as workers:
        for (number,), outcome in share(workers, function, ((number,) for number in numbers)):
            try:
                yield number, outcome.result()
            except EndedError:
                yield number, died(number)


def _serve(descriptor: int, parent: int) -> None:
    """Run the tasks that come through a pipe, until its other end is closed."""
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    pipe = Connection(descriptor)
    with suppress(EOFError, OSError):
        while True:
            task = pipe.recv_bytes()
            try:
                function, arguments = pickle.loads(task)
                pipe.send(None)
                outcome: tuple[object, BaseException | None] = function(*arguments), None
            except BaseException as error:
                error.add_note(traceback.format_exc())
                outcome = None, error
            try:
                pickle.loads(pickle.dumps(outcome[1]))
                pipe.send(outcome)
            except Exception as error:  # of a value or an exception that cannot be pickled
                pipe.send((None, RuntimeError(f"{type(outcome[1] or error).__name__}: {outcome[1] or error}")))


def _end_with(parent: int) -> None:
    """End this process, also while it computes, when its parent has ended."""
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
