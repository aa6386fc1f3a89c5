"""The runs of the 1D model of a device: the scene itself by either scheme, sampled slowly, and other steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from reduced1d.device.accurate import solve_accurate
from reduced1d.device.meters import METERS, in_the_loop
from reduced1d.device.paper import UnstableStepError
from reduced1d.device.solve import solve
from reduced1d.device.stability import largest_eigenvalue
from scenes.device import Device
from scenes.errors import SceneError
from scenes.loop.runs import Run, Runs, with_others


def make(
    device: Device, scheme: str, meter_name: str | None, slow: bool, steps: bool, say: Callable[[str], None]
) -> Runs:
    """The scene's own run by a ``scheme``, with a meter in its loop if one is named; and where they are wanted the one
    sampled slowly and those of the outer steps.

    Raises SceneError for what the model refuses, and ArithmeticError where its numerics fail.
    """
    try:
        say(f"solving in 1D, {scheme} scheme")
        meter = METERS[meter_name] if meter_name else None
        base = Run(device, solve(device, meter=meter), largest_eigenvalue)
        if scheme == "paper":
            by_it = solve(device, scheme="paper", meter=meter)
            base = Run(device, by_it, largest_eigenvalue, reference=base.result)
        rounded = in_the_loop(device, meter, device.external.initial_temperature) if meter else (0.0, 0.0)

        def simulate(other: Device, start: Literal["cold", "settled"]) -> Run:
            return Run(other, solve_accurate(other, meter=rounded, start=start), largest_eigenvalue)

        return with_others(device, base, simulate, slow, steps, say)
    except UnstableStepError as error:
        raise SceneError(f"{error}: use --scheme accurate, which has no such limit") from None
    except ArithmeticError:
        raise
    except ValueError as error:
        raise SceneError(str(error)) from None
