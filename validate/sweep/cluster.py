"""Solve points by a pool of processes on this machine, or by the workers of a Dask cluster."""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack, suppress

from compare.worker import pool
from scenes.errors import SceneError, printable, quoted
from validate.sweep.point import Row, Work, late, solve

Submit = Callable[[Work], Future[Row]]

ANSWERS_WITHIN = 10.0  # Seconds that a scheduler has to answer.
ATTEMPTS = 3  # How often a point is tried whose process dies, before the point is taken to be at fault.
PATIENCE = 10.0
"""Seconds after which a point that should have stopped itself is killed; no library's call takes as long."""


class LostError(ArithmeticError):
    """The processes or the cluster are gone; stored points stay."""


class Cluster:
    """A context that solves points by ``workers`` processes here or by those of a ``scheduler``, with some ``seconds``
    for each point. Nothing is started before there is a point."""

    def __init__(
        self, workers: int, scheduler: str | None, seconds: float | None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self.workers, self.scheduler, self.seconds, self.say = workers, scheduler, seconds, say
        self._submit: Submit | None = None
        self._died: type[Exception] = Exception  # ends a task whose process died
        self._attempts = 1  # of such a task here; a scheduler makes its own
        self._started = ExitStack()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        # All rows are stored by now: a busy machine that does not end its processes in time is no failure.
        with suppress(Exception):
            self._started.close()

    def _start(self) -> Submit:
        self.say("starting the workers")
        return self._start_processes() if self.scheduler is None else self._connect()

    def _start_processes(self) -> Submit:
        """Start a pool of processes, which kills one that takes far too long, as a library's call can."""
        from pebble import ProcessExpired

        processes = self._started.enter_context(pool(self.workers))
        self._died, self._attempts = ProcessExpired, ATTEMPTS
        most = None if self.seconds is None else self.seconds + PATIENCE
        return lambda work: processes.schedule(solve, (work, self.seconds), timeout=most)

    def _connect(self) -> Submit:
        """Connect to a cluster. SceneError where its scheduler is silent, or has workers of another version."""
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise SceneError(
                "--scheduler needs Dask: pip install 'heated-microstructure-validation[cluster]', or leave it out"
            ) from None
        from validate.report.summary import version

        for name in list(logging.root.manager.loggerDict):  # sentences here report the failures
            if name.startswith(("distributed", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        address = quoted(str(self.scheduler))
        try:
            client = Client(self.scheduler, timeout=ANSWERS_WITHIN)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise SceneError(
                f"no scheduler answers at {address} ({_shorten(error)}): give --scheduler the address that dask "
                "scheduler prints, such as tcp://127.0.0.1:8786"
            ) from None
        self._started.callback(client.close, timeout=5)
        try:
            versions = client.run(version)
        except Exception as error:
            raise SceneError(
                f"the workers of {address} can't run this program ({_shorten(error)}): install it where they are"
            ) from None
        if not versions:
            self.say("waiting for a worker of the cluster")
        for theirs in versions.values():
            if theirs != version():
                raise SceneError(
                    f"the workers of {address} have version {theirs} of this program, here it is {version()}: install "
                    "the same there"
                )
        self._died, executor = KilledWorker, client.get_executor(pure=False)

        def submit(work: Work) -> Future[Row]:
            self.workers = sum(client.nthreads().values())  # workers come and go
            return executor.submit(solve, work, self.seconds)

        return submit

    def solve(self, points: Iterable[Work]) -> Iterator[list[Row]]:
        """Yield the rows of points as they come, with about two points in flight for each worker.

        A point whose process dies is tried again; if it dies each time, its row says so. Raises LostError where the
        cluster is gone, ModuleNotFoundError where the processes miss a package.
        """
        waiting, again = iter(points), deque[Work]()
        running: dict[Future[Row], Work] = {}
        deaths = Counter[int]()
        try:
            while True:
                while len(running) < max(2 * self.workers, 1):
                    work = again.popleft() if again else next(waiting, None)
                    if work is None:
                        break
                    self._submit = self._submit or self._start()
                    running[self._submit(work)] = work
                if not running:
                    return
                rows = []
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    work = running.pop(future)
                    try:
                        rows.append(future.result())
                    except TimeoutError:
                        rows.append(Row(work.number, "timeout", late(self.seconds), 0.0, {}))
                    except self._died:
                        deaths[work.number] += 1
                        if deaths[work.number] < self._attempts:
                            again.append(work)
                        else:
                            because = "the processes that had it died one after the other"
                            rows.append(Row(work.number, "crashed", because, 0.0, {}))
                if rows:
                    yield rows
        except (SceneError, ModuleNotFoundError, GeneratorExit):
            for future in running:
                future.cancel()
            raise
        except Exception as error:
            why = f" ({_shorten(error)})" if str(error) else ""
            raise LostError(
                f"the workers are gone{why}: what is solved is stored, and the same command goes on"
            ) from None


def _shorten(error: Exception) -> str:
    """The first sentence of Dask's message."""
    message = str(error).strip().split("\n")[0].rpartition("reason: ")[2].rstrip(".:")
    return printable(message or type(error).__name__, 120)
