"""An electrical conductivity in place of a resistivity: the same laws, exact between the rows of a table."""

import json

import pytest

from scenes.errors import SceneError
from scenes.free import as_dict, from_dict
from scenes.loading import as_dict as as_sections
from scenes.loading import from_dict as from_sections
from scenes.loading import load
from scenes.varied import numbers, varied
from tests.scenes.free.refused import beam


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
    document = as_sections(sink)
    assert "resistivity" not in document["materials"]["silicon"]
    assert from_sections(document) == sink
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
        from_sections(silicon)
