"""The heat problem on a mesh of bricks: assembly by tensor products, and fields on the mesh's grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array

from fem3d import inputs, tensor
from fem3d.heat import Film, HeatSystem, above, coefficient, parts_of_reactions
from fem3d.ordering import nested_dissection
from meshes import connected
from meshes.bricks import Block, BrickMesh
from scenes.model import Boundary, Scene


@dataclass(frozen=True, eq=False)
class HeatProblem(HeatSystem):
    """The system of one mesh. ``number`` maps grid nodes to unknowns (-1: void), ``order`` lists the grid nodes in
    elimination order."""

    scene: Scene
    mesh: BrickMesh
    number: np.ndarray
    order: np.ndarray

    def on_block(self, block: Block, u: np.ndarray) -> np.ndarray:
        """The nodal values of a field (free or all nodes) on a block."""
        return self.whole(u)[self.number[self.mesh.numbers(block)]]

    def scatter(self, block: Block, nodal: np.ndarray, into: np.ndarray) -> None:
        """Add a block's nodal values to a vector of all nodes."""
        into[self.number[self.mesh.numbers(block)].ravel()] += nodal.ravel()

    def sample(self, rise: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(x, y, z): the rise (K) on a grid of coordinates inside the solved part, from a field."""
        grid = np.append(self.whole(rise), 0.0)[self.number].reshape(self.mesh.shape)
        a, b, c = (axis.interpolation(at) for axis, at in zip(self.mesh.axes, (x, y, z), strict=True))
        return tensor.along(a, b, c, grid)


def _conserve(stiffness: csc_array, to_the_air: np.ndarray) -> None:
    """Set the diagonal such that a uniform rise drives no heat but to the air (W/K per node), to the last digit.

    Sums of large entries leave rounding there, which on thin layers would show in the heat balance.
    """
    columns = np.repeat(np.arange(stiffness.shape[1]), np.diff(stiffness.indptr))
    on = stiffness.indices == columns
    sums = np.add.reduceat(stiffness.data.astype(np.longdouble), stiffness.indptr[:-1])
    stiffness.data[on] = (stiffness.data[on] - (sums - to_the_air)).astype(float)


def condition_nodes(mesh: BrickMesh, lower: Any, upper: Any, boxes: set[int] | None = None) -> np.ndarray:
    """Grid numbers of the nodes of a flat box where it touches the solid (or some boxes of it)."""
    found = [mesh.numbers(face).ravel() for face in mesh.faces(lower, upper, boxes)]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=int)


def assemble(scene: Scene, mesh: BrickMesh, balanced: bool = True) -> HeatProblem:
    """The heat problem of a scene (or of its symmetric part) on a mesh.

    ``balanced`` takes the trouble to conserve heat to the last digit, where the heat balance will be reported.
    """
    solid, channels, initial = mesh.solid, inputs.of(scene), scene.initial_temperature
    held = [b for b in scene.boundaries if b.kind == "temperature"]
    given = np.zeros((channels.count, solid.size))
    for b in held:
        given[:, condition_nodes(mesh, b.lower, b.upper)] = above(channels, b.value, initial)[:, None]
    parts_held, bent = shared(mesh, held)
    fixed = np.zeros(solid.size, dtype=bool)
    for part in parts_held.values():
        fixed |= part > 0
    number = np.full(solid.size, -1, dtype=np.int32)
    order = np.argsort(nested_dissection(mesh))
    free_nodes, fixed_nodes = order[(solid & ~fixed)[order]], order[(solid & fixed)[order]]
    number[free_nodes] = np.arange(len(free_nodes))
    number[fixed_nodes] = len(free_nodes) + np.arange(len(fixed_nodes))
    size = len(free_nodes) + len(fixed_nodes)

    rows, columns, entries = [], [], []
    loads = np.zeros((channels.count, size))
    generated = np.zeros(channels.count)
    films: dict[str, Film] = {}

    def add(block: Block, data: np.ndarray) -> None:
        r, c = tensor.pattern(mesh.parts(block), number[mesh.numbers(block)])
        rows.append(r)
        columns.append(c)
        entries.append(data)

    for block in mesh.blocks:
        parts, box = mesh.parts(block), mesh.boxes[block.box]
        k, c = box.material.thermal_conductivity, box.material.heat_capacity
        # Both matrices share one pattern, so both travel through one conversion as a complex number.
        add(block, k * tensor.stiffness(parts) + 1j * c * tensor.mass(parts))
        if box.heat_source:
            source, volume = channels.split(box.heat_source), tensor.integral(parts)
            loads[:, number[mesh.numbers(block)].ravel()] += np.outer(source, volume)
            generated += source * volume.sum()
    for b in scene.boundaries:
        if b.kind not in ("convection", "heat_flux"):
            continue
        area = np.zeros(size)
        h = coefficient(b.value) if b.kind == "convection" else 0.0
        for face in mesh.faces(b.lower, b.upper, exposed=True):
            parts = mesh.parts(face)
            area[number[mesh.numbers(face)].ravel()] += tensor.integral(parts).ravel()
            if h:
                add(face, h * tensor.mass(parts) + 0j)
        flux = channels.split(b.value) if b.kind == "heat_flux" else h * above(channels, b.ambient, initial)
        loads += np.outer(flux, area)
        films[b.name] = Film(flux * float(area.sum()), -h * area)
    joined = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    both = coo_array(joined, shape=(size, size)).tocsc()
    stiffness = csc_array((both.data.real.copy(), both.indices, both.indptr), shape=both.shape)
    if balanced:
        _conserve(stiffness, -sum((film.per_kelvin for film in films.values()), np.zeros(size)))
    mass = csc_array((both.data.imag.copy(), both.indices, both.indptr), shape=both.shape)
    return HeatProblem(
        channels, len(free_nodes), stiffness, mass, loads, given[:, fixed_nodes], generated,
        {name: part[fixed_nodes] for name, part in parts_held.items()}, bent[fixed_nodes], films,
        connected.anchored(scene), scene.end_time, scene, mesh, number, order,
    )  # fmt: skip


def shared(
    mesh: BrickMesh, boundaries: Sequence[Boundary], boxes: set[int] | None = None
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """For boundaries of given values their parts (nodes of the grid,) of the reactions (`parts_of_reactions`), of the
    solid or of some boxes of it, and where they meet at an angle."""
    size = int(np.prod(mesh.shape))
    areas, normals = [], np.zeros((3, size), dtype=bool)
    for b in boundaries:
        area = np.zeros(size)
        for face in mesh.faces(b.lower, b.upper, boxes):
            nodes = mesh.numbers(face).ravel()
            area[nodes] += tensor.integral(mesh.parts(face)).ravel()
            normals[next(d for d, (i, j) in enumerate(face.spans) if i == j), nodes] = True
        areas.append(area)
    bent = normals.sum(axis=0) > 1
    found = parts_of_reactions(areas, [b.value for b in boundaries], ~bent)
    return {b.name: part for b, part in zip(boundaries, found, strict=True)}, bent
