"""The content of a mesh file before the solver's mesh is built, common to all formats."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

Piece = tuple[str, int, np.ndarray]
"""Name and dimension of a group, and some of its cells."""
Element = tuple[str, list[int], list[str]]
"""A cell of a file: its kind by meshio's name, the numbers of its nodes in meshio's order, and its groups."""


class MeshFileError(ValueError):
    """A mesh file that cannot be read; the message names the cause and the cure."""


@dataclass
class MeshData:
    """Nodes, cells and groups of a mesh file.

    Attributes
    ----------
    points : (n, 3) coordinates of the nodes, in the file's unit
    blocks : kind of cell by meshio's name, and nodes (cells, nodes) in meshio's order, for each block of cells
    groups : numbers of the cells, counted through all blocks, for each name and dimension of a group
    others : description of each name in the file that is no group of cells
    """

    points: np.ndarray
    blocks: list[tuple[str, np.ndarray]]
    groups: dict[tuple[str, int], np.ndarray]
    others: dict[str, str] = field(default_factory=dict)


def dimension(kind: str) -> int:
    """Return the dimension of a kind of cell."""
    if kind.startswith(("triangle", "quad", "polygon")):
        return 2
    return 0 if kind == "vertex" else 1 if kind.startswith("line") else 3


def node_rows(ids: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the row of each wanted node among the nodes of a file, by their numbers in the file."""
    order = np.argsort(ids, kind="stable")
    at = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
    missing = ids[at] != wanted
    if missing.any():
        raise MeshFileError(f"a cell has node {wanted[missing][0]}, which is not in the file: write the nodes too")
    return at


def assemble(nodes: dict[int, np.ndarray], elements: list[Element]) -> MeshData:
    """Make the mesh of nodes, by their numbers in the file, and of elements."""
    mesh, pieces, start = MeshData(np.array(list(nodes.values()), float), [], {}), list[Piece](), 0
    ids, by_kind = np.array(list(nodes)), dict[str, list[Element]]()
    for element in elements:
        by_kind.setdefault(element[0], []).append(element)
    for kind, block in by_kind.items():
        mesh.blocks.append((kind, node_rows(ids, np.array([corners for _, corners, _ in block]))))
        members = dict[str, list[int]]()
        for i, (_, _, names) in enumerate(block, start):
            for name in names:
                members.setdefault(name, []).append(i)
        pieces += [(name, dimension(kind), np.array(cells)) for name, cells in members.items()]
        start += len(block)
    mesh.groups = collect(pieces)
    return mesh


def collect(pieces: Iterable[Piece]) -> dict[tuple[str, int], np.ndarray]:
    """Join the pieces of each group."""
    groups: dict[tuple[str, int], list[np.ndarray]] = {}
    for name, dim, cells in pieces:
        if len(cells):
            groups.setdefault((name, dim), []).append(cells)
    return {key: np.unique(np.concatenate(parts)) for key, parts in groups.items()}


def add_gmsh_groups(
    mesh: MeshData, names: dict[tuple[int, int], str], physical: list[Piece], elementary: list[Piece]
) -> None:
    """Add Gmsh's physical groups and, for cells in none, its elementary entities by their tags.

    ``names`` are the names of physical groups, by dimension and tag.
    """
    mesh.groups |= collect((names.get((dim, int(tag)), tag), dim, cells) for tag, dim, cells in physical)
    grouped = np.concatenate([np.empty(0, int), *(cells for _, _, cells in physical)])
    alone = collect((tag, dim, np.setdiff1d(cells, grouped)) for tag, dim, cells in elementary if dim >= 2)
    mesh.groups = alone | mesh.groups
    lost = (
        "a physical group without cells (Mesh.SaveAll in format 2.2 drops physical groups: save without it, or in 4.1)"
    )
    present = {name for name, _ in mesh.groups}
    mesh.others |= {name: lost for name in names.values() if name not in present}
