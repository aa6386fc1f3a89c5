"""Find the hottest temperature of each material, and warn where it exceeds the material's limit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from reduced1d.equations import anchor_series_resistance, end_rise_from_equivalent
from scenes.device import Device
from scenes.model import AnyScene, Material
from scenes.result import Result, Traces
from scenes.sink import Sink
from scenes.units import TIME
from statespace.result import DeviceResult

MOST = 100
"""Instants of a transient that are searched, beside those at which a trace is largest or smallest."""


Hottest = tuple[float, float | None]
"""A temperature (K) and its time (s); None in the steady state."""


def of_sink(sink: Sink, fem3d: Result | None, reduced1d: Result | None) -> tuple[str, ...]:
    """Return the warnings of a sink's run, of 3D where it is solved; 1D has the silicon's peak alone."""
    if fem3d is not None:
        return past(sink.materials, fem3d.details["fields"], moments(fem3d.traces))
    if reduced1d is None:
        return ()
    # A step's response is nowhere hotter than the steady state.
    peak = sink.room_temperature + reduced1d.steady["peak_rise_K"].value
    return warnings([sink.silicon], {sink.silicon.name: (peak, None)})


def of_device(device: Device, result: DeviceResult) -> tuple[str, ...]:
    """Return the warnings of a device's run in 1D; the beam's middle follows from eqs 13 and 18."""
    sink, times, external = device.sink, result.time_s, device.external
    mean, k = result.sink_K - sink.room_temperature, sink.silicon.thermal_conductivity
    end = end_rise_from_equivalent(mean, anchor_series_resistance(sink), k, sink.cross_section, sink.length)
    outside = np.where(times < external.step_time, external.initial_temperature, external.final_temperature)
    hottest = {
        sink.silicon: sink.room_temperature + end + 1.5 * (mean - end), device.gold: result.sensor_K,
        device.pdms: np.max([result.sink_K, result.sensor_K, outside], axis=0),
    }  # fmt: skip
    return warnings(hottest, {m.name: (float(T.max()), float(times[T.argmax()])) for m, T in hottest.items()})


def excess(
    materials: Sequence[Material], ceiling: float, fields: Callable[[], Any], times: np.ndarray
) -> tuple[float, str]:
    """Return by how much (K) a 3D run exceeds a material's valid_to at most, and the material.

    Below every limit the name is empty and the number negative. The ``fields`` at some times (s) are computed only
    where the ``ceiling`` (K) of all temperatures exceeds a limit.
    """
    limits = {m.name: m.valid_to for m in materials if m.valid_to is not None}
    if ceiling <= (lowest := min(limits.values(), default=float("inf"))):
        return ceiling - lowest, ""
    reached = by_material(fields(), times)
    most, name = max((reached[name][0] - limit, name) for name, limit in limits.items() if name in reached)
    return most, name if most > 0 else ""


def past(materials: Sequence[Material], fields: Any, times: np.ndarray) -> tuple[str, ...]:
    """Return the warnings of a 3D run."""
    limited = any(m.valid_to is not None for m in materials)
    return warnings(materials, by_material(fields, times)) if limited else ()


def impossible(scene: AnyScene, result: Result) -> tuple[str, ...]:
    """Return a sentence where a probe is below absolute zero, because more heat is drawn than enters."""
    for name in (probe.name for probe in scene.probes if probe.quantity == "temperature"):
        tops = [result.steady[name].value + result.steady[name].error] if name in result.steady else []
        if (traces := result.traces) is not None:
            tops.append(float((traces.values[name] + traces.errors[name]).min()))
        if min(tops) < 0:
            return (
                f"{name} reaches {min(tops):,.0f} K, below absolute zero: more heat is drawn out than comes in; look "
                "at the fluxes and their signs",
            )
    return ()


def warnings(materials: Iterable[Material], reached: Mapping[str, Hottest]) -> tuple[str, ...]:
    """Return a sentence for each material that exceeds its limit."""
    sentences = []
    for m in dict.fromkeys(materials):
        top, time = reached.get(m.name, (0.0, None))
        if m.valid_to is not None and top > m.valid_to:
            when = "in the steady state" if time is None else f"at {TIME.show(float(f'{time:.3g}'))}"
            sentences.append(
                f"{m.name} reaches {top:,.0f} K {when}, past the {m.valid_to:,.0f} K of its valid_to, "
                "where it softens, melts or decomposes: what is computed beyond that describes no real part"
            )
    return tuple(sentences)


def moments(traces: Traces | None) -> np.ndarray:
    """Return times (s) spread over the rows of traces, with the times of all extremes."""
    if traces is None:
        return np.empty(0)
    rows = np.linspace(0, len(traces.time) - 1, min(MOST, len(traces.time))).astype(int)
    ends = [k for values in traces.values.values() for k in (int(values.argmax()), int(values.argmin()))]
    return np.asarray(np.unique(traces.time[np.concatenate([rows, ends])]))


def by_material(fields: Any, times: np.ndarray) -> dict[str, Hottest]:
    """The hottest place and moment of each material: of the steady state, if there is one, and of some times (s)."""
    corners = {name: np.unique(fields.cells[fields.material == k]) for k, name in enumerate(fields.material_names)}
    hottest: dict[str, Hottest] = {}
    for time, temperatures in chain([(None, fields.steady)] if fields.has_steady else [], _snapshots(fields, times)):
        for name, at in corners.items():
            top = float(temperatures[at].max(initial=-np.inf))
            if name not in hottest or top > hottest[name][0]:
                hottest[name] = top, time
    return hottest


def farthest(fields: Any, times: np.ndarray, initial: float) -> tuple[float, bool]:
    """The time (s) at which the field is farthest from its ``initial`` temperature (K) anywhere, and whether above."""
    ends = [(time, float(T.max()) - initial, initial - float(T.min())) for time, T in _snapshots(fields, times)]
    time, above, below = max(ends, key=lambda each: max(each[1:]))
    return time, above >= below


def _snapshots(fields: Any, times: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield times and their fields, a few of which are computed together to bound the memory."""
    for some in np.array_split(times, len(times) // 16 + 1):
        yield from zip(some.tolist(), fields.at(some) if len(some) else (), strict=True)
