"""Scenes of boxes as mesh files, so that they are solved on cells of a file and compared with the boxes themselves."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
from skfem import MeshHex
from skfem.io.meshio import HEX_MAPPING

from scenes.free.grid import grid_of
from scenes.model import Body, Boundary, Box, GroupBoundary, GroupProbe, MeshScene, Scene, Source


def on_mesh(scene: Scene, file: Path, tetrahedra: bool) -> MeshScene:
    """Write the boxes as a Gmsh file of tetrahedra or hexahedra, with a group for each box and boundary; return the
    scene on that file. Boxes do not overlap, and each probe reads a box or the place of a boundary."""
    mesh = MeshHex.init_tensor(*(np.union1d(p, (p[1:] + p[:-1]) / 2) for p in grid_of(scene).planes))
    inside = [_inside(mesh.p, mesh.t, box) for box in scene.boxes]
    mesh = mesh.restrict(np.flatnonzero(np.any(inside, axis=0)))
    volume, surface, order = "hexahedron", "quad", HEX_MAPPING[:8]
    if tetrahedra:
        mesh, volume, surface, order = mesh.to_meshtet(), "tetra", "triangle", [0, 1, 2, 3]
    blocks = [(volume, mesh.t[order][:, _inside(mesh.p, mesh.t, box)].T) for box in scene.boxes]
    blocks += [(surface, mesh.facets[:, _inside(mesh.p, mesh.facets, b)].T) for b in scene.boundaries]
    items: list[Box | Boundary] = [*scene.boxes, *scene.boundaries]
    tags = [np.full(len(cells), number) for number, (_, cells) in enumerate(blocks, 1)]
    names = {x.name: np.array([n, 3 if isinstance(x, Box) else 2]) for n, x in enumerate(items, 1)}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(mesh.p.T, blocks, cell_data=data, field_data=names).write(file, file_format="gmsh22", binary=False)
    group = {(x.lower, x.upper): x.name for x in items}
    return MeshScene(
        scene.name, file.name, 1.0, tuple(Body(box.material, (box.name,)) for box in scene.boxes),
        tuple(Source(box.name, box.name, box.heat_source) for box in scene.boxes if box.heat_source),
        tuple(GroupBoundary(b.name, b.kind, b.name, b.value, b.ambient, series_resistance=b.series_resistance)
              for b in scene.boundaries),
        tuple(GroupProbe(p.name, None, group[p.lower, p.upper], p.quantity) for p in scene.probes),
        scene.initial_temperature, scene.end_time, scene.accuracy, scene.steady, scene.output_times, str(file.parent),
        contacts=scene.contacts,
    )  # fmt: skip


def _inside(points: np.ndarray, cells: np.ndarray, item: Box | Boundary) -> np.ndarray:
    """Return whether the middle of each cell or facet (corners, n) lies in a box, or in the place of a boundary."""
    middles, small = points[:, cells].mean(axis=1).T, 1e-9 * np.ptp(points)
    return np.asarray(((middles > np.array(item.lower) - small) & (middles < np.array(item.upper) + small)).all(axis=1))
