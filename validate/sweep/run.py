"""A sweep, or the map of a tolerance's line, from what is asked to a folder of stored rows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from scenes.formats import quantity
from validate.sweep.cluster import Cluster
from validate.sweep.job import Job, Means
from validate.sweep.point import Work
from validate.sweep.store import Store

if TYPE_CHECKING:
    from validate.sweep.mapping import Map


def run(job: Job, store: Store, means: Means, say: Callable[[str], None]) -> Map | None:
    """Solves what is not stored yet, and says how many points are stored, how many a second, and what is left; returns
    the map where that is asked for. Raises SceneError for a scheduler that can't be used, LostError."""
    already, started, count = len(store), time.monotonic(), job.design.count

    def gather(tasks: Iterable[Work], total: int, more: str = "") -> None:
        for found in cluster.solve(tasks):
            store.append(found)
            rate = (len(store) - already) / (time.monotonic() - started)
            left = quantity(max(total - len(store), 0) / rate, "s", 2)
            say(f"{len(store)} of {total} points, {rate:.2g} a second, {left} left{more}")

    with Cluster(min(means.workers, max(count - already, 1)), means.scheduler, means.seconds, say) as cluster:
        if job.solves is not None:
            from validate.sweep.mapping import refine

            return refine(job, store, gather)
        gather((job.work(numbers) for numbers in job.design.tasks() if numbers[0] not in store), count)
    return None
