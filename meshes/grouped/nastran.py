"""Nastran bulk data: nodes with their coordinate systems, cells, and properties as groups.

A card is a line of fields and its continuations, in the small (8 columns), large (16 columns) or free (commas) format.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from meshes.grouped.data import Element, MeshData, MeshFileError, assemble

# The kind of cell of a card for each count of nodes, by meshio's names.
_CELLS = {
    "CTETRA": {4: "tetra", 10: "tetra10"}, "CHEXA": {8: "hexahedron", 20: "hexahedron20"},
    "CPENTA": {6: "wedge", 15: "wedge15"}, "CPYRAM": {5: "pyramid", 13: "pyramid13"},
    "CTRIA3": {3: "triangle"}, "CTRIAR": {3: "triangle"}, "CTRIA6": {3: "triangle", 6: "triangle6"},
    "CQUAD4": {4: "quad"}, "CQUADR": {4: "quad"}, "CQUAD8": {4: "quad", 8: "quad8"},
    "CQUAD": {4: "quad", 8: "quad8", 9: "quad9"},
}  # fmt: skip
_SOLIDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRAM")
# Nastran has the upright edges of a hexahedron before those of its top.
_HEXAHEDRON20 = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]


def read_nastran(text: str) -> MeshData:
    """Read Nastran bulk data. Raises MeshFileError."""
    deck, elements, default_system = _Deck(), list[Element](), 0
    for card in _cards(text):
        if card.name == "GRID":
            system = card.integer(2) if card.field(2) else None
            deck.grids[card.integer(1)] = system, np.array([card.real(i) for i in (3, 4, 5)])
        elif card.name == "GRDSET":
            default_system = card.integer(2)
        elif match := re.match(r"CORD([12])([RCS])$", card.name):
            deck.add_system(card, *match.groups())
        elif card.name in _CELLS:
            kinds = _CELLS[card.name]
            # A shell has further fields, such as THETA, after its nodes.
            end = len(card.fields) if card.name in _SOLIDS else 3 + max(kinds)
            nodes = [card.integer(i) for i in range(3, end) if card.field(i)]
            if len(nodes) not in kinds:
                raise MeshFileError(
                    f"{card.name} {card.field(1)} has {len(nodes)} nodes: give {' or '.join(map(str, kinds))}"
                )
            kind = kinds[len(nodes)]
            nodes = [nodes[i] for i in _HEXAHEDRON20] if kind == "hexahedron20" else nodes
            elements.append((kind, nodes, [str(card.integer(2) if card.field(2) else card.integer(1))]))
    if not deck.grids or not elements:
        raise MeshFileError("it has no GRID, or no cell such as CTETRA or CHEXA: export nodes and elements")
    for number, (system, at) in deck.grids.items():
        deck.grids[number] = default_system if system is None else system, at
    return assemble({number: deck.place(number) for number in deck.grids}, elements)


class _Card:
    """The fields of a card, numbered as in Nastran's manual: its name is field 0."""

    def __init__(self, fields: list[str]) -> None:
        self.name, self.fields = fields[0].rstrip("*_"), fields  # meshio writes CTETRA_

    def field(self, i: int) -> str:
        return self.fields[i] if i < len(self.fields) else ""

    def integer(self, i: int) -> int:
        """Return an integer, 0 for a blank field."""
        try:
            return int(self.field(i) or 0)
        except ValueError:
            raise self._refusal(i, "an integer") from None

    def real(self, i: int) -> float:
        """Return a real number, which may lack the E of its exponent (``1.0-5``); 0 for a blank field."""
        try:
            return float(re.sub(r"(?<=[\d.])([+-])", r"E\1", self.field(i).replace("D", "E")) or 0)
        except ValueError:
            raise self._refusal(i, "a number") from None

    def _refusal(self, i: int, wanted: str) -> MeshFileError:
        return MeshFileError(f'{self.name} {self.field(1)} has "{self.field(i)}" in place of {wanted}')


def _cards(text: str) -> Iterator[_Card]:
    """Yield the cards of the bulk data."""
    lines = text.upper().splitlines()
    begin = next((i for i, line in enumerate(lines) if re.match(r"\s*BEGIN\b", line)), -1)
    fields = list[str]()
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
        if fields:
            yield _Card(fields)
        fields = [first, *more]
    if fields:
        yield _Card(fields)


def _split(line: str) -> tuple[str, list[str]]:
    """Return the first field of a line and its data fields, which are 8, or 4 in the large format."""
    first, *more = (field.strip() for field in line.split(",")) if "," in line else [line[:8].strip()]
    count = 4 if "*" in first else 8
    if "," not in line:
        width = 64 // count
        more = [line[i : i + width].strip() for i in range(8, 72, width)]
    return first, [*more, *[""] * count][:count]


class _Deck:
    """The nodes of a file in their coordinate systems: rectangular, cylindrical or spherical.

    A system has the kind "R", "C" or "S" and three points, each a node or coordinates in another system: its origin, a
    point on its z axis, and one in its xz plane.
    """

    def __init__(self) -> None:
        self.grids = dict[int, tuple[int | None, np.ndarray]]()
        self.systems = dict[int, tuple[str, list[int | tuple[int, np.ndarray]]]]()
        self.frames = dict[int, tuple[np.ndarray, np.ndarray] | None]()

    def add_system(self, card: _Card, form: str, kind: str) -> None:
        """Add a system by three points (form 2) or each of up to two by three nodes (form 1)."""
        if form == "2":
            points = np.array([card.real(i) for i in range(3, 12)]).reshape(3, 3)
            self.systems[card.integer(1)] = kind, [(card.integer(2), point) for point in points]
            return
        for first in (1, 5):
            if card.field(first):
                self.systems[card.integer(first)] = kind, [card.integer(first + i) for i in (1, 2, 3)]

    def place(self, node: int) -> np.ndarray:
        """Return the coordinates of a node in the basic system."""
        if node not in self.grids:
            raise MeshFileError(f"a CORD1 card names GRID {node}, which is not in the file")
        system, at = self.grids[node]
        return self._to_basic(system or 0, at, f"GRID {node}")

    def _to_basic(self, system: int, at: np.ndarray, by: str) -> np.ndarray:
        """Transform coordinates in a system to the basic one."""
        if system == 0:
            return at
        if system not in self.systems:
            raise MeshFileError(
                f"{by} is in coordinate system {system}, which no CORD1 or CORD2 card defines: export in the basic one"
            )
        kind = self.systems[system][0]
        if kind == "C":
            at = np.array([at[0] * np.cos(a := np.radians(at[1])), at[0] * np.sin(a), at[2]])
        elif kind == "S":
            polar, azimuth = np.radians(at[1:])
            radius = at[0] * np.sin(polar)
            at = np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), at[0] * np.cos(polar)])
        origin, axes = self._frame(system)
        return origin + at @ axes

    def _frame(self, system: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the origin and the axes, as rows, of a system."""
        name = f"coordinate system {system}"
        if system not in self.frames:
            self.frames[system] = None
            a, b, c = (
                self.place(each) if isinstance(each, int) else self._to_basic(*each, name)
                for each in self.systems[system][1]
            )
            z, y = b - a, np.cross(b - a, c - a)
            if not np.linalg.norm(y) > 0:
                raise MeshFileError(f"the three points of {name} lie on a line")
            rows = np.array([np.cross(y, z), y, z])
            self.frames[system] = a, rows / np.linalg.norm(rows, axis=1, keepdims=True)
        frame = self.frames[system]
        if frame is None:
            raise MeshFileError(f"{name} is defined in itself: export in the basic one")
        return frame
