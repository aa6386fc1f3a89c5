"""Predict the cost of a grid of bricks before assembly: unknowns, matrix entries, memory.

The unknowns are counted, not estimated: the planes of a scene cut it into few coarse cells. Each vertex, edge, face and
inside of a coarse cell holds a grid of finer cells; the counts along the three axes multiply.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from fem3d.spaces.element import local
from meshes import grid as grids
from meshes.grid import Grid
from scenes.model import Scene

HIGHEST = 10
"""Columns of a table by degree, of which the first is for points: more than any degree that a grid has."""
LEAF, AT_LEAF = 120.0, 40.0
"""Unknowns of a piece that is not dissected any more (`fem3d.problems.cholesky.LEAF`), and those that join two such."""
# These constants were measured on plates with 0 to 10 pads beside a meander, on rows of 100 and 300 boxes and on cubes
# with 2 and 3 boxes inside: a run's peak memory is predicted to within 30 % from 0.15 to 2.6 GB.
START_UP = 75e6  # bytes of a process before it has a mesh: interpreter and libraries
PER_ENTRY = 115.0  # bytes: the cells' matrices with their places, the sums in three spaces
FILL = 1.4  # times the entries that the joins of a dissection have: what is joined reaches beyond its plane
PER_FACTOR = 12.4  # bytes for each entry of the factors in the highest space: 8, and half as much in the lower ones

# The same for tetrahedra, whose joins are overestimated, most of all where most of a mesh is a film. The memory of a
# meander with pads, stacks with vias, pads on a chip and a bulky mesh from Gmsh (58,000 to 146,000 unknowns, 0.5 to
# 3.6 GB) is predicted 1.07 to 1.7 times too large, and never too small.
PER_ENTRY_OF_CELLS, PER_FACTOR_OF_CELLS = 90.0, 5.0


@dataclass(frozen=True)
class Size:
    """Cells, unknowns, the unknowns of the smallest layer of cells that halves the grid (``join``), the entries of the
    cells' matrices before summation, the entries of the factors, and bytes at the peak of a run (``memory``)."""

    cells: int
    unknowns: int
    join: float
    entries: float
    factors: float
    memory: float


def factor_entries(unknowns: float, join: float) -> float:
    """Entries of a Cholesky factor along a nested dissection: ``LEAF`` for each unknown, and at depth k 2^k joins. The
    unknowns of a join fall from ``join`` to ``AT_LEAF`` as a power of the size of the halved piece (George, SIAM J.
    Numer. Anal. 10, 1973)."""
    depth = max(np.log2(unknowns / LEAF), 1.0)
    level = np.arange(int(np.ceil(depth)))
    joins = join * (AT_LEAF / max(join, AT_LEAF)) ** (level / depth)
    return float(LEAF * unknowns + FILL * (2.0**level * joins**2).sum())


def foreseen(scene: Scene, grid: Grid) -> Size:
    """The size of a grid of a scene (of its part that is solved)."""
    graph = grids.graph(scene)
    solid = graph.owner != grids.VOID
    tables = [_along(p, b, d) for p, b, d in zip(graph.planes, grid.breaks, grid.degrees, strict=True)]
    degrees = sorted({int(p) for d in grid.finest for p in np.unique(d)})
    functions = _functions(tuple(degrees))
    inside, unknowns = _of_edges(grid, functions) if grid.edges else _of_intervals(solid, tables, functions)
    cells, kinds = inside[1:, 1:, 1:].sum(), 1 + np.argwhere(inside[1:, 1:, 1:])
    of_matrices = float(sum(inside[x, y, z] * len(local(degrees[-1], (x, y, z)).rows) for x, y, z in kinds.tolist()))
    join = unknowns * _layer(solid, tables) / cells
    factors = factor_entries(unknowns, join)
    # Potentials have a problem of their own where current passes.
    live = _product(graph.live.reshape(solid.shape), tables)[1:, 1:, 1:].sum() / cells
    memory = START_UP + PER_ENTRY * of_matrices + (1 + live) * PER_FACTOR * factors
    return Size(int(cells), int(unknowns), join, of_matrices, factors, float(memory))


def of_cells(mesh: Any, degree: int, live: float) -> Size:
    """Foresee the size of the space of a degree on scikit-fem's mesh; current passes the part ``live`` (0 to 1)."""
    low, high = (extreme(mesh.p[:, mesh.t], axis=1) for extreme in (np.min, np.max))
    middle = np.median((low + high) / 2, axis=1)[:, None]
    cells, facets = mesh.t.shape[1], mesh.facets.shape[1]
    across = float(((low <= middle) & (high > middle)).sum(axis=1).min())
    edges = mesh.nvertices + facets - cells - 1  # Euler's count
    if len(mesh.t) == 4:
        unknowns = mesh.nvertices + (degree - 1) * edges + (degree - 2) * facets
        of_cell = (degree + 1) * (degree + 2) * (degree + 3) // 6
    else:
        unknowns, of_cell = mesh.nvertices + edges + facets + cells, 27
    join, entries = unknowns * across / cells, float(of_cell**2 * cells)
    factors = factor_entries(unknowns, join)
    memory = START_UP + PER_ENTRY_OF_CELLS * entries + (1 + live) * PER_FACTOR_OF_CELLS * factors
    return Size(cells, int(unknowns), join, entries, factors, memory)


def _along(planes: np.ndarray, breaks: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """(intervals of the planes, HIGHEST): in each the breakpoints inside, then the intervals of each degree."""
    at = np.clip(np.searchsorted(planes, (breaks[1:] + breaks[:-1]) / 2) - 1, 0, len(planes) - 2)
    table = np.zeros((len(planes) - 1, HIGHEST))
    np.add.at(table, (at, degrees), 1.0)
    table[:, 0] = table.sum(axis=1) - 1
    return table


def _product(mask: np.ndarray, tables: list[np.ndarray]) -> np.ndarray:
    """(HIGHEST, HIGHEST, HIGHEST): the product of the tables of the three axes, summed where the mask is true."""
    counts = mask.astype(float)
    for table in tables:
        counts = np.tensordot(counts, table, axes=(0, 0))
    return counts


def _closed(mask: np.ndarray, d: Any) -> np.ndarray:
    """The mask of the planes across axis ``d`` that touch cells of a mask."""
    mask = np.pad(mask, [(1, 1) if e == d else (0, 0) for e in range(3)])
    return np.delete(mask, 0, axis=d) | np.delete(mask, -1, axis=d)


def _of_intervals(solid: np.ndarray, tables: list[np.ndarray], functions: np.ndarray) -> tuple[np.ndarray, float]:
    """The cells (HIGHEST, HIGHEST, HIGHEST) by their degrees, and the unknowns, of a grid with these ``tables`` along
    the axes, whose vertices, edges, faces and insides have ``functions`` by their degrees (as `_functions`)."""
    unknowns = 0.0
    for closed in product((False, True), repeat=3):
        mask, each = solid, list(tables)
        for d in np.flatnonzero(closed):
            mask = _closed(mask, d)
            each[d] = np.eye(1, HIGHEST).repeat(mask.shape[d], axis=0)
        unknowns += float((_product(mask, each) * functions).sum())
    return _product(solid, tables), unknowns


def _of_edges(grid: Grid, functions: np.ndarray) -> tuple[np.ndarray, float]:
    """The same for a grid with a degree for each edge."""
    degrees = grid.of_entities
    inside, unknowns = np.zeros((HIGHEST,) * 3), 0.0
    np.add.at(inside, tuple(degrees[:, 1::2, 1::2, 1::2][:, grid.solid]), 1.0)
    for closed in product((False, True), repeat=3):
        mask = grid.solid
        for d in np.flatnonzero(closed):
            mask = _closed(mask, d)
        of_kind = degrees[(slice(None), *(slice(0 if on else 1, None, 2) for on in closed))]
        unknowns += float(functions[tuple(of_kind[:, mask])].sum())
    return inside, unknowns


@lru_cache(maxsize=32)
def _functions(degrees: tuple[int, ...]) -> np.ndarray:
    """(HIGHEST, HIGHEST, HIGHEST): the functions of a vertex, edge, face or inside by the degrees along the axes that
    it extends along, 0 standing for the others."""
    functions = np.zeros((HIGHEST,) * 3)
    for triple in product((0, *degrees), repeat=3):
        j, k, m = (np.arange(2, p + 1) if p else np.zeros(1, int) for p in triple)
        functions[triple] = (j[:, None, None] + k[:, None] + m <= max(triple)).sum() if any(triple) else 1.0
    return functions


def _layer(solid: np.ndarray, tables: list[np.ndarray]) -> float:
    """The fewest cells in a layer that halves the grid across x, y or z."""
    layers = []
    for d in range(3):
        in_layers = np.moveaxis(solid, d, 0).astype(float)
        for table in (table for e, table in enumerate(tables) if e != d):
            in_layers = np.tensordot(in_layers, table[:, 1:].sum(axis=1), axes=(1, 0))
        cells = np.cumsum(in_layers * tables[d][:, 1:].sum(axis=1))
        layers.append(in_layers[np.searchsorted(cells, cells[-1] / 2)])
    return float(min(layers))
