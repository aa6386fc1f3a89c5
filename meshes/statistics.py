"""Numbers that describe a brick mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshes.bricks import VOID, BrickMesh


def of(mesh: BrickMesh) -> dict[str, Any]:
    """Cells, nodes, degrees, the largest aspect ratio of a cell, and the volume against the exact one (m3)."""
    sizes = [np.diff(axis.breaks) for axis in mesh.axes]
    solid = mesh.owner != VOID
    volume = sizes[0][:, None, None] * sizes[1][:, None] * sizes[2]
    longest = np.maximum(np.maximum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    shortest = np.minimum(np.minimum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    return {
        "cells": int(solid.sum()),
        "nodes": int(mesh.solid.sum()),
        "intervals": [len(axis.degrees) for axis in mesh.axes],
        "lowest_degree": int(min(axis.degrees.min() for axis in mesh.axes)),
        "highest_degree": int(max(axis.degrees.max() for axis in mesh.axes)),
        "largest_aspect_ratio": float((longest / shortest)[solid].max()),
        "volume_m3": float(volume[solid].sum()),
        "exact_volume_m3": exact_volume(mesh),
    }


def exact_volume(mesh: BrickMesh) -> float:
    """The volume of the union of the boxes (m3), by inclusion of the cells of their own planes."""
    planes = [np.unique([c for b in mesh.boxes for c in (b.lower[d], b.upper[d])]) for d in range(3)]
    middles = [(p[:-1] + p[1:]) / 2 for p in planes]
    inside = np.zeros(tuple(len(m) for m in middles), dtype=bool)
    for box in mesh.boxes:
        inside[np.ix_(*((m > box.lower[d]) & (m < box.upper[d]) for d, m in enumerate(middles)))] = True
    x, y, z = (np.diff(p) for p in planes)
    return float((x[:, None, None] * y[:, None] * z)[inside].sum())
