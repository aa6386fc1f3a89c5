"""Mesh files: there and back, and what is refused."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from meshes import grading, symmetry, unstructured
from meshes.bricks import VOID
from scenes.sink import OXIDE, SILICON, Sink

MESH = grading.first_mesh(symmetry.reduce(Sink().scene()).scene, 1e-2).with_degrees(-9, -9, -9)


def materials(mesh):
    names = np.array(["", *(b.material.name for b in mesh.boxes)])
    return names[np.where(mesh.owner == VOID, 0, mesh.owner + 1)]


@pytest.mark.parametrize("suffix", [".vtu", ".msh", ".vtk"])
def test_a_mesh_comes_back_from_its_file(tmp_path, suffix):
    path = tmp_path / f"sink{suffix}"
    temperature = np.arange(MESH.solid.size, dtype=float)
    unstructured.write(MESH, path, {"temperature": temperature})
    found = unstructured.read(path, [SILICON, OXIDE], degree=3)
    for ours, theirs in zip(found.axes, MESH.axes, strict=True):
        assert np.abs(ours.breaks - theirs.breaks).max() < 1e-15
        assert (ours.degrees == 3).all()
    assert (materials(found) == materials(MESH)).all()
    data = meshio.read(path).point_data["temperature"]
    assert sorted(data.tolist()) == temperature[MESH.solid].tolist()


def test_a_cell_of_degree_p_becomes_p_cubed_hexahedra():
    points, hexes, boxes, nodes = unstructured.hexahedra(MESH.with_degrees(1, 1, 1))
    assert len(hexes) == 8 * (MESH.owner != VOID).sum() == len(boxes)
    assert len(points) == len(nodes) == len(np.unique(hexes))


def written(tmp_path, points, cells):
    path = tmp_path / "bad.vtu"
    meshio.Mesh(points, cells).write(path)
    return path


def test_other_cells_and_none_are_refused(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    with pytest.raises(ValueError, match="hexahedra only"):
        unstructured.read(written(tmp_path, points, [("tetra", np.array([[0, 1, 2, 3]]))]), [SILICON])


def test_cells_without_a_material_are_refused_where_there_are_several(tmp_path):
    cube = np.array(unstructured.CORNERS, dtype=float)
    path = written(tmp_path, cube, [("hexahedron", np.arange(8)[None])])
    assert unstructured.read(path, [OXIDE]).boxes[0].material == OXIDE
    with pytest.raises(ValueError, match="no data named material"):
        unstructured.read(path, [SILICON, OXIDE])


@pytest.mark.parametrize("unit", [1.0, 1e-6])
@pytest.mark.parametrize("kind", ["sheared", "overlapping"])
def test_hexahedra_that_are_not_bricks_of_one_grid_are_refused(tmp_path, unit, kind):
    cube = np.array(unstructured.CORNERS, dtype=float)
    if kind == "sheared":
        points, cells = cube.copy(), np.arange(8)[None]
        points[1] += [0.3, 0.0, 0.0]
        points[6] += [0.0, 0.2, 0.0]
    else:
        points, cells = np.concatenate([cube, cube + np.array([0.5, 0, 0])]), np.arange(16).reshape(2, 8)
    path = written(tmp_path, unit * points, [("hexahedron", cells)])
    with pytest.raises(ValueError, match="bricks of one grid"):
        unstructured.read(path, [SILICON])


def test_a_twin_of_another_material_is_seen(tmp_path):
    boxes = tuple(replace(b, material=OXIDE) if b.name == "pad-0" else b for b in MESH.boxes)
    assert (materials(replace(MESH, boxes=boxes)) != materials(MESH)).any()
