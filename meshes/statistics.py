"""Numbers that describe a grid of bricks."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshes.grid import Grid


def of(grid: Grid) -> dict[str, Any]:
    """Cells, degrees, the largest aspect ratio of a cell, and the volume against the exact one (m3)."""
    sizes = [np.diff(b) for b in grid.breaks]
    solid = grid.solid
    volume = sizes[0][:, None, None] * sizes[1][:, None] * sizes[2]
    longest = np.maximum(np.maximum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    shortest = np.minimum(np.minimum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    return {
        "cells": int(solid.sum()),
        "intervals": [len(d) for d in grid.degrees],
        "lowest_degree": int(min(d.min() for d in grid.degrees)),
        "highest_degree": int(max(d.max() for d in grid.degrees)),
        "largest_aspect_ratio": float((longest / shortest)[solid].max()),
        "volume_m3": float(volume[solid].sum()),
        "exact_volume_m3": exact_volume(grid),
    }


def exact_volume(grid: Grid) -> float:
    """The volume of the union of the boxes (m3), by inclusion of the cells of their own planes."""
    planes = [np.unique([c for b in grid.boxes for c in (b.lower[d], b.upper[d])]) for d in range(3)]
    middles = [(p[:-1] + p[1:]) / 2 for p in planes]
    inside = np.zeros(tuple(len(m) for m in middles), dtype=bool)
    for box in grid.boxes:
        inside[np.ix_(*((m > box.lower[d]) & (m < box.upper[d]) for d, m in enumerate(middles)))] = True
    x, y, z = (np.diff(p) for p in planes)
    return float((x[:, None, None] * y[:, None] * z)[inside].sum())
