"""Meters that read the sensor: their ranges and resolutions, and the step of a resistance or power they resolve."""

from __future__ import annotations

from dataclasses import dataclass

from reduced1d.device.lumped import lump, steady
from scenes.device import Device


@dataclass(frozen=True)
class Meter:
    """Ranges as (full scale, resolution): ``voltage`` in V, ``current`` in A, each ascending; and where these numbers
    are from."""

    name: str
    voltage: tuple[tuple[float, float], ...]
    current: tuple[tuple[float, float], ...]
    source: str


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


@dataclass(frozen=True)
class Reading:
    """What a meter tells apart in one element: steps of voltage (V), current (A), resistance (ohm) and power (W)."""

    voltage: float
    current: float
    resistance: float
    power: float


def reading(meter: Meter, voltage: float, power: float) -> Reading:
    """The steps of a meter at an element's voltage (V) and power (W), each read in its smallest fitting range.

    R = V/I and P = V I, so that dR/R = dV/V + dI/I and dP = I dV + V dI, taken as worst cases. Raises ValueError for
    a value beyond the meter's ranges, and where there is no power and so no resistance to be read.
    """
    if not (voltage > 0 and power > 0):
        raise ValueError("without a current there is no resistance to be measured: the element's power is zero")
    current = power / voltage
    dV, dI = _step(meter, meter.voltage, voltage, "V"), _step(meter, meter.current, current, "A")
    return Reading(dV, dI, voltage / current * (dV / voltage + dI / current), current * dV + voltage * dI)


def in_the_loop(device: Device, meter: Meter, external: float | None = None) -> tuple[float, float]:
    """Steps in ohm of the resistances of (sink, sensor) as a meter reads them at the steady state.

    To be handed to the solvers as ``meter``, which round each measured resistance to a multiple of its step.
    """
    state = steady(device, external)
    sink = reading(meter, state.sink_V, state.sink_power_W)
    sensor = reading(meter, state.sensor_V, state.sensor_power_W)
    return sink.resistance, sensor.resistance


def too_coarse(device: Device, steps: tuple[float, float]) -> tuple[str, ...]:
    """Sentences on the elements whose resistance between room and set temperature changes by less than 10 ``steps``."""
    lumped = lump(device)
    change = lumped.resistance * lumped.coefficient * lumped.set_rise
    return tuple(
        f"the meter tells {name} resistances apart in steps of {step:.3g} ohm, {step / span:.2g} of the whole change "
        f"of {span:.3g} ohm from room to set temperature: too coarse to control by"
        for name, step, span in zip(("sink", "sensor"), steps, change.tolist(), strict=True)
        if step > span / 10
    )


def _step(meter: Meter, ranges: tuple[tuple[float, float], ...], value: float, unit: str) -> float:
    for full, step in ranges:
        if value <= full:
            return step
    raise ValueError(f"{value:.3g} {unit} is beyond the largest range of the {meter.name}, {ranges[-1][0]:g} {unit}")
