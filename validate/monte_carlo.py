"""The comparison at samples of uncertain inputs, on the workers of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from compare.inputs import sampling
from scenes.errors import SceneError
from scenes.varied import numbers
from validate.processes import processors
from validate.sweep.cluster import Cluster
from validate.sweep.design import base
from validate.sweep.point import Scope, Work

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink

FEWEST = 10
MOST = 100_000


def added(outcome: Outcome[Sink], count: int, say: Callable[[str], None]) -> Outcome[Sink]:
    """The outcome of a run with uncertain inputs, with the spread of ``count`` samples of them. Raises SceneError where
    hardly any has an answer, and what a cluster raises."""
    found = outcome.propagated
    if found is None:
        raise ValueError("the run has no uncertain inputs")
    uncertain, sink, request = found.uncertain, outcome.scene, outcome.request
    keys = tuple(uncertain.relative)
    middle = np.array([numbers(sink)[key] for key in keys])
    points = middle * (1 + sampling.draw(uncertain, count))
    scope = Scope((request.reduction,), not request.transient, blame=False, all_checks=False)
    given = base(sink)
    tasks = (Work(given, scope, keys, (n,), (tuple(point),)) for n, point in enumerate(points.tolist()))
    rows = []
    with Cluster(min(processors(), count), None, None, say) as cluster:
        for tasks_rows in cluster.solve(tasks):
            rows += [row for task in tasks_rows for row in task]
            say(f"{len(rows)} of {count} samples")
    rows = sorted((row for row in rows if row.status == "ok"), key=lambda row: row.point)
    if len(rows) < FEWEST:
        raise SceneError(f"--monte-carlo {count}: only {len(rows)} samples have an answer: give smaller uncertainties")
    names = [n for n, v in rows[0].values.items() if isinstance(v, float)]
    columns = {n: np.array([row.values[n] for row in rows]) for n in names}
    checks = {check.id: check.u_input for check in outcome.checks if check.u_input}
    sampled = sampling.spreads(columns, found, checks, count - len(rows))
    return replace(outcome, sampled=sampled, warnings=(*outcome.warnings, *sampled.warnings()))
