"""Names that a format takes for one: each run by the program whose format it is."""

import importlib.util
from typing import Any

import numpy as np
import pytest

from statespace import export
from statespace.document import names
from statespace.runtime import CompactModel
from tests.statespace.test_runtime import document
from tests.statespace.test_spice import run


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
    found = run(tmp_path, made, sources)
    for name, value in expected.items():
        assert found[nodes[name].lower()] == pytest.approx(value, rel=1e-8), name
    assert expected["x.y"] != pytest.approx(expected["x y"], rel=1e-2)


@pytest.mark.skipif(
    not export.fmu_available() or importlib.util.find_spec("fmpy") is None,
    reason="pythonfmu and fmpy are not installed",
)
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
