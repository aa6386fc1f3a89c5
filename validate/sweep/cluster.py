"""Solve points by processes on this machine, or by the workers of a Dask cluster."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, suppress
from functools import cached_property, partial
from typing import Any

import fem3d.runs.scene
import fem3d.runs.sink  # noqa: F401 - no point's time includes the import
from compare.worker import EndedError, Worker, pool, share
from scenes.errors import RunawayError, SceneError, printable, quoted
from validate.sweep.design import settings
from validate.sweep.point import Row, Work, columns

ANSWERS_WITHIN = 10.0  # Seconds that a scheduler has to answer.
ATTEMPTS = 3  # How often a point is tried whose process dies, before the point is taken to be at fault.

Outcomes = Iterator[tuple[tuple[Any, ...], Future[Row]]]


class LostError(ArithmeticError):
    """The processes or the cluster are gone; stored points stay."""


class Cluster:
    """A context that solves points by ``workers`` processes here or by workers of a ``scheduler``, with some
    ``seconds`` for each point. Nothing is started before there is a point."""

    def __init__(
        self, workers: int, scheduler: str | None, seconds: float | None, say: Callable[[str], None] = lambda _: None
    ) -> None:
        self.workers, self.scheduler, self.seconds, self.say = workers, scheduler, seconds, say
        self._died: type[Exception] = EndedError
        self._started = ExitStack()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        # All rows are stored by now: a busy machine that does not end its processes in time is no failure.
        with suppress(Exception):
            self._started.close()

    def solve(self, points: Iterable[Work]) -> Iterator[Row]:
        """Yield the row of each point, as they come.

        A point whose process dies is tried again; if it dies each time, its row says so. Raises LostError where the
        cluster is gone, ModuleNotFoundError where the processes miss a package.
        """
        tasks = [(work,) for work in points]
        if not tasks:
            return
        try:
            for (work,), outcome in self._share(tasks):
                try:
                    row = outcome.result()
                except TimeoutError:
                    because = f"it took more than {self.seconds:g} s (--point-timeout)"
                    row = Row(work.number, "timeout", because, self.seconds or 0.0, {})
                except (EndedError, self._died):
                    row = Row(work.number, "crashed", "the processes that had it died one after the other", 0.0, {})
                yield row
        except (SceneError, ModuleNotFoundError):
            raise
        except Exception as error:
            why = f" ({_shorten(error)})" if str(error) else ""
            raise LostError(
                f"the workers are gone{why}: what is solved is stored, and the same command goes on"
            ) from None

    @cached_property
    def _share(self) -> Callable[[Iterable[tuple[Any, ...]]], Outcomes]:
        """A function that yields tasks with their outcomes, by the processes or the cluster, which start now."""
        self.say("starting the workers")
        if self.scheduler is not None:
            return self._connect()
        workers = self._started.enter_context(pool(self.workers))
        return lambda tasks: share(workers, solve, tasks, self.seconds, ATTEMPTS)

    def _connect(self) -> Callable[[Iterable[tuple[Any, ...]]], Outcomes]:
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
        for theirs in set(versions.values()) - {version()}:
            raise SceneError(
                f"the workers of {address} have version {theirs} of this program, here it is {version()}: install the "
                "same there"
            )
        self._died = KilledWorker
        return partial(_share_on, client, self.seconds)


def solve(work: Work) -> Row:
    """Return the row of a point; never raise for what a scene can cause."""
    started, status, because = time.perf_counter(), "ok", ""
    values: dict[str, Any] = {}
    parts = None
    try:
        values, parts = columns(work.base.at(settings(work.base, work.keys, work.point)), work.scope)
    except MemoryError:
        status, because = "failed", "out of memory: ask for a larger accuracy"
    except SceneError as error:
        status, because = "refused", str(error)
    except RunawayError as error:
        status, because = "runaway", str(error)
    except ArithmeticError as error:
        status, because = "failed", str(error)
    except Exception as error:
        status, because = "failed", f"a fault of this program, {type(error).__name__}: {error}"
    took = round(time.perf_counter() - started, 4)
    return Row(work.number, status, " ".join(because.split()), took, values, parts)


def _solve_in_time(work: Work, seconds: float | None) -> Row:
    """Return the row of a point on a cluster, in a process that can be ended where there is a limit of time."""
    if seconds is None:
        return solve(work)
    ((_, outcome),) = share([Worker()], solve, [(work,)], seconds)
    row: Row = outcome.result()
    return row


def _share_on(client: Any, seconds: float | None, tasks: Iterable[tuple[Any, ...]]) -> Outcomes:
    """Yield each task with its outcome; workers come and go."""
    from distributed import as_completed

    running = {client.submit(_solve_in_time, *task, seconds, pure=False): task for task in tasks}
    for future in as_completed(list(running)):
        yield running.pop(future), future


def _shorten(error: Exception) -> str:
    """The first sentence of Dask's message."""
    message = str(error).strip().split("\n")[0].rpartition("reason: ")[2].rstrip(".:")
    return printable(message or type(error).__name__, 120)
