"""Results of a model of the device: traces with a value per controller sample, their errors, and settling times; and
the runs behind checks and figures: the scene itself, sampled slowly, and other outer steps."""

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from sys import float_info
from typing import Any, Literal

import numpy as np

from scenes.device import Device, External
from statespace.circuit import timetable

QUANTITIES = ("sink_K", "sensor_K", "sink_V", "sensor_V", "sink_power_W", "sensor_power_W", "polymer_flux_W")
TOP = "polymer_top_W"  # Heat through the polymer's top, which only 3D has.
BAND = 0.01
""""Settled" means within this part of the step, where no other band is given."""
SLOW_TIME, SLOW_GAINS = 5e-3, (0.5, 0.05)
"""The paper's slower controllers (Figure 11): sample time (s), and gains (V) of sink and sensor."""
STEPS = (-80.0, -60.0, -40.0, -20.0, -10.0, 0.0, 10.0, 20.0)
"""K: heights of the outer steps whose responses are drawn (Figure 12)."""


@dataclass(frozen=True)
class Steady:
    """A steady state: temperatures in K; voltages in V; powers and the heat flow from the sensor into the polymer in W.

    ``sink_saturated`` and ``sensor_saturated``: the element is above the set temperature without any power.
    ``cycles``: there is no steady state, as over a common lead to ground a film can neither be held nor rest without
    power; the values are without its power.
    """

    sink_K: float
    sensor_K: float
    sink_V: float
    sensor_V: float
    sink_power_W: float
    sensor_power_W: float
    polymer_flux_W: float
    sink_saturated: bool
    sensor_saturated: bool
    cycles: bool = False


@dataclass(frozen=True)
class DeviceResult:
    """Traces with one entry per controller sample, their estimated errors, and findings.

    time_s, sink_K, sensor_K : (samples,), just before each sample
    sink_V, sensor_V, sink_power_W, sensor_power_W : (samples,), from each sample on
    polymer_flux_W, polymer_top_W : (samples,), heat from the sensor into the polymer, and out of its top in 3D
    before, after : steady states at the initial and the final outer temperature
    errors, error_parts : error bound of each trace in its unit, and its parts by source
    findings : sentences on a limiter that acts, an unstable loop, a run that was stopped
    details : numbers of the run (states, nodes, energy imbalance)
    """

    scheme: str
    time_s: np.ndarray
    sink_K: np.ndarray
    sensor_K: np.ndarray
    sink_V: np.ndarray
    sensor_V: np.ndarray
    sink_power_W: np.ndarray
    sensor_power_W: np.ndarray
    polymer_flux_W: np.ndarray
    errors: dict[str, float]
    before: Steady
    after: Steady
    polymer_top_W: np.ndarray | None = None
    error_parts: dict[str, dict[str, float]] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def quantities(self) -> tuple[str, ...]:
        return QUANTITIES if self.polymer_top_W is None else (*QUANTITIES, TOP)

    def trace(self, quantity: str) -> np.ndarray:
        if quantity not in self.quantities:
            raise KeyError(f"no quantity {quantity!r}; there are {', '.join(self.quantities)}")
        return np.asarray(getattr(self, quantity))


def device_result(
    scheme: str, device: Device, traces: np.ndarray, errors: dict[str, float], **rest: Any
) -> DeviceResult:  # fmt: skip
    """A device's result from ``traces`` (samples, 7 or 8) in the order of QUANTITIES and TOP, temperatures as rises."""
    columns = traces.T.copy()
    columns[:2] += device.sink.room_temperature
    by_name, time = dict(zip((*QUANTITIES, TOP), columns, strict=False)), timetable(device).times[: len(traces)]
    return DeviceResult(scheme=scheme, time_s=time, errors=errors, **by_name, **rest)


@dataclass(frozen=True)
class Run:
    """A run of a device and its result.

    largest : gives the loop's largest eigenvalue per sample about the steady state of a device
    step : height (K) of an outer step from room temperature
    reference : result of another scheme or mesh, by which the times are judged
    """

    device: Device
    result: DeviceResult
    largest: Callable[[Device], complex]
    step: float = 0.0
    reference: DeviceResult | None = None

    @property
    def before(self) -> Steady:
        return self.result.before

    @property
    def after(self) -> Steady:
        return self.result.after

    @cached_property
    def eigenvalue(self) -> complex:
        """The loop's largest eigenvalue per sample about the state after the outer step."""
        return self.largest(self.device)

    @property
    def decay(self) -> float:
        """The rate in 1/s at which the loop's slowest mode decays after the outer step; negative where it grows."""
        return -math.log(max(abs(self.eigenvalue), float_info.min)) / self.device.control.sample_time

    @property
    def stopped(self) -> bool:
        """Whether the run was stopped by the ceiling, or ended, before the outer step."""
        return bool(self.result.time_s[-1] <= self.device.external.step_time)

    @property
    def ran_away(self) -> bool:
        return bool(self.result.time_s[-1] < self.device.end_time - 1.5 * self.device.control.sample_time)

    @property
    def watched(self) -> float:
        """Seconds from the outer step to the end of the run; infinite for a loop that won't settle however long."""
        if self.stopped or self.ran_away or self.decay <= 0:
            return math.inf
        return float(self.result.time_s[-1] - self.device.external.step_time)

    def settled(self, fraction: float = BAND) -> tuple[float, float]:
        """Seconds from the outer step until the sensor's power stays within a part of its step, and how far that is
        uncertain because the power is (or how far the reference has another time); infinite where it doesn't settle."""
        quantity = "sensor_power_W"
        if self.stopped:
            return np.inf, np.inf
        last = settling(self.device, self.result, quantity, fraction)[-1]
        at = self.result.time_s >= last.start - 1e-12
        time, values, error = self.result.time_s[at], self.result.trace(quantity)[at], self.result.errors[quantity]
        moved = [settling_time(time, values, last.target, max(last.band + s * error, 0.0)) for s in (1, -1)]
        if not np.isfinite(last.time):
            return last.time, last.time
        if self.reference is not None:
            return last.time, abs(last.time - replace(self, result=self.reference, reference=None).settled(fraction)[0])
        return last.time, max(abs(time - last.time) for time in moved)

    def final(self, quantity: str) -> tuple[float, float]:
        """The last value of a quantity, and a bound of its distance from the value at rest.

        The bound is the change over the last tenth of the time since the outer step or, if larger, the rest of the
        loop's slowest mode. The mode may carry twice the step (a slab's first mode does) and the loop's answer twice
        that; where more than a tenth of the mode is left, faster modes matter too and there is no bound."""
        time, values = self.result.time_s, self.result.trace(quantity)
        start = min(self.device.external.step_time, time[-1])
        earlier = int(np.searchsorted(time, start + 0.9 * (time[-1] - start)))
        drift = float(np.abs(values[earlier:] - values[-1]).max())
        change = abs(getattr(self.after, quantity) - getattr(self.before, quantity))
        rest = (4 * change * self.remaining if self.remaining < 0.1 else math.inf) if change else 0.0
        return float(values[-1]), max(drift, rest)

    @property
    def remaining(self) -> float:
        """The remaining part of the loop's slowest mode at the end of the run; infinite where the mode grows."""
        return math.exp(-self.decay * self.watched) if math.isfinite(self.watched) else math.inf


@dataclass(frozen=True)
class Runs:
    """The scene's own run, the run sampled slowly, and runs of outer steps."""

    base: Run
    slow: Run | None
    steps: tuple[Run, ...]


Simulate = Callable[[Device, Literal["cold", "settled"]], Run]
"""A model's run of a device from a start."""


def with_others(
    device: Device, base: Run, simulate: Simulate, slow: bool, steps: bool, say: Callable[[str], None]
) -> Runs:
    """Add to the scene's own run, where wanted, the run sampled slowly and the runs of the outer steps."""
    slowly = None
    if slow:
        say("solving with slow sampling")
        slowly = simulate(sampled_slowly(device), "cold")
    outer: list[Run] = []
    for height in STEPS if steps else ():
        if _possible(device, device.sink.room_temperature + height):
            say(f"solving for a step of {height:+g} K")
            outer.append(replace(simulate(stepped(device, height), "settled"), step=height))
    return Runs(base, slowly, tuple(outer))


def sampled_slowly(device: Device) -> Device:
    """The device of the paper's Figure 11: sampled every 5 ms, with gains of 0.5 and 0.05 V."""
    sink, sensor = SLOW_GAINS
    control = replace(device.control, sample_time=SLOW_TIME, sink_gain=sink, sensor_gain=sensor)
    return replace(device, control=control, end_time=max(device.end_time, 4 * SLOW_TIME))


def stepped(device: Device, height: float) -> Device:
    """The device settled at room temperature, and an outer step of ``height`` K after 20 samples; the run goes on
    for as long as the scene's own does after its step."""
    room, before = device.sink.room_temperature, 20 * device.control.sample_time
    after = device.end_time - (device.external.step_time if device.steps_outside else 0.0)
    return replace(device, external=External(room, room + height, before), end_time=before + after)


def _possible(device: Device, temperature: float) -> bool:
    """Whether the films have a positive resistance at a temperature (K)."""
    films = (device.sink.silicon, device.gold)
    return temperature > 0 and all(
        1 + film.temperature_coefficient * (temperature - film.reference_temperature) > 0 for film in films
    )


@dataclass(frozen=True)
class Settling:
    """``time`` in s after ``start`` (s) from when on a quantity stays within ``band`` of ``target`` (in its unit),
    to the next outer step or the end; infinite where it is outside at the last sample."""

    start: float
    target: float
    band: float
    time: float


def settling_time(time: np.ndarray, values: np.ndarray, target: float, band: float) -> float:
    """Seconds after ``time[0]`` from when on ``values`` stays within ``band`` of ``target``; infinite if it doesn't.

    The crossing between the last sample outside and the first inside is on a straight line.
    """
    away = np.abs(values - target) - band
    outside = np.flatnonzero(away > 0)
    if not len(outside):
        return 0.0
    i = int(outside[-1])
    if i == len(values) - 1:
        return float("inf")
    part = away[i] / (away[i] - away[i + 1])
    return float(time[i] + part * (time[i + 1] - time[i]) - time[0])


def settling(device: Device, result: DeviceResult, quantity: str, fraction: float = 0.01) -> tuple[Settling, ...]:
    """Settling of one quantity after the cold start and after the outer step, as far as the run has them.

    The band is ``fraction`` of the change of the steady state by the event: of the set rise, or the power
    from none, at the start; and of the step between the steady values after it. Where the step changes the steady value
    by less than `BAND` of the change from cold (the temperatures and the sink), the band after it is ``fraction`` of
    the latter: a part of almost no change is not comparable between models.
    """
    external, time, values = device.external, result.time_s, result.trace(quantity)
    first, last = getattr(result.before, quantity), getattr(result.after, quantity)
    cold = device.sink.room_temperature if quantity.endswith("_K") else 0.0
    i = int(np.searchsorted(time, external.step_time - 1e-9 * device.control.sample_time))
    step = abs(last - first) if abs(last - first) > BAND * abs(last - cold) else abs(last - cold)
    parts = [(slice(i), first, abs(first - cold))] * (i > 1) + [(slice(i, None), last, step)] * (i < len(time) - 1)
    return tuple(
        Settling(float(time[at][0]), target, fraction * change,
                 settling_time(time[at], values[at], target, fraction * change))
        for at, target, change in parts
    )  # fmt: skip
