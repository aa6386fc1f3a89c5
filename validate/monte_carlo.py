"""The comparison at samples of uncertain inputs, on the workers of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compare.processes import processors
from scenes.errors import SceneError
from scenes.parameters import SECTION
from scenes.sink import Sink
from scenes.uncertain import Uncertain
from scenes.varied import is_word, neighbour, numbers, varied
from validate.inputs import propagation
from validate.inputs.propagation import STEP
from validate.run.outcome import Outcome
from validate.sweep.cluster import Cluster
from validate.sweep.design import base
from validate.sweep.point import Scope, Work

FEWEST = 10  # Fewer samples give no standard deviation worth the name.
MOST = 100_000  # The most samples that may be asked for.


def added(outcome: Outcome[Sink], count: int, say: Callable[[str], None]) -> Outcome[Sink]:
    """The outcome of a run with uncertain inputs, with the spread of ``count`` samples of them. Raises SceneError where
    hardly any has an answer, and what a cluster raises."""
    propagated = outcome.propagated
    if propagated is None:
        raise ValueError("the run has no uncertain inputs")
    uncertain, sink, request = propagated.uncertain, outcome.scene, outcome.request
    keys = tuple(uncertain.relative)
    points = drawn(sink, uncertain, count)
    scope = Scope((request.reduction,), not request.transient, blame=False, all_checks=False)
    unmoved = base(sink)
    tasks = (Work(unmoved, scope, keys, (n,), (tuple(point),)) for n, point in enumerate(points.tolist()))
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
    u_inputs = {check.id: check.u_input or 0.0 for check in outcome.checks}
    checks = {name: u for name, u in u_inputs.items() if u > propagation.ROUNDING}
    sampled = propagation.spreads(columns, propagated, checks, count - len(rows))
    return replace(outcome, sampled=sampled, warnings=(*outcome.warnings, *sampled.warnings()))


def drawn(sink: Sink, uncertain: Uncertain, count: int) -> np.ndarray:
    """(count, keys): the values (SI units) of the uncertain keys in each sample; what a word comes to, the offset of a
    centred oxide, is a part of what it comes to there."""
    keys, values = tuple(uncertain.relative), numbers(sink)
    samples: np.ndarray = np.array([values[key] for key in keys]) * (1 + propagation.draw(uncertain, count))
    for n, word in enumerate(keys):
        if is_word(sink, word):
            for point in samples:
                changed = sink
                for key, value in zip(keys, point.tolist(), strict=True):
                    changed = varied(changed, key, value / values[key]) if key != word else changed
                point[n] *= numbers(changed)[word] / values[word]
    return samples


def check_apart(sink: Sink, keys: tuple[str, ...]) -> None:
    """Refuses a key beside the parameter that it is made of: a sample gives each a value, and it can have but one."""
    values = numbers(sink)
    for parameter in (key for key in keys if key.startswith(f"{SECTION}.")):
        changed = numbers(neighbour(sink, parameter, STEP))
        made = [key for key in keys if not key.startswith(f"{SECTION}.") and not is_word(sink, key)]
        for key in (key for key in made if changed.get(key) != values[key]):
            raise SceneError(
                f"--monte-carlo: {key} is made of {parameter}, and both are uncertain: give one of the two"
            )
