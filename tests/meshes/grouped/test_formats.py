"""A bar of 100 um between 293 K at both ends with 0.1 V across, as mesh generators and solvers write it.

Its middle is at 293 K + V^2/(8 rho k) = 305.5 K, and it carries V A/(rho L) = 100 mA.
"""

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import compare
from fem3d.runs.scene import solve
from scenes import load
from tests.meshes.grouped.boxes import KUHN
from validate.cli import main

SCENE = """
boundary = [
    {{name = "l", group = "{left}", temperature = "293 K"}},
    {{name = "lv", group = "{left}", voltage = "0.1 V"}},
    {{name = "r", group = "{right}", temperature = "293 K"}},
    {{name = "rv", group = "{right}", voltage = 0}},
]
probe = [
    {{name = "mid", at = ["50 um", "5 um", "5 um"]}},
    {{name = "I", quantity = "current", group = "{left}"}},
]
[scene]
initial_temperature = "293 K"
[mesh]
file = "{file}"
unit = "um"
[run]
steady = true
accuracy = 1e-3
[[material]]
name = "metal"
groups = [{metal}]
thermal_conductivity = 100
resistivity = "1e-6 ohm m"
"""
X = np.arange(5) * 25.0
POINTS = np.array([(x, y, z) for x in X for y in (0.0, 10.0) for z in (0.0, 10.0)])
# The cells of the bar by the numbers of their nodes, from 1 on, and the faces at its ends.
HEXAHEDRA = [[a + k for k in (1, 5, 7, 3, 2, 6, 8, 4)] for a in range(0, 16, 4)]
LEFT, RIGHT = [1, 3, 4, 2], [17, 19, 20, 18]
TETRAHEDRA = [[cell[i] for i in corners] for cell in HEXAHEDRA for corners in KUHN]
# The halves of the ends that are faces of the tetrahedra, with the group of each.
TRIANGLES = [(2, [1, 4, 2]), (2, [1, 3, 4]), (3, [17, 20, 18]), (3, [17, 19, 20])]
PROPERTIES = {"metal": "1", "left": "2", "right": "3"}


def write(folder: Path, name: str, content: str | bytes, **names: str) -> Path:
    """Write a mesh and the scene on it; return the path of the scene."""
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return scene(folder, name, **names)


def scene(folder: Path, name: str, metal: str = "metal", left: str = "left", right: str = "right") -> Path:
    path = folder / "bar.toml"
    groups = ", ".join(f'"{group}"' for group in metal.split())
    path.write_text(SCENE.format(file=name, metal=groups, left=left, right=right), encoding="utf-8")
    return path


def assert_solved(path: Path) -> None:
    steady = compare.solve(path).steady
    assert steady["mid"].value == pytest.approx(305.5, abs=1e-3)
    assert steady["I"].value == pytest.approx(0.1, rel=1e-4)


def refusal(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the sentence that refuses a scene."""
    assert main(["solve", str(path), "--no-figures", "--out", str(path.parent / "out")]) == 2
    message = capsys.readouterr().err.strip()
    assert message.startswith("validate: ")
    assert "\n" not in message
    return message


def small(*fields: object) -> str:
    """Return a card in Nastran's small fields, continued by a blank field 1."""
    texts = [str(field) for field in fields]
    lines = [texts[0], *[""] * (len(range(9, len(texts), 8)))]
    rows = [texts[1 + i : 9 + i] for i in range(0, max(len(texts) - 1, 1), 8)]
    return "".join(
        first.ljust(8) + "".join(t.ljust(8) for t in row) + "\n" for first, row in zip(lines, rows, strict=True)
    )


def grids(system: object = "", at: np.ndarray = POINTS) -> str:
    return "".join(small("GRID", n, system, *(f"{c:.5g}" for c in p)) for n, p in enumerate(at, 1))


def solids() -> str:
    cells = "".join(small("CHEXA", n, 1, *nodes) for n, nodes in enumerate(HEXAHEDRA, 1))
    return cells + small("CQUAD4", 11, 2, *LEFT) + small("CQUAD4", 12, 3, *RIGHT)


def deck(nodes: str = grids(), cells: str = solids(), head: str = "SOL 153\nCEND\nBEGIN BULK\n") -> str:
    return f"{head}{nodes}{cells}ENDDATA\n"


def free(card: str) -> str:
    """Return cards of small fields in the free format, with marked continuations."""
    lines = []
    for line in card.splitlines():
        fields = [line[i : i + 8].strip() for i in range(0, 72, 8)]
        lines.append(",".join([fields[0] or "+", *fields[1:], "+"]))
    return "\n".join(lines) + "\n"


def large(nodes: np.ndarray = POINTS, star: str = "*") -> str:
    lines = ""
    for n, (x, y, z) in enumerate(nodes, 1):
        lines += f"{'GRID*':8}{n:<16}{'':16}{x:<16.9g}{y:<16.9g}{star}\n{star:8}{z:<16.9g}\n"
    return lines


def short_exponents() -> str:
    """Return nodes with exponents that lack their E."""
    return "".join(
        small("GRID", n, "", *(f"{c / 10:.2f}+1" if k % 2 else f"{c:.1f}D0" for k, c in enumerate(p)))
        for n, p in enumerate(POINTS, 1)
    )


def tetrahedra() -> str:
    cells = "".join(small("CTETRA", n, 1, *nodes) for n, nodes in enumerate(TETRAHEDRA, 1))
    return cells + "".join(small("CTRIA3", 100 + n, p, *f) for n, (p, f) in enumerate(TRIANGLES))


NASTRAN = {
    "continued by a blank field": deck(),
    "free fields": deck(free(grids()), free(solids())),
    "marked continuations": deck(cells=solids().replace("\n        ", "+A\n+A      ")),
    "large fields": deck(large()),
    "large fields, continued by a blank field": deck(large(star="")),
    "lower case": deck().lower(),
    "no ENDDATA": deck().replace("ENDDATA\n", ""),
    "no BEGIN BULK": deck(head="$ Created by Gmsh\n"),
    "THETA of shells": deck(cells=solids() + small("CQUAD4", 99, 9, 1, 2, 4, 3, "0.", "")),
    "a shell without some middle nodes": deck(
        cells=solids().replace("CQUAD4  ", "CQUAD8  ") + small("CQUAD8", 99, 9, 1, 2, 4, 3, 9, "", 8, "", 90.0)
    ),
    "comments": deck(cells=solids().replace("\n", " $ a comment\n", 3)),
    "tabs": deck("".join("\t".join(map(str, ("GRID", n, "", *p))) + "\n" for n, p in enumerate(POINTS, 1))),
    "exponents without E": deck(short_exponents()),
    "tetrahedra": deck(cells=tetrahedra()),
    "default property": deck(cells=solids().replace("CQUAD4  11      2 ", "CQUAD4  2         ")),
}


@pytest.mark.parametrize("form", NASTRAN)
def test_nastran_forms_are_read(form, tmp_path):
    assert_solved(write(tmp_path, "bar.bdf", NASTRAN[form], **PROPERTIES))


NASTRAN_REFUSED = {
    "include": (deck("INCLUDE 'nodes.bdf'\n"), "line 4 has INCLUDE: put all files and superelements"),
    "another system": (deck(grids(4)), "GRID 1 has coordinate system 4: export the nodes in the basic system"),
    "another default system": (deck(small("GRDSET", "", 4)), "GRDSET has coordinate system 4"),
    "some middle nodes": (deck(cells=small("CTETRA", 7, 1, 1, 2, 3, 5, 6)), "CTETRA 7 has 5 nodes: give 4 or 10"),
    "27 nodes": (deck(cells=small("CHEXA", 7, 1, *range(1, 21), *range(1, 8))), "CHEXA 7 has 27 nodes: give 8"),
    "no number": (deck(grids().replace("25", "2x")), 'GRID 5 has "2X" in place of a number'),
    "replicated": (
        deck(cells=small("CHEXA", 1, 1, *HEXAHEDRA[0]) + small("=", "*1")),
        "= *1 is not read: write each node",
    ),
    "a pyramid of OptiStruct": (deck(cells=solids() + small("CPYRA", 7, 1, 1, 5, 7, 3, 9)), "CPYRA 7 is not read"),
    "superelements": (deck(cells=solids() + "BEGIN SUPER=1\n" + grids(at=2 * POINTS)), "has BEGIN: put all files"),
    "no node": (deck(grids(at=POINTS[:-1])), "a cell has node 20, which is not in the file"),
    "no cells": (deck(cells=""), "it has no GRID, or no cell such as CTETRA or CHEXA"),
    "wedges": (deck(cells=small("CPENTA", 7, 1, 1, 2, 3, 5, 6, 7)), "is made of wedge cells"),
}


def rows(items: Any) -> str:
    return "".join(", ".join(map(str, item)) + "\n" for item in items)


def nodes(at: np.ndarray = POINTS) -> str:
    return "*NODE\n" + rows((n, *p) for n, p in enumerate(at, 1))


def elements(
    kind: str = "C3D8", first: int = 1, cells: list[list[int]] = HEXAHEDRA, elset: str = ", ELSET=metal"
) -> str:
    return f"*ELEMENT, TYPE={kind}{elset}\n" + rows((n, *c) for n, c in enumerate(cells, first))


ENDS = elements("CPS4", 11, [LEFT], ", ELSET=left") + elements("S4R", 12, [RIGHT], ", ELSET=right")
SURFACES = (
    "*ELSET, ELSET=_left_S3, INTERNAL, INSTANCE=P-1\n1\n*ELSET, elset=_right_S5, internal, instance=P-1\n 4,\n"
    "*SURFACE, TYPE=ELEMENT, NAME=left\n_left_S3, S6\n*Surface, type=ELEMENT, name=right\n_right_S5, S4\n"
)


def instance(part: str, assembled: str = "", motion: str = "") -> str:
    return (
        f"*HEADING\n*Part, name=P\n{part}*End Part\n**\n*Assembly, name=A\n*Instance, name=P-1, part=P\n{motion}"
        f"*End Instance\n*Node\n1, 9., 9., 9.\n{assembled}*End Assembly\n"
    )


ABAQUS = {
    "flat": nodes() + elements() + ENDS,
    "a comma behind options": nodes() + elements().replace("metal", "metal,") + ENDS,
    "blank coordinates": nodes().replace("1, 0.0, 0.0, 0.0", "1", 1) + elements() + ENDS,
    "heat transfer elements": nodes() + elements("DC3D8E") + ENDS,
    "small letters": (nodes() + elements() + ENDS).lower(),
    "sets": nodes() + elements(elset="") + ENDS + "*ELSET, ELSET=a, GENERATE\n1, 3, 2\n*ELSET, ELSET=b\n2, 4\n"
    "*ELSET, ELSET=metal\na, b\n",
    "instance": instance(nodes() + elements() + ENDS),
    "element surfaces": instance(nodes() + elements(), SURFACES),
    "exponents with D": nodes().replace(".0", ".0D+00") + elements() + ENDS,
    "tetrahedra": nodes() + elements("C3D4", cells=TETRAHEDRA)
    + "".join(elements("CPS3", 100 + n, [f], f", ELSET={'left' if p == 2 else 'right'}") for n, (p, f) in
              enumerate(TRIANGLES)),
}  # fmt: skip


@pytest.mark.parametrize("form", ABAQUS)
def test_abaqus_forms_are_read(form, tmp_path):
    assert_solved(write(tmp_path, "bar.inp", ABAQUS[form]))


TWICE = instance(nodes() + elements() + ENDS, "*INSTANCE, NAME=P-2, PART=P\n50., 0., 0.\n*END INSTANCE\n")
ABAQUS_REFUSED = {
    "moved": (instance(nodes() + elements(), motion="50., 0., 0.\n"), "*INSTANCE with a translation or rotation"),
    "instances": (TWICE, "it has 2 *INSTANCE, whose nodes are not shared"),
    "parts": ("".join(f"*PART, NAME={p}\n{nodes()}{elements()}*END PART\n" for p in "AB"), "it has 2 *PART"),
    "include": ("*INCLUDE, INPUT=bar.inp\n", "line 1 has *INCLUDE: put the included file in its place"),
    "nodes elsewhere": ("*NODE, INPUT=nodes.txt\n" + elements(), "line 1 has *NODE with INPUT"),
    "cylindrical nodes": (nodes().replace("*NODE", "*NODE, SYSTEM=C"), "line 1 has *NODE with SYSTEM"),
    "generated nodes": (nodes() + "*NGEN\n1, 5, 1\n", "has *NGEN: write all nodes and elements out"),
    "node set": (
        nodes() + elements() + ENDS.replace("left", "l") + "*NSET, NSET=left\n1, 2, 3, 4\n",
        '"left" is a set of nodes',
    ),
    "parameters": ("*PARAMETER\na = 1.\n" + nodes(), "has *PARAMETER: write numbers"),
    "tie": (nodes() + elements() + ENDS + "*TIE, NAME=t\nleft, right\n", "has *TIE: merge the meshes"),
    "continuum shells": (nodes() + elements("SC8R"), "has elements of type SC8R: write solids as C3D or DC3D"),
    "sets of the part and the assembly": (
        instance(nodes() + elements(), "*ELSET, ELSET=metal, INSTANCE=P-1\n1\n" + SURFACES),
        'the volume groups are "assembly.metal" and "part.metal"',
    ),
    "a surface of shells": (
        nodes() + elements() + ENDS.replace("left", "l") + "*SURFACE, NAME=left\nl, SPOS\n",
        '"left" is a set of nodes, shells or whole cells (give a *SURFACE of faces S1, S2, ...)',
    ),
    "short element": (nodes() + "*ELEMENT, TYPE=C3D8\n1, 1, 2, 3\n", "line 22 has *ELEMENT, TYPE=C3D8: give each its"),
    "no cells": (nodes(), "it has no *NODE, or no *ELEMENT of a solid"),
}


NAMES = '$PhysicalNames\n3\n2 2 "left"\n2 3 "right"\n3 1 "metal"\n$EndPhysicalNames\n'
CELLS = [(4, 1, TETRAHEDRA), *((2, tag, [f for p, f in TRIANGLES if p == tag]) for tag in (2, 3))]
# Gmsh's Mesh.SaveAll adds the curves; none is in a physical group.
CURVES = [(1, 7, [[1, 3], [3, 4]])]


def gmsh_41(physical: bool, blocks: list[tuple[int, int, list[list[int]]]], binary: bool = False) -> bytes:
    """Return Gmsh's format 4.1; the physical groups have the numbers of the entities."""

    def put(kind: str, *numbers: Any) -> bytes:
        return np.array(numbers, kind).tobytes() if binary else (" ".join(map(str, numbers)) + "\n").encode()

    dims = {1: 1, 2: 2, 3: 2, 4: 3, 5: 3}
    entities = {dim: [tag for kind, tag, _ in blocks if dims[kind] == dim] for dim in (1, 2, 3)}
    text = f"$MeshFormat\n4.1 {int(binary)} 8\n".encode() + (put("<i4", 1) + b"\n") * binary
    text += b"$EndMeshFormat\n" + NAMES.encode() * physical + b"$Entities\n"
    text += put("<u8", 0, *map(len, entities.values()))
    for dim, tags in entities.items():
        for tag in tags:
            groups = [tag] * (physical and dim > 1)
            text += put("<i4", tag) + put("<f8", 0, 0, 0, 1, 1, 1) + put("<u8", len(groups)) + put("<i4", *groups)
            text += put("<u8", 0)
    text += b"\n$EndEntities\n$Nodes\n" + put("<u8", 2, 20, 1, 20) + put("<i4", 1, 7, 0) + put("<u8", 0)
    text += put("<i4", 3, 1, 0) + put("<u8", 20, *range(1, 21)) + put("<f8", *POINTS.ravel())
    text += b"\n$EndNodes\n$Elements\n" + put("<u8", len(blocks), 99, 1, 99)
    for kind, tag, cells in blocks:
        text += put("<i4", dims[kind], tag, kind) + put("<u8", len(cells))
        text += put("<u8", *(n for number, cell in enumerate(cells, 1) for n in (number, *cell)))
    return text + b"\n$EndElements\n"


def gmsh_22(physical: bool, blocks: list[tuple[int, int, list[list[int]]]], names: str = "") -> str:
    lines = [(kind, 2, tag if physical and tag < 9 else 0, tag, *c) for kind, tag, cells in blocks for c in cells]
    text = f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}$Nodes\n20\n"
    text += "".join(" ".join(map(str, (n, *p))) + "\n" for n, p in enumerate(POINTS.tolist(), 1))
    text += f"$EndNodes\n$Elements\n{len(lines)}\n"
    return text + "".join(" ".join(map(str, (n, *line))) + "\n" for n, line in enumerate(lines, 1)) + "$EndElements\n"


HALF = [(4, 1, [[a, b, d, c] for a, b, c, d in TETRAHEDRA[::2]] + TETRAHEDRA[1::2]), *CELLS[1:]]
GMSH: dict[str, tuple[str | bytes, dict[str, str]]] = {
    "4.1": (gmsh_41(True, CELLS), {}),
    "4.1 in binary": (gmsh_41(True, CELLS, binary=True), {}),
    "4.1 with SaveAll": (gmsh_41(True, CURVES + CELLS), {}),
    "4.1 with SaveAll below a comment": (b"$Comments\na bar\n$EndComments\n" + gmsh_41(True, CURVES + CELLS), {}),
    "4.1 without physical groups": (gmsh_41(False, CURVES + CELLS), PROPERTIES),
    "a volume in no physical group": (
        gmsh_22(True, [(4, 1, TETRAHEDRA[:12]), (4, 9, TETRAHEDRA[12:]), *CELLS[1:]], NAMES),
        {"metal": "metal 9"},
    ),
    "2.2": (gmsh_22(True, CELLS, NAMES), {}),
    "2.2 with SaveAll": (gmsh_22(False, CURVES + CELLS, NAMES), PROPERTIES),
    "2.2 without physical groups": (gmsh_22(False, CELLS), PROPERTIES),
    "some tetrahedra inverted": (gmsh_41(True, HALF), {}),
}


@pytest.mark.parametrize("form", GMSH)
def test_gmsh_forms_are_read(form, tmp_path):
    content, names = GMSH[form]
    assert_solved(write(tmp_path, "bar.msh", content, **names))


def test_binary_format_2_is_read_under_any_name(tmp_path):
    (tmp_path / "text.msh").write_text(gmsh_22(True, CELLS, NAMES), encoding="utf-8")
    meshio.read(tmp_path / "text.msh").write(tmp_path / "bar.msh2", file_format="gmsh22", binary=True)
    assert_solved(scene(tmp_path, "bar.msh2"))


def test_families_of_groups_are_read(tmp_path, monkeypatch):
    """As meshio reads MED files, with h5py, which is no dependency: each cell has the number of its groups."""
    (tmp_path / "bar.msh").write_text(gmsh_22(True, CELLS, NAMES), encoding="utf-8")
    found = meshio.read(tmp_path / "bar.msh")
    names = {tag: [name] for name, (tag, _) in found.field_data.items()}
    found.cell_data, found.cell_sets, found.field_data = {"cell_tags": found.cell_data["gmsh:physical"]}, {}, {}
    found.cell_tags = names
    monkeypatch.setattr(meshio, "read", lambda *_, **__: found)
    (tmp_path / "bar.med").touch()
    assert_solved(scene(tmp_path, "bar.med"))


GMSH_REFUSED = {
    "SaveAll without groups": (gmsh_22(False, CELLS, NAMES), "Mesh.SaveAll in format 2.2 drops groups"),
    "cut off": (gmsh_41(True, CELLS)[:-200], "its section $Elements is missing or ends early: save it again"),
    "too few numbers": (gmsh_41(True, CELLS).replace(b"3 1 4\n24", b"3 1 4\n99"), "cannot be read: it ends early"),
    "partitioned": (
        gmsh_41(True, CELLS) + b"$PartitionedEntities\n$EndPartitionedEntities\n",
        "it is partitioned: save it whole",
    ),
    "parametric": (gmsh_22(True, CELLS).replace("Nodes", "ParametricNodes"), "give a Gmsh 4.1 (.msh)"),
    "unknown cells": (gmsh_41(True, CELLS).replace(b"3 1 4\n", b"3 1 140\n"), "it has cells of Gmsh's type 140"),
}
REFUSED: dict[str, Any] = {"bdf": NASTRAN_REFUSED, "inp": ABAQUS_REFUSED, "msh": GMSH_REFUSED}


@pytest.mark.parametrize(("kind", "form"), [(kind, form) for kind, forms in REFUSED.items() for form in forms])
def test_a_file_is_refused_by_name(kind, form, tmp_path, capsys):
    content, sentence = REFUSED[kind][form]
    names = PROPERTIES if kind == "bdf" else {}
    assert sentence in refusal(write(tmp_path, f"bar.{kind}", content, **names), capsys)


@pytest.mark.parametrize("potential", [False, True])
def test_separate_parts_are_named_as_the_cause(potential, tmp_path, capsys):
    """The right half has nodes of its own, as two boxes in Gmsh without BooleanFragments."""
    own = np.where(POINTS[:, 0] == 50)[0] + 1
    apart = {int(n): 20 + k for k, n in enumerate(own, 1)}
    cells = HEXAHEDRA[:2] + [[apart.get(n, n) for n in cell] for cell in HEXAHEDRA[2:]]
    content = nodes(np.concatenate([POINTS, POINTS[own - 1]])) + elements(cells=cells) + ENDS
    path = write(tmp_path, "bar.inp", content)
    if potential:
        text = path.read_text(encoding="utf-8").replace(
            'group = "right", voltage = 0', 'group = "left", voltage = "0.1 V"'
        )
        probe = 'probe = [{name = "p", quantity = "potential", at = ["80 um", "5 um", "5 um"]},'
        path.write_text(text.replace("probe = [", probe), encoding="utf-8")
    message = refusal(path, capsys)
    assert (
        "2 parts that share no faces and 4 corners that lie where another one is without being joined to it" in message
    )
    assert "BooleanFragments" in message
    assert ("nothing determines its potential" if potential else "nothing happens in this scene") in message


def test_surfaces_of_part_and_assembly_with_one_name_are_two(tmp_path):
    """The part's own "left" is the right end; both have internal sets of one name."""
    own = SURFACES.replace("S6", "S4").replace("_left_S3, INTERNAL, INSTANCE=P-1\n1\n", "_left_S3, INTERNAL\n4\n")
    text = instance(nodes() + elements() + own.replace("_right_S5", "_x").replace("=right", "=x"), SURFACES)
    assert_solved(write(tmp_path, "bar.inp", text, left="assembly.left"))
    assert_solved(write(tmp_path, "bar.inp", text, left="assembly.left", right="part.left"))


def test_parts_that_have_no_corner_in_common_are_a_warning(tmp_path):
    """The right half is thinner than the left half, and a film at its end cools it."""
    thinner = POINTS[8:] * (1, 0.5, 0.5) + (0, 2.5, 2.5)
    right = [[n + 4 for n in cell] for cell in HEXAHEDRA[2:]]
    ends = elements("S4", 11, [LEFT], ", ELSET=left") + elements("S4", 12, [[n + 4 for n in RIGHT]], ", ELSET=right")
    content = nodes(np.concatenate([POINTS[:12], thinner])) + elements(cells=HEXAHEDRA[:2] + right) + ends
    path = write(tmp_path, "bar.inp", content)
    text = path.read_text(encoding="utf-8").replace('group = "right", voltage = 0', 'group = "left", voltage = "0.1 V"')
    text = text.replace('"right", temperature = "293 K"', '"right", convection = {coefficient = 10, ambient = "320 K"}')
    path.write_text(text.replace('quantity = "current", group', "group"), encoding="utf-8")
    found = solve(load(path)).details["warnings"]
    assert any("the mesh has 2 parts that share no faces" in warning for warning in found)


def test_tags_in_a_vtk_file_of_gmsh_are_groups(tmp_path):
    cells = [("tetra", np.array(TETRAHEDRA) - 1), ("triangle", np.array([face for _, face in TRIANGLES]) - 1)]
    tags = [np.ones(len(TETRAHEDRA), int), np.array([tag for tag, _ in TRIANGLES])]
    mesh = meshio.Mesh(POINTS, cells, cell_data={"CellEntityIds": tags})
    mesh.write(tmp_path / "bar.vtk", file_format="vtk42")
    assert_solved(scene(tmp_path, "bar.vtk", **PROPERTIES))


def test_a_mesh_with_voxels_is_refused(tmp_path, capsys):
    """Beside the tetrahedra, voxels would be lost."""
    cells = [("tetra", np.array(TETRAHEDRA) - 1), ("hexahedron", np.array(HEXAHEDRA) - 1)]
    meshio.Mesh(POINTS, cells).write(tmp_path / "bar.vtu", binary=False)
    text = (tmp_path / "bar.vtu").read_text(encoding="utf-8")
    (tmp_path / "bar.vtu").write_text(text.replace("\n12", "\n11"), encoding="utf-8")
    capsys.readouterr()
    assert "cells such as VTK's voxels, which are not read" in refusal(scene(tmp_path, "bar.vtu"), capsys)


def test_a_vtk_file_without_all_nodes_or_without_groups_is_refused(tmp_path, capsys):
    meshio.Mesh(POINTS[:-1], [("tetra", np.array(TETRAHEDRA) - 1)]).write(tmp_path / "bar.vtk", file_format="vtk42")
    assert "a cell has node 19, which is not in the file" in refusal(scene(tmp_path, "bar.vtk"), capsys)
    meshio.Mesh(POINTS, [("tetra", np.array(TETRAHEDRA) - 1)]).write(tmp_path / "bar.vtk", file_format="vtk42")
    assert "it has no volume groups (save it with physical groups" in refusal(scene(tmp_path, "bar.vtk"), capsys)
