"""Uncertainties of keys as given, and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.errors import SceneError
from scenes.laws import PowerLaw
from scenes.loading import from_dict, load
from scenes.sink import Sink
from scenes.uncertain import read
from scenes.varied import varied


def test_relative_and_absolute():
    found = read(Sink(), ["oxide_thickness=0.1um", "drive.voltage=1%", "room_temperature=0.5K"])
    expected = {
        "anchor.oxide_thickness": 0.05, "drive.voltage": 0.01, "environment.room_temperature": 0.5 / 293.0,
    }  # fmt: skip
    assert found.relative == pytest.approx(expected)


def test_the_table_of_the_scene_and_one_over_it():
    found = read(Sink(), ["materials", "materials.oxide.thermal_conductivity=5%"])
    assert found.relative["materials.oxide.thermal_conductivity"] == 0.05
    assert (
        found.relative["materials.silicon.thermal_conductivity"]
        == load("sink").uncertainties["materials.silicon.thermal_conductivity"]
    )
    assert load("sink").uncertainties == Sink().uncertainties


def test_a_table_of_ones_own():
    sink = from_dict({"inputs": {"uncertainties": {"materials.oxide.density": "3 %"}}})
    assert read(sink, ["materials"]).relative == {"materials.oxide.density": 0.03}


def test_a_law_and_three_along_the_axes():
    """A law stands for its value, with its exponent beside; of three along the axes each has the table's."""
    law = PowerLaw(130.0, 293.0, -1.3)
    sink = replace(Sink(), silicon=replace(Sink().silicon, thermal_conductivity=law))
    table = read(sink, ["materials", "exponent=5%", "silicon.thermal_conductivity=13 W/(m K)"]).relative
    assert table["materials.silicon.thermal_conductivity.exponent"] == 0.05
    assert table["materials.silicon.thermal_conductivity"] == pytest.approx(0.1)
    more = varied(sink, "materials.silicon.thermal_conductivity.exponent", 1.1).silicon.thermal_conductivity
    assert more == PowerLaw(130.0, 293.0, pytest.approx(-1.43))
    along = replace(Sink(), silicon=replace(Sink().silicon, thermal_conductivity=(130.0, law, 120.0)))
    known = read(along, ["materials"]).relative
    usual = read(Sink(), ["materials"]).relative["materials.silicon.thermal_conductivity"]
    assert {known[f"materials.silicon.thermal_conductivity[{axis}]"] for axis in "xyz"} == {usual}


def test_covariance():
    found = read(Sink(), ["sink.width=1%", "pad_width=2%"], ["pad_width,sink.width=0.5"])
    assert found.covariance() == pytest.approx(np.array([[1e-4, 1e-4], [1e-4, 4e-4]]))


ONE, TWO = ["sink.width=1%"], ["sink.width=1%", "sink.length=1%"]


@pytest.mark.parametrize(("given", "correlated", "said"), [
    (["sink.witdh=1%"], [], "unknown key sink.witdh: "),
    (["oxide_thicknes=5%"], [], 'unknown key oxide_thicknes: '),
    (["convection_coefficient=1%"], [], '", ...'),
    (["sink.width"], [], "says nothing"),
    (["sink.width=-1%"], [], "no standard uncertainty"),
    (["sink.width=0%"], [], "no standard uncertainty"),
    (["sink.width=200%"], [], "no standard uncertainty"),
    (["sink.width=1K"], [], "neither in percent nor in the key's unit"),
    (["sink.width=0.1"], [], "neither in percent nor in the key's unit"),
    (["sink.width=wide"], [], "wide"),
    (ONE, ["sink.width,sink.length=0.5"], "sink.length is not uncertain"),
    (TWO, ["sink.width,sink.length=1.5"], '--correlated sink.width,sink.length = "1.5"'),
    (TWO, ["sink.width=1"], "is no correlation"),
    (TWO, ["sink.width,sink.length=much"], 'sink.length = "much" is not a number'),
    ([*TWO, "sink.thickness=1%"],
     ["sink.width,sink.length=0.9", "sink.length,sink.thickness=0.9", "sink.width,sink.thickness=-0.9"], "contradict"),
])  # fmt: skip
def test_refused(given, correlated, said):
    with pytest.raises(SceneError) as found:
        read(Sink(), given, correlated)
    assert said in str(found.value)
    assert "\n" not in str(found.value)


def test_a_table_with_an_unknown_key_is_refused():
    with pytest.raises(SceneError, match="unknown key"):
        from_dict({"inputs": {"uncertainties": {"materials.oxyde.density": 0.01}}})
