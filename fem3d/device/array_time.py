"""Over time what a step outside of one element of an array of devices does to the sensor of a neighbour.

The heat of the element's step spreads through the plate (`fem3d.runs.plate_time`), and the sampled loops of all others
answer with their responses to a warmer plate (`scenes.loop.array`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d.device.solve import Model
from fem3d.runs.array import plate_of
from fem3d.runs.plate_time import warming
from scenes.array import DeviceArray, driven, places
from scenes.device import Device
from scenes.loop.array import Paths, after, at_work, course, times
from scenes.loop.march import Resolution
from scenes.loop.shielding import without_sink


@dataclass(frozen=True, eq=False)
class Over:
    """Over the time ``time_s`` since a step outside of element ``stepped`` by 1 K: how much warmer the plate is under
    element ``read`` (K/K), and what has been added to the power of its sensor (W/K), with the error of the latter."""

    stepped: int
    read: int
    time_s: np.ndarray
    plate_rise: np.ndarray
    sensor_power: np.ndarray
    error: float

    @property
    def largest(self) -> tuple[float, float]:
        """The sensor's largest change (W/K), and when (s)."""
        at = int(np.abs(self.sensor_power).argmax())
        return float(self.sensor_power[at]), float(self.time_s[at])


def nearest(array: DeviceArray, plate: np.ndarray) -> tuple[int, int]:
    """The elements (numbers from 0), one about the middle and the one at work that its heat warms most."""
    middle = array.sink.rows // 2 * array.sink.columns + array.sink.columns // 2
    reading = [k - 1 for k in driven(array.sink) if k - 1 != middle]
    return middle, max(reading, key=lambda k: float(plate[k, middle])) if reading else middle


def paths(array: DeviceArray, plate: np.ndarray) -> Paths | None:
    """Those from an element to the one whose sensor it warms most, directly and by all others; none where no other is
    at work. ``plate`` (elements, elements) in K/W is that at rest."""
    stepped, read = nearest(array, plate)
    if stepped == read:
        return None
    first, other = (_spread(array, k, plate[:, k]) for k in (stepped, read))
    on = at_work(array)
    back = [after(other[kind], first[kind]).sum(axis=0) for kind in (~on, on)]
    return Paths(stepped, read, first[read], np.array(back))


def over_time(array: DeviceArray, states: Model, through: Paths, plate: np.ndarray, known: float) -> tuple[Over, ...]:
    """What a step outside of an element does to another's sensor, loops closed and sinks off; the ``plate`` may be off
    by the part ``known``."""
    element = array.element
    return tuple(_over(array, states, each, through, plate, known) for each in (element, without_sink(element)))


def _over(array: DeviceArray, states: Model, device: Device, through: Paths, plate: np.ndarray, known: float) -> Over:
    fine, low, fewer = (
        course(array, Resolution(modal.on_top_of_plate(), states.nodes), device, through, plate)
        for modal in (states.fine, states.low, states.fewer)
    )
    power, most = fine.sensor_power, np.abs(fine.sensor_power).max()
    # What a sample's length leaves in both sums: of what bends within one, and half of it as late as a path is short.
    steep = np.abs(np.diff(through.direct)).max() / max(np.abs(through.direct).max(), 1e-300)
    bent = np.abs(np.diff(power, n=2, prepend=[0.0, 0.0])).max() + steep / 2 * np.abs(np.diff(power)).max()
    error = 2 * states.edges * np.abs(low.sensor_power - power).max() + np.abs(fewer.sensor_power - power).max()
    error += (known + fine.rest) * most + bent
    return Over(through.stepped, through.read, times(device), fine.plate_rise, power, float(error))


def _spread(array: DeviceArray, warmed: int, at_rest: np.ndarray) -> np.ndarray:
    """(elements, samples): the plate's rise (K/W) under each element by a watt that enters it under one from time 0 on,
    which comes to rest at ``at_rest`` (elements,), known better than of points in the feet's middles; under that one
    itself what it is beyond what it would be in the middle of the plate."""
    sink, time = array.sink, times(array.element)
    plate = plate_of(sink)
    out = sink.length / 2 + sink.anchor_distance + sink.oxide_length / 2
    at = np.array(places(sink)).reshape(sink.rows, sink.columns, 2)
    columns, rows = plate.x / 2 + at[0, :, 0], plate.y / 2 + at[:, 0, 1][:, None] + np.array([-out, out])
    row, column = divmod(warmed, sink.columns)
    diffusivity = plate.conductivity / sink.substrate.heat_capacity
    rise, rest = warming(plate, diffusivity, columns[column], rows[row], columns, rows, time)
    middle = np.array([plate.x / 2]), plate.y / 2 + np.array([[-out, out]])
    alone, _ = warming(plate, diffusivity, middle[0][0], middle[1][0], *middle, time)
    scale = np.divide(at_rest, rest, out=np.zeros_like(rest), where=rest > 0)
    scale[warmed] = 1.0
    rise *= scale[:, None]
    rise[warmed] -= alone[0]
    return rise
