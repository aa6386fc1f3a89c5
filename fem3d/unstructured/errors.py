"""What two levels of one scene say about the error of the finer one."""

from __future__ import annotations

import numpy as np

from fem3d.unstructured.level import Level

BETWEEN_DEGREES = 1.0
BETWEEN_MESHES = 1.25
"""The difference of two levels bounds the error of the finer one where errors at least halve from one to the other:
from degree 1 to 2 they do, even at edges; on halved cells just so where a field has a singularity of order one half."""
LEAST = 0.2  # of the fields' own difference: a difference of values may vanish by chance
ROUNDING = 1e-9


def factor(fine: Level) -> float:
    """By what a difference to the level below is multiplied."""
    return BETWEEN_MESHES if fine.refined else BETWEEN_DEGREES


def apart(fine: Level, coarse: Level, pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """The largest relative difference of some fields (all nodes; of the fine and the coarse level), as root of the mean
    square over the corners of the file's cells."""
    here, there = fine.at_file_nodes(1), coarse.at_file_nodes(1)
    found = 0.0
    for a, b in pairs:
        values = a[here]
        size = float(np.sqrt((values**2).mean()))
        if size:
            found = max(found, float(np.sqrt(((values - b[there]) ** 2).mean())) / size)
    return found
