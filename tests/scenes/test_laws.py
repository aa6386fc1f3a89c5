"""Properties that follow the temperature or differ along the axes, and an electrical conductivity in place of a
resistivity: read, written back, refused."""

import json

import numpy as np
import pytest

from scenes import laws
from scenes.errors import SceneError
from scenes.free import as_dict, from_dict
from scenes.laws import PowerLaw, Table
from scenes.loading import as_dict as sink_dict
from scenes.loading import distinguishes, load
from scenes.loading import from_dict as sink_from
from scenes.sink import SILICON, Sink
from scenes.varied import numbers, varied
from tests.scenes.free.refused import beam
from tests.scenes.test_refusals import refusal

POWER = {"value": "1.3 W/(cm K)", "at": "20 degC", "exponent": -1.3}
TABLE = {"temperatures": [300, "400 K", "500 K"], "values": [130, "k/2", 50]}


def free(**material):
    given = {"name": "silicon", "thermal_conductivity": 130.0, **material}
    return {
        "parameters": {"k": "160 W/(m K)"},
        "material": [given],
        "box": [{"name": "bar", "material": "silicon", "lower": [0, 0, 0], "upper": [1e-5, 1e-3, 1e-6]}],
        "boundary": [
            {"lower": [0, 0, 0], "upper": [1e-5, 0, 1e-6], "temperature": 300},
            {"lower": [0, 1e-3, 0], "upper": [1e-5, 1e-3, 1e-6], "temperature": 400},
        ],
        "probe": [{"name": "middle", "at": [5e-6, 5e-4, 0]}],
        "run": {"steady": True},
    }


def conductivity(scene):
    return scene.boxes[0].material.thermal_conductivity


def test_a_power_a_table_and_three_of_them_are_read_in_si_units_and_written_back():
    found = conductivity(from_dict(free(thermal_conductivity=[POWER, TABLE, "k"])))
    assert found == (PowerLaw(130.0, 293.15, -1.3), Table((300.0, 400.0, 500.0), (130.0, 80.0, 50.0)), 160.0)
    scene = from_dict(
        free(thermal_conductivity=[POWER, TABLE, "k"], resistivity=TABLE | {"values": [1e-5, 2e-5, 4e-5]})
    )
    document = as_dict(scene)
    assert document["material"][0]["thermal_conductivity"][0] == {"value": 130.0, "at": 293.15, "exponent": -1.3}
    assert from_dict(document) == scene
    sink = load("sink", ["materials.silicon.thermal_conductivity={value = 130, at = 293, exponent = -1.3}"])
    assert sink_from(sink_dict(sink)) == sink
    assert distinguishes(sink) != distinguishes(Sink())


def test_a_slope_is_that_of_the_law():
    for law in (PowerLaw(130.0, 293.0, -1.3), Table((300.0, 400.0, 500.0), (130.0, 80.0, 50.0))):
        at = np.array([250.0, 350.0, 470.0, 800.0])
        assert law.slope(at) == pytest.approx((law(at + 1e-3) - law(at - 1e-3)) / 2e-3, rel=1e-6, abs=1e-9)
    assert laws.at((PowerLaw(130.0, 293.0, -1.3), 60.0, Table((1.0, 3.0), (2.0, 4.0))), 293.0) == (130.0, 60.0, 4.0)


def test_a_table_is_linear_between_its_rows_and_constant_outside():
    rows, values = (300.0, 400.0, 450.0, 700.0), (130.0, 80.0, 90.0, 20.0)
    law, at = Table(rows, values), np.linspace(250.0, 750.0, 5001)
    assert law(at) == pytest.approx(np.interp(at, rows, values), rel=1e-12)
    area = np.append(0.0, np.cumsum((law(at[1:]) + law(at[:-1])) / 2 * np.diff(at)))
    assert law.integral(at) - law.integral(250.0) == pytest.approx(area, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("key", "given", "said"),
    [
        ("thermal_conductivity", {"value": 130, "at": 293}, "thermal_conductivity.exponent is missing"),
        ("thermal_conductivity", {**POWER, "at": "0 K"}, "thermal_conductivity.at"),
        ("thermal_conductivity", {**POWER, "value": -1}, "thermal_conductivity.value = -1 is out of range"),
        ("thermal_conductivity", {**POWER, "exponent": 30}, "thermal_conductivity.exponent = 30 is out of range"),
        ("thermal_conductivity", {**POWER, "power": 1}, "unknown key"),
        ("thermal_conductivity", {**TABLE, "values": [1, 2]}, "3 temperatures and 2 values"),
        ("thermal_conductivity", {**TABLE, "values": [1, -2, 3]}, "values[2] = -2 is out of range"),
        ("thermal_conductivity", {**TABLE, "temperatures": [300, 500, 400]}, "temperatures[3] = 400 is not above"),
        ("thermal_conductivity", {**TABLE, "temperatures": [300, 300, 400]}, "temperatures[2] = 300 is not above"),
        ("thermal_conductivity", {"values": [1, 2]}, "thermal_conductivity.temperatures is missing"),
        ("thermal_conductivity", {"temperatures": [300], "values": [1]}, "has one row: give two or more"),
        ("thermal_conductivity", [130, 60], "give a list of 3 values along x, y and z"),
        ("thermal_conductivity", [130, 60, -5], "thermal_conductivity[z] = -5 is out of range"),
        ("thermal_conductivity", -5, "thermal_conductivity = -5 is out of range"),
        ("thermal_conductivity", {**POWER, "exponent": float("nan")}, "exponent = nan is not a finite number"),
        ("thermal_conductivity", {**POWER, "values": [1]}, "give temperatures, values"),
        ("thermal_conductivity", {**POWER, "value": "1 V"}, "is a voltage, not a thermal conductivity"),
        ("thermal_conductivity", {"temperatures": [], "values": []}, "temperatures = [] does not fit: give a list"),
        ("thermal_conductivity", {**TABLE, "values": [130]}, "3 temperatures and 1 values"),
        ("resistivity", [1e-5, 2e-5], "[1e-05, 2e-05] does not fit"),
        ("specific_heat", [700, 700, 700], "is not a specific heat"),
        ("resistivity", {**TABLE, "values": [1e-5, "insulator", 1e-5]}, 'values[2] = "insulator"'),
    ],
)
def test_a_bad_law_is_refused_in_a_sentence(key, given, said):
    assert said in refusal(from_dict, free(**{key: given}))


def test_a_law_of_the_resistivity_and_a_coefficient_are_one_too_many():
    law = {**TABLE, "values": [1e-5, 2e-5, 3e-5]}
    said = "resistivity is a law of the temperature"
    assert said in refusal(from_dict, free(resistivity=law, temperature_coefficient=1e-3))
    settings = ["materials.silicon.resistivity={value = 6e-5, at = 293, exponent = 1}"]
    assert said in refusal(load, "sink", settings)
    sink = load("sink", [*settings, "materials.silicon.temperature_coefficient=0"])
    assert sink.silicon.at(586.0).resistivity == pytest.approx(12e-5)


def test_what_takes_numbers_alone_says_so():
    from reduced1d.ladder import solve
    from reduced1d.network.lines import layout

    sink = load("sink", ["materials.silicon.thermal_conductivity={value = 130, at = 293, exponent = -1.3}"])
    assert solve(sink, steady_only=True).steady == solve(sink.plain, steady_only=True).steady
    along = load("sink", ["materials.silicon.thermal_conductivity=[130, 130, 100]"])
    assert "a 1D model takes one number or law" in refusal(solve, along)
    assert "a network takes one number" in refusal(layout, from_dict(free(thermal_conductivity=[1, 2, 3])))
    for material in ("silicon", "substrate"):
        with pytest.raises(SceneError, match="a device takes one number"):
            load("device", [f"materials.{material}.thermal_conductivity={{value = 130, at = 293, exponent = -1.3}}"])
    assert load("device", ["materials.substrate.thermal_conductivity=[130, 130, 60]"]).kind == "device"
    assert SILICON.follows == ()


def material(**given):
    document = beam()
    del document["material"][0]["resistivity"]
    document["material"][0].update(given)
    return document


@pytest.mark.parametrize("given", [
    17e3, "17 kS/m", {"value": 1e5, "at": 293, "exponent": -1.3},
    {"temperatures": [300, 400, 700], "values": [1e5, 8e4, 2e4]}, [1e5, 2e5, 1e5],
])  # fmt: skip
def test_a_conductivity_is_written_back_as_given(given):
    scene = from_dict(material(electrical_conductivity=given))
    again = json.loads(json.dumps(as_dict(scene)))
    assert "resistivity" not in again["material"][0]
    other = from_dict(again)
    assert other == scene
    assert as_dict(other) == as_dict(scene)
    metal = scene.boxes[0].material.at(300.0)
    assert metal.resistivity == from_dict(again).boxes[0].material.at(300.0).resistivity


def test_a_sink_takes_a_conductivity():
    sink = load("sink", ["materials.silicon.electrical_conductivity=17 kS/m"])
    assert sink.silicon.resistivity == 1 / 17e3
    document = sink_dict(sink)
    assert "resistivity" not in document["materials"]["silicon"]
    assert sink_from(document) == sink
    key = "materials.silicon.electrical_conductivity"
    assert key in numbers(sink)
    assert "materials.silicon.resistivity" not in numbers(sink)
    assert varied(sink, key, 2.0).silicon.resistivity == 1 / 34e3
    assert load("sink", [f"{key}=1", "silicon.resistivity=6e-5"]) == load("sink", ["silicon.resistivity=6e-5"])


def test_resistivity_and_conductivity_exclude_each_other():
    with pytest.raises(SceneError, match="say the same: give one of them"):
        from_dict(material(electrical_conductivity=1, resistivity=1))
    silicon = {"materials": {"silicon": {"electrical_conductivity": 1, "resistivity": 1}}}
    with pytest.raises(SceneError, match="say the same: give one of them"):
        sink_from(silicon)
