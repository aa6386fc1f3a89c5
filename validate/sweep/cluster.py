"""The workers: threads of Dask workers, here or of a cluster that is there, each with a solver's process of its own."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import chain, islice
from types import TracebackType
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError, printable, quoted
from validate.sweep import solver

if TYPE_CHECKING:
    from validate.sweep.point import Row, Work

ANSWERS_WITHIN = 10.0
"""Seconds that a scheduler has to answer."""


class LostError(ArithmeticError):
    """The cluster is gone; what is stored stays."""


def task(work: Work, seconds: float | None) -> list[Row]:
    """What a Dask worker does."""
    return solver.solve(work, seconds)


def program() -> str:
    """The version of this program that a worker has."""
    from validate.report.summary import version

    return version()


class Cluster:
    """A context in which tasks can be solved, by ``workers`` processes here or by those of a ``scheduler``.

    Here the Dask workers are threads of this process, which wait for the solvers' processes: that starts in a tenth of
    the time of workers in processes of their own, and needs no guard in a script that sweeps. Nothing is started before
    there is a task.
    """

    def __init__(
        self, workers: int, scheduler: str | None, seconds: float | None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self._workers, self._scheduler, self._seconds, self._say = workers, scheduler, seconds, say
        self._local: Any = None
        self._client: Any = None

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # All rows are stored by now: a machine too busy to say goodbye in time is no reason to fail.
        for part in (self._client, self._local):
            with suppress(Exception):
                if part is not None:
                    part.close(timeout=5)
        if self._scheduler is None:
            solver.close()

    def _start(self) -> None:
        """Raises SceneError where the scheduler does not answer, or has workers of another version."""
        self._say("starting the workers")
        if self._scheduler is None:
            solver.start(self._workers)
        import dask
        from distributed import Client, LocalCluster

        for name in list(logging.root.manager.loggerDict):  # what goes wrong is said in a sentence here
            if name.startswith(("distributed", "bokeh", "tornado")):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        dask.config.set({"distributed.scheduler.allowed-failures": solver.ATTEMPTS})
        # The workers' threads only wait: to sample them a hundred times a second would cost more than all else here.
        dask.config.set({"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500ms"})
        if self._scheduler is None:
            # Where another has the port, with or without a dashboard, Dask takes the next one.
            with warnings.catch_warnings(action="ignore", category=UserWarning):
                self._local = LocalCluster(
                    n_workers=self._workers, threads_per_worker=1, processes=False, memory_limit=0,
                    dashboard_address=":8787" if _draws() else None, silence_logs=logging.CRITICAL,
                )  # fmt: skip
        try:
            self._client = Client(self._local or self._scheduler, timeout=ANSWERS_WITHIN)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise SceneError(
                f"no scheduler answers at {quoted(str(self._scheduler))} ({_said(error)}): give --scheduler the "
                "address that dask scheduler prints, such as tcp://127.0.0.1:8786"
            ) from None
        if self._local is None:
            self._compare_versions()

    @property
    def threads(self) -> int:
        """How many tasks run at once."""
        return sum(self._client.nthreads().values()) if self._local is None else self._workers

    def solve(self, tasks: Iterable[Work]) -> Iterator[list[list[Row]]]:
        """The rows of the tasks as they are found, those that are there at once together. Not many more tasks than
        there are workers are handed out at a time. Raises LostError where the cluster is gone."""
        left = iter(tasks)
        first = next(left, None)
        if first is None:
            return
        if self._client is None:
            self._start()
        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        left = chain([first], left)
        running: dict[Any, Work] = {}
        done = as_completed(with_results=True, raise_errors=False)

        def hand_out() -> None:
            for work in islice(left, max(2 * self.threads - len(running), not running)):
                future = self._client.submit(task, work, self._seconds, pure=False)
                running[future] = work
                done.add(future)

        try:
            hand_out()
            while running:
                found = []
                for future, result in done.next_batch():
                    work = running.pop(future)
                    if future.status == "finished":
                        found.append(result)
                    elif isinstance(error := future.exception(), KilledWorker):
                        found.append(_killed(work))
                    else:
                        raise error or LostError(f"a task was {future.status}")
                yield found
                hand_out()
        except GeneratorExit:
            self._client.cancel(list(running))
            raise
        except (SceneError, KeyboardInterrupt):
            raise
        except Exception as error:
            raise LostError(
                f"the workers are gone ({_said(error)}): what is solved is stored, and the same command goes on"
            ) from None

    def _compare_versions(self) -> None:
        try:
            theirs = self._client.run(program)
        except Exception as error:
            raise SceneError(
                f"the workers of {quoted(str(self._scheduler))} can't run this program ({_said(error)}): install it "
                "where they are"
            ) from None
        if not theirs:
            self._say("waiting for a worker of the cluster")
        for version in theirs.values():
            if version != program():
                raise SceneError(
                    f"the workers of {quoted(str(self._scheduler))} have version {version} of this program, here it is "
                    f"{program()}: install the same there"
                )


def _killed(work: Work) -> list[Row]:
    """What is said of points whose Dask workers died one after the other."""
    from validate.sweep.point import Row

    return [
        Row(number, "crashed", "the Dask workers that had it died one after the other", 0.0, {})
        for number in work.numbers
    ]


def _said(error: Exception) -> str:
    """What Dask says, to the end of its first sentence."""
    said = str(error).strip().split("\n")[0].rpartition("reason: ")[2].rstrip(".")
    return printable(said or type(error).__name__, 120)


def _draws() -> bool:
    """Whether Dask has what its dashboard is drawn with."""
    from importlib.util import find_spec

    return find_spec("bokeh") is not None
