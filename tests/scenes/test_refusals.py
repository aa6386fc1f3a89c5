"""Bad scenes: each is refused in one line with the key, the value and the allowed values."""

import re
from dataclasses import replace
from functools import partial

import pytest

from scenes.errors import SceneError
from scenes.keys import SINK
from scenes.loading import builtin_text, check, from_dict
from scenes.loading import load as load_any
from scenes.model import Material
from scenes.sink import OXIDE, SILICON, Sink

load = partial(load_any, scene_type=SINK)


def refusal(call, *arguments):
    """The message of a refusal, which is one sentence on one printable line."""
    with pytest.raises(SceneError) as caught:
        call(*arguments)
    message = str(caught.value)
    assert message.isprintable()
    assert not re.search(r"\w\. ", message)
    assert len(message) < 350
    return message


SIZE = "from 1 nm to 1 m"
REFUSED_SETTINGS = [
    # the setting, and words of the message
    ("sink.width=2 V", 'sink.width = "2 V"', "a voltage, not a length", SIZE),
    ("sink.width=2 A", 'sink.width = "2 A"', "a current, not a length"),
    ("sink.width=20 %", "a plain number, not a length"),
    ("sink.width=20 ym", 'unknown unit "ym"', SIZE),
    ("sink.width=wide", 'sink.width = "wide"', "not a number with a unit", SIZE),
    ("sink.width=none", 'sink.width = "none"', SIZE),
    ("sink.width=0", "sink.width = 0 is out of range", SIZE),
    ("sink.width=20", "sink.width = 20 is out of range", SIZE),
    ("sink.width=1e300", "sink.width = 1e+300 is out of range", SIZE),
    ("sink.width=1e400", "sink.width = inf is not a finite number", SIZE),
    ("sink.width=nan", "sink.width = nan is not a finite number", SIZE),
    ("sink.width=1" + "0" * 400, "sink.width = 1000", "is not a finite number", SIZE),
    ("sink.width=true", "sink.width = true is not a length", SIZE),
    ("sink.width=[1, 2]", "sink.width = [1, 2] is not a length", SIZE),
    ("sink.width={a = 1}", "sink.width = {a = 1} is not a length", SIZE),
    ("sink.width=2020-01-01", "sink.width = 2020-01-01 is not a length", SIZE),
    ('sink.width="a\\nb"', 'sink.width = "a\\nb"', SIZE),
    ("sink.width=\udcff", 'sink.width = "\\udcff"', SIZE),
    ("oxide_thickness=0", "anchor.oxide_thickness = 0", SIZE),
    ("oxide_offset=-1um", 'anchor.oxide_offset = "-1um"', "from 0 m to 1 m", '"centred"'),
    ("oxide_offset=120um", 'anchor.oxide_offset = "120 um"', "anchor.pad_length - anchor.oxide_length", '"100 um"'),
    ("contact_resistance=0", "anchor.contact_resistance = 0 ", "1e-12 m2 K/W", '"perfect"'),
    ("contact_resistance=-1e-7", "anchor.contact_resistance = -1e-07 ", '"perfect"'),
    ("contact_resistance=1e-12 ohm m2", "is an electrical contact resistance, not a thermal contact resistance"),
    ("oxide_length=0.2 mm", 'anchor.oxide_length = "200 um"', 'anchor.pad_length = "150 um"'),
    ("pad_width=40 um", 'anchor.oxide_width = "50 um"', 'anchor.pad_width = "40 um"'),
    ("drive.voltage=abc", 'drive.voltage = "abc"', "in V", "100 uV to 1000 V"),
    ("voltage=0", "drive.voltage = 0 ", "100 uV to 1000 V", "no relative error is defined"),
    ("drive.series_resistance=-5", "drive.series_resistance = -5 is out of range"),
    ("drive.current=3V", "is a voltage, not a current"),
    ("drive={current=3e-3,series_resistance=5}", "drive.series_resistance = 5 ", "drive.current: give one of them"),
    ("environment.emissivity=2", "environment.emissivity = 2 is out of range"),
    ("silicon.thermal_conductivity={temperatures=[400,300],values=[130,5]}", "temperatures[2] = 300 is not above"),
    ("electrodes=pad-egde", 'drive.electrodes = "pad-egde"', '"beam-end" or "pad-edge", did you mean "pad-edge"?'),
    ("accuracy=0", "run.accuracy = 0 ", "from 1e-6 to 0.1"),
    ("accuracy=1e-7", "run.accuracy = 1e-07 ", "from 1e-6 to 0.1"),
    ("accuracy=1 um", 'run.accuracy = "1 um" is a length', "from 1e-6 to 0.1"),
    ("end_time=0", "run.end_time = 0 ", "from 1 ns"),
    ("silicon.density=0", "materials.silicon.density = 0 ", "kg/m3"),
    ("silicon.thermal_conductivity=0", "materials.silicon.thermal_conductivity = 0 ", "W/(m K)"),
    ("oxide.specific_heat=0", "materials.oxide.specific_heat = 0 ", "J/(kg K)"),
    ("silicon.resistivity=0", "materials.silicon.resistivity = 0 ", "ohm m"),
    ("silicon.resistivity=insulator", 'materials.silicon.resistivity = "insulator" ', "ohm m"),
    ("oxide.resistivity=1", "materials.oxide.resistivity = 1 ", '"insulator"', "no current"),
    ("substrate.thickness=0", "substrate.thickness = 0 ", SIZE, '"none"'),
    ("substrate.length=2mm", 'substrate.length = "2 mm" is of no substrate', "substrate.thickness"),
    ("substrate={thickness=1e-3, length=1e-3}", 'substrate.length = "1 mm"', 'give at least "1.2 mm"'),
    ("substrate={thickness=1e-3, width=10e-6}", 'substrate.width = "10 um"', 'least "50 um", anchor.oxide_width'),
    ("substrate.thicknes=1mm", "unknown key substrate.thicknes", 'did you mean "substrate.thickness"?'),
    ("substrate.thickness=2 K", "is a temperature, not a length"),
    ("room_temperature=0", "environment.room_temperature = 0 ", "from 1 K"),
    ("room_temperature=-300 degC", 'environment.room_temperature = "-300 degC" ', "from 1 K"),
    ("silicon.temperature_coefficient=0.01 1/K", "silicon.temperature_coefficient = ", "= 150.0 K", "above 0"),
    ("convection_coefficient=-1", "environment.convection_coefficient = -1 ", "from 0 W/(m2 K)"),
    ("name=../x", 'scene.name = "../x" ', "letters, digits"),
    ("name=", "name=", "KEY=VALUE"),
    ("name=1", "scene.name = 1 ", "letters, digits"),
    ("name=" + "x" * 61, 'scene.name = "xxx', "1 to 60 letters"),
    ("sink.width", '"sink.width" sets nothing', "KEY=VALUE"),
    ("width=1e-5\nlength=1e-4", 'sink.width = "1e-5\\nlength=1e-4"', SIZE),
    ("=3", '"=3" sets nothing', "KEY=VALUE"),
    ("sink.widht=3", "unknown key sink.widht = 3", "length, width, thickness", 'did you mean "sink.width"?'),
    ("sink.voltage=3", "unknown key sink.voltage = 3", 'did you mean "drive.voltage"?'),
    ("snik.width=3", "unknown key snik.width = 3", 'did you mean "sink.width"?'),
    ("materials.oxid.density=3", "unknown key materials.oxid.density", '"materials.oxide.density"?'),
    ("sink=5", "sink = 5 must be a section", "length, width, thickness"),
    ("density=5", "density could mean any of", "materials.silicon.density, materials.oxide.density"),
    ("checks.tolerances=0.1", "checks.tolerances = 0.1 must be a table"),
    ("tolerances.eq12=0", "checks.tolerances.eq12 = 0 "),
    ("tolerances.eq15=0.1", 'checks.tolerances names an unknown check "eq15"', '"eq12", "eq13"', "did you mean"),
    ("expect_differs=eq15", 'checks.expect_differs names an unknown check "eq15"', '"eq12", "eq13"', "did you mean"),
    ("expect_differs=5", "checks.expect_differs = 5 must be a list"),
    ("expect_differs=[5]", "checks.expect_differs names an unknown check 5", '"eq12", "eq13"'),
]  # fmt: skip


@pytest.mark.parametrize(("setting", "parts"), [(s, p) for s, *p in REFUSED_SETTINGS], ids=lambda x: repr(x)[:40])
def test_a_refused_override_says_what_is_allowed(setting, parts):
    settings = ["room_temperature=150 K", setting] if "0.01 1/K" in setting else [setting]
    message = refusal(load, "sink", settings)
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("[sink]\nwidth = '2 V'\n", ['sink.width = "2 V"', "a length"]),
        ("[snik]\nwidth = 1\n", ["unknown key snik", 'did you mean "sink"?']),
        ("[materials.silicone]\ndensity = 1\n", ["unknown key materials.silicone", '"materials.silicon"?']),
        ("[materials]\nsilicon = 3\n", ["materials.silicon = 3 must be a section", "thermal_conductivity"]),
        ("[[box]]\nname = 'a'\n", ["is a free scene: validate solve"]),
        ("[[sink]]\nwidth = 1\n", ["sink = [{width = 1}] must be a section"]),
        ("voltage = 2\n", ["unknown key voltage = 2", 'did you mean "drive.voltage"?']),
        ("[sink]\n'a\\nb' = 2\n", ["unknown key sink.a", "length, width"]),
        ("[sink]\nwidth = 20 um\n", ["not valid TOML", "line 2, column 12"]),
        ("[sink]\nwidth = 1\nwidth = 2\n", ["not valid TOML", "line 3"]),
        ("a = " + "[" * 5000, ["not valid TOML"]),
        ("a = " + "1" * 5000, ["not valid TOML"]),
    ],
)
def test_a_refused_file_says_where_and_why(tmp_path, text, parts):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    message = refusal(load, path)
    for part in parts:
        assert part in message


def test_what_is_no_scene_file_is_refused_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"# \xb5m\n")
    assert refusal(load, "snik") == '"snik" is no file: give a TOML file, or the built-in sink, did you mean "sink"?'
    assert '"missing/a.toml" is no file' in refusal(load, "missing/a.toml")
    assert '"." cannot be read' in refusal(load, ".")
    assert '"latin.toml" cannot be read as UTF-8 text' in refusal(load, "latin.toml")
    assert "cannot be read" in refusal(load, "a\0b")
    assert "cannot be read" in refusal(load, "a" * 5000)
    assert 'give "sink"' in refusal(builtin_text, "snk")


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"width": float("nan")}, ["sink.width = nan"]),
        ({"width": "20 um"}, ['sink.width = "20 um" must be given as 2e-05 in Python']),
        ({"width": None}, ["sink.width = None is not a length"]),
        ({"width": True}, ["sink.width = true is not a length"]),
        ({"oxide_length": 1e-3}, ["anchor.oxide_length", "anchor.pad_length"]),
        ({"silicon": replace(SILICON, resistivity=None)}, ["silicon.resistivity = None is not a resistivity"]),
        ({"oxide": replace(OXIDE, resistivity=1e13)}, ["materials.oxide.resistivity", "given as None"]),
        ({"oxide": SILICON}, ["materials.oxide.resistivity = 6e-05", '"insulator"']),
        ({"tolerances": {"eq1": 0.1}}, ["checks.tolerances", "eq12"]),
        ({"tolerances": None}, ["checks.tolerances"]),
        ({"expected_to_differ": ("eq1",)}, ["checks.expect_differs", "eq12"]),
        ({"name": "a/b"}, ["scene.name"]),
        ({"electrodes": "pad"}, ["drive.electrodes", "pad-edge"]),
    ],
)
def test_a_sink_made_in_python_is_checked_as_a_file_is(changes, parts):
    message = refusal(check, replace(Sink(), **changes))
    for part in parts:
        assert part in message


def test_a_refused_dictionary():
    assert "unknown key sink.widht" in refusal(from_dict, {"sink": {"widht": 1}})


@pytest.mark.parametrize("changes", [
    {"width": 300e-6}, {"oxide_length": 150e-6, "oxide_width": 150e-6}, {"oxide_offset": 0.0}, {"voltage": -1.0},
    {"pad_length": 150e-6, "oxide_length": 50e-6, "oxide_offset": 100e-6}, {"voltage": 2}, {"accuracy": 0.1},
    {"convection_coefficient": 0}, {"accuracy": 1e-6}, {"width": 1e-9}, {"length": 1.0},
    {"silicon": Material("doped", 100.0, 2330.0, 712.0, 1e-4, -1e-3, 293.0)},
])  # fmt: skip
def test_what_can_be_solved_is_accepted(changes):
    sink = replace(Sink(), **changes)
    assert check(sink) is sink


def test_numbers_of_numpy_are_numbers():
    numpy = pytest.importorskip("numpy")
    assert check(Sink(voltage=numpy.float64(2), length=numpy.int64(1)))


@pytest.mark.parametrize(("kind", "override", "said"), [
    *(("sink", f"sink.spans={n}", "must be a whole number from 1 to 100") for n in ("0", "2.5", "1e6", "true", "two")),
    ("sink", "sink.island_length=1.1mm", "longer than a span"), ("device", "sink.spans=2", "give 1"),
    ("device", "sensor_thickness=0", "device.sensor_thickness = 0 is out of range"),
    ("device", "sample_time=0", "control.sample_time = 0 is out of range"),
    ("device", "sink_gain=-1", "control.sink_gain = -1 is out of range"),
    ("device", "sink_gain=1 K", "is a temperature, not a voltage"),
    ("device", "pdms.resistivity=10e-12", "for no current is modelled in this material"),
    ("device", "polymer_thicknes=1um", 'did you mean "device.polymer_thickness"'),
    ("device", "checks.expect_differs=eq14", 'unknown check "eq14"'),
    ("device", "oxide_length=1mm", "stick out of its pad"),
])  # fmt: skip
def test_rows_and_devices_that_cannot_be(kind, override, said):
    with pytest.raises(SceneError) as caught:
        load_any(kind, [override] if kind == "device" else ["sink.spans=2", override])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
