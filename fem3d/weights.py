"""Means as rows: the weights of nodal values over a point, a line, a flat box or a volume."""

from __future__ import annotations

import numpy as np

from fem3d.operators import HeatProblem
from scenes.model import Probe


def mean_row(heat: HeatProblem, probe: Probe, number: np.ndarray, size: int) -> np.ndarray:
    """(size,): the weights whose product with nodal values is their mean over a probe; ``number`` maps grid nodes."""
    nodes, weights = [], []
    for axis, low, high in zip(heat.mesh.axes, probe.lower, probe.upper, strict=True):
        if low == high:
            row = axis.interpolation(np.array([low]))[0]
            found = np.flatnonzero(row)
            weight = row[found]
        else:
            part = axis.part(*axis.span(low, high))
            found = np.arange(part.node_slice.start, part.node_slice.stop)
            weight = part.integral / (high - low)
        nodes.append(found)
        weights.append(weight)
    x, y, z = nodes
    shape = heat.mesh.shape
    grid = (x[:, None, None] * shape[1] + y[:, None]) * shape[2] + z
    weight = weights[0][:, None, None] * weights[1][:, None] * weights[2]
    keep = weight != 0
    functional = np.zeros(size)
    np.add.at(functional, number[grid[keep]], weight[keep])
    return functional
