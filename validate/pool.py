"""Processes that take tasks: a pool of them, with a time limit for each task."""

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
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessPool

from scenes.errors import NumericsError
from validate.processes import ONE_THREAD

T = TypeVar("T")

ENDED = "a process was ended while it worked, as it is where the memory is used up"
"""The error of a task whose process was killed."""

_starting = Lock()


class _Process(SpawnProcess):
    """One that doesn't run the program's main file again, so that a script needs no guard around what starts it."""

    def start(self) -> None:
        with _starting:
            main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
            try:
                super().start()
            finally:
                sys.modules["__main__"] = main


class _Context(SpawnContext):
    Process = _Process


@contextmanager
def pool(count: int, first: Callable[[], None] | None = None) -> Iterator[ProcessPool]:
    """So many processes that take tasks, one thread each, in each of which ``first`` is called before there is one. All
    end at once when the context does, and when this process does, however that ends."""
    # What an interrupt means the parent decides: processes inherit that it is blocked in the thread that starts them.
    # Python's resource tracker is started first, since its start unblocks it.
    ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        made = ProcessPool(count, initializer=_begin, initargs=(first,), context=_Context())
        if not made.active:  # to ask starts it
            raise BrokenProcessPool("no processes can be started")
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        yield made
    finally:
        made.stop()
        made.join()


def _begin(first: Callable[[], None] | None) -> None:
    """What a process of a pool does first."""

    def end_with(parent: Any) -> None:
        parent.join()
        os._exit(1)

    Thread(target=end_with, args=(parent_process(),), daemon=True).start()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # without waiting for a long call of a library to return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what a library prints would stand between the parent's own lines
        os.dup2(nowhere, stream)
    os.environ.update(ONE_THREAD)
    if first is not None:
        first()


def side_by_side(
    work: Callable[[int], T], numbers: Sequence[int], jobs: int, of_ended: Callable[[int], T] | None = None
) -> Iterator[tuple[int, T]]:
    """Each number with what the work on it came to, as they come, by ``jobs`` processes (1: this one); or with what is
    said of one that is ``lost``, as its process was ended. Raises NumericsError of it where nothing is."""
    if jobs == 1:
        yield from ((number, work(number)) for number in numbers)
        return
    with pool(jobs) as processes:
        futures: dict[Future[T], int] = {processes.schedule(work, (number,)): number for number in numbers}
        for future in as_completed(futures):
            number = futures[future]
            try:
                outcome = future.result()
            except ProcessExpired:
                if of_ended is None:
                    raise NumericsError(f"{ENDED} (number {number})") from None
                outcome = of_ended(number)
            yield number, outcome
