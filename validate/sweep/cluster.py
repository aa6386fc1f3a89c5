"""Who solves points: a pool of processes here, or the workers of a Dask cluster that is there."""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace

from compare.worker import pool
from scenes.errors import SceneError, printable, quoted
from validate.sweep.point import Row, Work, late, ready, solve

Submit = Callable[[Work], Future[list[Row]]]

ANSWERS_WITHIN = 10.0  # Seconds that a scheduler has to answer.
ATTEMPTS = 3  # How often a task is tried whose process dies, before the task is taken to be at fault.
PATIENCE = 10.0
"""Seconds after which a point that should have stopped itself is killed; no library's call takes as long."""


class LostError(ArithmeticError):
    """The processes or the cluster are gone; what is stored stays."""


@dataclass
class Cluster:
    """A context in which tasks can be solved, by ``workers`` processes here or by those of a ``scheduler``, with some
    ``seconds`` for each point. Nothing is started before there is a task."""

    workers: int
    scheduler: str | None
    seconds: float | None
    say: Callable[[str], None] = lambda _: None
    _submit: Submit | None = None
    _died: type[Exception] = Exception  # what a task whose process died ends with
    _attempts: int = 1  # how often such a task is begun, beside what a scheduler does of its own
    _started: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        # All rows are stored by now: a machine too busy to say goodbye in time is no reason to fail.
        with suppress(Exception):
            self._started.close()

    def _start(self) -> Submit:
        self.say("starting the workers")
        return self._in_processes() if self.scheduler is None else self._on_cluster()

    def _in_processes(self) -> Submit:
        """Hands tasks to a pool of processes; kills one that takes far too long, as a library's call can."""
        from pebble import ProcessExpired

        processes = self._started.enter_context(pool(self.workers, ready))
        self._died, self._attempts = ProcessExpired, ATTEMPTS

        def submit(work: Work) -> Future[list[Row]]:
            most = None if self.seconds is None else len(work.numbers) * self.seconds + PATIENCE
            try:
                return processes.schedule(solve, (work, self.seconds), timeout=most)
            except RuntimeError as error:
                broken = Future[list[Row]]()
                broken.set_exception(BrokenProcessPool(str(error)))
                return broken

        return submit

    def _on_cluster(self) -> Submit:
        """Hands tasks to a cluster. SceneError where its scheduler is silent, or has workers of another version."""
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise SceneError(
                "--scheduler needs Dask: pip install 'heated-microstructure-validation[cluster]', or leave it out"
            ) from None
        from validate.report.summary import version

        for name in list(logging.root.manager.loggerDict):  # what goes wrong is said in a sentence here
            if name.startswith(("distributed", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        address = quoted(str(self.scheduler))
        try:
            client = Client(self.scheduler, timeout=ANSWERS_WITHIN)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise SceneError(
                f"no scheduler answers at {address} ({_said(error)}): give --scheduler the address that dask scheduler "
                "prints, such as tcp://127.0.0.1:8786"
            ) from None
        self._started.callback(client.close, timeout=5)
        try:
            versions = client.run(version)
        except Exception as error:
            raise SceneError(
                f"the workers of {address} can't run this program ({_said(error)}): install it where they are"
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

        def submit(work: Work) -> Future[list[Row]]:
            self.workers = sum(client.nthreads().values())  # they come and go
            return executor.submit(solve, work, self.seconds)

        return submit

    def solve(self, tasks: Iterable[Work]) -> Iterator[list[list[Row]]]:
        """The rows of the tasks as they are found, those that are there at once together. Not many more tasks than
        there are workers are handed out at a time.

        A task whose process dies is begun again. If it dies each time, or is killed for its time, its points are solved
        one by one, so that the one to blame is a row that says so and the others are solved. Raises LostError where
        the cluster is gone, or processes end before they begin, ModuleNotFoundError where they miss a package.
        """
        waiting, again = iter(tasks), deque[Work]()
        running: dict[Future[list[Row]], Work] = {}
        deaths, breaks = Counter[tuple[int, ...]](), 0
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
                    work, ended = running.pop(future), ""
                    try:
                        rows.append(future.result())
                        breaks = 0
                    except TimeoutError:
                        ended, because = "timeout", late(self.seconds)
                    except self._died:
                        deaths[work.numbers] += 1
                        if deaths[work.numbers] < self._attempts:
                            again.append(work)
                        else:
                            ended, because = "crashed", "the processes that had it died one after the other"
                    except BrokenProcessPool:  # of a pool all of whose processes have ended, all tasks end so
                        again.append(work)
                        if self._submit is not None:
                            breaks, self._submit = breaks + 1, None
                            self._started.close()
                        if breaks >= ATTEMPTS:
                            raise
                    if ended and len(work.numbers) > 1:
                        points = zip(work.numbers, work.points, strict=True)
                        again.extend(replace(work, numbers=(n,), points=(point,)) for n, point in points)
                    elif ended:
                        rows.append([Row(work.numbers[0], ended, because, 0.0, {})])
                if rows:
                    yield rows
        except (SceneError, GeneratorExit):
            for future in running:
                future.cancel()
            raise
        except Exception as error:
            if isinstance(error, BrokenProcessPool):
                import fem3d.runs.scene  # noqa: F401 - what processes miss before they begin is missing here too
            why = f" ({_said(error)})" if str(error) else ""
            raise LostError(
                f"the workers are gone{why}: what is solved is stored, and the same command goes on"
            ) from None


def _said(error: Exception) -> str:
    """What Dask says, to the end of its first sentence."""
    said = str(error).strip().split("\n")[0].rpartition("reason: ")[2].rstrip(".:")
    return printable(said or type(error).__name__, 120)
