"""The network of a sink's boxes, by the sink's own quantities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reduced1d.network.lines import Layout, layout
from reduced1d.network.solution import solve_layout
from scenes import physics
from scenes.errors import SceneError
from scenes.model import Probe
from scenes.result import Estimate, Result
from scenes.sink import Sink, face

INTO_SUBSTRATE, THROUGH_END = "heat into ", "heat through the end"
"""Names of the probes of heat flows; a boundary's name follows the first."""


def lines_of(sink: Sink) -> Layout:
    """The lines of a sink of one span, with probes of its current and of the heat into the substrate and through the
    beam's end. Raises SceneError for a row of spans, and for scenes that lines don't take."""
    if sink.spans > 1:
        raise SceneError(
            f"--reduction network has the quantities of one span, and sink.spans is {sink.spans}: give sink.spans = 1, "
            "or another reduction"
        )
    scene = sink.scene()
    physics.refuse_terminals(scene, "--reduction network")
    beam = next(box for box in scene.boxes if box.name == "beam")
    inlet = next(b for b in scene.boundaries if b.name == "electrode-0")
    bottoms = (b for b in scene.boundaries if b.name.startswith("substrate"))
    flows = [
        *(Probe(INTO_SUBSTRATE + b.name, b.lower, b.upper, "heat_flow") for b in bottoms),
        Probe(THROUGH_END, *face(beam, 1, 0), "heat_flow"), Probe("current", inlet.lower, inlet.upper, "current"),
    ]  # fmt: skip
    return layout(replace(scene, probes=(*scene.probes, *flows)))


def solve(sink: Sink, times: np.ndarray | None = None) -> Result:
    """A sink's quantities by its network: the steady state, or with ``times`` (s, ascending) the traces alone, each
    with the error of its elements and steps.

    Raises SceneError for a sink that lines can't have, RunawayError where the heating runs away, NumericsError."""
    result, voltage = solve_layout(lines_of(sink), times, steady_too=False), sink.drive.value
    if times is not None:
        traces = result.over_time
        names = {"peak_K": "peak", "end_K": "end", "mean_K": "mean", "current_A": "current"}
        values = {name: traces.values[probe] for name, probe in names.items()}
        errors = {name: traces.errors[probe] for name, probe in names.items()}
        values["power_W"], errors["power_W"] = voltage * values["current_A"], voltage * errors["current_A"]
        return replace(result, steady={}, traces=replace(traces, values=values, errors=errors))
    probes = result.steady
    steady = {
        f"{name}_rise_K": Estimate(probes[name].value - sink.room_temperature, probes[name].error)
        for name in ("peak", "end", "mean")
    }
    steady["current_A"] = current = probes["current"]
    steady["power_W"] = Estimate(voltage * current.value, voltage * current.error)
    bottoms = [given for name, given in probes.items() if name.startswith(INTO_SUBSTRATE)]
    steady["heat_out_W"] = Estimate(-sum(e.value for e in bottoms), sum(e.error for e in bottoms))
    rise, heat = steady["end_rise_K"], probes[THROUGH_END]
    if heat.value:
        # Heat is counted along the beam, which at its first end it leaves against that direction.
        value = -rise.value / heat.value
        error = abs(value) * (rise.error / abs(rise.value) + heat.error / abs(heat.value)) if rise.value else 0.0
        steady["anchor_resistance_K_per_W"] = Estimate(value, error)
    return replace(result, steady=steady)
