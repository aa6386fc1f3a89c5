"""Parameters on the command line: overrides, uncertainties, slopes, sweeps, maps, samples and fits take them."""

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


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "mine.toml"


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
