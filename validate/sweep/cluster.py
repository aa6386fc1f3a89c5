"""The workers: threads of Dask workers, here or of a cluster that is there, each with a solver's process of its own."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError, printable, quoted
from validate.sweep import solver

if TYPE_CHECKING:
    from validate.sweep.point import Row, Work

ANSWERS_WITHIN = 10.0  # seconds that a scheduler has to answer


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
            solver.close()

    def _start(self) -> None:
        """Raises SceneError where the scheduler does not answer, or has workers of another version."""
        self.say("starting the workers")
        if self.scheduler is None:
            solver.start(self.workers)
        import dask
        from distributed import Client, LocalCluster

        for name in list(logging.root.manager.loggerDict):  # what goes wrong is said in a sentence here
            if name.startswith(("distributed", "bokeh", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        dask.config.set({"distributed.scheduler.allowed-failures": solver.ATTEMPTS})
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
                    running[self._client.submit(solver.solve, work, self.seconds, pure=False)] = work
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

    from validate.sweep.point import Row

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
