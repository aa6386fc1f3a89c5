"""Shielding of the sensor by the active sink: effect of the temperatures around a device on the powers of both films,
in the steady state and over time, with both loops closed and with the sink off.

The paper's claim is that with sink and sensor at one temperature no heat is lost from the sensor to the substrate, so
that its power depends on the outside alone. One kelvin of substrate then changes the sink's power only.
"""

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenes.device import Device, External
from statespace.march import march
from statespace.modal import Modal
from statespace.result import BEFORE
from statespace.sampling import timetable
from statespace.stability import steady


@dataclass(frozen=True)
class Shielding:
    """Changes of power per kelvin (W/K) about the steady state after the outer step: per kelvin of the substrate, of
    the room (substrate and air), and outside; and with the sink off."""

    sensor_power_per_substrate_W_per_K: float
    sink_power_per_substrate_W_per_K: float
    sensor_power_per_substrate_sink_off_W_per_K: float
    sensor_power_per_room_W_per_K: float
    sink_power_per_room_W_per_K: float
    sensor_power_per_outside_W_per_K: float
    sink_power_per_outside_W_per_K: float


def around(modal: Modal, device: Device) -> Shielding:
    """The shielding of a model of a device."""
    room, outer = device.sink.room_temperature, device.external.final_temperature - device.sink.room_temperature
    below, everything = modal.above_substrate(outer), _above_room(modal, outer)
    sensor, sink = _slopes(below, device, room)
    of_room, outside = _slopes(everything, device, room), _slopes(modal, device, room + outer)
    off = _slopes(below, without_sink(device), room)
    return Shielding(sensor, sink, off[0], *of_room, *outside)


def without_sink(device: Device) -> Device:
    """The device whose sink never gets any power."""
    return replace(device, control=replace(device.control, sink_gain=0.0))


def _above_room(modal: Modal, outer: float) -> Modal:
    """The model whose input is all that is at room temperature: where all outside is warmer alike, everything is, and
    films have no local departures: this is the difference of the two."""
    mean = (np.arange(modal.responses) < 2).astype(float)
    return replace(
        modal, external=mean - modal.external, flux_external=-modal.flux_external,
        offset=outer * modal.external, flux_offset=outer * modal.flux_external,
    )  # fmt: skip


def _slopes(modal: Modal, device: Device, about: float) -> tuple[float, float]:
    """d power / d input of (sensor, sink) in W/K, by steady states half a kelvin to either side of a temperature (K).

    Resistances are linear and both loops closed, so that powers are linear but for local departures of the films'
    temperatures.
    """
    less, more = (steady(modal, device, about + side / 2) for side in (-1, 1))
    return more.sensor_power_W - less.sensor_power_W, more.sink_power_W - less.sink_power_W


@dataclass(frozen=True, eq=False)
class Response:
    """Response to a step of the substrate by 1 K, from the steady state after the outer step: the changes of the powers
    of sensor and sink (W/K), as (samples,), over ``time_s`` since the step, with their errors."""

    time_s: np.ndarray
    sensor_power_W_per_K: np.ndarray
    sink_power_W_per_K: np.ndarray
    sensor_error: float = 0.0
    sink_error: float = 0.0

    @property
    def largest(self) -> tuple[float, float]:
        """The sensor's largest change (W/K), and when (s)."""
        at = int(np.abs(self.sensor_power_W_per_K).argmax())
        return float(self.sensor_power_W_per_K[at]), float(self.time_s[at])


def response(modal: Modal, nodes: int, device: Device) -> Response:
    """The response of the sampled loops of a model, with some nodes between samples."""
    room, h = device.sink.room_temperature, device.control.sample_time
    outer = device.external.final_temperature - room
    after = device.end_time - (device.external.step_time if device.steps_outside else 0.0)
    stepped = replace(
        device, external=External(room, room + 1.0, BEFORE * h), end_time=BEFORE * h + max(after, BEFORE * h)
    )
    run = march(modal.above_substrate(outer), nodes, stepped, 1e-9, start="settled")
    time = timetable(stepped).times[: len(run.powers)]
    change = run.powers - run.powers[BEFORE - 1]
    since = slice(BEFORE, None)
    return Response(time[since] - time[BEFORE], change[since, 1], change[since, 0])
