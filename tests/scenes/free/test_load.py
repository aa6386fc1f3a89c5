"""Reading free scenes: units, defaults, values that vary in time, overrides, and writing them back."""

import copy
import json
import tomllib
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import physics
from scenes.errors import SceneError
from scenes.free import as_dict, from_dict
from scenes.free.rules import checked
from scenes.free.tables import as_toml
from scenes.loading import builtin_text, examples
from scenes.loading import load_free as load
from scenes.model import Contact, Schedule
from scenes.sink import Sink
from tests.scenes.free.refused import beam

BAR = """
run.steady = true
material = [{name = "silicon", thermal_conductivity = 130}]
box = [{material = "silicon", lower = [0, 0, 0], upper = ["1 mm", "100 um", 2e-6]}]
boundary = [
  {lower = [0, 0, 0], upper = [0, 1, 1], temperature = "20 degC"},
  {name = "hot end", lower = ["1 mm", 0, 0], upper = ["1 mm", "100 um", "2 um"], heat_flux = "1 W/m2"},
]
probe = [{name = "end", at = ["1 mm", "50 um", "1 um"]}]
"""


def bar() -> dict:
    return tomllib.loads(BAR)


@pytest.mark.parametrize("name", examples())
def test_examples_read_and_come_back(name):
    scene = load(name)
    assert scene.name == name
    assert from_dict(json.loads(json.dumps(as_dict(scene)))) == scene
    assert from_dict(tomllib.loads(as_toml(scene))) == scene


def test_example_differs_from_an_edited_one(tmp_path):
    (tmp_path / "mine.toml").write_text(builtin_text("bridge").replace('"200 um"', '"210 um"'), encoding="utf-8")
    assert load(tmp_path / "mine.toml").boxes[0].upper[1] == 210e-6


def test_units_defaults_and_names():
    scene = from_dict(bar(), "bar")
    box, first, second = scene.boxes[0], *scene.boundaries
    assert (scene.name, box.name, first.name, second.name) == ("bar", "box-1", "boundary-1", "hot end")
    assert box.upper == (1e-3, 100e-6, 2e-6)
    assert (first.kind, first.value) == ("temperature", 293.15)
    assert (second.kind, second.value) == ("heat_flux", 1.0)
    assert (scene.initial_temperature, scene.accuracy, scene.steady) == (293.0, 1e-3, True)
    assert scene.probes[0].quantity == "temperature"


def test_what_the_scene_does_not_need_may_be_left_out_and_is_not_written():
    scene = from_dict(bar())
    assert not physics.electric(scene)
    assert physics.heat(scene)
    assert "density" not in physics.needed(scene)
    (material,) = as_dict(scene)["material"]
    assert material == {"name": "silicon", "thermal_conductivity": 130.0, "resistivity": "insulator"}


def electric(steady: bool = True, coefficient: float = 0.0) -> dict:
    """A bar with a probe of its resistance alone."""
    found = bar()
    found["material"] = [{"name": "silicon", "resistivity": 6e-5, "temperature_coefficient": coefficient}]
    found["run"] = {"steady": True} if steady else {"end_time": 1e-3}
    for boundary, voltage in zip(found["boundary"], (1, 0), strict=True):
        for key in ("temperature", "heat_flux"):
            boundary.pop(key, None)
        boundary["voltage"] = voltage
    found["probe"] = [{"name": "i", "quantity": "current", "lower": [0, 0, 0], "upper": [0, 1e-4, 2e-6]}]
    return found


def test_electric_scene_needs_no_thermal_data_until_its_resistivity_follows_the_temperature():
    scene = from_dict(electric())
    assert physics.electric(scene)
    assert not physics.heat(scene)
    assert not physics.heat(from_dict(electric(coefficient=1e-3)))
    assert not physics.heat(from_dict(electric(steady=False)))
    with pytest.raises(SceneError, match=r'material "silicon".thermal_conductivity is missing'):
        from_dict(electric(steady=False, coefficient=1e-3))


def test_values_that_vary_in_time():
    document = bar()
    document["run"] = {"output_times": ["2 ms", 1e-3]}
    document["material"][0] |= {"density": 2330, "specific_heat": 712}
    document["boundary"][1]["heat_flux"] = {"times": [0, "1 us", 1e-6, 1, 1 + 4e-16], "values": [0, "2 W/m2", 3, 3, 4]}
    document["box"][0]["heat_source"] = {"times": [0], "values": ["1e9 W/m3"]}
    scene = from_dict(document)
    assert scene.boundaries[1].value == Schedule((0.0, 1e-6, 1e-6, 1.0, 1.0), (0.0, 2.0, 3.0, 3.0, 4.0))
    assert scene.boxes[0].heat_source == Schedule((0.0,), (1e9,))
    assert (scene.end_time, scene.output_times) == (2e-3, (1e-3, 2e-3))
    # One time, reckoned in two ways.
    document["run"] = {"output_times": [0.1 + 0.2], "end_time": 0.3}
    assert from_dict(document).end_time == 0.1 + 0.2 > 0.3
    document["run"] = {"output_times": [0.3], "end_time": 0.1 + 0.2}
    assert from_dict(document).end_time == 0.3
    assert from_dict(as_dict(scene)) == scene


def test_overrides_reach_items_by_name():
    scene = load(
        "bridge",
        [
            "run.accuracy=1e-4", "scene.initial_temperature=20 degC", "material.polysilicon.resistivity=1e-5 ohm m",
            "boundary.left electrode.voltage=5", "box.beam.heat_source={times=[0, 1], values=[0, 1]}",
            "run.steady=false", "run.end_time=1ms", "probe.middle.reduce=max", "material.oxide.density=2200",
            "material.oxide.specific_heat=700", "material.polysilicon.density=2330",
            "material.polysilicon.specific_heat=700",
        ],
    )  # fmt: skip
    assert (scene.accuracy, scene.initial_temperature, scene.end_time) == (1e-4, 293.15, 1e-3)
    assert scene.boxes[0].material.resistivity == 1e-5
    assert scene.boxes[0].heat_source == Schedule((0.0, 1.0), (0.0, 1.0))
    assert scene.boundaries[1].value == 5.0
    assert scene.probes[0].reduce == "max"
    cooler = load("plate", ["boundary.right.convection.coefficient=10"])
    assert [b.value for b in cooler.boundaries] == [373.15, 10.0, 750.0]
    assert cooler.boundaries[1].ambient == 273.15


def test_corners_that_differ_by_rounding_are_made_equal():
    document = bar()
    document["box"].append(
        {"material": "silicon", "lower": [0.7e-3 + 0.3e-3 + 1e-16, 0, 0], "upper": [2e-3, 1e-4, 2e-6]}
    )
    document["boundary"][1] |= {"lower": [2e-3 + 1e-15, 0, 0], "upper": [2e-3, 1e-4, 2e-6]}
    scene = from_dict(document)
    assert scene.boxes[1].lower[0] == scene.boxes[0].upper[0] == scene.probes[0].lower[0]
    assert scene.boundaries[1].lower == (2e-3, 0.0, 0.0)
    assert scene.boundaries[0].upper == (0.0, 1e-4, 2e-6)
    assert from_dict(as_dict(scene)) == scene


ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.floats(), st.text(max_size=6), st.just([]), st.just({}),
    st.sampled_from(["1 um", "20 degC", "1e400 V", "beam", "oxide", "mean", "max", "heat_flow", "current"]),
    st.lists(st.sampled_from([0, 2e-6, 1e-5, "3 um", None, float("nan")]), min_size=3, max_size=3),
    st.just({"times": [0, 0, 1], "values": [0, 1, 2]}), st.just({"coefficient": 1, "ambient": 300}),
)  # fmt: skip
KEYS = ("name", "material", "lower", "upper", "at", "voltage", "temperature", "heat_flux", "convection", "heat_source",
        "quantity", "reduce", "resistivity", "density", "steady", "end_time", "output_times", "accuracy")  # fmt: skip
CHANGE = st.tuples(
    st.sampled_from(("scene", "run", "material", "box", "boundary", "probe")), st.integers(0, 3), st.sampled_from(KEYS),
    ODD,
)  # fmt: skip
BRIDGE = as_dict(load("bridge"))


@pytest.mark.long
@settings(max_examples=40, deadline=None)
@given(st.lists(CHANGE, min_size=1, max_size=4))
def test_every_document_is_a_scene_or_is_refused_in_one_line(changes):
    document = copy.deepcopy(BRIDGE)
    for table, number, key, value in changes:
        items = document[table]
        (items[number % len(items)] if isinstance(items, list) else items)[key] = value
    message = ""
    try:
        scene = from_dict(document)
    except SceneError as error:
        message = str(error)
    else:
        assert from_dict(as_dict(scene)) == scene
    assert message.isprintable()
    assert len(message) < 400


SINKS = [
    Sink(), Sink(electrodes="pad-edge"), Sink(convection_coefficient=10.0), Sink(width=400e-6),
    Sink(contact_resistance=1e-7), Sink(contact_resistance=1e-7, spans=3),
    Sink(oxide_offset=0.0), Sink(oxide_thickness=20e-9),
]  # fmt: skip


@pytest.mark.parametrize("sink", SINKS)
def test_the_sink_is_a_free_scene(sink):
    scene = checked(sink.scene())
    assert from_dict(as_dict(scene)) == scene
    assert from_dict(tomllib.loads(as_toml(scene))) == scene
    assert checked(replace(scene, steady=True)).steady


def test_a_sink_without_its_substrate_is_not():
    scene = replace(Sink().scene(), steady=True)
    with pytest.raises(SceneError, match="without an exit for heat"):
        checked(replace(scene, boundaries=tuple(b for b in scene.boundaries if b.kind == "voltage")))


def test_contacts_and_sides_of_probes_come_back():
    document = bar()
    document["probe"] = [{"name": "end", "at": [1e-3, 0, 0], "box": "box-1"}]
    tip = {"name": "tip", "material": "silicon", "lower": ["1 mm", 0, 0], "upper": ["2 mm", 1e-4, 2e-6]}
    document["box"].append(tip)
    document["boundary"][1] |= {"lower": ["2 mm", 0, 0], "upper": ["2 mm", 1e-4, 2e-6]}
    document["contact"] = [{"name": "c", "between": ["box-1", "tip"], "thermal_resistance": "1e-7 m2 K/W"}]
    scene = from_dict(document)
    assert scene.contact(1, 0) == scene.contacts[0] == Contact("c", ("box-1", "tip"), 1e-7, 0.0)
    assert scene.probes[0].boxes == ("box-1",)
    assert from_dict(json.loads(json.dumps(as_dict(scene)))) == scene
    assert from_dict(tomllib.loads(as_toml(scene))) == scene
    more = from_dict(document, overrides=["contact.c.thermal_resistance=2e-7 m2 K/W"])
    assert more.contacts[0].thermal_resistance == 2e-7


@pytest.mark.parametrize(("given_keys", "names"), [
    ({"reduce": "max"}, ("beam", "foot")), ({"reduce": "min", "material": "oxide"}, ("foot",)),
    ({"boxes": ["foot", "beam"]}, ("foot", "beam")), ({"reduce": "max", "boxes": ["beam"]}, ("beam",)),
])  # fmt: skip
def test_a_probe_without_a_place_reads_parts(given_keys, names):
    document = beam()
    document["probe"].append({"name": "hottest", **given_keys})
    scene = from_dict(document)
    assert scene.probes[1].boxes == names
    assert from_dict(as_dict(scene)) == scene


@pytest.mark.parametrize(("given_keys", "said"), [
    ({}, "has no place"), ({"boxes": ["bem"]}, 'did you mean "beam"'), ({"material": "oxid"}, 'did you mean "oxide"'),
    ({"boxes": ["beam"], "material": "oxide"}, "has boxes and material: give one"),
    ({"boxes": ["beam"], "at": [0, 0, 0]}, "has at and boxes"),
    ({"reduce": "max", "quantity": "potential"}, "needs a place"), ({"boxes": []}, "give a list of boxes"),
])  # fmt: skip
def test_a_bad_region_of_a_probe_is_refused(given_keys, said):
    document = beam()
    document["probe"].append({"name": "hottest", **given_keys})
    with pytest.raises(SceneError, match=said):
        from_dict(document)
