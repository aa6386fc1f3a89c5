"""Abaqus and CalculiX input files: nodes, cells, element sets and surfaces of one part, placed as its instance is."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from meshes.grouped.data import MeshData, MeshFileError, Piece, collect, dimension, node_rows

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


def read_abaqus(text: str) -> MeshData:
    """Read an Abaqus input file. Raises MeshFileError."""
    model, scope, parts, instances = _Model(), "FILE", 0, list[str]()
    motion = list[float]()
    for number, keyword, options, rows in _blocks(text):
        if keyword in _REFUSED:
            raise MeshFileError(f"line {number} has *{keyword}: {_REFUSED[keyword]}")
        if "INPUT" in options and keyword in ("NODE", "ELEMENT", "ELSET"):
            raise MeshFileError(f"line {number} has *{keyword} with INPUT: put that file's lines in its place")
        if keyword in ("PART", "ASSEMBLY", "INSTANCE"):
            scope = keyword
            parts += keyword == "PART"
        elif keyword.startswith("END "):
            scope = "ASSEMBLY" if keyword == "END INSTANCE" else "FILE"
        if keyword == "INSTANCE":
            instances.append(options.get("NAME", ""))
            motion = [float(word) for row in rows for word in row if word]
        # Nodes and elements of the assembly itself are reference points and the like.
        elif keyword == "NODE" and scope != "ASSEMBLY":
            if options.get("SYSTEM", "R").upper() != "R":
                raise MeshFileError(f"line {number} has *NODE with SYSTEM: write the nodes in rectangular coordinates")
            model.nodes |= {int(row[0]): [float(x or 0) for x in (*row[1:4], "0", "0")[:3]] for row in rows}
        elif keyword == "ELEMENT" and scope != "ASSEMBLY":
            model.add_elements(options, rows)
        elif keyword == "ELSET":
            model.add_set(options, rows)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            model.surfaces[options.get("NAME", "")] = [(_unscoped(row[0]), *row[1:2]) for row in rows]
    if parts > 1 or len(instances) > 1:
        shown = f"{len(instances)} *INSTANCE ({', '.join(instances)})" if len(instances) > 1 else f"{parts} *PART"
        raise MeshFileError(
            f"it has {shown}, whose nodes are not shared, and one part is read: merge them into one (in Abaqus/CAE: "
            "Assembly, Merge/Cut Instances, merge meshes) and write that part"
        )
    return model.mesh(np.array(motion))


def _blocks(text: str) -> Iterator[tuple[int, str, dict[str, str], list[list[str]]]]:
    """Yield the line, the keyword, the options and the data of each block; keywords and options in capitals."""
    blocks: list[tuple[int, str, dict[str, str], list[list[str]]]] = []
    open_line = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("**") or not line.strip():
            continue
        fields = [word.strip() for word in line.split(",")]
        if line.lstrip().startswith("*") or open_line:
            if not open_line:
                blocks.append((number, " ".join(fields.pop(0).lstrip("* ").upper().split()), {}, []))
            # A line of options that ends in a comma goes on.
            open_line = line.rstrip().endswith(",")
            for word in filter(None, fields):
                key, _, value = word.partition("=")
                blocks[-1][2][key.strip().upper()] = value.strip().strip('"')
        elif blocks:
            blocks[-1][3].append(fields)
    return iter(blocks)


def _unscoped(name: str) -> str:
    """Return a name without its part or instance, in capitals, as names do not distinguish these."""
    return name.rpartition(".")[2].strip('"').upper()


class _Model:
    """Nodes, elements, sets of elements and surfaces of a part."""

    def __init__(self) -> None:
        self.nodes = dict[int, list[float]]()
        self.cells = dict[str, list[list[int]]]()
        self.names = dict[str, str]()
        self.sets = dict[str, list[int | str]]()
        self.surfaces = dict[str, list[tuple[str, ...]]]()

    def add_elements(self, options: dict[str, str], rows: list[list[str]]) -> None:
        """Add the elements of a block; those of lines and points only to their set."""
        kind = options.get("TYPE", "").upper()
        match = _TYPE.match(kind)
        if not match:
            return
        nodes = 6 if kind == "STRI65" else int(match[2] or match[3])
        name = (_VOLUMES if match["volume"] else _SURFACES).get(nodes)
        numbers = [int(x) for row in rows for x in row if x]
        if name is None or len(numbers) % (nodes + 1):
            raise MeshFileError(f"the data of an *ELEMENT block do not fit TYPE={kind}")
        cells = np.array(numbers, int).reshape(-1, nodes + 1).tolist()
        self.cells.setdefault(name, []).extend(cells)
        if "ELSET" in options:
            self._extend(options["ELSET"], [cell[0] for cell in cells])

    def add_set(self, options: dict[str, str], rows: list[list[str]]) -> None:
        """Add elements, by number or by the set that they are in, to a set."""
        members: list[int | str] = []
        for row in rows:
            words = [word for word in row if word]
            if "GENERATE" in options:
                first, last, *step = map(int, words)
                members += range(first, last + 1, *step)
            else:
                members += [int(_unscoped(word)) if _unscoped(word).isdigit() else _unscoped(word) for word in words]
        self._extend(options.get("ELSET", ""), members, "INTERNAL" in options)

    def _extend(self, name: str, members: list, internal: bool = False) -> None:
        if not internal:
            self.names.setdefault(name.upper(), name)
        self.sets.setdefault(name.upper(), []).extend(members)

    def _elements(self, name: str, above: tuple[str, ...] = ()) -> set[int]:
        """Return the numbers of the elements of a set, which may hold other sets."""
        if name not in self.sets or name in above:
            raise MeshFileError(f'it uses element set "{name}" without defining it')
        parts = [{m} if isinstance(m, int) else self._elements(m, (*above, name)) for m in self.sets[name]]
        return set().union(*parts)

    def mesh(self, motion: np.ndarray) -> MeshData:
        """Return the mesh, moved as its instance."""
        if not self.nodes or not self.cells:
            raise MeshFileError("it has no *NODE, or no *ELEMENT of a solid: write nodes and elements")
        ids = np.array(list(self.nodes))
        points = _moved(np.array(list(self.nodes.values())), motion)
        mesh, numbers, start = MeshData(points, [], {}), dict[int, tuple[int, str, list[int]]](), 0
        for kind, cells in self.cells.items():
            mesh.blocks.append((kind, node_rows(ids, np.array(cells)[:, 1:])))
            numbers |= {number: (start + i, kind, nodes) for i, (number, *nodes) in enumerate(cells)}
            start += len(cells)
        pieces: list[Piece] = []
        for key, name in self.names.items():
            members = [numbers[n] for n in self._elements(key) if n in numbers]
            for dim in (2, 3):
                pieces.append((name, dim, np.array([i for i, kind, _ in members if dimension(kind) == dim], int)))
        for name, given in self.surfaces.items():
            for kind, corners in self._faces(given, numbers).items():
                mesh.blocks.append((kind, node_rows(ids, np.array(corners))))
                pieces.append((name, 2, start + np.arange(len(corners))))
                start += len(corners)
        mesh.groups = collect(pieces)
        return mesh

    def _faces(self, given: list[tuple[str, ...]], numbers: dict) -> dict[str, list[list[int]]]:
        """Return the corners of the faces of a surface (set or element, face), by kind."""
        faces = dict[str, list[list[int]]]()
        for name, *label in given:
            for element in [int(name)] if name.isdigit() else self._elements(name):
                _, kind, nodes = numbers.get(element, (0, "", []))
                form = kind.rstrip("0123456789")
                if form in _FACES and label and label[0].upper()[:1] == "S":
                    face, corners = _FACES[form]
                    faces.setdefault(face, []).append([nodes[i] for i in corners[int(label[0][1:]) - 1]])
        return faces


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
