"""The heat problem on a mesh with groups: assembly, and the order of the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from fem3d.heat import Film, HeatSystem, above, coefficient, parts_of_reactions
from fem3d.inputs import Inputs
from fem3d.unstructured.dissection import dissection
from fem3d.unstructured.space import FaceSpace, Space
from meshes.grouped.check_parts import touched
from meshes.grouped.place import Placed
from scenes.free.parts import is_exit
from scenes.meshed.model import GroupBoundary
from scenes.model import Schedule

PLANE = 0.95  # of normals' lengths that their sum keeps: faces that bend by less pass for one plane


@dataclass(frozen=True, eq=False)
class Heat(HeatSystem):
    """The system of a mesh and the functions on it."""

    placed: Placed
    space: Space


def inputs_of(placed: Placed) -> Inputs:
    """The channels of a scene on a mesh."""
    scene = placed.scene
    values = [v for b in scene.boundaries for v in (b.value, b.ambient)] + [s.heat_source for s in scene.sources]
    return Inputs(tuple(dict.fromkeys(v for v in values if isinstance(v, Schedule))))


def assemble(placed: Placed, degree: int) -> Heat:
    """The heat problem with elements of a degree."""
    scene, mesh = placed.scene, placed.mesh
    space, inputs, initial = Space(mesh, degree), inputs_of(placed), scene.initial_temperature
    given, fixed = np.zeros((inputs.count, space.size)), np.zeros(space.size, bool)
    held = [b for b in scene.boundaries if b.kind == "temperature"]
    for b in held:
        nodes = FaceSpace(space, placed.faces(b)).nodes()
        given[:, nodes], fixed[nodes] = above(inputs, b.value, initial)[:, None], True
    stiffness = space.stiffness(placed.per_cell("thermal_conductivity")[:, None])
    order = dissection(space.nodes, stiffness)
    order = np.concatenate([order[~fixed[order]], order[fixed[order]]])
    space.renumber(order)
    given, stiffness, free = given[:, order], stiffness[order][:, order], int((~fixed).sum())
    parts_held, bent = shared(placed, space, held)
    capacity = placed.per_cell("density") * placed.per_cell("specific_heat")
    loads, generated = np.zeros((inputs.count, space.size)), np.zeros(inputs.count)
    for s in scene.sources:
        channels, load = inputs.split(s.heat_source), space.load(np.ones(1), mesh.volumes[s.group])
        loads += np.outer(channels, load)
        generated += channels * load.sum()
    films = {}
    for b in scene.boundaries:
        if b.kind not in ("heat_flux", "convection"):
            continue
        face = FaceSpace(space, placed.faces(b))
        area, h = face.load(), 0.0
        if b.kind == "convection":
            h = coefficient(b.value)
            stiffness = stiffness + h * face.mass()
            flux = h * above(inputs, b.ambient, initial)
        else:
            flux = inputs.split(b.value)
        loads += np.outer(flux, area)
        films[b.name] = Film(flux * float(area.sum()), -h * area)
    parts = mesh.parts(np.ones(len(mesh.cells), bool))
    anchored = len(touched(placed, parts, [b for b in scene.boundaries if is_exit(b)])) == parts.max()
    return Heat(
        inputs, free, csc_array(stiffness), space.mass(capacity[:, None]), loads, given[:, free:], generated,
        {name: part[free:] for name, part in parts_held.items()}, bent[free:], films, anchored, scene.end_time, placed,
        space,
    )  # fmt: skip


def shared(
    placed: Placed, space: Space, boundaries: Sequence[GroupBoundary]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """For boundaries of given values their parts (nodes,) of the reactions (`parts_of_reactions`),
    and where they meet at an angle."""
    areas, normals = [], []
    for b in boundaries:
        face = FaceSpace(space, placed.faces(b))
        area, nodes = np.zeros(space.size), face.nodes()
        # The square of the basis function: its own integral vanishes at corners of quadratic triangles.
        area[nodes] = face.mass().diagonal()[nodes]
        areas.append(area)
        normals.append(face.normal())
    lengths = np.sum([np.linalg.norm(n, axis=1) for n in normals] or [np.zeros(space.size)], axis=0)
    plane = np.linalg.norm(np.sum(normals or [np.zeros((space.size, 3))], axis=0), axis=1) >= PLANE * lengths
    found = parts_of_reactions(areas, [b.value for b in boundaries], plane)
    return {b.name: part for b, part in zip(boundaries, found, strict=True)}, ~plane
