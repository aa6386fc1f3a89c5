"""Which parts of a scene hang together, and which of them heat can leave or current can pass.

All of it is decided on the coarsest grid, whose breakpoints are the planes of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from meshes.axis import Axis
from meshes.bricks import VOID, BrickMesh
from meshes.planes import scene_planes
from scenes.model import Boundary, Point, Scene, Value


@lru_cache(maxsize=16)
def coarsest(scene: Scene) -> BrickMesh:
    """The mesh whose only breakpoints are the planes of a scene."""
    x, y, z = (Axis(np.array(p), np.ones(len(p) - 1, dtype=int)) for p in (scene_planes(scene, d) for d in range(3)))
    return BrickMesh((x, y, z), scene.boxes)


def parts(mesh: BrickMesh, boxes: set[int], cuts: Sequence[tuple[Point, Point]] = ()) -> np.ndarray:
    """A label for each cell of some boxes, equal where cells are joined by faces that no cut covers; VOID elsewhere."""
    inside = np.isin(mesh.owner, sorted(boxes))
    joined = _joined(inside)
    for d, (_, _, open_faces) in enumerate(joined):
        for cut in cuts:
            spans = mesh.spans(*cut)
            if spans[d][0] == spans[d][1] and 0 < spans[d][0] < inside.shape[d]:
                window = [slice(*span) for span in spans]
                window[d] = slice(spans[d][0] - 1, spans[d][0])
                open_faces[tuple(window)] = False
    return _labelled(inside, joined)


def pieces(inside: np.ndarray) -> list[np.ndarray]:
    """The cells of a grid of any dimension in pieces that faces join, each like ``inside``."""
    labels = _labelled(inside, _joined(inside))
    return [labels == label for label in np.unique(labels[inside])]


_Joined = list[
    tuple[tuple[slice, ...], tuple[slice, ...], np.ndarray]
]  # per axis the lower cells, the upper ones, faces


def _joined(inside: np.ndarray) -> _Joined:
    """Along each axis, which faces between cells have one of ``inside`` on either side."""
    found = []
    for d in range(inside.ndim):
        low, high = [slice(None)] * inside.ndim, [slice(None)] * inside.ndim
        low[d], high[d] = slice(None, -1), slice(1, None)
        found.append((tuple(low), tuple(high), inside[tuple(low)] & inside[tuple(high)]))
    return found


def _labelled(inside: np.ndarray, joined: _Joined) -> np.ndarray:
    """A label for each cell, the same where faces join them; VOID elsewhere."""
    labels = np.where(inside, np.arange(inside.size).reshape(inside.shape), VOID)
    while True:
        before = labels.copy()
        for low_at, high_at, open_faces in joined:
            least = np.minimum(labels[low_at], labels[high_at])
            for side in (low_at, high_at):
                labels[side] = np.where(open_faces, np.minimum(labels[side], least), labels[side])
        if (labels == before).all():
            return labels


@lru_cache(maxsize=16)
def anchored(scene: Scene) -> bool:
    """Whether heat can leave every connected part of the solid: to a given temperature, or to the air."""
    mesh = coarsest(scene)
    labels = parts(mesh, set(range(len(scene.boxes))))
    found: set[int] = set()
    for b in scene.boundaries:
        if b.kind == "temperature" or (b.kind == "convection" and b.value):
            found |= _touched(mesh, labels, b, exposed=b.kind == "convection")
    return set(np.unique(labels[labels != VOID]).tolist()) <= found


def conducting(scene: Scene) -> set[int]:
    """Numbers of the boxes that conduct."""
    return {i for i, b in enumerate(scene.boxes) if b.material.resistivity is not None}


@lru_cache(maxsize=16)
def live(scene: Scene) -> np.ndarray:
    """(nx, ny, nz) of `coarsest`: the cells that current can pass, in parts that touch electrodes of two voltages."""
    mesh = coarsest(scene)
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    labels = parts(mesh, conducting(scene), [(b.lower, b.upper) for b in electrodes])
    voltages: dict[int, set[object]] = {}
    for b in electrodes:
        for label in _touched(mesh, labels, b):
            voltages.setdefault(label, set()).add(b.value)
    return np.isin(labels, [label for label, found in voltages.items() if len(found) > 1])


@lru_cache(maxsize=16)
def still(scene: Scene) -> tuple[tuple[np.ndarray, Value], ...]:
    """Cells (nx, ny, nz of `coarsest`) of each conducting part that touches electrodes of one voltage only, and that
    voltage: no current passes, and it has their potential."""
    mesh = coarsest(scene)
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    labels = parts(mesh, conducting(scene), [(b.lower, b.upper) for b in electrodes])
    voltages: dict[int, set[Value]] = {}
    for b in electrodes:
        for label in _touched(mesh, labels, b):
            voltages.setdefault(label, set()).add(b.value)
    return tuple((labels == label, next(iter(found))) for label, found in voltages.items() if len(found) == 1)


def refined(scene: Scene, mesh: BrickMesh, cells: np.ndarray) -> np.ndarray:
    """Cells of `coarsest` as cells of a finer mesh of the same scene."""
    within = [
        np.searchsorted(c.breaks, (f.breaks[1:] + f.breaks[:-1]) / 2) - 1
        for c, f in zip(coarsest(scene).axes, mesh.axes, strict=True)
    ]
    found: np.ndarray = cells[np.ix_(*within)]
    return found


def _touched(mesh: BrickMesh, labels: np.ndarray, boundary: Boundary, exposed: bool = False) -> set[int]:
    """The labels of the cells on either side of a flat box."""
    found: set[int] = set()
    for face in mesh.faces(boundary.lower, boundary.upper, exposed=exposed):
        flat = next(d for d in range(3) if face.spans[d][0] == face.spans[d][1])
        window = [slice(*span) for span in face.spans]
        window[flat] = slice(max(face.spans[flat][0] - 1, 0), face.spans[flat][0] + 1)
        found |= set(np.unique(labels[tuple(window)]).tolist())
    return found - {VOID}
