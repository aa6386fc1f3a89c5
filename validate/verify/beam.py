"""A scene with all features of both paths, solved by Newton's method on scikit-fem's own hexahedra too: a silicon
beam whose conductivity and resistivity follow the temperature, on an oxide foot behind a contact, below a cap that
radiates; driven by a given current.

The second path's own error is bounded by its change when its intervals are halved: next to an edge it falls by 2^(4/3)
from one mesh to the next, so that 0.7 of the change is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from benchmarks.rows import Row
from meshes.connected import scene_planes
from meshes.grid import Grid
from scenes.laws import PowerLaw, Table
from scenes.model import Boundary, Box, Contact, Material, Probe, Scene
from validate.verify import newton, second_path
from validate.verify.expected import Expected
from validate.verify.expected import rows as solved

FAMILY, CASE = "second paths", "silicon on a foot: laws, contact, radiation, given current"
ROOM, CURRENT = 293.0, 35e-3  # K, A: rises of some 350 K
ACCURACY = 1e-3  # of the solver: the second path is known less well
LENGTH, WIDTH, THICKNESS, FOOT = 40e-6, 10e-6, 4e-6, 10e-6  # m
# Of the length between two planes: along x and z intervals next to edges are short.
GRADED, EVEN = np.array([0.0, 0.12, 0.88, 1.0]), np.array([0.0, 1.0])


def beam() -> Scene:
    """The scene. The foot's underside and the beam's far end are cold."""
    silicon = Material(
        "silicon", PowerLaw(130.0, 293.0, -1.3), 2330.0, 712.0, Table((293.0, 500.0, 900.0), (6e-5, 7e-5, 9e-5))
    )
    oxide, gold = Material("oxide", 1.38, 2200.0, 703.0), Material("cap", (200.0, 100.0, 20.0), 3000.0, 700.0)
    low, high = (0.0, 0.0, 0.0), (LENGTH, WIDTH, THICKNESS)
    near, far = (low, (0.0, WIDTH, THICKNESS)), ((LENGTH, 0.0, 0.0), high)
    cap = (0.5 * LENGTH, 0.0, THICKNESS), (0.75 * LENGTH, WIDTH / 2, 1.5 * THICKNESS)
    foot = (0.0, 0.0, -THICKNESS), (FOOT, WIDTH, 0.0)
    boxes = (Box("beam", silicon, low, high), Box("foot", oxide, *foot), Box("cap", gold, *cap))
    boundaries = (
        Boundary("cold foot", "temperature", foot[0], (FOOT, WIDTH, -THICKNESS), ROOM),
        Boundary("cold end", "temperature", *far, ROOM),
        Boundary("top", "radiation", (cap[0][0], 0.0, cap[1][2]), cap[1], 0.9, ROOM),
        Boundary("plus", "voltage", *near, CURRENT, series_resistance=np.inf),
        Boundary("minus", "voltage", *far, 0.0),
    )
    probes = (
        Probe("beam", low, high), Probe("cap", *cap), Probe("foot", *foot),
        Probe("potential of plus", *near, "potential"),
    )  # fmt: skip
    contacts = (Contact("bond", ("beam", "foot"), 1e-6),)
    return Scene("beam", boxes, boundaries, probes, ROOM, accuracy=ACCURACY, steady=True, contacts=contacts)


def rows() -> Iterator[Row]:
    """Compare the readings of both solvers."""
    scene = beam()
    coarse, fine = (readings(scene, halvings) for halvings in (0, 1))
    rise = max(abs(fine[p.name] - ROOM) for p in scene.probes if p.quantity == "temperature")
    expected = []
    for probe in scene.probes:
        value, unsure = fine[probe.name], abs(fine[probe.name] - coarse[probe.name])
        unit, scale = ("K", rise) if probe.quantity == "temperature" else ("V", value)
        expected.append(Expected(probe.name, unit, value, scale, unsure, settled=ACCURACY))
    yield from solved(FAMILY, CASE, scene, expected, "Newton's method on scikit-fem's hexahedra")


def readings(scene: Scene, halvings: int) -> dict[str, float]:
    """Return the readings of the second path, its intervals halved some times."""
    breaks = []
    for axis, parts in enumerate((GRADED, EVEN, GRADED)):
        for _ in range(halvings):
            parts = np.sort(np.concatenate([parts, (parts[1:] + parts[:-1]) / 2]))
        planes = pairwise(scene_planes(scene, axis))
        breaks.append(np.unique(np.concatenate([a + (b - a) * parts for a, b in planes])))
    grid = Grid(tuple(breaks), tuple(np.full(len(b) - 1, 2) for b in breaks), scene.boxes)
    basis, owner, order = second_path.base(scene, grid)
    state = newton.steady(second_path.problem(scene, basis, owner, order), 4)
    return second_path.readings(scene, basis, state)
