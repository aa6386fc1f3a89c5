"""Quantities of a free scene: its probes, temperatures in K, potentials in V, heat flows and powers in W, currents in
A, resistances in ohm.

Errors are relative to a scale. For a temperature it is the probe's largest rise above the coldest given temperature, or
above the start, and at least a tenth of the largest rise in the scene. For a potential it is the span of the voltages,
for a resistance its largest value. For a flow, power or current it is the largest value, and at least a hundredth of
the total through the scene, or of the heat through its least conducting box at the largest rise; for a steady heat flow
also at least the rounding error.

The resistance of an electrode is R = (phi - phi_other) / I, with the current I that enters at the electrode. An
electrode's potential is its voltage less the drop at its series resistance; an electrode of given current gets a probe
for its potential.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from fem3d.results.outputs import Outputs, Quantities, Study
from meshes.symmetry import Symmetry
from scenes import laws
from scenes.free import graph
from scenes.free.graph import Pair
from scenes.free.grid import grid_of
from scenes.model import DERIVED, ROUNDING, AnyScene, Box, GroupProbe, MeshScene, Probe, Scene, Schedule, Value
from statespace import channels

OF_FLOW = 0.01  # of the largest flow, power or current: the least scale of the error of one. A choice: 0 has no scale
# Parts of the end time: `earliest` without requested instants, and its largest value. Choices: a tenth of the earliest
# time takes first layers thinner by the root of 10, and a late first instant leaves a tenth of the run without bounds.
EARLY, LATE = 1e-3, 0.1


def pairs(scene: AnyScene) -> dict[str, graph.Pair]:
    """Return the two electrodes of each resistance probe."""
    if not any(p.quantity == "resistance" for p in scene.probes):
        return {}
    if isinstance(scene, MeshScene):
        from meshes.grouped.check import check
        from meshes.grouped.read import read

        return graph.pairs(check(scene, read(scene.path, scene.unit)))
    return graph.pairs(grid_of(scene))


def to_solve(scene: Any) -> Any:
    """Return the scene to solve: with potentials of electrodes of given current in place of resistance probes."""
    probes = [p for p in scene.probes if p.quantity != "resistance"]
    if len(probes) == len(scene.probes):
        return scene
    for b in scene.boundaries:
        if b.kind == "voltage" and b.series_resistance == inf:
            name = f"potential of {b.name}"
            if isinstance(scene, MeshScene):
                probes.append(GroupProbe(name, group=b.group, quantity="potential"))
            else:
                probes.append(Probe(name, b.lower, b.upper, "potential"))
    return replace(scene, probes=tuple(probes))


def resistance(pair: graph.Pair, out: Outputs) -> np.ndarray:
    """Return the resistance (ohm) between two electrodes, at the times of some outputs."""
    voltage, current = _at(pair[0], out) - _at(pair[1], out), out[f"current:{pair[0].name}"]
    return graph.resistance(voltage, current, out.get("time", np.zeros(())))


def _at(boundary: Any, out: Outputs) -> np.ndarray:
    """Return the potential (V) of an electrode."""
    if boundary.series_resistance == inf:
        return out[f"probe:potential of {boundary.name}"]
    times = out["time"]
    given = channels.value(boundary.value, times.reshape(-1)).reshape(times.shape)
    return given - boundary.series_resistance * out[f"current:{boundary.name}"]


def study(scene: AnyScene, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a scene; on a mesh file no error bound of the field exists."""
    probes: dict[str, Probe | GroupProbe] = {p.name: p for p in scene.probes}
    goals, electrodes = {n: n for n, p in probes.items() if p.quantity not in DERIVED}, pairs(scene)
    return Study(
        part, scene.accuracy, drive=_span(scene, "voltage") or _span(scene, "current"), end=scene.end_time,
        earliest=earliest(scene), instants=scene.output_times, goals=goals, trace_goals=goals, ratios={},
        steady=lambda out: values(scene, out, electrodes), traces=lambda out: values(scene, out, electrodes),
        steady_scales=lambda out: scales(scene, out, electrodes),
        trace_scales=lambda out: scales(scene, out, electrodes),
        # Of the largest rise: aimed error of the field at any node, within a few more levels.
        field_accuracy=0.1 if isinstance(scene, Scene) else None, from_start=True,
    )  # fmt: skip


def _span(scene: AnyScene, key: str) -> float:
    """Return the largest difference of the given voltages (V), or the largest given current (A)."""
    given = _spread(b.value for b in scene.boundaries if b.kind == "voltage" and b.key == key)
    return max(map(abs, given), default=0.0) if key == "current" else max(given, default=0.0) - min(given, default=0.0)


def earliest(scene: AnyScene) -> float:
    """Return the time (s) after the start, and after a jump of a given temperature, from which on traces hold their
    accuracy: the first requested instant, or less if another one, not right after a jump, is closer to its jump."""
    end = scene.end_time
    given = [b.value for b in scene.boundaries if b.kind == "temperature" and isinstance(b.value, Schedule)]
    jumps = [t for s in given for t, following in pairwise(s.times) if t == following]
    instants = [t for t in scene.output_times if 0 < t <= end]
    since = [min(t - jump for jump in jumps if t > jump) for t in instants if t > min(jumps, default=end)]
    after = [*instants, *(t for t in since if t >= EARLY * end)]
    return min(*after, LATE * end) if instants else EARLY * end


def values(scene: AnyScene, out: Outputs, pairs: Mapping[str, Pair]) -> Quantities:
    """Return the value of each probe; ``pairs`` are the electrodes of resistance probes (`pairs`)."""

    def value(probe: Probe | GroupProbe) -> np.ndarray:
        if probe.name in pairs:
            return resistance(pairs[probe.name], out)
        return out[f"probe:{probe.name}"] + (scene.initial_temperature if probe.quantity == "temperature" else 0.0)

    return {p.name: value(p) for p in scene.probes}


def scales(scene: AnyScene, out: Outputs, pairs: Mapping[str, Pair]) -> dict[str, float]:
    """Return the scale for the error of each probe, in its unit; ``pairs`` as for `values`."""
    given = _spread(
        v for b in scene.boundaries for v in ((b.value,) if b.kind == "temperature" else (b.ambient,))
        if b.kind in ("temperature", "convection", "radiation")
    )  # fmt: skip
    start = scene.initial_temperature
    floor = min(given, default=start) if scene.steady else start
    thermal = [p for p in scene.probes if p.quantity == "temperature"]
    rises = {p.name: _largest(out[f"probe:{p.name}"] + start - floor) for p in thermal}
    rise = max([*rises.values(), *(abs(t - floor) for t in given)], default=0.0)
    farthest = max([rise, *(abs(t - start) for t in given)])
    if rise <= ROUNDING * farthest:  # rounding, and no measure of temperature errors
        rise = farthest
    through = max((_largest(v) for n, v in out.items() if n.startswith("flow:")), default=0.0)
    made = _largest(out["power"]), _largest(out["generated"])
    through = max(through, *made, _least_conductance(scene) * rise)
    current = max((_largest(v) for n, v in out.items() if n.startswith("current:")), default=0.0)
    # Under given currents the power over the current is the span of the potentials.
    span = max(_span(scene, "voltage"), _largest(out["power"]) / (current or 1.0) if _span(scene, "current") else 0.0)

    def scale(probe: Probe | GroupProbe) -> float:
        if probe.name in pairs:
            return _largest(resistance(pairs[probe.name], out)) or 1.0
        largest = _largest(out[f"probe:{probe.name}"])
        return {
            "temperature": max(rises.get(probe.name, 0.0), 0.1 * rise),
            "potential": span,
            "heat_flow": max(largest, OF_FLOW * through, float(out.get("rounding", 0.0))),
            "power": max(largest, OF_FLOW * through),
            "current": max(largest, OF_FLOW * current),
        }[probe.quantity] or 1.0

    return {p.name: scale(p) for p in scene.probes}


def _least_conductance(scene: AnyScene) -> float:
    """Return the least conductance (W/K) of any box along its longest side; 0 for a mesh."""

    def along(box: Box) -> float:
        sides = sorted(abs(b - a) for a, b in zip(box.lower, box.upper, strict=True))
        k = laws.along(box.material.at(scene.initial_temperature).thermal_conductivity)
        return float(max(k) * sides[0] * sides[1] / sides[2])

    return min(map(along, getattr(scene, "boxes", ())), default=0.0)


def _largest(value: np.ndarray) -> float:
    return float(np.abs(value).max())


def _spread(given: Iterable[Value]) -> list[float]:
    """Return all numbers that some values take."""
    return [number for v in given for number in (v.values if isinstance(v, Schedule) else [float(v)])]
