"""The 1D model of a device and its runs, and limits for a designer: gains, measurable range, resolution of meters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from reduced1d.device.lumped import DEGREE, at_sample_time, largest_eigenvalue, lump, modes, stability, steady
from reduced1d.device.schemes import LESS, UnstableStepError, solve_accurate, solve_paper
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import quantity
from statespace.device_model import Whole
from statespace.result import DeviceResult, Run, Runs, Steady, with_others
from statespace.stability import held_range

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output


@dataclass(frozen=True)
class Range:
    """Measurable outer temperatures in K: above ``highest_K`` the sensor's power is zero, below ``lowest_K`` it would
    need more than ``sensor_power_W`` (``sensor_V``). ``sink_V`` is the sink's voltage at any of them."""

    lowest_K: float
    highest_K: float
    sensor_power_W: float
    sensor_V: float
    sink_V: float


def measurable_range(device: Device, *, voltage: float = np.inf, power: float = np.inf) -> Range:
    """The range of a device whose sensor gets at most a ``voltage`` in V and a ``power`` in W.

    The ends are those of the range in which both films are held, the lower one where a limit is reached; NaN where that
    range is empty. Raises ValueError where both limits are infinite or not positive.
    """
    from scipy.optimize import brentq

    if not (0 < min(voltage, power) < np.inf):
        raise ValueError("give the sensor's largest voltage or power, a positive number")
    lowest, highest = held_range(modes(lump(device), DEGREE), device)
    if math.isnan(highest):
        return Range(lowest, highest, math.nan, math.nan, math.nan)

    def excess(outer: float) -> float:
        state = steady(device, outer)
        return max(state.sensor_power_W / power, state.sensor_V / voltage) - 1

    if excess(lowest) > 0:
        lowest = float(brentq(excess, lowest, highest, xtol=1e-12 * highest)) if excess(highest) < 0 else highest
    state = steady(device, lowest)
    return Range(lowest, highest, state.sensor_power_W, state.sensor_V, state.sink_V)


@dataclass(frozen=True)
class ExternalStep:
    """Steps of the outer temperature in K, worst cases: by the sensor's power, its temperature, the sink's
    temperature, and all together; and the steps behind them, of resistances in ohm and of the power in W."""

    power: float
    sensor: float
    sink: float
    total: float
    sensor_resistance_ohm: float
    sink_resistance_ohm: float
    sensor_power_W: float


def resolution(device: Device, meter: Meter, external: float | None = None) -> ExternalStep:
    """Compute the step of the outer temperature that a meter resolves at a steady state (K; by default the final one).

    T_ext = T_sensor - (P - q)/g_polymer with q = g_insulator (T_sensor - T_sink): a step of the power counts
    1/g_polymer, one of the sensor's temperature 1 + g_insulator/g_polymer, one of the sink's g_insulator/g_polymer.
    Raises ValueError where the sensor has no power or a value is beyond the meter.
    """
    lumped, state = lump(device), steady(device, external)
    (sink, _), (sensor, power) = (meter.steps(*delivered(device, state, film)) for film in (0, 1))
    kelvin = np.array([sink, sensor]) / (lumped.resistance * lumped.coefficient)
    ratio = lumped.insulator.conductance / lumped.polymer.conductance
    parts = power / lumped.polymer.conductance, float((1 + ratio) * kelvin[1]), float(ratio * kelvin[0])
    return ExternalStep(*parts, sum(parts), sensor, sink, power)


@dataclass(frozen=True)
class GainLimits:
    """The largest stable gains (V) of sink and sensor at a sample time (s), the smaller of the limits before and after
    the outer step, each with the other gain as it is; and the decay (1/s) of the loop's slowest mode at its own gains,
    with the size of its eigenvalue per sample."""

    sample_time_s: float
    sink_gain_V: float
    sensor_gain_V: float
    decay_per_s: float
    largest_eigenvalue: float


@dataclass(frozen=True)
class Design:
    """Gain limits at several sample times, the scene's first; the ``range`` for the largest voltage or power, if given;
    and by meter the outer step that it resolves, or why it can't, the same in words, and the source of its data."""

    limits: tuple[GainLimits, ...]
    range: Range | None
    resolutions: dict[str, ExternalStep | str]
    meters: dict[str, str]
    sources: dict[str, str]


def answer(device: Device, largest_voltage: float = np.inf, largest_power: float = np.inf) -> Design:
    """The answers for a largest sensor voltage (V) and power (W); ArithmeticError where the numerics fail."""
    external = device.external
    span = abs(device.control.set_temperature - external.final_temperature)
    limits: list[GainLimits] = []
    resolutions: dict[str, ExternalStep | str] = {}
    said: dict[str, str] = {}
    for time in dict.fromkeys((device.control.sample_time, 1e-4, 1e-3, 5e-3)):
        sampled = at_sample_time(device, time)
        stabilities = [stability(sampled, t) for t in (external.initial_temperature, external.final_temperature)]
        limits.append(GainLimits(
            time, min(s.sink_gain_limit for s in stabilities), min(s.sensor_gain_limit for s in stabilities),
            -max(s.growth_rate for s in stabilities), max(abs(s.eigenvalue) for s in stabilities),
        ))  # fmt: skip
    for name, meter in METERS.items():
        try:
            step = resolution(device, meter)
            resolutions[name], said[name] = step, _resolves(step, span)
        except ValueError as error:
            said[name] = str(error)
            resolutions[name] = said[name]
    limited = min(largest_voltage, largest_power) < np.inf
    return Design(
        tuple(limits),
        measurable_range(device, voltage=largest_voltage, power=largest_power) if limited else None,
        resolutions, said, {name: meter.source for name, meter in METERS.items()},
    )  # fmt: skip


def _resolves(step: ExternalStep, span: float) -> str:
    """State the resolution of a meter, or that its step is larger than the ``span`` (K) from outside to the set
    point."""
    parts = (
        f"{quantity(step.power, 'K', 2)} by the sensor's power, {quantity(step.sensor, 'K', 2)} by holding the "
        f"sensor's temperature, {quantity(step.sink, 'K', 2)} the sink's"
    )
    if step.total < span:
        return f"resolves {quantity(step.total, 'K', 2)} outside: {parts}"
    return (
        f"cannot resolve the outer temperature: its step of {quantity(step.total, 'K', 2)} is more than the "
        f"{span:.3g} K from outside to the set point ({parts})"
    )


@dataclass(frozen=True)
class Meter:
    """Ranges (full scale, resolution), ascending: ``voltage`` in V, ``current`` in A; their ``source``."""

    name: str
    voltage: tuple[tuple[float, float], ...]
    current: tuple[tuple[float, float], ...]
    source: str

    def steps(self, voltage: float, power: float) -> tuple[float, float]:
        """The steps of resistance (ohm) and power (W) at an element's voltage (V) and power (W), each of voltage and
        current read in its smallest fitting range.

        R = V/I and P = V I, so that dR/R = dV/V + dI/I and dP = I dV + V dI, taken as worst cases. Raises ValueError
        for a value beyond the meter's ranges, and where there is no power and so no resistance to be read.
        """
        if not (voltage > 0 and power > 0):
            raise ValueError("without a current there is no resistance to be measured: the element's power is zero")
        current, steps = power / voltage, []
        for ranges, value, unit in ((self.voltage, voltage, "V"), (self.current, current, "A")):
            fitting = [step for full, step in ranges if value <= full]
            if not fitting:
                most = f"the largest range of the {self.name}, {ranges[-1][0]:g} {unit}"
                raise ValueError(f"{value:.3g} {unit} is beyond {most}")
            steps.append(fitting[0])
        dV, dI = steps
        return voltage / current * (dV / voltage + dI / current), current * dV + voltage * dI


PXI_4070 = Meter(
    "PXI-4070",
    ((0.1, 1e-7), (1.0, 1e-6), (10.0, 1e-5), (100.0, 1e-4), (300.0, 1e-3)),
    ((0.02, 1e-8), (0.2, 1e-7), (1.0, 1e-6)),
    "1 V to 1 uV and 20 mA to 10 nA: the paper, section 5, citing NI's specifications 371304J-01; 10 V to 10 uV: "
    "ni.com forum, thread 3787233, citing the same; that 20 mA, 200 mA and 1 A are its current ranges: NI-DMM manual, "
    '"DC and AC Current"; the other steps follow by decades, their source not seen',
)
"""6 1/2 digits, at the 5 readings a second that the paper quotes."""

MAX1367 = Meter(
    "MAX1367",
    ((0.2, 1e-4), (2.0, 1e-3)),
    ((0.002, 1e-6), (0.02, 1e-5), (0.2, 1e-4), (2.0, 1e-3)),
    "+-200 mV and +-2 V: MAX1366 evaluation kit's manual, table 2; 1999 counts: data sheet of the MAX1497, 3.5 digits "
    "like it; its own, which the paper cites, was not seen; currents: our choice of a second one on 200 mV across a "
    "shunt of 100, 10, 1 or 0.1 ohm",
)
"""3 1/2 digits; the shunt is the one that fits the current."""

METERS = {meter.name: meter for meter in (PXI_4070, MAX1367)}


def delivered(device: Device, state: Steady, film: int) -> tuple[float, float]:
    """The voltage (V) of the sink (0) or the sensor (1) in a steady state, and the power (W) that its source delivers:
    the film's own, and the power of its current in the lead to ground."""
    voltage, power = (state.sink_V, state.sink_power_W) if film == 0 else (state.sensor_V, state.sensor_power_W)
    if device.control.ground_resistance and voltage:
        lumped, rise = lump(device), (state.sink_K, state.sensor_K)[film] - device.sink.room_temperature
        warm = lumped.resistance[film] * (1 + lumped.coefficient[film] * rise)
        power = voltage * float(np.sqrt(power / warm))
    return voltage, power


def in_the_loop(device: Device, meter: Meter, external: float | None = None) -> tuple[float, float]:
    """Steps in ohm of the resistances of (sink, sensor) as a meter reads them at the steady state.

    To be handed to the solvers as ``meter``, which round each measured resistance to a multiple of its step.
    """
    state = steady(device, external)
    sink, sensor = (meter.steps(*delivered(device, state, film))[0] for film in (0, 1))
    return sink, sensor


def too_coarse(device: Device, steps: tuple[float, float]) -> tuple[str, ...]:
    """Sentences on the elements whose resistance between room and set temperature changes by less than 10 ``steps``."""
    lumped = lump(device)
    change = np.abs(lumped.resistance * lumped.coefficient * lumped.set_rise)
    return tuple(
        f"the meter tells {name} resistances apart in steps of {step:.3g} ohm, {step / span:.2g} of the whole change "
        f"of {span:.3g} ohm from room to set temperature: too coarse to control by"
        for name, step, span in zip(("sink", "sensor"), steps, change.tolist(), strict=True)
        if step > span / 10
    )


def make(
    device: Device, scheme: str, meter_name: str | None, slow: bool, steps: bool, say: Callable[[str], None]
) -> Runs:
    """The scene's own run by a ``scheme``, with a meter in its loop if one is named; and where they are wanted the one
    sampled slowly and those of the outer steps.

    Raises SceneError for scenes that the model refuses, and ArithmeticError where its numerics fail.
    """
    if scheme == "paper" and device.control.ground_resistance:
        raise SceneError(
            f"control.ground_resistance = {device.control.ground_resistance:g} needs the accurate scheme: in the "
            "paper's each film is heated alone"
        )
    try:
        say(f"solving in 1D, {scheme} scheme")
        rounded = (0.0, 0.0)
        if meter_name:
            rounded = in_the_loop(device, METERS[meter_name], device.external.initial_temperature)

        def told(result: DeviceResult) -> DeviceResult:
            return replace(result, findings=(*too_coarse(device, rounded), *result.findings))

        base = Run(device, told(solve_accurate(device, meter=rounded)), largest_eigenvalue)
        if scheme == "paper":
            by_it = told(solve_paper(device, meter=rounded))
            base = Run(device, by_it, largest_eigenvalue, reference=base.result)

        def simulate(other: Device, start: Literal["cold", "settled"]) -> Run:
            result = solve_accurate(other, meter=rounded, start=start, with_findings=False)
            return Run(other, result, largest_eigenvalue)

        return with_others(device, base, simulate, slow, steps, say)
    except UnstableStepError as error:
        raise SceneError(f"{error}: use --scheme accurate, which has no such limit") from None
    except ArithmeticError:
        raise
    except ValueError as error:
        raise SceneError(str(error)) from None


def exported(run: Run) -> Whole:
    """The model to export, and its closed loop, from a run of the accurate scheme."""
    device, degree = run.device, run.result.details["degree"]
    fine, lower = (modes(lump(device), d) for d in (degree, degree - LESS))
    return Whole(f"{device.name}, in 1D", device, fine, run.result, {}, [(lower, 1.0)])
