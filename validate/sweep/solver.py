"""A process that solves points, one at a time: it can be killed where one takes too long, and nothing is lost with it.

Run as a program it is that process: it reads tasks from standard input, and writes rows to standard output. It ends
when its parent does, or has nothing for it for a minute.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from threading import TIMEOUT_MAX, Lock, Thread, Timer
from typing import TYPE_CHECKING, Any

from validate.processes import ONE_THREAD

if TYPE_CHECKING:
    from validate.sweep.point import Row, Work

IDLE = 60.0
ATTEMPTS = 3  # how often a task is begun whose process dies, before it is said to be the task's fault
_GONE = (EOFError, OSError, pickle.UnpicklingError)
"""What is raised where the process at the other end of a pipe has ended."""


class Solver:
    """The parent's side of such a process; ``late`` says that it was stopped because a point took too long."""

    late = False

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=os.environ | ONE_THREAD,
        )  # fmt: skip

    def rows(self, work: Work, seconds: float | None) -> Iterator[Row | None]:
        """``None`` when it begins with a task, then its rows, for each of which it has some seconds; where the process
        dies there are fewer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(*_GONE):
            pickle.dump(work, self._process.stdin)
            self._process.stdin.flush()
            yield pickle.load(self._process.stdout)
            for _ in work.numbers:
                self.late = False
                timer = Timer(TIMEOUT_MAX if seconds is None else seconds, self._stop)
                timer.daemon = True
                timer.start()
                try:
                    row = pickle.load(self._process.stdout)
                finally:
                    timer.cancel()
                yield row

    def _stop(self) -> None:
        self.late = True
        self._process.kill()

    def close(self) -> None:
        """Ends it."""
        with suppress(OSError), self._process:
            self._process.kill()


_waiting: list[Solver] = []
_lock = Lock()


def start(count: int) -> None:
    """Starts processes that the first tasks will find waiting."""
    with _lock:
        _waiting.extend(Solver() for _ in range(count))


def close() -> None:
    """Ends all that wait."""
    with _lock:
        while _waiting:
            _waiting.pop().close()


def solve(work: Work, seconds: float | None) -> list[Row]:
    """The rows of a task, found in a process of its own, with some seconds for each point.

    A point that takes longer is a row that says so, and so is one whose process dies again and again. What else was
    found of a task whose process died is found anew, since its points share fields. RuntimeError where processes end
    before they have begun.
    """
    from validate.sweep.point import Row

    found: dict[int, Row] = {}
    deaths = starts = 0
    while left := [(n, point) for n, point in zip(work.numbers, work.points, strict=True) if n not in found]:
        numbers, points = zip(*left, strict=True)
        with _lock:
            solver = _waiting.pop() if _waiting else None
        solver = solver or Solver()
        told = list(solver.rows(replace(work, numbers=numbers, points=points), seconds))
        if len(told) > len(numbers):
            with _lock:
                _waiting.append(solver)
            found |= {row.point: row for row in told if row is not None}
            break
        solver.close()
        if not told:
            starts += 1
            if starts >= ATTEMPTS:
                raise RuntimeError("the processes that solve points end before they begin")
            continue
        number = numbers[len(told) - 1]
        if solver.late:
            said = f"it took more than {seconds:g} s (--point-timeout)"
            found[number] = Row(number, "timeout", said, seconds or 0.0, {})
            continue
        deaths += 1
        if deaths >= ATTEMPTS:
            said = f"the process that solved it died, {deaths} times"
            found[number] = Row(number, "crashed", said, 0.0, {})
            deaths = 0
    return [found[number] for number in work.numbers]


def main() -> None:
    """The process itself: tasks in, for each a sign that it begins, then its rows."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command decides what an interrupt means
    # What anything prints must not come between the rows.
    rows = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    tasks: queue.Queue[Any] = queue.Queue()
    Thread(target=_read, args=(tasks,), daemon=True).start()
    import fem3d.run  # noqa: F401
    from validate.sweep.point import solve as solve_points

    with suppress(queue.Empty):
        while True:
            work = tasks.get(timeout=IDLE)
            pickle.dump(None, rows)
            rows.flush()
            for found in solve_points(work):
                pickle.dump(found, rows)
                rows.flush()


def _read(tasks: queue.Queue[Any]) -> None:
    """Reads tasks; when there will be none any more the process ends, whatever it is doing."""
    with suppress(*_GONE):
        while True:
            tasks.put(pickle.load(sys.stdin.buffer))
    os._exit(0)


if __name__ == "__main__":
    main()
