"""Scenes on meshes: exact solutions, the same scene as boxes, and twins that are a little wrong."""

import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d.adaptivity.cell_mesh import mesh_of
from fem3d.runs import scene as scene_run
from fem3d.runs.scene import solve
from scenes.errors import TooLargeError
from scenes.free import as_dict, from_dict
from scenes.model import MeshScene
from scenes.result import Result
from tests.fem3d import gap
from tests.meshes.grouped import boxes
from tests.meshes.grouped.scenes import bar, bridge

CELLS = tuple(boxes.BLOCKS)
_SOLVED: dict[str, Result] = {}


def on_mesh(
    document: dict[str, Any], cell: str, pieces: int, folder: Path, bend: boxes.Map | None = None
) -> Result:  # fmt: skip
    """The scene of boxes solved on its Gmsh file in um; once for all tests."""
    asked = repr((document, cell, pieces, bend))
    if asked not in _SOLVED:
        _SOLVED[asked] = solve(loaded(document, cell, pieces, folder, bend))
    return _SOLVED[asked]


def loaded(
    document: dict[str, Any], cell: str, pieces: int, folder: Path, bend: boxes.Map | None = None
) -> MeshScene:  # fmt: skip
    """The scene of boxes on its Gmsh file in um."""
    scene = from_dict(document)
    boxes.write(boxes.grouped(scene, cell, pieces, bend), folder / "m.msh", 1e-6)
    return from_dict(boxes.document(document, "m.msh", 1e-6), folder=str(folder))


@cache
def on_bricks(transient: bool) -> Result:
    scene = from_dict(bridge(**TRANSIENT) if transient else bridge(steady=True, accuracy=1e-4))
    return scene_run.solve(scene)


SOURCE, LENGTH = (0.4 / 1e-4) ** 2 / 1e-5, 1e-4  # W/m3, m
EXACT = {"middle": 325.0, "volt": 0.3, "current": 0.08, "half": 0.08, "out": -0.014, "hottest": 325.3125}
"""Readings of `bar`: T'' = -(V/L)^2 / (rho k). The sign of "half" depends on the mesh, whose normals go either way."""
TRANSIENT: dict[str, Any] = {"end_time": 2e-5, "output_times": [2e-6, 2e-5], "accuracy": 1e-2}


@pytest.mark.long
@pytest.mark.parametrize("cell", CELLS)
def test_bar_is_exact(cell, tmp_path):
    """A parabola is in the space of second degree, so that only rounding is left."""
    found = on_mesh(bar(), cell, 1, tmp_path).steady
    assert found["middle"].value == pytest.approx(EXACT["middle"], abs=1e-8)
    assert found["volt"].value == pytest.approx(EXACT["volt"], abs=1e-11)
    assert found["current"].value == pytest.approx(EXACT["current"], rel=1e-9)
    assert abs(found["half"].value) == pytest.approx(EXACT["half"], rel=1e-9)
    assert found["out"].value == pytest.approx(EXACT["out"], rel=1e-8)
    # Inside a cell, away from its nodes; the samples there miss less than 2 % of how far the parabola of a cell bulges.
    assert abs(found["hottest"].value - EXACT["hottest"]) <= 0.02 * SOURCE / 800 * (LENGTH / 2) ** 2


@pytest.mark.parametrize(("cell", "pieces"), [("tetra", 2), ("tetra10", 2), ("hexahedron", 2), ("hexahedron20", 2)])
def test_the_same_scene_as_boxes(cell, pieces, tmp_path):
    found = on_mesh(bridge(), cell, pieces, tmp_path)
    assert found.details["energy_imbalance"] < 1e-9
    assert set(found.steady) == set(on_bricks(False).steady)
    assert gap(found, on_bricks(False)) <= 1
    assert all(value.error > 0 for value in found.steady.values())


def test_a_wrong_conductivity_is_caught(tmp_path):
    """The errors are small enough to show 20 % in the foot's conductivity, through which all heat leaves."""
    document = bridge()
    document["material"][1]["thermal_conductivity"] *= 1.2
    assert gap(on_mesh(document, "hexahedron", 2, tmp_path), on_bricks(False), over={"tip": 1.0}) > 1


@pytest.mark.parametrize("cell", ["tetra", "hexahedron"])
def test_transient_of_the_same_scene_as_boxes(cell, tmp_path):
    found, boxed = on_mesh(bridge(**TRANSIENT), cell, 1, tmp_path), on_bricks(True)
    assert found.details["transient_imbalance"] < 1e-3
    assert gap(found, boxed, np.geomspace(2e-6, 2e-5, 9)) <= 1


@pytest.mark.long
@pytest.mark.parametrize("cell", ["tetra", "hexahedron"])
def test_a_drive_over_time_ends_in_its_steady_state(cell, tmp_path):
    """Of right-angled tetrahedra the stiffness lacks entries that the mass has, and both are factorized in one
    order."""
    document = bar(end_time=1e-3, accuracy=2e-2)
    document["probe"] = [probe for probe in document["probe"] if probe["name"] != "hottest"]
    document["boundary"][2]["voltage"] = {"times": [1e-4, 1e-4, 2e-4], "values": [0, 0.05, 0.4]}
    document["boundary"][1]["temperature"] = {"times": [0, 1e-4], "values": [300, 310]}
    found = on_mesh(document, cell, 1, tmp_path)
    for name, values in found.traces.values.items():
        last = abs(values[-1]) if name == "half" else values[-1]
        assert abs(last - EXACT[name]) <= found.traces.errors[name], name
    early = np.interp(5e-5, found.traces.time, found.traces.values["current"])
    assert abs(early) <= found.traces.errors["current"]


def test_warns_of_an_accuracy_that_memory_does_not_allow(tmp_path):
    document = bridge(steady=True, accuracy=1e-6)
    document["run"]["memory"] = "110 MB"
    found = on_mesh(document, "tetra", 1, tmp_path)
    assert "less accurate than the 1e-06 asked for" in found.details["warnings"][0]
    assert not on_mesh(bar(), "tetra", 1, tmp_path).details["warnings"]


def test_degree_2_answers_where_memory_has_no_room_for_degree_3(tmp_path):
    document = bar(steady=True, accuracy=2e-3)
    whole = on_mesh(document, "tetra", 2, tmp_path)
    cubic = mesh_of(loaded(document, "tetra", 2, tmp_path))
    document["run"]["memory"] = 0.95 * cubic.size.memory
    found = on_mesh(document, "tetra", 2, tmp_path)
    assert (whole.details["mesh"]["highest_degree"], found.details["mesh"]["highest_degree"]) == (3, 2)
    assert any("elements of degree 2" in warning for warning in found.details["warnings"])
    assert gap(found, whole) <= 1


def test_a_mesh_without_room_for_degree_2_is_refused(tmp_path):
    document = bar(steady=True, accuracy=2e-3)
    document["run"]["memory"] = 1e8
    with pytest.raises(TooLargeError, match=r"tetrahedra of m.msh take .* GB .* run.memory allows 0.1 GB; set run.mem"):
        on_mesh(document, "tetra", 6, tmp_path)


def test_curved_cells_are_taken_as_they_are(tmp_path):
    """A quarter of a tube: T is linear in the logarithm of the radius, the heat flow 2 pi k L dT / ln(b / a) / 4."""
    document = copy.deepcopy(bar(steady=True, accuracy=2e-3))
    for kind in ("plus", "minus"):
        document["boundary"] = [b for b in document["boundary"] if b["name"] != kind]
    document["material"][0].pop("resistivity")
    document["probe"] = [document["probe"][3]]
    # x is the radius from 1e-4 on, y of 1e-5 becomes the angle to pi / 2, z stays.

    def bend(x: np.ndarray) -> np.ndarray:
        radius, angle = 1e-4 + x[:, 0], x[:, 1] / 1e-5 * np.pi / 2
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), x[:, 2]], axis=1)

    exact = -2 * np.pi / 4 * 100 * 2e-5 * 10 / np.log(2)
    errors = {}
    for cell in ("hexahedron", "hexahedron20", "tetra10"):
        value = on_mesh(document, cell, 2, tmp_path, bend=bend).steady["out"]
        errors[cell] = abs(value.value + exact) / abs(exact)
    assert errors["hexahedron20"] < 1e-3
    assert errors["tetra10"] < 1e-3
    # Straight edges cut a percent off the circumference: this difference shows that bent edges are used.
    assert errors["hexahedron"] > 3 * errors["hexahedron20"]


def test_what_is_as_warm_as_all_around_it_is_known_at_once(tmp_path):
    """For a flow that is nothing but rounding no cell is halved; one from colder air is not taken for rounding."""
    document = bridge(steady=True, accuracy=1e-2)
    document["boundary"] = base, air = document["boundary"][:2]
    document["probe"] = [p for p in document["probe"] if p["name"] != "current"]
    base["temperature"] = air["convection"]["ambient"] = 310.0
    found = on_mesh(document, "tetra", 1, tmp_path)
    assert found.details["levels"] == 1
    assert abs(found.steady["to base"].value) < 1e-12
    assert not [warning for warning in found.details["warnings"] if "accurate" in warning]
    air["convection"]["ambient"] = 309.0
    flow = on_mesh(document, "tetra", 1, tmp_path).steady["to base"]
    assert flow.value > 50 * flow.error > 0


def jacobians(corners: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(cells, points): the determinants of the maps of hexahedra with corners (cells, 8, 3) in VTK's order."""
    factors = np.where(boxes.CORNERS == 1, x[:, None], 1 - x[:, None])  # (points, 8, 3)
    signs = 2 * boxes.CORNERS - 1
    slopes = [signs[:, d] * np.delete(factors, d, axis=2).prod(axis=2) for d in range(3)]
    return np.linalg.det(np.einsum("dpn,cne->cpde", slopes, corners))


@pytest.mark.parametrize("cell", ["tetra", "hexahedron"])
def test_pictures_are_made_of_cells_the_right_way_round_that_fill_the_solid(cell, tmp_path):
    fields = on_mesh(bar(steady=True, accuracy=5e-2), cell, 1, tmp_path).details["fields"]
    if cell == "tetra":
        a, b, c = (fields.points[fields.cells[:, k]] - fields.points[fields.cells[:, 0]] for k in (1, 2, 3))
        volumes = np.einsum("ij,ij->i", np.cross(a, b), c) / 6
    else:
        # Gauss's rule of two points a side is exact for the volume of a cell with straight edges.
        gauss = 0.5 + (boxes.CORNERS - 0.5) / np.sqrt(3)
        volumes = jacobians(fields.points[fields.cells[:, :8]], gauss) / 8
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(2e-14, rel=1e-9)
    assert EXACT["hottest"] - 2 < fields.steady.max() <= EXACT["hottest"] + 1e-9


def test_a_probe_without_a_place_reads_groups(tmp_path):
    scene = from_dict(bridge())
    boxes.write(boxes.grouped(scene, "tetra", 1), tmp_path / "m.msh", 1e-6)
    document = boxes.document(bridge(), "m.msh", 1e-6)
    groups = [group for material in document["material"] for group in material.get("groups", [material["name"]])]
    document["probe"] = [{"name": f"in {g}", "group": g, "reduce": "max"} for g in groups]
    document["probe"] += [
        {"name": "all", "reduce": "max"}, {"name": "two", "groups": groups[:2], "reduce": "max"},
        {"name": "material", "material": document["material"][0]["name"], "reduce": "max"},
    ]  # fmt: skip
    meshed = from_dict(document, folder=str(tmp_path))
    assert from_dict(as_dict(meshed), folder=str(tmp_path)) == meshed
    found = solve(meshed).steady
    largest = [found[f"in {g}"].value for g in groups]
    assert found["all"].value == pytest.approx(max(largest), rel=1e-9)
    assert found["two"].value == pytest.approx(max(largest[:2]), rel=1e-9)
    own = document["material"][0].get("groups", [document["material"][0]["name"]])
    assert found["material"].value == pytest.approx(max(found[f"in {g}"].value for g in own), rel=1e-9)
