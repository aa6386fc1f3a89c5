"""Nodes along the lines of a layout.

Elements are short where something begins or ends along a line and grow from there twofold. Lines that run alike and
touch have the same elements where they do, so that heat exchanged point by point is a product of values at the same
points.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from reduced1d.network.lines import Layout


def graded_nodes(layout: Layout, shortest: Sequence[float]) -> list[np.ndarray]:
    """The nodes of each line (m): where something begins or ends on it or on a line that it exchanges heat with point
    by point, and between these, at distances that grow from the ``shortest`` of each line."""
    count = len(layout.lines)
    groups = joined(count, [(link.one.line, link.other.line) for link in (*layout.heat, *layout.current)
                            if link.kind == "along" and link.other])  # fmt: skip
    by_line: list[np.ndarray] = [np.empty(0)] * count
    for group in range(groups.max() + 1):
        lines = np.flatnonzero(groups == group).tolist()
        places = sorted({x for i in lines for x in layout.places(i)})
        nodes = graded(places, min(shortest[i] for i in lines))
        for i in lines:
            line = layout.lines[i]
            by_line[i] = nodes[(nodes >= line.start) & (nodes <= line.stop)]
    return by_line


def graded(places: Sequence[float], shortest: float) -> np.ndarray:
    """Nodes at some places (m, ascending) and between them, at distances that double from ``shortest`` on away from
    each, as fields get smoother."""
    pieces = [np.asarray(places)]
    for a, b in pairwise(places):
        # From both ends the distances shortest (1 + 2 + 4 ...), up to the middle.
        half = (b - a) / 2
        steps = int(np.ceil(np.log1p(half / shortest) / np.log(2)))
        if steps < 1 or shortest > half:
            continue
        outward = (2.0 ** np.arange(1, steps + 1) - 1) / (2.0**steps - 1) * half
        pieces += [a + outward, b - outward[:-1]]
    return np.unique(np.concatenate(pieces))


def joined(count: int, pairs: Sequence[tuple[int, int]]) -> np.ndarray:
    """(count,): a number for each connected set under some pairs."""
    rows, columns = np.array(pairs, int).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    return np.asarray(sp.csgraph.connected_components(graph, directed=False)[1])
