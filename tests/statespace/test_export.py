"""Exported files run by the program whose format it is, fmpy or ngspice, against the compact model in Python; names
that a format takes for one."""

import importlib.util
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statespace import export
from statespace.document import names
from statespace.export import as_spice
from statespace.runtime import CompactModel
from tests.statespace.test_runtime import document

needs_fmu = pytest.mark.skipif(
    not export.fmu_available() or importlib.util.find_spec("fmpy") is None,
    reason="pythonfmu and fmpy are not installed (pip install '.[fmu]')",
)


def run_fmu(made: dict[str, Any], folder: Path, drive: dict[str, Any]) -> Any:
    import fmpy

    export.write(made, folder)
    signals = np.array([(0.0, 1.5, 0.0), (0.5, 1.5, 0.0), (0.5, -1.0, 0.0), (1.0, -1.0, 0.0)],
                       dtype=[("time", float), ("V", float), ("T", float)])  # fmt: skip
    return fmpy.simulate_fmu(str(folder / "model.fmu"), stop_time=1.0, output_interval=0.1, input=signals, **drive)


@needs_fmu
def test_over_time(tmp_path):
    """A jump at a communication point; each file of a folder in its own."""
    made = document()
    expected = CompactModel(made).simulate([0.5, 1.0], {"V": ([0.5, 0.5], [1.5, -1.0]), "T": 0.0})["t"]
    found = run_fmu(made, tmp_path / "a", {"output": ["t"]})
    # Steps of a millionth each, and the sum of ten.
    assert found["t"][-1] == pytest.approx(expected[-1], abs=1e-4 * np.abs(expected).max())
    made["matrices"]["F"]["values"][3] *= 1.01
    again = run_fmu(made, tmp_path / "b", {"output": ["t"]})
    assert again["t"][-1] != pytest.approx(expected[-1], abs=1e-4 * np.abs(expected).max())


@needs_fmu
def test_a_steady_state(tmp_path):
    made = document(steady=True)
    found = run_fmu(made, tmp_path, {"output": ["y"]})
    assert found["y"][-1] == pytest.approx(CompactModel(made).steady({"V": -1.0, "T": 0.0})["y"], rel=1e-9)


def test_without_pythonfmu_the_rest_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(export, "fmu_available", lambda: False)
    export.write(document(), tmp_path)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["model.cir", "model.json", "model.py"]


@needs_fmu
def test_every_variable_has_a_unit_of_si(tmp_path):
    import fmpy

    export.write(document(), tmp_path)
    found = fmpy.read_model_description(str(tmp_path / "model.fmu"), validate=True)
    assert {v.name: v.unit for v in found.modelVariables} == {"V": "V", "T": "K", "y": "W", "t": "K"}
    powers = {unit.name: unit.baseUnit for unit in found.unitDefinitions}
    assert powers["K"].K == 1
    assert (powers["W"].kg, powers["W"].m, powers["W"].s) == (1, 2, -3)


def alike() -> dict[str, Any]:
    """Inputs that differ in case alone, outputs in a sign alone, and names that a netlist has of its own."""
    made = document(steady=True)
    made["inputs"][0]["name"], made["inputs"][1]["name"] = "Drive.voltage", "drive.voltage"
    made["outputs"] = [
        {"name": name, "unit": "W", "rows": [row], "reduce": "mean"}
        for name, row in (("x.y", 0), ("x y", 1), ("X Y", 0), ("drive voltage", 1), ("1", 0), ("µ", 1), ("Ω", 0))
    ]
    made["error"] = {"the scene": {"steady": {"x.y": {"error": 0.0, "relative": 0.0}}}}
    return made


def test_each_is_told_apart_by_the_rule_of_its_format():
    made = alike()
    spice, fmu = ([entry[kind] for entry in names(made)] for kind in ("spice", "fmu"))
    assert spice[:2] == ["Drive_voltage", "drive_voltage_2"]
    assert spice[2:] == ["out_x_y", "out_x_y_2", "out_X_Y_3", "out_drive_voltage", "out_1", "out__", "out___2"]
    assert len({node.lower() for node in spice}) == 9
    assert fmu[:2] == ["Drive_voltage", "drive_voltage"]
    assert fmu[2:] == ["x_y", "x_y_2", "X_Y", "drive_voltage_2", "_1", "_", "__2"]
    made["inputs"][0]["name"], made["inputs"][1]["name"] = "B1", "gnd"
    assert [entry["spice"] for entry in names(made)][:2] == ["B1_2", "gnd_2"]


@pytest.mark.needs("ngspice")
def test_in_ngspice(tmp_path):
    made = alike()
    expected = CompactModel(made).steady({"Drive.voltage": 1.2, "drive.voltage": 2.6})
    nodes = {entry["name"]: entry["spice"] for entry in names(made)}
    sources = [f"V1 {nodes['Drive.voltage']} 0 1.2", f"V2 {nodes['drive.voltage']} 0 0.6"]
    found = run_spice(tmp_path, made, sources)
    for name, value in expected.items():
        assert found[nodes[name].lower()] == pytest.approx(value, rel=1e-8), name
    assert expected["x.y"] != pytest.approx(expected["x y"], rel=1e-2)


@needs_fmu
def test_in_fmpy(tmp_path):
    import fmpy

    made = alike()
    expected = CompactModel(made).steady({"Drive.voltage": 1.2, "drive.voltage": 2.6})
    export.write(made, tmp_path)
    variables = {entry["name"]: entry["fmu"] for entry in names(made)}
    fmpy.read_model_description(str(tmp_path / "model.fmu"), validate=True)
    driven = [("time", float), *((variables[name], float) for name in ("Drive.voltage", "drive.voltage"))]
    given = np.array([(0.0, 1.2, 2.6)], dtype=driven)
    found = fmpy.simulate_fmu(
        str(tmp_path / "model.fmu"), stop_time=1.0, input=given, output=[variables[n] for n in expected]
    )
    for name, value in expected.items():
        assert found[variables[name]][-1] == pytest.approx(value, rel=1e-9), name


def run_spice(
    folder: Path, made: dict[str, Any], sources: list[str], analysis: str = "op", text: str = ""
) -> dict[str, float]:
    """Return the last voltage at each output's node."""
    (folder / "model.cir").write_text(text or as_spice(made), encoding="utf-8")
    nodes = [entry["spice"] for entry in names(made)]
    reads = [node for node in nodes if node.startswith("out_")]
    index = "" if analysis == "op" else f"[length(v({reads[0]}))-1]"
    lines = [
        "* test", ".include model.cir", *sources, f"X1 {' '.join(nodes)} compact_model",
        ".options reltol=1e-7 vntol=1e-12 abstol=1e-15 method=gear", ".control", "set numdgt=14", analysis,
        *(f"let last = v({node}){index}\nprint last" for node in reads), "quit", ".endc", ".end",
    ]  # fmt: skip
    (folder / "run.cir").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run(["ngspice", "-b", "run.cir"], cwd=folder, capture_output=True, encoding="utf-8", timeout=60)
    values = [float(line.split("=")[1]) for line in done.stdout.splitlines() if line.startswith("last = ")]
    assert len(values) == len(reads), done.stdout + done.stderr
    return dict(zip((node.lower() for node in reads), values, strict=True))


@pytest.mark.needs("ngspice")
def test_steady_extreme_of_two_current_fields(tmp_path):
    made = document(steady=True)
    expected = CompactModel(made).steady({"V": 1.2, "T": 2.6})
    sources = ["V1 V 0 1.2", "V2 T 0 0.6"]
    found = run_spice(tmp_path, made, sources)
    assert found["out_y"] == pytest.approx(expected["y"], rel=1e-8)
    assert found["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
    wrong = run_spice(tmp_path, made, sources, text=as_spice(made).replace("Rb2 b2 0 1", "Rb2 b2 0 1.01"))
    assert wrong["out_t"] != pytest.approx(expected["t"] - 2.0, rel=1e-8)


@pytest.mark.needs("ngspice")
def test_ramp_over_time(tmp_path):
    """All states start at zero (uic); the first output follows the rate of an input, too."""
    made = document()
    model = CompactModel(made)
    given = {"V": 1.0, "T": ([0.0, 2.0], [2.0, 4.0])}
    expected = model.simulate([1.0], given)
    found = run_spice(tmp_path, made, ["V1 V 0 1", "V2 T 0 PWL(0 0 2 2)"], "tran 5m 1 0 5m uic")
    model.W[:] = 0
    still = model.simulate([1.0], given)
    assert found["out_t"] == pytest.approx(expected["t"][0] - 2.0, rel=1e-3)
    assert found["out_t"] != pytest.approx(still["t"][0] - 2.0, rel=1e-3)


@pytest.mark.needs("ngspice")
def test_heat_into_pin(tmp_path):
    """Watts into the pin of a heat source are its density times its volume."""
    made = document(steady=True)
    made["inputs"][1] |= {"kind": "heat_source", "unit": "W/m3", "port": {"row": 1, "unit": "K", "size": 4.0}}
    expected = CompactModel(made).steady({"V": 1.2, "T": 0.6})
    found = run_spice(tmp_path, made, ["V1 V 0 1.2", "Iheat 0 T 2.4"])
    assert found["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
