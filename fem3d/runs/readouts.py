"""Resistances of electrodes from the computed currents and potentials.

R = (phi - phi_other) / I, with the current I that enters at the electrode. An electrode's potential is its voltage less
the drop at its series resistance; an electrode of given current gets a probe for its potential.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from fem3d.results.outputs import Outputs
from fem3d.spaces import channels
from scenes import readouts
from scenes.free.grid import grid_of
from scenes.model import AnyScene, GroupProbe, MeshScene, Probe


def pairs(scene: AnyScene) -> dict[str, readouts.Pair]:
    """Return the two electrodes of each resistance probe."""
    if not any(p.quantity == "resistance" for p in scene.probes):
        return {}
    if isinstance(scene, MeshScene):
        from meshes.grouped.check import check
        from meshes.grouped.read import read

        joined = check(scene, read(scene.path, scene.unit)).joined()
    else:
        joined = grid_of(scene).joined()
    return readouts.pairs(scene, joined.values())


def to_solve(scene: Any) -> Any:
    """Return the scene to solve: without resistance probes, but if there are any with probes for the potentials of
    electrodes of given current."""
    read = tuple(p for p in scene.probes if p.quantity != "resistance")
    if len(read) == len(scene.probes):
        return scene
    by_current = (b for b in scene.boundaries if b.kind == "voltage" and b.series_resistance == inf)
    return replace(scene, probes=(*read, *map(_potential, by_current)))


def _potential(boundary: Any) -> Probe | GroupProbe:
    name = f"potential of {boundary.name}"
    if hasattr(boundary, "group"):
        return GroupProbe(name, group=boundary.group, quantity="potential")
    return Probe(name, boundary.lower, boundary.upper, "potential")


def resistance(pair: readouts.Pair, out: Outputs) -> np.ndarray:
    """Return the resistance (ohm) between two electrodes, at the times of some outputs."""
    return readouts.resistance(given(pair, out), out[f"current:{pair[0].name}"], out.get("time", np.zeros(())))


def given(pair: readouts.Pair, out: Outputs) -> np.ndarray:
    """Return the voltage (V) between two electrodes."""
    one, other = pair
    return _at(one, out) - _at(other, out)


def _at(boundary: Any, out: Outputs) -> np.ndarray:
    """Return the potential (V) of an electrode."""
    if boundary.series_resistance == inf:
        return out[f"probe:potential of {boundary.name}"]
    times = out["time"]
    given = channels.value(boundary.value, times.reshape(-1)).reshape(times.shape)
    return given - boundary.series_resistance * out[f"current:{boundary.name}"]
