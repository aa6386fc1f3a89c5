"""The device as a scene file: every key, the built-in text, withdrawn keys and the name."""

import json
import re
import tomllib
from dataclasses import replace

import pytest

from scenes.device import Control, Device, External
from scenes.errors import SceneError
from scenes.keys import DEVICE, SINK, type_of
from scenes.loading import as_dict, builtin_text, check, distinguishes, from_dict, load
from scenes.model import Material
from scenes.schema import nest
from tests.scenes.test_load import CHANGED as OF_THE_SINK
from tests.scenes.test_load import EXPECTED as SINK_EXPECTED

CHANGED = {
    **{path: value for path, value in OF_THE_SINK.items() if not path.startswith("checks.")},
    "sink.spans": 1, "environment.emissivity": 0,
    "device.sensor_thickness": "50 nm", "device.insulator_thickness": "5 um", "device.polymer_thickness": "50 um",
    "materials.gold.thermal_conductivity": 300, "materials.gold.density": "19 g/cm3",
    "materials.gold.specific_heat": 130, "materials.gold.resistivity": "3e-6 ohm cm",
    "materials.gold.temperature_coefficient": "3000 ppm/K", "materials.gold.reference_temperature": "20 degC",
    "materials.pdms.thermal_conductivity": 0.2, "materials.pdms.density": 1000, "materials.pdms.specific_heat": 1500,
    "materials.pdms.resistivity": "1e13 ohm m", "materials.pdms.temperature_coefficient": 1e-3,
    "materials.pdms.reference_temperature": 300, "materials.pdms.valid_to": 500,
    "materials.gold.valid_to": 900, "control.sample_time": "1 ms", "control.sink_gain": "500 mV",
    "control.sensor_gain": 0.01, "control.set_temperature": "40 degC", "control.allow_negative_voltage": True,
    "control.ground_resistance": "2 mohm",
    "external.initial_temperature": "20 degC", "external.final_temperature": 280, "external.step_time": "2 ms",
    "run.accuracy_3d": 1e-4,
    "checks.tolerances": {"fig9_settling": "10 %"}, "checks.expect_differs": ["fig12_same_time"],
}  # fmt: skip
EXPECTED = Device(
    sink=replace(
        SINK_EXPECTED, spans=1, emissivity=0.0, end_time=0.02, accuracy=1e-3, name="sink",
        tolerances={},
        expected_to_differ=None,
    ),
    sensor_thickness=50e-9, insulator_thickness=5e-6, polymer_thickness=50e-6,
    gold=Material("gold", 300.0, 19000.0, 130.0, 3e-8, 3e-3, 293.15, 900.0),
    pdms=Material("pdms", 0.2, 1000.0, 1500.0, None, 1e-3, 300.0, 500.0),
    control=Control(1e-3, 0.5, 0.01, 313.15, True, 2e-3), external=External(293.15, 280.0, 2e-3),
    end_time=5e-3, accuracy=2e-3, accuracy_3d=1e-4, name="mine", tolerances={"fig9_settling": 0.1},
    expected_to_differ=("fig12_same_time",),
)  # fmt: skip


def device(*settings):
    return load("device", settings, scene_type=DEVICE)


def test_the_built_in_device_is_the_default_one():
    assert replace(device(), expected_to_differ=None) == Device()
    in_3d = ("dev3d_sink_power", "dev3d_sink_voltage", "dev3d_claim_over_time")
    assert device().expected_to_differ == ("fig9_settling", "fig12_same_time", "meter_rate", *in_3d)


def test_the_built_in_file_shows_every_key():
    stated = DEVICE.schema.flatten(tomllib.loads(builtin_text("device")))
    only_of_a_sink = {"sink.spans", "sink.island_length", "environment.emissivity"}
    in_place = {f"materials.{name}.electrical_conductivity" for name in ("silicon", "gold")}
    unsaid = {"anchor.oxide_offset", "checks.tolerances"} | only_of_a_sink | in_place
    assert set(DEVICE.schema.paths) - set(stated) == unsaid


def test_every_key_reaches_its_own_attribute():
    assert {path for path in DEVICE.schema.paths if not path.endswith("electrical_conductivity")} == set(CHANGED)
    assert from_dict(nest(CHANGED), DEVICE) == EXPECTED


def test_a_sinks_file_can_be_extended_to_a_devices(tmp_path):
    sections = builtin_text("sink").partition("[checks]")[0]
    (tmp_path / "mine.toml").write_text(
        sections.replace("1e-3 ", "1e-5 ") + '[control]\nsink_gain = "2 V"\n', encoding="utf-8"
    )
    assert load(tmp_path / "mine.toml", scene_type=DEVICE).control.sink_gain == 2.0
    assert {path for path in SINK.schema.paths} <= set(DEVICE.schema.paths)


@pytest.mark.parametrize("scene", [Device(), EXPECTED, device()], ids=range(3))
def test_the_dictionary_survives_json_and_rebuilds_an_equal_device(scene):
    assert from_dict(json.loads(json.dumps(as_dict(scene), allow_nan=False)), DEVICE) == scene


def test_expectations_hold_only_for_the_device_that_declares_them():
    assert device("accuracy=1e-4", "tolerances.fig11_slow=0.1").expected_to_differ
    assert device("sensor_gain=0.06").expected_to_differ is None
    assert device("gold.density=1e4").expected_to_differ is None


@pytest.mark.parametrize("key", ["drive.voltage", "voltage", "drive.current", "drive.series_resistance"])
def test_what_drives_a_sink_is_refused_where_it_is_set_of_a_device(key):
    with pytest.raises(SceneError, match=r"^drive\.\w+ says nothing of a device, whose controllers drive it"):
        device(f"{key}=1")


def test_what_distinguishes_it():
    assert distinguishes(device()) == "273K"
    assert distinguishes(device("sample_time=5ms", "final_temperature=-80 degC")) == "193.15K-sample_time5ms"
    assert distinguishes(device("allow_negative_voltage=true")) == "273K-allow_negative_voltagetrue"
    assert re.fullmatch(r"[\w.+-]{70,80}", distinguishes(EXPECTED))


def test_a_device_made_in_python_is_checked():
    assert check(Device()) == Device()
    with pytest.raises(SceneError, match="asks for cooling"):
        check(replace(Device(), control=Control(set_temperature=293.0)))
    with pytest.raises(TypeError):
        type_of(3)
