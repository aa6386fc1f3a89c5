"""Nastran bulk data: nodes with their coordinate systems, cells, and properties as groups.

A card is a line of fields and its continuations, in the small (8 columns), large (16 columns) or free (commas) format.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from meshes.grouped.data import MeshData, MeshFileError, collect, dimension, node_rows

# The kind of cell of a card for each count of nodes, by meshio's names.
_TETRA, _HEXA = {4: "tetra", 10: "tetra10"}, {8: "hexahedron", 20: "hexahedron20"}
_CELLS = {
    "CTETRA": _TETRA, "CHEXA": _HEXA, "CPENTA": {6: "wedge", 15: "wedge15"}, "CPYRAM": {5: "pyramid", 13: "pyramid13"},
    "CTRIA3": {3: "triangle"}, "CTRIAR": {3: "triangle"}, "CTRIA6": {3: "triangle", 6: "triangle6"},
    "CQUAD4": {4: "quad"}, "CQUADR": {4: "quad"}, "CQUAD8": {4: "quad", 8: "quad8"},
    "CQUAD": {4: "quad", 8: "quad8", 9: "quad9"},
}  # fmt: skip
_SOLIDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRAM")
# Nastran has the upright edges of a hexahedron before those of its top.
_ORDER = {"hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]}
_SYSTEM = re.compile(r"CORD([12])([RCS])$")


def read_nastran(text: str) -> MeshData:
    """Read Nastran bulk data. Raises MeshFileError."""
    cells: dict[str, list[tuple[int, list[int]]]] = {}
    grids: dict[int, tuple[int, list[float]]] = {}
    systems = _Systems(grids)
    default_system = 0
    for name, fields in _cards(text):
        card = _Card(name, fields)
        if name == "GRID":
            system = card.integer(2) if card.text(2) else -1
            grids[card.integer(1)] = system, [card.real(3), card.real(4), card.real(5)]
        elif name == "GRDSET":
            default_system = card.integer(2)
        elif match := _SYSTEM.match(name):
            systems.add(card, match[1], match[2])
        elif name in _CELLS:
            # A shell has further fields, such as THETA, after its nodes.
            end = len(fields) if name in _SOLIDS else 3 + max(_CELLS[name])
            given = [card.integer(i) for i in range(3, end) if card.text(i)]
            if len(given) not in _CELLS[name]:
                wanted = " or ".join(map(str, _CELLS[name]))
                raise MeshFileError(f"{name} {card.text(1)} has {len(given)} nodes: give {wanted}")
            kind = _CELLS[name][len(given)]
            cells.setdefault(kind, []).append((card.integer(2) if card.text(2) else card.integer(1), given))
    if not grids or not cells:
        raise MeshFileError("it has no GRID, or no cell such as CTETRA or CHEXA: export nodes and elements")
    for number, (system, at) in grids.items():
        grids[number] = default_system if system < 0 else system, at
    points = np.array([systems.place(number) for number in grids])
    mesh, pieces, start = MeshData(points, [], {}), [], 0
    for kind, rows in cells.items():
        nodes = node_rows(np.array(list(grids)), np.array([nodes for _, nodes in rows]))
        mesh.blocks.append((kind, nodes[:, _ORDER.get(kind, slice(None))]))
        properties = np.array([number for number, _ in rows])
        pieces += [(str(p), dimension(kind), start + np.flatnonzero(properties == p)) for p in np.unique(properties)]
        start += len(rows)
    mesh.groups = collect(pieces)
    return mesh


def _cards(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the name and the fields of each card of the bulk data, its name being field 0."""
    lines = text.upper().splitlines()
    begin = next((i for i, line in enumerate(lines) if re.match(r"\s*BEGIN\b", line)), -1)
    name, fields = "", list[str]()
    for number, raw in enumerate(lines):
        line = raw.split("$")[0].expandtabs(8).rstrip()
        if line.lstrip().startswith("INCLUDE"):
            raise MeshFileError(f"line {number + 1} has an INCLUDE: put the included file in its place")
        if number <= begin or not line:
            continue
        if line.startswith("ENDDATA"):
            break
        first, more = _split(line)
        if first[:1] in ("", "+", "*"):
            fields += more
            continue
        if name:
            yield name, fields
        name, fields = first.rstrip("*_"), [first, *more]  # meshio writes CTETRA_
    if name:
        yield name, fields


def _split(line: str) -> tuple[str, list[str]]:
    """Return the first field of a line and its data fields, which are 8, or 4 in the large format."""
    if "," in line:
        first, *more = (field.strip() for field in line.split(","))
        count = 4 if "*" in first else 8
    else:
        first = line[:8].strip()
        width = 16 if "*" in first else 8
        count = 64 // width
        more = [line[i : i + width].strip() for i in range(8, 72, width)]
    return first, [*more, *[""] * count][:count]


class _Card:
    """The fields of a card, numbered as in Nastran's manual from field 1 after the name."""

    def __init__(self, name: str, fields: list[str]) -> None:
        self.name, self.fields = name, fields

    def text(self, i: int) -> str:
        return self.fields[i] if i < len(self.fields) else ""

    def integer(self, i: int) -> int:
        """Return an integer, 0 for a blank field."""
        try:
            return int(self.text(i) or 0)
        except ValueError:
            raise self._refused(i, "an integer") from None

    def real(self, i: int) -> float:
        """Return a real number, which may lack the E of its exponent (``1.0-5``); 0 for a blank field."""
        text = re.sub(r"(?<=[\d.])([+-])", r"E\1", self.text(i).replace("D", "E"))
        try:
            return float(text or 0)
        except ValueError:
            raise self._refused(i, "a number") from None

    def _refused(self, i: int, wanted: str) -> MeshFileError:
        return MeshFileError(f'{self.name} {self.text(1)} has "{self.text(i)}" in place of {wanted}')


class _Systems:
    """The coordinate systems of a file: rectangular, cylindrical or spherical, each defined in another one."""

    def __init__(self, grids: dict[int, tuple[int, list[float]]]) -> None:
        self.grids = grids
        self.kinds = dict[int, str]()
        self.definitions = dict[int, tuple[int | None, list]]()
        self.frames: dict[int, tuple[np.ndarray, np.ndarray]] = {0: (np.zeros(3), np.eye(3))}
        self.open = set[int]()

    def add(self, card: _Card, form: str, kind: str) -> None:
        """Add a system by three points (form 2) or each of up to two by three nodes (form 1)."""
        for first in (1,) if form == "2" else (1, 5):
            if not card.text(first):
                continue
            number = card.integer(first)
            self.kinds[number] = kind
            if form == "2":
                points = np.array([card.real(i) for i in range(3, 12)]).reshape(3, 3)
                self.definitions[number] = card.integer(2), list(points)
            else:
                self.definitions[number] = None, [card.integer(first + i) for i in (1, 2, 3)]

    def place(self, node: int) -> np.ndarray:
        """Return where a node is in the basic system."""
        if node not in self.grids:
            raise MeshFileError(f"a CORD1 card names GRID {node}, which is not in the file")
        system, at = self.grids[node]
        return self._transform(system, np.array(at), f"GRID {node}")

    def _transform(self, system: int, at: np.ndarray, by: str) -> np.ndarray:
        """Transform coordinates in a system to the basic one."""
        if system == 0:
            return at
        kind = self.kinds.get(system)
        if kind in ("C", "S"):
            radius, height = at[0], at[2]
            angle = np.radians(at[1])
            if kind == "S":
                radius, height, angle = at[0] * np.sin(angle), at[0] * np.cos(angle), np.radians(at[2])
            at = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
        origin, axes = self._frame(system, by)
        return origin + at @ axes

    def _frame(self, system: int, by: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the origin and the axes, as rows, of a system."""
        if system in self.frames:
            return self.frames[system]
        if system not in self.definitions:
            raise MeshFileError(
                f"{by} is in coordinate system {system}, which no CORD1 or CORD2 card defines: export in the basic one"
            )
        if system in self.open:
            raise MeshFileError(f"coordinate system {system} is defined in itself: export in the basic one")
        self.open.add(system)
        base, given = self.definitions[system]
        name = f"coordinate system {system}"
        a, b, c = ([self.place(g) for g in given] if base is None
                   else [self._transform(base, p, name) for p in given])  # fmt: skip
        z = b - a
        y = np.cross(z, c - a)
        if not np.linalg.norm(y) > 0:
            raise MeshFileError(f"the three points of {name} lie on a line")
        rows = np.array([np.cross(y, z), y, z])
        self.frames[system] = a, rows / np.linalg.norm(rows, axis=1, keepdims=True)
        return self.frames[system]
