"""Scenes of boxes on tetrahedra: chosen where a grid of bricks takes more, with values that agree within errors."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs import scene as runs
from meshes.columns import Columns
from meshes.grid import graph
from scenes.errors import NumericsError, SceneError
from scenes.free import from_dict
from scenes.free.rules import checked
from scenes.free.tables import as_dict
from scenes.model import Boundary, Probe, Scene
from scenes.result import Result
from tests.fem3d import gap
from tests.fem3d.test_size import UM, plate


def heated(pads: int = 3) -> Scene:
    """A plate with pads that a current crosses."""
    scene, side = plate(pads), (0.0, 200 * UM, 2 * UM)
    electrodes = (("plus", 0.0, 0.5), ("minus", 200 * UM, 0.0))
    ends = [Boundary(n, "voltage", (x, 0.0, 0.0), (x, *side[1:]), u) for n, x, u in electrodes]
    probes = (
        *scene.probes,
        Probe("current", (0.0, 0.0, 0.0), side, "current"),
        Probe("out", (200 * UM, 0.0, 0.0), (200 * UM, *side[1:]), "heat_flow"),
        Probe("top", (0.0, 0.0, 2 * UM), (200 * UM, 200 * UM, 2 * UM), "temperature", "max"),
    )
    return checked(replace(scene, boundaries=(*scene.boundaries, *ends), probes=probes))


@cache
def solved(mesh: str, pads: int = 3) -> Result:
    return runs.solve(replace(heated(pads), mesh=mesh), whole=True)


@pytest.mark.long
def test_values_agree_with_bricks():
    """A parabola of degree 2 hides how slowly the pads' part falls: believed as fast as both together, the middle was
    2.4 times as far off as its error said."""
    bricks, tetrahedra = solved("bricks", 2), solved("tetrahedra", 2)
    assert "cell_type" not in bricks.details["mesh"]
    assert tetrahedra.details["mesh"]["cell_type"] == "tetra"
    assert gap(bricks, tetrahedra) < 1.0


@pytest.mark.parametrize("seed", range(2))
def test_cells_fill_the_boxes(seed):
    """Each box its volume, the outside its area, and no cell is flat; refined too, in places."""
    scene = plate(12, seed)
    columns, draw = Columns.of(scene), np.random.default_rng(seed)
    for _ in range(2):
        mesh = columns.mesh
        corners = mesh.p[:, mesh.t]
        sides = corners[:, 1:] - corners[:, :1]
        volumes = np.abs(np.linalg.det(sides.transpose(2, 0, 1))) / 6
        grid = graph(scene)
        middle = corners.mean(axis=1)
        at = tuple(np.searchsorted(b, x) - 1 for b, x in zip(grid.planes, middle, strict=True))
        lengths = [np.diff(b) for b in grid.planes]
        bricks = lengths[0][:, None, None] * lengths[1][:, None] * lengths[2]
        for number in range(len(scene.boxes)):
            exact = bricks[grid.owner == number].sum()
            assert volumes[grid.owner[at] == number].sum() == pytest.approx(exact, rel=1e-9)
        assert volumes.min() > 0
        a, b, c = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]].transpose(1, 2, 0)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        solid = np.pad(grid.owner >= 0, 1)
        faces = 0.0
        for d in range(3):
            beside = np.diff(solid.astype(int), axis=d) != 0
            across = [lengths[e] for e in range(3) if e != d]
            inner = np.moveaxis(beside, d, 0)[:, 1:-1, 1:-1]
            faces += float((inner * np.multiply.outer(*across)).sum())
        assert area == pytest.approx(faces, rel=1e-9)
        cut, sharp = (draw.uniform(size=(3, n)) < 0.2 for n in (len(volumes), mesh.nvertices))
        columns = columns.refined(cut, sharp)


def test_plan_names_reason_for_tetrahedra():
    pads = 20
    scene = checked(plate(pads))
    result = runs.solve(scene)
    said = {step.step: step.reason for step in result.details["plan"]}
    assert "a grid of bricks would take" in said["mesh"]
    assert f"planes that all cross the whole scene, {2 * pads + 2} along x" in said["mesh"]
    assert result.details["unknowns"] < 30_000
    assert result.steady["middle"].error < 1e-2 * result.details["scales"]["middle"]
    # Without pads the middle is between both ends; a pad of 10 um on a plate of 200 um moves it by less than a tenth.
    assert result.steady["middle"].value == pytest.approx(296.5, abs=0.35)


def test_requested_kind_of_mesh_is_used():
    few, many = heated(), replace(checked(plate(10)), memory=1e9)
    assert runs.start(replace(few, mesh="tetrahedra"))[1].whole
    assert not runs.start(replace(few, mesh="bricks"))[1].whole
    assert runs.start(many)[1].whole
    found = as_dict(replace(few, mesh="tetrahedra"))
    assert found["run"]["mesh"] == "tetrahedra"
    assert from_dict(found).mesh == "tetrahedra"
    found["run"]["mesh"] = "wedges"
    with pytest.raises(SceneError, match=r'run\.mesh = "wedges".*bricks.*tetrahedra'):
        from_dict(found)


def test_tetrahedra_beyond_memory_are_refused():
    with pytest.raises(NumericsError, match=r"degree 2, .* run\.memory allows 0\.1 GB; set run\.memory"):
        runs.solve(replace(checked(plate(40)), mesh="tetrahedra", memory=1e8))


def test_unreached_accuracy_is_a_warning(monkeypatch):
    monkeypatch.setattr("fem3d.adaptivity.cell_mesh.MOST_UNKNOWNS", 1_000)
    result = runs.solve(replace(heated(), mesh="tetrahedra", accuracy=1e-5))
    assert any("less accurate than the 1e-05 asked for" in w for w in result.details["warnings"])
    assert not any("inf%" in w for w in result.details["warnings"])
    assert gap(solved("bricks"), result) < 1.0


@pytest.mark.long
def test_transient_values_agree_within_errors():
    times = (1e-4, 3e-4, 1e-3)
    scene = replace(heated(1), steady=False, end_time=1e-3, output_times=times)
    meshes = (checked(replace(scene, mesh=mesh)) for mesh in ("bricks", "tetrahedra"))
    assert gap(*(runs.solve(each, whole=True) for each in meshes), times) <= 1
