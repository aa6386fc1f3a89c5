"""Compact models of scenes, against runs that they were not made of."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d import solve_mesh, solve_scene
from fem3d.compact.channels import driven
from fem3d.compact.find import check, compact
from fem3d.compact.judge import needed
from scenes.compact.files import write
from scenes.compact.runtime import CompactModel
from scenes.errors import SceneError
from scenes.free import load
from scenes.model import Schedule
from tests.validate.solve.test_mesh_cli import SCENE as MESH_SCENE
from tests.validate.solve.test_mesh_cli import WIRE

BAR = """
[scene]
name = "bar"
[run]
end_time = "2 ms"
accuracy = 2e-2
[[material]]
name = "silicon"
thermal_conductivity = 130
density = 2330
specific_heat = 712
resistivity = 6e-5
temperature_coefficient = 1e-3
[[box]]
name = "bar"
material = "silicon"
lower = [0, 0, 0]
upper = ["400 um", "10 um", "10 um"]
[[boundary]]
name = "held"
lower = [0, 0, 0]
upper = [0, "10 um", "10 um"]
temperature = "293 K"
[[boundary]]
name = "air"
lower = [0, 0, "10 um"]
upper = ["400 um", "10 um", "10 um"]
convection = { coefficient = 2000, ambient = "293 K" }
[[boundary]]
name = "in"
lower = [0, 0, 0]
upper = [0, "10 um", "10 um"]
voltage = "4 V"
[[boundary]]
name = "out"
lower = ["400 um", 0, 0]
upper = ["400 um", "10 um", "10 um"]
voltage = 0
[[probe]]
name = "middle"
at = ["200 um", "5 um", "5 um"]
[[probe]]
name = "heat"
quantity = "heat_flow"
lower = [0, 0, 0]
upper = [0, "10 um", "10 um"]
[[probe]]
name = "current"
quantity = "current"
lower = [0, 0, 0]
upper = [0, "10 um", "10 um"]
[[probe]]
name = "half way"
quantity = "potential"
at = ["200 um", "5 um", "5 um"]
"""
ACCURACY = 2e-2


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("scene") / "bar.toml"
    path.write_text(BAR)
    return load(str(path), [])


@pytest.fixture(scope="module")
def document(bar: Any) -> dict[str, Any]:
    return compact(bar, None, ACCURACY)


def off(document: dict[str, Any], scene: Any, inputs: dict[str, Any], run: str) -> float:
    """The largest distance of a model from a run at a tenth of its accuracy, over the stated error of ``run``."""
    truth = solve_scene.solve(replace(scene, accuracy=ACCURACY / 10))
    late = truth.traces.time >= document["range"]["from_s"]
    found = CompactModel(document).simulate(truth.traces.time[late], inputs)
    stated = document["error"][run]["over time"]
    return max(float(np.abs(found[n] - truth.traces.values[n][late]).max()) / stated[n]["error"] for n in found)


def test_the_scene_itself(bar: Any, document: dict[str, Any]) -> None:
    assert document["states"] <= 12 * len(document["inputs"])
    each = [e for run in document["error"].values() for kind in run.values() for e in kind.values()]
    assert max(e["relative"] for e in each) <= ACCURACY
    assert document["estimated"]["residual"] < ACCURACY
    assert off(document, bar, {}, "the scene") <= 1
    wrong = document["matrices"] | {"Y": document["matrices"]["Y"] | {"values": [
        1.03 * y if k % len(document["inputs"]) else y for k, y in enumerate(document["matrices"]["Y"]["values"])
    ]}}  # fmt: skip
    assert off(document | {"matrices": wrong}, bar, {}, "the scene") > 1


def test_inputs_that_it_was_not_made_with(bar: Any, document: dict[str, Any]) -> None:
    """All at once, a jump and a ramp among them: errors of linear parts add up."""
    ramp = Schedule((0.0, 1e-3), (293.0, 313.0))
    jump = Schedule((1e-3, 1e-3), (1.0, 3.0))
    given = {"held.temperature": ramp, "out.voltage": jump, "in.voltage": 4.0, "air.ambient": 300.0}
    truth = solve_scene.solve(replace(driven(bar, given), accuracy=ACCURACY / 10))
    late = truth.traces.time >= document["range"]["from_s"]
    tables = {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in given.items()}
    with pytest.warns(UserWarning, match="held.temperature"):
        found = CompactModel(document).simulate(truth.traces.time[late], tables)
    for name, scale in truth.details["scales"].items():
        assert np.abs(found[name] - truth.traces.values[name][late]).max() <= 2 * ACCURACY * scale, name


def test_python_without_this_package(document: dict[str, Any], tmp_path: Path) -> None:
    write(document, tmp_path)
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from model import model\n"
        "assert not any(m.split('.')[0] in ('scenes', 'fem3d', 'scipy') for m in sys.modules)\n"
        "print(repr(float(model.simulate([1e-3])['middle'][0])))"
    )
    done = subprocess.run(
        [sys.executable, "-B", "-c", code, str(tmp_path)], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    assert float(done.stdout) == pytest.approx(CompactModel(document).simulate([1e-3])["middle"][0], rel=1e-12)


def test_a_steady_state_with_currents() -> None:
    """Of as many states as asked for."""
    bridge = load("bridge", ["run.accuracy=1e-2"])
    found = CompactModel(compact(bridge, 3, 1e-2))
    assert found.states == 3
    other = {"substrate.temperature": 293.5, "left electrode.voltage": -0.7, "right electrode.voltage": 0.2}
    truth = solve_scene.solve(replace(driven(bridge, other), accuracy=1e-3)).steady
    ours = found.steady(other)
    for name, is_ in truth.items():
        # The inputs are parts of those steps for which errors are stated, and the errors of linear parts add up.
        stated = sum(run["steady"][name]["error"] for run in found.document["error"].values())
        assert abs(ours[name] - is_.value) <= stated + is_.error, name
    found.U[:] *= 1.02
    assert abs(found.steady(other)["quarter"] - truth["quarter"].value) > stated


def test_a_mesh_file(tmp_path: Path) -> None:
    """With its given temperature stepped alone, of which no heat comes, as one of the runs."""
    (tmp_path / "wire.toml").write_text(MESH_SCENE.replace("wire.msh", str(WIRE)))
    wire = load(str(tmp_path / "wire.toml"), [])
    found = CompactModel(compact(wire, None, 3e-2))
    other = {"cold.temperature": 293.4, "plus.voltage": -0.005, "minus.voltage": 0.002, "source-1.heat_source": 5e11}
    ours, truth = found.steady(other), solve_mesh.solve(driven(wire, other)).steady
    for name, is_ in truth.items():
        stated = sum(run["steady"][name]["error"] for run in found.document["error"].values())
        assert abs(ours[name] - is_.value) <= stated, name
    found.Y[:, -1] *= 1.1
    assert abs(found.steady(other)["end"] - truth["end"].value) > stated


def test_the_places_of_an_extreme() -> None:
    """Of three places one is never the highest; rows are given back in the order in which they are needed."""
    values = np.array([[1.0, 5.0, 2.0], [3.0, 1.0, 1.0], [0.5, 4.9, 1.9]])
    assert needed(values, np.arange(3)).tolist() == [0, 1]
    values[2, 2] = 2.1
    assert needed(values, np.arange(3)).tolist() == [0, 1, 2]


def test_what_has_no_model(bar: Any) -> None:
    with pytest.raises(SceneError, match="probe"):
        check(replace(bar, probes=()))
    with pytest.raises(SceneError, match=r'"half way"\.reduce asks for an extreme potential'):
        check(replace(bar, probes=tuple(replace(p, reduce="max") for p in bar.probes)))
