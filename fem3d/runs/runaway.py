"""The course of a transient until shortly before a thermal runaway."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.runs import scene as scene_run
from fem3d.solution import transient
from fem3d.solution.exponential import runs_away
from fem3d.spaces import channels
from scenes.errors import NumericsError, RunawayError, RunawayInTimeError
from scenes.model import AnyScene, Boundary, GroupBoundary, Value
from scenes.result import Result
from scenes.units import TIME

# The course is kept up to this fraction of the time t of the runaway. The rise approaches its last value like
# (1 - time / t)^(1/2), so that its error there is about three times the error of t.
KEPT = 0.95
TRIES = 4  # runs that may each move the end: a finer mesh may run away earlier
ROUGH = 1e-2  # accuracy of the steady state that gives the largest voltage
STEPS = 1e-2  # fraction of the accuracy for the steps that locate the time


def until(
    scene: AnyScene, runaway: RunawayInTimeError, progress: Callable[[str], None] | None = None, whole: bool = False
) -> tuple[AnyScene, Result, str]:
    """Return the scene up to shortly before its runaway, its result (`fem3d.runs.scene.solve`), and a sentence.

    The sentence names the time of the runaway, the end of the result and, if a rough steady state gives it, the largest
    voltage with a steady state. Raises the ``runaway`` itself if no such result can be solved.
    """
    time = runaway.time
    for _ in range(TRIES):
        end = float(f"{KEPT * time:.2e}")
        kept = replace(scene, end_time=end, output_times=(*(t for t in scene.output_times if t < end), end))
        try:
            result = scene_run.solve(kept, progress, whole)
            break
        except RunawayInTimeError as earlier:
            time = min(earlier.time, end)
        except NumericsError:
            raise runaway from None
    else:
        raise runaway
    instant, response = runaway.time, result.details["transient"]
    try:
        if isinstance(response, transient.Transient):
            transient.march(response.base, response.reduced, scene.end_time, STEPS * scene.accuracy)
    except RunawayInTimeError as known:
        instant = known.time
    limit = _limit(scene, runaway.time)
    return kept, result, f"{runs_away(instant, scene.accuracy)}; it is solved up to {TIME.show(end)}{limit}"


def _limit(scene: AnyScene, time: float) -> str:
    """Return the end of a sentence: the largest voltage, or given current, with a steady state under the conditions at
    a ``time`` (s); empty if unknown."""

    def then(value: Value) -> float:
        return float(channels.value(value, np.array([time]))[0])

    def held(b: Boundary | GroupBoundary) -> Any:
        return replace(b, value=then(b.value), ambient=then(b.ambient))

    heated = scene.heated[1]
    sources = tuple(replace(s, heat_source=then(s.heat_source)) for s in getattr(scene, heated))
    given: dict[str, Any] = {heated: sources, "boundaries": tuple(map(held, scene.boundaries))}
    try:
        scene_run.solve(replace(scene, **given, steady=True, output_times=(), accuracy=ROUGH))
    except RunawayError as error:
        return f"; {error.largest}" if error.largest else ""
    except NumericsError:
        return ""
    return ""
