"""How the probes of free scenes follow their numbers, against differences of solutions on the same cells, moved."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d.adaptivity import nested
from fem3d.runs import probe_quantities, scene_sensitivity
from fem3d.runs import scene as scene_run
from fem3d.runs.scene_sensitivity import Slopes
from fem3d.sensitivity.motion import speeds
from fem3d.spaces.domain import boxes
from scenes.free import from_dict
from scenes.loading import load_free as load
from scenes.model import MeshScene, Scene
from scenes.result import Result
from scenes.varied import numbers, varied

DIFFERENCE = 1e-3
FILES = Path(__file__).parents[1] / "meshes" / "grouped" / "files"

# A heated strip on oxide on a gate at one voltage, with every kind of condition, source and probe.
LAYERS: dict[str, Any] = {
    "scene": {"name": "layers", "initial_temperature": 290.0},
    "run": {"steady": True, "accuracy": 1e-2},
    "material": [
        {"name": "metal", "thermal_conductivity": 50.0, "resistivity": 1e-5, "temperature_coefficient": 2e-3},
        {"name": "oxide", "thermal_conductivity": 2.0},
    ],
    "box": [
        {"name": "gate", "material": "metal", "lower": [0, 0, 0], "upper": [6e-6, 8e-6, 1e-6]},
        {"name": "oxide", "material": "oxide", "lower": [0, 0, 1e-6], "upper": [6e-6, 8e-6, 2e-6], "heat_source": 1e12},
        {"name": "strip", "material": "metal", "lower": [0, 0, 2e-6], "upper": [6e-6, 8e-6, 3e-6]},
    ],
    "boundary": [
        {"name": "bottom", "lower": [0, 0, 0], "upper": [6e-6, 8e-6, 0], "temperature": 300.0},
        {"name": "top", "lower": [0, 0, 3e-6], "upper": [6e-6, 8e-6, 3e-6],
         "convection": {"coefficient": 1e5, "ambient": 310.0}},
        {"name": "sun", "lower": [6e-6, 0, 1e-6], "upper": [6e-6, 8e-6, 2e-6], "heat_flux": 2e6},
        {"name": "in", "lower": [0, 0, 2e-6], "upper": [6e-6, 0, 3e-6], "voltage": 0.15},
        {"name": "out", "lower": [0, 8e-6, 2e-6], "upper": [6e-6, 8e-6, 3e-6], "voltage": 0.0},
        {"name": "gate", "lower": [0, 0, 0], "upper": [0, 8e-6, 1e-6], "voltage": 2.0},
    ],
    "probe": [
        {"name": "cold face", "lower": [0, 0, 0], "upper": [6e-6, 8e-6, 0]},
        {"name": "hot", "lower": [0, 0, 0], "upper": [6e-6, 8e-6, 3e-6], "reduce": "max"},
        {"name": "line", "lower": [3.3e-6, 0, 2.4e-6], "upper": [3.3e-6, 8e-6, 2.4e-6], "reduce": "max"},
        {"name": "cool", "lower": [0, 0, 2e-6], "upper": [6e-6, 8e-6, 2e-6], "reduce": "min"},
        {"name": "inner", "quantity": "heat_flow", "lower": [0, 0, 1e-6], "upper": [6e-6, 8e-6, 1e-6]},
        {"name": "to air", "quantity": "heat_flow", "lower": [0, 0, 3e-6], "upper": [6e-6, 4e-6, 3e-6]},
        {"name": "through", "quantity": "current", "lower": [0, 4e-6, 2e-6], "upper": [6e-6, 4e-6, 3e-6]},
        {"name": "tap", "quantity": "potential", "at": [3e-6, 3e-6, 3e-6]},
        {"name": "gate V", "quantity": "potential", "at": [3e-6, 3e-6, 0.5e-6]},
        {"name": "top V", "quantity": "potential", "lower": [0, 0, 2e-6], "upper": [6e-6, 4e-6, 3e-6], "reduce": "max"},
    ],
}  # fmt: skip
KEYS = (
    "material.metal.temperature_coefficient", "boundary.bottom.temperature", "boundary.top.convection.coefficient",
    "boundary.sun.heat_flux", "boundary.in.voltage", "boundary.gate.voltage", "box.oxide.upper.z", "box.gate.upper.y",
)  # fmt: skip


@pytest.fixture(scope="module")
def layers() -> tuple[Scene, Result, Slopes]:
    scene = from_dict(deepcopy(LAYERS))
    assert isinstance(scene, Scene)
    result = scene_run.solve(scene, None, True)
    return scene, result, scene_sensitivity.of_scene(scene, result)


def on_moved_mesh(scene: Scene, result: Result, *keys: str) -> dict[str, float]:
    """The sums of the derivatives by some keys, by central differences of solutions on the same cells, moved along."""
    state, values = result.details["solution"].state, []
    space = state.heat.domain.space
    for step in (DIFFERENCE, -DIFFERENCE):
        other = scene
        for key in keys:
            other = varied(other, key, 1 + step)
        part = scene_run.part_of(other, True)
        by = speeds(state.heat.domain, state.heat.domain.scene, part.scene, step)
        breaks = tuple(b + step * v for b, v in zip(space.grid.breaks, by, strict=True))
        there = boxes(part.scene, replace(space.grid, breaks=breaks, boxes=part.scene.boxes))
        study = replace(probe_quantities.study(other, part), accuracy=1e-7)
        found = nested.solution(study, nested.problems(there, 1e-7), 2).quantities
        floor = scene_sensitivity.floor_of(scene, other)
        values.append({p.name: found[p.name] - floor * (p.quantity == "temperature") for p in scene.probes})
    more, less = values
    return {n: float(v - less[n]) / (2 * DIFFERENCE) for n, v in more.items()}


@pytest.mark.long
@pytest.mark.parametrize("key", KEYS)
def test_derivatives_are_those_of_the_discrete_solution(layers: tuple[Scene, Result, Slopes], key: str) -> None:
    scene, result, slopes = layers
    expected = on_moved_mesh(scene, result, key)
    assert set(slopes.table[key]) == {p.name for p in scene.probes[1:]}
    for name, slope in slopes.table[key].items():
        # Central differences are off by their square, tops by the lattice that they are looked for on.
        assert slope.value == pytest.approx(expected[name] / slopes.values[name].value, abs=1e-4, rel=1e-4), name


def test_every_number_is_there(layers: tuple[Scene, Result, Slopes]) -> None:
    scene, _, slopes = layers
    assert set(slopes.table) == set(numbers(scene))
    assert "boundary.out.voltage" not in slopes.table  # it is 0
    # Six planes across z and y and x, each once.
    assert sorted(key for key in slopes.table if key.endswith((".x", ".y", ".z")))[0] == "box.gate.lower.x"
    assert sum(key.endswith((".x", ".y", ".z")) for key in slopes.table) == 8


def test_a_plane_takes_all_along_that_lies_in_it() -> None:
    scene = from_dict(deepcopy(LAYERS))
    other: Any = varied(scene, "box.oxide.upper.z", 1.1)
    assert [b.upper[2] for b in other.boxes] == pytest.approx([1e-6, 2.1e-6, 3e-6])
    assert other.boxes[2].lower[2] == pytest.approx(2.1e-6)
    assert {b.lower[2] for b in other.boundaries if b.name in ("in", "out")} == {other.boxes[2].lower[2]}


def test_a_scene_that_is_its_own_mirror_image() -> None:
    """The faces of either side are followed apart: together they make the size."""
    scene = load("bridge")
    assert isinstance(scene, Scene)
    table = scene_sensitivity.of_scene(scene, scene_run.solve(scene, None, True)).table
    assert table["box.beam.upper.x"]["current"].value == pytest.approx(1.0, abs=1e-6)
    assert table["box.beam.lower.x"]["current"].value == pytest.approx(-1.0, abs=1e-6)
    assert "boundary.right electrode.voltage" not in table
    assert table["boundary.left electrode.voltage"]["quarter"].value == pytest.approx(1.018, abs=1e-3)


def test_zero_has_no_percent(layers: tuple[Scene, Result, Slopes]) -> None:
    """The cold face is at what rises are above."""
    assert set(layers[2].left_out) == {'probe "cold face"'}


BAR: dict[str, Any] = {
    "scene": {"initial_temperature": 300.0},
    "run": {"end_time": 2e-3, "accuracy": 1e-2},
    "material": [{"name": "m", "thermal_conductivity": 1.0, "density": 1000.0, "specific_heat": 1000.0}],
    "box": [{"name": "bar", "material": "m", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 2e-5],
             "heat_source": 1e9}],
    "boundary": [{"name": "cold", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 0], "temperature": 300.0}],
    "probe": [{"name": "top", "lower": [0, 0, 2e-5], "upper": [1e-5, 1e-5, 2e-5]},
              {"name": "most", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 2e-5], "reduce": "max"}],
}  # fmt: skip


def by_these(monkeypatch: pytest.MonkeyPatch, *keys: str) -> None:
    """Derivatives by a few keys alone."""
    monkeypatch.setattr(scene_sensitivity, "numbers", lambda scene: {key: numbers(scene)[key] for key in keys})


def test_over_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A heated bar: by the source all goes in proportion; material and source times one factor leave the rise as it is;
    the diffusion time goes with the square of the length."""
    by_these(
        monkeypatch, "box.bar.heat_source", "material.m.thermal_conductivity", "material.m.density", "box.bar.upper.z"
    )
    scene = from_dict(deepcopy(BAR))
    assert isinstance(scene, Scene)
    result = scene_run.solve(scene, None, True)
    found = scene_sensitivity.of_scene(scene, result)
    assert found.times is not None
    assert result.traces is not None
    course = found.course
    own = np.interp(found.times, result.traces.time, result.traces.values["top"]) - 300.0
    size = own.max()
    # Traces are known to 1e-2.
    assert course["box.bar.heat_source"]["top"] == pytest.approx(own, abs=5e-3 * size)
    together = sum(course[key]["top"] for key in ("box.bar.heat_source", "material.m.thermal_conductivity",
                                                  "material.m.density"))  # fmt: skip
    assert np.abs(together).max() < 5e-3 * size
    assert np.abs(course["material.m.thermal_conductivity"]["top"]).max() > 0.5 * size
    # q L^2 / k times a function of k t / (c L^2): L acts like the square root of q and c, and the inverse one of 1 / k.
    length = course["box.bar.upper.z"]["top"]
    expected = 2 * own + 2 * course["material.m.density"]["top"]
    assert length == pytest.approx(expected, abs=1e-2 * size)
    # Of what each probe is at most: that of the rise at the top is where the largest one is, too.
    for of in found.table.values():
        assert of["most"].value == pytest.approx(of["top"].value, abs=of["most"].error + of["top"].error)


def test_inputs_that_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is linear is followed as it is: a source over time, and temperatures that all are shifted together."""
    by_these(monkeypatch, "box.bar.heat_source", "boundary.cold.temperature", "scene.initial_temperature")
    given = deepcopy(BAR)
    given["probe"] = given["probe"][:1]
    jumping: dict[str, Any] = {"times": [0.0, 1e-3, 1e-3, 2e-3]}
    given["box"][0]["heat_source"] = jumping | {"values": [1e9, 1e9, 3e9, 3e9]}
    given["boundary"][0]["temperature"] = jumping | {"values": [300.0, 300.0, 330.0, 330.0]}
    scene = from_dict(given)
    assert isinstance(scene, Scene)
    result = scene_run.solve(scene, None, True)
    found, traces = scene_sensitivity.of_scene(scene, result), result.traces
    by = {key: of["top"] for key, of in found.course.items()}
    together = by["box.bar.heat_source"] + by["boundary.cold.temperature"] + by["scene.initial_temperature"]
    own = found.values["top"].value
    # The scene is linear in all three, and the rise is above the start, which is one of them.
    assert traces is not None
    rows = np.interp(found.times, traces.time, traces.values["top"]) - 300.0  # type: ignore[arg-type]
    late = np.abs(found.times - 1e-3) > 2e-5  # type: ignore[operator]
    assert together[late] == pytest.approx(rows[late], abs=5e-3 * own)
    assert np.abs(by["boundary.cold.temperature"]).max() > 100


WIRE: dict[str, Any] = {
    "mesh": {"file": "wire.msh", "unit": "um"},
    "run": {"steady": True, "accuracy": 1e-2},
    "material": [{"name": "metal", "groups": ["lower", "upper"], "thermal_conductivity": 100.0, "resistivity": 1e-5,
                  "temperature_coefficient": 1e-3}],
    "source": [{"name": "lower", "group": "lower", "heat_source": 1e12}],
    "boundary": [
        {"name": "cold", "group": "near", "temperature": 293.0},
        {"name": "plus", "group": "near", "voltage": 0.01},
        {"name": "minus", "group": "far", "voltage": 0.0},
    ],
    "probe": [
        {"name": "end", "group": "far"},
        {"name": "out", "group": "near", "quantity": "heat_flow"},
        {"name": "through", "group": "joint", "quantity": "heat_flow"},
        {"name": "current", "group": "joint", "quantity": "current"},
        {"name": "half", "group": "joint", "quantity": "potential"},
    ],
}  # fmt: skip


@pytest.mark.long
def test_on_a_mesh() -> None:
    """Materials, conditions and sources are followed; coordinates are the mesh's own."""
    scene = from_dict(deepcopy(WIRE), folder=str(FILES))
    assert isinstance(scene, MeshScene)
    result = scene_run.solve(scene)
    found = scene_sensitivity.of_scene(scene, result)
    assert not any(key.endswith((".x", ".y", ".z")) for key in found.table)
    for key in ("material.metal.resistivity", "source.lower.heat_source"):
        more, less = (scene_run.solve(varied(scene, key, 1 + step)).steady for step in (DIFFERENCE, -DIFFERENCE))
        assert set(found.table[key]) == {p.name for p in scene.probes}
        for name, slope in found.table[key].items():
            expected = (more[name].value - less[name].value) / (2 * DIFFERENCE) / found.values[name].value
            # What the coupled iteration leaves shows over the difference.
            assert slope.value == pytest.approx(expected, abs=2e-3), (key, name)
