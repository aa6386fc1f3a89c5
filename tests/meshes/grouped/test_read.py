"""Groups come back from the files that mesh generators write, and every refusal names the fault."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import skfem

from meshes.grouped.check import Placed, check
from meshes.grouped.read import read
from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.loading import load_free as load
from tests.meshes.grouped import boxes
from tests.meshes.grouped.scenes import bar, bridge

CELLS = tuple(boxes.BLOCKS)


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("suffix", [".msh", ".bdf"])
def test_groups_come_back(cell, suffix, tmp_path):
    if suffix == ".bdf" and cell == "hexahedron27":
        pytest.skip("Nastran has no hexahedron of 27 nodes")
    mesh = boxes.grouped(from_dict(bridge()), cell, 1)
    path = tmp_path / f"mesh{suffix}"
    boxes.write(mesh, path, 1e-6)
    found = read(path, 1e-6)
    assert (found.file_type, found.count) == (cell, len(mesh.cells))
    names = {name: name for name in (*mesh.volumes, *mesh.surfaces)}
    if suffix == ".bdf":
        names = {name: str(number) for number, name in enumerate(names, 1)}
    for name, volume in {"beam": 2e-5 * 4e-6 * 2e-6, "foot": 5e-6 * 4e-6 * 2e-6}.items():
        cells = found.volumes[names[name]]
        assert skfem.Basis(found.mesh, ELEMENTS[found.simplex](), elements=cells).dx.sum() == pytest.approx(volume)
    for name, rows in mesh.surfaces.items():
        facets, side = found.surfaces[names[name]]
        assert len(facets) == len(rows)
        # They point out of the cell that they are seen from, which on the surface is the only one.
        assert (found.mesh.f2t[side, facets] >= 0).all()


ELEMENTS = {True: skfem.ElementTetP1, False: skfem.ElementHex1}


@pytest.mark.parametrize("cell", CELLS)
def test_inverted_cells_are_turned_round(cell, tmp_path):
    """The mirror image of a mesh, with bent edges, has the same volumes."""
    volumes = []
    for side in (1, -1):
        mesh = boxes.grouped(from_dict(bridge()), cell, 1, lambda p: p + 1e-7 * np.sin(p / 2e-6)[:, [1, 2, 0]])
        mesh.points *= (side, 1, 1)
        boxes.write(mesh, tmp_path / "mesh.msh", 1e-6)
        found = read(tmp_path / "mesh.msh", 1e-6)
        parts = (skfem.Basis(found.mesh, ELEMENTS[found.simplex](), elements=c) for c in found.volumes.values())
        volumes.append([basis.dx.sum() for basis in parts])
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-9)


TAIL = "thermal_conductivity=1\n[run]\nsteady=true\n"


def test_a_mesh_of_many_cells_is_read_without_a_word(tmp_path, caplog):
    """scikit-fem warns where it copies an array of more than 1000 cells."""
    boxes.write(boxes.grouped(from_dict(bridge()), "tetra", 4), tmp_path / "mesh.msh", 1e-6)
    assert read(tmp_path / "mesh.msh", 1e-6).count > 1000
    assert not caplog.records


def test_a_mesh_lies_beside_its_scene(tmp_path):
    (tmp_path / "chip.toml").write_text(
        '[mesh]\nfile="a.msh"\nunit="um"\n[[material]]\nname="a"\n' + TAIL, encoding="utf-8"
    )
    scene = load(tmp_path / "chip.toml", ["mesh.unit=mm"])
    assert (scene.path, scene.unit, scene.name) == (tmp_path / "a.msh", 1e-3, "chip")


Change = Callable[[dict[str, Any]], Any]


def put(table: str, number: int, **values: Any) -> Change:
    return lambda d: d[table][number].update(values)


def drop(table: str, number: int) -> Change:
    return lambda d: d[table].pop(number)


REFUSED: dict[str, tuple[Change, tuple[str, ...]]] = {
    "no such volume": (put("material", 1, groups=["foots"]), ('"foots" is no group', '"beam"', 'did you mean "foot"?')),
    "no such surface": (put("boundary", 0, group="bas"), ('boundary "base".group = "bas"', 'did you mean "base"?')),
    "boundary on a volume": (put("boundary", 0, group="foot"), ('"foot" is a volume group, not a surface group',)),
    "material on a surface": (put("material", 1, groups=["base"]), ('"base" is a surface group, not a volume group',)),
    "cells without material": (put("material", 1, groups=["beam"]), ('cells of "beam" are of material "metal" too',)),
    "bare cells": (drop("material", 1), ('have no material (in "foot"): give',)),
    "probe outside": (put("probe", 0, at=[1, 1, 1]), ('probe "tip" lies outside the solid',)),
    "flow through a volume": (put("probe", 3, group="beam"), ('"beam" is a volume group, not a surface group',)),
    "potential in an insulator": (
        put("probe", 1, quantity="potential", group="foot"),
        ('probe "mean" asks for the potential where nothing conducts',),
    ),
    "electrode on an insulator": (put("boundary", 2, group="base"), ('"plus".voltage touches nothing that conducts',)),
    "no voltage": (
        lambda d: (d["boundary"].pop(3), d["boundary"].pop(2)),
        ('probe "current" asks for a current in a conductor that no electrode touches',),
    ),
    "no exit": (
        lambda d: (d["boundary"].pop(1), d["boundary"].pop(0), d["probe"].pop(3)),
        ("without an exit for heat",),
    ),
    "two places": (put("probe", 0, group="beam"), ('probe "tip" has at and group',)),
    "no place": (lambda d: d["probe"][0].pop("at"), ('probe "tip" has no place',)),
    "flow at a point": (put("probe", 0, quantity="heat_flow"), ('quantity = "heat_flow" needs a surface',)),
    "boxes on a mesh": (lambda d: d.update(box=[]), ("unknown key box = []: a scene on a mesh takes",)),
    "no file": (lambda d: d["mesh"].pop("file"), ("mesh.file is missing",)),
    "no unit": (lambda d: d["mesh"].update(unit="kg"), ('mesh.unit = "kg" is not a unit of length',)),
    "no such file": (lambda d: d["mesh"].update(file="chop.msh"), ('chop.msh" is no file',)),
    "source on a surface": (
        lambda d: d.update(source=[{"group": "base", "heat_source": 1}]),
        ('"base" is a surface group, not a volume group',),
    ),
    "potential at a place in an insulator": (
        put("probe", 0, quantity="potential", at=[1e-6, 2e-6, 1e-6]),
        ('probe "tip" asks for the potential where nothing conducts: give a place in a conductor',),
    ),
    "half of a boundary": (put("probe", 3, group="half"), ('probe "to base" covers boundary "base" in part',)),
    "a boundary and a face inside": (
        put("probe", 3, group="both"),
        ('probe "to base" lies partly inside the solid', 'partly on boundary "base"'),
    ),
}


def read_and_check(document: dict[str, Any], folder: Path) -> None:
    scene = from_dict(document, folder=str(folder))
    check(scene, read(scene.path, scene.unit))


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_fit_is_refused_in_one_sentence(name, tmp_path):
    change, said = REFUSED[name]
    mesh = boxes.grouped(from_dict(bridge()), "hexahedron", 1)
    middles = mesh.points[mesh.cells[mesh.volumes["foot"]][:, boxes.FACETS["hexahedron"]]].mean(axis=2)
    joint = mesh.cells[mesh.volumes["foot"]][:, boxes.FACETS["hexahedron"]][middles[..., 2] == 2e-6]
    base = mesh.surfaces["base"]
    mesh.surfaces |= {"joint": joint, "half": base[:1], "both": np.concatenate([base, joint])}
    boxes.write(mesh, tmp_path / "chip.msh")
    document = boxes.document(bridge(), "chip.msh")
    read_and_check(document, tmp_path)
    change(document)
    with pytest.raises(SceneError) as caught:
        read_and_check(document, tmp_path)
    message = str(caught.value)
    assert "\n" not in message
    for words in said:
        assert words in message


FILES: dict[str, tuple[Callable[[Any], list[Any]], str]] = {
    "no volumes": (lambda cells: [b for b in cells if b.type == "quad"], "has no volume cells, only quad"),
    "mixed": (lambda cells: [cells[0], ("tetra", cells[0].data[:1, :4])], "is made of hexahedron and tetra cells"),
    "wedges": (lambda cells: [("wedge", cells[0].data[:1, :6])], "is made of wedge cells"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_that_cannot_be_solved_on_is_refused(name, tmp_path):
    choose, said = FILES[name]
    found = boxes.as_meshio(boxes.grouped(from_dict(bar()), "hexahedron", 1))
    meshio.Mesh(found.points, choose(found.cells)).write(tmp_path / "m.vtu")
    with pytest.raises(SceneError, match=said):
        read(tmp_path / "m.vtu", 1.0)


@pytest.mark.parametrize("suffix", [".msh", ".bdf", ".xyz", ".vtu"])
def test_what_is_no_mesh_is_refused(suffix, tmp_path, capsys):
    (tmp_path / f"m{suffix}").write_text("nothing of the kind\n", encoding="utf-8")
    with pytest.raises(SceneError, match="cannot be read"):
        read(tmp_path / f"m{suffix}", 1.0)
    assert capsys.readouterr() == ("", "")


def test_parts_that_only_lie_side_by_side_are_told(tmp_path):
    scene = from_dict(bridge())
    mesh = boxes.grouped(scene, "hexahedron", 1)
    boxes.write(mesh, tmp_path / "m.msh")
    assert Placed(scene, read(tmp_path / "m.msh", 1.0)).separation == ""
    touching = take_off_the_foot(mesh)
    boxes.write(mesh, tmp_path / "m.msh")
    said = f"the mesh has 2 parts that share no faces and {touching} corners that lie where"
    assert Placed(scene, read(tmp_path / "m.msh", 1.0)).separation.startswith(said)


def take_off_the_foot(mesh: boxes.Built) -> int:
    """Give the foot its own corners, and return how many it shared with the beam; its faces are in no group
    any more."""
    foot = mesh.volumes["foot"]
    twins, others = np.unique(mesh.cells[foot]), np.unique(mesh.cells[mesh.volumes["beam"]])
    mesh.cells[foot] = len(mesh.points) + np.searchsorted(twins, mesh.cells[foot])
    mesh.points = np.concatenate([mesh.points, mesh.points[twins]])
    mesh.surfaces = {name: rows for name, rows in mesh.surfaces.items() if np.isin(rows, others).all()}
    return int(np.isin(twins, others).sum())


def test_a_part_that_nothing_acts_on_is_refused(tmp_path):
    mesh = boxes.grouped(from_dict(bridge()), "hexahedron", 1)
    document = boxes.document(bridge(), "chip.msh")
    for table in ("boundary", "probe"):
        document[table] = [item for item in document[table] if item["name"] not in ("base", "to base")]
    boxes.write(mesh, tmp_path / "chip.msh")
    read_and_check(document, tmp_path)
    take_off_the_foot(mesh)
    boxes.write(mesh, tmp_path / "chip.msh")
    with pytest.raises(SceneError, match='acts on "foot"'):
        read_and_check(document, tmp_path)


def test_cells_in_no_group_are_refused(tmp_path):
    document = boxes.document(bridge(), "chip.msh")
    boxes.write(boxes.grouped(from_dict(bridge()), "hexahedron", 1), tmp_path / "chip.msh")
    found = read(tmp_path / "chip.msh", 1.0)
    scene = from_dict(document | {"material": document["material"][:1]}, folder=str(tmp_path))
    with pytest.raises(SceneError, match="have no material, which are in no group: give"):
        check(scene, replace(found, volumes={name: cells for name, cells in found.volumes.items() if name != "foot"}))


def broken(path: Path, cell: str, change: Callable[[Any], None]) -> str:
    """Return the refusal of the mesh of a bridge, changed, in Gmsh's older format."""
    boxes.write(boxes.grouped(from_dict(bridge()), cell, 1), path, 1e-6)
    mesh = meshio.read(path)
    change(mesh)
    meshio.write(path, mesh, file_format="gmsh22", binary=False)
    with pytest.raises(SceneError) as refused:
        read(path, 1e-6)
    return str(refused.value)


@pytest.mark.parametrize("cell", CELLS)
def test_what_is_no_mesh_is_refused_in_a_sentence(cell, tmp_path):
    path = tmp_path / "mesh.msh"

    def repeat(mesh: Any) -> None:
        volume = next(block for block in mesh.cells if block.dim == 3)
        volume.data[0, 1] = volume.data[0, 0]

    for value in (np.nan, np.inf):
        said = broken(path, cell, lambda mesh, value=value: mesh.points.__setitem__((3, 1), value))
        assert "or without finite coordinates" in said
    for at in (2, slice(None)):
        said = broken(path, cell, lambda mesh, at=at: mesh.points.__setitem__((slice(None), at), 1.0))
        assert "inverted or flat cells" in said
    assert "with a node twice" in broken(path, cell, repeat)

    def collapse(mesh: Any) -> None:
        cells = next(block.data for block in mesh.cells if block.dim == 3)
        mesh.points[cells[0, 1]] = mesh.points[cells[0, 0]]

    assert "inverted or flat cells" in broken(path, cell, collapse)
