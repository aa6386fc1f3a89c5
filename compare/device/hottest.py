"""How hot the materials of a device get over a run of it."""

from __future__ import annotations

import numpy as np

from compare.hottest import Hottest, warnings
from compare.painted import Reduction
from reduced1d.equations import end_rise_from_equivalent
from reduced1d.sink import anchor_series_resistance
from scenes.device import Device
from scenes.loop.result import DeviceResult


def too_hot(device: Device, result: DeviceResult) -> tuple[str, ...]:
    """The warnings of a run; the beam's middle is above its equivalent temperature, by eqs 13 and 18."""
    sink, times = device.sink, result.time_s
    mean = result.sink_K - sink.room_temperature
    resistance = anchor_series_resistance(sink)
    end = end_rise_from_equivalent(
        mean, resistance, sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    )  # fmt: skip
    peak = end + 1.5 * (mean - end)
    hot = int(np.argmax(peak))
    beam = Reduction(sink, (float(end[hot]), float(peak[hot])), *[np.empty(0)] * 3).hottest()
    reached = {name: Hottest(found.temperature, float(times[hot])) for name, found in beam.items()}
    external = device.external
    outside = np.where(times < external.step_time, external.initial_temperature, external.final_temperature)
    for name, trace in (
        (device.gold.name, result.sensor_K),
        (device.pdms.name, np.maximum(np.maximum(result.sink_K, result.sensor_K), outside)),
    ):
        k = int(np.argmax(trace))
        reached[name] = Hottest(float(trace[k]), float(times[k]))
    return tuple(warnings((sink.silicon, sink.oxide, device.gold, device.pdms), reached))
