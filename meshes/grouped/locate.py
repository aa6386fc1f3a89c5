"""The cell that a point lies in."""

from __future__ import annotations

import numpy as np

from meshes.grouped import shapes
from meshes.grouped.model import GroupedMesh

INSIDE = 1e-6  # of a cell: so far outside is inside by rounding, for faces of cells in files have few digits
STEPS = 30


def locate(mesh: GroupedMesh, point: np.ndarray, inside: np.ndarray | None = None) -> tuple[int, np.ndarray] | None:
    """The cell (among those chosen, (cells,)) and the reference coordinates (3,) of a point (m); ``None`` outside.

    Newton's iteration on each cell whose surroundings the point is in.
    """
    nodes = mesh.points[mesh.cells]
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    # A curved cell may bulge beyond its nodes by less than this.
    room = (0.25 if mesh.order == 2 else 1e-6) * (high - low).max(axis=1)[:, None]
    near = ((point >= low - room) & (point <= high + room)).all(axis=1)
    if inside is not None:
        near &= inside
    cells = np.flatnonzero(near)
    if not len(cells):
        return None
    start = shapes.nodes(mesh.kind, 1).mean(axis=0)
    x = np.repeat(start[None], len(cells), axis=0)
    for _ in range(STEPS if mesh.order == 2 or mesh.kind == shapes.HEXAHEDRON else 2):
        # (cells,) each at its own reference point.
        at = np.einsum("cn,cnd->cd", shapes.values(mesh.kind, mesh.order, x), nodes[cells])
        slopes = np.einsum("dcn,cne->cde", shapes.gradients(mesh.kind, mesh.order, x), nodes[cells])
        step = np.linalg.solve(np.swapaxes(slopes, 1, 2), (point - at)[..., None])[..., 0]
        x = np.clip(x + step, -0.5, 1.5)
        if np.abs(step).max() < 1e-13:
            break
    outside = np.maximum(-x, x - 1).max(axis=1)
    if mesh.kind == shapes.TETRA:
        outside = np.maximum(outside, x.sum(axis=1) - 1)
    at = np.einsum("cn,cnd->cd", shapes.values(mesh.kind, mesh.order, x), nodes[cells])
    size = (high - low)[cells].max(axis=1)
    outside = np.where(np.linalg.norm(at - point, axis=1) < 1e-6 * size, outside, np.inf)
    best = int(outside.argmin())
    return (int(cells[best]), x[best]) if outside[best] <= INSIDE else None
