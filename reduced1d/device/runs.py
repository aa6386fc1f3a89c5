"""The 1D model of a device by either scheme, and its runs: the scene itself, sampled slowly, and other outer steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from reduced1d.device.accurate import LESS, solve_accurate
from reduced1d.device.design import METERS, Meter, in_the_loop, too_coarse
from reduced1d.device.lumped import largest_eigenvalue, lump, modes
from reduced1d.device.paper import UnstableStepError, solve_paper
from scenes.device import Device
from scenes.errors import SceneError
from statespace.device_reduction import Whole
from statespace.result import DeviceResult, Run, Runs, with_others


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
        meter = METERS[meter_name] if meter_name else None
        base = Run(device, solve(device, meter=meter), largest_eigenvalue)
        if scheme == "paper":
            by_it = solve(device, scheme="paper", meter=meter)
            base = Run(device, by_it, largest_eigenvalue, reference=base.result)
        rounded = in_the_loop(device, meter, device.external.initial_temperature) if meter else (0.0, 0.0)

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
    fine, lower = (modes(lump(device), d).modal for d in (degree, degree - LESS))
    return Whole(f"{device.name}, in 1D", device, fine, run.result, {}, [(lower, 1.0)])


def solve(
    device: Device, *, scheme: Literal["accurate", "paper"] = "accurate", meter: Meter | None = None
) -> DeviceResult:
    """Traces of a device at every controller sample, with error estimates and findings.

    ``scheme`` "accurate" couples all layers and propagates them exactly between samples (errors: an estimate in space
    and time); "paper" is the paper's own (errors: the distance from the accurate one). ``meter`` rounds the resistances
    that the controllers see to its resolution at the initial steady state. Raises ValueError for values that make
    no device, UnstableStepError (a ValueError) where the paper's step is beyond its limit, and ArithmeticError where
    the numerics fail.
    """
    steps = (0.0, 0.0) if meter is None else in_the_loop(device, meter, device.external.initial_temperature)
    if scheme not in ("accurate", "paper"):
        raise ValueError(f'scheme is {scheme!r}: it must be "accurate" or "paper"')
    result = (solve_accurate if scheme == "accurate" else solve_paper)(device, meter=steps)
    return replace(result, findings=(*too_coarse(device, steps), *result.findings))
