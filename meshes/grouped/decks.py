"""The input decks of solid codes: Abaqus, CalculiX, Nastran.

Of Abaqus and CalculiX input files the nodes, cells, element sets and surfaces of one part are read, of Nastran bulk
data the nodes, cells, and properties as groups. A card is a line of fields and its continuations, in the small (8
columns), large (16 columns) or free (commas) format.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from meshes.grouped.model import MeshData, MeshFileError, node_rows

Element = tuple[str, list[int], list[str]]
"""A cell: its kind by meshio's name, the numbers of its nodes in meshio's order, and its groups."""
Key = tuple[str, str]
"""The scope of a set or a surface, "part" or "assembly", and its name: both may have one of the same name."""
# Types of elements: a family and the count of nodes; the kind of cell by meshio's names.
_TYPE = re.compile(r"(?P<volume>(?:C|DC|DCC|AC|EMC|Q)3D)(\d+)|(?:CPS|CPEG?|D?CAX|DC2D|STRI|SFM3D|[MRF]3D|D?S)(\d)")
_VOLUMES = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10", 13: "pyramid13", 15: "wedge15",
            20: "hexahedron20", 27: "hexahedron27"}  # fmt: skip
_SURFACES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
# Corners of the faces S1, S2, ... of a cell.
_FACES = {
    "tetra": ("triangle", ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))),
    "hexahedron": ("quad", ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))),
}
_REFUSED = {
    "INCLUDE": "put the included file in its place", "SYSTEM": "write the nodes in the global system",
    "PARAMETER": "write numbers in place of the parameters",
    "TIE": "merge the meshes, so that the tied parts share nodes",
    **dict.fromkeys(("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"), "write all nodes and elements out"),
}  # fmt: skip
# Cards of cells, with the numbers of nodes that each may have; of shells the corners count.
_SOLIDS = {"CTETRA": (4, 10), "CPYRAM": (5, 13), "CPENTA": (6, 15), "CHEXA": (8, 20)}
_SHELLS = {**dict.fromkeys(("CTRIA3", "CTRIAR", "CTRIA6"), (3,)),
           **dict.fromkeys(("CQUAD4", "CQUADR", "CQUAD8", "CQUAD"), (4,))}  # fmt: skip
# Nastran has the upright edges of a hexahedron before the edges of its top.
_HEXAHEDRON20 = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]


def _assembled(nodes: dict[int, list[float]], elements: list[Element]) -> MeshData:
    """Make the mesh of nodes, by their numbers in the file, and of elements."""
    ids, alike = np.array(list(nodes)), dict[tuple[str, tuple[str, ...]], list[list[int]]]()
    for kind, corners, names in elements:
        alike.setdefault((kind, tuple(names)), []).append(corners)
    blocks = [(kind, node_rows(ids, np.array(rows)), names) for (kind, names), rows in alike.items()]
    return MeshData(np.array(list(nodes.values()), float), blocks)


@dataclass
class _Block:
    """The line, the keyword, the options and the data of a keyword line; keyword and options in capitals."""

    line: int
    keyword: str
    options: dict[str, str] = field(default_factory=dict)
    rows: list[list[str]] = field(default_factory=list)

    @property
    def words(self) -> list[str]:
        """All data in one list, without blank fields."""
        return [word for row in self.rows for word in row if word]


def _blocks(text: str) -> list[_Block]:
    blocks, open_line = list[_Block](), False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("**") or not line.strip():
            continue
        fields = [word.strip() for word in line.split(",")]
        open_line = open_line and not re.match(r"\s*[*\d]", line)
        if line.lstrip().startswith("*") or open_line:
            if not open_line:
                blocks.append(_Block(number, " ".join(fields.pop(0).lstrip("* ").upper().split())))
            # A line of options that ends in a comma goes on, but not into data.
            open_line = line.rstrip().endswith(",")
            for word in filter(None, fields):
                key, _, value = word.partition("=")
                blocks[-1].options[key.strip().upper()] = value.strip().strip('"')
        elif blocks:
            blocks[-1].rows.append(fields)
    return blocks


def read_abaqus(text: str) -> MeshData:
    """Read an Abaqus input file. Raises MeshFileError."""
    nodes, elements, scope = dict[int, list[float]](), dict[int, tuple[str, list[int]]](), "part"
    sets, names, surfaces = dict[Key, set[int]](), dict[Key, str](), dict[Key, list[list[str]]]()
    blocks = _blocks(text)
    for word in ("INSTANCE", "PART"):
        if (count := sum(block.keyword == word for block in blocks)) > 1:
            raise MeshFileError(
                f"it has {count} *{word}, whose nodes are not shared, and one part is read: merge them into one (in "
                "Abaqus/CAE: Assembly, Merge/Cut Instances, merge meshes) and write that part"
            )
    for block in blocks:
        keyword, options, members = block.keyword, block.options, set[int]()
        where = f"line {block.line} has *{keyword}"
        if keyword in _REFUSED:
            raise MeshFileError(f"{where}: {_REFUSED[keyword]}")
        if "INPUT" in options and keyword in ("NODE", "ELEMENT", "ELSET"):
            raise MeshFileError(f"{where} with INPUT: put that file's lines in its place")
        if keyword.removeprefix("END ") in ("PART", "ASSEMBLY", "INSTANCE"):
            if keyword == "INSTANCE" and any(map(float, block.words)):
                raise MeshFileError(f"{where} with a translation or rotation: write the part where it stands")
            scope = "assembly" if keyword in ("ASSEMBLY", "END INSTANCE") else "part"
        # Nodes and elements of the assembly itself are reference points and the like.
        elif keyword == "NODE" and scope == "part":
            if options.get("SYSTEM", "R").upper() != "R":
                raise MeshFileError(f"{where} with SYSTEM: write the nodes in rectangular coordinates")
            at = {int(row[0]): (*row[1:4], "0", "0", "0")[:3] for row in block.rows}
            nodes |= {n: [float(x.upper().replace("D", "E") or 0) for x in own] for n, own in at.items()}
        elif keyword == "ELEMENT" and scope == "part":
            added = _elements(block)
            elements |= added
            members = set(added)
        elif keyword == "ELSET" and "GENERATE" in options:
            ranges = [[int(word) for word in row if word] for row in block.rows]
            members = {number for first, last, *step in ranges for number in range(first, last + 1, *step)}
        elif keyword == "ELSET":
            members = _resolved(block.words, sets, scope)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            surfaces[scope, options.get("NAME", "")] = block.rows
        if keyword in ("ELEMENT", "ELSET") and (name := options.get("ELSET")):
            key = scope, name.upper()
            sets.setdefault(key, set()).update(members)
            if "INTERNAL" not in options:
                names.setdefault(key, name)
    if not nodes or not elements:
        raise MeshFileError("it has no *NODE, or no *ELEMENT of a solid: write nodes and elements")
    groups: dict[int, list[str]] = {number: [] for number in elements}
    for name, members in _by_name({(key[0], name): sets[key] for key, name in names.items()}).items():
        for number in members & elements.keys():
            groups[number].append(name)
    cells: list[Element] = [(kind, corners, groups[number]) for number, (kind, corners) in elements.items()]
    faces = {key: _faces(rows, elements, sets, key[0]) for key, rows in surfaces.items()}
    for name, each in _by_name(faces).items():
        cells += [(kind, corners, [name]) for kind, corners in each]
    mesh, others = _assembled(nodes, cells), [block for block in blocks if block.keyword in ("NSET", "SURFACE")]
    of_nodes = "a set of nodes, shells or whole cells (give a *SURFACE of faces S1, S2, ...)"
    mesh.others |= {block.options.get("NSET") or block.options.get("NAME", ""): of_nodes for block in others}
    return mesh


def _by_name(given: dict[Key, Any]) -> dict[str, Any]:
    """Return sets or surfaces by their names, after the scope where both scopes have one of the same name."""
    count = Counter(name for _, name in given)
    return {name if count[name] == 1 else f"{scope}.{name}": of for (scope, name), of in given.items()}


def _elements(block: _Block) -> dict[int, tuple[str, list[int]]]:
    """Return the kind and the nodes of each element of a block by its number; none of lines and points."""
    form = block.options.get("TYPE", "").upper()
    match = _TYPE.match(form)
    if not match:
        # All but beams, springs and the like have more than five nodes.
        if max(map(len, block.rows), default=0) > 6:
            raise MeshFileError(f"line {block.line} has elements of type {form}: write solids as C3D or DC3D elements")
        return {}
    count = int(match[2] or match[3])
    kind = (_VOLUMES if match["volume"] else _SURFACES).get(count)
    words = list(map(int, block.words))
    if kind is None or len(words) % (count + 1):
        raise MeshFileError(f"line {block.line} has *ELEMENT, TYPE={form}: give each its number and {count} nodes")
    return {words[i]: (kind, words[i + 1 : i + 1 + count]) for i in range(0, len(words), count + 1)}


def _resolved(words: list[str], sets: dict[Key, set[int]], scope: str) -> set[int]:
    """Return the numbers of elements that are given by number, or by a set that is defined before."""
    numbers = set[int]()
    for word in words:
        # Names have parts and instances, and do not distinguish capitals.
        name = word.rpartition(".")[2].strip('"').upper()
        found = sets.get((scope if name == word.strip('"').upper() else "part", name), sets.get(("part", name)))
        if not name.isdigit() and found is None:
            raise MeshFileError(f'it uses element set "{name}" without defining it')
        numbers |= {int(name)} if found is None else found
    return numbers


def _faces(
    rows: list[list[str]], elements: dict[int, tuple[str, list[int]]], sets: dict[Key, set[int]], scope: str
) -> list[tuple[str, list[int]]]:
    """Return the kind and the corners of the faces of a surface, whose rows have a set or element and a face; none of
    a surface with other rows."""
    faces = list[tuple[str, list[int]]]()
    for name, label in ((row[0], row[1].upper() if len(row) > 1 else "") for row in rows):
        if not re.fullmatch("S[1-6]", label):
            return []
        for number in _resolved([name], sets, scope):
            kind, nodes = elements.get(number, ("", []))
            if form := _FACES.get(kind.rstrip("0123456789")):
                face, corners = form
                faces.append((face, [nodes[i] for i in corners[int(label[1]) - 1]]))
    return faces


def read_nastran(text: str) -> MeshData:
    """Read Nastran bulk data. Raises MeshFileError."""
    nodes, elements = dict[int, list[float]](), list[Element]()
    for card in _cards(text):
        called = f"{card.name} {card.field(1)}".strip()
        if card.name in ("GRID", "GRDSET") and card.integer(2):
            raise MeshFileError(f"{called} has coordinate system {card.field(2)}: export the nodes in the basic system")
        if card.name == "GRID":
            nodes[card.integer(1)] = [card.real(i) for i in (3, 4, 5)]
        elif counts := (_SOLIDS | _SHELLS).get(card.name):
            # A shell has further fields, such as THETA, after its corners.
            end = len(card.fields) if card.name in _SOLIDS else 3 + max(counts)
            corners = [card.integer(i) for i in range(3, end) if card.field(i)]
            if len(corners) not in counts:
                raise MeshFileError(f"{called} has {len(corners)} nodes: give {' or '.join(map(str, counts))}")
            kind = (_VOLUMES if card.name in _SOLIDS else _SURFACES)[len(corners)]
            corners = [corners[i] for i in _HEXAHEDRON20] if kind == "hexahedron20" else corners
            elements.append((kind, corners, [str(card.integer(2) if card.field(2) else card.integer(1))]))
        elif re.match("=|C(HEX|TET|PEN|PYR|IF)", card.name):
            raise MeshFileError(f"{called} is not read: write each node as a GRID and each cell as a CTETRA or CHEXA")
    if not nodes or not elements:
        raise MeshFileError("it has no GRID, or no cell such as CTETRA or CHEXA: export nodes and elements")
    return _assembled(nodes, elements)


class _Card:
    """The fields of a card, numbered as in Nastran's manual: its name is field 0."""

    def __init__(self, fields: list[str]) -> None:
        self.name, self.fields = fields[0].rstrip("*_"), fields  # meshio writes CTETRA_

    def field(self, i: int) -> str:
        return self.fields[i] if i < len(self.fields) else ""

    def integer(self, i: int) -> int:
        """Return an integer, 0 for a blank field."""
        return int(self._number(i, self.field(i), int))

    def real(self, i: int) -> float:
        """Return a real number, which may lack the E of its exponent (``1.0-5``); 0 for a blank field."""
        return self._number(i, re.sub(r"(?<=[\d.])([+-])", r"E\1", self.field(i).replace("D", "E")), float)

    def _number(self, i: int, text: str, kind: type[int] | type[float]) -> float:
        try:
            return kind(text or 0)
        except ValueError:
            wanted = "an integer" if kind is int else "a number"
            raise MeshFileError(f'{self.name} {self.field(1)} has "{self.field(i)}" in place of {wanted}') from None


def _cards(text: str) -> list[_Card]:
    """Return the cards of the bulk data."""
    lines, cards = text.upper().splitlines(), list[_Card]()
    begin = next((i for i, line in enumerate(lines) if re.match(r"\s*BEGIN\b", line)), -1)
    for number, raw in enumerate(lines):
        line = raw.split("$")[0].expandtabs(8).rstrip()
        if number != begin and (wrong := re.match(r"\s*(INCLUDE|BEGIN)\b", line)):
            raise MeshFileError(f"line {number + 1} has {wrong[1]}: put all files and superelements into one bulk data")
        if number <= begin or not line:
            continue
        if line.startswith("ENDDATA"):
            break
        first, more = _split(line, bool(cards) and "*" in cards[-1].fields[0])
        if first[:1] not in ("", "+", "*"):
            cards.append(_Card([first, *more]))
        elif cards:
            cards[-1].fields += more
    return cards


def _split(line: str, large: bool) -> tuple[str, list[str]]:
    """Return the first field and the 8 data fields; 4 in the large format, also of a blank line below a large card."""
    first, *more = (field.strip() for field in line.split(",")) if "," in line else [line[:8].strip()]
    count = 4 if "*" in first or (large and not first) else 8
    if "," not in line:
        width = 64 // count
        more = [line[i : i + width].strip() for i in range(8, 72, width)]
    return first, [*more, *[""] * count][:count]
