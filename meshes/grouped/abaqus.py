"""Abaqus and CalculiX input files: nodes, cells, element sets and surfaces of one part, placed as its instance is."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from meshes.grouped.data import Element, MeshData, MeshFileError, assemble

# Types of elements: a family and the count of nodes (but STRI65 has 6); the kind of cell by meshio's names.
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
    "TIE": "merge the meshes, so that the tied parts share nodes",
    **dict.fromkeys(("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"), "write all nodes and elements out"),
}  # fmt: skip


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
        if line.lstrip().startswith("*") or open_line:
            if not open_line:
                blocks.append(_Block(number, " ".join(fields.pop(0).lstrip("* ").upper().split())))
            # A line of options that ends in a comma goes on.
            open_line = line.rstrip().endswith(",")
            for word in filter(None, fields):
                key, _, value = word.partition("=")
                blocks[-1].options[key.strip().upper()] = value.strip().strip('"')
        elif blocks:
            blocks[-1].rows.append(fields)
    return blocks


def read_abaqus(text: str) -> MeshData:
    """Read an Abaqus input file. Raises MeshFileError."""
    scope, parts, instances, motion = "FILE", 0, list[str](), list[float]()
    nodes, surfaces = dict[int, list[float]](), dict[str, list[list[str]]]()
    elements, sets, names = dict[int, tuple[str, list[int]]](), dict[str, list[str]](), dict[str, str]()
    for block in _blocks(text):
        keyword, options, where = block.keyword, block.options, f"line {block.line} has *{block.keyword}"
        if keyword in _REFUSED:
            raise MeshFileError(f"{where}: {_REFUSED[keyword]}")
        if "INPUT" in options and keyword in ("NODE", "ELEMENT", "ELSET"):
            raise MeshFileError(f"{where} with INPUT: put that file's lines in its place")
        if keyword in ("PART", "ASSEMBLY", "INSTANCE"):
            scope = keyword
            parts += keyword == "PART"
        elif keyword.startswith("END "):
            scope = "ASSEMBLY" if keyword == "END INSTANCE" else "FILE"
        if keyword == "INSTANCE":
            instances.append(options.get("NAME", ""))
            motion = [float(word) for word in block.words]
        # Nodes and elements of the assembly itself are reference points and the like.
        elif keyword == "NODE" and scope != "ASSEMBLY":
            if options.get("SYSTEM", "R").upper() != "R":
                raise MeshFileError(f"{where} with SYSTEM: write the nodes in rectangular coordinates")
            nodes |= {int(row[0]): [float(x or 0) for x in (*row[1:4], "0", "0")[:3]] for row in block.rows}
        elif keyword == "ELEMENT" and scope != "ASSEMBLY":
            added = _elements(block)
            elements |= added
            members = list(map(str, added))
        elif keyword == "ELSET":
            members = _members(block)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            surfaces[options.get("NAME", "")] = block.rows
        if keyword in ("ELEMENT", "ELSET") and (name := options.get("ELSET")):
            sets.setdefault(name.upper(), []).extend(members)
            if "INTERNAL" not in options:
                names.setdefault(name.upper(), name)
    if parts > 1 or len(instances) > 1:
        shown = f"{len(instances)} *INSTANCE ({', '.join(instances)})" if len(instances) > 1 else f"{parts} *PART"
        raise MeshFileError(
            f"it has {shown}, whose nodes are not shared, and one part is read: merge them into one (in Abaqus/CAE: "
            "Assembly, Merge/Cut Instances, merge meshes) and write that part"
        )
    if not nodes or not elements:
        raise MeshFileError("it has no *NODE, or no *ELEMENT of a solid: write nodes and elements")
    groups: dict[int, list[str]] = {number: [] for number in elements}
    for key, name in names.items():
        for number in _resolved(key, sets) & elements.keys():
            groups[number].append(name)
    cells: list[Element] = [(kind, corners, groups[number]) for number, (kind, corners) in elements.items()]
    for name, rows in surfaces.items():
        cells += [(kind, corners, [name]) for kind, corners in _faces(rows, elements, sets)]
    points = _moved(np.array(list(nodes.values())), np.array(motion))
    return assemble(dict(zip(nodes, points, strict=True)), cells)


def _elements(block: _Block) -> dict[int, tuple[str, list[int]]]:
    """Return the kind and the nodes of each element of a block by its number; none of lines and points."""
    form = block.options.get("TYPE", "").upper()
    match = _TYPE.match(form)
    if not match:
        return {}
    count = 6 if form == "STRI65" else int(match[2] or match[3])
    kind = (_VOLUMES if match["volume"] else _SURFACES).get(count)
    words = list(map(int, block.words))
    if kind is None or len(words) % (count + 1):
        raise MeshFileError(f"the data of an *ELEMENT block do not fit TYPE={form}")
    return {words[i]: (kind, words[i + 1 : i + 1 + count]) for i in range(0, len(words), count + 1)}


def _unscoped(name: str) -> str:
    """Return a name without its part or instance, in capitals, as names do not distinguish these."""
    return name.rpartition(".")[2].strip('"').upper()


def _members(block: _Block) -> list[str]:
    """Return the elements, by number or by the set that they are in, of a block that adds them to a set."""
    if "GENERATE" not in block.options:
        return list(map(_unscoped, block.words))
    ranges = [[int(word) for word in row if word] for row in block.rows]
    return [str(number) for first, last, *step in ranges for number in range(first, last + 1, *step)]


def _resolved(name: str, sets: dict[str, list[str]], above: tuple[str, ...] = ()) -> set[int]:
    """Return the numbers of the elements of a set, which may hold other sets, or of one element."""
    if name.isdigit():
        return {int(name)}
    if name not in sets or name in above:
        raise MeshFileError(f'it uses element set "{name}" without defining it')
    return set().union(*(_resolved(member, sets, (*above, name)) for member in sets[name]))


def _faces(
    rows: list[list[str]], elements: dict[int, tuple[str, list[int]]], sets: dict[str, list[str]]
) -> Iterator[tuple[str, list[int]]]:
    """Yield the kind and the corners of the faces of a surface, whose rows have a set or element and a face."""
    for name, *label in rows:
        for number in _resolved(_unscoped(name), sets):
            kind, nodes = elements.get(number, ("", []))
            form = kind.rstrip("0123456789")
            if form in _FACES and label and label[0].upper()[:1] == "S":
                face, corners = _FACES[form]
                yield face, [nodes[i] for i in corners[int(label[0][1:]) - 1]]


def _moved(points: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return points translated by the first three numbers of an *INSTANCE, then turned about the axis through the two
    points that follow, by the angle in degrees at the end."""
    points = points + (motion[:3] if len(motion) >= 3 else 0.0)
    if len(motion) < 10:
        return points
    a, b, angle = motion[3:6], motion[6:9], np.radians(motion[9])
    axis = (b - a) / np.linalg.norm(b - a)
    r = points - a
    # Rodrigues' rotation formula.
    along = np.outer(r @ axis, axis) * (1 - np.cos(angle))
    return a + r * np.cos(angle) + np.cross(axis, r) * np.sin(angle) + along
