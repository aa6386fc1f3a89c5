"""Parameters on the command line: overrides, uncertainties, slopes, sweeps, maps, samples and fits take them."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from compare import quantities
from compare.against import Data
from compare.data.read import read_uncertainty
from compare.fitting import fit_scene, keys_of
from compare.slopes import sink_1d
from reduced1d.ladder import solve
from scenes.keys import SINK
from scenes.loading import load
from scenes.varied import varied
from tests.validate.inputs.test_validation import in_1d
from validate.cli import main
from validate.sweep.design import base, parse

TEXT = """
[parameters]
w = "100 um"
k = "1.38 W/(m K)"
T0 = "293 K"
[sink]
width = "w"
[anchor]
oxide_width = "w/2"
[materials.oxide]
thermal_conductivity = "k"
[environment]
room_temperature = "T0"
"""
FACES = ("sink.width", "anchor.oxide_width")


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "mine.toml"


@pytest.mark.long
def test_slopes_and_uncertainties_of_a_sink(mine, tmp_path, ran):
    given = "--sensitivities --uncertain parameters.w=2% --set parameters.w=90um"
    found, _ = ran(f"sink {mine} --steady --accuracy 1e-2 {given}")
    assert found["scene"]["parameters"] == {"w": 90e-6, "k": 1.38, "T0": 293.0}
    assert found["scene"]["anchor"]["oxide_width"] == 45e-6
    by = found["sensitivities"]
    for model in ("fem3d", "reduced1d"):
        for name in ("peak_rise_K", "end_rise_K", "current_A", "anchor_resistance_K_per_W"):
            total = sum(by[key][name][model]["value"] for key in FACES)
            largest = max(abs(of[name][model]["value"]) for of in by.values())
            assert by["parameters.w"][name][model]["value"] == pytest.approx(total, abs=1e-3 * largest)
    end = found["fem3d"]["steady"]["end_rise_K"]
    assert end["u_input"] == pytest.approx(
        0.02 * abs(by["parameters.w"]["end_rise_K"]["fem3d"]["value"]) * end["value"]
    )
    assert "parameters" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_a_sweep_over_a_parameter(tmp_path, capsys, ran):
    given = ["sweep", "bridge", "--vary", "parameters.gap=1um,3um", "--workers", "1", "--no-figures", "--quiet"]
    assert main([*given, "--out", str(tmp_path / "sweep")]) == 0
    assert "parameters.gap 1.00 um" in capsys.readouterr().out
    with (tmp_path / "sweep" / "points.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["parameters.gap"]) for row in rows] == [1e-6, 3e-6]
    one = ran("solve bridge --set parameters.gap=3um --accuracy 1e-2")[0]["fem3d"]["steady"]["middle"]
    assert float(rows[1]["fem3d_middle"]) == pytest.approx(one["value"], abs=1e-9)


def test_what_a_map_and_a_sample_are_made_of(mine):
    of = base(mine)
    axis = parse(of, "parameters.w=20um:200um", "range")
    assert (axis.key, axis.values, of.unit(axis.key)) == ("parameters.w", (20e-6, 200e-6), "m")
    sink = of.at(["parameters.w=2e-05 m"])
    assert (sink.width, sink.oxide_width) == (20e-6, 10e-6)
    again = base(load(mine)).at(["parameters.w=2e-05 m"])
    assert again == sink


def test_a_parameter_is_fitted(mine):
    """Data of the paper's model at another conductivity of the oxide, without noise."""
    sink, times = load(mine, scene_type=SINK), np.linspace(2e-4, 0.02, 40)
    truth = varied(sink, "parameters.k", 0.9)
    traces = solve(truth, times=times).over_time
    data = Data("mine.csv", "CSV", times, {"end_K": traces.values["end_K"]}, {"end_K": "x"})
    data = replace(data, u=read_uncertainty(quantities.of(sink), data, ["0.05K"]))
    found = fit_scene(sink, data, keys_of(sink, ["parameters.k"]), in_1d)
    assert found.fitted["parameters.k"] == pytest.approx(0.9 * 1.38, rel=1e-4)
    assert found.scene.oxide.thermal_conductivity == pytest.approx(0.9 * 1.38, rel=1e-4)


def test_a_room_that_is_a_parameter_moves_temperatures(mine):
    """One that is 1 % warmer is 2.93 K warmer, and the rises change by the resistance alone."""
    sink, times = load(mine, scene_type=SINK), np.array([1e-5, 1e-2])
    found = sink_1d(sink, solve(sink, times=times), times)
    same = found.at("environment.room_temperature", "peak_K", times)
    assert found.at("parameters.T0", "peak_K", times) == pytest.approx(same, rel=1e-9)
    assert same == pytest.approx([293.0, 293.0], rel=0.02)
    assert abs(found.at("parameters.w", "peak_K", times)[0]) < 1
