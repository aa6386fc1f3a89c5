"""Contacts on tetrahedra and on mesh files: the exact cases and the same scenes as on bricks, with twins."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.walls import Layer, step_response
from fem3d.adaptivity.cell_mesh import mesh_of
from fem3d.runs.scene import solve
from fem3d.runs.sensitivities import of_scene
from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.free.tables import as_dict
from scenes.model import Contact, MeshScene, Probe, Scene
from scenes.result import Result
from tests.fem3d import gap
from tests.fem3d.test_contacts import CAPACITY, CASES, LENGTH, RESISTANCE, SIDE, _rim, exact, pair, with_law
from tests.meshes.grouped import boxes

CELLS = ("tetra", "tetra10", "hexahedron", "hexahedron27")


def on_file(scene: Scene, folder: Path, cell: str = "tetra", pieces: int = 1) -> MeshScene:
    """The scene on a Gmsh file, in um."""
    document = as_dict(scene)
    document["run"].pop("mesh", None)
    boxes.write(boxes.grouped(scene, cell, pieces), folder / "m.msh", 1e-6)
    return from_dict(boxes.document(document, "m.msh", 1e-6), folder=str(folder))


def holds(result: Result, resistances: tuple[float, float, float]) -> None:
    """The exact values of `pair` are within the errors, and with resistances one percent larger they are not."""
    expected, twin = exact(*resistances), exact(*(1.01 * r for r in resistances))
    for name, found in result.steady.items():
        assert abs(found.value - expected[name]) <= found.error + 1e-11 * abs(expected[name]), name
    rise = result.steady["end"]
    assert abs(rise.value - twin["end"]) > 10 * rise.error
    assert result.details["energy_imbalance"] < 1e-11


@pytest.mark.parametrize("resistances", CASES)
@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra"])
def test_fields_jump_at_contact(resistances, mesh):
    """Between its contacts a rise is a parabola, which is in the space; half of a contact's heat enters each face."""
    holds(solve(replace(pair(*resistances), mesh=mesh)), resistances)


@pytest.mark.parametrize("cell", [*CELLS[:3], pytest.param(CELLS[3], marks=pytest.mark.long)])
def test_fields_jump_at_contact_of_mesh_file(cell, tmp_path):
    holds(solve(on_file(pair(*CASES[0]), tmp_path, cell)), CASES[0])


@pytest.mark.parametrize(
    ("mesh", "accuracy", "detected"),
    [("bricks", 1e-4, 1.005), pytest.param("file", 3e-3, 1.05, marks=pytest.mark.long)],
)
def test_slab_with_contact_warms_like_its_layers(mesh, accuracy, detected, tmp_path):
    times = np.array([0.05, 0.2, 1.0, 4.0]) * LENGTH**2 * CAPACITY / 2.0
    run = {"end_time": float(times[-1]), "output_times": tuple(times.tolist()), "accuracy": accuracy, "steady": False}
    scene = pair(RESISTANCE, 0.0, **run)
    probes = tuple(p for p in scene.probes if p.name in ("temperature a", "temperature b", "end"))
    scene = replace(scene, boundaries=(replace(scene.boundaries[0], value=303.0),), probes=probes)
    traces = solve(on_file(scene, tmp_path) if mesh == "file" else scene).traces
    a, b = Layer(LENGTH, 2.0, CAPACITY), Layer(LENGTH, 5.0, CAPACITY)
    for worse in (1.0, detected):
        # The contact is a layer of no capacity to speak of, and as thin.
        thin = Layer(1e-9, 1e-9 / (worse * RESISTANCE), 1e-3)
        expected = step_response([a, thin, b], "temperature", 10.0, 0.0, times)
        for face, name in ((1, "temperature a"), (2, "temperature b"), (3, "end")):
            found = np.interp(times, traces.time, traces.values[name]) - 293.0
            gap = np.abs(found - expected[:, face]).max()
            assert gap <= traces.errors[name] if worse == 1.0 else gap > traces.errors[name], name
            assert traces.errors[name] < 20 * accuracy


def crossed(**more: Any) -> Scene:
    """`_rim`, with a contact beside the block too, and one for current, which a voltage drives from top to bottom: the
    plate, and the block behind both contacts, meet the block beside at one edge."""
    scene = _rim(RESISTANCE)
    silicon = replace(scene.boxes[0].material, resistivity=1e-5, temperature_coefficient=1e-3)
    cold, top = scene.boundaries
    electrodes = (
        replace(top, name="plus", kind="voltage", value=0.05),
        replace(cold, name="minus", kind="voltage", value=0.0),
    )  # fmt: skip
    contacts = (
        Contact("c", ("plate", "block"), RESISTANCE, 3e-9), Contact("d", ("block", "beside"), 2 * RESISTANCE, 0.0),
    )  # fmt: skip
    volts = [
        Probe(f"volts {box}", (0.0, 0.0, LENGTH), (0.0, 0.0, LENGTH), "potential", boxes=(box,))
        for box in ("plate", "block")
    ]
    probes = (*scene.probes, *volts, Probe("current", (0.0, 0.0, LENGTH), (LENGTH, SIDE, LENGTH), "current"))
    parts = tuple(replace(b, material=silicon) for b in scene.boxes)
    return replace(
        scene, boxes=parts, boundaries=(cold, *electrodes), contacts=contacts, probes=probes, accuracy=1e-2, **more
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("exponent", [0.0, -1.0])
def test_values_agree_with_bricks(exponent, tmp_path):
    scene = with_law(crossed(), "thermal_conductivity", exponent) if exponent else crossed()
    bricks = solve(replace(scene, mesh="bricks", accuracy=1e-3))
    on_columns = solve(replace(scene, mesh="tetrahedra"))
    assert on_columns.details["mesh"]["cell_type"] == "tetra"
    assert on_columns.details["levels"] > 1
    assert gap(on_columns, bricks) < 1.0
    if exponent:
        return
    assert gap(solve(on_file(scene, tmp_path)), bricks) < 1.0
    # Contacts one tenth worse are detected.
    worse = tuple(replace(c, thermal_resistance=1.1 * c.thermal_resistance) for c in scene.contacts)
    assert gap(solve(replace(scene, mesh="tetrahedra", contacts=worse)), bricks) > 1.0


@pytest.mark.long
def test_sensitivities_agree_with_bricks():
    scene = crossed()
    scene = replace(scene, probes=tuple(p for p in scene.probes if p.quantity not in ("heat_flow", "current")))
    keys = [f"contact.{c.name}.thermal_resistance" for c in scene.contacts] + ["contact.c.electrical_resistance"]
    on_bricks, on_columns = (
        of_scene(each, solve(each, whole=True), keys)
        for each in (replace(scene, mesh=mesh) for mesh in ("bricks", "tetrahedra"))
    )
    assert not on_columns.left_out
    for key in keys:
        for name, one in on_bricks.steady[key].items():
            other = on_columns.steady[key][name]
            assert abs(one.value - other.value) <= one.error + other.error, (key, name)
    # The two thermal contacts are distinct.
    one, other = (on_columns.steady[key]["above"] for key in keys[:2])
    assert abs(one.value - other.value) > one.error + other.error


@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra", "file"])
def test_fields_show_the_jump(mesh, tmp_path):
    scene, expected = pair(5e-4, 3e-8, accuracy=5e-2), exact(5e-4, 3e-8, 0.0)
    given = on_file(scene, tmp_path, "hexahedron") if mesh == "file" else replace(scene, mesh=mesh)
    fields = solve(given).details["fields"]
    on = np.isclose(fields.points[:, 0], LENGTH, rtol=1e-9)
    both = [expected["temperature a"], expected["temperature b"]]
    assert np.unique(fields.steady[on].round(6)) == pytest.approx(both)
    snapshot = fields.snapshot(None)
    on = np.isclose(fields.points[:, 0], LENGTH, rtol=1e-9)
    assert np.unique(snapshot.temperature[on].round(6)) == pytest.approx(both)
    assert np.unique(snapshot.potential[on].round(9)) == pytest.approx(
        [expected["potential b"], expected["potential a"]]
    )
    # The heat of a contact is none of the cells'.
    source = (exact(0.0, 3e-8, 0.0)["current"] / SIDE**2) ** 2 * 1e-5
    assert snapshot.heat_source.min() == pytest.approx(source, rel=1e-6)


REFUSED = {
    "unknown": ({"contact": {"between": ["a", "c"]}}, 'contact "c".between = "c" is no group of the mesh'),
    "surface": ({"contact": {"between": ["a", "cold"]}}, 'contact "c".between = "cold" is a surface group'),
    "itself": ({"contact": {"between": ["a", "a"]}}, 'between volume group "a" and volume group "a"'),
    "shared cells": ({"contact": {"between": ["a", "inside"]}}, "which have cells in common"),
    "apart": ({"contact": {"between": ["b", "inside"]}}, "which have no face in common"),
    "no side": ({"temperature a": {"side": None}}, 'say on which side by side = "a" or side = "b"'),
    "no side of a surface": ({"mean b": {"side": None}}, 'probe "mean b" lies on contact "c"'),
    "no such side": ({"temperature a": {"side": "z"}}, 'probe "temperature a".side = "z" is no group'),
    "elsewhere": ({"end": {"side": "a"}}, 'probe "end".side = "a" isn\'t everywhere at the probe'),
    "of a flow": ({"heat": {"side": "a"}}, 'probe "heat".side = "a" says nothing about a heat_flow'),
    "voltage on it": (
        {"minus": {"group": "mean b", "contact_resistance": None}}, 'boundary "minus".voltage lies on contact "c"'
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_bad_contacts_of_mesh_file_are_refused(case, tmp_path):
    changes, words = REFUSED[case]
    scene = pair(5e-4, 3e-8, 2e-8)
    inside = Probe("inside", (0.0, 0.0, 0.0), (LENGTH / 2, SIDE, SIDE))
    scene = replace(scene, probes=(*scene.probes, inside))
    document = as_dict(on_file(scene, tmp_path))
    for name, change in changes.items():
        items = [*document["boundary"], *document["probe"]]
        item = document["contact"][0] if name == "contact" else next(i for i in items if i["name"] == name)
        item |= change
        for key in [key for key, value in item.items() if value is None]:
            del item[key]
    with pytest.raises(SceneError) as refused:
        mesh_of(from_dict(document, folder=str(tmp_path)))
    assert words in str(refused.value)
