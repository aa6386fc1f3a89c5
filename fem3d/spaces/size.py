"""Predict the cost of a mesh before assembly, in unknowns, matrix entries and memory, and the memory that is free.

The unknowns are counted by the degrees of each vertex, edge, face and cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import psutil

from fem3d.spaces.domain import Domain
from fem3d.spaces.element import Degrees, reference_matrices
from meshes import grid as grids
from meshes.grid import Grid
from scenes.errors import TooLargeError
from scenes.free.grid import crowding
from scenes.model import AnyScene, Scene

LEAF, AT_LEAF = 120.0, 40.0
"""Unknowns of a piece that `fem3d.problems.cholesky` dissects no more, as so small a dense block takes next to no time;
and of a separator of two such pieces."""
# These constants were measured on plates with 0 to 10 pads beside a meander, on rows of 100 and 300 boxes and on cubes
# with 2 and 3 boxes inside: a run's peak memory is predicted to within 30 % from 0.15 to 2.6 GB.
START_UP = 75e6  # bytes of a process before it has a mesh: interpreter and libraries
PER_ENTRY = 115.0  # bytes: the cells' matrices with their places, the sums in three spaces
FILL = 1.4  # times the entries that the joins of a dissection have: what is joined reaches beyond its plane
PER_FACTOR = 12.4  # bytes for each entry of the factors in the highest space: 8, and half as much in the lower spaces

# The same for tetrahedra, whose joins are overestimated, most of all in thin layers. The memory of a meander
# with pads, stacks with vias, pads on a chip and a bulky mesh from Gmsh (58,000 to 146,000 unknowns, 0.5 to 3.6 GB) is
# predicted 1.07 to 1.7 times too large, and never too small.
PER_ENTRY_OF_CELLS, PER_FACTOR_OF_CELLS = 90.0, 5.0


@dataclass(frozen=True)
class Size:
    """Cells, unknowns, the entries of the factors, and bytes at the peak of a run (``memory``)."""

    cells: int
    unknowns: int
    factors: float
    memory: float


def factor_entries(unknowns: float, join: float) -> float:
    """Entries of a Cholesky factor by nested dissection (George, SIAM J. Numer. Anal. 10, 1973): ``LEAF`` per unknown,
    and at depth k 2^k joins. The unknowns of a join fall from ``join`` to ``AT_LEAF`` as a power of a piece's size."""
    depth = max(np.log2(unknowns / LEAF), 1.0)
    level = np.arange(int(np.ceil(depth)))
    joins = join * (AT_LEAF / max(join, AT_LEAF)) ** (level / depth)
    return float(LEAF * unknowns + FILL * (2.0**level * joins**2).sum())


def size_of_grid(scene: Scene, grid: Grid) -> Size:
    """The size of a grid of a scene (of its part that is solved)."""
    graph, degrees = grids.graph(scene), grid.of_entities
    within = np.zeros(degrees.shape[1:], bool)  # whether a vertex, edge, face or cell is in the solid
    within[1::2, 1::2, 1::2] = grid.solid
    for d in range(3):
        along = np.moveaxis(within, d, 0)
        along[:-1:2] |= along[1::2]
        along[2::2] |= along[1::2]
    shape = 3 * (int(degrees.max()) + 1,)
    counts = np.bincount(np.ravel_multi_index(tuple(degrees[:, within]), shape), minlength=int(np.prod(shape)))
    unknowns = entries = cells = 0
    for (x, y, z), count in zip(np.ndindex(shape), counts.tolist(), strict=True):
        unknowns += count * _functions((x, y, z)) if count else 0
        if count and min(x, y, z):
            cells, entries = cells + count, entries + count * len(reference_matrices(shape[0] - 1, (x, y, z))[0])
    layers = list[int]()
    for d in range(3):
        across = grid.solid.sum(axis=tuple({0, 1, 2} - {d}))
        layers.append(int(across[np.searchsorted(np.cumsum(across), across.sum() / 2)]))
    # Potentials have a problem of their own where current passes.
    coarse = [np.searchsorted(p, (b[1:] + b[:-1]) / 2) - 1 for p, b in zip(graph.planes, grid.breaks, strict=True)]
    live = float((graph.live.reshape(graph.owner.shape)[np.ix_(*coarse)] & grid.solid).sum() / cells)
    return _size(cells, unknowns, min(layers), live, PER_ENTRY * entries, PER_FACTOR)


def _size(cells: int, unknowns: int, layer: float, live: float, matrices: float, per_factor: float) -> Size:
    """The size of a mesh whose smallest layer of cells that halves it has so many, from the bytes of its matrices."""
    factors = factor_entries(unknowns, unknowns * layer / cells)
    return Size(cells, unknowns, factors, float(START_UP + matrices + (1 + live) * per_factor * factors))


@lru_cache
def _functions(degrees: Degrees) -> int:
    """The functions of a vertex, edge, face or inside by its degrees along x, y, z: 0 where it has no extent."""
    j, k, m = (np.arange(2, p + 1) if p else np.zeros(1, int) for p in degrees)
    return int((j[:, None, None] + k[:, None] + m <= max(degrees)).sum())


def size_of_cells(domain: Domain) -> Size:
    """Foresee the size of the problems of a domain on scikit-fem's mesh."""
    mesh, (functions, cells) = domain.space.mesh, domain.space.dofs.shape
    low, high = (extreme(mesh.p[:, mesh.t], axis=1) for extreme in (np.min, np.max))
    middle = np.median((low + high) / 2, axis=1)[:, None]
    across = float(((low <= middle) & (high > middle)).sum(axis=1).min())
    matrices, live = PER_ENTRY_OF_CELLS * functions**2 * cells, float(domain.live.mean())
    return _size(cells, domain.space.size, across, live, matrices, PER_FACTOR_OF_CELLS)


def fits_memory(scene: AnyScene, size: Size) -> bool:
    """Return whether memory has room for a mesh."""
    return size.memory <= memory_limit(scene)


def check_memory(scene: Scene, size: Size, when: str, why: str = "") -> None:
    """Raise TooLargeError for a grid of bricks that takes too much memory."""
    if not fits_memory(scene, size):
        unknowns, planes = float(f"{size.unknowns:.2g}"), grids.graph(scene).planes
        raise TooLargeError(
            f"the scene takes {unknowns:,.0f} unknowns and {size.memory / 1e9:.3g} GB {when}, and "
            f"{allowed_memory(scene)}{why}; {crowding(planes)}: let more coincide, or leave out what does not matter"
        )


def memory_limit(scene: AnyScene) -> float:
    """Return the bytes that a run of a scene may take in all."""
    # Sizes are foreseen to within 30 %, and other programs need some.
    return float(scene.memory or 0.8 * (free_memory() + psutil.Process().memory_info().rss))


def allowed_memory(scene: AnyScene) -> str:
    """Return the limit in words, for a message."""
    size = f"{memory_limit(scene) / 1e9:.2g} GB"
    return f"run.memory allows {size}" if scene.memory else f"this machine has {size} to spare"


def free_memory() -> float:
    """Return the bytes that are free on this machine and in the control groups of this process, of version 1 or 2."""
    room, top = [float(psutil.virtual_memory().available)], Path("/sys/fs/cgroup")
    inside = [Path(word.rpartition(":")[2].lstrip("/")) for word in _words(Path("/proc/self/cgroup"))]
    places = {Path(), *inside, *(parent for group in inside for parent in group.parents)}
    names = ("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")
    for group in (root / place for root in (top, top / "memory") for place in places):
        parts = _words(group / "memory.stat")
        for bound, taken in ((_words(group / most), _words(group / used)) for most, used in names if parts):
            if bound and taken and bound[0].isdigit():
                # Pages of files that can be dropped count as taken, and are free.
                cache = float(parts[parts.index("inactive_file") + 1]) if "inactive_file" in parts else 0.0
                room.append(float(bound[0]) - float(taken[0]) + cache)
    return max(min(room), 0.0)


def _words(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError):
        return []
