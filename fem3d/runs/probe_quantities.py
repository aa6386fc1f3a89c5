"""The quantities of a free scene: its probes, temperatures in K, potentials in V, heat flows and powers in W,
currents in A, resistances in ohm.

An error is relative to the largest rise of the probe (above the coldest given temperature, or above the start), but to
no less than a tenth of the largest rise in the scene; of a potential to the span of the voltages; of a flow or a
current to its own size, but to no less than a hundredth of what passes the scene, or would
pass its least conducting box at its largest rise; of a heat flow in a steady state to no less than rounding leaves
of it; a power like a flow, and of a resistance to its largest value.
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
FIELD = 0.1  # of the largest rise: what the field at any node may be off by, as far as a few more levels can do that
EARLY, LATE = 1e-3, 0.1  # of the end time: of `_earliest` where no instants are asked for, and at most


def study(scene: AnyScene, part: Symmetry) -> Study:
    """What is to be found of a scene; of the field on a mesh file nothing is known to bound the error."""
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
    """The largest difference of the voltages (V), or where none differ the largest current (A): it names the drive."""
    return _span(scene, "voltage") or _span(scene, "current")


def _span(scene: AnyScene, key: str) -> float:
    """The largest difference of the given voltages, or the largest given current."""
    given = _spread(b.value for b in scene.boundaries if b.kind == "voltage" and b.key == key)
    return max(map(abs, given), default=0.0) if key == "current" else max(given, default=0.0) - min(given, default=0.0)


def _earliest(scene: AnyScene) -> float:
    """The time (s) after the start, and after a jump of a given temperature, from which on traces hold their accuracy:
    that of the first instant that is asked for, and of any other but those right after a jump."""
    end = scene.end_time
    given = [b.value for b in scene.boundaries if b.kind == "temperature" and isinstance(b.value, Schedule)]
    jumps = [t for s in given for t, following in pairwise(s.times) if t == following]
    instants = [t for t in scene.output_times if 0 < t <= end]
    since = [min(t - jump for jump in jumps if t > jump) for t in instants if t > min(jumps, default=end)]
    after = [*instants, *(t for t in since if t >= EARLY * end)]
    return min(*after, LATE * end) if instants else EARLY * end


def values(scene: AnyScene, out: Outputs, pairs: Mapping[str, Pair]) -> Quantities:
    """The value of each probe; ``pairs`` are the electrodes of those of resistances (`readouts.pairs`)."""

    def value(probe: Probe | GroupProbe) -> np.ndarray:
        if probe.name in pairs:
            return readouts.resistance(pairs[probe.name], out)
        return out[f"probe:{probe.name}"] + (scene.initial_temperature if probe.quantity == "temperature" else 0.0)

    return {p.name: value(p) for p in scene.probes}


def scales(scene: AnyScene, out: Outputs, pairs: Mapping[str, Pair]) -> dict[str, float]:
    """What an error of each probe is relative to; ``pairs`` as of `values`."""
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
    # Under given currents the potentials span what the power says.
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
    """That of the box along which heat has the longest way (W/K); none is known of a mesh."""

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
    """All numbers that some values take."""
    numbers: list[float] = []
    for v in given:
        numbers += list(v.values) if isinstance(v, Schedule) else [float(v)]
    return numbers
