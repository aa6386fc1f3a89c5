"""A sweep, or the map of a tolerance's line, from what is asked to a folder of stored rows."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from compare.words import quantity
from validate.sweep.axes import Axis
from validate.sweep.base import Base
from validate.sweep.cluster import Cluster
from validate.sweep.design import Design
from validate.sweep.point import Asked, Work
from validate.sweep.store import Store

if TYPE_CHECKING:
    from validate.sweep.mapping import Map


@dataclass(frozen=True)
class Job:
    """What is asked for: a ``design`` of a ``base``, each point as ``asked``. Of a map the design is the cells, and not
    many more than ``solves`` of them are solved."""

    base: Base
    design: Design
    asked: Asked
    solves: int | None = None

    def document(self) -> dict[str, Any]:
        """All of it as JSON types: what a folder's earlier run must have been asked as well."""
        from validate.report.summary import version

        def axis(given: Axis) -> dict[str, Any]:
            return {"values": given.values, "log": given.log, "range": given.range}

        found = {
            "program": version(),
            "kind": "sweep" if self.solves is None else "map",
            "scene": {"name": self.base.name, "kind": self.base.kind, "document": self.base.document},
            "settings": self.base.settings,
            "vary": {given.key: axis(given) for given in self.design.axes},
            **({} if self.design.sample is None else {"sample": self.design.sample, "seed": self.design.seed}),
            **asdict(self.asked),
            **({} if self.solves is None else {"solves": self.solves}),
        }
        plain: dict[str, Any] = json.loads(json.dumps(found, default=str))
        return plain

    def work(self, numbers: Sequence[int], blamed: bool = True) -> Work:
        """A task."""
        points = tuple(self.design.point(number) for number in numbers)
        return Work(self.base, self.asked, self.design.keys, tuple(numbers), points, blamed)


@dataclass(frozen=True)
class Means:
    """What a job is done with: ``workers`` processes here or those of a ``scheduler``, ``seconds`` for each point."""

    workers: int
    scheduler: str | None = None
    seconds: float | None = None


class Pace:
    """Says how many points are stored, how many a second, and what is left."""

    def __init__(self, say: Callable[[str], None], already: int) -> None:
        self._say, self._already, self._started = say, already, time.monotonic()

    def at(self, stored: int, total: int, more: str = "") -> None:
        """Says it; ``total`` is how many there will be, at most."""
        spent, new = time.monotonic() - self._started, stored - self._already
        rate = new / spent if new and spent else 0.0
        left = f", {rate:.2g} a second, {quantity(max(total - stored, 0) / rate, 's', 2)} left" if rate else ""
        self._say(f"{stored} of {total} points{left}{more}")


def run(job: Job, store: Store, means: Means, say: Callable[[str], None]) -> Map | None:
    """Solves what is not stored yet; returns the map where that is asked for. Raises SceneError for a scheduler that
    can't be used, LostError."""
    pace = Pace(say, len(store))
    count = job.design.count
    with Cluster(min(means.workers, max(count - len(store), 1)), means.scheduler, means.seconds, say) as cluster:
        if job.solves is not None:
            from validate.sweep.mapping import refine

            return refine(job, store, cluster, pace)
        left = (job.work(numbers) for numbers in job.design.tasks() if numbers[0] not in store)
        gather(cluster, store, left, lambda: pace.at(len(store), count))
    return None


def gather(cluster: Cluster, store: Store, tasks: Iterable[Work], stored: Callable[[], None]) -> None:
    """Solves tasks; ``stored`` is called whenever more rows are on disk."""
    for found in cluster.solve(tasks):
        store.append(found)
        stored()
