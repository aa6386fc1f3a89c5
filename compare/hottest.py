"""Find the hottest temperature of each material, and warn where it exceeds the material's limit."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from reduced1d.equations import anchor_series_resistance, end_rise_from_equivalent
from scenes import physics
from scenes.device import Device
from scenes.model import Material
from scenes.result import Result, Traces
from scenes.sink import Sink
from scenes.units import TIME
from statespace.result import DeviceResult


class Hottest(NamedTuple):
    """The hottest temperature (K) of a material, and its time (s), None in the steady state."""

    material: Material
    top: float
    time: float | None = None

    @property
    def excess(self) -> float:
        """The temperature less the limit of the material (K); negative without a limit."""
        return -np.inf if self.material.valid_to is None else self.top - self.material.valid_to


def reached(scene: Any, result: Result) -> list[Hottest]:
    """Return the hottest temperatures of a sink or a free scene in 3D, as `of_fields` does, or of a sink in 1D."""
    if isinstance(scene, Sink):
        # Nothing is hotter than the peak, and a step's response nowhere hotter than the steady state.
        peak = scene.room_temperature + result.steady["peak_rise_K"].value
        if "fields" not in result.details:
            return [Hottest(scene.silicon, peak)]
        return of_fields(scene.materials, result.details["fields"], np.empty(0), peak)
    if not physics.heat(scene):
        return []
    return of_fields(physics.materials(scene), result.details["fields"], moments(result.traces))


def of_fields(
    materials: Iterable[Material], fields: Any, times: np.ndarray, ceiling: float | None = None
) -> list[Hottest]:
    """Return the hottest place and moment of each material that has a limit.

    Fields are of the steady state, if there is one, and of some times (s). They are not sampled where the ``ceiling``
    (K) of all temperatures is below every limit; then the list has the ceiling and the material of the lowest limit.
    """
    limits = {m: m.valid_to for m in materials if m.valid_to is not None and m.name in fields.material_names}
    if not limits:
        return []
    lowest = min(limits, key=lambda m: limits[m])
    if ceiling is not None and ceiling <= limits[lowest]:
        return [Hottest(lowest, ceiling)]
    at = {m: np.unique(fields.cells[fields.material == fields.material_names.index(m.name)]) for m in limits}
    states = chain([(None, fields.steady)] if fields.has_steady else [], snapshots(fields, times))
    found = [[Hottest(m, float(T[at[m]].max(initial=-np.inf)), time) for m in limits] for time, T in states]
    return [max(each, key=lambda hottest: hottest.top) for each in zip(*found, strict=True)]


def of_device(device: Device, result: DeviceResult) -> list[Hottest]:
    """Return the hottest temperatures of a device's run in 1D; the beam's middle follows from eqs 13 and 18."""
    sink, times, external = device.sink, result.time_s, device.external
    mean, k = result.sink_K - sink.room_temperature, sink.silicon.thermal_conductivity
    end = end_rise_from_equivalent(mean, anchor_series_resistance(sink), k, sink.cross_section, sink.length)
    outside = np.where(times < external.step_time, external.initial_temperature, external.final_temperature)
    hottest = {
        sink.silicon: sink.room_temperature + end + 1.5 * (mean - end), device.gold: result.sensor_K,
        device.pdms: np.max([result.sink_K, result.sensor_K, outside], axis=0),
    }  # fmt: skip
    return [Hottest(m, float(T.max()), float(times[T.argmax()])) for m, T in hottest.items()]


def warnings(found: Sequence[Hottest]) -> tuple[str, ...]:
    """Return a sentence for each material that exceeds its limit."""
    said = []
    for material, top, time in (each for each in found if each.excess > 0):
        when = "in the steady state" if time is None else f"at {TIME.show(float(f'{time:.3g}'))}"
        said.append(
            f"{material.name} reaches {top:,.0f} K {when}, past the {material.valid_to:,.0f} K of its valid_to, "
            "where it softens, melts or decomposes: what is computed beyond that describes no real part"
        )
    return tuple(said)


def moments(traces: Traces | None) -> np.ndarray:
    """Return up to 100 times (s) spread over the rows of traces, with the times of all extremes."""
    if traces is None:
        return np.empty(0)
    rows = np.linspace(0, len(traces.time) - 1, min(100, len(traces.time))).astype(int)
    ends = [k for values in traces.values.values() for k in (int(values.argmax()), int(values.argmin()))]
    return np.asarray(np.unique(traces.time[np.concatenate([rows, ends])]))


def snapshots(fields: Any, times: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield times and their fields, a few of which are computed together to bound the memory."""
    for some in np.array_split(times, len(times) // 16 + 1):
        yield from zip(some.tolist(), fields.at(some) if len(some) else (), strict=True)
