"""Gmsh's format 4.1, in text or binary (https://gmsh.info/doc/texinfo/gmsh.html, "MSH file format").

meshio cannot read files of this format where some entities are in a physical group and others are not.
"""

from __future__ import annotations

import re

import numpy as np

from meshes.grouped.data import MeshData, MeshFileError, add_gmsh_groups, node_rows

# Gmsh's numbers of the types of cells, with meshio's names and the counts of nodes.
_TYPES = {
    1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6),
    7: ("pyramid", 5), 8: ("line3", 3), 9: ("triangle6", 6), 10: ("quad9", 9), 11: ("tetra10", 10),
    12: ("hexahedron27", 27), 13: ("wedge18", 18), 14: ("pyramid14", 14), 15: ("vertex", 1), 16: ("quad8", 8),
    17: ("hexahedron20", 20), 18: ("wedge15", 15), 19: ("pyramid13", 13), 21: ("triangle10", 10),
    26: ("line4", 4), 29: ("tetra20", 20), 36: ("quad16", 16), 92: ("hexahedron64", 64),
}  # fmt: skip
# Gmsh's place of each of meshio's nodes.
_EDGES = [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
_ORDER = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8], "hexahedron20": _EDGES,
    "hexahedron27": [*_EDGES, 22, 23, 21, 24, 20, 25, 26],
}  # fmt: skip


def is_gmsh_41(data: bytes) -> bool:
    """Return whether a file is of Gmsh's format 4.1."""
    return data.startswith(b"$MeshFormat") and data.split(maxsplit=2)[1:2] == [b"4.1"]


def read_gmsh(data: bytes) -> MeshData:
    """Read a mesh in Gmsh's format 4.1. Raises MeshFileError."""
    if b"$PartitionedEntities" in data:
        raise MeshFileError("it is partitioned: save it whole, without partitions")
    header = _section(data, b"MeshFormat").split(maxsplit=3)
    form = header[1] == b"1", ">" if header[3:] and header[3].startswith(b"\0\0\0\1") else "<", int(header[2])
    physical_of = _read_physical(_Numbers(_section(data, b"Entities"), *form)) if b"$Entities" in data else {}
    ids, points = _read_nodes(_Numbers(_section(data, b"Nodes"), *form))
    mesh, start, physical, elementary = MeshData(points, [], {}), 0, [], []
    for dim, tag, kind, nodes in _read_cells(_Numbers(_section(data, b"Elements"), *form)):
        cells, start = np.arange(start, start + len(nodes)), start + len(nodes)
        mesh.blocks.append((kind, node_rows(ids, nodes)[:, _ORDER.get(kind, slice(None))]))
        elementary.append((str(tag), dim, cells))
        physical += [(str(group), dim, cells) for group in physical_of.get((dim, tag), [])]
    text = _section(data, b"PhysicalNames").decode("utf-8", "replace") if b"$PhysicalNames" in data else ""
    names = {(int(dim), int(tag)): name for dim, tag, name in re.findall(r'(\d+)\s+(\d+)\s+"(.*)"', text)}
    add_gmsh_groups(mesh, names, physical, elementary)
    return mesh


def _section(data: bytes, name: bytes) -> bytes:
    begin, end = data.find(b"$" + name), data.find(b"$End" + name)
    if begin < 0 or end < 0:
        raise MeshFileError(f"its section ${name.decode()} is missing or ends early: save it again")
    return data[data.index(b"\n", begin) + 1 : end]


class _Numbers:
    """The numbers of a section, taken one after the other from text or binary data."""

    def __init__(self, section: bytes, binary: bool, endian: str, size: int) -> None:
        self.binary, self.place = binary, 0
        self.data = np.frombuffer(section, np.uint8) if binary else np.array(section.split(), float)
        self.types = {"int": np.dtype(f"{endian}i4"), "size": np.dtype(f"{endian}u{size}"),
                      "real": np.dtype(f"{endian}f8")}  # fmt: skip

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next ``count`` numbers of a kind."""
        end = self.place + count * (self.types[kind].itemsize if self.binary else 1)
        if end > len(self.data):
            raise MeshFileError("it ends early: save it again")
        piece, self.place = self.data[self.place : end], end
        return (piece.view(self.types[kind]) if self.binary else piece).astype(float if kind == "real" else np.int64)

    def take_one(self, kind: str) -> int:
        """Return the next number."""
        return int(self.take(kind, 1)[0])


def _read_physical(numbers: _Numbers) -> dict[tuple[int, int], list[int]]:
    """Return the physical groups of each entity, by its dimension and elementary tag."""
    groups = {}
    for dim, count in enumerate(numbers.take("size", 4)):
        for _ in range(count):
            tag = numbers.take_one("int")
            numbers.take("real", 6 if dim else 3)
            # A negative number is a group with the orientation reversed.
            groups[dim, tag] = [abs(int(group)) for group in numbers.take("int", numbers.take_one("size"))]
            if dim:
                numbers.take("int", numbers.take_one("size"))
    return groups


def _read_nodes(numbers: _Numbers) -> tuple[np.ndarray, np.ndarray]:
    ids, points = [np.empty(0, int)], [np.empty((0, 3))]
    for _ in range(numbers.take("size", 4)[0]):
        dim, _, parametric = numbers.take("int", 3)
        count = numbers.take_one("size")
        ids.append(numbers.take("size", count))
        width = 3 + dim * parametric
        points.append(numbers.take("real", count * width).reshape(count, width)[:, :3])
    return np.concatenate(ids), np.concatenate(points)


def _read_cells(numbers: _Numbers) -> list[tuple[int, int, str, np.ndarray]]:
    blocks = []
    for _ in range(numbers.take("size", 4)[0]):
        dim, tag, number = (int(n) for n in numbers.take("int", 3))
        count = numbers.take_one("size")
        if number not in _TYPES:
            raise MeshFileError(f"it has cells of Gmsh's type {number}: mesh with cells of first or second order")
        kind, nodes = _TYPES[number]
        rows = numbers.take("size", count * (1 + nodes)).reshape(count, 1 + nodes)
        blocks.append((dim, tag, kind, rows[:, 1:]))
    return blocks
