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
from dataclasses import replace
from threading import Lock, Thread, Timer
from typing import TYPE_CHECKING, Any

from validate.processes import ONE_THREAD

if TYPE_CHECKING:
    from validate.sweep.point import Row, Work

IDLE = 60.0
ATTEMPTS = 3
"""How often a task is begun whose process dies, before it is said to be the task's fault."""


class DiedError(Exception):
    """The process is gone; ``late`` says that it was stopped because a point took too long."""

    def __init__(self, late: bool) -> None:
        super().__init__()
        self.late = late


class Solver:
    """The parent's side of such a process."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=os.environ | ONE_THREAD,
        )  # fmt: skip

    def send(self, work: Work) -> None:
        """Gives it a task; raises DiedError."""
        assert self._process.stdin is not None
        try:
            pickle.dump(work, self._process.stdin)
            self._process.stdin.flush()
        except OSError:
            raise DiedError(False) from None

    def row(self, seconds: float | None) -> Row:
        """Its next row, for which it has some seconds; raises DiedError."""
        assert self._process.stdout is not None
        late: list[bool] = []

        def stop() -> None:
            late.append(True)
            self._process.kill()

        timer = None if seconds is None else Timer(seconds, stop)
        if timer is not None:
            timer.daemon = True
            timer.start()
        try:
            found: Row = pickle.load(self._process.stdout)
            return found
        except (EOFError, OSError, pickle.UnpicklingError):
            raise DiedError(bool(late)) from None
        finally:
            if timer is not None:
                timer.cancel()

    def ready(self) -> None:
        """Waits until it can solve; raises DiedError."""
        self.row(None)

    def close(self) -> None:
        """Ends it."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


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

    lost: dict[int, Row] = {}
    deaths = starts = 0
    while True:
        left = [n for n in range(len(work.numbers)) if work.numbers[n] not in lost]
        if not left:
            return [lost[number] for number in work.numbers]
        now = replace(work, numbers=tuple(work.numbers[n] for n in left), points=tuple(work.points[n] for n in left))
        rows: list[Row] = []
        with _lock:
            solver = _waiting.pop() if _waiting else None
        solver = solver or Solver()
        begun = False
        try:
            solver.send(now)
            solver.ready()
            begun = True
            for _ in now.numbers:
                rows.append(solver.row(seconds))
        except DiedError as gone:
            solver.close()
            starts += not begun
            if starts >= ATTEMPTS:
                raise RuntimeError("the processes that solve points end before they begin") from None
            if not begun:
                continue
            number = now.numbers[len(rows)]
            deaths += not gone.late
            if gone.late:
                lost[number] = Row(
                    number, "timeout", f"it took more than {seconds:g} s (--point-timeout)", seconds or 0.0, {}
                )
            elif deaths >= ATTEMPTS:
                lost[number] = Row(number, "crashed", f"the process that solved it died, {deaths} times", 0.0, {})
                deaths = 0
            continue
        with _lock:
            _waiting.append(solver)
        found = {row.point: row for row in rows} | lost
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

    while True:
        try:
            work = tasks.get(timeout=IDLE)
        except queue.Empty:
            return
        pickle.dump(None, rows)
        rows.flush()
        for found in solve_points(work):
            pickle.dump(found, rows)
            rows.flush()


def _read(tasks: queue.Queue[Any]) -> None:
    """Reads tasks; when there will be none any more the process ends, whatever it is doing."""
    while True:
        try:
            tasks.put(pickle.load(sys.stdin.buffer))
        except (EOFError, OSError, pickle.UnpicklingError):
            os._exit(0)


if __name__ == "__main__":
    main()
