"""Split the difference of a network of lines from 3D by joint.

3D's resistance of a joint is the difference of the mean temperatures over the joined cross-sections, divided by the
flow between the lines; of a condition, to the given temperature. The resistances of 3D replace the network's one after
the other. The remainder is the spread of flows over joints, and resistivities at the local temperature. The parts add
up to the whole difference.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

from compare.blame import Budget, Part, Split
from fem3d.runs.observed import observe
from reduced1d.network.lines import layout
from reduced1d.network.places import Place, places
from reduced1d.network.solution import of_layout
from scenes import physics
from scenes.formats import percent, signed
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
    joints = places(shape, bool(shape.electrodes) and physics.electric(scene))
    probed = replace(shape.scene, probes=(*shape.scene.probes, *_probes(joints)))
    by_hand = {name: estimate.value for name, estimate in of_layout(replace(shape, scene=probed)).steady.items()}
    largest = {kind: max([abs(by_hand[p.flow.name]) for p in joints if p.flow.quantity == kind], default=0.0)
               for kind in ("heat_flow", "current")}  # fmt: skip
    joints = [p for p in joints if abs(by_hand[p.flow.name]) > LEAST * largest[p.flow.quantity]]

    def needed(values: dict[str, float]) -> list[Probe]:
        # The dual problems improve these values: joints near the threshold may come to be felt.
        return _probes([place for place, _, _ in _changes(scene, joints, values, by_hand, FELT / 2)])

    in_3d = observe(scene, _probes(joints), needed)
    bounded = [place for place in joints if place.flow.name in in_3d]
    changes = _changes(scene, bounded, {name: estimate.value for name, estimate in in_3d.items()}, by_hand)
    results, measured = [network.steady], list[tuple[tuple[str, int], float]]()
    for place, resistance, _ in changes:
        measured.append((place.key, resistance))
        results.append(of_layout(replace(shape, measured=tuple(measured))).steady)
    names = [(place.called, _uncertainty(place, resistance, change, in_3d)) for place, resistance, change in changes]
    splits = [_split(scene, name, [*(r[name] for r in results), fem3d.steady[name]], names) for name in network.steady]
    return Budget(network.model, tuple(splits), (), None, {}, _sentence(splits))


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


def _split(scene: Scene, name: str, values: list[Estimate], names: list[tuple[str, float]]) -> Split:
    """The parts of one probe's difference, relative to its 3D rise or value, with its sign, as its check is."""
    quantity = next(p.quantity for p in scene.probes if p.name == name)
    base = scene.initial_temperature if quantity == "temperature" else 0.0
    drops = [(a.value - b.value, a.error + b.error) for a, b in pairwise(values)]
    sure = [abs(drop) * unsure for (drop, _), (_, unsure) in zip(drops, names, strict=False)]
    errors = [error + more for (_, error), more in zip(drops, [*sure, sum(sure)], strict=True)]
    called = [*(name for name, _ in names), REST]
    parts = tuple(Part(c, d[0], e) for c, d, e in zip(called, drops, errors, strict=True))
    total = values[0].value - values[-1].value
    return Split(name, UNITS[quantity], values[-1].value - base, total, values[0].error + values[-1].error, parts)


def _sentence(splits: list[Split]) -> str:
    """The largest part, relative to its scale."""
    candidates = [(split, part) for split in splits if split.scale for part in split.parts]
    split, part = max(candidates, key=lambda pair: abs(pair[1].value / pair[0].scale))
    if abs(part.value) <= part.error:
        return "nothing is to blame: no part of the difference is larger than its numerical error"
    share = (
        f"{signed(part.value, split.unit)} of {split.quantity}, {percent(abs(part.value / split.scale))} of what 3D has"
    )
    rest = signed(split.total - part.value, split.unit)
    if part.blame == REST:
        return f"the largest part is what lines cannot say: {share}; all joints together make {rest}"
    return f"the largest part is the joint {part.blame}: {share}; all the rest together makes {rest}"
