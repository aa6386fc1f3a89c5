"""The runs of the 3D model of a device, all of the same few states: the scene itself, sampled slowly, other steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from fem3d.device.solve import Model, model
from scenes.device import Device
from statespace.device_reduction import Whole
from statespace.ground import Shared
from statespace.result import Run, Runs, with_others
from statespace.shielding import Response, Shielding


@dataclass(frozen=True)
class Solved:
    """The few states of a device's structure, and their runs."""

    model: Model
    runs: Runs

    @cached_property
    def shielding(self) -> tuple[Shielding, dict[str, float]]:
        """Effect of the temperatures around on both powers, with errors (`Model.shielding`)."""
        return self.model.shielding(self.runs.base.device)

    @cached_property
    def response(self) -> Response:
        """The response to a step of the substrate's temperature (`Model.response`)."""
        return self.model.response(self.runs.base.device)

    @property
    def exported(self) -> Whole:
        """The model to export, and its closed loop."""
        model, base = self.model, self.runs.base
        others = [(model.low, max(model.edges, *model.beyond.values())), (model.fewer, 1.0)]
        return Whole(
            f"{base.device.name}, in 3D", base.device, model.fine, base.result, model.steady_errors(base.device), others
        )

    @cached_property
    def ground(self) -> list[tuple[Shared, dict[str, float]]]:
        """Effects of a lead to ground that both films share, with errors (`Model.ground`)."""
        return self.model.ground(self.runs.base.device)


def make(device: Device, meter: tuple[float, float], slow: bool, steps: bool, say: Callable[[str], None]) -> Solved:
    """The few states of a device's structure and the scene's own run, with ``meter`` the steps (ohm) to which the
    resistances are rounded in its loop; and where they are wanted the run sampled slowly and those of the outer steps.

    Raises ArithmeticError where the numerics fail.
    """
    say("solving in 3D")
    states = model(device, device.accuracy_3d, say)

    def simulate(other: Device, start: Literal["cold", "settled"]) -> Run:
        result, lower = states.solve(other, meter, start)
        return Run(other, result, states.largest_eigenvalue, reference=lower)

    return Solved(states, with_others(device, simulate(device, "cold"), simulate, slow, steps, say))
