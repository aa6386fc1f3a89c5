"""One call for both schemes."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from reduced1d.device.accurate import solve_accurate
from reduced1d.device.meters import Meter, in_the_loop, too_coarse
from reduced1d.device.paper import solve_paper
from scenes.device import Device
from scenes.loop.result import DeviceResult


def solve(
    device: Device, *, scheme: Literal["accurate", "paper"] = "accurate", meter: Meter | None = None
) -> DeviceResult:
    """Traces of a device at every controller sample, with error estimates and findings.

    ``scheme`` "accurate" couples all layers and propagates them exactly between samples (errors: an estimate in space
    and time); "paper" is the paper's own (errors: the distance from the accurate one). ``meter`` rounds the resistances
    that the controllers see to what it resolves at the initial steady state. Raises ValueError for values that make
    no device, UnstableStepError (a ValueError) where the paper's step is beyond its limit, and ArithmeticError where
    the numerics fail.
    """
    steps = (0.0, 0.0) if meter is None else in_the_loop(device, meter, device.external.initial_temperature)
    if scheme not in ("accurate", "paper"):
        raise ValueError(f'scheme is {scheme!r}: it must be "accurate" or "paper"')
    result = (solve_accurate if scheme == "accurate" else solve_paper)(device, meter=steps)
    return replace(result, findings=(*too_coarse(device, steps), *result.findings))
