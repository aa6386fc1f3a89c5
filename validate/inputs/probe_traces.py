"""How a free scene's probes, in 3D and in a user's model, follow its keys, in their units: over time, or at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compare.models import Model
from compare.models.slopes import follow
from scenes.errors import SceneError
from scenes.model import AnyScene
from scenes.result import Estimate, Result
from scenes.varied import neighbour
from validate.inputs.calibration import Modelled
from validate.inputs.propagation import STEP, SlopesInUnits
from validate.inputs.sensitivities import Sensitivities, of_free


def above(scene: AnyScene, key: str, over_time: bool) -> float:
    """What the temperature that rises count from changes by with the logarithm of a key (K)."""
    if over_time:
        return (neighbour(scene, key, STEP).initial_temperature - scene.initial_temperature) / STEP
    from fem3d.runs.scene_sensitivity import floor_of

    return (floor_of(scene, neighbour(scene, key, STEP)) - floor_of(scene, scene)) / STEP


def of_3d(scene: AnyScene, sensitivities: Sensitivities) -> SlopesInUnits:
    """Of 3D, which has slopes of rises."""
    thermal = {probe.name for probe in scene.probes if probe.quantity == "temperature"}

    def slope_of(key: str, name: str, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        nothing = np.full(len(times), np.nan)
        if np.isinf(times[-1]):
            slope = sensitivities.steady.get(key, {}).get(name)
            if slope is None or slope.fem3d is None:
                return nothing
            change = np.array([slope.fem3d.value * sensitivities.values[name].value])
        else:
            course = sensitivities.course
            if course is None or name not in course.fem3d.get(key, {}):
                return nothing
            late = np.log(np.maximum(times, course.times[0]))
            change = np.interp(late, np.log(course.times), course.fem3d[key][name])
        return change + above(scene, key, not np.isinf(times[-1])) * (name in thermal)

    return slope_of


def of_model(scene: AnyScene, model: Model) -> SlopesInUnits:
    """Of a user's own model, by differences."""
    solved: dict[tuple[str, bytes], dict[str, np.ndarray]] = {}

    def slope_of(key: str, name: str, times: np.ndarray, values: np.ndarray) -> np.ndarray:
        at_rest, case = np.isinf(times[-1]), (key, times.tobytes())
        if case not in solved:
            # A model over time is run up to the last time, which may be less than the run.
            followed = follow(
                model, scene, [key], None if at_rest else np.union1d(times, scene.end_time), lambda _: None
            )
            solved[case] = followed.slopes.get(key, {})
        slope = solved[case].get(name)
        if slope is None:
            return np.full(len(times), np.nan)
        if at_rest:
            return np.atleast_1d(slope)
        return np.interp(times, np.union1d(times, scene.end_time), slope)

    return slope_of


def moved(scene: AnyScene, result: Result, slopes: SlopesInUnits, key: str, step: float) -> Result:
    """A result as it would be, to first order, with one key larger by a relative step."""
    at_rest = np.array([np.inf])
    steady = {
        name: Estimate(float(e.value + step * slopes(key, name, at_rest, np.array([e.value]))[0]), e.error)
        for name, e in result.steady.items()
    }
    traces = result.traces
    if traces is not None:
        values = {n: v + step * slopes(key, n, traces.time, v) for n, v in traces.values.items()}
        traces = replace(traces, values=values)
    return replace(result, steady=steady, traces=traces)


def in_3d(scene: AnyScene, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """The probes in 3D and their derivatives by the logarithms of keys. Raises SceneError for a key that has none."""
    from fem3d.runs import scene as scene_run

    result = scene_run.solve(scene, lambda _: None, whole=True)
    sensitivities = of_free(scene, result, keys)
    left_out = next((key for key in keys if key in sensitivities.left_out), None)
    if left_out is not None:
        raise SceneError(f"--calibrate {left_out}: {sensitivities.left_out[left_out]}")
    if np.isinf(times[-1]):
        values = {name: np.array([e.value]) for name, e in result.steady.items()}
    else:
        values = {n: np.interp(times, result.over_time.time, v) for n, v in result.over_time.values.items()}
    slopes = of_3d(scene, sensitivities)
    by = {key: {name: np.nan_to_num(slopes(key, name, times, v)) for name, v in values.items()} for key in keys}
    return values, by
