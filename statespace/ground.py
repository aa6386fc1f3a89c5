"""The sensor's two disturbances: a lead to ground that it shares with the sink, and the temperatures around the device.

Each controller sees its film with the lead in series, R + R_ground (1 + I_other/I), and so holds it at less than the
set temperature; the two by different amounts, so that heat passes between them, which the sensor's power then lacks.
Where the sensor has little current, the sink's through the lead hides its resistance: there its range ends.

The paper claims that with sink and sensor at one temperature no heat is lost from the sensor to the substrate (the sink
shields it), so that one kelvin of substrate changes the sink's power only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from scenes.device import Device
from statespace.circuit import timetable
from statespace.device_model import Modal
from statespace.march import march
from statespace.result import BEFORE, stepped
from statespace.stability import gains, plant, steady

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output


NARROW = 2e-3
"""The end of the range is bisected to this part of the set temperature's rise."""


@dataclass(frozen=True)
class Shared:
    """The effect of a lead after the outer step.

    sink_off_K, sensor_off_K : deviation of the films from their temperatures without a lead
    sink_power_W, sensor_power_W : where the sensor cannot be held, the power of the sink's current in the sensor
    lowest_K, highest_K : outer temperatures between which both films are held
    largest_eigenvalue : size of the loop's largest eigenvalue per sample
    coupling_K_per_V : change of the sensor's measured temperature per volt across the sink
    """

    resistance_ohm: float
    sink_off_K: float
    sensor_off_K: float
    sink_power_W: float
    sensor_power_W: float
    lowest_K: float
    highest_K: float
    largest_eigenvalue: float
    coupling_K_per_V: float


@dataclass(frozen=True)
class Ground:
    """Leads of several resistances; the resistances (ohm) at which the sensor is off by a step of its power, and of its
    measured resistance, infinite where no lead is large enough."""

    leads: tuple[Shared, ...]
    by_power_ohm: float
    by_resistance_ohm: float


def grounded(device: Device, resistance: float) -> Device:
    """The device with a lead of a resistance (ohm)."""
    return replace(device, control=replace(device.control, ground_resistance=resistance))


def shared(modal: Modal, device: Device, resistance: float) -> Shared:
    """Compute the effect of a lead of some resistance (ohm) on a model of a device."""
    earthed = grounded(device, resistance)
    without, state, loop = steady(modal, grounded(device, 0.0)), steady(modal, earthed), plant(modal, earthed)
    return Shared(
        resistance, state.sink_K - without.sink_K, state.sensor_K - without.sensor_K, state.sink_power_W,
        state.sensor_power_W, *held_range(modal, earthed), abs(loop.eigenvalue(gains(earthed))),
        float(loop.across[1, 0]),
    )  # fmt: skip


def held_range(modal: Modal, device: Device) -> tuple[float, float]:
    """The outer temperatures (K) between which both films are held, NaN if at none; without a lead from 0 K to the set
    temperature.

    With one the sensor's current gets too small beside the sink's above them, and the sink's beside the sensor's below.
    The search goes down from the set temperature in steps of its rise above room, at first smaller.
    """
    top, step = device.control.set_temperature, device.set_rise
    if not device.control.ground_resistance:
        return 0.0, top

    def held(outer: float) -> bool:
        state = steady(modal, device, outer)
        return not (state.sink_saturated or state.sensor_saturated or state.cycles)

    def end(inside: float, outside: float) -> float:
        while abs(inside - outside) > NARROW * step:
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if held(middle) else (inside, middle)
        return inside

    drops = [step / 4**n for n in (4, 3, 2, 1)] + [step * n for n in range(1, int(top / step) + 1)]
    tried = [top, *(top - drop for drop in drops), 0.0]
    inside = [n for n, outer in enumerate(tried) if n and held(outer)]
    if not inside:
        return float("nan"), float("nan")
    first, last = inside[0], inside[-1]
    lowest = 0.0 if last == len(tried) - 1 else end(tried[last], tried[last + 1])
    return lowest, end(tried[first], tried[first - 1])


def effects(modal: Modal, device: Device, resistances: Iterable[float], power: float, resistance: float) -> Ground:
    """Compute the effects of leads of some ``resistances`` (ohm), and the leads at which the sensor is off by a step of
    its ``power`` (W) and of its measured ``resistance`` (ohm)."""
    without = steady(modal, grounded(device, 0.0))
    per_kelvin = modal.resistance[1] * modal.coefficient[1]

    def off(lead: float) -> tuple[float, float]:
        """How many steps the sensor's power and its resistance are off."""
        state = steady(modal, grounded(device, lead))
        kelvin, watts = state.sensor_K - without.sensor_K, state.sensor_power_W - without.sensor_power_W
        return abs(watts) / power, abs(kelvin) * per_kelvin / resistance

    smallest, largest = (float(part * modal.resistance[1]) for part in (1e-12, 10.0))
    reached = (_reaches_one(lambda lead, k=k: off(lead)[k], smallest, largest) for k in (0, 1))  # type: ignore[misc]
    return Ground(tuple(shared(modal, device, lead) for lead in resistances), *reached)


def _reaches_one(off: Callable[[float], float], low: float, largest: float) -> float:
    """Where a function that grows from about nothing first reaches one; infinite where that is beyond ``largest``."""
    from scipy.optimize import brentq

    high = low
    while off(high) < 1:
        low, high = high, 10 * high
        if high > largest:
            return float("inf")
    return low if low == high else float(brentq(lambda lead: np.log(max(off(lead), 1e-300)), low, high, rtol=1e-9))


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
    off = _slopes(below, replace(device, control=replace(device.control, sink_gain=0.0)), room)
    return Shielding(sensor, sink, off[0], *of_room, *outside)


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
    outer, by_one = device.external.final_temperature - device.sink.room_temperature, stepped(device, 1.0)
    run = march(modal.above_substrate(outer), nodes, by_one, 1e-9, start="settled")
    time = timetable(by_one).times[: len(run.powers)]
    change = run.powers - run.powers[BEFORE - 1]
    since = slice(BEFORE, None)
    return Response(time[since] - time[BEFORE], change[since, 1], change[since, 0])
