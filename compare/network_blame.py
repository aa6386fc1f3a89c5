"""Split the difference of a network of lines from 3D by joint.

3D's resistance of a joint is the difference of the mean temperatures over the joined cross-sections, divided by the
flow between the lines; of a condition, to the given temperature. The resistances of 3D replace the network's one after
the other. The remainder is the spread of flows over joints, and resistivities at the local temperature. The parts add
up to the whole difference.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from compare.blame import Budget, sentence, split
from fem3d.runs.scene import observe
from reduced1d.network.lines import layout
from reduced1d.network.solution import Place, places, solve_layout
from scenes.model import UNITS, AnyScene, Probe, Scene
from scenes.result import Estimate, Result

REST = "what lines cannot say"
FELT = 1e-3
"""Joints whose drop would change by less than this, of the largest rise (or potential), keep their resistance."""
LEAST = 0.02
"""Joints that carry less than this part of the largest flow (by hand) are not measured in 3D."""


def blame(given: AnyScene, fem3d: Result, network: Result) -> Budget:
    """Compute the budget of a network's steady differences from 3D.

    3D is solved once more, with probes of the mean temperatures and flows at all joints.
    """
    of_boxes: Any = given
    scene: Scene = replace(of_boxes, steady=True, output_times=())
    shape = layout(scene)
    joints = places(shape)
    probed = replace(shape.scene, probes=(*shape.scene.probes, *_probes(joints)))
    by_hand = {name: estimate.value for name, estimate in solve_layout(replace(shape, scene=probed)).steady.items()}
    flows = {kind: max([abs(by_hand[p.flow.name]) for p in joints if p.flow.quantity == kind], default=0.0)
             for kind in ("heat_flow", "current")}  # fmt: skip
    joints = [p for p in joints if abs(by_hand[p.flow.name]) > LEAST * flows[p.flow.quantity]]

    def needed(values: dict[str, float]) -> list[Probe]:
        # The dual problems improve these values: joints near the threshold may come to be felt.
        return _probes([place for place, _, _ in _changes(scene, joints, values, by_hand, FELT / 2)])

    in_3d = observe(scene, _probes(joints), needed)
    bounded = [place for place in joints if place.flow.name in in_3d]
    values_3d = {name: estimate.value for name, estimate in in_3d.items()}
    results, measured, names, unsure = [network.steady], list[tuple[tuple[str, int], float]](), list[str](), []
    for place, resistance, change in _changes(scene, bounded, values_3d, by_hand):
        measured.append((place.key, resistance))
        results.append(solve_layout(replace(shape, measured=tuple(measured))).steady)
        names.append(place.called)
        unsure.append(_uncertainty(place, resistance, change, in_3d))
    phrases = {name: f"the joint {name}, by 3D's resistance in its place" for name in names}
    phrases[REST] = f"{REST}, after all joints"
    results.append(fem3d.steady)
    quantities, splits = {probe.name: probe.quantity for probe in scene.probes}, []
    for name in network.steady:
        base = scene.initial_temperature if quantities[name] == "temperature" else 0.0
        values, errors = np.array([[steady[name].value] for steady in results]), [s[name].error for s in results]
        scale, unit = fem3d.steady[name].value - base, UNITS[quantities[name]]
        whole = "3D rise" if unit == "K" else "3D value"
        splits.append(split(name, unit, scale, whole, [*names, REST], values, errors, None, [*unsure, 0.0]))
    return Budget(network.model, tuple(splits), (), None, {}, sentence(phrases, splits))


def _probes(joints: list[Place]) -> list[Probe]:
    """Return the probes of both sides and of the flow of each joint."""
    probes = {p.name: p for place in joints for p in (place.one, place.other, place.flow) if p is not None}
    return list(probes.values())


def _changes(
    scene: Scene, joints: list[Place], in_3d: dict[str, float], by_hand: dict[str, float],
    least: float = FELT,
) -> list[tuple[Place, float, float]]:  # fmt: skip
    """The joints whose change of drop is felt, the largest first, with 3D's resistance and its change (K/W or ohm)."""

    def drop(place: Place, values: dict[str, float]) -> float:
        if place.other is not None:
            return values[place.one.name] - values[place.other.name]
        assert place.given is not None
        b = scene.boundaries[place.given]
        return values[place.one.name] - float(b.ambient if b.kind == "convection" else b.value)  # type: ignore

    rows, largest = [], {"temperature": 0.0, "potential": 0.0}
    for place in joints:
        flow, flow_by_hand = place.sign * in_3d[place.flow.name], place.sign * by_hand[place.flow.name]
        if not flow:
            continue
        resistance = drop(place, in_3d) / flow
        change = resistance - drop(place, by_hand) / flow_by_hand
        base = scene.initial_temperature if place.one.quantity == "temperature" else 0.0
        largest[place.one.quantity] = max(largest[place.one.quantity], abs(in_3d[place.one.name] - base))
        rows.append((abs(change * flow), place, resistance, change))
    felt = [row for row in rows if row[0] > least * largest[row[1].one.quantity] > 0]
    felt.sort(key=lambda row: -row[0] / largest[row[1].one.quantity])
    return [row[1:] for row in felt]


def _uncertainty(place: Place, resistance: float, change: float, in_3d: dict[str, Estimate]) -> float:
    """The error bound of 3D's resistance of a joint as a part of its change, at most 1."""
    flow = in_3d[place.flow.name]
    error = sum(in_3d[side.name].error for side in (place.one, place.other) if side is not None)
    return min((error + abs(resistance) * flow.error) / abs(flow.value * change), 1.0) if change else 1.0
