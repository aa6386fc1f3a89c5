"""A brick mesh as NGSolve's mesh of hexahedra, in micrometres, with the named faces that the sink needs."""

from __future__ import annotations

from typing import Any

import netgen.meshing as netgen
import ngsolve
import numpy as np

from meshes.bricks import VOID, BrickMesh

MICRO = 1e6
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
FACES = np.array([[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]])
NAMES = ("rest", "substrate", "end", "middle")


def of(mesh: BrickMesh, degrees: tuple[int, int, int]) -> ngsolve.Mesh:
    """The mesh of a quarter of a sink: boxes are its materials; "substrate" is the oxide's underside, "end" the beam's
    (inside the solid), "middle" the plane that cuts the beam in half. ``degrees`` in x, y, z are for `orders`."""
    found = netgen.Mesh(dim=3)
    cells = np.argwhere(mesh.owner != VOID)
    shape = tuple(len(axis.breaks) for axis in mesh.axes)
    indices = np.ravel_multi_index(tuple(np.moveaxis(cells[:, None] + CORNERS, -1, 0)), shape)
    used, local = np.unique(indices, return_inverse=True)
    local = local.reshape(-1, 8)
    at = np.array([axis.breaks[i] * MICRO for axis, i in zip(mesh.axes, np.unravel_index(used, shape), strict=True)]).T
    points = [found.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in at]
    for number, box in enumerate(mesh.boxes):
        found.SetMaterial(number + 1, box.name)
    owner = mesh.owner[tuple(cells.T)]
    for cell, box_number in zip(local, owner, strict=True):
        found.Add(netgen.Element3D(int(box_number) + 1, [points[i] for i in cell]))
    for number, name in enumerate(NAMES):
        found.Add(netgen.FaceDescriptor(surfnr=number + 1, domin=1, domout=0, bc=number + 1))
        found.SetBCName(number, name)
    for face, boxes in _faces(local, owner):
        known = _name(at[face].mean(axis=0), at, [mesh.boxes[b].name for b in boxes])
        if known:
            found.Add(netgen.Element2D(NAMES.index(known) + 1, [points[i] for i in face]))
    made = ngsolve.Mesh(found)
    for element in made.Elements():
        made.SetElementOrders(ngsolve.ElementId(element), degrees)
    return made


def orders(degree: int, depth: int) -> dict[str, Any]:
    """What a space on the mesh takes for its orders: one everywhere, or those of the mesh, another one in z.

    With ``relorder`` alone (as many more than the mesh has) NGSolve takes each edge's and face's order from the
    elements at it; the flag is none of those it documents.
    """
    return {"order": degree} if degree == depth else {"relorder": 0}


def _faces(local: np.ndarray, owner: np.ndarray) -> list[tuple[np.ndarray, list[int]]]:
    """Every face (four corners), with the boxes on its sides."""
    found: dict[tuple[int, ...], tuple[np.ndarray, list[int]]] = {}
    for cell, box in zip(local, owner, strict=True):
        for face in cell[FACES]:
            found.setdefault(tuple(sorted(face)), (face, []))[1].append(int(box))
    return list(found.values())


def _name(middle: np.ndarray, at: np.ndarray, boxes: list[str]) -> str | None:
    if len(boxes) == 2:
        return "end" if "beam" in boxes and abs(middle[1]) < 1e-9 and boxes[0] != boxes[1] else None
    if abs(middle[2] - at[:, 2].min()) < 1e-9:
        return "substrate"
    return "middle" if abs(middle[1] - at[:, 1].max()) < 1e-9 else "rest"
