"""Compact models of scenes, against runs that they were not made of, also where metal carries no current."""

import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs.compact import choose_places, compact, refuse
from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.loading import load_free as load
from scenes.model import Schedule
from statespace.channels import channels, driven, scenarios
from statespace.export import write
from statespace.runtime import CompactModel
from tests.validate.solve.test_mesh_cli import SCENE as MESH_SCENE
from tests.validate.solve.test_mesh_cli import WIRE

BAR = """
scene.name = "bar"
run = {end_time = "2 ms", accuracy = 2e-2}
box = [{name = "bar", material = "silicon", lower = [0, 0, 0], upper = [4e-4, 1e-5, 1e-5]}]
boundary = [
  {name = "held", lower = [0, 0, 0], upper = [0, 1e-5, 1e-5], temperature = 293},
  {name = "air", lower = [0, 0, 1e-5], upper = [4e-4, 1e-5, 1e-5], convection = {coefficient = 2000, ambient = 293}},
  {name = "in", lower = [0, 0, 0], upper = [0, 1e-5, 1e-5], voltage = 4},
  {name = "out", lower = [4e-4, 0, 0], upper = [4e-4, 1e-5, 1e-5], voltage = 0},
]
probe = [
  {name = "middle", at = [2e-4, 5e-6, 5e-6]},
  {name = "heat", quantity = "heat_flow", lower = [0, 0, 0], upper = [0, 1e-5, 1e-5]},
  {name = "current", quantity = "current", lower = [0, 0, 0], upper = [0, 1e-5, 1e-5]},
  {name = "half way", quantity = "potential", at = [2e-4, 5e-6, 5e-6]},
]
[[material]]
name = "silicon"
thermal_conductivity = 130
density = 2330
specific_heat = 712
resistivity = 6e-5
temperature_coefficient = 1e-3
"""
ACCURACY = 5e-2
Traces = dict[str, Any]


@pytest.fixture(scope="module")
def bar():
    return from_dict(tomllib.loads(BAR))


@pytest.fixture(scope="module")
def document(bar):
    return compact(bar, None, ACCURACY)


@pytest.fixture(scope="module")
def truth(bar):
    """The bar by `validate solve`, at a tenth of its accuracy."""
    return scene_run.solve(replace(bar, accuracy=ACCURACY / 10))


@pytest.fixture(scope="module")
def steady_truth(bar):
    return scene_run.solve(replace(bar, accuracy=ACCURACY / 10, steady=True))


def wrong(document: dict[str, Any]) -> dict[str, Any]:
    """The same, with outputs 3 % larger."""
    Y = document["matrices"]["Y"]
    width = Y["shape"][1]
    nudged = [1.03 * y if k % width > len(document["inputs"]) else y for k, y in enumerate(Y["values"])]
    return document | {"matrices": document["matrices"] | {"Y": Y | {"values": nudged}}}


def off(document: dict[str, Any], found: Traces, truth: Traces, kind: str = "over time") -> float:
    """The largest distance of a model from a run, over the error that the model states."""
    stated = document["error"]["the scene"][kind]
    return max(float(np.abs(found[n] - truth[n]).max()) / stated[n]["error"] for n in stated)


@pytest.mark.long
def test_the_scene_itself(document):
    assert document["states"] <= 12 * len(document["inputs"])
    each = [e for run in document["error"].values() for kind in run.values() for e in kind.values()]
    assert max(e["relative"] for e in each) <= ACCURACY


def test_a_model_stops_in_time_with_a_warning(bar, monkeypatch):
    """The inputs whose steps there is no time for are named."""
    monkeypatch.setattr("fem3d.runs.compact.ALWAYS", 0.0)
    monkeypatch.setattr("fem3d.runs.compact.LONGEST", 1.0)
    made = compact(replace(bar, steady=True, accuracy=1e-2), None, 1e-4, seconds=1e-4)
    assert CompactModel(made).steady()["current"] > 0
    assert set(made["error"]) == {"the scene", "step of in.voltage"}, "this step is the scene"
    untried = made["warnings"][-1]
    assert "not compared with the full one for a step of held.temperature, a step of air.ambient" in untried


def test_the_steady_state_of_a_transient_is_left_out_in_time(bar, monkeypatch):
    monkeypatch.setattr("fem3d.runs.compact.ALWAYS", 0.0)
    monkeypatch.setattr("fem3d.runs.compact.LONGEST", 1.0)
    made = compact(replace(bar, accuracy=1e-2), None, 1e-2, seconds=1e-4)
    assert set(made["error"]["the scene"]) == {"over time"}


@pytest.mark.parametrize("accurate", [True, False])
def test_a_result_that_is_accurate_enough_is_not_solved_again(accurate, bar, monkeypatch):
    scene, solve, solved = replace(bar, steady=True), scene_run.solve, []
    earlier = solve(replace(scene, accuracy=5e-4))
    coarse = {name: replace(e, error=0.1 * abs(e.value)) for name, e in earlier.steady.items()}
    monkeypatch.setattr(scene_run, "solve", lambda each: solved.append(each) or solve(each))
    compact(scene, None, 1e-3, earlier=earlier if accurate else replace(earlier, steady=coarse))
    assert (scene in [replace(each, accuracy=scene.accuracy) for each in solved]) is not accurate


def in_python(folder: Path, times: np.ndarray) -> tuple[Traces, Traces]:
    """By the file alone, in a Python that has none of this package."""
    code = (
        "import json, sys; sys.path.insert(0, sys.argv[1]); from model import model\n"
        "assert not any(m.split('.')[0] in ('scenes', 'fem3d', 'scipy') for m in sys.modules)\n"
        "found = model.simulate(json.loads(sys.argv[2]))\n"
        "print(json.dumps([{n: v.tolist() for n, v in found.items()}, model.steady()]))"
    )
    command = [sys.executable, "-B", "-c", code, str(folder), json.dumps(times.tolist())]
    done = subprocess.run(command, check=True, capture_output=True, encoding="utf-8", cwd=folder)
    over_time, steady = json.loads(done.stdout)
    return {n: np.array(v) for n, v in over_time.items()}, steady


@pytest.mark.long
def test_temperature_and_potential_jump_at_a_contact():
    """A bar of two halves, against a run ten times more accurate; one of the whole bar is further off."""
    document = tomllib.loads(BAR)
    document["box"][0]["upper"][0] = 2e-4
    rest = {"name": "rest", "material": "silicon", "lower": [2e-4, 0, 0], "upper": [4e-4, 1e-5, 1e-5]}
    document["box"].append(rest)
    joint = {"thermal_resistance": 1e-6, "electrical_resistance": 5e-9}
    document["contact"] = [{"name": "joint", "between": ["bar", "rest"], **joint}]
    for probe in document["probe"]:
        probe |= {"box": "rest"} if "at" in probe else {}
    halves = from_dict(document)
    assert len(halves.boxes) == 2
    made, full = compact(halves, None, ACCURACY), scene_run.solve(replace(halves, accuracy=ACCURACY / 10)).over_time
    perfect = scene_run.solve(replace(halves, contacts=(), accuracy=ACCURACY / 10)).over_time
    late = full.time >= made["range"]["from_s"]
    times, exact = full.time[late], {n: v[late] for n, v in full.values.items()}
    assert off(made, CompactModel(made).simulate(times), exact) <= 1
    assert off(made, CompactModel(wrong(made)).simulate(times), exact) > 1
    assert off(made, {n: np.interp(times, perfect.time, v) for n, v in perfect.values.items()}, exact) > 3


@pytest.mark.long
def test_exported_file_is_within_its_error_bounds(document, truth, steady_truth, tmp_path):
    late = truth.traces.time >= document["range"]["from_s"]
    expected = {n: v[late] for n, v in truth.traces.values.items()}
    settled = {n: estimate.value for n, estimate in steady_truth.steady.items()}
    for name, made in (("right", document), ("wrong", wrong(document))):
        write(made, tmp_path / name)
        over_time, steady = in_python(tmp_path / name, truth.traces.time[late])
        assert (off(made, over_time, expected) <= 1) == (name == "right")
        assert (off(made, steady, settled, "steady") <= 1) == (name == "right")


@pytest.mark.long
def test_inputs_that_it_was_not_made_with(bar, document):
    """All at once, a jump and a ramp among them: errors of linear parts add up."""
    ramp = Schedule((0.0, 1e-3), (293.0, 313.0))
    jump = Schedule((1e-3, 1e-3), (1.0, 3.0))
    given = {"held.temperature": ramp, "out.voltage": jump, "in.voltage": 4.0, "air.ambient": 300.0}
    truth = scene_run.solve(replace(driven(bar, given), accuracy=ACCURACY / 10))
    late = truth.traces.time >= document["range"]["from_s"]
    tables = {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in given.items()}
    with pytest.warns(UserWarning, match="held.temperature"):
        found = CompactModel(document).simulate(truth.traces.time[late], tables)
    for name, scale in truth.details["scales"].items():
        assert np.abs(found[name] - truth.traces.values[name][late]).max() <= 2 * ACCURACY * scale, name


@pytest.mark.long
def test_a_steady_state_with_currents():
    """With a given number of states."""
    bridge = load("bridge", ["run.accuracy=1e-2"])
    found = CompactModel(compact(bridge, 3, 1e-2))
    assert found.states == 3
    other = {"substrate.temperature": 293.5, "left electrode.voltage": -0.7, "right electrode.voltage": 0.2}
    truth = scene_run.solve(replace(driven(bridge, other), accuracy=1e-3)).steady
    ours = found.steady(other)
    for name, is_ in truth.items():
        # The inputs are parts of those steps for which errors are stated, and the errors of linear parts add up.
        stated = sum(run["steady"][name]["error"] for run in found.document["error"].values())
        assert abs(ours[name] - is_.value) <= stated + is_.error, name
    found.U[:] *= 1.02
    assert abs(found.steady(other)["quarter"] - truth["quarter"].value) > stated


def test_currents_alone(bar):
    """Without states, and at once: of three electrodes the outer voltages vary in time."""
    ramp = Schedule((0.0, 1e-3), (1.0, -2.0))
    electric = [replace(b, value=ramp if b.name == "in" else b.value) for b in bar.boundaries if b.kind == "voltage"]
    middle = replace(electric[0], name="third", lower=(1e-4, 0.0, 0.0), upper=(2e-4, 1e-5, 0.0), value=0.5)
    silicon = replace(bar.boxes[0].material, temperature_coefficient=0.0)
    probes = tuple(p for p in bar.probes if p.quantity in ("current", "potential"))
    scene = replace(
        bar, boxes=(replace(bar.boxes[0], material=silicon),), boundaries=(*electric, middle), probes=probes
    )
    found = CompactModel(compact(scene, None, ACCURACY))
    assert (found.states, len(found.inputs)) == (0, 3)
    truth = scene_run.solve(replace(scene, accuracy=ACCURACY / 10)).traces
    ours = found.steady({"in.voltage": -2.0})
    for name, values in truth.values.items():
        stated = sum(run["steady"][name]["error"] for run in found.document["error"].values())
        assert abs(ours[name] - values[-1]) <= stated + truth.errors[name], name
        if name == "current":
            assert abs(found.steady({"in.voltage": -1.5})[name] - values[-1]) > 3 * stated


@pytest.mark.long
def test_a_mesh_file(tmp_path):
    """With its given temperature stepped alone, of which no heat comes, as one of the runs."""
    (tmp_path / "wire.toml").write_text(MESH_SCENE.replace("wire.msh", str(WIRE)), encoding="utf-8")
    wire = load(str(tmp_path / "wire.toml"), [])
    found = CompactModel(compact(wire, None, 3e-2))
    other = {"cold.temperature": 293.4, "plus.voltage": -0.005, "minus.voltage": 0.002, "source-1.heat_source": 5e11}
    ours, truth = found.steady(other), scene_run.solve(driven(wire, other)).steady
    for name, is_ in truth.items():
        stated = sum(run["steady"][name]["error"] for run in found.document["error"].values())
        assert abs(ours[name] - is_.value) <= stated, name
    found.Y[:, -1] *= 1.1
    assert abs(found.steady(other)["end"] - truth["end"].value) > stated


@pytest.mark.long
def test_a_current_that_heating_hardly_changes_has_few_fields():
    """Each further field multiplies the loads; a model of 22 boxes took four times as long."""
    scene = replace(load("hotplate", ["boundary.drive.voltage=0.2V"]), steady=True, output_times=(), accuracy=1e-2)
    document = compact(scene, None, 1e-2)
    assert document["matrices"]["S"]["shape"][0] == 2  # of the cold film and a hot film, but not of a third
    assert document["estimated"]["more_states"] < 20


@pytest.mark.long
def test_a_model_of_the_sink(tmp_path, ran):
    """Of its 3D problem: both electrodes and both undersides as inputs, the current as an output too."""
    summary, said = ran(f"sink --steady --accuracy 1e-2 --export {tmp_path / 'mine'} --states 3")
    assert "Exported a compact model (3 states, within" in " ".join(said.split())
    model = CompactModel(json.loads((tmp_path / "mine" / "model.json").read_text(encoding="utf-8")))
    assert (model.states, len(model.inputs)) == (3, 4)
    current = summary["fem3d"]["steady"]["current_A"]["value"]
    assert model.steady()["current"] == pytest.approx(current, rel=2e-2)
    assert 0 < model.document["error"]["the scene"]["steady"]["current"]["relative"] < 2e-2


def test_the_places_of_an_extreme():
    """Of three places one is never the highest, or by less than matters."""
    values = np.array([[1.0, 5.0, 2.0], [3.0, 1.0, 1.0], [0.5, 4.9, 1.9]])
    near = np.full(3, 1e-3)
    assert choose_places(values, np.arange(3), near).tolist() == [0, 1]
    values[2, 2] = 2.0005
    assert choose_places(values, np.arange(3), near).tolist() == [0, 1]
    near[2] = 1e-4
    assert sorted(choose_places(values, np.arange(3), near)) == [0, 1, 2]


def test_what_has_no_model(bar):
    with pytest.raises(SceneError, match="probe"):
        refuse(replace(bar, probes=()))
    with pytest.raises(SceneError, match=r'"half way"\.reduce asks for an extreme potential'):
        refuse(replace(bar, probes=tuple(replace(p, reduce="max") for p in bar.probes)))


def layered(
    resistivity: float | str, conductivity: float = 300.0, strip: bool = False, run: dict[str, Any] | None = None
) -> Any:
    """A heater under oxide under a mirror of metal that no electrode touches, or one alone."""

    def box(name: str, low: float, high: float) -> dict[str, Any]:
        return {"name": name, "material": name, "lower": [0, 0, low], "upper": [1e-4, 2e-5, high]}

    def end(name: str, x: float, high: float = 2e-6, low: float = 0.0, **condition: float) -> dict[str, Any]:
        return {"name": name, "lower": [x, 0, low], "upper": [x, 2e-5, high], **condition}

    def material(name: str, conductivity: float, **others: Any) -> dict[str, Any]:
        return {"name": name, "thermal_conductivity": conductivity, "density": 2e3, "specific_heat": 700} | others

    document: dict[str, Any] = {
        "run": (run or {"steady": True}) | {"accuracy": 1e-2},
        "material": [
            material("heater", 130, resistivity=6e-5, temperature_coefficient=5e-4),
            material("oxide", 1.3),
            material("mirror", conductivity, resistivity=resistivity),
        ],
        "box": [box("heater", 0.0, 2e-6), box("oxide", 2e-6, 3e-6), box("mirror", 3e-6, 3.5e-6)],
        "boundary": [end("cold", 1e-4, temperature=293), end("one", 1e-4, voltage=1), end("two", 0.0, voltage=0)],
        "probe": [{"name": "top", "at": [0, 1e-5, 3.5e-6]}],
    }
    if strip:
        document["boundary"].append(end("strip", 0.0, 3.5e-6, 3e-6, voltage=0.3))
        document["probe"].append({"name": "potential", "quantity": "potential", "at": [5e-5, 1e-5, 3.25e-6]})
    return from_dict(document)


def test_metal_that_no_electrode_touches_is_an_insulator_to_current():
    """To the last digits: both scenes are the same problem of heat. Another conductivity is seen."""
    metal, insulator = (scene_run.solve(layered(r)).steady["top"].value for r in (2e-8, "insulator"))
    assert metal == pytest.approx(insulator, rel=1e-12)
    other = scene_run.solve(layered(2e-8, conductivity=30.0)).steady["top"].value
    assert abs(other - metal) > 1e-4 * (metal - 293)


@pytest.mark.long
@pytest.mark.parametrize("strip", [False, True])
def test_a_model_of_a_scene_with_metal_that_carries_no_current(strip):
    scene = layered(2e-8, strip=strip)
    model = CompactModel(compact(scene, None, 1e-2))
    full = scene_run.solve(scene).steady
    assert model.steady()["top"] - 293 == pytest.approx(full["top"].value - 293, rel=2e-2)
    if strip:
        assert model.steady()["potential"] == pytest.approx(0.3, rel=1e-9)
        assert model.steady({"strip.voltage": 0.2})["potential"] == pytest.approx(0.2, rel=1e-9)


def test_a_voltage_that_warms_nothing_leaves_all_at_rest_over_time():
    """A model is held against the step of each voltage alone, also of one that no other electrode answers."""
    scene = layered(2e-8, strip=True, run={"end_time": 1e-4})
    known = {c.name: c for c in channels(scene)}
    traces = scene_run.solve(scenarios(scene, tuple(known.values()))["step of strip.voltage"]).traces
    assert traces.values["top"] == pytest.approx(293, abs=1e-9)
    assert traces.values["potential"][1:] == pytest.approx(known["strip.voltage"].step, rel=1e-9)
