"""The workers: threads of Dask workers, here or of a cluster that is there, each with a solver's process of its own,
which solves points one at a time: it can be killed where one takes too long, and nothing is lost with it.

Run as a program this is that process: it reads tasks from standard input, and writes rows to standard output. It ends
when its parent does, or has nothing for it for a minute.
"""

from __future__ import annotations

import logging
import os
import pickle
import queue
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import chain, islice
from threading import TIMEOUT_MAX, Lock, Thread, Timer
from typing import Any

from scenes.errors import SceneError, printable, quoted
from validate.processes import ONE_THREAD
from validate.sweep.point import Row, Work

ANSWERS_WITHIN = 10.0  # seconds that a scheduler has to answer
IDLE = 60.0  # seconds after which a process that has nothing to do ends
ATTEMPTS = 3  # how often a task is begun whose process dies, before it is said to be the task's fault
_GONE = (EOFError, OSError, pickle.UnpicklingError)
"""What is raised where the process at the other end of a pipe has ended."""


class LostError(ArithmeticError):
    """The cluster is gone; what is stored stays."""


@dataclass
class Cluster:
    """A context in which tasks can be solved, by ``workers`` processes here or by those of a ``scheduler``, with some
    ``seconds`` for each point.

    Here the Dask workers are threads of this process, which wait for the solvers' processes: that starts in a tenth of
    the time of workers in processes of their own, and needs no guard in a script that sweeps. Nothing is started before
    there is a task.
    """

    workers: int
    scheduler: str | None
    seconds: float | None
    say: Callable[[str], None] = lambda _: None
    _local: Any = None
    _client: Any = None

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        # All rows are stored by now: a machine too busy to say goodbye in time is no reason to fail.
        for part in filter(None, (self._client, self._local)):
            with suppress(Exception):
                part.close(timeout=5)
        if self.scheduler is None:
            close()

    def _start(self) -> None:
        """Raises SceneError where the scheduler does not answer, or has workers of another version."""
        self.say("starting the workers")
        if self.scheduler is None:
            start(self.workers)
        import dask
        from distributed import Client, LocalCluster

        for name in list(logging.root.manager.loggerDict):  # what goes wrong is said in a sentence here
            if name.startswith(("distributed", "bokeh", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS})
        # The workers' threads only wait: to sample them a hundred times a second would cost more than all else here.
        dask.config.set({"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500ms"})
        if self.scheduler is None:
            # Where another has the port, with or without a dashboard, Dask takes the next one.
            with warnings.catch_warnings(action="ignore", category=UserWarning):
                self._local = LocalCluster(
                    n_workers=self.workers, threads_per_worker=1, processes=False, memory_limit=0,
                    dashboard_address=":8787" if find_spec("bokeh") else None, silence_logs=logging.CRITICAL,
                )  # fmt: skip
        there = quoted(str(self.scheduler))
        try:
            self._client = Client(self._local or self.scheduler, timeout=ANSWERS_WITHIN)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise SceneError(
                f"no scheduler answers at {there} ({_said(error)}): give --scheduler the address that dask scheduler "
                "prints, such as tcp://127.0.0.1:8786"
            ) from None
        if self._local is not None:
            return
        from validate.report.summary import version

        try:
            versions = self._client.run(version)
        except Exception as error:
            raise SceneError(
                f"the workers of {there} can't run this program ({_said(error)}): install it where they are"
            ) from None
        if not versions:
            self.say("waiting for a worker of the cluster")
        for theirs in versions.values():
            if theirs != version():
                raise SceneError(
                    f"the workers of {there} have version {theirs} of this program, here it is {version()}: install "
                    "the same there"
                )

    def solve(self, tasks: Iterable[Work]) -> Iterator[list[list[Row]]]:
        """The rows of the tasks as they are found, those that are there at once together. Not many more tasks than
        there are workers are handed out at a time. Raises LostError where the cluster is gone."""
        left = iter(tasks)
        first = next(left, None)
        if first is None:
            return
        if self._client is None:
            self._start()
        from distributed import wait

        left = chain([first], left)
        running: dict[Any, Work] = {}
        try:
            while True:
                threads = self.workers if self._local else sum(self._client.nthreads().values())
                for work in islice(left, max(2 * threads - len(running), not running)):
                    running[self._client.submit(solve, work, self.seconds, pure=False)] = work
                if not running:
                    return
                done = wait(list(running), return_when="FIRST_COMPLETED").done
                yield [_rows(future, running.pop(future)) for future in done]
        except GeneratorExit:
            self._client.cancel(list(running))
            raise
        except Exception as error:
            raise LostError(
                f"the workers are gone ({_said(error)}): what is solved is stored, and the same command goes on"
            ) from None


def _rows(future: Any, work: Work) -> list[Row]:
    """What a Dask worker has found; of points whose workers died one after the other that is said."""
    from distributed.scheduler import KilledWorker

    if future.status == "finished":
        found: list[Row] = future.result()
        return found
    error = future.exception() if future.status == "error" else LostError(f"a task was {future.status}")
    if not isinstance(error, KilledWorker):
        raise error
    said = "the Dask workers that had it died one after the other"
    return [Row(number, "crashed", said, 0.0, {}) for number in work.numbers]


def _said(error: Exception) -> str:
    """What Dask says, to the end of its first sentence."""
    said = str(error).strip().split("\n")[0].rpartition("reason: ")[2].rstrip(".:")
    return printable(said or type(error).__name__, 120)


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
    import fem3d.runs.sink  # noqa: F401
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
