"""Groups come back from the files that mesh generators write, and every refusal names what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from meshes.grouped import shapes
from meshes.grouped.check import check, remarks
from meshes.grouped.read import read
from meshes.grouped.refine import quadratic, refine
from scenes.errors import SceneError
from scenes.free import as_dict, from_dict, load
from scenes.meshed.model import MeshScene
from scenes.model import Scene
from tests.meshes.grouped import boxes
from tests.meshes.grouped.scenes import bar, bridge

CELLS = tuple(boxes.BLOCKS)


def scene_of(document: dict[str, Any]) -> Scene:
    found = from_dict(document)
    assert isinstance(found, Scene)
    return found


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("suffix", [".msh", ".bdf"])
def test_groups_come_back(cell: str, suffix: str, tmp_path: Path) -> None:
    if suffix == ".bdf" and cell == "hexahedron27":
        pytest.skip("Nastran has no hexahedron of 27 nodes")
    mesh = boxes.grouped(scene_of(bridge()), cell, 1)
    path = tmp_path / f"mesh{suffix}"
    boxes.write(mesh, path, 1e-6)
    found = read(path, 1e-6)
    assert (found.kind, found.order, len(found.cells)) == (mesh.kind, mesh.order, len(mesh.cells))
    names = {name: name for name in (*mesh.volumes, *mesh.surfaces)}
    if suffix == ".bdf":
        names = {name: str(number) for number, name in enumerate(names, 1)}
    at = shapes.nodes(mesh.kind, 1).mean(axis=0)[None]
    for name, cells in mesh.volumes.items():
        own = found.cells[found.volumes[names[name]]]
        volume = shapes.jacobians(found.kind, found.order, found.points[own], at).sum()
        assert volume == pytest.approx(
            shapes.jacobians(mesh.kind, mesh.order, mesh.points[mesh.cells[cells]], at).sum()
        )
    for name, faces in mesh.surfaces.items():
        assert len(found.surfaces[names[name]]) == len(faces)


@pytest.mark.parametrize("cell", CELLS)
def test_refinement_keeps_a_curved_shape_and_its_groups(cell: str) -> None:
    def bend(x: np.ndarray) -> np.ndarray:
        return x + 2e-6 * np.sin(x[:, [1, 2, 0]] / 1e-5)

    mesh = boxes.grouped(scene_of(bridge()), cell, 1, bend)
    fine = refine(mesh)
    fully = quadratic(mesh)
    assert len(fine.cells) == 8 * len(mesh.cells)
    x = shapes.nodes(mesh.kind, 1).mean(axis=0)[None]
    assert shapes.jacobians(fine.kind, fine.order, fine.points[fine.cells], x).min() > 0
    if mesh.order == 2:
        # The nodes of the curved cells are nodes of the finer ones.
        used = fully.points[np.unique(fully.cells)]
        assert np.abs(fine.points[:, None] - used[None]).max(axis=2).min(axis=0).max() < 1e-18
    for name, faces in fine.surfaces.items():
        assert len(faces) == 4 * len(mesh.surfaces[name])
        assert len(np.unique(fine.number(faces))) == len(faces)
        assert fine.exposed(faces).all() == mesh.exposed(mesh.surfaces[name]).all()


def test_the_scene_reads_back() -> None:
    document = boxes.document(bridge(), "chip.msh", 1e-6)
    scene = from_dict(document)
    assert isinstance(scene, MeshScene)
    assert from_dict(as_dict(scene)) == scene


TAIL = "thermal_conductivity=1\n[run]\nsteady=true\n"


def test_a_mesh_lies_beside_its_scene(tmp_path: Path) -> None:
    (tmp_path / "chip.toml").write_text('[mesh]\nfile="a.msh"\nunit="um"\n[[material]]\nname="a"\n' + TAIL)
    scene = load(tmp_path / "chip.toml", ["mesh.unit=mm"])
    assert isinstance(scene, MeshScene)
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
    "bare cells": (drop("material", 1), ("have no material", '"foot"')),
    "probe outside": (put("probe", 0, at=[1, 1, 1]), ('probe "tip" lies outside the solid',)),
    "flow through a volume": (put("probe", 3, group="beam"), ('"beam" is a volume group, not a surface group',)),
    "potential in an insulator": (
        put("probe", 1, quantity="potential", group="foot"),
        ('probe "mean" asks for a potential where nothing conducts',),
    ),
    "current on an insulator": (put("probe", 2, group="base"), ('probe "current" asks for a current where nothing',)),
    "electrode on an insulator": (put("boundary", 2, group="base"), ('"plus".voltage touches nothing that conducts',)),
    "electrodes that touch": (put("boundary", 3, group="plus"), ("touch on a conductor with different voltages",)),
    "no voltage": (
        lambda d: (d["boundary"].pop(3), d["boundary"].pop(2)),
        ("conducts, but no boundary fixes a voltage",),
    ),
    "no exit": (
        lambda d: (d["boundary"].pop(1), d["boundary"].pop(0), d["probe"].pop(3)),
        ("has no exit for heat",),
    ),
    "at rest": (put("boundary", 2, voltage=0), ("nothing happens in this scene",)),
    "two places": (put("probe", 0, group="beam"), ('probe "tip" has at and group',)),
    "no place": (lambda d: d["probe"][0].pop("at"), ('probe "tip" has no place',)),
    "flow at a point": (put("probe", 0, quantity="heat_flow"), ('quantity = "heat_flow" needs a surface',)),
    "boxes on a mesh": (lambda d: d.update(box=[]), ("unknown table box: a scene on a mesh takes",)),
    "no file": (lambda d: d["mesh"].pop("file"), ("mesh.file is missing",)),
    "no unit": (lambda d: d["mesh"].update(unit="kg"), ('mesh.unit = "kg" is not a unit of length',)),
    "no such file": (lambda d: d["mesh"].update(file="chop.msh"), ('chop.msh" is no file',)),
    "temperature over another": (
        lambda d: d["boundary"].append({"name": "again", "group": "base", "temperature": 400}),
        ("overlap with different temperatures",),
    ),
    "flux on a fixed face": (
        lambda d: d["boundary"].append({"name": "flux", "group": "base", "heat_flux": 4}),
        ('"flux".heat_flux lies where other boundaries fix the temperature',),
    ),
}


def read_and_check(document: dict[str, Any], folder: Path) -> None:
    scene = from_dict(document, folder=str(folder))
    assert isinstance(scene, MeshScene)
    check(scene, read(scene.path, scene.unit))


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_fit_is_refused_in_one_sentence(name: str, tmp_path: Path) -> None:
    change, said = REFUSED[name]
    boxes.write(boxes.grouped(scene_of(bridge()), "hexahedron", 1), tmp_path / "chip.msh")
    document = boxes.document(bridge(), "chip.msh")
    read_and_check(document, tmp_path)
    change(document)
    with pytest.raises(SceneError) as caught:
        read_and_check(document, tmp_path)
    message = str(caught.value)
    assert "\n" not in message
    for words in said:
        assert words in message


def hexes() -> meshio.Mesh:
    return boxes.as_meshio(boxes.grouped(scene_of(bar()), "hexahedron", 1))


def upside_down() -> meshio.Mesh:
    found = hexes()
    cells = [(b.type, b.data[:, [4, 5, 6, 7, 0, 1, 2, 3]] if b.type == "hexahedron" else b.data) for b in found.cells]
    return meshio.Mesh(found.points, cells, cell_data=found.cell_data, field_data=found.field_data)


def surface_only() -> meshio.Mesh:
    found = hexes()
    return meshio.Mesh(found.points, [b for b in found.cells if b.type == "quad"])


def mixed() -> meshio.Mesh:
    found = hexes()
    return meshio.Mesh(found.points, [found.cells[0], ("tetra", found.cells[0].data[:1, :4])])


def wedges() -> meshio.Mesh:
    found = hexes()
    return meshio.Mesh(found.points, [("wedge", found.cells[0].data[:1, :6])])


FILES: dict[str, tuple[Callable[[], meshio.Mesh], str]] = {
    "inverted": (upside_down, "inverted or flat cells"),
    "no volumes": (surface_only, "has no volume cells, but quad"),
    "mixed": (mixed, "mixes hexahedron and tetra cells"),
    "wedges": (wedges, "is made of wedge cells"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_that_cannot_be_solved_on_is_refused(name: str, tmp_path: Path) -> None:
    make, said = FILES[name]
    make().write(tmp_path / "m.vtu")
    with pytest.raises(SceneError, match=said):
        read(tmp_path / "m.vtu", 1.0)


@pytest.mark.parametrize("suffix", [".msh", ".bdf", ".xyz", ".vtu"])
def test_what_is_no_mesh_is_refused(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / f"m{suffix}").write_text("nothing of the kind\n")
    with pytest.raises(SceneError, match="cannot be read"):
        read(tmp_path / f"m{suffix}", 1.0)
    assert capsys.readouterr() == ("", "")


def test_parts_that_only_lie_side_by_side_are_told() -> None:
    mesh = boxes.grouped(scene_of(bridge()), "hexahedron", 1)
    assert remarks(mesh) == []
    foot = mesh.volumes["foot"]
    twins = np.unique(mesh.corners[foot])
    cells = mesh.cells.copy()
    moved = np.full(len(mesh.points), -1)
    moved[twins] = len(mesh.points) + np.arange(len(twins))
    cells[foot] = moved[cells[foot]]
    apart = type(mesh)(np.concatenate([mesh.points, mesh.points[twins]]), cells, mesh.kind, 1, mesh.volumes, {})
    touching = int(np.isin(twins, np.unique(mesh.corners[mesh.volumes["beam"]])).sum())
    assert remarks(apart)[0].startswith(f"{touching} corners of the mesh")
