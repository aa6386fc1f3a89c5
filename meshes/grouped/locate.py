"""The cell that a point lies in."""

from __future__ import annotations

import numpy as np

from meshes.grouped.model import GroupedMesh

# A point outside a cell by less than this fraction of it is inside, as coordinates in files have few digits.
INSIDE = 1e-6
STEPS = 30


def locate(grouped: GroupedMesh, point: np.ndarray, inside: np.ndarray | None = None) -> tuple[int, np.ndarray] | None:
    """The cell (among those chosen, (cells,)) and the reference coordinates (3,) of a point (m); ``None`` outside.

    Newton's iteration on each cell whose surroundings the point is in.
    """
    low, high = grouped.bounds
    size = (high - low).max(axis=0)
    # A curved cell may bulge beyond its nodes by less than this.
    room = (1e-6 if grouped.mesh.doflocs.shape[1] == grouped.mesh.nvertices else 0.25) * size
    near = ((point[:, None] >= low - room) & (point[:, None] <= high + room)).all(axis=0)
    cells = np.flatnonzero(near if inside is None else near & inside)
    if not len(cells):
        return None
    mapping = grouped.mesh.mapping()
    x = np.full((3, len(cells), 1), 0.25 if grouped.simplex else 0.5)
    for _ in range(STEPS):
        slopes = np.moveaxis(mapping.DF(x, tind=cells)[..., 0], -1, 0)
        away = (point[:, None] - mapping.F(x, tind=cells)[..., 0]).T
        step = np.linalg.solve(slopes, away[..., None])[..., 0].T
        # Where the point is in another cell the iteration ends at the bounds.
        before, x = x, np.clip(x + step[..., None], -0.5, 1.5)
        if np.abs(x - before).max() < 1e-13:
            break
    at = x[..., 0]
    outside = np.maximum(-at, at - 1).max(axis=0)
    if grouped.simplex:
        outside = np.maximum(outside, at.sum(axis=0) - 1)
    off = np.linalg.norm(mapping.F(x, tind=cells)[..., 0] - point[:, None], axis=0)
    outside = np.where(off < 1e-6 * size[cells], outside, np.inf)
    best = int(outside.argmin())
    return (int(cells[best]), at[:, best]) if outside[best] <= INSIDE else None
