"""The exported device: its few states against the whole model's closed loop, the steady state in closed form, and its
FMUs coupled by fmpy."""

import copy
import importlib.util
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reduced1d.device import design
from reduced1d.device.lumped import lump, steady
from reduced1d.device.schemes import solve_accurate
from scenes.device import Control, Device, External
from statespace import export
from statespace.controllers import Controllers
from statespace.device_model import Whole, closed_loop, compact
from statespace.result import Run
from statespace.runtime import CompactModel

ROOT = Path(__file__).parents[3]
ACCURACY = 1e-5
DEVICE = Device(
    control=Control(sample_time=1e-3, sink_gain=0.5, ground_resistance=0.01), external=External(step_time=0.02),
    end_time=0.04,
)  # fmt: skip
TRACES = ("sink_K", "sensor_K", "sink_V", "sensor_V", "sink_power_W", "sensor_power_W")


@pytest.fixture(scope="module")
def exported():
    made = solve_accurate(DEVICE)
    whole = design.exported(Run(DEVICE, made, lambda _: 0j))
    return whole, compact(whole, None, ACCURACY)


def test_a_number_of_states_has_the_error_that_it_has(exported):
    few = compact(exported[0], 6, 1e-2)
    assert few["states"] == 6
    assert errors(few)["sensor_K"] > 100 * errors(exported[1])["sensor_K"]
    assert exceeded(few, exported[0]) == []


def errors(made: dict[str, Any]) -> dict[str, float]:
    """By trace the stated error of the closed loop."""
    return {name: entry["error"] for name, entry in made["error"]["closed loop"]["over time"].items()}


def exceeded(made: dict[str, Any], whole: Whole) -> list[str]:
    rows = closed_loop(CompactModel(made), whole.device, len(whole.result.time_s))
    stated = errors(made)
    return [n for n in TRACES if np.abs(rows[n] - whole.result.trace(n)).max() > stated[n]]


def test_few_states_hold_the_accuracy_and_the_stated_errors(exported):
    whole, made = exported
    relative = [e["relative"] for run in made["error"].values() for kind in run.values() for e in kind.values()]
    assert max(relative) <= ACCURACY
    assert made["states"] < whole.modal.count / 2
    assert exceeded(made, whole) == []
    # A capacity that is off by a thousandth is caught.
    other = copy.deepcopy(made)
    F = np.array(other["matrices"]["F"]["values"]).reshape(other["matrices"]["F"]["shape"])
    F[0] *= 1.001
    other["matrices"]["F"]["values"] = F.ravel().tolist()
    assert exceeded(other, whole)


def test_at_rest_it_is_the_closed_form(exported):
    whole, made = exported
    model, state = CompactModel(made), steady(whole.device)
    at_rest = model.steady()
    for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W"):
        # As the few states hold the steady responses to 1e-8 of the rise.
        assert at_rest[name] - 293 * name.endswith("K") == pytest.approx(
            getattr(state, name) - 293 * name.endswith("K"), rel=1e-7
        )
    for e, film in enumerate(("sink", "sensor")):
        control = whole.device.control
        seen = lump(whole.device).resistance[e] * (1 + lump(whole.device).coefficient[e] * whole.device.set_rise)
        assert at_rest[f"{film}_ohm"] == pytest.approx(seen, rel=1e-9)
        other = at_rest[f"{('sensor', 'sink')[e]}_A"] / at_rest[f"{film}_A"]
        own = at_rest[f"{film}_power_W"] / at_rest[f"{film}_A"] ** 2
        assert own + control.ground_resistance * (1 + other) == pytest.approx(seen, rel=1e-9)


def test_the_heat_that_enters_leaves(exported):
    """At the pins of both temperatures and in the films; with both temperatures alike and no voltage none does."""
    whole, made = exported
    model = CompactModel(made)
    g = np.array([0.5, 0.05, 300.0, 285.0])
    rows = model.read(g, np.zeros(4), model.rest(g))
    outputs, heat = model.named(rows), [rows[entry["port"]["row"]] for entry in made["inputs"][2:]]
    films = outputs["sink_power_W"] + outputs["sensor_power_W"]
    assert sum(heat) + films == pytest.approx(0.0, abs=1e-10 * films)
    assert heat[0] == pytest.approx(
        lump(whole.device).polymer.conductance * (300 - outputs["sensor_K"]), rel=1e-6
    )  # fmt: skip
    warm = np.array([0.0, 0.0, 300.0, 300.0])
    rows = model.read(warm, np.zeros(4), model.rest(warm))
    assert [rows[entry["port"]["row"]] for entry in made["inputs"][2:]] == pytest.approx([0, 0], abs=1e-12)
    assert model.named(rows)["sensor_K"] == pytest.approx(300.0, abs=1e-9)


def test_the_controllers_are_those_of_the_loop(exported):
    whole, made = exported
    lumped = lump(whole.device)
    gain = np.array([DEVICE.control.sink_gain, DEVICE.control.sensor_gain])
    other, voltage = Controllers(made["controllers"]), np.zeros(2)
    for k, rise in enumerate(([0.0, 0.0], [30.0, 40.0], [10.0, 20.0])):
        resistance = lumped.resistance * (1 + lumped.coefficient * np.array(rise))
        voltage = np.maximum(voltage + gain * (1 - np.array(rise) / DEVICE.set_rise), 0.0)
        # Half a sample at a time: the second half has no sample.
        time = k * 1e-3
        assert other.until(time + 0.5e-3, resistance) == pytest.approx(voltage, rel=1e-12, abs=1e-15)
        assert other.until(time + 1e-3, 2 * resistance) == pytest.approx(voltage, rel=1e-12, abs=1e-15)
    assert other.until(5e-3, resistance).min() >= 0


def test_a_missed_accuracy_is_kept_with_a_warning(exported):
    whole = exported[0]
    unsure = replace(whole, others=[(whole.others[0][0], 1e6)])
    made = compact(unsure, None, 1e-2)
    (warning,) = made["warnings"]
    reached = max(e["relative"] for run in made["error"].values() for kind in run.values() for e in kind.values())
    assert reached > 1e-2
    assert f"within {reached:.3g} of the device's model, not within 0.01" in warning


@pytest.mark.skipif(
    not export.fmu_available() or importlib.util.find_spec("fmpy") is None,
    reason="pythonfmu and fmpy are not installed",
)
def test_both_fmus_coupled_give_the_traces(exported, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from coupled_fmus import coupled

    whole, made = exported
    export.write(made, tmp_path)
    result, step = whole.result, whole.device.external.step_time
    traces = coupled(tmp_path, 1e-3, len(result.time_s), lambda t: 273.0 if t > step - 1e-9 else 293.0)
    for name, stated in errors(made).items():
        if name in TRACES:
            assert np.abs(np.array(traces[name]) - result.trace(name)).max() <= stated, name
    # A step of the outer temperature one sample late is caught.
    late = coupled(tmp_path, 1e-3, len(result.time_s), lambda t: 273.0 if t > step + 1e-4 else 293.0)
    assert np.abs(np.array(late["sensor_K"]) - result.sensor_K).max() > errors(made)["sensor_K"]


@pytest.mark.needs("ngspice")
def test_the_subcircuit_at_rest(exported, tmp_path):
    _, made = exported
    export.write(made, tmp_path)
    exact = CompactModel(made).steady({"sink.voltage": 1.2, "sensor.voltage": 0.07, "outside.temperature": 273.0})
    pins = "a b o s out_a out_b ra rb ia ib pa pb"
    (tmp_path / "run.cir").write_text(
        f"* at rest\n.include model.cir\nVa a 0 1.2\nVb b 0 0.07\nVo o 0 -20\nVs s 0 0\nX1 {pins} compact_model\n"
        ".op\n.control\nset numdgt=12\nop\nprint v(out_a) v(out_b) v(ra) v(rb) v(ia) v(pb) i(vb)\n.endc\n.end\n",
        encoding="utf-8",
    )
    said = subprocess.run(
        ["ngspice", "-b", "run.cir"], cwd=tmp_path, capture_output=True, encoding="utf-8", check=False, timeout=60
    )  # fmt: skip
    lines = [line.split(" = ") for line in said.stdout.splitlines() if line.startswith(("v(", "i("))]
    values = {name: float(value) for name, value in lines}
    # To ngspice's own relative tolerance of 1e-3 in each step of Newton's method, which squares it.
    assert values["v(out_a)"] == pytest.approx(exact["sink_K"] - 293, rel=1e-5)
    assert values["v(out_b)"] == pytest.approx(exact["sensor_K"] - 293, rel=1e-5)
    assert values["v(ra)"] == pytest.approx(exact["sink_ohm"], rel=1e-6)
    assert values["v(rb)"] == pytest.approx(exact["sensor_ohm"], rel=1e-6)
    assert values["i(vb)"] == pytest.approx(-exact["sensor_A"], rel=1e-5)
    assert values["v(pb)"] == pytest.approx(exact["sensor_power_W"], rel=1e-5)


def test_the_python_files_run_alone(exported, tmp_path):
    _, made = exported
    export.write(made, tmp_path)
    code = (
        "from model import model; from controllers import controllers; "
        "print(model.steady()['sensor_K'], *controllers.sample([300.0, 1.115]))"
    )
    said = subprocess.run(
        [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, '.'); {code}"], cwd=tmp_path, check=True,
        capture_output=True, encoding="utf-8",
    )  # fmt: skip
    sensor, *volts = map(float, said.stdout.split())
    assert sensor == pytest.approx(CompactModel(made).steady()["sensor_K"], abs=1e-9)
    assert volts == pytest.approx([0.5, 0.05], rel=1e-9)
