"""Nested dissection of the nodes of a brick mesh: an elimination order with little fill, from the geometry.

The grid is cut at the middle breakpoint plane of its longest axis (in intervals), the two sides are ordered in the same
way, and the plane comes last (George, SIAM J. Numer. Anal. 10, 1973). General-purpose minimum-degree orderings fail on
the dense cliques of high degrees.
"""

from __future__ import annotations

import numpy as np

from meshes.bricks import BrickMesh

LEAF = 2  # cells along every axis up to which a piece isn't cut further


def nested_dissection(mesh: BrickMesh) -> np.ndarray:
    """(nodes of the grid,): a rank for each node; eliminating by rank keeps the fill low."""
    rank = np.empty(mesh.shape, dtype=int)
    offsets = [axis.offsets for axis in mesh.axes]
    count = 0

    def number(box: list[tuple[int, int]]) -> None:
        nonlocal count
        piece = rank[tuple(slice(a, b) for a, b in box)]
        piece[...] = count + np.arange(piece.size).reshape(piece.shape)
        count += piece.size

    def dissect(nodes: list[tuple[int, int]], cells: list[tuple[int, int]]) -> None:
        if any(a >= b for a, b in nodes):
            return
        lengths = [b - a for a, b in cells]
        d = lengths.index(max(lengths))
        if lengths[d] <= LEAF:
            number(nodes)
            return
        middle = (cells[d][0] + cells[d][1]) // 2
        plane = int(offsets[d][middle])
        for node_range, cell_range in (
            ((nodes[d][0], plane), (cells[d][0], middle)),
            ((plane + 1, nodes[d][1]), (middle, cells[d][1])),
        ):
            sub_nodes, sub_cells = list(nodes), list(cells)
            sub_nodes[d], sub_cells[d] = node_range, cell_range
            dissect(sub_nodes, sub_cells)
        separator = list(nodes)
        separator[d] = (plane, plane + 1)
        number(separator)

    dissect([(0, n) for n in mesh.shape], [(0, len(a.degrees)) for a in mesh.axes])
    return rank.ravel()
