"""The paper's sentence on meters (section 5), checked: an NI 4070 reads the gold's resistance to some 60 uohm and its
power to 23 nW, at 5 readings a second, "which is more than sufficient". Each is a claim of one side."""

from __future__ import annotations

import math

from compare.comparison import Comparison
from compare.device.runs import Run, Runs
from compare.verdict import relative
from compare.words import quantity
from reduced1d.device.findings import shown
from reduced1d.device.meters import PXI_4070, reading
from reduced1d.device.stability import at_sample_time, largest_eigenvalue

RESISTANCE, POWER, RATE = 60e-6, 23e-9, 5.0
RANGES = 1.0, 20e-3
"""The ranges, in V and A, that the paper quotes."""


def resistance(runs: Runs) -> Comparison:
    """The step of the sensor's resistance at its steady state, in the meter's ranges that fit."""
    return _most("NI 4070, gold", RESISTANCE, runs.base, "resistance", "ohm")


def power(runs: Runs) -> Comparison:
    """The step of the sensor's power there."""
    return _most("NI 4070, power", POWER, runs.base, "power", "W")


def rate(runs: Runs) -> Comparison:
    """How often the controllers need a reading: once per sample."""
    device = runs.base.device
    needed = 1 / device.control.sample_time
    there = largest_eigenvalue(at_sample_time(device, 1 / RATE))
    said = (
        f"paper: {RATE:g} S/s to seven digits is more than sufficient; the controllers here need a reading every "
        f"{quantity(device.control.sample_time, 's', 3)}; at {RATE:g} S/s, with the same gains, the loop's largest "
        f"eigenvalue per sample is {shown(there)}, so that it "
    )
    fading = -math.log(abs(there)) * RATE
    said += f"takes {quantity(1 / fading, 's', 2)} to settle by a factor e" if fading > 0 else "is unstable"
    missing = min(relative(RATE, needed), 0.0)
    return Comparison("NI 4070, rate", RATE, needed, "S/s", missing, 0.0, lambda: said, sense="at most")


def _most(title: str, claim: float, run: Run, name: str, unit: str) -> Comparison:
    """A step of the meter at the sensor after the outer step, claimed to be at most so much; none where it takes no
    power. The paper's own numbers come out at the ends of its ranges, and as roots of squares."""
    V, current = RANGES
    parts = PXI_4070.voltage[1][1] / V, PXI_4070.current[0][1] / current
    value = V / current if name == "resistance" else V * current
    worst, squares = (quantity(value * part, unit, 2) for part in (sum(parts), math.hypot(*parts)))
    said = (
        f"paper: {quantity(claim, unit, 2)}, from its ranges of {quantity(V, 'V', 1)} and {quantity(current, 'A', 2)}, "
        f"which give {squares} at their ends as a root of squares and {worst} at worst; here the sensor takes "
    )
    state, step = run.after, math.inf
    try:
        step = float(getattr(reading(PXI_4070, state.sensor_V, state.sensor_power_W), name))
        taken = state.sensor_power_W / state.sensor_V
        said += f"{quantity(state.sensor_V, 'V')} and {quantity(taken, 'A')}"
        said += f", beyond {quantity(current, 'A', 2)}: the next range serves" if taken > current else ""
    except ValueError as error:
        said += str(error) if state.sensor_power_W else "no power, and there is nothing to be read"
    return Comparison(title, claim, step, unit, min(relative(claim, step), 0.0), 0.0, lambda: said, sense="at most")
