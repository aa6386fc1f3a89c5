"""How the quantities of a model follow the keys of its scene: d Q / d ln key.

Steady slopes are logarithmic, d ln Q / d ln key, and of rises where Q is a temperature. Slopes of traces are in the
unit of the trace. To first order (GUM 5.2.2) uncertain keys of covariance C make u^2 = s^T C s of a quantity.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from compare.models.model import Model, make_question
from compare.quantities import AT_REST
from compare.verdict import PAPER
from reduced1d.differences import Solve, Table, follow, of_device, of_ladder
from scenes.device import Device
from scenes.result import Estimate, Result
from scenes.sink import OF_A_SINK, Sink
from scenes.uncertain import Uncertain
from scenes.varied import neighbour, numbers


@dataclass(frozen=True, eq=False)
class Slopes:
    """How one model follows the keys of its scene.

    Attributes
    ----------
    sizes : value that each quantity has, of temperatures the rise; of a transient the largest
    relative : d ln Q / d ln key by key and quantity
    shift : d base / d ln key (K) by key and temperature, where the base is the temperature that rises count from
    steady : whether ``sizes`` are of the steady state; else they are of the largest size of each trace
    times, traces : (n,) s; d trace / d ln key (n,) by key and trace, in the trace's unit, of temperatures of the rise
    left_out : reason why a key or a quantity has none
    profile : (places,) d rise / d ln key along a sink's profile, by key, where it is followed
    """

    sizes: dict[str, float]
    relative: dict[str, dict[str, Estimate]]
    shift: dict[str, dict[str, float]] = field(default_factory=dict)
    steady: bool = True
    times: np.ndarray = field(default_factory=lambda: np.empty(0))
    traces: Table = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    profile: dict[str, np.ndarray] = field(default_factory=dict)

    def at(self, key: str, name: str, times: np.ndarray) -> np.ndarray:
        """(times,): d Q / d ln key in the unit of the trace, or of the steady value at infinite time; else NaN."""
        shift, missing = self.shift.get(key, {}).get(name, 0.0), np.full(len(times), np.nan)
        if not np.isinf(times[-1]):
            slope = self.traces.get(key, {}).get(name)
            return missing if slope is None else np.interp(times, self.times, slope) + shift
        relative = self.relative.get(key, {}).get(name)
        return missing if relative is None or not self.steady else np.array([relative.value * self.sizes[name] + shift])

    def moved(self, result: Result, key: str, step: float) -> Result:
        """A result as it is, to first order, with one key larger by a relative step; NaN without a slope."""
        steady = {
            name: Estimate(e.value + step * float(self.at(key, name, AT_REST)[0]), e.error)
            for name, e in result.steady.items()
        }
        traces = result.traces
        if traces is not None:
            values = {n: v + step * self.at(key, n, traces.time) for n, v in traces.values.items()}
            traces = replace(traces, values=values)
        details = result.details
        if self.profile:
            rise = details["profile"]["rise_K"] + step * self.profile.get(key, np.nan)
            details = details | {"profile": details["profile"] | {"rise_K": rise}}
        return replace(result, steady=steady, traces=traces, details=details)


def combined(slopes: Sequence[Any] | np.ndarray, uncertain: Uncertain) -> np.ndarray:
    """Return the root of s^T C s for slopes s (keys, ...), with the covariance C of uncertain keys."""
    s = np.array(slopes)
    return np.sqrt(np.maximum(np.einsum("i...,ij,j...", s, uncertain.covariance(), s), 0.0))


def remarks(slopes: Mapping[str, Slopes]) -> tuple[str, ...]:
    """A sentence for each reason why keys or quantities have no slope."""
    together = dict[str, dict[str, None]]()
    for name, why in (item for each in slopes.values() for item in each.left_out.items()):
        together.setdefault(why, {})[name] = None
    return tuple(f"no sensitivity to or of {', '.join(names)}: {why}" for why, names in together.items())


def in_3d(scene: Any, result: Result, keys: Sequence[str] | None = None, profile: bool = False) -> Slopes:
    """Return the slopes of a 3D result of a sink, with ``profile`` also along the beam, or of a free scene solved
    whole. Raises NumericsError."""
    from fem3d.runs.sensitivities import of_scene, of_sink

    is_sink = scene.kind == "sink"
    found = of_sink(scene, result, keys, profile) if is_sink else of_scene(scene, result, keys)
    course, steady = found.course, is_sink or found.course is None
    times, traces = (np.empty(0), {}) if course is None else (course.times, course.values)
    sizes, shift = {name: e.value for name, e in found.values.items()}, shifts(scene, found.steady, steady)
    return Slopes(sizes, dict(found.steady), shift, steady, times, traces, found.left_out, found.profile)


def base_of(scene: Any, steady: bool) -> tuple[list[str], Callable[[Any], float]]:
    """Return the temperatures of a scene, and the function of a changed scene (K) from which their rises count.

    Rises count from the room of a sink, the coldest given temperature, or over time the start. The controllers of a
    device give its temperatures.
    """
    if scene.kind == "device":
        return [], lambda _: 0.0
    if scene.kind == "sink":
        return [each.trace for each in OF_A_SINK.values() if each.trace.endswith("_K")], attrgetter("room_temperature")
    thermal = [probe.name for probe in scene.probes if probe.quantity == "temperature"]
    if not steady:
        return thermal, attrgetter("initial_temperature")
    from fem3d.runs.sensitivities import floor_of

    return thermal, partial(floor_of, scene)


def shifts(scene: Any, keys: Iterable[str], steady: bool) -> dict[str, dict[str, float]]:
    """Return d base / d ln key (K) by key and temperature."""
    (thermal, base), h = base_of(scene, steady), 1e-4
    return {key: dict.fromkeys(thermal, (base(neighbour(scene, key, h)) - base(scene)) / h) for key in keys}


def sink_1d(sink: Sink, result: Result, times: np.ndarray | None, keys: Sequence[str] | None = None) -> Slopes:
    """Return the slopes of a 1D model of the ladder by all or some keys.

    Traces, at times (s), have slopes in the paper's model only, as another one costs a plate for each key.
    """
    over_time = result.model == PAPER and result.traces is not None
    return in_1d(of_ladder(result.model), sink, result, keys or numbers(sink), times if over_time else None)


def device_1d(device: Device, result: Result) -> Slopes:
    """Return the slopes of the device's steady state in 1D."""
    return in_1d(of_device(result.steady), device, result, numbers(device), None)


def own_model(model: Model, scene: Any, result: Result, keys: Iterable[str], fem3d: Result) -> Slopes:
    """Return the slopes of a user's own model of the scene of a 3D result."""

    def solve(changed: Any, times: np.ndarray | None) -> Mapping[str, Any]:
        values = model.ask(make_question(changed, fem3d, times)).values
        return {name: v[0] for name, v in values.items()} if times is None else values

    times = None if result.traces is None else result.traces.time[result.traces.time > 0]
    # A program may have noise of up to 1e-4 of its values.
    return in_1d(solve, scene, result, keys, times, 1e-3 if model.exact else 2e-2)


def in_1d(
    solve: Solve, scene: Any, result: Result, keys: Iterable[str], times: np.ndarray | None, h: float = 1e-3
) -> Slopes:
    """Return the slopes of the result of a 1D model, of its traces at ``times`` (s); quantities that are zero have
    none.

    Logarithmic slopes of a free scene over time are at the instant at which the quantity is largest.
    """
    chosen, steady = list(keys), scene.kind == "sink" or times is None
    thermal, base = base_of(scene, steady)

    def rises(changed: Any, times: np.ndarray | None) -> Mapping[str, Any]:
        return {n: v - base(changed) * (n in thermal) for n, v in solve(changed, times).items()}

    traces, left_out = ({}, {}) if times is None else follow(rises, scene, chosen, times, h)
    if steady:
        values = {name: e.value - base(scene) * (name in thermal) for name, e in result.steady.items()}
        changes, silent = follow(rises, scene, chosen, None, h) if values else ({}, {})
        left_out = left_out | silent
    else:
        over_time = rises(scene, times)
        largest = {name: int(np.abs(rise).argmax()) for name, rise in over_time.items()}
        values = {name: float(rise[largest[name]]) for name, rise in over_time.items()}
        changes = {key: {name: slope[largest[name]] for name, slope in by.items()} for key, by in traces.items()}
    sizes, times = {name: size for name, size in values.items() if size}, np.empty(0) if times is None else times
    relative = {k: {n: Estimate(float(by[n] / sizes[n]), 0.0) for n in by if n in sizes} for k, by in changes.items()}
    return Slopes(sizes, relative, shifts(scene, chosen, steady), steady, times, traces, left_out)
