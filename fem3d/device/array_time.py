"""Over time what a step outside of one element of an array of devices does to the sensor of a neighbour.

The heat of the element's step spreads through the plate (`fem3d.runs.plate_time`), and the sampled loops of the other
answer with their response to a step of the substrate, one after the other (Duhamel's sum over samples). What the others
do back is of second order in the plate's rise per watt, and is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem3d.device.solve import Model
from fem3d.runs.array import plate_of
from fem3d.runs.plate_time import warming
from scenes.array import DeviceArray, driven, idle, places
from scenes.device import Device, External
from scenes.loop.march import Resolution, march
from scenes.loop.modal import Modal
from scenes.loop.shielding import BEFORE, CLOSELY, STEP, without_sink


@dataclass(frozen=True, eq=False)
class Over:
    """Over the time ``time_s`` since a step outside of element ``of`` by 1 K: how much warmer the plate is under
    element ``at`` (K/K), and what has been added to the power of its sensor (W/K), with the error of the latter."""

    of: int
    at: int
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
    of = array.sink.rows // 2 * array.sink.columns + array.sink.columns // 2
    reading = [k - 1 for k in driven(array.sink) if k - 1 != of]
    return of, max(reading, key=lambda k: float(plate[k, of])) if reading else of


def over_time(array: DeviceArray, states: Model, plate: np.ndarray, known: float) -> tuple[Over, ...]:
    """What a step outside of an element does to the sensor that it warms most, loops closed and sinks off; none where
    no other is at work. ``plate`` (elements, elements) in K/W, of which the part ``known`` may be off."""
    of, at = nearest(array, plate)
    if of == at:
        return ()
    element = array.element
    spread = _spread(array, of, at, _times(element), float(plate[at, of]))
    return tuple(_over(array, states, device, (of, at), spread, known) for device in (element, without_sink(element)))


def _over(
    array: DeviceArray, states: Model, device: Device, which: tuple[int, int], spread: np.ndarray, known: float
) -> Over:
    of, at = which
    sending = device if of + 1 in driven(array.sink) else idle(device)
    found = []
    for modal, nodes in ((states.fine, states.nodes), (states.low, states.nodes), (states.fewer, states.nodes)):
        sent, answer = _sent(modal, nodes, sending), _answer(modal, nodes, device)
        # Heat that is on from a sample to the next warms by the difference of what it has done by either's end.
        rise = np.convolve(np.diff(sent, prepend=0.0), spread)[: len(spread)]
        found.append((rise, np.convolve(np.diff(rise, prepend=0.0), answer)[: len(spread)]))
    (rise, power), (_, low), (_, fewer) = found
    # What a sample's length does to both sums: with heat and rise half a sample later.
    late = np.abs(power - np.interp(np.arange(len(power)) - 1.0, np.arange(len(power)), power)).max()
    error = 2 * states.edges * np.abs(low - power).max() + np.abs(fewer - power).max() + known * np.abs(power).max()
    return Over(of, at, _times(device), rise, power, float(error + late))


def _times(device: Device) -> np.ndarray:
    """(samples,): the samples from the step on."""
    after = device.end_time - (device.external.step_time if device.steps_outside else 0.0)
    h = device.control.sample_time
    return h * np.arange(int(np.floor(max(after, BEFORE * h) / h + 1e-9)))


def _stepped(device: Device, at: float) -> Device:
    """The device settled at a temperature (K) of its input, and a step of that by 1 K after some samples."""
    h, samples = device.control.sample_time, len(_times(device))
    return replace(device, external=External(at, at + STEP, BEFORE * h), end_time=(BEFORE + samples) * h)


def _sent(modal: Modal, nodes: int, device: Device) -> np.ndarray:
    """(samples,): what a step outside adds to the heat into the plate (W/K), from the step on."""
    stepped = _stepped(device, device.external.initial_temperature)
    run = march([Resolution(modal.with_heat_below(), nodes)], stepped, CLOSELY, start="settled")
    heat = run.flows[:, 0, -1]
    return np.asarray((heat[BEFORE:] - heat[BEFORE - 1]) / STEP)[: len(_times(device))]


def _answer(modal: Modal, nodes: int, device: Device) -> np.ndarray:
    """(samples,): what a step of the substrate adds to the sensor's power (W/K), from the step on."""
    room = device.sink.room_temperature
    outer = device.external.initial_temperature - room
    run = march([Resolution(modal.above_substrate(outer), nodes)], _stepped(device, room), CLOSELY, start="settled")
    power = run.powers[:, 0, 1]
    return np.asarray((power[BEFORE:] - power[BEFORE - 1]) / STEP)[: len(_times(device))]


def _spread(array: DeviceArray, of: int, at: int, time: np.ndarray, at_rest: float) -> np.ndarray:
    """(times,): the plate's rise under one element by a watt that enters it under another from time 0 on (K/W), which
    comes to rest at what is known better than of points in the feet's middles."""
    sink = array.sink
    plate = plate_of(sink)
    out = sink.length / 2 + sink.anchor_distance + sink.oxide_length / 2
    middle = np.array([plate.x, plate.y]) / 2
    source, target = (
        [middle + np.array(places(sink)[k]) + np.array([0.0, side * out]) for side in (-1, 1)] for k in (of, at)
    )
    diffusivity = plate.conductivity / sink.substrate.heat_capacity
    rise, last = np.zeros(len(time)), 0.0
    for a in source:
        for b in target:
            course, rest = warming(plate, diffusivity, a, b, time)
            rise, last = rise + course, last + rest
    return rise * at_rest / last
