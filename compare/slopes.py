"""How the quantities of a model follow the keys of its scene: d Q / d ln key.

Steady slopes are logarithmic, d ln Q / d ln key, and of rises where Q is a temperature. Slopes of traces are in the
unit of the trace. To first order (GUM 5.2.2) uncertain keys of covariance C make u^2 = s^T C s of a quantity.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compare.models import Model
from compare.verdict import PAPERS
from scenes.device import Device
from scenes.errors import SceneError
from scenes.model import AnyScene
from scenes.parameters import SECTION
from scenes.result import Estimate, Result
from scenes.sink import Sink
from scenes.uncertain import Uncertain
from scenes.varied import neighbour, numbers

STEP = 1e-4
"""Relative step of a key in central differences; the relative error of a difference is the square of it."""
BESIDE = 1e-3, 2e-2
"""Relative steps of a key: for a user's own model without noise, and for one with noise of up to 1e-4 of its values."""
BENT = 0.1
"""A key has no slope where the relative slope jumps by more than this at its value: a network jumps where another side
of a box becomes its longest."""

ByKey = dict[str, dict[str, Estimate]]
Course = dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Slopes:
    """How one model follows the keys of its scene.

    Attributes
    ----------
    sizes : value that each quantity has, of temperatures the rise; of a transient the largest
    relative : d ln Q / d ln key by key and quantity
    shift : d base / d ln key (K) by key and quantity or trace, where the base is the temperature that rises count from
    steady : whether ``sizes`` are of the steady state; else they are of the largest size of each trace
    times, traces : (n,) s; d trace / d ln key (n,) by key and trace, in the trace's unit, of temperatures of the rise
    rises : (n,) by trace, of temperatures the rise; none of a user's own model
    left_out : reason why a key or a quantity has none
    profile : (places,) d rise / d ln key along a sink's profile, by key, where it is followed
    """

    sizes: dict[str, float]
    relative: ByKey
    shift: dict[str, dict[str, float]] = field(default_factory=dict)
    steady: bool = True
    times: np.ndarray | None = None
    traces: Course = field(default_factory=dict)
    rises: Mapping[str, np.ndarray] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    profile: dict[str, np.ndarray] = field(default_factory=dict)

    def vectors(self, keys: Collection[str]) -> dict[str, np.ndarray]:
        """Return (keys,): the logarithmic slopes by quantity, where all keys have slopes."""
        by_key = [self.relative.get(key, {}) for key in keys]
        common = [name for name in self.sizes if all(name in slopes for slopes in by_key)]
        return {name: np.array([slopes[name].value for slopes in by_key]) for name in common}

    def at(self, key: str, name: str, times: np.ndarray) -> np.ndarray:
        """(times,): d Q / d ln key in the unit of the trace, or of the steady value at infinite time; else NaN."""
        if np.isinf(times[-1]):
            slope = self.relative.get(key, {}).get(name)
            if slope is None or not self.steady:
                return np.full(len(times), np.nan)
            return np.array([slope.value * self.sizes[name] + self.shift.get(key, {}).get(name, 0.0)])
        if self.times is None or name not in self.traces.get(key, {}):
            return np.full(len(times), np.nan)
        return np.interp(times, self.times, self.traces[key][name]) + self.shift.get(key, {}).get(name, 0.0)

    def columns(self, model: str) -> dict[str, np.ndarray]:
        """Return the columns of sensitivities.csv: time_s, then <model>_<quantity>_by_<key>, beside a steady state
        relative to the rises."""
        if self.times is None or not self.rises:
            return {}
        columns = {"time_s": self.times}
        for key, by_name in self.traces.items():
            for name, slope in by_name.items():
                size = self.rises[name] if self.steady else np.ones(1)
                columns[f"{model}_{name}_by_{key}"] = np.divide(slope, size, out=np.zeros_like(slope), where=size != 0)
        return columns

    def over_time(self, name: str, times: np.ndarray, uncertain: Uncertain) -> np.ndarray:
        """(times,): u_input of a trace, or of the steady value at infinite time."""
        slopes = np.array([self.at(key, name, times) for key in uncertain.relative])
        return np.sqrt(np.maximum(np.einsum("it,ij,jt->t", slopes, uncertain.covariance(), slopes), 0.0))

    def moved(self, result: Result, key: str, step: float) -> Result:
        """A result as it is, to first order, with one key larger by a relative step; NaN without a slope."""
        at_rest = np.array([np.inf])
        steady = {
            name: Estimate(e.value + step * float(self.at(key, name, at_rest)[0]), e.error)
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

    def largest(self, name: str) -> float:
        """Return the largest slope of a quantity by any key.

        Temperatures are left out, because a percent of kelvins means little, and parameters, whose slopes are sums.
        """
        keys = [key for key in self.relative if not key.endswith("_temperature") and not key.startswith(f"{SECTION}.")]
        return max((abs(self.relative[key][name].value) for key in keys if name in self.relative[key]), default=0.0)


def combined(slopes: Sequence[float] | np.ndarray, uncertain: Uncertain) -> float:
    """Return the root of s^T C s, with the covariance C of uncertain keys."""
    return float(np.sqrt(max(slopes @ uncertain.covariance() @ np.asarray(slopes), 0.0)))


def remarks(slopes: Mapping[str, Slopes]) -> tuple[str, ...]:
    """A sentence for each reason why keys or quantities have no slope."""
    left_out = {name: why for each in slopes.values() for name, why in each.left_out.items()}
    together = {why: [name for name, other in left_out.items() if other == why] for why in left_out.values()}
    return tuple(f"no sensitivity to or of {', '.join(names)}: {why}" for why, names in together.items())


def in_3d(scene: Any, result: Result, keys: Sequence[str] | None = None, profile: bool = False) -> Slopes:
    """Return the slopes of a 3D result of a sink, with ``profile`` also along the beam, or of a free scene solved
    whole. Raises NumericsError."""
    from fem3d.runs import sensitivities

    if scene.kind == "sink":
        found = sensitivities.of_sink(scene, result, keys, profile)
        values, steady = result.steady, True
        thermal = [name for name in (result.traces.values if result.traces else ()) if name.endswith("_K")]
    else:
        found = sensitivities.of_scene(scene, result, keys)
        values, steady, thermal = found.values, found.course is None, thermal_probes(scene)
    shift = {key: dict.fromkeys(thermal, base_moves(scene, key, steady)) for key in found.steady}
    slopes = Slopes(
        {name: e.value for name, e in values.items()}, dict(found.steady), shift, steady,
        left_out=found.left_out, profile=found.profile,
    )  # fmt: skip
    if (course := found.course) is None:
        return slopes
    return replace(slopes, times=course.times, traces=course.values, rises=course.traces)


def thermal_probes(scene: AnyScene) -> list[str]:
    """Return the names of the probes of temperatures."""
    return [probe.name for probe in scene.probes if probe.quantity == "temperature"]


def central(
    solve: Callable[[Any], Mapping[str, Any]], scene: Any, keys: Iterable[str]
) -> dict[str, dict[str, Any]]:  # fmt: skip
    """Return d Q / d ln key by key and quantity of a model that is solved to rounding, by central differences."""
    slopes = {}
    for key in keys:
        more, less = (solve(neighbour(scene, key, step)) for step in (STEP, -STEP))
        slopes[key] = {name: (value - less[name]) / (2 * STEP) for name, value in more.items()}
    return slopes


def _exact(sizes: dict[str, float], slopes: Mapping[str, Mapping[str, float]]) -> Slopes:
    """Logarithmic slopes without error; quantities that are zero have none."""
    relative = {k: {n: Estimate(v / sizes[n], 0.0) for n, v in by.items() if sizes.get(n)} for k, by in slopes.items()}
    return Slopes(sizes, relative)


def sink_1d(sink: Sink, result: Result, times: np.ndarray | None, keys: Sequence[str] | None = None) -> Slopes:
    """Return the slopes of a 1D model of the ladder by all or some keys.

    Traces, at times (s), have slopes in the paper's model only, as another one costs a plate for each key.
    """
    from reduced1d import ladder

    name, chosen = "paper" if result.model in PAPERS else result.model, keys or numbers(sink)
    thermal = [n for n in (result.traces.values if result.traces else ()) if n.endswith("_K")]

    def at_rest(changed: Sink) -> dict[str, float]:
        return {n: e.value for n, e in ladder.solve(changed, name, steady_only=True).steady.items()}

    def rises(changed: Sink) -> dict[str, np.ndarray]:
        traces = ladder.solve(changed, name, times=times).over_time.values
        return {n: v - changed.room_temperature * (n in thermal) for n, v in traces.items()}

    slopes = _exact({n: e.value for n, e in result.steady.items()}, central(at_rest, sink, chosen))
    if name != "paper" or times is None or result.traces is None:
        return slopes
    shift = {key: dict.fromkeys(thermal, base_moves(sink, key, False)) for key in chosen}
    return replace(slopes, shift=shift, times=times, traces=central(rises, sink, chosen), rises=rises(sink))


def base_moves(scene: Any, key: str, steady: bool) -> float:
    """d base / d ln key (K): rises count from the room, the coldest given temperature, or over time the start."""
    other = neighbour(scene, key, STEP)
    if scene.kind == "sink":
        return float(other.room_temperature - scene.room_temperature) / STEP
    if not steady:
        return float(other.initial_temperature - scene.initial_temperature) / STEP
    from fem3d.runs.sensitivities import floor_of

    return (floor_of(scene, other) - floor_of(scene, scene)) / STEP


def device_1d(device: Device, result: Result) -> Slopes:
    """Return the slopes of the device's steady state in 1D."""
    from reduced1d.device.lumped import steady

    sizes = {name: e.value for name, e in result.steady.items()}

    def at_rest(changed: Device) -> dict[str, float]:
        state = steady(changed)
        return {name: getattr(state, name) for name in sizes}

    return _exact(sizes, central(at_rest, device, numbers(device)))


def own_model(
    model: Model, scene: Any, result: Result, keys: Iterable[str], fem3d: Result, in_3d: Slopes | None
) -> Slopes:
    """Return the slopes of a user's own model, by differences.

    Logarithmic slopes of a free scene over time are at the instant at which the 3D quantity ``in_3d`` is largest.
    """
    chosen, course, times, steady = list(keys), result.traces, None, in_3d is None or in_3d.steady
    left_out, values, changes, traces = dict[str, str](), dict[str, float](), Course(), Course()
    shift, base = dict[str, dict[str, float]](), 0.0
    if thermal := thermal_probes(scene) if scene.kind == "free" else []:
        from fem3d.runs.sensitivities import floor_of

        base = floor_of(scene, scene) if steady else scene.initial_temperature
        shift = {key: dict.fromkeys(thermal, base_moves(scene, key, steady)) for key in chosen}

    def followed(times: np.ndarray | None) -> Course:
        absolute = follow(model, scene, chosen, times, fem3d, left_out)
        return {k: {n: v - shift.get(k, {}).get(n, 0.0) for n, v in by.items()} for k, by in absolute.items()}

    if steady:
        values = {name: e.value for name, e in result.steady.items()}
        changes = followed(None) if values else {}
    if course is not None:
        times = course.time[course.time > 0]
        traces = followed(times)
    if course is not None and times is not None and in_3d is not None and in_3d.times is not None and not steady:
        largest = {
            name: in_3d.times[np.abs(in_3d.rises[name]).argmax()] for name in course.values if name in in_3d.sizes
        }
        values = {name: float(np.interp(time, course.time, course.values[name])) for name, time in largest.items()}
        changes = {k: {n: np.interp(largest[n], times, by[n]) for n in largest if n in by} for k, by in traces.items()}
    values = {name: value - base * (name in thermal) for name, value in values.items()}
    relative = {k: {n: float(v) for n, v in by.items() if n in values} for k, by in changes.items()}
    slopes = _exact({name: value for name, value in values.items() if value}, relative)
    return replace(slopes, shift=shift, steady=steady, times=times, traces=traces, left_out=left_out)


def follow(
    model: Model, scene: Any, keys: Iterable[str], times: np.ndarray | None, fem3d: Result, left_out: dict[str, str]
) -> Course:
    """Return d Q / d ln key of a model by key and quantity, each (times,), or one number in the steady state.

    ``times`` (s) end with the run. Central differences of order h^4 bear the noise of a model. Keys without a slope,
    and the reasons, are put into ``left_out``: if a slope jumps by s at the value itself, the second difference over h
    is s h + c h^2, and 2 s h + 4 c h^2 over 2h.
    """
    from compare.models.sampling import make_question

    def at(key: str, step: float) -> Mapping[str, np.ndarray]:
        question = make_question(neighbour(scene, key, step) if step else scene, fem3d)
        return model.answer(question, times).at(times).values

    slopes, base, h = Course(), at("", 0.0), BESIDE[0] if model.exact else BESIDE[1]
    for key in keys:
        try:
            (less, more), (far_less, far_more) = ((at(key, -step), at(key, step)) for step in (h, 2 * h))
        except SceneError as error:
            left_out[key] = f"{model.name} has no answer beside it ({error})"
            continue
        bends = {n: 4 * (more[n] + less[n]) - far_more[n] - far_less[n] - 6 * value for n, value in base.items()}
        if any(np.abs(bend).max() > 2 * h * BENT * np.abs(base[n]).max() for n, bend in bends.items()):
            left_out[key] = f"{model.name} is not differentiable at this value"
            continue
        slopes[key] = {n: (8 * (more[n] - less[n]) - (far_more[n] - far_less[n])) / (12 * h) for n in base}
    return slopes
