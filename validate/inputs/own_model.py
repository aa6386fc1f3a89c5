"""How a user's own model follows the keys of a free scene beside 3D, and what uncertain keys make of their differences.

Both models have the same keys, which move them together. With m the model, s 3D and S the scale, a check's difference
d = (m - s)/S changes with the logarithm of a key by (m' - s')/S - d S'/S.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compare.models import Model
from compare.models.slopes import follow
from compare.verdict import Check
from scenes.model import OVER_TIME, AnyScene
from scenes.result import Estimate, Result
from scenes.varied import neighbour
from validate.inputs.propagation import Propagated, combined
from validate.inputs.sensitivities import Sensitivities, Slope

STEP = 1e-4  # Relative step of a key: the temperature that rises count from is linear in the key, or independent of it.


def beside(
    sensitivities: Sensitivities, scene: AnyScene, in_3d: Result, model: Model, in_1d: Result, checks: Sequence[Check]
) -> Sensitivities:
    """The sensitivities of 3D with the model's own beside them: in the steady state; over time at the instant at which
    the 3D quantity is largest, as those of 3D are. Of every check what its difference changes by with each key."""
    from fem3d.runs.scene_sensitivity import floor_of

    over_time = in_3d.traces is not None
    thermal = {probe.name: probe.quantity == "temperature" for probe in scene.probes}
    answers = in_1d.over_time.values if over_time else in_1d.steady
    names = [name for name in sensitivities.values if name in answers]
    tops = {name: _top(scene, in_3d, name) if over_time else 0.0 for name in names}
    judged = {
        c.id: c for c in checks if c.id.endswith(OVER_TIME) == over_time and c.id.removesuffix(OVER_TIME) in names
    }
    times = None
    if over_time:
        worst = [c.time for c in judged.values() if c.time is not None]
        times = np.unique([*tops.values(), *worst, in_3d.over_time.time[-1]])
    followed = follow(model, scene, sensitivities.steady, times, lambda _: None)

    def base(changed: AnyScene) -> float:
        """What temperatures rise above."""
        return changed.initial_temperature if over_time else floor_of(scene, changed)

    def model_at(name: str, time: float) -> float:
        if not over_time:
            return in_1d.steady[name].value
        return float(np.interp(time, in_1d.over_time.time, in_1d.over_time.values[name]))

    model_rises = {name: model_at(name, tops[name]) - base(scene) * thermal[name] for name in names}
    steady = {key: dict(slopes) for key, slopes in sensitivities.steady.items()}
    moved: dict[str, dict[str, float]] = {check: {} for check in judged}
    for key, by_name in followed.slopes.items():
        changed = neighbour(scene, key, STEP)
        above = (base(changed) - base(scene)) / STEP
        start = (changed.initial_temperature - scene.initial_temperature) / STEP
        for name in names:
            three_of = steady[key].get(name)
            if name not in by_name or three_of is None or three_of.fem3d is None:
                continue
            change = float(np.interp(tops[name], times, by_name[name])) if times is not None else float(by_name[name])
            if model_rises[name]:
                slope = (change - above * thermal[name]) / model_rises[name]
                steady[key][name] = Slope(three_of.fem3d, slope)
            check = judged.get(f"{name}{OVER_TIME}" if over_time else name)
            if check is None or not np.isfinite(check.difference):
                continue
            largest = three_of.fem3d.value * sensitivities.values[name].value
            s, m = largest + above * thermal[name], change
            if times is not None and sensitivities.course is not None:
                if name not in sensitivities.course.fem3d.get(key, {}):
                    continue
                course = np.interp(check.time or 0.0, sensitivities.course.times, sensitivities.course.fem3d[key][name])
                s, m = float(course) + start * thermal[name], float(np.interp(check.time or 0.0, times, by_name[name]))
            scale = sensitivities.values[name].value
            if not over_time:
                scale = in_3d.steady[name].value - scene.initial_temperature * thermal[name]
                largest += (above - start) * thermal[name]
            moved[check.id][key] = (m - s) / scale - check.difference * largest / scale
    values = {name: Estimate(value, 0.0) for name, value in model_rises.items()}
    return replace(
        sensitivities, steady=steady, of_model=values, left_out=sensitivities.left_out | followed.left_out, moved=moved
    )


def judged(checks: Sequence[Check], propagated: Propagated) -> tuple[Check, ...]:
    """The checks with their u_input, where what they change by is known for every uncertain key."""
    keys, moved = list(propagated.uncertain.relative), propagated.sensitivities.moved
    covariance, made = propagated.uncertain.covariance(), []
    for check in checks:
        slopes = moved.get(check.id, {})
        known = all(key in slopes for key in keys)
        made.append(
            replace(check, u_input=combined(np.array([slopes[k] for k in keys]), covariance)) if known else check
        )
    return tuple(made)


def _top(scene: AnyScene, fem3d: Result, name: str) -> float:
    """The time (s) at which a 3D quantity is largest, a temperature above the start, once its errors hold."""
    traces = fem3d.over_time
    late = traces.sure(traces.time)
    initial = next(
        (scene.initial_temperature for p in scene.probes if p.name == name and p.quantity == "temperature"), 0.0
    )
    return float(traces.time[late][np.abs(traces.values[name][late] - initial).argmax()])
