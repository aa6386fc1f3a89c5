"""Parameters of scene files: one moves all values that use it, however it is changed; refusals."""

import json
from dataclasses import replace

import pytest

from scenes import free
from scenes.errors import SceneError
from scenes.keys import DEVICE
from scenes.loading import as_dict, from_dict, load, load_free, overridden, written
from scenes.model import Schedule
from scenes.parameters import Names
from scenes.sink import Sink
from scenes.uncertain import read
from scenes.varied import made_of_parameters, neighbour, numbers, varied

STEP = 2.0**-14
BAR = """
box = [{name = "bar", material = "m", lower = [0, 0, 0], upper = ["w", "L", "half"]}]
boundary = [
    {name = "cold", lower = [0, 0, 0], upper = [1, 0, 1], temperature = "T0"},
    {name = "in", lower = [0, 0, 0], upper = ["w", 0, "half"], voltage = "U"},
    {name = "out", lower = [0, "L", 0], upper = ["w", "L", "half"], voltage = 0},
]
probe = [{name = "end", at = ["w/2", "L", "half/2"]}]
[parameters]
L = "100 um"
w = "10 um"
half = "w/2"
n = 2
rho = "1e-5 ohm m"
T0 = "20 degC"
U = "1 V"
[scene]
initial_temperature = "T0"
[[material]]
name = "m"
thermal_conductivity = "100 W/(m K)*n"
resistivity = "rho"
[run]
steady = true
"""
SINK = {
    "parameters": {"w": "100 um", "ratio": 1.5, "U": "2 V"},
    "sink": {"width": "w"}, "anchor": {"pad_width": "ratio*w", "oxide_width": "max(w/2, 1 um)"},
    "drive": {"voltage": "U/2"},
}  # fmt: skip


@pytest.fixture
def bar(tmp_path):
    (tmp_path / "bar.toml").write_text(BAR, encoding="utf-8")
    return tmp_path / "bar.toml"


@pytest.mark.parametrize("name", ["bridge", "plate", "hotplate"])
def test_an_example_is_what_its_numbers_say(name):
    """A document of numbers alone, through JSON, is the same scene; and none of its planes is off by rounding."""
    scene = load(name)
    assert scene.parameters
    assert free.from_dict(json.loads(json.dumps(free.as_dict(scene))), name) == scene
    corners = [c for box in scene.boxes for c in (*box.lower, *box.upper)]
    assert all(float(f"{c:.12g}") == c for c in corners)


def test_a_parameter_moves_all_that_is_made_of_it(bar):
    scene = load_free(bar, ["parameters.w=12um"])
    assert scene.boxes[0].upper == (12e-6, 100e-6, 6e-6)
    assert scene.boundaries[2].upper == (12e-6, 100e-6, 6e-6)
    assert scene.probes[0].lower == (6e-6, 100e-6, 3e-6)
    assert free.as_dict(scene)["parameters"] == {
        "L": 1e-4, "w": 12e-6, "half": 6e-6, "n": 2.0, "rho": 1e-5, "T0": 293.15, "U": 1.0,
    }  # fmt: skip
    assert load_free(bar, ["parameters.w=1.2e-5 m"]) == scene
    assert load_free(bar, ["parameters.half=6um", "parameters.w=12um"]) == scene
    assert load_free(bar, ["parameters.half=w"]).boxes[0].upper == (10e-6, 100e-6, 10e-6)


def test_a_changed_scene_keeps_its_changes(bar):
    scene = replace(load_free(bar), accuracy=1e-2)
    other = overridden(scene, ["parameters.w=12um"])
    assert (other.accuracy, other.boxes) == (1e-2, load_free(bar, ["parameters.w=12um"]).boxes)
    again = overridden(other, ["parameters.L=50um"])
    assert again.boxes[0].upper == (12e-6, 50e-6, 6e-6)
    assert written(load_free(bar))["box"][0]["upper"] == ["w", "L", "half"]
    assert written(scene)["box"][0]["upper"] == [10e-6, 100e-6, 5e-6]


def test_varied_by_a_factor(bar):
    scene = load_free(bar)
    wider = varied(scene, "parameters.w", 1.2)
    assert wider == load_free(bar, ["parameters.w=12um"])
    both = varied(varied(scene, "material.m.resistivity", 2.0), "parameters.w", 1.2)
    assert both.boxes[0].material.resistivity == 2e-5
    assert both.boxes[0].upper == wider.boxes[0].upper
    assert varied(wider, "parameters.w", 1 / 1.2).boxes == scene.boxes


def test_a_neighbour_is_of_first_order_and_run_alike(tmp_path):
    """A heat source in inverse proportion to the square of a width has minus twice its value as derivative."""
    text = BAR.replace('upper = ["w", "L", "half"]', 'upper = ["w", "L", "half"], heat_source = "1e2 W/m/w**2"', 1)
    text = text.replace("steady = true", 'end_time = "1 s/n"').replace("[run]", "density = 1\nspecific_heat = 1\n[run]")
    (tmp_path / "bar.toml").write_text(text, encoding="utf-8")
    scene = load_free(tmp_path / "bar.toml")
    for step in (STEP, -STEP):
        there = neighbour(scene, "parameters.w", step)
        assert not isinstance(there.boxes[0].heat_source, Schedule)
        slope = (there.boxes[0].heat_source / scene.boxes[0].heat_source - 1) / step
        # The difference quotient of varied scenes is off by 3/2 of the step, 1e-4; this one by its square.
        assert slope == pytest.approx(-2.0, rel=10 * STEP**2)
    other = neighbour(scene, "parameters.n", STEP)
    assert other.boxes[0].material.thermal_conductivity == pytest.approx(200 * (1 + STEP), rel=1e-12)
    assert other.end_time == scene.end_time == 0.5


def test_numbers_are_the_free_parameters_that_move_something(bar):
    found = {key.removeprefix("parameters.") for key in numbers(load_free(bar)) if key.startswith("parameters.")}
    assert found == {"L", "w", "n", "rho", "T0", "U"}
    idle = load_free(bar, ["box.bar.upper.x=10um", "parameters.half=5um"])
    assert "parameters.half" in numbers(idle)
    (bar.parent / "idle.toml").write_text(
        BAR.replace("[parameters]", '[parameters]\nidle = "1 um"\nzero = "0 um"'), encoding="utf-8"
    )
    assert not {"parameters.idle", "parameters.zero"} & set(numbers(load_free(bar.parent / "idle.toml")))


def test_a_sink_and_a_device_take_parameters():
    sink = from_dict(SINK)
    assert (sink.width, sink.pad_width, sink.oxide_width, sink.voltage) == (100e-6, 150e-6, 50e-6, 1.0)
    assert sink == Sink()
    assert as_dict(sink)["parameters"] == {"w": 100e-6, "ratio": 1.5, "U": 2.0}
    assert from_dict(as_dict(sink)) == sink
    wide = overridden(sink, ["parameters.w=0.2mm"])
    assert (wide.width, wide.pad_width, wide.voltage) == (200e-6, 300e-6, 1.0)
    assert "parameters" not in as_dict(Sink())
    device = from_dict(SINK | {"control": {"sink_gain": "U"}}, DEVICE)
    assert (device.sink.pad_width, device.control.sink_gain) == (150e-6, 2.0)
    assert varied(device, "parameters.w", 2.0).sink.oxide_width == 100e-6


def test_what_a_sink_expects_is_withdrawn_by_a_parameter(tmp_path):
    (tmp_path / "sink.toml").write_text(
        'checks.expect_differs = ["eq14"]\nsink.width = "w"\nparameters.w = "0.1 mm"\n', encoding="utf-8"
    )
    assert load(tmp_path / "sink.toml").expected_to_differ == ("eq14",)
    assert load(tmp_path / "sink.toml", ["parameters.w=0.2mm"]).expected_to_differ is None


def test_times_and_tables_are_made_of_parameters(tmp_path):
    text = BAR.replace('voltage = "U"', 'voltage = { times = ["tau", "2*tau"], values = [0, "U"] }')
    text = text.replace("steady = true", 'end_time = "5*tau"\noutput_times = ["tau", "3*tau"]')
    text = text.replace("[run]", "density = 1\nspecific_heat = 1\n[run]").replace("n = 2", 'n = 2\ntau = "1 ms"')
    (tmp_path / "bar.toml").write_text(text, encoding="utf-8")
    scene = load_free(tmp_path / "bar.toml", ["parameters.tau=2ms"])
    assert scene.boundaries[1].value == Schedule((2e-3, 4e-3), (0.0, 1.0))
    assert (scene.end_time, scene.output_times) == (10e-3, (2e-3, 6e-3))
    assert load_free(tmp_path / "bar.toml", ["run.end_time=2*tau"]).output_times == (1e-3,)
    assert load("sink", ["sink.spans=1+2"]).spans == 3


def test_uncertainties_of_parameters(bar):
    found = read(load_free(bar), ["parameters.w=0.1um", "T0=2K"]).relative
    assert found == {"parameters.w": pytest.approx(0.01), "parameters.T0": pytest.approx(2 / 293.15)}


@pytest.mark.parametrize(("given", "said"), [
    ({"a": "b", "b": "c", "c": "a"}, "parameters.a is made of itself, a of b, b of c, c of a"),
    ({"a": "a + 1 um"}, "parameters.a is made of itself, a of a"),
    ({"wid": "1 um", "b": "width/2"}, 'parameters.b = "width/2" names no parameter "width", did you mean "wid"'),
    ({"a": "2 um", "b": "a + 2 K"}, 'parameters.b = "a + 2 K" adds or compares a length and a temperature'),
    ({"a": "1/0"}, 'parameters.a = "1/0" divides by zero'), ({"a": "9**9**9"}, "exponent beyond"),
    ({"a": True}, "not a number"), ({"a": [1, 2]}, "not a number"),
    ({"a": float("nan")}, "not a number"), ({"a": "1e999 um"}, "not a finite number"),
    ({"a": 10**400}, "not a finite number"), ({"a": ""}, "not a number"),
    ({"V": "1 V"}, "called like a unit"), ({"min": 1}, "called like a function"),
    ({"lambda": "1 um"}, "a word of Python: give another name, such as lambda_0"),
    ({"a b": 1}, "is no name"), ({"2a": 1}, "is no name"), ({"a": "x" * 600}, "longer than"), (3, "must be a section"),
])  # fmt: skip
def test_a_bad_section_is_refused(given, said):
    with pytest.raises(SceneError) as found:
        Names(given)
    assert said in str(found.value)
    assert "\n" not in str(found.value)


def test_a_long_row_of_parameters_in_order_is_fine():
    row = {"x0": "1 um"} | {f"x{i + 1}": f"x{i} + 1 um" for i in range(1000)}
    for order in (row, dict(reversed(row.items()))):
        assert float(Names(order)["x1000"].value) == 1001e-6
        assert list(Names(order)) == list(order)


def test_plain_number_takes_the_unit_of_the_file_in_si(bar):
    one, other = (load_free(bar, [f"parameters.U={given}"]) for given in ("0.3", "0.3 V"))
    assert one.boundaries == other.boundaries
    assert one != load_free(bar)


@pytest.mark.parametrize(("settings", "said"), [
    (["parameters.x=3um"], 'the [parameters] of this scene have no "x": give "L", "w", "half", "n", "rho"'),
    (["parameters.w=3 K"], "is a temperature, not a length"), (["parameters.w=1e999"], "parameters.w = inf"),
    (["parameters.w=-3um"], "negative extent"), (["parameters.w=0 um"], "no extent"),
    (["parameters.w=20"], "is a plain number, not a length"),
    (["parameters.w=2*w"], "made of itself"), (["parameters=3"], "must be a section"),
    (["parameters.w.x=3"], 'have no "w.x"'), (["box.bar.upper.x=w*w"], '"w*w" is a quantity in m2, not a length'),
    (["box.bar.upper.x=W"], 'names no parameter "W", did you mean "w"'),
    (["box.bar.upper.x=n"], "is a plain number, not a length"),
    (["box.bar.upper.x=w*1e12"], '"w*1e12" = 1e+7 m is out of range'),
    (["run.accuracy=n"], '"n" = 2 is out of range'), (["parameters.T0=-1 K"], '"T0" = -1 K is out of range'),
    (["box.bar.upper.x=max(w, T0)"], "compares a length and a temperature"),
])  # fmt: skip
def test_a_bad_override_is_refused(settings, said, bar):
    with pytest.raises(SceneError) as found:
        load_free(bar, settings)
    assert said in str(found.value)
    assert "\n" not in str(found.value)


def test_the_end_of_a_parameters_key_is_enough(bar):
    assert load_free(bar, ["w=3um"]) == load_free(bar, ["parameters.w=3um"]) != load_free(bar)
    with pytest.raises(SceneError, match="unknown key half_width"):
        load_free(bar, ["half_width=3um"])


@pytest.mark.parametrize(("given", "said"), [
    ("parameters.half=1%", 'is made of others, or moves nothing: give parameters.L, parameters.w'),
    ("parameters.x=1%", 'names no number of this scene: "parameters.x": give "parameters.'),
    ("parameters.w=1K", "neither in percent nor in the key's unit"),
])  # fmt: skip
def test_a_bad_uncertainty_is_refused(given, said, bar):
    with pytest.raises(SceneError) as found:
        read(load_free(bar), [given])
    assert said in str(found.value)


def test_a_scene_without_the_section_says_so():
    with pytest.raises(SceneError, match="of this scene have no"):
        load("sink", ["parameters.w=3um"])
    with pytest.raises(SceneError, match="is not a number with a unit"):
        load("sink", ["sink.width=wide"])


@pytest.mark.parametrize("name", ["V0", "A0", "s0", "m1", "W1", "W2", "K1", "F0", "J0", "S1", "m2"])
def test_a_unit_with_digits_names_a_parameter(name):
    names = Names({name: "3 um", "twice": f"2*{name}"})
    assert float(names["twice"].value) == 6e-6


def test_a_unit_that_is_a_parameter_too_is_refused():
    with pytest.raises(SceneError, match=r'has "m2", a unit and a parameter: write m\*\*2 for the unit'):
        Names({"m2": "3 um", "flux": "5 W/m2"})
    assert float(Names({"m2": "3 um", "flux": "5 W/m**2"})["flux"].value) == 5.0


def test_keys_made_of_parameters(bar):
    made = made_of_parameters(load_free(bar))
    assert {"material.m.resistivity", "boundary.in.voltage", "box.bar.upper.x", "scene.initial_temperature"} & made == {
        "material.m.resistivity", "boundary.in.voltage", "box.bar.upper.x"
    }  # fmt: skip
    assert not {"box.bar.lower.x", "boundary.out.voltage", "parameters.w"} & made
    sink = from_dict({"parameters": {"w": "90 um"}, "sink": {"width": "w"}})
    assert made_of_parameters(sink) == {"sink.width"}
