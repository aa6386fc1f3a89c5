"""How steady probes follow the numbers of scenes whose properties and faces follow the temperature, against differences
of solutions on the same cells, moved, and against closed forms."""

from __future__ import annotations

import math
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs import scene_sensitivity
from fem3d.runs.scene_sensitivity import Slopes
from scenes.faces import SIGMA
from scenes.free import from_dict
from scenes.model import Scene
from scenes.result import Result
from scenes.varied import numbers
from tests.fem3d.test_scene_sensitivity import on_moved_mesh
from tests.meshes.grouped import boxes

A, B = [0, 0, 0], [6e-6, 8e-6, 2e-6]
# A heated strip on oxide: each property by a law, a table or numbers along the axes, faces that radiate and a film by a
# law, probes of every kind.
STRIP: dict[str, Any] = {
    "scene": {"name": "strip", "initial_temperature": 290.0},
    "run": {"steady": True, "accuracy": 0.1},
    "material": [
        {"name": "metal", "thermal_conductivity": {"value": 130.0, "at": 293.0, "exponent": -1.3},
         "resistivity": [{"value": value, "at": 300.0, "exponent": 0.8} for value in (1e-5, 2e-5, 1e-5)]},
        {"name": "wire", "thermal_conductivity": 80.0, "resistivity": [2e-5, 1e-5, 4e-5],
         "temperature_coefficient": 1e-3},
        {"name": "oxide", "thermal_conductivity": [2.0, 1.5, {"value": 2.0, "at": 300.0, "exponent": 0.7}]},
    ],
    "box": [
        {"name": "oxide", "material": "oxide", "lower": A, "upper": [6e-6, 8e-6, 1e-6]},
        {"name": "strip", "material": "metal", "lower": [0, 0, 1e-6], "upper": [6e-6, 5e-6, 2e-6]},
        {"name": "lead", "material": "wire", "lower": [0, 5e-6, 1e-6], "upper": B},
    ],
    "boundary": [
        {"name": "bottom", "lower": A, "upper": [6e-6, 8e-6, 0], "temperature": 300.0},
        {"name": "top", "lower": [0, 0, 2e-6], "upper": B, "radiation": {"emissivity": 0.8, "ambient": 310.0}},
        {"name": "side", "lower": A, "upper": [0, 8e-6, 2e-6],
         "convection": {"coefficient": {"value": 1e5, "at": 300.0, "exponent": 0.5}, "ambient": 305.0}},
        {"name": "in", "lower": [0, 0, 1e-6], "upper": [6e-6, 0, 2e-6], "voltage": 0.6},
        {"name": "out", "lower": [0, 8e-6, 1e-6], "upper": B, "voltage": 0.0},
    ],
    "probe": [
        {"name": "mean", "lower": A, "upper": B},
        {"name": "hot", "lower": A, "upper": B, "reduce": "max"},
        {"name": "inner", "quantity": "heat_flow", "lower": [0, 0, 0.5e-6], "upper": [6e-6, 8e-6, 0.5e-6]},
        {"name": "radiated", "quantity": "heat_flow", "lower": [0, 0, 2e-6], "upper": B},
        {"name": "film", "quantity": "heat_flow", "lower": A, "upper": [0, 8e-6, 2e-6]},
        {"name": "bottom", "quantity": "heat_flow", "lower": A, "upper": [6e-6, 8e-6, 0]},
        {"name": "through", "quantity": "current", "lower": [0, 3e-6, 1e-6], "upper": [6e-6, 3e-6, 2e-6]},
        {"name": "tap", "quantity": "potential", "at": [3e-6, 3e-6, 2e-6]},
    ],
}  # fmt: skip
PROPERTIES = (
    "material.metal.thermal_conductivity", "material.metal.thermal_conductivity.exponent",
    "material.metal.resistivity.exponent", "material.metal.resistivity[y]", "material.wire.resistivity[y]",
    "material.wire.temperature_coefficient",
    "material.oxide.thermal_conductivity[x]", "material.oxide.thermal_conductivity[z].exponent",
)  # fmt: skip
CONDITIONS = (
    "boundary.top.radiation.emissivity", "boundary.top.radiation.ambient",
    "boundary.side.convection.coefficient.exponent", "boundary.side.convection.ambient", "boundary.in.voltage",
)  # fmt: skip
PLACES = "boundary.bottom.temperature", "box.oxide.upper.z", "box.lead.lower.y"


@pytest.fixture(scope="module")
def strip() -> tuple[Scene, Result, Slopes]:
    scene = from_dict(deepcopy(STRIP))
    assert isinstance(scene, Scene)
    result = scene_run.solve(scene, None, True)
    return scene, result, scene_sensitivity.of_scene(scene, result)


@pytest.mark.long
@pytest.mark.parametrize("keys", [PROPERTIES, CONDITIONS, PLACES])
def test_derivatives_are_those_of_the_discrete_solution(
    strip: tuple[Scene, Result, Slopes], keys: tuple[str, ...]
) -> None:
    """The sum over keys, by one difference."""
    scene, result, slopes = strip
    expected = on_moved_mesh(scene, result, *keys)
    for name, value in slopes.values.items():
        each = [slopes.table[key][name].value for key in keys]
        # Central differences are off by their square, tops by the lattice that they are looked for on.
        assert sum(each) == pytest.approx(expected[name] / value.value, abs=1e-4, rel=1e-4), name
    # None of the keys is one that nothing follows.
    assert all(max(abs(s.value) for s in slopes.table[key].values()) > 2e-3 for key in keys)


def test_every_number_is_there(strip: tuple[Scene, Result, Slopes]) -> None:
    scene, _, slopes = strip
    assert set(slopes.table) == set(numbers(scene)) >= {*PROPERTIES, *CONDITIONS, *PLACES}
    assert not any(key.endswith((".at", ".conductivity")) for key in slopes.table)


def test_a_wire_that_radiates_alone() -> None:
    """All heat leaves by radiation: eps sigma A (T^4 - T_a^4) = P, so that d T / d ln eps = -(T^4 - T_a^4) / (4 T^3),
    and by the power of a source the same with the other sign."""
    side, ambient, source = 1e-3, 300.0, 1e8
    scene = from_dict({
        "scene": {"initial_temperature": ambient},
        "run": {"steady": True, "accuracy": 1e-3},
        "material": [{"name": "m", "thermal_conductivity": 1e6}],
        "box": [{"name": "b", "material": "m", "lower": A, "upper": [side] * 3, "heat_source": source}],
        "boundary": [{"name": "r", "lower": [0, 0, side], "upper": [side] * 3,
                      "radiation": {"emissivity": 0.5, "ambient": ambient}}],
        "probe": [{"name": "t", "at": [0, 0, side]}],
    })  # fmt: skip
    slopes = scene_sensitivity.of_scene(scene, scene_run.solve(scene, None, True))
    fourth = source * side / (0.5 * SIGMA)
    t = (fourth + ambient**4) ** 0.25
    exact = fourth / (4 * t**3)
    for key, sign in (("boundary.r.radiation.emissivity", -1), ("box.b.heat_source", 1)):
        slope = slopes.table[key]["t"]
        # The conductivity leaves q L / k = 1e-3 of the rise inside.
        assert slope.value * slopes.values["t"].value == pytest.approx(sign * exact, rel=1e-5)
        assert slope.error < 1e-2
    # Held for a film of the coefficient there, the rise would follow the whole of it.
    assert exact < 0.5 * (t - ambient)


def test_a_table_and_a_film_on_a_mesh_file(tmp_path: Path) -> None:
    """A bar of tetrahedra between a cold end and a film: what both carry, theta(T_end) / L and h (T_a - T_end), is one,
    and differentiated by the law as a whole and by the coefficient gives the slopes."""
    document = {
        "scene": {"initial_temperature": 300.0},
        "run": {"steady": True, "accuracy": 1e-2},
        "material": [{"name": "m", "thermal_conductivity": {"temperatures": [300.0, 500.0], "values": [1.0, 2.0]}}],
        "box": [{"name": "bar", "material": "m", "lower": [0, 0, 0], "upper": [1e-4, 2e-5, 2e-5]}],
        "boundary": [
            {"name": "cold", "lower": [0, 0, 0], "upper": [0, 2e-5, 2e-5], "temperature": 300.0},
            {"name": "film", "lower": [1e-4, 0, 0], "upper": [1e-4, 2e-5, 2e-5],
             "convection": {"coefficient": {"value": 1e4, "at": 300.0, "exponent": 1.0}, "ambient": 500.0}},
        ],
        "probe": [{"name": "end", "lower": [1e-4, 0, 0], "upper": [1e-4, 2e-5, 2e-5]}],
    }  # fmt: skip
    whole = from_dict(deepcopy(document))
    assert isinstance(whole, Scene)
    boxes.write(boxes.grouped(whole, "tetra", 1), tmp_path / "m.msh", 1e-6)
    scene = from_dict(boxes.document(document, "m.msh", 1e-6), folder=str(tmp_path))
    result = scene_run.solve(scene, None, True)
    slopes = scene_sensitivity.of_scene(scene, result)
    rise = slopes.values["end"].value
    t = 300.0 + rise
    h = 1e4 * t / 300.0
    # G = theta(T) / L - h(T) (T_a - T) = 0, theta = u + u^2 / 400 with u the rise.
    conducted = (rise + rise**2 / 400) / 1e-4
    assert conducted == pytest.approx(h * (500.0 - t), rel=1e-2)
    steep = (1 + rise / 200) / 1e-4 + h - 1e4 / 300.0 * (500.0 - t)
    expected = {
        "material.m.thermal_conductivity": -conducted / steep,
        "boundary.film.convection.coefficient": conducted / steep,
        "boundary.film.convection.coefficient.exponent": conducted / steep * math.log(t / 300.0),
    }
    for key, change in expected.items():
        slope = slopes.table[key]["end"]
        assert abs(slope.value - change / rise) <= slope.error < 2e-2
        assert abs(change / rise) > 10 * slope.error
