"""Quantities of a free scene: its probes, temperatures in K, potentials in V, heat flows and powers in W, currents in
A, resistances in ohm.

Errors are relative to a scale. For a temperature it is the probe's largest rise above the coldest given temperature, or
above the start, and at least a tenth of the largest rise in the scene. For a potential it is the span of the voltages,
for a resistance its largest value. For a flow, power or current it is the largest value, and at least a hundredth of
the total through the scene, or of the heat through its least conducting box at the largest rise; for a steady heat flow
also at least the rounding error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.results.outputs import Outputs
from fem3d.results.study import Quantities, Study
from fem3d.runs import readouts
from meshes.symmetry import Symmetry
from scenes import laws
from scenes.model import DERIVED, AnyScene, Box, GroupProbe, Probe, Scene, Schedule, Value
from scenes.readouts import Pair

OF_RISE, OF_FLOW = 0.1, 0.01
ISOTHERMAL = 1e-9  # a rise below this fraction of the given ones is rounding, and no measure of temperature errors
FIELD = 0.1  # of the largest rise: aimed error of the field at any node, within a few more levels
EARLY, LATE = 1e-3, 0.1  # parts of the end time: `_earliest` without requested instants, and its largest value


def study(scene: AnyScene, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a scene; on a mesh file no error bound of the field exists."""
    probes: dict[str, Probe | GroupProbe] = {p.name: p for p in scene.probes}
    goals, pairs = {n: n for n, p in probes.items() if p.quantity not in DERIVED}, readouts.pairs(scene)
    thermal = tuple(n for n, p in probes.items() if p.quantity == "temperature")
    return Study(
        part, scene.accuracy, _drive(scene), scene.end_time,
        _earliest(scene), scene.output_times,
        goals=goals, trace_goals=goals, rises=thermal, trace_rises=thermal, ratios={},
        steady=lambda out: values(scene, out, pairs), traces=lambda out: values(scene, out, pairs),
        steady_scales=lambda out: scales(scene, out, pairs), trace_scales=lambda out: scales(scene, out, pairs),
        field=FIELD if isinstance(scene, Scene) else None, from_start=True,
    )  # fmt: skip


def _drive(scene: AnyScene) -> float:
    """Return the largest difference of the voltages (V), or if none differ the largest current (A), as the drive."""
    return _span(scene, "voltage") or _span(scene, "current")


def _span(scene: AnyScene, key: str) -> float:
    """Return the largest difference of the given voltages (V), or the largest given current (A)."""
    given = _spread(b.value for b in scene.boundaries if b.kind == "voltage" and b.key == key)
    return max(map(abs, given), default=0.0) if key == "current" else max(given, default=0.0) - min(given, default=0.0)


def _earliest(scene: AnyScene) -> float:
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
    """Return the value of each probe; ``pairs`` are the electrodes of resistance probes (`readouts.pairs`)."""

    def value(probe: Probe | GroupProbe) -> np.ndarray:
        if probe.name in pairs:
            return readouts.resistance(pairs[probe.name], out)
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
    rises = {p.name: _largest(out[f"probe:{p.name}"] + start - floor) for p in _of(scene, "temperature")}
    rise = max([*rises.values(), *(abs(t - floor) for t in given)], default=0.0)
    farthest = max([rise, *(abs(t - start) for t in given)])
    if rise <= ISOTHERMAL * farthest:
        rise = farthest
    through = max((_largest(v) for n, v in out.items() if n.startswith("flow:")), default=0.0)
    made = _largest(out["power"]), _largest(out["generated"])
    through = max(through, *made, _least_conductance(scene) * rise)
    current = max((_largest(v) for n, v in out.items() if n.startswith("current:")), default=0.0)
    # Under given currents the power over the current is the span of the potentials.
    span = max(_span(scene, "voltage"), _largest(out["power"]) / (current or 1.0) if _span(scene, "current") else 0.0)

    def scale(probe: Probe | GroupProbe) -> float:
        if probe.name in pairs:
            return _largest(readouts.resistance(pairs[probe.name], out)) or 1.0
        largest = _largest(out[f"probe:{probe.name}"])
        return {
            "temperature": max(rises.get(probe.name, 0.0), OF_RISE * rise),
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


def _of(scene: AnyScene, quantity: str) -> list[Any]:
    return [p for p in scene.probes if p.quantity == quantity]


def _largest(value: np.ndarray) -> float:
    return float(np.abs(value).max())


def _spread(given: Iterable[Value]) -> list[float]:
    """Return all numbers that some values take."""
    numbers: list[float] = []
    for v in given:
        numbers += list(v.values) if isinstance(v, Schedule) else [float(v)]
    return numbers
